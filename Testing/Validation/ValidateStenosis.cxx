// Stenoses and calcifications of phantoms, as measured in their images, against what was put into them: degrees,
// lesions that do not exist, volumes of calcium, radii beside it. Tables in Markdown on stdout; the exit code is 1 when a
// limit is missed.

#include "CenterlineTopology.h"
#include "CoronaryPhantom.h"
#include "MeasuredLesions.h"
#include "PhantomCases.h"
#include "PhantomScan.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

constexpr double ReferencePhase = 0.75;
constexpr double MinimumShare = 0.90;       // of lesions above 50 % with a lumen of 1 mm or more
constexpr double TrueBlur = 0.40;           // mm, of the phantoms' images between voxels of 0.5 mm
constexpr double MaximumRadiusError = 0.20; // mean, mm, beside calcium
constexpr double MaximumFalse = 0.1;        // lesions a healthy phantom
constexpr double MinimumRadius = 0.75;      // mm, of what radii are compared at

struct Case
{
  std::string name;
  PhantomSettings settings;
  bool healthy = false;
};

struct Options
{
  double spacing = 0.5;
  bool trueAxes = false;
  bool details = false;
};

/// What came of all phantoms of one kind.
struct Outcome
{
  DegreeTally wide;   ///< where 1 mm or more is left
  DegreeTally narrow; ///< where less is left
  int falseLesions = 0;
  int falseCalcium = 0;
  int plaques = 0; ///< of which something is outside of the lumen
  int plaquesFound = 0;
  double trueVolume = 0.0;
  double volume = 0.0;
  double plainVolume = 0.0;
  std::vector<double> volumeErrors; ///< of single plaques, mm^3
  std::vector<double> before;       ///< radius errors of all points, mm
  std::vector<double> after;
  std::vector<double> besideBefore; ///< those beside calcium
  std::vector<double> besideAfter;
  std::vector<double> axisBefore; ///< distances from the true axis, beside calcium
  std::vector<double> axisAfter;
  int interpolated = 0;
  std::vector<std::string> rows;
};

double Mean(const std::vector<double>& values)
{
  double sum = 0.0;
  for (const double value : values)
  {
    sum += value;
  }
  return sum / static_cast<double>(values.size());
}

std::vector<double> Absolute(std::vector<double> values)
{
  for (double& value : values)
  {
    value = std::abs(value);
  }
  return values;
}

struct Nearest
{
  double distance = std::numeric_limits<double>::infinity();
  double radius = 0.0;
  std::size_t point = 0;
};

Nearest NearestTruth(const PhantomTree& truth, const Vector3& position)
{
  Nearest nearest;
  for (const VesselTree::Branch& branch : truth.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const std::int64_t a = branch.points[i - 1];
      const std::int64_t b = branch.points[i];
      const SegmentPlace place = NearestOnSegment(position, truth.points[a], truth.points[b]);
      const double distance = std::sqrt(place.squaredDistance);
      if (distance < nearest.distance)
      {
        nearest = { distance,
          truth.radius[a] + place.fraction * (truth.radius[b] - truth.radius[a]),
          static_cast<std::size_t>(place.fraction < 0.5 ? a : b) };
      }
    }
  }
  return nearest;
}

/// Lines as an extraction gives them, off the axes by chance and with radii that are too smooth, wherever the truth has
/// vessels: to measure lesions alone, whether or not the extraction gets past them.
VesselTree DisturbedTruth(const PhantomTree& truth, std::uint64_t seed)
{
  VesselTree tree = truth;
  for (const VesselTree::Branch& branch : truth.branches)
  {
    // A random walk that returns: about 0.1 mm over some millimetres.
    std::mt19937_64 random(seed * 1000 + static_cast<std::uint64_t>(branch.groupId));
    std::normal_distribution<double> normal;
    Vector3 off = Vector3::Zero();
    for (std::size_t i = 1; i + 1 < branch.points.size(); ++i)
    {
      off = 0.9 * off + 0.045 * Vector3(normal(random), normal(random), normal(random));
      tree.points[branch.points[i]] += off;
      double sum = 0.0;
      double weight = 0.0;
      for (std::size_t j = i < 12 ? 0 : i - 12; j < std::min(i + 13, branch.points.size()); ++j)
      {
        sum += truth.radius[branch.points[j]];
        weight += 1.0;
      }
      tree.radius[branch.points[i]] = sum / weight;
    }
  }
  MeasureTree(tree);
  return tree;
}

