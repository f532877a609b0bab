// Lumen, calcium and stenoses in images of straight blurred tubes, whose values are known in closed form.

#include "BlurredDisc.h"
#include "CalciumObjects.h"
#include "CoronaryPhantom.h"
#include "LumenLevels.h"
#include "LumenRefinement.h"
#include "Refusals.h"
#include "StenosisGrading.h"
#include "VesselPaths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace UnitTestStenosis
{
using namespace coronary;

namespace
{
constexpr double Blur = 0.4;        // mm
constexpr double Lumen = 400.0;     // HU
constexpr double Fat = -80.0;       // HU
constexpr double Calcium = 1100.0;  // HU
constexpr double Plaque = 80.0;     // HU
constexpr double TubeLength = 60.0; // mm
constexpr double Spacing = 0.4;     // mm

struct Ball
{
  Vector3 centre;
  double radius;
};

/// A tube along z through (0, 0), 60 mm long, in fat; balls of calcium painted over what is outside of its lumen.
struct Tube
{
  std::function<double(double)> radius;
  std::vector<Ball> balls;
  double brightness = Lumen;
  /// mm, of the outer wall; plaque fills what the lumen leaves of it. None: there is no plaque.
  std::function<double(double)> wall;
  double eccentricity = 0.0; ///< 1: the lumen lies at the wall

  std::vector<float> values;
  ScalarImage image;

  void Render()
  {
    ImageGrid& grid = this->image.grid;
    const int half = 18;
    const auto slices = static_cast<int>(TubeLength / Spacing) + 21;
    grid.extent = { 0, 2 * half, 0, 2 * half, 0, slices - 1 };
    grid.spacing = Vector3::Constant(Spacing);
    grid.origin = Vector3(-half * Spacing, -half * Spacing, -10 * Spacing);
    this->values.resize(static_cast<std::size_t>(this->image.NumberOfVoxels()));
    std::size_t at = 0;
    for (int k = 0; k < slices; ++k)
    {
      for (int j = 0; j <= 2 * half; ++j)
      {
        for (int i = 0; i <= 2 * half; ++i, ++at)
        {
          const Vector3 p = grid.IndexToWorld(i, j, k);
          double value = Fat;
          for (const Ball& ball : this->balls)
          {
            const double distance = (p - ball.centre).norm() - ball.radius;
            value += 0.5 * std::erfc(distance / (std::sqrt(2.0) * Blur)) * (Calcium - value);
          }
          const double z = std::clamp(p[2], 0.0, TubeLength);
          double off = 0.0;
          if (this->wall)
          {
            value +=
              BlurredDisc(std::hypot(p[0], p[1]) / Blur, this->wall(z) / Blur) * (Plaque - value);
            off = this->eccentricity * (this->wall(z) - this->radius(z));
          }
          const double share =
            BlurredDisc(std::hypot(p[0] - off, p[1]) / Blur, this->radius(z) / Blur);
          this->values[at] = static_cast<float>(value + share * (this->brightness - value));
        }
      }
    }
    this->image.values = static_cast<const float*>(this->values.data());
  }
};

/// One branch along the tube, with the given radius everywhere.
VesselTree LineWith(double radius, const Vector3& off = Vector3::Zero())
{
  VesselTree tree;
  VesselTree::Branch branch;
  branch.segmentId = MidLAD;
  for (double z = 0.0; z <= TubeLength; z += 0.25)
  {
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.push_back(off + Vector3(0.0, 0.0, z));
    tree.radius.push_back(radius);
    tree.segmentId.push_back(MidLAD);
  }
  tree.branches.push_back(branch);
  MeasureTree(tree);
  return tree;
}

struct Measured : TreeLumen
{
  StenosisGrading grading;
};

Measured MeasureAll(const Tube& tube, const VesselTree& tree)
{
  const std::vector<VesselPath> paths = VesselPaths(tree);
  Measured result{ MeasureTreeLumen(tree, paths, tube.image, Blur), {} };
  const VesselTree refined = WithLumen(tree, result.lumen);
  MeasureCalcium(result.calcium, refined, paths, tube.image, result.levels, Blur);
  result.grading = GradeStenoses(refined, paths, result.lumen);
  return result;
}

Tube Narrowed(double healthy, double degree)
{
  Tube tube;
  tube.radius = [=](double z)
  { return healthy * (1.0 - degree * std::exp(-0.5 * std::pow((z - 30.0) / 3.4, 2))); };
  tube.Render();
  return tube;
}
}

TEST(BlurredDisc, HasTheDiscsAreaAndItsCentre)
{
  for (const double radius : { 0.1, 0.5, 1.0, 3.0, 7.0 })
  {
    double sum = 0.0;
    const double step = 0.01;
    for (double d = 0.5 * step; d < radius + 4.9; d += step)
    {
      sum += 2.0 * M_PI * d * step * BlurredDisc(d, radius);
    }
    EXPECT_NEAR(sum, M_PI * radius * radius, 0.01 * M_PI * radius * radius) << radius;
    EXPECT_NEAR(BlurredDisc(0.0, radius), 1.0 - std::exp(-0.5 * radius * radius), 2e-3) << radius;
  }
  EXPECT_EQ(BlurredDisc(1.0, 0.0), 0.0);
  // Where the table ends and a nearly straight edge begins.
  for (const double off : { -1.5, 0.0, 1.5 })
  {
    EXPECT_NEAR(BlurredDisc(7.85 + off, 7.85), BlurredDisc(7.95 + off, 7.95), 5e-3) << off;
  }
}

TEST(BlurredDisc, BallsHaveTheirLimits)
{
  EXPECT_NEAR(BlurredBallCentre(6.0), 1.0, 1e-6);
  // A small one: its volume times the density of the normal distribution in the middle.
  EXPECT_NEAR(BlurredBallCentre(0.1), 4.0 / 3.0 * M_PI * 1e-3 * std::pow(2.0 * M_PI, -1.5), 1e-6);
  EXPECT_NEAR(BallHalfMaximum(0.01), std::sqrt(2.0 * std::log(2.0)), 1e-3);
  EXPECT_NEAR(BallHalfMaximum(0.06), std::sqrt(2.0 * std::log(2.0)), 1e-2);
  EXPECT_NEAR(BallHalfMaximum(10.0), 10.0, 0.2);
}

TEST(VesselPaths, TheNameCarriesAVesselOn)
{
  // A trunk, a wide straight daughter and a thin one that turns off.
  VesselTree tree;
  const auto line = [&](int id, int parent, int segment, const Vector3& to, double radius)
  {
    VesselTree::Branch branch;
    branch.groupId = id;
    branch.parentGroupId = parent;
    branch.segmentId = segment;
    Vector3 from = Vector3::Zero();
    if (parent >= 0)
    {
      branch.points.push_back(tree.branches[0].points.back());
      from = tree.points[tree.branches[0].points.back()];
    }
    for (int i = parent >= 0 ? 1 : 0; i <= 20; ++i)
    {
      branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
      tree.points.emplace_back(from + to * i / 20.0);
      tree.radius.push_back(radius);
    }
    tree.branches.push_back(branch);
  };
  line(0, -1, 0, Vector3(0.0, 0.0, 20.0), 2.0);
  line(1, 0, 0, Vector3(0.0, 0.0, 20.0), 1.8);
  line(2, 0, 0, Vector3(20.0, 0.0, 0.0), 1.2);
  std::vector<VesselPath> paths = VesselPaths(tree);
  ASSERT_EQ(paths.size(), 2U);
  EXPECT_EQ(paths[0].points.back(), tree.branches[1].points.back());
  EXPECT_NEAR(paths[0].arc.back(), 40.0, 1e-9);
  EXPECT_EQ(paths[0].forks, std::vector<std::size_t>{ 20 });
  EXPECT_EQ(paths[1].parent, 0);
  EXPECT_EQ(paths[1].points.front(), tree.branches[0].points.back());
  tree.branches[0].segmentId = LeftMain;
  tree.branches[1].segmentId = ProximalLCx;
  tree.branches[2].segmentId = ProximalLAD;
  paths = VesselPaths(tree);
  EXPECT_EQ(paths[0].points.back(), tree.branches[2].points.back());
}

TEST(LumenRefinement, MeasuresLumensAboveAndBelowTheBlur)
{
  for (const double radius : { 0.3, 0.5, 0.8, 1.5, 2.5 })
  {
    // A wide vessel that ends thin: the wide part tells how bright contrast is.
    Tube tube;
    tube.radius = [=](double z) { return z < 25.0 ? 2.0 : radius; };
    tube.Render();
    SCOPED_TRACE(radius);
    // Widths that were measured in the usual way do not get below the blur.
    VesselTree tree = LineWith(2.0, Vector3(0.1, -0.1, 0.0));
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      tree.radius[p] = tree.points[p][2] < 25.0 ? 2.0 : std::max(0.7, 1.2 * radius);
    }
    const Measured measured = MeasureAll(tube, tree);
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      const double z = tree.points[p][2];
      if (z > 32.0 && z < 55.0)
      {
        EXPECT_NEAR(measured.lumen.measured[p], radius, 0.05 + 0.02 * radius) << z;
        EXPECT_NEAR(measured.levels.level[p], Lumen, 12.0);
      }
    }
  }
}

