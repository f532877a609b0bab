#include "vtkTetrahedralMesher.h"

#include "TetrahedralMesh.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkTriangleSurface.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCellType.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
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
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <vector>

using coronary::TetrahedralMesh;
using coronary::TetrahedralMeshInput;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkTetrahedralMesher);

namespace
{
void ReadSkeleton(vtkPolyData* skeleton, TetrahedralMeshInput& input)
{
  const coronary::Polylines lines =
    vtkCoronary::LinesOf(skeleton, vtkCoronary::FindRadius(skeleton));
  input.skeletonPoints = lines.points;
  input.skeletonRadius = lines.radius;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    for (std::size_t i = 1; i < line.size(); ++i)
    {
      input.skeletonEdges.emplace_back(line[i - 1], line[i]);
    }
  }
}

void WriteSummary(vtkFieldData* field, const TetrahedralMesh& mesh)
{
  const auto number = [field](const char* name, double value)
  { vtkCoronary::AddArray<vtkDoubleArray>(field, name, std::vector<double>{ value }); };
  vtkNew<vtkStringArray> backend;
  backend->SetName(vtkCoronaryArrayNames::Backend);
  backend->InsertNextValue(mesh.backend == coronary::TetrahedralBackend::Cgal ? "CGAL" : "TetGen");
  field->AddArray(backend);
  vtkCoronary::AddArray<vtkIntArray>(
    field, vtkCoronaryArrayNames::Tries, std::vector<int>{ mesh.tries });
  number(vtkCoronaryArrayNames::RepairDisplacement, mesh.repairDisplacement);
  const double poor = vtkMath::RadiansFromDegrees(15.0);
  number(vtkCoronaryArrayNames::MeshMinimumDihedralAngle,
    *std::min_element(mesh.minimumDihedral.begin(), mesh.minimumDihedral.end()));
  number(vtkCoronaryArrayNames::PoorFraction,
    static_cast<double>(std::count_if(mesh.minimumDihedral.begin(), mesh.minimumDihedral.end(),
      [poor](double angle) { return angle < poor; })) /
      static_cast<double>(mesh.minimumDihedral.size()));
  number(vtkCoronaryArrayNames::MeshMinimumVolume,
    *std::min_element(mesh.volume.begin(), mesh.volume.end()));
  number(vtkCoronaryArrayNames::TotalVolume,
    std::accumulate(mesh.volume.begin(), mesh.volume.end(), 0.0));
  number(vtkCoronaryArrayNames::MeshMaximumRadiusEdgeRatio,
    *std::max_element(mesh.radiusEdgeRatio.begin(), mesh.radiusEdgeRatio.end()));
  vtkNew<vtkStringArray> warnings;
  warnings->SetName(vtkCoronaryArrayNames::Warnings);
  for (const std::string& warning : mesh.warnings)
  {
    warnings->InsertNextValue(warning);
  }
  field->AddArray(warnings);
}
}

vtkTetrahedralMesher::vtkTetrahedralMesher()
  : EntityArrayName(vtkCoronaryArrayNames::CellEntityIds)
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(3);
}

void vtkTetrahedralMesher::SetSkeletonData(vtkPolyData* skeleton)
{
  this->SetInputData(SkeletonPort, skeleton);
}

vtkPolyData* vtkTetrahedralMesher::GetBoundary()
{
  return vtkPolyData::SafeDownCast(this->GetOutputDataObject(BoundaryPort));
}

vtkPolyData* vtkTetrahedralMesher::GetEdges()
{
  return vtkPolyData::SafeDownCast(this->GetOutputDataObject(EdgesPort));
}

int vtkTetrahedralMesher::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  if (port == SkeletonPort)
  {
    info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

int vtkTetrahedralMesher::FillOutputPortInformation(int port, vtkInformation* info)
{
  info->Set(
    vtkDataObject::DATA_TYPE_NAME(), port == VolumePort ? "vtkUnstructuredGrid" : "vtkPolyData");
  return 1;
}

int vtkTetrahedralMesher::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkTetrahedralMesher::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  return 1;
}

