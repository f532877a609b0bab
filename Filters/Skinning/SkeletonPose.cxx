#include "SkeletonPose.h"

#include "Require.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
void RequireNumber(std::size_t is, std::size_t wanted, const char* what, const char* of)
{
  if (is != wanted)
  {
    throw std::invalid_argument("The pose has " + std::to_string(is) + " " + what +
      ", the rest skeleton has " + std::to_string(wanted) + " " + of);
  }
}

[[noreturn]] void Refuse(const char* what, std::size_t number, const char* why)
{
  throw std::invalid_argument(
    std::string(what) + " " + std::to_string(number) + " of the pose " + why);
}

/// Two joints nearer than this share of the rest length are one.
constexpr double LeastStretch = 1e-9;

Vector3 Beside(const Vector3& vector, const Vector3& axis)
{
  return vector - vector.dot(axis) * axis;
}

/// Mm along the skeleton at rest from a joint to all others, infinite where there is no way.
std::vector<double> DistancesAlong(const SkeletonRig& rig, std::int64_t joint)
{
  const Skeleton& rest = rig.Rest();
  std::vector<std::vector<std::size_t>> bonesOf(rest.joints.size());
  for (std::size_t b = 0; b < rest.bones.size(); ++b)
  {
    bonesOf[rest.bones[b].first].push_back(b);
    bonesOf[rest.bones[b].second].push_back(b);
  }
  std::vector<double> distance(rest.joints.size(), std::numeric_limits<double>::infinity());
  distance[joint] = 0.0;
  std::vector<std::int64_t> open{ joint };
  // There is one way between two joints of a tree.
  while (!open.empty())
  {
    const std::int64_t at = open.back();
    open.pop_back();
    for (const std::size_t b : bonesOf[at])
    {
      const std::int64_t other =
        rest.bones[b].first == at ? rest.bones[b].second : rest.bones[b].first;
      if (std::isinf(distance[other]))
      {
        distance[other] = distance[at] + rig.Length(static_cast<std::int64_t>(b));
        open.push_back(other);
      }
    }
  }
  return distance;
}
}

Quaternion LeastRotation(const Vector3& from, const Vector3& to)
{
  const Vector3 a = from.normalized();
  const Vector3 b = to.normalized();
  const Vector3 sum = a + b;
  const double length = sum.norm();
  if (length > 1e-12)
  {
    // Half way between the two lies half the rotation.
    const Vector3 half = sum / length;
    const Vector3 axis = a.cross(half);
    return Quaternion(a.dot(half), axis.x(), axis.y(), axis.z()).normalized();
  }
  const Vector3 axis = a.unitOrthogonal();
  return { 0.0, axis.x(), axis.y(), axis.z() };
}

SkeletonRig::SkeletonRig(const Skeleton& rest)
  : Skeleton_(rest)
{
  CheckSkeleton(rest);
  Require(!rest.bones.empty(), "The skeleton has no bones");
  const std::size_t bones = rest.bones.size();
  const std::size_t joints = rest.joints.size();
  this->Heads.resize(joints);
  this->Tails.resize(joints);
  this->Axes.resize(bones);
  this->Lengths.resize(bones);
  this->Parents.assign(bones, -1);
  for (std::size_t b = 0; b < bones; ++b)
  {
    const Skeleton::Bone& bone = rest.bones[b];
    const Vector3 along = rest.joints[bone.second] - rest.joints[bone.first];
    this->Lengths[b] = along.norm();
    this->Axes[b] = along / this->Lengths[b];
    this->Heads[bone.first].push_back(static_cast<std::int64_t>(b));
    this->Tails[bone.second].push_back(static_cast<std::int64_t>(b));
  }
  // Bones that begin where others do at a root take their twist from the first of them.
  std::vector<std::int64_t> firsts;
  for (std::size_t b = 0; b < bones; ++b)
  {
    const std::int64_t joint = rest.bones[b].first;
    const std::int64_t bone = static_cast<std::int64_t>(b);
    if (!this->Tails[joint].empty())
    {
      this->Parents[b] = this->Tails[joint].front();
    }
    else if (this->Heads[joint].front() != bone)
    {
      this->Parents[b] = this->Heads[joint].front();
    }
    else
    {
      firsts.push_back(bone);
    }
  }
  std::vector<std::vector<std::int64_t>> daughters(bones);
  for (std::size_t b = 0; b < bones; ++b)
  {
    if (this->Parents[b] >= 0)
    {
      daughters[this->Parents[b]].push_back(static_cast<std::int64_t>(b));
    }
  }
  for (const std::int64_t first : firsts)
  {
    Root root{ first, {}, {} };
    const Vector3& head = this->Head(first);
    const Vector3& axis = this->Axes[first];
    // Breadth first: the nearest ones, until they are far enough from the line to fix the twist.
    const double enough = 0.25 * this->Lengths[first] * this->Lengths[first];
    double found = 0.0;
    double reach = this->Lengths[first];
    std::queue<std::int64_t> open;
    open.push(first);
    while (!open.empty())
    {
      const std::int64_t bone = open.front();
      open.pop();
      this->Order.push_back(bone);
      for (const std::int64_t daughter : daughters[bone])
      {
        open.push(daughter);
      }
      if (bone != first && found < enough)
      {
        const std::int64_t joint = rest.bones[bone].second;
        const Vector3 arm = rest.joints[joint] - head;
        const Vector3 beside = Beside(arm, axis);
        reach = std::max(reach, arm.norm());
        root.joints.push_back(joint);
        root.beside.push_back(beside);
        found += beside.squaredNorm();
      }
    }
    if (found <= 1e-12 * reach * reach)
    {
      root.joints.clear();
      root.beside.clear();
    }
    this->Roots.push_back(root);
  }
  Require(this->Order.size() == bones, "The bones of the skeleton go round in a ring");
}

