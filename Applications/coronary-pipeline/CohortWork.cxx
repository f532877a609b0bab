#include "CohortWork.h"

#include "AtomicFile.h"
#include "OptionChecks.h"

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// After a SIGTERM a process may take so long to put its files away.
constexpr auto Grace = 5s;

std::string ContentOf(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  return { std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>() };
}

std::string Joined(const std::vector<std::string>& words)
{
  std::string text;
  for (const std::string& word : words)
  {
    text += word + "\n";
  }
  return text;
}

/// What a process left there that was killed: nothing else works in a case's folder.
void RemoveUnfinished(const std::string& folder)
{
  std::error_code error;
  std::vector<fs::path> unfinished;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
  {
    if (entry.path().filename().string().rfind(".unfinished-", 0) == 0)
    {
      unfinished.push_back(entry.path());
    }
  }
  for (const fs::path& path : unfinished)
  {
    fs::remove_all(path, error);
  }
}
}

CaseFolder::CaseFolder(const std::string& cohort, const CohortCase& one)
  : path((fs::path(cohort) / one.name).string())
  , phantom((fs::path(path) / "phantom").string())
  , result((fs::path(path) / "run").string())
  , truth(one.IsPhantom() ? phantom : one.truth)
  , evaluation((fs::path(path) / "evaluation").string())
  , log((fs::path(path) / "log.txt").string())
  , measures((fs::path(cohort) / "measures").string())
{
}

CohortWork::CohortWork(
  const CohortCase& one, const Cohort& cohort, const std::string& folder, int threads)
  : Case(one)
  , Folder(folder, one)
{
  const std::string settings = (fs::path(this->Folder.path) / "settings.json").string();
  const std::string made = (fs::path(this->Folder.path) / "phantom.txt").string();
  std::error_code error;
  fs::create_directories(this->Folder.path, error);
  std::error_code ignored;
  fs::remove(this->Folder.log, ignored);
  for (const std::string* part :
    { &this->Folder.phantom, &this->Folder.result, &this->Folder.evaluation })
  {
    RemoveUnfinished(*part);
  }
  WriteFileAtomically(settings, one.run.dump(2) + "\n");
  const std::vector<std::string> usual = { "--threads", std::to_string(threads), "--quiet" };
  const auto add = [&](std::vector<std::string> words)
  {
    words.insert(words.end(), usual.begin(), usual.end());
    this->Steps.push_back(std::move(words));
  };
  std::vector<std::string> input = one.input;
  if (one.IsPhantom())
  {
    const std::string series = (fs::path(this->Folder.phantom) / "series.json").string();
    input = { series };
    if (!fs::exists(series, ignored) || ContentOf(made) != Joined(one.phantom))
    {
      // Whatever becomes of it, it is not the older one.
      fs::remove(series, ignored);
      WriteFileAtomically(made, Joined(one.phantom));
      std::vector<std::string> words = { "phantom" };
      words.insert(words.end(), one.phantom.begin(), one.phantom.end());
      words.insert(words.end(), { "--output", this->Folder.phantom });
      add(words);
    }
  }
  std::vector<std::string> run = { "run" };
  for (const std::string& path : input)
  {
    run.insert(run.end(), { "--input", path });
  }
  run.insert(run.end(), { "--settings", settings, "--output", this->Folder.result, "--resume" });
  add(run);
  if (one.HasTruth())
  {
    std::vector<std::string> words = { "evaluate", "--result", this->Folder.result, "--truth",
      this->Folder.truth, "--name", one.name, "--output", this->Folder.evaluation,
      "--measure-cache", this->Folder.measures, "--no-pictures" };
    words.insert(words.end(), cohort.evaluate.begin(), cohort.evaluate.end());
    add(words);
  }
  this->Next();
}

void CohortWork::Next()
{
  std::error_code ignored;
  this->LogBefore =
    fs::exists(this->Folder.log, ignored) ? fs::file_size(this->Folder.log, ignored) : 0;
  this->Process =
    std::make_unique<ChildProcess>(ThisProgram, this->Steps[this->Step], this->Folder.log);
}

double CohortWork::Seconds() const
{
  return std::chrono::duration<double>(Clock::now() - this->Start).count();
}

std::string CohortWork::WhatItSaid() const
{
  const std::string& command = this->Steps[this->Step].front();
  const int code = this->Process->ExitCode();
  if (code < 0)
  {
    return command + " was ended by signal " + std::to_string(-code) + " (" + strsignal(-code) +
      ")";
  }
  std::ifstream log(this->Folder.log, std::ios::binary);
  log.seekg(static_cast<std::streamoff>(this->LogBefore));
  const std::string begin = "coronary-pipeline ";
  std::string said;
  for (std::string line; std::getline(log, line);)
  {
    if (line.rfind(begin, 0) == 0)
    {
      said = line.substr(begin.size());
    }
  }
  return said.empty() ? command + " ended with exit code " + std::to_string(code) : said;
}

bool CohortWork::HasEnded()
{
  if (!this->Process || !this->Message.empty())
  {
    return true;
  }
  if (!this->Process->HasEnded())
  {
    if (this->Case.timeLimit > 0.0 && this->Seconds() > this->Case.timeLimit)
    {
      this->Stop();
      this->Message = this->Steps[this->Step].front() + " was ended after the time limit of " +
        Format(this->Case.timeLimit) + " s";
      return true;
    }
    return false;
  }
  if (this->Process->ExitCode() != 0)
  {
    this->Message = this->WhatItSaid();
    return true;
  }
  if (++this->Step == this->Steps.size())
  {
    this->Process.reset();
    return true;
  }
  try
  {
    this->Next();
  }
  catch (const std::runtime_error& error)
  {
    this->Message = error.what();
  }
  return !this->Message.empty();
}

void CohortWork::Stop()
{
  if (!this->Process)
  {
    return;
  }
  this->Process->Signal(SIGTERM);
  const auto last = Clock::now() + Grace;
  while (!this->Process->HasEnded() && Clock::now() < last)
  {
    std::this_thread::sleep_for(10ms);
  }
  this->Process.reset();
}
}
