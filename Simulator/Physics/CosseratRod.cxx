#include "CosseratRod.h"

#include "Fnv1a.h"
#include "Numbers.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr int MostRounds = 12;        // in which contacts are added to an iteration
constexpr double PressDepth = 0.005;  // mm
constexpr double MinimumCalm = 0.02;  // N/mm
constexpr double MostCalm = 100.0;    // N/mm
constexpr double HoldStiffness = 1e8; // N/mm and N mm/rad
constexpr double TurnArm = 0.25;      // mm, at which a turn counts as a move across

Matrix3 Cross(const Vector3& v)
{
  Matrix3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// The inverse of the right Jacobian of the exponential map: how a rotation vector changes with a turn.
Matrix3 InverseRightJacobian(const Vector3& angle)
{
  const double square = angle.squaredNorm();
  // 1/t^2 - (1 + cos t)/(2 t sin t), by its series where that loses digits.
  double factor;
  if (square < 1e-2)
  {
    factor = 1.0 / 12.0 + square / 720.0 + square * square / 30240.0;
  }
  else
  {
    const double t = std::sqrt(square);
    factor = 1.0 / square - 0.5 / t / std::tan(0.5 * t);
  }
  const Matrix3 cross = Cross(angle);
  return Matrix3::Identity() + 0.5 * cross +
    factor * (angle * angle.transpose() - square * Matrix3::Identity());
}

struct ContactForce
{
  double force;
  double slope;
};

/// Nothing beyond `softness`, linear inside the wall, and smooth between.
ContactForce ContactLaw(double gap, double stiffness, double softness)
{
  const double depth = softness - gap;
  if (depth <= 0.0)
  {
    return { 0.0, 0.0 };
  }
  if (depth < softness)
  {
    return { 0.5 * stiffness * depth * depth / softness, stiffness * depth / softness };
  }
  return { stiffness * (depth - 0.5 * softness), stiffness };
}

double ContactPotential(double gap, double stiffness, double softness)
{
  const double depth = softness - gap;
  if (depth <= 0.0)
  {
    return 0.0;
  }
  if (depth < softness)
  {
    return stiffness * depth * depth * depth / (6.0 * softness);
  }
  const double inside = depth - softness;
  return stiffness * (softness * softness / 6.0 + 0.5 * softness * inside + 0.5 * inside * inside);
}

void RequirePositive(double value, const char* name)
{
  if (!(value > 0.0) || !std::isfinite(value))
  {
    throw std::invalid_argument(
      std::string(name) + " must be positive and finite, not " + std::to_string(value));
  }
}

}

Vector3 RotationVector(const Eigen::Quaterniond& rotation)
{
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const Vector3 imaginary = sign * rotation.vec();
  const double sine = imaginary.norm();
  const double cosine = sign * rotation.w();
  const double square = sine * sine;
  if (square < 4e-3)
  {
    // 2 asin(s) / s for a unit quaternion, to the last digits, and without a transcendental function.
    const double series = 1.0 +
      square *
        (1.0 / 6.0 +
          square *
            (3.0 / 40.0 +
              square *
                (15.0 / 336.0 +
                  square *
                    (105.0 / 3456.0 +
                      square * (945.0 / 42240.0 + square * (10395.0 / 599040.0))))));
    return (2.0 * series) * imaginary;
  }
  return (2.0 * std::atan2(sine, cosine) / sine) * imaginary;
}

Eigen::Quaterniond RotationOf(const Vector3& vector)
{
  const double square = vector.squaredNorm();
  if (square < 1e-2)
  {
    // By their series, to the last digits.
    const double half = 0.25 * square;
    const double cosine =
      1.0 - half * (0.5 - half * (1.0 / 24.0 - half * (1.0 / 720.0 - half * (1.0 / 40320.0))));
    const double sine = 0.5 *
      (1.0 - half * (1.0 / 6.0 - half * (1.0 / 120.0 - half * (1.0 / 5040.0 - half / 362880.0))));
    return Eigen::Quaterniond(cosine, sine * vector.x(), sine * vector.y(), sine * vector.z());
  }
  const double angle = std::sqrt(square);
  const double factor = std::sin(0.5 * angle) / angle;
  return Eigen::Quaterniond(
    std::cos(0.5 * angle), factor * vector.x(), factor * vector.y(), factor * vector.z());
}

RodSegment MakeRodSegment(double length, double radius, double density)
{
  RodSegment segment;
  segment.length = length;
  segment.radius = radius;
  // 1 kg/m^3 = 1e-12 t/mm^3.
  segment.mass = density * 1e-12 * Pi * radius * radius * length;
  segment.axialInertia = 0.5 * segment.mass * radius * radius;
  segment.transverseInertia = segment.mass * (length * length / 12.0 + radius * radius / 4.0);
  return segment;
}

