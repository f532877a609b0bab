// vtkFrangiVesselness through the VTK pipeline: extents, time, the automatic C, arrays, refusals.
#include "vtkFrangiVesselness.h"

#include "CounterRandom.h"
#include "FilterMessages.h"
#include "MultiscaleVesselness.h"
#include "ParallelFor.h"

#include "vtkCallbackCommand.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkImageAlgorithm.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix3x3.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

namespace TestFrangiVesselness
{
using coronary::Matrix3;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;
using Extent = std::array<int, 6>;

namespace
{
constexpr float NaN = std::numeric_limits<float>::quiet_NaN();

/// A bent tube in noise, beating: gives exactly the extent and time that are asked for, and counts.
class TubeSeries : public vtkImageAlgorithm
{
public:
  static TubeSeries* New();
  vtkTypeMacro(TubeSeries, vtkImageAlgorithm);

  Extent Whole = { 0, 39, 0, 35, 0, 31 };
  Vector3 Spacing = { 0.45, 0.5, 0.6 };
  Vector3 Origin = { 0.0, 0.0, 0.0 };
  Matrix3 Direction = Matrix3::Identity();
  std::vector<double> Steps;
  std::function<double(double)> Contrast = [](double) { return 400.0; };
  double Noise = 10.0;
  bool FailsAtTime = false;
  double FailingTime = 0.0;

  struct Call
  {
    Extent extent;
    double time;
  };
  std::vector<Call> Calls;

  float Value(int i, int j, int k, double time) const
  {
    const Vector3 p = this->Spacing.cwiseProduct(Vector3(i, j, k));
    const double x = 8.0 + 2.0 * std::sin(0.25 * p[2]);
    const double y = 8.0 + 0.2 * p[2];
    const double distance = std::hypot(p[0] - x, p[1] - y);
    const double vessel = 0.5 * std::erfc((distance - 1.2) / 0.6);
    const auto voxel = static_cast<std::uint64_t>((k * 1000 + j) * 1000 + i);
    coronary::RandomStream random(7, voxel);
    return static_cast<float>(this->Contrast(time) * vessel + this->Noise * random.Normal());
  }

protected:
  TubeSeries() { this->SetNumberOfInputPorts(0); }

  int RequestInformation(
    vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    info->Set(SDDP::WHOLE_EXTENT(), this->Whole.data(), 6);
    info->Set(vtkDataObject::SPACING(), this->Spacing.data(), 3);
    info->Set(vtkDataObject::ORIGIN(), this->Origin.data(), 3);
    const Matrix3 rows = this->Direction.transpose();
    info->Set(vtkDataObject::DIRECTION(), rows.data(), 9);
    info->Set(CAN_PRODUCE_SUB_EXTENT(), 1);
    vtkDataObject::SetPointDataActiveScalarInfo(info, VTK_FLOAT, 1);
    if (!this->Steps.empty())
    {
      const double range[2] = { this->Steps.front(), this->Steps.back() };
      info->Set(SDDP::TIME_STEPS(), this->Steps.data(), static_cast<int>(this->Steps.size()));
      info->Set(SDDP::TIME_RANGE(), range, 2);
    }
    return 1;
  }

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    vtkImageData* image = vtkImageData::GetData(info);
    Call call;
    info->Get(SDDP::UPDATE_EXTENT(), call.extent.data());
    call.time = 0.0;
    if (!this->Steps.empty())
    {
      call.time =
        info->Has(SDDP::UPDATE_TIME_STEP()) ? info->Get(SDDP::UPDATE_TIME_STEP()) : this->Steps[0];
      image->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), call.time);
      vtkNew<vtkDoubleArray> phase;
      phase->SetName("PhaseTime");
      phase->InsertNextValue(call.time);
      image->GetFieldData()->AddArray(phase);
    }
    this->Calls.push_back(call);
    if (this->FailsAtTime && call.time == this->FailingTime)
    {
      return 0;
    }
    image->SetExtent(call.extent.data());
    vtkNew<vtkFloatArray> values;
    values->SetName("HU");
    for (int k = call.extent[4]; k <= call.extent[5]; ++k)
    {
      for (int j = call.extent[2]; j <= call.extent[3]; ++j)
      {
        for (int i = call.extent[0]; i <= call.extent[1]; ++i)
        {
          values->InsertNextValue(this->Value(i, j, k, call.time));
        }
      }
    }
    image->GetPointData()->SetScalars(values);
    return 1;
  }
};
vtkStandardNewMacro(TubeSeries);

vtkSmartPointer<TubeSeries> MakeSeries(const std::vector<double>& steps = {})
{
  auto series = vtkSmartPointer<TubeSeries>::New();
  series->Steps = steps;
  return series;
}

vtkSmartPointer<vtkFrangiVesselness> MakeFilter(vtkAlgorithm* source)
{
  auto filter = vtkSmartPointer<vtkFrangiVesselness>::New();
  filter->SetInputConnection(source->GetOutputPort());
  filter->SetSigmaMin(0.6);
  filter->SetSigmaMax(1.2);
  filter->SetNumberOfScales(2);
  return filter;
}

