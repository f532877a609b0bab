// vtkCoronaryTreeTopology through the VTK pipeline: arrays, names, roots, pieces, blocks, refusals.
#include "vtkCoronaryTreeTopology.h"

#include "CoronaryPhantom.h"
#include "FilterMessages.h"
#include "ParallelFor.h"
#include "vtkCoronaryPhantomSource.h"

#include "vtkCallbackCommand.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCommand.h"
#include "vtkCompositeDataPipeline.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkIntArray.h"
#include "vtkMath.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkXMLPolyDataReader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace TestCoronaryTreeTopology
{
namespace
{
constexpr double Pi = 3.14159265358979323846;

vtkSmartPointer<vtkPolyData> PhantomTree(int seed, int dominance, double time = 0.75)
{
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetSeed(seed);
  source->SetDominance(dominance);
  source->UpdateInformation();
  source->GetOutputInformation(vtkCoronaryPhantomSource::TreePort)
    ->Set(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), time);
  source->Update(vtkCoronaryPhantomSource::TreePort);
  auto tree = vtkSmartPointer<vtkPolyData>::New();
  tree->ShallowCopy(source->GetOutputDataObject(vtkCoronaryPhantomSource::TreePort));
  return tree;
}

/// A straight trunk of 20 mm with two arms, as separate lines over shared points.
vtkSmartPointer<vtkPolyData> MakeFork(const char* radiusName)
{
  auto fork = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  vtkNew<vtkFloatArray> radius;
  radius->SetName(radiusName);
  vtkNew<vtkCellArray> lines;
  const auto line = [&](const double* from, const double* to, double width, vtkIdType first)
  {
    vtkNew<vtkIdList> ids;
    for (int i = 0; i <= 40; ++i)
    {
      if (i == 0 && first >= 0)
      {
        ids->InsertNextId(first);
        continue;
      }
      ids->InsertNextId(points->InsertNextPoint(from[0] + (to[0] - from[0]) * i / 40.0,
        from[1] + (to[1] - from[1]) * i / 40.0, from[2] + (to[2] - from[2]) * i / 40.0));
      radius->InsertNextValue(static_cast<float>(width));
    }
    lines->InsertNextCell(ids);
    return ids->GetId(40);
  };
  const double base[3] = { 0, 0, 0 };
  const double middle[3] = { 0, 0, 20 };
  const double left[3] = { 14, 0, 34 };
  const double right[3] = { -14, 0, 34 };
  const vtkIdType end = line(base, middle, 2.0, -1);
  line(middle, left, 1.6, end);
  line(middle, right, 1.2, end);
  fork->SetPoints(points);
  fork->SetLines(lines);
  fork->GetPointData()->AddArray(radius);
  return fork;
}

void ExpectRefusal(vtkCoronaryTreeTopology* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part);
  for (int port = 0; port < 3; ++port)
  {
    EXPECT_EQ(filter->GetOutput(port)->GetNumberOfPoints(), 0);
  }
}

template <typename Array>
Array* PointArray(vtkPolyData* data, const char* name)
{
  auto* array = Array::SafeDownCast(data->GetPointData()->GetAbstractArray(name));
  EXPECT_NE(array, nullptr) << name;
  return array;
}

template <typename Array>
Array* CellArray(vtkPolyData* data, const char* name)
{
  auto* array = Array::SafeDownCast(data->GetCellData()->GetAbstractArray(name));
  EXPECT_NE(array, nullptr) << name;
  return array;
}
}

