#include "vtkMeshSequenceWriter.h"

#include "AtomicFile.h"
#include "FileSeries.h"
#include "MeshSequenceReport.h"
#include "PartialProgress.h"
#include "RankGroup.h"
#include "StagedFolder.h"
#include "SurfaceFile.h"
#include "TetrahedralBoundary.h"
#include "vtkBoneMotion.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkGltfModel.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkIdList.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkTable.h"
#include "vtkUnstructuredGrid.h"
#include "vtkXMLPolyDataWriter.h"
#include "vtkXMLUnstructuredGridWriter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace fs = std::filesystem;
namespace names = vtkCoronaryArrayNames;
using coronary::Tetrahedron;
using coronary::Triangle;
using vtkCoronary::Require;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkMeshSequenceWriter);

namespace
{
constexpr int WallId = 1;
constexpr double Degree = 0.017453292519943295769;

// Of SimVascular and svFSIplus, which take 32-bit integers only.
constexpr const char* GlobalNodeID = "GlobalNodeID";
constexpr const char* GlobalElementID = "GlobalElementID";
constexpr const char* ModelFaceID = "ModelFaceID";
constexpr const char* ModelRegionID = "ModelRegionID";

/// As the report counts them.
std::string PhaseName(std::size_t phase, double time)
{
  std::ostringstream text;
  text << "phase " << phase << " (time " << time << ')';
  return text.str();
}

/// Triangles of poly data that has nothing else.
vtkCellArray* OnlyTriangles(vtkPolyData* data, const std::string& what)
{
  Require(data->GetNumberOfVerts() == 0 && data->GetNumberOfLines() == 0 &&
      data->GetNumberOfStrips() == 0,
    what + " has vertices, lines or strips: only triangles can be written");
  vtkCellArray* polys = data->GetPolys();
  for (vtkIdType n = 0; n < polys->GetNumberOfCells(); ++n)
  {
    Require(
      polys->GetCellSize(n) == 3, what + ": cell " + std::to_string(n) + " is not a triangle");
  }
  return polys;
}

template <std::size_t Corners>
std::vector<std::array<std::int64_t, Corners>> ReadCells(vtkCellArray* cells)
{
  std::vector<std::array<std::int64_t, Corners>> result(
    static_cast<std::size_t>(cells->GetNumberOfCells()));
  vtkNew<vtkIdList> ids;
  for (std::size_t n = 0; n < result.size(); ++n)
  {
    cells->GetCellAtId(static_cast<vtkIdType>(n), ids);
    for (std::size_t k = 0; k < Corners; ++k)
    {
      result[n][k] = ids->GetId(static_cast<vtkIdType>(k));
    }
  }
  return result;
}

template <std::size_t Corners>
vtkSmartPointer<vtkCellArray> MakeCells(
  const std::vector<std::array<std::int64_t, Corners>>& elements)
{
  auto cells = vtkSmartPointer<vtkCellArray>::New();
  const auto count = static_cast<vtkIdType>(elements.size());
  cells->AllocateExact(count, static_cast<vtkIdType>(Corners) * count);
  for (const auto& element : elements)
  {
    std::array<vtkIdType, Corners> ids{};
    std::copy(element.begin(), element.end(), ids.begin());
    cells->InsertNextCell(static_cast<vtkIdType>(Corners), ids.data());
  }
  return cells;
}

std::vector<coronary::Vector3> ReadPoints(vtkPointSet* data)
{
  std::vector<coronary::Vector3> points(static_cast<std::size_t>(data->GetNumberOfPoints()));
  for (std::size_t n = 0; n < points.size(); ++n)
  {
    data->GetPoint(static_cast<vtkIdType>(n), points[n].data());
  }
  return points;
}

/// @throws std::invalid_argument(complaint) when there is no such array
vtkDataArray* NeededArray(vtkFieldData* data, const std::string& name, const std::string& complaint)
{
  vtkDataArray* array = data->GetArray(name.c_str());
  if (!array)
  {
    throw std::invalid_argument(complaint);
  }
  return array;
}

/// Ids of faces out of an array of any numbers.
std::vector<int> ReadFaceIds(vtkDataArray* array, const std::string& where)
{
  Require(array->GetNumberOfComponents() == 1, where + " must have one component");
  std::vector<int> ids(static_cast<std::size_t>(array->GetNumberOfTuples()));
  for (std::size_t n = 0; n < ids.size(); ++n)
  {
    const double value = array->GetComponent(static_cast<vtkIdType>(n), 0);
    Require(value >= 1.0 && value <= std::numeric_limits<int>::max() && value == std::floor(value),
      where + " must hold whole numbers from 1; that of cell " + std::to_string(n) + " is not");
    ids[n] = static_cast<int>(value);
  }
  return ids;
}

bool IsWeight(const char* name)
{
  const std::string text = name ? name : "";
  return text == names::BoneIndices || text == names::BoneWeightsCompact ||
    text == names::BoneWeights || text == names::DroppedWeight;
}

void RemoveWeights(vtkPointData* data)
{
  for (const char* name :
    { names::BoneIndices, names::BoneWeightsCompact, names::BoneWeights, names::DroppedWeight })
  {
    data->RemoveArray(name);
  }
}

/// The part of a mesh's boundary that has its own file, with points of its own.
struct Patch
{
  std::vector<std::int64_t> triangles; ///< of the boundary
  std::vector<vtkIdType> points;       ///< of the mesh, ascending
  vtkSmartPointer<vtkCellArray> cells;
};

/// What is the same at every phase.
struct Topology
{
  std::string entityIdsName;
  vtkIdType points = 0;
  vtkSmartPointer<vtkCellArray> inputCells; ///< at the first phase
  std::vector<Tetrahedron> tetrahedra;      ///< none: a surface alone
  bool turned = false;                      ///< corners stand in another order in the input
  std::vector<Triangle> triangles;          ///< looking outwards, on the mesh's points
  std::vector<std::int64_t> behind;         ///< per triangle: its tetrahedron
  std::vector<int> entity;                  ///< per triangle
  vtkSmartPointer<vtkCellData> data;        ///< of the triangles, where a boundary was given

