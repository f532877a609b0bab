// Joints and bones along centerlines: where they stand, how long, names and ids, bad input.

#include "CenterlineSkeleton.h"
#include "CoronaryPhantom.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <stdexcept>

namespace UnitTestCenterlineSkeleton
{
using namespace coronary;

namespace
{
/// A trunk of 40 mm along x with a side branch of 20 mm at 16 mm; not split.
VesselTree Branching(double radius = 2.0)
{
  VesselTree tree;
  for (int i = 0; i <= 80; ++i)
  {
    tree.points.emplace_back(0.5 * i, 0.0, 0.0);
  }
  for (int i = 1; i <= 40; ++i)
  {
    tree.points.emplace_back(16.0, 0.5 * i, 0.0);
  }
  tree.radius.assign(tree.points.size(), radius);
  tree.branches.resize(2);
  for (int i = 0; i <= 80; ++i)
  {
    tree.branches[0].points.push_back(i);
  }
  tree.branches[0].groupId = 4;
  tree.branches[0].segmentId = ProximalLAD;
  tree.branches[1].points.push_back(32);
  for (int i = 0; i < 40; ++i)
  {
    tree.branches[1].points.push_back(81 + i);
  }
  tree.branches[1].groupId = 9;
  tree.branches[1].parentGroupId = 4;
  return tree;
}

/// An arc of a circle.
VesselTree Arc(double bendRadius, double radius)
{
  VesselTree tree;
  const double length = 40.0;
  tree.branches.resize(1);
  for (int i = 0; i <= 400; ++i)
  {
    const double angle = length * i / 400 / bendRadius;
    tree.points.emplace_back(bendRadius * std::sin(angle), bendRadius * std::cos(angle), 1.0);
    tree.branches[0].points.push_back(i);
  }
  tree.radius.assign(tree.points.size(), radius);
  return tree;
}

std::string Complaint(const std::function<void(Skeleton&)>& damage)
{
  Skeleton skeleton = MakeCenterlineSkeleton(Branching());
  damage(skeleton);
  try
  {
    CheckSkeleton(skeleton);
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}
}

TEST(CenterlineSkeleton, JointsAtRootBifurcationAndEnds)
{
  const Skeleton skeleton = MakeCenterlineSkeleton(Branching());
  const auto has = [&](const Vector3& p)
  {
    int found = 0;
    for (const Vector3& joint : skeleton.joints)
    {
      found += (joint - p).norm() < 1e-9 ? 1 : 0;
    }
    return found == 1;
  };
  EXPECT_TRUE(has({ 0, 0, 0 }));
  EXPECT_TRUE(has({ 16, 0, 0 }));
  EXPECT_TRUE(has({ 40, 0, 0 }));
  EXPECT_TRUE(has({ 16, 20, 0 }));
  // Radius 2, three radii a bone: 16 mm in three, 24 mm in four, 20 mm in four bones.
  ASSERT_EQ(skeleton.bones.size(), 11u);
  EXPECT_EQ(skeleton.joints.size(), 12u);
  for (std::size_t b = 0; b < skeleton.bones.size(); ++b)
  {
    const Skeleton::Bone& bone = skeleton.bones[b];
    EXPECT_EQ(bone.id, static_cast<int>(b));
    EXPECT_EQ(skeleton.parent[bone.second], bone.first);
    EXPECT_NEAR(
      bone.length, (skeleton.joints[bone.first] - skeleton.joints[bone.second]).norm(), 1e-9);
    EXPECT_NEAR(skeleton.abscissa[bone.second] - skeleton.abscissa[bone.first], bone.length, 1e-9);
    EXPECT_GE(bone.length, 3.0);
    EXPECT_LE(bone.length, 8.0);
  }
  EXPECT_EQ(skeleton.bones[0].name, "pLAD-1");
  EXPECT_EQ(skeleton.bones[0].groupId, 4);
  EXPECT_EQ(skeleton.bones.back().groupId, skeleton.bones.back().name[6] - '0');
  std::set<std::string> names;
  for (const Skeleton::Bone& bone : skeleton.bones)
  {
    names.insert(bone.name);
  }
  EXPECT_EQ(names.size(), skeleton.bones.size());
  EXPECT_TRUE(names.count("pLAD-7") == 1 && names.count("branch9-4") == 1);
}

TEST(CenterlineSkeleton, BendsHaveShorterBones)
{
  const Skeleton straight = MakeCenterlineSkeleton(Arc(1e5, 2.0));
  const Skeleton bent = MakeCenterlineSkeleton(Arc(7.0, 2.0));
  EXPECT_GT(bent.bones.size(), straight.bones.size());
  for (const Skeleton::Bone& bone : bent.bones)
  {
    const double chord = (bent.joints[bone.first] - bent.joints[bone.second]).norm();
    const double sagitta = 7.0 - std::sqrt(49.0 - 0.25 * chord * chord);
    EXPECT_LE(sagitta, 0.25 * 2.0 * 1.02);
    EXPECT_NEAR(2.0 * 7.0 * std::asin(chord / 14.0), bone.length, 1e-3);
  }
  // The limits hold before the wishes.
  for (const Skeleton::Bone& bone : MakeCenterlineSkeleton(Arc(4.0, 0.3)).bones)
  {
    EXPECT_GE(bone.length, 3.0 - 1e-9);
  }
  for (const Skeleton::Bone& bone : MakeCenterlineSkeleton(Arc(1e5, 20.0)).bones)
  {
    EXPECT_LE(bone.length, 8.0 + 1e-9);
  }
}

TEST(CenterlineSkeleton, PhantomsWithinTheLimits)
{
  for (const std::uint64_t seed : { 1u, 5u, 17u })
  {
    PhantomSettings settings;
    settings.seed = seed;
    const VesselTree tree = CoronaryPhantom(settings).Tree(0.75);
    const Skeleton skeleton = MakeCenterlineSkeleton(tree);
    EXPECT_GT(skeleton.bones.size(), 60u);
    EXPECT_LT(skeleton.bones.size(), 400u);
    std::set<std::string> names;
    double total = 0.0;
    for (const Skeleton::Bone& bone : skeleton.bones)
    {
      EXPECT_LE(bone.length, 8.0 + 1e-9);
      EXPECT_TRUE(names.insert(bone.name).second) << bone.name;
      total += bone.length;
    }
    VesselTree measured = tree;
    MeasureTree(measured);
    double expected = 0.0;
    for (const VesselTree::Branch& branch : measured.branches)
    {
      expected += branch.length;
    }
    EXPECT_NEAR(total, expected, 1e-6 * expected);
    int roots = 0;
    for (std::size_t j = 0; j < skeleton.joints.size(); ++j)
    {
      roots += skeleton.parent[j] == -1 ? 1 : 0;
      EXPECT_LT(skeleton.parent[j], static_cast<std::int64_t>(j));
    }
    EXPECT_EQ(roots, 2);
    const Skeleton again = MakeCenterlineSkeleton(tree);
    ASSERT_EQ(again.joints.size(), skeleton.joints.size());
    for (std::size_t j = 0; j < skeleton.joints.size(); ++j)
    {
      EXPECT_EQ(again.joints[j], skeleton.joints[j]);
    }
  }
}

TEST(CenterlineSkeleton, BadInput)
{
  const auto contains = [](const std::string& text, const std::string& part)
  { return text.find(part) != std::string::npos; };
  EXPECT_EQ(Complaint([](Skeleton&) {}), "");
  EXPECT_TRUE(contains(Complaint([](Skeleton& s) { s.bones[2].second = 77; }), "bone 2"));
  EXPECT_TRUE(
    contains(Complaint([](Skeleton& s) { s.bones[2].second = s.bones[2].first; }), "no length"));
  EXPECT_TRUE(
    contains(Complaint([](Skeleton& s) { s.bones.push_back(s.bones[1]); }), "same joints"));
  EXPECT_TRUE(contains(Complaint(
                         [](Skeleton& s)
                         {
                           Skeleton::Bone bone;
                           bone.first = s.bones[0].first;
                           bone.second = s.bones[4].second;
                           s.bones.push_back(bone);
                         }),
    "ring"));
  EXPECT_TRUE(contains(
    Complaint([](Skeleton& s) { s.joints[3][0] = std::numeric_limits<double>::quiet_NaN(); }),
    "joint 3"));
  EXPECT_TRUE(contains(Complaint([](Skeleton& s) { s.radius.pop_back(); }), "radii"));
  CenterlineSkeletonSettings settings;
  settings.maximumLength = 4.0;
  EXPECT_THROW(MakeCenterlineSkeleton(Branching(), settings), std::invalid_argument);
  settings = {};
  settings.radiusFactor = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(MakeCenterlineSkeleton(Branching(), settings), std::invalid_argument);
  VesselTree tree = Branching();
  tree.points[3][1] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(MakeCenterlineSkeleton(tree), std::invalid_argument);
  EXPECT_TRUE(MakeCenterlineSkeleton(VesselTree()).bones.empty());
}
}
