#include "vtkCenterlineMetrics.h"

#include "BranchMetrics.h"
#include "CenterlineOverlap.h"
#include "Numbers.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkSurfaceInput.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataObject.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkTable.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

using coronary::BranchAgreement;
using coronary::BranchMetrics;
using coronary::CenterlineOverlapMeasures;
using coronary::CenterlinePointMatch;
using coronary::NaN;
using coronary::Polylines;
using coronary::TreeBranch;
using coronary::TreeOverlap;
using coronary::TreeOverlapRow;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCenterlineMetrics);

namespace
{
/// How far apart two times may be to be one.
constexpr double TimeTolerance = 1e-3;

template <typename Array>
vtkNew<Array> Column(const char* name, vtkIdType rows)
{
  vtkNew<Array> column;
  column->SetName(name);
  column->SetNumberOfValues(rows);
  return column;
}

void WriteTable(vtkTable* table, const TreeOverlap& overlap, bool paths, vtkStringArray* labels)
{
  const auto count = static_cast<vtkIdType>(overlap.rows.size());
  const auto measures = [&](vtkIdType row) -> const CenterlineOverlapMeasures&
  { return row < count ? overlap.rows[row].measures : overlap.total; };
  const auto names = Column<vtkStringArray>("Name", count + 1);
  const auto referenceLine = Column<vtkIntArray>("ReferenceLine", count + 1);
  const auto resultLine = Column<vtkIntArray>("ResultLine", count + 1);
  for (vtkIdType row = 0; row < count; ++row)
  {
    const TreeOverlapRow& r = overlap.rows[row];
    std::string name = paths ? "path" : "line";
    for (const std::int64_t line : r.lines)
    {
      name += " " + std::to_string(line);
    }
    if (labels != nullptr && !labels->GetValue(r.lines.back()).empty())
    {
      name += ", " + std::string(labels->GetValue(r.lines.back()));
    }
    names->SetValue(row, name);
    referenceLine->SetValue(row, static_cast<int>(r.lines.back()));
    resultLine->SetValue(row, r.resultLines.empty() ? -1 : static_cast<int>(r.resultLines.back()));
  }
  names->SetValue(count, "total");
  referenceLine->SetValue(count, -1);
  resultLine->SetValue(count, -1);
  table->AddColumn(names);
  table->AddColumn(referenceLine);
  table->AddColumn(resultLine);
  const auto numbers = [&](const char* name, double CenterlineOverlapMeasures::*member)
  {
    const auto column = Column<vtkDoubleArray>(name, count + 1);
    for (vtkIdType row = 0; row <= count; ++row)
    {
      column->SetValue(row, measures(row).*member);
    }
    table->AddColumn(column);
  };
  numbers("OV", &CenterlineOverlapMeasures::overlap);
  numbers("OF", &CenterlineOverlapMeasures::overlapToFirstError);
  numbers("OT", &CenterlineOverlapMeasures::overlapRelevant);
  numbers("AD", &CenterlineOverlapMeasures::distance);
  numbers("AI", &CenterlineOverlapMeasures::distanceInside);
  numbers("AT", &CenterlineOverlapMeasures::distanceRelevant);
  numbers("RadiusError", &CenterlineOverlapMeasures::radiusError);
  numbers("RadiusBias", &CenterlineOverlapMeasures::radiusBias);
  const auto samples = [&](const char* name, std::int64_t CenterlineOverlapMeasures::*member)
  {
    const auto column = Column<vtkIdTypeArray>(name, count + 1);
    for (vtkIdType row = 0; row <= count; ++row)
    {
      column->SetValue(row, static_cast<vtkIdType>(measures(row).*member));
    }
    table->AddColumn(column);
  };
  samples("TPR", &CenterlineOverlapMeasures::foundReference);
  samples("FN", &CenterlineOverlapMeasures::missedReference);
  samples("TPM", &CenterlineOverlapMeasures::rightResult);
  samples("FP", &CenterlineOverlapMeasures::falseResult);
  numbers("ReferenceLength", &CenterlineOverlapMeasures::referenceLength);
  numbers("ResultLength", &CenterlineOverlapMeasures::resultLength);
  if (!paths)
  {
    const auto field = [&](const char* name, double value)
    {
      const auto array = Column<vtkDoubleArray>(name, 1);
      array->SetValue(0, value);
      table->GetFieldData()->AddArray(array);
    };
    field(vtkCoronaryArrayNames::LongestFalse, overlap.longestFalse);
    field(vtkCoronaryArrayNames::LongestMissed, overlap.longestMissed);
  }
}

/// The points and lines of both sides, and what the comparison says of them.
void WriteLines(vtkPolyData* output, const Polylines* sets, const TreeOverlap& overlap)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkIntArray> match;
  match->SetName(vtkCoronaryArrayNames::CenterlineMatch);
  vtkNew<vtkDoubleArray> distance;
  distance->SetName(vtkCoronaryArrayNames::CenterlineDistance);
  vtkNew<vtkDoubleArray> radius;
  radius->SetName(vtkCoronaryArrayNames::Radius);
  vtkNew<vtkIntArray> pointSide;
  vtkNew<vtkIntArray> cellSide;
  for (vtkIntArray* array : { pointSide.Get(), cellSide.Get() })
  {
    array->SetName(vtkCoronaryArrayNames::FromReference);
  }
  for (int side = 0; side < 2; ++side)
  {
    const Polylines& set = sets[side];
    const std::vector<CenterlinePointMatch>& matches =
      side == 0 ? overlap.reference : overlap.result;
    const vtkIdType first = points->GetNumberOfPoints();
    for (std::size_t i = 0; i < set.points.size(); ++i)
    {
      points->InsertNextPoint(set.points[i].data());
      match->InsertNextValue(static_cast<int>(matches[i].match));
      distance->InsertNextValue(matches[i].distance);
      radius->InsertNextValue(set.radius.empty() ? NaN : set.radius[i]);
      pointSide->InsertNextValue(side == 0 ? 1 : 0);
    }
    for (const std::vector<std::int64_t>& line : set.lines)
    {
      lines->InsertNextCell(static_cast<int>(line.size()));
      for (const std::int64_t point : line)
      {
        lines->InsertCellPoint(first + point);
      }
      cellSide->InsertNextValue(side == 0 ? 1 : 0);
    }
  }
  output->SetPoints(points);
  output->SetLines(lines);
  output->GetPointData()->AddArray(match);
  output->GetPointData()->AddArray(distance);
  output->GetPointData()->AddArray(pointSide);
  output->GetPointData()->AddArray(radius);
  output->GetCellData()->AddArray(cellSide);
}

