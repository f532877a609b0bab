#include "TrappedWire.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double MegapascalPerAtm = 0.101325;
constexpr double Opened = 0.05;    // mm that a balloon is wider than folded, to be in the way
constexpr double Deepest = 0.05;   // mm that an obstacle pushes with at most
constexpr double LeavesAt = 0.1;   // mm beyond the wall: it goes into a side branch there
constexpr double Compressed = 0.1; // mm
constexpr double Softness = 0.02;  // mm, as RodSettings
constexpr double Stiffness =
  4.0; // N/mm of a sample, of what is open: soft, so that a wire that is drawn does not hook
constexpr double LeastForce = 1e-4; // N
constexpr double FacesWall = 0.5;   // cosine
constexpr int ForgottenAfter = 12;  // frames: a fifth of a second

double Mixed(double now, double next, double share)
{
  return now + share * (next - now);
}
}

TrappedWire::Station TrappedWire::StationAt(std::int64_t point, double inside, double outside,
  const DilatableWall& wall, const std::vector<Vector3>& axisNow,
  const std::vector<Vector3>& axisNext) const
{
  Station station;
  station.point = point;
  station.now = axisNow[point];
  station.next = axisNext[point];
  station.insideNow = station.insideNext = inside;
  station.wallNow = station.wallNext = outside;
  for (const Chain& old : this->Before)
  {
    for (const Station& one : old.stations)
    {
      if (one.point == point)
      {
        station.insideNow = one.insideNext;
        station.wallNow = one.wallNext;
      }
    }
  }
  station.pressure = MegapascalPerAtm *
    std::max(0.0, WallPressure(wall.Stations()[point], wall.Radii()[point], wall.Settings()));
  return station;
}

void TrappedWire::Close(std::vector<Station>& stations)
{
  if (stations.size() > 1)
  {
    Chain chain;
    chain.stations = stations;
    chain.centre = stations[stations.size() / 2].now;
    for (const Station& station : stations)
    {
      const double axis =
        std::max((station.now - chain.centre).norm(), (station.next - chain.centre).norm());
      chain.reach =
        std::max(chain.reach, axis + std::max(station.wallNow, station.wallNext) + 2.0 * LeavesAt);
    }
    this->Chains.push_back(std::move(chain));
  }
  stations.clear();
}

void TrappedWire::BeginFrame(const std::vector<PlacedStent>& stents, const BalloonOnWire* balloon,
  const DilatableWall& wall, const std::vector<Vector3>& axisNow,
  const std::vector<Vector3>& axisNext, double seconds)
{
  this->Unseen = this->Seen ? 0 : this->Unseen + 1;
  this->Seen = false;
  if (this->Unseen > ForgottenAfter)
  {
    this->Stents.clear();
    this->Unseen = 0;
  }
  this->Before.swap(this->Chains);
  this->Chains.clear();
  this->Seconds = seconds;
  this->Share = 0.0;
  std::vector<Station> chain;
  for (const std::size_t number : this->Stents)
  {
    const PlacedStent& stent = stents[number];
    for (std::size_t n = 0; n < stent.points.size(); ++n)
    {
      const std::int64_t point = stent.points[n];
      const StentRing& ring = wall.Rings(point)[stent.rings[n]];
      chain.push_back(this->StationAt(
        point, ring.radius + ring.thickness, wall.Radii()[point], wall, axisNow, axisNext));
    }
    this->Close(chain);
  }
  if (balloon)
  {
    const double folded = balloon->Device().crossingRadius + Opened;
    for (const auto& [point, radius] : balloon->Sections())
    {
      const bool jails = this->Jailed() && !wall.Rings(point).empty();
      if (radius <= folded || jails)
      {
        this->Close(chain);
        continue;
      }
      chain.push_back(
        this->StationAt(point, radius, wall.InsideRadius(point), wall, axisNow, axisNext));
    }
    this->Close(chain);
  }
}

