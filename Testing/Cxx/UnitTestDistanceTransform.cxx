// Distances and openings against every pair of voxels.

#include "CounterRandom.h"
#include "DistanceTransform.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace UnitTestDistanceTransform
{
using namespace coronary;

namespace
{
struct Mask
{
  std::array<int, 3> size;
  Vector3 spacing;
  std::vector<unsigned char> values;

  Mask(const std::array<int, 3>& voxels, const Vector3& voxel, unsigned char value)
    : size(voxels)
    , spacing(voxel)
    , values(static_cast<std::size_t>(voxels[0]) * voxels[1] * voxels[2], value)
  {
  }
  Vector3 World(std::size_t p) const
  {
    const auto n = static_cast<int>(p);
    return spacing.cwiseProduct(
      Vector3(n % size[0], n / size[0] % size[1], n / (size[0] * size[1])));
  }
  std::vector<float> Distances() const
  {
    return SquaredDistanceTransform(values.data(), size, spacing);
  }
  std::vector<unsigned char> Open(double radius) const
  {
    return OpenWithBall(values.data(), size, spacing, radius);
  }
};

Mask Random(
  const std::array<int, 3>& size, const Vector3& spacing, double zeros, std::uint64_t seed)
{
  Mask mask(size, spacing, 0);
  RandomStream random(seed);
  for (unsigned char& value : mask.values)
  {
    value = random.Uniform() < zeros ? 0 : static_cast<unsigned char>(random.Uniform(1.0, 256.0));
  }
  return mask;
}

std::vector<double> BruteForce(const Mask& mask)
{
  std::vector<double> result(mask.values.size(), std::numeric_limits<double>::infinity());
  for (std::size_t p = 0; p < result.size(); ++p)
  {
    for (std::size_t q = 0; q < result.size(); ++q)
    {
      if (mask.values[q] == 0)
      {
        result[p] = std::min(result[p], (mask.World(p) - mask.World(q)).squaredNorm());
      }
    }
  }
  return result;
}

std::size_t Count(const std::vector<unsigned char>& values)
{
  return values.size() -
    static_cast<std::size_t>(
      std::count(values.begin(), values.end(), static_cast<unsigned char>(0)));
}
}

TEST(DistanceTransform, AgreesWithBruteForceOnAnisotropicMasks)
{
  // From nearly full to nearly empty; lines of a single voxel are the border cases of the envelope.
  const std::array<int, 3> sizes[] = { { 13, 11, 9 }, { 1, 17, 8 }, { 21, 1, 1 }, { 6, 5, 1 } };
  const Vector3 spacings[] = { Vector3(1.0, 1.0, 1.0), Vector3(0.35, 0.41, 1.25),
    Vector3(3.0, 0.2, 0.7) };
  std::uint64_t seed = 1;
  for (const std::array<int, 3>& size : sizes)
  {
    for (const Vector3& spacing : spacings)
    {
      for (const double zeros : { 0.003, 0.05, 0.5 })
      {
        const Mask mask = Random(size, spacing, zeros, seed++);
        const std::vector<float> found = mask.Distances();
        const std::vector<double> expected = BruteForce(mask);
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t p = 0; p < found.size(); ++p)
        {
          if (std::isinf(expected[p]))
          {
            ASSERT_TRUE(std::isinf(found[p]));
            continue;
          }
          ASSERT_NEAR(found[p], expected[p], 1e-5 * expected[p])
            << "seed " << seed - 1 << ", voxel " << p;
        }
      }
    }
  }
}

TEST(DistanceTransform, EmptyAndFullMasks)
{
  const Mask full({ 7, 6, 5 }, Vector3(0.5, 0.6, 0.7), 1);
  for (const float value : full.Distances())
  {
    EXPECT_EQ(value, std::numeric_limits<float>::infinity());
  }
  // Nothing is outside the image, so the ball may reach over its border.
  EXPECT_EQ(Count(full.Open(2.0)), full.values.size());

  const Mask empty({ 7, 6, 5 }, Vector3(0.5, 0.6, 0.7), 0);
  for (const float value : empty.Distances())
  {
    EXPECT_EQ(value, 0.0f);
  }
  EXPECT_EQ(Count(empty.Open(2.0)), 0u);

  const Mask none({ 0, 6, 5 }, Vector3(0.5, 0.6, 0.7), 0);
  EXPECT_TRUE(none.Distances().empty());
}

TEST(DistanceTransform, OpeningIsTheUnionOfTheBallsThatFit)
{
  const Vector3 spacing(0.8, 1.0, 1.3);
  for (const double radius : { 0.5, 1.7, 2.9 })
  {
    const Mask mask = Random({ 14, 12, 10 }, spacing, 0.02, 99);
    std::vector<unsigned char> expected(mask.values.size(), 0);
    const std::vector<double> toZero = BruteForce(mask);
    for (std::size_t p = 0; p < expected.size(); ++p)
    {
      for (std::size_t q = 0; q < expected.size() && expected[p] == 0; ++q)
      {
        expected[p] = toZero[q] > radius * radius &&
            (mask.World(p) - mask.World(q)).squaredNorm() <= radius * radius
          ? 1
          : 0;
      }
    }
    const std::vector<unsigned char> opened = mask.Open(radius);
    EXPECT_EQ(opened, expected) << radius;
    // Opening twice is opening once, and adds nothing.
    Mask again = mask;
    again.values = opened;
    EXPECT_EQ(again.Open(radius), opened) << radius;
    for (std::size_t p = 0; p < opened.size(); ++p)
    {
      EXPECT_LE(opened[p], mask.values[p]);
    }
  }
}