/// Whether two single lines run against each other.
bool RunsAgainst(const Polylines* sets)
{
  const auto point = [&](int side, bool last) -> const Vector3&
  {
    const std::vector<std::int64_t>& line = sets[side].lines[0];
    return sets[side].points[last ? line.back() : line.front()];
  };
  if (sets[0].lines[0].size() < 2 || sets[1].lines[0].size() < 2)
  {
    return false;
  }
  const double along =
    (point(0, false) - point(1, false)).norm() + (point(0, true) - point(1, true)).norm();
  const double against =
    (point(0, false) - point(1, true)).norm() + (point(0, true) - point(1, false)).norm();
  return against < along;
}

/// The names of the reference's lines; null where there are none, or other cells beside the lines.
vtkStringArray* LabelsOf(vtkPolyData* reference, std::size_t lines)
{
  auto* labels = reference == nullptr
    ? nullptr
    : vtkStringArray::SafeDownCast(
        reference->GetCellData()->GetAbstractArray(vtkCoronaryArrayNames::SegmentLabel));
  return labels != nullptr && labels->GetNumberOfValues() == static_cast<vtkIdType>(lines) &&
      reference->GetNumberOfCells() == labels->GetNumberOfValues()
    ? labels
    : nullptr;
}

std::vector<std::pair<const char*, double>> Totals(const BranchMetrics& m)
{
  return { { "BCR", m.completenessRatio }, { "BCS", m.continuityScore },
    { "BCR_bounded", m.boundedCompleteness }, { "BCS_bounded", m.boundedContinuity },
    { "BCS_matched", m.matchedLengthRatio }, { "LengthDetected", m.lengthDetected },
    { "ReferenceBranches", static_cast<double>(m.reference.size()) },
    { "ResultBranches", static_cast<double>(m.result.size()) },
    { "MatchedBranches", static_cast<double>(m.matched) },
    { "DetectedBranches", static_cast<double>(m.detected) },
    { "FalseBranches", static_cast<double>(m.falseBranches) }, { "FalseLength", m.falseLength },
    { "OV", m.overlap.overlap }, { "OF", m.overlap.overlapToFirstError },
    { "OT", m.overlap.overlapRelevant }, { "AD", m.overlap.distance },
    { "AI", m.overlap.distanceInside }, { "AT", m.overlap.distanceRelevant } };
}

