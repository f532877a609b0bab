#include "GuideInAorta.h"

#include "CurveGeometry.h"
#include "Fnv1a.h"
#include "Numbers.h"
#include "SettingLimits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double FineTip = 30.0;       // mm from the tip on which segments are short
constexpr double TubeDensity = 1200.0; // kg/m^3 of polymer and what fills it
constexpr double TubeLossTime = 2e-3;  // s
constexpr double TubeSpinDrag = 1e-6;  // N s
constexpr int FewestSegments = 4;
constexpr double MillimetresOfMercury = 133.322387415; // Pa

double BendingOf(const CatheterSection& section)
{
  return section.bendingStiffness;
}
double TorsionOf(const CatheterSection& section)
{
  return section.torsionalStiffness;
}
}

void GuideSettings::Validate() const
{
  RequireWithin(this->tickRate, 500.0, 20000.0, "tickRate of the guide");
  RequireWithin(this->tipSegment, 0.5, 4.0, "tipSegment of the guide");
  RequireWithin(this->shaftSegment, 0.5, 10.0, "shaftSegment of the guide");
  RequireWithin(this->start, 10.0, 3000.0, "start of the guide");
  RequireWithin(this->capacity, 20, 1000, "capacity of the guide");
  RequireWithin(this->drag, 0.0, 10.0, "drag of the guide");
}

GuidePieces MakeGuidePieces(const GuideCatheter& guide, const GuideSettings& settings)
{
  settings.Validate();
  guide.Validate();
  if (guide.sections.empty())
  {
    throw std::invalid_argument(
      "Catheter '" + guide.name + "' has no 'sections': its stiffness is not known.");
  }
  GuidePieces pieces;
  // Of an even tube: A / I = 16 / (D^2 + d^2).
  const double stretch =
    4.0 / (guide.outerRadius * guide.outerRadius + guide.innerRadius * guide.innerRadius);
  double from = 0.0;
  for (int i = 0; i < settings.capacity && from < guide.length; ++i)
  {
    const double length = from < FineTip ? settings.tipSegment : settings.shaftSegment;
    const double middle = from + 0.5 * length;
    RodSegment segment = MakeRodSegment(length, guide.outerRadius, TubeDensity);
    segment.friction = guide.wallFriction;
    segment.drag = settings.drag * 1e-6 * length; // 1 Pa s = 1e-6 N s/mm^2
    segment.rotationalDrag = TubeSpinDrag * length;
    segment.samples = 1;
    RodJoint joint;
    if (i > 0)
    {
      const double distance = middle - pieces.places.back();
      const double bending = AlongSections(guide.sections, from, BendingOf);
      joint.angularStiffness =
        Vector3(bending, bending, AlongSections(guide.sections, from, TorsionOf)) / distance;
      joint.stretchStiffness = stretch * bending / distance;
      const Eigen::Vector2d turn = TurnBetween(guide.shape, pieces.places.back(), middle);
      joint.restAngle = Vector3(-turn.y(), turn.x(), 0.0);
      joint.lossTime = TubeLossTime;
    }
    pieces.segments.push_back(segment);
    pieces.joints.push_back(joint);
    pieces.places.push_back(middle);
    from += length;
  }
  return pieces;
}

GuideSeat SeatOf(const Vector3& tip, const Vector3& direction, const Ostium& ostium)
{
  GuideSeat seat;
  const Vector3 way = tip - ostium.position;
  seat.depth = way.dot(ostium.direction);
  seat.offset = (way - seat.depth * ostium.direction).norm();
  seat.angle =
    std::atan2(direction.cross(ostium.direction).norm(), direction.dot(ostium.direction));
  seat.engaged = seat.depth > 0.0 && seat.offset < ostium.radius;
  return seat;
}

double AnnularResistance(double inner, double outer, double length, double viscosity)
{
  if (!(inner < outer))
  {
    return std::numeric_limits<double>::infinity();
  }
  const double a = inner * inner;
  const double b = outer * outer;
  const double gap = inner > 0.0 ? (b - a) * (b - a) / std::log(outer / inner) : 0.0;
  // eta L / mm^4 = 1e9 Pa s/m^3, and 1 Pa s/m^3 = 1e-6 Pa s/mL.
  return 8.0 * viscosity * length / (Pi * (b * b - a * a - gap)) * 1e3 / MillimetresOfMercury;
}

