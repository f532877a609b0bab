/**
 * @file CenterlineConversion.h
 * @brief Trees of centerlines in the forms of other programs: VMTK's lines, TGF skeletons.
 *
 * | form | holds | loses |
 * |---|---|---|
 * | tree | everything | |
 * | VMTK's lines | positions, radii, branches and their order | nothing: group ids come back as they were |
 * | TGF (libigl, Blender) | positions, which joint hangs on which | radii, ids, names; branches are found again |
 */
#ifndef DynamicCoronary_CenterlineConversion_h
#define DynamicCoronary_CenterlineConversion_h

#include "VesselTree.h"

#include <array>
#include <iosfwd>
#include <string>
#include <vector>

namespace coronary
{
/**
 * One stretch of a whole path, as vmtkbranchextractor gives them: paths from a root to each tip run
 * on top of each other, cut where they part. All stretches of a path have its CenterlineId, those
 * of different paths through one branch the branch's GroupId.
 */
struct VmtkTract
{
  std::vector<Vector3> points;      ///< mm; the first is the last of the tract before
  std::vector<double> radius;       ///< `MaximumInscribedSphereRadius`, mm
  int centerlineId = 0;             ///< `CenterlineIds`: number of the path
  int tractId = 0;                  ///< `TractIds`: number of the stretch on its path
  int groupId = 0;                  ///< `GroupIds`: of the branch
  int blanking = 0;                 ///< `Blanking`: 1 where VMTK sees a bifurcation; here always 0
  std::vector<std::int64_t> source; ///< of ToVmtkTracts: indices in the tree; not read
};

/// A point of a tract.
struct TractPoint
{
  std::size_t tract = 0;
  std::size_t point = 0;
};

/// @throws std::invalid_argument as CheckTree
std::vector<VmtkTract> ToVmtkTracts(const VesselTree& tree);

/**
 * The tree that the tracts cover: of tracts of one group the first one counts. A tract whose path
 * has none before begins a tree. `points` and `radius` are kept bit by bit. Blanked groups are
 * branches like the others.
 * @param origins where each point of the tree was taken from
 * @throws std::invalid_argument that names the tract: of less than two points, with another number of
 *         radii, not finite, its path's tract number missing or twice, a group with two parents, or
 *         without a point that its parent has too (within `tolerance`, mm)
 */
VesselTree FromVmtkTracts(const std::vector<VmtkTract>& tracts, double tolerance = 1e-6,
  std::vector<TractPoint>* origins = nullptr);

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
