#include "vtkCenterlineMetrics.h"

#include "CenterlineOverlap.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
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
#include <vector>

using coronary::CenterlineOverlapMeasures;
using coronary::CenterlinePointMatch;
using coronary::Polylines;
using coronary::TreeOverlap;
using coronary::TreeOverlapRow;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCenterlineMetrics);

namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

Polylines Read(vtkPolyData* data, vtkDataArray* radius)
{
  Polylines set;
  const vtkIdType points = data->GetNumberOfPoints();
  set.points.resize(points);
  for (vtkIdType i = 0; i < points; ++i)
  {
    data->GetPoint(i, set.points[i].data());
    if (radius != nullptr)
    {
      set.radius.push_back(radius->GetComponent(i, 0));
    }
  }
  vtkNew<vtkIdList> cell;
  vtkCellArray* lines = data->GetLines();
  for (lines->InitTraversal(); lines->GetNextCell(cell) != 0;)
  {
    set.lines.emplace_back(cell->begin(), cell->end());
  }
  return set;
}

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
}

vtkCenterlineMetrics::vtkCenterlineMetrics()
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(2);
}

void vtkCenterlineMetrics::SetReferenceData(vtkPolyData* reference)
{
  this->SetInputData(ReferencePort, reference);
}

vtkPolyData* vtkCenterlineMetrics::GetLines()
{
  return vtkPolyData::SafeDownCast(this->GetOutputDataObject(LinesPort));
}

int vtkCenterlineMetrics::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  return 1;
}

int vtkCenterlineMetrics::FillOutputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkDataObject::DATA_TYPE_NAME(), port == TablePort ? "vtkTable" : "vtkPolyData");
  return 1;
}

int vtkCenterlineMetrics::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkCenterlineMetrics::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // Trees are compared as a whole.
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  return 1;
}

int vtkCenterlineMetrics::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* result = vtkPolyData::GetData(inputs[ResultPort], 0);
  vtkPolyData* reference = vtkPolyData::GetData(inputs[ReferencePort], 0);
  vtkTable* table = vtkTable::GetData(outputs, TablePort);
  vtkPolyData* linesOutput = vtkPolyData::GetData(outputs, LinesPort);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  const bool wanted = outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) <= 0;
  try
  {
    coronary::CenterlineOverlapSettings settings;
    settings.spacing = this->Spacing;
    settings.relevantRadius = this->RelevantRadius;
    settings.leastRadius = this->LeastRadius;
    settings.startLength = this->StartLength;
    settings.clipStart = this->ClipStart;
    settings.Validate();
    if (this->Method < AutomaticMethod || this->Method > PathMethod)
    {
      throw std::invalid_argument("There is no method " + std::to_string(this->Method));
    }
    Polylines sets[2]; // reference, result
    if (wanted)
    {
      sets[0] = Read(reference,
        reference->GetNumberOfLines() > 0 ? vtkCoronary::RadiusOf(reference, "The reference has")
                                          : nullptr);
      sets[1] = Read(result, vtkCoronary::FindRadius(result));
    }
    if (sets[0].lines.empty())
    {
      sets[0].radius.assign(sets[0].points.size(), 0.0);
    }
    const bool single = sets[0].lines.size() == 1 && sets[1].lines.size() == 1;
    const bool paths = this->Method == PathMethod || (this->Method == AutomaticMethod && single);
    const auto progress = vtkCoronary::ProgressOf(this);
    const TreeOverlap overlap = paths
      ? coronary::CompareCenterlinePaths(sets[0], sets[1], settings, progress)
      : coronary::CompareCenterlineTrees(sets[0], sets[1], settings, progress);
    if (single && sets[0].lines[0].size() > 1 && sets[1].lines[0].size() > 1)
    {
      const auto point = [&](int side, bool last) -> const Vector3&
      {
        const std::vector<std::int64_t>& line = sets[side].lines[0];
        return sets[side].points[last ? line.back() : line.front()];
      };
      const double along =
        (point(0, false) - point(1, false)).norm() + (point(0, true) - point(1, true)).norm();
      const double against =
        (point(0, false) - point(1, true)).norm() + (point(0, true) - point(1, false)).norm();
      if (paths && against < along)
      {
        vtkWarningMacro("The result's line runs against the reference's");
      }
    }

    auto* labels = wanted ? vtkStringArray::SafeDownCast(reference->GetCellData()->GetAbstractArray(
                              vtkCoronaryArrayNames::SegmentLabel))
                          : nullptr;
    // The names belong to the lines only where there are no other cells.
    if (labels != nullptr &&
      (labels->GetNumberOfValues() != static_cast<vtkIdType>(sets[0].lines.size()) ||
        reference->GetNumberOfCells() != labels->GetNumberOfValues()))
    {
      labels = nullptr;
    }
    if (wanted)
    {
      WriteTable(table, overlap, paths, labels);
    }

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
    linesOutput->SetPoints(points);
    linesOutput->SetLines(lines);
    linesOutput->GetPointData()->AddArray(match);
    linesOutput->GetPointData()->AddArray(distance);
    linesOutput->GetPointData()->AddArray(pointSide);
    linesOutput->GetPointData()->AddArray(radius);
    linesOutput->GetCellData()->AddArray(cellSide);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "to compare the lines");
  }
}

void vtkCenterlineMetrics::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Method: " << this->Method << "\n";
  os << indent << "Spacing: " << this->Spacing << "\n";
  os << indent << "RelevantRadius: " << this->RelevantRadius << "\n";
  os << indent << "LeastRadius: " << this->LeastRadius << "\n";
  os << indent << "StartLength: " << this->StartLength << "\n";
  os << indent << "ClipStart: " << this->ClipStart << "\n";
}
