// vtkSurfaceCleaner through the VTK pipeline: arrays, ids, summary, pieces, refusals, foreign surfaces.
#include "vtkSurfaceCleaner.h"

#include "FilterMessages.h"
#include "SharedSurface.h"
#include "SurfaceCheck.h"
#include "TetrahedralMesh.h"
#include "vtkTetrahedralMesher.h"

#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIntArray.h"
#include "vtkPointData.h"
#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>

namespace TestSurfaceCleaner
{
namespace
{
/// A tube of quadrangles along z with radius 1 and length 8, with a vertex and a line besides.
vtkSmartPointer<vtkPolyData> Tube()
{
  constexpr int around = 20;
  constexpr int along = 24;
  auto tube = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> cells;
  vtkNew<vtkCellArray> vertices;
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkDoubleArray> heights;
  heights->SetName("Height");
  vtkNew<vtkIntArray> rings;
  rings->SetName("Ring");
  const vtkIdType line[2] = { 0, around };
  vertices->InsertNextCell(1, line);
  lines->InsertNextCell(2, line);
  rings->InsertNextValue(-2);
  rings->InsertNextValue(-1);
  for (int k = 0; k <= along; ++k)
  {
    for (int i = 0; i < around; ++i)
    {
      const double angle = 2.0 * M_PI * i / around;
      points->InsertNextPoint(std::cos(angle), std::sin(angle), 8.0 * k / along);
      heights->InsertNextValue(8.0 * k / along);
    }
  }
  for (vtkIdType k = 0; k < along; ++k)
  {
    for (vtkIdType i = 0; i < around; ++i)
    {
      const vtkIdType next = (i + 1) % around;
      const vtkIdType corners[4] = { k * around + i, k * around + next, (k + 1) * around + next,
        (k + 1) * around + i };
      cells->InsertNextCell(4, corners);
      rings->InsertNextValue(static_cast<int>(k));
    }
  }
  tube->SetPoints(points);
  tube->SetVerts(vertices);
  tube->SetLines(lines);
  tube->SetPolys(cells);
  tube->GetPointData()->AddArray(heights);
  tube->GetCellData()->AddArray(rings);
  return tube;
}

double Field(vtkDataObject* data, const char* name)
{
  vtkDataArray* array = data->GetFieldData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array != nullptr ? array->GetComponent(0, 0) : std::nan("");
}

/// Closed, manifold, outwards, without self-intersections.
void ExpectClean(vtkPolyData* surface)
{
  std::vector<coronary::Vector3> points(surface->GetNumberOfPoints());
  std::vector<coronary::Triangle> triangles(surface->GetNumberOfCells());
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    surface->GetPoint(static_cast<vtkIdType>(i), points[i].data());
  }
  for (std::size_t i = 0; i < triangles.size(); ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      triangles[i][k] = surface->GetCell(static_cast<vtkIdType>(i))->GetPointId(k);
    }
  }
  try
  {
    const coronary::ClosedSurface closed = coronary::CheckSurface(points, triangles);
    EXPECT_TRUE(closed.warnings.empty()) << closed.warnings[0];
    coronary::CheckSelfIntersections(closed);
  }
  catch (const coronary::SurfaceError& error)
  {
    ADD_FAILURE() << error.what();
  }
}

void ExpectRefusal(vtkSurfaceCleaner* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
}
}

