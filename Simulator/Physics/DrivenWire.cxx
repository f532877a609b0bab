#include "DrivenWire.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double FloppyTip = 35.0; // mm from the tip in which segments have two samples
constexpr double ShortTip = 12.0;  // mm from the tip on which segments are half as long
constexpr double StartInside =
  2.0; // mm of the catheter between its tip and the wire's, at the beginning
constexpr double SoftTip = 3.0;   // mm of the catheter
constexpr double LossTime = 2e-3; // s
constexpr double SpinDrag = 1e-6; // N s
constexpr int MinimumSegments = 4;
constexpr double HeadOn = 0.8; // cosine between the tip's axis and a wall's normal

/// How much harder a vessel is than its stiffness against the bare wire: what begins a tick deep inside the wall, as a tip that
/// a hand jams into the end of a thin vessel, must not come through with its middle. Usual contacts are a tenth as deep.
double Hardening(double gap)
{
  constexpr double deepInside = 0.05;   // mm
  constexpr double twiceAsHard = 0.025; // mm deeper
  return 1.0 + std::max(0.0, -gap - deepInside) / twiceAsHard;
}

/// An open balloon is pressed along the vessel where that narrows; the wire in it is not: it slides.
void OnlyAcross(const Vector3& axis, SampleContacts& contacts)
{
  constexpr double Least = 0.3; // of a normal that is across
  int kept = 0;
  for (int n = 0; n < contacts.count; ++n)
  {
    ContactPlane plane = contacts.plane[n];
    const Vector3 across = plane.normal - plane.normal.dot(axis) * axis;
    const double share = across.norm();
    if (share > Least)
    {
      plane.normal = across / share;
      plane.gap /= share;
      contacts.plane[kept++] = plane;
    }
  }
  contacts.count = kept;
}

/// What touches is the sleeve; its friction is the sleeve's.
void NoFriction(SampleContacts& contacts)
{
  for (int n = 0; n < contacts.count; ++n)
  {
    contacts.plane[n].friction = 0.0;
  }
}
}

DrivenWire::DrivenWire(
  const Guidewire& wire, WireRoom& room, InstrumentLumen& lumen, std::int64_t firstSample)
  : Room(room)
  , Lumen(lumen)
  , Wire(wire)
  , FirstSample(firstSample)
  , Rod_(room.settings.capacity, InstrumentRod())
  , Fed_(room.catheterTip - StartInside)
  , LastFed(Fed_)
  , LastCatheterTip(room.catheterTip)
  , Behind(wire, room.catheter, room.settings.insideCatheter)
{
  this->MakeSegments();
  const auto capacity = static_cast<std::size_t>(room.settings.capacity);
  this->InVessel.assign(capacity * static_cast<std::size_t>(this->Rod_.SamplesPerSegment()), 0);
  this->Held.assign(this->InVessel.size(), TrappedWire::At::Free);
  this->Last.position.reserve(capacity);
  this->Last.orientation.reserve(capacity);
  this->DriveBehind();
  this->PlaceOnPath();
  this->KeepSane();
}

void DrivenWire::Take(const Guidewire& wire)
{
  this->Wire = wire;
  this->MakeSegments();
  this->Behind = WireInGuide(wire, this->Room.catheter, this->Room.settings.insideCatheter);
  this->DriveBehind(); // how stiff it is, for how it rests
  this->Behind.Rest(this->HandAngle, this->HandAngle);
  this->DriveBehind();
  this->Rod_ = CosseratRod(this->Room.settings.capacity, InstrumentRod());
  this->PlaceOnPath();
  this->KeepSane();
}

void DrivenWire::TakeAlong(const Guidewire& wire)
{
  this->KeepSane();
  this->Wire = wire;
  this->MakeSegments(); // as long as the last one's, all of them
  this->HandAngle = this->Last.angle;
  this->Behind = WireInGuide(wire, this->Room.catheter, this->Room.settings.insideCatheter);
  this->DriveBehind();
  this->Behind.Rest(this->HandAngle, this->HandAngle);
  this->DriveBehind();
  std::vector<Eigen::Quaterniond>& frames = this->Last.orientation;
  const auto axis = [&](std::size_t i) { return Vector3(frames[i] * Vector3::UnitZ()); };
  for (std::size_t i = frames.size() - 1; i-- > 0;)
  {
    frames[i] = Eigen::Quaterniond::FromTwoVectors(axis(i + 1), axis(i)) * frames[i + 1];
  }
  this->Rod_ = CosseratRod(this->Room.settings.capacity, InstrumentRod());
  for (std::size_t i = 0; i < frames.size(); ++i)
  {
    this->Rod_.Append(this->Segments_[i], this->Joints[i], this->Last.position[i], frames[i]);
  }
  const std::int64_t last = this->Rod_.Size() - 1;
  this->Rod_.Prescribe(last, this->Rod_.Position(last), this->Rod_.Orientation(last));
}

