// The rod against closed forms: bending, buckling, torsion, shape, contact and friction.
#include "CosseratRod.h"
#include "TableRow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

namespace UnitTestCosseratRod
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

struct Material
{
  double bending = 1.0;   // N mm^2
  double torsion = 0.8;   // N mm^2
  double stretch = 1e5;   // N
  double curvature = 0.0; // 1/mm, about the first axis
  double twist = 0.0;     // rad/mm
};

RodJoint JointOf(const Material& material, double length)
{
  RodJoint joint;
  joint.angularStiffness = Vector3(material.bending, material.bending, material.torsion) / length;
  joint.stretchStiffness = material.stretch / length;
  joint.restAngle = length * Vector3(material.curvature, 0.0, material.twist);
  return joint;
}

// Along z from the origin: the first segment's centre is there, so that a clamped one is half a segment before
// the first joint.
CosseratRod StraightRod(int joints, double length, const Material& material)
{
  const double step = length / joints;
  CosseratRod rod(joints + 3);
  for (int i = 0; i <= joints; ++i)
  {
    rod.Append(MakeRodSegment(step, 0.178, 6450.0), JointOf(material, step),
      Vector3(0.0, 0.0, i * step), Eigen::Quaterniond::Identity());
  }
  rod.Prescribe(0, rod.Position(0), rod.Orientation(0));
  return rod;
}

// Steps that are long against all periods of the rod: to where forces balance.
void Settle(
  CosseratRod& rod, ContactSurface* surface = nullptr, double seconds = 10.0, int most = 20000)
{
  rod.GetSettings().iterations = 1;
  int calm = 0;
  for (int k = 0; k < most && calm < 5; ++k)
  {
    ASSERT_TRUE(rod.Step(seconds, surface).finite);
    calm = rod.LastStep().maximumUpdate < 1e-11 ? calm + 1 : 0;
  }
  ASSERT_EQ(5, calm) << "did not settle: " << rod.LastStep().maximumUpdate;
}

double CantileverDeflection(int joints)
{
  CosseratRod rod = StraightRod(joints, 20.0, Material());
  rod.SetForce(joints, Vector3(1e-5, 0.0, 0.0));
  Settle(rod);
  return rod.Position(joints).x();
}

// Whether a disturbance, of the order of 1e-9 mm, grows to what can be seen.
bool Grows(CosseratRod& rod, const std::function<double(const CosseratRod&)>& size, int steps)
{
  for (int k = 0; k < steps && !(size(rod) > 1e-4); ++k)
  {
    if (!rod.Step(10.0).finite)
    {
      ADD_FAILURE() << "the step failed";
      return false;
    }
  }
  return size(rod) > 1e-4;
}

