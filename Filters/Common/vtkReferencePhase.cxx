#include "vtkReferencePhase.h"

#include "Numbers.h"
#include "ParallelFor.h"
#include "QuietestPhase.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"

#include "vtkCompositeDataIterator.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

using vtkCoronary::Moment;
using SDDP = vtkStreamingDemandDrivenPipeline;

using coronary::NaN;

namespace
{
constexpr int SampledSlices = 16;
constexpr int BlockEdge = 4;

/// Means over blocks of voxels; blocks at the far sides may be smaller.
void SampleImage(vtkImageData* image, const std::array<int, 6>& part, std::vector<float>& samples)
{
  vtkDataArray* array = image->GetPointData()->GetScalars();
  for (int n = 0; !array && n < image->GetPointData()->GetNumberOfArrays(); ++n)
  {
    array = image->GetPointData()->GetArray(n);
  }
  if (!array)
  {
    throw std::runtime_error("the image has no point array by which phases could be compared");
  }
  for (int k = part[4]; k <= part[5]; k += BlockEdge)
  {
    for (int j = part[2]; j <= part[3]; j += BlockEdge)
    {
      for (int i = part[0]; i <= part[1]; i += BlockEdge)
      {
        double sum = 0.0;
        int count = 0;
        for (int z = k; z < k + BlockEdge && z <= part[5]; ++z)
        {
          for (int y = j; y < j + BlockEdge && y <= part[3]; ++y)
          {
            for (int x = i; x < i + BlockEdge && x <= part[1]; ++x)
            {
              int at[3] = { x, y, z };
              sum += array->GetComponent(image->ComputePointId(at), 0);
              ++count;
            }
          }
        }
        samples.push_back(static_cast<float>(sum / count));
      }
    }
  }
}

void SamplePoints(vtkPointSet* points, std::vector<float>& samples)
{
  for (vtkIdType n = 0; n < points->GetNumberOfPoints(); ++n)
  {
    const double* position = points->GetPoint(n);
    samples.insert(samples.end(), position, position + 3);
  }
}

/// All of it in the extent that was asked for; of composite data leaf by leaf.
void Sample(vtkDataObject* data, const std::array<int, 6>* part, std::vector<float>& samples)
{
  if (auto* image = vtkImageData::SafeDownCast(data))
  {
    std::array<int, 6> available;
    image->GetExtent(available.data());
    for (int axis = 0; part && axis < 3; ++axis)
    {
      available[2 * axis] = std::max(available[2 * axis], (*part)[2 * axis]);
      available[2 * axis + 1] = std::min(available[2 * axis + 1], (*part)[2 * axis + 1]);
    }
    SampleImage(image, available, samples);
  }
  else if (auto* points = vtkPointSet::SafeDownCast(data))
  {
    SamplePoints(points, samples);
  }
  else if (auto* composite = vtkCompositeDataSet::SafeDownCast(data))
  {
    const auto leaf = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
    for (leaf->InitTraversal(); !leaf->IsDoneWithTraversal(); leaf->GoToNextItem())
    {
      Sample(leaf->GetCurrentDataObject(), nullptr, samples);
    }
  }
  else
  {
    throw std::runtime_error(std::string("Automatic compares images or point sets, not ") +
      data->GetClassName() + ": switch it off and give Time");
  }
}

/// The middle slices; false for data without extents.
bool SampledExtent(vtkInformation* inInfo, std::array<int, 6>& part)
{
  if (!inInfo->Has(SDDP::WHOLE_EXTENT()))
  {
    return false;
  }
  inInfo->Get(SDDP::WHOLE_EXTENT(), part.data());
  const int depth = part[5] - part[4] + 1;
  part[4] += std::max(0, (depth - SampledSlices) / 2);
  part[5] = std::min(part[5], part[4] + SampledSlices - 1);
  return true;
}

std::vector<double> Steps(vtkInformation* info)
{
  if (!info->Has(SDDP::TIME_STEPS()))
  {
    return {};
  }
  const double* steps = info->Get(SDDP::TIME_STEPS());
  return { steps, steps + info->Length(SDDP::TIME_STEPS()) };
}
}

struct vtkReferencePhase::Internals
{
  // What was found, and of which input.
  bool Found = false;
  vtkMTimeType FoundOf = 0;
  std::vector<double> FoundAmong;
  double FoundTime = 0.0;

  bool Knows(vtkInformation* inInfo) const
  {
    return this->Found && this->FoundOf == vtkCoronary::UpstreamTime(inInfo) &&
      this->FoundAmong == Steps(inInfo);
  }
};

