#include "vtkVesselTree.h"

#include "CoronaryAnatomy.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkAbstractArray.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkIdList.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"

#include <numeric>
#include <set>
#include <stdexcept>
#include <type_traits>
#include <utility>

namespace names = vtkCoronaryArrayNames;
using Branch = coronary::VesselTree::Branch;

namespace
{
/// One value for each point or cell.
vtkDataArray* Column(vtkDataSetAttributes* data, const char* name, const char* kind)
{
  vtkDataArray* array = data->GetArray(name);
  if (array == nullptr)
  {
    throw std::invalid_argument(
      "The centerlines have no " + std::string(kind) + " array '" + name + "'");
  }
  if (array->GetNumberOfComponents() != 1)
  {
    throw std::invalid_argument("The " + std::string(kind) + " array '" + name +
      "' of the centerlines has " + std::to_string(array->GetNumberOfComponents()) +
      " components: one is needed");
  }
  return array;
}

vtkDataArray* RadiusFor(vtkPolyData* data, vtkCoronary::Radii radii)
{
  return radii == vtkCoronary::Radii::Ignored ? nullptr
    : radii == vtkCoronary::Radii::IfThere    ? vtkCoronary::FindRadius(data)
                                              : vtkCoronary::RadiusOf(data, "The centerlines have");
}

/// Calls visit(cell id, point ids) for all lines.
template <typename Visit>
void ForEachLine(vtkPolyData* data, const Visit& visit)
{
  vtkNew<vtkIdList> ids;
  vtkCellArray* lines = data->GetLines();
  const vtkIdType first = data->GetNumberOfVerts();
  for (vtkIdType line = 0; line < lines->GetNumberOfCells(); ++line)
  {
    lines->GetCellAtId(line, ids);
    visit(first + line, ids);
  }
}

/// In the given order, but no daughter before its parent; what has none stays where it is.
void ParentsFirst(std::vector<Branch>& branches)
{
  std::set<int> all;
  for (const auto& branch : branches)
  {
    all.insert(branch.groupId);
  }
  std::set<int> placed;
  std::vector<Branch> waiting;
  waiting.swap(branches);
  for (std::size_t before = waiting.size() + 1; before != waiting.size();)
  {
    before = waiting.size();
    std::vector<Branch> later;
    for (auto& branch : waiting)
    {
      const int parent = branch.parentGroupId;
      if (parent == -1 || placed.count(parent) > 0 || all.count(parent) == 0)
      {
        placed.insert(branch.groupId);
        branches.push_back(std::move(branch));
      }
      else
      {
        later.push_back(std::move(branch));
      }
    }
    waiting.swap(later);
  }
  // Parents in a ring: CheckTree says so.
  branches.insert(branches.end(), waiting.begin(), waiting.end());
}

/// Of each point the array's value, where it is one that can be used.
template <typename Value>
void TakePointValues(vtkPolyData* data, const char* name, std::vector<Value>& values)
{
  vtkDataArray* array = data->GetPointData()->GetArray(name);
  if (array == nullptr || array->GetNumberOfComponents() != 1 ||
    array->GetNumberOfTuples() != data->GetNumberOfPoints())
  {
    return;
  }
  values.clear();
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i)
  {
    values.push_back(static_cast<Value>(array->GetComponent(i, 0)));
  }
}

/// One value of each branch or tract.
template <typename Array, typename Item, typename Get>
void AddCellValues(
  vtkPolyData* data, const char* name, const std::vector<Item>& items, const Get& get)
{
  std::vector<std::decay_t<decltype(get(items.front()))>> values;
  values.reserve(items.size());
  for (const Item& item : items)
  {
    values.push_back(get(item));
  }
  vtkCoronary::AddArray<Array>(data->GetCellData(), name, values);
}
}

vtkCoronary::CenterlineForm vtkCoronary::FormOf(vtkPolyData* data)
{
  const auto has = [&](const char* name) { return data->GetCellData()->GetArray(name) != nullptr; };
  if (!has(names::GroupIds))
  {
    return CenterlineForm::Unknown;
  }
  return has(names::ParentGroupIds)                     ? CenterlineForm::Tree
    : has(names::CenterlineIds) && has(names::TractIds) ? CenterlineForm::Vmtk
                                                        : CenterlineForm::Unknown;
}

