#include "EvaluationPlots.h"

#include "XmlText.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace coronary
{
namespace
{
// Told apart also by those who do not see all colours (Okabe and Ito).
constexpr std::array<const char*, 7> CaseColours = { "#0072b2", "#d55e00", "#009e73", "#cc79a7",
  "#e69f00", "#56b4e9", "#5a5a5a" };
// Of the drawing; what the marks mean and the names of several cases stand below.
constexpr double Width = 420.0;
constexpr double Height = 250.0;
constexpr double Left = 46.0;
constexpr double Right = Width - 12.0;
constexpr double Top = 26.0;
constexpr double Bottom = 196.0;

std::string Text(double value, const char* format = "%.5g")
{
  char text[64];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

/// Values along an axis, and where its ends are in the drawing.
struct PlotAxis
{
  double low;
  double high;
  double begin;
  double end;

  double Place(double value) const
  {
    return this->begin + (this->end - this->begin) * (value - this->low) / (this->high - this->low);
  }

  /// Round values, about so many, each with its text.
  std::vector<std::pair<double, std::string>> Ticks(double wanted) const
  {
    const double rough = (this->high - this->low) / wanted;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    const double share = rough / power;
    const double step = power *
      (share <= 1.0      ? 1.0
          : share <= 2.0 ? 2.0
          : share <= 5.0 ? 5.0
                         : 10.0);
    const int digits = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
    std::vector<std::pair<double, std::string>> ticks;
    const auto last = static_cast<long>(std::floor(this->high / step + 1e-9));
    for (auto k = static_cast<long>(std::ceil(this->low / step - 1e-9)); k <= last; ++k)
    {
      char text[64];
      std::snprintf(text, sizeof(text), "%.*f", digits, static_cast<double>(k) * step);
      ticks.emplace_back(static_cast<double>(k) * step, text);
    }
    return ticks;
  }
};

std::string Line(double x1, double y1, double x2, double y2, const char* kind)
{
  return std::string("<path class=\"") + kind + "\" d=\"M" + Text(x1) + " " + Text(y1) + "L" +
    Text(x2) + " " + Text(y2) + "\"/>\n";
}

std::string Words(double x, double y, const std::string& text, const char* anchor = "start")
{
  return "<text x=\"" + Text(x) + "\" y=\"" + Text(y) + "\" text-anchor=\"" + anchor + "\">" +
    EscapedXml(text) + "</text>\n";
}

struct MarkShape
{
  const char* kind; ///< as KindOf() says
  const char* path;
  const char* fill;
  double line; ///< width of its outline
};
constexpr std::array<MarkShape, 3> MarkShapes = {
  { { "tracked", "M-3.4 0a3.4 3.4 0 1 0 6.8 0a3.4 3.4 0 1 0-6.8 0Z", "currentColor", 0.0 },
    { "interpolated", "M-4.4 0L0-4.4L4.4 0L0 4.4Z", "#fff", 1.3 },
    { "lost", "M-3.4-3.4L3.4 3.4M-3.4 3.4L3.4-3.4", "none", 2.0 } }
};

std::string Mark(const MarkShape& shape, double x, double y)
{
  return std::string("<path class=\"mark ") + shape.kind + "\" transform=\"translate(" + Text(x) +
    " " + Text(y) + ")\" fill=\"" + shape.fill + "\" stroke=\"currentColor\" stroke-width=\"" +
    Text(shape.line) + "\" d=\"" + shape.path + "\"/>\n";
}

/// Places for what marks and colours mean, from left to right in as many rows as it takes.
struct Legend
{
  double x = Left;
  double y = Height - 8.0;

  /// A text, and before it what `sign` draws around a point.
  template <typename Sign>
  std::string Add(const std::string& text, Sign sign)
  {
    // UTF-8 has several bytes a character; letters are at most so wide in the mean.
    const auto letters = std::count_if(text.begin(), text.end(),
      [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; });
    const double width = 34.0 + 5.6 * static_cast<double>(letters);
    if (this->x > Left && this->x + width > Width)
    {
      this->NextRow();
    }
    const double at = this->x;
    this->x += width;
    return sign(at + 6.0, this->y - 3.5) + Words(at + 20.0, this->y, text);
  }
  void NextRow()
  {
    this->x = Left;
    this->y += 15.0;
  }
};

struct PlotPoint
{
  double x;
  double y;
  std::size_t mark; ///< of MarkShapes
};

struct PlotData
{
  bool fractions = true; ///< else over the phase's number
  std::vector<std::vector<PlotPoint>> cases;
  std::array<bool, MarkShapes.size()> marked = {};
  double paper = EvaluationMeasures::NaN;
  bool paperInside = false; ///< of the axis
  PlotAxis across{ 0.0, 0.0, Left, Right };
  PlotAxis upwards{ 0.0, 0.0, Bottom, Top };
};

/// @return without points in any case where the measure is not known
PlotData Collect(const std::vector<CaseEvaluation>& cases, const EvaluationColumn& column)
{
  PlotData data;
  for (const CaseEvaluation& one : cases)
  {
    data.fractions = data.fractions &&
      std::all_of(one.phases.begin(), one.phases.end(),
        [](const PhaseEvaluation& phase) { return std::isfinite(phase.fraction); });
  }
  const MeasureSummary& paper = cases.size() == 1 ? PaperSummaryA() : PaperSummaryB();
  data.paper = paper.mean.*(column.value);
  PlotAxis& across = data.across;
  PlotAxis& upwards = data.upwards;
  bool first = true;
  const auto include = [](PlotAxis& axis, double value)
  {
    axis.low = std::min(axis.low, value);
    axis.high = std::max(axis.high, value);
  };
  for (const CaseEvaluation& one : cases)
  {
    std::vector<PlotPoint> points;
    for (const PhaseEvaluation& phase : one.phases)
    {
      const double value = phase.measures.*(column.value);
      if (std::isfinite(value))
      {
        const double x = data.fractions ? 100.0 * phase.fraction : phase.phase;
        const auto* shape = std::find_if(MarkShapes.begin(), MarkShapes.end(),
          [&](const MarkShape& mark) { return std::string(mark.kind) == KindOf(phase); });
        points.push_back({ x, value, static_cast<std::size_t>(shape - MarkShapes.begin()) });
        data.marked[points.back().mark] = true;
        across.low = first ? x : across.low;
        across.high = first ? x : across.high;
        upwards.low = first ? value : upwards.low;
        upwards.high = first ? value : upwards.high;
        first = false;
        include(across, x);
        include(upwards, value);
      }
    }
    std::stable_sort(points.begin(), points.end(),
      [](const PlotPoint& a, const PlotPoint& b) { return a.x < b.x; });
    data.cases.push_back(std::move(points));
  }
  const double aside = std::max(0.03 * (across.high - across.low), 1e-3);
  across.low -= aside;
  across.high += aside;
  // Each measure on its own scale: how it changes over the phases is what is looked for. Changes of less than a fiftieth
  // of the value stay small, and the best value is there when it is near.
  const double greatest = std::max(std::abs(upwards.low), std::abs(upwards.high));
  const double span = std::max({ upwards.high - upwards.low, 0.02 * greatest, 1e-6 });
  if (column.best >= upwards.low - span && column.best <= upwards.high + span)
  {
    include(upwards, column.best);
  }
  const double spare = 0.5 * std::max(0.0, span - (upwards.high - upwards.low)) + 0.1 * span;
  upwards.low = column.best == 0.0 ? std::max(0.0, upwards.low - spare) : upwards.low - spare;
  upwards.high += spare;
  data.paperInside = data.paper >= upwards.low && data.paper <= upwards.high;
  return data;
}

std::string Axes(const PlotData& data, const EvaluationColumn& column)
{
  std::string grid = "<g fill=\"none\" stroke=\"#e2e2e2\">\n";
  std::string ticks = "<g class=\"soft\" fill=\"#555\">\n";
  for (const auto& [value, text] : data.upwards.Ticks(6.0))
  {
    const double y = data.upwards.Place(value);
    grid += Line(Left, y, Right, y, "grid");
    ticks += Words(Left - 6.0, y + 3.5, text, "end");
  }
  for (const auto& [value, text] : data.across.Ticks(8.0))
  {
    const double x = data.across.Place(value);
    grid += Line(x, Top, x, Bottom, "grid");
    ticks += Words(x, Bottom + 15.0, text, "middle");
  }
  ticks += Words(Right, Bottom + 29.0, data.fractions ? "% of the R-R interval" : "phase", "end");
  const std::string title =
    *column.unit ? std::string(column.key) + " (" + column.unit + ")" : column.key;
  return grid + "</g>\n" + ticks +
    "</g>\n<g class=\"title\" fill=\"#111\" font-weight=\"bold\">\n" +
    Words(Left, Top - 11.0, title) + "</g>\n";
}

std::string Curves(const PlotData& data)
{
  std::string curves;
  for (std::size_t c = 0; c < data.cases.size(); ++c)
  {
    std::string path;
    std::string marks;
    for (const PlotPoint& point : data.cases[c])
    {
      const double x = data.across.Place(point.x);
      const double y = data.upwards.Place(point.y);
      path += (path.empty() ? "M" : "L") + Text(x) + " " + Text(y);
      marks += Mark(MarkShapes[point.mark], x, y);
    }
    if (!path.empty())
    {
      curves += "<g class=\"case\" data-case=\"" + std::to_string(c) + "\" color=\"" +
        CaseColours[c % CaseColours.size()] +
        "\">\n<path class=\"curve\" fill=\"none\" stroke=\"currentColor\" stroke-width=\"1.3\" "
        "d=\"" +
        path + "\"/>\n" + marks + "</g>\n";
    }
  }
  return curves;
}

/// What marks mean and the paper's mean.
std::string Meanings(const PlotData& data, Legend& legend)
{
  const bool one = data.cases.size() == 1;
  std::string text = "<g class=\"soft\" fill=\"#555\" color=\"" +
    std::string(one ? CaseColours[0] : "#333") + "\">\n";
  for (std::size_t k = 0; k < MarkShapes.size(); ++k)
  {
    text += !data.marked[k] ? ""
                            : legend.Add(MarkShapes[k].kind,
                                [&](double x, double y) { return Mark(MarkShapes[k], x, y); });
  }
  if (std::isfinite(data.paper))
  {
    const auto dashes = [](double from, double to, double y)
    {
      return "<g stroke=\"#444\" stroke-width=\"1.3\" stroke-dasharray=\"5 4\">" +
        Line(from, y, to, y, "paper") + "</g>\n";
    };
    text += data.paperInside ? dashes(Left, Right, data.upwards.Place(data.paper)) : "";
    text += legend.Add((one ? "paper's case 1: " : "paper's five: ") + Text(data.paper, "%.2f"),
      [&](double x, double y) { return dashes(x - 7.0, x + 11.0, y); });
  }
  return text + "</g>\n";
}

std::string Names(const std::vector<CaseEvaluation>& cases, Legend& legend)
{
  std::string text = "<g class=\"names\" fill=\"#555\">\n";
  legend.NextRow();
  for (std::size_t c = 0; c < cases.size(); ++c)
  {
    text += legend.Add(cases[c].name,
      [&](double x, double y)
      {
        return "<rect x=\"" + Text(x - 6.0) + "\" y=\"" + Text(y - 4.0) +
          "\" width=\"14\" height=\"8\" fill=\"" + CaseColours[c % CaseColours.size()] + "\"/>\n";
      });
  }
  return text + "</g>\n";
}
}

std::vector<EvaluationPlot> DrawPlots(const std::vector<CaseEvaluation>& cases)
{
  std::vector<EvaluationPlot> plots;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    const PlotData data = Collect(cases, column);
    const std::string curves = Curves(data);
    if (curves.empty())
    {
      continue;
    }
    Legend legend;
    std::string legends = Meanings(data, legend);
    const double shortHeight = legend.y + 8.0;
    legends += cases.size() > 1 ? Names(cases, legend) : "";
    const std::string height = Text(legend.y + 8.0);
    const std::string size = Text(Width) + "\" height=\"" + height + "\"";
    plots.push_back({ column.key,
      "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" width=\"" + size +
        " viewBox=\"0 0 " + Text(Width) + " " + height +
        "\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"11\" role=\"img\" "
        "aria-label=\"" +
        column.key + " over the phases\" data-height=\"" + Text(shortHeight) + "\" data-frame=\"" +
        Text(data.across.low) + " " + Text(data.across.high) + " " + Text(Left) + " " +
        Text(Right) + " " + Text(Top) + " " + Text(Bottom) + "\" data-over=\"" +
        (data.fractions ? "fraction" : "phase") + "\">\n<rect class=\"ground\" width=\"" + size +
        " fill=\"#fff\"/>\n" + Axes(data, column) + legends + curves + "</svg>\n" });
  }
  return plots;
}
}
