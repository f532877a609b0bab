// The swept surface of phantom trees, against the phantoms' exact walls. Tables in Markdown on
// stdout; the exit code is 1 when a limit is missed.

#include "CoronaryPhantom.h"
#include "Instrumented.h"
#include "PhantomCases.h"
#include "SurfaceMeasures.h"
#include "SweepSurface.h"
#include "TriangleBvh.h"
#include "TriangleIntersections.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

// What has to be reached.
constexpr double MinimumCornerAngle = 10.0;  // degrees, of every triangle
constexpr double GoodAngle = 20.0;           // degrees
constexpr double GoodAngleShare = 0.995;     // of the triangles
constexpr double EdgeTolerance = 0.3;        // of the wanted length
constexpr double EdgeShare = 0.95;           // of the edges
constexpr double MaximumMeanDistance = 0.05; // mm, each way
constexpr double MaximumDistance = 0.25;     // mm, each way
constexpr double LongestTime = 10.0;         // s on two cores: not more than this of one core
constexpr double TimedTriangles = 1e5;

struct Outcome
{
  std::uint64_t seed = 0;
  std::string variant;
  SurfaceMeasures measures;
  int trees = 0;
  std::size_t intersections = 0;
  double edgesGood = 0.0; ///< share
  double meanThere = 0.0; ///< from the surface to the wall, mm
  double maximumThere = 0.0;
  double meanBack = 0.0; ///< from the wall to the surface, mm
  double maximumBack = 0.0;
  double volumeError = 0.0; ///< relative
  double seconds = 0.0;
  double processorSeconds = 0.0;
  std::string failure;

  bool Sound() const
  {
    return this->failure.empty() && this->measures.Closed() && this->measures.Manifold() &&
      this->measures.unusedPoints == 0 && this->measures.volume > 0.0 &&
      this->measures.components == this->trees &&
      this->measures.eulerCharacteristic == 2 * this->trees && this->intersections == 0;
  }
  bool Shapely() const
  {
    return this->measures.WorstAngle() >= MinimumCornerAngle &&
      this->measures.ShareBelow(GoodAngle) <= 1.0 - GoodAngleShare && this->edgesGood >= EdgeShare;
  }
  bool Near() const
  {
    return std::max(this->meanThere, this->meanBack) <= MaximumMeanDistance &&
      std::max(this->maximumThere, this->maximumBack) <= MaximumDistance;
  }
  bool Quick() const
  {
    return Instrumented ||
      this->processorSeconds <=
      LongestTime * std::max(1.0, static_cast<double>(this->measures.triangles) / TimedTriangles);
  }
  bool Met() const { return this->Sound() && this->Shapely() && this->Near() && this->Quick(); }
};

/// The phantom's ends are cut by planes that move with the tissue: they are part of the truth.
std::vector<Vector3> EndNormals(const VesselTree& tree, const PhantomSurface& wall)
{
  std::vector<Vector3> normals(tree.points.size(), Vector3::Zero());
  std::map<int, std::pair<Vector3, Vector3>> caps; // area vector, and centre times area
  for (std::size_t t = 0; t < wall.triangles.size(); ++t)
  {
    if (wall.entityId[t] > 1)
    {
      const Vector3& a = wall.points[wall.triangles[t][0]];
      const Vector3& b = wall.points[wall.triangles[t][1]];
      const Vector3& c = wall.points[wall.triangles[t][2]];
      const Vector3 area = (b - a).cross(c - a);
      auto& cap = caps.emplace(wall.entityId[t], std::make_pair(Vector3::Zero(), Vector3::Zero()))
                    .first->second;
      cap.first += area;
      cap.second += area.norm() * (a + b + c) / 3.0;
    }
  }
  for (const auto& entry : caps)
  {
    const Vector3 centre = entry.second.second / entry.second.first.norm();
    std::int64_t nearest = tree.branches.front().points.front();
    for (const VesselTree::Branch& branch : tree.branches)
    {
      for (const std::int64_t p : { branch.points.front(), branch.points.back() })
      {
        if ((tree.points[p] - centre).squaredNorm() < (tree.points[nearest] - centre).squaredNorm())
        {
          nearest = p;
        }
      }
    }
    normals[nearest] = entry.second.first;
  }
  return normals;
}

