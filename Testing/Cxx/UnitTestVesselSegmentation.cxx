// Segmentation of tubes with known walls, attached to bodies that must not be taken for vessels, and
// of the phantom.

#include "CoronaryPhantom.h"
#include "MultiscaleVesselness.h"
#include "VesselSegmentation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>

namespace UnitTestVesselSegmentation
{
using namespace coronary;

namespace
{
constexpr double Tissue = 50.0;
constexpr double Blood = 400.0;
constexpr double Blur = 0.4; // mm, standard deviation of a wall's profile

/// Signed distance to a wall in mm, negative inside.
using Distance = std::function<double(const Vector3&)>;

/// Image, vesselness and what the segmentation is told.
struct Case
{
  ImageGrid grid;
  std::vector<float> values;
  std::vector<float> vesselness;
  std::vector<VesselSeed> seeds;
  VesselSegmentationSettings settings;

  std::array<int, 3> Size() const { return ScalarImage{ values.data(), grid }.Dimensions(); }
  Vector3 World(std::size_t p) const
  {
    const std::array<int, 3> n = Size();
    const auto v = static_cast<std::int64_t>(p);
    return grid.IndexToWorld(static_cast<double>(grid.extent[0] + v % n[0]),
      static_cast<double>(grid.extent[2] + v / n[0] % n[1]),
      static_cast<double>(grid.extent[4] + v / n[0] / n[1]));
  }
  double VoxelVolume() const { return grid.spacing.prod(); }

  void Fill(const std::function<double(const Vector3&)>& intensity)
  {
    const std::array<int, 3> n = Size();
    values.resize(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
    ParallelFor(static_cast<std::int64_t>(values.size()), 4096,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t p = first; p < last; ++p)
        {
          values[p] = static_cast<float>(intensity(World(static_cast<std::size_t>(p))));
        }
      });
  }
  void Filter()
  {
    VesselnessSettings frangi;
    frangi.sigmas = { 0.6, 1.0, 1.6, 2.4 };
    frangi.c = 100.0;
    vesselness.resize(values.size());
    MultiscaleVesselness(frangi, grid.spacing, grid.extent)
      .Compute({ values.data(), grid.extent }, grid.extent, nullptr,
        { vesselness.data(), nullptr, nullptr });
  }
  VesselSegmentationResult Run(
    bool probability = false, const ProgressCallback& progress = {}) const
  {
    return SegmentVessels(
      { values.data(), grid }, vesselness.data(), seeds, settings, probability, progress);
  }
  double Volume(const VesselSegmentationResult& result,
    const std::function<bool(const Vector3&)>& counts = {}) const
  {
    std::size_t voxels = 0;
    for (std::size_t p = 0; p < result.mask.size(); ++p)
    {
      voxels += result.mask[p] != 0 && (!counts || counts(World(p))) ? 1 : 0;
    }
    return static_cast<double>(voxels) * VoxelVolume();
  }
};

/// A quarter circle of 20 mm radius in the world's x-y plane, from the origin along +x, in a tube
/// with a round end; at its beginning a ball as large as an aorta.
struct BentTube
{
  static constexpr double Bend = 20.0;  // mm
  static constexpr double Angle = 1.7;  // radians
  static constexpr double Aorta = 11.0; // mm
  double radius;

