#include "Command.h"

#include "AtomicFile.h"
#include "FileSeries.h"
#include "Interruption.h"
#include "MeshSequenceReport.h"
#include "MetaImageWriter.h"
#include "OptionChecks.h"
#include "ParallelFor.h"
#include "ProgressDisplay.h"
#include "StagedFolder.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkMovingMesh.h"

#include "vtkBiharmonicSkinWeights.h"
#include "vtkCardiacPhaseInterpolator.h"
#include "vtkCellData.h"
#include "vtkCenterlineSkeleton.h"
#include "vtkCenterlineTracker.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryTreeTopology.h"
#include "vtkDataArray.h"
#include "vtkFastMarchingCenterline.h"
#include "vtkFieldData.h"
#include "vtkFrangiVesselness.h"
#include "vtkFrenetSweepSurface.h"
#include "vtkGatedImageReader.h"
#include "vtkImageData.h"
#include "vtkMeshSequenceWriter.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkReferencePhase.h"
#include "vtkSkinDeformation.h"
#include "vtkStringArray.h"
#include "vtkTable.h"
#include "vtkTetrahedralMesher.h"
#include "vtkUnstructuredGrid.h"
#include "vtkVesselSegmentation.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace coronary
{
namespace
{
constexpr const char* ReportName = "report.json";

/// How far the road is gone; later stages come after earlier ones.
enum class Stage
{
  Vesselness,
  Segmentation,
  Centerline,
  Surface,
  Volume,
  Weights,
  Motion
};
const std::vector<std::pair<std::string, Stage>> Stages = {
  { "vesselness", Stage::Vesselness },
  { "segmentation", Stage::Segmentation },
  { "centerline", Stage::Centerline },
  { "surface", Stage::Surface },
  { "volume", Stage::Volume },
  { "weights", Stage::Weights },
  { "motion", Stage::Motion },
};

struct RunJob
{
  std::vector<std::string> paths;
  std::string output;
  Stage until = Stage::Centerline;
  double time = std::numeric_limits<double>::quiet_NaN(); ///< NaN: the quietest phase
  std::vector<double> fractions;
  double cycleMs = 1000.0;
  std::string series;
  std::vector<double> scales = { 0.5, 2.5 };
  double c = 100.0; // the largest norm in a clinical CT belongs to bone and metal
  std::vector<double> seeds;
  double largestRadius = 4.5;
  std::vector<double> window;
  bool beyondMask = false;
  double leastBranch = 0.0;
  double centerlineSeconds = 120.0;
  std::vector<double> edges = { 0.15, 0.7 };
  bool contours = false;
  bool openEnds = false;
  std::string weightCache;
  double temporalWindowMs = 66.0;
  bool evenPhases = false;
  std::vector<double> moments; ///< empty: the phases of the series
  std::string interpolation = "cubic";
  bool leaveBonesOutside = false;
  int threads = 0;
  bool compress = false;
  bool quiet = false;

  void Declare(CLI::App& app);
  void Run();
  nlohmann::ordered_json WriteMotion(vtkCenterlineTracker* tracker, MovingMesh& moving,
    const std::vector<double>& times, StagedFolder& folder, vtkMessageTrap& messages,
    const std::function<void(double)>& progress);
  void TakePlaceOfOlderMotion(StagedFolder& folder) const;
};

void RunJob::Declare(CLI::App& app)
{
  app
    .add_option("PATH", this->paths,
      "A folder of DICOM files, a series.json, a 4-D volume, or one volume a phase")
    ->type_name("")
    ->required();
  app.add_option("--output", this->output, "Folder to write to; made when it does not exist")
    ->type_name("DIR")
    ->required();
  app
    .add_option_function<std::string>(
      "--until",
      [this](const std::string& name)
      {
        for (const auto& [known, stage] : Stages)
        {
          if (name == known)
          {
            this->until = stage;
          }
        }
      },
      "Last stage: vesselness, segmentation, centerline (the default), surface, volume, weights or "
      "motion")
    ->check(CLI::IsMember(
      { "vesselness", "segmentation", "centerline", "surface", "volume", "weights", "motion" }))
    ->type_name("STAGE");

  const std::string image = "Image";
  app
    .add_option("--time", this->time,
      "Reference time, fraction of the R-R interval: the nearest phase is taken. Without it, the "
      "quietest phase is found")
    ->check(Within(-100.0, 100.0))
    ->type_name("FRACTION")
    ->group(image);
  app
    .add_option("--fractions", this->fractions,
      "R-R fractions of the phases, instead of those in the files: 0,0.35,0.75")
    ->check(Within(-100.0, 100.0))
    ->delimiter(',')
    ->allow_extra_args(false)
    ->type_name("LIST")
    ->group(image);
  app.add_option("--cycle-ms", this->cycleMs, "R-R interval, in ms, for files that do not give it")
    ->check(Within(1.0, 60000.0))
    ->type_name("MS")
    ->capture_default_str()
    ->group(image);
  app.add_option("--series", this->series, "The DICOM series to read from a folder with several")
    ->type_name("UID")
    ->group(image);

  const std::string vessels = "Vessels";
  app.add_option("--scales", this->scales, "Smallest and largest scale of the vesselness, mm")
    ->check(Within(0.05, 50.0))
    ->expected(2)
    ->type_name("MIN MAX")
    ->capture_default_str()
    ->group(vessels);
  app
    .add_option("--c", this->c,
      "Norm of the Hessian from which on structure counts, HU; 0: half the largest one")
    ->check(Within(0.0, 1e6))
    ->type_name("HU")
    ->capture_default_str()
    ->group(vessels);
  app
    .add_option("--seed", this->seeds,
      "A point in a vessel or on its ostium, LPS mm; may be repeated. Without any, aorta and ostia "
      "are looked for")
    ->check(Within(-1e5, 1e5))
    ->expected(3)
    ->allow_extra_args(true)
    ->type_name("X Y Z")
    ->group(vessels);
  app
    .add_option("--largest-radius", this->largestRadius,
      "Blood that a ball of this radius fits into is aorta or chamber, mm")
    ->check(Within(1.0, 50.0))
    ->type_name("MM")
    ->capture_default_str()
    ->group(vessels);
  app
    .add_option("--window", this->window,
      "Image values of tissue and of undiluted blood, instead of measuring them")
    ->check(Within(-1e5, 1e5))
    ->expected(2)
    ->type_name("TISSUE BLOOD")
    ->group(vessels);

  const std::string lines = "Centerlines";
  app
    .add_flag("--beyond-mask", this->beyondMask,
      "March wherever a vessel is to be seen, not only inside the segmented lumen: some thin "
      "vessels are followed farther, at the risk of others' lumens, and slower")
    ->group(lines);
  app
    .add_option("--least-branch", this->leastBranch, "Shorter branches are none, mm; 0: ten voxels")
    ->check(Within(0.0, 1000.0))
    ->type_name("MM")
    ->capture_default_str()
    ->group(lines);
  app
    .add_option("--centerline-seconds", this->centerlineSeconds,
      "After this time the trees are written as far as they are found")
    ->check(Within(0.1, 1e6))
    ->type_name("S")
    ->capture_default_str()
    ->group(lines);

  const std::string walls = "Surface";
  app
    .add_option("--edges", this->edges,
      "Length of the triangles' edges where the wall is most curved and where it is flat, mm")
    ->check(Within(0.001, 100.0))
    ->expected(2)
    ->type_name("MIN MAX")
    ->capture_default_str()
    ->group(walls);
  app
    .add_flag(
      "--contours", this->contours, "Cross-sections as the image shows them, instead of round ones")
    ->group(walls);
  app.add_flag("--open-ends", this->openEnds, "Inlets and outlets without caps")->group(walls);
  app
    .add_option("--weight-cache", this->weightCache,
      "Folder in which skin weights are kept; the same mesh, bones and settings are read from "
      "there")
    ->type_name("DIR")
    ->group("Weights");

  const std::string motion = "Motion";
  app
    .add_option("--temporal-window-ms", this->temporalWindowMs,
      "Time over which an image was taken, ms: half a turn of the gantry, a quarter with two "
      "sources")
    ->check(Within(0.0, 1000.0))
    ->type_name("MS")
    ->capture_default_str()
    ->group(motion);
  app
    .add_flag(
      "--even-phases", this->evenPhases, "Track every other phase only, and interpolate the others")
    ->group(motion);
  app
    .add_option("--moments", this->moments,
      "R-R fractions at which the moved meshes are written; without it, at the phases of the "
      "series")
    ->check(Within(-100.0, 100.0))
    ->delimiter(',')
    ->allow_extra_args(false)
    ->type_name("LIST")
    ->group(motion);
  app
    .add_option("--interpolation", this->interpolation,
      "Between the tracked phases: linear, cubic or low-noise")
    ->check(CLI::IsMember(InterpolationModes()))
    ->capture_default_str()
    ->group(motion);
  app
    .add_flag("--leave-bones-outside", this->leaveBonesOutside,
      "Leave out bones that lie wholly outside of the mesh, with a warning, instead of failing")
    ->group("Weights");
  app.add_flag("--compress", this->compress, "Compress the image files");
  app.add_option("--threads", this->threads, "Number of threads; 0: all cores")
    ->check(WholeWithin(0, 1024))
    ->type_name("N")
    ->capture_default_str();
  app.add_flag("--quiet", this->quiet, "No progress and no summary");
}

/// The number of the phase at a time.
int PhaseAt(vtkGatedImageReader* reader, double time)
{
  int best = 0;
  for (int phase = 1; phase < reader->GetNumberOfPhases(); ++phase)
  {
    if (std::abs(reader->GetPhaseTime(phase) - time) < std::abs(reader->GetPhaseTime(best) - time))
    {
      best = phase;
    }
  }
  return best;
}

nlohmann::ordered_json Numbers(vtkDataSet* data, const char* name)
{
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  if (vtkDataArray* array = data->GetFieldData()->GetArray(name))
  {
    for (vtkIdType n = 0; n < array->GetNumberOfValues(); ++n)
    {
      list.push_back(array->GetTuple1(n));
    }
  }
  return list;
}

nlohmann::ordered_json DescribeSeeds(vtkPolyData* seeds)
{
  vtkPointData* data = seeds->GetPointData();
  auto* names = vtkStringArray::SafeDownCast(data->GetAbstractArray(vtkCoronaryArrayNames::Name));
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (vtkIdType n = 0; n < seeds->GetNumberOfPoints(); ++n)
  {
    const auto value = [&](const char* name) { return data->GetArray(name)->GetTuple1(n); };
    double position[3];
    seeds->GetPoint(n, position);
    list.push_back(
      { { "name", names->GetValue(n) }, { "position", { position[0], position[1], position[2] } },
        { "confidence", value(vtkCoronaryArrayNames::Confidence) },
        { "radius", value(vtkCoronaryArrayNames::Radius) },
        { "volume", value(vtkCoronaryArrayNames::SeedVolume) } });
  }
  return list;
}

/// Text for one field of a CSV file.
std::string Quoted(const std::string& text)
{
  std::string quoted = "\"";
  for (const char c : text)
  {
    quoted += c == '"' ? "\"\"" : std::string(1, c);
  }
  return quoted + "\"";
}

/// What became of each seed: reached, or why not, with the tree that hangs on it.
nlohmann::ordered_json DescribeTrees(vtkPolyData* lines, vtkPolyData* seeds)
{
  vtkFieldData* fields = lines->GetFieldData();
  vtkDataArray* status = fields->GetArray(vtkCoronaryArrayNames::SeedStatus);
  auto* messages =
    vtkStringArray::SafeDownCast(fields->GetAbstractArray(vtkCoronaryArrayNames::SeedMessage));
  auto* names = vtkStringArray::SafeDownCast(
    seeds->GetPointData()->GetAbstractArray(vtkCoronaryArrayNames::Name));
  vtkDataArray* treeIds = lines->GetCellData()->GetArray(vtkCoronaryArrayNames::TreeIds);
  vtkDataArray* lengths = lines->GetCellData()->GetArray(vtkCoronaryArrayNames::Length);
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (vtkIdType n = 0; n < seeds->GetNumberOfPoints(); ++n)
  {
    vtkIdType branches = 0;
    double length = 0.0;
    for (vtkIdType cell = 0; cell < lines->GetNumberOfCells(); ++cell)
    {
      if (treeIds->GetTuple1(cell) == static_cast<double>(n))
      {
        ++branches;
        length += lengths->GetTuple1(cell);
      }
    }
    double position[3];
    seeds->GetPoint(n, position);
    list.push_back(
      { { "name", names->GetValue(n) }, { "position", { position[0], position[1], position[2] } },
        { "status", static_cast<int>(status->GetTuple1(n)) }, { "message", messages->GetValue(n) },
        { "branches", branches }, { "length", length } });
  }
  return list;
}

std::string StatusTable(const nlohmann::ordered_json& trees)
{
  std::string table = "name,x_mm,y_mm,z_mm,status,message,branches,length_mm\n";
  for (const auto& tree : trees)
  {
    table += Quoted(tree["name"].get<std::string>());
    for (const auto& value : tree["position"])
    {
      table += "," + value.dump();
    }
    table += "," + tree["status"].dump() + "," + Quoted(tree["message"].get<std::string>()) + "," +
      tree["branches"].dump() + "," + tree["length"].dump() + "\n";
  }
  return table;
}

/// The lines or the skeleton at every moment, and their list.
std::string WriteMovingLines(vtkAlgorithm* lines, const std::string& stem,
  const std::vector<double>& times, StagedFolder& folder, vtkMessageTrap& messages)
{
  std::vector<TimedFile> files;
  for (std::size_t n = 0; n < times.size(); ++n)
  {
    std::array<char, 16> number;
    std::snprintf(number.data(), number.size(), "_%03d", static_cast<int>(n));
    files.push_back({ stem + number.data() + ".vtp", times[n] });
    UpdateAtTime(lines, 0, times[n], messages, [](double) {});
    WritePolyData(folder.Add("motion/" + files.back().path),
      vtkPolyData::SafeDownCast(lines->GetOutputDataObject(0)), messages);
  }
  std::string list = "motion/" + stem + ".vtp.series";
  WriteFileAtomically(folder.Add(list), FileSeriesText(files));
  return list;
}

void RunJob::TakePlaceOfOlderMotion(StagedFolder& folder) const
{
  std::vector<std::string> older = MeshSequenceFiles(this->output + "/motion/mesh.json");
  for (const char* stem : { "centerline", "skeleton" })
  {
    const std::string list = this->output + "/motion/" + stem + ".vtp.series";
    try
    {
      for (const TimedFile& file : ReadFileSeries(list))
      {
        const std::string name = std::filesystem::path(file.path).filename().string();
        if (name.rfind(std::string(stem) + "_", 0) == 0)
        {
          older.push_back(name);
        }
      }
    }
    catch (const std::runtime_error&)
    {
      // There is none.
    }
  }
  for (std::string& name : older)
  {
    name.insert(0, "motion/");
  }
  folder.TakePlaceOf(older);
}

nlohmann::ordered_json RunJob::WriteMotion(vtkCenterlineTracker* tracker, MovingMesh& moving,
  const std::vector<double>& times, StagedFolder& folder, vtkMessageTrap& messages,
  const std::function<void(double)>& progress)
{
  const int mode = InterpolationMode(this->interpolation);
  vtkNew<vtkCardiacPhaseInterpolator> lines;
  lines->SetInputConnection(tracker->GetOutputPort(0));
  lines->SetMode(mode);
  moving.Interpolator->SetInputConnection(tracker->GetOutputPort(1));
  moving.Interpolator->SetMode(mode);

  // The images are read now.
  UpdateAtTime(
    tracker, 0, times.front(), messages, [&](double fraction) { progress(0.8 * fraction); });
  nlohmann::ordered_json lists;
  lists["centerline"] = WriteMovingLines(lines, "centerline", times, folder, messages);
  lists["skeleton"] = WriteMovingLines(moving.Interpolator, "skeleton", times, folder, messages);
  const std::string name = "motion/mesh.json";
  const std::string path = folder.Add(name);
  moving.Write(path, times, messages, [&](double fraction) { progress(0.8 + 0.2 * fraction); });
  for (const std::string& file : MeshSequenceFiles(path))
  {
    if ("motion/" + file != name)
    {
      folder.Add("motion/" + file);
    }
  }
  lists["volume"] = "motion/mesh_volume.vtu.series";
  lists["surface"] = "motion/mesh_surface.vtp.series";
  this->TakePlaceOfOlderMotion(folder);

  vtkDataSet* tracked = vtkDataSet::SafeDownCast(tracker->GetOutputDataObject(0));
  nlohmann::ordered_json inverted = nlohmann::ordered_json::array();
  vtkTable* quality = moving.Writer->GetQuality();
  for (vtkIdType n = 0; n < quality->GetNumberOfRows(); ++n)
  {
    inverted.push_back(
      quality->GetValueByName(n, vtkCoronaryArrayNames::InvertedTetrahedra).ToInt());
  }
  return { { "series", lists }, { "quality", name }, { "times", times },
    { "tracked_share", Numbers(tracked, vtkCoronaryArrayNames::TrackedShare) },
    { "repeatability_mm", Numbers(tracked, vtkCoronaryArrayNames::TrackingRepeatability) },
    { "inverted_tetrahedra", inverted } };
}

void RunJob::Run()
{
  if (this->scales[0] > this->scales[1])
  {
    throw UsageError("--scales: the first must not be above the second");
  }
  if (!this->window.empty() && this->window[0] >= this->window[1])
  {
    throw UsageError("--window: blood must be above tissue");
  }
  if (this->edges[0] > this->edges[1])
  {
    throw UsageError("--edges: the first must not be above the second");
  }
  if (this->openEnds && this->until >= Stage::Volume)
  {
    throw UsageError("--open-ends: tetrahedra need a closed surface");
  }
  if (this->seeds.size() % 3 != 0)
  {
    throw UsageError("--seed: three coordinates are needed for each point");
  }
  SetNumberOfThreads(this->threads);
  vtkMessageTrap messages;
  vtkNew<vtkGatedImageReader> reader;
  for (const std::string& path : this->paths)
  {
    reader->AddFileName(path.c_str());
  }
  for (std::size_t i = 0; i < this->fractions.size(); ++i)
  {
    reader->SetPhaseFraction(static_cast<int>(i), this->fractions[i]);
  }
  reader->SetCycleLength(this->cycleMs / 1000.0);
  if (!this->series.empty())
  {
    reader->SetSeriesInstanceUID(this->series.c_str());
  }
  reader->UpdateInformation();
  messages.ThrowIfError();
  if (this->until >= Stage::Motion && reader->GetNumberOfPhases() < (this->evenPhases ? 3 : 2))
  {
    throw std::runtime_error("'" + this->paths.front() + "' has " +
      (reader->GetNumberOfPhases() < 2 ? "one phase only" : "two phases, of which one is tracked") +
      ": there is no motion to track.");
  }
  nlohmann::ordered_json report;
  int phase = 0;
  double phaseTime = 0.0;

  StagedFolder folder(this->output);
  std::string summary;
  try
  {
    const bool segment = this->until >= Stage::Segmentation;
    const bool trace = this->until >= Stage::Centerline;
    const bool mesh = this->until >= Stage::Surface;
    const bool fill = this->until >= Stage::Volume;
    const bool bind = this->until >= Stage::Weights;
    const bool move = this->until >= Stage::Motion;
    ProgressDisplay progress("stage",
      move        ? 8
        : bind    ? 7
        : fill    ? 6
        : mesh    ? 5
        : trace   ? 4
        : segment ? 3
                  : 2,
      this->quiet);
    const auto update = [&](vtkAlgorithm* algorithm)
    {
      UpdateAtTime(
        algorithm, 0, phaseTime, messages, [&](double fraction) { progress.Update(fraction); });
    };
    const auto keepGoing = [](double) { return Interruption() == 0; };

    progress.BeginStep(0, "reference phase");
    vtkNew<vtkReferencePhase> reference;
    reference->SetInputConnection(reader->GetOutputPort());
    reference->SetAutomatic(std::isnan(this->time) && reader->GetNumberOfPhases() > 1);
    reference->SetTime(std::isnan(this->time) ? reader->GetPhaseTime(0) : this->time);
    update(reference);
    phaseTime = reference->GetUsedTime();
    if (std::isnan(phaseTime))
    {
      phaseTime = reader->GetPhaseTime(0);
    }
    phase = PhaseAt(reader, phaseTime);
    report = { { "phase", phase }, { "time", phaseTime },
      { "image", reader->GetPhaseFileName(phase) } };

    progress.BeginStep(1, "vesselness");
    vtkNew<vtkFrangiVesselness> vesselness;
    vesselness->SetInputConnection(reference->GetOutputPort());
    vesselness->SetSigmaMin(this->scales[0]);
    vesselness->SetSigmaMax(this->scales[1]);
    vesselness->SetAutomaticC(!(this->c > 0.0));
    vesselness->SetC(this->c > 0.0 ? this->c : 1.0);
    update(vesselness);
    vtkImageData* response = vesselness->GetOutput();
    WriteMetaImage(folder.Add("vesselness.mha"), vtkCoronary::GridOf(response),
      static_cast<const float*>(response->GetScalarPointer()), this->compress, keepGoing);
    report["vesselness"] = { { "file", "vesselness.mha" },
      { "sigmas", Numbers(response, vtkCoronaryArrayNames::VesselnessSigmas) },
      { "c", vesselness->GetUsedC() } };
    summary = "vesselness with c = " + Format(vesselness->GetUsedC());

    if (segment)
    {
      progress.BeginStep(2, "segmentation");
      vtkNew<vtkVesselSegmentation> segmentation;
      segmentation->SetInputConnection(reference->GetOutputPort());
      segmentation->SetVesselnessConnection(vesselness->GetOutputPort());
      for (std::size_t n = 0; n + 2 < this->seeds.size(); n += 3)
      {
        segmentation->AddSeed(this->seeds[n], this->seeds[n + 1], this->seeds[n + 2]);
      }
      segmentation->SetLargestRadius(this->largestRadius);
      if (!this->window.empty())
      {
        segmentation->AutomaticWindowOff();
        segmentation->SetTissueValue(this->window[0]);
        segmentation->SetBloodValue(this->window[1]);
      }
      update(segmentation);
      vtkImageData* mask = segmentation->GetOutput();
      auto* seedsFound = vtkPolyData::SafeDownCast(
        segmentation->GetOutputDataObject(vtkVesselSegmentation::SeedsPort));
      auto* aorta = vtkPolyData::SafeDownCast(
        segmentation->GetOutputDataObject(vtkVesselSegmentation::AortaPort));
      WriteMetaImage(folder.Add("mask.mha"), vtkCoronary::GridOf(mask),
        static_cast<const unsigned char*>(mask->GetScalarPointer()), this->compress, keepGoing);
      WritePolyData(folder.Add("ostia.vtp"), seedsFound, messages);
      WritePolyData(folder.Add("aorta.vtp"), aorta, messages);
      report["segmentation"] = { { "file", "mask.mha" },
        { "window", Numbers(mask, vtkCoronaryArrayNames::BloodWindow) },
        { "seeds", DescribeSeeds(seedsFound) }, { "seeds_file", "ostia.vtp" },
        { "aorta_file", "aorta.vtp" } };
      for (const auto& seed : report["segmentation"]["seeds"])
      {
        char text[160];
        std::snprintf(text, sizeof(text), "; %s at %.1f %.1f %.1f (confidence %.2f), %.0f mm^3",
          seed["name"].get<std::string>().c_str(), seed["position"][0].get<double>(),
          seed["position"][1].get<double>(), seed["position"][2].get<double>(),
          seed["confidence"].get<double>(), seed["volume"].get<double>());
        summary += text;
      }

      if (trace)
      {
        progress.BeginStep(3, "centerline");
        vtkNew<vtkFastMarchingCenterline> centerline;
        centerline->SetInputConnection(vesselness->GetOutputPort());
        centerline->SetSeedConnection(
          segmentation->GetOutputPort(vtkVesselSegmentation::SeedsPort));
        centerline->SetIntensityConnection(reference->GetOutputPort());
        if (!this->beyondMask)
        {
          centerline->SetMaskConnection(segmentation->GetOutputPort());
        }
        centerline->SetMinimumBranchLength(this->leastBranch);
        centerline->SetTimeLimit(this->centerlineSeconds);
        vtkNew<vtkCoronaryTreeTopology> topology;
        topology->SetInputConnection(centerline->GetOutputPort());
        topology->SetRootConnection(segmentation->GetOutputPort(vtkVesselSegmentation::SeedsPort));
        UpdateAtTime(centerline, 0, phaseTime, messages,
          [&](double fraction) { progress.Update(0.9 * fraction); });
        UpdateAtTime(topology, 0, phaseTime, messages,
          [&](double fraction) { progress.Update(0.9 + 0.1 * fraction); });
        vtkPolyData* raw = centerline->GetOutput();
        vtkPolyData* tree = topology->GetOutput();
        auto* lines = vtkPolyData::SafeDownCast(
          centerline->GetOutputDataObject(vtkFastMarchingCenterline::LinesPort));
        auto* forks = vtkPolyData::SafeDownCast(
          topology->GetOutputDataObject(vtkCoronaryTreeTopology::BifurcationPort));
        WritePolyData(folder.Add("centerline.vtp"), tree, messages);
        WritePolyData(folder.Add("bifurcations.vtp"), forks, messages);
        WritePolyData(folder.Add("centerline_lines.vtp"), lines, messages);
        const nlohmann::ordered_json trees = DescribeTrees(raw, seedsFound);
        WriteFileAtomically(folder.Add("status.csv"), StatusTable(trees));
        const auto text = [&](const char* name)
        {
          auto* array = vtkStringArray::SafeDownCast(tree->GetFieldData()->GetAbstractArray(name));
          return array && array->GetNumberOfValues() > 0 ? std::string(array->GetValue(0))
                                                         : std::string();
        };
        vtkDataArray* complete = raw->GetFieldData()->GetArray(vtkCoronaryArrayNames::Complete);
        double length = 0.0;
        for (const auto& one : trees)
        {
          length += one["length"].get<double>();
        }
        report["centerline"] = { { "file", "centerline.vtp" },
          { "bifurcations_file", "bifurcations.vtp" }, { "lines_file", "centerline_lines.vtp" },
          { "status_file", "status.csv" }, { "trees", trees },
          { "complete", complete && complete->GetTuple1(0) != 0.0 },
          { "branches", tree->GetNumberOfLines() }, { "bifurcations", forks->GetNumberOfPoints() },
          { "dominance", text(vtkCoronaryArrayNames::Dominance) },
          { "image_blur", Numbers(raw, vtkCoronaryArrayNames::ImageBlur) } };
        summary += "; " + std::to_string(tree->GetNumberOfLines()) + " branches, " +
          Format(std::round(length)) + " mm";

        if (mesh)
        {
          progress.BeginStep(4, "surface");
          vtkNew<vtkFrenetSweepSurface> sweep;
          sweep->SetInputConnection(topology->GetOutputPort());
          if (this->contours)
          {
            sweep->SetImageConnection(reference->GetOutputPort());
          }
          sweep->SetMinimumEdgeLength(this->edges[0]);
          sweep->SetMaximumEdgeLength(this->edges[1]);
          sweep->SetCapping(!this->openEnds);
          update(sweep);
          vtkPolyData* surface = sweep->GetOutput();
          WritePolyData(folder.Add("surface.vtp"), surface, messages);
          WritePolyData(folder.Add("caps.vtp"), sweep->GetCaps(), messages);
          report["surface"] = { { "file", "surface.vtp" }, { "caps_file", "caps.vtp" },
            { "triangles", surface->GetNumberOfPolys() },
            { "points", surface->GetNumberOfPoints() },
            { "caps", sweep->GetCaps()->GetNumberOfPoints() } };
          summary += "; " + std::to_string(surface->GetNumberOfPolys()) + " triangles";

          if (fill)
          {
            progress.BeginStep(5, "volume");
            vtkNew<vtkTetrahedralMesher> mesher;
            mesher->SetInputConnection(sweep->GetOutputPort());
            // With bones, these are to be edges of the mesh.
            vtkNew<vtkCenterlineSkeleton> skeleton;
            skeleton->SetInputConnection(topology->GetOutputPort());
            mesher->SetSkeletonConnection(
              bind ? skeleton->GetOutputPort() : topology->GetOutputPort());
            // Where the wall was smoothed, the line may leave it.
            mesher->LeaveOutsideOn();
            // The smallest vessels of a coarse image may need smaller ones than the filter's default
            // allows; the report has the least.
            mesher->SetMinimumVolume(0.0);
            update(mesher);
            vtkUnstructuredGrid* volume = mesher->GetOutput();
            WriteUnstructuredGrid(folder.Add("volume.vtu"), volume, messages);
            WritePolyData(folder.Add("volume_boundary.vtp"), mesher->GetBoundary(), messages);
            WritePolyData(folder.Add("volume_skeleton.vtp"), mesher->GetEdges(), messages);
            report["volume"] = { { "file", "volume.vtu" },
              { "boundary_file", "volume_boundary.vtp" },
              { "skeleton_file", "volume_skeleton.vtp" },
              { "tetrahedra", volume->GetNumberOfCells() },
              { "points", volume->GetNumberOfPoints() },
              { "least_dihedral_angle_rad",
                Numbers(volume, vtkCoronaryArrayNames::LeastDihedralAngle) },
              { "least_volume_mm3", Numbers(volume, vtkCoronaryArrayNames::LeastVolume) },
              { "total_volume_mm3", Numbers(volume, vtkCoronaryArrayNames::TotalVolume) },
              { "tries", Numbers(volume, vtkCoronaryArrayNames::Tries) } };
            summary += "; " + std::to_string(volume->GetNumberOfCells()) + " tetrahedra";

            if (bind)
            {
              progress.BeginStep(6, "weights");
              vtkNew<vtkBiharmonicSkinWeights> weights;
              weights->SetInputConnection(mesher->GetOutputPort());
              weights->SetSkeletonConnection(skeleton->GetOutputPort());
              weights->SetCacheFolder(this->weightCache.c_str());
              weights->SetLeaveOutside(this->leaveBonesOutside);
              update(weights);
              vtkUnstructuredGrid* bound = weights->GetOutput();
              vtkPolyData* bones = skeleton->GetOutput();
              WritePolyData(folder.Add("skeleton.vtp"), bones, messages);
              WriteUnstructuredGrid(folder.Add("weights.vtu"), bound, messages);
              report["weights"] = { { "file", "weights.vtu" }, { "skeleton_file", "skeleton.vtp" },
                { "bones", bones->GetNumberOfLines() }, { "joints", bones->GetNumberOfPoints() },
                { "converged", Numbers(bound, vtkCoronaryArrayNames::WeightsConverged) },
                { "iterations", Numbers(bound, vtkCoronaryArrayNames::WeightsIterations) },
                { "residual", Numbers(bound, vtkCoronaryArrayNames::WeightsResidual) },
                { "energy_gap", Numbers(bound, vtkCoronaryArrayNames::WeightsEnergyGap) },
                { "row_sums", Numbers(bound, vtkCoronaryArrayNames::WeightsRowSums) },
                { "error_on_bones", Numbers(bound, vtkCoronaryArrayNames::WeightsOnBones) } };
              if (this->leaveBonesOutside)
              {
                report["weights"]["left_out_bones"] =
                  Numbers(bound, vtkCoronaryArrayNames::LeftOutBones);
              }
              summary += "; " + std::to_string(bones->GetNumberOfLines()) + " bones";

              if (move)
              {
                progress.BeginStep(7, "motion");
                vtkNew<vtkCenterlineTracker> tracker;
                tracker->SetInputConnection(reader->GetOutputPort());
                tracker->SetLinesConnection(topology->GetOutputPort());
                tracker->SetSkeletonConnection(skeleton->GetOutputPort());
                tracker->SetTemporalWindow(this->temporalWindowMs / 1000.0);
                tracker->SetTrackedPhases(this->evenPhases ? vtkCenterlineTracker::EvenPhases
                                                           : vtkCenterlineTracker::AllPhases);
                std::vector<double> times;
                for (int n = 0; n < reader->GetNumberOfPhases(); ++n)
                {
                  times.push_back(reader->GetPhaseTime(n));
                }
                if (!this->moments.empty())
                {
                  times = this->moments;
                  std::sort(times.begin(), times.end());
                  times.erase(std::unique(times.begin(), times.end()), times.end());
                }
                MovingMesh moving;
                moving.Deformation->SetInputConnection(weights->GetOutputPort());
                moving.Deformation->SetRestConnection(skeleton->GetOutputPort());
                moving.Writer->SetInputData(1, mesher->GetBoundary());
                moving.Writer->SetInputData(2, sweep->GetCaps());
                report["motion"] = this->WriteMotion(tracker, moving, times, folder, messages,
                  [&](double fraction) { progress.Update(fraction); });
                summary += "; " + std::to_string(times.size()) + " moments";
              }
            }
          }
        }
      }
    }
    WriteFileAtomically(folder.Add(ReportName), report.dump(2) + "\n");
    ThrowIfInterrupted();
  }
  catch (const std::runtime_error& error)
  {
    ThrowIfInterrupted();
    throw std::runtime_error(folder.Translate(error.what()));
  }
  folder.Commit();
  messages.PrintWarnings();
  if (!this->quiet)
  {
    std::printf("%s: phase %d (%.1f %% R-R), %s\n", this->output.c_str(), phase + 1,
      100.0 * phaseTime, summary.c_str());
  }
}
}

Command MakeRunCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "run", "From a gated image series to the coronary arteries, stage by stage");
  app->footer("Writes DIR/vesselness.mha, mask.mha, ostia.vtp, aorta.vtp, centerline.vtp, "
              "bifurcations.vtp, centerline_lines.vtp, status.csv; with --until surface, "
              "surface.vtp and caps.vtp; with --until volume, volume.vtu, volume_boundary.vtp "
              "and volume_skeleton.vtp; with --until weights, skeleton.vtp and weights.vtu; with "
              "--until motion, motion/ with series of centerlines, skeletons, tetrahedra and "
              "surfaces; and, last, report.json.");
  auto job = std::make_shared<RunJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); } };
}
}
