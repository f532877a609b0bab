#include "vtkSegmentationReader.h"

#include "MaskResampling.h"
#include "SegmentationFile.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix3x3.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

using SDDP = vtkStreamingDemandDrivenPipeline;

struct vtkSegmentationReader::Internals
{
  std::vector<std::string> FileNames;
  std::vector<std::string> Segments;
  std::vector<double> Fractions;
  coronary::ImageGrid Grid; ///< of the first file

  /// The times of the files. @throws std::invalid_argument
  std::vector<double> Times() const
  {
    const std::size_t count = this->FileNames.size();
    vtkCoronary::Require(count > 0, "FileNames: there are none");
    std::vector<double> times = this->Fractions;
    if (times.empty())
    {
      for (std::size_t n = 0; n < count; ++n)
      {
        times.push_back(static_cast<double>(n) / static_cast<double>(count));
      }
    }
    vtkCoronary::Require(times.size() == count,
      "PhaseFractions: " + std::to_string(times.size()) + " for " + std::to_string(count) +
        " files");
    for (std::size_t n = 0; n < count; ++n)
    {
      vtkCoronary::Require(std::isfinite(times[n]) && (n == 0 || times[n] > times[n - 1]),
        "PhaseFractions: they have to be finite and to increase");
    }
    return times;
  }
};

vtkStandardNewMacro(vtkSegmentationReader);

vtkSegmentationReader::vtkSegmentationReader()
  : State(std::make_unique<Internals>())
{
  this->SetNumberOfInputPorts(0);
}

vtkSegmentationReader::~vtkSegmentationReader() = default;

void vtkSegmentationReader::AddFileName(const char* name)
{
  if (name != nullptr && *name != '\0')
  {
    this->State->FileNames.emplace_back(name);
    this->Modified();
  }
}

void vtkSegmentationReader::RemoveAllFileNames()
{
  if (!this->State->FileNames.empty())
  {
    this->State->FileNames.clear();
    this->Modified();
  }
}

void vtkSegmentationReader::SetFileName(const char* name)
{
  this->RemoveAllFileNames();
  this->AddFileName(name);
}

void vtkSegmentationReader::AddSegment(const char* name)
{
  if (name != nullptr && *name != '\0')
  {
    this->State->Segments.emplace_back(name);
    this->Modified();
  }
}

void vtkSegmentationReader::RemoveAllSegments()
{
  if (!this->State->Segments.empty())
  {
    this->State->Segments.clear();
    this->Modified();
  }
}

void vtkSegmentationReader::SetNumberOfPhaseFractions(int number)
{
  this->State->Fractions.resize(static_cast<std::size_t>(std::max(number, 0)), 0.0);
  this->Modified();
}

void vtkSegmentationReader::SetPhaseFraction(int index, double fraction)
{
  if (index >= 0)
  {
    const auto at = static_cast<std::size_t>(index);
    this->State->Fractions.resize(std::max(this->State->Fractions.size(), at + 1), 0.0);
    this->State->Fractions[at] = fraction;
    this->Modified();
  }
}

void vtkSegmentationReader::RemoveAllPhaseFractions()
{
  this->SetNumberOfPhaseFractions(0);
}

int vtkSegmentationReader::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  try
  {
    const std::vector<double> times = this->State->Times();
    this->State->Grid = coronary::SegmentationFile(this->State->FileNames.front()).Grid();
    const coronary::ImageGrid& grid = this->State->Grid;
    vtkInformation* info = outputs->GetInformationObject(0);
    info->Set(SDDP::WHOLE_EXTENT(), grid.extent.data(), 6);
    info->Set(vtkDataObject::ORIGIN(), grid.origin.data(), 3);
    info->Set(vtkDataObject::SPACING(), grid.spacing.data(), 3);
    const coronary::Matrix3 rows = grid.direction.transpose();
    info->Set(vtkDataObject::DIRECTION(), rows.data(), 9);
    info->Set(SDDP::TIME_STEPS(), times.data(), static_cast<int>(times.size()));
    const double range[2] = { times.front(), times.back() };
    info->Set(SDDP::TIME_RANGE(), range, 2);
    vtkDataObject::SetPointDataActiveScalarInfo(info, VTK_UNSIGNED_CHAR, 1);
    return 1;
  }
  catch (const std::exception& error)
  {
    // ParaView asks for data even now, and the executive would complain of a missing extent.
    const std::array<int, 6> empty{ 0, -1, 0, -1, 0, -1 };
    outputs->GetInformationObject(0)->Set(SDDP::WHOLE_EXTENT(), empty.data(), 6);
    return vtkCoronary::ReportEmptied(this, error.what());
  }
}

int vtkSegmentationReader::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  try
  {
    const std::vector<double> times = this->State->Times();
    vtkInformation* info = outputs->GetInformationObject(0);
    std::size_t phase = 0;
    if (info->Has(SDDP::UPDATE_TIME_STEP()))
    {
      const double wanted = info->Get(SDDP::UPDATE_TIME_STEP());
      for (std::size_t n = 1; n < times.size(); ++n)
      {
        phase = std::abs(times[n] - wanted) < std::abs(times[phase] - wanted) ? n : phase;
      }
    }
    const std::string& path = this->State->FileNames[phase];
    const coronary::ImageGrid& grid = this->State->Grid;
    const coronary::SegmentationMask mask =
      coronary::SegmentationFile(path).Mask(this->State->Segments,
        [this](double fraction)
        {
          this->UpdateProgress(fraction);
          return this->GetAbortExecute() == 0;
        });
    coronary::ResampledMask fitted;
    try
    {
      fitted = coronary::ResampleMask(mask.grid, mask.voxels, grid);
    }
    catch (const std::invalid_argument& error)
    {
      throw std::runtime_error("'" + path + "': " + error.what() + ".");
    }
    if (fitted.insideShare < 1.0)
    {
      vtkWarningMacro(<< "'" << path << "': " << 100.0 * (1.0 - fitted.insideShare)
                      << " % of the mask lie outside of the voxels of '"
                      << this->State->FileNames.front() << "'.");
    }
    vtkImageData* image = vtkImageData::GetData(outputs);
    image->SetExtent(const_cast<int*>(grid.extent.data()));
    image->SetOrigin(grid.origin[0], grid.origin[1], grid.origin[2]);
    image->SetSpacing(grid.spacing[0], grid.spacing[1], grid.spacing[2]);
    const coronary::Matrix3 rows = grid.direction.transpose();
    image->SetDirectionMatrix(rows.data());
    image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
    std::copy(fitted.voxels.begin(), fitted.voxels.end(),
      static_cast<unsigned char*>(image->GetScalarPointer()));
    image->GetPointData()->GetScalars()->SetName(vtkCoronaryArrayNames::VesselMask);
    vtkCoronary::AddArray<vtkDoubleArray>(
      image->GetFieldData(), vtkCoronaryArrayNames::PhaseTime, std::vector<double>{ times[phase] });
    image->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), times[phase]);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the mask");
  }
}

void vtkSegmentationReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  const auto list = [&](const char* title, const std::vector<std::string>& names)
  {
    os << indent << title << ": " << names.size() << "\n";
    for (const std::string& name : names)
    {
      os << indent.GetNextIndent() << name << "\n";
    }
  };
  list("FileNames", this->State->FileNames);
  list("Segments", this->State->Segments);
  os << indent << "PhaseFractions: " << this->State->Fractions.size() << "\n";
}
