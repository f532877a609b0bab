// vtkFrenetSweepSurface through the VTK pipeline: arrays, ports, image, pieces, blocks, refusals.
#include "vtkFrenetSweepSurface.h"

#include "FilterMessages.h"
#include "ParallelFor.h"
#include "SurfaceMeasures.h"
#include "TriangleIntersections.h"
#include "vtkCoronaryPhantomSource.h"

#include "vtkCallbackCommand.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCompositeDataPipeline.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkIdTypeArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkIntArray.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkStructuredGrid.h"
#include "vtkXMLPolyDataReader.h"
#include "vtkXMLPolyDataWriter.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace TestFrenetSweepSurface
{
namespace
{
using SDDP = vtkStreamingDemandDrivenPipeline;
using coronary::Vector3;

struct Mesh
{
  std::vector<Vector3> points;
  std::vector<coronary::Triangle> triangles;

  explicit Mesh(vtkPolyData* data)
  {
    for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
    {
      this->points.emplace_back(data->GetPoint(i));
    }
    vtkNew<vtkIdList> ids;
    for (vtkIdType c = 0; c < data->GetNumberOfPolys(); ++c)
    {
      data->GetPolys()->GetCellAtId(c, ids);
      this->triangles.push_back({ ids->GetId(0), ids->GetId(1), ids->GetId(2) });
    }
  }
};

/// A trunk of 15 mm with two arms of 12 mm; separate points where they meet when `apart`.
vtkSmartPointer<vtkPolyData> MakeFork(
  const char* radiusName = "MaximumInscribedSphereRadius", bool apart = false)
{
  auto fork = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> radius;
  radius->SetName(radiusName);
  vtkNew<vtkCellArray> lines;
  const auto line = [&](const Vector3& from, const Vector3& to, double width, vtkIdType first)
  {
    vtkNew<vtkIdList> ids;
    for (int i = 0; i <= 30; ++i)
    {
      if (i == 0 && first >= 0)
      {
        ids->InsertNextId(first);
        continue;
      }
      const Vector3 p = from + (to - from) * i / 30.0;
      ids->InsertNextId(points->InsertNextPoint(p.data()));
      radius->InsertNextValue(static_cast<float>(width));
    }
    lines->InsertNextCell(ids);
    return ids->GetId(30);
  };
  const Vector3 node(0.0, 0.0, 15.0);
  const vtkIdType end = line(Vector3::Zero(), node, 2.0, -1);
  line(node, Vector3(5.0, 0.0, 26.0), 1.6, apart ? -1 : end);
  line(node, Vector3(-6.0, 0.0, 25.0), 1.2, apart ? -1 : end);
  fork->SetPoints(points);
  fork->SetLines(lines);
  fork->GetPointData()->AddArray(radius);
  vtkNew<vtkIntArray> groups;
  groups->SetName("GroupIds");
  vtkNew<vtkStringArray> labels;
  labels->SetName("SegmentLabel");
  vtkNew<vtkIntArray> segments;
  segments->SetName("SegmentIds");
  for (int g = 0; g < 3; ++g)
  {
    groups->InsertNextValue(10 * g + 5);
    labels->InsertNextValue(g == 0 ? "LM" : g == 1 ? "pLAD" : "pCx");
    segments->InsertNextValue(g + 5);
  }
  fork->GetCellData()->AddArray(groups);
  fork->GetCellData()->AddArray(labels);
  fork->GetCellData()->AddArray(segments);
  vtkNew<vtkDoubleArray> cycle;
  cycle->SetName("CycleLength");
  cycle->InsertNextValue(0.85);
  fork->GetFieldData()->AddArray(cycle);
  return fork;
}

template <typename Array>
Array* Get(vtkFieldData* data, const char* name)
{
  auto* array = Array::SafeDownCast(data->GetAbstractArray(name));
  EXPECT_NE(array, nullptr) << name;
  return array;
}

void ExpectRefusal(vtkFrenetSweepSurface* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  EXPECT_EQ(filter->GetPatches()->GetNumberOfBlocks(), 0U);
  EXPECT_EQ(filter->GetCaps()->GetNumberOfPoints(), 0);
}

/// Gives nothing, or a tube along x with an elliptic section, 1.8 mm by 1.1 mm, on 0.3 mm voxels.
vtkSmartPointer<vtkImageData> EllipticTube()
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(80, 40, 40);
  image->SetSpacing(0.3, 0.3, 0.3);
  image->SetOrigin(-2.0, -6.0, -6.0);
  image->AllocateScalars(VTK_SHORT, 1);
  for (int k = 0; k < 40; ++k)
  {
    for (int j = 0; j < 40; ++j)
    {
      for (int i = 0; i < 80; ++i)
      {
        const double y = -6.0 + 0.3 * j;
        const double z = -6.0 + 0.3 * k;
        const double across = std::hypot(y / 1.8, z / 1.1);
        // A wall about a voxel wide.
        const double distance = (across - 1.0) * std::sqrt(1.8 * 1.1);
        *static_cast<short*>(image->GetScalarPointer(i, j, k)) =
          static_cast<short>(std::lround(150.0 - 250.0 * std::tanh(distance / 0.3)));
      }
    }
  }
  return image;
}

vtkSmartPointer<vtkPolyData> Line(double radius)
{
  auto tree = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkDoubleArray> radii;
  radii->SetName("Radius");
  vtkNew<vtkIdList> ids;
  for (int i = 0; i <= 40; ++i)
  {
    ids->InsertNextId(points->InsertNextPoint(0.5 * i, 0.0, 0.0));
    radii->InsertNextValue(radius);
  }
  vtkNew<vtkCellArray> lines;
  lines->InsertNextCell(ids);
  tree->SetPoints(points);
  tree->SetLines(lines);
  tree->GetPointData()->AddArray(radii);
  return tree;
}
}

