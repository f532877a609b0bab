/**
 * @file VeinRejection.h
 * @brief Branches of a tree of arteries that are veins which touch it.
 *
 * Veins cross arteries instead of leaving them: where one touches, a tube goes through. They widen towards the heart
 * while arteries taper away from it, end as wide as they are (where another way into them was shorter) while arteries end
 * thin, leave in any direction while arteries leave with the flow, run beside an artery, and mostly hold less
 * contrast medium. Where one vein was found, veins hold contrast medium, and more are to be expected. No single sign
 * decides: each adds to the odds, measured against how the tree's own branches vary, with
 * a weight fitted to phantoms (scripts/fit-odds.sh).
 */
#ifndef DynamicCoronary_VeinRejection_h
#define DynamicCoronary_VeinRejection_h

#include "LumenMeasurement.h"
#include "VesselTree.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace coronary
{
/// What the odds that a branch is a vein are made of, each in a range where its logarithmic odds are about linear.
constexpr std::size_t NumberOfVeinSigns = 18;
const std::array<const char*, NumberOfVeinSigns>& VeinSignNames();

struct VeinBranch
{
  int groupId = -1;         ///< of the branch where it begins
  double probability = 0.0; ///< of a vein, 0 to 1
  bool known = false;       ///< nothing before it was bridged: all signs could be measured
  std::array<double, NumberOfVeinSigns> signs{};
  std::vector<Vector3> path;        ///< mm, from its begin on, 40 mm straight on
  std::vector<std::int64_t> closed; ///< points of it that are the vein's for certain, if it is one
};

/**
 * @param tree       split; radii in mm
 * @param reference  what a lumen and its surroundings look like
 * @param blur       of the image, standard deviation in mm
 * @param closed     whether a place was closed before: a branch that ends there was cut; may be empty
 * @param veins      how many veins were left out of this heart's trees before: their probabilities' sum
 * @returns the branches of 8 mm and more that leave another one, a parent before its daughters
 * @throws std::invalid_argument as CheckTree
 */
std::vector<VeinBranch> JudgeBranches(const VesselTree& tree, const ImageInterpolator& image,
  const LumenReference& reference, double blur,
  const std::function<bool(const Vector3&)>& closed = {}, double veins = 0.0);

/// @param judged  of this tree
/// @returns of each point, 0 to 1: the greatest of the branches from the root to its own one, for what hangs on a vein is one
std::vector<double> VeinProbabilityOfPoints(
  const VesselTree& tree, const std::vector<VeinBranch>& judged);

/// Of a branch, from those of points: the greatest but for its first point, which is its parent's; 0 where nothing is known.
double VeinProbabilityOf(
  const std::vector<std::int64_t>& branch, const std::vector<double>& ofPoints);
}

#endif
