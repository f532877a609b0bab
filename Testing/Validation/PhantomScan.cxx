#include "PhantomScan.h"

#include "CoronaryOstia.h"
#include "MeasuredLesions.h"
#include "MultiscaleVesselness.h"

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

CenterlineResult Extract(const PhantomScan& image)
{
  const ScalarImage intensity = image.Image();
  CenterlineInput input;
  input.grid = image.grid;
  input.speed = image.vesselness.data();
  input.mask = image.mask.data();
  input.intensity = &intensity;
  input.seeds = image.seeds;
  input.bridges.assign(image.links.begin(), image.links.end());
  return ExtractCenterlines(input, CenterlineSettings());
}

Polylines LinesOf(const VesselTree& tree, const std::vector<Vector3>& roots)
{
  Polylines set = SetOf(tree);
  set.roots = roots;
  return set;
}

/// What the topology does not know of, of the points that it was made of.
void PassOn(const VesselTree& from, CenterlineTopology& tree)
{
  for (const std::int64_t source : tree.source)
  {
    tree.confidence.push_back(from.confidence[source]);
    if (!from.bridged.empty())
    {
      tree.bridged.push_back(from.bridged[source]);
      tree.bridgeConfidence.push_back(from.bridgeConfidence[source]);
    }
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
      result.seedNames.push_back(ostium.name);
    }
  }
  else
  {
    for (const CoronaryOstium& ostium : ostia.ostia)
    {
      seeds.push_back({ ostium.position, ostium.axis });
      result.seedNames.push_back(ostium.name);
    }
    result.doubt = ostia.doubt;
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
  result.window = segmentation.window;
  result.links = std::move(segmentation.links);
  result.considered = std::move(segmentation.considered);
  AddSeconds(seconds, 1, ProcessorSeconds() - start);
  return result;
}

ScalarImage PhantomScan::Image() const
{
  ScalarImage image;
  image.grid = this->grid;
  image.values = static_cast<const std::int16_t*>(this->values.data());
  return image;
}

FoundTree FindTree(const PhantomScan& image)
{
  FoundTree found;
  found.extraction = Extract(image);
  VesselTree& raw = found.extraction.tree;
  if (!raw.branches.empty() && found.extraction.blur > 0.0)
  {
    const TreeLumen measured =
      MeasureTreeLumen(raw, VesselPaths(raw), image.Image(), found.extraction.blur);
    raw = WithLumen(std::move(raw), measured.lumen);
  }
  found.tree = BuildTopology(LinesOf(raw, image.seeds));
  found.labels = LabelSegments(found.tree);
  SplitAtSegmentBorders(found.tree);
  PassOn(raw, found.tree);
  return found;
}

CenterlineTopology TreeOf(const PhantomScan& image, double* seconds, double* blur)
{
  double start = ProcessorSeconds();
  const CenterlineResult extracted = Extract(image);
  AddSeconds(seconds, 0, ProcessorSeconds() - start);
  start = ProcessorSeconds();
  if (blur != nullptr)
  {
    *blur = extracted.blur;
  }
  CenterlineTopology tree = BuildTopology(LinesOf(extracted.tree, image.seeds));
  LabelSegments(tree);
  PassOn(extracted.tree, tree);
  AddSeconds(seconds, 1, ProcessorSeconds() - start);
  return tree;
}
}
