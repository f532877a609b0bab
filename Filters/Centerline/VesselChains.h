/**
 * @file VesselChains.h
 * @brief The branches of a tree joined into vessels that are looked at from their beginning to their end.
 */
#ifndef DynamicCoronary_VesselChains_h
#define DynamicCoronary_VesselChains_h

#include "VesselTree.h"

#include <string>
#include <vector>

namespace coronary
{
/// A piece of a vessel with one name.
struct VesselPiece
{
  std::string name;
  double begin = 0.0; ///< mm from the vessel's beginning
  double end = 0.0;
};

/// A branch that leaves a vessel.
struct VesselFork
{
  std::string name;
  double arc = 0.0; ///< mm from the vessel's beginning
};

struct VesselChain
{
  std::string name;                 ///< of its pieces: "LM, pLAD, mLAD, dLAD"
  std::vector<std::int64_t> points; ///< of the tree, in order; those of the lead-in first
  std::vector<double> arc; ///< of each point, mm from the beginning; negative in the lead-in
  std::vector<VesselPiece> pieces;
  std::vector<VesselFork> forks;
  int groupId = 0; ///< of its first branch
  int treeId = 0;

  double Length() const { return this->arc.empty() ? 0.0 : this->arc.back(); }
};

/**
 * The vessels are those of VesselPaths. One that leaves another begins with a piece of that one, so that its origin
 * is seen. In the order of the trees; a vessel before those that leave it.
 * @param names   of the branches; empty ones become "branch N", N the group
 * @param leadIn  mm of the parent before the origin
 * @throws std::invalid_argument for another number of names than branches; as CheckTree
 */
std::vector<VesselChain> JoinVessels(
  const VesselTree& tree, const std::vector<std::string>& names, double leadIn = 8.0);

/**
 * The same vessels, each as the whole way from its ostium to its tip: arcs are mm from the ostium, pieces and forks those
 * of the whole way (where it leaves another vessel, the rest of that one is a fork). In the order of JoinVessels.
 * @throws as JoinVessels
 */
std::vector<VesselChain> VesselsFromOstia(
  const VesselTree& tree, const std::vector<std::string>& names);

/**
 * One of VesselsFromOstia by name: of a segment ("mLAD", "D1") or of an artery ("LAD", "LCx", "RCA"), whatever the case
 * of its letters. Of several the one that has most of it; without a name the longest one.
 * @throws std::invalid_argument for a name that the tree does not have, naming those that it has; as JoinVessels
 */
VesselChain FindVessel(
  const VesselTree& tree, const std::vector<std::string>& names, const std::string& vessel);
}

#endif
