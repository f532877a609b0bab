#include "vtkTGFReader.h"

#include "TgfSkeleton.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkVesselTree.h"

#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <fstream>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace names = vtkCoronaryArrayNames;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkTGFReader);

namespace
{
/// Bones instead of the branches of the tree that was found in them.
void SetBones(
  vtkPolyData* output, const coronary::TgfSkeleton& skeleton, const coronary::VesselTree& tree)
{
  std::vector<vtkIdType> parent(skeleton.joints.size(), -1);
  std::vector<const coronary::VesselTree::Branch*> branchTo(skeleton.joints.size(), nullptr);
  for (const auto& branch : tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      parent[branch.points[i]] = branch.points[i - 1];
      branchTo[branch.points[i]] = &branch;
    }
  }
  coronary::Polylines lines;
  lines.points = skeleton.joints;
  std::vector<int> groups;
  std::vector<int> trees;
  std::vector<double> lengths;
  for (const auto& [from, to] : skeleton.bones)
  {
    const vtkIdType far = parent[to] == from ? to : from;
    lines.lines.push_back({ parent[far], far });
    groups.push_back(branchTo[far]->groupId);
    trees.push_back(branchTo[far]->treeId);
    lengths.push_back((skeleton.joints[to] - skeleton.joints[from]).norm());
  }
  std::vector<int> ids(skeleton.bones.size());
  std::iota(ids.begin(), ids.end(), 0);
  vtkCoronary::SetLines(output, lines);
  output->GetCellData()->Initialize();
  vtkCoronary::AddArray<vtkIdTypeArray>(output->GetPointData(), names::ParentJoint, parent);
  vtkCoronary::AddArray<vtkIntArray>(output->GetCellData(), names::BoneId, ids);
  vtkCoronary::AddArray<vtkIntArray>(output->GetCellData(), names::GroupIds, groups);
  vtkCoronary::AddArray<vtkIntArray>(output->GetCellData(), names::TreeIds, trees);
  vtkCoronary::AddArray<vtkDoubleArray>(output->GetCellData(), names::Length, lengths);
}
}

vtkTGFReader::vtkTGFReader()
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(2);
}

vtkTGFReader::~vtkTGFReader()
{
  delete[] this->FileName;
}

int vtkTGFReader::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkTGFReader::RequestData(
  vtkInformation* request, vtkInformationVector**, vtkInformationVector* outputs)
{
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  if (outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  if (this->FileName == nullptr || *this->FileName == '\0')
  {
    return vtkCoronary::ReportEmptied(this, "FileName is not set");
  }
  try
  {
    std::ifstream file(this->FileName);
    if (!file)
    {
      throw std::invalid_argument("can not be opened");
    }
    const coronary::TgfSkeleton skeleton = coronary::ReadTgf(file);
    if (file.bad())
    {
      throw std::invalid_argument("can not be read to its end");
    }
    const coronary::VesselTree tree = coronary::FromSkeleton(skeleton, this->Radius);
    vtkCoronary::SetTree(vtkPolyData::GetData(outputs, TreePort), tree);
    vtkPolyData* bones = vtkPolyData::GetData(outputs, SkeletonPort);
    vtkCoronary::SetTree(bones, tree);
    SetBones(bones, skeleton, tree);
    return 1;
  }
  catch (const std::exception& error)
  {
    return vtkCoronary::ReportEmptied(this, std::string(this->FileName) + ": " + error.what());
  }
}

void vtkTGFReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << '\n';
  os << indent << "Radius: " << this->Radius << '\n';
}
