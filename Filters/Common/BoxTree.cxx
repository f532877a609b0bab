#include "BoxTree.h"

#include "ParallelFor.h"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
/// Leaves below each child of a node with so many leaves: a power of eight, so that subtrees are full.
std::int64_t LeavesOfChild(std::int64_t leaves)
{
  std::int64_t unit = 1;
  while (unit * BoxNode::Width < leaves)
  {
    unit *= BoxNode::Width;
  }
  return unit;
}
}

struct BoxTree::Item
{
  float centre[3];
  std::int32_t triangle;

  /// Brings the items that are low along the longest axis of [first, last) before `middle`.
  static void Split(
    std::vector<Item>& items, std::int64_t first, std::int64_t middle, std::int64_t last)
  {
    constexpr float far = std::numeric_limits<float>::infinity();
    float low[3] = { far, far, far };
    float high[3] = { -far, -far, -far };
    for (std::int64_t i = first; i < last; ++i)
    {
      for (int k = 0; k < 3; ++k)
      {
        low[k] = std::min(low[k], items[i].centre[k]);
        high[k] = std::max(high[k], items[i].centre[k]);
      }
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
    {
      axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
    }
    std::nth_element(items.begin() + first, items.begin() + middle, items.begin() + last,
      [axis](const Item& s, const Item& t)
      {
        return s.centre[axis] != t.centre[axis] ? s.centre[axis] < t.centre[axis]
                                                : s.triangle < t.triangle;
      });
  }

  /// Sorts the items of some leaves into those of the node's children: halves, quarters, eighths.
  /// @param child  child(firstLeaf, leaves): those with more than one leaf
  template <typename Child>
  static void Sort(
    std::vector<Item>& items, std::int64_t firstLeaf, std::int64_t leaves, const Child& child)
  {
    const std::int64_t unit = LeavesOfChild(leaves);
    const std::int64_t children = (leaves + unit - 1) / unit;
    const auto itemOf = [&](std::int64_t number)
    {
      return std::min<std::int64_t>(
        items.size(), LeafSize * std::min(firstLeaf + number * unit, firstLeaf + leaves));
    };
    std::array<std::int64_t, 2> ranges[BoxNode::Width];
    int count = 1;
    ranges[0] = { 0, children };
    for (int next = 0; next < count;)
    {
      const auto [first, last] = ranges[next];
      if (last - first == 1)
      {
        ++next;
        continue;
      }
      const std::int64_t middle = first + (last - first + 1) / 2;
      Split(items, itemOf(first), itemOf(middle), itemOf(last));
      ranges[next] = { first, middle };
      ranges[count++] = { middle, last };
    }
    for (std::int64_t i = 0; i < children; ++i)
    {
      const std::int64_t first = firstLeaf + i * unit;
      const std::int64_t below = std::min(unit, firstLeaf + leaves - first);
      if (below > 1)
      {
        child(first, below);
      }
    }
  }
};

BoxTree::BoxTree(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  constexpr std::size_t limit = (std::size_t(1) << 31) - 64;
  if (triangles.size() > limit || points.size() > limit)
  {
    throw std::invalid_argument("a surface has more than 2147483584 triangles or points");
  }
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (std::size_t i = 0; i < triangles.size(); ++i)
  {
    for (const std::int64_t corner : triangles[i])
    {
      if (corner < 0 || corner >= static_cast<std::int64_t>(points.size()))
      {
        throw std::invalid_argument("triangle " + std::to_string(i) + " refers to point " +
          std::to_string(corner) + " of " + std::to_string(points.size()));
      }
      // NaN fails the comparison.
      if (!(points[corner].array().abs() <= MaximumCoordinate).all())
      {
        throw std::invalid_argument("point " + std::to_string(corner) + " of triangle " +
          std::to_string(i) + " is not finite or beyond 1e18");
      }
      low = low.cwiseMin(points[corner]);
      high = high.cwiseMax(points[corner]);
    }
  }
  if (triangles.empty())
  {
    return;
  }
  this->Middle = 0.5 * (low + high);
  this->Extent = (high - low).maxCoeff();
  std::vector<Item> items(triangles.size());
  for (std::size_t i = 0; i < items.size(); ++i)
  {
    const Triangle& t = triangles[i];
    const Vector3 centre = (points[t[0]] + points[t[1]] + points[t[2]]) / 3.0 - this->Middle;
    for (int k = 0; k < 3; ++k)
    {
      items[i].centre[k] = static_cast<float>(centre[k]);
    }
    items[i].triangle = static_cast<std::int32_t>(i);
  }
  const auto leaves = (static_cast<std::int64_t>(items.size()) + LeafSize - 1) / LeafSize;
  for (std::int64_t below = BoxNode::Width; below < leaves; below *= BoxNode::Width)
  {
    this->LeafPlace = BoxNode::Width * this->LeafPlace + 1;
  }
  if (leaves > 1)
  {
    // The subtrees below the root are independent.
    std::vector<std::array<std::int64_t, 2>> subtrees;
    Item::Sort(items, 0, leaves,
      [&](std::int64_t first, std::int64_t size) {
        subtrees.push_back({ first, size });
      });
    const std::function<void(std::int64_t, std::int64_t)> sort =
      [&](std::int64_t first, std::int64_t size) { Item::Sort(items, first, size, sort); };
    ParallelFor(static_cast<std::int64_t>(subtrees.size()), 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          sort(subtrees[i][0], subtrees[i][1]);
        }
      });
  }
  this->LeafOrder.resize(items.size());
  std::transform(items.begin(), items.end(), this->LeafOrder.begin(),
    [](const Item& item) { return item.triangle; });
}

std::vector<BoxNode> BoxTree::EmptyNodes() const
{
  BoxNode empty{};
  std::fill_n(&empty.low[0][0], 3 * BoxNode::Width, BoxNode::Missing);
  std::fill_n(&empty.high[0][0], 3 * BoxNode::Width, -BoxNode::Missing);
  const std::int64_t last = this->LeafPlace + std::max<std::int64_t>(1, this->Leaves()) - 1;
  return std::vector<BoxNode>((last - 1) / BoxNode::Width + 1, empty);
}

void BoxTree::FitAbove(std::vector<BoxNode>& nodes)
{
  using Lanes = Eigen::Array<float, BoxNode::Width, 1>;
  for (std::size_t n = nodes.size() - 1; n > 0; --n)
  {
    BoxNode& above = nodes[(n - 1) / BoxNode::Width];
    for (int k = 0; k < 3; ++k)
    {
      above.low[k][(n - 1) % BoxNode::Width] = Eigen::Map<const Lanes>(nodes[n].low[k]).minCoeff();
      above.high[k][(n - 1) % BoxNode::Width] =
        Eigen::Map<const Lanes>(nodes[n].high[k]).maxCoeff();
    }
  }
}
}