TEST(CoronaryTreeTopology, NamesThePhantomsTrees)
{
  for (int dominance = 0; dominance < 3; ++dominance)
  {
    const auto truth = PhantomTree(41 + dominance, dominance);
    // Renamed, so that it does not pass for the result.
    vtkNew<vtkIntArray> wanted;
    wanted->DeepCopy(truth->GetPointData()->GetArray("SegmentIds"));
    wanted->SetName("TrueSegment");
    truth->GetPointData()->AddArray(wanted);
    vtkNew<vtkCoronaryTreeTopology> filter;
    filter->SetInputData(truth);
    filter->Update();
    vtkPolyData* tree = filter->GetOutput();
    EXPECT_EQ(tree->GetNumberOfLines(), truth->GetNumberOfLines());
    EXPECT_EQ(tree->GetNumberOfPoints(), truth->GetNumberOfPoints());
    auto* given = PointArray<vtkIntArray>(tree, "SegmentIds");
    auto* passed = PointArray<vtkIntArray>(tree, "TrueSegment");
    int right = 0;
    for (vtkIdType i = 0; i < tree->GetNumberOfPoints(); ++i)
    {
      right += given->GetValue(i) == passed->GetValue(i);
    }
    EXPECT_GT(right, 0.95 * static_cast<double>(tree->GetNumberOfPoints()));
    auto* labels = CellArray<vtkStringArray>(tree, "SegmentLabel");
    auto* ids = CellArray<vtkIntArray>(tree, "SegmentIds");
    std::set<std::string> names;
    for (vtkIdType i = 0; i < tree->GetNumberOfCells(); ++i)
    {
      EXPECT_EQ(labels->GetValue(i), coronary::SegmentName(ids->GetValue(i)));
      names.insert(labels->GetValue(i));
    }
    EXPECT_EQ(names.count("R-PDA"), dominance == 1 ? 0U : 1U);
    EXPECT_EQ(names.count("L-PDA"), dominance == 1 ? 1U : 0U);
    auto* found = vtkStringArray::SafeDownCast(tree->GetFieldData()->GetAbstractArray("Dominance"));
    ASSERT_NE(found, nullptr);
    const char* dominanceNames[] = { "right", "left", "balanced" };
    EXPECT_EQ(found->GetValue(0), dominanceNames[dominance]);
    // The input's field data goes on.
    EXPECT_NE(tree->GetFieldData()->GetArray("CycleLength"), nullptr);
  }
}

