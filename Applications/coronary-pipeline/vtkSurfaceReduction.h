/**
 * @file vtkSurfaceReduction.h
 * @brief Fewer triangles on some of a surface's own points, so that the same choice serves all phases of a moving one.
 */
#ifndef vtkSurfaceReduction_h
#define vtkSurfaceReduction_h

#include "Geometry.h"

#include "vtkType.h"

#include <vector>

class vtkPolyData;

namespace coronary
{
struct ReducedSurface
{
  std::vector<vtkIdType> points;   ///< of the surface, increasing; those that a triangle has
  std::vector<Triangle> triangles; ///< indices into `points`
};

/// About `wanted` triangles, more where the shape can not be kept otherwise; all of them when there are no more.
/// @param surface  triangles
ReducedSurface ReduceSurface(vtkPolyData* surface, vtkIdType wanted);
}

#endif
