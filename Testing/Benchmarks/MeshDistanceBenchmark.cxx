// Distances between two surfaces beside CGAL's Hausdorff distance and VTK's distance filter in the
// same run: time, and that the values agree. Tables in Markdown.

#include "MeasuredProcess.h"
#include "MeshDistance.h"
#include "SmoothRandomField.h"
#include "TriangleBvh.h"
#if defined(DYNAMICCORONARY_WITH_CGAL)
#include "CgalMeshDistance.h"
#endif

#include "vtkCellArray.h"
#include "vtkDataArray.h"
#include "vtkDistancePolyDataFilter.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <functional>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

// What has to be reached.
constexpr double MinimumSpeedUpCgal = 8.0;
constexpr double MinimumSpeedUpVtk = 15.0;
constexpr double ErrorBound = 1e-3;

struct Options
{
  int size = 100000;
  int repeats = 5;
  int threads = 2;
  std::uint64_t seed = 1;
  bool withoutCgal = false;
  bool strict = false;
};

/// Ten winding tubes of 60 mm whose radius falls from 2.2 to 0.8 mm, with so many points around and along
/// each, moved by a smooth random displacement of so many mm.
SurfaceMesh MakeTubes(const Options& options, int around, int along, double displacement)
{
  SurfaceMesh mesh;
  for (int tube = 0; tube < 10; ++tube)
  {
    const auto axis = [&](double s) -> Vector3
    {
      const double angle = 0.5 * tube + 3.0 * s;
      return { 12.0 * (tube % 5) + 6.0 * std::cos(angle), 15.0 * (tube / 5) + 6.0 * std::sin(angle),
        57.0 * s };
    };
    const auto first = static_cast<std::int64_t>(mesh.points.size());
    for (int ring = 0; ring <= along; ++ring)
    {
      const double s = static_cast<double>(ring) / along;
      const Vector3 tangent = (axis(s + 1e-4) - axis(s - 1e-4)).normalized();
      const Vector3 u = tangent.cross(Vector3::UnitX()).normalized();
      const Vector3 v = tangent.cross(u);
      for (int k = 0; k < around; ++k)
      {
        const double angle = 2.0 * M_PI * (k + 0.5 * (ring % 2)) / around;
        mesh.points.emplace_back(
          axis(s) + (2.2 - 1.4 * s) * (std::cos(angle) * u + std::sin(angle) * v));
      }
    }
    for (int ring = 0; ring < along; ++ring)
    {
      for (int k = 0; k < around; ++k)
      {
        const std::int64_t a = first + static_cast<std::int64_t>(ring) * around + k;
        const std::int64_t b = first + static_cast<std::int64_t>(ring) * around + (k + 1) % around;
        mesh.triangles.push_back({ a, b, a + around });
        mesh.triangles.push_back({ b, b + around, a + around });
      }
    }
  }
  std::array<SmoothRandomField, 3> fields;
  for (std::uint64_t k = 0; k < 3; ++k)
  {
    fields[k] = SmoothRandomField(options.seed, 70 + k, 8.0);
  }
  for (Vector3& p : mesh.points)
  {
    p += displacement * Vector3(fields[0](p), fields[1](p), fields[2](p));
  }
  return mesh;
}

vtkSmartPointer<vtkPolyData> PolyDataOf(const SurfaceMesh& mesh)
{
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Vector3& p : mesh.points)
  {
    points->InsertNextPoint(p.data());
  }
  vtkNew<vtkCellArray> cells;
  for (const Triangle& t : mesh.triangles)
  {
    cells->InsertNextCell({ t[0], t[1], t[2] });
  }
  data->SetPoints(points);
  data->SetPolys(cells);
  return data;
}

