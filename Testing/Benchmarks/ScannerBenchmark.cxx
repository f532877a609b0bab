// What the parts of a simulated CT scan cost, on one core: a map of the anatomy, the rays of a view, its
// intensities, its noise, its filter, and back-projection. Full size; DYNAMICCORONARY_COARSE divides it.
#include "CtScanner.h"
#include "ScannerReconstruction.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>

namespace
{
using namespace coronary;

int Coarse()
{
  const char* text = std::getenv("DYNAMICCORONARY_COARSE");
  return text != nullptr ? std::max(1, std::atoi(text)) : 1;
}

ScannerSettings Settings()
{
  ScannerSettings settings = ScannerPreset("single-350");
  const int coarse = Coarse();
  settings.channels /= coarse;
  settings.channelPitch *= coarse;
  settings.rows /= coarse;
  settings.rowPitch *= coarse;
  settings.anatomySpacing *= coarse;
  return settings;
}

/// The phantom in the scanner, and one view of it.
struct Scene
{
  Scene()
    : phantom(PhantomSettings())
    , anatomy(phantom)
    , settings(Settings())
    , patient(anatomy, settings)
    , physics(settings)
  {
    SetNumberOfThreads(1);
    state.phase = 0.4;
    const CoronaryPhantom::Box body = anatomy.Body();
    view.angle = 0.7;
    view.axis = 0.5 * (body.low + body.high);
    view.axis[2] = -20.0;
    patient.Prepare(state, view.axis[2]);
    patient.Project(view, state, paths);
    physics.Transmit(paths, transmitted);
    line.resize(paths[0].size());
    physics.Detect(transmitted, 1.0, 5, line.data());
  }

  const CoronaryPhantom phantom;
  const ScannedPhantom anatomy;
  const ScannerSettings settings;
  ScannedPatient patient;
  const ScannerPhysics physics;
  PatientState state;
  ScannerView view;
  ViewPaths paths;
  TransmittedView transmitted;
  std::vector<float> line;
};

Scene& TheScene()
{
  static Scene scene;
  return scene;
}

void Map(benchmark::State& state)
{
  Scene& scene = TheScene();
  for (auto _ : state)
  {
    scene.patient.Prepare(scene.state, scene.view.axis[2]);
  }
}
BENCHMARK(Map)->Unit(benchmark::kMillisecond);

void Project(benchmark::State& state)
{
  const Scene& scene = TheScene();
  ViewPaths paths;
  for (auto _ : state)
  {
    scene.patient.Project(scene.view, scene.state, paths);
    benchmark::DoNotOptimize(paths[0].data());
  }
}
BENCHMARK(Project)->Unit(benchmark::kMillisecond);

void Transmit(benchmark::State& state)
{
  const Scene& scene = TheScene();
  TransmittedView transmitted;
  for (auto _ : state)
  {
    scene.physics.Transmit(scene.paths, transmitted);
    benchmark::DoNotOptimize(transmitted.share.data());
  }
}
BENCHMARK(Transmit)->Unit(benchmark::kMillisecond);

void Detect(benchmark::State& state)
{
  const Scene& scene = TheScene();
  std::vector<float> line(scene.line.size());
  for (auto _ : state)
  {
    scene.physics.Detect(scene.transmitted, 1.0, 5, line.data());
    benchmark::DoNotOptimize(line.data());
  }
}
BENCHMARK(Detect)->Unit(benchmark::kMillisecond);

/// Slices of a heart in a field of `size` pixels of 0.35 mm.
ImageGrid Slices(const Scene& scene, int size)
{
  ImageGrid grid;
  grid.extent = { 0, size - 1, 0, size - 1, 0, 63 };
  grid.spacing = Vector3(0.35 * Coarse(), 0.35 * Coarse(), 0.6);
  grid.origin = scene.view.axis -
    0.5 * Vector3(grid.spacing[0] * size, grid.spacing[1] * size, grid.spacing[2] * 64.0);
  return grid;
}

void Filter(benchmark::State& state)
{
  const Scene& scene = TheScene();
  const HalfScanReconstruction reconstruction(scene.settings, ReconstructionKernel::Standard);
  const auto columns = reconstruction.Columns(scene.view.axis, Slices(scene, 512 / Coarse()));
  std::vector<float> result(scene.line.size());
  for (auto _ : state)
  {
    reconstruction.Filter(100, 1.0f, scene.line.data(), columns, result.data());
    benchmark::DoNotOptimize(result.data());
  }
}
BENCHMARK(Filter)->Unit(benchmark::kMillisecond);

/// Time of a view and slab.
void BackProject(benchmark::State& state)
{
  const Scene& scene = TheScene();
  const HalfScanReconstruction reconstruction(scene.settings, ReconstructionKernel::Standard);
  const ImageGrid grid = Slices(scene, 512 / Coarse());
  std::vector<float> values(
    static_cast<std::size_t>(grid.extent[1] + 1) * (grid.extent[3] + 1) * 64);
  constexpr int views = 8;
  std::vector<FilteredView> filtered;
  for (int v = 0; v < views; ++v)
  {
    filtered.push_back({ 0.4 * v, scene.view.axis[2], scene.line });
  }
  for (auto _ : state)
  {
    reconstruction.BackProject(filtered, scene.view.axis, grid, values.data(), {});
    benchmark::DoNotOptimize(values.data());
  }
  state.counters["voxels"] = benchmark::Counter(
    static_cast<double>(values.size()) * views, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(BackProject)->Unit(benchmark::kMillisecond);
}

BENCHMARK_MAIN();
