#include "Command.h"

#include "AtomicFile.h"
#include "CohortCases.h"
#include "CohortWork.h"
#include "Interruption.h"
#include "OptionChecks.h"
#include "ParallelFor.h"
#include "Ranks.h"
#include "UtcTime.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using namespace std::chrono_literals;

/// How long a process with nothing to do looks away.
constexpr auto Pause = 20ms;
constexpr const char* StateName = "case.json";

/// What became of a case: in its folder, and in the list of all.
struct CaseState
{
  std::string state = "waiting"; ///< waiting, done, failed
  std::string message;           ///< of a failed one
  double seconds = 0.0;
  std::string digest;
  std::string ended;

  Json AsJson() const
  {
    return { { "state", this->state },
      { "message", this->message.empty() ? Json() : Json(this->message) },
      { "seconds", this->seconds }, { "settings", this->digest }, { "ended", this->ended } };
  }
};

class CohortJob
{
public:
  void Declare(CLI::App& app);
  void Run();

private:
  CaseState StateOf(const CohortCase& one) const;
  bool IsToDo(const CaseState& state, const std::string& digest) const;
  /// Which cases are of this part.
  std::vector<std::size_t> Part() const;
  void SayWhatIsToDo(const std::vector<std::size_t>& cases, const std::vector<bool>& toDo) const;

  ///@{
  /// The first rank deals out cases as they get free; the others do what they are told.
  void Lead(std::vector<std::size_t> open);
  void Follow();
  ///@}
  int ThreadsOfACase() const;
  ///@{
  /// Of the cases at work in this process.
  using HasEnded =
    std::function<void(std::size_t number, const std::string& failure, double seconds)>;
  void BeginHere(std::size_t number, const HasEnded& ended);
  void LookHere(const HasEnded& ended);
  void StopHere();
  ///@}
  void End(std::size_t number, const std::string& failure, double seconds);
  void WriteList(const std::string& tables) const;
  /// Table 1 of the cases that are done. @return why there is none; empty: there is
  std::string WriteTables() const;
  void Say(const std::string& line) const;

  std::string File;
  std::string Output;
  std::vector<int> Share; ///< number and count; empty: all
  int Jobs = 1;
  double TimeLimit = 0.0;
  bool RetryFailed = false;
  bool DryRun = false;
  bool NoPictures = false;
  int Threads = 0;
  bool Quiet = false;

  Cohort All;
  std::vector<CaseState> States; ///< of all cases
  std::vector<std::string> Digests;
  std::size_t Ended = 0;
  std::size_t Planned = 0;
  std::map<std::size_t, std::unique_ptr<CohortWork>> AtWork; ///< here
};

void CohortJob::Declare(CLI::App& app)
{
  app.add_option("CASES", this->File, "JSON file with the cases")->type_name("")->required();
  app.add_option("--output", this->Output, "Folder to write to; made when it does not exist")
    ->type_name("DIR")
    ->required();
  app
    .add_option("--jobs", this->Jobs, "Cases at a time on each rank, each with its share of cores")
    ->check(WholeWithin(1, 1024))
    ->type_name("N")
    ->capture_default_str();
  app
    .add_option("--time-limit", this->TimeLimit,
      "A case that takes longer has failed, s; 0: none. A case's own time_limit counts more")
    ->check(Within(0.0, 1e7))
    ->type_name("S")
    ->capture_default_str();
  app.add_flag("--retry-failed", this->RetryFailed, "Try failed cases again");
  app
    .add_option("--part", this->Share,
      "Do only part K of N of the cases, and no tables: for an array of jobs. A last start without "
      "it makes these")
    ->check(WholeWithin(1, 100000))
    ->expected(2)
    ->type_name("K N");
  app.add_flag("--dry-run", this->DryRun, "Say what would be done, and do nothing");
  app.add_flag("--no-pictures", this->NoPictures, "Without pictures/, which need a display");
  AddThreads(app, this->Threads, "Number of threads of a case; 0: the cores over the jobs");
  app.add_flag("--quiet", this->Quiet, "No progress and no summary");
}

void CohortJob::Say(const std::string& line) const
{
  if (!this->Quiet && Ranks().IsFirst())
  {
    std::fprintf(stderr, "%s\n", line.c_str());
  }
}

