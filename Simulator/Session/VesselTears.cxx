#include "VesselTears.h"

#include "Fnv1a.h"
#include "LesionWatch.h"
#include "Numbers.h"
#include "WallMotion.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace coronary
{
namespace
{
constexpr double PascalPerMmHg = 133.322387415;
constexpr double LeastOpen = 0.5;     // atm: a balloon with less is not open
constexpr double OneTear = 5.0;       // mm of a vessel in which a balloon makes one
constexpr double OneHole = 3.0;       // mm, likewise of a wire's tip
constexpr double WithoutPlaque = 0.9; // of the reference: less is narrowed
constexpr double FlapEnd = 3.0;       // mm over which a flap ends
constexpr double LeastFlap = 0.2;     // of the diameter, where a wall just tears
constexpr double FlapGrowth = 3.0;    // for each part of stretch beyond
constexpr double GreatestFlap = 0.7;  // as the narrowest that is still called open
constexpr double FlapGivesWay = 0.1;  // mm about what lies in the lumen
constexpr double LeastHole = 0.5;     // mm, of a wall that just bursts
constexpr double HoleGrowth = 20.0;   // mm for each part of stretch beyond
constexpr double GreatestHole = 2.5;  // mm
constexpr double LeastLeak = 0.1;     // mL that are seen
constexpr double SpreadTime = 60.0;   // s in which medium goes from beside the vessel into the sac
constexpr double Pocket = 0.6;        // mm of half the wall's circle that a dissection fills
constexpr double StainTime = 1.5;     // s in which neat medium fills it
constexpr double SacPressure = 9.0 / 14.0; // mmHg, p1
constexpr double SacVolume = 57.65;        // mL, V1
constexpr double HalfStroke = 8.0;         // mmHg, at which half of the stroke volume is left
constexpr double Noticed = 1.0;            // mmHg after which the heart's supply is looked at again

std::string Where(const VesselTear& tear)
{
  char text[120];
  std::snprintf(
    text, sizeof(text), "It is in %s, %.1f mm from the ostium.", tear.vessel.c_str(), tear.place);
  return text;
}

bool HasStent(const Intervention& instruments, std::int64_t point)
{
  const DilatableWall* wall = instruments.Dilated();
  return wall && !wall->Rings(point).empty();
}

/// A balloon fills the lumen there.
bool IsCovered(const Intervention& instruments, std::int64_t point)
{
  if (!instruments.Balloon() || instruments.Report().balloon.pressure < LeastOpen)
  {
    return false;
  }
  const double inside = instruments.Dilated()->InsideRadius(point);
  const std::vector<std::pair<std::int64_t, double>>& sections = instruments.Balloon()->Sections();
  return std::any_of(sections.begin(), sections.end(),
    [&](const auto& section) { return section.first == point && section.second >= 0.99 * inside; });
}
}

double FreeStretch(double stretch, double calcium, const WallStrength& strength)
{
  const double stiff = std::clamp(calcium, 0.0, strength.stiffest);
  return stretch > 1.0 ? 1.0 + (stretch - 1.0) / (1.0 - stiff) : stretch;
}

double FlapOf(double stretch, const WallStrength& strength)
{
  return stretch > strength.dissection
    ? std::min(GreatestFlap, LeastFlap + FlapGrowth * (stretch - strength.dissection))
    : 0.0;
}

double HoleOf(double stretch, const WallStrength& strength)
{
  return stretch > strength.rupture
    ? std::min(GreatestHole, LeastHole + HoleGrowth * (stretch - strength.rupture))
    : 0.0;
}

double HoleConductance(double diameter)
{
  constexpr double density = 1060.0;                   // kg/m^3
  constexpr double reference = 80.0;                   // mmHg
  constexpr double contraction = 0.6;                  // of the jet behind a sharp edge
  const double area = 0.25 * Pi * diameter * diameter; // mm^2
  const double speed =
    std::sqrt(2.0 * reference * PascalPerMmHg / density); // m/s: mL/s through a mm^2
  return contraction * area * speed / reference;
}

double PunctureForce(const Guidewire& wire, const WallStrength& strength)
{
  const double radius = wire.sections.front().radius;
  return strength.puncture * Pi * radius * radius;
}

double Pericardium::Pressure() const
{
  return SacPressure * std::expm1(this->Volume_ / SacVolume);
}

double Pericardium::StrokeFactor() const
{
  return 1.0 / (1.0 + this->Pressure() / HalfStroke);
}

double Pericardium::PressureFactor() const
{
  return std::sqrt(this->StrokeFactor());
}

int VesselTear::Ellis() const
{
  return this->blood < LeastLeak ? 1 : this->diameter < 1.0 ? 2 : 3;
}

VesselTears::VesselTears(const FlowNetwork& network, double sealTime)
  : SealTime(sealTime)
  , Network(network)
{
}

int VesselTears::BranchOf(std::int64_t point) const
{
  const std::vector<FlowBranch>& branches = this->Network.Branches();
  const auto next = std::upper_bound(branches.begin(), branches.end(), point,
    [](std::int64_t value, const FlowBranch& branch) { return value < branch.firstPoint; });
  return static_cast<int>(next - branches.begin()) - 1;
}

double VesselTears::Along(std::int64_t point) const
{
  const FlowBranch& branch = this->Network.Branches()[this->BranchOf(point)];
  return branch.abscissa[point - branch.firstPoint];
}

bool VesselTears::HasPlaque(std::int64_t point) const
{
  const WallTopology& topology = this->Network.Topology();
  const int branch = this->BranchOf(point);
  const std::int64_t k = point - this->Network.Branches()[branch].firstPoint;
  return !topology.axisReference.empty() &&
    topology.axisRadius[branch][k] < WithoutPlaque * topology.axisReference[branch][k];
}

VesselTear VesselTears::At(std::int64_t point, VesselTear::Kind kind) const
{
  VesselTear tear;
  tear.kind = kind;
  tear.branch = this->BranchOf(point);
  tear.point = tear.first = tear.last = point;
  const WallTopology& topology = this->Network.Topology();
  const std::string& name = topology.groupName[tear.branch];
  tear.vessel = name.empty() ? "a vessel without a name" : name;
  const VesselWay way = WayThrough(topology, tear.branch);
  const auto at = std::find(way.points.begin(), way.points.end(), point);
  tear.place = at != way.points.end() ? way.place[at - way.points.begin()] : 0.0;
  return tear;
}

/// One of that kind that is so near on the same branch; null: none.
VesselTear* VesselTears::Near(std::int64_t point, VesselTear::Kind kind, double reach)
{
  for (VesselTear& tear : this->Tears)
  {
    const double along = this->Along(point);
    if (tear.kind == kind && tear.branch == this->BranchOf(point) &&
      along > this->Along(tear.first) - reach && along < this->Along(tear.last) + reach)
    {
      return &tear;
    }
  }
  return nullptr;
}

void VesselTears::Dissect(std::int64_t point, double stretch)
{
  const FlowBranch& branch = this->Network.Branches()[this->BranchOf(point)];
  const auto count = static_cast<std::int64_t>(branch.abscissa.size());
  if (this->Flaps.empty())
  {
    const FlowBranch& last = this->Network.Branches().back();
    this->Flaps.assign(static_cast<std::size_t>(last.firstPoint) + last.abscissa.size(), 0.0);
  }
  VesselTear* tear = this->Near(point, VesselTear::Kind::Dissection, OneTear);
  if (!tear)
  {
    this->Tears.push_back(this->At(point, VesselTear::Kind::Dissection));
    tear = &this->Tears.back();
  }
  tear->first = std::min(tear->first, point);
  tear->last = std::max(tear->last, point);
  const double flap = FlapOf(stretch, this->Strength);
  if (stretch > tear->stretch)
  {
    const VesselTear here = this->At(point, tear->kind);
    tear->stretch = stretch;
    tear->point = point;
    tear->place = here.place;
    tear->flap = flap;
  }
  for (std::int64_t k = 0; k < count; ++k)
  {
    const double away = std::abs(branch.abscissa[k] - this->Along(point));
    double& there = this->Flaps[branch.firstPoint + k];
    there = std::max(there, flap * std::max(0.0, 1.0 - away / FlapEnd));
  }
}

void VesselTears::Perforate(VesselTear tear, ContrastModel& medium)
{
  tear.node = medium.OpenHole({ tear.branch, this->Along(tear.point) });
  this->Tears.push_back(std::move(tear));
}

/// What a balloon does to the sections that it holds open.
void VesselTears::Stretch(const Intervention& instruments, ContrastModel& medium)
{
  const DilatableWall* wall = instruments.Dilated();
  // Calcium leaves no less than this to the rest.
  const double least = 1.0 + (this->Strength.dissection - 1.0) * (1.0 - this->Strength.stiffest);
  if (!wall || instruments.Report().balloon.stretch <= least)
  {
    return;
  }
  double greatest = 0.0;
  std::int64_t worst = -1;
  for (const auto& [point, radius] : instruments.Balloon()->Sections())
  {
    const WallStation& station = wall->Stations()[point];
    const double stretch =
      FreeStretch(wall->Radii()[point] / station.reference, station.calcium, this->Strength);
    if (stretch > this->Strength.dissection &&
      FlapOf(stretch, this->Strength) > (this->Flaps.empty() ? 0.0 : this->Flaps[point]))
    {
      this->Dissect(point, stretch);
    }
    if (stretch > greatest)
    {
      greatest = stretch;
      worst = point;
    }
  }
  const double hole = HoleOf(greatest, this->Strength);
  if (hole == 0.0)
  {
    return;
  }
  if (VesselTear* before = this->Near(worst, VesselTear::Kind::Perforation, OneTear))
  {
    before->stretch = std::max(before->stretch, greatest);
    if (hole > before->diameter)
    {
      before->diameter = hole;
      before->closed = 0.0;
      before->sealed = false;
    }
    return;
  }
  VesselTear tear = this->At(worst, VesselTear::Kind::Perforation);
  tear.stretch = greatest;
  tear.diameter = hole;
  this->Perforate(std::move(tear), medium);
}

/// The tip has pressed long enough: the hole is at the point of its vessel's axis next to it.
void VesselTears::Puncture(const Intervention& instruments, WallMotion& wall, ContrastModel& medium)
{
  const TickReport& report = instruments.Report();
  const std::vector<Vector3>& line = instruments.Centerline(report.hand);
  this->PressedFor = 0.0;
  this->Through = false;
  if (report.branch < 0 || line.empty())
  {
    return;
  }
  std::vector<Vector3> axis;
  wall.AxisPositions(report.phase, axis);
  const FlowBranch& branch = this->Network.Branches()[report.branch];
  std::int64_t point = branch.firstPoint;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < branch.abscissa.size(); ++k)
  {
    const std::int64_t candidate = branch.firstPoint + static_cast<std::int64_t>(k);
    const double away = (axis[candidate] - line.front()).squaredNorm();
    point = away < nearest ? candidate : point;
    nearest = std::min(nearest, away);
  }
  if (!this->HasPlaque(point) && !this->Near(point, VesselTear::Kind::Perforation, OneHole))
  {
    VesselTear tear = this->At(point, VesselTear::Kind::Perforation);
    tear.diameter = 2.0 * instruments.Wire(report.hand).sections.front().radius;
    this->Perforate(std::move(tear), medium);
  }
}

