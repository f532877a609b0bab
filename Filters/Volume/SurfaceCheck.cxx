#include "SurfaceCheck.h"

#include "TriangleIntersections.h"
#include "TriangleSides.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace coronary
{
namespace
{
Vector3 CentreOf(const std::vector<Vector3>& points, const Triangle& t)
{
  return (points[t[0]] + points[t[1]] + points[t[2]]) / 3.0;
}

void MergeEqualPoints(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles,
  ClosedSurface& surface)
{
  std::vector<char> used(points.size(), 0);
  for (const Triangle& t : triangles)
  {
    for (const std::int64_t point : t)
    {
      used[point] = 1;
    }
  }
  std::vector<std::int64_t> order;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (used[i] != 0)
    {
      order.push_back(static_cast<std::int64_t>(i));
    }
  }
  std::sort(order.begin(), order.end(),
    [&](std::int64_t a, std::int64_t b)
    {
      const Vector3& p = points[a];
      const Vector3& q = points[b];
      return std::tie(p[0], p[1], p[2], a) < std::tie(q[0], q[1], q[2], b);
    });
  std::vector<std::int64_t> representative(points.size(), -1);
  for (std::size_t i = 0; i < order.size(); ++i)
  {
    const bool same = i > 0 && points[order[i]] == points[order[i - 1]];
    representative[order[i]] = same ? representative[order[i - 1]] : order[i];
  }
  std::vector<std::int64_t> number(points.size(), -1);
  std::int64_t merged = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (representative[i] == static_cast<std::int64_t>(i))
    {
      number[i] = static_cast<std::int64_t>(surface.points.size());
      surface.points.push_back(points[i]);
      surface.sourcePoint.push_back(static_cast<std::int64_t>(i));
    }
    else if (representative[i] >= 0)
    {
      ++merged;
    }
  }
  surface.triangles = triangles;
  for (Triangle& t : surface.triangles)
  {
    for (std::int64_t& point : t)
    {
      point = number[representative[point]];
    }
  }
  if (merged > 0)
  {
    surface.warnings.push_back(std::to_string(merged) + " doubled points were merged");
  }
}

void CheckTriangles(const ClosedSurface& surface)
{
  const std::vector<Vector3>& points = surface.points;
  std::vector<std::int64_t> flat;
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
  {
    const Triangle& t = surface.triangles[i];
    const Vector3 u = points[t[1]] - points[t[0]];
    const Vector3 v = points[t[2]] - points[t[0]];
    const double longest = std::max({ u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm() });
    if (!(u.cross(v).norm() > 1e-10 * longest))
    {
      flat.push_back(static_cast<std::int64_t>(i));
    }
  }
  if (!flat.empty())
  {
    const Vector3 at = CentreOf(points, surface.triangles[flat[0]]);
    throw SurfaceError("the surface has triangles without area: " + DescribeCells(flat, at), flat);
  }
  std::vector<std::int64_t> order(surface.triangles.size());
  std::iota(order.begin(), order.end(), 0);
  std::vector<Triangle> sorted = surface.triangles;
  for (Triangle& t : sorted)
  {
    std::sort(t.begin(), t.end());
  }
  std::sort(order.begin(), order.end(),
    [&](std::int64_t a, std::int64_t b)
    { return std::tie(sorted[a], a) < std::tie(sorted[b], b); });
  std::vector<std::int64_t> doubled;
  for (std::size_t i = 1; i < order.size(); ++i)
  {
    if (sorted[order[i]] == sorted[order[i - 1]])
    {
      doubled.push_back(order[i]);
    }
  }
  if (!doubled.empty())
  {
    std::sort(doubled.begin(), doubled.end());
    const Vector3 at = CentreOf(points, surface.triangles[doubled[0]]);
    throw SurfaceError(
      "the surface is doubled: triangles are there more than once: " + DescribeCells(doubled, at),
      doubled);
  }
}

