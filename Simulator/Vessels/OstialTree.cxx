#include "OstialTree.h"

#include "DisjointSets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

namespace coronary
{
int RootOf(const WallTopology& topology, int wanted)
{
  if (topology.axis.empty())
  {
    throw std::invalid_argument("the vessels have no axis, so there is no ostium to engage");
  }
  int root = wanted;
  for (std::size_t b = 0; b < topology.axis.size() && root < 0; ++b)
  {
    if (b >= topology.parent.size() || topology.parent[b] < 0)
    {
      root = static_cast<int>(b);
    }
  }
  if (root < 0 || root >= static_cast<int>(topology.axis.size()))
  {
    throw std::invalid_argument(
      "rootBranch " + std::to_string(root) + " is not a branch of the vessels");
  }
  return root;
}

double NarrowestBefore(const WallTopology& topology, int branch, double along)
{
  double narrowest = std::numeric_limits<double>::infinity();
  if (static_cast<std::size_t>(branch) >= topology.axisRadius.size())
  {
    return narrowest;
  }
  const std::vector<Vector3>& axis = topology.axis[branch];
  const std::vector<double>& radius = topology.axisRadius[branch];
  double passed = 0.0;
  for (std::size_t i = 0; i < axis.size() && i < radius.size(); ++i)
  {
    passed += i > 0 ? (axis[i] - axis[i - 1]).norm() : 0.0;
    if (passed <= along)
    {
      narrowest = std::min(narrowest, radius[i]);
    }
  }
  return narrowest;
}

OstialTree MakeOstialTree(const WallTopology& topology, const std::vector<Vector3>& points,
  const Vector3& ostium, const Vector3& tip)
{
  OstialTree tree;
  double nearestCap = std::numeric_limits<double>::infinity();
  double nearestWall = std::numeric_limits<double>::infinity();
  std::int64_t inlet = -1;
  for (std::size_t t = 0; t < topology.triangles.size(); ++t)
  {
    const Triangle& corners = topology.triangles[t];
    const Vector3 middle = (points[corners[0]] + points[corners[1]] + points[corners[2]]) / 3.0;
    const bool cap = !topology.entity.empty() && topology.entity[t] > 1;
    if (cap && (middle - ostium).squaredNorm() < nearestCap)
    {
      nearestCap = (middle - ostium).squaredNorm();
      tree.cap = topology.entity[t];
    }
    if (!cap && (middle - tip).squaredNorm() < nearestWall)
    {
      nearestWall = (middle - tip).squaredNorm();
      inlet = static_cast<std::int64_t>(t);
    }
  }
  if (inlet < 0)
  {
    throw std::invalid_argument("the vessels have no wall, only caps");
  }
  DisjointSets trees(topology.points);
  for (const Triangle& corners : topology.triangles)
  {
    trees.Join(corners[0], corners[1]);
    trees.Join(corners[0], corners[2]);
  }
  const std::int64_t wanted = trees.Find(topology.triangles[inlet][0]);
  std::vector<std::int64_t> place(topology.points, -1);
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(topology.points); ++i)
  {
    if (trees.Find(i) == wanted)
    {
      place[i] = tree.topology.points++;
      tree.points.push_back(i);
      if (!topology.group.empty())
      {
        tree.topology.group.push_back(topology.group[i]);
      }
    }
  }
  for (std::size_t t = 0; t < topology.triangles.size(); ++t)
  {
    const Triangle& corners = topology.triangles[t];
    if (place[corners[0]] < 0)
    {
      continue;
    }
    if (static_cast<std::int64_t>(t) == inlet)
    {
      tree.inlet = static_cast<std::int64_t>(tree.topology.triangles.size());
    }
    tree.topology.triangles.push_back({ place[corners[0]], place[corners[1]], place[corners[2]] });
    if (!topology.entity.empty())
    {
      tree.topology.entity.push_back(topology.entity[t]);
    }
  }
  return tree;
}

LengthenedInlet::LengthenedInlet(OstialTree& tree, double length)
  : Rings(std::max(1, static_cast<int>(std::lround(length / RingSpacing))))
{
  WallTopology& wall = tree.topology;
  // Edges of the cap that run in one direction only are its rim.
  std::map<std::pair<std::int64_t, std::int64_t>, int> edges;
  std::vector<char> ofCap(static_cast<std::size_t>(wall.points), 0);
  for (std::size_t t = 0; t < wall.entity.size(); ++t)
  {
    if (tree.cap == 0 || wall.entity[t] != tree.cap)
    {
      continue;
    }
    const Triangle& corners = wall.triangles[t];
    for (std::size_t k = 0; k < 3; ++k)
    {
      ofCap[corners[k]] = 1;
      edges[{ corners[k], corners[(k + 1) % 3] }] = 1;
    }
  }
  std::vector<std::pair<std::int64_t, std::int64_t>> rim;
  for (const auto& [edge, ignored] : edges)
  {
    if (edges.count({ edge.second, edge.first }) == 0)
    {
      rim.push_back(edge);
    }
  }
  if (rim.size() < 3)
  {
    throw std::invalid_argument("the vessel has no cap at its ostium");
  }
  std::map<std::int64_t, std::int64_t> number; // of a point of the rim
  for (const auto& edge : rim)
  {
    number.emplace(edge.first, static_cast<std::int64_t>(this->Rim.size()));
    this->Rim.push_back(edge.first);
  }
  for (std::int64_t i = 0; i < wall.points; ++i)
  {
    if (ofCap[i] && number.count(i) == 0)
    {
      this->Middle.push_back(i);
    }
  }
  const auto count = static_cast<std::int64_t>(this->Rim.size());
  const std::int64_t first = wall.points;
  const auto at = [&](std::int64_t point, int ring)
  { return ring == 0 ? point : first + (ring - 1) * count + number.at(point); };
  for (std::size_t t = 0; t < wall.entity.size(); ++t)
  {
    for (std::int64_t& corner : wall.triangles[t])
    {
      corner =
        wall.entity[t] == tree.cap && number.count(corner) ? at(corner, this->Rings) : corner;
    }
  }
  for (int ring = 0; ring < this->Rings; ++ring)
  {
    for (const auto& [a, b] : rim)
    {
      wall.triangles.push_back({ at(a, ring), at(b, ring), at(b, ring + 1) });
      wall.triangles.push_back({ at(a, ring), at(b, ring + 1), at(a, ring + 1) });
      wall.entity.insert(wall.entity.end(), { 1, 1 });
    }
    for (std::size_t k = 0; k < this->Rim.size() && !wall.group.empty(); ++k)
    {
      wall.group.push_back(wall.group[this->Rim[k]]);
    }
  }
  wall.points += this->Rings * count;
}

void LengthenedInlet::Lengthen(std::vector<Vector3>& points, const Vector3& direction) const
{
  for (int ring = 1; ring <= this->Rings; ++ring)
  {
    for (const std::int64_t i : this->Rim)
    {
      points.push_back(points[i] - ring * RingSpacing * direction);
    }
  }
  for (const std::int64_t i : this->Middle)
  {
    points[i] -= this->Rings * RingSpacing * direction;
  }
}
}
