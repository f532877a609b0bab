/**
 * @file BridgeCheck.h
 * @brief What a way across a lesion runs through, and what is said of it.
 */
#ifndef DynamicCoronary_BridgeCheck_h
#define DynamicCoronary_BridgeCheck_h

#include "LumenMeasurement.h"
#include "TreeCheck.h"
#include "VesselBridge.h"

namespace coronary
{
enum class BridgeKind : int
{
  Stenosis = 0, ///< a thin lumen is seen
  Calcium = 1,  ///< it is brighter than blood somewhere
  Occlusion = 2 ///< nothing is seen for 3 mm or more
};

/// "stenosis", "calcium", "occlusion".
const char* BridgeKindName(BridgeKind kind);

/// @param blood  the image's value of undiluted contrast medium
BridgeKind KindOfBridge(const VesselBridge& bridge, const ImageInterpolator& image, double blood);

/**
 * That no lumen is seen along a bridge: to be said of an occlusion.
 * @param vessel  name of the vessel that runs across it
 */
TreeWarning OcclusionWarning(const VesselBridge& bridge, const std::string& vessel);
}

#endif
