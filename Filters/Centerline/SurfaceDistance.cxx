#include "SurfaceDistance.h"

#include "Require.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace coronary
{
namespace
{
std::int64_t CountOpenEdges(const std::vector<Triangle>& triangles)
{
  std::vector<std::pair<std::int64_t, std::int64_t>> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
  {
    for (int i = 0; i < 3; ++i)
    {
      edges.emplace_back(std::minmax(t[i], t[(i + 1) % 3]));
    }
  }
  std::sort(edges.begin(), edges.end());
  std::int64_t open = 0;
  for (std::size_t i = 0; i < edges.size();)
  {
    std::size_t next = i;
    while (next < edges.size() && edges[next] == edges[i])
    {
      ++next;
    }
    open += next - i == 1 ? 1 : 0;
    i = next;
  }
  return open;
}

struct Extent
{
  Vector3 low;
  Vector3 high;
  double volume; ///< negative if the triangles face inwards
  double area;
};

Extent Measure(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  constexpr RequireOf require{ "SurfaceDistance" };
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  double volume = 0.0;
  double area = 0.0;
  for (const Triangle& t : triangles)
  {
    for (const std::int64_t p : t)
    {
      require(p >= 0 && p < static_cast<std::int64_t>(points.size()),
        "a triangle refers to a point that does not exist");
      require(points[static_cast<std::size_t>(p)].allFinite(), "a point is not finite");
      low = low.cwiseMin(points[static_cast<std::size_t>(p)]);
      high = high.cwiseMax(points[static_cast<std::size_t>(p)]);
    }
  }
  for (const Triangle& t : triangles)
  {
    // Relative to a corner: far from the origin the volume would lose its digits.
    const Vector3 a = points[t[0]] - low;
    const Vector3 b = points[t[1]] - low;
    const Vector3 c = points[t[2]] - low;
    volume += a.dot(b.cross(c)) / 6.0;
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  return { low, high, volume, area };
}

/// A signed distance while it is made.
class DistanceField
{
public:
  DistanceField(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles,
    const Extent& extent, double spacing, SurfaceDistance& result);

  /// Around a triangle, and where rows of voxels cross it.
  void Add(std::size_t t);

  /// By the count of surfaces around a voxel; parity would be lost where two overlap.
  /// @param orientation  1, or -1 if the triangles face inwards
  void MarkInside(int orientation);

  /// The nearest triangle passes from voxel to voxel inwards, by sweeps in opposite orders.
  void PassInwards(bool forward);

  void NegateOutside();

private:
  Vector3 Corner(std::size_t t, int i) const
  {
    return Vector3(this->Points[this->Triangles[t][i]] - this->Result.grid.origin);
  }

  const std::vector<Vector3>& Points;
  const std::vector<Triangle>& Triangles;
  SurfaceDistance& Result;
  double Spacing;
  std::array<int, 3> Size;
  std::int64_t RowStep;
  std::int64_t SliceStep;
  float Band;                        ///< mm around triangles
  std::vector<std::int32_t> Nearest; ///< triangle of a voxel, or -1
  /// Along each row of voxels: where, and 1 where it enters an outward surface, -1 where it leaves one.
  std::vector<std::vector<std::pair<float, int>>> Crossings;
  std::vector<char> Inside;
};
}

double TriangleDistance(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c)
{
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const Vector3 ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0)
  {
    return ap.norm();
  }
  const Vector3 bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3)
  {
    return bp.norm();
  }
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0)
  {
    return (ap - d1 / (d1 - d3) * ab).norm();
  }
  const Vector3 cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6)
  {
    return cp.norm();
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0)
  {
    return (ap - d2 / (d2 - d6) * ac).norm();
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
  {
    return (bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)).norm();
  }
  const double sum = va + vb + vc;
  return (ap - vb / sum * ab - vc / sum * ac).norm();
}

