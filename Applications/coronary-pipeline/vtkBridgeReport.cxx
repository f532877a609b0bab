#include "vtkBridgeReport.h"

#include "LumenMeasurement.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkCell.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
/// The name of the branch nearest to a place, and how near it is, mm.
std::pair<std::string, double> NearestVessel(vtkPolyData* tree, const Vector3& place)
{
  auto* labels = vtkStringArray::SafeDownCast(
    tree->GetCellData()->GetAbstractArray(vtkCoronaryArrayNames::SegmentLabel));
  double least = std::numeric_limits<double>::infinity();
  vtkIdType nearest = -1;
  for (vtkIdType cell = 0; cell < tree->GetNumberOfCells(); ++cell)
  {
    vtkIdList* points = tree->GetCell(cell)->GetPointIds();
    for (vtkIdType n = 0; n < points->GetNumberOfIds(); ++n)
    {
      const double distance = (Vector3(tree->GetPoint(points->GetId(n))) - place).norm();
      if (distance < least)
      {
        least = distance;
        nearest = cell;
      }
    }
  }
  const std::string name = labels && nearest >= 0 ? std::string(labels->GetValue(nearest)) : "";
  return { name.empty() ? "unnamed branch" : name, least };
}

nlohmann::ordered_json Place(const Vector3& p)
{
  return { p[0], p[1], p[2] };
}
}

std::vector<VesselBridge> BridgesOfLines(vtkPolyData* lines)
{
  std::vector<VesselBridge> bridges;
  vtkDataArray* confidence =
    lines->GetCellData()->GetArray(vtkCoronaryArrayNames::BridgeConfidence);
  vtkDataArray* unseen = lines->GetCellData()->GetArray(vtkCoronaryArrayNames::BridgeUnseen);
  for (vtkIdType cell = 0; cell < lines->GetNumberOfCells(); ++cell)
  {
    if (!confidence || !unseen)
    {
      throw std::runtime_error("The bridges have no '" +
        std::string(vtkCoronaryArrayNames::BridgeConfidence) + "' or no '" +
        vtkCoronaryArrayNames::BridgeUnseen + "'.");
    }
    VesselBridge bridge;
    vtkIdList* points = lines->GetCell(cell)->GetPointIds();
    for (vtkIdType n = 0; n < points->GetNumberOfIds(); ++n)
    {
      bridge.points.emplace_back(lines->GetPoint(points->GetId(n)));
    }
    bridge.confidence = confidence->GetTuple1(cell);
    bridge.unseen = unseen->GetTuple1(cell);
    bridges.push_back(bridge);
  }
  return bridges;
}

nlohmann::ordered_json DescribeBridges(
  vtkPolyData* lines, vtkPolyData* tree, vtkImageData* reference, double blood)
{
  constexpr double runsAcross = 2.0; // mm
  constexpr double nothingSeen = 3.0;
  constexpr double calcium = 1.3; // of the blood
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::vector<float> copy;
  const ScalarImage image =
    vtkCoronary::ScalarImageOf(reference, reference->GetPointData()->GetScalars(), copy);
  const ImageInterpolator interpolator(image);
  for (const VesselBridge& bridge : BridgesOfLines(lines))
  {
    const auto [vessel, distance] = NearestVessel(tree, bridge.points[bridge.points.size() / 2]);
    if (distance > runsAcross)
    {
      continue;
    }
    double length = 0.0;
    double brightest = -std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < bridge.points.size(); ++n)
    {
      length += n > 0 ? (bridge.points[n] - bridge.points[n - 1]).norm() : 0.0;
      brightest = std::max(brightest, interpolator.At(bridge.points[n]));
    }
    const bool bright = brightest > calcium * blood;
    list.push_back({ { "vessel", vessel }, { "from", Place(bridge.points.front()) },
      { "to", Place(bridge.points.back()) }, { "length_mm", length },
      { "unseen_mm", bridge.unseen }, { "confidence", bridge.confidence },
      { "kind",
        bright                           ? "calcium"
          : bridge.unseen >= nothingSeen ? "occlusion"
                                         : "stenosis" } });
  }
  return list;
}

nlohmann::ordered_json DescribeVeins(vtkPolyData* tree)
{
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  vtkFieldData* data = tree->GetFieldData();
  vtkDataArray* positions = data->GetArray(vtkCoronaryArrayNames::VeinPositions);
  vtkDataArray* lengths = data->GetArray(vtkCoronaryArrayNames::VeinLengths);
  vtkDataArray* probabilities = data->GetArray(vtkCoronaryArrayNames::VeinProbabilities);
  for (vtkIdType n = 0; positions && n < positions->GetNumberOfTuples(); ++n)
  {
    list.push_back({ { "position", Place(Vector3(positions->GetTuple3(n))) },
      { "length_mm", lengths->GetTuple1(n) }, { "probability", probabilities->GetTuple1(n) } });
  }
  return list;
}

std::vector<std::string> BridgeWarnings(const nlohmann::ordered_json& bridges)
{
  std::vector<std::string> warnings;
  for (const auto& bridge : bridges)
  {
    if (bridge["kind"] != "occlusion")
    {
      continue;
    }
    char text[240];
    std::snprintf(text, sizeof(text),
      "%s: no lumen is seen for %.0f mm between (%.0f, %.0f, %.0f) and (%.0f, %.0f, %.0f): "
      "occluded, or lost in "
      "the image; what lies behind was linked with a confidence of %.2f.",
      bridge["vessel"].get<std::string>().c_str(), bridge["unseen_mm"].get<double>(),
      bridge["from"][0].get<double>(), bridge["from"][1].get<double>(),
      bridge["from"][2].get<double>(), bridge["to"][0].get<double>(), bridge["to"][1].get<double>(),
      bridge["to"][2].get<double>(), bridge["confidence"].get<double>());
    warnings.emplace_back(text);
  }
  return warnings;
}
}
