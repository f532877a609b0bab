// Trees of centerlines from images of phantoms, against their exact truth: from the image through
// ostia, vesselness, segmentation, extraction and topology to named branches, nothing given by
// hand. Tables in Markdown on stdout; the exit code is 1 when a limit is missed.

#include "CenterlineOverlap.h"
#include "CenterlineTopology.h"
#include "CoronaryPhantom.h"
#include "PhantomCases.h"
#include "PhantomScan.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

// What has to be reached in each phantom.
constexpr double MinimumOverlap = 0.97;     // OV and OT, vessels of MinimumRadius or more
constexpr double MaximumDistance = 0.20;    // AI, mm
constexpr double MaximumRadiusError = 0.15; // mean, mm
constexpr double BifurcationDistance = 1.5; // mm
constexpr double MaximumFalseBranch = 8.0;  // mm
constexpr double MinimumNamedShare = 0.95;  // of the labelled length
// Of the same voxels' tree in another frame:
constexpr double MaximumMeanDifference = 0.02; // mm
constexpr double MaximumDifference = 0.05;     // voxels
// In the coarse voxels of the quick run:
constexpr double MinimumQuickOverlap = 0.95;

constexpr double ReferencePhase = 0.75;
constexpr double MinimumRadius = 0.75; // mm
constexpr double BranchLength = 10.0;  // mm: shorter branches' bifurcations need not be found
constexpr double BesideVessel = 1.5;   // mm from any axis: nearer is no false branch
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

struct Case
{
  std::uint64_t seed;
  double window;                     ///< s
  double noise;                      ///< HU
  double spacing;                    ///< mm
  bool trueOstia;                    ///< seeds from the truth, to tell the stages' errors apart
  std::optional<double> pointSpread; ///< mm, standard deviation along all axes; else the phantom's

  PhantomSettings Settings() const;
};

PhantomSettings Case::Settings() const
{
  constexpr double noiseShare = 0.82; // docs/phantom.md
  PhantomSettings settings;
  settings.seed = this->seed;
  settings.temporalWindow = this->window;
  settings.noise = this->noise;
  if (this->pointSpread)
  {
    std::fill(std::begin(settings.pointSpread), std::end(settings.pointSpread), *this->pointSpread);
    settings.noiseCorrelation = noiseShare * *this->pointSpread;
  }
  return settings;
}

struct Outcome
{
  std::string failure;             ///< empty, or why there is no tree
  CenterlineOverlapMeasures tree;  ///< vessels of MinimumRadius or more, whole tree
  CenterlineOverlapMeasures all;   ///< of any radius
  CenterlineOverlapMeasures paths; ///< ordered correspondence, all paths together
  double longestMissed = NaN;      ///< mm, vessels of MinimumRadius or more
  double longestFalse = NaN;       ///< mm, more than BesideVessel from any axis
  int bifurcations = 0;
  int bifurcationsFound = 0;
  double namedShare = NaN;                  ///< of the found length that has a name in the truth
  std::map<std::string, double> wrongNames; ///< "true > given": mm
  std::vector<std::string> missed;          ///< bifurcations, rows of a table
  int branches = 0;
  std::array<double, 4> seconds{}; ///< processor: ostia and vesselness, mask, extraction, topology

  bool Met() const
  {
    return this->failure.empty() && this->tree.overlap >= MinimumOverlap &&
      this->tree.overlapRelevant >= MinimumOverlap &&
      this->tree.distanceInside <= MaximumDistance &&
      this->tree.radiusError <= MaximumRadiusError &&
      this->bifurcationsFound == this->bifurcations && this->longestFalse <= MaximumFalseBranch &&
      this->namedShare >= MinimumNamedShare;
  }
};

// ---------------------------------------------------------------------------------------------
// Against the truth
// ---------------------------------------------------------------------------------------------

struct Fork
{
  Vector3 point;
  std::vector<int> segments;  ///< of the branches that begin there
  double minimumRadius = 0.0; ///< mm, in the middle of the thinnest of them
};

