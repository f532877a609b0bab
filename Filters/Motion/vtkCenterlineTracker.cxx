#include "vtkCenterlineTracker.h"

#include "BranchPlacement.h"
#include "CenterlineTracking.h"
#include "LumenSight.h"
#include "VesselImage.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkMovedLines.h"
#include "vtkPoseSequences.h"

#include "vtkCellArray.h"
#include "vtkCellArrayIterator.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace names = vtkCoronaryArrayNames;
using coronary::PoseSequence;
using coronary::Vector3;
using vtkMovedLines::Connection;
using vtkMovedLines::FieldValue;
using vtkMovedLines::NearestIndex;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCenterlineTracker);

namespace
{
enum TrackerPorts
{
  TrackerSeriesPort = 0,
  TrackerLinesPort = 1,
  TrackerSkeletonPort = 2
};

/// R-R interval in seconds where nothing says it.
constexpr double UsualCycleLength = 0.8;

/// mm: voxels of images of lines and surfaces, and their margin. As fine as a CT's.
constexpr double DrawnSpacing = 0.5;
constexpr double DrawnMargin = 3.0;

bool IsSurface(vtkPolyData* shapes)
{
  return shapes != nullptr && shapes->GetNumberOfPolys() + shapes->GetNumberOfStrips() > 0;
}

/// Polygons and strips as triangles, turned as they are.
std::vector<coronary::Triangle> TrianglesOf(vtkPolyData* surface)
{
  std::vector<coronary::Triangle> triangles;
  vtkIdType count = 0;
  const vtkIdType* points = nullptr;
  const auto polygons =
    vtkSmartPointer<vtkCellArrayIterator>::Take(surface->GetPolys()->NewIterator());
  for (polygons->GoToFirstCell(); !polygons->IsDoneWithTraversal(); polygons->GoToNextCell())
  {
    polygons->GetCurrentCell(count, points);
    for (vtkIdType n = 2; n < count; ++n)
    {
      triangles.push_back({ points[0], points[n - 1], points[n] });
    }
  }
  const auto strips =
    vtkSmartPointer<vtkCellArrayIterator>::Take(surface->GetStrips()->NewIterator());
  for (strips->GoToFirstCell(); !strips->IsDoneWithTraversal(); strips->GoToNextCell())
  {
    strips->GetCurrentCell(count, points);
    for (vtkIdType n = 2; n < count; ++n)
    {
      const vtkIdType odd = n % 2;
      triangles.push_back({ points[n - 2 + odd], points[n - 1 - odd], points[n] });
    }
  }
  return triangles;
}

/// An image of what is in poly data: closed surfaces, or else lines.
coronary::VesselImage Drawn(vtkPolyData* shapes)
{
  if (IsSurface(shapes))
  {
    std::vector<Vector3> points;
    for (vtkIdType n = 0; n < shapes->GetNumberOfPoints(); ++n)
    {
      points.emplace_back(shapes->GetPoint(n));
    }
    return coronary::RenderSurface(points, TrianglesOf(shapes), DrawnSpacing, DrawnMargin);
  }
  vtkCoronary::Require(shapes != nullptr && shapes->GetNumberOfLines() > 0,
    "The series has neither lines nor surfaces");
  return coronary::RenderLines(
    vtkPoseSequences::LinesOf(shapes, vtkCoronary::FindRadius(shapes)), DrawnSpacing, DrawnMargin);
}
}

struct vtkCenterlineTracker::Internals
{
  // What was tracked, and of what.
  bool Known = false;
  vtkMTimeType KnownOf = 0;
  vtkMTimeType SeriesTime = 0;
  vtkMTimeType LinesTime = 0;
  vtkCoronary::Moment LastAsked;
  int Trackings = 0;

  coronary::Polylines Lines;
  PoseSequence Poses;
  coronary::CenterlineTrackingReport Report;
  double Reference = 0.0;
  double Cycle = 0.0;
  std::vector<std::vector<double>> Placement; ///< per phase and point
  std::vector<coronary::LumenSight> Sights;   ///< per phase; of images of tissue only

