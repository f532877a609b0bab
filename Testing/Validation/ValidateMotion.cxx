// Centerlines tracked through series of images of phantoms, against their exact motion: the tree is
// found in the image of the reference phase, tracked at some phases, and compared at all of them.
// Tables in Markdown on stdout; the exit code is 1 when a limit is missed.

#include "CenterlineTracking.h"
#include "CoronaryPhantom.h"
#include "CounterRandom.h"
#include "MotionRegularization.h"
#include "PhantomCases.h"
#include "PhantomScan.h"
#include "PhaseInterpolation.h"

#include <CLI/CLI.hpp>

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

constexpr double ReferencePhase = 0.75;
constexpr double MinimumRadius = 0.75; // mm
constexpr double MinimumLength = 10.0; // mm, of branches whose volumes are compared

// What has to be reached in each phantom; distances at phases that were not tracked.
constexpr double MaximumMean = 0.30;        // mm, window up to 66 ms
constexpr double MaximumPercentile = 0.80;  // mm, 95 %, window up to 66 ms
constexpr double MaximumIdealMean = 0.20;   // mm, no window
constexpr double MaximumBlurredMean = 0.60; // mm, longer windows
constexpr double MaximumLossyMean = 0.45;   // mm, --lost
constexpr double MinimumCalledNear = 0.95;  // of the places called tracked, within 1 mm
constexpr double MaximumVolumeError = 0.05; // of a branch, any phase
constexpr double MaximumQuickMean = 0.60;   // mm, in the coarse voxels of the quick run

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

struct Case
{
  std::uint64_t seed = 1;
  double window = 0.066;     ///< s
  double noise = 25.0;       ///< HU
  double spacing = 0.4;      ///< mm
  double irregularity = 0.0; ///< mm, of the beat of each phase
  double margin = 8.0;       ///< mm, of the image around the tree's whole way
  bool trueTree = false;
  bool lost = false; ///< a systolic phase, and 40 % of the nodes in two others
  bool allPhases = false;
  double trackerNoise =
    0.0; ///< mm an axis, put on every tracked place; its confidence does not know
  bool filling = true;
  PhaseInterpolationMode mode = PhaseInterpolationMode::PeriodicCubic;
  std::string cache; ///< folder for images, or empty
};

struct Errors
{
  std::vector<double> values;
  void Add(double value) { this->values.push_back(value); }
  double Mean() const
  {
    return this->values.empty() ? NaN
                                : std::accumulate(this->values.begin(), this->values.end(), 0.0) /
        static_cast<double>(this->values.size());
  }
  double Percentile(double share)
  {
    if (this->values.empty())
    {
      return NaN;
    }
    const auto rank =
      static_cast<std::ptrdiff_t>(share * static_cast<double>(this->values.size() - 1));
    std::nth_element(this->values.begin(), this->values.begin() + rank, this->values.end());
    return this->values[rank];
  }
};

/// Of one branch at one phase: found over true.
struct BranchVolume
{
  std::string segment;
  double time = 0.0;
  double volume = 1.0;
  double length = 1.0;
  double calibre = 1.0;
  double stretch = 1.0; ///< true length over that at the reference
};

struct Outcome
{
  Errors between;  ///< distance to the true axis, phases not tracked, mm
  Errors tracked;  ///< the same at the phases tracked
  Errors material; ///< distance to where the same material is, phases not tracked
  Errors materialTracked;
  Errors volume; ///< of branches, relative, all phases
  std::vector<BranchVolume> branchVolumes;
  std::map<std::string, Errors> bySegment;
  std::vector<double> byPhase;                       ///< mean, all phases
  std::vector<std::array<double, 2>> calibre;        ///< per tracked phase: found, true, means
  std::array<std::array<int, 2>, 10> byConfidence{}; ///< nodes, of them within 1 mm
  int called = 0;                                    ///< nodes called tracked
  int calledNear = 0;                                ///< of them within 1 mm
  double maximumMove = 0.0;                          ///< mm, by the limits
  std::vector<double> noise; ///< mm, per tracked phase, as the limits take it
};

