// Trees and surfaces from images of diseased phantoms, against their exact truth: how much of the tree is found behind
// lesions, how much of what is found is no artery, how far the surface is from the wall, how well degrees of stenoses are
// measured, and whether a loss is told. Nothing is given by hand. Tables in Markdown on stdout; the exit code is 1 when a
// limit is missed.

#include "CenterlineOverlap.h"
#include "CoronaryPhantom.h"
#include "Losses.h"
#include "MeasuredLesions.h"
#include "MeshDistance.h"
#include "PhantomCases.h"
#include "PhantomScan.h"
#include "SweepSurface.h"
#include "VesselTips.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

constexpr double ReferencePhase = 0.75;
constexpr double MaximumFalse = 5.0;            // mm a tree
constexpr double MinimumMeanOF = 0.90;          // overlap until the first error, mean of all cases
constexpr double MaximumSurfaceDistance = 0.25; // mm, two-sided mean, mean of a condition
constexpr double GradedDegree = 0.5;    // lesions of this diameter stenosis and more are judged
constexpr double MinimumWithin = 0.90;  // of them with a lumen of 1 mm or more, within 10 points
constexpr double MinimumInRange = 0.90; // of the narrower ones, in the stated range of 90 %
// In the coarse voxels of the quick run:
constexpr double MinimumQuickFound = 0.85;
constexpr double MaximumQuickFalse = 10.0;  // mm a tree
constexpr double MaximumQuickSurface = 0.7; // mm

/// A kind of case, what it changes, and the share of the tree that must be found.
struct Condition
{
  const char* name;
  double minimumFound;
  std::function<void(PhantomSettings&)> change;
  double spacing = 0.5; ///< mm
  bool healthy = false;
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
    { "healthy", 0.99, [](PhantomSettings&) {}, 0.5, true },
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

struct Options
{
  bool trueOstia = false;
  bool surface = true;
  bool details = false;
  bool quick = false;
  std::string lines;    ///< folder
  std::string branches; ///< file
  std::string links;    ///< file
  std::string tips;     ///< file
};

struct Warned
{
  Said said;
  std::string names; ///< of what it names; empty: nothing is wrong there
};

struct Outcome
{
  std::string failure;
  LengthComparison lengths;
  double overlap = 0.0;       ///< OV
  double toFirstError = 0.0;  ///< OF
  double relevant = 0.0;      ///< OT
  double distance = 0.0;      ///< AI, mm
  std::string surfaceFailure; ///< why there is none
  double surface = 0.0;       ///< two-sided mean distance from the wall, mm
  double leftOut = 0.0;       ///< mm of the tree that the surface has not
  DegreeTally wide;           ///< lesions where 1 mm or more is left
  DegreeTally narrow;         ///< where less is left
  DegreeTally thin;           ///< the same, in vessels that are too thin to be graded
  std::vector<std::string> lesions;
  std::vector<Warned> warnings;
  std::vector<LostPath> untold;
  std::string branches; ///< rows of the table of branches
  std::string links;    ///< rows of the table of links
  std::string tips;     ///< rows of the table of tips
  double seconds = 0.0; ///< of processor time, with the picture and the truth