CaseState CohortJob::StateOf(const CohortCase& one) const
{
  CaseState state;
  std::ifstream file(fs::path(this->Output) / one.name / StateName);
  const Json json = Json::parse(file, nullptr, false);
  if (json.is_object())
  {
    try
    {
      state.state = json.at("state").get<std::string>();
      state.message = json.at("message").is_null() ? "" : json.at("message").get<std::string>();
      state.seconds = json.at("seconds").get<double>();
      state.digest = json.at("settings").get<std::string>();
      state.ended = json.at("ended").get<std::string>();
    }
    catch (const Json::exception&)
    {
      return {};
    }
  }
  return state;
}

bool CohortJob::IsToDo(const CaseState& state, const std::string& digest) const
{
  return state.digest != digest ||
    !(state.state == "done" || (state.state == "failed" && !this->RetryFailed));
}

std::vector<std::size_t> CohortJob::Part() const
{
  std::vector<std::size_t> part;
  for (std::size_t n = 0; n < this->All.cases.size(); ++n)
  {
    if (this->Share.empty() ||
      n % static_cast<std::size_t>(this->Share[1]) == static_cast<std::size_t>(this->Share[0] - 1))
    {
      part.push_back(n);
    }
  }
  return part;
}

int CohortJob::ThreadsOfACase() const
{
  return this->Threads > 0 ? this->Threads : std::max(1, NumberOfThreads() / this->Jobs);
}

void CohortJob::End(std::size_t number, const std::string& failure, double seconds)
{
  const CohortCase& one = this->All.cases[number];
  CaseState& state = this->States[number];
  state = { failure.empty() ? "done" : "failed", failure, std::round(seconds * 10.0) / 10.0,
    this->Digests[number], UtcTime() };
  const fs::path folder = fs::path(this->Output) / one.name;
  fs::create_directories(folder);
  Json json = { { "name", one.name } };
  json.update(state.AsJson());
  WriteFileAtomically((folder / StateName).string(), json.dump(2) + "\n");
  this->WriteList("");
  this->Say("[" + std::to_string(++this->Ended) + "/" + std::to_string(this->Planned) + "] " +
    one.name + ": " +
    (failure.empty() ? "done in " + Format(state.seconds) + " s" : "failed: " + failure));
}

