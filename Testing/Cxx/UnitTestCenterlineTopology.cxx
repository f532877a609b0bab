// Curve geometry against closed forms, and trees out of lines in every form that lines come in.

#include "CenterlineTopology.h"
#include "CoronaryPhantom.h"
#include "CounterRandom.h"
#include "CurveGeometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

namespace UnitTestCenterlineTopology
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

std::vector<Vector3> Helix(double radius, double rise, double step, double length, double noise)
{
  const double speed = std::hypot(radius, rise);
  RandomStream random(7);
  std::vector<Vector3> points;
  const int count = static_cast<int>(std::lround(length / step));
  for (int i = 0; i <= count; ++i)
  {
    const double t = step * i / speed;
    points.push_back(Vector3(radius * std::cos(t), radius * std::sin(t), rise * t) +
      noise * Vector3(random.Normal(), random.Normal(), random.Normal()));
  }
  return points;
}

double RootMeanSquare(const std::vector<double>& values, double truth)
{
  double sum = 0.0;
  for (const double value : values)
  {
    sum += (value - truth) * (value - truth);
  }
  return std::sqrt(sum / static_cast<double>(values.size()));
}

/// Lines from lists of corners, 0.5 mm steps; the points of different lines are not shared.
struct LineMaker
{
  Polylines set;

  std::vector<std::int64_t> Add(const std::vector<Vector3>& corners,
    const std::function<double(double)>& radius, double step = 0.5)
  {
    std::vector<std::int64_t> line;
    double way = 0.0;
    for (std::size_t c = 0; c + 1 < corners.size(); ++c)
    {
      const double length = (corners[c + 1] - corners[c]).norm();
      const int count = std::max(1, static_cast<int>(std::lround(length / step)));
      for (int i = c == 0 ? 0 : 1; i <= count; ++i)
      {
        line.push_back(static_cast<std::int64_t>(this->set.points.size()));
        this->set.points.push_back(corners[c] + (corners[c + 1] - corners[c]) * i / count);
        this->set.radius.push_back(radius(way + length * i / count));
      }
      way += length;
    }
    this->set.lines.push_back(line);
    return line;
  }
};

std::function<double(double)> Constant(double radius)
{
  return [radius](double) { return radius; };
}

/// A Y: 20 mm up, then 20 mm at +-45 degrees; radii 2, 1.6, 1.2.
const Vector3 Base(0, 0, 0);
const Vector3 Fork(0, 0, 20);
const Vector3 LeftTip(14, 0, 34);
const Vector3 RightTip(-14, 0, 34);

LineMaker WholePaths(double spread = 0.0)
{
  LineMaker maker;
  const Vector3 aside(0.0, spread, 0.0);
  maker.Add({ Base, Fork, LeftTip }, [](double s) { return s <= 20.0 ? 2.0 : 1.6; });
  maker.Add(
    { Base + aside, Fork + aside, RightTip }, [](double s) { return s <= 20.0 ? 2.0 : 1.2; });
  return maker;
}
}

TEST(CurveGeometry, HelixWithoutNoise)
{
  for (const double radius : { 2.0, 8.0, 20.0 })
  {
    for (const double rise : { -4.0, 1.0, 4.0 })
    {
      const double square = radius * radius + rise * rise;
      const CurveGeometry curve = ComputeCurveGeometry(Helix(radius, rise, 0.25, 100.0, 0.0));
      EXPECT_LT(RootMeanSquare(curve.curvature, radius / square), 0.002 * radius / square);
      EXPECT_LT(RootMeanSquare(curve.torsion, rise / square), 0.02 * std::abs(rise) / square);
      EXPECT_NEAR(curve.arcLength.back(), 100.0, 0.3);
      for (std::size_t i = 20; i + 20 < curve.tangent.size(); ++i)
      {
        const double t = 0.25 * static_cast<double>(i) / std::sqrt(square);
        const Vector3 tangent =
          Vector3(-radius * std::sin(t), radius * std::cos(t), rise) / std::sqrt(square);
        EXPECT_LT((curve.tangent[i] - tangent).norm(), 1e-3);
        EXPECT_LT((curve.normal[i] - Vector3(-std::cos(t), -std::sin(t), 0.0)).norm(), 5e-3);
        EXPECT_LT((curve.binormal[i] - curve.tangent[i].cross(curve.normal[i])).norm(), 1e-12);
      }
    }
  }
}

