#include "vtkRunMask.h"

#include "Interruption.h"
#include "MaskTrees.h"
#include "MetaImageWriter.h"
#include "SegmentationFile.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkRunSurface.h"
#include "vtkRunTrees.h"
#include "vtkSeeds.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkDataArray.h"
#include "vtkDataObject.h"
#include "vtkFastMarchingCenterline.h"
#include "vtkGatedImageReader.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkMatrix3x3.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;

/// Ostia where a mask touches an aorta are as good as the mask.
constexpr double TouchingConfidence = 0.7;

bool KeepGoing(double)
{
  return Interruption() == 0;
}

vtkSmartPointer<vtkImageData> ImageOf(
  const ImageGrid& grid, const std::vector<unsigned char>& voxels)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  int extent[6];
  std::copy(grid.extent.begin(), grid.extent.end(), extent);
  image->SetExtent(extent);
  image->SetOrigin(grid.origin[0], grid.origin[1], grid.origin[2]);
  image->SetSpacing(grid.spacing[0], grid.spacing[1], grid.spacing[2]);
  for (int row = 0; row < 3; ++row)
  {
    for (int column = 0; column < 3; ++column)
    {
      image->GetDirectionMatrix()->SetElement(row, column, grid.direction(row, column));
    }
  }
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  std::copy(voxels.begin(), voxels.end(), static_cast<unsigned char*>(image->GetScalarPointer()));
  image->GetPointData()->GetScalars()->SetName(vtkCoronaryArrayNames::VesselMask);
  return image;
}

/// Seeds of trees: the two largest are the left and the right one, as far as the side tells.
vtkSmartPointer<vtkPolyData> SeedsOf(const MaskTrees& found)
{
  std::vector<Vector3> positions;
  std::vector<std::string> names;
  for (const MaskTree& tree : found.trees)
  {
    positions.push_back(tree.seed);
  }
  if (positions.size() > 1)
  {
    const bool leftFirst = positions[0][0] > positions[1][0];
    names = { leftFirst ? "LCA" : "RCA", leftFirst ? "RCA" : "LCA" };
  }
  return MakeSeeds(positions, found.hasAorta ? TouchingConfidence : 0.5, names);
}
}

void NeedGivenMask(const RunStep& step)
{
  if (step.input.Mask)
  {
    return;
  }
  const std::string path = PathOf(step, "mask.mha");
  vtkNew<vtkGatedImageReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  step.input.Messages.ThrowIfError();
  step.input.Mask = vtkSmartPointer<vtkImageData>::New();
  step.input.Mask->ShallowCopy(reader->GetOutput());
  step.input.Mask->GetInformation()->Remove(vtkDataObject::DATA_TIME_STEP());
}

Json MakeGivenMask(RunStep& step)
{
  const RunSettings& settings = step.input.Settings;
  const std::vector<double>& given = step.input.Seeds;
  const SegmentationFile file(settings.mask);
  for (const std::string& notice : file.Warnings())
  {
    step.warnings.push_back("'" + settings.mask + "': " + notice);
  }
  const SegmentationMask mask = file.Mask(settings.maskSegments, KeepGoing);
  MaskTrees found;
  try
  {
    found = FindMaskTrees(mask.grid, mask.voxels, settings.maximumRadius,
      [&](double fraction)
      {
        step.progress(0.6 * fraction);
        return KeepGoing(fraction);
      });
  }
  catch (const std::invalid_argument& error)
  {
    throw std::runtime_error("'" + settings.mask + "': " + error.what() +
      "; choose segments with --mask-segment, or another --largest-radius.");
  }
  for (const std::string& remark : found.remarks)
  {
    step.warnings.push_back("'" + settings.mask + "': " + remark);
  }
  step.input.Mask = ImageOf(mask.grid, found.vessels);
  vtkSmartPointer<vtkPolyData> seeds;
  if (!given.empty())
  {
    seeds = SeedsOfSurface(nullptr, given);
  }
  else
  {
    seeds = SeedsOf(found);
    if (!found.hasAorta)
    {
      // Which end of its vessels a tree begins at is known when they are.
      vtkNew<vtkFastMarchingCenterline> centerline;
      centerline->SetInputDataObject(0, step.input.Mask);
      centerline->SetInputDataObject(1, seeds);
      centerline->SetImageKind(vtkFastMarchingCenterline::MaskImage);
      UpdateAtTime(centerline, 0, 0.0, step.input.Messages,
        [&](double fraction) { step.progress(0.6 + 0.3 * fraction); });
      if (centerline->GetOutput()->GetNumberOfCells() > 0)
      {
        MaskTrees ends = found;
        const auto widest = WidestEnds(centerline->GetOutput());
        ends.trees.clear();
        for (vtkIdType n = 0; n < widest->GetNumberOfPoints(); ++n)
        {
          ends.trees.push_back({ Vector3(widest->GetPoint(n)), 0.0 });
        }
        seeds = SeedsOf(ends);
      }
      step.warnings.push_back("'" + settings.mask +
        "' has no aorta: trees begin at their widest ends, which is a guess; --seed X Y Z says it");
    }
  }
  WriteMetaImage(
    step.Add("mask.mha"), mask.grid, found.vessels.data(), settings.compress, KeepGoing);
  WritePolyData(step.Add("ostia.vtp"), seeds, step.input.Messages);
  WritePolyData(step.Add("aorta.vtp"), vtkSmartPointer<vtkPolyData>::New(), step.input.Messages);
  char text[160];
  std::snprintf(text, sizeof(text), "%s%d %s in the given mask, %.0f mm in size",
    found.hasAorta ? "an aorta and " : "", static_cast<int>(found.trees.size()),
    found.trees.size() == 1 ? "tree" : "trees", found.size);
  step.summary = text;
  return { { "file", "mask.mha" }, { "given_mask", settings.mask }, { "given_voxels", mask.count },
    { "voxels", std::count(found.vessels.begin(), found.vessels.end(), 1) },
    { "aorta_mm3", found.aortaVolume }, { "size_mm", found.size },
    { "seeds", DescribeSeeds(seeds) }, { "lost", Json::array() }, { "seeds_file", "ostia.vtp" },
    { "aorta_file", "aorta.vtp" } };
}
}