/// What the tracker found, before it is judged.
struct Tracked
{
  Polylines lines;
  std::vector<std::string> name; ///< of each point
  PoseSequence poses;
  CenterlineTrackingReport report;
  double seconds = NaN; ///< without the images
};

std::vector<std::int16_t> ImageAt(
  const CoronaryPhantom& phantom, const ImageGrid& grid, double t, const Case& test)
{
  const auto size = static_cast<std::size_t>(grid.extent[1] - grid.extent[0] + 1) *
    (grid.extent[3] - grid.extent[2] + 1) * (grid.extent[5] - grid.extent[4] + 1);
  std::vector<std::int16_t> values(size);
  std::array<char, 180> name;
  std::snprintf(name.data(), name.size(), "/%llu-%.0f-%.0f-%.3f-%.1f-%d-%.2f-%.5f.raw",
    static_cast<unsigned long long>(test.seed), 1e3 * test.window, test.noise, test.spacing,
    test.margin, test.lost ? 1 : 0, test.irregularity, t);
  const std::string path = test.cache + name.data();
  if (!test.cache.empty() && std::filesystem::exists(path))
  {
    std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(2 * size));
    return values;
  }
  phantom.Render(grid, grid.extent, t, values.data());
  if (!test.cache.empty())
  {
    std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(2 * size));
  }
  return values;
}

double DistanceToAxis(const PhantomTree& tree, const Vector3& point)
{
  double minimum = std::numeric_limits<double>::infinity();
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t n = 0; n + 1 < branch.points.size(); ++n)
    {
      const Vector3& a = tree.points[branch.points[n]];
      const Vector3& b = tree.points[branch.points[n + 1]];
      minimum = std::min(minimum, NearestOnSegment(point, a, b).squaredDistance);
    }
  }
  return std::sqrt(minimum);
}

std::vector<double> EveryOther(const std::vector<double>& all, std::size_t step)
{
  std::vector<double> times;
  for (std::size_t k = 0; k < all.size(); k += step)
  {
    times.push_back(all[k]);
  }
  return times;
}

/// Places of the lines at a phase against the truth. @param phase  of the poses; -1: it was not tracked
/// @param truly  where the material of a point is
Errors JudgePoints(const std::vector<Vector3>& points, const std::vector<double>& radius,
  const std::vector<Vector3>& truly, const PhantomTree& truth, const std::vector<std::string>& name,
  const PoseSequence& poses, std::ptrdiff_t phase, Outcome& outcome)
{
  const bool isTracked = phase >= 0;
  Errors here;
  for (std::size_t p = 0; p < points.size(); ++p)
  {
    if (radius[p] < MinimumRadius)
    {
      continue;
    }
    const double distance = DistanceToAxis(truth, points[p]);
    const double carried = (points[p] - truly[p]).norm();
    here.Add(distance);
    outcome.bySegment[name[p]].Add(carried);
    (isTracked ? outcome.tracked : outcome.between).Add(distance);
    if (!isTracked)
    {
      outcome.material.Add(carried);
      continue;
    }
    outcome.materialTracked.Add(carried);
    auto& bin = outcome.byConfidence[std::min<std::size_t>(
      static_cast<std::size_t>(10.0 * poses.confidence[phase][p]), 9)];
    ++bin[0];
    bin[1] += carried <= 1.0 ? 1 : 0;
    if (poses.status[phase][p] == TrackingStatus::Tracked)
    {
      ++outcome.called;
      outcome.calledNear += carried <= 1.0 ? 1 : 0;
    }
  }
  return here;
}

