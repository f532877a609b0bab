#include "BalloonOnWire.h"

#include "Fnv1a.h"
#include "Numbers.h"
#include "RisingRoot.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double BeforeBalloon = 3.0; // mm of the wire before the sleeve's tip at least
/// The first segment is bare, so that it is the wire's tip that meets an occlusion.
constexpr double BeforeMicrocatheter = 0.5; // mm, likewise
constexpr double FrictionGives = 0.05;      // mm after which the sleeve slides on the wire
constexpr double TipBlend = 1.0;            // mm on which the wire's radius becomes the tip's
// The wall takes an opened balloon's shape, and the rod's contacts do not know: for them it is thinner.
constexpr double FeltOpening = 0.75;
constexpr double Slack = 0.05;      // mm, likewise of what is folded: it holds narrow vessels open
constexpr double MostCarried = 2.0; // mm in a key frame, by the wall that holds it
constexpr double MegapascalPerAtm = 0.101325;
constexpr double HighestPressure = 60.0; // atm
}

RodJoint SleevedJoint(const RodJoint& wire, double stiffness)
{
  RodJoint joint = wire;
  for (int axis = 0; axis < 2; ++axis)
  {
    joint.angularStiffness[axis] += stiffness;
    joint.restAngle[axis] *= wire.angularStiffness[axis] / joint.angularStiffness[axis];
  }
  return joint;
}

RodJoint EnteredJoint(const RodJoint& wire, double stiffness, double part)
{
  const RodJoint within = SleevedJoint(wire, stiffness);
  RodJoint joint = wire;
  for (int axis = 0; axis < 2; ++axis)
  {
    joint.angularStiffness[axis] =
      1.0 / ((1.0 - part) / wire.angularStiffness[axis] + part / within.angularStiffness[axis]);
    joint.restAngle[axis] = (1.0 - part) * wire.restAngle[axis] + part * within.restAngle[axis];
  }
  return joint;
}

BalloonOnWire::BalloonOnWire(
  const BalloonCatheter& balloon, const GuideCatheter& guide, double start)
  : System(balloon)
  , Balloon(balloon.WithoutStent())
  , Guide(guide)
  , Start(start)
  , Place(start)
  , HandPlace(start)
{
  this->Report_.crimped = balloon.stent.has_value();
  this->Report_.microcatheter = balloon.IsMicrocatheter();
  const auto count = static_cast<std::size_t>(std::ceil(balloon.Reach() / Spacing)) + 2;
  for (std::size_t n = 0; n < count; ++n)
  {
    this->OuterNext.push_back(this->FoldedAt(static_cast<double>(n) * Spacing));
  }
  this->OuterNow = this->OuterNext;
  this->Report_.least = this->Report_.greatest =
    2.0 * (balloon.IsMicrocatheter() ? balloon.Profile() : balloon.crossingRadius);
  if (balloon.stent)
  {
    // Where the first ring flows.
    const StentRing ring = balloon.stent->CrimpedRing();
    const double yields = ring.crimped + ring.opening / ring.stiffness;
    this->Opens = ring.opening +
      RisingRoot(
        [&](double p) { return this->Balloon.FreeRadius(p) - yields; }, 0.0, HighestPressure, 1e-9);
    this->Report_.least = this->Report_.greatest = 2.0 * balloon.stent->crimpedRadius;
  }
}

/// The even part of its stent is around it.
bool BalloonOnWire::Crimped(double behind) const
{
  return this->Report_.crimped &&
    std::abs(behind - this->Balloon.Middle()) <= 0.5 * this->System.stent->CrimpedLength();
}

double BalloonOnWire::WireAhead() const
{
  return this->Balloon.IsMicrocatheter() ? BeforeMicrocatheter : BeforeBalloon;
}

double BalloonOnWire::RadiusAt(double behind) const
{
  if (this->Balloon.IsMicrocatheter())
  {
    return this->Balloon.FoldedRadius(behind);
  }
  const double place = behind / Spacing;
  const auto n = static_cast<std::size_t>(std::max(0.0, place));
  if (n + 1 >= this->OuterNow.size())
  {
    return this->Balloon.shaftRadius;
  }
  const double t = place - static_cast<double>(n);
  const auto at = [&](std::size_t k)
  { return this->OuterNow[k] + this->Share * (this->OuterNext[k] - this->OuterNow[k]); };
  return at(n) + t * (at(n + 1) - at(n));
}

bool BalloonOnWire::Opened(double behind) const
{
  constexpr double Some = 0.02; // mm
  return this->Covers(behind) && this->RadiusAt(behind) > this->FoldedAt(behind) + Some;
}

