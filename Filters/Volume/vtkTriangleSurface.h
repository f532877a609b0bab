/**
 * @file vtkTriangleSurface.h
 * @brief Points and triangles of a vtkPolyData for the algorithms; private to this module.
 */
#ifndef vtkTriangleSurface_h
#define vtkTriangleSurface_h

#include "Geometry.h"

#include <vector>

class vtkPolyData;

namespace vtkCoronary
{
std::vector<coronary::Vector3> ReadPoints(vtkPolyData* data);

/// The polygons; cells of other kinds are passed over.
/// @throws std::invalid_argument for a strip, or a polygon with more or fewer than three corners
std::vector<coronary::Triangle> ReadTriangles(vtkPolyData* surface);
}

#endif
