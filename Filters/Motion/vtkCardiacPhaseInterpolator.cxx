#include "vtkCardiacPhaseInterpolator.h"

#include "CoronaryAnatomy.h"
#include "CyclicTime.h"
#include "PhaseInterpolation.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkPoseSequences.h"

#include "vtkCellData.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;
using coronary::PhaseInterpolation;
using vtkCoronary::Require;
using vtkPoseSequences::VaryingArray;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCardiacPhaseInterpolator);

struct vtkCardiacPhaseInterpolator::Internals
{
  vtkPoseSequences::Reader Reader;
  std::unique_ptr<PhaseInterpolation> Motion;
  /// The logarithms of the semi-axes, as positions; null where the input has none.
  std::unique_ptr<PhaseInterpolation> Axes;
  bool HasCalibre = false;
  std::string RadiusName;               ///< empty: the input has no radius
  std::vector<double> Radius;           ///< of A0, mm
  std::vector<double> ReferenceCalibre; ///< factor at ReferenceTime; empty: 1
  vtkMTimeType BuiltAt = 0;
  coronary::InterpolatedPose Pose;
  coronary::InterpolatedPose Shape;

  void Build(vtkCardiacPhaseInterpolator* self);
  /// @param cycle  seconds
  void WriteSections(
    vtkCardiacPhaseInterpolator* self, double time, double cycle, vtkPointSet* output);
  void WriteOthers(
    vtkCardiacPhaseInterpolator* self, double time, double cycle, vtkPointSet* output);
  void WriteTwistRate(std::size_t before, std::size_t after, double seconds, vtkPointSet* output);
};

namespace
{
/// Values of an array of one component at all steps; empty when it is not there.
std::vector<std::vector<double>> ValuesOf(
  const vtkPoseSequences::Sequence& data, const std::string& name, bool& varies)
{
  varies = false;
  vtkDataArray* first = data.first->GetPointData()->GetArray(name.c_str());
  std::vector<vtkDataArray*> arrays;
  if (first)
  {
    arrays.assign(data.poses.NumberOfPhases(), first);
  }
  for (const VaryingArray& array : data.varying)
  {
    if (first && !array.cell && array.steps.front() == first)
    {
      varies = true;
      for (std::size_t k = 0; k < arrays.size(); ++k)
      {
        arrays[k] = vtkDataArray::SafeDownCast(array.steps[k]);
      }
    }
  }
  std::vector<std::vector<double>> values;
  for (vtkDataArray* array : arrays)
  {
    Require(array->GetNumberOfComponents() == 1,
      "Array " + name + " of the input must have one component");
    values.emplace_back(static_cast<std::size_t>(array->GetNumberOfTuples()));
    for (std::size_t n = 0; n < values.back().size(); ++n)
    {
      values.back()[n] = array->GetComponent(static_cast<vtkIdType>(n), 0);
    }
  }
  return values;
}

void RequirePositive(const std::vector<std::vector<double>>& values, const std::string& name)
{
  for (const std::vector<double>& step : values)
  {
    for (const double value : step)
    {
      Require(std::isfinite(value) && value > 0.0,
        "Array " + name + " of the input has a value that is not positive");
    }
  }
}

using coronary::Modulo;
}

