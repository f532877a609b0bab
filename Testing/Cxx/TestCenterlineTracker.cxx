// vtkCenterlineTracker through the VTK pipeline: the phantom's series, masks, surfaces, time keys, what is
// read and when, refusals.
#include "vtkCenterlineTracker.h"

#include "CoronaryPhantom.h"
#include "FilterMessages.h"
#include "ParallelFor.h"
#include "TimedTestSource.h"
#include "vtkCardiacPhaseInterpolator.h"
#include "vtkCenterlineSkeleton.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkReferencePhase.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStripper.h"
#include "vtkTrivialProducer.h"
#include "vtkUnsignedCharArray.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <vector>

namespace TestCenterlineTracker
{
using coronary::ImageGrid;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;
using Phantom = vtkCoronaryPhantomSource;

namespace
{
/// What a function gives at every time step; nothing for one at which it fails.
class GivenSeries : public TimedTestSource
{
public:
  static GivenSeries* New();
  vtkTypeMacro(GivenSeries, TimedTestSource);

  std::function<vtkSmartPointer<vtkDataObject>(double time)> Give;
  std::array<int, 6> Whole{ 0, -1, 0, -1, 0, -1 }; ///< of images

protected:
  vtkSmartPointer<vtkDataObject> NewOutput() override
  {
    if (this->Whole[1] < 0)
    {
      return vtkSmartPointer<vtkPolyData>::New();
    }
    return vtkSmartPointer<vtkImageData>::New();
  }

  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override
  {
    if (this->Whole[1] >= 0)
    {
      outputs->GetInformationObject(0)->Set(SDDP::WHOLE_EXTENT(), this->Whole.data(), 6);
    }
    return TimedTestSource::RequestInformation(request, inputs, outputs);
  }

