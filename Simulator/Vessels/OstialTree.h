/**
 * @file OstialTree.h
 * @brief The vessels behind one ostium, as a wall of their own, and their beginning lengthened into the aorta.
 */
#ifndef DynamicCoronary_OstialTree_h
#define DynamicCoronary_OstialTree_h

#include "WallMotion.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// The branch whose ostium is engaged: this one, or the first root when it is negative.
/// @throws std::invalid_argument  there is no axis, or no such branch
int RootOf(const WallTopology& topology, int wanted);

/// mm, the least radius of a branch on its first `along` mm; infinite where no radii are known.
double NarrowestBefore(const WallTopology& topology, int branch, double along);

/// What is connected with the place where a catheter's tip is: no instrument comes to other vessels.
struct OstialTree
{
  WallTopology topology;            ///< triangles, entities and groups
  std::vector<std::int64_t> points; ///< of the whole wall, per point
  std::int64_t inlet = -1;          ///< triangle of the tree next to the catheter's tip
  int cap = 0;                      ///< entity that the catheter comes in through; 0: there is none
};

/// @param points, ostium, tip  mm
/// @throws std::invalid_argument  the wall is all caps
OstialTree MakeOstialTree(const WallTopology& topology, const std::vector<Vector3>& points,
  const Vector3& ostium, const Vector3& tip);

/**
 * A tree's inlet, drawn out: rings of points go on from its rim against the vessel's direction, and its cap closes them there.
 * So an instrument that comes to it meets the rim of a tube, wherever in the aorta's wall the tree begins.
 */
class LengthenedInlet
{
public:
  static constexpr double RingSpacing = 1.0; ///< mm

  /// @param tree  gets the points and triangles, at the end of its own @param length  mm
  /// @throws std::invalid_argument  it has no cap
  LengthenedInlet(OstialTree& tree, double length);

  /// @param points     mm, of the tree; those that were added are appended, and its cap is moved
  /// @param direction  unit, into the vessel
  void Lengthen(std::vector<Vector3>& points, const Vector3& direction) const;

private:
  std::vector<std::int64_t> Rim;
  std::vector<std::int64_t> Middle; ///< the cap's other points
  int Rings = 0;
};
}

#endif