/// Whom a triangle has at its sides, and whether they disagree about the common edge's direction.
using Neighbours = std::vector<std::pair<std::int64_t, bool>>;

/// Finds the components; turns triangles over where neighbours disagree, and components that are inside-out.
/// @param neighbours  three a triangle
/// @throws SurfaceError for a component without volume
void OrientOutwards(ClosedSurface& surface, const Neighbours& neighbours)
{
  surface.component.assign(surface.triangles.size(), -1);
  std::int64_t turned = 0;
  std::int64_t insideOut = 0;
  for (std::size_t seed = 0; seed < surface.triangles.size(); ++seed)
  {
    if (surface.component[seed] >= 0)
    {
      continue;
    }
    const int component = static_cast<int>(surface.volume.size());
    std::vector<std::int64_t> members{ static_cast<std::int64_t>(seed) };
    std::vector<char> flip{ 0 };
    surface.component[seed] = component;
    for (std::size_t i = 0; i < members.size(); ++i)
    {
      for (int k = 0; k < 3; ++k)
      {
        const auto [next, disagree] = neighbours[3 * members[i] + k];
        if (surface.component[next] < 0)
        {
          surface.component[next] = component;
          members.push_back(next);
          flip.push_back(static_cast<char>(flip[i] != static_cast<char>(disagree)));
        }
      }
    }
    std::int64_t flipped = 0;
    for (std::size_t i = 0; i < members.size(); ++i)
    {
      if (flip[i] != 0)
      {
        ++flipped;
        std::swap(surface.triangles[members[i]][1], surface.triangles[members[i]][2]);
      }
    }
    // One that can not be oriented still has neighbours that disagree.
    const Vector3 origin = surface.points[surface.triangles[seed][0]];
    double volume = 0.0;
    double area = 0.0;
    for (const std::int64_t member : members)
    {
      const Triangle& t = surface.triangles[member];
      const Vector3 a = surface.points[t[0]] - origin;
      const Vector3 b = surface.points[t[1]] - origin;
      const Vector3 c = surface.points[t[2]] - origin;
      volume += a.cross(b).dot(c) / 6.0;
      area += 0.5 * (b - a).cross(c - a).norm();
    }
    if (!(std::abs(volume) > 1e-9 * std::pow(area, 1.5)))
    {
      throw SurfaceError("the surface encloses no volume: component " + std::to_string(component) +
          " with " + DescribeCells(members, CentreOf(surface.points, surface.triangles[seed])),
        members);
    }
    if (volume < 0.0)
    {
      ++insideOut;
      for (const std::int64_t member : members)
      {
        std::swap(surface.triangles[member][1], surface.triangles[member][2]);
      }
      flipped = static_cast<std::int64_t>(members.size()) - flipped;
    }
    turned += flipped;
    surface.volume.push_back(std::abs(volume));
  }
  if (insideOut > 0 || turned > 0)
  {
    surface.warnings.push_back(
      std::to_string(turned) + " triangles looked inwards and were turned over");
  }
}
}

std::string Describe(const Vector3& position)
{
  char text[96];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g)", position[0], position[1], position[2]);
  return text;
}

std::string DescribeCells(std::vector<std::int64_t> cells, const Vector3& at)
{
  constexpr std::size_t shown = 5;
  std::string text = cells.size() == 1 ? "cell " : "cells ";
  for (std::size_t i = 0; i < std::min(shown, cells.size()); ++i)
  {
    text += (i == 0 ? "" : ", ") + std::to_string(cells[i]);
  }
  if (cells.size() > shown)
  {
    text += " and " + std::to_string(cells.size() - shown) + " more";
  }
  return text + (cells.size() == 1 ? " at " : ", the first at ") + Describe(at);
}