/// The volume of a plaque that lies outside of the lumen, mm^3.
double VisibleVolume(const CoronaryPhantom& phantom, const PhantomPlaque& plaque)
{
  constexpr int steps = 24;
  const double step = 2.0 * plaque.radius / steps;
  ImageGrid grid;
  grid.extent = { 0, steps - 1, 0, steps - 1, 0, steps - 1 };
  grid.spacing = Vector3::Constant(step);
  grid.origin = plaque.centre - Vector3::Constant(plaque.radius - 0.5 * step);
  std::vector<float> distances(static_cast<std::size_t>(steps) * steps * steps);
  phantom.LumenDistances(grid, grid.extent, ReferencePhase, 3.0, distances.data());
  std::size_t inside = 0;
  std::size_t at = 0;
  for (int k = 0; k < steps; ++k)
  {
    for (int j = 0; j < steps; ++j)
    {
      for (int i = 0; i < steps; ++i, ++at)
      {
        const bool within = (grid.IndexToWorld(i, j, k) - plaque.centre).norm() < plaque.radius;
        inside += within && distances[at] > 0.0F ? 1 : 0;
      }
    }
  }
  return static_cast<double>(inside) * step * step * step;
}

void CompareLesions(const CoronaryPhantom& phantom, const VesselTree& tree,
  const StenosisGrading& grading, Outcome& outcome)
{
  const auto seed = static_cast<unsigned long long>(phantom.Settings().seed);
  std::vector<char> used(grading.lesions.size(), 0);
  for (const LesionMatch& match :
    MatchLesions(phantom.Stenoses(ReferencePhase), tree.points, grading.lesions))
  {
    (match.Wide() ? outcome.wide : outcome.narrow).Add(match);
    const PhantomStenosis& truth = match.truth;
    std::array<char, 300> row;
    if (match.lesion < 0)
    {
      std::snprintf(row.data(), row.size(), "| %llu | %s | %.0f | %.2f | %.2f | %s | | | | |", seed,
        truth.vessel.c_str(), 100.0 * truth.degree, 2.0 * truth.minimumRadius,
        2.0 * truth.referenceRadius, match.reached ? "not listed" : "not reached");
      outcome.rows.emplace_back(row.data());
      continue;
    }
    used[static_cast<std::size_t>(match.lesion)] = 1;
    const Stenosis& lesion = grading.lesions[static_cast<std::size_t>(match.lesion)];
    std::snprintf(row.data(), row.size(),
      "| %llu | %s | %.0f | %.2f | %.2f | %.0f | %.0f..%.0f | %.2f | %.2f | %s %.1f |", seed,
      truth.vessel.c_str(), 100.0 * truth.degree, 2.0 * truth.minimumRadius,
      2.0 * truth.referenceRadius, 100.0 * lesion.degree, 100.0 * lesion.degreeLow,
      100.0 * lesion.degreeHigh, lesion.minimumDiameter, lesion.referenceDiameter,
      LesionKindName(lesion.kind), match.distance);
    outcome.rows.emplace_back(row.data());
  }
  for (std::size_t l = 0; l < used.size(); ++l)
  {
    if (used[l] == 0)
    {
      const Stenosis& lesion = grading.lesions[l];
      ++outcome.falseLesions;
      std::array<char, 300> row;
      std::snprintf(row.data(), row.size(),
        "| %llu | %s at %.0f mm | none | | | %.0f | %.0f..%.0f | %.2f | %.2f | %s |", seed,
        SegmentName(lesion.segmentId).c_str(), lesion.abscissaMinimum, 100.0 * lesion.degree,
        100.0 * lesion.degreeLow, 100.0 * lesion.degreeHigh, lesion.minimumDiameter,
        lesion.referenceDiameter, LesionKindName(lesion.kind));
      outcome.rows.emplace_back(row.data());
    }
  }
}

