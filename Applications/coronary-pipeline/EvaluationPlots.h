/**
 * @file EvaluationPlots.h
 * @brief The measures of an evaluation over the phases, as drawings for papers and for the review page.
 */
#ifndef DynamicCoronary_EvaluationPlots_h
#define DynamicCoronary_EvaluationPlots_h

#include "Evaluation.h"

#include <string>
#include <vector>

namespace coronary
{
struct EvaluationPlot
{
  std::string key; ///< as in EvaluationColumns
  std::string svg; ///< a file; all texts in it are escaped
};

/**
 * One drawing a measure that is known in some phase, all cases in it, in the order of EvaluationColumns. Over %R-R; over
 * the phase's number where a fraction is unknown. Discs: tracked phases, diamonds: interpolated, crosses: lost. Dashed:
 * the paper's mean over interpolated phases, of its representative case for one case, of its five for several.
 *
 * For who draws on it: `data-frame` are the values at both ends of the axis, then left, right, top and bottom of the chart;
 * `data-over` is what the axis has, "fraction" or "phase"; `data-height` is the drawing's without the names of the cases;
 * groups of the class "case" have the case's number in `data-case`.
 */
std::vector<EvaluationPlot> DrawPlots(const std::vector<CaseEvaluation>& cases);
}

#endif
