// vtkSkinDeformation through the VTK pipeline: data types, time, what is shared, refusals.

#include "vtkSkinDeformation.h"

#include "FilterMessages.h"
#include "ProgressChecks.h"
#include "SkeletonTestData.h"
#include "TetrahedronTestMeshes.h"

#include "vtkCardiacPhaseInterpolator.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkObjectFactory.h"
#include "vtkSkeletonPose.h"
#include "vtkStructuredGrid.h"
#include "vtkTrivialProducer.h"
#include "vtkUnstructuredGrid.h"

#include <gtest/gtest.h>

#include <limits>

namespace TestSkinDeformation
{
namespace
{
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkPointSet* Output(vtkSkinDeformation* filter)
{
  return vtkPointSet::SafeDownCast(filter->GetOutputDataObject(0));
}

vtkSmartPointer<vtkPolyData> Moved(int bones, const std::function<void(vtkIdType, double*)>& move)
{
  auto pose = ChainSkeleton(bones);
  for (vtkIdType j = 0; j <= bones; ++j)
  {
    double point[3];
    pose->GetPoint(j, point);
    move(j, point);
    pose->GetPoints()->SetPoint(j, point);
  }
  return pose;
}

vtkSmartPointer<vtkUnstructuredGrid> Bar(int half)
{
  const coronary::SkinWeightInput bar = coronary::MeshOfCells(
    { -half, -4, 0 }, { half, 4, 20 }, 0.5, [](const coronary::Vector3&) { return true; });
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const coronary::Vector3& point : bar.points)
  {
    points->InsertNextPoint(point.data());
  }
  grid->SetPoints(points);
  const vtkIdType vertex = 0;
  grid->InsertNextCell(VTK_VERTEX, 1, &vertex); // ids of cells are not those of tetrahedra
  for (const auto& tetrahedron : bar.tetrahedra)
  {
    const vtkIdType ids[4] = { tetrahedron[0], tetrahedron[1], tetrahedron[2], tetrahedron[3] };
    grid->InsertNextCell(VTK_TETRA, 4, ids);
  }
  HangOnChain(grid, 2);
  return grid;
}

vtkSmartPointer<vtkPolyData> Folded(double angle)
{
  return Moved(2,
    [&](vtkIdType j, double* point)
    {
      if (j == 2)
      {
        point[0] = 5.0 * std::sin(angle);
        point[2] = 5.0 + 5.0 * std::cos(angle);
      }
    });
}
}

TEST(SkinDeformation, SharesWhatDoesNotChange)
{
  const auto tube = ChainTube(4, 1.0);
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputData(0, tube);
  filter->SetInputData(1, ChainSkeleton(4));
  filter->SetInputData(2, Moved(4, [](vtkIdType, double* p) { p[0] += 3.0; }));
  filter->Update();
  auto* output = vtkPolyData::SafeDownCast(Output(filter));
  ASSERT_NE(output, nullptr);
  EXPECT_EQ(output->GetPolys(), tube->GetPolys());
  EXPECT_EQ(output->GetPointData()->GetArray("Ring"), tube->GetPointData()->GetArray("Ring"));
  EXPECT_NE(output->GetPoints(), tube->GetPoints());
  EXPECT_EQ(output->GetPoints()->GetDataType(), VTK_FLOAT);
  EXPECT_EQ(output->GetPointData()->GetArray("Normals"), nullptr); // they would be wrong
  EXPECT_NE(tube->GetPointData()->GetNormals(), nullptr);
  EXPECT_EQ(tube->GetPointData()->GetNumberOfArrays(), 4);
  vtkDataArray* displacement = output->GetPointData()->GetArray("Displacement");
  ASSERT_NE(displacement, nullptr);
  EXPECT_EQ(output->GetPointData()->GetArray("Velocity"), nullptr);
  for (vtkIdType n = 0; n < output->GetNumberOfPoints(); ++n)
  {
    EXPECT_NEAR(displacement->GetComponent(n, 0), 3.0, 1e-5);
    EXPECT_NEAR(output->GetPoint(n)[0], tube->GetPoint(n)[0] + 3.0, 1e-5);
    EXPECT_NEAR(output->GetPoint(n)[2], tube->GetPoint(n)[2], 1e-5);
  }
  filter->DoublePrecisionOn();
  filter->Update();
  EXPECT_EQ(Output(filter)->GetPoints()->GetDataType(), VTK_DOUBLE);
  EXPECT_NEAR(Output(filter)->GetPoint(5)[0], tube->GetPoint(5)[0] + 3.0, 1e-12);
}