TEST(LumenRefinement, AnOstiumKeepsItsRadius)
{
  // The first sections lie partly in the aorta, which the vessel leaves obliquely: what is fitted there is no lumen's.
  const Vector3 outwards = Vector3(0.2, 0.06, 1.0).normalized();
  for (const double inside : { 0.0, 0.5 })
  {
    Tube tube;
    tube.radius = [](double) { return 1.9; };
    tube.Render();
    const ImageGrid& grid = tube.image.grid;
    for (std::size_t v = 0; v < tube.values.size(); ++v)
    {
      const auto n = static_cast<int>(v);
      const int nx = grid.extent[1] + 1;
      const int ny = grid.extent[3] + 1;
      const Vector3 p = grid.IndexToWorld(n % nx, n / nx % ny, n / nx / ny);
      const double share = 0.5 * std::erfc((p.dot(outwards) - inside) / (std::sqrt(2.0) * Blur));
      tube.values[v] =
        std::max(tube.values[v], static_cast<float>(Fat + share * (Lumen + 10.0 - Fat)));
    }
    const Measured measured = MeasureAll(tube, LineWith(2.0));
    for (std::size_t p = 0; p < 4; ++p)
    {
      EXPECT_NEAR(measured.lumen.radius[p], 2.0, 0.1) << inside << ", point " << p;
    }
    for (std::size_t p = 20; p < 40; ++p)
    {
      EXPECT_NEAR(measured.lumen.radius[p], 1.9, 0.05) << inside << ", point " << p;
    }
  }
}