void CompareCalcium(const CoronaryPhantom& phantom, const CalciumMap& calcium, Outcome& outcome)
{
  std::vector<char> used(calcium.objects.size(), 0);
  // Plaques that touch are one object.
  std::vector<double> volumes(calcium.objects.size(), 0.0);
  for (const PhantomPlaque& plaque : phantom.Plaques(ReferencePhase))
  {
    const double visible = VisibleVolume(phantom, plaque);
    ++outcome.plaques;
    outcome.trueVolume += visible;
    std::size_t best = used.size();
    double minimum = plaque.radius + 1.0;
    for (std::size_t o = 0; o < used.size(); ++o)
    {
      const double distance = (calcium.objects[o].centre - plaque.centre).norm();
      const double reach = plaque.radius + std::cbrt(calcium.objects[o].volume) + 0.5;
      if (distance < std::max(minimum, 0.0) || (best == used.size() && distance < reach))
      {
        minimum = distance;
        best = o;
      }
    }
    if (best < used.size())
    {
      ++outcome.plaquesFound;
      used[best] = 1;
      volumes[best] += visible;
    }
  }
  for (std::size_t o = 0; o < used.size(); ++o)
  {
    outcome.volume += calcium.objects[o].correctedVolume;
    outcome.plainVolume += calcium.objects[o].volume;
    if (used[o] == 0)
    {
      ++outcome.falseCalcium;
    }
    else
    {
      outcome.volumeErrors.push_back(calcium.objects[o].correctedVolume - volumes[o]);
    }
  }
}

void CompareRadii(const PhantomTree& truth, const VesselTree& tree, const VesselTree& refined,
  const RefinedLumen& lumen, Outcome& outcome)
{
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    const Nearest before = NearestTruth(truth, tree.points[p]);
    const Nearest after = NearestTruth(truth, refined.points[p]);
    if (before.distance > 1.5 || before.radius < MinimumRadius)
    {
      continue;
    }
    outcome.before.push_back(tree.radius[p] - before.radius);
    outcome.after.push_back(refined.radius[p] - after.radius);
    outcome.interpolated += lumen.interpolated[p];
    if (lumen.calcium[p] != 0)
    {
      outcome.besideBefore.push_back(outcome.before.back());
      outcome.besideAfter.push_back(outcome.after.back());
      outcome.axisBefore.push_back(before.distance);
      outcome.axisAfter.push_back(after.distance);
    }
  }
}

void Run(const Case& test, const Options& options, Outcome& outcome)
{
  const CoronaryPhantom phantom(test.settings);
  const PhantomTree truth = phantom.Tree(ReferencePhase);
  ScalarImage image;
  PhantomScan scan;
  std::vector<std::int16_t> values;
  VesselTree tree;
  double blur = 0.0;
  if (options.trueAxes)
  {
    image.grid = phantom.DefaultGrid(options.spacing);
    values.resize(static_cast<std::size_t>(image.NumberOfVoxels()));
    phantom.Render(image.grid, image.grid.extent, ReferencePhase, values.data());
    image.values = static_cast<const std::int16_t*>(values.data());
    tree = DisturbedTruth(truth, test.settings.seed);
    blur = TrueBlur;
  }
  else
  {
    scan =
      ScanPhantom(phantom, phantom.DefaultGrid(options.spacing), ReferencePhase, true, nullptr);
    image.grid = scan.grid;
    image.values = static_cast<const std::int16_t*>(scan.values.data());
    tree = TreeOf(scan, nullptr, &blur);
  }
  const MeasuredLesions measured = MeasureLesions(tree, image, blur);
  CompareLesions(phantom, measured.refined, measured.grading, outcome);
  CompareCalcium(phantom, measured.calcium, outcome);
  CompareRadii(truth, tree, measured.refined, measured.lumen, outcome);
  if (options.details)
  {
    std::fprintf(stderr, "seed %llu: level %.0f background %.0f noise %.1f blur %.3f, %zu voxels\n",
      static_cast<unsigned long long>(test.settings.seed), measured.levels.level.front(),
      measured.levels.background, measured.levels.noise, blur, measured.calcium.voxels.size());
  }
}