double Threshold(double low, double high, const std::function<bool(double)>& unstable)
{
  EXPECT_FALSE(unstable(low));
  EXPECT_TRUE(unstable(high));
  for (int k = 0; k < 12; ++k)
  {
    const double middle = 0.5 * (low + high);
    (unstable(middle) ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

struct Plane : ContactSurface
{
  double friction = 0.0;
  Vector3 velocity = Vector3::Zero();
  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override
  {
    const double gap = sample.centre.y() - sample.radius;
    contacts.count = 0;
    if (gap < reach)
    {
      contacts.count = 1;
      contacts.plane[0] = ContactPlane();
      contacts.plane[0].normal = Vector3::UnitY();
      contacts.plane[0].gap = gap;
      contacts.plane[0].friction = this->friction;
      contacts.plane[0].wallVelocity = this->velocity;
    }
  }
};

struct Cylinder : ContactSurface
{
  double radius = 10.0;
  double friction = 0.1;
  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override
  {
    const Vector3 across(sample.centre.x(), sample.centre.y(), 0.0);
    const double gap = across.norm() - this->radius - sample.radius;
    contacts.count = 0;
    if (gap < reach)
    {
      contacts.count = 1;
      contacts.plane[0] = ContactPlane();
      contacts.plane[0].normal = across.normalized();
      contacts.plane[0].gap = gap;
      contacts.plane[0].friction = this->friction;
    }
  }
};

// The inside of a torus about the y axis through (bend, 0, 0), that moves along x.
struct BentTube : ContactSurface
{
  double bend = 20.0;
  double lumen = 1.0;
  double friction = 0.0;
  double shift = 0.0;
  double velocity = 0.0;
  double Outside(const Vector3& point) const // distance from the axis less the lumen's radius
  {
    const Vector3 middle(this->bend + this->shift, 0.0, 0.0);
    Vector3 ring = point - middle;
    ring.y() = 0.0;
    return (point - middle - this->bend * ring.normalized()).norm() - this->lumen;
  }
  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override
  {
    const Vector3 middle(this->bend + this->shift, 0.0, 0.0);
    Vector3 ring = sample.centre - middle;
    ring.y() = 0.0;
    const Vector3 across = sample.centre - middle - this->bend * ring.normalized();
    const double gap = this->lumen - across.norm() - sample.radius;
    contacts.count = 0;
    if (gap < reach && across.norm() > 0.0)
    {
      contacts.count = 1;
      contacts.plane[0] = ContactPlane();
      contacts.plane[0].normal = -across.normalized();
      contacts.plane[0].gap = gap;
      contacts.plane[0].friction = this->friction;
      contacts.plane[0].wallVelocity = Vector3(this->velocity, 0.0, 0.0);
    }
  }
};

// A rod along the axis of such a tube, held at its last segment.
CosseratRod RodInTube(const BentTube& tube, int segments, double step, const Material& material)
{
  CosseratRod rod(segments);
  for (int i = 0; i < segments; ++i)
  {
    const double angle = (i + 0.5) * step / tube.bend;
    RodSegment segment = MakeRodSegment(step, 0.178, 6450.0);
    segment.drag = 2.5e-8 * step;
    segment.rotationalDrag = 1e-9;
    RodJoint joint = JointOf(material, step);
    joint.lossTime = 5e-4;
    rod.Append(segment, joint, tube.bend * Vector3(1.0 - std::cos(angle), 0.0, std::sin(angle)),
      Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3::UnitY())));
  }
  return rod;
}
}

TEST(CosseratRod, CantileverBendsAsFL3Over3EI)
{
  const double exact = 1e-5 * 20.0 * 20.0 * 20.0 / 3.0;
  const double error20 = CantileverDeflection(20) / exact - 1.0;
  const double error40 = CantileverDeflection(40) / exact - 1.0;
  EXPECT_LT(std::abs(error20), 1e-3);
  Row("cantilever, small tip load, 20 joints: deflection, mm", exact, exact * (1.0 + error20),
    "0.1 %");
  Row("the same, 40 joints", exact, exact * (1.0 + error40), "second order");
  EXPECT_NEAR(std::log2(error20 / error40), 2.0, 0.1) << error20 << ' ' << error40;
}

TEST(CosseratRod, ElasticaUnderAGreatTipLoad)
{
  // Bisshopp & Drucker 1945: F L^2 / EI = 5.
  const double length = 20.0;
  CosseratRod rod = StraightRod(20, length, Material());
  for (int k = 1; k <= 20; ++k)
  {
    rod.SetForce(20, Vector3(5.0 / (length * length) * k / 20.0, 0.0, 0.0));
    Settle(rod);
  }
  Row("elastica, F L^2 / EI = 5: w / L", 0.71379, rod.Position(20).x() / length, "0.2 %");
  Row("elastica: u / L", 0.38763, 1.0 - rod.Position(20).z() / length, "0.2 %");
  EXPECT_NEAR(rod.Position(20).x() / length, 0.71379, 0.002 * 0.71379);
  EXPECT_NEAR(1.0 - rod.Position(20).z() / length, 0.38763, 0.002 * 0.38763);
}

TEST(CosseratRod, EulerColumnBuckles)
{
  const double length = 20.0;
  const double euler = Pi * Pi / (4.0 * length * length);
  const double found = Threshold(0.9, 1.1,
    [&](double share)
    {
      CosseratRod rod = StraightRod(40, length, Material());
      rod.SetForce(40, Vector3(1e-12, 0.0, -share * euler));
      return Grows(
        rod, [](const CosseratRod& r) { return std::abs(r.Position(40).x()); }, 4000);
    });
  EXPECT_NEAR(found, 1.0, 0.005);
  Row("Euler column, clamped and free: P / (pi^2 EI / 4 L^2)", 1.0, found, "0.5 %");
}

