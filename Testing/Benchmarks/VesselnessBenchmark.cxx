// Our vesselness beside ITK's in the same run: time, memory, agreement. Tables in Markdown.

#include "BenchmarkTables.h"
#include "CoronaryPhantom.h"
#include "KernelChoice.h"
#include "MeasuredProcess.h"
#include "MultiscaleVesselness.h"
#include "ReferenceVesselness.h"
#include "VesselnessKernels.h"
#include "vtkFrangiVesselness.h"
#if defined(DYNAMICCORONARY_WITH_ITK)
#include "ItkVesselness.h"
#endif

#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkShortArray.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
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
constexpr double MinimumSpeedUp = 15.0;
constexpr double MostBytesPerVoxel = 16.0;
constexpr double MostClinicalSeconds = 20.0;
constexpr double MostClinicalMemory = 1.5e9;
constexpr double MinimumCorrelation = 0.999;
constexpr double MaximumReferenceError = 1e-3;
constexpr double MinimumReferenceCorrelation = 0.9999;

const std::vector<std::string> AllTables = { "itk", "clinical", "methods", "scales", "instructions",
  "agreement" };

struct Options : BenchmarkOptions
{
  int agreementSize = 128;
  std::vector<int> clinicalSize = { 512, 512, 220 };
};

// ---------------------------------------------------------------------------------------------
// Images
// ---------------------------------------------------------------------------------------------

using Dimensions = std::array<int, 3>;

std::size_t CountOf(const Dimensions& n)
{
  return static_cast<std::size_t>(n[0]) * n[1] * n[2];
}

std::array<int, 6> ExtentOf(const Dimensions& n)
{
  return { 0, n[0] - 1, 0, n[1] - 1, 0, n[2] - 1 };
}

struct TestImage
{
  Dimensions dimensions;
  Vector3 spacing;
  SharedArray<std::int16_t> values;
};

enum class Centre
{
  Heart,
  LeftMain ///< where it leaves the aorta: vessels of all sizes close together
};

/// CT of the beating phantom at rest: tubes of 0.5 to 2.3 mm radius, chambers, bone, fat, noise.
std::unique_ptr<TestImage> RenderPhantom(
  const Dimensions& n, const Vector3& spacing, Centre centre, const Options& options)
{
  // NOLINTNEXTLINE(modernize-make-unique): an aggregate that can not be moved.
  std::unique_ptr<TestImage> image(
    new TestImage{ n, spacing, SharedArray<std::int16_t>(CountOf(n)) });
  MeasureInChild([] {},
    [&]
    {
      constexpr double rest = 0.75;
      SetNumberOfThreads(options.threads);
      PhantomSettings settings;
      settings.seed = options.seed;
      const CoronaryPhantom phantom(settings);
      Vector3 middle = phantom.Ostia(rest).front().position;
      if (centre == Centre::Heart)
      {
        const ImageGrid around = phantom.DefaultGrid(1.0);
        const std::array<int, 6>& e = around.extent;
        middle = around.IndexToWorld(0.5 * (e[0] + e[1]), 0.5 * (e[2] + e[3]), 0.5 * (e[4] + e[5]));
      }
      ImageGrid grid;
      grid.extent = ExtentOf(n);
      grid.spacing = spacing;
      grid.origin = middle - 0.5 * spacing.cwiseProduct(Vector3(n[0] - 1, n[1] - 1, n[2] - 1));
      phantom.Render(grid, grid.extent, rest, image->values.data());
    });
  return image;
}

std::vector<float> ToFloat(const TestImage& image)
{
  return { image.values.data(), image.values.data() + image.values.size() };
}

// ---------------------------------------------------------------------------------------------
// Contestants
// ---------------------------------------------------------------------------------------------

VesselnessSettings Settings()
{
  VesselnessSettings settings;
  settings.sigmas = VesselnessScales(0.5, 2.5, 5, false);
  return settings;
}

struct Variant
{
  VesselnessSettings settings = Settings();
  bool scale = false;
  bool direction = false;
  Instructions instructions = Instructions::Widest;
};