TEST(FrenetSweepSurface, GivesTheDocumentedArrays)
{
  const auto fork = MakeFork();
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(fork);
  filter->Update();
  vtkPolyData* surface = filter->GetOutput();
  const Mesh mesh(surface);
  const auto measures = coronary::MeasureSurface(mesh.points, mesh.triangles);
  EXPECT_TRUE(measures.Closed());
  EXPECT_TRUE(measures.Manifold());
  EXPECT_EQ(measures.components, 1);
  EXPECT_EQ(measures.eulerCharacteristic, 2);
  EXPECT_GT(measures.volume, 0.0);
  EXPECT_GE(measures.WorstAngle(), 10.0);
  EXPECT_TRUE(coronary::FindSelfIntersections(mesh.points, mesh.triangles).empty());

  const vtkIdType points = surface->GetNumberOfPoints();
  for (const char* name :
    { "Abscissas", "MaximumInscribedSphereRadius", "WallCurvature", "EdgeLength" })
  {
    auto* array = Get<vtkDoubleArray>(surface->GetPointData(), name);
    ASSERT_EQ(array->GetNumberOfTuples(), points);
    for (vtkIdType i = 0; i < points; ++i)
    {
      ASSERT_TRUE(std::isfinite(array->GetValue(i))) << name;
    }
  }
  EXPECT_EQ(surface->GetPointData()->GetNormals()->GetNumberOfTuples(), points);
  auto* groups = Get<vtkIntArray>(surface->GetPointData(), "GroupIds");
  std::set<int> seen;
  for (vtkIdType i = 0; i < points; ++i)
  {
    seen.insert(groups->GetValue(i));
  }
  EXPECT_EQ(seen, (std::set<int>{ 5, 15, 25 }));
  auto* entities = Get<vtkIntArray>(surface->GetCellData(), "CellEntityIds");
  auto* cellGroups = Get<vtkIntArray>(surface->GetCellData(), "GroupIds");
  auto* segments = Get<vtkIntArray>(surface->GetCellData(), "SegmentIds");
  auto* labels = Get<vtkStringArray>(surface->GetCellData(), "SegmentLabel");
  std::set<int> ids;
  for (vtkIdType c = 0; c < surface->GetNumberOfCells(); ++c)
  {
    ids.insert(entities->GetValue(c));
    const int group = cellGroups->GetValue(c);
    EXPECT_EQ(segments->GetValue(c), (group - 5) / 10 + 5);
    EXPECT_EQ(labels->GetValue(c), group == 5 ? "LM" : group == 15 ? "pLAD" : "pCx");
    if (entities->GetValue(c) > 1)
    {
      EXPECT_EQ(group, 10 * (entities->GetValue(c) - 2) + 5);
    }
  }
  EXPECT_EQ(ids, (std::set<int>{ 1, 2, 3, 4 }));
  EXPECT_NEAR(Get<vtkDoubleArray>(surface->GetFieldData(), "CycleLength")->GetValue(0), 0.85, 0.0);

  vtkPolyData* caps = filter->GetCaps();
  ASSERT_EQ(caps->GetNumberOfVerts(), 3);
  auto* inlet = Get<vtkIntArray>(caps->GetPointData(), "IsInlet");
  auto* normal = Get<vtkDoubleArray>(caps->GetPointData(), "CapNormal");
  EXPECT_EQ(inlet->GetValue(0), 1);
  EXPECT_EQ(inlet->GetValue(1) + inlet->GetValue(2), 0);
  EXPECT_NEAR(normal->GetComponent(0, 2), -1.0, 1e-6);
  EXPECT_EQ(Get<vtkIntArray>(caps->GetPointData(), "CellEntityIds")->GetValue(2), 4);
  EXPECT_EQ(Get<vtkStringArray>(caps->GetPointData(), "SegmentLabel")->GetValue(2), "pCx");
}

