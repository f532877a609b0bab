/**
 * @file BoxTree.h
 * @brief The tree behind all searches in triangles: which ones are together, and boxes around them at any moment.
 *
 * Eight boxes a node, which are tested at once, and four triangles a leaf. Built by splitting at the median of the longest
 * axis, into full subtrees: so the children of a node follow from its number. Where triangles move, the tree stays and
 * boxes are made anew; who looks between two moments keeps the boxes of both.
 */
#ifndef DynamicCoronary_BoxTree_h
#define DynamicCoronary_BoxTree_h

#include "BoxNode.h"
#include "Geometry.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace coronary
{
class BoxTree
{
public:
  static constexpr std::int64_t LeafSize = 4;
  static constexpr double MaximumCoordinate = 1e18;

  /// Of no triangles.
  BoxTree() = default;

  /**
   * Triangles may be degenerate, and points may coincide. Runs on all threads; the same tree whatever their number.
   * @throws std::invalid_argument for an index out of range, a coordinate of a corner that is not finite or beyond 1e18,
   *         or more than 2^31 - 64 triangles or points
   */
  BoxTree(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);

  /// The triangles in the order of the leaves: neighbours in space are mostly neighbours in it.
  const std::vector<std::int32_t>& Order() const { return this->LeafOrder; }
  std::int64_t Leaves() const
  {
    return (static_cast<std::int64_t>(this->LeafOrder.size()) + LeafSize - 1) / LeafSize;
  }
  /// In the middle of the points that triangles have, when built: what boxes are relative to.
  const Vector3& Centre() const { return this->Middle; }
  double Size() const { return this->Extent; } ///< longest side of the box around them

  ///@{
  /// Boxes are made from their leaves upwards. Different leaves may be set on several threads.
  std::vector<BoxNode> EmptyNodes() const;
  void SetLeaf(
    std::vector<BoxNode>& nodes, std::int64_t leaf, const float* low, const float* high) const
  {
    const std::int64_t place = this->LeafPlace + leaf - 1;
    BoxNode& node = nodes[place / BoxNode::Width];
    for (int k = 0; k < 3; ++k)
    {
      node.low[k][place % BoxNode::Width] = low[k];
      node.high[k][place % BoxNode::Width] = high[k];
    }
  }
  static void FitAbove(std::vector<BoxNode>& nodes);
  ///@}

  /// The place of the first leaf: nodes have the places before.
  std::int32_t FirstLeaf() const { return this->LeafPlace; }

  /**
   * All triangles whose boxes are within a limit.
   * @tparam NearestFirst  otherwise in an order that depends on the tree alone
   * @param limit    of squared distances, finite; visits may lower it
   * @param squares  squares(node, squared): those of a node's boxes
   * @param visit    of a place in Order()
   */
  template <bool NearestFirst, typename Squares, typename Visit>
  void ForEach(const float& limit, const Squares& squares, const Visit& visit) const
  {
    struct Waiting
    {
      float squared;
      std::int32_t place;
    };
    // Never more than seven siblings wait on each of the at most eleven levels above a leaf.
    std::array<Waiting, 96> stack;
    int size = 0;
    const auto count = static_cast<std::int64_t>(this->LeafOrder.size());
    if (count > 0)
    {
      stack[size++] = { 0.0F, 0 };
    }
    while (size > 0)
    {
      const Waiting current = stack[--size];
      if (current.squared > limit)
      {
        continue;
      }
      if (current.place >= this->LeafPlace)
      {
        const std::int64_t first = LeafSize * (current.place - this->LeafPlace);
        const std::int64_t last = std::min(count, first + LeafSize);
        for (std::int64_t i = first; i < last; ++i)
        {
          visit(static_cast<std::int32_t>(i));
        }
        continue;
      }
      float squared[BoxNode::Width] = {};
      squares(current.place, squared);
      const int first = size;
      for (int lane = 0; lane < BoxNode::Width; ++lane)
      {
        if (!(squared[lane] <= limit))
        {
          continue;
        }
        int i = size++;
        for (; NearestFirst && i > first && stack[i - 1].squared < squared[lane]; --i)
        {
          stack[i] = stack[i - 1];
        }
        stack[i] = { squared[lane], BoxNode::Width * current.place + 1 + lane };
      }
    }
  }

private:
  struct Item;

  std::vector<std::int32_t> LeafOrder;
  std::int32_t LeafPlace = 1;
  Vector3 Middle = Vector3::Zero();
  double Extent = 0.0;
};
}

#endif
