// vtkCardiacPhaseInterpolator through the VTK pipeline: keys read once, any time, arrays, refusals.
#include "vtkCardiacPhaseInterpolator.h"

#include "FilterMessages.h"
#include "ParallelFor.h"
#include "SkeletonTestData.h"
#include "TimedTestSource.h"
#include "vtkCoronaryPhantomSource.h"

#include "vtkMultiBlockDataSet.h"
#include "vtkUnstructuredGrid.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <sstream>
#include <vector>

namespace TestCardiacPhaseInterpolator
{
using SDDP = vtkStreamingDemandDrivenPipeline;
using Filter = vtkCardiacPhaseInterpolator;

namespace
{
constexpr double Pi = 3.14159265358979323846;

/// Lines that move, with what can go wrong.
class MovingSource : public TimedTestSource
{
public:
  static MovingSource* New();
  vtkTypeMacro(MovingSource, TimedTestSource);

  vtkIdType Points = 6;
  bool Grid = false;
  bool Radius = false;
  bool Calibre = false;
  bool Axes = false;
  bool Confidence = false;
  bool Rotation = false;
  bool Others = false;
  bool Blocks = false;
  double SpoiledTime = -1.0; ///< at which ...
  enum Spoils
  {
    Nothing,
    Coordinate,
    Count,
    Lines,
    Absent,
    Components,
    Fail
  } Spoil = Nothing;

  static double X(vtkIdType n, double t) { return 2.0 * n + 3.0 * std::cos(2.0 * Pi * t); }
  static double Factor(double t) { return 1.0 + 0.02 * std::sin(2.0 * Pi * t); }

protected:
  MovingSource() { this->Steps = { 0.0, 0.2, 0.4, 0.6, 0.8 }; }

  vtkSmartPointer<vtkDataObject> NewOutput() override
  {
    vtkSmartPointer<vtkDataObject> data;
    if (this->Blocks)
    {
      data = vtkSmartPointer<vtkMultiBlockDataSet>::New();
    }
    else if (this->Grid)
    {
      data = vtkSmartPointer<vtkUnstructuredGrid>::New();
    }
    else
    {
      data = vtkSmartPointer<vtkPolyData>::New();
    }
    return data;
  }