void DrivenWire::MakeSegments()
{
  this->Segments_.clear();
  this->Joints.clear();
  this->Places_.clear();
  const double whole = this->Room.settings.segmentLength;
  double from = 0.0;
  for (int i = 0; i < this->Room.settings.capacity; ++i)
  {
    const double length = from < ShortTip ? 0.5 * whole : whole;
    const double middle = from + 0.5 * length;
    const auto value = [&](double at, auto property)
    { return AlongWire(this->Wire, at, property); };
    RodSegment segment =
      MakeRodSegment(length, value(middle, [](const WireSection& s) { return s.radius; }),
        value(middle, [](const WireSection& s) { return s.density; }));
    segment.friction = value(middle, [](const WireSection& s) { return s.friction; });
    // 1 Pa s = 1e-6 N s/mm^2
    segment.drag = this->Room.settings.drag * 1e-6 * length;
    // More than blood would, too: a twisted wire that comes free spins within its lumen, not within a tick.
    segment.rotationalDrag = SpinDrag * length;
    // Where segments are short, or too stiff to bend between samples, one is enough.
    segment.samples = length < whole || middle > FloppyTip ? 1 : 0;
    this->Segments_.push_back(segment);
    this->Places_.push_back(middle);
    RodJoint joint;
    if (i > 0)
    {
      const double distance = middle - this->Places_[i - 1];
      joint.angularStiffness =
        Vector3(value(from, [](const WireSection& s) { return s.bendingStiffness1; }),
          value(from, [](const WireSection& s) { return s.bendingStiffness2; }),
          value(from, [](const WireSection& s) { return s.torsionalStiffness; })) /
        distance;
      joint.stretchStiffness =
        value(from, [](const WireSection& s) { return s.axialStiffness; }) / distance;
      joint.restAngle = Vector3(distance * RestCurvature(this->Wire, from), 0.0, 0.0);
      joint.lossTime = LossTime;
    }
    this->Joints.push_back(joint);
    from += length;
  }
}

double DrivenWire::SampleLength(std::int64_t segment) const
{
  const RodSegment& one = this->Segments_[segment];
  return one.length / (one.samples > 0 ? one.samples : this->Rod_.GetSettings().samples);
}

/// The guide's wall. @return false: the sample is not in the guide
bool DrivenWire::InGuide(const ContactSample& sample, double expected, double reach, bool sleeved,
  SampleContacts& contacts)
{
  const double u = this->Room.path->Nearest(
    sample.centre, expected - 6.0, std::min(expected + 6.0, this->Room.catheterTip));
  if (u >= this->Room.catheterTip - 1e-9)
  {
    return false;
  }
  char& inVessel = this->InVessel[sample.index];
  if (inVessel)
  {
    inVessel = 0;
    this->Lumen.Forget(sample.index + this->FirstSample);
  }
  const PathPlace place = this->Room.path->At(u);
  Vector3 across = sample.centre - place.position;
  across -= place.tangent * place.tangent.dot(across);
  const double distance = across.norm();
  const double gap = this->Room.catheter.innerRadius - sample.radius - distance;
  if (gap < reach && distance > 1e-9)
  {
    contacts.count = 1;
    ContactPlane& plane = contacts.plane[0];
    plane = ContactPlane();
    plane.normal = across / -distance;
    plane.gap = gap;
    plane.wallVelocity = place.velocity;
    plane.friction = this->Room.catheter.friction;
    // Its tip is soft: the wire's load goes over from place to place as they leave it.
    plane.stiffness = this->Room.settings.wallStiffness *
      std::clamp((this->Room.catheterTip - u) / SoftTip, 0.01, 1.0);
    if (sleeved)
    {
      NoFriction(contacts);
    }
  }
  return true;
}

