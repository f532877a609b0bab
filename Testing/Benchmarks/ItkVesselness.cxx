#include "ItkVesselness.h"

#include <itkHessianToObjectnessMeasureImageFilter.h>
#include <itkImage.h>
#include <itkMultiScaleHessianBasedMeasureImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkSymmetricSecondRankTensor.h>
#include <itkVersion.h>

namespace coronary
{
namespace
{
using ImageType = itk::Image<float, 3>;

template <typename Component>
std::shared_ptr<const float> Filter(ImageType* input, const ItkVesselnessSettings& settings)
{
  using TensorImageType = itk::Image<itk::SymmetricSecondRankTensor<Component, 3>, 3>;
  using ObjectnessType = itk::HessianToObjectnessMeasureImageFilter<TensorImageType, ImageType>;
  using MultiScaleType =
    itk::MultiScaleHessianBasedMeasureImageFilter<ImageType, TensorImageType, ImageType>;

  auto objectness = ObjectnessType::New();
  objectness->SetObjectDimension(1);
  objectness->SetBrightObject(settings.bright);
  objectness->SetAlpha(settings.alpha);
  objectness->SetBeta(settings.beta);
  objectness->SetGamma(settings.c);
  objectness->SetScaleObjectnessMeasure(false);
  auto filter = MultiScaleType::New();
  filter->SetHessianToMeasureFilter(objectness);
  filter->SetSigmaMinimum(settings.sigmaMin);
  filter->SetSigmaMaximum(settings.sigmaMax);
  filter->SetNumberOfSigmaSteps(settings.scales);
  filter->SetSigmaStepMethodToEquispaced();
  filter->SetInput(input);
  filter->Update();
  const ImageType::Pointer output = filter->GetOutput();
  return { output->GetBufferPointer(), [output](const float*) {} };
}
}

std::string ItkVersion()
{
  return itk::Version::GetITKVersion();
}

std::shared_ptr<const float> ItkVesselness(const float* values,
  const std::array<int, 3>& dimensions, const std::array<double, 3>& spacing,
  const ItkVesselnessSettings& settings)
{
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(settings.threads);
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(settings.threads);
  ImageType::SizeType size;
  for (unsigned int axis = 0; axis < 3; ++axis)
  {
    size[axis] = static_cast<itk::SizeValueType>(dimensions[axis]);
  }
  auto input = ImageType::New();
  input->SetRegions(ImageType::RegionType(size));
  input->SetSpacing(spacing.data());
  // The image only looks at the voxels.
  input->GetPixelContainer()->SetImportPointer(
    const_cast<float*>(values), size[0] * size[1] * size[2], false);
  return settings.doubleTensors ? Filter<double>(input, settings) : Filter<float>(input, settings);
}
}
