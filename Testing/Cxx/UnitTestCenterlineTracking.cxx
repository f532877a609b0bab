// What tracking is made of, against closed forms: nodes, trajectories, labels, kept voxels, images of
// lines; and the tracking of a tube whose motion is known.

#include "CenterlineTracking.h"
#include "CoronaryPhantom.h"
#include "DisplacementLabels.h"
#include "LineNodes.h"
#include "LocalDeformation.h"
#include "Refusals.h"
#include "SparseVolume.h"
#include "ThreadSharing.h"
#include "TrajectoryModel.h"
#include "VesselImage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace UnitTestCenterlineTracking
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

/// A trunk of 40 mm along z, and a branch from its middle along x.
Polylines Fork()
{
  Polylines lines;
  for (int n = 0; n <= 80; ++n)
  {
    lines.points.emplace_back(0.0, 0.0, 0.5 * n);
  }
  for (int n = 1; n <= 40; ++n)
  {
    lines.points.emplace_back(0.5 * n, 0.0, 20.0);
  }
  lines.radius.assign(lines.points.size(), 1.5);
  lines.lines.resize(3);
  for (int n = 0; n <= 80; ++n)
  {
    lines.lines[n <= 40 ? 0 : 1].push_back(n);
    if (n == 40)
    {
      lines.lines[1].push_back(n);
    }
  }
  lines.lines[2].push_back(40);
  for (int n = 81; n <= 120; ++n)
  {
    lines.lines[2].push_back(n);
  }
  return lines;
}

LineNodes Chain(int count, double step)
{
  Polylines lines;
  lines.lines.emplace_back();
  for (int n = 0; n < count; ++n)
  {
    lines.points.emplace_back(step * n, 0.0, 0.0);
    lines.lines[0].push_back(n);
  }
  return PlaceNodes(lines, step * 1.001);
}
}

TEST(LineNodes, AreEvenAndShareTheFork)
{
  const Polylines lines = Fork();
  const LineNodes nodes = PlaceNodes(lines, 2.0);
  EXPECT_EQ(nodes.size(), 1u + 10u + 10u + 10u);
  ASSERT_EQ(nodes.points.size(), lines.points.size());
  int roots = 0;
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    roots += nodes.parent[n] < 0 ? 1 : 0;
    if (nodes.parent[n] >= 0)
    {
      EXPECT_NEAR(nodes.step[n], 2.0, 1e-12);
      EXPECT_NEAR((nodes.position[n] - nodes.position[nodes.parent[n]]).norm(), 2.0, 1e-12);
    }
    EXPECT_NEAR(nodes.tangent[n].norm(), 1.0, 1e-12);
  }
  EXPECT_EQ(roots, 1);
  // A linear function of position is reproduced at every point.
  std::vector<double> values;
  for (const Vector3& place : nodes.position)
  {
    values.push_back(3.0 * place[0] - 2.0 * place[2] + 1.0);
  }
  const std::vector<double> at = nodes.AtPoints(values);
  for (std::size_t p = 0; p < at.size(); ++p)
  {
    EXPECT_NEAR(at[p], 3.0 * lines.points[p][0] - 2.0 * lines.points[p][2] + 1.0, 1e-9);
  }
}

TEST(LineNodes, TakeRingsLonePointsAndLinesWithoutLength)
{
  Polylines lines;
  for (int n = 0; n < 12; ++n)
  {
    lines.points.emplace_back(10.0 * std::cos(Pi * n / 6.0), 10.0 * std::sin(Pi * n / 6.0), 0.0);
  }
  lines.points.emplace_back(50.0, 0.0, 0.0); // alone
  lines.points.emplace_back(60.0, 0.0, 0.0); // a line of
  lines.points.emplace_back(60.0, 0.0, 0.0); // no length
  lines.lines = { { 0, 1, 2, 3, 4, 5, 6 }, { 6, 7, 8, 9, 10, 11, 0 }, { 13, 14 } };
  const LineNodes nodes = PlaceNodes(lines, 1.0);
  EXPECT_EQ(nodes.order.size(), nodes.size());
  int roots = 0;
  for (const int parent : nodes.parent)
  {
    roots += parent < 0 ? 1 : 0;
  }
  EXPECT_EQ(roots, 3);
  for (const double value : nodes.AtPoints(std::vector<double>(nodes.size(), 7.0)))
  {
    EXPECT_DOUBLE_EQ(value, 7.0);
  }
}

TEST(Trajectories, FollowPreciseMeasurementsOfAPeriodicMotion)
{
  const LineNodes nodes = Chain(8, 2.0);
  const auto motion = [](double t, std::size_t n)
  {
    return Vector3(5.0 * (1.0 - std::cos(2.0 * Pi * t)), 2.0 * std::sin(4.0 * Pi * t),
      0.1 * static_cast<double>(n) * std::sin(2.0 * Pi * t));
  };
  std::vector<double> times;
  for (int k = 0; k < 16; ++k)
  {
    times.push_back(-0.05 + k / 16.0);
  }
  std::vector<std::vector<TrajectoryMeasurement>> measurements(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    for (std::size_t k = 0; k < times.size(); ++k)
    {
      measurements[n].push_back(
        { static_cast<int>(k), motion(times[k], n), Matrix3::Identity() * 1e6 });
    }
  }
  const Trajectories result = FitTrajectories(nodes, times, measurements);
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    for (double t = -0.4; t < 1.7; t += 0.0137)
    {
      EXPECT_LT((result.Displacement(static_cast<int>(n), t) - motion(t, n)).norm(), 2e-3);
      const Vector3 slope = (motion(t + 1e-4, n) - motion(t - 1e-4, n)) / 2e-4;
      EXPECT_LT((result.Derivative(static_cast<int>(n), t) - slope).norm(), 0.1);
      EXPECT_LT(result.Deviation(static_cast<int>(n), t), 0.05);
    }
  }
}

