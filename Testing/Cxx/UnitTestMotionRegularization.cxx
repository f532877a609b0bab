// Regularised motion: what stays, what is removed, limits, closed forms, invariance.
#include "MotionRegularization.h"

#include "CoronaryPhantom.h"
#include "MotionTestData.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace UnitTestMotionRegularization
{
using coronary::MotionEnergies;
using coronary::MotionEnergy;
using coronary::MotionRegularizationSettings;
using coronary::Polylines;
using coronary::PoseSequence;
using coronary::RegularizedMotion;
using coronary::RegularizeMotion;
using coronary::Vector3;

namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr double Infinity = std::numeric_limits<double>::infinity();

/// One line along x with `points` points of `step` mm.
Polylines Straight(int points, double step)
{
  Polylines lines;
  lines.lines.emplace_back();
  for (int n = 0; n < points; ++n)
  {
    lines.points.emplace_back(step * n, 0.0, 0.0);
    lines.lines[0].push_back(n);
  }
  return lines;
}

/// A line with a side branch at its middle, curved.
Polylines Fork()
{
  Polylines lines;
  for (int n = 0; n < 21; ++n)
  {
    lines.points.emplace_back(2.0 * n, 5.0 * std::sin(0.1 * n), 0.0);
  }
  for (int n = 1; n < 8; ++n)
  {
    lines.points.push_back(lines.points[10] + Vector3(1.2 * n, 0.0, 1.6 * n));
  }
  lines.lines = { {}, { 10 } };
  for (int n = 0; n < 21; ++n)
  {
    lines.lines[0].push_back(n);
  }
  for (int n = 21; n < 28; ++n)
  {
    lines.lines[1].push_back(n);
  }
  return lines;
}

std::vector<double> Even(int count)
{
  std::vector<double> times;
  for (int k = 0; k < count; ++k)
  {
    times.push_back(static_cast<double>(k) / count);
  }
  return times;
}

/// What a heart does: up and down, and a turn.
Vector3 Beat(const Vector3& rest, double t)
{
  const double s = 0.5 - 0.5 * std::cos(2.0 * Pi * t) + 0.15 * std::sin(4.0 * Pi * t);
  const Eigen::AngleAxisd turn(0.15 * s, Vector3::UnitZ());
  return turn * rest + Vector3(2.0, -1.0, 6.0) * s;
}

template <typename Function>
PoseSequence Move(
  const Polylines& lines, const std::vector<double>& times, const Function& function)
{
  PoseSequence sequence;
  sequence.times = times;
  for (const double time : times)
  {
    sequence.points.emplace_back();
    for (const Vector3& rest : lines.points)
    {
      sequence.points.back().push_back(function(rest, time));
    }
  }
  return sequence;
}

void SetConfidence(PoseSequence& sequence, double value)
{
  sequence.confidence.assign(
    sequence.times.size(), std::vector<double>(sequence.points[0].size(), value));
}

double Maximum(const PoseSequence& a, const PoseSequence& b)
{
  double maximum = 0.0;
  for (std::size_t k = 0; k < a.points.size(); ++k)
  {
    for (std::size_t n = 0; n < a.points[k].size(); ++n)
    {
      maximum = std::max(maximum, (a.points[k][n] - b.points[k][n]).norm());
    }
  }
  return maximum;
}

double Mean(const PoseSequence& a, const PoseSequence& b)
{
  double sum = 0.0;
  for (std::size_t k = 0; k < a.points.size(); ++k)
  {
    for (std::size_t n = 0; n < a.points[k].size(); ++n)
    {
      sum += (a.points[k][n] - b.points[k][n]).norm();
    }
  }
  return sum / static_cast<double>(a.points.size() * a.points[0].size());
}

MotionRegularizationSettings NoWeights()
{
  MotionRegularizationSettings settings;
  settings.temporalWeight = settings.spatialWeight = settings.velocityWeight = 0.0;
  settings.measureNoise = false;
  return settings;
}

}

