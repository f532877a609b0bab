#include "AorticArch.h"

#include "CubicStep.h"
#include "Numbers.h"
#include "Require.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double AscendingDiameter = 30.9; ///< mm, Hager
constexpr double IsthmusDiameter = 24.7;
constexpr double DiaphragmDiameter = 24.3;

/// The arc in a frame of up, across and the normal of the two.
struct Arc
{
  Vector3 up = Vector3::UnitZ();
  Vector3 across;
  Vector3 normal;
  double turned = 0.0;   ///< of the end from upright towards `across`, radians
  double leaning = 0.0;  ///< of the end out of the plane
  double straight = 0.0; ///< mm before the arc
  double radius = 0.0;   ///< mm

  double Length() const { return this->radius * (Pi - this->turned); }
  double Turned(double s) const
  {
    return this->turned + std::clamp((s - this->straight) / this->radius, 0.0, Pi - this->turned);
  }
  Vector3 Direction(double s) const
  {
    // Upright in its plane again well before the arc ends.
    const double lean =
      this->leaning * (1.0 - CubicStep(s / (this->straight + 0.75 * this->Length())));
    const double phi = this->Turned(s);
    return std::cos(lean) * (std::cos(phi) * this->up + std::sin(phi) * this->across) +
      std::sin(lean) * this->normal;
  }
};

/// Across an axis.
Vector3 Across(const Vector3& way, const Vector3& axis)
{
  return way - way.dot(axis) * axis;
}

/// An arc that goes from an end by `target`, across the descending aorta, were it not for the end's leaning.
Arc AimAt(const AorticEnd& end, const Vector3& up, const Vector3& target)
{
  Arc arc;
  arc.up = up;
  arc.across = target.normalized();
  arc.normal = arc.up.cross(arc.across);
  arc.leaning = std::asin(std::clamp(end.direction.dot(arc.normal), -1.0, 1.0));
  arc.turned = std::atan2(end.direction.dot(arc.across), end.direction.dot(arc.up));
  return arc;
}

/// Places along the axis at equal steps of at most `spacing` up to `length`, by midpoints that are a tenth apart.
void Walk(
  const Arc& arc, double length, double spacing, std::vector<AorticCourse::Station>& stations)
{
  const int steps = std::max(1, static_cast<int>(std::ceil(length / spacing - 1e-9)));
  constexpr int parts = 10;
  const double part = length / (steps * parts);
  for (int n = 1; n <= steps; ++n)
  {
    AorticCourse::Station next = stations.back();
    for (int m = 0; m < parts; ++m)
    {
      next.position += part * arc.Direction(((n - 1) * parts + m + 0.5) * part);
    }
    next.length = length * n / steps;
    next.direction = arc.Direction(next.length);
    stations.push_back(next);
  }
}
}

void AorticArchSettings::Validate() const
{
  Require(this->ascendingLength >= 0.0 && this->ascendingLength <= 200.0,
    "ascendingLength must be 0 to 200 mm");
  Require(!this->descending ||
      (this->descending->place.allFinite() &&
        std::abs(this->descending->direction.norm() - 1.0) < 1e-6 &&
        this->descending->direction[2] < -0.5),
    "descending needs a place and a direction downwards");
  Require(this->width >= 1.5 && this->width <= 5.0, "width must be 1.5 to 5 ascending diameters");
  Require(this->backward >= 0.0 && this->backward <= 90.0, "backward must be 0 to 90 degrees");
  Require(this->belowValve >= 0.0 && this->belowValve <= 300.0, "belowValve must be 0 to 300 mm");
  Require(this->spacing >= 0.1 && this->spacing <= 10.0, "spacing must be 0.1 to 10 mm");
}

double AorticArchTaper(double turned)
{
  // Before the innominate artery, proximal and distal arch, isthmus; where they are on the arc is chosen.
  struct Level
  {
    double turned;
    double diameter; ///< mm
  };
  constexpr std::array<Level, 5> levels{ { { 0.0, AscendingDiameter }, { 30.0, 29.4 },
    { 60.0, 27.7 }, { 110.0, 26.1 }, { 160.0, IsthmusDiameter } } };
  const double degrees = turned * 180.0 / Pi;
  for (std::size_t n = 1; n < levels.size(); ++n)
  {
    if (degrees < levels[n].turned)
    {
      const double part =
        std::max(0.0, degrees - levels[n - 1].turned) / (levels[n].turned - levels[n - 1].turned);
      return (levels[n - 1].diameter + part * (levels[n].diameter - levels[n - 1].diameter)) /
        AscendingDiameter;
    }
  }
  return IsthmusDiameter / AscendingDiameter;
}

