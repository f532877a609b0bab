// vtkLumenCycle through the VTK pipeline: a stenosis that pulsates by a known factor, in images and in radii.
#include "vtkLumenCycle.h"

#include "FilterMessages.h"
#include "TimedTestSource.h"
#include "TubeImage.h"

#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkTable.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace TestLumenCycle
{
using coronary::TubeImage;

namespace
{
constexpr double Healthy = 1.8; // mm, radius
constexpr double Degree = 0.5;
constexpr double Middle = 30.0; // mm

double Pulse(double time)
{
  return 1.0 + 0.08 * std::sin(2.0 * M_PI * time);
}

double RadiusAt(double z, double time)
{
  return Healthy * Pulse(time) * (1.0 - Degree * std::exp(-0.5 * std::pow((z - Middle) / 3.4, 2)));
}

const std::vector<double> Times = { 0.0, 0.25, 0.75 };

/// Gated images of the tube.
class Beating : public TimedTestSource
{
public:
  static Beating* New();
  vtkTypeMacro(Beating, TimedTestSource);

protected:
  Beating() { this->Steps = Times; }
  vtkSmartPointer<vtkDataObject> NewOutput() override
  {
    return vtkSmartPointer<vtkImageData>::New();
  }
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override
  {
    vtkNew<vtkImageData> image;
    TubeImage::Render([](double) { return 1.0; }, image);
    outputs->GetInformationObject(0)->Set(
      vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), image->GetExtent(), 6);
    return this->Superclass::RequestInformation(request, inputs, outputs);
  }
  bool Make(double time, vtkDataObject* output) override
  {
    TubeImage::Render(
      [=](double z) { return RadiusAt(z, time); }, vtkImageData::SafeDownCast(output));
    return true;
  }
};
vtkStandardNewMacro(Beating);

/// Lines that know their radius at each phase; in the last one the tracker saw nothing beyond 45 mm.
class PulsatingLines : public TimedTestSource
{
public:
  static PulsatingLines* New();
  vtkTypeMacro(PulsatingLines, TimedTestSource);
  bool Lose = false;
  bool Change = false;

protected:
  PulsatingLines() { this->Steps = Times; }
  bool Make(double time, vtkDataObject* output) override
  {
    auto* lines = vtkPolyData::SafeDownCast(output);
    TubeImage::Centerline(Healthy, lines);
    vtkDataArray* radius = lines->GetPointData()->GetArray("MaximumInscribedSphereRadius");
    vtkNew<vtkIntArray> status;
    status->SetName("TrackingStatus");
    for (vtkIdType n = 0; n < lines->GetNumberOfPoints(); ++n)
    {
      const double z = lines->GetPoint(n)[2];
      radius->SetComponent(n, 0, RadiusAt(z, time));
      status->InsertNextValue(this->Lose && time > 0.5 && z > 45.0 ? 2 : 0);
    }
    lines->GetPointData()->AddArray(status);
    if (this->Change && time > 0.5)
    {
      vtkNew<vtkCellArray> half;
      half->InsertNextCell(120);
      for (vtkIdType n = 0; n < 120; ++n)
      {
        half->InsertCellPoint(n);
      }
      lines->SetLines(half);
    }
    return true;
  }
};
vtkStandardNewMacro(PulsatingLines);

vtkTable* Table(vtkLumenCycle* filter, int port)
{
  return vtkTable::SafeDownCast(filter->GetOutputDataObject(port));
}

double Cell(vtkTable* table, vtkIdType row, const char* column)
{
  vtkAbstractArray* array = table->GetColumnByName(column);
  EXPECT_NE(array, nullptr) << column;
  return array != nullptr ? table->GetValueByName(row, column).ToDouble() : 0.0;
}
}