TEST(SkinDeformation, FollowsTheTimeOfThePoseWithOneSetup)
{
  vtkNew<BendingChain> motion;
  vtkNew<vtkSkinDeformation> filter;
  const auto tube = ChainTube(4, 1.0);
  filter->SetInputData(0, tube);
  filter->SetInputData(1, ChainSkeleton(4));
  filter->SetPoseConnection(motion->GetOutputPort());
  filter->SetBlend(vtkSkinDeformation::DualQuaternion);
  filter->UpdateInformation();
  vtkInformation* info = filter->GetOutputInformation(0);
  ASSERT_EQ(info->Length(SDDP::TIME_STEPS()), 11);
  for (const double time : { 0.0, 0.3, 0.5, 0.3 })
  {
    filter->UpdateTimeStep(time);
    EXPECT_EQ(Output(filter)->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), time);
    // The axis follows the arc: of bones of 5 mm with the sagitta of a chord.
    for (int k = 0; k <= 40; ++k)
    {
      double middle[3] = { 0.0, 0.0, 0.0 };
      for (int n = 0; n < 16; ++n)
      {
        for (int c = 0; c < 3; ++c)
        {
          middle[c] += Output(filter)->GetPoint(16 * k + n)[c] / 16.0;
        }
      }
      const std::array<double, 3> wanted = BendingChain::Bent(0.5 * k, time);
      const double off = std::hypot(middle[0] - wanted[0], middle[2] - wanted[2]);
      EXPECT_LT(off, 0.05 + 0.1 * time * 25.0 / 8.0) << k;
    }
  }
  EXPECT_EQ(filter->GetNumberOfSetups(), 1);
  EXPECT_EQ(motion->Executions, 4);
  // Other weights, another setup.
  tube->GetPointData()->GetArray("BoneWeightsCompact")->Modified();
  tube->Modified();
  filter->UpdateTimeStep(0.3);
  EXPECT_EQ(filter->GetNumberOfSetups(), 2);
}

namespace
{
/// Mean velocity of the ring at the end of a tube of four bones, whose middle is that of the last joint.
std::array<double, 3> SpeedOfTip(vtkSkinDeformation* filter)
{
  std::array<double, 3> mean{};
  vtkDataArray* velocity = Output(filter)->GetPointData()->GetArray("Velocity");
  EXPECT_NE(velocity, nullptr);
  for (vtkIdType n = 40 * 16; velocity && n < 41 * 16; ++n)
  {
    for (int c = 0; c < 3; ++c)
    {
      mean[c] += velocity->GetComponent(n, c) / 16.0;
    }
  }
  return mean;
}
}

TEST(SkinDeformation, VelocityIsTheDerivativeInSeconds)
{
  // With and without steps, answering beyond the range and not; the cycle takes 0.8 s.
  for (const bool hasSteps : { true, false })
  {
    for (const bool ends : { true, false })
    {
      for (const double time : { 0.0, 0.4, 0.4567, 0.9995, 1.0 })
      {
        SCOPED_TRACE(std::to_string(time) + (ends ? ", ends" : ""));
        vtkNew<BendingChain> motion;
        motion->HasSteps = hasSteps;
        motion->Ends = ends;
        vtkNew<vtkSkinDeformation> filter;
        filter->SetInputData(0, ChainTube(4, 0.5));
        filter->SetInputData(1, ChainSkeleton(4));
        filter->SetPoseConnection(motion->GetOutputPort());
        filter->ComputeVelocityOn();
        filter->UpdateTimeStep(time);
        const std::array<double, 3> speed = SpeedOfTip(filter);
        const std::array<double, 3> truth = BendingChain::Speed(20.0, time);
        EXPECT_NEAR(speed[0], truth[0] / 0.8, 0.01);
        EXPECT_NEAR(speed[2], truth[2] / 0.8, 0.01);
        EXPECT_GT(std::abs(speed[0]), 5.0);
        // The mesh and the pose are those of the time that was asked for, and nothing is done again.
        vtkNew<vtkPoints> with;
        with->DeepCopy(Output(filter)->GetPoints());
        const int executions = motion->Executions;
        filter->UpdateTimeStep(time);
        filter->Update();
        EXPECT_EQ(motion->Executions, executions);
        EXPECT_EQ(
          motion->GetOutput()->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), time);
        filter->ComputeVelocityOff();
        filter->UpdateTimeStep(time);
        for (vtkIdType n = 0; n < with->GetNumberOfPoints(); n += 37)
        {
          EXPECT_EQ(with->GetPoint(n)[0], Output(filter)->GetPoint(n)[0]);
        }
      }
    }
  }
}

