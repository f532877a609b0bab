#include "MaskResampling.h"

#include "ParallelFor.h"
#include "VoxelCell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
/// Of a voxel: what is nearer than that is the same place.
constexpr double SameVoxel = 1e-3;

/// Affine map from the indices of one grid to those of another.
struct IndexMap
{
  Matrix3 matrix;
  Vector3 offset;

  IndexMap(const ImageGrid& from, const ImageGrid& to)
  {
    const Matrix3 inverse =
      to.spacing.cwiseInverse().asDiagonal() * Matrix3(to.direction.transpose());
    this->matrix = inverse * from.direction * from.spacing.asDiagonal();
    this->offset = inverse * (from.origin - to.origin);
  }

  Vector3 operator()(double i, double j, double k) const
  {
    return this->matrix * Vector3(i, j, k) + this->offset;
  }
};

/// Smallest and largest index along each axis, as whole numbers.
using Box = std::array<std::int64_t, 6>;

std::array<std::int64_t, 3> SizeOf(const ImageGrid& grid)
{
  std::array<std::int64_t, 3> size{};
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    size[axis] = std::int64_t(grid.extent[2 * axis + 1]) - std::int64_t(grid.extent[2 * axis]) + 1;
  }
  return size;
}

/// The smallest box of the grid's voxels around the corners of a box of another grid.
Box Covered(const IndexMap& map, const Box& box, const ImageGrid& grid)
{
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::max());
  Vector3 high = -low;
  for (int corner = 0; corner < 8; ++corner)
  {
    const auto at = [&](int axis)
    {
      const auto a = static_cast<std::size_t>(axis);
      return (corner >> axis) & 1 ? static_cast<double>(box[2 * a + 1]) + 1.0
                                  : static_cast<double>(box[2 * a]) - 1.0;
    };
    const Vector3 index = map(at(0), at(1), at(2));
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  }
  Box covered{};
  for (int axis = 0; axis < 3; ++axis)
  {
    const auto a = static_cast<std::size_t>(axis);
    covered[2 * a] = static_cast<std::int64_t>(
      std::ceil(std::max(low[axis], static_cast<double>(grid.extent[2 * a]))));
    covered[2 * a + 1] = static_cast<std::int64_t>(
      std::floor(std::min(high[axis], static_cast<double>(grid.extent[2 * a + 1]))));
  }
  return covered;
}

bool IsEmpty(const Box& box)
{
  return box[0] > box[1] || box[2] > box[3] || box[4] > box[5];
}

std::string Extents(const ImageGrid& grid)
{
  const std::array<int, 6>& e = grid.extent;
  Vector3 low = grid.IndexToWorld(e[0], e[2], e[4]);
  Vector3 high = low;
  for (int corner = 1; corner < 8; ++corner)
  {
    const Vector3 point =
      grid.IndexToWorld(e[corner & 1], e[2 + ((corner >> 1) & 1)], e[4 + ((corner >> 2) & 1)]);
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  char text[160];
  std::snprintf(text, sizeof(text), "%.1f..%.1f, %.1f..%.1f, %.1f..%.1f mm", low[0], high[0],
    low[1], high[1], low[2], high[2]);
  return text;
}

/// A mask to be asked at indices that need not be whole.
struct MaskView
{
  const std::vector<unsigned char>& voxels;
  const ImageGrid& grid;
  std::array<std::int64_t, 3> size;

  bool Whole(std::int64_t i, std::int64_t j, std::int64_t k) const
  {
    i -= this->grid.extent[0];
    j -= this->grid.extent[2];
    k -= this->grid.extent[4];
    return i >= 0 && j >= 0 && k >= 0 && i < this->size[0] && j < this->size[1] &&
      k < this->size[2] &&
      this->voxels[static_cast<std::size_t>((k * this->size[1] + j) * this->size[0] + i)] != 0;
  }

  bool Nearest(const Vector3& index) const
  {
    return this->Whole(static_cast<std::int64_t>(std::llround(index[0])),
      static_cast<std::int64_t>(std::llround(index[1])),
      static_cast<std::int64_t>(std::llround(index[2])));
  }

  bool Linear(const Vector3& index) const
  {
    const Vector3 base = index.array().floor();
    const std::array<double, 3> part = { index[0] - base[0], index[1] - base[1],
      index[2] - base[2] };
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner)
    {
      std::array<std::int64_t, 3> at{};
      for (int axis = 0; axis < 3; ++axis)
      {
        at[static_cast<std::size_t>(axis)] =
          static_cast<std::int64_t>(base[axis]) + ((corner >> axis) & 1);
      }
      const double weight = TrilinearWeight(corner, part);
      sum += weight > 0.0 && this->Whole(at[0], at[1], at[2]) ? weight : 0.0;
    }
    // What is half by rounding errors alone must not depend on them.
    return sum >= 0.5 - 1e-9;
  }
};

