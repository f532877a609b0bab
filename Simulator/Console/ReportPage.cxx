#include "ReportPage.h"

#include "XmlText.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace coronary
{
namespace
{
using Json = nlohmann::json;

constexpr const char* Head = R"html(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"/><meta name="viewport" content="width=device-width"/>
<title>%s</title><style>
body { font: 15px/1.45 sans-serif; max-width: 60em; margin: 1.5em auto; padding: 0 1em; color: #1d2730; }
h1 { margin-bottom: 0.2em; } h2 { margin-top: 1.6em; border-bottom: 1px solid #cdd5dc; }
table { border-collapse: collapse; } td, th { padding: 0.2em 0.8em 0.2em 0; text-align: left; vertical-align: top; }
td.number, th.number { text-align: right; } .passed { color: #0a7a3d; } .failed { color: #b3261e; }
.warning { color: #8a5200; } figure { display: inline-block; margin: 0.5em 1em 0.5em 0; } img { width: 18em; background: #000; }
svg { display: block; margin: 0.4em 0 1em 0; } figcaption, .small { color: #5b6770; font-size: 13px; }
</style></head><body>
)html";

/// As people read it; empty for what is not there.
std::string Text(const Json& value)
{
  if (value.is_string())
  {
    return value.get<std::string>();
  }
  if (!value.is_number())
  {
    return {};
  }
  char text[40];
  std::snprintf(text, sizeof(text), "%.4g", value.get<double>());
  return text;
}

std::string Text(const Json& object, const char* name)
{
  const auto found = object.find(name);
  return found == object.end() ? std::string() : Text(*found);
}

std::string Cell(const std::string& text, bool number = false)
{
  return (number ? "<td class=\"number\">" : "<td>") + EscapedXml(text) + "</td>";
}

/// A row for each object, a column for each pair of heading and member; the first ones are texts.
std::string Table(const Json& list, const std::vector<std::pair<std::string, const char*>>& columns,
  std::size_t texts)
{
  std::string table = "<table>\n<tr>";
  for (std::size_t n = 0; n < columns.size(); ++n)
  {
    table +=
      (n < texts ? "<th>" : "<th class=\"number\">") + EscapedXml(columns[n].first) + "</th>";
  }
  table += "</tr>\n";
  for (const Json& one : list)
  {
    table += "<tr>";
    for (std::size_t n = 0; n < columns.size(); ++n)
    {
      table += Cell(Text(one, columns[n].second), n >= texts);
    }
    table += "</tr>\n";
  }
  return table + "</table>\n";
}

std::string Procedure(const Json& procedure)
{
  const bool passed = procedure.at("passed").get<bool>();
  std::string page = "<h2>Procedure</h2>\n<p class=\"" + std::string(passed ? "passed" : "failed") +
    "\"><b>" + (passed ? "Done" : "Failed") + ": " + Text(procedure, "points") +
    " of 100 points</b></p>\n";
  Json steps = procedure.at("steps");
  for (Json& step : steps)
  {
    step["when"] = step.at("seconds").is_null() ? Json("not done") : step.at("seconds");
  }
  page += Table(steps, { { "step", "text" }, { "done at, s", "when" } }, 1);
  for (const Json& failure : procedure.at("failures"))
  {
    page += "<p class=\"failed\">Failed: " + EscapedXml(Text(failure)) + "</p>\n";
  }
  page += "<h2>Score</h2>\n<p>Points are " + EscapedXml(Text(procedure, "formula")) +
    ". The weights were chosen, not fitted to experts.</p>\n";
  return page +
    Table(procedure.at("items"),
      { { "what", "what" }, { "unit", "unit" }, { "amount", "amount" }, { "weight", "weight" },
        { "most", "most" }, { "lost", "lost" } },
      2);
}

std::string Numbers(const Json& session)
{
  static const std::pair<const char*, const char*> rows[] = { { "time, s", "procedure_s" },
    { "X-ray, s", "fluoroscopy_s" }, { "cine of it, s", "cine_s" }, { "frames", "frames" },
    { "air kerma, mGy", "air_kerma_mGy" }, { "dose-area product, Gy cm2", "dose_area_Gy_cm2" },
    { "contrast medium, mL", "contrast_mL" },
    { "greatest force on the wall, N", "greatest_wall_force_N" },
    { "greatest force of the tip, N", "greatest_tip_force_N" },
    { "wire moved, mm", "wire_travel_mm" },
    { "of it in the vessel without X-ray, mm", "wire_travel_without_xray_mm" },
    { "wire beyond the catheter at most, mm", "deepest_mm" },
    { "vessel closed by a balloon, s", "occluded_s" },
    { "ST segment up by 0.1 mV, s", "st_elevated_s" },
    { "blood in the pericardium, mL", "pericardial_mL" } };
  const Json& metrics = session.at("metrics");
  std::string page = "<h2>Numbers</h2>\n<table>\n";
  for (const auto& [name, member] : rows)
  {
    page += "<tr>" + Cell(name) + Cell(Text(metrics, member), true) + "</tr>\n";
  }
  page += "</table>\n";
  Json events = metrics.at("events");
  if (!events.empty())
  {
    for (Json& event : events)
    {
      std::string what = Text(event, "what");
      std::replace(what.begin(), what.end(), '_', ' ');
      event["what"] = what;
    }
    page += "<h2>Events</h2>\n" +
      Table(events,
        { { "what", "what" }, { "vessel", "vessel" }, { "at, s", "seconds" },
          { "from the ostium, mm", "place_mm" } },
        2);
  }
  return page;
}

std::string Results(const Json& session)
{
  std::string page;
  const auto narrowed = [&](const char* what, const char* title)
  {
    if (session.contains(what) && !session[what].empty())
    {
      page += std::string("<h2>") + title + "</h2>\n" +
        Table(session[what],
          { { "vessel", "vessel" }, { "reference, mm", "reference_mm" },
            { "stenosis before, %", "stenosis_before_percent" }, { "now, %", "stenosis_percent" },
            { "FFR before", "ffr_before" }, { "now", "ffr" } },
          1);
    }
  };
  narrowed("lesions", "Lesions");
  narrowed("side_branches", "Side branches");
  if (session.contains("tears"))
  {
    page += "<h2>Torn walls</h2>\n" +
      Table(session["tears"],
        { { "what", "what" }, { "vessel", "vessel" }, { "by", "by" }, { "sealed", "sealed" },
          { "from the ostium, mm", "place_mm" },
          { "diameter over reference", "diameter_over_reference" },
          { "flap, % of the diameter", "flap_percent" }, { "hole, mm", "hole_mm" },
          { "Ellis type", "ellis" }, { "blood, mL", "blood_mL" },
          { "contrast medium, mL", "contrast_mL" } },
        4);
  }
  if (session.contains("stents") && !session["stents"].empty())
  {
    page += "<h2>Stents</h2>\n" +
      Table(session["stents"],
        { { "stent", "name" }, { "vessel", "vessel" }, { "from, mm", "from_mm" },
          { "to, mm", "to_mm" }, { "least diameter, mm", "least_diameter_mm" },
          { "expansion, %", "expansion_percent" },
          { "residual stenosis, %", "residual_stenosis_percent" },
          { "greatest gap, mm", "greatest_gap_mm" } },
        2);
  }
  return page;
}

std::string Curve(const ReportCurve& curve, const std::vector<double>& seconds)
{
  constexpr double Width = 760.0;
  constexpr double Height = 90.0;
  constexpr std::size_t MostPoints = 1500;
  double low = 0.0;
  double high = 0.0;
  for (const double value : curve.values)
  {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  const double span = std::max(high - low, 1e-12);
  const double end = std::max(seconds.back(), 1e-12);
  const std::size_t stride = 1 + curve.values.size() / MostPoints;
  std::string points;
  for (std::size_t n = 0; n < curve.values.size(); n += stride)
  {
    // The greatest of what a point stands for: peaks stay.
    const auto first = curve.values.begin() + static_cast<std::ptrdiff_t>(n);
    const auto last =
      first + static_cast<std::ptrdiff_t>(std::min(stride, curve.values.size() - n));
    const double value =
      *std::max_element(first, last, [](double a, double b) { return std::abs(a) < std::abs(b); });
    char text[64];
    std::snprintf(text, sizeof(text), "%.1f,%.1f ", Width * seconds[n] / end,
      Height - Height * (value - low) / span);
    points += text;
  }
  char frame[400];
  std::snprintf(frame, sizeof(frame),
    "<svg width=\"%g\" height=\"%g\" viewBox=\"-2 -2 %g %g\"><path d=\"M0 0V%gH%g\" fill=\"none\" "
    "stroke=\"#9aa5ad\"/><polyline fill=\"none\" stroke=\"#1f6fb2\" points=\"",
    Width + 4.0, Height + 4.0, Width + 4.0, Height + 4.0, Height, Width);
  char range[80];
  std::snprintf(range, sizeof(range), ": %.3g to %.3g, over %.4g s", low, high, end);
  return "<div class=\"small\">" + EscapedXml(curve.name) + range + "</div>" + frame + points +
    "\"/></svg>\n";
}
}

std::string ReportPage(const Json& session, const std::vector<double>& seconds,
  const std::vector<ReportCurve>& curves, const std::vector<ReportPicture>& pictures)
{
  const std::string name = EscapedXml(Text(session, "scenario"));
  std::string page = Head;
  page.replace(page.find("%s"), 2, name);
  page += "<h1>" + name +
    "</h1>\n<p class=\"small\">A simulated session: " + EscapedXml(Text(session, "program")) +
    "; " + EscapedXml(Text(session, "wire")) + " in " + EscapedXml(Text(session, "catheter")) +
    "; motion: " + EscapedXml(Text(session, "motion")) + "</p>\n";
  for (const Json& note : session.at("notes"))
  {
    page += "<p class=\"warning\">" + EscapedXml(Text(note)) + "</p>\n";
  }
  if (session.contains("procedure"))
  {
    page += Procedure(session["procedure"]);
  }
  page += Numbers(session) + Results(session);
  if (!pictures.empty())
  {
    page += "<h2>Cine runs</h2>\n";
    for (const ReportPicture& picture : pictures)
    {
      page += "<figure><img src=\"" + EscapedXml(picture.file) + "\" alt=\"\"/><figcaption>" +
        EscapedXml(picture.text) + "</figcaption></figure>\n";
    }
  }
  if (seconds.size() > 1)
  {
    page +=
      "<h2>Curves</h2>\n<p class=\"small\">At the moments of forces.csv; peaks between them are "
      "among the numbers.</p>\n";
    for (const ReportCurve& curve : curves)
    {
      page += Curve(curve, seconds);
    }
  }
  return page + "</body></html>\n";
}
}
