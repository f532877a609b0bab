#include "SurfaceMeasures.h"

#include "DisjointSets.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double Degrees = 180.0 / 3.14159265358979323846;
}

double SurfaceMeasures::WorstAngle() const
{
  return this->minimumAngle.empty()
    ? 0.0
    : *std::min_element(this->minimumAngle.begin(), this->minimumAngle.end());
}

double SurfaceMeasures::ShareBelow(double degrees) const
{
  const auto below = std::count_if(this->minimumAngle.begin(), this->minimumAngle.end(),
    [=](double angle) { return angle < degrees; });
  return static_cast<double>(below) / std::max<double>(1.0, static_cast<double>(this->triangles));
}

SurfaceMeasures MeasureSurface(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  SurfaceMeasures result;
  result.triangles = triangles.size();
  result.points = points.size();
  // Half-edges by their two ends, in order, so that partners can be counted.
  struct Half
  {
    std::int64_t low, high;
    bool forward;
    std::int64_t triangle;
  };
  std::vector<Half> halves;
  halves.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    double minimum = 180.0;
    for (int c = 0; c < 3; ++c)
    {
      const std::int64_t a = triangles[t][c];
      const std::int64_t b = triangles[t][(c + 1) % 3];
      halves.push_back({ std::min(a, b), std::max(a, b), a < b, static_cast<std::int64_t>(t) });
      const Vector3 u = points[b] - points[a];
      const Vector3 v = points[triangles[t][(c + 2) % 3]] - points[a];
      minimum = std::min(minimum, Degrees * std::atan2(u.cross(v).norm(), u.dot(v)));
    }
    result.minimumAngle.push_back(minimum);
    const Vector3& a = points[triangles[t][0]];
    const Vector3& b = points[triangles[t][1]];
    const Vector3& c = points[triangles[t][2]];
    const Vector3 offset = points[triangles[0][0]];
    result.volume += (a - offset).dot((b - offset).cross(c - offset)) / 6.0;
    result.area += 0.5 * (b - a).cross(c - a).norm();
  }
  std::sort(halves.begin(), halves.end(),
    [](const Half& x, const Half& y)
    {
      return x.low != y.low ? x.low < y.low
        : x.high != y.high  ? x.high < y.high
                            : x.triangle < y.triangle;
    });
  // Triangles joined by edges.
  DisjointSets pieces(triangles.size());
  std::vector<int> ends(points.size(), 0); // open edges of each point
  std::size_t edges = 0;
  for (std::size_t i = 0; i < halves.size();)
  {
    std::size_t j = i + 1;
    while (j < halves.size() && halves[j].low == halves[i].low && halves[j].high == halves[i].high)
    {
      pieces.Join(halves[j].triangle, halves[i].triangle);
      ++j;
    }
    ++edges;
    if (j - i == 1)
    {
      ++result.openEdges;
      ++ends[halves[i].low];
      ++ends[halves[i].high];
    }
    else
    {
      if (j - i > 2 || halves[i].forward == halves[i + 1].forward)
      {
        ++result.badEdges;
      }
    }
    i = j;
  }
  // n triangles around a point make one fan when n edges join them (closed), or n - 1 with two open
  std::vector<std::vector<std::int64_t>> around(points.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    for (const std::int64_t p : triangles[t])
    {
      around[p].push_back(static_cast<std::int64_t>(t));
    }
  }
  for (std::size_t p = 0; p < points.size(); ++p)
  {
    if (around[p].empty())
    {
      ++result.unusedPoints;
      continue;
    }
    std::vector<std::int64_t> reached{ around[p][0] };
    std::vector<char> seen(around[p].size(), 0);
    seen[0] = 1;
    for (std::size_t r = 0; r < reached.size(); ++r)
    {
      for (std::size_t n = 0; n < around[p].size(); ++n)
      {
        int shared = 0;
        for (const std::int64_t a : triangles[reached[r]])
        {
          for (const std::int64_t b : triangles[around[p][n]])
          {
            shared += a == b ? 1 : 0;
          }
        }
        if (!seen[n] && shared >= 2)
        {
          seen[n] = 1;
          reached.push_back(around[p][n]);
        }
      }
    }
    result.badPoints += reached.size() != around[p].size() || ends[p] > 2 ? 1 : 0;
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    result.components +=
      pieces.Find(static_cast<std::int64_t>(t)) == static_cast<std::int64_t>(t) ? 1 : 0;
  }
  result.eulerCharacteristic = static_cast<std::int64_t>(points.size() - result.unusedPoints) -
    static_cast<std::int64_t>(edges) + static_cast<std::int64_t>(triangles.size());
  return result;
}

std::vector<double> RelativeEdgeLengths(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, const std::vector<double>& wanted)
{
  std::vector<double> result;
  for (const Triangle& t : triangles)
  {
    for (int c = 0; c < 3; ++c)
    {
      const std::int64_t a = t[c];
      const std::int64_t b = t[(c + 1) % 3];
      if (a < b)
      {
        result.push_back((points[a] - points[b]).norm() / (0.5 * (wanted[a] + wanted[b])));
      }
    }
  }
  return result;
}
}
