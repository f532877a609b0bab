// Two wires in one guide: which one the hand drives, what holds a jailed one, and the mouth of the branch that it is in.
#include "BalloonTestBench.h"
#include "BranchMouths.h"
#include "CoronaryFlow.h"
#include "DriveScript.h"
#include "DrivenWire.h"
#include "Numbers.h"
#include "Recording.h"
#include "Refusals.h"
#include "SessionRunner.h"
#include "TrappedWire.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace UnitTestSecondWire
{
using namespace coronary;

namespace
{
const Guidewire& Wire(const char* name)
{
  return BuiltInCatalogue().Wire(name).wire;
}

const GuideCatheter& Guide(const char* name)
{
  return BuiltInCatalogue().Catheter(name).catheter;
}

const BalloonCatheter& Balloon(const char* name)
{
  return BuiltInCatalogue().Balloon(name).balloon;
}

/// A vessel along z of 3.2 mm that goes on with 2.6 mm at 40 mm, where a branch of 2 mm leaves at an angle; points each half
/// millimetre, no surface.
WallTopology Bifurcation(double angle)
{
  WallTopology tree;
  const Vector3 at(0.0, 0.0, 40.0);
  const Vector3 side(std::sin(angle), 0.0, std::cos(angle));
  const auto add =
    [&](const char* name, int parent, double radius, const Vector3& from, const Vector3& way)
  {
    tree.axis.emplace_back();
    tree.axisRadius.emplace_back();
    tree.parent.push_back(parent);
    tree.groupName.emplace_back(name);
    for (int k = 0; k <= 80; ++k)
    {
      tree.axis.back().push_back(from + 0.5 * k * way);
      tree.axisRadius.back().push_back(radius);
    }
  };
  add("pLAD", -1, 1.6, Vector3::Zero(), Vector3::UnitZ());
  add("mLAD", 0, 1.3, at, Vector3::UnitZ());
  add("D1", 0, 1.0, at, side);
  return tree;
}

/// A stent of an inside radius over the bifurcation, from 32 to 50 mm.
void LeaveStent(double radius, DilatableWall& wall)
{
  for (std::int64_t point = 64; point <= 100; ++point)
  {
    StentRing ring;
    ring.crimped = 0.5;
    ring.natural = ring.widest = ring.radius = radius;
    ring.stiffness = 1e4; // it does not give way
    ring.opening = 1e3;
    ring.greatest = 3.0;
    if (point != 80)
    {
      wall.Place(point, ring);
    }
  }
  wall.Release();
}

std::vector<Vector3> AllPoints(const WallTopology& tree)
{
  std::vector<Vector3> points;
  for (const std::vector<Vector3>& axis : tree.axis)
  {
    points.insert(points.end(), axis.begin(), axis.end());
  }
  return points;
}

const BranchMouth& MouthOf(const BranchMouths& mouths, int branch, int beside)
{
  return *std::find_if(mouths.All().begin(), mouths.All().end(),
    [&](const BranchMouth& one) { return one.branch == branch && one.beside == beside; });
}
}

TEST(BranchMouths, AStentAsWideAsTheParentLeavesTheCosineOfTheAngle)
{
  for (const double degrees : { 50.0, 60.0, 75.0, 110.0 })
  {
    const WallTopology tree = Bifurcation(degrees * Degree);
    const std::vector<Vector3> axis = AllPoints(tree);
    for (const double share : { 0.0, 0.5, 1.0, 1.5 })
    {
      DilatableWall wall(tree, {}, axis);
      BranchMouths mouths(tree);
      ASSERT_EQ(mouths.All().size(), 2U) << "each of both is beside the other";
      LeaveStent(1.3 + share * 0.3, wall);
      for (int k = 0; k < 3; ++k)
      {
        mouths.Answer({ 2 }, wall);
        wall.Release();
      }
      const BranchMouth& mouth = MouthOf(mouths, 2, 1);
      const double wanted = std::min(1.0, share) * std::max(0.0, std::cos(degrees * Degree));
      EXPECT_NEAR(mouth.degree, wanted, 0.01 + 0.03 * wanted) << degrees << " " << share;
      EXPECT_FALSE(mouth.closed);
      EXPECT_EQ(MouthOf(mouths, 1, 2).shift, 0.0) << "nothing is open in the branch";
    }
  }
}

TEST(BranchMouths, ABranchWithoutAWireClosesFromTheCutOffOn)
{
  struct Case
  {
    double degrees;
    int within;
    bool closes;
  };
  for (const Case& one : { Case{ 35.0, -1, true }, Case{ 35.0, 1, true }, Case{ 35.0, 2, false },
         Case{ 50.0, -1, false } })
  {
    const WallTopology tree = Bifurcation(one.degrees * Degree);
    DilatableWall wall(tree, {}, AllPoints(tree));
    BranchMouths mouths(tree);
    LeaveStent(1.6, wall);
    mouths.Answer({ 1, one.within }, wall);
    EXPECT_EQ(MouthOf(mouths, 2, 1).closed, one.closes) << one.degrees << " " << one.within;
    // A wire that comes afterwards does not open it, a balloon in its mouth does.
    mouths.Answer({ 1, 2 }, wall);
    EXPECT_EQ(MouthOf(mouths, 2, 1).closed, one.closes);
    for (const auto& [point, part] : MouthOf(mouths, 2, 1).own)
    {
      wall.Hold(point, 1.0);
    }
    mouths.Answer({ 1, 2 }, wall);
    EXPECT_FALSE(MouthOf(mouths, 2, 1).closed);
    for (int k = 0; k < 3; ++k)
    {
      wall.Release();
      mouths.Answer({ 1, 2 }, wall);
    }
    EXPECT_FALSE(MouthOf(mouths, 2, 1).closed);
    EXPECT_LT(MouthOf(mouths, 2, 1).degree, 0.3) << "most of it stays open";
  }
}

TEST(BranchMouths, WhatABalloonDoesGoesWithIt)
{
  const WallTopology tree = Bifurcation(60.0 * Degree);
  DilatableWall wall(tree, {}, AllPoints(tree));
  BranchMouths mouths(tree);
  for (std::int64_t point = 70; point < 95; ++point)
  {
    wall.Hold(point, 1.7);
  }
  mouths.Answer({ 1 }, wall);
  EXPECT_NEAR(MouthOf(mouths, 2, 1).degree, 0.5, 0.02);
  wall.Release();
  mouths.Answer({ 1 }, wall);
  EXPECT_LT(MouthOf(mouths, 2, 1).degree, 0.01);
  // One that ends before the mouth does nothing.
  for (std::int64_t point = 60; point < 80; ++point)
  {
    wall.Hold(point, 1.9);
  }
  mouths.Answer({ 1 }, wall);
  EXPECT_EQ(MouthOf(mouths, 2, 1).shift, 0.0);
}

// A straight rod between a stent and the wall, drawn out along it: 2 mu p d L.
TEST(TrappedWire, IsHeldByThePressureOnItsWidth)
{
  const WallTopology tube = Tube(1.5, 0.5, 30.0, 50.0);
  const std::vector<Vector3>& axis = tube.axis[0];
  DilatableWall wall(tube, {}, axis);
  PlacedStent stent;
  for (std::int64_t point = 70; point <= 90; ++point)
  {
    StentRing ring;
    ring.crimped = 0.5;
    ring.natural = ring.widest = ring.radius = 1.45;
    ring.thickness = 0.08;
    ring.stiffness = 1e4;
    ring.opening = 1e3;
    ring.greatest = 3.0;
    wall.Place(point, ring);
    stent.points.push_back(point);
    stent.rings.push_back(0);
  }
  wall.Release();
  TrappedWire trap;
  trap.Jail(0);
  trap.BeginFrame({ stent }, nullptr, wall, axis, axis, 1.0);
  ASSERT_TRUE(trap.Active());
  const double outside = wall.Radii()[80] - 0.18;
  const double pressure =
    0.101325 * WallPressure(wall.Stations()[80], wall.Radii()[80], wall.Settings());
  ASSERT_GT(pressure, 0.05);

  constexpr double Radius = 0.18;
  constexpr double Friction = 0.1;
  struct Surface : ContactSurface
  {
    const TrappedWire* Trap = nullptr;
    double Lumen = 0.0; // mm
    void Find(const ContactSample& sample, double /*reach*/, SampleContacts& contacts) override
    {
      // The vessel about z.
      const Vector3 across(sample.centre.x(), sample.centre.y(), 0.0);
      contacts.count = 1;
      contacts.plane[0] = ContactPlane();
      contacts.plane[0].normal = -across.normalized();
      contacts.plane[0].gap = this->Lumen - across.norm() - sample.radius;
      contacts.plane[0].friction = sample.friction;
      contacts.plane[0].stiffness = 60.0;
      const bool held = this->Trap->Meet(sample, 0.5, contacts) == TrappedWire::At::Held;
      contacts.count = held ? contacts.count : 0;
    }
  } surface;
  surface.Trap = &trap;
  surface.Lumen = wall.Radii()[80];
  CosseratRod rod(80, InstrumentRod());
  rod.GetSettings().samples = 1;
  rod.GetSettings().tipSample = false;
  for (int i = 0; i < 80; ++i)
  {
    RodJoint joint;
    joint.angularStiffness = Vector3(100.0, 100.0, 80.0);
    joint.stretchStiffness = 2e4;
    RodSegment segment = MakeRodSegment(0.5, Radius, 7000.0);
    segment.friction = Friction;
    rod.Append(segment, joint, Vector3(outside, 0.0, 60.0 - 0.5 * i),
      Eigen::Quaterniond(Eigen::AngleAxisd(Pi, Vector3::UnitX())));
  }
  double force = 0.0;
  for (int k = 0; k < 2000; ++k)
  {
    rod.Prescribe(79, Vector3(outside, 0.0, 20.5 - 1e-3 * k), rod.Orientation(79));
    rod.Step(5e-4, &surface);
    Vector3 reaction;
    Vector3 moment;
    rod.Reaction(79, reaction, moment);
    force = -reaction.z();
  }
  const double held = 10.0; // mm: from point 70 to 90
  const double wanted = 2.0 * Friction * pressure * 2.0 * Radius * held;
  EXPECT_NEAR(force, wanted, 0.1 * wanted);
}

TEST(TrappedWire, AWireBesideAnOpenBalloonIsPushedAsideAndThenHeld)
{
  const WallTopology tube = Tube(1.8, 0.0, 0.0, 0.0);
  const std::vector<Vector3>& axis = tube.axis[0];
  Bench bench("semi-compliant-3.5x20", tube);
  TrappedWire trap;
  SampleContacts contacts;
  const auto meet = [&](double x, double atmospheres)
  {
    bench.Hold(atmospheres, 8.0);
    for (int k = 0; k < 2; ++k)
    {
      trap.BeginFrame({}, &bench.Sleeve, bench.Wall, axis, axis, 0.05);
    }
    trap.SetTime(0.05);
    ContactSample sample;
    sample.centre = Vector3(x, 0.0, 40.0);
    sample.radius = 0.18;
    contacts.count = 1;
    contacts.plane[0] = ContactPlane();
    contacts.plane[0].normal = -Vector3::UnitX();
    contacts.plane[0].gap = bench.Wall.Radii()[80] - 0.18 - x;
    return trap.Meet(sample, 1.0, contacts);
  };
  EXPECT_EQ(meet(0.8, 0.0), TrappedWire::At::Free) << "it is folded";
  EXPECT_EQ(contacts.count, 1);
  EXPECT_EQ(meet(0.8, 1.0), TrappedWire::At::Beside);
  ASSERT_EQ(contacts.count, 2);
  EXPECT_GT(contacts.plane[1].normal.x(), 0.99) << "outwards";
  EXPECT_LT(contacts.plane[1].gap, 0.0);
  EXPECT_EQ(meet(1.66, 14.0), TrappedWire::At::Held);
  ASSERT_EQ(contacts.count, 2);
  EXPECT_NEAR(contacts.plane[0].normal.dot(contacts.plane[1].normal), -1.0, 1e-12);
  meet(1.6, -0.9);
  EXPECT_FALSE(trap.Active()) << "it has let it go";
}

TEST(SecondWire, TheHandDrivesOneAndTheOtherOneIsAsIfItWereAlone)
{
  InterventionSettings settings;
  const Scenario scenario = LoadScenario("lad-lesion");
  settings.rootBranch = RootBranch(LesionedPhantom()->Topology(), "LCA");
  Intervention alone(
    LesionedPhantom(), Wire("workhorse"), Guide("EBU3.5-6F"), settings, std::nullopt);
  Intervention both(LesionedPhantom(), Wire("workhorse"), Guide("EBU3.5-6F"), settings,
    std::nullopt, Wire("polymer-jacket"));
  ASSERT_EQ(alone.NumberOfWires(), 1U);
  ASSERT_EQ(both.NumberOfWires(), 2U);
  EXPECT_FALSE(alone.TakeWire(1));
  EXPECT_FALSE(both.TakeWire(2));
  DriveInput input;
  const auto run = [&](int ticks, double speed)
  {
    for (int k = 0; k < ticks; ++k)
    {
      input.wirePosition += speed / settings.tickRate;
      alone.Step(input);
      both.Step(input);
    }
  };
  run(1600, 25.0);
  EXPECT_EQ(alone.Centerline(), std::vector<Vector3>(both.Centerline(0))) << "to the bit";
  EXPECT_GT(both.Report().wires[0].inserted, 15.0);
  EXPECT_EQ(both.Report().wires[1].inserted, 0.0);
  ASSERT_TRUE(both.TakeWire(1));
  const double first = both.Report().wires[0].inserted;
  run(1000, 30.0);
  EXPECT_EQ(both.Report().hand, 1U);
  EXPECT_NEAR(both.Report().wires[0].inserted, first, 1e-9) << "it is held";
  EXPECT_GT(both.Report().wires[1].inserted, 10.0);
  EXPECT_EQ(both.Report().inserted, both.Report().wires[1].inserted);
  EXPECT_EQ(both.Wire(1).name, "polymer-jacket");
  // Only the one in hand is exchanged, and only in the guide.
  EXPECT_FALSE(both.Exchange(Wire("cto-9gf")));
  run(1000, -40.0);
  EXPECT_TRUE(both.Exchange(Wire("cto-9gf")));
  EXPECT_EQ(both.Wire(1).name, "cto-9gf");
  EXPECT_EQ(both.Wire(0).name, "workhorse");
  ASSERT_TRUE(both.TakeWire(0));
  run(200, -30.0);
  EXPECT_LT(both.Report().wires[0].inserted, first - 2.0);
}

TEST(SecondWire, IsRefusedWhereItDoesNotFitBesideTheBalloon)
{
  EXPECT_NO_THROW(RequireFitBeside(Balloon("stent-3.5x23"), Wire("workhorse"), Guide("EBU3.5-5F")));
  EXPECT_NO_THROW(RequireFit(Balloon("semi-compliant-2.0x15"), Guide("JL4-4F")));
  ExpectRefusal([]
    { RequireFitBeside(Balloon("semi-compliant-2.0x15"), Wire("workhorse"), Guide("JL4-4F")); },
    "do not fit beside each other");
  Scenario scenario = LoadScenario("lad-lesion");
  scenario.secondWire = Wire("workhorse");
  scenario.catheter = Guide("JL4-4F");
  scenario.balloon = Balloon("semi-compliant-2.0x15");
  ExpectRefusal([&] { TrainingSession(LesionedPhantom(), scenario); }, "semi-compliant-2.0x15");
  scenario.catheter = Guide("JL4-6F");
  scenario.exchanges = { Balloon("semi-compliant-2.0x15") };
  scenario.exchanges[0].crossingRadius = 0.75;
  ExpectRefusal([&] { TrainingSession(LesionedPhantom(), scenario); }, "fit beside each other");
  scenario = LoadScenario("lad-lesion");
  const auto refused = [&](const std::string& members, const char* why)
  {
    std::string text = ScenarioText(scenario);
    text.insert(text.find('{') + 1, members);
    ExpectRefusal([&] { ScenarioFromText(text, "s.json", "."); }, why);
  };
  refused(R"("second_wire": "string",)", "string");
  scenario.procedure = { { ProcedureStep::Goal::WireIn, "protect", "D1", 0.0, 1 } };
  ExpectRefusal(
    [&] { ScenarioFromText(ScenarioText(scenario), "s.json", "."); }, "no 'second_wire'");
  scenario.secondWire = Wire("workhorse");
  EXPECT_EQ(
    ScenarioText(ScenarioFromText(ScenarioText(scenario), "s.json", ".")), ScenarioText(scenario));
  scenario.procedure = { { ProcedureStep::Goal::SideBranchOpen, "look", "D9", 0.8 } };
  ExpectRefusal([&] { TrainingSession(LesionedPhantom(), scenario); }, "'D9'");
  // A session without one says so, and goes on.
  TrainingSession session(LesionedPhantom(), LoadScenario("lad-lesion"));
  EXPECT_FALSE(session.Apply({ RecordedEvent::TakeWire, 1.0 }));
  EXPECT_EQ(session.TakeMessages().back(), "There is no second wire in this scenario.");
  EXPECT_TRUE(session.Apply({ RecordedEvent::TakeWire, 0.0 }));
}

TEST(SecondWire, ScriptsTakeItAndOldRecordingsHaveNoAnswerOfBranches)
{
  const std::string head = R"({ "format": "dynamiccoronary script", "version": 1, "pieces": )";
  const DriveScript script =
    DriveScriptFromText(head + R"([ { "seconds": 1 }, { "seconds": 2, "take_wire": 1 } ] })", "d");
  EXPECT_TRUE(script.Events(0.0, 1.0).empty());
  ASSERT_EQ(script.Events(1.0, 3.0).size(), 1U);
  EXPECT_EQ(script.Events(1.0, 3.0)[0].kind, RecordedEvent::TakeWire);
  EXPECT_EQ(script.Events(1.0, 3.0)[0].value, 1.0);
  ExpectRefusal([&]
    { DriveScriptFromText(head + R"([ { "seconds": 1, "take_wire": 2 } ] })", "d"); },
    "'take_wire'");
  const Scenario scenario = LoadScenario("lad-bifurcation");
  EXPECT_TRUE(scenario.settings.branchesAnswer);
  EXPECT_TRUE(RecordedScenario(ScenarioText(scenario), "r").settings.branchesAnswer);
  std::string before = ScenarioText(scenario);
  const std::string key = "\"side_branches_answer\": true,";
  ASSERT_NE(before.find(key), std::string::npos);
  before.erase(before.find(key), key.size());
  EXPECT_FALSE(RecordedScenario(before, "r").settings.branchesAnswer);
}

namespace
{
/// Recorded hands, but for what they do with the second wire.
class FirstWireOnly : public TickSource
{
public:
  explicit FirstWireOnly(const std::string& path)
    : Whole(path)
  {
  }
  const RecordingReader& Reader() const { return this->Whole.Reader(); }
  bool At(std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events) override
  {
    std::vector<RecordedEvent> all;
    const bool goesOn = this->Whole.At(tick, this->Raw, all);
    input = this->Raw;
    for (const RecordedEvent& event : all)
    {
      if (event.kind == RecordedEvent::TakeWire)
      {
        this->Second = event.value == 1.0;
      }
      else
      {
        events.push_back(event);
      }
    }
    const DriveInput now = input.drive;
    this->LeftOut.wirePosition += this->Second ? now.wirePosition - this->Last.wirePosition : 0.0;
    this->LeftOut.wireAngle += this->Second ? now.wireAngle - this->Last.wireAngle : 0.0;
    this->Last = now;
    input.drive.wirePosition -= this->LeftOut.wirePosition;
    input.drive.wireAngle -= this->LeftOut.wireAngle;
    return goesOn;
  }

private:
  ReplaySource Whole;
  SessionInput Raw;
  bool Second = false;
  DriveInput Last;
  DriveInput LeftOut;
};

const std::string Recorded =
  std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/lad-bifurcation.pcirec";

std::shared_ptr<WallMotion> WallFor(const Scenario& scenario)
{
  return std::make_shared<NarrowedWallMotion>(
    MakePhantomWallMotion(scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 40),
    scenario.lesions);
}

const MouthResult& MouthOf(const std::vector<MouthResult>& mouths, const std::string& vessel)
{
  return *std::find_if(
    mouths.begin(), mouths.end(), [&](const MouthResult& mouth) { return mouth.vessel == vessel; });
}

std::ptrdiff_t Count(const TrainingSession& session, ProcedureEvent::Kind kind)
{
  const std::vector<ProcedureEvent>& events = session.Metrics().events;
  return std::count_if(
    events.begin(), events.end(), [&](const ProcedureEvent& event) { return event.kind == kind; });
}
}

// Recorded hands: an angiogram, a wire in the LAD, one in the diagonal, a stent across its mouth, the jailed wire drawn out.
TEST(Bifurcation, TheRecordedOneRepeatsToTheBit)
{
  auto source = std::make_unique<ReplaySource>(Recorded);
  const ReplaySource* replay = source.get();
  const Scenario scenario = RecordedScenario(source->Reader().Header().scenario, "The recording");
  const std::shared_ptr<WallMotion> wall = WallFor(scenario);
  const std::uint64_t hash = WallHash(*wall);
  ASSERT_EQ(hash, source->Reader().Header().meshHash);
  SessionRunner runner(wall, scenario, hash, std::move(source));
  const TrainingSession& session = runner.Session();
  int outside = 0;
  double held = 0.0;   // mm
  double grip = 0.0;   // N, of the jailed wire
  double jailed = 0.0; // N at the hand, most that it takes to draw it
  double free = 0.0;   // likewise, once it is free
  double narrowest = 0.0;
  runner.afterTick = [&](const SessionReport& report)
  {
    const WireReport& second = report.tick.wires[1];
    outside += report.tick.outside;
    held = std::max(held, second.held);
    grip = std::max(grip, second.jailed ? second.grip : 0.0);
    if (report.tick.hand == 1 && !session.Instruments().Stents().empty())
    {
      (second.jailed ? jailed : free) = std::max(second.jailed ? jailed : free, -second.force);
    }
  };
  std::string said;
  runner.say = [&](std::uint64_t /*tick*/, const std::string& text) { said += text + "\n"; };
  while (runner.Run(1000))
  {
    narrowest = std::max(narrowest, MouthOf(session.Mouths(), "D1").degree);
  }
  EXPECT_EQ(replay->Reader().HowEnded(), RecordingReader::Ending::Complete);
  EXPECT_GT(runner.Compared().compared, 50U);
  EXPECT_EQ(runner.Compared().equal, runner.Compared().compared)
    << "from tick " << runner.Compared().firstDifference;
  EXPECT_EQ(outside, 0);
  EXPECT_GT(held, 5.0);
  EXPECT_LT(held, 18.0) << "shorter than the stent: it leaves for the diagonal";
  EXPECT_GT(grip, 0.03);
  EXPECT_GT(jailed, 1.5 * free);
  EXPECT_NE(said.find("The second wire is jailed"), std::string::npos) << said;
  EXPECT_NE(said.find("The second wire is free of the stent"), std::string::npos) << said;
  EXPECT_EQ(Count(session, ProcedureEvent::Kind::SideBranchClosed), 0);
  EXPECT_GT(narrowest, 0.5) << "the stent pinches it";
  const std::vector<MouthResult> mouths = session.Mouths();
  EXPECT_FALSE(MouthOf(mouths, "D1").closed);
  EXPECT_GT(MouthOf(mouths, "D1").reserve, 0.8);
  const std::vector<StentResult> stents = session.Stents();
  ASSERT_EQ(stents.size(), 1U);
  EXPECT_FALSE(stents[0].missedAll);
  ASSERT_EQ(session.Procedure().reached.size(), scenario.procedure.size())
    << NextOf(scenario.procedure, session.Procedure());
  EXPECT_TRUE(session.Score().passed);
}

// The same hands on the first wire, and the diagonal without protection.
TEST(Bifurcation, WithoutASecondWireTheBranchCloses)
{
  auto source = std::make_unique<FirstWireOnly>(Recorded);
  const Scenario scenario = RecordedScenario(source->Reader().Header().scenario, "The recording");
  const std::shared_ptr<WallMotion> wall = WallFor(scenario);
  SessionRunner runner(wall, scenario, WallHash(*wall), std::move(source));
  const TrainingSession& session = runner.Session();
  std::string said;
  runner.say = [&](std::uint64_t /*tick*/, const std::string& text) { said += text + "\n"; };
  while (runner.Run(1000) && Count(session, ProcedureEvent::Kind::SideBranchClosed) == 0)
  {
  }
  runner.Run(2000);
  EXPECT_NE(said.find("The side branch D1 is closed"), std::string::npos) << said;
  const std::vector<ProcedureEvent>& events = session.Metrics().events;
  const auto closed = std::find_if(events.begin(), events.end(),
    [](const ProcedureEvent& event)
    { return event.kind == ProcedureEvent::Kind::SideBranchClosed; });
  ASSERT_NE(closed, events.end());
  EXPECT_EQ(session.Topology().groupName[closed->branch], "D1");
  EXPECT_NEAR(closed->place, 33.7, 0.5);
  const std::vector<MouthResult> mouths = session.Mouths();
  EXPECT_TRUE(MouthOf(mouths, "D1").closed);
  EXPECT_LT(MouthOf(mouths, "D1").reserve, 0.2);
  const CoronaryFlow& flow = session.Contrast().FlowModel();
  const std::vector<double> tips = flow.TipFlows();
  double lost = 0.0;
  for (std::size_t n = 0; n < tips.size(); ++n)
  {
    const int above = flow.Network().Nodes()[n].above;
    const bool inside = above >= 0 && flow.Network().IsTip(static_cast<int>(n)) &&
      session.Topology().groupName[flow.Network().Segments()[above].branch] == "D1";
    lost += inside ? tips[n] : 0.0;
  }
  EXPECT_LT(std::abs(lost), 1e-3) << "mL/s";
  const std::vector<std::string> failures = session.Score().failures;
  EXPECT_NE(std::find(failures.begin(), failures.end(), "the side branch D1 is left closed"),
    failures.end());
}
}
