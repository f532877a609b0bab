#include "vtkTimedPolyData.h"

#include "Command.h"
#include "FileSeries.h"
#include "Interruption.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>

using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkTimedPolyData);

vtkTimedPolyData::vtkTimedPolyData()
{
  this->SetNumberOfInputPorts(0);
}

vtkTimedPolyData::~vtkTimedPolyData() = default;

void vtkTimedPolyData::Add(double time, vtkPolyData* data)
{
  this->Times.push_back(time);
  this->Steps.emplace_back(data);
  this->Modified();
}

bool vtkTimedPolyData::Find(const char* fieldArray) const
{
  return !this->Steps.empty() && this->Steps.front()->GetFieldData()->HasArray(fieldArray) != 0;
}

double vtkTimedPolyData::CycleSeconds() const
{
  vtkDataArray* length = this->Steps.empty()
    ? nullptr
    : this->Steps.front()->GetFieldData()->GetArray(vtkCoronaryArrayNames::CycleLength);
  const double seconds = length && length->GetNumberOfValues() > 0 ? length->GetTuple1(0) : 0.0;
  return seconds > 0.0 && std::isfinite(seconds) ? seconds : 1.0;
}

int vtkTimedPolyData::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  if (this->Times.empty())
  {
    return 1;
  }
  vtkInformation* info = outputs->GetInformationObject(0);
  info->Set(SDDP::TIME_STEPS(), this->Times.data(), static_cast<int>(this->Times.size()));
  const double range[2] = { this->Times.front(), this->Times.back() };
  info->Set(SDDP::TIME_RANGE(), range, 2);
  return 1;
}

int vtkTimedPolyData::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  if (this->Times.empty())
  {
    return 1;
  }
  vtkInformation* info = outputs->GetInformationObject(0);
  std::size_t step = 0;
  if (info->Has(SDDP::UPDATE_TIME_STEP()))
  {
    const auto after =
      std::upper_bound(this->Times.begin(), this->Times.end(), info->Get(SDDP::UPDATE_TIME_STEP()));
    step =
      after == this->Times.begin() ? 0 : static_cast<std::size_t>(after - this->Times.begin() - 1);
  }
  vtkPolyData* output = vtkPolyData::GetData(outputs);
  output->ShallowCopy(this->Steps[step]);
  output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), this->Times[step]);
  return 1;
}

namespace coronary
{
vtkSmartPointer<vtkTimedPolyData> ReadTimedPolyData(
  const std::vector<std::string>& paths, const std::vector<double>& times, vtkMessageTrap& messages)
{
  std::vector<TimedFile> files;
  const bool list =
    paths.size() == 1 && (EndsWith(paths[0], ".series") || EndsWith(paths[0], ".pvd"));
  if (list)
  {
    if (!times.empty())
    {
      throw UsageError("--pose-times: '" + paths[0] + "' has its times already");
    }
    files = ReadFileSeries(paths[0]);
  }
  else
  {
    for (const std::string& path : paths)
    {
      if (!EndsWith(path, ".vtp"))
      {
        throw UsageError(
          "--poses: one .series or .pvd file, or .vtp files; '" + path + "' is neither");
      }
    }
    if (times.size() != paths.size())
    {
      throw UsageError("--pose-times: " + std::to_string(paths.size()) +
        " files need as many times, " + std::to_string(times.size()) + " were given");
    }
    for (std::size_t n = 0; n < paths.size(); ++n)
    {
      if (n > 0 && !(times[n] > times[n - 1]))
      {
        throw UsageError("--pose-times: they have to increase");
      }
      files.push_back({ paths[n], times[n] });
    }
  }
  auto source = vtkSmartPointer<vtkTimedPolyData>::New();
  for (const TimedFile& file : files)
  {
    ThrowIfInterrupted();
    source->Add(file.time, ReadPolyData(file.path, messages));
  }
  return source;
}
}
