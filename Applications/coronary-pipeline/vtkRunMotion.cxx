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

#include "vtkCardiacPhaseInterpolator.h"
#include "vtkCenterlineTracker.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkGatedImageReader.h"
#include "vtkInformation.h"
#include "vtkInformationDoubleVectorKey.h"
#include "vtkMeshSequenceWriter.h"
#include "vtkMotionRegularizer.h"
#include "vtkPolyData.h"
#include "vtkPopulationMotion.h"
#include "vtkSkinDeformation.h"
#include "vtkStreamingDemandDrivenPipeline.h"
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

std::vector<double> Moments(const RunInput& input)
{
  std::vector<double> times = input.Settings.moments;
  if (times.empty())
  {
    for (int n = 0; n < input.Reader->GetNumberOfPhases(); ++n)
    {
      times.push_back(input.Reader->GetPhaseTime(n));
    }
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

std::vector<double> TimeSteps(vtkAlgorithm* algorithm)
{
  vtkInformation* info = algorithm->GetOutputInformation(0);
  vtkInformationDoubleVectorKey* key = vtkStreamingDemandDrivenPipeline::TIME_STEPS();
  const double* steps = info->Get(key);
  return steps ? std::vector<double>(steps, steps + info->Length(key)) : std::vector<double>();
}

/// Mesh, deformation and writer of a run, but for the poses.
void ConnectMesh(RunStep& step, vtkPolyData* skeleton, MovingMesh& moving)
{
  vtkMessageTrap& messages = step.input.Messages;
  moving.Interpolator->SetMode(InterpolationMode(step.input.Settings.interpolation));
  moving.Deformation->SetInputData(0, ReadUnstructuredGrid(PathOf(step, "weights.vtu"), messages));
  moving.Deformation->SetInputData(1, skeleton);
  moving.Writer->SetInputData(1, ReadLines(step, "volume_boundary.vtp"));
  moving.Writer->SetInputData(2, ReadLines(step, "caps.vtp"));
  moving.Writer->PrefixFilesOff();
  moving.Writer->SetDigits(PhaseDigits);
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
  vtkNew<vtkCardiacPhaseInterpolator> lines;
  lines->SetInputConnection(axes->GetOutputPort());
  MovingMesh moving;
  moving.Interpolator->SetInputConnection(poses->GetOutputPort());
  ConnectMesh(step, skeleton, moving);
  Json lists;
  lists["centerline"] = WriteMovingLines(lines, "centerline", times, step);
  lists["skeleton"] = WriteMovingLines(moving.Interpolator, "skeleton", times, step);
  lists.update(WriteMovingMesh(moving, times, step, step.progress));
  if (!Ranks().IsFirst())
  {
    return {};
  }
  step.warnings.push_back(
    "motion is not possible: " + reason + "; motion/ holds the model at rest");
  step.summary = "no motion: " + reason;
  return { { "possible", false }, { "motion", "none" }, { "reason", reason }, { "at_rest", true },
    { "file", "motion.pvd" }, { "series", lists }, { "quality", "motion/mesh.json" },
    { "times", times } };
}

std::vector<int> InvertedTetrahedra(const MovingMesh& moving)
{
  std::vector<int> inverted;
  vtkTable* quality = moving.Writer->GetQuality();
  for (vtkIdType n = 0; n < quality->GetNumberOfRows(); ++n)
  {
    inverted.push_back(
      quality->GetValueByName(n, vtkCoronaryArrayNames::InvertedTetrahedra).ToInt());
  }
  return inverted;
}

/// The model with the motion of a population, in the files of a tracked one.
Json MakePopulation(RunStep& step, const MotionPlan& plan)
{
  const auto skeleton = ReadLines(step, "skeleton.vtp");
  const auto tree = ReadTree(step);
  PopulationPoses poses(step, tree, skeleton, plan);
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
  std::vector<double> times = step.input.Settings.moments;
  times = times.empty() ? poses.Times() : times;
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  vtkNew<vtkCardiacPhaseInterpolator> lines;
  lines->SetInputConnection(poses.Motion->GetOutputPort(0));
  lines->SetMode(InterpolationMode(step.input.Settings.interpolation));
  MovingMesh moving;
  moving.Interpolator->SetInputConnection(poses.Motion->GetOutputPort(1));
  ConnectMesh(step, skeleton, moving);
  Json lists;
  lists["centerline"] = WriteMovingLines(lines, "centerline", times, step);
  lists["skeleton"] = WriteMovingLines(moving.Interpolator, "skeleton", times, step);
  lists.update(WriteMovingMesh(
    moving, times, step, [&](double fraction) { step.progress(0.8 + 0.2 * fraction); }));
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
  told.update(
    Json{ { "file", "motion.pvd" }, { "series", lists }, { "quality", "motion/mesh.json" },
      { "times", times }, { "inverted_tetrahedra", InvertedTetrahedra(moving) } });
  return told;
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
  vtkNew<vtkCenterlineTracker> tracker;
  tracker->SetInputConnection(step.input.Reader->GetOutputPort());
  const auto tree = ReadTree(step);
  tracker->SetInputDataObject(1, tree);
  tracker->SetInputDataObject(2, skeleton);
  tracker->SetTemporalWindow(settings.temporalWindowMs / 1000.0);
  tracker->SetTrackedPhases(settings.tracked == "even" ? vtkCenterlineTracker::EvenPhases
                                                       : vtkCenterlineTracker::AllPhases);
  tracker->SetSharing(&Ranks());
  const std::vector<double> times = Moments(step.input);
  // What was measured is kept to as far as it is known; between the phases and the mesh is what was made of it.
  vtkNew<vtkMotionRegularizer> keptLines;
  keptLines->SetInputConnection(0, tracker->GetOutputPort(0));
  keptLines->SetInputDataObject(1, tree);
  vtkNew<vtkMotionRegularizer> keptSkeleton;
  keptSkeleton->SetInputConnection(0, tracker->GetOutputPort(1));
  keptSkeleton->SetInputDataObject(1, skeleton);
  tracker->UpdateInformation();
  for (vtkMotionRegularizer* kept : { keptLines.Get(), keptSkeleton.Get() })
  {
    kept->SetTemporalWeight(TemporalWeightOf(TimeSteps(tracker).size()));
  }
  vtkNew<vtkCardiacPhaseInterpolator> lines;
  lines->SetInputConnection(
    settings.limits ? keptLines->GetOutputPort() : tracker->GetOutputPort(0));
  lines->SetMode(InterpolationMode(settings.interpolation));
  MovingMesh moving;
  moving.Interpolator->SetInputConnection(
    settings.limits ? keptSkeleton->GetOutputPort() : tracker->GetOutputPort(1));
  ConnectMesh(step, skeleton, moving);

  // The images are read now.
  UpdateAtTime(
    tracker, 0, times.front(), messages, [&](double fraction) { step.progress(0.8 * fraction); });
  Json lists;
  lists["centerline"] = WriteMovingLines(lines, "centerline", times, step);
  lists["skeleton"] = WriteMovingLines(moving.Interpolator, "skeleton", times, step);
  lists.update(WriteMovingMesh(
    moving, times, step, [&](double fraction) { step.progress(0.8 + 0.2 * fraction); }));
  if (!Ranks().IsFirst())
  {
    return {};
  }
  vtkDataSet* tracked = vtkDataSet::SafeDownCast(tracker->GetOutputDataObject(0));
  step.summary = std::to_string(times.size()) + " moments";
  Json limits = { { "applied", settings.limits } };
  if (settings.limits)
  {
    limits.update(DescribeLimits(keptLines, keptSkeleton, tree, messages));
  }
  return { { "possible", true }, { "motion", "tracked" }, { "file", "motion.pvd" },
    { "series", lists }, { "quality", "motion/mesh.json" }, { "times", times },
    { "tracked_times", TimeSteps(tracker) },
    { "tracked_share", Numbers(tracked, vtkCoronaryArrayNames::TrackedShare) },
    { "repeatability_mm", Numbers(tracked, vtkCoronaryArrayNames::TrackingRepeatability) },
    { "filled", DescribeFilled(tracker, tree, messages) }, { "limits", limits },
    { "inverted_tetrahedra", InvertedTetrahedra(moving) } };
}
}
