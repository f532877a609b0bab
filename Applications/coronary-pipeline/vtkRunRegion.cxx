#include "vtkRunRegion.h"

#include "CoronaryOstia.h"
#include "HeartRegion.h"
#include "Interruption.h"
#include "LargePages.h"
#include "ParallelFor.h"
#include "Ranks.h"
#include "RunSettings.h"
#include "vtkGatedImageReader.h"

#include "vtkCoronaryFilterParts.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationDoubleVectorKey.h"
#include "vtkInformationIntegerVectorKey.h"
#include "vtkPointData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace coronary
{
using Json = nlohmann::ordered_json;

void RangeOf(vtkImageData* image, double range[2])
{
  std::vector<float> copy;
  const ScalarImage voxels =
    vtkCoronary::ScalarImageOf(image, image->GetPointData()->GetScalars(), copy);
  const std::int64_t slices = voxels.Dimensions()[2];
  const std::int64_t slice = voxels.NumberOfVoxels() / std::max<std::int64_t>(1, slices);
  std::vector<double> minimum(static_cast<std::size_t>(slices), VTK_DOUBLE_MAX);
  std::vector<double> maximum(static_cast<std::size_t>(slices), VTK_DOUBLE_MIN);
  std::visit(
    [&](const auto* values)
    {
      ParallelFor(slices, 4,
        [&](std::int64_t first, std::int64_t last)
        {
          for (std::int64_t k = first; k < last; ++k)
          {
            // What is no number compares with nothing.
            auto low = std::numeric_limits<std::decay_t<decltype(*values)>>::max();
            auto high = std::numeric_limits<std::decay_t<decltype(*values)>>::lowest();
            for (std::int64_t v = k * slice; v < (k + 1) * slice; ++v)
            {
              low = values[v] < low ? values[v] : low;
              high = values[v] > high ? values[v] : high;
            }
            minimum[k] = low;
            maximum[k] = high;
          }
        });
    },
    voxels.values);
  range[0] = slices > 0 ? *std::min_element(minimum.begin(), minimum.end()) : VTK_DOUBLE_MAX;
  range[1] = slices > 0 ? *std::max_element(maximum.begin(), maximum.end()) : VTK_DOUBLE_MIN;
}

void RequireOstia(const RunStep& step, const std::vector<double>& confidences)
{
  const auto best = std::max_element(confidences.begin(), confidences.end());
  if (best == confidences.end() || *best >= MinimumOstialConfidence)
  {
    return;
  }
  double range[2];
  RangeOf(step.input.Reference, range);
  char text[300];
  std::snprintf(text, sizeof(text),
    "no coronary ostium was found: the likeliest place has a confidence of %.2f. %s. Give the "
    "ostia with --seed X Y Z (LPS, mm) when the vessels are to be seen",
    *best,
    range[0] >= 0.0
      ? "No value is below 0, where HU have fat and air: take off what was added to them (1024, "
        "mostly)"
      : "It may have no contrast medium in the aorta, or not show the ascending aorta");
  throw std::runtime_error("'" + step.input.Chosen->image + "': " + text + ".");
}

void FindOstia(const RunStep& step, const std::function<void(double)>& progress)
{
  RunInput& input = step.input;
  if (input.Ostia)
  {
    return;
  }
  double range[2];
  RangeOf(input.Reference, range);
  if (range[1] - range[0] < MinimumRangeOfHU)
  {
    return;
  }
  std::vector<float> copy;
  const ScalarImage voxels = vtkCoronary::ScalarImageOf(
    input.Reference, input.Reference->GetPointData()->GetScalars(), copy);
  const auto go = [&](double fraction)
  {
    if (progress)
    {
      progress(fraction);
    }
    return Interruption() == 0;
  };
  try
  {
    input.Ostia = std::make_shared<CoronaryOstia>(FindCoronaryOstia(voxels, {}, go));
  }
  catch (const std::invalid_argument&)
  {
    // Who needs the image says what is wrong with it.
  }
}

void FindHeart(RunStep& step)
{
  RunInput& input = step.input;
  const RunSettings& settings = input.Settings;
  // With c measured the region would have a say in it.
  if (!input.Seeds.empty() || input.HasMasks() || settings.beyondMask || !(settings.c > 0.0))
  {
    return;
  }
  FindOstia(step, step.progress);
  if (!input.Ostia)
  {
    return;
  }
  std::vector<double> confidences;
  for (const CoronaryOstium& ostium : input.Ostia->ostia)
  {
    confidences.push_back(ostium.confidence);
  }
  RequireOstia(step, confidences);
  if (input.Ostia->ostia.size() < 2 || !input.Ostia->doubt.empty())
  {
    return;
  }
  std::vector<Vector3> places;
  for (const CoronaryOstium& ostium : input.Ostia->ostia)
  {
    places.push_back(ostium.position);
  }
  std::vector<float> copy;
  const ScalarImage voxels = vtkCoronary::ScalarImageOf(
    input.Reference, input.Reference->GetPointData()->GetScalars(), copy);
  input.Region = std::make_shared<HeartRegion>(voxels, places,
    [&](double fraction)
    {
      step.progress(fraction);
      return Interruption() == 0;
    });
}

vtkSmartPointer<vtkImageData> HeartMask(RunStep& step)
{
  RunInput& input = step.input;
  const std::string blocks =
    Ranks().FromFirst(input.Region ? input.Region->Blocks() : std::string());
  if (blocks.empty())
  {
    return nullptr;
  }
  using SDDP = vtkStreamingDemandDrivenPipeline;
  auto mask = vtkSmartPointer<vtkImageData>::New();
  if (input.Reference)
  {
    mask->CopyStructure(input.Reference);
  }
  else
  {
    vtkInformation* info = input.Reader->GetOutputInformation(0);
    int extent[6];
    info->Get(SDDP::WHOLE_EXTENT(), extent);
    mask->SetExtent(extent);
    mask->SetOrigin(info->Get(vtkDataObject::ORIGIN()));
    mask->SetSpacing(info->Get(vtkDataObject::SPACING()));
    mask->SetDirectionMatrix(info->Get(vtkDataObject::DIRECTION()));
  }
  mask->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  auto* voxels = static_cast<unsigned char*>(mask->GetScalarPointer());
  PreferLargePages(voxels, static_cast<std::size_t>(mask->GetNumberOfPoints()));
  HeartRegion(vtkCoronary::GridOf(mask), blocks).Fill(voxels);
  return mask;
}

Json DescribeRegion(const RunStep& step)
{
  const bool heart = step.input.Region != nullptr;
  return { { "kind", heart ? "heart" : "whole image" },
    { "share", heart ? step.input.Region->Share() : 1.0 } };
}
}
