/**
 * @file Geometry.h
 * @brief Vector types shared by all algorithms. World coordinates are LPS, in millimetres.
 */
#ifndef DynamicCoronary_Geometry_h
#define DynamicCoronary_Geometry_h

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace coronary
{
using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

/// Three point indices, counter-clockwise seen from outside.
using Triangle = std::array<std::int64_t, 3>;

/// The place of a segment that is nearest to a point.
struct SegmentPlace
{
  double fraction = 0.0; ///< of the way from the segment's first end to its second, 0 to 1
  Vector3 position = Vector3::Zero();
  double squaredDistance = 0.0; ///< of the point, mm^2
};

/// A segment without length is its first end.
inline SegmentPlace NearestOnSegment(const Vector3& point, const Vector3& a, const Vector3& b)
{
  const Vector3 way = b - a;
  const double square = way.squaredNorm();
  SegmentPlace place;
  place.fraction = square > 0.0 ? std::clamp((point - a).dot(way) / square, 0.0, 1.0) : 0.0;
  place.position = a + place.fraction * way;
  place.squaredDistance = (point - place.position).squaredNorm();
  return place;
}

/// An image's sampling: world = origin + direction * diag(spacing) * index.
struct ImageGrid
{
  std::array<int, 6> extent{ 0, -1, 0, -1, 0, -1 }; ///< inclusive index ranges, as in VTK
  Vector3 origin = Vector3::Zero();                 ///< world position of index (0, 0, 0), mm
  Vector3 spacing = Vector3::Ones();                ///< mm, all positive
  Matrix3 direction = Matrix3::Identity();          ///< orthonormal columns: world axes of i, j, k

  Vector3 IndexToWorld(double i, double j, double k) const
  {
    return origin + direction * spacing.cwiseProduct(Vector3(i, j, k));
  }
};
}

#endif
