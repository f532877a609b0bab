#include "vtkMovedLines.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkVesselTree.h"

#include "vtkAlgorithm.h"
#include "vtkCellArray.h"
#include "vtkCellArrayIterator.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace names = vtkCoronaryArrayNames;
using coronary::PoseSequence;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace
{
double LengthOf(vtkIdType count, const vtkIdType* points, const std::vector<Vector3>& positions)
{
  double length = 0.0;
  for (vtkIdType i = 0; i + 1 < count; ++i)
  {
    length += (positions[points[i + 1]] - positions[points[i]]).norm();
  }
  return length;
}
}

namespace vtkMovedLines
{
vtkInformation* Connection(vtkInformationVector** inputs, int port)
{
  return inputs[port] != nullptr && inputs[port]->GetNumberOfInformationObjects() > 0
    ? inputs[port]->GetInformationObject(0)
    : nullptr;
}

double FieldValue(vtkDataObject* data, const char* name, double otherwise)
{
  vtkDataArray* array = data != nullptr ? data->GetFieldData()->GetArray(name) : nullptr;
  return array != nullptr && array->GetNumberOfTuples() == 1 ? array->GetComponent(0, 0)
                                                             : otherwise;
}

vtkInformation* AskedOutput(vtkInformation* request, vtkInformationVector* outputs)
{
  return outputs->GetInformationObject(
    std::max(0, request->Get(vtkDemandDrivenPipeline::FROM_OUTPUT_PORT())));
}

double AskedTime(vtkInformation* request, vtkInformationVector* outputs, double otherwise)
{
  vtkInformation* asked = AskedOutput(request, outputs);
  return asked->Has(SDDP::UPDATE_TIME_STEP()) ? asked->Get(SDDP::UPDATE_TIME_STEP()) : otherwise;
}

std::size_t NearestIndex(const std::vector<double>& times, double wanted)
{
  return std::min_element(times.begin(), times.end(),
           [wanted](double a, double b) { return std::abs(a - wanted) < std::abs(b - wanted); }) -
    times.begin();
}

void SetTimes(vtkInformationVector* outputs, const std::vector<double>& times)
{
  for (int port = 0; port < outputs->GetNumberOfInformationObjects(); ++port)
  {
    vtkInformation* outInfo = outputs->GetInformationObject(port);
    outInfo->Set(vtkAlgorithm::CAN_HANDLE_PIECE_REQUEST(), 1);
    outInfo->Remove(SDDP::TIME_STEPS());
    outInfo->Remove(SDDP::TIME_RANGE());
    if (!times.empty())
    {
      double range[2] = { times.front(), times.back() };
      outInfo->Set(SDDP::TIME_STEPS(), times.data(), static_cast<int>(times.size()));
      outInfo->Set(SDDP::TIME_RANGE(), range, 2);
    }
  }
}

coronary::PlacementEvidence EvidenceOf(vtkPolyData* lines)
{
  coronary::VesselTree values;
  vtkCoronary::AddPointValues(lines, values);
  coronary::PlacementEvidence evidence;
  evidence.certainty = std::move(values.confidence);
  const auto read = [lines](const char* name, std::vector<double>& list)
  {
    vtkDataArray* array = lines->GetPointData()->GetArray(name);
    for (vtkIdType n = 0; array && n < array->GetNumberOfTuples(); ++n)
    {
      list.push_back(array->GetComponent(n, 0));
    }
  };
  read(names::OstiumConfidence, evidence.ostium);
  read(names::VeinProbability, evidence.vein);
  return evidence;
}

Feet::Feet(const coronary::Polylines& lines, vtkPolyData* skeleton)
{
  for (vtkIdType n = 0; n < skeleton->GetNumberOfPoints(); ++n)
  {
    const Vector3 place(skeleton->GetPoint(n));
    double minimum = std::numeric_limits<double>::infinity();
    Foot best;
    for (const std::vector<std::int64_t>& line : lines.lines)
    {
      for (std::size_t i = 0; i + 1 < line.size(); ++i)
      {
        const coronary::SegmentPlace nearest =
          coronary::NearestOnSegment(place, lines.points[line[i]], lines.points[line[i + 1]]);
        if (nearest.squaredDistance < minimum)
        {
          minimum = nearest.squaredDistance;
          best = { static_cast<std::size_t>(line[i]), static_cast<std::size_t>(line[i + 1]),
            nearest.fraction };
        }
      }
    }
    this->Places.push_back(best);
  }
}

std::vector<coronary::TrackingStatus> Feet::At(
  const std::vector<coronary::TrackingStatus>& status) const
{
  std::vector<coronary::TrackingStatus> result;
  result.reserve(this->Places.size());
  for (const Foot& foot : this->Places)
  {
    result.push_back(status[foot.fraction < 0.5 ? foot.first : foot.second]);
  }
  return result;
}

PosedSkeleton::PosedSkeleton(const Feet& feet, const std::vector<Vector3>& rest,
  const PoseSequence& poses, std::size_t phase, vtkPolyData* skeleton)
  : confidence(feet.At(poses.confidence[phase]))
  , status(feet.At(poses.status[phase]))
  , calibre(feet.At(poses.calibre[phase]))
{
  const std::vector<Vector3> moved = feet.At(poses.points[phase]);
  const std::vector<Vector3> still = feet.At(rest);
  for (std::size_t n = 0; n < moved.size(); ++n)
  {
    this->joints.emplace_back(
      Vector3(skeleton->GetPoint(static_cast<vtkIdType>(n))) + moved[n] - still[n]);
  }
}

vtkPoseSequences::Moment PosedSkeleton::At(double time) const
{
  vtkPoseSequences::Moment moment;
  moment.time = time;
  moment.points = &this->joints;
  moment.confidence = &this->confidence;
  moment.status = &this->status;
  moment.calibre = &this->calibre;
  return moment;
}

void Write(vtkPolyData* lines, vtkPolyData* like, const vtkPoseSequences::Moment& moment,
  double cycle, double reference, vtkPolyData* output)
{
  vtkPoseSequences::Write(like, moment, output);
  std::vector<Vector3> rest;
  vtkNew<vtkDoubleArray> displacement;
  displacement->SetName(names::Displacement);
  displacement->SetNumberOfComponents(3);
  displacement->SetNumberOfTuples(like->GetNumberOfPoints());
  for (vtkIdType n = 0; n < like->GetNumberOfPoints(); ++n)
  {
    rest.emplace_back(like->GetPoint(n));
    const Vector3 moved = (*moment.points)[n] - rest.back();
    displacement->SetTuple(n, moved.data());
  }
  output->GetPointData()->AddArray(displacement);
  // Cells of poly data: vertices, lines, polygons, strips.
  vtkNew<vtkDoubleArray> strain;
  strain->SetName(names::AxialStrain);
  strain->SetNumberOfValues(like->GetNumberOfCells());
  strain->FillValue(0.0);
  vtkIdType cell = like->GetNumberOfVerts();
  const auto cells = vtkSmartPointer<vtkCellArrayIterator>::Take(like->GetLines()->NewIterator());
  for (cells->GoToFirstCell(); !cells->IsDoneWithTraversal(); cells->GoToNextCell(), ++cell)
  {
    vtkIdType count = 0;
    const vtkIdType* points = nullptr;
    cells->GetCurrentCell(count, points);
    const double before = LengthOf(count, points, rest);
    strain->SetValue(
      cell, before > 0.0 ? LengthOf(count, points, *moment.points) / before - 1.0 : 0.0);
  }
  output->GetCellData()->AddArray(strain);
  vtkFieldData* fields = output->GetFieldData();
  fields->PassData(lines->GetFieldData());
  fields->PassData(like->GetFieldData());
  vtkCoronary::AddArray<vtkDoubleArray>(
    fields, names::PhaseTime, std::vector<double>{ moment.time });
  vtkCoronary::AddArray<vtkDoubleArray>(fields, names::CycleLength, std::vector<double>{ cycle });
  vtkCoronary::AddArray<vtkDoubleArray>(
    fields, names::ReferenceTime, std::vector<double>{ reference });
}
}
