#include "vtkSkeletonForms.h"

#include "PartialProgress.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <stdexcept>

using coronary::Quaternion;
using coronary::Skeleton;
using coronary::SkeletonPose;
using vtkCoronary::Require;

namespace
{
/// The array of that name, or null; its form is checked. Cell data begin with the vertices' cells.
vtkDataArray* FindArray(
  vtkDataSetAttributes* data, const std::string& name, int components, vtkIdType tuples)
{
  vtkAbstractArray* any = data->GetAbstractArray(name.c_str());
  if (any == nullptr)
  {
    return nullptr;
  }
  auto* array = vtkArrayDownCast<vtkDataArray>(any);
  Require(array != nullptr && array->GetNumberOfComponents() == components &&
      array->GetNumberOfTuples() >= tuples,
    "Array '" + name + "' of the posed skeleton has not " + std::to_string(components) +
      (components == 1 ? " number" : " numbers") + " for each joint or bone");
  return array;
}

std::vector<double> ValuesOf(vtkDataArray* array, vtkIdType first, vtkIdType count)
{
  std::vector<double> values;
  for (vtkIdType n = 0; array != nullptr && n < count; ++n)
  {
    values.push_back(array->GetComponent(first + n, 0));
  }
  return values;
}

/// Cell data of poly data begin with the vertices.
vtkIdType FirstLine(vtkPolyData* data)
{
  return data->GetNumberOfVerts();
}
}

namespace names = vtkCoronaryArrayNames;

namespace vtkSkeletonForms
{
Skeleton SkeletonOf(
  vtkPolyData* data, const std::string& whose, const coronary::ProgressCallback& progress)
{
  Skeleton skeleton;
  coronary::LoopReport report(progress, data->GetNumberOfPoints() + data->GetNumberOfLines());
  for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
  {
    report(n);
    skeleton.joints.emplace_back(data->GetPoint(n));
  }
  vtkDataArray* parents = data->GetPointData()->GetArray(vtkCoronaryArrayNames::ParentJoint);
  vtkCellArray* lines = data->GetLines();
  for (vtkIdType cell = 0; cell < lines->GetNumberOfCells(); ++cell)
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    report(data->GetNumberOfPoints() + cell);
    lines->GetCellAtId(cell, count, ids);
    Require(count == 2,
      "Line " + std::to_string(cell) + " of " + whose + " has " + std::to_string(count) +
        " points: a bone has two (vtkCenterlineSkeleton makes bones of centerlines)");
    Skeleton::Bone bone;
    bone.first = ids[0];
    bone.second = ids[1];
    bone.id = static_cast<int>(cell);
    if (parents != nullptr && static_cast<vtkIdType>(parents->GetComponent(ids[0], 0)) == ids[1])
    {
      std::swap(bone.first, bone.second);
    }
    skeleton.bones.push_back(bone);
  }
  try
  {
    Require(!skeleton.bones.empty(), "no bones: lines of two points");
    coronary::CheckSkeleton(skeleton);
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument("In " + whose + ": " + error.what());
  }
  return skeleton;
}

SkeletonPose PoseOf(
  vtkPolyData* data, const coronary::SkeletonRig& rig, const coronary::ProgressCallback& progress)
{
  const Skeleton& rest = rig.Rest();
  Require(data->GetNumberOfPoints() == rig.NumberOfJoints() &&
      data->GetNumberOfLines() == rig.NumberOfBones(),
    "The posed skeleton has " + std::to_string(data->GetNumberOfPoints()) + " joints and " +
      std::to_string(data->GetNumberOfLines()) + " bones, the rest skeleton " +
      std::to_string(rig.NumberOfJoints()) + " and " + std::to_string(rig.NumberOfBones()));
  SkeletonPose pose;
  coronary::LoopReport report(progress, data->GetNumberOfPoints() + data->GetNumberOfLines());
  for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
  {
    report(n);
    pose.joints.emplace_back(data->GetPoint(n));
  }
  vtkCellArray* lines = data->GetLines();
  for (vtkIdType cell = 0; cell < lines->GetNumberOfCells(); ++cell)
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    report(data->GetNumberOfPoints() + cell);
    lines->GetCellAtId(cell, count, ids);
    const Skeleton::Bone& bone = rest.bones[cell];
    Require(count == 2 && bone.first + bone.second == ids[0] + ids[1] &&
        (ids[0] == bone.first || ids[0] == bone.second),
      "Bone " + std::to_string(cell) + " of the posed skeleton has other joints than at rest");
  }
  const vtkIdType first = FirstLine(data);
  const vtkIdType bones = rig.NumberOfBones();
  if (vtkDataArray* rotations =
        FindArray(data->GetCellData(), names::BoneRotation, 4, first + bones))
  {
    for (vtkIdType n = first; n < first + bones; ++n)
    {
      pose.rotation.emplace_back(rotations->GetComponent(n, 0), rotations->GetComponent(n, 1),
        rotations->GetComponent(n, 2), rotations->GetComponent(n, 3));
    }
  }
  pose.twist =
    ValuesOf(FindArray(data->GetCellData(), names::BoneTwist, 1, first + bones), first, bones);
  pose.calibre =
    ValuesOf(FindArray(data->GetPointData(), names::CalibreFactor, 1, rig.NumberOfJoints()), 0,
      rig.NumberOfJoints());
  return pose;
}

