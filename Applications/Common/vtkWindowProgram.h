/**
 * @file vtkWindowProgram.h
 * @brief Qt for a program whose windows VTK draws into.
 */
#ifndef vtkWindowProgram_h
#define vtkWindowProgram_h

#include <memory>
#include <string>

class QApplication;

namespace coronary
{
/// What can be known before anything is made, which takes long. @throws std::runtime_error: there is no display
void RequireDisplay();

/// Qt as long as it lives. Windows are made after it.
class vtkWindowProgram
{
public:
  /**
   * @param name   of the program
   * @param title  of its windows
   * @throws std::runtime_error: there is no display, or none with OpenGL 3.2
   */
  vtkWindowProgram(const std::string& name, const char* title);
  ~vtkWindowProgram();
  vtkWindowProgram(const vtkWindowProgram&) = delete;
  vtkWindowProgram& operator=(const vtkWindowProgram&) = delete;

private:
  // The application refers to these.
  std::string Name;
  int Count = 1;
  char* Arguments[2];
  std::unique_ptr<QApplication> Application;
};
}

#endif
