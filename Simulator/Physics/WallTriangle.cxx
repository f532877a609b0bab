#include "WallTriangle.h"

namespace coronary
{
WallTrianglePoint NearestOnSliver(
  const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c)
{
  const TrianglePoint robust = NearestOnTriangle(p, a, b, c);
  WallTrianglePoint on;
  on.point = robust.point;
  on.squared = robust.squaredDistance;
  on.feature = robust.feature;
  const auto fraction = [&](const Vector3& from, const Vector3& to)
  {
    const double square = (to - from).squaredNorm();
    return square > 0.0 ? std::clamp((on.point - from).dot(to - from) / square, 0.0, 1.0) : 0.0;
  };
  switch (robust.feature)
  {
    case TriangleFeature::Face:
    {
      const Vector3 normal = (b - a).cross(c - a);
      const double area = normal.squaredNorm();
      on.b = std::clamp((on.point - a).cross(c - a).dot(normal) / area, 0.0, 1.0);
      on.c = std::clamp((b - a).cross(on.point - a).dot(normal) / area, 0.0, 1.0 - on.b);
      break;
    }
    case TriangleFeature::EdgeAB:
      on.b = fraction(a, b);
      break;
    case TriangleFeature::EdgeBC:
      on.c = fraction(b, c);
      on.b = 1.0 - on.c;
      break;
    case TriangleFeature::EdgeCA:
      on.c = 1.0 - fraction(c, a);
      break;
    case TriangleFeature::A:
      break;
    case TriangleFeature::B:
      on.b = 1.0;
      break;
    case TriangleFeature::C:
      on.c = 1.0;
      break;
  }
  return on;
}
}
