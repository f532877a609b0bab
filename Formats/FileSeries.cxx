#include "FileSeries.h"

#include "BoundedJson.h"
#include "ByteStream.h"
#include "TextFile.h"
#include "TextWords.h"
#include "XmlText.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace fs = std::filesystem;

namespace
{
std::vector<TimedFile> ReadJson(const std::string& path, const std::string& text)
{
  const nlohmann::json list = ParseBoundedJson(text, "'" + path + "'");
  const auto entries = list.find("files");
  if (entries == list.end() || !entries->is_array())
  {
    FormatError(path, "has no list 'files'");
  }
  std::vector<TimedFile> files;
  for (const auto& entry : *entries)
  {
    const std::string owner = "files[" + std::to_string(files.size()) + "]";
    if (!entry.is_object() || !entry.contains("name") || !entry["name"].is_string())
    {
      FormatError(path, owner + " has no 'name'");
    }
    if (!entry.contains("time") || !entry["time"].is_number())
    {
      FormatError(path, owner + " has no 'time' that is a number");
    }
    files.push_back({ entry["name"].get<std::string>(), entry["time"].get<double>() });
  }
  return files;
}

bool IsControl(char c)
{
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

std::vector<TimedFile> ReadPvd(const std::string& path, const std::string& text)
{
  std::vector<TimedFile> files;
  bool there = false;
  ReadXml(text, path,
    [&](const XmlElement& element)
    {
      there = there || element.Is("VTKFile/Collection");
      if (!element.Is("VTKFile/Collection/DataSet"))
      {
        return;
      }
      const TimedFile file{ element.Required("file"), element.Number("timestep") };
      if (!files.empty() && files.back().time == file.time)
      {
        element.Fail("has several files at the time " + element.String("timestep"));
      }
      files.push_back(file);
    });
  if (!there)
  {
    FormatError(path, "is not a .pvd file");
  }
  return files;
}
}

std::vector<TimedFile> ReadFileSeries(const std::string& path)
{
  RequireFile(path);
  const std::string text = ReadTextFile(path, "a list of files");
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  const char kind = first == std::string::npos ? '\0' : text[first];
  if (kind != '{' && kind != '<')
  {
    FormatError(path, "is neither a .series nor a .pvd file");
  }
  std::vector<TimedFile> files = kind == '{' ? ReadJson(path, text) : ReadPvd(path, text);
  if (files.empty())
  {
    FormatError(path, "lists no files");
  }
  const fs::path folder = fs::path(path).parent_path();
  for (std::size_t n = 0; n < files.size(); ++n)
  {
    const std::string& name = files[n].path;
    if (name.empty() || std::any_of(name.begin(), name.end(), IsControl))
    {
      FormatError(path,
        "file " + std::to_string(n) +
          (name.empty() ? " has no name" : " has a control character in its name"));
    }
    if (!std::isfinite(files[n].time) || (n > 0 && !(files[n].time > files[n - 1].time)))
    {
      FormatError(
        path, "the time of '" + files[n].path + "' is not finite and after the one before");
    }
    files[n].path = (folder / files[n].path).lexically_normal().string();
  }
  return files;
}

std::string FileSeriesText(const std::vector<TimedFile>& files)
{
  nlohmann::ordered_json list = { { "file-series-version", "1.0" },
    { "files", nlohmann::ordered_json::array() } };
  for (const TimedFile& file : files)
  {
    list["files"].push_back({ { "name", file.path }, { "time", file.time } });
  }
  return list.dump(2) + "\n";
}

std::string PvdText(const std::vector<TimedFile>& files)
{
  std::string text = "<?xml version=\"1.0\"?>\n"
                     "<VTKFile type=\"Collection\" version=\"0.1\">\n"
                     "  <Collection>\n";
  for (const TimedFile& file : files)
  {
    text += "    <DataSet timestep=\"" + nlohmann::json(file.time).dump() +
      "\" group=\"\" part=\"0\" file=\"" + EscapedXml(file.path) + "\"/>\n";
  }
  return text + "  </Collection>\n</VTKFile>\n";
}

std::string SeriesNumber(std::size_t number, std::size_t count, std::size_t digits)
{
  const std::string text = std::to_string(number);
  const std::size_t width = std::max(digits, std::to_string(count - 1).size());
  return std::string(width - text.size(), '0') + text;
}
}
