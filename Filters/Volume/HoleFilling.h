/**
 * @file HoleFilling.h
 * @brief Triangles across holes of a surface, and between two of its rims.
 */
#ifndef DynamicCoronary_HoleFilling_h
#define DynamicCoronary_HoleFilling_h

#include "Geometry.h"

#include <functional>
#include <utility>
#include <vector>

namespace coronary
{
/// Across a triangle, as long as its area.
inline Vector3 AreaVector(const Vector3& a, const Vector3& b, const Vector3& c)
{
  return 0.5 * (b - a).cross(c - a);
}

/// Triangles over a rim's points (first) and new ones (after them).
struct SurfacePatch
{
  std::vector<Vector3> points;     ///< mm; the rim's, unchanged, then new ones
  std::vector<Triangle> triangles; ///< run along the rim in its order
};

/// Whether an edge between two of a rim's points must not be made, as the surface has it already.
using ForbiddenChord = std::function<bool(std::int64_t, std::int64_t)>;

/**
 * The triangulation of a closed polygon in space with the least bend between neighbours, then the
 * least area. Rims of more than 300 points are cut in two where they come near to themselves.
 * Source: Barequet and Sharir, Comput Aided Geom Design 12, 1995; Liepa, Filling holes in meshes,
 * Symp Geometry Processing 2003. Where every triangulation has a forbidden chord, a fan around a new
 * point.
 *
 * @param rim      mm, at least three points
 * @param outside  per rim point: the unit normal of the triangle beyond the edge to the next one;
 *                 empty: only the area counts
 */
SurfacePatch TriangulateHole(const std::vector<Vector3>& rim,
  const std::vector<Vector3>& outside = {}, const ForbiddenChord& forbidden = {});

/**
 * The band of least area between two rims that run in opposite directions (Fuchs, Kedem, Uselton,
 * Commun ACM 20, 1977): first's points come first, then second's.
 */
SurfacePatch TriangulateBand(const std::vector<Vector3>& first, const std::vector<Vector3>& second);

/**
 * Puts points into a patch until its triangles are as large as the rim wants them, swaps edges to
 * Delaunay ones, and moves the new points to a membrane. In a plane everything stays in the plane.
 *
 * @param rimSizes  edge length at each of the rim's points, mm
 */
void RefinePatch(
  SurfacePatch& patch, const std::vector<double>& rimSizes, const ForbiddenChord& forbidden = {});
}

#endif
