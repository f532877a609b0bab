#include "vtkVesselTree.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

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

#include <set>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;

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

coronary::Vector3 PointOf(vtkPolyData* data, vtkIdType id)
{
  coronary::Vector3 point;
  data->GetPoint(id, point.data());
  return point;
}

/// In the given order, but no daughter before its parent; what has none stays where it is.
void ParentsFirst(std::vector<coronary::VesselTree::Branch>& branches)
{
  std::set<int> all;
  for (const auto& branch : branches)
  {
    all.insert(branch.groupId);
  }
  std::set<int> placed;
  std::vector<coronary::VesselTree::Branch> waiting;
  waiting.swap(branches);
  for (std::size_t before = waiting.size() + 1; before != waiting.size();)
  {
    before = waiting.size();
    std::vector<coronary::VesselTree::Branch> later;
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

template <typename Array, typename Get>
void AddCellValues(vtkPolyData* data, const char* name,
  const std::vector<coronary::VesselTree::Branch>& branches, const Get& get)
{
  vtkNew<Array> array;
  array->SetName(name);
  for (const auto& branch : branches)
  {
    array->InsertNextValue(get(branch));
  }
  data->GetCellData()->AddArray(array);
}

void AddPointValues(vtkPolyData* data, const std::string& name, const std::vector<double>& values)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  for (const double value : values)
  {
    array->InsertNextValue(value);
  }
  data->GetPointData()->AddArray(array);
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

coronary::VesselTree vtkCoronary::TreeOf(vtkPolyData* data, Radii radii)
{
  vtkDataArray* radius = RadiusFor(data, radii);
  vtkDataArray* groups = Column(data->GetCellData(), names::GroupIds, "cell");
  vtkDataArray* parents = Column(data->GetCellData(), names::ParentGroupIds, "cell");
  vtkDataArray* trees = data->GetCellData()->GetArray(names::TreeIds);
  vtkDataArray* segments = data->GetCellData()->GetArray(names::SegmentIds);
  coronary::VesselTree tree;
  const vtkIdType count = data->GetNumberOfPoints();
  for (vtkIdType i = 0; i < count; ++i)
  {
    tree.points.push_back(PointOf(data, i));
    tree.radius.push_back(radius != nullptr ? radius->GetComponent(i, 0) : 0.0);
  }
  ForEachLine(data,
    [&](vtkIdType cell, vtkIdList* ids)
    {
      coronary::VesselTree::Branch branch;
      branch.points.assign(ids->begin(), ids->end());
      branch.groupId = static_cast<int>(groups->GetComponent(cell, 0));
      branch.parentGroupId = static_cast<int>(parents->GetComponent(cell, 0));
      branch.treeId = trees != nullptr ? static_cast<int>(trees->GetComponent(cell, 0)) : 0;
      branch.segmentId =
        segments != nullptr ? static_cast<int>(segments->GetComponent(cell, 0)) : 0;
      tree.branches.push_back(std::move(branch));
    });
  ParentsFirst(tree.branches);
  coronary::MeasureTree(tree);
  return tree;
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
        tract.points.push_back(PointOf(data, id));
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

void vtkCoronary::SetTree(vtkPolyData* data, const coronary::VesselTree& tree)
{
  using Branch = coronary::VesselTree::Branch;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const coronary::Vector3& point : tree.points)
  {
    points->InsertNextPoint(point.data());
  }
  vtkNew<vtkCellArray> lines;
  for (const Branch& branch : tree.branches)
  {
    lines->InsertNextCell(static_cast<int>(branch.points.size()));
    for (const std::int64_t point : branch.points)
    {
      lines->InsertCellPoint(static_cast<vtkIdType>(point));
    }
  }
  data->SetPoints(points);
  data->SetLines(lines);
  AddPointValues(data, names::Radius, tree.radius);
  AddPointValues(data, names::Abscissas, tree.abscissa);
  AddCellValues<vtkIntArray>(
    data, names::GroupIds, tree.branches, [](const Branch& b) { return b.groupId; });
  AddCellValues<vtkIntArray>(
    data, names::ParentGroupIds, tree.branches, [](const Branch& b) { return b.parentGroupId; });
  AddCellValues<vtkIntArray>(
    data, names::TreeIds, tree.branches, [](const Branch& b) { return b.treeId; });
  AddCellValues<vtkDoubleArray>(
    data, names::Length, tree.branches, [](const Branch& b) { return b.length; });
  AddCellValues<vtkDoubleArray>(
    data, names::Tortuosity, tree.branches, [](const Branch& b) { return b.tortuosity; });
}