TEST(LumenCycle, RadiiOfTheLinesAsTheyAre)
{
  vtkNew<PulsatingLines> lines;
  vtkNew<vtkLumenCycle> filter;
  filter->SetInputConnection(lines->GetOutputPort());
  filter->Update();
  vtkTable* profile = Table(filter, vtkLumenCycle::ProfilePort);
  ASSERT_EQ(profile->GetNumberOfRows(), 241);
  for (vtkIdType row = 0; row < 241; row += 8)
  {
    const double z = 0.25 * double(row);
    EXPECT_NEAR(Cell(profile, row, "Position"), z, 1e-9);
    EXPECT_NEAR(Cell(profile, row, "0 %"), 2.0 * RadiusAt(z, 0.0), 1e-9);
    EXPECT_NEAR(Cell(profile, row, "25 %"), 2.0 * RadiusAt(z, 0.25), 1e-9);
    EXPECT_NEAR(Cell(profile, row, "75 %"), 2.0 * RadiusAt(z, 0.75), 1e-9);
    EXPECT_NEAR(Cell(profile, row, "Least"), 2.0 * RadiusAt(z, 0.75), 1e-9);
    EXPECT_NEAR(Cell(profile, row, "Median"), 2.0 * RadiusAt(z, 0.0), 1e-9);
    EXPECT_NEAR(Cell(profile, row, "Greatest"), 2.0 * RadiusAt(z, 0.25), 1e-9);
    EXPECT_NEAR(Cell(profile, row, "Area"), M_PI * std::pow(RadiusAt(z, 0.0), 2), 1e-9);
  }
  EXPECT_NEAR(Cell(profile, 120, "Stenosis"), 100.0 * Degree, 4.0);
  EXPECT_NEAR(Cell(profile, 120, "Healthy"), 2.0 * Healthy, 0.1);

  vtkTable* lesions = Table(filter, vtkLumenCycle::LesionPort);
  ASSERT_EQ(lesions->GetNumberOfRows(), 1);
  EXPECT_EQ(lesions->GetValueByName(0, "Vessel").ToString(), "mLAD");
  EXPECT_NEAR(Cell(lesions, 0, "Position"), Middle, 1.0);
  EXPECT_NEAR(Cell(lesions, 0, "Z"), Middle, 1.0);
  EXPECT_NEAR(Cell(lesions, 0, "Stenosis"), 100.0 * Degree, 4.0);
  EXPECT_NEAR(Cell(lesions, 0, "AreaStenosis"), 75.0, 4.0);
  EXPECT_EQ(Cell(lesions, 0, "Phases"), 3.0);
  EXPECT_NEAR(Cell(lesions, 0, "Pulsation"), 100.0 * (1.08 / 0.92 - 1.0), 0.1);

  auto* map = vtkPolyData::SafeDownCast(filter->GetOutputDataObject(vtkLumenCycle::MapPort));
  ASSERT_EQ(map->GetNumberOfPoints(), 3 * 241);
  EXPECT_EQ(map->GetNumberOfPolys(), 2 * 240);
  vtkDataArray* diameter = map->GetPointData()->GetArray("Diameter");
  vtkDataArray* area = map->GetPointData()->GetArray("Area");
  for (vtkIdType n = 0; n < map->GetNumberOfPoints(); n += 13)
  {
    const double* place = map->GetPoint(n);
    EXPECT_NEAR(diameter->GetTuple1(n), 2.0 * RadiusAt(place[0], place[1] / 100.0), 1e-9);
    EXPECT_NEAR(area->GetTuple1(n), M_PI * std::pow(0.5 * diameter->GetTuple1(n), 2), 1e-9);
  }
}