PhantomSettings SettingsOf(const Case& test)
{
  PhantomSettings settings;
  settings.seed = test.seed;
  settings.temporalWindow = test.window;
  settings.noise = test.noise;
  settings.beatIrregularity = test.irregularity;
  if (test.lost)
  {
    const std::vector<double> all = PaperPhases();
    settings.lostPhases = { { all[6], 1.0 }, { all[4], 0.4 }, { all[8], 0.4 } };
  }
  return settings;
}

void AddNoise(double deviation, std::uint64_t seed, PoseSequence& poses)
{
  for (std::size_t k = 0; k < poses.points.size(); ++k)
  {
    RandomStream random(seed, 7001 + k);
    for (Vector3& point : poses.points[k])
    {
      point += deviation * Vector3(random.Normal(), random.Normal(), random.Normal());
    }
  }
}

Tracked Track(const Case& test, const CoronaryPhantom& phantom)
{
  Tracked result;
  const ImageGrid grid = phantom.DefaultGrid(test.spacing, test.margin);
  if (test.trueTree)
  {
    const PhantomTree truth = phantom.Tree(ReferencePhase);
    result.lines = LinesOf(truth);
    for (const int id : truth.segmentId)
    {
      result.name.push_back(SegmentName(id));
    }
  }
  else
  {
    const CenterlineTopology tree = TreeOf(ScanPhantom(phantom, grid, ReferencePhase, false));
    result.lines = LinesOf(tree);
    for (const int id : tree.segmentId)
    {
      result.name.push_back(SegmentName(id));
    }
  }
  const PhantomSettings settings = SettingsOf(test);
  CenterlineTrackingSettings tracking;
  tracking.temporalWindow = settings.temporalWindow;
  tracking.cycleLength = settings.cycleLength;
  tracking.fillUnseen = test.filling;
  std::vector<std::int16_t> voxels;
  double inImages = 0.0;
  const auto now = []() { return std::chrono::steady_clock::now(); };
  const auto since = [&](auto start)
  { return std::chrono::duration<double>(now() - start).count(); };
  const auto start = now();
  result.poses = TrackCenterlines(
    result.lines, ReferencePhase, EveryOther(PaperPhases(), test.allPhases ? 1 : 2),
    [&](double time)
    {
      const auto before = now();
      voxels = ImageAt(phantom, grid, time, test);
      inImages += since(before);
      ScalarImage image;
      image.grid = grid;
      image.values = static_cast<const std::int16_t*>(voxels.data());
      return image;
    },
    tracking, &result.report);
  result.seconds = since(start) - inImages;
  AddNoise(test.trackerNoise, test.seed, result.poses);
  return result;
}

/// Volumes of the branches as carried, against those of the same lines under the true motion.
/// @param truly  where the material of each point is. @param widening  true factor of the radius
void JudgeVolumes(const Tracked& tracked, const std::vector<Vector3>& points,
  const std::vector<Vector3>& truly, double time, double calibre, double widening, Outcome& outcome)
{
  const Polylines& lines = tracked.lines;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    double length = 0.0;
    double found = 0.0;
    double right = 0.0;
    double lengthFound = 0.0;
    double lengthRight = 0.0;
    for (std::size_t n = 0; n + 1 < line.size(); ++n)
    {
      const std::int64_t p = line[n];
      const std::int64_t q = line[n + 1];
      const double area = lines.radius[p] * lines.radius[p] + lines.radius[q] * lines.radius[q];
      length += (lines.points[q] - lines.points[p]).norm();
      const double carried = (points[q] - points[p]).norm();
      const double carriedTruly = (truly[q] - truly[p]).norm();
      lengthFound += carried;
      lengthRight += carriedTruly;
      found += area * calibre * calibre * carried;
      right += area * widening * widening * carriedTruly;
    }
    const std::int64_t middle = line[line.size() / 2];
    if (length >= MinimumLength && lines.radius[middle] >= MinimumRadius)
    {
      outcome.volume.Add(std::abs(found / right - 1.0));
      outcome.branchVolumes.push_back({ tracked.name[middle], time, found / right,
        lengthFound / lengthRight, calibre / widening, lengthRight / length });
    }
  }
}

