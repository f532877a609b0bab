#include "MarkupsFile.h"

#include "BoundedJson.h"
#include "ByteStream.h"
#include "TextFile.h"
#include "TextWords.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;

// The name of the schema, which Slicer compares; nothing is fetched from there.
constexpr const char* Schema = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/"
                               "Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#";

constexpr const char* Types[] = { "Fiducial", "Line", "Angle", "Curve", "ClosedCurve", "Plane",
  "ROI" };

/// What the entries of one file are read with.
struct Reader
{
  const std::string& file;

  [[noreturn]] void Fail(const std::string& what) const { FormatError(this->file, what); }

  std::string Text(const Json& object, const char* key, const std::string& owner) const
  {
    return TextIn(object, key, this->file, owner);
  }

  /// What a position is multiplied with, to be LPS.
  Vector3 Signs(const Json& markup, const std::string& owner) const
  {
    const auto found = markup.find("coordinateSystem");
    if (found == markup.end() || found->is_null())
    {
      return Vector3::Ones();
    }
    const std::string system = found->is_string() ? found->get<std::string>()
      : found->is_number_integer()                ? found->dump()
                                                  : std::string();
    if (system == "LPS" || system == "1")
    {
      return Vector3::Ones();
    }
    if (system == "RAS" || system == "0")
    {
      return { -1.0, -1.0, 1.0 };
    }
    this->Fail(owner + ".coordinateSystem is " + found->dump().substr(0, 32) +
      "; LPS, RAS, 0 (RAS) and 1 (LPS) are known");
  }

  double Millimetres(const Json& markup, const std::string& owner) const
  {
    const auto found = markup.find("coordinateUnits");
    if (found == markup.end() || found->is_null())
    {
      return 1.0;
    }
    // A word, or code, coding scheme and meaning.
    const Json& unit = found->is_array() && !found->empty() ? found->front() : *found;
    if (unit == "mm")
    {
      return 1.0;
    }
    if (unit == "um")
    {
      return 0.001;
    }
    this->Fail(
      owner + ".coordinateUnits is " + found->dump().substr(0, 32) + "; mm and um are known");
  }

  void Points(const Json& markup, const std::string& owner, Markup& result,
    std::vector<std::size_t>& kept) const
  {
    const auto list = markup.find("controlPoints");
    if (list == markup.end())
    {
      return;
    }
    if (!list->is_array())
    {
      this->Fail(owner + ".controlPoints is not a list");
    }
    const Vector3 scale = this->Signs(markup, owner) * this->Millimetres(markup, owner);
    for (std::size_t n = 0; n < list->size(); ++n)
    {
      const Json& entry = (*list)[n];
      const std::string where = owner + ".controlPoints[" + std::to_string(n) + "]";
      if (!entry.is_object())
      {
        this->Fail(where + " is not an object");
      }
      const std::string status = this->Text(entry, "positionStatus", where);
      if (!status.empty() && status != "defined")
      {
        continue;
      }
      Markup::Point point;
      point.label = this->Text(entry, "label", where);
      point.description = this->Text(entry, "description", where);
      point.position = scale.cwiseProduct(PositionIn(entry, this->file, where + ".position"));
      result.points.push_back(point);
      kept.push_back(n);
    }
  }

  void Measurements(const Json& markup, const std::string& owner, Markup& result,
    const std::vector<std::size_t>& kept) const
  {
    const auto list = markup.find("measurements");
    if (list == markup.end())
    {
      return;
    }
    if (!list->is_array())
    {
      this->Fail(owner + ".measurements is not a list");
    }
    for (const Json& entry : *list)
    {
      const auto values = entry.is_object() ? entry.find("controlPointValues") : entry.end();
      if (!entry.is_object() || values == entry.end() || !values->is_array() || kept.empty() ||
        kept.back() >= values->size())
      {
        continue;
      }
      Markup::Measurement measurement;
      measurement.name = this->Text(entry, "name", owner + ".measurements");
      const auto unit = entry.find("units");
      if (unit != entry.end())
      {
        const Json& code = unit->is_array() && !unit->empty() ? unit->front() : *unit;
        measurement.unit = code.is_string() ? code.get<std::string>() : std::string();
      }
      for (const std::size_t n : kept)
      {
        if ((*values)[n].is_number())
        {
          measurement.values.push_back((*values)[n].get<double>());
        }
      }
      if (measurement.values.size() == kept.size() && !measurement.name.empty())
      {
        result.measurements.push_back(std::move(measurement));
      }
    }
  }

