#include "VesselChains.h"

#include "TreeLinks.h"
#include "VesselPaths.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
std::string Lowered(std::string text)
{
  std::transform(text.begin(), text.end(), text.begin(),
    [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// "LAD" of "pLAD"; of what is no part of an artery the name itself.
std::string ArteryOf(const std::string& segment)
{
  const std::string rest = segment.empty() ? segment : segment.substr(1);
  return rest == "LAD" || rest == "LCx" || rest == "RCA" ? rest : segment;
}

void CheckNames(const VesselTree& tree, const std::vector<std::string>& names)
{
  if (names.size() != tree.branches.size())
  {
    throw std::invalid_argument("A tree to join into vessels has another number of names.");
  }
  CheckTree(tree);
}

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

  /// @param describe  makes the chain of a path
  template <typename Describe>
  std::vector<VesselChain> Join(const Describe& describe) const
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
        chains.push_back(describe(path));
        waiting.insert(waiting.end(), this->Leaving[path].rbegin(), this->Leaving[path].rend());
      }
    }
    return chains;
  }

  /// With a piece of the parent before it.
  VesselChain WithLeadIn(std::size_t number) const
  {
    const VesselPath& path = this->Paths[number];
    VesselChain chain = this->Begun(path);
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
    this->AddPieces(path, path.points.size() - 1, 0.0, chain);
    for (const std::size_t side : this->Leaving[number])
    {
      this->AddFork(side, path.arc[this->OriginOf(side)], chain);
    }
    return chain;
  }

  /// From the ostium on.
  VesselChain Whole(std::size_t number) const
  {
    // Which paths, and up to where of each, the ostium's first.
    std::vector<std::pair<std::size_t, std::size_t>> way{ { number,
      this->Paths[number].points.size() - 1 } };
    while (this->Paths[way.front().first].parent >= 0)
    {
      const std::size_t path = way.front().first;
      way.insert(
        way.begin(), { static_cast<std::size_t>(this->Paths[path].parent), this->OriginOf(path) });
    }
    VesselChain chain = this->Begun(this->Paths[number]);
    double before = 0.0;
    for (std::size_t w = 0; w < way.size(); ++w)
    {
      const auto [part, last] = way[w];
      const VesselPath& path = this->Paths[part];
      for (std::size_t k = w == 0 ? 0 : 1; k <= last; ++k)
      {
        chain.points.push_back(path.points[k]);
        chain.arc.push_back(before + path.arc[k]);
      }
      this->AddPieces(path, last, before, chain);
      const bool leaves = w + 1 < way.size();
      for (const std::size_t side : this->Leaving[part])
      {
        const std::size_t origin = this->OriginOf(side);
        if (origin <= last && !(leaves && side == way[w + 1].first))
        {
          this->AddFork(side, before + path.arc[origin], chain);
        }
      }
      if (leaves && last + 1 < path.points.size())
      {
        chain.forks.push_back({ this->NameAt(path, last + 1), before + path.arc[last] });
      }
      before += path.arc[last];
    }
    return chain;
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

  /// Whose it is: its own first branch's.
  VesselChain Begun(const VesselPath& path) const
  {
    VesselChain chain;
    const VesselTree::Branch& begin = this->Tree.branches[this->BranchAt(path, 1)];
    chain.groupId = begin.groupId;
    chain.treeId = begin.treeId;
    return chain;
  }

  void AddPieces(const VesselPath& path, std::size_t last, double before, VesselChain& chain) const
  {
    for (std::size_t k = 1; k <= last; ++k)
    {
      const std::string name = this->NameAt(path, k);
      if (chain.pieces.empty() || chain.pieces.back().name != name)
      {
        chain.pieces.push_back({ name, before + path.arc[k - 1], before + path.arc[k] });
        chain.name += (chain.name.empty() ? "" : ", ") + name;
      }
      chain.pieces.back().end = before + path.arc[k];
    }
  }

  void AddFork(std::size_t side, double arc, VesselChain& chain) const
  {
    chain.forks.push_back({ this->NameAt(this->Paths[side], 1), arc });
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
  CheckNames(tree, names);
  const Joiner joiner(tree, names, leadIn);
  return joiner.Join([&](std::size_t path) { return joiner.WithLeadIn(path); });
}

std::vector<VesselChain> VesselsFromOstia(
  const VesselTree& tree, const std::vector<std::string>& names)
{
  CheckNames(tree, names);
  const Joiner joiner(tree, names, 0.0);
  return joiner.Join([&](std::size_t path) { return joiner.Whole(path); });
}

VesselChain FindVessel(
  const VesselTree& tree, const std::vector<std::string>& names, const std::string& vessel)
{
  std::vector<VesselChain> chains = VesselsFromOstia(tree, names);
  const std::string wanted = Lowered(vessel);
  const VesselChain* best = nullptr;
  double bestLength = 0.0;
  std::set<std::string> known;
  for (const VesselChain& chain : chains)
  {
    double length = wanted.empty() ? chain.Length() : 0.0;
    for (const VesselPiece& piece : chain.pieces)
    {
      known.insert(piece.name);
      const std::string name = Lowered(piece.name);
      if (!wanted.empty() && (name == wanted || Lowered(ArteryOf(piece.name)) == wanted))
      {
        length += piece.end - piece.begin;
      }
    }
    if (length > bestLength)
    {
      bestLength = length;
      best = &chain;
    }
  }
  if (best == nullptr)
  {
    std::string list;
    for (const std::string& name : known)
    {
      list += (list.empty() ? "" : ", ") + name;
    }
    throw std::invalid_argument(wanted.empty()
        ? std::string("The tree has no vessel with a length")
        : "Vessel: the tree has no '" + vessel + "'; it has " + list);
  }
  return *best;
}
}
