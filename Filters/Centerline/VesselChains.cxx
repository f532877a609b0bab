#include "VesselChains.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
/// "LAD" of "pLAD": what the pieces of one artery share; empty: none.
std::string ArteryOf(const std::string& name)
{
  for (const char* artery : { "LAD", "LCx", "RCA" })
  {
    if (name.size() == 4 && name.compare(1, 3, artery) == 0)
    {
      return artery;
    }
  }
  return name == "LM" ? "LAD" : name;
}

class Joiner
{
public:
  Joiner(const CenterlineTree& tree, const std::vector<std::string>& names, double leadIn)
    : Tree(tree)
    , LeadIn(leadIn)
  {
    for (std::size_t n = 0; n < tree.branches.size(); ++n)
    {
      const CenterlineTree::Branch& branch = tree.branches[n];
      this->Index[branch.groupId] = n;
      this->Names.push_back(
        names[n].empty() ? "branch " + std::to_string(branch.groupId) : names[n]);
      this->Lengths.push_back(this->LengthOf(branch.points));
    }
    this->Daughters.resize(tree.branches.size());
    this->Reach = this->Lengths;
    // A parent stands before its daughters.
    for (std::size_t n = tree.branches.size(); n-- > 0;)
    {
      const int parent = tree.branches[n].parentGroupId;
      if (parent >= 0)
      {
        const std::size_t above = this->Index.at(parent);
        this->Daughters[above].insert(this->Daughters[above].begin(), n);
        this->Reach[above] =
          std::max(this->Reach[above], this->AttachedAt(n, above) + this->Reach[n]);
      }
    }
  }

  std::vector<VesselChain> Join()
  {
    std::vector<VesselChain> chains;
    for (std::size_t n = 0; n < this->Tree.branches.size(); ++n)
    {
      if (this->Tree.branches[n].parentGroupId >= 0)
      {
        continue;
      }
      // What leaves a vessel follows it, nearest its beginning first.
      std::vector<std::pair<std::size_t, VesselChain>> waiting = { { n, VesselChain() } };
      while (!waiting.empty())
      {
        auto [branch, lead] = std::move(waiting.back());
        waiting.pop_back();
        std::vector<std::size_t> leaving;
        chains.push_back(this->Follow(branch, std::move(lead), leaving));
        for (auto next = leaving.rbegin(); next != leaving.rend(); ++next)
        {
          waiting.emplace_back(
            *next, this->LeadInto(chains.back(), this->Tree.branches[*next].points.front()));
        }
      }
    }
    return chains;
  }

private:
  double LengthOf(const std::vector<std::int64_t>& points) const
  {
    double length = 0.0;
    for (std::size_t k = 1; k < points.size(); ++k)
    {
      length += this->Step(points[k - 1], points[k]);
    }
    return length;
  }

  double Step(std::int64_t from, std::int64_t to) const
  {
    return (this->Tree.points[static_cast<std::size_t>(to)] -
      this->Tree.points[static_cast<std::size_t>(from)])
      .norm();
  }

  /// Where on its parent a branch begins, mm from the parent's first point.
  double AttachedAt(std::size_t branch, std::size_t parent) const
  {
    const std::vector<std::int64_t>& points = this->Tree.branches[parent].points;
    const std::int64_t first = this->Tree.branches[branch].points.front();
    double arc = 0.0;
    for (std::size_t k = 0; k < points.size() && points[k] != first; ++k)
    {
      arc += k + 1 < points.size() ? this->Step(points[k], points[k + 1]) : 0.0;
    }
    return arc;
  }

  /// The daughter at the branch's end that is the same vessel; the number of branches: none.
  std::size_t Continuation(std::size_t branch) const
  {
    const std::size_t none = this->Tree.branches.size();
    std::size_t best = none;
    const std::string artery = ArteryOf(this->Names[branch]);
    const auto same = [&](std::size_t n) { return ArteryOf(this->Names[n]) == artery; };
    for (const std::size_t n : this->Daughters[branch])
    {
      if (this->Tree.branches[n].points.front() != this->Tree.branches[branch].points.back())
      {
        continue;
      }
      if (best == none || (same(n) && !same(best)) ||
        (same(n) == same(best) && this->Reach[n] > this->Reach[best]))
      {
        best = n;
      }
    }
    return best;
  }

  void Append(VesselChain& chain, std::size_t branch) const
  {
    const std::vector<std::int64_t>& points = this->Tree.branches[branch].points;
    double arc = chain.arc.empty() ? 0.0 : chain.arc.back();
    const double begin = arc;
    for (std::size_t k = 0; k < points.size(); ++k)
    {
      if (k == 0 && !chain.points.empty())
      {
        continue; // the point of its parent
      }
      arc += k > 0 ? this->Step(points[k - 1], points[k]) : 0.0;
      chain.points.push_back(points[k]);
      chain.arc.push_back(arc);
    }
    const std::string& name = this->Names[branch];
    if (!chain.pieces.empty() && chain.pieces.back().name == name)
    {
      chain.pieces.back().end = arc;
      return;
    }
    chain.pieces.push_back({ name, begin, arc });
    chain.name += (chain.name.empty() ? "" : ", ") + name;
  }

  /// The last of a vessel before a point, up to it, with arcs up to 0.
  VesselChain LeadInto(const VesselChain& parent, std::int64_t point) const
  {
    VesselChain lead;
    const auto at = std::find(parent.points.begin(), parent.points.end(), point);
    if (at == parent.points.end())
    {
      return lead;
    }
    const auto last = static_cast<std::size_t>(at - parent.points.begin());
    std::size_t first = last;
    while (first > 0 && parent.arc[last] - parent.arc[first] < this->LeadIn)
    {
      --first;
    }
    for (std::size_t k = first; k <= last; ++k)
    {
      lead.points.push_back(parent.points[k]);
      lead.arc.push_back(parent.arc[k] - parent.arc[last]);
    }
    return lead;
  }

  /// @param leaving  branches that begin on it
  VesselChain Follow(std::size_t branch, VesselChain chain, std::vector<std::size_t>& leaving) const
  {
    const std::size_t none = this->Tree.branches.size();
    chain.groupId = this->Tree.branches[branch].groupId;
    chain.treeId = this->Tree.branches[branch].treeId;
    for (std::size_t next = branch; next != none;)
    {
      const double begin = chain.arc.empty() ? 0.0 : chain.arc.back();
      this->Append(chain, next);
      const std::size_t following = this->Continuation(next);
      for (const std::size_t n : this->Daughters[next])
      {
        if (n != following)
        {
          leaving.push_back(n);
          chain.forks.push_back({ this->Names[n], begin + this->AttachedAt(n, next) });
        }
      }
      next = following;
    }
    return chain;
  }

  const CenterlineTree& Tree;
  const double LeadIn;
  std::map<int, std::size_t> Index;
  std::vector<std::string> Names;
  std::vector<double> Lengths;
  std::vector<double> Reach; ///< mm from a branch's beginning to its furthest tip
  std::vector<std::vector<std::size_t>> Daughters;
};
}

std::vector<VesselChain> JoinVessels(
  const CenterlineTree& tree, const std::vector<std::string>& names, double leadIn)
{
  if (names.size() != tree.branches.size())
  {
    throw std::invalid_argument("A tree to join into vessels has another number of names.");
  }
  CheckTree(tree);
  return Joiner(tree, names, leadIn).Join();
}
}
