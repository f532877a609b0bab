#include "VmtkTracts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
using Branch = VesselTree::Branch;

[[noreturn]] void RefuseTracts(const std::string& message)
{
  throw std::invalid_argument(message);
}

void CheckTract(const VmtkTract& tract, std::size_t index)
{
  const std::string name = "tract " + std::to_string(index);
  if (tract.points.size() < 2)
  {
    RefuseTracts(name + " has less than two points");
  }
  if (tract.radius.size() != tract.points.size())
  {
    RefuseTracts(name + " has " + std::to_string(tract.radius.size()) + " radii for " +
      std::to_string(tract.points.size()) + " points");
  }
  for (std::size_t i = 0; i < tract.points.size(); ++i)
  {
    if (!tract.points[i].allFinite() || !(tract.radius[i] >= 0.0) ||
      !std::isfinite(tract.radius[i]))
    {
      RefuseTracts("point " + std::to_string(i) + " of " + name +
        " has a position or radius that can not be used");
    }
  }
}

/// Where a path ends: so many points into a branch.
struct PathEnd
{
  const Branch* branch = nullptr;
  std::size_t count = 0;
};

/// Whole branches only: a path that leaves a branch in its middle would cut it.
VesselTree Split(const VesselTree& tree)
{
  CheckTree(tree);
  std::map<int, std::int64_t> ends;
  for (const Branch& branch : tree.branches)
  {
    if (branch.parentGroupId != -1 && ends[branch.parentGroupId] != branch.points.front())
    {
      return SplitAtBifurcations(tree);
    }
    ends[branch.groupId] = branch.points.back();
  }
  return tree;
}

std::vector<VmtkTract> PathsTo(const VesselTree& tree, const std::vector<PathEnd>& ends)
{
  std::map<int, const Branch*> byGroup;
  for (const Branch& branch : tree.branches)
  {
    byGroup[branch.groupId] = &branch;
  }
  std::vector<VmtkTract> tracts;
  for (std::size_t path = 0; path < ends.size(); ++path)
  {
    std::vector<const Branch*> chain; // from the end
    for (const Branch* branch = ends[path].branch; branch != nullptr;
         branch = branch->parentGroupId == -1 ? nullptr : byGroup[branch->parentGroupId])
    {
      chain.push_back(branch);
    }
    int number = 0;
    for (auto branch = chain.rbegin(); branch != chain.rend(); ++branch)
    {
      const bool last = branch + 1 == chain.rend();
      const std::size_t count = last ? ends[path].count : (*branch)->points.size();
      if (count < 2)
      {
        continue;
      }
      VmtkTract tract;
      tract.centerlineId = static_cast<int>(path);
      tract.tractId = number++;
      tract.groupId = (*branch)->groupId;
      for (std::size_t i = 0; i < count; ++i)
      {
        const std::int64_t point = (*branch)->points[i];
        tract.points.push_back(tree.points[point]);
        tract.radius.push_back(tree.radius[point]);
        tract.source.push_back(point);
      }
      tracts.push_back(std::move(tract));
    }
  }
  return tracts;
}
}

std::vector<VmtkTract> ToVmtkTracts(const VesselTree& given)
{
  const VesselTree tree = Split(given);
  std::set<int> parents;
  for (const Branch& branch : tree.branches)
  {
    parents.insert(branch.parentGroupId);
  }
  std::vector<PathEnd> ends;
  for (const Branch& branch : tree.branches)
  {
    if (parents.count(branch.groupId) == 0)
    {
      ends.push_back({ &branch, branch.points.size() });
    }
  }
  return PathsTo(tree, ends);
}

std::vector<VmtkTract> ToVmtkTracts(
  const VesselTree& given, const std::vector<std::int64_t>& points)
{
  const VesselTree tree = Split(given);
  // A shared point is its parent's.
  std::map<std::int64_t, PathEnd> endAt;
  for (const Branch& branch : tree.branches)
  {
    for (std::size_t i = branch.parentGroupId == -1 ? 0 : 1; i < branch.points.size(); ++i)
    {
      endAt[branch.points[i]] = { &branch, i + 1 };
    }
  }
  std::vector<PathEnd> ends;
  for (const std::int64_t point : points)
  {
    ends.push_back(endAt[point]);
  }
  return PathsTo(tree, ends);
}

VesselTree FromVmtkTracts(
  const std::vector<VmtkTract>& tracts, double tolerance, std::vector<TractPoint>* origins)
{
  if (origins != nullptr)
  {
    origins->clear();
  }
  if (!(tolerance >= 0.0 && std::isfinite(tolerance)))
  {
    RefuseTracts("the tolerance must be 0 or more");
  }
  std::map<int, std::map<int, std::size_t>> paths;
  for (std::size_t t = 0; t < tracts.size(); ++t)
  {
    CheckTract(tracts[t], t);
    if (!paths[tracts[t].centerlineId].emplace(tracts[t].tractId, t).second)
    {
      RefuseTracts("tract " + std::to_string(t) + " has the number " +
        std::to_string(tracts[t].tractId) + " on centerline " +
        std::to_string(tracts[t].centerlineId) + ", as another one");
    }
  }
  VesselTree tree;
  std::map<int, std::size_t> branchOf; // by group
  for (const auto& [path, parts] : paths)
  {
    int parent = -1;
    int number = 0;
    for (const auto& [tractId, t] : parts)
    {
      const VmtkTract& tract = tracts[t];
      const std::string name = "tract " + std::to_string(t);
      if (tractId != number)
      {
        RefuseTracts(
          "centerline " + std::to_string(path) + " has no tract " + std::to_string(number));
      }
      ++number;
      const auto known = branchOf.find(tract.groupId);
      if (known != branchOf.end())
      {
        if (tree.branches[known->second].parentGroupId != parent)
        {
          RefuseTracts(name + " of group " + std::to_string(tract.groupId) +
            " follows another group than the first tract of its group does");
        }
        parent = tract.groupId;
        continue;
      }
      Branch branch;
      branch.groupId = tract.groupId;
      branch.parentGroupId = parent;
      std::size_t first = 0;
      if (parent != -1)
      {
        const Branch& before = tree.branches[branchOf[parent]];
        branch.treeId = before.treeId;
        const std::int64_t end = before.points.back();
        if ((tree.points[end] - tract.points.front()).norm() > tolerance)
        {
          RefuseTracts(name + " does not begin where group " + std::to_string(parent) + " ends");
        }
        branch.points.push_back(end);
        first = 1;
      }
      else
      {
        branch.treeId = static_cast<int>(std::count_if(tree.branches.begin(), tree.branches.end(),
          [](const Branch& b) { return b.parentGroupId == -1; }));
      }
      for (std::size_t i = first; i < tract.points.size(); ++i)
      {
        branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
        tree.points.push_back(tract.points[i]);
        tree.radius.push_back(tract.radius[i]);
        if (origins != nullptr)
        {
          origins->push_back({ t, i });
        }
      }
      branchOf[tract.groupId] = tree.branches.size();
      tree.branches.push_back(std::move(branch));
      parent = tract.groupId;
    }
  }
  MeasureTree(tree);
  return tree;
}
}
