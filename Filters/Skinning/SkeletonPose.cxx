#include "SkeletonPose.h"

#include "Numbers.h"
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
constexpr double MinimumStretch = 1e-9;

template <typename Scalar>
using Vector = Eigen::Matrix<Scalar, 3, 1>;

template <typename Scalar>
Vector<Scalar> Beside(const Vector<Scalar>& vector, const Vector<Scalar>& axis)
{
  return vector - vector.dot(axis) * axis;
}

bool IsFinite(double value)
{
  return std::isfinite(value);
}

bool IsFinite(const Dual& value)
{
  return isfinite(value);
}

template <typename Scalar>
bool IsFinite(const Vector<Scalar>& vector)
{
  return IsFinite(vector.x()) && IsFinite(vector.y()) && IsFinite(vector.z());
}

/// As ShortestRotation.
template <typename Scalar>
Eigen::Quaternion<Scalar> Carry(const Vector<Scalar>& from, const Vector<Scalar>& to)
{
  const Vector<Scalar> a = from.normalized();
  const Vector<Scalar> b = to.normalized();
  const Vector<Scalar> sum = a + b;
  const Scalar length = sum.norm();
  if (length > 1e-12)
  {
    // Half way between the two lies half the rotation.
    const Vector<Scalar> half = sum / length;
    const Vector<Scalar> axis = a.cross(half);
    return Eigen::Quaternion<Scalar>(a.dot(half), axis.x(), axis.y(), axis.z()).normalized();
  }
  const Vector<Scalar> axis = a.unitOrthogonal();
  return { Scalar(0.0), axis.x(), axis.y(), axis.z() };
}

/// The rotation vector of the way from one rotation to another, the shorter one.
Vector3 RotationVector(const Quaternion& from, const Quaternion& to)
{
  const Eigen::AngleAxisd way(to.normalized() * from.normalized().conjugate());
  return way.angle() * way.axis();
}

