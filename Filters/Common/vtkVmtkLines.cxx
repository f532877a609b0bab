#include "vtkVmtkLines.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <map>
#include <vector>

namespace names = vtkCoronaryArrayNames;
using coronary::VesselTree;
using coronary::VmtkTract;

namespace
{
/// Rows of the given attributes, in the given order.
void CopyRows(
  vtkDataSetAttributes* from, vtkDataSetAttributes* to, const std::vector<vtkIdType>& rows)
{
  to->CopyAllOn();
  to->CopyAllocate(from, static_cast<vtkIdType>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
  {
    to->CopyData(from, rows[i], static_cast<vtkIdType>(i));
  }
}

/// The cell that a branch comes from: the one that holds its second point. The first one may be
/// its parent's.
std::map<vtkIdType, vtkIdType> CellsByPoint(vtkPolyData* data)
{
  std::map<vtkIdType, vtkIdType> cells;
  vtkCellArray* lines = data->GetLines();
  for (vtkIdType line = 0; line < lines->GetNumberOfCells(); ++line)
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    lines->GetCellAtId(line, count, ids);
    for (vtkIdType i = 1; i < count; ++i)
    {
      cells[ids[i]] = data->GetNumberOfVerts() + line;
    }
  }
  return cells;
}

template <typename Get>
void AddCellValues(
  vtkPolyData* data, const char* name, const std::vector<VmtkTract>& tracts, const Get& get)
{
  vtkNew<vtkIntArray> array;
  array->SetName(name);
  for (const VmtkTract& tract : tracts)
  {
    array->InsertNextValue(get(tract));
  }
  data->GetCellData()->AddArray(array);
}
}

void vtkCoronary::ToVmtkLines(vtkPolyData* input, vtkPolyData* output)
{
  output->GetFieldData()->PassData(input->GetFieldData());
  if (input->GetNumberOfLines() == 0)
  {
    return;
  }
  const VesselTree tree = vtkCoronary::TreeOf(input);
  const std::vector<VmtkTract> tracts = coronary::ToVmtkTracts(tree);
  const std::map<vtkIdType, vtkIdType> cellOf = CellsByPoint(input);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> lines;
  std::vector<vtkIdType> pointRows;
  std::vector<vtkIdType> cellRows;
  for (const VmtkTract& tract : tracts)
  {
    lines->InsertNextCell(static_cast<int>(tract.points.size()));
    for (std::size_t i = 0; i < tract.points.size(); ++i)
    {
      lines->InsertCellPoint(points->InsertNextPoint(tract.points[i].data()));
      pointRows.push_back(static_cast<vtkIdType>(tract.source[i]));
    }
    cellRows.push_back(cellOf.at(static_cast<vtkIdType>(tract.source[1])));
  }
  output->SetPoints(points);
  output->SetLines(lines);
  CopyRows(input->GetPointData(), output->GetPointData(), pointRows);
  CopyRows(input->GetCellData(), output->GetCellData(), cellRows);
  AddCellValues(
    output, names::CenterlineIds, tracts, [](const VmtkTract& t) { return t.centerlineId; });
  AddCellValues(output, names::TractIds, tracts, [](const VmtkTract& t) { return t.tractId; });
  AddCellValues(output, names::GroupIds, tracts, [](const VmtkTract& t) { return t.groupId; });
  AddCellValues(output, names::Blanking, tracts, [](const VmtkTract& t) { return t.blanking; });
  // As VMTK's form has it: parents follow from the order of the tracts, and are right after a split.
  output->GetCellData()->RemoveArray(names::ParentGroupIds);
}

void vtkCoronary::FromVmtkLines(vtkPolyData* input, double tolerance, vtkPolyData* output)
{
  output->GetFieldData()->PassData(input->GetFieldData());
  const std::vector<VmtkTract> tracts = vtkCoronary::TractsOf(input);
  std::vector<coronary::TractPoint> origins;
  VesselTree tree = coronary::FromVmtkTracts(tracts, tolerance, &origins);
  std::vector<vtkIdType> pointRows;
  pointRows.reserve(origins.size());
  for (const coronary::TractPoint& origin : origins)
  {
    pointRows.push_back(static_cast<vtkIdType>(tracts[origin.tract].source[origin.point]));
  }
  std::vector<vtkIdType> cellRows;
  vtkDataArray* trees = input->GetCellData()->GetArray(names::TreeIds);
  for (VesselTree::Branch& branch : tree.branches)
  {
    const std::size_t tract = origins[static_cast<std::size_t>(branch.points[1])].tract;
    cellRows.push_back(input->GetNumberOfVerts() + static_cast<vtkIdType>(tract));
    if (trees != nullptr)
    {
      branch.treeId = static_cast<int>(trees->GetComponent(cellRows.back(), 0));
    }
  }
  CopyRows(input->GetPointData(), output->GetPointData(), pointRows);
  CopyRows(input->GetCellData(), output->GetCellData(), cellRows);
  for (const char* name : { names::CenterlineIds, names::TractIds, names::Blanking })
  {
    output->GetCellData()->RemoveArray(name);
  }
  vtkCoronary::SetTree(output, tree);
}
