// Radius, stenosis and lesions over the cycle, of vessels whose calibre at each phase is known.

#include "CoronaryAnatomy.h"
#include "LumenCycle.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace UnitTestLumenCycle
{
using namespace coronary;

namespace
{
constexpr double Length = 80.0; // mm
constexpr double Healthy = 1.6; // mm
constexpr double Degree = 0.5;
constexpr double Middle = 40.0; // mm from the root

/// A straight LAD of points 0.5 mm apart.
VesselTree Line()
{
  VesselTree tree;
  VesselTree::Branch branch;
  branch.segmentId = MidLAD;
  for (double z = 0.0; z <= Length; z += 0.5)
  {
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.emplace_back(0.0, 0.0, z);
    tree.radius.push_back(
      Healthy * (1.0 - Degree * std::exp(-0.5 * std::pow((z - Middle) / 4, 2))));
    tree.segmentId.push_back(MidLAD);
  }
  tree.branches.push_back(branch);
  MeasureTree(tree);
  return tree;
}

double Pulse(double time)
{
  return 1.0 + 0.06 * std::sin(2.0 * M_PI * time);
}

/// The same lumen with another calibre at each phase.
std::vector<RefinedLumen> Pulsating(const VesselTree& tree, const std::vector<double>& times)
{
  std::vector<RefinedLumen> lumens;
  for (const double time : times)
  {
    VesselTree now = tree;
    for (double& radius : now.radius)
    {
      radius *= Pulse(time);
    }
    lumens.push_back(LumenOf(now));
  }
  return lumens;
}

const std::vector<double> Times = { 0.0, 0.25, 0.5, 0.75 };
}

TEST(GradeOverCycle, AStenosisThatPulsates)
{
  const VesselTree tree = Line();
  const LumenCycle cycle = GradeOverCycle(tree, Times, Pulsating(tree, Times));
  ASSERT_EQ(cycle.radius.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k)
  {
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      ASSERT_DOUBLE_EQ(cycle.radius[k][p], tree.radius[p] * Pulse(Times[k]));
    }
    // All of the vessel is wider: the stenosis stays what it is.
    EXPECT_NEAR(cycle.degree[k][80], Degree, 0.04) << k;
    EXPECT_NEAR(cycle.reference[k][80], Healthy * Pulse(Times[k]), 0.06) << k;
  }
  EXPECT_NEAR(cycle.least[10], tree.radius[10] * 0.94, 1e-12);
  EXPECT_NEAR(cycle.median[10], tree.radius[10], 1e-12);
  EXPECT_NEAR(cycle.greatest[10], tree.radius[10] * 1.06, 1e-12);
  EXPECT_NEAR(cycle.medianDegree[80], Degree, 0.04);
  ASSERT_EQ(cycle.lesions.size(), 1U);
  const CycleLesion& lesion = cycle.lesions[0];
  EXPECT_NEAR(lesion.median.abscissaMinimum, Middle, 1.0);
  EXPECT_NEAR(lesion.median.degree, Degree, 0.04);
  EXPECT_EQ(lesion.median.segmentId, MidLAD);
  ASSERT_EQ(lesion.diameter.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k)
  {
    EXPECT_NEAR(lesion.diameter[k], 2.0 * Healthy * (1.0 - Degree) * Pulse(Times[k]), 0.02) << k;
    EXPECT_NEAR(lesion.degree[k], Degree, 0.04) << k;
  }
}

TEST(GradeOverCycle, AStenosisThatIsSqueezedAtOnePhase)
{
  // As under a bridge of muscle: at half of the cycle the lumen is narrower by a third there, and nowhere else.
  const VesselTree tree = Line();
  std::vector<RefinedLumen> lumens(4, LumenOf(tree));
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    const double squeezed =
      1.0 - 0.35 * std::exp(-0.5 * std::pow((tree.points[p].z() - Middle) / 4.0, 2));
    lumens[2].radius[p] *= squeezed;
    lumens[2].measured[p] *= squeezed;
  }
  const LumenCycle cycle = GradeOverCycle(tree, Times, lumens);
  ASSERT_EQ(cycle.lesions.size(), 1U);
  EXPECT_EQ(cycle.lesions[0].worst, 2);
  EXPECT_NEAR(cycle.lesions[0].degree[2], 1.0 - 0.5 * 0.65, 0.04);
  EXPECT_NEAR(cycle.lesions[0].degree[0], 0.5, 0.04);
  EXPECT_NEAR(cycle.lesions[0].median.degree, 0.5, 0.04); // three phases of four
  EXPECT_NEAR(cycle.lesions[0].diameter[2], 2.0 * Healthy * 0.5 * 0.65, 0.02);
}

TEST(GradeOverCycle, WhatOnePhaseShowsWronglyIsNoLesion)
{
  VesselTree tree = Line();
  tree.radius.assign(tree.points.size(), Healthy);
  std::vector<RefinedLumen> lumens(4, LumenOf(tree));
  for (std::size_t p = 76; p < 84; ++p)
  {
    lumens[1].radius[p] = lumens[1].measured[p] = 0.5;
  }
  const LumenCycle cycle = GradeOverCycle(tree, Times, lumens);
  EXPECT_TRUE(cycle.lesions.empty());
  EXPECT_GT(cycle.degree[1][80], 0.4); // the phase itself says so
  EXPECT_NEAR(cycle.least[80], 0.5, 1e-12);
  EXPECT_NEAR(cycle.median[80], Healthy, 1e-12);
}

TEST(GradeOverCycle, WhatIsNotSeenIsNotKnown)
{
  const VesselTree tree = Line();
  std::vector<RefinedLumen> lumens(4, LumenOf(tree));
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    lumens[3].interpolated[p] = 1; // the phase in which nothing was seen
  }
  for (RefinedLumen& lumen : lumens)
  {
    lumen.interpolated[20] = 1;
  }
  const LumenCycle cycle = GradeOverCycle(tree, Times, lumens);
  EXPECT_TRUE(std::isnan(cycle.radius[3][50]));
  EXPECT_TRUE(std::isnan(cycle.radius[0][20]));
  EXPECT_TRUE(std::isnan(cycle.least[20]));
  EXPECT_FALSE(std::isnan(cycle.least[50]));
  ASSERT_EQ(cycle.lesions.size(), 1U);
  EXPECT_TRUE(std::isnan(cycle.lesions[0].degree[3]));
  EXPECT_NE(cycle.lesions[0].worst, 3);
}

TEST(GradeOverCycle, TheSameOnAnyNumberOfThreadsAndNoneOfWhatDoesNotFit)
{
  const VesselTree tree = Line();
  const std::vector<RefinedLumen> lumens = Pulsating(tree, Times);
  std::vector<std::vector<double>> first;
  for (const int threads : { 1, 3 })
  {
    SetNumberOfThreads(threads);
    const LumenCycle cycle = GradeOverCycle(tree, Times, lumens);
    first = first.empty() ? cycle.degree : first;
    EXPECT_EQ(first, cycle.degree);
  }
  SetNumberOfThreads(0);
  ExpectRefusal([&] { GradeOverCycle(tree, {}, {}); }, "no phase");
  ExpectRefusal([&] { GradeOverCycle(tree, { 0.1 }, lumens); }, "one time a phase");
  std::vector<RefinedLumen> short1 = lumens;
  short1[2].radius.pop_back();
  ExpectRefusal([&] { GradeOverCycle(tree, Times, short1); }, "one value a point");
  EXPECT_THROW(GradeOverCycle(tree, Times, lumens, [](double) { return false; }), Cancelled);
}
}