namespace
{
DistanceField::DistanceField(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, const Extent& extent, double spacing,
  SurfaceDistance& result)
  : Points(points)
  , Triangles(triangles)
  , Result(result)
  , Spacing(spacing)
  , Band(static_cast<float>(2.0 * spacing))
{
  const Vector3 size = extent.high - extent.low;
  result.grid.spacing = Vector3::Constant(spacing);
  // Rows do not run along the faces and edges that surfaces made from images are full of.
  result.grid.origin = extent.low - spacing * Vector3(3.0, 3.0 + 1e-4, 3.0 + 2e-4);
  for (int axis = 0; axis < 3; ++axis)
  {
    this->Size[axis] = static_cast<int>(std::ceil(size[axis] / spacing)) + 7;
    result.grid.extent[2 * axis] = 0;
    result.grid.extent[2 * axis + 1] = this->Size[axis] - 1;
  }
  this->RowStep = this->Size[0];
  this->SliceStep = this->RowStep * this->Size[1];
  result.values.assign(static_cast<std::size_t>(this->SliceStep * this->Size[2]), this->Band);
  this->Nearest.assign(result.values.size(), -1);
  this->Crossings.resize(
    static_cast<std::size_t>(static_cast<std::int64_t>(this->Size[1]) * this->Size[2]));
}

void DistanceField::Add(std::size_t t)
{
  const double spacing = this->Spacing;
  std::vector<float>& distance = this->Result.values;
  const Vector3 a = this->Corner(t, 0);
  const Vector3 b = this->Corner(t, 1);
  const Vector3 c = this->Corner(t, 2);
  const Vector3 minimum = a.cwiseMin(b).cwiseMin(c);
  const Vector3 maximum = a.cwiseMax(b).cwiseMax(c);
  int range[6];
  for (int axis = 0; axis < 3; ++axis)
  {
    range[2 * axis] =
      std::max(0, static_cast<int>(std::ceil((minimum[axis] - this->Band) / spacing)));
    range[2 * axis + 1] = std::min(
      this->Size[axis] - 1, static_cast<int>(std::floor((maximum[axis] + this->Band) / spacing)));
  }
  const Vector3 normal = (b - a).cross(c - a);
  for (int k = range[4]; k <= range[5]; ++k)
  {
    for (int j = range[2]; j <= range[3]; ++j)
    {
      const std::int64_t row = k * this->SliceStep + j * this->RowStep;
      for (int i = range[0]; i <= range[1]; ++i)
      {
        const Vector3 p = spacing * Vector3(i, j, k);
        // Cheaper than the distance itself, and never greater.
        const auto v = static_cast<std::size_t>(row + i);
        const double plane = std::abs((p - a).dot(normal));
        if (plane * plane >= static_cast<double>(distance[v]) * distance[v] * normal.squaredNorm())
        {
          continue;
        }
        const float d = static_cast<float>(TriangleDistance(p, a, b, c));
        if (d < distance[v])
        {
          distance[v] = d;
          this->Nearest[v] = static_cast<std::int32_t>(t);
        }
      }
      if (normal[0] == 0.0)
      {
        continue;
      }
      const double y = spacing * j;
      const double z = spacing * k;
      const auto side = [&](const Vector3& p, const Vector3& q)
      { return (q[1] - p[1]) * (z - p[2]) - (q[2] - p[2]) * (y - p[1]); };
      // A row through an edge must cross one of its two triangles: the half-open rule of edges.
      const auto inside = [&](const Vector3& p, const Vector3& q, double s)
      {
        const bool up = q[1] > p[1] || (q[1] == p[1] && q[2] > p[2]);
        return normal[0] > 0.0 ? s > 0.0 || (s == 0.0 && up) : s < 0.0 || (s == 0.0 && !up);
      };
      if (inside(a, b, side(a, b)) && inside(b, c, side(b, c)) && inside(c, a, side(c, a)))
      {
        const double x = a[0] - ((y - a[1]) * normal[1] + (z - a[2]) * normal[2]) / normal[0];
        this->Crossings[static_cast<std::int64_t>(k) * this->Size[1] + j].emplace_back(
          static_cast<float>(x / spacing), normal[0] > 0.0 ? -1 : 1);
      }
    }
  }
}

void DistanceField::MarkInside(int orientation)
{
  this->Inside.assign(this->Result.values.size(), 0);
  for (std::int64_t r = 0; r < static_cast<std::int64_t>(this->Crossings.size()); ++r)
  {
    std::vector<std::pair<float, int>>& row = this->Crossings[r];
    std::sort(row.begin(), row.end());
    int depth = 0;
    std::size_t next = 0;
    int total = 0;
    for (const auto& crossing : row)
    {
      total += crossing.second;
    }
    this->Result.doubtfulRows += total != 0 ? 1 : 0;
    if (total != 0)
    {
      continue;
    }
    for (int i = 0; i < this->Size[0]; ++i)
    {
      while (next < row.size() && row[next].first <= static_cast<float>(i))
      {
        depth += orientation * row[next++].second;
      }
      this->Inside[r * this->Size[0] + i] = depth > 0;
    }
  }
}

void DistanceField::PassInwards(bool forward)
{
  std::vector<float>& distance = this->Result.values;
  for (std::int64_t at = 0; at < static_cast<std::int64_t>(distance.size()); ++at)
  {
    const std::int64_t v = forward ? at : static_cast<std::int64_t>(distance.size()) - 1 - at;
    if (!this->Inside[v])
    {
      continue;
    }
    float& best = distance[v];
    std::int32_t& triangle = this->Nearest[v];
    const std::int64_t k = v / this->SliceStep;
    const std::int64_t j = v % this->SliceStep / this->RowStep;
    const Vector3 p = this->Spacing * Vector3(v % this->RowStep, j, k);
    const std::int64_t direction = forward ? -1 : 1;
    for (const std::int64_t step : { std::int64_t{ 1 }, this->RowStep, this->SliceStep,
           this->RowStep + 1, this->SliceStep + 1, this->SliceStep + this->RowStep,
           this->RowStep - 1, this->SliceStep - 1, this->SliceStep - this->RowStep })
    {
      const std::int32_t other = this->Nearest[v + direction * step];
      if (other < 0 || other == triangle)
      {
        continue;
      }
      const auto t = static_cast<std::size_t>(other);
      const float d = static_cast<float>(
        TriangleDistance(p, this->Corner(t, 0), this->Corner(t, 1), this->Corner(t, 2)));
      if (triangle < 0 || d < best)
      {
        best = d;
        triangle = other;
      }
    }
  }
}

void DistanceField::NegateOutside()
{
  std::vector<float>& distance = this->Result.values;
  for (std::size_t v = 0; v < distance.size(); ++v)
  {
    distance[v] = this->Inside[v] ? distance[v] : -distance[v];
  }
}
}

