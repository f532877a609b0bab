/**
 * @file DistanceTransform.h
 * @brief Exact Euclidean distance on anisotropic grids, and the opening that follows from it.
 */
#ifndef DynamicCoronary_DistanceTransform_h
#define DynamicCoronary_DistanceTransform_h

#include "Geometry.h"
#include "ParallelFor.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/**
 * Squared distance in mm^2 from the centre of each voxel to the centre of the nearest voxel whose
 * mask value is 0 (0 there). Beyond the image's border lies nothing: a mask without any 0 gives
 * infinity everywhere.
 *
 * Felzenszwalb and Huttenlocher, Theory of Computing 2012;8:415: linear in the number of voxels.
 * @param mask       i fastest
 * @param dimensions voxels along each axis, positive
 * @param spacing    mm, positive
 * @throws Cancelled
 */
std::vector<float> SquaredDistanceTransform(const unsigned char* mask,
  const std::array<int, 3>& dimensions, const Vector3& spacing,
  const ProgressCallback& progress = {});

/**
 * Where a voxel whose mask value is 0 is near: 1 where the squared distance transform is at most `square` mm^2, else 0.
 * Needs a byte a voxel, where the transform needs four; distances of up to 24 voxels are looked at in windows, which is quicker.
 * @throws Cancelled
 */
std::vector<unsigned char> NearZeros(const unsigned char* mask,
  const std::array<int, 3>& dimensions, const Vector3& spacing, double square,
  const ProgressCallback& progress = {});

/**
 * What a ball of `radius` mm covers while it stays inside the mask: 1 there, else 0. Keeps bodies
 * and drops tubes and sheets thinner than the ball.
 * @throws Cancelled
 */
std::vector<unsigned char> OpenWithBall(const unsigned char* mask,
  const std::array<int, 3>& dimensions, const Vector3& spacing, double radius,
  const ProgressCallback& progress = {});
}

#endif
