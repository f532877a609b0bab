#include "PhantomScan.h"

#include "CenterlineExtraction.h"
#include "CoronaryOstia.h"
#include "MultiscaleVesselness.h"
#include "SegmentLabeling.h"
#include "VesselSegmentation.h"

#include <ctime>
#include <stdexcept>

namespace coronary
{
namespace
{
double ProcessorSeconds()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void AddSeconds(double* seconds, int index, double value)
{
  if (seconds != nullptr)
  {
    seconds[index] = value;
  }
}
}

PhantomScan ScanPhantom(const CoronaryPhantom& phantom, const ImageGrid& grid, double moment,
  bool trueOstia, double* seconds)
{
  PhantomScan result;
  result.grid = grid;
  ScalarImage image;
  image.grid = result.grid;
  const auto voxels = static_cast<std::size_t>(image.NumberOfVoxels());
  result.values.resize(voxels);
  phantom.Render(result.grid, result.grid.extent, moment, result.values.data());
  image.values = static_cast<const std::int16_t*>(result.values.data());

  double start = ProcessorSeconds();
  const CoronaryOstia ostia = FindCoronaryOstia(image);
  std::vector<VesselSeed> seeds;
  if (trueOstia)
  {
    for (const PhantomOstium& ostium : phantom.Ostia(moment))
    {
      seeds.push_back({ ostium.position, ostium.axis });
    }
  }
  else
  {
    for (const CoronaryOstium& ostium : ostia.ostia)
    {
      seeds.push_back({ ostium.position, ostium.axis });
    }
  }
  if (seeds.empty())
  {
    throw std::runtime_error("no ostium found: " + ostia.doubt);
  }
  for (const VesselSeed& seed : seeds)
  {
    result.seeds.push_back(seed.position);
  }
  VesselnessSettings frangi;
  frangi.sigmas = VesselnessScales(0.5, 2.5, 5, true);
  frangi.c = 100.0;
  result.vesselness.resize(voxels);
  {
    const std::vector<float> input(result.values.begin(), result.values.end());
    MultiscaleVesselness::Output output;
    output.vesselness = result.vesselness.data();
    MultiscaleVesselness(frangi, result.grid.spacing, result.grid.extent)
      .Compute({ input.data(), result.grid.extent }, result.grid.extent, nullptr, output);
  }
  AddSeconds(seconds, 0, ProcessorSeconds() - start);
  start = ProcessorSeconds();
  VesselSegmentationSettings settings;
  settings.window = BloodWindow{ CoronaryOstiaSettings().softTissue, ostia.aorta.mean };
  VesselSegmentationResult segmentation =
    SegmentVessels(image, result.vesselness.data(), seeds, settings);
  result.mask = std::move(segmentation.mask);
  result.links = std::move(segmentation.links);
  AddSeconds(seconds, 1, ProcessorSeconds() - start);
  return result;
}

CenterlineTopology TreeOf(const PhantomScan& image, double* seconds, double* blur)
{
  double start = ProcessorSeconds();
  ScalarImage intensity;
  intensity.grid = image.grid;
  intensity.values = static_cast<const std::int16_t*>(image.values.data());
  CenterlineInput input;
  input.grid = image.grid;
  input.speed = image.vesselness.data();
  input.mask = image.mask.data();
  input.intensity = &intensity;
  input.seeds = image.seeds;
  input.bridges.assign(image.links.begin(), image.links.end());
  const CenterlineResult extracted = ExtractCenterlines(input, CenterlineSettings());
  AddSeconds(seconds, 0, ProcessorSeconds() - start);
  start = ProcessorSeconds();
  if (blur != nullptr)
  {
    *blur = extracted.blur;
  }
  CenterlineSet set;
  set.points = extracted.tree.points;
  set.radius = extracted.tree.radius;
  set.roots = image.seeds;
  for (const CenterlineTree::Branch& branch : extracted.tree.branches)
  {
    set.lines.push_back(branch.points);
  }
  CenterlineTopology tree = BuildTopology(set);
  LabelSegments(tree);
  for (const std::int64_t source : tree.source)
  {
    tree.confidence.push_back(extracted.tree.confidence[source]);
    if (!extracted.tree.bridged.empty())
    {
      tree.bridged.push_back(extracted.tree.bridged[source]);
      tree.bridgeConfidence.push_back(extracted.tree.bridgeConfidence[source]);
    }
  }
  AddSeconds(seconds, 1, ProcessorSeconds() - start);
  return tree;
}
}
