// Interpolation between the phases of a cycle: closed forms, the seam, repetitions, noise, rotations.
#include "PhaseInterpolation.h"

#include "CoronaryPhantom.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace UnitTestPhaseInterpolation
{
using coronary::InterpolatedPose;
using coronary::PhaseInterpolation;
using coronary::PhaseInterpolationMode;
using coronary::PhaseInterpolationSettings;
using coronary::PoseSequence;
using coronary::TrackingStatus;
using coronary::Vector3;
using Quaternion = Eigen::Quaterniond;

namespace
{
constexpr double Pi = 3.14159265358979323846;
const PhaseInterpolationMode Modes[] = { PhaseInterpolationMode::Linear,
  PhaseInterpolationMode::PeriodicCubic, PhaseInterpolationMode::LowNoise };

PhaseInterpolationSettings With(PhaseInterpolationMode mode, double tolerance = 0.01)
{
  PhaseInterpolationSettings settings;
  settings.mode = mode;
  settings.mergeTolerance = tolerance;
  return settings;
}

/// Two spatial modes with a few harmonics each; the points are on a line.
Vector3 Smooth(int point, double t)
{
  const double s = 0.01 * point;
  const double first = 6.0 * std::cos(2.0 * Pi * t) + 1.5 * std::sin(4.0 * Pi * t);
  const double second = 2.0 * std::sin(2.0 * Pi * t) - 0.7 * std::cos(6.0 * Pi * t);
  return { 40.0 + 50.0 * s + first * (0.3 + s), -10.0 + second * s * s, 5.0 + first - second * s };
}

template <typename Function>
PoseSequence Sample(const std::vector<double>& times, int points, const Function& function)
{
  PoseSequence sequence;
  sequence.times = times;
  for (const double time : times)
  {
    sequence.points.emplace_back();
    for (int n = 0; n < points; ++n)
    {
      sequence.points.back().push_back(function(n, time));
    }
  }
  return sequence;
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

double Maximum(const std::vector<Vector3>& a, const std::vector<Vector3>& b)
{
  double maximum = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n)
  {
    maximum = std::max(maximum, (a[n] - b[n]).norm());
  }
  return maximum;
}

std::vector<Vector3> At(const PhaseInterpolation& motion, double time)
{
  InterpolatedPose pose;
  motion.Evaluate(time, pose);
  return pose.points;
}

std::vector<Vector3> Truth(double time, int points)
{
  return Sample({ time }, points, Smooth).points[0];
}
}

TEST(PhaseInterpolation, LinearIsEquation8)
{
  const PoseSequence sequence = Sample({ 0.1, 0.3, 0.9 }, 5, Smooth);
  const PhaseInterpolation motion(sequence, With(PhaseInterpolationMode::Linear));
  for (const double share : { 0.0, 0.25, 0.8 })
  {
    const std::vector<Vector3> inside = At(motion, 0.1 + 0.2 * share);
    const std::vector<Vector3> seam = At(motion, 0.9 + 0.2 * share);
    for (std::size_t n = 0; n < 5; ++n)
    {
      EXPECT_NEAR(
        (inside[n] - ((1 - share) * sequence.points[0][n] + share * sequence.points[1][n])).norm(),
        0.0, 1e-12);
      EXPECT_NEAR(
        (seam[n] - ((1 - share) * sequence.points[2][n] + share * sequence.points[0][n])).norm(),
        0.0, 1e-12);
    }
  }
}

TEST(PhaseInterpolation, AnyTimeModuloOneCycle)
{
  const PoseSequence sequence = Sample(Even(12), 7, Smooth);
  for (const PhaseInterpolationMode mode : Modes)
  {
    const PhaseInterpolation motion(sequence, With(mode));
    for (const double time : { 0.0, 0.123, 0.987 })
    {
      for (const double cycles : { -3.0, 1.0, 250.0 })
      {
        EXPECT_LT(Maximum(At(motion, time), At(motion, time + cycles)), 1e-9);
      }
    }
  }
}

TEST(PhaseInterpolation, ThroughThePhases)
{
  const std::vector<double> times = { 0.02, 0.1, 0.13, 0.4, 0.55, 0.8, 0.97 };
  const PoseSequence sequence = Sample(times, 9, Smooth);
  for (const PhaseInterpolationMode mode :
    { PhaseInterpolationMode::Linear, PhaseInterpolationMode::PeriodicCubic })
  {
    const PhaseInterpolation motion(sequence, With(mode));
    for (std::size_t k = 0; k < times.size(); ++k)
    {
      EXPECT_LT(Maximum(At(motion, times[k]), sequence.points[k]), 1e-12);
      EXPECT_EQ(motion.NearestPhase(times[k] + 2.001), k);
    }
    EXPECT_EQ(motion.Repeatability(), 0.0);
    EXPECT_EQ(motion.Knots().size(), times.size());
  }
}

TEST(PhaseInterpolation, CubicIsSmoothAtThePhasesAndAtTheSeam)
{
  const std::vector<double> times = { 0.02, 0.1, 0.13, 0.4, 0.55, 0.8, 0.97 };
  const PhaseInterpolation motion(
    Sample(times, 4, Smooth), With(PhaseInterpolationMode::PeriodicCubic));
  const double step = 1e-5;
  for (const double time : { 0.0, 0.02, 0.1, 0.13, 0.4, 0.97, 1.0 })
  {
    InterpolatedPose before;
    InterpolatedPose after;
    motion.Evaluate(time - 1e-9, before);
    motion.Evaluate(time + 1e-9, after);
    EXPECT_LT(Maximum(before.points, after.points), 1e-6);
    EXPECT_LT(Maximum(before.velocity, after.velocity), 1e-4);
    // Accelerations, from velocities on either side.
    InterpolatedPose earlier;
    InterpolatedPose later;
    motion.Evaluate(time - step, earlier);
    motion.Evaluate(time + step, later);
    for (std::size_t n = 0; n < 4; ++n)
    {
      const Vector3 left = (before.velocity[n] - earlier.velocity[n]) / (step - 1e-9);
      const Vector3 right = (later.velocity[n] - after.velocity[n]) / (step - 1e-9);
      EXPECT_LT((left - right).norm(), 5e-3 * (1.0 + left.norm()));
    }
  }
}

TEST(PhaseInterpolation, CubicConvergesWithTheFourthPower)
{
  const auto error = [](int phases)
  {
    const PhaseInterpolation motion(
      Sample(Even(phases), 6, Smooth), With(PhaseInterpolationMode::PeriodicCubic));
    double maximum = 0.0;
    for (int k = 0; k < 97; ++k)
    {
      maximum = std::max(maximum, Maximum(At(motion, k / 97.0), Truth(k / 97.0, 6)));
    }
    return maximum;
  };
  EXPECT_NEAR(error(20) / error(40), 16.0, 3.0);
}

TEST(PhaseInterpolation, TwoPhasesAreEnough)
{
  for (const PhaseInterpolationMode mode : Modes)
  {
    const PoseSequence sequence = Sample({ 0.25, 0.75 }, 3, Smooth);
    const PhaseInterpolation motion(sequence, With(mode));
    EXPECT_LT(Maximum(At(motion, 0.25), sequence.points[0]), 1e-6);
    EXPECT_LT(Maximum(At(motion, 0.75), sequence.points[1]), 1e-6);
    for (const Vector3& point : At(motion, 0.6))
    {
      EXPECT_TRUE(point.allFinite());
    }
  }
}

TEST(PhaseInterpolation, VelocityIsTheDerivative)
{
  const PoseSequence sequence = Sample(Even(11), 5, Smooth);
  const double step = 1e-6;
  for (const PhaseInterpolationMode mode : Modes)
  {
    const PhaseInterpolation motion(sequence, With(mode));
    for (const double time : { 0.013, 0.333, 0.5, 0.97 })
    {
      InterpolatedPose pose;
      motion.Evaluate(time, pose);
      const std::vector<Vector3> before = At(motion, time - step);
      const std::vector<Vector3> after = At(motion, time + step);
      for (std::size_t n = 0; n < 5; ++n)
      {
        EXPECT_LT(((after[n] - before[n]) / (2.0 * step) - pose.velocity[n]).norm(), 1e-4);
      }
    }
  }
}

TEST(PhaseInterpolation, ThePapersRepetitionsAreBroughtTogether)
{
  const std::vector<double> times = coronary::PaperPhases();
  const PoseSequence sequence = Sample(times, 6, Smooth);
  for (const PhaseInterpolationMode mode : Modes)
  {
    const PhaseInterpolation motion(sequence, With(mode));
    ASSERT_EQ(motion.Knots().size(), 17U);
    EXPECT_NEAR(motion.Knots()[0], 0.5 * (0.00842 + 0.0016), 2e-4); // phases 2 and 19
    // The same motion seen twice at different moments: next to no difference is left.
    EXPECT_LT(motion.Repeatability(), 0.02);
    double maximum = 0.0;
    for (int k = 0; k < 50; ++k)
    {
      maximum = std::max(maximum, Maximum(At(motion, k / 50.0), Truth(k / 50.0, 6)));
    }
    EXPECT_LT(maximum, mode == PhaseInterpolationMode::Linear ? 0.6 : 0.05);
  }
  // With another tolerance they stay apart.
  const PhaseInterpolation apart(sequence, With(PhaseInterpolationMode::Linear, 0.001));
  EXPECT_EQ(apart.Knots().size(), 20U);
  EXPECT_LT(Maximum(At(apart, times[18]), sequence.points[18]), 1e-12);
}

TEST(PhaseInterpolation, MergingDoesNotChangeASteadyMotion)
{
  // Steady but for one far jump back.
  const auto steady = [](int n, double t) -> Vector3 {
    return { 100.0 * (t > 0.9 ? 0.0 : t), n + 3.0, -20.0 * (t > 0.9 ? 0.0 : t) };
  };
  const PhaseInterpolation motion(Sample({ 0.1, 0.2, 0.3, 0.306, 0.4, 0.5, 0.6, 0.95 }, 3, steady),
    With(PhaseInterpolationMode::Linear));
  EXPECT_EQ(motion.Knots().size(), 7U);
  for (const double time : { 0.25, 0.3, 0.303, 0.35 })
  {
    EXPECT_LT((At(motion, time)[1] - steady(1, time)).norm(), 1e-9);
  }
  EXPECT_LT(motion.Repeatability(), 1e-9);
}

TEST(PhaseInterpolation, RepetitionsCountByConfidence)
{
  PoseSequence sequence =
    Sample({ 0.0, 0.5, 1.0 }, 2, [](int, double) { return Vector3(0, 0, 0); });
  sequence.points[2] = { Vector3(4, 0, 0), Vector3(4, 0, 0) };
  sequence.confidence = { { 0.75, 0.0 }, { 1.0, 1.0 }, { 0.25, 0.0 } };
  sequence.status = { { TrackingStatus::Weak, TrackingStatus::Lost },
    { TrackingStatus::Tracked, TrackingStatus::Tracked },
    { TrackingStatus::Filled, TrackingStatus::Lost } };
  const PhaseInterpolation motion(sequence, With(PhaseInterpolationMode::Linear));
  InterpolatedPose pose;
  motion.Evaluate(0.0, pose);
  EXPECT_NEAR(pose.points[0].x(), 1.0, 1e-12);
  EXPECT_NEAR(pose.points[1].x(), 2.0, 1e-12);
  EXPECT_NEAR(pose.confidence[0], 0.5, 1e-12);
  EXPECT_EQ(pose.status[0], TrackingStatus::Weak);
  motion.Evaluate(0.25, pose);
  EXPECT_NEAR(pose.confidence[0], 0.75, 1e-12);
  motion.Evaluate(0.4, pose);
  EXPECT_EQ(pose.status[0], TrackingStatus::Tracked);
  EXPECT_NEAR(motion.Repeatability(), std::sqrt((1.0 + 9.0 + 4.0 + 4.0) / 4.0), 1e-12);
}

TEST(PhaseInterpolation, DenseSeriesDoNotCollapse)
{
  const PhaseInterpolation motion(
    Sample(Even(400), 2, Smooth), With(PhaseInterpolationMode::Linear));
  EXPECT_GE(motion.Knots().size(), 80U);
}

TEST(PhaseInterpolation, LowNoiseFindsTheMotionUnderNoise)
{
  const int points = 120;
  const std::vector<double> times = Even(20);
  PoseSequence sequence = Sample(times, points, Smooth);
  const PhaseInterpolation exact(sequence, With(PhaseInterpolationMode::LowNoise));
  EXPECT_EQ(exact.Fit().rank, 2);
  EXPECT_GE(exact.Fit().order, 3);
  EXPECT_LT(exact.Fit().predicted, 1e-6);
  EXPECT_LT(Maximum(At(exact, 0.777), Truth(0.777, points)), 1e-6);

  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.3);
  for (auto& phase : sequence.points)
  {
    for (Vector3& point : phase)
    {
      point += Vector3(noise(random), noise(random), noise(random));
    }
  }
  const PhaseInterpolation low(sequence, With(PhaseInterpolationMode::LowNoise));
  const PhaseInterpolation cubic(sequence, With(PhaseInterpolationMode::PeriodicCubic));
  const auto error = [&](const PhaseInterpolation& motion)
  {
    double sum = 0.0;
    for (int k = 0; k < 40; ++k)
    {
      const std::vector<Vector3> found = At(motion, (k + 0.5) / 40.0);
      const std::vector<Vector3> truth = Truth((k + 0.5) / 40.0, points);
      for (int n = 0; n < points; ++n)
      {
        sum += (found[n] - truth[n]).squaredNorm();
      }
    }
    return std::sqrt(sum / (40.0 * points));
  };
  EXPECT_GT(error(cubic), 0.35);
  EXPECT_LT(error(low), 0.6 * error(cubic));
  EXPECT_LE(low.Fit().rank, 3);
  EXPECT_NEAR(low.Fit().predicted, 0.3 * std::sqrt(3.0), 0.2);
}