TEST(CurveGeometry, HelixWithNoise)
{
  // The noise is that of a tracked centerline; finite differences would give a curvature of 1/mm.
  for (const double noise : { 0.1, 0.2, 0.4 })
  {
    for (const double step : { 0.25, 0.5 })
    {
      const double square = 8.0 * 8.0 + 4.0 * 4.0;
      const CurveGeometry curve = ComputeCurveGeometry(Helix(8.0, 4.0, step, 100.0, noise));
      EXPECT_LT(RootMeanSquare(curve.curvature, 8.0 / square), 0.012) << noise << " " << step;
      EXPECT_LT(RootMeanSquare(curve.torsion, 4.0 / square), 0.025) << noise << " " << step;
      EXPECT_NEAR(curve.arcLength.back(), 100.0, 2.0);
    }
  }
}

TEST(CurveGeometry, CircleHasNoTorsionAndALineNoCurvature)
{
  const CurveGeometry circle = ComputeCurveGeometry(Helix(10.0, 0.0, 0.5, 50.0, 0.0));
  EXPECT_LT(RootMeanSquare(circle.curvature, 0.1), 1e-4);
  EXPECT_LT(RootMeanSquare(circle.torsion, 0.0), 1e-6);

  std::vector<Vector3> line;
  line.reserve(41);
  for (int i = 0; i <= 40; ++i)
  {
    line.push_back(Vector3(1.0, 2.0, -0.5) * i);
  }
  const CurveGeometry straight = ComputeCurveGeometry(line);
  for (std::size_t i = 0; i < line.size(); ++i)
  {
    EXPECT_LT(straight.curvature[i], 1e-6);
    EXPECT_EQ(straight.torsion[i], straight.torsion[i]);
    EXPECT_LT(std::abs(straight.torsion[i]), 1e-3);
    EXPECT_NEAR(straight.normal[i].norm(), 1.0, 1e-9);
    EXPECT_NEAR(straight.normal[i].dot(straight.tangent[i]), 0.0, 1e-9);
    EXPECT_NEAR(straight.normal[i].dot(straight.normal[0]), 1.0, 1e-9);
  }
}

TEST(CurveGeometry, ScalesAndTurnsWithThePoints)
{
  const std::vector<Vector3> points = Helix(8.0, 4.0, 0.5, 60.0, 0.2);
  const CurveGeometry curve = ComputeCurveGeometry(points);
  const Matrix3 turn =
    (Eigen::AngleAxisd(1.0, Vector3::UnitX()) * Eigen::AngleAxisd(2.0, Vector3::UnitZ()))
      .toRotationMatrix();
  std::vector<Vector3> moved;
  for (const Vector3& point : points)
  {
    moved.push_back(1e-3 * (turn * point + Vector3(500.0, -500.0, 500.0)));
  }
  const CurveGeometry other = ComputeCurveGeometry(moved);
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    EXPECT_NEAR(other.curvature[i] * 1e-3, curve.curvature[i], 1e-6);
    EXPECT_NEAR(other.torsion[i] * 1e-3, curve.torsion[i], 1e-5);
    EXPECT_LT((other.tangent[i] - turn * curve.tangent[i]).norm(), 1e-6);
  }
}

TEST(CurveGeometry, TakesWhatHasNoGeometry)
{
  EXPECT_THROW(ComputeCurveGeometry({}), std::invalid_argument);
  EXPECT_THROW(ComputeCurveGeometry({ Vector3(0, 0, std::nan("")) }), std::invalid_argument);
  EXPECT_THROW(
    ComputeCurveGeometry({ Vector3(0, 0, 0) }, { std::nan(""), 0.0 }), std::invalid_argument);
  for (const std::vector<Vector3>& points : std::vector<std::vector<Vector3>>{ { Vector3(1, 2, 3) },
         { Vector3(1, 2, 3), Vector3(1, 2, 3), Vector3(1, 2, 3) },
         { Vector3(1, 2, 3), Vector3(2, 2, 3) },
         { Vector3(0, 0, 0), Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(1, 0, 0) },
         { Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 0, 0) },
         { Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(1, 1, 0) } })
  {
    const CurveGeometry curve = ComputeCurveGeometry(points);
    ASSERT_EQ(curve.tangent.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      EXPECT_TRUE(std::isfinite(curve.curvature[i]));
      EXPECT_TRUE(std::isfinite(curve.torsion[i]));
      EXPECT_NEAR(curve.normal[i].norm(), 1.0, 1e-9);
    }
  }
}

