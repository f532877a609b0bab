// The check of whole trees: silent on healthy phantoms, and it names what was cut off, and where.

#include "CoronaryPhantom.h"
#include "TreeCheck.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

namespace UnitTestTreeCheck
{
using namespace coronary;

namespace
{
PhantomTree TreeOf(std::uint64_t seed, int dominance, bool ramus = false)
{
  PhantomSettings settings;
  settings.seed = seed;
  settings.dominance = static_cast<Dominance>(dominance);
  settings.ramus = ramus;
  return CoronaryPhantom(settings).Tree(0.75);
}

struct Cut
{
  Polylines lines;
  Vector3 place = Vector3::Zero(); ///< of the new end
};

/// Without what lies beyond a share of a segment's first branch.
Cut CutOff(const PhantomTree& tree, int segment, double share)
{
  Cut cut;
  cut.lines.points = tree.points;
  cut.lines.radius = tree.radius;
  std::set<int> gone;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (gone.count(branch.parentGroupId) != 0)
    {
      gone.insert(branch.groupId);
      continue;
    }
    std::vector<std::int64_t> line = branch.points;
    if (branch.segmentId == segment && gone.empty())
    {
      gone.insert(branch.groupId);
      line.resize(static_cast<std::size_t>(share * static_cast<double>(line.size())));
      cut.place = tree.points[line.empty() ? branch.points.front() : line.back()];
    }
    if (line.size() > 1)
    {
      cut.lines.lines.push_back(line);
    }
  }
  return cut;
}

std::vector<TreeWarning> Check(const Polylines& lines)
{
  CenterlineTopology tree = BuildTopology(lines);
  const LabelingResult labels = LabelSegments(tree);
  SplitAtSegmentBorders(tree);
  return CheckCoronaryTrees(tree, labels);
}

/// The warning of an end in full calibre that is nearest to a place.
double NearestEnd(const std::vector<TreeWarning>& warnings, const Vector3& place)
{
  double minimum = 1e9;
  for (const TreeWarning& warning : warnings)
  {
    const bool end = warning.what.find("full calibre") != std::string::npos;
    minimum = end ? std::min(minimum, (warning.place - place).norm()) : minimum;
  }
  return minimum;
}

bool Says(const std::vector<TreeWarning>& warnings, const std::string& words)
{
  return std::any_of(warnings.begin(), warnings.end(),
    [&](const TreeWarning& warning) { return warning.what.find(words) != std::string::npos; });
}
}

TEST(TreeCheck, NothingIsSaidOfHealthyTrees)
{
  for (std::uint64_t seed = 301; seed <= 303; ++seed)
  {
    for (int dominance = 0; dominance < 3; ++dominance)
    {
      const PhantomTree tree = TreeOf(seed, dominance, seed % 2 == 0);
      for (const TreeWarning& warning : Check(CutOff(tree, -1, 1.0).lines))
      {
        ADD_FAILURE() << seed << " " << dominance << ": " << warning.what;
      }
    }
  }
}

TEST(TreeCheck, WhatIsCutOffIsNamedWithItsPlace)
{
  for (std::uint64_t seed = 311; seed <= 312; ++seed)
  {
    const Cut right = CutOff(TreeOf(seed, 0), MidRCA, 0.6);
    const std::vector<TreeWarning> ofRight = Check(right.lines);
    EXPECT_LT(NearestEnd(ofRight, right.place), 1.0);
    EXPECT_TRUE(Says(ofRight, "the RCA does not reach the crux"));
    EXPECT_TRUE(Says(ofRight, "posterior descending artery's territory"));

    const Cut left = CutOff(TreeOf(seed, 0), MidLAD, 0.5);
    const std::vector<TreeWarning> ofLeft = Check(left.lines);
    EXPECT_TRUE(Says(ofLeft, "no artery in the LAD's distal territory"));
    EXPECT_TRUE(Says(ofLeft, "before the apex"));
    for (const TreeWarning& warning : ofLeft)
    {
      EXPECT_FALSE(warning.vessel.empty());
      EXPECT_GE(warning.confidence, 0.3) << warning.what;
      EXPECT_LE(warning.confidence, 0.99);
      // Not of the other tree.
      EXPECT_EQ(warning.what.find("RCA"), std::string::npos) << warning.what;
    }

    EXPECT_TRUE(Says(Check(CutOff(TreeOf(seed, 0), ProximalLCx, 0.0).lines), "LCx"));
  }
}