TEST(CoronaryTreeTopology, GivesTheDocumentedArrays)
{
  const auto truth = PhantomTree(44, 0);
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputData(truth);
  filter->Update();
  vtkPolyData* tree = filter->GetOutput();
  const vtkIdType points = tree->GetNumberOfPoints();
  for (const char* name :
    { "MaximumInscribedSphereRadius", "Abscissas", "Curvature", "Torsion", "SectionArea" })
  {
    auto* array = PointArray<vtkDoubleArray>(tree, name);
    ASSERT_EQ(array->GetNumberOfTuples(), points);
    for (vtkIdType i = 0; i < points; ++i)
    {
      ASSERT_TRUE(std::isfinite(array->GetValue(i))) << name;
    }
  }
  auto* tangent = PointArray<vtkDoubleArray>(tree, "FrenetTangent");
  auto* normal = PointArray<vtkDoubleArray>(tree, "FrenetNormal");
  auto* binormal = PointArray<vtkDoubleArray>(tree, "FrenetBinormal");
  for (vtkIdType i = 0; i < points; ++i)
  {
    double t[3];
    double n[3];
    double b[3];
    tangent->GetTypedTuple(i, t);
    normal->GetTypedTuple(i, n);
    binormal->GetTypedTuple(i, b);
    EXPECT_NEAR(t[0] * t[0] + t[1] * t[1] + t[2] * t[2], 1.0, 1e-9);
    EXPECT_NEAR(t[0] * n[0] + t[1] * n[1] + t[2] * n[2], 0.0, 1e-9);
    EXPECT_NEAR(t[1] * n[2] - t[2] * n[1], b[0], 1e-9);
  }
  auto* group = CellArray<vtkIntArray>(tree, "GroupIds");
  auto* parent = CellArray<vtkIntArray>(tree, "ParentGroupIds");
  auto* generation = CellArray<vtkIntArray>(tree, "BranchGeneration");
  auto* strahler = CellArray<vtkIntArray>(tree, "StrahlerOrder");
  auto* treeIds = CellArray<vtkIntArray>(tree, "TreeIds");
  auto* length = CellArray<vtkDoubleArray>(tree, "Length");
  auto* tortuosity = CellArray<vtkDoubleArray>(tree, "Tortuosity");
  vtkNew<vtkIdList> ids;
  for (vtkIdType c = 0; c < tree->GetNumberOfCells(); ++c)
  {
    EXPECT_EQ(group->GetValue(c), c);
    EXPECT_LT(parent->GetValue(c), c);
    tree->GetCellPoints(c, ids);
    double way = 0.0;
    for (vtkIdType i = 1; i < ids->GetNumberOfIds(); ++i)
    {
      double p[3];
      double q[3];
      tree->GetPoint(ids->GetId(i - 1), p);
      tree->GetPoint(ids->GetId(i), q);
      way += std::sqrt(vtkMath::Distance2BetweenPoints(p, q));
    }
    EXPECT_NEAR(length->GetValue(c), way, 1e-6);
    EXPECT_GE(tortuosity->GetValue(c), 0.0);
    if (parent->GetValue(c) >= 0)
    {
      const vtkIdType first = ids->GetId(0);
      tree->GetCellPoints(parent->GetValue(c), ids);
      EXPECT_EQ(first, ids->GetId(ids->GetNumberOfIds() - 1));
      EXPECT_EQ(generation->GetValue(c), generation->GetValue(parent->GetValue(c)) + 1);
      EXPECT_LE(strahler->GetValue(c), strahler->GetValue(parent->GetValue(c)));
      EXPECT_EQ(treeIds->GetValue(c), treeIds->GetValue(parent->GetValue(c)));
    }
  }

  vtkPolyData* bifurcations = filter->GetBifurcations();
  EXPECT_EQ(bifurcations->GetNumberOfVerts(), bifurcations->GetNumberOfPoints());
  EXPECT_GT(bifurcations->GetNumberOfPoints(), 10);
  for (const char* name : { "BifurcationAngle", "ParentRadius", "AreaRatio", "DaughterAreaRatio",
         "MurrayExponent", "MurrayResidual", "HuoKassabResidual", "FinetRatio", "FittedExponent" })
  {
    EXPECT_EQ(PointArray<vtkDoubleArray>(bifurcations, name)->GetNumberOfTuples(),
      bifurcations->GetNumberOfPoints());
  }
  for (const char* name : { "DaughterAngles", "DaughterRadii" })
  {
    EXPECT_EQ(PointArray<vtkDoubleArray>(bifurcations, name)->GetNumberOfComponents(), 3);
  }
  EXPECT_EQ(PointArray<vtkIntArray>(bifurcations, "DaughterGroupIds")->GetNumberOfComponents(), 3);
  EXPECT_EQ(filter->GetLoops()->GetNumberOfLines(), 0);

  // The heart's frame puts the ostia above the apex.
  auto* frame = vtkDoubleArray::SafeDownCast(tree->GetFieldData()->GetArray("HeartFrame"));
  ASSERT_NE(frame, nullptr);
  ASSERT_EQ(frame->GetNumberOfComponents(), 16);
  double lowest = 0.0;
  for (vtkIdType i = 0; i < points; ++i)
  {
    const double* p = tree->GetPoint(i);
    double height = frame->GetComponent(0, 11);
    for (int k = 0; k < 3; ++k)
    {
      height += frame->GetComponent(0, 8 + k) * p[k];
    }
    lowest = std::max(lowest, height);
    if (i == 0)
    {
      EXPECT_LT(height, 10.0);
    }
  }
  EXPECT_NEAR(lowest, 91.5, 15.0);
}

