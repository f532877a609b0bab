/**
 * @file VesselPriors.h
 * @brief Which coronary vessel may come out of which, and how usual that is; for SegmentLabeling.
 */
#ifndef DynamicCoronary_VesselPriors_h
#define DynamicCoronary_VesselPriors_h

#include "LabelPieces.h"

#include <array>

namespace coronary
{
/// Negative logarithms of likelihoods; infinite where there is no such thing.
using VesselCosts = std::array<double, NumberOfVessels>;

inline int IndexOf(Vessel vessel)
{
  return static_cast<int>(vessel);
}

inline bool IsTrunk(Vessel vessel)
{
  return vessel == Vessel::LeftMain || vessel == Vessel::AnteriorDescending ||
    vessel == Vessel::Circumflex || vessel == Vessel::RightCoronary;
}

/// What may branch off what, and how unusual that is.
const std::array<VesselCosts, NumberOfVessels>& BranchingCosts();

/// The same inside a branch, where the side branch that marks the change was not seen.
double ChangeCost(Vessel from, Vessel to);

/// Of the vessel that a tree begins with.
double RootCost(TreeSide side, Vessel vessel);

/// Kinds of vessel that there are on a side under a dominance.
bool Exists(Vessel vessel, TreeSide side, Dominance dominance);

/// -log of how often it occurs.
double DominanceCost(Dominance dominance);
}

#endif
