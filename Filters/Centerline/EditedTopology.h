/**
 * @file EditedTopology.h
 * @brief A tree that was edited by hand, ordered, measured and named again.
 */
#ifndef DynamicCoronary_EditedTopology_h
#define DynamicCoronary_EditedTopology_h

#include "SegmentLabeling.h"
#include "TreeEdits.h"

#include <vector>

namespace coronary
{
struct EditedTopology
{
  CenterlineTopology tree; ///< `source` are points of the edited tree
  bool named = false;      ///< whether it had names before, and so has a heart now
  LabelingResult labels;   ///< of the whole edited tree: dominance and the heart's place
};

/**
 * Nothing is merged, pruned or closed: the lines are what a person wants. What is named stays named. A branch that was
 * added without a name gets the one that it would have if the tree were named anew, if no other vessel has that.
 * @param edits  of which `edited` was made
 * @throws std::invalid_argument as BuildTopology; Cancelled
 */
EditedTopology OrderEdited(const EditedTree& edited, const std::vector<TreeEdit>& edits,
  const TopologySettings& settings = {}, const ProgressCallback& progress = {});
}

#endif
