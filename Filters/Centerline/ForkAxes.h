/**
 * @file ForkAxes.h
 * @brief The axes of vessels around the forks of a finished tree. Only places of points and confidences change.
 */
#ifndef DynamicCoronary_ForkAxes_h
#define DynamicCoronary_ForkAxes_h

#include "MeasuredPath.h"
#include "VesselTree.h"

namespace coronary
{
/**
 * A path that turned off is rounded where it did, and the vessel that went straight on was set on
 * to that curve. Only the two axes' places change.
 * @param tree   split, numbered by groups
 * @param paths  for each point the path that it was found on
 */
void StraightenForks(
  VesselTree& tree, const std::vector<std::int32_t>& paths, const PathMeasurement& measurement);

/// The axes at the mouths of branches, as the wall around them has it. For images, not for fixed levels.
/// @param tree  split, numbered by groups
void FitForks(VesselTree& tree, const PathMeasurement& measurement);
}

#endif
