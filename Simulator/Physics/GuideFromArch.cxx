#include "GuideFromArch.h"

#include "CatheterPath.h"
#include "CurveGeometry.h"
#include "VesselLesions.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double EntryInside = 10.0;  // mm
constexpr double FurthestWall = 10.0; // mm from the vessel's first point along its axis
constexpr double InletInside = 4.0;   // mm that the lengthened inlet is within the aorta
constexpr double ThrustTime = 4e-3;   // s: what the wire's push is smoothed over
constexpr double SettlesFor = 2.0;    // s
constexpr double SameWire = 0.25;     // mm of wire that change no stiffness
constexpr std::int64_t TubeNumbers = std::int64_t{ 1 } << 32; // of the guide's samples

WallTopology WallOf(const WallTopology& vessels)
{
  WallTopology wall;
  if (!vessels.aorta)
  {
    throw std::invalid_argument("there is no aorta");
  }
  wall.points = static_cast<std::int64_t>(vessels.aorta->points.size());
  wall.triangles = vessels.aorta->triangles;
  return wall;
}

/// From EntryInside before the aorta's lower end to the valve.
std::vector<Vector3> WayOf(const WallTopology& vessels)
{
  std::vector<Vector3> way(vessels.aorta->axis.rbegin(), vessels.aorta->axis.rend());
  double cut = EntryInside;
  while (way.size() > 2 && cut > 0.0)
  {
    const Vector3 piece = way[1] - way[0];
    const double length = piece.norm();
    if (length > cut)
    {
      way.front() += (cut / length) * piece;
      break;
    }
    cut -= length;
    way.erase(way.begin());
  }
  return way;
}

/// mm along the way until StartsAbove the ostium.
GuideSettings StartingAbove(
  GuideSettings settings, const WallTopology& vessels, const Vector3& ostium)
{
  settings.start = std::max(10.0, PlaceAlong(WayOf(vessels), ostium) - GuideFromArch::StartsAbove);
  return settings;
}
}

GuideFromArch::GuideFromArch(const GuideCatheter& guide, const WallTopology& topology,
  const std::vector<Vector3>& axis, int root, double engagement, double behind,
  const GuideSettings& settings)
  : AortaTopology(WallOf(topology))
  , Motion(topology)
  , RootFirst(static_cast<std::size_t>(FirstAxisPoint(topology, root)))
  , RootCount(topology.axis[root].size())
  , Engagement(engagement)
  , Behind(static_cast<int>(std::ceil(behind / Spacing)))
  , Tube(guide, WayOf(topology), StartingAbove(settings, topology, topology.axis[root].front()))
  , TickRate(settings.tickRate)
{
  this->Start = this->Tube.Inserted();
  this->Motion.Positions(axis, this->AortaPoints);
  VesselWallSettings wall;
  wall.surfaceReach = 0.0; // there is nothing beside it
  wall.stiffness = 60.0;
  this->AortaWall = std::make_unique<VesselWall>(this->AortaTopology, this->AortaPoints, wall);
  this->Next = this->MouthOf(axis);
  this->FindMouth();
  const std::vector<double>& radii = topology.axisRadius.at(root);
  for (std::size_t i = 0; i < radii.size() && i < 4; ++i)
  {
    this->MouthRadius = std::max(this->MouthRadius, radii[i]);
  }
  this->Current = this->Next = this->Now_ = this->MouthOf(axis);
}

GuideFromArch::~GuideFromArch() = default;

/// Where the root's axis, drawn out straight before its first point, leaves the aorta.
void GuideFromArch::FindMouth()
{
  constexpr double Step = 0.1;
  const Ostium first = this->Next;
  double place = -FurthestWall;
  const auto within = [&](double at)
  { return this->AortaWall->Closest(first.position + at * first.direction).distance > 0.0; };
  while (place < FurthestWall && within(place))
  {
    place += Step;
  }
  if (place == -FurthestWall || place >= FurthestWall)
  {
    char text[120];
    std::snprintf(text, sizeof(text),
      "the aorta's wall is not within %.0f mm of the ostium that the guide is to engage",
      FurthestWall);
    throw std::invalid_argument(text);
  }
  this->MouthAt = place;
}

Ostium GuideFromArch::MouthOf(const std::vector<Vector3>& axis) const
{
  const auto begin = axis.begin() + static_cast<std::ptrdiff_t>(this->RootFirst);
  const std::vector<Vector3> root(begin, begin + static_cast<std::ptrdiff_t>(this->RootCount));
  Ostium mouth;
  mouth.direction = DirectionAtOstium(root);
  mouth.position = root.front() + this->MouthAt * mouth.direction;
  mouth.radius = this->MouthRadius;
  return mouth;
}

double GuideFromArch::InletLength() const
{
  return std::max(1.0, InletInside - this->MouthAt);
}

void GuideFromArch::Join(VesselWall& artery, std::int64_t inlet)
{
  this->TubeLumen = std::make_unique<AortaAndArtery>(
    *this->AortaWall, artery, inlet, TubeNumbers, AortaSide::Aorta);
  this->WireLumen =
    std::make_unique<AortaAndArtery>(*this->AortaWall, artery, inlet, 0, AortaSide::Unknown);
  this->SetTime(0.0);
  const auto ticks = static_cast<int>(std::lround(SettlesFor * this->TickRate));
  for (int i = 0; i < ticks; ++i)
  {
    this->Tube.Step(0.0, 0.0, *this->TubeLumen);
  }
  this->MakeWay();
}