void PrintRow(const Case& test, const Outcome& o)
{
  const auto mean = [](const DegreeTally& tally) { return tally.sum / std::max(1, tally.listed); };
  std::printf("| %s | %d | %s | %+.3f | %s | %d | %s | %+.3f | %s | %d | %d | %d |\n",
    test.name.c_str(), o.wide.listed, ShareText(o.wide.within, o.wide.listed).c_str(), mean(o.wide),
    ShareText(o.wide.inRange, o.wide.listed).c_str(), o.narrow.listed,
    ShareText(o.narrow.within, o.narrow.listed).c_str(), mean(o.narrow),
    ShareText(o.narrow.inRange, o.narrow.listed).c_str(), o.wide.unlisted + o.narrow.unlisted,
    o.wide.unreached + o.narrow.unreached, o.falseLesions);
}

void PrintCalciumRow(const Case& test, const Outcome& o)
{
  std::printf(
    "| %s | %d/%d | %d | %.1f | %.1f | %.1f | %.2f | %.3f | %.3f | %+.3f | %+.3f | %.3f | "
    "%.3f | %.3f | %.3f | %d |\n",
    test.name.c_str(), o.plaquesFound, o.plaques, o.falseCalcium, o.trueVolume, o.volume,
    o.plainVolume, Mean(Absolute(o.volumeErrors)), Mean(Absolute(o.before)),
    Mean(Absolute(o.after)), Mean(o.before), Mean(o.after), Mean(Absolute(o.besideBefore)),
    Mean(Absolute(o.besideAfter)), Mean(o.axisBefore), Mean(o.axisAfter), o.interpolated);
}

