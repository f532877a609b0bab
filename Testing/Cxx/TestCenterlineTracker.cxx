// vtkCenterlineTracker through the VTK pipeline: the phantom's series, time keys, what is read and
// when, refusals.
#include "vtkCenterlineTracker.h"

#include "FilterMessages.h"
#include "ParallelFor.h"
#include "vtkCenterlineSkeleton.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkReferencePhase.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkTrivialProducer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

using SDDP = vtkStreamingDemandDrivenPipeline;
using Phantom = vtkCoronaryPhantomSource;

namespace
{
/// A phantom in coarse voxels with few phases, its true tree at the reference, and the tracker.
struct Scene
{
  vtkNew<Phantom> phantom;
  vtkNew<vtkReferencePhase> reference;
  vtkNew<vtkCenterlineTracker> tracker;
  int images = 0;

  explicit Scene(const std::vector<double>& phases = { 0.05, 0.25, 0.5, 0.75 })
  {
    this->phantom->ClearPhases();
    for (const double phase : phases)
    {
      this->phantom->AddPhase(phase);
    }
    this->phantom->SetSpacing(1.0, 1.0, 1.0);
    this->reference->SetInputConnection(this->phantom->GetOutputPort(Phantom::TreePort));
    this->reference->AutomaticOff();
    this->reference->SetTime(0.75);
    this->tracker->SetInputConnection(this->phantom->GetOutputPort(Phantom::ImagePort));
    this->tracker->SetLinesConnection(this->reference->GetOutputPort());
    this->tracker->SetNodeSpacing(5.0);
  }

  vtkPolyData* At(double time)
  {
    this->tracker->UpdateTimeStep(time);
    return this->tracker->GetOutput();
  }

  /// Mean distance of the points to where they truly are.
  double Error(double time)
  {
    vtkNew<vtkPolyData> found;
    found->DeepCopy(this->At(time));
    vtkNew<Phantom> truth;
    truth->ClearPhases();
    truth->AddPhase(time);
    truth->Update(Phantom::TreePort);
    auto* tree = vtkPolyData::SafeDownCast(truth->GetOutputDataObject(Phantom::TreePort));
    double sum = 0.0;
    for (vtkIdType n = 0; n < found->GetNumberOfPoints(); ++n)
    {
      double a[3];
      double b[3];
      found->GetPoint(n, a);
      tree->GetPoint(n, b);
      sum += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    }
    return sum / static_cast<double>(found->GetNumberOfPoints());
  }
};

std::vector<double> StepsOf(vtkAlgorithm* algorithm)
{
  algorithm->UpdateInformation();
  vtkInformation* info = algorithm->GetOutputInformation(0);
  if (!info->Has(SDDP::TIME_STEPS()))
  {
    return {};
  }
  const double* steps = info->Get(SDDP::TIME_STEPS());
  return { steps, steps + info->Length(SDDP::TIME_STEPS()) };
}
}

TEST(CenterlineTracker, FollowsThePhantomAndReadsItOnce)
{
  Scene scene;
  EXPECT_EQ(StepsOf(scene.tracker).size(), 4u);
  for (const double time : { 0.05, 0.25, 0.5, 0.75 })
  {
    // Voxels of 1 mm, a place every 5 mm, and the way along the vessels counts too.
    EXPECT_LT(scene.Error(time), 0.8) << time;
  }
  EXPECT_EQ(scene.tracker->GetNumberOfTrackings(), 1);

  vtkPolyData* output = scene.At(0.5);
  EXPECT_EQ(scene.tracker->GetNumberOfTrackings(), 1);
  vtkPolyData* input = vtkPolyData::SafeDownCast(scene.reference->GetOutputDataObject(0));
  ASSERT_EQ(output->GetNumberOfPoints(), input->GetNumberOfPoints());
  EXPECT_EQ(
    output->GetCellData()->GetArray("GroupIds"), input->GetCellData()->GetArray("GroupIds"));
  for (const char* name : { "TrackingConfidence", "TrackingStatus", "CalibreFactor" })
  {
    vtkDataArray* array = output->GetPointData()->GetArray(name);
    ASSERT_NE(array, nullptr) << name;
    EXPECT_EQ(array->GetNumberOfTuples(), output->GetNumberOfPoints());
  }
  vtkDataArray* way = output->GetPointData()->GetArray("Displacement");
  ASSERT_NE(way, nullptr);
  double from[3];
  double to[3];
  input->GetPoint(100, from);
  output->GetPoint(100, to);
  for (int axis = 0; axis < 3; ++axis)
  {
    EXPECT_NEAR(way->GetComponent(100, axis), to[axis] - from[axis], 1e-5);
  }
  ASSERT_NE(output->GetCellData()->GetArray("AxialStrain"), nullptr);
  EXPECT_DOUBLE_EQ(output->GetFieldData()->GetArray("PhaseTime")->GetTuple1(0), 0.5);
  EXPECT_DOUBLE_EQ(output->GetFieldData()->GetArray("ReferenceTime")->GetTuple1(0), 0.75);
  EXPECT_EQ(output->GetFieldData()->GetArray("TrackedShare")->GetNumberOfTuples(), 4);
  EXPECT_DOUBLE_EQ(output->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), 0.5);

  // A setting of its own makes another result.
  scene.tracker->SetTrackedPhases(vtkCenterlineTracker::EvenPhases);
  scene.At(0.5);
  EXPECT_EQ(scene.tracker->GetNumberOfTrackings(), 2);
}

