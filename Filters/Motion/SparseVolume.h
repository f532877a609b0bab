/**
 * @file SparseVolume.h
 * @brief The voxels of an image near some lines, and an averaged copy of an image.
 */
#ifndef DynamicCoronary_SparseVolume_h
#define DynamicCoronary_SparseVolume_h

#include "ParallelFor.h"
#include "ScalarImage.h"
#include "VoxelCell.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace coronary
{
/**
 * Keeps bricks of 8 x 8 x 8 voxels around given places; the rest of the image is not kept. A brick
 * has one more layer on its far sides, so that a sample needs one brick only.
 */
class SparseVolume
{
public:
  SparseVolume() = default;
  /**
   * @param places  mm
   * @param reach   mm: all voxels that are this near to one of the places, along each axis, are kept
   */
  SparseVolume(const ScalarImage& image, const std::vector<Vector3>& places, double reach);

  /// Whether all that the constructor would keep around `place` is kept.
  bool Covers(const Vector3& place, double reach) const;

  /// Trilinear; NaN where nothing is kept, and outside the image.
  float Sample(const Vector3& world) const
  {
    const Vector3 index = this->ToIndex * (world - this->Origin);
    return this->SampleIndex(index[0], index[1], index[2]);
  }

  std::int64_t Bytes() const { return static_cast<std::int64_t>(this->Values.size()) * 2; }

private:
  static constexpr int Side = 8;
  static constexpr int Stored = Side + 1;

  float SampleIndex(double x, double y, double z) const
  {
    if (!(x >= 0.0 && y >= 0.0 && z >= 0.0 && x <= this->Last[0] && y <= this->Last[1] &&
          z <= this->Last[2]))
    {
      return std::nanf("");
    }
    const int i = static_cast<int>(x);
    const int j = static_cast<int>(y);
    const int k = static_cast<int>(z);
    const std::int32_t brick =
      this->Bricks[((k >> 3) * this->Count[1] + (j >> 3)) * this->Count[0] + (i >> 3)];
    if (brick < 0)
    {
      return std::nanf("");
    }
    const std::int16_t* value = this->Values.data() +
      static_cast<std::int64_t>(brick) * (Stored * Stored * Stored) +
      ((k & 7) * Stored + (j & 7)) * Stored + (i & 7);
    return this->Offset +
      this->Scale *
      Trilinear<float>(value, { 1, Stored, Stored * Stored },
        { static_cast<float>(x - i), static_cast<float>(y - j), static_cast<float>(z - k) });
  }

  Vector3 Origin = Vector3::Zero();
  Matrix3 ToIndex = Matrix3::Identity();
  Vector3 Last = Vector3::Constant(-1.0); ///< greatest index
  int Count[3] = { 0, 0, 0 };
  std::vector<std::int32_t> Bricks;
  std::vector<std::int16_t> Values;
  float Offset = 0.0F;
  float Scale = 1.0F;
};

/// Means over blocks of voxels.
struct AveragedVolume
{
  Vector3 origin = Vector3::Zero();      ///< centre of the first block, mm
  Matrix3 toIndex = Matrix3::Identity(); ///< mm to indices of blocks
  std::array<int, 3> dimensions{ 0, 0, 0 };
  std::vector<float> values;

  /// Trilinear; beyond the borders the nearest value.
  float Sample(const Vector3& world) const;
};

/// @param spacing  wanted edge of the blocks, mm @param low, high  box that is kept, mm
AveragedVolume AverageBlocks(
  const ScalarImage& image, double spacing, const Vector3& low, const Vector3& high);
}

#endif
