/**
 * @file Instrument.h
 * @brief Guidewires, guide catheters, balloon catheters, stents and microcatheters as their mechanics.
 */
#ifndef DynamicCoronary_Instrument_h
#define DynamicCoronary_Instrument_h

#include "Geometry.h"
#include "StentRing.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace coronary
{
/// A piece of a guidewire, counted from its tip.
struct WireSection
{
  double length = 0.0;             ///< mm, positive
  double bendingStiffness1 = 0.0;  ///< EI about the first transverse axis, N mm^2, positive
  double bendingStiffness2 = 0.0;  ///< EI about the second transverse axis, N mm^2, positive
  double torsionalStiffness = 0.0; ///< GJ, N mm^2, positive
  double axialStiffness = 0.0;     ///< EA, N, positive
  double radius = 0.0;             ///< mm, positive
  double density = 0.0;            ///< kg/m^3, positive
  double friction = 0.0;           ///< coefficient against the vessel's wall, 0 to 2
  double restCurvature = 0.0; ///< of the shape at rest, 1/mm, in the plane of all curved sections
};

/// A guidewire. Stiffness goes linearly from the middle of one section to that of the next one.
struct Guidewire
{
  std::string name;
  std::string source;                ///< where its values are from
  double length = 1800.0;            ///< mm
  std::vector<WireSection> sections; ///< from the tip; the last one goes on to the wire's end

  /// @throws std::invalid_argument naming the wire, the section and the property
  void Validate() const;
};

/// A property of what has sections at a distance from its tip, mm: linear from the middle of one to that of the next.
/// @param property  of a section
template <typename Section, typename Property>
double AlongSections(const std::vector<Section>& sections, double distance, Property property)
{
  double from = 0.0;
  double lastMiddle = 0.0;
  double lastValue = 0.0;
  for (std::size_t i = 0; i < sections.size(); ++i)
  {
    const Section& section = sections[i];
    const double middle = from + 0.5 * section.length;
    const double value = property(section);
    if (distance < middle)
    {
      if (i == 0)
      {
        return value;
      }
      const double share = (distance - lastMiddle) / (middle - lastMiddle);
      return (1.0 - share) * lastValue + share * value;
    }
    from += section.length;
    lastMiddle = middle;
    lastValue = value;
  }
  return lastValue;
}

template <typename Property>
double AlongWire(const Guidewire& wire, double distance, Property property)
{
  return AlongSections(wire.sections, distance, property);
}

/// Curvature at rest at a distance from the tip, 1/mm: that of the section, all along it; 0 behind the last one.
double RestCurvature(const Guidewire& wire, double distance);

/// A piece of a guide catheter's shape, counted from its tip.
struct CatheterArc
{
  double length = 0.0;    ///< mm, positive
  double curvature = 0.0; ///< 1/mm; 0: straight
  double planeAngle =
    0.0; ///< radians by which the plane of curvature is turned against the first one
};

/// A piece of a guide catheter's tube, counted from its tip.
struct CatheterSection
{
  double length = 0.0;             ///< mm, positive
  double bendingStiffness = 0.0;   ///< EI, N mm^2, positive
  double torsionalStiffness = 0.0; ///< GJ, N mm^2, positive
};

/// A guide catheter. Proximal of its last arc it is straight.
struct GuideCatheter
{
  std::string name;
  std::string source;
  double innerRadius = 0.0;       ///< mm, positive
  double outerRadius = 0.0;       ///< mm, greater than innerRadius
  double length = 1000.0;         ///< mm
  double friction = 0.0;          ///< coefficient of a wire against its inside, 0 to 2
  double wallFriction = 0.0;      ///< coefficient of its outside against a vessel's wall, 0 to 2
  std::vector<CatheterArc> shape; ///< from the tip
  /// From the tip, linear as a wire's; the last one goes on to the end. Empty: not known, it can only be rigid.
  std::vector<CatheterSection> sections;

  /// @throws std::invalid_argument naming the catheter and the property
  void Validate() const;
};

/// Curvature at rest at a distance behind the tip, 1/mm, in a frame that does not turn about the catheter.
Eigen::Vector2d CurvatureAt(const std::vector<CatheterArc>& shape, double behind);
/// By which the catheter turns at rest between two places behind its tip, rad: the integral of its curvature.
Eigen::Vector2d TurnBetween(const std::vector<CatheterArc>& shape, double from, double to);

/// Of a balloon in air.
struct ComplianceRow
{
  double pressure = 0.0; ///< atm
  double diameter = 0.0; ///< mm
};

/// A stent that a balloon opens. Diameters are inside.
struct StentDesign
{
  double diameter = 0.0;      ///< mm, nominal
  double length = 0.0;        ///< mm at that diameter
  double crimpedRadius = 0.0; ///< mm, outside
  double strut = 0.0;         ///< mm, thickness
  double recoil = 0.0; ///< of the nominal diameter, when the balloon goes and nothing is around it
  double foreshortening = 0.0;   ///< of the length, from crimped to nominal
  double greatestDiameter = 0.0; ///< mm
  double openingPressure = 0.0;  ///< atm that a crimped ring bears before it flows
  double collapsePressure = 0.0; ///< atm likewise at nominal diameter, inwards and outwards
  double metalShare = 0.0;       ///< of its surface that struts cover, at nominal diameter

  double CrimpedLength() const { return this->length / (1.0 - this->foreshortening); }
  double LengthAt(double insideDiameter) const; ///< mm
  /// A ring that is crimped. stiffness: collapsePressure / (recoil diameter / 2).
  StentRing CrimpedRing() const;
};

/// A piece of a microcatheter, counted from its tip.
struct MicrocatheterSection
{
  double length = 0.0;           ///< mm, positive
  double outerRadius = 0.0;      ///< mm, positive
  double bendingStiffness = 0.0; ///< EI, N mm^2, positive
};

/**
 * A catheter that runs on the wire, from its tip: tip, balloon between two markers, shaft. One with sections is a microcatheter: it
 * has no balloon, one marker, and the wire in its whole length; nothing else of balloons is used.
 */
struct BalloonCatheter
{
  std::string name;
  std::string source;
  double length = 0.0;          ///< mm of the balloon's even part
  double tipLength = 0.0;       ///< mm before it
  double shoulder = 0.0;        ///< mm of its cones
  double tipRadius = 0.0;       ///< mm at the very tip, outside
  double crossingRadius = 0.0;  ///< mm, folded: of the crossing profile
  double shaftRadius = 0.0;     ///< mm, outside
  double monorail = 0.0;        ///< mm of the wire's lumen from the tip
  double markerLength = 0.0;    ///< mm of its two marker bands, at the ends of the even part
  double nominalPressure = 0.0; ///< atm
  double ratedPressure = 0.0;   ///< atm
  std::vector<ComplianceRow>
    compliance;                     ///< rising; of a delivery system with its stent, inside of that
  std::optional<StentDesign> stent; ///< that it delivers

  double tipStiffness = 0.0;     ///< EI, N mm^2, before the balloon
  double balloonStiffness = 0.0; ///< EI, folded
  double shaftStiffness = 0.0;   ///< EI
  double filmStiffness = 0.0;    ///< modulus times thickness of the film, N/mm: EI = pi r^3 of that
  double pushStiffness = 0.0;    ///< N/mm of the shaft from the hand to the balloon
  double wireFriction = 0.0;     ///< N on the wire, folded
  double inflatedFriction = 0.0; ///< N on the wire at rated pressure, more than folded
  double friction = 0.0;         ///< coefficient on wall and guide
  double inflationResistance = 0.0; ///< atm s/mL of the lumen that fills it
  double fillFraction = 0.5;        ///< of contrast medium in what fills it

  ///@{
  /// Of a microcatheter, else empty and 0.
  std::vector<MicrocatheterSection> sections; ///< linear as a wire's; the last one goes on
  double innerRadius = 0.0;                   ///< mm, of its lumen
  double markerPlace = 0.0;                   ///< mm behind its tip, of its marker's middle
  ///@}

  bool IsMicrocatheter() const { return !this->sections.empty(); }
  /// "balloon" or "microcatheter".
  const char* Kind() const { return this->IsMicrocatheter() ? "microcatheter" : "balloon"; }

  /// @throws std::invalid_argument naming the balloon and the property
  void Validate() const;

  /// mm, even part in air; below the first row the folds open.
  double FreeRadius(double pressure) const;
  /// What of the balloon's opening there is, 0 to 1. @param behind  mm behind the tip
  double Shape(double behind) const;
  /// mm, outside, folded, without its stent; 0 before the tip.
  double FoldedRadius(double behind) const;
  /// mm, likewise with its stent.
  double CrimpedRadius(double behind) const;
  /// mm, greatest of all, with its stent.
  double Profile() const;
  /// The balloon without its stent: the pressures of its table are what is left of them.
  BalloonCatheter WithoutStent() const;
  /// EI, N mm^2. @param pressure  atm @param radius  mm of the balloon there
  double BendingStiffness(double behind, double pressure, double radius) const;
  /// mm behind the tip; of a microcatheter the tip.
  double Middle() const
  {
    return this->IsMicrocatheter() ? 0.0 : this->tipLength + 0.5 * this->length;
  }
  double Reach() const
  {
    return this->tipLength + this->length + this->shoulder;
  } ///< mm, of the balloon's end
};

///@{
/// @throws std::invalid_argument  naming the instrument and the property; one that does not fit into the catheter
void RequireFit(const BalloonCatheter& balloon, const GuideCatheter& catheter);
void RequireFit(const Guidewire& wire, const GuideCatheter& catheter);
/// A wire in a microcatheter; any wire is in a balloon.
void RequireFit(const Guidewire& wire, const BalloonCatheter& around);
/// Side by side.
void RequireFitBeside(
  const BalloonCatheter& balloon, const Guidewire& wire, const GuideCatheter& catheter);
///@}
}

#endif
