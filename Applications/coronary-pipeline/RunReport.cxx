#include "RunReport.h"

#include "BoundedJson.h"
#include "Fnv1a.h"
#include "ReportJson.h"
#include "TextFile.h"
#include "UtcTime.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <system_error>

#include <sys/resource.h>
#include <sys/stat.h>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* FinishedState = "finished";
const std::vector<const char*> HeadNames = { "phase", "time", "image", "surface_input" };

Json Versions()
{
  Json versions = { { "coronary-pipeline", DYNAMICCORONARY_VERSION } };
  const std::pair<const char*, const char*> others[] = {
    { "vtk", DYNAMICCORONARY_VTK_VERSION },
    { "paraview", DYNAMICCORONARY_PARAVIEW_VERSION },
    { "tetgen", DYNAMICCORONARY_TETGEN_VERSION },
    { "cgal", DYNAMICCORONARY_CGAL_VERSION },
  };
  for (const auto& [name, version] : others)
  {
    versions[name] = *version == '\0' ? Json() : Json(version);
  }
  return versions;
}

double Seconds(const timeval& time)
{
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double ProcessorTime()
{
  double sum = 0.0;
  for (const int who : { RUSAGE_SELF, RUSAGE_CHILDREN })
  {
    rusage usage{};
    getrusage(who, &usage);
    sum += Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  }
  return sum;
}

double Rounded(double value)
{
  return std::round(1000.0 * value) / 1000.0;
}

std::string Name(RunStage stage)
{
  return RunStageNames()[static_cast<std::size_t>(stage)];
}

/// The entry of a stage in a list of stages, or null.
Json EntryOf(const Json& stages, RunStage stage)
{
  for (const Json& entry : stages)
  {
    if (Member(entry, "name") == Name(stage))
    {
      return entry;
    }
  }
  return {};
}

/// Files in the order of their names, those of folders too.
std::vector<fs::path> AllFiles(const std::vector<std::string>& paths, const fs::path& except)
{
  std::vector<fs::path> files;
  std::error_code error;
  for (const std::string& path : paths)
  {
    if (!fs::is_directory(path, error))
    {
      files.emplace_back(path);
      continue;
    }
    fs::recursive_directory_iterator entry(
      path, fs::directory_options::skip_permission_denied, error);
    for (const fs::recursive_directory_iterator end; !error && entry != end; entry.increment(error))
    {
      std::error_code ignored;
      if (fs::equivalent(entry->path(), except, ignored))
      {
        entry.disable_recursion_pending();
      }
      else if (entry->is_regular_file(ignored))
      {
        files.push_back(entry->path());
      }
    }
  }
  for (fs::path& file : files)
  {
    file = fs::absolute(file, error).lexically_normal();
  }
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}
}

Json DescribeInput(const std::vector<std::string>& files, const std::string& except)
{
  std::uint64_t digest = Fnv1a(nullptr, 0);
  const auto add = [&](const std::string& text)
  {
    digest = Fnv1a(text.data(), text.size(), digest);
    digest = Fnv1a("\n", 1, digest);
  };
  std::uintmax_t bytes = 0;
  std::time_t latest = 0;
  std::uintmax_t count = 0;
  for (const fs::path& file : AllFiles(files, except))
  {
    struct stat status = {};
    if (stat(file.c_str(), &status) == 0)
    {
      ++count;
      latest = std::max(latest, status.st_mtime);
      bytes += static_cast<std::uintmax_t>(status.st_size);
      add(file.string());
      add(std::to_string(status.st_size));
      add(std::to_string(status.st_mtim.tv_sec) + "." + std::to_string(status.st_mtim.tv_nsec));
    }
  }
  char text[20];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(digest));
  return { { "files", count }, { "bytes", bytes }, { "modified", latest }, { "digest", text } };
}

RunClock::RunClock()
  : Start(std::chrono::steady_clock::now())
  , StartCpu(ProcessorTime())
{
}

double RunClock::Seconds() const
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - this->Start).count();
}

double RunClock::CpuSeconds() const
{
  return ProcessorTime() - this->StartCpu;
}

