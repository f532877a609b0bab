// Population motion: what is exact of it, what it must look like, what bends it, and what is refused.
#include "PopulationMotion.h"

#include "CoronaryAnatomy.h"
#include "CoronaryPhantom.h"
#include "SegmentAtlas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace UnitTestPopulationMotion
{
using namespace coronary;

namespace
{
constexpr double Reference = 0.75;

/// The mean heart's pose, in whose coordinates the phantom is made.
HeartPose MeanPose()
{
  HeartPose pose;
  pose.axes = SegmentAtlas::Get().axes;
  pose.origin = SegmentAtlas::Get().origin;
  return pose;
}

VesselTree MeanTree(double time = Reference)
{
  PhantomSettings settings;
  settings.seed = 0;
  settings.centerlineSpacing = 2.0;
  return CoronaryPhantom(settings).Tree(time);
}

PatientHeart MeanHeart()
{
  return EstimateHeart(MeanTree(), MeanPose());
}

/// Branches whose segment is wanted; parents that are none of them are forgotten.
VesselTree Only(const VesselTree& tree, const std::function<bool(int)>& wanted)
{
  VesselTree some = tree;
  some.branches.clear();
  for (VesselTree::Branch branch : tree.branches)
  {
    if (wanted(branch.segmentId))
    {
      bool there = false;
      for (const VesselTree::Branch& other : some.branches)
      {
        there = there || other.groupId == branch.parentGroupId;
      }
      branch.parentGroupId = there ? branch.parentGroupId : -1;
      some.branches.push_back(branch);
    }
  }
  return some;
}

Vector3 MeanOf(const VesselTree& tree, const std::vector<Vector3>& values, int segment)
{
  Vector3 sum = Vector3::Zero();
  double count = 0.0;
  for (std::size_t n = 0; n < values.size(); ++n)
  {
    if (tree.segmentId[n] == segment)
    {
      sum += values[n];
      count += 1.0;
    }
  }
  return sum / count;
}

std::string MessageOf(const std::function<void()>& work)
{
  try
  {
    work();
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}

void ExpectRefused(const std::string& words, const std::function<void()>& work)
{
  const std::string message = MessageOf(work);
  EXPECT_NE(message.find(words), std::string::npos) << "'" << message << "' without " << words;
}
}

TEST(PopulationMotion, LeavesTheGivenPhaseAsItIs)
{
  const VesselTree tree = MeanTree();
  const PatientHeart heart = MeanHeart();
  for (const double reference : { -0.05, 0.0, 0.40, 0.75, 1.06 })
  {
    const std::vector<double> times = PopulationTimes(reference, {});
    PopulationMotionReport report;
    const PoseSequence poses =
      MoveByPopulation(LinesOf(tree), heart, reference, times, nullptr, {}, &report);
    bool met = false;
    for (std::size_t k = 0; k < times.size(); ++k)
    {
      if (times[k] == reference)
      {
        met = true;
        EXPECT_EQ(poses.points[k], tree.points);
        EXPECT_EQ(report.deviations[k].front(), 0.0);
        EXPECT_EQ(poses.status[k].front(), TrackingStatus::Tracked);
      }
      else
      {
        EXPECT_EQ(poses.status[k].front(), TrackingStatus::Filled);
        for (const double confidence : poses.confidence[k])
        {
          EXPECT_LE(confidence, 0.5);
          EXPECT_GT(confidence, 0.0);
        }
      }
    }
    EXPECT_TRUE(met) << reference;
    CheckPoseSequence(poses, tree.points.size());
  }
}

TEST(PopulationMotion, IsContinuousAndPeriodic)
{
  const Polylines lines = LinesOf(MeanTree());
  const PatientHeart heart = MeanHeart();
  const PoseSequence poses =
    MoveByPopulation(lines, heart, Reference, { 0.1, 0.75, 0.7501, 0.999, 1.0, 1.1, 1.75 });
  for (std::size_t n = 0; n < lines.points.size(); ++n)
  {
    EXPECT_LT((poses.points[0][n] - poses.points[5][n]).norm(), 1e-9);
    EXPECT_LT((poses.points[6][n] - lines.points[n]).norm(), 1e-9);
    EXPECT_LT((poses.points[2][n] - lines.points[n]).norm(), 0.05);
    EXPECT_LT((poses.points[3][n] - poses.points[4][n]).norm(), 0.2);
  }
}

TEST(PopulationMotion, WithoutAmplitudeRests)
{
  const Polylines lines = LinesOf(MeanTree());
  PopulationMotionSettings settings;
  settings.amplitude = 0.0;
  PopulationMotionReport report;
  PopulationMotionReport usual;
  const PoseSequence poses =
    MoveByPopulation(lines, MeanHeart(), Reference, { 0.35 }, nullptr, settings, &report);
  (void)MoveByPopulation(lines, MeanHeart(), Reference, { 0.35 }, nullptr, {}, &usual);
  for (std::size_t n = 0; n < lines.points.size(); ++n)
  {
    EXPECT_LT((poses.points[0][n] - lines.points[n]).norm(), 1e-9);
    // That it rests is asked for, not known.
    EXPECT_GT(report.deviations[0][n], usual.deviations[0][n] - 0.5);
  }
}

TEST(PopulationMotion, FastHeartsHaveAShortDiastole)
{
  PopulationVector values;
  for (int n = 0; n < NumberOfPopulationParameters; ++n)
  {
    values[n] = PopulationParameters()[static_cast<std::size_t>(n)].mean;
  }
  const auto peakMs = [&](double rate)
  {
    double best = 0.0;
    double time = 0.0;
    for (int k = 0; k < 2000; ++k)
    {
      const double left = PopulationClocksAt(k / 2000.0, rate, values).left;
      EXPECT_GE(left, -1e-9);
      EXPECT_LE(left, 1.0 + 1e-9);
      time = left > best ? k / 2000.0 : time;
      best = std::max(best, left);
    }
    EXPECT_NEAR(best, 1.0, 1e-3);
    return time * 60000.0 / rate;
  };
  // 341 ms at 75 beats, 2.05 ms less for each beat more.
  EXPECT_NEAR(peakMs(75.0), 341.0, 1.0);
  EXPECT_NEAR(peakMs(60.0), 341.0 + 15.0 * 2.05, 1.0);
  EXPECT_NEAR(peakMs(100.0), 341.0 - 25.0 * 2.05, 1.0);
  // Before the atrium contracts the groove is where that leaves it, and at the R wave at its highest.
  EXPECT_NEAR(PopulationClocksAt(0.02, 75.0, values).left, 0.0, 1e-6);
  EXPECT_GT(PopulationClocksAt(0.80, 75.0, values).left, values[13]);
}

TEST(PopulationMotion, LooksLikeAHeart)
{
  const VesselTree tree = MeanTree();
  const PatientHeart heart = MeanHeart();
  const PoseSequence poses = MoveByPopulation(LinesOf(tree), heart, Reference, { 0.0, 0.42 });
  std::vector<Vector3> ways;
  double nearApex = 0.0;
  for (std::size_t n = 0; n < tree.points.size(); ++n)
  {
    ways.push_back(heart.axes * (poses.points[1][n] - poses.points[0][n]));
    if ((tree.points[n] - heart.apex).norm() < 8.0)
    {
      nearApex = std::max(nearApex, ways.back().norm());
    }
  }
  EXPECT_GT(nearApex, 0.0);
  EXPECT_LT(nearApex, 4.0);
  const double right = MeanOf(tree, ways, MidRCA).norm();
  const double circumflex = MeanOf(tree, ways, DistalLCx).norm();
  const double middle = MeanOf(tree, ways, MidLAD).norm();
  EXPECT_GT(right, 15.0);
  EXPECT_LT(right, 26.0);
  EXPECT_GT(right, 1.2 * circumflex);
  EXPECT_GT(circumflex, middle);
  // The base goes down towards the apex.
  EXPECT_GT(MeanOf(tree, ways, MidRCA)[2], 12.0);
  EXPECT_GT(MeanOf(tree, ways, DistalLCx)[2], 8.0);
  // The RCA goes to the left, the circumflex to the right.
  EXPECT_GT(MeanOf(tree, ways, MidRCA)[0], 2.0);
  EXPECT_LT(MeanOf(tree, ways, DistalLCx)[0], -1.0);
}

TEST(PopulationMotion, TurnsWithTheWorld)
{
  const VesselTree tree = MeanTree();
  const Matrix3 turn = (Eigen::AngleAxisd(1.1, Vector3(1.0, 2.0, -0.5).normalized())).matrix();
  const Vector3 shift(120.0, -30.0, 55.0);
  VesselTree turned = tree;
  for (Vector3& point : turned.points)
  {
    point = turn * point + shift;
  }
  HeartPose pose = MeanPose();
  pose.axes = pose.axes * turn.transpose();
  pose.origin = turn * pose.origin + shift;
  const PatientHeart heart = EstimateHeart(turned, pose);
  const PoseSequence poses = MoveByPopulation(LinesOf(tree), MeanHeart(), Reference, { 0.3 });
  const PoseSequence others = MoveByPopulation(LinesOf(turned), heart, Reference, { 0.3 });
  for (std::size_t n = 0; n < tree.points.size(); ++n)
  {
    EXPECT_LT((turn * poses.points[0][n] + shift - others.points[0][n]).norm(), 1e-6);
  }
}

TEST(PopulationMotion, BendsToWhatWasTracked)
{
  const VesselTree tree = MeanTree();
  const Polylines lines = LinesOf(tree);
  const PatientHeart heart = MeanHeart();
  // A heart that moves more.
  PopulationMotionSettings strong;
  strong.amplitude = 1.4;
  const PoseSequence truth =
    MoveByPopulation(lines, heart, Reference, { 0.0, 0.2, 0.4, 0.6, 0.75 }, nullptr, strong);
  PoseSequence seen;
  seen.times = { 0.4, 0.75 };
  seen.points = { truth.points[2], truth.points[4] };
  PopulationMotionReport report;
  const PoseSequence bent =
    MoveByPopulation(lines, heart, Reference, truth.times, &seen, {}, &report);
  PopulationMotionReport alone;
  const PoseSequence blind =
    MoveByPopulation(lines, heart, Reference, truth.times, nullptr, {}, &alone);
  EXPECT_EQ(report.phases, 2);
  EXPECT_EQ(alone.phases, 1);
  EXPECT_EQ(bent.points[2], seen.points[0]);
  EXPECT_EQ(bent.points[4], lines.points);
  EXPECT_GT(report.mean[0], alone.mean[0] + 2.0);
  EXPECT_LT(report.deviation[0], alone.deviation[0]);
  EXPECT_LT(report.bentMisfit, 0.6 * report.populationMisfit);
  EXPECT_TRUE(std::isnan(alone.bentMisfit));
  for (std::size_t n = 0; n < lines.points.size(); ++n)
  {
    EXPECT_LT(report.deviations[2][n], 0.1);
  }
  for (const std::size_t k : { 1U, 3U })
  {
    double error = 0.0;
    double unbent = 0.0;
    for (std::size_t n = 0; n < lines.points.size(); ++n)
    {
      error += (bent.points[k][n] - truth.points[k][n]).norm();
      unbent += (blind.points[k][n] - truth.points[k][n]).norm();
    }
    EXPECT_LT(error, 0.5 * unbent) << truth.times[k];
  }
}

TEST(PopulationMotion, GivesPhasesThatSayNothingNoWeight)
{
  const Polylines lines = LinesOf(MeanTree());
  const PatientHeart heart = MeanHeart();
  PoseSequence seen;
  seen.times = { 0.751, 1.75 };
  seen.points = { lines.points, lines.points };
  PopulationMotionReport report;
  (void)MoveByPopulation(lines, heart, Reference, { 0.3 }, &seen, {}, &report);
  EXPECT_EQ(report.phases, 1);
  ASSERT_EQ(report.warnings.size(), 1U);
  seen.times = { 0.4, 0.75 };
  seen.confidence.assign(2, std::vector<double>(lines.points.size(), 0.1));
  (void)MoveByPopulation(lines, heart, Reference, { 0.3 }, &seen, {}, &report);
  EXPECT_EQ(report.phases, 1);
  ASSERT_EQ(report.warnings.size(), 1U);
}

TEST(PopulationMotion, OffersTheGivenMoments)
{
  const std::vector<double> even = PopulationTimes(0.75, {});
  ASSERT_EQ(even.size(), 20U);
  EXPECT_DOUBLE_EQ(even[1], 0.05);
  const std::vector<double> times = PopulationTimes(0.76, { 0.40, 0.411, 0.755, 1.02 });
  EXPECT_TRUE(std::find(times.begin(), times.end(), 0.76) != times.end());
  EXPECT_TRUE(std::find(times.begin(), times.end(), 0.40) != times.end());
  EXPECT_TRUE(std::find(times.begin(), times.end(), 1.02) != times.end());
  EXPECT_TRUE(std::find(times.begin(), times.end(), 0.411) == times.end());
  EXPECT_TRUE(std::find(times.begin(), times.end(), 0.75) == times.end());
}

TEST(PatientHeart, IsFoundFromTheNamedTree)
{
  const PatientHeart heart = MeanHeart();
  const SegmentAtlas& atlas = SegmentAtlas::Get();
  // The plane's normal and the apex differ by 16 degrees in the mean heart: the axis lies between.
  EXPECT_GT(heart.axes.row(2).dot(atlas.axes.row(2)), std::cos(12.0 * EIGEN_PI / 180.0));
  EXPECT_LT((heart.base - atlas.origin).norm(), 6.0);
  EXPECT_NEAR(heart.length, 91.5, 10.0);
  EXPECT_LT((heart.leftOstium - atlas.leftOstium).norm(), 6.0);
  EXPECT_LT((heart.rightOstium - atlas.rightOstium).norm(), 6.0);
  EXPECT_NEAR(heart.axes.determinant(), 1.0, 1e-9);
}

TEST(PatientHeart, IsLessCertainWhereVesselsAreMissing)
{
  const VesselTree tree = MeanTree();
  const auto isRight = [](int segment)
  {
    return segment == ProximalRCA || segment == MidRCA || segment == DistalRCA ||
      segment == RightPDA || segment == RightPLB;
  };
  const PatientHeart whole = EstimateHeart(tree, MeanPose());
  const PatientHeart left =
    EstimateHeart(Only(tree, [&](int segment) { return !isRight(segment); }), MeanPose());
  const PatientHeart right = EstimateHeart(Only(tree, isRight), MeanPose());
  const PatientHeart stump =
    EstimateHeart(Only(tree, [](int segment) { return segment == ProximalLAD; }), MeanPose());
  EXPECT_GT(left.axisDeviation, whole.axisDeviation);
  EXPECT_GT(right.axisDeviation, whole.axisDeviation);
  EXPECT_GT(stump.axisDeviation, left.axisDeviation);
  EXPECT_GT(stump.lengthDeviation, whole.lengthDeviation);
  for (const PatientHeart& heart : { left, right, stump })
  {
    EXPECT_LT(std::acos(heart.axes.row(2).dot(whole.axes.row(2))), 3.0 * heart.axisDeviation);
    EXPECT_LT((heart.base - whole.base).norm(), 3.0 * heart.baseDeviation);
  }
  const auto tells = [](const PatientHeart& heart, const std::string& words)
  {
    for (const std::string& sentence : heart.from)
    {
      if (sentence.find(words) != std::string::npos)
      {
        return true;
      }
    }
    return false;
  };
  EXPECT_TRUE(tells(whole, "both ostia"));
  EXPECT_TRUE(tells(left, "no RCA"));
  EXPECT_TRUE(tells(left, "the left ostium"));
  EXPECT_TRUE(tells(right, "no LCx"));
  EXPECT_TRUE(tells(right, "the right ostium"));
  EXPECT_TRUE(tells(stump, "apex: as in the mean heart"));
}

TEST(PatientHeart, RefusesWhatIsNoHeart)
{
  const VesselTree tree = MeanTree();
  ExpectRefused("no segment that is named",
    [&]
    {
      (void)EstimateHeart(
        Only(tree, [](int segment) { return segment == FirstDiagonal; }), MeanPose());
    });
  HeartPose pose = MeanPose();
  pose.axes.row(0) *= -1.0;
  ExpectRefused("mirrored", [&] { (void)EstimateHeart(tree, pose); });
  pose = MeanPose();
  pose.size = 0.1;
  ExpectRefused("are positions in mm", [&] { (void)EstimateHeart(tree, pose); });
  pose.size = std::numeric_limits<double>::quiet_NaN();
  ExpectRefused("not finite", [&] { (void)EstimateHeart(tree, pose); });
  VesselTree mirrored = tree;
  for (Vector3& point : mirrored.points)
  {
    point[0] = -point[0];
  }
  ExpectRefused("the tree is mirrored", [&] { (void)EstimateHeart(mirrored, MeanPose()); });
  VesselTree broken = tree;
  broken.points[0][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)EstimateHeart(broken, MeanPose()), std::invalid_argument);
}

TEST(PopulationMotion, RefusesWhatItCannotUse)
{
  const Polylines lines = LinesOf(MeanTree());
  const PatientHeart heart = MeanHeart();
  const auto move = [&](const PopulationMotionSettings& settings, double reference,
                      const std::vector<double>& times, const PoseSequence* seen)
  { (void)MoveByPopulation(lines, heart, reference, times, seen, settings); };
  PopulationMotionSettings settings;
  settings.heartRate = 20.0;
  ExpectRefused("heartRate", [&] { move(settings, 0.75, { 0.3 }, nullptr); });
  settings = {};
  settings.amplitude = -0.1;
  ExpectRefused("amplitude", [&] { move(settings, 0.75, { 0.3 }, nullptr); });
  settings = {};
  ExpectRefused("no times", [&] { move(settings, 0.75, {}, nullptr); });
  ExpectRefused("do not increase", [&] { move(settings, 0.75, { 0.3, 0.3 }, nullptr); });
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  ExpectRefused("reference time", [&] { move(settings, nan, { 0.3 }, nullptr); });
  PoseSequence seen;
  seen.times = { 0.4 };
  seen.points = { { Vector3::Zero() } };
  ExpectRefused("points", [&] { move(settings, 0.75, { 0.3 }, &seen); });
}
}
