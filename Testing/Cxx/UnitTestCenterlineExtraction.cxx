// Lumen measurement, smoothing, surface distance and whole trees against tubes in closed form.

#include "BifurcationFit.h"
#include "CenterlineExtraction.h"
#include "CounterRandom.h"
#include "CurveSmoothing.h"
#include "LumenMeasurement.h"
#include "SurfaceDistance.h"
#include "VeinRejection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>

namespace UnitTestCenterlineExtraction
{
using namespace coronary;

namespace
{
struct Tube
{
  std::vector<Vector3> axis;
  double radius;
};

double DistanceToPolyline(const Vector3& p, const std::vector<Vector3>& line)
{
  double minimum = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < line.size(); ++i)
  {
    const Vector3 d = line[i] - line[i - 1];
    const double t =
      std::min(1.0, std::max(0.0, (p - line[i - 1]).dot(d) / std::max(d.squaredNorm(), 1e-12)));
    minimum = std::min(minimum, (line[i - 1] + t * d - p).norm());
  }
  return minimum;
}

/// A soft-walled image of tubes with noise, its ideal vesselness, and its mask.
struct Scene
{
  ImageGrid grid;
  std::vector<float> image;
  std::vector<float> speed;
  std::vector<unsigned char> mask;
  ScalarImage scalar;

  Scene(const std::vector<Tube>& tubes, const Vector3& spacing, const Matrix3& direction,
    const Vector3& centre, double halfSize, double unit = 1.0, double noise = 20.0)
  {
    grid.spacing = spacing * unit;
    grid.direction = direction;
    int n[3];
    for (int a = 0; a < 3; ++a)
    {
      n[a] = static_cast<int>(std::ceil(2.0 * halfSize / spacing[a]));
      grid.extent[2 * a] = 5 - a;
      grid.extent[2 * a + 1] = 5 - a + n[a] - 1;
    }
    grid.origin = Vector3::Zero();
    grid.origin = centre * unit -
      (grid.IndexToWorld(
        grid.extent[0] + 0.5 * n[0], grid.extent[2] + 0.5 * n[1], grid.extent[4] + 0.5 * n[2]));
    RandomStream random(7);
    for (int k = grid.extent[4]; k <= grid.extent[5]; ++k)
    {
      for (int j = grid.extent[2]; j <= grid.extent[3]; ++j)
      {
        for (int i = grid.extent[0]; i <= grid.extent[1]; ++i)
        {
          const Vector3 p = grid.IndexToWorld(i, j, k) / unit;
          double wall = std::numeric_limits<double>::infinity();
          double narrow = 1.0;
          for (const Tube& tube : tubes)
          {
            const double d = DistanceToPolyline(p, tube.axis) - tube.radius;
            if (d < wall)
            {
              wall = d;
              narrow = tube.radius;
            }
          }
          const double inside = 0.5 * std::erfc(wall / (std::sqrt(2.0) * 0.35));
          image.push_back(static_cast<float>(-100.0 + 500.0 * inside + noise * random.Normal()));
          speed.push_back(
            wall < 0.5 ? static_cast<float>(std::max(0.05, 0.2 - 0.5 * wall / narrow)) : 0.0F);
          mask.push_back(wall < 0.0 ? 1 : 0);
        }
      }
    }
    scalar = { image.data(), grid };
  }

  CenterlineInput Input(const std::vector<Vector3>& seeds) const
  {
    CenterlineInput input;
    input.grid = grid;
    input.speed = speed.data();
    input.intensity = &scalar;
    input.seeds = seeds;
    return input;
  }
};

Matrix3 Oblique()
{
  return (Eigen::AngleAxisd(0.5, Vector3(1.0, 2.0, -0.5).normalized()) *
    Eigen::AngleAxisd(1.1, Vector3::UnitZ()))
    .toRotationMatrix();
}

std::vector<Vector3> Line(const Vector3& a, const Vector3& b)
{
  return { a, b };
}

std::vector<Vector3> Helix()
{
  std::vector<Vector3> points;
  for (int i = 0; i <= 200; ++i)
  {
    const double t = i / 200.0 * 1.5 * 2.0 * M_PI;
    points.emplace_back(8.0 * std::cos(t), 8.0 * std::sin(t), 2.0 * t - 9.0);
  }
  return points;
}

double Length(const std::vector<Vector3>& points)
{
  double length = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i)
  {
    length += (points[i] - points[i - 1]).norm();
  }
  return length;
}

struct Deviation
{
  double axis = 0.0;
  double radius = 0.0;
  double maximum = 0.0;
};

Deviation Compare(const VesselTree& tree, const Tube& tube, double unit = 1.0)
{
  Deviation deviation;
  for (std::size_t i = 0; i < tree.points.size(); ++i)
  {
    const double d = DistanceToPolyline(tree.points[i] / unit, tube.axis);
    deviation.axis += d / static_cast<double>(tree.points.size());
    deviation.maximum = std::max(deviation.maximum, d);
    deviation.radius +=
      std::abs(tree.radius[i] / unit - tube.radius) / static_cast<double>(tree.points.size());
  }
  return deviation;
}

