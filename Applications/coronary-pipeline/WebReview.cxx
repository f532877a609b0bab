#include "WebReview.h"

#include "Base64.h"
#include "EvaluationJson.h"
#include "WebFiles.h"
#include "XmlText.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double MaximumPosition = 65535.0;
constexpr double MaximumDistance = 32767.0;
constexpr std::int16_t UnknownDistance = -32768;

using Json = nlohmann::ordered_json;

/// Small numbers of both signs as small numbers without one: 0, -1, 1, -2, ...
std::uint32_t ZigZag(std::int32_t value)
{
  return (static_cast<std::uint32_t>(value) << 1) ^ static_cast<std::uint32_t>(value >> 31);
}

/// Numbers go byte by byte into planes: the higher ones are nearly all 0.
class PlaneWriter
{
public:
  std::size_t Place() const { return this->Bytes.size(); }

  void Write(const std::vector<std::uint32_t>& values, int bytes)
  {
    for (int plane = 0; plane < bytes; ++plane)
    {
      for (const std::uint32_t value : values)
      {
        this->Bytes += static_cast<char>((value >> (8 * plane)) & 0xFFU);
      }
    }
  }

  void Write(const std::vector<std::uint8_t>& values)
  {
    this->Bytes.append(values.begin(), values.end());
  }

  std::string Bytes;
};

/// Differences from the point before of the differences from the phase before: neighbours move alike.
void WriteMoving(PlaneWriter& writer, const std::vector<std::uint16_t>& values,
  const std::vector<std::uint16_t>* before, std::size_t components)
{
  const std::size_t count = values.size() / components;
  std::vector<std::uint32_t> differences(count);
  for (std::size_t axis = 0; axis < components; ++axis)
  {
    std::uint16_t last = 0;
    for (std::size_t k = 0; k < count; ++k)
    {
      const std::size_t at = components * k + axis;
      const auto move = static_cast<std::uint16_t>(values[at] - (before ? (*before)[at] : 0));
      const auto difference = static_cast<std::int16_t>(static_cast<std::uint16_t>(move - last));
      differences[k] = ZigZag(difference) & 0xFFFFU;
      last = move;
    }
    writer.Write(differences, 2);
  }
}

Json WriteTopology(PlaneWriter& writer, const ReviewTopology& topology)
{
  Json layout;
  layout["points"] = topology.points;
  layout["indices"] = topology.cells.size();
  layout["cells"] = writer.Place();
  std::vector<std::uint32_t> differences(topology.cells.size());
  std::uint32_t last = 0;
  for (std::size_t k = 0; k < topology.cells.size(); ++k)
  {
    differences[k] = ZigZag(static_cast<std::int32_t>(topology.cells[k] - last));
    last = topology.cells[k];
  }
  writer.Write(differences, 4);
  if (!topology.branches.empty())
  {
    layout["branch_of_point"] = writer.Place();
    writer.Write(topology.branches);
  }
  layout["labels"] = Json::array();
  for (const ReviewLabel& label : topology.labels)
  {
    layout["labels"].push_back({ { "text", label.text }, { "point", label.point } });
  }
  return layout;
}

void Check(const ReviewSeries& series)
{
  const auto fail = [](const char* what) { throw std::invalid_argument(what); };
  for (const ReviewTopology& topology : series.topologies)
  {
    if (topology.cells.size() % static_cast<std::size_t>(series.corners) != 0 ||
      std::any_of(topology.cells.begin(), topology.cells.end(),
        [&](std::uint32_t point) { return point >= topology.points; }))
    {
      fail("A shape of the review has cells whose points do not exist.");
    }
    if (!topology.branches.empty() && topology.branches.size() != topology.points)
    {
      fail("A shape of the review has other than one branch a point.");
    }
  }
  for (const ReviewFrame& frame : series.frames)
  {
    if (frame.topology >= series.topologies.size() ||
      frame.positions.size() != 3 * std::size_t(series.topologies[frame.topology].points) ||
      (!frame.distances.empty() && 3 * frame.distances.size() != frame.positions.size()))
    {
      fail("A shape of the review has other than one position and distance a point.");
    }
    if (!std::all_of(frame.positions.begin(), frame.positions.end(),
          [](float value) { return std::isfinite(value); }))
    {
      fail("A shape of the review has positions that are not finite.");
    }
  }
}

