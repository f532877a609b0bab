#include "vtkSkeletonPose.h"

#include "PartialProgress.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkSkeletonForms.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMath.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <cmath>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;
using coronary::PoseEdit;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkSkeletonPose);

namespace
{
/// @param degrees  along the axis, as long as the angle
coronary::Quaternion RotationOf(const Vector3& degrees)
{
  const double angle = vtkMath::RadiansFromDegrees(degrees.norm());
  return angle != 0.0 ? coronary::Quaternion(Eigen::AngleAxisd(angle, degrees.normalized()))
                      : coronary::Quaternion::Identity();
}

/// What RotationOf makes that rotation of; at most half a turn.
Vector3 DegreesOf(const coronary::Quaternion& rotation)
{
  const Eigen::AngleAxisd turn(rotation);
  return vtkMath::DegreesFromRadians(turn.angle()) * turn.axis();
}

PoseEdit EditOf(const std::array<double, 10>& values)
{
  PoseEdit edit;
  // Not finite: refused as no joint.
  edit.joint = std::isfinite(values[0]) && std::abs(values[0]) < 1e15
    ? static_cast<std::int64_t>(std::llround(values[0]))
    : -1;
  edit.twist = vtkMath::RadiansFromDegrees(values[1]);
  edit.rotation = RotationOf({ values[2], values[3], values[4] });
  edit.translation = { values[5], values[6], values[7] };
  edit.calibre = values[8];
  edit.reach = values[9];
  return edit;
}

bool Connected(vtkInformationVector* input)
{
  return input->GetNumberOfInformationObjects() > 0;
}
}

vtkSkeletonPose::~vtkSkeletonPose() = default;

vtkDoubleArray* vtkSkeletonPose::GetJointPlaces()
{
  return this->JointPlaces;
}

vtkDoubleArray* vtkSkeletonPose::GetMoveAsEdit()
{
  return this->MoveAsEdit;
}

vtkSkeletonPose::vtkSkeletonPose()
{
  this->SetNumberOfInputPorts(2);
}

void vtkSkeletonPose::AddEdit(double joint, double twist, double rotationX, double rotationY,
  double rotationZ, double translationX, double translationY, double translationZ, double calibre,
  double reach)
{
  this->Edits.push_back({ joint, twist, rotationX, rotationY, rotationZ, translationX, translationY,
    translationZ, calibre, reach });
  this->Modified();
}

void vtkSkeletonPose::RemoveAllEdits()
{
  if (!this->Edits.empty())
  {
    this->Edits.clear();
    this->Modified();
  }
}

int vtkSkeletonPose::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  if (port == 1)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

int vtkSkeletonPose::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  outInfo->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  if (Connected(inputs[1]))
  {
    outInfo->CopyEntry(inputs[1]->GetInformationObject(0), SDDP::TIME_STEPS());
    outInfo->CopyEntry(inputs[1]->GetInformationObject(0), SDDP::TIME_RANGE());
  }
  return 1;
}

int vtkSkeletonPose::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  return 1;
}

void vtkSkeletonPose::Move(const coronary::SkeletonRig& rig, coronary::SkeletonPose& pose)
{
  vtkCoronary::Require(this->Joint >= 0 && this->Joint < rig.NumberOfJoints(),
    "Joint must be 0 to " + std::to_string(rig.NumberOfJoints() - 1) + ", it is " +
      std::to_string(this->Joint));
  PoseEdit edit;
  edit.joint = this->Joint;
  edit.alone = this->MoveMode == MoveAlone;
  Vector3 wanted(this->JointPosition);
  vtkCoronary::Require(wanted.allFinite(), "JointPosition must be finite");
  const Vector3 turn(this->JointRotation);
  vtkCoronary::Require(turn.allFinite(), "JointRotation must be finite");
  std::int64_t bone = -1;
  for (std::int64_t b = 0; b < rig.NumberOfBones(); ++b)
  {
    bone = bone < 0 && rig.Rest().bones[b].second == edit.joint ? b : bone;
  }
  const Vector3 here = pose.joints[edit.joint];
  if (this->MoveMode >= TurnBone && bone >= 0)
  {
    // About its first joint, with all that is on the bone's far side.
    const Vector3 head = pose.joints[rig.Rest().bones[bone].first];
    vtkCoronary::Require((wanted - head).norm() > 0.0,
      "JointPosition is that of the joint before: the bone would lose its length");
    edit.rotation = coronary::ShortestRotation(here - head, wanted - head);
    if (this->MoveMode == TurnBoneOnly)
    {
      wanted = head + (here - head).norm() * (wanted - head).normalized();
    }
  }
  edit.translation = wanted - here;
  if (!edit.alone)
  {
    edit.rotation = RotationOf(turn) * edit.rotation;
  }
  coronary::ApplyPoseEdit(rig, edit, pose);
  if (!edit.alone)
  {
    const Vector3 degrees = DegreesOf(edit.rotation);
    const Vector3& shift = edit.translation;
    for (const double value : { static_cast<double>(edit.joint), 0.0, degrees.x(), degrees.y(),
           degrees.z(), shift.x(), shift.y(), shift.z(), 1.0, 0.0 })
    {
      this->MoveAsEdit->InsertNextValue(value);
    }
  }
}

