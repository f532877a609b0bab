#include "vtkRunLesions.h"

#include "CalciumObjects.h"
#include "CoronaryAnatomy.h"
#include "Interruption.h"
#include "LumenLevels.h"
#include "LumenRefinement.h"
#include "MetaImageWriter.h"
#include "ReportJson.h"
#include "StenosisGrading.h"
#include "VesselPaths.h"
#include "vtkVesselTree.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkIntArray.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <vector>

namespace coronary
{
namespace
{
namespace names = vtkCoronaryArrayNames;
using Json = nlohmann::ordered_json;

/// The tree with all that its arrays tell.
VesselTree TreeWithArrays(vtkPolyData* data)
{
  VesselTree tree = vtkCoronary::TreeOf(data);
  vtkCoronary::AddPointValues(data, tree);
  return tree;
}

ProgressCallback ProgressOf(const std::function<void(double)>& progress)
{
  return [&progress](double fraction)
  {
    progress(fraction);
    return Interruption() == 0;
  };
}

/// An image, a tree in it, and what was measured of both.
struct Measurement : TreeLumen
{
  VesselTree tree;
  std::vector<VesselPath> paths;
  std::vector<float> copy;
  ScalarImage image;
};

std::string NameOf(int segmentId)
{
  const std::string name = SegmentName(segmentId);
  return name.empty() ? "unnamed" : name;
}

Json Describe(const Stenosis& lesion)
{
  return { { "vessel", NameOf(lesion.segmentId) }, { "position", PlaceOf(lesion.position) },
    { "abscissa_start_mm", lesion.abscissaStart }, { "abscissa_least_mm", lesion.abscissaMinimum },
    { "abscissa_end_mm", lesion.abscissaEnd }, { "length_mm", lesion.length },
    { "least_diameter_mm", lesion.minimumDiameter },
    { "reference_diameter_mm", lesion.referenceDiameter },
    { "population_diameter_mm",
      lesion.populationDiameter > 0.0 ? Json(lesion.populationDiameter) : Json() },
    { "diameter_stenosis_percent", 100.0 * lesion.degree },
    { "area_stenosis_percent", 100.0 * lesion.areaDegree },
    { "range_percent", { 100.0 * lesion.degreeLow, 100.0 * lesion.degreeHigh } },
    { "kind", LesionKindName(lesion.kind) }, { "confidence", lesion.confidence },
    { "bridged", lesion.bridged }, { "interpolated", lesion.interpolated } };
}

std::string Row(const Stenosis& lesion)
{
  std::array<char, 400> row;
  std::snprintf(row.data(), row.size(),
    "%s,%.2f,%.2f,%.2f,%.1f,%.1f,%.1f,%.1f,%.2f,%.2f,%.1f,%.0f,%.0f,%.0f,%.0f,%s,%.2f,%d,%d\n",
    NameOf(lesion.segmentId).c_str(), lesion.position[0], lesion.position[1], lesion.position[2],
    lesion.abscissaStart, lesion.abscissaMinimum, lesion.abscissaEnd, lesion.length,
    lesion.minimumDiameter, lesion.referenceDiameter, lesion.populationDiameter,
    100.0 * lesion.degree, 100.0 * lesion.areaDegree, 100.0 * lesion.degreeLow,
    100.0 * lesion.degreeHigh, LesionKindName(lesion.kind), lesion.confidence,
    lesion.bridged ? 1 : 0, lesion.interpolated ? 1 : 0);
  return row.data();
}

Json DescribeCalcium(const Measurement& measurement)
{
  const VesselTree& tree = measurement.tree;
  Json objects = Json::array();
  std::map<std::string, double> scores;
  double score = 0.0;
  double volume = 0.0;
  for (const CalciumObject& object : measurement.calcium.objects)
  {
    objects.push_back({ { "label", object.label }, { "vessel", NameOf(object.segmentId) },
      { "position", PlaceOf(object.centre) }, { "abscissa_start_mm", object.abscissaStart },
      { "abscissa_end_mm", object.abscissaEnd }, { "volume_mm3", object.volume },
      { "corrected_volume_mm3", object.correctedVolume }, { "peak_hu", object.peak },
      { "density_hu", object.density }, { "arc_deg", object.arc }, { "score", object.score } });
    scores[NameOf(object.segmentId)] += object.score;
    score += object.score;
    volume += object.correctedVolume;
  }
  // Where the lumen behind calcium is a guess.
  Json hidden = Json::array();
  for (const VesselPath& path : measurement.paths)
  {
    for (std::size_t i = path.parent < 0 ? 0 : 1; i < path.points.size(); ++i)
    {
      if (measurement.lumen.interpolated[path.points[i]] == 0)
      {
        continue;
      }
      const std::size_t first = i;
      while (i + 1 < path.points.size() && measurement.lumen.interpolated[path.points[i + 1]] != 0)
      {
        ++i;
      }
      const std::int64_t from = path.points[first];
      const std::int64_t to = path.points[i];
      const int segment = tree.segmentId.empty() ? 0 : tree.segmentId[from];
      hidden.push_back({ { "vessel", NameOf(segment) }, { "from", PlaceOf(tree.points[from]) },
        { "to", PlaceOf(tree.points[to]) }, { "length_mm", path.arc[i] - path.arc[first] } });
    }
  }
  return { { "objects", objects }, { "score_by_segment", scores }, { "score", score },
    { "score_remark",
      "Agatston's weights on an image with contrast: another measure than the score without it" },
    { "corrected_volume_mm3", volume }, { "radius_interpolated", hidden },
    { "lumen_hu", measurement.levels.usual }, { "noise_hu", measurement.levels.noise } };
}

/// Labels on the image's voxels; what has a number above 255 has 255 in a file of bytes, so these are shorts then.
void WriteLabels(const std::string& path, const Measurement& measurement, const ImageGrid& grid)
{
  const auto write = [&](auto zero)
  {
    std::vector<decltype(zero)> labels(
      static_cast<std::size_t>(measurement.image.NumberOfVoxels()), zero);
    for (const CalciumVoxel& voxel : measurement.calcium.voxels)
    {
      labels[voxel.offset] = static_cast<decltype(zero)>(voxel.label);
    }
    // Nearly all of it is zero.
    WriteMetaImage(path, grid, labels.data(), true, [](double) { return Interruption() == 0; });
  };
  if (measurement.calcium.objects.size() <= 255)
  {
    write(static_cast<unsigned char>(0));
  }
  else
  {
    write(static_cast<short>(0));
  }
}
}

TreeLesions GradeTreeLesions(vtkPolyData* tree, vtkImageData* image, double blur,
  const std::function<std::string()>& calciumFile, const std::function<void(double)>& progress)
{
  TreeLesions result;
  result.lesions = Json::array();
  result.table =
    "vessel,x_mm,y_mm,z_mm,start_mm,least_mm,end_mm,length_mm,least_diameter_mm,"
    "reference_diameter_mm,population_diameter_mm,diameter_stenosis_percent,"
    "area_stenosis_percent,range_low_percent,range_high_percent,kind,confidence,bridged,"
    "interpolated\n";
  Measurement measurement;
  StenosisGrading grading;
  if (tree->GetNumberOfLines() > 0 && blur > 0.0)
  {
    measurement.tree = TreeWithArrays(tree);
    measurement.paths = VesselPaths(measurement.tree);
    measurement.image =
      vtkCoronary::ScalarImageOf(image, image->GetPointData()->GetScalars(), measurement.copy);
    const ProgressCallback report = ProgressOf(progress);
    static_cast<TreeLumen&>(measurement) =
      MeasureTreeLumen(measurement.tree, measurement.paths, measurement.image, blur, report);
    MeasureCalcium(measurement.calcium, measurement.tree, measurement.paths, measurement.image,
      measurement.levels, blur);
    grading = GradeStenoses(measurement.tree, measurement.paths, measurement.lumen);
  }
  for (const Stenosis& lesion : grading.lesions)
  {
    result.lesions.push_back(Describe(lesion));
    result.table += Row(lesion);
  }
  result.calcium = DescribeCalcium(measurement);
  result.hasCalcium = !measurement.calcium.objects.empty();
  result.calcium["file"] = Json();
  if (result.hasCalcium)
  {
    WriteLabels(calciumFile(), measurement, vtkCoronary::GridOf(image));
    result.calcium["file"] = "calcium.mha";
  }
  vtkPointData* arrays = tree->GetPointData();
  vtkCoronary::AddArray<vtkDoubleArray>(arrays, names::StenosisDegree, grading.degree);
  vtkCoronary::AddArray<vtkDoubleArray>(arrays, names::ReferenceRadius, grading.referenceRadius);
  vtkCoronary::AddArray<vtkUnsignedCharArray>(
    arrays, names::RadiusInterpolated, measurement.lumen.interpolated);
  vtkCoronary::AddArray<vtkIntArray>(arrays, names::CalciumLabel, measurement.lumen.calcium);
  return result;
}
}
