/**
 * @file CenterlineTopology.h
 * @brief Ordered trees out of any set of centerlines: branches, bifurcations, orders, geometry.
 *
 * The lines may be branches that share their bifurcation points, whole paths from the root to each
 * tip that run on top of each other (VMTK's form), pieces with gaps between them, or all of it at
 * once. What comes out is a forest of branches from root to tip, each with one parent at most.
 * Lengths inside the method are measured in local vessel radii, so that the result does not depend
 * on the unit of the coordinates.
 */
#ifndef DynamicCoronary_CenterlineTopology_h
#define DynamicCoronary_CenterlineTopology_h

#include "CurveGeometry.h"
#include "ParallelFor.h"
#include "VesselTree.h"

#include <array>
#include <string>
#include <vector>

namespace coronary
{
/// Polylines over shared points.
struct Polylines
{
  std::vector<Vector3> points; ///< mm
  std::vector<double> radius;  ///< one a point, mm, positive
  std::vector<std::vector<std::int64_t>> lines;

  /// Where trees are known to start (ostia, seeds); may be empty. The tree whose end is nearest
  /// starts there.
  std::vector<Vector3> roots;
};

struct TopologySettings
{
  /// An end of a line is joined to another piece nearer than this many radii. 0 to 20.
  double gapRatio = 2.0;

  /// A line that runs alongside another within this many radii is the same vessel. 0 to 1; with 0
  /// only points that coincide are merged.
  double mergeRatio = 0.5;

  /// A twig shorter than this many radii of the vessel that it leaves is removed. 0 to 100.
  double pruneRatio = 3.0;

  /// Exponent x of r_parent^x = sum r_daughter^x whose residual is reported (Murray: 3, Eq. 3 of
  /// the paper; Huo and Kassab: 7/3). 0.5 to 10.
  double murrayExponent = 3.0;

  CurveSmoothing smoothing;

  /// @throws std::invalid_argument that names the first setting out of range or not finite.
  void Validate() const;
};

/// A point where a vessel divides.
struct Bifurcation
{
  std::int64_t point = 0;
  int parent = -1;            ///< GroupId, -1 where several branches leave a root
  std::vector<int> daughters; ///< GroupIds, widest first
  double parentRadius = 0.0;  ///< median over one to four radii from the point, mm
  std::vector<double> daughterRadius;

  double angle = 0.0;                 ///< between the two widest daughters, radians
  std::vector<double> daughterAngles; ///< between the parent's course and each daughter, radians
  double areaRatio = 0.0;             ///< sum of the daughters' areas over the parent's
  double daughterAreaRatio = 0.0;     ///< second widest over widest daughter
  double murrayResidual = 0.0;        ///< (r_p^x - sum r_d^x) / r_p^x, x the chosen exponent
  double huoKassabResidual = 0.0;     ///< the same for x = 7/3
  double finetRatio = 0.0;            ///< r_p / (r_d1 + r_d2); 0.678 by Finet
  double fittedExponent = 0.0;        ///< x that makes the residual 0; NaN when there is none
};

/// A closed way through the lines. It is cut open at the place that blood from the root would
/// reach last, by the way of least resistance.
struct CenterlineLoop
{
  std::vector<std::int64_t> points; ///< once around, in order; both sides of the cut are the ends
  double length = 0.0;              ///< mm
};

/// A split forest, ordered: depth first, the vessel's continuation before its side branches; group
/// ids are the indices of the branches. Points are as given, not smoothed.
struct CenterlineTopology : VesselTree
{
  // One value a point.
  std::vector<std::int64_t> source; ///< index of the point in the input
  std::vector<Vector3> tangent, normal, binormal;
  std::vector<double> curvature; ///< 1/mm
  std::vector<double> torsion;   ///< 1/mm
  std::vector<double> area;      ///< of the round cross-section, mm^2

  // One value a branch.
  std::vector<int> continuation;  ///< the daughter that carries the vessel on, or -1 at a tip
  std::vector<double> meanRadius; ///< mean over the length, mm
  std::vector<char> inLoop;       ///< part of a closed way before that was cut open

  std::vector<Bifurcation> bifurcations;
  std::vector<CenterlineLoop> loops;
  int trees = 0;
  int prunedTwigs = 0;
  double prunedLength = 0.0; ///< mm
  int closedGaps = 0;
  int mergedPoints = 0;        ///< of the input, that another line already had
  double fittedExponent = 0.0; ///< best over all bifurcations; NaN without one that can be fitted
};

/**
 * Builds the forest.
 *
 * Roots are the given ones; else the end from which all lines of the piece start; else the end
 * with the largest radius. Points of a line that repeat the one before are dropped.
 * Lines with fewer than two distinct points are left out.
 *
 * @throws std::invalid_argument for settings out of range, a radius or coordinate that is not
 *         finite, a point whose squared distance from the origin overflows, a radius that is not
 *         positive, an index out of range, or a line longer than a million median radii; Cancelled
 */
CenterlineTopology BuildTopology(const Polylines& lines, const TopologySettings& settings = {},
  const ProgressCallback& progress = {});

/// x with r_p^x = sum r_d^x, or NaN when a daughter is as wide as the parent or there is none.
double SolveMurrayExponent(double parent, const std::vector<double>& daughters);
}

#endif