void RodSettings::Validate() const
{
  if (this->iterations < 1 || this->iterations > 1000)
  {
    throw std::invalid_argument(
      "iterations must be within 1 .. 1000, not " + std::to_string(this->iterations));
  }
  if (this->samples < 1 || this->samples > 4)
  {
    throw std::invalid_argument(
      "samples must be within 1 .. 4, not " + std::to_string(this->samples));
  }
  if (!(this->tolerance >= 0.0))
  {
    throw std::invalid_argument("tolerance must be 0 or more");
  }
  RequirePositive(this->reach, "reach");
  RequirePositive(this->softness, "softness");
  RequirePositive(this->frictionStiffness, "frictionStiffness");
  RequirePositive(this->maximumMove, "maximumMove");
}

RodSettings InstrumentRod()
{
  RodSettings rod;
  rod.mediumFollowsWalls = true;
  rod.reach = 0.08; // a little less than `trust`: what comes nearer is seen in the next tick
  rod.maximumMove = 1.0;
  rod.trust = 0.1;
  return rod;
}

CosseratRod::CosseratRod(std::int64_t capacity, const RodSettings& settings)
  : Settings(settings)
  , Capacity(capacity)
{
  settings.Validate();
  if (capacity < 1 || capacity > 1000000)
  {
    throw std::invalid_argument(
      "the capacity of a rod must be within 1 .. 1000000, not " + std::to_string(capacity));
  }
  this->Bodies.reserve(capacity);
  this->Joints.reserve(capacity);
  this->Carried.resize(capacity);
  this->Planes.reserve(2 * capacity * this->SamplesPerSegment());
  this->Touched.reserve(2 * capacity * this->SamplesPerSegment());
}

void CosseratRod::Append(const RodSegment& segment, const RodJoint& joint, const Vector3& position,
  const Eigen::Quaterniond& orientation)
{
  if (this->Size() >= this->Capacity)
  {
    throw std::length_error("the rod is at its capacity of " + std::to_string(this->Capacity));
  }
  RequirePositive(segment.length, "length of a segment");
  RequirePositive(segment.mass, "mass of a segment");
  RequirePositive(segment.transverseInertia, "transverse inertia of a segment");
  RequirePositive(segment.axialInertia, "axial inertia of a segment");
  RequirePositive(segment.radius, "radius of a segment");
  if (!(segment.drag >= 0.0) || !(segment.rotationalDrag >= 0.0) || !(segment.friction >= 0.0))
  {
    throw std::invalid_argument("drag and friction of a segment must be 0 or more");
  }
  if (!position.allFinite() || !orientation.coeffs().allFinite() || orientation.norm() < 1e-6)
  {
    throw std::invalid_argument("position and orientation of a segment must be finite");
  }
  if (!this->Bodies.empty())
  {
    RequirePositive(joint.stretchStiffness, "stretch stiffness of a joint");
    if (!(joint.angularStiffness.minCoeff() >= 0.0) || !joint.angularStiffness.allFinite() ||
      !joint.restAngle.allFinite() || !(joint.lossTime >= 0.0))
    {
      throw std::invalid_argument("stiffness of a joint must be finite and not negative");
    }
    JointState state;
    state.joint = joint;
    state.oldAngle = RotationVector(this->Bodies.back().orientation.conjugate() * orientation);
    this->Joints.push_back(state);
  }
  Body body;
  body.segment = segment;
  body.position = position;
  body.orientation = orientation.normalized();
  body.axis = body.orientation * Vector3::UnitZ();
  this->Bodies.push_back(body);
}

void CosseratRod::RemoveLast()
{
  if (this->Bodies.empty())
  {
    throw std::logic_error("the rod has no segment to remove");
  }
  this->Bodies.pop_back();
  if (!this->Joints.empty())
  {
    this->Joints.pop_back();
  }
}

Vector3 CosseratRod::Axis(std::int64_t i) const
{
  return this->Bodies[i].axis;
}

Vector3 CosseratRod::FirstEnd(std::int64_t i) const
{
  const Body& body = this->Bodies[i];
  return body.position - 0.5 * body.segment.length * body.axis;
}

Vector3 CosseratRod::LastEnd(std::int64_t i) const
{
  const Body& body = this->Bodies[i];
  return body.position + 0.5 * body.segment.length * body.axis;
}

int CosseratRod::SamplesOf(std::int64_t i) const
{
  const int own = this->Bodies[i].segment.samples;
  return own > 0 ? std::min(own, this->Settings.samples) : this->Settings.samples;
}

double CosseratRod::SampleOffset(std::int64_t i, int sample) const
{
  const double length = this->Bodies[i].segment.length;
  if (sample == this->Settings.samples)
  {
    return -0.5 * length; // the free end of the first segment
  }
  return ((sample + 0.5) / this->SamplesOf(i) - 0.5) * length;
}

Vector3 CosseratRod::SamplePoint(std::int64_t i, int sample) const
{
  return this->Bodies[i].position + this->SampleOffset(i, sample) * this->Bodies[i].axis;
}

void CosseratRod::Place(
  std::int64_t i, const Vector3& position, const Eigen::Quaterniond& orientation)
{
  Body& body = this->Bodies[i];
  body.position = position;
  body.orientation = orientation.normalized();
  body.axis = body.orientation * Vector3::UnitZ();
  body.heldPosition = body.position;
  body.heldOrientation = body.orientation;
  body.velocity.setZero();
  body.turning.setZero();
  for (std::int64_t j = std::max<std::int64_t>(i - 1, 0); j < std::min(i + 1, this->Size() - 1);
       ++j)
  {
    this->Joints[j].oldAngle =
      RotationVector(this->Bodies[j].orientation.conjugate() * this->Bodies[j + 1].orientation);
  }
}

