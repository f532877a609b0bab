// vtkReferencePhase: static from here on, whatever the time does; the given and the quietest phase.
#include "vtkReferencePhase.h"

#include "CoronaryPhantom.h"
#include "QuietestPhase.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkFrangiVesselness.h"

#include "vtkCallbackCommand.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPassInputTypeAlgorithm.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkTable.h"
#include "vtkTableAlgorithm.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace TestReferencePhase
{
using Source = vtkCoronaryPhantomSource;
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace
{
/// Passes its input on, and counts how often.
class Counter : public vtkPassInputTypeAlgorithm
{
public:
  static Counter* New();
  vtkTypeMacro(Counter, vtkPassInputTypeAlgorithm);
  int Executions = 0;

protected:
  int FillInputPortInformation(int, vtkInformation* info) override
  {
    info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkDataObject");
    return 1;
  }
  int RequestData(
    vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override
  {
    ++this->Executions;
    vtkDataObject::GetData(outputs)->ShallowCopy(vtkDataObject::GetData(inputs[0]));
    return 1;
  }
};
vtkStandardNewMacro(Counter);

/// A table in time.
class TableSeries : public vtkTableAlgorithm
{
public:
  static TableSeries* New();
  vtkTypeMacro(TableSeries, vtkTableAlgorithm);
  bool Steps = true;

protected:
  TableSeries() { this->SetNumberOfInputPorts(0); }
  int RequestInformation(
    vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    const double steps[] = { 0.0, 0.5, 1.0 };
    const double range[] = { 0.0, 1.0 };
    vtkInformation* info = outputs->GetInformationObject(0);
    if (this->Steps)
    {
      info->Set(SDDP::TIME_STEPS(), steps, 3);
    }
    else
    {
      info->Remove(SDDP::TIME_STEPS());
    }
    info->Set(SDDP::TIME_RANGE(), range, 2);
    return 1;
  }
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    vtkNew<vtkDoubleArray> time;
    time->SetName("time");
    time->InsertNextValue(info->Get(SDDP::UPDATE_TIME_STEP()));
    vtkTable::GetData(info)->AddColumn(time);
    return 1;
  }
};
vtkStandardNewMacro(TableSeries);

vtkSmartPointer<Source> MakeSource()
{
  auto source = vtkSmartPointer<Source>::New();
  source->AutomaticGridOff();
  source->SetOrigin(-30.0, -35.0, -40.0);
  source->SetDimensions(40, 42, 36);
  source->SetSpacing(1.5, 1.5, 1.5);
  source->SetSurfaceSpacing(1.5);
  source->SetCenterlineSpacing(2.0);
  return source;
}

std::vector<double> Field(vtkDataObject* data, const char* name)
{
  auto* array = vtkDoubleArray::SafeDownCast(data->GetFieldData()->GetArray(name));
  return array
    ? std::vector<double>(array->GetPointer(0), array->GetPointer(0) + array->GetNumberOfValues())
    : std::vector<double>();
}

std::vector<std::string> ErrorsOf(vtkAlgorithm* algorithm)
{
  std::vector<std::string> messages;
  vtkNew<vtkCallbackCommand> observer;
  observer->SetClientData(&messages);
  observer->SetCallback([](vtkObject*, unsigned long, void* list, void* text)
    { static_cast<std::vector<std::string>*>(list)->emplace_back(static_cast<char*>(text)); });
  vtkNew<vtkCallbackCommand> echoes;
  echoes->SetCallback([](vtkObject*, unsigned long, void*, void*) {});
  const unsigned long tag = algorithm->AddObserver(vtkCommand::ErrorEvent, observer);
  const unsigned long echo = algorithm->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, echoes);
  algorithm->Update();
  algorithm->RemoveObserver(tag);
  algorithm->GetExecutive()->RemoveObserver(echo);
  return messages;
}
}

