// Trees of centerlines from images of diseased phantoms, against their exact truth: how much of the tree is found
// behind lesions, how much of what is found is no artery, and whether a loss is told. Nothing is given by hand.
// Tables in Markdown on stdout; the exit code is 1 when a limit is missed.

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
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

constexpr double ReferencePhase = 0.75;
constexpr double LeastRadius = 0.5;  // mm: thinner vessels need not be found
constexpr double FoundWithin = 1.5;  // mm from an axis
constexpr double LargestFalse = 5.0; // mm a tree
constexpr double LeastMeanOF = 0.90; // overlap until the first error, mean of all cases

/// A kind of case, what it changes, and the share of the tree that must be found.
struct Condition
{
  const char* name;
  double leastFound;
  std::function<void(PhantomSettings&)> change;
  double spacing = 0.5; ///< mm
};

std::vector<Condition> Conditions()
{
  const auto narrow = [](int count, double degree)
  {
    return [count, degree](PhantomSettings& s)
    {
      s.stenoses = count;
      s.stenosisDegree = degree;
    };
  };
  return {
    { "healthy", 0.99, [](PhantomSettings&) {} },
    { "stenoses-50", 0.98, narrow(4, 0.5) },
    { "stenoses-70", 0.98, narrow(4, 0.7) },
    { "stenoses-90", 0.95, narrow(4, 0.9) },
    { "calcified-10", 0.97, [](PhantomSettings& s) { s.calcifiedPlaques = 10; } },
    { "calcified-25", 0.97, [](PhantomSettings& s) { s.calcifiedPlaques = 25; } },
    { "stenoses-70-calcified-25", 0.97,
      [](PhantomSettings& s)
      {
        s.stenoses = 4;
        s.stenosisDegree = 0.7;
        s.calcifiedPlaques = 25;
      } },
    { "occlusion", 0.95, [](PhantomSettings& s) { s.chronicOcclusion = true; } },
    { "dim-contrast", 0.98, [](PhantomSettings& s) { s.lumenHU = 280.0; } },
    { "bright-vein", 0.98, [](PhantomSettings& s) { s.veinHU = 380.0; } },
    { "noise-60", 0.95, [](PhantomSettings& s) { s.noise = 60.0; } },
    { "left-ramus-60-calcified-20", 0.97,
      [](PhantomSettings& s)
      {
        s.dominance = Dominance::Left;
        s.ramus = true;
        s.stenoses = 6;
        s.stenosisDegree = 0.6;
        s.calcifiedPlaques = 20;
        s.noise = 30.0;
      } },
    { "stenoses-70-fine", 0.98, narrow(4, 0.7), 0.35 },
    { "stenoses-70-coarse", 0.95, narrow(4, 0.7), 0.7 },
  };
}

struct Outcome
{
  std::string failure;
  double found = 0.0;                     ///< share of the true length
  double missed = 0.0;                    ///< mm
  double wrong = 0.0;                     ///< mm of the result that is no artery
  double overlap = 0.0;                   ///< OV
  double toFirstError = 0.0;              ///< OF
  double relevant = 0.0;                  ///< OT
  double distance = 0.0;                  ///< AI, mm
  std::map<std::string, double> missedOf; ///< segment: mm
  double seconds = 0.0;                   ///< of processor time
};

/// The truth's and the result's lengths within a distance of each other.
void CompareLengths(const PhantomTree& truth, const CenterlineTopology& tree, Outcome& outcome)
{
  const auto near = [](const Vector3& p, const std::vector<Vector3>& points, double reach)
  {
    return std::any_of(points.begin(), points.end(),
      [&](const Vector3& q) { return (q - p).squaredNorm() <= reach * reach; });
  };
  double all = 0.0;
  for (const PhantomBranch& branch : truth.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const auto p = static_cast<std::size_t>(branch.points[i]);
      if (truth.radius[p] < LeastRadius && truth.visibility[p] > 0.0 &&
        truth.radius[static_cast<std::size_t>(branch.points.back())] < LeastRadius)
      {
        // Thin to its end: what is thin in a lesion only counts.
        const bool lesion = std::any_of(branch.points.begin() + static_cast<std::ptrdiff_t>(i),
          branch.points.end(),
          [&](std::int64_t q) { return truth.radius[static_cast<std::size_t>(q)] >= LeastRadius; });
        if (!lesion)
        {
          continue;
        }
      }
      const double length =
        (truth.points[p] - truth.points[static_cast<std::size_t>(branch.points[i - 1])]).norm();
      all += length;
      if (!near(truth.points[p], tree.points, FoundWithin))
      {
        outcome.missed += length;
        outcome.missedOf[truth.segmentId[p] == 0 ? "none" : SegmentName(truth.segmentId[p])] +=
          length;
      }
    }
  }
  outcome.found = all > 0.0 ? 1.0 - outcome.missed / all : 0.0;
  for (const CenterlineTree::Branch& branch : tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const auto p = static_cast<std::size_t>(branch.points[i]);
      bool right = false;
      for (std::size_t q = 0; q < truth.points.size() && !right; ++q)
      {
        const double reach = std::max(FoundWithin, truth.radius[q]);
        right = (truth.points[q] - tree.points[p]).squaredNorm() <= reach * reach;
      }
      if (!right)
      {
        outcome.wrong +=
          (tree.points[p] - tree.points[static_cast<std::size_t>(branch.points[i - 1])]).norm();
      }
    }
  }
}