bool BalloonOnWire::Drive(double way, double most, const Rail& rail, double share, CosseratRod& rod)
{
  // A balloon that the wall holds goes with it, along the wire.
  this->Place += this->Carry * (share - std::min(share, this->Share));
  this->Share = share;
  const double inflated =
    this->Pressure > 0.0 ? std::clamp(this->Pressure / this->Balloon.ratedPressure, 0.0, 1.0) : 0.0;
  const double onWire = this->Balloon.wireFriction + inflated * this->Balloon.inflatedFriction;
  const double resist = onWire + this->Rubbing + this->Report_.grip;
  const double stiffness = this->Balloon.pushStiffness;
  this->HandPlace += way;
  const double pull = stiffness * (this->HandPlace - this->Place);
  if (std::abs(pull) > resist)
  {
    const double wanted = this->HandPlace - std::copysign(resist / stiffness, pull);
    const double slid = std::clamp(wanted - this->Place, -most, most);
    this->Place += slid;
    this->Slid += slid;
  }
  const double furthest = rail.fed - this->WireAhead();
  // A wire that stops at a microcatheter's tip does not push it.
  const double rounding = this->Balloon.IsMicrocatheter() ? 1e-9 : 0.0;
  const bool free = this->Place <= furthest + rounding && this->Place >= this->Start;
  this->Place = std::clamp(this->Place, std::min(this->Start, furthest), furthest);
  if (!free)
  {
    this->HandPlace = std::clamp(
      this->HandPlace, this->Place - resist / stiffness, this->Place + resist / stiffness);
  }
  this->Report_.force = stiffness * (this->HandPlace - this->Place);
  this->Report_.tip = this->Place - rail.catheterTip;

  // Sleeve and wire rub on each other.
  const double onWireNow = this->Place - rail.fed;
  const double slip = this->Begun ? onWireNow - this->LastOnWire : 0.0;
  this->LastOnWire = onWireNow;
  this->Begun = true;
  this->Strain = std::clamp(this->Strain + slip, -FrictionGives, FrictionGives);
  const double before = rail.fed - this->Place; // mm of the wire before the sleeve
  std::int64_t covered = 0;
  for (std::int64_t i = 0; i < rod.Size(); ++i)
  {
    covered += this->Covers((*rail.places)[i] - before) ? 1 : 0;
  }
  const double drag =
    covered > 0 ? onWire * this->Strain / FrictionGives / static_cast<double>(covered) : 0.0;
  for (std::int64_t i = 0; i < rod.Size(); ++i)
  {
    const double behind = (*rail.places)[i] - before;
    const bool here = this->Covers(behind);
    const double bare = (*rail.segments)[i].radius;
    const double blend = std::min(1.0, behind / TipBlend);
    const double folded = this->FoldedAt(behind);
    const double outside =
      folded - Slack + FeltOpening * std::max(0.0, this->RadiusAt(behind) - folded);
    rod.SetRadius(i, here ? bare + blend * std::max(0.0, outside - bare) : bare);
    rod.SetForce(i, here ? Vector3(-drag * rod.Axis(i)) : Vector3(Vector3::Zero()));
    if (i == 0)
    {
      continue;
    }
    const RodJoint& joint = (*rail.joints)[i];
    const double apart = (*rail.places)[i] - (*rail.places)[i - 1];
    const double part =
      std::clamp(behind / apart, 0.0, 1.0); // so a tip that passes changes nothing at once
    const double middle = behind - 0.5 * part * apart;
    const double bending = part > 0.0 && middle <= this->Balloon.monorail
      ? this->Balloon.BendingStiffness(middle, this->Pressure, this->RadiusAt(middle))
      : 0.0;
    rod.Joint(i - 1) = bending <= 0.0   ? joint
      : this->Balloon.IsMicrocatheter() ? EnteredJoint(joint, bending / apart, part)
                                        : SleevedJoint(joint, part * bending / apart);
  }
  return free;
}

void BalloonOnWire::Feel(const CosseratRod& rod, const Rail& rail)
{
  double sum = 0.0;
  const double before = rail.fed - this->Place;
  for (const RodContact& contact : rod.Contacts())
  {
    sum += this->Covers((*rail.places)[contact.segment] - before) ? contact.force : 0.0;
  }
  this->Rubbing = this->Balloon.friction * sum;
}

double BalloonOnWire::BalloonRadius(const Section& section, double pressure) const
{
  return section.crimped ? section.folded
                         : section.folded +
      section.shape * (this->Balloon.FreeRadius(pressure) - this->Balloon.crossingRadius);
}

