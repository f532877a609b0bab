/**
 * @file CenterlineSkeleton.h
 * @brief Joints and bones along the centerlines of a forest of vessels.
 */
#ifndef DynamicCoronary_CenterlineSkeleton_h
#define DynamicCoronary_CenterlineSkeleton_h

#include "Geometry.h"
#include "VesselTree.h"

#include <string>
#include <vector>

namespace coronary
{
struct CenterlineSkeletonSettings
{
  double minimumLength = 3.0; ///< mm along the vessel, positive; a shorter branch is one bone
  double maximumLength = 8.0; ///< mm along the vessel, at least twice minimumLength
  double radiusFactor = 3.0;  ///< wanted length of a bone in local radii, 0.5 to 50
  double sagittaRatio =
    0.25; ///< greatest wanted distance of the vessel's axis from the bone in local
          ///< radii, 0.01 to 1; shortens bones where the vessel is curved
  bool everyStep =
    false; ///< every step of the lines is a bone, whatever its length: for lines that
           ///< are a skeleton already

  /// @throws std::invalid_argument naming the setting.
  void Validate() const;
};

/// Straight bones between joints.
struct Skeleton
{
  struct Bone
  {
    std::int64_t first = -1;  ///< joint on the root's side
    std::int64_t second = -1; ///< joint on the tips' side
    int id = 0;               ///< number of the bone, from 0
    int groupId = 0;          ///< branch of the tree that was given
    int treeId = 0;           ///< tree of the forest that was given
    int segmentId = 0;        ///< SegmentId of CoronaryAnatomy.h, 0 unknown
    std::string name;    ///< unique: segment, number along it: "pLAD-2"; "branch5-2" if unnamed
    double length = 0.0; ///< mm along the vessel; not less than the distance of the joints
  };

  std::vector<Vector3> joints;      ///< mm
  std::vector<double> radius;       ///< lumen radius at the joints, mm; may be empty
  std::vector<std::int64_t> parent; ///< per joint: the next one towards the root, -1 at a root
  std::vector<double> abscissa;     ///< per joint: mm from the root along the tree
  std::vector<Bone> bones;          ///< in the order of their ids, a parent before its daughters
};

/**
 * @throws std::invalid_argument that says what is wrong: an index out of range, an array of another
 * length than `joints`, a coordinate that is not finite, a bone without length, two bones between the
 * same joints, a ring of bones.
 */
void CheckSkeleton(const Skeleton& skeleton);

/**
 * Places joints at every root, bifurcation and end, and between them so that bones are `radiusFactor`
 * radii long, shorter where the vessel is curved, within the limits of length.
 *
 * Bones are numbered tree by tree, from the root to the tips; a name counts along its segment, and
 * does not depend on other segments. The same tree gives the same bits.
 * @throws std::invalid_argument naming the setting, or as CheckTree; a branch without length
 */
Skeleton MakeCenterlineSkeleton(
  const VesselTree& tree, const CenterlineSkeletonSettings& settings = {});
}

#endif
