#include "HoleFilling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

namespace coronary
{
namespace
{
constexpr std::size_t longestRim = 300;
constexpr int smoothingRounds = 30;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Largest bend, then area; what can not be had is infinite.
struct Weight
{
  double bend = 0.0;
  double area = 0.0;

  bool operator<(const Weight& other) const
  {
    // Bends that differ by rounding are the same: else noise would decide instead of the area.
    if (std::abs(this->bend - other.bend) > 1e-6)
    {
      return this->bend < other.bend;
    }
    return this->area < other.area;
  }
};

double Bend(const Vector3& n, const Vector3& m)
{
  const double size = n.norm() * m.norm();
  return size > 0.0 ? 1.0 - n.dot(m) / size : 2.0;
}

/// Triangles of rim[order[first]] ... rim[order[last]], by dynamic programming.
bool TriangulateShort(const std::vector<Vector3>& rim, const std::vector<std::int64_t>& order,
  const std::vector<Vector3>& outside, const ForbiddenChord& forbidden,
  std::vector<Triangle>& triangles)
{
  const std::size_t n = order.size();
  const auto at = [&](std::size_t i) -> const Vector3& { return rim[order[i]]; };
  std::vector<Weight> weight(n * n);
  std::vector<std::size_t> apex(n * n, 0);
  // The normal beyond the edge from i to j, seen from its triangle: the rim's or the best below it.
  const auto beyond = [&](std::size_t i, std::size_t j) -> Vector3
  {
    if (j == i + 1)
    {
      const bool rimEdge =
        !outside.empty() && (order[i] + 1) % static_cast<std::int64_t>(rim.size()) == order[j];
      return rimEdge ? outside[order[i]] : Vector3::Zero();
    }
    return AreaVector(at(i), at(apex[i * n + j]), at(j));
  };
  for (std::size_t span = 2; span < n; ++span)
  {
    for (std::size_t i = 0; i + span < n; ++i)
    {
      const std::size_t j = i + span;
      Weight best{ infinity, infinity };
      if (forbidden && span + 1 < n && forbidden(order[i], order[j]))
      {
        weight[i * n + j] = best;
        continue;
      }
      for (std::size_t k = i + 1; k < j; ++k)
      {
        const Weight& left = weight[i * n + k];
        const Weight& right = weight[k * n + j];
        if (left.area == infinity || right.area == infinity)
        {
          continue;
        }
        const Vector3 normal = AreaVector(at(i), at(k), at(j));
        Weight own{ 0.0, normal.norm() };
        if (!outside.empty())
        {
          for (const auto& [from, to] : { std::pair(i, k), std::pair(k, j) })
          {
            const Vector3 other = beyond(from, to);
            if (other != Vector3::Zero())
            {
              own.bend = std::max(own.bend, Bend(normal, other));
            }
          }
          if (span + 1 == n && beyond(0, 1) != Vector3::Zero() &&
            (order[j] + 1) % static_cast<std::int64_t>(rim.size()) == order[i])
          {
            own.bend = std::max(own.bend, Bend(normal, outside[order[j]]));
          }
        }
        const Weight sum{ std::max({ own.bend, left.bend, right.bend }),
          own.area + left.area + right.area };
        if (best.area == infinity || sum < best)
        {
          best = sum;
          apex[i * n + j] = k;
        }
      }
      weight[i * n + j] = best;
    }
  }
  if (weight[n - 1].area == infinity)
  {
    return false;
  }
  std::vector<std::pair<std::size_t, std::size_t>> open{ { 0, n - 1 } };
  while (!open.empty())
  {
    const auto [i, j] = open.back();
    open.pop_back();
    if (j < i + 2)
    {
      continue;
    }
    const std::size_t k = apex[i * n + j];
    triangles.push_back({ order[i], order[k], order[j] });
    open.emplace_back(i, k);
    open.emplace_back(k, j);
  }
  return true;
}

bool Triangulate(const std::vector<Vector3>& rim, const std::vector<std::int64_t>& order,
  const std::vector<Vector3>& outside, const ForbiddenChord& forbidden,
  std::vector<Triangle>& triangles)
{
  const std::size_t n = order.size();
  if (n <= longestRim)
  {
    return TriangulateShort(rim, order, outside, forbidden, triangles);
  }
  // The chord that is shortest for the way along the rim that it saves.
  std::vector<double> along(n + 1, 0.0);
  for (std::size_t i = 0; i < n; ++i)
  {
    along[i + 1] = along[i] + (rim[order[(i + 1) % n]] - rim[order[i]]).norm();
  }
  std::pair<std::size_t, std::size_t> best{ 0, n / 2 };
  double bestRatio = infinity;
  for (std::size_t i = 0; i < n; ++i)
  {
    for (std::size_t j = i + n / 8; j < std::min(n, i + n - n / 8); ++j)
    {
      if (forbidden && forbidden(order[i], order[j]))
      {
        continue;
      }
      const double way = along[j] - along[i];
      const double ratio = (rim[order[i]] - rim[order[j]]).norm() / std::min(way, along[n] - way);
      if (ratio < bestRatio)
      {
        bestRatio = ratio;
        best = { i, j };
      }
    }
  }
  const auto [i, j] = best;
  const auto from = static_cast<std::ptrdiff_t>(i);
  const auto to = static_cast<std::ptrdiff_t>(j);
  std::vector<std::int64_t> inner(order.begin() + from, order.begin() + to + 1);
  std::vector<std::int64_t> outer(order.begin() + to, order.end());
  outer.insert(outer.end(), order.begin(), order.begin() + from + 1);
  return Triangulate(rim, inner, outside, forbidden, triangles) &&
    Triangulate(rim, outer, outside, forbidden, triangles);
}

/// A patch's edges while it is refined.
class Refiner
{
public:
  Refiner(SurfacePatch& patch, const std::vector<double>& rimSizes, const ForbiddenChord& forbidden)
    : Patch(patch)
    , Rim(static_cast<std::int64_t>(rimSizes.size()))
    , Sizes(rimSizes)
    , Forbidden(forbidden)
  {
    double mean = 0.0;
    for (const double size : rimSizes)
    {
      mean += size / static_cast<double>(rimSizes.size());
    }
    this->Sizes.resize(patch.points.size(), mean);
  }

