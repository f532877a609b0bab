/**
 * @file FilterMessages.h
 * @brief What a filter reports, and what is expected of every filter, for the tests.
 */
#ifndef DynamicCoronary_FilterMessages_h
#define DynamicCoronary_FilterMessages_h

#include "vtkAlgorithm.h"
#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkExecutive.h"
#include "vtkNew.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

/// Collects errors and warnings while it lives, and keeps them from the console. The algorithm lives
/// longer.
class Messages
{
public:
  explicit Messages(vtkAlgorithm* algorithm)
  {
    this->Collect(algorithm, vtkCommand::ErrorEvent, this->Errors);
    this->Collect(algorithm, vtkCommand::WarningEvent, this->Warnings);
    // The executive adds that the request failed.
    this->Collect(algorithm->GetExecutive(), vtkCommand::ErrorEvent, this->Echoes);
  }

  ~Messages()
  {
    for (const auto& [sender, tag] : this->Observers)
    {
      sender->RemoveObserver(tag);
    }
  }

  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;

  bool HasError(const std::string& part) const { return Has(this->Errors, part); }
  bool HasWarning(const std::string& part) const { return Has(this->Warnings, part); }

  std::vector<std::string> Errors;
  std::vector<std::string> Warnings;
  std::vector<std::string> Echoes;

private:
  static bool Has(const std::vector<std::string>& texts, const std::string& part)
  {
    return std::any_of(texts.begin(), texts.end(),
      [&](const std::string& text) { return text.find(part) != std::string::npos; });
  }

  void Collect(vtkObject* sender, unsigned long event, std::vector<std::string>& messages)
  {
    vtkNew<vtkCallbackCommand> observer;
    observer->SetClientData(&messages);
    observer->SetCallback([](vtkObject*, unsigned long, void* list, void* text)
      { static_cast<std::vector<std::string>*>(list)->emplace_back(static_cast<char*>(text)); });
    this->Observers.emplace_back(sender, sender->AddObserver(event, observer));
  }

  std::vector<std::pair<vtkObject*, unsigned long>> Observers;
};

/// The next update is one error that has `part` in it.
/// @param update  asks the algorithm for its data; without it, Update()
inline void ExpectFilterError(
  vtkAlgorithm* algorithm, const std::string& part, const std::function<void()>& update = nullptr)
{
  Messages messages(algorithm);
  if (update)
  {
    update();
  }
  else
  {
    algorithm->Update();
  }
  ASSERT_EQ(messages.Errors.size(), 1U);
  EXPECT_NE(messages.Errors[0].find(part), std::string::npos) << messages.Errors[0];
}

/// Updates, and aborts at the first report of progress. The next update is to run through again.
inline void UpdateAborted(vtkAlgorithm* algorithm)
{
  vtkNew<vtkCallbackCommand> stop;
  stop->SetCallback([](vtkObject* sender, unsigned long, void*, void*)
    { static_cast<vtkAlgorithm*>(sender)->SetAbortExecute(1); });
  const unsigned long tag = algorithm->AddObserver(vtkCommand::ProgressEvent, stop);
  algorithm->Update();
  algorithm->RemoveObserver(tag);
  algorithm->SetAbortExecute(0);
}

#endif
