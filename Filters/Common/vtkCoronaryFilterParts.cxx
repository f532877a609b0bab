#include "vtkCoronaryFilterParts.h"

#include "ParallelFor.h"
#include "vtkCoronaryArrayNames.h"

#include "vtkAlgorithm.h"
#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkDataArrayRange.h"
#include "vtkDataObject.h"
#include "vtkDemandDrivenPipeline.h"
#include "vtkDoubleArray.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationStringKey.h"
#include "vtkInformationVector.h"
#include "vtkMatrix3x3.h"
#include "vtkOutputWindow.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkShortArray.h"
#include "vtkUnsignedShortArray.h"

#include <cctype>
#include <new>
#include <stdexcept>

namespace vtkCoronary
{
coronary::ImageGrid GridOf(vtkImageData* image)
{
  coronary::ImageGrid grid;
  image->GetExtent(grid.extent.data());
  image->GetOrigin(grid.origin.data());
  image->GetSpacing(grid.spacing.data());
  grid.direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
    image->GetDirectionMatrix()->GetData());
  return grid;
}

void AddVectors(
  vtkFieldData* data, const std::string& name, const std::vector<coronary::Vector3>& values)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(static_cast<vtkIdType>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
  {
    array->SetTypedTuple(static_cast<vtkIdType>(i), values[i].data());
  }
  data->AddArray(array);
}

coronary::ScalarImage ScalarImageOf(
  vtkImageData* image, vtkDataArray* array, std::vector<float>& copy)
{
  coronary::ScalarImage result;
  result.grid = GridOf(image);
  if (auto* shorts = vtkArrayDownCast<vtkShortArray>(array))
  {
    result.values = static_cast<const std::int16_t*>(shorts->GetPointer(0));
  }
  else if (auto* unsignedShorts = vtkArrayDownCast<vtkUnsignedShortArray>(array))
  {
    result.values = static_cast<const std::uint16_t*>(unsignedShorts->GetPointer(0));
  }
  else if (auto* floats = vtkArrayDownCast<vtkFloatArray>(array))
  {
    result.values = static_cast<const float*>(floats->GetPointer(0));
  }
  else
  {
    const auto range = vtk::DataArrayValueRange<1>(array);
    copy.assign(range.begin(), range.end());
    result.values = static_cast<const float*>(copy.data());
  }
  return result;
}

bool IsAutomatic(const std::string& arrayName)
{
  return arrayName.empty() || arrayName == "Automatic";
}

vtkDataArray* VoxelArrayOf(vtkImageData* image, const std::string& chosen, const std::string& whose)
{
  vtkPointData* data = image->GetPointData();
  vtkAbstractArray* any =
    IsAutomatic(chosen) ? data->GetScalars() : data->GetAbstractArray(chosen.c_str());
  if (IsAutomatic(chosen))
  {
    for (int n = 0; !any && n < data->GetNumberOfArrays(); ++n)
    {
      vtkDataArray* numbers = data->GetArray(n);
      any = numbers && numbers->GetNumberOfComponents() == 1 ? numbers : nullptr;
    }
  }
  Require(any != nullptr,
    whose + " has no point array " +
      (IsAutomatic(chosen) ? "of one component" : "'" + chosen + "'"));
  const std::string name =
    "array '" + std::string(any->GetName() ? any->GetName() : "") + "' of " + whose;
  auto* array = vtkArrayDownCast<vtkDataArray>(any);
  Require(array != nullptr, name + " is not numeric");
  Require(array->GetNumberOfComponents() == 1,
    name + " has " + std::to_string(array->GetNumberOfComponents()) + " components: one is needed");
  Require(
    array->GetNumberOfTuples() == image->GetNumberOfPoints(), name + " has not one value a voxel");
  return array;
}

