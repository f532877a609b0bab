#include "BridgeCheck.h"

#include <algorithm>
#include <cstdio>
#include <limits>

namespace coronary
{
const char* BridgeKindName(BridgeKind kind)
{
  constexpr const char* names[] = { "stenosis", "calcium", "occlusion" };
  return names[static_cast<int>(kind)];
}

BridgeKind KindOfBridge(const VesselBridge& bridge, const ImageInterpolator& image, double blood)
{
  constexpr double nothingSeen = 3.0; // mm
  constexpr double calcium = 1.3;     // of the blood
  double brightest = -std::numeric_limits<double>::infinity();
  for (const Vector3& point : bridge.points)
  {
    brightest = std::max(brightest, image.At(point));
  }
  return brightest > calcium * blood ? BridgeKind::Calcium
    : bridge.unseen >= nothingSeen   ? BridgeKind::Occlusion
                                     : BridgeKind::Stenosis;
}

TreeWarning OcclusionWarning(const VesselBridge& bridge, const std::string& vessel)
{
  const Vector3& from = bridge.points.front();
  const Vector3& to = bridge.points.back();
  char text[240];
  std::snprintf(text, sizeof(text),
    ": no lumen is seen for %.0f mm between (%.0f, %.0f, %.0f) and (%.0f, %.0f, %.0f): occluded, "
    "or lost in the image; what lies behind was linked with a confidence of %.2f",
    bridge.unseen, from[0], from[1], from[2], to[0], to[1], to[2], bridge.confidence);
  return { vessel + text, vessel, 0.5 * (from + to), 1.0 - bridge.confidence };
}
}