  static Vector3 Axis(double angle)
  {
    return { Bend * std::sin(angle), Bend * (1.0 - std::cos(angle)), 0.0 };
  }
  static Vector3 Tangent(double angle) { return { std::cos(angle), std::sin(angle), 0.0 }; }
  /// radians along the arc, limited to the tube; it begins inside the ball
  static double Along(const Vector3& p)
  {
    return std::clamp(std::atan2(p[0], Bend - p[1]), -0.3, Angle);
  }
  double Tube(const Vector3& p) const { return (p - Axis(Along(p))).norm() - radius; }
  static double Ball(const Vector3& p) { return (p - Vector3(-Aorta, 0.0, 0.0)).norm() - Aorta; }
  double Length() const { return Bend * Angle; }
  /// From the ball on, with the round end.
  double Volume() const
  {
    return M_PI * radius * radius * Length() + 2.0 / 3.0 * M_PI * std::pow(radius, 3);
  }
};

double Profile(double distance)
{
  return 0.5 * std::erfc(distance / (std::sqrt(2.0) * Blur));
}

/// Blood in the union of bodies.
std::function<double(const Vector3&)> Union(const std::vector<Distance>& bodies)
{
  return [bodies](const Vector3& p)
  {
    double empty = 1.0;
    for (const Distance& body : bodies)
    {
      empty *= 1.0 - Profile(body(p));
    }
    return Tissue + (Blood - Tissue) * (1.0 - empty);
  };
}

/// Oblique, anisotropic, extent not from 0, far from the origin.
ImageGrid Oblique(const Vector3& spacing = Vector3(0.45, 0.5, 0.6))
{
  ImageGrid grid;
  grid.spacing = spacing;
  grid.direction = Eigen::AngleAxisd(0.5, Vector3(1.0, -2.0, 3.0).normalized()).matrix();
  // Around what lies between -8 and 24 mm in x and y, and -8 and 8 mm in z.
  const Vector3 low(-13.0, -8.0, -9.0);
  const Vector3 high(28.0, 32.0, 9.0);
  Vector3 minimum = Vector3::Constant(std::numeric_limits<double>::max());
  Vector3 most = -minimum;
  for (int corner = 0; corner < 8; ++corner)
  {
    const Vector3 p(
      (corner & 1 ? high : low)[0], (corner & 2 ? high : low)[1], (corner & 4 ? high : low)[2]);
    const Vector3 local = grid.direction.transpose() * p;
    minimum = minimum.cwiseMin(local);
    most = most.cwiseMax(local);
  }
  const int first[3] = { 7, -30, 100 };
  Vector3 start;
  for (int axis = 0; axis < 3; ++axis)
  {
    grid.extent[2 * axis] = first[axis];
    grid.extent[2 * axis + 1] =
      first[axis] + static_cast<int>((most[axis] - minimum[axis]) / spacing[axis]);
    start[axis] = minimum[axis] - first[axis] * spacing[axis];
  }
  grid.origin = grid.direction * start;
  return grid;
}

Case MakeCase(const std::vector<Distance>& bodies, const ImageGrid& grid = Oblique())
{
  Case made;
  made.grid = grid;
  made.Fill(Union(bodies));
  made.Filter();
  made.seeds = { { Vector3::Zero(), Vector3::UnitX() } };
  return made;
}

/// The tube on the ball. Made once: most cases change only settings or a few voxels.
const Case& Plain()
{
  static const Case plain = []
  {
    const BentTube tube{ 1.8 };
    return MakeCase({ [=](const Vector3& p) { return tube.Tube(p); }, BentTube::Ball });
  }();
  return plain;
}

/// Past the ostium, where the definition of where the vessel begins does not matter.
bool InTube(const Vector3& p)
{
  return BentTube::Ball(p) > 1.0;
}

std::string MessageOf(const std::function<void()>& action)
{
  try
  {
    action();
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "no exception";
}

double Dice(const std::vector<unsigned char>& a, const std::vector<unsigned char>& b)
{
  std::size_t both = 0;
  std::size_t sum = 0;
  for (std::size_t p = 0; p < a.size(); ++p)
  {
    both += a[p] && b[p] ? 1 : 0;
    sum += (a[p] ? 1 : 0) + (b[p] ? 1 : 0);
  }
  return 2.0 * static_cast<double>(both) / static_cast<double>(std::max<std::size_t>(1, sum));
}
}

TEST(VesselSegmentation, BentTubesHaveTheirVolumeAndWall)
{
  for (const double radius : { 1.0, 1.5, 2.2, 3.2 })
  {
    const BentTube tube{ radius };
    const Case image = MakeCase({ [=](const Vector3& p) { return tube.Tube(p); }, BentTube::Ball });
    const VesselSegmentationResult result = image.Run(true);
    // Few per cent; for the thinnest, what a tenth of a voxel in the wall's place makes.
    EXPECT_NEAR(
      image.Volume(result), tube.Volume(), std::max(0.05, 2.0 * 0.05 / radius) * tube.Volume())
      << radius;
    EXPECT_GT(result.seedVolume.at(0), 0.5 * tube.Volume());
    EXPECT_EQ(result.leakageVolume, 0.0);
    EXPECT_NEAR(result.window.blood, Blood, 0.03 * Blood);
    EXPECT_NEAR(result.window.tissue, Tissue, 20.0);

    // Nothing of the ball, nothing beside the tube; the wall, from the probability, is at its place.
    double sum = 0.0;
    int crossings = 0;
    for (std::size_t p = 0; p < result.mask.size(); ++p)
    {
      const Vector3 at = image.World(p);
      if (result.mask[p])
      {
        ASSERT_TRUE(BentTube::Ball(at) > -1.0 && tube.Tube(at) < 0.6)
          << radius << ": " << at.transpose();
      }
      ASSERT_EQ(result.mask[p] != 0, result.probability[p] >= 0.5f);
      ASSERT_TRUE(result.probability[p] >= 0.0f && result.probability[p] <= 1.0f);
      if (p + 1 < result.mask.size() && result.mask[p] != result.mask[p + 1] && InTube(at) &&
        std::abs(tube.Tube(at)) < 1.0)
      {
        const double f = (0.5 - result.probability[p]) /
          (static_cast<double>(result.probability[p + 1]) - result.probability[p]);
        sum += tube.Tube((1.0 - f) * at + f * image.World(p + 1));
        ++crossings;
      }
    }
    ASSERT_GT(crossings, 100);
    EXPECT_NEAR(sum / crossings, 0.0, 0.1) << radius;
  }
}

TEST(VesselSegmentation, ThickSlices)
{
  const BentTube tube{ 2.5 };
  const Case image = MakeCase({ [=](const Vector3& p) { return tube.Tube(p); }, BentTube::Ball },
    Oblique(Vector3(0.5, 0.5, 2.0)));
  const VesselSegmentationResult result = image.Run();
  EXPECT_NEAR(image.Volume(result), tube.Volume(), 0.12 * tube.Volume());
  for (std::size_t p = 0; p < result.mask.size(); ++p)
  {
    if (result.mask[p])
    {
      ASSERT_LT(tube.Tube(image.World(p)), 1.5);
    }
  }
}

TEST(VesselSegmentation, AChamberAtTheFarEndIsCutOff)
{
  // A ball, which is a large body; and a flat chamber, into which no large ball fits.
  const BentTube tube{ 1.8 };
  const Vector3 end = BentTube::Axis(BentTube::Angle);
  const Vector3 onwards = BentTube::Tangent(BentTube::Angle);
  const Distance ball = [=](const Vector3& p) { return (p - end - 6.0 * onwards).norm() - 7.0; };
  const Distance flat = [=](const Vector3& p)
  {
    const Vector3 d = p - end - 10.0 * onwards;
    return std::max({ std::abs(d[2]) - 3.0, std::abs(d[0]) - 9.0, std::abs(d[1]) - 9.0 });
  };
  for (const bool round : { true, false })
  {
    const Distance& chamber = round ? ball : flat;
    const Case image =
      MakeCase({ [=](const Vector3& p) { return tube.Tube(p); }, BentTube::Ball, chamber });
    const VesselSegmentationResult result = image.Run();
    // The flat one is cut where the front in it is wider than any vessel: after some 6 mm.
    EXPECT_LT(image.Volume(result, [&](const Vector3& p) { return chamber(p) < -1.0; }),
      round ? 5.0 : 300.0);
    EXPECT_EQ(
      image.Volume(result, [&](const Vector3& p) { return (p - end).dot(onwards) > 8.0; }), 0.0);
    // The tube before it stays.
    const auto before = [&](const Vector3& p) { return InTube(p) && chamber(p) > 4.0; };
    const Case& plain = Plain();
    EXPECT_NEAR(
      image.Volume(result, before), plain.Volume(plain.Run(), before), 0.04 * tube.Volume())
      << round;
    if (!round)
    {
      EXPECT_GT(result.leakageVolume, 500.0);
    }
  }
}

TEST(VesselSegmentation, ADimChamberInMuchNoiseIsNoVessel)
{
  // As dim as a right ventricle, so noisy that a quarter of its voxels look like vessel and hang together. At its rim, where
  // means are less, some do.
  const BentTube tube{ 1.8 };
  const Distance chamber = [](const Vector3& p)
  { return (p - Vector3(20.6, 0.0, 0.0)).norm() - 7.5; };
  ASSERT_LT(chamber(BentTube::Axis(0.8)), 1.8);
  const Distance wall = [=](const Vector3& p) { return tube.Tube(p); };
  Case image;
  image.grid = Oblique();
  image.Fill(
    [&](const Vector3& p)
    {
      return std::max(
        Union({ wall, BentTube::Ball })(p), Tissue + 0.4 * (Blood - Tissue) * Profile(chamber(p)));
    });
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0.0F, 0.17F * static_cast<float>(Blood - Tissue));
  for (float& value : image.values)
  {
    value += noise(random);
  }
  image.Filter();
  image.seeds = { { Vector3::Zero(), Vector3::UnitX() } };
  image.settings.window = BloodWindow{ Tissue, Blood };
  const VesselSegmentationResult result = image.Run();
  const double inside =
    image.Volume(result, [&](const Vector3& p) { return chamber(p) < -2.5 && wall(p) > 1.0; });
  EXPECT_LT(inside, 0.03 * 4.0 / 3.0 * M_PI * std::pow(5.0, 3));
  EXPECT_NEAR(image.Volume(result, [&](const Vector3& p) { return InTube(p) && wall(p) < 0.5; }),
    tube.Volume(), 0.15 * tube.Volume());
}