TEST(Trajectories, AreTheDenseSolution)
{
  // Five nodes on a fork: the tree's elimination against one dense system.
  Polylines lines;
  lines.points = { { 0, 0, 0 }, { 0, 0, 3 }, { 0, 0, 5 }, { 2, 0, 4 }, { 4, 0, 4 } };
  lines.lines = { { 0, 1 }, { 1, 2 }, { 1, 3 }, { 3, 4 } };
  const LineNodes nodes = PlaceNodes(lines, 10.0);
  ASSERT_EQ(nodes.size(), 5u);
  TrajectoryPrior prior;
  prior.harmonics = 2;
  prior.commonDegree = 0;
  const std::vector<double> times = { 0.1, 0.35, 0.8 };
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<std::vector<TrajectoryMeasurement>> measurements(5);
  for (std::size_t n = 0; n < 5; ++n)
  {
    for (int k = n == 4 ? 3 : 0; k < 3; ++k)
    {
      Matrix3 root;
      Vector3 place;
      for (int i = 0; i < 9; ++i)
      {
        root(i % 3, i / 3) = normal(random);
      }
      for (int i = 0; i < 3; ++i)
      {
        place[i] = 3.0 * normal(random);
      }
      measurements[n].push_back({ k, place, root * root.transpose() });
    }
  }
  const Trajectories result = FitTrajectories(nodes, times, measurements, prior);
  const Eigen::Index size = 15;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(5 * size, 5 * size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(5 * size);
  for (Eigen::Index b = 0; b < 5; ++b)
  {
    const double m = b == 0 ? 1.0 : static_cast<double>((b + 1) / 2);
    const double own = prior.amplitude / std::pow(m, prior.decay);
    for (Eigen::Index n = 0; n < 5; ++n)
    {
      matrix.diagonal().segment<3>(n * size + 3 * b).array() += 1.0 / (own * own);
    }
  }
  for (Eigen::Index n = 0; n < 5; ++n)
  {
    for (const TrajectoryMeasurement& one : measurements[n])
    {
      const Eigen::VectorXd phi = PeriodicBasis(times[one.phase], 2);
      for (Eigen::Index a = 0; a < 5; ++a)
      {
        right.segment<3>(n * size + 3 * a) += phi[a] * one.information * one.displacement;
        for (Eigen::Index b = 0; b < 5; ++b)
        {
          matrix.block<3, 3>(n * size + 3 * a, n * size + 3 * b) +=
            phi[a] * phi[b] * one.information;
        }
      }
    }
    const int parent = nodes.parent[n];
    for (Eigen::Index b = 0; parent >= 0 && b < 5; ++b)
    {
      const Vector3 along = (nodes.position[n] - nodes.position[parent]).normalized();
      const double m = b == 0 ? 1.0 : static_cast<double>((b + 1) / 2);
      const double walk = prior.neighbourChange / std::pow(m, prior.neighbourDecay);
      const double stretch = prior.neighbourStretch / std::pow(m, prior.neighbourDecay);
      const Matrix3 variance = walk * walk * (Matrix3::Identity() - along * along.transpose()) +
        stretch * stretch * along * along.transpose();
      const Matrix3 stiff = (variance * nodes.step[n]).inverse();
      const Eigen::Index own = n * size + 3 * b;
      const Eigen::Index other = parent * size + 3 * b;
      matrix.block<3, 3>(own, own) += stiff;
      matrix.block<3, 3>(other, other) += stiff;
      matrix.block<3, 3>(own, other) -= stiff;
      matrix.block<3, 3>(other, own) -= stiff;
    }
  }
  const Eigen::MatrixXd inverse = matrix.inverse();
  const Eigen::VectorXd solution = inverse * right;
  for (Eigen::Index n = 0; n < 5; ++n)
  {
    EXPECT_LT((result.covariance[n] - inverse.block(n * size, n * size, size, size)).norm(), 1e-8);
    for (Eigen::Index b = 0; b < 5; ++b)
    {
      const Vector3 own = result.coefficients[n].row(b).transpose();
      EXPECT_LT((own - solution.segment<3>(n * size + 3 * b)).norm(), 1e-8);
    }
  }
}

TEST(Trajectories, SayHowLittleIsKnownOfAGap)
{
  const LineNodes nodes = Chain(20, 2.0);
  const std::vector<double> times = { 0.0, 0.25, 0.5, 0.75 };
  std::vector<std::vector<TrajectoryMeasurement>> measurements(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    for (int k = 0; k < 4 && (n < 5 || n > 14); ++k)
    {
      measurements[n].push_back({ k, Vector3(1.0, 0.0, 0.0), Matrix3::Identity() * 100.0 });
    }
  }
  const Trajectories result = FitTrajectories(nodes, times, measurements);
  EXPECT_GT(result.Deviation(10, 0.5), 2.0 * result.Deviation(1, 0.5));
  EXPECT_LT((result.Displacement(10, 0.5) - Vector3(1.0, 0.0, 0.0)).norm(), 0.02);
}

TEST(Trajectories, TakeFromOtherVesselsWhatTheirOwnDoesNotShow)
{
  // The heart shortens along x. A vessel along x is seen across its way only; another tree, farther along
  // x, lies across and shows how much.
  Polylines lines;
  for (int n = 0; n <= 10; ++n)
  {
    lines.points.emplace_back(4.0 * n, 0.0, 0.0);
  }
  for (int n = 0; n <= 10; ++n)
  {
    lines.points.emplace_back(40.0, 5.0 + 4.0 * n, 3.0);
  }
  lines.lines = { { 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10 },
    { 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21 } };
  const LineNodes nodes = PlaceNodes(lines, 4.0);
  const auto motion = [](const Vector3& rest, double t)
  { return Vector3(-0.1 * rest[0] * 0.5 * (1.0 - std::cos(2.0 * Pi * t)), 0.0, 0.0); };
  const std::vector<double> times = { 0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875 };
  std::vector<std::vector<TrajectoryMeasurement>> measurements(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    // The root of the vessel along x is seen in all directions.
    const Vector3& rest = nodes.position[n];
    const Vector3 seen(rest[1] == 0.0 && rest[0] > 0.0 ? 0 : 1, rest[1] > 0.0 ? 0 : 1, 1);
    for (std::size_t k = 0; k < times.size(); ++k)
    {
      measurements[n].push_back(
        { static_cast<int>(k), motion(rest, times[k]), Matrix3(100.0 * seen.asDiagonal()) });
    }
  }
  TrajectoryPrior alone;
  alone.commonDegree = 0;
  const Trajectories with = FitTrajectories(nodes, times, measurements);
  const Trajectories without = FitTrajectories(nodes, times, measurements, alone);
  int tips = 0;
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    if ((nodes.position[n] - Vector3(40.0, 0.0, 0.0)).norm() < 1e-9)
    {
      ++tips;
      EXPECT_NEAR(with.Displacement(static_cast<int>(n), 0.5)[0], -4.0, 1.0);
      EXPECT_GT(without.Displacement(static_cast<int>(n), 0.5)[0], -1.0);
    }
  }
  EXPECT_EQ(tips, 1);
}