void CosseratRod::Prescribe(
  std::int64_t i, const Vector3& position, const Eigen::Quaterniond& orientation)
{
  Body& body = this->Bodies[i];
  body.held = true;
  body.heldPosition = position;
  body.heldOrientation = orientation.normalized();
}

void CosseratRod::HangOnSpring(std::int64_t i, double stiffness, double lag)
{
  this->Bodies[i].spring = stiffness;
  this->Bodies[i].lag = lag;
}

void CosseratRod::Release(std::int64_t i)
{
  this->Bodies[i].held = false;
  this->Bodies[i].spring = 0.0;
}

void CosseratRod::SetVelocity(std::int64_t i, const Vector3& velocity, const Vector3& turning)
{
  this->Bodies[i].velocity = velocity;
  this->Bodies[i].turning = turning;
}

void CosseratRod::Predict(double seconds)
{
  // Newton's method begins with the rod as it was, carried along by the walls that are near it, and by those
  // segments that are held. Not by its own velocity: that is full of quick shakes of single segments, and turned by
  // them the rod would be a bad beginning, and the next step's would be worse.
  const std::int64_t count = this->Size();
  std::int64_t known = -1;
  for (std::int64_t i = 0; i < count; ++i)
  {
    Body& body = this->Bodies[i];
    body.oldPosition = body.position;
    body.oldOrientation = body.orientation;
    Vector3 way;
    if (body.held)
    {
      way = body.heldPosition - body.position;
      way -= body.axis * body.axis.dot(way); // what is fed in does not move the rest sideways
    }
    else if (body.nearWalls > 0)
    {
      way = seconds * body.wallVelocity;
    }
    else
    {
      continue;
    }
    this->Carried[i] = way;
    for (std::int64_t k = known + 1; k < i; ++k)
    {
      const double share =
        known < 0 ? 1.0 : static_cast<double>(k - known) / static_cast<double>(i - known);
      this->Carried[k] =
        share * way + (known < 0 ? Vector3(Vector3::Zero()) : (1.0 - share) * this->Carried[known]);
    }
    known = i;
  }
  for (std::int64_t k = known + 1; k < count; ++k)
  {
    this->Carried[k] = known < 0 ? Vector3(Vector3::Zero()) : this->Carried[known];
  }
  double maximum = 0.0;
  for (std::int64_t i = 0; i < count; ++i)
  {
    maximum = std::max(maximum, this->Carried[i].squaredNorm());
  }
  maximum = std::sqrt(maximum);
  const double share =
    maximum > this->Settings.maximumMove ? this->Settings.maximumMove / maximum : 1.0;
  for (std::int64_t i = 0; i < count; ++i)
  {
    Body& body = this->Bodies[i];
    if (body.held)
    {
      body.position = body.heldPosition;
      body.orientation =
        body.heldOrientation * Eigen::Quaterniond(Eigen::AngleAxisd(body.lag, Vector3::UnitZ()));
      body.axis = body.orientation * Vector3::UnitZ();
      body.freePosition = body.position;
      body.freeOrientation = body.orientation;
      continue;
    }
    body.freePosition = body.position + seconds * body.velocity;
    body.freeOrientation = RotationOf(seconds * body.turning) * body.orientation;
    const std::int64_t first = std::max<std::int64_t>(i - 1, 0);
    const std::int64_t last = std::min(i + 1, count - 1);
    if (first < last)
    {
      const double length =
        (this->Bodies[last].oldPosition - this->Bodies[first].oldPosition).norm();
      const Vector3 difference = this->Carried[last] - this->Carried[first];
      if (length > 0.0)
      {
        body.orientation =
          RotationOf((share / length) * body.axis.cross(difference)) * body.orientation;
      }
    }
    if (this->Settings.mediumFollowsWalls)
    {
      body.medium = this->Carried[i] / seconds;
    }
    body.position += share * this->Carried[i];
    body.axis = body.orientation * Vector3::UnitZ();
  }
}

