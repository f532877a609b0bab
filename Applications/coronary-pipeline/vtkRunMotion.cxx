#include "vtkRunMotion.h"

#include "AtomicFile.h"
#include "FileSeries.h"
#include "Interruption.h"
#include "MeshSequenceReport.h"
#include "MotionRegularization.h"
#include "Ranks.h"
#include "StagedFolder.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkMovingMesh.h"
#include "vtkRunLimits.h"
#include "vtkRunPopulation.h"
#include "vtkRunTrees.h"
#include "vtkTimedPolyData.h"

#include "vtkAlgorithmOutput.h"
#include "vtkCardiacPhaseInterpolator.h"
#include "vtkCenterlineTracker.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkGatedImageReader.h"
#include "vtkMeshSequenceWriter.h"
#include "vtkMotionRegularizer.h"
#include "vtkPolyData.h"
#include "vtkPopulationMotion.h"
#include "vtkSkinDeformation.h"
#include "vtkTable.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int PhaseDigits = 2;

/// The lines or the skeleton at every moment, and their lists; gives the name of one of these.
std::string WriteMovingLines(
  vtkAlgorithm* lines, const std::string& stem, const std::vector<double>& times, RunStep& step)
{
  std::vector<TimedFile> files;
  for (std::size_t n = 0; n < times.size(); ++n)
  {
    std::string name = stem + "_";
    name.append(SeriesNumber(n, times.size(), PhaseDigits)).append(".vtp");
    files.push_back({ name, times[n] });
    const std::string path = step.Add("motion/" + files.back().path);
    if (Ranks().Owns(n))
    {
      UpdateAtTime(lines, 0, times[n], step.input.Messages, [](double) {});
      WritePolyData(
        path, vtkPolyData::SafeDownCast(lines->GetOutputDataObject(0)), step.input.Messages);
    }
  }
  std::string list = "motion/" + stem + ".vtp.series";
  if (Ranks().IsFirst())
  {
    WriteFileAtomically(step.Add(list), FileSeriesText(files));
    WriteFileAtomically(step.Add("motion/" + stem + ".pvd"), PvdText(files));
  }
  return list;
}