TEST(CenterlineTracker, MovesTheSkeleton)
{
  Scene scene({ 0.35, 0.75 });
  vtkNew<vtkCenterlineSkeleton> skeleton;
  skeleton->SetInputConnection(scene.reference->GetOutputPort());
  scene.tracker->SetSkeletonConnection(skeleton->GetOutputPort());
  scene.tracker->UpdateTimeStep(0.35);
  auto* posed = vtkPolyData::SafeDownCast(scene.tracker->GetOutputDataObject(1));
  vtkPolyData* rest = skeleton->GetOutput();
  ASSERT_EQ(posed->GetNumberOfPoints(), rest->GetNumberOfPoints());
  ASSERT_EQ(posed->GetNumberOfLines(), rest->GetNumberOfLines());
  ASSERT_NE(posed->GetPointData()->GetArray("CalibreFactor"), nullptr);
  ASSERT_NE(posed->GetCellData()->GetArray("BoneId"), nullptr);
  // Joints are on the tracked tree.
  vtkPolyData* tree = scene.tracker->GetOutput();
  for (vtkIdType n = 0; n < posed->GetNumberOfPoints(); ++n)
  {
    double joint[3];
    posed->GetPoint(n, joint);
    double least = std::numeric_limits<double>::infinity();
    for (vtkIdType p = 0; p < tree->GetNumberOfPoints(); ++p)
    {
      double point[3];
      tree->GetPoint(p, point);
      least =
        std::min(least, std::hypot(point[0] - joint[0], point[1] - joint[1], point[2] - joint[2]));
    }
    EXPECT_LT(least, 0.5);
  }

  // The two outputs may be asked for different times.
  double before[3];
  posed->GetPoint(0, before);
  scene.At(0.75);
  vtkNew<vtkInformationVector> request;
  request->SetNumberOfInformationObjects(2);
  request->GetInformationObject(1)->Set(SDDP::UPDATE_TIME_STEP(), 0.75);
  scene.tracker->Update(1, request);
  double atRest[3];
  posed->GetPoint(0, atRest);
  EXPECT_GT(std::hypot(atRest[0] - before[0], atRest[1] - before[1], atRest[2] - before[2]), 3.0);
  request->GetInformationObject(1)->Set(SDDP::UPDATE_TIME_STEP(), 0.35);
  scene.tracker->Update(1, request);
  double again[3];
  posed->GetPoint(0, again);
  for (int axis = 0; axis < 3; ++axis)
  {
    EXPECT_DOUBLE_EQ(again[axis], before[axis]);
  }
  EXPECT_EQ(scene.tracker->GetNumberOfTrackings(), 1);
}

TEST(CenterlineTracker, TracksWhatIsChosen)
{
  Scene scene({ 0.05, 0.2, 0.35, 0.5, 0.62, 0.75, 0.9 });
  scene.tracker->SetTrackedPhases(vtkCenterlineTracker::EvenPhases);
  EXPECT_EQ(StepsOf(scene.tracker), (std::vector<double>{ 0.05, 0.35, 0.62, 0.9 }));
  scene.tracker->SetTrackedPhases(vtkCenterlineTracker::ListedPhases);
  scene.tracker->AddTrackedTime(0.74);
  scene.tracker->AddTrackedTime(0.21);
  scene.tracker->AddTrackedTime(0.19);
  EXPECT_EQ(StepsOf(scene.tracker), (std::vector<double>{ 0.2, 0.75 }));
  scene.tracker->RemoveAllTrackedTimes();
  ExpectError(scene.tracker, "TrackedTimes is empty");
}

