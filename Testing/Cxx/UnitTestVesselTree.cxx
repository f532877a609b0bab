// The tree type: what it refuses, lengths along it, cutting at bifurcations.

#include "CoronaryPhantom.h"
#include "VesselTree.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>

namespace UnitTestVesselTree
{
using namespace coronary;

namespace
{
/// A trunk along x with a side branch at its middle, and a twig on that; not split.
VesselTree Comb()
{
  VesselTree tree;
  for (int i = 0; i < 5; ++i)
  {
    tree.points.emplace_back(2.0 * i, 0.0, 0.0);
  }
  for (int i = 1; i < 4; ++i)
  {
    tree.points.emplace_back(4.0, 3.0 * i, 0.0);
  }
  tree.points.emplace_back(4.0, 3.0, 1.0);
  tree.radius.assign(tree.points.size(), 1.5);
  tree.branches.resize(3);
  tree.branches[0].points = { 0, 1, 2, 3, 4 };
  tree.branches[0].groupId = 7;
  tree.branches[0].treeId = 1;
  tree.branches[1].points = { 2, 5, 6, 7 };
  tree.branches[1].groupId = 3;
  tree.branches[1].parentGroupId = 7;
  tree.branches[1].treeId = 1;
  tree.branches[2].points = { 5, 8 };
  tree.branches[2].groupId = 5;
  tree.branches[2].parentGroupId = 3;
  tree.branches[2].treeId = 1;
  return tree;
}

std::string Complaint(const std::function<void(VesselTree&)>& damage)
{
  VesselTree tree = Comb();
  damage(tree);
  try
  {
    CheckTree(tree);
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}
}

TEST(VesselTree, DamageIsNamed)
{
  EXPECT_EQ(Complaint([](VesselTree&) {}), "");
  const auto expect = [](const std::string& part, const std::function<void(VesselTree&)>& damage)
  { EXPECT_NE(Complaint(damage).find(part), std::string::npos) << Complaint(damage); };
  expect("radius has 8", [](VesselTree& t) { t.radius.pop_back(); });
  expect("confidence has 2", [](VesselTree& t) { t.confidence.assign(2, 1.0); });
  expect("point 3 is not finite",
    [](VesselTree& t) { t.points[3].x() = std::numeric_limits<double>::quiet_NaN(); });
  expect("radius of point 1 is negative", [](VesselTree& t) { t.radius[1] = -1.0; });
  expect("less than two points", [](VesselTree& t) { t.branches[2].points.pop_back(); });
  expect("point 9, which does not exist", [](VesselTree& t) { t.branches[2].points[1] = 9; });
  expect("occurs twice", [](VesselTree& t) { t.branches[2].groupId = 7; });
  expect("parent 12 of branch 5", [](VesselTree& t) { t.branches[2].parentGroupId = 12; });
  expect("stands later", [](VesselTree& t) { std::swap(t.branches[0], t.branches[1]); });
  expect("does not begin on its parent", [](VesselTree& t) { t.branches[2].points[0] = 4; });
}

TEST(VesselTree, AbscissasRunOnFromTheParent)
{
  VesselTree tree = Comb();
  MeasureTree(tree);
  EXPECT_DOUBLE_EQ(tree.abscissa[4], 8.0);
  EXPECT_DOUBLE_EQ(tree.abscissa[7], 4.0 + 9.0);
  EXPECT_DOUBLE_EQ(tree.abscissa[8], 4.0 + 3.0 + 1.0);
  EXPECT_DOUBLE_EQ(tree.branches[1].length, 9.0);
  EXPECT_NEAR(tree.branches[1].tortuosity, 0.0, 1e-15);
}

TEST(VesselTree, SplitBranchesTouchAtTheirEnds)
{
  const VesselTree split = SplitAtBifurcations(Comb());
  ASSERT_EQ(split.branches.size(), 5u);
  const std::vector<std::vector<std::int64_t>> expected = { { 0, 1, 2 }, { 2, 3, 4 }, { 2, 5 },
    { 5, 6, 7 }, { 5, 8 } };
  const std::vector<int> parents = { -1, 0, 0, 2, 2 };
  for (std::size_t b = 0; b < expected.size(); ++b)
  {
    EXPECT_EQ(split.branches[b].points, expected[b]) << b;
    EXPECT_EQ(split.branches[b].groupId, static_cast<int>(b));
    EXPECT_EQ(split.branches[b].parentGroupId, parents[b]) << b;
    EXPECT_EQ(split.branches[b].treeId, 1);
  }
  EXPECT_DOUBLE_EQ(split.branches[3].length, 6.0);
  // Splitting what is split changes nothing.
  const VesselTree again = SplitAtBifurcations(split);
  ASSERT_EQ(again.branches.size(), split.branches.size());
  for (std::size_t b = 0; b < again.branches.size(); ++b)
  {
    EXPECT_EQ(again.branches[b].points, split.branches[b].points);
    EXPECT_EQ(again.branches[b].parentGroupId, split.branches[b].parentGroupId);
  }
}

TEST(VesselTree, AsLines)
{
  const VesselTree tree = Comb();
  const Polylines lines = LinesOf(tree);
  EXPECT_EQ(lines.points, tree.points);
  EXPECT_EQ(lines.radius, tree.radius);
  ASSERT_EQ(lines.lines.size(), tree.branches.size());
  ASSERT_EQ(lines.groups.size(), tree.branches.size());
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    EXPECT_EQ(lines.lines[b], tree.branches[b].points);
    EXPECT_EQ(lines.groups[b], tree.branches[b].groupId);
  }
  EXPECT_NO_THROW(CheckPolylines(lines));
}

TEST(VesselTree, ThePhantomsTreeIsOne)
{
  const CoronaryPhantom phantom{ PhantomSettings{} };
  const PhantomTree truth = phantom.Tree(0.0);
  VesselTree tree = truth;
  MeasureTree(tree);
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    // The truth's is the length of the smooth axis, at the reference.
    EXPECT_NEAR(tree.branches[b].length, truth.branches[b].length, 3e-3 * tree.branches[b].length);
  }
  EXPECT_EQ(SplitAtBifurcations(tree).branches.size(), tree.branches.size());
}
}