/// Lines of the truth and the result as a legacy VTK file, to be looked at.
void WriteLines(const std::string& path, const CenterlineSet& set)
{
  std::ofstream file(path);
  file << "# vtk DataFile Version 3.0\nlines\nASCII\nDATASET POLYDATA\nPOINTS " << set.points.size()
       << " double\n";
  for (const Vector3& p : set.points)
  {
    file << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  }
  std::size_t size = 0;
  for (const auto& line : set.lines)
  {
    size += line.size() + 1;
  }
  file << "LINES " << set.lines.size() << ' ' << size << '\n';
  for (const auto& line : set.lines)
  {
    file << line.size();
    for (const std::int64_t p : line)
    {
      file << ' ' << p;
    }
    file << '\n';
  }
  file << "POINT_DATA " << set.points.size()
       << "\nSCALARS MaximumInscribedSphereRadius double 1\nLOOKUP_TABLE default\n";
  for (const double radius : set.radius)
  {
    file << radius << '\n';
  }
}

Outcome Run(
  const Condition& condition, std::uint64_t seed, bool trueOstia, const std::string& lines)
{
  Outcome outcome;
  PhantomSettings settings;
  settings.seed = seed;
  condition.change(settings);
  const CoronaryPhantom phantom(settings);
  try
  {
    std::array<double, 4> seconds{};
    const PhantomScan scan = ScanPhantom(
      phantom, phantom.DefaultGrid(condition.spacing), ReferencePhase, trueOstia, seconds.data());
    const CenterlineTopology tree = TreeOf(scan, seconds.data() + 2);
    for (const double s : seconds)
    {
      outcome.seconds += s;
    }
    const PhantomTree truth = phantom.Tree(ReferencePhase);
    CompareLengths(truth, tree, outcome);
    CenterlineOverlapSettings relevant;
    relevant.leastRadius = LeastRadius;
    relevant.spacing = 0.1;
    const CenterlineOverlapMeasures total =
      CompareCenterlineTrees(SetOf(truth), SetOf(tree), relevant).total;
    outcome.overlap = total.overlap;
    outcome.toFirstError = total.overlapToFirstError;
    outcome.relevant = total.overlapRelevant;
    outcome.distance = total.distanceInside;
    if (!lines.empty())
    {
      const std::string base = lines + "/" + condition.name + "-" + std::to_string(seed);
      WriteLines(base + "-truth.vtk", SetOf(truth));
      WriteLines(base + "-found.vtk", SetOf(tree));
    }
  }
  catch (const std::exception& error)
  {
    outcome.failure = error.what();
  }
  return outcome;
}

std::string List(const std::map<std::string, double>& lengths)
{
  std::string text;
  for (const auto& [name, length] : lengths)
  {
    if (length >= 3.0)
    {
      text += (text.empty() ? "" : ", ") + name + " " + std::to_string(std::lround(length));
    }
  }
  return text;
}

// In the coarse voxels of the quick run:
constexpr double LeastQuickFound = 0.85;
constexpr double LargestQuickFalse = 10.0; // mm a tree

/// What a condition's phantoms came to.
struct Summary
{
  int phantoms = 0;
  int failed = 0;
  double found = 0.0; ///< mean
  double least = 1.0;
  double wrong = 0.0; ///< mm a tree, mean
  double most = 0.0;
  double toFirstError = 0.0;
  double overlap = 0.0;

  void Add(const Outcome& o)
  {
    ++this->phantoms;
    if (!o.failure.empty())
    {
      ++this->failed;
      this->least = 0.0;
      return;
    }
    constexpr double trees = 2.0;
    this->found += o.found;
    this->least = std::min(this->least, o.found);
    this->wrong += o.wrong / trees;
    this->most = std::max(this->most, o.wrong / trees);
    this->toFirstError += o.toFirstError;
    this->overlap += o.overlap;
  }
  double Mean(double sum) const { return this->phantoms > 0 ? sum / this->phantoms : 0.0; }
};

