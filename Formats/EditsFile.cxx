#include "EditsFile.h"

#include "BoundedJson.h"
#include "TextFile.h"
#include "TextWords.h"

#include <algorithm>
#include <set>
#include <stdexcept>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;

constexpr const char* Format = "coronary edits";
constexpr int Version = 1;

void RequireObject(const Json& value, const std::set<std::string>& known, const std::string& where,
  const std::string& place)
{
  if (!value.is_object())
  {
    FormatError(where, place + " is not an object");
  }
  for (const auto& item : value.items())
  {
    if (known.count(item.key()) == 0)
    {
      FormatError(where, place + " has a member " + Quoted(item.key()) + " that is not known");
    }
  }
}

double LengthIn(
  const Json& object, const char* member, const std::string& where, const std::string& place)
{
  const auto found = object.find(member);
  return found == object.end() ? 0.0 : FiniteIn(*found, where, place + "." + member);
}

TreeEdit EditOf(const Json& value, const std::string& where, const std::string& place)
{
  RequireObject(value, { "edit", "points", "name", "new_name", "radius", "reach" }, where, place);
  const std::string kind = TextIn(value, "edit", where, place);
  const std::vector<EditKind>& kinds = EditKinds();
  const auto found = std::find_if(
    kinds.begin(), kinds.end(), [&](EditKind one) { return kind == EditKindName(one); });
  if (found == kinds.end())
  {
    std::string all;
    for (const EditKind one : kinds)
    {
      all += (all.empty() ? "" : ", ") + std::string(EditKindName(one));
    }
    FormatError(where, place + ".edit is " + Quoted(kind) + ", which is none of " + all);
  }
  TreeEdit edit;
  edit.kind = *found;
  edit.name = TextIn(value, "name", where, place);
  edit.newName = TextIn(value, "new_name", where, place);
  edit.radius = LengthIn(value, "radius", where, place);
  edit.reach = LengthIn(value, "reach", where, place);
  if (value.contains("points"))
  {
    const Json& points = value["points"];
    if (!points.is_array())
    {
      FormatError(where, place + ".points is not a list");
    }
    for (std::size_t n = 0; n < points.size(); ++n)
    {
      const std::string point = place + ".points[" + std::to_string(n) + "]";
      // The same reading as of positions elsewhere.
      edit.points.push_back(PositionIn({ { "position", points[n] } }, where, point));
    }
  }
  try
  {
    CheckEdit(edit);
  }
  catch (const std::invalid_argument& error)
  {
    FormatError(where, place + ": " + error.what());
  }
  return edit;
}

Json JsonOf(const TreeEdit& edit)
{
  Json value = { { "edit", EditKindName(edit.kind) } };
  if (!edit.points.empty())
  {
    value["points"] = Json::array();
    for (const Vector3& point : edit.points)
    {
      value["points"].push_back({ point[0], point[1], point[2] });
    }
  }
  const auto text = [&](const char* member, const std::string& words)
  {
    if (!words.empty())
    {
      value[member] = words;
    }
  };
  const auto length = [&](const char* member, double number)
  {
    if (number > 0.0)
    {
      value[member] = number;
    }
  };
  text("name", edit.name);
  text("new_name", edit.newName);
  length("radius", edit.radius);
  length("reach", edit.reach);
  return value;
}
}

std::vector<TreeEdit> ParseEdits(const std::string& text, const std::string& where)
{
  const Json file = ParseBoundedJson<Json>(text, "'" + where + "'");
  RequireObject(file, { "format", "version", "edits" }, where, "the file");
  if (TextIn(file, "format", where, "the file") != Format)
  {
    FormatError(where, std::string("format is not '") + Format + "'");
  }
  if (!file.contains("version") || file["version"] != Version)
  {
    FormatError(where,
      "version is " + (file.contains("version") ? InOneLine(file["version"].dump()) : "missing") +
        "; this program reads " + std::to_string(Version));
  }
  if (!file.contains("edits") || !file["edits"].is_array())
  {
    FormatError(where, "edits is not a list");
  }
  std::vector<TreeEdit> edits;
  for (std::size_t n = 0; n < file["edits"].size(); ++n)
  {
    edits.push_back(EditOf(file["edits"][n], where, "edits[" + std::to_string(n) + "]"));
  }
  return edits;
}

TreeEdit ParseEdit(const std::string& text, const std::string& where)
{
  return EditOf(ParseBoundedJson<Json>(text, "'" + where + "'"), where, "the edit");
}

std::vector<TreeEdit> ReadEditsFile(const std::string& path)
{
  return ParseEdits(ReadTextFile(path, "a list of edits"), path);
}

std::string EditText(const TreeEdit& edit)
{
  return JsonOf(edit).dump();
}

std::string EditsText(const std::vector<TreeEdit>& edits)
{
  // An edit a line, so that a list is read and changed by hand.
  std::string text = std::string("{\n  \"format\": \"") + Format +
    "\",\n  \"version\": " + std::to_string(Version) + ",\n  \"edits\": [";
  for (std::size_t n = 0; n < edits.size(); ++n)
  {
    text += (n > 0 ? ",\n    " : "\n    ") + EditText(edits[n]);
  }
  return text + (edits.empty() ? "]\n}\n" : "\n  ]\n}\n");
}
}