TEST(MotionRegularization, SmoothMotionStays)
{
  const Polylines lines = Fork();
  const PoseSequence motion = Move(lines, Even(20), Beat);
  const RegularizedMotion same = RegularizeMotion(motion, lines, NoWeights());
  EXPECT_LT(Maximum(same.poses, motion), 1e-6);
  EXPECT_EQ(same.iterations, 0);
  EXPECT_EQ(same.violations, 0);
  for (const std::int64_t count : same.clamped)
  {
    EXPECT_EQ(count, 0);
  }
  // With the weights of the defaults: less than a tenth of a tracking error.
  const RegularizedMotion smoothed = RegularizeMotion(motion, lines);
  EXPECT_LT(Maximum(smoothed.poses, motion), 0.03);
  EXPECT_LE(smoothed.after.objective, smoothed.before.objective);
}

TEST(MotionRegularization, TheDefaultsHardlyMoveThePhantom)
{
  coronary::PhantomSettings settings;
  settings.centerlineSpacing = 2.0;
  const coronary::CoronaryPhantom phantom(settings);
  Polylines lines = coronary::LinesOf(phantom.Tree(0.75));
  lines.radius.clear();
  PoseSequence truth;
  truth.times = coronary::PaperPhases();
  for (const double time : truth.times)
  {
    truth.points.push_back(phantom.Tree(time).points);
  }
  const RegularizedMotion smoothed = RegularizeMotion(truth, lines);
  RecordProperty("mean", std::to_string(Mean(smoothed.poses, truth)));
  RecordProperty("greatest", std::to_string(Maximum(smoothed.poses, truth)));
  EXPECT_LT(Mean(smoothed.poses, truth), 0.03);
  EXPECT_LT(Maximum(smoothed.poses, truth), 0.3);
  // Noise of 0.3 mm an axis becomes less.
  PoseSequence noisy = truth;
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0.0, 0.3);
  for (auto& phase : noisy.points)
  {
    for (Vector3& point : phase)
    {
      point += Vector3(noise(random), noise(random), noise(random));
    }
  }
  MotionRegularizationSettings strong = NoLimits();
  strong.temporalWeight = 0.02;
  strong.spatialWeight = 3.0;
  strong.velocityWeight = 0.5;
  const double before = Mean(noisy, truth);
  const double after = Mean(RegularizeMotion(noisy, lines, strong).poses, truth);
  RecordProperty("noisy", std::to_string(before));
  RecordProperty("smoothed", std::to_string(after));
  EXPECT_LT(after, 0.65 * before);
}

TEST(MotionRegularization, ASpikeInALostNodeIsRemoved)
{
  const Polylines lines = Fork();
  const PoseSequence truth = Move(lines, Even(20), Beat);
  PoseSequence spoiled = truth;
  SetConfidence(spoiled, 1.0);
  for (const int n : { 6, 7, 24 })
  {
    spoiled.points[8][n] += Vector3(7.0, -9.0, 12.0);
    spoiled.confidence[8][n] = 0.0;
  }
  const RegularizedMotion result = RegularizeMotion(spoiled, lines);
  EXPECT_LT(Maximum(result.poses, truth), 0.15);
  EXPECT_EQ(result.violations, 0);
  EXPECT_NE(result.clamps[8][6] & (coronary::ClampStrain | coronary::ClampStep), 0);
  EXPECT_EQ(result.clamps[2][15], 0);
  EXPECT_LT(result.after.temporal, result.before.temporal);
  EXPECT_LT(result.after.spatial, result.before.spatial);
  EXPECT_LT(result.after.total, result.before.total);
}

TEST(MotionRegularization, AWholeLostPhaseIsFilled)
{
  const Polylines lines = Fork();
  const PoseSequence truth = Move(lines, Even(20), Beat);
  PoseSequence spoiled = truth;
  SetConfidence(spoiled, 1.0);
  for (std::size_t n = 0; n < lines.points.size(); ++n)
  {
    spoiled.points[12][n] = lines.points[n];
    spoiled.confidence[12][n] = 0.0;
  }
  const RegularizedMotion result = RegularizeMotion(spoiled, lines);
  EXPECT_LT(Maximum(result.poses, truth), 0.3);
}