std::string ChosenPointArray(vtkAlgorithm* filter, const std::string& whose)
{
  vtkInformation* chosen = filter->GetInputArrayInformation(0);
  if (!chosen->Has(vtkDataObject::FIELD_NAME()) || !chosen->Get(vtkDataObject::FIELD_NAME()))
  {
    return {};
  }
  const std::string name = chosen->Get(vtkDataObject::FIELD_NAME());
  Require(IsAutomatic(name) ||
      chosen->Get(vtkDataObject::FIELD_ASSOCIATION()) == vtkDataObject::FIELD_ASSOCIATION_POINTS,
    "array '" + name + "' of " + whose + " belongs to the cells: point data are needed");
  return name;
}

vtkDataArray* FindRadius(vtkPolyData* lines, const std::string& chosen)
{
  vtkPointData* data = lines->GetPointData();
  const bool automatic = IsAutomatic(chosen);
  vtkDataArray* radius = data->GetArray(automatic ? vtkCoronaryArrayNames::Radius : chosen.c_str());
  if (radius == nullptr && automatic)
  {
    radius = data->GetArray("Radius");
  }
  Require(radius != nullptr || automatic, "There is no point array " + chosen + " of radii");
  Require(radius == nullptr ||
      (radius->GetNumberOfComponents() == 1 &&
        radius->GetNumberOfTuples() == lines->GetNumberOfPoints()),
    "The radius array " + std::string(radius == nullptr ? "" : radius->GetName()) +
      " must have one value for each point");
  return radius;
}

vtkDataArray* RadiusOf(vtkPolyData* lines, const std::string& whose, const std::string& chosen)
{
  vtkDataArray* radius = FindRadius(lines, chosen);
  Require(radius != nullptr, whose + " no point array MaximumInscribedSphereRadius or Radius");
  return radius;
}

void SetBridges(vtkFieldData* data, const std::vector<coronary::VesselBridge>& bridges)
{
  vtkNew<vtkDoubleArray> points;
  points->SetName(vtkCoronaryArrayNames::BridgePoints);
  points->SetNumberOfComponents(4);
  std::vector<double> confidences;
  std::vector<double> unseen;
  for (const coronary::VesselBridge& bridge : bridges)
  {
    for (const coronary::Vector3& p : bridge.points)
    {
      points->InsertNextTuple4(p[0], p[1], p[2], static_cast<double>(confidences.size()));
    }
    confidences.push_back(bridge.confidence);
    unseen.push_back(bridge.unseen);
  }
  data->AddArray(points);
  AddArray<vtkDoubleArray>(data, vtkCoronaryArrayNames::BridgeConfidences, confidences);
  AddArray<vtkDoubleArray>(data, vtkCoronaryArrayNames::BridgeUnseen, unseen);
}

std::vector<coronary::VesselBridge> BridgesOf(vtkFieldData* data)
{
  vtkDataArray* points = data->GetArray(vtkCoronaryArrayNames::BridgePoints);
  vtkDataArray* confidences = data->GetArray(vtkCoronaryArrayNames::BridgeConfidences);
  if (!points || !confidences || confidences->GetNumberOfTuples() == 0)
  {
    return {};
  }
  const auto require = [](bool fits, const char* name)
  { Require(fits, "the field data array '" + std::string(name) + "' does not describe bridges"); };
  require(points->GetNumberOfComponents() == 4, vtkCoronaryArrayNames::BridgePoints);
  require(confidences->GetNumberOfComponents() == 1, vtkCoronaryArrayNames::BridgeConfidences);
  std::vector<coronary::VesselBridge> bridges(
    static_cast<std::size_t>(confidences->GetNumberOfTuples()));
  vtkDataArray* unseen = data->GetArray(vtkCoronaryArrayNames::BridgeUnseen);
  for (std::size_t b = 0; b < bridges.size(); ++b)
  {
    const auto n = static_cast<vtkIdType>(b);
    bridges[b].confidence = confidences->GetTuple1(n);
    bridges[b].unseen =
      unseen && n < unseen->GetNumberOfTuples() ? unseen->GetComponent(n, 0) : 0.0;
    require(bridges[b].confidence >= 0.0 && bridges[b].confidence <= 1.0,
      vtkCoronaryArrayNames::BridgeConfidences);
  }
  for (vtkIdType n = 0; n < points->GetNumberOfTuples(); ++n)
  {
    double tuple[4];
    points->GetTuple(n, tuple);
    const coronary::Vector3 place(tuple);
    require(place.allFinite() && tuple[3] >= 0.0 && tuple[3] < static_cast<double>(bridges.size()),
      vtkCoronaryArrayNames::BridgePoints);
    bridges[static_cast<std::size_t>(tuple[3])].points.push_back(place);
  }
  for (const coronary::VesselBridge& bridge : bridges)
  {
    require(!bridge.points.empty(), vtkCoronaryArrayNames::BridgePoints);
  }
  return bridges;
}