/// A closed cylinder along z with rounded numbers of facets.
void Cylinder(double radius, double height, int around, int along, std::vector<Vector3>& points,
  std::vector<Triangle>& triangles)
{
  for (int k = 0; k <= along; ++k)
  {
    for (int i = 0; i < around; ++i)
    {
      const double a = 2.0 * M_PI * i / around;
      points.emplace_back(radius * std::cos(a), radius * std::sin(a), height * k / along);
    }
  }
  for (int k = 0; k < along; ++k)
  {
    for (int i = 0; i < around; ++i)
    {
      const std::int64_t a = k * around + i;
      const std::int64_t b = k * around + (i + 1) % around;
      triangles.push_back({ a, b, b + around });
      triangles.push_back({ a, b + around, a + around });
    }
  }
  const auto bottom = static_cast<std::int64_t>(points.size());
  points.emplace_back(0.0, 0.0, 0.0);
  points.emplace_back(0.0, 0.0, height);
  for (int i = 0; i < around; ++i)
  {
    triangles.push_back({ bottom, (i + 1) % around, i });
    triangles.push_back({ bottom + 1, along * around + i, along * around + (i + 1) % around });
  }
}
}

TEST(CurveSmoothing, KeepsLengthAndStopsNoise)
{
  // A circle sampled with noise: its length must come back, not a chord's.
  RandomStream random(3);
  std::vector<Vector3> exact;
  std::vector<Vector3> noisy;
  for (int i = 0; i <= 240; ++i)
  {
    const double a = 1.5 * M_PI * i / 240;
    exact.emplace_back(10.0 * std::cos(a), 10.0 * std::sin(a), 500.0);
    noisy.push_back(exact.back() + 0.15 * Vector3(random.Normal(), random.Normal(), 0.0));
  }
  const std::vector<double> weights(exact.size(), 1.0);
  const std::vector<Vector3> kept = SmoothCurve(exact, weights, 24.0);
  EXPECT_NEAR(Length(kept), Length(exact), 1e-3 * Length(exact));
  const std::vector<Vector3> smooth = SmoothCurve(noisy, weights, 24.0);
  EXPECT_GT(Length(noisy), 1.2 * Length(exact));
  EXPECT_NEAR(Length(smooth), Length(exact), 5e-3 * Length(exact));
  double sum = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i)
  {
    sum += (smooth[i] - exact[i]).norm() / static_cast<double>(exact.size());
  }
  EXPECT_LT(sum, 0.06);
}

TEST(CurveSmoothing, WavelengthIsHalved)
{
  std::vector<double> wave;
  for (int i = 0; i < 600; ++i)
  {
    wave.push_back(std::sin(2.0 * M_PI * i / 20.0));
  }
  const std::vector<double> smooth =
    SmoothSequence(wave, std::vector<double>(wave.size(), 1.0), 20.0);
  EXPECT_NEAR(smooth[305], 0.5 * wave[305], 0.01);
}

TEST(CurveSmoothing, ResamplingIsEven)
{
  const std::vector<Vector3> even =
    ResampleCurve({ Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(1, 3, 0), Vector3(1, 3, 0) }, 0.3);
  EXPECT_EQ(even.size(), 14u);
  EXPECT_EQ(even.back(), Vector3(1, 3, 0));
  EXPECT_EQ(ResampleCurve({ Vector3(1, 2, 3) }, 0.3).size(), 1u);
}

TEST(LumenMeasurement, RadiusAndCentreOfATube)
{
  for (const double radius : { 0.8, 1.5, 2.4 })
  {
    const Tube tube{ Line(Vector3(-20, 3, 1), Vector3(20, -4, 6)), radius };
    const Scene scene({ tube }, Vector3(0.35, 0.4, 0.5), Oblique(), Vector3(0, 0, 3), 8.0);
    const ImageInterpolator image(scene.scalar);
    LumenSettings settings;
    settings.reference = { 400.0, -100.0, radius };
    const Vector3 axis = (tube.axis[1] - tube.axis[0]).normalized();
    const Vector3 centre = 0.5 * (tube.axis[0] + tube.axis[1]);
    const LumenSection section =
      MeasureLumen(image, centre + 0.5 * radius * axis.unitOrthogonal(), axis, 1.0, settings);
    EXPECT_LT((section.centre - centre).norm(), 0.1);
    EXPECT_NEAR(section.radius, radius, 0.08);
    EXPECT_GT(section.confidence, 0.9);
    // Beside the tube there is no lumen.
    const LumenSection none =
      MeasureLumen(image, centre + (radius + 3.0) * axis.unitOrthogonal(), axis, 1.0, settings);
    EXPECT_LT(none.confidence, 0.1);
    LumenReference reference;
    EXPECT_TRUE(MeasureReference(image, centre, reference));
    EXPECT_NEAR(reference.background, -100.0, 60.0);
    EXPECT_NEAR(reference.lumen, 400.0, 150.0);
  }
}

