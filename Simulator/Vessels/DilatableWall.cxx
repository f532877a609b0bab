#include "DilatableWall.h"

#include "Fnv1a.h"
#include "RisingRoot.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
/// Of the reference radius, from where it is without plaque's yielding.
double OpeningOf(const WallStation& station, double radius)
{
  return (radius - station.rest) / station.reference + station.pinched;
}
}

WallStation MakeWallStation(
  double rest, double reference, double calcium, const DilationSettings& settings)
{
  WallStation station;
  station.rest = rest;
  station.reference = std::max(rest, reference);
  station.calcium = calcium;
  const double burden = 1.0 - rest / station.reference;
  const double share = std::min(1.0, burden / settings.wholePlaque);
  const auto mixed = [&](double soft, double hard)
  { return share * ((1.0 - calcium) * soft + calcium * hard); };
  station.stiffness = mixed(settings.plaqueStiffness, settings.calciumStiffness);
  station.yield = mixed(settings.plaqueYield, settings.calciumYield);
  station.hardening = station.stiffness * settings.elasticShare / (1.0 - settings.elasticShare);
  return station;
}

double PlasticOpening(const WallStation& station, double radius)
{
  const double opening = OpeningOf(station, radius);
  const double elastic = station.stiffness * (opening - station.plastic);
  if (station.stiffness == 0.0 || elastic <= station.yield + station.hardening * station.plastic)
  {
    return station.plastic;
  }
  return (station.stiffness * opening - station.yield) / (station.stiffness + station.hardening);
}

double WallPressure(const WallStation& station, double radius, const DilationSettings& settings)
{
  const double opening = OpeningOf(station, radius);
  double plaque = station.stiffness * (opening - PlasticOpening(station, radius));
  if (station.stented >= 0 && opening > station.plastic && opening < station.held)
  {
    const double most = station.held - station.plastic;
    const double c = settings.heldStiffening;
    plaque =
      station.stiffness * most * std::expm1(c * (opening - station.plastic) / most) / std::expm1(c);
  }
  const double stretch = radius / station.reference - 1.0;
  return plaque +
    (stretch > 0.0 ? settings.meanPressure * std::expm1(settings.wallStiffening * stretch) : 0.0);
}

