// A microcatheter over a wire: what it stiffens, the free column beyond it, wires that are exchanged through it, and what is refused.
#include "BalloonTestBench.h"
#include "InstrumentJson.h"
#include "Numbers.h"
#include "Refusals.h"
#include "SessionRunner.h"
#include "VesselWall.h"
#include "WallTestMeshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace UnitTestMicrocatheter
{
using namespace coronary;

namespace
{
const BalloonCatheter& Device(const char* name)
{
  return BuiltInCatalogue().Balloon(name).balloon;
}

const Guidewire& Wire(const char* name)
{
  return BuiltInCatalogue().Wire(name).wire;
}

const GuideCatheter& Guide()
{
  return BuiltInCatalogue().Catheter("EBU3.5-6F").catheter;
}

/// Of one stiffness all along.
BalloonCatheter EvenMicrocatheter(double stiffness)
{
  BalloonCatheter device = Device("microcatheter-2.6F");
  device.sections = { { 1350.0, 0.45, stiffness } };
  device.Validate();
  return device;
}

/// A straight wire along z, its tip at z = 0 and u = 100, held at its end.
struct EvenRod
{
  EvenRod(int count, double length, const Vector3& stiffness, double restCurvature = 0.0)
    : Rod(count, Settings())
  {
    for (int i = 0; i < count; ++i)
    {
      RodSegment segment = MakeRodSegment(length, 0.178, 8000.0);
      segment.drag = 1e-6;
      segment.rotationalDrag = 1e-6;
      this->Segments.push_back(segment);
      RodJoint joint;
      joint.angularStiffness = stiffness / length;
      joint.restAngle = Vector3(length * restCurvature, 0.0, 0.0);
      this->Joints.push_back(joint);
      this->Places.push_back((i + 0.5) * length);
      this->Rod.Append(
        segment, joint, Vector3(0.0, 0.0, this->Places.back()), Eigen::Quaterniond::Identity());
    }
    this->Rod.Prescribe(
      count - 1, this->Rod.Position(count - 1), this->Rod.Orientation(count - 1));
  }
  static RodSettings Settings()
  {
    RodSettings settings;
    settings.iterations = 10;
    return settings;
  }
  BalloonOnWire::Rail Rail() const
  {
    return { 100.0, 0.0, &this->Places, &this->Segments, &this->Joints };
  }
  CosseratRod Rod;
  std::vector<RodSegment> Segments;
  std::vector<RodJoint> Joints;
  std::vector<double> Places;
};

/// Holds the tip on the z axis' plane x = 0.
struct Slot : ContactSurface
{
  void Find(const ContactSample& sample, double /*reach*/, SampleContacts& contacts) override
  {
    contacts.count = 0;
    if (sample.index == CosseratRod(1).SamplesPerSegment() - 1)
    {
      for (int side = 0; side < 2; ++side)
      {
        ContactPlane& plane = contacts.plane[contacts.count++];
        plane = ContactPlane();
        plane.normal = side == 0 ? Vector3(1.0, 0.0, 0.0) : Vector3(-1.0, 0.0, 0.0);
        plane.gap = plane.normal.dot(sample.centre);
        plane.identity = side;
        plane.stiffness = 1000.0;
      }
    }
  }
};

/// N at which a wire of EI 1 buckles that comes out of a stiff sleeve for `column` and whose tip is pinned.
double BucklingLoad(double length, double column)
{
  constexpr double Sleeved = 4.0; // mm
  const int count = static_cast<int>(std::lround((column + Sleeved) / length));
  const BalloonCatheter device = EvenMicrocatheter(1000.0);
  const auto grows = [&](double load)
  {
    EvenRod wire(count, length, Vector3(100.0, 1.0, 1.0));
    wire.Rod.GetSettings().iterations = 1;
    BalloonOnWire sleeve(device, Guide(), 100.0 - column);
    sleeve.Drive(0.0, 1.0, wire.Rail(), 1.0, wire.Rod);
    Slot slot;
    const Vector3 force(0.0, 0.0, load);
    const auto middle = static_cast<std::int64_t>(0.5 * column / length);
    for (int k = 0; k < 4000; ++k)
    {
      // At the very tip.
      wire.Rod.SetForce(0, force);
      wire.Rod.SetTorque(0, (wire.Rod.FirstEnd(0) - wire.Rod.Position(0)).cross(force));
      wire.Rod.SetForce(middle, Vector3(k == 0 ? 1e-7 : 0.0, 0.0, 0.0));
      EXPECT_TRUE(wire.Rod.Step(10.0, &slot).finite);
      if (std::abs(wire.Rod.Position(middle).x()) > 1e-3)
      {
        return true;
      }
    }
    return false;
  };
  double low = 10.0 / (column * column);
  double high = 30.0 / (column * column);
  EXPECT_FALSE(grows(low));
  EXPECT_TRUE(grows(high));
  for (int k = 0; k < 12; ++k)
  {
    const double half = 0.5 * (low + high);
    (grows(half) ? high : low) = half;
  }
  return 0.5 * (low + high);
}

/// A straight vessel of 3 mm, a point of its axis each half millimetre, occluded from 26 to 34 mm.
std::shared_ptr<WallMotion> OccludedTube(double strength = VesselLesion().strength)
{
  WallTopology topology;
  std::vector<Vector3> points;
  AppendTube(topology, points, 0.0, 1.5, 100.0, 24, 200);
  const auto tube = std::make_shared<StillWallMotion>(topology, points);
  VesselLesion lesion{ "tube0", 30.0, 14.0, 1.0, 0.0, strength };
  return std::make_shared<NarrowedWallMotion>(tube, std::vector<VesselLesion>{ lesion });
}
constexpr double Cap = 26.0; // mm from the ostium

/// A wire with or without a microcatheter in that vessel, and hands that move evenly.
struct Hands
{
  explicit Hands(const Guidewire& wire, const std::optional<BalloonCatheter>& device = {},
    const std::shared_ptr<WallMotion>& wall = OccludedTube(),
    const std::optional<Guidewire>& second = {})
    : Physics(wall, wire, Guide(), AtRest(), device, second)
  {
  }
  static InterventionSettings AtRest()
  {
    InterventionSettings settings;
    settings.heartRate = 0.0;
    return settings;
  }
  double Tip(std::size_t wire = 0) const { return this->Physics.Centerline(wire).front().z(); }
  const BalloonReport& Sleeve() const { return this->Physics.Report().balloon; }
  double Out() const { return this->Physics.Report().inserted - this->Sleeve().tip; }

  /// @param wire, device  mm
  void Move(double wire, double device, double speed)
  {
    const double furthest = std::max(std::abs(wire), std::abs(device));
    const int ticks = std::max(1, static_cast<int>(std::lround(furthest / speed * 2000.0)));
    for (int tick = 0; tick < ticks; ++tick)
    {
      this->Input.wirePosition += wire / ticks;
      this->Input.balloonPosition += device / ticks;
      ASSERT_EQ(this->Physics.Step(this->Input).outside, 0);
      this->Most = std::max(this->Most, this->Physics.Report().capForce);
    }
  }
  void Wait(double seconds)
  {
    for (int tick = 0; tick < seconds * 2000.0; ++tick)
    {
      this->Physics.Step(this->Input);
    }
  }
  /// From the beginning to where the wire's tip is `before` mm before the cap, and then the microcatheter's.
  void ToCap(double wireBefore, double deviceBefore)
  {
    const double at = Cap - this->Tip();
    this->Move(at - wireBefore, 0.0, 30.0);
    if (this->Physics.Balloon())
    {
      while (this->Sleeve().tip < 0.0 || this->Sleeve().middle < Cap - deviceBefore)
      {
        this->Move(0.0, 0.1, 30.0);
      }
    }
    this->Most = 0.0;
  }

  Intervention Physics;
  DriveInput Input;
  double Most = 0.0; ///< N on the cap
};

std::string OneMessage(Intervention& physics)
{
  const std::vector<std::string> messages = physics.TakeMessages();
  EXPECT_EQ(messages.size(), 1U) << testing::PrintToString(messages);
  return messages.empty() ? "" : messages.front();
}

Guidewire Thick(double radius)
{
  Guidewire wire = Wire("workhorse");
  wire.name = "thick";
  wire.sections.back().radius = radius;
  return wire;
}
}

TEST(MicrocatheterCatalogue, HasTwoKindsWithSourcesAndStiffnessOfTheirTubes)
{
  const std::vector<CatalogueBalloon>& all = BuiltInCatalogue().microcatheters;
  ASSERT_GE(all.size(), 2U);
  for (const CatalogueBalloon& one : all)
  {
    const BalloonCatheter& device = one.balloon;
    const std::string& name = device.name;
    EXPECT_EQ(&BuiltInCatalogue().Balloon(name), &one);
    EXPECT_TRUE(device.IsMicrocatheter());
    EXPECT_FALSE(one.description.empty());
    const double french = 3.0; // a millimetre
    EXPECT_GE(2.0 * device.Profile() * french, 1.8) << name;
    EXPECT_LE(2.0 * device.Profile() * french, 3.0) << name;
    EXPECT_GE(2.0 * device.innerRadius, 0.0149 * 25.4) << name;
    EXPECT_LE(2.0 * device.innerRadius, 0.0181 * 25.4) << name;
    EXPECT_NO_THROW(RequireFit(device, Guide()));
    for (const CatalogueWire& wire : BuiltInCatalogue().wires)
    {
      EXPECT_NO_THROW(RequireFit(wire.wire, device)) << name << wire.wire.name;
    }
    ASSERT_EQ(one.moduli.size(), device.sections.size());
    for (std::size_t n = 0; n < device.sections.size(); ++n)
    {
      const MicrocatheterSection& section = device.sections[n];
      const double area =
        0.25 * Pi * (std::pow(section.outerRadius, 4) - std::pow(device.innerRadius, 4));
      EXPECT_NEAR(section.bendingStiffness / (one.moduli[n] * area), 1.0, 0.001) << name << n;
    }
    for (const char* property : { "length_mm", "inner_diameter_mm", "tip_mm", "tip_diameter_mm",
           "marker_mm", "marker_at_mm", "push_stiffness_N_per_mm", "friction_on_wire_N", "friction",
           "outer_diameter_mm", "bending_stiffness_N_mm2" })
    {
      EXPECT_EQ(one.sources.count(property), 1U) << name << " " << property;
    }
    // As JSON and back: the same bits, and no more words.
    const nlohmann::json json = BalloonToJson(device);
    EXPECT_EQ(BalloonToJson(BalloonFromJson(json, "'text'").balloon), json);
  }
  EXPECT_GT(Device("microcatheter-2.6F").BendingStiffness(100.0, 0.0, 0.0),
    3.0 * Device("microcatheter-1.8F").BendingStiffness(100.0, 0.0, 0.0));
}

TEST(MicrocatheterCatalogue, BadOnesAreRefusedByName)
{
  const auto refused = [](const auto& change, const char* words)
  {
    nlohmann::json json = BalloonToJson(Device("microcatheter-1.8F"));
    change(json);
    ExpectRefusal([&] { MicrocatheterFromJson(json, "'own.json'"); }, "'own.json'",
      "'microcatheter-1.8F'", words);
  };
  refused([](auto& j) { j["inner_diameter_mm"] = 0.7; }, "the outer radius");
  refused([](auto& j) { j["tip_diameter_mm"] = 0.4; }, "the tip's radius");
  refused([](auto& j) { j["sections"][1]["bending_stiffness_N_mm2"] = 0.0; }, "section 2");
  refused([](auto& j) { j["sections"] = nlohmann::json::array(); }, "has no sections");
  refused([](auto& j) { j.erase("sections"); }, "sections");
  refused([](auto& j) { j["length_mm"] = 200.0; }, "the length");
  refused([](auto& j) { j["rated_pressure_atm"] = 12.0; }, "rated_pressure_atm");
  refused([](auto& j) { j["marker_at_mm"] = 0.1; }, "the marker's place");
}

// EI of both where it is, of the wire beyond: integral of s^2 / EI.
TEST(Microcatheter, CantileverOutOfIt)
{
  EvenRod wire(160, 0.25, Vector3(4.0, 4.0, 4.0));
  const double beyond = 5.0;
  BalloonOnWire sleeve(EvenMicrocatheter(12.0), Guide(), 100.0 - beyond);
  const double load = 1e-6;
  for (int k = 0; k < 4000; ++k)
  {
    sleeve.Drive(0.0, 1.0, wire.Rail(), 1.0, wire.Rod);
    wire.Rod.SetForce(0, Vector3(load, 0.0, 0.0));
    wire.Rod.Step(0.01);
  }
  const double s0 = wire.Places.front();
  const double end = wire.Places.back() - s0;
  const double part = std::pow(beyond - s0, 3) / (3.0 * 4.0);
  const double rest = (std::pow(end, 3) - std::pow(beyond - s0, 3)) / (3.0 * 16.0);
  const double deflection = wire.Rod.Position(0).x();
  Print("cantilever out of a microcatheter, um", 1e3 * load * (part + rest), 1e3 * deflection);
  EXPECT_NEAR(deflection, load * (part + rest), 0.01 * deflection);
}

TEST(Microcatheter, TheColumnBeyondItBucklesAsEulerSays)
{
  const double beta = 4.493409457909064; // tan b = b
  for (const double column : { 5.0, 10.0 })
  {
    const double euler = beta * beta / (column * column);
    const double found = BucklingLoad(0.25, column);
    char text[80];
    std::snprintf(text, sizeof(text), "column of %g mm beyond a microcatheter: N per N mm2", column);
    Print(text, euler, found);
    EXPECT_NEAR(found / euler, 1.0, 0.01) << column;
  }
  // With a wire's own segments.
  const double found = BucklingLoad(0.75, 5.25);
  Print("the same, 5.25 mm in 7 segments", beta * beta / (5.25 * 5.25), found);
  EXPECT_NEAR(found * 5.25 * 5.25 / (beta * beta), 1.0, 0.05);
}

// Moments of both are at balance: a curve is left with EI / (EI + EI of the sleeve) of its angle.
TEST(Microcatheter, StraightensTheTipThatIsDrawnIntoIt)
{
  constexpr double Curvature = 0.1; // 1/mm
  for (const double stiffness : { 2.0, 8.0 })
  {
    EvenRod wire(40, 0.25, Vector3(2.0, 2.0, 2.0), Curvature);
    BalloonCatheter device = EvenMicrocatheter(stiffness);
    device.wireFriction = 0.0; // which bends a curve
    BalloonOnWire sleeve(device, Guide(), 90.0);
    double before = 0.0;
    for (int k = 0; k < 4000; ++k)
    {
      sleeve.Drive(k < 1000 ? 0.0 : 0.02, 1.0, wire.Rail(), 1.0, wire.Rod);
      wire.Rod.Step(0.01);
      before = k == 999 ? RotationVector(wire.Rod.Orientation(0)).norm() : before;
    }
    EXPECT_DOUBLE_EQ(sleeve.Tip(), 99.5) << "as far as it goes";
    const double turned = RotationVector(wire.Rod.Orientation(0)).norm();
    const double bare = 0.5; // mm
    const double length = wire.Places.back() - wire.Places.front();
    const double covered = length - (bare - wire.Places.front());
    EXPECT_NEAR(before, Curvature * length, 1e-6);
    const double expected = Curvature * (length - covered + covered * 2.0 / (2.0 + stiffness));
    Print("curve in a microcatheter, rad", expected, turned);
    EXPECT_NEAR(turned, expected, 0.002 * expected);
  }
}


namespace
{
Guidewire Straight(const char* name)
{
  Guidewire wire = Wire(name);
  for (WireSection& section : wire.sections)
  {
    section.restCurvature = 0.0;
  }
  return wire;
}
}
TEST(Microcatheter, SupportsTheWireAtTheCap)
{
  for (const bool straight : {true, false})
  for (const char* wire : { "workhorse", "polymer-jacket", "cto-9gf" })
  {
    for (const char* name : {"microcatheter-1.8F", "microcatheter-2.6F"})
    for (const double distance : { -1.0, 10.0, 5.0, 3.0 })
    {
      Hands hands(straight ? Straight(wire) : Wire(wire),
        distance > 0.0 ? std::optional(Device(name)) : std::nullopt,
        OccludedTube(100.0));
      hands.ToCap(0.5, distance);
      std::vector<double> all;
      std::printf("%d %s, %s at %g mm:", straight, wire, name, distance);
      for (int k = 0; k < 16; ++k)
      {
        for (int j = 0; j < 500; ++j) { hands.Move(0.001, 0.0, 2.0); all.push_back(hands.Physics.Report().capForce); }
        double held = 0.0;
        for (std::size_t n = 100; n < all.size(); ++n) held = std::max(held, *std::min_element(all.begin() + n - 100, all.begin() + n));
        std::printf(" %.2f", held);
      }
      std::printf("\n");
    }
  }
}
}
