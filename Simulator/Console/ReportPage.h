/**
 * @file ReportPage.h
 * @brief A session as a page for trainee and teacher: steps, score, numbers, curves, pictures.
 */
#ifndef DynamicCoronary_ReportPage_h
#define DynamicCoronary_ReportPage_h

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace coronary
{
/// Over the session, one value for each moment of ReportPage.
struct ReportCurve
{
  std::string name; ///< with its unit
  std::vector<double> values;
};

struct ReportPicture
{
  std::string file; ///< beside the page
  std::string text; ///< under it
};

/**
 * HTML that is also well-formed XML, without scripts.
 * @param session  as statistics.json has it
 * @param seconds  moments of the curves
 */
std::string ReportPage(const nlohmann::json& session, const std::vector<double>& seconds,
  const std::vector<ReportCurve>& curves, const std::vector<ReportPicture>& pictures);
}

#endif
