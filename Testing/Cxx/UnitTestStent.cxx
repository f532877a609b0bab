// Stents: rings against their law, balance with balloon and wall, recoil, gaps, and a whole session.
#include "BalloonTestBench.h"
#include "InstrumentJson.h"
#include "JsonFields.h"
#include "SessionRunner.h"
#include "StentResult.h"
#include "TextFile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace UnitTestStent
{
using namespace coronary;

namespace
{
constexpr std::int64_t Middle = 80; // of a Tube's points

const BalloonCatheter& System(const char* name)
{
  return BuiltInCatalogue().Balloon(name).balloon;
}

/// The balloon is emptied, and what comes back has come back.
void Empty(Bench& bench)
{
  bench.Hold(-0.9, 15.0);
  bench.Hold(0.0, 1.0);
}

const StentRing& RingOf(const Bench& bench, std::int64_t point = Middle)
{
  return bench.Wall.Rings(point).at(0);
}

/// The root of a rising function, by halves.
double Bisect(const std::function<double(double)>& function, double low, double high)
{
  for (int k = 0; k < 200; ++k)
  {
    const double middle = 0.5 * (low + high);
    (function(middle) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Pressure of plaque and vessel when they are opened for the first time, from docs/simulator.md.
double FirstOpening(double radius, double rest, double reference, const DilationSettings& law)
{
  const double h = law.plaqueStiffness * law.elasticShare / (1.0 - law.elasticShare);
  const double opening = (radius - rest) / reference;
  const double flows =
    (law.plaqueStiffness * opening - law.plaqueYield) / (law.plaqueStiffness + h);
  const double plaque = law.plaqueStiffness * (opening - std::max(0.0, flows));
  const double stretch = std::max(0.0, radius / reference - 1.0);
  return plaque + law.meanPressure * (std::exp(law.wallStiffening * stretch) - 1.0);
}
}

TEST(StentRing, YieldsAndUnloadsByItsLaw)
{
  const StentDesign design = *System("stent-3.0x18").stent;
  StentRing ring = design.CrimpedRing();
  const double k = ring.stiffness;
  EXPECT_NEAR(k, 2.0 / (0.5 * 0.045 * 3.0), 1e-12);
  // Elastic to where it yields.
  const double yields = ring.crimped + ring.opening / k;
  EXPECT_NEAR(RingPressure(ring, yields), ring.opening, 1e-12);
  EXPECT_EQ(RingNatural(ring, yields - 1e-9), ring.crimped);
  EXPECT_GT(RingNatural(ring, yields + 1e-3), ring.crimped);
  // Beyond, by a slope of k H / (k + H).
  const double slope = (RingPressure(ring, yields + 0.6) - RingPressure(ring, yields + 0.1)) / 0.5;
  EXPECT_NEAR(slope, k * ring.hardening / (k + ring.hardening), 1e-9);
  // At its nominal diameter it bears the collapse pressure, and springs back by the design's recoil.
  EXPECT_NEAR(RingPressure(ring, 1.5), design.collapsePressure, 1e-12);
  ring.natural = ring.widest = RingNatural(ring, 1.5);
  EXPECT_NEAR(1.0 - ring.natural / 1.5, design.recoil, 1e-12);
  EXPECT_NEAR(RingPressure(ring, 1.47), k * (1.47 - ring.natural), 1e-12)
    << "with its own stiffness";
  // Pressed from outside it collapses at that pressure, and is no stronger afterwards.
  const double narrow = ring.natural - 0.3;
  EXPECT_NEAR(RingPressure(ring, narrow), -design.collapsePressure, 1e-12);
  ring.natural = RingNatural(ring, narrow);
  EXPECT_NEAR(ring.natural, narrow + design.collapsePressure / k, 1e-12);
  EXPECT_NEAR(RingPressure(ring, narrow + 0.25), design.collapsePressure, 1e-12);
  EXPECT_NEAR(design.LengthAt(3.0), 18.0, 1e-12);
  EXPECT_NEAR(design.LengthAt(2.0 * ring.crimped), 18.0 / 0.98, 1e-12);
  Print("stent free of a vessel: recoil, %", 100.0 * design.recoil, 100.0 * (1.0 - 1.4325 / 1.5));
}

TEST(Stent, FreeItHasTheDiametersOfItsTable)
{
  int stents = 0;
  for (const CatalogueBalloon& one : BuiltInCatalogue().balloons)
  {
    if (!one.balloon.stent)
    {
      continue;
    }
    ++stents;
    Bench bench(one.balloon, Tube(5.0, 0.0, 0.0, 0.0));
    constexpr double Slow = 0.5; // s a frame
    EXPECT_TRUE(bench.Hold(0.5, 10.0, 40.0, Slow).crimped);
    EXPECT_DOUBLE_EQ(bench.Sleeve.RadiusAt(one.balloon.Middle()), one.balloon.stent->crimpedRadius);
    for (const ComplianceRow& row : one.balloon.compliance)
    {
      const BalloonReport& report = bench.Hold(row.pressure, 90.0, 40.0, Slow);
      EXPECT_NEAR(report.least, row.diameter, 1e-5) << one.balloon.name;
      EXPECT_GT(report.greatest, row.diameter + 0.01) << "its ends, which no stent holds";
      EXPECT_NEAR(2.0 * RingOf(bench).radius, row.diameter, 1e-5);
      EXPECT_EQ(report.wallPressure, 0.0);
      EXPECT_GT(report.grip, 0.0) << "the stent's";
      EXPECT_FALSE(report.crimped);
    }
    const double most = one.balloon.compliance.back().diameter;
    EXPECT_NEAR(
      bench.Sleeve.Report().ringStretch, most / one.balloon.stent->greatestDiameter, 1e-6);
    bench.Hold(-0.9, 20.0, 40.0, Slow);
    EXPECT_DOUBLE_EQ(bench.Sleeve.Report().greatest, 2.0 * one.balloon.crossingRadius);
    const StentRing& ring = RingOf(bench);
    EXPECT_DOUBLE_EQ(ring.radius, ring.natural);
    EXPECT_NEAR(0.5 * most - ring.radius, RingStrength(ring) / ring.stiffness, 1e-6);
    // It stays where it is when the balloon goes, and is not there twice.
    bench.Hold(-0.9, 2.0, 10.0, Slow);
    EXPECT_DOUBLE_EQ(RingOf(bench).radius, ring.radius);
    EXPECT_EQ(bench.Hold(10.0, 20.0, 10.0, Slow).ringStretch, 0.0);
    EXPECT_EQ(bench.Wall.Rings(20).size(), 0U);
  }
  EXPECT_EQ(stents, 9);
}

TEST(Stent, RecoilOfTwoSprings)
{
  // A wall that only springs, by a straight line, below the vessel's own calibre.
  DilationSettings law;
  law.plaqueYield = 1e6;
  law.heldStiffening = 1e-9;
  DilatableWall wall(Tube(3.0, 0.7, 30.0, 50.0), {}, Tube(3.0, 0.7, 30.0, 50.0).axis[0], law);
  StentRing ring = System("stent-3.0x18").stent->CrimpedRing();
  ring.opening = 6.0; // strong enough not to flow inwards
  wall.Place(Middle, ring);
  wall.Hold(Middle, 1.4);
  for (int frame = 0; frame < 3; ++frame)
  {
    wall.Release();
  }
  const StentRing& now = wall.Rings(Middle)[0];
  const double kw = law.plaqueStiffness / 3.0; // atm/mm
  const double ke = ring.stiffness;
  const double wallsInside = 0.9 - ring.thickness;
  const double recoil = kw * (now.natural - wallsInside) / (ke + kw);
  EXPECT_NEAR(now.natural - now.radius, recoil, 1e-3 * recoil);
  EXPECT_GT(recoil, 0.05);
  EXPECT_NEAR(wall.Radii()[Middle], now.radius + now.thickness, 1e-12);
  Print("stent and wall, two springs: recoil, mm", 2.0 * recoil, 2.0 * (now.natural - now.radius));
}

TEST(Stent, InALesionItIsAtBalanceWithBalloonAndWall)
{
  const DilationSettings law;
  const double rest = 0.45;
  const double reference = 1.5;
  Bench bench("stent-3.0x18", Tube(reference, 0.7, 30.0, 50.0));
  const double strut = bench.Balloon.stent->strut;
  const double p = 14.0;
  // The table is that of balloon and stent together, so that the wall takes the rest.
  const double held = Bisect([&](double r)
    { return r - bench.Balloon.FreeRadius(p - FirstOpening(r + strut, rest, reference, law)); },
    0.6, 1.6);
  EXPECT_NEAR(bench.Hold(p, 30.0).least, 2.0 * held, 1e-5);
  EXPECT_NEAR(bench.Wall.Radii()[Middle], held + strut, 1e-5);
  Print(
    "stent on its balloon in a lesion of 70 %, 14 atm: mm", 2.0 * held, 2.0 * RingOf(bench).radius);

  // The balloon goes: the ring springs back elastically, plaque on its curve from where it was held.
  StentRing ring = bench.Balloon.stent->CrimpedRing();
  ring.natural = ring.widest = RingNatural(ring, held);
  const double most = (held + strut - rest) / reference;
  const double k = law.plaqueStiffness;
  const double h = k * law.elasticShare / (1.0 - law.elasticShare);
  const double plastic = (k * most - law.plaqueYield) / (k + h);
  const double c = law.heldStiffening;
  const double left = Bisect(
    [&](double r)
    {
      const double u = ((r + strut - rest) / reference - plastic) / (most - plastic);
      const double plaque = k * (most - plastic) * std::expm1(c * u) / std::expm1(c);
      const double stretch = std::max(0.0, (r + strut) / reference - 1.0);
      return ring.stiffness * (r - ring.natural) + plaque +
        law.meanPressure * std::expm1(law.wallStiffening * stretch);
    },
    0.6, held);
  EXPECT_LT(ring.stiffness * (ring.natural - left), RingStrength(ring)) << "it bears that";
  Empty(bench);
  EXPECT_NEAR(RingOf(bench).radius, left, 1e-5);
  EXPECT_NEAR(bench.Wall.Radii()[Middle], left + strut, 1e-5);
  EXPECT_EQ(bench.Wall.Gap(Middle), 0.0);
  const double recoil = 2.0 * (held - left);
  EXPECT_GT(recoil, 0.28 - 0.17) << "499 lesions: 0.28 +- 0.17 mm";
  EXPECT_LT(recoil, 0.28 + 0.17);
  Print("after it: mm", 2.0 * left, 2.0 * RingOf(bench).radius);
  // Without a stent the same balloon and pressure leave less.
  BalloonCatheter bare = bench.Balloon;
  bare.stent.reset();
  Bench alone(bare, Tube(reference, 0.7, 30.0, 50.0));
  alone.Hold(p, 30.0);
  Empty(alone);
  EXPECT_LT(alone.Wall.Radii()[Middle], bench.Wall.Radii()[Middle] - 0.1);
  // It stays so, frame by frame, and another inflation to the same pressure changes nothing.
  const double before = RingOf(bench).radius;
  bench.Hold(0.0, 5.0);
  EXPECT_EQ(RingOf(bench).radius, before);
  bench.Hold(p, 30.0);
  Empty(bench);
  EXPECT_NEAR(RingOf(bench).radius, before, 1e-5);
}

TEST(Stent, InAStiffTubeItHasTheTubesCalibre)
{
  DilationSettings law;
  law.calciumStiffness = law.calciumYield = 1e7;
  Bench bench("stent-3.0x18", Tube(1.5, 0.2, 30.0, 50.0, 360.0), law);
  bench.Hold(12.0, 30.0);
  EXPECT_NEAR(RingOf(bench).radius, 1.2 - 0.08, 1e-5);
  Empty(bench);
  // It springs back on its own; nothing follows it.
  const StentRing& ring = RingOf(bench);
  EXPECT_NEAR(ring.radius, 1.12 - RingStrength(ring) / ring.stiffness, 1e-5);
  EXPECT_NEAR(bench.Wall.Gap(Middle), 1.2 - ring.radius - 0.08, 1e-12);
}

TEST(Stent, CalciumThatPressesHarderThanItBearsMakesItCollapse)
{
  Bench bench("stent-3.0x18", Tube(1.5, 0.6, 30.0, 50.0, 360.0));
  bench.Hold(14.0, 30.0);
  Empty(bench);
  const StentRing& ring = RingOf(bench);
  const double pressed =
    WallPressure(bench.Wall.Stations()[Middle], bench.Wall.Radii()[Middle], bench.Wall.Settings());
  EXPECT_NEAR(pressed, RingStrength(ring), 1e-6);
  EXPECT_LT(ring.natural, ring.widest - 1e-3);
  const double after = ring.radius;
  bench.Hold(0.0, 20.0);
  EXPECT_NEAR(RingOf(bench).radius, after, 1e-9) << "it does not go on";
}

TEST(Stent, InAWideVesselItLeavesAGapThatASecondBalloonCloses)
{
  Bench bench("stent-3.0x12", Tube(1.85, 0.0, 0.0, 0.0));
  bench.Hold(10.0, 30.0);
  Empty(bench);
  const auto placed = bench.Sleeve.TakePlaced();
  ASSERT_TRUE(placed);
  StentResult result = MeasureStent(*placed, bench.Wall);
  const double ring = 1.5 * (1.0 - 0.045);
  ASSERT_NE(result.GreatestGap(), nullptr);
  EXPECT_NEAR(result.GreatestGap()->gap, 1.85 - ring - 0.08, 1e-5);
  EXPECT_NEAR(result.LeastExpanded()->Expansion(), std::pow(ring / 1.85, 2), 1e-5);
  EXPECT_NEAR(result.malapposed, 12.0, 0.6);
  EXPECT_EQ(result.residual, 0.0) << "the vessel is open";
  EXPECT_NEAR(result.to - result.from, bench.Balloon.stent->LengthAt(2.0 * ring), 1e-5);
  EXPECT_NEAR(0.5 * (result.from + result.to), 40.0, 1e-9);
  EXPECT_EQ(result.beyond, 0.0);
  Print("stent of 3.0 mm in a vessel of 3.7 mm: gap, mm", 1.85 - ring - 0.08,
    result.GreatestGap()->gap);

  // A second balloon has a table of its own, and the stent takes a part of the pressure.
  const BalloonCatheter& second = System("non-compliant-3.5x12");
  Bench other(second, Tube(1.85, 0.0, 0.0, 0.0));
  StentRing first = RingOf(bench);
  const double p = 16.0;
  const double held =
    Bisect([&](double r) { return r - second.FreeRadius(p - RingPressure(first, r)); }, 1.4, 1.9);
  for (int k = 0; k < 600; ++k)
  {
    other.Sleeve.Inflate(0.05, p, 40.0, 3.0, bench.Way, bench.Wall);
  }
  EXPECT_NEAR(RingOf(bench).radius, held, 1e-5);
  EXPECT_NEAR(other.Sleeve.Report().greatest, 2.0 * held, 1e-5);
  for (int k = 0; k < 400; ++k)
  {
    other.Sleeve.Inflate(0.05, -0.9, 40.0, 3.0, bench.Way, bench.Wall);
  }
  first.natural = first.widest = RingNatural(first, held);
  result = MeasureStent(*placed, bench.Wall);
  EXPECT_NEAR(result.Narrowest()->diameter, 2.0 * first.natural, 1e-5);
  EXPECT_LT(result.GreatestGap()->gap, StentResult::GapTold);
  Print("after a second balloon, 3.5 mm at 16 atm: mm", 2.0 * first.natural,
    result.Narrowest()->diameter);
}

TEST(Stent, TwoOfThemAreThreeSprings)
{
  DilationSettings law;
  law.plaqueYield = 1e6;
  law.heldStiffening = 1e-9;
  const WallTopology tube = Tube(3.0, 0.7, 30.0, 50.0);
  DilatableWall wall(tube, {}, tube.axis[0], law);
  StentRing ring = System("stent-3.0x18").stent->CrimpedRing();
  ring.opening = 6.0;
  const auto settle = [&]
  {
    for (int frame = 0; frame < 3; ++frame)
    {
      wall.Release();
    }
  };
  wall.Place(Middle, ring);
  wall.Hold(Middle, 1.3);
  settle();
  wall.Place(Middle, ring);
  wall.Hold(Middle, 1.3);
  settle();
  const std::vector<StentRing>& rings = wall.Rings(Middle);
  ASSERT_EQ(rings.size(), 2U);
  const double t = ring.thickness;
  const double kw = law.plaqueStiffness / 3.0;
  const double ke = ring.stiffness;
  // As radii inside of the inner one.
  const double expected =
    (ke * rings[1].natural + ke * (rings[0].natural - t) + kw * (0.9 - 2.0 * t)) / (2.0 * ke + kw);
  EXPECT_NEAR(rings[1].radius, expected, 1e-6);
  EXPECT_NEAR(rings[0].radius, expected + t, 1e-6);
  EXPECT_NEAR(wall.Radii()[Middle], expected + 2.0 * t, 1e-6);
  EXPECT_EQ(wall.Gap(Middle), 0.0);
  Print("two stents in one another and a wall: mm", 2.0 * expected, 2.0 * rings[1].radius);
}

TEST(Stent, IsNotOpenedInTheGuideAndToldBeyondTheVessel)
{
  Bench bench("stent-3.0x18", Tube(1.5, 0.0, 0.0, 0.0));
  const BalloonReport& report =
    bench.Hold(10.0, 20.0, 11.0); // its end is at 1.8 mm, the guide's at 3
  EXPECT_TRUE(report.caught);
  EXPECT_TRUE(report.crimped);
  EXPECT_LT(report.pressure, 0.1);
  bench.Hold(10.0, 20.0, 13.0);
  EXPECT_FALSE(bench.Sleeve.Report().caught);
  EXPECT_FALSE(bench.Sleeve.Report().crimped);

  Bench end("stent-3.0x18", Tube(1.5, 0.0, 0.0, 0.0));
  end.Hold(10.0, 20.0, 75.0);
  const auto placed = end.Sleeve.TakePlaced();
  ASSERT_TRUE(placed);
  EXPECT_NEAR(placed->beyond, 4.0, 1e-9) << "75 + 9 of 80 mm";
  EXPECT_NEAR(MeasureStent(*placed, end.Wall).beyond, 4.0, 1e-9);
  EXPECT_FALSE(end.Sleeve.TakePlaced()) << "it is there once";
}

TEST(Stent, BeyondWhatItsDesignAllowsIsSeen)
{
  Bench bench("stent-2.5x12", Tube(3.0, 0.0, 0.0, 0.0));
  bench.Hold(10.0, 30.0);
  BalloonCatheter wide = System("semi-compliant-3.5x20");
  Bench other(wide, Tube(3.0, 0.0, 0.0, 0.0));
  const auto hold = [&](double pressure)
  {
    for (int k = 0; k < 600; ++k)
    {
      other.Sleeve.Inflate(0.05, pressure, 40.0, 3.0, bench.Way, bench.Wall);
    }
    return other.Sleeve.Report().ringStretch;
  };
  EXPECT_LT(hold(12.0), 1.0);
  EXPECT_GT(hold(22.0), 1.0);
}

namespace
{
std::string WhyNot(const std::function<void(nlohmann::json&)>& change)
{
  nlohmann::json json = BalloonToJson(System("stent-3.0x18"));
  change(json);
  try
  {
    BalloonFromJson(json, "'own.json'");
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}

void ExpectRefused(const std::function<void(nlohmann::json&)>& change, const std::string& words)
{
  const std::string said = WhyNot(change);
  EXPECT_NE(said.find("'own.json'"), std::string::npos) << said;
  EXPECT_NE(said.find("'stent-3.0x18'"), std::string::npos) << said;
  EXPECT_NE(said.find(words), std::string::npos) << said;
}
}

TEST(Stent, BadDesignsAreRefusedByName)
{
  using Json = nlohmann::json;
  EXPECT_EQ(WhyNot([](Json&) {}), "");
  ExpectRefused([](Json& j) { j["stent"].erase("strut_mm"); }, "'strut_mm'");
  ExpectRefused([](Json& j) { j["stent"]["strut"] = 0.1; }, "'strut'");
  ExpectRefused([](Json& j) { j["stent"]["recoil"] = "much"; }, "'recoil'");
  ExpectRefused([](Json& j) { j["stent"]["recoil"] = 0.5; }, "the recoil is 0.5");
  ExpectRefused([](Json& j) { j["stent"]["length_mm"] = 30; }, "the length");
  ExpectRefused([](Json& j) { j["stent"]["crimped_profile_mm"] = 0.9; }, "the crimped radius");
  ExpectRefused([](Json& j) { j["stent"]["diameter_mm"] = 0.9; }, "the diameter");
  ExpectRefused([](Json& j) { j["stent"]["greatest_diameter_mm"] = 2.9; }, "the greatest diameter");
  ExpectRefused([](Json& j) { j["stent"]["opening_pressure_atm"] = 3; }, "the opening pressure");
  ExpectRefused([](Json& j) { j["stent"]["foreshortening"] = -0.1; }, "'foreshortening'");
  ExpectRefused([](Json& j)
    { j["stent"]["collapse_pressure_atm"] = j["stent"]["opening_pressure_atm"] = 9; },
    "too little pressure to open it");
}

namespace
{
/// A recorded or written session to its end, with what it said.
struct Played
{
  Played(const Scenario& scenario, std::unique_ptr<TickSource> source)
    : Runner(LesionedPhantom(), scenario, WallHash(*LesionedPhantom()), std::move(source))
  {
    this->Runner.say = [this](std::uint64_t, const std::string& text)
    { this->Said += text + "\n"; };
    this->Runner.afterTick = [this](const SessionReport& report)
    {
      this->Outside += report.tick.outside;
      this->Deepest = std::max(this->Deepest, report.tick.maximumPenetration);
      this->LookAtStent();
    };
    while (this->Runner.Run(1000))
    {
    }
  }

  /// A ring is about the moving axis, and the moving wall as far from there as its section is wide.
  void LookAtStent()
  {
    const Intervention& instruments = this->Runner.Session().Instruments();
    if (this->Runner.Tick() % 400 != 0 || instruments.Stents().empty())
    {
      return;
    }
    std::vector<StentShape> shapes;
    instruments.StentShapes(shapes);
    const std::size_t n = shapes[0].line.size() / 2;
    const Vector3& centre = shapes[0].line[n];
    double nearest = 1e9;
    for (const Vector3& point : instruments.WallPoints())
    {
      nearest = std::min(nearest, (point - centre).norm());
    }
    const std::int64_t point = instruments.Stents()[0].points[n];
    const double lumen = instruments.Dilated()->Radii()[point];
    this->Off = std::max(this->Off, std::abs(nearest - lumen));
    const double outside = shapes[0].radii[n] + shapes[0].design.strut;
    this->Through = std::max(this->Through, outside - lumen);
    this->First = this->Places.empty() ? centre : this->First;
    this->Places.push_back(centre);
    this->Travel = std::max(this->Travel, (centre - this->First).norm());
  }

  SessionRunner Runner;
  std::string Said;
  int Outside = 0;
  double Deepest = 0.0;
  double Off = 0.0;     // mm
  double Through = 0.0; // mm of a ring beyond the wall
  double Travel = 0.0;
  Vector3 First = Vector3::Zero();
  std::vector<Vector3> Places;
};

const ProcedureEvent* EventOf(const Played& played, ProcedureEvent::Kind kind)
{
  const std::vector<ProcedureEvent>& events = played.Runner.Session().Metrics().events;
  const auto found = std::find_if(
    events.begin(), events.end(), [&](const ProcedureEvent& event) { return event.kind == kind; });
  return found == events.end() ? nullptr : &*found;
}
}

TEST(Stent, BalloonsAreExchangedEmptyAndInTheGuide)
{
  const Scenario scenario = LoadScenario("lad-stent");
  TrainingSession session(LesionedPhantom(), scenario);
  SessionInput input = session.StartInput();
  const auto run = [&](int ticks)
  {
    for (int tick = 0; tick < ticks; ++tick)
    {
      session.Step(input);
    }
    std::string said;
    for (const std::string& message : session.TakeMessages())
    {
      said += message;
    }
    return said;
  };
  // A stent in the guide keeps its balloon from filling; a balloon without one fills.
  input.drive.inflation = 10.0;
  EXPECT_NE(run(1000).find("not wholly out of the guide"), std::string::npos);
  EXPECT_TRUE(session.Report().tick.balloon.crimped);
  EXPECT_TRUE(session.Apply({ RecordedEvent::Exchange, 1.0 }));
  EXPECT_NE(run(4000).find("The balloon 'non-compliant-3.5x12' is taken."), std::string::npos);
  EXPECT_FALSE(session.Report().tick.balloon.crimped);
  EXPECT_GT(session.Report().tick.balloon.pressure, 1.0);
  EXPECT_TRUE(session.Apply({ RecordedEvent::Exchange, 0.0 }));
  EXPECT_NE(run(1).find("is not exchanged"), std::string::npos);
  EXPECT_FALSE(session.Report().tick.balloon.crimped) << "it is the same";
  for (const double number : { 2.0, -1.0, 0.5 })
  {
    EXPECT_FALSE(session.Apply({ RecordedEvent::Exchange, number }));
    EXPECT_NE(run(1).find("There is no balloon number"), std::string::npos);
  }
}

// Recorded hands: the stent opened, its balloon exchanged for a second one that opens it further, both withdrawn.
TEST(Stent, TheRecordedDeploymentRepeatsToTheBit)
{
  auto source = std::make_unique<ReplaySource>(
    std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/lad-stent.pcirec");
  const ReplaySource* replay = source.get();
  Scenario scenario = RecordedScenario(source->Reader().Header().scenario, "The recording");
  ASSERT_TRUE(scenario.balloon && scenario.balloon->stent);
  // (It was recorded before scenarios had procedures.)
  scenario.procedure = LoadScenario("lad-stent").procedure;
  const Played played(scenario, std::move(source));
  const TrainingSession& session = played.Runner.Session();
  EXPECT_EQ(replay->Reader().HowEnded(), RecordingReader::Ending::Complete);
  EXPECT_GT(played.Runner.Compared().compared, 50U);
  EXPECT_EQ(played.Runner.Compared().equal, played.Runner.Compared().compared)
    << "from tick " << played.Runner.Compared().firstDifference;
  EXPECT_EQ(played.Outside, 0);
  EXPECT_LT(played.Deepest, 0.25);
  EXPECT_FALSE(session.Instruments().Report().balloon.crimped);
  EXPECT_LT(session.Instruments().Report().balloon.tip, -10.0) << "the balloons are in the guide";
  // The stent is still there, where it moves with the wall.
  EXPECT_GT(played.Places.size(), 50U);
  EXPECT_GT(played.Travel, 2.0) << "it beats";
  EXPECT_LT(played.Off, 0.1);
  EXPECT_LT(played.Through, 1e-9);
  const std::vector<StentResult> stents = session.Stents();
  ASSERT_EQ(stents.size(), 1U);
  const StentResult& stent = stents[0];
  EXPECT_EQ(stent.vessel, "mLAD");
  EXPECT_EQ(stent.name, "stent-3.0x18");
  EXPECT_NEAR(stent.to - stent.from, 18.0, 0.2);
  EXPECT_GT(stent.Narrowest()->diameter, 2.5);
  EXPECT_LT(stent.GreatestGap()->gap, StentResult::GapTold);
  EXPECT_LT(stent.residual, 0.1);
  EXPECT_FALSE(stent.missedAll);
  EXPECT_LT(std::max(stent.missedBefore, stent.missedBehind), StentResult::MissTold);
  const std::vector<LesionResult> lesions = session.Lesions();
  ASSERT_EQ(lesions.size(), 1U);
  EXPECT_LT(lesions[0].degree, 0.1);
  EXPECT_GT(lesions[0].reserve, 0.9);
  EXPECT_GT(lesions[0].pressureRatio, 0.9) << "flow is back";
  EXPECT_NE(played.Said.find("The balloon 'non-compliant-3.5x12' is taken."), std::string::npos)
    << played.Said;
  EXPECT_NE(played.Said.find("The stent of 'stent-3.0x18' lies in mLAD"), std::string::npos);
  // All steps were done, and in time; the hands were those of somebody who looks away.
  const std::vector<double>& reached = session.Procedure().reached;
  ASSERT_EQ(reached.size(), scenario.procedure.size()) << NextOf(scenario.procedure, { reached });
  EXPECT_GT(reached[0], 8.2);
  EXPECT_LT(reached[1], 9.8);
  EXPECT_GT(reached[2], 12.7);
  EXPECT_LT(reached[2], 16.0);
  EXPECT_GT(reached[4], 34.9);
  EXPECT_NE(played.Said.find("Step 3 of 5 is done: Open the stent"), std::string::npos);
  const ProcedureScore score = session.Score();
  EXPECT_TRUE(score.passed);
  EXPECT_GT(session.Metrics().blindTravel, 80.0);
  EXPECT_LT(session.Metrics().blindTravel, session.Metrics().wireTravel);
  EXPECT_GT(session.Metrics().occludedSeconds, 2.0);
  EXPECT_LT(session.Metrics().occludedSeconds, 20.0);
  double lost = 0.0;
  for (const ScoreItem& item : score.items)
  {
    lost += std::min(item.most, item.weight * item.amount);
  }
  EXPECT_NEAR(score.points, 100.0 - lost, 1e-9);
}

// The same hands with a stent that is too short and too narrow, and a balloon that is too wide.
TEST(Stent, WhatWentWrongIsToldByNameAndPlace)
{
  Scenario scenario = LoadScenario("lad-stent");
  BalloonCatheter& system = *scenario.balloon;
  system = System("stent-2.5x12");
  system.name = "too small";
  system.length = 8.0;
  system.stent->length = 7.0;
  system.stent->diameter = 2.0;
  system.stent->greatestDiameter = 2.3;
  for (ComplianceRow& row : system.compliance)
  {
    row.diameter *= 0.8;
  }
  scenario.exchanges = { System("semi-compliant-3.5x20") };
  scenario.settings.heartRate = 0.0;
  // Quicker, and without angiograms.
  nlohmann::json json = ParseBoundedJson(
    ReadTextFile(
      std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/lad-stent.json", "a script"),
    "'script'");
  nlohmann::json pieces = nlohmann::json::array();
  bool wired = false;
  for (nlohmann::json& piece : json["pieces"])
  {
    wired = wired || piece.contains("balloon_mm");
    piece["seconds"] = (wired ? 0.6 : 1.0) * piece["seconds"].get<double>();
    if (!piece.contains("inject_mL"))
    {
      pieces.push_back(piece);
    }
  }
  json["pieces"] = pieces;
  const Played played(scenario,
    std::make_unique<ScriptSource>(DriveScriptFromText(json.dump(), "'script'"),
      StartInputOf(scenario), scenario.settings.tickRate, false));
  using Kind = ProcedureEvent::Kind;
  for (const Kind kind : { Kind::UnderExpansion, Kind::Malapposition, Kind::GeographicMiss,
         Kind::StentOverExpansion, Kind::OverPressure })
  {
    const ProcedureEvent* event = EventOf(played, kind);
    const char* quantity = "";
    ASSERT_NE(event, nullptr) << NameOf(kind, quantity) << "\n" << played.Said;
    EXPECT_GT(event->place, 20.0);
    EXPECT_LT(event->place, 100.0);
    EXPECT_EQ(LesionedPhantom()->Topology().groupName[event->branch], "mLAD");
  }
  for (const char* words : { "The stent of 'too small' is under-expanded",
         "The stent of 'too small' does not reach the wall",
         "The stent of 'too small' ends in the lesion", "opens a stent to",
         "above its rated pressure", "It is in mLAD," })
  {
    EXPECT_NE(played.Said.find(words), std::string::npos) << words << "\n" << played.Said;
  }
}
}
