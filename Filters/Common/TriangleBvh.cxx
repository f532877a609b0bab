#include "TriangleBvh.h"

#include "KernelChoice.h"
#include "ParallelFor.h"
#include "TriangleBvhKernels.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr double MaximumCoordinate = 1e18;

float RoundDown(double value)
{
  return std::nextafter(static_cast<float>(value), -std::numeric_limits<float>::infinity());
}

float RoundUp(double value)
{
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

/// Leaves below each child of a node with so many leaves: a power of eight, so that subtrees are full.
std::int64_t LeavesOfChild(std::int64_t leaves)
{
  std::int64_t unit = 1;
  while (unit * BvhWidth < leaves)
  {
    unit *= BvhWidth;
  }
  return unit;
}

std::int64_t NumberOfNodes(std::int64_t leaves)
{
  if (leaves <= 1)
  {
    return 0;
  }
  const std::int64_t unit = LeavesOfChild(leaves);
  const std::int64_t full = leaves / unit;
  return 1 + full * ((unit - 1) / (BvhWidth - 1)) + NumberOfNodes(leaves % unit);
}
}

KernelChoice<BvhKernels>& BvhKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<BvhKernels> choice(BvhKernelsBaseline, &BvhKernelsAvx2);
#else
  static KernelChoice<BvhKernels> choice(BvhKernelsBaseline);
#endif
  return choice;
}

TrianglePoint NearestOnTriangle(
  const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c)
{
  TrianglePoint nearest;
  const auto offer = [&](const Vector3& point, TriangleFeature feature)
  {
    const double squared = (point - p).squaredNorm();
    if (squared < nearest.squaredDistance)
    {
      nearest.point = point;
      nearest.squaredDistance = squared;
      nearest.feature = feature;
    }
  };
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const Vector3 normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  if (area > 0.0)
  {
    const Vector3 ap = p - a;
    const double w = ab.cross(ap).dot(normal) / area;
    const double v = ap.cross(ac).dot(normal) / area;
    if (v > 0.0 && w > 0.0 && v + w < 1.0)
    {
      offer(a + v * ab + w * ac, TriangleFeature::Face);
    }
  }
  // Edges too: where a triangle is almost a line, the place in its plane is mostly rounding.
  if (nearest.squaredDistance == std::numeric_limits<double>::infinity() ||
    area < 1e-8 * ab.squaredNorm() * ac.squaredNorm())
  {
    const auto edge = [&](const Vector3& from, const Vector3& to, TriangleFeature inside,
                        TriangleFeature first, TriangleFeature last)
    {
      const Vector3 along = to - from;
      const double length = along.squaredNorm();
      const double t = length > 0.0 ? (p - from).dot(along) / length : 0.0;
      if (t <= 0.0)
      {
        offer(from, first);
      }
      else if (t >= 1.0)
      {
        offer(to, last);
      }
      else
      {
        offer(from + t * along, inside);
      }
    };
    edge(a, b, TriangleFeature::EdgeAB, TriangleFeature::A, TriangleFeature::B);
    edge(b, c, TriangleFeature::EdgeBC, TriangleFeature::B, TriangleFeature::C);
    edge(c, a, TriangleFeature::EdgeCA, TriangleFeature::C, TriangleFeature::A);
  }
  return nearest;
}

struct TriangleBvh::Item
{
  float centre[3];
  std::int32_t triangle;
};

struct TriangleBvh::Splitting
{
  std::vector<Item>& items;

