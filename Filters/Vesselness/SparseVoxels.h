/**
 * @file SparseVoxels.h
 * @brief A value for some voxels of a box: memory for those that have one, found without searching.
 */
#ifndef DynamicCoronary_SparseVoxels_h
#define DynamicCoronary_SparseVoxels_h

#include <array>
#include <cstdint>
#include <vector>

namespace coronary
{
/// Values in bricks of 4 x 4 x 4 voxels, which exist from the first value in them on. Vessels fill less than a hundredth
/// of a cardiac CT.
template <typename T>
class SparseVoxels
{
public:
  /// @param low, high  corners of the box, both inside @param nothing  what all voxels have first
  SparseVoxels(const std::array<int, 3>& low, const std::array<int, 3>& high, T nothing)
    : Low(low)
    , Nothing(nothing)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      this->Size[axis] = high[axis] < low[axis] ? 0 : high[axis] - low[axis] + 1;
      this->Count[axis] = (this->Size[axis] + Side - 1) / Side;
    }
    this->Bricks.assign(
      static_cast<std::size_t>(this->Count[0]) * this->Count[1] * this->Count[2], -1);
  }

  /// Also of places outside the box, which have nothing.
  T Get(int i, int j, int k) const
  {
    const int x = i - this->Low[0];
    const int y = j - this->Low[1];
    const int z = k - this->Low[2];
    if (x < 0 || y < 0 || z < 0 || x >= this->Size[0] || y >= this->Size[1] || z >= this->Size[2])
    {
      return this->Nothing;
    }
    const std::int32_t brick = this->Bricks[this->BrickOf(x, y, z)];
    return brick < 0 ? this->Nothing : this->Values[this->Place(brick, x, y, z)];
  }
  bool Contains(const std::array<int, 3>& at) const
  {
    return at[0] >= this->Low[0] && at[1] >= this->Low[1] && at[2] >= this->Low[2] &&
      at[0] < this->Low[0] + this->Size[0] && at[1] < this->Low[1] + this->Size[1] &&
      at[2] < this->Low[2] + this->Size[2];
  }
  T Get(const std::array<int, 3>& at) const { return this->Get(at[0], at[1], at[2]); }

  /// The value of a voxel of the box, to change it; valid until the next call.
  T& At(int i, int j, int k)
  {
    const int x = i - this->Low[0];
    const int y = j - this->Low[1];
    const int z = k - this->Low[2];
    std::int32_t& brick = this->Bricks[this->BrickOf(x, y, z)];
    if (brick < 0)
    {
      brick = static_cast<std::int32_t>(this->Values.size() / Voxels);
      this->Values.resize(this->Values.size() + Voxels, this->Nothing);
    }
    return this->Values[this->Place(brick, x, y, z)];
  }
  T& At(const std::array<int, 3>& at) { return this->At(at[0], at[1], at[2]); }

private:
  static constexpr int Side = 4;
  static constexpr std::size_t Voxels = Side * Side * Side;

  std::size_t BrickOf(int x, int y, int z) const
  {
    return (static_cast<std::size_t>(z / Side) * this->Count[1] + y / Side) * this->Count[0] +
      x / Side;
  }
  std::size_t Place(std::int32_t brick, int x, int y, int z) const
  {
    return static_cast<std::size_t>(brick) * Voxels + ((z % Side) * Side + y % Side) * Side +
      x % Side;
  }

  std::array<int, 3> Low;
  std::array<int, 3> Size{};
  std::array<int, 3> Count{}; ///< bricks
  T Nothing;
  std::vector<std::int32_t> Bricks; ///< place in Values, -1: none
  std::vector<T> Values;
};
}

#endif