double Seconds(const std::function<void()>& work)
{
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

struct Timed
{
  const char* name;
  std::function<void()> work;
  std::vector<double> seconds;
  std::vector<double> processor; ///< of all threads

  double Minimum() const { return *std::min_element(this->seconds.begin(), this->seconds.end()); }
};

const char* Verdict(bool met)
{
  return met ? "met" : "**MISSED**";
}

int Along(const Options& options, double share)
{
  return std::max(2, static_cast<int>(share * options.size));
}

/// The tree of triangles alone, as rows of the table.
void MeasureTree(const Options& options, const SurfaceMesh& a, const SurfaceMesh& b)
{
  TriangleBvh tree;
  std::vector<double> build;
  for (int repeat = 0; repeat < options.repeats; ++repeat)
  {
    build.push_back(Seconds([&] { tree = TriangleBvh(a.points, a.triangles); }));
  }
  const TriangleBvh large(b.points, b.triangles);
  std::vector<double> cold;
  std::vector<double> warm;
  std::vector<std::int64_t> hints(a.points.size());
  for (int repeat = 0; repeat < options.repeats; ++repeat)
  {
    const auto query = [&](bool hinted)
    {
      return Seconds(
        [&]
        {
          ParallelFor(static_cast<std::int64_t>(a.points.size()), 1024,
            [&](std::int64_t first, std::int64_t last)
            {
              for (std::int64_t i = first; i < last; ++i)
              {
                hints[i] = large
                             .Closest(a.points[i], std::numeric_limits<double>::infinity(),
                               hinted ? hints[i] : -1)
                             .triangle;
              }
            });
        });
    };
    cold.push_back(query(false));
    warm.push_back(query(true));
  }
  const auto rate = [&](double seconds)
  { return static_cast<double>(a.points.size()) / seconds / 1e6; };
  std::printf(
    "| build of %zu triangles, ms | %.1f | | |\n", a.triangles.size(), 1e3 * Median(build));
  std::printf("| nearest points of %zu triangles, 10^6 a second: without hint, with the last "
              "time's | %.2f, %.2f | | |\n",
    b.triangles.size(), rate(Median(cold)), rate(Median(warm)));
}

int Run(const Options& options)
{
  SetNumberOfThreads(options.threads);
  const SurfaceMesh a = MakeTubes(options, 40, Along(options, 1.0 / 800.0), 0.33);
  const SurfaceMesh b = MakeTubes(options, 36, Along(options, 1.0 / 720.0), 0.0);
  const vtkSmartPointer<vtkPolyData> dataA = PolyDataOf(a);
  const vtkSmartPointer<vtkPolyData> dataB = PolyDataOf(b);

  MeshDistanceSettings onlyHausdorff;
  onlyHausdorff.errorBound = ErrorBound;
  onlyHausdorff.areaMeasures = false;
  onlyHausdorff.pointMeasures = false;
  onlyHausdorff.signedDistances = false;
  MeshDistanceSettings everything;
  everything.errorBound = ErrorBound;
  MeshDistance hausdorff;
  MeshDistance all;
  double vtkMean = 0.0;
  double vtkMaximum = 0.0;
  std::vector<Timed> timed;
  timed.push_back({ "Hausdorff distance, both ways",
    [&] { hausdorff = CompareSurfaces(a, b, onlyHausdorff); }, {}, {} });
  timed.push_back({ "all measures, signed distances of all points",
    [&] { all = CompareSurfaces(a, b, everything); }, {}, {} });
  timed.push_back({ "vtkDistancePolyDataFilter, both ways (vertices only)",
    [&]
    {
      vtkNew<vtkDistancePolyDataFilter> filter;
      filter->SetInputData(0, dataA);
      filter->SetInputData(1, dataB);
      filter->ComputeCellCenterDistanceOff();
      filter->ComputeSecondDistanceOn();
      filter->SignedDistanceOff();
      filter->Update();
      vtkDataArray* distance = filter->GetOutput()->GetPointData()->GetArray("Distance");
      vtkMean = 0.0;
      for (vtkIdType i = 0; i < distance->GetNumberOfTuples(); ++i)
      {
        vtkMean +=
          distance->GetComponent(i, 0) / static_cast<double>(distance->GetNumberOfTuples());
      }
      vtkMaximum = distance->GetRange()[1];
    },
    {}, {} });
#if defined(DYNAMICCORONARY_WITH_CGAL)
  double cgal = 0.0;
  if (!options.withoutCgal)
  {
    timed.push_back({ "CGAL bounded_error_symmetric_Hausdorff_distance",
      [&] { cgal = CgalHausdorffDistance(a, b, ErrorBound); }, {}, {} });
  }
#endif
  // In turns, so that a busy machine is busy for all of them.
  for (int repeat = 0; repeat < options.repeats; ++repeat)
  {
    for (Timed& one : timed)
    {
      const std::clock_t before = std::clock();
      one.seconds.push_back(Seconds(one.work));
      one.processor.push_back(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
    }
  }

  std::printf(
    "\n### Two surfaces of %zu and %zu triangles, %d threads\n\nTen winding tubes, and the same "
    "meshed anew and displaced; error bound %g mm.\n\n| | wall time, s: median (least to "
    "greatest) | processor time, s |\n|---|---|---|\n",
    a.triangles.size(), b.triangles.size(), NumberOfThreads(), ErrorBound);
  for (const Timed& one : timed)
  {
    std::printf("| %s | %.3f (%.3f to %.3f) | %.3f |\n", one.name, Median(one.seconds),
      one.Minimum(), *std::max_element(one.seconds.begin(), one.seconds.end()),
      Median(one.processor));
  }
  std::printf(
    "\n| mm | HD | MSD | MSD_area | HD95 | RMS | vertices only |\n|---|---|---|---|---|---|---|\n"
    "| ours | %.5f (+ at most %.5f) | %.5f | %.5f (error %.1e) | %.5f | %.5f | %.5f |\n",
    all.hausdorff, all.hausdorffError, all.ab.vertexMean, all.mean, all.quadratureError,
    all.hausdorff95, all.rms, all.ab.vertexMaximum);
  std::printf("| vtkDistancePolyDataFilter | | %.5f | | | | %.5f |\n", vtkMean, vtkMaximum);

  bool agree = std::abs(vtkMean - all.ab.vertexMean) < 1e-4 * all.ab.vertexMean + 1e-9 &&
    hausdorff.hausdorff <= all.hausdorff + ErrorBound &&
    all.hausdorff <= hausdorff.hausdorff + ErrorBound;
  bool met = true;
  const double vtkRatio = Median(timed[2].seconds) / Median(timed[1].seconds);
#if defined(DYNAMICCORONARY_WITH_CGAL)
  if (!options.withoutCgal)
  {
    std::printf("| CGAL | %.5f | | | | | |\n", cgal);
    agree = agree && std::abs(cgal - all.hausdorff) <= ErrorBound;
  }
#endif
  std::printf("\n| | measured | target | |\n|---|---|---|---|\n");
#if defined(DYNAMICCORONARY_WITH_CGAL)
  if (!options.withoutCgal)
  {
    const double ratio = Median(timed[3].seconds) / Median(timed[0].seconds);
    met = met && ratio >= MinimumSpeedUpCgal;
    std::printf("| CGAL's time over that of our Hausdorff distance | %.1f | >= %.0f | %s |\n",
      ratio, MinimumSpeedUpCgal, Verdict(ratio >= MinimumSpeedUpCgal));
  }
#endif
  met = met && vtkRatio >= MinimumSpeedUpVtk;
  std::printf("| VTK's time over that of all our measures | %.1f | >= %.0f | %s |\n", vtkRatio,
    MinimumSpeedUpVtk, Verdict(vtkRatio >= MinimumSpeedUpVtk));

  MeasureTree(options, a, b);
  if (!agree)
  {
    std::printf("\n**The values do not agree.**\n");
    return 1;
  }
  return options.strict && !met ? 1 : 0;
}
}

int main(int argc, char** argv)
{
  CLI::App app("Distances between surfaces beside CGAL's and VTK's.", "mesh-distance-benchmark");
  Options options;
  app.add_option("--size", options.size, "Triangles of each surface")
    ->check(CLI::Range(2000, 10000000));
  app.add_option("--repeats", options.repeats, "Repetitions")->check(CLI::Range(1, 100));
  app.add_option("--threads", options.threads, "Threads")->check(CLI::Range(1, 64));
  app.add_option("--seed", options.seed, "Of the displacement");
  app.add_flag("--without-cgal", options.withoutCgal, "Leave CGAL out");
  app.add_flag("--strict", options.strict, "Exit code 1 when a target is missed");
  CLI11_PARSE(app, argc, argv);
  try
  {
    return Run(options);
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "mesh-distance-benchmark: %s\n", error.what());
    return 1;
  }
}
