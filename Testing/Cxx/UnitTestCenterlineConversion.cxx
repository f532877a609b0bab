// Trees to the forms of other programs and back.

#include "CoronaryPhantom.h"
#include "TgfSkeleton.h"
#include "VmtkTracts.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>

namespace UnitTestCenterlineConversion
{
using namespace coronary;

namespace
{
VesselTree FromPhantom(int seed)
{
  PhantomSettings settings;
  settings.seed = static_cast<std::uint64_t>(seed);
  const PhantomTree truth = CoronaryPhantom(settings).Tree(0.75);
  return SplitAtBifurcations(truth);
}

/// The same branches with the same parents; positions bit by bit, radii on request.
void ExpectSame(const VesselTree& a, const VesselTree& b, bool radii)
{
  ASSERT_EQ(a.branches.size(), b.branches.size());
  for (const VesselTree::Branch& x : a.branches)
  {
    const VesselTree::Branch* y = nullptr;
    for (const VesselTree::Branch& other : b.branches)
    {
      const bool same = a.points[x.points.front()] == b.points[other.points.front()] &&
        a.points[x.points[1]] == b.points[other.points[1]];
      y = same ? &other : y;
    }
    ASSERT_NE(y, nullptr) << x.groupId;
    ASSERT_EQ(x.points.size(), y->points.size());
    for (std::size_t i = 0; i < x.points.size(); ++i)
    {
      EXPECT_EQ(a.points[x.points[i]], b.points[y->points[i]]);
      if (radii)
      {
        EXPECT_EQ(a.radius[x.points[i]], b.radius[y->points[i]]);
      }
    }
    EXPECT_EQ(x.parentGroupId == -1, y->parentGroupId == -1);
    if (radii)
    {
      EXPECT_EQ(x.groupId, y->groupId);
      EXPECT_EQ(x.parentGroupId, y->parentGroupId);
    }
  }
}

std::string Complaint(const std::function<void()>& call)
{
  try
  {
    call();
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}

std::string ComplaintOfTgf(const std::string& text)
{
  return Complaint(
    [&]
    {
      std::istringstream stream(text);
      FromSkeleton(ReadTgf(stream));
    });
}
}

TEST(CenterlineConversion, VmtkThereAndBack)
{
  for (const int seed : { 5, 6 })
  {
    const VesselTree tree = FromPhantom(seed);
    const std::vector<VmtkTract> tracts = ToVmtkTracts(tree);
    // Every tip has a path of its own, from a root on.
    int paths = 0;
    for (const VmtkTract& tract : tracts)
    {
      paths = std::max(paths, tract.centerlineId + 1);
    }
    EXPECT_GT(paths, 10);
    EXPECT_GT(tracts.size(), tree.branches.size());
    const VesselTree back = FromVmtkTracts(tracts);
    ExpectSame(tree, back, true);
    EXPECT_EQ(tree.points.size(), back.points.size());
  }
}

TEST(CenterlineConversion, AnUnsplitTreeIsSplitForVmtk)
{
  VesselTree tree;
  for (int i = 0; i < 5; ++i)
  {
    tree.points.emplace_back(i, 0.0, 0.0);
  }
  tree.points.emplace_back(2.0, 1.0, 0.0);
  tree.radius = { 1.0, 1.1, 1.2, 1.3, 1.4, 0.5 };
  tree.branches.resize(2);
  tree.branches[0].points = { 0, 1, 2, 3, 4 };
  tree.branches[1].points = { 2, 5 };
  tree.branches[1].groupId = 1;
  tree.branches[1].parentGroupId = 0;
  const std::vector<VmtkTract> tracts = ToVmtkTracts(tree);
  ASSERT_EQ(tracts.size(), 4U);
  EXPECT_EQ(tracts[1].tractId, 1);
  EXPECT_EQ(tracts[0].groupId, tracts[2].groupId);
  EXPECT_NE(tracts[0].centerlineId, tracts[2].centerlineId);
  EXPECT_EQ(tracts[0].points.back(), tracts[1].points.front());
  ExpectSame(SplitAtBifurcations(tree), FromVmtkTracts(tracts), true);
}

TEST(CenterlineConversion, PathsToGivenPoints)
{
  VesselTree tree;
  for (int i = 0; i < 7; ++i)
  {
    tree.points.emplace_back(i, i > 4 ? 1.0 : 0.0, 0.0);
  }
  tree.radius = { 1.0, 1.1, 1.2, 1.3, 1.4, 0.5, 0.4 };
  tree.branches.resize(3);
  tree.branches[0].points = { 0, 1, 2 };
  tree.branches[1].points = { 2, 3, 4 };
  tree.branches[1].groupId = 1;
  tree.branches[1].parentGroupId = 0;
  tree.branches[2].points = { 2, 5 };
  tree.branches[2].groupId = 2;
  tree.branches[2].parentGroupId = 0;
  // A tip, within a branch, the fork (it is the parent's), the root, a point of no branch.
  const std::vector<VmtkTract> tracts = ToVmtkTracts(tree, { 5, 3, 2, 0, 6 });
  const std::vector<std::vector<std::int64_t>> points = { { 0, 1, 2 }, { 2, 5 }, { 0, 1, 2 },
    { 2, 3 }, { 0, 1, 2 } };
  const std::vector<std::array<int, 3>> ids = { { 0, 0, 0 }, { 0, 1, 2 }, { 1, 0, 0 }, { 1, 1, 1 },
    { 2, 0, 0 } };
  ASSERT_EQ(tracts.size(), points.size());
  for (std::size_t t = 0; t < tracts.size(); ++t)
  {
    EXPECT_EQ(tracts[t].source, points[t]) << t;
    EXPECT_EQ(tracts[t].points.back(), tree.points[static_cast<std::size_t>(points[t].back())]);
    EXPECT_EQ(tracts[t].centerlineId, ids[t][0]) << t;
    EXPECT_EQ(tracts[t].tractId, ids[t][1]) << t;
    EXPECT_EQ(tracts[t].groupId, ids[t][2]) << t;
  }
}

TEST(CenterlineConversion, TgfThereAndBack)
{
  for (const int seed : { 5, 6 })
  {
    const VesselTree tree = FromPhantom(seed);
    const TgfSkeleton skeleton = ToSkeleton(tree);
    EXPECT_EQ(skeleton.joints.size(), tree.points.size());
    EXPECT_EQ(skeleton.bones.size() + 2, skeleton.joints.size()); // two trees
    std::stringstream stream;
    WriteTgf(stream, skeleton);
    const TgfSkeleton read = ReadTgf(stream);
    EXPECT_EQ(read.joints, skeleton.joints);
    EXPECT_EQ(read.bones, skeleton.bones);
    const VesselTree back = FromSkeleton(read, 0.7);
    ExpectSame(tree, back, false);
    EXPECT_EQ(back.radius.front(), 0.7);
  }
}

TEST(CenterlineConversion, TgfOfOthers)
{
  // Any numbers, empty lines, bones that point anywhere, handles after the second '#'.
  std::istringstream stream(
    "10 0 0 0\n7 1e0 0 0\r\n\n 3 2 0 0\n4 2 1 0\n# bones\n3 7\n7 10 0 0\n3 4\n#\n1 2 3\n");
  const TgfSkeleton skeleton = ReadTgf(stream);
  ASSERT_EQ(skeleton.joints.size(), 4U);
  ASSERT_EQ(skeleton.bones.size(), 3U);
  // Bones only begin at joint 3, in the middle: it is the root.
  const VesselTree tree = FromSkeleton(skeleton);
  ASSERT_EQ(tree.branches.size(), 2U);
  EXPECT_EQ(tree.branches[0].parentGroupId, -1);
  EXPECT_EQ(tree.branches[1].parentGroupId, -1);
  EXPECT_EQ(tree.branches[0].points, (std::vector<std::int64_t>{ 2, 1, 0 }));
  EXPECT_EQ(tree.branches[1].points, (std::vector<std::int64_t>{ 2, 3 }));
  EXPECT_NEAR(tree.branches[0].length, 2.0, 1e-12);
  EXPECT_TRUE(FromSkeleton({}).branches.empty());
}

TEST(CenterlineConversion, WhatCanNotBeUsedIsNamed)
{
  const auto has = [](const std::string& text, const std::string& part)
  { EXPECT_NE(text.find(part), std::string::npos) << text; };
  has(ComplaintOfTgf("1 0 0\n#\n"), "line 1 of the TGF skeleton is no joint");
  has(ComplaintOfTgf("1 0 0 x\n#\n"), "line 1 of the TGF skeleton is no joint");
  has(
    ComplaintOfTgf("1 0 0 0\n1 1 0 0\n#\n"), "line 2 of the TGF skeleton: there are two joints 1");
  has(ComplaintOfTgf("1 0 0 0\n2 1 0 0\n"), "no '#'");
  has(ComplaintOfTgf("1 0 0 0\n2 1 0 0\n#\n1\n"), "line 4 of the TGF skeleton is no bone");
  has(ComplaintOfTgf("1 0 0 0\n2 1 0 0\n#\n1 5\n"), "there is no joint 5");
  has(ComplaintOfTgf("1 0 0 0\n2 1 0 0\n#\n1 1\n"), "begins and ends at one joint");
  has(ComplaintOfTgf("1 0 0 0\n2 1 0 0\n3 1 1 0\n#\n1 2\n2 3\n3 1\n"), "bone 2 closes a loop");
  has(Complaint([] { FromSkeleton({ {}, { { { 0, 1 } } } }); }), "does not exist");
  has(Complaint([] { FromSkeleton({}, -1.0); }), "radius");

  const std::vector<VmtkTract> good = ToVmtkTracts(FromPhantom(5));
  const auto complaint = [&](const std::function<void(std::vector<VmtkTract>&)>& damage)
  {
    std::vector<VmtkTract> tracts = good;
    damage(tracts);
    return Complaint([&] { FromVmtkTracts(tracts); });
  };
  using Tracts = std::vector<VmtkTract>;
  has(complaint([](Tracts& t) { t[1].points.resize(1); }), "tract 1 has less than two points");
  has(complaint([](Tracts& t) { t[1].radius.pop_back(); }), "radii");
  has(complaint([](Tracts& t) { t[2].radius[1] = std::numeric_limits<double>::quiet_NaN(); }),
    "point 1 of tract 2");
  has(complaint([](Tracts& t) { t[1].tractId = 0; }), "as another one");
  has(complaint([](Tracts& t) { t[0].tractId = 700; }), "has no tract 0");
  has(complaint([](Tracts& t) { t[1].points.front().x() += 1.0; }), "does not begin where group");
}
}