TEST(CoronaryTreeTopology, MeasuresAFork)
{
  for (const char* name : { "MaximumInscribedSphereRadius", "Radius" })
  {
    vtkNew<vtkCoronaryTreeTopology> filter;
    filter->SetInputData(MakeFork(name));
    filter->LabelSegmentsOff();
    filter->SetMurrayExponent(2.0);
    filter->Update();
    EXPECT_EQ(filter->GetOutput()->GetNumberOfLines(), 3);
    EXPECT_EQ(filter->GetOutput()->GetPoints()->GetDataType(), VTK_FLOAT);
    vtkPolyData* bifurcations = filter->GetBifurcations();
    ASSERT_EQ(bifurcations->GetNumberOfPoints(), 1);
    EXPECT_NEAR(
      PointArray<vtkDoubleArray>(bifurcations, "BifurcationAngle")->GetValue(0), 0.5 * Pi, 1e-5);
    EXPECT_NEAR(PointArray<vtkDoubleArray>(bifurcations, "MurrayResidual")->GetValue(0), 0.0, 1e-6);
    EXPECT_NEAR(PointArray<vtkDoubleArray>(bifurcations, "FittedExponent")->GetValue(0), 2.0, 1e-5);
    auto* daughters = PointArray<vtkIntArray>(bifurcations, "DaughterGroupIds");
    EXPECT_EQ(daughters->GetTypedComponent(0, 2), -1);
    EXPECT_EQ(
      PointArray<vtkDoubleArray>(bifurcations, "DaughterRadii")->GetTypedComponent(0, 2), -1.0);
    EXPECT_EQ(filter->GetOutput()->GetFieldData()->GetAbstractArray("Dominance"), nullptr);
  }
}

TEST(CoronaryTreeTopology, RootsAreTaken)
{
  vtkNew<vtkPolyData> roots;
  vtkNew<vtkPoints> points;
  points->InsertNextPoint(14.5, 0.0, 35.0);
  roots->SetPoints(points);
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputData(MakeFork("Radius"));
  filter->SetRootData(roots);
  filter->LabelSegmentsOff();
  filter->Update();
  vtkNew<vtkIdList> ids;
  filter->GetOutput()->GetCellPoints(0, ids);
  EXPECT_NEAR(filter->GetOutput()->GetPoint(ids->GetId(0))[0], 14.0, 1e-6);
}

TEST(CoronaryTreeTopology, LoopsAreShownAndWarnedOf)
{
  const auto fork = MakeFork("Radius");
  vtkNew<vtkIdList> closing;
  closing->InsertNextId(80);
  closing->InsertNextId(120);
  fork->GetLines()->InsertNextCell(closing);
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputData(fork);
  filter->LabelSegmentsOff();
  Messages messages(filter);
  filter->Update();
  EXPECT_EQ(messages.Errors.size(), 0U);
  ASSERT_EQ(messages.Warnings.size(), 1U);
  EXPECT_NE(messages.Warnings[0].find("1 loop was"), std::string::npos);
  ASSERT_EQ(filter->GetLoops()->GetNumberOfLines(), 1);
  const double expected = 2.0 * std::hypot(14.0, 14.0) + 28.0;
  EXPECT_NEAR(CellArray<vtkDoubleArray>(filter->GetLoops(), "Length")->GetValue(0), expected, 1e-4);
  EXPECT_NEAR(filter->GetOutput()->GetFieldData()->GetArray("LoopLengths")->GetComponent(0, 0),
    expected, 1e-4);
}

TEST(CoronaryTreeTopology, TheRadiusArrayIsChosen)
{
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputData(MakeFork("Calibre"));
  filter->SetInputRadiusArrayName("Calibre");
  filter->LabelSegmentsOff();
  filter->Update();
  EXPECT_NE(filter->GetOutput()->GetPointData()->GetArray("MaximumInscribedSphereRadius"), nullptr);
}

TEST(CoronaryTreeTopology, EmptyInputGivesEmptyOutputWithArrays)
{
  vtkNew<vtkPolyData> nothing;
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputData(nothing);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  EXPECT_NE(filter->GetOutput()->GetPointData()->GetArray("Curvature"), nullptr);
  EXPECT_NE(filter->GetOutput()->GetCellData()->GetAbstractArray("SegmentLabel"), nullptr);
  EXPECT_NE(filter->GetBifurcations()->GetPointData()->GetArray("MurrayResidual"), nullptr);

  // Points without lines are nothing as well, whatever their arrays.
  vtkNew<vtkPolyData> points;
  points->SetPoints(MakeFork("Radius")->GetPoints());
  filter->SetInputData(points);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
}

