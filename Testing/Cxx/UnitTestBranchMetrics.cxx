// Branches of trees: how they are found, matched and measured.

#include "BranchMetrics.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace UnitTestBranchMetrics
{
using namespace coronary;

namespace
{
/// Adds a straight line of points 0.5 mm apart.
void AddLine(
  Polylines& tree, const Vector3& from, const Vector3& to, double radius, std::int64_t group)
{
  const int steps = static_cast<int>(std::lround((to - from).norm() / 0.5));
  tree.lines.emplace_back();
  for (int i = 0; i <= steps; ++i)
  {
    tree.lines.back().push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.emplace_back(i == 0 ? from
        : i == steps                ? to
                                    : Vector3(from + (to - from) * i / steps));
    tree.radius.push_back(radius);
  }
  tree.groups.push_back(group);
}

const Vector3 Root(0, 0, 0);
const Vector3 Fork(20, 0, 0);
const Vector3 TipA(50, 0, 0);
const Vector3 TipB(20, 25, 0);

/// A trunk of 20 mm, and branches of 30 and 25 mm.
Polylines Reference()
{
  Polylines tree;
  AddLine(tree, Root, Fork, 2.0, 5);
  AddLine(tree, Fork, TipA, 1.5, 6);
  AddLine(tree, Fork, TipB, 1.5, 7);
  return tree;
}
}

TEST(BranchMetrics, ATreeAgreesWithItself)
{
  const BranchMetrics m = CompareBranches(Reference(), Reference());
  ASSERT_EQ(m.reference.size(), 3U);
  ASSERT_EQ(m.rows.size(), 3U);
  EXPECT_EQ(m.completenessRatio, 1.0);
  EXPECT_EQ(m.continuityScore, 1.0);
  EXPECT_EQ(m.boundedCompleteness, 1.0);
  EXPECT_EQ(m.boundedContinuity, 1.0);
  EXPECT_NEAR(m.lengthDetected, 1.0, 1e-12);
  EXPECT_EQ(m.falseBranches, 0);
  EXPECT_EQ(m.matched, 3);
  EXPECT_NEAR(m.overlap.overlap, 1.0, 1e-12);
  for (const BranchAgreement& row : m.rows)
  {
    EXPECT_EQ(row.reference, row.result);
    EXPECT_NEAR(row.overlap, 1.0, 0.15);
    EXPECT_EQ(row.longestGap, 0.0);
  }
  EXPECT_TRUE(m.reference[0].isRoot);
  EXPECT_FALSE(m.reference[1].isRoot);
}

TEST(BranchMetrics, BranchesDoNotDependOnHowTheLinesAreCut)
{
  // The trunk in two lines, as where a segment's name changes; and as VMTK has it, whole paths.
  Polylines cut;
  AddLine(cut, Root, { 8, 0, 0 }, 2.0, 1);
  AddLine(cut, { 8, 0, 0 }, Fork, 2.0, 2);
  AddLine(cut, Fork, TipA, 1.5, 3);
  AddLine(cut, Fork, TipB, 1.5, 4);
  const std::vector<TreeBranch> branches = FindBranches(cut);
  ASSERT_EQ(branches.size(), 3U);
  EXPECT_NEAR(branches[0].length, 20.0, 1e-12);
  EXPECT_EQ(branches[0].group, 2); // the longer piece's
  Polylines paths = Reference();
  for (const int line : { 1, 2 })
  {
    std::vector<std::int64_t>& points = paths.lines[line];
    points.insert(points.begin(), paths.lines[0].begin(), paths.lines[0].end());
  }
  paths.lines.erase(paths.lines.begin());
  paths.groups.erase(paths.groups.begin());
  const BranchMetrics m = CompareBranches(paths, cut);
  EXPECT_EQ(m.completenessRatio, 1.0);
  EXPECT_NEAR(m.continuityScore, 1.0, 1e-12);
  BranchMetricsSettings asGiven;
  asGiven.linesAreBranches = true;
  EXPECT_EQ(FindBranches(cut, asGiven).size(), 4U);
  EXPECT_EQ(CompareBranches(cut, Reference(), asGiven).completenessRatio, 4.0 / 3.0);
}

TEST(BranchMetrics, ShortTwigsAreNoBranches)
{
  Polylines twigs = Reference();
  AddLine(twigs, { 30, 0, 0 }, { 30, -2, 0 }, 0.5, 8);
  AddLine(twigs, { 20, 10, 0 }, { 18, 10, 0 }, 0.5, 9);
  // A short trunk is one, whatever its length.
  const BranchMetrics m = CompareBranches(twigs, Reference());
  EXPECT_EQ(m.result.size(), 3U);
  EXPECT_EQ(m.completenessRatio, 1.0);
  BranchMetricsSettings all;
  all.minimumLength = 0.0;
  const BranchMetrics n = CompareBranches(twigs, Reference(), all);
  EXPECT_EQ(n.result.size(), 7U);
  EXPECT_EQ(n.completenessRatio, 7.0 / 3.0);
  EXPECT_EQ(n.boundedCompleteness, 1.0);
  // The paper's ratio is above 1 for a tree with false branches; half a twig is inside the vessel.
  EXPECT_EQ(n.falseBranches, 2);
  Polylines shortTrunk;
  AddLine(shortTrunk, { 18, 0, 0 }, Fork, 2.0, 5);
  AddLine(shortTrunk, Fork, TipA, 1.5, 6);
  AddLine(shortTrunk, Fork, TipB, 1.5, 7);
  EXPECT_EQ(FindBranches(shortTrunk).size(), 3U);
}

TEST(BranchMetrics, AMissingBranchAndAShortOne)
{
  // Branch A is there up to 40 (20 of 30 mm), B is missing, and there is a false one of 10 mm.
  Polylines result;
  AddLine(result, Root, Fork, 2.0, 1);
  AddLine(result, Fork, { 40, 0, 0 }, 1.5, 2);
  AddLine(result, Fork, { 20, 0, 10 }, 1.5, 3);
  const BranchMetrics m = CompareBranches(result, Reference());
  EXPECT_EQ(m.completenessRatio, 1.0); // as many, but not the same
  EXPECT_NEAR(m.continuityScore, (1.0 + 20.0 / 30.0 + 0.0) / 3.0, 1e-12);
  EXPECT_NEAR(m.matchedLengthRatio, (1.0 + 20.0 / 30.0) / 2.0, 1e-12);
  EXPECT_EQ(m.matched, 2);
  EXPECT_NEAR(m.boundedCompleteness, 1.0 / 3.0, 1e-12);
  EXPECT_EQ(m.falseBranches, 1);
  EXPECT_NEAR(m.falseLength, 10.0 - 2.0, 0.26); // within the trunk's radius it is right
  ASSERT_EQ(m.rows.size(), 4U);
  EXPECT_TRUE(m.rows[0].detected);
  // Up to the radius beyond the end.
  EXPECT_NEAR(m.rows[1].covered, 21.5 / 30.0, 0.26 / 30.0);
  EXPECT_NEAR(m.rows[1].longestGap, 8.5, 0.26);
  EXPECT_FALSE(m.rows[1].detected);
  EXPECT_NEAR(m.rows[2].covered, 1.5 / 25.0, 0.26 / 25.0);
  EXPECT_EQ(m.rows[2].result, -1);
  EXPECT_EQ(m.rows[3].reference, -1);
  EXPECT_EQ(m.rows[3].result, 2);
  EXPECT_NEAR(m.lengthDetected, (20.0 + 21.5 + 1.5) / 75.0, 0.02);
  EXPECT_LT(m.overlap.overlap, 0.8);
}

TEST(BranchMetrics, DetectedFromTheGivenShareOn)
{
  for (const double end : { 43.0, 41.0 })
  {
    Polylines result;
    AddLine(result, Root, Fork, 2.0, 1);
    AddLine(result, Fork, { end, 0, 0 }, 1.5, 2);
    AddLine(result, Fork, TipB, 1.5, 3);
    // 43 covers 24.5 of 30 mm, 41 covers 22.5.
    const BranchMetrics m = CompareBranches(result, Reference());
    EXPECT_EQ(m.detected, end > 42.0 ? 3 : 2);
    BranchMetricsSettings strict;
    strict.detectedShare = 0.9;
    EXPECT_EQ(CompareBranches(result, Reference(), strict).detected, 2);
  }
}

TEST(BranchMetrics, GapsAndBranchesThatHangOnNothing)
{
  Polylines result;
  AddLine(result, Root, Fork, 2.0, 1);
  // A with a gap from 30 to 38; B begins 8 mm from the fork.
  AddLine(result, Fork, { 30, 0, 0 }, 1.5, 2);
  AddLine(result, { 38, 0, 0 }, TipA, 1.5, 3);
  AddLine(result, { 20, 8, 0 }, TipB, 1.5, 4);
  const BranchMetrics m = CompareBranches(result, Reference());
  EXPECT_NEAR(m.rows[1].covered, 1.0 - 5.0 / 30.0, 0.26 / 30.0);
  EXPECT_EQ(m.rows[1].continuity, m.rows[1].covered);
  EXPECT_NEAR(m.rows[1].longestGap, 5.0, 0.26);
  EXPECT_NEAR(m.rows[2].covered, 1.0 - 5.0 / 25.0, 0.26 / 25.0);
  // The fork is within reach of the trunk: a branch begins there, but its own beginning is missing.
  EXPECT_GT(m.rows[2].longestGap, 4.5);
  EXPECT_GT(m.boundedCompleteness, 0.6);
  EXPECT_LE(m.boundedContinuity, 1.0);

  // Without the trunk, nothing leads to B.
  Polylines loose;
  AddLine(loose, { 20, 8, 0 }, TipB, 1.5, 4);
  const BranchMetrics n = CompareBranches(loose, Reference());
  EXPECT_GT(n.rows[2].covered, 0.7);
  EXPECT_EQ(n.rows[2].continuity, 0.0);
}

TEST(BranchMetrics, MatchingIsTheBestOfAll)
{
  // Two branches of the reference would like the same one of the result. The nearer one has it, and
  // the other its second best.
  Polylines reference;
  AddLine(reference, { 0, 0, 0 }, { 40, 0, 0 }, 1.0, 1);
  AddLine(reference, { 0, 1.2, 0 }, { 40, 1.2, 0 }, 1.0, 2);
  Polylines result;
  AddLine(result, { 0, 0.5, 0 }, { 40, 0.5, 0 }, 1.0, 10);
  AddLine(result, { 0, 2.0, 0 }, { 40, 2.0, 0 }, 1.0, 11);
  const BranchMetrics m = CompareBranches(result, reference);
  ASSERT_EQ(m.matched, 2);
  EXPECT_EQ(m.rows[0].result, 0);
  EXPECT_EQ(m.rows[1].result, 1);
  // A gate that no pair passes.
  BranchMetricsSettings strict;
  strict.overlapGate = 0.99;
  EXPECT_LT(CompareBranches(result, reference, strict).matched, 2);
}

TEST(BranchMetrics, ASurfaceIsATreeByItsGroups)
{
  std::vector<Vector3> points;
  std::vector<std::int64_t> groups;
  std::vector<double> abscissas;
  const auto addTube =
    [&](const Vector3& from, const Vector3& to, double radius, double start, std::int64_t group)
  {
    const Vector3 axis = (to - from).normalized();
    const Vector3 u = axis.unitOrthogonal();
    for (double s = 0.0; s <= (to - from).norm() + 1e-9; s += 0.25)
    {
      for (int k = 0; k < 12; ++k)
      {
        points.emplace_back(from + s * axis +
          radius * (std::cos(M_PI * k / 6) * u + std::sin(M_PI * k / 6) * axis.cross(u)));
        groups.push_back(group);
        abscissas.push_back(start + s);
      }
    }
  };
  addTube(Root, Fork, 2.0, 0.0, 5);
  addTube(Fork, TipA, 1.5, 20.0, 6);
  const Polylines tree = TreeOfSurface(points, groups, abscissas);
  ASSERT_EQ(tree.lines.size(), 2U);
  const std::vector<TreeBranch> branches = FindBranches(tree);
  ASSERT_EQ(branches.size(), 2U);
  EXPECT_NEAR(branches[0].length, 20.0, 1e-9);
  EXPECT_NEAR(branches[1].length, 30.0, 1e-9);
  EXPECT_NEAR(branches[1].radius[10], 1.5, 0.1);
  EXPECT_LT((branches[1].points.back() - TipA).norm(), 1e-9);
  const BranchMetrics m = CompareBranches(tree, Reference());
  EXPECT_NEAR(m.completenessRatio, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(m.continuityScore, 1.0, 1e-9);
  EXPECT_NEAR(m.boundedCompleteness, 2.0 / 3.0, 1e-12);
}

TEST(BranchMetrics, EmptySidesAndBadInput)
{
  const Polylines nothing;
  const BranchMetrics none = CompareBranches(nothing, nothing);
  EXPECT_TRUE(std::isnan(none.completenessRatio));
  EXPECT_TRUE(none.rows.empty());
  const BranchMetrics missed = CompareBranches(nothing, Reference());
  EXPECT_EQ(missed.completenessRatio, 0.0);
  EXPECT_TRUE(std::isnan(missed.continuityScore));
  EXPECT_EQ(missed.boundedCompleteness, 0.0);
  EXPECT_EQ(missed.boundedContinuity, 0.0);
  EXPECT_EQ(missed.rows.size(), 3U);
  const BranchMetrics extra = CompareBranches(Reference(), nothing);
  EXPECT_TRUE(std::isnan(extra.completenessRatio));
  EXPECT_EQ(extra.falseBranches, 3);
  EXPECT_EQ(extra.rows.size(), 3U);
  Polylines bad = Reference();
  bad.points[3][0] = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { CompareBranches(bad, Reference()); }, "point 3 of the result is not finite");
  bad = Reference();
  bad.radius[2] = -1.0;
  ExpectRefusal([&] { CompareBranches(Reference(), bad); }, "radius of point 2 of the reference");
  bad = Reference();
  bad.lines[0][0] = 9999;
  ExpectRefusal([&] { CompareBranches(bad, Reference()); }, "refers to point 9999");
  BranchMetricsSettings settings;
  settings.spacing = 0.0;
  ExpectRefusal([&] { CompareBranches(Reference(), Reference(), settings); }, "spacing");
  settings = {};
  settings.detectedShare = 1.5;
  ExpectRefusal([&] { CompareBranches(Reference(), Reference(), settings); }, "detectedShare");
  EXPECT_THROW(
    CompareBranches(Reference(), Reference(), {}, [](double) { return false; }), Cancelled);
  // Radii are not needed.
  Polylines plain = Reference();
  plain.radius.clear();
  EXPECT_EQ(CompareBranches(plain, plain).continuityScore, 1.0);
}

TEST(BranchMetrics, LoopsAndDoubledLinesEnd)
{
  Polylines ring;
  AddLine(ring, { 0, 0, 0 }, { 10, 0, 0 }, 1.0, 1);
  AddLine(ring, { 10, 0, 0 }, { 10, 10, 0 }, 1.0, 2);
  AddLine(ring, { 10, 10, 0 }, { 0, 0, 0 }, 1.0, 3);
  AddLine(ring, { 10, 10, 0 }, { 0, 0, 0 }, 1.0, 4);
  const std::vector<TreeBranch> branches = FindBranches(ring);
  ASSERT_EQ(branches.size(), 1U);
  EXPECT_NEAR(branches[0].length, 20.0 + std::sqrt(200.0), 1e-9);
  // A line of one point, and one that stays where it is.
  Polylines dots;
  dots.points = { { 1, 1, 1 }, { 1, 1, 1 } };
  dots.lines = { { 0 }, { 0, 1 }, {} };
  EXPECT_TRUE(FindBranches(dots).empty());
  EXPECT_EQ(CompareBranches(dots, Reference()).completenessRatio, 0.0);
}
}