bool TellsVelocity(vtkPolyData* data)
{
  const auto lacks = [](vtkFieldData* arrays, const char* part, const char* rate)
  { return arrays->HasArray(part) != 0 && arrays->HasArray(rate) == 0; };
  return data->GetPointData()->HasArray(names::Velocity) != 0 &&
    !lacks(data->GetPointData(), names::CalibreFactor, names::CalibreRate) &&
    !lacks(data->GetCellData(), names::BoneRotation, names::BoneAngularVelocity) &&
    !lacks(data->GetCellData(), names::BoneTwist, names::BoneTwistRate);
}

coronary::MovingSkeletonPose MovingPoseOf(vtkPolyData* data, const coronary::SkeletonRig& rig)
{
  const SkeletonPose pose = PoseOf(data, rig);
  const vtkIdType joints = rig.NumberOfJoints();
  const vtkIdType first = FirstLine(data);
  const vtkIdType bones = rig.NumberOfBones();
  vtkDataArray* velocity = FindArray(data->GetPointData(), names::Velocity, 3, joints);
  vtkDataArray* angular =
    FindArray(data->GetCellData(), names::BoneAngularVelocity, 3, first + bones);
  vtkDataArray* twist = FindArray(data->GetCellData(), names::BoneTwistRate, 1, first + bones);
  vtkDataArray* calibre = FindArray(data->GetPointData(), names::CalibreRate, 1, joints);
  Require(TellsVelocity(data), "The posed skeleton does not say how it moves");
  const auto vector = [](vtkDataArray* array, vtkIdType n)
  { return coronary::Vector3(array->GetTuple3(n)); };
  coronary::MovingSkeletonPose moving;
  for (vtkIdType n = 0; n < joints; ++n)
  {
    moving.joints.push_back(coronary::Moving(pose.joints[n], vector(velocity, n)));
    if (!pose.calibre.empty())
    {
      moving.calibre.emplace_back(pose.calibre[n], calibre->GetComponent(n, 0));
    }
  }
  for (vtkIdType n = 0; n < bones; ++n)
  {
    if (!pose.rotation.empty())
    {
      moving.rotation.push_back(coronary::Turning(pose.rotation[n], vector(angular, first + n)));
    }
    if (!pose.twist.empty())
    {
      moving.twist.emplace_back(pose.twist[n], twist->GetComponent(first + n, 0));
    }
  }
  return moving;
}

void SetPose(vtkPolyData* rest, const SkeletonPose& pose,
  const std::vector<coronary::BoneTransform>& bones, vtkPolyData* output,
  const coronary::ProgressCallback& progress)
{
  const auto joints = static_cast<vtkIdType>(pose.joints.size());
  coronary::LoopReport report(progress, joints + static_cast<vtkIdType>(bones.size()));
  output->ShallowCopy(rest);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(joints);
  for (vtkIdType n = 0; n < joints; ++n)
  {
    report(n);
    points->SetPoint(n, pose.joints[n].data());
  }
  output->SetPoints(points);
  const vtkIdType first = FirstLine(rest);
  const auto makeArray = [&](const std::string& name, int components)
  {
    vtkNew<vtkDoubleArray> array;
    array->SetName(name.c_str());
    array->SetNumberOfComponents(components);
    array->SetNumberOfTuples(rest->GetNumberOfCells());
    array->Fill(0.0);
    output->GetCellData()->AddArray(array);
    return array.Get();
  };
  // Those of the skeleton at rest are not the pose's.
  output->GetPointData()->RemoveArray(names::Velocity);
  output->GetPointData()->RemoveArray(names::CalibreRate);
  output->GetCellData()->RemoveArray(names::BoneAngularVelocity);
  output->GetCellData()->RemoveArray(names::BoneTwistRate);
  vtkDoubleArray* rotation = makeArray(names::BoneRotation, 4);
  vtkDoubleArray* twist = makeArray(names::BoneTwist, 1);
  vtkDoubleArray* strain = makeArray(names::AxialStrain, 1);
  for (std::size_t n = 0; n < bones.size(); ++n)
  {
    const vtkIdType cell = first + static_cast<vtkIdType>(n);
    report(joints + static_cast<vtkIdType>(n));
    const Quaternion& q = bones[n].rotation;
    rotation->SetTuple4(cell, q.w(), q.x(), q.y(), q.z());
    twist->SetValue(cell, bones[n].twist);
    strain->SetValue(cell, bones[n].stretch - 1.0);
  }
  std::vector<double> calibre = pose.calibre;
  calibre.resize(pose.joints.size(), 1.0);
  vtkCoronary::AddArray<vtkDoubleArray>(output->GetPointData(), names::CalibreFactor, calibre);
}
}
