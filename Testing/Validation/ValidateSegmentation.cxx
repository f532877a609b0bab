// Automatic ostia and vessel segmentation on phantoms, against their exact truth. Tables in
// Markdown on stdout; the exit code is 1 when a limit is missed.

#include "CoronaryOstia.h"
#include "CoronaryPhantom.h"
#include "MultiscaleVesselness.h"
#include "PhantomCases.h"
#include "VesselSegmentation.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <iterator>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

// What has to be reached.
constexpr double MinimumDice = 0.85;       // at the usual window and noise
constexpr double MaximumOstiumError = 2.0; // mm
constexpr double OstiaShare = 0.95;        // of the phantoms

constexpr double ReferencePhase = 0.75;
constexpr double UsualWindow = 0.066;  // s
constexpr double UsualNoise = 25.0;    // HU
constexpr double MinimumRadius = 0.75; // mm: thinner vessels are left out of Dice
constexpr double LeakDistance = 1.5;   // mm from the wall of any vessel
constexpr double Infinite = std::numeric_limits<double>::infinity();

// ---------------------------------------------------------------------------------------------
// Cases
// ---------------------------------------------------------------------------------------------

/// How an image samples the box around the tree.
struct Geometry
{
  std::string name;
  Vector3 spacing; ///< mm
  double margin = 8.0;
  bool oblique = false; ///< turned axes, an extent that does not begin at 0, a far origin
};

struct Case
{
  std::uint64_t seed;
  double window; ///< s
  double noise;  ///< HU
  Geometry geometry;

  bool operator==(const Case& other) const
  {
    return this->seed == other.seed && this->window == other.window && this->noise == other.noise &&
      this->geometry.name == other.geometry.name;
  }
  bool Usual() const { return this->window == UsualWindow && this->noise == UsualNoise; }
};

struct OstiumError
{
  double error = Infinite; ///< mm; infinite: not found
  double confidence = 0.0;
};

struct Outcome
{
  Case test;
  std::array<OstiumError, 2> ostia; ///< left, right
  std::string doubt;
  bool segmented = false;
  double dice = 0.0;
  double recall = 0.0;
  double precision = 0.0;
  double thinRecall = 0.0; ///< of the vessels that Dice leaves out
  double leak = 0.0;       ///< mm^3 of the mask more than LeakDistance from any vessel
  double voxels = 0.0;
  double ostiaSeconds = 0.0; ///< of processor time
  double vesselnessSeconds = 0.0;
  double segmentationSeconds = 0.0;

  double WorstOstium() const { return std::max(this->ostia[0].error, this->ostia[1].error); }
};

/// The algorithms see an oblique image this far away from where it was rendered.
const Vector3 FarAway(137.3, -212.9, 418.7); // mm

ImageGrid MakeGrid(const CoronaryPhantom& phantom, const Geometry& geometry)
{
  const ImageGrid box = phantom.DefaultGrid(0.5, geometry.margin);
  const Vector3 low = box.IndexToWorld(box.extent[0], box.extent[2], box.extent[4]);
  const Vector3 high = box.IndexToWorld(box.extent[1], box.extent[3], box.extent[5]);
  const Vector3 centre = 0.5 * (low + high);
  Vector3 half = 0.5 * (high - low);
  ImageGrid grid;
  grid.spacing = geometry.spacing;
  if (geometry.oblique)
  {
    grid.direction =
      (Eigen::AngleAxisd(0.35, Vector3(0.3, 1.0, -0.4).normalized())).toRotationMatrix();
    half = grid.direction.transpose().cwiseAbs() * half;
  }
  const std::array<int, 3> first =
    geometry.oblique ? std::array<int, 3>{ -41, 12, 307 } : std::array<int, 3>{ 0, 0, 0 };
  Vector3 start;
  for (int axis = 0; axis < 3; ++axis)
  {
    const int count = 1 + static_cast<int>(std::ceil(2.0 * half[axis] / grid.spacing[axis]));
    grid.extent[2 * axis] = first[axis];
    grid.extent[2 * axis + 1] = first[axis] + count - 1;
    start[axis] = -half[axis] - first[axis] * grid.spacing[axis];
  }
  grid.origin = centre + grid.direction * start;
  return grid;
}

