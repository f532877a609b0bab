// Coronary arteries by ITK alone, as a peer to compare with: Frangi's objectness over five scales, then the region that hangs
// together with given ostia where both objectness and HU are high. One setting for all images.

#include <itkConnectedThresholdImageFilter.h>
#include <itkHessianToObjectnessMeasureImageFilter.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkImageRegionIterator.h>
#include <itkImageRegionIteratorWithIndex.h>
#include <itkMetaImageIO.h>
#include <itkMultiScaleHessianBasedMeasureImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkSymmetricSecondRankTensor.h>

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using ImageType = itk::Image<float, 3>;
using MaskType = itk::Image<unsigned char, 3>;
using TensorImageType = itk::Image<itk::SymmetricSecondRankTensor<float, 3>, 3>;

struct Options
{
  std::string image;
  std::string mask;
  std::vector<double> ostia;
  double lowestHU = 200.0;
  double lowestObjectness = 0.1;
  double reach = 5.0; // mm
  int threads = 0;
};

ImageType::Pointer Objectness(ImageType* input)
{
  auto objectness = itk::HessianToObjectnessMeasureImageFilter<TensorImageType, ImageType>::New();
  objectness->SetObjectDimension(1);
  objectness->SetBrightObject(true);
  objectness->SetAlpha(0.5);
  objectness->SetBeta(0.5);
  objectness->SetGamma(100.0);
  objectness->SetScaleObjectnessMeasure(false);
  auto filter =
    itk::MultiScaleHessianBasedMeasureImageFilter<ImageType, TensorImageType, ImageType>::New();
  filter->SetHessianToMeasureFilter(objectness);
  filter->SetSigmaMinimum(0.5);
  filter->SetSigmaMaximum(2.5);
  filter->SetNumberOfSigmaSteps(5);
  filter->SetSigmaStepMethodToEquispaced();
  filter->SetInput(input);
  filter->Update();
  return filter->GetOutput();
}

/// The voxel of the greatest objectness near an ostium.
ImageType::IndexType Seed(ImageType* objectness, const double* ostium, double reach)
{
  ImageType::PointType centre;
  for (unsigned int axis = 0; axis < 3; ++axis)
  {
    centre[axis] = ostium[axis];
  }
  ImageType::IndexType seed{};
  float best = 0.0F;
  itk::ImageRegionIteratorWithIndex<ImageType> it(objectness, objectness->GetBufferedRegion());
  for (; !it.IsAtEnd(); ++it)
  {
    ImageType::PointType place;
    objectness->TransformIndexToPhysicalPoint(it.GetIndex(), place);
    if (place.EuclideanDistanceTo(centre) <= reach && it.Get() > best)
    {
      best = it.Get();
      seed = it.GetIndex();
    }
  }
  if (best <= 0.0F)
  {
    throw std::runtime_error("nothing like a vessel is near an ostium");
  }
  return seed;
}

void Segment(const Options& options)
{
  if (options.threads > 0)
  {
    itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(options.threads);
  }
  auto reader = itk::ImageFileReader<ImageType>::New();
  reader->SetFileName(options.image);
  reader->SetImageIO(itk::MetaImageIO::New());
  reader->Update();
  const ImageType::Pointer input = reader->GetOutput();
  const ImageType::Pointer objectness = Objectness(input);
  itk::ImageRegionIterator<ImageType> from(input, input->GetBufferedRegion());
  itk::ImageRegionIterator<ImageType> to(objectness, objectness->GetBufferedRegion());
  for (; !from.IsAtEnd(); ++from, ++to)
  {
    if (from.Get() < options.lowestHU)
    {
      to.Set(0.0F);
    }
  }
  auto region = itk::ConnectedThresholdImageFilter<ImageType, MaskType>::New();
  region->SetInput(objectness);
  region->SetConnectivity(itk::ConnectedThresholdImageFilterEnums::Connectivity::FullConnectivity);
  region->SetLower(static_cast<float>(options.lowestObjectness));
  region->SetReplaceValue(1);
  for (std::size_t n = 0; n < options.ostia.size(); n += 3)
  {
    region->AddSeed(Seed(objectness, &options.ostia[n], options.reach));
  }
  auto writer = itk::ImageFileWriter<MaskType>::New();
  writer->SetFileName(options.mask);
  writer->SetImageIO(itk::MetaImageIO::New());
  writer->SetInput(region->GetOutput());
  writer->Update();
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program("Coronary arteries by ITK: objectness and the region that hangs on the ostia");
    Options options;
    program.add_option("image", options.image, "MetaImage (.mha)")->required();
    program.add_option("mask", options.mask, "file to write")->required();
    program.add_option("--ostium", options.ostia, "x y z in mm, LPS; may be repeated")
      ->type_size(3)
      ->expected(-1)
      ->required();
    program.add_option("--lowest-hu", options.lowestHU, "of the lumen")->capture_default_str();
    program.add_option("--lowest-objectness", options.lowestObjectness, "of the lumen")
      ->capture_default_str();
    program.add_option("--threads", options.threads, "0: all cores")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
    CLI11_PARSE(program, argc, argv);
    Segment(options);
    return 0;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "itk-segmentation: %s\n", error.what());
    return 1;
  }
}
