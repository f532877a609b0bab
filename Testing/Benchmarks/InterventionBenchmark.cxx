// A tick of the simulator: a wire of about a hundred segments in the standard phantom's beating left coronary
// artery, and the rod alone; a guide catheter in an aorta. Time is the processor's.
#include "AortaTestBench.h"
#include "BenchmarkLimits.h"
#include "CosseratRod.h"
#include "InstrumentCatalogue.h"
#include "Intervention.h"
#include "Scenario.h"
#include "VesselWall.h"
#include "WallMotions.h"

#include <benchmark/benchmark.h>

#include <cstdint>
#include <map>
#include <memory>

using namespace coronary;

namespace
{
/// Of the standard phantom, which all scenarios here have.
const std::shared_ptr<WallMotion>& StandardWall(const Scenario& scenario)
{
  static const std::shared_ptr<WallMotion> wall =
    MakePhantomWallMotion(scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 40);
  return wall;
}

InterventionSettings SettingsIn(const WallMotion& wall, const Scenario& scenario)
{
  InterventionSettings settings = scenario.settings;
  settings.rootBranch = RootBranch(wall.Topology(), scenario.artery);
  return settings;
}

// Fed until it has so many segments, then pushed to and fro by a millimetre.
void Tick(benchmark::State& state)
{
  const Scenario scenario = LoadScenario("phantom-lca");
  const std::shared_ptr<WallMotion>& wall = StandardWall(scenario);
  const InterventionSettings settings = SettingsIn(*wall, scenario);
  Intervention intervention(wall, scenario.wire, scenario.catheter, settings);
  DriveInput input;
  while (intervention.NumberOfSegments() < state.range(0))
  {
    input.wirePosition += 15.0 / settings.tickRate;
    intervention.Step(input);
  }
  long k = 0;
  double contacts = 0.0;
  for (auto _ : state)
  {
    input.wirePosition += (k / 200) % 2 == 0 ? -0.005 : 0.005;
    contacts += intervention.Step(input).contacts;
    ++k;
  }
  state.counters["segments"] = static_cast<double>(intervention.NumberOfSegments());
  state.counters["contacts"] = contacts / static_cast<double>(k);
  state.counters["triangles"] = static_cast<double>(wall->Topology().triangles.size());
  // At 2 kHz: the share of one core.
  state.counters["ticks/s"] =
    benchmark::Counter(static_cast<double>(k), benchmark::Counter::kIsRate);
}
BENCHMARK(Tick)
  ->ArgName("segments")
  ->Arg(30)
  ->Arg(60)
  ->Arg(100)
  ->MinTime(2.0)
  ->Unit(benchmark::kMicrosecond);

// Two wires in the vessel, the first one with a balloon (1: folded; 2: open) or without (0); the other one is held.
void TwoWires(benchmark::State& state)
{
  const Scenario scenario = LoadScenario("lad-bifurcation");
  const std::shared_ptr<WallMotion>& wall = StandardWall(scenario);
  const InterventionSettings settings = SettingsIn(*wall, scenario);
  const bool carries = state.range(1) != 0;
  Intervention intervention(wall, scenario.wire, scenario.catheter, settings,
    carries ? scenario.balloon : std::nullopt, scenario.secondWire);
  DriveInput input;
  for (const std::size_t wire : { 1, 0 })
  {
    intervention.TakeWire(wire);
    for (double way = 0.0; way < static_cast<double>(state.range(0));
         way += 15.0 / settings.tickRate)
    {
      input.wirePosition += 15.0 / settings.tickRate;
      intervention.Step(input);
    }
  }
  for (int k = 0; k < 4000 && carries; ++k)
  {
    input.balloonPosition += 55.0 / 4000.0;
    intervention.Step(input);
  }
  input.inflation = state.range(1) > 1 ? 8.0 : 0.0;
  for (int k = 0; k < 8000 && carries; ++k)
  {
    intervention.Step(input);
  }
  long k = 0;
  for (auto _ : state)
  {
    input.wirePosition += (k / 200) % 2 == 0 ? -0.005 : 0.005;
    intervention.Step(input);
    ++k;
  }
  state.counters["segments"] = static_cast<double>(intervention.NumberOfSegments());
  state.counters["beyond"] = intervention.Report().wires[1].inserted;
  state.counters["balloon"] = intervention.Report().balloon.tip;
  state.counters["atm"] = intervention.Report().balloon.pressure;
}
BENCHMARK(TwoWires)
  ->ArgNames({ "mm", "balloon" })
  ->Args({ 60, 0 })
  ->Args({ 100, 0 })
  ->Args({ 100, 1 })
  ->Args({ 100, 2 })
  ->MinTime(2.0)
  ->Unit(benchmark::kMicrosecond);

void RodAlone(benchmark::State& state)
{
  const auto count = state.range(0);
  CosseratRod rod(count);
  for (int i = 0; i < count; ++i)
  {
    RodJoint joint;
    joint.angularStiffness = Vector3(2.0, 2.0, 1.5);
    rod.Append(MakeRodSegment(1.5, 0.178, 6450.0), joint, Vector3(0.0, 0.0, 1.5 * i),
      Eigen::Quaterniond::Identity());
  }
  rod.Prescribe(0, rod.Position(0), rod.Orientation(0));
  rod.SetForce(count - 1, Vector3(1e-4, 0.0, 0.0));
  for (auto _ : state)
  {
    benchmark::DoNotOptimize(rod.Step(5e-4).maximumGap);
  }
}
BENCHMARK(RodAlone)->Arg(60)->Arg(100)->Arg(200)->Unit(benchmark::kMicrosecond);
}