void SkeletonRig::Beyond(
  std::int64_t joint, std::vector<std::int64_t>& joints, std::vector<std::int64_t>& bones) const
{
  joints.assign(1, joint);
  bones.clear();
  for (std::size_t n = 0; n < joints.size(); ++n)
  {
    for (const std::int64_t bone : this->Heads[joints[n]])
    {
      bones.push_back(bone);
      joints.push_back(this->Skeleton_.bones[bone].second);
    }
  }
}

SkeletonPose SkeletonRig::RestPose() const
{
  SkeletonPose pose;
  pose.joints = this->Skeleton_.joints;
  pose.rotation.assign(this->Axes.size(), Quaternion::Identity());
  pose.twist.assign(this->Axes.size(), 0.0);
  pose.calibre.assign(pose.joints.size(), 1.0);
  return pose;
}

void SkeletonRig::Transform(const SkeletonPose& pose, std::vector<BoneTransform>& transforms) const
{
  const std::size_t joints = this->Heads.size();
  const std::size_t bones = this->Axes.size();
  RequireNumber(pose.joints.size(), joints, "joints", "joints");
  const bool rotated = !pose.rotation.empty();
  const bool twisted = !pose.twist.empty();
  const bool calibrated = !pose.calibre.empty();
  if (rotated)
  {
    RequireNumber(pose.rotation.size(), bones, "rotations", "bones");
  }
  if (twisted)
  {
    RequireNumber(pose.twist.size(), bones, "twists", "bones");
  }
  if (calibrated)
  {
    RequireNumber(pose.calibre.size(), joints, "calibre factors", "joints");
  }
  for (std::size_t j = 0; j < joints; ++j)
  {
    if (!pose.joints[j].allFinite())
    {
      Refuse("Joint", j, "has a coordinate that is not finite");
    }
    if (calibrated && !(pose.calibre[j] > 0.0 && std::isfinite(pose.calibre[j])))
    {
      Refuse("Joint", j, "has a calibre factor that is not positive");
    }
  }
  transforms.resize(bones);
  std::size_t nextRoot = 0;
  for (const std::int64_t b : this->Order)
  {
    const auto number = static_cast<std::size_t>(b);
    const Skeleton::Bone& bone = this->Skeleton_.bones[b];
    BoneTransform& transform = transforms[b];
    transform.posedHead = pose.joints[bone.first];
    const Vector3 along = pose.joints[bone.second] - transform.posedHead;
    transform.stretch = along.norm() / this->Lengths[b];
    if (!(transform.stretch > LeastStretch && std::isfinite(transform.stretch)))
    {
      Refuse("Bone", number, "has no length: its joints are at the same place");
    }
    transform.twist = twisted ? pose.twist[b] : 0.0;
    if (!std::isfinite(transform.twist))
    {
      Refuse("Bone", number, "has a twist that is not finite");
    }
    transform.calibreFirst = calibrated ? pose.calibre[bone.first] : 1.0;
    transform.calibreSecond = calibrated ? pose.calibre[bone.second] : 1.0;
    const std::int64_t parent = this->Parents[b];
    Quaternion before = Quaternion::Identity();
    if (rotated)
    {
      before = pose.rotation[b];
      const double norm = before.norm();
      if (!(norm > 1e-6 && std::isfinite(norm)))
      {
        Refuse("Bone", number, "has a rotation that is zero or not finite");
      }
      before.coeffs() /= norm;
    }
    else if (parent >= 0)
    {
      before = transforms[parent].rotation;
      // Bones that begin at the same root do not hang on each other.
      const bool hangs = this->Skeleton_.bones[parent].second == bone.first;
      if (hangs && transforms[parent].twist != 0.0)
      {
        before =
          before * Quaternion(Eigen::AngleAxisd(transforms[parent].twist, this->Axes[parent]));
      }
    }
    transform.rotation = (LeastRotation(before * this->Axes[b], along) * before).normalized();
    if (parent < 0)
    {
      const Root& root = this->Roots[nextRoot++];
      if (!rotated && !root.joints.empty())
      {
        const Vector3 axis = along.normalized();
        double sine = 0.0;
        double cosine = 0.0;
        for (std::size_t n = 0; n < root.joints.size(); ++n)
        {
          const Vector3 is = Beside(pose.joints[root.joints[n]] - transform.posedHead, axis);
          const Vector3 was = transform.rotation * root.beside[n];
          sine += axis.dot(was.cross(is));
          cosine += was.dot(is);
        }
        transform.rotation =
          (Quaternion(Eigen::AngleAxisd(std::atan2(sine, cosine), axis)) * transform.rotation)
            .normalized();
      }
    }
  }
}