vtkSmartPointer<vtkFrangiVesselness> MakeFilterOf(vtkImageData* image)
{
  auto filter = vtkSmartPointer<vtkFrangiVesselness>::New();
  filter->SetInputData(image);
  filter->SetSigmaMin(0.6);
  filter->SetSigmaMax(1.2);
  filter->SetNumberOfScales(2);
  return filter;
}

vtkSmartPointer<vtkImageData> WholeImage(TubeSeries* series)
{
  series->Update();
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->DeepCopy(series->GetOutput());
  return image;
}

vtkFloatArray* Array(vtkImageData* image, const char* name = "Vesselness")
{
  return vtkFloatArray::SafeDownCast(image->GetPointData()->GetArray(name));
}

std::vector<float> Values(vtkImageData* image, const char* name = "Vesselness")
{
  vtkFloatArray* array = Array(image, name);
  return array
    ? std::vector<float>(array->GetPointer(0), array->GetPointer(0) + array->GetNumberOfValues())
    : std::vector<float>();
}

vtkSmartPointer<vtkImageData> Compute(vtkFrangiVesselness* filter)
{
  filter->UpdateWholeExtent();
  auto result = vtkSmartPointer<vtkImageData>::New();
  result->ShallowCopy(filter->GetOutput());
  return result;
}

std::vector<float> RunAt(vtkFrangiVesselness* filter, double time)
{
  filter->UpdateInformation();
  filter->UpdateTimeStep(time);
  return Values(filter->GetOutput());
}

std::vector<double> Field(vtkDataObject* data, const char* name)
{
  auto* array = vtkDoubleArray::SafeDownCast(data->GetFieldData()->GetArray(name));
  return array
    ? std::vector<double>(array->GetPointer(0), array->GetPointer(0) + array->GetNumberOfValues())
    : std::vector<double>();
}

void ExpectRefused(vtkFrangiVesselness* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part, [filter] { filter->UpdateWholeExtent(); });
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
}
}

TEST(FrangiVesselness, IsTheAlgorithmOnTheWholeImage)
{
  const auto series = MakeSeries();
  const auto filter = MakeFilter(series);
  filter->GenerateScaleOn();
  filter->GenerateDirectionOn();
  const auto result = Compute(filter);
  const auto image = WholeImage(series);
  const std::vector<float> before = Values(image, "HU");

  coronary::VesselnessSettings settings;
  settings.sigmas = { 0.6, 1.2 };
  settings.c = 0.5 *
    coronary::MultiscaleVesselness(settings, series->Spacing, series->Whole)
      .Measure({ before.data(), series->Whole }, series->Whole, nullptr)
      .hessianNorm;
  std::vector<float> vesselness(before.size());
  std::vector<float> scale(before.size());
  std::vector<float> direction(3 * before.size());
  coronary::MultiscaleVesselness(settings, series->Spacing, series->Whole)
    .Compute({ before.data(), series->Whole }, series->Whole, nullptr,
      { vesselness.data(), scale.data(), direction.data() });
  EXPECT_EQ(Values(result), vesselness);
  EXPECT_EQ(Values(result, "VesselScale"), scale);
  EXPECT_EQ(Values(result, "VesselDirection"), direction);
  EXPECT_GT(*std::max_element(vesselness.begin(), vesselness.end()), 0.3f);

  EXPECT_EQ(filter->GetUsedC(), settings.c);
  EXPECT_EQ(Field(result, "VesselnessC"), std::vector<double>{ settings.c });
  EXPECT_EQ(Field(result, "VesselnessSigmas"), (std::vector<double>{ 0.6, 1.2 }));
  EXPECT_STREQ(result->GetPointData()->GetScalars()->GetName(), "Vesselness");
  EXPECT_EQ(result->GetPointData()->GetNumberOfArrays(), 3);
  EXPECT_EQ(result->GetPointData()->GetArray("VesselDirection")->GetNumberOfComponents(), 3);
  EXPECT_EQ(std::memcmp(result->GetSpacing(), series->Spacing.data(), 24), 0);
  EXPECT_EQ(result->GetCellData()->GetNumberOfArrays(), 0);

  filter->GenerateDirectionOff();
  const auto without = Compute(filter);
  EXPECT_EQ(Values(without, "Vesselness"), vesselness);
  EXPECT_EQ(Values(without, "VesselScale"), scale);
  EXPECT_EQ(without->GetPointData()->GetNumberOfArrays(), 2);
}

