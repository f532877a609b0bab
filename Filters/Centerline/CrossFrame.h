/**
 * @file CrossFrame.h
 * @brief Directions: across an axis, all around a place, and the angle between two.
 */
#ifndef DynamicCoronary_CrossFrame_h
#define DynamicCoronary_CrossFrame_h

#include "Geometry.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
/// Two unit vectors across an axis, at right angles to each other.
struct CrossFrame
{
  Vector3 u;
  Vector3 v;

  /// @param axis  unit vector
  explicit CrossFrame(const Vector3& axis)
    : u(axis.unitOrthogonal())
    , v(axis.cross(u))
  {
  }

  Vector3 Place(double x, double y) const { return x * this->u + y * this->v; }

  /// Unit vector of one of `rays` directions at equal angles.
  Vector3 Ray(int ray, int rays) const
  {
    const double angle = 2.0 * M_PI * ray / rays;
    return this->Place(std::cos(angle), std::sin(angle));
  }
};

/// One of `count` unit vectors that are spread evenly over the sphere, as Fibonacci points.
inline Vector3 SphereDirection(int index, int count)
{
  const double z = 1.0 - (2.0 * index + 1.0) / count;
  const double angle = index * 2.399963229728653;
  const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
  return { r * std::cos(angle), r * std::sin(angle), z };
}

/// Radians, 0 to pi, between two unit vectors.
inline double UnitAngle(const Vector3& a, const Vector3& b)
{
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0));
}
}

#endif
