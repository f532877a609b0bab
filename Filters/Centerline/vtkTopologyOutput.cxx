#include "vtkTopologyOutput.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <cmath>
#include <string>

using coronary::CenterlineTopology;
using coronary::Vector3;

namespace
{
// Not NaN, which VTK writes into XML files so that its reader complains.
constexpr double NoDaughter = -1.0;

/// As many daughters as the arrays of a bifurcation have room for at least.
constexpr int MinimumDaughters = 3;

/// One row of `width` values for each list; what a list does not have is `missing`.
template <typename Array, typename Value>
void AddRows(vtkFieldData* data, const std::string& name,
  const std::vector<std::vector<Value>>& rows, int width, Value missing)
{
  vtkNew<Array> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(width);
  array->SetNumberOfTuples(static_cast<vtkIdType>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
  {
    for (int k = 0; k < width; ++k)
    {
      const bool has = k < static_cast<int>(rows[i].size());
      array->SetTypedComponent(static_cast<vtkIdType>(i), k, has ? rows[i][k] : missing);
    }
  }
  data->AddArray(array);
}

template <typename Get>
auto OfBifurcations(const CenterlineTopology& tree, const Get& get)
{
  std::vector<decltype(get(tree.bifurcations[0]))> values;
  values.reserve(tree.bifurcations.size());
  for (const auto& bifurcation : tree.bifurcations)
  {
    values.push_back(get(bifurcation));
  }
  return values;
}

const char* NameOf(coronary::Dominance dominance)
{
  return dominance == coronary::Dominance::Right ? "right"
    : dominance == coronary::Dominance::Left     ? "left"
                                                 : "balanced";
}
}

namespace vtkCoronary
{
TopologyOutput::TopologyOutput(
  vtkPolyData* input, const CenterlineTopology& tree, double murrayExponent)
  : Input(input)
  , Tree(tree)
  , MurrayExponent(murrayExponent)
{
}

void TopologyOutput::WriteTree(vtkPolyData* output) const
{
  const CenterlineTopology& tree = this->Tree;
  const auto count = static_cast<vtkIdType>(tree.points.size());
  vtkPointData* data = output->GetPointData();
  vtkPointData* given = this->Input->GetPointData();
  data->CopyAllOn();
  data->CopyAllocate(given, count);
  for (vtkIdType i = 0; i < count; ++i)
  {
    data->CopyData(given, tree.source[i], i);
  }
  vtkCoronary::SetTree(output, tree, vtkCoronary::BranchArrays::Named,
    this->Input->GetPoints() != nullptr ? this->Input->GetPoints()->GetDataType() : VTK_DOUBLE);
  AddVectors(data, vtkCoronaryArrayNames::FrenetTangent, tree.tangent);
  AddVectors(data, vtkCoronaryArrayNames::FrenetNormal, tree.normal);
  AddVectors(data, vtkCoronaryArrayNames::FrenetBinormal, tree.binormal);
  vtkCoronary::AddArray<vtkDoubleArray>(data, vtkCoronaryArrayNames::Curvature, tree.curvature);
  vtkCoronary::AddArray<vtkDoubleArray>(data, vtkCoronaryArrayNames::Torsion, tree.torsion);
  vtkCoronary::AddArray<vtkDoubleArray>(data, vtkCoronaryArrayNames::SectionArea, tree.area);
  vtkCoronary::AddArray<vtkIntArray>(data, vtkCoronaryArrayNames::SegmentIds, tree.segmentId);
}

void TopologyOutput::WriteBifurcations(vtkPolyData* output) const
{
  namespace names = vtkCoronaryArrayNames;
  using coronary::Bifurcation;
  const CenterlineTopology& tree = this->Tree;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> vertices;
  int width = MinimumDaughters;
  for (const Bifurcation& bifurcation : tree.bifurcations)
  {
    const vtkIdType id = points->InsertNextPoint(tree.points[bifurcation.point].data());
    vertices->InsertNextCell(1, &id);
    width = std::max(width, static_cast<int>(bifurcation.daughters.size()));
  }
  output->SetPoints(points);
  output->SetVerts(vertices);
  vtkPointData* data = output->GetPointData();
  vtkCoronary::AddArray<vtkIntArray>(data, vtkCoronaryArrayNames::ParentGroupIds,
    OfBifurcations(tree, [](const Bifurcation& b) { return b.parent; }));
  AddRows<vtkIntArray>(data, names::DaughterGroupIds,
    OfBifurcations(tree, [](const Bifurcation& b) { return b.daughters; }), width, -1);
  vtkCoronary::AddArray<vtkIntArray>(data, vtkCoronaryArrayNames::TreeIds,
    OfBifurcations(tree, [&](const Bifurcation& b) { return tree.branches[b.parent].treeId; }));
  vtkCoronary::AddArray<vtkIntArray>(data, vtkCoronaryArrayNames::SegmentIds,
    OfBifurcations(tree, [&](const Bifurcation& b) { return tree.branches[b.parent].segmentId; }));
  AddRows<vtkDoubleArray>(data, names::DaughterAngles,
    OfBifurcations(tree, [](const Bifurcation& b) { return b.daughterAngles; }), width, NoDaughter);
  AddRows<vtkDoubleArray>(data, names::DaughterRadii,
    OfBifurcations(tree, [](const Bifurcation& b) { return b.daughterRadius; }), width, NoDaughter);
  const auto numbers = [&](const char* name, double Bifurcation::*member)
  {
    vtkCoronary::AddArray<vtkDoubleArray>(
      data, name, OfBifurcations(tree, [=](const Bifurcation& b) { return b.*member; }));
  };
  numbers(names::BifurcationAngle, &Bifurcation::angle);
  numbers(names::ParentRadius, &Bifurcation::parentRadius);
  numbers(names::AreaRatio, &Bifurcation::areaRatio);
  numbers(names::DaughterAreaRatio, &Bifurcation::daughterAreaRatio);
  numbers(names::MurrayResidual, &Bifurcation::murrayResidual);
  numbers(names::HuoKassabResidual, &Bifurcation::huoKassabResidual);
  numbers(names::FinetRatio, &Bifurcation::finetRatio);
  numbers(names::FittedExponent, &Bifurcation::fittedExponent);
  vtkCoronary::AddArray<vtkDoubleArray>(data, names::MurrayExponent,
    std::vector<double>(tree.bifurcations.size(), this->MurrayExponent));
}

void TopologyOutput::WriteLoops(vtkPolyData* output) const
{
  coronary::Polylines lines;
  std::vector<double> lengths;
  for (const coronary::CenterlineLoop& loop : this->Tree.loops)
  {
    if (loop.points.size() < 3)
    {
      continue;
    }
    lengths.push_back(loop.length);
    const auto first = static_cast<std::int64_t>(lines.points.size());
    std::vector<std::int64_t>& line = lines.lines.emplace_back();
    for (const std::int64_t point : loop.points)
    {
      line.push_back(static_cast<std::int64_t>(lines.points.size()));
      lines.points.push_back(this->Tree.points[point]);
    }
    line.push_back(first);
  }
  vtkCoronary::SetLines(output, lines);
  vtkCoronary::AddArray<vtkDoubleArray>(
    output->GetCellData(), vtkCoronaryArrayNames::Length, lengths);
}

std::vector<coronary::TreeWarning> TopologyOutput::Warnings(
  const coronary::LabelingResult& labels) const
{
  std::vector<double> vein;
  vtkDataArray* given =
    this->Input->GetPointData()->GetArray(vtkCoronaryArrayNames::VeinProbability);
  for (std::size_t i = 0; given && i < this->Tree.source.size(); ++i)
  {
    vein.push_back(given->GetComponent(this->Tree.source[i], 0));
  }
  return coronary::CheckCoronaryTrees(this->Tree, labels, vein);
}

void TopologyOutput::WriteWarnings(
  vtkPolyData* output, const std::vector<coronary::TreeWarning>& warnings) const
{
  namespace names = vtkCoronaryArrayNames;
  if (warnings.empty())
  {
    return;
  }
  std::vector<vtkStdString> texts;
  std::vector<vtkStdString> vessels;
  std::vector<std::vector<double>> places;
  std::vector<double> confidences;
  for (const coronary::TreeWarning& warning : warnings)
  {
    texts.emplace_back(warning.what);
    vessels.emplace_back(warning.vessel);
    places.push_back({ warning.place[0], warning.place[1], warning.place[2] });
    confidences.push_back(warning.confidence);
  }
  vtkFieldData* data = output->GetFieldData();
  vtkCoronary::AddArray<vtkStringArray>(data, names::Warnings, texts);
  vtkCoronary::AddArray<vtkStringArray>(data, names::WarningVessels, vessels);
  AddRows<vtkDoubleArray>(data, names::WarningPlaces, places, 3, 0.0);
  vtkCoronary::AddArray<vtkDoubleArray>(data, names::WarningConfidences, confidences);
}

void TopologyOutput::WriteFieldData(
  vtkPolyData* output, const coronary::LabelingResult* labels) const
{
  namespace names = vtkCoronaryArrayNames;
  const CenterlineTopology& tree = this->Tree;
  vtkFieldData* data = output->GetFieldData();
  data->PassData(this->Input->GetFieldData());
  vtkCoronary::AddArray<vtkIntArray>(
    data, names::PrunedTwigs, std::vector<int>{ tree.prunedTwigs });
  vtkCoronary::AddArray<vtkIntArray>(data, names::ClosedGaps, std::vector<int>{ tree.closedGaps });
  std::vector<double> lengths;
  for (const coronary::CenterlineLoop& loop : tree.loops)
  {
    lengths.push_back(loop.length);
  }
  vtkCoronary::AddArray<vtkDoubleArray>(data, names::LoopLengths, lengths);
  // No NaN here: VTK gathers the ranks' data in a form of text that cannot hold it.
  std::vector<double> fitted;
  if (!std::isnan(tree.fittedExponent))
  {
    fitted.push_back(tree.fittedExponent);
  }
  vtkCoronary::AddArray<vtkDoubleArray>(data, names::FittedExponent, fitted);
  if (labels != nullptr)
  {
    vtkCoronary::AddArray<vtkStringArray>(
      data, names::Dominance, std::vector<vtkStdString>{ vtkStdString(NameOf(labels->dominance)) });
    const coronary::HeartPose& heart = labels->heart;
    const Vector3 shift = -(heart.axes * heart.origin) / heart.size;
    std::vector<std::vector<double>> matrix(1);
    for (int row = 0; row < 4; ++row)
    {
      for (int column = 0; column < 4; ++column)
      {
        matrix[0].push_back(row == 3 ? (column == 3 ? 1.0 : 0.0)
            : column == 3            ? shift[row]
                                     : heart.axes(row, column) / heart.size);
      }
    }
    AddRows<vtkDoubleArray>(data, names::HeartFrame, matrix, 16, 0.0);
  }
}
}
