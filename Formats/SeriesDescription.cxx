#include "SeriesDescription.h"

#include "AtomicFile.h"
#include "BoundedJson.h"
#include "ByteStream.h"
#include "TextFile.h"
#include "TextWords.h"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace coronary
{
namespace fs = std::filesystem;

namespace
{
using Json = nlohmann::ordered_json;

std::string ReadText(const std::string& path)
{
  RequireFile(path);
  std::string text = ReadTextFile(path, "a description of a series");
  if (text.empty())
  {
    FormatError(path, "is empty");
  }
  return text;
}

// Python's json module writes NaN and Infinity, which are no JSON. As null they reach the checks
// below, which can name the entry.
std::string ReplaceNonFinite(const std::string& text)
{
  std::string result;
  result.reserve(text.size());
  bool quoted = false;
  for (std::size_t i = 0; i < text.size();)
  {
    const char c = text[i];
    if (quoted && c == '\\' && i + 1 < text.size())
    {
      result.append(text, i, 2);
      i += 2;
      continue;
    }
    if (c == '"')
    {
      quoted = !quoted;
    }
    std::size_t skipped = 0;
    if (!quoted)
    {
      for (const char* word : { "NaN", "nan", "-Infinity", "Infinity" })
      {
        const std::string literal(word);
        if (text.compare(i, literal.size(), literal) == 0)
        {
          skipped = literal.size();
          break;
        }
      }
    }
    if (skipped > 0)
    {
      result += "null";
      i += skipped;
    }
    else
    {
      result += c;
      ++i;
    }
  }
  return result;
}

void Check(const SeriesDescription& description, const std::string& path)
{
  if (!std::isfinite(description.cycleMs) || description.cycleMs < 0.0)
  {
    FormatError(path, "cycle_ms is not a positive number");
  }
  if (description.phases.empty())
  {
    FormatError(path, "has no phases");
  }
  for (std::size_t p = 0; p < description.phases.size(); ++p)
  {
    const std::string name = "phases[" + std::to_string(p) + "]";
    const SeriesDescription::Phase& phase = description.phases[p];
    if (!std::isfinite(phase.fraction))
    {
      FormatError(path, name + ".fraction is not a finite number");
    }
    if (phase.image.empty())
    {
      FormatError(path, name + " has no 'image'");
    }
    if (p > 0 && !(phase.fraction > description.phases[p - 1].fraction))
    {
      FormatError(path, name + ".fraction is not greater than the fraction before it");
    }
  }
  for (std::size_t s = 0; s < description.seeds.size(); ++s)
  {
    if (!description.seeds[s].position.allFinite())
    {
      FormatError(path,
        "seeds[" + std::to_string(s) + "] ('" + description.seeds[s].name +
          "'): position is not finite");
    }
  }
}

SeriesDescription::Phase ParsePhase(
  const Json& entry, const std::string& path, const std::string& name)
{
  if (!entry.is_object())
  {
    FormatError(path, name + " is not an object");
  }
  SeriesDescription::Phase phase;
  if (!entry.contains("fraction"))
  {
    FormatError(path, name + " has no 'fraction'");
  }
  phase.fraction = FiniteIn(entry["fraction"], path, name + ".fraction");
  phase.image = TextIn(entry, "image", path, name);
  phase.mask = TextIn(entry, "mask", path, name);
  const auto truth = entry.find("truth");
  if (truth != entry.end() && truth->is_object())
  {
    phase.surface = TextIn(*truth, "surface", path, name + ".truth");
    phase.centerline = TextIn(*truth, "centerline", path, name + ".truth");
  }
  return phase;
}

SeriesDescription::Seed ParseSeed(
  const Json& entry, const std::string& path, const std::string& name)
{
  if (!entry.is_object())
  {
    FormatError(path, name + " is not an object");
  }
  SeriesDescription::Seed seed;
  seed.name = TextIn(entry, "name", path, name);
  seed.position = PositionIn(entry, path, name + " ('" + seed.name + "'): position");
  return seed;
}
}

SeriesDescription ReadSeriesDescription(const std::string& path)
{
  const std::string text = ReplaceNonFinite(ReadText(path));
  const Json root = ParseBoundedJson<Json>(text, "'" + path + "'");
  if (!root.is_object())
  {
    FormatError(path, "is not a JSON object");
  }
  SeriesDescription description;
  if (root.contains("cycle_ms"))
  {
    description.cycleMs = FiniteIn(root["cycle_ms"], path, "cycle_ms");
    if (!(description.cycleMs > 0.0))
    {
      FormatError(path, "cycle_ms is not a positive number");
    }
  }
  if (!root.contains("phases") || !root["phases"].is_array())
  {
    FormatError(path, "has no list 'phases'");
  }
  for (const Json& entry : root["phases"])
  {
    description.phases.push_back(
      ParsePhase(entry, path, "phases[" + std::to_string(description.phases.size()) + "]"));
  }
  const auto seeds = root.find("seeds");
  if (seeds != root.end())
  {
    if (!seeds->is_array())
    {
      FormatError(path, "seeds is not a list");
    }
    for (const Json& entry : *seeds)
    {
      description.seeds.push_back(
        ParseSeed(entry, path, "seeds[" + std::to_string(description.seeds.size()) + "]"));
    }
  }
  Check(description, path);
  return description;
}

void WriteSeriesDescription(const std::string& path, const SeriesDescription& description)
{
  Check(description, path);
  Json root = Json::object();
  if (description.cycleMs > 0.0)
  {
    root["cycle_ms"] = description.cycleMs;
  }
  root["phases"] = Json::array();
  for (const SeriesDescription::Phase& phase : description.phases)
  {
    Json entry = { { "fraction", phase.fraction }, { "image", phase.image } };
    if (!phase.mask.empty())
    {
      entry["mask"] = phase.mask;
    }
    if (!phase.surface.empty())
    {
      entry["truth"]["surface"] = phase.surface;
    }
    if (!phase.centerline.empty())
    {
      entry["truth"]["centerline"] = phase.centerline;
    }
    root["phases"].push_back(std::move(entry));
  }
  root["seeds"] = Json::array();
  for (const SeriesDescription::Seed& seed : description.seeds)
  {
    const Vector3& p = seed.position;
    root["seeds"].push_back({ { "name", seed.name }, { "position", { p.x(), p.y(), p.z() } } });
  }
  std::string text;
  try
  {
    text = root.dump(2);
  }
  catch (const Json::exception& error)
  {
    FormatError(path, JsonReason(error));
  }
  WriteFileAtomically(path, text + "\n");
}

std::string ResolveSeriesPath(const std::string& descriptionPath, const std::string& entry)
{
  const fs::path path(entry);
  if (entry.empty() || path.is_absolute())
  {
    return entry;
  }
  return (fs::path(descriptionPath).parent_path() / path).lexically_normal().string();
}
}
