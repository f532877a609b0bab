#include "VesselPriors.h"

#include "Numbers.h"

namespace coronary
{
const std::array<VesselCosts, NumberOfVessels>& BranchingCosts()
{
  static const std::array<VesselCosts, NumberOfVessels> costs = []
  {
    std::array<VesselCosts, NumberOfVessels> c{};
    for (VesselCosts& row : c)
    {
      row.fill(Infinity);
    }
    const auto set = [&](Vessel from, Vessel to, double cost)
    { c[IndexOf(from)][IndexOf(to)] = cost; };
    using V = Vessel;
    for (int v = 0; v < NumberOfVessels; ++v)
    {
      c[v][IndexOf(V::Other)] = 2.5;
      c[v][v] = IsTrunk(static_cast<V>(v)) ? 0.0 : 0.3;
    }
    c[IndexOf(V::Other)][IndexOf(V::Other)] = 0.0;
    set(V::LeftMain, V::AnteriorDescending, 0.0);
    set(V::LeftMain, V::Circumflex, 0.0);
    set(V::LeftMain, V::Ramus, 1.0);
    set(V::LeftMain, V::Diagonal, 3.0);
    set(V::LeftMain, V::ObtuseMarginal, 3.0);
    set(V::AnteriorDescending, V::Diagonal, 0.3);
    set(V::AnteriorDescending, V::Septal, 0.3);
    set(V::AnteriorDescending, V::Ramus, 3.0);
    set(V::AnteriorDescending, V::Circumflex, 4.0);
    set(V::Circumflex, V::AnteriorDescending, 4.0);
    set(V::Circumflex, V::ObtuseMarginal, 0.3);
    set(V::Circumflex, V::Ramus, 3.0);
    set(V::Circumflex, V::LeftPosterolateral, 0.5);
    set(V::Circumflex, V::LeftPosteriorDescending, 0.5);
    set(V::LeftPosteriorDescending, V::LeftPosterolateral, 1.5);
    set(V::LeftPosterolateral, V::LeftPosteriorDescending, 1.5);
    set(V::RightCoronary, V::RightVentricular, 0.3);
    set(V::RightCoronary, V::AcuteMarginal, 0.3);
    set(V::RightCoronary, V::RightPosteriorDescending, 0.3);
    set(V::RightCoronary, V::RightPosterolateral, 0.3);
    set(V::RightCoronary, V::InferiorRight, 1.0);
    set(V::RightPosterolateral, V::InferiorRight, 0.5);
    set(V::RightPosterolateral, V::RightPosteriorDescending, 3.0);
    set(V::RightPosteriorDescending, V::RightPosterolateral, 3.0);
    set(V::Ramus, V::Diagonal, 4.0);
    set(V::Ramus, V::ObtuseMarginal, 4.0);
    return c;
  }();
  return costs;
}

double ChangeCost(Vessel from, Vessel to)
{
  if (from == to)
  {
    return 0.0;
  }
  using V = Vessel;
  const auto is = [&](V a, V b) { return from == a && to == b; };
  if (is(V::LeftMain, V::AnteriorDescending) || is(V::LeftMain, V::Circumflex))
  {
    return 2.5;
  }
  if (is(V::Circumflex, V::LeftPosterolateral) || is(V::Circumflex, V::LeftPosteriorDescending) ||
    is(V::RightCoronary, V::RightPosterolateral) || is(V::RightCoronary, V::InferiorRight) ||
    is(V::RightCoronary, V::RightPosteriorDescending))
  {
    return 2.0;
  }
  if (is(V::RightCoronary, V::AcuteMarginal) || is(V::Circumflex, V::ObtuseMarginal) ||
    is(V::AnteriorDescending, V::Diagonal))
  {
    return 4.0;
  }
  return Infinity;
}

double RootCost(TreeSide side, Vessel vessel)
{
  using V = Vessel;
  if (side == TreeSide::Left)
  {
    return vessel == V::LeftMain                                   ? 0.0
      : vessel == V::AnteriorDescending || vessel == V::Circumflex ? 4.0
                                                                   : Infinity;
  }
  return vessel == V::RightCoronary ? 0.0 : Infinity;
}

bool Exists(Vessel vessel, TreeSide side, Dominance dominance)
{
  using V = Vessel;
  if (vessel == V::Other)
  {
    return true;
  }
  if (IsLeft(vessel) != (side == TreeSide::Left))
  {
    return false;
  }
  switch (vessel)
  {
    case V::LeftPosteriorDescending:
      return dominance == Dominance::Left;
    case V::LeftPosterolateral:
      return dominance != Dominance::Right;
    case V::RightPosteriorDescending:
    case V::InferiorRight:
      return dominance != Dominance::Left;
    case V::RightPosterolateral:
      return dominance == Dominance::Right;
    default:
      return true;
  }
}

double DominanceCost(Dominance dominance)
{
  // Where only a posterolateral branch is seen on the left, nothing speaks for a left dominance.
  return dominance == Dominance::Right ? 0.2 : dominance == Dominance::Left ? 2.4 : 2.3;
}
}