  bool Make(double time, vtkDataObject* output) override
  {
    const vtkSmartPointer<vtkDataObject> data = this->Give(time);
    if (data == nullptr)
    {
      vtkErrorMacro("cannot read the file of " << time);
      return false;
    }
    output->ShallowCopy(data);
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
    return true;
  }
};
vtkStandardNewMacro(GivenSeries);

/// The phantom's lumen as users have it from a segmentation: 1 inside, 0 outside, 8 bits.
vtkSmartPointer<vtkImageData> MaskAt(
  const coronary::CoronaryPhantom& phantom, const ImageGrid& grid, double time)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  std::array<int, 6> extent = grid.extent;
  image->SetExtent(extent.data());
  image->SetSpacing(grid.spacing.data());
  image->SetOrigin(grid.origin.data());
  std::vector<float> distances(image->GetNumberOfPoints());
  phantom.LumenDistances(grid, grid.extent, time, 1.0, distances.data());
  vtkNew<vtkUnsignedCharArray> mask;
  mask->SetName("Lumen");
  mask->SetNumberOfValues(image->GetNumberOfPoints());
  std::transform(distances.begin(), distances.end(), mask->GetPointer(0),
    [](float distance) { return static_cast<unsigned char>(distance < 0.0F ? 1 : 0); });
  image->GetPointData()->SetScalars(mask);
  return image;
}

/// Mean distance of every fifth point to the axes of a phantom's tree, of vessels of 0.75 mm and more.
double AxisError(vtkPolyData* found, const coronary::PhantomTree& truth)
{
  double sum = 0.0;
  vtkIdType count = 0;
  for (vtkIdType n = 0; n < found->GetNumberOfPoints(); n += 5)
  {
    if (truth.radius[n] < 0.75)
    {
      continue;
    }
    const Vector3 place(found->GetPoint(n));
    double minimum = std::numeric_limits<double>::infinity();
    for (const coronary::VesselTree::Branch& branch : truth.branches)
    {
      for (std::size_t p = 0; p + 1 < branch.points.size(); ++p)
      {
        minimum = std::min(minimum,
          coronary::NearestOnSegment(
            place, truth.points[branch.points[p]], truth.points[branch.points[p + 1]])
            .squaredDistance);
      }
    }
    sum += std::sqrt(minimum);
    ++count;
  }
  return sum / static_cast<double>(count);
}

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
    this->phantom->SetTemporalWindow(0.0);
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
  for (const char* name : { "PlacementConfidence", "TrackingConfidence", "TrackingStatus",
         "CalibreFactor", "LumenBeside", "LumenContrast" })
  {
    vtkDataArray* array = output->GetPointData()->GetArray(name);
    ASSERT_NE(array, nullptr) << name;
    EXPECT_EQ(array->GetNumberOfTuples(), output->GetNumberOfPoints());
  }
  // The true tree, seen well.
  EXPECT_GT(output->GetPointData()->GetArray("PlacementConfidence")->GetRange()[0], 0.5);
  EXPECT_LE(output->GetPointData()->GetArray("PlacementConfidence")->GetRange()[1], 1.0);
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
    double minimum = std::numeric_limits<double>::infinity();
    for (vtkIdType p = 0; p < tree->GetNumberOfPoints(); ++p)
    {
      double point[3];
      tree->GetPoint(p, point);
      minimum = std::min(
        minimum, std::hypot(point[0] - joint[0], point[1] - joint[1], point[2] - joint[2]));
    }
    EXPECT_LT(minimum, 0.5);
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
  ExpectFilterError(scene.tracker, "TrackedTimes is empty");
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

TEST(CenterlineTracker, TakesMasksOfEveryPhase)
{
  // Every other one of sixteen phases is tracked, the others are judged too.
  coronary::PhantomSettings settings;
  settings.seed = 2;
  const coronary::CoronaryPhantom phantom(settings);
  const ImageGrid grid = phantom.DefaultGrid(1.0, 6.0);
  vtkNew<GivenSeries> masks;
  masks->Whole = grid.extent;
  for (int k = 0; k < 16; ++k)
  {
    masks->Steps.push_back(k / 16.0);
  }
  masks->Give = [&](double time) { return MaskAt(phantom, grid, time); };
  vtkNew<Phantom> tree;
  tree->SetSeed(2);
  vtkNew<vtkReferencePhase> lines;
  lines->SetInputConnection(tree->GetOutputPort(Phantom::TreePort));
  lines->AutomaticOff();
  lines->SetTime(masks->Steps[12]);
  tree->ClearPhases();
  tree->AddPhase(masks->Steps[12]);
  vtkNew<vtkCenterlineTracker> tracker;
  tracker->SetInputConnection(masks->GetOutputPort());
  tracker->SetLinesConnection(lines->GetOutputPort());
  tracker->SetImageContent(vtkCenterlineTracker::Mask);
  tracker->SetImageArrayName("Lumen");
  tracker->SetTrackedPhases(vtkCenterlineTracker::EvenPhases);
  vtkNew<vtkCardiacPhaseInterpolator> motion;
  motion->SetInputConnection(tracker->GetOutputPort());
  double tracked = 0.0;
  double between = 0.0;
  for (int k = 0; k < 16; ++k)
  {
    const double time = masks->Steps[k];
    motion->UpdateTimeStep(time);
    auto* found = vtkPolyData::SafeDownCast(motion->GetOutputDataObject(0));
    ASSERT_GT(found->GetNumberOfPoints(), 0);
    const double error = AxisError(found, phantom.Tree(time));
    EXPECT_LT(error, 0.5) << "at " << time;
    (k % 2 == 0 ? tracked : between) += error / 8.0;
  }
  std::printf("masks: tracked phases %.3f mm, between %.3f mm\n", tracked, between);
  EXPECT_LT(tracked, 0.15);
  EXPECT_LT(between, 0.25);
  // Every tracked phase and, once more, the reference.
  EXPECT_EQ(tracker->GetNumberOfTrackings(), 1);
  EXPECT_LE(masks->Executions, 11);
}

TEST(CenterlineTracker, TakesClosedSurfacesOfEveryPhase)
{
  Scene scene;
  scene.phantom->SetSurfaceSpacing(0.8);
  scene.tracker->SetInputConnection(scene.phantom->GetOutputPort(Phantom::SurfacePort));
  const coronary::CoronaryPhantom phantom{ coronary::PhantomSettings() };
  std::vector<double> errors;
  for (const double time : { 0.25, 0.5 })
  {
    errors.push_back(AxisError(scene.At(time), phantom.Tree(time)));
    EXPECT_LT(errors.back(), 0.2) << time;
  }

  // Strips show the same.
  vtkNew<vtkStripper> strips;
  strips->SetInputConnection(scene.phantom->GetOutputPort(Phantom::SurfacePort));
  scene.tracker->SetInputConnection(strips->GetOutputPort());
  EXPECT_NEAR(AxisError(scene.At(0.5), phantom.Tree(0.5)), errors[1], 0.01);
  EXPECT_GT(strips->GetOutput()->GetNumberOfStrips(), 0);

  // A reference between the phases: the lines say what the vessels look like.
  scene.tracker->SetInputConnection(scene.phantom->GetOutputPort(Phantom::SurfacePort));
  scene.phantom->ClearPhases();
  for (const double phase : { 0.05, 0.25, 0.5, 0.7 })
  {
    scene.phantom->AddPhase(phase);
  }
  vtkNew<Phantom> tree;
  tree->ClearPhases();
  tree->AddPhase(0.75);
  scene.reference->SetInputConnection(tree->GetOutputPort(Phantom::TreePort));
  EXPECT_LT(AxisError(scene.At(0.5), phantom.Tree(0.5)), 0.3);
}

TEST(CenterlineTracker, TakesOtherGridsAndNumbersOfPhases)
{
  // Every phase on a grid of its own, one of them turned and in other voxels.
  const coronary::CoronaryPhantom phantom{ coronary::PhantomSettings() };
  vtkNew<GivenSeries> masks;
  masks->Steps = { 0.05, 0.25, 0.5, 0.75 };
  masks->Whole = phantom.DefaultGrid(1.0, 6.0).extent;
  masks->Give = [&](double time)
  {
    ImageGrid grid = phantom.DefaultGrid(time == 0.25 ? 0.8 : 1.0, 6.0 + 8.0 * time);
    if (time == 0.5)
    {
      // The axes in another order.
      const std::array<int, 6> e = grid.extent;
      grid.extent = { e[2], e[3], e[4], e[5], e[0], e[1] };
      grid.direction << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    }
    auto image = MaskAt(phantom, grid, time);
    image->SetDirectionMatrix(grid.direction(0, 0), grid.direction(0, 1), grid.direction(0, 2),
      grid.direction(1, 0), grid.direction(1, 1), grid.direction(1, 2), grid.direction(2, 0),
      grid.direction(2, 1), grid.direction(2, 2));
    return image;
  };
  Scene scene;
  scene.tracker->SetInputConnection(masks->GetOutputPort());
  scene.tracker->SetImageContent(vtkCenterlineTracker::Mask);
  for (const double time : { 0.25, 0.5 })
  {
    EXPECT_LT(AxisError(scene.At(time), phantom.Tree(time)), 0.25) << time;
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
    ExpectFilterError(scene.tracker, "one phase only");
  }
  {
    Scene scene({ 0.35, 0.75 });
    vtkNew<vtkReferencePhase> image;
    image->SetInputConnection(scene.phantom->GetOutputPort(Phantom::ImagePort));
    scene.tracker->SetInputConnection(image->GetOutputPort());
    ExpectFilterError(scene.tracker, "no time steps");
  }
  {
    Scene scene({ 0.35, 0.75 });
    scene.tracker->AutomaticReferenceOff();
    scene.tracker->SetReferenceTime(0.6);
    ExpectFilterError(scene.tracker, "none of the time steps");
    scene.tracker->SetReferenceTime(std::numeric_limits<double>::quiet_NaN());
    ExpectFilterError(scene.tracker, "ReferenceTime must be finite");
  }
  {
    Scene scene({ 0.35, 0.75 });
    scene.tracker->SetNodeSpacing(0.1);
    ExpectFilterError(scene.tracker, "NodeSpacing");
    scene.tracker->SetNodeSpacing(2.0);
    scene.tracker->SetImageArrayName("Density");
    ExpectFilterError(scene.tracker, "no point array 'Density'");
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
    ExpectFilterError(scene.tracker, "outside of the image");
    lines->GetFieldData()->RemoveArray("PhaseTime");
    lines->Modified();
    producer->Modified();
    ExpectFilterError(scene.tracker, "no field array PhaseTime");
  }
}

TEST(CenterlineTracker, RefusesSeriesThatAreNone)
{
  Scene scene({ 0.35, 0.5, 0.75 });
  vtkNew<GivenSeries> images;
  images->Steps = { 0.35, 0.5, 0.75 };
  images->Whole = { 0, 9, 0, 9, 0, 9 };
  const auto blank = []
  {
    auto image = vtkSmartPointer<vtkImageData>::New();
    image->SetExtent(0, 9, 0, 9, 0, 9);
    image->AllocateScalars(VTK_SHORT, 1);
    image->GetPointData()->GetScalars()->Fill(0.0);
    return image;
  };
  scene.tracker->SetInputConnection(images->GetOutputPort());
  images->Give = [&](double) { return blank(); };
  const auto steps = [&](const std::vector<double>& times, const char* message)
  {
    images->Steps = times;
    images->Modified();
    ExpectFilterError(scene.tracker, message);
  };
  steps({ 0.35, 0.35, 0.75 }, "do not increase");
  steps({ 0.75, 0.5, 0.35 }, "do not increase");
  steps({ 0.35, std::nan(""), 0.75 }, "do not increase");
  steps({ 0.75 }, "one phase only");
  steps({ 0.35, 0.5, 0.75 }, "Most of the lines are outside of the image");

  // A phase that is missing in the middle: no voxels, no array, or its file cannot be read.
  const coronary::CoronaryPhantom phantom{ coronary::PhantomSettings() };
  const ImageGrid grid = phantom.DefaultGrid(1.5, 6.0);
  images->Whole = grid.extent;
  std::map<double, vtkSmartPointer<vtkImageData>> masks;
  for (const double time : { 0.35, 0.75 })
  {
    masks[time] = MaskAt(phantom, grid, time);
  }
  const auto atHalf = [&](const std::function<vtkSmartPointer<vtkDataObject>()>& other)
  {
    images->Give = [&masks, other](double time) -> vtkSmartPointer<vtkDataObject>
    {
      if (time == 0.5)
      {
        return other();
      }
      return masks.at(time);
    };
    images->Modified();
  };
  atHalf([] { return vtkSmartPointer<vtkImageData>::New(); });
  ExpectFilterError(scene.tracker, "The image at the time 0.5");
  atHalf(
    [&]
    {
      auto image = blank();
      image->GetPointData()->Initialize();
      return image;
    });
  ExpectFilterError(
    scene.tracker, "The image at the time 0.500000 has no point array of one component");
  {
    atHalf([] { return nullptr; });
    Messages upstream(images);
    ExpectFilterError(scene.tracker, "failed");
    EXPECT_TRUE(upstream.HasError("cannot read the file of 0.5"));
  }
  // It can be left out.
  scene.tracker->SetTrackedPhases(vtkCenterlineTracker::ListedPhases);
  scene.tracker->AddTrackedTime(0.35);
  scene.tracker->AddTrackedTime(0.75);
  scene.tracker->SetImageContent(vtkCenterlineTracker::Mask);
  EXPECT_GT(scene.At(0.35)->GetNumberOfPoints(), 0);

  // Nothing to be seen in one phase: filled, with a warning. In none: an error.
  atHalf(
    [&]
    {
      auto image = vtkSmartPointer<vtkImageData>::New();
      image->DeepCopy(masks.at(0.35));
      image->GetPointData()->GetScalars()->Fill(0.0);
      return image;
    });
  scene.tracker->SetTrackedPhases(vtkCenterlineTracker::AllPhases);
  {
    Messages messages(scene.tracker);
    EXPECT_GT(scene.At(0.5)->GetNumberOfPoints(), 0);
    EXPECT_TRUE(messages.HasWarning("The phase at 0.5"));
    EXPECT_TRUE(messages.Errors.empty());
  }
  scene.tracker->SetTrackedPhases(vtkCenterlineTracker::ListedPhases);
  scene.tracker->RemoveAllTrackedTimes();
  scene.tracker->AddTrackedTime(0.5);
  ExpectFilterError(scene.tracker, "found in none of the phases");
}

TEST(CenterlineTracker, RefusesShapesThatAreNone)
{
  Scene scene({ 0.35, 0.5, 0.75 });
  scene.phantom->SetSurfaceSpacing(1.2);
  std::vector<vtkSmartPointer<vtkPolyData>> surfaces;
  vtkNew<GivenSeries> shapes;
  shapes->Steps = { 0.35, 0.5, 0.75 };
  for (const double time : shapes->Steps)
  {
    scene.phantom->GetOutputInformation(Phantom::SurfacePort)->Set(SDDP::UPDATE_TIME_STEP(), time);
    scene.phantom->Update(Phantom::SurfacePort);
    surfaces.push_back(vtkSmartPointer<vtkPolyData>::New());
    surfaces.back()->DeepCopy(scene.phantom->GetOutputDataObject(Phantom::SurfacePort));
  }
  vtkSmartPointer<vtkPolyData> middle;
  shapes->Give = [&](double time) -> vtkSmartPointer<vtkDataObject> {
    return time == 0.35 ? surfaces[0] : time == 0.75 ? surfaces[2] : middle;
  };
  scene.tracker->SetInputConnection(shapes->GetOutputPort());
  const auto refuse = [&](const char* message)
  {
    shapes->Modified();
    ExpectFilterError(scene.tracker, message);
  };
  middle = vtkSmartPointer<vtkPolyData>::New();
  refuse("neither lines nor surfaces at the time 0.5");
  middle->SetPoints(surfaces[1]->GetPoints());
  refuse("neither lines nor surfaces at the time 0.5");

  // One triangle is missing, or turned.
  for (const bool turned : { false, true })
  {
    vtkNew<vtkCellArray> cells;
    cells->DeepCopy(surfaces[1]->GetPolys());
    if (turned)
    {
      cells->ReverseCellAtId(5);
    }
    else
    {
      vtkNew<vtkCellArray> fewer;
      for (vtkIdType n = 1; n < cells->GetNumberOfCells(); ++n)
      {
        vtkIdType count = 0;
        const vtkIdType* ids = nullptr;
        cells->GetCellAtId(n, count, ids);
        fewer->InsertNextCell(count, ids);
      }
      cells->DeepCopy(fewer);
    }
    middle->SetPolys(cells);
    refuse("not turned the same way: at 3 edges at the time 0.5");
  }
  vtkNew<vtkPoints> points;
  points->DeepCopy(surfaces[1]->GetPoints());
  points->SetPoint(7, std::nan(""), 0.0, 0.0);
  middle->SetPoints(points);
  middle->SetPolys(surfaces[1]->GetPolys());
  refuse("Point 7 is not finite at the time 0.5");
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
}
