#include "EvaluationJson.h"

#include <cmath>

namespace coronary
{
namespace
{
/// Null: not known.
nlohmann::ordered_json Known(double value)
{
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nullptr;
}
}

nlohmann::ordered_json MeasuresJson(const EvaluationMeasures& measures)
{
  nlohmann::ordered_json all;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    all[column.key] = Known(measures.*column.value);
  }
  return all;
}

nlohmann::ordered_json EvaluationJson(const std::vector<CaseEvaluation>& cases)
{
  nlohmann::ordered_json all;
  all["cases"] = nlohmann::ordered_json::array();
  for (const CaseEvaluation& one : cases)
  {
    nlohmann::ordered_json entry = { { "name", one.name } };
    entry["phases"] = nlohmann::ordered_json::array();
    for (const PhaseEvaluation& phase : one.phases)
    {
      nlohmann::ordered_json row = { { "phase", phase.phase }, { "fraction", phase.fraction },
        { "interpolated", phase.interpolated }, { "lost", phase.lost } };
      row.update(MeasuresJson(phase.measures));
      row["false_branches"] = nlohmann::ordered_json::array();
      for (const FalseBranch& branch : phase.falseBranches)
      {
        row["false_branches"].push_back({ { "group", branch.group }, { "label", branch.label },
          { "length", branch.length }, { "confidence", Known(branch.confidence) } });
      }
      entry["phases"].push_back(row);
    }
    for (const bool interpolated : { true, false })
    {
      const std::string kind = interpolated ? "interpolated" : "tracked";
      const MeasureSummary summary = SummarizePhases(one, interpolated);
      entry[kind + "_mean"] = MeasuresJson(summary.mean);
      entry[kind + "_deviation"] = MeasuresJson(summary.deviation);
    }
    entry["branches"] = nlohmann::ordered_json::array();
    for (const BranchSummary& branch : SummarizeBranches(one))
    {
      entry["branches"].push_back({ { "group", branch.group }, { "label", branch.label },
        { "length", Known(branch.length) }, { "found", Known(branch.found) },
        { "found_minimum", Known(branch.minimum) }, { "worst_phase", branch.worstPhase },
        { "mean", Known(branch.mean) }, { "HD", Known(branch.hausdorff) } });
    }
    entry["findings"] = FindingsOf(one);
    entry["warnings"] = one.warnings;
    all["cases"].push_back(entry);
  }
  const MeasureSummary over = SummarizeCases(cases);
  all["mean"] = MeasuresJson(over.mean);
  all["deviation"] = MeasuresJson(over.deviation);
  return all;
}
}