void BalloonOnWire::Balance(Section& section, double pressure, const DilatableWall& wall) const
{
  const double free = this->BalloonRadius(section, pressure);
  if (section.point < 0)
  {
    section.balloon = std::min(free, std::max(section.folded, this->Guide.innerRadius));
    section.radius = section.rest;
    return;
  }
  const auto pressed = [&](double radius) { return wall.Resistance(section.point, radius); };
  // What is folded is rigid: where it does not fit, it opens the wall.
  const double least = std::max(section.rest, section.folded);
  section.radius = least;
  section.balloon = std::max(section.folded, std::min(free, least));
  section.pressed = section.folded > section.rest ? pressed(section.folded) : 0.0;
  if (free > least)
  {
    section.radius = RisingRoot([&](double radius)
      { return radius - this->BalloonRadius(section, pressure - pressed(radius)); },
      least, free, 1e-10);
    section.balloon = section.radius;
    section.pressed = pressed(section.radius);
  }
}

double BalloonOnWire::FillAt(double pressure, const DilatableWall& wall)
{
  double volume = 0.0;
  for (Section& section : this->Loaded)
  {
    this->Balance(section, pressure, wall);
    volume += 1e-3 * Pi * section.length *
      (section.balloon * section.balloon - section.folded * section.folded);
  }
  return volume;
}

/// What is around it is the wall's from now on.
void BalloonOnWire::LeaveStent(const VesselWay& way, DilatableWall& wall)
{
  PlacedStent placed;
  placed.name = this->System.name;
  placed.design = *this->System.stent;
  placed.middle = this->HeldPlace;
  const double half = 0.5 * placed.design.length;
  for (std::size_t n = 0; n < way.points.size(); ++n)
  {
    if (std::abs(way.place[n] - placed.middle) <= half)
    {
      placed.points.push_back(way.points[n]);
      placed.places.push_back(way.place[n]);
      wall.Place(way.points[n], placed.design.CrimpedRing());
      placed.rings.push_back(wall.Rings(way.points[n]).size() - 1);
    }
  }
  placed.beyond = std::max(0.0, placed.middle + half - way.place.back());
  this->Placed = std::move(placed);
  this->Report_.crimped = false;
}

void BalloonOnWire::Inflate(double seconds, double pressure, double place, double catheterTip,
  const VesselWay& way, DilatableWall& wall)
{
  wall.Release();
  this->Loaded.clear();
  this->HeldPlace = this->Report_.grip > 0.0 ? this->HeldPlace + this->Slid : place;
  this->Carry = std::clamp(this->HeldPlace - place, -MostCarried, MostCarried);
  this->Slid = 0.0;
  this->Share = 0.0;
  const double tip = this->HeldPlace + this->Balloon.Middle(); // along the way
  const bool inGuide = this->Report_.crimped &&
    this->HeldPlace - 0.5 * this->System.stent->CrimpedLength() < catheterTip;
  this->Report_.caught = inGuide && pressure > 0.0;
  if (this->Report_.caught)
  {
    pressure = 0.0;
  }
  if (this->Report_.crimped && !inGuide && this->Pressure >= this->Opens)
  {
    this->LeaveStent(way, wall);
  }
  const auto add = [&](std::int64_t point, double at, double length)
  {
    Section section;
    section.point = point;
    section.behind = tip - at;
    section.place = at;
    section.length = length;
    section.folded = this->FoldedAt(section.behind);
    section.crimped = this->Crimped(section.behind);
    section.shape = this->Balloon.Shape(section.behind);
    section.rest = point < 0 ? this->Guide.innerRadius : wall.InsideRadius(point);
    section.radius = section.rest;
    section.balloon = section.folded;
    this->Loaded.push_back(section);
  };
  for (double at = std::min(catheterTip, tip) - 0.5 * Spacing; tip - at < this->Balloon.Reach();
       at -= Spacing)
  {
    add(-1, at, Spacing);
  }
  for (std::size_t n = 0; n < way.points.size(); ++n)
  {
    const double at = way.place[n];
    if (at <= catheterTip || at > tip || tip - at > this->Balloon.monorail)
    {
      continue;
    }
    const double from = n > 0 ? way.place[n - 1] : at;
    const double to = n + 1 < way.points.size() ? way.place[n + 1] : at;
    add(way.points[n], at, 0.5 * (to - from));
  }

  if (this->Balloon.IsMicrocatheter())
  {
    this->FillAt(0.0, wall);
    const double wide = this->Report_.greatest;
    this->Summarize(wall);
    this->Report_.least = this->Report_.greatest = wide;
    return;
  }
  const double filled = this->Filled;
  const double flow = seconds / this->Balloon.inflationResistance;
  this->Pressure =
    RisingRoot([&](double p) { return this->FillAt(p, wall) - filled - flow * (pressure - p); },
      -1.0, HighestPressure, 1e-9);
  this->Filled = this->FillAt(this->Pressure, wall);

  this->Summarize(wall);
  this->Outline();
}