void vtkCardiacPhaseInterpolator::Internals::Build(vtkCardiacPhaseInterpolator* self)
{
  const vtkPoseSequences::Sequence& data = this->Reader.Current();
  this->Motion.reset();
  this->Axes.reset();
  this->Radius.clear();
  this->ReferenceCalibre.clear();
  this->RadiusName.clear();

  coronary::PoseSequence poses = data.poses;
  for (double& time : poses.times)
  {
    time /= self->Period;
  }
  coronary::PhaseInterpolationSettings settings;
  settings.mode = static_cast<coronary::PhaseInterpolationMode>(self->Mode);
  settings.mergeTolerance = self->MergeTolerance;
  settings.maximumRank = self->MaximumRank;
  settings.maximumOrder = self->MaximumOrder;

  vtkPointData* pointData = data.first->GetPointData();
  bool radiusVaries = false;
  std::vector<std::vector<double>> radius;
  for (const char* name : { "Radius", names::Radius })
  {
    this->RadiusName = pointData->HasArray(name) != 0 ? name : this->RadiusName;
  }
  if (!this->RadiusName.empty())
  {
    radius = ValuesOf(data, this->RadiusName, radiusVaries);
  }
  bool varies = false;
  std::vector<std::vector<double>> major = ValuesOf(data, names::EllipseMajor, varies);
  std::vector<std::vector<double>> minor = ValuesOf(data, names::EllipseMinor, varies);
  Require(major.empty() == minor.empty(),
    std::string("Arrays ") + names::EllipseMajor + " and " + names::EllipseMinor +
      " of the input: one is there without the other");
  RequirePositive(major, names::EllipseMajor);
  RequirePositive(minor, names::EllipseMinor);
  if (!major.empty())
  {
    coronary::PoseSequence axes;
    axes.times = poses.times;
    axes.confidence = poses.confidence;
    for (std::size_t k = 0; k < major.size(); ++k)
    {
      axes.points.emplace_back();
      for (std::size_t n = 0; n < major[k].size(); ++n)
      {
        const double longer = std::max(major[k][n], minor[k][n]);
        const double shorter = std::min(major[k][n], minor[k][n]);
        axes.points.back().emplace_back(std::log(longer), std::log(shorter), 0.0);
      }
    }
    coronary::PhaseInterpolationSettings plain = settings;
    plain.mode = settings.mode == coronary::PhaseInterpolationMode::Linear
      ? settings.mode
      : coronary::PhaseInterpolationMode::PeriodicCubic;
    this->Axes = std::make_unique<PhaseInterpolation>(axes, plain);
  }

  // What the factor of the radius is taken from: itself, the ellipses' area, the radius.
  const bool given = !poses.calibre.empty();
  if (!given && !major.empty())
  {
    for (std::size_t k = 0; k < major.size(); ++k)
    {
      poses.calibre.emplace_back(major[k].size());
      for (std::size_t n = 0; n < major[k].size(); ++n)
      {
        poses.calibre[k][n] = std::sqrt(major[k][n] * minor[k][n] / (major[0][n] * minor[0][n]));
      }
    }
  }
  else if (!given && radiusVaries)
  {
    RequirePositive(radius, this->RadiusName);
    for (const std::vector<double>& step : radius)
    {
      poses.calibre.emplace_back(step.size());
      for (std::size_t n = 0; n < step.size(); ++n)
      {
        poses.calibre.back()[n] = step[n] / radius[0][n];
      }
    }
  }
  this->HasCalibre = !poses.calibre.empty();
  try
  {
    this->Motion = std::make_unique<PhaseInterpolation>(
      poses, settings, vtkCoronary::ProgressOf(self, 0.8, 1.0));
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument(vtkCoronary::PropertyMessage(error.what()));
  }
  // Radius of A0: that at the first step, without its change.
  if (!major.empty() || !radius.empty())
  {
    for (std::size_t n = 0; n < poses.points.front().size(); ++n)
    {
      this->Radius.push_back(radius.empty() ? std::sqrt(major[0][n] * minor[0][n]) : radius[0][n]);
    }
  }
  if (this->HasCalibre && !given)
  {
    this->Motion->Evaluate(self->ReferenceTime / self->Period, this->Pose);
    this->ReferenceCalibre = this->Pose.calibre;
    for (std::size_t n = 0; n < this->Radius.size(); ++n)
    {
      this->Radius[n] *= this->ReferenceCalibre[n];
    }
  }
  else if (given && radiusVaries)
  {
    for (std::size_t n = 0; n < this->Radius.size(); ++n)
    {
      this->Radius[n] /= poses.calibre[0][n];
    }
  }
  this->BuiltAt = self->GetMTime();
}