TEST(VeinRejection, WhatHangsOnAVeinIsOne)
{
  // A trunk, two branches that leave its end, a daughter of each.
  VesselTree tree;
  tree.points.assign(6, Vector3::Zero());
  tree.branches = { { { 0, 1 }, 10, -1 }, { { 1, 2 }, 11, 10 }, { { 1, 3 }, 12, 10 },
    { { 2, 4 }, 13, 11 }, { { 3, 5 }, 14, 12 } };
  std::vector<VeinBranch> judged;
  for (const auto& [group, probability] :
    std::map<int, double>{ { 11, 0.2 }, { 13, 0.1 }, { 14, 0.4 } })
  {
    judged.emplace_back();
    judged.back().groupId = group;
    judged.back().probability = probability;
  }
  EXPECT_EQ(
    VeinProbabilityOfPoints(tree, judged), (std::vector<double>{ 0.0, 0.0, 0.2, 0.0, 0.2, 0.4 }));
  EXPECT_EQ(VeinProbabilityOfPoints(tree, {}), std::vector<double>(6, 0.0));
}

TEST(LumenMeasurement, CentreBesideAVein)
{
  // Half as bright, and its wall against the artery's.
  const Tube artery{ Line(Vector3(-20, 0, 0), Vector3(20, 3, 5)), 0.9 };
  const Vector3 axis = (artery.axis[1] - artery.axis[0]).normalized();
  const Vector3 aside = 2.3 * axis.unitOrthogonal();
  const Tube vein{ Line(artery.axis[0] + aside, artery.axis[1] + aside), 1.3 };
  const Vector3 spacing = Vector3::Constant(0.4);
  Scene scene({ artery }, spacing, Oblique(), Vector3(0, 1, 2), 6.0);
  const Scene beside({ vein }, spacing, Oblique(), Vector3(0, 1, 2), 6.0, 1.0, 0.0);
  for (std::size_t i = 0; i < scene.image.size(); ++i)
  {
    scene.image[i] = std::max(scene.image[i], -100.0F + 0.5F * (beside.image[i] + 100.0F));
  }
  const ImageInterpolator image(scene.scalar);
  LumenSettings settings;
  settings.reference = { 400.0, -100.0, 1.5 };
  const Vector3 middle = 0.5 * (artery.axis[0] + artery.axis[1]);
  double error = 0.0;
  constexpr int sections = 21;
  for (int i = 0; i < sections; ++i)
  {
    const Vector3 centre = middle + (0.4 * i - 4.0) * axis;
    const LumenSection section = MeasureLumen(image, centre, axis, 1.0, settings);
    const Vector3 offset = section.centre - centre;
    error += offset.norm() / sections;
  }
  EXPECT_LT(error, 0.05);
}

TEST(LumenMeasurement, BlurredDiscsGiveTheirRadiusBack)
{
  // A disc seen through a Gaussian, by brute force.
  for (const double radius : { 0.3, 0.5, 0.8, 1.2, 2.5, 4.0 })
  {
    const double blur = 0.4;
    const auto value = [&](double x)
    {
      double sum = 0.0;
      const int n = 400;
      for (int i = 0; i < n; ++i)
      {
        for (int j = 0; j < n; ++j)
        {
          const double u = radius * (2.0 * (i + 0.5) / n - 1.0);
          const double v = radius * (2.0 * (j + 0.5) / n - 1.0);
          if (u * u + v * v < radius * radius)
          {
            sum += std::exp(-((x - u) * (x - u) + v * v) / (2.0 * blur * blur));
          }
        }
      }
      return sum;
    };
    double low = 0.0;
    double high = radius + 2.0;
    const double half = 0.5 * value(0.0);
    for (int i = 0; i < 25; ++i)
    {
      const double middle = 0.5 * (low + high);
      (value(middle) > half ? low : high) = middle;
    }
    EXPECT_NEAR(RadiusFromHalfMaximum(low, blur), radius, 0.01) << radius;
    const double contrast = 1.0 - std::exp(-radius * radius / (2.0 * blur * blur));
    if (contrast > 0.3 && contrast < 0.95)
    {
      EXPECT_NEAR(BlurFromContrast(low, contrast), blur, 0.01) << radius;
    }
  }
}