/// The moments that were asked for, or else these; each once, in order.
std::vector<double> Moments(const RunSettings& settings, const std::vector<double>& otherwise)
{
  std::vector<double> times = settings.moments.empty() ? otherwise : settings.moments;
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

/// The moving mesh at these times, with the lists of all that is in motion/; those on the first rank.
Json WriteMovingMesh(MovingMesh& moving, const std::vector<double>& times, RunStep& step,
  const std::function<void(double)>& progress)
{
  const std::string name = "motion/mesh.json";
  const std::string path = step.Add(name);
  const std::unique_ptr<StagedFolder> folder =
    Ranks().MakeFolder(fs::path(path).parent_path().string());
  moving.Writer->SetSharing(&Ranks(), folder.get());
  moving.Write(path, times, step.input.Messages, progress);
  if (!Ranks().IsFirst())
  {
    return Json::object();
  }
  folder->Commit();
  for (const std::string& file : MeshSequenceFiles(path))
  {
    if ("motion/" + file != name)
    {
      step.Add("motion/" + file);
    }
  }
  std::vector<TimedFile> surfaces =
    ReadFileSeries((fs::path(path).parent_path() / "surface.pvd").string());
  for (TimedFile& file : surfaces)
  {
    file.path = "motion/" + fs::path(file.path).filename().string();
  }
  WriteFileAtomically(step.Add("motion.pvd"), PvdText(surfaces));
  return { { "volume", "motion/volume.vtu.series" }, { "surface", "motion/surface.vtp.series" } };
}

/// Writes lines, skeleton and mesh at these moments, and gives what any report tells of them; only the first rank has it.
/// @param lines  of the tree  @param poses  of the skeleton
/// @param done   share of the stage that is behind
Json WriteMotion(RunStep& step, vtkAlgorithmOutput* lines, vtkAlgorithmOutput* poses,
  const std::vector<double>& times, double done)
{
  vtkMessageTrap& messages = step.input.Messages;
  const int mode = InterpolationMode(step.input.Settings.interpolation);
  vtkNew<vtkCardiacPhaseInterpolator> movingLines;
  movingLines->SetInputConnection(lines);
  movingLines->SetMode(mode);
  MovingMesh moving;
  moving.Interpolator->SetInputConnection(poses);
  moving.Interpolator->SetMode(mode);
  moving.Deformation->SetInputData(0, ReadUnstructuredGrid(PathOf(step, "weights.vtu"), messages));
  moving.Deformation->SetInputData(1, ReadLines(step, "skeleton.vtp"));
  moving.Writer->SetInputData(1, ReadLines(step, "volume_boundary.vtp"));
  moving.Writer->SetInputData(2, ReadLines(step, "caps.vtp"));
  moving.Writer->PrefixFilesOff();
  moving.Writer->SetDigits(PhaseDigits);
  Json lists;
  lists["centerline"] = WriteMovingLines(movingLines, "centerline", times, step);
  lists["skeleton"] = WriteMovingLines(moving.Interpolator, "skeleton", times, step);
  lists.update(WriteMovingMesh(
    moving, times, step, [&](double fraction) { step.progress(done + (1.0 - done) * fraction); }));
  if (!Ranks().IsFirst())
  {
    return {};
  }
  Json inverted = Json::array();
  vtkTable* quality = moving.Writer->GetQuality();
  for (vtkIdType n = 0; n < quality->GetNumberOfRows(); ++n)
  {
    inverted.push_back(
      quality->GetValueByName(n, vtkCoronaryArrayNames::InvertedTetrahedra).ToInt());
  }
  return { { "file", "motion.pvd" }, { "series", lists }, { "quality", "motion/mesh.json" },
    { "times", times }, { "inverted_tetrahedra", inverted } };
}

/// The model at rest in the files of a moving one, so that all that reads these takes it: every pose is the same.
Json MakeRest(RunStep& step, const std::string& reason)
{
  // The phase that it is, so that it can be compared with what is known of that, and one half a cycle away.
  const double own = step.input.Chosen ? step.input.Chosen->time : 0.0;
  std::vector<double> times = step.input.Settings.moments;
  if (times.size() < 2)
  {
    times = { own, own < 0.5 ? own + 0.5 : own - 0.5 };
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  const auto skeleton = ReadLines(step, "skeleton.vtp");
  const auto tree = ReadTree(step);
  vtkNew<vtkTimedPolyData> axes;
  vtkNew<vtkTimedPolyData> poses;
  for (const double time : { 0.0, 0.5 })
  {
    axes->Add(time, tree);
    poses->Add(time, skeleton);
  }
  const Json written = WriteMotion(step, axes->GetOutputPort(), poses->GetOutputPort(), times, 0.0);
  if (!Ranks().IsFirst())
  {
    return {};
  }
  step.warnings.push_back(
    "motion is not possible: " + reason + "; motion/ holds the model at rest");
  step.summary = "no motion: " + reason;
  Json told = { { "possible", false }, { "motion", "none" }, { "reason", reason },
    { "at_rest", true } };
  told.update(written);
  told.erase("inverted_tetrahedra"); // nothing moves
  return told;
}

/// The model with the motion of a population, in the files of a tracked one.
Json MakePopulation(RunStep& step, const MotionPlan& plan)
{
  const auto tree = ReadTree(step);
  PopulationPoses poses(step, tree, ReadLines(step, "skeleton.vtp"), plan);
  try
  {
    poses.Update(step, [&](double fraction) { step.progress(0.8 * fraction); });
  }
  catch (const std::runtime_error& error)
  {
    ThrowIfInterrupted();
    if (plan.asked)
    {
      throw;
    }
    // Trees without names, or of other vessels, have no heart that they belong to.
    return MakeRest(step, plan.reason + ", and no population's motion: " + error.what());
  }
  const std::vector<double> times = Moments(step.input.Settings, poses.Times());
  const Json written =
    WriteMotion(step, poses.Motion->GetOutputPort(0), poses.Motion->GetOutputPort(1), times, 0.8);
  if (!Ranks().IsFirst())
  {
    return {};
  }
  step.warnings.push_back(
    poses.Statement() + (plan.reason.empty() ? "" : " (" + plan.reason + ")"));
  if (!poses.Assumption().empty())
  {
    step.warnings.push_back(poses.Assumption());
  }
  step.summary = std::to_string(times.size()) + " moments, " + poses.Statement();
  Json told = poses.Describe(plan);
  told["placement"] = DescribePlacement(poses.Motion, tree, step.input.Messages);
  told.update(written);
  return told;
}

std::vector<double> PhaseTimes(vtkGatedImageReader* reader)
{
  std::vector<double> times(static_cast<std::size_t>(reader->GetNumberOfPhases()));
  for (std::size_t n = 0; n < times.size(); ++n)
  {
    times[n] = reader->GetPhaseTime(static_cast<int>(n));
  }
  return times;
}
}

Json MakeMotion(RunStep& step)
{
  const RunSettings& settings = step.input.Settings;
  vtkMessageTrap& messages = step.input.Messages;
  const MotionPlan plan = PlanMotion(step.input);
  if (plan.kind == MotionKind::Rest)
  {
    return MakeRest(step, plan.reason);
  }
  if (plan.kind == MotionKind::Population)
  {
    return MakePopulation(step, plan);
  }
  const auto skeleton = ReadLines(step, "skeleton.vtp");
  const auto tree = ReadTree(step);
  vtkNew<vtkCenterlineTracker> tracker;
  ConnectTracker(tracker, step, tree);
  tracker->SetInputDataObject(2, skeleton);
  const std::vector<double> times = Moments(settings, PhaseTimes(step.input.Reader));
  tracker->UpdateInformation();
  const std::vector<double> steps = TimeSteps(tracker);
  // What was measured is kept to as far as it is known; between the phases and the mesh is what was made of it.
  vtkNew<vtkMotionRegularizer> keptLines;
  keptLines->SetInputConnection(0, tracker->GetOutputPort(0));
  keptLines->SetInputDataObject(1, tree);
  vtkNew<vtkMotionRegularizer> keptSkeleton;
  keptSkeleton->SetInputConnection(0, tracker->GetOutputPort(1));
  keptSkeleton->SetInputDataObject(1, skeleton);
  for (vtkMotionRegularizer* kept : { keptLines.Get(), keptSkeleton.Get() })
  {
    kept->SetTemporalWeight(TemporalWeightOf(steps.size()));
  }

  // The images are read now.
  UpdateAtTime(
    tracker, 0, times.front(), messages, [&](double fraction) { step.progress(0.8 * fraction); });
  const Json written = settings.limits
    ? WriteMotion(step, keptLines->GetOutputPort(), keptSkeleton->GetOutputPort(), times, 0.8)
    : WriteMotion(step, tracker->GetOutputPort(0), tracker->GetOutputPort(1), times, 0.8);
  if (!Ranks().IsFirst())
  {
    return {};
  }
  vtkDataSet* tracked = vtkDataSet::SafeDownCast(tracker->GetOutputDataObject(0));
  step.summary = std::to_string(times.size()) + " moments";
  const Json placement = DescribePlacement(tracker, tree, messages);
  if (const std::string doubtful = DoubtfulPlaces(placement); !doubtful.empty())
  {
    step.warnings.push_back(doubtful);
  }
  Json limits = { { "applied", settings.limits } };
  if (settings.limits)
  {
    limits.update(DescribeLimits(keptLines, keptSkeleton, tree, messages));
  }
  Json told = { { "possible", true }, { "motion", "tracked" } };
  told.update(written);
  told.update(Json{ { "tracked_times", steps },
    { "tracked_share", Numbers(tracked, vtkCoronaryArrayNames::TrackedShare) },
    { "repeatability_mm", Numbers(tracked, vtkCoronaryArrayNames::TrackingRepeatability) },
    { "placement", placement }, { "filled", DescribeFilled(tracker, tree, messages) },
    { "limits", limits } });
  return told;
}
}