TEST(CenterlineTracker, TakesLinesOfEveryPhase)
{
  Scene scene;
  scene.tracker->SetInputConnection(scene.phantom->GetOutputPort(Phantom::TreePort));
  for (const double time : { 0.25, 0.5 })
  {
    EXPECT_LT(scene.Error(time), 1.2) << time;
  }
}

TEST(CenterlineTracker, GivesTheSameOnAnyNumberOfThreads)
{
  std::vector<double> first;
  for (const int threads : { 1, 3 })
  {
    coronary::SetNumberOfThreads(threads);
    Scene scene({ 0.35, 0.75 });
    vtkPolyData* output = scene.At(0.35);
    std::vector<double> points;
    for (vtkIdType n = 0; n < output->GetNumberOfPoints(); ++n)
    {
      double point[3];
      output->GetPoint(n, point);
      points.insert(points.end(), point, point + 3);
    }
    if (first.empty())
    {
      first = points;
    }
    EXPECT_EQ(points, first);
  }
  coronary::SetNumberOfThreads(0);
}

TEST(CenterlineTracker, RefusesWhatIsWrong)
{
  {
    Scene scene({ 0.75 });
    ExpectError(scene.tracker, "one phase only");
  }
  {
    Scene scene({ 0.35, 0.75 });
    vtkNew<vtkReferencePhase> image;
    image->SetInputConnection(scene.phantom->GetOutputPort(Phantom::ImagePort));
    scene.tracker->SetInputConnection(image->GetOutputPort());
    ExpectError(scene.tracker, "no time steps");
  }
  {
    Scene scene({ 0.35, 0.75 });
    scene.tracker->AutomaticReferenceOff();
    scene.tracker->SetReferenceTime(0.6);
    ExpectError(scene.tracker, "none of the time steps");
    scene.tracker->SetReferenceTime(std::numeric_limits<double>::quiet_NaN());
    ExpectError(scene.tracker, "ReferenceTime must be finite");
  }
  {
    Scene scene({ 0.35, 0.75 });
    scene.tracker->SetNodeSpacing(0.1);
    ExpectError(scene.tracker, "NodeSpacing");
    scene.tracker->SetNodeSpacing(2.0);
    scene.tracker->SetImageArrayName("Density");
    ExpectError(scene.tracker, "no point array 'Density'");
  }
  {
    Scene scene({ 0.35, 0.75 });
    scene.reference->Update();
    vtkNew<vtkPolyData> lines;
    lines->DeepCopy(scene.reference->GetOutputDataObject(0));
    for (vtkIdType n = 0; n < lines->GetNumberOfPoints(); ++n)
    {
      double point[3];
      lines->GetPoint(n, point);
      point[0] += 400.0;
      lines->GetPoints()->SetPoint(n, point);
    }
    vtkNew<vtkTrivialProducer> producer;
    producer->SetOutput(lines);
    scene.tracker->SetLinesConnection(producer->GetOutputPort());
    ExpectError(scene.tracker, "outside of the image");
    lines->GetFieldData()->RemoveArray("PhaseTime");
    lines->Modified();
    producer->Modified();
    ExpectError(scene.tracker, "no field array PhaseTime");
  }
}

TEST(CenterlineTracker, TakesLinesWithoutPoints)
{
  Scene scene({ 0.35, 0.75 });
  vtkNew<vtkPolyData> nothing;
  vtkNew<vtkTrivialProducer> producer;
  producer->SetOutput(nothing);
  scene.tracker->SetLinesConnection(producer->GetOutputPort());
  Messages messages(scene.tracker);
  scene.tracker->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(scene.tracker->GetOutput()->GetNumberOfPoints(), 0);
}

TEST(CenterlineTracker, Stops)
{
  Scene scene({ 0.35, 0.75 });
  scene.phantom->Update();
  UpdateAborted(scene.tracker);
  EXPECT_EQ(scene.tracker->GetOutput()->GetNumberOfPoints(), 0);
  EXPECT_EQ(scene.tracker->GetNumberOfTrackings(), 0);
  EXPECT_GT(scene.At(0.35)->GetNumberOfPoints(), 0);
}
