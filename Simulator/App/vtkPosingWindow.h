/**
 * @file vtkPosingWindow.h
 * @brief A window in which the coronary arteries follow the joints of their skeleton.
 */
#ifndef vtkPosingWindow_h
#define vtkPosingWindow_h

#include "vtkPosingModel.h"

#include <string>

namespace coronary
{
/**
 * Returns when the window has been closed, or with `screenshots` after the last picture. Needs a display with
 * OpenGL 3.2.
 * @param folder  of `coronary-pipeline run --until weights`
 * @return 0; 1 when a picture or a file could not be written: the reason was printed
 * @throws std::runtime_error: no display or no OpenGL; as vtkPosingModel
 */
int RunPosingWindow(const std::string& folder, const PosingOptions& options);
}

#endif
