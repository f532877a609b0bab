/**
 * @file WallTestMeshes.h
 * @brief Walls whose distances are known.
 */
#ifndef DynamicCoronary_WallTestMeshes_h
#define DynamicCoronary_WallTestMeshes_h

#include "WallMotion.h"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace coronary
{
/// A closed tube around z from 0 to `length`, its points on the cylinder about (x, 0): entity 1, the caps 2 and 3.
/// Appended to what is there, as a component and branch of its own; caps are numbered on.
inline void AppendTube(WallTopology& topology, std::vector<Vector3>& points, double x,
  double radius, double length, int around, int along)
{
  const auto begin = static_cast<std::int64_t>(points.size());
  const int branch = static_cast<int>(topology.axis.size());
  topology.axis.emplace_back();
  topology.axisRadius.emplace_back();
  topology.parent.push_back(-1);
  topology.groupName.push_back("tube" + std::to_string(branch));
  const auto at = [&](int j, int i)
  { return begin + static_cast<std::int64_t>(j) * around + i % around; };
  for (int j = 0; j <= along; ++j)
  {
    const double z = length * j / along;
    topology.axis.back().emplace_back(x, 0.0, z);
    topology.axisRadius.back().push_back(radius);
    for (int i = 0; i < around; ++i)
    {
      const double angle = 2.0 * M_PI * i / around;
      points.emplace_back(x + radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  for (int j = 0; j < along; ++j)
  {
    for (int i = 0; i < around; ++i)
    {
      topology.triangles.push_back({ at(j, i), at(j, i + 1), at(j + 1, i) });
      topology.triangles.push_back({ at(j, i + 1), at(j + 1, i + 1), at(j + 1, i) });
      topology.entity.insert(topology.entity.end(), 2, 1);
    }
  }
  for (const int end : { 0, along })
  {
    const auto centre = static_cast<std::int64_t>(points.size());
    points.emplace_back(x, 0.0, length * end / along);
    for (int i = 0; i < around; ++i)
    {
      topology.triangles.push_back(end == 0 ? Triangle{ centre, at(end, i + 1), at(end, i) }
                                            : Triangle{ centre, at(end, i), at(end, i + 1) });
      topology.entity.push_back(2 + 2 * branch + (end == 0 ? 0 : 1));
    }
  }
  topology.group.resize(points.size(), branch);
  topology.points = static_cast<std::int64_t>(points.size());
}

/// A closed sphere-like wall of six times n * n squares, each point put where `shape` says for a unit direction.
inline void AppendBall(WallTopology& topology, std::vector<Vector3>& points, int n,
  const std::function<Vector3(const Vector3&)>& shape)
{
  // Points of the surface of a grid of cubes, by their indices.
  std::vector<std::int64_t> number(static_cast<std::size_t>(n + 1) * (n + 1) * (n + 1), -1);
  const auto at = [&](int i, int j, int k)
  {
    std::int64_t& place = number[(static_cast<std::size_t>(k) * (n + 1) + j) * (n + 1) + i];
    if (place < 0)
    {
      place = static_cast<std::int64_t>(points.size());
      points.push_back(shape(Vector3(i - 0.5 * n, j - 0.5 * n, k - 0.5 * n).normalized()));
    }
    return place;
  };
  const auto square = [&](std::int64_t a, std::int64_t b, std::int64_t c, std::int64_t d)
  {
    topology.triangles.push_back({ a, b, c });
    topology.triangles.push_back({ a, c, d });
    topology.entity.insert(topology.entity.end(), 2, 1);
  };
  for (int i = 0; i < n; ++i)
  {
    for (int j = 0; j < n; ++j)
    {
      square(at(i, j, n), at(i + 1, j, n), at(i + 1, j + 1, n), at(i, j + 1, n));
      square(at(i, j, 0), at(i, j + 1, 0), at(i + 1, j + 1, 0), at(i + 1, j, 0));
      square(at(n, i, j), at(n, i + 1, j), at(n, i + 1, j + 1), at(n, i, j + 1));
      square(at(0, i, j), at(0, i, j + 1), at(0, i + 1, j + 1), at(0, i + 1, j));
      square(at(i, n, j), at(i, n, j + 1), at(i + 1, n, j + 1), at(i + 1, n, j));
      square(at(i, 0, j), at(i + 1, 0, j), at(i + 1, 0, j + 1), at(i, 0, j + 1));
    }
  }
  topology.group.resize(points.size(), -1);
  topology.points = static_cast<std::int64_t>(points.size());
}
}

#endif