TEST(SkinDeformation, VelocityBetweenStepsWhereThereIsNothingElse)
{
  for (const bool honest : { true, false })
  {
    vtkNew<BendingChain> motion;
    motion->Snaps = true;
    motion->Ends = true;
    motion->CallsItByTheTimeAskedFor = !honest;
    vtkNew<vtkSkinDeformation> filter;
    filter->SetInputData(0, ChainTube(4, 0.5));
    filter->SetInputData(1, ChainSkeleton(4));
    filter->SetPoseConnection(motion->GetOutputPort());
    filter->ComputeVelocityOn();
    int most = 0;
    for (const int step : { 4, 0, 10, 7 })
    {
      SCOPED_TRACE(step);
      const int executions = motion->Executions;
      filter->UpdateTimeStep(0.1 * step);
      const double first = 0.1 * std::max(0, step - 1);
      const double last = 0.1 * std::min(10, step + 1);
      const std::array<double, 3> speed = SpeedOfTip(filter);
      for (const int c : { 0, 2 })
      {
        const double truth =
          (BendingChain::Bent(20.0, last)[c] - BendingChain::Bent(20.0, first)[c]) /
          ((last - first) * 0.8);
        EXPECT_NEAR(speed[c], truth, 0.01);
      }
      most = std::max(most, step == 4 ? 0 : motion->Executions - executions);
    }
    EXPECT_LE(most, 4); // here, before, after, here
  }
}

TEST(SkinDeformation, VelocityThroughTheCycleOfInterpolatedPhases)
{
  vtkNew<BendingChain> phases;
  phases->Snaps = true;
  phases->Ends = true;
  phases->Beats = true;
  vtkNew<vtkCardiacPhaseInterpolator> motion;
  motion->SetInputConnection(phases->GetOutputPort());
  motion->SetTimeRange(0.0, 1.0);
  // Through a pose by hand too, which has the time from its second port.
  vtkNew<vtkSkeletonPose> byHand;
  byHand->SetInputData(0, ChainSkeleton(4));
  byHand->SetInputConnection(1, motion->GetOutputPort());
  for (vtkAlgorithm* source :
    { static_cast<vtkAlgorithm*>(motion), static_cast<vtkAlgorithm*>(byHand) })
  {
    vtkNew<vtkSkinDeformation> filter;
    filter->SetInputData(0, ChainTube(4, 0.5));
    filter->SetInputData(1, ChainSkeleton(4));
    filter->SetPoseConnection(source->GetOutputPort());
    filter->ComputeVelocityOn();
    for (const double time : { 0.0, 0.0004, 0.25, 0.33, 0.5, 0.77, 0.9999, 1.0 })
    {
      SCOPED_TRACE(std::to_string(time) + " " + source->GetClassName());
      filter->UpdateTimeStep(time);
      const std::array<double, 3> speed = SpeedOfTip(filter);
      const std::array<double, 3> truth = BendingChain::Speed(20.0, time, true);
      // Greatest: 38 mm/s. Ten phases through a spline.
      EXPECT_NEAR(speed[0], truth[0] / 0.8, 0.6);
      EXPECT_NEAR(speed[2], truth[2] / 0.8, 0.6);
      // That of the interpolated joints themselves, in closed form, is met much closer.
      motion->UpdateTimeStep(time);
      vtkDataArray* joints = vtkPointSet::SafeDownCast(motion->GetOutputDataObject(0))
                               ->GetPointData()
                               ->GetArray("Velocity");
      ASSERT_NE(joints, nullptr);
      EXPECT_NEAR(speed[0], joints->GetComponent(4, 0), source == motion ? 1e-4 : 0.03);
      EXPECT_NEAR(speed[2], joints->GetComponent(4, 2), source == motion ? 1e-4 : 0.03);
    }
    EXPECT_EQ(filter->GetNumberOfSetups(), 1);
  }
  EXPECT_LE(phases->Executions, 13); // every phase once
}

