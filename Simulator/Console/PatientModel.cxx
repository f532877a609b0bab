#include "PatientModel.h"

#include "AtomicFile.h"
#include "BoundedJson.h"
#include "ChildProcess.h"
#include "StagedFolder.h"
#include "TextFile.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <vector>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr char Program[] = "coronary-pipeline";
constexpr auto Pause = std::chrono::milliseconds(100);
constexpr auto Patience = std::chrono::seconds(10); // for it to stop

/// Whether a path of a report, which may be told from another folder, leads to `series`.
bool LeadsTo(const std::string& path, const std::string& series)
{
  const auto parts = [](const fs::path& of)
  {
    const fs::path whole = (of / "").lexically_normal().parent_path();
    std::vector<fs::path> names(whole.begin(), whole.end());
    names.erase(std::remove(names.begin(), names.end(), ".."), names.end());
    return names;
  };
  const std::vector<fs::path> told = parts(path);
  const std::vector<fs::path> given = parts(fs::absolute(series));
  return told.size() <= given.size() && std::equal(told.rbegin(), told.rend(), given.rbegin());
}

/// What a run tells of itself; null: there is none.
Json ReportIn(const std::string& folder)
{
  const std::string file = (fs::path(folder) / "report.json").string();
  std::error_code ignored;
  return fs::exists(file, ignored)
    ? ParseBoundedJson(ReadTextFile(file, "a report"), "'" + file + "'")
    : Json();
}

/// A member of an object; null: there is none.
Json Member(const Json& json, const char* name)
{
  return json.is_object() ? json.value(name, Json()) : Json();
}

/// The settings of a model that is there, or was begun; null: there is none.
/// @throws std::runtime_error  it is of other images
Json SettingsOf(const std::string& folder, const std::string& series)
{
  const Json report = ReportIn(folder);
  if (report.is_null())
  {
    return {};
  }
  const Json settings = Member(report, "settings");
  const Json input = Member(settings, "input");
  if (!input.is_array() || input.size() != 1 || !input[0].is_string() ||
    !LeadsTo(input[0].get<std::string>(), series))
  {
    throw std::runtime_error("'" + folder + "' is not the model of '" + series + "' but of " +
      (input.is_null() ? "something else" : input.dump()) +
      ": name another folder with --vessels.");
  }
  return settings;
}

/// What the run warned of, in the order of its stages.
std::vector<std::string> WarningsIn(const std::string& folder)
{
  std::vector<std::string> warnings;
  for (const Json& stage : Member(ReportIn(folder), "stages"))
  {
    for (const Json& warning : Member(stage, "warnings"))
    {
      warnings.push_back(warning.is_string() ? warning.get<std::string>() : warning.dump());
    }
  }
  return warnings;
}

/// What of the child's words is new: how far it is, and the last line that is about something else.
class Listener
{
public:
  explicit Listener(const std::string& path)
    : Log(path)
  {
  }

  void Listen()
  {
    this->Log.clear();
    for (std::string line; this->Read(line);)
    {
      const std::string progress = "progress ";
      if (line.rfind(progress, 0) == 0)
      {
        this->fraction = std::strtod(line.c_str() + progress.size(), nullptr);
      }
      else if (!line.empty())
      {
        this->said = line;
      }
    }
  }

  double fraction = 0.0;
  std::string said;

private:
  /// A whole line; what there is of another waits.
  bool Read(std::string& line)
  {
    const auto place = this->Log.tellg();
    if (std::getline(this->Log, line) && !this->Log.eof())
    {
      return true;
    }
    this->Log.clear();
    this->Log.seekg(place);
    return false;
  }

  std::ifstream Log;
};

void End(ChildProcess& process)
{
  process.Signal(SIGTERM);
  const auto since = std::chrono::steady_clock::now();
  while (!process.HasEnded() && std::chrono::steady_clock::now() - since < Patience)
  {
    std::this_thread::sleep_for(Pause);
  }
}
}

std::string NameOfSeries(const std::string& series)
{
  // A slash at its end or not.
  const fs::path path = (fs::absolute(series) / "").lexically_normal().parent_path();
  // Descriptions of series have one name, folders differ.
  return (path.filename() == "series.json" ? path.parent_path().filename() : path.stem()).string();
}

std::vector<std::string> MakePatientModel(
  const std::string& series, const std::string& folder, const ProgressCallback& progress)
{
  std::error_code error;
  if (!fs::exists(series, error))
  {
    throw std::runtime_error("'" + series + "' is not there.");
  }
  const fs::path program = fs::read_symlink(ThisProgram, error).parent_path() / Program;
  if (!fs::exists(program, error))
  {
    throw std::runtime_error(
      "There is no '" + program.string() + "' to make the model of '" + series + "'.");
  }
  // Nothing of it is committed.
  StagedFolder scratch(fs::temp_directory_path().string());
  std::vector<std::string> arguments = { "run", fs::absolute(series).string(), "--output", folder,
    "--resume" };
  if (const Json settings = SettingsOf(folder, series); !settings.is_null())
  {
    const std::string file = scratch.Add("settings.json");
    WriteFileAtomically(file, settings.dump());
    arguments.insert(arguments.end(), { "--settings", file });
  }
  const std::string log = scratch.Add("log");
  ChildProcess process(program.string(), arguments, log, true);
  Listener listener(log);
  while (!process.HasEnded())
  {
    listener.Listen();
    try
    {
      Report(progress, listener.fraction);
    }
    catch (const Cancelled&)
    {
      End(process);
      throw;
    }
    std::this_thread::sleep_for(Pause);
  }
  listener.Listen();
  if (process.ExitCode() != 0)
  {
    throw std::runtime_error("The model of '" + series + "' could not be made: " +
      (listener.said.empty() ? std::string(Program) + " ended without a word." : listener.said));
  }
  return WarningsIn(folder);
}
}
