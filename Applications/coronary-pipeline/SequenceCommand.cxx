#include "Command.h"

#include "OptionChecks.h"
#include "ProgressDisplay.h"
#include "Ranks.h"
#include "StagedFolder.h"
#include "vtkDataFiles.h"
#include "vtkFlowCase.h"
#include "vtkMessageTrap.h"
#include "vtkMovingMesh.h"
#include "vtkTimedPolyData.h"

#include "vtkCardiacPhaseInterpolator.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkDataArray.h"
#include "vtkMeshSequenceWriter.h"
#include "vtkNew.h"
#include "vtkPolyData.h"
#include "vtkSkinDeformation.h"
#include "vtkSmartPointer.h"
#include "vtkTable.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;

const std::map<std::string, int> Blends = {
  { "linear", vtkSkinDeformation::LinearBlend },
  { "dual-quaternion", vtkSkinDeformation::DualQuaternion },
};

struct SequenceJob
{
  std::string result;
  std::vector<std::string> poses;
  std::vector<double> poseTimes;
  std::string output;
  int phases = 0; ///< 0: those of the poses
  std::vector<double> times;
  std::string mode = "cubic";
  std::string blend = "linear";
  double volumeConservation = 0.0;
  bool repair = true;
  bool velocity = false;
  double cycleMs = 0.0; ///< 0: that of the poses
  std::vector<std::string> formats = { "series" };
  std::string unit = "mm";
  int influences = 4;
  bool loop = true;
  double poor = 15.0;
  FlowCaseSettings flow;
  int threads = 0;
  bool quiet = false;

  void Declare(CLI::App& app);
  void Run() const;

private:
  void DeclareFlow(CLI::App& app);
  bool Wants(const char* format) const
  {
    return std::find(this->formats.begin(), this->formats.end(), format) != this->formats.end();
  }
  std::vector<std::string> WriteFlow(const FlowCaseInput& input, vtkTimedPolyData* source,
    StagedFolder& folder, vtkMessageTrap& messages, ProgressDisplay& progress) const;
  std::vector<std::string> PoseFiles() const;
  std::vector<double> PhaseTimes(const std::vector<double>& ofPoses) const;
  void Choose(vtkMeshSequenceWriter* writer) const;
  std::string Summary(vtkTable* quality) const;
};

void SequenceJob::Declare(CLI::App& app)
{
  app
    .add_option("RESULT", this->result,
      "Folder of 'run --until weights': weights.vtu, skeleton.vtp, and, when they are there, "
      "volume_boundary.vtp and caps.vtp")
    ->type_name("")
    ->required();
  app.add_option("--output", this->output, "Folder to write to; made when it does not exist")
    ->type_name("DIR")
    ->required();

  const std::string motion = "Motion";
  app
    .add_option("--poses", this->poses,
      "The skeleton over time: a .series or .pvd file, or .vtp files with --pose-times. Default: "
      "RESULT/motion/skeleton.vtp.series")
    ->type_name("FILE")
    ->group(motion);
  app
    .add_option(
      "--pose-times", this->poseTimes, "Times of the .vtp files, fractions of R-R: 0,0.2,0.4")
    ->check(Within(-100.0, 100.0))
    ->delimiter(',')
    ->allow_extra_args(false)
    ->type_name("LIST")
    ->group(motion);
  app
    .add_option("--mode", this->mode,
      "Interpolation between the poses: linear, cubic (periodic) or low-noise")
    ->check(CLI::IsMember(InterpolationModes()))
    ->type_name("MODE")
    ->capture_default_str()
    ->group(motion);
  auto* phasesOption =
    app
      .add_option("--phases", this->phases,
        "Number of even phases of one cycle, from time 0. Default: the times of the poses")
      ->check(WholeWithin(1, 100000))
      ->type_name("N")
      ->group(motion);
  app.add_option("--times", this->times, "Times of the phases, fractions of R-R: 0,0.05,0.1")
    ->check(Within(-100.0, 100.0))
    ->delimiter(',')
    ->allow_extra_args(false)
    ->type_name("LIST")
    ->excludes(phasesOption)
    ->group(motion);

  const std::string deformation = "Deformation";
  app.add_option("--blend", this->blend, "Blending of bones: linear or dual-quaternion")
    ->check(CLI::IsMember({ "linear", "dual-quaternion" }))
    ->type_name("BLEND")
    ->capture_default_str()
    ->group(deformation);
  app
    .add_option("--volume-conservation", this->volumeConservation,
      "How far cross-sections answer to stretch: 0 not at all, 1 the volume is kept")
    ->check(Within(0.0, 1.0))
    ->type_name("SHARE")
    ->capture_default_str()
    ->group(deformation);
  app
    .add_flag(
      "!--no-repair", this->repair, "Leave inverted tetrahedra as they are, and report them")
    ->group(deformation);
  app.add_flag("--velocity", this->velocity, "Write the velocity of the points, mm/s")
    ->group(deformation);

  app
    .add_option("--cycle-ms", this->cycleMs,
      "R-R interval in ms, for the velocity, where the poses do not give it (CycleLength)")
    ->check(Within(1.0, 60000.0))
    ->type_name("MS")
    ->group(deformation);

  const std::string files = "Files";
  app
    .add_option("--formats", this->formats,
      "series (ParaView: .pvd and .series), simvascular (mesh-complete folders), vmtk; of the "
      "surface obj, ply, stl, and gltf (one animated .glb) or gltf-json; openfoam (case folders "
      "with a "
      "mesh of their own); several with commas")
    ->check(CLI::IsMember(
      { "series", "simvascular", "vmtk", "obj", "ply", "stl", "gltf", "gltf-json", "openfoam" }))
    ->delimiter(',')
    ->allow_extra_args(false)
    ->type_name("LIST")
    ->capture_default_str()
    ->group(files);
  app
    .add_option("--simvascular-unit", this->unit,
      "Unit of length in the mesh-complete folders: mm, or cm as SimVascular's examples have")
    ->check(CLI::IsMember({ "mm", "cm" }))
    ->type_name("UNIT")
    ->capture_default_str()
    ->group(files);
  app
    .add_option("--gltf-influences", this->influences,
      "Nodes that a point may hang on in glTF: 4 (all viewers), 8, 12 or 16")
    ->check(CLI::IsMember({ 4, 8, 12, 16 }))
    ->type_name("N")
    ->capture_default_str()
    ->group(files);
  app
    .add_flag("!--no-gltf-loop", this->loop,
      "The animation ends with the last phase, and does not come back to the first one")
    ->group(files);
  app
    .add_option("--poor", this->poor,
      "Tetrahedra with a smaller dihedral angle are reported as poor, degrees")
    ->check(Within(0.0, 70.0))
    ->type_name("DEG")
    ->capture_default_str()
    ->group(files);
  this->DeclareFlow(app);
  AddThreads(app, this->threads);
  app.add_flag("--quiet", this->quiet, "No progress and no summary");
}

