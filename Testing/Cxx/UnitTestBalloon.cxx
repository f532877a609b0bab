// A balloon on a wire against its table, walls that yield against their law, and what flows through narrowings.
#include "BalloonTestBench.h"
#include "ContrastModel.h"
#include "SessionRunner.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace UnitTestBalloon
{
using namespace coronary;

namespace
{
constexpr double Frame = 33.0 / 2000.0; // s
constexpr double MmHg = 133.322387415;

double Opening(const WallStation& station, double radius)
{
  return (radius - station.rest) / station.reference;
}
}

TEST(Balloon, HasTheDiameterOfItsTable)
{
  for (const CatalogueBalloon& one : BuiltInCatalogue().balloons)
  {
    if (one.balloon.stent)
    {
      continue; // UnitTestStent
    }
    Bench bench(one.balloon.name, Tube(5.0, 0.0, 0.0, 0.0));
    for (const ComplianceRow& row : one.balloon.compliance)
    {
      EXPECT_NEAR(2.0 * one.balloon.FreeRadius(row.pressure), row.diameter, 1e-12);
      const BalloonReport& report = bench.Hold(row.pressure, 90.0);
      EXPECT_NEAR(report.pressure, row.pressure, 1e-4);
      EXPECT_NEAR(report.greatest, row.diameter, 1e-5) << one.balloon.name;
      EXPECT_NEAR(report.least, row.diameter, 1e-5);
      EXPECT_EQ(report.grip, 0.0) << "it touches nothing";
    }
    const BalloonReport& report = bench.Hold(-0.9, 15.0);
    EXPECT_DOUBLE_EQ(report.greatest, 2.0 * one.balloon.crossingRadius);
    // Within the guide it is as wide as that.
    Bench inside(one.balloon.name, Tube(5.0, 0.0, 0.0, 0.0));
    const double lumen = 2.0 * BuiltInCatalogue().Catheter("EBU3.5-6F").catheter.innerRadius;
    EXPECT_NEAR(inside.Hold(8.0, 60.0, -40.0).greatest, lumen, 1e-9);
  }
}

TEST(Balloon, IsAtBalanceWithTheLesionAndTheResidueIsThatOfTheLaw)
{
  const DilationSettings law;
  Bench bench("semi-compliant-3.0x15", Tube(1.5, 0.7, 30.0, 50.0));
  const WallStation before = bench.Wall.Stations()[80];
  const double k = law.plaqueStiffness;
  const double h = k * law.elasticShare / (1.0 - law.elasticShare);
  ASSERT_DOUBLE_EQ(before.stiffness, k);

  // Both are straight lines there: R = a + b q of the balloon at q = p - p_w, p_w = k (H g + yield) / (k + H).
  const double p = 7.0;
  const ComplianceRow row = bench.Balloon.compliance.front(); // folds are open up to it
  const double a = bench.Balloon.crossingRadius;
  const double b = (0.5 * row.diameter - a) / row.pressure;
  const double c = b * k / (k + h);
  const double radius =
    (a + b * p + c * (h * before.rest / 1.5 - law.plaqueYield)) / (1.0 + c * h / 1.5);
  const BalloonReport held = bench.Hold(p, 30.0);
  EXPECT_NEAR(held.least, 2.0 * radius, 1e-5);
  Print("balloon in a lesion of 70 %, 7 atm: mm", 2.0 * radius, held.least);

  // (1 - r) of the opening beyond yield stays.
  const double opening = Opening(before, radius);
  const double stays = (1.0 - law.elasticShare) * (opening - law.plaqueYield / k);
  bench.Hold(-0.9, 15.0);
  bench.Hold(0.0, 1.0);
  const double residue = bench.Wall.Radii()[80];
  EXPECT_NEAR(bench.Wall.Stations()[80].plastic, stays, 1e-5);
  EXPECT_NEAR(residue, before.rest + 1.5 * stays, 1e-4);
  Print("lumen after it, mm", 2.0 * (before.rest + 1.5 * stays), 2.0 * residue);
  const double plastic = bench.Wall.Stations()[80].plastic;
  bench.Hold(p, 30.0);
  EXPECT_NEAR(bench.Wall.Stations()[80].plastic, plastic, 1e-6) << "a second inflation adds none";
  // What is beside the lesion is as it was.
  EXPECT_DOUBLE_EQ(bench.Wall.Radii()[20], 1.5);
}

TEST(Balloon, TheLawAloneIsExact)
{
  const DilationSettings law;
  WallStation station = MakeWallStation(0.45, 1.5, 0.0, law);
  const double top = 0.45 + 1.5 * 0.6;
  // Work of a cycle = what is dissipated: yield g_p + H g_p^2 / 2.
  double work = 0.0;
  constexpr int Steps = 200000;
  double last = 0.0;
  for (int n = 1; n <= Steps; ++n)
  {
    const double radius = 0.45 + (top - 0.45) * n / Steps;
    const double pressure = WallPressure(station, radius, law);
    station.plastic = PlasticOpening(station, radius);
    work += 0.5 * (last + pressure) * 0.6 / Steps;
    last = pressure;
  }
  const double stays = (1.0 - law.elasticShare) * (0.6 - law.plaqueYield / law.plaqueStiffness);
  EXPECT_NEAR(station.plastic, stays, 1e-12);
  const double back = last * last / (2.0 * station.stiffness); // elastic, given back
  const double lost = station.yield * stays + 0.5 * station.hardening * stays * stays;
  EXPECT_NEAR(work - back, lost, 1e-6 * lost);
  Print("work lost in opening a lesion, atm", lost, work - back);
  EXPECT_NEAR(NaturalRadius(station, law), 0.45 + 1.5 * stays, 1e-12);
  // Beyond its own calibre the vessel presses back: ln(1 + p / p0) = b (R / R0 - 1).
  const WallStation healthy = MakeWallStation(1.5, 1.5, 0.0, law);
  EXPECT_NEAR(WallPressure(healthy, 1.8, law), law.meanPressure * std::expm1(12.0 * 0.2), 1e-12);
  EXPECT_EQ(WallPressure(healthy, 1.4, law), 0.0);
}

// Laplace: the hoop stress p R / h of a thin tube over its modulus is the stretch: p = (E h / R) (D / D0 - 1). E h / R of a normal LAD is
// 0.16 MPa (Int J Cardiol 1986;13:27).
TEST(Balloon, AHealthyVesselIsAThinElasticTube)
{
  constexpr double atmosphere = 0.101325; // MPa
  constexpr double stretch = 1e-4;
  const DilationSettings law;
  for (const double radius : { 0.8, 1.5, 2.2 })
  {
    const WallStation healthy = MakeWallStation(radius, radius, 0.0, law);
    const double pressure = atmosphere * WallPressure(healthy, radius * (1.0 + stretch), law);
    EXPECT_NEAR(pressure, 0.16 * stretch, 0.005 * 0.16 * stretch);
    Print("thin elastic tube (Laplace): E h / R, MPa", 0.16, pressure / stretch);
    // What it gives is given back, along the same way.
    EXPECT_EQ(PlasticOpening(healthy, 1.2 * radius), 0.0);
  }
}

TEST(Balloon, CalciumYieldsLate)
{
  std::array<double, 2> soft{};
  std::array<double, 2> hard{};
  for (const bool high : { false, true })
  {
    const double pressure = high ? 22.0 : 10.0;
    Bench fibrous("non-compliant-3.0x12", Tube(1.5, 0.6, 30.0, 50.0));
    fibrous.Hold(pressure, 20.0);
    soft[high] = fibrous.Wall.Stations()[80].plastic;
    Bench ring("non-compliant-3.0x12", Tube(1.5, 0.6, 30.0, 50.0, 330.0));
    ring.Hold(pressure, 20.0);
    hard[high] = ring.Wall.Stations()[80].plastic;
  }
  EXPECT_GT(soft[0], 0.3);
  EXPECT_EQ(hard[0], 0.0) << "elastic at 10 atm";
  EXPECT_GT(hard[1], 0.02) << "it breaks at last";
  EXPECT_LT(hard[1], soft[1]);
}

TEST(Balloon, EmptiesThroughItsLumen)
{
  // t = integral of R dV / (p - suction), V of the balloon in air.
  Bench bench("semi-compliant-3.0x15", Tube(5.0, 0.0, 0.0, 0.0));
  bench.Hold(10.0, 20.0);
  const double full = bench.Sleeve.Volume();
  const auto volume = [&](double p)
  {
    double sum = 0.0;
    const double open = bench.Balloon.FreeRadius(p) - bench.Balloon.crossingRadius;
    for (double behind = 0.005; behind < bench.Balloon.Reach(); behind += 0.01)
    {
      const double folded = bench.Balloon.FoldedRadius(behind);
      const double radius = folded + open * bench.Balloon.Shape(behind);
      sum += 1e-3 * M_PI * 0.01 * (radius * radius - folded * folded);
    }
    return sum;
  };
  EXPECT_NEAR(full, volume(10.0), 0.01 * full);
  double expected = 0.0;
  const double last = 0.05; // atm
  for (int n = 0; n < 2000; ++n)
  {
    const double high = last + (10.0 - last) * (n + 1) / 2000.0;
    const double low = last + (10.0 - last) * n / 2000.0;
    expected +=
      bench.Balloon.inflationResistance * (volume(high) - volume(low)) / (0.5 * (high + low) + 0.9);
  }
  double seconds = 0.0;
  while (bench.Hold(-0.9, Frame, 40.0, Frame).pressure > last && seconds < 60.0)
  {
    seconds += Frame;
  }
  EXPECT_NEAR(seconds, expected, 0.01 * expected + Frame);
  Print("deflation from 10 atm with 0.9 atm of suction, s", expected, seconds);
}

namespace
{
/// A straight wire of one stiffness along -z from its tip, held at its end.
struct StraightWire
{
  explicit StraightWire(double stiffness)
    : Rod(60, Settings())
  {
    for (int i = 0; i < 60; ++i)
    {
      RodSegment segment = MakeRodSegment(1.0, 0.178, 8000.0);
      segment.drag = 1e-6;
      segment.rotationalDrag = 1e-6;
      this->Segments.push_back(segment);
      RodJoint joint;
      joint.angularStiffness = Vector3(stiffness, stiffness, stiffness);
      this->Joints.push_back(joint);
      this->Places.push_back(i + 0.5);
      this->Rod.Append(segment, joint, Vector3(0.0, 0.0, i + 0.5), Eigen::Quaterniond::Identity());
    }
    this->Rod.Prescribe(59, this->Rod.Position(59), this->Rod.Orientation(59));
  }
  static RodSettings Settings()
  {
    RodSettings settings;
    settings.iterations = 10;
    return settings;
  }
  /// Its tip is at u = 100.
  BalloonOnWire::Rail Rail() const
  {
    return { 100.0, 0.0, &this->Places, &this->Segments, &this->Joints };
  }
  CosseratRod Rod;
  std::vector<RodSegment> Segments;
  std::vector<RodJoint> Joints;
  std::vector<double> Places;
};
}

TEST(Balloon, StiffensTheWireWhereItIs)
{
  BalloonCatheter balloon = BuiltInCatalogue().Balloon("semi-compliant-3.0x15").balloon;
  balloon.tipStiffness = balloon.balloonStiffness = balloon.shaftStiffness = 12.0;
  const GuideCatheter guide = BuiltInCatalogue().Catheter("EBU3.5-6F").catheter;
  StraightWire wire(4.0);
  BalloonOnWire sleeve(balloon, guide, 80.25); // its tip is 19.75 mm behind the wire's
  const double load = 1e-6;
  for (int k = 0; k < 4000; ++k)
  {
    sleeve.Drive(0.0, 1.0, wire.Rail(), 1.0, wire.Rod);
    wire.Rod.SetForce(0, Vector3(load, 0.0, 0.0));
    wire.Rod.Step(0.01);
  }
  // From the load to where it is held: integral of s (s - s0) / EI at s0, the segment's middle.
  const double s0 = 0.5;
  const double part = std::pow(19.75 - s0, 3) / (3.0 * 4.0);
  const double rest = (std::pow(59.5 - s0, 3) - std::pow(19.75 - s0, 3)) / (3.0 * 16.0);
  const double deflection = wire.Rod.Position(0).x();
  EXPECT_NEAR(deflection, load * (part + rest), 0.01 * deflection);
  Print("cantilever with a sleeve, um", 1e3 * load * (part + rest), 1e3 * deflection);
}

TEST(Balloon, ItsEndPassesNodesEvenly)
{
  // Energy of a wire that is bent by hand, while the sleeve's tip passes three segments.
  const BalloonCatheter balloon = BuiltInCatalogue().Balloon("semi-compliant-3.0x15").balloon;
  StraightWire wire(4.0);
  for (int i = 0; i < 60; ++i)
  {
    const double angle = 0.02 * (59 - i);
    wire.Rod.Place(i, Vector3(50.0 * (1.0 - std::cos(angle)), 0.0, 60.0 - 50.0 * std::sin(angle)),
      Eigen::Quaterniond(Eigen::AngleAxisd(-angle, Vector3::UnitY())));
  }
  BalloonOnWire sleeve(balloon, BuiltInCatalogue().Catheter("EBU3.5-6F").catheter, 70.0);
  double first = 0.0;
  double last = 0.0;
  double greatest = 0.0;
  for (int k = 0; k < 400; ++k)
  {
    sleeve.Drive(k == 0 ? 0.2 : 0.01, 1.0, wire.Rail(), 1.0, wire.Rod);
    const double energy = wire.Rod.ElasticEnergy();
    first = k < 40 ? energy : first; // friction is strained first
    greatest = k > 40 ? std::max(greatest, std::abs(energy - last)) : 0.0;
    last = energy;
  }
  EXPECT_GT(last, first);
  EXPECT_LT(greatest, 1.6 * (last - first) / 360.0) << "evenly, not from node to node";
}

TEST(Balloon, IsPushedByASpringAgainstFriction)
{
  const BalloonCatheter balloon = BuiltInCatalogue().Balloon("semi-compliant-3.0x15").balloon;
  StraightWire wire(4.0);
  BalloonOnWire sleeve(balloon, BuiltInCatalogue().Catheter("EBU3.5-6F").catheter, 60.0);
  const double sticks = balloon.wireFriction / balloon.pushStiffness;
  sleeve.Drive(0.9 * sticks, 1.0, wire.Rail(), 1.0, wire.Rod);
  EXPECT_DOUBLE_EQ(sleeve.Tip(), 60.0);
  EXPECT_NEAR(sleeve.Report().force, 0.9 * balloon.wireFriction, 1e-12);
  for (int k = 0; k < 100; ++k)
  {
    sleeve.Drive(0.1, 1.0, wire.Rail(), 1.0, wire.Rod);
  }
  EXPECT_NEAR(sleeve.Tip(), 60.0 + 10.0 - 0.1 * sticks, 1e-9);
  EXPECT_NEAR(sleeve.Report().force, balloon.wireFriction, 1e-12);
  // The wire's tip stays before it.
  bool free = true;
  for (int k = 0; k < 400; ++k)
  {
    free = sleeve.Drive(0.1, 1.0, wire.Rail(), 1.0, wire.Rod);
  }
  EXPECT_FALSE(free);
  EXPECT_DOUBLE_EQ(sleeve.Tip(), 97.0);
}

TEST(Balloon, OverExpansionOfHealthyWall)
{
  Bench bench("semi-compliant-3.5x20", Tube(1.2, 0.0, 0.0, 0.0));
  const BalloonReport low = bench.Hold(4.0, 20.0);
  const BalloonReport high = bench.Hold(14.0, 20.0);
  EXPECT_LT(low.stretch, 1.3);
  EXPECT_GT(high.stretch, 1.3);
  EXPECT_GT(high.grip, 1.0);
  bench.Hold(-0.9, 15.0);
  EXPECT_DOUBLE_EQ(bench.Wall.Radii()[80], 1.2) << "it is elastic";
}

namespace
{
double MeanAortic(const CoronaryFlow& flow)
{
  double mean = 0.0;
  for (int n = 1; n <= 160; ++n)
  {
    mean += AorticPressure(flow.Settings(), n / 160.0) / 160.0;
  }
  return mean;
}
}

TEST(LesionFlow, ReserveIsTheRootOfTheNetwork)
{
  // dP = f Q + s Q^2, Q = (Pd - Pv) / Rm: s Q^2 + (f + Rm) Q = Pa - Pv.
  double before = 1.0;
  for (const double degree : { 0.5, 0.7, 0.9 })
  {
    const WallTopology tube = Tube(1.5, degree, 30.0, 40.0);
    const CoronaryFlow flow(tube, {});
    double integral = 0.0;
    for (std::size_t n = 1; n < tube.axis[0].size(); ++n)
    {
      const double a = tube.axisRadius[0][n - 1];
      const double b = tube.axisRadius[0][n];
      integral += 0.5 * (a * a + a * b + b * b) / (3.0 * a * a * a * b * b * b);
    }
    const double f = 8.0 / M_PI * 3.5e-3 * 1e3 / MmHg * integral;
    const double area = M_PI * 1.5 * 1.5;
    const double widening = 1.0 / ((1.0 - degree) * (1.0 - degree)) - 1.0;
    const double s = 1.52 * 0.5 * 1060.0 * widening * widening / (area * area) / MmHg;
    const double rm = flow.OutletResistance(1) / 4.0;
    const double aortic = MeanAortic(flow);
    const double linear = f + rm;
    const double q = (-linear + std::sqrt(linear * linear + 4.0 * s * (aortic - 5.0))) / (2.0 * s);
    const double expected = (5.0 + rm * q) / aortic;
    const double reserve = flow.FlowReserves({ { 0, 80.0 } })[0];
    EXPECT_NEAR(reserve, expected, 1e-9);
    EXPECT_LT(reserve, before);
    before = reserve;
    char text[64];
    std::snprintf(text, sizeof(text), "FFR of a lesion of %.0f %%", 100.0 * degree);
    Print(text, expected, reserve);
  }
}

TEST(LesionFlow, FollowsTheLumenAndWhatIsInIt)
{
  const WallTopology tube = Tube(1.5, 0.7, 30.0, 40.0);
  const WallTopology open = Tube(1.5, 0.0, 0.0, 0.0);
  CoronaryFlow flow(tube, {});
  CoronaryFlow healthy(open, {});
  const double narrow = flow.SegmentResistance(0);
  const std::vector<double> none(161, 0.0);
  flow.SetLumen(open.axisRadius[0], none);
  EXPECT_NEAR(flow.SegmentResistance(0), healthy.SegmentResistance(0), 1e-12);
  const double rm = flow.OutletResistance(1) / 4.0;
  const double share = rm / (flow.SegmentResistance(0) + rm); // nothing is lost in a jet any more
  EXPECT_NEAR(
    (flow.FlowReserves({ { 0, 80.0 } })[0] - share) / (1.0 - share), 5.0 / MeanAortic(flow), 1e-9);
  flow.SetLumen(tube.axisRadius[0], none);
  EXPECT_DOUBLE_EQ(flow.SegmentResistance(0), narrow);

  // An annulus in the whole tube.
  const double a = 0.43;
  flow.SetLumen(open.axisRadius[0], std::vector<double>(161, a));
  const double fourth =
    std::pow(1.5, 4) - std::pow(a, 4) - std::pow(1.5 * 1.5 - a * a, 2) / std::log(1.5 / a);
  EXPECT_NEAR(flow.SegmentResistance(0), 8.0 / M_PI * 3.5 / MmHg * 80.0 / fourth, 1e-9 * narrow);

  // A balloon that fills it.
  CoronaryFlow closed(open, {});
  std::vector<double> filled = none;
  std::fill(filled.begin() + 60, filled.begin() + 100, 1.5);
  for (int k = 0; k < 2000; ++k)
  {
    closed.Step(0.005, 0.5, 0.0);
  }
  const double flowing = closed.TreeFlow(0);
  closed.SetLumen(open.axisRadius[0], filled);
  for (int k = 0; k < 2000; ++k)
  {
    closed.Step(0.005, 0.5, 0.0);
  }
  EXPECT_GT(flowing, 0.2);
  EXPECT_LT(std::abs(closed.TreeFlow(0)), 1e-4 * flowing);
  EXPECT_NEAR(closed.PressureAt({ 0, 80.0 }), 5.0, 0.1) << "nothing comes: venous pressure";
  EXPECT_NEAR(closed.PressureAt({ 0, 20.0 }), closed.AorticPressureNow(), 0.01);
  closed.SetLumen(open.axisRadius[0], none);
  for (int k = 0; k < 2000; ++k)
  {
    closed.Step(0.005, 0.5, 0.0);
  }
  EXPECT_NEAR(closed.TreeFlow(0), flowing, 1e-9 * flowing);
}

namespace
{
std::string WhyNot(const VesselLesion& lesion)
{
  try
  {
    NarrowedWallMotion wall(LesionedPhantom(), { lesion });
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}
}

TEST(Lesions, NarrowTheMovingWall)
{
  const std::shared_ptr<WallMotion> wall = LesionedPhantom();
  const WallTopology& topology = wall->Topology();
  const std::vector<FoundLesion> found = FindLesions(topology);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].vessel, "mLAD");
  EXPECT_NEAR(found[0].degree, 0.7, 0.01);
  EXPECT_NEAR(static_cast<double>(found[0].points.size()) * 0.5, 11.0, 3.0) << "mm, without edges";
  for (const double phase : { 0.0, 0.3, 0.7 })
  {
    std::vector<Vector3> points;
    std::vector<Vector3> axis;
    wall->Positions(phase, points);
    wall->AxisPositions(phase, axis);
    const Vector3 throat = axis[found[0].throat];
    double nearest = 1e9;
    for (const Vector3& point : points)
    {
      nearest = std::min(nearest, (point - throat).norm());
    }
    EXPECT_NEAR(nearest, 0.44, 0.1) << "at phase " << phase;
    CheckWall(topology, points);
  }
  EXPECT_NE(WhyNot({ "nowhere", 1.0, 10.0, 0.5, 0.0 }).find("no 'nowhere'"), std::string::npos);
  EXPECT_NE(WhyNot({ "mLAD", 300.0, 10.0, 0.5, 0.0 }).find("a place (mm)"), std::string::npos);
  EXPECT_NE(WhyNot({ "mLAD", 3.0, 10.0, 0.99, 0.0 }).find("a degree"), std::string::npos);
}

