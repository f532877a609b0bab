/**
 * @file FlowNetwork.h
 * @brief The coronary arteries as a graph: segments between ostia, attachments of branches, and tips.
 */
#ifndef DynamicCoronary_FlowNetwork_h
#define DynamicCoronary_FlowNetwork_h

#include "WallMotion.h"

#include <vector>

namespace coronary
{
/// Where a catheter's tip is. A branch of -1: in the aorta.
struct CatheterTip
{
  int branch = -1;
  double abscissa = 0.0; ///< mm along the branch's axis at rest; beyond an end: at that end
};

/// Lengths and volumes along a branch's axis.
struct FlowBranch
{
  std::vector<double> abscissa; ///< mm from the branch's beginning, per axis point
  std::vector<double> volume;  ///< mL from the branch's beginning, per axis point (truncated cones)
  std::int64_t firstPoint = 0; ///< of the axis' points, all branches in one list
  std::vector<int> segments;   ///< from the branch's beginning on
};

/// A stretch of a branch without anything attached between its ends.
struct FlowSegment
{
  int branch = 0;
  double from = 0.0;       ///< mm along the branch's axis
  double to = 0.0;         ///< mm
  double volumeFrom = 0.0; ///< mL along the branch's axis
  double volume = 0.0;     ///< mL
  int above = 0;           ///< node at its root-side end
  int below = 0;           ///< node at its far end
  double Radius() const;   ///< mm, of the cylinder with its length and volume
};

struct FlowNode
{
  int above = -1;         ///< segment that comes from the root; -1: an ostium
  std::vector<int> below; ///< segments that go on
  int tree = 0;
};

/// Right trees are throttled less by the heart.
enum class CoronarySide : int
{
  Automatic = 0,
  Left = 1,
  Right = 2
};

/**
 * Rooted trees. A branch without a parent begins at an ostium; the others begin at the node at the place of their
 * parent's axis that is nearest to their first point. Places nearer to each other, or to the parent's ends, than
 * `SnapLength` are one node. The way from the parent's axis to the branch's first point has no resistance.
 */
class FlowNetwork
{
public:
  static constexpr double SnapLength = 0.05; ///< mm

  /**
   * @param sides  per root, in order of the roots; shorter: Automatic. By the names of the tree's branches
   *               ("RCA" is right; "LM", "LAD", "LCx", "LCA" left); without names the one of several trees that
   *               is farthest on the patient's right (LPS, -x) is right, and a single tree is left.
   * @throws std::invalid_argument: no branch; an axis with less than two points or without length; a point that is
   *         not finite; a radius that is not 1e-3 to 100 mm; a parent that is not another branch; a ring
   */
  explicit FlowNetwork(const WallTopology& topology, const std::vector<CoronarySide>& sides = {});

  const std::vector<FlowBranch>& Branches() const { return this->Branches_; }
  /// A segment comes after all that are nearer to the root.
  const std::vector<FlowSegment>& Segments() const { return this->Segments_; }
  const std::vector<FlowNode>& Nodes() const { return this->Nodes_; }
  const std::vector<int>& Roots() const { return this->Roots_; }          ///< node, per tree
  const std::vector<bool>& RightSide() const { return this->RightSide_; } ///< per tree
  const WallTopology& Topology() const { return this->Topology_; }
  /// The point of its parent's axis (in the list of all branches' points) that a branch leaves from; -1 at a root.
  std::int64_t AttachmentPoint(int branch) const { return this->Attachment[branch]; }
  bool IsTip(int node) const { return this->Nodes_[node].below.empty(); }

  /// The segment at a place, and how far into it.
  struct Place
  {
    int segment = -1;
    double abscissa = 0.0; ///< mm along the branch
    double volume = 0.0;   ///< mL from the segment's beginning
  };
  /// @throws std::invalid_argument for a branch that is not there, or an abscissa that is not finite
  Place Locate(const CatheterTip& tip) const;

  /**
   * A node within a segment: the segment ends there, and a new one, whose number is one greater, goes on. Segments behind it are
   * renumbered; nodes are not. @param place  not nearer to the segment's ends than SnapLength, or a quarter of it, else it is moved
   * @return the node, the last one  @throws as Locate
   */
  int Split(const CatheterTip& place);

  /// Of the axis, mm.
  double RadiusAt(int branch, double abscissa) const;
  /// mL from the branch's beginning.
  double VolumeAt(int branch, double abscissa) const;

private:
  void MeasureBranches();
  void Connect();
  void ChooseSides(const std::vector<CoronarySide>& sides);

  WallTopology Topology_; ///< axis, radii, parents and names
  std::vector<FlowBranch> Branches_;
  std::vector<FlowSegment> Segments_;
  std::vector<FlowNode> Nodes_;
  std::vector<int> Roots_;
  std::vector<bool> RightSide_;
  std::vector<std::int64_t> Attachment;
};
}

#endif
