#include "vtkBranchMetrics.h"

#include "BranchMetrics.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkSurfaceInput.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDataObject.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdList.h"
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
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

using coronary::BranchAgreement;
using coronary::BranchMetrics;
using coronary::Polylines;
using coronary::TreeBranch;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkBranchMetrics);

namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

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

void WriteTable(vtkTable* table, const BranchMetrics& metrics)
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

vtkBranchMetrics::vtkBranchMetrics()
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(2);
}

void vtkBranchMetrics::SetReferenceData(vtkDataObject* reference)
{
  this->SetInputDataInternal(ReferencePort, reference);
}

vtkPolyData* vtkBranchMetrics::GetBranches()
{
  return vtkPolyData::SafeDownCast(this->GetOutputDataObject(BranchesPort));
}

int vtkBranchMetrics::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkCompositeDataSet");
  return 1;
}

int vtkBranchMetrics::FillOutputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkDataObject::DATA_TYPE_NAME(), port == TablePort ? "vtkTable" : "vtkPolyData");
  return 1;
}

int vtkBranchMetrics::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  vtkCoronary::PublishCommonTime(inputs, outputs);
  return 1;
}

int vtkBranchMetrics::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  vtkCoronary::RequestCommonTime(inputs, outputs->GetInformationObject(port));
  return 1;
}

int vtkBranchMetrics::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkTable* table = vtkTable::GetData(outputs, TablePort);
  vtkPolyData* branches = vtkPolyData::GetData(outputs, BranchesPort);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  if (outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    coronary::BranchMetricsSettings settings;
    settings.spacing = this->Spacing;
    settings.tolerance = this->Tolerance;
    settings.detectedShare = this->DetectedShare;
    settings.overlapGate = this->OverlapGate;
    settings.leastLength = this->LeastLength;
    settings.linesAreBranches = this->LinesAreBranches;
    settings.Validate();
    vtkCoronary::Require(this->TimeTolerance >= 0.0, "TimeTolerance must be 0 or more");
    const std::string mismatch = vtkCoronary::TimeMismatch(inputs, this->TimeTolerance);
    vtkCoronary::Require(mismatch.empty(), mismatch);
    const Polylines result = vtkCoronary::TreeOf(
      vtkCoronary::PolyDataOf(vtkDataObject::GetData(inputs[ResultPort], 0)), "result");
    const Polylines reference = vtkCoronary::TreeOf(
      vtkCoronary::PolyDataOf(vtkDataObject::GetData(inputs[ReferencePort], 0)), "reference");
    const BranchMetrics metrics =
      coronary::CompareBranches(result, reference, settings, vtkCoronary::ProgressOf(this));
    WriteTable(table, metrics);
    WriteBranches(branches, metrics);
    vtkCoronary::SetCommonTime(inputs, outputs);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(
      this, outputs, "to compare the branches", { "BranchMetricsSettings: " });
  }
}

void vtkBranchMetrics::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Spacing: " << this->Spacing << "\n";
  os << indent << "Tolerance: " << this->Tolerance << "\n";
  os << indent << "DetectedShare: " << this->DetectedShare << "\n";
  os << indent << "OverlapGate: " << this->OverlapGate << "\n";
  os << indent << "LeastLength: " << this->LeastLength << "\n";
  os << indent << "LinesAreBranches: " << this->LinesAreBranches << "\n";
  os << indent << "TimeTolerance: " << this->TimeTolerance << "\n";
}