std::vector<float> RunOurs(const float* values, const TestImage& image, const Variant& variant)
{
  const std::size_t count = CountOf(image.dimensions);
  const std::array<int, 6> extent = ExtentOf(image.dimensions);
  std::vector<float> result(count);
  std::vector<float> scale(variant.scale ? count : 0);
  std::vector<float> direction(variant.direction ? 3 * count : 0);
  const MultiscaleVesselness filter(variant.settings, image.spacing, extent);
  filter.Compute({ values, extent }, extent, nullptr,
    { result.data(), variant.scale ? scale.data() : nullptr,
      variant.direction ? direction.data() : nullptr });
  return result;
}

Measurement MeasureOurs(const TestImage& image, const Variant& variant, int threads,
  const SharedArray<float>* delivered = nullptr)
{
  std::vector<float> input;
  std::vector<float> result;
  return MeasureInChild(
    [&]
    {
      SetNumberOfThreads(threads);
      VesselnessKernelChoice().Select(variant.instructions);
      input = ToFloat(image);
    },
    [&] { result = RunOurs(input.data(), image, variant); },
    [&]
    {
      if (delivered)
      {
        std::copy(result.begin(), result.end(), delivered->data());
      }
    });
}

/// The image as the filter gets it from a reader.
template <typename Array>
vtkSmartPointer<vtkImageData> ToVtk(const TestImage& image)
{
  auto result = vtkSmartPointer<vtkImageData>::New();
  result->SetDimensions(image.dimensions.data());
  result->SetSpacing(image.spacing.data());
  vtkNew<Array> array;
  array->SetName("HU");
  array->SetNumberOfValues(result->GetNumberOfPoints());
  std::copy_n(image.values.data(), image.values.size(), array->GetPointer(0));
  result->GetPointData()->SetScalars(array);
  return result;
}

/// Our filter in a pipeline, as a user has it.
Measurement MeasureFilter(const TestImage& image, bool shortInput, bool automaticC, int threads,
  const SharedArray<float>* delivered = nullptr)
{
  vtkSmartPointer<vtkImageData> input;
  vtkSmartPointer<vtkFrangiVesselness> filter;
  return MeasureInChild(
    [&]
    {
      SetNumberOfThreads(threads);
      input = shortInput ? ToVtk<vtkShortArray>(image) : ToVtk<vtkFloatArray>(image);
      filter = vtkSmartPointer<vtkFrangiVesselness>::New();
    },
    [&]
    {
      const VesselnessSettings settings = Settings();
      filter->SetSigmaMin(settings.sigmas.front());
      filter->SetSigmaMax(settings.sigmas.back());
      filter->SetNumberOfScales(static_cast<int>(settings.sigmas.size()));
      filter->SetAlpha(settings.alpha);
      filter->SetBeta(settings.beta);
      filter->SetAutomaticC(automaticC);
      filter->SetC(settings.c);
      filter->SetInputData(input);
      filter->Update();
    },
    [&]
    {
      auto* result = vtkFloatArray::SafeDownCast(filter->GetOutput()->GetPointData()->GetScalars());
      if (!result || static_cast<std::size_t>(result->GetNumberOfValues()) != image.values.size())
      {
        throw std::runtime_error("vtkFrangiVesselness gave no result");
      }
      if (delivered)
      {
        std::copy_n(result->GetPointer(0), image.values.size(), delivered->data());
      }
    });
}

#if defined(DYNAMICCORONARY_WITH_ITK)
ItkVesselnessSettings ItkSettings(const VesselnessSettings& ours, int threads)
{
  ItkVesselnessSettings settings;
  settings.sigmaMin = ours.sigmas.front();
  settings.sigmaMax = ours.sigmas.back();
  settings.scales = static_cast<int>(ours.sigmas.size());
  settings.bright = ours.bright;
  settings.alpha = ours.alpha;
  settings.beta = ours.beta;
  settings.c = ours.c;
  settings.threads = threads;
  return settings;
}