TEST(CosseratRod, TorsionBetweenTwoHeldEnds)
{
  const double length = 50.0;
  Material material;
  for (const double turns : { 0.25, 1.0 })
  {
    CosseratRod rod = StraightRod(50, length, material);
    for (int k = 1; k <= 100; ++k)
    {
      rod.Prescribe(50, Vector3(0.0, 0.0, length),
        Eigen::Quaterniond(Eigen::AngleAxisd(2.0 * Pi * turns * k / 100.0, Vector3::UnitZ())));
      rod.Step(10.0);
    }
    Settle(rod);
    const double exact = material.torsion * 2.0 * Pi * turns / length;
    EXPECT_NEAR(rod.JointMoment(25).z(), exact, 1e-6 * exact);
    Row(turns < 1.0 ? "torsion, a quarter of a turn: N mm" : "torsion, one turn: N mm", exact,
      rod.JointMoment(25).z(), "0.5 %");
    Vector3 force, torque;
    rod.Reaction(50, force, torque);
    EXPECT_NEAR(torque.z(), exact, 1e-6 * exact);
    rod.Reaction(0, force, torque);
    EXPECT_NEAR(torque.z(), -exact, 1e-6 * exact);
  }
}

TEST(CosseratRod, TakesItsShapeAtRest)
{
  const double length = 15.0;
  Material material;
  material.curvature = 0.5 * Pi / length;
  CosseratRod rod = StraightRod(15, length, material);
  Settle(rod);
  const Vector3 tangent = rod.Axis(15);
  Row("shaped tip: angle of its end, rad", 0.5 * Pi, std::atan2(-tangent.y(), tangent.z()),
    "1e-8 rad");
  EXPECT_NEAR(std::atan2(-tangent.y(), tangent.z()), 0.5 * Pi, 1e-8);
}

TEST(CosseratRod, EndMomentAndEndTorque)
{
  const double length = 20.0;
  Material material;
  for (const int joints : { 10, 40 })
  {
    CosseratRod rod = StraightRod(joints, length, material);
    const double moment = 0.5 * Pi * material.bending / length;
    for (int k = 1; k <= 10; ++k)
    {
      rod.SetTorque(joints, Vector3(0.0, moment * k / 10.0, 0.0));
      Settle(rod);
    }
    const double angle = std::atan2(rod.Axis(joints).x(), rod.Axis(joints).z());
    EXPECT_NEAR(angle, 0.5 * Pi, 1e-6);
    Row(joints == 10 ? "end moment, 10 joints: deflection of the tip, mm" : "the same, 40 joints",
      2.0 * length / Pi, rod.Position(joints).x(), joints == 10 ? "0.5 %" : "0.05 %");
    // The tip of a quarter of a circle.
    EXPECT_NEAR(rod.Position(joints).x(), 2.0 * length / Pi,
      (joints == 10 ? 0.005 : 0.0005) * 2.0 * length / Pi);

    CosseratRod twisted = StraightRod(joints, length, material);
    twisted.SetTorque(joints, Vector3(0.0, 0.0, material.torsion / length));
    Settle(twisted);
    EXPECT_NEAR(RotationVector(twisted.Orientation(joints)).z(), 1.0, 1e-6);
    Row(joints == 10 ? "end torque, 10 joints: rad" : "the same, 40 joints", 1.0,
      RotationVector(twisted.Orientation(joints)).z(), joints == 10 ? "0.5 %" : "0.05 %");
  }
}

TEST(CosseratRod, HeldHalfCircle)
{
  const double length = 20.0;
  const double radius = length / Pi;
  CosseratRod rod = StraightRod(40, length, Material());
  for (int k = 1; k <= 100; ++k)
  {
    const double angle = Pi * k / 100.0;
    const double r = length / angle;
    rod.Prescribe(40, Vector3(r * (1.0 - std::cos(angle)), 0.0, r * std::sin(angle)),
      Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3::UnitY())));
    rod.Step(10.0);
  }
  Settle(rod);
  Vector3 force, torque;
  rod.Reaction(0, force, torque);
  EXPECT_NEAR(-torque.y(), 1.0 / radius, 0.005 / radius);
  Row("held half circle: moment at the clamp, N mm", 1.0 / radius, -torque.y(), "0.5 %");
  EXPECT_NEAR(rod.JointMoment(20).y(), 1.0 / radius, 0.005 / radius);
}