void SequenceJob::DeclareFlow(CLI::App& app)
{
  const std::string group = "OpenFOAM (docs/flow.md)";
  app
    .add_option(
      "--flow-tree", this->flow.tree, "Only this tree of the centerlines: 0 left, 1 right")
    ->check(WholeWithin(0, 1000))
    ->type_name("N")
    ->group(group);
  app.add_option("--flow-edge", this->flow.edge, "Edges of the wall, in local radii")
    ->check(Within(0.1, 0.7))
    ->type_name("RADII")
    ->capture_default_str()
    ->group(group);
  app.add_option("--flow-layers", this->flow.layers, "Layers of prisms at the wall")
    ->check(WholeWithin(1, 20))
    ->type_name("N")
    ->capture_default_str()
    ->group(group);
  app
    .add_option("--flow-extension", this->flow.extension,
      "Straight pieces before inlet and outlets, in diameters of the end")
    ->check(Within(0.0, 20.0))
    ->type_name("DIAMETERS")
    ->capture_default_str()
    ->group(group);
  app
    .add_option("--flow-mean", this->flow.meanFlow,
      "Mean flow into each tree, mL/s. Default: 12.5 cm/s in the inlet's section")
    ->check(Within(0.01, 100.0))
    ->type_name("ML/S")
    ->group(group);
  app
    .add_option_function<std::string>(
      "--flow-blood",
      [this](const std::string& model)
      { this->flow.blood = model == "carreau" ? BloodModel::Carreau : BloodModel::Newtonian; },
      "Viscosity: newtonian (3.5 mPa s, the default) or carreau")
    ->check(CLI::IsMember({ "newtonian", "carreau" }))
    ->type_name("MODEL")
    ->group(group);
  app.add_flag("--flow-rest", this->flow.rest, "The walls stand still, as they are at time 0")
    ->group(group);
  app
    .add_option("--flow-cycles", this->flow.cycles,
      "Cycles to simulate, in 20ths; the last one counts, what is before it is start-up")
    ->check(Within(1.0, 100.0))
    ->type_name("N")
    ->capture_default_str()
    ->group(group);
  app.add_option("--flow-steps", this->flow.steps, "Time steps a cycle")
    ->check(WholeWithin(10, 1000000))
    ->type_name("N")
    ->capture_default_str()
    ->group(group);
  app.add_option("--flow-frames", this->flow.frames, "Frames of the walls' motion a cycle")
    ->check(WholeWithin(2, 10000))
    ->type_name("N")
    ->capture_default_str()
    ->group(group);
}