void VesselTears::Tell(
  double now, const Intervention& instruments, LesionWatch& watch, std::vector<std::string>& said)
{
  for (; this->Told < this->Tears.size(); ++this->Told)
  {
    const VesselTear& tear = this->Tears[this->Told];
    const bool dissected = tear.kind == VesselTear::Kind::Dissection;
    char text[240];
    if (tear.stretch > 0.0)
    {
      std::snprintf(text, sizeof(text),
        "The wall is %s: the balloon '%s' has stretched it to %.2f of its reference diameter. ",
        dissected ? "dissected" : "perforated", instruments.Balloon()->Device().name.c_str(),
        tear.stretch);
    }
    else
    {
      std::snprintf(text, sizeof(text), "The wall is perforated by the tip of the wire '%s'. ",
        instruments.Wire(instruments.Report().hand).name.c_str());
    }
    const double value = dissected ? tear.flap : tear.diameter;
    watch.Note({ dissected ? ProcedureEvent::Kind::Dissection : ProcedureEvent::Kind::Perforation,
                 now, tear.branch, value, tear.place },
      text + Where(tear), said);
  }
}

void VesselTears::Bleed(VesselTear& hole, double step, const Intervention& instruments,
  ContrastModel& medium, LesionWatch& watch, std::vector<std::string>& said)
{
  const bool before = hole.covered;
  hole.flow = medium.LeakFlow(hole.node);
  hole.blood += step * hole.flow;
  this->Sac_.Fill(step * hole.flow);
  hole.beside = medium.Leaked(hole.node) - hole.spread;
  const double goes = -std::expm1(-step / SpreadTime) * hole.beside;
  hole.spread += goes;
  hole.beside -= goes;
  hole.covered = IsCovered(instruments, hole.point);
  hole.closed = std::min(1.0, hole.closed + (hole.covered ? step / this->SealTime : 0.0));
  medium.SetHole(hole.node,
    hole.covered ? 0.0 : (1.0 - hole.closed) * HoleConductance(hole.diameter),
    this->Sac_.Pressure());
  if (hole.closed == 1.0 && !hole.sealed)
  {
    hole.sealed = true;
    said.push_back("The hole in the wall has closed. " + Where(hole));
  }
  if (hole.covered != before)
  {
    watch.Renew();
    if (hole.blood > 0.0 && !hole.sealed)
    {
      said.push_back((hole.covered ? "The balloon across the hole stops the leak. "
                                   : "Blood leaks from the hole again. ") +
        Where(hole));
    }
  }
}