Measurement MeasureItk(const TestImage& image, const VesselnessSettings& settings,
  bool doubleTensors, int threads, const SharedArray<float>* delivered = nullptr)
{
  std::vector<float> input;
  std::shared_ptr<const float> result;
  return MeasureInChild([&] { input = ToFloat(image); },
    [&]
    {
      ItkVesselnessSettings itk = ItkSettings(settings, threads);
      itk.doubleTensors = doubleTensors;
      result = ItkVesselness(input.data(), image.dimensions,
        { image.spacing[0], image.spacing[1], image.spacing[2] }, itk);
    },
    [&]
    {
      if (delivered)
      {
        std::copy_n(result.get(), input.size(), delivered->data());
      }
    });
}
#endif

// ---------------------------------------------------------------------------------------------
// Statistics
// ---------------------------------------------------------------------------------------------

/// Peak above the input, bytes a voxel; the largest of all runs.
double BytesPerVoxel(const std::vector<Measurement>& runs, std::size_t voxels)
{
  return PeakGrowth(runs) / static_cast<double>(voxels);
}

struct Comparison
{
  double correlation = 0.0;
  double rms = 0.0;
  double maximum = 0.0; ///< where not left out
};

/// Of the voxels that are at least `margin` away from every border.
/// @param leaveOut  not 0: does not count for the largest difference; may be null
Comparison Compare(const float* a, const float* b, const Dimensions& n,
  const std::array<int, 3>& margin, const unsigned char* leaveOut = nullptr)
{
  double count = 0.0;
  double sumA = 0.0;
  double sumB = 0.0;
  double sumAA = 0.0;
  double sumBB = 0.0;
  double sumAB = 0.0;
  Comparison result;
  for (int k = margin[2]; k < n[2] - margin[2]; ++k)
  {
    for (int j = margin[1]; j < n[1] - margin[1]; ++j)
    {
      const std::size_t row = (static_cast<std::size_t>(k) * n[1] + j) * n[0];
      for (int i = margin[0]; i < n[0] - margin[0]; ++i)
      {
        const double x = a[row + i];
        const double y = b[row + i];
        count += 1.0;
        sumA += x;
        sumB += y;
        sumAA += x * x;
        sumBB += y * y;
        sumAB += x * y;
        if (!leaveOut || !leaveOut[row + i])
        {
          result.maximum = std::max(result.maximum, std::abs(x - y));
        }
      }
    }
  }
  const double varianceA = count * sumAA - sumA * sumA;
  const double varianceB = count * sumBB - sumB * sumB;
  // Constant results correlate with nothing: NaN, which reaches no target.
  result.correlation = (count * sumAB - sumA * sumB) / std::sqrt(varianceA * varianceB);
  result.rms = std::sqrt(std::max(0.0, sumAA + sumBB - 2.0 * sumAB) / count);
  return result;
}

/// Four times the largest sigma.
std::array<int, 3> BorderMargin(const VesselnessSettings& settings, const Vector3& spacing)
{
  std::array<int, 3> margin;
  for (int axis = 0; axis < 3; ++axis)
  {
    margin[axis] = static_cast<int>(std::ceil(4.0 * settings.sigmas.back() / spacing[axis]));
  }
  return margin;
}

// ---------------------------------------------------------------------------------------------
// Tables
// ---------------------------------------------------------------------------------------------

std::string SizeText(const Dimensions& n)
{
  return std::to_string(n[0]) + "x" + std::to_string(n[1]) + "x" + std::to_string(n[2]);
}

std::string ThreadsText(int threads)
{
  return std::to_string(threads) + (threads == 1 ? " thread" : " threads");
}