std::vector<std::string> SequenceJob::PoseFiles() const
{
  if (!this->poses.empty())
  {
    return this->poses;
  }
  const std::string usual = (fs::path(this->result) / "motion" / "skeleton.vtp.series").string();
  std::error_code ignored;
  if (!fs::exists(usual, ignored))
  {
    throw UsageError("--poses is needed: there is no '" + usual + "'");
  }
  return { usual };
}

std::vector<double> SequenceJob::PhaseTimes(const std::vector<double>& ofPoses) const
{
  if (this->phases > 0)
  {
    std::vector<double> even(static_cast<std::size_t>(this->phases));
    for (int k = 0; k < this->phases; ++k)
    {
      even[static_cast<std::size_t>(k)] = static_cast<double>(k) / this->phases;
    }
    return even;
  }
  if (this->times.empty())
  {
    return ofPoses;
  }
  std::vector<double> sorted = this->times;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted;
}

void SequenceJob::Choose(vtkMeshSequenceWriter* writer) const
{
  const auto wanted = [&](const char* format) { return this->Wants(format); };
  writer->SetWriteSeries(wanted("series"));
  writer->SetWriteSimVascular(wanted("simvascular"));
  writer->SetWriteVmtk(wanted("vmtk"));
  writer->SetWriteObj(wanted("obj"));
  writer->SetWritePly(wanted("ply"));
  writer->SetWriteStl(wanted("stl"));
  writer->SetWriteGltf(wanted("gltf"));
  writer->SetWriteGltfJson(wanted("gltf-json"));
  writer->SetGltfInfluences(this->influences);
  writer->SetGltfLoop(this->loop);
  writer->SetSimVascularUnit(this->unit == "cm" ? 10.0 : 1.0);
  writer->SetPoorDihedralAngle(this->poor);
}

std::string SequenceJob::Summary(vtkTable* quality) const
{
  const auto column = [&](const char* name)
  { return vtkDataArray::SafeDownCast(quality->GetColumnByName(name)); };
  double inverted = 0.0;
  for (vtkIdType k = 0; k < quality->GetNumberOfRows(); ++k)
  {
    inverted += column(vtkCoronaryArrayNames::InvertedTetrahedra)->GetTuple1(k);
  }
  double angle[2];
  double volume[2];
  double poorest[2];
  column(vtkCoronaryArrayNames::MeshMinimumDihedralAngle)->GetRange(angle);
  column(vtkCoronaryArrayNames::TotalVolume)->GetRange(volume);
  column(vtkCoronaryArrayNames::PoorFraction)->GetRange(poorest);
  char text[240];
  std::snprintf(text, sizeof(text),
    "%lld phases, %.0f inverted tetrahedra, at most %.3f %% poor, least dihedral angle %.2f "
    "degrees, "
    "volume %.1f to %.1f mm^3",
    static_cast<long long>(quality->GetNumberOfRows()), inverted, 100.0 * poorest[1],
    angle[0] * 180.0 / M_PI, volume[0], volume[1]);
  return text;
}

/// Of a folder, when it is there.
vtkSmartPointer<vtkPolyData> ReadOptional(
  const std::string& folder, const char* name, vtkMessageTrap& messages)
{
  const fs::path path = fs::path(folder) / name;
  std::error_code ignored;
  return fs::exists(path, ignored) ? ReadPolyData(path.string(), messages) : nullptr;
}

std::vector<std::string> SequenceJob::WriteFlow(const FlowCaseInput& input,
  vtkTimedPolyData* source, StagedFolder& folder, vtkMessageTrap& messages,
  ProgressDisplay& progress) const
{
  vtkNew<vtkCardiacPhaseInterpolator> interpolator;
  interpolator->SetInputConnection(source->GetOutputPort());
  interpolator->SetMode(InterpolationMode(this->mode));
  vtkNew<vtkSkinDeformation> deformation;
  deformation->SetPoseConnection(interpolator->GetOutputPort());
  deformation->SetInputData(1, input.rest);
  deformation->SetBlend(Blends.at(this->blend));
  deformation->SetVolumeConservation(this->volumeConservation);
  deformation->SetTetrahedra(vtkSkinDeformation::IgnoreTetrahedra);
  deformation->DoublePrecisionOn();
  FlowCaseInput whole = input;
  whole.deformation = deformation;
  FlowCaseSettings settings = this->flow;
  settings.cycle = this->cycleMs > 0.0 ? this->cycleMs / 1000.0 : source->CycleSeconds();
  return WriteFlowCases(whole, settings, this->output, "mesh", folder, messages,
    [&](double fraction) { progress.Update(fraction); });
}