  Markup Read(const Json& entry, const std::string& owner) const
  {
    if (!entry.is_object())
    {
      this->Fail(owner + " is not an object");
    }
    Markup markup;
    markup.type = this->Text(entry, "type", owner);
    if (std::find(std::begin(Types), std::end(Types), markup.type) == std::end(Types))
    {
      this->Fail(owner + ".type '" + markup.type.substr(0, 32) + "' is no type of markups");
    }
    markup.name = this->Text(entry, "name", owner);
    markup.description = this->Text(entry, "description", owner);
    std::vector<std::size_t> kept;
    this->Points(entry, owner, markup, kept);
    this->Measurements(entry, owner, markup, kept);
    return markup;
  }
};

void CheckFinite(const Markup& markup)
{
  for (const Markup::Point& point : markup.points)
  {
    if (!point.position.allFinite())
    {
      throw std::invalid_argument(
        "The markup '" + markup.name + "' has a point that is not finite");
    }
  }
  for (const Markup::Measurement& measurement : markup.measurements)
  {
    if (measurement.values.size() != markup.points.size())
    {
      throw std::invalid_argument("The markup '" + markup.name + "' has " +
        std::to_string(markup.points.size()) + " points and " +
        std::to_string(measurement.values.size()) + " values of " + measurement.name);
    }
    if (!std::all_of(measurement.values.begin(), measurement.values.end(),
          [](double value) { return std::isfinite(value); }))
    {
      throw std::invalid_argument("The markup '" + markup.name + "' has a value of " +
        measurement.name + " that is not finite");
    }
  }
}

Json JsonOf(const Markup& markup)
{
  CheckFinite(markup);
  Json entry = { { "type", markup.type }, { "name", markup.name },
    { "description", markup.description }, { "coordinateSystem", "LPS" },
    { "coordinateUnits", "mm" }, { "locked", true }, { "fixedNumberOfControlPoints", false },
    { "labelFormat", "%N-%d" }, { "lastUsedControlPointNumber", markup.points.size() } };
  Json points = Json::array();
  for (std::size_t n = 0; n < markup.points.size(); ++n)
  {
    const Markup::Point& point = markup.points[n];
    const Vector3& p = point.position;
    points.push_back({ { "id", std::to_string(n + 1) }, { "label", point.label },
      { "description", point.description }, { "associatedNodeID", "" },
      { "position", { p.x(), p.y(), p.z() } },
      { "orientation", { -1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0 } }, { "selected", true },
      { "locked", false }, { "visibility", true }, { "positionStatus", "defined" } });
  }
  entry["controlPoints"] = std::move(points);
  Json measurements = Json::array();
  for (const Markup::Measurement& measurement : markup.measurements)
  {
    measurements.push_back(
      { { "name", measurement.name }, { "enabled", true }, { "units", measurement.unit },
        { "printFormat", "%.3f" }, { "controlPointValues", measurement.values } });
  }
  entry["measurements"] = std::move(measurements);
  entry["display"] = { { "visibility", true }, { "opacity", 1.0 }, { "color", markup.color },
    { "selectedColor", markup.color }, { "propertiesLabelVisibility", true },
    { "pointLabelsVisibility", markup.labels }, { "glyphScale", markup.glyphScale } };
  return entry;
}
}

const Markup::Measurement* Markup::Find(const std::string& measurement) const
{
  const auto found = std::find_if(this->measurements.begin(), this->measurements.end(),
    [&](const Measurement& one) { return one.name == measurement; });
  return found == this->measurements.end() ? nullptr : &*found;
}

bool IsMarkupsFileName(const std::string& path)
{
  return EndsWith(LowerCase(path), ".mrk.json");
}

std::vector<Markup> ParseMarkups(const std::string& text, const std::string& name)
{
  const Json root = ParseBoundedJson<Json>(text, "'" + name + "'");
  if (!root.is_object() || !root.contains("markups") || !root["markups"].is_array())
  {
    FormatError(name, "has no list 'markups'");
  }
  const Reader reader{ name };
  std::vector<Markup> markups;
  for (const Json& entry : root["markups"])
  {
    markups.push_back(reader.Read(entry, "markups[" + std::to_string(markups.size()) + "]"));
  }
  return markups;
}

std::vector<Markup> ReadMarkupsFile(const std::string& path)
{
  RequireFile(path);
  return ParseMarkups(ReadTextFile(path, "markups"), path);
}

std::string MarkupsText(const std::vector<Markup>& markups)
{
  Json root = { { "@schema", Schema }, { "markups", Json::array() } };
  for (const Markup& markup : markups)
  {
    root["markups"].push_back(JsonOf(markup));
  }
  try
  {
    return root.dump(1) + "\n";
  }
  catch (const Json::exception&)
  {
    throw std::invalid_argument("A name among the markups is not UTF-8");
  }
}
}
