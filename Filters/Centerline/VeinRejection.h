/**
 * @file VeinRejection.h
 * @brief Branches of a tree of arteries that are veins which touch it.
 *
 * Veins cross arteries instead of leaving them: where one touches, a tube goes through. They widen towards the heart
 * while arteries taper away from it, end as wide as they are (where another way into them was shorter) while arteries end
 * thin, leave in any direction while arteries leave with the flow, run beside an artery, and mostly hold less
 * contrast medium. No single sign decides: each adds to the odds, measured against how the tree's own branches vary.
 */
#ifndef DynamicCoronary_VeinRejection_h
#define DynamicCoronary_VeinRejection_h

#include "CenterlineTree.h"
#include "LumenMeasurement.h"

#include <limits>
#include <string>
#include <vector>

namespace coronary
{
struct VeinBranch
{
  int groupId = -1; ///< of the branch where the vein begins
  int oppositeGroupId =
    -1; ///< of the branch in which it goes on at the artery's other side, -1 none
  double probability = 0.0; ///< 0 to 1
  double brightness = 0.0;  ///< step from the artery, share of the contrast, negative: darker
  double calibre = 1.0;     ///< radius over the greatest of the artery before it
  double growth = 1.0; ///< radius at its end over the larger of that at its begin and the artery's
  double taper =
    0.0; ///< logarithm of its radius over that half of its length before, where that grows least; NaN not known
  double blunt = 0.0;   ///< logarithm of the radius at its tip over what tips of the tree have
  double takeOff = 0.0; ///< angle to the flow in the artery before, rad
  double bend =
    0.0; ///< of the tube through the artery to the opposite branch, rad; if there is one
  double beside = 0.0;              ///< share of its length beside an artery
  std::vector<std::int64_t> closed; ///< points from its begin on that are the vein's for certain
};

/**
 * @param tree       split; radii in mm
 * @param reference  what a lumen and its surroundings look like
 * @param blur       of the image, standard deviation in mm
 * @returns the branches with a probability of a half or more, a parent before its daughters
 * @throws std::invalid_argument as CheckTree
 */
std::vector<VeinBranch> FindVeins(const CenterlineTree& tree, const ImageInterpolator& image,
  const LumenReference& reference, double blur);
}

#endif
