// vtkMotionRegularizer through the VTK pipeline: read and solved once, arrays, rest, refusals.
#include "vtkMotionRegularizer.h"

#include "FilterMessages.h"
#include "ParallelFor.h"
#include "SkeletonTestData.h"
#include "TimedTestSource.h"
#include "vtkCardiacPhaseInterpolator.h"

#include "vtkIdTypeArray.h"
#include "vtkMultiBlockDataSet.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <sstream>
#include <vector>

namespace TestMotionRegularizer
{
using SDDP = vtkStreamingDemandDrivenPipeline;
using Filter = vtkMotionRegularizer;

namespace
{
constexpr double Pi = 3.14159265358979323846;

/// A line of ten points that swings, with a spike at one of them at time 0.4.
class SwingingLine : public TimedTestSource
{
public:
  static SwingingLine* New();
  vtkTypeMacro(SwingingLine, TimedTestSource);

  vtkIdType Points = 10;
  double Spike = 9.0;
  bool Bones = false;
  bool Vertex = false;
  bool Confidence = true;

  static double Z(vtkIdType n, double t)
  {
    return 0.02 * static_cast<double>(n * n) * std::cos(2.0 * Pi * t);
  }

protected:
  SwingingLine() { this->Steps = { 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9 }; }

  bool Make(double time, vtkDataObject* data) override
  {
    auto* output = vtkPolyData::SafeDownCast(data);
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkCellArray> lines;
    vtkNew<vtkDoubleArray> confidence;
    confidence->SetName("TrackingConfidence");
    vtkNew<vtkIntArray> step;
    step->SetName("Step");
    vtkNew<vtkDoubleArray> way;
    way->SetName("Displacement");
    way->SetNumberOfComponents(3);
    vtkNew<vtkDoubleArray> rotation;
    rotation->SetName("BoneRotation");
    rotation->SetNumberOfComponents(4);
    std::vector<vtkIdType> ids;
    for (vtkIdType n = 0; n < this->Points; ++n)
    {
      const bool spike = n == 5 && time == 0.4;
      points->InsertNextPoint(4.0 * n, spike ? this->Spike : 0.0, Z(n, time));
      confidence->InsertNextValue(spike ? 0.0 : 1.0);
      step->InsertNextValue(static_cast<int>(std::lround(10.0 * time)));
      way->InsertNextTuple3(0.0, spike ? this->Spike : 0.0, Z(n, time));
      ids.push_back(n);
      if (this->Bones && n > 0)
      {
        lines->InsertNextCell(2, &ids[static_cast<std::size_t>(n) - 1]);
        rotation->InsertNextTuple4(1.0, 0.0, 0.0, 0.0);
      }
    }
    if (!this->Bones && this->Points > 0)
    {
      lines->InsertNextCell(static_cast<vtkIdType>(ids.size()), ids.data());
    }
    output->SetPoints(points);
    output->SetLines(lines);
    if (this->Vertex)
    {
      vtkNew<vtkCellArray> vertices;
      vertices->InsertNextCell(1, ids.data());
      output->SetVerts(vertices);
    }
    if (this->Confidence)
    {
      output->GetPointData()->AddArray(confidence);
    }
    output->GetPointData()->AddArray(step);
    output->GetPointData()->AddArray(way);
    if (this->Bones)
    {
      output->GetCellData()->AddArray(rotation);
    }
    return true;
  }
};
vtkStandardNewMacro(SwingingLine);

double Field(vtkAlgorithm* filter, const char* name, vtkIdType n = 0)
{
  vtkDataArray* array = filter->GetOutputDataObject(0)->GetFieldData()->GetArray(name);
  return array && n < array->GetNumberOfValues() ? array->GetVariantValue(n).ToDouble()
                                                 : std::numeric_limits<double>::quiet_NaN();
}

double Point(vtkPolyDataAlgorithm* filter, const char* name, vtkIdType n, int component = 0)
{
  vtkDataArray* array = filter->GetOutput()->GetPointData()->GetArray(name);
  return array ? array->GetComponent(n, component) : std::numeric_limits<double>::quiet_NaN();
}
}

TEST(MotionRegularizer, SolvesOnceAndAnswersEveryStep)
{
  vtkNew<SwingingLine> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  for (const double time : { 0.4, 0.0, 0.9, 0.4, 0.41 })
  {
    filter->UpdateTimeStep(time);
    EXPECT_EQ(source->Executions, 10);
    EXPECT_EQ(filter->GetNumberOfSolutions(), 1);
    const double step = 0.1 * std::round(10.0 * time);
    EXPECT_NEAR(Field(filter, "PhaseTime"), step, 1e-12);
    EXPECT_NEAR(filter->GetOutput()->GetPoint(9)[2], SwingingLine::Z(9, step), 0.1);
    // Other arrays are those of the step.
    EXPECT_EQ(Point(filter, "Step", 3), std::lround(10.0 * step));
  }
  // The spike is gone, and what was done is said.
  EXPECT_NEAR(filter->GetOutput()->GetPoint(5)[1], 0.0, 0.2);
  EXPECT_NEAR(Point(filter, "RegularizationMove", 5, 1), -9.0, 0.2);
  // The way from rest is that of the point.
  EXPECT_NEAR(Point(filter, "Displacement", 5, 1), filter->GetOutput()->GetPoint(5)[1], 1e-9);
  EXPECT_NE(static_cast<int>(Point(filter, "MotionClamps", 5)) & 4, 0);
  EXPECT_EQ(Point(filter, "MotionClamps", 1), 0);
  EXPECT_GT(Field(filter, "TemporalEnergy", 0), Field(filter, "TemporalEnergy", 1));
  EXPECT_GT(Field(filter, "SpatialEnergy", 0), Field(filter, "SpatialEnergy", 1));
  EXPECT_GT(Field(filter, "MotionObjective", 0), Field(filter, "MotionObjective", 1));
  EXPECT_NEAR(Field(filter, "TotalEnergy", 1),
    0.005 * Field(filter, "TemporalEnergy", 1) + 0.1 * Field(filter, "SpatialEnergy", 1), 1e-9);
  EXPECT_GT(Field(filter, "ClampedPoints", 2), 0);
  EXPECT_EQ(Field(filter, "LimitViolations"), 0);
  EXPECT_NEAR(Field(filter, "MaximumMove"), 9.0, 0.2);
  // Other weights: solved again, not read again.
  filter->SetSpatialWeight(0.2);
  filter->UpdateTimeStep(0.4);
  EXPECT_EQ(filter->GetNumberOfSolutions(), 2);
  EXPECT_EQ(source->Executions, 10);
  filter->UpdateInformation();
  EXPECT_EQ(filter->GetOutputInformation(0)->Length(SDDP::TIME_STEPS()), 10);
}

TEST(MotionRegularizer, InputStaysAsItIs)
{
  vtkNew<SwingingLine> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->UpdateTimeStep(0.4);
  source->UpdateTimeStep(0.4);
  EXPECT_EQ(source->GetPolyDataOutput()->GetPoint(5)[1], 9.0);
  EXPECT_EQ(source->GetPolyDataOutput()->GetPointData()->GetNumberOfArrays(), 3);
  EXPECT_EQ(source->GetPolyDataOutput()->GetFieldData()->GetNumberOfArrays(), 0);
  EXPECT_EQ(source->GetPolyDataOutput()->GetCellData()->GetNumberOfArrays(), 0);
}

TEST(MotionRegularizer, StrainAndStressAgainstRest)
{
  vtkNew<SwingingLine> source;
  source->Bones = true;
  source->Spike = 0.0;
  vtkNew<vtkPolyData> rest;
  source->UpdateTimeStep(0.0);
  rest->DeepCopy(source->GetPolyDataOutput());
  for (vtkIdType n = 0; n < 10; ++n)
  {
    rest->GetPoints()->SetPoint(n, 3.6 * n, 0.0, 0.0);
  }
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->SetInputData(1, rest);
  filter->SetYoungsModulus(2.0);
  filter->UpdateTimeStep(0.3);
  vtkDataArray* strain = filter->GetOutput()->GetCellData()->GetArray("AxialStrain");
  vtkDataArray* stress = filter->GetOutput()->GetCellData()->GetArray("AxialStress");
  ASSERT_TRUE(strain && stress);
  ASSERT_EQ(strain->GetNumberOfTuples(), 9);
  EXPECT_NEAR(strain->GetComponent(0, 0), 4.0 / 3.6 - 1.0, 2e-3);
  EXPECT_NEAR(stress->GetComponent(0, 0), 2.0 * strain->GetComponent(0, 0), 1e-12);
  ASSERT_NE(filter->GetOutput()->GetCellData()->GetArray("BoneRotation"), nullptr);
  // Another rest: solved again. Another skeleton: refused.
  rest->GetPoints()->SetPoint(1, 3.0, 0.0, 0.0);
  rest->GetPoints()->Modified();
  rest->Modified();
  filter->UpdateTimeStep(0.3);
  EXPECT_EQ(filter->GetNumberOfSolutions(), 2);
  vtkNew<vtkPolyData> other;
  other->DeepCopy(rest);
  vtkNew<vtkCellArray> lines;
  const vtkIdType ids[2] = { 0, 2 };
  lines->InsertNextCell(2, ids);
  other->SetLines(lines);
  filter->SetInputData(1, other);
  ExpectFilterError(filter, "lines at rest are not those of the input");
}

TEST(MotionRegularizer, TheInterpolatorFollows)
{
  vtkNew<SwingingLine> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  vtkNew<vtkCardiacPhaseInterpolator> moment;
  moment->SetInputConnection(filter->GetOutputPort());
  for (const double time : { 0.43, 1.43, -0.3 })
  {
    moment->UpdateTimeStep(time);
    EXPECT_NEAR(moment->GetPolyDataOutput()->GetPoint(9)[2], SwingingLine::Z(9, time), 0.05);
    EXPECT_NEAR(moment->GetPolyDataOutput()->GetPoint(5)[1], 0.0, 0.2);
  }
  EXPECT_EQ(source->Executions, 10);
  EXPECT_EQ(filter->GetNumberOfSolutions(), 1);
  EXPECT_EQ(moment->GetNumberOfReads(), 1);
}

TEST(MotionRegularizer, NothingAndOtherPieces)
{
  vtkNew<SwingingLine> source;
  source->Points = 0;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  {
    Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.Errors.empty());
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  }
  source->Points = 10;
  source->Modified();
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  filter->UpdatePiece(0, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 10);
}