TEST(PhaseInterpolation, LowNoiseFillsWhatIsLost)
{
  const int points = 120;
  PoseSequence sequence = Sample(Even(17), points, Smooth);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.1);
  sequence.confidence.assign(17, std::vector<double>(points, 1.0));
  for (int k = 0; k < 17; ++k)
  {
    for (int n = 0; n < points; ++n)
    {
      sequence.points[k][n] += Vector3(noise(random), noise(random), noise(random));
      // Two phases beside each other without 60 % of the points.
      if ((k == 6 || k == 7) && n % 5 < 3)
      {
        sequence.points[k][n] += Vector3(20.0, -10.0, 5.0);
        sequence.confidence[k][n] = 0.0;
      }
    }
  }
  const PhaseInterpolation motion(sequence, With(PhaseInterpolationMode::LowNoise));
  EXPECT_GT(motion.Fit().iterations, 0);
  double maximum = 0.0;
  for (const double time : { 6.0 / 17.0, 6.5 / 17.0, 7.0 / 17.0 })
  {
    maximum = std::max(maximum, Maximum(At(motion, time), Truth(time, points)));
  }
  EXPECT_LT(maximum, 0.5);
}

TEST(PhaseInterpolation, OddPhasesOfThePhantomFromEvenOnes)
{
  // Even phases known, odd ones predicted, over both trees. The activation curve alone, sampled so and
  // times 10 mm: linear 0.20, periodic cubic 0.11 mm.
  coronary::PhantomSettings settings;
  settings.centerlineSpacing = 2.0;
  const coronary::CoronaryPhantom phantom(settings);
  const std::vector<double> times = coronary::PaperPhases();
  PoseSequence even;
  for (std::size_t k = 0; k < times.size(); k += 2)
  {
    even.times.push_back(times[k]);
    even.points.push_back(phantom.Tree(times[k]).points);
  }
  const auto error = [&](PhaseInterpolationMode mode)
  {
    const PhaseInterpolation motion(even, With(mode));
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t k = 1; k < times.size(); k += 2)
    {
      const std::vector<Vector3> truth = phantom.Tree(times[k]).points;
      const std::vector<Vector3> found = At(motion, times[k]);
      for (std::size_t n = 0; n < truth.size(); ++n)
      {
        sum += (found[n] - truth[n]).norm();
        ++count;
      }
    }
    return sum / static_cast<double>(count);
  };
  const double linear = error(PhaseInterpolationMode::Linear);
  const double cubic = error(PhaseInterpolationMode::PeriodicCubic);
  const double low = error(PhaseInterpolationMode::LowNoise);
  RecordProperty("linear", std::to_string(linear));
  RecordProperty("cubic", std::to_string(cubic));
  RecordProperty("low", std::to_string(low));
  EXPECT_LT(linear, 0.25);
  EXPECT_LT(cubic, 0.13);
  EXPECT_LT(low, 0.2);
}