void GuideFromArch::BeginFrame(const std::vector<Vector3>& axis, double seconds)
{
  this->Motion.Positions(axis, this->AortaPoints);
  this->AortaWall->BeginFrame(this->AortaPoints, seconds);
  this->Current = this->Next;
  this->Next = this->MouthOf(axis);
  this->Seconds = seconds;
  this->SetTime(0.0);
}

void GuideFromArch::SetTime(double seconds)
{
  this->AortaWall->SetTime(seconds);
  const double share = std::clamp(seconds / this->Seconds, 0.0, 1.0);
  this->Now_ = this->Current;
  this->Now_.position += share * (this->Next.position - this->Current.position);
  this->Now_.direction =
    (this->Current.direction + share * (this->Next.direction - this->Current.direction))
      .normalized();
  this->TubeLumen->SetMouth(this->Now_.position);
  this->WireLumen->SetMouth(this->Now_.position);
}

double GuideFromArch::Least() const
{
  return this->Tube.Least() - this->Start;
}

double GuideFromArch::Most() const
{
  return this->Tube.Most() - this->Start;
}

void GuideFromArch::Step(double position, double angle,
  const std::vector<std::pair<const Guidewire*, double>>& wires, double thrust)
{
  this->Carried.resize(wires.size(), 1e9);
  bool same = true;
  for (std::size_t n = 0; n < wires.size(); ++n)
  {
    same = same && std::abs(wires[n].second - this->Carried[n]) <= SameWire;
  }
  for (std::size_t n = 0; n < wires.size() && !same; ++n)
  {
    this->Carried[n] = wires[n].second;
    this->Tube.Carry(*wires[n].first, wires[n].second, n > 0);
  }
  const double share = -std::expm1(-1.0 / (this->TickRate * ThrustTime));
  this->Thrust += share * ((std::isfinite(thrust) ? thrust : 0.0) - this->Thrust);
  this->Tube.SetTipForce(-this->Thrust * this->Tube.Direction());
  this->Tube.Step(position, angle, *this->TubeLumen);
  this->MakeWay();
}

GuideSeat GuideFromArch::Seat() const
{
  return SeatOf(this->Tube.Tip(), this->Tube.Direction(), this->Now_);
}

/// Cubic between the tube's joints, so that what runs in it meets no corners.
void GuideFromArch::MakeWay()
{
  const CosseratRod& rod = this->Tube.Rod();
  std::vector<Node>& nodes = this->Nodes;
  nodes.clear();
  nodes.push_back({ rod.FirstEnd(0), -rod.Axis(0), rod.Velocity(0), 0.0 });
  for (std::int64_t i = 0; i + 1 < rod.Size(); ++i)
  {
    nodes.push_back({ 0.5 * (rod.LastEnd(i) + rod.FirstEnd(i + 1)),
      -(rod.Axis(i) + rod.Axis(i + 1)).normalized(), 0.5 * (rod.Velocity(i) + rod.Velocity(i + 1)),
      nodes.back().behind + rod.Segment(i).length });
  }
  const std::size_t count = static_cast<std::size_t>(this->Behind) + 1;
  this->Now.resize(count);
  this->Velocities.resize(count);
  this->Begin = this->TipPlace() - Spacing * this->Behind;
  std::size_t piece = 0;
  for (int i = 0; i <= this->Behind; ++i)
  {
    const double behind = Spacing * i;
    while (piece + 2 < nodes.size() && nodes[piece + 1].behind < behind)
    {
      ++piece;
    }
    const Node& a = nodes[piece];
    const Node& b = nodes[piece + 1];
    const double length = b.behind - a.behind;
    const double t = (behind - a.behind) / length;
    const double s = 1.0 - t;
    const std::size_t at = count - 1 - static_cast<std::size_t>(i);
    this->Now[at] = s * s * (1.0 + 2.0 * t) * a.position + t * t * (3.0 - 2.0 * t) * b.position -
      length * s * t * (s * a.tangent - t * b.tangent);
    this->Velocities[at] = s * a.velocity + t * b.velocity;
  }
  this->MakeTangents(nodes.front().tangent);
  // From the entry on, where the hand's frame is.
  Vector3 side = this->Tube.Side();
  for (std::size_t i = nodes.size() - 1; i > piece; --i)
  {
    side -= nodes[i].tangent * nodes[i].tangent.dot(side);
    side.normalize();
  }
  this->CarrySides(0, side);
}

Vector3 GuideFromArch::VelocityAt(std::size_t i, double share) const
{
  return (1.0 - share) * this->Velocities[i] + share * this->Velocities[i + 1];
}

void GuideFromArch::Line(double /*u*/, double /*length*/, std::vector<Vector3>& line) const
{
  this->Tube.Line(line);
}

std::uint64_t GuideFromArch::Hash(std::uint64_t hash) const
{
  return this->Tube.Hash(hash);
}
}