TEST(SurfaceDistance, ExactInACylinder)
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
  Cylinder(2.0, 20.0, 200, 50, points, triangles);
  const Vector3 shift(500.3, -200.1, 77.7);
  for (Vector3& point : points)
  {
    point += shift;
  }
  for (const bool inverted : { false, true })
  {
    const SurfaceDistance distance = ComputeSurfaceDistance(points, triangles, 0.25);
    EXPECT_EQ(distance.openEdges, 0);
    EXPECT_EQ(distance.doubtfulRows, 0);
    const std::array<int, 6>& e = distance.grid.extent;
    std::size_t v = 0;
    double maximum = 0.0;
    for (int k = e[4]; k <= e[5]; ++k)
    {
      for (int j = e[2]; j <= e[3]; ++j)
      {
        for (int i = e[0]; i <= e[1]; ++i, ++v)
        {
          const Vector3 p = distance.grid.IndexToWorld(i, j, k) - shift;
          const double radial = 2.0 - std::hypot(p[0], p[1]);
          const double axial = std::min(p[2], 20.0 - p[2]);
          const double exact = std::min(radial, axial);
          if (exact > 0.0)
          {
            maximum = std::max(maximum, std::abs(distance.values[v] - exact));
          }
          else if (exact < -0.01)
          {
            EXPECT_LE(distance.values[v], 0.0F);
          }
        }
      }
    }
    EXPECT_LT(maximum, 0.025) << inverted;
    for (Triangle& triangle : triangles)
    {
      std::swap(triangle[0], triangle[1]);
    }
  }
  EXPECT_THROW(ComputeSurfaceDistance(points, {}), std::invalid_argument);
  triangles.front()[0] = 1000000;
  EXPECT_THROW(ComputeSurfaceDistance(points, triangles), std::invalid_argument);
}

TEST(CenterlineExtraction, StraightAndHelicalTubesOnObliqueGrids)
{
  const std::vector<Tube> tubes = { { Line(Vector3(-12, -5, -9), Vector3(11, 7, 10)), 1.5 },
    { Helix(), 1.3 } };
  for (const Tube& tube : tubes)
  {
    const Scene scene({ tube }, Vector3(0.4, 0.45, 0.55), Oblique(), Vector3::Zero(), 16.0);
    const CenterlineResult result =
      ExtractCenterlines(scene.Input({ tube.axis.front() }), CenterlineSettings{});
    ASSERT_EQ(result.tree.branches.size(), 1u);
    EXPECT_EQ(result.seeds[0].status, EndStatus::Reached);
    const Deviation deviation = Compare(result.tree, tube);
    EXPECT_LT(deviation.axis, 0.08);
    // The tube ends round: the tip may be as far beyond the axis.
    EXPECT_LT(deviation.maximum, tube.radius);
    EXPECT_LT(deviation.radius, 0.1);
    // Neither cut corners nor a smoother may shorten it.
    EXPECT_NEAR(result.tree.branches[0].length, Length(tube.axis), 1.5 + 0.02 * Length(tube.axis));
    EXPECT_GT(result.tree.confidence[result.tree.points.size() / 2], 0.8);
    std::cout << "axis " << deviation.axis << " radius " << deviation.radius << " length "
              << result.tree.branches[0].length << " of " << Length(tube.axis) << '\n';
  }
}

// As at the end of a left main: both daughters are great, one of them bends away from the other.
struct WideFork
{
  std::vector<Vector3> through;
  std::vector<Vector3> side;
  Vector3 fork = Vector3::Zero();

  explicit WideFork(double angle)
  {
    for (int i = -60; i <= 60; ++i)
    {
      const double x = 0.2 * i;
      through.emplace_back(x, -0.012 * x * x, 0.004 * x * x);
    }
    side.push_back(fork);
    for (int i = 0; i < 60; ++i)
    {
      const double bent = angle + 0.004 * i;
      side.emplace_back(side.back() + 0.2 * Vector3(std::cos(bent), std::sin(bent), 0.1));
    }
  }
};