TEST(PhaseInterpolation, RotationsStayOnTheSphere)
{
  // One axis: the angle is interpolated. The sign of a quaternion means nothing.
  const Vector3 axis = Vector3(1, 2, -2) / 3.0;
  PoseSequence sequence = Sample(Even(16), 2, Smooth);
  const auto angle = [](double t) { return 0.6 * std::sin(2.0 * Pi * t) + 0.2; };
  for (std::size_t k = 0; k < 16; ++k)
  {
    Quaternion turn(Eigen::AngleAxisd(angle(sequence.times[k]), axis));
    if (k % 3 == 1)
    {
      turn.coeffs() *= -2.5;
    }
    sequence.rotation.push_back({ turn });
  }
  for (const PhaseInterpolationMode mode : Modes)
  {
    const PhaseInterpolation motion(sequence, With(mode));
    InterpolatedPose pose;
    for (int k = 0; k < 64; ++k)
    {
      motion.Evaluate(k / 64.0, pose);
      ASSERT_EQ(pose.rotation.size(), 1U);
      EXPECT_NEAR(pose.rotation[0].norm(), 1.0, 1e-12);
      const Quaternion truth(Eigen::AngleAxisd(angle(k / 64.0), axis));
      EXPECT_LT(pose.rotation[0].angularDistance(truth),
        mode == PhaseInterpolationMode::Linear ? 0.015 : 1e-3);
    }
  }
  // Between two phases the linear one turns evenly.
  const PhaseInterpolation linear(sequence, With(PhaseInterpolationMode::Linear));
  InterpolatedPose pose;
  linear.Evaluate((0.25 * 1 + 0.75 * 2) / 16.0, pose);
  const double wanted = 0.25 * angle(1.0 / 16.0) + 0.75 * angle(2.0 / 16.0);
  EXPECT_LT(pose.rotation[0].angularDistance(Quaternion(Eigen::AngleAxisd(wanted, axis))), 1e-9);
}

