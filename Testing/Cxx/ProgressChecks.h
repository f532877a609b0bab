/**
 * @file ProgressChecks.h
 * @brief How often a filter reports its progress, and how soon it stops, for the tests.
 */
#ifndef DynamicCoronary_ProgressChecks_h
#define DynamicCoronary_ProgressChecks_h

#include "ParallelFor.h"

#include "vtkAlgorithm.h"
#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkNew.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <limits>

/// The largest step from one report of progress to the next during an update. On one thread: with more,
/// the one that reports may be asleep while others work.
inline double MaximumProgressStep(vtkAlgorithm* algorithm)
{
  struct Seen
  {
    double last = 0.0;
    double maximum = 0.0;
  } seen;
  vtkNew<vtkCallbackCommand> watch;
  watch->SetClientData(&seen);
  watch->SetCallback(
    [](vtkObject* sender, unsigned long, void* data, void*)
    {
      auto& progress = *static_cast<Seen*>(data);
      const double now = static_cast<vtkAlgorithm*>(sender)->GetProgress();
      EXPECT_GE(now, progress.last - 1e-12);
      progress.maximum = std::max(progress.maximum, now - progress.last);
      progress.last = now;
    });
  const unsigned long tag = algorithm->AddObserver(vtkCommand::ProgressEvent, watch);
  coronary::SetNumberOfThreads(1);
  algorithm->Update();
  coronary::SetNumberOfThreads(0);
  algorithm->RemoveObserver(tag);
  EXPECT_EQ(seen.last, 1.0);
  return seen.maximum;
}

/// Updates, aborts when progress has come to `share`, and says how many seconds that took; no time at
/// all would be no number: the share was not reached. The next update is to run through again.
inline double SecondsToAbort(vtkAlgorithm* algorithm, double share)
{
  struct Plan
  {
    double share = 0.0;
    bool asked = false;
    std::chrono::steady_clock::time_point when{};
  } plan;
  plan.share = share;
  vtkNew<vtkCallbackCommand> stop;
  stop->SetClientData(&plan);
  stop->SetCallback(
    [](vtkObject* sender, unsigned long, void* data, void*)
    {
      auto& order = *static_cast<Plan*>(data);
      auto* caller = static_cast<vtkAlgorithm*>(sender);
      if (!order.asked && caller->GetProgress() >= order.share)
      {
        order.asked = true;
        order.when = std::chrono::steady_clock::now();
        caller->SetAbortExecute(1);
      }
    });
  const unsigned long tag = algorithm->AddObserver(vtkCommand::ProgressEvent, stop);
  algorithm->Update();
  const std::chrono::duration<double> late = std::chrono::steady_clock::now() - plan.when;
  algorithm->RemoveObserver(tag);
  algorithm->SetAbortExecute(0);
  return plan.asked ? late.count() : std::numeric_limits<double>::quiet_NaN();
}

#endif
