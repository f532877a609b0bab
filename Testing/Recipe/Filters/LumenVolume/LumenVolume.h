/**
 * @file LumenVolume.h
 * @brief Volume of a vessel between the first and the last point of its axis.
 */
#ifndef DynamicCoronary_LumenVolume_h
#define DynamicCoronary_LumenVolume_h

#include "Geometry.h"

#include <vector>

namespace coronary
{
/**
 * Truncated cones between successive points: sum of pi l (r^2 + r s + s^2) / 3.
 * @param points  of the axis, mm
 * @param radii   one a point, mm, 0 or more
 * @return mm^3; 0 for less than two points
 * @throws std::invalid_argument for another number of radii, a radius that is negative or not finite
 */
double LumenVolume(const std::vector<Vector3>& points, const std::vector<double>& radii);
}

#endif
