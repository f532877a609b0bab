/**
 * @file SequenceTestData.h
 * @brief Tetrahedra around the chain of SkeletonTestData.h with their boundary, for the tests of sequences.
 */
#ifndef DynamicCoronary_SequenceTestData_h
#define DynamicCoronary_SequenceTestData_h

#include "SkeletonTestData.h"
#include "TetrahedralBoundary.h"
#include "TetrahedronTestMeshes.h"

#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

/// A square bar around a chain, 3 mm wide, of tetrahedra with positive volumes that hang on its bones.
inline vtkSmartPointer<vtkUnstructuredGrid> ChainVolume(int bones)
{
  coronary::SkinWeightInput bar = coronary::MeshOfCells(
    { -3, -3, 0 }, { 3, 3, 10 * bones }, 0.5, [](const coronary::Vector3&) { return true; });
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const coronary::Vector3& point : bar.points)
  {
    points->InsertNextPoint(point.data());
  }
  grid->SetPoints(points);
  for (auto t : bar.tetrahedra)
  {
    if (coronary::TetrahedronVolume(
          bar.points[t[0]], bar.points[t[1]], bar.points[t[2]], bar.points[t[3]]) < 0.0)
    {
      std::swap(t[2], t[3]);
    }
    const vtkIdType ids[4] = { t[0], t[1], t[2], t[3] };
    grid->InsertNextCell(VTK_TETRA, 4, ids);
  }
  HangOnChain(grid, bones);
  return grid;
}

inline std::vector<coronary::Tetrahedron> TetrahedraOf(vtkUnstructuredGrid* grid)
{
  std::vector<coronary::Tetrahedron> result;
  for (vtkIdType n = 0; n < grid->GetNumberOfCells(); ++n)
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    grid->GetCells()->GetCellAtId(n, count, ids);
    result.push_back({ ids[0], ids[1], ids[2], ids[3] });
  }
  return result;
}

/// Its boundary on the same points, in the opposite order: wall 1, lower end 2, upper end 3.
inline vtkSmartPointer<vtkPolyData> ChainBoundary(vtkUnstructuredGrid* grid, int bones)
{
  auto boundary = vtkSmartPointer<vtkPolyData>::New();
  boundary->SetPoints(grid->GetPoints());
  vtkNew<vtkCellArray> polys;
  vtkNew<vtkIntArray> entity;
  entity->SetName("CellEntityIds");
  vtkNew<vtkIntArray> group;
  group->SetName("GroupIds");
  auto faces = coronary::BoundaryFaces(TetrahedraOf(grid));
  std::reverse(faces.begin(), faces.end());
  for (const auto& [face, cell] : faces)
  {
    const vtkIdType ids[3] = { face[1], face[2], face[0] };
    polys->InsertNextCell(3, ids);
    const auto all = [&](double z)
    {
      return std::all_of(face.begin(), face.end(),
        [&](std::int64_t corner) { return grid->GetPoint(corner)[2] == z; });
    };
    entity->InsertNextValue(all(0.0) ? 2 : all(5.0 * bones) ? 3 : 1);
    group->InsertNextValue(static_cast<int>(cell % 7));
  }
  boundary->SetPolys(polys);
  boundary->GetCellData()->AddArray(entity);
  boundary->GetCellData()->AddArray(group);
  return boundary;
}

/// The ends, as vtkFrenetSweepSurface lists them.
inline vtkSmartPointer<vtkPolyData> ChainCaps()
{
  auto caps = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkIntArray> entity;
  entity->SetName("CellEntityIds");
  vtkNew<vtkIntArray> inlet;
  inlet->SetName("IsInlet");
  vtkNew<vtkStringArray> label;
  label->SetName("SegmentLabel");
  for (int id : { 2, 3 })
  {
    points->InsertNextPoint(0.0, 0.0, id);
    entity->InsertNextValue(id);
    inlet->InsertNextValue(id == 2 ? 1 : 0);
    label->InsertNextValue(id == 2 ? "pRCA" : "R-PDA/1");
  }
  caps->SetPoints(points);
  caps->GetPointData()->AddArray(entity);
  caps->GetPointData()->AddArray(inlet);
  caps->GetPointData()->AddArray(label);
  return caps;
}

#endif
