// Thin branches beside a known vessel, in images in closed form with noise: what is one is followed, and noise, the border
// of a chamber, a plate and a vein are not.

#include "CenterlineExtraction.h"
#include "CounterRandom.h"
#include "ParallelFor.h"
#include "ThinBranches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

namespace UnitTestThinBranches
{
using namespace coronary;

namespace
{
constexpr double Fat = -95.0;
constexpr double Blood = 420.0;
constexpr double Blur = 0.28;       // a sharp kernel's, mm
constexpr double MediumBlur = 0.45; // with 0.4 mm voxels
const Vector3 TrunkStart(0.0, 0.0, -16.0);
const Vector3 TrunkEnd(0.0, 0.0, 16.0);
constexpr double TrunkRadius = 1.4;
const Vector3 BranchStart(0.0, 0.0, -2.0);
const Vector3 BranchEnd(13.0, 2.0, 6.0);

double DistanceToSegment(const Vector3& p, const Vector3& a, const Vector3& b)
{
  const Vector3 d = b - a;
  const double t = std::min(1.0, std::max(0.0, (p - a).dot(d) / d.squaredNorm()));
  return (a + t * d - p).norm();
}

/// How much of a blurred wall at this signed distance is inside.
double Inside(double distance)
{
  return 0.5 * std::erfc(-distance / (std::sqrt(2.0) * Blur));
}

/// A thin tube's centre shows 1 - exp(-r^2 / 2 blur^2) of its contrast.
double TubeShare(
  const Vector3& p, const Vector3& a, const Vector3& b, double radius, double blur = Blur)
{
  const double distance = DistanceToSegment(p, a, b);
  if (radius > 3.0 * blur)
  {
    return Inside(radius - distance);
  }
  const double width = blur * blur + 0.25 * radius * radius;
  return (1.0 - std::exp(-0.5 * radius * radius / (blur * blur))) *
    std::exp(-0.5 * distance * distance / width);
}

struct Scene
{
  ScalarImage image;
  std::vector<float> values;
  VesselTree trunk;

  /// @param add  image value before the trunk is drawn
  explicit Scene(const std::function<double(const Vector3&)>& add, double noise,
    const Vector3& spacing = Vector3::Constant(0.4), std::uint64_t seed = 1)
  {
    ImageGrid& grid = this->image.grid;
    grid.spacing = spacing;
    grid.origin = Vector3(-10.0, -10.0, -18.0);
    const Vector3 size(26.0, 20.0, 36.0);
    for (int axis = 0; axis < 3; ++axis)
    {
      grid.extent[2 * axis] = 0;
      grid.extent[2 * axis + 1] = static_cast<int>(size[axis] / spacing[axis]);
    }
    RandomStream random(seed);
    for (int k = 0; k <= grid.extent[5]; ++k)
    {
      for (int j = 0; j <= grid.extent[3]; ++j)
      {
        for (int i = 0; i <= grid.extent[1]; ++i)
        {
          const Vector3 p = grid.IndexToWorld(i, j, k);
          double value = add(p);
          value += TubeShare(p, TrunkStart, TrunkEnd, TrunkRadius) * (Blood - value);
          this->values.push_back(static_cast<float>(value + noise * random.Normal()));
        }
      }
    }
    this->image.values = static_cast<const float*>(this->values.data());
    VesselTree::Branch branch;
    for (int i = 0; i <= 125; ++i)
    {
      const double z = -15.0 + 0.24 * i;
      branch.points.push_back(static_cast<std::int64_t>(this->trunk.points.size()));
      this->trunk.points.emplace_back(0.0, 0.0, z);
      this->trunk.radius.push_back(TrunkRadius);
    }
    this->trunk.branches.push_back(branch);
  }