  bool Knows(vtkCenterlineTracker* self, vtkInformationVector** inputs) const
  {
    return this->Known && this->KnownOf == self->GetMTime() &&
      this->SeriesTime == vtkCoronary::UpstreamTime(Connection(inputs, TrackerSeriesPort)) &&
      this->LinesTime == vtkCoronary::UpstreamTime(Connection(inputs, TrackerLinesPort));
  }
};

vtkCenterlineTracker::vtkCenterlineTracker()
  : Data(new Internals)
{
  this->SetNumberOfInputPorts(3);
  this->SetNumberOfOutputPorts(2);
}

vtkCenterlineTracker::~vtkCenterlineTracker() = default;

int vtkCenterlineTracker::GetNumberOfTrackings() const
{
  return this->Data->Trackings;
}

void vtkCenterlineTracker::AddTrackedTime(double time)
{
  this->TrackedTimes.push_back(time);
  this->Modified();
}

void vtkCenterlineTracker::RemoveAllTrackedTimes()
{
  if (!this->TrackedTimes.empty())
  {
    this->TrackedTimes.clear();
    this->Modified();
  }
}

int vtkCenterlineTracker::FillInputPortInformation(int port, vtkInformation* info)
{
  if (port == TrackerSeriesPort)
  {
    info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
    info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
    return 1;
  }
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  if (port == TrackerSkeletonPort)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

std::vector<double> vtkCenterlineTracker::Selected(const std::vector<double>& steps) const
{
  std::vector<double> result;
  if (this->TrackedPhases == ListedPhases)
  {
    for (const double time : this->TrackedTimes)
    {
      if (!std::isfinite(time))
      {
        throw std::invalid_argument("TrackedTimes must be finite");
      }
      result.push_back(steps[NearestIndex(steps, time)]);
    }
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    if (result.empty())
    {
      throw std::invalid_argument("TrackedTimes is empty: there is no phase to track");
    }
    return result;
  }
  for (std::size_t k = 0; k < steps.size(); k += this->TrackedPhases == EvenPhases ? 2 : 1)
  {
    result.push_back(steps[k]);
  }
  return result;
}

int vtkCenterlineTracker::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  std::vector<double> times = vtkPoseSequences::StepsOf(Connection(inputs, TrackerSeriesPort));
  try
  {
    if (!times.empty())
    {
      times = this->Selected(times);
    }
  }
  catch (const std::exception& error)
  {
    return vtkCoronary::ReportFailure(this, error.what());
  }
  vtkMovedLines::SetTimes(outputs, times);
  return 1;
}

int vtkCenterlineTracker::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  // Of the series what it has already, or else a step that will be read: the slider's time is not
  // what is needed.
  vtkInformation* series = Connection(inputs, TrackerSeriesPort);
  const std::vector<double> steps = vtkPoseSequences::StepsOf(series);
  if (this->Data->Known && this->Data->LastAsked.exists)
  {
    series->Set(SDDP::UPDATE_TIME_STEP(), this->Data->LastAsked.time);
  }
  else if (!steps.empty())
  {
    series->Set(SDDP::UPDATE_TIME_STEP(), steps.front());
  }
  for (int port = TrackerLinesPort; port <= TrackerSkeletonPort; ++port)
  {
    vtkInformation* info = Connection(inputs, port);
    if (info != nullptr && !info->Has(SDDP::TIME_STEPS()))
    {
      info->Remove(SDDP::UPDATE_TIME_STEP());
    }
  }
  return 1;
}