TEST(LocalDeformation, IsThatOfAnAffineMotion)
{
  // Vessels that cross in three directions tell all of it, but for what is held back because hearts deform little.
  Polylines lines;
  for (int axis = 0; axis < 3; ++axis)
  {
    lines.lines.emplace_back();
    for (int n = -12; n <= 12; ++n)
    {
      lines.lines.back().push_back(static_cast<std::int64_t>(lines.points.size()));
      lines.points.emplace_back(2.0 * n * Vector3::Unit(axis) + Vector3(1.0, 5.0, -2.0));
    }
  }
  const LineNodes nodes = PlaceNodes(lines, 2.0);
  const LocalDeformation deformation(nodes);
  const Matrix3 turn =
    Eigen::AngleAxisd(0.4, Vector3(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  const Matrix3 whole = turn * Vector3(0.8, 0.9, 1.1).asDiagonal();
  std::vector<Vector3> moved;
  std::vector<Vector3> shifted;
  for (const Vector3& place : nodes.position)
  {
    moved.emplace_back((whole - Matrix3::Identity()) * place + Vector3(12.0, -7.0, 3.0));
    shifted.emplace_back(12.0, -7.0, 3.0);
  }
  for (int n = 0; n < static_cast<int>(nodes.size()); ++n)
  {
    if ((nodes.position[n] - Vector3(1.0, 5.0, -2.0)).norm() < 15.0)
    {
      EXPECT_LT((deformation.At(n, moved) - whole).norm(), 0.15);
      EXPECT_LT((RotationOf(deformation.At(n, moved)) - turn).norm(), 0.1);
    }
    EXPECT_LT((deformation.At(n, shifted) - Matrix3::Identity()).norm(), 1e-9);
  }
  EXPECT_LT((RotationOf(whole) - turn).norm(), 1e-9);
}

TEST(LocalDeformation, TurnsRatherThanStretchesAroundAVesselThatIsAlone)
{
  const LineNodes nodes = Chain(21, 2.0); // along x
  const LocalDeformation deformation(nodes);
  const double angle = 0.3;
  const Matrix3 turn = Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix();
  std::vector<Vector3> moved;
  for (const Vector3& place : nodes.position)
  {
    moved.emplace_back((turn - Matrix3::Identity()) * place);
  }
  const Matrix3 found = RotationOf(deformation.At(10, moved));
  const Eigen::AngleAxisd about(found);
  EXPECT_NEAR(about.angle(), angle, 0.07);
  EXPECT_GT(about.axis()[2], 0.99); // no twist about the vessel
}

TEST(Trajectories, RefuseWhatIsWrong)
{
  const LineNodes nodes = Chain(3, 2.0);
  TrajectoryPrior prior;
  prior.harmonics = 0;
  ExpectRefusal([&] { FitTrajectories(nodes, { 0.0 }, { {}, {}, {} }, prior); }, "harmonics");
  ExpectRefusal([&] { FitTrajectories(nodes, { 0.0 }, { {} }); }, "1 nodes instead of 3");
  ExpectRefusal(
    [&] {
      FitTrajectories(nodes, { 0.0 }, { { { 1, Vector3::Zero(), Matrix3::Identity() } }, {}, {} });
    },
    "no phase 1");
}

TEST(DisplacementLabels, AreTheBestOfAll)
{
  // Three nodes, 27 candidates each: all combinations.
  const LineNodes nodes = Chain(3, 2.0);
  const LabelLattice lattice{ 1, 1.0 };
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(0.0F, 6.0F);
  for (int trial = 0; trial < 20; ++trial)
  {
    std::vector<std::vector<float>> costs(3, std::vector<float>(27));
    for (std::vector<float>& one : costs)
    {
      for (float& value : one)
      {
        value = uniform(random);
      }
    }
    const double stiffness = 0.6;
    const auto place = [](int label)
    { return Vector3(label % 3 - 1, label / 3 % 3 - 1, label / 9 - 1); };
    double minimum = std::numeric_limits<double>::infinity();
    int best[3] = { 0, 0, 0 };
    for (int a = 0; a < 27; ++a)
    {
      for (int b = 0; b < 27; ++b)
      {
        for (int c = 0; c < 27; ++c)
        {
          const double sum = costs[0][a] + costs[1][b] + costs[2][c] +
            ((place(a) - place(b)).squaredNorm() + (place(b) - place(c)).squaredNorm()) /
              (2.0 * stiffness * stiffness * 2.0);
          if (sum < minimum)
          {
            minimum = sum;
            best[0] = a;
            best[1] = b;
            best[2] = c;
          }
        }
      }
    }
    const std::vector<Vector3> found = BestDisplacements(nodes, lattice, costs, stiffness);
    for (int n = 0; n < 3; ++n)
    {
      // Between candidates by at most half a step.
      EXPECT_LE((found[n] - place(best[n])).cwiseAbs().maxCoeff(), 0.5 + 1e-6);
    }
  }
}

TEST(SparseVolume, SamplesAsTheImageDoes)
{
  ScalarImage image;
  image.grid.extent = { 3, 32, -2, 20, 0, 17 };
  image.grid.origin = Vector3(5.0, -7.0, 2.0);
  image.grid.spacing = Vector3(0.7, 0.8, 1.1);
  image.grid.direction =
    Eigen::AngleAxisd(0.4, Vector3(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  // A linear function is exact between voxels.
  const auto value = [&](const Vector3& world)
  { return 40.0 * world[0] - 25.0 * world[1] + world[2]; };
  std::vector<float> values;
  std::vector<std::int16_t> shorts;
  for (int k = 0; k <= 17; ++k)
  {
    for (int j = -2; j <= 20; ++j)
    {
      for (int i = 3; i <= 32; ++i)
      {
        values.push_back(static_cast<float>(value(image.grid.IndexToWorld(i, j, k))));
        shorts.push_back(static_cast<std::int16_t>(std::lround(values.back())));
      }
    }
  }
  const Vector3 middle = image.grid.IndexToWorld(17.0, 9.0, 8.0);
  for (const bool isShort : { false, true })
  {
    if (isShort)
    {
      image.values = static_cast<const std::int16_t*>(shorts.data());
    }
    else
    {
      image.values = static_cast<const float*>(values.data());
    }
    const SparseVolume volume(image, { middle }, 3.0);
    EXPECT_TRUE(volume.Covers(middle, 3.0));
    EXPECT_FALSE(volume.Covers(middle, 9.0));
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1.7, 1.7);
    for (int n = 0; n < 500; ++n)
    {
      const Vector3 place = middle + Vector3(uniform(random), uniform(random), uniform(random));
      EXPECT_NEAR(volume.Sample(place), value(place), isShort ? 0.6 : 0.1);
    }
    EXPECT_TRUE(std::isnan(volume.Sample(image.grid.IndexToWorld(2.9, 9.0, 8.0))));
    EXPECT_TRUE(std::isnan(volume.Sample(image.grid.IndexToWorld(32.0, 20.0, 17.0))));
    const AveragedVolume averaged = AverageBlocks(
      image, 1.5, middle - Vector3::Constant(100.0), middle + Vector3::Constant(100.0));
    EXPECT_NEAR(averaged.Sample(middle), value(middle), 1.0);
  }
}

TEST(VesselImage, IsOneInsideAndHalfAtTheWall)
{
  const VesselImage image = RenderLines(Fork(), 0.4, 2.0);
  const ScalarImage view = image.View();
  const SparseVolume volume(view, { Vector3(0.0, 0.0, 10.0) }, 6.0);
  EXPECT_NEAR(volume.Sample({ 0.0, 0.0, 10.0 }), 1.0, 1e-3);
  EXPECT_NEAR(volume.Sample({ 0.0, 1.5, 10.0 }), 0.5, 0.06);
  EXPECT_NEAR(volume.Sample({ 0.0, 2.5, 10.0 }), 0.0, 1e-3);
  ExpectRefusal([] { RenderLines({}, 0.4, 2.0); }, "no lines");
}

namespace
{
struct Box
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;

  /// A box, outwards or inwards.
  void Add(const Vector3& low, const Vector3& high, bool outwards = true)
  {
    const auto first = static_cast<std::int64_t>(this->points.size());
    for (int n = 0; n < 8; ++n)
    {
      this->points.emplace_back((n & 1) != 0 ? high[0] : low[0], (n & 2) != 0 ? high[1] : low[1],
        (n & 4) != 0 ? high[2] : low[2]);
    }
    const std::array<std::array<int, 4>, 6> faces{ { { 0, 2, 3, 1 }, { 4, 5, 7, 6 }, { 0, 1, 5, 4 },
      { 2, 6, 7, 3 }, { 0, 4, 6, 2 }, { 1, 3, 7, 5 } } };
    for (const std::array<int, 4>& f : faces)
    {
      this->triangles.push_back({ first + f[0], first + f[1], first + f[2] });
      this->triangles.push_back({ first + f[0], first + f[2], first + f[3] });
      if (!outwards)
      {
        std::swap(this->triangles.back()[1], this->triangles.back()[2]);
        Triangle& other = this->triangles[this->triangles.size() - 2];
        std::swap(other[1], other[2]);
      }
    }
  }

  VesselImage Image(double spacing = 0.5, double margin = 1.0) const
  {
    return RenderSurface(this->points, this->triangles, spacing, margin);
  }
};

double VolumeOf(const VesselImage& image)
{
  double sum = 0.0;
  for (const float value : image.values)
  {
    EXPECT_GE(value, 0.0F);
    EXPECT_LE(value, 1.0F + 1e-6F);
    sum += value;
  }
  return sum * image.grid.spacing.prod();
}
}

TEST(VesselImage, HasTheVolumeOfASurface)
{
  Box box;
  box.Add({ -3.1, 2.0, 7.3 }, { 4.2, 6.5, 9.9 });
  const double volume = 7.3 * 4.5 * 2.6;
  // Exact along x; across, a wall is anywhere between two samples.
  EXPECT_NEAR(VolumeOf(box.Image(0.1)), volume, 0.05 * volume);
  EXPECT_NEAR(VolumeOf(box.Image(0.5)), volume, 0.15 * volume);
  // Walls that run through the samples, and edges that do, are counted once.
  Box even;
  even.Add({ 0.0, 0.0, 0.0 }, { 4.0, 4.0, 4.0 });
  EXPECT_NEAR(VolumeOf(even.Image(1.0, 0.75)), 64.0, 1e-9);
  EXPECT_NEAR(VolumeOf(even.Image(1.0, 1.25)), 64.0, 1e-9);
  // Two boxes that overlap are one volume; inside out as well.
  for (const bool outwards : { true, false })
  {
    Box two;
    two.Add({ 0.0, 0.0, 0.0 }, { 4.0, 4.0, 4.0 }, outwards);
    two.Add({ 2.0, 0.0, 0.0 }, { 6.0, 4.0, 4.0 }, outwards);
    EXPECT_NEAR(VolumeOf(two.Image(1.0, 1.25)), 96.0, 1e-9);
  }
  // A ball.
  Box ball;
  constexpr int around = 40;
  for (int j = 0; j <= around; ++j)
  {
    for (int i = 0; i < 2 * around; ++i)
    {
      const double polar = Pi * j / around;
      const double angle = Pi * (i % (2 * around)) / around;
      ball.points.emplace_back(5.0 * std::sin(polar) * std::cos(angle),
        5.0 * std::sin(polar) * std::sin(angle), 5.0 * std::cos(polar));
      const std::int64_t next = (i + 1) % (2 * around);
      if (j > 0)
      {
        const std::int64_t row = 2 * around;
        ball.triangles.push_back({ (j - 1) * row + i, j * row + i, j * row + next });
        ball.triangles.push_back({ (j - 1) * row + i, j * row + next, (j - 1) * row + next });
      }
    }
  }
  // All points of the poles are at one place, but for the rounding of a sine.
  for (int i = 0; i < 2 * around; ++i)
  {
    ball.points[i] = { 0.0, 0.0, 5.0 };
    ball.points[around * 2 * around + i] = { 0.0, 0.0, -5.0 };
  }
  const double volumeOfBall = 4.0 / 3.0 * Pi * 125.0;
  EXPECT_NEAR(VolumeOf(ball.Image(0.4)), volumeOfBall, 0.01 * volumeOfBall);
  const VesselImage once = ball.Image(0.4);
  SetNumberOfThreads(3);
  EXPECT_EQ(ball.Image(0.4).values, once.values);
  SetNumberOfThreads(0);
}

TEST(VesselImage, RefusesSurfacesThatEncloseNothing)
{
  Box box;
  ExpectRefusal([&] { box.Image(); }, "no triangles");
  box.Add({ 0.0, 0.0, 0.0 }, { 4.0, 4.0, 4.0 });
  ExpectRefusal([&] { box.Image(0.0); }, "spacing");
  Box other = box;
  other.triangles.pop_back();
  ExpectRefusal(
    [&] { other.Image(); }, "not closed, or its triangles are not turned the same way: at 3 edges");
  other = box;
  std::swap(other.triangles[3][0], other.triangles[3][1]);
  ExpectRefusal([&] { other.Image(); }, "at 3 edges");
  other = box;
  other.triangles[2][1] = 8;
  ExpectRefusal([&] { other.Image(); }, "the corner 8");
  other = box;
  other.points[6][1] = std::nan("");
  ExpectRefusal([&] { other.Image(); }, "Point 6 is not finite");
  // A sheet that is gone there and back.
  other = box;
  other.triangles = { { 0, 1, 3 }, { 0, 3, 1 } };
  ExpectRefusal([&] { other.Image(); }, "encloses nothing");
}

namespace
{
/// An image of the fork, moved by `shift`.
VesselImage Moved(const Vector3& shift)
{
  Polylines lines = Fork();
  for (Vector3& point : lines.points)
  {
    point += shift;
  }
  return RenderLines(lines, 0.6, 4.0);
}

Vector3 Way(double t)
{
  return { 6.0 * std::sin(2.0 * Pi * t), 3.0 * (1.0 - std::cos(2.0 * Pi * t)),
    2.0 * std::sin(4.0 * Pi * t) };
}
}

TEST(CenterlineTracking, FollowsImagesOfVesselsAlone)
{
  const Polylines lines = Fork();
  std::vector<double> times;
  for (int k = 0; k < 10; ++k)
  {
    times.push_back(0.1 * k);
  }
  VesselImage image;
  int reads = 0;
  const auto imageAt = [&](double t)
  {
    ++reads;
    image = Moved(Way(t));
    return image.View();
  };
  CenterlineTrackingSettings settings;
  settings.tissue = false;
  settings.temporalWindow = 0.0;
  CenterlineTrackingReport report;
  const PoseSequence poses = TrackCenterlines(lines, 0.0, times, imageAt, settings, &report);
  ASSERT_EQ(poses.points.size(), times.size());
  CheckPoseSequence(poses, lines.points.size());
  EXPECT_EQ(report.imagesRead, reads);
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    double mean = 0.0;
    for (std::size_t p = 0; p < lines.points.size(); ++p)
    {
      mean += (poses.points[k][p] - lines.points[p] - Way(times[k])).norm() /
        static_cast<double>(lines.points.size());
    }
    EXPECT_LT(mean, 0.3) << "phase " << k;
    EXPECT_GT(report.trackedShare[k], 0.8);
  }
}

TEST(CenterlineTracking, FindsTissueThatTurnsAndShortens)
{
  // All there is turns by half a radian while it shortens by 15 %, and moves 15 mm: images of a field of
  // waves with vessels in it, whose value at a place is that of the place it came from.
  const Polylines lines = Fork();
  const auto deformed = [](double t)
  {
    const double done = 0.5 * (1.0 - std::cos(2.0 * Pi * t));
    return Matrix3(Eigen::AngleAxisd(0.5 * done, Vector3::UnitY()).toRotationMatrix() *
      Vector3(1.0 - 0.15 * done, 1.0 - 0.15 * done, 1.0 - 0.15 * done).asDiagonal());
  };
  const Vector3 middle(0.0, 0.0, 20.0);
  const auto placeOf = [&](const Vector3& rest, double t)
  {
    return Vector3(middle + deformed(t) * (rest - middle) +
      Vector3(0.0, 7.5 * (1.0 - std::cos(2.0 * Pi * t)), 0.0));
  };
  ScalarImage image;
  image.grid.extent = { 0, 69, 0, 69, 0, 84 };
  image.grid.origin = Vector3(-30.0, -25.0, -22.0);
  image.grid.spacing = Vector3::Constant(1.0);
  std::vector<float> values;
  const auto imageAt = [&](double t)
  {
    const Matrix3 back = deformed(t).inverse();
    const Vector3 shift = placeOf(middle, t);
    values.clear();
    for (int k = 0; k <= 84; ++k)
    {
      for (int j = 0; j <= 69; ++j)
      {
        for (int i = 0; i <= 69; ++i)
        {
          const Vector3 rest = middle + back * (image.grid.IndexToWorld(i, j, k) - shift);
          double nearest = 1e9;
          for (const auto& [a, b] : { std::make_pair(Vector3(0, 0, 0), Vector3(0, 0, 40)),
                 std::make_pair(Vector3(0, 0, 20), Vector3(20, 0, 20)) })
          {
            nearest = std::min(nearest, NearestOnSegment(rest, a, b).squaredDistance);
          }
          values.push_back(static_cast<float>(60.0 * std::sin(0.5 * rest[0] + 0.2 * rest[2]) +
            60.0 * std::sin(0.6 * rest[1] + 1.0) * std::cos(0.4 * rest[2]) +
            350.0 * std::exp(-nearest / 3.0)));
        }
      }
    }
    image.values = static_cast<const float*>(values.data());
    return image;
  };
  CenterlineTrackingSettings settings;
  settings.temporalWindow = 0.0;
  std::vector<double> times;
  for (int k = 0; k < 8; ++k)
  {
    times.push_back(0.125 * k);
  }
  const PoseSequence poses = TrackCenterlines(lines, 0.0, times, imageAt, settings);
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    double mean = 0.0;
    for (std::size_t p = 0; p < lines.points.size(); ++p)
    {
      mean += (poses.points[k][p] - placeOf(lines.points[p], times[k])).norm() /
        static_cast<double>(lines.points.size());
    }
    EXPECT_LT(mean, 0.3) << "phase " << k;
  }
}

