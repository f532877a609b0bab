/**
 * @file EvaluationJson.h
 * @brief table1.json: all measures of an evaluation, and their means.
 */
#ifndef DynamicCoronary_EvaluationJson_h
#define DynamicCoronary_EvaluationJson_h

#include "Evaluation.h"

#include <nlohmann/json.hpp>

#include <vector>

namespace coronary
{
/// A value for each key of EvaluationColumns(); null: not known.
nlohmann::ordered_json MeasuresJson(const EvaluationMeasures& measures);

/// `cases[]` with their phases, means and deviations; `mean` and `deviation` over the cases.
nlohmann::ordered_json EvaluationJson(const std::vector<CaseEvaluation>& cases);
}

#endif