  bool HasToTell() const { return this->lengths.missed > MaximumUntold; }
  int Alarms() const
  {
    return static_cast<int>(std::count_if(this->warnings.begin(), this->warnings.end(),
      [](const Warned& warned) { return warned.names.empty(); }));
  }
};

/// Every case runs on one thread, its own.
double ThreadSeconds()
{
  std::timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Lines of the truth and the result as a legacy VTK file, to be looked at.
void WriteLines(const std::string& path, const Polylines& set)
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

/// The surface as `run` makes it of the tree, failures included.
void CompareSurface(const CoronaryPhantom& phantom, const VesselTree& tree, Outcome& outcome)
{
  VesselTree swept = tree;
  for (VesselTree::Branch& branch : swept.branches)
  {
    branch.name = SegmentName(branch.segmentId);
  }
  SweptSurface surface;
  try
  {
    surface = SweepVesselTree(swept, SweepSettings());
  }
  catch (const std::exception& error)
  {
    outcome.surfaceFailure = error.what();
    return;
  }
  for (const SweepLeftOut& part : surface.leftOut)
  {
    outcome.leftOut += part.length;
  }
  for (Said& said : WarningsOf(surface))
  {
    outcome.warnings.push_back({ std::move(said), "" });
  }
  const PhantomSurface wall = phantom.Surface(ReferencePhase);
  SurfaceMesh result;
  result.points = std::move(surface.points);
  result.triangles = std::move(surface.triangles);
  SurfaceMesh truth;
  truth.points = wall.points;
  truth.triangles = wall.triangles;
  MeshDistanceSettings settings;
  settings.hausdorff = false;
  settings.pointMeasures = false;
  settings.signedDistances = false;
  outcome.surface = CompareSurfaces(result, truth, settings).mean;
}

void CompareLesions(
  const CoronaryPhantom& phantom, const PhantomScan& scan, const FoundTree& found, Outcome& outcome)
{
  const std::vector<PhantomStenosis> truth = phantom.Stenoses(ReferencePhase);
  if (truth.empty())
  {
    return;
  }
  std::vector<Stenosis> lesions;
  if (!found.tree.branches.empty() && found.extraction.blur > 0.0)
  {
    lesions = MeasureLesions(found.tree, scan.Image(), found.extraction.blur).grading.lesions;
  }
  for (const LesionMatch& match : MatchLesions(truth, found.tree.points, lesions))
  {
    if (match.truth.degree < GradedDegree - 1e-6)
    {
      continue;
    }
    (match.Wide() ? outcome.wide : match.Graded() ? outcome.narrow : outcome.thin).Add(match);
    std::array<char, 200> row;
    std::snprintf(row.data(), row.size(),
      "%s of %.0f %% (%.2f mm left): ", SegmentName(match.truth.segmentId).c_str(),
      100.0 * match.truth.degree, 2.0 * match.truth.minimumRadius);
    std::string text = row.data();
    if (match.lesion < 0)
    {
      text += match.reached ? "not listed" : "not reached";
    }
    else
    {
      const Stenosis& lesion = lesions[static_cast<std::size_t>(match.lesion)];
      std::snprintf(row.data(), row.size(), "%.0f %%, range %.0f to %.0f, %s",
        100.0 * lesion.degree, 100.0 * lesion.degreeLow, 100.0 * lesion.degreeHigh,
        LesionKindName(lesion.kind));
      text += row.data();
    }
    outcome.lesions.push_back(text);
  }
}

/// A row of what the weights of odds are fitted to: share that is artery (of a tip: whether the vessel goes on), whether it is to be used, probability, place, signs.
template <std::size_t N>
std::string OddsRow(double artery, bool used, double probability, const Vector3& place,
  const std::array<double, N>& signs)
{
  std::array<char, 80> text;
  std::snprintf(text.data(), text.size(), "%.3f,%d,%.6f,%.1f,%.1f,%.1f", artery, used ? 1 : 0,
    probability, place[0], place[1], place[2]);
  std::string row = text.data();
  for (const double sign : signs)
  {
    std::snprintf(text.data(), text.size(), ",%.4f", sign);
    row += text.data();
  }
  return row + '\n';
}

/// What each branch was judged by, in every round.
std::string BranchRows(const PhantomTree& truth, const std::vector<VeinBranch>& judged)
{
  std::string rows;
  for (const VeinBranch& branch : judged)
  {
    rows += OddsRow(ShareOnArteries(truth, branch.path), branch.known, branch.probability,
      branch.path.back(), branch.signs);
  }
  return rows;
}

/// What each link was judged by, in every round: it is right when the way and what it leads to are artery.
std::string LinkRows(const PhantomTree& truth, const std::vector<ConsideredLink>& considered)
{
  std::string rows;
  for (const auto& [link, behind] : considered)
  {
    const double artery =
      std::min(ShareOnArteries(truth, link.points), ShareNearArteries(truth, behind));
    rows += OddsRow(artery, true, link.confidence, link.points.back(), link.signs);
  }
  return rows;
}

/// What each tip was judged by: the vessel goes on where a loss begins within some millimetres.
std::string TipRows(const LengthComparison& lengths, const VesselTree& tree)
{
  constexpr double ahead = 4.0; // mm
  constexpr double rest =
    5.0; // mm that are worth telling; of a few millimetres it is hard to say whether they should
  constexpr double little = 2.0;
  std::string rows;
  const std::vector<VesselPath> paths = VesselPaths(tree);
  const std::vector<VesselTip> tips = JudgeTips(tree, paths);
  for (std::size_t n = 0; n < paths.size(); ++n)
  {
    const VesselTip& tip = tips[n];
    const Vector3& place = tree.points[paths[n].points.back()];
    double lost = 0.0;
    for (const LostPath& loss : lengths.losses)
    {
      if (Distance(place, loss.points) < ahead)
      {
        lost = std::max(lost, loss.length);
      }
    }
    const double goesOn = lost >= rest ? 1.0 : lost > little ? 0.5 : 0.0;
    rows += OddsRow(goesOn, tip.goesOn > 0.0, tip.goesOn, place, tip.signs);
  }
  return rows;
}

/// What there is a reason to warn of, apart from losses and extras.
std::vector<Vector3> Troubles(const CoronaryPhantom& phantom, const PhantomScan& scan)
{
  constexpr double wrongOstium = 5.0; // mm
  std::vector<Vector3> places;
  const PhantomTree tree = phantom.Tree(ReferencePhase);
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    if (tree.visibility[p] <= 0.0)
    {
      places.push_back(tree.points[p]);
    }
  }
  for (const PhantomStenosis& stenosis : phantom.Stenoses(ReferencePhase))
  {
    places.push_back(stenosis.position);
  }
  for (const PhantomPlaque& plaque : phantom.Plaques(ReferencePhase))
  {
    places.push_back(plaque.centre);
  }
  for (const Vector3& seed : scan.seeds)
  {
    double minimum = wrongOstium + 1.0;
    for (const PhantomOstium& ostium : phantom.Ostia(ReferencePhase))
    {
      minimum = std::min(minimum, (ostium.position - seed).norm());
    }
    if (minimum > wrongOstium)
    {
      places.push_back(seed);
    }
  }
  return places;
}

/// Which warnings have a reason.
void JudgeWarnings(bool healthy, const std::vector<Vector3>& troubles, Outcome& outcome)
{
  std::vector<Said> all;
  for (Warned& warned : outcome.warnings)
  {
    all.push_back(warned.said);
    for (const LostPath& loss : outcome.lengths.losses)
    {
      if (loss.length >= 3.0 && Names(warned.said, loss))
      {
        warned.names += (warned.names.empty() ? "" : "; ") + loss.Text();
      }
    }
    if (!warned.names.empty())
    {
      continue;
    }
    if (warned.said.source == "surface")
    {
      // What a surface leaves out it does lack; of a healthy heart it should not.
      warned.names = healthy ? "" : "the surface";
    }
    else if (IsJustified(warned.said, outcome.lengths, troubles))
    {
      warned.names = "a lesion or a false branch";
    }
  }
  outcome.untold = Untold(outcome.lengths, all);
}

Outcome Run(const Condition& condition, std::uint64_t seed, const Options& options)
{
  Outcome outcome;
  const double start = ThreadSeconds();
  PhantomSettings settings;
  settings.seed = seed;
  condition.change(settings);
  const CoronaryPhantom phantom(settings);
  try
  {
    const PhantomScan scan = ScanPhantom(
      phantom, phantom.DefaultGrid(condition.spacing), ReferencePhase, options.trueOstia);
    const FoundTree found = FindTree(scan);
    const PhantomTree truth = phantom.Tree(ReferencePhase);
    outcome.lengths = CompareLengths(truth, found.tree);
    CenterlineOverlapSettings relevant;
    relevant.minimumRadius = MinimumRadius;
    relevant.spacing = 0.1;
    const CenterlineOverlapMeasures total =
      CompareCenterlineTrees(LinesOf(truth), LinesOf(found.tree), relevant).total;
    outcome.overlap = total.overlap;
    outcome.toFirstError = total.overlapToFirstError;
    outcome.relevant = total.overlapRelevant;
    outcome.distance = total.distanceInside;
    for (Said& said : WarningsOf(scan, found))
    {
      outcome.warnings.push_back({ std::move(said), "" });
    }
    CompareLesions(phantom, scan, found, outcome);
    if (options.surface)
    {
      CompareSurface(phantom, found.tree, outcome);
    }
    JudgeWarnings(condition.healthy, Troubles(phantom, scan), outcome);
    if (!options.branches.empty())
    {
      outcome.branches = BranchRows(truth, found.extraction.judged);
    }
    if (!options.links.empty())
    {
      outcome.links = LinkRows(truth, scan.considered);
    }
    if (!options.tips.empty())
    {
      outcome.tips = TipRows(outcome.lengths, found.tree);
    }
    if (!options.lines.empty())
    {
      const std::string base = options.lines + "/" + condition.name + "-" + std::to_string(seed);
      WriteLines(base + "-truth.vtk", LinesOf(truth));
      WriteLines(base + "-found.vtk", LinesOf(found.tree));
    }
  }
  catch (const std::exception& error)
  {
    outcome.failure = error.what();
  }
  outcome.seconds = ThreadSeconds() - start;
  return outcome;
}

/// What a condition's phantoms came to.
struct Summary
{
  int phantoms = 0;
  int failed = 0;
  double found = 0.0; ///< sums, unless said otherwise
  double minimum = 1.0;
  double wrong = 0.0; ///< mm a tree
  double most = 0.0;
  double toFirstError = 0.0;
  double overlap = 0.0;
  double relevant = 0.0;
  int surfaces = 0;
  double surface = 0.0; ///< mm
  double farthest = 0.0;
  double leftOut = 0.0;
  int toTell = 0; ///< cases
  int untold = 0; ///< cases
  int alarms = 0; ///< warnings
  DegreeTally wide;
  DegreeTally narrow;
  DegreeTally thin;
  double seconds = 0.0;