/// Where two or more branches begin that are long enough, counted to their farthest tip.
template <typename Tree>
std::vector<Fork> ForksOf(const Tree& tree, double minimumLength)
{
  std::map<int, double> depth; // by group id
  for (auto branch = tree.branches.rbegin(); branch != tree.branches.rend(); ++branch)
  {
    double& own = depth[branch->groupId]; // so far: the deepest daughter
    own += branch->length;
    if (branch->parentGroupId >= 0)
    {
      double& parent = depth[branch->parentGroupId];
      parent = std::max(parent, own);
    }
  }
  std::map<std::int64_t, Fork> forks;
  for (const auto& branch : tree.branches)
  {
    if (depth[branch.groupId] <= minimumLength)
    {
      continue;
    }
    const double radius = tree.radius[branch.points[branch.points.size() / 2]];
    const auto [fork, isNew] = forks.try_emplace(branch.points.front());
    fork->second.point = tree.points[branch.points.front()];
    fork->second.segments.push_back(branch.segmentId);
    fork->second.minimumRadius = isNew ? radius : std::min(radius, fork->second.minimumRadius);
  }
  std::vector<Fork> result;
  for (const auto& [point, fork] : forks)
  {
    if (fork.segments.size() > 1)
    {
      result.push_back(fork);
    }
  }
  return result;
}

/// One to one, nearest pairs first.
void CompareForks(std::uint64_t seed, const std::vector<Fork>& truth,
  const std::vector<Fork>& found, Outcome& outcome)
{
  struct Pair
  {
    double distance;
    std::size_t truth, found;
  };
  std::vector<Pair> pairs;
  std::vector<double> nearest(truth.size(), std::numeric_limits<double>::infinity());
  for (std::size_t t = 0; t < truth.size(); ++t)
  {
    for (std::size_t f = 0; f < found.size(); ++f)
    {
      const double distance = (truth[t].point - found[f].point).norm();
      nearest[t] = std::min(nearest[t], distance);
      if (distance <= BifurcationDistance)
      {
        pairs.push_back({ distance, t, f });
      }
    }
  }
  std::sort(pairs.begin(), pairs.end(),
    [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  std::vector<char> truthUsed(truth.size(), 0);
  std::vector<char> foundUsed(found.size(), 0);
  for (const Pair& pair : pairs)
  {
    if (truthUsed[pair.truth] == 0 && foundUsed[pair.found] == 0)
    {
      truthUsed[pair.truth] = foundUsed[pair.found] = 1;
      ++outcome.bifurcationsFound;
    }
  }
  outcome.bifurcations = static_cast<int>(truth.size());
  for (std::size_t t = 0; t < truth.size(); ++t)
  {
    if (truthUsed[t] == 0)
    {
      std::string names;
      for (const int segment : truth[t].segments)
      {
        names += (names.empty() ? "" : ", ") + (segment == 0 ? "none" : SegmentName(segment));
      }
      std::array<char, 160> row;
      std::snprintf(row.data(), row.size(), "| %llu | %s | %.2f | %.2f |",
        static_cast<unsigned long long>(seed), names.c_str(), truth[t].minimumRadius, nearest[t]);
      outcome.missed.emplace_back(row.data());
    }
  }
}

/// Over the truth's length that was found and has a segment: the share with the same one.
void CompareNames(const PhantomTree& truth, const CenterlineTopology& found,
  const std::vector<CenterlinePointMatch>& matches, Outcome& outcome)
{
  double right = 0.0;
  double named = 0.0;
  for (const VesselTree::Branch& branch : truth.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const std::int64_t point = branch.points[i];
      if (truth.segmentId[point] == 0 || matches[point].match != CenterlineMatch::TruePositive)
      {
        continue;
      }
      const double length = (truth.points[point] - truth.points[branch.points[i - 1]]).norm();
      std::size_t nearest = 0;
      double minimum = std::numeric_limits<double>::infinity();
      for (std::size_t n = 0; n < found.points.size(); ++n)
      {
        const double distance = (found.points[n] - truth.points[point]).squaredNorm();
        if (distance < minimum)
        {
          minimum = distance;
          nearest = n;
        }
      }
      named += length;
      const int given = found.segmentId[nearest];
      if (given == truth.segmentId[point])
      {
        right += length;
      }
      else
      {
        outcome.wrongNames[SegmentName(truth.segmentId[point]) + " > " +
          (given == 0 ? "none" : SegmentName(given))] += length;
      }
    }
  }
  outcome.namedShare = named > 0.0 ? right / named : NaN;
}

void CompareWithTruth(
  const CoronaryPhantom& phantom, const CenterlineTopology& tree, Outcome& outcome)
{
  const PhantomTree truth = phantom.Tree(ReferencePhase);
  const Polylines truthSet = LinesOf(truth);
  const Polylines foundSet = LinesOf(tree);
  CenterlineOverlapSettings wide;
  wide.minimumRadius = MinimumRadius;
  const TreeOverlap overlap = CompareCenterlineTrees(truthSet, foundSet, wide);
  outcome.tree = overlap.total;
  outcome.longestMissed = overlap.longestMissed;
  const TreeOverlap all = CompareCenterlineTrees(truthSet, foundSet);
  outcome.all = all.total;
  outcome.paths = CompareCenterlinePaths(truthSet, foundSet).total;
  Polylines tolerant = truthSet;
  for (double& radius : tolerant.radius)
  {
    radius = std::max(radius, BesideVessel);
  }
  outcome.longestFalse = CompareCenterlineTrees(tolerant, foundSet).longestFalse;
  outcome.branches = static_cast<int>(tree.branches.size());
  CompareForks(phantom.Settings().seed, ForksOf(truth, BranchLength), ForksOf(tree, 0.0), outcome);
  CompareNames(truth, tree, all.reference, outcome);
}

PhantomScan MakeScan(const CoronaryPhantom& phantom, const Case& test, Outcome& outcome)
{
  return ScanPhantom(phantom, phantom.DefaultGrid(test.spacing), ReferencePhase, test.trueOstia,
    outcome.seconds.data());
}

Outcome Run(const Case& test)
{
  Outcome outcome;
  const CoronaryPhantom phantom(test.Settings());
  try
  {
    const PhantomScan scan = MakeScan(phantom, test, outcome);
    CompareWithTruth(phantom, TreeOf(scan, outcome.seconds.data() + 2), outcome);
  }
  catch (const std::exception& error)
  {
    outcome.failure = error.what();
  }
  return outcome;
}

// ---------------------------------------------------------------------------------------------
// Tables
// ---------------------------------------------------------------------------------------------

const char* Verdict(bool met)
{
  return met ? "met" : "**MISSED**";
}

/// Bold where the limit is missed.
std::string Number(const char* format, double value, bool met)
{
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), format, value);
  const std::string number = std::isfinite(value) ? text.data() : "none";
  return met ? number : "**" + number + "**";
}

