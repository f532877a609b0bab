/**
 * @file VesselTree.h
 * @brief The axes of a forest of vessels: what the stages after the image pass on.
 *
 * Names and conventions are those of PhantomTree (the truth), so that the two compare member by
 * member. Positions are LPS in mm.
 */
#ifndef DynamicCoronary_VesselTree_h
#define DynamicCoronary_VesselTree_h

#include "Geometry.h"

namespace coronary
{
/**
 * Polylines over one list of points. Every tree of the forest is connected: the first point of a
 * branch is a point of its parent, the same index and not a copy.
 *
 * A tree is *split* when branches touch at their ends only: the first point of a branch is then
 * the last of its parent, and a bifurcation is a point where one branch ends and others begin.
 * Algorithms give split trees, and take any.
 *
 * Per-point members other than `points` and `radius` may be empty: not known. Data of a shared
 * point belong to the parent.
 */
struct VesselTree
{
  struct Branch
  {
    std::vector<std::int64_t> points; ///< indices from the root side to the tip, at least 2
    int groupId = 0;                  ///< unique in the forest
    int parentGroupId = -1;           ///< -1 at a root
    int treeId = 0; ///< which tree of the forest; once labelled 0 left, 1 right, as the phantom's
    // From here on filled by the topology stage.
    int generation = 0; ///< 0 at a root
    int strahlerOrder = 1;
    int segmentId = 0;       ///< SegmentId of CoronaryAnatomy.h, 0 unknown
    double length = 0.0;     ///< mm
    double tortuosity = 0.0; ///< length / chord - 1
  };

  std::vector<Vector3> points;    ///< mm
  std::vector<double> radius;     ///< lumen radius, mm
  std::vector<double> confidence; ///< of position and radius: 0 a guess .. 1 clearly seen
  /// 1: not seen, guessed on a way across a lesion; 0 seen.
  std::vector<unsigned char> bridged;
  /// That the way here, from the last place that is seen for certain, is the artery's: 0 to 1. Of everything behind
  /// a link across a lesion it is the product of the links before it.
  std::vector<double> bridgeConfidence;
  std::vector<double> abscissa; ///< mm from the root along the tree
  std::vector<int> segmentId;
  std::vector<Branch> branches; ///< a parent stands before its daughters
};

/**
 * @throws std::invalid_argument that says what is wrong: an array of another length than `points`, an
 * index out of range, a branch of less than two points, a group id twice, a parent that does not
 * exist, stands later or does not have the first point, a value that is not finite, a radius < 0.
 */
void CheckTree(const VesselTree& tree);

/// Fills `abscissa` and the branches' `length` and `tortuosity`.
/// @throws std::invalid_argument as CheckTree
void MeasureTree(VesselTree& tree);

/**
 * The same forest with branches that touch at their ends only. Branches are cut where others
 * begin, get new group ids 0, 1, ... (a parent before its daughters), and keep the other members
 * of the branch they were cut from; length and tortuosity are measured anew.
 * @throws std::invalid_argument as CheckTree
 */
VesselTree SplitAtBifurcations(const VesselTree& tree);
}

#endif
