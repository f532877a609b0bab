/**
 * @file CohortWork.h
 * @brief One case of a cohort at work: phantom, run and evaluate, one after the other, as child processes.
 */
#ifndef DynamicCoronary_CohortWork_h
#define DynamicCoronary_CohortWork_h

#include "ChildProcess.h"
#include "CohortCases.h"

#include <chrono>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// Where a case's files are, below the folder of the cohort.
struct CaseFolder
{
  CaseFolder(const std::string& cohort, const CohortCase& one);

  std::string path;
  std::string phantom;
  std::string result;     ///< of run
  std::string truth;      ///< of the case; empty: none
  std::string evaluation; ///< of this case alone
  std::string log;
  std::string measures; ///< of all cases
};

class CohortWork
{
public:
  /**
   * Begins with the first step that is not done yet.
   * @throws std::runtime_error when files can not be written or a process not be started
   */
  CohortWork(const CohortCase& one, const Cohort& cohort, const std::string& folder, int threads);

  /// Whether it has ended, well or not; goes on to the next step, and ends one that takes too long. Does not wait.
  bool HasEnded();

  /// Why it failed; empty: it is done.
  const std::string& Failure() const { return this->Message; }

  double Seconds() const;

  /// Asks the process to end, by SIGTERM, and, when it does not, ends it.
  void Stop();

private:
  using Clock = std::chrono::steady_clock;

  void Next();
  std::string WhatItSaid() const;

  const CohortCase& Case;
  const CaseFolder Folder;
  std::vector<std::vector<std::string>> Steps;
  std::size_t Step = 0;
  std::unique_ptr<ChildProcess> Process;
  std::string Message;
  std::uintmax_t LogBefore = 0;
  Clock::time_point Start = Clock::now();
};
}

#endif
