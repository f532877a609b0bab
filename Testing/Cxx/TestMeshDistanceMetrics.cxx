// vtkMeshDistanceMetrics through the VTK pipeline: surfaces, table, time, blocks, pieces, refusals.
#include "vtkMeshDistanceMetrics.h"

#include "FilterMessages.h"
#include "MeshDistance.h"
#include "ProgressChecks.h"
#include "SurfaceTestMeshes.h"
#include "vtkCoronaryPhantomSource.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkTable.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace TestMeshDistanceMetrics
{
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace
{
vtkSmartPointer<vtkPolyData> PolyDataOf(const coronary::SurfaceMesh& mesh)
{
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const coronary::Vector3& p : mesh.points)
  {
    points->InsertNextPoint(p.data());
  }
  vtkNew<vtkCellArray> cells;
  for (const coronary::Triangle& t : mesh.triangles)
  {
    cells->InsertNextCell({ t[0], t[1], t[2] });
  }
  data->SetPoints(points);
  data->SetPolys(cells);
  if (!mesh.caps.empty())
  {
    vtkNew<vtkIntArray> entities;
    entities->SetName("CellEntityIds");
    for (const std::uint8_t cap : mesh.caps)
    {
      entities->InsertNextValue(cap != 0 ? 2 : 1);
    }
    data->GetCellData()->AddArray(entities);
  }
  return data;
}

vtkSmartPointer<vtkPolyData> Ball(double radius, double x = 0.0, int levels = 3)
{
  return PolyDataOf(coronary::Sphere(radius, levels, { x, 0.0, 0.0 }));
}

double Total(vtkTable* table, const char* column)
{
  EXPECT_GT(table->GetNumberOfRows(), 0);
  EXPECT_NE(table->GetColumnByName(column), nullptr) << column;
  return table->GetValueByName(table->GetNumberOfRows() - 1, column).ToDouble();
}

double Field(vtkDataObject* data, const char* name)
{
  vtkDataArray* array = data->GetFieldData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array ? array->GetComponent(0, 0) : std::numeric_limits<double>::quiet_NaN();
}

void ExpectRefusal(vtkMeshDistanceMetrics* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  EXPECT_EQ(filter->GetReferenceOutput()->GetNumberOfPoints(), 0);
  EXPECT_EQ(filter->GetTable()->GetNumberOfRows(), 0);
}

void UpdateAt(vtkMeshDistanceMetrics* filter, double time)
{
  filter->GetOutputInformation(0)->Set(SDDP::UPDATE_TIME_STEP(), time);
  filter->Update();
}

/// A sphere that is 1 + t large, at the given steps.
class GrowingBall : public vtkPolyDataAlgorithm
{
public:
  static GrowingBall* New();
  vtkTypeMacro(GrowingBall, vtkPolyDataAlgorithm);
  std::vector<double> Steps;

protected:
  GrowingBall() { this->SetNumberOfInputPorts(0); }
  int RequestInformation(
    vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    info->Set(SDDP::TIME_STEPS(), this->Steps.data(), static_cast<int>(this->Steps.size()));
    const double range[2] = { this->Steps.front(), this->Steps.back() };
    info->Set(SDDP::TIME_RANGE(), range, 2);
    return 1;
  }
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    const double time =
      info->Has(SDDP::UPDATE_TIME_STEP()) ? info->Get(SDDP::UPDATE_TIME_STEP()) : 0.0;
    vtkPolyData::GetData(outputs)->ShallowCopy(Ball(1.0 + time));
    return 1;
  }
};
vtkStandardNewMacro(GrowingBall);
}

