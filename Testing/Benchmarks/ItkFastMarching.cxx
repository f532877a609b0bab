#include "ItkFastMarching.h"

#include <itkFastMarchingImageFilter.h>
#include <itkImage.h>

namespace coronary
{
std::shared_ptr<const float> ItkFastMarching(const float* speed,
  const std::array<int, 3>& dimensions, const std::array<double, 3>& spacing,
  const std::array<int, 3>& seed)
{
  using ImageType = itk::Image<float, 3>;
  using FilterType = itk::FastMarchingImageFilter<ImageType, ImageType>;
  ImageType::SizeType size;
  ImageType::IndexType index;
  for (unsigned int axis = 0; axis < 3; ++axis)
  {
    size[axis] = static_cast<itk::SizeValueType>(dimensions[axis]);
    index[axis] = seed[axis];
  }
  auto input = ImageType::New();
  input->SetRegions(ImageType::RegionType(size));
  input->SetSpacing(spacing.data());
  // The image only looks at the voxels.
  input->GetPixelContainer()->SetImportPointer(
    const_cast<float*>(speed), size[0] * size[1] * size[2], false);
  auto filter = FilterType::New();
  auto trial = FilterType::NodeContainer::New();
  FilterType::NodeType node;
  node.SetIndex(index);
  node.SetValue(0.0F);
  trial->InsertElement(0, node);
  filter->SetTrialPoints(trial);
  filter->SetInput(input);
  filter->Update();
  const ImageType::Pointer output = filter->GetOutput();
  return { output->GetBufferPointer(), [output](const float*) {} };
}
}
