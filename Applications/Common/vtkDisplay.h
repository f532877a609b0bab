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
 * Whether there is an X server that draws: what a window needs.
 * @param why  what is missing, a sentence
 */
bool HasDisplay(std::string& why);

/**
 * Whether pictures can be drawn here. VTK ends the process when it finds no X server, so this asks for one
 * before; a VTK for EGL or OSMesa, as 9.6 is where there is no display, needs none.
 * @param why  what is missing, a sentence
 */
bool CanDraw(std::string& why);
}

#endif
