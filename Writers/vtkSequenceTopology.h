/**
 * @file vtkSequenceTopology.h
 * @brief What is the same at every phase of a mesh that is written as a sequence.
 */
#ifndef vtkSequenceTopology_h
#define vtkSequenceTopology_h

#include "MeshSequenceReport.h"
#include "TetrahedralBoundary.h"

#include "vtkCellArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkSmartPointer.h"
#include "vtkType.h"

#include <array>
#include <map>
#include <string>
#include <vector>

class vtkCellData;
class vtkPointSet;
class vtkPolyData;

namespace vtkMeshSequence
{
using coronary::Tetrahedron;
using coronary::Triangle;

constexpr int WallId = 1;

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

std::vector<coronary::Vector3> ReadPoints(vtkPointSet* data);

/// @param boundary  its boundary with ids of faces; may be null
/// @throws std::invalid_argument that says what is not fit to be written
Topology TopologyOf(vtkPointSet* mesh, vtkPolyData* boundary, const std::string& entityIdsName);

/// @throws std::invalid_argument that says what differs
void RequireSame(const Topology& topology, vtkPointSet* mesh);

/// Of names of faces: what is safe in the name of a file.
bool IsNameCharacter(char c);

/// Names of the caps, as far as the caps' vertices tell.
std::map<int, std::string> NamesOfCaps(vtkPolyData* caps, const std::string& entityIdsName);

/// Faces by ascending ids, each with a name of its own.
std::vector<coronary::MeshSequenceReport::Face> FacesOf(const Topology& topology,
  const std::map<int, std::string>& wanted, const std::map<int, std::string>& ofCaps);
}

#endif
