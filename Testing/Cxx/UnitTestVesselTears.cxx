// Walls that tear: thresholds, flaps, holes in the flow network, the pericardium, and what a session makes of them.
#include "BalloonTestBench.h"
#include "ContrastTestData.h"
#include "Numbers.h"
#include "Refusals.h"
#include "SessionRunner.h"
#include "VesselTears.h"
#include "WallTestMeshes.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace UnitTestVesselTears
{
using namespace coronary;

namespace
{
constexpr double Step = 0.005; // s

const Guidewire& Wire(const char* name)
{
  return BuiltInCatalogue().Wire(name).wire;
}

/// A flow that has settled in a heart that stands still.
void Settle(CoronaryFlow& flow)
{
  for (int k = 0; k < 4000; ++k)
  {
    flow.Step(Step, 0.5, 0.0);
  }
}
}

TEST(WallStrength, StretchOfWhatIsFreeOfCalcium)
{
  EXPECT_EQ(FreeStretch(1.2, 0.0), 1.2);
  EXPECT_NEAR(FreeStretch(1.2, 0.25), 1.0 + 0.2 / 0.75, 1e-15);
  EXPECT_NEAR(FreeStretch(1.2, 1.0), 1.4, 1e-15) << "half of the circle at most";
  EXPECT_EQ(FreeStretch(0.9, 0.5), 0.9);
  EXPECT_EQ(FlapOf(1.3), 0.0);
  EXPECT_NEAR(FlapOf(1.3 + 1e-12), 0.2, 1e-9);
  EXPECT_NEAR(FlapOf(1.35), 0.35, 1e-12);
  EXPECT_EQ(FlapOf(2.0), 0.7);
  EXPECT_EQ(HoleOf(1.35), 0.0);
  EXPECT_NEAR(HoleOf(1.375), 1.0, 1e-12);
  EXPECT_EQ(HoleOf(2.0), 2.5);
}

TEST(WallStrength, PunctureAndHoles)
{
  EXPECT_NEAR(PunctureForce(Wire("cto-9gf")), 2.0 * Pi * 0.1145 * 0.1145, 1e-12);
  EXPECT_NEAR(PunctureForce(Wire("workhorse")), 2.0 * Pi * 0.178 * 0.178, 1e-12);
  // 9 gf, 0.8 gf
  EXPECT_LT(PunctureForce(Wire("cto-9gf")), 0.0883);
  EXPECT_GT(PunctureForce(Wire("workhorse")), 20.0 * 0.00785);
  // 0.6 A sqrt(2 dp / rho) at 80 mmHg through a millimetre.
  const double flow = 0.6 * 0.25 * Pi * std::sqrt(2.0 * 80.0 * 133.322387415 / 1060.0);
  EXPECT_NEAR(80.0 * HoleConductance(1.0), flow, 1e-12);
  EXPECT_NEAR(HoleConductance(2.0), 4.0 * HoleConductance(1.0), 1e-12);
}

TEST(Pericardium, FollowsItsCurve)
{
  Pericardium sac;
  EXPECT_EQ(sac.Pressure(), 0.0);
  EXPECT_EQ(sac.StrokeFactor(), 1.0);
  EXPECT_EQ(sac.PressureFactor(), 1.0);
  for (const double pressure : { 3.0, 20.0 })
  {
    sac.Fill(100.0);
    EXPECT_NEAR(sac.Pressure(), 9.0 / 14.0 * std::expm1(sac.Volume() / 57.65), 1e-12);
    EXPECT_NEAR(sac.Pressure(), pressure, 1e-3 * pressure);
    EXPECT_NEAR(sac.StrokeFactor(), 1.0 / (1.0 + sac.Pressure() / 8.0), 1e-15);
    EXPECT_NEAR(sac.PressureFactor(), std::sqrt(sac.StrokeFactor()), 1e-15);
  }
}

// Two resistances and a hole between them: (Pa - P) / R1 = (P - Pv) / R2 + g (P - Po).
TEST(HoleInTheFlow, IsConductanceTimesPressureDifference)
{
  const WallTopology tube = coronary::Tube(80.0, 1.5, 1.5, 160);
  CoronaryFlow whole(tube, {});
  CoronaryFlow flow(tube, {});
  const int node = flow.OpenHole({ 0, 30.0 });
  ASSERT_EQ(flow.Network().Segments().size(), 2U);
  EXPECT_NEAR(flow.Network().Segments()[0].to, 30.0, 1e-12);
  EXPECT_NEAR(flow.SegmentResistance(0) + flow.SegmentResistance(1), whole.SegmentResistance(0),
    1e-12 * whole.SegmentResistance(0));
  Settle(whole);
  Settle(flow);
  EXPECT_NEAR(flow.TreeFlow(0), whole.TreeFlow(0), 1e-10) << "a closed hole is none";
  EXPECT_NEAR(flow.PressureAt({ 0, 60.0 }), whole.PressureAt({ 0, 60.0 }), 1e-9);
  EXPECT_EQ(flow.LeakFlow(node), 0.0);
  const double conductance = HoleConductance(1.0);
  const double outside = 7.0;
  flow.SetHole(node, conductance, outside);
  Settle(flow);
  const double pressure = flow.Pressure()[static_cast<std::size_t>(node)];
  EXPECT_NEAR(flow.LeakFlow(node), conductance * (pressure - outside), 1e-9);
  EXPECT_NEAR(flow.Flow()[0] - flow.Flow()[1], flow.LeakFlow(node), 1e-12);
  const double before = 1.0 / flow.SegmentResistance(0);
  const double behind = 1.0 / (flow.SegmentResistance(1) + flow.OutletResistance(1));
  const double expected =
    (before * flow.AorticPressureNow() + behind * 5.0 + conductance * outside) /
    (before + behind + conductance);
  EXPECT_NEAR(pressure, expected, 1e-9 * expected);
  Print(
    "leak through a hole of 1 mm, mL/s", conductance * (expected - outside), flow.LeakFlow(node));
  // Nothing comes in from outside.
  flow.SetHole(node, conductance, 200.0);
  Settle(flow);
  EXPECT_EQ(flow.LeakFlow(node), 0.0);
  EXPECT_NEAR(flow.TreeFlow(0), whole.TreeFlow(0), 1e-10);
  // A weaker heart.
  flow.SetPressureFactor(0.5);
  Settle(flow);
  EXPECT_NEAR(flow.AorticPressureNow(), 0.5 * whole.AorticPressureNow(), 1e-12);
  ExpectRefusal([&] { flow.SetHole(node, -1.0, 0.0); }, "conductance of a hole");
  ExpectRefusal([&] { flow.SetHole(node, 0.1, std::nan("")); }, "outside of a hole");
  ExpectRefusal([&] { flow.SetHole(0, 0.1, 0.0); }, "node of a hole");
  ExpectRefusal([&] { flow.SetPressureFactor(1.5); }, "factor of the pressures");
  ExpectRefusal([&] { flow.OpenHole({ 3, 1.0 }); }, "3");
}

// The beating tree, with branches behind the hole: every node balances.
TEST(HoleInTheFlow, EverythingBalancesInATree)
{
  const WallTopology tree = PhantomVessels({});
  CoronaryFlow flow(tree, {});
  const std::size_t segments = flow.Network().Segments().size();
  std::vector<int> holes;
  for (const int branch : { 2, 0, 2 })
  {
    const FlowBranch& along = flow.Network().Branches()[branch];
    holes.push_back(flow.OpenHole({ branch, (0.3 + 0.1 * holes.size()) * along.abscissa.back() }));
    flow.SetHole(holes.back(), 0.01, 3.0);
  }
  const FlowNetwork& network = flow.Network();
  ASSERT_EQ(network.Segments().size(), segments + 3);
  for (std::size_t b = 0; b < network.Branches().size(); ++b)
  {
    double volume = 0.0;
    double end = 0.0;
    for (const int s : network.Branches()[b].segments)
    {
      const FlowSegment& segment = network.Segments()[s];
      EXPECT_EQ(segment.branch, static_cast<int>(b));
      EXPECT_EQ(segment.from, end);
      EXPECT_EQ(network.Nodes()[segment.below].above, s);
      EXPECT_TRUE(segment.above == network.Roots()[0] || segment.above == network.Roots()[1] ||
        network.Nodes()[segment.above].above < s);
      end = segment.to;
      volume += segment.volume;
    }
    EXPECT_NEAR(volume, network.Branches()[b].volume.back(), 1e-12);
  }
  double worst = 0.0;
  double law = 0.0;
  for (int k = 0; k < 400; ++k)
  {
    flow.Step(Step, k * Step / 0.8, 75.0, k > 200 ? 3.0 : 0.0, { 0, 2.0 });
    for (std::size_t n = 0; n < network.Nodes().size(); ++n)
    {
      const FlowNode& node = network.Nodes()[n];
      if (node.above < 0 || node.below.empty())
      {
        continue;
      }
      double rest = flow.Flow()[node.above] - flow.LeakFlow(static_cast<int>(n));
      for (const int s : node.below)
      {
        rest -= flow.FlowAtBeginning(s);
      }
      worst = std::max(worst, std::abs(rest));
    }
    for (const int hole : holes)
    {
      law = std::max(
        law, std::abs(flow.LeakFlow(hole) - std::max(0.0, 0.01 * (flow.Pressure()[hole] - 3.0))));
    }
  }
  EXPECT_LT(worst, 1e-12);
  EXPECT_LT(law, 1e-9);
}

// Contrast medium goes with the blood: what leaked, stained, flowed off and is still there is what was injected.
TEST(HoleInTheFlow, MediumLeaksWithTheBloodAndNoneIsLost)
{
  const WallTopology fork = Fork(1.5, 1.2);
  ContrastModel model(fork, {}, 7);
  const auto inject = [&](double seconds, double flow, double share)
  {
    for (int k = 0; k < seconds / Step; ++k)
    {
      model.Step(Step, 0.6, 0.0, flow, { 0, 3.0 }, share);
    }
  };
  inject(2.0, 0.3, 1.0);
  const std::vector<double> before = model.Concentration();
  const int node = model.OpenHole({ 1, 20.0 });
  const std::vector<double> after = model.Concentration();
  inject(Step, 0.0, 1.0);
  EXPECT_EQ(before, after) << "a hole alone moves nothing";
  model.SetHole(node, 0.01, 0.0);
  inject(6.0, 0.3, 1.0); // until it is steady
  const double leakedBefore = model.Leaked(node);
  inject(4.0, 0.3, 1.0);
  const double medium = (model.Leaked(node) - leakedBefore) / 4.0;
  const double diluted = 0.3 / model.FlowModel().Flow()[0];
  EXPECT_NEAR(medium, diluted * model.LeakFlow(node), 0.03 * medium);
  Print("medium that leaks, mL/s", diluted * model.LeakFlow(node), medium);
  const double stain = model.Absorb(2, 10.0, 20.0, 0.1);
  EXPECT_GT(stain, 0.0);
  EXPECT_EQ(model.Absorb(2, 10.0, 20.0, 0.0), 0.0);
  model.SetHole(node, 0.0, 0.0);
  const double closed = model.Leaked(node);
  inject(8.0, 0.0, 1.0);
  EXPECT_EQ(model.Leaked(node), closed);
  const ContrastBalance balance = model.Balance();
  EXPECT_EQ(balance.leaked, closed);
  EXPECT_EQ(balance.inWall, stain);
  EXPECT_LT(balance.inTree, 0.01 * balance.injected);
  const double sum = balance.inTree + balance.blush + balance.washedOut + balance.spilled +
    balance.leaked + balance.inWall;
  EXPECT_NEAR(sum, balance.injected, 1e-12 * balance.injected);
}

namespace
{
/// A straight vessel in a session, with a balloon that is too large.
struct TornTube
{
  explicit TornTube(bool tears = true, const char* wire = "workhorse", double radius = 1.15)
    : Session(MakeWall(radius), MakeScenario(tears, wire))
  {
    this->Input = this->Session.StartInput();
  }
  static std::shared_ptr<WallMotion> MakeWall(double radius)
  {
    WallTopology topology;
    std::vector<Vector3> points;
    AppendTube(topology, points, 0.0, radius, 100.0, 24, 200);
    topology.groupName = { "LAD" };
    return std::make_shared<StillWallMotion>(topology, points);
  }
  static Scenario MakeScenario(bool tears, const char* wire)
  {
    Scenario scenario = LoadScenario("lad-perforation");
    scenario.artery = "any";
    scenario.procedure.clear();
    scenario.lesions.clear();
    scenario.wire = Wire(wire);
    scenario.catheter = BuiltInCatalogue().Catheter("JR4-5F").catheter;
    scenario.exchanges = { BuiltInCatalogue().Balloon("stent-3.0x23").balloon };
    scenario.settings.heartRate = 0.0;
    scenario.settings.wallTears = tears;
    scenario.settings.sealTime = 4.0;
    return scenario;
  }
  void Run(double seconds, double wire = 0.0, double balloon = 0.0, double pressure = -2.0)
  {
    const int ticks = static_cast<int>(std::lround(seconds * 2000.0));
    for (int tick = 0; tick < ticks; ++tick)
    {
      this->Input.drive.wirePosition += wire / ticks;
      this->Input.drive.balloonPosition += balloon / ticks;
      this->Input.drive.inflation = pressure > -2.0 ? pressure : this->Input.drive.inflation;
      const TickReport& report = this->Session.Step(this->Input).tick;
      this->Thrust = std::max(this->Thrust, report.tipThrust);
    }
    for (const std::string& text : this->Session.TakeMessages())
    {
      this->Said += text + "\n";
    }
  }
  std::ptrdiff_t Count(ProcedureEvent::Kind kind) const
  {
    const std::vector<ProcedureEvent>& events = this->Session.Metrics().events;
    return std::count_if(events.begin(), events.end(),
      [kind](const ProcedureEvent& event) { return event.kind == kind; });
  }
  TrainingSession Session;
  SessionInput Input;
  double Thrust = 0.0;
  std::string Said;
};
}

TEST(VesselTears, ABalloonThatIsTooLargeAndWhatStopsTheLeak)
{
  TornTube tube;
  tube.Run(1.0, 70.0);
  tube.Run(1.0, 0.0, 55.0);
  tube.Run(2.5, 0.0, 0.0, 14.0);
  using Kind = ProcedureEvent::Kind;
  ASSERT_EQ(tube.Count(Kind::Dissection), 1) << tube.Session.Report().tick.balloon.stretch;
  ASSERT_EQ(tube.Count(Kind::Perforation), 1) << tube.Session.Report().tick.balloon.stretch;
  const auto hole = [&]() -> const VesselTear&
  {
    return *std::find_if(tube.Session.Tears().begin(), tube.Session.Tears().end(),
      [](const VesselTear& tear) { return tear.kind == VesselTear::Kind::Perforation; });
  };
  EXPECT_TRUE(hole().covered);
  EXPECT_EQ(hole().blood, 0.0) << "the balloon that tore it is in it";
  EXPECT_EQ(hole().Ellis(), 1);
  EXPECT_EQ(hole().vessel, "LAD");
  EXPECT_NEAR(hole().place, tube.Session.Report().tick.balloon.stretchedPlace, 12.0);
  EXPECT_NEAR(hole().diameter, HoleOf(hole().stretch), 1e-12);
  tube.Run(1.5, 0.0, 0.0, -0.9);
  const double closed = hole().closed;
  EXPECT_GT(closed, 0.0);
  ASSERT_FALSE(hole().covered);
  tube.Run(1.0);
  EXPECT_EQ(hole().closed, closed);
  const double pressure =
    tube.Session.Contrast().FlowModel().Pressure()[static_cast<std::size_t>(hole().node)];
  const double outside = tube.Session.Metrics().pericardialPressure;
  EXPECT_NEAR(hole().flow, (1.0 - closed) * HoleConductance(hole().diameter) * (pressure - outside),
    0.02 * hole().flow);
  EXPECT_NEAR(tube.Session.Metrics().pericardialBlood, hole().blood, 1e-12);
  const double lost = hole().blood;
  EXPECT_GT(lost, 0.5);
  // The flap narrows what blood has, not the wall.
  std::vector<double> lumen(201, 1.15);
  const VesselTear& flap = tube.Session.Tears()[0];
  ASSERT_EQ(flap.kind, VesselTear::Kind::Dissection);
  EXPECT_NEAR(flap.flap, FlapOf(flap.stretch), 1e-12);
  SessionSnapshot snapshot;
  tube.Session.SnapshotOfImage(snapshot);
  EXPECT_NEAR(snapshot.lumen[flap.point],
    (1.0 - flap.flap) * tube.Session.Instruments().Dilated()->Radii()[flap.point], 1e-12);
  EXPECT_EQ(snapshot.tears.size(), 2U);
  // A few atmospheres are enough to be across it.
  tube.Run(1.5, 0.0, 0.0, 3.0);
  EXPECT_TRUE(hole().covered);
  const double stopped = hole().blood;
  tube.Run(1.5);
  EXPECT_EQ(hole().blood, stopped);
  tube.Run(2.0);
  EXPECT_TRUE(hole().sealed) << hole().closed;
  EXPECT_EQ(tube.Session.Metrics().openHoles, 0);
  tube.Run(1.5, 0.0, 0.0, -0.9);
  tube.Run(1.0);
  EXPECT_FALSE(hole().covered);
  EXPECT_EQ(hole().flow, 0.0);
  EXPECT_EQ(hole().blood, stopped);
  for (const char* words : { "The wall is dissected: the balloon 'semi-compliant-3.5x20'",
         "The wall is perforated: the balloon 'semi-compliant-3.5x20'", "It is in LAD,",
         "The balloon across the hole stops the leak.", "The hole in the wall has closed." })
  {
    EXPECT_NE(tube.Said.find(words), std::string::npos) << words << "\n" << tube.Said;
  }
  // A stent holds the flap.
  EXPECT_FALSE(tube.Session.Tears()[0].sealed);
  tube.Run(1.0, 0.0, -55.0);
  ASSERT_TRUE(tube.Session.Apply({ RecordedEvent::Exchange, 1.0 }));
  tube.Run(1.0, 0.0, 57.0);
  tube.Run(2.0, 0.0, 0.0, 6.0);
  tube.Run(1.5, 0.0, 0.0, -0.9);
  EXPECT_TRUE(tube.Session.Tears()[0].sealed);
  tube.Session.SnapshotOfImage(snapshot);
  EXPECT_NEAR(
    snapshot.lumen[flap.point], tube.Session.Instruments().Dilated()->Radii()[flap.point], 1e-12);
}

// Left open, a great hole fills the pericardium: the heart ejects less, and the procedure has failed.
TEST(VesselTears, ALeakThatIsLeftEndsInTamponade)
{
  TornTube tube(true, "workhorse", 1.0);
  tube.Run(1.0, 70.0);
  tube.Run(1.0, 0.0, 55.0);
  tube.Run(2.0, 0.0, 0.0, 14.0);
  tube.Run(1.5, 0.0, 0.0, -0.9);
  tube.Run(0.5, 0.0, -30.0);
  const double before = tube.Session.Contrast().AorticPressure(); // the heart stands still
  const SessionMetrics& metrics = tube.Session.Metrics();
  double last = metrics.pericardialBlood;
  double flow = 0.0; // mL/s, at the beginning
  while (metrics.pericardialPressure < 12.0)
  {
    tube.Run(1.0);
    flow = flow == 0.0 ? metrics.pericardialBlood - last : flow;
    ASSERT_GT(metrics.pericardialBlood, last + 0.5) << "it goes on";
    last = metrics.pericardialBlood;
  }
  Pericardium sac;
  sac.Fill(metrics.pericardialBlood);
  EXPECT_EQ(metrics.pericardialPressure, sac.Pressure());
  EXPECT_EQ(metrics.strokeShare, sac.StrokeFactor());
  EXPECT_NEAR(
    tube.Session.Contrast().AorticPressure(), before * sac.PressureFactor(), 1e-2 * before);
  EXPECT_EQ(tube.Count(ProcedureEvent::Kind::Tamponade), 1);
  EXPECT_NE(tube.Said.find("Tamponade: 16"), std::string::npos) << tube.Said;
  const ProcedureScore score = tube.Session.Score();
  EXPECT_FALSE(score.passed);
  for (const char* failure :
    { "a vessel was perforated", "a perforation is left open", "the heart was tamponaded" })
  {
    EXPECT_NE(
      std::find(score.failures.begin(), score.failures.end(), failure), score.failures.end())
      << failure;
  }
  std::printf(
    "leak %.2f mL/s, %.0f mL, %.1f mmHg, stroke volume %.0f %%, aorta %.0f of %.0f mmHg\n", flow,
    metrics.pericardialBlood, metrics.pericardialPressure, 100.0 * metrics.strokeShare,
    tube.Session.Contrast().AorticPressure(), before);
}

TEST(VesselTears, OffNothingTearsAndBitsRepeat)
{
  const auto run = [](bool tears, double pressure)
  {
    TornTube tube(tears);
    tube.Run(1.0, 70.0);
    tube.Run(1.0, 0.0, 55.0);
    tube.Run(1.5, 0.0, 0.0, pressure);
    return std::make_pair(tube.Session.StateHash(), tube.Session.Tears().size());
  };
  const auto on = run(true, 14.0);
  EXPECT_EQ(on.second, 2U);
  EXPECT_EQ(run(true, 14.0), on);
  const auto off = run(false, 14.0);
  EXPECT_EQ(off.second, 0U);
  EXPECT_NE(off.first, on.first);
  EXPECT_EQ(run(true, 4.0), run(false, 4.0)) << "where nothing tears they are the same";
}

// Pushed on by the same way into the vessel's blind end: the stiff wire goes through, the workhorse gives way.
TEST(VesselTears, AStiffWireGoesThroughTheWallAndAWorkhorseGivesWay)
{
  for (const char* wire : { "cto-9gf", "workhorse" })
  {
    const bool stiff = std::string(wire) == "cto-9gf";
    TornTube tube(true, wire, 1.5);
    tube.Run(1.9, 95.0);
    EXPECT_TRUE(tube.Session.Tears().empty()) << tube.Said;
    tube.Run(1.5, 6.0);
    std::printf("%s: %.3f N on the wall, %.3f N go through it\n", wire, tube.Thrust,
      PunctureForce(Wire(wire)));
    ASSERT_EQ(tube.Session.Tears().size(), stiff ? 1U : 0U) << tube.Said;
    if (stiff)
    {
      const VesselTear& hole = tube.Session.Tears()[0];
      EXPECT_EQ(hole.stretch, 0.0);
      EXPECT_NEAR(hole.diameter, 0.229, 1e-12);
      EXPECT_GT(hole.place, 95.0);
      EXPECT_NE(tube.Said.find("perforated by the tip of the wire 'cto-9gf'"), std::string::npos);
      tube.Run(1.0);
      EXPECT_GT(hole.flow, 0.0);
      EXPECT_EQ(hole.Ellis(), hole.blood < 0.1 ? 1 : 2);
    }
    else
    {
      // Backed up by the vessel, and pushed hard, it goes through as well.
      EXPECT_GT(tube.Thrust, 0.02) << "it did press";
      tube.Run(0.5, 2.0);
      EXPECT_EQ(tube.Session.Tears().size(), 1U);
    }
  }
}

TEST(VesselTears, ASpikeOfATickIsNoHole)
{
  const WallTopology tube = coronary::Tube(80.0, 1.5, 1.5, 160);
  const CoronaryFlow flow(tube, {});
  VesselTears tears(flow.Network(), 300.0);
  for (int tick = 0; tick < 10000; ++tick)
  {
    tears.Press(tick % 90 == 0 ? 0.0 : 1.0, 0.2, 0.0005); // 44.5 ms at a time
  }
  EXPECT_FALSE(tears.TipIsThrough());
  for (int tick = 0; tick < 101; ++tick)
  {
    tears.Press(0.21, 0.2, 0.0005);
  }
  EXPECT_TRUE(tears.TipIsThrough());
}

TEST(VesselTears, InScenariosAndRecordings)
{
  const Scenario scenario = LoadScenario("lad-perforation");
  EXPECT_TRUE(scenario.settings.wallTears);
  EXPECT_EQ(scenario.settings.sealTime, 20.0);
  EXPECT_EQ(InterventionSettings().sealTime, 300.0);
  EXPECT_TRUE(RecordedScenario(ScenarioText(scenario), "r").settings.wallTears);
  nlohmann::json text = nlohmann::json::parse(ScenarioText(scenario));
  text["settings"].erase("wall_tears");
  EXPECT_FALSE(RecordedScenario(text.dump(), "r").settings.wallTears) << "of before its time";
  EXPECT_TRUE(ScenarioFromText(text.dump(), "s.json", ".").settings.wallTears);
  const auto refused = [&](const char* key, const nlohmann::json& value)
  {
    nlohmann::json bad = text;
    bad["settings"][key] = value;
    ExpectRefusal([&] { ScenarioFromText(bad.dump(), "s.json", "."); }, "s.json", key);
  };
  refused("wall_tears", "yes");
  refused("perforation_seal_s", 0.0);
  refused("perforation_seal_s", 1e5);
}

// Recorded hands: a balloon bursts the vessel, medium comes out, the balloon across the hole stops it until it has closed.
TEST(Perforation, TheRecordedOneRepeatsToTheBit)
{
  auto source = std::make_unique<ReplaySource>(
    std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/lad-perforation.pcirec");
  const ReplaySource* replay = source.get();
  const Scenario scenario = RecordedScenario(source->Reader().Header().scenario, "The recording");
  const auto wall = std::make_shared<NarrowedWallMotion>(
    MakePhantomWallMotion(scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 40),
    scenario.lesions);
  const std::uint64_t hash = WallHash(*wall);
  ASSERT_EQ(hash, source->Reader().Header().meshHash);
  SessionRunner runner(wall, scenario, hash, std::move(source));
  const TrainingSession& session = runner.Session();
  double most = 0.0; // mL/s
  double balance = 0.0;
  runner.afterTick = [&](const SessionReport&)
  {
    for (const VesselTear& tear : session.Tears())
    {
      most = std::max(most, tear.flow);
    }
  };
  while (runner.Run(1000))
  {
    const ContrastBalance medium = session.Balance();
    const double sum = medium.inGuide + medium.inTree + medium.blush + medium.washedOut +
      medium.spilled + medium.leaked + medium.inWall;
    balance = std::max(balance, std::abs(sum - medium.injected));
  }
  EXPECT_EQ(replay->Reader().HowEnded(), RecordingReader::Ending::Complete);
  EXPECT_GT(runner.Compared().compared, 50U);
  EXPECT_EQ(runner.Compared().equal, runner.Compared().compared)
    << "from tick " << runner.Compared().firstDifference;
  EXPECT_LT(balance, 1e-11);
  EXPECT_GT(most, 0.5);
  const VesselTear& hole = *std::find_if(session.Tears().begin(), session.Tears().end(),
    [](const VesselTear& tear) { return tear.kind == VesselTear::Kind::Perforation; });
  EXPECT_TRUE(hole.sealed);
  EXPECT_GT(hole.beside + hole.spread, 0.05) << "medium that stays";
  EXPECT_GT(session.Balance().inWall, 0.0);
  EXPECT_GT(session.Metrics().pericardialBlood, 5.0);
  EXPECT_EQ(session.Procedure().reached.size(), scenario.procedure.size());
  const ProcedureScore score = session.Score();
  EXPECT_TRUE(score.passed) << (score.failures.empty() ? "" : score.failures[0]);
}
}
