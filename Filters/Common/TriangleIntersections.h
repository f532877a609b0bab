/**
 * @file TriangleIntersections.h
 * @brief Pairs of triangles of one mesh that cut each other.
 */
#ifndef DynamicCoronary_TriangleIntersections_h
#define DynamicCoronary_TriangleIntersections_h

#include "Geometry.h"

namespace coronary
{
/**
 * Triangles that share a corner or an edge count when they have more than that in common.
 *
 * Exact for finite coordinates whose products of three neither overflow nor underflow. In one plane,
 * edges that only lie on each other do not count.
 *
 * @param limit  pairs after which a place of about two triangles' size is left: a heap of many triangles there takes the
 *               square of their number; 0: find all
 * @return pairs of triangle numbers, each with the lower number first, in ascending order
 */
std::vector<std::pair<std::int64_t, std::int64_t>> FindSelfIntersections(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles,
  std::size_t limit = 0);
}

#endif