TEST(CurveGeometry, TortuosityOfASemicircle)
{
  std::vector<Vector3> points;
  for (int i = 0; i <= 1000; ++i)
  {
    points.emplace_back(10.0 * std::cos(Pi * i / 1000.0), 10.0 * std::sin(Pi * i / 1000.0), 3.0);
  }
  EXPECT_NEAR(PolylineLength(points), 10.0 * Pi, 1e-3);
  EXPECT_NEAR(PolylineTortuosity(points), 0.5 * Pi - 1.0, 1e-5);
  points.push_back(points.front());
  EXPECT_EQ(PolylineTortuosity(points), 0.0);
}

TEST(CenterlineTopology, WholePathsBecomeBranches)
{
  // Paths that coincide, and paths that run side by side at a fifth of the radius.
  for (const double spread : { 0.0, 0.4 })
  {
    const CenterlineTopology tree = BuildTopology(WholePaths(spread).set);
    ASSERT_EQ(tree.branches.size(), 3U) << spread;
    EXPECT_EQ(tree.trees, 1);
    EXPECT_TRUE(tree.loops.empty());
    EXPECT_EQ(tree.branches[0].parentGroupId, -1);
    EXPECT_NEAR(tree.branches[0].length, 20.0, spread == 0.0 ? 1e-9 : 2.5);
    ASSERT_EQ(tree.bifurcations.size(), 1U);
    EXPECT_LT((tree.points[tree.bifurcations[0].point] - Fork).norm(), spread == 0.0 ? 1e-9 : 2.5);
    for (const int b : { 1, 2 })
    {
      EXPECT_EQ(tree.branches[b].parentGroupId, 0);
      EXPECT_EQ(tree.branches[b].generation, 1);
      EXPECT_EQ(tree.branches[b].points[0], tree.branches[0].points.back());
    }
    EXPECT_EQ(tree.branches[0].strahlerOrder, 2);
    CheckTree(tree);
  }
}

TEST(CenterlineTopology, SharedBranchesGapsAndDuplicates)
{
  LineMaker maker;
  maker.Add({ Base, Fork }, Constant(2.0));
  maker.Add({ Fork, LeftTip }, Constant(1.6));
  maker.Add({ Fork + Vector3(-1.4, 0.0, 1.4), RightTip }, Constant(1.2)); // a gap of 2 mm
  maker.Add({ Fork, LeftTip }, Constant(1.6));                            // twice
  maker.Add({ Vector3(5, 5, 5), Vector3(5, 5, 5) }, Constant(1.0));       // no line
  const CenterlineTopology tree = BuildTopology(maker.set);
  EXPECT_EQ(tree.branches.size(), 3U);
  EXPECT_EQ(tree.closedGaps, 1);
  EXPECT_EQ(tree.trees, 1);

  TopologySettings settings;
  settings.gapRatio = 0.5;
  EXPECT_EQ(BuildTopology(maker.set, settings).trees, 2);
}

TEST(CenterlineTopology, BifurcationsNearEachOtherStayTwo)
{
  // Lines that are cut at the bifurcations; the piece between them is shorter than the merge distance.
  const Vector3 second = Fork + Vector3(0.0, 0.0, 0.8);
  const std::vector<std::vector<Vector3>> lines = { { Base, Fork }, { Fork, second },
    { second, Vector3(0.0, 0.0, 45.0) }, { Fork, LeftTip }, { second, RightTip } };
  for (const std::vector<int>& order : std::vector<std::vector<int>>{ { 0, 1, 2, 3, 4 },
         { 0, 3, 1, 4, 2 }, { 3, 4, 0, 2, 1 }, { 1, 0, 2, 3, 4 }, { 2, 1, 0, 4, 3 } })
  {
    for (const bool reversed : { false, true })
    {
      LineMaker maker;
      for (const int line : order)
      {
        std::vector<Vector3> corners = lines[line];
        if (reversed)
        {
          std::reverse(corners.begin(), corners.end());
        }
        maker.Add(corners, Constant(2.0), 0.2);
      }
      const CenterlineTopology tree = BuildTopology(maker.set, {}, { Base });
      ASSERT_EQ(tree.branches.size(), 5U);
      ASSERT_EQ(tree.bifurcations.size(), 2U);
      for (const Bifurcation& bifurcation : tree.bifurcations)
      {
        EXPECT_EQ(bifurcation.daughters.size(), 2U);
        EXPECT_LT(std::min((tree.points[bifurcation.point] - Fork).norm(),
                    (tree.points[bifurcation.point] - second).norm()),
          1e-9);
      }
    }
  }
}

