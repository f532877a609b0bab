#include "SkeletonPose.h"

#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace UnitTestSkeletonPose
{
using coronary::ApplyPoseEdit;
using coronary::BoneTransform;
using coronary::PoseEdit;
using coronary::Quaternion;
using coronary::Skeleton;
using coronary::SkeletonPose;
using coronary::SkeletonRig;
using coronary::Vector3;

namespace
{
constexpr double Pi = 3.14159265358979323846;

void AddBone(Skeleton& skeleton, std::int64_t first, std::int64_t second)
{
  Skeleton::Bone bone;
  bone.first = first;
  bone.second = second;
  bone.id = static_cast<int>(skeleton.bones.size());
  skeleton.bones.push_back(bone);
}

/// Bones of 6 mm along z.
Skeleton Chain(int bones)
{
  Skeleton skeleton;
  for (int j = 0; j <= bones; ++j)
  {
    skeleton.joints.emplace_back(0.0, 0.0, 6.0 * j);
    if (j > 0)
    {
      AddBone(skeleton, j - 1, j);
    }
  }
  return skeleton;
}

/// A chain of four with a branch of two at its middle.
Skeleton Fork()
{
  Skeleton skeleton = Chain(4);
  skeleton.joints.emplace_back(4.0, 1.0, 15.0);
  skeleton.joints.emplace_back(8.0, 0.0, 19.0);
  AddBone(skeleton, 2, 5);
  AddBone(skeleton, 5, 6);
  return skeleton;
}

/// Two trees whose bones wander; the second begins with two bones at its root.
Skeleton RandomForest(unsigned seed)
{
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Skeleton skeleton;
  for (const int root : { 0, 12 })
  {
    skeleton.joints.emplace_back(100.0 + normal(random), root, -40.0);
    for (int n = 1; n < 12; ++n)
    {
      const int back = root == 12 && n == 2 ? 2 : (n % 4 == 0 ? 3 : 1);
      const auto from = static_cast<std::int64_t>(root + std::max(0, n - back));
      skeleton.joints.push_back(skeleton.joints[from] +
        5.0 * Vector3(0.4 + 0.3 * normal(random), normal(random), normal(random)));
      AddBone(skeleton, from, root + n);
    }
  }
  return skeleton;
}

double Angle(const Quaternion& a, const Quaternion& b)
{
  return 2.0 * std::atan2((a * b.conjugate()).vec().norm(), std::abs((a * b.conjugate()).w()));
}

Quaternion Turn(double angle, const Vector3& axis)
{
  return Quaternion(Eigen::AngleAxisd(angle, axis.normalized()));
}

std::vector<BoneTransform> Transforms(const SkeletonRig& rig, const SkeletonPose& pose)
{
  std::vector<BoneTransform> transforms;
  rig.Transform(pose, transforms);
  return transforms;
}
}

TEST(SkeletonPose, LeastRotationCarriesAndTurnsNoMore)
{
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int n = 0; n < 200; ++n)
  {
    const Vector3 from(normal(random), normal(random), normal(random));
    Vector3 to(normal(random), normal(random), normal(random));
    if (n % 4 == 0)
    {
      to = -from + 1e-4 * to; // nearly opposite
    }
    const Quaternion rotation = coronary::ShortestRotation(from, to);
    EXPECT_LT((rotation * from.normalized() - to.normalized()).norm(), n % 4 == 0 ? 1e-9 : 1e-14);
    // About an axis across both: no twist.
    EXPECT_LT(std::abs(rotation.vec().dot(from.normalized())), 1e-10);
  }
  const Quaternion half = coronary::ShortestRotation({ 0, 0, 2 }, { 0, 0, -3 });
  EXPECT_LT((half * Vector3(0, 0, 1) - Vector3(0, 0, -1)).norm(), 1e-14);
  EXPECT_LT(
    Angle(coronary::ShortestRotation({ 1, 2, 3 }, { 2, 4, 6 }), Quaternion::Identity()), 1e-15);
}

TEST(SkeletonPose, RigidMotionGivesItsRotationToEveryBone)
{
  for (unsigned seed = 0; seed < 20; ++seed)
  {
    const SkeletonRig rig(RandomForest(seed));
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const Vector3 axis(normal(random), normal(random), normal(random));
    const Quaternion rotation = Turn(seed == 0 ? Pi : 0.5 * seed, axis);
    const Vector3 shift(300.0, -20.0, 5.0);
    SkeletonPose pose;
    for (const Vector3& joint : rig.Rest().joints)
    {
      pose.joints.push_back(rotation * joint + shift);
    }
    for (const BoneTransform& bone : Transforms(rig, pose))
    {
      EXPECT_LT(Angle(bone.rotation, rotation), 1e-11) << seed;
      EXPECT_NEAR(bone.stretch, 1.0, 1e-12);
    }
  }
}

