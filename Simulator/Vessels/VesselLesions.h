/**
 * @file VesselLesions.h
 * @brief Narrowings that are set into vessels, and sections of the wall that become wider or narrower while they move.
 */
#ifndef DynamicCoronary_VesselLesions_h
#define DynamicCoronary_VesselLesions_h

#include "WallMotion.h"

#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// A narrowing that a scenario makes: the diameter is less by `degree` cos^2(pi s / length), s from its middle. Of degree 1
/// it is an occlusion: tissue fills the vessel but for a stump of at most 3 mm at either end.
struct VesselLesion
{
  std::string vessel;      ///< name of a segment, "mLAD"
  double place = 0.0;      ///< of its middle, mm from the segment's beginning
  double length = 12.0;    ///< mm, 2 to 60
  double degree = 0.7;     ///< of the diameter, 0 to 0.95, or 1
  double calciumArc = 0.0; ///< degrees of the section, 0 to 360
  /// Of an occlusion, MPa that its tissue bears, 0.1 to 100: 1.21 N, which pierced caps of 12 weeks (Thind et al.,
  /// EuroIntervention), on the section of 0.014 inch; the probe of that study is not known to us.
  double strength = 12.0;
};

/// mm: radius of the channel that a wire makes in an occlusion, chosen. Coronary wires have 0.18.
constexpr double ChannelRadius = 0.25;

/// Points of the axes (numbers in one list, branch by branch) from an ostium on.
struct VesselWay
{
  std::vector<std::int64_t> points;
  std::vector<int> branch;
  std::vector<double> place; ///< mm from the ostium at rest
};

/// Number of a branch's first point in the list of all branches' points.
std::int64_t FirstAxisPoint(const WallTopology& topology, int branch);

/// The branch that a parent goes on as at its end: the one that is widest 5 mm on; -1: none.
int GoesOnAs(const WallTopology& topology, int branch);

/// From the ostium through a branch, and on to an end.
VesselWay WayThrough(const WallTopology& topology, int branch);

/**
 * Radii without stenoses, per branch and point: the topology's own, else the lesser of the greatest within
 * `neighbourhood` mm before and behind on the branch.
 */
std::vector<std::vector<double>> ReferenceRadii(
  const WallTopology& topology, double neighbourhood = 15.0);

/// A narrowing of the vessels, by 0.3 of the diameter at least somewhere and 0.1 everywhere.
struct FoundLesion
{
  std::string vessel;               ///< name of the segment with the narrowest place; may be empty
  int branch = 0;                   ///< likewise
  std::int64_t throat = 0;          ///< point of the axes
  double degree = 0.0;              ///< of the diameter
  std::vector<std::int64_t> points; ///< of the axes, from the root on
};

/// Along vessels, through their bifurcations. An occlusion has the degree 1.
std::vector<FoundLesion> FindLesions(const WallTopology& topology, double least = 0.3);

/// What tissue fills of a vessel.
struct Occlusion
{
  std::vector<std::int64_t> points; ///< of the axes, from the root on; two at least
  std::vector<double> places;       ///< mm from the first one, of these
  double strength = 0.0;            ///< MPa
};

/// Likewise.
std::vector<Occlusion> FindOcclusions(const WallTopology& topology);

/// mm, as the axes: no blood comes through as long as the lumen's radius is not greater. 0: it always does.
std::vector<std::vector<double>> ClosedRadii(const WallTopology& topology);

/// Every point of the wall hangs on the axis of its branch; near a side branch's mouth on the parent's as well.
class WallSections
{
public:
  /// @param points, axis  at one moment
  WallSections(const WallTopology& topology, const std::vector<Vector3>& points,
    const std::vector<Vector3>& axis);

  /**
   * Makes sections wider about the axis, at any moment.
   * @param ratio  of radii, per point of the axis, linear between; where it is 1 points keep their bits
   */
  void Scale(const std::vector<double>& ratio, const std::vector<Vector3>& axis,
    std::vector<Vector3>& points) const;

private:
  struct Place
  {
    std::int32_t first = -1; ///< of an interval of the axis; -1: none
    float along = 0.0F;      ///< 0 to 1
  };
  struct Hold
  {
    Place own;
    Place parent;
    float share = 1.0F; ///< of the own axis
  };
  static Place Nearest(const Vector3& point, const std::vector<Vector3>& axis, std::int64_t first,
    std::int64_t count, double& squared);

  std::vector<Hold> Holds; ///< per point of the wall
};

/// A wall with narrowings, which move with it.
class NarrowedWallMotion : public WallMotion
{
public:
  /// @throws std::invalid_argument naming the lesion: no such vessel, beyond its end, a value out of range
  NarrowedWallMotion(std::shared_ptr<WallMotion> wall, const std::vector<VesselLesion>& lesions);

  const WallTopology& Topology() const override { return this->Topology_; }
  void Positions(double phase, std::vector<Vector3>& positions) override;
  void AxisPositions(double phase, std::vector<Vector3>& positions) override
  {
    this->Wall->AxisPositions(phase, positions);
  }

private:
  void Narrow(const VesselLesion& lesion);

  std::shared_ptr<WallMotion> Wall;
  WallTopology Topology_;
  std::unique_ptr<WallSections> Sections;
  std::vector<double> Ratio; ///< per point of the axis
  std::vector<Vector3> Axis;
};
}

#endif