TEST(FrenetSweepSurface, PatchesAreStructured)
{
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(MakeFork());
  filter->SetPatchSamples(16);
  filter->SetPatchSpacing(1.0);
  filter->Update();
  vtkMultiBlockDataSet* patches = filter->GetPatches();
  ASSERT_EQ(patches->GetNumberOfBlocks(), 3U);
  EXPECT_STREQ(patches->GetMetaData(0U)->Get(vtkCompositeDataSet::NAME()), "LM");
  for (unsigned int b = 0; b < 3; ++b)
  {
    auto* grid = vtkStructuredGrid::SafeDownCast(patches->GetBlock(b));
    ASSERT_NE(grid, nullptr);
    int dimensions[3];
    grid->GetDimensions(dimensions);
    EXPECT_EQ(dimensions[0], 17);
    EXPECT_GT(dimensions[1], 5);
    EXPECT_EQ(dimensions[2], 1);
    EXPECT_EQ(Get<vtkIntArray>(grid->GetFieldData(), "GroupIds")->GetValue(0),
      10 * static_cast<int>(b) + 5);
    auto* centre = Get<vtkDoubleArray>(grid->GetPointData(), "PatchCentre");
    auto* radius = Get<vtkDoubleArray>(grid->GetPointData(), "MaximumInscribedSphereRadius");
    auto* tangent = Get<vtkDoubleArray>(grid->GetPointData(), "FrenetTangent");
    for (const char* name : { "FrenetNormal", "FrenetBinormal" })
    {
      EXPECT_EQ(Get<vtkDoubleArray>(grid->GetPointData(), name)->GetNumberOfComponents(), 3);
    }
    for (const char* name : { "Curvature", "Torsion", "FrameTwist", "Abscissas" })
    {
      EXPECT_EQ(Get<vtkDoubleArray>(grid->GetPointData(), name)->GetNumberOfTuples(),
        grid->GetNumberOfPoints());
    }
    for (vtkIdType i = 0; i < grid->GetNumberOfPoints(); ++i)
    {
      Vector3 c;
      Vector3 t;
      centre->GetTypedTuple(i, c.data());
      tangent->GetTypedTuple(i, t.data());
      const Vector3 offset = Vector3(grid->GetPoint(i)) - c;
      EXPECT_NEAR(offset.norm(), radius->GetValue(i), 1e-6);
      EXPECT_NEAR(offset.dot(t), 0.0, 1e-6);
    }
    // The last point around is the first once more.
    EXPECT_EQ(Vector3(grid->GetPoint(0)), Vector3(grid->GetPoint(16)));
  }
}