TEST(VesselSegmentation, HolesAreFilledOrNot)
{
  const BentTube tube{ 3.2 };
  const Vector3 centre = BentTube::Axis(0.8);
  const auto inclusion = [&](const Vector3& p) { return (p - centre).norm() - 1.3; };
  Case image = MakeCase({ [=](const Vector3& p) { return tube.Tube(p); }, BentTube::Ball });
  image.Fill(
    [&](const Vector3& p)
    {
      return Tissue +
        (Union({ [&](const Vector3& q) { return tube.Tube(q); }, BentTube::Ball })(p) - Tissue) *
        (1.0 - Profile(inclusion(p)));
    });
  const auto inside = [&](const Vector3& p) { return inclusion(p) < -0.5; };
  const double whole = [&]
  {
    VesselSegmentationResult all;
    all.mask.assign(image.values.size(), 1);
    return image.Volume(all, inside);
  }();
  ASSERT_GT(whole, 1.0);
  VesselSegmentationResult result = image.Run(true);
  EXPECT_EQ(image.Volume(result, inside), whole);
  EXPECT_NEAR(image.Volume(result), tube.Volume(), 0.05 * tube.Volume());
  for (std::size_t p = 0; p < result.mask.size(); ++p)
  {
    ASSERT_EQ(result.mask[p] != 0, result.probability[p] >= 0.5f);
  }
  image.settings.fillHoles = false;
  EXPECT_EQ(image.Volume(image.Run(), inside), 0.0);
}