TEST(ReferencePhase, NothingAfterItExecutesWhenTheTimeMoves)
{
  const auto source = MakeSource();
  vtkNew<Counter> moving;
  moving->SetInputConnection(source->GetOutputPort(Source::ImagePort));
  vtkNew<vtkReferencePhase> phase;
  phase->AutomaticOff();
  phase->SetTime(0.7);
  phase->SetInputConnection(source->GetOutputPort(Source::ImagePort));
  vtkNew<Counter> still;
  still->SetInputConnection(phase->GetOutputPort());
  vtkNew<vtkFrangiVesselness> vesselness;
  vesselness->SetInputConnection(still->GetOutputPort());
  vesselness->SetSigmaMin(1.0);
  vesselness->SetNumberOfScales(1);
  vtkNew<Counter> after;
  after->SetInputConnection(vesselness->GetOutputPort());

  after->UpdateInformation();
  EXPECT_FALSE(after->GetOutputInformation(0)->Has(SDDP::TIME_STEPS()));
  EXPECT_FALSE(after->GetOutputInformation(0)->Has(SDDP::TIME_RANGE()));
  vtkSmartPointer<vtkDataArray> first;
  for (int round = 0; round < 5; ++round)
  {
    const double time = 0.1 + 0.15 * round;
    // Both branches, as a render view does with the time slider.
    moving->UpdateTimeStep(time);
    after->UpdateTimeStep(time);
    auto* image = vtkImageData::SafeDownCast(after->GetOutputDataObject(0));
    vtkDataArray* values = image->GetPointData()->GetScalars();
    first = first ? first : vtkSmartPointer<vtkDataArray>(values);
    EXPECT_EQ(values, first);
  }
  EXPECT_EQ(moving->Executions, 5);
  EXPECT_EQ(still->Executions, 1);
  EXPECT_EQ(after->Executions, 1);
  // Of the paper's steps of 5.84 % the nearest to 0.7.
  const std::vector<double> steps = coronary::PaperPhases();
  const double nearest = *std::min_element(steps.begin(), steps.end(),
    [](double a, double b) { return std::abs(a - 0.7) < std::abs(b - 0.7); });
  EXPECT_EQ(phase->GetUsedTime(), nearest);
  EXPECT_EQ(Field(after->GetOutputDataObject(0), "PhaseTime"), std::vector<double>{ nearest });
  EXPECT_EQ(Field(after->GetOutputDataObject(0), "CycleLength"), std::vector<double>{ 0.8 });

  // The same voxels as the source's at that time.
  auto* kept = vtkImageData::SafeDownCast(phase->GetOutputDataObject(0));
  source->UpdateInformation();
  source->GetOutputInformation(0)->Set(SDDP::UPDATE_TIME_STEP(), nearest);
  source->Update(Source::ImagePort);
  auto* fresh = vtkImageData::SafeDownCast(source->GetOutputDataObject(Source::ImagePort));
  ASSERT_EQ(kept->GetNumberOfPoints(), fresh->GetNumberOfPoints());
  for (vtkIdType n = 0; n < fresh->GetNumberOfPoints(); ++n)
  {
    ASSERT_EQ(kept->GetPointData()->GetScalars()->GetComponent(n, 0),
      fresh->GetPointData()->GetScalars()->GetComponent(n, 0));
  }

  // A change upstream, or of the time, does execute.
  phase->SetTime(0.3);
  after->Update();
  EXPECT_EQ(after->Executions, 2);
  source->SetNoise(0.0);
  after->Update();
  EXPECT_EQ(after->Executions, 3);
}

