#include "vtkMotionRegularizer.h"

#include "MotionRegularization.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkPoseSequences.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMath.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;
using vtkCoronary::Require;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkMotionRegularizer);

struct vtkMotionRegularizer::Internals
{
  vtkPoseSequences::Reader Reader;
  coronary::RegularizedMotion Motion;
  bool Solved = false;
  vtkMTimeType SolvedAt = 0;   ///< modified time of the settings
  vtkMTimeType SolvedRest = 0; ///< of what is upstream of the second port
  int Solutions = 0;
};

namespace
{
bool Connected(vtkInformationVector* input)
{
  return input->GetNumberOfInformationObjects() > 0;
}

std::size_t Nearest(const std::vector<double>& times, double time, double period)
{
  // Without a period: on the axis of time.
  const auto apart = [=](double a)
  {
    const double gap = a - time;
    return period > 0.0 ? std::abs(gap - period * std::round(gap / period)) : std::abs(gap);
  };
  return static_cast<std::size_t>(std::min_element(times.begin(), times.end(),
                                    [&](double a, double b) { return apart(a) < apart(b); }) -
    times.begin());
}

/// The tracker's way from rest goes with the points.
void MoveDisplacement(vtkPointData* data, vtkDoubleArray* moves)
{
  vtkDataArray* ways = data->GetArray(names::Displacement);
  if (!ways || ways->GetNumberOfComponents() != 3)
  {
    return;
  }
  vtkNew<vtkDoubleArray> moved;
  moved->DeepCopy(ways);
  for (vtkIdType n = 0; n < moves->GetNumberOfTuples(); ++n)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      moved->SetComponent(n, axis, ways->GetComponent(n, axis) + moves->GetComponent(n, axis));
    }
  }
  moved->SetName(names::Displacement);
  data->AddArray(moved);
}

void RequireLines(vtkPolyData* data, const std::string& whose)
{
  Require(data->GetNumberOfCells() == data->GetLines()->GetNumberOfCells(),
    whose + " has cells that are no lines");
}
}

vtkMotionRegularizer::vtkMotionRegularizer()
  : Data(new Internals)
{
  this->SetNumberOfInputPorts(2);
}

vtkMotionRegularizer::~vtkMotionRegularizer() = default;

int vtkMotionRegularizer::GetNumberOfSolutions() const
{
  return this->Data->Solutions;
}

