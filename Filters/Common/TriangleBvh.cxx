#include "TriangleBvh.h"

#include "KernelChoice.h"
#include "ParallelFor.h"
#include "TriangleBvhKernels.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
float RoundDown(double value)
{
  return std::nextafter(static_cast<float>(value), -std::numeric_limits<float>::infinity());
}

float RoundUp(double value)
{
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
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
  , Boxes(points, triangles)
  , Nodes(this->Boxes.EmptyNodes())
  , Leaves(this->Boxes.Leaves())
{
  static_assert(BvhLeafSize == BoxTree::LeafSize);
  for (std::size_t i = 0; i < triangles.size(); ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      this->Corners[i][k] = static_cast<std::int32_t>(triangles[i][k]);
    }
  }
  const Vector3 centre = this->Boxes.Centre();
  ParallelFor(this->Boxes.Leaves(), 2048,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        BvhLeaf& leaf = this->Leaves[i];
        Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
        Vector3 high = -low;
        for (int lane = 0; lane < BvhLeafSize; ++lane)
        {
          const std::int32_t triangle = this->Boxes.Order()[std::min(
            BvhLeafSize * i + lane, static_cast<std::int64_t>(triangles.size()) - 1)];
          const Triangle& t = triangles[triangle];
          const Vector3& a = points[t[0]];
          const Vector3& b = points[t[1]];
          const Vector3& c = points[t[2]];
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
        float boxLow[3];
        float boxHigh[3];
        for (int k = 0; k < 3; ++k)
        {
          boxLow[k] = RoundDown(low[k] - centre[k]);
          boxHigh[k] = RoundUp(high[k] - centre[k]);
        }
        this->Boxes.SetLeaf(this->Nodes, i, boxLow, boxHigh);
      }
    });
  BoxTree::FitAbove(this->Nodes);
}

TriangleBvh::Nearest TriangleBvh::Closest(const Vector3& p, double bound, std::int64_t hint) const
{
  Nearest nearest;
  if (this->Leaves.empty() || !(bound >= 0.0) ||
    !(p.array().abs() <= BoxTree::MaximumCoordinate).all())
  {
    return nearest;
  }
  BvhQuery query;
  query.nodes = this->Nodes.data();
  query.leaves = this->Leaves.data();
  query.firstLeaf = this->Boxes.FirstLeaf();
  query.squaredDistance = bound * bound;
  if (hint >= 0)
  {
    // A little more, so that this triangle too has to be found: the result is that without a hint.
    const double reach = (p - this->Boxes.Centre()).cwiseAbs().maxCoeff() + this->Boxes.Size();
    const double far =
      std::sqrt(this->NearestOn(hint, p).squaredDistance) * (1.0 + 1e-9) + 1e-13 * reach;
    query.squaredDistance = std::min(query.squaredDistance, far * far);
  }
  for (int k = 0; k < 3; ++k)
  {
    query.point[k] = p[k];
    query.low[k] = RoundDown(p[k] - this->Boxes.Centre()[k]);
    query.high[k] = RoundUp(p[k] - this->Boxes.Centre()[k]);
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

/// @param visit  of triangles whose leaf's box meets that from low to high
template <typename Function>
void TriangleBvh::MeetBoxes(const Vector3& low, const Vector3& high, const Function& visit) const
{
  float from[3];
  float to[3];
  for (int k = 0; k < 3; ++k)
  {
    from[k] = RoundDown(low[k] - this->Boxes.Centre()[k]);
    to[k] = RoundUp(high[k] - this->Boxes.Centre()[k]);
  }
  this->Boxes.ForEach<false>(
    0.0F,
    [&](std::int32_t number, float* squared)
    {
      const BoxNode& node = this->Nodes[number];
      for (int i = 0; i < BoxNode::Width; ++i)
      {
        bool meets = node.low[0][i] < BoxNode::Missing;
        for (int k = 0; k < 3; ++k)
        {
          meets = meets && node.low[k][i] <= to[k] && node.high[k][i] >= from[k];
        }
        squared[i] = meets ? 0.0F : 1.0F;
      }
    },
    [&](std::int32_t place) { visit(this->Boxes.Order()[place]); });
}

void TriangleBvh::Visit(const Vector3& low, const Vector3& high,
  const std::function<void(std::int64_t triangle)>& visit) const
{
  this->MeetBoxes(low, high,
    [&](std::int32_t triangle)
    {
      const std::array<std::int32_t, 3>& t = this->Corners[triangle];
      const Vector3& a = this->Points[t[0]];
      const Vector3& b = this->Points[t[1]];
      const Vector3& c = this->Points[t[2]];
      if (!(a.cwiseMin(b).cwiseMin(c).array() > high.array()).any() &&
        !(a.cwiseMax(b).cwiseMax(c).array() < low.array()).any())
      {
        visit(triangle);
      }
    });
}

int TriangleBvh::Winding(const Vector3& p) const
{
  int winding = 0;
  this->MeetBoxes(p, Vector3(p[0], p[1], std::numeric_limits<double>::infinity()),
    [&](std::int32_t triangle)
    {
      const std::array<std::int32_t, 3>& t = this->Corners[triangle];
      winding += WindingAbove(p, this->Points[t[0]], this->Points[t[1]], this->Points[t[2]]);
    });
  return winding;
}
}
