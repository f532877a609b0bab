#include "EvaluationReport.h"

#include "Base64.h"
#include "HtmlParts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr const char* Style = R"(
:root{color-scheme:light}
*{box-sizing:border-box}
body{font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;color:#1b1b1b;
background:#fff;margin:0 auto;max-width:76rem;padding:1rem}
h1{font-size:1.7rem;line-height:1.2;margin:.4rem 0 1rem}
h2{font-size:1.3rem;border-bottom:2px solid #ddd;padding-bottom:.2rem;margin:2.2rem 0 .8rem}
h3{font-size:1.05rem;margin:1.6rem 0 .5rem}
nav ul{padding:0;list-style:none;display:flex;flex-wrap:wrap;gap:.2rem 0}
nav li{margin-right:1.2rem}
.scroll{overflow-x:auto;-webkit-overflow-scrolling:touch}
table{border-collapse:collapse;margin-bottom:1rem;font-variant-numeric:tabular-nums;font-size:.9rem}
caption{text-align:left;color:#555;padding:.2rem 0 .4rem}
th,td{padding:.22rem .6rem;text-align:right;white-space:nowrap;border-bottom:1px solid #e6e6e6}
th:first-child,td:first-child{text-align:left;position:sticky;left:0;background:#fff}
td.text,th.text{text-align:left;white-space:normal;overflow-wrap:anywhere}
thead th{border-bottom:2px solid #999;vertical-align:bottom}
tr.sum td{border-top:2px solid #999;font-weight:600}
tr.after td{font-weight:600}
.paper{color:#5a5a5a;background:#f6f6f6}
tr.interpolated td:nth-child(3){font-style:italic}
tr.lost td:nth-child(3){color:#a94f00;font-weight:600}
.warnings li{color:#8a3b00}
figure{margin:1rem 0}
figure img,figure svg{max-width:100%;height:auto;display:block}
figcaption{color:#555;font-size:.9rem;margin-top:.3rem}
.plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,32rem),1fr));gap:1rem}
.plots figure{margin:0}
.player{max-width:40rem}
.player img{width:100%;height:auto;display:block}
.player img[hidden]{display:none}
.controls{display:flex;gap:.8rem;align-items:center}
.controls button{font:inherit;min-width:5rem;padding:.4rem .8rem}
.controls input{flex:1;min-height:2rem}
)";

constexpr const char* Script = R"(
for (const player of document.querySelectorAll('.player')) {
  const frames = player.querySelectorAll('img');
  const slider = player.querySelector('input');
  const button = player.querySelector('button');
  let at = 0;
  let timer = null;
  const show = (next) => {
    frames[at].hidden = true;
    at = next % frames.length;
    frames[at].hidden = false;
    slider.value = at;
  };
  const play = (on) => {
    clearInterval(timer);
    timer = on ? setInterval(() => show(at + 1), 2000 / frames.length) : null;
    button.textContent = on ? 'Pause' : 'Play';
  };
  slider.addEventListener('input', () => { play(false); show(Number(slider.value)); });
  button.addEventListener('click', () => play(timer === null));
}
)";

std::string Number(double value, int digits = 3)
{
  if (!std::isfinite(value))
  {
    return "&ndash;";
  }
  char text[64];
  std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}

std::string ReadFile(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file || bytes.empty())
  {
    throw std::runtime_error("Can not read '" + path + "'.");
  }
  return bytes;
}

std::string Image(const std::string& path, const std::string& alternative, const char* more = "")
{
  const bool gif = path.size() > 4 && path.compare(path.size() - 4, 4, ".gif") == 0;
  return "<img alt=\"" + EscapedHtml(alternative) + "\" src=\"data:image/" + (gif ? "gif" : "png") +
    ";base64," + Base64(ReadFile(path)) + "\"" + more + ">\n";
}

/// A drawing as a part of the page: as wide as there is room, and names of its parts of its own.
std::string InlineSvg(const std::string& path, std::size_t number)
{
  const std::string file = ReadFile(path);
  const std::size_t begin = file.find("<svg");
  const std::size_t end = file.rfind("</svg>");
  if (begin == std::string::npos || end == std::string::npos || end < begin)
  {
    throw std::runtime_error("'" + path + "' is not an SVG file.");
  }
  std::string drawing = file.substr(begin, end - begin + 6);
  const std::string prefix = "plot" + std::to_string(number) + "-";
  drawing =
    std::regex_replace(drawing, std::regex(R"re(\b(id=")([^"]*"))re"), "$1" + prefix + "$2");
  drawing =
    std::regex_replace(drawing, std::regex(R"re((href="#)([^"]*"))re"), "$1" + prefix + "$2");
  drawing =
    std::regex_replace(drawing, std::regex(R"re((url\(#)([^)]*\)))re"), "$1" + prefix + "$2");
  const std::size_t close = drawing.find('>');
  const std::string head = drawing.substr(0, close);
  std::smatch width;
  std::smatch height;
  if (head.find("viewBox") == std::string::npos &&
    std::regex_search(head, width, std::regex(R"re(\swidth="([0-9.]+)(px)?")re")) &&
    std::regex_search(head, height, std::regex(R"re(\sheight="([0-9.]+)(px)?")re")))
  {
    drawing.insert(close, " viewBox=\"0 0 " + width[1].str() + " " + height[1].str() + "\"");
  }
  return drawing;
}

std::string Heading(const EvaluationColumn& column)
{
  return *column.unit ? std::string(column.key) + "<br>(" + column.unit + ")" : column.key;
}

std::vector<const EvaluationColumn*> KnownColumns(const std::vector<CaseEvaluation>& cases)
{
  std::vector<const EvaluationColumn*> known;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    for (const CaseEvaluation& one : cases)
    {
      if (std::any_of(one.phases.begin(), one.phases.end(),
            [&](const PhaseEvaluation& phase)
            { return std::isfinite(phase.measures.*(column.value)); }))
      {
        known.push_back(&column);
        break;
      }
    }
  }
  return known;
}

/// Those that the paper's table has.
std::vector<const EvaluationColumn*> PaperColumns()
{
  std::vector<const EvaluationColumn*> known;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    if (std::isfinite(PaperSummaryA().mean.*(column.value)))
    {
      known.push_back(&column);
    }
  }
  return known;
}

std::string Cells(const EvaluationMeasures& measures,
  const std::vector<const EvaluationColumn*>& columns, const char* attributes = "", int digits = 3)
{
  std::string cells;
  for (const EvaluationColumn* column : columns)
  {
    cells +=
      std::string("<td") + attributes + ">" + Number(measures.*(column->value), digits) + "</td>";
  }
  return cells;
}

std::string MeanAndDeviation(
  const MeasureSummary& summary, const std::vector<const EvaluationColumn*>& columns)
{
  std::string cells;
  for (const EvaluationColumn* column : columns)
  {
    const double deviation = summary.deviation.*(column->value);
    cells += "<td>" + Number(summary.mean.*(column->value)) +
      (std::isfinite(deviation) ? " &plusmn; " + Number(deviation) : "") + "</td>";
  }
  return cells;
}

std::string PartB(const std::vector<CaseEvaluation>& cases)
{
  const auto columns = KnownColumns(cases);
  const auto paperColumns = PaperColumns();
  std::string html = "<h2 id=\"part-b\">All cases</h2>\n<div class=\"scroll\"><table>\n"
                     "<caption>Part B: means over the interpolated phases of each case</caption>\n"
                     "<thead><tr><th scope=\"col\">Case</th>";
  for (const EvaluationColumn* column : columns)
  {
    html += "<th scope=\"col\">" + Heading(*column) + "</th>";
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const CaseEvaluation& one : cases)
  {
    html += "<tr><td>" + EscapedHtml(one.name) + "</td>" +
      MeanAndDeviation(SummarizePhases(one, true), columns) + "</tr>\n";
  }
  if (cases.size() > 1)
  {
    html += "<tr class=\"sum\"><td>Mean of the cases</td>" +
      MeanAndDeviation(SummarizeCases(cases), columns) + "</tr>\n";
  }
  html += "</tbody></table></div>\n"
          "<div class=\"scroll\"><table class=\"paper-table\">\n"
          "<caption>The paper&#39;s Part B, of other data</caption>\n<thead><tr>"
          "<th scope=\"col\">Case</th>";
  for (const EvaluationColumn* column : paperColumns)
  {
    html += "<th scope=\"col\">" + Heading(*column) + "</th>";
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const PaperCase& one : PaperPartB())
  {
    html += "<tr><td>" + EscapedHtml(one.name) + "</td>" + Cells(one.mean, paperColumns, "", 2) +
      "</tr>\n";
  }
  const MeasureSummary& all = PaperSummaryB();
  html += "<tr class=\"sum\"><td>Mean</td>" + Cells(all.mean, paperColumns, "", 2) + "</tr>\n" +
    "<tr class=\"after\"><td>STD</td>" + Cells(all.deviation, paperColumns, "", 2) +
    "</tr>\n</tbody></table></div>\n";
  return html;
}

std::string PartA(const CaseEvaluation& one)
{
  const auto columns = KnownColumns({ one });
  const auto paperColumns = PaperColumns();
  std::string html =
    "<div class=\"scroll\"><table>\n<caption>Part A: every phase; grey: the paper&#39;s case 1, "
    "whose "
    "interpolated phases have the same numbers</caption>\n<thead><tr><th scope=\"col\">Phase</th>"
    "<th scope=\"col\">%R-R</th><th scope=\"col\" class=\"text\">kind</th>";
  for (const EvaluationColumn* column : columns)
  {
    html += "<th scope=\"col\">" + Heading(*column) + "</th>";
  }
  for (const EvaluationColumn* column : paperColumns)
  {
    html += "<th scope=\"col\" class=\"paper\">paper&#39;s<br>" + Heading(*column) + "</th>";
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const PhaseEvaluation& phase : one.phases)
  {
    const char* kind = KindOf(phase);
    const EvaluationMeasures paper = PaperMeasuresOf(phase);
    html += std::string("<tr class=\"") + kind + "\"><td>" + std::to_string(phase.phase) +
      "</td><td>" + Number(100.0 * phase.fraction, 1) + "</td><td class=\"text\">" + kind +
      "</td>" + Cells(phase.measures, columns) + Cells(paper, paperColumns, " class=\"paper\"", 2) +
      "</tr>\n";
  }
  const MeasureSummary& paper = PaperSummaryA();
  const auto row = [&](const char* kind, const char* name, const EvaluationMeasures& measures,
                     const EvaluationMeasures& beside)
  {
    html += std::string("<tr class=\"") + kind + "\"><td>" + name + "</td><td></td><td></td>" +
      Cells(measures, columns) + Cells(beside, paperColumns, " class=\"paper\"", 2) + "</tr>\n";
  };
  const MeasureSummary interpolated = SummarizePhases(one, true);
  const MeasureSummary tracked = SummarizePhases(one, false);
  row("sum", "Mean, interpolated", interpolated.mean, paper.mean);
  row("after", "STD, interpolated", interpolated.deviation, paper.deviation);
  row("after", "Mean, tracked", tracked.mean, EvaluationMeasures());
  row("after", "STD, tracked", tracked.deviation, EvaluationMeasures());
  return html + "</tbody></table></div>\n";
}

/// Values of one branch in all phases that know it.
class BranchValues
{
public:
  void Add(double value)
  {
    if (std::isfinite(value))
    {
      this->Sum += value;
      this->Least = this->Count == 0 ? value : std::min(this->Least, value);
      this->Greatest = this->Count == 0 ? value : std::max(this->Greatest, value);
      ++this->Count;
    }
  }
  double Mean() const
  {
    return this->Count == 0 ? EvaluationMeasures::NaN : this->Sum / this->Count;
  }

  double Least = EvaluationMeasures::NaN;
  double Greatest = EvaluationMeasures::NaN;

private:
  double Sum = 0.0;
  int Count = 0;
};

struct BranchRow
{
  std::string label;
  int phases = 0;
  BranchValues length;
  BranchValues covered;
  BranchValues continuity;
  BranchValues hausdorff;
  BranchValues mean;
};

std::string BranchTable(const CaseEvaluation& one)
{
  std::map<std::int64_t, BranchRow> rows;
  for (const PhaseEvaluation& phase : one.phases)
  {
    for (const BranchEvaluation& branch : phase.branches)
    {
      BranchRow& row = rows[branch.group];
      row.label = row.label.empty() ? branch.label : row.label;
      ++row.phases;
      row.length.Add(branch.length);
      row.covered.Add(branch.covered);
      row.continuity.Add(branch.continuity);
      row.hausdorff.Add(branch.hausdorff);
      row.mean.Add(branch.mean);
    }
  }
  if (rows.empty())
  {
    return "";
  }
  std::string html =
    "<h3>Branches</h3>\n<div class=\"scroll\"><table>\n<caption>The truth&#39;s branches over all "
    "phases: "
    "what the model has of their length, and how far their surface is from "
    "it</caption>\n<thead><tr>"
    "<th scope=\"col\">Branch</th><th scope=\"col\">group</th><th scope=\"col\">phases</th>"
    "<th scope=\"col\">length<br>(mm)</th><th scope=\"col\">covered,<br>mean</th>"
    "<th scope=\"col\">covered,<br>least</th><th scope=\"col\">continuity,<br>mean</th>"
    "<th scope=\"col\">continuity,<br>least</th><th scope=\"col\">mean<br>distance (mm)</th>"
    "<th scope=\"col\">HD, mean<br>(mm)</th><th scope=\"col\">HD, greatest<br>(mm)</th>"
    "</tr></thead>\n<tbody>\n";
  for (const auto& [group, row] : rows)
  {
    html += "<tr><td>" + (row.label.empty() ? "&ndash;" : EscapedHtml(row.label)) + "</td><td>" +
      std::to_string(group) + "</td><td>" + std::to_string(row.phases) + "</td>";
    html += "<td>" + Number(row.length.Mean(), 1) + "</td>";
    for (const double value : { row.covered.Mean(), row.covered.Least, row.continuity.Mean(),
           row.continuity.Least, row.mean.Mean(), row.hausdorff.Mean(), row.hausdorff.Greatest })
    {
      html += "<td>" + Number(value) + "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string Warnings(const std::vector<std::string>& warnings)
{
  std::string html;
  for (const std::string& warning : warnings)
  {
    html += "<li>" + EscapedHtml(warning) + "</li>\n";
  }
  return html.empty() ? html : "<ul class=\"warnings\">\n" + html + "</ul>\n";
}

std::string Player(const std::vector<std::string>& frames, const std::string& name)
{
  if (frames.empty())
  {
    return "";
  }
  std::string html = "<h3>The beating tree</h3>\n<div class=\"player\">\n";
  for (std::size_t k = 0; k < frames.size(); ++k)
  {
    html += Image(frames[k],
      name + ", phase " + std::to_string(k + 1) + " of " + std::to_string(frames.size()),
      k == 0 ? "" : " hidden");
  }
  return html +
    "<div class=\"controls\"><button type=\"button\">Play</button>"
    "<input type=\"range\" min=\"0\" max=\"" +
    std::to_string(frames.size() - 1) +
    "\" value=\"0\" step=\"1\" aria-label=\"Phase\"></div>\n</div>\n";
}
}

std::string EvaluationHtml(const EvaluationReport& report)
{
  if (!report.illustrations.empty() && report.illustrations.size() != report.cases.size())
  {
    throw std::invalid_argument("illustrations: there must be as many as cases, or none.");
  }
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                     "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                     "<title>" +
    EscapedHtml(report.title) + "</title>\n<style>" + Style +
    "</style>\n</head>\n<body>\n<header><h1>" + EscapedHtml(report.title) +
    "</h1></header>\n<nav aria-label=\"Contents\"><ul>\n";
  const bool warned = !report.warnings.empty();
  html += warned ? "<li><a href=\"#warnings\">Warnings</a></li>\n" : "";
  html += report.cases.empty() ? "" : "<li><a href=\"#part-b\">All cases</a></li>\n";
  for (std::size_t k = 0; k < report.cases.size(); ++k)
  {
    html += "<li><a href=\"#case" + std::to_string(k) + "\">" + EscapedHtml(report.cases[k].name) +
      "</a></li>\n";
  }
  html += report.plots.empty() ? "" : "<li><a href=\"#plots\">Measures over the phases</a></li>\n";
  html += report.settings.empty() ? "" : "<li><a href=\"#settings\">Inputs and settings</a></li>\n";
  html += "</ul></nav>\n<main>\n";
  if (warned)
  {
    html += "<h2 id=\"warnings\">Warnings</h2>\n" + Warnings(report.warnings);
  }
  if (!report.cases.empty())
  {
    html += PartB(report.cases);
  }
  for (std::size_t k = 0; k < report.cases.size(); ++k)
  {
    const CaseEvaluation& one = report.cases[k];
    html += "<section>\n<h2 id=\"case" + std::to_string(k) + "\">" + EscapedHtml(one.name) +
      "</h2>\n" + Warnings(one.warnings) + PartA(one);
    if (!report.illustrations.empty())
    {
      html += Player(report.illustrations[k].beating, one.name);
      for (const ReportPicture& picture : report.illustrations[k].pictures)
      {
        html += "<h3>" + EscapedHtml(picture.title) + "</h3>\n<figure>" +
          Image(picture.path, one.name + ": " + picture.title);
        html += picture.caption.empty()
          ? ""
          : "<figcaption>" + EscapedHtml(picture.caption) + "</figcaption>";
        html += "</figure>\n";
      }
    }
    html += BranchTable(one) + "</section>\n";
  }
  if (!report.plots.empty())
  {
    html += "<h2 id=\"plots\">Measures over the phases</h2>\n<div class=\"plots\">\n";
    for (std::size_t k = 0; k < report.plots.size(); ++k)
    {
      html += "<figure>" + InlineSvg(report.plots[k], k) + "</figure>\n";
    }
    html += "</div>\n";
  }
  if (!report.settings.empty())
  {
    html +=
      "<h2 id=\"settings\">Inputs and settings</h2>\n<div class=\"scroll\"><table>\n<tbody>\n";
    for (const auto& [name, value] : report.settings)
    {
      html += "<tr><td>" + EscapedHtml(name) + "</td><td class=\"text\">" + EscapedHtml(value) +
        "</td></tr>\n";
    }
    html += "</tbody></table></div>\n";
  }
  return html + "</main>\n<script>" + Script + "</script>\n</body>\n</html>\n";
}

void WriteEvaluationReport(const EvaluationReport& report, const std::string& path)
{
  const std::string html = EvaluationHtml(report);
  std::ofstream file(path, std::ios::binary);
  file << html;
  file.close();
  if (!file)
  {
    throw std::runtime_error("Can not write '" + path + "'.");
  }
}
}