void vtkCenterlineTracker::Track(vtkInformationVector** inputs)
{
  using vtkCoronary::Require;
  vtkInformation* series = Connection(inputs, TrackerSeriesPort);
  vtkPolyData* input = vtkPolyData::GetData(inputs[TrackerLinesPort], 0);
  Internals& data = *this->Data;
  data.Known = false;
  const vtkMTimeType seriesTime = vtkCoronary::UpstreamTime(series);
  const vtkMTimeType linesTime = vtkCoronary::UpstreamTime(Connection(inputs, TrackerLinesPort));

  const std::vector<double> steps = vtkPoseSequences::StepsOf(series);
  Require(!steps.empty(), "The series has no time steps");
  Require(steps.size() > 1, "The series has one phase only: there is no motion to track");
  for (std::size_t k = 1; k < steps.size(); ++k)
  {
    Require(steps[k] > steps[k - 1], "The time steps of the series do not increase");
  }
  const std::vector<double> times = this->Selected(steps);
  data.Reference = this->ReferenceTime;
  if (this->AutomaticReference)
  {
    data.Reference = FieldValue(input, names::PhaseTime, std::numeric_limits<double>::quiet_NaN());
    Require(std::isfinite(data.Reference),
      "The lines have no field array PhaseTime, which says at which phase they were found: switch "
      "AutomaticReference off and give ReferenceTime");
  }
  Require(std::isfinite(data.Reference), "ReferenceTime must be finite");
  data.Lines = vtkPoseSequences::LinesOf(input, vtkCoronary::FindRadius(input));

  coronary::CenterlineTrackingSettings settings;
  settings.temporalWindow = this->TemporalWindow;
  settings.nodeSpacing = this->NodeSpacing;
  settings.captureRange = this->CaptureRange;
  vtkDataObject* first = vtkDataObject::GetData(series);
  const bool images = vtkImageData::SafeDownCast(first) != nullptr;
  settings.tissue = images && this->ImageContent == Tomogram;
  if (!settings.tissue)
  {
    settings.temporalWindow = 0.0;
  }
  // Surfaces show walls that the lines do not know of.
  const bool hasReference =
    std::abs(vtkCoronary::NearestMoment(series, false, data.Reference).time - data.Reference) <
    1e-3;
  const bool fromLines = !images && !(hasReference && IsSurface(vtkPolyData::SafeDownCast(first)));
  data.Cycle =
    FieldValue(first, names::CycleLength, FieldValue(input, names::CycleLength, UsualCycleLength));
  settings.cycleLength = data.Cycle;

  vtkCoronary::UpstreamRequest request(series, series);
  std::array<int, 6> whole{ 0, -1, 0, -1, 0, -1 };
  if (series->Has(SDDP::WHOLE_EXTENT()))
  {
    series->Get(SDDP::WHOLE_EXTENT(), whole.data());
  }
  std::vector<float> copy;
  coronary::VesselImage drawn;
  const auto imageAt = [&](double time)
  {
    coronary::ScalarImage image;
    if (fromLines && time == data.Reference)
    {
      drawn = coronary::RenderLines(data.Lines, DrawnSpacing, DrawnMargin);
      return drawn.View();
    }
    const vtkCoronary::Moment moment = vtkCoronary::NearestMoment(series, false, time);
    data.LastAsked = moment;
    request.Ask(images ? &whole : nullptr, moment);
    vtkDataObject* now = vtkDataObject::GetData(series);
    const std::string where = " at the time " + std::to_string(moment.time);
    if (auto* voxels = vtkImageData::SafeDownCast(now))
    {
      Require(voxels->GetNumberOfPoints() > 0, "The image" + where + " has no voxels");
      vtkDataArray* array =
        vtkCoronary::VoxelArrayOf(voxels, this->ImageArrayName, "the image" + where);
      return vtkCoronary::ScalarImageOf(voxels, array, copy);
    }
    try
    {
      drawn = Drawn(vtkPolyData::SafeDownCast(now));
    }
    catch (const std::invalid_argument& error)
    {
      throw std::invalid_argument(error.what() + where);
    }
    return drawn.View();
  };
  Require(!images || hasReference,
    "The reference time " + std::to_string(data.Reference) +
      " is none of the time steps of the series");
  coronary::ItemSharing& sharing =
    this->Sharing != nullptr ? *this->Sharing : coronary::ItemSharing::None();
  const double tracked = settings.tissue ? 0.95 : 1.0; // of the work
  data.Poses = coronary::TrackCenterlines(data.Lines, data.Reference, times, imageAt, settings,
    &data.Report, vtkCoronary::ProgressOf(this, 0.0, tracked), sharing);
  coronary::PlacementEvidence evidence = vtkMovedLines::EvidenceOf(input);
  if (settings.tissue)
  {
    evidence.sights = coronary::SeeLumens(
      data.Lines, data.Poses, imageAt, vtkCoronary::ProgressOf(this, tracked, 1.0), sharing);
  }
  data.Placement = coronary::PlacementConfidences(
    data.Lines, evidence, data.Poses, { data.Reference, settings.temporalWindow / data.Cycle });
  data.Sights = std::move(evidence.sights);
  ++data.Trackings;
  data.Known = true;
  data.KnownOf = this->GetMTime();
  data.SeriesTime = seriesTime;
  data.LinesTime = linesTime;
  for (const std::string& warning : data.Report.warnings)
  {
    vtkWarningMacro(<< warning);
  }
}

