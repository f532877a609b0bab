#include "EvaluationJson.h"

#include <cmath>

namespace coronary
{
nlohmann::ordered_json MeasuresJson(const EvaluationMeasures& measures)
{
  nlohmann::ordered_json all;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    const double value = measures.*column.value;
    all[column.key] = std::isfinite(value) ? nlohmann::ordered_json(value) : nullptr;
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
      entry["phases"].push_back(row);
    }
    for (const bool interpolated : { true, false })
    {
      const std::string kind = interpolated ? "interpolated" : "tracked";
      const MeasureSummary summary = SummarizePhases(one, interpolated);
      entry[kind + "_mean"] = MeasuresJson(summary.mean);
      entry[kind + "_deviation"] = MeasuresJson(summary.deviation);
    }
    entry["warnings"] = one.warnings;
    all["cases"].push_back(entry);
  }
  const MeasureSummary over = SummarizeCases(cases);
  all["mean"] = MeasuresJson(over.mean);
  all["deviation"] = MeasuresJson(over.deviation);
  return all;
}
}
