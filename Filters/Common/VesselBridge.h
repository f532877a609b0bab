/**
 * @file VesselBridge.h
 * @brief A way across a lesion, where an artery is followed that is not seen.
 */
#ifndef DynamicCoronary_VesselBridge_h
#define DynamicCoronary_VesselBridge_h

#include "Geometry.h"

#include <vector>

namespace coronary
{
/// From what hangs on a seed to a piece of vessel that hangs on nothing.
struct VesselBridge
{
  std::vector<Vector3> points; ///< mm, at least one
  double confidence = 1.0;     ///< 0 to 1, that the artery runs here
  double unseen = 0.0;         ///< mm of it that show no tube
};
}

#endif