  bool Make(double time, vtkDataObject* output) override
  {
    const bool spoiled = time == this->SpoiledTime;
    if (spoiled && this->Spoil == Fail)
    {
      vtkErrorMacro("no such data");
      return false;
    }
    vtkSmartPointer<vtkPointSet> data;
    if (this->Grid)
    {
      data = vtkSmartPointer<vtkUnstructuredGrid>::New();
    }
    else
    {
      data = vtkSmartPointer<vtkPolyData>::New();
    }
    const vtkIdType count = this->Points + (spoiled && this->Spoil == Count ? 1 : 0);
    vtkNew<vtkPoints> points;
    vtkNew<vtkDoubleArray> radius;
    radius->SetName("MaximumInscribedSphereRadius");
    vtkNew<vtkDoubleArray> calibre;
    calibre->SetName("CalibreFactor");
    vtkNew<vtkDoubleArray> major;
    major->SetName("EllipseMajor");
    vtkNew<vtkDoubleArray> minor;
    minor->SetName("EllipseMinor");
    vtkNew<vtkDoubleArray> confidence;
    confidence->SetName("TrackingConfidence");
    confidence->SetNumberOfComponents(spoiled && this->Spoil == Components ? 2 : 1);
    vtkNew<vtkIntArray> status;
    status->SetName("TrackingStatus");
    vtkNew<vtkFloatArray> heat;
    heat->SetName("Heat");
    vtkNew<vtkIntArray> label;
    label->SetName("Label");
    vtkNew<vtkIntArray> still;
    still->SetName("Still");
    vtkNew<vtkCellArray> lines;
    std::vector<vtkIdType> ids;
    for (vtkIdType n = 0; n < count; ++n)
    {
      points->InsertNextPoint(X(n, time), 0.5 * n, time > 0.5 ? 1.0 : 0.0);
      radius->InsertNextValue(1.5 * Factor(time));
      calibre->InsertNextValue(n == 0 ? 1.2 : Factor(time));
      major->InsertNextValue(2.0 * Factor(time));
      minor->InsertNextValue(1.0 * Factor(time));
      for (int c = 0; c < confidence->GetNumberOfComponents(); ++c)
      {
        confidence->InsertNextValue(time);
      }
      status->InsertNextValue(time == 0.2 ? 3 : 0);
      heat->InsertNextValue(static_cast<float>(10.0 * time));
      label->InsertNextValue(static_cast<int>(10.0 * time));
      still->InsertNextValue(static_cast<int>(n));
      ids.push_back(n);
    }
    if (spoiled && this->Spoil == Coordinate)
    {
      points->SetPoint(1, std::numeric_limits<double>::quiet_NaN(), 0, 0);
    }
    if (spoiled && this->Spoil == Lines)
    {
      std::swap(ids[1], ids[2]);
    }
    data->SetPoints(points);
    if (count > 0)
    {
      lines->InsertNextCell(static_cast<vtkIdType>(ids.size()), ids.data());
      if (auto* poly = vtkPolyData::SafeDownCast(data))
      {
        poly->SetLines(lines);
      }
      else
      {
        vtkUnstructuredGrid::SafeDownCast(data)->SetCells(VTK_POLY_LINE, lines);
      }
    }
    vtkPointData* pointData = data->GetPointData();
    const auto add = [&](bool wanted, vtkDataArray* array)
    {
      if (wanted && !(spoiled && this->Spoil == Absent))
      {
        pointData->AddArray(array);
      }
    };
    add(this->Radius, radius);
    add(this->Calibre, calibre);
    add(this->Axes, major);
    add(this->Axes, minor);
    add(this->Confidence, confidence);
    add(this->Confidence, status);
    add(this->Others, heat);
    add(this->Others, label);
    add(this->Others, still);
    if (this->Rotation)
    {
      vtkNew<vtkDoubleArray> rotation;
      rotation->SetName("BoneRotation");
      rotation->SetNumberOfComponents(4);
      const double angle = 0.4 * std::cos(2.0 * Pi * time);
      rotation->InsertNextTuple4(std::cos(0.5 * angle), 0.0, 0.0, std::sin(0.5 * angle));
      data->GetCellData()->AddArray(rotation);
    }
    vtkNew<vtkDoubleArray> cycle;
    cycle->SetName("CycleLength");
    cycle->InsertNextValue(0.5);
    data->GetFieldData()->AddArray(cycle);
    data->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
    if (auto* blocks = vtkMultiBlockDataSet::SafeDownCast(output))
    {
      blocks->SetBlock(0, data);
    }
    else
    {
      output->ShallowCopy(data);
    }
    return true;
  }
};
vtkStandardNewMacro(MovingSource);

vtkPointSet* Output(Filter* filter)
{
  return vtkPointSet::SafeDownCast(filter->GetOutputDataObject(0));
}

double Point(vtkAlgorithm* filter, const char* name, vtkIdType n = 0, int component = 0)
{
  vtkDataArray* array =
    vtkPointSet::SafeDownCast(filter->GetOutputDataObject(0))->GetPointData()->GetArray(name);
  return array ? array->GetComponent(n, component) : std::numeric_limits<double>::quiet_NaN();
}

double Field(vtkAlgorithm* filter, const char* name, vtkIdType n = 0)
{
  vtkDataArray* array = filter->GetOutputDataObject(0)->GetFieldData()->GetArray(name);
  return array ? array->GetComponent(n, 0) : std::numeric_limits<double>::quiet_NaN();
}
}

TEST(CardiacPhaseInterpolator, ReadsEveryKeyOnceAndAnswersAnyTime)
{
  vtkNew<MovingSource> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->SetModeToLinear();
  for (const double time : { 0.3, 0.1, -0.7, 0.9, 57.3, 0.3 })
  {
    filter->UpdateTimeStep(time);
    const double phase = time - std::floor(time);
    const double before = 0.2 * std::floor(phase / 0.2 + 1e-9);
    const double share = (phase - before) / 0.2;
    const double x =
      (1.0 - share) * MovingSource::X(2, before) + share * MovingSource::X(2, before + 0.2);
    EXPECT_NEAR(Output(filter)->GetPoint(2)[0], x, 1e-6) << time;
    EXPECT_EQ(source->Executions, 5);
    EXPECT_EQ(filter->GetNumberOfReads(), 1);
    EXPECT_NEAR(Field(filter, "PhaseTime"), time, 1e-15);
    EXPECT_EQ(
      filter->GetOutputDataObject(0)->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), time);
  }
  // Settings do not make it read again; a change of the input does.
  filter->SetModeToPeriodicCubic();
  filter->UpdateTimeStep(0.3);
  EXPECT_EQ(source->Executions, 5);
  EXPECT_NEAR(Output(filter)->GetPoint(2)[0], MovingSource::X(2, 0.3), 0.02 * 3.0);
  source->Points = 8;
  source->Modified();
  filter->UpdateTimeStep(0.35);
  EXPECT_EQ(source->Executions, 10);
  EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 8);
  EXPECT_EQ(filter->GetNumberOfReads(), 2);
}