TEST(ItemSharing, PacksLists)
{
  const std::vector<Vector3> places = { { 1.0, 2.0, 3.0 }, { 4.0, 5.0, 6.0 } };
  const std::vector<int> numbers = { 7 };
  std::vector<Vector3> places2 = { Vector3::Zero() };
  std::vector<char> none = { 'a' };
  std::vector<int> numbers2;
  Unpack(Packed(places, std::vector<char>(), numbers), places2, none, numbers2);
  EXPECT_EQ(places2, places);
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(numbers2, numbers);
}

TEST(CenterlineTracking, IsTheSameWhoeverMeasuresThePhases)
{
  const Polylines lines = Fork();
  const std::vector<double> times = { 0.0, 0.15, 0.3, 0.5, 0.7, 0.9 };
  CenterlineTrackingSettings settings;
  settings.tissue = false;
  settings.cycleLength = 1.0;
  const auto track = [&](ItemSharing& sharing, double damaged, CenterlineTrackingReport& report)
  {
    VesselImage image;
    return TrackCenterlines(
      lines, 0.0, times,
      [&](double t)
      {
        if (t == damaged)
        {
          throw std::runtime_error("damaged");
        }
        image = Moved(Way(t));
        return image.View();
      },
      settings, &report, {}, sharing);
  };
  CenterlineTrackingReport report;
  const PoseSequence alone = track(ItemSharing::None(), -1.0, report);
  for (const std::size_t size : { 2, 8 })
  {
    std::vector<PoseSequence> poses(size);
    std::vector<CenterlineTrackingReport> reports(poses.size());
    const std::vector<std::string> failures = ThreadSharing::Run(size,
      [&](ItemSharing& sharing, std::size_t own)
      { poses[own] = track(sharing, -1.0, reports[own]); });
    for (std::size_t own = 0; own < size; ++own)
    {
      ASSERT_EQ(failures[own], "");
      EXPECT_EQ(poses[own].points, alone.points);
      EXPECT_EQ(poses[own].confidence, alone.confidence);
      EXPECT_EQ(poses[own].status, alone.status);
      EXPECT_EQ(poses[own].calibre, alone.calibre);
      EXPECT_EQ(reports[own].trackedShare, report.trackedShare);
      // The reference and its share, whatever it needed again.
      EXPECT_LT(reports[own].imagesRead, report.imagesRead);
    }
  }
  // One that fails does not leave the others waiting.
  const std::vector<std::string> failures = ThreadSharing::Run(2,
    [&](ItemSharing& sharing, std::size_t)
    {
      CenterlineTrackingReport own;
      track(sharing, 0.3, own);
    });
  EXPECT_TRUE((failures == std::vector<std::string>{ "damaged", "another one failed" }) ||
    (failures == std::vector<std::string>{ "another one failed", "damaged" }));
}