void CosseratRod::FindContacts(double seconds, ContactSurface& surface)
{
  this->Planes.clear();
  const int perSegment = this->SamplesPerSegment();
  SampleContacts found;
  for (std::int64_t i = 0; i < this->Size(); ++i)
  {
    Body& body = this->Bodies[i];
    body.nearWalls = 0;
    body.wallVelocity.setZero();
    const int along = this->SamplesOf(i);
    const int samples = along + (i == 0 && this->Settings.tipSample ? 1 : 0);
    for (int k = 0; k < samples; ++k)
    {
      const int s = k < along ? k : this->Settings.samples; // the free end comes last
      const Vector3 arm = this->SampleOffset(i, s) * body.axis;
      ContactSample sample;
      sample.index = i * perSegment + s;
      sample.centre = body.position + arm;
      sample.radius = body.segment.radius;
      sample.friction = body.segment.friction;
      found.count = 0;
      if (!body.held)
      {
        surface.Find(sample, this->Settings.reach, found);
      }
      std::array<bool, 2> kept{ false, false };
      for (int p = 0; p < found.count; ++p)
      {
        const ContactPlane& plane = found.plane[p];
        ++body.nearWalls;
        body.wallVelocity += (plane.wallVelocity - body.wallVelocity) / body.nearWalls;
        const int identity = plane.identity == 0 ? 0 : 1;
        kept[identity] = true;
        Plane state;
        state.contact.segment = i;
        state.contact.sample = s;
        state.contact.normal = plane.normal;
        state.contact.point = sample.centre;
        state.arm = arm;
        state.guess = sample.centre;
        state.gapThere = plane.gap;
        state.radius = sample.radius;
        state.stiffness = plane.stiffness;
        state.friction = plane.friction;
        state.wallMotion = seconds * plane.wallVelocity;
        state.memory = &body.memory[s][identity];
        this->Planes.push_back(state);
      }
      for (int identity = 0; identity < 2; ++identity)
      {
        if (!kept[identity])
        {
          body.memory[s][identity] = Memory();
        }
      }
    }
  }
}

void CosseratRod::AssembleBodies(double seconds)
{
  const double rate = 1.0 / seconds;
  const double calm = this->Calm;
  for (Body& body : this->Bodies)
  {
    if (body.held)
    {
      body.matrix.setIdentity();
      body.right.setZero();
      if (body.spring > 0.0)
      {
        // Free to turn about its axis only.
        const Matrix3 about = body.axis * body.axis.transpose();
        body.matrix *= HoldStiffness;
        body.matrix.bottomRightCorner<3, 3>() +=
          (body.spring + body.segment.rotationalDrag * rate - HoldStiffness) * about;
        body.right.tail<3>() = -body.spring * body.lag * body.axis;
      }
      continue;
    }
    const RodSegment& segment = body.segment;
    const double inertial = segment.mass * rate * rate;
    body.matrix.setZero();
    body.matrix.diagonal().head<3>().setConstant(inertial + segment.drag * rate);
    const Matrix3 inertia = (rate * rate) *
      (segment.transverseInertia * Matrix3::Identity() +
        (segment.axialInertia - segment.transverseInertia) * body.axis * body.axis.transpose());
    body.matrix.bottomRightCorner<3, 3>() =
      inertia + segment.rotationalDrag * rate * Matrix3::Identity();
    if (calm > 0.0)
    {
      // Against moves across, from where the walls carry it: what is fed in along the rod is not held back.
      body.matrix.topLeftCorner<3, 3>() +=
        calm * (Matrix3::Identity() - body.axis * body.axis.transpose());
      body.matrix.diagonal().tail<3>().array() += calm * TurnArm * TurnArm;
    }
    const Vector3 moved = body.position - body.oldPosition;
    body.right.head<3>() = body.force - inertial * (body.position - body.freePosition) -
      segment.drag * (rate * moved - body.medium);
    body.right.tail<3>() =
      body.torque - inertia * RotationVector(body.orientation * body.freeOrientation.conjugate());
    if (segment.rotationalDrag > 0.0)
    {
      body.right.tail<3>() -= segment.rotationalDrag * rate *
        RotationVector(body.orientation * body.oldOrientation.conjugate());
    }
  }
}

