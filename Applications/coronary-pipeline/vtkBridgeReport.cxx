#include "vtkBridgeReport.h"

#include "BridgeCheck.h"
#include "ReportJson.h"
#include "TreeCheck.h"
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
  double minimum = std::numeric_limits<double>::infinity();
  vtkIdType nearest = -1;
  for (vtkIdType cell = 0; cell < tree->GetNumberOfCells(); ++cell)
  {
    vtkIdList* points = tree->GetCell(cell)->GetPointIds();
    for (vtkIdType n = 0; n < points->GetNumberOfIds(); ++n)
    {
      const double distance = (Vector3(tree->GetPoint(points->GetId(n))) - place).norm();
      if (distance < minimum)
      {
        minimum = distance;
        nearest = cell;
      }
    }
  }
  const std::string name = labels && nearest >= 0 ? std::string(labels->GetValue(nearest)) : "";
  return { name.empty() ? "unnamed branch" : name, minimum };
}

Vector3 ReadPlace(const nlohmann::ordered_json& place)
{
  return { place[0].get<double>(), place[1].get<double>(), place[2].get<double>() };
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
    for (std::size_t n = 1; n < bridge.points.size(); ++n)
    {
      length += (bridge.points[n] - bridge.points[n - 1]).norm();
    }
    list.push_back({ { "vessel", vessel }, { "from", PlaceOf(bridge.points.front()) },
      { "to", PlaceOf(bridge.points.back()) }, { "length_mm", length },
      { "unseen_mm", bridge.unseen }, { "confidence", bridge.confidence },
      { "kind", BridgeKindName(KindOfBridge(bridge, interpolator, blood)) } });
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
    list.push_back({ { "position", PlaceOf(Vector3(positions->GetTuple3(n))) },
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
    const VesselBridge crossed{ { ReadPlace(bridge["from"]), ReadPlace(bridge["to"]) },
      bridge["confidence"].get<double>(), bridge["unseen_mm"].get<double>() };
    warnings.push_back(OcclusionWarning(crossed, bridge["vessel"].get<std::string>()).what + ".");
  }
  return warnings;
}

std::vector<std::string> VeinWarnings(const nlohmann::ordered_json& veins)
{
  std::vector<std::string> warnings;
  for (const auto& vein : veins)
  {
    if (const auto warning = DoubtfulVeinWarning(ReadPlace(vein["position"]),
          vein["length_mm"].get<double>(), vein["probability"].get<double>()))
    {
      warnings.push_back(warning->what + ".");
    }
  }
  return warnings;
}
}
