/**
 * @file SweepSurface.h
 * @brief A closed, CFD-quality triangle surface of a vessel tree from axes and radii.
 *
 * Cross-sections in the normal plane of a moving frame are swept along smooth axes; where vessels
 * meet, the tubes are joined by fillets. The triangles follow Eq. 4 of Wang et al. (arXiv
 * 2503.02218): h = hmin + (hmax - hmin) exp(-alpha kappa), kappa the greatest principal curvature
 * of the wall, capped by a share of the local radius. docs/surface.md has the method.
 */
#ifndef DynamicCoronary_SweepSurface_h
#define DynamicCoronary_SweepSurface_h

#include "Geometry.h"
#include "ParallelFor.h"
#include "VesselAxis.h"
#include "VesselTree.h"

#include <string>
#include <vector>

namespace coronary
{
/// What may be known of the vessels beside axes and radii; all of it may be empty.
struct SweepSections
{
  /// Cross-sections other than circles: for each point `contourSamples` radii in mm, in equal steps
  /// of the angle from `contourNormal` towards tangent x contourNormal. Empty: circles.
  std::vector<double> contours;
  int contourSamples = 0;
  std::vector<Vector3> contourNormals; ///< one a point, any length, not along the axis
  /// Normals of the planes that cut the free ends, one a point, any length and sense, at most 60
  /// degrees off the axis; zero, or none at all: across the axis.
  std::vector<Vector3> endNormals;
};

struct SweepSettings
{
  double minimumEdgeLength = 0.15;  ///< hmin of Eq. 4, mm
  double maximumEdgeLength = 0.7;   ///< hmax of Eq. 4, mm
  double curvatureWeight = 1.0;     ///< alpha of Eq. 4, mm
  double edgeLengthPerRadius = 0.5; ///< greatest edge in radii, 0.1 to 0.7
  double sharpestBend =
    0.12; ///< least radius of the wall's bends that edges follow, in radii, 0.05 to 1
  double gradation = 0.25;   ///< greatest change of the edge length per length, 0.05 to 1
  double blending = 0.5;     ///< radius of the fillets in radii of the smaller vessel, 0.1 to 1
  double edgeRetreat = 0.15; ///< edges between two vessels in an acute angle move at least so far
                             ///< where the fillets have faded, in radii of the smaller vessel, 0.1
                             ///< to 2
  double smoothing = 0.5;    ///< waves of the axes shorter than this many radii are noise, 0 to 4
  double clearance = 0.05;   ///< least gap between vessels that touch but do not join, in radii of
                             ///< the smaller one, 0 to 0.5
  bool capped = true;        ///< flat caps; false leaves the ends open
  SweepFrame frame = SweepFrame::Blended;
  int patchSamples = 24;     ///< points around a structured patch, 6 to 360
  double patchSpacing = 0.5; ///< distance of the patches in radii, 0.1 to 4

  /// @throws std::invalid_argument that names the first setting out of range or not finite.
  void Validate() const;
};

/// A free end of the tree.
struct SweepCap
{
  int entityId = 0; ///< of its triangles, from 2: roots first, then tips, in the order of the input
  int groupId = 0;
  bool inlet = false;
  std::int64_t point = 0; ///< of the input
  Vector3 centre = Vector3::Zero();
  Vector3 normal = Vector3::UnitZ(); ///< outwards
  double radius = 0.0;
};

/// Something that was changed so that the vessels could be meshed.
struct SweepRepair
{
  int groupId = 0;
  std::string vessel; ///< "R-PDA (group 4)", or "group 4" where it has no name
  std::string what;
  Vector3 place = Vector3::Zero(); ///< mm
};

/// A part of the tree that is not in the surface.
struct SweepLeftOut
{
  int groupId = 0;
  std::string vessel;
  std::string reason;
  Vector3 place = Vector3::Zero(); ///< mm; it is missing from there on
  double length = 0.0;             ///< mm
};

/// One branch as a structured surface: patches (centre and outer contour) joined by B-splines.
struct SweepPatches
{
  int groupId = 0;
  int samples = 0;                          ///< around
  std::vector<VesselAxis::Station> centres; ///< with frame, radius and twist
  std::vector<double> abscissa;             ///< of the centres, mm from the root
  std::vector<Vector3> contours;            ///< samples x centres, around first
};

struct SweptSurface
{
  std::vector<Vector3> points;
  std::vector<Vector3> normals;   ///< of the wall, unit, outwards; of the cap inside a cap
  std::vector<double> edgeLength; ///< h of Eq. 4 with cap and gradation, mm, per point
  std::vector<double> curvature;  ///< kappa, 1/mm, per point
  std::vector<double> radius;     ///< of the vessel, mm, per point
  std::vector<double> abscissa;   ///< mm from the root along the axes, per point
  std::vector<int> groupId;       ///< per point
  std::vector<Triangle> triangles;
  std::vector<int> entityId; ///< per triangle: 1 wall, 2.. caps
  std::vector<SweepCap> caps;
  std::vector<SweepPatches> patches;
  int trees = 0;                       ///< connected components
  std::vector<std::string> remarks;    ///< what was changed or left out, where, and what helps
  std::vector<SweepRepair> repairs;    ///< the same, in parts
  std::vector<SweepLeftOut> leftOut;   ///< and what is missing
  std::vector<unsigned char> repaired; ///< per point: 1 where triangles were replaced; may be empty
  std::vector<std::int64_t> leftOutPoints; ///< of the tree: on no branch that was swept
};

/**
 * A surface that comes out has passed the check of the tetrahedral mesher (CheckSurface,
 * CheckSelfIntersections; open ends apart). What can not be meshed is mended where it is: ends that
 * fold over their caps are laid straight or limited in slope; axes smoothed and fillets made
 * smaller; triangles replaced. A branch for which nothing helps is left out from there on, and the
 * rest is made.
 *
 * @param tree  points, radii (positive), and of the branches the points in the direction of flow, group ids and names
 *              (for messages) are read. It need not pass CheckTree: branches are joined wherever they share a point,
 *              parents are not asked for
 * @throws std::invalid_argument  naming the setting, or the branch and point that is wrong; when a
 *                                radius is below 1e-6 mm or the wall needs over 2e7 triangles
 *         std::runtime_error     when nothing of the tree can be meshed, naming the first reason
 *         Cancelled
 */
SweptSurface SweepVesselTree(const VesselTree& tree, const SweepSettings& settings,
  const SweepSections& sections = {}, const ProgressCallback& progress = {});
}

#endif
