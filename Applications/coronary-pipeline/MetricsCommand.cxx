#include "Command.h"
#include "ReportJson.h"

#include "DistanceOptions.h"
#include "Interruption.h"
#include "MeshDistance.h"
#include "vtkMessageTrap.h"
#include "vtkSurfaceFile.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
namespace
{
struct MetricsJob
{
  std::string result;
  std::string reference;
  bool json = false;
  MeshDistanceSettings distance;
  std::string groups = "GroupIds";
  std::string caps = "CellEntityIds";

  void Declare(CLI::App& app);
  void Run() const;

private:
  SurfaceMesh Read(const std::string& path, vtkMessageTrap& messages) const;
};

void MetricsJob::Declare(CLI::App& app)
{
  app.add_option("A", this->result, std::string("The result: a surface, ") + SurfaceFileKinds)
    ->type_name("FILE")
    ->required();
  app.add_option("B", this->reference, "The reference, of the same kinds")
    ->type_name("FILE")
    ->required();
  app.add_flag("--json", this->json, "Print JSON instead of a table");
  AddDistanceOptions(app, this->distance);
  app
    .add_option(
      "--groups", this->groups, "Point or cell array with the branches of a .vtp or .vtu file")
    ->type_name("NAME")
    ->capture_default_str();
  app.add_option("--caps", this->caps, "Cell array whose values above 1 are caps, for --clip-ends")
    ->type_name("NAME")
    ->capture_default_str();
}

SurfaceMesh MetricsJob::Read(const std::string& path, vtkMessageTrap& messages) const
{
  if (!IsSurfaceFile(path))
  {
    throw UsageError(
      std::string("a surface must end in ") + SurfaceFileKinds + ", '" + path + "' does not");
  }
  return ReadTriangles(path, this->groups, this->caps, messages).mesh;
}

std::vector<std::pair<const char*, double>> Measures(const MeshDistance& d)
{
  return { { "HD", d.hausdorff }, { "HD_AB", d.ab.hausdorff }, { "HD_BA", d.ba.hausdorff },
    { "HD95", d.hausdorff95 }, { "HD95_AB", d.ab.percentile95 }, { "HD95_BA", d.ba.percentile95 },
    { "HD95_pooled", d.percentile95 }, { "MSD", d.ab.vertexMean }, { "MSD_BA", d.ba.vertexMean },
    { "MSD_area", d.mean }, { "MSD_area_AB", d.ab.mean }, { "MSD_area_BA", d.ba.mean },
    { "RMS", d.rms }, { "error_bound", d.hausdorffError },
    { "quadrature_error", d.quadratureError } };
}

void PrintJson(const MeshDistance& d, double seconds)
{
  nlohmann::ordered_json all;
  for (const auto& [name, value] : Measures(d))
  {
    all[name] = value;
  }
  all["seconds"] = seconds;
  all["HD_AB_points"] = { PlaceOf(d.ab.at), PlaceOf(d.ab.nearest) };
  all["HD_BA_points"] = { PlaceOf(d.ba.at), PlaceOf(d.ba.nearest) };
  all["area_A"] = d.ab.area;
  all["area_B"] = d.ba.area;
  all["branches"] = nlohmann::ordered_json::array();
  for (const BranchDistance& branch : d.branches)
  {
    all["branches"].push_back({ { "side", branch.side == 0 ? "A" : "B" }, { "group", branch.group },
      { "HD", branch.distance.hausdorff }, { "HD95", branch.distance.percentile95 },
      { "MSD", branch.distance.vertexMean }, { "MSD_area", branch.distance.mean },
      { "RMS", branch.distance.rms }, { "area", branch.distance.area } });
  }
  all["warnings"] = d.warnings;
  std::printf("%s\n", all.dump(2).c_str());
}

void PrintTable(const MeshDistance& d, double seconds)
{
  std::printf("%-18s %12s\n", "measure", "mm");
  for (const auto& [name, value] : Measures(d))
  {
    std::printf("%-18s %12.5f\n", name, value);
  }
  if (!d.branches.empty())
  {
    std::printf("\n%-4s %10s %10s %10s %10s %10s %10s\n", "side", "branch", "HD", "HD95", "MSD",
      "MSD_area", "RMS");
    for (const BranchDistance& branch : d.branches)
    {
      const SideDistance& b = branch.distance;
      std::printf("%-4s %10lld %10.4f %10.4f %10.4f %10.4f %10.4f\n", branch.side == 0 ? "A" : "B",
        static_cast<long long>(branch.group), b.hausdorff, b.percentile95, b.vertexMean, b.mean,
        b.rms);
    }
  }
  std::printf("\n%.3f s\n", seconds);
}

void MetricsJob::Run() const
{
  vtkMessageTrap messages;
  const SurfaceMesh a = this->Read(this->result, messages);
  const SurfaceMesh b = this->Read(this->reference, messages);
  MeshDistanceSettings settings = this->distance;
  settings.signedDistances = false;
  settings.names = { "'" + this->result + "'", "'" + this->reference + "'" };
  const auto begin = std::chrono::steady_clock::now();
  const MeshDistance distances =
    CompareSurfaces(a, b, settings, [](double) { return Interruption() == 0; });
  const double seconds =
    std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  for (const std::string& warning : distances.warnings)
  {
    std::fprintf(stderr, "Warning: %s.\n", warning.c_str());
  }
  messages.PrintWarnings();
  if (this->json)
  {
    PrintJson(distances, seconds);
  }
  else
  {
    PrintTable(distances, seconds);
  }
}
}

Command MakeMetricsCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "metrics", "Distances between two surfaces: Hausdorff, 95th percentile, mean, RMS; per branch");
  auto job = std::make_shared<MetricsJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); } };
}
}
