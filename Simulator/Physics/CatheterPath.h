/**
 * @file CatheterPath.h
 * @brief The way of a guide catheter: along its own shape to the ostium, and along the vessel's axis into it.
 */
#ifndef DynamicCoronary_CatheterPath_h
#define DynamicCoronary_CatheterPath_h

#include "Geometry.h"
#include "Instrument.h"

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

/**
 * Places are named by u: 0 at the ostium, positive into the vessel, mm. The shape behind the ostium is rigid and
 * moves with the ostium; what is inside of the vessel lies on its axis. Between two key frames points move evenly.
 */
class CatheterPath
{
public:
  /**
   * @param axis        of the vessel from its ostium on, mm; two points at least
   * @param engagement  of the catheter's tip when its shape lies as it should, mm
   * @param behind      mm of the way behind the ostium, positive
   * @param ahead       mm of the way into the vessel; cut to the axis' length
   * @throws std::invalid_argument an axis without length
   */
  CatheterPath(const std::vector<Vector3>& axis, const GuideCatheter& catheter, double engagement,
    double behind, double ahead);

  /// Of the catheter about the vessel's direction at the ostium, rad; from the next frame on.
  void SetAngle(double angle) { this->Angle = angle; }

  /// What came next is now; the axis comes to be this one after `seconds`.
  void BeginFrame(const std::vector<Vector3>& axis, double seconds);
  /// Since the frame began, s.
  void SetTime(double seconds);

  double First() const { return -this->Spacing * this->Behind; }
  double Last() const
  {
    return this->Spacing * (static_cast<int>(this->Now.size()) - 1 - this->Behind);
  }

  PathPlace At(double u) const;
  /// The place nearest to a point, between two values of u.
  double Nearest(const Vector3& point, double from, double to) const;

  /// Of the whole catheter from its tip at u back, mm; for drawing.
  void Line(double u, double length, std::vector<Vector3>& line) const;

private:
  void Shape(const std::vector<Vector3>& axis, std::vector<Vector3>& points) const;
  void Frames();
  Matrix3 FirstFrame() const;

  double Spacing = 0.5;
  int Behind = 0; ///< points before the ostium
  Vector3 RestTangent = Vector3::UnitZ();
  Vector3 RestSide = Vector3::UnitX();
  std::vector<Vector3> Local; ///< behind the ostium, in its frame at rest, nearest first
  std::vector<Vector3>
    Further; ///< behind the first place of the way, in that place's frame; only drawn
  std::vector<Vector3> Current;
  std::vector<Vector3> Next;
  std::vector<Vector3> Now;
  std::vector<Vector3> Tangents;
  std::vector<Vector3> Sides;
  double Seconds = 1.0;
  double Angle = 0.0;
};
}

#endif
