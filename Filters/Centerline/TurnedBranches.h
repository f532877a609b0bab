/**
 * @file TurnedBranches.h
 * @brief Branches that run back beside the vessel they hang on: other vessels that touch it there, entered from their ends.
 *
 * Two daughters of one vessel may meet again farther on. What hangs together is followed from where they meet, against
 * the flow, when the begin of the second one is too faint to be followed. Such a branch belongs where its own far end points.
 */
#ifndef DynamicCoronary_TurnedBranches_h
#define DynamicCoronary_TurnedBranches_h

#include "LumenMeasurement.h"
#include "VesselTree.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// A branch that was entered from its end.
struct TurnedBranch
{
  std::size_t branch = 0;   ///< in the tree
  std::size_t contact = 0;  ///< number of its first point that is outside of the lumen it hangs on
  std::int64_t root = -1;   ///< point of the tree that it leaves in truth; -1: not found
  std::vector<Vector3> way; ///< mm, from within the root's lumen to its last point
  double length = 0.0;      ///< mm of the branch
};

/**
 * @param image  lumens are bright
 * @param tree   not split; a parent stands before its daughters
 * @param voxel  edge of a voxel (of its cube), mm, > 0
 * @return branches without daughters that leave against the flow and stay beside what they hang on. A root is found when the
 *         image shows a vessel all the way from the branch's end to a vessel upstream.
 * @throws std::invalid_argument as CheckTree
 */
std::vector<TurnedBranch> FindTurnedBranches(
  const ImageInterpolator& image, const VesselTree& tree, double voxel);
}

#endif