int vtkSkeletonPose::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* input = vtkPolyData::GetData(inputs[0], 0);
  vtkPolyData* output = vtkPolyData::GetData(outputs, 0);
  vtkPolyData* start = Connected(inputs[1]) ? vtkPolyData::GetData(inputs[1], 0) : nullptr;
  if (outputs->GetInformationObject(0)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  this->JointPlaces->SetNumberOfValues(0);
  this->MoveAsEdit->SetNumberOfValues(0);
  try
  {
    if (input->GetNumberOfPoints() == 0)
    {
      return 1;
    }
    const coronary::ProgressCallback progress = vtkCoronary::ProgressOf(this);
    const coronary::WorkParts parts(
      progress, { 4.0, start ? 2.0 : 0.0, static_cast<double>(this->Edits.size()), 4.0 });
    const coronary::SkeletonRig rig(vtkSkeletonForms::SkeletonOf(input, "the skeleton", parts(0)));
    coronary::SkeletonPose pose =
      start ? vtkSkeletonForms::PoseOf(start, rig, parts(1)) : rig.RestPose();
    const coronary::ProgressCallback editProgress = parts(2);
    coronary::LoopReport report(editProgress, static_cast<std::int64_t>(this->Edits.size()));
    for (std::size_t n = 0; n < this->Edits.size(); ++n)
    {
      report(static_cast<std::int64_t>(n));
      try
      {
        coronary::ApplyPoseEdit(rig, EditOf(this->Edits[n]), pose);
      }
      catch (const std::invalid_argument& error)
      {
        throw std::invalid_argument("Edit " + std::to_string(n) + " of Edits: " + error.what());
      }
    }
    const std::vector<Vector3> places = pose.joints;
    if (this->MoveJoint)
    {
      this->Move(rig, pose);
    }
    std::vector<coronary::BoneTransform> bones;
    rig.Transform(pose, bones);
    vtkSkeletonForms::SetPose(input, pose, bones, output, parts(3));
    if (start)
    {
      output->GetFieldData()->PassData(start->GetFieldData());
      // The executive passes that of the first port.
      if (start->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
      {
        output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(),
          start->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()));
      }
    }
    for (const Vector3& place : places)
    {
      for (int c = 0; c < 3; ++c)
      {
        this->JointPlaces->InsertNextValue(place[c]);
      }
    }
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (...)
  {
    this->MoveAsEdit->SetNumberOfValues(0);
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the pose");
  }
}

void vtkSkeletonPose::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Edits: " << this->Edits.size() << '\n';
  for (const std::array<double, 10>& edit : this->Edits)
  {
    os << indent.GetNextIndent();
    for (const double value : edit)
    {
      os << value << ' ';
    }
    os << '\n';
  }
  os << indent << "MoveJoint: " << this->MoveJoint << '\n';
  os << indent << "Joint: " << this->Joint << '\n';
  os << indent << "JointPosition: " << this->JointPosition[0] << ' ' << this->JointPosition[1]
     << ' ' << this->JointPosition[2] << '\n';
  os << indent << "MoveMode: " << this->MoveMode << '\n';
  os << indent << "JointRotation: " << this->JointRotation[0] << ' ' << this->JointRotation[1]
     << ' ' << this->JointRotation[2] << '\n';
}