TEST(MotionRegularization, WellTrackedPointsMoveByTheToleranceAtMost)
{
  const Polylines lines = Fork();
  PoseSequence motion = Move(lines, Even(12), Beat);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  SetConfidence(motion, 0.0);
  for (std::size_t k = 0; k < 12; ++k)
  {
    for (std::size_t n = 0; n < lines.points.size(); ++n)
    {
      motion.points[k][n] += Vector3(noise(random), noise(random), noise(random));
      motion.confidence[k][n] = any(random);
    }
  }
  MotionRegularizationSettings settings;
  settings.wellTracked = 0.6;
  settings.spatialWeight = 10.0;
  settings.temporalWeight = 1.0;
  for (const double tolerance : { 0.0, 0.1, 0.3 })
  {
    settings.tolerance = tolerance;
    const RegularizedMotion result = RegularizeMotion(motion, lines, settings);
    double others = 0.0;
    for (std::size_t k = 0; k < 12; ++k)
    {
      for (std::size_t n = 0; n < lines.points.size(); ++n)
      {
        const double moved = (result.poses.points[k][n] - motion.points[k][n]).norm();
        if (motion.confidence[k][n] >= 0.6)
        {
          EXPECT_LE(moved, tolerance + 3.0 * result.noise[k] + 1e-9);
        }
        else
        {
          others = std::max(others, moved);
        }
      }
    }
    EXPECT_GT(others, 0.5);
    EXPECT_GT(result.clamped[4], 0);
  }
}

TEST(MotionRegularization, NoiseIsMeasuredAndSmoothed)
{
  const Polylines lines = Straight(161, 0.5);
  const PoseSequence truth = Move(lines, Even(12), Beat);
  PoseSequence noisy = truth;
  std::mt19937 random(11);
  std::normal_distribution<double> any(0.0, 0.6);
  SetConfidence(noisy, 0.9);
  const auto isNoisy = [](std::size_t k) { return k % 3 == 0; };
  for (std::size_t k = 0; k < 12; ++k)
  {
    for (Vector3& point : noisy.points[k])
    {
      point += isNoisy(k) ? Vector3(any(random), any(random), any(random)) : Vector3::Zero();
    }
  }
  const auto errorOf = [&](const PoseSequence& motion, std::size_t k)
  {
    double sum = 0.0;
    for (std::size_t n = 0; n < lines.points.size(); ++n)
    {
      sum += (motion.points[k][n] - truth.points[k][n]).norm();
    }
    return sum / static_cast<double>(lines.points.size());
  };
  MotionRegularizationSettings settings;
  const RegularizedMotion result = RegularizeMotion(noisy, lines, settings);
  settings.measureNoise = false;
  const RegularizedMotion without = RegularizeMotion(noisy, lines, settings);
  for (std::size_t k = 0; k < 12; ++k)
  {
    EXPECT_NEAR(result.noise[k], isNoisy(k) ? 0.6 : 0.0, 0.1) << k;
    EXPECT_EQ(without.noise[k], 0.0);
    if (isNoisy(k))
    {
      EXPECT_LT(errorOf(result.poses, k), 0.3 * errorOf(noisy, k)) << k;
      EXPECT_LT(errorOf(result.poses, k), 0.5 * errorOf(without.poses, k)) << k;
    }
    else
    {
      EXPECT_LT(errorOf(result.poses, k), 0.1) << k;
    }
  }
}