TEST(TreeCheck, AVeinThatMayBeAnArteryIsSaid)
{
  EXPECT_FALSE(DoubtfulVeinWarning(Vector3(1.0, 2.0, 3.0), 20.0, 0.97));
  const auto warning = DoubtfulVeinWarning(Vector3(1.0, 2.0, 3.0), 20.0, 0.7);
  ASSERT_TRUE(warning);
  EXPECT_EQ(warning->place, Vector3(1.0, 2.0, 3.0));
  EXPECT_NEAR(warning->confidence, 0.3, 1e-12);
  EXPECT_EQ(warning->what,
    "a vessel of 20 mm that touches a tree at (1.0, 2.0, 3.0) was left out as a vein, with a "
    "probability of 0.70: "
    "it may be an artery");
}

TEST(TreeCheck, AKeptBranchThatMayBeAVeinIsSaidOnce)
{
  for (const double unit : { 1.0, 1e-3 })
  {
    Cut whole = CutOff(TreeOf(331, 0), -1, 1.0);
    for (std::size_t i = 0; i < whole.lines.points.size(); ++i)
    {
      whole.lines.points[i] *= unit;
      whole.lines.radius[i] *= unit;
    }
    CenterlineTopology tree = BuildTopology(whole.lines);
    const LabelingResult labels = LabelSegments(tree);
    SplitAtSegmentBorders(tree);
    std::vector<double> vein(tree.points.size(), 0.0);
    EXPECT_TRUE(CheckCoronaryTrees(tree, labels, vein).empty());
    // The circumflex, and what hangs on it.
    std::set<int> groups;
    double length = 0.0;
    Vector3 begin = Vector3::Zero();
    for (const VesselTree::Branch& branch : tree.branches)
    {
      if (groups.count(branch.parentGroupId) == 0 && branch.segmentId != ProximalLCx)
      {
        continue;
      }
      begin = groups.empty() ? tree.points[branch.points.front()] : begin;
      groups.insert(branch.groupId);
      length += branch.length / unit;
      std::for_each(branch.points.begin() + 1, branch.points.end(),
        [&](std::int64_t point) { vein[point] = 0.3; });
    }
    ASSERT_GT(groups.size(), 3u);
    const std::vector<TreeWarning> warnings = CheckCoronaryTrees(tree, labels, vein);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_EQ(warnings[0].vessel, "pLCx");
    EXPECT_EQ(warnings[0].confidence, 0.3);
    EXPECT_LT((warnings[0].place - begin).norm(), unit);
    EXPECT_TRUE(
      Says(warnings, "pLCx may be a vein: " + std::to_string(std::lround(length)) + " mm"))
      << warnings[0].what;
  }
}

TEST(TreeCheck, AVesselThatWidensIsDoubted)
{
  const PhantomTree tree = TreeOf(321, 0);
  Cut whole = CutOff(tree, -1, 1.0);
  std::string name;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.segmentId == FirstDiagonal)
    {
      // Its last 6 mm are in a vein.
      for (std::size_t i = branch.points.size() - 12; i < branch.points.size(); ++i)
      {
        whole.lines.radius[static_cast<std::size_t>(branch.points[i])] = 1.6;
      }
      whole.place = tree.points[static_cast<std::size_t>(branch.points.back())];
    }
  }
  const std::vector<TreeWarning> warnings = Check(whole.lines);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].vessel, "D1");
  EXPECT_LT((warnings[0].place - whole.place).norm(), 1.0);
}

TEST(TreeCheck, OneTreeAloneAndOtherUnits)
{
  const PhantomTree tree = TreeOf(331, 0);
  Polylines left;
  left.points = tree.points;
  left.radius = tree.radius;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.treeId == 0)
    {
      left.lines.push_back(branch.points);
    }
  }
  const std::vector<TreeWarning> warnings = Check(left);
  ASSERT_EQ(warnings.size(), 1u) << warnings.back().what;
  EXPECT_EQ(warnings[0].vessel, "RCA");
  EXPECT_NE(warnings[0].what.find("no right coronary tree"), std::string::npos);

  // In metres the same, with the place in metres.
  for (Vector3& point : left.points)
  {
    point *= 0.001;
  }
  for (double& radius : left.radius)
  {
    radius *= 0.001;
  }
  const std::vector<TreeWarning> metres = Check(left);
  ASSERT_EQ(metres.size(), 1u);
  EXPECT_NEAR((1000.0 * metres[0].place - warnings[0].place).norm(), 0.0, 1.0);

  EXPECT_TRUE(CheckCoronaryTrees(CenterlineTopology(), LabelingResult()).empty());
}
}
