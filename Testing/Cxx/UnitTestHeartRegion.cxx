// A chest of simple bodies: the heart and what is near it is looked at, the lung's depth and what is far away are not.

#include "HeartRegion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace UnitTestHeartRegion
{
using namespace coronary;

namespace
{
/// A heart (ball) in lungs, a thin and a thick vessel in these, and a chest's wall; voxels of 2 x 2 x 2.5 mm.
struct Chest
{
  ImageGrid grid;
  std::vector<std::int16_t> values;

  static constexpr double Heart = 40.0;
  static constexpr double Wall = 125.0;

  Chest()
  {
    grid.spacing = Vector3(2.0, 2.0, 2.5);
    grid.extent = { 10, 159, 0, 149, 0, 119 };
    grid.direction << 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0;
    grid.origin = Vector3(-170.0, -150.0, -150.0);
    for (int k = 0; k < 120; ++k)
    {
      for (int j = 0; j < 150; ++j)
      {
        for (int i = 10; i < 160; ++i)
        {
          values.push_back(this->Value(grid.IndexToWorld(i, j, k)));
        }
      }
    }
  }
  static std::int16_t Value(const Vector3& p)
  {
    const bool solid = p.norm() < Heart || std::hypot(p[0], p[1]) > Wall ||
      std::hypot(p[1], p[2]) < 3.0 || (p - Vector3(0.0, 90.0, 0.0)).norm() < 12.0;
    return static_cast<std::int16_t>(solid ? -60 : -850);
  }
  ScalarImage Image() const { return { values.data(), grid }; }
  std::vector<unsigned char> Mask(const HeartRegion& region) const
  {
    std::vector<unsigned char> mask(values.size(), 7);
    region.Fill(mask.data());
    return mask;
  }
};

/// The middle between these is the heart's.
const std::vector<Vector3> Ostia{ Vector3(15.0, 5.0, 0.0), Vector3(-15.0, -5.0, 0.0) };

TEST(HeartRegion, HasTheHeartAndNotTheLung)
{
  const Chest chest;
  const HeartRegion region(chest.Image(), Ostia);
  const std::vector<unsigned char> mask = chest.Mask(region);
  double inside = 0.0;
  std::size_t p = 0;
  for (int k = 0; k < 120; ++k)
  {
    for (int j = 0; j < 150; ++j)
    {
      for (int i = 10; i < 160; ++i, ++p)
      {
        const Vector3 at = chest.grid.IndexToWorld(i, j, k);
        inside += mask[p];
        ASSERT_LE(mask[p], 1);
        // Blocks of 4 x 4 x 2.5 mm, and corners that a ball of 6 mm does not fill.
        constexpr double block = 5.0;
        const double heart = at.norm() - Chest::Heart;
        const double thick = (at - Vector3(0.0, 90.0, 0.0)).norm() - 12.0;
        const double wall = Chest::Wall - std::hypot(at[0], at[1]);
        if (heart < 15.0 - block || thick < 15.0 - 2.0 * block)
        {
          ASSERT_EQ(mask[p], 1) << at.transpose();
        }
        // Neither is the vessel of 3 mm radius in the lung.
        if (heart > 15.0 + block && thick > 15.0 + block && wall > 15.0 + block)
        {
          ASSERT_EQ(mask[p], 0) << at.transpose();
        }
        // Farther than a heart reaches, whatever is there.
        if (at[0] > 140.0 + block || at[0] < -90.0 - block || std::abs(at[1]) > 110.0 + block ||
          at[2] > 70.0 + block)
        {
          ASSERT_EQ(mask[p], 0) << at.transpose();
        }
      }
    }
  }
  EXPECT_NEAR(region.Share(), inside / static_cast<double>(mask.size()), 1e-12);
  EXPECT_GT(region.Share(), 0.05);
  EXPECT_LT(region.Share(), 0.3);
}

TEST(HeartRegion, IsToldByItsBlocks)
{
  const Chest chest;
  SetNumberOfThreads(1);
  const HeartRegion region(chest.Image(), Ostia);
  SetNumberOfThreads(3);
  EXPECT_EQ(HeartRegion(chest.Image(), Ostia).Blocks(), region.Blocks());
  SetNumberOfThreads(0);
  const HeartRegion told(chest.grid, region.Blocks());
  EXPECT_EQ(chest.Mask(told), chest.Mask(region));
  EXPECT_EQ(told.Share(), region.Share());
  EXPECT_THROW(HeartRegion(chest.grid, region.Blocks() + 'x'), std::invalid_argument);
  EXPECT_THROW(HeartRegion(chest.Image(), {}), std::invalid_argument);
  EXPECT_THROW(HeartRegion(chest.Image(), Ostia, [](double) { return false; }), Cancelled);
}

TEST(HeartRegion, VoxelsWithoutValueAreNotSolid)
{
  const Chest chest;
  std::vector<float> values(chest.values.begin(), chest.values.end());
  const HeartRegion region(chest.Image(), Ostia);
  EXPECT_EQ(HeartRegion({ values.data(), chest.grid }, Ostia).Blocks(), region.Blocks());
  // One in each block: the others tell.
  for (std::size_t p = 0; p < values.size(); p += 7)
  {
    values[p] = std::numeric_limits<float>::quiet_NaN();
  }
  EXPECT_NEAR(HeartRegion({ values.data(), chest.grid }, Ostia).Share(), region.Share(), 0.01);
}
}
}
