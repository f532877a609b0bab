/**
 * @file Polylines.h
 * @brief Lines over one list of points that are no tree, or not yet.
 *
 * What a file or another program gives before its branches are found (BuildTopology), what is compared whatever it
 * is (CompareCenterlineTrees, CompareBranches), and what moves: the branches of a tree or the bones of a skeleton
 * (PoseSequence). Nothing is said of the order or direction of the lines; a forest with parents is a VesselTree.
 */
#ifndef DynamicCoronary_Polylines_h
#define DynamicCoronary_Polylines_h

#include "Geometry.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// Polylines that may share points. What is optional may be empty.
struct Polylines
{
  std::vector<Vector3> points;                  ///< mm
  std::vector<double> radius;                   ///< optional, one a point: lumen radius, mm
  std::vector<std::vector<std::int64_t>> lines; ///< indices of points
  std::vector<std::int64_t> groups;             ///< optional, one a line; else its number
};

/// @throws std::invalid_argument: a line of less than two points, an index out of range, a radius that is
/// negative, a coordinate that is not finite, another number of radii than of points
void CheckPolylines(const Polylines& lines);
}

#endif