  void Run()
  {
    this->CollectEdges();
    this->Swap();
    for (int round = 0; round < 12 && this->Split(); ++round)
    {
      this->Swap();
      this->Smooth(3);
      this->Swap();
    }
    this->Smooth(smoothingRounds);
    this->Swap();
    this->Smooth(smoothingRounds);
  }

private:
  using Edge = std::pair<std::int64_t, std::int64_t>;

  const Vector3& At(std::int64_t i) const { return this->Patch.points[i]; }

  /// Directed edges with their triangles: neighbours have the edge in the other direction.
  void CollectEdges()
  {
    this->Edges.clear();
    for (std::size_t t = 0; t < this->Patch.triangles.size(); ++t)
    {
      for (int i = 0; i < 3; ++i)
      {
        const Triangle& corners = this->Patch.triangles[t];
        this->Edges[{ corners[i], corners[(i + 1) % 3] }] = static_cast<std::int64_t>(t);
      }
    }
  }

  bool Split()
  {
    bool any = false;
    const double scale = std::sqrt(2.0);
    for (std::size_t t = 0, count = this->Patch.triangles.size(); t < count; ++t)
    {
      const Triangle corners = this->Patch.triangles[t];
      const Vector3 centre =
        (this->At(corners[0]) + this->At(corners[1]) + this->At(corners[2])) / 3.0;
      const double size =
        (this->Sizes[corners[0]] + this->Sizes[corners[1]] + this->Sizes[corners[2]]) / 3.0;
      bool large = true;
      for (const std::int64_t corner : corners)
      {
        const double distance = scale * (this->At(corner) - centre).norm();
        large = large && distance > size && distance > this->Sizes[corner];
      }
      if (!large)
      {
        continue;
      }
      const auto fresh = static_cast<std::int64_t>(this->Patch.points.size());
      this->Patch.points.push_back(centre);
      this->Sizes.push_back(size);
      this->Patch.triangles[t] = { corners[0], corners[1], fresh };
      this->Patch.triangles.push_back({ corners[1], corners[2], fresh });
      this->Patch.triangles.push_back({ corners[2], corners[0], fresh });
      any = true;
    }
    if (any)
    {
      this->CollectEdges();
    }
    return any;
  }

