/**
 * @file GridIndex.h
 * @brief From places to voxels of a grid.
 */
#ifndef DynamicCoronary_GridIndex_h
#define DynamicCoronary_GridIndex_h

#include "Geometry.h"

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
}

#endif