TEST(MotionRegularization, AStretchedLineComesBackToTheLimit)
{
  const Polylines lines = Straight(11, 4.0);
  const auto stretched = [](const Vector3& rest, double t) -> Vector3 {
    return { rest.x() * (t > 0.45 && t < 0.7 ? 1.5 : 1.0), 0.0, 0.0 };
  };
  MotionRegularizationSettings settings = NoWeights();
  settings.maximumStrain = 0.1;
  settings.maximumStep = Infinity;
  const PoseSequence motion = Move(lines, Even(6), stretched);
  const RegularizedMotion result = RegularizeMotion(motion, lines, settings);
  EXPECT_GT(result.iterations, 0);
  EXPECT_EQ(result.violations, 0);
  for (int n = 0; n < 10; ++n)
  {
    EXPECT_NEAR((result.poses.points[3][n + 1] - result.poses.points[3][n]).norm(), 4.4, 0.005);
    EXPECT_NEAR((result.poses.points[1][n + 1] - result.poses.points[1][n]).norm(), 4.0, 1e-9);
    EXPECT_EQ(result.clamps[3][n], coronary::ClampStrain);
    EXPECT_EQ(result.clamps[1][n], 0);
  }
  // Least moves: about its middle.
  EXPECT_NEAR(result.poses.points[3][5].x(), 30.0, 0.01);
  EXPECT_NEAR(result.strain[3][0], 0.1, 1e-3);
  EXPECT_NEAR(result.stress[3][0], 0.1 * settings.youngsModulus, 2e-3);
  EXPECT_NEAR(result.strain[1][0], 0.0, 1e-9);
  // Too short is not better.
  const PoseSequence shrunk = Move(lines, Even(6),
    [](const Vector3& rest, double t) -> Vector3 { return rest * (t > 0.45 ? 0.5 : 1.0); });
  const RegularizedMotion longer = RegularizeMotion(shrunk, lines, settings);
  EXPECT_NEAR((longer.poses.points[4][8] - longer.poses.points[4][7]).norm(), 3.6, 0.005);
}

TEST(MotionRegularization, CornersAreKeptWithinTheLimits)
{
  Polylines lines = Straight(9, 3.0);
  const auto kinked = [](const Vector3& rest, double t) -> Vector3
  {
    // A kink of 100 degrees at x = 12, at one phase.
    const double beyond = std::max(0.0, rest.x() - 12.0);
    const double angle = t > 0.4 && t < 0.6 ? 100.0 / 180.0 * Pi : 0.0;
    return { std::min(rest.x(), 12.0) + beyond * std::cos(angle), beyond * std::sin(angle), 0.0 };
  };
  const PoseSequence motion = Move(lines, Even(4), kinked);
  const auto bending = [](const std::vector<Vector3>& points, int n)
  {
    const Vector3 a = points[n] - points[n - 1];
    const Vector3 b = points[n + 1] - points[n];
    return std::atan2(a.cross(b).norm(), a.dot(b));
  };
  MotionRegularizationSettings settings = NoWeights();
  settings.maximumStep = Infinity;
  settings.minimumCurvatureRadius = 0.0;
  settings.maximumBending = 0.5;
  const RegularizedMotion bent = RegularizeMotion(motion, lines, settings);
  for (int n = 1; n < 8; ++n)
  {
    EXPECT_LT(bending(bent.poses.points[2], n), 0.5 + 0.01) << n;
  }
  EXPECT_NEAR(bending(bent.poses.points[2], 4), 0.5, 0.01);
  EXPECT_EQ(bent.clamps[2][4] & coronary::ClampBending, coronary::ClampBending);
  EXPECT_EQ(bent.clamps[0][4], 0);
  EXPECT_EQ(bent.violations, 0);

  settings.maximumBending = Pi;
  settings.minimumCurvatureRadius = 6.0;
  const RegularizedMotion round = RegularizeMotion(motion, lines, settings);
  EXPECT_EQ(round.violations, 0);
  EXPECT_EQ(round.clamps[2][4] & coronary::ClampCurvature, coronary::ClampCurvature);
  for (int n = 1; n < 8; ++n)
  {
    const std::vector<Vector3>& p = round.poses.points[2];
    const double radius = (p[n + 1] - p[n - 1]).norm() / (2.0 * std::sin(bending(p, n)));
    EXPECT_GT(radius, 5.8) << n;
  }
  // What is sharp at rest may stay so.
  Polylines sharp = lines;
  for (Vector3& point : sharp.points)
  {
    point = kinked(point, 0.5);
  }
  const PoseSequence still = Move(sharp, Even(4), [](const Vector3& rest, double) { return rest; });
  settings.maximumBending = 0.5;
  EXPECT_LT(Maximum(RegularizeMotion(still, sharp, settings).poses, still), 1e-6);
}

