/**
 * @file PhantomAnatomy.h
 * @brief The phantom's vessels at rest: courses, calibres, branching, lesions.
 */
#ifndef DynamicCoronary_PhantomAnatomy_h
#define DynamicCoronary_PhantomAnatomy_h

#include "PhantomParts.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
/// A calcification on a vessel's wall.
struct Plaque
{
  Vector3 centre;     ///< mm, at rest
  double radius;      ///< mm
  double value;       ///< HU
  int vessel;         ///< that it lies on
  std::int64_t point; ///< of the tree, nearest along the vessel
};

/// A place where a side vessel leaves its parent.
struct Junction
{
  int parentVessel;
  int childVessel;
  std::int64_t point; ///< index of the shared axis point
};

/// A free end of a vessel: an ostium or a tip.
struct VesselEnd
{
  int vessel;
  std::int64_t point; ///< the end
  std::int64_t
    neighbour; ///< the axis point beside it; the outward normal at rest is point - neighbour
  int entityId;
};

/// One step of the axes, between two consecutive points of a vessel.
struct AxisStep
{
  std::int64_t first;
  std::int64_t second;
  int vessel;
  int branch;
  bool inMuscle; ///< no fat around it
};

/// The aorta where the coronary arteries leave it: a capsule along the axis, narrower above the sinuses.
struct AorticRoot
{
  static constexpr double Valve = 14.0;   ///< mm from the centre down to the valve
  static constexpr double Below = 7.0;    ///< mm from the centre to the capsule's lower focus
  static constexpr double Sinuses = 8.0;  ///< mm from the centre to where it begins to taper
  static constexpr double Tubular = 38.0; ///< the same to where it is done
  static constexpr double Taper = 0.85;   ///< of the radius, from there on
  static constexpr double Above =
    160.0;        ///< mm from the centre to the upper focus: beyond any image
  Vector3 centre; ///< mm
  Vector3 axis;   ///< unit vector out of the heart
  double radius;  ///< mm, of the sinuses

  /// The wall's distance from the axis, mm, `height` mm along the axis from the centre, from -Valve to Above.
  double RadiusAt(double height) const
  {
    const double below = std::min(0.0, height + Below);
    const double part = std::clamp((height - Sinuses) / (Tubular - Sinuses), 0.0, 1.0);
    return std::sqrt(this->radius * this->radius - below * below) * (1.0 - part * (1.0 - Taper));
  }
};

/// A collateral vessel where it is.
struct PlacedCollateral
{
  PhantomCollateral collateral;
  std::int64_t from = -1; ///< of the tree, where it leaves and where it ends
  std::int64_t to = -1;
  std::size_t part = 0; ///< of the anatomy, with its course
  double value = 0.0;   ///< HU
  double clearance =
    0.0; ///< mm to the wall of another artery, away from its ends; below 0: runs into it
};

/// Number of the tree that a graft is, beside the left and the right one and the veins.
constexpr int GraftTree = 3;

/// Arterial trees at rest. "Vessel" means a smooth tube with a name (the LAD from the left main to
/// the apex); "branch" means its piece between two bifurcations, as in the output tree.
struct PhantomAnatomy
{
  PhantomAnatomy(const PhantomSettings& settings);

  HeartFrame frame;
  PhantomTree tree; ///< at rest; displacement and velocity zero
  std::vector<int> pointVessel;
  std::vector<double> pointArc;       ///< per point: mm from its vessel's origin
  std::vector<double> healthyRadius;  ///< per point: without lesions, mm
  std::vector<char> occluded;         ///< per point
  std::vector<char> rigid;            ///< per point: a stent holds it
  std::vector<double> squeeze;        ///< per point: share of the radius that systole takes
  std::vector<double> contrastChange; ///< per point: HU against the usual course of contrast
  std::vector<Vector3> wallOffset;    ///< per point: from the axis to the outer wall's middle, mm
  std::vector<double> wallRadius;     ///< per point: mm; the lumen's where there is no own wall
  std::vector<char> intramural;       ///< per vessel: runs in the myocardium, without fat
  std::vector<AxisStep> steps;
  std::vector<Junction> junctions;
  std::vector<VesselEnd> ends;
  std::vector<Plaque> plaques;
  std::vector<PlacedLesion> lesions; ///< counted ones, those of the disease, counted spots
  std::vector<PlacedCollateral> collaterals;
  std::vector<PhantomPart> parts; ///< in the order of their layers
  std::vector<std::string> vesselNames;

  PhantomTree vein;

  Vector3 leftOstium;
  Vector3 rightOstium;
  AorticRoot root;
  Vector3 pulmonaryBase; ///< a point on the pulmonary trunk's axis, mm
  Vector3 pulmonaryAxis;
};
}

#endif