TEST(LumenRefinement, AMouthIsAsWideAsWhereTheBranchStandsAlone)
{
  const double radius = 0.7;
  const double trunk = 1.5;
  Tube tube;
  tube.radius = [=](double) { return radius; };
  tube.Render();
  // The branch begins on a trunk across it, with a slope that was carried on into its mouth, narrower or wider.
  for (const double begin : { 0.2, 1.3 })
  {
    VesselTree tree;
    const auto add =
      [&](int id, int parent, const Vector3& from, const Vector3& to, const auto& width)
    {
      VesselTree::Branch branch;
      branch.groupId = id;
      branch.parentGroupId = parent;
      if (parent >= 0)
      {
        branch.points.push_back(tree.branches[0].points.back());
      }
      const int steps = static_cast<int>((to - from).norm() / 0.25);
      for (int i = parent >= 0 ? 1 : 0; i <= steps; ++i)
      {
        const double t = static_cast<double>(i) / steps;
        branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
        tree.points.push_back(from + t * (to - from));
        tree.radius.push_back(width(t * (to - from).norm()));
      }
      tree.branches.push_back(branch);
    };
    const auto wide = [&](double) { return trunk; };
    add(0, -1, Vector3(-6.0, 0.0, 5.0), Vector3(0.0, 0.0, 5.0), wide);
    add(1, 0, Vector3(0.0, 0.0, 5.0), Vector3(6.0, 0.0, 5.0), wide);
    add(2, 0, Vector3(0.0, 0.0, 5.0), Vector3(0.0, 0.0, 40.0),
      [&](double along) { return begin + (radius - begin) * std::min(1.0, along / 4.0); });
    MeasureTree(tree);
    LumenLevels levels;
    levels.level.assign(tree.points.size(), Lumen);
    levels.background = Fat;
    const RefinedLumen refined = RefineLumen(tree, VesselPaths(tree), tube.image, levels, {}, Blur);
    const std::vector<std::int64_t>& points = tree.branches[2].points;
    for (std::size_t i = 1; i < points.size(); ++i)
    {
      EXPECT_NEAR(refined.radius[points[i]], radius, 0.06)
        << "begun with " << begin << ", at " << tree.points[points[i]][2] - 5.0;
    }
  }
}

