// Occlusions: tissue in front of a wire's tip, the channel behind it, no blood until it is opened; wires that are exchanged.
#include "BalloonTestBench.h"
#include "CoronaryFlow.h"
#include "Ischaemia.h"
#include "Numbers.h"
#include "Recording.h"
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

namespace UnitTestOcclusion
{
using namespace coronary;

namespace
{
constexpr double Middle = 30.0; // mm from the ostium
constexpr double Length = 14.0;
constexpr double Cap = Middle - 0.5 * Length + 3.0; // the first point that tissue fills

/// A straight vessel of 3 mm, a point of its axis each half millimetre, with an occlusion.
std::shared_ptr<WallMotion> OccludedTube(double strength = VesselLesion().strength)
{
  WallTopology topology;
  std::vector<Vector3> points;
  AppendTube(topology, points, 0.0, 1.5, 100.0, 24, 200);
  const auto tube = std::make_shared<StillWallMotion>(topology, points);
  VesselLesion lesion{ "tube0", Middle, Length, 1.0, 0.0, strength };
  return std::make_shared<NarrowedWallMotion>(tube, std::vector<VesselLesion>{ lesion });
}

const Guidewire& Wire(const char* name)
{
  return BuiltInCatalogue().Wire(name).wire;
}

Guidewire EvenWire(double radius)
{
  Guidewire wire;
  wire.name = "even";
  WireSection section;
  section.length = 1800.0;
  section.bendingStiffness1 = section.bendingStiffness2 = 30.0;
  section.torsionalStiffness = 23.0;
  section.axialStiffness = 8000.0;
  section.radius = radius;
  section.density = 7000.0;
  section.friction = 0.1;
  wire.sections = { section };
  return wire;
}

/// A wire in the tube, and a hand that moves evenly.
struct Hand
{
  explicit Hand(const Guidewire& wire, const std::shared_ptr<WallMotion>& wall = OccludedTube())
    : Physics(wall, wire, BuiltInCatalogue().Catheter("EBU3.5-6F").catheter, AtRest())
  {
  }
  static InterventionSettings AtRest()
  {
    InterventionSettings settings;
    settings.heartRate = 0.0;
    return settings;
  }
  const OcclusionPlug& Plug() const { return this->Physics.Plugs().at(0); }
  double Tip() const { return this->Physics.Centerline().front().z(); }

  /// @param look  after each tick
  void Move(double mm, double speed, const std::function<void(const TickReport&)>& look = {})
  {
    const int ticks = static_cast<int>(std::lround(std::abs(mm) / speed * 2000.0));
    for (int tick = 0; tick < ticks; ++tick)
    {
      this->Input.wirePosition += mm / ticks;
      const TickReport& report = this->Physics.Step(this->Input);
      ASSERT_EQ(report.outside, 0);
      this->Most = std::max(this->Most, report.capForce);
      if (look)
      {
        look(report);
      }
    }
  }