TEST(FrangiVesselness, GivesTheSameBitsInExtentsPiecesAndThreads)
{
  const auto series = MakeSeries();
  for (const int method : { 0, 1, 2 })
  {
    SCOPED_TRACE(method);
    const auto make = [&]
    {
      const auto filter = MakeFilter(series);
      filter->SetMethod(method);
      filter->GenerateScaleOn();
      filter->GenerateDirectionOn();
      return filter;
    };
    const auto whole = Compute(make());
    const char* const names[] = { "Vesselness", "VesselScale", "VesselDirection" };
    const auto compare = [&](vtkImageData* piece)
    {
      const int* e = piece->GetExtent();
      std::size_t different = 0;
      for (const char* name : names)
      {
        vtkDataArray* a = whole->GetPointData()->GetArray(name);
        vtkDataArray* b = piece->GetPointData()->GetArray(name);
        ASSERT_NE(b, nullptr);
        for (int k = e[4]; k <= e[5]; ++k)
        {
          for (int j = e[2]; j <= e[3]; ++j)
          {
            for (int i = e[0]; i <= e[1]; ++i)
            {
              int at[3] = { i, j, k };
              for (int c = 0; c < a->GetNumberOfComponents(); ++c)
              {
                different += a->GetComponent(whole->ComputePointId(at), c) !=
                  b->GetComponent(piece->ComputePointId(at), c);
              }
            }
          }
        }
      }
      EXPECT_EQ(different, 0u) << e[0] << ' ' << e[1] << ' ' << e[2] << ' ' << e[3] << ' ' << e[4]
                               << ' ' << e[5];
    };

    coronary::RandomStream random(11, static_cast<std::uint64_t>(method));
    const auto filter = make();
    const auto fresh = [&](int axis)
    {
      const int n = series->Whole[2 * axis + 1] + 1;
      const int a = static_cast<int>(random.Uniform() * n);
      const int b = static_cast<int>(random.Uniform() * n);
      return std::pair<int, int>(std::min(a, b), std::max(a, b));
    };
    for (int n = 0; n < 12; ++n)
    {
      Extent e;
      for (int axis = 0; axis < 3; ++axis)
      {
        std::tie(e[2 * axis], e[2 * axis + 1]) = fresh(axis);
      }
      // Now and then a filter that knows no C yet.
      const auto one = n % 3 == 0 ? make() : filter;
      one->UpdateExtent(e.data());
      Extent got;
      one->GetOutput()->GetExtent(got.data());
      EXPECT_EQ(got, e);
      compare(one->GetOutput());
    }
    for (int piece = 0; piece < 3; ++piece)
    {
      const auto one = make();
      one->UpdatePiece(piece, 3, 0);
      EXPECT_GT(one->GetOutput()->GetNumberOfPoints(), 0);
      EXPECT_LT(one->GetOutput()->GetNumberOfPoints(), whole->GetNumberOfPoints());
      compare(one->GetOutput());
    }
    coronary::SetNumberOfThreads(1);
    compare(Compute(make()));
    coronary::SetNumberOfThreads(5);
    compare(Compute(make()));
    coronary::SetNumberOfThreads(0);
    // Measured in slabs.
    const auto slabs = make();
    slabs->SetMeasurementBlockSize(1);
    compare(Compute(slabs));
  }
}

TEST(FrangiVesselness, AsksForTheHaloOnly)
{
  const auto series = MakeSeries();
  series->Whole = { -5, 60, 3, 50, 0, 40 };
  const auto filter = MakeFilter(series);
  filter->AutomaticCOff();
  coronary::VesselnessSettings settings;
  settings.sigmas = { 0.6, 1.2 };
  const auto halo = coronary::MultiscaleVesselness(settings, series->Spacing, series->Whole).Halo();
  Extent part = { 20, 22, 4, 9, 20, 20 };
  filter->UpdateExtent(part.data());
  ASSERT_EQ(series->Calls.size(), 1u);
  const Extent expected = { 20 - halo[0], 22 + halo[0], 3, 9 + halo[1], 20 - halo[2],
    20 + halo[2] };
  EXPECT_EQ(series->Calls[0].extent, expected);
}

TEST(FrangiVesselness, MeasuresCOnceForAllTimesAndPieces)
{
  const std::vector<double> steps = { 0.1, 0.3, 0.5, 0.7 };
  const auto series = MakeSeries(steps);
  series->Contrast = [](double time) { return 200.0 + 1000.0 * time; };
  // What belongs to one time alone.
  const auto cAt = [&](double time)
  {
    const auto single = MakeSeries({ time });
    single->Contrast = series->Contrast;
    const auto filter = MakeFilter(single);
    Compute(filter);
    return filter->GetUsedC();
  };
  const auto filter = MakeFilter(series);
  RunAt(filter, 0.5);
  const double c = filter->GetUsedC();
  EXPECT_EQ(c, cAt(0.1));
  EXPECT_GT(std::abs(c - cAt(0.5)), 20.0);
  EXPECT_EQ(Field(filter->GetOutput(), "PhaseTime"), std::vector<double>{ 0.5 });
  EXPECT_EQ(filter->GetOutput()->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), 0.5);

  // Once: from now on one execution of the input a step, at that step.
  series->Calls.clear();
  for (const double time : { 0.3, 0.7, 0.1 })
  {
    const std::vector<float> values = RunAt(filter, time);
    EXPECT_EQ(filter->GetUsedC(), c);
    ASSERT_EQ(series->Calls.size(), 1u);
    EXPECT_EQ(series->Calls[0].time, time);
    series->Calls.clear();
    // The same as of a filter with that C.
    const auto given = MakeFilter(series);
    given->AutomaticCOff();
    given->SetC(c);
    EXPECT_EQ(values, RunAt(given, time));
    series->Calls.clear();
  }

  // Another order of requests, pieces and slabs give the same value.
  const auto other = MakeFilter(series);
  other->SetMeasurementBlockSize(20000);
  other->UpdateInformation();
  other->GetOutputInformation(0)->Set(SDDP::UPDATE_TIME_STEP(), 0.7);
  other->UpdatePiece(1, 4, 0);
  EXPECT_EQ(other->GetUsedC(), c);
  EXPECT_EQ(Field(other->GetOutput(), "PhaseTime"), std::vector<double>{ 0.7 });

  filter->AutomaticReferenceTimeOff();
  filter->SetReferenceTime(0.52);
  RunAt(filter, 0.1);
  EXPECT_EQ(filter->GetUsedC(), cAt(0.5));

  // A change of the input or of the scales measures anew; one of alpha does not.
  series->Calls.clear();
  filter->SetAlpha(0.6);
  RunAt(filter, 0.3);
  EXPECT_EQ(series->Calls.size(), 1u);
  series->Contrast = [](double) { return 800.0; };
  series->Modified();
  RunAt(filter, 0.3);
  EXPECT_EQ(filter->GetUsedC(), cAt(0.3));
  const double before = filter->GetUsedC();
  filter->SetSigmaMax(2.0);
  RunAt(filter, 0.3);
  EXPECT_NE(filter->GetUsedC(), before);
}

