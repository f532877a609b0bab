// vtkSkeletonPose through the VTK pipeline: edits, the chosen joint, arrays, pieces, refusals.

#include "vtkSkeletonPose.h"

#include "FilterMessages.h"
#include "ProgressChecks.h"
#include "SkeletonTestData.h"

#include "vtkDataArray.h"
#include "vtkObjectFactory.h"

#include <gtest/gtest.h>

#include <limits>

namespace TestSkeletonPose
{
namespace
{
void ExpectPoint(vtkPolyData* data, vtkIdType n, double x, double y, double z)
{
  const double* point = data->GetPoint(n);
  EXPECT_NEAR(point[0], x, 1e-12) << n;
  EXPECT_NEAR(point[1], y, 1e-12) << n;
  EXPECT_NEAR(point[2], z, 1e-12) << n;
}
}

TEST(SkeletonPose, RestAndItsArrays)
{
  const auto rest = ChainSkeleton(4);
  vtkNew<vtkSkeletonPose> filter;
  filter->SetInputData(rest);
  filter->Update();
  vtkPolyData* output = filter->GetOutput();
  ASSERT_EQ(output->GetNumberOfPoints(), 5);
  ExpectPoint(output, 4, 0, 0, 20);
  // Cells and other arrays are the input's own.
  EXPECT_EQ(output->GetLines(), rest->GetLines());
  EXPECT_EQ(output->GetCellData()->GetArray("BoneId"), rest->GetCellData()->GetArray("BoneId"));
  EXPECT_NE(output->GetPoints(), rest->GetPoints());
  EXPECT_EQ(rest->GetCellData()->GetNumberOfArrays(), 1);
  vtkDataArray* rotation = output->GetCellData()->GetArray("BoneRotation");
  ASSERT_NE(rotation, nullptr);
  EXPECT_EQ(rotation->GetNumberOfComponents(), 4);
  EXPECT_NEAR(rotation->GetComponent(3, 0), 1.0, 1e-15);
  ASSERT_NE(output->GetCellData()->GetArray("AxialStrain"), nullptr);
  EXPECT_NEAR(output->GetCellData()->GetArray("AxialStrain")->GetComponent(2, 0), 0.0, 1e-15);
  ASSERT_NE(output->GetPointData()->GetArray("CalibreFactor"), nullptr);
}

TEST(SkeletonPose, EditsAreDoneInTheirOrder)
{
  vtkNew<vtkSkeletonPose> filter;
  filter->SetInputData(ChainSkeleton(4));
  filter->AddEdit(2, 0, 0, 90, 0, 0, 0, 0, 1, 0);
  filter->AddEdit(3, 0, 0, 0, 0, 0, 7, 0, 0.5, 0);
  filter->AddEdit(4, 45, 0, 0, 0, 5, 0, 0, 1, 0);
  EXPECT_EQ(filter->GetNumberOfEdits(), 3);
  filter->Update();
  vtkPolyData* output = filter->GetOutput();
  ExpectPoint(output, 1, 0, 0, 5);
  ExpectPoint(output, 2, 0, 0, 10);
  ExpectPoint(output, 3, 5, 7, 10);
  ExpectPoint(output, 4, 15, 7, 10);
  EXPECT_EQ(output->GetPointData()->GetArray("CalibreFactor")->GetComponent(3, 0), 0.5);
  EXPECT_NEAR(output->GetCellData()->GetArray("AxialStrain")->GetComponent(3, 0), 1.0, 1e-12);
  EXPECT_NEAR(
    output->GetCellData()->GetArray("BoneTwist")->GetComponent(3, 0), 3.14159265358979 / 4, 1e-12);
  const double half = std::sqrt(0.5);
  EXPECT_NEAR(output->GetCellData()->GetArray("BoneRotation")->GetComponent(3, 0), half, 1e-12);
  EXPECT_NEAR(output->GetCellData()->GetArray("BoneRotation")->GetComponent(3, 2), half, 1e-12);
  filter->RemoveAllEdits();
  filter->Update();
  ExpectPoint(filter->GetOutput(), 4, 0, 0, 20);
}

TEST(SkeletonPose, TheChosenJointGoesWhereItIsPut)
{
  vtkNew<vtkSkeletonPose> filter;
  filter->SetInputData(ChainSkeleton(4));
  filter->SetJoint(2);
  filter->SetJointPosition(5, 0, 5);
  filter->Update();
  ExpectPoint(filter->GetOutput(), 2, 0, 0, 10); // not before MoveJoint
  filter->MoveJointOn();
  filter->Update();
  ExpectPoint(filter->GetOutput(), 2, 5, 0, 5);
  ExpectPoint(filter->GetOutput(), 4, 5, 0, 15);
  filter->SetMoveMode(vtkSkeletonPose::MoveAlone);
  filter->Update();
  ExpectPoint(filter->GetOutput(), 2, 5, 0, 5);
  ExpectPoint(filter->GetOutput(), 4, 0, 0, 20);
  filter->SetMoveMode(vtkSkeletonPose::TurnBone);
  filter->Update();
  ExpectPoint(filter->GetOutput(), 1, 0, 0, 5);
  ExpectPoint(filter->GetOutput(), 2, 5, 0, 5);
  ExpectPoint(filter->GetOutput(), 4, 15, 0, 5);
  // Towards the place, and no further.
  filter->SetMoveMode(vtkSkeletonPose::TurnBoneOnly);
  filter->SetJointPosition(30, 0, 5);
  filter->Update();
  ExpectPoint(filter->GetOutput(), 2, 5, 0, 5);
  ExpectPoint(filter->GetOutput(), 4, 15, 0, 5);
  // A root has no bone that could turn.
  filter->SetJoint(0);
  filter->SetJointPosition(0, 1, 0);
  filter->Update();
  ExpectPoint(filter->GetOutput(), 4, 0, 1, 20);
}

TEST(SkeletonPose, TheChosenJointTurnsWhatIsBeyond)
{
  vtkNew<vtkSkeletonPose> filter;
  filter->SetInputData(ChainSkeleton(4));
  filter->SetJoint(2);
  filter->SetJointPosition(1, 0, 10);
  filter->SetJointRotation(0, 90, 0);
  filter->MoveJointOn();
  filter->Update();
  ExpectPoint(filter->GetOutput(), 1, 0, 0, 5);
  ExpectPoint(filter->GetOutput(), 2, 1, 0, 10);
  ExpectPoint(filter->GetOutput(), 4, 11, 0, 10);
  filter->SetMoveMode(vtkSkeletonPose::MoveAlone);
  filter->Update();
  ExpectPoint(filter->GetOutput(), 4, 0, 0, 20);
}

TEST(SkeletonPose, AMoveIsAnEditToo)
{
  vtkNew<vtkSkeletonPose> filter;
  filter->SetInputData(ChainSkeleton(6));
  filter->AddEdit(2, 0, 0, 40, 10, 0, 1, 0, 1, 0);
  filter->Update();
  EXPECT_EQ(filter->GetMoveAsEdit()->GetNumberOfValues(), 0);
  vtkNew<vtkPoints> before;
  before->SetDataTypeToDouble();
  before->DeepCopy(filter->GetOutput()->GetPoints());
  for (const int mode :
    { vtkSkeletonPose::MoveBeyond, vtkSkeletonPose::TurnBone, vtkSkeletonPose::TurnBoneOnly })
  {
    filter->SetMoveMode(mode);
    filter->SetJoint(4);
    filter->SetJointPosition(3, 4, 12);
    filter->SetJointRotation(20, -30, 50);
    filter->MoveJointOn();
    filter->Update();
    vtkNew<vtkPolyData> moved;
    moved->DeepCopy(filter->GetOutput());
    // Where the handle begins: not yet moved.
    ASSERT_EQ(filter->GetJointPlaces()->GetNumberOfValues(), 21);
    for (int n = 0; n < 21; ++n)
    {
      EXPECT_EQ(filter->GetJointPlaces()->GetValue(n), before->GetPoint(n / 3)[n % 3]);
    }
    ASSERT_EQ(filter->GetMoveAsEdit()->GetNumberOfValues(), 10);
    std::array<double, 10> e{};
    std::copy_n(filter->GetMoveAsEdit()->GetPointer(0), 10, e.begin());
    filter->MoveJointOff();
    filter->AddEdit(e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7], e[8], e[9]);
    filter->Update();
    for (vtkIdType n = 0; n < 7; ++n)
    {
      const double* p = moved->GetPoint(n);
      ExpectPoint(filter->GetOutput(), n, p[0], p[1], p[2]);
    }
    for (vtkIdType b = 0; b < 6; ++b)
    {
      for (int c = 0; c < 4; ++c)
      {
        EXPECT_NEAR(
          filter->GetOutput()->GetCellData()->GetArray("BoneRotation")->GetComponent(b, c),
          moved->GetCellData()->GetArray("BoneRotation")->GetComponent(b, c), 1e-12);
      }
    }
    filter->RemoveAllEdits();
    filter->AddEdit(2, 0, 0, 40, 10, 0, 1, 0, 1, 0);
  }
  filter->SetMoveMode(vtkSkeletonPose::MoveAlone);
  filter->MoveJointOn();
  filter->Update();
  EXPECT_EQ(filter->GetMoveAsEdit()->GetNumberOfValues(), 0);
}