TEST(MotionRegularization, StepsBetweenPhasesAreKept)
{
  const Polylines lines = Straight(5, 4.0);
  const PoseSequence motion = Move(lines, Even(8),
    [](const Vector3& rest, double t) -> Vector3
    { return rest + Vector3(0, t == 0.5 ? 10.0 : 0.0, 0); });
  MotionRegularizationSettings settings = NoWeights();
  settings.maximumStep = 3.0;
  const RegularizedMotion result = RegularizeMotion(motion, lines, settings);
  EXPECT_EQ(result.violations, 0);
  for (std::size_t k = 0; k < 8; ++k)
  {
    for (std::size_t n = 0; n < 5; ++n)
    {
      EXPECT_LT((result.poses.points[(k + 1) % 8][n] - result.poses.points[k][n]).norm(), 3.005);
    }
  }
  EXPECT_GT(result.poses.points[4][2].y(), 3.0);
  EXPECT_EQ(result.clamps[4][2], coronary::ClampStep);
}

TEST(MotionRegularization, ClosedFormOfTheEnergies)
{
  // A straight line that goes to and fro as a whole: Laplacian only at the ends.
  const Polylines lines = Straight(7, 2.0);
  const int phases = 10;
  const double amplitude = 4.0;
  const PoseSequence motion = Move(lines, Even(phases),
    [&](const Vector3& rest, double t) -> Vector3
    { return rest + Vector3(0, 0, amplitude * std::cos(2.0 * Pi * t)); });
  MotionRegularizationSettings settings;
  settings.temporalWeight = 0.3;
  settings.spatialWeight = 0.7;
  const MotionEnergies energies = coronary::EnergiesOf(motion, motion, lines, settings);
  // Sum of (cos(a + d) - cos a)^2 over a circle is n (1 - cos d).
  EXPECT_NEAR(energies.temporal,
    7.0 * amplitude * amplitude * phases * (1.0 - std::cos(2.0 * Pi / phases)), 1e-9);
  EXPECT_NEAR(energies.spatial, 2.0 * 2.0 * 2.0 * phases, 1e-9);
  EXPECT_NEAR(energies.total, 0.3 * energies.temporal + 0.7 * energies.spatial, 1e-9);
  // Acceleration of a cosine, no bending of the displacement, no difference of velocities.
  const double second = 2.0 - 2.0 * std::cos(2.0 * Pi / phases);
  EXPECT_NEAR(
    energies.objective, 0.3 * 7.0 * 0.5 * phases * amplitude * amplitude * second * second, 1e-9);
  settings.energy = MotionEnergy::Position;
  settings.velocityWeight = 0.0;
  EXPECT_NEAR(
    coronary::EnergiesOf(motion, motion, lines, settings).objective, energies.total, 1e-9);
}

TEST(MotionRegularization, EquationsAreThoseOfTheMinimum)
{
  // One harmonic of one point: the minimum has the amplitude 1 / (1 + w e), e: energy over norm.
  Polylines lines;
  lines.points = { Vector3(1, 2, 3) };
  const int phases = 16;
  const PoseSequence motion = Move(lines, Even(phases),
    [&](const Vector3& rest, double t) -> Vector3
    { return rest + Vector3(0, 5.0 * std::cos(2.0 * Pi * t), 0); });
  MotionRegularizationSettings settings;
  settings.temporalWeight = 2.0;
  const double second = 2.0 - 2.0 * std::cos(2.0 * Pi / phases);
  const RegularizedMotion smooth = RegularizeMotion(motion, lines, settings);
  EXPECT_NEAR(smooth.poses.points[0][0].y() - 2.0, 5.0 / (1.0 + 2.0 * second * second), 1e-9);
  settings.energy = MotionEnergy::Position;
  const RegularizedMotion shrunk = RegularizeMotion(motion, lines, settings);
  EXPECT_NEAR(shrunk.poses.points[0][0].y() - 2.0, 5.0 / (1.0 + 2.0 * second), 1e-9);
}

