// Centerlines beside ITK's fast marching in the same run: time and memory. Tables in Markdown.

#include "BenchmarkTables.h"
#include "CenterlineExtraction.h"
#include "CoronaryOstia.h"
#include "CoronaryPhantom.h"
#include "FastMarching.h"
#include "MeasuredProcess.h"
#include "MultiscaleVesselness.h"
#include "SurfaceDistance.h"
#include "VesselSegmentation.h"
#include "VoxelRegion.h"
#if defined(DYNAMICCORONARY_WITH_ITK)
#include "ItkFastMarching.h"
#endif

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

#if defined(DYNAMICCORONARY_WITH_ITK)
constexpr bool HasItk = true;
#else
constexpr bool HasItk = false;
#endif

// What has to be reached.
constexpr double MinimumSpeedUp = 8.0;
constexpr double MostBytesPerVoxel = 24.0;
constexpr double MostTreeSeconds = 2.0;
constexpr double MostSurfaceSeconds = 3.0;
constexpr double MaximumMeanDifference = 0.02; // of arrival, relative, both of first order
constexpr double Rest = 0.75;

const std::vector<std::string> AllTables = { "marching", "tree", "surface" };

/// A phase of the phantom around the heart's middle, with what comes before the centerlines.
struct Phase
{
  explicit Phase(std::size_t voxels)
    : values(voxels)
    , vesselness(voxels)
    , mask(voxels)
    , seeds(6)
    , count(1) // zero, in fresh memory
  {
  }
  ImageGrid grid;
  SharedArray<std::int16_t> values;
  SharedArray<float> vesselness;
  SharedArray<unsigned char> mask;
  SharedArray<double> seeds;
  SharedArray<int> count;
};

std::unique_ptr<Phase> MakePhase(const BenchmarkOptions& options)
{
  const int n = options.size;
  auto phase = std::make_unique<Phase>(static_cast<std::size_t>(n) * n * n);
  phase->grid.extent = { 0, n - 1, 0, n - 1, 0, n - 1 };
  phase->grid.spacing = Vector3::Constant(0.4 * 256.0 / n);
  PhantomSettings settings;
  settings.seed = options.seed;
  const CoronaryPhantom phantom(settings);
  const ImageGrid around = phantom.DefaultGrid(1.0);
  const std::array<int, 6>& e = around.extent;
  phase->grid.origin =
    around.IndexToWorld(0.5 * (e[0] + e[1]), 0.5 * (e[2] + e[3]), 0.5 * (e[4] + e[5])) -
    0.5 * (n - 1) * phase->grid.spacing;
  MeasureInChild([] {},
    [&]
    {
      SetNumberOfThreads(options.threads);
      phantom.Render(phase->grid, phase->grid.extent, Rest, phase->values.data());
      std::vector<VesselSeed> seeds;
      for (const PhantomOstium& ostium : phantom.Ostia(Rest))
      {
        const auto first = 3 * static_cast<std::size_t>(phase->count[0]++);
        for (std::size_t axis = 0; axis < 3; ++axis)
        {
          phase->seeds[first + axis] = ostium.position[static_cast<Eigen::Index>(axis)];
        }
        seeds.push_back({ ostium.position, ostium.axis });
      }
      const std::vector<float> input(
        phase->values.data(), phase->values.data() + phase->values.size());
      VesselnessSettings frangi;
      frangi.sigmas = VesselnessScales(0.5, 2.5, 5, true);
      frangi.c = 100.0;
      MultiscaleVesselness(frangi, phase->grid.spacing, phase->grid.extent)
        .Compute({ input.data(), phase->grid.extent }, phase->grid.extent, nullptr,
          { phase->vesselness.data(), nullptr, nullptr });
      ScalarImage image;
      image.grid = phase->grid;
      image.values = static_cast<const std::int16_t*>(phase->values.data());
      const std::vector<unsigned char> mask =
        SegmentVessels(image, phase->vesselness.data(), seeds).mask;
      std::copy(mask.begin(), mask.end(), phase->mask.data());
    });
  return phase;
}

std::vector<Vector3> SeedsOf(const Phase& phase)
{
  std::vector<Vector3> seeds;
  for (int s = 0; s < phase.count[0]; ++s)
  {
    const auto first = 3 * static_cast<std::size_t>(s);
    seeds.emplace_back(phase.seeds[first], phase.seeds[first + 1], phase.seeds[first + 2]);
  }
  return seeds;
}

