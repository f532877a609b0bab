#include "TetrahedronQuality.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
/// Inward normals, twice the faces' areas long; face i is opposite of corner i.
std::array<Vector3, 4> FaceNormals(
  const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d)
{
  return { Vector3((d - b).cross(c - b)), Vector3((c - a).cross(d - a)),
    Vector3((d - a).cross(b - a)), Vector3((b - a).cross(c - a)) };
}
}

double TetrahedronVolume(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d)
{
  return (b - a).cross(c - a).dot(d - a) / 6.0;
}

double MinimumDihedralAngle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d)
{
  if (!(TetrahedronVolume(a, b, c, d) > 0.0))
  {
    return 0.0;
  }
  const std::array<Vector3, 4> normals = FaceNormals(a, b, c, d);
  double minimum = M_PI;
  for (int i = 0; i < 4; ++i)
  {
    for (int j = i + 1; j < 4; ++j)
    {
      // Well conditioned near 0 and 180 degrees too.
      const double angle =
        M_PI - std::atan2(normals[i].cross(normals[j]).norm(), normals[i].dot(normals[j]));
      minimum = std::min(minimum, angle);
    }
  }
  return minimum;
}

double RadiusEdgeRatio(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d)
{
  const Vector3 u = b - a;
  const Vector3 v = c - a;
  const Vector3 w = d - a;
  const double volume = u.cross(v).dot(w);
  const double shortest = std::min({ u.squaredNorm(), v.squaredNorm(), w.squaredNorm(),
    (c - b).squaredNorm(), (d - b).squaredNorm(), (d - c).squaredNorm() });
  if (volume == 0.0 || shortest == 0.0)
  {
    return std::numeric_limits<double>::infinity();
  }
  const Vector3 centre =
    (u.squaredNorm() * v.cross(w) + v.squaredNorm() * w.cross(u) + w.squaredNorm() * u.cross(v)) /
    (2.0 * volume);
  return centre.norm() / std::sqrt(shortest);
}

double MinimumDihedralSine(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d)
{
  const std::array<Vector3, 4> normals = FaceNormals(a, b, c, d);
  const std::array<double, 4> squares{ normals[0].squaredNorm(), normals[1].squaredNorm(),
    normals[2].squaredNorm(), normals[3].squaredNorm() };
  const double volume = normals[3].dot(d - a); // six times
  // The faces i and j meet in the edge between the other two corners:
  // sine = 3 volume length / (2 area area), here with six volumes and double areas.
  const auto squaredSine = [&](const Vector3& p, const Vector3& q, int i, int j)
  { return (q - p).squaredNorm() / (squares[i] * squares[j]); };
  const double minimum =
    std::min({ squaredSine(a, b, 2, 3), squaredSine(a, c, 1, 3), squaredSine(a, d, 1, 2),
      squaredSine(b, c, 0, 3), squaredSine(b, d, 0, 2), squaredSine(c, d, 0, 1) });
  if (!std::isfinite(minimum))
  {
    return 0.0;
  }
  return volume * std::sqrt(minimum);
}
}