AorticCourse CompleteAorta(const AorticEnd& end, const AorticArchSettings& settings)
{
  settings.Validate();
  Require(end.position.allFinite() && std::abs(end.direction.norm() - 1.0) < 1e-6,
    "the aorta's end needs a place and a direction");
  Require(end.radius > 0.0 && end.ascendingRadius > 0.0, "the aorta's end needs a radius");
  const std::optional<DescendingAorta>& given = settings.descending;
  const Vector3 up = given ? Vector3(-given->direction) : Vector3(Vector3::UnitZ());
  const double rise = end.direction.dot(up);
  Require(rise > -0.5, "the aorta's end points down");
  // The more it leans, the more of its way it has turned already.
  const double straight =
    std::max(0.0, settings.ascendingLength - end.length) * std::max(0.0, rise);
  // Its inner side must not fold.
  const double tightest = 1.3 * std::max(end.radius, end.ascendingRadius);
  const double widest = 2.0 * settings.width * end.ascendingRadius;

  Vector3 wanted;
  if (given)
  {
    wanted = Across(given->place - end.position, up);
    Require(wanted.norm() > 1.0, "the descending aorta is not beside the ascending one");
  }
  else
  {
    const double turn = settings.backward * Pi / 180.0;
    wanted = Vector3(std::cos(turn), std::sin(turn), 0.0);
    const double turned = AimAt(end, up, wanted).turned;
    const double radius = std::max(tightest, settings.width * end.ascendingRadius);
    wanted *= std::max(1.0, radius * (1.0 + std::cos(turned)) + straight * std::sin(turned));
  }
  AorticCourse course;
  Vector3 target = wanted;
  Arc arc;
  // What the leaning adds is taken off the aim; each round leaves a small share of it.
  for (int round = 0; round < 30; ++round)
  {
    arc = AimAt(end, up, target);
    arc.straight = straight;
    const double left = target.norm() - straight * std::sin(arc.turned);
    arc.radius = std::clamp(left / std::max(0.05, 1.0 + std::cos(arc.turned)), tightest, widest);
    course.stations.assign(1, { end.position, end.direction, end.radius, 0.0 });
    Walk(arc, straight + arc.Length(), settings.spacing, course.stations);
    const Vector3 miss = wanted - Across(course.stations.back().position - end.position, up);
    course.reached = miss.norm() < 1e-3;
    const Vector3 next = target + miss;
    if (miss.norm() < 1e-9 || !(next.norm() > 1.0) || !(next.dot(wanted) > 0.0))
    {
      break;
    }
    target = next;
  }
  course.ascending = straight;
  course.arch = arc.Length();
  const double turnedBy = straight + course.arch;
  const Vector3 bottom = course.stations.back().position;
  course.descending = std::max(0.0, bottom[2] - (end.valveHeight - settings.belowValve)) / up[2];
  const int steps = static_cast<int>(std::ceil(course.descending / settings.spacing - 1e-9));
  for (int n = 1; n <= steps; ++n)
  {
    const double down = course.descending * n / steps;
    course.stations.push_back({ bottom - down * up, -up, 0.0, turnedBy + down });
  }
  // From the patient's radius at the end to the scaled mean, slowly.
  const double own = end.radius - end.ascendingRadius * AorticArchTaper(arc.turned);
  const double blend = std::max(30.0, 40.0 * std::abs(own)); // mm
  for (AorticCourse::Station& station : course.stations)
  {
    const double down =
      course.descending > 0.0 ? std::max(0.0, station.length - turnedBy) / course.descending : 0.0;
    const double taper = AorticArchTaper(arc.Turned(station.length)) +
      down * (DiaphragmDiameter - IsthmusDiameter) / AscendingDiameter;
    station.radius = end.ascendingRadius * taper + own * (1.0 - CubicStep(station.length / blend));
  }
  return course;
}
}
