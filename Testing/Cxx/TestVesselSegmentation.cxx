// vtkVesselSegmentation through the VTK pipeline: outputs, seeds, pieces, time, refusals.
#include "vtkVesselSegmentation.h"

#include "CoronaryPhantom.h"
#include "FilterMessages.h"
#include "ParallelFor.h"

#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkFrangiVesselness.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkShortArray.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUnsignedCharArray.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace TestVesselSegmentation
{
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;
using Extent = std::array<int, 6>;

namespace
{
constexpr double ReferenceTime = 0.75;

/// A bright ball, the "aorta", with a bent tube on it that tapers, in darkness.
struct Tube
{
  Vector3 ostium{ 10.0, 14.0, 12.0 };
  double radius = 1.6;

  vtkSmartPointer<vtkImageData> Image(const Extent& extent = { 0, 79, 0, 55, 0, 47 }) const
  {
    auto image = vtkSmartPointer<vtkImageData>::New();
    image->SetExtent(const_cast<int*>(extent.data()));
    image->SetSpacing(0.5, 0.5, 0.5);
    vtkNew<vtkShortArray> values;
    values->SetName("HU");
    for (int k = extent[4]; k <= extent[5]; ++k)
    {
      for (int j = extent[2]; j <= extent[3]; ++j)
      {
        for (int i = extent[0]; i <= extent[1]; ++i)
        {
          const Vector3 p(0.5 * i, 0.5 * j, 0.5 * k);
          const double ball = (p - Vector3(2.0, 14.0, 12.0)).norm() - 8.0;
          const double y = 14.0 + 2.5 * std::sin(0.2 * (p[0] - 10.0));
          const double tube =
            p[0] < 8.0 || p[0] > 36.0 ? 99.0 : std::hypot(p[1] - y, p[2] - 12.0) - this->radius;
          const double inside = 0.5 * std::erfc(std::min(ball, tube) / 0.6);
          values->InsertNextValue(static_cast<short>(std::lround(-50.0 + 450.0 * inside)));
        }
      }
    }
    image->GetPointData()->SetScalars(values);
    return image;
  }
};

vtkUnsignedCharArray* MaskOf(vtkAlgorithm* filter)
{
  auto* image = vtkImageData::SafeDownCast(filter->GetOutputDataObject(0));
  return vtkUnsignedCharArray::SafeDownCast(image->GetPointData()->GetArray("VesselMask"));
}

double Count(vtkUnsignedCharArray* mask)
{
  double sum = 0.0;
  for (vtkIdType n = 0; n < mask->GetNumberOfTuples(); ++n)
  {
    sum += mask->GetValue(n);
  }
  return sum;
}

/// A phantom whose image is small enough for a test.
vtkSmartPointer<vtkCoronaryPhantomSource> MakePhantom(double spacing = 1.0)
{
  auto source = vtkSmartPointer<vtkCoronaryPhantomSource>::New();
  source->SetSeed(2);
  source->SetSpacing(spacing, spacing, spacing);
  return source;
}
}

TEST(VesselSegmentation, PhantomWithoutAnyClick)
{
  const auto source = MakePhantom();
  vtkNew<vtkVesselSegmentation> filter;
  const Messages messages(filter);
  filter->SetInputConnection(source->GetOutputPort(vtkCoronaryPhantomSource::ImagePort));
  filter->GenerateProbabilityOn();
  filter->UpdateTimeStep(ReferenceTime);
  ASSERT_TRUE(messages.Errors.empty()) << testing::PrintToString(messages.Errors);
  EXPECT_TRUE(messages.Warnings.empty()) << messages.Warnings.front();

  auto* image = vtkImageData::SafeDownCast(filter->GetOutputDataObject(0));
  vtkUnsignedCharArray* mask = MaskOf(filter);
  ASSERT_NE(mask, nullptr);
  EXPECT_EQ(image->GetPointData()->GetScalars(), mask);
  auto* probability = image->GetPointData()->GetArray("VesselProbability");
  ASSERT_NE(probability, nullptr);
  for (vtkIdType n = 0; n < mask->GetNumberOfTuples(); ++n)
  {
    ASSERT_LE(mask->GetValue(n), 1);
    ASSERT_EQ(mask->GetValue(n) == 1, probability->GetTuple1(n) >= 0.5 && mask->GetValue(n))
      << "voxel " << n;
  }
  EXPECT_GT(Count(mask), 1500.0); // mm^3
  EXPECT_LT(Count(mask), 5000.0);
  EXPECT_DOUBLE_EQ(image->GetFieldData()->GetArray("PhaseTime")->GetTuple1(0), ReferenceTime);
  EXPECT_NEAR(image->GetFieldData()->GetArray("BloodWindow")->GetTuple1(1), 430.0, 15.0);

  auto* seeds = vtkPolyData::SafeDownCast(filter->GetOutputDataObject(1));
  ASSERT_EQ(seeds->GetNumberOfPoints(), 2);
  auto* names = vtkStringArray::SafeDownCast(seeds->GetPointData()->GetAbstractArray("Name"));
  coronary::PhantomSettings settings;
  settings.seed = 2;
  const std::vector<coronary::PhantomOstium> truth =
    coronary::CoronaryPhantom(settings).Ostia(ReferenceTime);
  for (int n = 0; n < 2; ++n)
  {
    EXPECT_EQ(names->GetValue(n), truth[n].name);
    Vector3 found;
    seeds->GetPoint(n, found.data());
    EXPECT_LT((found - truth[n].position).norm(), 2.0) << truth[n].name;
    EXPECT_GT(seeds->GetPointData()->GetArray("Confidence")->GetTuple1(n), 0.5);
    EXPECT_GT(seeds->GetPointData()->GetArray("SeedVolume")->GetTuple1(n), 200.0);
  }
  EXPECT_EQ(seeds->GetNumberOfVerts(), 2);
  auto* aorta = vtkPolyData::SafeDownCast(filter->GetOutputDataObject(2));
  EXPECT_EQ(aorta->GetNumberOfLines(), 1);
  EXPECT_GT(aorta->GetPointData()->GetArray("MaximumInscribedSphereRadius")->GetTuple1(0), 8.0);
}

TEST(VesselSegmentation, TheTubeWithoutTheBall)
{
  const Tube tube;
  const auto image = tube.Image();
  const std::vector<short> before(static_cast<short*>(image->GetScalarPointer()),
    static_cast<short*>(image->GetScalarPointer()) + image->GetNumberOfPoints());
  vtkNew<vtkVesselSegmentation> filter;
  const Messages messages(filter);
  filter->SetInputData(image);
  filter->AddSeed(tube.ostium[0], tube.ostium[1], tube.ostium[2]);
  filter->Update();
  ASSERT_TRUE(messages.Errors.empty()) << testing::PrintToString(messages.Errors);
  // From the wall of the ball at x = 10 to x = 36; the tube's length by its slope.
  double length = 0.0;
  for (double x = 10.0; x < 36.0; x += 0.01)
  {
    length += 0.01 * std::hypot(1.0, 0.5 * std::cos(0.2 * (x - 10.0)));
  }
  const double volume = 0.125 * Count(MaskOf(filter));
  EXPECT_NEAR(volume, 3.14159265 * 1.6 * 1.6 * length, 0.12 * volume);
  EXPECT_EQ(
    std::memcmp(image->GetScalarPointer(), before.data(), before.size() * sizeof(short)), 0);

  // The same with points on the input, as unsigned short or double, and with vesselness given.
  const double expected = Count(MaskOf(filter));
  vtkNew<vtkPolyData> points;
  vtkNew<vtkPoints> positions;
  positions->InsertNextPoint(tube.ostium.data());
  points->SetPoints(positions);
  vtkNew<vtkVesselSegmentation> second;
  second->SetSeedsData(points);
  vtkNew<vtkImageData> real;
  real->CopyStructure(image);
  vtkNew<vtkDoubleArray> values;
  values->SetName("intensity");
  for (const short value : before)
  {
    values->InsertNextValue(value);
  }
  real->GetPointData()->AddArray(values);
  second->SetInputData(real);
  second->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "intensity");
  second->Update();
  EXPECT_EQ(Count(MaskOf(second)), expected);
  vtkNew<vtkFrangiVesselness> vesselness;
  vesselness->SetInputData(image);
  filter->SetVesselnessConnection(vesselness->GetOutputPort());
  filter->Update();
  EXPECT_NEAR(Count(MaskOf(filter)), expected, 0.05 * expected);
}