TEST(VesselSegmentation, IslandsAreDropped)
{
  // A second seed is in a bead of 14 mm^3 that touches nothing.
  const BentTube tube{ 1.8 };
  const Vector3 centre(8.0, 18.0, 0.0);
  const Distance bead = [=](const Vector3& p) { return (p - centre).norm() - 1.5; };
  Case image = MakeCase({ [=](const Vector3& p) { return tube.Tube(p); }, BentTube::Ball, bead });
  image.seeds.push_back({ centre, Vector3::Zero() });
  const auto inBead = [&](const Vector3& p) { return bead(p) < 2.0; };
  const VesselSegmentationResult both = image.Run();
  EXPECT_NEAR(image.Volume(both, inBead), 14.1, 3.0);
  EXPECT_NEAR(both.seedVolume.at(1), 14.1, 6.0);
  image.settings.minimumIslandVolume = 30.0;
  const VesselSegmentationResult large = image.Run(true);
  EXPECT_EQ(image.Volume(large, inBead), 0.0);
  EXPECT_EQ(image.Volume(large), image.Volume(both) - image.Volume(both, inBead));
  for (std::size_t p = 0; p < large.mask.size(); ++p)
  {
    ASSERT_EQ(large.mask[p] != 0, large.probability[p] >= 0.5f);
  }
}

TEST(VesselSegmentation, WindowIsMeasuredOrGiven)
{
  Case image = Plain();
  const VesselSegmentationResult measured = image.Run();
  image.settings.window = BloodWindow{ Tissue, Blood };
  image.settings.tubular = measured.tubular;
  const VesselSegmentationResult given = image.Run();
  EXPECT_EQ(given.window.blood, Blood);
  EXPECT_EQ(given.window.tissue, Tissue);
  EXPECT_EQ(given.tubular, measured.tubular);
  EXPECT_GT(Dice(measured.mask, given.mask), 0.99);
  // Other units of the image, with their window: the same vessel.
  for (float& value : image.values)
  {
    value = 1024.0f + 4.0f * value;
  }
  image.settings.window = BloodWindow{ 1024.0 + 4.0 * Tissue, 1024.0 + 4.0 * Blood };
  EXPECT_GT(Dice(image.Run().mask, given.mask), 0.9999);
}