void DrivenWire::Find(const ContactSample& sample, double reach, SampleContacts& contacts)
{
  const std::int64_t segment = sample.index / this->Rod_.SamplesPerSegment();
  const double expected = this->Fed_ - this->Places_[segment];
  contacts.count = 0;
  TrappedWire::At& held = this->Held[sample.index];
  held = TrappedWire::At::Free;
  const bool sleeved = this->InSleeve(segment);
  if (expected < this->Room.catheterTip + 15.0 &&
    this->InGuide(sample, expected, reach, sleeved, contacts))
  {
    return;
  }
  this->InVessel[sample.index] = 1;
  ContactSample own = sample;
  own.index += this->FirstSample;
  this->Lumen.Find(own, reach, contacts);
  if (sleeved)
  {
    NoFriction(contacts);
    if (this->Sleeve->Opened(this->BehindSleeve(segment)))
    {
      OnlyAcross(this->Rod_.Axis(segment), contacts);
    }
    return;
  }
  for (int p = 0; p < contacts.count; ++p)
  {
    contacts.plane[p].stiffness *= Hardening(contacts.plane[p].gap);
  }
  if (this->Trap_.Active())
  {
    held = this->Trap_.Meet(sample, this->SampleLength(segment), contacts);
    if (held == TrappedWire::At::Held)
    {
      return;
    }
  }
  this->Room.plugs.Meet(sample, reach, contacts);
}

Eigen::Quaterniond DrivenWire::HeldOrientation(const PathPlace& place) const
{
  const double angle = this->Behind.Angle();
  const Vector3 first =
    std::cos(angle) * place.side + std::sin(angle) * place.tangent.cross(place.side);
  Matrix3 frame;
  frame.col(2) = -place.tangent; // from the tip backwards
  frame.col(0) = first;
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return Eigen::Quaterniond(frame);
}

/// By which the rod's end is turned: it lags behind what it hangs on.
double DrivenWire::EndAngle() const
{
  return this->Behind.Angle() - this->Rod_.Lag(this->Rod_.Size() - 1);
}

void DrivenWire::AppendSegment()
{
  const std::int64_t i = this->Rod_.Size();
  const PathPlace place = this->Room.path->At(this->Fed_ - this->Places_[i]);
  const double lag = i > 0 ? this->Rod_.Lag(i - 1) : 0.0;
  this->Rod_.Append(this->Segments_[i], this->Joints[i], place.position,
    this->HeldOrientation(place) * Eigen::Quaterniond(Eigen::AngleAxisd(lag, Vector3::UnitZ())));
}

void DrivenWire::PlaceOnPath()
{
  const double datum = this->Room.catheterTip - this->Room.settings.insideCatheter;
  while (this->Rod_.Size() < MinimumSegments ||
    this->Fed_ - this->Places_[this->Rod_.Size() - 1] > datum)
  {
    this->AppendSegment();
  }
  const std::int64_t last = this->Rod_.Size() - 1;
  this->Rod_.Prescribe(last, this->Rod_.Position(last), this->Rod_.Orientation(last));
}

BalloonOnWire::Rail DrivenWire::Rail() const
{
  return { this->Fed_, this->Room.catheterTip, &this->Places_, &this->Segments_, &this->Joints };
}

void DrivenWire::Advance(double way, double turn)
{
  this->HandAngle += turn;
  this->Fed_ += way;
}

double DrivenWire::Thrust() const
{
  // Of the joint next to the tip, along it.
  std::int64_t i = 0;
  while (i + 2 < this->Rod_.Size() && this->Places_[i + 1] < this->Beyond())
  {
    ++i;
  }
  return -this->Rod_.JointForce(i).dot(this->Rod_.Axis(i));
}

void DrivenWire::Feed()
{
  const double torque = this->Behind.Stiffness() * this->Rod_.Lag(this->Rod_.Size() - 1);
  const double datum = this->Room.catheterTip - this->Room.settings.insideCatheter;
  const double minimum = datum + this->Places_[MinimumSegments - 1];
  if (this->Fed_ < minimum)
  {
    this->Say(Notice::WireAtTip);
    this->Fed_ = minimum;
  }
  // In the guide it goes back with the wire.
  if (this->Sleeve && this->Sleeve->Tip() > this->Room.catheterTip &&
    this->Fed_ < this->Sleeve->LeastWire())
  {
    this->Say(Notice::WireAtMicrocatheter);
    this->Fed_ = this->Sleeve->LeastWire();
  }
  const double most = datum + this->Places_[this->Room.settings.capacity - 1];
  if (this->Fed_ > most)
  {
    this->Say(Notice::WireAtEnd);
    this->Fed_ = most;
  }
  this->DriveBehind();
  while (this->Fed_ - this->Places_[this->Rod_.Size() - 1] > datum &&
    this->Rod_.Size() < this->Room.settings.capacity)
  {
    this->Rod_.Release(this->Rod_.Size() - 1);
    this->AppendSegment();
  }
  while (this->Rod_.Size() > MinimumSegments &&
    this->Fed_ - this->Places_[this->Rod_.Size() - 2] < datum)
  {
    this->Rod_.RemoveLast();
  }
  const std::int64_t last = this->Rod_.Size() - 1;
  const PathPlace place = this->Room.path->At(this->Fed_ - this->Places_[last]);
  this->Rod_.Prescribe(last, place.position, this->HeldOrientation(place));
  this->Rod_.HangOnSpring(last, this->Behind.Stiffness(), torque / this->Behind.Stiffness());
}