  std::vector<ThinBranch> Find() const
  {
    ThinBranchSettings settings;
    settings.voxel = std::cbrt(this->image.grid.spacing.prod());
    settings.contrast = Blood - Fat;
    return FindThinBranches(ImageInterpolator(this->image), this->trunk, settings);
  }
};

double WithBranch(const Vector3& p, double radius, double background)
{
  return background + TubeShare(p, BranchStart, BranchEnd, radius) * (Blood - background);
}
}

TEST(ThinBranches, FollowsATubeOfOneVoxelInNoise)
{
  for (const double noise : { 25.0, 40.0 })
  {
    for (const double background : { Fat, 110.0 })
    {
      SCOPED_TRACE("noise " + std::to_string(noise) + ", in " + std::to_string(background));
      const Scene scene([&](const Vector3& p) { return WithBranch(p, 0.45, background); }, noise);
      const std::vector<ThinBranch> found = scene.Find();
      ASSERT_FALSE(found.empty());
      for (const ThinBranch& branch : found)
      {
        for (const Vector3& p : branch.points)
        {
          EXPECT_LT(DistanceToSegment(p, BranchStart, BranchEnd + 0.1 * (BranchEnd - BranchStart)),
            p == branch.points.front() ? 1.5 * TrunkRadius : 0.65);
        }
      }
      EXPECT_LT((found.front().points.back() - BranchEnd).norm(), 2.5);
      EXPECT_GT(found.front().significance, 12.0);
      EXPECT_GT(found.front().length, 10.0);
    }
  }
}

TEST(ThinBranches, OtherVoxels)
{
  for (const Vector3& spacing : { Vector3(0.35, 0.35, 0.5), Vector3(0.5, 0.5, 0.5) })
  {
    const Scene scene([](const Vector3& p) { return WithBranch(p, 0.5, Fat); }, 25.0, spacing);
    const std::vector<ThinBranch> found = scene.Find();
    ASSERT_FALSE(found.empty());
    EXPECT_LT((found.front().points.back() - BranchEnd).norm(), 3.0);
  }
}

TEST(ThinBranches, NothingInNoise)
{
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
  {
    for (const double noise : { 25.0, 60.0 })
    {
      const Scene scene([](const Vector3&) { return Fat; }, noise, Vector3::Constant(0.4), seed);
      EXPECT_TRUE(scene.Find().empty());
    }
  }
}

TEST(ThinBranches, NoBorderOfAChamber)
{
  // A chamber beside the trunk whose border runs away from it, and fat against muscle.
  const Vector3 normal = Vector3(0.5, 1.0, 0.2).normalized();
  for (const double inside : { Blood, 200.0 })
  {
    const Scene scene([&](const Vector3& p)
      { return Fat + (inside - Fat) * Inside((p - Vector3(0.0, 1.6, 0.0)).dot(normal)); },
      25.0);
    EXPECT_TRUE(scene.Find().empty());
  }
}

TEST(ThinBranches, NoPlate)
{
  // A thin wall of muscle between fat and fat that comes out of the trunk.
  const Scene scene(
    [](const Vector3& p) { return Fat + 300.0 * Inside(0.5 - std::abs(p[1])); }, 25.0);
  EXPECT_TRUE(scene.Find().empty());
}

TEST(ThinBranches, NoVeinBeside)
{
  const Scene scene([](const Vector3& p)
    { return Fat + 245.0 * TubeShare(p, Vector3(3.6, 0.5, -16.0), Vector3(3.2, -0.5, 16.0), 0.8); },
    25.0);
  EXPECT_TRUE(scene.Find().empty());
}

TEST(ThinBranches, NoTubeThatIsNotConnected)
{
  const Vector3 start = BranchStart + 0.3 * (BranchEnd - BranchStart);
  const Scene scene(
    [&](const Vector3& p) { return Fat + 515.0 * TubeShare(p, start, BranchEnd, 0.45); }, 25.0);
  EXPECT_TRUE(scene.Find().empty());
}

TEST(ThinBranches, SameOnAnyNumberOfThreads)
{
  const Scene scene([](const Vector3& p) { return WithBranch(p, 0.45, Fat); }, 25.0);
  SetNumberOfThreads(1);
  const std::vector<ThinBranch> one = scene.Find();
  SetNumberOfThreads(3);
  const std::vector<ThinBranch> three = scene.Find();
  SetNumberOfThreads(0);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t b = 0; b < one.size(); ++b)
  {
    EXPECT_EQ(one[b].points, three[b].points);
    EXPECT_EQ(one[b].parent, three[b].parent);
    EXPECT_EQ(one[b].significance, three[b].significance);
  }
}