TEST(FrenetSweepSurface, PlacesThatAreTheSameJoin)
{
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(MakeFork("Radius", true));
  filter->Update();
  const Mesh mesh(filter->GetOutput());
  EXPECT_EQ(coronary::MeasureSurface(mesh.points, mesh.triangles).components, 1);
  EXPECT_EQ(filter->GetCaps()->GetNumberOfPoints(), 3);
}

TEST(FrenetSweepSurface, BranchesThatAreLeftOutAreNamed)
{
  // A vessel that crosses the trunk without a common point.
  const auto fork = MakeFork();
  vtkNew<vtkIdList> ids;
  for (int i = 0; i <= 60; ++i)
  {
    const double p[3] = { -10.0 + i / 3.0, 0.1, 7.0 };
    ids->InsertNextId(fork->GetPoints()->InsertNextPoint(p));
    fork->GetPointData()->GetArray("MaximumInscribedSphereRadius")->InsertNextTuple1(1.0);
  }
  fork->GetLines()->InsertNextCell(ids);
  Get<vtkIntArray>(fork->GetCellData(), "GroupIds")->InsertNextValue(99);
  Get<vtkStringArray>(fork->GetCellData(), "SegmentLabel")->InsertNextValue("D9");
  Get<vtkIntArray>(fork->GetCellData(), "SegmentIds")->InsertNextValue(9);
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(fork);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  ASSERT_EQ(messages.Warnings.size(), 1U);
  EXPECT_NE(messages.Warnings[0].find("D9 (group 99) is left out"), std::string::npos);
  const Mesh mesh(filter->GetOutput());
  EXPECT_EQ(coronary::MeasureSurface(mesh.points, mesh.triangles).components, 2);
  vtkFieldData* field = filter->GetOutput()->GetFieldData();
  ASSERT_EQ(Get<vtkStringArray>(field, "LeftOut")->GetNumberOfValues(), 1);
  EXPECT_EQ(Get<vtkStringArray>(field, "LeftOutVessels")->GetValue(0), "D9 (group 99)");
  EXPECT_NEAR(Get<vtkDoubleArray>(field, "LeftOutPlaces")->GetComponent(0, 0), -3.5, 1.0);
  EXPECT_NEAR(Get<vtkDoubleArray>(field, "LeftOutLengths")->GetValue(0), 13.5, 1.0);
  auto* missing = Get<vtkIdTypeArray>(field, "LeftOutPoints");
  EXPECT_NEAR(static_cast<double>(missing->GetNumberOfValues()), 41.0, 3.0);
  EXPECT_EQ(missing->GetValue(missing->GetNumberOfValues() - 1), ids->GetId(60));
  filter->SetInputData(MakeFork());
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetFieldData()->GetAbstractArray("LeftOut"), nullptr);
  EXPECT_EQ(filter->GetOutput()->GetFieldData()->GetAbstractArray("Repairs"), nullptr);
}