TEST(MeshDistanceMetrics, SurfacesAndTable)
{
  const auto a = Ball(2.0);
  const auto b = Ball(1.7);
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputData(a);
  filter->SetReferenceData(b);
  filter->Update();
  vtkTable* table = filter->GetTable();
  ASSERT_EQ(table->GetNumberOfRows(), 1);
  EXPECT_EQ(table->GetValueByName(0, "Name").ToString(), "total");
  const coronary::MeshDistance direct =
    coronary::CompareSurfaces(coronary::Sphere(2.0, 3), coronary::Sphere(1.7, 3));
  EXPECT_EQ(Total(table, "HD"), direct.hausdorff);
  EXPECT_EQ(Total(table, "HD_BA"), direct.ba.hausdorff);
  EXPECT_EQ(Total(table, "MSD"), direct.ab.vertexMean);
  EXPECT_EQ(Total(table, "MSD_area"), direct.mean);
  EXPECT_EQ(Total(table, "RMS"), direct.rms);
  EXPECT_EQ(Total(table, "HD95"), direct.hausdorff95);
  EXPECT_EQ(Total(table, "error_bound"), direct.hausdorffError);
  EXPECT_NEAR(Total(table, "HD"), 0.3, 0.02);
  for (vtkDataObject* output : { static_cast<vtkDataObject*>(filter->GetOutput()),
         static_cast<vtkDataObject*>(filter->GetReferenceOutput()),
         static_cast<vtkDataObject*>(table) })
  {
    EXPECT_EQ(Field(output, "HD"), direct.hausdorff);
    vtkDataArray* where = output->GetFieldData()->GetArray("HausdorffPoints");
    ASSERT_NE(where, nullptr);
    EXPECT_EQ(where->GetNumberOfTuples(), 4);
    EXPECT_EQ(where->GetComponent(0, 1), direct.ab.at[1]);
    EXPECT_EQ(where->GetComponent(3, 2), direct.ba.nearest[2]);
    EXPECT_EQ(Field(output, "SignedDistance"), 1.0);
  }
  auto* outside =
    vtkDoubleArray::SafeDownCast(filter->GetOutput()->GetPointData()->GetArray("SurfaceDistance"));
  auto* inside = vtkDoubleArray::SafeDownCast(
    filter->GetReferenceOutput()->GetPointData()->GetArray("SurfaceDistance"));
  ASSERT_TRUE(outside != nullptr && inside != nullptr);
  EXPECT_EQ(outside->GetNumberOfTuples(), a->GetNumberOfPoints());
  EXPECT_NEAR(outside->GetValue(5), 0.3, 0.02);
  EXPECT_NEAR(inside->GetValue(5), -0.3, 0.02);
  // No input was changed.
  EXPECT_EQ(a->GetPointData()->GetNumberOfArrays(), 0);
  EXPECT_EQ(a->GetFieldData()->GetNumberOfArrays(), 0);

  filter->SignedDistancesOff();
  filter->Update();
  EXPECT_GT(
    filter->GetReferenceOutput()->GetPointData()->GetArray("SurfaceDistance")->GetComponent(5, 0),
    0.0);
}

TEST(MeshDistanceMetrics, BranchesAreRows)
{
  coronary::SurfaceMesh two = coronary::Sphere(1.0, 3);
  coronary::Append(two, coronary::Sphere(1.0, 3, { 5, 0, 0 }));
  const auto a = PolyDataOf(two);
  vtkNew<vtkIntArray> groups;
  groups->SetName("GroupIds");
  for (vtkIdType i = 0; i < a->GetNumberOfPoints(); ++i)
  {
    groups->InsertNextValue(2 * i < a->GetNumberOfPoints() ? 4 : 9);
  }
  a->GetPointData()->AddArray(groups);
  coronary::SurfaceMesh larger = coronary::Sphere(1.1, 3);
  coronary::Append(larger, coronary::Sphere(1.5, 3, { 5, 0, 0 }));
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputData(a);
  filter->SetReferenceData(PolyDataOf(larger));
  filter->Update();
  vtkTable* table = filter->GetTable();
  ASSERT_EQ(table->GetNumberOfRows(), 3);
  EXPECT_EQ(table->GetValueByName(0, "Name").ToString(), "result 4");
  EXPECT_EQ(table->GetValueByName(1, "GroupId").ToInt(), 9);
  EXPECT_EQ(table->GetValueByName(1, "Side").ToInt(), 0);
  EXPECT_NEAR(table->GetValueByName(0, "MSD_area").ToDouble(), 0.1, 0.02);
  EXPECT_NEAR(table->GetValueByName(1, "MSD").ToDouble(), 0.5, 0.02);
  EXPECT_TRUE(std::isnan(table->GetValueByName(1, "HD_BA").ToDouble()));
}

TEST(MeshDistanceMetrics, PolygonsStripsAndBlocks)
{
  // A square as one polygon against a strip half a millimetre above, in two blocks.
  vtkNew<vtkPoints> points;
  for (const auto& [x, y] : { std::pair<double, double>{ 0, 0 }, { 4, 0 }, { 4, 2 }, { 0, 2 } })
  {
    points->InsertNextPoint(x, y, 0.0);
  }
  vtkNew<vtkPolyData> polygon;
  polygon->SetPoints(points);
  vtkNew<vtkCellArray> cells;
  cells->InsertNextCell({ 0, 1, 2, 3 });
  polygon->SetPolys(cells);
  vtkNew<vtkMultiBlockDataSet> blocks;
  for (int n = 0; n < 2; ++n)
  {
    vtkNew<vtkPoints> above;
    for (const auto& [x, y] : { std::pair<double, double>{ 0, 0 }, { 2, 0 }, { 0, 2 }, { 2, 2 } })
    {
      above->InsertNextPoint(x + 2 * n, y, 0.5);
    }
    vtkNew<vtkPolyData> strip;
    strip->SetPoints(above);
    vtkNew<vtkCellArray> strips;
    strips->InsertNextCell({ 0, 1, 2, 3 });
    strip->SetStrips(strips);
    blocks->SetBlock(2 * n, strip);
  }
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputData(polygon);
  filter->SetReferenceData(blocks);
  filter->Update();
  EXPECT_NEAR(Total(filter->GetTable(), "HD"), 0.5, 1e-12);
  EXPECT_NEAR(Total(filter->GetTable(), "Area_A"), 8.0, 1e-12);
  EXPECT_NEAR(Total(filter->GetTable(), "Area_B"), 8.0, 1e-12);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 2);
  EXPECT_EQ(filter->GetReferenceOutput()->GetNumberOfCells(), 4);
}