SurfaceDistance ComputeSurfaceDistance(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, double spacing, std::int64_t maximumVoxels,
  const ProgressCallback& progress)
{
  constexpr RequireOf require{ "SurfaceDistance" };
  require(!triangles.empty(), "the surface has no triangles");
  require(std::isfinite(spacing) && spacing >= 0.0, "spacing must not be negative");
  const Extent extent = Measure(points, triangles);
  require(extent.area > 0.0, "all triangles are degenerate");
  const Vector3 size = extent.high - extent.low;
  if (spacing == 0.0)
  {
    spacing = 0.5 * std::abs(extent.volume) / extent.area;
    require(spacing > 0.0, "the surface encloses nothing");
  }
  const double most = static_cast<double>(maximumVoxels);
  const auto voxelsAt = [&](double h) { return (size / h + Vector3::Constant(7.0)).prod(); };
  while (voxelsAt(spacing) > most)
  {
    spacing *= 1.02;
  }

  SurfaceDistance result;
  result.openEdges = CountOpenEdges(triangles);
  DistanceField field(points, triangles, extent, spacing, result);
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    if (t % 4096 == 0)
    {
      Report(progress, 0.5 * static_cast<double>(t) / static_cast<double>(triangles.size()));
    }
    field.Add(t);
  }
  field.MarkInside(extent.volume < 0.0 ? -1 : 1);
  for (int sweep = 0; sweep < 4; ++sweep)
  {
    Report(progress, 0.6 + 0.1 * sweep);
    field.PassInwards(sweep % 2 == 0);
  }
  field.NegateOutside();
  Report(progress, 1.0);
  return result;
}
}
