// The probability that a branch is where a moving tree has it: its signs in closed form, and what must never be confident.

#include "BranchPlacement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace UnitTestBranchPlacement
{
using namespace coronary;

namespace
{
/// Two lines of 20 mm that meet, with points of 1 mm; the first is 2 mm wide, the second 1 mm.
Polylines TwoLines()
{
  Polylines lines;
  lines.lines.resize(2);
  for (int n = 0; n <= 20; ++n)
  {
    lines.lines[0].push_back(static_cast<std::int64_t>(lines.points.size()));
    lines.points.emplace_back(n, 0.0, 0.0);
    lines.radius.push_back(1.0);
  }
  lines.lines[1].push_back(20);
  for (int n = 1; n <= 20; ++n)
  {
    lines.lines[1].push_back(static_cast<std::int64_t>(lines.points.size()));
    lines.points.emplace_back(20.0, n, 0.0);
    lines.radius.push_back(0.5);
  }
  return lines;
}

PoseSequence AtRest(const Polylines& lines)
{
  PoseSequence poses;
  poses.times = { 0.5 };
  poses.points = { lines.points };
  poses.status = { std::vector<TrackingStatus>(lines.points.size(), TrackingStatus::Tracked) };
  return poses;
}

TEST(BranchPlacement, SignsOfWhatIsSeen)
{
  const Polylines lines = TwoLines();
  const std::vector<PlacementSigns> signs =
    SignsOfPlacement(lines, {}, AtRest(lines), { 0.5, 0.1 })[0];
  ASSERT_EQ(signs.size(), 2U);
  for (const PlacementSigns& own : signs)
  {
    EXPECT_EQ(own.unclear, 0.0);
    EXPECT_EQ(own.unseen, 0.0);
    EXPECT_EQ(own.seldom, 0.0);
    EXPECT_EQ(own.swept, 0.0);
    EXPECT_EQ(own.doubtful, 0.0);
  }
  EXPECT_GT(PlacementConfidence(signs[0]), 0.95);
}

TEST(BranchPlacement, SignsOfWhatIsNot)
{
  const Polylines lines = TwoLines();
  PoseSequence poses = AtRest(lines);
  std::vector<double> certainty(lines.points.size(), 1.0);
  // Half of the second line is filled. All moves by 3 mm to a second phase, in which all is seen.
  for (int n = 31; n <= 40; ++n)
  {
    poses.status[0][n] = n % 2 != 0 ? TrackingStatus::Lost : TrackingStatus::Filled;
    certainty[n] = 0.5;
  }
  poses.times = { 0.3, 0.7 };
  poses.points.push_back(lines.points);
  poses.status.emplace_back(lines.points.size(), TrackingStatus::Tracked);
  for (Vector3& point : poses.points[1])
  {
    point[2] += 3.0;
  }
  const std::vector<PlacementSigns> signs =
    SignsOfPlacement(lines, { certainty, {}, {}, {} }, poses, { 0.5, 0.1 })[0];
  EXPECT_NEAR(signs[1].unseen, 10.0 / 21.0, 1e-12);
  EXPECT_NEAR(signs[1].unclear, 0.5 * 10.0 / 21.0, 1e-12);
  EXPECT_NEAR(signs[1].seldom, 31.0 / (31.0 + 41.0) * 10.0 / 21.0, 1e-12);
  EXPECT_NEAR(signs[1].swept, 0.3, 1e-12);
  EXPECT_EQ(signs[0].unseen, 0.0);
  EXPECT_EQ(signs[0].seldom, 0.0);
  EXPECT_NEAR(signs[0].swept, 0.3, 1e-12);
  EXPECT_LT(PlacementConfidence(signs[1]), PlacementConfidence(signs[0]));
}

TEST(BranchPlacement, APhaseThatIsLostWhollySaysNothingOfABranch)
{
  const Polylines lines = TwoLines();
  PoseSequence poses = AtRest(lines);
  poses.times = { 0.3, 0.7 };
  poses.points.push_back(lines.points);
  poses.status.emplace_back(lines.points.size(), TrackingStatus::Filled);
  EXPECT_EQ(SignsOfPlacement(lines, {}, poses, { 0.5, 0.1 })[0][1].seldom, 0.0);
  EXPECT_EQ(SignsOfPlacement(lines, {}, poses, { 0.5, 0.1 })[1][1].unseen, 1.0);
}

TEST(BranchPlacement, WhatIsSeenInOnePhaseOnlyIsNeverConfident)
{
  const Polylines lines = TwoLines();
  PoseSequence poses = AtRest(lines);
  poses.times = { 0.5, 0.7, 0.9 };
  for (int k = 1; k < 3; ++k)
  {
    poses.points.push_back(lines.points);
    poses.status.push_back(poses.status[0]);
    std::fill(poses.status[k].begin() + 21, poses.status[k].end(), TrackingStatus::Filled);
  }
  const std::vector<double> said = PlacementConfidences(lines, {}, poses, { 0.5, 0.1 })[0];
  EXPECT_GT(said[0], 0.95);
  EXPECT_LE(said[40], 0.5);
}

TEST(BranchPlacement, WhatIsMostlyUnseenIsNeverConfident)
{
  PlacementSigns signs;
  signs.unseen = 0.51;
  EXPECT_LE(PlacementConfidence(signs), 0.5);
  signs.unseen = 1.0;
  EXPECT_LE(PlacementConfidence(signs), 0.5);
  signs.unseen = 0.0;
  signs.seldom = 0.51;
  EXPECT_LE(PlacementConfidence(signs), 0.5);
}

TEST(BranchPlacement, WhatHangsOnADoubtfulOstiumIsNeverConfident)
{
  const Polylines lines = TwoLines();
  PlacementEvidence evidence;
  evidence.ostium.assign(lines.points.size(), 0.75);
  EXPECT_GT(PlacementConfidences(lines, evidence, AtRest(lines), { 0.5, 0.1 })[0][40], 0.9);
  evidence.ostium.assign(lines.points.size(), 0.66);
  const std::vector<std::vector<double>> doubted =
    PlacementConfidences(lines, evidence, AtRest(lines), { 0.5, 0.1 });
  for (const double said : doubted[0])
  {
    EXPECT_LE(said, 0.5);
  }
}

TEST(BranchPlacement, WhatMayBeAVeinIsNeverConfident)
{
  const Polylines lines = TwoLines();
  PlacementEvidence evidence;
  evidence.vein.assign(lines.points.size(), 0.0);
  std::fill(evidence.vein.begin() + 21, evidence.vein.end(), 0.04);
  EXPECT_GT(PlacementConfidences(lines, evidence, AtRest(lines), { 0.5, 0.1 })[0][40], 0.9);
  // A part of the second line is enough; the first one, which it leaves, has nothing to do with it.
  std::fill(evidence.vein.begin() + 35, evidence.vein.end(), 0.06);
  const auto said = PlacementConfidences(lines, evidence, AtRest(lines), { 0.5, 0.1 });
  EXPECT_GT(said[0][0], 0.9);
  EXPECT_LE(said[0][25], 0.5);
  EXPECT_EQ(SignsOfPlacement(lines, evidence, AtRest(lines), { 0.5, 0.1 })[0][1].vein, 0.06);
  evidence.vein.pop_back();
  EXPECT_THROW(
    SignsOfPlacement(lines, evidence, AtRest(lines), { 0.5, 0.1 }), std::invalid_argument);
}

TEST(BranchPlacement, SignsOfWhatTheImagesShow)
{
  const Polylines lines = TwoLines();
  const std::size_t count = lines.points.size();
  PoseSequence poses = AtRest(lines);
  poses.times = { 0.5, 0.7, 0.9 };
  poses.points.resize(3, lines.points);
  poses.status.resize(3, poses.status[0]);
  PlacementEvidence evidence;
  const double beside[] = { 0.1, 0.5, 0.9 };
  const double contrast[] = { 300.0, 150.0, 270.0 };
  const double dim[] = { 0.0, 0.3, 0.0 }; // less the usual 0.2
  for (int k = 0; k < 3; ++k)
  {
    evidence.sights.push_back(
      { std::vector<double>(count, beside[k]), std::vector<double>(count, contrast[k]) });
  }
  const auto signs = SignsOfPlacement(lines, evidence, poses, { 0.5, 0.1 });
  for (int k = 0; k < 3; ++k)
  {
    EXPECT_NEAR(signs[k][1].beside, std::max(0.0, beside[k] - UsualBeside), 1e-12);
    EXPECT_NEAR(signs[k][1].dim, dim[k], 1e-12);
    EXPECT_NEAR(signs[k][1].strays, 0.7 - UsualBeside, 1e-12); // not at the reference
  }
}

TEST(BranchPlacement, EverySignSpeaksAgainst)
{
  using Sign = double PlacementSigns::*;
  for (const Sign sign :
    { &PlacementSigns::unclear, &PlacementSigns::seldom, &PlacementSigns::swept,
      &PlacementSigns::doubtful, &PlacementSigns::vein, &PlacementSigns::unseen,
      &PlacementSigns::beside, &PlacementSigns::dim, &PlacementSigns::strays })
  {
    double before = 1.0;
    for (const double more : { 0.0, 0.2, 0.5, 0.8, 1.0 })
    {
      PlacementSigns changed;
      changed.*sign += more;
      const double said = PlacementConfidence(changed);
      EXPECT_LE(said, before);
      before = said;
    }
  }
}

TEST(BranchPlacement, WhatIsBesideTheLumenIsNeverConfident)
{
  // Farther than 1 mm, as the image of the phase has it, or those of the other phases.
  PlacementSigns signs;
  signs.beside = 0.71;
  EXPECT_LE(PlacementConfidence(signs), 0.5);
  signs.beside = 0.0;
  signs.strays = 0.71;
  EXPECT_LE(PlacementConfidence(signs), 0.5);
}

TEST(BranchPlacement, OneNumberForEachLine)
{
  const Polylines lines = TwoLines();
  const PoseSequence poses = AtRest(lines);
  const std::vector<PlacementSigns> signs = SignsOfPlacement(lines, {}, poses, { 0.5, 0.1 })[0];
  const std::vector<double> result = PlacementConfidences(lines, {}, poses, { 0.5, 0.1 })[0];
  EXPECT_EQ(result[3], PlacementConfidence(signs[0]));
  EXPECT_EQ(result[20], PlacementConfidence(signs[0])); // where they meet: the first
  EXPECT_EQ(result[40], PlacementConfidence(signs[1]));
}

TEST(BranchPlacement, WhatWasNotTrackedIsAsSureAsItsDeviationTells)
{
  const Polylines lines = TwoLines();
  PoseSequence poses = AtRest(lines);
  const double sure = PlacementConfidences(lines, {}, poses, { 0.5, 0.1 })[0][40];
  poses.status[0].assign(lines.points.size(), TrackingStatus::Filled);
  const std::vector<double> deviations(lines.points.size(), 2.0);
  EXPECT_NEAR(PlacementConfidences(lines, {}, poses, { 0.5, 0.1 }, { deviations })[0][40],
    sure * ConfidenceOfDeviation(2.0), 1e-12);
}

TEST(BranchPlacement, DeviationsAreMaxwells)
{
  EXPECT_EQ(ConfidenceOfDeviation(0.0), 1.0);
  // Within the deviation itself: 0.608 of three normal coordinates.
  EXPECT_NEAR(ConfidenceOfDeviation(1.0), 0.6084, 1e-4);
  EXPECT_NEAR(ConfidenceOfDeviation(3.0), 0.0464, 1e-4);
  EXPECT_LT(ConfidenceOfDeviation(100.0), 1e-4);
}

TEST(BranchPlacement, RefusesOtherLines)
{
  const Polylines lines = TwoLines();
  PoseSequence poses = AtRest(lines);
  poses.status.clear();
  EXPECT_THROW(SignsOfPlacement(lines, {}, poses, { 0.5, 0.1 }), std::invalid_argument);
  poses = AtRest(lines);
  poses.status[0].pop_back();
  EXPECT_THROW(SignsOfPlacement(lines, {}, poses, { 0.5, 0.1 }), std::invalid_argument);
  EXPECT_THROW(SignsOfPlacement(lines, { { 1.0 }, {}, {}, {} }, AtRest(lines), { 0.5, 0.1 }),
    std::invalid_argument);
  EXPECT_THROW(SignsOfPlacement(lines, { {}, { 1.0 }, {}, {} }, AtRest(lines), { 0.5, 0.1 }),
    std::invalid_argument);
  EXPECT_THROW(SignsOfPlacement(lines, { {}, {}, {}, { {}, {} } }, AtRest(lines), { 0.5, 0.1 }),
    std::invalid_argument);
}
}
}