TEST(StenosisGrading, DegreesAreThoseOfTheTube)
{
  for (const double degree : { 0.4, 0.6, 0.75, 0.85 })
  {
    const Tube tube = Narrowed(1.6, degree);
    const Measured measured = MeasureAll(tube, LineWith(1.5));
    ASSERT_EQ(measured.grading.lesions.size(), 1U) << degree;
    const Stenosis& lesion = measured.grading.lesions.front();
    EXPECT_NEAR(lesion.degree, degree, 0.05);
    EXPECT_NEAR(lesion.areaDegree, 1.0 - std::pow(1.0 - lesion.degree, 2), 1e-12);
    EXPECT_NEAR(lesion.position[2], 30.0, 1.0);
    EXPECT_NEAR(lesion.referenceDiameter, 3.2, 0.15);
    EXPECT_NEAR(lesion.length, 8.0, 2.0);
    EXPECT_LE(lesion.degreeLow, degree);
    EXPECT_GE(lesion.degreeHigh, degree);
    EXPECT_EQ(lesion.kind, LesionKind::Soft);
    EXPECT_EQ(lesion.segmentId, MidLAD);
    EXPECT_FALSE(lesion.bridged);
    // The tree's own radius follows.
    const double minimum =
      *std::min_element(measured.lumen.radius.begin() + 40, measured.lumen.radius.end() - 40);
    EXPECT_NEAR(minimum, 1.6 * (1.0 - degree), 0.1);
  }
}

TEST(StenosisGrading, PlaqueInFatIsNoLumen)
{
  constexpr double healthy = 1.6; // mm
  for (const double eccentricity : { 0.0, 0.6 })
  {
    for (const double degree : { 0.5, 0.7, 0.9 })
    {
      const std::string what =
        std::to_string(degree) + " of the diameter, eccentric by " + std::to_string(eccentricity);
      Tube tube;
      tube.eccentricity = eccentricity;
      const auto inPlaque = [](double z) { return std::exp(-0.5 * std::pow((z - 30.0) / 3.4, 2)); };
      tube.radius = [=](double z) { return healthy * (1.0 - degree * inPlaque(z)); };
      tube.wall = [=](double z) { return healthy * (1.0 + 0.1 * inPlaque(z)); };
      tube.Render();
      const Measured measured = MeasureAll(tube, LineWith(healthy));
      ASSERT_EQ(measured.grading.lesions.size(), 1U) << what;
      const Stenosis& lesion = measured.grading.lesions[0];
      EXPECT_NEAR(lesion.degree, degree, 0.1) << what;
      EXPECT_LE(lesion.degreeLow, degree) << what;
      EXPECT_GE(lesion.degreeHigh, degree) << what;
    }
  }
}

TEST(StenosisGrading, TaperingVesselsHaveNoLesion)
{
  Tube tube;
  tube.radius = [](double z) { return 2.0 - 0.018 * z; };
  tube.Render();
  const Measured measured = MeasureAll(tube, LineWith(1.5));
  EXPECT_TRUE(measured.grading.lesions.empty());
  // Nor one that gets narrower within a few millimetres and stays so.
  tube.radius = [](double z) { return z < 25.0 ? 2.0 : std::max(1.0, 2.0 - 0.1 * (z - 25.0)); };
  tube.Render();
  EXPECT_TRUE(MeasureAll(tube, LineWith(1.5)).grading.lesions.empty());
}

