#include "TreeAssignment.h"

#include "Numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace coronary
{
namespace
{
using V = Vessel;

constexpr double LongestUnnamed = 25.0; ///< conus, sinus node and atrial branches are short
constexpr double UnnamedLength = 0.12;  ///< cost of a longer one with what hangs on it, for each mm
constexpr double StemLength = 5.0;      ///< three arteries that leave the left main nearly together
constexpr double StemCost = 1.0;        ///< of a ramus that leaves such a stem
/// A left main that divides, and not into both: 0.43 in 100 have no circumflex from it (J Comput Assist Tomogr 2011).
constexpr double OneArteryCost = 5.4;

unsigned TrunkBit(V vessel)
{
  return IsTrunk(vessel) ? 1U << IndexOf(vessel) : 0U;
}

/// The costs of a tree's pieces with all that hangs on them, from the tips to the root.
class TreeAssigner
{
public:
  TreeAssigner(const CenterlineTopology& topology, const LabelPieces& pieces, int tree,
    TreeSide side, Dominance dominance)
    : Tree(topology)
    , Pieces(pieces)
    , TreeId(tree)
    , Side(side)
    , Dominant(dominance)
    , Inferior(dominance == Dominance::Balanced ? 0.0 : 2.5)
  {
  }

  double Run(const std::vector<VesselCosts>& fit, std::uint32_t forbidden, std::vector<V>& vessels);

private:
  /// By the trunks that are used: cost, and vessels of the children so far.
  using States = std::map<unsigned, std::pair<double, std::vector<V>>>;

  double Extra(V from, V to) const
  {
    return from == V::RightCoronary && to == V::InferiorRight ? this->Inferior : 0.0;
  }
  std::vector<double> Detours(const LabelPiece& chunk) const;
  double Beside(const LabelPiece& chunk, std::size_t child) const;
  bool IsStem(const LabelPiece& chunk) const;
  double GoOn(const LabelPiece& chunk, V parent, std::vector<V>& best) const;
  States DivisionStates(const LabelPiece& chunk, V parent, const std::vector<double>& detour) const;
  double Divide(const LabelPiece& chunk, V parent, const std::vector<double>& detour,
    std::vector<V>& best) const;

  const CenterlineTopology& Tree;
  const LabelPieces& Pieces;
  int TreeId;
  TreeSide Side;
  Dominance Dominant;
  /// The inferior branch is the right coronary's own end only when the left side has the
  /// posterolateral wall.
  double Inferior;
  std::vector<VesselCosts> Cost;                                   ///< of a piece as a vessel
  std::vector<std::array<std::vector<V>, NumberOfVessels>> Choice; ///< its children's vessels
};

/// How unlikely it is that each child of a piece is its vessel's continuation.
std::vector<double> TreeAssigner::Detours(const LabelPiece& chunk) const
{
  std::vector<double> detour(chunk.children.size(), 0.0);
  const Bifurcation* bifurcation =
    chunk.children.size() > 1 ? this->Pieces.bifurcationOf[chunk.branch] : nullptr;
  if (bifurcation != nullptr)
  {
    for (std::size_t i = 0; i < chunk.children.size(); ++i)
    {
      const int branch = this->Pieces.pieces[chunk.children[i]].branch;
      for (std::size_t d = 0; d < bifurcation->daughters.size(); ++d)
      {
        if (bifurcation->daughters[d] == branch)
        {
          const double turn = bifurcation->daughterAngles[d] / (40.0 * Pi / 180.0);
          const double narrow =
            std::log(bifurcation->daughterRadius[0] / bifurcation->daughterRadius[d]) / 0.35;
          detour[i] = std::min(2.5, 0.5 * turn * turn) + std::min(2.5, 0.5 * narrow * narrow);
        }
      }
    }
  }
  return detour;
}

/// The longest of what leaves a piece together with a child.
double TreeAssigner::Beside(const LabelPiece& chunk, std::size_t child) const
{
  double longest = 0.0;
  for (std::size_t i = 0; i < chunk.children.size(); ++i)
  {
    longest = i == child ? longest : std::max(longest, this->Pieces.below[chunk.children[i]]);
  }
  return longest;
}

/// Three arteries that leave the left main together come as two divisions with a stem between them.
bool TreeAssigner::IsStem(const LabelPiece& chunk) const
{
  return chunk.startsBranch && chunk.children.size() > 1 && chunk.length < StemLength &&
    this->Tree.branches[chunk.branch].generation <= 1;
}

/// @param best  the child's vessel
/// @returns the cost of what follows a piece that goes on in one child
double TreeAssigner::GoOn(const LabelPiece& chunk, V parent, std::vector<V>& best) const
{
  const auto& child = this->Cost[chunk.children[0]];
  double below = Infinity;
  for (int v = 0; v < NumberOfVessels; ++v)
  {
    const double there =
      child[v] + ChangeCost(parent, static_cast<V>(v)) + this->Extra(parent, static_cast<V>(v));
    if (there < below)
    {
      below = there;
      best.assign(1, static_cast<V>(v));
    }
  }
  return below;
}

/// The cheapest vessels for the children of a piece that divides, by the trunks that are used: each goes on in one
/// child at most.
TreeAssigner::States TreeAssigner::DivisionStates(
  const LabelPiece& chunk, V parent, const std::vector<double>& detour) const
{
  const auto& branching = BranchingCosts();
  States states;
  states[0] = { 0.0, {} };
  for (std::size_t i = 0; i < chunk.children.size(); ++i)
  {
    States next;
    for (const auto& [mask, state] : states)
    {
      for (int v = 0; v < NumberOfVessels; ++v)
      {
        const V vessel = static_cast<V>(v);
        const double child = this->Cost[chunk.children[i]][v];
        double step = branching[IndexOf(parent)][v] + this->Extra(parent, vessel);
        if (vessel == V::Other && parent != V::Other)
        {
          step +=
            UnnamedLength * std::max(0.0, this->Pieces.below[chunk.children[i]] - LongestUnnamed);
        }
        if (vessel == V::Ramus && this->IsStem(chunk) &&
          (parent == V::AnteriorDescending || parent == V::Circumflex))
        {
          step = StemCost;
        }
        // The left main ends at its first division that is more than a twig.
        const bool goesOn = parent == V::LeftMain && vessel == V::LeftMain;
        if (!(child + step < Infinity) || (mask & TrunkBit(vessel)) != 0U ||
          (goesOn && this->Beside(chunk, i) > LongestUnnamed))
        {
          continue;
        }
        if (vessel == parent && IsTrunk(vessel))
        {
          step += detour[i];
        }
        const unsigned after = mask | TrunkBit(vessel);
        const double total = state.first + step + child;
        auto& slot = next.emplace(after, std::make_pair(Infinity, std::vector<V>())).first->second;
        if (total < slot.first)
        {
          slot.first = total;
          slot.second = state.second;
          slot.second.push_back(vessel);
        }
      }
    }
    states = std::move(next);
  }
  return states;
}

/// @param best  vessels of the children
/// @returns the cost of what follows a piece that divides
double TreeAssigner::Divide(
  const LabelPiece& chunk, V parent, const std::vector<double>& detour, std::vector<V>& best) const
{
  const States states = this->DivisionStates(chunk, parent, detour);
  double below = Infinity;
  for (const auto& [mask, state] : states)
  {
    double total = state.first;
    if (parent == V::LeftMain &&
      (mask &
        (TrunkBit(V::LeftMain) | TrunkBit(V::AnteriorDescending) | TrunkBit(V::Circumflex))) == 0U)
    {
      total += 4.0;
    }
    const unsigned arteries = mask & (TrunkBit(V::AnteriorDescending) | TrunkBit(V::Circumflex));
    if (parent == V::LeftMain && (mask & TrunkBit(V::LeftMain)) == 0U &&
      (arteries == TrunkBit(V::AnteriorDescending) || arteries == TrunkBit(V::Circumflex)))
    {
      total += OneArteryCost;
    }
    if ((parent == V::AnteriorDescending || parent == V::RightCoronary ||
          parent == V::Circumflex) &&
      (mask & TrunkBit(parent)) == 0U)
    {
      // Only the right coronary and the circumflex end in other named vessels.
      const bool ends = std::any_of(state.second.begin(), state.second.end(),
        [](V v)
        {
          return v == V::RightPosteriorDescending || v == V::RightPosterolateral ||
            v == V::LeftPosteriorDescending || v == V::LeftPosterolateral || v == V::InferiorRight;
        });
      total += ends ? 0.0 : parent == V::AnteriorDescending ? 6.0 : 4.0;
    }
    if (total < below)
    {
      below = total;
      best = state.second;
    }
  }
  return below;
}

double TreeAssigner::Run(
  const std::vector<VesselCosts>& fit, std::uint32_t forbidden, std::vector<V>& vessels)
{
  const std::size_t count = this->Pieces.pieces.size();
  this->Cost.resize(count);
  this->Choice.resize(count);
  // Backwards: children have higher indices than their parents.
  for (std::size_t c = count; c-- > 0;)
  {
    const LabelPiece& chunk = this->Pieces.pieces[c];
    this->Cost[c].fill(Infinity);
    if (this->Tree.branches[chunk.branch].treeId != this->TreeId)
    {
      continue;
    }
    const std::vector<double> detour = this->Detours(chunk);
    for (int p = 0; p < NumberOfVessels; ++p)
    {
      const V parent = static_cast<V>(p);
      if (!Exists(parent, this->Side, this->Dominant) || (forbidden >> p & 1U) != 0U)
      {
        continue;
      }
      std::vector<V> best;
      double below = 0.0;
      if (chunk.children.size() == 1)
      {
        below = this->GoOn(chunk, parent, best);
      }
      else if (chunk.children.size() > 1)
      {
        below = this->Divide(chunk, parent, detour, best);
      }
      else if (parent == V::LeftMain)
      {
        below = 4.0;
      }
      this->Cost[c][p] = fit[c][p] + below;
      this->Choice[c][p] = best;
    }
  }
  double total = 0.0;
  std::vector<std::pair<int, V>> stack;
  for (const int root : this->Pieces.roots[this->TreeId])
  {
    double best = Infinity;
    V vessel = V::Other;
    for (int v = 0; v < NumberOfVessels; ++v)
    {
      const double there = this->Cost[root][v] + RootCost(this->Side, static_cast<V>(v));
      if (there < best)
      {
        best = there;
        vessel = static_cast<V>(v);
      }
    }
    if (!(best < Infinity))
    {
      return Infinity;
    }
    total += best;
    stack.emplace_back(root, vessel);
  }
  while (!stack.empty())
  {
    const auto [c, vessel] = stack.back();
    stack.pop_back();
    vessels[c] = vessel;
    for (std::size_t i = 0; i < this->Pieces.pieces[c].children.size(); ++i)
    {
      stack.emplace_back(this->Pieces.pieces[c].children[i], this->Choice[c][IndexOf(vessel)][i]);
    }
  }
  return total;
}
}

double AssignTree(const CenterlineTopology& topology, const LabelPieces& pieces, int tree,
  TreeSide side, Dominance dominance, const std::vector<VesselCosts>& fit, std::uint32_t forbidden,
  std::vector<Vessel>& vessels)
{
  return TreeAssigner(topology, pieces, tree, side, dominance).Run(fit, forbidden, vessels);
}
}
