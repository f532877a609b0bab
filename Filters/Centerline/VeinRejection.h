/**
 * @file VeinRejection.h
 * @brief Branches of a tree of arteries that are veins which touch it.
 *
 * Veins hold less contrast medium than the arteries beside them, widen towards the heart while arteries taper away
 * from it, cross arteries instead of leaving them, and run beside one. No single sign decides: each adds to the odds,
 * measured against how the tree's own branches vary.
 */
#ifndef DynamicCoronary_VeinRejection_h
#define DynamicCoronary_VeinRejection_h

#include "CenterlineTree.h"
#include "LumenMeasurement.h"

#include <string>
#include <vector>

namespace coronary
{
struct VeinBranch
{
  int groupId = -1;         ///< of the branch where the vein begins; what follows belongs to it
  double probability = 0.0; ///< 0 to 1
  double brightness = 0.0;  ///< step from the artery, share of the contrast, negative: darker
  double calibre = 1.0;     ///< radius over the greatest of the artery before it
  double growth = 1.0; ///< radius at its end over the larger of that at its begin and the artery's
  double beside = 0.0; ///< share of its length beside an artery
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