TEST(ReferencePhase, WorksForEveryKindOfData)
{
  const auto source = MakeSource();
  for (const int port : { Source::ImagePort, Source::TreePort, Source::SurfacePort })
  {
    vtkNew<vtkReferencePhase> phase;
    phase->AutomaticOff();
    phase->SetTime(0.3);
    phase->SetInputConnection(source->GetOutputPort(port));
    phase->Update();
    EXPECT_STREQ(phase->GetOutputDataObject(0)->GetClassName(),
      source->GetOutputDataObject(port)->GetClassName());
    EXPECT_EQ(Field(phase->GetOutputDataObject(0), "PhaseTime"),
      std::vector<double>{ phase->GetUsedTime() });
  }

  // A table has no PhaseTime of its own: it is added, but not to the input's.
  vtkNew<TableSeries> table;
  vtkNew<vtkReferencePhase> phase;
  phase->AutomaticOff();
  phase->SetTime(0.45);
  phase->SetInputConnection(table->GetOutputPort());
  phase->Update();
  auto* output = vtkTable::SafeDownCast(phase->GetOutputDataObject(0));
  EXPECT_EQ(output->GetValueByName(0, "time").ToDouble(), 0.5);
  EXPECT_EQ(Field(output, "PhaseTime"), std::vector<double>{ 0.5 });
  EXPECT_FALSE(table->GetOutput()->GetFieldData()->HasArray("PhaseTime"));
  // Without steps, but a range: the time itself.
  table->Steps = false;
  table->Modified();
  phase->Update();
  EXPECT_EQ(
    vtkTable::SafeDownCast(phase->GetOutputDataObject(0))->GetValueByName(0, "time").ToDouble(),
    0.45);

  // No time at all, and composite data.
  vtkNew<vtkMultiBlockDataSet> blocks;
  vtkNew<vtkPolyData> block;
  blocks->SetBlock(0, block);
  vtkNew<vtkReferencePhase> still;
  still->SetInputDataObject(blocks);
  still->Update();
  auto* passed = vtkMultiBlockDataSet::SafeDownCast(still->GetOutputDataObject(0));
  ASSERT_NE(passed, nullptr);
  EXPECT_EQ(passed->GetNumberOfBlocks(), 1u);
  EXPECT_TRUE(std::isnan(still->GetUsedTime()));
  EXPECT_FALSE(passed->GetFieldData()->HasArray("PhaseTime"));
}

TEST(ReferencePhase, SaysWhatIsNotAvailable)
{
  const auto source = MakeSource();
  vtkNew<vtkReferencePhase> phase;
  phase->AutomaticOff();
  phase->SetTime(coronary::PaperPhases()[7] + 0.01);
  phase->SetInputConnection(source->GetOutputPort(Source::TreePort));
  EXPECT_TRUE(ErrorsOf(phase).empty());
  EXPECT_EQ(phase->GetUsedTime(), coronary::PaperPhases()[7]);

  phase->SetTime(std::numeric_limits<double>::quiet_NaN());
  std::vector<std::string> errors = ErrorsOf(phase);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("Time must be finite"), std::string::npos);

  vtkNew<TableSeries> table;
  vtkNew<vtkReferencePhase> ofTable;
  ofTable->SetInputConnection(table->GetOutputPort());
  errors = ErrorsOf(ofTable);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("vtkTable"), std::string::npos) << errors[0];
  table->Steps = false;
  table->Modified();
  errors = ErrorsOf(ofTable);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("time steps"), std::string::npos) << errors[0];
}

TEST(ReferencePhase, FindsTheQuietestPhase)
{
  for (const int seed : { 1, 2, 3, 4, 5 })
  {
    SCOPED_TRACE(seed);
    const auto source = MakeSource();
    source->SetSeed(seed);
    source->UpdateInformation();
    // How fast the tree moves at each step, from the phantom's own velocities.
    const std::vector<double> steps = coronary::PaperPhases();
    std::vector<double> speed;
    for (const double step : steps)
    {
      source->GetOutputInformation(Source::TreePort)->Set(SDDP::UPDATE_TIME_STEP(), step);
      source->Update(Source::TreePort);
      auto* tree = vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::TreePort));
      double sum = 0.0;
      for (vtkIdType n = 0; n < tree->GetNumberOfPoints(); ++n)
      {
        double velocity[3];
        tree->GetPointData()->GetArray("Velocity")->GetTuple(n, velocity);
        sum += std::hypot(velocity[0], velocity[1], velocity[2]);
      }
      speed.push_back(sum / static_cast<double>(tree->GetNumberOfPoints()));
    }
    for (const int port : { Source::ImagePort, Source::TreePort })
    {
      vtkNew<vtkReferencePhase> phase;
      phase->SetInputConnection(source->GetOutputPort(port));
      phase->Update();
      const auto found = std::find(steps.begin(), steps.end(), phase->GetUsedTime());
      ASSERT_NE(found, steps.end());
      const double slowest = *std::min_element(speed.begin(), speed.end());
      const double fastest = *std::max_element(speed.begin(), speed.end());
      const double chosen = speed[static_cast<std::size_t>(found - steps.begin())];
      EXPECT_LT(chosen, slowest + 0.1 * (fastest - slowest))
        << "port " << port << ": " << *found << ", speeds " << slowest << " to " << fastest;
      EXPECT_EQ(Field(phase->GetOutputDataObject(0), "PhaseTime"), std::vector<double>{ *found });
    }
  }
}