vtkStandardNewMacro(vtkReferencePhase);

vtkReferencePhase::vtkReferencePhase()
  : UsedTime(NaN)
  , Data(new Internals)
{
}

vtkReferencePhase::~vtkReferencePhase() = default;

int vtkReferencePhase::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkDataObject");
  return 1;
}

vtkTypeBool vtkReferencePhase::ProcessRequest(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  if (request->Has(SDDP::REQUEST_UPDATE_TIME()) || request->Has(SDDP::REQUEST_UPDATE_EXTENT()))
  {
    // As far as it is known: RequestData finds the quietest phase, and judges what was given.
    vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
    Moment moment =
      vtkCoronary::NearestMoment(inInfo, this->Automatic || !std::isfinite(this->Time), this->Time);
    if (this->Automatic && this->Data->Knows(inInfo))
    {
      moment.time = this->Data->FoundTime;
    }
    else if (this->Automatic && moment.exists && request->Has(SDDP::REQUEST_UPDATE_EXTENT()))
    {
      // The first of the steps that will be compared.
      std::array<int, 6> part;
      if (SampledExtent(inInfo, part))
      {
        vtkCoronary::SetRequest(inInfo, part);
      }
    }
    if (moment.exists)
    {
      inInfo->Set(SDDP::UPDATE_TIME_STEP(), moment.time);
    }
    else
    {
      inInfo->Remove(SDDP::UPDATE_TIME_STEP());
    }
    return 1;
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

int vtkReferencePhase::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  outInfo->Remove(SDDP::TIME_STEPS());
  outInfo->Remove(SDDP::TIME_RANGE());
  outInfo->Remove(SDDP::TIME_DEPENDENT_INFORMATION());
  return 1;
}

int vtkReferencePhase::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  vtkDataObject* output = vtkDataObject::GetData(outInfo);
  try
  {
    const std::vector<double> steps = Steps(inInfo);
    Moment moment =
      vtkCoronary::NearestMoment(inInfo, this->Automatic || !std::isfinite(this->Time), this->Time);
    if (moment.exists && !this->Automatic)
    {
      if (!std::isfinite(this->Time))
      {
        throw std::runtime_error("Time must be finite");
      }
    }
    else if (moment.exists && !this->Data->Knows(inInfo))
    {
      if (steps.empty())
      {
        throw std::runtime_error(
          "Automatic needs an input with time steps: switch it off and give Time");
      }
      const vtkMTimeType of = vtkCoronary::UpstreamTime(inInfo);
      vtkCoronary::UpstreamRequest request(inInfo, outInfo);
      std::array<int, 6> part = { 0, -1, 0, -1, 0, -1 };
      const bool structured = SampledExtent(inInfo, part);
      const auto progress = vtkCoronary::ProgressOf(this);
      std::vector<std::vector<float>> samples;
      for (const double step : steps)
      {
        moment.time = step;
        request.Ask(structured ? &part : nullptr, moment);
        samples.emplace_back();
        Sample(vtkDataObject::GetData(inInfo), structured ? &part : nullptr, samples.back());
        coronary::Report(
          progress, static_cast<double>(samples.size()) / static_cast<double>(steps.size()));
      }
      moment.time = steps[coronary::QuietestPhase(steps, samples)];
      request.Restore(&moment);
      this->Data->Found = true;
      this->Data->FoundOf = of;
      this->Data->FoundAmong = steps;
      this->Data->FoundTime = moment.time;
    }
    else if (moment.exists)
    {
      moment.time = this->Data->FoundTime;
    }

    output->ShallowCopy(vtkDataObject::GetData(inInfo));
    this->UsedTime = moment.exists ? moment.time : NaN;
    if (moment.exists && !output->GetFieldData()->HasArray(vtkCoronaryArrayNames::PhaseTime))
    {
      // A field data of its own: that of the input is shared.
      vtkNew<vtkFieldData> fields;
      fields->ShallowCopy(output->GetFieldData());
      vtkNew<vtkDoubleArray> phase;
      phase->SetName(vtkCoronaryArrayNames::PhaseTime);
      phase->InsertNextValue(moment.time);
      fields->AddArray(phase);
      output->SetFieldData(fields);
    }
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the phase");
  }
}

void vtkReferencePhase::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Automatic: " << this->Automatic << "\n";
  os << indent << "Time: " << this->Time << "\n";
  os << indent << "UsedTime: " << this->UsedTime << "\n";
}