int vtkCenterlineTracker::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  vtkPolyData* input = vtkPolyData::GetData(inputs[TrackerLinesPort], 0);
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
      this->Track(inputs);
    }
    const std::vector<double>& times = data.Poses.times;
    const std::size_t phase =
      NearestIndex(times, vtkMovedLines::AskedTime(request, outputs, times.front()));
    const auto write =
      [&](vtkPolyData* like, const vtkPoseSequences::Moment& moment, vtkPolyData* out)
    {
      vtkMovedLines::Write(input, like, moment, data.Cycle, data.Reference, out);
      vtkFieldData* fields = out->GetFieldData();
      vtkCoronary::AddArray<vtkDoubleArray>(fields, names::TrackedShare, data.Report.trackedShare);
      if (data.Report.repeatedPhases > 0)
      {
        vtkCoronary::AddArray<vtkDoubleArray>(
          fields, names::TrackingRepeatability, std::vector<double>{ data.Report.repeatability });
      }
    };
    write(input, vtkPoseSequences::MomentOf(data.Poses, phase), output[0]);
    vtkCoronary::AddArray<vtkDoubleArray>(
      output[0]->GetPointData(), names::PlacementConfidence, data.Placement[phase]);
    if (!data.Sights.empty())
    {
      vtkCoronary::AddArray<vtkDoubleArray>(
        output[0]->GetPointData(), names::LumenBeside, data.Sights[phase].beside);
      vtkCoronary::AddArray<vtkDoubleArray>(
        output[0]->GetPointData(), names::LumenContrast, data.Sights[phase].contrast);
    }

    vtkInformation* skeletonInfo = Connection(inputs, TrackerSkeletonPort);
    vtkPolyData* skeleton = skeletonInfo != nullptr ? vtkPolyData::GetData(skeletonInfo) : nullptr;
    if (skeleton != nullptr && skeleton->GetNumberOfPoints() > 0)
    {
      const vtkMovedLines::PosedSkeleton posed(
        vtkMovedLines::Feet(data.Lines, skeleton), data.Lines.points, data.Poses, phase, skeleton);
      write(skeleton, posed.At(times[phase]), output[1]);
    }
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(
      this, outputs, "to track the lines", { "CenterlineTrackingSettings: ", "TrajectoryPrior: " });
  }
}

void vtkCenterlineTracker::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "AutomaticReference: " << this->AutomaticReference << "\n"
     << indent << "ReferenceTime: " << this->ReferenceTime << "\n"
     << indent << "TrackedPhases: " << this->TrackedPhases << "\n"
     << indent << "TrackedTimes:";
  for (const double time : this->TrackedTimes)
  {
    os << " " << time;
  }
  os << "\n"
     << indent << "ImageContent: " << this->ImageContent << "\n"
     << indent << "ImageArrayName: " << this->ImageArrayName << "\n"
     << indent << "TemporalWindow: " << this->TemporalWindow << "\n"
     << indent << "NodeSpacing: " << this->NodeSpacing << "\n"
     << indent << "CaptureRange: " << this->CaptureRange << "\n";
}
