/**
 * @file TreeCheck.h
 * @brief Whether a pair of coronary trees is whole: what is missing, where, and how sure that is.
 *
 * A lesion, a dim vessel or a wrong ostium leaves trees that look well but end too early. They are
 * held against what hearts have in common: each wall of the left ventricle has an artery, the left
 * anterior descending artery comes to the apex, one artery goes down behind, vessels end thin.
 * Nothing is changed or left out. Ranges: docs/topology.md#checks.
 */
#ifndef DynamicCoronary_TreeCheck_h
#define DynamicCoronary_TreeCheck_h

#include "CenterlineTopology.h"
#include "SegmentLabeling.h"

#include <optional>
#include <string>
#include <vector>

namespace coronary
{
struct TreeWarning
{
  std::string what;        ///< a sentence without its full stop, with the vessel and the place
  std::string vessel;      ///< SCCT name, or "LCA", "RCA" for a whole tree
  Vector3 place;           ///< in the tree's coordinates
  double confidence = 0.0; ///< 0 to 1, that something is wrong there
};

/**
 * What is not as it is in whole, healthy trees; empty when all is well, or there are no branches.
 * @param tree    named by LabelSegments(), in any unit of length; the sentences are in mm
 * @param labels  its result for that tree
 * @param vein    of each point, 0 to 1: that it hangs on a vein; empty: not known
 */
std::vector<TreeWarning> CheckCoronaryTrees(const CenterlineTopology& tree,
  const LabelingResult& labels, const std::vector<double>& vein = {});

/**
 * To be said of what was left out as a vein unless that is certain; none when it is.
 * @param place   mm, where it touches a tree
 * @param length  mm
 * @param vein    probability of one, 0 to 1
 */
std::optional<TreeWarning> DoubtfulVeinWarning(const Vector3& place, double length, double vein);
}

#endif