TEST(MeshDistanceMetrics, TimesOfBothSidesMeet)
{
  vtkNew<GrowingBall> a;
  a->Steps = { 0.0, 0.25, 0.5 };
  vtkNew<GrowingBall> b;
  b->Steps = { 0.0, 0.2502, 0.6 };
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputConnection(a->GetOutputPort());
  filter->SetReferenceConnection(b->GetOutputPort());
  filter->UpdateInformation();
  EXPECT_EQ(filter->GetOutputInformation(0)->Length(SDDP::TIME_STEPS()), 3);
  EXPECT_EQ(filter->GetOutputInformation(2)->Get(SDDP::TIME_STEPS())[2], 0.5);
  UpdateAt(filter, 0.25);
  EXPECT_NEAR(Total(filter->GetTable(), "HD"), 2e-4, 1e-3);
  EXPECT_EQ(filter->GetOutput()->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), 0.25);
  // The request's nearest step counts.
  UpdateAt(filter, 0.28);
  EXPECT_EQ(filter->GetTable()->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), 0.25);
  // 0.5 against 0.6.
  ExpectFilterError(filter, "The result is of time 0.5, and the reference's nearest time is 0.6",
    [&] { UpdateAt(filter, 0.5); });
  filter->SetTimeTolerance(0.11);
  UpdateAt(filter, 0.5);
  EXPECT_NEAR(Total(filter->GetTable(), "HD"), 0.1, 0.01);

  // One side without time.
  filter->SetTimeTolerance(1e-3);
  filter->SetReferenceConnection(nullptr);
  filter->SetReferenceData(Ball(1.0));
  UpdateAt(filter, 0.5);
  EXPECT_NEAR(Total(filter->GetTable(), "HD"), 0.5, 0.02);
  vtkNew<vtkMeshDistanceMetrics> other;
  other->SetInputData(Ball(1.0));
  other->SetReferenceConnection(b->GetOutputPort());
  other->UpdateInformation();
  ASSERT_EQ(other->GetOutputInformation(0)->Length(SDDP::TIME_STEPS()), 3);
  UpdateAt(other, 0.6);
  EXPECT_NEAR(Total(other->GetTable(), "HD"), 0.6, 0.02);
}

TEST(MeshDistanceMetrics, PhantomAgainstItselfAtAnotherTime)
{
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetSeed(3);
  source->SetSurfaceSpacing(1.2);
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputConnection(source->GetOutputPort(vtkCoronaryPhantomSource::SurfacePort));
  vtkNew<vtkCoronaryPhantomSource> rest;
  rest->SetSeed(3);
  rest->SetSurfaceSpacing(1.2);
  rest->UpdateInformation();
  rest->GetOutputInformation(vtkCoronaryPhantomSource::SurfacePort)
    ->Set(SDDP::UPDATE_TIME_STEP(), 0.75);
  rest->Update(vtkCoronaryPhantomSource::SurfacePort);
  vtkNew<vtkPolyData> still;
  still->ShallowCopy(rest->GetOutputDataObject(vtkCoronaryPhantomSource::SurfacePort));
  filter->SetReferenceData(still);
  filter->UpdateInformation();
  UpdateAt(filter, 0.35);
  vtkTable* table = filter->GetTable();
  // Branches of both sides by the phantom's GroupIds.
  EXPECT_GT(table->GetNumberOfRows(), 15);
  EXPECT_GT(Total(table, "HD"), 2.0);
  EXPECT_LT(Total(table, "MSD"), Total(table, "HD"));
  EXPECT_NE(table->GetFieldData()->GetAbstractArray("PhaseTime"), nullptr);
  double maximum = 0.0;
  for (vtkIdType row = 0; row + 1 < table->GetNumberOfRows(); ++row)
  {
    maximum = std::max(maximum, table->GetValueByName(row, "HD").ToDouble());
  }
  EXPECT_EQ(maximum, Total(table, "HD"));
  const double mean = Total(table, "MSD_area");
  coronary::SetNumberOfThreads(1);
  filter->Modified();
  filter->Update();
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(Total(filter->GetTable(), "MSD_area"), mean);
}