TEST(SkinDeformation, VelocityThatThePoseTells)
{
  // Without time, in one execution of what is upstream.
  const auto pose = ChainSkeleton(2);
  const auto add = [](vtkFieldData* data, const char* name, int components, double value)
  {
    vtkNew<vtkDoubleArray> array;
    array->SetName(name);
    array->SetNumberOfComponents(components);
    array->SetNumberOfTuples(3);
    array->Fill(value);
    data->AddArray(array);
  };
  add(pose->GetPointData(), "Velocity", 3, 2.5);
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputData(0, ChainTube(2, 0.5));
  filter->SetInputData(1, ChainSkeleton(2));
  filter->SetInputData(2, pose);
  filter->ComputeVelocityOn();
  filter->Update();
  vtkDataArray* velocity = Output(filter)->GetPointData()->GetArray("Velocity");
  ASSERT_NE(velocity, nullptr);
  for (vtkIdType n = 0; n < velocity->GetNumberOfTuples(); ++n)
  {
    for (int c = 0; c < 3; ++c)
    {
      ASSERT_NEAR(velocity->GetComponent(n, c), 2.5, 1e-5);
    }
  }
  // The calibre's derivative is missing: what the pose tells is not all.
  add(pose->GetPointData(), "CalibreFactor", 1, 1.0);
  pose->Modified();
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.HasWarning("no velocity"));
  add(pose->GetPointData(), "CalibreRate", 1, 0.4);
  pose->Modified();
  filter->Update();
  velocity = Output(filter)->GetPointData()->GetArray("Velocity");
  ASSERT_NE(velocity, nullptr);
  // Outwards beside the axis, which goes on as it did.
  const double* at = Output(filter)->GetPoint(100);
  EXPECT_NEAR(velocity->GetComponent(100, 0), 2.5 + 0.4 * at[0], 1e-5);
  EXPECT_NEAR(velocity->GetComponent(100, 1), 2.5 + 0.4 * at[1], 1e-5);
  EXPECT_NEAR(velocity->GetComponent(100, 2), 2.5, 1e-5);
}

TEST(SkinDeformation, NoVelocityWithoutTime)
{
  // No time, no velocity, and a word about it.
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputData(0, ChainTube(2, 0.5));
  filter->SetInputData(1, ChainSkeleton(2));
  filter->SetInputData(2, ChainSkeleton(2));
  filter->ComputeVelocityOn();
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.HasWarning("no velocity"));
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(Output(filter)->GetPointData()->GetArray("Velocity"), nullptr);
}

TEST(SkinDeformation, NormalsOfTheMovedTriangles)
{
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputData(0, ChainTube(4, 1.0));
  filter->SetInputData(1, ChainSkeleton(4));
  // Turned by a quarter about x: z goes to -y.
  filter->SetInputData(2,
    Moved(4,
      [](vtkIdType, double* p)
      {
        p[1] = -p[2];
        p[2] = 0.0;
      }));
  filter->ComputeNormalsOn();
  filter->Update();
  vtkDataArray* normals = Output(filter)->GetPointData()->GetNormals();
  ASSERT_NE(normals, nullptr);
  for (vtkIdType n = 16; n < 40 * 16; ++n)
  {
    const double* at = Output(filter)->GetPoint(n);
    EXPECT_NEAR(normals->GetComponent(n, 0), at[0], 0.01);
    EXPECT_NEAR(normals->GetComponent(n, 1), 0.0, 0.01);
    EXPECT_NEAR(normals->GetComponent(n, 2), at[2], 0.01);
  }
}

TEST(SkinDeformation, VolumeIsConservedWhereWanted)
{
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputData(0, ChainTube(4, 1.0));
  filter->SetInputData(1, ChainSkeleton(4));
  filter->SetInputData(2, Moved(4, [](vtkIdType, double* p) { p[2] *= 1.44; }));
  filter->Update();
  EXPECT_NEAR(Output(filter)->GetPoint(0)[0], 1.0, 1e-5);
  filter->SetVolumeConservation(1.0);
  filter->Update();
  EXPECT_NEAR(Output(filter)->GetPoint(0)[0], 1.0 / 1.2, 1e-5);
  EXPECT_NEAR(Output(filter)->GetPoint(640)[2], 28.8, 1e-4);
}