TEST(SurfaceCleaner, ClosesATubeAndKeepsItsData)
{
  const auto tube = Tube();
  const vtkMTimeType before = tube->GetMTime();
  vtkNew<vtkSurfaceCleaner> filter;
  filter->SetInputData(tube);
  Messages messages(filter);
  filter->Update();
  EXPECT_EQ(tube->GetMTime(), before);
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_TRUE(messages.Warnings.empty());
  vtkPolyData* surface = filter->GetOutput();
  ExpectClean(surface);
  EXPECT_EQ(surface->GetNumberOfVerts() + surface->GetNumberOfLines(), 0);
  EXPECT_EQ(Field(surface, "Caps"), 2.0);
  EXPECT_EQ(Field(surface, "OpenEdges"), 0.0);
  EXPECT_EQ(Field(surface, "SelfIntersections"), 0.0);
  EXPECT_LT(Field(surface, "MaximumDisplacement"), 1e-12);
  auto* repairs =
    vtkStringArray::SafeDownCast(surface->GetFieldData()->GetAbstractArray("Repairs"));
  ASSERT_NE(repairs, nullptr);
  ASSERT_EQ(repairs->GetNumberOfValues(), 1);
  EXPECT_EQ(repairs->GetValue(0).find("2 open ends closed by a cap, the first at ("), 0U);
  ASSERT_NE(surface->GetFieldData()->GetAbstractArray("Warnings"), nullptr);

  vtkDataArray* heights = surface->GetPointData()->GetArray("Height");
  vtkDataArray* pointIds = surface->GetPointData()->GetArray("SurfacePointId");
  ASSERT_NE(heights, nullptr);
  ASSERT_NE(pointIds, nullptr);
  for (vtkIdType i = 0; i < surface->GetNumberOfPoints(); ++i)
  {
    EXPECT_NEAR(heights->GetComponent(i, 0), surface->GetPoint(i)[2], 1e-12);
    const auto source = static_cast<vtkIdType>(pointIds->GetComponent(i, 0));
    if (source >= 0)
    {
      EXPECT_NEAR(tube->GetPoint(source)[0], surface->GetPoint(i)[0], 1e-12);
    }
  }
  vtkCellData* cells = surface->GetCellData();
  ASSERT_NE(cells->GetArray("Ring"), nullptr);
  ASSERT_NE(cells->GetArray("RegionIds"), nullptr);
  std::map<double, int> entities;
  for (vtkIdType i = 0; i < surface->GetNumberOfCells(); ++i)
  {
    const double entity = cells->GetArray("CellEntityIds")->GetComponent(i, 0);
    ++entities[entity];
    const auto source =
      static_cast<vtkIdType>(cells->GetArray("SurfaceCellId")->GetComponent(i, 0));
    EXPECT_EQ(source<0, entity> 1.0);
    if (source >= 0)
    {
      EXPECT_EQ(cells->GetArray("Ring")->GetComponent(i, 0),
        tube->GetCellData()->GetArray("Ring")->GetComponent(source, 0));
    }
  }
  EXPECT_EQ(entities.size(), 3U);
  EXPECT_EQ(entities[1.0], 20 * 24 * 2);
}

TEST(SurfaceCleaner, CapsFollowTheInputsEntities)
{
  const auto tube = Tube();
  vtkNew<vtkIntArray> given;
  given->SetName("Faces");
  for (vtkIdType i = 0; i < tube->GetNumberOfCells(); ++i)
  {
    given->InsertNextValue(i % 2 == 0 ? 3 : 7);
  }
  tube->GetCellData()->AddArray(given);
  vtkNew<vtkSurfaceCleaner> filter;
  filter->SetInputData(tube);
  filter->SetEntityArrayName("Faces");
  filter->Update();
  vtkDataArray* faces = filter->GetOutput()->GetCellData()->GetArray("Faces");
  ASSERT_NE(faces, nullptr);
  EXPECT_EQ(faces->GetRange()[0], 3.0);
  EXPECT_EQ(faces->GetRange()[1], 9.0);
}

TEST(SurfaceCleaner, PiecesAndNothing)
{
  vtkNew<vtkSurfaceCleaner> filter;
  vtkNew<vtkPolyData> nothing;
  filter->SetInputData(nothing);
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  filter->SetInputData(Tube());
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  filter->UpdatePiece(0, 2, 0);
  EXPECT_GT(filter->GetOutput()->GetNumberOfCells(), 0);
}

TEST(SurfaceCleaner, AbortLeavesNothingAndTheNextRequestStartsAnew)
{
  vtkNew<vtkSurfaceCleaner> filter;
  filter->SetInputData(Tube());
  UpdateAborted(filter);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  filter->Update();
  EXPECT_GT(filter->GetOutput()->GetNumberOfCells(), 0);
}