  Patch PatchOf(int face) const;
};

/// All triangles, or those of one face.
Patch Topology::PatchOf(int face) const
{
  Patch patch;
  std::vector<vtkIdType> local(static_cast<std::size_t>(this->points), -1);
  for (std::size_t n = 0; n < this->triangles.size(); ++n)
  {
    if (face == 0 || this->entity[n] == face)
    {
      patch.triangles.push_back(static_cast<std::int64_t>(n));
      for (const std::int64_t corner : this->triangles[n])
      {
        local[static_cast<std::size_t>(corner)] = 0;
      }
    }
  }
  for (std::size_t n = 0; n < local.size(); ++n)
  {
    if (local[n] == 0)
    {
      local[n] = static_cast<vtkIdType>(patch.points.size());
      patch.points.push_back(static_cast<vtkIdType>(n));
    }
  }
  patch.cells = vtkSmartPointer<vtkCellArray>::New();
  for (const std::int64_t n : patch.triangles)
  {
    vtkIdType ids[3];
    for (int k = 0; k < 3; ++k)
    {
      ids[k] = local[static_cast<std::size_t>(this->triangles[static_cast<std::size_t>(n)][k])];
    }
    patch.cells->InsertNextCell(3, ids);
  }
  return patch;
}

/// Where the boundary's points are in the mesh.
std::vector<std::int64_t> PointsInMesh(vtkPolyData* boundary, vtkIdType points)
{
  std::vector<std::int64_t> map(static_cast<std::size_t>(boundary->GetNumberOfPoints()));
  vtkDataArray* ids = boundary->GetPointData()->GetArray(names::MeshPointId);
  Require(ids != nullptr || boundary->GetNumberOfPoints() == points,
    "The boundary has " + std::to_string(boundary->GetNumberOfPoints()) + " points, the mesh " +
      std::to_string(points) + ": it must be on the same points, or have the point array " +
      names::MeshPointId);
  for (std::size_t n = 0; n < map.size(); ++n)
  {
    map[n] = static_cast<std::int64_t>(n);
    if (ids)
    {
      const double value = ids->GetComponent(static_cast<vtkIdType>(n), 0);
      Require(value >= 0.0 && value < static_cast<double>(points),
        std::string("Array ") + names::MeshPointId +
          " of the boundary names a point that the mesh does not have");
      map[n] = static_cast<std::int64_t>(value);
    }
  }
  return map;
}

/// Brings the mesh's boundary into the order of the one that was given, with its data.
void TakeBoundary(vtkPolyData* boundary, Topology& topology)
{
  std::vector<Triangle> given = ReadCells<3>(OnlyTriangles(boundary, "The boundary"));
  vtkDataArray* ids = NeededArray(boundary->GetCellData(), topology.entityIdsName,
    "The boundary has no cell array " + topology.entityIdsName);
  const std::vector<int> entity =
    ReadFaceIds(ids, "Array " + topology.entityIdsName + " of the boundary");
  const std::vector<std::int64_t> map = PointsInMesh(boundary, topology.points);
  std::map<Triangle, std::size_t> known;
  for (std::size_t n = 0; n < topology.triangles.size(); ++n)
  {
    Triangle sorted = topology.triangles[n];
    std::sort(sorted.begin(), sorted.end());
    known[sorted] = n;
  }
  std::vector<Triangle> triangles;
  std::vector<std::int64_t> behind;
  for (std::size_t n = 0; n < given.size(); ++n)
  {
    Triangle sorted = given[n];
    for (std::int64_t& corner : sorted)
    {
      corner = map[static_cast<std::size_t>(corner)];
    }
    std::sort(sorted.begin(), sorted.end());
    const auto found = known.find(sorted);
    Require(found != known.end(),
      "Triangle " + std::to_string(n) +
        " of the boundary is no face on the boundary of the tetrahedra, or comes twice");
    triangles.push_back(topology.triangles[found->second]);
    behind.push_back(topology.behind[found->second]);
    known.erase(found);
  }
  Require(known.empty(),
    std::to_string(known.size()) + " faces of the tetrahedra are missing in the boundary");
  topology.triangles = std::move(triangles);
  topology.behind = std::move(behind);
  topology.entity = entity;
  topology.data = boundary->GetCellData();
}

/// Tetrahedra whose corners stand in the other order all have negative volumes.
bool IsTurned(const std::vector<coronary::Vector3>& points, const std::vector<Tetrahedron>& cells)
{
  std::size_t negative = 0;
  for (const Tetrahedron& t : cells)
  {
    negative += coronary::TetrahedronVolume(points[static_cast<std::size_t>(t[0])],
                  points[static_cast<std::size_t>(t[1])], points[static_cast<std::size_t>(t[2])],
                  points[static_cast<std::size_t>(t[3])]) < 0.0
      ? 1
      : 0;
  }
  return 10 * negative > 9 * cells.size();
}

void RequireTetrahedra(vtkUnstructuredGrid* grid)
{
  for (vtkIdType n = 0; n < grid->GetNumberOfCells(); ++n)
  {
    Require(grid->GetCellType(n) == VTK_TETRA,
      "Cell " + std::to_string(n) + " of the mesh is not a tetrahedron");
  }
}

Topology TopologyOf(vtkPointSet* mesh, vtkPolyData* boundary, const std::string& entityIdsName)
{
  Topology topology;
  topology.entityIdsName = entityIdsName;
  topology.points = mesh->GetNumberOfPoints();
  // SimVascular's ids have 32 bits.
  Require(std::max(topology.points, mesh->GetNumberOfCells()) < std::numeric_limits<int>::max(),
    "The mesh is too large: ids of points and cells must fit into 32 bits");
  if (auto* grid = vtkUnstructuredGrid::SafeDownCast(mesh))
  {
    RequireTetrahedra(grid);
    topology.inputCells = grid->GetCells();
    topology.tetrahedra = ReadCells<4>(grid->GetCells());
    topology.turned = IsTurned(ReadPoints(mesh), topology.tetrahedra);
    if (topology.turned)
    {
      for (Tetrahedron& t : topology.tetrahedra)
      {
        std::swap(t[0], t[1]);
      }
    }
    for (const auto& [triangle, tetrahedron] : coronary::BoundaryFaces(topology.tetrahedra))
    {
      topology.triangles.push_back(triangle);
      topology.behind.push_back(tetrahedron);
    }
    topology.entity.assign(topology.triangles.size(), WallId);
    if (boundary)
    {
      TakeBoundary(boundary, topology);
    }
    return topology;
  }
  Require(boundary == nullptr,
    "A boundary (port 1) is for tetrahedra; triangles have cell data " + entityIdsName +
      " of their own");
  auto* surface = vtkPolyData::SafeDownCast(mesh);
  topology.inputCells = OnlyTriangles(surface, "The mesh");
  topology.triangles = ReadCells<3>(topology.inputCells);
  vtkDataArray* ids = surface->GetCellData()->GetArray(entityIdsName.c_str());
  topology.entity = ids ? ReadFaceIds(ids, "Array " + entityIdsName + " of the mesh")
                        : std::vector<int>(topology.triangles.size(), WallId);
  return topology;
}

/// @throws std::invalid_argument that says what differs
void RequireSame(const Topology& topology, vtkPointSet* mesh)
{
  const bool volume = !topology.tetrahedra.empty();
  auto* grid = vtkUnstructuredGrid::SafeDownCast(mesh);
  auto* surface = vtkPolyData::SafeDownCast(mesh);
  Require(volume ? grid != nullptr : surface != nullptr, "the mesh is of another type");
  Require(mesh->GetNumberOfPoints() == topology.points,
    "the mesh has " + std::to_string(mesh->GetNumberOfPoints()) + " points instead of " +
      std::to_string(topology.points));
  vtkCellArray* cells = volume ? grid->GetCells() : surface->GetPolys();
  const vtkIdType wanted = topology.inputCells->GetNumberOfCells();
  Require(mesh->GetNumberOfCells() == wanted && cells->GetNumberOfCells() == wanted,
    "the mesh has " + std::to_string(mesh->GetNumberOfCells()) + " cells instead of " +
      std::to_string(wanted));
  if (grid)
  {
    RequireTetrahedra(grid);
  }
  if (cells == topology.inputCells)
  {
    return;
  }
  vtkNew<vtkIdList> ids;
  vtkNew<vtkIdList> firstIds;
  for (vtkIdType n = 0; n < wanted; ++n)
  {
    cells->GetCellAtId(n, ids);
    topology.inputCells->GetCellAtId(n, firstIds);
    Require(ids->GetNumberOfIds() == firstIds->GetNumberOfIds() &&
        std::equal(ids->begin(), ids->end(), firstIds->begin()),
      "cell " + std::to_string(n) + " of the mesh has other points than at the first phase");
  }
}

bool IsNameCharacter(char c)
{
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
    c == '_' || c == '.';
}

std::string FileNameOf(std::string text)
{
  std::replace_if(
    text.begin(), text.end(), [](char c) { return !IsNameCharacter(c); }, '_');
  return text;
}

/// Names of the caps, as far as the caps' vertices tell.
std::map<int, std::string> NamesOfCaps(vtkPolyData* caps, const std::string& entityIdsName)
{
  std::map<int, std::string> result;
  if (!caps || caps->GetNumberOfPoints() == 0)
  {
    return result;
  }
  vtkDataArray* array = NeededArray(
    caps->GetPointData(), entityIdsName, "The caps have no point array " + entityIdsName);
  const std::vector<int> ids = ReadFaceIds(array, "Array " + entityIdsName + " of the caps");
  vtkDataArray* inlet = caps->GetPointData()->GetArray(names::IsInlet);
  auto* label =
    vtkStringArray::SafeDownCast(caps->GetPointData()->GetAbstractArray(names::SegmentLabel));
  for (std::size_t n = 0; n < ids.size(); ++n)
  {
    const auto at = static_cast<vtkIdType>(n);
    std::string name = "cap";
    if (inlet)
    {
      name = inlet->GetComponent(at, 0) != 0.0 ? "inlet" : "outlet";
    }
    const std::string vessel = label ? std::string(label->GetValue(at)) : std::string();
    result[ids[n]] = FileNameOf(name + "_" + (vessel.empty() ? std::to_string(ids[n]) : vessel));
  }
  return result;
}

/// Faces by ascending ids, each with a name of its own.
std::vector<coronary::MeshSequenceReport::Face> FacesOf(const Topology& topology,
  const std::map<int, std::string>& wanted, const std::map<int, std::string>& ofCaps)
{
  std::map<int, std::int64_t> counts;
  for (const int id : topology.entity)
  {
    ++counts[id];
  }
  for (const auto& [id, name] : wanted)
  {
    Require(counts.count(id) > 0,
      "FaceName '" + name + "' is for face " + std::to_string(id) + ", which the mesh has not");
  }
  std::map<std::string, int> uses;
  std::vector<coronary::MeshSequenceReport::Face> faces;
  for (const auto& [id, count] : counts)
  {
    std::string name = id == WallId ? "wall" : "cap_" + std::to_string(id);
    if (const auto cap = ofCaps.find(id); cap != ofCaps.end() && id != WallId)
    {
      name = cap->second;
    }
    if (const auto own = wanted.find(id); own != wanted.end())
    {
      name = own->second;
    }
    ++uses[name];
    faces.push_back({ id, name, count });
  }
  for (auto& face : faces)
  {
    if (uses[face.name] > 1)
    {
      Require(wanted.count(face.id) == 0, "FaceName '" + face.name + "' is given to two faces");
      face.name += "_" + std::to_string(face.id);
    }
  }
  return faces;
}

std::string XmlOf(vtkDataSet* data)
{
  vtkSmartPointer<vtkXMLUnstructuredDataWriter> writer;
  if (vtkPolyData::SafeDownCast(data))
  {
    writer = vtkSmartPointer<vtkXMLPolyDataWriter>::New();
  }
  else
  {
    writer = vtkSmartPointer<vtkXMLUnstructuredGridWriter>::New();
  }
  // Into memory: VTK's writer does not notice when the last bytes find no room on the disk. And not
  // appended, which Debian's expat makes unreadable for VTK.
  writer->SetInputData(data);
  writer->WriteToOutputStringOn();
  writer->SetDataModeToBinary();
  if (!writer->Write())
  {
    throw std::runtime_error("VTK's XML writer failed");
  }
  return writer->GetOutputString();
}

void AddNumber(vtkFieldData* data, const char* name, double value)
{
  vtkCoronary::AddArray<vtkDoubleArray>(data, name, std::vector<double>{ value });
}

/// Ids that begin with 1.
void AddIds(vtkFieldData* data, const char* name, const std::vector<std::int64_t>& fromZero)
{
  vtkNew<vtkIntArray> ids;
  ids->SetName(name);
  ids->SetNumberOfValues(static_cast<vtkIdType>(fromZero.size()));
  for (std::size_t n = 0; n < fromZero.size(); ++n)
  {
    ids->SetValue(static_cast<vtkIdType>(n), static_cast<int>(fromZero[n] + 1));
  }
  data->AddArray(ids);
}

std::vector<std::int64_t> Numbered(std::size_t count)
{
  std::vector<std::int64_t> numbers(count);
  for (std::size_t n = 0; n < count; ++n)
  {
    numbers[n] = static_cast<std::int64_t>(n);
  }
  return numbers;
}

/// Values of the chosen tuples, of arrays of numbers.
void CopyTuples(vtkDataSetAttributes* from, const std::vector<vtkIdType>& tuples, bool keepWeights,
  vtkDataSetAttributes* to)
{
  vtkNew<vtkIdList> ids;
  ids->SetNumberOfIds(static_cast<vtkIdType>(tuples.size()));
  std::copy(tuples.begin(), tuples.end(), ids->begin());
  for (int n = 0; n < from->GetNumberOfArrays(); ++n)
  {
    vtkDataArray* array = from->GetArray(n);
    if (!array || (!keepWeights && IsWeight(array->GetName())))
    {
      continue;
    }
    vtkSmartPointer<vtkDataArray> part;
    part.TakeReference(array->NewInstance());
    part->SetName(array->GetName());
    part->SetNumberOfComponents(array->GetNumberOfComponents());
    part->SetNumberOfTuples(ids->GetNumberOfIds());
    for (int c = 0; c < array->GetNumberOfComponents(); ++c)
    {
      part->SetComponentName(c, array->GetComponentName(c));
    }
    array->GetTuples(ids, part);
    to->AddArray(part);
  }
}

vtkSmartPointer<vtkPoints> PointsOf(
  vtkPointSet* mesh, const std::vector<vtkIdType>& chosen, double unit)
{
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataType(mesh->GetPoints()->GetDataType());
  points->SetNumberOfPoints(static_cast<vtkIdType>(chosen.size()));
  for (std::size_t n = 0; n < chosen.size(); ++n)
  {
    double x[3];
    mesh->GetPoint(chosen[n], x);
    points->SetPoint(static_cast<vtkIdType>(n), x[0] / unit, x[1] / unit, x[2] / unit);
  }
  return points;
}

/// A vector array of the mesh, if it has it, as three numbers a point: `letter` and x, y or z.
void AddVectors(vtkPointSet* mesh, const char* name, const std::string& letter,
  const std::vector<vtkIdType>& points, coronary::FileSurface& surface)
{
  vtkDataArray* array = mesh->GetPointData()->GetArray(name);
  for (int c = 0; array != nullptr && array->GetNumberOfComponents() == 3 && c < 3; ++c)
  {
    std::vector<float> values;
    values.reserve(points.size());
    for (const vtkIdType point : points)
    {
      values.push_back(static_cast<float>(array->GetComponent(point, c)));
    }
    surface.vertexValues.emplace_back(letter + "xyz"[c], std::move(values));
  }
}

/// One phase, measured.
struct PhaseMesh
{
  vtkPointSet* mesh = nullptr;
  double time = 0.0;
  coronary::TetrahedraQuality tetrahedra;
  coronary::TrianglesQuality surface;
};

/// Makes the files of all phases.
class SequenceFiles
{
public:
  /// @param prefix  what the names of files other than the report begin with
  SequenceFiles(const std::string& path, std::string prefix, int digits, std::size_t phases,
    Topology topology, coronary::RankGroup& ranks)
    : Name(fs::path(path).stem().string())
    , Prefix(std::move(prefix))
    , Folder(
        fs::path(path).parent_path().empty() ? "." : fs::path(path).parent_path().string(), ranks)
    , Topo(std::move(topology))
    , Surface(this->Topo.PatchOf(0))
    , Phases(phases)
    , Digits(static_cast<std::size_t>(digits))
  {
    if (!this->Topo.tetrahedra.empty())
    {
      this->Tetrahedra =
        this->Topo.turned ? MakeCells(this->Topo.tetrahedra) : this->Topo.inputCells;
    }
  }

