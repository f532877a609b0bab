#include "vtkMessageTrap.h"

#include "Interruption.h"

#include "vtkAlgorithm.h"
#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkInformation.h"
#include "vtkInformationDoubleVectorKey.h"
#include "vtkInformationVector.h"
#include "vtkLogger.h"
#include "vtkObjectFactory.h"
#include "vtkOutputWindow.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <utility>
#include <vector>

class vtkMessageTrap::Window : public vtkOutputWindow
{
public:
  static Window* New();
  vtkTypeMacro(Window, vtkOutputWindow);

  void DisplayText(const char*) override {}
  void DisplayErrorText(const char* text) override { this->Errors.push_back(Plain(text)); }
  void DisplayWarningText(const char* text) override { this->Warnings.push_back(Plain(text)); }
  void DisplayGenericWarningText(const char* text) override
  {
    this->Warnings.push_back(Plain(text));
  }

  std::vector<std::string> Errors;
  std::vector<std::string> Warnings;

private:
  // VTK puts "ERROR: In file, line n" and "vtkClass (address): " before what was said.
  static std::string Plain(std::string text)
  {
    const std::size_t preamble = text.find('\n');
    if (preamble != std::string::npos && text.find("In ") < preamble)
    {
      text.erase(0, preamble + 1);
    }
    const std::size_t name = text.find(' ');
    const std::size_t end = text.find("): ");
    if (end != std::string::npos && text.compare(name, 4, " (0x") == 0)
    {
      text.erase(0, end + 3);
    }
    text.erase(text.find_last_not_of(" \n") + 1);
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
  }
};

vtkStandardNewMacro(vtkMessageTrap::Window);

vtkMessageTrap::vtkMessageTrap()
  : Previous(vtkOutputWindow::GetInstance())
  , Verbosity(vtkLogger::GetCurrentVerbosityCutoff())
{
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  vtkOutputWindow::SetInstance(this->Trap);
}

vtkMessageTrap::~vtkMessageTrap()
{
  vtkOutputWindow::SetInstance(this->Previous);
  vtkLogger::SetStderrVerbosity(static_cast<vtkLogger::Verbosity>(this->Verbosity));
}

void vtkMessageTrap::PrintWarnings()
{
  for (const std::string& warning : std::exchange(this->Trap->Warnings, {}))
  {
    std::fprintf(stderr, "Warning: %s\n", warning.c_str());
  }
}

std::vector<std::string> vtkMessageTrap::TakeWarnings()
{
  return std::exchange(this->Trap->Warnings, {});
}

void vtkMessageTrap::ForgetWarnings()
{
  this->Trap->Warnings.clear();
}

void vtkMessageTrap::ThrowIfError()
{
  const std::vector<std::string> errors = std::exchange(this->Trap->Errors, {});
  if (!errors.empty())
  {
    throw std::runtime_error(errors.front());
  }
}

void WithProgress(vtkAlgorithm* algorithm, const std::function<void(double)>& report,
  const std::function<void()>& run)
{
  vtkNew<vtkCallbackCommand> observer;
  observer->SetClientData(const_cast<std::function<void(double)>*>(&report));
  observer->SetCallback(
    [](vtkObject* caller, unsigned long, void* data, void*)
    {
      auto* source = static_cast<vtkAlgorithm*>(caller);
      (*static_cast<const std::function<void(double)>*>(data))(source->GetProgress());
      if (coronary::Interruption() != 0)
      {
        source->SetAbortExecute(1);
      }
    });
  const unsigned long tag = algorithm->AddObserver(vtkCommand::ProgressEvent, observer);
  run();
  algorithm->RemoveObserver(tag);
  coronary::ThrowIfInterrupted();
}

std::vector<double> TimeSteps(vtkAlgorithm* algorithm)
{
  vtkInformation* info = algorithm->GetOutputInformation(0);
  vtkInformationDoubleVectorKey* key = vtkStreamingDemandDrivenPipeline::TIME_STEPS();
  const double* steps = info->Get(key);
  return steps ? std::vector<double>(steps, steps + info->Length(key)) : std::vector<double>();
}

void UpdateAtTime(vtkAlgorithm* algorithm, int port, double time, vtkMessageTrap& messages,
  const std::function<void(double)>& report)
{
  vtkNew<vtkInformationVector> requests;
  requests->SetNumberOfInformationObjects(port + 1);
  requests->GetInformationObject(port)->Set(
    vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), time);
  vtkTypeBool good = 0;
  WithProgress(algorithm, report, [&] { good = algorithm->Update(port, requests); });
  messages.ThrowIfError();
  if (!good)
  {
    throw std::runtime_error(std::string(algorithm->GetClassName()) + " failed");
  }
}