TEST(StenosisGrading, AVesselThatIsLostInALesionSaysSo)
{
  // The line ends half way into a lesion of 80 %; the same vessel without the lesion just ends there.
  for (const double degree : { 0.8, 0.0 })
  {
    SCOPED_TRACE(degree);
    const auto healthy = [](double z) { return 1.9 - 0.018 * z; };
    Tube tube;
    tube.radius = [=](double z)
    { return healthy(z) * (1.0 - degree * std::exp(-0.5 * std::pow((z - 58.0) / 2.5, 2))); };
    tube.Render();
    VesselTree tree = LineWith(1.2);
    const std::size_t last = 222; // z = 55.5
    tree.points.resize(last + 1);
    tree.radius.resize(last + 1);
    tree.segmentId.resize(last + 1);
    tree.abscissa.resize(last + 1);
    tree.branches[0].points.resize(last + 1);
    MeasureTree(tree);
    const Measured measured = MeasureAll(tube, tree);
    ASSERT_EQ(measured.grading.lesions.size(), degree > 0.0 ? 1U : 0U);
    for (const Stenosis& lesion : measured.grading.lesions)
    {
      EXPECT_EQ(lesion.kind, LesionKind::Lost);
      EXPECT_EQ(lesion.position, tree.points.back());
      EXPECT_NEAR(lesion.referenceDiameter, 2.0 * healthy(52.0), 0.25);
      EXPECT_LT(lesion.degreeLow, degree);
      EXPECT_EQ(lesion.degreeHigh, 1.0);
      EXPECT_LT(lesion.confidence, 0.5); // of the degree
      EXPECT_LT(lesion.abscissaStart, lesion.abscissaEnd);
    }
  }
}

TEST(StenosisGrading, BridgedLesionsSaySo)
{
  for (const double degree : { 0.7, 0.85 })
  {
    SCOPED_TRACE(degree);
    const Tube tube = Narrowed(1.6, degree);
    VesselTree tree = LineWith(1.5);
    const std::vector<VesselPath> paths = VesselPaths(tree);
    const Measured measured = MeasureAll(tube, tree);
    const StenosisGrading plain = GradeStenoses(tree, paths, measured.lumen);
    tree.bridged.assign(tree.points.size(), 0);
    tree.bridgeConfidence.assign(tree.points.size(), 1.0);
    for (std::size_t p = 110; p < 130; ++p)
    {
      tree.bridged[p] = 1;
      tree.bridgeConfidence[p] = 0.6;
    }
    const StenosisGrading grading = GradeStenoses(tree, paths, measured.lumen);
    ASSERT_EQ(grading.lesions.size(), 1U);
    ASSERT_EQ(plain.lesions.size(), 1U);
    const Stenosis& lesion = grading.lesions.front();
    EXPECT_TRUE(lesion.bridged);
    EXPECT_TRUE(lesion.kind == LesionKind::Bridged || lesion.kind == LesionKind::Occluded);
    EXPECT_EQ(lesion.degreeLow, plain.lesions.front().degreeLow);
    if (degree < 0.75)
    {
      EXPECT_EQ(lesion.degreeHigh, plain.lesions.front().degreeHigh);
      EXPECT_NEAR(lesion.confidence, 0.6 * plain.lesions.front().confidence, 1e-9);
    }
    else
    {
      // What looks like a lumen of 0.24 mm radius may be none: the way across was not seen.
      EXPECT_LT(plain.lesions.front().degreeHigh, 1.0);
      EXPECT_EQ(lesion.degreeHigh, 1.0);
      EXPECT_LT(lesion.confidence, 0.6 * plain.lesions.front().confidence);
    }
  }
}

