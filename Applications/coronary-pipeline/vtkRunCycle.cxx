#include "vtkRunCycle.h"

#include "Interruption.h"
#include "MovingModel.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkTimedPolyData.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkDataArray.h"
#include "vtkGatedImageReader.h"
#include "vtkLumenCycle.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkTable.h"

#include <cmath>

namespace coronary
{
namespace
{
namespace names = vtkCoronaryArrayNames;
using Json = nlohmann::ordered_json;

/// Two digits; what is not known is null.
Json Rounded(double value, double digits = 100.0)
{
  return std::isfinite(value) ? Json(std::round(digits * value) / digits) : Json();
}

/// Of a vessel, every mm from its beginning the point that is nearest.
std::vector<std::int64_t> PlacesOf(const VesselView& view)
{
  std::vector<std::int64_t> places;
  std::size_t k = 0;
  for (std::size_t arc = 0; arc < view.path.size(); ++arc)
  {
    while (k + 1 < view.chain.arc.size() &&
      std::abs(view.chain.arc[k + 1] - double(arc)) <= std::abs(view.chain.arc[k] - double(arc)))
    {
      ++k;
    }
    places.push_back(view.chain.points[k]);
  }
  return places;
}

Json Values(vtkPolyData* lines, const char* name, const std::vector<std::int64_t>& places)
{
  Json values = Json::array();
  vtkDataArray* array = lines->GetPointData()->GetArray(name);
  for (const std::int64_t place : places)
  {
    values.push_back(array != nullptr ? Rounded(array->GetComponent(place, 0)) : Json());
  }
  return values;
}

Json Lesions(vtkTable* table)
{
  Json lesions = Json::array();
  for (vtkIdType row = 0; row < table->GetNumberOfRows(); ++row)
  {
    const auto number = [&](const char* column)
    { return Rounded(table->GetValueByName(row, column).ToDouble()); };
    lesions.push_back({ { "vessel", table->GetValueByName(row, "Vessel").ToString() },
      { "kind", table->GetValueByName(row, "Kind").ToString() },
      { "diameter_stenosis_percent", number("Stenosis") },
      { "range_percent", { number("Low"), number("High") } },
      { "worst_percent", number("WorstStenosis") }, { "worst_phase_percent", number("WorstPhase") },
      { "mildest_percent", number("LeastStenosis") }, { "pulsation_percent", number("Pulsation") },
      { "length_mm", number("Length") }, { "least_diameter_mm", number("LeastDiameter") },
      { "reference_diameter_mm", number("HealthyDiameter") },
      { "from_ostium_mm", number("Position") }, { "phases", number("Phases") },
      { "position", { number("X"), number("Y"), number("Z") } } });
  }
  return lesions;
}
}

Json MeasureRunCycle(const RunResult& result, const std::vector<VesselView>& vessels,
  const std::vector<std::string>& files, bool without, vtkMessageTrap& messages,
  const std::function<void(double)>& progress)
{
  if (!HasMotion(result.folder))
  {
    return nullptr;
  }
  const MovingModel model = FindMovingModel(result.folder);
  vtkNew<vtkTimedPolyData> lines;
  for (const TimedFile& file : model.centerlines)
  {
    const vtkSmartPointer<vtkPolyData> data = ReadPolyData(file.path, messages);
    if (data->GetNumberOfPoints() != result.lines->GetNumberOfPoints())
    {
      return nullptr;
    }
    lines->Add(file.time, data);
  }
  if (model.centerlines.empty())
  {
    return nullptr;
  }
  vtkNew<vtkLumenCycle> filter;
  filter->SetInputConnection(lines->GetOutputPort());
  vtkSmartPointer<vtkGatedImageReader> images;
  if (!without)
  {
    images = OpenRunImages(result, files, messages);
    filter->SetImageConnection(images->GetOutputPort());
  }
  const auto report = [&](double fraction) { progress(fraction); };
  Json cycle;
  cycle["measured"] = !without;
  cycle["times"] = Json::array();
  cycle["vessels"] = Json::array();
  std::vector<std::vector<std::int64_t>> places;
  for (const VesselView& view : vessels)
  {
    places.push_back(PlacesOf(view));
    cycle["vessels"].push_back({ { "diameter", Json::array() }, { "degree", Json::array() } });
  }
  filter->UpdateInformation();
  for (const double time : filter->GetPhases())
  {
    UpdateAtTime(filter, vtkLumenCycle::TreePort, time, messages, report);
    ThrowIfInterrupted();
    auto* tree = vtkPolyData::SafeDownCast(filter->GetOutputDataObject(vtkLumenCycle::TreePort));
    cycle["times"].push_back(Rounded(time, 1e4));
    for (std::size_t n = 0; n < vessels.size(); ++n)
    {
      Json& vessel = cycle["vessels"][n];
      vessel["diameter"].push_back(Values(tree, names::Diameter, places[n]));
      vessel["degree"].push_back(Values(tree, names::StenosisDegree, places[n]));
      if (cycle["times"].size() == 1)
      {
        vessel["median"] = Values(tree, names::MedianDiameter, places[n]);
        vessel["healthy"] = Values(tree, names::HealthyDiameter, places[n]);
      }
    }
  }
  cycle["lesions"] =
    Lesions(vtkTable::SafeDownCast(filter->GetOutputDataObject(vtkLumenCycle::LesionPort)));
  return cycle;
}
}