void TableItk(const Options& options, Verdicts& verdicts)
{
  const Dimensions n = { options.size, options.size, options.size };
  const std::size_t voxels = CountOf(n);
  const std::unique_ptr<TestImage> image =
    RenderPhantom(n, Vector3::Constant(0.4), Centre::Heart, options);
  const Variant variant;
  std::vector<Measurement> algorithm;
  std::vector<Measurement> ours;
  std::vector<Measurement> itk;
  std::vector<Measurement> itkFloat;
  const SharedArray<float> oursResult(HasItk && !options.withoutPeer ? voxels : 0);
  const SharedArray<float> itkResult(oursResult.size());
  for (int run = 0; run < options.repeats; ++run)
  {
    algorithm.push_back(MeasureOurs(*image, variant, options.threads));
    ours.push_back(MeasureFilter(*image, false, false, options.threads,
      oursResult.size() > 0 && run == 0 ? &oursResult : nullptr));
#if defined(DYNAMICCORONARY_WITH_ITK)
    if (!options.withoutPeer)
    {
      itk.push_back(MeasureItk(
        *image, variant.settings, true, options.threads, run == 0 ? &itkResult : nullptr));
      itkFloat.push_back(MeasureItk(*image, variant.settings, false, options.threads));
    }
#endif
  }

  std::printf("\n### %s float, 0.4 mm, 5 scales from 0.5 to 2.5 mm, %s\n\n", SizeText(n).c_str(),
    ThreadsText(options.threads).c_str());
  std::printf("| | wall time, s | processor time, s | peak above the input, bytes a voxel |\n"
              "|---|---|---|---|\n");
  const auto row = [&](const std::string& name, const std::vector<Measurement>& runs)
  {
    std::printf("| %s | %s | %s | %.1f |\n", name.c_str(), Spread(Each(runs, Wall)).c_str(),
      Spread(Each(runs, Processor)).c_str(), BytesPerVoxel(runs, voxels));
  };
#if defined(DYNAMICCORONARY_WITH_ITK)
  if (!itk.empty())
  {
    row("ITK " + ItkVersion() + ", double tensors", itk);
    row("ITK " + ItkVersion() + ", float tensors", itkFloat);
  }
#endif
  row("MultiscaleVesselness, the algorithm alone", algorithm);
  row("vtkFrangiVesselness", ours);

  std::printf("\n| | measured | target | |\n|---|---|---|---|\n");
  const auto ratioRow = [&](const char* name, const std::vector<Measurement>& theirs, bool isTarget)
  {
    std::vector<double> walls;
    std::vector<double> processors;
    for (std::size_t run = 0; run < theirs.size(); ++run)
    {
      walls.push_back(theirs[run].wall / ours[run].wall);
      processors.push_back(theirs[run].processor / ours[run].processor);
    }
    const bool met = Median(walls) >= MinimumSpeedUp;
    std::printf("| vtkFrangiVesselness: times faster than %s, wall time | %s | %s | %s |\n", name,
      Spread(walls).c_str(), isTarget ? Format(">= %.0f", MinimumSpeedUp).c_str() : "",
      isTarget ? Verdict(met) : "");
    std::printf("| the same, processor time | %s | | |\n", Spread(processors).c_str());
    verdicts.missedTarget |= isTarget && !met;
  };
  if (!itk.empty())
  {
    ratioRow("ITK", itk, true);
    ratioRow("ITK with float tensors", itkFloat, false);
  }
  const double bytes = BytesPerVoxel(ours, voxels);
  const bool small = bytes <= MostBytesPerVoxel;
  std::printf("| peak above the input, output included, bytes a voxel | %.1f | <= %.0f | %s |\n",
    bytes, MostBytesPerVoxel, Verdict(small));
  verdicts.missedTarget |= !small;
  if (!itk.empty())
  {
    const std::array<int, 3> margin = BorderMargin(variant.settings, image->spacing);
    const Comparison inside = Compare(oursResult.data(), itkResult.data(), n, margin);
    const Comparison all = Compare(oursResult.data(), itkResult.data(), n, { 0, 0, 0 });
    const bool agrees = inside.correlation > MinimumCorrelation;
    std::printf("| correlation with ITK, %d voxels from the borders | %.5f | > %.3f | %s |\n",
      margin[0], inside.correlation, MinimumCorrelation, Verdict(agrees));
    std::printf("| correlation with ITK, all voxels | %.5f | | |\n", all.correlation);
    verdicts.disagreement |= !agrees;
  }
}