TEST(VesselSegmentation, PiecesAndThreadsGiveTheSame)
{
  const Tube tube;
  const auto image = tube.Image();
  vtkNew<vtkVesselSegmentation> filter;
  filter->SetInputData(image);
  filter->AddSeed(tube.ostium[0], tube.ostium[1], tube.ostium[2]);
  coronary::SetNumberOfThreads(1);
  filter->Update();
  vtkNew<vtkUnsignedCharArray> whole;
  whole->DeepCopy(MaskOf(filter));
  coronary::SetNumberOfThreads(4);
  filter->Modified();
  filter->Update();
  coronary::SetNumberOfThreads(0);
  ASSERT_EQ(std::memcmp(whole->GetPointer(0), MaskOf(filter)->GetPointer(0),
              static_cast<std::size_t>(whole->GetNumberOfTuples())),
    0);
  const Extent part{ 10, 50, 20, 40, 5, 30 };
  filter->Modified();
  filter->UpdateExtent(part.data());
  auto* output = filter->GetOutput();
  Extent got;
  output->GetExtent(got.data());
  EXPECT_EQ(got, part);
  const int dims[3] = { 80, 56, 48 };
  vtkIdType n = 0;
  for (int k = part[4]; k <= part[5]; ++k)
  {
    for (int j = part[2]; j <= part[3]; ++j)
    {
      for (int i = part[0]; i <= part[1]; ++i, ++n)
      {
        ASSERT_EQ(MaskOf(filter)->GetValue(n), whole->GetValue((k * dims[1] + j) * dims[0] + i));
      }
    }
  }
  // Of the polydata outputs only piece 0 holds something; every piece has all arrays.
  for (const int piece : { 0, 1 })
  {
    filter->Modified();
    filter->UpdatePiece(piece, 2, 0);
    auto* seeds = vtkPolyData::SafeDownCast(filter->GetOutputDataObject(1));
    EXPECT_NE(seeds->GetPointData()->GetArray("Axis"), nullptr);
  }
}

