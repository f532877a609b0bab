/**
 * @file VoxelLattice.h
 * @brief Voxels by number: places, neighbours and their distances; and blocks of about 0.7 mm on them.
 */
#ifndef DynamicCoronary_VoxelLattice_h
#define DynamicCoronary_VoxelLattice_h

#include "Geometry.h"
#include "ScalarImage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace coronary
{
/// The voxel grid, and blocks of about 0.7 mm on it for what needs no more detail.
class VoxelLattice
{
public:
  /// A neighbour of a voxel: index differences, difference of numbers and distance.
  struct Neighbour
  {
    int di;
    int dj;
    int dk;
    std::int64_t offset;
    float length; ///< mm
  };

  explicit VoxelLattice(const ImageGrid& grid)
    : Spacing(grid.spacing)
    , Grid(grid)
  {
    constexpr double blockSize = 0.75; // mm
    for (int axis = 0; axis < 3; ++axis)
    {
      this->Size[axis] = grid.extent[2 * axis + 1] - grid.extent[2 * axis] + 1;
      this->Factor[axis] =
        std::max(1, static_cast<int>(std::floor(blockSize / grid.spacing[axis] + 0.25)));
      this->Blocks[axis] = (this->Size[axis] + this->Factor[axis] - 1) / this->Factor[axis];
      this->BlockSpacing[axis] = grid.spacing[axis] * this->Factor[axis];
    }
    for (int dk = -1; dk <= 1; ++dk)
    {
      for (int dj = -1; dj <= 1; ++dj)
      {
        for (int di = -1; di <= 1; ++di)
        {
          if (di != 0 || dj != 0 || dk != 0)
          {
            this->Around.push_back({ di, dj, dk, this->Index(di, dj, dk),
              static_cast<float>(grid.spacing.cwiseProduct(Vector3(di, dj, dk)).norm()) });
          }
        }
      }
    }
  }

  std::int64_t Index(int i, int j, int k) const
  {
    return (static_cast<std::int64_t>(k) * this->Size[1] + j) * this->Size[0] + i;
  }
  std::array<int, 3> Place(std::int64_t p) const
  {
    const std::int64_t row = p / this->Size[0];
    return { static_cast<int>(p % this->Size[0]), static_cast<int>(row % this->Size[1]),
      static_cast<int>(row / this->Size[1]) };
  }
  std::int64_t Block(int a, int b, int c) const
  {
    return (static_cast<std::int64_t>(c) * this->Blocks[1] + b) * this->Blocks[0] + a;
  }
  std::array<int, 3> PlaceOfBlock(const std::array<int, 3>& p) const
  {
    return { p[0] / this->Factor[0], p[1] / this->Factor[1], p[2] / this->Factor[2] };
  }
  std::int64_t BlockOf(const std::array<int, 3>& p) const
  {
    return this->Block(p[0] / this->Factor[0], p[1] / this->Factor[1], p[2] / this->Factor[2]);
  }
  bool Contains(int i, int j, int k) const
  {
    return i >= 0 && j >= 0 && k >= 0 && i < this->Size[0] && j < this->Size[1] &&
      k < this->Size[2];
  }
  double VoxelVolume() const { return this->Spacing.prod(); }

  /// The voxel of a place; nothing outside the image, and for what is no number.
  std::optional<std::array<int, 3>> Nearest(const Vector3& world) const
  {
    const Vector3 index = this->Spacing.cwiseInverse().cwiseProduct(
      this->Grid.direction.transpose() * (world - this->Grid.origin));
    std::array<int, 3> place;
    for (int axis = 0; axis < 3; ++axis)
    {
      const double inside = index[axis] - this->Grid.extent[2 * axis];
      if (!(inside >= -0.5 && inside <= this->Size[axis] - 0.5))
      {
        return std::nullopt;
      }
      place[axis] = std::clamp(static_cast<int>(std::lround(inside)), 0, this->Size[axis] - 1);
    }
    return place;
  }
  Vector3 World(const std::array<int, 3>& p) const
  {
    return this->Grid.IndexToWorld(
      p[0] + this->Grid.extent[0], p[1] + this->Grid.extent[2], p[2] + this->Grid.extent[4]);
  }
  /// Corners of a box that holds all voxels within `radius` mm of a place; a voxel of the image at least.
  void BoxAround(
    const Vector3& world, double radius, std::array<int, 3>& low, std::array<int, 3>& high) const
  {
    const Vector3 index = this->Spacing.cwiseInverse().cwiseProduct(
      this->Grid.direction.transpose() * (world - this->Grid.origin));
    for (int axis = 0; axis < 3; ++axis)
    {
      const double middle = index[axis] - this->Grid.extent[2 * axis];
      const double reach = radius / this->Spacing[axis] + 1.0;
      const double last = this->Size[axis] - 1;
      low[axis] = static_cast<int>(std::clamp(std::floor(middle - reach), 0.0, last));
      high[axis] = static_cast<int>(std::clamp(std::ceil(middle + reach), 0.0, last));
    }
  }
  /// Calls f(voxel, place) for the voxels within `radius` mm of a place.
  template <typename F>
  void Ball(const std::array<int, 3>& centre, double radius, const F& f) const
  {
    std::array<int, 3> low;
    std::array<int, 3> high;
    for (int axis = 0; axis < 3; ++axis)
    {
      const int reach = static_cast<int>(radius / this->Spacing[axis]);
      low[axis] = std::max(0, centre[axis] - reach);
      high[axis] = std::min(this->Size[axis] - 1, centre[axis] + reach);
    }
    for (int k = low[2]; k <= high[2]; ++k)
    {
      for (int j = low[1]; j <= high[1]; ++j)
      {
        for (int i = low[0]; i <= high[0]; ++i)
        {
          const Vector3 d =
            this->Spacing.cwiseProduct(Vector3(i - centre[0], j - centre[1], k - centre[2]));
          if (d.squaredNorm() <= radius * radius)
          {
            f(this->Index(i, j, k), std::array<int, 3>{ i, j, k });
          }
        }
      }
    }
  }
  /// Calls f(voxel, mm) for the up to 26 neighbours of a voxel in the image.
  template <typename F>
  void Neighbours(std::int64_t voxel, const F& f) const
  {
    const std::array<int, 3> at = this->Place(voxel);
    for (const Neighbour& n : this->Around)
    {
      if (this->Contains(at[0] + n.di, at[1] + n.dj, at[2] + n.dk))
      {
        f(voxel + n.offset, n.length);
      }
    }
  }
  /// What hangs together with a voxel by any of the 26 neighbours, nearest first; nothing if that is not taken.
  /// @param take  whether a voxel is free; it is not any more
  template <typename Take>
  std::vector<std::int64_t> Connected(std::int64_t first, const Take& take) const
  {
    std::vector<std::int64_t> piece;
    const auto add = [&](std::int64_t voxel)
    {
      if (take(voxel))
      {
        piece.push_back(voxel);
      }
    };
    add(first);
    for (std::size_t n = 0; n < piece.size(); ++n)
    {
      this->Neighbours(piece[n], [&](std::int64_t next, float) { add(next); });
    }
    return piece;
  }

  std::array<int, 3> Size;
  Vector3 Spacing;
  std::array<int, 3> Factor;
  std::array<int, 3> Blocks;
  Vector3 BlockSpacing;
  std::vector<Neighbour> Around; ///< the 26 neighbours
  ImageGrid Grid;
};
}

#endif