  Intervention Physics;
  DriveInput Input;
  double Most = 0.0; ///< N on the cap
};

/// mm of wire from the hand's start until its tip is half a millimetre before the cap.
constexpr double ToCap = Cap - 1.5;
}

TEST(Occlusion, FillsTheVesselBetweenTwoStumps)
{
  const std::shared_ptr<WallMotion> wall = OccludedTube(7.0);
  const WallTopology& topology = wall->Topology();
  std::vector<Vector3> points;
  wall->Positions(0.0, points);
  CheckWallSurface(topology, points);
  const std::vector<FoundLesion> lesions = FindLesions(topology);
  ASSERT_EQ(lesions.size(), 1U);
  EXPECT_EQ(lesions[0].degree, 1.0);
  EXPECT_EQ(lesions[0].vessel, "tube0");
  const std::vector<Occlusion> occlusions = FindOcclusions(topology);
  ASSERT_EQ(occlusions.size(), 1U);
  EXPECT_EQ(occlusions[0].strength, 7.0);
  EXPECT_NEAR(occlusions[0].places.back(), Length - 6.0, 1e-9);
  EXPECT_NEAR(topology.axis[0][occlusions[0].points.front()].z(), Cap, 1e-9);
  for (const Vector3& point : points)
  {
    const double radius = point.head<2>().norm();
    if (std::abs(point.z() - Middle) < 0.5 * Length - 3.0)
    {
      EXPECT_TRUE(radius < 1e-9 || std::abs(radius - ChannelRadius) < 1e-6) << radius;
    }
    else if (std::abs(point.z() - Middle) > 0.5 * Length && radius > 0.0)
    {
      EXPECT_NEAR(radius, 1.5, 1e-9);
    }
  }
  const std::vector<double> closed = ClosedRadii(topology)[0];
  EXPECT_NEAR(closed[60], ChannelRadius, 1e-9);
  EXPECT_EQ(closed[40], 0.0);
}

TEST(Occlusion, BadOnesAreRefusedByName)
{
  const auto refused = [](const VesselLesion& lesion, double radius, const std::string& words)
  {
    WallTopology topology;
    std::vector<Vector3> points;
    AppendTube(topology, points, 0.0, radius, 50.0, 12, 100);
    const auto tube = std::make_shared<StillWallMotion>(topology, points);
    ExpectRefusal([&] { NarrowedWallMotion(tube, { lesion }); }, "'tube0'", words);
  };
  refused({ "tube0", 25.0, 14.0, 0.97, 0.0 }, 1.5, "a degree");
  refused({ "tube0", 25.0, 14.0, 1.0, 0.0, -1.0 }, 1.5, "a strength of its cap");
  refused({ "tube0", 25.0, 14.0, 1.0, 0.0, std::nan("") }, 1.5, "a strength of its cap");
  refused({ "tube0", 25.0, 3.0, 1.0, 0.0 }, 1.5, "a length (mm)");
  refused({ "tube0", 25.0, 14.0, 1.0, 0.0 }, 0.3, "a radius (mm)");
}

// The hand's load goes into the tip as long as the wire is straight: what moves the plug on is strength x section.
TEST(Occlusion, YieldsAtStrengthTimesSection)
{
  for (const double strength : { 4.0, 12.0 })
  {
    for (const double radius : { 0.1145, 0.178 })
    {
      Hand hand(EvenWire(radius), OccludedTube(strength));
      hand.Move(ToCap, 20.0);
      ASSERT_EQ(hand.Plug().Crossed(), 0.0);
      double sum = 0.0;
      int ticks = 0;
      double before = 0.0;
      hand.Move(2.5, 0.5,
        [&](const TickReport& report)
        {
          const double crossed = hand.Plug().Crossed();
          EXPECT_GE(crossed, before) << "it does not come back";
          if (crossed > before)
          {
            sum += report.capForce;
            ++ticks;
          }
          before = crossed;
        });
      ASSERT_GT(ticks, 1000);
      const double section = Pi * radius * radius;
      Print("plug of an occlusion yields: N", strength * section, sum / ticks);
      EXPECT_NEAR(sum / ticks, strength * section, 0.02 * strength * section);
      EXPECT_EQ(hand.Plug().YieldForce(radius), strength * section);
      // What the plug went, the tip went, but for what both are pressed together.
      EXPECT_NEAR(hand.Tip() + radius - Cap, hand.Plug().Crossed(), 0.3);
      EXPECT_GT(hand.Plug().Crossed(), 1.0);
      EXPECT_FALSE(hand.Plug().IsCrossed());
    }
  }
}

TEST(Occlusion, LessThanThatDoesNotMoveIt)
{
  Hand hand(EvenWire(0.178), OccludedTube());
  hand.Move(ToCap, 20.0);
  const double yields = hand.Plug().YieldForce(0.178);
  while (hand.Physics.Report().capForce < 0.95 * yields)
  {
    hand.Move(0.001, 1.0);
  }
  for (int beat = 0; beat < 10; ++beat)
  {
    hand.Move(0.004, 1.0);
    hand.Move(-0.004, 1.0);
  }
  EXPECT_LT(hand.Most, yields);
  EXPECT_GT(hand.Most, 0.9 * yields);
  EXPECT_EQ(hand.Plug().Crossed(), 0.0);
}

// The same hands: what the first wire's tip bears before it buckles is not enough, whatever the speed.
TEST(Occlusion, AWorkhorseBucklesAndACtoWirePasses)
{
  for (const double speed : { 4.0, 20.0, 60.0, 100.0 })
  {
    Hand soft(Wire("workhorse"));
    soft.Move(ToCap, 30.0);
    soft.Move(speed == 20.0 ? 40.0 : 12.0, speed); // long enough that it folds back
    std::printf(
      "workhorse at %g mm/s: %.3f of %.3f N\n", speed, soft.Most, soft.Plug().YieldForce(0.178));
    EXPECT_EQ(soft.Plug().Crossed(), 0.0) << speed;
    EXPECT_GT(soft.Most, 0.05) << "it did press";
    EXPECT_LT(soft.Tip(), Cap);
  }
  Hand stiff(Wire("cto-9gf"));
  stiff.Move(ToCap, 30.0);
  stiff.Move(12.0, 4.0);
  std::printf("cto-9gf: %.3f N\n", stiff.Most);
  EXPECT_TRUE(stiff.Plug().IsCrossed());
  EXPECT_GT(stiff.Tip(), Cap + stiff.Plug().Length());
}

TEST(Occlusion, TheChannelStaysForEveryWire)
{
  Hand hand(Wire("cto-9gf"));
  hand.Move(ToCap, 30.0);
  hand.Move(5.0, 4.0);
  const double crossed = hand.Plug().Crossed();
  ASSERT_GT(crossed, 2.0);
  ASSERT_LT(crossed, hand.Plug().Length());
  hand.Most = 0.0;
  hand.Move(-20.0, 10.0);
  EXPECT_EQ(hand.Plug().Crossed(), crossed);
  EXPECT_FALSE(hand.Physics.Exchange(Wire("workhorse"))) << "it is out";
  const std::vector<std::string> messages = hand.Physics.TakeMessages();
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_NE(messages[0].find("the wire is not exchanged"), std::string::npos);
  hand.Move(-15.0, 30.0);
  ASSERT_EQ(hand.Physics.Report().inserted, 0.0);
  EXPECT_TRUE(hand.Physics.Exchange(Wire("workhorse")));
  EXPECT_EQ(hand.Physics.Wire().name, "workhorse");
  hand.Most = 0.0;
  while (hand.Physics.Report().capForce == 0.0 && hand.Tip() < Cap + hand.Plug().Length())
  {
    hand.Move(0.1, 5.0);
  }
  EXPECT_NEAR(hand.Tip(), Cap + crossed, 0.5) << "up to what is left";
  hand.Move(3.0, 5.0);
  EXPECT_EQ(hand.Plug().Crossed(), crossed);
}

TEST(Occlusion, BitsRepeat)
{
  const auto run = [](double strength)
  {
    Hand hand(Wire("cto-9gf"), OccludedTube(strength));
    hand.Move(ToCap + 6.0, 10.0);
    return hand.Physics.StateHash();
  };
  EXPECT_EQ(run(12.0), run(12.0));
  EXPECT_NE(run(12.0), run(11.9));
}

TEST(WireExchange, IsTheOtherWireFromTheBeginning)
{
  Hand other(Wire("cto-9gf"));
  Hand exchanged(Wire("workhorse"));
  EXPECT_TRUE(exchanged.Physics.Exchange(Wire("cto-9gf")));
  for (Hand* hand : { &other, &exchanged })
  {
    hand->Move(ToCap + 1.0, 20.0);
  }
  EXPECT_EQ(other.Physics.StateHash(), exchanged.Physics.StateHash());
  Guidewire thick = Wire("workhorse");
  thick.name = "thick";
  thick.sections[4].radius = 0.95;
  ExpectRefusal([&] { exchanged.Physics.Exchange(thick); }, "'thick'", "'EBU3.5-6F'");
}

TEST(OcclusionFlow, NothingComesThroughUntilABalloonHasOpenedIt)
{
  const std::shared_ptr<WallMotion> wall = OccludedTube();
  const WallTopology& topology = wall->Topology();
  CoronaryFlow flow(topology, {});
  const std::vector<double> none(topology.axisRadius[0].size(), 0.0);
  const auto settled = [&]
  {
    for (int k = 0; k < 2000; ++k)
    {
      flow.Step(0.005, 0.5, 0.0);
    }
    return flow.TreeFlow(0);
  };
  const double healthy = flow.HealthyTipFlows()[1];
  ASSERT_GT(healthy, 0.1);
  EXPECT_LT(std::abs(settled()), 1e-4 * healthy);
  EXPECT_NEAR(flow.PressureAt({ 0, 60.0 }), 5.0, 0.1) << "behind it: venous pressure";
  EXPECT_NEAR(flow.PressureAt({ 0, 10.0 }), flow.AorticPressureNow(), 0.01);
  EXPECT_LT(flow.FlowReserves({ { 0, 60.0 } })[0], 0.1);
  Ischaemia heart(flow);
  flow.SetLumen(topology.axisRadius[0], none);
  EXPECT_LT(std::abs(settled()), 1e-4 * healthy) << "the channel of a wire";
  heart.SetFlow(flow);
  EXPECT_EQ(heart.ShareWithout(), 0.0) << "its heart lives without it";
  std::vector<double> opened = topology.axisRadius[0];
  std::replace_if(
    opened.begin(), opened.end(), [](double radius) { return radius < 1.2; }, 1.2);
  flow.SetLumen(opened, none);
  EXPECT_GT(settled(), 0.5 * healthy);
  EXPECT_GT(flow.FlowReserves({ { 0, 60.0 } })[0], 0.9);
  flow.SetLumen(topology.axisRadius[0], none);
  EXPECT_LT(std::abs(settled()), 1e-4 * healthy);
}

// Recorded hands: an angiogram from two sides, a workhorse that buckles, the CTO wire, a balloon, a stent, an angiogram.
TEST(OcclusionProcedure, TheRecordedOneRepeatsToTheBit)
{
  auto source = std::make_unique<ReplaySource>(
    std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/cto-lad.pcirec");
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
  bool opened = false; // a balloon is or was out of the guide
  double deepest = 0.0;
  double most[2] = { 0.0, 0.0 }; // N on the cap, of both wires
  double crossed = 0.0;          // mm, by the first one
  double behind = 0.0;           // mL/s behind it, before there was a balloon
  const Occlusion occlusion = FindOcclusions(wall->Topology()).at(0);
  const int occluded = FindLesions(wall->Topology())[0].branch;
  const int distal = occluded + 1;
  double stump = 0.0;    // of contrast medium, 3 mm before the cap
  double darkness = 1.0; // likewise, a point behind the cap
  runner.afterTick = [&](const SessionReport& report)
  {
    outside += report.tick.outside;
    deepest = std::max(deepest, report.tick.maximumPenetration);
    const bool first = instruments.Wire().name == "workhorse";
    most[first ? 0 : 1] = std::max(most[first ? 0 : 1], report.tick.capForce);
    crossed = first ? instruments.Plugs()[0].Crossed() : crossed;
    if (report.tick.tick == 3000)
    {
      // A branch has a slab less than points.
      const std::int64_t slab = occlusion.points.front() - occluded;
      const std::vector<double>& medium = runner.Session().Contrast().Concentration();
      stump = medium[slab - 6];
      darkness = medium[slab + 1];
    }
    opened = opened || report.tick.balloon.tip > 0.0;
    if (!opened)
    {
      behind = std::max(behind, std::abs(runner.Session().Contrast().Flow(distal)));
    }
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
  EXPECT_EQ(crossed, 0.0) << "the workhorse buckles";
  EXPECT_GT(most[0], 0.1);
  const OcclusionPlug& plug = instruments.Plugs().at(0);
  EXPECT_LT(most[0], plug.YieldForce(0.178));
  EXPECT_GT(most[1], plug.YieldForce(0.1145));
  EXPECT_TRUE(plug.IsCrossed());
  EXPECT_LT(behind, 1e-3) << "mL/s";
  EXPECT_GT(stump, 0.3);
  EXPECT_EQ(darkness, 0.0);
  const std::vector<LesionResult> lesions = runner.Session().Lesions();
  ASSERT_EQ(lesions.size(), 1U);
  EXPECT_EQ(lesions[0].degreeBefore, 1.0);
  EXPECT_LT(lesions[0].degree, 0.3);
  EXPECT_LT(lesions[0].reserveBefore, 0.1);
  EXPECT_GT(lesions[0].reserve, 0.9);
  EXPECT_EQ(runner.Session().Procedure().reached.size(), 8U);
  EXPECT_TRUE(runner.Session().Score().passed);
  EXPECT_TRUE(runner.Session().Tears().empty()) << "the tip pressed on plaque, or obliquely";
  EXPECT_EQ(runner.Session().Metrics().greatestStShift, 0.0) << "its heart lived without it";
}
}