int vtkMotionRegularizer::FillInputPortInformation(int port, vtkInformation* info)
{
  // Composite data come here to be refused: block by block, the time could not be asked for.
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkCompositeDataSet");
  info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  if (port == 1)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

vtkTypeBool vtkMotionRegularizer::ProcessRequest(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  const bool extent = request->Has(SDDP::REQUEST_UPDATE_EXTENT()) != 0;
  if (extent || request->Has(SDDP::REQUEST_UPDATE_TIME()))
  {
    this->Data->Reader.RequestTime(inputs[0]->GetInformationObject(0));
    if (Connected(inputs[1]))
    {
      vtkInformation* rest = inputs[1]->GetInformationObject(0);
      const vtkCoronary::Moment moment =
        vtkCoronary::NearestMoment(rest, false, this->ReferenceTime);
      if (moment.exists)
      {
        rest->Set(SDDP::UPDATE_TIME_STEP(), moment.time);
      }
      else
      {
        rest->Remove(SDDP::UPDATE_TIME_STEP());
      }
    }
    if (extent)
    {
      vtkCoronary::RequestWholeForFirstPiece(
        request, inputs, this->GetNumberOfInputPorts(), outputs);
    }
    return 1;
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

int vtkMotionRegularizer::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  outInfo->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  const std::vector<double> steps = vtkPoseSequences::StepsOf(inputs[0]->GetInformationObject(0));
  if (steps.empty())
  {
    outInfo->Remove(SDDP::TIME_STEPS());
    outInfo->Remove(SDDP::TIME_RANGE());
    return 1;
  }
  outInfo->Set(SDDP::TIME_STEPS(), steps.data(), static_cast<int>(steps.size()));
  const double range[2] = { *std::min_element(steps.begin(), steps.end()),
    *std::max_element(steps.begin(), steps.end()) };
  outInfo->Set(SDDP::TIME_RANGE(), range, 2);
  return 1;
}

int vtkMotionRegularizer::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  vtkPolyData* output = vtkPolyData::GetData(outInfo);
  if (outInfo->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    Require(vtkPolyData::GetData(inInfo) != nullptr,
      "The input is composite data: a single poly data is needed");
    Require(std::isfinite(this->Period) && this->Period > 0.0, "Period must be greater than 0");
    Require(std::isfinite(this->ReferenceTime), "ReferenceTime must be finite");
    Require(this->MaximumBending >= 1.0 && this->MaximumBending <= 180.0,
      "MaximumBending must be 1 to 180 degrees");
    Require(this->MaximumStep >= 0.0, "MaximumStep must be 0 or more");
    Internals& data = *this->Data;
    if (!data.Reader.Knows(inInfo))
    {
      data.Solved = false;
      data.Reader.Read(inInfo, outInfo, vtkCoronary::ProgressOf(this, 0.0, 0.4));
    }
    const vtkPoseSequences::Sequence& sequence = data.Reader.Current();
    if (sequence.Empty())
    {
      output->ShallowCopy(sequence.first);
      return 1;
    }
    const vtkMTimeType restTime =
      Connected(inputs[1]) ? vtkCoronary::UpstreamTime(inputs[1]->GetInformationObject(0)) : 0;
    const std::vector<double>& times = sequence.poses.times;
    if (!data.Solved || data.SolvedAt != this->GetMTime() || data.SolvedRest != restTime)
    {
      data.Solved = false;
      auto* first = vtkPolyData::SafeDownCast(sequence.first);
      RequireLines(first, "The input");
      coronary::Polylines lines = vtkPoseSequences::LinesOf(first, nullptr);
      if (Connected(inputs[1]))
      {
        vtkPolyData* rest = vtkPolyData::GetData(inputs[1]->GetInformationObject(0));
        Require(
          rest != nullptr, "The lines at rest are composite data: a single poly data is needed");
        const coronary::Polylines still = vtkPoseSequences::LinesOf(rest, nullptr);
        Require(still.points.size() == lines.points.size() && still.lines == lines.lines,
          "The lines at rest are not those of the input");
        lines.points = still.points;
      }
      else
      {
        lines.points = sequence.poses.points[Nearest(times, this->ReferenceTime, this->Period)];
      }
      coronary::PoseSequence poses = sequence.poses;
      for (double& time : poses.times)
      {
        time /= this->Period;
      }
      coronary::MotionRegularizationSettings settings;
      settings.energy = static_cast<coronary::MotionEnergy>(this->Energy);
      settings.temporalWeight = this->TemporalWeight;
      settings.spatialWeight = this->SpatialWeight;
      settings.velocityWeight = this->VelocityWeight;
      settings.maximumBending = vtkMath::RadiansFromDegrees(this->MaximumBending);
      settings.minimumCurvatureRadius = this->MinimumCurvatureRadius;
      constexpr double None = std::numeric_limits<double>::infinity();
      settings.maximumStrain = this->MaximumStrain == 0.0 ? None : this->MaximumStrain;
      settings.maximumStep = this->MaximumStep == 0.0 ? None : this->MaximumStep;
      settings.wellTracked = this->WellTracked;
      settings.tolerance = this->Tolerance;
      settings.measureNoise = this->MeasureNoise;
      settings.youngsModulus = this->YoungsModulus;
      settings.iterations = this->Iterations;
      settings.precision = this->Precision;
      try
      {
        data.Motion = coronary::RegularizeMotion(
          poses, lines, settings, vtkCoronary::ProgressOf(this, 0.4, 1.0));
      }
      catch (const std::invalid_argument& error)
      {
        throw std::invalid_argument(vtkCoronary::PropertyMessage(error.what()));
      }
      ++data.Solutions;
      data.Solved = true;
      data.SolvedAt = this->GetMTime();
      data.SolvedRest = restTime;
    }
    const double time = outInfo->Has(SDDP::UPDATE_TIME_STEP())
      ? outInfo->Get(SDDP::UPDATE_TIME_STEP())
      : times.front();
    Require(std::isfinite(time), "UPDATE_TIME_STEP: the time must be finite");
    const std::size_t k = Nearest(times, time, 0.0);
    const coronary::RegularizedMotion& motion = data.Motion;
    vtkPoseSequences::Moment moment = vtkPoseSequences::MomentOf(motion.poses, k);
    moment.time = times[k];
    vtkPoseSequences::Write(sequence.first, moment, output);
    vtkPoseSequences::WriteVarying(sequence, k, output);

    vtkPointData* pointData = output->GetPointData();
    vtkCoronary::AddArray<vtkIntArray>(pointData, names::MotionClamps, motion.clamps[k]);
    vtkNew<vtkDoubleArray> moves;
    moves->SetName(names::RegularizationMove);
    moves->SetNumberOfComponents(3);
    moves->SetNumberOfTuples(output->GetNumberOfPoints());
    for (std::size_t n = 0; n < motion.poses.points[k].size(); ++n)
    {
      const coronary::Vector3 move = motion.poses.points[k][n] - sequence.poses.points[k][n];
      moves->SetTuple(static_cast<vtkIdType>(n), move.data());
    }
    pointData->AddArray(moves);
    MoveDisplacement(pointData, moves);
    vtkCoronary::AddArray<vtkDoubleArray>(
      output->GetCellData(), names::AxialStrain, motion.strain[k]);
    vtkCoronary::AddArray<vtkDoubleArray>(
      output->GetCellData(), names::AxialStress, motion.stress[k]);

    vtkFieldData* fields = output->GetFieldData();
    const auto add = [fields](const char* name, const std::vector<double>& values)
    { vtkCoronary::AddArray<vtkDoubleArray>(fields, name, values); };
    add(names::PhaseTime, { moment.time });
    add(names::TemporalEnergy, { motion.before.temporal, motion.after.temporal });
    add(names::SpatialEnergy, { motion.before.spatial, motion.after.spatial });
    add(names::TotalEnergy, { motion.before.total, motion.after.total });
    add(names::MotionObjective, { motion.before.objective, motion.after.objective });
    add(names::MaximumMove, { motion.maximumMove });
    add(names::MotionNoise, motion.noise);
    vtkCoronary::AddArray<vtkIdTypeArray>(fields, names::ClampedPoints,
      std::vector<vtkIdType>(motion.clamped.begin(), motion.clamped.end()));
    vtkCoronary::AddArray<vtkIdTypeArray>(
      fields, names::LimitViolations, std::vector<vtkIdType>{ motion.violations });
    vtkCoronary::AddArray<vtkIntArray>(
      fields, names::LimitIterations, std::vector<int>{ motion.iterations });
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the motion");
  }
}

void vtkMotionRegularizer::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Energy: " << this->Energy << '\n';
  os << indent << "TemporalWeight: " << this->TemporalWeight << '\n';
  os << indent << "SpatialWeight: " << this->SpatialWeight << '\n';
  os << indent << "VelocityWeight: " << this->VelocityWeight << '\n';
  os << indent << "MaximumBending: " << this->MaximumBending << '\n';
  os << indent << "MinimumCurvatureRadius: " << this->MinimumCurvatureRadius << '\n';
  os << indent << "MaximumStrain: " << this->MaximumStrain << '\n';
  os << indent << "MaximumStep: " << this->MaximumStep << '\n';
  os << indent << "WellTracked: " << this->WellTracked << '\n';
  os << indent << "Tolerance: " << this->Tolerance << '\n';
  os << indent << "MeasureNoise: " << this->MeasureNoise << '\n';
  os << indent << "YoungsModulus: " << this->YoungsModulus << '\n';
  os << indent << "Precision: " << this->Precision << '\n';
  os << indent << "Iterations: " << this->Iterations << '\n';
  os << indent << "ReferenceTime: " << this->ReferenceTime << '\n';
  os << indent << "Period: " << this->Period << '\n';
}
