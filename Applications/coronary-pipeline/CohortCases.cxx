#include "CohortCases.h"

#include "BoundedJson.h"
#include "Command.h"
#include "Fnv1a.h"
#include "RunReport.h"
#include "RunSettings.h"
#include "TextFile.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <set>
#include <stdexcept>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Folders of `cohort` itself.
const std::set<std::string> TakenNames = { "evaluation", "measures" };
constexpr std::size_t LongestName = 100;

[[noreturn]] void Refuse(const std::string& where, const std::string& what)
{
  throw std::runtime_error(where + " " + what + ".");
}

void RequireKnown(const Json& object, const std::set<std::string>& known, const std::string& where)
{
  if (!object.is_object())
  {
    Refuse(where, "must be an object");
  }
  for (const auto& item : object.items())
  {
    if (known.count(item.key()) == 0)
    {
      std::string list;
      for (const std::string& name : known)
      {
        list += (list.empty() ? "" : ", ") + name;
      }
      Refuse(where + "." + item.key(), "is not known; there are " + list);
    }
  }
}

std::string FilledText(const Json& value, const std::string& where)
{
  if (!value.is_string() || value.get<std::string>().empty())
  {
    Refuse(where, "must be a text that is not empty");
  }
  return value.get<std::string>();
}

std::string ExistingPath(const Json& value, const fs::path& folder, const std::string& where)
{
  const fs::path path = fs::absolute(folder / FilledText(value, where)).lexically_normal();
  std::error_code ignored;
  if (!fs::exists(path, ignored))
  {
    Refuse(where, "'" + path.string() + "' does not exist");
  }
  return path.string();
}

std::string NameOf(const Json& value, const std::string& where)
{
  std::string name = FilledText(value, where);
  const bool plain = std::all_of(name.begin(), name.end(),
    [](char c)
    {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
        c == '-' || c == '_' || c == '.';
    });
  if (!plain || name.front() == '.' || name.front() == '-' || name.size() > LongestName)
  {
    Refuse(where,
      "'" + name +
        "' is no name of a folder: up to 100 letters, digits, '-', '_' and "
        "'.', the first of them a letter, a digit or '_'");
  }
  if (TakenNames.count(name) > 0)
  {
    Refuse(where, "'" + name + "' is a folder of the cohort's own");
  }
  return name;
}

/// A member of an object as an option of the command line.
void AddOption(
  const std::string& key, const Json& value, const std::string& where, std::vector<std::string>& to)
{
  std::string option = "--" + key;
  std::replace(option.begin() + 2, option.end(), '_', '-');
  const auto word = [&](const Json& one)
  {
    if (one.is_string())
    {
      return one.get<std::string>();
    }
    if (!one.is_number())
    {
      Refuse(where + "." + key, "must be a number, a text, a list of these, or true");
    }
    return one.dump();
  };
  if (value.is_boolean())
  {
    if (value.get<bool>())
    {
      to.push_back(option);
    }
    return;
  }
  if (!value.is_array())
  {
    to.push_back(option + "=" + word(value));
    return;
  }
  to.push_back(option);
  for (const Json& one : value)
  {
    to.push_back(word(one));
  }
}

/// Options of a command, which must be able to read them beside those that `cohort` gives.
std::vector<std::string> OptionsOf(const Json& object, MakeCommand* make,
  const std::vector<std::string>& given, const std::set<std::string>& own, const std::string& where)
{
  if (!object.is_object())
  {
    Refuse(where, "must be an object");
  }
  std::vector<std::string> options;
  for (const auto& item : object.items())
  {
    if (own.count(item.key()) > 0)
    {
      Refuse(where + "." + item.key(), "is what cohort says itself");
    }
    AddOption(item.key(), item.value(), where, options);
  }
  CLI::App program;
  const Command command = make(program);
  std::vector<std::string> words = options;
  words.insert(words.end(), given.begin(), given.end());
  words.insert(words.begin(), command.options->get_name());
  std::reverse(words.begin(), words.end()); // as CLI11 takes them
  try
  {
    program.parse(words);
  }
  catch (const CLI::ParseError& error)
  {
    Refuse(where + ":", error.what());
  }
  return options;
}

void CheckRun(const Json& run, const std::string& where)
{
  static const std::set<std::string> own = { "input", "output", "threads", "quiet" };
  if (!run.is_object())
  {
    Refuse(where, "must be an object");
  }
  for (const auto& item : run.items())
  {
    if (own.count(item.key()) > 0)
    {
      Refuse(where + "." + item.key(), "is what cohort says itself");
    }
  }
  CLI::App app;
  RunSettings settings;
  RunOptions options(app, settings);
  options.Take(run, where);
  try
  {
    options.Check();
  }
  catch (const UsageError& error)
  {
    Refuse(where + ":", error.what());
  }
}

