#include "vtkMeshDistanceMetrics.h"

#include "MeshDistance.h"
#include "Numbers.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkSurfaceInput.h"

#include "vtkDataObject.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkTable.h"

#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

using coronary::BranchDistance;
using coronary::MeshDistance;
using coronary::NaN;
using coronary::SideDistance;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkMeshDistanceMetrics);

namespace
{
using Row = std::vector<std::pair<const char*, double>>;

Row TotalRow(const MeshDistance& d)
{
  return { { "HD", d.hausdorff }, { "HD_AB", d.ab.hausdorff }, { "HD_BA", d.ba.hausdorff },
    { "HD95", d.hausdorff95 }, { "HD95_AB", d.ab.percentile95 }, { "HD95_BA", d.ba.percentile95 },
    { "HD95_pooled", d.percentile95 }, { "MSD", d.ab.vertexMean }, { "MSD_BA", d.ba.vertexMean },
    { "MSD_area", d.mean }, { "MSD_area_AB", d.ab.mean }, { "MSD_area_BA", d.ba.mean },
    { "RMS", d.rms }, { "RMS_AB", d.ab.rms }, { "RMS_BA", d.ba.rms },
    { "error_bound", d.hausdorffError }, { "quadrature_error", d.quadratureError },
    { "Area_A", d.ab.area }, { "Area_B", d.ba.area } };
}

Row BranchRow(const BranchDistance& branch)
{
  const SideDistance& d = branch.distance;
  const bool a = branch.side == 0;
  const auto ofA = [&](double value) { return a ? value : NaN; };
  const auto ofB = [&](double value) { return a ? NaN : value; };
  return { { "HD", d.hausdorff }, { "HD_AB", ofA(d.hausdorff) }, { "HD_BA", ofB(d.hausdorff) },
    { "HD95", d.percentile95 }, { "HD95_AB", ofA(d.percentile95) },
    { "HD95_BA", ofB(d.percentile95) }, { "HD95_pooled", NaN }, { "MSD", d.vertexMean },
    { "MSD_BA", ofB(d.vertexMean) }, { "MSD_area", d.mean }, { "MSD_area_AB", ofA(d.mean) },
    { "MSD_area_BA", ofB(d.mean) }, { "RMS", d.rms }, { "RMS_AB", ofA(d.rms) },
    { "RMS_BA", ofB(d.rms) }, { "error_bound", d.hausdorffError }, { "quadrature_error", NaN },
    { "Area_A", ofA(d.area) }, { "Area_B", ofB(d.area) } };
}

void WriteTable(vtkTable* table, const MeshDistance& distances)
{
  std::vector<Row> rows;
  std::vector<int> side;
  std::vector<vtkIdType> group;
  vtkNew<vtkStringArray> names;
  names->SetName("Name");
  for (const BranchDistance& branch : distances.branches)
  {
    names->InsertNextValue(
      std::string(branch.side == 0 ? "result" : "reference") + " " + std::to_string(branch.group));
    side.push_back(branch.side);
    group.push_back(branch.group);
    rows.push_back(BranchRow(branch));
  }
  names->InsertNextValue("total");
  side.push_back(-1);
  group.push_back(-1);
  rows.push_back(TotalRow(distances));
  vtkFieldData* columns = table->GetRowData();
  columns->AddArray(names);
  vtkCoronary::AddArray<vtkIntArray>(columns, "Side", side);
  vtkCoronary::AddArray<vtkIdTypeArray>(columns, "GroupId", group);
  for (std::size_t c = 0; c < rows.front().size(); ++c)
  {
    std::vector<double> values;
    values.reserve(rows.size());
    for (const Row& row : rows)
    {
      values.push_back(row[c].second);
    }
    vtkCoronary::AddArray<vtkDoubleArray>(columns, rows.front()[c].first, values);
  }
}

void WriteFieldData(vtkFieldData* field, const MeshDistance& distances)
{
  for (const auto& [name, value] : TotalRow(distances))
  {
    vtkCoronary::AddArray<vtkDoubleArray>(field, name, std::vector<double>{ value });
  }
  vtkNew<vtkDoubleArray> points;
  points->SetName(vtkCoronaryArrayNames::HausdorffPoints);
  points->SetNumberOfComponents(3);
  for (const SideDistance* side : { &distances.ab, &distances.ba })
  {
    points->InsertNextTuple(side->at.data());
    points->InsertNextTuple(side->nearest.data());
  }
  field->AddArray(points);
  vtkCoronary::AddArray<vtkIntArray>(field, vtkCoronaryArrayNames::SignedDistance,
    std::vector<int>{ distances.signedA ? 1 : 0, distances.signedB ? 1 : 0 });
}
}