void Distances(const std::vector<Vector3>& from, const TriangleBvh& to, double& mean,
  double& maximum, Vector3& where)
{
  std::vector<double> distance(from.size());
  ParallelFor(static_cast<std::int64_t>(from.size()), 256,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        distance[i] = to.Closest(from[i]).distance;
      }
    });
  mean = maximum = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i)
  {
    mean += distance[i] / static_cast<double>(from.size());
    if (distance[i] > maximum)
    {
      maximum = distance[i];
      where = from[i];
    }
  }
}

void WriteObj(const std::string& path, const SweptSurface& surface)
{
  std::ofstream file(path);
  for (const Vector3& p : surface.points)
  {
    file << "v " << p[0] << " " << p[1] << " " << p[2] << "\n";
  }
  for (const Triangle& t : surface.triangles)
  {
    file << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  }
}

Outcome Run(std::uint64_t seed, bool varied, double spacing, bool cut,
  const SweepSettings& settings, const std::string& folder)
{
  Outcome outcome;
  outcome.seed = seed;
  outcome.variant = varied ? "varied" : "plain";
  PhantomCase which = MakePhantomCase(seed, varied);
  which.settings.surfaceSpacing = spacing;
  const CoronaryPhantom phantom(which.settings);
  const PhantomTree tree = phantom.Tree(which.moment);
  const PhantomSurface wall = phantom.Surface(which.moment);
  SweepSections sections;
  if (cut)
  {
    sections.endNormals = EndNormals(tree, wall);
  }
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t processor = std::clock();
  SweptSurface surface;
  try
  {
    surface = SweepVesselTree(tree, settings, sections);
  }
  catch (const std::exception& error)
  {
    outcome.failure = error.what();
    return outcome;
  }
  outcome.processorSeconds = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC;
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  outcome.trees = 2;
  outcome.measures = MeasureSurface(surface.points, surface.triangles);
  const auto pairs = FindSelfIntersections(surface.points, surface.triangles);
  outcome.intersections = pairs.size();
  const std::vector<double> edges =
    RelativeEdgeLengths(surface.points, surface.triangles, surface.edgeLength);
  outcome.edgesGood = static_cast<double>(std::count_if(edges.begin(), edges.end(),
                        [](double e) { return std::abs(e - 1.0) <= EdgeTolerance; })) /
    std::max<double>(1.0, static_cast<double>(edges.size()));
  Vector3 there = Vector3::Zero();
  Vector3 back = Vector3::Zero();
  Distances(surface.points, TriangleBvh(wall.points, wall.triangles), outcome.meanThere,
    outcome.maximumThere, there);
  Distances(wall.points, TriangleBvh(surface.points, surface.triangles), outcome.meanBack,
    outcome.maximumBack, back);
  outcome.volumeError =
    outcome.measures.volume / MeasureSurface(wall.points, wall.triangles).volume - 1.0;
  if (!folder.empty())
  {
    WriteObj(folder + "/surface-" + outcome.variant + "-" + std::to_string(seed) + ".obj", surface);
  }
  const std::size_t worst = static_cast<std::size_t>(
    std::min_element(outcome.measures.minimumAngle.begin(), outcome.measures.minimumAngle.end()) -
    outcome.measures.minimumAngle.begin());
  const Vector3& thin = surface.points[surface.triangles[worst][0]];
  std::fprintf(stderr,
    "seed %llu %s: farthest at (%.2f, %.2f, %.2f), %.3f mm; of the wall at (%.2f, %.2f, %.2f), "
    "%.3f mm; smallest angle at (%.2f, %.2f, %.2f), %.1f; %zu pairs cut; %.1f s\n",
    static_cast<unsigned long long>(seed), outcome.variant.c_str(), there[0], there[1], there[2],
    outcome.maximumThere, back[0], back[1], back[2], outcome.maximumBack, thin[0], thin[1], thin[2],
    outcome.measures.WorstAngle(), pairs.size(), outcome.processorSeconds);
  for (std::size_t i = 0; i < std::min<std::size_t>(5, pairs.size()); ++i)
  {
    const Vector3& p = surface.points[surface.triangles[pairs[i].first][0]];
    std::fprintf(stderr, "  cut at (%.2f, %.2f, %.2f)\n", p[0], p[1], p[2]);
  }
  for (const std::string& remark : surface.remarks)
  {
    std::fprintf(stderr, "  %s\n", remark.c_str());
  }
  return outcome;
}