std::string PropertyMessage(std::string message, std::initializer_list<const char*> prefixes)
{
  for (const std::string prefix : prefixes)
  {
    if (message.compare(0, prefix.size(), prefix) == 0)
    {
      message.erase(0, prefix.size());
    }
  }
  if (!message.empty())
  {
    message.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(message.front())));
  }
  return message;
}

namespace
{
/// Takes the error by which an executive repeats that a request failed; passes on any other one.
class EchoSilencer : public vtkCommand
{
public:
  static EchoSilencer* New() { return new EchoSilencer; }

  void Execute(vtkObject* executive, unsigned long, void* data) override
  {
    executive->RemoveObserver(this->Tag);
    const auto* text = static_cast<const char*>(data);
    if (text && std::string(text).find("returned failure for request") == std::string::npos)
    {
      vtkOutputWindowDisplayErrorText(text);
    }
  }

  unsigned long Tag = 0;
};

/// An error of the filter, but for one that it has reported with everything as it is now, and that nobody observes.
void Report(vtkAlgorithm* filter, const std::string& message)
{
  static vtkInformationStringKey* const lastKey =
    vtkInformationStringKey::MakeKey("LAST_FAILURE", "vtkCoronary");
  auto* executive = vtkDemandDrivenPipeline::SafeDownCast(filter->GetExecutive());
  const std::string failure =
    message + "@" + std::to_string(executive ? executive->GetPipelineMTime() : 0);
  const char* last = filter->GetInformation()->Get(lastKey);
  if (!last || failure != last || filter->HasObserver(vtkCommand::ErrorEvent))
  {
    filter->GetInformation()->Set(lastKey, failure);
    vtkErrorWithObjectMacro(filter, << message);
  }
}
}

int ReportFailure(vtkAlgorithm* filter, const std::string& message)
{
  Report(filter, message);
  vtkExecutive* executive = filter->GetExecutive();
  if (executive && !executive->HasObserver(vtkCommand::ErrorEvent))
  {
    vtkNew<EchoSilencer> silencer;
    silencer->Tag = executive->AddObserver(vtkCommand::ErrorEvent, silencer);
  }
  return 0;
}

int ReportEmptied(vtkAlgorithm* filter, const std::string& message)
{
  vtkExecutive* executive = filter->GetExecutive();
  if (executive && executive->IsA("vtkPVCompositeDataPipeline"))
  {
    Report(filter, message);
    return 1;
  }
  return ReportFailure(filter, message);
}

int FinishFailedRequest(vtkAlgorithm* filter, vtkInformationVector* outputs,
  const std::string& memory, std::initializer_list<const char*> prefixes)
{
  int result = 0;
  try
  {
    throw;
  }
  catch (const coronary::Cancelled&)
  {
    vtkDebugWithObjectMacro(filter, "aborted");
    result = 1;
  }
  catch (const std::bad_alloc&)
  {
    result = ReportEmptied(filter, "Not enough memory " + memory);
  }
  catch (const std::exception& error)
  {
    result = ReportEmptied(filter, PropertyMessage(error.what(), prefixes));
  }
  for (int port = 0; port < outputs->GetNumberOfInformationObjects(); ++port)
  {
    vtkInformation* info = outputs->GetInformationObject(port);
    if (vtkDataObject* output = vtkDataObject::GetData(info))
    {
      output->Initialize();
    }
    info->Set(vtkDemandDrivenPipeline::DATA_NOT_GENERATED(), 1);
  }
  return result;
}
}