TEST(SkeletonPose, BeginsAtAPoseInTime)
{
  vtkNew<BendingChain> motion;
  vtkNew<vtkSkeletonPose> filter;
  filter->SetInputData(ChainSkeleton(4));
  filter->SetStartConnection(motion->GetOutputPort());
  filter->AddEdit(0, 0, 0, 0, 0, 100, 0, 0, 1, 0);
  filter->UpdateInformation();
  vtkInformation* info = filter->GetOutputInformation(0);
  ASSERT_EQ(info->Length(vtkStreamingDemandDrivenPipeline::TIME_STEPS()), 11);
  filter->UpdateTimeStep(0.5);
  const std::array<double, 3> tip = BendingChain::Bent(20.0, 0.5);
  ExpectPoint(filter->GetOutput(), 4, 100 + tip[0], 0, tip[2]);
  EXPECT_NE(filter->GetOutput()->GetFieldData()->GetArray("CycleLength"), nullptr);
}

TEST(SkeletonPose, ReportsOftenAndStopsAtOnce)
{
  const auto posed = ChainSkeleton(400);
  vtkNew<vtkSkeletonPose> filter;
  filter->SetInputData(ChainSkeleton(400));
  EXPECT_LT(MaximumProgressStep(filter), 0.02);
  filter->SetInputData(1, posed);
  for (int n = 0; n < 300; ++n)
  {
    filter->AddEdit(n, 0, 0, 1, 0, 0, 0, 0, 1.1, 50);
  }
  EXPECT_LT(MaximumProgressStep(filter), 0.02);
  for (const double share : { 0.0, 0.005, 0.5, 0.99 })
  {
    Messages messages(filter);
    filter->Modified();
    EXPECT_LT(SecondsToAbort(filter, share), 0.5) << share;
    EXPECT_TRUE(messages.Errors.empty());
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0) << share;
    filter->Update();
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 401) << share;
  }
}