/// Whole numbers for positions, in the box around all phases.
struct PositionGrid
{
  std::array<double, 3> low = { 0.0, 0.0, 0.0 };
  std::array<double, 3> step = { 0.0, 0.0, 0.0 };

  explicit PositionGrid(const ReviewSeries& series)
  {
    constexpr double Huge = std::numeric_limits<double>::max();
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      double minimum = Huge;
      double maximum = -Huge;
      for (const ReviewFrame& frame : series.frames)
      {
        for (std::size_t k = axis; k < frame.positions.size(); k += 3)
        {
          minimum = std::min(minimum, double(frame.positions[k]));
          maximum = std::max(maximum, double(frame.positions[k]));
        }
      }
      if (minimum <= maximum)
      {
        this->low[axis] = minimum;
        this->step[axis] = (maximum - minimum) / MaximumPosition;
      }
    }
  }

  std::vector<std::uint16_t> Numbers(const std::vector<float>& positions) const
  {
    std::vector<std::uint16_t> numbers(positions.size());
    for (std::size_t k = 0; k < positions.size(); ++k)
    {
      const std::size_t axis = k % 3;
      const double number = this->step[axis] > 0.0
        ? std::round((double(positions[k]) - this->low[axis]) / this->step[axis])
        : 0.0;
      numbers[k] = static_cast<std::uint16_t>(std::clamp(number, 0.0, MaximumPosition));
    }
    return numbers;
  }
};

double DistanceStep(const ReviewSeries& series)
{
  double maximum = 0.0;
  for (const ReviewFrame& frame : series.frames)
  {
    for (const float distance : frame.distances)
    {
      maximum = std::isfinite(distance) ? std::max(maximum, std::abs(double(distance))) : maximum;
    }
  }
  return maximum > 0.0 ? maximum / MaximumDistance : 1.0;
}

std::vector<std::uint16_t> DistanceNumbers(const std::vector<float>& distances, double step)
{
  std::vector<std::uint16_t> numbers(distances.size());
  for (std::size_t k = 0; k < distances.size(); ++k)
  {
    const std::int16_t number = std::isfinite(distances[k])
      ? static_cast<std::int16_t>(
          std::clamp(std::round(distances[k] / step), -MaximumDistance, MaximumDistance))
      : UnknownDistance;
    numbers[k] = static_cast<std::uint16_t>(number);
  }
  return numbers;
}

Json WriteSeries(PlaneWriter& writer, const ReviewSeries& series)
{
  if (series.frames.empty())
  {
    return nullptr;
  }
  Check(series);
  const PositionGrid grid(series);
  const double distanceStep = DistanceStep(series);
  Json layout;
  layout["corners"] = series.corners;
  layout["low"] = grid.low;
  layout["step"] = grid.step;
  layout["distance_step"] = distanceStep;
  layout["original_cells"] = series.originalCells;
  layout["deviation"] = series.deviation;
  layout["branches"] = series.branches;
  layout["topologies"] = Json::array();
  for (const ReviewTopology& topology : series.topologies)
  {
    layout["topologies"].push_back(WriteTopology(writer, topology));
  }
  // What the phase before had, of each topology.
  std::map<std::size_t, std::vector<std::uint16_t>> positions;
  std::map<std::size_t, std::vector<std::uint16_t>> distances;
  const auto write = [&](std::map<std::size_t, std::vector<std::uint16_t>>& kept,
                       std::size_t topology, std::vector<std::uint16_t> numbers,
                       std::size_t components)
  {
    const std::size_t place = writer.Place();
    const auto before = kept.find(topology);
    WriteMoving(writer, numbers, before == kept.end() ? nullptr : &before->second, components);
    kept[topology] = std::move(numbers);
    return place;
  };
  layout["frames"] = Json::array();
  for (const ReviewFrame& frame : series.frames)
  {
    Json entry;
    entry["topology"] = frame.topology;
    entry["positions"] = write(positions, frame.topology, grid.Numbers(frame.positions), 3);
    if (!frame.distances.empty())
    {
      entry["distances"] =
        write(distances, frame.topology, DistanceNumbers(frame.distances, distanceStep), 1);
    }
    layout["frames"].push_back(entry);
  }
  return layout;
}