// Recorded hands: an angiogram, wire through the lesion, balloon inflated and withdrawn, an angiogram.
TEST(Lesions, TheRecordedDilationRepeatsToTheBit)
{
  auto source = std::make_unique<ReplaySource>(
    std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/lad-lesion.pcirec");
  const ReplaySource* replay = source.get();
  const Scenario scenario = RecordedScenario(source->Reader().Header().scenario, "The recording");
  const std::shared_ptr<WallMotion> wall = LesionedPhantom();
  const std::uint64_t hash = WallHash(*wall);
  ASSERT_EQ(hash, source->Reader().Header().meshHash);
  SessionRunner runner(wall, scenario, hash, std::move(source));
  int outside = 0;
  double deepest = 0.0;
  double highest = 0.0;
  double least = 1e9;
  double flowing = 0.0; // mL/s at the dLAD's beginning
  double stopped = 1e9;
  const std::vector<std::string>& names = wall->Topology().groupName;
  const int distal =
    static_cast<int>(std::find(names.begin(), names.end(), "dLAD") - names.begin());
  runner.afterTick = [&](const SessionReport& report)
  {
    outside += report.tick.outside;
    deepest = std::max(deepest, report.tick.maximumPenetration);
    const BalloonReport& balloon = report.tick.balloon;
    highest = std::max(highest, balloon.pressure);
    const double flow = runner.Session().Contrast().Flow(distal);
    if (balloon.pressure > 9.9)
    {
      least = std::min(least, balloon.least);
      stopped = std::min(stopped, std::abs(flow));
    }
    flowing = std::max(flowing, flow);
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
  EXPECT_NEAR(highest, 10.0, 0.01);
  EXPECT_GT(least, 2.7) << "the waist is gone";
  EXPECT_LT(stopped, 1e-3 * flowing) << "no flow under the balloon";
  const std::vector<LesionResult> lesions = runner.Session().Lesions();
  ASSERT_EQ(lesions.size(), 1U);
  EXPECT_NEAR(lesions[0].degreeBefore, 0.7, 0.01);
  EXPECT_GT(lesions[0].degree, 0.15);
  EXPECT_LT(lesions[0].degree, 0.35);
  EXPECT_LT(lesions[0].reserveBefore, 0.8);
  EXPECT_GT(lesions[0].reserve, 0.9);
  EXPECT_GT(lesions[0].pressureRatio, 0.9) << "flow is back";
  EXPECT_TRUE(runner.Session().Metrics().events.empty());
}

TEST(Lesions, ABalloonThatIsTooThickForTheGuideIsRefused)
{
  const Scenario scenario = LoadScenario("lad-lesion");
  BalloonCatheter balloon = *scenario.balloon;
  const GuideCatheter guide = BuiltInCatalogue().Catheter("JL4-4F").catheter;
  balloon.crossingRadius = 0.6;
  InterventionSettings settings;
  settings.rootBranch = RootBranch(LesionedPhantom()->Topology(), "LCA");
  try
  {
    const Intervention intervention(LesionedPhantom(), scenario.wire, guide, settings, balloon);
    FAIL() << "it was taken";
  }
  catch (const std::invalid_argument& error)
  {
    EXPECT_NE(std::string(error.what()).find("is thicker"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("'JL4-4F'"), std::string::npos) << error.what();
  }
}
}
