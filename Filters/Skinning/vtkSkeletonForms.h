/**
 * @file vtkSkeletonForms.h
 * @brief Skeletons and their poses as poly data: points are joints, lines of two points are bones.
 */
#ifndef vtkSkeletonForms_h
#define vtkSkeletonForms_h

#include "ParallelFor.h"
#include "SkeletonPose.h"

#include <string>
#include <vector>

class vtkPolyData;

namespace vtkSkeletonForms
{
/**
 * Bones are the lines in their order. `ParentJoint`, where it is there, says which end is on the root's side;
 * else it is the first one.
 * @param whose  for messages: "the rest skeleton"
 * @throws std::invalid_argument: a cell that is no line of two points, as coronary::CheckSkeleton
 */
coronary::Skeleton SkeletonOf(
  vtkPolyData* data, const std::string& whose, const coronary::ProgressCallback& progress = {});

/**
 * The points, and of the arrays of a pose what is there.
 * @throws std::invalid_argument: other bones than the rest skeleton's, an array of wrong form
 */
coronary::SkeletonPose PoseOf(vtkPolyData* data, const coronary::SkeletonRig& rig,
  const coronary::ProgressCallback& progress = {});

/// Whether a posed skeleton says how it moves: it has `Velocity`, and for each array of a pose its derivative
/// (`BoneAngularVelocity`, `BoneTwistRate`, `CalibreRate`).
bool TellsVelocity(vtkPolyData* data);

/// A pose that says how it moves. @throws std::invalid_argument  as PoseOf
coronary::MovingSkeletonPose MovingPoseOf(vtkPolyData* data, const coronary::SkeletonRig& rig);

/// Makes `output` the skeleton `rest`, posed: its cells and arrays, other points, arrays of the pose.
void SetPose(vtkPolyData* rest, const coronary::SkeletonPose& pose,
  const std::vector<coronary::BoneTransform>& bones, vtkPolyData* output,
  const coronary::ProgressCallback& progress = {});
}

#endif
