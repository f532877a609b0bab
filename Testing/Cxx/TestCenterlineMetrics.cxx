// vtkCenterlineMetrics through the VTK pipeline: tables, lines, branches, surfaces, names, time, pieces, blocks, refusals.
#include "vtkCenterlineMetrics.h"

#include "CenterlineOverlap.h"
#include "CoronaryAnatomy.h"
#include "FilterMessages.h"
#include "ParallelFor.h"
#include "vtkCoronaryPhantomSource.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkIntArray.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkTable.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace TestCenterlineMetrics
{
namespace
{
/// Lines along x from 0, at the given heights and of the given lengths.
vtkSmartPointer<vtkPolyData> MakeLines(const std::vector<std::array<double, 2>>& lines,
  const char* radiusName = "MaximumInscribedSphereRadius", double radius = 1.5)
{
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  vtkNew<vtkFloatArray> radii;
  for (const auto& [height, length] : lines)
  {
    cells->InsertNextCell(21);
    for (int i = 0; i <= 20; ++i)
    {
      cells->InsertCellPoint(points->InsertNextPoint(length * i / 20.0, height, 0.0));
      radii->InsertNextValue(static_cast<float>(radius));
    }
  }
  data->SetPoints(points);
  data->SetLines(cells);
  if (radiusName != nullptr)
  {
    radii->SetName(radiusName);
    data->GetPointData()->AddArray(radii);
  }
  return data;
}

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

vtkSmartPointer<vtkPolyData> PhantomTree(int seed, double time = 0.75)
{
  return Phantom(vtkCoronaryPhantomSource::TreePort, seed, time);
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

double Cell(vtkTable* table, vtkIdType row, const char* column)
{
  EXPECT_NE(table->GetColumnByName(column), nullptr) << column;
  return table->GetValueByName(row, column).ToDouble();
}

double Total(vtkTable* table, const char* column)
{
  EXPECT_GT(table->GetNumberOfRows(), 0);
  return Cell(table, table->GetNumberOfRows() - 1, column);
}

void ExpectRefusal(vtkCenterlineMetrics* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfRows(), 0);
  EXPECT_EQ(filter->GetLines()->GetNumberOfPoints(), 0);
  EXPECT_EQ(filter->GetBranchTable()->GetNumberOfRows(), 0);
  EXPECT_EQ(filter->GetBranches()->GetNumberOfPoints(), 0);
}
}

TEST(CenterlineMetrics, TwoLinesAlongTheirOrder)
{
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(MakeLines({ { 0.4, 60.0 } }, nullptr));
  filter->SetReferenceData(MakeLines({ { 0.0, 60.0 } }));
  filter->Update();
  vtkTable* table = filter->GetOutput();
  ASSERT_EQ(table->GetNumberOfRows(), 2);
  EXPECT_EQ(table->GetValueByName(0, "Name").ToString(), "path 0");
  EXPECT_EQ(table->GetValueByName(1, "Name").ToString(), "total");
  for (vtkIdType row = 0; row < 2; ++row)
  {
    for (const char* name : { "OV", "OF", "OT" })
    {
      EXPECT_DOUBLE_EQ(Cell(table, row, name), 1.0) << name;
    }
    for (const char* name : { "AD", "AI", "AT" })
    {
      EXPECT_NEAR(
        Cell(table, row, name), (2001.0 * 0.4 + 2000.0 * std::hypot(0.4, 0.03)) / 4001.0, 1e-5)
        << name;
    }
    EXPECT_TRUE(std::isnan(Cell(table, row, "RadiusError")));
    EXPECT_EQ(Cell(table, row, "TPR"), 2001.0);
    EXPECT_EQ(Cell(table, row, "FN"), 0.0);
    EXPECT_EQ(Cell(table, row, "TPM"), 2001.0);
    EXPECT_EQ(Cell(table, row, "FP"), 0.0);
    EXPECT_NEAR(Cell(table, row, "ReferenceLength"), 60.0, 1e-5);
  }
  EXPECT_EQ(Cell(table, 0, "ResultLine"), 0.0);
  EXPECT_EQ(Cell(table, 1, "ResultLine"), -1.0);
  EXPECT_NE(vtkIdTypeArray::SafeDownCast(table->GetColumnByName("TPR")), nullptr);
}

TEST(CenterlineMetrics, LinesSayWhatWasFoundMissedAndFalse)
{
  // The result leaves the second half of the upper line, and has one of its own.
  const auto reference = MakeLines({ { 0.0, 60.0 }, { 20.0, 60.0 } });
  const auto result = MakeLines({ { 0.0, 60.0 }, { 20.0, 30.0 }, { 40.0, 10.0 } }, "Radius", 1.8);
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(result);
  filter->SetReferenceData(reference);
  filter->Update();
  vtkTable* table = filter->GetOutput();
  ASSERT_EQ(table->GetNumberOfRows(), 3);
  EXPECT_EQ(table->GetValueByName(1, "Name").ToString(), "line 1");
  EXPECT_DOUBLE_EQ(Cell(table, 0, "OV"), 1.0);
  EXPECT_EQ(Cell(table, 1, "TPR"), 1051.0);
  EXPECT_EQ(Cell(table, 1, "FN"), 950.0);
  EXPECT_EQ(Cell(table, 1, "TPM"), 1001.0);
  EXPECT_NEAR(Cell(table, 1, "FP") * 0.03, 10.0, 0.05);
  EXPECT_NEAR(Cell(table, 0, "RadiusError"), 0.3, 1e-5);
  EXPECT_NEAR(Cell(table, 0, "RadiusBias"), 0.3, 1e-5);
  EXPECT_NEAR(table->GetFieldData()->GetArray("LongestFalse")->GetComponent(0, 0), 10.0, 0.05);
  EXPECT_NEAR(table->GetFieldData()->GetArray("LongestMissed")->GetComponent(0, 0), 28.5, 0.05);

  vtkPolyData* lines = filter->GetLines();
  ASSERT_EQ(lines->GetNumberOfLines(), 5);
  ASSERT_EQ(lines->GetNumberOfPoints(), 5 * 21);
  auto* match = vtkIntArray::SafeDownCast(lines->GetPointData()->GetArray("CenterlineMatch"));
  auto* distance =
    vtkDoubleArray::SafeDownCast(lines->GetPointData()->GetArray("CenterlineDistance"));
  auto* side = vtkIntArray::SafeDownCast(lines->GetPointData()->GetArray("FromReference"));
  auto* cellSide = vtkIntArray::SafeDownCast(lines->GetCellData()->GetArray("FromReference"));
  auto* radius = lines->GetPointData()->GetArray("MaximumInscribedSphereRadius");
  ASSERT_TRUE(match != nullptr && distance != nullptr && side != nullptr && cellSide != nullptr &&
    radius != nullptr);
  EXPECT_EQ(match->GetValue(10), 1);
  EXPECT_EQ(match->GetValue(21 + 5), 1);
  EXPECT_EQ(match->GetValue(21 + 20), 2);
  // The lower line is nearer than the end of its own.
  EXPECT_NEAR(distance->GetValue(21 + 20), 20.0, 1e-5);
  EXPECT_EQ(match->GetValue(3 * 21 + 20), 1);
  EXPECT_EQ(match->GetValue(4 * 21 + 3), 3);
  EXPECT_NEAR(distance->GetValue(4 * 21 + 3), 20.0, 1e-5);
  EXPECT_EQ(side->GetValue(41), 1);
  EXPECT_EQ(side->GetValue(42), 0);
  EXPECT_EQ(cellSide->GetValue(1), 1);
  EXPECT_EQ(cellSide->GetValue(2), 0);
  EXPECT_NEAR(radius->GetComponent(60, 0), 1.8, 1e-6);
  // No input was changed.
  EXPECT_EQ(reference->GetPointData()->GetNumberOfArrays(), 1);
  EXPECT_EQ(result->GetPointData()->GetNumberOfArrays(), 1);
}

TEST(CenterlineMetrics, PhantomTreesByName)
{
  const auto reference = PhantomTree(61);
  const auto result = PhantomTree(61, 0.8);
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(result);
  filter->SetReferenceData(reference);
  filter->Update();
  vtkTable* trees = filter->GetOutput();
  ASSERT_EQ(trees->GetNumberOfRows(), reference->GetNumberOfLines() + 1);
  auto* labels =
    vtkStringArray::SafeDownCast(reference->GetCellData()->GetAbstractArray("SegmentLabel"));
  ASSERT_NE(labels, nullptr);
  EXPECT_EQ(trees->GetValueByName(0, "Name").ToString(), "line 0, " + labels->GetValue(0));
  const double overlap = Total(trees, "OV");
  EXPECT_GT(overlap, 0.5);
  EXPECT_GT(Total(trees, "AD"), 0.02);
  filter->SetMethod(vtkCenterlineMetrics::PathMethod);
  filter->Update();
  vtkTable* paths = filter->GetOutput();
  EXPECT_LT(paths->GetNumberOfRows(), reference->GetNumberOfLines() + 1);
  EXPECT_EQ(paths->GetValueByName(0, "Name").ToString().find("path 0 "), 0U);
  // An ordered correspondence is never shorter than the nearest points are.
  EXPECT_GT(Total(paths, "AD"), 0.02);
  EXPECT_EQ(paths->GetFieldData()->GetArray("LongestFalse"), nullptr);

  filter->SetMethod(vtkCenterlineMetrics::TreeMethod);
  coronary::SetNumberOfThreads(1);
  filter->Update();
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(Total(filter->GetOutput(), "OV"), overlap);
}

TEST(CenterlineMetrics, FollowsTime)
{
  vtkNew<vtkCoronaryPhantomSource> moving;
  moving->SetSeed(62);
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputConnection(moving->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  // The result's time step that is nearest to the request is compared.
  filter->SetReferenceData(PhantomTree(62, coronary::PaperPhases()[14]));
  filter->UpdateInformation();
  std::vector<double> distances;
  for (const double time : { 0.76, 0.35 })
  {
    filter->GetOutputInformation(0)->Set(
      vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), time);
    filter->Update();
    distances.push_back(Total(filter->GetOutput(), "AD"));
  }
  EXPECT_LT(distances[0], 0.02);
  EXPECT_GT(distances[1], 1.0);
}

TEST(CenterlineMetrics, EmptyInputsAndPieces)
{
  vtkNew<vtkPolyData> nothing;
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(nothing);
  filter->SetReferenceData(nothing);
  filter->Update();
  ASSERT_EQ(filter->GetOutput()->GetNumberOfRows(), 1);
  EXPECT_TRUE(std::isnan(Total(filter->GetOutput(), "OV")));
  EXPECT_EQ(filter->GetLines()->GetNumberOfPoints(), 0);
  EXPECT_NE(filter->GetLines()->GetPointData()->GetArray("CenterlineMatch"), nullptr);
  filter->SetReferenceData(MakeLines({ { 0.0, 60.0 } }));
  filter->Update();
  EXPECT_DOUBLE_EQ(Total(filter->GetOutput(), "OV"), 0.0);
  filter->SetReferenceData(nothing);
  filter->SetInputData(MakeLines({ { 0.0, 60.0 } }));
  filter->Update();
  EXPECT_DOUBLE_EQ(Total(filter->GetOutput(), "OV"), 0.0);

  filter->SetReferenceData(MakeLines({ { 0.0, 60.0 } }));
  filter->UpdatePiece(1, 3, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfRows(), 0);
  EXPECT_EQ(filter->GetLines()->GetNumberOfPoints(), 0);
  filter->Modified(); // VTK 9.3 makes no table anew for another piece alone
  filter->UpdatePiece(0, 3, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfRows(), 2);
}

TEST(CenterlineMetrics, BlocksAreOneTree)
{
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(0, MakeLines({ { 0.0, 60.0 } }));
  blocks->SetBlock(1, MakeLines({ { 20.0, 30.0 } }));
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputDataObject(0, blocks);
  filter->SetReferenceData(MakeLines({ { 0.0, 60.0 }, { 20.0, 60.0 } }));
  filter->Update();
  EXPECT_EQ(filter->GetLines()->GetNumberOfLines(), 4);
  EXPECT_EQ(Cell(filter->GetOutput(), 1, "FN"), 950.0);
}

TEST(CenterlineMetrics, RefusesWhatItCanNotUse)
{
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(MakeLines({ { 0.0, 60.0 } }));
  filter->SetReferenceData(MakeLines({ { 0.0, 60.0 } }));
  const auto bad = MakeLines({ { 0.0, 60.0 } });
  bad->GetPoints()->SetPoint(3, 0.0, std::numeric_limits<double>::quiet_NaN(), 0.0);
  filter->SetInputData(bad);
  ExpectRefusal(filter, "oint 3 of the result is not finite");
  filter->SetInputData(MakeLines({ { 0.0, 60.0 } }, "Radius", -1.0));
  ExpectRefusal(filter, "radius of point 0 of the result");
  filter->SetInputData(MakeLines({ { 0.0, 60.0 } }));
  filter->SetRelevantRadius(-1.0);
  ExpectRefusal(filter, "the relevant radius");
  filter->SetRelevantRadius(0.75);
  filter->SetMethod(7);
  ExpectRefusal(filter, "There is no method 7");
  filter->SetMethod(vtkCenterlineMetrics::AutomaticMethod);
  filter->Update();
  EXPECT_NE(filter->GetLines()->GetPointData()->GetArray("CenterlineMatch"), nullptr);
  EXPECT_DOUBLE_EQ(Total(filter->GetOutput(), "OV"), 1.0);
}

TEST(CenterlineMetrics, WithoutRadiiTheToleranceStandsForThem)
{
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(MakeLines({ { 1.2, 60.0 } }));
  filter->SetReferenceData(MakeLines({ { 0.0, 60.0 } }, nullptr));
  filter->Update();
  EXPECT_DOUBLE_EQ(Total(filter->GetOutput(), "OV"), 0.0);
  EXPECT_TRUE(std::isnan(filter->GetLines()
                           ->GetPointData()
                           ->GetArray("MaximumInscribedSphereRadius")
                           ->GetComponent(0, 0)));
  filter->SetTolerance(1.5);
  filter->Update();
  EXPECT_DOUBLE_EQ(Total(filter->GetOutput(), "OV"), 1.0);
}

TEST(CenterlineMetrics, WarnsOfALineThatRunsTheOtherWay)
{
  const auto reversed = MakeLines({ { 0.0, 60.0 } });
  for (vtkIdType i = 0; i <= 20; ++i)
  {
    reversed->GetPoints()->SetPoint(i, 60.0 - 3.0 * static_cast<double>(i), 0.0, 0.0);
  }
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(reversed);
  filter->SetReferenceData(MakeLines({ { 0.0, 60.0 } }));
  Messages messages(filter);
  filter->Update();
  ASSERT_EQ(messages.Warnings.size(), 1U);
  EXPECT_NE(messages.Warnings[0].find("against the reference"), std::string::npos);
  filter->SetMethod(vtkCenterlineMetrics::TreeMethod);
  filter->Update();
  EXPECT_EQ(messages.Warnings.size(), 1U);
  EXPECT_DOUBLE_EQ(Total(filter->GetOutput(), "OV"), 1.0);
}

TEST(CenterlineMetrics, AbortLeavesNothingAndTheNextRequestStartsAnew)
{
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(PhantomTree(63));
  filter->SetReferenceData(PhantomTree(63));
  UpdateAborted(filter);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfRows(), 0);
  filter->Update();
  EXPECT_GT(filter->GetOutput()->GetNumberOfRows(), 10);
  EXPECT_DOUBLE_EQ(Total(filter->GetOutput(), "OV"), 1.0);
}