int vtkTetrahedralMesher::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* surface = vtkPolyData::GetData(inputs[SurfacePort], 0);
  vtkPolyData* skeleton = vtkPolyData::GetData(inputs[SkeletonPort], 0);
  vtkUnstructuredGrid* volume = vtkUnstructuredGrid::GetData(outputs, VolumePort);
  vtkPolyData* boundary = vtkPolyData::GetData(outputs, BoundaryPort);
  vtkPolyData* edges = vtkPolyData::GetData(outputs, EdgesPort);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  if (outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    coronary::TetrahedralMeshSettings settings;
    settings.backend = static_cast<coronary::TetrahedralBackend>(this->Backend);
    settings.radiusEdgeRatio = this->RadiusEdgeRatio;
    settings.minimumDihedral = vtkMath::RadiansFromDegrees(this->MinimumDihedralAngle);
    settings.minimumVolume = this->MinimumVolume;
    settings.sizeFactor = this->SizeFactor;
    settings.repair = this->Repair;
    settings.outside =
      this->LeaveOutside ? coronary::OutsidePolicy::LeaveOut : coronary::OutsidePolicy::Refuse;
    settings.timeLimit = this->TimeLimit;
    settings.workerFolder = this->WorkerFolder;
    settings.Validate();
    if (this->EntityArrayName.empty())
    {
      throw std::invalid_argument("An output array needs a name");
    }
    if (surface->GetNumberOfPoints() == 0)
    {
      return 1;
    }
    TetrahedralMeshInput input;
    input.points = vtkCoronary::ReadPoints(surface);
    input.triangles = vtkCoronary::ReadTriangles(surface);
    if (skeleton != nullptr)
    {
      ReadSkeleton(skeleton, input);
    }
    const TetrahedralMesh mesh =
      coronary::MakeTetrahedralMesh(input, settings, vtkCoronary::ProgressOf(this));
    for (const std::string& warning : mesh.warnings)
    {
      vtkWarningMacro(<< vtkCoronary::PropertyMessage(warning));
    }

    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    points->SetNumberOfPoints(static_cast<vtkIdType>(mesh.points.size()));
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
    {
      points->SetPoint(static_cast<vtkIdType>(i), mesh.points[i].data());
    }
    for (vtkPointSet* output : { static_cast<vtkPointSet*>(volume),
           static_cast<vtkPointSet*>(boundary), static_cast<vtkPointSet*>(edges) })
    {
      output->SetPoints(points);
      vtkCoronary::AddArray<vtkIdTypeArray>(
        output->GetPointData(), vtkCoronaryArrayNames::SurfacePointId, mesh.surfacePoint);
      vtkCoronary::AddArray<vtkIdTypeArray>(
        output->GetPointData(), vtkCoronaryArrayNames::SkeletonPointId, mesh.skeletonPoint);
    }

    vtkNew<vtkCellArray> tetrahedra;
    for (const coronary::Tetrahedron& t : mesh.tetrahedra)
    {
      const vtkIdType corners[4] = { t[0], t[1], t[2], t[3] };
      tetrahedra->InsertNextCell(4, corners);
    }
    volume->SetCells(VTK_TETRA, tetrahedra);
    vtkCellData* cells = volume->GetCellData();
    vtkCoronary::AddArray<vtkIntArray>(cells, vtkCoronaryArrayNames::RegionIds, mesh.region);
    vtkCoronary::AddArray<vtkIntArray>(
      cells, this->EntityArrayName, std::vector<int>(mesh.tetrahedra.size(), 0));
    vtkCoronary::AddArray<vtkDoubleArray>(
      cells, vtkCoronaryArrayNames::TetrahedronVolume, mesh.volume);
    vtkCoronary::AddArray<vtkDoubleArray>(
      cells, vtkCoronaryArrayNames::MinimumDihedralAngle, mesh.minimumDihedral);
    vtkCoronary::AddArray<vtkDoubleArray>(
      cells, vtkCoronaryArrayNames::RadiusEdgeRatio, mesh.radiusEdgeRatio);
    WriteSummary(volume->GetFieldData(), mesh);

    vtkNew<vtkCellArray> triangles;
    vtkCellData* faces = boundary->GetCellData();
    vtkCellData* inputFaces = surface->GetCellData();
    const auto count = static_cast<vtkIdType>(mesh.boundary.size());
    // Cells of the surface are counted after its vertices and lines.
    const vtkIdType firstFace = surface->GetNumberOfVerts() + surface->GetNumberOfLines();
    faces->CopyAllocate(inputFaces, count);
    for (vtkIdType i = 0; i < count; ++i)
    {
      const coronary::Triangle& t = mesh.boundary[i];
      const vtkIdType corners[3] = { t[0], t[1], t[2] };
      triangles->InsertNextCell(3, corners);
      faces->CopyData(inputFaces, firstFace + mesh.boundaryCell[i], i);
    }
    boundary->SetPolys(triangles);
    if (faces->GetAbstractArray(this->EntityArrayName.c_str()) == nullptr)
    {
      vtkCoronary::AddArray<vtkIntArray>(
        faces, this->EntityArrayName, std::vector<int>(mesh.boundary.size(), 1));
    }
    std::vector<std::int64_t> surfaceCell = mesh.boundaryCell;
    for (std::int64_t& cell : surfaceCell)
    {
      cell += firstFace;
    }
    vtkCoronary::AddArray<vtkIdTypeArray>(faces, vtkCoronaryArrayNames::SurfaceCellId, surfaceCell);
    vtkCoronary::AddArray<vtkIdTypeArray>(
      faces, vtkCoronaryArrayNames::TetrahedronId, mesh.boundaryElement);

    vtkNew<vtkCellArray> lines;
    std::vector<std::int64_t> source;
    for (const TetrahedralMesh::Edge& edge : mesh.skeletonEdges)
    {
      const vtkIdType ends[2] = { edge.from, edge.to };
      lines->InsertNextCell(2, ends);
      source.push_back(edge.skeletonEdge);
    }
    edges->SetLines(lines);
    vtkCoronary::AddArray<vtkIdTypeArray>(
      edges->GetCellData(), vtkCoronaryArrayNames::SkeletonEdgeId, source);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "to mesh the volume");
  }
}

void vtkTetrahedralMesher::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Backend: " << this->Backend << "\n";
  os << indent << "RadiusEdgeRatio: " << this->RadiusEdgeRatio << "\n";
  os << indent << "MinimumDihedralAngle: " << this->MinimumDihedralAngle << "\n";
  os << indent << "MinimumVolume: " << this->MinimumVolume << "\n";
  os << indent << "SizeFactor: " << this->SizeFactor << "\n";
  os << indent << "Repair: " << this->Repair << "\n";
  os << indent << "LeaveOutside: " << this->LeaveOutside << "\n";
  os << indent << "TimeLimit: " << this->TimeLimit << "\n";
  os << indent << "WorkerFolder: " << this->WorkerFolder << "\n";
  os << indent << "EntityArrayName: " << this->EntityArrayName << "\n";
}
