/**
 * @file GridIndex.h
 * @brief From places to voxels of a grid.
 */
#ifndef DynamicCoronary_GridIndex_h
#define DynamicCoronary_GridIndex_h

#include "Geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace coronary
{
/// Continuous index of a position in mm.
inline Vector3 GridIndex(const ImageGrid& grid, const Vector3& world)
{
  return (grid.direction.transpose() * (world - grid.origin)).cwiseQuotient(grid.spacing);
}

/// Whether a voxel of the grid is at a continuous index.
inline bool IsInGrid(const ImageGrid& grid, const Vector3& index)
{
  for (int axis = 0; axis < 3; ++axis)
  {
    if (!(index[axis] >= grid.extent[2 * axis] - 0.5) ||
      !(index[axis] <= grid.extent[2 * axis + 1] + 0.5))
    {
      return false;
    }
  }
  return true;
}

/// Voxels along i, j and k.
inline std::array<int, 3> GridDimensions(const ImageGrid& grid)
{
  const std::array<int, 6>& e = grid.extent;
  return { e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1 };
}

/// Number of voxels.
inline std::size_t GridSize(const ImageGrid& grid)
{
  const std::array<int, 3> size = GridDimensions(grid);
  return static_cast<std::size_t>(size[0]) * size[1] * size[2];
}

/// Place of a voxel in memory, i fastest.
inline std::size_t GridOffset(const ImageGrid& grid, int i, int j, int k)
{
  const std::array<int, 6>& e = grid.extent;
  const std::array<int, 3> size = GridDimensions(grid);
  return (static_cast<std::size_t>(k - e[4]) * size[1] + static_cast<std::size_t>(j - e[2])) *
    size[0] +
    static_cast<std::size_t>(i - e[0]);
}

/// Inclusive ranges of indices; empty where a low one is above its high one.
struct IndexBox
{
  std::array<int, 3> low;
  std::array<int, 3> high;

  bool IsEmpty() const { return low[0] > high[0] || low[1] > high[1] || low[2] > high[2]; }

  /// Calls f(i, j, k), i fastest.
  template <typename F>
  void ForEach(const F& f) const
  {
    for (int k = low[2]; k <= high[2]; ++k)
    {
      for (int j = low[1]; j <= high[1]; ++j)
      {
        for (int i = low[0]; i <= high[0]; ++i)
        {
          f(i, j, k);
        }
      }
    }
  }
};

/// What of an extent is at most so many `steps` along each axis from a continuous index.
inline IndexBox BoxAround(
  const Vector3& index, const Vector3& steps, const std::array<int, 6>& extent)
{
  IndexBox box;
  for (int axis = 0; axis < 3; ++axis)
  {
    const double low = extent[2 * axis];
    const double high = extent[2 * axis + 1];
    const double first = std::ceil(index[axis] - steps[axis]);
    const double last = std::floor(index[axis] + steps[axis]);
    // Limited on both sides: what lies far outside is no integer.
    box.low[axis] = static_cast<int>(std::clamp(first, low, high + 1.0));
    box.high[axis] = static_cast<int>(std::clamp(last, low - 1.0, high));
  }
  return box;
}
}

#endif