/// A zlib stream.
std::string Deflated(const std::string& bytes)
{
  uLongf size = compressBound(bytes.size());
  std::string deflated(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(deflated.data()), &size,
        reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_DEFAULT_COMPRESSION) != Z_OK)
  {
    throw std::runtime_error("The shapes of the review page can not be compressed.");
  }
  deflated.resize(size);
  return deflated;
}

/// JSON for a script element: nothing in it ends the element, or begins one.
std::string JsonForHtml(const Json& json)
{
  std::string safe;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace))
  {
    switch (c)
    {
      case '<':
        safe += "\\u003c";
        break;
      case '>':
        safe += "\\u003e";
        break;
      case '&':
        safe += "\\u0026";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

Json SummaryJson(const MeasureSummary& summary)
{
  return { { "mean", MeasuresJson(summary.mean) },
    { "deviation", MeasuresJson(summary.deviation) } };
}

Json PaperJson()
{
  Json paper;
  paper["part_a"] = SummaryJson(PaperSummaryA());
  paper["part_b"] = SummaryJson(PaperSummaryB());
  paper["cases"] = Json::array();
  for (const PaperCase& one : PaperPartB())
  {
    paper["cases"].push_back({ { "name", one.name }, { "mean", MeasuresJson(one.mean) } });
  }
  return paper;
}

Json ColumnsJson()
{
  Json columns = Json::array();
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    columns.push_back(
      { { "key", column.key }, { "brief", column.brief }, { "unit", column.unit } });
  }
  return columns;
}

/// Of each phase its branches; numbers that are not finite are null in JSON.
Json BranchesJson(const CaseEvaluation& evaluation)
{
  Json phases = Json::array();
  for (const PhaseEvaluation& phase : evaluation.phases)
  {
    phases.push_back(Json::array());
    for (const BranchEvaluation& branch : phase.branches)
    {
      phases.back().push_back({ { "group", branch.group }, { "label", branch.label },
        { "length", branch.length }, { "covered", branch.covered },
        { "continuity", branch.continuity }, { "HD", branch.hausdorff }, { "mean", branch.mean } });
    }
  }
  return phases;
}

/// The text with its marks, {{name}}, replaced; what is put in is not looked through.
std::string Filled(const std::string& text, const std::map<std::string, std::string>& parts)
{
  std::string filled;
  std::size_t from = 0;
  for (std::size_t mark = text.find("{{"); mark != std::string::npos; mark = text.find("{{", from))
  {
    const std::size_t end = text.find("}}", mark);
    filled += text.substr(from, mark - from) + parts.at(text.substr(mark + 2, end - mark - 2));
    from = end + 2;
  }
  return filled + text.substr(from);
}
}

PackedShapes PackShapes(const ReviewCase& shapes)
{
  PlaneWriter writer;
  PackedShapes packed;
  packed.layout["model"] = WriteSeries(writer, shapes.model);
  packed.layout["truth"] = WriteSeries(writer, shapes.truth);
  packed.layout["model_lines"] = WriteSeries(writer, shapes.modelLines);
  packed.layout["truth_lines"] = WriteSeries(writer, shapes.truthLines);
  packed.layout["guessed_lines"] = WriteSeries(writer, shapes.guessedLines);
  packed.bytes = std::move(writer.Bytes);
  return packed;
}