TEST(BranchMetrics, PhantomTrees)
{
  const auto tree = PhantomTree(61);
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(tree);
  filter->SetReferenceData(tree);
  filter->Update();
  vtkTable* table = filter->GetBranchTable();
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
  EXPECT_LT(Field(filter->GetBranchTable(), "BCR"), 1.0);
  EXPECT_LT(Field(filter->GetBranchTable(), "BCR_bounded"), 1.0);
  EXPECT_EQ(Field(filter->GetBranchTable(), "FalseBranches"), 0.0);
  const double score = Field(filter->GetBranchTable(), "BCS");
  coronary::SetNumberOfThreads(1);
  filter->Modified();
  filter->Update();
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(Field(filter->GetBranchTable(), "BCS"), score);
}

TEST(BranchMetrics, SurfacesByTheirGroups)
{
  const auto surface = Phantom(vtkCoronaryPhantomSource::SurfacePort, 61);
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(surface);
  filter->SetReferenceData(surface);
  filter->Update();
  EXPECT_EQ(Field(filter->GetBranchTable(), "BCR"), 1.0);
  EXPECT_NEAR(Field(filter->GetBranchTable(), "BCS"), 1.0, 1e-12);
  EXPECT_DOUBLE_EQ(Total(filter->GetOutput(), "OV"), 1.0);
  // A surface and the tree in it.
  filter->SetReferenceData(PhantomTree(61));
  filter->Update();
  EXPECT_NEAR(Field(filter->GetBranchTable(), "BCR"), 1.0, 0.15);
  EXPECT_GT(Field(filter->GetBranchTable(), "BCR_bounded"), 0.9);
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

TEST(BranchMetrics, BlocksTimeAndPieces)
{
  vtkNew<vtkCoronaryPhantomSource> moving;
  moving->SetSeed(62);
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputConnection(moving->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(1, PhantomTree(62));
  filter->SetReferenceData(blocks);
  filter->UpdateInformation();
  ASSERT_TRUE(filter->GetOutputInformation(0)->Has(vtkStreamingDemandDrivenPipeline::TIME_RANGE()));
  double detected[2];
  for (int n = 0; n < 2; ++n)
  {
    filter->GetOutputInformation(0)->Set(
      vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), n == 0 ? 0.75 : 0.35);
    filter->Update();
    detected[n] = Field(filter->GetBranchTable(), "LengthDetected");
    // All branches are there, wherever they are.
    EXPECT_EQ(Field(filter->GetBranchTable(), "BCR"), 1.0);
  }
  EXPECT_GT(detected[0], 0.99);
  EXPECT_LT(detected[1], 0.9);
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetBranchTable()->GetNumberOfRows(), 0);
}

