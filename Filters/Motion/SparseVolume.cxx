#include "SparseVolume.h"

#include <algorithm>
#include <limits>
#include <type_traits>

namespace coronary
{
namespace
{
Matrix3 IndexFromWorld(const ImageGrid& grid)
{
  return (grid.direction * grid.spacing.asDiagonal()).inverse();
}
}

SparseVolume::SparseVolume(
  const ScalarImage& image, const std::vector<Vector3>& places, double reach)
{
  const ImageGrid& grid = image.grid;
  const std::array<int, 3> size = image.Dimensions();
  this->ToIndex = IndexFromWorld(grid);
  this->Origin = grid.IndexToWorld(grid.extent[0], grid.extent[2], grid.extent[4]);
  for (int axis = 0; axis < 3; ++axis)
  {
    this->Last[axis] = size[axis] - 1;
    this->Count[axis] = (size[axis] + Side - 1) / Side;
  }
  this->Bricks.assign(
    static_cast<std::size_t>(this->Count[0]) * this->Count[1] * this->Count[2], -1);
  std::int32_t bricks = 0;
  std::vector<std::array<int, 3>> corners;
  const Vector3 half = reach * this->ToIndex.cwiseAbs().rowwise().sum();
  for (const Vector3& place : places)
  {
    const Vector3 index = this->ToIndex * (place - this->Origin);
    int first[3];
    int last[3];
    bool inside = index.allFinite();
    for (int axis = 0; axis < 3 && inside; ++axis)
    {
      const double low = index[axis] - half[axis];
      const double high = index[axis] + half[axis];
      inside = high >= 0.0 && low <= this->Last[axis];
      first[axis] = static_cast<int>(std::max(low, 0.0)) / Side;
      last[axis] = static_cast<int>(std::min(high, this->Last[axis])) / Side;
    }
    if (!inside)
    {
      continue;
    }
    for (int k = first[2]; k <= last[2]; ++k)
    {
      for (int j = first[1]; j <= last[1]; ++j)
      {
        for (int i = first[0]; i <= last[0]; ++i)
        {
          std::int32_t& brick = this->Bricks[(k * this->Count[1] + j) * this->Count[0] + i];
          if (brick < 0)
          {
            brick = bricks++;
            corners.push_back({ i * Side, j * Side, k * Side });
          }
        }
      }
    }
  }
  constexpr int voxels = Stored * Stored * Stored;
  this->Values.resize(static_cast<std::size_t>(bricks) * voxels);
  std::visit(
    [&](const auto* values)
    {
      using Voxel = std::remove_cv_t<std::remove_pointer_t<decltype(values)>>;
      const std::int64_t rowStride = size[0];
      const std::int64_t sliceStride = rowStride * size[1];
      const auto forEach = [&](std::int32_t brick, const auto& action)
      {
        const std::array<int, 3>& corner = corners[brick];
        std::int16_t* out = this->Values.data() + static_cast<std::int64_t>(brick) * voxels;
        for (int k = 0; k < Stored; ++k)
        {
          const int z = std::min(corner[2] + k, size[2] - 1);
          for (int j = 0; j < Stored; ++j)
          {
            const int y = std::min(corner[1] + j, size[1] - 1);
            const Voxel* row = values + z * sliceStride + y * rowStride;
            for (int i = 0; i < Stored; ++i)
            {
              action(row[std::min(corner[0] + i, size[0] - 1)], *out++);
            }
          }
        }
      };
      if constexpr (std::is_same_v<Voxel, std::int16_t>)
      {
        ParallelFor(bricks, 64,
          [&](std::int64_t first, std::int64_t last)
          {
            for (std::int64_t brick = first; brick < last; ++brick)
            {
              forEach(static_cast<std::int32_t>(brick),
                [](Voxel voxel, std::int16_t& out) { out = voxel; });
            }
          });
      }
      else
      {
        // 65,536 steps between the least and the greatest value.
        auto minimum = std::numeric_limits<double>::infinity();
        double maximum = -minimum;
        for (std::int32_t brick = 0; brick < bricks; ++brick)
        {
          forEach(brick,
            [&](Voxel voxel, std::int16_t&)
            {
              const auto value = static_cast<double>(voxel);
              if (std::isfinite(value))
              {
                minimum = std::min(minimum, value);
                maximum = std::max(maximum, value);
              }
            });
        }
        if (!(minimum <= maximum))
        {
          minimum = maximum = 0.0;
        }
        const double scale = maximum > minimum ? (maximum - minimum) / 65535.0 : 1.0;
        this->Scale = static_cast<float>(scale);
        this->Offset = static_cast<float>(minimum + 32768.0 * scale);
        ParallelFor(bricks, 64,
          [&](std::int64_t first, std::int64_t last)
          {
            for (std::int64_t brick = first; brick < last; ++brick)
            {
              forEach(static_cast<std::int32_t>(brick),
                [&](Voxel voxel, std::int16_t& out)
                {
                  const auto value = static_cast<double>(voxel);
                  out = static_cast<std::int16_t>(
                    std::isfinite(value) ? std::lround((value - minimum) / scale) - 32768 : -32768);
                });
            }
          });
      }
    },
    image.values);
}

bool SparseVolume::Covers(const Vector3& place, double reach) const
{
  const Vector3 half = reach * this->ToIndex.cwiseAbs().rowwise().sum();
  const Vector3 index = this->ToIndex * (place - this->Origin);
  int first[3];
  int last[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    const double low = index[axis] - half[axis];
    const double high = index[axis] + half[axis];
    if (!(high >= 0.0 && low <= this->Last[axis]))
    {
      return true;
    }
    first[axis] = static_cast<int>(std::max(low, 0.0)) / Side;
    last[axis] = static_cast<int>(std::min(high, this->Last[axis])) / Side;
  }
  for (int k = first[2]; k <= last[2]; ++k)
  {
    for (int j = first[1]; j <= last[1]; ++j)
    {
      for (int i = first[0]; i <= last[0]; ++i)
      {
        if (this->Bricks[(k * this->Count[1] + j) * this->Count[0] + i] < 0)
        {
          return false;
        }
      }
    }
  }
  return true;
}

float AveragedVolume::Sample(const Vector3& world) const
{
  const std::array<int, 3>& n = this->dimensions;
  const VoxelCell<float> cell(
    this->toIndex * (world - this->origin), { 0, n[0] - 1, 0, n[1] - 1, 0, n[2] - 1 });
  return cell.Interpolate(this->values.data());
}

AveragedVolume AverageBlocks(
  const ScalarImage& image, double spacing, const Vector3& low, const Vector3& high)
{
  const ImageGrid& grid = image.grid;
  const std::array<int, 3> size = image.Dimensions();
  const Matrix3 toIndex = IndexFromWorld(grid);
  const Vector3 origin = grid.IndexToWorld(grid.extent[0], grid.extent[2], grid.extent[4]);
  Vector3 minimum = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 maximum = -minimum;
  for (int corner = 0; corner < 8; ++corner)
  {
    const Vector3 world((corner & 1) != 0 ? high[0] : low[0], (corner & 2) != 0 ? high[1] : low[1],
      (corner & 4) != 0 ? high[2] : low[2]);
    const Vector3 index = toIndex * (world - origin);
    minimum = minimum.cwiseMin(index);
    maximum = maximum.cwiseMax(index);
  }
  int block[3];
  int first[3];
  AveragedVolume result;
  for (int axis = 0; axis < 3; ++axis)
  {
    block[axis] =
      std::clamp(static_cast<int>(std::lround(spacing / grid.spacing[axis])), 1, size[axis]);
    first[axis] =
      std::clamp(static_cast<int>(std::floor(minimum[axis])), 0, size[axis] - block[axis]);
    const int last =
      std::clamp(static_cast<int>(std::ceil(maximum[axis])), first[axis], size[axis] - 1);
    result.dimensions[axis] = std::max(1, (last - first[axis] + 1) / block[axis]);
  }
  const Vector3 middle(first[0] + 0.5 * (block[0] - 1), first[1] + 0.5 * (block[1] - 1),
    first[2] + 0.5 * (block[2] - 1));
  result.origin = origin + toIndex.inverse() * middle;
  result.toIndex = Vector3(1.0 / block[0], 1.0 / block[1], 1.0 / block[2]).asDiagonal() * toIndex;
  const std::array<int, 3>& n = result.dimensions;
  result.values.resize(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
  std::visit(
    [&](const auto* values)
    {
      ParallelFor(static_cast<std::int64_t>(n[1]) * n[2], 4,
        [&](std::int64_t from, std::int64_t to)
        {
          for (std::int64_t row = from; row < to; ++row)
          {
            const auto j = static_cast<int>(row % n[1]);
            const auto k = static_cast<int>(row / n[1]);
            for (int i = 0; i < n[0]; ++i)
            {
              double sum = 0.0;
              int count = 0;
              for (int z = 0; z < block[2]; ++z)
              {
                for (int y = 0; y < block[1]; ++y)
                {
                  const auto* voxel = values +
                    (static_cast<std::int64_t>(first[2] + k * block[2] + z) * size[1] + first[1] +
                      j * block[1] + y) *
                      size[0] +
                    first[0] + i * block[0];
                  for (int x = 0; x < block[0]; ++x)
                  {
                    const auto value = static_cast<double>(voxel[x]);
                    if (std::isfinite(value))
                    {
                      sum += value;
                      ++count;
                    }
                  }
                }
              }
              result.values[row * n[0] + i] = count > 0 ? static_cast<float>(sum / count) : 0.0F;
            }
          }
        });
    },
    image.values);
  return result;
}
}