double NaturalRadius(const WallStation& station, const DilationSettings& settings)
{
  double high = station.rest + (station.plastic - station.pinched) * station.reference;
  if (high <= station.reference)
  {
    return high;
  }
  // Plaque that was opened beyond the vessel's own calibre is pressed by its wall.
  double low = station.reference;
  for (int k = 0; k < 60; ++k)
  {
    const double middle = 0.5 * (low + high);
    (WallPressure(station, middle, settings) > 0.0 ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

DilatableWall::DilatableWall(const WallTopology& topology, const std::vector<Vector3>& points,
  const std::vector<Vector3>& axis, const DilationSettings& settings)
  : Settings_(settings)
  , Sections(topology, points, axis)
{
  const std::vector<std::vector<double>> reference = ReferenceRadii(topology);
  for (std::size_t b = 0; b < topology.axisRadius.size(); ++b)
  {
    for (std::size_t k = 0; k < topology.axisRadius[b].size(); ++k)
    {
      const double calcium =
        topology.axisCalcium.empty() ? 0.0 : topology.axisCalcium[b][k] / 360.0;
      this->Radii_.push_back(topology.axisRadius[b][k]);
      this->Stations_.push_back(
        MakeWallStation(topology.axisRadius[b][k], reference[b][k], calcium, settings));
    }
  }
  this->Ratio.assign(this->Radii_.size(), 1.0);
}

void DilatableWall::Remember(std::int64_t point)
{
  const auto place = std::lower_bound(this->Moved.begin(), this->Moved.end(), point);
  if (place == this->Moved.end() || *place != point)
  {
    this->Moved.insert(place, point);
  }
}

void DilatableWall::SetRadius(std::int64_t point, double radius)
{
  this->Radii_[point] = radius;
  this->Ratio[point] = radius / this->Stations_[point].rest;
}

void DilatableWall::Place(std::int64_t point, const StentRing& ring)
{
  WallStation& station = this->Stations_[point];
  if (station.stented < 0)
  {
    station.stented = static_cast<std::int32_t>(this->Stented_.size());
    station.held = OpeningOf(station, this->Radii_[point]);
    this->Stented_.emplace_back();
  }
  Stented& stented = this->Stented_[station.stented];
  stented.rings.push_back(ring);
  stented.coming = Coming::Back;
  this->Remember(point);
  this->ReleaseRing(point, stented.rings.size(), false);
}

const std::vector<StentRing>& DilatableWall::Rings(std::int64_t point) const
{
  static const std::vector<StentRing> none;
  const std::int32_t stented = this->Stations_[point].stented;
  return stented >= 0 ? this->Stented_[stented].rings : none;
}

double DilatableWall::InsideRadius(std::int64_t point) const
{
  const std::int32_t stented = this->Stations_[point].stented;
  return stented >= 0 ? this->Stented_[stented].rings.back().radius : this->Radii_[point];
}

double DilatableWall::Gap(std::int64_t point) const
{
  const std::int32_t stented = this->Stations_[point].stented;
  if (stented < 0)
  {
    return 0.0;
  }
  constexpr double Rounding = 1e-9; // mm
  const StentRing& outer = this->Stented_[stented].rings.front();
  const double gap = this->Radii_[point] - outer.radius - outer.thickness;
  return gap > Rounding ? gap : 0.0;
}

/// Of the wall and so many rings from it; 0 where nothing presses back.
double DilatableWall::Resistance(
  const WallStation& station, const Stented& stented, std::size_t rings, double radius) const
{
  if (rings == 0)
  {
    return std::max(0.0, WallPressure(station, radius, this->Settings_));
  }
  const StentRing& ring = stented.rings[rings - 1];
  return std::max(0.0,
    RingPressure(ring, radius) +
      this->Resistance(station, stented, rings - 1, radius + ring.thickness));
}

double DilatableWall::Resistance(std::int64_t point, double radius) const
{
  const WallStation& station = this->Stations_[point];
  if (station.stented < 0)
  {
    return std::max(0.0, WallPressure(station, radius, this->Settings_));
  }
  const Stented& stented = this->Stented_[station.stented];
  return this->Resistance(station, stented, stented.rings.size(), radius);
}

/// So many rings from the wall, the innermost of them held; 0: the wall is.
void DilatableWall::HoldRing(std::int64_t point, std::size_t rings, double radius, bool flows)
{
  WallStation& station = this->Stations_[point];
  if (rings == 0)
  {
    station.plastic = PlasticOpening(station, radius);
    if (station.stented >= 0)
    {
      station.held = std::max(station.held, OpeningOf(station, radius));
    }
    this->SetRadius(point, radius);
    return;
  }
  Stented& stented = this->Stented_[station.stented];
  StentRing& ring = stented.rings[rings - 1];
  ring.radius = radius;
  if (flows)
  {
    ring.natural = RingNatural(ring, radius);
    ring.widest = std::max(ring.widest, ring.natural);
  }
  const double outside = radius + ring.thickness;
  if (this->Resistance(station, stented, rings - 1, outside) > 0.0)
  {
    this->HoldRing(point, rings - 1, outside, flows);
  }
  else
  {
    this->ReleaseRing(point, rings - 1, flows);
  }
}

void DilatableWall::ReleaseRing(std::int64_t point, std::size_t rings, bool flows)
{
  const WallStation& station = this->Stations_[point];
  if (rings == 0)
  {
    this->SetRadius(point, NaturalRadius(station, this->Settings_));
    return;
  }
  const Stented& stented = this->Stented_[station.stented];
  const StentRing& ring = stented.rings[rings - 1];
  // It stands where what presses it from outside is what it bears.
  const double radius = RisingRoot(
    [&](double at)
    {
      return RingPressure(ring, at) +
        this->Resistance(station, stented, rings - 1, at + ring.thickness);
    },
    0.5 * ring.crimped, ring.natural, 1e-12);
  this->HoldRing(point, rings, radius, flows);
}

void DilatableWall::Pinch(std::int64_t point, double part, double least)
{
  WallStation& station = this->Stations_[point];
  if (station.stented >= 0)
  {
    return; // its ring holds it
  }
  const double free = station.rest + station.plastic * station.reference;
  const double left = std::max(std::min(free, least), (1.0 - part) * free);
  station.pinched = (free - left) / station.reference;
  if (station.pinched > 0.0)
  {
    // What was shifted yields as plaque of that much does.
    const WallStation shifted = MakeWallStation(left, station.reference, 0.0, this->Settings_);
    station.stiffness = std::max(station.stiffness, shifted.stiffness);
    station.yield = std::max(station.yield, shifted.yield);
    station.hardening = std::max(station.hardening, shifted.hardening);
  }
  this->Remember(point);
  this->SetRadius(point, NaturalRadius(station, this->Settings_));
}

void DilatableWall::Release()
{
  for (const std::int64_t point : this->Moved)
  {
    const WallStation& station = this->Stations_[point];
    if (station.stented < 0)
    {
      this->SetRadius(point, NaturalRadius(station, this->Settings_));
      continue;
    }
    // While a balloon holds them nothing flows inwards, though for a moment they are released here.
    Stented& stented = this->Stented_[station.stented];
    if (stented.coming != Coming::Stays)
    {
      const bool flows = stented.coming == Coming::Back;
      this->ReleaseRing(point, stented.rings.size(), flows);
      stented.coming = flows ? Coming::Stays : Coming::Back;
    }
  }
}

void DilatableWall::Hold(std::int64_t point, double radius)
{
  const std::int32_t number = this->Stations_[point].stented;
  std::size_t rings = 0;
  if (number >= 0)
  {
    Stented& stented = this->Stented_[number];
    stented.coming = Coming::Held;
    rings = stented.rings.size();
  }
  this->HoldRing(point, rings, radius, true);
  this->Remember(point);
}

void DilatableWall::Deform(const std::vector<Vector3>& axis, std::vector<Vector3>& points) const
{
  if (!this->Moved.empty())
  {
    this->Sections.Scale(this->Ratio, axis, points);
  }
}

std::uint64_t DilatableWall::Hash(std::uint64_t hash) const
{
  for (const std::int64_t point : this->Moved)
  {
    hash = Fnv1a(&this->Radii_[point], sizeof(double), hash);
    hash = Fnv1a(&this->Stations_[point].plastic, sizeof(double), hash);
    for (const StentRing& ring : this->Rings(point))
    {
      hash = Fnv1a(&ring.natural, sizeof(double), hash);
      hash = Fnv1a(&ring.radius, sizeof(double), hash);
    }
  }
  return hash;
}
}
