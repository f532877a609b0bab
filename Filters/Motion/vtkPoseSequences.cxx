#include "vtkPoseSequences.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkInformationExecutivePortKey.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

using coronary::Vector3;
using vtkCoronary::Require;
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace names = vtkCoronaryArrayNames;

namespace vtkPoseSequences
{
namespace
{
std::string At(const std::vector<double>& steps, std::size_t k)
{
  std::ostringstream text;
  text << "time step " << k << " (" << steps[k] << ')';
  return text.str();
}

void RequireSteps(const std::vector<double>& steps)
{
  Require(steps.size() >= 2,
    "The input has " +
      (steps.empty() ? std::string("no time steps") : std::string("one time step")) +
      ": its motion needs at least two");
  for (std::size_t k = 0; k < steps.size(); ++k)
  {
    Require(std::isfinite(steps[k]), "The input's " + At(steps, k) + " is not finite");
  }
  for (std::size_t k = 1; k < steps.size(); ++k)
  {
    Require(steps[k] > steps[k - 1],
      "The input's time steps do not increase strictly: " + At(steps, k) + " follows " +
        At(steps, k - 1));
  }
}

vtkDataArray* Find(vtkFieldData* data, const std::string& name, int components, vtkIdType tuples)
{
  vtkDataArray* array = name.empty() ? nullptr : data->GetArray(name.c_str());
  if (array)
  {
    Require(array->GetNumberOfComponents() == components && array->GetNumberOfTuples() == tuples,
      "Array " + name + " of the input must have " + std::to_string(components) +
        (components == 1 ? " component" : " components") + " and " + std::to_string(tuples) +
        " tuples");
  }
  return array;
}

/// An optional member of the poses: there at every step, or at none.
template <typename Value, typename Convert>
void Append(vtkFieldData* data, const std::string& name, int components, vtkIdType tuples,
  std::size_t k, std::vector<std::vector<Value>>& member, const Convert& convert)
{
  vtkDataArray* array = Find(data, name, components, tuples);
  Require(k == 0 || (array != nullptr) == !member.empty(),
    "Array " + name + " is not there at all time steps of the input");
  if (!array)
  {
    return;
  }
  member.emplace_back(static_cast<std::size_t>(tuples));
  for (vtkIdType n = 0; n < tuples; ++n)
  {
    member.back()[static_cast<std::size_t>(n)] = convert(array, n);
  }
}

bool SameValues(vtkAbstractArray* a, vtkAbstractArray* b)
{
  if (a == b)
  {
    return true;
  }
  const vtkIdType count = a->GetNumberOfValues();
  for (vtkIdType n = 0; n < count; ++n)
  {
    if (a->GetVariantValue(n) != b->GetVariantValue(n))
    {
      return false;
    }
  }
  return true;
}

bool SameNumbers(vtkDataArray* a, vtkDataArray* b)
{
  const int components = a->GetNumberOfComponents();
  for (vtkIdType n = 0; n < a->GetNumberOfTuples(); ++n)
  {
    for (int c = 0; c < components; ++c)
    {
      const double x = a->GetComponent(n, c);
      const double y = b->GetComponent(n, c);
      if (x != y && !(std::isnan(x) && std::isnan(y)))
      {
        return false;
      }
    }
  }
  return true;
}

/// Those of the first step that are there later with the same form, and are not the same in all.
void FindVarying(const std::vector<vtkSmartPointer<vtkPointSet>>& steps, bool cell,
  std::vector<VaryingArray>& varying)
{
  const auto attributes = [&](std::size_t k) -> vtkFieldData*
  {
    if (cell)
    {
      return steps[k]->GetCellData();
    }
    return steps[k]->GetPointData();
  };
  for (int n = 0; n < attributes(0)->GetNumberOfArrays(); ++n)
  {
    vtkAbstractArray* first = attributes(0)->GetAbstractArray(n);
    const std::string name = first->GetName() ? first->GetName() : "";
    const bool ofPose = cell ? name == names::BoneRotation
                             : name == names::TrackingConfidence || name == names::TrackingStatus ||
        name == names::CalibreFactor;
    if (name.empty() || ofPose)
    {
      continue;
    }
    VaryingArray array;
    array.cell = cell;
    array.floating = true;
    bool differs = false;
    bool everywhere = true;
    for (std::size_t k = 0; k < steps.size() && everywhere; ++k)
    {
      vtkAbstractArray* other = attributes(k)->GetAbstractArray(name.c_str());
      everywhere = other && other->GetNumberOfTuples() == first->GetNumberOfTuples() &&
        other->GetNumberOfComponents() == first->GetNumberOfComponents() &&
        other->GetDataType() == first->GetDataType();
      if (everywhere)
      {
        const int type = other->GetDataType();
        array.floating = array.floating && (type == VTK_FLOAT || type == VTK_DOUBLE);
        array.steps.emplace_back(other);
        if (!differs)
        {
          auto* a = vtkDataArray::SafeDownCast(first);
          auto* b = vtkDataArray::SafeDownCast(other);
          differs = first != other && !(a && b ? SameNumbers(a, b) : SameValues(first, other));
        }
      }
    }
    if (everywhere && differs)
    {
      varying.push_back(std::move(array));
    }
  }
}

/// Lines of poly data are compared; of other point sets the number of cells only.
void RequireSameCells(
  vtkPointSet* first, vtkPointSet* other, const std::vector<double>& steps, std::size_t k)
{
  Require(other->GetNumberOfPoints() == first->GetNumberOfPoints(),
    "The input has " + std::to_string(other->GetNumberOfPoints()) + " points at " + At(steps, k) +
      " and " + std::to_string(first->GetNumberOfPoints()) + " at " + At(steps, 0));
  Require(other->GetNumberOfCells() == first->GetNumberOfCells(),
    "The input has " + std::to_string(other->GetNumberOfCells()) + " cells at " + At(steps, k) +
      " and " + std::to_string(first->GetNumberOfCells()) + " at " + At(steps, 0));
  auto* a = vtkPolyData::SafeDownCast(first);
  auto* b = vtkPolyData::SafeDownCast(other);
  if (!a || !b || a->GetLines() == b->GetLines())
  {
    return;
  }
  vtkCellArray* linesA = a->GetLines();
  vtkCellArray* linesB = b->GetLines();
  bool same = linesA->GetNumberOfCells() == linesB->GetNumberOfCells();
  vtkNew<vtkIdList> idsA;
  vtkNew<vtkIdList> idsB;
  for (vtkIdType c = 0; same && c < linesA->GetNumberOfCells(); ++c)
  {
    linesA->GetCellAtId(c, idsA);
    linesB->GetCellAtId(c, idsB);
    same = idsA->GetNumberOfIds() == idsB->GetNumberOfIds() &&
      std::equal(idsA->begin(), idsA->end(), idsB->begin());
  }
  Require(same, "The input's lines at " + At(steps, k) + " are not those at " + At(steps, 0));
}
}

bool Sequence::Empty() const
{
  return !this->first || this->first->GetNumberOfPoints() == 0;
}

std::vector<double> StepsOf(vtkInformation* info)
{
  if (!info->Has(SDDP::TIME_STEPS()))
  {
    return {};
  }
  const double* steps = info->Get(SDDP::TIME_STEPS());
  return { steps, steps + info->Length(SDDP::TIME_STEPS()) };
}

void Reader::RequestTime(vtkInformation* inInfo) const
{
  const std::vector<double> steps = StepsOf(inInfo);
  if (steps.empty())
  {
    inInfo->Remove(SDDP::UPDATE_TIME_STEP());
    return;
  }
  const bool same =
    this->Known && this->KnownSteps == steps && this->KnownOf == vtkCoronary::UpstreamTime(inInfo);
  inInfo->Set(SDDP::UPDATE_TIME_STEP(), same ? this->LastStep : steps.front());
}

bool Reader::Knows(vtkInformation* inInfo) const
{
  return this->Known && this->KnownProducer == vtkExecutive::PRODUCER()->GetExecutive(inInfo) &&
    this->KnownPort == vtkExecutive::PRODUCER()->GetPort(inInfo) &&
    this->KnownOf == vtkCoronary::UpstreamTime(inInfo) && this->KnownSteps == StepsOf(inInfo);
}

const Sequence& Reader::Read(
  vtkInformation* inInfo, vtkInformation* outInfo, const coronary::ProgressCallback& progress)
{
  if (this->Knows(inInfo))
  {
    return this->Data;
  }
  this->Known = false;
  this->Data = Sequence();
  ++this->Reads;
  const std::vector<double> steps = StepsOf(inInfo);
  const vtkMTimeType of = vtkCoronary::UpstreamTime(inInfo);
  Sequence data;
  auto* now = vtkPointSet::SafeDownCast(vtkDataObject::GetData(inInfo));
  Require(now != nullptr, "The input is not a point set");
  if (now->GetNumberOfPoints() == 0)
  {
    data.first.TakeReference(now->NewInstance());
    data.first->ShallowCopy(now);
  }
  else
  {
    RequireSteps(steps);
    data.poses.times = steps;
    vtkCoronary::UpstreamRequest request(inInfo, outInfo);
    std::vector<vtkSmartPointer<vtkPointSet>> kept;
    for (std::size_t k = 0; k < steps.size(); ++k)
    {
      vtkCoronary::Moment moment;
      moment.exists = true;
      moment.time = steps[k];
      request.Ask(nullptr, moment);
      now = vtkPointSet::SafeDownCast(vtkDataObject::GetData(inInfo));
      Require(now != nullptr, "The input is not a point set at " + At(steps, k));
      kept.emplace_back();
      kept.back().TakeReference(now->NewInstance());
      kept.back()->ShallowCopy(now);
      RequireSameCells(kept.front(), now, steps, k);

      const vtkIdType points = now->GetNumberOfPoints();
      data.poses.points.emplace_back(static_cast<std::size_t>(points));
      for (vtkIdType n = 0; n < points; ++n)
      {
        now->GetPoint(n, data.poses.points.back()[static_cast<std::size_t>(n)].data());
      }
      const auto number = [](vtkDataArray* array, vtkIdType n)
      { return array->GetComponent(n, 0); };
      vtkPointData* pointData = now->GetPointData();
      Append(pointData, names::TrackingConfidence, 1, points, k, data.poses.confidence, number);
      Append(pointData, names::CalibreFactor, 1, points, k, data.poses.calibre, number);
      Append(pointData, names::TrackingStatus, 1, points, k, data.poses.status,
        [&](vtkDataArray* array, vtkIdType n)
        {
          const double value = array->GetComponent(n, 0);
          Require(value == 0.0 || value == 1.0 || value == 2.0 || value == 3.0,
            std::string("Array ") + names::TrackingStatus +
              " of the input has a value that is not 0 to 3");
          return static_cast<coronary::TrackingStatus>(static_cast<int>(value));
        });
      Append(now->GetCellData(), names::BoneRotation, 4, now->GetNumberOfCells(), k,
        data.poses.rotation,
        [](vtkDataArray* array, vtkIdType n)
        {
          double wxyz[4];
          array->GetTuple(n, wxyz);
          return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
        });
      coronary::Report(progress, static_cast<double>(k + 1) / static_cast<double>(steps.size()));
    }
    // What was asked for last is what RequestTime will ask for: nothing executes once more.
    vtkCoronary::Moment last;
    last.exists = true;
    last.time = steps.back();
    request.Restore(&last);
    try
    {
      coronary::CheckPoseSequence(data.poses, data.poses.points.front().size());
    }
    catch (const std::invalid_argument& error)
    {
      throw std::invalid_argument(std::string("The input's motion: ") + error.what());
    }
    data.first = kept.front();
    FindVarying(kept, false, data.varying);
    FindVarying(kept, true, data.varying);
    vtkDataArray* cycle = data.first->GetFieldData()->GetArray(names::CycleLength);
    if (cycle && cycle->GetNumberOfValues() == 1)
    {
      data.cycleLength = cycle->GetComponent(0, 0);
      Require(std::isfinite(data.cycleLength) && data.cycleLength > 0.0,
        std::string("Array ") + names::CycleLength + " of the input must be positive");
    }
  }
  this->Data = std::move(data);
  this->Known = true;
  this->KnownOf = of;
  this->KnownProducer = vtkExecutive::PRODUCER()->GetExecutive(inInfo);
  this->KnownPort = vtkExecutive::PRODUCER()->GetPort(inInfo);
  this->KnownSteps = steps;
  this->LastStep = steps.empty() ? 0.0 : this->Data.Empty() ? steps.front() : steps.back();
  return this->Data;
}

Moment MomentOf(const coronary::PoseSequence& sequence, std::size_t k)
{
  Moment moment;
  moment.time = sequence.times[k];
  moment.points = &sequence.points[k];
  moment.confidence = sequence.confidence.empty() ? nullptr : &sequence.confidence[k];
  moment.status = sequence.status.empty() ? nullptr : &sequence.status[k];
  moment.calibre = sequence.calibre.empty() ? nullptr : &sequence.calibre[k];
  moment.rotation = sequence.rotation.empty() ? nullptr : &sequence.rotation[k];
  return moment;
}

void Write(vtkPointSet* like, const Moment& moment, vtkPointSet* output)
{
  output->ShallowCopy(like);
  vtkNew<vtkFieldData> fields;
  fields->ShallowCopy(like->GetFieldData());
  output->SetFieldData(fields);
  if (moment.points)
  {
    vtkNew<vtkPoints> points;
    points->SetDataType(like->GetPoints()->GetDataType());
    points->SetNumberOfPoints(static_cast<vtkIdType>(moment.points->size()));
    for (std::size_t n = 0; n < moment.points->size(); ++n)
    {
      points->SetPoint(static_cast<vtkIdType>(n), (*moment.points)[n].data());
    }
    output->SetPoints(points);
  }
  if (moment.confidence)
  {
    vtkCoronary::AddArray<vtkDoubleArray>(
      output->GetPointData(), names::TrackingConfidence, *moment.confidence);
  }
  if (moment.status)
  {
    std::vector<int> values(moment.status->size());
    std::transform(moment.status->begin(), moment.status->end(), values.begin(),
      [](coronary::TrackingStatus status) { return static_cast<int>(status); });
    vtkCoronary::AddArray<vtkIntArray>(output->GetPointData(), names::TrackingStatus, values);
  }
  if (moment.calibre)
  {
    vtkCoronary::AddArray<vtkDoubleArray>(
      output->GetPointData(), names::CalibreFactor, *moment.calibre);
  }
  if (moment.rotation)
  {
    vtkNew<vtkDoubleArray> array;
    array->SetName(names::BoneRotation);
    array->SetNumberOfComponents(4);
    array->SetNumberOfTuples(static_cast<vtkIdType>(moment.rotation->size()));
    for (std::size_t n = 0; n < moment.rotation->size(); ++n)
    {
      const Eigen::Quaterniond& q = (*moment.rotation)[n];
      array->SetTuple4(static_cast<vtkIdType>(n), q.w(), q.x(), q.y(), q.z());
    }
    output->GetCellData()->AddArray(array);
  }
  output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), moment.time);
}