/// Both march over every voxel, in the same speed, from one ostium.
void TableMarching(const BenchmarkOptions& options, Verdicts& verdicts)
{
  const std::unique_ptr<Phase> phase = MakePhase(options);
  const std::size_t voxels = phase->values.size();
  const Vector3 seed = SeedsOf(*phase).front();
  const Vector3 place = (seed - phase->grid.origin).cwiseQuotient(phase->grid.spacing);
  const std::array<int, 3> index = { static_cast<int>(std::lround(place[0])),
    static_cast<int>(std::lround(place[1])), static_cast<int>(std::lround(place[2])) };
  const auto speed = [&]
  {
    std::vector<float> values(phase->vesselness.data(), phase->vesselness.data() + voxels);
    std::transform(values.begin(), values.end(), values.begin(),
      [](float vesselness) { return 0.05F + vesselness; });
    return values;
  };
  const SharedArray<float> ours(voxels);
  const auto run = [&](bool secondOrder, bool lengths)
  {
    std::vector<float> input;
    std::unique_ptr<VoxelRegion> region;
    std::unique_ptr<FastMarching> marching;
    const int n = options.size;
    return MeasureInChild(
      [&]
      {
        SetNumberOfThreads(options.threads);
        input = speed();
      },
      [&]
      {
        region = std::make_unique<VoxelRegion>(
          phase->grid.extent, [&](int, int, unsigned char* flags) { std::fill_n(flags, n, 1); });
        std::vector<float> members(region->Size());
        region->ForEach(
          [&](std::uint32_t number, VoxelRegion::Address address)
          {
            const std::array<int, 3> at = region->IndexOf(address);
            members[number] =
              input[(static_cast<std::size_t>(at[2]) * n + static_cast<std::size_t>(at[1])) * n +
                static_cast<std::size_t>(at[0])];
          });
        FastMarchingSettings settings;
        settings.spacing = phase->grid.spacing;
        settings.secondOrder = secondOrder;
        settings.lengths = lengths;
        marching = std::make_unique<FastMarching>(*region, std::move(members), settings);
        marching->March({ { Vector3(index[0], index[1], index[2]), 0 } });
      },
      [&]
      {
        region->ForEach(
          [&](std::uint32_t number, VoxelRegion::Address address)
          {
            const std::array<int, 3> at = region->IndexOf(address);
            ours[(static_cast<std::size_t>(at[2]) * n + static_cast<std::size_t>(at[1])) * n +
              static_cast<std::size_t>(at[0])] = marching->Arrival()[number];
          });
      });
  };
  std::printf("\n### Marching over all of %d x %d x %d voxels\n\nSpeed 0.05 + vesselness, one "
              "source, one thread each; our time includes the numbering of the region.\n\n| | "
              "wall time, s | processor time, s | peak above the input, bytes a voxel |\n"
              "|---|---|---|---|\n",
    options.size, options.size, options.size);
  const auto row = [&](const char* name, const std::vector<Measurement>& runs)
  {
    std::printf("| %s | %s | %s | %.1f |\n", name, Spread(Each(runs, Wall)).c_str(),
      Spread(Each(runs, Processor)).c_str(), PeakGrowth(runs) / static_cast<double>(voxels));
    std::fflush(stdout);
  };
  const std::vector<Measurement> first = Repeat(options, [&] { return run(false, false); });
  row("FastMarching, first order as ITK", first);
  const std::vector<float> firstArrival(ours.data(), ours.data() + voxels);
  const std::vector<Measurement> firstLengths = Repeat(options, [&] { return run(false, true); });
  row("first order, with path lengths", firstLengths);
  const std::vector<Measurement> second = Repeat(options, [&] { return run(true, true); });
  row("second order, with path lengths: what the filter does", second);
  std::vector<Measurement> itk;
#if defined(DYNAMICCORONARY_WITH_ITK)
  const SharedArray<float> theirs(voxels);
  if (!options.withoutPeer)
  {
    itk = Repeat(options,
      [&]
      {
        std::vector<float> input;
        std::shared_ptr<const float> result;
        const int n = options.size;
        return MeasureInChild([&] { input = speed(); },
          [&]
          {
            result = ItkFastMarching(input.data(), { n, n, n },
              { phase->grid.spacing[0], phase->grid.spacing[1], phase->grid.spacing[2] }, index);
          },
          [&] { std::copy_n(result.get(), voxels, theirs.data()); });
      });
    row("itk::FastMarchingImageFilter", itk);
  }
#endif
  std::printf("\n| | measured | target | |\n|---|---|---|---|\n");
  const double bytes = PeakGrowth(second) / static_cast<double>(voxels);
  const bool small = bytes <= MostBytesPerVoxel;
  verdicts.missedTarget |= !small;
  std::printf("| bytes a voxel, second order | %.1f | <= %.0f | %s |\n", bytes, MostBytesPerVoxel,
    Verdict(small));
  if (!itk.empty())
  {
    const auto ratio = [&](const char* name, const std::vector<Measurement>& runs, bool isTarget)
    {
      const double times = Median(Each(itk, Processor)) / Median(Each(runs, Processor));
      const bool met = times >= MinimumSpeedUp;
      verdicts.missedTarget |= isTarget && !met;
      std::printf("| ITK's processor time over ours, %s | %.1f | %s | %s |\n", name, times,
        isTarget ? ">= 8" : "", isTarget ? Verdict(met) : "");
    };
    ratio("first order", first, false);
    ratio("second order with lengths", second, true);
#if defined(DYNAMICCORONARY_WITH_ITK)
    double difference = 0.0;
    double sum = 0.0;
    for (std::size_t v = 0; v < voxels; ++v)
    {
      difference += std::abs(static_cast<double>(firstArrival[v]) - theirs[v]);
      sum += theirs[v];
    }
    const bool agree = difference / sum <= MaximumMeanDifference;
    verdicts.disagreement |= !agree;
    std::printf("| mean difference of arrival, both of first order | %.4f | <= %.2f | %s |\n",
      difference / sum, MaximumMeanDifference, Verdict(agree));
#endif
  }
}