TEST(FrangiVesselness, PassesTimeThrough)
{
  const auto series = MakeSeries({ 0.1, 0.3 });
  const auto filter = MakeFilter(series);
  filter->UpdateInformation();
  vtkInformation* info = filter->GetOutputInformation(0);
  ASSERT_EQ(info->Length(SDDP::TIME_STEPS()), 2);
  EXPECT_EQ(info->Get(SDDP::TIME_STEPS())[1], 0.3);
  EXPECT_TRUE(info->Has(SDDP::TIME_RANGE()));
}

TEST(FrangiVesselness, TakesAllScalarTypes)
{
  const auto series = MakeSeries();
  series->Noise = 0.0;
  const auto image = WholeImage(series);
  auto* source = vtkFloatArray::SafeDownCast(image->GetPointData()->GetScalars());
  for (vtkIdType n = 0; n < source->GetNumberOfValues(); ++n)
  {
    // What every type can hold.
    source->SetValue(n, std::round(source->GetValue(n) / 4.0f));
  }
  const std::vector<float> expected = Values(Compute(MakeFilterOf(image)));
  EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 0.3f);
  for (const int type : { VTK_SIGNED_CHAR, VTK_UNSIGNED_CHAR, VTK_CHAR, VTK_SHORT,
         VTK_UNSIGNED_SHORT, VTK_INT, VTK_UNSIGNED_INT, VTK_LONG, VTK_UNSIGNED_LONG, VTK_LONG_LONG,
         VTK_UNSIGNED_LONG_LONG, VTK_ID_TYPE, VTK_DOUBLE })
  {
    SCOPED_TRACE(vtkImageScalarTypeNameMacro(type));
    vtkNew<vtkImageData> cast;
    cast->CopyStructure(image);
    const auto values = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(type));
    values->DeepCopy(source);
    cast->GetPointData()->SetScalars(values);
    EXPECT_EQ(cast->GetScalarType(), type);
    EXPECT_EQ(Values(Compute(MakeFilterOf(cast))), expected);
  }

  // An array that is not the active scalars, beside one that is.
  const auto other = WholeImage(series);
  vtkNew<vtkDoubleArray> chosen;
  chosen->SetName("chosen");
  for (vtkIdType n = 0; n < source->GetNumberOfValues(); ++n)
  {
    chosen->InsertNextValue(source->GetValue(n));
  }
  other->GetPointData()->AddArray(chosen);
  const auto filter = MakeFilterOf(other);
  filter->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "chosen");
  EXPECT_EQ(Values(Compute(filter)), expected);
}

TEST(FrangiVesselness, LeavesItsInputAlone)
{
  const auto series = MakeSeries();
  const auto image = WholeImage(series);
  const std::vector<float> before = Values(image, "HU");
  const vtkMTimeType time = image->GetMTime();
  Compute(MakeFilterOf(image));
  EXPECT_EQ(Values(image, "HU"), before);
  EXPECT_EQ(image->GetPointData()->GetNumberOfArrays(), 1);
  EXPECT_EQ(image->GetFieldData()->GetNumberOfArrays(), 0);
  EXPECT_EQ(image->GetMTime(), time);
}

