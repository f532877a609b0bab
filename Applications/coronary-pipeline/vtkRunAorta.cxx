#include "vtkRunAorta.h"

#include "AorticWall.h"
#include "ReportJson.h"
#include "RunSettings.h"
#include "vtkAortaData.h"
#include "vtkDataFiles.h"
#include "vtkRunRegion.h"

#include "vtkCoronaryFilterParts.h"
#include "vtkImageData.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <stdexcept>

namespace coronary
{
using Json = nlohmann::ordered_json;

Json MakeAorta(RunStep& step)
{
  RunInput& input = step.input;
  FindOstia(step);
  AorticWall wall;
  wall.why = "the values are no HU";
  AorticModel aorta;
  if (input.Ostia)
  {
    std::vector<float> copy;
    const ScalarImage voxels = vtkCoronary::ScalarImageOf(
      input.Reference, input.Reference->GetPointData()->GetScalars(), copy);
    wall = MeasureAorticWall(voxels, *input.Ostia);
  }
  if (wall.why.empty())
  {
    try
    {
      AorticArchSettings settings;
      settings.descending = DescendingLine(*input.Ostia);
      aorta = ModelAorta(wall.rings, settings);
    }
    catch (const std::invalid_argument& error)
    {
      wall.why = error.what();
    }
  }
  if (!wall.why.empty())
  {
    step.warnings.push_back(
      "'" + input.Chosen->image + "' gives no wall of the aorta: " + wall.why);
    return nullptr;
  }
  const std::string words =
    DescribeAorta(aorta, wall.toBorder ? "the image's border" : "where the wall is lost");
  WritePolyData(step.Add("aorta_wall.vtp"), AorticSurface(aorta, words), input.Messages);
  WritePolyData(step.Add("aorta_centerline.vtp"), AorticCenterline(aorta, words), input.Messages);
  const auto seen =
    static_cast<std::size_t>(std::count(aorta.axisMeasured.begin(), aorta.axisMeasured.end(), 1));
  return { { "file", "aorta_wall.vtp" }, { "centerline_file", "aorta_centerline.vtp" },
    { "source", words }, { "measured_mm", aorta.measuredLength },
    { "completed_mm",
      { { "ascending", aorta.ascending }, { "arch", aorta.arch },
        { "descending", aorta.descending } } },
    { "ascending_diameter_mm", 2.0 * aorta.ascendingRadius }, { "rays_with_edge", wall.seen },
    { "valve", PlaceOf(aorta.axis.front()) },
    { "valve_from", wall.annulus ? "narrowest section" : "usual distance below the ostia" },
    { "measured_end", PlaceOf(aorta.axis[seen - 1]) },
    { "end_from", wall.toBorder ? "border of the image" : "lost wall" } };
}
}
