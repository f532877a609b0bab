/**
 * @file VoxelCell.h
 * @brief The eight voxels around a place in an image, and the trilinear value there.
 */
#ifndef DynamicCoronary_VoxelCell_h
#define DynamicCoronary_VoxelCell_h

#include <algorithm>
#include <array>
#include <cstdint>

namespace coronary
{
/// By parts of the way to the voxel after `corner` along i, then j, then k. `step` is from one voxel to the next.
template <typename Real, typename Value>
Real Trilinear(
  const Value* corner, const std::array<std::int64_t, 3>& step, const std::array<Real, 3>& part)
{
  const auto along = [&](const Value* at)
  {
    const auto a = static_cast<Real>(at[0]);
    return a + part[0] * (static_cast<Real>(at[step[0]]) - a);
  };
  const auto plane = [&](const Value* at)
  {
    const Real a = along(at);
    return a + part[1] * (along(at + step[1]) - a);
  };
  const Real a = plane(corner);
  return a + part[2] * (plane(corner + step[2]) - a);
}

/// What one of the eight voxels, bits 0 to 2 of `corner` for upper i, j, k, counts in a trilinear value.
template <typename Real>
Real TrilinearWeight(int corner, const std::array<Real, 3>& part)
{
  const auto along = [&](int axis)
  { return (corner >> axis & 1) != 0 ? part[axis] : Real(1) - part[axis]; };
  return along(0) * along(1) * along(2);
}

/// Where in an image's memory, i fastest, the eight voxels around a place are.
template <typename Real>
struct VoxelCell
{
  std::int64_t first = 0; ///< of the lowest one
  std::array<std::int64_t, 3>
    step{}; ///< to the next one along i, j, k; 0 where the image is one voxel thick
  std::array<Real, 3> part{}; ///< of the way from the lowest voxel to the next, 0 to 1

  /// Beyond the image's borders the nearest place on them is taken.
  /// @param index  in voxels, x, y, z by operator[] @param extent  inclusive ranges of indices
  template <typename Index>
  VoxelCell(const Index& index, const std::array<int, 6>& extent)
  {
    std::int64_t stride = 1;
    for (int axis = 0; axis < 3; ++axis)
    {
      const int low = extent[2 * axis];
      const int high = extent[2 * axis + 1];
      const double x =
        std::min(std::max(index[axis], static_cast<double>(low)), static_cast<double>(high));
      const int truncated = static_cast<int>(x);
      const int base =
        std::clamp(truncated > x ? truncated - 1 : truncated, low, std::max(low, high - 1));
      this->part[axis] = static_cast<Real>(x - base);
      this->first += (base - low) * stride;
      this->step[axis] = low < high ? stride : 0;
      stride *= high - low + 1;
    }
  }

  template <typename Value>
  Real Interpolate(const Value* values) const
  {
    return Trilinear(values + this->first, this->step, this->part);
  }
};
}

#endif