void CosseratRod::AssembleJoints(double seconds, bool exact)
{
  const std::int64_t joints = this->Size() - 1;
  for (std::int64_t j = 0; j < joints; ++j)
  {
    Body& a = this->Bodies[j];
    Body& b = this->Bodies[j + 1];
    JointState& state = this->Joints[j];
    const RodJoint& joint = state.joint;
    const double k = joint.stretchStiffness;
    const Vector3 da = 0.5 * a.segment.length * a.axis;
    const Vector3 db = -0.5 * b.segment.length * b.axis;
    state.gap = a.position + da - b.position - db;
    const Vector3 force = -k * state.gap;

    state.angle = RotationVector(a.orientation.conjugate() * b.orientation);
    const Matrix3 turned = b.orientation.toRotationMatrix();
    state.map.noalias() = InverseRightJacobian(state.angle) * turned.transpose();
    // Implicit in the rate as well: moment = K (angle + loss (angle - old)/dt).
    const double share = joint.lossTime / seconds;
    const Vector3 stiffness = (1.0 + share) * joint.angularStiffness;
    const Vector3 moment = joint.angularStiffness.cwiseProduct(
      state.angle - joint.restAngle + share * (state.angle - state.oldAngle));
    const Matrix3 weighted = stiffness.asDiagonal() * state.map;
    Matrix3 bend;
    bend.noalias() = state.map.transpose() * weighted;
    const Vector3 turn = state.map.transpose() * moment;

    // How force and moment of the joint change their arms with the turns of the segments. Where that makes the
    // matrix indefinite (something is about to buckle) only what holds the segments up is kept.
    const Vector3& pull = state.force;
    Matrix3 levelA;
    Matrix3 levelB;
    Matrix3 twist = Matrix3::Zero();
    if (exact)
    {
      const Matrix3 armA = 0.5 * da * pull.transpose();
      const Matrix3 armB = -0.5 * db * pull.transpose();
      levelA = -armA - armA.transpose();
      levelA.diagonal().array() += pull.dot(da);
      levelB = -armB - armB.transpose();
      levelB.diagonal().array() -= pull.dot(db);
      twist = 0.5 * Cross(turn);
    }
    else
    {
      const double ga = std::max(0.0, pull.dot(da));
      const double gb = std::max(0.0, -pull.dot(db));
      levelA = ga * (Matrix3::Identity() - a.axis * a.axis.transpose());
      levelB = gb * (Matrix3::Identity() - b.axis * b.axis.transpose());
    }

    const Matrix3 crossA = k * Cross(da);
    const Matrix3 crossB = k * Cross(db);
    // -[d][d] = |d|^2 I - d d'
    const bool fixedA = a.held && a.spring <= 0.0;
    const bool fixedB = b.held && b.spring <= 0.0;
    if (!fixedA)
    {
      a.matrix.diagonal().head<3>().array() += k;
      a.matrix.topRightCorner<3, 3>() -= crossA;
      a.matrix.bottomLeftCorner<3, 3>() += crossA;
      a.matrix.bottomRightCorner<3, 3>() += bend + levelA - k * da * da.transpose();
      a.matrix.diagonal().tail<3>().array() += k * da.squaredNorm();
      a.right.head<3>() += force;
      a.right.tail<3>() += da.cross(force) + turn;
    }
    if (!fixedB)
    {
      b.matrix.diagonal().head<3>().array() += k;
      b.matrix.topRightCorner<3, 3>() -= crossB;
      b.matrix.bottomLeftCorner<3, 3>() += crossB;
      b.matrix.bottomRightCorner<3, 3>() += bend + levelB - k * db * db.transpose();
      b.matrix.diagonal().tail<3>().array() += k * db.squaredNorm();
      b.right.head<3>() -= force;
      b.right.tail<3>() -= db.cross(force) + turn;
    }
    if (fixedA || fixedB)
    {
      a.coupling.setZero();
    }
    else
    {
      a.coupling.topLeftCorner<3, 3>() = -k * Matrix3::Identity();
      a.coupling.topRightCorner<3, 3>() = crossB;
      a.coupling.bottomLeftCorner<3, 3>() = -crossA;
      // [da][db] = db da' - (da.db) I
      a.coupling.bottomRightCorner<3, 3>() = k * db * da.transpose() - bend + twist;
      a.coupling.diagonal().tail<3>().array() -= k * da.dot(db);
    }
  }
}

void CosseratRod::AssembleContacts(bool first)
{
  const double softness = this->Settings.softness;
  const double hold = this->Settings.frictionStiffness;
  for (Plane& plane : this->Planes)
  {
    Body& body = this->Bodies[plane.contact.segment];
    const Vector3& n = plane.contact.normal;
    const double offset = this->SampleOffset(plane.contact.segment, plane.contact.sample);
    plane.arm = offset * body.axis;
    plane.contact.point = body.position + plane.arm;
    plane.gapLinear = plane.gapThere + n.dot(plane.contact.point - plane.guess);
    const ContactForce law = plane.pressed
      ? ContactForce{ plane.stiffness * (0.5 * softness - plane.gapLinear), plane.stiffness }
      : ContactLaw(plane.gapLinear, plane.stiffness, softness);
    plane.law = law.force;
    plane.slope = law.slope;
    plane.lever = plane.arm - plane.radius * n;
    plane.pull.setZero();
    plane.tangent.setZero();
    plane.slipping = false;
    if (law.slope <= 0.0)
    {
      continue;
    }
    const Matrix3 tangential = Matrix3::Identity() - n * n.transpose();
    if (plane.friction > 0.0 && law.force > 0.0)
    {
      // How far the rod's surface has slid over the wall in this step, beside what was sheared before.
      const Vector3 turned = RotationVector(body.orientation * body.oldOrientation.conjugate());
      const Vector3 moved = body.position - body.oldPosition + turned.cross(plane.lever);
      const Vector3 slid = tangential * (moved - plane.wallMotion);
      plane.shear = tangential * plane.memory->spring + slid;
      // What slid goes on to slide, as far as is known: the law is made linear there.
      const Vector3 expected =
        first ? Vector3(tangential * (plane.memory->spring + plane.memory->slide)) : plane.shear;
      const double limit = plane.friction * law.force;
      const double length = expected.norm();
      if (hold * length <= limit)
      {
        plane.tangent = hold * tangential;
        plane.pull = -hold * plane.shear;
      }
      else
      {
        const Vector3 way = expected / length;
        plane.tangent = (limit / length) * (tangential - way * way.transpose());
        plane.pull = -limit * way - plane.tangent * (plane.shear - expected);
        plane.slipping = true;
        plane.way = way;
      }
    }
    const Matrix3 stiffness = law.slope * n * n.transpose() + plane.tangent;
    const Matrix3 cross = Cross(plane.lever);
    const Matrix3 side = stiffness * cross;
    const Vector3 force = law.force * n + plane.pull;
    body.matrix.topLeftCorner<3, 3>() += stiffness;
    body.matrix.topRightCorner<3, 3>() -= side;
    body.matrix.bottomLeftCorner<3, 3>() += cross * stiffness;
    body.matrix.bottomRightCorner<3, 3>() -= cross * side;
    body.right.head<3>() += force;
    body.right.tail<3>() += plane.lever.cross(force);
  }
}

