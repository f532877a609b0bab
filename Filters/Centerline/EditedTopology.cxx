#include "EditedTopology.h"

#include "TreeLinks.h"

#include <algorithm>
#include <map>
#include <set>

namespace coronary
{
namespace
{
/// Of each point of the topology the segment that it had, or gets as a nameless new one.
std::vector<int> SegmentsOf(const EditedTree& edited, const std::vector<TreeEdit>& edits,
  const CenterlineTopology& tree, const CenterlineTopology& renamed)
{
  std::set<int> taken;
  for (const VesselTree::Branch& branch : edited.tree.branches)
  {
    taken.insert(branch.segmentId);
  }
  std::vector<int> segments(tree.points.size());
  for (std::size_t p = 0; p < segments.size(); ++p)
  {
    const auto source = static_cast<std::size_t>(tree.source[p]);
    segments[p] = edited.tree.segmentId[source];
    const int number = edited.edit[source];
    const bool nameless = segments[p] == 0 && edited.source[source] < 0 && number > 0 &&
      edits[static_cast<std::size_t>(number) - 1].kind == EditKind::AddBranch;
    if (nameless && taken.count(renamed.segmentId[p]) == 0)
    {
      segments[p] = renamed.segmentId[p];
    }
  }
  return segments;
}

/// The segment of most of each branch's length.
void NameBranches(CenterlineTopology& tree)
{
  for (VesselTree::Branch& branch : tree.branches)
  {
    std::map<int, double> lengths;
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      lengths[tree.segmentId[branch.points[i]]] +=
        (tree.points[branch.points[i]] - tree.points[branch.points[i - 1]]).norm();
    }
    branch.segmentId = std::max_element(lengths.begin(), lengths.end(),
      [](const auto& a, const auto& b) {
        return a.second < b.second;
      })->first;
  }
}
}

EditedTopology OrderEdited(const EditedTree& edited, const std::vector<TreeEdit>& edits,
  const TopologySettings& given, const ProgressCallback& progress)
{
  TopologySettings settings = given;
  settings.gapRatio = settings.mergeRatio = settings.pruneRatio = 0.0;
  std::vector<Vector3> roots;
  bool named = false;
  for (const VesselTree::Branch& branch : edited.tree.branches)
  {
    if (branch.parentGroupId < 0)
    {
      roots.push_back(edited.tree.points[branch.points.front()]);
    }
    named = named || branch.segmentId != 0;
  }
  EditedTopology result;
  result.named = named;
  result.tree = BuildTopology(LinesOf(edited.tree), settings, roots, progress);
  CenterlineTopology& tree = result.tree;
  CenterlineTopology renamed = tree;
  if (named)
  {
    result.labels = LabelSegments(renamed);
  }
  tree.segmentId = SegmentsOf(edited, edits, tree, renamed);
  NameBranches(tree);
  const std::vector<std::int64_t> owners = BranchesOfPoints(edited.tree);
  for (VesselTree::Branch& branch : tree.branches)
  {
    const std::int64_t owner = owners[tree.source[branch.points.back()]];
    branch.treeId = edited.tree.branches[owner].treeId;
  }
  SplitAtSegmentBorders(tree);
  return result;
}
}
