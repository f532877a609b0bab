// Places that were not seen, filled from the motion around them: against motions in closed form.

#include "LineNodes.h"
#include "MotionFilling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace UnitTestMotionFilling
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr double Reference = 0.75;

using Field = std::function<Vector3(const Vector3& place, double time)>;
using Mask = std::vector<std::vector<bool>>;

/// Three vessels around a heart of 30 mm, and a branch of the second one between the others.
Polylines Vessels()
{
  Polylines lines;
  const auto add = [&](std::int64_t from, const std::function<Vector3(double)>& course)
  {
    lines.lines.emplace_back();
    if (from >= 0)
    {
      lines.lines.back().push_back(from);
    }
    for (int n = from >= 0 ? 1 : 0; n <= 40; ++n)
    {
      lines.lines.back().push_back(static_cast<std::int64_t>(lines.points.size()));
      lines.points.push_back(course(n / 40.0));
    }
  };
  const auto on = [](double angle, double height)
  { return Vector3(30.0 * std::cos(angle), 30.0 * std::sin(angle), height); };
  add(-1, [&](double s) { return on(0.0, -30.0 + 60.0 * s); });
  add(-1, [&](double s) { return on(1.0, -30.0 + 60.0 * s); });
  add(-1, [&](double s) { return on(2.4, -30.0 + 60.0 * s); });
  add(51, [&](double s) { return on(1.0 + 0.9 * s, -15.0 + 20.0 * s); });
  return lines;
}

/// Nodes of the branch: those that lie on none of the straight vessels.
std::vector<bool> OnBranch(const LineNodes& nodes)
{
  std::vector<bool> branch;
  for (const Vector3& place : nodes.position)
  {
    const double angle = std::atan2(place[1], place[0]);
    branch.push_back(
      std::abs(angle) > 0.02 && std::abs(angle - 1.0) > 0.02 && std::abs(angle - 2.4) > 0.02);
  }
  return branch;
}

std::vector<double> Times()
{
  std::vector<double> times;
  for (int k = 0; k < 10; ++k)
  {
    times.push_back(0.1 * k);
  }
  return times;
}

double Beat(double time)
{
  return std::cos(2.0 * Pi * time) - std::cos(2.0 * Pi * Reference);
}

/// A heart that becomes shorter, thinner and turns, each in its own time.
Vector3 Affine(const Vector3& place, double time)
{
  const double late = std::cos(2.0 * Pi * (time - 0.1)) - std::cos(2.0 * Pi * (Reference - 0.1));
  return Beat(time) * Vector3(-0.06 * place[0], -0.06 * place[1], 3.0 - 0.1 * place[2]) +
    late * Vector3(-0.05 * place[1], 0.05 * place[0], 0.0);
}

std::vector<std::vector<Vector3>> Moved(const LineNodes& nodes, const Field& field)
{
  std::vector<std::vector<Vector3>> displacement;
  for (const double time : Times())
  {
    displacement.emplace_back();
    for (const Vector3& place : nodes.position)
    {
      displacement.back().push_back(field(place, time));
    }
  }
  return displacement;
}

Mask AllBut(const LineNodes& nodes, const std::vector<std::size_t>& phases)
{
  const std::vector<bool> branch = OnBranch(nodes);
  Mask seen(Times().size(), std::vector<bool>(nodes.size(), true));
  for (const std::size_t k : phases)
  {
    for (std::size_t n = 0; n < nodes.size(); ++n)
    {
      seen[k][n] = !branch[n];
    }
  }
  return seen;
}

MotionMeasurements Measured(
  const std::vector<std::vector<Vector3>>& displacement, double deviation, double scale)
{
  MotionMeasurements result;
  result.displacement = displacement;
  result.information.assign(displacement.size(),
    std::vector<Matrix3>(
      displacement.front().size(), Matrix3::Identity() / (deviation * deviation)));
  result.robustScale = scale;
  return result;
}

double Farthest(const Trajectories& motion, const std::vector<std::vector<Vector3>>& truth)
{
  double farthest = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k)
  {
    for (std::size_t n = 0; n < truth[k].size(); ++n)
    {
      farthest = std::max(
        farthest, (motion.Displacement(static_cast<int>(n), Times()[k]) - truth[k][n]).norm());
    }
  }
  return farthest;
}
}

TEST(MotionFilling, TakesTheMotionOfTheVesselsAround)
{
  const LineNodes nodes = PlaceNodes(Vessels(), 2.0);
  const auto truth = Moved(nodes, Affine);
  const std::vector<bool> branch = OnBranch(nodes);
  ASSERT_GT(std::count(branch.begin(), branch.end(), true), 10);
  const auto errorOf = [&](const std::vector<std::size_t>& hidden)
  {
    const Mask seen = AllBut(nodes, hidden);
    auto guess = truth;
    for (std::size_t k = 0; k < truth.size(); ++k)
    {
      for (std::size_t n = 0; n < nodes.size(); ++n)
      {
        if (!seen[k][n])
        {
          guess[k][n] = Vector3(100.0, 0.0, 0.0); // tells nothing
        }
      }
    }
    const MotionMeasurements filled =
      FillUnseen(nodes, Times(), Reference, guess, seen, {}, TrajectoryPrior());
    double farthest = 0.0;
    for (std::size_t k = 0; k < truth.size(); ++k)
    {
      for (std::size_t n = 0; n < nodes.size(); ++n)
      {
        EXPECT_EQ(filled.information[k][n].isZero(), seen[k][n]);
        farthest = std::max(farthest, (filled.displacement[k][n] - truth[k][n]).norm());
      }
    }
    return farthest;
  };
  EXPECT_EQ(errorOf({}), 0.0);
  // Of a way that is known before and after.
  EXPECT_LT(errorOf({ 3 }), 0.1);
  EXPECT_LT(errorOf({ 2, 3, 4 }), 0.2);
  // Of a branch that was never seen.
  EXPECT_LT(errorOf({ 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 }), 0.5);
}