double PeakMemory()
{
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

RunReport::RunReport(std::string folder, Json settings, Json input, Json edits)
  : Folder(std::move(folder))
  , Settings(std::move(settings))
  , Input(std::move(input))
  , Edits(std::move(edits))
  , Started(UtcTime())
{
  const fs::path path = fs::path(this->Folder) / "report.json";
  if (!std::ifstream(path))
  {
    this->WhyNoOlder = "there is no '" + path.string() + "'";
    return;
  }
  try
  {
    this->Older = ParseBoundedJson<Json>(ReadTextFile(path.string(), "a report"), path.string());
  }
  catch (const std::exception&)
  {
    this->Older = Json();
  }
  if (!this->Older.is_object() || !Member(this->Older, "stages").is_array())
  {
    this->Older = Json();
    this->WhyNoOlder = "'" + path.string() + "' does not tell of stages";
  }
}

std::string RunReport::WhyNot(const RunOptions& options, RunStage stage) const
{
  const Json entry = EntryOf(Member(this->Older, "stages"), stage);
  const Json state = Member(entry, "state");
  if (!state.is_string())
  {
    return "it is not finished";
  }
  const Json settings = Member(this->Older, "settings");
  for (const std::string& name : options.NamesOf(stage))
  {
    const Json before = Member(settings, name);
    if (before != this->Settings[name])
    {
      return "'" + name + "' was " + before.dump() + " and is " + this->Settings[name].dump();
    }
  }
  const Json edits = Member(this->Older, "edits");
  if (stage == RunStage::Centerline && (edits.is_null() ? Json::array() : edits) != this->Edits)
  {
    return "other edits by hand: " + std::to_string(this->Edits.size()) + " instead of " +
      std::to_string(edits.size());
  }
  const Json files = Member(entry, "files");
  for (const auto& [file, bytes] : files.items())
  {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(fs::path(this->Folder) / file, error);
    if (error)
    {
      return "'" + file + "' is not there";
    }
    if (bytes != size)
    {
      return "'" + file + "' has " + std::to_string(size) + " bytes instead of " + bytes.dump();
    }
  }
  return {};
}

std::string RunReport::Keep(const RunOptions& options, RunStage first, RunStage last)
{
  std::string reason = this->WhyNoOlder;
  if (reason.empty() && Member(this->Older, "versions") != Versions())
  {
    reason = "the result is of other versions of the programs";
  }
  else if (reason.empty() && Member(this->Older, "input") != this->Input)
  {
    reason = "the result is of another input, or the input has changed";
  }
  for (int n = static_cast<int>(first); reason.empty() && n <= static_cast<int>(last); ++n)
  {
    const auto stage = static_cast<RunStage>(n);
    reason = this->WhyNot(options, stage);
    if (reason.empty())
    {
      this->Stages.push_back(EntryOf(this->Older["stages"], stage));
      const Json numbers = Member(this->Older, Name(stage));
      if (!numbers.is_null())
      {
        this->Numbers[Name(stage)] = numbers;
      }
    }
  }
  if (!this->Stages.empty())
  {
    for (const char* name : HeadNames)
    {
      if (this->Older.contains(name))
      {
        this->Head[name] = this->Older[name];
      }
    }
  }
  return reason;
}

bool RunReport::Has(RunStage stage) const
{
  return !EntryOf(this->Stages, stage).is_null();
}

Json RunReport::Of(const std::string& name) const
{
  return this->Head.contains(name) ? this->Head[name] : Member(this->Numbers, name);
}

std::optional<ReferencePhase> RunReport::Reference() const
{
  if (!this->Head.contains("phase"))
  {
    return std::nullopt;
  }
  return ReferencePhase{ this->Head["phase"].get<int>(), this->Head["time"].get<double>(),
    this->Head["image"].get<std::string>() };
}

void RunReport::SetReference(const ReferencePhase& reference)
{
  this->Set("phase", reference.number);
  this->Set("time", reference.time);
  this->Set("image", reference.image);
}

void RunReport::Set(const std::string& name, const Json& value)
{
  this->Head[name] = value;
}

void RunReport::Finish(RunStage stage, const Json& numbers, const RunClock& clock,
  const std::vector<std::string>& warnings,
  const std::vector<std::pair<std::string, std::string>>& files)
{
  Json sizes = Json::object();
  for (const auto& [name, path] : files)
  {
    std::error_code error;
    sizes[name] = fs::file_size(path, error);
  }
  this->Stages.push_back(
    { { "name", Name(stage) }, { "state", FinishedState }, { "run", this->Started },
      { "seconds", Rounded(clock.Seconds()) }, { "cpu_seconds", Rounded(clock.CpuSeconds()) },
      { "peak_memory_mb", Rounded(PeakMemory()) }, { "warnings", warnings }, { "files", sizes } });
  this->Numbers[Name(stage)] = numbers;
}

void RunReport::Stop(RunStage stage, const std::string& reason)
{
  this->Stopped = { { "stage", Name(stage) }, { "reason", reason } };
}

std::string RunReport::Text() const
{
  Json all = this->Head;
  all["started"] = this->Started;
  all["versions"] = Versions();
  all["settings"] = this->Settings;
  all["input"] = this->Input;
  all["edits"] = this->Edits;
  all["stages"] = this->Stages;
  all["stopped"] = this->Stopped;
  for (const auto& [name, numbers] : this->Numbers.items())
  {
    all[name] = numbers;
  }
  // Names come from users' files, which may hold anything.
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::vector<std::string> RunReport::OlderFiles(RunStage from) const
{
  std::vector<std::string> names;
  const auto& stages = RunStageNames();
  for (auto n = static_cast<std::size_t>(from); n < stages.size(); ++n)
  {
    const Json files =
      Member(EntryOf(Member(this->Older, "stages"), static_cast<RunStage>(n)), "files");
    for (const auto& [file, bytes] : files.items())
    {
      names.push_back(file);
    }
  }
  return names;
}

bool RunReport::OlderHas(RunStage stage) const
{
  return !EntryOf(Member(this->Older, "stages"), stage).is_null();
}
}