CohortCase CaseOf(
  const Json& json, const Json& runOfAll, const fs::path& folder, const std::string& where)
{
  RequireKnown(json, { "name", "input", "phantom", "truth", "run", "time_limit" }, where);
  CohortCase one;
  if (!json.contains("name"))
  {
    Refuse(where + ".name", "is missing");
  }
  one.name = NameOf(json["name"], where + ".name");
  if (json.contains("input") == json.contains("phantom"))
  {
    Refuse(where, "must have either input or phantom");
  }
  if (json.contains("input"))
  {
    const Json& input = json["input"];
    if (input.is_array())
    {
      for (std::size_t n = 0; n < input.size(); ++n)
      {
        one.input.push_back(
          ExistingPath(input[n], folder, where + ".input[" + std::to_string(n) + "]"));
      }
    }
    else
    {
      one.input.push_back(ExistingPath(input, folder, where + ".input"));
    }
    if (one.input.empty())
    {
      Refuse(where + ".input", "is empty");
    }
  }
  else
  {
    one.phantom = OptionsOf(json["phantom"], MakePhantomCommand, { "--output", "folder" },
      { "output", "threads", "quiet", "truth_only", "no_truth" }, where + ".phantom");
  }
  if (json.contains("truth"))
  {
    if (one.IsPhantom())
    {
      Refuse(where + ".truth", "is not for a phantom, which has its own");
    }
    one.truth = ExistingPath(json["truth"], folder, where + ".truth");
  }
  if (json.contains("time_limit"))
  {
    const Json& limit = json["time_limit"];
    if (!limit.is_number() || !(limit.get<double>() > 0.0))
    {
      Refuse(where + ".time_limit", "must be a positive number of seconds");
    }
    one.timeLimit = limit.get<double>();
  }
  one.run = runOfAll;
  if (json.contains("run"))
  {
    CheckRun(json["run"], where + ".run");
    one.run.update(json["run"]);
    CheckRun(one.run, where + ".run");
  }
  if (one.HasTruth() && one.run.value("until", "motion") != "motion")
  {
    Refuse(where + ".run.until", "must be motion: a case with a truth is compared with it");
  }
  return one;
}
}

Cohort ReadCohort(const std::string& path)
{
  const Json json = ParseBoundedJson<Json>(ReadTextFile(path, "cases"), "'" + path + "'");
  const std::string where = "'" + path + "': cohort";
  RequireKnown(json, { "cases", "run", "evaluate" }, where);
  const Json run = json.value("run", Json::object());
  CheckRun(run, where + ".run");
  Cohort cohort;
  cohort.evaluate = OptionsOf(json.value("evaluate", Json::object()), MakeEvaluateCommand,
    { "--result=folder", "--truth=folder", "--output=folder" },
    { "result", "truth", "name", "output", "threads", "quiet", "measure_cache", "no_pictures" },
    where + ".evaluate");
  if (!json.contains("cases") || !json["cases"].is_array() || json["cases"].empty())
  {
    Refuse(where + ".cases", "must be a list of at least one case");
  }
  const fs::path folder = fs::absolute(path).parent_path();
  std::set<std::string> names;
  for (std::size_t n = 0; n < json["cases"].size(); ++n)
  {
    const std::string place = where + ".cases[" + std::to_string(n) + "]";
    cohort.cases.push_back(CaseOf(json["cases"][n], run, folder, place));
    if (!names.insert(cohort.cases.back().name).second)
    {
      Refuse(place + ".name", "'" + cohort.cases.back().name + "' is taken by another case");
    }
  }
  return cohort;
}

std::string DigestOf(const CohortCase& one, const Cohort& cohort, const std::string& output)
{
  // Of a series.json the images beside it count too.
  std::vector<std::string> files = one.input;
  for (const std::string& path : one.input)
  {
    if (fs::path(path).extension() == ".json")
    {
      files.push_back(fs::path(path).parent_path().string());
    }
  }
  if (!one.truth.empty())
  {
    files.push_back(one.truth);
  }
  const Json all = { { "version", DYNAMICCORONARY_VERSION }, { "input", one.input },
    { "phantom", one.phantom }, { "truth", one.truth }, { "run", one.run },
    { "evaluate", cohort.evaluate },
    { "files", files.empty() ? Json() : DescribeInput(files, output) } };
  const std::string text = all.dump(-1, ' ', false, Json::error_handler_t::replace);
  char digest[20];
  std::snprintf(digest, sizeof(digest), "%016llx",
    static_cast<unsigned long long>(Fnv1a(text.data(), text.size())));
  return digest;
}
}