/// The frame's report; what it holds, it holds from now on.
void BalloonOnWire::Summarize(DilatableWall& wall)
{
  BalloonReport& report = this->Report_;
  report.pressure = this->Pressure;
  report.middle = this->HeldPlace;
  report.grip = report.wallPressure = report.stretch = report.greatest = report.ringStretch = 0.0;
  report.least = 1e9;
  report.place = report.stretched = report.ringPoint = -1;
  this->Inside.clear();
  double nearest = 1e9;
  for (const Section& section : this->Loaded)
  {
    if (section.shape >= 1.0)
    {
      report.least = std::min(report.least, 2.0 * section.balloon);
      report.greatest = std::max(report.greatest, 2.0 * section.balloon);
    }
    if (section.point < 0)
    {
      continue;
    }
    this->Inside.emplace_back(section.point, section.balloon);
    if (std::abs(section.behind - this->Balloon.Middle()) < nearest)
    {
      nearest = std::abs(section.behind - this->Balloon.Middle());
      report.place = section.point;
    }
    if (section.pressed > 0.0)
    {
      wall.Hold(section.point, section.radius);
      report.grip += this->Balloon.friction * MegapascalPerAtm * section.pressed * 2.0 * Pi *
        section.radius * section.length;
      this->SummarizeWall(section, wall);
    }
  }
}

void BalloonOnWire::SummarizeWall(const Section& section, const DilatableWall& wall)
{
  BalloonReport& report = this->Report_;
  const WallStation& station = wall.Stations()[section.point];
  const double lumen = wall.Radii()[section.point];
  const std::vector<StentRing>& rings = wall.Rings(section.point);
  for (const StentRing& ring : rings)
  {
    if (ring.radius / ring.greatest > report.ringStretch)
    {
      report.ringStretch = ring.radius / ring.greatest;
      report.ringPoint = section.point;
      report.ringPlace = section.place;
    }
  }
  if (wall.Gap(section.point) > 0.0)
  {
    return; // it holds a ring that does not reach the wall
  }
  this->Inside.back().second = lumen; // struts or not, nothing flows past
  report.wallPressure = std::max(report.wallPressure,
    rings.empty() ? section.pressed : WallPressure(station, lumen, wall.Settings()));
  if (lumen / station.reference > report.stretch)
  {
    report.stretch = lumen / station.reference;
    report.stretched = section.point;
    report.stretchedPlace = section.place;
  }
}

/// What the rod's contacts see of it at the frame's end.
void BalloonOnWire::Outline()
{
  this->OuterNow.swap(this->OuterNext);
  for (std::size_t n = 0; n < this->OuterNext.size(); ++n)
  {
    const double behind = static_cast<double>(n) * Spacing;
    Section section;
    section.folded = this->FoldedAt(behind);
    section.crimped = this->Crimped(behind);
    section.shape = this->Balloon.Shape(behind);
    double radius = std::min(this->BalloonRadius(section, this->Pressure), this->Guide.innerRadius);
    // Sections are ordered from the guide's to those ahead, but for the first ones.
    for (std::size_t k = 1; k < this->Loaded.size(); ++k)
    {
      const Section& one = this->Loaded[k - 1];
      const Section& two = this->Loaded[k];
      if (one.point >= 0 && one.behind >= behind && two.behind <= behind)
      {
        const double wide = one.behind - two.behind;
        const double t = wide > 0.0 ? (one.behind - behind) / wide : 0.0;
        radius = one.balloon + t * (two.balloon - one.balloon);
        break;
      }
    }
    this->OuterNext[n] = std::max(section.folded, radius);
  }
}

std::uint64_t BalloonOnWire::Hash(std::uint64_t hash) const
{
  for (const double value :
    { this->Place, this->HandPlace, this->Strain, this->LastOnWire, this->Rubbing, this->Pressure,
      this->Filled, this->Report_.grip, this->HeldPlace, this->Slid, this->Carry })
  {
    hash = Fnv1a(&value, sizeof(value), hash);
  }
  return Fnv1a(this->OuterNext.data(), this->OuterNext.size() * sizeof(double), hash);
}
}