void TrappedWire::SetTime(double seconds)
{
  this->Share = std::clamp(seconds / this->Seconds, 0.0, 1.0);
}

TrappedWire::At TrappedWire::Meet(
  const ContactSample& sample, double length, SampleContacts& contacts) const
{
  At place = At::Free;
  for (const Chain& chain : this->Chains)
  {
    if ((sample.centre - chain.centre).squaredNorm() > chain.reach * chain.reach)
    {
      continue;
    }
    const At here = this->MeetChain(chain, sample, length, contacts);
    if (here == At::Held)
    {
      return here;
    }
    place = here == At::Beside ? here : place;
  }
  return place;
}

TrappedWire::At TrappedWire::MeetChain(
  const Chain& chain, const ContactSample& sample, double length, SampleContacts& contacts) const
{
  const std::vector<Station>& stations = chain.stations;
  const auto at = [&](const Station& station)
  { return Vector3(station.now + this->Share * (station.next - station.now)); };
  double squared = 1e300;
  std::size_t piece = 0;
  double along = 0.0;
  Vector3 before = at(stations[0]);
  for (std::size_t n = 1; n < stations.size(); ++n)
  {
    const Vector3 here = at(stations[n]);
    const SegmentPlace place = NearestOnSegment(sample.centre, before, here);
    if (place.squaredDistance < squared)
    {
      squared = place.squaredDistance;
      piece = n - 1;
      along = place.fraction;
    }
    before = here;
  }
  if ((piece == 0 && along <= 0.0) || (piece + 2 == stations.size() && along >= 1.0))
  {
    return At::Free; // beyond its ends
  }
  const Station& a = stations[piece];
  const Station& b = stations[piece + 1];
  const auto mixed = [&](double Station::*now, double Station::*next) {
    return Mixed(Mixed(a.*now, a.*next, this->Share), Mixed(b.*now, b.*next, this->Share), along);
  };
  const double inside = mixed(&Station::insideNow, &Station::insideNext);
  const double wall = mixed(&Station::wallNow, &Station::wallNext);
  const bool room = wall - inside > 2.0 * sample.radius;
  const Vector3 axis = (at(b) - at(a)).normalized();
  Vector3 across = sample.centre - (1.0 - along) * at(a) - along * at(b);
  across -= across.dot(axis) * axis;
  const double distance = across.norm();
  if (distance > wall + LeavesAt)
  {
    return At::Free;
  }
  const Vector3 outwards = distance > 1e-6 ? Vector3(across / distance) : axis.unitOrthogonal();
  const bool atWall = contacts.count > 0 && contacts.plane[0].normal.dot(outwards) < -FacesWall;
  ContactPlane plane;
  if (atWall && !room)
  {
    // Pressed onto the wall from the other side.
    const ContactPlane& other = contacts.plane[0];
    const double pressure = Mixed(a.pressure, b.pressure, along);
    const double force = std::max(LeastForce, pressure * 2.0 * sample.radius * length);
    plane = other;
    plane.normal = -other.normal;
    // The same force wherever it lies: a spring that is long compressed.
    plane.gap = -Compressed;
    plane.stiffness = force / (Compressed + 0.5 * Softness);
    plane.identity = 1 - other.identity;
    contacts.plane[1] = plane;
    contacts.count = 2;
    return At::Held;
  }
  const double least = std::min(inside + sample.radius, wall - sample.radius);
  plane.normal = outwards;
  plane.gap = std::max(distance - least, -Deepest);
  plane.wallVelocity =
    ((1.0 - along) * (a.next - a.now) + along * (b.next - b.now)) / this->Seconds;
  plane.friction = sample.friction;
  plane.stiffness = Stiffness;
  if (plane.gap < Softness)
  {
    // Of three planes the furthest goes.
    contacts.count = std::min(contacts.count, 1);
    plane.identity = contacts.count > 0 && contacts.plane[0].identity == 0 ? 1 : 0;
    contacts.plane[contacts.count++] = plane;
  }
  return At::Beside;
}
}