TEST(CoronaryTreeTopology, OtherPiecesAreEmptyAndValid)
{
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputData(MakeFork("Radius"));
  filter->LabelSegmentsOff();
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  EXPECT_NE(filter->GetOutput()->GetPointData()->GetArray("Curvature"), nullptr);
  filter->UpdatePiece(0, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfLines(), 3);
}

TEST(CoronaryTreeTopology, BlocksAreTreatedOneByOne)
{
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(0, MakeFork("Radius"));
  blocks->SetBlock(2, MakeFork("Radius"));
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputDataObject(blocks);
  filter->LabelSegmentsOff();
  filter->Update();
  auto* result = vtkMultiBlockDataSet::SafeDownCast(filter->GetOutputDataObject(0));
  ASSERT_NE(result, nullptr);
  for (const int b : { 0, 2 })
  {
    auto* block = vtkPolyData::SafeDownCast(result->GetBlock(b));
    ASSERT_NE(block, nullptr);
    EXPECT_EQ(block->GetNumberOfLines(), 3);
  }
}

TEST(CoronaryTreeTopology, InputIsLeftAloneAndThreadsDoNotMatter)
{
  const auto truth = PhantomTree(45, 0);
  vtkNew<vtkPolyData> copy;
  copy->DeepCopy(truth);
  vtkNew<vtkPolyData> first;
  for (const int threads : { 1, 3 })
  {
    coronary::SetNumberOfThreads(threads);
    vtkNew<vtkCoronaryTreeTopology> filter;
    filter->SetInputData(truth);
    filter->Update();
    if (threads == 1)
    {
      first->DeepCopy(filter->GetOutput());
      continue;
    }
    for (const char* name : { "Curvature", "Torsion", "SegmentIds" })
    {
      auto* a = first->GetPointData()->GetArray(name);
      auto* b = filter->GetOutput()->GetPointData()->GetArray(name);
      for (vtkIdType i = 0; i < a->GetNumberOfTuples(); ++i)
      {
        ASSERT_EQ(a->GetComponent(i, 0), b->GetComponent(i, 0)) << name;
      }
    }
  }
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(truth->GetNumberOfPoints(), copy->GetNumberOfPoints());
  EXPECT_EQ(truth->GetPointData()->GetNumberOfArrays(), copy->GetPointData()->GetNumberOfArrays());
  for (vtkIdType i = 0; i < copy->GetNumberOfPoints(); ++i)
  {
    double p[3];
    double q[3];
    truth->GetPoint(i, p);
    copy->GetPoint(i, q);
    ASSERT_EQ(p[0], q[0]);
  }
}

TEST(CoronaryTreeTopology, ReportsProgressAndStops)
{
  const auto truth = PhantomTree(46, 0);
  for (const double stopAt : { 2.0, 0.1, 0.5, 0.9 })
  {
    vtkNew<vtkCoronaryTreeTopology> filter;
    filter->SetInputData(truth);
    struct Watch
    {
      double last = 0.0;
      double stopAt = 0.0;
      int reports = 0;
    } watch;
    watch.stopAt = stopAt;
    vtkNew<vtkCallbackCommand> observer;
    observer->SetClientData(&watch);
    observer->SetCallback(
      [](vtkObject* caller, unsigned long, void* data, void*)
      {
        auto* algorithm = vtkAlgorithm::SafeDownCast(caller);
        auto& seen = *static_cast<Watch*>(data);
        EXPECT_GE(algorithm->GetProgress(), seen.last - 1e-9);
        seen.last = algorithm->GetProgress();
        ++seen.reports;
        if (seen.last >= seen.stopAt)
        {
          algorithm->SetAbortExecute(1);
        }
      });
    filter->AddObserver(vtkCommand::ProgressEvent, observer);
    filter->Update();
    if (stopAt > 1.0)
    {
      EXPECT_GT(watch.reports, 30);
      EXPECT_GT(filter->GetOutput()->GetNumberOfLines(), 10);
      continue;
    }
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
    watch.stopAt = 2.0;
    watch.last = 0.0;
    filter->SetAbortExecute(0);
    filter->Update();
    EXPECT_GT(filter->GetOutput()->GetNumberOfLines(), 10);
  }
}

