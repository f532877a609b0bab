#include "NearestOnTriangle.h"

namespace coronary
{
TrianglePoint NearestOnSliver(
  const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c)
{
  TrianglePoint nearest;
  const auto offer =
    [&](const Vector3& point, double weightB, double weightC, TriangleFeature feature)
  {
    const double squared = (point - p).squaredNorm();
    if (squared < nearest.squaredDistance)
    {
      nearest = { point, squared, weightB, weightC, feature };
    }
  };
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const Vector3 normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  if (area > 0.0)
  {
    const Vector3 ap = p - a;
    const double w = ab.cross(ap).dot(normal) / area;
    const double v = ap.cross(ac).dot(normal) / area;
    if (v > 0.0 && w > 0.0 && v + w < 1.0)
    {
      offer(a + v * ab + w * ac, v, w, TriangleFeature::Face);
    }
  }
  // Edges too: where a triangle is almost a line, the place in its plane is mostly rounding.
  const auto feature = [](double fraction, TriangleFeature first, TriangleFeature inside,
                         TriangleFeature last) {
    return fraction <= 0.0 ? first : fraction >= 1.0 ? last : inside;
  };
  const SegmentPlace first = NearestOnSegment(p, a, b);
  offer(first.position, first.fraction, 0.0,
    feature(first.fraction, TriangleFeature::A, TriangleFeature::EdgeAB, TriangleFeature::B));
  const SegmentPlace second = NearestOnSegment(p, b, c);
  offer(second.position, 1.0 - second.fraction, second.fraction,
    feature(second.fraction, TriangleFeature::B, TriangleFeature::EdgeBC, TriangleFeature::C));
  const SegmentPlace third = NearestOnSegment(p, c, a);
  offer(third.position, 0.0, 1.0 - third.fraction,
    feature(third.fraction, TriangleFeature::C, TriangleFeature::EdgeCA, TriangleFeature::A));
  return nearest;
}
}
