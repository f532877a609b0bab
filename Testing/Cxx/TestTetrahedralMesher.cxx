// vtkTetrahedralMesher through the VTK pipeline: arrays, ids, summary, pieces, blocks, refusals.
#include "vtkTetrahedralMesher.h"

#include "FilterMessages.h"
#include "TetrahedralMesh.h"
#include "vtkCoronaryPhantomSource.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace TestTetrahedralMesher
{
namespace
{
/// The unit cube's surface; entity 1 on the sides, 2 below, 3 above.
vtkSmartPointer<vtkPolyData> Cube(bool entities = true)
{
  auto cube = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  for (int i = 0; i < 8; ++i)
  {
    points->InsertNextPoint(i & 1, (i >> 1) & 1, (i >> 2) & 1);
  }
  const vtkIdType faces[12][3] = { { 0, 2, 3 }, { 0, 3, 1 }, { 4, 5, 7 }, { 4, 7, 6 }, { 0, 1, 5 },
    { 0, 5, 4 }, { 2, 6, 7 }, { 2, 7, 3 }, { 0, 4, 6 }, { 0, 6, 2 }, { 1, 3, 7 }, { 1, 7, 5 } };
  vtkNew<vtkCellArray> cells;
  vtkNew<vtkIntArray> ids;
  ids->SetName("CellEntityIds");
  for (int i = 0; i < 12; ++i)
  {
    cells->InsertNextCell(3, faces[i]);
    ids->InsertNextValue(i < 2 ? 2 : i < 4 ? 3 : 1);
  }
  cube->SetPoints(points);
  cube->SetPolys(cells);
  if (entities)
  {
    cube->GetCellData()->AddArray(ids);
  }
  return cube;
}

vtkSmartPointer<vtkPolyData> Line(const std::vector<std::array<double, 3>>& places)
{
  auto line = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> cells;
  cells->InsertNextCell(static_cast<int>(places.size()));
  for (const auto& p : places)
  {
    cells->InsertCellPoint(points->InsertNextPoint(p.data()));
  }
  line->SetPoints(points);
  line->SetLines(cells);
  return line;
}

void ExpectRefusal(vtkTetrahedralMesher* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  EXPECT_EQ(filter->GetBoundary()->GetNumberOfPoints(), 0);
  EXPECT_EQ(filter->GetEdges()->GetNumberOfPoints(), 0);
}

double Field(vtkDataObject* data, const char* name)
{
  vtkDataArray* array = data->GetFieldData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array != nullptr ? array->GetComponent(0, 0) : std::nan("");
}

class TetrahedralMesher : public testing::Test
{
protected:
  void SetUp() override
  {
    if (!coronary::HasTetrahedralBackend(coronary::TetrahedralBackend::TetGen))
    {
      GTEST_SKIP() << "built without TetGen";
    }
  }
};
}

TEST_F(TetrahedralMesher, CubeWithALine)
{
  const auto cube = Cube();
  const vtkMTimeType before = cube->GetMTime();
  vtkNew<vtkTetrahedralMesher> filter;
  filter->SetInputData(cube);
  filter->SetSkeletonData(Line({ { 0.5, 0.5, 0.0 }, { 0.5, 0.4, 0.3 }, { 0.5, 0.5, 0.7 } }));
  filter->Update();
  EXPECT_EQ(cube->GetMTime(), before);

  vtkUnstructuredGrid* volume = filter->GetOutput();
  ASSERT_GT(volume->GetNumberOfCells(), 10);
  vtkDataArray* sizes = volume->GetCellData()->GetArray("TetrahedronVolume");
  vtkDataArray* angles = volume->GetCellData()->GetArray("MinimumDihedralAngle");
  ASSERT_NE(sizes, nullptr);
  ASSERT_NE(angles, nullptr);
  ASSERT_NE(volume->GetCellData()->GetArray("RadiusEdgeRatio"), nullptr);
  double sum = 0.0;
  for (vtkIdType i = 0; i < volume->GetNumberOfCells(); ++i)
  {
    EXPECT_EQ(volume->GetCellType(i), VTK_TETRA);
    EXPECT_EQ(volume->GetCellData()->GetArray("CellEntityIds")->GetComponent(i, 0), 0.0);
    EXPECT_EQ(volume->GetCellData()->GetArray("RegionIds")->GetComponent(i, 0), 0.0);
    EXPECT_GT(sizes->GetComponent(i, 0), 1e-7);
    sum += sizes->GetComponent(i, 0);
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
  EXPECT_NEAR(Field(volume, "TotalVolume"), 1.0, 1e-12);
  EXPECT_DOUBLE_EQ(Field(volume, "MeshMinimumDihedralAngle"), angles->GetRange()[0]);
  EXPECT_EQ(Field(volume, "Tries"), 1.0);
  EXPECT_EQ(
    vtkStringArray::SafeDownCast(volume->GetFieldData()->GetAbstractArray("Backend"))->GetValue(0),
    "TetGen");

  std::set<double> skeleton;
  for (vtkIdType i = 0; i < volume->GetNumberOfPoints(); ++i)
  {
    skeleton.insert(volume->GetPointData()->GetArray("SkeletonPointId")->GetComponent(i, 0));
  }
  EXPECT_EQ(skeleton, (std::set<double>{ -1.0, 0.0, 1.0, 2.0 }));

  // The line starts on the lower face, whose triangles are split there: areas by id stay.
  vtkPolyData* boundary = filter->GetBoundary();
  double area[4] = { 0.0, 0.0, 0.0, 0.0 };
  for (vtkIdType i = 0; i < boundary->GetNumberOfCells(); ++i)
  {
    double p[3][3];
    for (int k = 0; k < 3; ++k)
    {
      boundary->GetPoint(boundary->GetCell(i)->GetPointId(k), p[k]);
    }
    const coronary::Vector3 a(p[0]);
    const coronary::Vector3 normal =
      (coronary::Vector3(p[1]) - a).cross(coronary::Vector3(p[2]) - a);
    const auto id =
      static_cast<int>(boundary->GetCellData()->GetArray("CellEntityIds")->GetComponent(i, 0));
    area[id] += 0.5 * normal.norm();
    EXPECT_GT(normal.dot(a - coronary::Vector3(0.5, 0.5, 0.5)), 0.0);
  }
  EXPECT_NEAR(area[1], 4.0, 1e-12);
  EXPECT_NEAR(area[2], 1.0, 1e-12);
  EXPECT_NEAR(area[3], 1.0, 1e-12);

  vtkPolyData* edges = filter->GetEdges();
  double length = 0.0;
  for (vtkIdType i = 0; i < edges->GetNumberOfCells(); ++i)
  {
    length += std::sqrt(edges->GetCell(i)->GetLength2());
  }
  EXPECT_NEAR(length, std::sqrt(0.1) + std::sqrt(0.17), 1e-9);
  EXPECT_EQ(edges->GetCellData()->GetArray("SkeletonEdgeId")->GetRange()[1], 1.0);
}

TEST_F(TetrahedralMesher, WithoutIdsAllIsWall)
{
  vtkNew<vtkTetrahedralMesher> filter;
  filter->SetInputData(Cube(false));
  filter->SetEntityArrayName("Faces");
  filter->Update();
  vtkDataArray* ids = filter->GetBoundary()->GetCellData()->GetArray("Faces");
  ASSERT_NE(ids, nullptr);
  EXPECT_EQ(ids->GetRange()[0], 1.0);
  EXPECT_EQ(ids->GetRange()[1], 1.0);
  EXPECT_EQ(filter->GetBoundary()->GetNumberOfCells(), 12);
}

TEST_F(TetrahedralMesher, PhantomTreesReachTheNumbers)
{
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetSeed(4);
  source->SetSurfaceSpacing(0.6);
  vtkNew<vtkTetrahedralMesher> filter;
  filter->SetInputConnection(source->GetOutputPort(vtkCoronaryPhantomSource::SurfacePort));
  filter->SetSkeletonConnection(source->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  filter->Update();
  vtkUnstructuredGrid* volume = filter->GetOutput();
  ASSERT_GT(volume->GetNumberOfCells(), 10000);
  EXPECT_GE(Field(volume, "MeshMinimumDihedralAngle"), 5.0 * M_PI / 180.0);
  EXPECT_LE(Field(volume, "PoorFraction"), 0.01);
  EXPECT_GT(Field(volume, "MeshMinimumVolume"), 1e-7);
  EXPECT_EQ(volume->GetCellData()->GetArray("RegionIds")->GetRange()[1], 1.0);
  // Every point of the trees, but for the doubled ones where branches meet.
  vtkPolyData* tree =
    vtkPolyData::SafeDownCast(source->GetOutputDataObject(vtkCoronaryPhantomSource::TreePort));
  std::set<std::array<double, 3>> places;
  for (vtkIdType i = 0; i < tree->GetNumberOfPoints(); ++i)
  {
    std::array<double, 3> p{};
    tree->GetPoint(i, p.data());
    places.insert(p);
  }
  std::size_t found = 0;
  for (vtkIdType i = 0; i < volume->GetNumberOfPoints(); ++i)
  {
    found += volume->GetPointData()->GetArray("SkeletonPointId")->GetComponent(i, 0) >= 0.0 ? 1 : 0;
  }
  EXPECT_EQ(found, places.size());
}

TEST_F(TetrahedralMesher, PiecesBeyondTheFirstAreEmpty)
{
  vtkNew<vtkTetrahedralMesher> filter;
  filter->SetInputData(Cube());
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  filter->UpdatePiece(0, 2, 0);
  EXPECT_GT(filter->GetOutput()->GetNumberOfCells(), 0);
}

TEST_F(TetrahedralMesher, AbortLeavesNothingAndTheNextRequestStartsAnew)
{
  vtkNew<vtkTetrahedralMesher> filter;
  filter->SetInputData(Cube());
  UpdateAborted(filter);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  filter->Update();
  EXPECT_GT(filter->GetOutput()->GetNumberOfCells(), 0);
}

TEST(TetrahedralMesherRefuses, WhatItCanNotMesh)
{
  vtkNew<vtkTetrahedralMesher> filter;
  vtkNew<vtkPolyData> nothing;
  filter->SetInputData(nothing);
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);

  const auto open = Cube();
  vtkNew<vtkCellArray> fewer;
  for (vtkIdType i = 0; i < 11; ++i)
  {
    fewer->InsertNextCell(open->GetCell(i));
  }
  open->SetPolys(fewer);
  filter->SetInputData(open);
  ExpectRefusal(filter, "The surface is open: 3 edges");

  const auto quadrangle = Cube();
  const vtkIdType corners[4] = { 0, 1, 3, 2 };
  vtkNew<vtkCellArray> more;
  more->DeepCopy(quadrangle->GetPolys());
  more->InsertNextCell(4, corners);
  quadrangle->SetPolys(more);
  filter->SetInputData(quadrangle);
  ExpectRefusal(filter, "Cell 12 of the surface has 4 corners");

  filter->SetInputData(Cube());
  filter->SetBackend(7);
  ExpectRefusal(filter, "There is no such backend");
  filter->SetBackend(vtkTetrahedralMesher::AutomaticBackend);
  filter->SetMinimumDihedralAngle(60.0);
  ExpectRefusal(filter, "The minimum dihedral angle");
  filter->SetMinimumDihedralAngle(15.0);
  filter->SetSkeletonData(Line({ { 0.5, 0.5, 0.5 }, { 0.5, 0.5, 2.0 } }));
  filter->SetWorkerFolder("/nowhere");
  ExpectRefusal(filter, "built without");
}

TEST_F(TetrahedralMesher, PointsOutsideAreRefusedOrLeftOut)
{
  vtkNew<vtkTetrahedralMesher> filter;
  filter->SetInputData(Cube());
  filter->SetSkeletonData(Line({ { 0.5, 0.5, 0.5 }, { 0.5, 0.5, 2.0 } }));
  ExpectRefusal(filter, "Skeleton point 1 at (0.5, 0.5, 2) lies 1 mm outside");
  filter->LeaveOutsideOn();
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(messages.Warnings.size(), 1U);
  EXPECT_GT(filter->GetOutput()->GetNumberOfCells(), 0);
  EXPECT_EQ(filter->GetEdges()->GetNumberOfCells(), 0);
}

TEST(TetrahedralMesherPrints, ItsSettings)
{
  vtkNew<vtkTetrahedralMesher> filter;
  std::ostringstream text;
  filter->Print(text);
  for (const char* name : { "Backend: 0", "RadiusEdgeRatio: 1.4", "MinimumDihedralAngle: 15",
         "MinimumVolume: 1e-07", "SizeFactor: 0", "Repair: 1", "LeaveOutside: 0", "TimeLimit: 300",
         "EntityArrayName: CellEntityIds" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}
}
