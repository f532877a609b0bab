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
    this->Rod.Prescribe(count - 1, this->Rod.Position(count - 1), this->Rod.Orientation(count - 1));
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

/// Without its shaped tip.
Guidewire Straight(const char* name)
{
  Guidewire wire = Wire(name);
  for (WireSection& section : wire.sections)
  {
    section.restCurvature = 0.0;
  }
  return wire;
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
  for (int k = 0; k < 100; ++k)
  {
    sleeve.Drive(0.0, 1.0, wire.Rail(), 1.0, wire.Rod);
    wire.Rod.SetForce(0, Vector3(load, 0.0, 0.0));
    wire.Rod.Step(10.0);
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
    std::snprintf(
      text, sizeof(text), "column of %g mm beyond a microcatheter: N per N mm2", column);
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
    for (int k = 0; k < 1000; ++k)
    {
      sleeve.Drive(k < 200 ? 0.0 : 0.02, 1.0, wire.Rail(), 1.0, wire.Rod);
      wire.Rod.Step(0.1);
      before = k == 199 ? RotationVector(wire.Rod.Orientation(0)).norm() : before;
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

// In a vessel of 3 mm, whose wall holds the wire too: N on the cap for 50 ms after 2 mm of push.
TEST(Microcatheter, SupportsTheWireAtTheCap)
{
  const auto held = [](const Guidewire& wire, double distance)
  {
    Hands hands(wire, distance > 0.0 ? std::optional(Device("microcatheter-2.6F")) : std::nullopt,
      OccludedTube(100.0));
    hands.ToCap(0.5, distance);
    std::vector<double> forces;
    double most = 0.0;
    for (int k = 0; k < 2000; ++k)
    {
      hands.Move(0.001, 0.0, 2.0);
      forces.push_back(hands.Physics.Report().capForce);
      if (forces.size() >= 100)
      {
        most = std::max(most, *std::min_element(forces.end() - 100, forces.end()));
      }
    }
    return most;
  };
  for (const bool shaped : { false, true })
  {
    const Guidewire wire = shaped ? Wire("workhorse") : Straight("workhorse");
    const double alone = held(wire, -1.0);
    const double supported = held(wire, 5.0);
    std::printf("workhorse with a %s tip, 2 mm of push: %.3f N on the cap, %.3f N with a "
                "microcatheter at 5 mm\n",
      shaped ? "shaped" : "straight", alone, supported);
    EXPECT_GT(alone, 0.01);
    EXPECT_GT(supported, 1.3 * alone) << shaped;
  }
}

TEST(Microcatheter, TheWireStopsAtItsTipAndItStays)
{
  Hands hands(Wire("workhorse"), Device("microcatheter-1.8F"));
  hands.ToCap(1.0, 6.0);
  hands.Wait(0.2);
  ASSERT_GT(hands.Out(), 4.0);
  const double tip = hands.Sleeve().tip;
  hands.Physics.TakeMessages();
  hands.Move(-30.0, 0.0, 40.0);
  EXPECT_NE(
    OneMessage(hands.Physics).find("drawn back to the microcatheter's tip"), std::string::npos);
  EXPECT_NEAR(hands.Out(), 0.5, 1e-9);
  EXPECT_NEAR(hands.Sleeve().tip, tip, 0.01);
  hands.Move(2.0, 0.0, 20.0);
  EXPECT_NEAR(hands.Out(), 2.5, 1e-9) << "the hand has it at once";
  // A balloon goes back with the wire; so does a microcatheter in the guide.
  Hands parked(Wire("workhorse"), Device("microcatheter-1.8F"));
  parked.Move(10.0, 12.0, 30.0);
  ASSERT_LT(parked.Sleeve().tip, 0.0);
  parked.Move(-16.0, 0.0, 30.0);
  EXPECT_EQ(parked.Physics.Report().inserted, 0.0);
  Hands balloon(Wire("workhorse"), Device("semi-compliant-2.0x15"));
  balloon.Move(40.0, 30.0, 30.0);
  ASSERT_GT(balloon.Sleeve().tip, 5.0);
  balloon.Move(-35.0, 0.0, 40.0);
  EXPECT_NEAR(balloon.Out(), 3.0, 1e-6);
}

TEST(Microcatheter, WiresAreExchangedThroughIt)
{
  Hands hands(Wire("workhorse"), Device("microcatheter-2.6F"));
  hands.ToCap(0.5, 5.0);
  hands.Wait(0.2);
  hands.Physics.TakeMessages();
  ASSERT_GT(hands.Out(), Intervention::MostOut);
  const double was = hands.Out();
  EXPECT_FALSE(hands.Physics.Exchange(Wire("cto-9gf")));
  char text[80];
  std::snprintf(text, sizeof(text),
    "the wire is not exchanged: its tip is beyond the microcatheter's by %.1f mm", was);
  EXPECT_NE(OneMessage(hands.Physics).find(text), std::string::npos);
  EXPECT_EQ(hands.Physics.Wire().name, "workhorse");
  EXPECT_FALSE(hands.Physics.Exchange(Device("semi-compliant-2.0x15")));
  EXPECT_NE(
    OneMessage(hands.Physics).find("the microcatheter is not exchanged"), std::string::npos);

  hands.Move(-(was - 2.0), 0.0, 20.0);
  hands.Wait(0.2);
  const std::vector<Vector3> before = hands.Physics.Centerline();
  const double sleeve = hands.Sleeve().tip;
  EXPECT_TRUE(hands.Physics.Exchange(Wire("cto-9gf")));
  EXPECT_EQ(hands.Physics.Wire().name, "cto-9gf");
  const std::vector<Vector3> after = hands.Physics.Centerline();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t n = 0; n < after.size(); ++n)
  {
    EXPECT_LT((after[n] - before[n]).norm(), 1e-9);
  }
  hands.Wait(0.5);
  EXPECT_NEAR(hands.Tip(), before.front().z(), 0.1);
  EXPECT_NEAR(hands.Sleeve().tip, sleeve, 1e-9);
  EXPECT_LT(std::abs(hands.Physics.Report().proximalTorque), 0.02) << "it is not twisted";

  // And on, with the microcatheter behind it.
  hands.Move(14.0, 0.0, 4.0);
  EXPECT_TRUE(hands.Physics.Plugs()[0].IsCrossed());
  hands.Move(0.0, 12.0, 4.0);
  EXPECT_GT(hands.Sleeve().middle, Cap + 5.0) << "through the channel";
  hands.Move(0.0, -60.0, 20.0);
  EXPECT_TRUE(hands.Physics.Exchange(Device("semi-compliant-2.0x15")));
  EXPECT_FALSE(hands.Physics.Report().balloon.microcatheter);
}

TEST(Microcatheter, HasNoBalloon)
{
  Hands hands(Wire("workhorse"), Device("microcatheter-1.8F"));
  hands.ToCap(1.0, 6.0);
  hands.Physics.TakeMessages();
  for (const int time : { 1, 2 })
  {
    hands.Input.inflation = 6.0;
    hands.Wait(2.5);
    EXPECT_NE(OneMessage(hands.Physics).find("has no balloon"), std::string::npos) << time;
    EXPECT_EQ(hands.Sleeve().pressure, 0.0);
    hands.Input.inflation = -0.9;
    hands.Wait(0.5);
    EXPECT_TRUE(hands.Physics.TakeMessages().empty());
  }
}

TEST(Microcatheter, TakesItsPartOfTheLumen)
{
  const BalloonCatheter& device = Device("microcatheter-2.6F");
  Hands hands(Wire("workhorse"), device);
  hands.ToCap(1.0, 6.0);
  hands.Wait(0.1);
  const auto& sections = hands.Physics.Balloon()->Sections();
  ASSERT_GT(sections.size(), 20U);
  for (const auto& [point, radius] : sections)
  {
    const double behind = hands.Sleeve().middle - 0.5 * static_cast<double>(point);
    EXPECT_NEAR(radius, device.FoldedRadius(behind), 1e-3) << behind;
    EXPECT_EQ(hands.Physics.Dilated()->Radii()[point], 1.5);
  }
  EXPECT_NEAR(hands.Sleeve().middle, Cap - 6.0, 0.2) << "of its tip";
}

TEST(Microcatheter, WhatDoesNotFitIsRefusedByName)
{
  const BalloonCatheter& device = Device("microcatheter-2.6F");
  ExpectRefusal(
    [&] { Hands hands(Thick(0.2), device); }, "'thick'", "'microcatheter-2.6F'", "lumen");
  Hands hands(Wire("workhorse"), device);
  ExpectRefusal([&] { hands.Physics.Exchange(Thick(0.2)); }, "'thick'", "'microcatheter-2.6F'");
  Hands wide(Thick(0.2), Device("semi-compliant-2.0x15"));
  ExpectRefusal([&] { wide.Physics.Exchange(device); }, "'thick'", "'microcatheter-2.6F'");
  const GuideCatheter& narrow = BuiltInCatalogue().Catheter("JL4-4F").catheter;
  EXPECT_NO_THROW(Intervention(OccludedTube(), Wire("workhorse"), narrow, Hands::AtRest(), device));
  ExpectRefusal(
    [&]
    {
      Intervention(
        OccludedTube(), Wire("workhorse"), narrow, Hands::AtRest(), device, Wire("extra-support"));
    },
    "the microcatheter 'microcatheter-2.6F'", "do not fit beside each other", "'JL4-4F'");
  Scenario scenario = LoadScenario("cto-microcatheter");
  scenario.procedure.clear();
  scenario.artery = "any";
  EXPECT_NO_THROW(TrainingSession(OccludedTube(), scenario));
  scenario.wireExchanges.push_back(Thick(0.2));
  ExpectRefusal(
    [&] { TrainingSession(OccludedTube(), scenario); }, "'thick'", "'microcatheter-2.6F'");
}

TEST(Microcatheter, BitsRepeat)
{
  const auto run = [](const char* name)
  {
    Hands hands(Wire("workhorse"), Device(name));
    hands.ToCap(0.5, 5.0);
    hands.Move(-8.0, 0.0, 20.0);
    EXPECT_TRUE(hands.Physics.Exchange(Wire("cto-9gf")));
    hands.Move(6.0, 2.0, 10.0);
    return hands.Physics.StateHash();
  };
  EXPECT_EQ(run("microcatheter-2.6F"), run("microcatheter-2.6F"));
  EXPECT_NE(run("microcatheter-2.6F"), run("microcatheter-1.8F"));
}

// Recorded hands: an angiogram, a workhorse to the occlusion, the CTO wire through the microcatheter, a balloon, a stent.
TEST(MicrocatheterProcedure, TheRecordedOneRepeatsToTheBit)
{
  auto source = std::make_unique<ReplaySource>(
    std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/cto-microcatheter.pcirec");
  const ReplaySource* replay = source.get();
  const Scenario scenario = RecordedScenario(source->Reader().Header().scenario, "The recording");
  const auto wall = std::make_shared<NarrowedWallMotion>(
    MakePhantomWallMotion(scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 40),
    scenario.lesions);
  const std::uint64_t hash = WallHash(*wall);
  ASSERT_EQ(hash, source->Reader().Header().meshHash);
  SessionRunner runner(wall, scenario, hash, std::move(source));
  const Intervention& instruments = runner.Session().Instruments();
  int outside = 0;
  double deepest = 0.0;
  double furthest = 0.0; // mm from the ostium, of the microcatheter's tip
  std::string name;      // of the wire
  Vector3 tip = Vector3::Zero();
  double sleeve = 0.0;
  double moved = 0.0; // mm of the wire's tip in the tick in which the wire is exchanged
  double slid = 0.0;  // likewise, of the microcatheter
  runner.afterTick = [&](const SessionReport& report)
  {
    outside += report.tick.outside;
    deepest = std::max(deepest, report.tick.maximumPenetration);
    const Vector3 now = instruments.Centerline().front();
    if (!name.empty() && instruments.Wire().name != name)
    {
      moved = (now - tip).norm();
      slid = std::abs(report.tick.balloon.tip - sleeve);
    }
    name = instruments.Wire().name;
    tip = now;
    sleeve = report.tick.balloon.tip;
    furthest =
      report.tick.balloon.microcatheter ? std::max(furthest, report.tick.balloon.middle) : furthest;
  };
  while (runner.Run(1000))
  {
  }
  EXPECT_EQ(replay->Reader().HowEnded(), RecordingReader::Ending::Complete);
  EXPECT_GT(runner.Compared().compared, 50U);
  EXPECT_EQ(runner.Compared().equal, runner.Compared().compared)
    << "from tick " << runner.Compared().firstDifference;
  EXPECT_EQ(outside, 0);
  EXPECT_LT(deepest, 0.25);
  EXPECT_EQ(name, "cto-9gf");
  EXPECT_GT(moved, 0.0);
  EXPECT_LT(moved, 0.1);
  EXPECT_LT(slid, 0.1);
  EXPECT_TRUE(instruments.Plugs().at(0).IsCrossed());
  const std::vector<LesionResult> lesions = runner.Session().Lesions();
  ASSERT_EQ(lesions.size(), 1U);
  EXPECT_GT(furthest, lesions[0].to - 3.0) << "it follows the wire through the occlusion";
  EXPECT_LT(lesions[0].degree, 0.3);
  EXPECT_GT(lesions[0].reserve, 0.9);
  EXPECT_EQ(runner.Session().Procedure().reached.size(), 10U);
  EXPECT_TRUE(runner.Session().Score().passed);
  EXPECT_TRUE(runner.Session().Tears().empty()) << "the tip pressed on plaque, or obliquely";
}
}
