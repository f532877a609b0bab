/**
 * @file BlockValues.h
 * @brief What is known of the blocks of voxels near the vessels.
 */
#ifndef DynamicCoronary_BlockValues_h
#define DynamicCoronary_BlockValues_h

#include "SparseVoxels.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace coronary
{
/// What is known of a block near the vessels.
struct BlockValue
{
  std::array<int, 3> place;
  float lumen = -std::numeric_limits<float>::infinity(); ///< brightest smoothed member
  float outsideSum = 0.0f;
  float outsideCount = 0.0f;
};

/// Blocks near the vessels: there are few of them in an image.
class BlockValues
{
public:
  explicit BlockValues(const std::array<int, 3>& blocks)
    : Blocks(blocks)
    , Numbers({ 0, 0, 0 }, { blocks[0] - 1, blocks[1] - 1, blocks[2] - 1 }, -1)
  {
  }

  /// Place in `values` of a block, which is new there if need be.
  std::size_t Number(const std::array<int, 3>& place)
  {
    std::int32_t& number = this->Numbers.At(place);
    if (number < 0)
    {
      number = static_cast<std::int32_t>(this->values.size());
      this->values.push_back({ place });
    }
    return static_cast<std::size_t>(number);
  }
  const BlockValue* Find(const std::array<int, 3>& place) const
  {
    const std::int32_t number = this->Numbers.Get(place);
    return number < 0 ? nullptr : &this->values[static_cast<std::size_t>(number)];
  }
  /// Adds all blocks that are up to `times` the reach away from one, axis by axis.
  void Grow(const std::array<int, 3>& reach, int times)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      const std::size_t count = this->values.size();
      for (std::size_t n = 0; n < count; ++n)
      {
        std::array<int, 3> place = this->values[n].place;
        const int middle = place[axis];
        const int last = std::min(this->Blocks[axis] - 1, middle + times * reach[axis]);
        for (place[axis] = std::max(0, middle - times * reach[axis]); place[axis] <= last;
             ++place[axis])
        {
          this->Number(place);
        }
      }
    }
  }

  std::vector<BlockValue> values;

private:
  std::array<int, 3> Blocks;
  SparseVoxels<std::int32_t> Numbers;
};
}

#endif
