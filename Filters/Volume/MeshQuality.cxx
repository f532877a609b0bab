#include "MeshQuality.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
template <typename Element>
void Check(const std::vector<Vector3>& points, const std::vector<Element>& elements)
{
  for (std::size_t n = 0; n < points.size(); ++n)
  {
    if (!points[n].allFinite())
    {
      throw std::invalid_argument("point " + std::to_string(n) + " is not finite");
    }
  }
  const auto count = static_cast<std::int64_t>(points.size());
  for (std::size_t n = 0; n < elements.size(); ++n)
  {
    for (const std::int64_t corner : elements[n])
    {
      if (corner < 0 || corner >= count)
      {
        throw std::invalid_argument(
          "element " + std::to_string(n) + " has a point that does not exist");
      }
    }
  }
}

/// The angle at a, radians.
double AngleAt(const Vector3& a, const Vector3& b, const Vector3& c)
{
  return std::atan2((b - a).cross(c - a).norm(), (b - a).dot(c - a));
}
}

TetrahedraQuality MeasureTetrahedra(const std::vector<Vector3>& points,
  const std::vector<Tetrahedron>& tetrahedra, double poorAngle, const ProgressCallback& progress)
{
  Check(points, tetrahedra);
  TetrahedraQuality quality;
  quality.volume.resize(tetrahedra.size());
  quality.minimumDihedral.resize(tetrahedra.size());
  quality.radiusEdgeRatio.resize(tetrahedra.size());
  ParallelFor(
    static_cast<std::int64_t>(tetrahedra.size()), 4096,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const Tetrahedron& t = tetrahedra[n];
        const Vector3& a = points[t[0]];
        const Vector3& b = points[t[1]];
        const Vector3& c = points[t[2]];
        const Vector3& d = points[t[3]];
        quality.volume[n] = TetrahedronVolume(a, b, c, d);
        quality.minimumDihedral[n] = MinimumDihedralAngle(a, b, c, d);
        quality.radiusEdgeRatio[n] = RadiusEdgeRatio(a, b, c, d);
      }
    },
    progress);
  for (std::size_t n = 0; n < tetrahedra.size(); ++n)
  {
    const auto at = static_cast<std::int64_t>(n);
    const double volume = quality.volume[n];
    quality.totalVolume += volume;
    if (!(volume > 0.0))
    {
      quality.inverted.push_back(at);
    }
    if (quality.minimumDihedral[n] < poorAngle)
    {
      ++quality.poor;
    }
    if (n == 0 || volume < quality.minimumVolume)
    {
      quality.minimumVolume = volume;
      quality.minimumVolumeAt = at;
    }
    if (n == 0 || quality.minimumDihedral[n] < quality.minimumDihedralAngle)
    {
      quality.minimumDihedralAngle = quality.minimumDihedral[n];
      quality.minimumDihedralAngleAt = at;
    }
    if (n == 0 || quality.radiusEdgeRatio[n] > quality.maximumRadiusEdgeRatio)
    {
      quality.maximumRadiusEdgeRatio = quality.radiusEdgeRatio[n];
      quality.maximumRadiusEdgeRatioAt = at;
    }
  }
  return quality;
}

TrianglesQuality MeasureTriangles(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  Check(points, triangles);
  TrianglesQuality quality;
  // Volumes of the tetrahedra to a point nearby: far from the origin their sum would cancel badly.
  const Vector3 apex = triangles.empty() ? Vector3(Vector3::Zero()) : points[triangles[0][0]];
  for (std::size_t n = 0; n < triangles.size(); ++n)
  {
    const Vector3& a = points[triangles[n][0]];
    const Vector3& b = points[triangles[n][1]];
    const Vector3& c = points[triangles[n][2]];
    const double area = 0.5 * (b - a).cross(c - a).norm();
    quality.area += area;
    quality.enclosedVolume += (a - apex).cross(b - apex).dot(c - apex) / 6.0;
    double angle = 0.0;
    if (area > 0.0)
    {
      angle = std::min({ AngleAt(a, b, c), AngleAt(b, c, a), AngleAt(c, a, b) });
    }
    else
    {
      quality.degenerate.push_back(static_cast<std::int64_t>(n));
    }
    if (n == 0 || angle < quality.minimumAngle)
    {
      quality.minimumAngle = angle;
      quality.minimumAngleAt = static_cast<std::int64_t>(n);
    }
  }
  return quality;
}
}