  void Add(const Outcome& o)
  {
    ++this->phantoms;
    this->seconds += o.seconds;
    if (!o.failure.empty())
    {
      ++this->failed;
      this->minimum = 0.0;
      return;
    }
    constexpr double trees = 2.0;
    this->found += o.lengths.found;
    this->minimum = std::min(this->minimum, o.lengths.found);
    this->wrong += o.lengths.wrong / trees;
    this->most = std::max(this->most, o.lengths.wrong / trees);
    this->toFirstError += o.toFirstError;
    this->overlap += o.overlap;
    this->relevant += o.relevant;
    this->surfaces += o.surfaceFailure.empty() ? 1 : 0;
    this->surface += o.surface;
    this->farthest = std::max(this->farthest, o.surface);
    this->leftOut += o.leftOut;
    this->toTell += o.HasToTell() ? 1 : 0;
    this->untold += o.untold.empty() ? 0 : 1;
    this->alarms += o.Alarms();
    this->wide.Add(o.wide);
    this->narrow.Add(o.narrow);
    this->thin.Add(o.thin);
  }
  double Mean(double sum) const { return this->phantoms > 0 ? sum / this->phantoms : 0.0; }
  double MeanSurface() const { return this->surfaces > 0 ? this->surface / this->surfaces : 0.0; }
};

struct Row
{
  Condition condition;
  Summary summary;
};

std::string Joined(const std::vector<LostPath>& paths, double minimum)
{
  std::string text;
  for (const LostPath& path : paths)
  {
    if (path.length >= minimum)
    {
      text += (text.empty() ? "" : "; ") + path.Text();
    }
  }
  return text;
}

void PrintHead(const Options& options)
{
  std::printf("Phantoms at t = %.2f, seeds at the %s ostia. Found: share of the true axis with a "
              "radius of %.1f mm or "
              "more (and of what is\nnarrowed within it) within %.1f mm of the result. False: "
              "farther than that, and than "
              "the lumen's radius, from any axis.\nSurface: two-sided mean distance (by area) of "
              "the swept surface and the phantom's whole wall. Lesions: those of %.0f %% or "
              "more\nwhere 1 mm or more is left, within %.0f points, of all. Told: of more than "
              "%.0f mm missed, the longest loss and every one above %.0f mm.\n\n",
    ReferencePhase, options.trueOstia ? "true" : "automatic", MinimumRadius, FoundWithin,
    100.0 * GradedDegree, 100.0 * DegreeTally::MaximumError, MaximumUntold, MaximumUntold);
  std::printf(
    "| condition | seed | found | missed, mm | false, mm | OV | OF | OT | AI, mm | surface, mm | "
    "left out, mm | lesions | told | warnings without reason | CPU, s | missed of "
    "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
}

void PrintCase(
  const Condition& condition, std::uint64_t seed, const Outcome& o, const Options& options)
{
  const auto number = static_cast<unsigned long long>(seed);
  if (!o.failure.empty())
  {
    std::printf("| %s | %llu | **%s** |\n", condition.name, number, o.failure.c_str());
    return;
  }
  std::array<char, 60> surface{ "-" };
  if (options.surface)
  {
    std::snprintf(
      surface.data(), surface.size(), o.surfaceFailure.empty() ? "%.3f" : "**none**", o.surface);
  }
  const std::string lesions = o.wide.Lesions() > 0
    ? std::to_string(o.wide.within) + " of " + std::to_string(o.wide.Lesions())
    : std::string("-");
  std::printf("| %s | %llu | %.3f | %.1f | %.1f | %.3f | %.3f | %.3f | %.3f | %s | %.0f | %s | %s "
              "| %d | %.0f | %s |\n",
    condition.name, number, o.lengths.found, o.lengths.missed, o.lengths.wrong, o.overlap,
    o.toFirstError, o.relevant, o.distance, surface.data(), o.leftOut, lesions.c_str(),
    !o.HasToTell()       ? "-"
      : o.untold.empty() ? "yes"
                         : "**no**",
    o.Alarms(), o.seconds, Joined(o.lengths.losses, 3.0).c_str());
}

/// Warnings, lesions, failures: what stands behind a case's row.
std::string Details(const Condition& condition, std::uint64_t seed, const Outcome& o, bool all)
{
  std::string text;
  const std::string begin = "* " + std::string(condition.name) + " " + std::to_string(seed) + ": ";
  if (!o.surfaceFailure.empty())
  {
    text += begin + "no surface: " + o.surfaceFailure + "\n";
  }
  for (const LostPath& loss : o.untold)
  {
    std::array<char, 120> place;
    const Vector3& p = loss.points.front();
    std::snprintf(place.data(), place.size(), " from (%.1f, %.1f, %.1f) on", p[0], p[1], p[2]);
    text += begin + "**untold**: " + loss.Text() + place.data() + "\n";
  }
  for (const Warned& warned : o.warnings)
  {
    if (warned.names.empty() || all)
    {
      text += begin + warned.said.source + " (" +
        (warned.names.empty() ? "**no reason**" : warned.names) + "): " + warned.said.what + "\n";
    }
  }
  for (const std::string& lesion : o.lesions)
  {
    text += all ? begin + lesion + "\n" : "";
  }
  return text;
}

/// @return whether all limits on trees and surfaces are met: in the mean of a condition's phantoms
bool PrintSummaries(const std::vector<Row>& rows, const Options& options)
{
  std::printf(
    "\n| condition | phantoms | failed | found, mean | wanted | least | false a tree, mm, "
    "mean | most | OV, mean | OF, mean | OT, mean | surface, mm, mean | most | no surface "
    "| left out, mm, mean | CPU, s, mean | "
    "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  bool all = true;
  double firstErrors = 0.0;
  int phantoms = 0;
  for (const auto& [condition, s] : rows)
  {
    const double wanted = options.quick ? MinimumQuickFound : condition.minimumFound;
    const int without = options.surface ? s.phantoms - s.failed - s.surfaces : 0;
    const bool met = s.failed == 0 && s.Mean(s.found) >= wanted &&
      s.Mean(s.wrong) <= (options.quick ? MaximumQuickFalse : MaximumFalse) && without == 0 &&
      (!options.surface ||
        s.MeanSurface() <= (options.quick ? MaximumQuickSurface : MaximumSurfaceDistance));
    all = all && met;
    firstErrors += s.toFirstError;
    phantoms += s.phantoms;
    std::printf("| %s | %d | %d | %.3f | %.2f | %.3f | %.1f | %.1f | %.3f | %.3f | %.3f | ",
      condition.name, s.phantoms, s.failed, s.Mean(s.found), wanted, s.minimum, s.Mean(s.wrong),
      s.most, s.Mean(s.overlap), s.Mean(s.toFirstError), s.Mean(s.relevant));
    if (options.surface)
    {
      std::printf(
        "%.3f | %.3f | %d | %.1f | ", s.MeanSurface(), s.farthest, without, s.Mean(s.leftOut));
    }
    else
    {
      std::printf("- | - | - | - | ");
    }
    std::printf("%.0f | %s |\n", s.Mean(s.seconds), met ? "met" : "**MISSED**");
  }
  const double mean = phantoms > 0 ? firstErrors / phantoms : 0.0;
  const bool ordered = options.quick || mean >= MinimumMeanOF;
  std::printf(
    "\nOF over all: %.3f, wanted %.2f: %s. In the mean of a condition false at most %.0f mm "
    "a tree, surface at most %.2f mm.\n",
    mean, options.quick ? 0.0 : MinimumMeanOF, ordered ? "met" : "**MISSED**",
    options.quick ? MaximumQuickFalse : MaximumFalse,
    options.quick ? MaximumQuickSurface : MaximumSurfaceDistance);
  return all && ordered && phantoms > 0;
}

/// @return whether the limits on degrees of stenoses are met, over all conditions
bool PrintLesions(const std::vector<Row>& rows, const Options& options)
{
  DegreeTally wide;
  DegreeTally narrow;
  DegreeTally thin;
  std::printf("\nLesions of %.0f %% or more; wide: 1 mm or more is left; thin: less is left, in a "
              "vessel of less than %.1f mm, which is not graded.\n\n| condition | wide | "
              "within %.0f points | mean error | in range | not listed | not reached | narrow | in "
              "range | mean error | not listed | not reached | thin | in range | not reached "
              "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    100.0 * GradedDegree, 2.0 * MinimumGradedRadius, 100.0 * DegreeTally::MaximumError);
  const auto print =
    [](const char* name, const DegreeTally& w, const DegreeTally& n, const DegreeTally& t)
  {
    std::printf("| %s | %d | %s | %+.3f | %s | %d | %d | %d | %s | %+.3f | %d | %d | %d | %s | %d "
                "|\n",
      name, w.Lesions(), ShareText(w.within, w.Lesions()).c_str(), w.sum / std::max(1, w.listed),
      ShareText(w.inRange, w.Lesions()).c_str(), w.unlisted, w.unreached, n.Lesions(),
      ShareText(n.inRange, n.Lesions()).c_str(), n.sum / std::max(1, n.listed), n.unlisted,
      n.unreached, t.Lesions(), ShareText(t.inRange, t.Lesions()).c_str(), t.unreached);
  };
  for (const auto& [condition, s] : rows)
  {
    wide.Add(s.wide);
    narrow.Add(s.narrow);
    thin.Add(s.thin);
    if (s.wide.Lesions() + s.narrow.Lesions() + s.thin.Lesions() > 0)
    {
      print(condition.name, s.wide, s.narrow, s.thin);
    }
  }
  print("all", wide, narrow, thin);
  const auto judge = [&](const char* what, int part, const DegreeTally& tally, double minimum)
  {
    const bool met = options.quick || part >= minimum * tally.Lesions();
    std::printf("%s: %s of %d, wanted %.0f %%: %s.\n", what,
      ShareText(part, tally.Lesions()).c_str(), tally.Lesions(),
      options.quick ? 0.0 : 100.0 * minimum, met ? "met" : "**MISSED**");
    return met;
  };
  std::printf("\n");
  const bool within = judge("Wide lesions within 10 points", wide.within, wide, MinimumWithin);
  return judge("Narrow ones in the stated range", narrow.inRange, narrow, MinimumInRange) && within;
}

/// @return whether all losses are told, and no healthy heart is warned of
bool PrintWarnings(const std::vector<Row>& rows, const Options& options)
{
  std::printf("\n| condition | phantoms | miss more than %.0f mm | of them told | warnings without "
              "reason | |\n|---|---|---|---|---|---|\n",
    MaximumUntold);
  bool all = true;
  int toTell = 0;
  int untold = 0;
  for (const auto& [condition, s] : rows)
  {
    const bool met = (options.quick || s.untold == 0) && !(condition.healthy && s.alarms > 0);
    all = all && met;
    toTell += s.toTell;
    untold += s.untold;
    std::printf("| %s | %d | %d | %d | %d | %s |\n", condition.name, s.phantoms, s.toTell,
      s.toTell - s.untold, s.alarms, met ? "met" : "**MISSED**");
  }
  std::printf("\nTold: %d of %d cases that miss more than %.0f mm. Wanted: all, and no warning of "
              "healthy hearts.\n",
    toTell - untold, toTell, MaximumUntold);
  return all;
}

/// Cases beside each other: as many as there are cores, and a gigabyte of free memory for each.
int DefaultJobs()
{
  long free = 0;
  std::ifstream file("/proc/meminfo");
  for (std::string line; std::getline(file, line);)
  {
    if (std::sscanf(line.c_str(), "MemAvailable: %ld kB", &free) == 1)
    {
      break;
    }
  }
  constexpr long gigabyte = 1 << 20; // kB
  return static_cast<int>(std::clamp<long>(free / gigabyte, 1, NumberOfThreads()));
}

/// A table of what odds are fitted to; nothing when it has no path.
class OddsTable
{
public:
  template <std::size_t N>
  OddsTable(const std::string& path, const std::array<const char*, N>& names)
  {
    if (path.empty())
    {
      return;
    }
    this->File.exceptions(std::ios::failbit | std::ios::badbit);
    this->File.open(path);
    this->File << "condition,seed,artery,used,probability,x,y,z";
    for (const char* name : names)
    {
      this->File << ',' << name;
    }
    this->File << '\n';
  }

  void Add(const Condition& condition, std::uint64_t seed, const std::string& rows)
  {
    std::istringstream lines(rows);
    for (std::string line; std::getline(lines, line);)
    {
      this->File << condition.name << ',' << seed << ',' << line << '\n';
    }
  }

private:
  std::ofstream File;
};

/// Runs the cases, prints their rows in order as they come.
std::vector<Row> RunAll(const std::vector<Condition>& conditions,
  const std::vector<std::uint64_t>& seeds, int jobs, const Options& options)
{
  std::vector<Row> rows;
  for (const Condition& condition : conditions)
  {
    rows.push_back({ condition, {} });
  }
  const auto count = static_cast<std::int64_t>(conditions.size() * seeds.size());
  std::vector<std::optional<Outcome>> outcomes(static_cast<std::size_t>(count));
  std::size_t printed = 0;
  std::string details;
  std::mutex mutex;
  OddsTable branches(options.branches, VeinSignNames());
  OddsTable links(options.links, LinkSignNames());
  OddsTable tips(options.tips, TipSignNames());
  SetNumberOfThreads(jobs);
  PrintHead(options);
  std::fflush(stdout);
  ParallelFor(count, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const auto at = static_cast<std::size_t>(n);
        Outcome outcome = Run(conditions[at / seeds.size()], seeds[at % seeds.size()], options);
        const std::lock_guard<std::mutex> lock(mutex);
        outcomes[at] = std::move(outcome);
        for (; printed < outcomes.size() && outcomes[printed]; ++printed)
        {
          Row& row = rows[printed / seeds.size()];
          const std::uint64_t seed = seeds[printed % seeds.size()];
          row.summary.Add(*outcomes[printed]);
          PrintCase(row.condition, seed, *outcomes[printed], options);
          branches.Add(row.condition, seed, outcomes[printed]->branches);
          links.Add(row.condition, seed, outcomes[printed]->links);
          tips.Add(row.condition, seed, outcomes[printed]->tips);
          details += Details(row.condition, seed, *outcomes[printed], options.details);
          outcomes[printed] = Outcome(); // its stretches and texts are of no more use
        }
        std::fflush(stdout);
      }
    });
  std::printf("\n%s", details.c_str());
  return rows;
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program("Trees and surfaces from images of diseased phantoms, against their truth");
    Options options;
    std::string seedText = "401..420";
    std::vector<std::string> wanted;
    bool noSurface = false;
    int jobs = 0;
    program.add_option("--seeds", seedText, "phantoms: one seed, or first..last")
      ->capture_default_str();
    program.add_option("--conditions", wanted, "only these");
    program
      .add_option("--jobs", jobs,
        "cases at a time, about 0.6 GB each; 0: as many as cores and free memory allow")
      ->check(CLI::Range(0, 64))
      ->capture_default_str();
    program.add_option("--lines", options.lines, "folder for the lines of truth and result, *.vtk");
    program.add_option("--branches", options.branches,
      "table of all branches that were judged to be artery or vein, *.csv");
    program.add_option(
      "--links", options.links, "table of all links across lesions that came to mind, *.csv");
    program.add_option("--tips", options.tips,
      "table of all tips that were judged to end a vessel or to be a lesion of it, *.csv");
    program.add_flag(
      "--true-ostia", options.trueOstia, "start at the true ostia, not at those found");
    program.add_flag("--no-surface", noSurface, "leave out the surfaces");
    program.add_flag("--details", options.details,
      "also all warnings and lesions, not only what is untold or without reason");
    program.add_flag("--quick", options.quick,
      "one phantom of three conditions in coarse voxels, with limits of its own");
    std::vector<std::uint64_t> seeds;
    std::vector<Condition> conditions;
    try
    {
      program.parse(argc, argv);
      seeds = ParseSeeds(options.quick ? "3" : seedText, LoneNumber::Seed);
      if (options.quick && wanted.empty())
      {
        wanted = { "stenoses-70", "occlusion", "dim-contrast" };
      }
      for (const Condition& condition : Conditions())
      {
        if (wanted.empty() ||
          std::find(wanted.begin(), wanted.end(), condition.name) != wanted.end())
        {
          conditions.push_back(condition);
          conditions.back().spacing = options.quick ? 0.8 : condition.spacing;
        }
      }
      if (!wanted.empty() &&
        conditions.size() != std::set<std::string>(wanted.begin(), wanted.end()).size())
      {
        std::string names;
        for (const Condition& condition : Conditions())
        {
          names += (names.empty() ? "" : ", ") + std::string(condition.name);
        }
        throw CLI::ValidationError("conditions", "there are only " + names);
      }
    }
    catch (const CLI::ParseError& error)
    {
      return program.exit(error);
    }
    options.surface = !noSurface;
    const std::vector<Row> rows =
      RunAll(conditions, seeds, jobs > 0 ? jobs : DefaultJobs(), options);
    const bool trees = PrintSummaries(rows, options);
    const bool lesions = PrintLesions(rows, options);
    const bool warnings = PrintWarnings(rows, options);
    return trees && lesions && warnings ? 0 : 1;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-disease: %s\n", error.what());
    return 2;
  }
}