TEST(BifurcationFit, TheWallTellsWhereWideAxesMeet)
{
  constexpr double voxel = 0.4;
  for (const double angle : { 0.6, 0.9, 1.2, 1.5 })
  {
    SCOPED_TRACE(angle);
    const WideFork truth(angle);
    const Scene scene({ { truth.through, 2.2 }, { truth.side, 1.7 } }, Vector3::Constant(voxel),
      Oblique(), Vector3::Zero(), 13.0);
    const ImageInterpolator image(scene.scalar);
    LumenSettings settings;
    settings.reference = { 400.0, -100.0, 2.0 };
    for (const double along : { -1.2, 0.0, 1.2 })
    {
      SCOPED_TRACE(along);
      // What sections give: the axis drawn to the mouth and too wide there, the fork off.
      BifurcationAxes axes;
      for (const Vector3& point : truth.through)
      {
        const double mouth = std::exp(-0.5 * std::pow((point[0] - 1.5) / 1.5, 2.0));
        axes.through.emplace_back(point + 0.3 * mouth * Vector3::UnitY());
        axes.throughRadius.push_back(2.2 + 0.25 * mouth);
      }
      axes.fork = static_cast<std::size_t>(60 + std::lround(along / 0.2));
      for (std::size_t i = 0; i < truth.side.size(); ++i)
      {
        const double hidden = std::max(0.0, 1.0 - static_cast<double>(i) / 16.0);
        axes.side.emplace_back((1.0 - hidden) * truth.side[i] +
          hidden *
            (axes.through[axes.fork] +
              0.2 * static_cast<double>(i) * Vector3(std::cos(angle), std::sin(angle), 0.1)));
        axes.sideRadius.push_back(1.7);
      }
      axes.side.front() = axes.through[axes.fork];
      const BifurcationFit fit = FitBifurcation(image, axes, settings, -0.35);
      ASSERT_TRUE(fit.found);
      const Vector3 fork = BezierPoint(fit.through, fit.meeting);
      EXPECT_EQ(fork, fit.side.front());
      // Three voxels off before, less than one across the daughter's axis now. What remains is the
      // given fork's weight, and 0.1 to 0.2 mm of the bend that is expected: this one is straight.
      EXPECT_LT((fork - truth.fork).norm() * std::sin(angle), voxel) << fork.transpose();
      EXPECT_LT((fork - truth.fork).norm(), 1.5 * fit.deviation);
      // The curve ends on the given axis, which is 0.3 mm aside in the mouth.
      EXPECT_LT(DistanceToPolyline(fork, truth.through), 0.2 * voxel);
      EXPECT_NEAR(fit.radius, 2.2, 0.15 * voxel);
      EXPECT_NEAR(fit.sideRadius, 1.7, 0.15 * voxel);
      EXPECT_LT(fit.rounding, 0.6); // The image's blur, the edge is sharp.
      EXPECT_LT(fit.misfit, 0.2);
      EXPECT_GT(fit.deviation, 0.05);
      EXPECT_LT(fit.deviation * std::sin(angle), voxel);

      // The wrong one of the two is not what goes straight on.
      EXPECT_FALSE(FitBifurcation(image, axes, settings, 2.0).found);
    }
  }
}

TEST(BifurcationFit, WhatIsNoForkIsNotFitted)
{
  const WideFork truth(1.0);
  const Scene scene({ { truth.through, 2.2 }, { truth.side, 1.7 } }, Vector3::Constant(0.4),
    Matrix3::Identity(), Vector3::Zero(), 13.0);
  const ImageInterpolator image(scene.scalar);
  LumenSettings settings;
  settings.reference = { 400.0, -100.0, 2.0 };
  BifurcationAxes axes;
  axes.through = truth.through;
  axes.throughRadius.assign(truth.through.size(), 2.2);
  axes.fork = 60;
  axes.side = truth.side;
  axes.sideRadius.assign(truth.side.size(), 1.7);
  ASSERT_TRUE(FitBifurcation(image, axes, settings, -0.35).found);

  BifurcationAxes shortSide = axes;
  shortSide.side.resize(20);
  shortSide.sideRadius.resize(20);
  EXPECT_FALSE(FitBifurcation(image, shortSide, settings, -0.35).found);

  BifurcationAxes atItsEnd = axes;
  atItsEnd.through.resize(64);
  atItsEnd.throughRadius.resize(64);
  EXPECT_FALSE(FitBifurcation(image, atItsEnd, settings, -0.35).found);

  // Axes in empty fat: there is no wall.
  BifurcationAxes elsewhere = axes;
  for (std::vector<Vector3>* line : { &elsewhere.through, &elsewhere.side })
  {
    for (Vector3& point : *line)
    {
      point += Vector3(0.0, 0.0, 9.0);
    }
  }
  EXPECT_FALSE(FitBifurcation(image, elsewhere, settings, -0.35).found);

  EXPECT_FALSE(FitBifurcation(image, {}, settings, -0.35).found);
}

TEST(CenterlineExtraction, OneSharedPointAtABifurcation)
{
  const Tube parent{ Line(Vector3(-14, 0, 0), Vector3(14, 1, 2)), 1.8 };
  const Vector3 joint = parent.axis[0] + 0.45 * (parent.axis[1] - parent.axis[0]);
  const Tube daughter{ Line(joint, joint + Vector3(8, 9, -4)), 1.1 };
  const Scene scene(
    { parent, daughter }, Vector3::Constant(0.4), Matrix3::Identity(), Vector3::Zero(), 16.0);
  const CenterlineResult result =
    ExtractCenterlines(scene.Input({ parent.axis.front() }), CenterlineSettings{});
  ASSERT_EQ(result.tree.branches.size(), 3u);
  ASSERT_EQ(result.bifurcations.size(), 1u);
  const CenterlineBifurcation& fork = result.bifurcations[0];
  EXPECT_LT((result.tree.points[static_cast<std::size_t>(fork.point)] - joint).norm(), 0.8);
  ASSERT_EQ(fork.daughterGroupIds.size(), 2u);
  EXPECT_EQ(result.tree.branches[0].points.back(), fork.point);
  EXPECT_EQ(result.tree.branches[1].points.front(), fork.point);
  EXPECT_EQ(result.tree.branches[2].points.front(), fork.point);
  EXPECT_NO_THROW(CheckTree(result.tree));
}

