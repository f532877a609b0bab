// Tetrahedral meshes of surfaces swept along the phantoms' true trees, or of the phantoms' true
// surfaces, with the true centerlines inside, and of foreign surfaces after cleaning. Tables in
// Markdown on stdout; the exit code is 1 when a limit is missed.

#include "CoronaryPhantom.h"
#include "Instrumented.h"
#include "PhantomCases.h"
#include "SharedSurface.h"
#include "SurfaceCleaning.h"
#include "SweepSurface.h"
#include "TetrahedralMesh.h"

#include "vtkCellArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPolyData.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <sys/resource.h>

namespace
{
using namespace coronary;

// What has to be reached in each mesh.
constexpr double MinimumCornerAngle = 5.0; // degrees, dihedral
constexpr double PoorAngle = 15.0;         // degrees
constexpr double MaximumPoorShare = 0.01;
constexpr double MeshMinimumVolume = 1e-7; // mm^3
constexpr double MaximumSeconds = 20.0;    // of processor time for 100,000 triangles, with TetGen
constexpr int MostTries = 2;
// Ends outside of their caps are put on them; a segment that is not there would be 0.5.
constexpr double MaximumLengthLost = 0.25; // mm

/// Of this process and of its meshers, seconds.
double ProcessorTime()
{
  double sum = 0.0;
  for (const auto who : { RUSAGE_SELF, RUSAGE_CHILDREN })
  {
    rusage usage{};
    getrusage(who, &usage);
    sum += static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
      1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  }
  return sum;
}

struct Outcome
{
  std::string name;
  std::string failure;
  std::size_t triangles = 0;
  std::size_t tetrahedra = 0;
  int tries = 0;
  double minimumAngle = 0.0; // degrees
  double poorShare = 0.0;
  double minimumVolume = 0.0;
  std::size_t inverted = 0;
  std::size_t pointsLost = 0;
  double lengthLost = 0.0; // of the skeleton, mm
  double seconds = 0.0;

  bool Reached(bool timed) const
  {
    return this->failure.empty() && this->minimumAngle >= MinimumCornerAngle &&
      this->poorShare <= MaximumPoorShare && this->minimumVolume > MeshMinimumVolume &&
      this->inverted == 0 && this->tries <= MostTries && this->pointsLost == 0 &&
      std::abs(this->lengthLost) < MaximumLengthLost &&
      (!timed || this->seconds <= MaximumSeconds * std::max(1.0, 1e-5 * this->triangles));
  }
};

/// Measured anew from the points, not taken from the mesh's own arrays.
void Measure(const TetrahedralMeshInput& input, const TetrahedralMesh& mesh, Outcome& outcome)
{
  outcome.triangles = input.triangles.size();
  outcome.tetrahedra = mesh.tetrahedra.size();
  outcome.tries = mesh.tries;
  outcome.minimumAngle = 180.0;
  outcome.minimumVolume = std::numeric_limits<double>::infinity();
  Vector3 where = Vector3::Zero();
  std::size_t poor = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
  {
    const Vector3& a = mesh.points[t[0]];
    const Vector3& b = mesh.points[t[1]];
    const Vector3& c = mesh.points[t[2]];
    const Vector3& d = mesh.points[t[3]];
    const double volume = TetrahedronVolume(a, b, c, d);
    const double angle = MinimumDihedralAngle(a, b, c, d) * 180.0 / M_PI;
    outcome.minimumVolume = std::min(outcome.minimumVolume, volume);
    if (angle < outcome.minimumAngle)
    {
      outcome.minimumAngle = angle;
      where = (a + b + c + d) / 4.0;
    }
    outcome.inverted += volume <= 0.0 ? 1 : 0;
    poor += angle < PoorAngle ? 1 : 0;
  }
  outcome.poorShare = static_cast<double>(poor) / static_cast<double>(mesh.tetrahedra.size());
  std::fprintf(stderr, "%s: flattest at (%.3f, %.3f, %.3f), %.2f degrees\n", outcome.name.c_str(),
    where[0], where[1], where[2], outcome.minimumAngle);
  for (const std::string& warning : mesh.warnings)
  {
    std::fprintf(stderr, "  %s\n", warning.c_str());
  }
  std::set<std::array<double, 3>> places;
  for (const auto& [a, b] : input.skeletonEdges)
  {
    for (const std::int64_t point : { a, b })
    {
      const Vector3& p = input.skeletonPoints[point];
      places.insert({ p[0], p[1], p[2] });
    }
    outcome.lengthLost += (input.skeletonPoints[a] - input.skeletonPoints[b]).norm();
  }
  std::size_t found = 0;
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
  {
    found += mesh.skeletonPoint[i] >= 0 ? 1 : 0;
  }
  outcome.pointsLost = places.size() - std::min(places.size(), found);
  for (const TetrahedralMesh::Edge& edge : mesh.skeletonEdges)
  {
    outcome.lengthLost -= (mesh.points[edge.from] - mesh.points[edge.to]).norm();
  }
}

Outcome Mesh(const std::string& name, const TetrahedralMeshInput& input,
  const TetrahedralMeshSettings& settings)
{
  Outcome outcome;
  outcome.name = name;
  const double start = ProcessorTime();
  try
  {
    const TetrahedralMesh mesh = MakeTetrahedralMesh(input, settings);
    outcome.seconds = ProcessorTime() - start;
    Measure(input, mesh, outcome);
  }
  catch (const std::exception& error)
  {
    outcome.failure = error.what();
  }
  return outcome;
}

/// Fed to the mesher: what the pipeline makes from the phantom's tree, or the phantom's own wall.
TetrahedralMeshInput PhantomInput(std::uint64_t seed, bool varied, bool swept, double spacing)
{
  PhantomCase which = MakePhantomCase(seed, varied);
  which.settings.surfaceSpacing = spacing;
  const CoronaryPhantom phantom(which.settings);
  const PhantomTree tree = phantom.Tree(which.moment);
  TetrahedralMeshInput input;
  if (swept)
  {
    SweptSurface surface = SweepVesselTree(tree, {});
    input.points = std::move(surface.points);
    input.triangles = std::move(surface.triangles);
  }
  else
  {
    PhantomSurface surface = phantom.Surface(which.moment);
    input.points = std::move(surface.points);
    input.triangles = std::move(surface.triangles);
  }
  input.skeletonPoints = tree.points;
  input.skeletonRadius = tree.radius;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      input.skeletonEdges.emplace_back(branch.points[i - 1], branch.points[i]);
    }
  }
  return input;
}