std::string Row(const Outcome& o)
{
  const CenterlineOverlapMeasures& m = o.tree;
  std::array<char, 96> bifurcations;
  std::snprintf(bifurcations.data(), bifurcations.size(), "%s%d/%d%s",
    o.bifurcationsFound == o.bifurcations ? "" : "**", o.bifurcationsFound, o.bifurcations,
    o.bifurcationsFound == o.bifurcations ? "" : "**");
  double seconds = 0.0;
  for (const double s : o.seconds)
  {
    seconds += s;
  }
  return Number("%.3f", m.overlap, m.overlap >= MinimumOverlap) + " | " +
    Number("%.3f", m.overlapRelevant, m.overlapRelevant >= MinimumOverlap) + " | " +
    Number("%.3f", m.distanceInside, m.distanceInside <= MaximumDistance) + " | " +
    Number("%.3f", m.radiusError, m.radiusError <= MaximumRadiusError) + " | " +
    Number("%+.3f", m.radiusBias, true) + " | " + bifurcations.data() + " | " +
    Number("%.1f", o.longestFalse, o.longestFalse <= MaximumFalseBranch) + " | " +
    Number("%.1f", o.longestMissed, true) + " | " +
    Number("%.3f", o.namedShare, o.namedShare >= MinimumNamedShare) + " | " +
    Number("%.3f", o.all.overlap, true) + " | " + Number("%.3f", o.paths.overlap, true) + " | " +
    Number("%.3f", o.paths.overlapRelevant, true) + " | " +
    Number("%.3f", o.paths.distanceInside, true) + " | " + std::to_string(o.branches) + " | " +
    Number("%.1f", seconds, true) + " |";
}