TEST(SkinDeformation, TetrahedraAreCheckedAndRepaired)
{
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputData(0, Bar(3));
  filter->SetInputData(1, ChainSkeleton(2));
  filter->SetInputData(2, Folded(2.4));
  filter->SetTetrahedra(vtkSkinDeformation::CheckTetrahedra);
  {
    Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.HasWarning("inverted"));
  }
  vtkDataArray* left = Output(filter)->GetFieldData()->GetArray("InvertedTetrahedra");
  ASSERT_NE(left, nullptr);
  ASSERT_GT(left->GetNumberOfTuples(), 0);
  vtkDataArray* ratio = Output(filter)->GetCellData()->GetArray("VolumeRatio");
  ASSERT_NE(ratio, nullptr);
  EXPECT_TRUE(std::isnan(ratio->GetComponent(0, 0)));
  for (vtkIdType n = 0; n < left->GetNumberOfTuples(); ++n)
  {
    EXPECT_LE(ratio->GetComponent(static_cast<vtkIdType>(left->GetComponent(n, 0)), 0), 0.0);
  }
  const vtkIdType found = left->GetNumberOfTuples();
  filter->SetTetrahedra(vtkSkinDeformation::RepairTetrahedra);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Warnings.empty());
  vtkFieldData* fields = Output(filter)->GetFieldData();
  EXPECT_EQ(fields->GetArray("InvertedTetrahedra")->GetNumberOfTuples(), 0);
  EXPECT_EQ(fields->GetArray("RepairedTetrahedra")->GetComponent(0, 0), found);
  filter->SetTetrahedra(vtkSkinDeformation::IgnoreTetrahedra);
  filter->Update();
  EXPECT_EQ(Output(filter)->GetCellData()->GetArray("VolumeRatio"), nullptr);
}

TEST(SkinDeformation, TetrahedraThatCanNotBeRepairedAreTold)
{
  // Folded flat: both halves want the same place.
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputData(0, Bar(4));
  filter->SetInputData(1, ChainSkeleton(2));
  filter->SetInputData(2, Folded(3.14));
  filter->SetTetrahedra(vtkSkinDeformation::CheckTetrahedra);
  filter->Update();
  const auto inverted = [&]
  {
    vtkFieldData* fields = Output(filter)->GetFieldData();
    vtkDataArray* left = fields->GetArray("InvertedTetrahedra");
    vtkDataArray* ratio = Output(filter)->GetCellData()->GetArray("VolumeRatio");
    std::vector<vtkIdType> listed;
    std::vector<vtkIdType> found;
    for (vtkIdType n = 0; n < left->GetNumberOfTuples(); ++n)
    {
      listed.push_back(static_cast<vtkIdType>(left->GetComponent(n, 0)));
    }
    for (vtkIdType cell = 0; cell < ratio->GetNumberOfTuples(); ++cell)
    {
      if (ratio->GetComponent(cell, 0) <= 0.0)
      {
        found.push_back(cell);
      }
    }
    EXPECT_EQ(listed, found);
    return listed.size();
  };
  const std::size_t before = inverted();
  filter->SetTetrahedra(vtkSkinDeformation::RepairTetrahedra);
  Messages messages(filter);
  filter->Update();
  const std::size_t after = inverted();
  ASSERT_GT(after, 0U);
  ASSERT_LT(after, before);
  EXPECT_TRUE(messages.Errors.empty());
  ASSERT_EQ(messages.Warnings.size(), 1U);
  EXPECT_TRUE(messages.HasWarning((std::to_string(after) +
    " tetrahedra are inverted after the repair, " + std::to_string(before) + " were before it")
                                    .c_str()))
    << messages.Warnings[0];
  EXPECT_EQ(Output(filter)->GetFieldData()->GetArray("RepairedTetrahedra")->GetComponent(0, 0),
    static_cast<double>(before - after));
}