TEST(StenosisGrading, NoLumenIsARangeAsWell)
{
  // A lumen of 0.3 mm radius and none look the same in noise.
  const Tube tube = Narrowed(1.6, 1.0);
  VesselTree tree = LineWith(1.5);
  tree.bridged.assign(tree.points.size(), 0);
  std::fill(tree.bridged.begin() + 100, tree.bridged.begin() + 140, 1);
  const Measured measured = MeasureAll(tube, tree);
  const StenosisGrading grading = GradeStenoses(tree, VesselPaths(tree), measured.lumen);
  ASSERT_EQ(grading.lesions.size(), 1U);
  const Stenosis& lesion = grading.lesions.front();
  EXPECT_EQ(lesion.kind, LesionKind::Occluded);
  EXPECT_EQ(lesion.degreeHigh, 1.0);
  EXPECT_LT(lesion.degreeLow, 1.0 - 0.3 / 1.6);
  EXPECT_GT(lesion.degreeLow, 0.6);
}

TEST(CalciumObjects, BallsBesideTheLumenAreMeasuredAndTheLumenStays)
{
  Tube tube;
  tube.radius = [](double) { return 1.5; };
  tube.balls = { { Vector3(2.4, 0.0, 20.0), 1.0 }, { Vector3(0.0, -2.5, 42.0), 0.8 } };
  tube.Render();
  // The line was drawn towards the first one.
  VesselTree tree = LineWith(1.5);
  for (Vector3& point : tree.points)
  {
    point[0] += 0.8 * std::exp(-0.5 * std::pow((point[2] - 20.0) / 2.0, 2));
  }
  MeasureTree(tree);
  const Measured measured = MeasureAll(tube, tree);
  ASSERT_EQ(measured.calcium.objects.size(), 2U);
  for (std::size_t n = 0; n < 2; ++n)
  {
    const CalciumObject& object = measured.calcium.objects[n];
    const Ball& ball = tube.balls[n];
    EXPECT_LT((object.centre - ball.centre).norm(), 0.4);
    const double volume = 4.0 / 3.0 * M_PI * std::pow(ball.radius, 3);
    EXPECT_NEAR(object.correctedVolume, volume, 0.45 * volume);
    EXPECT_NEAR(object.density, Calcium, 150.0);
    EXPECT_EQ(object.segmentId, MidLAD);
    EXPECT_NEAR(0.5 * (object.abscissaStart + object.abscissaEnd), ball.centre[2], 1.0);
    EXPECT_GT(object.arc, 30.0);
    EXPECT_LT(object.arc, 150.0);
  }
  EXPECT_GT(measured.calcium.objects[0].volume, measured.calcium.objects[1].volume);
  for (std::size_t p = 20; p + 20 < tree.points.size(); ++p)
  {
    EXPECT_NEAR(measured.lumen.radius[p], 1.5, 0.15) << tree.points[p][2];
  }
  // The point that was farthest off.
  const auto at = static_cast<std::size_t>(20.0 / 0.25);
  EXPECT_LT(std::hypot(measured.lumen.points[at][0], measured.lumen.points[at][1]), 0.25);
  EXPECT_EQ(measured.lumen.calcium[at], 1);
  EXPECT_TRUE(measured.grading.lesions.empty());
  // Voxels find themselves.
  const CalciumVoxel& voxel = measured.calcium.voxels.front();
  EXPECT_EQ(measured.calcium.Find(voxel.offset), 0);
  EXPECT_EQ(measured.calcium.Find(voxel.offset + 1000000), -1);
}

TEST(CalciumObjects, WhatCalciumEnclosesIsInterpolatedAndSaid)
{
  Tube tube;
  tube.radius = [](double) { return 1.2; };
  for (int side = 0; side < 8; ++side)
  {
    const double angle = 0.25 * M_PI * side;
    tube.balls.push_back({ Vector3(2.0 * std::cos(angle), 2.0 * std::sin(angle), 30.0), 1.0 });
  }
  tube.Render();
  const Measured measured = MeasureAll(tube, LineWith(1.2));
  ASSERT_EQ(measured.calcium.objects.size(), 1U);
  EXPECT_GT(measured.calcium.objects.front().arc, 300.0);
  const auto at = static_cast<std::size_t>(30.0 / 0.25);
  EXPECT_EQ(measured.lumen.interpolated[at], 1);
  EXPECT_EQ(measured.lumen.measured[at], 0.0);
  EXPECT_NEAR(measured.lumen.radius[at], 1.2, 0.2);
  EXPECT_EQ(measured.lumen.interpolated[40], 0);
}

