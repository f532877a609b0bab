/**
 * @file SegmentNaming.h
 * @brief SCCT segments of points and branches whose vessels are known; for SegmentLabeling.
 */
#ifndef DynamicCoronary_SegmentNaming_h
#define DynamicCoronary_SegmentNaming_h

#include "LabelPieces.h"

namespace coronary
{
/**
 * Sets segmentId of points and branches, and treeId.
 * @param pieces      of `tree`
 * @param pose        from the pieces' coordinates to the atlas'
 * @param assignment  with a vessel for each piece and a side for each tree
 */
void NameSegments(CenterlineTopology& tree, const LabelPieces& pieces, const AtlasPose& pose,
  const LabelAssignment& assignment);
}

#endif
