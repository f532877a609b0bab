#include "vtkPopulationMotion.h"

#include "BranchPlacement.h"
#include "PopulationMotion.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkMovedLines.h"
#include "vtkPoseSequences.h"
#include "vtkVesselTree.h"

#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace names = vtkCoronaryArrayNames;
using coronary::Vector3;
using vtkMovedLines::Connection;
using vtkMovedLines::FieldValue;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkPopulationMotion);

namespace
{
enum InputPorts
{
  LinesPort = 0,
  SkeletonPort = 1,
  TrackedPort = 2
};

constexpr double UsualRate = 75.0;

constexpr double NotTold = std::numeric_limits<double>::quiet_NaN();

coronary::HeartPose FrameOf(vtkPolyData* lines)
{
  vtkDataArray* frame = lines->GetFieldData()->GetArray(names::HeartFrame);
  vtkCoronary::Require(frame != nullptr && frame->GetNumberOfValues() == 16,
    "The lines have no field array HeartFrame of 16 values: name the segments with the Coronary "
    "Tree Topology filter");
  std::array<double, 16> matrix{};
  for (vtkIdType n = 0; n < 16; ++n)
  {
    matrix[static_cast<std::size_t>(n)] = frame->GetVariantValue(n).ToDouble();
  }
  return coronary::HeartPoseOf(matrix);
}
}

struct vtkPopulationMotion::Internals
{
  // What was made, and of what.
  bool Known = false;
  vtkMTimeType KnownOf = 0;
  vtkMTimeType LinesTime = 0;
  vtkMTimeType TrackedTime = 0;
  int Motions = 0;

  vtkPoseSequences::Reader Tracked;
  coronary::Polylines Lines;
  coronary::PatientHeart Heart;
  coronary::PoseSequence Poses;
  coronary::PopulationMotionReport Report;
  double Reference = 0.0;
  double Cycle = 0.0;
  std::vector<std::vector<double>> Placement; ///< per phase and point
  std::string Source;

  /// Whether what is there at a phase is the patient's own.
  bool IsTracked(std::size_t phase) const
  {
    const std::vector<coronary::TrackingStatus>& status = this->Poses.status[phase];
    return std::any_of(status.begin(), status.end(),
      [](coronary::TrackingStatus own) { return own != coronary::TrackingStatus::Filled; });
  }

  static vtkMTimeType TimeOf(vtkInformation* info)
  {
    return info != nullptr ? vtkCoronary::UpstreamTime(info) : 0;
  }

  bool Knows(vtkPopulationMotion* self, vtkInformationVector** inputs) const
  {
    return this->Known && this->KnownOf == self->GetMTime() &&
      this->LinesTime == TimeOf(Connection(inputs, LinesPort)) &&
      this->TrackedTime == TimeOf(Connection(inputs, TrackedPort));
  }
};

vtkPopulationMotion::vtkPopulationMotion()
  : Data(new Internals)
{
  this->SetNumberOfInputPorts(3);
  this->SetNumberOfOutputPorts(2);
}

vtkPopulationMotion::~vtkPopulationMotion() = default;

int vtkPopulationMotion::GetNumberOfMotions() const
{
  return this->Data->Motions;
}

int vtkPopulationMotion::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  if (port != LinesPort)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

