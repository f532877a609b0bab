#include "vtkSurfaceCleaner.h"

#include "SurfaceCleaning.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkTriangleSurface.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdList.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMath.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkTriangleFilter.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

using coronary::CleanedSurface;
using coronary::SurfaceCleaningCounts;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkSurfaceCleaner);

namespace
{
/// The polygons as triangles, and the cell of the input that each one is from.
std::vector<coronary::Triangle> Triangulated(vtkPolyData* surface, std::vector<vtkIdType>& cellOf)
{
  constexpr const char* cellIds = "cell ids of the surface cleaner";
  vtkNew<vtkPolyData> copy;
  copy->SetPoints(surface->GetPoints());
  copy->SetPolys(surface->GetPolys());
  copy->SetStrips(surface->GetStrips());
  std::vector<vtkIdType> ids(copy->GetNumberOfCells());
  // Cells of the input are counted after its vertices and lines.
  std::iota(ids.begin(), ids.end(), surface->GetNumberOfVerts() + surface->GetNumberOfLines());
  if (copy->GetNumberOfStrips() == 0 && copy->GetPolys()->IsHomogeneous() == 3)
  {
    cellOf = ids;
    return vtkCoronary::ReadTriangles(copy);
  }
  // The triangle filter would leave such polygons out without a word.
  vtkNew<vtkIdList> corners;
  for (vtkIdType cell = 0; cell < copy->GetNumberOfCells(); ++cell)
  {
    copy->GetCellPoints(cell, corners);
    for (const vtkIdType point : *corners)
    {
      const coronary::Vector3 place(copy->GetPoint(point));
      vtkCoronary::Require(
        place.allFinite(), "Point " + std::to_string(point) + " of the surface is not finite");
    }
  }
  vtkCoronary::AddArray<vtkIdTypeArray>(copy->GetCellData(), cellIds, ids);
  vtkNew<vtkTriangleFilter> triangulate;
  triangulate->SetInputData(copy);
  triangulate->PassVertsOff();
  triangulate->PassLinesOff();
  triangulate->Update();
  vtkPolyData* triangles = triangulate->GetOutput();
  vtkDataArray* source = triangles->GetCellData()->GetArray(cellIds);
  for (vtkIdType i = 0; i < triangles->GetNumberOfCells(); ++i)
  {
    cellOf.push_back(static_cast<vtkIdType>(source->GetComponent(i, 0)));
  }
  return vtkCoronary::ReadTriangles(triangles);
}

void WriteSummary(vtkFieldData* field, const CleanedSurface& surface)
{
  const auto sentences = [field](const char* name, const std::vector<std::string>& values)
  {
    vtkNew<vtkStringArray> array;
    array->SetName(name);
    for (const std::string& value : values)
    {
      array->InsertNextValue(vtkCoronary::PropertyMessage(value));
    }
    field->AddArray(array);
  };
  sentences(vtkCoronaryArrayNames::Repairs, surface.repairs);
  sentences(vtkCoronaryArrayNames::Warnings, surface.warnings);
  vtkCoronary::AddArray<vtkDoubleArray>(field, vtkCoronaryArrayNames::MaximumDisplacement,
    std::vector<double>{ surface.maximumDisplacement });
  using Counts = SurfaceCleaningCounts;
  for (const auto& [name, member] :
    std::initializer_list<std::pair<const char*, std::int64_t Counts::*>>{
      { "MergedPoints", &Counts::mergedPoints },
      { "DegenerateTriangles", &Counts::degenerateTriangles },
      { "DuplicateTriangles", &Counts::duplicateTriangles },
      { "NonManifoldEdges", &Counts::nonManifoldEdges },
      { "NonManifoldPoints", &Counts::nonManifoldPoints },
      { "TurnedTriangles", &Counts::turnedTriangles },
      { "SmallComponents", &Counts::smallComponents },
      { "InnerComponents", &Counts::innerComponents },
      { "SelfIntersections", &Counts::selfIntersections }, { "JoinedEnds", &Counts::joinedEnds },
      { "FilledHoles", &Counts::filledHoles }, { "Caps", &Counts::caps },
      { "BadTriangles", &Counts::badTriangles }, { "OpenEdges", &Counts::openEdges },
      { "RemainingIntersections", &Counts::remainingIntersections },
      { "RemainingBadTriangles", &Counts::remainingBadTriangles } })
  {
    vtkCoronary::AddArray<vtkIdTypeArray>(
      field, name, std::vector<vtkIdType>{ surface.counts.*member });
  }
}
}

