/**
 * @file SurfaceDistance.h
 * @brief Signed distance to a closed triangle surface on a grid of voxels around it.
 */
#ifndef DynamicCoronary_SurfaceDistance_h
#define DynamicCoronary_SurfaceDistance_h

#include "Geometry.h"
#include "ParallelFor.h"

namespace coronary
{
/// Distance of a point to a triangle. Source: Ericson, Real-Time Collision Detection, 2005, 5.1.5.
double TriangleDistance(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

struct SurfaceDistance
{
  ImageGrid grid;
  std::vector<float> values;     ///< mm, positive inside, i fastest
  std::int64_t openEdges = 0;    ///< edges with one triangle
  std::int64_t doubtfulRows = 0; ///< rows of voxels that leave the surface more or less often than
                                 ///< they enter it
};

/**
 * Distances are exact within two voxels of the wall on both sides, and to a tenth of a voxel further
 * inside; further outside the value is minus two voxels. Inside is where a row of voxels has entered
 * the surface more often than it left it.
 *
 * @param spacing     mm; 0 takes an eighth of the mean diameter (4 volume / area), coarser if the box
 *                    has more than maximumVoxels
 * @throws std::invalid_argument for an empty surface, an index out of range, a point that is not
 *         finite; Cancelled
 */
SurfaceDistance ComputeSurfaceDistance(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, double spacing = 0.0,
  std::int64_t maximumVoxels = 24000000, const ProgressCallback& progress = {});
}

#endif
