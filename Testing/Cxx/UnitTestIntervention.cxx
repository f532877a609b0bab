// A wire in beating phantoms: where scripted hands bring it, what is refused, and that it repeats.
#include "FixedStepClock.h"
#include "InstrumentCatalogue.h"
#include "Intervention.h"
#include "Recording.h"
#include "Scenario.h"
#include "WallMotions.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace UnitTestIntervention
{
using namespace coronary;

namespace
{
// Made once: both arteries of the standard phantom.
std::shared_ptr<WallMotion> Phantom()
{
  static const std::shared_ptr<WallMotion> wall = []
  {
    const Scenario scenario = LoadScenario("phantom-lca");
    return MakePhantomWallMotion(
      scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 40);
  }();
  return wall;
}

InterventionSettings SettingsFor(const std::string& artery)
{
  InterventionSettings settings;
  settings.rootBranch = RootBranch(Phantom()->Topology(), artery);
  return settings;
}

const Guidewire& Wire(const std::string& name)
{
  return BuiltInCatalogue().Wire(name).wire;
}

const GuideCatheter& Catheter(const std::string& name)
{
  return BuiltInCatalogue().Catheter(name).catheter;
}

std::string WhyRefused(
  const Guidewire& wire, const GuideCatheter& catheter, const InterventionSettings& settings)
{
  try
  {
    Intervention intervention(Phantom(), wire, catheter, settings);
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}

}

TEST(Intervention, FollowsTheBeatingWall)
{
  Intervention intervention(
    Phantom(), Wire("workhorse"), Catheter("EBU3.5-6F"), SettingsFor("LCA"));
  DriveInput input;
  double deepest = 0.0;
  double widest = 0.0;
  for (int k = 0; k < 6000; ++k)
  {
    input.wirePosition += 20.0 / 2000.0;
    const TickReport& report = intervention.Step(input);
    deepest = std::max(deepest, report.maximumPenetration);
    widest = std::max(widest, report.jointGap);
    ASSERT_EQ(0, report.outside) << "tick " << k;
  }
  EXPECT_LE(deepest, 0.1);
  EXPECT_LE(widest, 0.01);
  const TickReport& report = intervention.Report();
  EXPECT_GT(report.inserted, 50.0);
  EXPECT_GT(report.contacts, 3);
  EXPECT_GT(report.proximalForce, 0.005);
  EXPECT_LT(report.proximalForce, 2.0);
  EXPECT_GE(report.branch, 0);
  // Two beats later the hands have not moved, but the wire has.
  const Vector3 before = intervention.Centerline().front();
  double travelled = 0.0;
  Vector3 last = before;
  for (int k = 0; k < 3200; ++k)
  {
    intervention.Step(input);
    travelled += (intervention.Centerline().front() - last).norm();
    last = intervention.Centerline().front();
  }
  EXPECT_GT(travelled, 10.0);
  EXPECT_LT((last - before).norm(), 8.0) << "after two beats it is back, but for what slid";
}

TEST(Intervention, AWireThatIsHeldResistsThePullAndTheGuideAddsToIt)
{
  std::array<double, 2> pushed{};
  std::array<double, 2> pulled{};
  for (const bool rubs : { false, true })
  {
    GuideCatheter guide = Catheter("JL4-6F");
    guide.friction = rubs ? guide.friction : 0.0;
    InterventionSettings settings = SettingsFor("LCA");
    settings.wallFriction = 6.0;
    Intervention intervention(Phantom(), Wire("workhorse"), guide, settings);
    DriveInput input;
    const auto meanForce = [&](double speed, int ticks)
    {
      double sum = 0.0;
      for (int k = 0; k < ticks; ++k)
      {
        input.wirePosition += speed / 2000.0;
        sum += intervention.Step(input).proximalForce / ticks;
      }
      return sum;
    };
    meanForce(20.0, 4000);
    pushed[rubs] = meanForce(20.0, 1000);
    meanForce(-20.0, 200); // friction turns round
    pulled[rubs] = meanForce(-20.0, 1000);
  }
  EXPECT_GT(pushed[0], 0.02);
  EXPECT_LT(pulled[0], -0.02);
  EXPECT_GT(pushed[1], 1.5 * pushed[0]); // exp(0.08 * 5), and more by the wire's stiffness
  EXPECT_LT(pulled[1], 1.5 * pulled[0]);
}

// Recorded hands: where they bring the wire, and that it stays in the lumen on the way.
class Replay : public testing::TestWithParam<std::array<const char*, 4>>
{
};

TEST_P(Replay, ReachesItsBranch)
{
  const auto& [file, wire, artery, wanted] = this->GetParam();
  RecordingReplay replay(RecordingReader(
    std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/" + file + ".pcirec"));
  Intervention intervention(Phantom(), Wire(wire),
    Catheter(std::string(artery) == "RCA" ? "JR4-6F" : "EBU3.5-6F"), SettingsFor(artery));
  coronary::SessionInput input;
  std::vector<RecordedEvent> events;
  double deepest = 0.0;
  double widest = 0.0;
  double sum = 0.0;
  std::uint64_t tick = 0;
  for (; replay.At(tick, input, events); ++tick)
  {
    const TickReport& report = intervention.Step(input.drive);
    deepest = std::max(deepest, report.maximumPenetration);
    widest = std::max(widest, report.jointGap);
    sum += report.meanPenetration;
    ASSERT_EQ(0, report.outside) << "tick " << tick;
  }
  ASSERT_EQ(RecordingReader::Ending::Complete, replay.Reader().HowEnded());
  EXPECT_LE(deepest, 0.1);
  EXPECT_LE(sum / static_cast<double>(tick), 0.02);
  EXPECT_LE(widest, 0.01);
  const WallTopology& topology = Phantom()->Topology();
  const int branch = intervention.Report().branch;
  ASSERT_GE(branch, 0);
  EXPECT_EQ(wanted, topology.groupName[branch]);
  // Well into it: the tip is nearest to a place in the last half of its axis.
  std::vector<Vector3> axis;
  Phantom()->AxisPositions(intervention.Report().phase, axis);
  std::size_t first = 0;
  for (int b = 0; b < branch; ++b)
  {
    first += topology.axis[b].size();
  }
  double best = std::numeric_limits<double>::infinity();
  std::size_t at = 0;
  for (std::size_t i = 0; i < topology.axis[branch].size(); ++i)
  {
    const double distance = (axis[first + i] - intervention.Centerline().front()).norm();
    if (distance < best)
    {
      best = distance;
      at = i;
    }
  }
  EXPECT_LT(best, 1.5);
  EXPECT_GT(at, topology.axis[branch].size() / 2);
}

INSTANTIATE_TEST_SUITE_P(Intervention, Replay,
  testing::Values(std::array<const char*, 4>{ "lad-apex", "workhorse", "LCA", "dLAD" },
    std::array<const char*, 4>{ "diagonal", "workhorse", "LCA", "D1" },
    std::array<const char*, 4>{ "marginal", "workhorse-long-j", "LCA", "OM1" },
    std::array<const char*, 4>{ "rca-pda", "workhorse", "RCA", "R-PDA" }));

TEST(Intervention, RepeatsBitForBit)
{
  std::uint64_t hashes[2];
  for (std::uint64_t& hash : hashes)
  {
    Intervention intervention(
      Phantom(), Wire("polymer-jacket"), Catheter("EBU3.5-6F"), SettingsFor("LCA"));
    DriveInput input;
    for (int k = 0; k < 2000; ++k)
    {
      input.wirePosition += 30.0 / 2000.0;
      input.wireAngle += 3.0 / 2000.0;
      intervention.Step(input);
    }
    hash = intervention.StateHash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(Intervention, ClampsWhatNoHandCanDo)
{
  Intervention intervention(
    Phantom(), Wire("workhorse"), Catheter("EBU3.5-6F"), SettingsFor("LCA"));
  DriveInput input;
  std::string said;
  const auto drive = [&](int ticks, double speed)
  {
    for (int k = 0; k < ticks; ++k)
    {
      input.wirePosition += speed / 2000.0;
      intervention.Step(input);
      for (const std::string& message : intervention.TakeMessages())
      {
        said += message + "\n";
      }
    }
  };
  drive(20, 1e5); // 100 m/s
  EXPECT_NE(std::string::npos, said.find("faster than hands can")) << said;
  EXPECT_LT(intervention.Report().inserted, 300.0 * 20 / 2000.0 + 1.0);
  said.clear();
  input.wirePosition = std::numeric_limits<double>::quiet_NaN();
  intervention.Step(input);
  for (const std::string& message : intervention.TakeMessages())
  {
    said += message;
  }
  EXPECT_NE(std::string::npos, said.find("not finite")) << said;
  // It goes on from there, and can be drawn back as far as it goes.
  said.clear();
  input.wirePosition = 0.0;
  drive(10, 0.0);
  drive(1000, -100.0);
  EXPECT_NE(std::string::npos, said.find("drawn back to the end")) << said;
  for (const Vector3& point : intervention.Centerline())
  {
    EXPECT_TRUE(point.allFinite());
  }
  EXPECT_EQ(0.0, intervention.Report().inserted);
}

TEST(Intervention, ClampsTheWiresSimulatedLength)
{
  InterventionSettings settings = SettingsFor("LCA");
  settings.capacity = 30;
  Intervention intervention(Phantom(), Wire("workhorse"), Catheter("EBU3.5-6F"), settings);
  DriveInput input;
  std::string said;
  for (int k = 0; k < 2000; ++k)
  {
    input.wirePosition += 60.0 / 2000.0;
    intervention.Step(input);
    for (const std::string& message : intervention.TakeMessages())
    {
      said += message;
    }
  }
  EXPECT_NE(std::string::npos, said.find("no more of the wire")) << said;
  EXPECT_LE(intervention.NumberOfSegments(), 30);
}

TEST(Intervention, RefusesWhatDoesNotFit)
{
  GuideCatheter thick = Catheter("EBU3.5-6F");
  thick.outerRadius = 3.5;
  EXPECT_NE(
    std::string::npos, WhyRefused(Wire("workhorse"), thick, SettingsFor("LCA")).find("lumen"));
  Guidewire wire = Wire("workhorse");
  wire.sections[2].radius = 1.0;
  EXPECT_NE(std::string::npos,
    WhyRefused(wire, Catheter("EBU3.5-6F"), SettingsFor("LCA")).find("inside of the catheter"));
  wire = Wire("workhorse");
  wire.sections[1].bendingStiffness1 = -1.0;
  EXPECT_FALSE(WhyRefused(wire, Catheter("EBU3.5-6F"), SettingsFor("LCA")).empty());
  InterventionSettings settings = SettingsFor("LCA");
  settings.segmentLength = 0.0;
  EXPECT_NE(std::string::npos,
    WhyRefused(Wire("workhorse"), Catheter("EBU3.5-6F"), settings).find("segmentLength"));
  settings = SettingsFor("LCA");
  settings.rootBranch = 1000;
  EXPECT_NE(
    std::string::npos, WhyRefused(Wire("workhorse"), Catheter("EBU3.5-6F"), settings).find("1000"));
}

TEST(Intervention, StandsStillWithTheHeart)
{
  Intervention intervention(
    Phantom(), Wire("workhorse"), Catheter("EBU3.5-6F"), SettingsFor("LCA"));
  DriveInput input;
  for (int k = 0; k < 3000; ++k)
  {
    input.wirePosition += 15.0 / 2000.0;
    intervention.Step(input);
  }
  intervention.SetHeartRate(0.0);
  for (int k = 0; k < 2000; ++k)
  {
    intervention.Step(input);
  }
  const Vector3 before = intervention.Centerline().front();
  for (int k = 0; k < 500; ++k)
  {
    intervention.Step(input);
  }
  EXPECT_LT((intervention.Centerline().front() - before).norm(), 0.01);
}

TEST(FixedStepClock, FollowsRealTimeAndGivesUpWhatIsLost)
{
  FixedStepClock clock(2000.0, 0.004);
  EXPECT_EQ(0, clock.Due(10.0));
  EXPECT_EQ(2, clock.Due(10.00105));
  EXPECT_EQ(0, clock.Due(10.00110));
  EXPECT_EQ(8, clock.Due(10.10005)); // 4 ms and no more
  EXPECT_EQ(1, clock.Overruns());
  EXPECT_NEAR(0.0949, clock.LostSeconds(), 1e-3);
  EXPECT_EQ(2, clock.Due(10.10105)); // on from there
  EXPECT_EQ(0, clock.Due(9.0));
  EXPECT_EQ(12, clock.Steps());
  EXPECT_THROW(FixedStepClock(0.0), std::invalid_argument);
  EXPECT_THROW(FixedStepClock(100.0, -1.0), std::invalid_argument);
}
}