TEST(VesselSegmentation, SeedsWithAndWithoutAxis)
{
  const BentTube tube{ 1.8 };
  Case image = Plain();
  const std::vector<unsigned char> usual = image.Run().mask;

  // The length of an axis says nothing.
  image.seeds = { { Vector3::Zero(), 7.0 * Vector3::UnitX() } };
  EXPECT_EQ(image.Run().mask, usual);

  // Without an axis: on the wall and in the vessel.
  for (const double angle : { 0.02, 0.8, 1.5 })
  {
    image.seeds = { { BentTube::Axis(angle), Vector3::Zero() } };
    const VesselSegmentationResult result = image.Run();
    EXPECT_NEAR(image.Volume(result, InTube),
      M_PI * tube.radius * tube.radius * (tube.Length() - 1.2), 0.06 * tube.Volume())
      << angle;
    // Of the ball at most what is right at the seed.
    EXPECT_LT(image.Volume(result, [](const Vector3& p) { return BentTube::Ball(p) < -0.5; }),
      angle < 0.1 ? 20.0 : 5.0)
      << angle;
  }

  // With an axis nothing behind the seed.
  image.seeds = { { BentTube::Axis(0.8), BentTube::Tangent(0.8) } };
  EXPECT_NEAR(image.Volume(image.Run()),
    M_PI * tube.radius * tube.radius * BentTube::Bend * (BentTube::Angle - 0.8), 25.0);

  // A seed where nothing is.
  image.seeds = { { Vector3::Zero(), Vector3::UnitX() }, { Vector3(5.0, 20.0, 0.0), {} } };
  image.settings.window = BloodWindow{ Tissue, Blood };
  const VesselSegmentationResult result = image.Run();
  EXPECT_GT(result.seedVolume.at(0), 200.0);
  EXPECT_EQ(result.seedVolume.at(1), 0.0);
  EXPECT_GT(Dice(result.mask, usual), 0.99);
}

TEST(VesselSegmentation, PathIsLimited)
{
  Case image = Plain();
  image.settings.longestPath = 15.0;
  const VesselSegmentationResult result = image.Run();
  // Chamfer paths are up to a tenth longer than the axis; the seed is a ball of 2 mm.
  EXPECT_NEAR(image.Volume(result) / (M_PI * 1.8 * 1.8), 16.0, 2.5);
  EXPECT_EQ(image.Volume(
              result, [](const Vector3& p) { return BentTube::Bend * BentTube::Along(p) > 19.0; }),
    0.0);
}

TEST(VesselSegmentation, WithoutRefinementTheProbabilityStillAgrees)
{
  Case image = Plain();
  image.settings.refineWall = false;
  const VesselSegmentationResult plain = image.Run();
  const VesselSegmentationResult result = image.Run(true);
  EXPECT_TRUE(plain.probability.empty());
  EXPECT_EQ(plain.mask, result.mask);
  ASSERT_EQ(result.probability.size(), result.mask.size());
  for (std::size_t p = 0; p < result.mask.size(); ++p)
  {
    ASSERT_EQ(result.mask[p] != 0, result.probability[p] >= 0.5f);
  }
  EXPECT_GT(Dice(result.mask, Plain().Run().mask), 0.8);
}

TEST(VesselSegmentation, SameResultForAllTypesOfVoxels)
{
  Case image = Plain();
  std::vector<std::int16_t> shorts;
  std::vector<std::uint16_t> unsignedShorts;
  for (float& value : image.values)
  {
    value = std::round(value);
    shorts.push_back(static_cast<std::int16_t>(value));
    unsignedShorts.push_back(static_cast<std::uint16_t>(value));
  }
  const VesselSegmentationResult floats = image.Run(true);
  const auto same = [&](const ScalarImage& other)
  {
    const VesselSegmentationResult result =
      SegmentVessels(other, image.vesselness.data(), image.seeds, image.settings, true);
    EXPECT_EQ(result.mask, floats.mask);
    EXPECT_EQ(result.probability, floats.probability);
    EXPECT_EQ(result.window.blood, floats.window.blood);
  };
  same({ shorts.data(), image.grid });
  same({ unsignedShorts.data(), image.grid });
  EXPECT_GT(Dice(floats.mask, Plain().Run().mask), 0.99);
}