TEST(CardiacPhaseInterpolator, TimesThatAreOffered)
{
  vtkNew<MovingSource> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  const auto steps = [&]
  {
    filter->UpdateInformation();
    vtkInformation* info = filter->GetOutputInformation(0);
    const double* first = info->Get(SDDP::TIME_STEPS());
    return std::vector<double>(first, first + info->Length(SDDP::TIME_STEPS()));
  };
  const auto range = [&] { return filter->GetOutputInformation(0)->Get(SDDP::TIME_RANGE()); };
  EXPECT_EQ(steps().size(), 20U);
  EXPECT_NEAR(range()[0], -0.05, 1e-12);
  EXPECT_NEAR(range()[1], 1.06, 1e-12);
  filter->SetSteps(Filter::InputSteps);
  EXPECT_EQ(steps(), source->Steps);
  EXPECT_EQ(range()[1], 1.0);
  filter->SetSteps(Filter::EvenSteps);
  filter->SetNumberOfSteps(11);
  EXPECT_EQ(steps().size(), 11U);
  EXPECT_NEAR(steps()[3], 0.3, 1e-12);
  filter->SetSteps(Filter::ListedSteps);
  filter->AddStep(1.5);
  filter->AddStep(-0.5);
  filter->AddStep(1.5);
  EXPECT_EQ(steps(), (std::vector<double>{ -0.5, 1.5 }));
  EXPECT_EQ(range()[0], -0.5);
  EXPECT_EQ(range()[1], 1.5);
  filter->RemoveAllSteps();
  filter->UpdateInformation();
  EXPECT_FALSE(filter->GetOutputInformation(0)->Has(SDDP::TIME_STEPS()));
}

TEST(CardiacPhaseInterpolator, TimeInSeconds)
{
  vtkNew<MovingSource> source;
  source->Steps = { 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7 };
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->SetPeriod(0.8);
  filter->UpdateTimeStep(0.3);
  EXPECT_NEAR(Output(filter)->GetPoint(0)[0], MovingSource::X(0, 0.3), 1e-6);
  filter->UpdateTimeStep(0.3 - 1.6);
  EXPECT_NEAR(Output(filter)->GetPoint(0)[0], MovingSource::X(0, 0.3), 1e-6);
  EXPECT_NEAR(filter->GetOutputInformation(0)->Get(SDDP::TIME_RANGE())[1], 1.06 * 0.8, 1e-12);
}

