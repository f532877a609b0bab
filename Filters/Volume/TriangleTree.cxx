#include "TriangleTree.h"

#include "TriangleBvh.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace coronary
{
Vector3 ClosestPointOfTriangle(
  const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c)
{
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const Vector3 normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  if (area > 0.0)
  {
    const Vector3 ap = p - a;
    const double w = ab.cross(ap).dot(normal) / area;
    const double v = ap.cross(ac).dot(normal) / area;
    if (v >= 0.0 && w >= 0.0 && v + w <= 1.0)
    {
      return a + v * ab + w * ac;
    }
  }
  Vector3 nearest = NearestOnSegment(p, a, b).position;
  for (const Vector3& other :
    { NearestOnSegment(p, b, c).position, NearestOnSegment(p, c, a).position })
  {
    if ((other - p).squaredNorm() < (nearest - p).squaredNorm())
    {
      nearest = other;
    }
  }
  return nearest;
}

TriangleTree::TriangleTree(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
  : Points(points)
  , Triangles(triangles)
  , Order(triangles.size())
{
  std::iota(this->Order.begin(), this->Order.end(), 0);
  this->Centres.reserve(triangles.size());
  for (const Triangle& t : triangles)
  {
    this->Centres.emplace_back((points[t[0]] + points[t[1]] + points[t[2]]) / 3.0);
  }
  if (!triangles.empty())
  {
    this->Nodes.reserve(triangles.size());
    this->Build(0, static_cast<std::int64_t>(triangles.size()));
  }
}

std::int64_t TriangleTree::Build(std::int64_t first, std::int64_t last)
{
  constexpr std::int64_t leafSize = 4;
  constexpr double far = std::numeric_limits<double>::infinity();
  const auto index = static_cast<std::int64_t>(this->Nodes.size());
  Node node{ Vector3::Constant(far), Vector3::Constant(-far), first, last - first, -1 };
  Vector3 low = node.low;
  Vector3 high = node.high;
  for (std::int64_t i = first; i < last; ++i)
  {
    for (const std::int64_t point : this->Triangles[this->Order[i]])
    {
      node.low = node.low.cwiseMin(this->Points[point]);
      node.high = node.high.cwiseMax(this->Points[point]);
    }
    low = low.cwiseMin(this->Centres[this->Order[i]]);
    high = high.cwiseMax(this->Centres[this->Order[i]]);
  }
  this->Nodes.push_back(node);
  if (last - first <= leafSize)
  {
    return index;
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const std::int64_t middle = (first + last) / 2;
  std::nth_element(this->Order.begin() + first, this->Order.begin() + middle,
    this->Order.begin() + last,
    [&](std::int64_t s, std::int64_t t)
    {
      const double x = this->Centres[s][axis];
      const double y = this->Centres[t][axis];
      return x != y ? x < y : s < t;
    });
  const std::int64_t left = this->Build(first, middle);
  const std::int64_t right = this->Build(middle, last);
  this->Nodes[index].first = left;
  this->Nodes[index].count = 0;
  this->Nodes[index].right = right;
  return index;
}

TriangleTree::Nearest TriangleTree::Closest(const Vector3& p) const
{
  Nearest nearest;
  if (this->Nodes.empty())
  {
    return nearest;
  }
  double best = std::numeric_limits<double>::infinity();
  const auto distanceTo = [&](std::int64_t node)
  {
    const Node& n = this->Nodes[node];
    return (n.low - p).cwiseMax(p - n.high).cwiseMax(0.0).squaredNorm();
  };
  std::vector<std::pair<double, std::int64_t>> stack{ { distanceTo(0), 0 } };
  while (!stack.empty())
  {
    const auto [distance, index] = stack.back();
    stack.pop_back();
    if (distance > best)
    {
      continue;
    }
    const Node& node = this->Nodes[index];
    if (node.count == 0)
    {
      const double left = distanceTo(node.first);
      const double right = distanceTo(node.right);
      // The nearer one is looked at first.
      if (left <= right)
      {
        stack.emplace_back(right, node.right);
        stack.emplace_back(left, node.first);
      }
      else
      {
        stack.emplace_back(left, node.first);
        stack.emplace_back(right, node.right);
      }
      continue;
    }
    for (std::int64_t i = node.first; i < node.first + node.count; ++i)
    {
      const std::int64_t triangle = this->Order[i];
      const Triangle& t = this->Triangles[triangle];
      const Vector3 point =
        ClosestPointOfTriangle(p, this->Points[t[0]], this->Points[t[1]], this->Points[t[2]]);
      const double squared = (point - p).squaredNorm();
      if (squared < best || (squared == best && triangle < nearest.triangle))
      {
        best = squared;
        nearest.triangle = triangle;
        nearest.point = point;
      }
    }
  }
  nearest.distance = std::sqrt(best);
  return nearest;
}

void TriangleTree::Visit(const Vector3& low, const Vector3& high,
  const std::function<void(std::int64_t triangle)>& visit) const
{
  std::vector<std::int64_t> stack;
  if (!this->Nodes.empty())
  {
    stack.push_back(0);
  }
  while (!stack.empty())
  {
    const Node& node = this->Nodes[stack.back()];
    stack.pop_back();
    if ((node.low.array() > high.array()).any() || (node.high.array() < low.array()).any())
    {
      continue;
    }
    if (node.count == 0)
    {
      stack.push_back(node.right);
      stack.push_back(node.first);
      continue;
    }
    for (std::int64_t i = node.first; i < node.first + node.count; ++i)
    {
      const Triangle& t = this->Triangles[this->Order[i]];
      const Vector3& a = this->Points[t[0]];
      const Vector3& b = this->Points[t[1]];
      const Vector3& c = this->Points[t[2]];
      if (!(a.cwiseMin(b).cwiseMin(c).array() > high.array()).any() &&
        !(a.cwiseMax(b).cwiseMax(c).array() < low.array()).any())
      {
        visit(this->Order[i]);
      }
    }
  }
}

int TriangleTree::Winding(const Vector3& p) const
{
  int winding = 0;
  Vector3 high = p;
  high[2] = std::numeric_limits<double>::infinity();
  this->Visit(p, high,
    [&](std::int64_t triangle)
    {
      const Triangle& t = this->Triangles[triangle];
      winding += WindingAbove(p, this->Points[t[0]], this->Points[t[1]], this->Points[t[2]]);
    });
  return winding;
}
}