/// A tree of the trunk and the first `known` mm of the branch.
VesselTree TreeWithTip(const Scene& scene, double known)
{
  VesselTree tree = scene.trunk;
  const Vector3 direction = (BranchEnd - BranchStart).normalized();
  VesselTree::Branch branch;
  branch.groupId = 1;
  branch.parentGroupId = 0;
  for (int i = 0; 2.0 + 0.24 * i <= known; ++i)
  {
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.emplace_back(BranchStart + (2.0 + 0.24 * i) * direction);
    tree.radius.push_back(0.5);
  }
  tree.branches.push_back(branch);
  return tree;
}

std::vector<Vector3> FollowTip(const Scene& scene, const VesselTree& tree)
{
  ThinBranchSettings settings;
  settings.voxel = 0.4;
  settings.contrast = Blood - Fat;
  return FollowTips(ImageInterpolator(scene.image), tree, settings).at(1).points;
}

TEST(ThinBranches, TipsGoOnToTheEndOfTheVessel)
{
  const double length = (BranchEnd - BranchStart).norm();
  for (const double background : { Fat, 110.0 })
  {
    for (const double radius : { 0.4, 0.5 })
    {
      for (const double known : { 6.0, length - 3.0, length - 1.5 })
      {
        SCOPED_TRACE("r " + std::to_string(radius) + ", in " + std::to_string(background) +
          ", known " + std::to_string(known));
        const Scene scene(
          [&](const Vector3& p) { return WithBranch(p, radius, background); }, 25.0);
        const VesselTree tree = TreeWithTip(scene, known);
        const std::vector<Vector3> path = FollowTip(scene, tree);
        ASSERT_FALSE(path.empty());
        EXPECT_LT((path.front() - tree.points.back()).norm(), 1.4);
        EXPECT_LT((path.back() - BranchEnd).norm(), 0.8);
        for (const Vector3& p : path)
        {
          EXPECT_LT(DistanceToSegment(p, BranchStart, BranchEnd), 0.8);
        }
      }
    }
  }
}

TEST(ThinBranches, TipsOfTaperingVesselsGoOnInABlurredImage)
{
  // From 0.65 to 0.35 mm: what it shows falls to half by and by. A mask ends where that is half of what is before, and
  // more than 30 voxels are left.
  const Vector3 way = BranchEnd - BranchStart;
  for (const double background : { Fat, 110.0 })
  {
    for (std::uint64_t seed = 1; seed <= 3; ++seed)
    {
      SCOPED_TRACE("in " + std::to_string(background) + ", seed " + std::to_string(seed));
      const Scene scene(
        [&](const Vector3& p)
        {
          const double along = std::clamp((p - BranchStart).dot(way) / way.squaredNorm(), 0.0, 1.0);
          return background +
            TubeShare(p, BranchStart, BranchEnd, 0.65 - 0.3 * along, MediumBlur) *
            (Blood - background);
        },
        25.0, Vector3::Constant(0.4), seed);
      const VesselTree tree = TreeWithTip(scene, 3.2);
      const std::vector<Vector3> path = FollowTip(scene, tree);
      ASSERT_FALSE(path.empty());
      EXPECT_LT((path.back() - BranchEnd).norm(), 1.2);
    }
  }
}