TEST(SkeletonPose, NothingAndOtherPieces)
{
  vtkNew<vtkSkeletonPose> filter;
  vtkNew<vtkPolyData> nothing;
  filter->SetInputData(nothing);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  filter->SetInputData(ChainSkeleton(2));
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  filter->UpdatePiece(0, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 3);
}

TEST(SkeletonPose, RefusesWithOneMessage)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  vtkNew<vtkSkeletonPose> filter;
  filter->SetInputData(ChainSkeleton(3));
  const auto refuse = [&](const std::string& part, const auto& edit)
  {
    filter->RemoveAllEdits();
    filter->AddEdit(1, 0, 0, 0, 0, 0, 0, 0, 1, 0);
    edit();
    ExpectFilterError(filter, part);
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  };
  refuse("Edit 1 of Edits", [&] { filter->AddEdit(4, 0, 0, 0, 0, 0, 0, 0, 1, 0); });
  refuse("joints 0 to 3", [&] { filter->AddEdit(nan, 0, 0, 0, 0, 0, 0, 0, 1, 0); });
  refuse("rotation", [&] { filter->AddEdit(1, 0, nan, 0, 0, 0, 0, 0, 1, 0); });
  refuse("calibre", [&] { filter->AddEdit(1, 0, 0, 0, 0, 0, 0, 0, -1, 0); });
  refuse("no length", [&] { filter->AddEdit(1, 0, 0, 0, 0, 0, 0, -5, 1, 0); });
  filter->RemoveAllEdits();
  filter->MoveJointOn();
  filter->SetJoint(9);
  ExpectFilterError(filter, "Joint must be 0 to 3");
  filter->SetJoint(2);
  filter->SetJointPosition(nan, 0, 0);
  ExpectFilterError(filter, "JointPosition");
  filter->MoveJointOff();
  const auto line = ChainSkeleton(3);
  vtkNew<vtkCellArray> lines;
  const vtkIdType ids[3] = { 0, 1, 2 };
  lines->InsertNextCell(3, ids);
  line->SetLines(lines);
  filter->SetInputData(line);
  ExpectFilterError(filter, "Line 0 of the skeleton has 3 points");
  filter->SetInputData(ChainSkeleton(3));
  filter->SetInputData(1, ChainSkeleton(2));
  ExpectFilterError(filter, "3 joints and 2 bones");
  filter->SetInputData(1, ChainSkeleton(3));
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 4);
}
}
