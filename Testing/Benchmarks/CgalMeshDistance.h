// CGAL's Hausdorff distance, for comparison.
#ifndef DynamicCoronary_CgalMeshDistance_h
#define DynamicCoronary_CgalMeshDistance_h

#include "MeshDistance.h"

namespace coronary
{
/// bounded_error_symmetric_Hausdorff_distance. Surfaces without degenerate triangles whose edges have
/// at most two triangles each.
double CgalHausdorffDistance(const SurfaceMesh& a, const SurfaceMesh& b, double errorBound);

/// bounded_error_Hausdorff_distance from a to b.
double CgalOneSidedHausdorffDistance(const SurfaceMesh& a, const SurfaceMesh& b, double errorBound);
}

#endif