  /// Brings the items that are low along the longest axis of [first, last) before `middle`.
  void Split(std::int64_t first, std::int64_t middle, std::int64_t last)
  {
    float low[3] = { INFINITY, INFINITY, INFINITY };
    float high[3] = { -INFINITY, -INFINITY, -INFINITY };
    for (std::int64_t i = first; i < last; ++i)
    {
      for (int k = 0; k < 3; ++k)
      {
        low[k] = std::min(low[k], this->items[i].centre[k]);
        high[k] = std::max(high[k], this->items[i].centre[k]);
      }
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
    {
      axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
    }
    const auto begin = this->items.begin();
    std::nth_element(begin + first, begin + middle, begin + last,
      [axis](const Item& s, const Item& t)
      {
        return s.centre[axis] != t.centre[axis] ? s.centre[axis] < t.centre[axis]
                                                : s.triangle < t.triangle;
      });
  }
};

int WindingAbove(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c)
{
  // How often the triangle's outline winds around the vertical through p. An edge is looked at
  // from its lower end, whichever triangle asks.
  const Vector3* const corners[3] = { &a, &b, &c };
  int turns = 0;
  for (int i = 0; i < 3; ++i)
  {
    const Vector3& from = *corners[i];
    const Vector3& to = *corners[(i + 1) % 3];
    const bool rises = from[1] <= p[1] && to[1] > p[1];
    const bool falls = to[1] <= p[1] && from[1] > p[1];
    if (rises || falls)
    {
      const Vector3& bottom = rises ? from : to;
      const Vector3& top = rises ? to : from;
      const double side =
        (top[0] - bottom[0]) * (p[1] - bottom[1]) - (p[0] - bottom[0]) * (top[1] - bottom[1]);
      if (side > 0.0)
      {
        turns += rises ? 1 : -1;
      }
    }
  }
  if (turns == 0)
  {
    return 0;
  }
  const Vector3 normal = (b - a).cross(c - a);
  return normal[2] * normal.dot(a - p) > 0.0 ? turns : 0;
}

TriangleBvh::TriangleBvh() = default;
TriangleBvh::TriangleBvh(const TriangleBvh& other) = default;
TriangleBvh::TriangleBvh(TriangleBvh&& other) noexcept = default;
TriangleBvh& TriangleBvh::operator=(const TriangleBvh& other) = default;
TriangleBvh& TriangleBvh::operator=(TriangleBvh&& other) noexcept = default;
TriangleBvh::~TriangleBvh() = default;

TriangleBvh::TriangleBvh(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
  : Points(points)
  , Corners(triangles.size())
{
  constexpr std::size_t limit = (std::size_t(1) << 31) - 64;
  if (triangles.size() > limit || points.size() > limit)
  {
    throw std::invalid_argument("a surface has more than 2147483584 triangles or points");
  }
  for (std::size_t i = 0; i < triangles.size(); ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      const std::int64_t corner = triangles[i][k];
      if (corner < 0 || corner >= static_cast<std::int64_t>(points.size()))
      {
        throw std::invalid_argument("triangle " + std::to_string(i) + " refers to point " +
          std::to_string(corner) + " of " + std::to_string(points.size()));
      }
      this->Corners[i][k] = static_cast<std::int32_t>(corner);
    }
  }
  this->CheckPoints();
  if (triangles.empty())
  {
    return;
  }
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const std::array<std::int32_t, 3>& corners : this->Corners)
  {
    for (const std::int32_t corner : corners)
    {
      low = low.cwiseMin(this->Points[corner]);
      high = high.cwiseMax(this->Points[corner]);
    }
  }
  this->Centre = 0.5 * (low + high);
  this->Size = (high - low).maxCoeff();
  std::vector<Item> items(this->Corners.size());
  for (std::size_t i = 0; i < items.size(); ++i)
  {
    const std::array<std::int32_t, 3>& t = this->Corners[i];
    const Vector3 centre =
      (this->Points[t[0]] + this->Points[t[1]] + this->Points[t[2]]) / 3.0 - this->Centre;
    for (int k = 0; k < 3; ++k)
    {
      items[i].centre[k] = static_cast<float>(centre[k]);
    }
    items[i].triangle = static_cast<std::int32_t>(i);
  }
  this->Build(items);
  this->LeafOrder.resize(items.size());
  std::transform(items.begin(), items.end(), this->LeafOrder.begin(),
    [](const Item& item) { return item.triangle; });
  this->Fit();
}

void TriangleBvh::CheckPoints() const
{
  for (std::size_t i = 0; i < this->Corners.size(); ++i)
  {
    for (const std::int32_t corner : this->Corners[i])
    {
      // NaN fails the comparison.
      if (!(this->Points[corner].array().abs() <= MaximumCoordinate).all())
      {
        throw std::invalid_argument("point " + std::to_string(corner) + " of triangle " +
          std::to_string(i) + " is not finite or beyond 1e18");
      }
    }
  }
}

void TriangleBvh::Build(std::vector<Item>& items)
{
  const auto count = static_cast<std::int64_t>(items.size());
  const std::int64_t leaves = (count + BvhLeafSize - 1) / BvhLeafSize;
  // A tree of a single leaf has a node as well: queries begin at one.
  this->Nodes.resize(std::max<std::int64_t>(1, NumberOfNodes(leaves)));
  this->Leaves.resize(leaves);
  Splitting splitting{ items };
  if (leaves == 1)
  {
    this->Nodes[0].child[0] = ~0;
    std::fill(this->Nodes[0].child + 1, this->Nodes[0].child + BvhWidth, 0);
    return;
  }
  // The subtrees below the root are independent.
  std::vector<std::array<std::int64_t, 3>> subtrees;
  this->BuildNode(splitting, 0, 0, leaves, &subtrees);
  ParallelFor(static_cast<std::int64_t>(subtrees.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        this->BuildNode(splitting, subtrees[i][0], subtrees[i][1], subtrees[i][2], nullptr);
      }
    });
}