TEST(CenterlineTopology, DirectionsOfTheLinesDoNotMatter)
{
  LineMaker maker = WholePaths();
  for (auto& line : maker.set.lines)
  {
    std::reverse(line.begin(), line.end());
  }
  const CenterlineTopology tree = BuildTopology(maker.set);
  ASSERT_EQ(tree.branches.size(), 3U);
  EXPECT_LT((tree.points[tree.branches[0].points[0]] - Base).norm(), 1e-9);

  // Given roots go first.
  const CenterlineTopology other =
    BuildTopology(WholePaths().set, {}, { RightTip + Vector3(0.5, 0.5, 0.5) });
  EXPECT_LT((other.points[other.branches[0].points[0]] - RightTip).norm(), 1e-9);

  // A tree of equal calibre starts where its lines start.
  LineMaker plain;
  plain.Add({ LeftTip, Fork }, Constant(1.0));
  plain.Add({ Fork, RightTip }, Constant(1.0));
  plain.Add({ Fork, Base }, Constant(1.0));
  const CenterlineTopology third = BuildTopology(plain.set);
  EXPECT_LT((third.points[third.branches[0].points[0]] - LeftTip).norm(), 1e-9);
}

TEST(CenterlineTopology, AnglesAreasAndMurray)
{
  const CenterlineTopology tree = BuildTopology(WholePaths().set);
  ASSERT_EQ(tree.bifurcations.size(), 1U);
  const Bifurcation& fork = tree.bifurcations[0];
  EXPECT_NEAR(fork.angle, Pi / 2.0, 1e-6);
  ASSERT_EQ(fork.daughterAngles.size(), 2U);
  EXPECT_NEAR(fork.daughterAngles[0], Pi / 4.0, 1e-6);
  EXPECT_NEAR(fork.daughterAngles[1], Pi / 4.0, 1e-6);
  EXPECT_NEAR(fork.parentRadius, 2.0, 1e-12);
  EXPECT_NEAR(fork.daughterRadius[0], 1.6, 1e-12);
  EXPECT_NEAR(fork.daughterRadius[1], 1.2, 1e-12);
  EXPECT_NEAR(fork.areaRatio, (1.6 * 1.6 + 1.2 * 1.2) / 4.0, 1e-12);
  EXPECT_NEAR(fork.daughterAreaRatio, 1.2 * 1.2 / (1.6 * 1.6), 1e-12);
  EXPECT_NEAR(fork.murrayResidual, 1.0 - 0.512 - 0.216, 1e-12);
  EXPECT_NEAR(fork.finetRatio, 2.0 / 2.8, 1e-12);
  // 1.6^2 + 1.2^2 = 2^2.
  EXPECT_NEAR(fork.fittedExponent, 2.0, 1e-9);
  EXPECT_NEAR(tree.fittedExponent, 2.0, 1e-6);
  EXPECT_NEAR(SolveMurrayExponent(std::cbrt(2.0), { 1.0, 1.0 }), 3.0, 1e-9);
  EXPECT_TRUE(std::isnan(SolveMurrayExponent(1.0, { 1.0, 0.5 })));

  TopologySettings settings;
  settings.murrayExponent = 2.0;
  EXPECT_NEAR(BuildTopology(WholePaths().set, settings).bifurcations[0].murrayResidual, 0.0, 1e-12);
}