  /// Edge swaps where the two angles opposite to an edge are more than 180 degrees.
  void Swap()
  {
    const std::size_t most = 20 * this->Patch.triangles.size() + 20;
    std::size_t swaps = 0;
    for (bool any = true; any && swaps < most;)
    {
      any = false;
      for (std::size_t t = 0; t < this->Patch.triangles.size(); ++t)
      {
        for (int i = 0; i < 3; ++i)
        {
          if (this->SwapEdge(static_cast<std::int64_t>(t), i))
          {
            any = true;
            ++swaps;
            break;
          }
        }
      }
    }
  }

  bool SwapEdge(std::int64_t t, int side)
  {
    const Triangle one = this->Patch.triangles[t];
    const std::int64_t a = one[side];
    const std::int64_t b = one[(side + 1) % 3];
    const std::int64_t c = one[(side + 2) % 3];
    const auto neighbour = this->Edges.find({ b, a });
    if (neighbour == this->Edges.end())
    {
      return false;
    }
    const std::int64_t u = neighbour->second;
    const Triangle other = this->Patch.triangles[u];
    const std::int64_t d = other[0] != a && other[0] != b ? other[0]
      : other[1] != a && other[1] != b                    ? other[1]
                                                          : other[2];
    if (c == d || this->Edges.count({ c, d }) != 0 || this->Edges.count({ d, c }) != 0)
    {
      return false;
    }
    if (this->Forbidden && c < this->Rim && d < this->Rim && this->Forbidden(c, d))
    {
      return false;
    }
    const auto angle = [&](std::int64_t p)
    {
      const Vector3 x = this->At(a) - this->At(p);
      const Vector3 y = this->At(b) - this->At(p);
      return std::atan2(x.cross(y).norm(), x.dot(y));
    };
    if (angle(c) + angle(d) < M_PI + 1e-6)
    {
      return false;
    }
    const Vector3 before = AreaVector(this->At(a), this->At(b), this->At(c)) +
      AreaVector(this->At(b), this->At(a), this->At(d));
    const Vector3 first = AreaVector(this->At(a), this->At(d), this->At(c));
    const Vector3 second = AreaVector(this->At(d), this->At(b), this->At(c));
    if (first.dot(before) <= 0.0 || second.dot(before) <= 0.0 || first.dot(second) <= 0.0)
    {
      return false;
    }
    this->Edges.erase({ a, b });
    this->Edges.erase({ b, a });
    this->Patch.triangles[t] = { a, d, c };
    this->Patch.triangles[u] = { d, b, c };
    for (const std::int64_t triangle : { t, u })
    {
      for (int i = 0; i < 3; ++i)
      {
        const Triangle& corners = this->Patch.triangles[triangle];
        this->Edges[{ corners[i], corners[(i + 1) % 3] }] = triangle;
      }
    }
    return true;
  }

  void Smooth(int rounds)
  {
    std::vector<std::vector<std::int64_t>> neighbours(this->Patch.points.size());
    for (const auto& [edge, triangle] : this->Edges)
    {
      neighbours[edge.first].push_back(edge.second);
    }
    for (int round = 0; round < rounds; ++round)
    {
      for (auto i = static_cast<std::size_t>(this->Rim); i < this->Patch.points.size(); ++i)
      {
        Vector3 mean = Vector3::Zero();
        for (const std::int64_t other : neighbours[i])
        {
          mean += this->At(other);
        }
        this->Patch.points[i] = mean / static_cast<double>(neighbours[i].size());
      }
    }
  }