TEST(CosseratRod, HelixFromCurvatureAndTorsion)
{
  Material material;
  material.curvature = 0.15;
  material.twist = 0.08;
  const int joints = 120;
  const double length = 60.0;
  CosseratRod rod = StraightRod(joints, length, material);
  Settle(rod);
  const double square = material.curvature * material.curvature + material.twist * material.twist;
  const double radius = material.curvature / square;
  const double pitch = 2.0 * Pi * material.twist / square;
  // Its axis, from the turn from one segment to another one.
  const Eigen::Quaterniond turn = rod.Orientation(61) * rod.Orientation(60).conjugate();
  const Vector3 axis = RotationVector(turn).normalized();
  const double angle = RotationVector(turn).norm();
  const Vector3 step = rod.Position(61) - rod.Position(60);
  Row("helix: pitch, mm", pitch, std::abs(step.dot(axis)) * 2.0 * Pi / angle, "0.5 %");
  EXPECT_NEAR(std::abs(step.dot(axis)) * 2.0 * Pi / angle, pitch, 0.005 * pitch);
  const Vector3 across = step - axis * axis.dot(step);
  Row("helix: radius, mm", radius, across.norm() / (2.0 * std::sin(0.5 * angle)), "0.5 %");
  EXPECT_NEAR(across.norm() / (2.0 * std::sin(0.5 * angle)), radius, 0.005 * radius);
}

TEST(CosseratRod, TwistedRingLeavesItsPlane)
{
  // Michell 1889, Zajac 1962: at a twist of 2 pi sqrt(3) EI/GJ.
  const double length = 40.0;
  const int joints = 80;
  Material material;
  material.torsion = 1.2;
  const double radius = length / (2.0 * Pi);
  const double exact = 2.0 * Pi * std::sqrt(3.0) * material.bending / material.torsion;
  const double found = Threshold(0.9 * exact, 1.1 * exact,
    [&](double twist)
    {
      const double step = length / joints;
      CosseratRod rod(joints + 1);
      for (int i = 0; i <= joints; ++i)
      {
        const double angle = 2.0 * Pi * i / joints;
        const Vector3 place(radius * (1.0 - std::cos(angle)), 0.0, radius * std::sin(angle));
        rod.Append(MakeRodSegment(step, 0.178, 6450.0), JointOf(material, step),
          place + Vector3(0.0, 1e-9 * std::sin(2.0 * angle), 0.0),
          Eigen::AngleAxisd(angle, Vector3::UnitY()) *
            Eigen::AngleAxisd(twist * i / joints, Vector3::UnitZ()));
      }
      for (const int end : { 0, joints })
      {
        rod.Prescribe(end, rod.Position(end), rod.Orientation(end));
      }
      return Grows(
        rod,
        [&](const CosseratRod& r)
        {
          double most = 0.0;
          for (int i = 0; i <= joints; ++i)
          {
            most = std::max(most, std::abs(r.Position(i).y()));
          }
          return most;
        },
        2000);
    });
  EXPECT_NEAR(found, exact, 0.02 * exact);
  Row("twisted ring (Michell, Zajac): critical twist, rad", exact, found, "2 %");
}

TEST(CosseratRod, StraightRodUnderTorqueBuckles)
{
  // Greenhill 1883, ends on pins: 2 pi EI / L.
  const double length = 30.0;
  const int segments = 60;
  const double step = length / segments;
  const double exact = 2.0 * Pi / length;
  const double found = Threshold(0.9 * exact, 1.1 * exact,
    [&](double torque)
    {
      CosseratRod rod(segments + 2);
      RodJoint pin;
      pin.angularStiffness.setZero();
      pin.stretchStiffness = 1e5;
      for (int i = -1; i <= segments; ++i)
      {
        const bool pinned = i == 0 || i == segments;
        RodSegment segment = MakeRodSegment(step, 0.178, 6450.0);
        segment.rotationalDrag = 1e-6; // nothing else keeps it from spinning as a whole
        rod.Append(segment, pinned ? pin : JointOf(Material(), step),
          Vector3(0.0, 0.0, (i + 0.5) * step), Eigen::Quaterniond::Identity());
      }
      rod.Prescribe(0, rod.Position(0), rod.Orientation(0));
      rod.Prescribe(segments + 1, rod.Position(segments + 1), rod.Orientation(segments + 1));
      for (int i = 1; i <= segments; ++i)
      {
        rod.SetForce(i, Vector3(1e-13 * std::sin(Pi * i / segments), 0.0, 0.0));
      }
      rod.SetTorque(1, Vector3(0.0, 0.0, -torque));
      rod.SetTorque(segments, Vector3(0.0, 0.0, torque));
      return Grows(
        rod, [&](const CosseratRod& r) { return r.Position(segments / 2).head<2>().norm(); }, 2000);
    });
  EXPECT_NEAR(found, exact, 0.03 * exact);
  Row("straight rod under torque (Greenhill): N mm", exact, found, "3 %");
}

