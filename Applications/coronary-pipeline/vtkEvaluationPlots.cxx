#include "vtkEvaluationPlots.h"

#include "Interruption.h"
#include "vtkPictureCanvas.h"

#include "vtkAxis.h"
#include "vtkBrush.h"
#include "vtkChartLegend.h"
#include "vtkChartXY.h"
#include "vtkContextActor.h"
#include "vtkContextScene.h"
#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPen.h"
#include "vtkPlot.h"
#include "vtkPlotPoints.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkSVGExporter.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkTable.h"
#include "vtkTextProperty.h"
#include "vtkWindowToImageFilter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
using Rgb = std::array<unsigned char, 3>;
// Told apart also by those who do not see all colours (Okabe and Ito).
constexpr std::array<Rgb, 7> CaseColours = { { { 0, 114, 178 }, { 213, 94, 0 }, { 0, 158, 115 },
  { 204, 121, 167 }, { 230, 159, 0 }, { 86, 180, 233 }, { 90, 90, 90 } } };
constexpr int Width = 1200;
constexpr int Height = 720;
// Of the size of a mark.
constexpr double MarkStroke = 0.16;

enum Mark
{
  Tracked,
  Interpolated,
  Lost,
  MarkCount
};

Mark MarkOf(const PhaseEvaluation& phase)
{
  return phase.lost ? Lost : (phase.interpolated ? Interpolated : Tracked);
}

const char* MarkName(Mark mark)
{
  constexpr std::array<const char*, MarkCount> Names = { "tracked", "interpolated", "lost" };
  return Names[mark];
}

bool FractionsAreKnown(const std::vector<CaseEvaluation>& cases)
{
  for (const CaseEvaluation& one : cases)
  {
    for (const PhaseEvaluation& phase : one.phases)
    {
      if (!std::isfinite(phase.fraction))
      {
        return false;
      }
    }
  }
  return true;
}

/// The paper's mean of a measure over interpolated phases, and what it is called.
std::pair<double, std::string> PaperMean(const EvaluationColumn& column, std::size_t cases)
{
  return cases == 1
    ? std::make_pair(PaperSummaryA().mean.*(column.value), std::string("paper, case 1"))
    : std::make_pair(PaperSummaryB().mean.*(column.value), std::string("paper, five cases"));
}

/**
 * Values along an axis. The chart is drawn in `Length` units from low to high, about pixels: VTK's SVG files have six
 * digits, and their offsets would lose the last three of values that differ little.
 */
struct ChartRange
{
  static constexpr double Length = 1000.0;
  double low = 0.0;
  double high = 1.0;

  double Place(double value) const
  {
    return Length * (value - this->low) / (this->high - this->low);
  }
};

/// Labels at round values.
void SetRange(vtkAxis* axis, const ChartRange& range)
{
  const double rough = (range.high - range.low) / 8.0;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double share = rough / power;
  const double step = power * (share <= 1.0 ? 1.0 : share <= 2.0 ? 2.0 : share <= 5.0 ? 5.0 : 10.0);
  const int digits = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  vtkNew<vtkDoubleArray> places;
  vtkNew<vtkStringArray> labels;
  const auto last = static_cast<long>(std::floor(range.high / step + 1e-9));
  for (auto k = static_cast<long>(std::ceil(range.low / step - 1e-9)); k <= last; ++k)
  {
    char text[64];
    std::snprintf(text, sizeof(text), "%.*f", digits, static_cast<double>(k) * step);
    places->InsertNextValue(range.Place(static_cast<double>(k) * step));
    labels->InsertNextValue(text);
  }
  axis->SetBehavior(vtkAxis::FIXED);
  axis->SetRange(0.0, ChartRange::Length);
  axis->SetCustomTickPositions(places, labels);
}

vtkSmartPointer<vtkTable> TableOf(const std::vector<std::array<double, 2>>& points,
  const std::string& name, const ChartRange& across, const ChartRange& upwards)
{
  auto table = vtkSmartPointer<vtkTable>::New();
  vtkNew<vtkDoubleArray> x;
  x->SetName("x");
  vtkNew<vtkDoubleArray> y;
  y->SetName(name.c_str());
  for (const std::array<double, 2>& point : points)
  {
    x->InsertNextValue(across.Place(point[0]));
    y->InsertNextValue(upwards.Place(point[1]));
  }
  table->AddColumn(x);
  table->AddColumn(y);
  return table;
}