  const Topology& GetTopology() const { return this->Topo; }
  std::int64_t SurfacePoints() const
  {
    return static_cast<std::int64_t>(this->Surface.points.size());
  }
  coronary::StagedFolder& GetFolder() { return this->Folder; }

  std::string Number(std::size_t phase) const
  {
    return coronary::SeriesNumber(phase, this->Phases, this->Digits);
  }

  /// Writes a file, and tells the report.
  void Write(const std::string& name, const std::string& text)
  {
    coronary::WriteFileAtomically(this->Folder.Add(name), text);
  }

  /// A file of one phase, of any kind but SimVascular's.
  std::string BytesOf(const std::string& kind, const PhaseMesh& phase,
    const std::vector<coronary::MeshSequenceReport::Face>& faces, bool keepWeights) const;
  vtkSmartPointer<vtkUnstructuredGrid> Volume(const PhaseMesh& phase, bool keepWeights) const;
  vtkSmartPointer<vtkPolyData> SurfaceOf(const PhaseMesh& phase, bool keepWeights) const;
  vtkSmartPointer<vtkUnstructuredGrid> Vmtk(const PhaseMesh& phase, bool keepWeights) const;
  coronary::FileSurface PlainSurface(const PhaseMesh& phase,
    const std::vector<coronary::MeshSequenceReport::Face>& faces, bool values) const;
  std::unique_ptr<vtkGltfModel> NewGltf(vtkPointSet* mesh,
    const std::vector<coronary::MeshSequenceReport::Face>& faces, int influences) const;
  void WriteSimVascular(const std::string& folder, const PhaseMesh& phase,
    const std::vector<coronary::MeshSequenceReport::Face>& faces, double unit);