TEST(MotionFilling, IsLessSureFartherAway)
{
  const LineNodes nodes = PlaceNodes(Vessels(), 2.0);
  const Mask seen = AllBut(nodes, { 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 });
  const MotionMeasurements filled =
    FillUnseen(nodes, Times(), Reference, Moved(nodes, Affine), seen, {}, TrajectoryPrior());
  const std::vector<bool> branch = OnBranch(nodes);
  double best = 0.0;
  double worst = 1e9;
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    if (branch[n])
    {
      best = std::max(best, filled.information[4][n].trace());
      worst = std::min(worst, filled.information[4][n].trace());
    }
  }
  EXPECT_GT(best, 1.1 * worst);
}

TEST(MotionFilling, APhaseThatWasLostIsAMotionOfTheWholeHeart)
{
  const LineNodes nodes = PlaceNodes(Vessels(), 2.0);
  const auto truth = Moved(nodes, Affine);
  Mask seen = AllBut(nodes, {});
  std::fill(seen[5].begin(), seen[5].end(), false);
  const TrajectoryPrior prior;
  const MotionMeasurements filled = FillUnseen(nodes, Times(), Reference, truth, seen, {}, prior);
  for (const Matrix3& information : filled.information[5])
  {
    EXPECT_TRUE(information.isZero());
  }
  // What is measured there says how far the heart has come; a branch of wrong tissue does not.
  MotionMeasurements measured = Measured(truth, 0.5, 1.5);
  const std::vector<bool> branch = OnBranch(nodes);
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    measured.displacement[5][n] += branch[n] ? Vector3(0.0, 5.0, 0.0) : Vector3::Zero();
  }
  const Trajectories motion = FitFilled(nodes, Times(), Reference, seen, { &measured }, prior);
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    EXPECT_LT((motion.Displacement(static_cast<int>(n), Times()[5]) - truth[5][n]).norm(),
      branch[n] ? 1.0 : 0.5)
      << n;
  }
}

TEST(MotionFilling, DoesNotBelieveAWholeBranchOfWrongTissue)
{
  const LineNodes nodes = PlaceNodes(Vessels(), 2.0);
  const auto truth = Moved(nodes, Affine);
  const Mask seen = AllBut(nodes, { 2, 3, 4 });
  MotionMeasurements vessels = Measured(truth, 0.15, 0.5);
  MotionMeasurements tissue = Measured(truth, 0.5, 1.5);
  const auto slide = [&](double far)
  {
    for (std::size_t k = 0; k < truth.size(); ++k)
    {
      for (std::size_t n = 0; n < nodes.size(); ++n)
      {
        if (!seen[k][n])
        {
          vessels.information[k][n].setZero();
          tissue.displacement[k][n] = truth[k][n] + Vector3(0.0, 0.0, far);
        }
      }
    }
  };
  const TrajectoryPrior prior;
  const auto error = [&](bool filled)
  {
    const std::vector<const MotionMeasurements*> all{ &vessels, &tissue };
    return Farthest(filled ? FitFilled(nodes, Times(), Reference, seen, all, prior)
                           : FitRobustly(nodes, Times(), Reference, all, prior),
      truth);
  };
  slide(5.0);
  EXPECT_GT(error(false), 3.0);
  EXPECT_LT(error(true), 0.7);
  slide(0.0);
  EXPECT_LT(error(true), 0.3);
}

TEST(MotionFilling, HowFarCountsOnlyWhereSomethingIsSaid)
{
  MotionMeasurements measured;
  measured.displacement = { { Vector3(1.0, 0.0, 0.0) } };
  measured.information = { { Vector3(4.0, 1.0, 0.0).asDiagonal().toDenseMatrix() } };
  const Vector3 place(1.3, 2.0, 7.0);
  EXPECT_DOUBLE_EQ(ApartOf(measured, 0, 0, place), Vector3(0.3, 2.0, 7.0).norm());
  measured.slides = true;
  EXPECT_NEAR(ApartOf(measured, 0, 0, place), std::sqrt(0.3 * 0.3 + 2.0 * 2.0 / 4.0), 1e-12);
}

TEST(MotionFilling, AVesselThatSlidAlongItselfStillTellsWhereItIsAcross)
{
  const LineNodes nodes = PlaceNodes(Vessels(), 2.0);
  const auto truth = Moved(nodes, Affine);
  MotionMeasurements vessels = Measured(truth, 0.15, 0.5);
  MotionMeasurements tissue = Measured(truth, 0.5, 1.5);
  for (std::size_t k = 0; k < truth.size(); ++k)
  {
    for (std::size_t n = 0; n < nodes.size(); ++n)
    {
      // 3 mm off along z, of which they say nothing; the tissue is 1 mm off across.
      vessels.displacement[k][n] += Vector3(0.0, 0.0, 3.0);
      vessels.information[k][n](2, 2) = 0.0;
      tissue.displacement[k][n] += Beat(Times()[k]) * Vector3(1.0, 0.0, 0.0);
    }
  }
  const auto error = [&]()
  {
    return Farthest(
      FitRobustly(nodes, Times(), Reference, { &vessels, &tissue }, TrajectoryPrior()), truth);
  };
  EXPECT_GT(error(), 0.8);
  vessels.slides = true;
  EXPECT_LT(error(), 0.3);
}
}