TEST(MotionRegularizer, StopsAndGoesOn)
{
  vtkNew<SwingingLine> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  UpdateAborted(filter);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  filter->UpdateTimeStep(0.1);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 10);
}

TEST(MotionRegularizer, SameBitsOnAnyNumberOfThreads)
{
  std::vector<double> results[2];
  for (const int threads : { 1, 3 })
  {
    coronary::SetNumberOfThreads(threads);
    vtkNew<SwingingLine> source;
    source->Points = 300;
    vtkNew<Filter> filter;
    filter->SetInputConnection(source->GetOutputPort());
    filter->UpdateTimeStep(0.4);
    auto* points = vtkDoubleArray::SafeDownCast(filter->GetOutput()->GetPoints()->GetData());
    results[threads == 3].assign(points->GetPointer(0), points->GetPointer(0) + 900);
  }
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(std::memcmp(results[0].data(), results[1].data(), 900 * sizeof(double)), 0);
}

TEST(MotionRegularizer, RefusesWithOneMessage)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  vtkNew<SwingingLine> source;
  vtkNew<Filter> filter;
  filter->SetInputConnection(source->GetOutputPort());
  const std::vector<double> good = source->Steps;
  const auto refuse = [&](const std::string& part)
  {
    source->Modified();
    ExpectFilterError(filter, part);
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  };
  source->Steps = {};
  refuse("no time steps");
  source->Steps = { 0.5 };
  refuse("one time step");
  source->Steps = { 0.5, 0.4 };
  refuse("do not increase strictly");
  source->Steps = good;
  source->Spike = nan;
  refuse("a coordinate at phase 4 is not finite");
  source->Spike = 1.0;
  source->Vertex = true;
  refuse("cells that are no lines");
  source->Vertex = false;
  source->Modified();
  const auto setting = [&](const std::string& part, const auto& set, const auto& back)
  {
    set();
    ExpectFilterError(filter, part);
    back();
    Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.Errors.empty());
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 10);
  };
  setting(
    "Energy must", [&] { filter->SetEnergy(3); }, [&] { filter->SetEnergy(0); });
  setting(
    "TemporalWeight must", [&] { filter->SetTemporalWeight(-1); },
    [&] { filter->SetTemporalWeight(0.005); });
  setting(
    "SpatialWeight must", [&] { filter->SetSpatialWeight(nan); },
    [&] { filter->SetSpatialWeight(0.1); });
  setting(
    "VelocityWeight must", [&] { filter->SetVelocityWeight(-1); },
    [&] { filter->SetVelocityWeight(0); });
  setting(
    "MaximumBending must", [&] { filter->SetMaximumBending(181); },
    [&] { filter->SetMaximumBending(180); });
  setting(
    "MinimumCurvatureRadius must", [&] { filter->SetMinimumCurvatureRadius(-1); },
    [&] { filter->SetMinimumCurvatureRadius(0); });
  setting(
    "MaximumStrain must", [&] { filter->SetMaximumStrain(0.95); },
    [&] { filter->SetMaximumStrain(0); });
  setting(
    "MaximumStep must", [&] { filter->SetMaximumStep(-1); }, [&] { filter->SetMaximumStep(0); });
  setting(
    "WellTracked must", [&] { filter->SetWellTracked(2); }, [&] { filter->SetWellTracked(0.8); });
  setting(
    "Tolerance must", [&] { filter->SetTolerance(-1); }, [&] { filter->SetTolerance(0.3); });
  setting(
    "YoungsModulus must", [&] { filter->SetYoungsModulus(0); },
    [&] { filter->SetYoungsModulus(1.5); });
  setting(
    "Precision must", [&] { filter->SetPrecision(0); }, [&] { filter->SetPrecision(0.01); });
  setting(
    "Iterations must", [&] { filter->SetIterations(0); }, [&] { filter->SetIterations(10); });
  setting(
    "Period must", [&] { filter->SetPeriod(nan); }, [&] { filter->SetPeriod(1); });
  setting(
    "ReferenceTime must", [&] { filter->SetReferenceTime(nan); },
    [&] { filter->SetReferenceTime(0.75); });
  ExpectFilterError(filter, "time must be finite", [&] { filter->UpdateTimeStep(nan); });
  vtkNew<vtkMultiBlockDataSet> blocks;
  vtkNew<vtkPolyData> block;
  blocks->SetBlock(0, block);
  vtkNew<Filter> other;
  other->SetInputDataObject(0, blocks);
  ExpectFilterError(other, "composite");
}

TEST(MotionRegularizer, Printed)
{
  vtkNew<Filter> filter;
  std::ostringstream text;
  filter->Print(text);
  EXPECT_NE(text.str().find("YoungsModulus: 1.55"), std::string::npos);
}
}
