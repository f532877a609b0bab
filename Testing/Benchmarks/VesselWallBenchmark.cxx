// What the moving wall costs: refit, normals, queries, contacts of samples near to it and far from it; and that the
// answers are those of a search through all triangles.
//
// One beat at 75 a minute, key frames every 33 ticks of 0.5 ms; 200 samples every 0.75 mm along a vessel, advancing
// by 20 mm/s. The wall is a winding tube of 38,000 triangles, or with DYNAMICCORONARY_PHANTOM the phantom's trees
// with edges of so many mm. DYNAMICCORONARY_QUERIES: places that are compared at each of 20 phases (100; 5000 for
// the whole check).

#include "BenchmarkLimits.h"
#include "TriangleBvh.h"
#include "VesselWall.h"
#include "WallMotions.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <iterator>
#include <memory>
#include <random>

namespace
{
using namespace coronary;

constexpr int Samples = 200;
constexpr int Ticks = 33;
constexpr double Tick = 0.0005;
constexpr int Frames = 48;
constexpr double Period = 0.8;

/// Of this thread, s: others that run do not count.
double ThreadTime()
{
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double FromEnvironment(const char* name, double otherwise)
{
  const char* wanted = std::getenv(name);
  return wanted ? std::atof(wanted) : otherwise;
}

/// 330 mm around the heart, radius 2 to 0.6 mm; the motion is a contraction with a twist of up to 120 mm/s.
std::shared_ptr<WallMotion> WindingTube()
{
  constexpr int around = 20;
  constexpr int along = 950;
  constexpr double step = 330.0 / along;
  const auto axis = [](double s)
  {
    const double angle = s / 40.0;
    return Vector3(
      40.0 * std::cos(angle), 40.0 * std::sin(angle), 0.15 * s + 3.0 * std::sin(0.1 * s));
  };
  WallTopology topology;
  topology.axis.resize(1);
  topology.axisRadius.resize(1);
  topology.parent = { -1 };
  std::vector<Vector3> rest;
  for (int j = 0; j <= along; ++j)
  {
    const double s = step * j;
    const double radius = 2.0 - 1.4 * s / 330.0;
    const Vector3 forward = (axis(s + 0.01) - axis(s - 0.01)).normalized();
    const Vector3 first = forward.cross(Vector3::UnitZ()).normalized();
    const Vector3 second = forward.cross(first);
    topology.axis[0].push_back(axis(s));
    topology.axisRadius[0].push_back(radius);
    for (int i = 0; i < around; ++i)
    {
      const double angle = 2.0 * M_PI * (i + 0.5 * (j % 2)) / around;
      rest.push_back(axis(s) + radius * (std::cos(angle) * first + std::sin(angle) * second));
    }
  }
  const auto at = [](int j, int i) { return static_cast<std::int64_t>(j) * around + i % around; };
  for (int j = 0; j < along; ++j)
  {
    for (int i = 0; i < around; ++i)
    {
      const int odd = j % 2;
      topology.triangles.push_back({ at(j, i), at(j, i + 1), at(j + 1, i + odd) });
      topology.triangles.push_back({ at(j, i + 1 - odd), at(j + 1, i + 1), at(j + 1, i) });
    }
  }
  topology.entity.assign(topology.triangles.size(), 1);
  for (const int end : { 0, along })
  {
    const auto centre = static_cast<std::int64_t>(rest.size());
    rest.push_back(axis(step * end));
    for (int i = 0; i < around; ++i)
    {
      topology.triangles.push_back(end == 0 ? Triangle{ centre, at(end, i + 1), at(end, i) }
                                            : Triangle{ centre, at(end, i), at(end, i + 1) });
      topology.entity.push_back(end == 0 ? 2 : 3);
    }
  }
  topology.points = static_cast<std::int64_t>(rest.size());
  topology.group.assign(rest.size(), 0);
  std::vector<double> phases;
  std::vector<std::vector<Vector3>> points;
  std::vector<std::vector<Vector3>> lines;
  for (int k = 0; k < 20; ++k)
  {
    phases.push_back(k / 20.0);
    const double s = 0.5 - 0.5 * std::cos(2.0 * M_PI * phases.back());
    const auto beat = [s](const Vector3& p)
    {
      return Vector3(Eigen::AngleAxisd(0.002 * s * p[2], Vector3::UnitZ()) *
          Vector3((1.0 - 0.2 * s) * p[0], (1.0 - 0.2 * s) * p[1], (1.0 - 0.15 * s) * p[2]) +
        Vector3(2.0, -1.0, 20.0) * s);
    };
    points.emplace_back();
    lines.emplace_back();
    std::transform(rest.begin(), rest.end(), std::back_inserter(points.back()), beat);
    std::transform(
      topology.axis[0].begin(), topology.axis[0].end(), std::back_inserter(lines.back()), beat);
  }
  return std::make_shared<SampledWallMotion>(std::move(topology), phases, points, lines);
}

const std::shared_ptr<WallMotion>& Wall()
{
  static const double edge = FromEnvironment("DYNAMICCORONARY_PHANTOM", 0.0);
  static const std::shared_ptr<WallMotion> wall =
    edge > 0.0 ? MakePhantomWallMotion({}, edge, 20) : WindingTube();
  return wall;
}

std::vector<Vector3> At(int frame)
{
  std::vector<Vector3> points;
  Wall()->Positions(frame * Ticks * Tick / Period, points);
  return points;
}

/// Two key frames on.
VesselWall Fresh(const VesselWallSettings& settings = {})
{
  VesselWall wall(Wall()->Topology(), At(-1), settings);
  wall.BeginFrame(At(0), Ticks * Tick);
  return wall;
}

/// Branches from a root to the far end of the longest way.
std::vector<int> LongestPath()
{
  const WallTopology& topology = Wall()->Topology();
  std::vector<int> best;
  double bestLength = 0.0;
  for (int b = 0; b < static_cast<int>(topology.axis.size()); ++b)
  {
    std::vector<int> way;
    double length = 0.0;
    for (int c = b; c >= 0; c = topology.parent[c])
    {
      way.insert(way.begin(), c);
      for (std::size_t i = 1; i < topology.axis[c].size(); ++i)
      {
        length += (topology.axis[c][i] - topology.axis[c][i - 1]).norm();
      }
    }
    if (length > bestLength)
    {
      bestLength = length;
      best = way;
    }
  }
  return best;
}

/// Centres of all samples at every tick of a beat; `aside`: the share of the way from the axis to where the wire
/// of 0.18 mm touches the wall.
const std::vector<std::vector<Vector3>>& Centres(double aside)
{
  static std::vector<std::vector<Vector3>> all[2];
  std::vector<std::vector<Vector3>>& centres = all[aside > 0.0 ? 1 : 0];
  if (!centres.empty())
  {
    return centres;
  }
  const WallTopology& topology = Wall()->Topology();
  std::vector<std::size_t> begin{ 0 };
  for (const std::vector<Vector3>& line : topology.axis)
  {
    begin.push_back(begin.back() + line.size());
  }
  std::vector<std::size_t> places;
  std::vector<double> radius;
  std::vector<Vector3> rest;
  for (const int b : LongestPath())
  {
    for (std::size_t i = 1; i < topology.axis[b].size(); ++i)
    {
      places.push_back(begin[b] + i);
      radius.push_back(topology.axisRadius[b][i]);
      rest.push_back(topology.axis[b][i]);
    }
  }
  std::vector<Vector3> axis[2];
  for (int frame = 0; frame < Frames; ++frame)
  {
    Wall()->AxisPositions(frame * Ticks * Tick / Period, axis[0]);
    Wall()->AxisPositions((frame + 1) * Ticks * Tick / Period, axis[1]);
    for (int tick = 0; tick < Ticks; ++tick)
    {
      const double f = static_cast<double>(tick) / Ticks;
      const auto at = [&](std::size_t i)
      { return Vector3((1.0 - f) * axis[0][places[i]] + f * axis[1][places[i]]); };
      // The tube gets thinner by a fifth, too.
      const double phase = (frame + f) * Ticks * Tick / Period;
      const double shrunk = std::getenv("DYNAMICCORONARY_PHANTOM") != nullptr
        ? 1.0
        : 1.0 - 0.19 * (0.5 - 0.5 * std::cos(2.0 * M_PI * phase));
      std::vector<Vector3> now;
      double along = 5.0 + 20.0 * Tick * (frame * Ticks + tick);
      double length = 0.0;
      for (std::size_t i = 0; i + 1 < places.size() && now.size() < Samples; ++i)
      {
        const Vector3 from = at(i);
        const Vector3 step = at(i + 1) - from;
        // The vessel takes the wire with it when it gets shorter.
        const double restStep = (rest[i + 1] - rest[i]).norm();
        for (; along < length + restStep && now.size() < Samples; along += 0.75)
        {
          const double share = (along - length) / restStep;
          const Vector3 beside = step.cross(Vector3(0.3, 0.5, 0.8)).normalized();
          const double r = radius[i] + share * (radius[i + 1] - radius[i]);
          now.emplace_back(from + share * step + aside * (shrunk * r - 0.18) * beside);
        }
        length += restStep;
      }
      centres.push_back(std::move(now));
    }
  }
  return centres;
}

void Refit(benchmark::State& state)
{
  VesselWall wall = Fresh();
  const std::vector<Vector3> points[2] = { At(1), At(2) };
  int i = 0;
  for (auto _ : state)
  {
    wall.BeginFrame(points[i++ & 1], Ticks * Tick);
  }
  state.counters["triangles"] = static_cast<double>(Wall()->Topology().triangles.size());
  state.counters["points"] = static_cast<double>(Wall()->Topology().points);
}
BENCHMARK(Refit)->Unit(benchmark::kMicrosecond);

/// A refit, and all vertex normals of the new key frame; Find makes only those that it needs.
void AllNormals(benchmark::State& state)
{
  VesselWall wall = Fresh();
  const std::vector<Vector3> points[2] = { At(1), At(2) };
  int i = 0;
  for (auto _ : state)
  {
    wall.BeginFrame(points[i++ & 1], Ticks * Tick);
    benchmark::DoNotOptimize(wall.Normals().data());
  }
}
BENCHMARK(AllNormals)->Unit(benchmark::kMicrosecond);

void Positions(benchmark::State& state)
{
  std::vector<Vector3> points;
  double phase = 0.0;
  for (auto _ : state)
  {
    Wall()->Positions(phase += 0.02063, points);
    benchmark::DoNotOptimize(points.data());
  }
}
BENCHMARK(Positions)->Unit(benchmark::kMicrosecond);

void Build(benchmark::State& state)
{
  const std::vector<Vector3> points = At(0);
  for (auto _ : state)
  {
    const VesselWall wall(Wall()->Topology(), points);
    benchmark::DoNotOptimize(&wall);
  }
}
BENCHMARK(Build)->Unit(benchmark::kMillisecond);

void Closest(benchmark::State& state)
{
  VesselWall wall = Fresh();
  wall.BeginFrame(At(1), Ticks * Tick);
  wall.SetTime(0.4 * Ticks * Tick);
  const std::vector<Vector3>& centres = Centres(1.0)[13];
  std::size_t i = 0;
  for (auto _ : state)
  {
    benchmark::DoNotOptimize(wall.Closest(centres[i++ % centres.size()]));
  }
}
BENCHMARK(Closest);

/// A beat of contacts. Time is that of a single call of Find, on average; `worst tick` of all samples in one tick.
void Find(benchmark::State& state)
{
  const bool near = state.range(0) != 0;
  const bool outside = state.range(1) != 0;
  const std::vector<std::vector<Vector3>>& centres = Centres(near ? 1.0 : 0.0);
  std::vector<std::vector<Vector3>> points;
  for (int frame = 0; frame <= Frames; ++frame)
  {
    points.push_back(At(frame));
  }
  VesselWall wall = Fresh();
  std::uint64_t calls = 0;
  std::uint64_t planes = 0;
  std::uint64_t double_ = 0;
  double worst = 0.0;
  std::uint64_t begin = 0;
  for (auto _ : state)
  {
    begin = wall.NumberOfSearches();
    calls = planes = double_ = 0;
    worst = 0.0;
    double seconds = 0.0;
    for (int frame = 0; frame < Frames; ++frame)
    {
      wall.BeginFrame(points[frame + 1], Ticks * Tick);
      for (int tick = 0; tick < Ticks; ++tick)
      {
        const std::vector<Vector3>& now = centres[static_cast<std::size_t>(frame) * Ticks + tick];
        const double start = ThreadTime();
        wall.SetTime(tick * Tick);
        SampleContacts contacts;
        for (std::size_t i = 0; i < now.size(); ++i)
        {
          const ContactSample sample{ static_cast<std::int64_t>(i), now[i], 0.18, 0.1 };
          wall.Find(sample, 0.15, contacts);
          planes += contacts.count;
          double_ += contacts.count == 2;
          if (outside)
          {
            WallPlace place;
            benchmark::DoNotOptimize(wall.Outside(sample, place));
          }
        }
        calls += now.size();
        const double tickSeconds = ThreadTime() - start;
        seconds += tickSeconds;
        if (frame > 0)
        {
          worst = std::max(worst, tickSeconds);
        }
      }
    }
    state.SetIterationTime(seconds / static_cast<double>(calls));
  }
  state.counters["planes/call"] = static_cast<double>(planes) / static_cast<double>(calls);
  state.counters["two planes/call"] = static_cast<double>(double_) / static_cast<double>(calls);
  state.counters["searches/call"] =
    static_cast<double>(wall.NumberOfSearches() - begin) / static_cast<double>(calls);
  state.counters["worst tick us"] = 1e6 * worst;
}
BENCHMARK(Find)
  ->ArgNames({ "near", "outside" })
  ->Args({ 1, 0 })
  ->Args({ 1, 1 })
  ->Args({ 0, 0 })
  ->UseManualTime()
  ->Iterations(5);

/// Not of time: the greatest difference to a search through all triangles, mm, and ranges that differ.
void Exactness(benchmark::State& state)
{
  const int queries = static_cast<int>(FromEnvironment("DYNAMICCORONARY_QUERIES", 100));
  double worst = 0.0;
  double ranges = 0.0;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  const std::vector<Triangle>& triangles = Wall()->Topology().triangles;
  for (auto _ : state)
  {
    VesselWall wall = Fresh();
    for (int phase = 0; phase < 20; ++phase)
    {
      std::vector<Vector3> next;
      Wall()->Positions(phase / 20.0, next);
      wall.BeginFrame(next, 0.04);
      wall.SetTime(0.04 * unit(random));
      const std::vector<Vector3> points = wall.Points();
      std::vector<std::int64_t> found;
      for (int q = 0; q < queries; ++q)
      {
        const double spread = q % 3 == 0 ? 20.0 : q % 3 == 1 ? 2.0 : 0.3;
        const Vector3 p = points[static_cast<std::size_t>(unit(random) * points.size())] +
          spread * Vector3(normal(random), normal(random), normal(random));
        const double range = std::abs(normal(random));
        double best = std::numeric_limits<double>::infinity();
        std::vector<std::int64_t> within;
        for (std::size_t t = 0; t < triangles.size(); ++t)
        {
          const Vector3& a = points[triangles[t][0]];
          // What is clearly further than the best one and the range needs no look.
          const double minimum = (a - p).norm() -
            std::max((points[triangles[t][1]] - a).norm(), (points[triangles[t][2]] - a).norm());
          if (minimum > best + 1e-6 && minimum > range + 1e-6)
          {
            continue;
          }
          const double distance =
            std::sqrt(NearestOnTriangle(p, a, points[triangles[t][1]], points[triangles[t][2]])
                        .squaredDistance);
          best = std::min(best, distance);
          if (distance <= range)
          {
            within.push_back(static_cast<std::int64_t>(t));
          }
        }
        worst = std::max(worst, std::abs(std::abs(wall.Closest(p).distance) - best));
        wall.Within(p, range, found);
        ranges += found != within;
      }
    }
  }
  state.counters["queries"] = 20.0 * queries;
  state.counters["worst mm"] = worst;
  state.counters["ranges that differ"] = ranges;
}
BENCHMARK(Exactness)->Unit(benchmark::kSecond)->Iterations(1);
}

/// --strict: for what is to be followed in real time.
int main(int argc, char** argv)
{
  return coronary::RunBenchmarks(argc, argv, { { "Refit", 500.0 } });
}