namespace
{
double DistanceToAxes(const PhantomTree& tree, const Vector3& place)
{
  double minimum = std::numeric_limits<double>::infinity();
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t n = 0; n + 1 < branch.points.size(); ++n)
    {
      minimum = std::min(minimum,
        NearestOnSegment(place, tree.points[branch.points[n]], tree.points[branch.points[n + 1]])
          .squaredDistance);
    }
  }
  return std::sqrt(minimum);
}

/// How many of the places, given as they were found, are nearer to the vein than to the arteries.
int AtTheVein(
  const PhantomTree& arteries, const PhantomTree& vein, const std::vector<Vector3>& found)
{
  return static_cast<int>(std::count_if(found.begin(), found.end(),
    [&](const Vector3& place)
    { return DistanceToAxes(arteries, place) >= DistanceToAxes(vein, place); }));
}
}

TEST(CenterlineTracking, DoesNotJumpToAVein)
{
  // The great cardiac vein runs beside the anterior descending and the circumflex artery; here it is as bright as
  // they are, so that brightness does not tell them apart.
  PhantomSettings anatomy;
  anatomy.veinHU = 400.0;
  anatomy.temporalWindow = 0.0;
  const CoronaryPhantom phantom(anatomy);
  const double reference = 0.75;
  const PhantomTree rest = phantom.Tree(reference);
  const PhantomTree veinAtRest = phantom.Vein(reference);
  const Polylines lines = LinesOf(rest);
  // Beside the vein: nearer than the search reaches, and not where the two cross.
  std::vector<std::size_t> beside;
  for (std::size_t n = 0; n < rest.points.size(); ++n)
  {
    const double apart = DistanceToAxes(veinAtRest, rest.points[n]);
    if (apart > 1.5 && apart < 8.0)
    {
      beside.push_back(n);
    }
  }
  ASSERT_GT(beside.size(), 300u);
  const ImageGrid grid = phantom.DefaultGrid(1.0, 6.0);
  std::vector<std::int16_t> voxels;
  const auto imageAt = [&](double time)
  {
    ScalarImage image;
    image.grid = grid;
    voxels.resize(static_cast<std::size_t>(image.NumberOfVoxels()));
    phantom.Render(grid, grid.extent, time, voxels.data());
    image.values = static_cast<const std::int16_t*>(voxels.data());
    return image;
  };
  CenterlineTrackingSettings settings;
  settings.nodeSpacing = 4.0;
  const std::vector<double> times = { 0.05, 0.2, 0.35, 0.5, 0.75 };
  const PoseSequence poses = TrackCenterlines(lines, reference, times, imageAt, settings);
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    const PhantomTree arteries = phantom.Tree(times[k]);
    const PhantomTree vein = phantom.Vein(times[k]);
    std::vector<Vector3> found;
    std::vector<Vector3> jumped;
    for (const std::size_t n : beside)
    {
      found.push_back(poses.points[k][n]);
      const Vector3* nearest = &vein.points.front();
      for (const Vector3& place : vein.points)
      {
        if ((place - arteries.points[n]).norm() < (*nearest - arteries.points[n]).norm())
        {
          nearest = &place;
        }
      }
      jumped.push_back(*nearest);
    }
    EXPECT_EQ(AtTheVein(arteries, vein, found), 0) << "at " << times[k];
    // The same count of places that did jump.
    EXPECT_GT(AtTheVein(arteries, vein, jumped), static_cast<int>(0.9 * beside.size()));
  }
}

