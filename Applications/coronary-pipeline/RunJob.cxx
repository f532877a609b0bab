#include "RunJob.h"

#include "AtomicFile.h"
#include "Command.h"
#include "EditsFile.h"
#include "Interruption.h"
#include "ParallelFor.h"
#include "ProgressDisplay.h"
#include "Ranks.h"
#include "StagedFolder.h"
#include "vtkMessageTrap.h"
#include "vtkRunStages.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr const char* ReportName = "report.json";

/// As in the report: what they are compared by.
nlohmann::ordered_json JsonOf(const std::vector<TreeEdit>& edits)
{
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const TreeEdit& edit : edits)
  {
    list.push_back(nlohmann::ordered_json::parse(EditText(edit)));
  }
  return list;
}
}

RunJob::RunJob(const RunOptions& options, const RunSettings& settings, bool resume, RunEdits edits)
  : Options(options)
  , Settings(settings)
  , Resume(resume)
  , Edits(std::move(edits))
{
}

void RunJob::TellWarnings()
{
  if (Ranks().IsFirst())
  {
    for (const std::string& warning : this->Warnings)
    {
      std::fprintf(stderr, "Warning: %s\n", warning.c_str());
    }
  }
  this->Warnings.clear();
}

void RunJob::Say(const std::string& words)
{
  if (!words.empty())
  {
    this->Summary += (this->Summary.empty() ? "" : "; ") + words;
  }
}

std::vector<RunStage> RunJob::Plan(const RunInput& input, RunReport& report) const
{
  const RunStage first = input.IsSurface() ? RunStage::Centerline
    : input.IsMask()                       ? RunStage::Segmentation
                                           : RunStage::Vesselness;
  const RunStage last = this->Settings.Until();
  if (this->Resume)
  {
    const std::string reason = report.Keep(this->Options, first, last);
    if (!reason.empty() && !this->Settings.quiet && Ranks().IsFirst())
    {
      auto next = first;
      while (report.Has(next))
      {
        next = static_cast<RunStage>(static_cast<int>(next) + 1);
      }
      std::fprintf(stderr, "made anew from stage %s on: %s\n",
        RunStageNames()[static_cast<std::size_t>(next)].c_str(), reason.c_str());
    }
  }
  std::vector<RunStage> stages;
  for (int n = static_cast<int>(first); n <= static_cast<int>(last); ++n)
  {
    if (!report.Has(static_cast<RunStage>(n)))
    {
      stages.push_back(static_cast<RunStage>(n));
    }
  }
  // All ranks have looked into the folder before the first one changes it, and what it found counts.
  std::string numbers;
  for (const RunStage stage : stages)
  {
    numbers += static_cast<char>(stage);
  }
  stages.clear();
  for (const char number : Ranks().FromFirst(numbers))
  {
    stages.push_back(static_cast<RunStage>(number));
  }
  return stages;
}

void RunJob::Commit(StagedFolder& folder, RunStage stage, const RunReport& report) const
{
  folder.TakePlaceOf(UsualFiles(this->Settings.output, stage));
  folder.TakePlaceOf(report.OlderFiles(stage));
  if (stage == RunStage::Centerline && this->Edits.write)
  {
    folder.TakePlaceOf({ EditsFileName });
    if (!this->Edits.list.empty())
    {
      WriteFileAtomically(folder.Add(EditsFileName), EditsText(this->Edits.list));
    }
  }
  WriteFileAtomically(folder.Add(ReportName), report.Text());
  ThrowIfInterrupted();
  if (this->Changed)
  {
    // The report that is there is of this run's earlier stages: who is killed now, resumes from them.
    folder.KeepLast();
  }
  folder.Commit();
}

void RunJob::TellLost(RunStage stage, const RunReport& report)
{
  const nlohmann::ordered_json numbers =
    report.Of(RunStageNames()[static_cast<std::size_t>(stage)]);
  if (!numbers.is_object() || !numbers.contains("lost") || numbers["lost"].empty())
  {
    return;
  }
  std::vector<std::string> lost;
  for (const auto& tree : numbers["lost"])
  {
    lost.push_back(tree["message"].get<std::string>());
  }
  const bool all = numbers.contains("trees") && numbers["trees"].size() == lost.size();
  if (!this->Settings.partial || all)
  {
    throw std::runtime_error(
      lost.front() + (all ? "." : "; or go on with the other one with --partial."));
  }
  this->Warnings.insert(this->Warnings.end(), lost.begin(), lost.end());
}

void RunJob::ShareReference(RunStep& step, ProgressDisplay& progress, int& steps) const
{
  progress.BeginStep(steps++, "reference phase");
  if (Ranks().IsFirst())
  {
    const OthersWait alone(this->Settings.threads);
    FindReference(step);
    const ReferencePhase& chosen = *step.input.Chosen;
    Ranks().FromFirst(Packed(std::vector<int>{ chosen.number }, std::vector<double>{ chosen.time },
      std::vector<char>(chosen.image.begin(), chosen.image.end())));
    return;
  }
  std::vector<int> number;
  std::vector<double> time;
  std::vector<char> image;
  Unpack(Ranks().FromFirst({}), number, time, image);
  step.input.Chosen = { number.front(), time.front(), std::string(image.begin(), image.end()) };
}

