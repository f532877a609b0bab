#include "VesselChains.h"

#include "TreeLinks.h"
#include "VesselPaths.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
class Joiner
{
public:
  Joiner(const VesselTree& tree, const std::vector<std::string>& names, double leadIn)
    : Tree(tree)
    , Names(names)
    , LeadIn(leadIn)
    , Paths(VesselPaths(tree))
    , Owner(BranchesOfPoints(tree))
    , Leaving(this->Paths.size())
  {
    for (std::size_t p = 0; p < this->Paths.size(); ++p)
    {
      if (this->Paths[p].parent >= 0)
      {
        this->Leaving[this->Paths[p].parent].push_back(p);
      }
    }
    for (std::size_t p = 0; p < this->Paths.size(); ++p)
    {
      std::stable_sort(this->Leaving[p].begin(), this->Leaving[p].end(),
        [&](std::size_t a, std::size_t b) { return this->OriginOf(a) < this->OriginOf(b); });
    }
  }

  std::vector<VesselChain> Join() const
  {
    std::vector<VesselChain> chains;
    for (std::size_t root = 0; root < this->Paths.size(); ++root)
    {
      if (this->Paths[root].parent >= 0)
      {
        continue;
      }
      // What leaves a vessel follows it, nearest its beginning first.
      std::vector<std::size_t> waiting{ root };
      while (!waiting.empty())
      {
        const std::size_t path = waiting.back();
        waiting.pop_back();
        chains.push_back(this->Describe(path));
        waiting.insert(waiting.end(), this->Leaving[path].rbegin(), this->Leaving[path].rend());
      }
    }
    return chains;
  }

private:
  /// The place on its parent's path where a path begins.
  std::size_t OriginOf(std::size_t path) const
  {
    const std::vector<std::int64_t>& parent = this->Paths[this->Paths[path].parent].points;
    return static_cast<std::size_t>(
      std::find(parent.begin(), parent.end(), this->Paths[path].points.front()) - parent.begin());
  }

  std::int64_t BranchAt(const VesselPath& path, std::size_t place) const
  {
    return this->Owner[path.points[place]];
  }

  std::string NameAt(const VesselPath& path, std::size_t place) const
  {
    const std::int64_t branch = this->BranchAt(path, place);
    return this->Names[branch].empty()
      ? "branch " + std::to_string(this->Tree.branches[branch].groupId)
      : this->Names[branch];
  }

  VesselChain Describe(std::size_t number) const
  {
    const VesselPath& path = this->Paths[number];
    VesselChain chain;
    if (path.parent >= 0)
    {
      const VesselPath& parent = this->Paths[path.parent];
      const std::size_t last = this->OriginOf(number);
      std::size_t first = last;
      while (first > 0 && parent.arc[last] - parent.arc[first] < this->LeadIn)
      {
        --first;
      }
      for (std::size_t k = first; k < last; ++k)
      {
        chain.points.push_back(parent.points[k]);
        chain.arc.push_back(parent.arc[k] - parent.arc[last]);
      }
    }
    chain.points.insert(chain.points.end(), path.points.begin(), path.points.end());
    chain.arc.insert(chain.arc.end(), path.arc.begin(), path.arc.end());
    const VesselTree::Branch& begin = this->Tree.branches[this->BranchAt(path, 1)];
    chain.groupId = begin.groupId;
    chain.treeId = begin.treeId;
    for (std::size_t k = 1; k < path.points.size(); ++k)
    {
      const std::string name = this->NameAt(path, k);
      if (chain.pieces.empty() || chain.pieces.back().name != name)
      {
        chain.pieces.push_back({ name, path.arc[k - 1], path.arc[k] });
        chain.name += (chain.name.empty() ? "" : ", ") + name;
      }
      chain.pieces.back().end = path.arc[k];
    }
    for (const std::size_t side : this->Leaving[number])
    {
      chain.forks.push_back({ this->NameAt(this->Paths[side], 1), path.arc[this->OriginOf(side)] });
    }
    return chain;
  }

  const VesselTree& Tree;
  const std::vector<std::string>& Names;
  const double LeadIn;
  std::vector<VesselPath> Paths;
  std::vector<std::int64_t> Owner; ///< of a point: its branch; a shared one is the parent's
  std::vector<std::vector<std::size_t>>
    Leaving; ///< of a path: those that leave it, by their origin
};
}

std::vector<VesselChain> JoinVessels(
  const VesselTree& tree, const std::vector<std::string>& names, double leadIn)
{
  if (names.size() != tree.branches.size())
  {
    throw std::invalid_argument("A tree to join into vessels has another number of names.");
  }
  CheckTree(tree);
  return Joiner(tree, names, leadIn).Join();
}
}