void VesselTears::Stain(VesselTear& tear, double step, const Intervention& instruments,
  ContrastModel& medium, LesionWatch& watch, std::vector<std::string>& said)
{
  bool whole = true;
  for (std::int64_t point = tear.first; point <= tear.last; ++point)
  {
    const bool stented = HasStent(instruments, point);
    this->Flaps[point] = stented ? 0.0 : this->Flaps[point];
    whole = whole && stented;
  }
  if (whole && !tear.sealed)
  {
    said.push_back("A stent holds the dissected wall. " + Where(tear));
    const FlowBranch& branch = this->Network.Branches()[tear.branch];
    for (std::size_t k = 0; k < branch.abscissa.size(); ++k)
    {
      // What runs out of it is closed, too.
      const bool end = branch.abscissa[k] > this->Along(tear.first) - FlapEnd &&
        branch.abscissa[k] < this->Along(tear.last) + FlapEnd;
      double& flap = this->Flaps[branch.firstPoint + static_cast<std::int64_t>(k)];
      flap = end ? 0.0 : flap;
    }
    watch.Renew();
  }
  tear.sealed = whole;
  if (whole || medium.NumberOfTracers() == 0)
  {
    return;
  }
  // It fills with what is in the lumen beside it, as far as there is room.
  const double from = this->Along(tear.first);
  const double to = this->Along(tear.last);
  const double radius = this->Network.RadiusAt(tear.branch, this->Along(tear.point));
  const double room = 1e-3 * Pocket * Pi * radius * std::max(to - from, FlapEnd);
  const double lumen = 1e-3 * Pi * radius * radius * std::max(to - from, FlapEnd);
  const double part = room / lumen * step / StainTime * std::max(0.0, 1.0 - tear.inWall / room);
  tear.inWall += medium.Absorb(tear.branch, from - 0.5 * FlapEnd, to + 0.5 * FlapEnd, part);
}