void WriteVarying(const Sequence& sequence, std::size_t k, vtkPointSet* output)
{
  for (const VaryingArray& array : sequence.varying)
  {
    if (array.cell)
    {
      output->GetCellData()->AddArray(array.steps[k]);
    }
    else
    {
      output->GetPointData()->AddArray(array.steps[k]);
    }
  }
}

coronary::Polylines LinesOf(vtkPolyData* data, vtkDataArray* radius)
{
  coronary::Polylines lines;
  const vtkIdType points = data->GetNumberOfPoints();
  lines.points.resize(static_cast<std::size_t>(points));
  for (vtkIdType n = 0; n < points; ++n)
  {
    data->GetPoint(n, lines.points[static_cast<std::size_t>(n)].data());
  }
  if (radius != nullptr)
  {
    lines.radius.resize(lines.points.size());
    for (vtkIdType n = 0; n < points; ++n)
    {
      lines.radius[static_cast<std::size_t>(n)] = radius->GetComponent(n, 0);
    }
  }
  vtkNew<vtkIdList> ids;
  for (vtkIdType c = 0; c < data->GetLines()->GetNumberOfCells(); ++c)
  {
    data->GetLines()->GetCellAtId(c, ids);
    lines.lines.emplace_back(ids->begin(), ids->end());
  }
  coronary::CheckPolylines(lines);
  return lines;
}
}
