// Tubes that no tree holds: an artery that is cut off is told with its place, veins and healthy trees are not.

#include "CoronaryPhantom.h"
#include "LooseVessels.h"
#include "MultiscaleVesselness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace UnitTestLooseVessels
{
using namespace coronary;

namespace
{
constexpr double Phase = 0.75;

/// An image of a phantom with its vesselness, and the true tree as far as it is wide enough to be seen.
class LooseVessels : public ::testing::Test
{
protected:
  static void SetUpTestSuite()
  {
    PhantomSettings settings;
    settings.seed = 311;
    settings.veinHU = 260.0; // arteries: 420
    // A sharp kernel (0.75 mm at half its height): in a medium one's image the first marginal and the
    // vein that crosses it 0.6 mm away are one piece, which is taken for the vein (docs/limits.md).
    settings.pointSpread[0] = settings.pointSpread[1] = 0.32;
    settings.noiseCorrelation = 0.26;
    const CoronaryPhantom phantom(settings);
    Truth = phantom.Tree(Phase);
    Vein = phantom.Vein(Phase);
    Grid = phantom.DefaultGrid(0.6);
    ScalarImage image;
    image.grid = Grid;
    const auto voxels = static_cast<std::size_t>(image.NumberOfVoxels());
    Values.resize(voxels);
    phantom.Render(Grid, Grid.extent, Phase, Values.data());
    const std::vector<float> input(Values.begin(), Values.end());
    Vesselness.resize(voxels);
    VesselnessSettings frangi;
    frangi.sigmas = VesselnessScales(0.5, 2.5, 5, true);
    frangi.c = 100.0;
    MultiscaleVesselness::Output output;
    output.vesselness = Vesselness.data();
    MultiscaleVesselness(frangi, Grid.spacing, Grid.extent)
      .Compute({ input.data(), Grid.extent }, Grid.extent, nullptr, output);
  }
  static void TearDownTestSuite()
  {
    Values = {};
    Vesselness = {};
  }

  /// What is found with the tree without a segment's branches and all that hangs on them.
  static std::vector<LooseVessel> Find(int without, std::vector<Vector3>* gone = nullptr)
  {
    Polylines set;
    set.points = Truth.points;
    set.radius = Truth.radius;
    std::set<int> cut;
    for (const VesselTree::Branch& branch : Truth.branches)
    {
      if (branch.segmentId == without || cut.count(branch.parentGroupId) != 0)
      {
        cut.insert(branch.groupId);
        for (const std::int64_t point : branch.points)
        {
          if (gone != nullptr)
          {
            gone->push_back(Truth.points[static_cast<std::size_t>(point)]);
          }
        }
        continue;
      }
      std::vector<std::int64_t> line = branch.points;
      while (line.size() > 1 && Truth.radius[static_cast<std::size_t>(line.back())] < 0.45)
      {
        line.pop_back();
      }
      if (line.size() > 1)
      {
        set.lines.push_back(line);
      }
    }
    CenterlineTopology tree = BuildTopology(set);
    const LabelingResult labels = LabelSegments(tree);
    ScalarImage image;
    image.grid = Grid;
    image.values = static_cast<const std::int16_t*>(Values.data());
    return FindLooseVessels({ image, Vesselness.data(), tree, labels.heart, 50.0, 420.0 });
  }
  /// Fat in a ball of the image.
  static void Hide(const Vector3& centre, double radius)
  {
    for (int k = Grid.extent[4]; k <= Grid.extent[5]; ++k)
    {
      for (int j = Grid.extent[2]; j <= Grid.extent[3]; ++j)
      {
        const Vector3 row = Grid.IndexToWorld(Grid.extent[0], j, k);
        if (std::hypot(row[1] - centre[1], row[2] - centre[2]) > radius)
        {
          continue;
        }
        for (int i = Grid.extent[0]; i <= Grid.extent[1]; ++i)
        {
          if ((Grid.IndexToWorld(i, j, k) - centre).norm() < radius)
          {
            const auto nx = static_cast<std::size_t>(Grid.extent[1] + 1);
            const auto ny = static_cast<std::size_t>(Grid.extent[3] + 1);
            const auto at = (static_cast<std::size_t>(k) * ny + static_cast<std::size_t>(j)) * nx +
              static_cast<std::size_t>(i);
            Values[at] = -95;
            Vesselness[at] = 0.0F;
          }
        }
      }
    }
  }
  static double Distance(const Vector3& place, const std::vector<Vector3>& points)
  {
    double minimum = 1e9;
    for (const Vector3& point : points)
    {
      minimum = std::min(minimum, (point - place).norm());
    }
    return minimum;
  }

  static PhantomTree Truth;
  static PhantomTree Vein;
  static ImageGrid Grid;
  static std::vector<std::int16_t> Values;
  static std::vector<float> Vesselness;
};
PhantomTree LooseVessels::Truth;
PhantomTree LooseVessels::Vein;
ImageGrid LooseVessels::Grid;
std::vector<std::int16_t> LooseVessels::Values;
std::vector<float> LooseVessels::Vesselness;
}

TEST_F(LooseVessels, NothingIsSaidOfAHealthyTreeBesideItsVein)
{
  // Which is there to be seen, and in no tree.
  int bright = 0;
  for (const Vector3& point : Vein.points)
  {
    const Vector3 index = (point - Grid.origin) / Grid.spacing[0];
    const int nx = Grid.extent[1] + 1;
    const int ny = Grid.extent[3] + 1;
    const auto at =
      (std::lround(index[2]) * ny + std::lround(index[1])) * nx + std::lround(index[0]);
    bright += Values[static_cast<std::size_t>(at)] > 200 ? 1 : 0;
  }
  EXPECT_GT(2 * bright, static_cast<int>(Vein.points.size()));
  for (const TreeWarning& warning : LooseVesselWarnings(Find(-1)))
  {
    ADD_FAILURE() << warning.what;
  }
}

TEST_F(LooseVessels, ASideBranchThatIsMissingIsTold)
{
  for (const int segment : { SecondDiagonal, FirstObtuseMarginal, AcuteMarginal })
  {
    std::vector<Vector3> gone;
    const std::vector<LooseVessel> vessels = Find(segment, &gone);
    const std::vector<TreeWarning> warnings = LooseVesselWarnings(vessels);
    ASSERT_FALSE(warnings.empty()) << SegmentName(segment);
    for (const TreeWarning& warning : warnings)
    {
      EXPECT_LT(Distance(warning.place, gone), 2.0) << warning.what;
      EXPECT_GE(warning.confidence, 0.5);
      EXPECT_LE(warning.confidence, 0.99);
    }
    // All along it.
    const auto longest = std::find_if(vessels.begin(), vessels.end(),
      [&](const LooseVessel& vessel) { return vessel.confidence >= 0.5; });
    for (const Vector3& point : longest->points)
    {
      EXPECT_LT(Distance(point, gone), 2.0);
    }
  }
}

TEST_F(LooseVessels, AShortRestBehindALesionIsTold)
{
  // Of a marginal less than 8 mm are left to be seen, 10 mm from where it leaves its parent; and no tip of the tree leads there.
  const std::vector<std::int16_t> values = Values;
  const std::vector<float> vesselness = Vesselness;
  std::vector<Vector3> rest;
  for (const VesselTree::Branch& branch : Truth.branches)
  {
    if (branch.segmentId != SecondObtuseMarginal)
    {
      continue;
    }
    const double begin = Truth.abscissa[static_cast<std::size_t>(branch.points.front())];
    for (const std::int64_t p : branch.points)
    {
      const auto point = static_cast<std::size_t>(p);
      const double passed = Truth.abscissa[point] - begin;
      if (passed > 8.0 && passed < 22.0)
      {
        rest.push_back(Truth.points[point]);
      }
      else if (passed > 2.0)
      {
        Hide(Truth.points[point], 2.5);
      }
    }
  }
  const std::vector<TreeWarning> warnings = LooseVesselWarnings(Find(SecondObtuseMarginal));
  Values = values;
  Vesselness = vesselness;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_LT(Distance(warnings[0].place, rest), 1.5);
  EXPECT_LT(warnings[0].confidence, 0.85); // it is short
}

TEST_F(LooseVessels, ATreeLacksAFewNotDozens)
{
  std::vector<LooseVessel> vessels(100);
  for (LooseVessel& vessel : vessels)
  {
    vessel.confidence = 0.6;
    vessel.points = { Vector3::Zero(), Vector3::UnitX() };
  }
  vessels[7].confidence = 0.999;
  std::vector<LooseVessel> few(vessels.begin(), vessels.begin() + 9);
  ExpectFewMissing(vessels);
  double sum = 0.0;
  for (const LooseVessel& vessel : vessels)
  {
    sum += vessel.confidence;
  }
  EXPECT_NEAR(sum, 10.0, 1e-6);
  // What is sure stays, and all else is divided alike.
  EXPECT_GT(vessels[7].confidence, 0.98);
  EXPECT_EQ(vessels[0].confidence, vessels[99].confidence);
  // One is told by itself, the others together.
  vessels[20].alone = 0.7;
  vessels[20].points = { Vector3(0.0, 0.0, 0.0), Vector3(1.0, 2.0, 3.0) };
  const std::vector<TreeWarning> told = LooseVesselWarnings(vessels);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[1].what.find("99 more vessels"), 0U) << told[1].what;
  EXPECT_NE(told[1].what.find("(1.0, 2.0, 3.0)"), std::string::npos) << told[1].what;
  EXPECT_EQ(told[1].confidence, vessels[20].confidence);
  ASSERT_EQ(LooseVesselWarnings(few).size(), 9U);
  ExpectFewMissing(few);
  EXPECT_EQ(few[0].confidence, 0.6);
  EXPECT_EQ(few[7].confidence, 0.999);
}

TEST_F(LooseVessels, WithoutContrastOrTreeThereIsNoMeasure)
{
  ScalarImage image;
  image.grid = Grid;
  image.values = static_cast<const std::int16_t*>(Values.data());
  const VesselTree none;
  EXPECT_TRUE(
    FindLooseVessels({ image, Vesselness.data(), none, HeartPose(), 50.0, 420.0 }).empty());
  EXPECT_THROW(FindLooseVessels({ image, Vesselness.data(), none, HeartPose(), 50.0, 50.0 }),
    std::invalid_argument);
  EXPECT_THROW(
    FindLooseVessels({ image, nullptr, none, HeartPose(), 50.0, 420.0 }), std::invalid_argument);
}
}
