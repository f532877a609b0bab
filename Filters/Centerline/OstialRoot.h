/**
 * @file OstialRoot.h
 * @brief Puts the beginning of each tree where its vessel leaves the aorta.
 *
 * What leads to the tree's first clear section comes out of the aorta or out of the funnel at its
 * wall: bent towards the seed, and as wide as the funnel. From that section the vessel is followed
 * back as long as its wall can be seen around it. Where it opens is the ostial plane.
 */
#ifndef DynamicCoronary_OstialRoot_h
#define DynamicCoronary_OstialRoot_h

#include "LumenMeasurement.h"
#include "VesselTree.h"

#include <vector>

namespace coronary
{
/// What became of one tree's beginning.
struct OstialRoot
{
  int treeId = 0;
  bool found = false; ///< false: no clear section before the first branch, the tree stays as it is
  Vector3 position = Vector3::Zero(); ///< mm, the first point
  Vector3 normal =
    Vector3::Zero();   ///< of the ostial plane, unit vector into the vessel: the line's direction
  double radius = 0.0; ///< mm, of the vessel there
  double moved = 0.0;  ///< mm from where the tree began
};

/**
 * Points keep their indices and branches their points: those before the first clear section, and some behind it,
 * are spread evenly over the new course. Nothing at or behind the first branch moves.
 * @param tree      not split or split; radius and confidence of every point
 * @param image     what lumens are measured on
 * @param settings  what counts as contrast; without a fixed level
 * @return          one for each root, in the order of the branches
 */
std::vector<OstialRoot> SettleRoots(
  VesselTree& tree, const ImageInterpolator& image, const LumenSettings& settings);
}

#endif