TEST(SkinDeformation, AnyPointSetAndBlocks)
{
  vtkNew<vtkStructuredGrid> grid;
  grid->SetDimensions(2, 2, 21);
  vtkNew<vtkPoints> points;
  for (int k = 0; k < 21; ++k)
  {
    for (int n = 0; n < 4; ++n)
    {
      points->InsertNextPoint(n % 2, n / 2, k);
    }
  }
  grid->SetPoints(points);
  HangOnChain(grid, 4);
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(0, ChainTube(4, 1.0));
  blocks->SetBlock(1, grid);
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputDataObject(0, blocks);
  filter->SetInputData(1, ChainSkeleton(4));
  vtkNew<BendingChain> motion;
  filter->SetPoseConnection(motion->GetOutputPort());
  for (const double time : { 0.5, 0.2, 0.7 })
  {
    filter->UpdateTimeStep(time);
    auto* output = vtkMultiBlockDataSet::SafeDownCast(filter->GetOutputDataObject(0));
    ASSERT_NE(output, nullptr);
    ASSERT_NE(vtkPolyData::SafeDownCast(output->GetBlock(0)), nullptr);
    auto* moved = vtkStructuredGrid::SafeDownCast(output->GetBlock(1));
    ASSERT_NE(moved, nullptr);
    EXPECT_NEAR(moved->GetPoint(80)[0], BendingChain::Bent(20.0, time)[0], 0.2 + time);
  }
  // Both blocks are remembered.
  EXPECT_EQ(filter->GetNumberOfSetups(), 2);
}

TEST(SkinDeformation, ReportsOftenAndStopsAtOnce)
{
  // Large and small, surface and tetrahedra, with everything that may be computed.
  vtkNew<BendingChain> motion;
  motion->Bones = 400;
  vtkNew<vtkSkinDeformation> surface;
  surface->SetInputData(0, ChainTube(400, 1.0));
  surface->SetInputData(1, ChainSkeleton(400));
  surface->SetPoseConnection(motion->GetOutputPort());
  surface->ComputeVelocityOn();
  surface->ComputeNormalsOn();
  vtkNew<vtkSkinDeformation> grid;
  grid->SetInputData(0, Bar(3));
  grid->SetInputData(1, ChainSkeleton(2));
  grid->SetInputData(2, Folded(2.4));
  vtkNew<vtkMultiBlockDataSet> twoBlocks;
  twoBlocks->SetBlock(0, ChainTube(2, 1.0));
  twoBlocks->SetBlock(1, Bar(2));
  vtkNew<vtkSkinDeformation> blocks;
  blocks->SetInputDataObject(0, twoBlocks);
  blocks->SetInputData(1, ChainSkeleton(2));
  blocks->SetInputData(2, Folded(0.3));
  blocks->DoublePrecisionOn();
  for (const auto& filter : { surface.Get(), grid.Get(), blocks.Get() })
  {
    EXPECT_LT(MaximumProgressStep(filter), 0.02);
    filter->Modified(); // the mesh is remembered: other shares of the time
    EXPECT_LT(MaximumProgressStep(filter), 0.02);
    const vtkIdType points =
      filter->GetOutputDataObject(0)->GetNumberOfElements(vtkDataObject::POINT);
    EXPECT_GT(points, 100);
    for (const double share : { 0.0, 0.1, 0.35, 0.6, 0.8, 0.97 })
    {
      Messages messages(filter);
      filter->SetBlend(filter->GetBlend() == 0 ? 1 : 0); // the setup, too
      EXPECT_LT(SecondsToAbort(filter, share), 0.5) << share;
      EXPECT_TRUE(messages.Errors.empty());
      EXPECT_EQ(filter->GetOutputDataObject(0)->GetNumberOfElements(vtkDataObject::POINT), 0)
        << share;
      filter->Update();
      EXPECT_EQ(filter->GetOutputDataObject(0)->GetNumberOfElements(vtkDataObject::POINT), points)
        << share;
    }
  }
  // What was stopped half-way has left nothing behind.
  vtkNew<vtkSkinDeformation> fresh;
  fresh->SetInputData(0, Bar(3));
  fresh->SetInputData(1, ChainSkeleton(2));
  fresh->SetInputData(2, Folded(2.4));
  fresh->SetBlend(grid->GetBlend());
  fresh->Update();
  for (vtkIdType n = 0; n < Output(fresh)->GetNumberOfPoints(); ++n)
  {
    ASSERT_EQ(Output(fresh)->GetPoint(n)[0], Output(grid)->GetPoint(n)[0]) << n;
  }
}

