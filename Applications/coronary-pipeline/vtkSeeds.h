/**
 * @file vtkSeeds.h
 * @brief Points where trees of vessels begin.
 */
#ifndef vtkSeeds_h
#define vtkSeeds_h

#include "Geometry.h"

#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <string>
#include <vector>

namespace coronary
{
/**
 * Points as vertices with `Name` and `Confidence`, as vtkVesselSegmentation gives them.
 * @param positions   LPS, mm
 * @param confidence  of each, 0 to 1
 * @param names       of the first positions; who has none, or an empty one, is called by its number
 */
vtkSmartPointer<vtkPolyData> MakeSeeds(const std::vector<Vector3>& positions, double confidence,
  const std::vector<std::string>& names = {});
}

#endif