TEST(VesselSegmentation, AskingForTheSeedsComputesOnce)
{
  const Tube tube;
  vtkNew<vtkVesselSegmentation> filter;
  filter->SetInputData(tube.Image());
  filter->AddSeed(tube.ostium[0], tube.ostium[1], tube.ostium[2]);
  int executions = 0;
  vtkNew<vtkCallbackCommand> count;
  count->SetClientData(&executions);
  count->SetCallback([](vtkObject*, unsigned long, void* n, void*) { ++*static_cast<int*>(n); });
  filter->AddObserver(vtkCommand::StartEvent, count);
  filter->Update(1);
  filter->Update(0);
  filter->Update(2);
  EXPECT_EQ(executions, 1);
  EXPECT_GT(Count(MaskOf(filter)), 0.0);
}

TEST(VesselSegmentation, SaysWhatIsWrong)
{
  const Tube tube;
  const auto refuse =
    [&](const std::function<void(vtkVesselSegmentation*)>& change, const std::string& word)
  {
    vtkNew<vtkVesselSegmentation> filter;
    filter->SetInputData(tube.Image());
    filter->AddSeed(tube.ostium[0], tube.ostium[1], tube.ostium[2]);
    change(filter);
    const Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.HasError(word))
      << "wanted '" << word << "', got " << testing::PrintToString(messages.Errors);
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0) << word;
  };
  refuse([](auto* f) { f->SetMaximumRadius(0.0); }, "MaximumRadius");
  refuse([](auto* f) { f->SetLongestPath(-1.0); }, "LongestPath");
  refuse([](auto* f) { f->SetMinimumIslandVolume(-1.0); }, "MinimumIslandVolume");
  refuse([](auto* f) { f->SetWeakThreshold(0.9); }, "WeakThreshold");
  refuse([](auto* f) { f->SetTubularVesselness(-1.0); }, "TubularVesselness");
  refuse(
    [](auto* f)
    {
      f->AutomaticWindowOff();
      f->SetBloodValue(0.0);
    },
    "BloodValue");
  refuse([](auto* f) { f->AddSeed(1000.0, 0.0, 0.0); }, "Seed 1 is outside the image");
  refuse(
    [](auto* f)
    {
      f->ClearSeeds();
      f->AutomaticOstiaOff();
    },
    "AutomaticOstia");
  refuse([](auto* f) { f->ClearSeeds(); }, "AutomaticOstia found no ostium");
  refuse([](auto* f)
    { f->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "absent"); },
    "'absent'");
  refuse(
    [&](auto* f) {
      f->SetInputData(tube.Image({ 0, 79, 0, 55, 20, 20 }));
    },
    "three-dimensional");
  refuse(
    [&](auto* f)
    {
      vtkNew<vtkImageData> vectors;
      vectors->SetDimensions(10, 10, 10);
      vectors->AllocateScalars(VTK_FLOAT, 3);
      f->SetInputData(vectors);
    },
    "3 components");
  refuse(
    [&](auto* f)
    {
      vtkNew<vtkImageData> other;
      other->SetDimensions(10, 10, 10);
      other->AllocateScalars(VTK_FLOAT, 1);
      f->SetVesselnessData(other);
    },
    "another grid");
  refuse(
    [&](auto* f)
    {
      vtkNew<vtkImageData> flat;
      flat->SetDimensions(80, 56, 48);
      flat->SetSpacing(0.5, 0.5, 0.5);
      flat->AllocateScalars(VTK_SHORT, 1);
      flat->GetPointData()->GetScalars()->Fill(70.0);
      f->SetInputData(flat);
    },
    "Nothing is brighter");
}

