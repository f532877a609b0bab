/**
 * @file TreeLinks.h
 * @brief How the branches of a tree hang together, and what belongs to which.
 */
#ifndef DynamicCoronary_TreeLinks_h
#define DynamicCoronary_TreeLinks_h

#include "VesselTree.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace coronary
{
/// Branches are numbers in the tree.
struct TreeLinks
{
  /// @throws std::invalid_argument as CheckTree
  explicit TreeLinks(const VesselTree& tree);

  bool IsRoot(std::size_t branch) const { return this->parent[branch] < 0; }
  bool IsTip(std::size_t branch) const { return this->daughters[branch].empty(); }

  std::vector<std::int64_t> parent; ///< -1 at a root
  std::vector<std::vector<std::size_t>> daughters;
};

/// Of each point the branch that it belongs to, a shared one to the parent; -1 without any.
std::vector<std::int64_t> BranchesOfPoints(const VesselTree& tree);

/// Whether a point was not seen but guessed on a way across a lesion.
inline bool IsBridged(const VesselTree& tree, std::size_t point)
{
  return !tree.bridged.empty() && tree.bridged[point] != 0;
}

/// Of each of some points in order: mm along them from the first one.
std::vector<double> ArcLengths(const VesselTree& tree, const std::vector<std::int64_t>& points);
}

#endif