vtkSurfaceCleaner::vtkSurfaceCleaner()
  : EntityArrayName(vtkCoronaryArrayNames::CellEntityIds)
{
}

int vtkSurfaceCleaner::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  outputs->GetInformationObject(0)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  return 1;
}

int vtkSurfaceCleaner::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, 1, outputs);
  return 1;
}

int vtkSurfaceCleaner::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* input = vtkPolyData::GetData(inputs[0], 0);
  vtkPolyData* output = vtkPolyData::GetData(outputs, 0);
  if (outputs->GetInformationObject(0)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    coronary::SurfaceCleaningSettings settings;
    settings.minimumComponentShare = this->MinimumComponentShare;
    settings.joinDistance = this->JoinDistance;
    settings.fillHoles = this->FillHoles;
    settings.capEnds = this->CapEnds;
    settings.resolveIntersections = this->ResolveIntersections;
    settings.minimumAngle = vtkMath::RadiansFromDegrees(this->MinimumAngle);
    settings.Validate();
    vtkCoronary::Require(!this->EntityArrayName.empty(), "An output array needs a name");
    if (input->GetNumberOfPoints() == 0)
    {
      return 1;
    }
    std::vector<vtkIdType> cellOf;
    const std::vector<coronary::Triangle> triangles = Triangulated(input, cellOf);
    const CleanedSurface surface = coronary::CleanSurface(
      vtkCoronary::ReadPoints(input), triangles, settings, vtkCoronary::ProgressOf(this));
    for (const std::string& warning : surface.warnings)
    {
      vtkWarningMacro(<< vtkCoronary::PropertyMessage(warning));
    }

    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    points->SetNumberOfPoints(static_cast<vtkIdType>(surface.points.size()));
    vtkPointData* pointData = output->GetPointData();
    pointData->CopyAllocate(input->GetPointData(), points->GetNumberOfPoints());
    for (vtkIdType i = 0; i < points->GetNumberOfPoints(); ++i)
    {
      points->SetPoint(i, surface.points[i].data());
      pointData->CopyData(input->GetPointData(), surface.nearestPoint[i], i);
    }
    vtkNew<vtkCellArray> cells;
    vtkCellData* cellData = output->GetCellData();
    const auto count = static_cast<vtkIdType>(surface.triangles.size());
    cellData->CopyAllocate(input->GetCellData(), count);
    std::vector<vtkIdType> source(count, -1);
    std::vector<int> entity(count, 1);
    vtkDataArray* given = input->GetCellData()->GetArray(this->EntityArrayName.c_str());
    const int lastEntity =
      given != nullptr ? std::max(1, static_cast<int>(given->GetRange()[1])) : 1;
    for (vtkIdType i = 0; i < count; ++i)
    {
      const coronary::Triangle& t = surface.triangles[i];
      const vtkIdType corners[3] = { t[0], t[1], t[2] };
      cells->InsertNextCell(3, corners);
      const vtkIdType nearest = cellOf[surface.nearestCell[i]];
      cellData->CopyData(input->GetCellData(), nearest, i);
      source[i] = surface.sourceCell[i] >= 0 ? nearest : -1;
      entity[i] = surface.cap[i] > 0 ? lastEntity + surface.cap[i]
        : given != nullptr           ? static_cast<int>(given->GetComponent(nearest, 0))
                                     : 1;
    }
    output->SetPoints(points);
    output->SetPolys(cells);
    vtkCoronary::AddArray<vtkIdTypeArray>(
      pointData, vtkCoronaryArrayNames::SurfacePointId, surface.sourcePoint);
    vtkCoronary::AddArray<vtkIdTypeArray>(cellData, vtkCoronaryArrayNames::SurfaceCellId, source);
    vtkCoronary::AddArray<vtkIntArray>(cellData, this->EntityArrayName, entity);
    vtkCoronary::AddArray<vtkIntArray>(
      cellData, vtkCoronaryArrayNames::RegionIds, surface.component);
    WriteSummary(output->GetFieldData(), surface);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "to clean the surface");
  }
}

void vtkSurfaceCleaner::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "MinimumComponentShare: " << this->MinimumComponentShare << "\n";
  os << indent << "JoinDistance: " << this->JoinDistance << "\n";
  os << indent << "FillHoles: " << this->FillHoles << "\n";
  os << indent << "CapEnds: " << this->CapEnds << "\n";
  os << indent << "ResolveIntersections: " << this->ResolveIntersections << "\n";
  os << indent << "MinimumAngle: " << this->MinimumAngle << "\n";
  os << indent << "EntityArrayName: " << this->EntityArrayName << "\n";
}
