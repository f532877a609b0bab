// The chest: that its parts are where they have to be around the heart, countable, and the same each time.
#include "CArm.h"
#include "CoronaryPhantom.h"
#include "Fnv1a.h"
#include "Refusals.h"
#include "TableRow.h"
#include "ThoraxPhantom.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <string>
#include <vector>

namespace UnitTestThoraxPhantom
{
using namespace coronary;

namespace
{
const HounsfieldVolume& Thorax()
{
  static const HounsfieldVolume volume = MakeThoraxPhantom();
  return volume;
}

/// Without variation: its lines are known.
const HounsfieldVolume& MeanThorax()
{
  static const HounsfieldVolume volume = []
  {
    ThoraxSettings settings;
    settings.seed = 0;
    return MakeThoraxPhantom(settings);
  }();
  return volume;
}

int ValueAt(const HounsfieldVolume& volume, const Vector3& p)
{
  const Vector3 index = (p - volume.grid.origin).cwiseQuotient(volume.grid.spacing);
  const std::array<int, 3> n = volume.View().Dimensions();
  std::int64_t place = 0;
  for (int axis = 2; axis >= 0; --axis)
  {
    const auto i = static_cast<std::int64_t>(std::lround(index[axis]));
    if (i < 0 || i >= n[static_cast<std::size_t>(axis)])
    {
      return -1000;
    }
    place = place * n[static_cast<std::size_t>(axis)] + i;
  }
  return volume.values[static_cast<std::size_t>(place)];
}

/// What a ray loses, with water's attenuation at 60 keV, 0.0206 / mm.
double LineIntegral(
  const HounsfieldVolume& volume, const CArmGeometry& geometry, double column, double row)
{
  const Vector3 way = geometry.PixelPosition(column, row) - geometry.Source();
  const double length = way.norm();
  double sum = 0.0;
  for (double t = 0.0; t < length; t += 1.0)
  {
    sum += 0.0206 * (1.0 + 1e-3 * ValueAt(volume, geometry.Source() + t / length * way));
  }
  return sum;
}
}

TEST(ThoraxPhantom, IsThereInTwoSecondsOfTwoCores)
{
  const std::clock_t start = std::clock(); // of all threads
  const HounsfieldVolume made = MakeThoraxPhantom();
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const std::array<int, 3> n = made.View().Dimensions();
  std::printf("| thorax of %d x %d x %d voxels: processor s | | %.2f | | below 4 |\n", n[0], n[1],
    n[2], seconds);
  EXPECT_LT(seconds, 4.0);
}

TEST(ThoraxPhantom, IsAlwaysTheSame)
{
  const HounsfieldVolume& volume = Thorax();
  ASSERT_EQ(volume.values.size(), static_cast<std::size_t>(volume.View().NumberOfVoxels()));

  ThoraxSettings coarse;
  coarse.spacing = 3.0;
  const auto hash = [](const ThoraxSettings& settings)
  {
    const HounsfieldVolume made = MakeThoraxPhantom(settings);
    return Fnv1a(made.values.data(), made.values.size() * sizeof(made.values[0]));
  };
  const std::uint64_t once = hash(coarse);
  SetNumberOfThreads(3);
  EXPECT_EQ(hash(coarse), once);
  SetNumberOfThreads(0);
  coarse.seed = 2;
  EXPECT_NE(hash(coarse), once);
}

TEST(ThoraxPhantom, heartIsSoftTissueAndSoIsWhatCarriesTheVessels)
{
  // All coronary arteries run over soft tissue or fat, not through lung or bone.
  const CoronaryPhantom phantom{ PhantomSettings() };
  int outside = 0;
  int count = 0;
  for (const Vector3& point : phantom.Tree(0.0).points)
  {
    const int value = ValueAt(Thorax(), point);
    outside += value < -200 || value > 150 ? 1 : 0;
    ++count;
  }
  Row("coronary arteries: share in lung or bone, %", 0.0, 100.0 * outside / count, "1 %");
  EXPECT_LT(outside, count / 100);
}

TEST(ThoraxPhantom, organsAreWhereTheyBelong)
{
  const auto at = [](double x, double y, double z) { return ValueAt(Thorax(), Vector3(x, y, z)); };
  // Lungs on both sides, liver on the right below, air around.
  EXPECT_LT(at(-105.0, 0.0, 0.0), -600);
  EXPECT_LT(at(80.0, 30.0, 0.0), -600);
  EXPECT_NEAR(at(-100.0, 0.0, -135.0), 60, 40);
  EXPECT_EQ(at(-20.0, -140.0, -100.0), -1000);
  // Heart without contrast, spine, air in the trachea.
  EXPECT_NEAR(at(15.0, -35.0, -50.0), 48, 20);
  EXPECT_LT(at(-20.0, 12.0, 95.0), -800);
  EXPECT_GT(at(-20.0, 58.0, -20.0), 120);
  EXPECT_LT(at(-20.0, 58.0, -20.0), 450);
}

TEST(ThoraxPhantom, ribsCanBeCounted)
{
  for (const int side : { -1, 1 })
  {
    // Beside the transverse processes, looked at from the back: heights where there is bone behind the spine's middle.
    int ribs = 0;
    double since = 1e9;
    for (double z = 130.0; z > -190.0; z -= 0.75)
    {
      bool bone = false;
      const double u = (z + 20.0) / 130.0;
      for (double y = 63.0 - 22.0 * u * u; y < 125.0; y += 1.0)
      {
        // Marrow as well.
        bone = bone || ValueAt(MeanThorax(), Vector3(-20.0 + side * 55.0, y, z)) > 120;
      }
      ribs += bone && since > 2.0 ? 1 : 0;
      since = bone ? 0.0 : since + 0.75;
    }
    Row(side < 0 ? "right ribs met 55 mm beside the midline" : "left ribs", 12.0, ribs, "exact");
    EXPECT_EQ(ribs, 12);
  }
}

TEST(ThoraxPhantom, vertebraeCanBeCounted)
{
  // Down the middle of the bodies: end plates are dense, discs are not.
  std::vector<double> discs;
  double last = 1e9;
  for (double z = 125.0; z > -200.0; z -= 0.5)
  {
    const double u = (z + 20.0) / 130.0;
    const bool disc = ValueAt(MeanThorax(), Vector3(-20.0, 58.0 - 22.0 * u * u, z)) < 150;
    if (disc && std::abs(z - last) > 12.0)
    {
      discs.push_back(z);
      last = z;
    }
  }
  Row("discs from z = 125 to -200 mm", 14.0, static_cast<double>(discs.size()), "13 to 15");
  EXPECT_GE(discs.size(), 13U);
  EXPECT_LE(discs.size(), 15U);
  for (std::size_t i = 1; i < discs.size(); ++i)
  {
    EXPECT_NEAR(discs[i - 1] - discs[i], 23.0, 7.0);
  }
}

TEST(ThoraxPhantom, attenuatesAsAChestDoes)
{
  CArmPose pose;
  pose.isocentre = Vector3(0.0, -20.0, -40.0);
  DetectorFormat format;
  const CArmGeometry frontal(pose, format);
  // Frontal: lung 2 to 3, spine behind the heart 4 to 6.
  pose.isocentre = Vector3(-95.0, -20.0, 10.0);
  const double lung = LineIntegral(Thorax(), CArmGeometry(pose, format), 255.5, 255.5);
  pose.isocentre = Vector3(-18.0, -20.0, -40.0);
  const double spine = LineIntegral(Thorax(), CArmGeometry(pose, format), 255.5, 255.5);
  std::printf("| frontal, ln(I0 / I) at 60 keV: lung | 1.5 to 3 | %.2f | | |\n", lung);
  std::printf("| the same: heart and spine | 4 to 6.5 | %.2f | | |\n", spine);
  EXPECT_GT(lung, 1.5);
  EXPECT_LT(lung, 3.0);
  EXPECT_GT(spine, 4.0);
  EXPECT_LT(spine, 6.5);
}

TEST(ThoraxPhantom, sizeFollowsTheSettings)
{
  // Width of the body at the heart.
  for (const double width : { 280.0, 340.0, 400.0 })
  {
    ThoraxSettings settings;
    settings.seed = 0;
    settings.spacing = 3.0;
    settings.width = width;
    const HounsfieldVolume volume = MakeThoraxPhantom(settings);
    double left = 0.0;
    double right = 0.0;
    for (double x = 0.0; x < 300.0; x += 1.0)
    {
      left = ValueAt(volume, Vector3(-20.0 + x, 10.0, -30.0)) > -500 ? x : left;
      right = ValueAt(volume, Vector3(-20.0 - x, 10.0, -30.0)) > -500 ? x : right;
    }
    Row("width of the chest at the heart, mm", width, left + right, "3 %");
    EXPECT_NEAR(left + right, width, 0.03 * width);
    // Nothing is cut off at the sides.
    EXPECT_LT(right, -20.0 - volume.grid.origin.x() - 2.0);
  }
}

TEST(ThoraxPhantom, canBeCancelledAndRefusesWhatIsNotPossible)
{
  EXPECT_THROW(MakeThoraxPhantom({}, [](double) { return false; }), Cancelled);
  const auto with = [](auto change)
  {
    ThoraxSettings settings;
    change(settings);
    MakeThoraxPhantom(settings);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { with([](ThoraxSettings& s) { s.spacing = 0.1; }); }, "spacing");
  ExpectRefusal([&] { with([=](ThoraxSettings& s) { s.width = nan; }); }, "width");
  ExpectRefusal([&] { with([](ThoraxSettings& s) { s.fat = 100.0; }); }, "fat");
}
}