bool CosseratRod::Solve()
{
  // Block Cholesky factorization; `matrix` becomes the triangular factor L, `coupling` L^-1 of itself.
  const std::int64_t count = this->Size();
  for (std::int64_t i = 0; i < count; ++i)
  {
    Body& body = this->Bodies[i];
    double* l = body.matrix.data(); // column-major, lower triangle
    for (int c = 0; c < 6; ++c)
    {
      double* column = l + 6 * c;
      for (int k = 0; k < c; ++k)
      {
        const double* other = l + 6 * k;
        const double factor = other[c];
        for (int r = c; r < 6; ++r)
        {
          column[r] -= factor * other[r];
        }
      }
      if (!(column[c] > 0.0))
      {
        return false;
      }
      const double inverse = 1.0 / std::sqrt(column[c]);
      for (int r = c; r < 6; ++r)
      {
        column[r] *= inverse;
      }
      // The reciprocal of the diagonal is what the substitutions want.
      column[c] = inverse;
    }
    double* z = body.right.data();
    for (int c = 0; c < 6; ++c)
    {
      const double* column = l + 6 * c;
      z[c] *= column[c];
      for (int r = c + 1; r < 6; ++r)
      {
        z[r] -= column[r] * z[c];
      }
    }
    if (i + 1 == count)
    {
      break;
    }
    // Row by row, so that the six right-hand sides lie beside each other.
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> y = body.coupling;
    for (int c = 0; c < 6; ++c)
    {
      const double* column = l + 6 * c;
      y.row(c) *= column[c];
      for (int r = c + 1; r < 6; ++r)
      {
        y.row(r) -= column[r] * y.row(c);
      }
    }
    Body& next = this->Bodies[i + 1];
    next.matrix.noalias() -= y.transpose() * y;
    next.right.noalias() -= y.transpose() * body.right;
    body.coupling = y;
  }
  for (std::int64_t i = count - 1; i >= 0; --i)
  {
    Body& body = this->Bodies[i];
    if (i + 1 < count)
    {
      body.right.noalias() -= body.coupling * this->Bodies[i + 1].right;
    }
    const double* l = body.matrix.data();
    double* x = body.right.data();
    for (int c = 5; c >= 0; --c)
    {
      const double* column = l + 6 * c;
      for (int r = c + 1; r < 6; ++r)
      {
        x[c] -= column[r] * x[r];
      }
      x[c] *= column[c];
    }
  }
  return true;
}

double CosseratRod::SidewaysMove() const
{
  double most = 0.0;
  for (const Body& body : this->Bodies)
  {
    const Vector3 move = body.right.head<3>();
    const double along = move.dot(body.axis);
    most = std::max(most, move.squaredNorm() - along * along);
    most = std::max(most, TurnArm * TurnArm * body.right.tail<3>().squaredNorm());
  }
  return std::sqrt(std::max(0.0, most));
}

bool CosseratRod::ChangeContacts()
{
  // What the linear equations let go into a wall is taken for a contact in earnest within this step, and let go
  // again where it would hold the rod back: a light rod can cross the lumen within one step when a wall that held it
  // gives way.
  bool changed = false;
  for (Plane& plane : this->Planes)
  {
    if (plane.changes >= 4 || (!plane.pressed && plane.slope >= plane.stiffness))
    {
      continue;
    }
    const Body& body = this->Bodies[plane.contact.segment];
    const double change =
      plane.contact.normal.dot(body.right.head<3>() + body.right.tail<3>().cross(plane.arm));
    const double gap = plane.gapLinear + change;
    if (plane.pressed ? gap > this->Settings.softness : gap < -PressDepth)
    {
      plane.pressed = !plane.pressed;
      ++plane.changes;
      changed = true;
      ++this->Last.pressed;
    }
  }
  return changed;
}

