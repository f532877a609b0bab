/**
 * @file vtkDisplay.h
 * @brief Whether there is something to draw on.
 */
#ifndef vtkDisplay_h
#define vtkDisplay_h

#include <string>

namespace coronary
{
/**
 * Whether pictures can be drawn here. VTK ends the process when it finds no X server, so this asks for one
 * before; a VTK made for EGL or OSMesa needs none.
 * @param why  what is missing, a sentence
 */
bool CanDraw(std::string& why);
}

#endif