void SkeletonRig::ConserveVolume(double share, std::vector<BoneTransform>& transforms) const
{
  Require(share >= 0.0 && share <= 1.0, "The share of the volume that is kept must be 0 to 1");
  RequireNumber(transforms.size(), this->Axes.size(), "bones", "bones");
  if (share == 0.0)
  {
    return;
  }
  for (std::size_t j = 0; j < this->Heads.size(); ++j)
  {
    double sum = 0.0;
    double weight = 0.0;
    for (const auto* list : { &this->Heads[j], &this->Tails[j] })
    {
      for (const std::int64_t b : *list)
      {
        sum += this->Lengths[b] * std::pow(transforms[b].stretch, -0.5 * share);
        weight += this->Lengths[b];
      }
    }
    for (const std::int64_t b : this->Heads[j])
    {
      transforms[b].calibreFirst *= sum / weight;
    }
    for (const std::int64_t b : this->Tails[j])
    {
      transforms[b].calibreSecond *= sum / weight;
    }
  }
}

void ApplyPoseEdit(const SkeletonRig& rig, const PoseEdit& edit, SkeletonPose& pose)
{
  const std::string name = "Edit of joint " + std::to_string(edit.joint) + ": ";
  Require(edit.joint >= 0 && edit.joint < rig.NumberOfJoints(),
    name + "the skeleton has the joints 0 to " + std::to_string(rig.NumberOfJoints() - 1));
  const double norm = edit.rotation.norm();
  Require(norm > 1e-6 && std::isfinite(norm), name + "the rotation is zero or not finite");
  Require(std::isfinite(edit.twist), name + "the twist is not finite");
  Require(edit.translation.allFinite(), name + "the translation is not finite");
  Require(edit.calibre > 0.0 && std::isfinite(edit.calibre), name + "the calibre must be positive");
  Require(edit.reach >= 0.0 && std::isfinite(edit.reach), name + "the reach must be 0 or more");

  // A pose without rotations gets those of least twist: from now on bones are turned one by one.
  std::vector<BoneTransform> transforms;
  rig.Transform(pose, transforms);
  SkeletonPose next = pose;
  next.rotation.resize(transforms.size());
  next.twist.resize(transforms.size());
  for (std::size_t b = 0; b < transforms.size(); ++b)
  {
    next.rotation[b] = transforms[b].rotation;
    next.twist[b] = transforms[b].twist;
  }
  next.calibre.resize(next.joints.size(), 1.0);

  std::vector<std::int64_t> joints;
  std::vector<std::int64_t> bones;
  rig.Beyond(edit.joint, joints, bones);
  const auto turn = [&](const Quaternion& rotation)
  {
    const Vector3 centre = next.joints[edit.joint];
    for (const std::int64_t joint : joints)
    {
      next.joints[joint] = centre + rotation * (next.joints[joint] - centre);
    }
    for (const std::int64_t bone : bones)
    {
      next.rotation[bone] = (rotation * next.rotation[bone]).normalized();
    }
  };
  if (edit.twist != 0.0)
  {
    std::int64_t onto = -1;
    for (std::int64_t b = 0; b < rig.NumberOfBones(); ++b)
    {
      onto = onto < 0 && rig.Rest().bones[b].second == edit.joint ? b : onto;
    }
    Require(onto >= 0, name + "no bone ends in it that could be twisted");
    next.twist[onto] += edit.twist;
    const Vector3 axis = next.rotation[onto] * rig.Direction(onto);
    turn(Quaternion(Eigen::AngleAxisd(edit.twist, axis)));
  }
  if (!edit.alone && !edit.rotation.isApprox(Quaternion::Identity(), 0.0))
  {
    turn(edit.rotation.normalized());
  }
  for (const std::int64_t joint : joints)
  {
    next.joints[joint] += edit.translation;
    if (edit.alone)
    {
      break;
    }
  }
  if (edit.calibre != 1.0)
  {
    constexpr double Pi = 3.14159265358979323846;
    const std::vector<double> distance = DistancesAlong(rig, edit.joint);
    for (std::size_t j = 0; j < distance.size(); ++j)
    {
      const double share = distance[j] == 0.0 ? 1.0
        : distance[j] < edit.reach            ? 0.5 + 0.5 * std::cos(Pi * distance[j] / edit.reach)
                                              : 0.0;
      next.calibre[j] *= std::pow(edit.calibre, share);
    }
  }
  rig.Transform(next, transforms);
  // What the edit bends is turned with it.
  for (std::size_t b = 0; b < transforms.size(); ++b)
  {
    next.rotation[b] = transforms[b].rotation;
  }
  pose = std::move(next);
}
}