std::string Short(double value)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

std::string ReadText(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  return { std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>() };
}

/// x' = a x + e, y' = d y + f
struct SvgScale
{
  double a = 1.0;
  double d = 1.0;
  double e = 0.0;
  double f = 0.0;

  /// What VTK takes for a pixel's size when it writes line widths and marks.
  double Pixel() const { return 2.0 * a * d / (a + d); }
};

/// A group's content, its coordinates no longer those of the data.
std::string Applied(const SvgScale& scale, const std::string& content)
{
  static const std::regex Parts(
    R"re(points="([^"]*)"|<use x="([^"]*)" y="([^"]*)" width="([^"]*)" height="[^"]*"|stroke-width="([^"]*)")re");
  std::string result;
  auto last = content.cbegin();
  for (std::sregex_iterator part(content.begin(), content.end(), Parts), end; part != end; ++part)
  {
    const std::smatch& match = *part;
    result.append(last, match[0].first);
    last = match[0].second;
    if (match[1].matched)
    {
      std::string numbers = match[1].str();
      std::replace(numbers.begin(), numbers.end(), ',', ' ');
      std::istringstream stream(numbers);
      result += "points=\"";
      double x = 0.0;
      double y = 0.0;
      while (stream >> x >> y)
      {
        result += "\n" + Short(scale.a * x + scale.e) + "," + Short(scale.d * y + scale.f);
      }
      result += "\n\"";
    }
    else if (match[2].matched)
    {
      const double width = std::stod(match[4]);
      const double size = width * scale.Pixel();
      const double x = scale.a * (std::stod(match[2]) + 0.5 * width) + scale.e - 0.5 * size;
      const double y = scale.d * (std::stod(match[3]) + 0.5 * width) + scale.f - 0.5 * size;
      result += "<use x=\"" + Short(x) + "\" y=\"" + Short(y) + "\" width=\"" + Short(size) +
        "\" height=\"" + Short(size) + "\"";
    }
    else
    {
      // Of a line; that of marks is in shares of their size.
      const bool line = last != content.cend() && *last == ' ';
      result +=
        "stroke-width=\"" + Short(line ? std::stod(match[5]) * scale.Pixel() : MarkStroke) + "\"";
    }
  }
  result.append(last, content.cend());
  return result;
}

/**
 * VTK draws in the coordinates of the data and stretches: marks would be as wide as the axes differ, and
 * its clipping rectangles are upside down besides. All that is drawn lies inside the axes, which need no clipping.
 */