TEST(CosseratRod, LiesOnAPlaneWithItsWeight)
{
  const double gravity = 9810.0;
  const int joints = 40;
  CosseratRod rod = StraightRod(joints, 40.0, Material());
  rod.Release(0);
  double weight = 0.0;
  for (int i = 0; i <= joints; ++i)
  {
    rod.Place(i, rod.Position(i) + Vector3(0.0, 0.18, 0.0), rod.Orientation(i));
    rod.SetForce(i, Vector3(0.0, -rod.Segment(i).mass * gravity, 0.0));
    weight += rod.Segment(i).mass * gravity;
  }
  Plane plane;
  Settle(rod, &plane, 0.01);
  double sum = 0.0;
  for (const RodContact& contact : rod.Contacts())
  {
    sum += contact.force;
  }
  EXPECT_NEAR(sum, weight, 1e-6 * weight);
  Row("rod on a plane: sum of the normal forces, N", weight, sum, "1e-6");
}

TEST(CosseratRod, SlipsOnAPlaneAtMuTimesN)
{
  for (const double share : { 0.98, 1.02 })
  {
    const int joints = 20;
    CosseratRod rod = StraightRod(joints, 20.0, Material());
    rod.Release(0);
    Plane plane;
    plane.friction = 0.3;
    const double load = 1e-3;
    for (int i = 0; i <= joints; ++i)
    {
      rod.Place(i, rod.Position(i) + Vector3(0.0, 0.19, 0.0), rod.Orientation(i));
      rod.SetForce(i, Vector3(0.0, -load, 0.0));
    }
    Settle(rod, &plane, 0.01);
    const double before = rod.Position(10).z();
    for (int k = 0; k <= 200; ++k)
    {
      const double pull = share * plane.friction * load * std::min(1.0, k / 100.0);
      for (int i = 0; i <= joints; ++i)
      {
        rod.SetForce(i, Vector3(0.0, -load, pull));
      }
      rod.Step(5e-4, &plane);
    }
    const double moved = rod.Position(10).z() - before;
    Row(share < 1.0 ? "pulled on a plane with 0.98 mu N: moved, mm" : "with 1.02 mu N: moved, mm",
      0.0, moved, share < 1.0 ? "sticks (< 0.001)" : "slips (> 1)");
    if (share < 1.0)
    {
      EXPECT_LT(moved, 1e-3);
    }
    else
    {
      EXPECT_GT(moved, 1.0);
    }
  }
}