TEST(MotionRegularization, VelocityIsDiffusedAlongTheVessel)
{
  // Neighbours that move against each other: Eq. 13 evens their velocity out, not their places.
  const Polylines lines = Straight(40, 1.0);
  const PoseSequence motion = Move(lines, Even(12),
    [&](const Vector3& rest, double t) -> Vector3
    {
      const int n = static_cast<int>(std::lround(rest.x()));
      return rest + Vector3(0, (n % 2 ? 1.0 : -1.0) * (0.4 + 0.3 * std::cos(2.0 * Pi * t)), 0);
    });
  MotionRegularizationSettings settings = NoLimits();
  settings.temporalWeight = settings.spatialWeight = 0.0;
  settings.velocityWeight = 10.0;
  const RegularizedMotion result = RegularizeMotion(motion, lines, settings);
  const double moving = result.poses.points[0][20].y() - result.poses.points[6][20].y();
  // Far from the ends: the highest frequency along the line, the first one in time.
  const double damping = 1.0 + 10.0 * 4.0 * (2.0 - 2.0 * std::cos(2.0 * Pi / 12.0));
  EXPECT_NEAR(moving, -0.6 / damping, 1e-4);
  double mean = 0.0;
  for (int k = 0; k < 12; ++k)
  {
    mean += result.poses.points[k][20].y() / 12.0;
  }
  EXPECT_NEAR(mean, -0.4, 1e-9);
}

TEST(MotionRegularization, MovesAndScalesWithTheWorld)
{
  Polylines lines = Fork();
  PoseSequence motion = Move(lines, coronary::PaperPhases(), Beat);
  SetConfidence(motion, 0.9);
  motion.points[4][7] += Vector3(5, 5, -5);
  motion.confidence[4][7] = 0.6;
  motion.points[9][25] += Vector3(9, 0, 0);
  motion.confidence[9][25] = 0.0;
  MotionRegularizationSettings settings;
  const RegularizedMotion here = RegularizeMotion(motion, lines, settings);
  EXPECT_GT(here.iterations, 0);
  const double scale = 2.5;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(2.0, Vector3(0.0, 0.6, -0.8)));
  const auto map = [&](const Vector3& p) -> Vector3
  { return scale * (turn * p) + Vector3(300, -120, 44); };
  for (Vector3& point : lines.points)
  {
    point = map(point);
  }
  for (auto& phase : motion.points)
  {
    for (Vector3& point : phase)
    {
      point = map(point);
    }
  }
  settings.minimumCurvatureRadius *= scale;
  settings.maximumStep *= scale;
  settings.tolerance *= scale;
  settings.precision *= scale;
  const RegularizedMotion there = RegularizeMotion(motion, lines, settings);
  EXPECT_EQ(here.clamps, there.clamps);
  for (std::size_t k = 0; k < 20; ++k)
  {
    for (std::size_t n = 0; n < lines.points.size(); ++n)
    {
      EXPECT_LT((map(here.poses.points[k][n]) - there.poses.points[k][n]).norm(), 1e-6);
    }
  }
  EXPECT_NEAR(there.after.objective, scale * scale * here.after.objective, 1e-6);
  // The beginning of the cycle means nothing.
  PoseSequence later = motion;
  for (double& time : later.times)
  {
    time += 3.25;
  }
  EXPECT_LT(Maximum(RegularizeMotion(later, lines, settings).poses, there.poses), 1e-6);
}

TEST(MotionRegularization, SameBitsOnAnyNumberOfThreads)
{
  const Polylines lines = Fork();
  PoseSequence motion = Move(lines, Even(20), Beat);
  SetConfidence(motion, 0.9);
  motion.points[4][7] += Vector3(5, 5, -5);
  motion.confidence[4][7] = 0.6;
  std::vector<std::vector<Vector3>> results[2];
  for (const int threads : { 1, 4 })
  {
    coronary::SetNumberOfThreads(threads);
    results[threads == 4] = RegularizeMotion(motion, lines).poses.points;
  }
  coronary::SetNumberOfThreads(0);
  for (std::size_t k = 0; k < 20; ++k)
  {
    EXPECT_EQ(std::memcmp(
                results[0][k].data(), results[1][k].data(), results[0][k].size() * sizeof(Vector3)),
      0);
  }
}

