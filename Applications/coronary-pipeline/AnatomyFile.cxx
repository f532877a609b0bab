#include "AnatomyFile.h"

#include "BoundedJson.h"
#include "FileSeries.h"
#include "Fnv1a.h"
#include "SeriesDescription.h"
#include "TextFile.h"
#include "TextWords.h"
#include "vtkMessageTrap.h"
#include "vtkSurfaceFile.h"

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <stdexcept>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;

/// Of an object of the file, with what names it in messages.
class Entry
{
public:
  Entry(const Json& object, std::string path, std::string place)
    : Object(object)
    , Path(std::move(path))
    , Place(std::move(place))
  {
    if (!object.is_object())
    {
      this->Fail("is not a JSON object");
    }
  }

  [[noreturn]] void Fail(const std::string& reason) const
  {
    throw std::runtime_error(
      "'" + this->Path + "'" + (this->Place.empty() ? "" : ": " + this->Place) + " " + reason);
  }

  void Allow(std::initializer_list<const char*> keys) const
  {
    for (const auto& [key, value] : this->Object.items())
    {
      const auto same = [&name = key](const char* one) { return name == one; };
      if (std::none_of(keys.begin(), keys.end(), same))
      {
        this->Fail("has a key '" + key + "' that is not known");
      }
    }
  }

  const Json* Find(const char* key) const
  {
    const auto found = this->Object.find(key);
    return found == this->Object.end() ? nullptr : &*found;
  }

  std::optional<double> Number(const char* key) const
  {
    const Json* value = this->Find(key);
    return value ? std::optional<double>(FiniteIn(*value, this->Path, this->Place + "." + key))
                 : std::nullopt;
  }

  std::vector<double> Numbers(const char* key) const
  {
    std::vector<double> numbers;
    if (const Json* list = this->Find(key))
    {
      if (!list->is_array())
      {
        this->Fail(std::string("has ") + key + " that are no list of numbers");
      }
      for (const Json& value : *list)
      {
        numbers.push_back(FiniteIn(value, this->Path, this->Place + "." + key));
      }
    }
    return numbers;
  }

  std::string Text(const char* key) const
  {
    return TextIn(this->Object, key, this->Path, this->Place);
  }

  bool Flag(const char* key) const
  {
    const Json* value = this->Find(key);
    if (value && !value->is_boolean())
    {
      this->Fail(std::string("has ") + key + " that is neither true nor false");
    }
    return value && value->get<bool>();
  }

  MaterialAmounts Material(const TissueMaterials& tissue, const char* usual) const
  {
    const std::string name = this->Find("material") ? this->Text("material") : usual;
    const std::string unit = this->Find("unit") ? this->Text("unit") : "HU";
    try
    {
      return MaterialOf(tissue, name, this->Number("value"), unit);
    }
    catch (const std::invalid_argument& error)
    {
      this->Fail(std::string("has ") + error.what());
    }
  }

  /// The surfaces' files with their phases.
  std::vector<TimedFile> Surfaces() const
  {
    const Json* list = this->Find("surfaces");
    std::vector<TimedFile> files;
    const bool one = list && list->is_string();
    if (!one && (!list || !list->is_array() || list->empty()))
    {
      this->Fail("has no surfaces: a list of files, or one .pvd or .series file");
    }
    if (one)
    {
      const std::string file = ResolveSeriesPath(this->Path, list->get<std::string>());
      if (EndsWith(file, ".pvd") || EndsWith(file, ".series"))
      {
        if (this->Find("phases"))
        {
          this->Fail("has phases, and a list of surfaces that has its own");
        }
        return ReadFileSeries(file);
      }
      files.push_back({ file, 0.0 });
    }
    for (std::size_t n = 0; !one && n < list->size(); ++n)
    {
      if (!(*list)[n].is_string())
      {
        this->Fail("has surfaces that are not names of files");
      }
      files.push_back({ ResolveSeriesPath(this->Path, (*list)[n].get<std::string>()), 0.0 });
    }
    const std::vector<double> phases = this->Numbers("phases");
    if (files.size() > 1 && phases.size() != files.size())
    {
      this->Fail("has " + std::to_string(files.size()) + " surfaces and " +
        std::to_string(phases.size()) + " phases");
    }
    for (std::size_t n = 0; n < phases.size() && n < files.size(); ++n)
    {
      files[n].time = phases[n];
    }
    return files;
  }

private:
  const Json& Object;
  const std::string Path;
  const std::string Place;
};