void WriteTotals(vtkFieldData* field, const BranchMetrics& metrics)
{
  for (const auto& [name, value] : Totals(metrics))
  {
    vtkCoronary::AddArray<vtkDoubleArray>(field, name, std::vector<double>{ value });
  }
}

void WriteBranchTable(vtkTable* table, const BranchMetrics& metrics)
{
  vtkFieldData* columns = table->GetRowData();
  vtkNew<vtkStringArray> names;
  names->SetName("Name");
  for (const BranchAgreement& row : metrics.rows)
  {
    names->InsertNextValue(row.reference >= 0
        ? "reference " + std::to_string(metrics.reference[row.reference].group)
        : "result " + std::to_string(metrics.result[row.result].group));
  }
  columns->AddArray(names);
  const auto numbers = [&](const char* name, auto get)
  {
    std::vector<double> values;
    values.reserve(metrics.rows.size());
    for (const BranchAgreement& row : metrics.rows)
    {
      values.push_back(get(row));
    }
    vtkCoronary::AddArray<vtkDoubleArray>(columns, name, values);
  };
  const auto ids = [&](const char* name, auto get)
  {
    std::vector<vtkIdType> values;
    values.reserve(metrics.rows.size());
    for (const BranchAgreement& row : metrics.rows)
    {
      values.push_back(static_cast<vtkIdType>(get(row)));
    }
    vtkCoronary::AddArray<vtkIdTypeArray>(columns, name, values);
  };
  const auto of = [](const std::vector<TreeBranch>& branches, std::int64_t number)
  { return number >= 0 ? &branches[number] : nullptr; };
  ids("ReferenceBranch", [](const BranchAgreement& row) { return row.reference; });
  ids("ResultBranch", [](const BranchAgreement& row) { return row.result; });
  ids("ReferenceGroup",
    [&](const BranchAgreement& row)
    {
      const TreeBranch* branch = of(metrics.reference, row.reference);
      return branch ? branch->group : -1;
    });
  ids("ResultGroup",
    [&](const BranchAgreement& row)
    {
      const TreeBranch* branch = of(metrics.result, row.result);
      return branch ? branch->group : -1;
    });
  numbers("ReferenceLength",
    [&](const BranchAgreement& row)
    {
      const TreeBranch* branch = of(metrics.reference, row.reference);
      return branch ? branch->length : NaN;
    });
  numbers("ResultLength",
    [&](const BranchAgreement& row)
    {
      const TreeBranch* branch = of(metrics.result, row.result);
      return branch ? branch->length : NaN;
    });
  numbers("LengthRatio", [](const BranchAgreement& row) { return row.lengthRatio; });
  numbers("Overlap", [](const BranchAgreement& row) { return row.overlap; });
  numbers("Covered", [](const BranchAgreement& row) { return row.covered; });
  numbers("Continuity", [](const BranchAgreement& row) { return row.continuity; });
  numbers("LongestGap", [](const BranchAgreement& row) { return row.longestGap; });
  std::vector<int> detected;
  detected.reserve(metrics.rows.size());
  for (const BranchAgreement& row : metrics.rows)
  {
    detected.push_back(row.detected ? 1 : 0);
  }
  vtkCoronary::AddArray<vtkIntArray>(columns, "Detected", detected);
  WriteTotals(table->GetFieldData(), metrics);
}

