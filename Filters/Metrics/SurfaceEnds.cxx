#include "SurfaceEnds.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

namespace coronary
{
namespace
{
bool IsCap(const SurfaceMesh& mesh, std::size_t triangle)
{
  return !mesh.caps.empty() && mesh.caps[triangle] != 0;
}

using Polygon = std::vector<Vector3>;

bool Before(const Vector3& p, const Vector3& q)
{
  return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
}

/// Where the edge from p to q meets the plane; the same point whichever end comes first.
Vector3 Crossing(const Vector3& p, const Vector3& q, const Vector3& normal, double offset)
{
  const Vector3& first = Before(p, q) ? p : q;
  const Vector3& last = Before(p, q) ? q : p;
  const double begin = normal.dot(first) - offset;
  const double end = normal.dot(last) - offset;
  return first + begin / (begin - end) * (last - first);
}

/// Cuts a convex polygon: what lies where normal . x > offset, and the rest.
std::pair<Polygon, Polygon> Cut(const Polygon& polygon, const Vector3& normal, double offset)
{
  std::pair<Polygon, Polygon> parts;
  bool above = false;
  bool below = false;
  for (const Vector3& p : polygon)
  {
    (normal.dot(p) > offset ? above : below) = true;
  }
  if (!above || !below)
  {
    (above ? parts.first : parts.second) = polygon;
    return parts;
  }
  for (std::size_t i = 0; i < polygon.size(); ++i)
  {
    const Vector3& p = polygon[i];
    const Vector3& q = polygon[(i + 1) % polygon.size()];
    const bool pAbove = normal.dot(p) > offset;
    const bool qAbove = normal.dot(q) > offset;
    (pAbove ? parts.first : parts.second).push_back(p);
    if (pAbove != qAbove)
    {
      const Vector3 crossing = Crossing(p, q, normal, offset);
      parts.first.push_back(crossing);
      parts.second.push_back(crossing);
    }
  }
  return parts;
}

/// The box beyond an end.
struct EndBox
{
  std::array<Vector3, 6> normals; ///< inside is where all normal . x > offset
  std::array<double, 6> offsets;

  EndBox(const SurfaceEnd& end, double length)
  {
    const Vector3 u = end.normal.unitOrthogonal();
    const Vector3 v = end.normal.cross(u);
    this->normals = { end.normal, -end.normal, u, -u, v, -v };
    const double wide = 2.0 * end.radius;
    const std::array<double, 6> reach = { -0.01 * end.radius, -length, -wide, -wide, -wide, -wide };
    for (std::size_t i = 0; i < 6; ++i)
    {
      this->offsets[i] = this->normals[i].dot(end.centre) + reach[i];
    }
  }