TEST(CardiacPhaseInterpolator, VelocityInMillimetresPerSecond)
{
  vtkNew<MovingSource> source;
  source->Steps.clear();
  for (int k = 0; k < 20; ++k)
  {
    source->Steps.push_back(0.05 * k);
  }
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->UpdateTimeStep(0.25);
  // The input says that a cycle takes half a second.
  EXPECT_NEAR(Point(filter, "Velocity", 1, 0), -3.0 * 2.0 * Pi / 0.5, 0.05);
  EXPECT_NEAR(Point(filter, "Velocity", 1, 1), 0.0, 1e-9);
  EXPECT_EQ(Field(filter, "CycleLength"), 0.5);
}

TEST(CardiacPhaseInterpolator, ArraysOfTheInput)
{
  vtkNew<MovingSource> source;
  source->Confidence = source->Rotation = source->Others = true;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->UpdateTimeStep(0.25);
  EXPECT_NEAR(Point(filter, "TrackingConfidence"), 0.25, 1e-12);
  EXPECT_EQ(Point(filter, "TrackingStatus"), 3);
  EXPECT_NEAR(Point(filter, "Heat"), 2.5, 1e-6);
  EXPECT_EQ(Point(filter, "Label"), 2);
  EXPECT_EQ(Point(filter, "Still", 4), 4);
  vtkDataArray* rotation = Output(filter)->GetCellData()->GetArray("BoneRotation");
  ASSERT_NE(rotation, nullptr);
  double q[4];
  rotation->GetTuple(0, q);
  EXPECT_NEAR(q[0] * q[0] + q[3] * q[3], 1.0, 1e-12);
  EXPECT_NEAR(2.0 * std::atan2(q[3], q[0]), 0.4 * std::cos(2.0 * Pi * 0.25), 0.02);
  // Over the seam, the last and the first one count.
  filter->UpdateTimeStep(0.9);
  EXPECT_NEAR(Point(filter, "TrackingConfidence"), 0.4, 1e-12);
  EXPECT_NEAR(Point(filter, "Heat"), 4.0, 1e-6);
  EXPECT_TRUE(std::isnan(Point(filter, "CalibreFactor")));
  EXPECT_EQ(Field(filter, "ClampedSections"), 0);
}

TEST(CardiacPhaseInterpolator, CrossSectionsFromARadiusThatChanges)
{
  vtkNew<MovingSource> source;
  source->Steps = { 0.0, 0.25, 0.5, 0.75 };
  source->Radius = true;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->UpdateTimeStep(0.75);
  const double rest = 1.5 * MovingSource::Factor(0.75);
  EXPECT_NEAR(Point(filter, "MaximumInscribedSphereRadius"), rest, 1e-12);
  EXPECT_NEAR(Point(filter, "AreaStrain"), 0.0, 1e-12);
  filter->UpdateTimeStep(0.25);
  // (1.02 / 0.98)^2 is more than the limit.
  EXPECT_NEAR(Point(filter, "AreaStrain"), 0.05, 1e-12);
  EXPECT_NEAR(Point(filter, "MaximumInscribedSphereRadius"), rest * std::sqrt(1.05), 1e-12);
  EXPECT_NEAR(Point(filter, "CalibreFactor"), std::sqrt(1.05), 1e-12);
  EXPECT_EQ(Field(filter, "ClampedSections"), 6);
  filter->SetAreaStrainLimit(0.2);
  filter->EllipsesOn();
  filter->SetEccentricity(0.6);
  filter->UpdateTimeStep(0.25);
  const double radius = 1.5 * MovingSource::Factor(0.25);
  EXPECT_NEAR(Point(filter, "MaximumInscribedSphereRadius"), radius, 1e-12);
  EXPECT_EQ(Field(filter, "ClampedSections"), 0);
  EXPECT_NEAR(
    Point(filter, "EllipseMajor") * Point(filter, "EllipseMinor"), radius * radius, 1e-12);
  EXPECT_NEAR(Point(filter, "EllipseMinor") / Point(filter, "EllipseMajor"), 0.8, 1e-12);
}

