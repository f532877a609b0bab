#include "TriangleSides.h"
#include "VesselWallData.h"

#include <map>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>

namespace coronary
{
namespace
{
constexpr double PatchRadius = 1.0; ///< mm along the wall

/// Triangles beyond the edges AB, BC, CA. Throws what CheckWallSurface says.
std::vector<std::array<std::int32_t, 3>> Neighbours(
  const WallTopology& topology, const std::vector<Vector3>& points)
{
  if (topology.points != static_cast<std::int64_t>(points.size()))
  {
    throw std::invalid_argument("the wall's topology has " + std::to_string(topology.points) +
      " points, and " + std::to_string(points.size()) + " positions are given");
  }
  const std::size_t count = topology.triangles.size();
  if (count == 0)
  {
    throw std::invalid_argument("the wall has no triangles");
  }
  if (!topology.entity.empty() && topology.entity.size() != count)
  {
    throw std::invalid_argument("the wall has " + std::to_string(count) + " triangles, and " +
      std::to_string(topology.entity.size()) + " entities");
  }
  if (!topology.group.empty() && topology.group.size() != points.size())
  {
    throw std::invalid_argument("the wall has " + std::to_string(points.size()) + " points, and " +
      std::to_string(topology.group.size()) + " groups");
  }
  RequireWallPoints(points, points.size());
  for (std::size_t i = 0; i < count; ++i)
  {
    const Triangle& t = topology.triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
    {
      throw std::invalid_argument(
        "triangle " + std::to_string(i) + " of the wall has a point twice");
    }
  }
  if (count > (std::size_t(1) << 29) || points.size() > (std::size_t(1) << 29))
  {
    throw std::invalid_argument("the wall has more than 536870912 triangles or points");
  }
  for (std::size_t i = 0; i < count; ++i)
  {
    for (const std::int64_t corner : topology.triangles[i])
    {
      if (corner < 0 || corner >= topology.points)
      {
        throw std::invalid_argument("triangle " + std::to_string(i) +
          " of the wall refers to point " + std::to_string(corner) + " of " +
          std::to_string(topology.points));
      }
    }
  }
  std::vector<std::array<std::int32_t, 3>> beyond(count);
  const std::vector<TriangleSide> sides =
    SidesOf(topology.triangles, [](const Triangle& t) -> const Triangle& { return t; });
  ForEdges(sides,
    [&](std::size_t first, std::size_t size)
    {
      const TriangleSide& one = sides[first];
      if (size != 2 || one.rising == sides[first + 1].rising)
      {
        throw std::invalid_argument("the edge between points " + std::to_string(one.low) + " and " +
          std::to_string(one.high) +
          " of the wall does not belong to two triangles that run along it in opposite directions");
      }
      for (const std::size_t side : { first, first + 1 })
      {
        const std::int64_t triangle = sides[side].triangle;
        const Triangle& t = topology.triangles[triangle];
        const std::int64_t from = sides[side].rising ? one.low : one.high;
        beyond[triangle][std::find(t.begin(), t.end(), from) - t.begin()] =
          static_cast<std::int32_t>(sides[2 * first + 1 - side].triangle);
      }
    });

  // Components, and whether they look outwards.
  std::vector<char> seen(count, 0);
  std::vector<std::int32_t> stack;
  for (std::size_t i = 0; i < count; ++i)
  {
    if (seen[i])
    {
      continue;
    }
    double volume = 0.0;
    const Vector3 origin = points[topology.triangles[i][0]];
    seen[i] = 1;
    stack.assign(1, static_cast<std::int32_t>(i));
    while (!stack.empty())
    {
      const std::int32_t current = stack.back();
      stack.pop_back();
      const Triangle& t = topology.triangles[current];
      volume += (points[t[0]] - origin).dot((points[t[1]] - origin).cross(points[t[2]] - origin));
      for (const std::int32_t other : beyond[current])
      {
        if (!seen[other])
        {
          seen[other] = 1;
          stack.push_back(other);
        }
      }
    }
    if (!(volume > 0.0))
    {
      throw std::invalid_argument("the component of the wall with triangle " + std::to_string(i) +
        " is not oriented outwards");
    }
  }
  return beyond;
}
}

void RequireWallPoints(const std::vector<Vector3>& points, std::size_t wanted)
{
  if (points.size() != wanted)
  {
    throw std::invalid_argument(
      "the wall has " + std::to_string(wanted) + " points, not " + std::to_string(points.size()));
  }
  const auto bad = std::find_if_not(points.begin(), points.end(), UsableWallPoint);
  if (bad != points.end())
  {
    throw std::invalid_argument("point " + std::to_string(bad - points.begin()) +
      " of the wall is not finite or beyond 1e5 mm");
  }
}

void CheckWallSurface(const WallTopology& topology, const std::vector<Vector3>& points)
{
  Neighbours(topology, points);
}

void VesselWallSettings::Validate() const
{
  const auto require = [](bool good, const char* name, double value, const char* range)
  {
    if (!good)
    {
      throw std::invalid_argument(
        std::string(name) + " of the wall is " + std::to_string(value) + ", not " + range);
    }
  };
  require(friction >= 0.0 && friction <= 10.0, "friction", friction, "0 to 10");
  require(stiffness > 0.0 && std::isfinite(stiffness), "stiffness", stiffness, "positive");
  require(surfaceReach == 0.0 || (surfaceReach >= 1.0 && surfaceReach <= 100.0), "surfaceReach",
    surfaceReach, "0, or 1 to 100 mm");
  require(margin >= 0.01 && margin <= 5.0, "margin", margin, "0.01 to 5 mm");
  require(blend >= 0.0 && blend <= 5.0, "blend", blend, "0 to 5 mm");
}

void VesselWall::Internals::Build(const WallTopology& topology, const std::vector<Vector3>& points)
{
  const std::size_t count = topology.triangles.size();
  const std::vector<std::array<std::int32_t, 3>> beyond = Neighbours(topology, points);
  for (const int cap : this->Settings.openCaps)
  {
    if (cap < 2 ||
      std::find(topology.entity.begin(), topology.entity.end(), cap) == topology.entity.end())
    {
      throw std::invalid_argument("the wall has no cap of entity " + std::to_string(cap));
    }
  }

  this->Tree = BoxTree(points, topology.triangles);
  this->TriangleOf = this->Tree.Order();
  this->PlaceOf.resize(count);
  std::vector<std::int32_t> vertexPlace(points.size(), -1);
  this->Triangles.resize(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::int32_t original = this->TriangleOf[i];
    this->PlaceOf[original] = static_cast<std::int32_t>(i);
    WallCorners& t = this->Triangles[i];
    for (int k = 0; k < 3; ++k)
    {
      std::int32_t& place = vertexPlace[topology.triangles[original][k]];
      if (place < 0)
      {
        place = static_cast<std::int32_t>(this->VertexOf.size());
        this->VertexOf.push_back(static_cast<std::int32_t>(topology.triangles[original][k]));
      }
      t.vertex[k] = place;
    }
    const int entity = topology.entity.empty() ? 1 : topology.entity[original];
    t.wall = entity == 1;
    t.open = std::find(this->Settings.openCaps.begin(), this->Settings.openCaps.end(), entity) !=
      this->Settings.openCaps.end();
  }
  // Points without triangles move, too.
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (vertexPlace[i] < 0)
    {
      this->VertexOf.push_back(static_cast<std::int32_t>(i));
    }
  }
  this->Vertices.resize(points.size());
  this->VertexNormals.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    this->Vertices[i] = { points[this->VertexOf[i]], points[this->VertexOf[i]] };
    if (!topology.group.empty())
    {
      this->Group.push_back(topology.group[this->VertexOf[i]]);
    }
  }

  double edgeSum = 0.0;
  for (std::size_t i = 0; i < count; ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      const Triangle& t = topology.triangles[this->TriangleOf[i]];
      edgeSum += (points[t[k]] - points[t[(k + 1) % 3]]).norm();
      this->Triangles[i].beyond[k] = this->PlaceOf[beyond[this->TriangleOf[i]][k]];
    }
  }
  this->Blend = this->Settings.blend > 0.0
    ? this->Settings.blend
    : std::clamp(0.3 * edgeSum / static_cast<double>(3 * count), 1e-6, 5.0);

  this->AroundBegin.assign(points.size() + 1, 0);
  for (const WallCorners& t : this->Triangles)
  {
    for (const std::int32_t v : t.vertex)
    {
      ++this->AroundBegin[v + 1];
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    this->AroundBegin[i + 1] += this->AroundBegin[i];
  }
  this->Around.resize(3 * count);
  std::vector<std::int32_t> fill(this->AroundBegin.begin(), this->AroundBegin.end() - 1);
  for (std::size_t i = 0; i < count; ++i)
  {
    for (const std::int32_t v : this->Triangles[i].vertex)
    {
      this->Around[fill[v]++] = static_cast<std::int32_t>(i);
    }
  }
  std::vector<std::int32_t> corners;
  this->LeafBegin.push_back(0);
  for (std::size_t i = 0; i < count; i += BoxTree::LeafSize)
  {
    corners.clear();
    for (std::size_t t = i; t < std::min(count, i + BoxTree::LeafSize); ++t)
    {
      corners.insert(
        corners.end(), this->Triangles[t].vertex.begin(), this->Triangles[t].vertex.end());
    }
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    this->LeafVertices.insert(this->LeafVertices.end(), corners.begin(), corners.end());
    this->LeafBegin.push_back(static_cast<std::int32_t>(this->LeafVertices.size()));
  }
  this->Coordinates.resize(points.size());
  Eigen::Array4f extent = Eigen::Array4f::Zero();
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    extent = extent.max(this->SetNext(i, this->Vertices[i].next).abs());
  }
  this->ExtentNow = this->ExtentNext = extent.maxCoeff();
  this->BoxesNext = this->Tree.EmptyNodes();
  this->Refit();
  this->BoxesNow = this->BoxesNext;
  this->BuildPatches();
  this->Memories.reserve(256);
  this->Hits.reserve(256);
  this->Later.reserve(256);
}