TEST(CalciumObjects, BehindItTheRadiusGoesFromWhatIsBeforeToWhatIsBehind)
{
  // Steep towards the calcium, as blooming makes a lumen: what follows behind it is not steeper still.
  Tube tube;
  const double middle = 0.5 * TubeLength;
  tube.radius = [&](double z)
  { return z < middle ? std::max(0.7, 1.6 - 0.25 * std::max(0.0, z - middle + 6.0)) : 1.5; };
  for (const double along : { -1.5, 0.0, 1.5 })
  {
    tube.balls.push_back({ Vector3(0.0, 0.0, middle + along), 2.2 });
  }
  tube.Render();
  const Measured measured = MeasureAll(tube, LineWith(1.5));
  const std::vector<unsigned char>& hidden = measured.lumen.interpolated;
  const auto first = std::find(hidden.begin(), hidden.end(), 1) - hidden.begin();
  auto last = first;
  while (last + 1 < static_cast<std::ptrdiff_t>(hidden.size()) && hidden[last + 1] == 1)
  {
    ++last;
  }
  ASSERT_GT(first, 10);
  ASSERT_GT(last, first + 4);
  const std::vector<double>& radius = measured.lumen.radius;
  const double minimum = std::min(radius[first - 1], radius[last + 1]);
  const double most = std::max(radius[first - 1], radius[last + 1]);
  for (auto i = first; i <= last; ++i)
  {
    EXPECT_GT(radius[i], minimum - 0.1) << i;
    EXPECT_LT(radius[i], most + 0.1) << i;
  }
}

TEST(CalciumObjects, NoiseAndContrastAreNoCalcium)
{
  Tube tube;
  tube.radius = [](double) { return 1.5; };
  tube.Render();
  // Noise of 30 HU in blood that loses a fifth of its contrast on the way: only the first is noise.
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 30.0);
  for (std::size_t n = 0; n < tube.values.size(); ++n)
  {
    const double along = static_cast<double>(n) / static_cast<double>(tube.values.size());
    tube.values[n] += static_cast<float>(
      normal(random) - 0.2 * along * (tube.values[n] > Fat ? tube.values[n] - Fat : 0.0));
  }
  const Measured measured = MeasureAll(tube, LineWith(1.5));
  EXPECT_TRUE(measured.calcium.objects.empty());
  EXPECT_NEAR(measured.levels.noise, 30.0, 6.0);
}

TEST(LumenLevels, TheLungBesideAVesselIsNotItsBackground)
{
  Tube tube;
  tube.radius = [](double) { return 1.5; };
  tube.Render();
  const VesselTree tree = LineWith(1.5);
  const std::vector<VesselPath> paths = VesselPaths(tree);
  const double fat = MeasureLumenLevels(tree, paths, tube.image, Blur).background;
  EXPECT_NEAR(fat, Fat, 10.0);
  // On a part of the way air lies on one side.
  for (std::size_t n = 0; n < tube.values.size(); ++n)
  {
    const std::array<int, 3> size = tube.image.Dimensions();
    const auto at = static_cast<int>(n);
    const Vector3 p =
      tube.image.grid.IndexToWorld(at % size[0], at / size[0] % size[1], at / size[0] / size[1]);
    if (p[0] > 0.0 && std::hypot(p[0], p[1]) > 2.0 && p[2] < 0.4 * TubeLength)
    {
      tube.values[n] = -800.0F;
    }
  }
  EXPECT_NEAR(MeasureLumenLevels(tree, paths, tube.image, Blur).background, fat, 15.0);
}

