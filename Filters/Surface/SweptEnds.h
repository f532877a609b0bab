/**
 * @file SweptEnds.h
 * @brief Free ends of vessels that no tube of their width can follow.
 */
#ifndef DynamicCoronary_SweptEnds_h
#define DynamicCoronary_SweptEnds_h

#include "VesselAxis.h"

#include <string>
#include <vector>

namespace coronary
{
/// A vessel's course: points, radii in mm, and the smoothing at each.
struct SweptAxis
{
  std::vector<Vector3> points;
  std::vector<double> radius;
  std::vector<double> smoothing;
};

/**
 * Mends a free end whose tube would fold over its cap: where curvature times radius is too great,
 * or the radius changes so fast that wall and cap meet in a blade. The radius is limited in slope;
 * where that is not enough, the end is laid straight: a shorter one would leave bones outside of the wall.
 *
 * @param axis     of the course as it is
 * @param atStart  which end
 * @param[out] place  of the end before
 * @return what was done, "" when the end is fit as it is
 */
std::string MendEnd(SweptAxis& course, const VesselAxis& axis, bool atStart, Vector3& place);
}

#endif
