/**
 * @file WorldVolume.h
 * @brief An image resampled onto cubes along given axes: what the search for the ostia looks at.
 */
#ifndef DynamicCoronary_WorldVolume_h
#define DynamicCoronary_WorldVolume_h

#include "ParallelFor.h"
#include "ScalarImage.h"
#include "VoxelCell.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace coronary
{
/// Cubic voxels, i fastest.
struct WorldVolume
{
  static constexpr float Nothing = -2000.0f; ///< outside of the image; no tissue is that dark

  Vector3 corner;                     ///< centre of voxel (0, 0, 0), mm
  double spacing = 1.0;               ///< mm
  Matrix3 axes = Matrix3::Identity(); ///< orthonormal columns: world directions of i, j, k
  std::array<int, 3> size{ 0, 0, 0 };
  std::vector<float> values;

  std::int64_t Index(int i, int j, int k) const
  {
    return (static_cast<std::int64_t>(k) * this->size[1] + j) * this->size[0] + i;
  }
  std::array<int, 3> Place(std::int64_t p) const
  {
    const std::int64_t row = p / this->size[0];
    return { static_cast<int>(p % this->size[0]), static_cast<int>(row % this->size[1]),
      static_cast<int>(row / this->size[1]) };
  }
  Vector3 World(const Vector3& index) const
  {
    return this->corner + this->spacing * (this->axes * index);
  }
  Vector3 World(const std::array<int, 3>& p) const
  {
    return this->World(Vector3(p[0], p[1], p[2]));
  }
  Vector3 ToIndex(const Vector3& world) const
  {
    return this->axes.transpose() * (world - this->corner) / this->spacing;
  }
  ImageGrid Grid() const
  {
    ImageGrid grid;
    grid.extent = { 0, this->size[0] - 1, 0, this->size[1] - 1, 0, this->size[2] - 1 };
    grid.origin = this->corner;
    grid.spacing.setConstant(this->spacing);
    grid.direction = this->axes;
    return grid;
  }
  /// Trilinear; Nothing outside.
  float At(const Vector3& world) const;
};

/// Trilinear value of the corners that have one, or WorldVolume::Nothing outside and where none has.
template <typename T>
float InterpolateKnown(
  const T* values, const std::array<int, 3>& n, const std::array<double, 3>& position)
{
  for (int axis = 0; axis < 3; ++axis)
  {
    // Half a voxel of border belongs to the image.
    if (!(position[axis] >= -0.5 && position[axis] <= n[axis] - 0.5))
    {
      return WorldVolume::Nothing;
    }
  }
  const VoxelCell<float> cell(position, { 0, n[0] - 1, 0, n[1] - 1, 0, n[2] - 1 });
  const std::array<float, 3>& f = cell.part;
  const T* p = values + cell.first;
  const auto row = [&](const T* q)
  { return (1.0f - f[0]) * static_cast<float>(q[0]) + f[0] * static_cast<float>(q[cell.step[0]]); };
  const auto plane = [&](const T* q)
  { return (1.0f - f[1]) * row(q) + f[1] * row(q + cell.step[1]); };
  const float value = (1.0f - f[2]) * plane(p) + f[2] * plane(p + cell.step[2]);
  if (std::isfinite(value))
  {
    return value;
  }
  float sum = 0.0f;
  float weights = 0.0f;
  for (int corner = 0; corner < 8; ++corner)
  {
    const float at = static_cast<float>(p[(corner & 1 ? cell.step[0] : 0) +
      (corner & 2 ? cell.step[1] : 0) + (corner & 4 ? cell.step[2] : 0)]);
    const float weight = TrilinearWeight(corner, f);
    if (std::isfinite(at))
    {
      sum += weight * at;
      weights += weight;
    }
  }
  return weights > 0.0f ? sum / weights : WorldVolume::Nothing;
}

/**
 * The part of an image in a box, on cubes; each value is the mean of 2 x 2 x 2 samples.
 * @param low, high  corners of the box, in coordinates along `axes`: transpose(axes) * world, mm
 * @throws Cancelled
 */
WorldVolume ResampleToWorld(const ScalarImage& image, const Vector3& low, const Vector3& high,
  double spacing, const Matrix3& axes, const ProgressCallback& progress = {});

/// Box around the centres of an image's voxels, in coordinates along `axes`, mm.
std::pair<Vector3, Vector3> BoundsAlong(const ImageGrid& grid, const Matrix3& axes);
}

#endif
