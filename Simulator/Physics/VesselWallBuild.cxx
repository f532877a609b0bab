#include "VesselWallData.h"

#include <map>
#include <queue>
#include <stdexcept>
#include <string>
#include <tuple>
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
  // Half edges, sorted: each one and its opposite once.
  struct HalfEdge
  {
    std::int64_t low, high;
    bool rising;
    std::int32_t triangle;
    int edge;
  };
  std::vector<HalfEdge> edges;
  edges.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      const std::int64_t from = topology.triangles[i][k];
      const std::int64_t to = topology.triangles[i][(k + 1) % 3];
      edges.push_back(
        { std::min(from, to), std::max(from, to), from < to, static_cast<std::int32_t>(i), k });
    }
  }
  std::sort(edges.begin(), edges.end(),
    [](const HalfEdge& s, const HalfEdge& t)
    {
      return std::tie(s.low, s.high, s.rising, s.triangle) <
        std::tie(t.low, t.high, t.rising, t.triangle);
    });
  std::vector<std::array<std::int32_t, 3>> beyond(count);
  for (std::size_t i = 0; i < edges.size(); i += 2)
  {
    const auto same = [&](std::size_t j)
    { return j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high; };
    if (!same(i + 1) || same(i + 2) || edges[i].rising == edges[i + 1].rising)
    {
      throw std::invalid_argument("the edge between points " + std::to_string(edges[i].low) +
        " and " + std::to_string(edges[i].high) +
        " of the wall does not belong to two triangles that run along it in opposite directions");
    }
    beyond[edges[i].triangle][edges[i].edge] = edges[i + 1].triangle;
    beyond[edges[i + 1].triangle][edges[i + 1].edge] = edges[i].triangle;
  }

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
  require(
    surfaceReach >= 1.0 && surfaceReach <= 100.0, "surfaceReach", surfaceReach, "1 to 100 mm");
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

  // Checks the indices, too.
  const TriangleBvh order(points, topology.triangles);
  this->TriangleOf = order.Order();
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
  this->BuildHierarchy(points);
  this->BuildPatches();
  this->Table.assign(256, -1);
  this->Memories.reserve(128);
  this->Hits.reserve(256);
  this->Later.reserve(256);
}

/// Leaves in the order of the tree that TriangleBvh builds, whose subtrees are full.
void VesselWall::Internals::BuildHierarchy(const std::vector<Vector3>& points)
{
  const std::size_t count = this->Triangles.size();
  const auto leaves = static_cast<std::int64_t>((count + WallLeafSize - 1) / WallLeafSize);
  std::int64_t below = leaves;
  do
  {
    below = (below + WallBoxWidth - 1) / WallBoxWidth;
    this->LevelBegin.push_back(static_cast<std::int64_t>(this->Nodes.size()));
    this->LevelSize.push_back(below);
    this->Nodes.resize(this->Nodes.size() + below);
  } while (below > 1);
  for (WallNode& node : this->Nodes)
  {
    // What is missing is far away.
    std::fill(&node.low[0][0][0], &node.low[0][0][0] + 2 * 3 * WallBoxWidth, 1e15f);
    std::fill(&node.high[0][0][0], &node.high[0][0][0] + 2 * 3 * WallBoxWidth, 1e15f);
  }
  std::vector<std::int32_t> corners;
  this->LeafBegin.push_back(0);
  for (std::int64_t i = 0; i < leaves; ++i)
  {
    corners.clear();
    for (auto t = static_cast<std::size_t>(WallLeafSize * i);
         t < std::min(count, static_cast<std::size_t>(WallLeafSize * (i + 1))); ++t)
    {
      corners.insert(
        corners.end(), this->Triangles[t].vertex.begin(), this->Triangles[t].vertex.end());
    }
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    this->LeafVertices.insert(this->LeafVertices.end(), corners.begin(), corners.end());
    this->LeafBegin.push_back(static_cast<std::int32_t>(this->LeafVertices.size()));
  }
  Vector3 low = points[0];
  Vector3 high = points[0];
  for (const Vector3& p : points)
  {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  this->Centre = 0.5 * (low + high);
  this->Coordinates.resize(points.size());
  for (int time = 0; time < 2; ++time)
  {
    this->Now = 1 - this->Now;
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      const Vector3 relative = this->Vertices[i].next - this->Centre;
      this->Coordinates[i] << relative.cast<float>().array(), 0.0f;
    }
    this->Extent[1 - this->Now] = (0.5 * (high - low)).maxCoeff();
    this->Refit();
  }
}

void VesselWall::Internals::BuildPatches()
{
  const std::size_t count = this->Triangles.size();
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
  const int next = 1 - this->Now;
  // Single precision rounds to nearest here; queries are padded for it.
  const auto leaves = static_cast<std::int64_t>(this->LeafBegin.size()) - 1;
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
    WallNode& node = this->Nodes[i / WallBoxWidth];
    const std::int64_t lane = i % WallBoxWidth;
    for (int k = 0; k < 3; ++k)
    {
      node.low[next][k][lane] = low[k];
      node.high[next][k][lane] = high[k];
    }
  }
  for (std::size_t level = 1; level < this->LevelBegin.size(); ++level)
  {
    const WallNode* below = this->Nodes.data() + this->LevelBegin[level - 1];
    const std::int64_t size = this->LevelSize[level - 1];
    for (std::int64_t i = 0; i < size; ++i)
    {
      // The last node may have missing boxes; they are not part of the box around.
      std::int64_t lanes = WallBoxWidth;
      if (i == size - 1)
      {
        const std::int64_t total = level == 1 ? leaves : this->LevelSize[level - 2];
        lanes = total - WallBoxWidth * i;
      }
      WallNode& node = this->Nodes[this->LevelBegin[level] + i / WallBoxWidth];
      for (int k = 0; k < 3; ++k)
      {
        float low = below[i].low[next][k][0];
        float high = below[i].high[next][k][0];
        for (std::int64_t lane = 1; lane < lanes; ++lane)
        {
          low = std::min(low, below[i].low[next][k][lane]);
          high = std::max(high, below[i].high[next][k][lane]);
        }
        node.low[next][k][i % WallBoxWidth] = low;
        node.high[next][k][i % WallBoxWidth] = high;
      }
    }
  }
}
}