TEST(DistanceTransform, OpeningKeepsTheBodyAndDropsTheVessel)
{
  // A ball of 8 mm, a stick of 2 mm that leaves it along i, and a plate of 2 mm thickness.
  Mask mask({ 80, 50, 40 }, Vector3(0.5, 0.6, 0.7), 0);
  const Vector3 centre(10.0, 14.0, 14.0);
  enum Part
  {
    Ball,
    Stick,
    Plate,
    Parts
  };
  std::vector<int> part(mask.values.size(), -1);
  for (std::size_t p = 0; p < part.size(); ++p)
  {
    const Vector3 d = mask.World(p) - centre;
    const bool plate = mask.World(p)[1] > 26.0 && mask.World(p)[1] < 28.0;
    part[p] = d.norm() <= 8.0                       ? Ball
      : d[0] > 0.0 && std::hypot(d[1], d[2]) <= 2.0 ? Stick
      : plate                                       ? Plate
                                                    : -1;
    mask.values[p] = part[p] >= 0 ? 1 : 0;
  }
  const std::vector<unsigned char> opened = mask.Open(4.5);
  std::array<int, Parts> all{};
  std::array<int, Parts> kept{};
  for (std::size_t p = 0; p < part.size(); ++p)
  {
    if (part[p] < 0)
    {
      EXPECT_EQ(opened[p], 0);
      continue;
    }
    ++all[part[p]];
    kept[part[p]] += opened[p];
    if (part[p] == Stick && opened[p])
    {
      // Only the fillet where the stick leaves the ball.
      EXPECT_LT((mask.World(p) - centre).norm(), 8.6);
    }
  }
  EXPECT_GT(kept[Ball], 0.97 * all[Ball]);
  EXPECT_LT(kept[Stick], 0.05 * all[Stick]);
  EXPECT_EQ(kept[Plate], 0);
  // A thinner ball keeps all three.
  EXPECT_GT(Count(mask.Open(0.75)), 0.97 * static_cast<double>(Count(mask.values)));
}

TEST(DistanceTransform, WindowsAndTransformAgreeToTheBit)
{
  // Few zeros and few others; balls within a window, beyond it, and with voxels on the rim itself.
  for (const double zeros : { 0.0, 0.001, 0.05, 0.9, 1.0 })
  {
    for (const Vector3& spacing : { Vector3(0.5, 0.5, 0.5), Vector3(0.3, 0.47, 1.1) })
    {
      const Mask mask = Random({ 70, 41, 53 }, spacing, zeros, 17);
      const std::vector<float> squared = mask.Distances();
      for (const double radius : { 0.0, 0.3, 1.5, 4.5, 20.0, 1000.0 })
      {
        const double square = radius * radius;
        std::vector<unsigned char> expected(squared.size());
        std::transform(squared.begin(), squared.end(), expected.begin(),
          [&](float distance) { return distance <= square ? 1 : 0; });
        EXPECT_EQ(NearZeros(mask.values.data(), mask.size, mask.spacing, square), expected)
          << zeros << " " << radius;
      }
    }
  }
}

TEST(DistanceTransform, SameBitsOnAnyNumberOfThreads)
{
  const Mask mask = Random({ 61, 47, 33 }, Vector3(0.35, 0.4, 0.9), 0.001, 5);
  SetNumberOfThreads(1);
  const std::vector<float> single = mask.Distances();
  const std::vector<unsigned char> singleOpened = mask.Open(2.0);
  SetNumberOfThreads(5);
  const std::vector<float> several = mask.Distances();
  const std::vector<unsigned char> severalOpened = mask.Open(2.0);
  SetNumberOfThreads(0);
  EXPECT_EQ(single, several);
  EXPECT_EQ(singleOpened, severalOpened);
  EXPECT_GT(Count(singleOpened), 0u);
  EXPECT_LT(Count(singleOpened), mask.values.size());
}

TEST(DistanceTransform, ReportsAndStops)
{
  const Mask mask = Random({ 60, 60, 60 }, Vector3(0.4, 0.4, 0.4), 0.01, 3);
  double last = 0.0;
  const auto watch = [&](double fraction)
  {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1.0);
    last = fraction;
    return true;
  };
  SquaredDistanceTransform(mask.values.data(), mask.size, mask.spacing, watch);
  EXPECT_GT(last, 0.9);
  last = 0.0;
  OpenWithBall(mask.values.data(), mask.size, mask.spacing, 1.0, watch);
  EXPECT_GT(last, 0.9);
  for (const double until : { 0.0, 0.3, 0.8 })
  {
    const auto stop = [&](double fraction) { return fraction < until; };
    EXPECT_THROW(
      SquaredDistanceTransform(mask.values.data(), mask.size, mask.spacing, stop), Cancelled);
    EXPECT_THROW(OpenWithBall(mask.values.data(), mask.size, mask.spacing, 1.0, stop), Cancelled);
  }
}
}
