/**
 * @file vtkScenePicture.h
 * @brief The anatomy as picture files, without a window.
 */
#ifndef vtkScenePicture_h
#define vtkScenePicture_h

#include "vtkNew.h"

#include <string>

class vtkRenderWindow;

namespace coronary
{
class vtkSimulatorScene;

/// Needs a display with OpenGL all the same: CanDraw() says whether there is one.
class vtkScenePicture
{
public:
  vtkScenePicture(const vtkSimulatorScene& scene, int width, int height);
  ~vtkScenePicture();
  vtkScenePicture(const vtkScenePicture&) = delete;
  vtkScenePicture& operator=(const vtkScenePicture&) = delete;

  /// The scene as it is now, PNG. @throws std::runtime_error naming the file
  void Write(const std::string& path);

private:
  vtkNew<vtkRenderWindow> Window;
};
}

#endif