void TableClinical(const Options& options, Verdicts& verdicts)
{
  const Dimensions n = { options.clinicalSize[0], options.clinicalSize[1],
    options.clinicalSize[2] };
  const std::unique_ptr<TestImage> image =
    RenderPhantom(n, Vector3(0.23, 0.23, 0.625), Centre::Heart, options);
  std::printf("\n### vtkFrangiVesselness, %s, 0.23 x 0.23 x 0.625 mm, 5 scales, %s\n\n",
    SizeText(n).c_str(), ThreadsText(options.threads).c_str());
  std::printf(
    "| | wall time, s | processor time, s | peak above the input, bytes a voxel | peak of the "
    "process, GB | < %.0f s | < %.1f GB |\n|---|---|---|---|---|---|---|\n",
    MostClinicalSeconds, MostClinicalMemory * 1e-9);
  struct Row
  {
    const char* name;
    bool shortInput;
    bool automaticC;
  };
  for (const Row& row :
    { Row{ "float input, given c", false, false }, Row{ "short input, given c", true, false },
      Row{ "short input, c measured first", true, true } })
  {
    const std::vector<Measurement> runs = Repeat(options,
      [&] { return MeasureFilter(*image, row.shortInput, row.automaticC, options.threads); });
    const std::vector<double> peaks =
      Each(runs, [](const Measurement& m) { return static_cast<double>(m.peak); });
    const double peak = *std::max_element(peaks.begin(), peaks.end());
    const bool fast = Median(Each(runs, Wall)) < MostClinicalSeconds;
    const bool small = peak < MostClinicalMemory;
    std::printf("| %s | %s | %s | %.1f | %.2f | %s | %s |\n", row.name,
      Spread(Each(runs, Wall)).c_str(), Spread(Each(runs, Processor)).c_str(),
      BytesPerVoxel(runs, CountOf(n)), peak * 1e-9, Verdict(fast), Verdict(small));
    verdicts.missedTarget |= !fast || !small;
  }
}

void TableMethods(const Options& options)
{
  const Dimensions n = { options.size, options.size, options.size };
  const std::unique_ptr<TestImage> image =
    RenderPhantom(n, Vector3::Constant(0.4), Centre::Heart, options);
  std::vector<int> threads = { 1 };
  if (options.threads > 1)
  {
    threads.push_back(options.threads);
  }
  std::printf("\n### Methods and outputs of the algorithm, %s float, 0.4 mm, 5 scales\n\n",
    SizeText(n).c_str());
  std::printf("| |");
  for (const int count : threads)
  {
    std::printf(" %s: wall time, s | processor time, s |", ThreadsText(count).c_str());
  }
  std::printf(" peak above the input, bytes a voxel |\n|---|");
  for (std::size_t column = 0; column < threads.size(); ++column)
  {
    std::printf("---|---|");
  }
  std::printf("---|\n");

  struct Row
  {
    const char* name;
    Variant variant;
    bool measureOnly;
  };
  Variant sato;
  sato.settings.method = VesselnessMethod::Sato;
  Variant jerman;
  jerman.settings.method = VesselnessMethod::Jerman;
  jerman.settings.jermanMaxima.assign(jerman.settings.sigmas.size(), 500.0);
  Variant withScale;
  withScale.scale = true;
  Variant withDirection = withScale;
  withDirection.direction = true;
  for (const Row& row : { Row{ "Frangi", {}, false }, Row{ "Sato", sato, false },
         Row{ "Jerman", jerman, false }, Row{ "Frangi, scale too", withScale, false },
         Row{ "Frangi, scale and direction too", withDirection, false },
         Row{ "measuring c alone", {}, true } })
  {
    std::printf("| %s |", row.name);
    double bytes = 0.0;
    for (const int count : threads)
    {
      const std::vector<Measurement> runs = Repeat(options,
        [&]
        {
          if (!row.measureOnly)
          {
            return MeasureOurs(*image, row.variant, count);
          }
          std::vector<float> input;
          return MeasureInChild(
            [&]
            {
              SetNumberOfThreads(count);
              input = ToFloat(*image);
            },
            [&]
            {
              const std::array<int, 6> extent = ExtentOf(n);
              MultiscaleVesselness(row.variant.settings, image->spacing, extent)
                .Measure({ input.data(), extent }, extent, nullptr);
            });
        });
      std::printf(" %s | %.2f |", Spread(Each(runs, Wall)).c_str(), Median(Each(runs, Processor)));
      bytes = BytesPerVoxel(runs, CountOf(n));
    }
    std::printf(" %.1f |\n", bytes);
  }
}