TEST(VesselSegmentation, ASeedInTheDarkIsAWarning)
{
  const Tube tube;
  vtkNew<vtkVesselSegmentation> filter;
  const Messages messages(filter);
  filter->SetInputData(tube.Image());
  filter->AddSeed(tube.ostium[0], tube.ostium[1], tube.ostium[2]);
  filter->AddSeed(30.0, 3.0, 3.0);
  filter->AutomaticWindowOff();
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty()) << testing::PrintToString(messages.Errors);
  ASSERT_EQ(messages.Warnings.size(), 1u);
  EXPECT_NE(messages.Warnings.front().find("seed 1"), std::string::npos);
}

TEST(VesselSegmentation, ASeedInTissueSaysSo)
{
  const auto source = MakePhantom();
  source->UpdateTimeStep(ReferenceTime);
  const auto update = [&](const std::vector<Vector3>& seeds)
  {
    vtkNew<vtkVesselSegmentation> filter;
    const Messages messages(filter);
    filter->SetInputConnection(source->GetOutputPort(vtkCoronaryPhantomSource::ImagePort));
    for (const Vector3& seed : seeds)
    {
      filter->AddSeed(seed[0], seed[1], seed[2]);
    }
    filter->UpdateTimeStep(ReferenceTime);
    EXPECT_TRUE(messages.Errors.empty()) << testing::PrintToString(messages.Errors);
    return messages.Warnings;
  };
  // Muscle; blood of a chamber, from which no vessel leads on.
  const std::vector<std::pair<Vector3, std::string>> places{ { Vector3(-49.0, -22.0, -35.0),
                                                               "only as bright as noise" },
    { Vector3(-25.0, 8.0, -35.0), "none leads on" } };
  for (const auto& [place, reason] : places)
  {
    const std::vector<std::string> said = update({ place });
    ASSERT_EQ(said.size(), 1U) << testing::PrintToString(said);
    EXPECT_NE(said[0].find("Seed 0"), std::string::npos) << said[0];
    EXPECT_NE(said[0].find("is in no vessel"), std::string::npos) << said[0];
    EXPECT_NE(said[0].find(reason), std::string::npos) << said[0];
  }

  // Seeds all along the arteries, thin ones too, are none of that.
  auto* lines =
    vtkPolyData::SafeDownCast(source->GetOutputDataObject(vtkCoronaryPhantomSource::TreePort));
  source->Update(vtkCoronaryPhantomSource::TreePort);
  vtkDataArray* radius = lines->GetPointData()->GetArray("MaximumInscribedSphereRadius");
  std::vector<Vector3> seeds;
  for (vtkIdType n = 0; n < lines->GetNumberOfPoints(); n += 40)
  {
    if (radius->GetTuple1(n) > 0.9)
    {
      seeds.emplace_back();
      lines->GetPoint(n, seeds.back().data());
    }
  }
  ASSERT_GT(seeds.size(), 10U);
  for (const std::string& warning : update(seeds))
  {
    EXPECT_EQ(warning.find("in no vessel"), std::string::npos) << warning;
  }
}