TEST(FrenetSweepSurface, OpenEndsAndARadiusThatIsChosen)
{
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(MakeFork("Width"));
  filter->SetInputRadiusArrayName("Width");
  filter->CappingOff();
  filter->Update();
  const Mesh mesh(filter->GetOutput());
  const auto measures = coronary::MeasureSurface(mesh.points, mesh.triangles);
  EXPECT_GT(measures.openEdges, 0U);
  EXPECT_EQ(measures.eulerCharacteristic, 2 - 3);
  auto* ids = Get<vtkIntArray>(filter->GetOutput()->GetCellData(), "CellEntityIds");
  double range[2];
  ids->GetRange(range);
  EXPECT_EQ(range[1], 1.0);
  EXPECT_EQ(filter->GetCaps()->GetNumberOfPoints(), 3);
}

TEST(FrenetSweepSurface, EndNormals)
{
  const auto fork = MakeFork();
  vtkNew<vtkFloatArray> normals;
  normals->SetName("Planes");
  normals->SetNumberOfComponents(3);
  normals->SetNumberOfTuples(fork->GetNumberOfPoints());
  normals->Fill(0.0);
  normals->SetTuple3(0, 0.6, 0.0, 0.8);
  fork->GetPointData()->AddArray(normals);
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(fork);
  filter->SetEndNormalArrayName("Planes");
  filter->Update();
  auto* cap = Get<vtkDoubleArray>(filter->GetCaps()->GetPointData(), "CapNormal");
  EXPECT_NEAR(cap->GetComponent(0, 0), -0.6, 1e-6);
  EXPECT_NEAR(cap->GetComponent(0, 2), -0.8, 1e-6);
  filter->SetEndNormalArrayName("Other");
  ExpectRefusal(filter, "no point array Other");
}

TEST(FrenetSweepSurface, ContoursOfTheInput)
{
  const auto tree = Line(1.5);
  vtkNew<vtkDoubleArray> contours;
  contours->SetName("Contours");
  contours->SetNumberOfComponents(16);
  vtkNew<vtkDoubleArray> normals;
  normals->SetName("FrenetNormal");
  normals->SetNumberOfComponents(3);
  for (vtkIdType i = 0; i < tree->GetNumberOfPoints(); ++i)
  {
    double row[16];
    for (int k = 0; k < 16; ++k)
    {
      const double a = 2.0 * 3.14159265358979 * k / 16.0;
      row[k] = 1.0 / std::hypot(std::cos(a) / 2.0, std::sin(a) / 1.2);
    }
    contours->InsertNextTuple(row);
    normals->InsertNextTuple3(0.0, 1.0, 0.0);
  }
  tree->GetPointData()->AddArray(contours);
  tree->GetPointData()->AddArray(normals);
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(tree);
  filter->SetContourArrayName("Contours");
  filter->Update();
  const double* bounds = filter->GetOutput()->GetBounds();
  EXPECT_NEAR(bounds[3], 2.0, 0.06);
  EXPECT_NEAR(bounds[5], 1.2, 0.06);
}

TEST(FrenetSweepSurface, ContoursAreMeasuredInTheImage)
{
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(Line(std::sqrt(1.8 * 1.1)));
  filter->SetImageData(EllipticTube());
  filter->Update();
  const Mesh mesh(filter->GetOutput());
  const auto measures = coronary::MeasureSurface(mesh.points, mesh.triangles);
  EXPECT_TRUE(measures.Closed());
  EXPECT_GE(measures.WorstAngle(), 10.0);
  double worst = 0.0;
  for (const Vector3& p : mesh.points)
  {
    if (p[0] > 2.0 && p[0] < 18.0)
    {
      worst = std::max(worst, std::abs(std::hypot(p[1] / 1.8, p[2] / 1.1) - 1.0));
    }
  }
  EXPECT_LT(worst, 0.1);

  filter->SetInputImageArrayName("Other");
  ExpectRefusal(filter, "no point array 'Other'");
  // Where nothing is to be seen it stays round, and that is said.
  const auto dark = EllipticTube();
  dark->GetPointData()->GetScalars()->Fill(40.0);
  filter->SetInputImageArrayName("Automatic");
  filter->SetImageData(dark);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_TRUE(messages.HasWarning("cross-sections"));
  const double* bounds = filter->GetOutput()->GetBounds();
  EXPECT_NEAR(bounds[3], std::sqrt(1.8 * 1.1), 0.03);
  EXPECT_NEAR(bounds[5], std::sqrt(1.8 * 1.1), 0.03);
}

