/**
 * @file SurfaceEnds.h
 * @brief Surfaces made ready for a comparison: points merged, caps and ends cut off.
 */
#ifndef DynamicCoronary_SurfaceEnds_h
#define DynamicCoronary_SurfaceEnds_h

#include "MeshDistance.h"

namespace coronary
{
/// For each point the lowest number of a point at the same place. Points that are not finite stay alone.
std::vector<std::int32_t> MergeCoincidentPoints(const std::vector<Vector3>& points);

/// A surface without what is not compared.
struct ComparedSurface
{
  std::vector<Vector3> points;                        ///< distinct, all used
  std::vector<std::array<std::int32_t, 3>> triangles; ///< all three corners may be the same
  std::vector<std::int32_t> inputTriangle;            ///< one a triangle
  std::vector<std::int32_t> pointOfInput; ///< one a point of the input, -1: not compared
};

/// All triangles of a mesh, or those that are no caps and what `ends` leave of them.
ComparedSurface TakeSurface(
  const SurfaceMesh& mesh, const std::vector<SurfaceEnd>* ends, double endLength);
}

#endif