/// A surface of triangles; without points when the file is not there.
TetrahedralMeshInput InputOf(vtkPolyData* surface)
{
  TetrahedralMeshInput input;
  if (surface == nullptr)
  {
    return input;
  }
  input.points.resize(static_cast<std::size_t>(surface->GetNumberOfPoints()));
  for (std::size_t i = 0; i < input.points.size(); ++i)
  {
    surface->GetPoint(static_cast<vtkIdType>(i), input.points[i].data());
  }
  vtkNew<vtkIdList> cell;
  vtkCellArray* cells = surface->GetPolys();
  for (cells->InitTraversal(); cells->GetNextCell(cell) != 0;)
  {
    input.triangles.push_back({ cell->GetId(0), cell->GetId(1), cell->GetId(2) });
  }
  return input;
}

bool Print(const Outcome& outcome, bool timed)
{
  const bool reached = outcome.Reached(timed);
  if (!outcome.failure.empty())
  {
    std::printf(
      "| %s | %s | | | | | | | **no** |\n", outcome.name.c_str(), outcome.failure.c_str());
  }
  else
  {
    std::printf("| %s | %zu | %zu | %d | %.1f | %.4f | %.1e | %.1f | %s |\n", outcome.name.c_str(),
      outcome.triangles, outcome.tetrahedra, outcome.tries, outcome.minimumAngle,
      100.0 * outcome.poorShare, outcome.minimumVolume, outcome.seconds,
      reached ? "yes" : "**no**");
  }
  std::fflush(stdout);
  return reached;
}