void TriangleBvh::BuildNode(Splitting& splitting, std::int64_t node, std::int64_t firstLeaf,
  std::int64_t leaves, std::vector<std::array<std::int64_t, 3>>* later)
{
  const std::int64_t unit = LeavesOfChild(leaves);
  const std::int64_t children = (leaves + unit - 1) / unit;
  const auto items = static_cast<std::int64_t>(splitting.items.size());
  const auto itemOf = [&](std::int64_t child)
  { return std::min(items, BvhLeafSize * std::min(firstLeaf + child * unit, firstLeaf + leaves)); };
  // Halves, quarters, eighths; ranges of children.
  std::array<std::int64_t, 2> ranges[BvhWidth];
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
    splitting.Split(itemOf(first), itemOf(middle), itemOf(last));
    ranges[next] = { first, middle };
    ranges[count++] = { middle, last };
  }
  std::int32_t* child = this->Nodes[node].child;
  std::int64_t nextNode = node + 1;
  for (std::int64_t i = 0; i < BvhWidth; ++i)
  {
    if (i >= children)
    {
      child[i] = 0; // with a box that nothing meets
      continue;
    }
    const std::int64_t leaf = firstLeaf + i * unit;
    const std::int64_t below = std::min(unit, firstLeaf + leaves - leaf);
    if (below == 1)
    {
      child[i] = static_cast<std::int32_t>(~leaf);
      continue;
    }
    child[i] = static_cast<std::int32_t>(nextNode);
    if (later != nullptr)
    {
      later->push_back({ nextNode, leaf, below });
    }
    else
    {
      this->BuildNode(splitting, nextNode, leaf, below, nullptr);
    }
    nextNode += NumberOfNodes(below);
  }
}

void TriangleBvh::Fit()
{
  const auto triangles = static_cast<std::int64_t>(this->Corners.size());
  std::vector<std::array<float, 6>> boxes(this->Leaves.size());
  ParallelFor(static_cast<std::int64_t>(this->Leaves.size()), 2048,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        BvhLeaf& leaf = this->Leaves[i];
        Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
        Vector3 high = -low;
        for (int lane = 0; lane < BvhLeafSize; ++lane)
        {
          const std::int32_t triangle =
            this->LeafOrder[std::min(BvhLeafSize * i + lane, triangles - 1)];
          const std::array<std::int32_t, 3>& t = this->Corners[triangle];
          const Vector3& a = this->Points[t[0]];
          const Vector3& b = this->Points[t[1]];
          const Vector3& c = this->Points[t[2]];
          for (int k = 0; k < 3; ++k)
          {
            leaf.a[k][lane] = a[k];
            leaf.ab[k][lane] = b[k] - a[k];
            leaf.ac[k][lane] = c[k] - a[k];
          }
          leaf.triangle[lane] = triangle;
          low = low.cwiseMin(a).cwiseMin(b).cwiseMin(c);
          high = high.cwiseMax(a).cwiseMax(b).cwiseMax(c);
        }
        for (int k = 0; k < 3; ++k)
        {
          boxes[i][k] = RoundDown(low[k] - this->Centre[k]);
          boxes[i][3 + k] = RoundUp(high[k] - this->Centre[k]);
        }
      }
    });
  // Children come after their parent.
  constexpr float far = std::numeric_limits<float>::infinity();
  std::vector<std::array<float, 6>> nodeBoxes(this->Nodes.size());
  for (auto n = static_cast<std::int64_t>(this->Nodes.size()) - 1; n >= 0; --n)
  {
    BvhNode& node = this->Nodes[n];
    std::array<float, 6> whole = { far, far, far, -far, -far, -far };
    for (int i = 0; i < BvhWidth; ++i)
    {
      const std::int32_t child = node.child[i];
      std::array<float, 6> box = { far, far, far, -far, -far, -far };
      if (child != 0)
      {
        box = child < 0 ? boxes[~child] : nodeBoxes[child];
      }
      for (int k = 0; k < 3; ++k)
      {
        node.low[k][i] = box[k];
        node.high[k][i] = box[3 + k];
        whole[k] = std::min(whole[k], box[k]);
        whole[3 + k] = std::max(whole[3 + k], box[3 + k]);
      }
    }
    nodeBoxes[n] = whole;
  }
}