  const std::string Name;
  const std::string Prefix;

private:
  void AddFields(const PhaseMesh& phase, bool keepWeights, vtkDataSet* data) const;
  std::vector<Triangle> LocalTriangles() const;
  vtkSmartPointer<vtkPolyData> Face(const PhaseMesh& phase, const Patch& patch, double unit) const;

  coronary::StagedFolder Folder;
  Topology Topo;
  Patch Surface;
  std::map<int, Patch> Faces; ///< made when they are first written
  std::size_t Phases;
  std::size_t Digits;
  vtkSmartPointer<vtkCellArray> Tetrahedra;
};

/// Field data of the phase instead of those at rest.
void SequenceFiles::AddFields(const PhaseMesh& phase, bool keepWeights, vtkDataSet* data) const
{
  vtkNew<vtkFieldData> fields;
  fields->ShallowCopy(phase.mesh->GetFieldData());
  if (!keepWeights)
  {
    vtkBoneMotion::Remove(fields);
  }
  AddNumber(fields, names::PhaseTime, phase.time);
  AddNumber(fields, names::SurfaceArea, phase.surface.area);
  if (!this->Topo.tetrahedra.empty())
  {
    const coronary::TetrahedraQuality& quality = phase.tetrahedra;
    vtkNew<vtkIdTypeArray> inverted;
    inverted->SetName(names::InvertedTetrahedra);
    for (const std::int64_t id : quality.inverted)
    {
      inverted->InsertNextValue(id);
    }
    fields->AddArray(inverted);
    AddNumber(fields, names::PoorFraction,
      static_cast<double>(quality.poor) / static_cast<double>(this->Topo.tetrahedra.size()));
    AddNumber(fields, names::LeastVolume, quality.leastVolume);
    AddNumber(fields, names::TotalVolume, quality.totalVolume);
    AddNumber(fields, names::LeastDihedralAngle, quality.leastDihedralAngle);
    AddNumber(fields, names::GreatestRadiusEdgeRatio, quality.greatestRadiusEdgeRatio);
  }
  data->SetFieldData(fields);
}

vtkSmartPointer<vtkUnstructuredGrid> SequenceFiles::Volume(
  const PhaseMesh& phase, bool keepWeights) const
{
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->ShallowCopy(phase.mesh);
  grid->SetCells(VTK_TETRA, this->Tetrahedra);
  if (!keepWeights)
  {
    RemoveWeights(grid->GetPointData());
  }
  vtkCellData* cells = grid->GetCellData();
  vtkCoronary::AddArray<vtkIntArray>(
    cells, this->Topo.entityIdsName, std::vector<int>(this->Topo.tetrahedra.size(), 0));
  vtkCoronary::AddArray<vtkDoubleArray>(cells, names::TetrahedronVolume, phase.tetrahedra.volume);
  vtkCoronary::AddArray<vtkDoubleArray>(
    cells, names::MinimumDihedralAngle, phase.tetrahedra.minimumDihedral);
  vtkCoronary::AddArray<vtkDoubleArray>(
    cells, names::RadiusEdgeRatio, phase.tetrahedra.radiusEdgeRatio);
  this->AddFields(phase, keepWeights, grid);
  return grid;
}

vtkSmartPointer<vtkPolyData> SequenceFiles::SurfaceOf(
  const PhaseMesh& phase, bool keepWeights) const
{
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  if (this->Topo.tetrahedra.empty())
  {
    surface->ShallowCopy(phase.mesh);
    if (!keepWeights)
    {
      RemoveWeights(surface->GetPointData());
    }
  }
  else
  {
    surface->SetPoints(PointsOf(phase.mesh, this->Surface.points, 1.0));
    surface->SetPolys(this->Surface.cells);
    CopyTuples(
      phase.mesh->GetPointData(), this->Surface.points, keepWeights, surface->GetPointData());
    vtkCoronary::AddArray<vtkIdTypeArray>(
      surface->GetPointData(), names::MeshPointId, this->Surface.points);
    if (this->Topo.data)
    {
      const std::vector<std::int64_t> all = Numbered(this->Topo.triangles.size());
      CopyTuples(this->Topo.data, std::vector<vtkIdType>(all.begin(), all.end()), keepWeights,
        surface->GetCellData());
    }
    vtkCoronary::AddArray<vtkIdTypeArray>(
      surface->GetCellData(), names::TetrahedronId, this->Topo.behind);
  }
  vtkCoronary::AddArray<vtkIntArray>(
    surface->GetCellData(), this->Topo.entityIdsName, this->Topo.entity);
  this->AddFields(phase, keepWeights, surface);
  return surface;
}

vtkSmartPointer<vtkUnstructuredGrid> SequenceFiles::Vmtk(
  const PhaseMesh& phase, bool keepWeights) const
{
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->SetPoints(phase.mesh->GetPoints());
  grid->GetPointData()->ShallowCopy(phase.mesh->GetPointData());
  if (!keepWeights)
  {
    RemoveWeights(grid->GetPointData());
  }
  const std::size_t tetrahedra = this->Topo.tetrahedra.size();
  std::vector<int> ids(tetrahedra, 0);
  ids.insert(ids.end(), this->Topo.entity.begin(), this->Topo.entity.end());
  std::vector<int> types(tetrahedra, VTK_TETRA);
  types.resize(ids.size(), VTK_TRIANGLE);
  vtkNew<vtkCellArray> cells;
  cells->DeepCopy(this->Tetrahedra);
  cells->Append(MakeCells(this->Topo.triangles));
  grid->SetCells(types.data(), cells);
  vtkCoronary::AddArray<vtkIntArray>(grid->GetCellData(), this->Topo.entityIdsName, ids);
  return grid;
}

vtkSmartPointer<vtkPolyData> SequenceFiles::Face(
  const PhaseMesh& phase, const Patch& patch, double unit) const
{
  auto face = vtkSmartPointer<vtkPolyData>::New();
  face->SetPoints(PointsOf(phase.mesh, patch.points, unit));
  face->SetPolys(patch.cells);
  AddIds(face->GetPointData(), GlobalNodeID,
    std::vector<std::int64_t>(patch.points.begin(), patch.points.end()));
  std::vector<std::int64_t> elements;
  std::vector<int> ids;
  for (const std::int64_t n : patch.triangles)
  {
    elements.push_back(this->Topo.behind[static_cast<std::size_t>(n)]);
    ids.push_back(this->Topo.entity[static_cast<std::size_t>(n)]);
  }
  AddIds(face->GetCellData(), GlobalElementID, elements);
  vtkCoronary::AddArray<vtkIntArray>(face->GetCellData(), ModelFaceID, ids);
  return face;
}

/// The surface's triangles on its own points.
std::vector<Triangle> SequenceFiles::LocalTriangles() const
{
  return ReadCells<3>(this->Surface.cells);
}

/// @param values  whether normals, displacements and velocities are wanted, as far as the mesh has them
coronary::FileSurface SequenceFiles::PlainSurface(const PhaseMesh& phase,
  const std::vector<coronary::MeshSequenceReport::Face>& faces, bool values) const
{
  coronary::FileSurface surface;
  std::ostringstream comment;
  comment << "DynamicCoronary, mm, LPS, time " << phase.time;
  surface.comment = comment.str();
  surface.points.resize(this->Surface.points.size());
  for (std::size_t n = 0; n < surface.points.size(); ++n)
  {
    phase.mesh->GetPoint(this->Surface.points[n], surface.points[n].data());
  }
  surface.triangles = this->LocalTriangles();
  surface.face = this->Topo.entity;
  for (const auto& face : faces)
  {
    surface.faces.emplace_back(face.id, face.name);
  }
  if (values)
  {
    AddVectors(phase.mesh, names::Displacement, "d", this->Surface.points, surface);
    AddVectors(phase.mesh, names::Velocity, "v", this->Surface.points, surface);
  }
  return surface;
}

std::unique_ptr<vtkGltfModel> SequenceFiles::NewGltf(vtkPointSet* mesh,
  const std::vector<coronary::MeshSequenceReport::Face>& faces, int influences) const
{
  auto gltf = std::make_unique<vtkGltfModel>(mesh, this->Surface.points, influences);
  const std::vector<Triangle> triangles = this->LocalTriangles();
  for (const auto& face : faces)
  {
    coronary::GltfFace part{ face.name, face.id != WallId, {} };
    for (std::size_t n = 0; n < triangles.size(); ++n)
    {
      if (this->Topo.entity[n] == face.id)
      {
        part.triangles.push_back(triangles[n]);
      }
    }
    gltf->Model.faces.push_back(std::move(part));
  }
  gltf->Model.name = this->Name;
  return gltf;
}

void SequenceFiles::WriteSimVascular(const std::string& folder, const PhaseMesh& phase,
  const std::vector<coronary::MeshSequenceReport::Face>& faces, double unit)
{
  vtkNew<vtkUnstructuredGrid> grid;
  const std::vector<std::int64_t> all = Numbered(static_cast<std::size_t>(this->Topo.points));
  grid->SetPoints(PointsOf(phase.mesh, std::vector<vtkIdType>(all.begin(), all.end()), unit));
  grid->SetCells(VTK_TETRA, this->Tetrahedra);
  AddIds(grid->GetPointData(), GlobalNodeID, all);
  AddIds(grid->GetCellData(), GlobalElementID, Numbered(this->Topo.tetrahedra.size()));
  vtkCoronary::AddArray<vtkIntArray>(
    grid->GetCellData(), ModelRegionID, std::vector<int>(this->Topo.tetrahedra.size(), 1));
  this->Write(folder + "/mesh-complete.mesh.vtu", XmlOf(grid));
  this->Write(
    folder + "/mesh-complete.exterior.vtp", XmlOf(this->Face(phase, this->Surface, unit)));
  for (const auto& face : faces)
  {
    auto patch = this->Faces.find(face.id);
    if (patch == this->Faces.end())
    {
      patch = this->Faces.emplace(face.id, this->Topo.PatchOf(face.id)).first;
    }
    const std::string text = XmlOf(this->Face(phase, patch->second, unit));
    this->Write(folder + "/mesh-surfaces/" + face.name + ".vtp", text);
    if (face.id == WallId)
    {
      this->Write(folder + "/walls_combined.vtp", text);
    }
  }
}

std::string SequenceFiles::BytesOf(const std::string& kind, const PhaseMesh& phase,
  const std::vector<coronary::MeshSequenceReport::Face>& faces, bool keepWeights) const
{
  if (kind == "volume")
  {
    return XmlOf(this->Volume(phase, keepWeights));
  }
  if (kind == "surface")
  {
    return XmlOf(this->SurfaceOf(phase, keepWeights));
  }
  if (kind == "vmtk")
  {
    return XmlOf(this->Vmtk(phase, keepWeights));
  }
  const coronary::FileSurface surface = this->PlainSurface(phase, faces, kind == "ply");
  return kind == "obj" ? coronary::ObjText(surface)
    : kind == "ply"    ? coronary::PlyBytes(surface)
                       : coronary::StlBytes(surface);
}

/// Files of one kind over the phases.
struct Series
{
  std::string kind; ///< in the report
  std::string stem; ///< of the files' names
  std::string extension;
  std::vector<coronary::TimedFile> files;
};

/// A phase in the report with the names of its files, which the series get too.
coronary::MeshSequenceReport::Phase EntryOf(double time, std::size_t phase,
  const SequenceFiles& files, bool simVascular, std::vector<Series>& series)
{
  coronary::MeshSequenceReport::Phase entry;
  entry.time = time;
  for (Series& one : series)
  {
    const std::string file =
      files.Prefix + one.stem + "_" + files.Number(phase) + "." + one.extension;
    one.files.push_back({ file, time });
    entry.files.emplace_back(one.kind, file);
  }
  if (simVascular)
  {
    entry.files.emplace_back(
      "simvascular", files.Prefix + "simvascular/phase_" + files.Number(phase) + "/mesh-complete");
  }
  return entry;
}

/// What the report has of a phase as plain numbers, and back.
std::vector<double> NumbersOf(const coronary::MeshSequenceReport::Phase& phase)
{
  const coronary::TetrahedraQuality& t = phase.tetrahedra;
  const coronary::TrianglesQuality& s = phase.surface;
  std::vector<double> numbers = { phase.time, static_cast<double>(t.poor), t.leastVolume,
    static_cast<double>(t.leastVolumeAt), t.totalVolume, t.leastDihedralAngle,
    static_cast<double>(t.leastDihedralAngleAt), t.greatestRadiusEdgeRatio,
    static_cast<double>(t.greatestRadiusEdgeRatioAt), s.area, s.enclosedVolume, s.leastAngle,
    static_cast<double>(s.leastAngleAt), static_cast<double>(t.inverted.size()) };
  numbers.insert(numbers.end(), t.inverted.begin(), t.inverted.end());
  numbers.insert(numbers.end(), s.degenerate.begin(), s.degenerate.end());
  return numbers;
}

void TakeNumbers(const std::vector<double>& numbers, coronary::MeshSequenceReport::Phase& phase)
{
  auto next = numbers.begin();
  const auto whole = [&] { return static_cast<std::int64_t>(*next++); };
  coronary::TetrahedraQuality& t = phase.tetrahedra;
  coronary::TrianglesQuality& s = phase.surface;
  phase.time = *next++;
  t.poor = whole();
  t.leastVolume = *next++;
  t.leastVolumeAt = whole();
  t.totalVolume = *next++;
  t.leastDihedralAngle = *next++;
  t.leastDihedralAngleAt = whole();
  t.greatestRadiusEdgeRatio = *next++;
  t.greatestRadiusEdgeRatioAt = whole();
  s.area = *next++;
  s.enclosedVolume = *next++;
  s.leastAngle = *next++;
  s.leastAngleAt = whole();
  const auto middle = next + 1 + static_cast<std::ptrdiff_t>(*next);
  t.inverted.assign(next + 1, middle);
  s.degenerate.assign(middle, numbers.end());
}

/// What every rank measured and wrote becomes known to all.
void SharePhases(
  coronary::RankGroup& ranks, coronary::MeshSequenceReport& report, coronary::StagedFolder& folder)
{
  if (ranks.Size() == 1)
  {
    return;
  }
  std::vector<std::vector<double>> numbers(report.phases.size());
  for (std::size_t k = 0; k < numbers.size(); ++k)
  {
    if (ranks.Owns(k))
    {
      numbers[k] = NumbersOf(report.phases[k]);
    }
  }
  coronary::ShareLists(ranks, numbers);
  for (std::size_t k = 0; k < numbers.size(); ++k)
  {
    TakeNumbers(numbers[k], report.phases[k]);
  }
  std::string names;
  for (const std::string& name : folder.Added())
  {
    names += name + '\n';
  }
  const std::vector<std::string> all = ranks.Gather(names);
  for (std::size_t rank = 1; ranks.IsFirst() && rank < all.size(); ++rank)
  {
    std::istringstream lines(all[rank]);
    for (std::string name; std::getline(lines, name);)
    {
      folder.Add(name);
    }
  }
}

/// One sentence about the phases that have inverted tetrahedra; empty when there are none.
std::string InversionWarning(const std::vector<coronary::MeshSequenceReport::Phase>& phases)
{
  std::size_t bad = 0;
  std::string list;
  for (std::size_t k = 0; k < phases.size(); ++k)
  {
    const std::size_t count = phases[k].tetrahedra.inverted.size();
    if (count > 0)
    {
      ++bad;
      if (bad <= 10)
      {
        list +=
          (bad > 1 ? ", " : "") + std::to_string(count) + " at " + PhaseName(k, phases[k].time);
      }
    }
  }
  if (bad == 0)
  {
    return {};
  }
  return std::to_string(bad) + " of " + std::to_string(phases.size()) +
    " phases have inverted tetrahedra: " + list + (bad > 10 ? ", .." : "");
}

void FillTable(const coronary::MeshSequenceReport& report, vtkTable* table)
{
  const bool volume = report.tetrahedra > 0;
  std::vector<std::pair<const char*, std::vector<double>>> columns = { { "Phase", {} },
    { names::PhaseTime, {} }, { names::InvertedTetrahedra, {} }, { "PoorTetrahedra", {} },
    { names::PoorFraction, {} }, { names::LeastVolume, {} }, { names::LeastDihedralAngle, {} },
    { names::GreatestRadiusEdgeRatio, {} }, { names::TotalVolume, {} }, { names::SurfaceArea, {} },
    { "DegenerateTriangles", {} } };
  for (std::size_t k = 0; k < report.phases.size(); ++k)
  {
    const auto& phase = report.phases[k];
    const auto& t = phase.tetrahedra;
    const double values[] = { static_cast<double>(k), phase.time,
      static_cast<double>(t.inverted.size()), static_cast<double>(t.poor),
      volume ? static_cast<double>(t.poor) / static_cast<double>(report.tetrahedra) : 0.0,
      t.leastVolume, t.leastDihedralAngle, t.greatestRadiusEdgeRatio,
      volume ? t.totalVolume : phase.surface.enclosedVolume, phase.surface.area,
      static_cast<double>(phase.surface.degenerate.size()) };
    for (std::size_t c = 0; c < columns.size(); ++c)
    {
      columns[c].second.push_back(values[c]);
    }
  }
  for (const auto& [name, values] : columns)
  {
    vtkCoronary::AddArray<vtkDoubleArray>(table->GetRowData(), name, values);
  }
}
}

