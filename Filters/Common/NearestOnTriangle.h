/**
 * @file NearestOnTriangle.h
 * @brief The nearest place of a triangle, fast where triangles are sound and right where they are slivers.
 */
#ifndef DynamicCoronary_NearestOnTriangle_h
#define DynamicCoronary_NearestOnTriangle_h

#include "Geometry.h"

#include <algorithm>
#include <limits>

namespace coronary
{
/// Where on a triangle a nearest point lies.
enum class TriangleFeature : int
{
  Face = 0,
  EdgeAB = 1,
  EdgeBC = 2,
  EdgeCA = 3,
  A = 4,
  B = 5,
  C = 6
};

struct TrianglePoint
{
  Vector3 point = Vector3::Zero();
  double squaredDistance = std::numeric_limits<double>::infinity();
  double b = 0.0; ///< barycentric of the second and third corner
  double c = 0.0;
  TriangleFeature feature = TriangleFeature::Face;
};

/// What NearestOnTriangle is where the triangle is almost a line or a point.
TrianglePoint NearestOnSliver(
  const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/**
 * The point of a triangle that is nearest to p. The triangle may be a line or a point: one of its edges or corners is
 * named then. After Ericson, Real-Time Collision Detection, 2005, 5.1.5.
 * @param beyond  if the triangle is certainly further, the squared distance may be infinite
 */
inline TrianglePoint NearestOnTriangle(const Vector3& p, const Vector3& a, const Vector3& b,
  const Vector3& c, double beyond = std::numeric_limits<double>::infinity())
{
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const Vector3 ap = p - a;
  const double d00 = ab.squaredNorm();
  const double d01 = ab.dot(ac);
  const double d11 = ac.squaredNorm();
  TrianglePoint on;
  if (beyond < std::numeric_limits<double>::infinity())
  {
    const double longest = std::max(d00, d11);
    const double distance = ap.squaredNorm();
    // (beyond + longest)^2 is at most 2 beyond^2 + 2 longest^2.
    if (distance > 2.0 * (beyond * beyond + longest))
    {
      return on;
    }
  }
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  const double area = d00 * d11 - d01 * d01;
  if (!(area > 1e-8 * d00 * d11))
  {
    return NearestOnSliver(p, a, b, c);
  }
  const double v = d11 * d1 - d01 * d2;
  const double w = d00 * d2 - d01 * d1;
  if (v > 0.0 && w > 0.0 && v + w < area)
  {
    const double scale = 1.0 / area;
    on.b = scale * v;
    on.c = scale * w;
    on.point = a + on.b * ab + on.c * ac;
    on.squaredDistance = (p - on.point).squaredNorm();
    return on;
  }
  // The nearest point is on an edge that p sees: one or two of them.
  double x = 0.0;
  double y = 0.0;
  double squared = std::numeric_limits<double>::infinity(); // less that of ap
  TriangleFeature feature = TriangleFeature::A;
  if (w <= 0.0)
  {
    x = d1 <= 0.0 ? 0.0 : d1 >= d00 ? 1.0 : d1 / d00;
    feature = d1 <= 0.0 ? TriangleFeature::A
      : d1 >= d00       ? TriangleFeature::B
                        : TriangleFeature::EdgeAB;
    squared = x * (x * d00 - 2.0 * d1);
  }
  if (v <= 0.0)
  {
    const double t = d2 <= 0.0 ? 0.0 : d2 >= d11 ? 1.0 : d2 / d11;
    const double other = t * (t * d11 - 2.0 * d2);
    if (other < squared)
    {
      squared = other;
      x = 0.0;
      y = t;
      feature = d2 <= 0.0 ? TriangleFeature::A
        : d2 >= d11       ? TriangleFeature::C
                          : TriangleFeature::EdgeCA;
    }
  }
  if (v + w >= area)
  {
    const double along = (d2 - d01) - (d1 - d00);
    const double length = d00 + d11 - 2.0 * d01;
    const double t = along <= 0.0 ? 0.0 : along >= length ? 1.0 : along / length;
    const double u = 1.0 - t;
    const double other = u * (u * d00 - 2.0 * d1) + t * (t * d11 - 2.0 * d2) + 2.0 * u * t * d01;
    if (other < squared)
    {
      x = u;
      y = t;
      feature = along <= 0.0 ? TriangleFeature::B
        : along >= length    ? TriangleFeature::C
                             : TriangleFeature::EdgeBC;
    }
  }
  on.b = x;
  on.c = y;
  on.point = a + x * ab + y * ac;
  on.squaredDistance = (p - on.point).squaredNorm();
  on.feature = feature;
  return on;
}
}

#endif
