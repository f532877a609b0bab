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
constexpr double StentEdge = 1.0; // mm on which a crimped stent's ends taper, for what touches them

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

double Thickest(const Guidewire& wire)
{
  double radius = 0.0;
  for (const WireSection& section : wire.sections)
  {
    radius = std::max(radius, section.radius);
  }
  return radius;
}

void RequireThinner(const std::string& what, double thick, const GuideCatheter& catheter)
{
  if (thick >= catheter.innerRadius)
  {
    char text[256];
    std::snprintf(text, sizeof(text),
      "%s is thicker (radius %.3f mm) than the inside of the catheter '%s' (radius %.3f mm)",
      what.c_str(), thick, catheter.name.c_str(), catheter.innerRadius);
    throw std::invalid_argument(text);
  }
}
}

void RequireFit(const BalloonCatheter& balloon, const GuideCatheter& catheter)
{
  balloon.Validate();
  RequireThinner(
    std::string("the ") + balloon.Kind() + " '" + balloon.name + "'", balloon.Profile(), catheter);
}

void RequireFit(const Guidewire& wire, const GuideCatheter& catheter)
{
  wire.Validate();
  for (const WireSection& section : wire.sections)
  {
    RequireThinner("the wire '" + wire.name + "'", section.radius, catheter);
  }
}

void RequireFit(const Guidewire& wire, const BalloonCatheter& around)
{
  const double thickest = Thickest(wire);
  if (around.IsMicrocatheter() && thickest >= around.innerRadius)
  {
    char text[256];
    std::snprintf(text, sizeof(text),
      "the wire '%s' is thicker (radius %.3f mm) than the lumen of the microcatheter '%s' (radius "
      "%.3f mm)",
      wire.name.c_str(), thickest, around.name.c_str(), around.innerRadius);
    throw std::invalid_argument(text);
  }
}