void TableTree(const BenchmarkOptions& options, Verdicts& verdicts)
{
  const std::unique_ptr<Phase> phase = MakePhase(options);
  std::printf("\n### Both trees from %d x %d x %d voxels, vesselness and mask given\n\n| | wall "
              "time, s | processor time, s | branches | voxels of the region | bytes a voxel of "
              "the image |\n|---|---|---|---|---|---|\n",
    options.size, options.size, options.size);
  for (const bool within : { true, false })
  {
    const SharedArray<std::int64_t> seen(2);
    const std::vector<Measurement> runs = Repeat(options,
      [&]
      {
        CenterlineResult result;
        return MeasureInChild([&] { SetNumberOfThreads(options.threads); },
          [&]
          {
            ScalarImage image;
            image.grid = phase->grid;
            image.values = static_cast<const std::int16_t*>(phase->values.data());
            CenterlineInput input;
            input.grid = phase->grid;
            input.speed = phase->vesselness.data();
            input.mask = within ? phase->mask.data() : nullptr;
            input.intensity = &image;
            input.seeds = SeedsOf(*phase);
            result = ExtractCenterlines(input, {});
          },
          [&]
          {
            seen[0] = static_cast<std::int64_t>(result.tree.branches.size());
            seen[1] = result.regionVoxels;
          });
      });
    const bool met = Median(Each(runs, Wall)) <= MostTreeSeconds;
    verdicts.missedTarget |= within && !met;
    verdicts.disagreement |= seen[0] < 2;
    std::printf("| %s | %s %s | %s | %lld | %lld | %.2f |\n",
      within ? "in the mask" : "wherever there is vesselness", Spread(Each(runs, Wall)).c_str(),
      within ? Verdict(met) : "", Spread(Each(runs, Processor)).c_str(),
      static_cast<long long>(seen[0]), static_cast<long long>(seen[1]),
      PeakGrowth(runs) / static_cast<double>(phase->values.size()));
    std::fflush(stdout);
  }
  std::printf("\nTarget: at most %.0f s in the mask.\n", MostTreeSeconds);
}