TEST(SkeletonPose, StraightChainThatBendsInAPlaneDoesNotTwist)
{
  const SkeletonRig rig(Chain(10));
  SkeletonPose pose;
  const double curvature = 0.05;
  for (const Vector3& joint : rig.Rest().joints)
  {
    const double angle = curvature * joint.z();
    pose.joints.emplace_back((1.0 - std::cos(angle)) / curvature, 0.0, std::sin(angle) / curvature);
  }
  const std::vector<BoneTransform> bones = Transforms(rig, pose);
  for (std::size_t b = 0; b < bones.size(); ++b)
  {
    // Chords of a circle: turned by the angle at their middle.
    EXPECT_LT(Angle(bones[b].rotation, Turn(curvature * 6.0 * (b + 0.5), Vector3::UnitY())), 1e-11);
    EXPECT_NEAR(bones[b].stretch, std::sin(0.15) / 0.15, 1e-12);
  }
}

TEST(SkeletonPose, RotationsDependContinuouslyOnThePose)
{
  const SkeletonRig rig(RandomForest(5));
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<Vector3> swing;
  for (std::int64_t j = 0; j < rig.NumberOfJoints(); ++j)
  {
    swing.emplace_back(normal(random), normal(random), normal(random));
  }
  const auto at = [&](double time)
  {
    SkeletonPose pose;
    for (std::int64_t j = 0; j < rig.NumberOfJoints(); ++j)
    {
      pose.joints.push_back(rig.Rest().joints[j] + std::sin(2.0 * Pi * time) * swing[j]);
    }
    return Transforms(rig, pose);
  };
  const auto maximumStep = [&](int steps)
  {
    double maximum = 0.0;
    std::vector<BoneTransform> before = at(0.0);
    for (int n = 1; n <= steps; ++n)
    {
      const std::vector<BoneTransform> now = at(static_cast<double>(n) / steps);
      for (std::size_t b = 0; b < now.size(); ++b)
      {
        maximum = std::max(maximum, Angle(now[b].rotation, before[b].rotation));
      }
      before = now;
    }
    return maximum;
  };
  // A jump would not get smaller with the steps.
  const double fine = maximumStep(2000);
  EXPECT_GT(fine, 0.001);
  EXPECT_LT(maximumStep(20000), 0.11 * fine);
  // One cycle later it is what it was.
  const std::vector<BoneTransform> start = at(0.0);
  const std::vector<BoneTransform> end = at(1.0);
  for (std::size_t b = 0; b < start.size(); ++b)
  {
    EXPECT_LT(Angle(end[b].rotation, start[b].rotation), 1e-9);
  }
}

TEST(SkeletonPose, TwistGoesOnAlongTheChain)
{
  const SkeletonRig rig(Chain(5));
  SkeletonPose pose = rig.RestPose();
  pose.rotation.clear();
  pose.twist = { 0.1, 0.2, 0.3, 0.0, 0.4 };
  const std::vector<BoneTransform> bones = Transforms(rig, pose);
  const double angles[] = { 0.0, 0.1, 0.3, 0.6, 0.6 };
  for (std::size_t b = 0; b < bones.size(); ++b)
  {
    EXPECT_LT(Angle(bones[b].rotation, Turn(angles[b], Vector3::UnitZ())), 1e-14);
    EXPECT_EQ(bones[b].twist, pose.twist[b]);
  }
}

TEST(SkeletonPose, GivenRotationsAreTurnedOntoTheBonesAndNoFurther)
{
  const SkeletonRig rig(Chain(2));
  SkeletonPose pose = rig.RestPose();
  pose.rotation[0] = Turn(0.7, Vector3::UnitZ());
  pose.rotation[1] = Quaternion(-2.0, 0.0, 0.0, 0.0);
  pose.joints[2] = { 6.0, 0.0, 6.0 };
  const std::vector<BoneTransform> bones = Transforms(rig, pose);
  EXPECT_LT(Angle(bones[0].rotation, pose.rotation[0]), 1e-14);
  EXPECT_LT(Angle(bones[1].rotation, Turn(0.5 * Pi, Vector3::UnitY())), 1e-14);
}