TEST(CosseratRod, CapstanEquation)
{
  // Pulled round a cylinder: T2 / T1 = exp(mu theta).
  struct Case
  {
    double friction, wrap, step, speed, tension, seconds;
  };
  for (const Case& test :
    { Case{ 0.0, 0.5 * Pi, 0.5, 2.0, 0.2, 5e-4 }, Case{ 0.1, 0.5 * Pi, 0.5, 2.0, 0.2, 5e-4 },
      Case{ 0.1, Pi, 0.5, 2.0, 0.2, 5e-4 }, Case{ 0.3, 0.5 * Pi, 0.5, 2.0, 0.2, 5e-4 },
      Case{ 0.3, Pi, 0.5, 2.0, 0.5, 5e-4 }, Case{ 0.2, 0.5 * Pi, 0.25, 2.0, 0.2, 5e-4 },
      Case{ 0.2, 0.5 * Pi, 0.5, 0.2, 0.2, 5e-4 }, Case{ 0.2, 0.5 * Pi, 0.5, 2.0, 0.2, 1e-3 } })
  {
    for (const int iterations : { 1, 2 })
    {
      Cylinder cylinder;
      cylinder.friction = test.friction;
      Material material;
      material.bending = 0.01;
      material.torsion = 0.01;
      material.stretch = 1e4;
      const double straight = 10.0;
      const double r = cylinder.radius + 0.178;
      const int count = static_cast<int>((2.0 * straight + test.wrap * r) / test.step);
      RodSettings settings;
      settings.iterations = iterations;
      settings.samples = 1;
      settings.tipSample = false;
      CosseratRod rod(count, settings);
      for (int i = 0; i < count; ++i)
      {
        const double s = (i + 0.5) * test.step - straight;
        const double angle = std::min(std::max(s, 0.0) / r, test.wrap);
        const Vector3 tangent(-std::sin(angle), std::cos(angle), 0.0);
        const Vector3 place =
          r * Vector3(std::cos(angle), std::sin(angle), 0.0) + (s - angle * r) * tangent;
        RodSegment segment = MakeRodSegment(test.step, 0.178, 6450.0);
        segment.drag = 2.5e-8 * test.step;
        segment.rotationalDrag = 1e-9;
        RodJoint joint = JointOf(material, test.step);
        joint.lossTime = 1e-3;
        rod.Append(segment, joint, place,
          Eigen::AngleAxisd(angle, Vector3::UnitZ()) *
            Eigen::AngleAxisd(-0.5 * Pi, Vector3::UnitX()));
      }
      rod.SetForce(0, Vector3(0.0, -test.tension, 0.0));
      const Vector3 end = rod.Position(count - 1);
      const Vector3 away = rod.Axis(count - 1);
      const Eigen::Quaterniond turned = rod.Orientation(count - 1);
      double ratio = 0.0;
      int averaged = 0;
      for (double t = 0.0; t < 1.0; t += test.seconds)
      {
        rod.Prescribe(count - 1, end + std::max(0.0, t - 0.1) * test.speed * away, turned);
        ASSERT_TRUE(rod.Step(test.seconds, &cylinder).finite);
        if (t > 0.9)
        {
          ratio += rod.JointForce(count - 2).norm() / test.tension;
          ++averaged;
        }
      }
      ratio /= averaged;
      const double angle = std::acos(rod.Axis(3).dot(rod.Axis(count - 4)));
      const double exact = std::exp(test.friction * angle);
      char what[128];
      std::snprintf(what, sizeof(what),
        "capstan, mu %.1f, %.0f degrees, %.2f mm, %.1f mm/s, dt %.1f ms, %d iterations: T2 / T1",
        test.friction, angle * 180.0 / Pi, test.step, test.speed, 1e3 * test.seconds, iterations);
      Row(what, exact, ratio, test.friction > 0.0 ? "3 %" : "0.5 %");
      EXPECT_NEAR(ratio, exact, (test.friction > 0.0 ? 0.03 : 0.005) * exact)
        << "mu " << test.friction << " wrap " << test.wrap << " step " << test.step << " speed "
        << test.speed << " iterations " << iterations;
    }
  }
}

TEST(CosseratRod, KeepsInAShakenTube)
{
  // 108.6 mm/s is the fastest that coronary walls were seen to move (Mao 2000).
  for (const double bending : { 0.5, 1.6, 8.0, 150.0 })
  {
    BentTube tube;
    tube.friction = 0.1;
    Material material;
    material.bending = bending;
    material.torsion = 0.77 * bending;
    CosseratRod rod = RodInTube(tube, 60, 1.0, material);
    const Vector3 place = rod.Position(59);
    const Eigen::Quaterniond turned = rod.Orientation(59);
    const double seconds = 5e-4;
    const double rate = 2.0 * Pi * 2.0;
    double mean = 0.0;
    double deepest = 0.0;
    double widest = 0.0;
    int touched = 0;
    for (int k = 1; k <= 4000; ++k)
    {
      const double shift = 108.6 / rate * std::sin(rate * k * seconds);
      tube.velocity = (shift - tube.shift) / seconds;
      tube.shift = shift;
      rod.Prescribe(59, place + Vector3(shift, 0.0, 0.0), turned);
      const RodStep& step = rod.Step(seconds, &tube);
      ASSERT_TRUE(step.finite);
      if (k < 200)
      {
        continue; // it was bent against its shape at rest, and let go
      }
      ASSERT_LT(step.maximumPenetration, 0.1);
      ASSERT_LT(step.maximumGap, 0.005);
      deepest = std::max(deepest, step.maximumPenetration);
      widest = std::max(widest, step.maximumGap);
      mean += step.meanPenetration;
      touched += step.touching;
      for (int i = 0; i < 60; ++i)
      {
        ASSERT_LT(tube.Outside(rod.Position(i)), 0.0);
      }
    }
    const std::string name =
      "tube shaken at 108.6 mm/s, EI " + std::to_string(bending).substr(0, 5) + " N mm^2: ";
    Row((name + "greatest penetration, mm").c_str(), 0.0, deepest, "0.1 mm");
    Row((name + "mean, mm").c_str(), 0.0, mean / 3800, "0.02 mm");
    Row((name + "joint gap, mm").c_str(), 0.0, widest, "0.005 mm");
    EXPECT_LT(mean / 3800, 0.02);
    EXPECT_GT(touched, 1000) << "it does not touch: nothing was tested";
  }
}

