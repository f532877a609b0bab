#include "vtkVmtkLines.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkVesselTree.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
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
  vtkIdType cell = data->GetNumberOfVerts();
  for (const std::vector<std::int64_t>& line : vtkCoronary::LinesOf(data).lines)
  {
    for (std::size_t i = 1; i < line.size(); ++i)
    {
      cells[line[i]] = cell;
    }
    ++cell;
  }
  return cells;
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
  std::vector<vtkIdType> pointRows;
  std::vector<vtkIdType> cellRows;
  for (const VmtkTract& tract : tracts)
  {
    pointRows.insert(pointRows.end(), tract.source.begin(), tract.source.end());
    cellRows.push_back(cellOf.at(static_cast<vtkIdType>(tract.source[1])));
  }
  CopyRows(input->GetPointData(), output->GetPointData(), pointRows);
  CopyRows(input->GetCellData(), output->GetCellData(), cellRows);
  vtkCoronary::SetTracts(output, tracts);
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