vtkTypeBool vtkPopulationMotion::ProcessRequest(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  const bool extent = request->Has(SDDP::REQUEST_UPDATE_EXTENT()) != 0;
  if (extent || request->Has(SDDP::REQUEST_UPDATE_TIME()))
  {
    // The slider's time is not what is needed of the inputs.
    for (const int port : { LinesPort, SkeletonPort })
    {
      vtkInformation* info = Connection(inputs, port);
      if (info != nullptr && !info->Has(SDDP::TIME_STEPS()))
      {
        info->Remove(SDDP::UPDATE_TIME_STEP());
      }
    }
    if (Connection(inputs, TrackedPort) != nullptr)
    {
      this->Data->Tracked.RequestTime(Connection(inputs, TrackedPort));
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

int vtkPopulationMotion::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // Data that were never asked for do not tell their phase yet; even moments are offered in any case.
  double reference = this->ReferenceTime;
  if (this->AutomaticReference)
  {
    reference = FieldValue(vtkPolyData::GetData(inputs[LinesPort], 0), names::PhaseTime, NotTold);
  }
  reference = std::isfinite(reference) ? reference : 0.0;
  std::vector<double> seen;
  if (vtkInformation* tracked = Connection(inputs, TrackedPort))
  {
    seen = vtkPoseSequences::StepsOf(tracked);
  }
  try
  {
    vtkMovedLines::SetTimes(
      outputs, coronary::PopulationTimes(reference, seen, this->NumberOfSteps));
  }
  catch (const std::exception& error)
  {
    return vtkCoronary::ReportFailure(this, error.what());
  }
  return 1;
}

void vtkPopulationMotion::Move(vtkInformationVector** inputs, vtkInformation* outInfo)
{
  using vtkCoronary::Require;
  vtkPolyData* input = vtkPolyData::GetData(inputs[LinesPort], 0);
  vtkInformation* tracked = Connection(inputs, TrackedPort);
  Internals& data = *this->Data;
  data.Known = false;
  Require(this->NumberOfSteps >= 4 && this->NumberOfSteps <= 200, "NumberOfSteps must be 4 to 200");
  Require(this->HeartRate == 0.0 || (this->HeartRate >= 30.0 && this->HeartRate <= 180.0),
    "HeartRate must be 0, or 30 to 180");
  Require(
    this->TemporalWindow >= 0.0 && this->TemporalWindow <= 1.0, "TemporalWindow must be 0 to 1 s");
  Require(this->Amplitude >= 0.0 && this->Amplitude <= 2.0, "Amplitude must be 0 to 2");
  data.Reference = this->ReferenceTime;
  if (this->AutomaticReference)
  {
    data.Reference = FieldValue(input, names::PhaseTime, NotTold);
    Require(std::isfinite(data.Reference),
      "The lines have no field array PhaseTime, which says of which phase they are: switch "
      "AutomaticReference off and give ReferenceTime");
  }
  Require(std::isfinite(data.Reference), "ReferenceTime must be finite");
  coronary::VesselTree tree = vtkCoronary::TreeOf(input, vtkCoronary::Radii::IfThere);
  vtkCoronary::AddPointValues(input, tree);
  data.Heart = coronary::EstimateHeart(tree, FrameOf(input));
  data.Lines = vtkPoseSequences::LinesOf(input, vtkCoronary::FindRadius(input));

  coronary::PopulationMotionSettings settings;
  settings.amplitude = this->Amplitude;
  settings.heartRate = this->HeartRate;
  if (this->HeartRate == 0.0)
  {
    const double cycle = FieldValue(input, names::CycleLength, NotTold);
    settings.heartRate = std::isfinite(cycle) && cycle > 0.0 ? 60.0 / cycle : UsualRate;
  }
  data.Cycle = 60.0 / settings.heartRate;

  const coronary::PoseSequence* seen = nullptr;
  if (tracked != nullptr)
  {
    const vtkPoseSequences::Sequence& sequence =
      data.Tracked.Read(tracked, outInfo, vtkCoronary::ProgressOf(this, 0.0, 0.9));
    Require(!sequence.Empty() &&
        vtkPoseSequences::LinesOf(vtkPolyData::SafeDownCast(sequence.first), nullptr).lines ==
          data.Lines.lines,
      "The tracked lines are not those of the input");
    seen = &sequence.poses;
  }
  const std::vector<double> times = coronary::PopulationTimes(
    data.Reference, seen != nullptr ? seen->times : std::vector<double>(), this->NumberOfSteps);
  data.Poses = coronary::MoveByPopulation(data.Lines, data.Heart, data.Reference, times, seen,
    settings, &data.Report, vtkCoronary::ProgressOf(this, 0.9, 1.0));
  data.Source =
    coronary::PopulationMotionStatement(data.Report.phases, settings.heartRate, settings.amplitude);
  std::vector<std::vector<double>> deviations;
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    deviations.push_back(data.IsTracked(k) ? std::vector<double>() : data.Report.deviations[k]);
  }
  data.Placement = coronary::PlacementConfidences(data.Lines, vtkMovedLines::EvidenceOf(input),
    data.Poses, { data.Reference, this->TemporalWindow / data.Cycle }, deviations);
  ++data.Motions;
  data.Known = true;
  data.KnownOf = this->GetMTime();
  data.LinesTime = Internals::TimeOf(Connection(inputs, LinesPort));
  data.TrackedTime = Internals::TimeOf(tracked);
  for (const std::string& warning : data.Report.warnings)
  {
    vtkWarningMacro(<< warning);
  }
}

int vtkPopulationMotion::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  vtkPolyData* input = vtkPolyData::GetData(inputs[LinesPort], 0);
  vtkPolyData* output[2] = { vtkPolyData::GetData(outputs, 0), vtkPolyData::GetData(outputs, 1) };
  if (outInfo->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0 || input->GetNumberOfPoints() == 0)
  {
    return 1;
  }
  Internals& data = *this->Data;
  try
  {
    if (!data.Knows(this, inputs))
    {
      this->Move(inputs, vtkMovedLines::AskedOutput(request, outputs));
    }
    const std::vector<double>& times = data.Poses.times;
    const double wanted = vtkMovedLines::AskedTime(request, outputs, data.Reference);
    vtkCoronary::Require(std::isfinite(wanted), "UPDATE_TIME_STEP: the time must be finite");
    const std::size_t phase = vtkMovedLines::NearestIndex(times, wanted);
    const auto write = [&](vtkPolyData* like, const vtkPoseSequences::Moment& moment,
                         const std::vector<double>& deviations, vtkPolyData* out)
    {
      vtkMovedLines::Write(input, like, moment, data.Cycle, data.Reference, out);
      vtkCoronary::AddArray<vtkDoubleArray>(
        out->GetPointData(), names::MotionDeviation, deviations);
      vtkFieldData* fields = out->GetFieldData();
      const auto numbers = [fields](const char* name, const std::vector<double>& values)
      { vtkCoronary::AddArray<vtkDoubleArray>(fields, name, values); };
      vtkCoronary::AddArray<vtkStringArray>(
        fields, names::MotionSource, std::vector<vtkStdString>{ vtkStdString(data.Source) });
      vtkCoronary::AddArray<vtkIntArray>(
        fields, names::MotionPhases, std::vector<int>{ data.Report.phases });
      const coronary::PatientHeart& heart = data.Heart;
      vtkCoronary::AddArray<vtkStringArray>(fields, names::HeartLandmarks,
        std::vector<vtkStdString>(heart.from.begin(), heart.from.end()));
      numbers(names::LongAxis,
        { heart.base[0], heart.base[1], heart.base[2], heart.apex[0], heart.apex[1],
          heart.apex[2] });
      numbers(names::LongAxisDeviation,
        { heart.axisDeviation, heart.baseDeviation, heart.lengthDeviation });
      numbers(names::PopulationValues,
        std::vector<double>(data.Report.mean.begin(), data.Report.mean.end()));
      // No NaN here: VTK gathers the ranks' data in a form of text that cannot hold it.
      numbers(names::PopulationMisfit,
        std::isnan(data.Report.populationMisfit)
          ? std::vector<double>()
          : std::vector<double>{ data.Report.populationMisfit, data.Report.bentMisfit });
    };
    write(input, vtkPoseSequences::MomentOf(data.Poses, phase), data.Report.deviations[phase],
      output[0]);
    vtkCoronary::AddArray<vtkDoubleArray>(
      output[0]->GetPointData(), names::PlacementConfidence, data.Placement[phase]);

    vtkInformation* skeletonInfo = Connection(inputs, SkeletonPort);
    vtkPolyData* skeleton = skeletonInfo != nullptr ? vtkPolyData::GetData(skeletonInfo) : nullptr;
    if (skeleton != nullptr && skeleton->GetNumberOfPoints() > 0)
    {
      const vtkMovedLines::Feet feet(data.Lines, skeleton);
      const vtkMovedLines::PosedSkeleton posed(
        feet, data.Lines.points, data.Poses, phase, skeleton);
      write(skeleton, posed.At(times[phase]), feet.At(data.Report.deviations[phase]), output[1]);
    }
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the motion");
  }
}

void vtkPopulationMotion::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "AutomaticReference: " << this->AutomaticReference << '\n';
  os << indent << "ReferenceTime: " << this->ReferenceTime << '\n';
  os << indent << "HeartRate: " << this->HeartRate << '\n';
  os << indent << "TemporalWindow: " << this->TemporalWindow << '\n';
  os << indent << "Amplitude: " << this->Amplitude << '\n';
  os << indent << "NumberOfSteps: " << this->NumberOfSteps << '\n';
}