coronary::Polylines vtkCoronary::LinesOf(vtkPolyData* data, vtkDataArray* radius)
{
  coronary::Polylines lines;
  const vtkIdType count = data->GetNumberOfPoints();
  lines.points.resize(static_cast<std::size_t>(count));
  for (vtkIdType i = 0; i < count; ++i)
  {
    data->GetPoint(i, lines.points[static_cast<std::size_t>(i)].data());
    if (radius != nullptr)
    {
      lines.radius.push_back(radius->GetComponent(i, 0));
    }
  }
  ForEachLine(
    data, [&](vtkIdType, vtkIdList* ids) { lines.lines.emplace_back(ids->begin(), ids->end()); });
  return lines;
}

coronary::VesselTree vtkCoronary::BranchesOf(vtkPolyData* data, vtkDataArray* radius)
{
  coronary::Polylines lines = LinesOf(data, radius);
  coronary::VesselTree tree;
  tree.points = std::move(lines.points);
  tree.radius = std::move(lines.radius);
  vtkCellData* cells = data->GetCellData();
  const auto fits = [&](vtkAbstractArray* array)
  { return array != nullptr && array->GetNumberOfTuples() >= data->GetNumberOfCells(); };
  const auto read = [&](const char* name, const auto& take)
  {
    vtkDataArray* array = cells->GetArray(name);
    for (std::size_t n = 0; fits(array) && n < tree.branches.size(); ++n)
    {
      // Vertices stand before the lines.
      const vtkIdType cell = data->GetNumberOfVerts() + static_cast<vtkIdType>(n);
      take(tree.branches[n], static_cast<int>(array->GetComponent(cell, 0)));
    }
  };
  for (std::vector<std::int64_t>& points : lines.lines)
  {
    Branch branch;
    branch.groupId = static_cast<int>(tree.branches.size());
    branch.points = std::move(points);
    tree.branches.push_back(std::move(branch));
  }
  read(names::GroupIds, [](Branch& branch, int value) { branch.groupId = value; });
  read(names::ParentGroupIds, [](Branch& branch, int value) { branch.parentGroupId = value; });
  read(names::TreeIds, [](Branch& branch, int value) { branch.treeId = value; });
  read(names::SegmentIds, [](Branch& branch, int value) { branch.segmentId = value; });
  auto* labels = vtkStringArray::SafeDownCast(cells->GetAbstractArray(names::SegmentLabel));
  for (std::size_t n = 0; fits(labels) && n < tree.branches.size(); ++n)
  {
    tree.branches[n].name = labels->GetValue(data->GetNumberOfVerts() + static_cast<vtkIdType>(n));
  }
  return tree;
}

coronary::VesselTree vtkCoronary::TreeOf(vtkPolyData* data, Radii radii)
{
  vtkDataArray* radius = RadiusFor(data, radii);
  Column(data->GetCellData(), names::GroupIds, "cell");
  Column(data->GetCellData(), names::ParentGroupIds, "cell");
  coronary::VesselTree tree = BranchesOf(data, radius);
  tree.radius.resize(tree.points.size(), 0.0);
  ParentsFirst(tree.branches);
  coronary::MeasureTree(tree);
  return tree;
}

void vtkCoronary::AddPointValues(vtkPolyData* data, coronary::VesselTree& tree)
{
  TakePointValues(data, names::Confidence, tree.confidence);
  TakePointValues(data, names::Bridged, tree.bridged);
  TakePointValues(data, names::BridgeConfidence, tree.bridgeConfidence);
  TakePointValues(data, names::SegmentIds, tree.segmentId);
}

