// The edges of a triangle surface, whatever its triangles are kept in. Not installed.
#ifndef DynamicCoronary_TriangleSides_h
#define DynamicCoronary_TriangleSides_h

#include "Geometry.h"

#include <tuple>

namespace coronary
{
/// One side of a triangle; equal edges follow each other when sorted.
struct TriangleSide
{
  std::int64_t low;
  std::int64_t high;
  std::int64_t triangle;
  bool rising; ///< the triangle runs from low to high

  bool operator<(const TriangleSide& other) const
  {
    return std::tie(this->low, this->high, this->triangle) <
      std::tie(other.low, other.high, other.triangle);
  }
};

/// The sides of triangles, sorted.
/// @param cornersOf  the corners of an entry of the list
template <typename List, typename CornersOf>
std::vector<TriangleSide> SidesOf(const List& triangles, const CornersOf& cornersOf)
{
  std::vector<TriangleSide> sides;
  sides.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    const Triangle& corners = cornersOf(triangles[t]);
    for (int i = 0; i < 3; ++i)
    {
      const std::int64_t a = corners[i];
      const std::int64_t b = corners[(i + 1) % 3];
      sides.push_back({ std::min(a, b), std::max(a, b), static_cast<std::int64_t>(t), a < b });
    }
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

/// Calls edge(first, count) for the sides of each edge.
template <typename Function>
void ForEdges(const std::vector<TriangleSide>& sides, const Function& edge)
{
  for (std::size_t first = 0, last = 0; first < sides.size(); first = last)
  {
    while (last < sides.size() && sides[last].low == sides[first].low &&
      sides[last].high == sides[first].high)
    {
      ++last;
    }
    edge(first, last - first);
  }
}
}

#endif
