// vtkBranchMetrics through the VTK pipeline: trees, surfaces, table, lines, time, refusals.
#include "vtkBranchMetrics.h"

#include "BranchMetrics.h"
#include "FilterMessages.h"
#include "ParallelFor.h"
#include "vtkCoronaryPhantomSource.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkTable.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>
#include <string>

namespace
{
vtkSmartPointer<vtkPolyData> Phantom(int port, int seed, double time = 0.75)
{
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetSeed(seed);
  source->SetSurfaceSpacing(0.8);
  source->UpdateInformation();
  source->GetOutputInformation(port)->Set(
    vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), time);
  source->Update(port);
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->ShallowCopy(source->GetOutputDataObject(port));
  return data;
}

/// Without some of its lines.
vtkSmartPointer<vtkPolyData> Without(vtkPolyData* tree, vtkIdType last)
{
  auto part = vtkSmartPointer<vtkPolyData>::New();
  part->SetPoints(tree->GetPoints());
  part->GetPointData()->ShallowCopy(tree->GetPointData());
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkIdList> ids;
  for (vtkIdType i = 0; i + last < tree->GetNumberOfCells(); ++i)
  {
    tree->GetCellPoints(i, ids);
    lines->InsertNextCell(ids);
  }
  part->SetLines(lines);
  return part;
}

double Field(vtkDataObject* data, const char* name)
{
  vtkDataArray* array = data->GetFieldData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array ? array->GetComponent(0, 0) : std::numeric_limits<double>::quiet_NaN();
}

void ExpectRefusal(vtkBranchMetrics* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectError(filter, part);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfRows(), 0);
  EXPECT_EQ(filter->GetBranches()->GetNumberOfPoints(), 0);
}
}

TEST(BranchMetricsFilter, PhantomTrees)
{
  const auto tree = Phantom(vtkCoronaryPhantomSource::TreePort, 61);
  vtkNew<vtkBranchMetrics> filter;
  filter->SetInputData(tree);
  filter->SetReferenceData(tree);
  filter->Update();
  vtkTable* table = filter->GetOutput();
  const vtkIdType count = table->GetNumberOfRows();
  EXPECT_GT(count, 8);
  EXPECT_EQ(Field(table, "BCR"), 1.0);
  EXPECT_EQ(Field(table, "BCS"), 1.0);
  EXPECT_EQ(Field(table, "BCR_bounded"), 1.0);
  EXPECT_EQ(Field(table, "BCS_bounded"), 1.0);
  EXPECT_EQ(Field(table, "OV"), 1.0);
  EXPECT_EQ(Field(table, "ReferenceBranches"), static_cast<double>(count));
  vtkPolyData* branches = filter->GetBranches();
  ASSERT_EQ(branches->GetNumberOfLines(), 2 * count);
  auto* match = vtkIdTypeArray::SafeDownCast(branches->GetCellData()->GetArray("BranchMatch"));
  ASSERT_NE(match, nullptr);
  for (vtkIdType i = 0; i < count; ++i)
  {
    EXPECT_EQ(match->GetValue(i), i);
    EXPECT_EQ(table->GetValueByName(i, "ResultBranch").ToInt(), static_cast<int>(i));
    EXPECT_EQ(table->GetValueByName(i, "Detected").ToInt(), 1);
  }
  EXPECT_EQ(branches->GetCellData()->GetArray("FromReference")->GetComponent(0, 0), 1.0);
  EXPECT_EQ(branches->GetCellData()->GetArray("FromReference")->GetComponent(count, 0), 0.0);

  // Without the last two lines some branches are gone; what is left is as long as before or longer.
  filter->SetInputData(Without(tree, 2));
  filter->Update();
  EXPECT_LT(Field(filter->GetOutput(), "BCR"), 1.0);
  EXPECT_LT(Field(filter->GetOutput(), "BCR_bounded"), 1.0);
  EXPECT_EQ(Field(filter->GetOutput(), "FalseBranches"), 0.0);
  const double score = Field(filter->GetOutput(), "BCS");
  coronary::SetNumberOfThreads(1);
  filter->Modified();
  filter->Update();
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(Field(filter->GetOutput(), "BCS"), score);
}