TEST(CenterlineTopology, PrunesTwigsByLengthInRadii)
{
  LineMaker maker = WholePaths();
  maker.Add({ Vector3(0, 0, 10), Vector3(0, 5.5, 10) }, Constant(0.5)); // 2.75 radii
  maker.Add({ Vector3(0, 0, 14), Vector3(0, 6.5, 14) }, Constant(0.5)); // 3.25 radii
  const CenterlineTopology tree = BuildTopology(maker.set);
  EXPECT_EQ(tree.prunedTwigs, 1);
  EXPECT_NEAR(tree.prunedLength, 5.5, 1e-9);
  EXPECT_EQ(tree.branches.size(), 5U);
  EXPECT_NEAR(tree.branches[0].length, 14.0, 1e-9);
  TopologySettings settings;
  settings.pruneRatio = 0.0;
  EXPECT_EQ(BuildTopology(maker.set, settings).branches.size(), 7U);
  settings.pruneRatio = 4.0;
  EXPECT_EQ(BuildTopology(maker.set, settings).branches.size(), 3U);
}

TEST(CenterlineTopology, FindsAndCutsLoops)
{
  LineMaker maker = WholePaths();
  maker.Add({ LeftTip, Vector3(0, 0, 44), RightTip }, Constant(0.8));
  const CenterlineTopology tree = BuildTopology(maker.set);
  ASSERT_EQ(tree.loops.size(), 1U);
  const double expected =
    4.0 * std::hypot(14.0, 14.0) - 2.0 * std::hypot(14.0, 14.0) + 2.0 * std::hypot(14.0, 10.0);
  EXPECT_NEAR(tree.loops[0].length, expected, 0.5);
  EXPECT_GT(tree.loops[0].points.size(), 100U);
  EXPECT_EQ(tree.inLoop[0], 0);
  int inLoop = 0;
  for (const char in : tree.inLoop)
  {
    inLoop += in;
  }
  EXPECT_GE(inLoop, 2);
  CheckTree(tree);

  // Three rings on a string, and a ring alone.
  LineMaker rings;
  for (int ring = 0; ring < 3; ++ring)
  {
    const Vector3 at(30.0 * ring, 0, 0);
    rings.Add({ at, at + Vector3(10, 8, 0), at + Vector3(20, 0, 0) }, Constant(1.0));
    rings.Add({ at, at + Vector3(10, -8, 0), at + Vector3(20, 0, 0) }, Constant(1.0));
    rings.Add({ at + Vector3(20, 0, 0), at + Vector3(30, 0, 0) }, Constant(1.0));
  }
  EXPECT_EQ(BuildTopology(rings.set).loops.size(), 3U);
  LineMaker alone;
  alone.Add(
    { Vector3(0, 0, 0), Vector3(10, 0, 0), Vector3(10, 10, 0), Vector3(0, 0, 0) }, Constant(1.0));
  EXPECT_EQ(BuildTopology(alone.set).loops.size(), 1U);

  // Where a vessel is so thin that its resistance overflows, too.
  const auto third = static_cast<std::ptrdiff_t>(alone.set.radius.size() / 3);
  std::fill(alone.set.radius.begin() + third, alone.set.radius.end() - third, 1e-170);
  EXPECT_EQ(BuildTopology(alone.set).loops.size(), 1U);
}

TEST(CenterlineTopology, RadiusOfAMillionMedians)
{
  // All that is nearer than its radius is one vessel, and the search for it ends.
  LineMaker lines;
  lines.Add({ Vector3(0, 0, 0), Vector3(80, 0, 0) }, Constant(1.0));
  lines.Add({ Vector3(40, 0, 0), Vector3(40, 30, 0) }, Constant(0.5));
  lines.Add({ Vector3(200, 0, 0), Vector3(240, 0, 0) }, Constant(1.0));
  lines.set.radius.back() = 1e6;
  const CenterlineTopology tree = BuildTopology(lines.set);
  CheckTree(tree);
  EXPECT_EQ(tree.closedGaps, 1U);
}

