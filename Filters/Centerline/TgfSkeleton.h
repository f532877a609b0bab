/**
 * @file TgfSkeleton.h
 * @brief Trees as joints and bones in Trivial Graph Format (libigl, Blender).
 *
 * It holds positions, and which joint hangs on which; radii, ids and names are lost, branches are found again.
 */
#ifndef DynamicCoronary_TgfSkeleton_h
#define DynamicCoronary_TgfSkeleton_h

#include "VesselTree.h"

#include <array>
#include <iosfwd>
#include <string>
#include <vector>

namespace coronary
{
/// Joints and bones.
struct TgfSkeleton
{
  std::vector<Vector3> joints;
  std::vector<std::array<std::int64_t, 2>> bones; ///< indices from 0, parent first
};

/// Every point that a branch uses becomes a joint, in the order of the branches; every step a bone.
/// @throws std::invalid_argument as CheckTree
TgfSkeleton ToSkeleton(const VesselTree& tree);

/**
 * Branches are the ways between roots, forks and ends. A root is a joint at which bones only begin,
 * else (bones that go both ways) the first joint of a piece that is an end. Radii are `radius`:
 * the format has none. Joints without a bone are left out.
 * @throws std::invalid_argument that names the bone: an index out of range, from a joint to itself,
 *         twice, or closing a loop; a joint or radius that is not finite
 */
VesselTree FromSkeleton(const TgfSkeleton& skeleton, double radius = 1.0);

/**
 * Trivial Graph Format as libigl writes and reads it: "index x y z" lines with indices from 1, "#",
 * "from to" lines. Numbers have as many digits as they need to come back the same.
 */
void WriteTgf(std::ostream& stream, const TgfSkeleton& skeleton);

/// Also takes indices in any order, empty lines, and the further parts after a second "#" (handles
/// of libigl), which are ignored.
/// @throws std::invalid_argument naming the line
TgfSkeleton ReadTgf(std::istream& stream);
}

#endif
