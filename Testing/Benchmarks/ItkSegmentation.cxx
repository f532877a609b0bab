// Coronary arteries by ITK alone, as a peer to compare with: Frangi's objectness over five scales, then the region that hangs
// together with given ostia where both objectness and HU are high. Lines: fast marching from the ostia, as fast as objectness
// is high, and down the arrival time from given tips. One setting for all images.

#include <itkConnectedThresholdImageFilter.h>
#include <itkFastMarchingImageFilter.h>
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

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
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
  std::string lines;
  std::vector<double> ostia;
  std::vector<double> tips;
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

using FastMarching = itk::FastMarchingImageFilter<ImageType, ImageType>;

/// From a tip down the arrival time, voxel by voxel, to an ostium: a line of text for each place, the mean of five neighbours on
/// the way, and an empty line after the last.
void WriteWay(const ImageType* arrival, const double* tip, std::ostream& text)
{
  ImageType::PointType place;
  for (unsigned int axis = 0; axis < 3; ++axis)
  {
    place[axis] = tip[axis];
  }
  ImageType::IndexType here;
  if (!arrival->TransformPhysicalPointToIndex(place, here))
  {
    throw std::runtime_error("a tip is outside of the image");
  }
  std::vector<ImageType::PointType> way;
  for (bool lower = true; lower;)
  {
    arrival->TransformIndexToPhysicalPoint(here, place);
    way.push_back(place);
    lower = false;
    const ImageType::IndexType from = here;
    for (int n = 0; n < 27; ++n)
    {
      ImageType::IndexType next = from;
      next[0] += n % 3 - 1;
      next[1] += n / 3 % 3 - 1;
      next[2] += n / 9 - 1;
      if (arrival->GetBufferedRegion().IsInside(next) &&
        arrival->GetPixel(next) < arrival->GetPixel(here))
      {
        here = next;
        lower = true;
      }
    }
  }
  const int count = static_cast<int>(way.size());
  for (int n = 0; n < count; ++n)
  {
    const int reach = std::min({ 2, n, count - 1 - n });
    for (unsigned int axis = 0; axis < 3; ++axis)
    {
      double sum = 0.0;
      for (int k = -reach; k <= reach; ++k)
      {
        sum += way[n + k][axis];
      }
      text << sum / (2 * reach + 1) << (axis < 2 ? " " : "\n");
    }
  }
  text << "\n";
}

/// @param speed  objectness; changed
void WriteLines(const Options& options, ImageType* speed)
{
  constexpr float slowest = 1e-3F; // ways go on through gaps
  auto starts = FastMarching::NodeContainer::New();
  for (std::size_t n = 0; n < options.ostia.size(); n += 3)
  {
    FastMarching::NodeType node;
    node.SetIndex(Seed(speed, &options.ostia[n], options.reach));
    node.SetValue(0.0);
    starts->InsertElement(static_cast<unsigned int>(n / 3), node);
  }
  for (itk::ImageRegionIterator<ImageType> it(speed, speed->GetBufferedRegion()); !it.IsAtEnd();
       ++it)
  {
    it.Set(std::max(it.Get(), slowest));
  }
  auto marching = FastMarching::New();
  marching->SetInput(speed);
  marching->SetTrialPoints(starts);
  marching->Update();
  std::ofstream text(options.lines);
  text.precision(9);
  for (std::size_t n = 0; n < options.tips.size(); n += 3)
  {
    WriteWay(marching->GetOutput(), &options.tips[n], text);
  }
  text.close();
  if (!text)
  {
    throw std::runtime_error(options.lines + ": cannot write it");
  }
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
  if (!options.lines.empty())
  {
    WriteLines(options, objectness);
  }
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
    CLI::Option* tips =
      program
        .add_option("--tip", options.tips, "x y z in mm, LPS, where a line begins; may be repeated")
        ->type_size(3)
        ->expected(-1);
    program.add_option("--lines", options.lines, "text file of the lines to write")->needs(tips);
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