/// The box of the voxels that are set.
Box BoxOf(const MaskView& mask)
{
  Box box{ std::numeric_limits<int>::max(), std::numeric_limits<int>::min(),
    std::numeric_limits<int>::max(), std::numeric_limits<int>::min(),
    std::numeric_limits<int>::max(), std::numeric_limits<int>::min() };
  std::size_t voxel = 0;
  for (std::int64_t k = 0; k < mask.size[2]; ++k)
  {
    for (std::int64_t j = 0; j < mask.size[1]; ++j)
    {
      for (std::int64_t i = 0; i < mask.size[0]; ++i, ++voxel)
      {
        if (mask.voxels[voxel] != 0)
        {
          const std::array<std::int64_t, 3> at{ i + mask.grid.extent[0], j + mask.grid.extent[2],
            k + mask.grid.extent[4] };
          for (std::size_t axis = 0; axis < 3; ++axis)
          {
            box[2 * axis] = std::min(box[2 * axis], at[axis]);
            box[2 * axis + 1] = std::max(box[2 * axis + 1], at[axis]);
          }
        }
      }
    }
  }
  return box;
}

double ShareInside(const MaskView& mask, const Box& box, const ImageGrid& image)
{
  const IndexMap map(mask.grid, image);
  std::int64_t all = 0;
  std::int64_t inside = 0;
  for (std::int64_t k = box[4]; k <= box[5]; ++k)
  {
    for (std::int64_t j = box[2]; j <= box[3]; ++j)
    {
      for (std::int64_t i = box[0]; i <= box[1]; ++i)
      {
        if (!mask.Whole(i, j, k))
        {
          continue;
        }
        ++all;
        const Vector3 at =
          map(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
        bool in = true;
        for (int axis = 0; axis < 3; ++axis)
        {
          const auto a = static_cast<std::size_t>(axis);
          in = in && at[axis] >= image.extent[2 * a] - 0.5 - SameVoxel &&
            at[axis] <= image.extent[2 * a + 1] + 0.5 + SameVoxel;
        }
        inside += in ? 1 : 0;
      }
    }
  }
  return all > 0 ? static_cast<double>(inside) / static_cast<double>(all) : 1.0;
}
}

ResampledMask ResampleMask(
  const ImageGrid& grid, const std::vector<unsigned char>& voxels, const ImageGrid& image)
{
  const MaskView mask{ voxels, grid, SizeOf(grid) };
  if (static_cast<std::int64_t>(voxels.size()) != mask.size[0] * mask.size[1] * mask.size[2])
  {
    throw std::invalid_argument(
      "The mask has " + std::to_string(voxels.size()) + " voxels, which its grid has not");
  }
  const IndexMap toImage(grid, image);
  const IndexMap toMask(image, grid);
  const auto& e = grid.extent;
  if (IsEmpty(Covered(toImage, Box{ e[0], e[1], e[2], e[3], e[4], e[5] }, image)))
  {
    throw std::invalid_argument(
      "The mask (" + Extents(grid) + ") does not overlap the image (" + Extents(image) + ")");
  }
  ResampledMask result;
  const std::array<std::int64_t, 3> size = SizeOf(image);
  result.voxels.assign(static_cast<std::size_t>(size[0] * size[1] * size[2]), 0);
  const Box set = BoxOf(mask);
  const Box wanted = IsEmpty(set) ? set : Covered(toImage, set, image);
  // The matrix and the shift are whole at one corner, and stay so to the other.
  const double drift = static_cast<double>(std::max({ size[0], size[1], size[2] }));
  const Matrix3 whole = toMask.matrix.array().round();
  const Vector3 shift = toMask.offset.array().round();
  result.sameVoxels = (toMask.matrix - whole).cwiseAbs().maxCoeff() * drift < SameVoxel &&
    (toMask.offset - shift).cwiseAbs().maxCoeff() < SameVoxel &&
    std::abs(std::abs(whole.determinant()) - 1.0) < 1e-6;
  if (!IsEmpty(set) && !IsEmpty(wanted))
  {
    const auto fill = [&](std::int64_t k)
    {
      for (std::int64_t j = wanted[2]; j <= wanted[3]; ++j)
      {
        for (std::int64_t i = wanted[0]; i <= wanted[1]; ++i)
        {
          const Vector3 at =
            toMask(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
          const auto voxel = static_cast<std::size_t>(
            ((k - image.extent[4]) * size[1] + (j - image.extent[2])) * size[0] +
            (i - image.extent[0]));
          result.voxels[voxel] = (result.sameVoxels ? mask.Nearest(at) : mask.Linear(at)) ? 1 : 0;
        }
      }
    };
    ParallelFor(wanted[5] - wanted[4] + 1, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          fill(wanted[4] + n);
        }
      });
    for (const unsigned char value : result.voxels)
    {
      result.count += value;
    }
    result.insideShare = ShareInside(mask, set, image);
  }
  if (result.count == 0)
  {
    throw std::invalid_argument("No voxel of the mask lies in the image (" + Extents(image) + ")");
  }
  return result;
}
}