TEST(FrangiVesselness, MaskAndRegionLimitTheResult)
{
  const auto series = MakeSeries();
  const auto image = WholeImage(series);
  const auto plain = MakeFilterOf(image);
  plain->AutomaticCOff();
  const std::vector<float> whole = Values(Compute(plain));

  vtkNew<vtkImageData> mask;
  mask->CopyStructure(image);
  vtkNew<vtkDoubleArray> inside;
  inside->SetName("inside");
  for (vtkIdType n = 0; n < mask->GetNumberOfPoints(); ++n)
  {
    inside->InsertNextValue(n % 3 == 0 ? 2.0 : n % 3 == 1 ? 0.0 : NaN);
  }
  mask->GetPointData()->SetScalars(inside);
  const auto masked = MakeFilterOf(image);
  masked->AutomaticCOff();
  masked->SetMaskData(mask);
  masked->GenerateScaleOn();
  const auto result = Compute(masked);
  const std::vector<float> values = Values(result);
  const std::vector<float> scales = Values(result, "VesselScale");
  ASSERT_EQ(values.size(), whole.size());
  for (std::size_t n = 0; n < whole.size(); ++n)
  {
    ASSERT_EQ(values[n], n % 3 == 0 ? whole[n] : 0.0f) << n;
    ASSERT_EQ(scales[n] > 0.0f, values[n] > 0.0f) << n;
  }
  Extent part = { 3, 30, 5, 20, 7, 8 };
  masked->UpdateExtent(part.data());
  for (int k = 7; k <= 8; ++k)
  {
    for (int j = 5; j <= 20; ++j)
    {
      for (int i = 3; i <= 30; ++i)
      {
        int at[3] = { i, j, k };
        vtkImageData* piece = masked->GetOutput();
        ASSERT_EQ(piece->GetPointData()->GetScalars()->GetComponent(piece->ComputePointId(at), 0),
          values[image->ComputePointId(at)]);
      }
    }
  }

  const auto region = MakeFilterOf(image);
  region->AutomaticCOff();
  region->GenerateDirectionOn();
  region->UseRegionOn();
  region->SetRegion(10, 25, 12, 400, 4, 9);
  const auto limited = Compute(region);
  EXPECT_EQ(limited->GetNumberOfPoints(), image->GetNumberOfPoints());
  const std::vector<float> inRegion = Values(limited);
  const std::vector<float> directions = Values(limited, "VesselDirection");
  int counted = 0;
  for (vtkIdType n = 0; n < image->GetNumberOfPoints(); ++n)
  {
    const int i = static_cast<int>(n % 40);
    const int j = static_cast<int>(n / 40 % 36);
    const int k = static_cast<int>(n / 40 / 36);
    const bool in = i >= 10 && i <= 25 && j >= 12 && k >= 4 && k <= 9;
    ASSERT_EQ(inRegion[n], in ? whole[n] : 0.0f) << n;
    const double length =
      std::hypot(directions[3 * n], directions[3 * n + 1], directions[3 * n + 2]);
    ASSERT_NEAR(length, inRegion[n] > 0.0f ? 1.0 : 0.0, 1e-5);
    counted += in && whole[n] > 0.1f;
  }
  EXPECT_GT(counted, 20);

  // C is that of the region: what lies elsewhere does not matter.
  const auto bright = WholeImage(series);
  auto* hu = vtkFloatArray::SafeDownCast(bright->GetPointData()->GetScalars());
  int corner[3] = { 39, 35, 31 };
  hu->SetValue(bright->ComputePointId(corner), 30000.0f);
  const auto measured = MakeFilterOf(bright);
  Compute(measured);
  const double disturbed = measured->GetUsedC();
  measured->UseRegionOn();
  measured->SetRegion(0, 39, 0, 35, 0, 10);
  Compute(measured);
  EXPECT_GT(disturbed, 5.0 * measured->GetUsedC());
  measured->UseRegionOff();
  for (vtkIdType n = 0; n < mask->GetNumberOfPoints(); ++n)
  {
    inside->SetValue(n, n / (40 * 36) <= 10 ? 1.0 : 0.0);
  }
  inside->Modified();
  mask->Modified();
  const double ofRegion = measured->GetUsedC();
  measured->SetMaskData(mask);
  Compute(measured);
  EXPECT_EQ(measured->GetUsedC(), ofRegion);
}

TEST(FrangiVesselness, FollowsTheDirectionOfTheImage)
{
  const auto series = MakeSeries();
  const auto straight = MakeFilter(series);
  straight->GenerateDirectionOn();
  const auto expected = Compute(straight);

  const auto oblique = MakeSeries();
  oblique->Direction = (Eigen::AngleAxisd(0.4, Vector3(1, 2, 3).normalized())).toRotationMatrix();
  oblique->Direction.col(1) *= -1.0;
  oblique->Origin = { -100.0, 20.0, 1300.0 };
  const auto filter = MakeFilter(oblique);
  filter->GenerateDirectionOn();
  const auto found = Compute(filter);
  EXPECT_EQ(Values(found), Values(expected));
  EXPECT_EQ(std::memcmp(found->GetOrigin(), oblique->Origin.data(), 24), 0);
  const Matrix3 rows = oblique->Direction.transpose();
  EXPECT_EQ(std::memcmp(found->GetDirectionMatrix()->GetData(), rows.data(), 72), 0);
  const std::vector<float> a = Values(expected, "VesselDirection");
  const std::vector<float> b = Values(found, "VesselDirection");
  for (std::size_t n = 0; n < a.size(); n += 3)
  {
    const Vector3 rotated = oblique->Direction * Vector3(a[n], a[n + 1], a[n + 2]);
    ASSERT_LT((rotated - Vector3(b[n], b[n + 1], b[n + 2])).norm(), 1e-5);
  }
  // The middle of the tube: along its tangent.
  int at[3] = { 0, 0, 16 };
  const double z = 16 * series->Spacing[2];
  at[0] = static_cast<int>(std::lround((8.0 + 2.0 * std::sin(0.25 * z)) / series->Spacing[0]));
  at[1] = static_cast<int>(std::lround((8.0 + 0.2 * z) / series->Spacing[1]));
  const Vector3 tangent =
    (oblique->Direction * Vector3(0.5 * std::cos(0.25 * z), 0.2, 1.0)).normalized();
  double axis[3];
  found->GetPointData()->GetArray("VesselDirection")->GetTuple(found->ComputePointId(at), axis);
  EXPECT_GT(std::abs(tangent.dot(Vector3(axis))), 0.97);
}