vtkMeshDistanceMetrics::vtkMeshDistanceMetrics()
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(3);
}

void vtkMeshDistanceMetrics::SetReferenceData(vtkDataObject* reference)
{
  this->SetInputDataInternal(ReferencePort, reference);
}

vtkPolyData* vtkMeshDistanceMetrics::GetReferenceOutput()
{
  return vtkPolyData::SafeDownCast(this->GetOutputDataObject(ReferencePort));
}

vtkTable* vtkMeshDistanceMetrics::GetTable()
{
  return vtkTable::SafeDownCast(this->GetOutputDataObject(TablePort));
}

int vtkMeshDistanceMetrics::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkCompositeDataSet");
  return 1;
}

int vtkMeshDistanceMetrics::FillOutputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkDataObject::DATA_TYPE_NAME(), port == TablePort ? "vtkTable" : "vtkPolyData");
  return 1;
}

int vtkMeshDistanceMetrics::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  vtkCoronary::PublishCommonTime(inputs, outputs);
  return 1;
}

int vtkMeshDistanceMetrics::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // Surfaces are compared as a whole.
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  vtkCoronary::RequestCommonTime(inputs, outputs->GetInformationObject(port));
  return 1;
}

int vtkMeshDistanceMetrics::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* surfaces[2] = { vtkPolyData::GetData(outputs, ResultPort),
    vtkPolyData::GetData(outputs, ReferencePort) };
  vtkTable* table = vtkTable::GetData(outputs, TablePort);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  if (outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    coronary::MeshDistanceSettings settings;
    settings.errorBound = this->ErrorBound;
    settings.signedDistances = this->SignedDistances;
    settings.clipEnds = this->EndLength != 0.0;
    if (settings.clipEnds)
    {
      settings.endLength = this->EndLength;
    }
    settings.names = { "the result", "the reference" };
    settings.Validate();
    vtkCoronary::Require(this->TimeTolerance >= 0.0, "TimeTolerance must be 0 or more");
    const std::string mismatch = vtkCoronary::TimeMismatch(inputs, this->TimeTolerance);
    vtkCoronary::Require(mismatch.empty(), mismatch);
    coronary::SurfaceMesh meshes[2];
    for (int side = 0; side < 2; ++side)
    {
      surfaces[side]->ShallowCopy(
        vtkCoronary::TrianglesOf(vtkDataObject::GetData(inputs[side], 0)));
      meshes[side] = vtkCoronary::SurfaceOf(surfaces[side], vtkCoronaryArrayNames::GroupIds,
        settings.clipEnds ? vtkCoronaryArrayNames::CellEntityIds : std::string());
    }
    const MeshDistance distances =
      coronary::CompareSurfaces(meshes[0], meshes[1], settings, vtkCoronary::ProgressOf(this));
    for (const std::string& warning : distances.warnings)
    {
      vtkWarningMacro(<< vtkCoronary::PropertyMessage(warning));
    }
    for (int side = 0; side < 2; ++side)
    {
      vtkCoronary::AddArray<vtkDoubleArray>(surfaces[side]->GetPointData(),
        vtkCoronaryArrayNames::SurfaceDistance,
        side == 0 ? distances.pointDistancesA : distances.pointDistancesB);
      surfaces[side]->GetPointData()->SetActiveScalars(vtkCoronaryArrayNames::SurfaceDistance);
      // Not the input's own field data.
      vtkNew<vtkFieldData> field;
      field->ShallowCopy(surfaces[side]->GetFieldData());
      surfaces[side]->SetFieldData(field);
      WriteFieldData(field, distances);
    }
    WriteTable(table, distances);
    WriteFieldData(table->GetFieldData(), distances);
    if (vtkAbstractArray* phase =
          surfaces[0]->GetFieldData()->GetAbstractArray(vtkCoronaryArrayNames::PhaseTime))
    {
      table->GetFieldData()->AddArray(phase);
    }
    vtkCoronary::SetCommonTime(inputs, outputs);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(
      this, outputs, "to compare the surfaces", { "MeshDistanceSettings: " });
  }
}

void vtkMeshDistanceMetrics::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "ErrorBound: " << this->ErrorBound << "\n";
  os << indent << "SignedDistances: " << this->SignedDistances << "\n";
  os << indent << "EndLength: " << this->EndLength << "\n";
  os << indent << "TimeTolerance: " << this->TimeTolerance << "\n";
}
