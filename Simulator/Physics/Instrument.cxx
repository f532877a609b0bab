#include "Instrument.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::size_t MostPieces = 1000;

/// NaN is not within.
void Require(double value, double low, double high, const std::string& whose,
  const std::string& property, const char* unit)
{
  if (!(value >= low && value <= high))
  {
    char text[160];
    std::snprintf(text, sizeof(text), " is %g%s%s, not within %g to %g", value, *unit ? " " : "",
      unit, low, high);
    throw std::invalid_argument(whose + ": " + property + text + ".");
  }
}

void RequirePieces(
  std::size_t count, std::size_t minimum, const std::string& whose, const char* what)
{
  if (count < minimum || count > MostPieces)
  {
    throw std::invalid_argument(whose + " has " + std::to_string(count) + " " + what + ", not " +
      std::to_string(minimum) + " to " + std::to_string(MostPieces) + ".");
  }
}
}

void Guidewire::Validate() const
{
  const std::string whose = "Wire '" + this->name + "'";
  Require(this->length, 100.0, 5000.0, whose, "the length", "mm");
  RequirePieces(this->sections.size(), 1, whose, "sections");
  double sum = 0.0;
  for (std::size_t n = 0; n < this->sections.size(); ++n)
  {
    const WireSection& section = this->sections[n];
    const std::string part = whose + ", section " + std::to_string(n + 1);
    Require(section.length, 0.1, 5000.0, part, "the length", "mm");
    // From a hundredth of the floppiest tip's to that of the stiffest 0.035 inch wire.
    Require(section.bendingStiffness1, 1e-3, 1e4, part, "the bending stiffness 1", "N mm^2");
    Require(section.bendingStiffness2, 1e-3, 1e4, part, "the bending stiffness 2", "N mm^2");
    Require(section.torsionalStiffness, 1e-3, 1e4, part, "the torsional stiffness", "N mm^2");
    Require(section.axialStiffness, 1.0, 1e6, part, "the axial stiffness", "N");
    Require(section.radius, 0.02, 1.0, part, "the radius", "mm");
    Require(section.density, 500.0, 25000.0, part, "the density", "kg/m^3");
    Require(section.friction, 0.0, 2.0, part, "the friction", "");
    // A tighter curve would run through itself.
    Require(section.restCurvature, -0.5 / section.radius, 0.5 / section.radius, part,
      "the curvature at rest", "1/mm");
    if (n > 0 && sum >= this->length)
    {
      throw std::invalid_argument(part + " begins behind the wire's end.");
    }
    sum += section.length;
  }
}

double RestCurvature(const Guidewire& wire, double distance)
{
  double from = 0.0;
  for (const WireSection& section : wire.sections)
  {
    from += section.length;
    if (distance < from)
    {
      return section.restCurvature;
    }
  }
  return 0.0;
}

void GuideCatheter::Validate() const
{
  const std::string whose = "Catheter '" + this->name + "'";
  Require(this->innerRadius, 0.1, 5.0, whose, "the inner radius", "mm");
  Require(this->outerRadius, 0.1, 6.0, whose, "the outer radius", "mm");
  if (!(this->outerRadius > this->innerRadius))
  {
    char text[120];
    std::snprintf(text, sizeof(text),
      ": the outer radius, %g mm, is not greater than the inner one, %g mm.", this->outerRadius,
      this->innerRadius);
    throw std::invalid_argument(whose + text);
  }
  Require(this->length, 100.0, 3000.0, whose, "the length", "mm");
  Require(this->friction, 0.0, 2.0, whose, "the friction", "");
  RequirePieces(this->shape.size(), 0, whose, "arcs");
  double sum = 0.0;
  for (std::size_t n = 0; n < this->shape.size(); ++n)
  {
    const CatheterArc& arc = this->shape[n];
    const std::string part = whose + ", arc " + std::to_string(n + 1);
    Require(arc.length, 0.1, 3000.0, part, "the length", "mm");
    Require(arc.curvature, -1.0 / this->outerRadius, 1.0 / this->outerRadius, part, "the curvature",
      "1/mm");
    Require(arc.planeAngle, -2.0 * M_PI, 2.0 * M_PI, part, "the plane's angle", "rad");
    sum += arc.length;
  }
  if (sum > this->length)
  {
    char text[120];
    std::snprintf(text, sizeof(text),
      ": its arcs are %g mm long together, more than its length of %g mm.", sum, this->length);
    throw std::invalid_argument(whose + text);
  }
}
}