TEST(MotionRegularization, BonesTurnWithTheirJoints)
{
  Polylines bones;
  for (int n = 0; n < 6; ++n)
  {
    bones.points.emplace_back(5.0 * n, 0.0, 0.0);
    if (n > 0)
    {
      bones.lines.push_back({ n - 1, n });
    }
  }
  PoseSequence motion = Move(bones, Even(8), Beat);
  SetConfidence(motion, 1.0);
  const Vector3 spike(0, 12, 0);
  motion.points[3][5] += spike;
  motion.confidence[3][5] = 0.0;
  for (std::size_t k = 0; k < 8; ++k)
  {
    motion.rotation.emplace_back();
    for (std::size_t b = 0; b < 5; ++b)
    {
      const Vector3 now = motion.points[k][b + 1] - motion.points[k][b];
      motion.rotation[k].push_back(Eigen::Quaterniond::FromTwoVectors(Vector3::UnitX(), now));
    }
  }
  const RegularizedMotion result = RegularizeMotion(motion, bones);
  for (std::size_t k = 0; k < 8; ++k)
  {
    for (std::size_t b = 0; b < 5; ++b)
    {
      const Vector3 now = (result.poses.points[k][b + 1] - result.poses.points[k][b]).normalized();
      EXPECT_LT((result.poses.rotation[k][b] * Vector3::UnitX() - now).norm(), 1e-9);
    }
  }
  EXPECT_LT((result.poses.points[3][5] - Beat(bones.points[5], 3.0 / 8.0)).norm(), 0.5);
  EXPECT_NE(result.clamps[3][4] & coronary::ClampBending, 0);
}

TEST(MotionRegularization, Nothing)
{
  Polylines none;
  PoseSequence motion;
  motion.times = { 0.0, 0.5 };
  motion.points.resize(2);
  const RegularizedMotion result = RegularizeMotion(motion, none);
  EXPECT_EQ(result.poses.points.size(), 2U);
  EXPECT_EQ(result.after.objective, 0.0);
}

TEST(MotionRegularization, Refusals)
{
  const Polylines good = Straight(4, 2.0);
  const PoseSequence motion = Move(good, Even(4), Beat);
  const auto refuse = [&](const std::string& part, const auto& spoil)
  {
    Polylines lines = good;
    PoseSequence sequence = motion;
    MotionRegularizationSettings settings;
    spoil(sequence, lines, settings);
    ExpectRefusal([&] { RegularizeMotion(sequence, lines, settings); }, part);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuse("one phase", [](auto& s, auto&, auto&) { s.times.resize(1), s.points.resize(1); });
  refuse("points", [](auto& s, auto&, auto&) { s.points[2].pop_back(); });
  refuse("not finite", [&](auto& s, auto&, auto&) { s.points[2][1].x() = nan; });
  refuse("no length at rest", [](auto&, auto& l, auto&) { l.points[2] = l.points[1]; });
  refuse("does not exist", [](auto&, auto& l, auto&) { l.lines[0].push_back(4); });
  refuse("temporalWeight", [](auto&, auto&, auto& set) { set.temporalWeight = -1.0; });
  refuse("spatialWeight", [&](auto&, auto&, auto& set) { set.spatialWeight = nan; });
  refuse("velocityWeight", [](auto&, auto&, auto& set) { set.velocityWeight = Infinity; });
  refuse("maximumBending", [](auto&, auto&, auto& set) { set.maximumBending = 0.0; });
  refuse(
    "minimumCurvatureRadius", [](auto&, auto&, auto& set) { set.minimumCurvatureRadius = -1.0; });
  refuse("maximumStrain", [](auto&, auto&, auto& set) { set.maximumStrain = 0.0; });
  refuse("maximumStep", [&](auto&, auto&, auto& set) { set.maximumStep = nan; });
  refuse("wellTracked", [](auto&, auto&, auto& set) { set.wellTracked = 2.0; });
  refuse("tolerance", [](auto&, auto&, auto& set) { set.tolerance = -0.1; });
  refuse("youngsModulus", [](auto&, auto&, auto& set) { set.youngsModulus = 0.0; });
  refuse("iterations", [](auto&, auto&, auto& set) { set.iterations = 0; });
  refuse("precision", [](auto&, auto&, auto& set) { set.precision = 0.0; });
  refuse("energy", [](auto&, auto&, auto& set) { set.energy = static_cast<MotionEnergy>(2); });
  EXPECT_THROW(
    RegularizeMotion(motion, good, {}, [](double) { return false; }), coronary::Cancelled);
}
}