/// A closed tube of 2.5 mm radius along two turns of a helix.
void MakeTube(int triangles, std::vector<Vector3>& points, std::vector<Triangle>& faces,
  Vector3& begin, Vector3& end)
{
  constexpr double radius = 2.5;
  constexpr int around = 64;
  const int along = triangles / (2 * around);
  const auto axis = [](double s)
  {
    const double angle = 4.0 * M_PI * s;
    return Vector3(25.0 * std::cos(angle), 25.0 * std::sin(angle), 60.0 * s);
  };
  for (int ring = 0; ring <= along; ++ring)
  {
    const double s = static_cast<double>(ring) / along;
    const Vector3 centre = axis(s);
    const Vector3 tangent = (axis(s + 1e-4) - axis(s - 1e-4)).normalized();
    const Vector3 v = tangent.cross(Vector3::UnitZ()).normalized();
    const Vector3 u = v.cross(tangent);
    for (int p = 0; p < around; ++p)
    {
      const double angle = 2.0 * M_PI * p / around;
      points.emplace_back(centre + radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
  }
  begin = axis(0.0);
  end = axis(1.0);
  for (int ring = 0; ring < along; ++ring)
  {
    for (int p = 0; p < around; ++p)
    {
      const std::int64_t a = static_cast<std::int64_t>(ring) * around + p;
      const std::int64_t b = static_cast<std::int64_t>(ring) * around + (p + 1) % around;
      faces.push_back({ a, b, a + around });
      faces.push_back({ b, b + around, a + around });
    }
  }
  const auto first = static_cast<std::int64_t>(points.size());
  points.push_back(begin);
  points.push_back(end);
  for (int p = 0; p < around; ++p)
  {
    const std::int64_t last = static_cast<std::int64_t>(along) * around;
    faces.push_back({ first, (p + 1) % around, p });
    faces.push_back({ first + 1, last + p, last + (p + 1) % around });
  }
}

void TableSurface(const BenchmarkOptions& options, Verdicts& verdicts)
{
  std::vector<Vector3> points;
  std::vector<Triangle> faces;
  Vector3 begin;
  Vector3 end;
  MakeTube(100000, points, faces, begin, end);
  const SharedArray<double> seen(2);
  const std::vector<Measurement> runs = Repeat(options,
    [&]
    {
      CenterlineResult result;
      return MeasureInChild([&] { SetNumberOfThreads(options.threads); },
        [&]
        {
          const SurfaceDistance distance = ComputeSurfaceDistance(points, faces);
          CenterlineInput input;
          input.grid = distance.grid;
          input.wallDistance = distance.values.data();
          input.seeds = { begin };
          result = ExtractCenterlines(input, {});
        },
        [&]
        {
          for (const VesselTree::Branch& branch : result.tree.branches)
          {
            seen[0] = std::max(seen[0], branch.length);
          }
          seen[1] = static_cast<double>(result.tree.branches.size());
        });
    });
  const double truth = std::hypot(2.0 * 2.0 * M_PI * 25.0, 60.0);
  const bool met = Median(Each(runs, Wall)) <= MostSurfaceSeconds;
  const bool whole = seen[1] == 1.0 && std::abs(seen[0] - truth) < 6.0;
  verdicts.missedTarget |= !met;
  verdicts.disagreement |= !whole;
  std::printf("\n### From a closed surface of %zu triangles: a tube of 2.5 mm radius on a helix\n\n"
              "| wall time, s | target | processor time, s | branches | length, mm | true length, "
              "mm |\n|---|---|---|---|---|---|\n| %s | <= %.0f %s | %s | %.0f | %.1f %s | %.1f |\n",
    faces.size(), Spread(Each(runs, Wall)).c_str(), MostSurfaceSeconds, Verdict(met),
    Spread(Each(runs, Processor)).c_str(), seen[1], seen[0], whole ? "" : "**wrong**", truth);
}

int Run(const BenchmarkOptions& options)
{
  Verdicts verdicts;
  std::printf("## Centerlines\n\n");
  PrintMachine(options);
  if (!HasItk || options.withoutPeer)
  {
    std::printf("The comparison with ITK is skipped: %s.\n",
      HasItk ? "as asked for" : "this program was built without ITK 5 (libinsighttoolkit5-dev)");
  }
  if (options.Has("marching"))
  {
    TableMarching(options, verdicts);
  }
  if (options.Has("tree"))
  {
    TableTree(options, verdicts);
  }
  if (options.Has("surface"))
  {
    TableSurface(options, verdicts);
  }
  return verdicts.ExitCode("centerline-benchmark", options.strict);
}

/// @return the exit code
int Start(int argc, char** argv)
{
  BenchmarkOptions options;
  CLI::App app("Time and memory of the centerlines, beside ITK's fast marching in the same run. "
               "Each measurement is a process of its own. Exit code 1 when results disagree.");
  app.add_option("--size", options.size, "Voxels along each side of the same field of view")
    ->check(CLI::Range(64, 1024))
    ->capture_default_str();
  options.AddTo(app, "itk", AllTables);
  CLI11_PARSE(app, argc, argv);
  return Run(options);
}
}

int main(int argc, char** argv)
{
  return coronary::RunBenchmark("centerline-benchmark", [&] { return Start(argc, argv); });
}