TEST(FrenetSweepSurface, EmptyInputsGiveEmptyOutputs)
{
  vtkNew<vtkPolyData> nothing;
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(nothing);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_TRUE(messages.Echoes.empty());
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  EXPECT_NE(filter->GetOutput()->GetCellData()->GetAbstractArray("CellEntityIds"), nullptr);
  EXPECT_EQ(filter->GetPatches()->GetNumberOfBlocks(), 0U);
}

TEST(FrenetSweepSurface, Refusals)
{
  vtkNew<vtkFrenetSweepSurface> filter;
  const auto fork = MakeFork("Width");
  filter->SetInputData(fork);
  ExpectRefusal(filter, "MaximumInscribedSphereRadius");
  filter->SetInputRadiusArrayName("Breadth");
  ExpectRefusal(filter, "Breadth");
  filter->SetInputRadiusArrayName("Width");
  fork->GetPointData()->GetArray("Width")->SetComponent(7, 0, -1.0);
  fork->Modified();
  ExpectRefusal(filter, "point 7");
  filter->SetInputData(MakeFork());
  filter->SetInputRadiusArrayName("Automatic");
  filter->SetBlending(3.0);
  ExpectRefusal(filter, "Blending must be");
  filter->SetBlending(0.5);
  filter->SetMinimumEdgeLength(std::numeric_limits<double>::quiet_NaN());
  ExpectRefusal(filter, "MinimumEdgeLength must be");
  filter->SetMinimumEdgeLength(0.15);
  filter->SetContourArrayName("MaximumInscribedSphereRadius");
  ExpectRefusal(filter, "FrenetNormal");
  filter->SetContourArrayName("None");
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_GT(filter->GetOutput()->GetNumberOfCells(), 100);
}

TEST(FrenetSweepSurface, InputStaysAndRunsRepeat)
{
  const auto fork = MakeFork();
  vtkNew<vtkPolyData> before;
  before->DeepCopy(fork);
  const vtkMTimeType time = fork->GetMTime();
  std::vector<Mesh> results;
  for (const int threads : { 1, 4 })
  {
    coronary::SetNumberOfThreads(threads);
    vtkNew<vtkFrenetSweepSurface> filter;
    filter->SetInputData(fork);
    filter->Update();
    results.emplace_back(filter->GetOutput());
  }
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(results[0].points, results[1].points);
  EXPECT_EQ(results[0].triangles, results[1].triangles);
  EXPECT_EQ(fork->GetMTime(), time);
  EXPECT_EQ(fork->GetPointData()->GetNumberOfArrays(), before->GetPointData()->GetNumberOfArrays());
  EXPECT_EQ(fork->GetCellData()->GetNumberOfArrays(), before->GetCellData()->GetNumberOfArrays());
}

TEST(FrenetSweepSurface, ProgressRisesAndAbortEnds)
{
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(MakeFork());
  struct State
  {
    double last = 0.0;
    double widest = 0.0;
    bool falls = false;
    bool abort = false;
  } state;
  vtkNew<vtkCallbackCommand> observer;
  observer->SetClientData(&state);
  observer->SetCallback(
    [](vtkObject* caller, unsigned long, void* client, void* value)
    {
      auto* s = static_cast<State*>(client);
      const double now = *static_cast<double*>(value);
      s->falls = s->falls || now < s->last;
      s->widest = std::max(s->widest, now - s->last);
      s->last = now;
      if (s->abort && now > 0.3)
      {
        static_cast<vtkAlgorithm*>(caller)->SetAbortExecute(1);
      }
    });
  filter->AddObserver(vtkCommand::ProgressEvent, observer);
  filter->Update();
  EXPECT_FALSE(state.falls);
  EXPECT_DOUBLE_EQ(state.last, 1.0);
  EXPECT_LT(state.widest, 0.25);
  const vtkIdType whole = filter->GetOutput()->GetNumberOfCells();
  state = State();
  state.abort = true;
  filter->Modified();
  {
    Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.Errors.empty());
  }
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  state = State();
  filter->SetAbortExecute(0);
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), whole);
}