void RunJob::Make(
  RunStage stage, RunInput& input, RunReport& report, ProgressDisplay& progress, int& number)
{
  const RunClock clock;
  const bool first = Ranks().IsFirst();
  const std::unique_ptr<StagedFolder> folder = Ranks().MakeFolder(this->Settings.output);
  try
  {
    std::vector<std::string> files;
    RunStep step{ input, report, *folder, files,
      [&](double fraction) { progress.Update(fraction); }, {} };
    if (stage == RunStage::Vesselness)
    {
      this->ShareReference(step, progress, number);
    }
    progress.BeginStep(number++, RunStageNames()[static_cast<std::size_t>(stage)]);
    nlohmann::ordered_json numbers;
    if (IsShared(stage))
    {
      numbers = MakeStage(stage, step);
    }
    else if (first)
    {
      const OthersWait alone(this->Settings.threads);
      numbers = MakeStage(stage, step);
    }
    ThrowIfInterrupted();
    // A stage ends on all ranks together.
    std::vector<std::string> warnings = LinesOfAll(input.Messages.TakeWarnings());
    if (first)
    {
      std::vector<std::pair<std::string, std::string>> sizes;
      sizes.reserve(files.size());
      for (const std::string& file : files)
      {
        sizes.emplace_back(file, folder->PathOf(file));
      }
      warnings.insert(warnings.end(), step.warnings.begin(), step.warnings.end());
      this->Warnings.insert(this->Warnings.end(), warnings.begin(), warnings.end());
      report.Finish(stage, numbers, clock, warnings, sizes);
      this->Commit(*folder, stage, report);
      this->Changed = true;
    }
    Ranks().Gather(""); // the files are in their place
    if (first)
    {
      this->Say(step.summary);
      this->TellLost(stage, report);
    }
  }
  catch (const std::runtime_error& error)
  {
    ThrowIfInterrupted();
    throw std::runtime_error(folder->Translate(error.what()));
  }
}

void RunJob::Stop(RunStage stage, const std::string& reason, RunReport& report) const
{
  if (!Ranks().IsFirst())
  {
    return;
  }
  // What was there stays as it is when this run has made nothing that takes its place.
  std::error_code error;
  const bool there =
    std::filesystem::exists(std::filesystem::path(this->Settings.output) / ReportName, error);
  if (this->Changed || (this->Resume && there && !report.OlderHas(stage)))
  {
    report.Stop(stage, reason);
    WriteFileAtomically(
      (std::filesystem::path(this->Settings.output) / ReportName).string(), report.Text());
  }
}

void RunJob::Run()
{
  if (this->Settings.input.empty() && this->Settings.mask.empty())
  {
    throw UsageError("--input is required, or a mask with --mask");
  }
  if (this->Settings.output.empty())
  {
    throw UsageError("--output is required");
  }
  UseThreads(this->Settings.threads);
  vtkMessageTrap messages;
  RunInput input(this->Settings, messages, this->Edits.list);
  if (this->Settings.surface == "given" && !input.IsSurface())
  {
    throw UsageError("--surface given: the input is no surface");
  }
  if (input.IsSurface() && this->Settings.Until() < RunStage::Centerline)
  {
    throw UsageError("--until " + this->Settings.until + ": a surface has no images");
  }
  if (input.IsMask() && this->Settings.Until() < RunStage::Segmentation)
  {
    throw UsageError("--until " + this->Settings.until + ": a mask has no images");
  }
  if (input.IsMask() && this->Settings.contours)
  {
    throw UsageError("--contours: a mask has no images that show them");
  }
  RunReport report(this->Settings.output, this->Options.All(),
    DescribeInput(input.Files(), this->Settings.output), JsonOf(this->Edits.list));
  const std::vector<RunStage> stages = this->Plan(input, report);
  input.Chosen = report.Reference();
  if (input.IsSurface())
  {
    report.Set("surface_input", this->Settings.input.front());
  }
  else if (input.IsMask())
  {
    report.Set("mask_input", this->Settings.mask);
  }
  if (Ranks().IsFirst())
  {
    // Also of what was made before, where this run goes on.
    for (const RunStage stage : { RunStage::Segmentation, RunStage::Centerline })
    {
      this->TellLost(stage, report);
    }
  }
  int steps = 0;
  for (const RunStage stage : stages)
  {
    steps += stage == RunStage::Vesselness ? 2 : 1;
  }
  int number = 0;
  {
    ProgressDisplay progress("stage", steps, this->Settings.quiet || !Ranks().IsFirst());
    for (const RunStage stage : stages)
    {
      ReleaseImages(input, stage);
      try
      {
        this->Make(stage, input, report, progress, number);
      }
      catch (const Cancelled&)
      {
        this->Stop(stage, "interrupted", report);
        throw;
      }
      catch (const std::bad_alloc&)
      {
        this->Stop(stage, "not enough memory", report);
        this->TellWarnings();
        throw;
      }
      catch (const std::exception& error)
      {
        this->Stop(stage, Ranks().Reason(error.what()), report);
        this->TellWarnings();
        throw;
      }
    }
  }
  if (!Ranks().IsFirst())
  {
    return;
  }
  this->TellWarnings();
  if (this->Settings.quiet)
  {
    return;
  }
  if (stages.empty())
  {
    this->Say("nothing to do");
  }
  if (input.IsSurface() || input.IsMask())
  {
    std::printf("%s: %s\n", this->Settings.output.c_str(), this->Summary.c_str());
    return;
  }
  std::printf("%s: phase %d (%.1f %% R-R), %s\n", this->Settings.output.c_str(),
    input.Chosen->number + 1, 100.0 * input.Chosen->time, this->Summary.c_str());
}
}