int Run(int argc, char** argv)
{
  CLI::App program{
    "Tetrahedral meshes of the phantoms' surfaces with their centerlines inside, and of a foreign "
    "surface, against limits of shape and time"
  };
  std::string seedText = "1..20";
  std::string kind = "swept";
  std::vector<std::string> variants = { "plain", "varied" };
  double spacing = 0.35;
  bool phantomsOnly = false;
  std::string backend = "TetGen";
  std::string data = DYNAMICCORONARY_DATA_DIR;
  bool quick = false;
  program.add_option("--seeds", seedText, "phantoms: a count or first..last")
    ->capture_default_str();
  program
    .add_option("--surface", kind,
      "swept: made from the phantom's true tree, as the pipeline does; truth: the phantom's own "
      "wall")
    ->check(CLI::IsMember({ "swept", "truth" }))
    ->capture_default_str();
  program
    .add_option("--variants", variants,
      "plain: the phantom as it is by default, at t = 0.75; varied: dominance, ramus, stenoses, "
      "tortuosity, calibre and moment change with the seed")
    ->check(CLI::IsMember({ "plain", "varied" }))
    ->capture_default_str();
  program.add_option("--spacing", spacing, "edge length of the phantom's own wall, mm")
    ->capture_default_str();
  program.add_option("--backend", backend, "who meshes")
    ->check(CLI::IsMember({ "TetGen", "CGAL" }))
    ->capture_default_str();
  program.add_option("--data", data, "folder with hra-coronaries/F_coronary_arteries.vtp")
    ->capture_default_str();
  program.add_flag("--phantoms-only", phantomsOnly, "without the foreign surface");
  program.add_flag("--quick", quick, "one phantom");
  std::vector<std::uint64_t> seeds;
  try
  {
    program.parse(argc, argv);
    if (quick)
    {
      seedText = "3..3";
      variants = { "plain" };
    }
    seeds = ParseSeeds(seedText, LoneNumber::Count);
  }
  catch (const CLI::ParseError& error)
  {
    return program.exit(error);
  }
  TetrahedralMeshSettings settings;
  settings.backend = backend == "CGAL" ? TetrahedralBackend::Cgal : TetrahedralBackend::TetGen;
  if (!HasTetrahedralBackend(settings.backend))
  {
    std::fprintf(stderr, "validate-volume: built without %s\n", backend.c_str());
    return quick ? 0 : 1;
  }
  const bool timed = !Instrumented && settings.backend == TetrahedralBackend::TetGen;
  std::printf("# Tetrahedra by %s\n\n", backend.c_str());
  std::printf(
    "Wanted: dihedral angles of at least %.0f degrees, at most %.0f %% of the tetrahedra below "
    "%.0f degrees, volumes above %.0e mm^3,\nno inverted one, all points and segments of "
    "the centerlines in the mesh, at most %d tries",
    MinimumCornerAngle, 100.0 * MaximumPoorShare, PoorAngle, MeshMinimumVolume, MostTries);
  if (timed)
  {
    std::printf(", %.0f s of processor time for 100,000 triangles", MaximumSeconds);
  }
  std::printf(".\n\n");
  std::printf(
    "| surface | triangles | tetrahedra | tries | least angle (degrees) | below 15 degrees "
    "(%%) | least volume (mm^3) | processor time (s) | reached |\n"
    "|---|---|---|---|---|---|---|---|---|\n");
  int missed = 0;
  for (const std::string& variant : variants)
  {
    for (const std::uint64_t seed : seeds)
    {
      const std::string name = variant + " " + std::to_string(seed);
      Outcome outcome;
      try
      {
        outcome =
          Mesh(name, PhantomInput(seed, variant == "varied", kind == "swept", spacing), settings);
      }
      catch (const std::exception& error)
      {
        outcome.name = name;
        outcome.failure = error.what();
      }
      missed += Print(outcome, timed) ? 0 : 1;
    }
  }
  if (!quick && !phantomsOnly)
  {
    const auto surface = ReadSurface(data + "/hra-coronaries/F_coronary_arteries.vtp");
    TetrahedralMeshInput input = InputOf(surface);
    if (input.triangles.empty())
    {
      std::fprintf(stderr, "validate-volume: no F_coronary_arteries.vtp in %s\n", data.c_str());
    }
    else
    {
      const CleanedSurface cleaned = CleanSurface(input.points, input.triangles);
      input.points = cleaned.points;
      input.triangles = cleaned.triangles;
      missed += Print(Mesh("F_coronary_arteries, cleaned", input, settings), timed) ? 0 : 1;
    }
  }
  std::printf("\n%d limits missed.\n", missed);
  return missed > 0 ? 1 : 0;
}
}

int main(int argc, char** argv)
{
  try
  {
    return Run(argc, argv);
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-volume: %s\n", error.what());
    return 2;
  }
}
