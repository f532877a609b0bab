#include "SurfaceSign.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

namespace coronary
{
SurfaceSign::SurfaceSign(const ComparedSide& side)
  : Of(side)
{
  const std::int64_t count = side.Triangles();
  struct Edge
  {
    std::uint64_t key;
    std::int32_t triangle;
    std::int8_t number;
    std::int8_t direction;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * count);
  for (std::int64_t i = 0; i < count; ++i)
  {
    const SideTriangle& t = side.surface.triangles[i];
    for (int k = 0; k < 3; ++k)
    {
      const auto from = static_cast<std::uint64_t>(t[k]);
      const auto to = static_cast<std::uint64_t>(t[(k + 1) % 3]);
      if (from != to)
      {
        edges.push_back(
          { std::min(from, to) << 32 | std::max(from, to), static_cast<std::int32_t>(i),
            static_cast<std::int8_t>(k), static_cast<std::int8_t>(from < to ? 1 : -1) });
      }
    }
  }
  std::sort(edges.begin(), edges.end(),
    [](const Edge& s, const Edge& t)
    { return s.key != t.key ? s.key < t.key : s.triangle < t.triangle; });
  const auto endOfRun = [&](std::size_t first)
  {
    std::size_t last = first;
    while (last < edges.size() && edges[last].key == edges[first].key)
    {
      ++last;
    }
    return last;
  };
  for (std::size_t first = 0, last = 0; first < edges.size() && this->IsClosed; first = last)
  {
    last = endOfRun(first);
    int turns = 0;
    for (std::size_t i = first; i < last; ++i)
    {
      turns += edges[i].direction;
    }
    this->IsClosed = turns == 0;
  }
  this->IsClosed = this->IsClosed && !edges.empty();
  if (!this->IsClosed)
  {
    return;
  }

  this->Normals.assign(count, Vector3::Zero());
  this->EdgeNormals.assign(count, { Vector3::Zero(), Vector3::Zero(), Vector3::Zero() });
  this->PointNormals.assign(side.surface.points.size(), Vector3::Zero());
  std::vector<std::uint8_t> doubtful(side.surface.points.size(), 0);
  CompensatedSum volume;
  const Vector3 centre = side.surface.points.front();
  for (std::int64_t i = 0; i < count; ++i)
  {
    const Vector3 a = side.Corner(i, 0);
    const Vector3 ab = side.Corner(i, 1) - a;
    const Vector3 ac = side.Corner(i, 2) - a;
    const Vector3 bc = ac - ab;
    const Vector3 normal = ab.cross(ac);
    volume.Add(normal.dot(a - centre));
    const double area = normal.norm();
    const SideTriangle& t = side.surface.triangles[i];
    // Thinner than this its direction is rounding.
    if (!(area > 1e-10 * std::max({ ab.squaredNorm(), ac.squaredNorm(), bc.squaredNorm() })))
    {
      for (const std::int32_t point : t)
      {
        doubtful[point] = 1;
      }
      continue;
    }
    const Vector3 unit = normal / area;
    this->Normals[i] = unit;
    this->PointNormals[t[0]] += std::atan2(area, ab.dot(ac)) * unit;
    this->PointNormals[t[1]] += std::atan2(area, -ab.dot(bc)) * unit;
    this->PointNormals[t[2]] += std::atan2(area, ac.dot(bc)) * unit;
  }
  for (std::size_t i = 0; i < doubtful.size(); ++i)
  {
    if (doubtful[i] != 0)
    {
      this->PointNormals[i].setZero();
    }
  }
  this->Inverted = volume.Value() < 0.0;
  for (std::size_t first = 0, last = 0; first < edges.size(); first = last)
  {
    last = endOfRun(first);
    if (last - first == 2)
    {
      const Vector3& s = this->Normals[edges[first].triangle];
      const Vector3& t = this->Normals[edges[first + 1].triangle];
      if (!s.isZero() && !t.isZero())
      {
        for (std::size_t i = first; i < last; ++i)
        {
          this->EdgeNormals[edges[i].triangle][edges[i].number] = s + t;
        }
      }
    }
  }
}

bool SurfaceSign::Inside(const Vector3& p, const TriangleBvh::Nearest& nearest) const
{
  const std::int64_t triangle = nearest.triangle;
  Vector3 normal;
  switch (nearest.feature)
  {
    case TriangleFeature::Face:
      normal = this->Normals[triangle];
      break;
    case TriangleFeature::EdgeAB:
    case TriangleFeature::EdgeBC:
    case TriangleFeature::EdgeCA:
      normal = this->EdgeNormals[triangle][static_cast<int>(nearest.feature) -
        static_cast<int>(TriangleFeature::EdgeAB)];
      break;
    default:
      normal =
        this->PointNormals[this->Of.surface.triangles[triangle][static_cast<int>(nearest.feature) -
          static_cast<int>(TriangleFeature::A)]];
  }
  const Vector3 away = p - nearest.point;
  const double side = normal.dot(away);
  // Not between a normal and a direction that are almost at right angles.
  if (std::abs(side) <= 1e-3 * normal.norm() * away.norm())
  {
    return this->Of.tree.Winding(p) != 0;
  }
  return (side < 0.0) != this->Inverted;
}

bool SignDistances(const ComparedSide& side, const SurfaceMesh& otherMesh,
  const ComparedSide& other, bool otherIsClipped, const MeshDistanceSettings& settings,
  std::vector<double>& distance)
{
  const auto apply = [&](const std::function<bool(std::int64_t)>& inside)
  {
    ParallelFor(static_cast<std::int64_t>(distance.size()), HintRange,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          if (distance[i] > 0.0 && inside(i))
          {
            distance[i] = -distance[i];
          }
        }
      });
  };
  if (!otherIsClipped)
  {
    const SurfaceSign sign(other);
    if (sign.Closed())
    {
      apply([&](std::int64_t i) { return sign.Inside(side.surface.points[i], side.nearest[i]); });
    }
    return sign.Closed();
  }
  // The whole surface decides, what was cut off as well; its nearest point is another one.
  ComparedSide whole;
  PrepareSide(whole, otherMesh, nullptr, settings, "");
  const SurfaceSign sign(whole);
  if (sign.Closed())
  {
    apply([&](std::int64_t i) { return whole.tree.Winding(side.surface.points[i]) != 0; });
  }
  return sign.Closed();
}
}