TEST(ThinBranches, OnlyBesideTheGivenPartOfTheTree)
{
  const Scene scene([](const Vector3& p) { return WithBranch(p, 0.45, Fat); }, 25.0);
  ThinBranchSettings settings;
  settings.voxel = 0.4;
  settings.contrast = Blood - Fat;
  const ImageInterpolator image(scene.image);
  // The branch leaves at z = -2 mm, point 54 of the trunk.
  EXPECT_FALSE(FindThinBranches(image, scene.trunk, settings, 40).empty());
  EXPECT_TRUE(FindThinBranches(image, scene.trunk, settings, 90).empty());
}

TEST(ThinBranches, ASectionIsHeldAgainstWhatTheBlurLeavesOfIt)
{
  // A lumen of 0.4 mm in muscle shows a third of its contrast, which is less than two thirds of the great vessels'.
  const Scene scene([](const Vector3& p)
    { return 110.0 + TubeShare(p, BranchStart, BranchEnd, 0.4, MediumBlur) * (Blood - 110.0); },
    0.0);
  const ImageInterpolator image(scene.image);
  const Vector3 middle = 0.5 * (BranchStart + BranchEnd);
  LumenSettings settings;
  settings.reference = { Blood, Fat, TrunkRadius };
  const auto confidence = [&]
  {
    return MeasureLumen(image, middle, (BranchEnd - BranchStart).normalized(), 0.4, settings)
      .confidence;
  };
  EXPECT_LT(confidence(), 0.7);
  settings.blur = MediumBlur;
  EXPECT_GT(confidence(), 0.9);
  // Muscle alone is none.
  EXPECT_LT(
    MeasureLumen(image, Vector3(6.0, -7.0, 0.0), Vector3::UnitZ(), 0.4, settings).confidence, 0.1);
}

TEST(ThinBranches, TipsEndWhereTheVesselDoes)
{
  for (std::uint64_t seed = 1; seed <= 8; ++seed)
  {
    for (const double background : { Fat, 110.0 })
    {
      const Scene scene([&](const Vector3& p) { return WithBranch(p, 0.5, background); }, 40.0,
        Vector3::Constant(0.4), seed);
      const VesselTree tree = TreeWithTip(scene, (BranchEnd - BranchStart).norm());
      for (const Vector3& p : FollowTip(scene, tree))
      {
        EXPECT_LT((p - BranchEnd).norm(), 1.2) << "seed " << seed << " in " << background;
      }
    }
  }
}

TEST(ThinBranches, TipsDoNotGoOnIntoAnotherVessel)
{
  // It ends in the lumen of a third one: a loop, or a vein, but no tip.
  const Vector3 across(0.0, 6.0, 0.0);
  const Scene scene(
    [&](const Vector3& p)
    {
      const double thin = WithBranch(p, 0.5, Fat);
      return thin + TubeShare(p, BranchEnd - across, BranchEnd + across, 1.2) * (Blood - thin);
    },
    25.0);
  VesselTree tree = TreeWithTip(scene, 9.0);
  VesselTree::Branch other;
  other.groupId = 2;
  for (int i = -25; i <= 25; ++i)
  {
    other.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.emplace_back(BranchEnd + 0.04 * i * across);
    tree.radius.push_back(1.2);
  }
  tree.branches.push_back(other);
  EXPECT_TRUE(FollowTip(scene, tree).empty());
}

TEST(ThinBranches, MeasuresTheNoise)
{
  // Interpolation averages: less than in the voxels, and in proportion.
  const auto flat = [](const Vector3&) { return Fat; };
  const Scene quiet(flat, 10.0);
  const Scene loud(flat, 40.0);
  const double low = MeasureNoise(ImageInterpolator(quiet.image), quiet.trunk, 0.4);
  const double high = MeasureNoise(ImageInterpolator(loud.image), loud.trunk, 0.4);
  EXPECT_GT(low, 4.0);
  EXPECT_LT(low, 10.0);
  EXPECT_NEAR(high / low, 4.0, 0.2);
}