TEST(CardiacPhaseInterpolator, RatesAreTheDerivativesInSeconds)
{
  vtkNew<MovingSource> source;
  source->Steps = { 0.0, 0.25, 0.5, 0.75 };
  source->Calibre = true;
  source->Rotation = true;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->SetCycleLength(0.5);
  for (const int mode : { Filter::Linear, Filter::PeriodicCubic, Filter::LowNoise })
  {
    filter->SetMode(mode);
    constexpr double Step = 1e-5;
    const double time = 0.4;
    const auto at = [&](double moment, const char* name, vtkIdType n)
    {
      filter->UpdateTimeStep(moment);
      return Point(filter, name, n);
    };
    // The first point is at its limit all the time.
    EXPECT_EQ(at(time, "CalibreRate", 0), 0.0);
    const double change = at(time + Step, "CalibreFactor", 3) - at(time - Step, "CalibreFactor", 3);
    EXPECT_NEAR(at(time, "CalibreRate", 3), change / (2.0 * Step * 0.5), 1e-6);
    EXPECT_GT(std::abs(change), 1e-8);
    const auto turned = [&](double moment)
    {
      filter->UpdateTimeStep(moment);
      double q[4];
      Output(filter)->GetCellData()->GetArray("BoneRotation")->GetTuple(0, q);
      return 2.0 * std::atan2(q[3], q[0]);
    };
    const double angle = turned(time + Step) - turned(time - Step);
    filter->UpdateTimeStep(time);
    double angular[3];
    Output(filter)->GetCellData()->GetArray("BoneAngularVelocity")->GetTuple(0, angular);
    EXPECT_NEAR(angular[0], 0.0, 1e-12);
    EXPECT_NEAR(angular[2], angle / (2.0 * Step * 0.5), 1e-5);
    EXPECT_GT(std::abs(angular[2]), 0.1);
  }
}

TEST(CardiacPhaseInterpolator, CrossSectionsFromFactorsAndEllipses)
{
  vtkNew<MovingSource> source;
  source->Steps = { 0.0, 0.25, 0.5, 0.75 };
  source->Calibre = true;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->UpdateTimeStep(0.25);
  EXPECT_NEAR(Point(filter, "CalibreFactor", 3), 1.02, 1e-12);
  EXPECT_NEAR(Point(filter, "CalibreFactor", 0), std::sqrt(1.05), 1e-12);
  EXPECT_EQ(Field(filter, "ClampedSections"), 1);
  source->Calibre = false;
  source->Axes = true;
  source->Modified();
  filter->SetAreaStrainLimit(0.5);
  filter->UpdateTimeStep(0.25);
  EXPECT_NEAR(Point(filter, "EllipseMajor"), 2.0 * MovingSource::Factor(0.25), 1e-12);
  EXPECT_NEAR(Point(filter, "EllipseMinor"), MovingSource::Factor(0.25), 1e-12);
  EXPECT_NEAR(Point(filter, "AreaStrain"), std::pow(1.02 / 0.98, 2) - 1.0, 1e-12);
}

TEST(CardiacPhaseInterpolator, OtherPointSets)
{
  vtkNew<MovingSource> source;
  source->Grid = true;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->UpdateTimeStep(0.4);
  auto* grid = vtkUnstructuredGrid::SafeDownCast(filter->GetOutputDataObject(0));
  ASSERT_NE(grid, nullptr);
  EXPECT_EQ(grid->GetNumberOfCells(), 1);
  EXPECT_NEAR(grid->GetPoint(3)[0], MovingSource::X(3, 0.4), 1e-6);
  EXPECT_EQ(grid->GetPoints()->GetDataType(), VTK_FLOAT);
}

