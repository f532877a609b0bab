/**
 * @file vtkRunSurface.h
 * @brief Surfaces that `run` starts from: read, made fit, and with the places where their trees begin.
 */
#ifndef vtkRunSurface_h
#define vtkRunSurface_h

#include "vtkSmartPointer.h"

#include <string>
#include <vector>

class vtkMessageTrap;
class vtkPolyData;

namespace coronary
{
/// Reads a .vtp, .obj, .off or .stl file. @throws std::runtime_error naming the file
vtkSmartPointer<vtkPolyData> ReadSurfaceInput(const std::string& path, vtkMessageTrap& messages);

/**
 * The roots of the trees of a surface, as vtkVesselSegmentation gives seeds.
 * @param given  coordinates, three a point; none: the highest point of every component, where coronary arteries
 *   leave the aorta, with a low confidence
 */
vtkSmartPointer<vtkPolyData> SeedsOfSurface(vtkPolyData* surface, const std::vector<double>& given);
}

#endif