void SequenceJob::Run() const
{
  UseThreads(this->threads);
  const std::vector<std::string> poseFiles = this->PoseFiles();
  vtkMessageTrap messages;
  ProgressDisplay progress(
    "step", this->Wants("openfoam") ? 3 : 2, this->quiet || !Ranks().IsFirst());
  progress.BeginStep(0, "reading");
  const auto mesh =
    ReadUnstructuredGrid((fs::path(this->result) / "weights.vtu").string(), messages);
  const auto rest = ReadPolyData((fs::path(this->result) / "skeleton.vtp").string(), messages);
  const auto boundary = ReadOptional(this->result, "volume_boundary.vtp", messages);
  const auto caps = ReadOptional(this->result, "caps.vtp", messages);
  const bool withFlow = this->Wants("openfoam");
  const auto trees = withFlow
    ? ReadPolyData((fs::path(this->result) / "centerline.vtp").string(), messages)
    : nullptr;
  const auto source = ReadTimedPolyData(poseFiles, this->poseTimes, messages);
  if (mesh->GetNumberOfCells() == 0)
  {
    throw std::runtime_error("'" + this->result + "/weights.vtu' is empty.");
  }

  const bool cycleKnown = source->Find(vtkCoronaryArrayNames::CycleLength);
  if (this->velocity && !cycleKnown && !(this->cycleMs > 0.0))
  {
    throw UsageError(
      "--velocity: the poses do not say how long a cycle takes, --cycle-ms is needed");
  }
  MovingMesh moving;
  moving.Interpolator->SetInputConnection(source->GetOutputPort());
  moving.Interpolator->SetMode(InterpolationMode(this->mode));
  if (this->cycleMs > 0.0)
  {
    moving.Interpolator->SetCycleLength(this->cycleMs / 1000.0);
  }
  moving.Deformation->SetInputData(0, mesh);
  moving.Deformation->SetInputData(1, rest);
  moving.Deformation->SetBlend(Blends.at(this->blend));
  moving.Deformation->SetVolumeConservation(this->volumeConservation);
  moving.Deformation->SetComputeVelocity(this->velocity);
  moving.Deformation->SetTetrahedra(
    this->repair ? vtkSkinDeformation::RepairTetrahedra : vtkSkinDeformation::CheckTetrahedra);
  if (boundary)
  {
    moving.Writer->SetInputData(1, boundary);
  }
  if (caps)
  {
    moving.Writer->SetInputData(2, caps);
  }
  this->Choose(moving.Writer);
  const std::unique_ptr<StagedFolder> folder = Ranks().MakeFolder(this->output);
  std::vector<std::string> cases;
  if (withFlow)
  {
    progress.BeginStep(1, "OpenFOAM");
    if (Ranks().IsFirst())
    {
      cases = this->WriteFlow({ trees, mesh, rest }, source, *folder, messages, progress);
    }
  }
  const bool withSequence = std::any_of(this->formats.begin(), this->formats.end(),
    [](const std::string& format) { return format != "openfoam"; });
  if (withSequence)
  {
    progress.BeginStep(withFlow ? 2 : 1, "phases");
    moving.Writer->SetSharing(&Ranks(), folder.get());
    moving.Write((fs::path(this->output) / "mesh.json").string(),
      this->PhaseTimes(source->GetTimes()), messages,
      [&](double fraction) { progress.Update(fraction); });
  }
  if (Ranks().IsFirst())
  {
    folder->Commit();
  }
  for (const std::string& warning : LinesOfAll(messages.TakeWarnings()))
  {
    std::fprintf(stderr, "Warning: %s\n", warning.c_str());
  }
  if (!this->quiet && Ranks().IsFirst())
  {
    if (withSequence)
    {
      std::printf(
        "%s: %s\n", this->output.c_str(), this->Summary(moving.Writer->GetQuality()).c_str());
    }
    for (const std::string& sentence : cases)
    {
      std::printf("%s/%s\n", this->output.c_str(), sentence.c_str());
    }
  }
}
}

Command MakeSequenceCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand("sequence",
    "One mesh over the heart cycle, for simulations and viewers: series, SimVascular, VMTK, "
    "OBJ, PLY, STL, glTF, OpenFOAM");
  app->footer(
    "Writes DIR/mesh.json and mesh_quality.csv; series: mesh_volume_000.vtu .., "
    "mesh_surface_000.vtp .., their .pvd and .series; simvascular: "
    "mesh_simvascular/phase_000/mesh-complete ..; vmtk: mesh_vmtk_000.vtu ..; obj, ply, stl: "
    "mesh_surface_000.obj ..; gltf: mesh_skin.glb; openfoam: mesh_openfoam_VESSEL/, a case a "
    "tree.");
  auto job = std::make_shared<SequenceJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); }, true };
}
}