void CheckCorners(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  const auto count = static_cast<std::int64_t>(points.size());
  for (std::size_t i = 0; i < triangles.size(); ++i)
  {
    for (const std::int64_t point : triangles[i])
    {
      if (point < 0 || point >= count)
      {
        throw std::invalid_argument("cell " + std::to_string(i) + " of the surface has point " +
          std::to_string(point) + ", which does not exist");
      }
      if (!points[point].allFinite())
      {
        throw std::invalid_argument(
          "point " + std::to_string(point) + " of the surface is not finite");
      }
    }
  }
}

ClosedSurface CheckSurface(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  if (triangles.empty())
  {
    throw SurfaceError("the surface is empty: it has no triangles", {});
  }
  CheckCorners(points, triangles);
  ClosedSurface surface;
  MergeEqualPoints(points, triangles, surface);
  CheckTriangles(surface);

  const std::vector<TriangleSide> sides =
    SidesOf(surface.triangles, [](const Triangle& t) -> const Triangle& { return t; });
  std::vector<std::int64_t> open;
  std::vector<std::int64_t> crowded;
  Vector3 openAt = Vector3::Zero();
  Vector3 crowdedAt = Vector3::Zero();
  std::size_t openEdges = 0;
  std::size_t crowdedEdges = 0;
  Neighbours neighbours(3 * triangles.size(), { -1, false });
  std::vector<int> filled(triangles.size(), 0);
  ForEdges(sides,
    [&](std::size_t first, std::size_t size)
    {
      const Vector3 middle =
        0.5 * (surface.points[sides[first].low] + surface.points[sides[first].high]);
      if (size == 1)
      {
        openAt = openEdges++ == 0 ? middle : openAt;
        open.push_back(sides[first].triangle);
      }
      else if (size > 2)
      {
        crowdedAt = crowdedEdges++ == 0 ? middle : crowdedAt;
        for (std::size_t i = first; i < first + size; ++i)
        {
          crowded.push_back(sides[i].triangle);
        }
      }
      else
      {
        const TriangleSide& one = sides[first];
        const TriangleSide& other = sides[first + 1];
        const bool disagree = one.rising == other.rising;
        neighbours[3 * one.triangle + filled[one.triangle]++] = { other.triangle, disagree };
        neighbours[3 * other.triangle + filled[other.triangle]++] = { one.triangle, disagree };
      }
    });
  const auto unique = [](std::vector<std::int64_t>& cells)
  {
    std::vector<std::int64_t> kept;
    std::vector<std::int64_t> sorted = cells;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    // The first one stays first: the position belongs to it.
    kept.push_back(cells.front());
    for (const std::int64_t cell : sorted)
    {
      if (cell != cells.front())
      {
        kept.push_back(cell);
      }
    }
    cells = kept;
  };
  if (!crowded.empty())
  {
    unique(crowded);
    throw SurfaceError("the surface is not a manifold: " + std::to_string(crowdedEdges) +
        " edges have more than two triangles; " + DescribeCells(crowded, crowdedAt),
      crowded);
  }
  if (!open.empty())
  {
    unique(open);
    throw SurfaceError("the surface is open: " + std::to_string(openEdges) +
        " edges have one triangle only; " + DescribeCells(open, openAt),
      open);
  }

  OrientOutwards(surface, neighbours);
  return surface;
}

void CheckSelfIntersections(const ClosedSurface& surface)
{
  const auto pairs = FindSelfIntersections(surface.points, surface.triangles);
  if (pairs.empty())
  {
    return;
  }
  std::vector<std::int64_t> cells;
  for (const auto& [s, t] : pairs)
  {
    cells.push_back(s);
    cells.push_back(t);
  }
  const Vector3 at = CentreOf(surface.points, surface.triangles[cells[0]]);
  const std::int64_t first = cells[0];
  const std::int64_t second = cells[1];
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  std::string text = "the surface cuts itself: " + std::to_string(pairs.size()) +
    " pairs of triangles, the first one cells " + std::to_string(first) + " and " +
    std::to_string(second) + " at " + Describe(at) + "; concerned are " + DescribeCells(cells, at);
  throw SurfaceError(text, cells);
}
}