std::string WithoutTransforms(std::string drawing)
{
  drawing = std::regex_replace(drawing, std::regex(R"re( clip-path="[^"]*")re"), "");
  // Lines that are not to be drawn; some browsers do.
  drawing = std::regex_replace(
    drawing, std::regex(R"re(\s*<polyline[^>]*stroke-dasharray="0,10"[^>]*/>)re"), "");
  drawing = std::regex_replace(drawing, std::regex(R"re(\s*<clipPath[^]*?</clipPath>)re"), "");
  const std::regex head(
    R"re(<g transform="matrix\(([^,]*),0,0,([^,]*),([^,]*),([^)]*)\)"[^>]*>)re");
  std::smatch match;
  while (std::regex_search(drawing, match, head))
  {
    const SvgScale scale{ std::stod(match[1]), std::stod(match[2]), std::stod(match[3]),
      std::stod(match[4]) };
    const std::size_t begin = static_cast<std::size_t>(match.position(0) + match.length(0));
    // The end of this group, not of one inside.
    std::size_t end = begin;
    for (int depth = 1; depth > 0; ++end)
    {
      const std::size_t close = drawing.find("</g>", end);
      const std::size_t open = drawing.find("<g", end);
      if (close == std::string::npos)
      {
        throw std::runtime_error("A group of an SVG file has no end.");
      }
      depth += open < close ? 1 : -1;
      end = std::min(open, close);
    }
    --end;
    drawing = drawing.substr(0, static_cast<std::size_t>(match.position(0))) + "<g>" +
      Applied(scale, drawing.substr(begin, end - begin)) + drawing.substr(end);
  }
  return drawing;
}

class Chart
{
public:
  Chart(const ChartRange& across, const ChartRange& upwards)
    : Across(across)
    , Upwards(upwards)
  {
    // Not vtkContextView: that wants an interactor.
    this->Window->OffScreenRenderingOn();
    this->Window->SetMultiSamples(8);
    this->Window->SetSize(Width, Height);
    this->Window->AddRenderer(this->Renderer);
    this->Renderer->SetBackground(1.0, 1.0, 1.0);
    this->Renderer->AddActor(this->Actor);
    this->Actor->GetScene()->SetRenderer(this->Renderer);
    this->Actor->GetScene()->AddItem(this->Plot);
    this->Plot->SetShowLegend(true);
    this->Plot->GetLegend()->SetInline(false);
    this->Plot->GetLegend()->SetHorizontalAlignment(vtkChartLegend::RIGHT);
    this->Plot->GetLegend()->SetVerticalAlignment(vtkChartLegend::TOP);
    this->Plot->GetLegend()->SetLabelSize(17);
    this->Plot->GetLegend()->GetPen()->SetColor(200, 200, 200, 255);
    this->Plot->GetTitleProperties()->SetFontSize(24);
    this->Plot->GetTitleProperties()->BoldOn();
    for (const int side : { vtkAxis::BOTTOM, vtkAxis::LEFT })
    {
      vtkAxis* axis = this->Plot->GetAxis(side);
      axis->GetTitleProperties()->SetFontSize(20);
      axis->GetTitleProperties()->BoldOff();
      axis->GetLabelProperties()->SetFontSize(17);
      axis->GetGridPen()->SetColor(226, 226, 226, 255);
      SetRange(axis, side == vtkAxis::BOTTOM ? across : upwards);
    }
  }

  void Line(const std::vector<std::array<double, 2>>& points, const std::string& name,
    const Rgb& colour, double width, bool dashed, bool inLegend)
  {
    vtkPlot* plot = this->Plot->AddPlot(vtkChart::LINE);
    plot->SetInputData(TableOf(points, name, this->Across, this->Upwards), 0, 1);
    plot->GetPen()->SetColor(colour[0], colour[1], colour[2], 255);
    plot->SetWidth(static_cast<float>(width));
    plot->GetPen()->SetLineType(dashed ? vtkPen::DASH_LINE : vtkPen::SOLID_LINE);
    plot->SetLabel(name);
    plot->SetLegendVisibility(inLegend);
  }

  void Points(const std::vector<std::array<double, 2>>& points, const std::string& name,
    const Rgb& colour, Mark mark, bool inLegend)
  {
    if (points.empty())
    {
      return;
    }
    vtkPlot* plot = this->Plot->AddPlot(vtkChart::POINTS);
    plot->SetInputData(TableOf(points, name, this->Across, this->Upwards), 0, 1);
    plot->GetPen()->SetColor(colour[0], colour[1], colour[2], 255);
    plot->SetWidth(mark == Lost ? 3.0F : 1.0F);
    plot->SetLabel(name);
    plot->SetLegendVisibility(inLegend);
    auto* marks = vtkPlotPoints::SafeDownCast(plot);
    constexpr std::array<int, MarkCount> Styles = { vtkPlotPoints::CIRCLE, vtkPlotPoints::DIAMOND,
      vtkPlotPoints::CROSS };
    marks->SetMarkerStyle(Styles[mark]);
    constexpr std::array<float, MarkCount> Sizes = { 12.0F, 16.0F, 18.0F };
    marks->SetMarkerSize(Sizes[mark]);
  }

  void Write(const std::string& title, const std::string& stem)
  {
    this->Plot->SetTitle(title);
    vtkNew<vtkWindowToImageFilter> grabber;
    grabber->SetInput(this->Window);
    grabber->SetInputBufferTypeToRGB();
    grabber->ReadFrontBufferOff();
    grabber->Update();
    WritePngFile(grabber->GetOutput(), stem + ".png");
    const std::string drawing = stem + ".svg";
    std::error_code ignored;
    std::filesystem::remove(drawing, ignored);
    vtkNew<vtkSVGExporter> exporter;
    exporter->SetRenderWindow(this->Window);
    exporter->SetFileName(drawing.c_str());
    exporter->SetTitle(title.c_str());
    exporter->Write();
    const std::string text = WithoutTransforms(ReadText(drawing));
    std::ofstream file(drawing, std::ios::binary);
    file << text;
    file.close();
    if (!file || text.empty())
    {
      throw std::runtime_error("Can not write '" + drawing + "'.");
    }
  }

  ChartRange Across;
  ChartRange Upwards;
  vtkNew<vtkRenderWindow> Window;
  vtkNew<vtkRenderer> Renderer;
  vtkNew<vtkContextActor> Actor;
  vtkNew<vtkChartXY> Plot;
};

std::string AxisTitle(const EvaluationColumn& column)
{
  return *column.unit ? std::string(column.key) + " (" + column.unit + ")" : column.key;
}

/// One case in a chart.
struct ChartSeries
{
  std::string name;
  std::vector<std::array<double, 2>> line;
  std::array<std::vector<std::array<double, 2>>, MarkCount> points;
};

void DrawPlot(
  const std::vector<CaseEvaluation>& cases, const EvaluationColumn& column, const std::string& stem)
{
  const bool fractions = FractionsAreKnown(cases);
  const auto [paper, paperName] = PaperMean(column, cases.size());
  std::vector<ChartSeries> all;
  ChartRange across{ std::numeric_limits<double>::infinity(),
    -std::numeric_limits<double>::infinity() };
  ChartRange upwards{ column.best, column.best };
  const auto include = [](ChartRange& range, double value)
  {
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  };
  for (const CaseEvaluation& one : cases)
  {
    ChartSeries series;
    series.name = one.name;
    for (const PhaseEvaluation& phase : one.phases)
    {
      const double value = phase.measures.*(column.value);
      if (std::isfinite(value))
      {
        const double x = fractions ? 100.0 * phase.fraction : phase.phase;
        series.line.push_back({ x, value });
        series.points[MarkOf(phase)].push_back({ x, value });
        include(across, x);
        include(upwards, value);
      }
    }
    std::sort(series.line.begin(), series.line.end());
    all.push_back(std::move(series));
  }
  if (std::isfinite(paper))
  {
    include(upwards, paper);
  }
  const double marginX = std::max(0.03 * (across.high - across.low), 1e-3);
  across = { across.low - marginX, across.high + marginX };
  const double span =
    std::max(upwards.high - upwards.low, 0.02 * std::max(1.0, std::abs(column.best)));
  upwards = { column.best == 0.0 ? std::min(0.0, upwards.low) : upwards.low - 0.1 * span,
    upwards.high + 0.1 * span };

  Chart chart(across, upwards);
  std::array<bool, MarkCount> named = { false, false, false };
  for (std::size_t c = 0; c < all.size(); ++c)
  {
    const ChartSeries& series = all[c];
    if (series.line.empty())
    {
      continue;
    }
    const Rgb& colour = CaseColours[c % CaseColours.size()];
    chart.Line(series.line, series.name, colour, 1.5, false, all.size() > 1);
    for (int mark = 0; mark < MarkCount; ++mark)
    {
      // What the marks mean is said once.
      chart.Points(series.points[mark], MarkName(Mark(mark)), colour, Mark(mark), !named[mark]);
      named[mark] = named[mark] || !series.points[mark].empty();
    }
  }
  if (std::isfinite(paper))
  {
    char number[32];
    std::snprintf(number, sizeof(number), ": %.2f", paper);
    chart.Line({ { across.low, paper }, { across.high, paper } }, paperName + number,
      { 60, 60, 60 }, 2.5, true, true);
  }
  chart.Plot->GetAxis(vtkAxis::BOTTOM)->SetTitle(fractions ? "% of the R-R interval" : "phase");
  chart.Plot->GetAxis(vtkAxis::LEFT)->SetTitle(AxisTitle(column));
  chart.Write(cases.size() == 1 ? column.key + (", " + cases[0].name) : column.key, stem);
}
}

std::vector<std::string> DrawPlots(
  const std::vector<CaseEvaluation>& cases, const std::string& folder)
{
  if (cases.empty())
  {
    throw std::invalid_argument("There is no case to plot.");
  }
  std::vector<std::string> written;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    const bool known = std::any_of(cases.begin(), cases.end(),
      [&](const CaseEvaluation& one)
      {
        return std::any_of(one.phases.begin(), one.phases.end(),
          [&](const PhaseEvaluation& phase)
          { return std::isfinite(phase.measures.*(column.value)); });
      });
    if (known)
    {
      ThrowIfInterrupted();
      const std::string stem = folder + "/" + column.key;
      DrawPlot(cases, column, stem);
      written.push_back(stem + ".svg");
    }
  }
  return written;
}
}
