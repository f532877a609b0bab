#include "VesselTree.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
using Branch = VesselTree::Branch;

[[noreturn]] void Fail(const std::string& message)
{
  throw std::invalid_argument("VesselTree: " + message);
}

template <typename Value>
void CheckSize(const std::vector<Value>& values, std::size_t count, const char* name, bool needed)
{
  if (values.size() != count && (needed || !values.empty()))
  {
    Fail(std::string(name) + " has " + std::to_string(values.size()) + " values for " +
      std::to_string(count) + " points");
  }
}

void CheckFinite(const std::vector<double>& values, const char* name)
{
  for (std::size_t i = 0; i < values.size(); ++i)
  {
    if (!std::isfinite(values[i]))
    {
      Fail(std::string(name) + " of point " + std::to_string(i) + " is not finite");
    }
  }
}

std::string NameOf(const Branch& branch)
{
  return "branch " + std::to_string(branch.groupId);
}
}

void CheckTree(const VesselTree& tree)
{
  const std::size_t count = tree.points.size();
  CheckSize(tree.radius, count, "radius", true);
  CheckSize(tree.confidence, count, "confidence", false);
  CheckSize(tree.bridged, count, "bridged", false);
  CheckSize(tree.bridgeConfidence, count, "bridgeConfidence", false);
  CheckSize(tree.abscissa, count, "abscissa", false);
  CheckSize(tree.segmentId, count, "segmentId", false);
  for (std::size_t i = 0; i < count; ++i)
  {
    if (!tree.points[i].allFinite())
    {
      Fail("point " + std::to_string(i) + " is not finite");
    }
    if (tree.radius[i] < 0.0)
    {
      Fail("radius of point " + std::to_string(i) + " is negative");
    }
  }
  CheckFinite(tree.radius, "radius");
  CheckFinite(tree.confidence, "confidence");
  CheckFinite(tree.bridgeConfidence, "bridgeConfidence");
  CheckFinite(tree.abscissa, "abscissa");

  std::map<int, const Branch*> known;
  for (const Branch& branch : tree.branches)
  {
    if (branch.points.size() < 2)
    {
      Fail(NameOf(branch) + " has less than two points");
    }
    for (const std::int64_t point : branch.points)
    {
      if (point < 0 || point >= static_cast<std::int64_t>(count))
      {
        Fail(
          NameOf(branch) + " refers to point " + std::to_string(point) + ", which does not exist");
      }
    }
    if (branch.parentGroupId != -1)
    {
      const auto parent = known.find(branch.parentGroupId);
      if (parent == known.end())
      {
        Fail("the parent " + std::to_string(branch.parentGroupId) + " of " + NameOf(branch) +
          " does not exist or stands later");
      }
      const std::vector<std::int64_t>& points = parent->second->points;
      if (std::find(points.begin(), points.end(), branch.points.front()) == points.end())
      {
        Fail(
          NameOf(branch) + " does not begin on its parent " + std::to_string(branch.parentGroupId));
      }
    }
    if (!known.emplace(branch.groupId, &branch).second)
    {
      Fail("group id " + std::to_string(branch.groupId) + " occurs twice");
    }
  }
}

void MeasureTree(VesselTree& tree)
{
  CheckTree(tree);
  tree.abscissa.assign(tree.points.size(), 0.0);
  for (Branch& branch : tree.branches)
  {
    // A parent stands first, so the first point has its value, or is a root's zero.
    const double start = tree.abscissa[branch.points.front()];
    branch.length = 0.0;
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      branch.length += (tree.points[branch.points[i]] - tree.points[branch.points[i - 1]]).norm();
      tree.abscissa[branch.points[i]] = start + branch.length;
    }
    const double chord =
      (tree.points[branch.points.back()] - tree.points[branch.points.front()]).norm();
    branch.tortuosity = chord > 0.0 ? branch.length / chord - 1.0 : 0.0;
  }
}

VesselTree SplitAtBifurcations(const VesselTree& tree)
{
  CheckTree(tree);
  std::vector<char> cut(tree.points.size(), 0);
  for (const Branch& branch : tree.branches)
  {
    if (branch.parentGroupId != -1)
    {
      cut[branch.points.front()] = 1;
    }
  }

  VesselTree split = tree;
  split.branches.clear();
  std::map<int, std::map<std::int64_t, int>> endingAt; // of an old branch: point, new group id
  for (const Branch& branch : tree.branches)
  {
    int parent = -1;
    if (branch.parentGroupId != -1)
    {
      // At the very root of the parent there is no piece that ends: the two are then siblings.
      const std::map<std::int64_t, int>& pieces = endingAt[branch.parentGroupId];
      const auto found = pieces.find(branch.points.front());
      parent = found == pieces.end() ? -1 : found->second;
    }
    std::map<std::int64_t, int>& ending = endingAt[branch.groupId];
    ending[branch.points.front()] = parent;
    Branch piece = branch;
    piece.points.assign(1, branch.points.front());
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      piece.points.push_back(branch.points[i]);
      if (cut[branch.points[i]] || i + 1 == branch.points.size())
      {
        piece.groupId = static_cast<int>(split.branches.size());
        piece.parentGroupId = parent;
        split.branches.push_back(piece);
        parent = piece.groupId;
        ending[branch.points[i]] = parent;
        piece.points.assign(1, branch.points[i]);
      }
    }
  }
  MeasureTree(split);
  return split;
}
}
