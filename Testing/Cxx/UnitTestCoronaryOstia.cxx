// The ostia of the phantom, whose places are known, and images that have none.

#include "CoronaryOstia.h"
#include "CoronaryPhantom.h"
#include "CounterRandom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

namespace UnitTestCoronaryOstia
{
using namespace coronary;

namespace
{
constexpr double Phase = 0.75;

/// Rendered root of the phantom's heart.
struct Root
{
  ImageGrid grid;
  std::vector<std::int16_t> values;
  std::vector<PhantomOstium> truth;
  std::vector<Vector3> left; ///< axes of the left tree, from the ostium on

  CoronaryOstia Find(const CoronaryOstiaSettings& settings = {}) const
  {
    return FindCoronaryOstia({ values.data(), grid }, settings);
  }
};

/// A box of 85 x 85 x 70 mm about the root; the image axes are turned by `angle` radians.
Root MakeRoot(std::uint64_t seed, Dominance dominance, double spacing, double angle = 0.0)
{
  PhantomSettings settings;
  settings.seed = seed;
  settings.dominance = dominance;
  settings.temporalWindow = 0.0;
  const CoronaryPhantom phantom(settings);
  Root root;
  root.truth = phantom.Ostia(Phase);
  const PhantomTree tree = phantom.Tree(Phase);
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.treeId == 0)
    {
      for (const std::int64_t p : branch.points)
      {
        root.left.push_back(tree.points[static_cast<std::size_t>(p)]);
      }
    }
  }
  root.grid.spacing = spacing * Vector3(1.0, 1.0, 1.1);
  root.grid.direction = Eigen::AngleAxisd(angle, Vector3(1.0, 2.0, -2.0).normalized()).matrix();
  const Vector3 centre = 0.5 * (root.truth[0].position + root.truth[1].position);
  const Vector3 low(-40.0, -45.0, -45.0);
  const Vector3 span(85.0, 85.0, 70.0);
  const int first[3] = { -20, 5, 31 };
  Vector3 start;
  for (int axis = 0; axis < 3; ++axis)
  {
    const int shift = angle == 0.0 ? 0 : first[axis];
    root.grid.extent[2 * axis] = shift;
    root.grid.extent[2 * axis + 1] = shift + static_cast<int>(span[axis] / root.grid.spacing[axis]);
    start[axis] = low[axis] - shift * root.grid.spacing[axis];
  }
  root.grid.origin = centre + root.grid.direction * start;
  const std::array<int, 3> n = ScalarImage{ root.values.data(), root.grid }.Dimensions();
  root.values.resize(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
  phantom.Render(root.grid, root.grid.extent, Phase, root.values.data());
  return root;
}

const Root& Standard()
{
  static const Root root = MakeRoot(1, Dominance::Right, 0.9);
  return root;
}

void ExpectFound(const CoronaryOstia& found, const Root& root, const std::string& what)
{
  SCOPED_TRACE(what);
  ASSERT_EQ(found.ostia.size(), 2u) << found.doubt;
  for (int n = 0; n < 2; ++n)
  {
    const CoronaryOstium& ostium = found.ostia[n];
    const PhantomOstium& truth = root.truth[n];
    EXPECT_EQ(ostium.name, truth.name);
    EXPECT_LT((ostium.position - truth.position).norm(), 2.0)
      << ostium.name << " at " << ostium.position.transpose() << " instead of "
      << truth.position.transpose();
    EXPECT_NEAR(ostium.axis.norm(), 1.0, 1e-9);
    EXPECT_GT(ostium.axis.dot(truth.axis), 0.5) << ostium.name;
    EXPECT_NEAR(ostium.radius, truth.radius, 0.5 * truth.radius) << ostium.name;
    EXPECT_TRUE(ostium.length > 20.0 && ostium.length <= 80.0) << ostium.length;
    EXPECT_TRUE(ostium.confidence > 0.0 && ostium.confidence <= 1.0) << ostium.confidence;
  }
  const bool sure = found.ostia[0].confidence >= 0.5 && found.ostia[1].confidence >= 0.5;
  EXPECT_EQ(found.doubt.empty(), sure) << found.doubt;
  // The aorta: upwards, where both ostia are on its wall, with the blood's value.
  ASSERT_GT(found.aorta.sections.size(), 4u);
  for (std::size_t n = 1; n < found.aorta.sections.size(); ++n)
  {
    EXPECT_GT(found.aorta.sections[n].centre[2], found.aorta.sections[n - 1].centre[2]);
  }
  EXPECT_NEAR(found.aorta.mean, 420.0, 30.0);
  EXPECT_NEAR(found.aorta.deviation, 20.0, 15.0);
  EXPECT_GT(found.aorta.confidence, 0.5);
}

/// A rod of plaque in fat in place of the first millimetres of the left tree.
Root WithoutLeftMouth(double length)
{
  Root root = Standard();
  constexpr std::int16_t plaque = 60; // HU
  constexpr std::int16_t fat = -90;
  Vector3 outward = root.truth[0].position - root.truth[1].position;
  outward.normalize();
  const std::array<int, 3> n = ScalarImage{ root.values.data(), root.grid }.Dimensions();
  for (std::size_t v = 0; v < root.values.size(); ++v)
  {
    const auto i = static_cast<int>(v);
    const Vector3 p = root.grid.IndexToWorld(i % n[0], i / n[0] % n[1], i / (n[0] * n[1]));
    if ((p - root.truth[0].position).dot(outward) <= 0.3)
    {
      continue;
    }
    double away = 1e9;
    bool hidden = false;
    for (const Vector3& q : root.left)
    {
      if ((p - q).norm() < away)
      {
        away = (p - q).norm();
        hidden = (q - root.left.front()).norm() < length;
      }
    }
    if (hidden && away < 4.5)
    {
      root.values[v] = away < 2.2 ? plaque : fat;
    }
  }
  return root;
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

void ExpectSame(const CoronaryOstia& a, const CoronaryOstia& b)
{
  EXPECT_EQ(a.doubt, b.doubt);
  EXPECT_EQ(a.aorta.mean, b.aorta.mean);
  EXPECT_EQ(a.aorta.deviation, b.aorta.deviation);
  ASSERT_EQ(a.aorta.sections.size(), b.aorta.sections.size());
  for (std::size_t n = 0; n < a.aorta.sections.size(); ++n)
  {
    EXPECT_EQ(a.aorta.sections[n].centre, b.aorta.sections[n].centre);
    EXPECT_EQ(a.aorta.sections[n].radius, b.aorta.sections[n].radius);
  }
  ASSERT_EQ(a.ostia.size(), b.ostia.size());
  for (std::size_t n = 0; n < a.ostia.size(); ++n)
  {
    EXPECT_EQ(a.ostia[n].name, b.ostia[n].name);
    EXPECT_EQ(a.ostia[n].position, b.ostia[n].position);
    EXPECT_EQ(a.ostia[n].axis, b.ostia[n].axis);
    EXPECT_EQ(a.ostia[n].radius, b.ostia[n].radius);
    EXPECT_EQ(a.ostia[n].length, b.ostia[n].length);
    EXPECT_EQ(a.ostia[n].confidence, b.ostia[n].confidence);
  }
}

ImageGrid Box(int nx, int ny, int nz, double spacing)
{
  ImageGrid grid;
  grid.extent = { 0, nx - 1, 0, ny - 1, 0, nz - 1 };
  grid.spacing = Vector3::Constant(spacing);
  return grid;
}

void ExpectNothing(const ImageGrid& grid, const std::vector<float>& values, const char* what)
{
  SCOPED_TRACE(what);
  const CoronaryOstia found = FindCoronaryOstia({ values.data(), grid });
  EXPECT_TRUE(found.aorta.sections.empty());
  EXPECT_TRUE(found.ostia.empty());
  EXPECT_EQ(found.aorta.confidence, 0.0);
  EXPECT_EQ(found.doubt, "no ascending aorta: no bright round cross-sections in a row");
}
}

TEST(CoronaryOstia, FoundInThePhantom)
{
  ExpectFound(Standard().Find(), Standard(), "seed 1");
  const Dominance dominances[] = { Dominance::Right, Dominance::Left, Dominance::Balanced };
  for (const std::uint64_t seed : { 2, 4 })
  {
    const Root root = MakeRoot(seed, dominances[seed % 3], seed == 2 ? 0.75 : 1.0);
    ExpectFound(root.Find(), root, "seed " + std::to_string(seed));
  }
}

TEST(CoronaryOstia, ObliqueImageFarFromTheOrigin)
{
  Root root = MakeRoot(5, Dominance::Right, 0.9, 0.35);
  const Vector3 shift(1234.0, -567.0, 3000.0);
  root.grid.origin += shift;
  for (PhantomOstium& ostium : root.truth)
  {
    ostium.position += shift;
  }
  ExpectFound(root.Find(), root, "oblique");
}

TEST(CoronaryOstia, SameResultForAllTypesOfVoxelsAndThreads)
{
  Root root = Standard();
  for (std::int16_t& value : root.values)
  {
    value = std::max<std::int16_t>(0, value); // what unsigned values can hold as well
  }
  const std::vector<float> floats(root.values.begin(), root.values.end());
  const std::vector<std::uint16_t> unsignedShorts(root.values.begin(), root.values.end());
  SetNumberOfThreads(1);
  const CoronaryOstia found = root.Find();
  SetNumberOfThreads(4);
  ExpectSame(FindCoronaryOstia({ floats.data(), root.grid }), found);
  ExpectSame(FindCoronaryOstia({ unsignedShorts.data(), root.grid }), found);
  SetNumberOfThreads(0);
  ExpectFound(found, root, "int16");
}

TEST(CoronaryOstia, VoxelsWithoutValueAreBridged)
{
  const Root& root = Standard();
  std::vector<float> values(root.values.begin(), root.values.end());
  RandomStream random(7);
  for (float& value : values)
  {
    if (random.Uniform() < 0.001)
    {
      value = std::numeric_limits<float>::quiet_NaN();
    }
  }
  ExpectFound(FindCoronaryOstia({ values.data(), root.grid }), root, "NaN");
}

TEST(CoronaryOstia, NothingIsFoundWhereNothingIs)
{
  const ImageGrid grid = Box(80, 70, 60, 1.2);
  const std::size_t count = 80 * 70 * 60;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float value : { 0.0f, 400.0f, -1000.0f, -3024.0f, nan, infinity, -infinity })
  {
    ExpectNothing(grid, std::vector<float>(count, value), "constant");
  }
  std::vector<float> noise(count);
  RandomStream random(11);
  for (float& value : noise)
  {
    value = static_cast<float>(150.0 + 150.0 * random.Normal());
  }
  ExpectNothing(grid, noise, "noise");
  for (float& value : noise)
  {
    value = random.Uniform() < 0.3 ? nan : value;
  }
  ExpectNothing(grid, noise, "noise with NaN");
  // The smallest image there may be, and one without contrast medium.
  ExpectNothing(Box(2, 2, 2, 0.5), std::vector<float>(8, 100.0f), "small");
  std::vector<float> native(Standard().values.begin(), Standard().values.end());
  for (float& value : native)
  {
    value = std::min(value, 60.0f);
  }
  ExpectNothing(Standard().grid, native, "without contrast medium");
}

