// X-ray images: the radiograph of a body, a wire, contrast medium in a coronary tree. 512 x 512 pixels. Time is the
// processor's, of one thread, but for RadiographOnAllThreads.
#include "Attenuation.h"
#include "CArm.h"
#include "ContrastProjector.h"
#include "CounterRandom.h"
#include "ExposureControl.h"
#include "InstrumentProjector.h"
#include "MovingParts.h"
#include "ParallelFor.h"
#include "VolumeProjector.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

using namespace coronary;

namespace
{
constexpr double Degrees = 3.14159265358979323846 / 180.0;

CArmGeometry Geometry(double lao, double cranial, int size)
{
  CArmPose pose;
  pose.primary = lao * Degrees;
  pose.secondary = cranial * Degrees;
  return { pose, { size, size, 200.0, 200.0 } };
}

// 360 x 260 x 320 mm at 1.5 mm: an elliptic cylinder of tissue in air, with two lungs and a spine.
std::shared_ptr<const VolumeProjector> Thorax()
{
  static const auto projector = []
  {
    constexpr int n[3] = { 240, 174, 214 };
    std::vector<std::int16_t> values;
    for (int k = 0; k < n[2]; ++k)
    {
      for (int j = 0; j < n[1]; ++j)
      {
        for (int i = 0; i < n[0]; ++i)
        {
          const Vector3 p = 1.5 * Vector3(i - 119.5, j - 86.5, k - 106.5);
          const auto within = [&](const Vector3& centre, const Vector3& radii)
          { return (p - centre).cwiseQuotient(radii).squaredNorm() < 1.0; };
          double value = std::hypot(p.x() / 170.0, p.y() / 115.0) < 1.0 ? 40.0 : -1000.0;
          for (const double side : { -1.0, 1.0 })
          {
            value = within({ side * 85.0, 0.0, 0.0 }, { 60.0, 85.0, 130.0 }) ? -800.0 : value;
          }
          value = std::hypot(p.x(), p.y() - 75.0) < 18.0 ? 400.0 : value;
          values.push_back(static_cast<std::int16_t>(value));
        }
      }
    }
    ScalarImage image;
    image.values = values.data();
    image.grid.extent = { 0, n[0] - 1, 0, n[1] - 1, 0, n[2] - 1 };
    image.grid.spacing = Vector3::Constant(1.5);
    image.grid.origin = -1.5 * Vector3(119.5, 86.5, 106.5);
    const Attenuation attenuation;
    return std::make_shared<const VolumeProjector>(
      image, [&](double hu) { return attenuation.OfHounsfield(hu); });
  }();
  return projector;
}

void Project(benchmark::State& state, int threads)
{
  const auto projector = Thorax();
  const CArmGeometry geometry = Geometry(state.range(1), state.range(2), state.range(0));
  SetNumberOfThreads(threads);
  for (auto _ : state)
  {
    benchmark::DoNotOptimize(projector->Project(geometry).values.data());
  }
  SetNumberOfThreads(0);
}

void Radiograph(benchmark::State& state)
{
  Project(state, 1);
}
BENCHMARK(Radiograph)
  ->ArgNames({ "size", "lao", "cranial" })
  ->Args({ 512, 0, 0 })
  ->Args({ 512, 45, 20 })
  ->Args({ 512, 90, 0 })
  ->Args({ 512, -30, -30 })
  ->Args({ 128, 30, 20 })
  ->Unit(benchmark::kMillisecond);

void RadiographOnAllThreads(benchmark::State& state)
{
  Project(state, 0);
}
BENCHMARK(RadiographOnAllThreads)
  ->ArgNames({ "size", "lao", "cranial" })
  ->Args({ 512, 45, 20 })
  ->UseRealTime()
  ->Unit(benchmark::kMillisecond);

// What the exposure control asks of the physics thread when the C-arm has moved.
void ExposureOfView(benchmark::State& state)
{
  const ExposureControl control(Thorax(), 0.0206);
  CArmPose pose;
  for (auto _ : state)
  {
    pose.primary = pose.primary > 0.8 ? -0.8 : pose.primary + 0.01;
    benchmark::DoNotOptimize(control.Of(pose, {}).kerma);
  }
}
BENCHMARK(ExposureOfView)->Unit(benchmark::kMicrosecond);

// The shadow of heart or diaphragm in every image.
void MovedPart(benchmark::State& state)
{
  const CArmGeometry geometry = Geometry(-30, 20, 512);
  const LineIntegrals part(512, 512);
  LineIntegrals image(512, 512);
  AffineMotion motion;
  motion.linear *= 0.95;
  motion.shift = { 1.0, -2.0, -6.0 };
  for (auto _ : state)
  {
    AddMotion(part, geometry, Vector3::Zero(), motion, image);
    benchmark::DoNotOptimize(image.values.data());
  }
}
BENCHMARK(MovedPart)->Unit(benchmark::kMicrosecond);

// A wire of 0.36 mm that winds through the field of view.
InstrumentChain Wire(int segments)
{
  InstrumentChain wire;
  for (int k = 0; k <= segments; ++k)
  {
    const double t = static_cast<double>(k) / segments;
    wire.points.emplace_back(50.0 * std::cos(9.0 * t), 40.0 * std::sin(7.0 * t), 110.0 * (t - 0.5));
  }
  wire.segments.assign(segments, { 0.18, 0.0, 0.9 });
  return wire;
}

// Vessels of 3 to 1 mm across on a heart, together with so many slabs of 0.5 mm.
std::vector<ContrastBranch> Tree(int slabs)
{
  constexpr int perBranch = 200;
  std::vector<ContrastBranch> branches;
  RandomStream random(1);
  for (int b = 0; b * perBranch < slabs; ++b)
  {
    ContrastBranch branch;
    const double start = random.Uniform(0.0, 6.28);
    const double turn = random.Uniform(-2.0, 2.0);
    for (int k = 0; k <= perBranch; ++k)
    {
      const double t = static_cast<double>(k) / perBranch;
      const double down = 0.4 + 2.0 * t;
      const double angle = start + turn * t;
      branch.points.emplace_back(45.0 * std::sin(down) * std::cos(angle),
        40.0 * std::sin(down) * std::sin(angle), 50.0 * std::cos(down));
      branch.radii.push_back(1.5 - t);
    }
    for (int k = 0; k < perBranch; ++k)
    {
      branch.concentrations.push_back(1.0 - 0.003 * k);
    }
    branches.push_back(branch);
  }
  return branches;
}

std::vector<ContrastBlush> Clouds(int count)
{
  RandomStream random(2);
  std::vector<ContrastBlush> clouds;
  for (int k = 0; k < count; ++k)
  {
    clouds.push_back(
      { { random.Uniform(-40.0, 40.0), random.Uniform(-40.0, 40.0), random.Uniform(-40.0, 40.0) },
        0.02, 5.0 });
  }
  return clouds;
}

void WireSegments(benchmark::State& state)
{
  const CArmGeometry geometry = Geometry(-30, 20, 512);
  const InstrumentChain wire = Wire(static_cast<int>(state.range(0)));
  LineIntegrals image(512, 512);
  for (auto _ : state)
  {
    AddInstrument(wire, geometry, image);
  }
}
BENCHMARK(WireSegments)->ArgName("segments")->Arg(150)->Unit(benchmark::kMicrosecond);

void ContrastSlabs(benchmark::State& state)
{
  const CArmGeometry geometry = Geometry(-30, 20, 512);
  const std::vector<ContrastBranch> tree = Tree(static_cast<int>(state.range(0)));
  LineIntegrals image(512, 512);
  for (auto _ : state)
  {
    AddContrast(tree, 0.287, geometry, image);
  }
}
BENCHMARK(ContrastSlabs)->ArgName("slabs")->Arg(2000)->Unit(benchmark::kMicrosecond);

void BlushClouds(benchmark::State& state)
{
  const CArmGeometry geometry = Geometry(-30, 20, 512);
  const std::vector<ContrastBlush> clouds = Clouds(static_cast<int>(state.range(0)));
  LineIntegrals image(512, 512);
  for (auto _ : state)
  {
    AddBlush(clouds, 0.287, geometry, image);
  }
}
BENCHMARK(BlushClouds)->ArgName("clouds")->Arg(100)->Unit(benchmark::kMicrosecond);

// What is new in every image: background copied, wire, vessels, blush.
void MovingLayers(benchmark::State& state)
{
  const CArmGeometry geometry = Geometry(-30, 20, 512);
  const InstrumentChain wire = Wire(150);
  const std::vector<ContrastBranch> tree = Tree(2000);
  const std::vector<ContrastBlush> clouds = Clouds(50);
  const LineIntegrals background(512, 512);
  LineIntegrals image = background;
  for (auto _ : state)
  {
    image.values = background.values;
    AddInstrument(wire, geometry, image);
    AddContrast(tree, 0.287, geometry, image);
    AddBlush(clouds, 0.287, geometry, image);
    benchmark::DoNotOptimize(image.values.data());
  }
}
BENCHMARK(MovingLayers)->Unit(benchmark::kMicrosecond);
}

BENCHMARK_MAIN();
