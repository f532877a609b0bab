#include "vtkTGFWriter.h"

#include "AtomicFile.h"
#include "CenterlineConversion.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkInformation.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace names = vtkCoronaryArrayNames;

vtkStandardNewMacro(vtkTGFWriter);

namespace
{
/// Lines of two points with `ParentJoint`, or without any ids of centerlines: joints and bones already.
bool IsSkeleton(vtkPolyData* data)
{
  vtkDataArray* parents = data->GetPointData()->GetArray(names::ParentJoint);
  return data->GetLines()->IsHomogeneous() == 2 &&
    (parents != nullptr || vtkCoronary::FormOf(data) == vtkCoronary::CenterlineForm::Unknown);
}

/// All points are joints; lines are bones, by their ids where they have some, else as they come.
coronary::TgfSkeleton SkeletonOf(vtkPolyData* data)
{
  coronary::TgfSkeleton skeleton;
  for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
  {
    skeleton.joints.emplace_back(data->GetPoint(n));
  }
  vtkDataArray* parents = data->GetPointData()->GetArray(names::ParentJoint);
  vtkDataArray* ids = data->GetCellData()->GetArray(names::BoneId);
  std::vector<vtkIdType> order(data->GetNumberOfLines());
  std::iota(order.begin(), order.end(), vtkIdType{ 0 });
  if (ids != nullptr)
  {
    const vtkIdType first =
      data->GetNumberOfVerts(); // whose cell data stand before those of the lines
    std::stable_sort(order.begin(), order.end(),
      [&](vtkIdType a, vtkIdType b)
      { return ids->GetComponent(first + a, 0) < ids->GetComponent(first + b, 0); });
  }
  for (const vtkIdType line : order)
  {
    vtkIdType count = 0;
    const vtkIdType* ends = nullptr;
    data->GetLines()->GetCellAtId(line, count, ends);
    const bool backwards =
      parents != nullptr && static_cast<vtkIdType>(parents->GetComponent(ends[0], 0)) == ends[1];
    skeleton.bones.push_back({ ends[backwards ? 1 : 0], ends[backwards ? 0 : 1] });
  }
  coronary::FromSkeleton(skeleton); // refuses loops and what is not finite
  return skeleton;
}
}

vtkTGFWriter::~vtkTGFWriter()
{
  delete[] this->FileName;
}

int vtkTGFWriter::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  return 1;
}

int vtkTGFWriter::Write()
{
  this->Written = false;
  return this->Superclass::Write() && this->Written ? 1 : 0;
}

void vtkTGFWriter::WriteData()
{
  try
  {
    auto* input = vtkPolyData::SafeDownCast(this->GetInput());
    if (this->FileName == nullptr || *this->FileName == '\0')
    {
      throw std::invalid_argument("FileName is not set");
    }
    if (input == nullptr || input->GetNumberOfLines() == 0)
    {
      throw std::invalid_argument("There are no lines to write to " + std::string(this->FileName));
    }
    coronary::TgfSkeleton skeleton;
    if (IsSkeleton(input))
    {
      skeleton = SkeletonOf(input);
    }
    else
    {
      switch (vtkCoronary::FormOf(input))
      {
        case vtkCoronary::CenterlineForm::Tree:
          skeleton = coronary::ToSkeleton(vtkCoronary::TreeOf(input, vtkCoronary::Radii::Ignored));
          break;
        case vtkCoronary::CenterlineForm::Vmtk:
          skeleton = coronary::ToSkeleton(coronary::FromVmtkTracts(
            vtkCoronary::TractsOf(input, vtkCoronary::Radii::Ignored), this->Tolerance));
          break;
        case vtkCoronary::CenterlineForm::Unknown:
          throw std::invalid_argument("The lines are neither a skeleton (two points each) nor a "
                                      "tree (cell arrays GroupIds and "
                                      "ParentGroupIds) nor VMTK's branches (CenterlineIds, "
                                      "TractIds and GroupIds): make a tree "
                                      "of them with vtkCoronaryTreeTopology");
      }
    }
    std::ostringstream text;
    coronary::WriteTgf(text, skeleton);
    coronary::WriteFileAtomically(this->FileName, text.str());
    this->Written = true;
  }
  catch (const std::exception& error)
  {
    vtkErrorMacro(<< error.what());
  }
}

void vtkTGFWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << '\n';
  os << indent << "Tolerance: " << this->Tolerance << '\n';
}