  bool MayMeet(const Polygon& polygon) const
  {
    for (std::size_t i = 0; i < 6; ++i)
    {
      if (std::none_of(polygon.begin(), polygon.end(),
            [&](const Vector3& p) { return this->normals[i].dot(p) > this->offsets[i]; }))
      {
        return false;
      }
    }
    return true;
  }
};

/// Appends what of a polygon is outside of the box.
void Outside(const Polygon& polygon, const EndBox& box, std::vector<Polygon>& result)
{
  if (!box.MayMeet(polygon))
  {
    result.push_back(polygon);
    return;
  }
  Polygon inside = polygon;
  std::vector<Polygon> outside;
  for (std::size_t i = 0; i < 6 && !inside.empty(); ++i)
  {
    auto [in, out] = Cut(inside, box.normals[i], box.offsets[i]);
    if (!out.empty())
    {
      outside.push_back(std::move(out));
    }
    inside = std::move(in);
  }
  if (inside.empty())
  {
    // In one piece, as it came.
    result.push_back(polygon);
    return;
  }
  result.insert(result.end(), outside.begin(), outside.end());
}
}

std::vector<std::int32_t> MergeCoincidentPoints(const std::vector<Vector3>& points)
{
  std::size_t size = 16;
  while (size < 2 * points.size())
  {
    size *= 2;
  }
  std::vector<std::int32_t> table(size, -1);
  std::vector<std::int32_t> first(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    std::uint64_t hash = 0;
    for (int k = 0; k < 3; ++k)
    {
      const double value = points[i][k] + 0.0; // -0 and 0 are one place
      std::uint64_t bits = 0;
      std::memcpy(&bits, &value, sizeof(bits));
      hash = (hash ^ bits) * 0x9e3779b97f4a7c15ULL;
      hash ^= hash >> 29;
    }
    std::size_t slot = hash & (size - 1);
    while (table[slot] >= 0 && points[table[slot]] != points[i])
    {
      slot = (slot + 1) & (size - 1);
    }
    if (table[slot] < 0)
    {
      table[slot] = static_cast<std::int32_t>(i);
    }
    first[i] = table[slot];
  }
  return first;
}

std::vector<SurfaceEnd> FindSurfaceEnds(const SurfaceMesh& mesh)
{
  const std::vector<std::int32_t> place = MergeCoincidentPoints(mesh.points);
  struct Edge
  {
    std::int32_t from;
    std::int32_t to;
    std::int32_t opposite;
  };
  // Edges by their ends: those that are left have a triangle on one side only.
  std::vector<std::pair<std::pair<std::int32_t, std::int32_t>, Edge>> edges;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
  {
    if (IsCap(mesh, i))
    {
      continue;
    }
    const Triangle& t = mesh.triangles[i];
    for (int k = 0; k < 3; ++k)
    {
      const Edge edge = { place[t[k]], place[t[(k + 1) % 3]], place[t[(k + 2) % 3]] };
      if (edge.from != edge.to)
      {
        edges.push_back({ std::minmax(edge.from, edge.to), edge });
      }
    }
  }
  std::stable_sort(
    edges.begin(), edges.end(), [](const auto& s, const auto& t) { return s.first < t.first; });
  std::map<std::int32_t, std::vector<Edge>> rim; // by the point that they start from
  for (std::size_t i = 0; i < edges.size();)
  {
    std::size_t last = i;
    while (last < edges.size() && edges[last].first == edges[i].first)
    {
      ++last;
    }
    if (last - i == 1)
    {
      rim[edges[i].second.from].push_back(edges[i].second);
    }
    i = last;
  }

  std::vector<SurfaceEnd> ends;
  while (!rim.empty())
  {
    // Follow the rim until it comes back to a point of this walk.
    std::vector<Edge> walk;
    std::map<std::int32_t, std::size_t> seen;
    std::int32_t at = rim.begin()->first;
    for (;;)
    {
      const auto known = seen.find(at);
      if (known != seen.end())
      {
        walk.erase(walk.begin(), walk.begin() + static_cast<std::ptrdiff_t>(known->second));
        break;
      }
      const auto next = rim.find(at);
      if (next == rim.end())
      {
        walk.clear(); // not closed
        break;
      }
      seen[at] = walk.size();
      walk.push_back(next->second.back());
      next->second.pop_back();
      if (next->second.empty())
      {
        rim.erase(next);
      }
      at = walk.back().to;
    }
    if (walk.size() < 3)
    {
      continue;
    }
    SurfaceEnd end;
    double length = 0.0;
    for (const Edge& edge : walk)
    {
      const double weight = (mesh.points[edge.to] - mesh.points[edge.from]).norm();
      end.centre += 0.5 * weight * (mesh.points[edge.to] + mesh.points[edge.from]);
      length += weight;
    }
    end.centre /= length;
    Vector3 normal = Vector3::Zero();
    for (const Edge& edge : walk)
    {
      normal += (mesh.points[edge.from] - end.centre).cross(mesh.points[edge.to] - end.centre);
      end.radius = std::max(end.radius, (mesh.points[edge.from] - end.centre).norm());
    }
    if (!(normal.norm() > 0.0) || !(end.radius > 0.0))
    {
      continue;
    }
    normal.normalize();
    // The wall's direction from its rim, weighted by the rim's length.
    double side = 0.0;
    for (const Edge& edge : walk)
    {
      const Vector3 along = mesh.points[edge.to] - mesh.points[edge.from];
      Vector3 inwards = mesh.points[edge.opposite] - mesh.points[edge.from];
      inwards -= along * (inwards.dot(along) / along.squaredNorm());
      const double distance = inwards.norm();
      side += distance > 0.0 ? along.norm() * inwards.dot(normal) / distance : 0.0;
    }
    side /= length;
    if (std::abs(side) < 0.5)
    {
      continue;
    }
    end.normal = side > 0.0 ? -normal : normal;
    ends.push_back(end);
  }
  return ends;
}

ComparedSurface TakeSurface(
  const SurfaceMesh& mesh, const std::vector<SurfaceEnd>* ends, double endLength)
{
  ComparedSurface surface;
  const std::size_t count = mesh.points.size();
  const std::vector<std::int32_t> place = MergeCoincidentPoints(mesh.points);
  std::vector<std::int32_t> number(count, -1); // of a place, among the points that are kept
  const auto keep = [&](std::int64_t point)
  {
    std::int32_t& kept = number[place[point]];
    if (kept < 0)
    {
      kept = static_cast<std::int32_t>(surface.points.size());
      surface.points.push_back(mesh.points[point]);
    }
    return kept;
  };
  std::vector<EndBox> boxes;
  if (ends != nullptr)
  {
    for (const SurfaceEnd& end : *ends)
    {
      boxes.emplace_back(end, endLength);
    }
  }
  surface.triangles.reserve(mesh.triangles.size());
  surface.inputTriangle.reserve(mesh.triangles.size());
  std::vector<std::pair<std::size_t, std::vector<Polygon>>> pieces;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
  {
    if (ends != nullptr && IsCap(mesh, i))
    {
      continue;
    }
    const Triangle& t = mesh.triangles[i];
    if (!boxes.empty())
    {
      const Polygon corners = { mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]] };
      std::vector<Polygon> parts = { corners };
      bool changed = false;
      for (const EndBox& box : boxes)
      {
        std::vector<Polygon> left;
        for (const Polygon& part : parts)
        {
          Outside(part, box, left);
        }
        changed = changed || left.size() != parts.size() ||
          !std::equal(left.begin(), left.end(), parts.begin());
        parts = std::move(left);
      }
      if (changed)
      {
        pieces.emplace_back(i, std::move(parts));
        continue;
      }
    }
    surface.triangles.push_back({ keep(t[0]), keep(t[1]), keep(t[2]) });
    surface.inputTriangle.push_back(static_cast<std::int32_t>(i));
  }
  // Pieces: their corners are points of the input, or new ones.
  std::map<std::array<double, 3>, std::int32_t> fresh;
  for (const auto& [triangle, parts] : pieces)
  {
    const Triangle& t = mesh.triangles[triangle];
    const auto corner = [&](const Vector3& p)
    {
      for (const std::int64_t point : t)
      {
        if (mesh.points[point] == p)
        {
          return keep(point);
        }
      }
      const auto [entry, isNew] =
        fresh.try_emplace({ p[0], p[1], p[2] }, static_cast<std::int32_t>(surface.points.size()));
      if (isNew)
      {
        surface.points.push_back(p);
      }
      return entry->second;
    };
    for (const Polygon& part : parts)
    {
      for (std::size_t k = 2; k < part.size(); ++k)
      {
        surface.triangles.push_back({ corner(part[0]), corner(part[k - 1]), corner(part[k]) });
        surface.inputTriangle.push_back(static_cast<std::int32_t>(triangle));
      }
    }
  }
  surface.pointOfInput.assign(count, -1);
  std::vector<std::uint8_t> used(count, 0);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
  {
    for (const std::int64_t point : mesh.triangles[i])
    {
      used[point] = 1;
    }
  }
  for (std::size_t i = 0; i < count; ++i)
  {
    if (used[i] != 0)
    {
      surface.pointOfInput[i] = number[place[i]];
    }
  }
  return surface;
}
}