void VesselWall::Internals::BuildPatches()
{
  const std::size_t count = this->Triangles.size();
  if (this->Settings.surfaceReach == 0.0)
  {
    for (WallCorners& triangle : this->Triangles)
    {
      triangle.patch = 0;
    }
    this->Near = { { 0 } };
    this->Marked.assign(1, 0u);
    return;
  }
  const auto centreOf = [&](std::int32_t i)
  {
    const std::array<std::int32_t, 3>& v = this->Triangles[i].vertex;
    return Vector3(
      (this->Vertices[v[0]].now + this->Vertices[v[1]].now + this->Vertices[v[2]].now) / 3.0);
  };
  std::vector<Vector3> centres(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    centres[i] = centreOf(static_cast<std::int32_t>(i));
    this->Triangles[i].patch = -1;
  }
  using Entry = std::pair<double, std::int32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> queue;
  std::vector<double> way(count, Infinity); ///< to the first triangle of the own patch
  std::int32_t patches = 0;
  for (std::size_t seed = 0; seed < count; ++seed)
  {
    if (this->Triangles[seed].patch >= 0)
    {
      continue;
    }
    way[seed] = 0.0;
    queue.emplace(0.0, static_cast<std::int32_t>(seed));
    while (!queue.empty())
    {
      const auto [length, i] = queue.top();
      queue.pop();
      if (this->Triangles[i].patch >= 0)
      {
        continue;
      }
      this->Triangles[i].patch = patches;
      way[i] = length;
      for (const std::int32_t other : this->Triangles[i].beyond)
      {
        const double further = length + (centres[other] - centres[i]).norm();
        if (this->Triangles[other].patch < 0 && further <= PatchRadius)
        {
          queue.emplace(further, other);
        }
      }
    }
    ++patches;
  }
  std::vector<std::map<std::int32_t, double>> links(patches);
  for (std::size_t i = 0; i < count; ++i)
  {
    for (const std::int32_t other : this->Triangles[i].beyond)
    {
      const std::int32_t from = this->Triangles[i].patch;
      const std::int32_t to = this->Triangles[other].patch;
      if (from != to)
      {
        const double length = way[i] + (centres[i] - centres[other]).norm() + way[other];
        const auto [entry, isNew] = links[from].try_emplace(to, length);
        entry->second = std::min(entry->second, length);
      }
    }
  }
  // Ways from centre to centre are longer than the shortest one by up to about a seventh.
  const double limit = 1.15 * this->Settings.surfaceReach + 2.0 * PatchRadius;
  this->Near.resize(patches);
  std::vector<double> reached(patches, Infinity);
  for (std::int32_t patch = 0; patch < patches; ++patch)
  {
    std::vector<std::int32_t>& near = this->Near[patch];
    reached[patch] = 0.0;
    near.push_back(patch);
    queue.emplace(0.0, patch);
    while (!queue.empty())
    {
      const auto [length, i] = queue.top();
      queue.pop();
      if (length > reached[i])
      {
        continue;
      }
      for (const auto& [other, step] : links[i])
      {
        const double further = length + step;
        if (further <= limit && further < reached[other])
        {
          if (reached[other] == Infinity)
          {
            near.push_back(other);
          }
          reached[other] = further;
          queue.emplace(further, other);
        }
      }
    }
    for (const std::int32_t other : near)
    {
      reached[other] = Infinity;
    }
  }
  this->Marked.assign(patches, 0u);
}

void VesselWall::Internals::Refit()
{
  const std::int64_t leaves = this->Tree.Leaves();
  for (std::int64_t i = 0; i < leaves; ++i)
  {
    const std::int32_t* vertex = this->LeafVertices.data() + this->LeafBegin[i];
    const std::int32_t* end = this->LeafVertices.data() + this->LeafBegin[i + 1];
    Eigen::Array4f low = this->Coordinates[*vertex];
    Eigen::Array4f high = low;
    while (++vertex != end)
    {
      low = low.min(this->Coordinates[*vertex]);
      high = high.max(this->Coordinates[*vertex]);
    }
    this->Tree.SetLeaf(this->BoxesNext, i, low.data(), high.data());
  }
  BoxTree::FitAbove(this->BoxesNext);
}
}
