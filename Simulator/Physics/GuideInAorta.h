/**
 * @file GuideInAorta.h
 * @brief A guide catheter as an elastic tube in the aorta: pushed, drawn and turned at its far end, bent by the walls.
 *
 * The tube is a CosseratRod that is curved at rest as its catalogue says, from its tip to the entry, where its shaft
 * comes in along a straight line. What lies in it (a wire) bends with it: both have one curvature, with the sum of
 * their stiffnesses. It stands in the aorta by contact and friction only, so it finds the ostium by its shape, leans
 * on the opposite wall, and is pushed out by what is pushed through it.
 */
#ifndef DynamicCoronary_GuideInAorta_h
#define DynamicCoronary_GuideInAorta_h

#include "CosseratRod.h"
#include "Instrument.h"

#include <cstdint>
#include <vector>

namespace coronary
{
struct GuideSettings
{
  double tickRate = 2000.0;  ///< steps a second, 500 to 20000
  double tipSegment = 2.0;   ///< mm, on the tip's 30 mm, 0.5 to 4
  double shaftSegment = 4.0; ///< mm, behind, 0.5 to 10
  double start = 30.0;       ///< mm of it beyond the entry at the beginning, 10 to the way's length
  int capacity = 200;        ///< segments at most, 20 to 1000
  double drag = 2.5;         ///< Pa s: per length against the medium, which moves with the walls

  /// @throws std::invalid_argument naming the setting
  void Validate() const;
};

/// Segments that a guide has, from its tip. joint[i] is that to the segment before; place: of their middles, mm.
struct GuidePieces
{
  std::vector<RodSegment> segments;
  std::vector<RodJoint> joints;
  std::vector<double> places;
};

/**
 * A joint has the guide's stiffness where it is, and by exactly the angle by which the guide turns at rest between
 * the two middles. A segment's third axis points away from the tip, the shape's first plane is that of the third and
 * the first one.
 * @throws std::invalid_argument as GuideCatheter::Validate; a catheter that has no sections
 */
GuidePieces MakeGuidePieces(const GuideCatheter& guide, const GuideSettings& settings);

/// The mouth of a vessel.
struct Ostium
{
  Vector3 position = Vector3::Zero();
  Vector3 direction = Vector3::UnitZ(); ///< unit, into the vessel
  double radius = 0.0;                  ///< mm, of the lumen
};

/// How a guide's tip lies in an ostium.
struct GuideSeat
{
  static constexpr double CoaxialAngle = 20.0 * 3.14159265358979323846 / 180.0; ///< rad, chosen
  static constexpr double DeepAt = 8.0;                                         ///< mm, chosen

  double depth = 0.0;   ///< mm of its tip beyond the ostium along the vessel; negative: before it
  double offset = 0.0;  ///< mm of its tip from the vessel's axis
  double angle = 0.0;   ///< rad between its direction and the vessel's
  bool engaged = false; ///< the tip's middle is beyond the ostium, within its lumen
  bool Coaxial() const { return this->engaged && this->angle <= CoaxialAngle; }
  bool Deep() const { return this->engaged && this->depth > DeepAt; }
};

GuideSeat SeatOf(const Vector3& tip, const Vector3& direction, const Ostium& ostium);

/**
 * Resistance of the gap around a catheter in a vessel to Poiseuille's flow, mmHg s/mL:
 * (8 eta L / pi) / ((b^4 - a^4) - (b^2 - a^2)^2 / ln(b / a)); infinite when it fills the vessel.
 * @param inner  a, mm, 0: no catheter  @param outer  b, mm  @param length  L, mm  @param viscosity  eta, Pa s
 */
double AnnularResistance(double inner, double outer, double length, double viscosity = 3.5e-3);

/// Runs at a fixed step, on one thread. The same binary, walls and input give the same bits.
class GuideInAorta
{
public:
  /**
   * At the beginning it lies along the way, straightened.
   * @param way  along the aorta from the entry to the valve, mm. At angle 0 the shape's plane is that in which the
   *             way bends from its first direction to its end.
   * @throws std::invalid_argument  a setting; a way that is shorter than `start`; as MakeGuidePieces
   */
  GuideInAorta(const GuideCatheter& guide, const std::vector<Vector3>& way,
    const GuideSettings& settings = {});

  /// A wire lies in it: straight but for what the guide bends it. @param beyond  mm of the guide's tip; may be negative
  /// @param beside  there is another one, that was said before
  void Carry(const Guidewire& wire, double beyond, bool beside = false);

  /// N on its tip, of what is pushed through it; until set again.
  void SetTipForce(const Vector3& force) { this->TipForce = force; }

  /**
   * One step of 1 / tickRate. Input that is not finite is left out; what would be beyond the guide's ends is limited.
   * @param position  mm that the hand has advanced it since the start
   * @param angle     rad that the hand has turned it, right-handed about the way forward
   * @param wall      at the end of the step
   */
  const RodStep& Step(double position, double angle, ContactSurface& wall);

  const CosseratRod& Rod() const { return this->Tube; }
  const std::vector<double>& Places() const
  {
    return this->Pieces.places;
  } ///< of segments' middles
  Vector3 Tip() const { return this->Tube.FirstEnd(0); }
  Vector3 Direction() const { return -this->Tube.Axis(0); } ///< unit, out of its tip
  double Inserted() const { return this->Fed; }             ///< mm beyond the entry
  ///@{
  /// mm of it that can be beyond the entry.
  double Least() const;
  double Most() const;
  ///@}
  const Vector3& Side() const
  {
    return this->Side_;
  }                          ///< unit, across at the entry, where angle 0 is
  double Lag() const;        ///< rad by which its tip is turned less than the hand turned it
  double HandForce() const;  ///< N against advancing, of the last step
  double HandTorque() const; ///< N mm against turning
  void Line(std::vector<Vector3>& line) const; ///< from its tip to the entry, mm
  std::uint64_t Hash(std::uint64_t hash) const;

private:
  void Append();
  Eigen::Quaterniond HeldOrientation() const;
  double SpringStiffness() const;

  GuideCatheter Guide;
  GuideSettings Settings;
  GuidePieces Pieces;
  std::vector<RodJoint> Bare; ///< joints without a wire
  Vector3 Entry;
  Vector3 Forward; ///< unit, there
  Vector3 Side_;   ///< unit, across
  CosseratRod Tube;
  double Start = 0.0;
  double Fed = 0.0;
  double Angle = 0.0;
  Vector3 TipForce = Vector3::Zero();
};
}

#endif
