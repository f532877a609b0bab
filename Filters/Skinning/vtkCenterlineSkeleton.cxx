#include "vtkCenterlineSkeleton.h"

#include "CenterlineSkeleton.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
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

#include <stdexcept>

namespace names = vtkCoronaryArrayNames;
using coronary::Skeleton;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCenterlineSkeleton);

namespace
{
template <typename Get>
auto OfBones(const Skeleton& skeleton, const Get& get)
{
  std::vector<decltype(get(skeleton.bones[0]))> values;
  values.reserve(skeleton.bones.size());
  for (const Skeleton::Bone& bone : skeleton.bones)
  {
    values.push_back(get(bone));
  }
  return values;
}
}

vtkCenterlineSkeleton::vtkCenterlineSkeleton()
{
}

int vtkCenterlineSkeleton::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  outputs->GetInformationObject(0)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  return 1;
}

int vtkCenterlineSkeleton::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  return 1;
}

int vtkCenterlineSkeleton::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* input = vtkPolyData::GetData(inputs[0], 0);
  vtkPolyData* output = vtkPolyData::GetData(outputs, 0);
  if (outputs->GetInformationObject(0)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    coronary::CenterlineSkeletonSettings settings;
    settings.minimumLength = this->MinimumLength;
    settings.maximumLength = this->MaximumLength;
    settings.radiusFactor = this->RadiusFactor;
    settings.sagittaRatio = this->SagittaRatio;
    settings.everyStep = this->EveryStep;
    settings.Validate();
    if (input->GetNumberOfLines() == 0)
    {
      return 1;
    }
    vtkCoronary::Require(vtkCoronary::FormOf(input) == vtkCoronary::CenterlineForm::Tree,
      "The lines are no tree (cell arrays GroupIds and ParentGroupIds): make one of them with "
      "vtkCoronaryTreeTopology");
    coronary::VesselTree tree = vtkCoronary::TreeOf(input);
    vtkDataArray* segments = input->GetPointData()->GetArray(names::SegmentIds);
    for (vtkIdType i = 0; segments != nullptr && i < segments->GetNumberOfTuples(); ++i)
    {
      tree.segmentId.push_back(static_cast<int>(segments->GetComponent(i, 0)));
    }
    const Skeleton skeleton = coronary::MakeCenterlineSkeleton(tree, settings);

    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    points->SetNumberOfPoints(static_cast<vtkIdType>(skeleton.joints.size()));
    for (std::size_t i = 0; i < skeleton.joints.size(); ++i)
    {
      points->SetPoint(static_cast<vtkIdType>(i), skeleton.joints[i].data());
    }
    vtkNew<vtkCellArray> lines;
    for (const Skeleton::Bone& bone : skeleton.bones)
    {
      const vtkIdType ends[2] = { bone.first, bone.second };
      lines->InsertNextCell(2, ends);
    }
    output->SetPoints(points);
    output->SetLines(lines);
    vtkPointData* data = output->GetPointData();
    vtkCoronary::AddArray<vtkIdTypeArray>(data, names::ParentJoint, skeleton.parent);
    vtkCoronary::AddArray<vtkDoubleArray>(data, names::Radius, skeleton.radius);
    vtkCoronary::AddArray<vtkDoubleArray>(data, names::Abscissas, skeleton.abscissa);
    using Bone = Skeleton::Bone;
    vtkCellData* cells = output->GetCellData();
    vtkCoronary::AddArray<vtkIntArray>(
      cells, names::BoneId, OfBones(skeleton, [](const Bone& b) { return b.id; }));
    vtkCoronary::AddArray<vtkIntArray>(
      cells, names::GroupIds, OfBones(skeleton, [](const Bone& b) { return b.groupId; }));
    vtkCoronary::AddArray<vtkIntArray>(
      cells, names::TreeIds, OfBones(skeleton, [](const Bone& b) { return b.treeId; }));
    vtkCoronary::AddArray<vtkIntArray>(
      cells, names::SegmentIds, OfBones(skeleton, [](const Bone& b) { return b.segmentId; }));
    vtkCoronary::AddArray<vtkDoubleArray>(
      cells, names::Length, OfBones(skeleton, [](const Bone& b) { return b.length; }));
    output->GetFieldData()->PassData(input->GetFieldData());
    vtkCoronary::AddArray<vtkStringArray>(output->GetFieldData(), names::BoneName,
      OfBones(skeleton, [](const Bone& b) { return vtkStdString(b.name); }));
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the skeleton");
  }
}

void vtkCenterlineSkeleton::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "MinimumLength: " << this->MinimumLength << "\n";
  os << indent << "MaximumLength: " << this->MaximumLength << "\n";
  os << indent << "RadiusFactor: " << this->RadiusFactor << "\n";
  os << indent << "SagittaRatio: " << this->SagittaRatio << "\n";
  os << indent << "EveryStep: " << this->EveryStep << "\n";
}