AnatomyPart ReadPart(const Entry& entry, const std::string& name, const TissueMaterials& tissue,
  vtkMessageTrap& messages)
{
  entry.Allow({ "name", "material", "value", "unit", "surfaces", "phases", "still", "truth" });
  AnatomyPart part;
  part.name = name;
  if (!entry.Find("material"))
  {
    entry.Fail("has no material");
  }
  part.material = entry.Material(tissue, "");
  part.still = entry.Flag("still");
  std::string first;
  for (const TimedFile& file : entry.Surfaces())
  {
    SurfaceMesh mesh;
    try
    {
      mesh = ReadTriangles(file.path, "", "", messages).mesh;
    }
    catch (const std::exception& error)
    {
      entry.Fail(std::string("can not be read: ") + error.what());
    }
    if (part.positions.empty())
    {
      part.triangles = std::move(mesh.triangles);
      first = file.path;
    }
    else if (mesh.points.size() != part.positions.front().size() ||
      mesh.triangles != part.triangles)
    {
      entry.Fail("has other points or triangles in '" + file.path + "' than in '" + first + "'");
    }
    part.phases.push_back(file.time);
    part.positions.push_back(std::move(mesh.points));
  }
  return part;
}

AnatomyTrunk ReadTrunk(const Entry& entry, const TissueMaterials& tissue)
{
  entry.Allow({ "material", "value", "unit", "width_mm", "depth_mm", "centre" });
  AnatomyTrunk trunk;
  trunk.material = entry.Material(tissue, "soft");
  trunk.width = entry.Number("width_mm").value_or(0.0);
  trunk.depth = entry.Number("depth_mm").value_or(0.0);
  if (!(trunk.width > 0.0 && trunk.depth > 0.0))
  {
    entry.Fail("has no width_mm and depth_mm above 0");
  }
  const std::vector<double> centre = entry.Numbers("centre");
  if (!centre.empty())
  {
    if (centre.size() != 2)
    {
      entry.Fail("has a centre that is not x and y");
    }
    trunk.centre = { centre[0], centre[1] };
  }
  return trunk;
}
}

AnatomyFile ReadAnatomyFile(const std::string& path, vtkMessageTrap& messages)
{
  const Json json = ParseBoundedJson<Json>(ReadTextFile(path, "an anatomy"), "'" + path + "'");
  const Entry whole(json, path, "");
  whole.Allow({ "cycle_ms", "trunk", "parts" });
  const double cycle = whole.Number("cycle_ms").value_or(0.0);
  if (!(cycle >= 300.0 && cycle <= 3000.0))
  {
    whole.Fail("has no cycle_ms from 300 to 3000");
  }
  const Json* list = whole.Find("parts");
  if (!list || !list->is_array() || list->empty())
  {
    whole.Fail("has no parts");
  }
  const TissueMaterials tissue;
  AnatomyFile file;
  std::optional<AnatomyTrunk> trunk;
  if (const Json* given = whole.Find("trunk"))
  {
    trunk = ReadTrunk(Entry(*given, path, "trunk"), tissue);
    file.trunkGiven = true;
  }
  std::vector<AnatomyPart> parts;
  for (const Json& one : *list)
  {
    const std::string place = "parts[" + std::to_string(parts.size()) + "]";
    const Entry unnamed(one, path, place);
    const std::string name = unnamed.Text("name");
    if (name.empty())
    {
      unnamed.Fail("has no name");
    }
    const Entry entry(one, path, "part '" + name + "'");
    if (entry.Flag("truth"))
    {
      file.truth.push_back(parts.size());
    }
    const AnatomyPart& part = parts.emplace_back(ReadPart(entry, name, tissue, messages));
    file.digest =
      Fnv1a(part.triangles.data(), part.triangles.size() * sizeof(part.triangles[0]), file.digest);
    file.digest =
      Fnv1a(part.phases.data(), part.phases.size() * sizeof(part.phases[0]), file.digest);
    for (const std::vector<Vector3>& points : part.positions)
    {
      file.digest = Fnv1a(points.data(), points.size() * sizeof(points[0]), file.digest);
    }
  }
  file.parts = parts.size();
  try
  {
    file.anatomy = std::make_unique<MeshAnatomy>(std::move(parts), 1e-3 * cycle, trunk);
  }
  catch (const std::invalid_argument& error)
  {
    throw std::runtime_error("'" + path + "': " + error.what());
  }
  return file;
}
}
