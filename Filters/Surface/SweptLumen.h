/**
 * @file SweptLumen.h
 * @brief The wall of a vessel tree as an implicit surface, piece by piece.
 */
#ifndef DynamicCoronary_SweptLumen_h
#define DynamicCoronary_SweptLumen_h

#include "SweepSurface.h"
#include "VesselAxis.h"

#include <memory>

namespace coronary
{
/// A place that could not be meshed: its axes are smoothed more and its vessels joined more narrowly
/// than the settings say.
struct SweepRelief
{
  Vector3 centre;
  double reach = 0.0;     ///< mm
  double smoothing = 0.0; ///< of the axes, in radii
  double blending = 0.0;  ///< radius of the fillets in radii of the smaller vessel
};

/// A branch that is not swept from a place on that could not be meshed.
struct SweepOmission
{
  std::int64_t end = -1; ///< its free end, a point of the input
  Vector3 centre;
  double reach = 0.0; ///< mm
};

/**
 * A forest of vessels, cut into parts that are each simple to describe: spans (one tube between two
 * junctions, or a junction and a tip) and junctions (the tubes that meet there, joined by
 * fillets). A place on the wall belongs to one part, and its implicit function knows the tubes of
 * that part only: what passes by, however close, cannot merge with it. Where two parts touch
 * nevertheless, each gives way by half, so that a gap stays.
 */
class SweptLumen
{
public:
  /// A part of the wall, and where on it to start looking.
  struct Site
  {
    std::int32_t part = 0;  ///< span p, or junction -1 - p
    std::int32_t piece = 0; ///< of the span's axis, last seen
  };

  struct Sample
  {
    double distance = 0.0; ///< mm, negative inside
    Vector3 gradient = Vector3::UnitX();
    double radius = 0.0;    ///< of the vessel there, mm
    double curvature = 0.0; ///< greatest principal curvature of the wall, 1/mm
    int vessel = 0;
    double s = 0.0;    ///< arc length on that vessel's axis
    double fold = 0.0; ///< distance beyond the cut towards the other part, mm; see Evaluate
  };

  /// A smooth course through nodes.
  struct Vessel
  {
    std::unique_ptr<VesselAxis> axis;
    std::vector<int> spans; ///< from start to end
    double abscissa = 0.0;  ///< at the axis's start, mm from the tree's root
    int tree = 0;
    std::vector<double> groupEnd; ///< arc length at which each group ends
    std::vector<int> group;
  };

  struct Span
  {
    int vessel = 0;
    double from = 0.0; ///< arc lengths of its nodes
    double to = 0.0;
    int startJunction = -1; ///< -1: a tip
    int endJunction = -1;
    double cutFrom = 0.0; ///< where the junction's part ends
    double cutTo = 0.0;
    int startTip = -1; ///< index in Tips
    int endTip = -1;
    bool inner = false;                                          ///< wholly inside a junction
    std::vector<std::pair<std::int32_t, std::int32_t>> touching; ///< piece, index in Contacts
  };

  struct Arm
  {
    int span;
    bool atStart; ///< the junction is at the span's start
    double cut;   ///< arc length
  };

  struct Range
  {
    int vessel;
    int firstPiece;
    int lastPiece;
    double low; ///< arc length
    double high;
  };

  struct Fillet
  {
    int first; ///< index in ranges
    int second;
    double radius;  ///< at the node, mm; 0 between vessels that share no node
    double calibre; ///< radius of the side vessel, mm
    Vector3 centre; ///< the node
    double reach;   ///< no fillet farther from it, mm
    bool rounded;   ///< circular minimum; else a ball that touches both walls

    /// @param gradient  set to that of the radius where it changes
    double RadiusAt(const Vector3& position, Vector3* gradient = nullptr) const;
  };

  struct Junction
  {
    std::vector<Arm> arms;
    std::vector<Range> ranges;
    std::vector<Fillet> fillets;
    Vector3 centre = Vector3::Zero();
    double minimumRadius = 0.0;
    double share = 1.0;         ///< of the normal margin at the cuts
    double maximumFillet = 0.0; ///< in radii
    std::vector<int> nodes;     ///< spans inside
    std::vector<int> members;   ///< the nodes' numbers
  };

  /// A free end with its cap.
  struct Tip
  {
    int span;
    Vector3 centre;
    Vector3 normal; ///< outwards, unit
    double radius;
    bool inlet;
    int group;
    std::int64_t point; ///< of the input
    int tree;
  };

  /// @throws std::invalid_argument as SweepVesselTree; SweepCollision (SweepRescue.h)
  SweptLumen(const VesselTree& tree, const SweepSections& sections, const SweepSettings& settings,
    const std::vector<SweepRelief>& reliefs = {}, const std::vector<SweepOmission>& leftOut = {});

  const std::vector<Vessel>& Vessels() const { return this->VesselList; }
  const std::vector<Span>& Spans() const { return this->SpanList; }
  const std::vector<Junction>& Junctions() const { return this->JunctionList; }
  const std::vector<Tip>& Tips() const { return this->TipList; }
  const std::vector<std::string>& Remarks() const { return this->RemarkList; }
  const std::vector<SweepRepair>& Repairs() const { return this->RepairList; }
  const std::vector<SweepLeftOut>& LeftOut() const { return this->LeftOutList; }
  int Trees() const { return this->TreeCount; }
  /// Points of the input through which a vessel was swept, ascending.
  const std::vector<std::int64_t>& SweptPoints() const { return this->SweptPointList; }

  /// The wall seen from a position; the site moves on to the neighbouring part where it must.
  void Evaluate(const Vector3& position, Site& site, Sample& sample) const;

  /// The same with one junction's tubes whatever the position.
  void EvaluateJunctionAt(const Vector3& position, int junction, Sample& sample) const;

  /// Puts a point on the wall. @return the distance left, mm
  double Project(Vector3& position, Site& site, Sample& sample) const;

  /// Puts a point on a tip's plane and, with `rim`, on the wall as well.
  double ProjectToTip(Vector3& position, Site& site, Sample& sample, int tip, bool rim) const;

  int GroupAt(int vessel, double s) const;

  /// Least depth of a fillet in an acute angle between two vessels, in radii of the smaller one.
  /// Not while other threads evaluate.
  void SetEdgeRetreat(double radii) { this->EdgeRetreat = radii; }

private:
  struct Build;

  void EvaluateJunction(const Vector3& position, const Junction& junction, Sample& sample) const;
  void GiveWay(const Vector3& position, int part, Sample& sample) const;

  std::vector<Vessel> VesselList;
  std::vector<Span> SpanList;
  std::vector<Junction> JunctionList;
  std::vector<Tip> TipList;
  std::vector<std::string> RemarkList;
  std::vector<SweepRepair> RepairList;
  std::vector<SweepLeftOut> LeftOutList;
  std::vector<std::int64_t> SweptPointList;
  /// For each part (spans first, then junctions): tubes of other parts that come close.
  std::vector<std::vector<Range>> Neighbours;
  double Clearance = 0.0;
  double EdgeRetreat = 2.0;
  int TreeCount = 0;
};
}

#endif
