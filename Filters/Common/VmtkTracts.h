/**
 * @file VmtkTracts.h
 * @brief Trees as VMTK has them: whole paths that run on top of each other. Only for the exchange with VMTK.
 */
#ifndef DynamicCoronary_VmtkTracts_h
#define DynamicCoronary_VmtkTracts_h

#include "VesselTree.h"

#include <cstddef>
#include <cstdint>
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

///@{
/// Paths from the roots to the tips, or to `ends`: points of the tree, which may lie within a branch. To a root and to
/// points without a branch there is no path. A tree that is not split is split first.
/// @throws std::invalid_argument as CheckTree
std::vector<VmtkTract> ToVmtkTracts(const VesselTree& tree);
std::vector<VmtkTract> ToVmtkTracts(const VesselTree& tree, const std::vector<std::int64_t>& ends);
///@}

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
}

#endif
