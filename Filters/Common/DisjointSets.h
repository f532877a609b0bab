/**
 * @file DisjointSets.h
 * @brief Numbers that belong together, found by pairs of them.
 */
#ifndef DynamicCoronary_DisjointSets_h
#define DynamicCoronary_DisjointSets_h

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace coronary
{
/// Sets of the numbers 0 to count - 1; the lowest number stands for its set. Each is alone at first.
class DisjointSets
{
public:
  explicit DisjointSets(std::size_t count)
    : Parent(count)
  {
    std::iota(this->Parent.begin(), this->Parent.end(), 0);
  }

  std::int64_t Find(std::int64_t i)
  {
    while (this->Parent[i] != i)
    {
      this->Parent[i] = this->Parent[this->Parent[i]];
      i = this->Parent[i];
    }
    return i;
  }

  /// @return whether they were in two sets
  bool Join(std::int64_t i, std::int64_t j)
  {
    i = this->Find(i);
    j = this->Find(j);
    this->Parent[std::max(i, j)] = std::min(i, j);
    return i != j;
  }

private:
  std::vector<std::int64_t> Parent;
};
}

#endif