void Print(const std::vector<Outcome>& outcomes)
{
  std::printf(
    "| seed | phantom | triangles | closed, manifold, genus 0, uncut | smallest angle | below 20 "
    "degrees | edges within 30 %% | to the wall, mean mm | largest mm | from the wall, mean mm | "
    "largest mm | volume | processor s | limits |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Outcome& o : outcomes)
  {
    if (!o.failure.empty())
    {
      std::printf("| %llu | %s | %s |\n", static_cast<unsigned long long>(o.seed),
        o.variant.c_str(), o.failure.c_str());
      continue;
    }
    std::printf("| %llu | %s | %zu | %s | %.1f | %.3f %% | %.2f %% | %.4f | %.3f | %.4f | %.3f | "
                "%+.2f %% | %.1f | %s |\n",
      static_cast<unsigned long long>(o.seed), o.variant.c_str(), o.measures.triangles,
      o.Sound() ? "yes" : "**no**", o.measures.WorstAngle(),
      100.0 * o.measures.ShareBelow(GoodAngle), 100.0 * o.edgesGood, o.meanThere, o.maximumThere,
      o.meanBack, o.maximumBack, 100.0 * o.volumeError, o.processorSeconds,
      o.Met() ? "met" : "**MISSED**");
  }
}
}

int main(int argc, char** argv)
{
  CLI::App program("The swept surface of phantom trees, against their walls");
  std::string seedText = "1..20";
  std::vector<std::string> variants = { "plain", "varied" };
  std::string folder;
  bool quick = false;
  bool across = false;
  double spacing = 0.25;
  SweepSettings settings;
  program.add_option("--seeds", seedText, "phantoms: a count or first..last")
    ->capture_default_str();
  program
    .add_option("--variants", variants,
      "plain: the phantom as it is by default, at t = 0.75; varied: dominance, ramus, stenoses, "
      "tortuosity, calibre and moment change with the seed")
    ->capture_default_str()
    ->check(CLI::IsMember({ "plain", "varied" }));
  program
    .add_option("--wall-spacing", spacing,
      "edge length of the phantom's surface, mm: the measure ends at its own error, most at the "
      "rims "
      "of the caps, which its triangles cut")
    ->capture_default_str();
  program.add_flag("--across", across,
    "cut the ends across the axes, not by the phantom's planes, which move with the tissue");
  program.add_option("--blending", settings.blending)->capture_default_str();
  program.add_option("--edge-retreat", settings.edgeRetreat)->capture_default_str();
  program.add_option("--smoothing", settings.smoothing)->capture_default_str();
  program.add_option("--write", folder, "folder for the surfaces as OBJ files")
    ->check(CLI::ExistingDirectory);
  program.add_flag("--quick", quick, "one phantom");
  std::vector<std::uint64_t> seeds;
  try
  {
    program.parse(argc, argv);
    if (quick)
    {
      seedText = "3..3";
      variants = { "varied" };
    }
    seeds = ParseSeeds(seedText, LoneNumber::Count);
  }
  catch (const CLI::ParseError& error)
  {
    return program.exit(error);
  }
  std::printf(
    "Limits: closed, 2-manifold, one component of genus 0 for each artery, no triangles "
    "that cut each other; every angle\nat least %.0f degrees and %.1f %% of the triangles "
    "at least %.0f; %.0f %% of the edges within %.0f %% of h; distance between\nthe "
    "surface's points and the phantom's wall, and back, at most %.2f mm in the mean and "
    "%.2f mm anywhere; at most %.0f s\nof one core for 100,000 triangles.\n\n",
    MinimumCornerAngle, 100.0 * GoodAngleShare, GoodAngle, 100.0 * EdgeShare, 100.0 * EdgeTolerance,
    MaximumMeanDistance, MaximumDistance, LongestTime);
  std::vector<Outcome> outcomes;
  try
  {
    for (const std::string& variant : variants)
    {
      for (const std::uint64_t seed : seeds)
      {
        outcomes.push_back(Run(seed, variant == "varied", spacing, !across, settings, folder));
      }
    }
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-surface: %s\n", error.what());
    return 2;
  }
  Print(outcomes);
  const auto met =
    std::count_if(outcomes.begin(), outcomes.end(), [](const Outcome& o) { return o.Met(); });
  std::printf("\n%ld of %zu meet all limits.\n", static_cast<long>(met), outcomes.size());
  return met == static_cast<long>(outcomes.size()) ? 0 : 1;
}
