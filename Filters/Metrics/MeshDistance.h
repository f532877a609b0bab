/**
 * @file MeshDistance.h
 * @brief Distances between two triangle surfaces: Hausdorff, mean, root mean square, percentile.
 *
 * Distances are from points of one surface to the nearest point of the other one, on its triangles,
 * not only its vertices. With d(x, B) the distance of a point x of A from B:
 *
 *     HD_AB = sup over A of d(x, B);  HD = max(HD_AB, HD_BA)                     Eq. 15 of the paper
 *     MSD   = mean of d(x, B) over the vertices x of A                           Eq. 16 of the paper
 *     MSD_area = (integral over A of d(x, B) + integral over B of d(x, A)) / (area A + area B)
 *     RMS   = the same mean of the squared distances, then the root
 *     HD95_AB = distance that 95 % of A's area do not exceed; HD95 = max(HD95_AB, HD95_BA)
 *
 * HD is found by branch and bound over pieces of triangles, with upper bounds from convexity: the
 * distance from a convex set is greatest at a corner of a piece. See docs/metrics.md.
 */
#ifndef DynamicCoronary_MeshDistance_h
#define DynamicCoronary_MeshDistance_h

#include "Geometry.h"
#include "ParallelFor.h"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace coronary
{
/// Triangles, with what is known of them. Triangles may be degenerate, points may coincide or belong
/// to no triangle.
struct SurfaceMesh
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;

  std::vector<std::int64_t> triangleGroups; ///< branch of each triangle; empty: not known
  std::vector<std::int64_t> pointGroups;    ///< branch of each point; empty: not known
  std::vector<std::uint8_t> caps; ///< 1 where a triangle closes an end of a vessel; empty: none
};

/// Lengths are in the unit of the coordinates, by default mm.
struct MeshDistanceSettings
{
  /// What the Hausdorff distances may be too small by, and what the integrals' estimated error may
  /// be. Positive.
  double errorBound = 1e-3;

  bool hausdorff = true;    ///< HD; without it only that of the vertices is known
  bool areaMeasures = true; ///< area-weighted mean, RMS, percentiles

  /// Eq. 16 and the distances of points. Without them and all others, HD is found faster.
  bool pointMeasures = true;
  bool signedDistances = true; ///< negative inside of the other surface, where that is closed

  /// Whether the ends of vessels are left out: caps, and on both surfaces what lies beyond an end of
  /// either one, see FindSurfaceEnds.
  bool clipEnds = false;

  /// How far beyond an end something still counts as belonging to it. What is further away is compared.
  double endLength = 3.0;

  /// What messages call A and B.
  std::array<std::string, 2> names = { "surface A", "surface B" };

  /// Branch and bound stops after so many pieces for each side; the error is then known, but greater.
  std::int64_t maximumPieces = 50000000;

  /// @throws std::invalid_argument that names the first setting out of range or not finite.
  void Validate() const;
};

/// From one surface, or one branch of it, to the other surface. NaN where it was not asked for.
struct SideDistance
{
  static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

  double hausdorff = NaN;              ///< attained; the supremum is at most hausdorffError greater
  double hausdorffError = NaN;         ///< at most MeshDistanceSettings::errorBound
  Vector3 at = Vector3::Constant(NaN); ///< where it is attained
  Vector3 nearest =
    Vector3::Constant(NaN);   ///< the point of the other surface that is nearest to it
  std::int64_t triangle = -1; ///< of this surface's input, that it is attained on

  std::int64_t vertices = 0;  ///< of the input, that belong to a compared triangle
  double vertexMean = NaN;    ///< Eq. 16
  double vertexMaximum = NaN; ///< what others call the Hausdorff distance

  double area = 0.0;
  double mean = NaN;            ///< area-weighted
  double rms = NaN;             ///< area-weighted
  double percentile95 = NaN;    ///< area-weighted
  double quadratureError = NaN; ///< estimated, of the mean
};

struct BranchDistance
{
  int side = 0; ///< 0: branch of A, to the whole of B; 1: branch of B, to the whole of A
  std::int64_t group = 0;
  SideDistance distance;
};

struct MeshDistance
{
  static constexpr double NaN = SideDistance::NaN;

  SideDistance ab; ///< from A to B
  SideDistance ba;

  double hausdorff = NaN;      ///< HD, the greater of both sides
  double hausdorffError = NaN; ///< the true value is at most this much greater
  double hausdorff95 = NaN;    ///< HD95, the greater of both sides
  double percentile95 = NaN;   ///< of both sides' areas together
  double mean = NaN;           ///< MSD_area, of both sides' areas together
  double rms = NaN;            ///< of both sides' areas together
  double quadratureError = NaN;
  // MSD of Eq. 16 is ab.vertexMean.

  /// By side, then by group; empty without groups.
  std::vector<BranchDistance> branches;

  /// One a point of the input: distance from the other surface, NaN where it was not compared. Of a
  /// closed other surface negative inside, if that was asked for.
  std::vector<double> pointDistancesA;
  std::vector<double> pointDistancesB;
  bool signedA = false; ///< whether A's distances have a sign
  bool signedB = false;

  std::vector<std::string> warnings; ///< a sentence each
};

/**
 * Compares two surfaces. A is the result, B the reference, where a measure is not symmetric (MSD).
 *
 * Integrals: every triangle, cut in equal parts as long as it has more than 1/20000 of the area, is
 * integrated by corners and centroid (weights 1/12, 1/12, 1/12, 3/4; exact to degree 2); parts are
 * quartered where needed until the error, estimated from a thousand parts that are quartered, is below
 * errorBound. Percentiles are those of the function that is linear on the three parts of a part
 * around its centroid.
 *
 * Runs on all threads; the same bits whatever their number.
 * @throws std::invalid_argument for settings out of range, a surface without triangles (with none left
 *         after clipping), an index out of range, coordinates of a used point that are not finite,
 *         or a number of groups or caps that does not fit; Cancelled
 */
MeshDistance CompareSurfaces(const SurfaceMesh& a, const SurfaceMesh& b,
  const MeshDistanceSettings& settings = {}, const ProgressCallback& progress = {});

/// Where a vessel is cut off.
struct SurfaceEnd
{
  Vector3 centre = Vector3::Zero();
  Vector3 normal = Vector3::UnitZ(); ///< away from the vessel, unit length
  double radius = 0.0;               ///< greatest distance of the rim from the centre
};

/**
 * The ends of a surface's vessels: closed rims of the triangles that are no caps, with the wall
 * on one side. What has its wall all around it (a hole in a wall) is none.
 *
 * What lies beyond an end: points x with -radius / 100 < normal . (x - centre) <= length, and no further
 * from the axis than two radii in two directions across it. The hundredth is for caps without a mark.
 */
std::vector<SurfaceEnd> FindSurfaceEnds(const SurfaceMesh& mesh);
}

#endif