TEST(FrenetSweepSurface, PiecesBlocksAndFiles)
{
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputData(MakeFork());
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);
  filter->UpdatePiece(0, 2, 0);
  const vtkIdType whole = filter->GetOutput()->GetNumberOfCells();
  EXPECT_GT(whole, 100);

  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetDataModeToBinary();
  writer->WriteToOutputStringOn();
  writer->SetInputData(filter->GetOutput());
  writer->Write();
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->ReadFromInputStringOn();
  reader->SetInputString(writer->GetOutputString());
  reader->Update();
  EXPECT_EQ(Mesh(reader->GetOutput()).triangles, Mesh(filter->GetOutput()).triangles);
  EXPECT_NE(reader->GetOutput()->GetCellData()->GetAbstractArray("SegmentLabel"), nullptr);

  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(0, MakeFork());
  blocks->SetBlock(1, Line(1.0));
  vtkNew<vtkCompositeDataPipeline> executive;
  vtkNew<vtkFrenetSweepSurface> each;
  each->SetExecutive(executive);
  each->SetInputDataObject(blocks);
  // VTK's pipeline cannot put the patches, blocks themselves, into blocks, and says so.
  vtkObject::GlobalWarningDisplayOff();
  each->Update();
  vtkObject::GlobalWarningDisplayOn();
  auto* made = vtkMultiBlockDataSet::SafeDownCast(each->GetOutputDataObject(0));
  ASSERT_NE(made, nullptr);
  ASSERT_EQ(made->GetNumberOfBlocks(), 2U);
  EXPECT_EQ(vtkPolyData::SafeDownCast(made->GetBlock(0))->GetNumberOfCells(), whole);
  EXPECT_GT(vtkPolyData::SafeDownCast(made->GetBlock(1))->GetNumberOfCells(), 100);
}

TEST(FrenetSweepSurface, TimeGoesOnAndIsFollowed)
{
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetSeed(3);
  vtkNew<vtkFrenetSweepSurface> filter;
  filter->SetInputConnection(source->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  filter->SetMaximumEdgeLength(1.0);
  filter->SetEdgeLengthPerRadius(0.7);
  filter->UpdateInformation();
  vtkInformation* info = filter->GetOutputInformation(0);
  ASSERT_TRUE(info->Has(SDDP::TIME_RANGE()));
  std::vector<vtkSmartPointer<vtkPolyData>> moved;
  for (const double time : { 0.0, 0.4 })
  {
    filter->UpdateTimeStep(time);
    auto copy = vtkSmartPointer<vtkPolyData>::New();
    copy->ShallowCopy(filter->GetOutput());
    moved.push_back(copy);
    EXPECT_EQ(copy->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), time);
  }
  EXPECT_GT((Vector3(moved[0]->GetCenter()) - Vector3(moved[1]->GetCenter())).norm(), 0.1);
  // Two arteries, and not more.
  const Mesh mesh(moved[0]);
  EXPECT_EQ(coronary::MeasureSurface(mesh.points, mesh.triangles).components, 2);
}

TEST(FrenetSweepSurface, Prints)
{
  vtkNew<vtkFrenetSweepSurface> filter;
  std::ostringstream text;
  filter->Print(text);
  for (const char* name : { "Blending", "EndNormalArrayName", "InputImageArrayName", "Frame" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos);
  }
}
}