void TableScales(const Options& options)
{
  const Dimensions n = { options.size, options.size, options.size };
  const std::unique_ptr<TestImage> image =
    RenderPhantom(n, Vector3::Constant(0.4), Centre::Heart, options);
  std::printf("\n### One scale at a time, %s float, 0.4 mm, %s\n\n", SizeText(n).c_str(),
    ThreadsText(options.threads).c_str());
  std::printf("| sigma, mm | taps | wall time, s | processor time, s |\n|---|---|---|---|\n");
  for (const double sigma : Settings().sigmas)
  {
    Variant variant;
    variant.settings.sigmas = { sigma };
    const std::vector<Measurement> runs =
      Repeat(options, [&] { return MeasureOurs(*image, variant, options.threads); });
    const int halo = MultiscaleVesselness(variant.settings, image->spacing, ExtentOf(n)).Halo()[0];
    std::printf("| %.1f | %d | %s | %s |\n", sigma, 2 * halo + 1, Spread(Each(runs, Wall)).c_str(),
      Spread(Each(runs, Processor)).c_str());
  }
}

void TableInstructions(const Options& options)
{
  const Dimensions n = { options.size, options.size, options.size };
  const std::unique_ptr<TestImage> image =
    RenderPhantom(n, Vector3::Constant(0.4), Centre::Heart, options);
  std::printf("\n### Vector instructions, the algorithm, %s float, 0.4 mm, 5 scales, %s\n\n",
    SizeText(n).c_str(), ThreadsText(options.threads).c_str());
  std::printf("| | wall time, s | processor time, s |\n|---|---|---|\n");
  for (const auto& [name, instructions] :
    { std::pair("SSE2 or whatever the compiler's default is", Instructions::Baseline),
      std::pair("AVX2", Instructions::Avx2), std::pair("AVX-512", Instructions::Avx512) })
  {
    if (!VesselnessKernelChoice().Select(instructions))
    {
      std::printf("| %s | not on this processor | |\n", name);
      continue;
    }
    Variant variant;
    variant.instructions = instructions;
    const std::vector<Measurement> runs =
      Repeat(options, [&] { return MeasureOurs(*image, variant, options.threads); });
    std::printf("| %s | %s | %s |\n", name, Spread(Each(runs, Wall)).c_str(),
      Spread(Each(runs, Processor)).c_str());
  }
  VesselnessKernelChoice().Select(Instructions::Widest);
}