TEST(BranchMetricsFilter, SurfacesByTheirGroups)
{
  const auto surface = Phantom(vtkCoronaryPhantomSource::SurfacePort, 61);
  vtkNew<vtkBranchMetrics> filter;
  filter->SetInputData(surface);
  filter->SetReferenceData(surface);
  filter->Update();
  EXPECT_EQ(Field(filter->GetOutput(), "BCR"), 1.0);
  EXPECT_NEAR(Field(filter->GetOutput(), "BCS"), 1.0, 1e-12);
  // A surface and the tree in it: the same branches, as lines of the tree are cut.
  filter->LinesAreBranchesOn();
  filter->SetReferenceData(Phantom(vtkCoronaryPhantomSource::TreePort, 61));
  filter->Update();
  EXPECT_NEAR(Field(filter->GetOutput(), "BCR"), 1.0, 0.15);
  EXPECT_GT(Field(filter->GetOutput(), "BCR_bounded"), 0.9);
  // A bare surface.
  vtkNew<vtkPolyData> bare;
  bare->SetPoints(surface->GetPoints());
  bare->SetPolys(surface->GetPolys());
  filter->SetInputData(bare);
  ExpectRefusal(filter,
    "The result is a surface without the point array GroupIds: its branches are not known; give "
    "its "
    "centerline instead");
}

TEST(BranchMetricsFilter, BlocksTimeAndPieces)
{
  vtkNew<vtkCoronaryPhantomSource> moving;
  moving->SetSeed(62);
  vtkNew<vtkBranchMetrics> filter;
  filter->SetInputConnection(moving->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(1, Phantom(vtkCoronaryPhantomSource::TreePort, 62));
  filter->SetReferenceData(blocks);
  filter->UpdateInformation();
  ASSERT_TRUE(filter->GetOutputInformation(0)->Has(vtkStreamingDemandDrivenPipeline::TIME_RANGE()));
  double detected[2];
  for (int n = 0; n < 2; ++n)
  {
    filter->GetOutputInformation(0)->Set(
      vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), n == 0 ? 0.75 : 0.35);
    filter->Update();
    detected[n] = Field(filter->GetOutput(), "LengthDetected");
    // All branches are there, wherever they are.
    EXPECT_EQ(Field(filter->GetOutput(), "BCR"), 1.0);
  }
  EXPECT_GT(detected[0], 0.99);
  EXPECT_LT(detected[1], 0.9);
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfRows(), 0);
}

TEST(BranchMetricsFilter, EmptyInputsAndRefusals)
{
  vtkNew<vtkPolyData> nothing;
  vtkNew<vtkBranchMetrics> filter;
  filter->SetInputData(nothing);
  filter->SetReferenceData(nothing);
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetNumberOfRows(), 0);
  EXPECT_TRUE(std::isnan(Field(filter->GetOutput(), "BCR")));
  const auto tree = Phantom(vtkCoronaryPhantomSource::TreePort, 63);
  filter->SetReferenceData(tree);
  filter->Update();
  EXPECT_EQ(Field(filter->GetOutput(), "BCR"), 0.0);
  filter->SetInputData(tree);
  filter->SetSpacing(0.0);
  ExpectRefusal(filter, "Spacing must be positive");
  filter->SetSpacing(0.25);
  filter->SetDetectedShare(2.0);
  ExpectRefusal(filter, "DetectedShare");
  filter->SetDetectedShare(0.8);
  const auto bad = Phantom(vtkCoronaryPhantomSource::TreePort, 63);
  bad->GetPoints()->SetPoint(3, 0.0, std::numeric_limits<double>::quiet_NaN(), 0.0);
  filter->SetInputData(bad);
  ExpectRefusal(filter, "oint 3 of the result is not finite");
  filter->SetInputData(tree);
  UpdateAborted(filter);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfRows(), 0);
  filter->Update();
  EXPECT_EQ(Field(filter->GetOutput(), "BCR"), 1.0);
}

TEST(BranchMetricsFilter, PrintsItsSettings)
{
  vtkNew<vtkBranchMetrics> filter;
  filter->SetTolerance(1.5);
  std::ostringstream text;
  filter->Print(text);
  for (const char* name : { "Spacing: 0.25", "Tolerance: 1.5", "DetectedShare: 0.8",
         "OverlapGate: 0.25", "LeastLength: 3", "LinesAreBranches: 0", "TimeTolerance: 0.001" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}