void RequireFitBeside(
  const BalloonCatheter& balloon, const Guidewire& wire, const GuideCatheter& catheter)
{
  const double thickest = Thickest(wire);
  if (balloon.Profile() + thickest > catheter.innerRadius)
  {
    char text[300];
    std::snprintf(text, sizeof(text),
      "the %s '%s' (%.2f mm) and the wire '%s' (%.2f mm) do not fit beside each other into the "
      "catheter '%s' (%.2f mm inside)",
      balloon.Kind(), balloon.name.c_str(), 2.0 * balloon.Profile(), wire.name.c_str(),
      2.0 * thickest, catheter.name.c_str(), 2.0 * catheter.innerRadius);
    throw std::invalid_argument(text);
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
  RequirePieces(this->sections.size(), 0, whose, "sections");
  Require(this->wallFriction, 0.0, 2.0, whose, "the wall's friction", "");
  for (std::size_t n = 0; n < this->sections.size(); ++n)
  {
    const CatheterSection& section = this->sections[n];
    const std::string part = whose + ", section " + std::to_string(n + 1);
    Require(section.length, 0.1, 3000.0, part, "the length", "mm");
    // From a tenth of the softest tip's to ten times the stiffest 8 French shaft's.
    Require(section.bendingStiffness, 0.1, 2e4, part, "the bending stiffness", "N mm^2");
    Require(section.torsionalStiffness, 0.1, 5e4, part, "the torsional stiffness", "N mm^2");
  }
  if (sum > this->length)
  {
    char text[120];
    std::snprintf(text, sizeof(text),
      ": its arcs are %g mm long together, more than its length of %g mm.", sum, this->length);
    throw std::invalid_argument(whose + text);
  }
}

Eigen::Vector2d CurvatureAt(const std::vector<CatheterArc>& shape, double behind)
{
  for (const CatheterArc& arc : shape)
  {
    if (behind < arc.length)
    {
      return arc.curvature * Eigen::Vector2d(std::cos(arc.planeAngle), std::sin(arc.planeAngle));
    }
    behind -= arc.length;
  }
  return Eigen::Vector2d::Zero();
}

Eigen::Vector2d TurnBetween(const std::vector<CatheterArc>& shape, double from, double to)
{
  Eigen::Vector2d turn = Eigen::Vector2d::Zero();
  double begin = 0.0;
  for (const CatheterArc& arc : shape)
  {
    const double end = begin + arc.length;
    const double within = std::min(to, end) - std::max(from, begin);
    if (within > 0.0)
    {
      turn += within * arc.curvature *
        Eigen::Vector2d(std::cos(arc.planeAngle), std::sin(arc.planeAngle));
    }
    begin = end;
  }
  return turn;
}

namespace
{
void ValidateStent(const BalloonCatheter& balloon, const std::string& balloonName)
{
  const StentDesign& stent = *balloon.stent;
  const std::string whose = balloonName + ", its stent";
  Require(stent.strut, 0.01, 0.3, whose, "the strut's thickness", "mm");
  Require(stent.crimpedRadius, balloon.crossingRadius + stent.strut - 1e-9, 1.5, whose,
    "the crimped radius (balloon and struts fit into it)", "mm");
  const double inside = 2.0 * (stent.crimpedRadius - stent.strut);
  Require(stent.diameter, inside + 0.1, 10.0, whose, "the diameter", "mm");
  Require(stent.greatestDiameter, stent.diameter, 12.0, whose, "the greatest diameter", "mm");
  Require(stent.foreshortening, 0.0, 0.3, whose, "the foreshortening", "");
  Require(stent.length, 4.0, balloon.length * (1.0 - stent.foreshortening), whose,
    "the length (crimped it is no longer than its balloon)", "mm");
  // A ring that springs back stays wider than it was crimped.
  Require(stent.recoil, 0.001, std::min(0.3, 1.0 - (inside + 0.02) / stent.diameter), whose,
    "the recoil", "");
  Require(stent.collapsePressure, 0.05, 20.0, whose, "the collapse pressure", "atm");
  Require(
    stent.openingPressure, 0.01, stent.collapsePressure, whose, "the opening pressure", "atm");
  Require(stent.metalShare, 0.01, 1.0, whose, "the metal's share", "");
  double before = 0.0;
  for (const ComplianceRow& row : balloon.WithoutStent().compliance)
  {
    if (!(row.pressure > before))
    {
      throw std::invalid_argument(whose + ": at " + std::to_string(row.diameter) +
        " mm of the compliance table there is too little pressure to open it.");
    }
    before = row.pressure;
  }
}
}

double StentDesign::LengthAt(double insideDiameter) const
{
  const double crimped = 2.0 * (this->crimpedRadius - this->strut);
  const double open = (insideDiameter - crimped) / (this->diameter - crimped);
  return this->CrimpedLength() * (1.0 - this->foreshortening * open);
}

StentRing StentDesign::CrimpedRing() const
{
  StentRing ring;
  ring.crimped = ring.natural = ring.widest = ring.radius = this->crimpedRadius - this->strut;
  ring.thickness = this->strut;
  const double springs = 0.5 * this->recoil * this->diameter;
  ring.stiffness = this->collapsePressure / springs;
  ring.opening = this->openingPressure;
  ring.hardening = (this->collapsePressure - this->openingPressure) /
    (0.5 * this->diameter - springs - ring.crimped);
  ring.greatest = 0.5 * this->greatestDiameter;
  return ring;
}

namespace
{
void ValidateMicrocatheter(const BalloonCatheter& device)
{
  const std::string whose = "Microcatheter '" + device.name + "'";
  Require(device.monorail, 500.0, 2000.0, whose, "the length", "mm");
  Require(device.innerRadius, 0.1, 1.0, whose, "the inner radius", "mm");
  Require(device.tipLength, 0.1, 50.0, whose, "the tip's length", "mm");
  Require(device.markerLength, 0.1, 5.0, whose, "the marker's length", "mm");
  Require(device.markerPlace, 0.5 * device.markerLength, 50.0, whose, "the marker's place", "mm");
  Require(device.pushStiffness, 1e-3, 1e3, whose, "the push stiffness", "N/mm");
  Require(device.wireFriction, 0.0, 5.0, whose, "the friction on the wire", "N");
  Require(device.friction, 0.0, 2.0, whose, "the friction", "");
  RequirePieces(device.sections.size(), 1, whose, "sections");
  double sum = 0.0;
  for (std::size_t n = 0; n < device.sections.size(); ++n)
  {
    const MicrocatheterSection& section = device.sections[n];
    const std::string part = whose + ", section " + std::to_string(n + 1);
    if (n > 0 && sum >= device.monorail)
    {
      throw std::invalid_argument(part + " begins behind the microcatheter's end.");
    }
    Require(section.length, 0.1, 2000.0, part, "the length", "mm");
    Require(section.outerRadius, device.innerRadius + 0.01, 1.5, part,
      "the outer radius (its lumen fits into it)", "mm");
    Require(section.bendingStiffness, 1e-3, 1e3, part, "the bending stiffness", "N mm^2");
    sum += section.length;
  }
  Require(device.tipRadius, device.innerRadius, device.sections.front().outerRadius, whose,
    "the tip's radius", "mm");
}

double OuterRadius(const MicrocatheterSection& section)
{
  return section.outerRadius;
}
}

void BalloonCatheter::Validate() const
{
  if (this->IsMicrocatheter())
  {
    ValidateMicrocatheter(*this);
    return;
  }
  const std::string whose = "Balloon '" + this->name + "'";
  Require(this->length, 4.0, 60.0, whose, "the length", "mm");
  Require(this->tipLength, 1.0, 30.0, whose, "the tip's length", "mm");
  Require(this->shoulder, 0.1, this->tipLength, whose, "the shoulder", "mm");
  Require(this->crossingRadius, 0.2, 1.5, whose, "the crossing radius", "mm");
  Require(this->tipRadius, 0.15, this->crossingRadius, whose, "the tip's radius", "mm");
  Require(this->shaftRadius, 0.2, 1.5, whose, "the shaft's radius", "mm");
  Require(this->monorail, this->Reach() + 1.0, 2000.0, whose, "the monorail", "mm");
  Require(this->markerLength, 0.1, 5.0, whose, "the marker's length", "mm");
  Require(this->nominalPressure, 1.0, 40.0, whose, "the nominal pressure", "atm");
  Require(this->ratedPressure, this->nominalPressure, 40.0, whose, "the rated pressure", "atm");
  Require(this->tipStiffness, 0.0, 1e3, whose, "the tip's stiffness", "N mm^2");
  Require(this->balloonStiffness, 0.0, 1e3, whose, "the balloon's stiffness", "N mm^2");
  Require(this->shaftStiffness, 0.0, 1e3, whose, "the shaft's stiffness", "N mm^2");
  Require(this->filmStiffness, 0.0, 1e3, whose, "the film's stiffness", "N/mm");
  Require(this->pushStiffness, 1e-3, 1e3, whose, "the push stiffness", "N/mm");
  Require(this->wireFriction, 0.0, 5.0, whose, "the friction on the wire", "N");
  Require(this->inflatedFriction, 0.0, 5.0, whose, "the friction on the wire when inflated", "N");
  Require(this->friction, 0.0, 2.0, whose, "the friction", "");
  Require(this->inflationResistance, 0.1, 1e4, whose, "the inflation resistance", "atm s/mL");
  Require(this->fillFraction, 0.0, 1.0, whose, "the part of contrast medium", "");
  RequirePieces(this->compliance.size(), 2, whose, "rows of compliance");
  double before = 2.0 * this->crossingRadius;
  double pressure = 0.0;
  for (std::size_t n = 0; n < this->compliance.size(); ++n)
  {
    const std::string part = whose + ", row " + std::to_string(n + 1) + " of its compliance";
    const ComplianceRow& row = this->compliance[n];
    Require(row.pressure, pressure + 1e-3, 40.0, part, "the pressure", "atm");
    Require(row.diameter, before, 10.0, part, "the diameter", "mm");
    pressure = row.pressure;
    before = row.diameter;
  }
  if (this->stent)
  {
    ValidateStent(*this, whose);
  }
}

double BalloonCatheter::FreeRadius(double pressure) const
{
  if (!(pressure > 0.0))
  {
    return this->crossingRadius;
  }
  ComplianceRow low{ 0.0, 2.0 * this->crossingRadius };
  ComplianceRow high = this->compliance.front();
  for (std::size_t n = 1; n < this->compliance.size() && pressure > high.pressure; ++n)
  {
    low = high;
    high = this->compliance[n]; // the last slope goes on
  }
  const double share = (pressure - low.pressure) / (high.pressure - low.pressure);
  return 0.5 * (low.diameter + share * (high.diameter - low.diameter));
}

double BalloonCatheter::Shape(double behind) const
{
  if (this->IsMicrocatheter())
  {
    return 0.0;
  }
  const double before = this->tipLength - behind;
  const double after = behind - this->tipLength - this->length;
  const double beyond = std::max({ 0.0, before, after }) / this->shoulder;
  return beyond < 1.0 ? 0.5 * (1.0 + std::cos(M_PI * beyond)) : 0.0;
}

double BalloonCatheter::FoldedRadius(double behind) const
{
  if (behind < 0.0)
  {
    return 0.0;
  }
  const double tip = std::min(1.0, behind / this->tipLength);
  if (this->IsMicrocatheter())
  {
    const double outside = AlongSections(this->sections, behind, OuterRadius);
    return this->tipRadius + tip * (outside - this->tipRadius);
  }
  const double back =
    std::clamp((behind - this->tipLength - this->length) / this->shoulder, 0.0, 1.0);
  const double front = this->tipRadius + tip * (this->crossingRadius - this->tipRadius);
  return front + back * (this->shaftRadius - this->crossingRadius);
}

double BalloonCatheter::CrimpedRadius(double behind) const
{
  const double folded = this->FoldedRadius(behind);
  if (!this->stent)
  {
    return folded;
  }
  const double within = 0.5 * this->stent->CrimpedLength() - std::abs(behind - this->Middle());
  const double share = std::clamp(within / StentEdge, 0.0, 1.0);
  return folded + share * std::max(0.0, this->stent->crimpedRadius - folded);
}

double BalloonCatheter::Profile() const
{
  if (this->IsMicrocatheter())
  {
    return std::max_element(this->sections.begin(), this->sections.end(),
      [](const MicrocatheterSection& a, const MicrocatheterSection& b)
      { return a.outerRadius < b.outerRadius; })
      ->outerRadius;
  }
  const double folded = std::max(this->crossingRadius, this->shaftRadius);
  return this->stent ? std::max(folded, this->stent->crimpedRadius) : folded;
}

BalloonCatheter BalloonCatheter::WithoutStent() const
{
  BalloonCatheter bare = *this;
  bare.stent.reset();
  if (this->stent)
  {
    const StentRing ring = this->stent->CrimpedRing();
    for (ComplianceRow& row : bare.compliance)
    {
      row.pressure -= RingPressure(ring, 0.5 * row.diameter);
    }
  }
  return bare;
}

double BalloonCatheter::BendingStiffness(double behind, double pressure, double radius) const
{
  if (behind < 0.0)
  {
    return 0.0;
  }
  if (this->IsMicrocatheter())
  {
    return AlongSections(this->sections, behind,
      [](const MicrocatheterSection& section) { return section.bendingStiffness; });
  }
  const double shape = this->Shape(behind);
  const double beside = behind < this->Middle() ? this->tipStiffness : this->shaftStiffness;
  // The film carries once it is taut.
  const double taut = std::clamp(pressure / this->compliance.front().pressure, 0.0, 1.0);
  const double film = this->filmStiffness * M_PI * radius * radius * radius;
  return (1.0 - shape) * beside + shape * (this->balloonStiffness + taut * film);
}
}