void vtkCardiacPhaseInterpolator::Internals::WriteSections(
  vtkCardiacPhaseInterpolator* self, double time, double cycle, vtkPointSet* output)
{
  const std::size_t count = this->Pose.points.size();
  vtkPointData* pointData = output->GetPointData();
  if (this->Axes)
  {
    this->Axes->Evaluate(time, this->Shape);
  }
  const double evenRatio = std::sqrt(1.0 - self->Eccentricity * self->Eccentricity);
  const bool ellipses = this->Axes || (self->Ellipses && !this->Radius.empty());
  std::vector<double> strain(this->HasCalibre ? count : 0);
  std::vector<double> major(ellipses ? count : 0);
  std::vector<double> minor(ellipses ? count : 0);
  vtkIdType clamped = 0;
  vtkSmartPointer<vtkDataArray> radius;
  if (this->HasCalibre && !this->RadiusName.empty())
  {
    vtkDataArray* old = pointData->GetArray(this->RadiusName.c_str());
    radius.TakeReference(old->NewInstance());
    radius->SetName(this->RadiusName.c_str());
    radius->SetNumberOfTuples(static_cast<vtkIdType>(count));
  }
  for (std::size_t n = 0; n < count && (this->HasCalibre || ellipses); ++n)
  {
    const double reference = this->ReferenceCalibre.empty() ? 1.0 : this->ReferenceCalibre[n];
    double factor = this->HasCalibre ? this->Pose.calibre[n] : 1.0;
    factor /= reference;
    const double ratio = this->Axes
      ? std::min(1.0, std::exp(this->Shape.points[n].y() - this->Shape.points[n].x()))
      : evenRatio;
    const coronary::EllipseSection section = coronary::CrossSection(
      this->Radius.empty() ? 1.0 : this->Radius[n], factor, ratio, self->AreaStrainLimit);
    clamped += section.clamped ? 1 : 0;
    if (this->HasCalibre)
    {
      this->Pose.calibre[n] = std::sqrt(1.0 + section.areaStrain);
      // At its limit a cross-section stands still.
      this->Pose.calibreRate[n] =
        section.clamped ? 0.0 : this->Pose.calibreRate[n] / (reference * cycle);
      strain[n] = section.areaStrain;
    }
    if (ellipses)
    {
      major[n] = section.major;
      minor[n] = section.minor;
    }
    if (radius)
    {
      radius->SetComponent(static_cast<vtkIdType>(n), 0, this->Radius[n] * this->Pose.calibre[n]);
    }
  }
  if (this->HasCalibre)
  {
    vtkCoronary::AddArray<vtkDoubleArray>(pointData, names::CalibreFactor, this->Pose.calibre);
    vtkCoronary::AddArray<vtkDoubleArray>(pointData, names::CalibreRate, this->Pose.calibreRate);
    vtkCoronary::AddArray<vtkDoubleArray>(pointData, names::AreaStrain, strain);
  }
  if (radius)
  {
    pointData->AddArray(radius);
  }
  if (ellipses)
  {
    vtkCoronary::AddArray<vtkDoubleArray>(pointData, names::EllipseMajor, major);
    vtkCoronary::AddArray<vtkDoubleArray>(pointData, names::EllipseMinor, minor);
  }
  vtkCoronary::AddArray<vtkIdTypeArray>(
    output->GetFieldData(), names::ClampedSections, std::vector<vtkIdType>{ clamped });
}