vtkMeshSequenceWriter::vtkMeshSequenceWriter()
{
  this->SetNumberOfInputPorts(3);
}

vtkMeshSequenceWriter::~vtkMeshSequenceWriter()
{
  delete[] this->FileName;
}

int vtkMeshSequenceWriter::FillInputPortInformation(int port, vtkInformation* info)
{
  if (port == 0)
  {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkUnstructuredGrid");
    info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
    return 1;
  }
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

void vtkMeshSequenceWriter::AddTime(double time)
{
  this->Times.push_back(time);
  this->Modified();
}

void vtkMeshSequenceWriter::RemoveAllTimes()
{
  this->Times.clear();
  this->Modified();
}

void vtkMeshSequenceWriter::SetFaceName(int id, const char* name)
{
  this->FaceNames[id] = name ? name : "";
  this->Modified();
}

void vtkMeshSequenceWriter::RemoveAllFaceNames()
{
  this->FaceNames.clear();
  this->Modified();
}

vtkTable* vtkMeshSequenceWriter::GetQuality()
{
  return this->Quality;
}

void vtkMeshSequenceWriter::Validate() const
{
  const std::string path = this->FileName ? this->FileName : "";
  Require(!path.empty(), "FileName is not set");
  Require(fs::path(path).extension() == ".json" && !fs::path(path).stem().empty(),
    "FileName must be the report's, NAME.json; '" + path + "' is not");
  Require(this->WriteSeries || this->WriteSimVascular || this->WriteVmtk || this->WriteObj ||
      this->WritePly || this->WriteStl || this->WriteGltf || this->WriteGltfJson,
    "There is nothing to write: WriteSeries, WriteSimVascular, WriteVmtk, WriteObj, WritePly, "
    "WriteStl, "
    "WriteGltf and WriteGltfJson are off");
  Require(this->GltfInfluences >= 4 && this->GltfInfluences <= 16 && this->GltfInfluences % 4 == 0,
    "GltfInfluences must be 4, 8, 12 or 16");
  Require(this->Phases >= InputSteps && this->Phases <= ListedTimes, "Phases must be 0, 1 or 2");
  Require(this->NumberOfPhases >= 1 && this->NumberOfPhases <= 100000,
    "NumberOfPhases must be 1 to 100000");
  Require(std::isfinite(this->StartTime), "StartTime must be finite");
  Require(std::isfinite(this->Period) && this->Period > 0.0, "Period must be positive");
  Require(std::isfinite(this->SimVascularUnit) && this->SimVascularUnit > 0.0,
    "SimVascularUnit must be positive");
  Require(this->PoorDihedralAngle >= 0.0 && this->PoorDihedralAngle <= 70.0,
    "PoorDihedralAngle must be 0 to 70 degrees");
  Require(this->Digits >= 1 && this->Digits <= 9, "Digits must be 1 to 9");
  for (const auto& [id, name] : this->FaceNames)
  {
    Require(id >= 1, "FaceName: ids begin with 1");
    Require(!name.empty() && name.front() != '.' &&
        std::all_of(name.begin(), name.end(), IsNameCharacter),
      "FaceName '" + name + "' must be of letters, digits, '-', '_' and '.'");
  }
}

std::vector<double> vtkMeshSequenceWriter::WantedTimes(vtkInformation* info) const
{
  std::vector<double> times;
  switch (this->Phases)
  {
    case EvenPhases:
      for (int k = 0; k < this->NumberOfPhases; ++k)
      {
        times.push_back(this->StartTime + this->Period * k / this->NumberOfPhases);
      }
      break;
    case ListedTimes:
      times = this->Times;
      Require(!times.empty(), "Times: none are listed");
      break;
    default:
      if (info->Has(SDDP::TIME_STEPS()))
      {
        const double* steps = info->Get(SDDP::TIME_STEPS());
        times.assign(steps, steps + info->Length(SDDP::TIME_STEPS()));
      }
      Require(!times.empty() || !info->Has(SDDP::TIME_RANGE()),
        "The input has no time steps: say which phases, with even phases or listed times");
      break;
  }
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    Require(std::isfinite(times[k]) && (k == 0 || times[k] > times[k - 1]),
      "The times of the phases must be finite and increase: that of " + PhaseName(k, times[k]) +
        " does not");
  }
  Require(times.empty() || info->Has(SDDP::TIME_STEPS()) || info->Has(SDDP::TIME_RANGE()),
    "The input has no time: it can not be asked for a phase");
  return times;
}