TEST(ThinBranches, LearnsWhatNoiseShows)
{
  const auto flat = [](const Vector3&) { return Fat; };
  const auto learned = [](const Scene& scene)
  {
    ThinBranchSettings settings;
    settings.contrast = Blood - Fat;
    return LearnNoisePaths(ImageInterpolator(scene.image), scene.trunk, settings);
  };
  const NoisePaths low = learned(Scene(flat, 10.0));
  const NoisePaths high = learned(Scene(flat, 40.0));
  EXPECT_GT(low.contrast, 1.0);
  EXPECT_LT(low.contrast, 10.0);
  // About in proportion, few paths are tried here; and bright vessels do not count.
  EXPECT_NEAR(high.contrast / low.contrast, 4.0, 2.0);
  EXPECT_NEAR(high.spread / low.spread, 4.0, 2.0);
  const NoisePaths beside =
    learned(Scene([](const Vector3& p) { return WithBranch(p, 0.45, Fat); }, 40.0));
  EXPECT_NEAR(beside.contrast / high.contrast, 1.0, 0.3);
  const NoisePaths none = learned(Scene(flat, 0.0));
  EXPECT_LT(none.contrast, 1e-3);
}

TEST(ThinBranches, SettingsOutOfRangeAreNamed)
{
  const Scene scene([](const Vector3&) { return Fat; }, 25.0);
  const ImageInterpolator image(scene.image);
  const auto message = [&](const std::function<void(ThinBranchSettings&)>& spoil)
  {
    ThinBranchSettings settings;
    spoil(settings);
    try
    {
      FindThinBranches(image, scene.trunk, settings);
    }
    catch (const std::invalid_argument& error)
    {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(message([](ThinBranchSettings& s) { s.voxel = 0.0; }).find("voxel"), std::string::npos);
  EXPECT_NE(message([](ThinBranchSettings& s) { s.minimumLength = 0.0; }).find("minimumLength"),
    std::string::npos);
  EXPECT_NE(message([](ThinBranchSettings& s) { s.maximumLength = 1.0; }).find("maximumLength"),
    std::string::npos);
  EXPECT_NE(
    message([](ThinBranchSettings& s) { s.contrast = 0.0; }).find("contrast"), std::string::npos);
  EXPECT_TRUE(message([](ThinBranchSettings&) {}).empty());
}

TEST(ThinBranches, ExtractionFollowsThemOutsideOfTheMask)
{
  const Scene scene([](const Vector3& p) { return WithBranch(p, 0.45, Fat); }, 25.0);
  const ImageGrid& grid = scene.image.grid;
  std::vector<unsigned char> mask;
  std::vector<float> speed;
  for (int k = 0; k <= grid.extent[5]; ++k)
  {
    for (int j = 0; j <= grid.extent[3]; ++j)
    {
      for (int i = 0; i <= grid.extent[1]; ++i)
      {
        const double distance = DistanceToSegment(grid.IndexToWorld(i, j, k), TrunkStart, TrunkEnd);
        mask.push_back(distance < TrunkRadius ? 1 : 0);
        speed.push_back(static_cast<float>(std::exp(-distance * distance)));
      }
    }
  }
  CenterlineInput input;
  input.grid = grid;
  input.speed = speed.data();
  input.mask = mask.data();
  input.intensity = &scene.image;
  input.seeds = { Vector3(0.0, 0.0, -14.0) };
  CenterlineSettings settings;
  const CenterlineResult with = ExtractCenterlines(input, settings);
  settings.thinBranches = false;
  const CenterlineResult without = ExtractCenterlines(input, settings);
  EXPECT_EQ(without.tree.branches.size(), 1U);
  ASSERT_EQ(with.bifurcations.size(), 1U);
  EXPECT_LT(
    (with.tree.points[static_cast<std::size_t>(with.bifurcations[0].point)] - BranchStart).norm(),
    1.0);
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vector3& p : with.tree.points)
  {
    nearest = std::min(nearest, (p - BranchEnd).norm());
  }
  EXPECT_LT(nearest, 2.5);
}
}