void VesselTears::SetHeart(
  double now, ContrastModel& medium, LesionWatch& watch, std::vector<std::string>& said)
{
  const double pressure = this->Sac_.Pressure();
  if (pressure == 0.0)
  {
    return;
  }
  medium.SetHeart(this->Sac_.StrokeFactor(), this->Sac_.PressureFactor());
  if (pressure > this->LastPressure + Noticed)
  {
    this->LastPressure = pressure;
    watch.Renew();
  }
  if (pressure >= Pericardium::Tamponade && !this->ToldTamponade)
  {
    this->ToldTamponade = true;
    char text[200];
    std::snprintf(text, sizeof(text),
      "Tamponade: %.0f mL of blood press on the heart with %.0f mmHg; it ejects %.0f %% of before.",
      this->Sac_.Volume(), pressure, 100.0 * this->Sac_.StrokeFactor());
    watch.Note({ ProcedureEvent::Kind::Tamponade, now, -1, pressure, 0.0 }, text, said);
  }
}

void VesselTears::Step(double step, double now, const Intervention& instruments, WallMotion& wall,
  ContrastModel& medium, LesionWatch& watch, std::vector<std::string>& said)
{
  this->Stretch(instruments, medium);
  if (this->Through)
  {
    this->Puncture(instruments, wall, medium);
  }
  this->Tell(now, instruments, watch, said);
  for (VesselTear& tear : this->Tears)
  {
    if (tear.kind == VesselTear::Kind::Perforation)
    {
      this->Bleed(tear, step, instruments, medium, watch, said);
    }
    else
    {
      this->Stain(tear, step, instruments, medium, watch, said);
    }
  }
  this->SetHeart(now, medium, watch, said);
}

std::int64_t VesselTears::OpenHoles() const
{
  return std::count_if(this->Tears.begin(), this->Tears.end(),
    [](const VesselTear& tear)
    { return tear.kind == VesselTear::Kind::Perforation && !tear.sealed; });
}

void VesselTears::Apply(std::vector<double>& lumen, const std::vector<double>& filled) const
{
  for (std::size_t k = 0; k < this->Flaps.size(); ++k)
  {
    const double left = (1.0 - this->Flaps[k]) * lumen[k];
    lumen[k] = filled[k] > 0.0 ? std::clamp(filled[k] + FlapGivesWay, left, lumen[k]) : left;
  }
}

std::uint64_t VesselTears::Hash(std::uint64_t hash) const
{
  hash = Fnv1a(this->Flaps.data(), this->Flaps.size() * sizeof(double), hash);
  for (const VesselTear& tear : this->Tears)
  {
    for (const double value : { tear.diameter, tear.closed, tear.blood, tear.spread, tear.inWall })
    {
      hash = Fnv1a(&value, sizeof(value), hash);
    }
  }
  const double volume = this->Sac_.Volume();
  return Fnv1a(&volume, sizeof(volume), hash);
}
}
