#include "BeatingModel.h"

#include "Require.h"

#include <cmath>
#include <string>

namespace coronary
{
void MovingPoseOf(const InterpolatedPose& pose, double cycle, MovingSkeletonPose& moving)
{
  moving.joints.resize(pose.points.size());
  for (std::size_t j = 0; j < pose.points.size(); ++j)
  {
    moving.joints[j] = coronary::Moving(pose.points[j], pose.velocity[j] / cycle);
  }
  moving.rotation.resize(pose.rotation.size());
  for (std::size_t b = 0; b < pose.rotation.size(); ++b)
  {
    moving.rotation[b] = Turning(pose.rotation[b], pose.angularVelocity[b] / cycle);
  }
  moving.twist.clear();
  moving.calibre.resize(pose.calibre.size());
  for (std::size_t j = 0; j < pose.calibre.size(); ++j)
  {
    moving.calibre[j] = Dual(pose.calibre[j], pose.calibreRate[j] / cycle);
  }
}

BeatingModel::BeatingModel(const std::vector<Vector3>& points, const CompactSkinWeights& weights,
  const Skeleton& skeleton, const PoseSequence& poses, const BeatingModelSettings& settings)
  : Interpolation(poses, settings.interpolation)
  , Skin(points, weights, skeleton, settings.deformation)
  , Cycle(settings.cycle)
{
  Require(poses.points[0].size() == skeleton.joints.size(),
    "the skeleton has " + std::to_string(skeleton.joints.size()) + " joints, and its poses have " +
      std::to_string(poses.points[0].size()));
  Require(poses.rotation.empty() || poses.rotation[0].size() == skeleton.bones.size(),
    "the skeleton has another number of bones than its poses have rotations");
  Require(std::isfinite(this->Cycle) && this->Cycle > 0.0, "cycle must be greater than 0");
  this->Skin.SetVolumeConservation(settings.volumeConservation);
}

void BeatingModel::SetTime(double time)
{
  this->Interpolation.Evaluate(time, this->Interpolated);
  MovingPoseOf(this->Interpolated, this->Cycle, this->Moving);
}

void BeatingModel::Positions(double time, double* positions)
{
  this->SetTime(time);
  PoseNow(this->Moving, this->Now);
  this->Skin.Deform(this->Now, positions);
}

void BeatingModel::Motion(double time, double* positions, double* velocities)
{
  this->SetTime(time);
  this->Skin.Deform(this->Moving, positions, velocities);
}
}
