/**
 * @file vtkBoneMotion.h
 * @brief The bones behind a posed mesh, as field data of it: what writers of skinned formats need.
 */
#ifndef vtkBoneMotion_h
#define vtkBoneMotion_h

#include "RestBone.h"
#include "SkeletonPose.h"
#include "vtkCoronarySkinningModule.h" // for the export macro

#include <vector>

class vtkFieldData;

namespace vtkBoneMotion
{
/// Field data: `BoneEndsAtRest` (double[6], first and second joint, mm), `BoneParent` (vtkIdType, the bone before it, -1: none)
/// and `BoneMotion` (double[11]: rotation w x y z, posed first joint, stretch, twist, calibre at both
/// joints), one tuple a bone.
VTKCORONARYSKINNING_EXPORT void Set(vtkFieldData* data, const coronary::SkeletonRig& rig,
  const std::vector<coronary::BoneTransform>& motion);

VTKCORONARYSKINNING_EXPORT void Remove(vtkFieldData* data);

///@{
/// What Set left there; names are those of `BoneName`, where it has as many.
/// @throws std::invalid_argument naming the array that is missing or has another form
VTKCORONARYSKINNING_EXPORT std::vector<coronary::RestBone> BonesOf(vtkFieldData* data);
VTKCORONARYSKINNING_EXPORT std::vector<coronary::BoneTransform> MotionOf(vtkFieldData* data);
///@}
}

#endif