void TriangleBvh::Refit(const std::vector<Vector3>& points)
{
  if (points.size() != this->Points.size())
  {
    throw std::invalid_argument("a refit needs " + std::to_string(this->Points.size()) +
      " points, not " + std::to_string(points.size()));
  }
  this->Points = points;
  this->CheckPoints();
  this->Fit();
}

void TriangleBvh::Refit(const std::vector<float>& points)
{
  if (points.size() != 3 * this->Points.size())
  {
    throw std::invalid_argument("a refit needs " + std::to_string(3 * this->Points.size()) +
      " coordinates, not " + std::to_string(points.size()));
  }
  for (std::size_t i = 0; i < this->Points.size(); ++i)
  {
    this->Points[i] = Vector3(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
  }
  this->CheckPoints();
  this->Fit();
}

TriangleBvh::Nearest TriangleBvh::Closest(const Vector3& p, double bound, std::int64_t hint) const
{
  Nearest nearest;
  if (this->Leaves.empty() || !(bound >= 0.0) || !(p.array().abs() <= MaximumCoordinate).all())
  {
    return nearest;
  }
  BvhQuery query;
  query.nodes = this->Nodes.data();
  query.leaves = this->Leaves.data();
  query.squaredDistance = bound * bound;
  if (hint >= 0)
  {
    // A little more, so that this triangle too has to be found: the result is that without a hint.
    const double reach = (p - this->Centre).cwiseAbs().maxCoeff() + this->Size;
    const double far =
      std::sqrt(this->NearestOn(hint, p).squaredDistance) * (1.0 + 1e-9) + 1e-13 * reach;
    query.squaredDistance = std::min(query.squaredDistance, far * far);
  }
  for (int k = 0; k < 3; ++k)
  {
    query.point[k] = p[k];
    query.low[k] = RoundDown(p[k] - this->Centre[k]);
    query.high[k] = RoundUp(p[k] - this->Centre[k]);
  }
  query.triangle = -1;
  BvhKernelChoice().Get().closest(query);
  if (query.triangle < 0)
  {
    // The inner loops and NearestOn differ by rounding.
    return hint >= 0 ? this->Closest(p, bound, -1) : nearest;
  }
  const TrianglePoint on = this->NearestOn(query.triangle, p);
  nearest.triangle = query.triangle;
  nearest.point = on.point;
  nearest.distance = std::sqrt(on.squaredDistance);
  nearest.feature = on.feature;
  return nearest;
}

int TriangleBvh::Winding(const Vector3& p) const
{
  if (this->Leaves.empty())
  {
    return 0;
  }
  const float low[3] = { RoundDown(p[0] - this->Centre[0]), RoundDown(p[1] - this->Centre[1]),
    RoundDown(p[2] - this->Centre[2]) };
  const float high[2] = { RoundUp(p[0] - this->Centre[0]), RoundUp(p[1] - this->Centre[1]) };
  int winding = 0;
  const auto visit = [&](std::int32_t triangle)
  {
    const std::array<std::int32_t, 3>& t = this->Corners[triangle];
    winding += WindingAbove(p, this->Points[t[0]], this->Points[t[1]], this->Points[t[2]]);
  };
  std::vector<std::int32_t> stack{ 0 };
  while (!stack.empty())
  {
    const std::int32_t current = stack.back();
    stack.pop_back();
    if (current < 0)
    {
      const std::int64_t first = BvhLeafSize * static_cast<std::int64_t>(~current);
      const std::int64_t last = std::min<std::int64_t>(
        first + BvhLeafSize, static_cast<std::int64_t>(this->LeafOrder.size()));
      for (std::int64_t i = first; i < last; ++i)
      {
        visit(this->LeafOrder[i]);
      }
      continue;
    }
    const BvhNode& node = this->Nodes[current];
    for (int i = 0; i < BvhWidth; ++i)
    {
      if (node.high[2][i] >= low[2] && node.low[0][i] <= high[0] && node.high[0][i] >= low[0] &&
        node.low[1][i] <= high[1] && node.high[1][i] >= low[1])
      {
        stack.push_back(node.child[i]);
      }
    }
  }
  return winding;
}
}