TEST(ReferencePhase, LooksForTheQuietestPhaseOnce)
{
  const auto source = MakeSource();
  vtkNew<Counter> counter;
  counter->SetInputConnection(source->GetOutputPort(Source::ImagePort));
  vtkNew<vtkReferencePhase> phase;
  phase->SetInputConnection(counter->GetOutputPort());
  phase->Update();
  const double found = phase->GetUsedTime();
  // Each step once, and the chosen one whole.
  EXPECT_EQ(counter->Executions, 21);
  EXPECT_EQ(
    vtkImageData::SafeDownCast(phase->GetOutputDataObject(0))->GetNumberOfPoints(), 40 * 42 * 36);
  phase->UpdateTimeStep(0.2);
  EXPECT_EQ(counter->Executions, 21);
  // Another piece: no search.
  phase->UpdatePiece(1, 2, 0);
  EXPECT_EQ(counter->Executions, 22);
  EXPECT_EQ(phase->GetUsedTime(), found);
  EXPECT_LT(
    vtkImageData::SafeDownCast(phase->GetOutputDataObject(0))->GetNumberOfPoints(), 40 * 42 * 36);
  source->SetSeed(9);
  phase->UpdatePiece(0, 1, 0);
  EXPECT_EQ(counter->Executions, 22 + 21);
}

TEST(QuietestPhase, IsWhereTheSamplesChangeLeast)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  using Samples = std::vector<std::vector<float>>;
  EXPECT_EQ(coronary::QuietestPhase({ 0.5 }, Samples{ { 1.0f } }), 0u);
  EXPECT_EQ(coronary::QuietestPhase(
              { 0.0, 0.1, 0.2, 0.3, 0.4 }, Samples{ { 0 }, { 5 }, { 6 }, { 7 }, { 11 } }),
    2u);
  // Per unit of time: the wide gap makes the last pair slow.
  EXPECT_EQ(
    coronary::QuietestPhase({ 0.0, 0.1, 0.2, 1.2 }, Samples{ { 0 }, { 1 }, { 2 }, { 4 } }), 3u);
  EXPECT_EQ(
    coronary::QuietestPhase({ 0.0, 0.1, 0.2 }, Samples{ { 0, nan }, { 1, 900 }, { 1, nan } }), 2u);
  // Two phases say nothing: mid-diastole, also a beat later.
  EXPECT_EQ(coronary::QuietestPhase({ 0.35, 0.75 }, Samples{ { 0 }, { 1 } }), 1u);
  EXPECT_EQ(coronary::QuietestPhase({ -0.3, 0.35 }, Samples{ { 0 }, { 1 } }), 0u);
  EXPECT_THROW(coronary::QuietestPhase({}, {}), std::invalid_argument);
  EXPECT_THROW(
    coronary::QuietestPhase({ 0.0, 0.0 }, Samples{ { 0 }, { 0 } }), std::invalid_argument);
  EXPECT_THROW(coronary::QuietestPhase({ 0.0, 0.1 }, Samples{ { 0 }, {} }), std::invalid_argument);
}

TEST(ReferencePhase, PrintsAllSettings)
{
  vtkNew<vtkReferencePhase> phase;
  std::ostringstream text;
  phase->Print(text);
  for (const char* name : { "Automatic: 1", "Time: 0.75", "UsedTime: nan" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}
}