TEST(CardiacPhaseInterpolator, ThePhantomsTreeAndInputStaysAsItIs)
{
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetCenterlineSpacing(4.0);
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort(1));
  filter->SetAreaStrainLimit(0.2);
  filter->UpdateTimeStep(0.3);
  vtkPointSet* output = Output(filter);
  ASSERT_GT(output->GetNumberOfPoints(), 100);
  const auto at = [&](double time)
  {
    source->GetOutputInformation(1)->Set(SDDP::UPDATE_TIME_STEP(), time);
    source->Update(1);
    return vtkPolyData::SafeDownCast(source->GetOutputDataObject(1));
  };
  vtkPolyData* truth = at(0.3);
  for (const char* name : { "Displacement", "MaximumInscribedSphereRadius", "Velocity" })
  {
    ASSERT_NE(truth->GetPointData()->GetArray(name), nullptr) << name;
    ASSERT_NE(output->GetPointData()->GetArray(name), nullptr) << name;
  }
  for (vtkIdType n = 0; n < truth->GetNumberOfPoints(); n += 17)
  {
    EXPECT_NEAR(truth->GetPoint(n)[2], output->GetPoint(n)[2], 0.1);
    const auto near = [&](const char* name, int component, double tolerance)
    {
      EXPECT_NEAR(truth->GetPointData()->GetArray(name)->GetComponent(n, component),
        output->GetPointData()->GetArray(name)->GetComponent(n, component), tolerance)
        << name;
    };
    near("Displacement", 2, 0.4);
    near("MaximumInscribedSphereRadius", 0, 0.01);
    near("Velocity", 2, 6.0);
  }
  EXPECT_EQ(output->GetCellData()->GetAbstractArray("SegmentLabel")->GetNumberOfTuples(),
    output->GetNumberOfCells());
  EXPECT_EQ(truth->GetFieldData()->GetArray("ClampedSections"), nullptr);
  EXPECT_EQ(truth->GetPointData()->GetArray("AreaStrain"), nullptr);
}

TEST(CardiacPhaseInterpolator, NothingAndOtherPieces)
{
  vtkNew<MovingSource> source;
  source->Points = 0;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  {
    Messages messages(filter);
    filter->UpdateTimeStep(0.3);
    EXPECT_TRUE(messages.Errors.empty());
    EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 0);
    vtkNew<vtkPolyData> nothing;
    vtkNew<Filter> still;
    still->SetInputData(nothing);
    Messages more(still);
    still->Update();
    EXPECT_TRUE(more.Errors.empty());
  }
  source->Points = 4;
  source->Modified();
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 0);
  filter->UpdatePiece(0, 2, 0);
  EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 4);
}

TEST(CardiacPhaseInterpolator, StopsAndGoesOn)
{
  vtkNew<MovingSource> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  UpdateAborted(filter);
  EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 0);
  filter->UpdateTimeStep(0.1);
  EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 6);
}