// ---------------------------------------------------------------------------------------------
// Comparison with the truth
// ---------------------------------------------------------------------------------------------

/// The tree point whose ball is nearest.
struct NearestBall
{
  double gap;    ///< distance minus radius, mm
  double radius; ///< mm
};

class TreeSearch
{
public:
  /// @param reach  gaps up to here are found, mm
  TreeSearch(const PhantomTree& tree, double reach)
    : Tree(tree)
    , Reach(reach)
    , CellSize(reach + *std::max_element(tree.radius.begin(), tree.radius.end()))
  {
    Vector3 high = Vector3::Constant(-Infinite);
    for (const Vector3& p : tree.points)
    {
      this->Low = this->Low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    for (int axis = 0; axis < 3; ++axis)
    {
      this->Size[axis] = 1 + static_cast<int>((high[axis] - this->Low[axis]) / this->CellSize);
    }
    this->Cells.resize(static_cast<std::size_t>(this->Size[0]) * this->Size[1] * this->Size[2]);
    for (std::size_t n = 0; n < tree.points.size(); ++n)
    {
      this->Cells[this->Index(this->CellOf(tree.points[n]))].push_back(n);
    }
  }

  std::optional<NearestBall> Find(const Vector3& p) const
  {
    NearestBall best{ this->Reach, 0.0 };
    bool found = false;
    const std::array<int, 3> middle = this->CellOf(p);
    for (int k = std::max(0, middle[2] - 1); k <= std::min(this->Size[2] - 1, middle[2] + 1); ++k)
    {
      for (int j = std::max(0, middle[1] - 1); j <= std::min(this->Size[1] - 1, middle[1] + 1); ++j)
      {
        for (int i = std::max(0, middle[0] - 1); i <= std::min(this->Size[0] - 1, middle[0] + 1);
             ++i)
        {
          for (const std::size_t n : this->Cells[this->Index({ i, j, k })])
          {
            const double gap = (this->Tree.points[n] - p).norm() - this->Tree.radius[n];
            if (gap <= best.gap)
            {
              best = { gap, this->Tree.radius[n] };
              found = true;
            }
          }
        }
      }
    }
    return found ? std::optional<NearestBall>(best) : std::nullopt;
  }

private:
  std::array<int, 3> CellOf(const Vector3& p) const
  {
    const Vector3 cell = ((p - this->Low) / this->CellSize).array().floor();
    return { static_cast<int>(cell[0]), static_cast<int>(cell[1]), static_cast<int>(cell[2]) };
  }
  std::size_t Index(const std::array<int, 3>& c) const
  {
    return (static_cast<std::size_t>(c[2]) * this->Size[1] + c[1]) * this->Size[0] + c[0];
  }

  const PhantomTree& Tree;
  double Reach;
  double CellSize;
  Vector3 Low = Vector3::Constant(Infinite);
  std::array<int, 3> Size;
  std::vector<std::vector<std::size_t>> Cells;
};

void CompareMasks(const CoronaryPhantom& phantom, const ImageGrid& grid,
  const std::vector<unsigned char>& mask, Outcome& outcome)
{
  std::vector<float> distances(mask.size());
  phantom.LumenDistances(grid, grid.extent, ReferencePhase, 1.0, distances.data());
  const PhantomTree tree = phantom.Tree(ReferencePhase);
  const TreeSearch search(tree, LeakDistance);

  double truth = 0.0;
  double found = 0.0;
  double both = 0.0;
  double thin = 0.0;
  double thinFound = 0.0;
  double leak = 0.0;
  std::size_t p = 0;
  for (int k = grid.extent[4]; k <= grid.extent[5]; ++k)
  {
    for (int j = grid.extent[2]; j <= grid.extent[3]; ++j)
    {
      for (int i = grid.extent[0]; i <= grid.extent[1]; ++i, ++p)
      {
        const bool inTruth = distances[p] < 0.0f;
        const bool inMask = mask[p] != 0;
        if (!inTruth && !inMask)
        {
          continue;
        }
        const std::optional<NearestBall> ball = search.Find(grid.IndexToWorld(i, j, k));
        if (ball && ball->radius < MinimumRadius)
        {
          thin += inTruth ? 1.0 : 0.0;
          thinFound += inTruth && inMask ? 1.0 : 0.0;
          continue;
        }
        truth += inTruth ? 1.0 : 0.0;
        found += inMask ? 1.0 : 0.0;
        both += inTruth && inMask ? 1.0 : 0.0;
        leak += ball ? 0.0 : 1.0;
      }
    }
  }
  outcome.dice = truth + found > 0.0 ? 2.0 * both / (truth + found) : 0.0;
  outcome.recall = truth > 0.0 ? both / truth : 0.0;
  outcome.precision = found > 0.0 ? both / found : 0.0;
  outcome.thinRecall = thin > 0.0 ? thinFound / thin : 0.0;
  outcome.leak = leak * grid.spacing.prod();
}

double ProcessorSeconds()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// @param c  Frangi's, HU; 0: half the largest Hessian norm
Outcome Run(const Case& test, bool segment, double c)
{
  Outcome outcome;
  outcome.test = test;
  PhantomSettings settings;
  settings.seed = test.seed;
  settings.temporalWindow = test.window;
  settings.noise = test.noise;
  const CoronaryPhantom phantom(settings);
  const ImageGrid grid = MakeGrid(phantom, test.geometry);

  ScalarImage image;
  image.grid = grid;
  const Vector3 shift = test.geometry.oblique ? FarAway : Vector3::Zero();
  image.grid.origin += shift;
  const auto voxels = static_cast<std::size_t>(image.NumberOfVoxels());
  outcome.voxels = static_cast<double>(voxels);
  std::vector<std::int16_t> values(voxels);
  phantom.Render(grid, grid.extent, ReferencePhase, values.data());
  image.values = static_cast<const std::int16_t*>(values.data());

  double start = ProcessorSeconds();
  const CoronaryOstia ostia = FindCoronaryOstia(image);
  outcome.ostiaSeconds = ProcessorSeconds() - start;
  outcome.doubt = ostia.doubt;
  const std::vector<PhantomOstium> truth = phantom.Ostia(ReferencePhase);
  std::vector<VesselSeed> seeds;
  for (const CoronaryOstium& ostium : ostia.ostia)
  {
    seeds.push_back({ ostium.position, ostium.axis });
    for (const PhantomOstium& t : truth)
    {
      if (t.name == ostium.name)
      {
        outcome.ostia[t.name == "LCA" ? 0 : 1] = { (ostium.position - shift - t.position).norm(),
          ostium.confidence };
      }
    }
  }
  if (!segment)
  {
    return outcome;
  }
  outcome.segmented = true;
  if (seeds.empty())
  {
    return outcome;
  }

  const BloodWindow window{ CoronaryOstiaSettings().softTissue, ostia.aorta.mean };
  start = ProcessorSeconds();
  std::vector<float> vesselness(voxels);
  {
    const std::vector<float> input(values.begin(), values.end());
    VesselnessSettings frangi;
    frangi.sigmas = VesselnessScales(0.5, 2.5, 5, true);
    const VoxelBlock block{ input.data(), grid.extent };
    frangi.c = c > 0.0 ? c
                       : 0.5 *
        MultiscaleVesselness(frangi, grid.spacing, grid.extent)
          .Measure(block, grid.extent, nullptr)
          .hessianNorm;
    MultiscaleVesselness::Output output;
    output.vesselness = vesselness.data();
    MultiscaleVesselness(frangi, grid.spacing, grid.extent)
      .Compute(block, grid.extent, nullptr, output);
  }
  outcome.vesselnessSeconds = ProcessorSeconds() - start;

  start = ProcessorSeconds();
  VesselSegmentationSettings segmentation;
  segmentation.window = window;
  const VesselSegmentationResult result =
    SegmentVessels(image, vesselness.data(), seeds, segmentation);
  outcome.segmentationSeconds = ProcessorSeconds() - start;
  CompareMasks(phantom, grid, result.mask, outcome);
  return outcome;
}

// ---------------------------------------------------------------------------------------------
// Tables
// ---------------------------------------------------------------------------------------------

const char* Verdict(bool met)
{
  return met ? "met" : "**MISSED**";
}

std::string Format(const char* format, double value)
{
  if (!std::isfinite(value))
  {
    return "not found";
  }
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

using Outcomes = std::vector<const Outcome*>;

template <typename Value>
double Mean(const Outcomes& outcomes, const Value& value)
{
  double sum = 0.0;
  for (const Outcome* o : outcomes)
  {
    sum += value(*o);
  }
  return outcomes.empty() ? 0.0 : sum / static_cast<double>(outcomes.size());
}

template <typename Value>
double Maximum(const Outcomes& outcomes, const Value& value)
{
  double result = -Infinite;
  for (const Outcome* o : outcomes)
  {
    result = std::max(result, value(*o));
  }
  return result;
}

template <typename Condition>
Outcomes Select(const std::vector<Outcome>& all, const Condition& condition)
{
  Outcomes result;
  for (const Outcome& o : all)
  {
    if (condition(o))
    {
      result.push_back(&o);
    }
  }
  return result;
}

std::string QualityHeader(const char* what)
{
  return std::string("| ") + what +
    " | images | Dice, mean | Dice, lowest | recall | precision | recall of thinner vessels | "
    "leak, mean mm3 | leak, largest mm3 | ostia, mean mm | ostia, largest mm |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|\n";
}

std::string QualityRow(const std::string& name, const Outcomes& outcomes)
{
  const auto ostia = [](const Outcome& o) { return 0.5 * (o.ostia[0].error + o.ostia[1].error); };
  const auto leak = [](const Outcome& o) { return o.leak; };
  return "| " + name + " | " + std::to_string(outcomes.size()) + " | " +
    Format("%.3f", Mean(outcomes, [](const Outcome& o) { return o.dice; })) + " | " +
    Format("%.3f", -Maximum(outcomes, [](const Outcome& o) { return -o.dice; })) + " | " +
    Format("%.3f", Mean(outcomes, [](const Outcome& o) { return o.recall; })) + " | " +
    Format("%.3f", Mean(outcomes, [](const Outcome& o) { return o.precision; })) + " | " +
    Format("%.2f", Mean(outcomes, [](const Outcome& o) { return o.thinRecall; })) + " | " +
    Format("%.1f", Mean(outcomes, leak)) + " | " + Format("%.1f", Maximum(outcomes, leak)) + " | " +
    Format("%.2f", Mean(outcomes, ostia)) + " | " +
    Format("%.2f", Maximum(outcomes, [](const Outcome& o) { return o.WorstOstium(); })) + " |\n";
}

/// @return whether the limit is met everywhere
bool PrintDiceBySeed(const std::vector<Outcome>& all, const std::vector<Geometry>& geometries)
{
  std::printf(
    "\n### Dice of each phantom, %.0f ms, %.0f HU\n\n| seed |", 1e3 * UsualWindow, UsualNoise);
  for (const Geometry& g : geometries)
  {
    std::printf(" %s |", g.name.c_str());
  }
  std::printf("\n|---|");
  for (std::size_t g = 0; g < geometries.size(); ++g)
  {
    std::printf("---|");
  }
  bool met = true;
  std::uint64_t seed = std::numeric_limits<std::uint64_t>::max();
  for (const Outcome& o : all)
  {
    if (!o.test.Usual())
    {
      continue;
    }
    if (o.test.seed != seed)
    {
      seed = o.test.seed;
      std::printf("\n| %llu |", static_cast<unsigned long long>(seed));
    }
    const bool good = o.dice >= MinimumDice;
    met &= good;
    std::printf(good ? " %.3f |" : " **%.3f** |", o.dice);
  }
  std::printf("\n\nLimit: at least %.2f in each: %s\n", MinimumDice, Verdict(met));
  return met;
}

void PrintByWindowAndNoise(const std::vector<Outcome>& all, const std::vector<double>& windows,
  const std::vector<double>& noises, const Geometry& geometry)
{
  std::printf("\n### Temporal window and noise, %s\n\n%s", geometry.name.c_str(),
    QualityHeader("window, noise").c_str());
  for (const double window : windows)
  {
    for (const double noise : noises)
    {
      const Outcomes outcomes = Select(all,
        [&](const Outcome& o)
        {
          return o.test.window == window && o.test.noise == noise &&
            o.test.geometry.name == geometry.name;
        });
      std::printf("%s",
        QualityRow(Format("%.0f ms, ", 1e3 * window) + Format("%.0f HU", noise), outcomes).c_str());
    }
  }
}

void PrintByGeometry(const std::vector<Outcome>& all, const std::vector<Geometry>& geometries)
{
  std::printf("\n### Sampling, %.0f ms, %.0f HU\n\n%s", 1e3 * UsualWindow, UsualNoise,
    QualityHeader("voxels").c_str());
  const auto select = [&](const Geometry& g)
  {
    return Select(
      all, [&](const Outcome& o) { return o.test.Usual() && o.test.geometry.name == g.name; });
  };
  for (const Geometry& g : geometries)
  {
    std::printf("%s", QualityRow(g.name, select(g)).c_str());
  }
  std::printf("\n### Processor time, seconds, mean\n\n"
              "| voxels | million voxels | ostia | vesselness | segmentation |\n"
              "|---|---|---|---|---|\n");
  for (const Geometry& g : geometries)
  {
    const Outcomes outcomes = select(g);
    std::printf("| %s | %.1f | %.1f | %.1f | %.1f |\n", g.name.c_str(),
      1e-6 * Mean(outcomes, [](const Outcome& o) { return o.voxels; }),
      Mean(outcomes, [](const Outcome& o) { return o.ostiaSeconds; }),
      Mean(outcomes, [](const Outcome& o) { return o.vesselnessSeconds; }),
      Mean(outcomes, [](const Outcome& o) { return o.segmentationSeconds; }));
  }
}

/// @return whether enough phantoms have both ostia within the limit
bool PrintOstia(const std::vector<Outcome>& all, const std::vector<std::uint64_t>& seeds,
  const Geometry& geometry)
{
  std::printf("\n### Automatic ostia, %s, %.0f ms, %.0f HU\n\n"
              "| seed | LCA, mm | RCA, mm | confidence LCA | confidence RCA | doubt |\n"
              "|---|---|---|---|---|---|\n",
    geometry.name.c_str(), 1e3 * UsualWindow, UsualNoise);
  int good = 0;
  int phantoms = 0;
  for (const std::uint64_t seed : seeds)
  {
    const Case test{ seed, UsualWindow, UsualNoise, geometry };
    const auto o =
      std::find_if(all.begin(), all.end(), [&](const Outcome& a) { return a.test == test; });
    if (o == all.end())
    {
      continue;
    }
    ++phantoms;
    good += o->WorstOstium() <= MaximumOstiumError ? 1 : 0;
    std::printf("| %llu | %s | %s | %.2f | %.2f | %s |\n", static_cast<unsigned long long>(seed),
      Format("%.2f", o->ostia[0].error).c_str(), Format("%.2f", o->ostia[1].error).c_str(),
      o->ostia[0].confidence, o->ostia[1].confidence, o->doubt.c_str());
  }
  const int minimum = static_cast<int>(std::ceil(OstiaShare * phantoms - 1e-9));
  std::printf("\nBoth within %.0f mm: %d of %d phantoms. Limit: %d: %s\n", MaximumOstiumError, good,
    phantoms, minimum, Verdict(good >= minimum));
  return good >= minimum;
}

/// @return whether enough images have both ostia within the limit
bool PrintAllOstia(const std::vector<Outcome>& all)
{
  const auto good = std::count_if(
    all.begin(), all.end(), [](const Outcome& o) { return o.WorstOstium() <= MaximumOstiumError; });
  const auto count = static_cast<double>(all.size());
  const auto minimum = static_cast<long>(std::ceil(OstiaShare * count - 1e-9));
  std::printf("\nBoth ostia within %.0f mm: %ld of all %zu images of this run. Limit: %ld: %s\n",
    MaximumOstiumError, static_cast<long>(good), all.size(), minimum, Verdict(good >= minimum));
  return good >= minimum;
}

void PrintCases(const std::vector<Outcome>& all)
{
  std::printf("\n### All images\n\n"
              "| seed | window, ms | noise, HU | voxels | Dice | recall | precision | recall of "
              "thinner vessels | leak, mm3 | LCA, mm | RCA, mm |\n"
              "|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Outcome& o : all)
  {
    if (o.segmented)
    {
      std::printf("| %llu | %.0f | %.0f | %s | %.3f | %.3f | %.3f | %.2f | %.1f | %s | %s |\n",
        static_cast<unsigned long long>(o.test.seed), 1e3 * o.test.window, o.test.noise,
        o.test.geometry.name.c_str(), o.dice, o.recall, o.precision, o.thinRecall, o.leak,
        Format("%.2f", o.ostia[0].error).c_str(), Format("%.2f", o.ostia[1].error).c_str());
    }
  }
}

// ---------------------------------------------------------------------------------------------
// Options
// ---------------------------------------------------------------------------------------------

/// "0.5" or "0.35/0.35/0.6"
Geometry ParseSpacing(const std::string& text)
{
  Vector3 spacing;
  std::size_t place = 0;
  int count = 0;
  bool good = true;
  while (good && place <= text.size() && count < 3)
  {
    const std::size_t end = std::min(text.find('/', place), text.size());
    const std::string part = text.substr(place, end - place);
    std::size_t used = 0;
    try
    {
      spacing[count] = std::stod(part, &used);
    }
    catch (const std::exception&)
    {
      good = false;
    }
    good = good && used == part.size() && spacing[count] >= 0.1 && spacing[count] <= 5.0;
    ++count;
    place = end + 1;
  }
  if (!good || place <= text.size() || (count != 1 && count != 3))
  {
    throw CLI::ValidationError("spacing", "'" + text + "' is neither mm nor mm/mm/mm, 0.1 to 5");
  }
  if (count == 1)
  {
    spacing = Vector3::Constant(spacing[0]);
  }
  return { text + " mm", spacing };
}

/// Sorted, each once, with the one that is always there.
void Complete(std::vector<double>& values, double needed)
{
  values.push_back(needed);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

std::vector<Outcome> Segmented(const std::vector<Outcome>& outcomes)
{
  std::vector<Outcome> segmented;
  std::copy_if(outcomes.begin(), outcomes.end(), std::back_inserter(segmented),
    [](const Outcome& o) { return o.segmented; });
  return segmented;
}

/// @param c  of the vesselness, HU
void PrintHead(double c)
{
  std::printf(
    "Phantoms at t = %.2f. Dice, recall and precision: voxels of truth or mask whose nearest tree "
    "point (by distance\nminus radius) lies within %.1f mm and has a radius below %.2f mm are left "
    "out; all others count, also leaks far\naway. Leak: mask more than %.1f mm from the wall of "
    "any vessel, thin ones included. Seeds and window of the\nsegmentation come from the automatic "
    "ostia; c of the vesselness: %s.\n",
    ReferencePhase, LeakDistance, MinimumRadius, LeakDistance,
    c > 0.0 ? Format("%g HU", c).c_str() : "half the largest Hessian norm");
}

/// @return the exit code
int Validate(int argc, char** argv)
{
  CLI::App program("Automatic ostia and vessel segmentation on phantoms, against their truth");
  std::string seedText = "1..10";
  std::string ostiaSeedText = "1..20";
  std::vector<std::string> spacings = { "0.6", "0.4", "0.5", "0.35/0.35/0.6" };
  std::vector<double> windows = { 0.0, 66.0, 140.0 };
  std::vector<double> noises = { 15.0, 25.0, 40.0 };
  std::vector<std::string> tables = { "sampling", "windows", "ostia" };
  bool quick = false;
  double c = 100.0;
  bool listCases = false;
  program.add_option("--seeds", seedText, "phantoms to segment: a count or first..last")
    ->capture_default_str();
  program
    .add_option("--ostia-seeds", ostiaSeedText, "phantoms to find ostia in: a count or first..last")
    ->capture_default_str();
  program
    .add_option("--spacing", spacings,
      "mm or mm/mm/mm; with the first one: all windows and noises, the oblique image, the large "
      "field of view, and the ostia")
    ->capture_default_str();
  program.add_option("--window", windows, "temporal windows, ms; 66 is always there")
    ->capture_default_str();
  program.add_option("--noise", noises, "standard deviations, HU; 25 is always there")
    ->capture_default_str();
  program.add_option("--tables", tables, "what to do")
    ->capture_default_str()
    ->check(CLI::IsMember({ "sampling", "windows", "ostia" }));
  program.add_flag("--quick", quick, "one oblique image of one phantom in coarse voxels");
  program.add_option("--c", c, "c of the vesselness, HU; 0: half the largest Hessian norm")
    ->check(CLI::Range(0.0, 1e6))
    ->capture_default_str();
  program.add_flag("--cases", listCases, "also print one row for each image");
  std::vector<std::uint64_t> seeds;
  std::vector<std::uint64_t> ostiaSeeds;
  std::vector<Geometry> geometries;
  try
  {
    program.parse(argc, argv);
    if (quick)
    {
      seedText = ostiaSeedText = "1";
      spacings = { "0.8" };
      tables = { "sampling" };
    }
    seeds = ParseSeeds(seedText, LoneNumber::Count);
    ostiaSeeds = ParseSeeds(ostiaSeedText, LoneNumber::Count);
    for (const std::string& text : spacings)
    {
      geometries.push_back(ParseSpacing(text));
    }
  }
  catch (const CLI::ParseError& error)
  {
    return program.exit(error);
  }
  const Geometry usual = geometries.front();
  const Geometry oblique{ usual.name + ", oblique, shifted", usual.spacing, usual.margin, true };
  if (quick)
  {
    geometries = { oblique };
  }
  else
  {
    geometries.push_back(oblique);
    geometries.push_back({ usual.name + ", 30 mm margin", usual.spacing, 30.0, false });
  }
  const auto wanted = [&](const char* table)
  { return std::find(tables.begin(), tables.end(), table) != tables.end(); };
  for (double& window : windows)
  {
    window = window == 1e3 * UsualWindow ? UsualWindow : 1e-3 * window;
  }
  Complete(windows, UsualWindow);
  Complete(noises, UsualNoise);

  PrintHead(c);
  std::vector<Outcome> outcomes;
  const auto run = [&](const Case& test, bool segment)
  {
    const bool done = std::any_of(outcomes.begin(), outcomes.end(),
      [&](const Outcome& o) { return o.test == test && (o.segmented || !segment); });
    if (done)
    {
      return;
    }
    outcomes.push_back(Run(test, segment, c));
    const Outcome& o = outcomes.back();
    std::fprintf(stderr, "seed %llu, %.0f ms, %.0f HU, %s: Dice %s, ostia %s %s\n",
      static_cast<unsigned long long>(test.seed), 1e3 * test.window, test.noise,
      test.geometry.name.c_str(), segment ? Format("%.3f", o.dice).c_str() : "-",
      Format("%.2f", o.ostia[0].error).c_str(), Format("%.2f", o.ostia[1].error).c_str());
  };
  for (const std::uint64_t seed : seeds)
  {
    for (const Geometry& g : geometries)
    {
      if (wanted("sampling"))
      {
        run({ seed, UsualWindow, UsualNoise, g }, true);
      }
    }
    for (const double window : windows)
    {
      for (const double noise : noises)
      {
        if (wanted("windows"))
        {
          run({ seed, window, noise, usual }, true);
        }
      }
    }
  }
  for (const std::uint64_t seed : ostiaSeeds)
  {
    if (wanted("ostia"))
    {
      run({ seed, UsualWindow, UsualNoise, usual }, false);
    }
  }

  const std::vector<Outcome> segmented = Segmented(outcomes);
  bool met = true;
  if (wanted("sampling"))
  {
    met &= PrintDiceBySeed(segmented, geometries);
    PrintByGeometry(segmented, geometries);
  }
  if (wanted("windows"))
  {
    PrintByWindowAndNoise(segmented, windows, noises, usual);
  }
  if (wanted("ostia"))
  {
    met &= PrintOstia(outcomes, ostiaSeeds, usual);
  }
  met &= PrintAllOstia(outcomes);
  if (listCases)
  {
    PrintCases(segmented);
  }
  return met ? 0 : 1;
}
}

int main(int argc, char** argv)
{
  try
  {
    return Validate(argc, argv);
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-segmentation: %s\n", error.what());
  }
  catch (...)
  {
    std::fputs("validate-segmentation: unknown error\n", stderr);
  }
  return 2;
}