TEST(CenterlineTracking, FillsAPhaseWithoutVessels)
{
  const Polylines lines = Fork();
  std::vector<double> times;
  for (int k = 0; k < 10; ++k)
  {
    times.push_back(0.1 * k);
  }
  VesselImage image;
  const auto imageAt = [&](double t)
  {
    image = Moved(Way(t));
    if (t == times[4])
    {
      std::fill(image.values.begin(), image.values.end(), 0.0F);
    }
    return image.View();
  };
  CenterlineTrackingSettings settings;
  settings.tissue = false;
  settings.temporalWindow = 0.0;
  CenterlineTrackingReport report;
  const PoseSequence poses = TrackCenterlines(lines, 0.0, times, imageAt, settings, &report);
  EXPECT_LT(report.trackedShare[4], 0.01);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("lost"), std::string::npos);
  for (std::size_t p = 0; p < lines.points.size(); ++p)
  {
    EXPECT_NE(poses.status[4][p], TrackingStatus::Tracked);
    EXPECT_LT((poses.points[4][p] - lines.points[p] - Way(times[4])).norm(), 1.5);
  }
}

TEST(CenterlineTracking, MeasuresPhasesThatShowTheSameMoment)
{
  const Polylines lines = Fork();
  const std::vector<double> times = { 0.0, 0.25, 0.5, 0.75, 1.005 };
  VesselImage image;
  const auto imageAt = [&](double t)
  {
    image = Moved(Way(t));
    return image.View();
  };
  CenterlineTrackingSettings settings;
  settings.tissue = false;
  settings.temporalWindow = 0.0;
  CenterlineTrackingReport report;
  TrackCenterlines(lines, 0.0, times, imageAt, settings, &report);
  EXPECT_EQ(report.repeatedPhases, 1);
  EXPECT_LT(report.repeatability, 0.3);
  EXPECT_GE(report.repeatability, 0.0);
}