  SurfacePatch& Patch;
  std::int64_t Rim;
  std::vector<double> Sizes;
  const ForbiddenChord& Forbidden;
  std::map<Edge, std::int64_t> Edges;
};
}

SurfacePatch TriangulateHole(const std::vector<Vector3>& rim, const std::vector<Vector3>& outside,
  const ForbiddenChord& forbidden)
{
  SurfacePatch patch;
  patch.points = rim;
  std::vector<std::int64_t> order(rim.size());
  for (std::size_t i = 0; i < rim.size(); ++i)
  {
    order[i] = static_cast<std::int64_t>(i);
  }
  if (!Triangulate(rim, order, outside, forbidden, patch.triangles))
  {
    patch.triangles.clear();
    Vector3 centre = Vector3::Zero();
    for (const Vector3& p : rim)
    {
      centre += p / static_cast<double>(rim.size());
    }
    patch.points.push_back(centre);
    const auto count = static_cast<std::int64_t>(rim.size());
    for (std::int64_t i = 0; i < count; ++i)
    {
      patch.triangles.push_back({ i, (i + 1) % count, count });
    }
  }
  return patch;
}

SurfacePatch TriangulateBand(const std::vector<Vector3>& first, const std::vector<Vector3>& second)
{
  const std::size_t n = first.size();
  const std::size_t m = second.size();
  SurfacePatch patch;
  patch.points = first;
  patch.points.insert(patch.points.end(), second.begin(), second.end());
  // The nearest two points belong together; from there both rims are followed once around, the
  // second one backwards.
  std::size_t a0 = 0;
  std::size_t b0 = 0;
  double minimum = infinity;
  for (std::size_t i = 0; i < n; ++i)
  {
    for (std::size_t j = 0; j < m; ++j)
    {
      const double distance = (first[i] - second[j]).squaredNorm();
      if (distance < minimum)
      {
        minimum = distance;
        a0 = i;
        b0 = j;
      }
    }
  }
  const auto one = [&](std::size_t i) { return (a0 + i) % n; };
  const auto two = [&](std::size_t j) { return (b0 + m - j % m) % m; };
  std::vector<double> cost((n + 1) * (m + 1), infinity);
  std::vector<char> byFirst(cost.size(), 0);
  cost[0] = 0.0;
  for (std::size_t i = 0; i <= n; ++i)
  {
    for (std::size_t j = 0; j <= m; ++j)
    {
      const std::size_t here = i * (m + 1) + j;
      if (i > 0)
      {
        const double sum = cost[here - (m + 1)] +
          AreaVector(first[one(i - 1)], first[one(i)], second[two(j)]).norm();
        if (sum < cost[here])
        {
          cost[here] = sum;
          byFirst[here] = 1;
        }
      }
      if (j > 0)
      {
        const double sum =
          cost[here - 1] + AreaVector(first[one(i)], second[two(j)], second[two(j - 1)]).norm();
        if (sum < cost[here])
        {
          cost[here] = sum;
          byFirst[here] = 0;
        }
      }
    }
  }
  for (std::size_t i = n, j = m; i > 0 || j > 0;)
  {
    const auto b = static_cast<std::int64_t>(n + two(j));
    const auto a = static_cast<std::int64_t>(one(i));
    if (byFirst[i * (m + 1) + j] != 0)
    {
      patch.triangles.push_back({ static_cast<std::int64_t>(one(i - 1)), a, b });
      --i;
    }
    else
    {
      patch.triangles.push_back({ a, b, static_cast<std::int64_t>(n + two(j - 1)) });
      --j;
    }
  }
  return patch;
}

void RefinePatch(
  SurfacePatch& patch, const std::vector<double>& rimSizes, const ForbiddenChord& forbidden)
{
  Refiner(patch, rimSizes, forbidden).Run();
}
}