TEST(PhaseInterpolation, MovesWithTheWorld)
{
  PoseSequence sequence = Sample(coronary::PaperPhases(), 10, Smooth);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(0.2, 1.0);
  sequence.confidence.resize(20);
  for (auto& phase : sequence.confidence)
  {
    for (int n = 0; n < 10; ++n)
    {
      phase.push_back(any(random));
    }
  }
  for (std::size_t k = 0; k < 20; ++k)
  {
    sequence.rotation.push_back({ Quaternion(Eigen::AngleAxisd(
                                    0.3 * std::sin(2 * Pi * sequence.times[k]), Vector3::UnitX())) *
      Quaternion(
        Eigen::AngleAxisd(0.2 * std::cos(2 * Pi * sequence.times[k]), Vector3::UnitY())) });
  }
  const Quaternion turn(Eigen::AngleAxisd(1.1, Vector3(0.6, 0.0, 0.8)));
  const Vector3 shift(120.0, -340.0, 77.0);
  PoseSequence turned = sequence;
  for (std::size_t k = 0; k < 20; ++k)
  {
    for (Vector3& point : turned.points[k])
    {
      point = turn * point + shift;
    }
    turned.rotation[k][0] = turn * sequence.rotation[k][0];
  }
  for (const PhaseInterpolationMode mode : Modes)
  {
    const PhaseInterpolation a(sequence, With(mode));
    const PhaseInterpolation b(turned, With(mode));
    InterpolatedPose poseA;
    InterpolatedPose poseB;
    for (const double time : { 0.05, 0.42, 0.99 })
    {
      a.Evaluate(time, poseA);
      b.Evaluate(time, poseB);
      for (std::size_t n = 0; n < 10; ++n)
      {
        EXPECT_LT((turn * poseA.points[n] + shift - poseB.points[n]).norm(), 1e-4);
        EXPECT_LT((turn * poseA.velocity[n] - poseB.velocity[n]).norm(), 1e-2);
      }
      EXPECT_LT((turn * poseA.rotation[0]).angularDistance(poseB.rotation[0]), 1e-7);
    }
  }
}