TEST(CenterlineTopology, StrahlerOrders)
{
  // A comb has order 2 all along, a full binary tree one more at each level.
  LineMaker comb;
  comb.Add({ Vector3(0, 0, 0), Vector3(80, 0, 0) }, Constant(1.0));
  for (int tooth = 1; tooth <= 7; ++tooth)
  {
    comb.Add({ Vector3(10.0 * tooth, 0, 0), Vector3(10.0 * tooth, 10, 0) }, Constant(0.5));
  }
  const CenterlineTopology tree = BuildTopology(comb.set);
  ASSERT_EQ(tree.branches.size(), 15U);
  EXPECT_EQ(tree.branches[0].strahlerOrder, 2);
  int deepest = 0;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    deepest = std::max(deepest, tree.branches[b].generation);
    EXPECT_EQ(tree.branches[b].strahlerOrder, tree.continuation[b] < 0 ? 1 : 2);
  }
  EXPECT_EQ(deepest, 7);

  LineMaker binary;
  const std::function<void(const Vector3&, double, int)> grow =
    [&](const Vector3& from, double width, int levels)
  {
    const Vector3 to = from + Vector3(0, 0, 15);
    binary.Add({ from, to }, Constant(0.4 * levels));
    if (levels > 1)
    {
      for (const double side : { -1.0, 1.0 })
      {
        const Vector3 next = to + Vector3(side * width, 0, 0);
        binary.Add({ to, next }, Constant(0.4 * levels));
        grow(next, 0.5 * width, levels - 1);
      }
    }
  };
  grow(Vector3::Zero(), 64.0, 4);
  EXPECT_EQ(BuildTopology(binary.set).branches[0].strahlerOrder, 4);
}

TEST(CenterlineTopology, ReproducesThePhantomsTree)
{
  for (const std::uint64_t seed : { 21, 22, 23 })
  {
    PhantomSettings settings;
    settings.seed = seed;
    settings.ramus = seed == 22;
    const PhantomTree truth = CoronaryPhantom(settings).Tree(0.75);
    // As branches, and as whole paths from the ostia to the tips.
    Polylines branches = LinesOf(truth);
    Polylines paths = branches;
    paths.lines.clear();
    std::map<int, int> daughters;
    for (const VesselTree::Branch& branch : truth.branches)
    {
      ++daughters[branch.parentGroupId];
    }
    for (const VesselTree::Branch& tip : truth.branches)
    {
      if (daughters.count(tip.groupId) > 0)
      {
        continue;
      }
      std::vector<std::int64_t> line = tip.points;
      for (int up = tip.parentGroupId; up >= 0; up = truth.branches[up].parentGroupId)
      {
        const auto& points = truth.branches[up].points;
        line.insert(line.begin(), points.begin(), points.end() - 1);
      }
      paths.lines.push_back(line);
    }
    for (const Polylines& lines : { branches, paths })
    {
      const CenterlineTopology tree = BuildTopology(lines);
      ASSERT_EQ(tree.branches.size(), truth.branches.size());
      EXPECT_EQ(tree.points.size(), truth.points.size());
      EXPECT_EQ(tree.trees, 2);
      EXPECT_EQ(tree.prunedTwigs, 0);
      std::map<std::int64_t, const VesselTree::Branch*> byTip;
      for (const VesselTree::Branch& branch : truth.branches)
      {
        byTip[branch.points.back()] = &branch;
      }
      for (const auto& branch : tree.branches)
      {
        const auto found = byTip.find(tree.source[branch.points.back()]);
        ASSERT_NE(found, byTip.end());
        const VesselTree::Branch& same = *found->second;
        EXPECT_EQ(branch.points.size(), same.points.size());
        EXPECT_EQ(branch.generation, same.generation);
        EXPECT_EQ(branch.strahlerOrder, same.strahlerOrder);
        std::vector<Vector3> way;
        for (const std::int64_t point : same.points)
        {
          way.push_back(truth.points[point]);
        }
        EXPECT_NEAR(branch.length, PolylineLength(way), 1e-9);
      }
      for (std::size_t i = 0; i < tree.points.size(); ++i)
      {
        EXPECT_NEAR(tree.area[i], Pi * tree.radius[i] * tree.radius[i], 1e-12);
      }
    }
  }
}

TEST(CenterlineTopology, UnitAndPlaceDoNotMatter)
{
  PhantomSettings settings;
  settings.seed = 24;
  Polylines lines = LinesOf(CoronaryPhantom(settings).Tree(0.75));
  const CenterlineTopology tree = BuildTopology(lines);
  Polylines moved = lines;
  const Matrix3 turn = Eigen::AngleAxisd(2.0, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  for (std::size_t i = 0; i < moved.points.size(); ++i)
  {
    moved.points[i] = 1e-3 * (turn * moved.points[i] + Vector3(500, 500, -500));
    moved.radius[i] *= 1e-3;
  }
  const CenterlineTopology other = BuildTopology(moved);
  ASSERT_EQ(other.branches.size(), tree.branches.size());
  EXPECT_EQ(other.source, tree.source);
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    EXPECT_NEAR(other.branches[b].length * 1e3, tree.branches[b].length, 1e-6);
  }
  for (std::size_t i = 0; i < tree.points.size(); ++i)
  {
    EXPECT_NEAR(other.curvature[i] * 1e-3, tree.curvature[i], 1e-4);
  }
  for (std::size_t i = 0; i < tree.bifurcations.size(); ++i)
  {
    EXPECT_NEAR(other.bifurcations[i].angle, tree.bifurcations[i].angle, 1e-6);
    EXPECT_NEAR(other.bifurcations[i].murrayResidual, tree.bifurcations[i].murrayResidual, 1e-9);
  }
}