TEST(SkinDeformation, EmptyMeshIsNoError)
{
  vtkNew<vtkPolyData> nothing;
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputData(0, nothing);
  filter->SetInputData(1, ChainSkeleton(2));
  filter->SetInputData(2, ChainSkeleton(2));
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 0);
}

TEST(SkinDeformation, RefusesWithOneMessage)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  vtkNew<vtkSkinDeformation> filter;
  const auto refuse = [&](const std::string& part, const auto& damage)
  {
    const auto tube = ChainTube(3, 1.0);
    const auto rest = ChainSkeleton(3);
    const auto pose = ChainSkeleton(3);
    damage(tube, rest, pose);
    filter->SetInputData(0, tube);
    filter->SetInputData(1, rest);
    filter->SetInputData(2, pose);
    ExpectFilterError(filter, part);
    EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 0);
  };
  using Data = vtkSmartPointer<vtkPolyData>;
  refuse("no point array 'BoneIndices'",
    [](const Data& mesh, const Data&, const Data&)
    { mesh->GetPointData()->RemoveArray("BoneIndices"); });
  refuse("has 1 components",
    [](const Data& mesh, const Data&, const Data&)
    {
      vtkNew<vtkIntArray> other;
      other->SetName("BoneIndices");
      other->SetNumberOfValues(mesh->GetNumberOfPoints());
      other->Fill(0);
      mesh->GetPointData()->AddArray(other);
    });
  refuse("hangs on bone 3",
    [](const Data& mesh, const Data&, const Data&)
    { mesh->GetPointData()->GetArray("BoneIndices")->SetComponent(7, 0, 3); });
  refuse("Point 7 has a skin weight that is not finite",
    [&](const Data& mesh, const Data&, const Data&)
    { mesh->GetPointData()->GetArray("BoneWeightsCompact")->SetComponent(7, 0, nan); });
  refuse("Point 7 has no skin weight",
    [](const Data& mesh, const Data&, const Data&)
    { mesh->GetPointData()->GetArray("BoneWeightsCompact")->SetTuple2(7, 0.0, 0.0); });
  refuse("skeleton at rest",
    [](const Data&, const Data& rest, const Data&)
    { rest->SetLines(vtkSmartPointer<vtkCellArray>::New()); });
  refuse("4 joints and 3 bones",
    [](const Data&, const Data& rest, const Data&) { rest->ShallowCopy(ChainSkeleton(4)); });
  refuse("Joint 1 of the pose",
    [&](const Data&, const Data&, const Data& pose)
    { pose->GetPoints()->SetPoint(1, nan, 0.0, 0.0); });
  refuse("Bone 0 of the pose",
    [](const Data&, const Data&, const Data& pose)
    { pose->GetPoints()->SetPoint(1, 0.0, 0.0, 0.0); });
  refuse("other joints than at rest",
    [](const Data&, const Data&, const Data& pose)
    {
      vtkNew<vtkCellArray> lines;
      for (const vtkIdType first : { 1, 0, 2 })
      {
        const vtkIdType ends[2] = { first, first + 1 };
        lines->InsertNextCell(2, ends);
      }
      pose->SetLines(lines);
    });
  refuse("'BoneRotation'",
    [](const Data&, const Data&, const Data& pose)
    {
      vtkNew<vtkDoubleArray> rotation;
      rotation->SetName("BoneRotation");
      rotation->SetNumberOfValues(3);
      rotation->Fill(1.0);
      pose->GetCellData()->AddArray(rotation);
    });
  const auto whole = [](const Data&, const Data&, const Data&) {};
  filter->SetVolumeConservation(2.0);
  refuse("VolumeConservation", whole);
  filter->SetVolumeConservation(0.0);
  filter->SetMinimumVolumeRatio(0.7);
  refuse("MinimumVolumeRatio", whole);
  filter->SetMinimumVolumeRatio(0.0);
  filter->Modified();
  filter->Update();
  EXPECT_GT(Output(filter)->GetNumberOfPoints(), 0);
}
}