TEST(VesselSegmentation, NaNVoxelsAreNoVessel)
{
  const Tube tube;
  const auto shorts = tube.Image();
  vtkNew<vtkImageData> image;
  image->CopyStructure(shorts);
  vtkNew<vtkFloatArray> values;
  values->SetName("HU");
  for (vtkIdType n = 0; n < shorts->GetNumberOfPoints(); ++n)
  {
    const bool lost = n % 80 > 74; // the last columns
    values->InsertNextValue(lost
        ? std::numeric_limits<float>::quiet_NaN()
        : static_cast<float>(shorts->GetPointData()->GetScalars()->GetTuple1(n)));
  }
  image->GetPointData()->SetScalars(values);
  vtkNew<vtkVesselSegmentation> filter;
  const Messages messages(filter);
  filter->SetInputData(image);
  filter->AddSeed(tube.ostium[0], tube.ostium[1], tube.ostium[2]);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty()) << testing::PrintToString(messages.Errors);
  EXPECT_GT(Count(MaskOf(filter)), 500.0);
  for (vtkIdType n = 0; n < shorts->GetNumberOfPoints(); ++n)
  {
    ASSERT_FALSE(n % 80 > 74 && MaskOf(filter)->GetValue(n));
  }
}

TEST(VesselSegmentation, AbortLeavesNothingAndTheNextRequestWorks)
{
  const Tube tube;
  vtkNew<vtkVesselSegmentation> filter;
  filter->SetInputData(tube.Image());
  filter->AddSeed(tube.ostium[0], tube.ostium[1], tube.ostium[2]);
  UpdateAborted(filter);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  filter->Update();
  ASSERT_NE(MaskOf(filter), nullptr);
  EXPECT_GT(Count(MaskOf(filter)), 0.0);
}

TEST(VesselSegmentation, PrintsItsSettings)
{
  vtkNew<vtkVesselSegmentation> filter;
  filter->AddSeed(1.0, 2.0, 3.0);
  std::ostringstream text;
  filter->Print(text);
  for (const char* word : { "Seed 0: 1 2 3", "AutomaticOstia", "MaximumRadius" })
  {
    EXPECT_NE(text.str().find(word), std::string::npos) << word;
  }
}
}