void CohortJob::WriteList(const std::string& tables) const
{
  if (!this->Share.empty())
  {
    return;
  }
  Json json = { { "cases_file", fs::absolute(this->File).lexically_normal().string() },
    { "version", DYNAMICCORONARY_VERSION }, { "tables", tables.empty() ? Json() : Json(tables) },
    { "cases", Json::array() } };
  for (std::size_t n = 0; n < this->All.cases.size(); ++n)
  {
    Json entry = { { "name", this->All.cases[n].name } };
    entry.update(this->States[n].AsJson());
    json["cases"].push_back(entry);
  }
  WriteFileAtomically((fs::path(this->Output) / "cohort.json").string(),
    json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

/// Messages between the ranks.
namespace message
{
constexpr const char* Kind = "kind";
const std::string Do = "do";
const std::string Stop = "stop";
const std::string Ended = "ended";
const std::string Interrupted = "interrupted";

void Send(int rank, const Json& json)
{
  Ranks().Send(rank, json.dump(-1, ' ', false, Json::error_handler_t::replace));
}
}

void CohortJob::BeginHere(std::size_t number, const HasEnded& ended)
{
  try
  {
    this->AtWork[number] = std::make_unique<CohortWork>(
      this->All.cases[number], this->All, this->Output, this->ThreadsOfACase());
  }
  catch (const std::exception& error)
  {
    this->AtWork.erase(number);
    ended(number, error.what(), 0.0);
  }
}

void CohortJob::LookHere(const HasEnded& ended)
{
  for (auto one = this->AtWork.begin(); one != this->AtWork.end();)
  {
    if (one->second->HasEnded())
    {
      ended(one->first, one->second->Failure(), one->second->Seconds());
      one = this->AtWork.erase(one);
    }
    else
    {
      ++one;
    }
  }
}

void CohortJob::StopHere()
{
  for (auto& [number, work] : this->AtWork)
  {
    work->Stop();
  }
}

void CohortJob::Lead(std::vector<std::size_t> open)
{
  std::reverse(open.begin(), open.end()); // the next one is the last
  const int ranks = Ranks().Size();
  std::vector<int> busy(static_cast<std::size_t>(ranks), 0);
  const HasEnded ended = [&](std::size_t number, const std::string& failure, double seconds)
  {
    --busy[0];
    this->End(number, failure, seconds);
  };
  const auto begin = [&](int rank)
  {
    const std::size_t number = open.back();
    open.pop_back();
    this->Say(this->All.cases[number].name + ": begun" +
      (ranks > 1 ? " on rank " + std::to_string(rank) : ""));
    ++busy[static_cast<std::size_t>(rank)];
    if (rank > 0)
    {
      message::Send(rank, { { message::Kind, message::Do }, { "case", number } });
      return;
    }
    this->BeginHere(number, ended);
  };
  const auto stopAll = [&]
  {
    this->StopHere();
    for (int rank = 1; rank < ranks; ++rank)
    {
      message::Send(rank, { { message::Kind, message::Stop } });
    }
  };
  try
  {
    while (!open.empty() || std::any_of(busy.begin(), busy.end(), [](int n) { return n > 0; }))
    {
      ThrowIfInterrupted();
      for (int job = 0; job < this->Jobs; ++job)
      {
        for (int rank = 0; rank < ranks && !open.empty(); ++rank)
        {
          if (busy[static_cast<std::size_t>(rank)] <= job)
          {
            begin(rank);
          }
        }
      }
      this->LookHere(ended);
      int rank = 0;
      for (std::string text; Ranks().Receive(rank, text);)
      {
        const Json json = Json::parse(text);
        if (json[message::Kind] == message::Interrupted)
        {
          RememberInterruption(json["signal"].get<int>());
          break;
        }
        --busy[static_cast<std::size_t>(rank)];
        this->End(json["case"].get<std::size_t>(), json["failure"].get<std::string>(),
          json["seconds"].get<double>());
      }
      std::this_thread::sleep_for(Pause);
    }
  }
  catch (...)
  {
    stopAll();
    throw;
  }
  stopAll();
}

void CohortJob::Follow()
{
  const HasEnded ended = [](std::size_t number, const std::string& failure, double seconds)
  {
    message::Send(0,
      { { message::Kind, message::Ended }, { "case", number }, { "failure", failure },
        { "seconds", seconds } });
  };
  for (bool told = false;;) // of an interruption
  {
    int rank = 0;
    for (std::string text; Ranks().Receive(rank, text);)
    {
      const Json json = Json::parse(text);
      if (json[message::Kind] == message::Stop)
      {
        this->StopHere();
        return;
      }
      this->BeginHere(json["case"].get<std::size_t>(), ended);
    }
    if (Interruption() != 0 && !told)
    {
      // The first rank ends all; until then nothing is told here.
      message::Send(0, { { message::Kind, message::Interrupted }, { "signal", Interruption() } });
      told = true;
    }
    if (!told)
    {
      this->LookHere(ended);
    }
    std::this_thread::sleep_for(Pause);
  }
}

std::string CohortJob::WriteTables() const
{
  std::vector<std::string> words = { "evaluate", "--measure-cache",
    (fs::path(this->Output) / "measures").string(), "--output",
    (fs::path(this->Output) / "evaluation").string(), "--quiet", "--threads",
    std::to_string(this->Threads) };
  bool any = false;
  for (std::size_t n = 0; n < this->All.cases.size(); ++n)
  {
    const CohortCase& one = this->All.cases[n];
    if (this->States[n].state == "done" && one.HasTruth())
    {
      const CaseFolder folder(this->Output, one);
      words.insert(
        words.end(), { "--result", folder.result, "--truth", folder.truth, "--name", one.name });
      any = true;
    }
  }
  if (!any)
  {
    return "no case with a truth is done";
  }
  words.insert(words.end(), this->All.evaluate.begin(), this->All.evaluate.end());
  if (this->NoPictures)
  {
    words.emplace_back("--no-pictures");
  }
  const std::string log = (fs::path(this->Output) / "evaluation.txt").string();
  std::error_code ignored;
  fs::remove(log, ignored);
  ChildProcess process(ThisProgram, words, log);
  while (!process.HasEnded())
  {
    if (Interruption() != 0)
    {
      process.Signal(Interruption());
    }
    std::this_thread::sleep_for(Pause);
  }
  ThrowIfInterrupted();
  return process.ExitCode() == 0 ? "" : "the evaluation failed, see '" + log + "'";
}

void CohortJob::SayWhatIsToDo(
  const std::vector<std::size_t>& cases, const std::vector<bool>& toDo) const
{
  for (const std::size_t n : cases)
  {
    const CaseState& state = this->States[n];
    std::string why = "is to be done";
    if (!toDo[n])
    {
      why = state.state == "done" ? "is done" : "failed before: " + state.message;
    }
    else if (state.digest != this->Digests[n] && !state.digest.empty())
    {
      why = "is to be done: its settings or files have changed";
    }
    else if (state.state == "failed")
    {
      why = "is to be tried again";
    }
    std::printf("%s: %s\n", this->All.cases[n].name.c_str(), why.c_str());
  }
}

void CohortJob::Run()
{
  if (!this->Share.empty() && this->Share[0] > this->Share[1])
  {
    throw UsageError("--part: the first number must not be above the second");
  }
  UseThreads(0);
  this->All = ReadCohort(this->File);
  this->Output = fs::absolute(this->Output).lexically_normal().string();
  const std::vector<std::size_t> part = this->Part();
  std::vector<bool> toDo(this->All.cases.size(), false);
  std::vector<std::size_t> open;
  for (CohortCase& one : this->All.cases)
  {
    one.timeLimit = one.timeLimit > 0.0 ? one.timeLimit : this->TimeLimit;
    this->States.push_back(this->StateOf(one));
    this->Digests.push_back(DigestOf(one, this->All, this->Output));
  }
  for (const std::size_t n : part)
  {
    toDo[n] = this->IsToDo(this->States[n], this->Digests[n]);
    if (toDo[n])
    {
      open.push_back(n);
    }
  }
  this->Planned = open.size();
  if (this->DryRun)
  {
    if (Ranks().IsFirst())
    {
      this->SayWhatIsToDo(part, toDo);
    }
    return;
  }
  Ranks().Gather(""); // all have read what there is before anything changes
  if (!Ranks().IsFirst())
  {
    this->Follow();
    return;
  }
  fs::create_directories(this->Output);
  for (const std::size_t n : open)
  {
    // What was made of other settings is none of this cohort's.
    this->States[n] = {};
  }
  this->WriteList("");
  this->Lead(open);
  std::string failed;
  std::size_t failures = 0;
  std::size_t done = 0;
  for (const std::size_t n : part)
  {
    done += this->States[n].state == "done" ? 1 : 0;
    if (this->States[n].state == "failed")
    {
      ++failures;
      failed += (failed.empty() ? "" : ", ") + this->All.cases[n].name;
    }
  }
  std::string noTables = "a part of the cases makes none";
  if (this->Share.empty())
  {
    noTables = this->WriteTables();
    this->WriteList(noTables.empty() ? "evaluation/table1.csv" : "");
  }
  if (failures > 0)
  {
    throw std::runtime_error(std::to_string(failures) + " of " + std::to_string(part.size()) +
      " cases failed: " + failed + "; why is in '" + this->Output + "/" +
      (this->Share.empty() ? "cohort.json" : "NAME/case.json") + "'");
  }
  if (noTables.rfind("the evaluation failed", 0) == 0)
  {
    throw std::runtime_error(noTables);
  }
  if (!this->Quiet)
  {
    std::printf("%s: %zu cases done%s\n", this->Output.c_str(), done,
      noTables.empty() ? ", evaluation/table1.csv" : (", no tables: " + noTables).c_str());
  }
}
}

Command MakeCohortCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "cohort", "Many patients: run, and evaluate, each as a process of its own; Table 1 over all");
  app->footer(
    "Writes DIR/cohort.json, for each case DIR/NAME/ with run/, evaluation/, case.json and "
    "log.txt, "
    "and, of the cases that are done, DIR/evaluation/ as evaluate does. Started again it does what "
    "is not done. Exit code 1 when a case failed.");
  auto job = std::make_shared<CohortJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); }, true };
}
}