TEST(BranchMetrics, EmptyInputsAndRefusals)
{
  vtkNew<vtkPolyData> nothing;
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetInputData(nothing);
  filter->SetReferenceData(nothing);
  filter->Update();
  EXPECT_EQ(filter->GetBranchTable()->GetNumberOfRows(), 0);
  EXPECT_TRUE(std::isnan(Field(filter->GetBranchTable(), "BCR")));
  const auto tree = PhantomTree(63);
  filter->SetReferenceData(tree);
  filter->Update();
  EXPECT_EQ(Field(filter->GetBranchTable(), "BCR"), 0.0);
  filter->SetInputData(tree);
  filter->SetTolerance(0.0);
  ExpectRefusal(filter, "Tolerance must be positive");
  filter->SetTolerance(1.0);
  filter->SetDetectedShare(2.0);
  ExpectRefusal(filter, "DetectedShare");
  filter->SetDetectedShare(0.8);
  const auto bad = PhantomTree(63);
  bad->GetPoints()->SetPoint(3, 0.0, std::numeric_limits<double>::quiet_NaN(), 0.0);
  filter->SetInputData(bad);
  ExpectRefusal(filter, "oint 3 of the result is not finite");
  filter->SetInputData(tree);
  UpdateAborted(filter);
  EXPECT_EQ(filter->GetBranchTable()->GetNumberOfRows(), 0);
  filter->Update();
  EXPECT_EQ(Field(filter->GetBranchTable(), "BCR"), 1.0);
}

TEST(CenterlineMetrics, PrintsItsSettings)
{
  vtkNew<vtkCenterlineMetrics> filter;
  filter->SetRelevantRadius(0.6);
  std::ostringstream text;
  filter->Print(text);
  for (const char* name : { "Method: 0", "RelevantRadius: 0.6", "MinimumRadius: 0", "Tolerance: 1",
         "DetectedShare: 0.8", "MinimumLength: 3" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}
}
