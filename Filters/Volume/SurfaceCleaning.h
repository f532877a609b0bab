/**
 * @file SurfaceCleaning.h
 * @brief Makes closed, manifold surfaces without self-intersections of what others deliver.
 */
#ifndef DynamicCoronary_SurfaceCleaning_h
#define DynamicCoronary_SurfaceCleaning_h

#include "Geometry.h"
#include "ParallelFor.h"

#include <string>
#include <vector>

namespace coronary
{
struct SurfaceCleaningSettings
{
  double mergeTolerance =
    1e-6; ///< points closer than this are one, parts of the diagonal, 0 to 0.01
  double minimumComponentShare =
    0.01;                    ///< a component with less area than this part of the largest one's
                             ///< is left out, 0 to 1
  double joinDistance = 1.0; ///< open ends that face each other at less than this, in their radii,
                             ///< are joined; 0: never; at most 10
  bool fillHoles = true;     ///< else holes in the wall stay open
  bool capEnds = true;       ///< else open vessel ends stay open
  bool resolveIntersections = true;
  double minimumAngle =
    0.1745; ///< triangles with less are worked on, radians (10 degrees), 0 to 0.523

  /// @throws std::invalid_argument naming the setting.
  void Validate() const;
};

/// What was found, and what was done about it.
struct SurfaceCleaningCounts
{
  std::int64_t mergedPoints = 0;
  std::int64_t degenerateTriangles = 0; ///< with two equal corners, or no area
  std::int64_t duplicateTriangles = 0;  ///< on the same three points as another one
  std::int64_t nonManifoldEdges = 0;    ///< of more than two triangles, cut open
  std::int64_t nonManifoldPoints = 0;   ///< where fans touch, separated
  std::int64_t turnedTriangles = 0;     ///< looked inwards
  std::int64_t smallComponents = 0;     ///< left out
  std::int64_t innerComponents = 0;     ///< inside of others, left out
  std::int64_t selfIntersections = 0;   ///< pairs of triangles that cut each other
  std::int64_t joinedEnds = 0;          ///< pairs of rims
  std::int64_t filledHoles = 0;
  std::int64_t caps = 0;
  std::int64_t badTriangles = 0; ///< below the minimum angle, before
  std::int64_t edgeSwaps = 0;
  std::int64_t edgeCollapses = 0;
  std::int64_t pointMoves = 0;
  // What is left.
  std::int64_t openEdges = 0;
  std::int64_t remainingIntersections = 0;
  std::int64_t remainingBadTriangles = 0;
};

struct CleanedSurface
{
  std::vector<Vector3> points;            ///< mm
  std::vector<std::int64_t> sourcePoint;  ///< per point: of the input, or -1 for a new one
  std::vector<std::int64_t> nearestPoint; ///< per point: the input's point that it is or is near to
  std::vector<Triangle> triangles;        ///< look outwards
  std::vector<std::int64_t> sourceCell;   ///< per triangle: of the input, or -1 for a new one
  std::vector<std::int64_t>
    nearestCell;        ///< per triangle: the input's triangle that it is or is near to
  std::vector<int> cap; ///< per triangle: 0 on the wall, else the number of its cap, from 1; the
                        ///< largest cap is the first
  std::vector<int> component; ///< per triangle: from 0, the one with the largest area first
  std::int64_t components = 0;
  double maximumDisplacement = 0.0; ///< of an input point that is still there, mm
  SurfaceCleaningCounts counts;
  std::vector<std::string> repairs;  ///< one sentence for each kind of repair, with the first place
  std::vector<std::string> warnings; ///< what could not be put right
};

/**
 * Merges points, leaves out degenerate and doubled triangles, cuts the surface open where it is not
 * a manifold, orients it outwards, leaves out fragments and what lies inside, joins open ends that face
 * each other, closes holes, caps vessels' ends, takes out triangles that cut others (with what is
 * then inside) and closes what that opens, and betters the shapes of thin triangles.
 *
 * An open end is a rim whose triangles run across its plane; it is shifted into the plane where that
 * takes less than a quarter of its radius, and gets a flat cap. Any other rim is a hole of the wall.
 *
 * The order of the input's triangles and points is kept; new ones follow.
 *
 * @throws std::invalid_argument for a setting, a point that does not exist or is not finite;
 *         Cancelled
 */
CleanedSurface CleanSurface(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, const SurfaceCleaningSettings& settings = {},
  const ProgressCallback& progress = {});
}

#endif