TEST(SurfaceCleaner, RefusesWhatMakesNoSense)
{
  vtkNew<vtkSurfaceCleaner> filter;
  filter->SetInputData(Tube());
  filter->SetMinimumAngle(60.0);
  ExpectRefusal(filter, "The minimum angle");
  filter->SetMinimumAngle(10.0);
  filter->SetEntityArrayName("");
  ExpectRefusal(filter, "An output array needs a name");
  filter->SetEntityArrayName("CellEntityIds");
  const auto broken = Tube();
  broken->GetPoints()->SetPoint(3, std::nan(""), 0.0, 0.0);
  filter->SetInputData(broken);
  ExpectRefusal(filter, "Point 3 of the surface is not finite");
  const auto points = Tube();
  points->SetPolys(nullptr);
  filter->SetInputData(points);
  ExpectRefusal(filter, "The surface is empty");
}

TEST(SurfaceCleaner, PrintsItsSettings)
{
  vtkNew<vtkSurfaceCleaner> filter;
  std::ostringstream text;
  filter->Print(text);
  for (const char* name :
    { "MinimumComponentShare: 0.01", "JoinDistance: 1", "FillHoles: 1", "CapEnds: 1",
      "ResolveIntersections: 1", "MinimumAngle: 10", "EntityArrayName: CellEntityIds" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}

TEST(SurfaceCleaner, ForeignSurfacesComeOutClosedAndAreMeshed)
{
  struct Expected
  {
    const char* name;
    double components;
    double caps;
    double joined;
  };
  for (const Expected& expected : { Expected{ "coronary-phantom/phantom_tri3.stl", 1, 7, 0 },
         Expected{ "hra-coronaries/M_coronary_arteries.vtp", 2, 0, 2 },
         Expected{ "hra-coronaries/F_coronary_arteries.vtp", 2, 0, 0 },
         Expected{ "hra-coronaries/M_aorta.vtp", 1, 5, 0 } })
  {
    SCOPED_TRACE(expected.name);
    const auto surface = ReadSharedSurface(expected.name);
    if (surface == nullptr)
    {
      GTEST_SKIP() << "the shared data are not there";
    }
    vtkNew<vtkSurfaceCleaner> filter;
    filter->SetInputData(surface);
    Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.Errors.empty()) << messages.Errors[0];
    EXPECT_TRUE(messages.Warnings.empty()) << messages.Warnings[0];
    vtkPolyData* output = filter->GetOutput();
    ExpectClean(output);
    EXPECT_EQ(output->GetCellData()->GetArray("RegionIds")->GetRange()[1], expected.components - 1);
    EXPECT_EQ(Field(output, "Caps"), expected.caps);
    EXPECT_EQ(Field(output, "JoinedEnds"), expected.joined);
    EXPECT_EQ(Field(output, "OpenEdges"), 0.0);
    EXPECT_EQ(Field(output, "RemainingIntersections"), 0.0);
    EXPECT_LE(Field(output, "RemainingBadTriangles"), 0.001 * output->GetNumberOfCells());

    if (!coronary::HasTetrahedralBackend(coronary::TetrahedralBackend::TetGen))
    {
      continue;
    }
    vtkNew<vtkTetrahedralMesher> mesher;
    mesher->SetInputConnection(filter->GetOutputPort());
    mesher->Update();
    ASSERT_GT(mesher->GetOutput()->GetNumberOfCells(), 0);
    EXPECT_EQ(Field(mesher->GetOutput(), "Tries"), 1.0);
    EXPECT_GT(Field(mesher->GetOutput(), "MeshMinimumVolume"), 1e-7);
    EXPECT_GE(Field(mesher->GetOutput(), "MeshMinimumDihedralAngle"), 5.0 * M_PI / 180.0);
    EXPECT_LE(Field(mesher->GetOutput(), "PoorFraction"), 0.01);
  }
}
}