TEST(CoronaryOstia, AnAortaWithoutVessels)
{
  // Bright cylinders: a whole one, and one that begins right above the lung.
  const ImageGrid grid = Box(75, 75, 70, 1.0);
  for (const int bottom : { 0, 55 })
  {
    std::vector<float> values;
    for (int k = 0; k < 70; ++k)
    {
      for (int j = 0; j < 75; ++j)
      {
        for (int i = 0; i < 75; ++i)
        {
          const double outside = std::hypot(i - 37.0, j - 36.0) - 14.0;
          values.push_back(k < bottom
              ? -850.0f
              : static_cast<float>(40.0 + 380.0 * std::clamp(0.5 - outside, 0.0, 1.0)));
        }
      }
    }
    const CoronaryOstia found = FindCoronaryOstia({ values.data(), grid });
    ASSERT_FALSE(found.aorta.sections.empty()) << bottom;
    EXPECT_NEAR(found.aorta.sections.front().radius, 14.0, 0.7);
    EXPECT_NEAR(found.aorta.sections.front().centre[0], 37.0, 0.5);
    EXPECT_NEAR(found.aorta.mean, 420.0, 10.0) << bottom;
    EXPECT_TRUE(found.ostia.empty()) << bottom;
    EXPECT_EQ(found.doubt, "no vessel leaves the aorta");
  }
}

