// Pieces of tube behind gaps: what belongs to the tree is linked where it runs, what does not is not.

#include "CenterlineExtraction.h"
#include "MultiscaleVesselness.h"
#include "VesselSegmentation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace UnitTestVesselLinking
{
using namespace coronary;

namespace
{
constexpr double Fat = -80.0;
constexpr double Tissue = 50.0;
constexpr double Blood = 400.0;
constexpr double Blur = 0.35; // mm

/// Signed distance to a wall in mm, negative inside.
using Distance = std::function<double(const Vector3&)>;

/// A straight tube with round ends; its radius changes evenly.
Distance Tube(const Vector3& from, const Vector3& to, double radius, double endRadius)
{
  return [=](const Vector3& p)
  {
    const Vector3 axis = to - from;
    const double t = std::clamp((p - from).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
    return (p - from - t * axis).norm() - (radius + t * (endRadius - radius));
  };
}

Distance Tube(const Vector3& from, const Vector3& to, double radius)
{
  return Tube(from, to, radius, radius);
}

/// An image of blood in fat, and what the stages make of it. The tree begins at (2, 0, 0) and runs along x.
struct Scene
{
  ImageGrid grid;
  std::vector<float> values;
  std::vector<float> vesselness;
  VesselSegmentationSettings settings;

  explicit Scene(const std::vector<Distance>& bodies)
  {
    grid.spacing = Vector3(0.5, 0.5, 0.5);
    grid.origin = Vector3(-6.0, -14.0, -12.0);
    grid.extent = { 0, 179, 0, 91, 0, 47 };
    const int nx = 180;
    const int ny = 92;
    values.resize(static_cast<std::size_t>(nx) * ny * 48);
    ParallelFor(static_cast<std::int64_t>(values.size()), 4096,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t p = first; p < last; ++p)
        {
          const Vector3 place = grid.IndexToWorld(
            static_cast<int>(p % nx), static_cast<int>(p / nx % ny), static_cast<int>(p / nx / ny));
          double empty = 1.0;
          for (const Distance& body : bodies)
          {
            empty *= 1.0 - 0.5 * std::erfc(body(place) / (std::sqrt(2.0) * Blur));
          }
          values[static_cast<std::size_t>(p)] =
            static_cast<float>(Fat + (Blood - Fat) * (1.0 - empty));
        }
      });
    Filter();
    settings.window = BloodWindow{ Tissue, Blood };
  }

  void Filter()
  {
    VesselnessSettings frangi;
    frangi.sigmas = VesselnessScales(0.5, 2.5, 5, true);
    frangi.c = 100.0;
    vesselness.resize(values.size());
    MultiscaleVesselness(frangi, grid.spacing, grid.extent)
      .Compute({ values.data(), grid.extent }, grid.extent, nullptr,
        { vesselness.data(), nullptr, nullptr });
  }

  VesselSegmentationResult Run(const VesselSeed& seed = { Vector3(2.0, 0.0, 0.0) }) const
  {
    return SegmentVessels({ values.data(), grid }, vesselness.data(), { seed }, settings);
  }
  /// Voxels of the mask that a condition holds for.
  int Count(const VesselSegmentationResult& result,
    const std::function<bool(const Vector3&)>& condition) const
  {
    int count = 0;
    for (std::size_t p = 0; p < result.mask.size(); ++p)
    {
      const auto v = static_cast<int>(p);
      count +=
        result.mask[p] != 0 && condition(grid.IndexToWorld(v % 180, v / 180 % 92, v / 180 / 92))
        ? 1
        : 0;
    }
    return count;
  }
};

bool Behind(const Vector3& p)
{
  return p[0] > 48.0;
}

TEST(VesselLinking, GoesOnBehindAnOcclusion)
{
  Scene scene({ Tube({ 0, 0, 0 }, { 30, 0, 0 }, 1.4), Tube({ 42, 0, 0 }, { 78, 0, 0 }, 1.4) });
  const VesselSegmentationResult result = scene.Run();
  ASSERT_EQ(result.links.size(), 1U);
  const VesselLink& link = result.links.front();
  EXPECT_GE(link.confidence, 0.7);
  EXPECT_GT(link.unseen, 6.0);
  EXPECT_NEAR(link.length, 12.0, 4.0);
  for (const Vector3& p : link.points)
  {
    EXPECT_LT(std::hypot(p[1], p[2]), 1.0);
  }
  EXPECT_NEAR(link.radiusBefore, 1.4, 0.3);
  EXPECT_NEAR(link.radiusBehind, 1.4, 0.3);
  EXPECT_GT(scene.Count(result, Behind), 1000);

  scene.settings.crossLesions = false;
  const VesselSegmentationResult without = scene.Run();
  EXPECT_TRUE(without.links.empty());
  EXPECT_EQ(scene.Count(without, Behind), 0);
}

TEST(VesselLinking, FollowsTheVesselsBend)
{
  // A circle of 40 mm radius; 14 mm of it are closed.
  const auto at = [](double angle)
  { return Vector3(40.0 * std::sin(angle), 40.0 * (1.0 - std::cos(angle)), 0.0); };
  std::vector<Distance> bodies;
  for (double angle = 0.0; angle < 1.3; angle += 0.02)
  {
    if (angle < 0.5 || angle > 0.85)
    {
      bodies.push_back(Tube(at(angle), at(angle + 0.02), 1.5));
    }
  }
  const VesselSegmentationResult result = Scene(bodies).Run();
  ASSERT_EQ(result.links.size(), 1U);
  for (const Vector3& p : result.links.front().points)
  {
    EXPECT_LT(std::abs((p - Vector3(0.0, 40.0, 0.0)).norm() - 40.0), 1.0);
    EXPECT_LT(std::abs(p[2]), 1.0);
  }
}

TEST(VesselLinking, OneLesionBehindAnother)
{
  // Each round finds the next piece, and what it knows of the one behind holds until it is its turn.
  const Scene scene({ Tube({ 0, 0, 0 }, { 20, 0, 0 }, 1.4), Tube({ 26, 0, 0 }, { 46, 0, 0 }, 1.4),
    Tube({ 52, 0, 0 }, { 78, 0, 0 }, 1.3) });
  SetNumberOfThreads(1);
  const VesselSegmentationResult result = scene.Run();
  SetNumberOfThreads(3);
  const VesselSegmentationResult several = scene.Run();
  SetNumberOfThreads(0);
  ASSERT_EQ(result.links.size(), 2U);
  EXPECT_NEAR(result.links[0].points.front()[0], 20.0, 4.0);
  EXPECT_NEAR(result.links[1].points.front()[0], 46.0, 4.0);
  EXPECT_GT(scene.Count(result, [](const Vector3& p) { return p[0] > 60.0; }), 300);
  EXPECT_EQ(several.mask, result.mask);
  ASSERT_EQ(several.links.size(), 2U);
  for (std::size_t n = 0; n < 2; ++n)
  {
    EXPECT_EQ(several.links[n].voxels, result.links[n].voxels);
    EXPECT_EQ(several.links[n].confidence, result.links[n].confidence);
  }
}

TEST(VesselLinking, AThinLumenIsSeen)
{
  // Blurred so much that a quarter of its contrast is left on its axis.
  const Distance channel = Tube({ 30, 0, 0 }, { 40, 0, 0 }, -0.2);
  const VesselSegmentationResult result =
    Scene({ Tube({ 0, 0, 0 }, { 30, 0, 0 }, 1.4), channel, Tube({ 40, 0, 0 }, { 78, 0, 0 }, 1.4) })
      .Run();
  ASSERT_EQ(result.links.size(), 1U);
  EXPECT_LT(result.links.front().unseen, 0.5 * result.links.front().length);
  EXPECT_GE(result.links.front().confidence, 0.8);
}

TEST(VesselLinking, WhatRunsBesideIsAnother)
{
  const Scene scene(
    { Tube({ 0, 0, 0 }, { 40, 0, 0 }, 1.4), Tube({ 15, 7, 0 }, { 78, 7, 0 }, 1.4) });
  const VesselSegmentationResult result = scene.Run();
  EXPECT_TRUE(result.links.empty());
  EXPECT_EQ(scene.Count(result, [](const Vector3& p) { return p[1] > 4.0; }), 0);
}

TEST(VesselLinking, WhatPointsElsewhereIsAnother)
{
  const Scene scene(
    { Tube({ 0, 0, 0 }, { 30, 0, 0 }, 1.4), Tube({ 44, -10, 0 }, { 44, 28, 0 }, 1.4) });
  const VesselSegmentationResult result = scene.Run();
  EXPECT_TRUE(result.links.empty());
  EXPECT_EQ(scene.Count(result, [](const Vector3& p) { return p[0] > 40.0; }), 0);
}

TEST(VesselLinking, NotThroughAChamber)
{
  const Scene scene({ Tube({ 0, 0, 0 }, { 26, 0, 0 }, 1.4), Tube({ 48, 0, 0 }, { 78, 0, 0 }, 1.4),
    [](const Vector3& p) { return (p - Vector3(37.0, 0.0, 0.0)).norm() - 8.0; } });
  const VesselSegmentationResult result = scene.Run();
  EXPECT_TRUE(result.links.empty());
  EXPECT_EQ(scene.Count(result, Behind), 0);
}

TEST(VesselLinking, VesselsDoNotWidenAwayFromTheHeart)
{
  const auto scene = [](double begin, double end)
  {
    return Scene(
      { Tube({ 0, 0, 0 }, { 30, 0, 0 }, 1.0), Tube({ 38, 0, 0 }, { 80, 0, 0 }, begin, end) })
      .Run()
      .links.size();
  };
  EXPECT_EQ(scene(1.0, 0.7), 1U);
  EXPECT_EQ(scene(0.8, 2.6), 0U);
}

TEST(VesselLinking, NotAcrossMoreThanTheLongestGap)
{
  Scene scene({ Tube({ 0, 0, 0 }, { 30, 0, 0 }, 1.4), Tube({ 42, 0, 0 }, { 78, 0, 0 }, 1.4) });
  scene.settings.longestGap = 8.0;
  EXPECT_TRUE(scene.Run().links.empty());
  scene.settings.longestGap = 50.0;
  EXPECT_THROW(scene.Run(), std::invalid_argument);
}

/// A part of the aorta with its wall at (4, 0, 0).
double Aorta(const Vector3& p)
{
  return (p - Vector3(-6.0, 0.0, 0.0)).norm() - 10.0;
}

TEST(VesselLinking, AVesselWhoseMouthIsHidden)
{
  const VesselSeed ostium{ Vector3(4.0, 0.0, 0.0), Vector3::UnitX() };
  for (const double stump : { 0.0, 3.0 })
  {
    SCOPED_TRACE(stump);
    std::vector<Distance> bodies{ Aorta, Tube({ 15.6, 0, 0 }, { 78, 0, 0 }, 1.6) };
    if (stump > 0.0)
    {
      bodies.push_back(Tube({ 0, 0, 0 }, { 4.0 + stump, 0, 0 }, 1.6));
    }
    Scene scene(bodies);
    const VesselSegmentationResult result = scene.Run(ostium);
    ASSERT_EQ(result.links.size(), 1U);
    const VesselLink& link = result.links.front();
    EXPECT_GE(link.confidence, 0.5);
    EXPECT_LT(link.confidence, 0.99);
    EXPECT_GT(link.unseen, 3.0);
    for (const Vector3& p : link.points)
    {
      EXPECT_LT(std::hypot(p[1], p[2]), 1.0);
      EXPECT_GT(p[0], 3.0);
    }
    EXPECT_LT(link.points.front()[0], 9.0);
    EXPECT_GT(scene.Count(result, Behind), 1000);
    EXPECT_GT(result.seedVolume.front(), 300.0);
    EXPECT_EQ(scene.Count(result, [](const Vector3& p) { return p[0] < 3.0; }), 0);

    scene.settings.crossLesions = false;
    EXPECT_EQ(scene.Count(scene.Run(ostium), Behind), 0);
  }
}

TEST(VesselLinking, AnOstiumWithoutVesselStaysAlone)
{
  const VesselSeed ostium{ Vector3(4.0, 0.0, 0.0), Vector3::UnitX() };
  const VesselSegmentationResult nothing = Scene({ Aorta }).Run(ostium);
  EXPECT_TRUE(nothing.links.empty());
  EXPECT_EQ(nothing.seedVolume.front(), 0.0);
  // One that runs past it, and one farther away than lesions are long.
  const VesselSegmentationResult past =
    Scene({ Aorta, Tube({ 14, -13, 0 }, { 14, 31, 0 }, 1.6) }).Run(ostium);
  EXPECT_TRUE(past.links.empty());
  const VesselSegmentationResult far =
    Scene({ Aorta, Tube({ 36, 0, 0 }, { 78, 0, 0 }, 1.6) }).Run(ostium);
  EXPECT_TRUE(far.links.empty());
}

/// A tube of another value, which may touch the others.
void Draw(Scene& scene, const Distance& tube, double value)
{
  for (std::size_t p = 0; p < scene.values.size(); ++p)
  {
    const auto v = static_cast<int>(p);
    const Vector3 place = scene.grid.IndexToWorld(v % 180, v / 180 % 92, v / 180 / 92);
    const double inside = 0.5 * std::erfc(tube(place) / (std::sqrt(2.0) * Blur));
    scene.values[p] += static_cast<float>(inside * std::max(0.0, value - scene.values[p]));
  }
  scene.Filter();
}

TEST(VesselLinking, ADimVesselBesideALesionIsNotTheWay)
{
  // A branch leaves right before the lesion: the way begins at a wall, not at a tip.
  Scene scene({ Tube({ 0, 0, 0 }, { 30, 0, 0 }, 1.4, 1.2), Tube({ 38.5, 0, 0 }, { 78, 0, 0 }, 1.2),
    Tube({ 27, 0, 0 }, { 40, -20, 0 }, 0.9) });
  Draw(scene, Tube({ 14, 2.5, 0 }, { 64, 2.5, 0 }, 0.9), Fat + 0.45 * (Blood - Fat));
  const VesselSegmentationResult result = scene.Run();
  ASSERT_EQ(result.links.size(), 1U);
  for (const Vector3& p : result.links.front().points)
  {
    EXPECT_LT(std::hypot(p[1], p[2]), 1.0) << p.transpose();
  }
  EXPECT_GT(scene.Count(result, Behind), 1000);
}

CenterlineResult Extract(const Scene& scene)
{
  const VesselSegmentationResult segmentation = scene.Run();
  const ScalarImage image{ scene.values.data(), scene.grid };
  CenterlineInput input;
  input.grid = scene.grid;
  input.speed = scene.vesselness.data();
  input.mask = segmentation.mask.data();
  input.intensity = &image;
  input.seeds = { Vector3(2.0, 0.0, 0.0) };
  return ExtractCenterlines(input, {});
}

bool Reaches(const CenterlineResult& result, const Vector3& place)
{
  return std::any_of(result.tree.points.begin(), result.tree.points.end(),
    [&](const Vector3& p) { return (p - place).norm() < 2.0; });
}

TEST(VeinRejection, WhatCrossesIsLeftOut)
{
  // A vein crosses the artery and touches it; an artery's branch leaves at the same angle.
  for (const double share : { 0.6, 1.0 })
  {
    Scene scene(
      { Tube({ 0, 0, 0 }, { 78, 0, 0 }, 1.6, 1.2), Tube({ 25, 0, 0 }, { 35, 26, 0 }, 1.1, 0.5) });
    Draw(scene, Tube({ 50, -13, 2.6 }, { 56, 30, 2.6 }, 1.3, 1.6), Fat + share * (Blood - Fat));
    const CenterlineResult result = Extract(scene);
    EXPECT_FALSE(result.veins.empty()) << share;
    EXPECT_FALSE(Reaches(result, { 55.0, 21.5, 2.6 })) << share;
    EXPECT_FALSE(Reaches(result, { 50.6, -8.0, 2.6 })) << share;
    EXPECT_TRUE(Reaches(result, { 34.0, 23.4, 0.0 })) << share;
    EXPECT_TRUE(Reaches(result, { 75.0, 0.0, 0.0 })) << share;
    for (const RejectedVein& vein : result.veins)
    {
      EXPECT_GE(vein.probability, 0.5);
      EXPECT_NEAR(vein.position[0], 51.8, 5.0);
      EXPECT_GT(vein.length, 5.0);
    }
  }
}

TEST(VeinRejection, AnArteryStaysWhoseThinEndTouchesAVein)
{
  // The line goes on in the vein, which widens from there on beside the artery: there is no fork between the two.
  Scene scene(
    { Tube({ 0, 0, 0 }, { 80, 0, 0 }, 1.6, 1.4), Tube({ 10, 0, 0 }, { 32, 9, 0 }, 1.2, 0.6),
      Tube({ 20, 0, 0 }, { 32, -12, 0 }, 1.0, 0.6), Tube({ 50, 0, 0 }, { 62, -12, 0 }, 1.0, 0.6) });
  constexpr double dim = Fat + 0.6 * (Blood - Fat);
  Draw(scene, Tube({ 31.5, 8.8, 0 }, { 42, 4.6, 0 }, 0.8, 1.2), dim);
  Draw(scene, Tube({ 42, 4.6, 0 }, { 76, 4.6, 0 }, 1.2, 1.6), dim);
  const CenterlineResult result = Extract(scene);
  ASSERT_EQ(result.veins.size(), 1U);
  EXPECT_LT((result.veins[0].position - Vector3(32, 9, 0)).norm(), 5.0);
  EXPECT_TRUE(Reaches(result, { 28.0, 7.4, 0.0 }));
  EXPECT_FALSE(Reaches(result, { 45.0, 4.6, 0.0 }));
  EXPECT_FALSE(Reaches(result, { 60.0, 4.6, 0.0 }));
}

TEST(VeinRejection, BranchesThatFaceEachOtherStay)
{
  // Both taper to nothing that can be seen, and the artery is thinner behind them.
  const CenterlineResult result = Extract(
    Scene({ Tube({ 0, 0, 0 }, { 38, 0, 0 }, 1.9, 1.7), Tube({ 38, 0, 0 }, { 78, 0, 0 }, 1.3, 0.8),
      Tube({ 38, 0, 0 }, { 38, 28, 0 }, 1.2, 0.5), Tube({ 38, 0, 0 }, { 38, -13, 0 }, 1.2, 0.6) }));
  EXPECT_TRUE(result.veins.empty());
  EXPECT_TRUE(Reaches(result, { 38.0, 25.0, 0.0 }));
  EXPECT_TRUE(Reaches(result, { 38.0, -11.0, 0.0 }));
  EXPECT_TRUE(Reaches(result, { 75.0, 0.0, 0.0 }));
}

TEST(VeinRejection, ARamusStays)
{
  // A main stem parts in three; the outer two leave to opposite sides.
  const CenterlineResult result = Extract(
    Scene({ Tube({ 0, 0, 0 }, { 14, 0, 0 }, 2.2), Tube({ 14, 0, 0 }, { 70, 0, 0 }, 1.2, 0.6),
      Tube({ 14, 0, 0 }, { 22, 28, 0 }, 1.8, 1.2), Tube({ 14, 0, 0 }, { 17, -13, 0 }, 1.6, 1.4) }));
  EXPECT_TRUE(result.veins.empty());
  EXPECT_TRUE(Reaches(result, { 66.0, 0.0, 0.0 }));
  EXPECT_TRUE(Reaches(result, { 21.0, 25.0, 0.0 }));
  EXPECT_TRUE(Reaches(result, { 16.5, -11.0, 0.0 }));
}

TEST(VeinRejection, ABranchThatRunsBesideStays)
{
  const CenterlineResult result = Extract(
    Scene({ Tube({ 0, 0, 0 }, { 80, 0, 0 }, 1.8, 1.2), Tube({ 12, 0, 0 }, { 22, 4.6, 0 }, 1.1, 1.0),
      Tube({ 22, 4.6, 0 }, { 72, 5.6, 0 }, 1.0, 0.5) }));
  EXPECT_TRUE(result.veins.empty());
  EXPECT_TRUE(Reaches(result, { 66.0, 5.5, 0.0 }));
}

TEST(VesselLinking, CenterlinesSayWhatTheyDidNotSee)
{
  const Scene scene(
    { Tube({ 0, 0, 0 }, { 30, 0, 0 }, 1.4), Tube({ 42, 0, 0 }, { 78, 0, 0 }, 1.4) });
  const VesselSegmentationResult segmentation = scene.Run();
  ASSERT_EQ(segmentation.links.size(), 1U);
  const ScalarImage image{ scene.values.data(), scene.grid };
  CenterlineInput input;
  input.grid = scene.grid;
  input.speed = scene.vesselness.data();
  input.mask = segmentation.mask.data();
  input.intensity = &image;
  input.seeds = { Vector3(2.0, 0.0, 0.0) };
  input.bridges.assign(segmentation.links.begin(), segmentation.links.end());
  const VesselTree tree = ExtractCenterlines(input, {}).tree;
  ASSERT_EQ(tree.bridged.size(), tree.points.size());
  ASSERT_EQ(tree.bridgeConfidence.size(), tree.points.size());
  double farthest = 0.0;
  int guessed = 0;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    const double x = tree.points[p][0];
    farthest = std::max(farthest, x);
    EXPECT_LT(std::hypot(tree.points[p][1], tree.points[p][2]), 0.6);
    if (x > 33.0 && x < 39.0)
    {
      EXPECT_EQ(tree.bridged[p], 1) << x;
      ++guessed;
    }
    if (x < 28.0 || x > 44.0)
    {
      EXPECT_EQ(tree.bridged[p], 0) << x;
    }
    if (x < 28.0)
    {
      EXPECT_EQ(tree.bridgeConfidence[p], 1.0);
    }
    if (x > 44.0)
    {
      EXPECT_EQ(tree.bridgeConfidence[p], segmentation.links.front().confidence);
    }
  }
  EXPECT_GT(farthest, 75.0);
  EXPECT_GT(guessed, 10);

  // Who crosses beside the middle of the way does not know more about what lies behind.
  VesselBridge& bridge = input.bridges.front();
  const std::size_t middle = bridge.points.size() / 2;
  for (std::size_t n = middle - 2; n <= middle + 2; ++n)
  {
    bridge.points[n][1] += 5.0;
  }
  const VesselTree beside = ExtractCenterlines(input, {}).tree;
  ASSERT_FALSE(beside.points.empty());
  for (std::size_t p = 0; p < beside.points.size(); ++p)
  {
    if (beside.points[p][0] > 44.0)
    {
      EXPECT_EQ(beside.bridgeConfidence[p], bridge.confidence);
    }
  }
}
}
}