TEST(CenterlineExtraction, AnAneurysmWithAClearWallIsVessel)
{
  const Tube parent{ Line(Vector3(-14, 0, -12), Vector3(14, 0, -12)), 1.5 };
  const Tube daughter{ Line(Vector3(0, 0, -12), Vector3(0, 0, 14)), 0.9 };
  const Tube aneurysm{ Line(Vector3(0, 0, -1), Vector3(0, 0, 4)), 2.2 };
  const Scene scene({ parent, daughter, aneurysm }, Vector3::Constant(0.4), Matrix3::Identity(),
    Vector3::Zero(), 16.0);
  const CenterlineResult result =
    ExtractCenterlines(scene.Input({ parent.axis.front() }), CenterlineSettings{});
  double highest = -100.0;
  for (const Vector3& point : result.tree.points)
  {
    highest = std::max(highest, point[2]);
  }
  EXPECT_GT(highest, 12.0);
}

TEST(CenterlineExtraction, AWideVesselInFineVoxelsFromASeedBesideItsAxis)
{
  const Tube tube{ Line(Vector3(0, 0, -9), Vector3(0, 0, 9)), 2.5 };
  const Scene scene({ tube }, Vector3::Constant(0.3), Matrix3::Identity(), Vector3::Zero(), 12.0);
  const CenterlineResult result =
    ExtractCenterlines(scene.Input({ Vector3(2.1, 0, -8.5) }), CenterlineSettings{});
  ASSERT_EQ(result.tree.branches.size(), 1U) << result.seeds[0].message;
  EXPECT_GT(result.tree.branches[0].length, 14.0);
  EXPECT_LT(Compare(result.tree, tube).radius, 0.2);
}

// The longer way turns off by more than a right angle: its path is rounded there, and the vessel that
// goes straight on is set on to that curve.
TEST(CenterlineExtraction, TheForkOfALongBranchThatTurnsOffIsWhereTheAxesMeet)
{
  for (const double angle : { 1.2, 1.6, 1.9 })
  {
    SCOPED_TRACE(angle);
    const Vector3 fork(1.0, 0.0, 0.0);
    const Vector3 away = 13.0 * Vector3(std::cos(angle), std::sin(angle), 0.1);
    const std::vector<Tube> tubes = { { Line({ -13.0, 0.0, 0.0 }, fork), 1.6 },
      { Line(fork, { 9.0, 0.5, 0.0 }), 1.4 }, { Line(fork, fork + away), 0.9 } };
    const Scene scene(tubes, Vector3::Constant(0.4), Oblique(), Vector3::Zero(), 14.5);
    const CenterlineResult result =
      ExtractCenterlines(scene.Input({ { -12.5, 0.0, 0.0 } }), CenterlineSettings{});
    ASSERT_EQ(result.bifurcations.size(), 1U);
    const Vector3& found =
      result.tree.points[static_cast<std::size_t>(result.bifurcations.front().point)];
    EXPECT_LT((found - fork).norm(), 0.5);
    // The straight axis stays one, and no point goes back.
    for (const VesselTree::Branch& branch : result.tree.branches)
    {
      for (std::size_t i = 2; i < branch.points.size(); ++i)
      {
        const auto at = [&](std::size_t n) -> const Vector3&
        { return result.tree.points[static_cast<std::size_t>(branch.points[n])]; };
        EXPECT_GT((at(i) - at(i - 1)).dot(at(i - 1) - at(i - 2)), 0.0);
      }
    }
    for (std::size_t p = 0; p < result.tree.points.size(); ++p)
    {
      double minimum = std::numeric_limits<double>::infinity();
      for (const Tube& tube : tubes)
      {
        minimum = std::min(minimum, DistanceToPolyline(result.tree.points[p], tube.axis));
      }
      // At its tip a vessel is seen up to a radius farther than its axis.
      const bool tip = std::any_of(tubes.begin(), tubes.end(),
        [&](const Tube& tube) {
          return tube.axis.back() != fork &&
            (result.tree.points[p] - tube.axis.back()).norm() < 1.6;
        });
      EXPECT_TRUE(tip || minimum < 0.3) << result.tree.points[p].transpose() << ": " << minimum;
    }
  }
}

