#include "TreeLinks.h"

#include <map>

namespace coronary
{
TreeLinks::TreeLinks(const VesselTree& tree)
  : parent(tree.branches.size(), -1)
  , daughters(tree.branches.size())
{
  CheckTree(tree);
  std::map<int, std::size_t> byGroup;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    byGroup[tree.branches[b].groupId] = b;
    if (tree.branches[b].parentGroupId >= 0)
    {
      const std::size_t up = byGroup.at(tree.branches[b].parentGroupId);
      this->parent[b] = static_cast<std::int64_t>(up);
      this->daughters[up].push_back(b);
    }
  }
}

std::vector<std::int64_t> BranchesOfPoints(const VesselTree& tree)
{
  std::vector<std::int64_t> branches(tree.points.size(), -1);
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    const VesselTree::Branch& branch = tree.branches[b];
    for (std::size_t i = branch.parentGroupId < 0 ? 0 : 1; i < branch.points.size(); ++i)
    {
      branches[branch.points[i]] = static_cast<std::int64_t>(b);
    }
  }
  return branches;
}

std::vector<double> ArcLengths(const VesselTree& tree, const std::vector<std::int64_t>& points)
{
  std::vector<double> arc(points.size(), 0.0);
  for (std::size_t i = 1; i < points.size(); ++i)
  {
    arc[i] = arc[i - 1] + (tree.points[points[i]] - tree.points[points[i - 1]]).norm();
  }
  return arc;
}
}
