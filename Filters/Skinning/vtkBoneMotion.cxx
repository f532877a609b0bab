#include "vtkBoneMotion.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkNew.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

using coronary::BoneTransform;
using coronary::RestBone;
using vtkCoronary::Require;

namespace
{
constexpr const char* EndsAtRest = "BoneEndsAtRest";
constexpr const char* Parent = "BoneParent";
constexpr const char* Motion = "BoneMotion";

constexpr int EndValues = 6;
constexpr int MotionValues = 11;

vtkDataArray* Needed(vtkFieldData* data, const char* name, int components)
{
  vtkDataArray* array = data->GetArray(name);
  Require(array != nullptr && array->GetNumberOfComponents() == components,
    std::string("The mesh has no field array ") + name + " of " + std::to_string(components) +
      " components: the bones are known of what comes from Skin Deformation");
  return array;
}

vtkDoubleArray* NewArray(vtkFieldData* data, const char* name, int components, std::size_t tuples)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(tuples));
  data->AddArray(array);
  return array;
}
}

namespace vtkBoneMotion
{
void Set(
  vtkFieldData* data, const coronary::SkeletonRig& rig, const std::vector<BoneTransform>& motion)
{
  vtkDoubleArray* ends = NewArray(data, EndsAtRest, EndValues, motion.size());
  vtkDoubleArray* moves = NewArray(data, Motion, MotionValues, motion.size());
  std::vector<vtkIdType> parents;
  for (std::size_t b = 0; b < motion.size(); ++b)
  {
    const auto bone = static_cast<std::int64_t>(b);
    const coronary::Vector3& head = rig.Head(bone);
    const coronary::Vector3& tail =
      rig.Rest().joints[static_cast<std::size_t>(rig.Rest().bones[b].second)];
    const double both[EndValues] = { head[0], head[1], head[2], tail[0], tail[1], tail[2] };
    ends->SetTuple(bone, both);
    const BoneTransform& t = motion[b];
    const double values[MotionValues] = { t.rotation.w(), t.rotation.x(), t.rotation.y(),
      t.rotation.z(), t.posedHead[0], t.posedHead[1], t.posedHead[2], t.stretch, t.twist,
      t.calibreFirst, t.calibreSecond };
    moves->SetTuple(bone, values);
    parents.push_back(static_cast<vtkIdType>(rig.ParentBone(bone)));
  }
  vtkCoronary::AddArray<vtkIdTypeArray>(data, Parent, parents);
}

void Remove(vtkFieldData* data)
{
  for (const char* name : { EndsAtRest, Parent, Motion })
  {
    data->RemoveArray(name);
  }
}

std::vector<RestBone> BonesOf(vtkFieldData* data)
{
  vtkDataArray* ends = Needed(data, EndsAtRest, EndValues);
  vtkDataArray* parents = Needed(data, Parent, 1);
  Require(parents->GetNumberOfTuples() == ends->GetNumberOfTuples(),
    std::string("Field arrays ") + EndsAtRest + " and " + Parent + " have different lengths");
  auto* names =
    vtkStringArray::SafeDownCast(data->GetAbstractArray(vtkCoronaryArrayNames::BoneName));
  if (names != nullptr && names->GetNumberOfValues() != ends->GetNumberOfTuples())
  {
    names = nullptr;
  }
  std::vector<RestBone> bones;
  for (vtkIdType b = 0; b < ends->GetNumberOfTuples(); ++b)
  {
    double both[EndValues];
    ends->GetTuple(b, both);
    bones.push_back({ names ? std::string(names->GetValue(b)) : std::string(),
      coronary::Vector3(both[0], both[1], both[2]), coronary::Vector3(both[3], both[4], both[5]),
      static_cast<std::int64_t>(parents->GetTuple1(b)) });
  }
  return bones;
}

std::vector<BoneTransform> MotionOf(vtkFieldData* data)
{
  vtkDataArray* moves = Needed(data, Motion, MotionValues);
  std::vector<BoneTransform> motion(static_cast<std::size_t>(moves->GetNumberOfTuples()));
  for (std::size_t b = 0; b < motion.size(); ++b)
  {
    double v[MotionValues];
    moves->GetTuple(static_cast<vtkIdType>(b), v);
    motion[b].rotation = coronary::Quaternion(v[0], v[1], v[2], v[3]);
    motion[b].posedHead = { v[4], v[5], v[6] };
    motion[b].stretch = v[7];
    motion[b].twist = v[8];
    motion[b].calibreFirst = v[9];
    motion[b].calibreSecond = v[10];
  }
  return motion;
}
}