Outcome Judge(const Case& test, const CoronaryPhantom& phantom, const Tracked& tracked,
  const PoseSequence& poses)
{
  Outcome outcome;
  const Polylines& lines = tracked.lines;
  std::vector<Vector3> material(lines.points.size());
  for (std::size_t p = 0; p < material.size(); ++p)
  {
    material[p] = phantom.ReferencePosition(lines.points[p], ReferencePhase);
  }
  const PhantomTree reference = phantom.Tree(ReferencePhase);
  PhaseInterpolationSettings between;
  between.mode = test.mode;
  const PhaseInterpolation interpolation(poses, between);
  InterpolatedPose pose;
  for (const double time : PaperPhases())
  {
    const PhantomTree truth = phantom.Tree(time);
    std::vector<Vector3> truly(material.size());
    for (std::size_t p = 0; p < material.size(); ++p)
    {
      truly[p] = phantom.Position(material[p], time);
    }
    const auto own = std::find(poses.times.begin(), poses.times.end(), time);
    const bool isTracked = own != poses.times.end();
    const std::ptrdiff_t phase = isTracked ? own - poses.times.begin() : -1;
    interpolation.Evaluate(time, pose);
    const std::vector<Vector3>& points = isTracked ? poses.points[phase] : pose.points;
    const Errors here =
      JudgePoints(points, lines.radius, truly, truth, tracked.name, poses, phase, outcome);
    outcome.byPhase.push_back(here.Mean());
    double widening = 0.0;
    for (std::size_t n = 0; n < truth.radius.size(); ++n)
    {
      widening += truth.radius[n] / reference.radius[n] / static_cast<double>(truth.radius.size());
    }
    const double calibre = isTracked ? poses.calibre[phase][0] : pose.calibre[0];
    JudgeVolumes(tracked, points, truly, time, calibre, widening, outcome);
    if (isTracked)
    {
      const std::vector<double>& found = poses.calibre[phase];
      outcome.calibre.push_back(
        { std::accumulate(found.begin(), found.end(), 0.0) / static_cast<double>(found.size()),
          widening });
    }
  }
  return outcome;
}

/// As tracked, and as the limits leave it, which is what `run` goes on with.
std::array<Outcome, 2> Run(const Case& test, Tracked& tracked)
{
  const CoronaryPhantom phantom(SettingsOf(test));
  tracked = Track(test, phantom);
  MotionRegularizationSettings limits;
  limits.temporalWeight = TemporalWeightOf(tracked.poses.NumberOfPhases());
  const RegularizedMotion limited = RegularizeMotion(tracked.poses, tracked.lines, limits);
  std::array<Outcome, 2> result{ Judge(test, phantom, tracked, tracked.poses),
    Judge(test, phantom, tracked, limited.poses) };
  result[1].maximumMove = limited.maximumMove;
  result[1].noise = limited.noise;
  return result;
}

