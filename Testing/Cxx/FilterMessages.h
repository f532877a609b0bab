/**
 * @file FilterMessages.h
 * @brief What a filter reports, for the tests.
 */
#ifndef DynamicCoronary_FilterMessages_h
#define DynamicCoronary_FilterMessages_h

#include "vtkAlgorithm.h"
#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkExecutive.h"
#include "vtkNew.h"

#include <algorithm>
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

#endif
