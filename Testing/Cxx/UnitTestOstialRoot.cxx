// Where a tree begins: tubes that leave a bright half space, whose ostia are known.

#include "OstialRoot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace UnitTestOstialRoot
{
using namespace coronary;

namespace
{
constexpr double Spacing = 0.5;
constexpr double Lumen = 400.0;
constexpr double Fat = -80.0;

/// Images of distances to a wall, negative inside, with its profile blurred.
struct Picture
{
  ImageGrid grid;
  std::vector<float> values;

  explicit Picture(const std::function<double(const Vector3&)>& distance)
  {
    this->grid.extent = { 0, 79, 0, 59, 0, 59 };
    this->grid.spacing = Vector3::Constant(Spacing);
    this->grid.origin = Vector3(-12.0, -15.0, -15.0);
    for (int k = 0; k < 60; ++k)
    {
      for (int j = 0; j < 60; ++j)
      {
        for (int i = 0; i < 80; ++i)
        {
          const double d = distance(this->grid.IndexToWorld(i, j, k));
          const double share = 0.5 * std::erfc(d / (0.4 * std::sqrt(2.0)));
          this->values.push_back(static_cast<float>(Fat + share * (Lumen - Fat)));
        }
      }
    }
  }

  std::vector<OstialRoot> Settle(VesselTree& tree) const
  {
    LumenSettings settings;
    settings.reference.lumen = Lumen;
    settings.reference.background = Fat;
    const ScalarImage image{ this->values.data(), this->grid };
    return SettleRoots(tree, ImageInterpolator(image), settings);
  }
};

/// Distance to a ray's tube that widens towards its beginning by a funnel of `depth` mm.
double Tube(const Vector3& p, const Vector3& from, const Vector3& axis, double radius, double depth)
{
  const double along = (p - from).dot(axis);
  const double off = (p - from - along * axis).norm();
  const double open = std::max(0.0, depth - along);
  return off - radius - (depth > 0.0 ? 0.5 * open * open / depth : 0.0);
}

/// A line of a tree that comes out of the half space at x < 0 with a bend and the width of a funnel.
VesselTree BentTree(const Vector3& axis, double radius)
{
  VesselTree tree;
  VesselTree::Branch branch;
  const Vector3 across = axis.unitOrthogonal();
  for (int i = 0; i <= 60; ++i)
  {
    const double s = -4.0 + 0.3 * i;
    const double early = std::max(0.0, 3.0 - s);
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.emplace_back(s * axis + 0.06 * early * early * across);
    tree.radius.push_back(radius + 0.06 * early * early);
    tree.confidence.push_back(s < 1.0 ? 0.2 : 1.0);
  }
  tree.branches.push_back(branch);
  return tree;
}
}

TEST(OstialRoot, BeginsWhereTheVesselLeavesTheWall)
{
  for (const double degrees : { 0.0, 25.0, 40.0 })
  {
    for (const double radius : { 1.3, 2.2 })
    {
      SCOPED_TRACE(testing::Message() << degrees << " degrees, " << radius << " mm");
      const double angle = degrees * M_PI / 180.0;
      const Vector3 axis(std::cos(angle), std::sin(angle), 0.0);
      const Picture picture([&](const Vector3& p)
        { return std::min(p[0], Tube(p, Vector3::Zero(), axis, radius, 0.0)); });
      VesselTree tree = BentTree(axis, radius);
      const VesselTree before = tree;
      const std::vector<OstialRoot> roots = picture.Settle(tree);
      ASSERT_EQ(roots.size(), 1u);
      ASSERT_TRUE(roots[0].found);
      EXPECT_LT(roots[0].position.norm(), 0.6 + 0.4 * radius * std::tan(angle));
      EXPECT_LT((roots[0].position - roots[0].position.dot(axis) * axis).norm(), 0.4);
      EXPECT_GT(roots[0].normal.dot(axis), std::cos(10.0 * M_PI / 180.0));
      EXPECT_NEAR(roots[0].radius, radius, 0.12 * radius);
      EXPECT_EQ(roots[0].position, tree.points.front());
      // The rest is as it was, and the points go forwards, evenly.
      EXPECT_EQ(tree.points.size(), before.points.size());
      EXPECT_EQ(tree.points.back(), before.points.back());
      EXPECT_EQ(tree.radius.back(), before.radius.back());
      for (std::size_t i = 1; i < tree.points.size(); ++i)
      {
        const double step = (tree.points[i] - tree.points[i - 1]).dot(axis);
        EXPECT_GT(step, 0.1) << i;
        EXPECT_LT(step, 0.4) << i;
      }
      EXPECT_NO_THROW(CheckTree(tree));
    }
  }
}

TEST(OstialRoot, FunnelsBelongToTheAorta)
{
  // A mouth of 2 + 2 mm that has the vessel's width 4 mm outside of the wall.
  const Vector3 axis = Vector3::UnitX();
  const Picture picture(
    [&](const Vector3& p) { return std::min(p[0], Tube(p, Vector3::Zero(), axis, 2.0, 4.0)); });
  VesselTree tree = BentTree(axis, 2.0);
  const std::vector<OstialRoot> roots = picture.Settle(tree);
  ASSERT_TRUE(roots.at(0).found);
  EXPECT_GT(roots[0].position[0], 0.5);
  EXPECT_LT(roots[0].position[0], 3.0);
  EXPECT_LT(roots[0].radius, 2.7);
}

TEST(OstialRoot, TheFunnelOfAShortMainStemIsNotItsWidth)
{
  // The first branch leaves 9 mm outside of the wall: half of what may move is funnel, and measured as such.
  const Vector3 axis = Vector3::UnitX();
  constexpr double radius = 1.9;
  constexpr double depth = 5.0;
  const Picture picture([&](const Vector3& p)
    { return std::min(p[0], Tube(p, Vector3::Zero(), axis, radius, depth)); });
  VesselTree tree = BentTree(axis, radius);
  for (std::size_t i = 0; i < tree.points.size(); ++i)
  {
    const double open = std::clamp(depth - tree.points[i][0], 0.0, depth);
    tree.radius[i] = radius + 0.5 * open * open / depth;
  }
  VesselTree::Branch side;
  side.groupId = 1;
  side.parentGroupId = 0;
  side.points = { 44, static_cast<std::int64_t>(tree.points.size()) };
  tree.points.emplace_back(tree.points[44] + Vector3(3, 6, 0));
  tree.radius.push_back(1.0);
  tree.confidence.push_back(1.0);
  tree.branches.push_back(side);
  const std::vector<OstialRoot> roots = picture.Settle(tree);
  ASSERT_TRUE(roots.at(0).found);
  EXPECT_GT(roots[0].position[0], 0.8);
  EXPECT_LT(roots[0].position[0], 3.5);
  EXPECT_LT(roots[0].radius, 1.35 * radius);
}

TEST(OstialRoot, AFullWidthBeforeALesionIsTheVessel)
{
  // A lesion of 9 mm that leaves 30 %: right behind the ostium, and some millimetres on. The line begins in the aorta.
  const Vector3 axis = Vector3::UnitX();
  constexpr double healthy = 1.8;
  for (const double start : { 0.0, 2.0, 5.0 })
  {
    SCOPED_TRACE(testing::Message() << "lesion from " << start << " mm on");
    const auto radius = [&](double along)
    {
      const double share = std::clamp((along - start) / 9.0, 0.0, 1.0);
      return healthy * (1.0 - 0.35 * (1.0 - std::cos(2.0 * M_PI * share)));
    };
    const Picture picture([&](const Vector3& p)
      { return std::min(p[0], Tube(p, Vector3::Zero(), axis, radius(p[0]), 0.0)); });
    VesselTree tree = BentTree(axis, healthy);
    for (std::size_t i = 0; i < tree.points.size(); ++i)
    {
      const double along = tree.points[i][0];
      tree.radius[i] += along > 0.0 ? radius(along) - healthy : 0.0;
    }
    const std::vector<OstialRoot> roots = picture.Settle(tree);
    ASSERT_TRUE(roots.at(0).found);
    EXPECT_NEAR(roots[0].position[0], 0.0, 1.0);
    EXPECT_NEAR(roots[0].radius, healthy, 0.25 * healthy);
    for (std::size_t i = 0; i < tree.points.size(); ++i)
    {
      EXPECT_NEAR(tree.radius[i], radius(tree.points[i][0]), 0.3) << tree.points[i][0];
    }
  }
}

TEST(OstialRoot, SeedsInsideOfVesselsStayWhereTheyAre)
{
  const Vector3 axis = Vector3::UnitX();
  const Picture picture([&](const Vector3& p) { return Tube(p, Vector3::Zero(), axis, 1.8, 0.0); });
  VesselTree tree;
  VesselTree::Branch branch;
  for (int i = 0; i < 60; ++i)
  {
    branch.points.push_back(i);
    tree.points.emplace_back(0.3 * i * axis);
    tree.radius.push_back(1.8);
    tree.confidence.push_back(1.0);
  }
  tree.branches.push_back(branch);
  const std::vector<OstialRoot> roots = picture.Settle(tree);
  ASSERT_TRUE(roots.at(0).found);
  EXPECT_LT(roots[0].moved, 0.4);
  EXPECT_NEAR(roots[0].radius, 1.8, 0.15);
}

TEST(OstialRoot, NothingAtOrBehindABranchMoves)
{
  const Vector3 axis = Vector3::UnitX();
  const Picture picture(
    [&](const Vector3& p) { return std::min(p[0], Tube(p, Vector3::Zero(), axis, 2.0, 0.0)); });
  for (const std::int64_t fork : { 3, 34 })
  {
    VesselTree tree = BentTree(axis, 2.0);
    VesselTree::Branch side;
    side.groupId = 1;
    side.parentGroupId = 0;
    side.points = { fork, static_cast<std::int64_t>(tree.points.size()) };
    tree.points.emplace_back(tree.points[static_cast<std::size_t>(fork)] + Vector3(3, 6, 0));
    tree.radius.push_back(1.0);
    tree.confidence.push_back(1.0);
    tree.branches.push_back(side);
    const VesselTree before = tree;
    const std::vector<OstialRoot> roots = picture.Settle(tree);
    ASSERT_EQ(roots.size(), 1u);
    EXPECT_EQ(roots[0].found, fork == 34);
    for (std::size_t i = static_cast<std::size_t>(fork); i < tree.points.size(); ++i)
    {
      EXPECT_EQ(tree.points[i], before.points[i]) << i;
    }
    if (fork == 3)
    {
      EXPECT_EQ(tree.points, before.points);
      EXPECT_EQ(tree.radius, before.radius);
    }
  }
}
}
