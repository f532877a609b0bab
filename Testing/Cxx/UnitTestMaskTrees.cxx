// Masks without an image: the aorta is cut off, trees begin where they touched it, fragments and doubtful sizes are told.

#include "MaskTrees.h"

#include <gtest/gtest.h>

#include <cmath>

namespace UnitTestMaskTrees
{
using namespace coronary;

namespace
{
double DistanceToSegment(const Vector3& p, const Vector3& a, const Vector3& b)
{
  const double t = std::min(1.0, std::max(0.0, (p - a).dot(b - a) / (b - a).squaredNorm()));
  return (p - a - t * (b - a)).norm();
}

/// An aorta of radius 14 along z, and two vessels of radius 1.6 that leave it at z = 0.
struct Scene
{
  ImageGrid grid;
  std::vector<unsigned char> mask;

  Scene(double spacing, bool aorta, bool fragment)
  {
    const int half = static_cast<int>(50.0 / spacing);
    this->grid.extent = { 0, 2 * half, 0, 2 * half, 0, 2 * half };
    this->grid.spacing = Vector3::Constant(spacing);
    this->grid.origin = Vector3::Constant(-spacing * half);
    for (int k = 0; k <= 2 * half; ++k)
    {
      for (int j = 0; j <= 2 * half; ++j)
      {
        for (int i = 0; i <= 2 * half; ++i)
        {
          const Vector3 p = this->grid.IndexToWorld(i, j, k);
          const bool left = DistanceToSegment(p, Vector3(10, 0, 0), Vector3(45, 20, -30)) < 1.6;
          const bool right = DistanceToSegment(p, Vector3(-10, 0, 0), Vector3(-45, -10, -40)) < 1.6;
          const bool body = aorta && p.head<2>().norm() < 14.0 && p[2] > -20.0;
          const bool piece =
            fragment && DistanceToSegment(p, Vector3(0, 40, 0), Vector3(0, 40, 6)) < 1.2;
          this->mask.push_back(left || right || body || piece ? 1 : 0);
        }
      }
    }
  }
};
}

TEST(MaskTrees, TheAortaIsCutOffAndTreesBeginThere)
{
  for (const double spacing : { 0.6, 0.9 })
  {
    const Scene scene(spacing, true, true);
    const MaskTrees found = FindMaskTrees(scene.grid, scene.mask, 4.5);
    EXPECT_TRUE(found.hasAorta);
    const double volume = 3.14159265 * 14.0 * 14.0 * 70.0;
    EXPECT_NEAR(found.aortaVolume, volume, 0.08 * volume);
    ASSERT_EQ(found.trees.size(), 2u);
    for (const MaskTree& tree : found.trees)
    {
      // On the wall, where the vessel's axis leaves it.
      const bool left = tree.seed[0] > 0.0;
      const Vector3 from = left ? Vector3(10, 0, 0) : Vector3(-10, 0, 0);
      const Vector3 to = left ? Vector3(45, 20, -30) : Vector3(-45, -10, -40);
      EXPECT_LT(DistanceToSegment(tree.seed, from, to), 1.6);
      EXPECT_NEAR(tree.seed.head<2>().norm(), 15.0, 2.5);
    }
    EXPECT_NE(found.trees[0].seed[0] > 0.0, found.trees[1].seed[0] > 0.0);
    // What is left over has no part of the aorta, and the piece that hangs on nothing is told.
    for (std::size_t n = 0; n < found.vessels.size(); ++n)
    {
      EXPECT_LE(found.vessels[n], scene.mask[n]);
    }
    ASSERT_EQ(found.remarks.size(), 1u);
    EXPECT_NE(found.remarks[0].find("is left out"), std::string::npos) << found.remarks[0];
  }
}

TEST(MaskTrees, WithoutAnAortaEveryLargePieceIsATree)
{
  const Scene scene(0.7, false, false);
  const MaskTrees found = FindMaskTrees(scene.grid, scene.mask, 4.5);
  EXPECT_FALSE(found.hasAorta);
  EXPECT_EQ(found.trees.size(), 2u);
  EXPECT_EQ(found.vessels, scene.mask);
  EXPECT_TRUE(found.remarks.empty());
  EXPECT_NEAR(found.size, 100.0, 8.0);
}

TEST(MaskTrees, AVoxelOfOneMillimetreIsQuestionedWhenTheHeartIsNone)
{
  Scene scene(0.7, true, false);
  scene.grid.spacing = Vector3::Ones();
  EXPECT_TRUE(FindMaskTrees(scene.grid, scene.mask, 4.5).remarks.empty());
  scene.grid.spacing = Vector3::Constant(3.0);
  MaskTrees found = FindMaskTrees(scene.grid, scene.mask, 20.0);
  ASSERT_EQ(found.remarks.size(), 1u);
  EXPECT_NE(found.remarks[0].find("mm in size"), std::string::npos);
  EXPECT_EQ(found.remarks[0].find("1 mm"), std::string::npos);

  Scene fine(0.35, true, false);
  fine.grid.spacing = Vector3::Ones();
  found = FindMaskTrees(fine.grid, fine.mask, 12.0);
  ASSERT_EQ(found.remarks.size(), 1u);
  EXPECT_NE(found.remarks[0].find("exactly 1 mm"), std::string::npos) << found.remarks[0];
}

TEST(MaskTrees, WhatCanNotBe)
{
  const Scene scene(0.9, true, false);
  std::vector<unsigned char> none(scene.mask.size(), 0);
  EXPECT_THROW(FindMaskTrees(scene.grid, none, 4.5), std::invalid_argument);
  none.pop_back();
  EXPECT_THROW(FindMaskTrees(scene.grid, none, 4.5), std::invalid_argument);
  EXPECT_THROW(FindMaskTrees(scene.grid, scene.mask, 0.0), std::invalid_argument);
  // An aorta without vessels.
  std::vector<unsigned char> body = scene.mask;
  const MaskTrees found = FindMaskTrees(scene.grid, scene.mask, 4.5);
  for (std::size_t n = 0; n < body.size(); ++n)
  {
    body[n] = found.vessels[n] != 0 ? 0 : body[n];
  }
  EXPECT_THROW(FindMaskTrees(scene.grid, body, 4.5), std::invalid_argument);
}
}