GuideInAorta::GuideInAorta(
  const GuideCatheter& guide, const std::vector<Vector3>& way, const GuideSettings& settings)
  : Guide(guide)
  , Settings(settings)
  , Pieces(MakeGuidePieces(guide, settings))
  , Bare(this->Pieces.joints)
  , Tube(static_cast<std::int64_t>(this->Pieces.segments.size()), InstrumentRod())
{
  if (way.size() < 2 || !(PolylineLength(way) >= settings.start) ||
    !((way[1] - way[0]).norm() > 0.0))
  {
    throw std::invalid_argument("the way along the aorta is " +
      std::to_string(PolylineLength(way)) +
      " mm long, shorter than the guide that is in it at the beginning");
  }
  this->Entry = way.front();
  this->Forward = (way[1] - way[0]).normalized();
  const Vector3 whole = way.back() - way.front();
  const Vector3 across = whole - this->Forward * this->Forward.dot(whole);
  this->Side_ = across.norm() > 1e-6 * whole.norm() ? Vector3(across.normalized())
                                                    : Vector3(this->Forward.unitOrthogonal());
  this->Start = this->Fed = settings.start;

  // Frames along the way that do not turn about it, from the entry on.
  struct Place
  {
    Vector3 position;
    Eigen::Quaterniond orientation;
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < this->Pieces.places.size(); ++i)
  {
    const double u = this->Fed - this->Pieces.places[i];
    if (u <= 0.0 && static_cast<int>(i) >= FewestSegments)
    {
      break;
    }
    Place place{ this->Entry + u * this->Forward, this->HeldOrientation() };
    double along = 0.0;
    Vector3 before = this->Forward;
    for (std::size_t k = 1; k < way.size() && u > along; ++k)
    {
      const Vector3 piece = way[k] - way[k - 1];
      const double length = piece.norm();
      if (!(length > 0.0))
      {
        continue;
      }
      const Vector3 direction = piece / length;
      place.orientation = Eigen::Quaterniond::FromTwoVectors(before, direction) * place.orientation;
      place.position = way[k - 1] + (u - along) * direction;
      before = direction;
      along += length;
    }
    places.push_back(place);
  }
  for (const Place& place : places)
  {
    const auto i = static_cast<std::size_t>(this->Tube.Size());
    this->Tube.Append(
      this->Pieces.segments[i], this->Pieces.joints[i], place.position, place.orientation);
  }
  this->Append();
  const std::int64_t last = this->Tube.Size() - 1;
  this->Tube.Prescribe(last, this->Tube.Position(last), this->Tube.Orientation(last));
  this->Tube.HangOnSpring(last, this->SpringStiffness(), 0.0);
}

Eigen::Quaterniond GuideInAorta::HeldOrientation() const
{
  Matrix3 frame;
  frame.col(2) = -this->Forward; // from the tip backwards
  frame.col(0) =
    std::cos(this->Angle) * this->Side_ + std::sin(this->Angle) * this->Forward.cross(this->Side_);
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return Eigen::Quaterniond(frame);
}

/// N mm/rad, of the shaft from the entry to the hand.
double GuideInAorta::SpringStiffness() const
{
  return AlongSections(this->Guide.sections, this->Fed, TorsionOf) /
    std::max(this->Settings.shaftSegment, this->Guide.length - this->Fed);
}

void GuideInAorta::Append()
{
  const std::int64_t i = this->Tube.Size();
  const double lag = i > 0 ? this->Tube.Lag(i - 1) : 0.0;
  this->Tube.Append(this->Pieces.segments[i], this->Pieces.joints[i],
    this->Entry + (this->Fed - this->Pieces.places[i]) * this->Forward,
    this->HeldOrientation() * Eigen::Quaterniond(Eigen::AngleAxisd(lag, Vector3::UnitZ())));
}