namespace
{
// A guide in an aorta of triangles, from the diaphragm down to where the left ostium is, pushed to and fro by a millimetre. It does not
// fall in without being turned: `depth` and `offset` say where its tip is.
void Guide(benchmark::State& state)
{
  AortaBench bench;
  WallTopology aorta;
  std::vector<Vector3> aortaPoints;
  AppendAorta(aorta, aortaPoints, 64, 1.5);
  WallTopology stump;
  std::vector<Vector3> stumpPoints;
  AppendStump(stump, stumpPoints, bench.ostium);
  VesselWallSettings settings;
  settings.surfaceReach = 0.0;
  settings.stiffness = 60.0;
  VesselWall aortaWall(aorta, aortaPoints, settings);
  VesselWall stumpWall(stump, stumpPoints, settings);
  JoinedLumen wall(aortaWall, stumpWall, bench.ostium.position, 40.0);
  GuideInAorta guide(BuiltInCatalogue().Catheter("JL4-6F").catheter, AortaBench::Way());
  const Guidewire wire = LeadingWire();
  double position = 0.0;
  double beyond = 60.0;
  const auto move = [&](double push, double draw, int ticks)
  {
    for (int k = 0; k < ticks; ++k)
    {
      position += push / ticks;
      beyond -= draw / ticks;
      guide.Carry(wire, beyond);
      guide.Step(position, 0.0, wall);
    }
  };
  move(315.0, 0.0, 8000);
  move(0.0, 260.0, 6000);
  move(45.0, 0.0, 9000);
  long k = 0;
  for (auto _ : state)
  {
    position += (k / 200) % 2 == 0 ? -0.005 : 0.005;
    guide.Carry(wire, beyond);
    benchmark::DoNotOptimize(guide.Step(position, 0.0, wall).touching);
    ++k;
  }
  const GuideSeat seat = SeatOf(guide.Tip(), guide.Direction(), bench.ostium);
  state.counters["depth"] = seat.depth;
  state.counters["offset"] = seat.offset;
  state.counters["segments"] = static_cast<double>(guide.Rod().Size());
  state.counters["triangles"] =
    static_cast<double>(aorta.triangles.size() + stump.triangles.size());
}
BENCHMARK(Guide)->MinTime(2.0)->Unit(benchmark::kMicrosecond);
}

/// --strict: half of a core at 2 kHz.
int main(int argc, char** argv)
{
  return RunBenchmarks(argc, argv, { { "Tick/segments:100", 250.0 } });
}