TEST(FrangiVesselness, ConstantAndDamagedImagesGiveZeros)
{
  for (const int method : { 0, 1, 2 })
  {
    for (const float level : { 0.0f, 37.0f, -1024.0f, 1e6f })
    {
      vtkNew<vtkImageData> image;
      image->SetDimensions(20, 19, 18);
      image->AllocateScalars(VTK_FLOAT, 1);
      image->GetPointData()->GetScalars()->Fill(level);
      const auto filter = MakeFilterOf(image);
      filter->SetMethod(method);
      filter->GenerateScaleOn();
      Messages messages(filter);
      const auto result = Compute(filter);
      EXPECT_TRUE(messages.Errors.empty());
      // Not for Sato's, which needs no measurement.
      EXPECT_EQ(messages.Warnings.size(), method == 1 ? 0u : 1u);
      for (const char* name : { "Vesselness", "VesselScale" })
      {
        for (const float value : Values(result, name))
        {
          ASSERT_EQ(value, 0.0f) << method << ' ' << level;
        }
      }
      EXPECT_EQ(filter->GetUsedC(), 0.0);
    }
  }

  // All NaN; and a few of them, and infinity, which do not spoil the rest.
  const auto series = MakeSeries();
  const auto image = WholeImage(series);
  auto* values = vtkFloatArray::SafeDownCast(image->GetPointData()->GetScalars());
  int damaged[3] = { 5, 5, 1 };
  values->SetValue(image->ComputePointId(damaged), NaN);
  damaged[0] = 6;
  values->SetValue(image->ComputePointId(damaged), std::numeric_limits<float>::infinity());
  const auto filter = MakeFilterOf(image);
  const std::vector<float> found = Values(Compute(filter));
  EXPECT_TRUE(std::isfinite(filter->GetUsedC()));
  EXPECT_TRUE(
    std::all_of(found.begin(), found.end(), [](float v) { return v >= 0.0f && v <= 1.0f; }));
  EXPECT_GT(*std::max_element(found.begin(), found.end()), 0.3f);

  values->Fill(NaN);
  values->Modified();
  image->Modified();
  Messages messages(filter);
  for (const float value : Values(Compute(filter)))
  {
    ASSERT_EQ(value, 0.0f);
  }
  EXPECT_EQ(messages.Warnings.size(), 1u);
}

TEST(FrangiVesselness, EmptyInputAndEmptyPiecesAreNormal)
{
  vtkNew<vtkImageData> nothing;
  const auto filter = MakeFilterOf(nothing);
  filter->GenerateScaleOn();
  Messages messages(filter);
  const auto result = Compute(filter);
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(result->GetNumberOfPoints(), 0);
  EXPECT_NE(Array(result), nullptr);
  EXPECT_NE(Array(result, "VesselScale"), nullptr);

  const auto series = MakeSeries();
  series->Whole = { 0, 9, 0, 9, 0, 9 };
  int empty = 0;
  for (int piece = 0; piece < 2000; piece += 400)
  {
    const auto one = MakeFilter(series);
    Messages ofPiece(one);
    one->UpdatePiece(piece, 2000, 0);
    EXPECT_TRUE(ofPiece.Errors.empty() && ofPiece.Echoes.empty());
    EXPECT_NE(Array(one->GetOutput()), nullptr);
    empty += one->GetOutput()->GetNumberOfPoints() == 0;
    EXPECT_GT(one->GetUsedC(), 0.0);
  }
  EXPECT_GT(empty, 0);
}

TEST(FrangiVesselness, WarnsOfScalesThatTheImageDoesNotResolve)
{
  const auto series = MakeSeries({ 0.1, 0.3 });
  series->Spacing = { 0.4, 0.4, 1.5 };
  const auto filter = MakeFilter(series);
  Messages messages(filter);
  RunAt(filter, 0.1);
  RunAt(filter, 0.3);
  ASSERT_EQ(messages.Warnings.size(), 1u);
  EXPECT_NE(messages.Warnings[0].find("SigmaMin"), std::string::npos);
  EXPECT_NE(messages.Warnings[0].find("noise"), std::string::npos);
  filter->SetSigmaMin(0.75);
  RunAt(filter, 0.1);
  EXPECT_EQ(messages.Warnings.size(), 1u);
}