std::vector<coronary::VmtkTract> vtkCoronary::TractsOf(vtkPolyData* data, Radii radii)
{
  vtkDataArray* radius = RadiusFor(data, radii);
  vtkDataArray* lines = Column(data->GetCellData(), names::CenterlineIds, "cell");
  vtkDataArray* numbers = Column(data->GetCellData(), names::TractIds, "cell");
  vtkDataArray* groups = Column(data->GetCellData(), names::GroupIds, "cell");
  vtkDataArray* blanking = data->GetCellData()->GetArray(names::Blanking);
  std::vector<coronary::VmtkTract> tracts;
  ForEachLine(data,
    [&](vtkIdType cell, vtkIdList* ids)
    {
      coronary::VmtkTract tract;
      for (const vtkIdType id : *ids)
      {
        tract.points.emplace_back(data->GetPoint(id));
        tract.radius.push_back(radius != nullptr ? radius->GetComponent(id, 0) : 0.0);
        tract.source.push_back(id);
      }
      tract.centerlineId = static_cast<int>(lines->GetComponent(cell, 0));
      tract.tractId = static_cast<int>(numbers->GetComponent(cell, 0));
      tract.groupId = static_cast<int>(groups->GetComponent(cell, 0));
      tract.blanking = blanking != nullptr ? static_cast<int>(blanking->GetComponent(cell, 0)) : 0;
      tracts.push_back(std::move(tract));
    });
  return tracts;
}

void vtkCoronary::SetTree(
  vtkPolyData* data, const coronary::VesselTree& tree, BranchArrays arrays, int pointType)
{
  SetLines(data, coronary::LinesOf(tree), pointType);
  AddArray<vtkDoubleArray>(data->GetPointData(), names::Radius, tree.radius);
  AddArray<vtkDoubleArray>(data->GetPointData(), names::Abscissas, tree.abscissa);
  const auto ints = [&](const char* name, int Branch::*member)
  {
    AddCellValues<vtkIntArray>(
      data, name, tree.branches, [=](const Branch& branch) { return branch.*member; });
  };
  const auto lengths = [&](const char* name, double Branch::*member)
  {
    AddCellValues<vtkDoubleArray>(
      data, name, tree.branches, [=](const Branch& branch) { return branch.*member; });
  };
  ints(names::GroupIds, &Branch::groupId);
  ints(names::ParentGroupIds, &Branch::parentGroupId);
  ints(names::TreeIds, &Branch::treeId);
  if (arrays == BranchArrays::Named)
  {
    ints(names::BranchGeneration, &Branch::generation);
    ints(names::StrahlerOrder, &Branch::strahlerOrder);
    ints(names::SegmentIds, &Branch::segmentId);
    AddCellValues<vtkStringArray>(data, names::SegmentLabel, tree.branches,
      [](const Branch& branch) { return vtkStdString(coronary::SegmentName(branch.segmentId)); });
  }
  lengths(names::Length, &Branch::length);
  lengths(names::Tortuosity, &Branch::tortuosity);
}

void vtkCoronary::SetLines(vtkPolyData* data, const coronary::Polylines& lines, int pointType)
{
  vtkNew<vtkPoints> points;
  points->SetDataType(pointType);
  points->SetNumberOfPoints(static_cast<vtkIdType>(lines.points.size()));
  for (std::size_t i = 0; i < lines.points.size(); ++i)
  {
    points->SetPoint(static_cast<vtkIdType>(i), lines.points[i].data());
  }
  vtkNew<vtkCellArray> cells;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    cells->InsertNextCell(static_cast<int>(line.size()));
    for (const std::int64_t point : line)
    {
      cells->InsertCellPoint(static_cast<vtkIdType>(point));
    }
  }
  data->SetPoints(points);
  data->SetLines(cells);
}

void vtkCoronary::SetTracts(vtkPolyData* data, const std::vector<coronary::VmtkTract>& tracts)
{
  using coronary::VmtkTract;
  coronary::Polylines lines;
  for (const VmtkTract& tract : tracts)
  {
    lines.lines.emplace_back(tract.points.size());
    std::iota(lines.lines.back().begin(), lines.lines.back().end(),
      static_cast<std::int64_t>(lines.points.size()));
    lines.points.insert(lines.points.end(), tract.points.begin(), tract.points.end());
  }
  SetLines(data, lines);
  const auto ints = [&](const char* name, int VmtkTract::*member)
  {
    AddCellValues<vtkIntArray>(
      data, name, tracts, [=](const VmtkTract& tract) { return tract.*member; });
  };
  ints(names::CenterlineIds, &VmtkTract::centerlineId);
  ints(names::TractIds, &VmtkTract::tractId);
  ints(names::GroupIds, &VmtkTract::groupId);
  ints(names::Blanking, &VmtkTract::blanking);
}
