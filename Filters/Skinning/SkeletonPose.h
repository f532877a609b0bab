/**
 * @file SkeletonPose.h
 * @brief Moved joints of a skeleton, what that does to its bones, and posing by hand.
 *
 * Stretch and twist along a bone follow Jacobson & Sorkine, "Stretchable and twistable bones for
 * skeletal shape deformation", SIGGRAPH Asia 2011. docs/deformation.md has the equations.
 */
#ifndef DynamicCoronary_SkeletonPose_h
#define DynamicCoronary_SkeletonPose_h

#include "CenterlineSkeleton.h"
#include "Dual.h"
#include "Geometry.h"

#include <vector>

namespace coronary
{
using Quaternion = Eigen::Quaterniond;

/// Where the joints of a skeleton are. Whatever is optional may be empty.
template <typename Scalar>
struct BasicSkeletonPose
{
  std::vector<Eigen::Matrix<Scalar, 3, 1>> joints; ///< mm, as many as the rest skeleton has
  /// Optional, per bone: its rotation from rest at its first joint. What is missing to carry the bone's
  /// rest direction to the posed one is added by the least rotation. Without: least twist.
  std::vector<Eigen::Quaternion<Scalar>> rotation;
  /// Optional, per bone: radians by which its second end is turned about the bone against its first
  /// one, evenly along the bone. Without rotations, what hangs on the bone is turned with it.
  std::vector<Scalar> twist;
  std::vector<Scalar> calibre; ///< optional, per joint: factor of the cross-section's radius, > 0
};

using SkeletonPose = BasicSkeletonPose<double>;

/// A pose and how it changes: every number has its derivative by time, per second.
using MovingSkeletonPose = BasicSkeletonPose<Dual>;

/// A place that moves. @param velocity  mm per unit of time
Eigen::Matrix<Dual, 3, 1> Moving(const Vector3& place, const Vector3& velocity);

/// A rotation that goes on turning. @param angularVelocity  radians per unit of time, about axes of the world
Eigen::Quaternion<Dual> Turning(const Quaternion& rotation, const Vector3& angularVelocity);

/// What a moving pose is at the moment. Allocates nothing once `pose` has been used before.
void PoseNow(const MovingSkeletonPose& moving, SkeletonPose& pose);

/// A pose of the same motion at another time, and what it counts for.
struct NeighbourPose
{
  const SkeletonPose* pose;
  double weight; ///< 1/s
};

/**
 * The derivative of a motion out of poses at other times: sum of weight (pose - now) over the neighbours; of
 * rotations that of the rotation vectors from now to them.
 * @throws std::invalid_argument: a neighbour has other parts than `now`
 */
MovingSkeletonPose Differentiate(
  const SkeletonPose& now, const std::vector<NeighbourPose>& neighbours);

/// What happens to a bone. A point p whose coordinate along the bone is x = d.(p - head), and t = x/L
/// limited to 0 .. 1, goes to
///     posedHead + R [ (x + (stretch - 1) L t) d + c(t) Turn(d, twist t) (p - head - x d) ]
/// with d, L the rest direction and length, R the rotation, c from calibreFirst to calibreSecond.
template <typename Scalar>
struct BasicBoneTransform
{
  /// Carries the rest direction to the posed one.
  Eigen::Quaternion<Scalar> rotation = Eigen::Quaternion<Scalar>::Identity();
  /// Posed first joint, mm.
  Eigen::Matrix<Scalar, 3, 1> posedHead = Eigen::Matrix<Scalar, 3, 1>::Zero();
  Scalar stretch = 1.0;       ///< posed length / rest length, > 0
  Scalar twist = 0.0;         ///< radians
  Scalar calibreFirst = 1.0;  ///< > 0
  Scalar calibreSecond = 1.0; ///< > 0
};

using BoneTransform = BasicBoneTransform<double>;
using MovingBoneTransform = BasicBoneTransform<Dual>; ///< with derivatives, per second

/// The rotation by the least angle that carries `from` to `to` (any lengths but 0). Opposite
/// directions: half a turn about an axis that depends on `from` only.
Quaternion ShortestRotation(const Vector3& from, const Vector3& to);

/**
 * What follows from a rest skeleton alone, for poses frame by frame.
 *
 * Twist is least from bone to bone: a bone has the rotation of the bone before it, and the least
 * rotation that is still missing. A root bone's twist is that of the joints nearest to it that are
 * beside its line (least squares): so a rigid motion of the joints gives its rotation to every bone, and
 * the rotations depend on nothing but the pose.
 */
class SkeletonRig
{
public:
  /// @throws std::invalid_argument as CheckSkeleton, or for a skeleton without bones.
  explicit SkeletonRig(const Skeleton& rest);