TEST(MeshDistanceMetrics, EndsAreLeftOutOnRequest)
{
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputData(PolyDataOf(coronary::Tube(1.5, 0.0, 20.0, 24, 31, false)));
  filter->SetReferenceData(PolyDataOf(coronary::Tube(1.5, 0.5, 21.0, 24, 33, true)));
  filter->Update();
  EXPECT_GT(Total(filter->GetTable(), "HD"), 0.9);
  filter->SetEndLength(3.0);
  filter->Update();
  EXPECT_LT(Total(filter->GetTable(), "HD"), 1e-9);
  EXPECT_TRUE(std::isnan(
    filter->GetOutput()->GetPointData()->GetArray("SurfaceDistance")->GetComponent(0, 0)));
}

TEST(MeshDistanceMetrics, PiecesAndEmptyInput)
{
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputData(Ball(1.0));
  filter->SetReferenceData(Ball(1.2));
  filter->UpdatePiece(1, 3, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  EXPECT_EQ(filter->GetTable()->GetNumberOfRows(), 0);
  filter->UpdatePiece(0, 3, 0);
  EXPECT_EQ(filter->GetTable()->GetNumberOfRows(), 1);
  vtkNew<vtkPolyData> nothing;
  filter->SetReferenceData(nothing);
  ExpectRefusal(filter, "The reference has no triangles");
  vtkNew<vtkMultiBlockDataSet> noBlocks;
  filter->SetInputDataObject(0, noBlocks);
  ExpectRefusal(filter, "The result has no triangles");
}

TEST(MeshDistanceMetrics, RefusesWhatItCanNotUse)
{
  vtkNew<vtkMeshDistanceMetrics> filter;
  const auto bad = Ball(1.0);
  bad->GetPoints()->SetPoint(3, 0.0, std::numeric_limits<double>::quiet_NaN(), 0.0);
  filter->SetInputData(bad);
  filter->SetReferenceData(Ball(1.0));
  ExpectRefusal(filter, "The result: point 3 is not finite");
  filter->SetInputData(Ball(1.1));
  filter->SetErrorBound(0.0);
  ExpectRefusal(filter, "ErrorBound must be positive");
  filter->SetErrorBound(1e-3);
  filter->SetTimeTolerance(-1.0);
  ExpectRefusal(filter, "TimeTolerance");
  filter->SetTimeTolerance(0.0);
  const auto odd = Ball(1.1);
  vtkNew<vtkIntArray> pairs;
  pairs->SetName("GroupIds");
  pairs->SetNumberOfComponents(2);
  pairs->SetNumberOfTuples(odd->GetNumberOfPoints());
  pairs->Fill(0);
  odd->GetPointData()->AddArray(pairs);
  filter->SetInputData(odd);
  ExpectRefusal(filter, "point array GroupIds must have one value each");
  filter->SetInputData(Ball(1.1));
  filter->Update();
  EXPECT_EQ(filter->GetTable()->GetNumberOfRows(), 1);
}

TEST(MeshDistanceMetrics, WarnsOfOtherUnits)
{
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputData(Ball(1.0));
  filter->SetReferenceData(Ball(0.1));
  Messages messages(filter);
  filter->Update();
  ASSERT_EQ(messages.Warnings.size(), 1U);
  EXPECT_TRUE(messages.HasWarning("The result is about 10 times as large"));
}

TEST(MeshDistanceMetrics, ProgressAndAbort)
{
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetInputData(Ball(2.0, 0.3, 6));
  filter->SetReferenceData(Ball(1.9, 0.0, 6));
  EXPECT_LE(MaximumProgressStep(filter), 0.021);
  filter->Modified();
  UpdateAborted(filter);
  EXPECT_EQ(filter->GetTable()->GetNumberOfRows(), 0);
  filter->Modified();
  EXPECT_LT(SecondsToAbort(filter, 0.4), 0.5);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  filter->Update();
  EXPECT_EQ(filter->GetTable()->GetNumberOfRows(), 1);
}

TEST(MeshDistanceMetrics, PrintsItsSettings)
{
  vtkNew<vtkMeshDistanceMetrics> filter;
  filter->SetErrorBound(0.01);
  std::ostringstream text;
  filter->Print(text);
  for (const char* name :
    { "ErrorBound: 0.01", "SignedDistances: 1", "EndLength: 0", "TimeTolerance: 0.001" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}
}
