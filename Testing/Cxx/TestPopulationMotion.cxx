// vtkPopulationMotion through the VTK pipeline: moments, arrays, skeleton, tracked phases, refusals.
#include "vtkPopulationMotion.h"

#include "FilterMessages.h"
#include "TimedTestSource.h"
#include "vtkCardiacPhaseInterpolator.h"

#include "CoronaryPhantom.h"
#include "SegmentAtlas.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

namespace TestPopulationMotion
{
using SDDP = vtkStreamingDemandDrivenPipeline;
using Filter = vtkPopulationMotion;

namespace
{
void SetField(vtkPolyData* data, const char* name, double value)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->InsertNextValue(value);
  data->GetFieldData()->AddArray(array);
}

/// The mean heart's tree with its names and frame, as the topology filter gives it.
vtkSmartPointer<vtkPolyData> NamedTree(double time = 0.75)
{
  coronary::PhantomSettings settings;
  settings.seed = 0;
  settings.centerlineSpacing = 3.0;
  const coronary::PhantomTree tree = coronary::CoronaryPhantom(settings).Tree(time);
  const auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkCoronary::SetTree(data, tree, vtkCoronary::BranchArrays::Named);
  const coronary::SegmentAtlas& atlas = coronary::SegmentAtlas::Get();
  const coronary::Vector3 shift = -(atlas.axes * atlas.origin);
  vtkNew<vtkDoubleArray> frame;
  frame->SetName("HeartFrame");
  frame->SetNumberOfComponents(16);
  double matrix[16] = { 0.0 };
  for (int row = 0; row < 3; ++row)
  {
    for (int column = 0; column < 3; ++column)
    {
      matrix[4 * row + column] = atlas.axes(row, column);
    }
    matrix[4 * row + 3] = shift[row];
  }
  matrix[15] = 1.0;
  frame->InsertNextTuple(matrix);
  data->GetFieldData()->AddArray(frame);
  SetField(data, "PhaseTime", 0.75);
  SetField(data, "CycleLength", 0.8);
  return data;
}

/// The same tree at two phases, as a tracker gives it.
class TrackedTree : public TimedTestSource
{
public:
  static TrackedTree* New();
  vtkTypeMacro(TrackedTree, TimedTestSource);

protected:
  TrackedTree() { this->Steps = { 0.4, 0.75 }; }

  bool Make(double time, vtkDataObject* data) override
  {
    data->ShallowCopy(NamedTree(time));
    return true;
  }
};
vtkStandardNewMacro(TrackedTree);

std::string Source(Filter* filter)
{
  auto* array = vtkStringArray::SafeDownCast(
    filter->GetOutput()->GetFieldData()->GetAbstractArray("MotionSource"));
  return array ? std::string(array->GetValue(0)) : std::string();
}
}

TEST(PopulationMotion, MovesTreeAndSkeleton)
{
  const auto tree = NamedTree();
  vtkNew<vtkPolyData> skeleton;
  vtkNew<vtkPoints> joints;
  joints->SetDataTypeToDouble();
  vtkNew<vtkCellArray> bones;
  for (vtkIdType n = 0; n < 3; ++n)
  {
    joints->InsertNextPoint(tree->GetPoint(10 * n));
    const vtkIdType bone[2] = { n - 1, n };
    if (n > 0)
    {
      bones->InsertNextCell(2, bone);
    }
  }
  skeleton->SetPoints(joints);
  skeleton->SetLines(bones);
  vtkNew<Filter> filter;
  filter->SetInputData(0, tree);
  filter->SetInputData(1, skeleton);
  filter->UpdateTimeStep(0.75);
  ASSERT_EQ(filter->GetOutput()->GetNumberOfPoints(), tree->GetNumberOfPoints());
  for (vtkIdType n = 0; n < tree->GetNumberOfPoints(); ++n)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      EXPECT_EQ(filter->GetOutput()->GetPoint(n)[axis], tree->GetPoint(n)[axis]);
    }
  }
  EXPECT_GT(
    filter->GetOutput()->GetPointData()->GetArray("PlacementConfidence")->GetRange()[0], 0.5);
  filter->UpdateTimeStep(0.35);
  vtkPolyData* moved = filter->GetOutput();
  vtkPolyData* posed = vtkPolyData::SafeDownCast(filter->GetOutputDataObject(1));
  vtkDataArray* displacement = moved->GetPointData()->GetArray("Displacement");
  vtkDataArray* deviation = moved->GetPointData()->GetArray("MotionDeviation");
  ASSERT_TRUE(displacement && deviation);
  EXPECT_GT(displacement->GetMaxNorm(), 10.0);
  EXPECT_GT(deviation->GetRange()[0], 0.0);
  EXPECT_LT(deviation->GetRange()[1], 15.0);
  EXPECT_LE(moved->GetPointData()->GetArray("TrackingConfidence")->GetRange()[1], 0.5);
  // Millimetres off, and it says so.
  EXPECT_LT(moved->GetPointData()->GetArray("PlacementConfidence")->GetRange()[1], 0.5);
  EXPECT_EQ(moved->GetPointData()->GetArray("TrackingStatus")->GetRange()[0], 3.0);
  ASSERT_EQ(posed->GetNumberOfPoints(), 3);
  for (vtkIdType n = 0; n < 3; ++n)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      EXPECT_NEAR(posed->GetPoint(n)[axis], moved->GetPoint(10 * n)[axis], 1e-6);
    }
  }
  EXPECT_NE(Source(filter).find("motion not of this patient"), std::string::npos);
  EXPECT_NE(Source(filter).find("75 beats"), std::string::npos);
  EXPECT_EQ(moved->GetFieldData()->GetArray("MotionPhases")->GetVariantValue(0).ToInt(), 1);
  EXPECT_NEAR(
    moved->GetFieldData()->GetArray("CycleLength")->GetVariantValue(0).ToDouble(), 0.8, 1e-12);
  EXPECT_EQ(moved->GetFieldData()->GetArray("PopulationValues")->GetNumberOfValues(), 14);
  EXPECT_EQ(filter->GetNumberOfMotions(), 1);
  // The input is as it was.
  EXPECT_EQ(tree->GetPointData()->GetArray("Displacement"), nullptr);
  filter->SetAmplitude(0.0);
  filter->UpdateTimeStep(0.35);
  EXPECT_LT(filter->GetOutput()->GetPointData()->GetArray("Displacement")->GetMaxNorm(), 1e-9);
  EXPECT_EQ(filter->GetNumberOfMotions(), 2);
}