TEST(PhaseInterpolation, SameBitsOnAnyNumberOfThreads)
{
  PoseSequence sequence = Sample(coronary::PaperPhases(), 3000, Smooth);
  sequence.confidence.assign(20, std::vector<double>(3000, 1.0));
  for (int n = 0; n < 3000; n += 3)
  {
    sequence.confidence[7][n] = 0.3;
  }
  for (const PhaseInterpolationMode mode : Modes)
  {
    std::vector<Vector3> results[2];
    for (const int threads : { 1, 4 })
    {
      coronary::SetNumberOfThreads(threads);
      results[threads == 4] = At(PhaseInterpolation(sequence, With(mode)), 0.4321);
    }
    coronary::SetNumberOfThreads(0);
    EXPECT_EQ(std::memcmp(results[0].data(), results[1].data(), 3000 * sizeof(Vector3)), 0);
  }
}

TEST(PhaseInterpolation, CalibreAndNothing)
{
  PoseSequence sequence = Sample({ 0.0, 0.5 }, 1, Smooth);
  sequence.calibre = { { 1.0 }, { 1.21 } };
  InterpolatedPose pose;
  PhaseInterpolation(sequence, With(PhaseInterpolationMode::Linear)).Evaluate(0.25, pose);
  EXPECT_NEAR(pose.calibre[0], 1.1, 1e-12);
  PoseSequence nothing;
  nothing.times = { 0.0, 0.5 };
  nothing.points.resize(2);
  for (const PhaseInterpolationMode mode : Modes)
  {
    PhaseInterpolation(nothing, With(mode)).Evaluate(0.3, pose);
    EXPECT_TRUE(pose.points.empty());
    EXPECT_TRUE(pose.calibre.empty());
  }
}