TEST(FrangiVesselness, RefusesByName)
{
  const auto series = MakeSeries();
  const auto image = WholeImage(series);
  const auto with = [&](const std::function<void(vtkFrangiVesselness*)>& change)
  {
    auto filter = MakeFilterOf(image);
    change(filter);
    return filter;
  };
  using Filter = vtkFrangiVesselness;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ExpectRefused(with([](Filter* f) { f->SetSigmaMin(0.0); }), "SigmaMin");
  ExpectRefused(with([&](Filter* f) { f->SetSigmaMin(nan); }), "SigmaMin");
  ExpectRefused(with([](Filter* f) { f->SetSigmaMax(0.1); }), "SigmaMax");
  ExpectRefused(with([&](Filter* f) { f->SetSigmaMax(nan); }), "SigmaMax");
  ExpectRefused(with([](Filter* f) { f->SetNumberOfScales(0); }), "NumberOfScales");
  ExpectRefused(with([](Filter* f) { f->SetScaleSpacing(2); }), "ScaleSpacing");
  ExpectRefused(with([](Filter* f) { f->SetMethod(-1); }), "Method");
  ExpectRefused(with([](Filter* f) { f->SetAlpha(0.0); }), "Alpha");
  ExpectRefused(with([&](Filter* f) { f->SetBeta(nan); }), "Beta");
  ExpectRefused(with([](Filter* f) { f->SetTau(0.4); }), "Tau");
  ExpectRefused(with(
                  [](Filter* f)
                  {
                    f->AutomaticCOff();
                    f->SetC(-1.0);
                  }),
    "C must");
  ExpectRefused(with(
                  [](Filter* f)
                  {
                    f->UseRegionOn();
                    f->SetRegion(100, 120, 0, 10, 0, 10);
                  }),
    "Region");
  ExpectRefused(
    with([](Filter* f)
      { f->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "density"); }),
    "density");

  const auto ofImage = [&](const std::function<void(vtkImageData*)>& change)
  {
    vtkNew<vtkImageData> changed;
    changed->DeepCopy(image);
    change(changed);
    return MakeFilterOf(changed);
  };
  ExpectRefused(ofImage([](vtkImageData* i) { i->GetPointData()->Initialize(); }),
    "The image has no point array of one component");
  ExpectRefused(ofImage(
                  [](vtkImageData* i)
                  {
                    i->AllocateScalars(VTK_SHORT, 3);
                    i->GetPointData()->GetScalars()->SetName("colours");
                    i->GetPointData()->GetScalars()->Fill(0.0);
                  }),
    "'colours' of the image has 3 components");
  ExpectRefused(ofImage(
                  [](vtkImageData* i)
                  {
                    i->SetDimensions(64, 48, 1);
                    i->AllocateScalars(VTK_SHORT, 1);
                    i->GetPointData()->GetScalars()->Fill(0.0);
                  }),
    "64 x 48 x 1");
  const auto words = ofImage(
    [](vtkImageData* i)
    {
      vtkNew<vtkStringArray> text;
      text->SetName("words");
      text->SetNumberOfValues(i->GetNumberOfPoints());
      i->GetPointData()->AddArray(text);
    });
  words->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "words");
  ExpectRefused(words, "'words' of the image is not numeric");
  const auto cells = ofImage(
    [](vtkImageData* i)
    {
      vtkNew<vtkFloatArray> values;
      values->SetName("cells");
      values->SetNumberOfTuples(i->GetNumberOfCells());
      values->Fill(0.0f);
      i->GetCellData()->AddArray(values);
    });
  cells->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_CELLS, "cells");
  ExpectRefused(cells, "'cells' of the image belongs to the cells");
  ExpectRefused(ofImage([](vtkImageData* i) { i->SetDirectionMatrix(1, 0, 0, 1, 1, 0, 0, 0, 1); }),
    "direction matrix");

  const auto ofMask = [&](const std::function<void(vtkImageData*)>& change)
  {
    vtkNew<vtkImageData> mask;
    mask->DeepCopy(image);
    change(mask);
    auto filter = MakeFilterOf(image);
    filter->SetMaskData(mask);
    return filter;
  };
  ExpectRefused(ofMask([](vtkImageData* m) { m->SetSpacing(0.45, 0.5, 0.7); }), "mask");
  ExpectRefused(ofMask([](vtkImageData* m) { m->SetOrigin(0.0, 1.0, 0.0); }), "origin");
  ExpectRefused(
    ofMask([](vtkImageData* m) { m->SetDirectionMatrix(0, 1, 0, 1, 0, 0, 0, 0, 1); }), "direction");
  ExpectRefused(ofMask(
                  [](vtkImageData* m)
                  {
                    m->SetDimensions(10, 10, 10);
                    m->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
                  }),
    "extent");
  ExpectRefused(
    ofMask([](vtkImageData* m) { m->GetPointData()->Initialize(); }), "The mask has no");
  const auto misnamed = ofMask([](vtkImageData*) {});
  misnamed->SetMaskArrayName("lumen");
  ExpectRefused(misnamed, "The mask has no point array 'lumen'");
  misnamed->SetMaskArrayName("HU");
  EXPECT_GT(Compute(misnamed)->GetNumberOfPoints(), 0);
  EXPECT_GT(Compute(ofMask([](vtkImageData*) {}))->GetNumberOfPoints(), 0);

  // Composite data: C belongs to one image.
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(0, image);
  const auto filter = vtkSmartPointer<vtkFrangiVesselness>::New();
  filter->SetInputDataObject(blocks);
  Messages messages(filter);
  filter->Update();
  ASSERT_EQ(messages.Echoes.size(), 1u);
  EXPECT_NE(messages.Echoes[0].find("vtkMultiBlockDataSet"), std::string::npos);

  // Mended, it works.
  const auto mended = with([](Filter* f) { f->SetAlpha(0.0); });
  ExpectRefused(mended, "Alpha");
  mended->SetAlpha(0.5);
  EXPECT_GT(Compute(mended)->GetNumberOfPoints(), 0);
}