void PrintRow(const Condition& condition, std::uint64_t seed, const Outcome& o)
{
  const auto number = static_cast<unsigned long long>(seed);
  if (!o.failure.empty())
  {
    std::printf("| %s | %llu | **%s** |\n", condition.name, number, o.failure.c_str());
  }
  else
  {
    std::printf("| %s | %llu | %.3f | %.1f | %.1f | %.3f | %.3f | %.3f | %.3f | %.1f | %s |\n",
      condition.name, number, o.found, o.missed, o.wrong, o.overlap, o.toFirstError, o.relevant,
      o.distance, o.seconds, List(o.missedOf).c_str());
  }
  std::fflush(stdout);
}

/// @return whether all limits are met: in the mean of a condition's phantoms
bool PrintSummaries(const std::vector<std::pair<Condition, Summary>>& summaries, bool quick)
{
  std::printf(
    "\n| condition | phantoms | found, mean | wanted | least | false a tree, mm, mean | most "
    "| OV, mean | OF, mean | |\n|---|---|---|---|---|---|---|---|---|---|\n");
  bool all = true;
  double firstErrors = 0.0;
  int phantoms = 0;
  for (const auto& [condition, s] : summaries)
  {
    const double wanted = quick ? LeastQuickFound : condition.leastFound;
    const bool met = s.failed == 0 && s.Mean(s.found) >= wanted &&
      s.Mean(s.wrong) <= (quick ? LargestQuickFalse : LargestFalse);
    all = all && met;
    firstErrors += s.toFirstError;
    phantoms += s.phantoms;
    std::printf("| %s | %d | %.3f | %.2f | %.3f | %.1f | %.1f | %.3f | %.3f | %s |\n",
      condition.name, s.phantoms, s.Mean(s.found), wanted, s.least, s.Mean(s.wrong), s.most,
      s.Mean(s.overlap), s.Mean(s.toFirstError), met ? "met" : "**MISSED**");
  }
  const double mean = phantoms > 0 ? firstErrors / phantoms : 0.0;
  const bool ordered = quick || mean >= LeastMeanOF;
  std::printf("\nOF over all: %.3f, wanted %.2f: %s. False: at most %.0f mm a tree in the mean.\n",
    mean, quick ? 0.0 : LeastMeanOF, ordered ? "met" : "**MISSED**",
    quick ? LargestQuickFalse : LargestFalse);
  return all && ordered && phantoms > 0;
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program("Trees of centerlines from images of diseased phantoms, against their truth");
    std::string seedText = "401..420";
    std::vector<std::string> wanted;
    bool trueOstia = false;
    bool quick = false;
    std::string lines;
    program.add_option("--seeds", seedText, "phantoms: one seed, or first..last")
      ->capture_default_str();
    program.add_option("--conditions", wanted, "only these");
    program.add_option("--lines", lines, "folder for the lines of truth and result, *.vtk");
    program.add_flag("--true-ostia", trueOstia, "start at the true ostia, not at those found");
    program.add_flag(
      "--quick", quick, "one phantom of three conditions in coarse voxels, with limits of its own");
    std::vector<std::uint64_t> seeds;
    std::vector<Condition> conditions = Conditions();
    try
    {
      program.parse(argc, argv);
      seeds = ParseSeeds(quick ? "3" : seedText, LoneNumber::Seed);
      if (quick && wanted.empty())
      {
        wanted = { "stenoses-70", "occlusion", "dim-contrast" };
      }
      for (const std::string& name : wanted)
      {
        if (std::none_of(conditions.begin(), conditions.end(),
              [&](const Condition& condition) { return condition.name == name; }))
        {
          throw CLI::ValidationError("conditions", "there is no condition '" + name + "'");
        }
      }
    }
    catch (const CLI::ParseError& error)
    {
      return program.exit(error);
    }
    std::printf("Phantoms at t = %.2f, seeds at the %s ostia. Found: share of the true axis with a "
                "radius of %.1f mm or "
                "more (and of what is\nnarrowed within it) within %.1f mm of the result. False: "
                "farther than that, and than "
                "the lumen's radius, from any axis.\n\n",
      ReferencePhase, trueOstia ? "true" : "automatic", LeastRadius, FoundWithin);
    std::printf(
      "| condition | seed | found | missed, mm | false, mm | OV | OF | OT | AI, mm | CPU, s "
      "| missed of |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
    std::vector<std::pair<Condition, Summary>> summaries;
    for (Condition& condition : conditions)
    {
      if (!wanted.empty() &&
        std::find(wanted.begin(), wanted.end(), condition.name) == wanted.end())
      {
        continue;
      }
      condition.spacing = quick ? 0.8 : condition.spacing;
      Summary summary;
      for (const std::uint64_t seed : seeds)
      {
        const Outcome outcome = Run(condition, seed, trueOstia, lines);
        PrintRow(condition, seed, outcome);
        summary.Add(outcome);
      }
      summaries.emplace_back(condition, summary);
    }
    return PrintSummaries(summaries, quick) ? 0 : 1;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-disease: %s\n", error.what());
    return 2;
  }
}
