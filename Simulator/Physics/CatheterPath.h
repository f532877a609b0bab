/**
 * @file CatheterPath.h
 * @brief The way of a guide catheter: along its own shape to the ostium, and along the vessel's axis into it.
 */
#ifndef DynamicCoronary_CatheterPath_h
#define DynamicCoronary_CatheterPath_h

#include "GuideWay.h"
#include "Instrument.h"

#include <vector>

namespace coronary
{
/// Of a vessel, over its first 3 mm, unit. @param axis  from its ostium on, of some length
Vector3 DirectionAtOstium(const std::vector<Vector3>& axis);

/**
 * u is 0 at the ostium and positive into the vessel. The shape behind the ostium is rigid and
 * moves with the ostium; what is inside of the vessel lies on its axis. Between two key frames points move evenly.
 */
class CatheterPath : public GuideWay
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
  void SetTime(double seconds) override;

  void Line(double u, double length, std::vector<Vector3>& line) const override;

private:
  Vector3 VelocityAt(std::size_t i, double share) const override;
  void Shape(const std::vector<Vector3>& axis, std::vector<Vector3>& points) const;
  void Frames();
  Matrix3 FirstFrame() const;

  int Behind = 0; ///< points before the ostium
  Vector3 RestTangent = Vector3::UnitZ();
  Vector3 RestSide = Vector3::UnitX();
  std::vector<Vector3> Local; ///< behind the ostium, in its frame at rest, nearest first
  std::vector<Vector3>
    Further; ///< behind the first place of the way, in that place's frame; only drawn
  std::vector<Vector3> Current;
  std::vector<Vector3> Next;
  double Seconds = 1.0;
  double Angle = 0.0;
};
}

#endif