template <typename Part>
void RequireSameParts(const Part& now, const Part& other)
{
  Require(now.size() == other.size(), "Poses of one motion have different parts");
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

Quaternion ShortestRotation(const Vector3& from, const Vector3& to)
{
  return Carry<double>(from, to);
}

Eigen::Matrix<Dual, 3, 1> Moving(const Vector3& place, const Vector3& velocity)
{
  return { Dual(place.x(), velocity.x()), Dual(place.y(), velocity.y()),
    Dual(place.z(), velocity.z()) };
}

Eigen::Quaternion<Dual> Turning(const Quaternion& rotation, const Vector3& angularVelocity)
{
  const Vector3 half = 0.5 * angularVelocity;
  const Quaternion rate = Quaternion(0.0, half.x(), half.y(), half.z()) * rotation;
  return { Dual(rotation.w(), rate.w()), Dual(rotation.x(), rate.x()), Dual(rotation.y(), rate.y()),
    Dual(rotation.z(), rate.z()) };
}

void PoseNow(const MovingSkeletonPose& moving, SkeletonPose& pose)
{
  pose.joints.resize(moving.joints.size());
  for (std::size_t j = 0; j < moving.joints.size(); ++j)
  {
    const Vector<Dual>& joint = moving.joints[j];
    pose.joints[j] = Vector3(joint.x().value, joint.y().value, joint.z().value);
  }
  pose.rotation.resize(moving.rotation.size());
  for (std::size_t b = 0; b < moving.rotation.size(); ++b)
  {
    const Eigen::Quaternion<Dual>& q = moving.rotation[b];
    pose.rotation[b] = Quaternion(q.w().value, q.x().value, q.y().value, q.z().value);
  }
  const auto valueOf = [](const Dual& number) { return number.value; };
  pose.twist.resize(moving.twist.size());
  std::transform(moving.twist.begin(), moving.twist.end(), pose.twist.begin(), valueOf);
  pose.calibre.resize(moving.calibre.size());
  std::transform(moving.calibre.begin(), moving.calibre.end(), pose.calibre.begin(), valueOf);
}

MovingSkeletonPose Differentiate(
  const SkeletonPose& now, const std::vector<NeighbourPose>& neighbours)
{
  std::vector<Vector3> velocity(now.joints.size(), Vector3::Zero());
  std::vector<Vector3> angular(now.rotation.size(), Vector3::Zero());
  MovingSkeletonPose moving;
  moving.twist.assign(now.twist.begin(), now.twist.end());
  moving.calibre.assign(now.calibre.begin(), now.calibre.end());
  for (const NeighbourPose& neighbour : neighbours)
  {
    const SkeletonPose& other = *neighbour.pose;
    RequireSameParts(now.joints, other.joints);
    RequireSameParts(now.rotation, other.rotation);
    RequireSameParts(now.twist, other.twist);
    RequireSameParts(now.calibre, other.calibre);
    for (std::size_t j = 0; j < now.joints.size(); ++j)
    {
      velocity[j] += neighbour.weight * (other.joints[j] - now.joints[j]);
    }
    for (std::size_t b = 0; b < now.rotation.size(); ++b)
    {
      angular[b] += neighbour.weight * RotationVector(now.rotation[b], other.rotation[b]);
    }
    for (std::size_t b = 0; b < now.twist.size(); ++b)
    {
      moving.twist[b].rate += neighbour.weight * (other.twist[b] - now.twist[b]);
    }
    for (std::size_t j = 0; j < now.calibre.size(); ++j)
    {
      moving.calibre[j].rate += neighbour.weight * (other.calibre[j] - now.calibre[j]);
    }
  }
  for (std::size_t j = 0; j < now.joints.size(); ++j)
  {
    moving.joints.push_back(Moving(now.joints[j], velocity[j]));
  }
  for (std::size_t b = 0; b < now.rotation.size(); ++b)
  {
    moving.rotation.push_back(Turning(now.rotation[b], angular[b]));
  }
  return moving;
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
        const Vector3 beside = Beside<double>(arm, axis);
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

template <typename Scalar>
void SkeletonRig::TransformOf(
  const BasicSkeletonPose<Scalar>& pose, std::vector<BasicBoneTransform<Scalar>>& transforms) const
{
  using std::atan2;
  using Rotation = Eigen::Quaternion<Scalar>;
  using Turn = Eigen::AngleAxis<Scalar>;
  const auto direction = [this](std::int64_t bone) -> Vector<Scalar>
  { return this->Axes[bone].template cast<Scalar>(); };
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
    if (!IsFinite(pose.joints[j]))
    {
      Refuse("Joint", j, "has a coordinate that is not finite");
    }
    if (calibrated && !(pose.calibre[j] > 0.0 && IsFinite(pose.calibre[j])))
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
    BasicBoneTransform<Scalar>& transform = transforms[b];
    transform.posedHead = pose.joints[bone.first];
    const Vector<Scalar> along = pose.joints[bone.second] - transform.posedHead;
    transform.stretch = along.norm() / this->Lengths[b];
    if (!(transform.stretch > MinimumStretch && IsFinite(transform.stretch)))
    {
      Refuse("Bone", number, "has no length: its joints are at the same place");
    }
    transform.twist = twisted ? pose.twist[b] : Scalar(0.0);
    if (!IsFinite(transform.twist))
    {
      Refuse("Bone", number, "has a twist that is not finite");
    }
    transform.calibreFirst = calibrated ? pose.calibre[bone.first] : Scalar(1.0);
    transform.calibreSecond = calibrated ? pose.calibre[bone.second] : Scalar(1.0);
    const std::int64_t parent = this->Parents[b];
    Rotation before = Rotation::Identity();
    if (rotated)
    {
      before = pose.rotation[b];
      const Scalar norm = before.norm();
      if (!(norm > 1e-6 && IsFinite(norm)))
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
        before = before * Rotation(Turn(transforms[parent].twist, direction(parent)));
      }
    }
    transform.rotation = (Carry<Scalar>(before * direction(b), along) * before).normalized();
    if (parent < 0)
    {
      const Root& root = this->Roots[nextRoot++];
      if (!rotated && !root.joints.empty())
      {
        const Vector<Scalar> axis = along.normalized();
        Scalar sine = 0.0;
        Scalar cosine = 0.0;
        for (std::size_t n = 0; n < root.joints.size(); ++n)
        {
          const Vector<Scalar> is =
            Beside<Scalar>(pose.joints[root.joints[n]] - transform.posedHead, axis);
          const Vector<Scalar> was =
            transform.rotation * Vector<Scalar>(root.beside[n].template cast<Scalar>());
          sine += axis.dot(was.cross(is));
          cosine += was.dot(is);
        }
        transform.rotation =
          (Rotation(Turn(atan2(sine, cosine), axis)) * transform.rotation).normalized();
      }
    }
  }
}

void SkeletonRig::Transform(const SkeletonPose& pose, std::vector<BoneTransform>& transforms) const
{
  this->TransformOf(pose, transforms);
}

void SkeletonRig::Transform(
  const MovingSkeletonPose& pose, std::vector<MovingBoneTransform>& transforms) const
{
  this->TransformOf(pose, transforms);
}

template <typename Scalar>
void SkeletonRig::Conserve(double share, std::vector<BasicBoneTransform<Scalar>>& transforms) const
{
  using std::pow;
  Require(share >= 0.0 && share <= 1.0, "The share of the volume that is kept must be 0 to 1");
  RequireNumber(transforms.size(), this->Axes.size(), "bones", "bones");
  if (share == 0.0)
  {
    return;
  }
  for (std::size_t j = 0; j < this->Heads.size(); ++j)
  {
    Scalar sum = 0.0;
    double weight = 0.0;
    for (const auto* list : { &this->Heads[j], &this->Tails[j] })
    {
      for (const std::int64_t b : *list)
      {
        sum += this->Lengths[b] * pow(transforms[b].stretch, -0.5 * share);
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

void SkeletonRig::ConserveVolume(double share, std::vector<BoneTransform>& transforms) const
{
  this->Conserve(share, transforms);
}

void SkeletonRig::ConserveVolume(double share, std::vector<MovingBoneTransform>& transforms) const
{
  this->Conserve(share, transforms);
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