TEST(CenterlineTracking, RefusesWhatIsWrong)
{
  const Polylines lines = Fork();
  VesselImage image = Moved(Vector3::Zero());
  const auto imageAt = [&](double) { return image.View(); };
  const auto track = [&](const std::vector<double>& times, double reference = 0.0)
  { TrackCenterlines(lines, reference, times, imageAt); };
  ExpectRefusal([&] { track({}); }, "no phase");
  ExpectRefusal([&] { track({ 0.0, 0.5, 0.5 }); }, "do not increase: number 2");
  ExpectRefusal([&] { track({ 0.0, std::nan("") }); }, "do not increase: number 1");
  ExpectRefusal([&] { track({ 0.0, 0.5 }, std::nan("")); }, "reference time");
  CenterlineTrackingSettings settings;
  settings.nodeSpacing = 0.0;
  ExpectRefusal([&] { TrackCenterlines(lines, 0.0, { 0.0 }, imageAt, settings); }, "nodeSpacing");
  ExpectRefusal([&] { TrackCenterlines({}, 0.0, { 0.0 }, imageAt); }, "no points");
  image = Moved(Vector3(500.0, 0.0, 0.0));
  ExpectRefusal([&] { track({ 0.0, 0.5 }); }, "outside of the image");
  image = Moved(Vector3::Zero());
  std::fill(image.values.begin(), image.values.end(), 3.0F);
  ExpectRefusal([&] { track({ 0.0, 0.5 }); }, "same everywhere");
  EXPECT_THROW(TrackCenterlines(
                 lines, 0.0, { 0.0, 0.5 },
                 [&](double)
                 {
                   image = Moved(Vector3::Zero());
                   return image.View();
                 },
                 {}, nullptr, [](double) { return false; }),
    Cancelled);
}
}
