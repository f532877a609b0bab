// What a frame of the image chain costs: background, instruments and contrast medium to 8 bits, on one core.
//
// The beam behind a chest: 0.5 to 130 photons a pixel in fluoroscopy, ten times that in cine.
#include "FluoroscopyImager.h"

#include <benchmark/benchmark.h>

#include <cmath>

namespace
{
using namespace coronary;

LineIntegrals Chest(int size)
{
  LineIntegrals image(size, size);
  for (int row = 0; row < size; ++row)
  {
    for (int column = 0; column < size; ++column)
    {
      const double x = 8.0 * column / size;
      const double y = 8.0 * row / size;
      image.values[static_cast<std::size_t>(row) * size + column] =
        static_cast<float>(4.2 + 1.2 * std::sin(x) * std::cos(y) + 0.3 * std::sin(9.0 * y));
    }
  }
  return image;
}

void Expose(benchmark::State& state, ImageMode mode, bool cine)
{
  const int size = static_cast<int>(state.range(0));
  const LineIntegrals background = Chest(size);
  const LineIntegrals instruments(size, size);
  const LineIntegrals contrast(size, size);
  FluoroscopyImager imager;
  imager.SetMode(mode);
  Exposure exposure;
  exposure.sequence = 1;
  exposure.cine = cine;
  exposure.run = cine ? 1 : 0;
  exposure.photons = cine ? 15000.0 : 2000.0;
  for (auto _ : state)
  {
    ++exposure.frame;
    benchmark::DoNotOptimize(
      imager.Expose(background, instruments, contrast, exposure).values.data());
  }
}

void Detect(benchmark::State& state, bool noise)
{
  const int size = static_cast<int>(state.range(0));
  const LineIntegrals background = Chest(size);
  DetectorSettings settings;
  settings.noise = noise;
  Detector detector(settings, 1);
  std::uint64_t frame = 0;
  for (auto _ : state)
  {
    benchmark::DoNotOptimize(
      detector.Expose(background, nullptr, nullptr, 2000.0, ++frame, 0.3).data());
  }
}
}

BENCHMARK_CAPTURE(Expose, fluoroscopy, coronary::ImageMode::Plain, false)
  ->Arg(512)
  ->Arg(1024)
  ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Expose, cine, coronary::ImageMode::Plain, true)
  ->Arg(512)
  ->Arg(1024)
  ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Expose, subtraction, coronary::ImageMode::Subtraction, false)
  ->Arg(512)
  ->Arg(1024)
  ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Detect, withNoise, true)->Arg(512)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Detect, withoutNoise, false)->Arg(512)->Unit(benchmark::kMillisecond);
BENCHMARK_MAIN();
