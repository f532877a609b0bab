#include "vtkCenterlineConversion.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryUpstream.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <map>
#include <new>
#include <stdexcept>
#include <vector>

namespace names = vtkCoronaryArrayNames;
using coronary::VesselTree;
using coronary::VmtkTract;
using vtkCoronary::CenterlineForm;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCenterlineConversion);

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

vtkCenterlineConversion::vtkCenterlineConversion()
{
}

int vtkCenterlineConversion::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  outputs->GetInformationObject(0)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  return 1;
}

int vtkCenterlineConversion::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // A tree is converted as a whole.
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  return 1;
}

void vtkCenterlineConversion::ToVmtk(vtkPolyData* input, vtkPolyData* output) const
{
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

void vtkCenterlineConversion::ToTree(vtkPolyData* input, vtkPolyData* output) const
{
  const std::vector<VmtkTract> tracts = vtkCoronary::TractsOf(input);
  std::vector<coronary::TractPoint> origins;
  VesselTree tree = coronary::FromVmtkTracts(tracts, this->Tolerance, &origins);
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

int vtkCenterlineConversion::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* input = vtkPolyData::GetData(inputs[0], 0);
  vtkPolyData* output = vtkPolyData::GetData(outputs, 0);
  output->GetFieldData()->PassData(input->GetFieldData());
  if (outputs->GetInformationObject(0)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0 ||
    input->GetNumberOfLines() == 0)
  {
    return 1;
  }
  try
  {
    if (this->OutputForm != TreeForm && this->OutputForm != VmtkForm)
    {
      throw std::invalid_argument("There is no form " + std::to_string(this->OutputForm));
    }
    const CenterlineForm form = vtkCoronary::FormOf(input);
    if (form == CenterlineForm::Unknown)
    {
      throw std::invalid_argument(
        "The lines are neither a tree (cell arrays GroupIds and ParentGroupIds) nor VMTK's "
        "branches "
        "(CenterlineIds, TractIds and GroupIds): make a tree of them with vtkCoronaryTreeTopology");
    }
    if ((form == CenterlineForm::Tree) == (this->OutputForm == TreeForm))
    {
      output->ShallowCopy(input);
    }
    else if (this->OutputForm == VmtkForm)
    {
      this->ToVmtk(input, output);
    }
    else
    {
      this->ToTree(input, output);
    }
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (const std::bad_alloc&)
  {
    vtkErrorMacro("Not enough memory to convert the centerlines");
  }
  catch (const std::exception& error)
  {
    vtkErrorMacro(<< error.what());
  }
  output->Initialize();
  return 0;
}

void vtkCenterlineConversion::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "OutputForm: " << this->OutputForm << '\n';
  os << indent << "Tolerance: " << this->Tolerance << '\n';
}
