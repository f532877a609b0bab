/**
 * @file SweptLumenBuild.h
 * @brief The construction of a SweptLumen, step by step.
 */
#ifndef DynamicCoronary_SweptLumenBuild_h
#define DynamicCoronary_SweptLumenBuild_h

#include "SweepRescue.h"
#include "SweptEnds.h"
#include "SweptLumen.h"

#include <array>
#include <map>
#include <set>
#include <string>
#include <tuple>

namespace coronary
{
/// Radius of the fillet that is left where others have faded, in radii of the smaller vessel.
constexpr double MinimumFillet = 0.12;

struct SweptLumen::Build
{
  using Station = VesselAxis::Station;

  /// A piece of a branch between two places where branches join or end.
  struct Link
  {
    std::vector<std::int64_t> points;
    int group;
    bool alive = true;
  };

  struct Incidence
  {
    int link;
    bool atStart;
  };

  const VesselTree& input;
  const SweepSections& sections;
  const SweepSettings& settings;
  const std::vector<SweepRelief>& reliefs;
  SweptLumen& self;
  std::vector<Vector3> points;
  std::vector<double> radius;
  std::vector<Link> links;
  std::map<std::int64_t, std::vector<Incidence>> incidences;
  std::map<std::int64_t, int> treeOfNode;
  std::vector<std::int64_t> extended;                  ///< end points that were moved outwards
  std::set<std::tuple<int, bool, std::string>> mended; ///< group, at its start, what was done
  /// Where vessels meet: numbers and arc lengths of the vessels, one for each first junction.
  struct Node
  {
    Vector3 point;
    std::vector<std::pair<int, double>> vessels;
  };
  std::vector<Node> nodes;

  Build(const VesselTree& tree, const SweepSections& shape, const SweepSettings& s,
    const std::vector<SweepRelief>& places, SweptLumen& lumen)
    : input(tree)
    , sections(shape)
    , settings(s)
    , reliefs(places)
    , self(lumen)
    , points(tree.points)
    , radius(tree.radius)
  {
  }

  // ---- from the branches of the input to links between nodes: SweptLinks.cxx ----
  void Check() const;
  /// Branches cut where others join them.
  void FindLinks();
  /// A branch's end is left out from the place on; all of it when little would stay.
  void LeaveOut(const SweepOmission& omission);
  /// A free start that turns back inside its own tube, as a fastest path from a point at the wall
  /// does, is left out up to the turn.
  void TrimHairpin(
    std::vector<std::int64_t>& list, const std::map<std::int64_t, int>& degree, int group);
  void Connect();
  double LinkLength(const Link& link, std::size_t from = 0) const;
  /// A link that closes a loop ends before the place where it would; or is left out.
  void OpenLoop(Link& link);
  void Repaired(int group, const std::string& what, const Vector3& place);

  // ---- smooth courses through nodes: SweptVessels.cxx ----
  double SmoothingAt(const Vector3& x) const;
  double BlendingAt(const Vector3& x) const;
  /// Direction and radius of a link as seen from one of its ends, `reach` away from it.
  void Look(const Incidence& at, double reach, Vector3& direction, double& r) const;
  /// Which two links at a node are one vessel; -1, -1 for none.
  std::pair<int, int> PassThrough(std::int64_t node, const std::vector<Incidence>& arms) const;
  void MakeVessels();
  /// The axis of a course, whose free ends are mended where no tube can follow them.
  std::unique_ptr<VesselAxis> MakeAxis(
    SweptAxis course, bool startOpen, bool endOpen, int firstGroup, int lastGroup);
  void MakeVessel(Incidence arm, int tree, const std::vector<std::array<int, 2>>& partner,
    std::vector<char>& used, std::map<std::int64_t, double>& abscissa,
    std::map<std::int64_t, int>& junctionOfNode, std::map<std::int64_t, Vector3>& normalOfNode,
    std::vector<std::int64_t>& front);
  void AddContours(VesselAxis& axis, const std::vector<std::int64_t>& course) const;

  // ---- junctions, and neighbours that do not join: SweptJunctions.cxx ----
  Range MakeRange(int vessel, double low, double high) const;
  double RangeDistance(const Range& range, const Vector3& x) const;
  /// The fillet between two vessels of a junction; without radius when they share no node.
  Fillet FindFillet(const Junction& junction, int first, int second) const;
  /// A vessel's calibre beside a node.
  double CalibreAt(int vessel, double s) const;
  /// All tubes of a junction, each as far as it might matter for finding where the others leave.
  std::vector<Range> WideRanges(const Junction& junction, double reach) const;
  /// Is a ring of a span clear of all other tubes by `share` of the normal margin?
  bool IsClear(const Span& span, double s, const Junction& junction,
    const std::vector<Range>& others, double share) const;
  /**
   * @param away  distance from the node at which to begin
   * @return distance of the cut from the node, or a negative number when there is none
   */
  double FindCut(const Span& span, bool atStart, const Junction& junction,
    const std::vector<Range>& others, double share, double away) const;
  /// The same with smaller margins where the normal ones are not to be had.
  double FindCut(const Arm& arm, const Junction& junction, const std::vector<Range>& others,
    double away, double& taken) const;
  /// Where each tube leaves its junctions; junctions too close to part become one.
  /// @return false when the input was changed and all must be built anew
  bool CutJunctions();
  void Merge(int spanIndex);
  /// A branch that ends before it has left its parent: out when it cannot be seen, else longer.
  void MendStub(const Arm& arm, const std::vector<Range>& others);
  /// The wanted normal of an end's plane, turned outwards.
  Vector3 EndNormal(std::int64_t point, const Vector3& outward) const;
  /// An oblique end must not reach into a junction.
  void LimitEnds();
  void FinishJunctions();
  /// Calibre of a vessel where it comes out of another.
  double SideCalibre(const Range& range, const Range& other) const;
  /// Stretches that bend too much for rings become junctions of two arms.
  void SplitFolds();
  int PartOf(int vessel, double s) const;
  void FindNeighbours();
};
}

#endif