TEST(CoronaryOstia, ASingleVesselIsNamedAndDoubted)
{
  // The left half of the image has no vessels.
  Root root = Standard();
  const std::array<int, 3> n = ScalarImage{ root.values.data(), root.grid }.Dimensions();
  const Vector3 centre = 0.5 * (root.truth[0].position + root.truth[1].position);
  const double bore = 0.5 * (root.truth[0].position - root.truth[1].position).norm();
  for (std::size_t p = 0; p < root.values.size(); ++p)
  {
    const auto v = static_cast<int>(p);
    const Vector3 at = root.grid.IndexToWorld(v % n[0], v / n[0] % n[1], v / (n[0] * n[1]));
    if (at[0] > centre[0] && (at - root.truth[0].position).norm() < 60.0 &&
      std::hypot(at[0] - centre[0], at[1] - centre[1]) > bore + 4.0)
    {
      root.values[p] = -80;
    }
  }
  const CoronaryOstia found = root.Find();
  ASSERT_EQ(found.ostia.size(), 1u) << found.doubt;
  EXPECT_EQ(found.ostia[0].name, "RCA");
  EXPECT_LT((found.ostia[0].position - root.truth[1].position).norm(), 2.0);
  EXPECT_EQ(found.doubt, "only the RCA was found");
}