TEST(LumenCycle, ImagesAreMeasuredAtEachPhase)
{
  vtkNew<Beating> images;
  vtkNew<vtkPolyData> lines;
  TubeImage::Centerline(Healthy, lines);
  vtkNew<vtkLumenCycle> filter;
  filter->SetInputData(lines);
  filter->SetImageConnection(images->GetOutputPort());
  filter->Update();
  vtkTable* profile = Table(filter, vtkLumenCycle::ProfilePort);
  const char* columns[] = { "0 %", "25 %", "75 %" };
  for (vtkIdType row = 24; row < 216; row += 8)
  {
    for (std::size_t k = 0; k < 3; ++k)
    {
      // As well as single sections can be measured: 0.4 mm of blur, half of it in the narrowing.
      EXPECT_NEAR(Cell(profile, row, columns[k]), 2.0 * RadiusAt(0.25 * double(row), Times[k]), 0.2)
        << row << ' ' << columns[k];
    }
  }
  vtkTable* lesions = Table(filter, vtkLumenCycle::LesionPort);
  ASSERT_EQ(lesions->GetNumberOfRows(), 1);
  EXPECT_NEAR(Cell(lesions, 0, "Stenosis"), 100.0 * Degree, 5.0);
  EXPECT_NEAR(Cell(lesions, 0, "Position"), Middle, 1.0);
  EXPECT_NEAR(Cell(lesions, 0, "Pulsation"), 100.0 * (1.08 / 0.92 - 1.0), 5.0);
  EXPECT_LE(Cell(lesions, 0, "Low"), 100.0 * Degree);
  EXPECT_GE(Cell(lesions, 0, "High"), 100.0 * Degree);

  // Another vessel's name, or another time, reads nothing again.
  const int executions = images->Executions;
  filter->SetVessel("LAD");
  filter->UpdateTimeStep(0.25);
  auto* tree = vtkPolyData::SafeDownCast(filter->GetOutputDataObject(vtkLumenCycle::TreePort));
  EXPECT_NEAR(tree->GetPointData()->GetArray("Diameter")->GetTuple1(40), 2.0 * Healthy * 1.08, 0.2);
  filter->UpdateTimeStep(0.75);
  EXPECT_NEAR(tree->GetPointData()->GetArray("Diameter")->GetTuple1(40), 2.0 * Healthy * 0.92, 0.2);
  EXPECT_EQ(filter->GetNumberOfMeasurements(), 1);
  EXPECT_EQ(images->Executions, executions);
}

TEST(LumenCycle, WhatTheTrackerLostIsNotKnown)
{
  vtkNew<PulsatingLines> lines;
  lines->Lose = true;
  vtkNew<vtkLumenCycle> filter;
  filter->SetInputConnection(lines->GetOutputPort());
  filter->Update();
  vtkTable* profile = Table(filter, vtkLumenCycle::ProfilePort);
  EXPECT_TRUE(std::isnan(Cell(profile, 200, "75 %"))); // 50 mm
  EXPECT_FALSE(std::isnan(Cell(profile, 200, "25 %")));
  EXPECT_FALSE(std::isnan(Cell(profile, 160, "75 %")));
  EXPECT_NEAR(Cell(profile, 200, "Least"), 2.0 * RadiusAt(50.0, 0.0), 1e-9);
}

TEST(LumenCycle, LinesWithoutTimeHaveOnePhase)
{
  vtkNew<vtkPolyData> lines;
  TubeImage::Centerline(Healthy, lines);
  vtkNew<vtkLumenCycle> filter;
  filter->SetInputData(lines);
  filter->Update();
  vtkTable* profile = Table(filter, vtkLumenCycle::ProfilePort);
  EXPECT_NEAR(Cell(profile, 10, "Diameter"), 2.0 * Healthy, 1e-12);
  EXPECT_EQ(Table(filter, vtkLumenCycle::LesionPort)->GetNumberOfRows(), 0);
  EXPECT_NE(Table(filter, vtkLumenCycle::LesionPort)->GetColumnByName("WorstStenosis"), nullptr);
}

TEST(LumenCycle, RefusesInOneSentence)
{
  vtkNew<Beating> images;
  vtkNew<vtkPolyData> lines;
  TubeImage::Centerline(Healthy, lines);
  lines->GetFieldData()->Initialize();
  vtkNew<vtkLumenCycle> filter;
  filter->SetInputData(lines);
  filter->SetImageConnection(images->GetOutputPort());
  ExpectFilterError(filter, "ImageBlur");
  EXPECT_EQ(Table(filter, 0)->GetNumberOfRows(), 0);
  filter->SetBlur(-1.0);
  ExpectFilterError(filter, "Blur must be");
  filter->SetBlur(0.4);
  filter->SetVessel("Aorta");
  ExpectFilterError(filter, "'Aorta'; it has mLAD");
  filter->SetVessel("");
  filter->SetImageArrayName("Missing");
  ExpectFilterError(filter, "'Missing'");
  filter->SetImageArrayName("");
  filter->Update();
  EXPECT_EQ(Table(filter, 0)->GetNumberOfRows(), 241);

  vtkNew<PulsatingLines> changing;
  changing->Change = true;
  vtkNew<vtkLumenCycle> other;
  other->SetInputConnection(changing->GetOutputPort());
  ExpectFilterError(other, "not those of the first phase");
}
}
