// Random driving of a guidewire in beating phantoms: does it ever leave the lumen, does anything break?
// Writes a line for each phantom and a last one for all; exit code 1 when one of the limits below is missed.
#include "CounterRandom.h"
#include "Intervention.h"
#include "ProcessMemory.h"
#include "WallMotions.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

using namespace coronary;

namespace
{
// A tip that is pushed into the end of a vessel with several N presses it in: 60 N/mm, harder from 0.05 mm on. A
// joint that opens by more than a seventh of the wire's thickness is no wire any more.
constexpr double MostPenetration = 0.2;       // mm
constexpr double MostMeanPenetration = 0.001; // mm
constexpr double MostGap = 0.05;              // mm
constexpr long MostOutside = 0;               // samples that were put back
constexpr long MostResets = 0;

/// @return whether it is within
bool Check(const char* what, double value, double limit)
{
  if (!(value <= limit)) // nor is what is no number
  {
    std::fprintf(stderr, "soak-intervention: %s: %g, the limit is %g\n", what, value, limit);
    return false;
  }
  return true;
}

Guidewire RandomWire(RandomStream& random)
{
  Guidewire wire;
  wire.name = "random";
  wire.source = "drawn at random for the soak";
  const double tip = random.Uniform(0.5, 3.0);
  const double shaft = random.Uniform(30.0, 150.0);
  const double curve = random.Uniform(0.0, 0.35);
  const auto add = [&](double length, double stiffness, double curvature)
  {
    WireSection section;
    section.length = length;
    section.bendingStiffness1 = section.bendingStiffness2 = stiffness;
    section.torsionalStiffness = 0.77 * stiffness;
    section.axialStiffness = stiffness < 10.0 ? 3000.0 : 15000.0;
    section.radius = 0.178;
    section.density = 6450.0;
    section.friction = random.Uniform(0.02, 0.15);
    section.restCurvature = curvature;
    wire.sections.push_back(section);
  };
  add(random.Uniform(2.0, 5.0), tip, curve);
  add(25.0, 2.0 * tip, 0.0);
  add(60.0, 0.15 * shaft, 0.0);
  add(80.0, 0.5 * shaft, 0.0);
  add(100.0, shaft, 0.0);
  return wire;
}

GuideCatheter Catheter()
{
  GuideCatheter catheter;
  catheter.name = "6F";
  catheter.source = "6F guide catheter, 0.071 inch inside";
  catheter.innerRadius = 0.9;
  catheter.outerRadius = 1.0;
  catheter.friction = 0.05;
  catheter.shape = { { 5.0, 0.0, 0.0 }, { 15.0, 0.1, 0.0 }, { 60.0, 0.0, 0.0 } };
  return catheter;
}
}