std::vector<Case> MakeCases()
{
  std::vector<Case> cases;
  const auto add = [&](const char* name, int stenoses, double degree, int plaques)
  {
    Case test;
    test.name = name;
    test.settings.stenoses = stenoses;
    test.settings.stenosisDegree = degree;
    test.settings.calcifiedPlaques = plaques;
    test.healthy = stenoses == 0 && plaques == 0;
    cases.push_back(test);
  };
  add("healthy", 0, 0.0, 0);
  add("4 of 50 %", 4, 0.5, 0);
  add("4 of 60 %", 4, 0.6, 0);
  add("4 of 70 %", 4, 0.7, 0);
  add("4 of 80 %", 4, 0.8, 0);
  add("4 of 90 %", 4, 0.9, 0);
  add("4 of 95 %", 4, 0.95, 0);
  add("12 calcifications", 0, 0.0, 12);
  add("4 of 60 %, 12 calcifications", 4, 0.6, 12);
  // Soft plaque of 90 HU is left around the lumen; above it is gone.
  add("plaques of 50, 70 and 90 %", 0, 0.0, 0);
  cases.back().healthy = false;
  AddDisease("stenosed", cases.back().settings);
  return cases;
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program("Stenoses and calcium measured in images of phantoms, against their truth");
    Options options;
    std::string seedText = "301..305";
    std::vector<std::string> only;
    double noise = 25.0;
    double window = 66.0;
    bool quick = false;
    program.add_option("--seeds", seedText, "phantoms: one seed, or first..last")
      ->capture_default_str();
    program.add_option("--spacing", options.spacing, "voxel size, mm")
      ->check(CLI::Range(0.2, 2.0))
      ->capture_default_str();
    program.add_option("--noise", noise, "standard deviation, HU")
      ->check(CLI::Range(0.0, 200.0))
      ->capture_default_str();
    program.add_option("--window", window, "temporal window, ms")
      ->check(CLI::Range(0.0, 400.0))
      ->capture_default_str();
    program.add_option("--only", only, "kinds of phantoms, by name; default: all");
    program.add_flag("--true-axes", options.trueAxes,
      "measure along the true axes, a little disturbed, instead of the extracted trees");
    program.add_flag("--details", options.details, "also a table of all lesions");
    program.add_flag("--quick", quick, "one phantom of three kinds, along the true axes");
    std::vector<std::uint64_t> seeds;
    try
    {
      program.parse(argc, argv);
      seeds = ParseSeeds(quick ? "301" : seedText, LoneNumber::Seed);
    }
    catch (const CLI::ParseError& error)
    {
      return program.exit(error);
    }
    options.trueAxes = options.trueAxes || quick;
    if (quick)
    {
      only = { "healthy", "4 of 60 %", "12 calcifications" };
    }
    std::printf("Phantoms at t = %.2f, %.0f ms, %.0f HU, voxels of %.2f mm, along %s.\n\n",
      ReferencePhase, window, noise, options.spacing,
      options.trueAxes ? "the true axes, disturbed by 0.1 mm" : "the extracted trees");
    std::vector<Case> cases;
    for (Case& test : MakeCases())
    {
      if (only.empty() || std::find(only.begin(), only.end(), test.name) != only.end())
      {
        cases.push_back(test);
      }
    }
    std::vector<Outcome> outcomes(cases.size());
    DegreeTally wide;
    int healthy = 0;
    int falseOnHealthy = 0;
    for (std::size_t c = 0; c < cases.size(); ++c)
    {
      for (const std::uint64_t seed : seeds)
      {
        Case test = cases[c];
        test.settings.seed = seed;
        test.settings.noise = noise;
        test.settings.temporalWindow = 1e-3 * window;
        Run(test, options, outcomes[c]);
      }
      if (cases[c].healthy)
      {
        healthy += static_cast<int>(seeds.size());
        falseOnHealthy += outcomes[c].falseLesions;
      }
      wide.Add(outcomes[c].wide);
    }
    std::printf("Degrees by diameter; a lumen is wide where 1 mm or more is left.\n\n"
                "| phantoms | wide lesions | within 10 points | mean error | in range | narrow "
                "ones | within 10 points | mean error | in range | not listed | not reached | "
                "false |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t c = 0; c < cases.size(); ++c)
    {
      PrintRow(cases[c], outcomes[c]);
    }
    std::printf(
      "\n| phantoms | calcifications found | false | true volume, mm^3 | measured | above the "
      "threshold | mean error of one, mm^3 | radius error before, mm | after | bias before | after "
      "| "
      "beside calcium before | after | axis error there before, mm | after | interpolated "
      "points |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t c = 0; c < cases.size(); ++c)
    {
      PrintCalciumRow(cases[c], outcomes[c]);
    }
    if (options.details)
    {
      std::printf(
        "\n| seed | vessel | true degree, %% | lumen left, mm | healthy, mm | degree, %% | "
        "range | lumen, mm | reference, mm | kind, distance "
        "|\n|---|---|---|---|---|---|---|---|---|---|\n");
      for (const Outcome& outcome : outcomes)
      {
        for (const std::string& row : outcome.rows)
        {
          std::printf("%s\n", row.c_str());
        }
      }
    }
    bool met = true;
    if (wide.listed > 0)
    {
      const double share = static_cast<double>(wide.within) / wide.listed;
      met = met && share >= MinimumShare;
      std::printf("\nWide lesions within %.0f points: %.0f %%, at least %.0f %% wanted: %s\n",
        100.0 * DegreeTally::MaximumError, 100.0 * share, 100.0 * MinimumShare,
        share >= MinimumShare ? "met" : "**MISSED**");
    }
    if (healthy > 0)
    {
      const double rate = falseOnHealthy / static_cast<double>(healthy);
      met = met && rate <= MaximumFalse;
      std::printf("\nFalse lesions a healthy phantom: %.2f, at most %.1f wanted: %s\n", rate,
        MaximumFalse, rate <= MaximumFalse ? "met" : "**MISSED**");
    }
    for (std::size_t c = 0; c < cases.size(); ++c)
    {
      if (cases[c].settings.calcifiedPlaques > 0)
      {
        const double error = Mean(Absolute(outcomes[c].besideAfter));
        met = met && error <= MaximumRadiusError;
        std::printf("\nRadius error beside calcium, %s: %.3f mm, at most %.2f wanted: %s\n",
          cases[c].name.c_str(), error, MaximumRadiusError,
          error <= MaximumRadiusError ? "met" : "**MISSED**");
      }
    }
    return met ? 0 : 1;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-stenosis: %s\n", error.what());
    return 2;
  }
}