TEST(SkeletonPose, VolumeIsConservedByTheSections)
{
  const SkeletonRig rig(Chain(3));
  SkeletonPose pose = rig.RestPose();
  for (Vector3& joint : pose.joints)
  {
    joint *= 1.21;
  }
  std::vector<BoneTransform> bones = Transforms(rig, pose);
  rig.ConserveVolume(1.0, bones);
  for (const BoneTransform& bone : bones)
  {
    EXPECT_NEAR(bone.calibreFirst, 1.0 / 1.1, 1e-12);
    EXPECT_NEAR(bone.calibreSecond, 1.0 / 1.1, 1e-12);
  }
  pose.joints[3].z() += 6.0;
  bones = Transforms(rig, pose);
  rig.ConserveVolume(0.5, bones);
  const double last = bones[2].stretch;
  EXPECT_NEAR(bones[2].calibreSecond, std::pow(last, -0.25), 1e-12);
  EXPECT_NEAR(bones[2].calibreFirst, 0.5 * (std::pow(last, -0.25) + std::pow(1.21, -0.25)), 1e-12);
  EXPECT_EQ(bones[1].calibreSecond, bones[2].calibreFirst);
  ExpectRefusal([&] { rig.ConserveVolume(1.5, bones); }, "0 to 1");
}