TEST(CalciumObjects, AgatstonsWeights)
{
  EXPECT_EQ(AgatstonWeight(129.0), 0);
  EXPECT_EQ(AgatstonWeight(130.0), 1);
  EXPECT_EQ(AgatstonWeight(199.0), 1);
  EXPECT_EQ(AgatstonWeight(200.0), 2);
  EXPECT_EQ(AgatstonWeight(399.0), 3);
  EXPECT_EQ(AgatstonWeight(1500.0), 4);
}

TEST(StenosisGrading, TheSameOnAnyNumberOfThreads)
{
  Tube tube = Narrowed(1.6, 0.7);
  tube.balls = { { Vector3(2.4, 0.0, 20.0), 1.0 } };
  tube.Render();
  const VesselTree tree = LineWith(1.5);
  SetNumberOfThreads(1);
  const Measured one = MeasureAll(tube, tree);
  SetNumberOfThreads(4);
  const Measured four = MeasureAll(tube, tree);
  SetNumberOfThreads(0);
  EXPECT_EQ(one.lumen.radius, four.lumen.radius);
  EXPECT_EQ(one.lumen.calcium, four.lumen.calcium);
  EXPECT_EQ(one.grading.degree, four.grading.degree);
  EXPECT_EQ(
    one.calcium.objects.front().correctedVolume, four.calcium.objects.front().correctedVolume);
}

TEST(StenosisGrading, RefusesWhatItCanNotUse)
{
  const Tube tube = Narrowed(1.6, 0.5);
  const VesselTree tree = LineWith(1.5);
  const std::vector<VesselPath> paths = VesselPaths(tree);
  ExpectRefusal([&] { MeasureLumenLevels(tree, paths, tube.image, 0.0); }, "blur");
  const LumenLevels levels = MeasureLumenLevels(tree, paths, tube.image, Blur);
  ExpectRefusal([&] { RefineLumen(tree, paths, tube.image, levels, {}, 0.0); }, "blur");
  ExpectRefusal([&] { GradeStenoses(tree, paths, {}); }, "one value a point");
  ExpectThrown<Cancelled>([&]
    { RefineLumen(tree, paths, tube.image, levels, {}, Blur, [](double) { return false; }); },
    "cancelled");
}

TEST(PhantomLesions, AreWhatTheTreeShows)
{
  PhantomSettings settings;
  settings.seed = 7;
  settings.stenoses = 3;
  settings.stenosisDegree = 0.6;
  settings.calcifiedPlaques = 5;
  const CoronaryPhantom phantom(settings);
  settings.stenoses = 0;
  const CoronaryPhantom healthy(settings);
  const PhantomTree tree = phantom.Tree(0.3);
  const PhantomTree without = healthy.Tree(0.3);
  ASSERT_EQ(phantom.Stenoses(0.3).size(), 3U);
  for (const PhantomStenosis& stenosis : phantom.Stenoses(0.3))
  {
    EXPECT_EQ(stenosis.minimumRadius, tree.radius[stenosis.point]);
    EXPECT_EQ(stenosis.position, tree.points[stenosis.point]);
    EXPECT_NEAR(
      stenosis.degree, 1.0 - tree.radius[stenosis.point] / without.radius[stenosis.point], 0.01);
    EXPECT_NEAR(stenosis.degree, 0.6, 0.05);
    EXPECT_FALSE(stenosis.vessel.empty());
    // It is the narrowest place around.
    for (std::int64_t p = stenosis.point - 3; p <= stenosis.point + 3; ++p)
    {
      EXPECT_GE(tree.radius[p], 0.99 * stenosis.minimumRadius);
    }
  }
  ASSERT_EQ(phantom.Plaques(0.3).size(), 5U);
  for (const PhantomPlaque& plaque : phantom.Plaques(0.3))
  {
    const double distance = (plaque.centre - tree.points[plaque.point]).norm();
    EXPECT_NEAR(distance, tree.radius[plaque.point] + 0.5 * plaque.radius, 0.5);
    EXPECT_GT(plaque.value, 500.0);
  }
  EXPECT_TRUE(healthy.Stenoses(0.3).empty());
}
}
