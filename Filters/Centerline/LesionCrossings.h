/**
 * @file LesionCrossings.h
 * @brief What of an extraction lies on the ways across lesions, where no vessel need be seen.
 */
#ifndef DynamicCoronary_LesionCrossings_h
#define DynamicCoronary_LesionCrossings_h

#include "MeasuredPath.h"
#include "VesselBridge.h"
#include "VesselTree.h"

namespace coronary
{
/// Which samples lie on a way across a lesion.
void MarkCrossings(
  MeasuredPath& path, const std::vector<VesselBridge>& bridges, const PathMeasurement& measurement);

/// What was guessed on the ways across lesions, and how certain it is that what lies behind them belongs to the tree.
/// @param tree  its `bridged` and `bridgeConfidence` are set
void MarkBridged(
  VesselTree& tree, const std::vector<VesselBridge>& bridges, const PathMeasurement& measurement);
}

#endif