TEST(VesselSegmentation, VoxelsWithoutValueDoNotSpread)
{
  const Case& plain = Plain();
  const std::vector<unsigned char> clean = plain.Run().mask;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  // In the ball, beside the tube, in it, and at the seed.
  std::vector<Vector3> places{ Vector3(-6.0, 0.0, 0.0), Vector3(-2.5, 1.0, 1.0),
    Vector3(0.3, 0.0, 0.5) };
  for (const double angle : { 0.5, 0.8, 1.1 })
  {
    const Vector3 outwards = BentTube::Axis(angle) - Vector3(0.0, BentTube::Bend, 0.0);
    places.emplace_back(BentTube::Axis(angle) + (angle - 0.5) / 0.3 * 1.4 * outwards.normalized());
  }
  Case image = plain;
  std::vector<std::size_t> damaged(places.size(), 0);
  for (std::size_t n = 0; n < places.size(); ++n)
  {
    for (std::size_t p = 0; p < image.values.size(); ++p)
    {
      if ((plain.World(p) - places[n]).norm() < (plain.World(damaged[n]) - places[n]).norm())
      {
        damaged[n] = p;
      }
    }
    image.values[damaged[n]] = nan;
    image.vesselness[damaged[n]] = nan;
  }
  const VesselSegmentationResult result = image.Run(true);
  for (std::size_t p = 0; p < clean.size(); ++p)
  {
    ASSERT_TRUE(result.probability[p] >= 0.0f && result.probability[p] <= 1.0f);
    if (result.mask[p] != clean[p])
    {
      double nearest = 1e9;
      for (const std::size_t d : damaged)
      {
        nearest = std::min(nearest, (image.World(d) - image.World(p)).norm());
      }
      ASSERT_LT(nearest, 1.5) << image.World(p).transpose();
    }
  }

  // Nothing but such voxels.
  std::fill(image.values.begin(), image.values.end(), nan);
  EXPECT_NE(MessageOf([&] { image.Run(); }).find("at the seeds"), std::string::npos);
}

TEST(VesselSegmentation, ImagesWithoutContrastAreRefused)
{
  Case image = Plain();
  for (const float value : { 0.0f, 100.0f, -1000.0f, 400.0f })
  {
    std::fill(image.values.begin(), image.values.end(), value);
    EXPECT_EQ(
      MessageOf([&] { image.Run(); }), "nothing is brighter than its surroundings at the seeds")
      << value;
  }
  // With a given window it is no error: there just is no vessel.
  image.settings.window = BloodWindow{ Tissue, Blood };
  std::fill(image.values.begin(), image.values.end(), static_cast<float>(Tissue));
  EXPECT_EQ(image.Volume(image.Run()), 0.0);
}

TEST(VesselSegmentation, RefusesSeedsAndSettingsByName)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  Case image = Plain();
  const auto seed = [&](const VesselSeed& second, const std::string& expected)
  {
    image.seeds = { Plain().seeds[0], second };
    EXPECT_EQ(MessageOf([&] { image.Run(); }), expected);
  };
  seed({ Vector3(500.0, 0.0, 0.0), {} }, "seed 1 is outside the image");
  seed({ Vector3(0.0, -1e300, 0.0), {} }, "seed 1 is outside the image");
  seed({ Vector3(0.0, nan, 0.0), {} }, "seed 1 is outside the image");
  seed({ Vector3::Zero(), Vector3(0.0, 0.0, infinity) }, "the axis of seed 1 is not finite");
  image.seeds.clear();
  EXPECT_EQ(MessageOf([&] { image.Run(); }), "there is no seed");
  image.seeds = Plain().seeds;
  image.grid.extent[1] = image.grid.extent[0] - 1;
  EXPECT_EQ(MessageOf([&] { image.Run(); }), "the image is empty");

  const auto refused =
    [&](const char* name, const std::function<void(VesselSegmentationSettings&)>& change)
  {
    VesselSegmentationSettings settings;
    change(settings);
    const std::string message = MessageOf([&] { settings.Validate(); });
    EXPECT_NE(message.find(name), std::string::npos) << name << ": " << message;
    Case again = Plain();
    again.settings = settings;
    EXPECT_EQ(MessageOf([&] { again.Run(); }), message);
  };
  using S = VesselSegmentationSettings;
  refused("window", [](S& s) { s.window = BloodWindow{ 100.0, 100.0 }; });
  refused("window", [&](S& s) { s.window = BloodWindow{ nan, 100.0 }; });
  refused("window", [&](S& s) { s.window = BloodWindow{ 0.0, infinity }; });
  refused("strong", [](S& s) { s.strong = 1.1; });
  refused("strong", [&](S& s) { s.strong = nan; });
  refused("weak", [](S& s) { s.weak = 0.9; });
  refused("weak", [](S& s) { s.weak = 0.0; });
  refused("weak", [&](S& s) { s.weak = nan; });
  refused("tubular", [](S& s) { s.tubular = 0.0; });
  refused("tubular", [&](S& s) { s.tubular = infinity; });
  refused("maximumRadius", [](S& s) { s.maximumRadius = 0.5; });
  refused("maximumRadius", [](S& s) { s.maximumRadius = 51.0; });
  refused("maximumRadius", [&](S& s) { s.maximumRadius = nan; });
  refused("longestPath", [](S& s) { s.longestPath = 0.0; });
  refused("longestPath", [&](S& s) { s.longestPath = infinity; });
  refused("minimumIslandVolume", [](S& s) { s.minimumIslandVolume = -1.0; });
  refused("minimumIslandVolume", [&](S& s) { s.minimumIslandVolume = nan; });
}

