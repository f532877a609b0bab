#include "DilatableWall.h"

#include "Fnv1a.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
WallStation MakeWallStation(
  double rest, double reference, double calcium, const DilationSettings& settings)
{
  WallStation station;
  station.rest = rest;
  station.reference = std::max(rest, reference);
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
  const double opening = (radius - station.rest) / station.reference;
  const double elastic = station.stiffness * (opening - station.plastic);
  if (station.stiffness == 0.0 || elastic <= station.yield + station.hardening * station.plastic)
  {
    return station.plastic;
  }
  return (station.stiffness * opening - station.yield) / (station.stiffness + station.hardening);
}

double WallPressure(const WallStation& station, double radius, const DilationSettings& settings)
{
  const double opening = (radius - station.rest) / station.reference;
  const double plaque = station.stiffness * (opening - PlasticOpening(station, radius));
  const double stretch = radius / station.reference - 1.0;
  return plaque +
    (stretch > 0.0 ? settings.meanPressure * std::expm1(settings.wallStiffening * stretch) : 0.0);
}

double NaturalRadius(const WallStation& station, const DilationSettings& settings)
{
  double high = station.rest + station.plastic * station.reference;
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

void DilatableWall::Release()
{
  for (const std::int64_t point : this->Moved)
  {
    const WallStation& station = this->Stations_[point];
    this->Radii_[point] = NaturalRadius(station, this->Settings_);
    this->Ratio[point] = this->Radii_[point] / station.rest;
  }
}

void DilatableWall::Hold(std::int64_t point, double radius)
{
  WallStation& station = this->Stations_[point];
  station.plastic = PlasticOpening(station, radius);
  this->Radii_[point] = radius;
  this->Ratio[point] = radius / station.rest;
  const auto place = std::lower_bound(this->Moved.begin(), this->Moved.end(), point);
  if (place == this->Moved.end() || *place != point)
  {
    this->Moved.insert(place, point);
  }
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
  }
  return hash;
}
}
