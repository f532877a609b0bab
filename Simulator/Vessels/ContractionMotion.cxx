#include "ContractionMotion.h"

#include "CyclicTime.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double MinimumHeight = 20.0; // mm
constexpr int SpeedSteps = 200;

// Fractions of R-R of the curve's parts; systole is a setting.
constexpr double Onset = 0.02;
constexpr double EarlyFilling = 0.25; // duration, from just after systole on
constexpr double AtrialStart = 0.84;
constexpr double AtrialEnd = 0.98;
constexpr double Diastasis = 0.2; // share of the contraction that is left for the atria

void Require(double value, double low, double high, const char* name)
{
  if (!(value >= low && value <= high))
  {
    char text[160];
    std::snprintf(
      text, sizeof(text), "Contraction: %s is %g, not within %g to %g.", name, value, low, high);
    throw std::invalid_argument(text);
  }
}

/// 0 to 1 between two moments, with two derivatives that are 0 at both.
double Step(double t, double from, double to)
{
  const double x = std::clamp((t - from) / (to - from), 0.0, 1.0);
  return x * x * x * (10.0 + x * (6.0 * x - 15.0));
}
}

void ContractionSettings::Validate() const
{
  Require(this->axial, 0.0, 25.0, "axial_mm");
  Require(this->radial, 0.0, 0.3, "radial");
  Require(this->twist, -0.5, 0.5, "twist (rad)");
  Require(this->systole, 0.2, 0.5, "systole");
  Require(this->peakSpeed, 1.0, 300.0, "peak_speed_mm_s");
  Require(this->cycleLength, 0.25, 3.0, "cycle length (s)");
  for (int axis = 0; axis < 3; ++axis)
  {
    Require(this->base[axis], -1e5, 1e5, "base_mm");
    Require(this->apex[axis], -1e5, 1e5, "apex_mm");
  }
}

double ContractionCurve(double phase, double systole)
{
  const double t = Modulo(phase);
  const double filled = systole + EarlyFilling;
  return Step(t, Onset, systole) - (1.0 - Diastasis) * Step(t, systole, filled) -
    Diastasis * Step(t, AtrialStart, AtrialEnd);
}

ContractionMotion::ContractionMotion(
  std::shared_ptr<WallMotion> rest, const ContractionSettings& settings)
  : Rest(std::move(rest))
  , Used(settings)
{
  this->Used.Validate();
  std::vector<Vector3> wall;
  std::vector<Vector3> line;
  this->Rest->Positions(0.0, wall);
  this->Rest->AxisPositions(0.0, line);
  if (this->Used.base == this->Used.apex)
  {
    const WallTopology& topology = this->Rest->Topology();
    Vector3 sum = Vector3::Zero();
    int roots = 0;
    std::size_t first = 0;
    for (std::size_t n = 0; n < topology.axis.size(); ++n)
    {
      if (!topology.axis[n].empty() && (n >= topology.parent.size() || topology.parent[n] < 0))
      {
        sum += line.at(first);
        ++roots;
      }
      first += topology.axis[n].size();
    }
    if (roots == 0)
    {
      throw std::invalid_argument(
        "Contraction: the vessels have no axis to tell base and apex by.");
    }
    this->Used.base = sum / roots;
    this->Used.apex = *std::max_element(line.begin(), line.end(),
      [&](const Vector3& a, const Vector3& b)
      { return (a - this->Used.base).squaredNorm() < (b - this->Used.base).squaredNorm(); });
  }
  this->Height = (this->Used.apex - this->Used.base).norm();
  if (!(this->Height >= MinimumHeight))
  {
    char text[120];
    std::snprintf(text, sizeof(text),
      "Contraction: base and apex are %.3g mm apart, less than %g mm.", this->Height,
      MinimumHeight);
    throw std::invalid_argument(text);
  }
  this->Axis = (this->Used.apex - this->Used.base) / this->Height;
  this->Wall = this->PlacesOf(wall);
  this->Line = this->PlacesOf(line);

  // Speed is nearly proportional to the amplitudes; what twist makes of it is settled by going on.
  this->Peak = this->MaximumSpeed();
  while (this->Peak > this->Used.peakSpeed)
  {
    const double share = 0.9999 * this->Used.peakSpeed / this->Peak;
    this->Used.axial *= share;
    this->Used.radial *= share;
    this->Used.twist *= share;
    this->Peak = this->MaximumSpeed();
  }
}

std::vector<ContractionMotion::Place> ContractionMotion::PlacesOf(
  const std::vector<Vector3>& points) const
{
  std::vector<Place> places;
  places.reserve(points.size());
  for (const Vector3& point : points)
  {
    const Vector3 from = point - this->Used.base;
    const double height = from.dot(this->Axis);
    places.push_back({ height, from - height * this->Axis });
  }
  return places;
}

void ContractionMotion::Move(
  const std::vector<Place>& places, double phase, std::vector<Vector3>& positions) const
{
  const double share = ContractionCurve(phase, this->Used.systole);
  const double nearer = 1.0 - this->Used.radial * share;
  positions.resize(places.size());
  for (std::size_t n = 0; n < places.size(); ++n)
  {
    const Place& place = places[n];
    // 1 at the base and above, 0 at the apex and below.
    const double basal = 1.0 - Step(place.height / this->Height, 0.0, 1.0);
    const double angle = this->Used.twist * share * basal;
    const Vector3 turned =
      std::cos(angle) * place.across + std::sin(angle) * this->Axis.cross(place.across);
    positions[n] = this->Used.base +
      (place.height + this->Used.axial * share * basal) * this->Axis + nearer * turned;
  }
}

double ContractionMotion::MaximumSpeed() const
{
  // A sample of the points is enough: the field is smooth.
  std::vector<Place> places = this->Line;
  const std::size_t stride = std::max<std::size_t>(1, this->Wall.size() / 2000);
  for (std::size_t n = 0; n < this->Wall.size(); n += stride)
  {
    places.push_back(this->Wall[n]);
  }
  std::vector<Vector3> before;
  std::vector<Vector3> now;
  double maximum = 0.0;
  this->Move(places, 0.0, before);
  for (int k = 1; k <= SpeedSteps; ++k)
  {
    this->Move(places, static_cast<double>(k) / SpeedSteps, now);
    for (std::size_t n = 0; n < now.size(); ++n)
    {
      maximum = std::max(maximum, (now[n] - before[n]).squaredNorm());
    }
    now.swap(before);
  }
  return std::sqrt(maximum) * SpeedSteps / this->Used.cycleLength;
}

void ContractionMotion::Positions(double phase, std::vector<Vector3>& positions)
{
  this->Move(this->Wall, phase, positions);
}

void ContractionMotion::AxisPositions(double phase, std::vector<Vector3>& positions)
{
  this->Move(this->Line, phase, positions);
}
}