void PrintDetails(Outcome& o, const std::vector<double>& trackedShare)
{
  std::printf("by phase:");
  for (const double value : o.byPhase)
  {
    std::printf(" %.2f", value);
  }
  std::printf("\ntracked share:");
  for (const double value : trackedShare)
  {
    std::printf(" %.2f", value);
  }
  std::printf("\ncalibre:");
  for (const std::array<double, 2>& value : o.calibre)
  {
    std::printf(" %.3f/%.3f", value[0], value[1]);
  }
  std::printf("\nwithin 1 mm, by confidence:");
  for (const std::array<int, 2>& bin : o.byConfidence)
  {
    std::printf(" %.3f of %d,", bin[1] / std::max(1.0, 1.0 * bin[0]), bin[0]);
  }
  std::printf("\nnoise, mm:");
  for (const double value : o.noise)
  {
    std::printf(" %.2f", value);
  }
  std::printf("\nvolumes that are off most:");
  std::sort(o.branchVolumes.begin(), o.branchVolumes.end(),
    [](const BranchVolume& a, const BranchVolume& b)
    { return std::abs(a.volume - 1.0) > std::abs(b.volume - 1.0); });
  for (std::size_t n = 0; n < std::min<std::size_t>(o.branchVolumes.size(), 8); ++n)
  {
    const BranchVolume& own = o.branchVolumes[n];
    std::printf(" %s at %.3f %.3f (length %.3f of %.3f, calibre %.3f),", own.segment.c_str(),
      own.time, own.volume, own.length, own.stretch, own.calibre);
  }
  std::printf("\nmaterial by segment:");
  for (auto& [segment, errors] : o.bySegment)
  {
    std::printf(" %s %.2f/%.2f", segment.c_str(), errors.Mean(), errors.Percentile(0.95));
  }
  std::printf("\n");
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program(
      "Centerlines tracked through series of images of phantoms, against their truth");
    std::string seedText = "101..110";
    double window = 66.0;
    bool quick = false;
    bool details = false;
    Case test;
    program.add_option("--seeds", seedText, "phantoms: one seed, or first..last")
      ->capture_default_str();
    program.add_option("--spacing", test.spacing, "voxel size, mm")
      ->check(CLI::Range(0.2, 2.0))
      ->capture_default_str();
    program.add_option("--window", window, "temporal window, ms")
      ->check(CLI::Range(0.0, 400.0))
      ->capture_default_str();
    program.add_option("--noise", test.noise, "standard deviation, HU")
      ->check(CLI::Range(0.0, 200.0))
      ->capture_default_str();
    program.add_flag("--lost", test.lost,
      "one systolic phase is lost wholly, and 40 % of the nodes in two others");
    program
      .add_option("--irregularity", test.irregularity,
        "a beat of its own for each phase, mm (root mean square); judged at tracked phases")
      ->check(CLI::Range(0.0, 5.0))
      ->capture_default_str();
    program.add_flag("--all-phases", test.allPhases, "track all phases, not every other one");
    const std::map<std::string, PhaseInterpolationMode> modes{ { "linear",
                                                                 PhaseInterpolationMode::Linear },
      { "cubic", PhaseInterpolationMode::PeriodicCubic },
      { "low-noise", PhaseInterpolationMode::LowNoise } };
    program.add_option("--mode", test.mode, "interpolation: linear, cubic or low-noise")
      ->transform(CLI::CheckedTransformer(modes));
    program
      .add_option("--tracker-noise", test.trackerNoise,
        "put on every tracked place, standard deviation along each axis, mm; its confidence does "
        "not know")
      ->check(CLI::Range(0.0, 5.0))
      ->capture_default_str();
    program.add_flag("!--no-filling", test.filling, "what is not seen by the trajectories alone");
    program.add_flag("--true-tree", test.trueTree, "the true tree, not the one found");
    program
      .add_option("--cache", test.cache, "existing folder that keeps the images for other runs")
      ->check(CLI::ExistingDirectory);
    program.add_flag("--details", details, "also tables by segment and by phase");
    program.add_flag("--quick", quick, "one phantom in coarse voxels, with limits of its own");
    std::vector<std::uint64_t> seeds;
    try
    {
      program.parse(argc, argv);
      seeds = ParseSeeds(quick ? "1" : seedText, LoneNumber::Seed);
    }
    catch (const CLI::ParseError& error)
    {
      return program.exit(error);
    }
    test.spacing = quick ? 1.0 : test.spacing;
    test.trueTree = test.trueTree || quick;
    test.window = 1e-3 * window;
    std::printf(
      "Phantoms in voxels of %.2f mm, %.0f ms, %.0f HU, tracked at %s of the paper's 20 phases "
      "with "
      "the %s tree%s%s, noise of %.2f mm put on what was tracked.\n"
      "Distances of tracked points, vessels down to a radius of %.2f mm, to the true axis; and to "
      "where the same material truly is.\n"
      "Called tracked: share of the places with that status, and of them those whose material is "
      "within 1 mm.\n"
      "Volume: branches of %.0f mm or more, against the same lines under the true motion, all "
      "phases.\n\n",
      test.spacing, window, test.noise, test.allPhases ? "all" : "every other one",
      test.trueTree ? "true" : "found",
      test.lost ? ", one systolic phase lost wholly and 40 % of the nodes in two others" : "",
      test.irregularity > 0.0 ? ", each phase in a beat of its own" : "", test.trackerNoise,
      MinimumRadius, MinimumLength);
    std::printf(
      "| seed | limits | mean between, mm | 95 %% | material, mm | mean tracked, mm | 95 %% | "
      "material, mm | 95 %% | called tracked | of them near | repeat, mm | volume error | greatest "
      "| "
      "moved, mm | images | s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    const double mean = quick ? MaximumQuickMean
      : test.lost             ? MaximumLossyMean
      : test.window > 0.07    ? MaximumBlurredMean
      : test.window > 0.0     ? MaximumMean
                              : MaximumIdealMean;
    bool met = true;
    double volumes = 0.0;
    double sumOfMeans = 0.0;
    for (const std::uint64_t seed : seeds)
    {
      test.seed = seed;
      Tracked tracked;
      std::array<Outcome, 2> outcomes = Run(test, tracked);
      for (std::size_t limited = 0; limited < 2; ++limited)
      {
        Outcome& o = outcomes[limited];
        const double all = static_cast<double>(o.tracked.values.size());
        std::printf("| %llu | %s | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | "
                    "%.2f | %.3f | %.3f | %.2f | %d | %.1f |\n",
          static_cast<unsigned long long>(seed), limited != 0 ? "yes" : "no", o.between.Mean(),
          o.between.Percentile(0.95), o.material.Mean(), o.tracked.Mean(),
          o.tracked.Percentile(0.95), o.materialTracked.Mean(), o.materialTracked.Percentile(0.95),
          o.called / all, static_cast<double>(o.calledNear) / std::max(o.called, 1),
          tracked.report.repeatability, o.volume.Mean(), o.volume.Percentile(1.0), o.maximumMove,
          tracked.report.imagesRead, tracked.seconds);
        if (details)
        {
          PrintDetails(o, tracked.report.trackedShare);
        }
      }
      std::fflush(stdout);
      Outcome& o = outcomes[1];
      // No phase that was tracked tells how far off the beat of another one was.
      Errors& judged = test.allPhases || test.irregularity > 0.0 ? o.tracked : o.between;
      sumOfMeans += judged.Mean();
      met = met && o.calledNear >= MinimumCalledNear * o.called &&
        (quick || test.lost || test.window > 0.07 || judged.Percentile(0.95) <= MaximumPercentile);
      volumes = std::max(volumes, o.volume.Percentile(1.0));
    }
    const double overall = sumOfMeans / static_cast<double>(seeds.size());
    met = met && overall <= mean;
    std::printf(
      "\nMean of the means %.3f mm (limit %.2f mm)%s, %.0f %% of the places called tracked "
      "within 1 mm: %s\n",
      overall, mean,
      quick || test.lost || test.window > 0.07 ? "" : ", 95 % of each within 0.80 mm",
      100.0 * MinimumCalledNear, met ? "met" : "**MISSED**");
    if (!quick)
    {
      const bool good = volumes <= MaximumVolumeError;
      std::printf("Volume of every branch within %.0f %%: %s (greatest %.1f %%)\n",
        100.0 * MaximumVolumeError, good ? "met" : "**MISSED**", 100.0 * volumes);
      met = met && good;
    }
    return met ? 0 : 1;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-motion: %s\n", error.what());
    return 2;
  }
}