TEST(PhaseInterpolation, CrossSectionsKeepEquations10And11)
{
  for (const double ratio : { 1.0, 0.7 })
  {
    for (const double calibre : { 0.8, 0.99, 1.0, 1.02, 1.3 })
    {
      const coronary::EllipseSection section = coronary::CrossSection(1.5, calibre, ratio, 0.05);
      EXPECT_NEAR(
        Pi * section.major * section.minor, Pi * 1.5 * 1.5 * (1.0 + section.areaStrain), 1e-12);
      EXPECT_NEAR(section.minor / section.major, ratio, 1e-12);
      EXPECT_LE(std::abs(section.areaStrain), 0.05);
      EXPECT_EQ(section.clamped, calibre == 0.8 || calibre == 1.3);
      if (!section.clamped)
      {
        EXPECT_NEAR(section.areaStrain, calibre * calibre - 1.0, 1e-12);
      }
    }
  }
}

TEST(PhaseInterpolation, Refusals)
{
  const PoseSequence good = Sample({ 0.0, 0.5 }, 2, Smooth);
  const auto refuse = [&](const std::string& part, const auto& spoil)
  {
    PoseSequence sequence = good;
    PhaseInterpolationSettings settings;
    spoil(sequence, settings);
    ExpectRefusal([&] { const PhaseInterpolation motion(sequence, settings); }, part);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuse("no phase", [](auto& s, auto&) { s = PoseSequence(); });
  refuse("does not come after", [](auto& s, auto&) { s.times = { 0.5, 0.5 }; });
  refuse("not finite", [&](auto& s, auto&) { s.times[1] = nan; });
  refuse("not finite", [&](auto& s, auto&) { s.points[1][0].y() = nan; });
  refuse("points", [](auto& s, auto&) { s.points[1].pop_back(); });
  refuse("fewer than two different phases", [](auto& s, auto&) { s.times = { 0.0, 1.0 }; });
  refuse("mergeTolerance", [](auto&, auto& set) { set.mergeTolerance = 0.2; });
  refuse("maximumRank", [](auto&, auto& set) { set.maximumRank = 0; });
  refuse("maximumOrder", [](auto&, auto& set) { set.maximumOrder = 21; });
  refuse("minimumConfidence", [&](auto&, auto& set) { set.minimumConfidence = nan; });
  refuse("mode", [](auto&, auto& set) { set.mode = static_cast<PhaseInterpolationMode>(3); });
  const PhaseInterpolation motion(good);
  InterpolatedPose pose;
  ExpectRefusal([&] { motion.Evaluate(nan, pose); }, "time must be finite");
  EXPECT_THROW(PhaseInterpolation(good, {}, [](double) { return false; }), coronary::Cancelled);
}
}