TEST(CoronaryTreeTopology, BadInputIsNamed)
{
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputData(MakeFork("Width"));
  ExpectRefusal(filter, "MaximumInscribedSphereRadius or Radius");
  filter->SetInputRadiusArrayName("Calibre");
  ExpectRefusal(filter, "no point array Calibre");
  const auto negative = MakeFork("Calibre");
  negative->GetPointData()->GetArray("Calibre")->SetComponent(7, 0, -1.0);
  filter->SetInputData(negative);
  ExpectRefusal(filter, "radius of point 7");
  const auto infinite = MakeFork("Calibre");
  infinite->GetPoints()->SetPoint(9, 0.0, 0.0, std::numeric_limits<double>::infinity());
  filter->SetInputData(infinite);
  ExpectRefusal(filter, "Point 9");
  filter->SetInputData(MakeFork("Calibre"));
  filter->SetGapRatio(-1.0);
  ExpectRefusal(filter, "gap ratio");
  filter->SetGapRatio(2.0);
  filter->SetMurrayExponent(0.0);
  ExpectRefusal(filter, "Murray");
  filter->SetMurrayExponent(3.0);
  filter->SetDominance(5);
  ExpectRefusal(filter, "dominance");
  filter->SetDominance(-1);
  filter->SetSmoothingWavelength(2000.0);
  ExpectRefusal(filter, "smoothing wavelength");
  filter->SetSmoothingWavelength(5.0);
  filter->LabelSegmentsOff();
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetNumberOfLines(), 3);
}

TEST(CoronaryTreeTopology, SplitsVmtksAortaLines)
{
  // Real lines in VMTK's form: two, from one source, on top of each other up to the bifurcation.
  const std::string file =
    std::string(DYNAMICCORONARY_DATA_DIR) + "/vmtk-aorta/aorta-centerline.vtp";
  std::FILE* exists = std::fopen(file.c_str(), "rb");
  if (exists == nullptr)
  {
    GTEST_SKIP() << "no " << file;
  }
  std::fclose(exists);
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(file.c_str());
  vtkNew<vtkCoronaryTreeTopology> filter;
  filter->SetInputConnection(reader->GetOutputPort());
  filter->LabelSegmentsOff();
  filter->Update();
  vtkPolyData* tree = filter->GetOutput();
  EXPECT_EQ(tree->GetNumberOfLines(), 3);
  EXPECT_EQ(filter->GetLoops()->GetNumberOfLines(), 0);
  ASSERT_EQ(filter->GetBifurcations()->GetNumberOfPoints(), 1);
  const double angle =
    PointArray<vtkDoubleArray>(filter->GetBifurcations(), "BifurcationAngle")->GetValue(0);
  EXPECT_GT(angle, 20.0 * Pi / 180.0);
  EXPECT_LT(angle, 80.0 * Pi / 180.0);
  auto* curvature = PointArray<vtkDoubleArray>(tree, "Curvature");
  // Radii are 3 to 8 mm: the vessel's bends are no tighter.
  EXPECT_LT(curvature->GetRange()[1], 0.35);
}

TEST(CoronaryTreeTopology, PrintsItself)
{
  vtkNew<vtkCoronaryTreeTopology> filter;
  std::ostringstream text;
  filter->Print(text);
  EXPECT_NE(text.str().find("PruneRatio: 3"), std::string::npos);
  EXPECT_NE(text.str().find("InputRadiusArrayName: Automatic"), std::string::npos);
}
}