TEST(FrangiVesselness, AnInputThatFailsWhileCIsMeasuredIsAnError)
{
  const auto series = MakeSeries({ 0.1, 0.3 });
  series->FailsAtTime = true;
  series->FailingTime = 0.1;
  const auto filter = MakeFilter(series);
  Messages ofSeries(series);
  {
    Messages messages(filter);
    RunAt(filter, 0.3);
    ASSERT_EQ(messages.Errors.size(), 1u);
    EXPECT_NE(messages.Errors[0].find("The input failed"), std::string::npos);
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  }
  series->FailsAtTime = false;
  series->Modified();
  EXPECT_FALSE(RunAt(filter, 0.3).empty());
  EXPECT_GT(filter->GetUsedC(), 0.0);
}

TEST(FrangiVesselness, ReportsProgressAndStopsQuickly)
{
  vtkNew<vtkImageData> image;
  image->SetDimensions(130, 130, 130);
  image->SetSpacing(0.4, 0.4, 0.4);
  image->AllocateScalars(VTK_FLOAT, 1);
  auto* values = vtkFloatArray::SafeDownCast(image->GetPointData()->GetScalars());
  for (vtkIdType n = 0; n < values->GetNumberOfValues(); ++n)
  {
    values->SetValue(n, static_cast<float>(n % 97));
  }
  struct Watch
  {
    double stopAt = 2.0;
    double last = 0.0;
    double maximumStep = 0.0;
    std::chrono::steady_clock::time_point asked;
  };
  const auto observe = [](vtkFrangiVesselness* filter, Watch& watch)
  {
    vtkNew<vtkCallbackCommand> observer;
    observer->SetClientData(&watch);
    observer->SetCallback(
      [](vtkObject* caller, unsigned long, void* data, void*)
      {
        auto* algorithm = vtkAlgorithm::SafeDownCast(caller);
        auto& seen = *static_cast<Watch*>(data);
        const double progress = algorithm->GetProgress();
        seen.maximumStep = std::max(seen.maximumStep, progress - seen.last);
        seen.last = progress;
        if (progress >= seen.stopAt && !algorithm->GetAbortExecute())
        {
          seen.asked = std::chrono::steady_clock::now();
          algorithm->SetAbortExecute(1);
        }
      });
    filter->AddObserver(vtkCommand::ProgressEvent, observer);
  };
  const auto make = [&]
  {
    auto filter = vtkSmartPointer<vtkFrangiVesselness>::New();
    filter->SetInputData(image);
    return filter;
  };
  {
    // On one thread: with more, the one that reports may be asleep while others work.
    coronary::SetNumberOfThreads(1);
    Watch watch;
    const auto filter = make();
    observe(filter, watch);
    filter->Update();
    coronary::SetNumberOfThreads(0);
    EXPECT_EQ(watch.last, 1.0);
    EXPECT_LT(watch.maximumStep, 0.02);
  }
  // While C is measured, and later.
  for (const double stop : { 0.1, 0.6 })
  {
    Watch watch;
    watch.stopAt = stop;
    const auto filter = make();
    observe(filter, watch);
    Messages messages(filter);
    filter->Update();
    const std::chrono::duration<double> late = std::chrono::steady_clock::now() - watch.asked;
    EXPECT_LT(late.count(), 0.5);
    EXPECT_TRUE(messages.Errors.empty());
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
    watch.stopAt = 2.0;
    filter->SetAbortExecute(0);
    filter->Update();
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), image->GetNumberOfPoints());
  }
}

TEST(FrangiVesselness, PrintsAllSettings)
{
  vtkNew<vtkFrangiVesselness> filter;
  std::ostringstream text;
  filter->Print(text);
  for (const char* name : { "SigmaMin: 0.5", "SigmaMax: 2.5", "NumberOfScales: 5", "Method: 0",
         "AutomaticC: 1", "UsedC: 0", "Region: 0 0" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}
}