TEST(CenterlineTopology, NoiseAndTwigsDoNotTearTheTree)
{
  for (std::uint64_t seed = 31; seed < 37; ++seed)
  {
    PhantomSettings settings;
    settings.seed = seed;
    settings.dominance = static_cast<Dominance>(seed % 3);
    settings.ramus = seed % 2 == 0;
    const PhantomTree truth = CoronaryPhantom(settings).Tree(0.75);
    Polylines lines = LinesOf(truth);
    RandomStream random(seed);
    for (Vector3& point : lines.points)
    {
      point += 0.4 * Vector3(random.Normal(), random.Normal(), random.Normal());
    }
    const CenterlineTopology tree = BuildTopology(lines);
    EXPECT_EQ(tree.trees, 2) << seed;
    EXPECT_TRUE(tree.loops.empty()) << seed;
    EXPECT_EQ(tree.branches.size(), truth.branches.size()) << seed;
  }
}

TEST(CenterlineTopology, SameResultOnAnyNumberOfThreads)
{
  PhantomSettings settings;
  settings.seed = 25;
  const Polylines lines = LinesOf(CoronaryPhantom(settings).Tree(0.4));
  SetNumberOfThreads(1);
  const CenterlineTopology one = BuildTopology(lines);
  SetNumberOfThreads(3);
  const CenterlineTopology three = BuildTopology(lines);
  SetNumberOfThreads(0);
  EXPECT_EQ(one.points, three.points);
  EXPECT_EQ(one.curvature, three.curvature);
  EXPECT_EQ(one.torsion, three.torsion);
  EXPECT_EQ(one.binormal, three.binormal);
}

TEST(CenterlineTopology, NothingAndNonsense)
{
  EXPECT_TRUE(BuildTopology({}).branches.empty());
  Polylines point;
  point.points = { Vector3(1, 1, 1) };
  point.radius = { 1.0 };
  point.lines = { { 0 }, { 0, 0 }, {} };
  EXPECT_TRUE(BuildTopology(point).branches.empty());

  const auto message = [](const Polylines& set, const TopologySettings& settings = {})
  {
    try
    {
      BuildTopology(set, settings);
    }
    catch (const std::invalid_argument& error)
    {
      return std::string(error.what());
    }
    return std::string();
  };
  Polylines good = WholePaths().set;
  EXPECT_EQ(message(good), "");
  Polylines bad = good;
  bad.radius[5] = 0.0;
  EXPECT_NE(message(bad).find("radius of point 5"), std::string::npos);
  bad = good;
  bad.points[7][1] = std::numeric_limits<double>::infinity();
  EXPECT_NE(message(bad).find("Point 7 is not finite"), std::string::npos);
  bad.points[7][1] = -1e200;
  EXPECT_NE(message(bad).find("Point 7 is too far away"), std::string::npos);
  bad = good;
  bad.points[7][1] = 1e7;
  EXPECT_NE(message(bad).find("a million times as long"), std::string::npos);
  bad = good;
  bad.lines[1][2] = 100000;
  EXPECT_NE(message(bad).find("Line 1"), std::string::npos);
  bad = good;
  bad.radius.pop_back();
  EXPECT_NE(message(bad).find("one radius a point"), std::string::npos);
  TopologySettings settings;
  settings.gapRatio = -1.0;
  EXPECT_NE(message(good, settings).find("gap ratio"), std::string::npos);
  settings = {};
  settings.murrayExponent = std::nan("");
  EXPECT_NE(message(good, settings).find("Murray"), std::string::npos);
  EXPECT_THROW(BuildTopology(good, {}, {}, [](double) { return false; }), Cancelled);
}
}
