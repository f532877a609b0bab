/**
 * @file BifurcationGeometry.h
 * @brief Courses, calibres and angles of the branches at a bifurcation, and the laws that their calibres follow.
 */
#ifndef DynamicCoronary_BifurcationGeometry_h
#define DynamicCoronary_BifurcationGeometry_h

#include "CenterlineTopology.h"

namespace coronary
{
/// The daughter that carries the vessel on: little turn, much calibre.
/// @param daughters  indices of branches
int ChooseContinuation(const CenterlineTopology& tree, const VesselTree::Branch& parent,
  const std::vector<int>& daughters);

/**
 * Sets `bifurcations` and `fittedExponent` of a tree.
 * @param daughters  of each branch
 * @param exponent   see TopologySettings::murrayExponent
 */
void DescribeBifurcations(
  CenterlineTopology& tree, const std::vector<std::vector<int>>& daughters, double exponent);
}

#endif
