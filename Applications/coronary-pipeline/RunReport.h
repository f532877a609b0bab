/**
 * @file RunReport.h
 * @brief report.json of `run`: what was made of what, and what of it a resumed run can keep.
 */
#ifndef DynamicCoronary_RunReport_h
#define DynamicCoronary_RunReport_h

#include "RunSettings.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
/// Number, bytes, latest change and a digest of the names, sizes and times of the input's files.
/// @param files   files, and folders with all that is in them
/// @param except  a folder that does not count
nlohmann::ordered_json DescribeInput(
  const std::vector<std::string>& files, const std::string& except);

/// Wall and processor time, the latter with that of ended child processes.
class RunClock
{
public:
  RunClock();
  double Seconds() const;
  double CpuSeconds() const;

private:
  std::chrono::steady_clock::time_point Start;
  double StartCpu;
};

/// Greatest memory of the process so far, MB.
double PeakMemory();

/// The phase of a gated series in which the model is found.
struct ReferencePhase
{
  int number = 0;
  double time = 0.0; ///< fraction of R-R
  std::string image; ///< its file
};

class RunReport
{
public:
  /**
   * Of a new run; what is kept of an older one comes with Keep().
   * @param settings  as of RunOptions::All()
   * @param input     as of DescribeInput()
   * @param edits     a list of those by hand, as in their file
   */
  RunReport(std::string folder, nlohmann::ordered_json settings, nlohmann::ordered_json input,
    nlohmann::ordered_json edits);

  /**
   * Keeps the finished stages of the report in the folder, up to the first that is not fit: unfinished, of
   * another input, of other settings or edits, or with a file that is gone or has another size.
   * @param last  the last stage that is wanted
   * @return why no more stages are kept; empty when all are, up to the last
   */
  std::string Keep(const RunOptions& options, RunStage first, RunStage last);

  /// Whether a stage is done: finished, or left out for a reason.
  bool Has(RunStage stage) const;

  /// What a finished stage tells; null when there is nothing.
  nlohmann::ordered_json Of(const std::string& name) const;

  /// The reference phase; nothing: not chosen, or the input has no phases.
  std::optional<ReferencePhase> Reference() const;
  void SetReference(const ReferencePhase& reference);

  /// What the run as a whole tells: "surface_input", ..
  void Set(const std::string& name, const nlohmann::ordered_json& value);

  /// A stage is finished; `files` are paths in the folder, and `sizes` where they are now.
  void Finish(RunStage stage, const nlohmann::ordered_json& numbers, const RunClock& clock,
    const std::vector<std::string>& warnings,
    const std::vector<std::pair<std::string, std::string>>& files);

  /// The run ended within a stage.
  void Stop(RunStage stage, const std::string& reason);

  std::string Text() const;

  /// Files of a stage and of those after it, as the report in the folder has them.
  std::vector<std::string> OlderFiles(RunStage from) const;

  /// Whether the report in the folder has this stage.
  bool OlderHas(RunStage stage) const;

private:
  std::string WhyNot(const RunOptions& options, RunStage stage) const;

  std::string Folder;
  nlohmann::ordered_json Head;
  nlohmann::ordered_json Settings;
  nlohmann::ordered_json Input;
  nlohmann::ordered_json Edits;
  nlohmann::ordered_json Stages = nlohmann::ordered_json::array();
  nlohmann::ordered_json Numbers = nlohmann::ordered_json::object(); ///< by stage
  nlohmann::ordered_json Stopped;
  nlohmann::ordered_json Older;
  std::string WhyNoOlder;
  std::string Started;
};
}

#endif
