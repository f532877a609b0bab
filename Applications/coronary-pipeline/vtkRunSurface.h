/**
 * @file vtkRunSurface.h
 * @brief Surfaces that `run` starts from: made fit, and with the places where their trees begin.
 */
#ifndef vtkRunSurface_h
#define vtkRunSurface_h

#include "vtkSmartPointer.h"

#include <vector>

class vtkPolyData;

namespace coronary
{
/**
 * Seeds in a surface, as vtkVesselSegmentation gives them.
 * @param given  coordinates, three a point; none: a point of every component, which is only good to find its vessels
 */
vtkSmartPointer<vtkPolyData> SeedsOfSurface(vtkPolyData* surface, const std::vector<double>& given);

/**
 * Of every tree its widest end, where it most probably begins, with a low confidence.
 * @param trees  as of vtkFastMarchingCenterline, from any seeds
 */
vtkSmartPointer<vtkPolyData> WidestEnds(vtkPolyData* trees);
}

#endif
