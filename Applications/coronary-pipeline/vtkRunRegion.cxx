#include "vtkRunRegion.h"

#include "CoronaryOstia.h"
#include "HeartRegion.h"
#include "Interruption.h"
#include "RankGroup.h"
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
#include <stdexcept>
#include <vector>

namespace coronary
{
using Json = nlohmann::ordered_json;

void FindHeart(RunStep& step)
{
  RunInput& input = step.input;
  const RunSettings& settings = input.Settings;
  vtkImageData* image = input.Reference;
  double range[2];
  image->GetScalarRange(range);
  // With c measured the region would have a say in it.
  if (!input.Seeds.empty() || input.HasMasks() || settings.beyondMask || !(settings.c > 0.0) ||
    range[1] - range[0] < LeastRangeOfHU)
  {
    return;
  }
  std::vector<float> copy;
  const ScalarImage voxels =
    vtkCoronary::ScalarImageOf(image, image->GetPointData()->GetScalars(), copy);
  const auto progress = [&](double fraction)
  {
    step.progress(fraction);
    return Interruption() == 0;
  };
  try
  {
    input.Ostia = std::make_shared<CoronaryOstia>(FindCoronaryOstia(voxels, {}, progress));
  }
  catch (const std::invalid_argument&)
  {
    // Who needs the image says what is wrong with it.
    return;
  }
  if (input.Ostia->ostia.size() < 2 || !input.Ostia->doubt.empty())
  {
    return;
  }
  std::vector<Vector3> places;
  for (const CoronaryOstium& ostium : input.Ostia->ostia)
  {
    places.push_back(ostium.position);
  }
  input.Region = std::make_shared<HeartRegion>(voxels, places, progress);
}

vtkSmartPointer<vtkImageData> HeartMask(RunStep& step)
{
  RunInput& input = step.input;
  const std::string blocks =
    step.ranks.FromFirst(input.Region ? input.Region->Blocks() : std::string());
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
  HeartRegion(vtkCoronary::GridOf(mask), blocks)
    .Fill(static_cast<unsigned char*>(mask->GetScalarPointer()));
  return mask;
}

Json DescribeRegion(const RunStep& step)
{
  const bool heart = step.input.Region != nullptr;
  return { { "kind", heart ? "heart" : "whole image" },
    { "share", heart ? step.input.Region->Share() : 1.0 } };
}
}