/// The wire behind the rod, within the guide: what the rod's end hangs on.
void DrivenWire::DriveBehind()
{
  const double tip = this->Room.catheterTip - this->LastCatheterTip;
  this->Behind.Drive(this->Fed_ - this->Room.catheterTip, this->Fed_ - this->LastFed - tip,
    this->HandAngle, this->Room.catheterAngle - this->LastCatheterAngle);
  this->LastFed = this->Fed_;
  this->LastCatheterTip = this->Room.catheterTip;
  this->LastCatheterAngle = this->Room.catheterAngle;
}

void DrivenWire::PutBack()
{
  // A sample whose centre is outside of the lumen: its segment is moved in. Rare; counted and told.
  for (const RodContact& contact : this->Rod_.Contacts())
  {
    const std::int64_t i = contact.segment;
    const double radius = this->Segments_[i].radius;
    const std::int64_t index = i * this->Rod_.SamplesPerSegment() + contact.sample;
    if (contact.gap > -0.9 * radius || !this->InVessel[index] || i + 1 == this->Rod_.Size())
    {
      continue;
    }
    ContactSample sample;
    sample.index = index + this->FirstSample;
    sample.centre = this->Rod_.SamplePoint(i, contact.sample);
    sample.radius = radius;
    WallPlace place;
    Vector3 velocity = Vector3::Zero();
    if (this->Lumen.Outside(sample, place, velocity))
    {
      const Vector3 inward = place.point - sample.centre;
      const double distance = inward.norm();
      const Vector3 move = distance > 1e-9
        ? Vector3(inward * ((distance + 0.5 * radius) / distance))
        : Vector3::Zero();
      this->Rod_.Place(i, this->Rod_.Position(i) + move, this->Rod_.Orientation(i));
      this->Rod_.SetVelocity(i, velocity, Vector3::Zero());
      ++this->PutBack_;
      this->Say(Notice::PutBack);
    }
  }
}

void DrivenWire::KeepSane()
{
  this->Last.position.clear();
  this->Last.orientation.clear();
  for (std::int64_t i = 0; i < this->Rod_.Size(); ++i)
  {
    this->Last.position.push_back(this->Rod_.Position(i));
    this->Last.orientation.push_back(this->Rod_.Orientation(i));
  }
  this->Last.fed = this->Fed_;
  this->Last.angle = this->EndAngle();
}

void DrivenWire::Reset()
{
  this->Say(Notice::Reset);
  this->Fed_ = this->LastFed = this->Last.fed;
  this->Behind.Rest(this->HandAngle, this->Last.angle);
  this->DriveBehind();
  const std::int64_t count = static_cast<std::int64_t>(this->Last.position.size());
  while (this->Rod_.Size() > count)
  {
    this->Rod_.RemoveLast();
  }
  while (this->Rod_.Size() < count)
  {
    this->Rod_.Release(this->Rod_.Size() - 1);
    this->AppendSegment();
  }
  for (std::int64_t i = 0; i < count; ++i)
  {
    this->Rod_.Place(i, this->Last.position[i], this->Last.orientation[i]);
  }
  this->Rod_.HangOnSpring(
    count - 1, this->Behind.Stiffness(), this->Behind.Angle() - this->Last.angle);
}

void DrivenWire::Step(double seconds)
{
  this->PutBack_ = 0;
  const RodStep& step = this->Rod_.Step(seconds, this);
  if (!step.finite || step.maximumGap > 5.0)
  {
    this->Reset();
  }
  else
  {
    this->PutBack();
    this->CapForce = this->Room.plugs.Press(this->Rod_);
    if (this->Room.tick % 200 == 0 && step.maximumGap < 0.05 && this->PutBack_ == 0)
    {
      this->KeepSane();
    }
  }
  this->Settle();
}