TEST(CosseratRod, GainsNoEnergyWhenNothingMoves)
{
  BentTube tube;
  tube.friction = 0.1;
  Material material;
  material.bending = 1.6;
  material.torsion = 1.2;
  CosseratRod rod = RodInTube(tube, 60, 1.0, material);
  const Vector3 place = rod.Position(59);
  const Eigen::Quaterniond turned = rod.Orientation(59);
  const double seconds = 5e-4;
  double before = 0.0;
  double growth = 0.0;
  for (int k = 1; k <= 2000; ++k)
  {
    // Shaken, then stopped at once.
    const double shift = k < 500 ? 5.0 * std::sin(2.0 * Pi * 2.0 * k * seconds) : tube.shift;
    tube.velocity = (shift - tube.shift) / seconds;
    tube.shift = shift;
    rod.Prescribe(59, place + Vector3(shift, 0.0, 0.0), turned);
    ASSERT_TRUE(rod.Step(seconds, &tube).finite);
    const double energy = rod.KineticEnergy() + rod.ElasticEnergy() + rod.ContactEnergy();
    if (k > 501)
    {
      growth = std::max(growth, energy - before);
      // 1e-9 J
      ASSERT_LT(energy, before + 1e-6) << k;
    }
    before = energy;
  }
  Row("after the tube stops: greatest growth of energy in a step, J", 0.0, 1e-3 * growth, "1e-9 J");
}

TEST(CosseratRod, WorkOfTheHandIsAccountedFor)
{
  // Fed into a bent tube: work at the end = elastic energy + friction + contact.
  BentTube tube;
  tube.bend = 25.0;
  tube.friction = 0.15;
  Material material;
  material.bending = 5.0;
  material.torsion = 4.0;
  const int count = 40;
  RodSettings settings;
  settings.iterations = 3;
  CosseratRod rod(count, settings);
  // Straight and before the tube, which begins at z = 0; inside of it from the start with its tip.
  for (int i = 0; i < count; ++i)
  {
    RodSegment segment = MakeRodSegment(1.0, 0.178, 6450.0);
    RodJoint joint = JointOf(material, 1.0);
    joint.lossTime = 1e-4;
    // The third axis points from the tip backwards.
    rod.Append(segment, joint, Vector3(0.0, 0.0, -(i + 0.5)),
      Eigen::Quaterniond(Eigen::AngleAxisd(Pi, Vector3::UnitX())));
  }
  struct Guided : ContactSurface
  {
    BentTube* tube;
    void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override
    {
      contacts.count = 0;
      if (sample.centre.z() > 0.0)
      {
        tube->Find(sample, reach, contacts);
        return;
      }
      const Vector3 across(sample.centre.x(), sample.centre.y(), 0.0);
      const double gap = tube->lumen - across.norm() - sample.radius;
      if (gap < reach && across.norm() > 1e-9)
      {
        contacts.count = 1;
        contacts.plane[0] = ContactPlane();
        contacts.plane[0].normal = -across.normalized();
        contacts.plane[0].gap = gap;
        contacts.plane[0].friction = tube->friction;
      }
    }
  } guided;
  guided.tube = &tube;
  const Vector3 place = rod.Position(count - 1);
  const Eigen::Quaterniond turned = rod.Orientation(count - 1);
  const double seconds = 5e-4;
  const double speed = 20.0;
  double work = 0.0;
  double friction = 0.0;
  for (int k = 1; k <= 2500; ++k)
  {
    rod.Prescribe(count - 1, place + Vector3(0.0, 0.0, speed * k * seconds), turned);
    ASSERT_TRUE(rod.Step(seconds, &guided).finite);
    Vector3 force, torque;
    rod.Reaction(count - 1, force, torque);
    work += force.z() * speed * seconds;
    friction += rod.LastStep().frictionWork;
  }
  const double stored = rod.ElasticEnergy() + rod.ContactEnergy() + rod.KineticEnergy();
  EXPECT_GT(work, 0.05);
  EXPECT_GT(friction, 0.05 * work);
  EXPECT_NEAR(work, stored + friction, 0.02 * work) << stored << ' ' << friction;
  Row("work of the hand = elastic + friction + contact, N mm", work, stored + friction, "2 %");
}