TEST(CoronaryOstia, AVesselFarFromTheAortaHasNoMouthThere)
{
  const Root root = WithoutLeftMouth(25.0);
  const CoronaryOstia found = root.Find();
  ASSERT_EQ(found.ostia.size(), 1u);
  EXPECT_EQ(found.ostia[0].name, "RCA");
  EXPECT_EQ(found.doubt, "only the RCA was found");
}

TEST(CoronaryOstia, RefusesSettingsAndImagesByName)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<float> values(1000, 0.0f);
  const auto refused =
    [&](const char* name, const std::function<void(CoronaryOstiaSettings&)>& change)
  {
    CoronaryOstiaSettings settings;
    change(settings);
    const std::string message = MessageOf([&] { settings.Validate(); });
    EXPECT_NE(message.find(name), std::string::npos) << name << ": " << message;
    EXPECT_EQ(MessageOf(
                [&] {
                  FindCoronaryOstia({ values.data(), Box(10, 10, 10, 1.0) }, settings);
                }),
      message);
  };
  using S = CoronaryOstiaSettings;
  refused("minimumAorticRadius", [](S& s) { s.minimumAorticRadius = 3.0; });
  refused("minimumAorticRadius", [](S& s) { s.minimumAorticRadius = s.maximumAorticRadius; });
  refused("minimumAorticRadius", [&](S& s) { s.minimumAorticRadius = nan; });
  refused("maximumAorticRadius", [](S& s) { s.maximumAorticRadius = 61.0; });
  refused("maximumAorticRadius", [&](S& s) { s.maximumAorticRadius = nan; });
  refused("maximumVesselRadius", [](S& s) { s.maximumVesselRadius = 0.9; });
  refused("maximumVesselRadius", [](S& s) { s.maximumVesselRadius = 9.0; });
  refused("maximumVesselRadius", [&](S& s) { s.maximumVesselRadius = nan; });
  refused("vesselLength", [](S& s) { s.vesselLength = 5.0; });
  refused("vesselLength", [](S& s) { s.vesselLength = 90.0; });
  refused("vesselLength", [&](S& s) { s.vesselLength = nan; });
  refused("softTissue", [&](S& s) { s.softTissue = nan; });
  refused("minimumBlood", [](S& s) { s.minimumBlood = s.softTissue; });
  refused("minimumBlood", [](S& s) { s.minimumBlood = std::numeric_limits<double>::infinity(); });

  const auto image = [&](const std::function<void(ImageGrid&)>& change)
  {
    ImageGrid grid = Box(10, 10, 10, 1.0);
    change(grid);
    return MessageOf([&] { FindCoronaryOstia({ values.data(), grid }); });
  };
  EXPECT_EQ(image([](ImageGrid& g) { g.extent[5] = 0; }), "the image is not three-dimensional");
  EXPECT_EQ(image([](ImageGrid& g) { g.extent[1] = -1; }), "the image is not three-dimensional");
  const std::string geometry = "the image needs positive spacing and a finite position";
  EXPECT_EQ(image([](ImageGrid& g) { g.spacing[2] = 0.0; }), geometry);
  EXPECT_EQ(image([&](ImageGrid& g) { g.spacing[1] = nan; }), geometry);
  EXPECT_EQ(image([&](ImageGrid& g) { g.origin[0] = nan; }), geometry);
  EXPECT_EQ(image([&](ImageGrid& g) { g.direction(1, 1) = nan; }), geometry);
}

TEST(CoronaryOstia, ReportsAndStopsSoon)
{
  const Root& root = Standard();
  double last = 0.0;
  FindCoronaryOstia({ root.values.data(), root.grid }, {},
    [&](double fraction)
    {
      EXPECT_GE(fraction, last);
      EXPECT_LE(fraction, 1.0);
      last = fraction;
      return true;
    });
  EXPECT_EQ(last, 1.0);
  for (const double until : { 0.0, 0.5 })
  {
    std::chrono::steady_clock::time_point told;
    EXPECT_THROW(FindCoronaryOstia({ root.values.data(), root.grid }, {},
                   [&](double fraction)
                   {
                     told = std::chrono::steady_clock::now();
                     return fraction < until;
                   }),
      Cancelled);
    EXPECT_LT(std::chrono::steady_clock::now() - told, std::chrono::seconds(2)) << until;
  }
}
}