TEST(SkeletonPose, RefusesWhatIsNoPose)
{
  const SkeletonRig rig(Fork());
  std::vector<BoneTransform> bones;
  const auto refuse = [&](const std::string& part, const auto& damage)
  {
    SkeletonPose pose = rig.RestPose();
    damage(pose);
    ExpectRefusal([&] { rig.Transform(pose, bones); }, part);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuse("6 joints, the rest skeleton has 7", [](SkeletonPose& p) { p.joints.pop_back(); });
  refuse("1 rotations, the rest skeleton has 6", [](SkeletonPose& p) { p.rotation.resize(1); });
  refuse("twists", [](SkeletonPose& p) { p.twist.resize(1); });
  refuse("calibre factors", [](SkeletonPose& p) { p.calibre.resize(1); });
  refuse("Joint 3", [&](SkeletonPose& p) { p.joints[3].x() = nan; });
  refuse("Bone 2", [](SkeletonPose& p) { p.joints[3] = p.joints[2]; });
  refuse("Bone 4", [&](SkeletonPose& p) { p.twist[4] = nan; });
  refuse("Bone 5", [](SkeletonPose& p) { p.rotation[5].coeffs().setZero(); });
  refuse("Joint 6", [](SkeletonPose& p) { p.calibre[6] = 0.0; });
  ExpectRefusal([] { SkeletonRig{ Skeleton() }; }, "no bones");
  Skeleton broken = Fork();
  broken.bones[1].second = 1;
  ExpectRefusal([&] { SkeletonRig{ broken }; }, "bone 1");
}

TEST(PoseEdit, TurnsWhatIsBeyondTheJoint)
{
  const SkeletonRig rig(Fork());
  const SkeletonPose rest = rig.RestPose();
  SkeletonPose pose = rest;
  PoseEdit edit;
  edit.joint = 2;
  edit.rotation = Turn(0.5 * Pi, Vector3::UnitY());
  ApplyPoseEdit(rig, edit, pose);
  for (const int still : { 0, 1, 2 })
  {
    EXPECT_EQ(pose.joints[still], rest.joints[still]);
  }
  EXPECT_LT((pose.joints[4] - Vector3(12.0, 0.0, 12.0)).norm(), 1e-12);
  EXPECT_LT((pose.joints[5] - Vector3(3.0, 1.0, 8.0)).norm(), 1e-12);
  const std::vector<BoneTransform> bones = Transforms(rig, pose);
  for (std::size_t b = 0; b < bones.size(); ++b)
  {
    // Nothing before the joint is turned or twisted.
    EXPECT_LT(Angle(bones[b].rotation, b < 2 ? Quaternion::Identity() : edit.rotation), 1e-12);
    EXPECT_NEAR(bones[b].stretch, 1.0, 1e-12);
  }
}

TEST(PoseEdit, MovesAJointAloneOrWithWhatIsBeyond)
{
  const SkeletonRig rig(Fork());
  SkeletonPose pose = rig.RestPose();
  PoseEdit edit;
  edit.joint = 3;
  edit.translation = { 6.0, 0.0, 0.0 };
  ApplyPoseEdit(rig, edit, pose);
  EXPECT_EQ(pose.joints[4], Vector3(6.0, 0.0, 24.0));
  EXPECT_EQ(pose.joints[5], rig.Rest().joints[5]);
  std::vector<BoneTransform> bones = Transforms(rig, pose);
  EXPECT_NEAR(bones[2].stretch, std::sqrt(2.0), 1e-12);
  EXPECT_LT(Angle(bones[2].rotation, Turn(0.25 * Pi, Vector3::UnitY())), 1e-12);
  EXPECT_LT(Angle(bones[3].rotation, Quaternion::Identity()), 1e-12);
  pose = rig.RestPose();
  edit.alone = true;
  ApplyPoseEdit(rig, edit, pose);
  EXPECT_EQ(pose.joints[4], Vector3(0.0, 0.0, 24.0));
  EXPECT_EQ(pose.joints[3], Vector3(6.0, 0.0, 18.0));
}

TEST(PoseEdit, TwistsAlongTheBoneAndAllBeyond)
{
  const SkeletonRig rig(Fork());
  SkeletonPose pose = rig.RestPose();
  PoseEdit edit;
  edit.joint = 2;
  edit.twist = 0.5 * Pi;
  ApplyPoseEdit(rig, edit, pose);
  EXPECT_LT((pose.joints[5] - Vector3(-1.0, 4.0, 15.0)).norm(), 1e-12);
  const std::vector<BoneTransform> bones = Transforms(rig, pose);
  EXPECT_EQ(bones[1].twist, edit.twist);
  EXPECT_LT(Angle(bones[1].rotation, Quaternion::Identity()), 1e-12);
  EXPECT_LT(Angle(bones[2].rotation, Turn(0.5 * Pi, Vector3::UnitZ())), 1e-12);
}

TEST(PoseEdit, CalibreFallsOffOnBothSides)
{
  const SkeletonRig rig(Fork());
  SkeletonPose pose = rig.RestPose();
  PoseEdit edit;
  edit.joint = 2;
  edit.calibre = 0.25;
  ApplyPoseEdit(rig, edit, pose);
  EXPECT_EQ(pose.calibre, (std::vector<double>{ 1, 1, 0.25, 1, 1, 1, 1 }));
  edit.reach = 12.0;
  ApplyPoseEdit(rig, edit, pose);
  EXPECT_NEAR(pose.calibre[2], 0.0625, 1e-15);
  EXPECT_NEAR(pose.calibre[1], 0.5, 1e-12);
  EXPECT_NEAR(pose.calibre[3], 0.5, 1e-12);
  EXPECT_EQ(pose.calibre[0], 1.0);
  const double along = (Vector3(4.0, 1.0, 15.0) - Vector3(0.0, 0.0, 12.0)).norm();
  EXPECT_NEAR(pose.calibre[5], std::pow(0.25, 0.5 + 0.5 * std::cos(Pi * along / 12.0)), 1e-12);
}

TEST(PoseEdit, RefusesAndStaysAsItWas)
{
  const SkeletonRig rig(Fork());
  SkeletonPose pose = rig.RestPose();
  const std::vector<Vector3> before = pose.joints;
  const auto refuse = [&](const std::string& part, const auto& damage)
  {
    PoseEdit edit;
    edit.joint = 3;
    damage(edit);
    ExpectRefusal([&] { ApplyPoseEdit(rig, edit, pose); }, part);
    EXPECT_EQ(pose.joints, before);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuse("joints 0 to 6", [](PoseEdit& e) { e.joint = 7; });
  refuse("joints 0 to 6", [](PoseEdit& e) { e.joint = -1; });
  refuse("rotation", [](PoseEdit& e) { e.rotation.coeffs().setZero(); });
  refuse("translation", [&](PoseEdit& e) { e.translation.y() = nan; });
  refuse("twist", [&](PoseEdit& e) { e.twist = nan; });
  refuse("no bone ends", [](PoseEdit& e) { e.joint = 0, e.twist = 1.0; });
  refuse("calibre", [](PoseEdit& e) { e.calibre = 0.0; });
  refuse("reach", [](PoseEdit& e) { e.reach = -1.0; });
  refuse("Bone 2", [](PoseEdit& e) { e.translation = { 0.0, 0.0, -6.0 }; });
}
}
