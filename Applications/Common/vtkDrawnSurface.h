/**
 * @file vtkDrawnSurface.h
 * @brief A surface with fewer triangles, for drawing, whose points are known wherever the surface goes.
 */
#ifndef vtkDrawnSurface_h
#define vtkDrawnSurface_h

#include "vtkSmartPointer.h"

#include <cstdint>
#include <vector>

class vtkPolyData;

namespace coronary
{
struct DrawnSurface
{
  vtkSmartPointer<vtkPolyData> data; ///< points and triangles, no arrays
  std::vector<std::int64_t> origin;  ///< per point: its number in the whole surface
};

/// Takes points away, and moves none, until there are about so many triangles; those of `whole` have to be
/// triangles. Keeps the topology: closed stays closed.
DrawnSurface MakeDrawnSurface(vtkPolyData* whole, std::int64_t triangles);
}

#endif