  const Skeleton& Rest() const { return this->Skeleton_; }
  std::int64_t NumberOfJoints() const { return static_cast<std::int64_t>(this->Heads.size()); }
  std::int64_t NumberOfBones() const { return static_cast<std::int64_t>(this->Axes.size()); }
  const Vector3& Head(std::int64_t bone) const
  {
    return this->Skeleton_.joints[this->Skeleton_.bones[bone].first];
  }
  const Vector3& Direction(std::int64_t bone) const { return this->Axes[bone]; } ///< unit
  double Length(std::int64_t bone) const { return this->Lengths[bone]; } ///< of the straight bone
  std::int64_t ParentBone(std::int64_t bone) const { return this->Parents[bone]; } ///< -1: none

  /// Joints and bones on the tips' side of a joint, the joint itself included.
  void Beyond(
    std::int64_t joint, std::vector<std::int64_t>& joints, std::vector<std::int64_t>& bones) const;

  /// The rest pose: all optional parts are there.
  SkeletonPose RestPose() const;

  ///@{
  /**
   * Allocates nothing once `transforms` has been used before. Values of moving bones agree with those of
   * the pose to rounding.
   * @throws std::invalid_argument: a wrong number of joints, rotations, twists or calibre factors; a
   * value that is not finite; a rotation that is zero; a factor that is not positive; a bone without
   * length.
   */
  void Transform(const SkeletonPose& pose, std::vector<BoneTransform>& transforms) const;
  void Transform(
    const MovingSkeletonPose& pose, std::vector<MovingBoneTransform>& transforms) const;
  ///@}

  ///@{
  /**
   * Cross-sections that answer to the stretch: the calibre factors at a joint are multiplied by the
   * mean of stretch^(-share/2) over its bones, weighted by their lengths. Share 1 keeps the volume.
   * @param share  0 (nothing) to 1
   */
  void ConserveVolume(double share, std::vector<BoneTransform>& transforms) const;
  void ConserveVolume(double share, std::vector<MovingBoneTransform>& transforms) const;
  ///@}

private:
  template <typename Scalar>
  void TransformOf(const BasicSkeletonPose<Scalar>& pose,
    std::vector<BasicBoneTransform<Scalar>>& transforms) const;
  template <typename Scalar>
  void Conserve(double share, std::vector<BasicBoneTransform<Scalar>>& transforms) const;

  struct Root
  {
    std::int64_t bone;
    std::vector<std::int64_t> joints; ///< that fix its twist; none when all are on its line
    std::vector<Vector3> beside;      ///< their rest positions, less their part along the bone
  };

  Skeleton Skeleton_;
  std::vector<Vector3> Axes;
  std::vector<double> Lengths;
  std::vector<std::int64_t> Parents;
  std::vector<std::int64_t> Order;              ///< bones, parents first
  std::vector<Root> Roots;                      ///< in the order in which they come in Order
  std::vector<std::vector<std::int64_t>> Heads; ///< per joint: bones that begin there
  std::vector<std::vector<std::int64_t>> Tails; ///< per joint: bones that end there
};

/// One step of posing by hand. Its parts are done in the order: twist, rotation, translation, calibre.
struct PoseEdit
{
  std::int64_t joint = 0;
  /// Radians. Turns all beyond the joint about the bone that ends in it; the turn is spread evenly
  /// along that bone.
  double twist = 0.0;
  /// Of all beyond the joint about its position (forward kinematics), or, with `alone`, of nothing.
  Quaternion rotation = Quaternion::Identity();
  Vector3 translation = Vector3::Zero(); ///< mm
  bool alone = false;                    ///< translate only the joint, and not what is beyond it
  double calibre = 1.0; ///< factor of the radius, > 0: below 1 a stenosis, above 1 a dilatation
  /// mm along the skeleton at rest, 0 or more: the change of calibre falls to nothing within it on
  /// both sides of the joint (raised cosine of its logarithm). 0: at the joint alone.
  double reach = 0.0;
};

/**
 * The pose after one edit.
 * @throws std::invalid_argument: no such joint, a value that is not finite or out of range, a bone that would lose
 *   its length. The pose stays as it was.
 */
void ApplyPoseEdit(const SkeletonRig& rig, const PoseEdit& edit, SkeletonPose& pose);
}

#endif