void WriteBranches(vtkPolyData* output, const BranchMetrics& metrics)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> lines;
  std::vector<int> side;
  std::vector<vtkIdType> group;
  std::vector<double> length;
  std::vector<vtkIdType> match(metrics.reference.size() + metrics.result.size(), -1);
  std::vector<double> covered(match.size(), NaN);
  for (const std::vector<TreeBranch>* branches : { &metrics.reference, &metrics.result })
  {
    for (const TreeBranch& branch : *branches)
    {
      lines->InsertNextCell(static_cast<int>(branch.points.size()));
      for (const coronary::Vector3& point : branch.points)
      {
        lines->InsertCellPoint(points->InsertNextPoint(point.data()));
      }
      side.push_back(branches == &metrics.reference ? 1 : 0);
      group.push_back(branch.group);
      length.push_back(branch.length);
    }
  }
  const std::size_t first = metrics.reference.size();
  for (const BranchAgreement& row : metrics.rows)
  {
    if (row.reference >= 0)
    {
      match[row.reference] = row.result;
      covered[row.reference] = row.covered;
    }
    if (row.result >= 0)
    {
      match[first + row.result] = row.reference;
      covered[first + row.result] = row.covered;
    }
  }
  output->SetPoints(points);
  output->SetLines(lines);
  vtkFieldData* cells = output->GetCellData();
  vtkCoronary::AddArray<vtkIntArray>(cells, vtkCoronaryArrayNames::FromReference, side);
  vtkCoronary::AddArray<vtkIdTypeArray>(cells, vtkCoronaryArrayNames::GroupIds, group);
  vtkCoronary::AddArray<vtkIdTypeArray>(cells, vtkCoronaryArrayNames::BranchMatch, match);
  vtkCoronary::AddArray<vtkDoubleArray>(cells, vtkCoronaryArrayNames::Covered, covered);
  vtkCoronary::AddArray<vtkDoubleArray>(cells, vtkCoronaryArrayNames::Length, length);
  WriteTotals(output->GetFieldData(), metrics);
}
}

vtkCenterlineMetrics::vtkCenterlineMetrics()
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(4);
}

void vtkCenterlineMetrics::SetReferenceData(vtkDataObject* reference)
{
  this->SetInputDataInternal(ReferencePort, reference);
}

vtkPolyData* vtkCenterlineMetrics::GetLines()
{
  return vtkPolyData::SafeDownCast(this->GetOutputDataObject(LinesPort));
}

vtkTable* vtkCenterlineMetrics::GetBranchTable()
{
  return vtkTable::SafeDownCast(this->GetOutputDataObject(BranchTablePort));
}

vtkPolyData* vtkCenterlineMetrics::GetBranches()
{
  return vtkPolyData::SafeDownCast(this->GetOutputDataObject(BranchesPort));
}

int vtkCenterlineMetrics::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkCompositeDataSet");
  return 1;
}

int vtkCenterlineMetrics::FillOutputPortInformation(int port, vtkInformation* info)
{
  const bool table = port == TablePort || port == BranchTablePort;
  info->Set(vtkDataObject::DATA_TYPE_NAME(), table ? "vtkTable" : "vtkPolyData");
  return 1;
}

int vtkCenterlineMetrics::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  vtkCoronary::PublishCommonTime(inputs, outputs);
  return 1;
}