TEST(PopulationMotion, FeedsTheInterpolator)
{
  vtkNew<Filter> filter;
  filter->SetInputData(0, NamedTree());
  vtkNew<vtkCardiacPhaseInterpolator> moment;
  moment->SetInputConnection(filter->GetOutputPort());
  moment->UpdateTimeStep(0.75);
  vtkPolyData* moved = vtkPolyData::SafeDownCast(moment->GetOutputDataObject(0));
  const auto tree = NamedTree();
  for (vtkIdType n = 0; n < tree->GetNumberOfPoints(); ++n)
  {
    EXPECT_NEAR(moved->GetPoint(n)[0], tree->GetPoint(n)[0], 1e-9);
  }
  moment->UpdateTimeStep(0.333);
  moved = vtkPolyData::SafeDownCast(moment->GetOutputDataObject(0));
  EXPECT_NE(moved->GetFieldData()->GetAbstractArray("MotionSource"), nullptr);
  EXPECT_EQ(filter->GetNumberOfMotions(), 1);
}

TEST(PopulationMotion, MeetsTrackedPhases)
{
  vtkNew<TrackedTree> tracked;
  vtkNew<Filter> filter;
  filter->SetInputData(0, NamedTree());
  filter->SetTrackedConnection(tracked->GetOutputPort());
  filter->UpdateTimeStep(0.4);
  const auto truth = NamedTree(0.4);
  for (vtkIdType n = 0; n < truth->GetNumberOfPoints(); ++n)
  {
    EXPECT_EQ(filter->GetOutput()->GetPoint(n)[1], truth->GetPoint(n)[1]);
  }
  EXPECT_EQ(
    filter->GetOutput()->GetFieldData()->GetArray("MotionPhases")->GetVariantValue(0).ToInt(), 2);
  EXPECT_NE(Source(filter).find("bent to 2 phases"), std::string::npos);
  EXPECT_EQ(
    filter->GetOutput()->GetFieldData()->GetArray("PopulationMisfit")->GetNumberOfValues(), 2);
}

TEST(PopulationMotion, TakesEmptyInput)
{
  vtkNew<vtkPolyData> empty;
  vtkNew<Filter> filter;
  filter->SetInputData(0, empty);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
}

TEST(PopulationMotion, RefusesWhatItCannotUse)
{
  const auto refused = [](const std::string& words, vtkPolyData* data, const auto& change)
  {
    vtkNew<Filter> filter;
    filter->SetInputData(0, data);
    change(filter.Get());
    ExpectFilterError(filter, words);
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  };
  const auto nothing = [](Filter*) {};
  auto tree = NamedTree();
  tree->GetFieldData()->RemoveArray("HeartFrame");
  refused("HeartFrame", tree, nothing);
  tree = NamedTree();
  tree->GetFieldData()->RemoveArray("PhaseTime");
  refused("PhaseTime", tree, nothing);
  refused("ReferenceTime", tree,
    [](Filter* filter)
    {
      filter->AutomaticReferenceOff();
      filter->SetReferenceTime(std::nan(""));
    });
  tree = NamedTree();
  tree->GetCellData()->RemoveArray("GroupIds");
  refused("GroupIds", tree, nothing);
  refused("HeartRate", NamedTree(), [](Filter* filter) { filter->SetHeartRate(300.0); });
  refused("Amplitude", NamedTree(), [](Filter* filter) { filter->SetAmplitude(5.0); });
}

TEST(PopulationMotion, PrintsItself)
{
  vtkNew<Filter> filter;
  std::ostringstream text;
  filter->Print(text);
  EXPECT_NE(text.str().find("Amplitude: 1"), std::string::npos);
}
}