/// What the hand feels now, and where the tip is.
void DrivenWire::Settle()
{
  const std::int64_t last = this->Rod_.Size() - 1;
  Vector3 force;
  Vector3 torque;
  this->Rod_.Reaction(last, force, torque);
  const Vector3 forward = -this->Rod_.Axis(last);
  this->Behind.Settle(force.dot(forward), this->EndAngle());
  WireReport& report = this->Report_;
  report.inserted = std::max(0.0, this->Beyond());
  report.force = this->Behind.AtHand().force;
  if (report.inserted <= 0.0)
  {
    report.branch = -1;
  }
  else if (this->Room.tick % 20 == 0)
  {
    ContactSample tip;
    const std::int64_t index = this->Rod_.SamplesPerSegment() - 1;
    tip.index = index + this->FirstSample;
    tip.centre = this->Rod_.FirstEnd(0);
    tip.radius = this->Segments_[0].radius;
    report.branch = this->InVessel[index] ? this->Lumen.BranchAt(tip) : -1;
  }
  this->MeasureTrap();
}

void DrivenWire::MeasureTrap()
{
  WireReport& report = this->Report_;
  report.held = report.grip = 0.0;
  report.jailed = false;
  if (!this->Trap_.Active())
  {
    return;
  }
  using At = TrappedWire::At;
  const std::int64_t samples = this->Rod_.SamplesPerSegment();
  bool beside = false;
  for (std::int64_t index = 0; index < this->Rod_.Size() * samples; ++index)
  {
    beside = beside || this->Held[index] == At::Beside;
    report.held += this->Held[index] == At::Held ? this->SampleLength(index / samples) : 0.0;
  }
  for (const RodContact& contact : this->Rod_.Contacts())
  {
    report.grip += this->Held[contact.segment * samples + contact.sample] == At::Held
      ? std::abs(contact.friction.dot(this->Rod_.Axis(contact.segment)))
      : 0.0;
  }
  report.jailed = this->Trap_.Jailed();
  this->Trap_.Found(beside || report.held > 0.0);
}

void DrivenWire::Measure(TickReport& report) const
{
  report.inserted = this->Report_.inserted;
  report.branch = this->Report_.branch;
  report.capForce = this->CapForce;
  report.jointGap = this->Rod_.LastStep().maximumGap;
  report.tipForce = report.tipThrust = 0.0;
  report.maximumForce = 0.0;
  report.contacts = 0;
  report.maximumPenetration = 0.0;
  report.meanPenetration = 0.0;
  for (const RodContact& contact : this->Rod_.Contacts())
  {
    const std::int64_t index = contact.segment * this->Rod_.SamplesPerSegment() + contact.sample;
    // An open balloon's force on the wall is that of its balance.
    if (!this->InVessel[index] || this->Held[index] == TrappedWire::At::Held ||
      (this->Sleeve && this->Sleeve->Opened(this->BehindSleeve(contact.segment))))
    {
      continue;
    }
    const double force = std::hypot(contact.force, contact.friction.norm());
    const double depth = std::max(0.0, -contact.gap);
    ++report.contacts;
    report.maximumForce = std::max(report.maximumForce, force);
    report.maximumPenetration = std::max(report.maximumPenetration, depth);
    report.meanPenetration += depth;
    if (this->Places_[contact.segment] < 3.0 && !this->Room.plugs.Holds(contact))
    {
      report.tipForce += force;
      if (contact.segment == 0)
      {
        // What is in front of it pushes it back; along what is oblique it slides.
        const double along = contact.normal.dot(this->Rod_.Axis(0));
        report.tipThrust += along > HeadOn ? contact.force * along : 0.0;
      }
    }
  }
  if (report.contacts > 0)
  {
    report.meanPenetration /= report.contacts;
  }
  const HandLoad& felt = this->Behind.AtHand();
  report.proximalForce = felt.force;
  report.proximalTorque = felt.torque;
}

void DrivenWire::Line(std::vector<Vector3>& line) const
{
  line.clear();
  const std::int64_t count = this->Rod_.Size();
  line.push_back(this->Rod_.FirstEnd(0));
  for (std::int64_t i = 0; i + 1 < count; ++i)
  {
    line.push_back(0.5 * (this->Rod_.LastEnd(i) + this->Rod_.FirstEnd(i + 1)));
  }
  line.push_back(this->Rod_.LastEnd(count - 1));
}
}
