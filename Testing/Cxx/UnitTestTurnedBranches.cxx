// Two daughters of a vessel that meet again: the one that was entered from its end is known, and its begin found.

#include "TurnedBranches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace UnitTestTurnedBranches
{
using namespace coronary;

namespace
{
constexpr double Trunk = 1.3; // mm, radius
constexpr double Twin = 0.7;
constexpr double Fork = -10.0;  // z where the twin leaves the trunk
constexpr double Touch = -32.0; // z where it touches it

/// Middle of the twin at a height.
Vector3 TwinAt(double z)
{
  const double t = (z - Fork) / (Touch - Fork);
  return { 4.5 * std::sin(M_PI * t) + (Trunk + Twin - 0.3) * t, 0.0, z };
}

/// The trunk goes down along z.
struct Scene
{
  ImageGrid grid;
  std::vector<float> values;
  ScalarImage image;

  /// @param faint  contrast of the twin above `from`, share
  explicit Scene(double faint, double from = -22.0)
  {
    constexpr int half = 24;
    this->grid.spacing = Vector3::Constant(0.5);
    this->grid.extent = { 0, 2 * half, 0, 2 * half, 0, 90 };
    this->grid.origin = Vector3(-0.5 * half + 2.0, -0.5 * half, -43.0);
    for (int k = 0; k <= 90; ++k)
    {
      for (int j = 0; j <= 2 * half; ++j)
      {
        for (int i = 0; i <= 2 * half; ++i)
        {
          const Vector3 p = this->grid.IndexToWorld(i, j, k);
          const auto inside = [](double wall)
          { return 0.5 * std::erfc(wall / (std::sqrt(2.0) * 0.35)); };
          double bright = inside(std::hypot(p[0], p[1]) - Trunk);
          if (p[2] < Fork + 1.0 && p[2] > Touch - 1.0)
          {
            // Its course leans by little: a section across z is nearly round.
            const double twin = inside((p - TwinAt(p[2])).norm() - Twin);
            bright = std::max(bright, (p[2] > from ? faint : 1.0) * twin);
          }
          this->values.push_back(static_cast<float>(50.0 + 350.0 * bright));
        }
      }
    }
    this->image = { this->values.data(), this->grid };
  }
};

/// The trunk, and a branch that leaves it at a height.
VesselTree TreeWith(double begin, const std::function<Vector3(double)>& course, double length)
{
  VesselTree tree;
  VesselTree::Branch trunk;
  for (double z = 0.0; z >= -42.0; z -= 0.3)
  {
    trunk.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.emplace_back(0.0, 0.0, z);
    tree.radius.push_back(Trunk);
  }
  VesselTree::Branch branch;
  branch.groupId = 1;
  branch.parentGroupId = 0;
  branch.points.push_back(std::lround(-begin / 0.3));
  for (double passed = 0.6; passed <= length; passed += 0.3)
  {
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.push_back(course(passed));
    tree.radius.push_back(Twin);
  }
  tree.branches = { trunk, branch };
  return tree;
}

/// The twin, followed up from where it touches the trunk.
VesselTree Turned()
{
  return TreeWith(
    Touch, [](double passed) { return TwinAt(Touch + passed); }, 11.0);
}
}

TEST(TurnedBranches, ABranchThatWasEnteredFromItsEndBeginsUpstream)
{
  for (const double faint : { 0.6, 1.0 })
  {
    SCOPED_TRACE(faint);
    const Scene scene(faint);
    const VesselTree tree = Turned();
    const std::vector<TurnedBranch> found =
      FindTurnedBranches(ImageInterpolator(scene.image), tree, 0.5);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].branch, 1u);
    EXPECT_NEAR(found[0].length, 13.0, 0.5); // its axis bends
    ASSERT_GE(found[0].root, 0);
    EXPECT_NEAR(tree.points[static_cast<std::size_t>(found[0].root)][2], Fork, 3.0);
    ASSERT_GT(found[0].way.size(), 10u);
    EXPECT_LT((found[0].way.back() - tree.points.back()).norm(), 0.5);
    for (const Vector3& p : found[0].way)
    {
      EXPECT_LT(std::min(std::hypot(p[0], p[1]) - Trunk, (p - TwinAt(p[2])).norm() - Twin), 0.5)
        << p.transpose();
    }
  }
}

TEST(TurnedBranches, WhereNothingIsSeenThereIsNoRoot)
{
  const Scene scene(0.05);
  const std::vector<TurnedBranch> found =
    FindTurnedBranches(ImageInterpolator(scene.image), Turned(), 0.5);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].root, -1);
}

TEST(TurnedBranches, OtherBranchesStay)
{
  const Scene scene(1.0);
  const ImageInterpolator image(scene.image);
  // With the flow.
  const VesselTree down = TreeWith(
    Fork, [](double passed) { return TwinAt(Fork - passed); }, 18.0);
  EXPECT_TRUE(FindTurnedBranches(image, down, 0.5).empty());
  // Against it, and away from the trunk.
  const VesselTree away = TreeWith(
    Touch, [](double passed) { return Vector3(0.9 * passed, 0.0, Touch + 0.45 * passed); }, 20.0);
  EXPECT_TRUE(FindTurnedBranches(image, away, 0.5).empty());
  // At a right angle.
  const VesselTree across = TreeWith(
    Touch, [](double passed) { return Vector3(passed, 0.0, Touch); }, 12.0);
  EXPECT_TRUE(FindTurnedBranches(image, across, 0.5).empty());
  EXPECT_THROW(FindTurnedBranches(image, down, 0.0), std::invalid_argument);
}
}
