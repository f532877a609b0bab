#include "vtkSequenceTopology.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;
using vtkCoronary::Require;

namespace vtkMeshSequence
{
namespace
{
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

std::string FileNameOf(std::string text)
{
  std::replace_if(
    text.begin(), text.end(), [](char c) { return !IsNameCharacter(c); }, '_');
  return text;
}
}

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

std::vector<coronary::Vector3> ReadPoints(vtkPointSet* data)
{
  std::vector<coronary::Vector3> points(static_cast<std::size_t>(data->GetNumberOfPoints()));
  for (std::size_t n = 0; n < points.size(); ++n)
  {
    data->GetPoint(static_cast<vtkIdType>(n), points[n].data());
  }
  return points;
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
}