std::int64_t DefaultReviewTriangles(std::int64_t phases)
{
  // A surface of the pipeline as it is; twenty phases of two make a page of about 15 MB, and so do more phases.
  constexpr std::int64_t Most = 150000;
  constexpr std::int64_t OfAllPhases = 3000000;
  constexpr std::int64_t Minimum = 4000;
  return std::clamp(OfAllPhases / std::max<std::int64_t>(1, phases), Minimum, Most);
}

void WebReview::Add(const CaseEvaluation& evaluation, const ReviewCase& shapes)
{
  for (const ReviewSeries* series :
    { &shapes.model, &shapes.truth, &shapes.modelLines, &shapes.truthLines, &shapes.guessedLines })
  {
    if (!series->frames.empty() && series->frames.size() != evaluation.phases.size())
    {
      throw std::invalid_argument("A shape of the review has other than one frame a phase.");
    }
  }
  PackedShapes packed = PackShapes(shapes);
  Json one;
  one["name"] = evaluation.name;
  one["paper"] = Json::array();
  for (const PhaseEvaluation& phase : evaluation.phases)
  {
    one["paper"].push_back(MeasuresJson(PaperMeasuresOf(phase)));
  }
  one["branches"] = BranchesJson(evaluation);
  one["pictures"] = Json::array();
  one["view"] = { { "left_anterior", shapes.leftAnterior }, { "cranial", shapes.cranial },
    { "centre", shapes.centre }, { "height", shapes.height }, { "aspect", shapes.aspect } };
  one["range"] = shapes.range;
  one["bytes"] = packed.bytes.size();
  one["shapes"] = std::move(packed.layout);
  this->Evaluations.push_back(evaluation);
  this->Cases.push_back(std::move(one));
  this->Blocks.push_back(Base64(Deflated(packed.bytes)));
}

std::size_t WebReview::AddPicture(const std::string& png)
{
  this->Pictures.push_back(Base64(png));
  return this->Pictures.size() - 1;
}

void WebReview::AddIllustration(
  const std::string& png, const std::string& file, const std::string& title)
{
  this->Cases.at(this->Cases.size() - 1)["pictures"].push_back(
    { { "title", title }, { "file", file }, { "picture", this->AddPicture(png) } });
}

void WebReview::SetRun(Json run)
{
  if (this->Cases.empty())
  {
    throw std::invalid_argument("There is no case that a run could be of.");
  }
  this->Cases.back()["run"] = std::move(run);
}

std::string WebReview::Html(const ReviewOrigin& origin) const
{
  Json data;
  data["version"] = origin.version;
  data["command"] = origin.command;
  data["settings"] = origin.settings;
  data["inputs"] = Json::array();
  for (const auto& [model, truth] : origin.inputs)
  {
    data["inputs"].push_back({ { "model", model }, { "truth", truth } });
  }
  data["warnings"] = origin.warnings;
  data["files"] = origin.files;
  data["plots"] = Json::array();
  for (const EvaluationPlot& plot : this->Plots)
  {
    data["plots"].push_back({ { "key", plot.key }, { "svg", plot.svg } });
  }
  data["columns"] = ColumnsJson();
  data["paper"] = PaperJson();
  data["table1"] = EvaluationJson(this->Evaluations);
  data["cases"] = this->Cases;
  std::string blocks;
  for (std::size_t k = 0; k < this->Blocks.size(); ++k)
  {
    blocks += "<script type=\"text/plain\" id=\"shapes-" + std::to_string(k) + "\">" +
      this->Blocks[k] + "</script>\n";
  }
  for (std::size_t k = 0; k < this->Pictures.size(); ++k)
  {
    blocks += "<script type=\"text/plain\" id=\"picture-" + std::to_string(k) + "\">" +
      this->Pictures[k] + "</script>\n";
  }
  return Filled(web::Page,
    { { "style", web::Style }, { "script", web::Script }, { "data", JsonForHtml(data) },
      { "shapes", blocks }, { "version", EscapedXml(origin.version) } });
}
}
