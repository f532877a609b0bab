#include "EvaluationRecord.h"

#include "AtomicFile.h"
#include "BoundedJson.h"
#include "Fnv1a.h"
#include "TextFile.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json JsonOf(double value)
{
  return std::isfinite(value) ? Json(value)
                              : Json(std::isnan(value) ? "nan"
                                    : value > 0.0      ? "inf"
                                                       : "-inf");
}

double NumberOf(const Json& json)
{
  return json.is_string() ? std::stod(json.get<std::string>()) : json.get<double>();
}

constexpr double BranchEvaluation::*BranchValues[] = { &BranchEvaluation::length,
  &BranchEvaluation::covered, &BranchEvaluation::continuity, &BranchEvaluation::hausdorff,
  &BranchEvaluation::mean };
}

std::string EvaluationRecord::Text() const
{
  Json json = { { "measures", Json::array() }, { "branches", Json::array() },
    { "false", Json::array() }, { "warnings", this->warnings } };
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    json["measures"].push_back(JsonOf(this->measures.*column.value));
  }
  for (const BranchEvaluation& branch : this->branches)
  {
    Json row = { branch.group, branch.label };
    for (const auto value : BranchValues)
    {
      row.push_back(JsonOf(branch.*value));
    }
    json["branches"].push_back(row);
  }
  for (const FalseBranch& branch : this->falseBranches)
  {
    json["false"].push_back(
      { branch.group, branch.label, JsonOf(branch.length), JsonOf(branch.confidence) });
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

EvaluationRecord EvaluationRecord::Of(const std::string& text)
{
  try
  {
    const Json json = ParseBoundedJson<Json>(text, "the text");
    EvaluationRecord record;
    std::size_t at = 0;
    for (const EvaluationColumn& column : EvaluationColumns())
    {
      record.measures.*column.value = NumberOf(json.at("measures").at(at++));
    }
    for (const Json& row : json.at("branches"))
    {
      BranchEvaluation branch;
      branch.group = row.at(0).get<std::int64_t>();
      branch.label = row.at(1).get<std::string>();
      at = 2;
      for (const auto value : BranchValues)
      {
        branch.*value = NumberOf(row.at(at++));
      }
      record.branches.push_back(branch);
    }
    for (const Json& row : json.at("false"))
    {
      record.falseBranches.push_back({ row.at(0).get<std::int64_t>(), row.at(1).get<std::string>(),
        NumberOf(row.at(2)), NumberOf(row.at(3)) });
    }
    record.warnings = json.at("warnings").get<std::vector<std::string>>();
    return record;
  }
  catch (const std::exception& error)
  {
    throw std::runtime_error("These are no measures of a phase: " + JsonReason(error));
  }
}

std::string EvaluationCache::NameOf(const std::vector<std::string>& files,
  const std::vector<std::string>& segments, const EvaluationSettings& settings) const
{
  if (this->Folder.empty())
  {
    return {};
  }
  std::ostringstream key;
  key.precision(std::numeric_limits<double>::max_digits10);
  const MeshDistanceSettings& distance = settings.distance;
  // A warning names the files.
  key << DYNAMICCORONARY_VERSION << '\n'
      << distance.errorBound << ' ' << distance.clipEnds << ' ' << distance.endLength << ' '
      << settings.relevantRadius << ' ' << settings.branches.tolerance << '\n';
  for (const std::string& segment : segments)
  {
    key << segment << '\n';
  }
  for (const std::string& path : files)
  {
    key << path << '\n';
    if (path.empty())
    {
      continue;
    }
    const std::string content =
      ReadTextFile(path, "a surface", std::numeric_limits<std::uint64_t>::max() - 1);
    key << content.size() << ' ' << Fnv1a(content.data(), content.size()) << '\n';
  }
  const std::string text = key.str();
  char name[40];
  std::snprintf(name, sizeof(name), "phase-%016llx.json",
    static_cast<unsigned long long>(Fnv1a(text.data(), text.size())));
  return name;
}

bool EvaluationCache::Read(const std::string& name, EvaluationRecord& record) const
{
  if (name.empty())
  {
    return false;
  }
  try
  {
    const std::string path = (fs::path(this->Folder) / name).string();
    record = EvaluationRecord::Of(ReadTextFile(path, "measures"));
    return true;
  }
  catch (const std::runtime_error&)
  {
    return false;
  }
}

void EvaluationCache::Write(const std::string& name, const EvaluationRecord& record) const
{
  if (name.empty())
  {
    return;
  }
  try
  {
    fs::create_directories(this->Folder);
    const std::string path = (fs::path(this->Folder) / name).string();
    RemoveAbandonedFiles(path);
    WriteFileAtomically(path, record.Text() + "\n");
  }
  catch (const std::exception&)
  {
    // Then it is measured again.
  }
}
}
