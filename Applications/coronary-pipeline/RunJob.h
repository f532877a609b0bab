/**
 * @file RunJob.h
 * @brief The stages of a run, one after the other into its folder: what is fit stays, the others are made.
 */
#ifndef DynamicCoronary_RunJob_h
#define DynamicCoronary_RunJob_h

#include "RunReport.h"
#include "RunSettings.h"
#include "TreeEdits.h"

#include <string>
#include <vector>

namespace coronary
{
class ProgressDisplay;
class RunInput;
class StagedFolder;
struct RunStep;

/// Edits by hand that a run is made with.
struct RunEdits
{
  std::vector<TreeEdit> list;
  bool write = false; ///< they become the folder's, together with the stage that they change
};

class RunJob
{
public:
  /// @param options  of `settings`; both must outlive this
  /// @param resume   go on from the last stage in the folder that is fit
  RunJob(const RunOptions& options, const RunSettings& settings, bool resume, RunEdits edits);

  /// @throws UsageError, std::runtime_error, Cancelled
  void Run();

private:
  /// What is kept of the folder; what is left to do.
  std::vector<RunStage> Plan(const RunInput& input, RunReport& report) const;
  /// Of another rank than the first its share of it, or nothing but to wait.
  void Make(
    RunStage stage, RunInput& input, RunReport& report, ProgressDisplay& progress, int& number);
  /// Trees that a finished stage has lost are an error, or with --partial a warning.
  void TellLost(RunStage stage, const RunReport& report);
  /// The first rank looks for the reference phase, and all know it then.
  void ShareReference(RunStep& step, ProgressDisplay& progress, int& steps) const;
  void Commit(StagedFolder& folder, RunStage stage, const RunReport& report) const;
  void Stop(RunStage stage, const std::string& reason, RunReport& report) const;
  void Say(const std::string& words);
  /// What the stages so far have warned of, also of a run that fails.
  void TellWarnings();

  const RunOptions& Options;
  const RunSettings& Settings;
  bool Resume;
  RunEdits Edits;
  bool Changed = false; ///< the folder
  std::vector<std::string> Warnings;
  std::string Summary;
};
}

#endif