int vtkMeshSequenceWriter::Write()
{
  this->Written = false;
  return this->Superclass::Write() && this->Written ? 1 : 0;
}

void vtkMeshSequenceWriter::WriteData()
{
  this->Quality->Initialize();
  try
  {
    this->Validate();
    this->WritePhases(this->GetExecutive()->GetInputInformation(0, 0));
    this->Written = true;
  }
  catch (const coronary::Cancelled&)
  {
    // Nothing was written; the caller knows.
  }
  catch (const std::exception& error)
  {
    vtkErrorMacro(<< error.what());
  }
}

void vtkMeshSequenceWriter::WritePhases(vtkInformation* info)
{
  std::vector<double> times = this->WantedTimes(info);
  vtkCoronary::Moment moment;
  moment.exists = !times.empty();
  if (times.empty())
  {
    times.push_back(0.0);
  }
  const coronary::ProgressCallback report = [this](double fraction)
  {
    this->UpdateProgress(fraction);
    return !this->GetAbortExecute();
  };
  coronary::RankGroup& ranks = this->Ranks != nullptr ? *this->Ranks : coronary::RankGroup::Alone();
  auto* boundary = vtkPolyData::SafeDownCast(this->GetInput(1));
  auto* caps = vtkPolyData::SafeDownCast(this->GetInput(2));

  coronary::MeshSequenceReport result;
  result.poorAngle = this->PoorDihedralAngle * Degree;
  std::unique_ptr<SequenceFiles> files;
  std::vector<Series> series;
  std::unique_ptr<vtkGltfModel> gltf;
  vtkCoronary::UpstreamRequest request(info, info);
  try
  {
    for (std::size_t k = 0; k < times.size(); ++k)
    {
      // The first phase says what all have to be like.
      if (k > 0 && !ranks.Owns(k) && !gltf)
      {
        result.phases.push_back(EntryOf(times[k], k, *files, this->WriteSimVascular, series));
        continue;
      }
      coronary::Report(report, static_cast<double>(k) / static_cast<double>(times.size()));
      moment.time = times[k];
      request.Ask(nullptr, moment);
      auto* mesh = vtkPointSet::SafeDownCast(vtkDataObject::GetData(info));
      const std::string name = PhaseName(k, times[k]);
      Require(mesh != nullptr && mesh->GetNumberOfPoints() > 0 && mesh->GetNumberOfCells() > 0,
        "The mesh is empty at " + name);
      if (moment.exists && mesh->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
      {
        const double given = mesh->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP());
        std::ostringstream text;
        text << "The input answers for " << name << " with its mesh of time " << given
             << ": take its time steps, or put a vtkCardiacPhaseInterpolator before it";
        Require(std::abs(given - times[k]) <= 1e-9 * std::max(1.0, std::abs(times[k])), text.str());
      }
      if (!files)
      {
        Topology topology = TopologyOf(mesh, boundary, names::CellEntityIds);
        Require(!topology.tetrahedra.empty() || (!this->WriteSimVascular && !this->WriteVmtk),
          "WriteSimVascular and WriteVmtk need tetrahedra, and the mesh is a surface");
        result.points = topology.points;
        result.tetrahedra = static_cast<std::int64_t>(topology.tetrahedra.size());
        result.triangles = static_cast<std::int64_t>(topology.triangles.size());
        result.faces = FacesOf(topology, this->FaceNames, NamesOfCaps(caps, names::CellEntityIds));
        const std::string stem = fs::path(this->FileName).stem().string();
        files = std::make_unique<SequenceFiles>(this->FileName,
          this->PrefixFiles ? stem + "_" : std::string(), this->Digits, times.size(),
          std::move(topology), ranks);
        result.prefix = files->Prefix;
        result.surfacePoints = files->SurfacePoints();
        if (this->WriteSeries && result.tetrahedra > 0)
        {
          series.push_back({ "volume", "volume", "vtu", {} });
        }
        if (this->WriteSeries)
        {
          series.push_back({ "surface", "surface", "vtp", {} });
        }
        if (this->WriteVmtk)
        {
          series.push_back({ "vmtk", "vmtk", "vtu", {} });
        }
        for (const auto& [wanted, kind] : { std::pair(this->WriteObj, "obj"),
               std::pair(this->WritePly, "ply"), std::pair(this->WriteStl, "stl") })
        {
          if (wanted)
          {
            series.push_back({ kind, "surface", kind, {} });
          }
        }
        // One file of all phases: the first rank goes through them all.
        if ((this->WriteGltf || this->WriteGltfJson) && ranks.IsFirst())
        {
          gltf = files->NewGltf(mesh, result.faces, this->GltfInfluences);
        }
      }
      coronary::MeshSequenceReport::Phase entry =
        EntryOf(times[k], k, *files, this->WriteSimVascular, series);
      if (gltf)
      {
        gltf->AddPhase(mesh, times[k]);
      }
      if (!ranks.Owns(k))
      {
        result.phases.push_back(std::move(entry));
        continue;
      }
      const Topology& topology = files->GetTopology();
      PhaseMesh phase;
      phase.mesh = mesh;
      phase.time = times[k];
      try
      {
        RequireSame(topology, mesh);
        const std::vector<coronary::Vector3> points = ReadPoints(mesh);
        phase.tetrahedra =
          coronary::MeasureTetrahedra(points, topology.tetrahedra, result.poorAngle);
        phase.surface = coronary::MeasureTriangles(points, topology.triangles);
      }
      catch (const std::invalid_argument& error)
      {
        throw std::invalid_argument("At " + name + ": " + error.what());
      }
      for (const Series& one : series)
      {
        coronary::Report(
          report, (static_cast<double>(k) + 0.5) / static_cast<double>(times.size()));
        files->Write(
          one.files.back().path, files->BytesOf(one.kind, phase, result.faces, this->KeepWeights));
      }
      if (this->WriteSimVascular)
      {
        files->WriteSimVascular(
          entry.files.back().second, phase, result.faces, this->SimVascularUnit);
      }
      entry.tetrahedra = std::move(phase.tetrahedra);
      entry.tetrahedra.volume = {};
      entry.tetrahedra.minimumDihedral = {};
      entry.tetrahedra.radiusEdgeRatio = {};
      entry.surface = std::move(phase.surface);
      result.phases.push_back(std::move(entry));
    }
    SharePhases(ranks, result, files->GetFolder());
    for (const Series& one : series)
    {
      const std::string stem = files->Prefix + one.stem;
      const std::string list = stem + "." + one.extension + ".series";
      const bool xml = one.kind != one.extension; // a .pvd list is for VTK's own
      if (ranks.IsFirst())
      {
        files->Write(list, coronary::FileSeriesText(one.files));
        if (xml)
        {
          files->Write(stem + ".pvd", coronary::PvdText(one.files));
        }
      }
      result.files.emplace_back(one.kind, xml ? stem + ".pvd" : list);
    }
    if (gltf)
    {
      gltf->Model.period = this->Period;
      gltf->Model.loop = this->GltfLoop;
      const auto write = [&](const char* kind, const char* extension, const std::string& bytes)
      {
        const std::string name = files->Prefix + "skin." + extension;
        files->Write(name, bytes);
        result.files.emplace_back(kind, name);
      };
      if (this->WriteGltf)
      {
        write("gltf", "glb", coronary::GltfBinary(gltf->Model, *gltf->Skin));
      }
      if (this->WriteGltfJson)
      {
        write("gltf-json", "gltf", coronary::GltfText(gltf->Model, *gltf->Skin));
      }
    }
    result.files.emplace_back("quality", files->Prefix + "quality.csv");
    if (ranks.IsFirst())
    {
      files->Write(files->Prefix + "quality.csv", coronary::MeshSequenceCsv(result));
      files->Write(files->Name + ".json", coronary::MeshSequenceJson(result));
      files->GetFolder().TakePlaceOf(coronary::MeshSequenceFiles(this->FileName));
    }
    request.Restore();
    coronary::Report(report, 1.0);
    if (ranks.IsFirst())
    {
      files->GetFolder().Commit();
    }
  }
  catch (const std::exception& error)
  {
    try
    {
      request.Restore(); // else the next update would begin with the time that failed
    }
    catch (const std::exception&)
    {
      // The input has said why; what came first counts.
    }
    if (files && dynamic_cast<const coronary::Cancelled*>(&error) == nullptr)
    {
      throw std::runtime_error(files->GetFolder().Translate(error.what()));
    }
    throw;
  }
  FillTable(result, this->Quality);
  const std::string warning = InversionWarning(result.phases);
  if (!warning.empty() && ranks.IsFirst())
  {
    vtkWarningMacro(<< warning);
  }
}

void vtkMeshSequenceWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << '\n';
  os << indent << "Phases: " << this->Phases << '\n';
  os << indent << "NumberOfPhases: " << this->NumberOfPhases << '\n';
  os << indent << "StartTime: " << this->StartTime << '\n';
  os << indent << "Period: " << this->Period << '\n';
  os << indent << "Times:";
  for (const double time : this->Times)
  {
    os << ' ' << time;
  }
  os << '\n';
  os << indent << "WriteSeries: " << this->WriteSeries << '\n';
  os << indent << "WriteSimVascular: " << this->WriteSimVascular << '\n';
  os << indent << "WriteVmtk: " << this->WriteVmtk << '\n';
  os << indent << "WriteObj: " << this->WriteObj << '\n';
  os << indent << "WritePly: " << this->WritePly << '\n';
  os << indent << "WriteStl: " << this->WriteStl << '\n';
  os << indent << "WriteGltf: " << this->WriteGltf << '\n';
  os << indent << "WriteGltfJson: " << this->WriteGltfJson << '\n';
  os << indent << "GltfInfluences: " << this->GltfInfluences << '\n';
  os << indent << "GltfLoop: " << this->GltfLoop << '\n';
  os << indent << "SimVascularUnit: " << this->SimVascularUnit << '\n';
  os << indent << "KeepWeights: " << this->KeepWeights << '\n';
  os << indent << "PrefixFiles: " << this->PrefixFiles << '\n';
  os << indent << "Digits: " << this->Digits << '\n';
  os << indent << "PoorDihedralAngle: " << this->PoorDihedralAngle << '\n';
  for (const auto& [id, name] : this->FaceNames)
  {
    os << indent << "FaceName " << id << ": " << name << '\n';
  }
}