void vtkCardiacPhaseInterpolator::Internals::WriteOthers(
  vtkCardiacPhaseInterpolator* self, double time, double cycle, vtkPointSet* output)
{
  const vtkPoseSequences::Sequence& data = this->Reader.Current();
  // The steps around the moment, modulo one cycle.
  const std::vector<double>& times = data.poses.times;
  std::size_t before = 0;
  std::size_t after = 0;
  const auto since = [&](std::size_t k) { return Modulo(time - times[k] / self->Period); };
  const auto until = [&](std::size_t k) { return Modulo(times[k] / self->Period - time); };
  for (std::size_t k = 1; k < times.size(); ++k)
  {
    before = since(k) < since(before) ? k : before;
    after = until(k) < until(after) ? k : after;
  }
  const double gap = since(before) + until(after);
  const double share = gap > 0.0 ? since(before) / gap : 0.0;
  for (const VaryingArray& array : data.varying)
  {
    vtkDataSetAttributes* attributes = output->GetPointData();
    if (array.cell)
    {
      attributes = output->GetCellData();
    }
    const std::string name = array.steps.front()->GetName();
    const bool written = !array.cell &&
      (name == names::AreaStrain || (name == this->RadiusName && this->HasCalibre) ||
        name == names::EllipseMajor || name == names::EllipseMinor);
    if (written)
    {
      continue;
    }
    if (!array.floating)
    {
      attributes->AddArray(array.steps[share < 0.5 ? before : after]);
      continue;
    }
    auto* a = vtkDataArray::SafeDownCast(array.steps[before]);
    auto* b = vtkDataArray::SafeDownCast(array.steps[after]);
    vtkSmartPointer<vtkDataArray> result;
    result.TakeReference(a->NewInstance());
    result->SetName(name.c_str());
    const int components = a->GetNumberOfComponents();
    result->SetNumberOfComponents(components);
    result->SetNumberOfTuples(a->GetNumberOfTuples());
    for (vtkIdType n = 0; n < a->GetNumberOfTuples(); ++n)
    {
      for (int c = 0; c < components; ++c)
      {
        result->SetComponent(
          n, c, (1.0 - share) * a->GetComponent(n, c) + share * b->GetComponent(n, c));
      }
    }
    attributes->AddArray(result);
  }
  this->WriteTwistRate(before, after, gap * cycle, output);
}

/// Twist is interpolated linearly, as all that is not the interpolation's own.
void vtkCardiacPhaseInterpolator::Internals::WriteTwistRate(
  std::size_t before, std::size_t after, double seconds, vtkPointSet* output)
{
  vtkDataArray* twist = output->GetCellData()->GetArray(names::BoneTwist);
  if (!twist)
  {
    return;
  }
  std::vector<double> rates(static_cast<std::size_t>(twist->GetNumberOfTuples()), 0.0);
  for (const VaryingArray& array : this->Reader.Current().varying)
  {
    if (array.cell && seconds > 0.0 &&
      array.steps.front()->GetName() == std::string(names::BoneTwist))
    {
      auto* a = vtkDataArray::SafeDownCast(array.steps[before]);
      auto* b = vtkDataArray::SafeDownCast(array.steps[after]);
      for (std::size_t n = 0; n < rates.size(); ++n)
      {
        const auto bone = static_cast<vtkIdType>(n);
        rates[n] = (b->GetComponent(bone, 0) - a->GetComponent(bone, 0)) / seconds;
      }
    }
  }
  vtkCoronary::AddArray<vtkDoubleArray>(output->GetCellData(), names::BoneTwistRate, rates);
}

vtkCardiacPhaseInterpolator::vtkCardiacPhaseInterpolator()
  : Data(new Internals)
{
}

vtkCardiacPhaseInterpolator::~vtkCardiacPhaseInterpolator() = default;

int vtkCardiacPhaseInterpolator::GetNumberOfReads() const
{
  return this->Data->Reader.NumberOfReads();
}

void vtkCardiacPhaseInterpolator::AddStep(double time)
{
  this->ListedTimes.push_back(time);
  this->Modified();
}