TEST(CosseratRod, ConvergesInTime)
{
  // A cantilever let go: its tip after 10 ms.
  const auto tip = [](double seconds)
  {
    Material material;
    material.bending = 10.0;
    CosseratRod rod = StraightRod(10, 20.0, material);
    rod.GetSettings().iterations = 4;
    rod.SetForce(10, Vector3(1e-3, 0.0, 0.0));
    Settle(rod);
    rod.GetSettings().iterations = 4;
    rod.SetForce(10, Vector3::Zero());
    for (int i = 0; i <= 10; ++i)
    {
      rod.SetVelocity(i, Vector3::Zero(), Vector3::Zero());
    }
    for (int k = 0; k < std::lround(0.004 / seconds); ++k)
    {
      rod.Step(seconds);
    }
    return rod.Position(10).x();
  };
  const double a = tip(4e-6);
  const double b = tip(2e-6);
  const double c = tip(1e-6);
  Row("order of convergence in time", 0.0, std::log2(std::abs((a - b) / (b - c))), "at least 1");
  EXPECT_GT(std::log2(std::abs((a - b) / (b - c))), 0.9) << a << ' ' << b << ' ' << c;
}

TEST(CosseratRod, RefusesImpossibleProperties)
{
  CosseratRod rod(2);
  RodSegment segment = MakeRodSegment(1.0, 0.178, 6450.0);
  RodJoint joint;
  rod.Append(segment, joint, Vector3::Zero(), Eigen::Quaterniond::Identity());
  RodSegment bad = segment;
  bad.mass = -1.0;
  EXPECT_THROW(rod.Append(bad, joint, Vector3::UnitZ(), Eigen::Quaterniond::Identity()),
    std::invalid_argument);
  joint.angularStiffness.x() = -1.0;
  EXPECT_THROW(rod.Append(segment, joint, Vector3::UnitZ(), Eigen::Quaterniond::Identity()),
    std::invalid_argument);
  joint.angularStiffness.x() = 1.0;
  rod.Append(segment, joint, Vector3::UnitZ(), Eigen::Quaterniond::Identity());
  EXPECT_THROW(rod.Append(segment, joint, 2.0 * Vector3::UnitZ(), Eigen::Quaterniond::Identity()),
    std::length_error);
  EXPECT_THROW(CosseratRod(0), std::invalid_argument);
  RodSettings settings;
  settings.iterations = 0;
  EXPECT_THROW(CosseratRod(3, settings), std::invalid_argument);
}

TEST(CosseratRod, SaysWhenAStepFailsAndStaysAsItWas)
{
  CosseratRod rod = StraightRod(5, 5.0, Material());
  const Vector3 before = rod.Position(5);
  rod.SetForce(5, Vector3(std::nan(""), 0.0, 0.0));
  EXPECT_FALSE(rod.Step(1e-3).finite);
  EXPECT_EQ(before, rod.Position(5));
  rod.SetForce(5, Vector3::Zero());
  EXPECT_TRUE(rod.Step(1e-3).finite);
}

TEST(CosseratRod, RepeatsBitForBit)
{
  std::uint64_t first = 0;
  for (int run = 0; run < 2; ++run)
  {
    BentTube tube;
    tube.friction = 0.2;
    CosseratRod rod = RodInTube(tube, 30, 1.0, Material());
    for (int k = 0; k < 300; ++k)
    {
      tube.shift = 0.01 * k;
      tube.velocity = 0.01 / 5e-4;
      rod.Prescribe(29, rod.Position(29) + Vector3(0.01, 0.0, 0.0), rod.Orientation(29));
      rod.Step(5e-4, &tube);
    }
    if (run == 0)
    {
      first = rod.Hash();
    }
    else
    {
      EXPECT_EQ(first, rod.Hash());
    }
  }
}
}
