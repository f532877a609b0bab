/**
 * @file GuideWay.h
 * @brief The way of a wire in a guide catheter and on from its tip, as points a little apart.
 */
#ifndef DynamicCoronary_GuideWay_h
#define DynamicCoronary_GuideWay_h

#include "Geometry.h"

#include <vector>

namespace coronary
{
/// A place on the way.
struct PathPlace
{
  Vector3 position = Vector3::Zero();
  Vector3 tangent = Vector3::UnitZ(); ///< unit, into the vessel
  Vector3 side =
    Vector3::UnitX(); ///< unit, across; does not turn about the way from place to place
  Vector3 velocity = Vector3::Zero(); ///< mm/s
};

/// Places are named by u, mm, which rises towards the vessel.
class GuideWay
{
public:
  virtual ~GuideWay() = default;

  double First() const { return this->Begin; }
  double Last() const
  {
    return this->Begin + this->Spacing * (static_cast<int>(this->Now.size()) - 1);
  }

  PathPlace At(double u) const;
  /// The place nearest to a point, between two values of u.
  double Nearest(const Vector3& point, double from, double to) const;

  /// Since the key frame began, s.
  virtual void SetTime(double seconds) = 0;

  /// Of the whole catheter from its tip at u back, mm; for drawing.
  virtual void Line(double u, double length, std::vector<Vector3>& line) const = 0;

protected:
  /// Of the way's piece that begins at point i, mm/s. @param share  of the piece that is passed
  virtual Vector3 VelocityAt(std::size_t i, double share) const = 0;
  /// Tangents of Now. @param otherwise  of the first one, where points fall together
  void MakeTangents(const Vector3& otherwise);
  /// Sides that do not turn about the way, from those of point `from` on, both ways.
  void CarrySides(std::size_t from, const Vector3& side);

  static constexpr double Spacing = 0.5; ///< mm
  double Begin = 0.0;                    ///< u of the first point
  std::vector<Vector3> Now;              ///< two at least
  std::vector<Vector3> Tangents;
  std::vector<Vector3> Sides;
};
}

#endif
