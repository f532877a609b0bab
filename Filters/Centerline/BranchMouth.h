/**
 * @file BranchMouth.h
 * @brief How a branch begins: inside its parent's lumen no section is its own.
 */
#ifndef DynamicCoronary_BranchMouth_h
#define DynamicCoronary_BranchMouth_h

#include "MeasuredPath.h"
#include "VesselTree.h"

namespace coronary
{
constexpr double GreatBranch = 0.6; ///< radius in radii of its parent
/// Between where a great branch's axis can be seen and the parent's axis; mean of phantoms. Radians.
constexpr double GreatBranchBend = 0.2;

/// Of a point from a straight line. @param direction  of the line, a unit vector
inline double LineDistance(const Vector3& point, const Vector3& origin, const Vector3& direction)
{
  const Vector3 offset = point - origin;
  return (offset - offset.dot(direction) * direction).norm();
}

/**
 * Replaces the part of a path inside its parent's lumen by the meeting of the two axes.
 * @param tree   points and radii
 * @param chain  the parent's points
 * @param owner  the point of them that the path's way met
 * @returns the index of the parent's point in the tree
 */
std::size_t JoinParent(MeasuredPath& path, const VesselTree& tree,
  const std::vector<std::int64_t>& chain, std::int32_t owner, const PathMeasurement& measurement);
}

#endif