double CosseratRod::Update(double& scale)
{
  double move = 0.0;
  double turn = 0.0;
  double sum = 0.0; // of all: a maximum passes over what is not a number
  for (const Body& body : this->Bodies)
  {
    const double moved = body.right.head<3>().squaredNorm();
    const double turned = body.right.tail<3>().squaredNorm();
    move = std::max(move, moved);
    turn = std::max(turn, turned);
    sum += moved + turned;
  }
  if (!std::isfinite(sum))
  {
    return std::numeric_limits<double>::infinity();
  }
  move = std::sqrt(move);
  turn = std::sqrt(turn);
  const double maximum = std::max(move, 2.0 * turn);
  scale = maximum > this->Settings.maximumMove ? this->Settings.maximumMove / maximum : 1.0;
  for (std::int64_t j = 0; j + 1 < this->Size(); ++j)
  {
    Body& a = this->Bodies[j];
    Body& b = this->Bodies[j + 1];
    JointState& state = this->Joints[j];
    const Vector3 da = 0.5 * a.segment.length * a.axis;
    const Vector3 db = -0.5 * b.segment.length * b.axis;
    const Vector3 gapChange = a.right.head<3>() - b.right.head<3>() + a.right.tail<3>().cross(da) -
      b.right.tail<3>().cross(db);
    // What Newton's method says of the force, which is better than what the gap afterwards says: the gap's
    // second order change times a great stiffness.
    state.force = -state.joint.stretchStiffness * (state.gap + scale * gapChange);
    state.angle += scale * (state.map * (b.right.tail<3>() - a.right.tail<3>()));
  }
  for (Body& body : this->Bodies)
  {
    body.right *= scale;
    if (!body.held)
    {
      body.position += body.right.head<3>();
      body.orientation = (RotationOf(body.right.tail<3>()) * body.orientation).normalized();
      body.axis = body.orientation * Vector3::UnitZ();
    }
    else if (body.spring > 0.0)
    {
      body.lag += body.right.tail<3>().dot(body.axis);
      body.orientation =
        body.heldOrientation * Eigen::Quaterniond(Eigen::AngleAxisd(body.lag, Vector3::UnitZ()));
    }
  }
  return scale * move;
}

void CosseratRod::Finish(double seconds)
{
  const double rate = 1.0 / seconds;
  for (std::int64_t j = 0; j + 1 < this->Size(); ++j)
  {
    JointState& state = this->Joints[j];
    const RodJoint& joint = state.joint;
    const Vector3 moment = joint.angularStiffness.cwiseProduct(
      state.angle - joint.restAngle + joint.lossTime * rate * (state.angle - state.oldAngle));
    state.moment = this->Bodies[j + 1].orientation * moment;
    state.localMoment = moment;
    const Vector3 gap = this->LastEnd(j) - this->FirstEnd(j + 1);
    this->Last.maximumGap = std::max(this->Last.maximumGap, gap.norm());
    state.oldAngle =
      RotationVector(this->Bodies[j].orientation.conjugate() * this->Bodies[j + 1].orientation);
  }
  for (Body& body : this->Bodies)
  {
    body.velocity = rate * (body.position - body.oldPosition);
    body.turning = rate * RotationVector(body.orientation * body.oldOrientation.conjugate());
  }
  this->Touched.clear();
  double sum = 0.0;
  for (Plane& plane : this->Planes)
  {
    Body& body = this->Bodies[plane.contact.segment];
    Memory& memory = *plane.memory;
    const Vector3& n = plane.contact.normal;
    const Vector3 change = body.right.head<3>() + body.right.tail<3>().cross(plane.arm);
    const double force = std::max(0.0, plane.law - plane.slope * n.dot(change));
    plane.contact.point = this->SamplePoint(plane.contact.segment, plane.contact.sample);
    plane.contact.gap = plane.gapThere + n.dot(plane.contact.point - plane.guess);
    plane.contact.force = force;
    if (force <= 0.0)
    {
      memory = Memory();
      continue;
    }
    Vector3 shear = Vector3::Zero();
    if (plane.friction > 0.0)
    {
      const Vector3 turned = seconds * body.turning;
      const Vector3 moved = body.position - body.oldPosition + turned.cross(plane.lever);
      Vector3 slid = moved - plane.wallMotion;
      slid -= n * n.dot(slid);
      // What gave way in the direction that was expected goes on; else it sticks, until it is seen to give way.
      memory.slide = plane.slipping && slid.dot(plane.way) <= 0.0 ? Vector3(Vector3::Zero()) : slid;
      shear = memory.spring + slid;
      shear -= n * n.dot(shear);
      // Coulomb: the spring gives way.
      const double limit = plane.friction * force / this->Settings.frictionStiffness;
      const double length = shear.norm();
      plane.contact.slips = length > limit;
      if (plane.contact.slips)
      {
        const Vector3 given = shear * (1.0 - limit / length);
        shear *= limit / length;
        this->Last.frictionWork += this->Settings.frictionStiffness * shear.dot(given);
      }
      plane.contact.friction = -this->Settings.frictionStiffness * shear;
    }
    memory.spring = shear;
    memory.force = force;
    this->Last.wallWork += (force * n + plane.contact.friction).dot(plane.wallMotion);
    ++this->Last.touching;
    const double depth = std::max(0.0, -plane.contact.gap);
    sum += depth;
    this->Last.maximumPenetration = std::max(this->Last.maximumPenetration, depth);
    this->Touched.push_back(plane.contact);
  }
  this->Last.meanPenetration = this->Last.touching > 0 ? sum / this->Last.touching : 0.0;
}

void CosseratRod::Restore()
{
  for (Body& body : this->Bodies)
  {
    body.position = body.oldPosition;
    body.orientation = body.oldOrientation;
    body.axis = body.orientation * Vector3::UnitZ();
    body.velocity.setZero();
    body.turning.setZero();
  }
  for (JointState& state : this->Joints)
  {
    state.force.setZero();
    state.moment.setZero();
  }
  this->Touched.clear();
}