TEST(VesselSegmentation, SameBitsOnAnyNumberOfThreads)
{
  SetNumberOfThreads(1);
  const VesselSegmentationResult single = Plain().Run(true);
  SetNumberOfThreads(4);
  const VesselSegmentationResult several = Plain().Run(true);
  SetNumberOfThreads(0);
  EXPECT_EQ(single.mask, several.mask);
  EXPECT_EQ(single.probability, several.probability);
  EXPECT_EQ(single.tubular, several.tubular);
  EXPECT_EQ(single.seedVolume, several.seedVolume);
}

TEST(VesselSegmentation, ReportsAndStops)
{
  double last = 0.0;
  Plain().Run(true,
    [&](double fraction)
    {
      EXPECT_GE(fraction, last);
      EXPECT_LE(fraction, 1.0);
      last = fraction;
      return true;
    });
  EXPECT_EQ(last, 1.0);
  for (const double until : { 0.0, 0.25, 0.5, 0.8, 1.0 })
  {
    double asked = 0.0;
    const auto stop = [&](double fraction)
    {
      EXPECT_LT(asked, until == 0.0 ? 1.0 : until) << "asked again after it was told to stop";
      asked = fraction;
      return fraction < until;
    };
    EXPECT_THROW(Plain().Run(true, stop), Cancelled);
  }
}

TEST(VesselSegmentation, PhantomOverlapsItsTruth)
{
  PhantomSettings anatomy;
  anatomy.seed = 3;
  anatomy.temporalWindow = 0.0;
  const CoronaryPhantom phantom(anatomy);
  const double t = 0.75;
  Case image;
  image.grid = phantom.DefaultGrid(0.75, 6.0);
  const std::array<int, 3> n = image.Size();
  std::vector<std::int16_t> values(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
  phantom.Render(image.grid, image.grid.extent, t, values.data());
  image.values.assign(values.begin(), values.end());
  image.Filter();
  for (const PhantomOstium& ostium : phantom.Ostia(t))
  {
    image.seeds.push_back({ ostium.position, ostium.axis });
  }
  const VesselSegmentationResult result = image.Run();

  // Thinner vessels than a voxel are no measure: what is nearest to one does not count.
  std::vector<float> distances(values.size());
  phantom.LumenDistances(image.grid, image.grid.extent, t, 3.0, distances.data());
  const PhantomTree tree = phantom.Tree(t);
  std::vector<unsigned char> found;
  std::vector<unsigned char> truth;
  for (std::size_t p = 0; p < distances.size(); ++p)
  {
    if (!result.mask[p] && !(distances[p] < 0.0f))
    {
      continue;
    }
    const Vector3 at = image.World(p);
    std::size_t nearest = 0;
    for (std::size_t q = 0; q < tree.points.size(); ++q)
    {
      if ((tree.points[q] - at).squaredNorm() < (tree.points[nearest] - at).squaredNorm())
      {
        nearest = q;
      }
    }
    if (tree.radius[nearest] >= 0.75)
    {
      found.push_back(result.mask[p]);
      truth.push_back(distances[p] < 0.0f ? 1 : 0);
    }
  }
  EXPECT_GT(truth.size(), 5000u);
  EXPECT_GE(Dice(found, truth), 0.85);
}
}
