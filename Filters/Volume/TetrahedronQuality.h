/**
 * @file TetrahedronQuality.h
 * @brief Size and shape of one tetrahedron.
 */
#ifndef DynamicCoronary_TetrahedronQuality_h
#define DynamicCoronary_TetrahedronQuality_h

#include "Geometry.h"

namespace coronary
{
/// Four point indices; the fourth lies where the normal of the first three points to.
using Tetrahedron = std::array<std::int64_t, 4>;

/// Negative when inverted, mm^3.
double TetrahedronVolume(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// The least angle between two of the four faces, radians; 0 when flat or inverted.
double MinimumDihedralAngle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// Radius of the circumscribed sphere over the shortest edge; 0.612 at best, infinite when flat.
double RadiusEdgeRatio(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// The least sine of the six dihedral angles, which is small for flat and for blunt angles; at most
/// 0.943, negative when inverted.
double MinimumDihedralSine(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);
}

#endif