int vtkCenterlineMetrics::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // Trees are compared as a whole.
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  vtkCoronary::RequestCommonTime(inputs, outputs->GetInformationObject(port));
  return 1;
}

void vtkCenterlineMetrics::CompareLines(const Polylines& result, const Polylines& reference,
  vtkPolyData* referenceData, vtkInformationVector* outputs)
{
  coronary::CenterlineOverlapSettings settings;
  settings.relevantRadius = this->RelevantRadius;
  settings.minimumRadius = this->MinimumRadius;
  settings.Validate();
  if (this->Method < AutomaticMethod || this->Method > PathMethod)
  {
    throw std::invalid_argument("There is no method " + std::to_string(this->Method));
  }
  Polylines sets[2] = { reference, result };
  if (sets[0].radius.empty())
  {
    sets[0].radius.assign(sets[0].points.size(), this->Tolerance);
  }
  const bool single = sets[0].lines.size() == 1 && sets[1].lines.size() == 1;
  const bool paths = this->Method == PathMethod || (this->Method == AutomaticMethod && single);
  const auto progress = vtkCoronary::ProgressOf(this, 0.5, 1.0);
  const TreeOverlap overlap = paths
    ? coronary::CompareCenterlinePaths(sets[0], sets[1], settings, progress)
    : coronary::CompareCenterlineTrees(sets[0], sets[1], settings, progress);
  if (single && paths && RunsAgainst(sets))
  {
    vtkWarningMacro("The result's line runs against the reference's");
  }
  WriteTable(vtkTable::GetData(outputs, TablePort), overlap, paths,
    LabelsOf(referenceData, sets[0].lines.size()));
  sets[0].radius = reference.radius;
  WriteLines(vtkPolyData::GetData(outputs, LinesPort), sets, overlap);
}

void vtkCenterlineMetrics::CompareBranches(
  const Polylines& result, const Polylines& reference, vtkInformationVector* outputs)
{
  coronary::BranchMetricsSettings settings;
  settings.tolerance = this->Tolerance;
  settings.detectedShare = this->DetectedShare;
  settings.minimumLength = this->MinimumLength;
  settings.Validate();
  const BranchMetrics metrics =
    coronary::CompareBranches(result, reference, settings, vtkCoronary::ProgressOf(this, 0.0, 0.5));
  WriteBranchTable(vtkTable::GetData(outputs, BranchTablePort), metrics);
  WriteBranches(vtkPolyData::GetData(outputs, BranchesPort), metrics);
}

int vtkCenterlineMetrics::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  if (outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    const std::string mismatch = vtkCoronary::TimeMismatch(inputs, TimeTolerance);
    vtkCoronary::Require(mismatch.empty(), mismatch);
    const vtkSmartPointer<vtkPolyData> referenceData =
      vtkCoronary::PolyDataOf(vtkDataObject::GetData(inputs[ReferencePort], 0));
    const Polylines result = vtkCoronary::TreeOf(
      vtkCoronary::PolyDataOf(vtkDataObject::GetData(inputs[ResultPort], 0)), "result");
    const Polylines reference = vtkCoronary::TreeOf(referenceData, "reference");
    this->CompareBranches(result, reference, outputs);
    this->CompareLines(result, reference, referenceData, outputs);
    vtkCoronary::SetCommonTime(inputs, outputs);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(
      this, outputs, "to compare the lines", { "BranchMetricsSettings: " });
  }
}

void vtkCenterlineMetrics::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Method: " << this->Method << "\n";
  os << indent << "RelevantRadius: " << this->RelevantRadius << "\n";
  os << indent << "MinimumRadius: " << this->MinimumRadius << "\n";
  os << indent << "Tolerance: " << this->Tolerance << "\n";
  os << indent << "DetectedShare: " << this->DetectedShare << "\n";
  os << indent << "MinimumLength: " << this->MinimumLength << "\n";
}
