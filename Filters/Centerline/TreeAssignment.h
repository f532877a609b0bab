/**
 * @file TreeAssignment.h
 * @brief The likeliest vessels for the pieces of one tree, by dynamic programming; for SegmentLabeling.
 */
#ifndef DynamicCoronary_TreeAssignment_h
#define DynamicCoronary_TreeAssignment_h

#include "LabelPieces.h"
#include "VesselPriors.h"

#include <cstdint>

namespace coronary
{
/**
 * @param tree       its number
 * @param fit        costs of each piece by its course
 * @param forbidden  a bit for each vessel that another tree has
 * @param vessels    of its pieces, set
 * @returns the cost; infinite if there is no way to name it
 */
double AssignTree(const CenterlineTopology& topology, const LabelPieces& pieces, int tree,
  TreeSide side, Dominance dominance, const std::vector<VesselCosts>& fit, std::uint32_t forbidden,
  std::vector<Vessel>& vessels);
}

#endif
