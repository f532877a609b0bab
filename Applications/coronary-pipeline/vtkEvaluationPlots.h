/**
 * @file vtkEvaluationPlots.h
 * @brief The measures of an evaluation over the phases, as charts.
 */
#ifndef vtkEvaluationPlots_h
#define vtkEvaluationPlots_h

#include "Evaluation.h"

#include <string>
#include <vector>

namespace coronary
{
/**
 * One chart a measure that is known in some phase: `folder`/KEY.png and `folder`/KEY.svg, KEY as in
 * EvaluationColumns. Over %R-R; over the phase's number where fractions are unknown. Discs: tracked phases, squares:
 * interpolated, crosses: lost. Dashed: the paper's mean, of its representative case for one case, of its
 * five for several.
 *
 * Needs a display like the pictures: see CanDraw.
 * @return the SVG files' paths, in the order of the columns
 * @throws std::invalid_argument without cases; std::runtime_error naming a file that can not be written
 */
std::vector<std::string> DrawPlots(
  const std::vector<CaseEvaluation>& cases, const std::string& folder);
}

#endif
