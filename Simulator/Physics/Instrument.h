/**
 * @file Instrument.h
 * @brief Guidewires and guide catheters as their mechanics.
 */
#ifndef DynamicCoronary_Instrument_h
#define DynamicCoronary_Instrument_h

#include <cstddef>
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

/// A property of a wire at a distance from its tip, mm: linear from the middle of one section to that of the next.
/// @param property  of a WireSection
template <typename Property>
double AlongWire(const Guidewire& wire, double distance, Property property)
{
  double from = 0.0;
  double lastMiddle = 0.0;
  double lastValue = 0.0;
  for (std::size_t i = 0; i < wire.sections.size(); ++i)
  {
    const WireSection& section = wire.sections[i];
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

/// A guide catheter. Proximal of its last arc it is straight.
struct GuideCatheter
{
  std::string name;
  std::string source;
  double innerRadius = 0.0;       ///< mm, positive
  double outerRadius = 0.0;       ///< mm, greater than innerRadius
  double length = 1000.0;         ///< mm
  double friction = 0.0;          ///< coefficient of a wire against its inside, 0 to 2
  std::vector<CatheterArc> shape; ///< from the tip

  /// @throws std::invalid_argument naming the catheter and the property
  void Validate() const;
};
}

#endif
