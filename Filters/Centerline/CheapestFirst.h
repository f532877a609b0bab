/**
 * @file CheapestFirst.h
 * @brief The queue of a search for the cheapest way.
 */
#ifndef DynamicCoronary_CheapestFirst_h
#define DynamicCoronary_CheapestFirst_h

#include <cstdint>
#include <queue>

namespace coronary
{
/// A voxel that waits, and where the way to it comes from.
struct WaitingVoxel
{
  float cost;
  std::int64_t voxel;
  std::int32_t before = -1; ///< in the numbers of whoever searches

  /// For std::priority_queue: the cheapest first, of equal ones the lowest number.
  bool operator<(const WaitingVoxel& other) const
  {
    return this->cost != other.cost ? this->cost > other.cost : this->voxel > other.voxel;
  }
};

using CheapestFirst = std::priority_queue<WaitingVoxel>;
}

#endif
