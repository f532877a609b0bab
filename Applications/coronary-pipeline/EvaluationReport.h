/**
 * @file EvaluationReport.h
 * @brief An evaluation as one HTML file that needs no other file and no network.
 */
#ifndef DynamicCoronary_EvaluationReport_h
#define DynamicCoronary_EvaluationReport_h

#include "Evaluation.h"

#include <string>
#include <utility>
#include <vector>

namespace coronary
{
struct ReportPicture
{
  std::string path; ///< PNG or GIF
  std::string title;
  std::string caption; ///< may be empty
};

/// Pictures of one case. What is empty is left out.
struct ReportCase
{
  std::vector<ReportPicture> pictures;
  std::vector<std::string> beating; ///< PNG, one a phase, of one size
};

struct EvaluationReport
{
  std::string title = "Evaluation";
  std::vector<std::pair<std::string, std::string>> settings; ///< name, value: inputs and options
  std::vector<CaseEvaluation> cases;
  std::vector<ReportCase> illustrations; ///< as many as cases, or none
  std::vector<std::string> plots;        ///< SVG files
  std::vector<std::string> warnings;     ///< besides those of the cases
};

/**
 * The report as HTML 5. Every text in it is escaped. Tables: Part A a case, Part B, the paper's numbers beside
 * both, branches a case.
 * @throws std::invalid_argument for illustrations that do not fit the cases; std::runtime_error naming a file
 *         that can not be read
 */
std::string EvaluationHtml(const EvaluationReport& report);

/// @throws as EvaluationHtml; std::runtime_error naming the file that can not be written
void WriteEvaluationReport(const EvaluationReport& report, const std::string& path);
}

#endif