const RodStep& CosseratRod::Step(double seconds, ContactSurface* surface)
{
  this->Last = RodStep();
  if (this->Bodies.empty())
  {
    this->Touched.clear();
    return this->Last;
  }
  this->Predict(seconds);
  this->Planes.clear();
  if (surface)
  {
    this->FindContacts(seconds, *surface);
  }
  for (int iteration = 0; iteration < this->Settings.iterations; ++iteration)
  {
    if (surface && iteration > 0 && this->Last.maximumUpdate > this->Settings.tolerance)
    {
      this->FindContacts(seconds, *surface); // planes do not follow a bent wall far
    }
    bool solved = false;
    bool exact = true;
    for (int round = 0; round < MostRounds; ++round)
    {
      this->AssembleBodies(seconds);
      this->AssembleJoints(seconds, exact);
      this->AssembleContacts(iteration == 0);
      solved = this->Solve();
      if (solved)
      {
        if (this->ChangeContacts())
        {
          continue;
        }
        const bool far = this->Settings.trust > 0.0 && this->SidewaysMove() > this->Settings.trust;
        if (!far || this->Calm >= MostCalm)
        {
          break;
        }
        this->Calm = std::max(MinimumCalm, 8.0 * this->Calm);
        ++this->Last.calmed;
      }
      else if (exact)
      {
        exact = false;
        ++this->Last.indefinite;
      }
      else
      {
        break;
      }
    }
    double scale = 1.0;
    this->Last.maximumUpdate =
      solved ? this->Update(scale) : std::numeric_limits<double>::infinity();
    if (!std::isfinite(this->Last.maximumUpdate))
    {
      this->Last.finite = false;
      this->Restore();
      return this->Last;
    }
    if (scale == 1.0 && this->Last.maximumUpdate < this->Settings.tolerance)
    {
      break;
    }
  }
  this->Finish(seconds);
  this->Calm = this->Calm > MinimumCalm ? 0.25 * this->Calm : 0.0;
  return this->Last;
}

void CosseratRod::Reaction(std::int64_t i, Vector3& force, Vector3& torque) const
{
  const Body& body = this->Bodies[i];
  force = -body.force;
  torque = -body.torque;
  if (i + 1 < this->Size())
  {
    const JointState& state = this->Joints[i];
    const Vector3 arm = 0.5 * body.segment.length * body.axis;
    force -= state.force;
    torque -= arm.cross(state.force) + state.map.transpose() * state.localMoment;
  }
  if (i > 0)
  {
    const JointState& state = this->Joints[i - 1];
    const Vector3 arm = -0.5 * body.segment.length * body.axis;
    force += state.force;
    torque += arm.cross(state.force) + state.map.transpose() * state.localMoment;
  }
}

double CosseratRod::ElasticEnergy() const
{
  double energy = 0.0;
  for (std::int64_t j = 0; j + 1 < this->Size(); ++j)
  {
    const RodJoint& joint = this->Joints[j].joint;
    const Vector3 bent =
      RotationVector(this->Bodies[j].orientation.conjugate() * this->Bodies[j + 1].orientation) -
      joint.restAngle;
    energy += 0.5 * joint.angularStiffness.dot(bent.cwiseAbs2());
    energy +=
      0.5 * joint.stretchStiffness * (this->LastEnd(j) - this->FirstEnd(j + 1)).squaredNorm();
  }
  return energy;
}

double CosseratRod::KineticEnergy() const
{
  double energy = 0.0;
  for (const Body& body : this->Bodies)
  {
    const double along = body.axis.dot(body.turning);
    energy += 0.5 * body.segment.mass * body.velocity.squaredNorm() +
      0.5 * body.segment.transverseInertia * (body.turning.squaredNorm() - along * along) +
      0.5 * body.segment.axialInertia * along * along;
  }
  return energy;
}

double CosseratRod::ContactEnergy() const
{
  double energy = 0.0;
  for (const Plane& plane : this->Planes)
  {
    if (plane.contact.force > 0.0)
    {
      energy += ContactPotential(plane.contact.gap, plane.stiffness, this->Settings.softness) +
        0.5 * this->Settings.frictionStiffness * plane.memory->spring.squaredNorm();
    }
  }
  return energy;
}

std::uint64_t CosseratRod::Hash(std::uint64_t seed) const
{
  std::uint64_t hash = Fnv1a(&this->Calm, sizeof(double), seed);
  for (const Body& body : this->Bodies)
  {
    hash = Fnv1a(body.position.data(), 3 * sizeof(double), hash);
    hash = Fnv1a(body.orientation.coeffs().data(), 4 * sizeof(double), hash);
    hash = Fnv1a(body.velocity.data(), 3 * sizeof(double), hash);
    hash = Fnv1a(body.turning.data(), 3 * sizeof(double), hash);
    hash = Fnv1a(&body.lag, sizeof(double), hash);
    for (const auto& sample : body.memory)
    {
      for (const Memory& memory : sample)
      {
        if (memory.force > 0.0)
        {
          hash = Fnv1a(memory.spring.data(), 3 * sizeof(double), hash);
          hash = Fnv1a(memory.slide.data(), 3 * sizeof(double), hash);
        }
      }
    }
  }
  return hash;
}
}