void PrintHeader()
{
  std::printf(
    "| seed | OV | OT | AI, mm | radius error, mm | radius bias, mm | bifurcations | longest false "
    "branch, mm | longest missed, mm | right names | OV, any radius | OV by paths | OT by paths | "
    "AI by paths, mm | branches | CPU, s |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
}

/// @return whether all limits are met
bool PrintTable(const std::vector<Case>& cases, bool details, bool quick)
{
  PrintHeader();
  bool met = true;
  std::array<double, 4> seconds{};
  std::map<std::string, double> wrong;
  std::vector<std::string> missed;
  for (const Case& test : cases)
  {
    const Outcome o = Run(test);
    const auto seed = static_cast<unsigned long long>(test.seed);
    if (o.failure.empty())
    {
      std::printf("| %llu | %s\n", seed, Row(o).c_str());
    }
    else
    {
      std::printf("| %llu | **%s** |\n", seed, o.failure.c_str());
    }
    std::fflush(stdout);
    met = met &&
      (quick ? o.failure.empty() && o.tree.overlap >= MinimumQuickOverlap &&
            o.tree.distanceInside <= MaximumDistance && o.longestFalse <= MaximumFalseBranch
             : o.Met());
    for (std::size_t i = 0; i < seconds.size(); ++i)
    {
      seconds[i] += o.seconds[i] / static_cast<double>(cases.size());
    }
    missed.insert(missed.end(), o.missed.begin(), o.missed.end());
    for (const auto& [name, length] : o.wrongNames)
    {
      wrong[name] += length;
    }
  }
  std::printf("\nMean processor time: ostia and vesselness %.1f s, segmentation %.1f s, extraction "
              "%.1f s, topology and names %.1f s.\n",
    seconds[0], seconds[1], seconds[2], seconds[3]);
  if (quick)
  {
    std::printf("\nLimits in coarse voxels: OV at least %.2f, AI at most %.2f mm, no false branch "
                "longer than %.0f mm: %s\n",
      MinimumQuickOverlap, MaximumDistance, MaximumFalseBranch, Verdict(met));
  }
  else
  {
    std::printf(
      "\nLimits: OV and OT at least %.2f, AI at most %.2f mm, radius error at most %.2f mm, "
      "all bifurcations, no false branch longer than %.0f mm, %.0f %% of the length with "
      "the right name: %s\n",
      MinimumOverlap, MaximumDistance, MaximumRadiusError, MaximumFalseBranch,
      100.0 * MinimumNamedShare, Verdict(met));
  }
  if (details && !missed.empty())
  {
    std::printf("\n| seed | missed bifurcation of | least radius, mm | nearest found, mm |\n"
                "|---|---|---|---|\n");
    for (const std::string& row : missed)
    {
      std::printf("%s\n", row.c_str());
    }
  }
  if (details && !wrong.empty())
  {
    std::printf("\n| true name > given name | mm, all phantoms |\n|---|---|\n");
    for (const auto& [name, length] : wrong)
    {
      std::printf("| %s | %.0f |\n", name.c_str(), length);
    }
  }
  return met;
}

/// A similarity: x -> scale * (turn * x) + shift.
struct Frame
{
  const char* name;
  double scale;
  Matrix3 turn;
  Vector3 shift;

  Vector3 Apply(const Vector3& p) const { return this->scale * (this->turn * p) + this->shift; }
  Vector3 Undo(const Vector3& p) const
  {
    return this->turn.transpose() * (p - this->shift) / this->scale;
  }
};

/// The same voxels in other frames must give the same tree.
/// @return whether they do
bool PrintInvariance(const Case& test)
{
  std::printf("\n### The same voxels in other frames, seed %llu\n\n",
    static_cast<unsigned long long>(test.seed));
  const CoronaryPhantom phantom(test.Settings());
  Outcome outcome;
  const PhantomScan scan = MakeScan(phantom, test, outcome);
  const CenterlineTopology original = TreeOf(scan, outcome.seconds.data() + 2);
  const Polylines originalSet = LinesOf(original);
  const Matrix3 turn =
    Eigen::AngleAxisd(0.7, Vector3(0.4, -1.0, 0.6).normalized()).toRotationMatrix();
  const std::vector<Frame> frames = {
    { "metres", 1e-3, Matrix3::Identity(), Vector3::Zero() },
    { "turned by 40 degrees", 1.0, turn, Vector3::Zero() },
    { "shifted by 500 mm", 1.0, Matrix3::Identity(), Vector3(300.0, -400.0, 0.0) },
    { "all of it", 1e-3, turn, Vector3(0.3, -0.4, 0.0) },
  };
  std::printf("| frame | branches | mean distance, mm | largest distance, mm | mean difference of "
              "radii, mm | same names |\n|---|---|---|---|---|---|\n");
  bool met = true;
  for (const Frame& frame : frames)
  {
    PhantomScan moved = scan;
    moved.grid.origin = frame.Apply(scan.grid.origin);
    moved.grid.spacing = frame.scale * scan.grid.spacing;
    moved.grid.direction = frame.turn * scan.grid.direction;
    for (Vector3& seed : moved.seeds)
    {
      seed = frame.Apply(seed);
    }
    const CenterlineTopology tree = TreeOf(moved, outcome.seconds.data() + 2);
    Polylines back = LinesOf(tree);
    for (Vector3& p : back.points)
    {
      p = frame.Undo(p);
    }
    for (double& radius : back.radius)
    {
      radius /= frame.scale;
    }
    const TreeOverlap overlap = CompareCenterlineTrees(originalSet, back);
    double maximum = 0.0;
    for (const auto* side : { &overlap.reference, &overlap.result })
    {
      for (const CenterlinePointMatch& match : *side)
      {
        maximum = std::max(maximum, std::isnan(match.distance) ? 0.0 : match.distance);
      }
    }
    std::size_t same = 0;
    for (std::size_t b = 0; b < std::min(tree.branches.size(), original.branches.size()); ++b)
    {
      same += tree.branches[b].segmentId == original.branches[b].segmentId ? 1 : 0;
    }
    const double limit = MaximumDifference * test.spacing;
    const bool good = tree.branches.size() == original.branches.size() && maximum <= limit &&
      overlap.total.distance <= MaximumMeanDifference && same == original.branches.size();
    met = met && good;
    std::printf("| %s | %zu of %zu | %s | %s | %.4f | %zu of %zu |\n", frame.name,
      tree.branches.size(), original.branches.size(),
      Number("%.4f", overlap.total.distance, overlap.total.distance <= MaximumMeanDifference)
        .c_str(),
      Number("%.4f", maximum, maximum <= limit).c_str(), overlap.total.radiusError, same,
      original.branches.size());
  }
  std::printf("\nLimit: the same branches and names, at most %.2f mm apart in the mean and %.2f "
              "voxels anywhere: %s\n",
    MaximumMeanDifference, MaximumDifference, Verdict(met));
  return met;
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program("Trees of centerlines from images of phantoms, against their truth");
    std::string seedText = "101..110";
    double spacing = 0.4;
    double window = 66.0;
    double noise = 25.0;
    std::optional<double> pointSpread;
    bool invariance = false;
    bool trueOstia = false;
    bool details = false;
    bool quick = false;
    program.add_option("--seeds", seedText, "phantoms: one seed, or first..last")
      ->capture_default_str();
    program.add_option("--spacing", spacing, "voxel size, mm")
      ->check(CLI::Range(0.2, 2.0))
      ->capture_default_str();
    program.add_option("--window", window, "temporal window, ms")
      ->check(CLI::Range(0.0, 400.0))
      ->capture_default_str();
    program.add_option("--noise", noise, "standard deviation, HU")
      ->check(CLI::Range(0.0, 200.0))
      ->capture_default_str();
    program
      .add_option("--point-spread", pointSpread,
        "standard deviation of the blur along all axes, mm, with noise of that kernel "
        "(default: the phantom's medium kernel)")
      ->check(CLI::Range(0.0, 2.0));
    program.add_flag("--true-ostia", trueOstia, "start at the true ostia, not at those found");
    program.add_flag("--details", details, "also tables of missed bifurcations and wrong names");
    program.add_flag("--invariance", invariance,
      "also the first phantom in metres, turned and shifted: the tree must be the same");
    program.add_flag("--quick", quick,
      "one phantom in coarse voxels, with limits of its own, and its tree in other frames");
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
    spacing = quick ? 0.8 : spacing;
    std::vector<Case> cases;
    cases.reserve(seeds.size());
    for (const std::uint64_t seed : seeds)
    {
      cases.push_back({ seed, 1e-3 * window, noise, spacing, trueOstia, pointSpread });
    }
    std::printf(
      "Phantoms at t = %.2f, %.0f ms, %.0f HU, voxels of %.2f mm, seeds at the %s ostia.\n"
      "OV, OT, AI, radius error and longest missed: vessels down to a radius of %.2f mm, whole "
      "trees by nearest connections\n(docs/metrics.md). Bifurcations: those whose branches are "
      "longer than %.0f mm to their farthest tip, found within %.1f mm,\none to one. Longest false "
      "branch: more than %.1f mm from any axis, and outside of the lumen. Right names: share of\n"
      "the found length that has a segment in the truth.\n\n",
      ReferencePhase, window, noise, spacing, trueOstia ? "true" : "automatic", MinimumRadius,
      BranchLength, BifurcationDistance, BesideVessel);
    bool met = PrintTable(cases, details, quick);
    if (invariance || quick)
    {
      met = PrintInvariance(cases.front()) && met;
    }
    return met ? 0 : 1;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-centerline: %s\n", error.what());
    return 2;
  }
}
