/**
 * @file VesselFrames.h
 * @brief Rotation-minimising frames along the axes of the coronary arteries.
 */
#ifndef DynamicCoronary_VesselFrames_h
#define DynamicCoronary_VesselFrames_h

#include "FlowNetwork.h"

#include <vector>

namespace coronary
{
/// A cross-section's own directions; unit, right-handed: normal x binormal = tangent.
struct VesselFrame
{
  Vector3 tangent; ///< away from the root
  Vector3 normal;
  Vector3 binormal;
};

/**
 * Frames at all axis points, branch by branch in one list. Along a branch they do not turn about its axis (double
 * reflection: Wang, Juettler, Zheng, Liu, ACM Trans Graph 2008;27:2); a branch goes on with its parent's frame at the
 * place that it leaves from, turned the shortest way onto its own direction.
 * @param axis    as many points as the network's, mm
 * @param frames  resized; allocates nothing once it has been used before
 * @throws std::invalid_argument for another number of points
 */
void ComputeVesselFrames(
  const FlowNetwork& network, const std::vector<Vector3>& axis, std::vector<VesselFrame>& frames);
}

#endif