TEST(CardiacPhaseInterpolator, RefusesWithOneMessage)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  vtkNew<MovingSource> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  const auto refuse = [&](const std::string& part)
  {
    source->Modified();
    ExpectFilterError(filter, part);
    EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 0);
  };
  source->Steps = {};
  refuse("no time steps");
  source->Steps = { 0.3 };
  refuse("one time step");
  source->Steps = { 0.0, 0.5, 0.5 };
  refuse("do not increase strictly: time step 2 (0.5) follows time step 1 (0.5)");
  source->Steps = { 0.0, nan, 0.5 };
  refuse("time step 1 (nan) is not finite");
  source->Steps = { 0.0, 1.0, 2.0 };
  refuse("fewer than two different phases");
  source->Steps = { 0.0, 0.25, 0.5, 0.75 };
  source->SpoiledTime = 0.5;
  source->Spoil = MovingSource::Coordinate;
  refuse("a coordinate at phase 2 is not finite");
  source->Spoil = MovingSource::Count;
  refuse("7 points at time step 2 (0.5) and 6 at time step 0 (0)");
  source->Spoil = MovingSource::Lines;
  refuse("lines at time step 2 (0.5)");
  source->Confidence = true;
  source->Spoil = MovingSource::Absent;
  refuse("TrackingConfidence is not there at all time steps");
  source->Spoil = MovingSource::Components;
  refuse("TrackingConfidence of the input must have 1 component");
  source->Spoil = MovingSource::Fail;
  {
    Messages upstream(source);
    refuse("The input failed");
  }
  source->Spoil = MovingSource::Nothing;
  source->Modified();
  const auto setting = [&](const std::string& part, const auto& set, const auto& back)
  {
    set();
    ExpectFilterError(filter, part);
    back();
    Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.Errors.empty());
    EXPECT_EQ(Output(filter)->GetNumberOfPoints(), 6);
  };
  setting(
    "Mode must", [&] { filter->SetMode(5); }, [&] { filter->SetMode(1); });
  setting(
    "MergeTolerance must be", [&] { filter->SetMergeTolerance(0.5); },
    [&] { filter->SetMergeTolerance(0.01); });
  setting(
    "Period must be", [&] { filter->SetPeriod(0.0); }, [&] { filter->SetPeriod(1.0); });
  setting(
    "CycleLength must be", [&] { filter->SetCycleLength(nan); },
    [&] { filter->SetCycleLength(0.8); });
  setting(
    "AreaStrainLimit must be", [&] { filter->SetAreaStrainLimit(1.0); },
    [&] { filter->SetAreaStrainLimit(0.05); });
  setting(
    "Eccentricity must be", [&] { filter->SetEccentricity(1.0); },
    [&] { filter->SetEccentricity(0.0); });
  setting(
    "Steps must be", [&] { filter->SetSteps(4); }, [&] { filter->SetSteps(0); });
  setting(
    "NumberOfSteps must be", [&] { filter->SetNumberOfSteps(1); },
    [&] { filter->SetNumberOfSteps(5); });
  setting(
    "TimeRange must be", [&] { filter->SetTimeRange(1.0, 1.0); },
    [&] { filter->SetTimeRange(0.0, 1.0); });
  ExpectFilterError(filter, "time must be finite", [&] { filter->UpdateTimeStep(nan); });
  vtkNew<MovingSource> blocks;
  blocks->Blocks = true;
  vtkNew<Filter> other;
  other->SetInputConnection(blocks->GetOutputPort());
  ExpectFilterError(other, "composite");
}

TEST(CardiacPhaseInterpolator, SameBitsOnAnyNumberOfThreads)
{
  std::vector<double> results[2];
  for (const int threads : { 1, 3 })
  {
    coronary::SetNumberOfThreads(threads);
    vtkNew<MovingSource> source;
    source->Points = 30000;
    vtkNew<Filter> filter;
    filter->SetInputConnection(source->GetOutputPort());
    filter->SetModeToLowNoise();
    filter->UpdateTimeStep(0.33);
    auto* velocity =
      vtkDoubleArray::SafeDownCast(Output(filter)->GetPointData()->GetArray("Velocity"));
    results[threads == 3].assign(velocity->GetPointer(0), velocity->GetPointer(0) + 90000);
    EXPECT_GE(Field(filter, "LowNoiseFit", 0), 1.0);
  }
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(std::memcmp(results[0].data(), results[1].data(), 90000 * sizeof(double)), 0);
}

TEST(CardiacPhaseInterpolator, Printed)
{
  vtkNew<Filter> filter;
  filter->AddStep(0.125);
  std::ostringstream text;
  filter->Print(text);
  EXPECT_NE(text.str().find("ListedTimes: 0.125"), std::string::npos);
  EXPECT_NE(text.str().find("MergeTolerance: 0.01"), std::string::npos);
}
}