void GuideInAorta::Carry(const Guidewire& wire, double beyond, bool beside)
{
  for (std::size_t i = 1; i < this->Bare.size(); ++i)
  {
    const double before = this->Pieces.places[i - 1];
    const double after = this->Pieces.places[i];
    const double covered = std::clamp((after + beyond) / (after - before), 0.0, 1.0);
    RodJoint& joint = this->Pieces.joints[i];
    joint = beside ? joint : this->Bare[i];
    if (covered > 0.0)
    {
      // A share of the joint: nothing jumps when the wire's tip passes it.
      const double more = covered *
        AlongWire(wire, std::max(0.0, 0.5 * (before + after) + beyond),
          [](const WireSection& s) { return 0.5 * (s.bendingStiffness1 + s.bendingStiffness2); }) /
        (after - before);
      const double both = joint.angularStiffness.x() + more;
      joint.restAngle *= joint.angularStiffness.x() / both;
      joint.angularStiffness.x() = joint.angularStiffness.y() = both;
    }
    if (static_cast<std::int64_t>(i) < this->Tube.Size())
    {
      this->Tube.Joint(static_cast<std::int64_t>(i) - 1) = joint;
    }
  }
}

const RodStep& GuideInAorta::Step(double position, double angle, ContactSurface& wall)
{
  const double torque = this->SpringStiffness() * this->Tube.Lag(this->Tube.Size() - 1);
  if (std::isfinite(position) && std::isfinite(angle))
  {
    this->Fed = std::clamp(this->Start + position, this->Least(), this->Most());
    this->Angle = angle;
  }
  while (this->Fed - this->Pieces.places[this->Tube.Size() - 1] > 0.0 &&
    this->Tube.Size() < static_cast<std::int64_t>(this->Pieces.places.size()))
  {
    this->Append();
    this->Tube.Release(this->Tube.Size() - 2);
  }
  while (this->Tube.Size() > FewestSegments &&
    this->Fed - this->Pieces.places[this->Tube.Size() - 2] < 0.0)
  {
    this->Tube.RemoveLast();
  }
  const std::int64_t last = this->Tube.Size() - 1;
  this->Tube.Prescribe(last, this->Entry + (this->Fed - this->Pieces.places[last]) * this->Forward,
    this->HeldOrientation());
  this->Tube.HangOnSpring(last, this->SpringStiffness(), torque / this->SpringStiffness());
  this->Tube.SetForce(0, this->TipForce);
  return this->Tube.Step(1.0 / this->Settings.tickRate, &wall);
}

double GuideInAorta::Least() const
{
  return this->Pieces.places[FewestSegments - 1];
}

double GuideInAorta::Most() const
{
  return this->Pieces.places[this->Pieces.places.size() - 2]; // the last one is held
}

double GuideInAorta::Lag() const
{
  // The joints' twist is about the axis that points back to the hand.
  double lag = this->Tube.Lag(this->Tube.Size() - 1);
  for (std::int64_t i = 0; i + 1 < this->Tube.Size(); ++i)
  {
    lag -=
      RotationVector(this->Tube.Orientation(i).conjugate() * this->Tube.Orientation(i + 1)).z();
  }
  return lag;
}

double GuideInAorta::HandForce() const
{
  Vector3 force;
  Vector3 torque;
  this->Tube.Reaction(this->Tube.Size() - 1, force, torque);
  return force.dot(this->Forward);
}

double GuideInAorta::HandTorque() const
{
  return this->SpringStiffness() * this->Tube.Lag(this->Tube.Size() - 1);
}

void GuideInAorta::Line(std::vector<Vector3>& line) const
{
  line.assign(1, this->Tip());
  for (std::int64_t i = 0; i + 1 < this->Tube.Size(); ++i)
  {
    line.push_back(0.5 * (this->Tube.LastEnd(i) + this->Tube.FirstEnd(i + 1)));
  }
}

std::uint64_t GuideInAorta::Hash(std::uint64_t hash) const
{
  hash = this->Tube.Hash(hash);
  for (const double value : { this->Fed, this->Angle })
  {
    hash = Fnv1a(&value, sizeof(value), hash);
  }
  return hash;
}
}
