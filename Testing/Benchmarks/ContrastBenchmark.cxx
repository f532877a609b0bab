// A step of 5 ms of contrast medium in the standard phantom: 20,000 tracers in both trees, the network's flow alone, and
// what drawing asks for. Time is the processor's.
#include "ContrastModel.h"
#include "ContrastTestData.h"

#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

using namespace coronary;

namespace
{
const WallTopology& Phantom()
{
  static const WallTopology vessels = PhantomVessels({});
  return vessels;
}

int FirstRoot(const WallTopology& topology)
{
  for (std::size_t b = 0; b < topology.parent.size(); ++b)
  {
    if (topology.parent[b] < 0)
    {
      return static_cast<int>(b);
    }
  }
  return 0;
}

/// Injects until there are as many tracers as asked for, into a beating heart.
struct Filled
{
  explicit Filled(std::int64_t tracers)
    : tip{ FirstRoot(Phantom()), 0.0 }
    , model(Phantom(), Settings(tracers), 1)
  {
    while (this->model.NumberOfTracers() < tracers * 95 / 100)
    {
      this->Step();
    }
  }
  static ContrastSettings Settings(std::int64_t tracers)
  {
    ContrastSettings settings;
    settings.tracers.capacity = 2 * tracers;
    settings.tracers.volume = 1.2 / static_cast<double>(tracers);
    return settings;
  }
  void Step()
  {
    this->phase += 0.00625;
    // As much as keeps the number.
    const bool few = this->model.NumberOfTracers() < this->model.Tracers().Settings().capacity / 2;
    this->model.Step(0.005, this->phase, 75.0, few ? 3.0 : 0.0, this->tip);
  }
  CatheterTip tip;
  ContrastModel model;
  double phase = 0.0;
};

void Step(benchmark::State& state)
{
  Filled filled(state.range(0));
  for (auto _ : state)
  {
    filled.Step();
  }
  state.counters["tracers"] = static_cast<double>(filled.model.NumberOfTracers());
}
BENCHMARK(Step)->Arg(1000)->Arg(20000)->Unit(benchmark::kMicrosecond);

void FlowAlone(benchmark::State& state)
{
  CoronaryFlow flow(Phantom(), {});
  double phase = 0.0;
  for (auto _ : state)
  {
    flow.Step(0.005, phase += 0.00625, 75.0);
  }
  state.counters["segments"] = static_cast<double>(flow.Network().Segments().size());
}
BENCHMARK(FlowAlone)->Unit(benchmark::kMicrosecond);

void Calibrate(benchmark::State& state)
{
  for (auto _ : state)
  {
    benchmark::DoNotOptimize(CoronaryFlow(Phantom(), {}).TreeFlow(0));
  }
}
BENCHMARK(Calibrate)->Unit(benchmark::kMicrosecond);

void StepAndConcentration(benchmark::State& state)
{
  Filled filled(state.range(0));
  for (auto _ : state)
  {
    filled.Step();
    benchmark::DoNotOptimize(filled.model.Concentration().data());
  }
  state.counters["slabs"] = static_cast<double>(filled.model.Slabs().size());
}
BENCHMARK(StepAndConcentration)->Arg(20000)->Unit(benchmark::kMicrosecond);

void TracerPositions(benchmark::State& state)
{
  const Filled filled(state.range(0));
  std::vector<Vector3> axis;
  for (const std::vector<Vector3>& branch : Phantom().axis)
  {
    axis.insert(axis.end(), branch.begin(), branch.end());
  }
  std::vector<Vector3> positions;
  std::vector<float> volumes;
  for (auto _ : state)
  {
    filled.model.TracerPositions(axis, positions, volumes);
    benchmark::DoNotOptimize(positions.data());
  }
}
BENCHMARK(TracerPositions)->Arg(20000)->Unit(benchmark::kMicrosecond);
}

BENCHMARK_MAIN();