void TableAgreement(const Options& options, Verdicts& verdicts)
{
  struct Case
  {
    const char* name;
    Vector3 spacing;
    double depth; ///< slices, relative to the other sides
    bool bright;
    double c;
  };
  std::printf(
    "\n### Agreement at equal settings, 5 scales from 0.5 to 2.5 mm, borders left out\n\n"
    "The reference is a plain computation in double precision. The largest difference "
    "leaves out the voxels where\nEq. 1 itself jumps (|l1| = |l2|, l1 > 0) for a change of "
    "1 %% in the eigenvalues.\n\n"
    "| image | c, HU | pair | correlation | rms difference | largest difference | "
    "target | |\n|---|---|---|---|---|---|---|---|\n");
  for (const Case& test : { Case{ "0.4 mm", Vector3::Constant(0.4), 1.0, true, 100.0 },
         Case{ "0.4 mm", Vector3::Constant(0.4), 1.0, true, 400.0 },
         Case{ "0.4 mm, dark structures", Vector3::Constant(0.4), 1.0, false, 100.0 },
         Case{ "0.35 x 0.35 x 0.625 mm", Vector3(0.35, 0.35, 0.625), 0.75, true, 100.0 } })
  {
    const int side = options.agreementSize;
    const Dimensions n = { side, side, static_cast<int>(test.depth * side) };
    const std::unique_ptr<TestImage> image =
      RenderPhantom(n, test.spacing, Centre::LeftMain, options);
    Variant variant;
    variant.settings.bright = test.bright;
    variant.settings.c = test.c;
    const std::array<int, 3> margin = BorderMargin(variant.settings, test.spacing);
    for (int axis = 0; axis < 3; ++axis)
    {
      if (n[axis] <= 2 * margin[axis])
      {
        throw std::runtime_error("--agreement-size " + std::to_string(side) +
          " leaves nothing between the borders of the image with " + test.name);
      }
    }
    const SharedArray<float> ours(CountOf(n));
    const SharedArray<float> reference(CountOf(n));
    const SharedArray<unsigned char> atJump(CountOf(n));
    MeasureOurs(*image, variant, options.threads, &ours);
    ReferenceResult result;
    MeasureInChild([&] { SetNumberOfThreads(options.threads); },
      [&]
      {
        const std::vector<float> input = ToFloat(*image);
        result = ReferenceFrangi({ input.data(), ExtentOf(n) }, test.spacing, variant.settings);
      },
      [&]
      {
        std::copy(result.vesselness.begin(), result.vesselness.end(), reference.data());
        std::copy(result.atJump.begin(), result.atJump.end(), atJump.data());
      });
    const auto row = [&](const char* pair, const float* a, const float* b,
                       const std::string& target, const auto& reached)
    {
      const Comparison c = Compare(a, b, n, margin, atJump.data());
      const bool met = target.empty() || reached(c);
      std::printf("| %s %s | %.0f | %s | %.6f | %.1e | %.1e | %s | %s |\n", SizeText(n).c_str(),
        test.name, test.c, pair, c.correlation, c.rms, c.maximum, target.c_str(),
        target.empty() ? "" : Verdict(met));
      verdicts.disagreement |= !met;
    };
    row("ours, reference", ours.data(), reference.data(),
      "> " + Format("%.4f", MinimumReferenceCorrelation) +
        ", largest <= " + Format("%.0e", MaximumReferenceError),
      [](const Comparison& c) {
        return c.correlation > MinimumReferenceCorrelation && c.maximum <= MaximumReferenceError;
      });
#if defined(DYNAMICCORONARY_WITH_ITK)
    if (!options.withoutPeer)
    {
      const SharedArray<float> itk(CountOf(n));
      MeasureItk(*image, variant.settings, true, options.threads, &itk);
      row("ours, ITK", ours.data(), itk.data(), "> " + Format("%.3f", MinimumCorrelation),
        [](const Comparison& c) { return c.correlation > MinimumCorrelation; });
      row(
        "ITK, reference", itk.data(), reference.data(), "", [](const Comparison&) { return true; });
    }
#endif
  }
}

int Run(const Options& options)
{
  Verdicts verdicts;
  std::printf("## Vesselness\n\n");
  PrintMachine(options);
  if (!HasItk)
  {
    std::printf("The comparison with ITK is skipped: this program was built without ITK 5 "
                "(Debian: libinsighttoolkit5-dev).\n");
  }
  else if (options.withoutPeer)
  {
    std::printf("The comparison with ITK is skipped, as asked for.\n");
  }
  if (options.Has("itk"))
  {
    TableItk(options, verdicts);
  }
  if (options.Has("clinical"))
  {
    TableClinical(options, verdicts);
  }
  if (options.Has("methods"))
  {
    TableMethods(options);
  }
  if (options.Has("scales"))
  {
    TableScales(options);
  }
  if (options.Has("instructions"))
  {
    TableInstructions(options);
  }
  if (options.Has("agreement"))
  {
    TableAgreement(options, verdicts);
  }
  return verdicts.ExitCode("vesselness-benchmark", options.strict);
}

/// @return the exit code
int Start(int argc, char** argv)
{
  Options options;
  CLI::App app("Time, memory and agreement of the vesselness, beside ITK's in the same run. Each "
               "measurement is a process of its own. Exit code 1 when results disagree.");
  app.add_option("--size", options.size, "Voxels along each side")
    ->check(CLI::Range(16, 1024))
    ->capture_default_str();
  app.add_option("--agreement-size", options.agreementSize, "The same for the agreement")
    ->check(CLI::Range(16, 1024))
    ->capture_default_str();
  app.add_option("--clinical-size", options.clinicalSize, "Voxels of the clinical volume")
    ->expected(3)
    ->check(CLI::Range(16, 2048))
    ->capture_default_str();
  options.AddTo(app, "itk", AllTables);
  CLI11_PARSE(app, argc, argv);
  return Run(options);
}
}

int main(int argc, char** argv)
{
  return coronary::RunBenchmark("vesselness-benchmark", [&] { return Start(argc, argv); });
}