TEST(CenterlineExtraction, MetresAndShiftsChangeNothing)
{
  const Tube tube{ Line(Vector3(-12, -5, -9), Vector3(11, 7, 10)), 1.5 };
  const Scene millimetres(
    { tube }, Vector3::Constant(0.45), Oblique(), Vector3::Zero(), 16.0, 1.0, 0.0);
  const Scene metres(
    { tube }, Vector3::Constant(0.45), Oblique(), Vector3::Zero(), 16.0, 0.001, 0.0);
  const CenterlineResult a =
    ExtractCenterlines(millimetres.Input({ tube.axis.front() }), CenterlineSettings{});
  const CenterlineResult b =
    ExtractCenterlines(metres.Input({ 0.001 * tube.axis.front() }), CenterlineSettings{});
  Scene far = millimetres;
  far.grid.origin += Vector3::Constant(500.0);
  far.scalar = { far.image.data(), far.grid };
  const CenterlineResult c = ExtractCenterlines(
    far.Input({ tube.axis.front() + Vector3::Constant(500.0) }), CenterlineSettings{});
  ASSERT_EQ(a.tree.points.size(), b.tree.points.size());
  ASSERT_EQ(a.tree.points.size(), c.tree.points.size());
  for (std::size_t i = 0; i < a.tree.points.size(); ++i)
  {
    EXPECT_LT((a.tree.points[i] - 1000.0 * b.tree.points[i]).norm(), 1e-3);
    EXPECT_NEAR(a.tree.radius[i], 1000.0 * b.tree.radius[i], 1e-3);
    EXPECT_LT((a.tree.points[i] + Vector3::Constant(500.0) - c.tree.points[i]).norm(), 1e-3);
  }
}

TEST(CenterlineExtraction, MaskAndWallDistance)
{
  const Tube tube{ Helix(), 1.6 };
  const Scene scene({ tube }, Vector3(0.4, 0.4, 0.6), Oblique(), Vector3::Zero(), 16.0);
  CenterlineInput input = scene.Input({ tube.axis.front() });
  input.speed = nullptr;
  input.intensity = nullptr;
  input.mask = scene.mask.data();
  const CenterlineResult masked = ExtractCenterlines(input, CenterlineSettings{});
  ASSERT_EQ(masked.tree.branches.size(), 1u);
  const Deviation deviation = Compare(masked.tree, tube);
  EXPECT_LT(deviation.axis, 0.15);
  EXPECT_LT(deviation.radius, 0.15);

  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
  Cylinder(2.0, 25.0, 40, 60, points, triangles);
  const SurfaceDistance distance = ComputeSurfaceDistance(points, triangles);
  CenterlineInput closed;
  closed.grid = distance.grid;
  closed.wallDistance = distance.values.data();
  closed.seeds = { Vector3(0.3, 0.2, 1.0) };
  closed.targets = { Vector3(0.0, -0.4, 24.0) };
  CenterlineSettings settings;
  settings.findTips = false;
  const CenterlineResult surface = ExtractCenterlines(closed, settings);
  ASSERT_EQ(surface.tree.branches.size(), 1u);
  EXPECT_EQ(surface.targets[0].status, EndStatus::Reached);
  for (std::size_t i = surface.tree.points.size() / 6; i < surface.tree.points.size() * 5 / 6; ++i)
  {
    EXPECT_LT(surface.tree.points[i].head<2>().norm(), 0.1);
    EXPECT_NEAR(surface.tree.radius[i], 2.0, 0.1);
  }
}

TEST(CenterlineExtraction, SameOnAnyNumberOfThreads)
{
  const Tube tube{ Helix(), 1.3 };
  const Scene scene({ tube }, Vector3::Constant(0.5), Oblique(), Vector3::Zero(), 14.0);
  SetNumberOfThreads(1);
  const CenterlineResult one =
    ExtractCenterlines(scene.Input({ tube.axis.front() }), CenterlineSettings{});
  SetNumberOfThreads(3);
  const CenterlineResult three =
    ExtractCenterlines(scene.Input({ tube.axis.front() }), CenterlineSettings{});
  SetNumberOfThreads(0);
  ASSERT_EQ(one.tree.points.size(), three.tree.points.size());
  for (std::size_t i = 0; i < one.tree.points.size(); ++i)
  {
    EXPECT_EQ(one.tree.points[i], three.tree.points[i]);
    EXPECT_EQ(one.tree.radius[i], three.tree.radius[i]);
  }
}