void vtkCardiacPhaseInterpolator::RemoveAllSteps()
{
  if (!this->ListedTimes.empty())
  {
    this->ListedTimes.clear();
    this->Modified();
  }
}

int vtkCardiacPhaseInterpolator::FillInputPortInformation(int, vtkInformation* info)
{
  // Composite data come here to be refused: block by block, the time could not be asked for.
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkCompositeDataSet");
  info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet");
  return 1;
}

vtkTypeBool vtkCardiacPhaseInterpolator::ProcessRequest(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  if (request->Has(SDDP::REQUEST_UPDATE_TIME()))
  {
    this->Data->Reader.RequestTime(inputs[0]->GetInformationObject(0));
    return 1;
  }
  if (request->Has(SDDP::REQUEST_UPDATE_EXTENT()))
  {
    this->Data->Reader.RequestTime(inputs[0]->GetInformationObject(0));
    vtkCoronary::RequestWholeForFirstPiece(request, inputs, 1, outputs);
    return 1;
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

int vtkCardiacPhaseInterpolator::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  outInfo->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  double range[2] = { this->TimeRange[0] * this->Period, this->TimeRange[1] * this->Period };
  std::vector<double> steps;
  switch (this->Steps)
  {
    case InputSteps:
      steps = vtkPoseSequences::StepsOf(inputs[0]->GetInformationObject(0));
      break;
    case EvenSteps:
      for (int n = 0; n < std::clamp(this->NumberOfSteps, 2, 100000); ++n)
      {
        const double share =
          n / static_cast<double>(std::clamp(this->NumberOfSteps, 2, 100000) - 1);
        steps.push_back((1.0 - share) * range[0] + share * range[1]);
      }
      break;
    case ListedSteps:
      steps = this->ListedTimes;
      break;
    default:
      steps = coronary::PaperPhases();
      for (double& step : steps)
      {
        step *= this->Period;
      }
  }
  // What is no time is refused with the data.
  steps.erase(
    std::remove_if(steps.begin(), steps.end(), [](double t) { return !std::isfinite(t); }),
    steps.end());
  std::sort(steps.begin(), steps.end());
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  if (steps.empty())
  {
    outInfo->Remove(SDDP::TIME_STEPS());
  }
  else
  {
    outInfo->Set(SDDP::TIME_STEPS(), steps.data(), static_cast<int>(steps.size()));
    range[0] = std::min(range[0], steps.front());
    range[1] = std::max(range[1], steps.back());
  }
  outInfo->Set(SDDP::TIME_RANGE(), range, 2);
  return 1;
}

int vtkCardiacPhaseInterpolator::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  vtkDataObject* generated = vtkDataObject::GetData(outInfo);
  auto* output = vtkPointSet::SafeDownCast(generated);
  if (outInfo->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    Require(output != nullptr, "The input is composite data: a single point set is needed");
    Require(std::isfinite(this->Period) && this->Period > 0.0, "Period must be greater than 0");
    Require(std::isfinite(this->CycleLength) && this->CycleLength > 0.0,
      "CycleLength must be greater than 0");
    Require(this->AreaStrainLimit >= 0.0 && this->AreaStrainLimit <= 0.9,
      "AreaStrainLimit must be 0 to 0.9");
    Require(
      this->Eccentricity >= 0.0 && this->Eccentricity <= 0.99, "Eccentricity must be 0 to 0.99");
    Require(std::isfinite(this->ReferenceTime), "ReferenceTime must be finite");
    Require(std::isfinite(this->TimeRange[0]) && std::isfinite(this->TimeRange[1]) &&
        this->TimeRange[0] < this->TimeRange[1],
      "TimeRange must be two times, the first less than the second");
    Require(this->Steps >= PaperSteps && this->Steps <= ListedSteps, "Steps must be 0 to 3");
    Require(this->NumberOfSteps >= 2 && this->NumberOfSteps <= 100000,
      "NumberOfSteps must be 2 to 100000");
    for (const double step : this->ListedTimes)
    {
      Require(std::isfinite(step), "A step of the list is not finite");
    }
    vtkPoseSequences::Reader& reader = this->Data->Reader;
    if (!reader.Knows(inInfo))
    {
      this->Data->Motion.reset();
      reader.Read(inInfo, outInfo, vtkCoronary::ProgressOf(this, 0.0, 0.8));
    }
    const vtkPoseSequences::Sequence& data = reader.Current();
    if (data.Empty())
    {
      output->ShallowCopy(data.first);
      return 1;
    }
    if (!this->Data->Motion || this->Data->BuiltAt != this->GetMTime())
    {
      this->Data->Build(this);
    }
    double time = outInfo->Has(SDDP::UPDATE_TIME_STEP()) ? outInfo->Get(SDDP::UPDATE_TIME_STEP())
                                                         : this->ReferenceTime;
    Require(std::isfinite(time), "UPDATE_TIME_STEP: the time must be finite");
    const double phase = time / this->Period;
    coronary::InterpolatedPose& pose = this->Data->Pose;
    this->Data->Motion->Evaluate(phase, pose);

    vtkPoseSequences::Moment moment;
    moment.time = time;
    moment.cycle = data.cycleLength > 0.0 ? data.cycleLength : this->CycleLength;
    moment.points = &pose.points;
    moment.velocity = &pose.velocity;
    moment.angularVelocity = pose.angularVelocity.empty() ? nullptr : &pose.angularVelocity;
    moment.confidence = pose.confidence.empty() ? nullptr : &pose.confidence;
    moment.status = pose.status.empty() ? nullptr : &pose.status;
    moment.rotation = pose.rotation.empty() ? nullptr : &pose.rotation;
    vtkPoseSequences::Write(data.first, moment, output);
    this->Data->WriteOthers(this, phase, moment.cycle, output);
    this->Data->WriteSections(this, phase, moment.cycle, output);

    vtkFieldData* fields = output->GetFieldData();
    const auto add = [fields](const char* name, const std::vector<double>& values)
    { vtkCoronary::AddArray<vtkDoubleArray>(fields, name, values); };
    add(names::PhaseTime, { time });
    add(names::CycleLength, { moment.cycle });
    add(names::Repeatability, { this->Data->Motion->Repeatability() });
    if (this->Mode == LowNoise)
    {
      const coronary::LowNoiseFit& fit = this->Data->Motion->Fit();
      add(names::LowNoiseFit,
        { static_cast<double>(fit.rank), static_cast<double>(fit.order), fit.ridge,
          fit.predicted });
    }
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (...)
  {
    this->Data->Motion.reset();
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the motion");
  }
}

void vtkCardiacPhaseInterpolator::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Mode: " << this->Mode << '\n';
  os << indent << "MergeTolerance: " << this->MergeTolerance << '\n';
  os << indent << "Period: " << this->Period << '\n';
  os << indent << "CycleLength: " << this->CycleLength << '\n';
  os << indent << "MaximumRank: " << this->MaximumRank << '\n';
  os << indent << "MaximumOrder: " << this->MaximumOrder << '\n';
  os << indent << "AreaStrainLimit: " << this->AreaStrainLimit << '\n';
  os << indent << "ReferenceTime: " << this->ReferenceTime << '\n';
  os << indent << "Ellipses: " << this->Ellipses << '\n';
  os << indent << "Eccentricity: " << this->Eccentricity << '\n';
  os << indent << "Steps: " << this->Steps << '\n';
  os << indent << "NumberOfSteps: " << this->NumberOfSteps << '\n';
  os << indent << "ListedTimes:";
  for (const double time : this->ListedTimes)
  {
    os << ' ' << time;
  }
  os << '\n';
  os << indent << "TimeRange: " << this->TimeRange[0] << ' ' << this->TimeRange[1] << '\n';
}