int main(int argc, char** argv)
{
  const int phantoms = argc > 1 ? std::atoi(argv[1]) : 20;
  const long ticks = argc > 2 ? std::atol(argv[2]) : 50000;
  const int first = argc > 3 ? std::atoi(argv[3]) : 1;
  long outside = 0;
  long total = 0;
  long resets = 0;
  double deepest = 0.0;
  double widest = 0.0;
  double depths = 0.0;
  double seconds = 0.0;
  std::printf(
    "phantom,artery,ticks,seconds,us_per_tick,penetration_max_mm,penetration_mean_mm,joint_gap_mm,"
    "force_max_N,inserted_max_mm,outside,resets,"
    "memory_early_MB,memory_end_MB\n");
  for (int p = 0; p < phantoms; ++p)
  {
    PhantomSettings settings;
    settings.seed = first + p;
    settings.dominance = static_cast<Dominance>(p % 3);
    const auto wall = MakePhantomWallMotion(settings, 0.5, 20);
    RandomStream random(settings.seed, 77);
    const Guidewire wire = RandomWire(random);
    InterventionSettings options;
    options.heartRate = random.Uniform(40.0, 140.0);
    const WallTopology& topology = wall->Topology();
    std::vector<int> roots;
    for (std::size_t b = 0; b < topology.parent.size(); ++b)
    {
      if (topology.parent[b] < 0)
      {
        roots.push_back(static_cast<int>(b));
      }
    }
    options.rootBranch = roots[p % roots.size()];
    Intervention intervention(wall, wire, Catheter(), options);
    DriveInput input;
    double speed = 0.0;
    double turning = 0.0;
    double wantedSpeed = 0.0;
    double wantedTurning = 0.0;
    long lost = 0;
    long reset = 0;
    double deep = 0.0;
    double sum = 0.0;
    double gap = 0.0;
    double force = 0.0;
    double inserted = 0.0;
    double early =
      0.0; // after what is made once: a tenth of the way, or a minute of simulated time
    const auto begin = std::chrono::steady_clock::now();
    for (long k = 0; k < ticks; ++k)
    {
      if (k == std::min(ticks / 10, 120000L))
      {
        early = ResidentBytes() / 1e6;
      }
      if (k % 800 == 0)
      {
        // Mostly forwards, sometimes to and fro, sometimes as fast as hands can.
        const double hurry = random.Uniform() < 0.1 ? 3.0 : 1.0;
        wantedSpeed = hurry * random.Uniform(-40.0, 70.0);
        wantedTurning = hurry * random.Uniform(-8.0, 8.0);
        input.catheterPosition = random.Uniform(-1.0, 3.0);
        if (random.Uniform() < 0.05)
        {
          intervention.SetHeartRate(random.Uniform() < 0.2 ? 0.0 : random.Uniform(40.0, 140.0));
        }
      }
      // A hand does not change its speed at once.
      speed += 0.01 * (wantedSpeed - speed);
      turning += 0.01 * (wantedTurning - turning);
      // Nor does it push on where the wire does not follow, nor draw it out altogether.
      const TickReport& before = intervention.Report();
      const double held = std::clamp(1.0 - before.proximalForce / 1.0, 0.0, 1.0);
      double way = (speed > 0.0 ? held * speed : speed) / options.tickRate;
      if (before.inserted <= 0.5 && way < 0.0)
      {
        way = 0.0;
      }
      input.wirePosition += way;
      input.wireAngle += turning / options.tickRate;
      const TickReport& report = intervention.Step(input);
      lost += report.outside;
      deep = std::max(deep, report.maximumPenetration);
      sum += report.meanPenetration;
      gap = std::max(gap, report.jointGap);
      force = std::max(force, report.maximumForce);
      inserted = std::max(inserted, report.inserted);
      for (const std::string& message : intervention.TakeMessages())
      {
        reset += message.find("set back") != std::string::npos;
      }
    }
    const double passed =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::printf("%d,%s,%ld,%.1f,%.1f,%.4f,%.5f,%.4f,%.3f,%.1f,%ld,%ld,%.1f,%.1f\n",
      static_cast<int>(settings.seed),
      topology.groupName.empty() ? "" : topology.groupName[options.rootBranch].c_str(), ticks,
      passed, 1e6 * passed / static_cast<double>(ticks), deep, sum / static_cast<double>(ticks),
      gap, force, inserted, lost, reset, early, ResidentBytes() / 1e6);
    std::fflush(stdout);
    outside += lost;
    resets += reset;
    total += ticks;
    seconds += passed;
    depths += sum;
    deepest = std::max(deepest, deep);
    widest = std::max(widest, gap);
  }
  std::printf("all,,%ld,%.1f,%.1f,%.4f,%.5f,%.4f,,,%ld,%ld,,\n", total, seconds,
    1e6 * seconds / static_cast<double>(total), deepest, depths / static_cast<double>(total),
    widest, outside, resets);
  bool good = Check("greatest penetration, mm", deepest, MostPenetration);
  good &= Check("mean penetration, mm", depths / static_cast<double>(total), MostMeanPenetration);
  good &= Check("greatest gap of a joint, mm", widest, MostGap);
  good &= Check("samples put back into the lumen", static_cast<double>(outside), MostOutside);
  good &= Check("resets", static_cast<double>(resets), MostResets);
  return good ? 0 : 1;
}