TEST(CenterlineExtraction, WhatCanNotBeReachedIsNamed)
{
  const Tube near{ Line(Vector3(-12, -6, 0), Vector3(12, -6, 1)), 1.4 };
  const Tube apart{ Line(Vector3(-12, 7, 0), Vector3(12, 7, 1)), 1.4 };
  const Scene scene(
    { near, apart }, Vector3::Constant(0.5), Matrix3::Identity(), Vector3::Zero(), 15.0);
  CenterlineInput input =
    scene.Input({ Vector3(-12, -6, 0), Vector3(0, 0, -12), Vector3(99, 0, 0) });
  input.targets = { Vector3(12, -6, 1), Vector3(12, 7, 1), Vector3(0, 0, 10), Vector3(0, -99, 0),
    Vector3(0, -6, 0.5) };
  CenterlineSettings settings;
  settings.findTips = false;
  const CenterlineResult result = ExtractCenterlines(input, settings);
  EXPECT_EQ(result.seeds[0].status, EndStatus::Reached);
  EXPECT_EQ(result.seeds[1].status, EndStatus::OutsideRegion);
  EXPECT_EQ(result.seeds[2].status, EndStatus::OutsideImage);
  EXPECT_EQ(result.targets[0].status, EndStatus::Reached);
  EXPECT_EQ(result.targets[1].status, EndStatus::NotConnected);
  EXPECT_EQ(result.targets[2].status, EndStatus::OutsideRegion);
  EXPECT_EQ(result.targets[3].status, EndStatus::OutsideImage);
  EXPECT_EQ(result.targets[4].status, EndStatus::Reached);
  for (const int t : { 1, 2, 3 })
  {
    EXPECT_NE(result.targets[t].message.find("target " + std::to_string(t)), std::string::npos);
    EXPECT_EQ(result.targets[t].point, -1);
  }
  EXPECT_EQ(result.tree.branches.size(), 1u);

  // No seed in a vessel: nothing, and why.
  input.seeds = { Vector3(0, 0, -12) };
  const CenterlineResult nothing = ExtractCenterlines(input, settings);
  EXPECT_TRUE(nothing.tree.points.empty());
  EXPECT_EQ(nothing.targets[0].status, EndStatus::NotConnected);
  EXPECT_FALSE(nothing.targets[0].message.empty());

  // Limits end it with a message.
  input.seeds = { Vector3(-12, -6, 0) };
  settings.voxelLimit = 10;
  const CenterlineResult large = ExtractCenterlines(input, settings);
  EXPECT_FALSE(large.complete);
  ASSERT_EQ(large.messages.size(), 1u);
  EXPECT_NE(large.messages[0].find("limit of 10"), std::string::npos);
  EXPECT_EQ(large.targets[0].status, EndStatus::LimitReached);

  // The limit of work counts what is done, longest way first: one step lets one way through.
  const Tube side{ Line(Vector3(0, -6, 0.5), Vector3(2, 5, 1)), 1.2 };
  const Scene fork(
    { near, side }, Vector3::Constant(0.5), Matrix3::Identity(), Vector3::Zero(), 15.0);
  input = fork.Input({ Vector3(-12, -6, 0) });
  settings = CenterlineSettings();
  settings.thinBranches = false;
  EXPECT_EQ(ExtractCenterlines(input, settings).tree.branches.size(), 3u);
  settings.stepLimit = 1;
  const CenterlineResult stopped = ExtractCenterlines(input, settings);
  EXPECT_FALSE(stopped.complete);
  EXPECT_EQ(stopped.tree.branches.size(), 1u);
  ASSERT_EQ(stopped.messages.size(), 1u);
  EXPECT_NE(stopped.messages[0].find("limit of 1 steps"), std::string::npos) << stopped.messages[0];
  settings.stepLimit = 0;
  EXPECT_THROW(ExtractCenterlines(input, settings), std::invalid_argument);
}

TEST(CenterlineExtraction, DegenerateImages)
{
  // Empty, one slice, one voxel wide, a plateau of speed, NaN: an answer, not a crash.
  CenterlineInput input;
  input.grid.extent = { 0, 39, 0, 9, 0, 0 };
  std::vector<unsigned char> mask(400, 0);
  input.mask = mask.data();
  input.seeds = { Vector3(2, 5, 0) };
  EXPECT_TRUE(ExtractCenterlines(input, CenterlineSettings{}).tree.points.empty());
  for (int i = 2; i < 38; ++i)
  {
    mask[200 + i] = 1;
  }
  CenterlineSettings settings;
  settings.findTips = false;
  input.targets = { Vector3(37, 5, 0) };
  const CenterlineResult wire = ExtractCenterlines(input, settings);
  ASSERT_EQ(wire.tree.branches.size(), 1u);
  EXPECT_NEAR(wire.tree.branches[0].length, 35.0, 1.5);

  std::vector<float> plateau(400, 1.0F);
  input.mask = nullptr;
  input.speed = plateau.data();
  const CenterlineResult flat = ExtractCenterlines(input, settings);
  EXPECT_EQ(flat.targets[0].status, EndStatus::Reached);
  std::fill(plateau.begin(), plateau.end(), std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(ExtractCenterlines(input, settings).seeds[0].status, EndStatus::OutsideRegion);

  input.speed = nullptr;
  EXPECT_THROW(ExtractCenterlines(input, settings), std::invalid_argument);
  input.mask = mask.data();
  input.seeds.clear();
  EXPECT_THROW(ExtractCenterlines(input, settings), std::invalid_argument);
  input.seeds = { Vector3(2, 5, 0) };
  settings.speedExponent = 9.0;
  EXPECT_THROW(ExtractCenterlines(input, settings), std::invalid_argument);
  settings = {};
  EXPECT_THROW(ExtractCenterlines(input, settings, [](double) { return false; }), Cancelled);
}
}
