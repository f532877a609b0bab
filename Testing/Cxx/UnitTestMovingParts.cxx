// What moves of the background, against volumes that have moved; and breathing, against closed forms.
#include "Breathing.h"
#include "MovingParts.h"
#include "Refusals.h"
#include "TableRow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace UnitTestMovingParts
{
using namespace coronary;

namespace
{
constexpr double Degree = M_PI / 180.0;
constexpr double Lung = -830.0;
constexpr double Tissue = 60.0;

/// As water.
double Attenuates(double hounsfield)
{
  return std::max(0.0, 0.0206 * (1.0 + 1e-3 * hounsfield));
}

/// 240 mm each way, 2 mm voxels. @param inside  gets a place, is the distance from what is tissue, negative inside
HounsfieldVolume Body(const std::function<double(const Vector3&)>& distance)
{
  constexpr int Size = 120;
  constexpr double Spacing = 2.0;
  HounsfieldVolume volume;
  volume.grid.extent = { 0, Size - 1, 0, Size - 1, 0, Size - 1 };
  volume.grid.spacing = Vector3::Constant(Spacing);
  volume.grid.origin = Vector3::Constant(-0.5 * Spacing * (Size - 1));
  for (int k = 0; k < Size; ++k)
  {
    for (int j = 0; j < Size; ++j)
    {
      for (int i = 0; i < Size; ++i)
      {
        const double share =
          std::clamp(0.5 - distance(volume.grid.IndexToWorld(i, j, k)) / Spacing, 0.0, 1.0);
        volume.values.push_back(
          static_cast<std::int16_t>(std::lround(Lung + share * (Tissue - Lung))));
      }
    }
  }
  return volume;
}

HounsfieldVolume Ball(const Vector3& centre, double radius)
{
  return Body([&](const Vector3& place) { return (place - centre).norm() - radius; });
}

/// Tissue below a height, lung above it.
HounsfieldVolume Floor(double height)
{
  return Body([height](const Vector3& place) { return place.z() - height; });
}

LineIntegrals Shadow(const HounsfieldVolume& volume, const CArmGeometry& geometry)
{
  return VolumeProjector(volume.View(), Attenuates).Project(geometry);
}

CArmGeometry Geometry(double lao, double cranial)
{
  CArmPose pose;
  pose.primary = lao * Degree;
  pose.secondary = cranial * Degree;
  return { pose, { 256, 256, 200.0, 200.0 } };
}

HeartPlace Place(double radius)
{
  HeartPlace heart;
  heart.radii = Vector3::Constant(radius);
  return heart;
}

struct Difference
{
  double rms = 0.0;
  double rest = 0.0; ///< rms without any motion
};

Difference Between(
  const LineIntegrals& wanted, const LineIntegrals& moved, const LineIntegrals& rest)
{
  Difference difference;
  for (std::size_t n = 0; n < wanted.values.size(); ++n)
  {
    difference.rms += std::pow(moved.values[n] - wanted.values[n], 2);
    difference.rest += std::pow(rest.values[n] - wanted.values[n], 2);
  }
  difference.rms = std::sqrt(difference.rms / static_cast<double>(wanted.values.size()));
  difference.rest = std::sqrt(difference.rest / static_cast<double>(wanted.values.size()));
  return difference;
}
}

TEST(MovingParts, aBallsShadowMovesAsTheBall)
{
  const HounsfieldVolume volume = Ball(Vector3::Zero(), 30.0);
  const MovingParts parts = FindMovingParts(volume, Place(35.0), Attenuates);
  ASSERT_TRUE(parts.heart.projector);
  const Vector3 shift(4.0, -3.0, -8.0);
  for (const auto& [lao, cranial] : std::vector<std::pair<double, double>>{ { 0, 0 }, { 40, 25 } })
  {
    const CArmGeometry geometry = Geometry(lao, cranial);
    const LineIntegrals rest = Shadow(volume, geometry);
    const LineIntegrals part = parts.heart.projector->Project(geometry);
    LineIntegrals image = rest;
    AddMotion(part, geometry, parts.heart.middle, {}, image);
    EXPECT_EQ(image.values, rest.values) << "at rest not a bit is changed";
    AddMotion(part, geometry, parts.heart.middle, { Matrix3::Identity(), shift }, image);
    const Difference off = Between(Shadow(Ball(shift, 30.0), geometry), image, rest);
    Row("shadow of a ball that moved 9.4 mm, RMS / that of no motion", 0.0, off.rms / off.rest,
      "0.03");
    EXPECT_LT(off.rms, 0.03 * off.rest);
    // Its centre of gravity, in pixels.
    Vector3 centre = Vector3::Zero();
    double sum = 0.0;
    for (int row = 0; row < image.rows; ++row)
    {
      for (int column = 0; column < image.columns; ++column)
      {
        const auto n = static_cast<std::size_t>(row) * image.columns + column;
        const double value = image.values[n] - (rest.values[n] - part.values[n]);
        centre += value * Vector3(column, row, 0.0);
        sum += value;
      }
    }
    centre /= sum;
    const Vector3 wanted = geometry.Project(shift);
    EXPECT_NEAR(centre.x(), wanted.x(), 0.1);
    EXPECT_NEAR(centre.y(), wanted.y(), 0.1);
  }
}

TEST(MovingParts, aBallThatShrinksIsThinner)
{
  const HounsfieldVolume volume = Ball(Vector3::Zero(), 30.0);
  const MovingParts parts = FindMovingParts(volume, Place(35.0), Attenuates);
  const CArmGeometry geometry = Geometry(-30.0, 20.0);
  const LineIntegrals rest = Shadow(volume, geometry);
  LineIntegrals image = rest;
  AddMotion(parts.heart.projector->Project(geometry), geometry, parts.heart.middle,
    { 0.85 * Matrix3::Identity(), Vector3::Zero() }, image);
  const Difference off = Between(Shadow(Ball(Vector3::Zero(), 0.85 * 30.0), geometry), image, rest);
  Row("shadow of a ball that shrank by 15 %, RMS / that of no motion", 0.0, off.rms / off.rest,
    "0.03");
  EXPECT_LT(off.rms, 0.03 * off.rest);
}

TEST(MovingParts, theDiaphragmGoesDown)
{
  const HounsfieldVolume volume = Floor(-20.0);
  HeartPlace heart = Place(20.0);
  heart.centre = { 0.0, 0.0, 90.0 };
  const MovingParts parts = FindMovingParts(volume, heart, Attenuates);
  ASSERT_TRUE(parts.diaphragm.projector);
  EXPECT_NEAR(parts.diaphragm.middle.z(), -20.0, 2.0);
  const CArmGeometry geometry = Geometry(0.0, 0.0);
  const LineIntegrals rest = Shadow(volume, geometry);
  LineIntegrals image = rest;
  AddMotion(parts.diaphragm.projector->Project(geometry), geometry, parts.diaphragm.middle,
    { Matrix3::Identity(), DiaphragmShift(12.0) }, image);
  // In the middle column, where it crosses half.
  const auto edge = [&](const LineIntegrals& one)
  {
    const auto at = [&](int row)
    { return one.values[static_cast<std::size_t>(row) * one.columns + one.columns / 2]; };
    const float half = 0.5F * (at(20) + at(one.rows - 20));
    int row = 20;
    while (at(row + 1) < half)
    {
      ++row;
    }
    return row + (half - at(row)) / (at(row + 1) - at(row));
  };
  const double wanted =
    (geometry.Project({ 0.0, 0.0, -32.0 }) - geometry.Project({ 0.0, 0.0, -20.0 })).y();
  Row("rows that a diaphragm of 12 mm moves", wanted, edge(image) - edge(rest), "0.5");
  EXPECT_NEAR(edge(image) - edge(rest), wanted, 0.5);
  // Nothing to breathe with.
  EXPECT_FALSE(FindMovingParts(Ball(Vector3::Zero(), 30.0), heart, Attenuates).diaphragm.projector);
}

TEST(MovingParts, voxelsMayLieInAnyDirection)
{
  const HounsfieldVolume volume = Floor(-20.0);
  HounsfieldVolume turned = volume;
  const std::array<int, 3> n = volume.View().Dimensions();
  turned.grid.direction = Vector3(1.0, -1.0, -1.0).asDiagonal();
  turned.grid.origin = volume.grid.IndexToWorld(0, n[1] - 1, n[2] - 1);
  for (int k = 0; k < n[2]; ++k)
  {
    for (int j = 0; j < n[1]; ++j)
    {
      std::copy_n(volume.values.begin() + static_cast<std::ptrdiff_t>(k * n[1] + j) * n[0], n[0],
        turned.values.begin() +
          static_cast<std::ptrdiff_t>((n[2] - 1 - k) * n[1] + n[1] - 1 - j) * n[0]);
    }
  }
  const CArmGeometry geometry = Geometry(30.0, 20.0);
  const MovingParts parts = FindMovingParts(volume, Place(40.0), Attenuates);
  const MovingParts same = FindMovingParts(turned, Place(40.0), Attenuates);
  for (const auto part : { &MovingParts::heart, &MovingParts::diaphragm })
  {
    ASSERT_TRUE((parts.*part).projector && (same.*part).projector);
    const LineIntegrals one = (parts.*part).projector->Project(geometry);
    const LineIntegrals other = (same.*part).projector->Project(geometry);
    double most = 0.0;
    for (std::size_t p = 0; p < one.values.size(); ++p)
    {
      most = std::max(most, static_cast<double>(one.values[p]));
      ASSERT_NEAR(one.values[p], other.values[p], 1e-4) << p;
    }
    EXPECT_GT(most, 0.5);
  }
}

TEST(MovingParts, theHeartIsAboutItsArteries)
{
  Matrix3 axes = (Eigen::AngleAxisd(0.6, Vector3(1, 2, 3).normalized())).toRotationMatrix();
  const Vector3 radii(30.0, 40.0, 55.0);
  const Vector3 centre(10.0, -20.0, 5.0);
  std::vector<Vector3> points;
  for (int n = 0; n < 400; ++n)
  {
    const double z = -1.0 + 2.0 * (n + 0.5) / 400.0;
    const double angle = 2.39996 * n;
    const Vector3 unit(
      std::sqrt(1.0 - z * z) * std::cos(angle), std::sqrt(1.0 - z * z) * std::sin(angle), z);
    points.push_back(centre + axes.transpose() * radii.cwiseProduct(unit));
  }
  const HeartPlace heart = HeartAbout(points, centre - 60.0 * axes.row(2).transpose());
  EXPECT_LT((heart.centre - centre).norm(), 1.0);
  Vector3 sorted = heart.radii;
  std::sort(sorted.data(), sorted.data() + 3);
  EXPECT_LT((sorted - (radii.array() + 5.0).matrix()).norm(), 2.0);

  AffineMotion beat{ Matrix3::Identity() + 0.1 * axes, Vector3(1.0, 2.0, -3.0) };
  std::vector<Vector3> now;
  for (const Vector3& point : points)
  {
    now.push_back(beat.linear * point + beat.shift);
  }
  const AffineMotion found = MotionOf(points, now);
  for (const Vector3& point : points)
  {
    EXPECT_LT((found.linear * point + found.shift - beat.linear * point - beat.shift).norm(), 0.2);
  }
  EXPECT_TRUE(MotionOf(points, points).IsRest());
  EXPECT_GT(heart.toApex.dot(axes.row(2)), 0.99);
  // Its outline gets narrower, and no shorter.
  const Matrix3 along = heart.toApex * heart.toApex.transpose();
  const AffineMotion squeezed{ 0.9 * Matrix3::Identity() - 0.1 * along, 0.1 * heart.centre };
  const AffineMotion outline = AcrossHeart(squeezed, heart);
  const Vector3 side = heart.toApex.unitOrthogonal();
  const auto moves = [&](const Vector3& way) -> Vector3
  { return outline.linear * (heart.centre + way) + outline.shift - heart.centre - way; };
  EXPECT_NEAR((moves(30.0 * heart.toApex) - moves(Vector3::Zero())).norm(), 0.0, 1e-9);
  EXPECT_NEAR((moves(30.0 * side) - moves(Vector3::Zero()) + 3.0 * side).norm(), 0.0, 1e-9);
  EXPECT_NEAR(heart.toApex.dot(moves(Vector3::Zero())), 0.0, 1e-9);
  // A flat list says nothing across itself.
  std::vector<Vector3> flat;
  std::vector<Vector3> wider;
  for (const Vector3& point : points)
  {
    flat.emplace_back(point.x(), point.y(), 0.0);
    wider.emplace_back(1.1 * point.x(), point.y(), 0.0);
  }
  const AffineMotion across = MotionOf(flat, wider);
  EXPECT_NEAR(across.linear(0, 0), 1.1, 0.005);
  EXPECT_EQ(across.linear(2, 2), 1.0);

  ExpectRefusal([] { HeartAbout({ Vector3::Zero() }, Vector3::Zero()); }, "four points");
  ExpectRefusal([] { HeartAbout(std::vector<Vector3>(5, Vector3::Zero()), Vector3::Zero()); },
    "away from its base");
  ExpectRefusal([&] { MotionOf(points, flat = {}); }, "as many");
  LineIntegrals other(10, 10);
  ExpectRefusal([&] { AddMotion(other, Geometry(0, 0), {}, beat, other); }, "format");
}

TEST(Breathing, isAClosedForm)
{
  Breathing breathing({ 15.0, 10.0 });
  EXPECT_EQ(breathing.Diaphragm(), 0.0) << "it begins at the end of expiration";
  double rest = 0.0;
  for (int tick = 1; tick <= 8000; ++tick)
  {
    breathing.Step(1.0 / 2000.0);
    const double time = tick / 2000.0;
    EXPECT_NEAR(breathing.Diaphragm(), 10.0 * std::pow(std::sin(M_PI * time / 4.0), 4), 1e-9);
    rest += breathing.Diaphragm() < 1.0 ? 1.0 / 8000.0 : 0.0;
  }
  // sin^4 is below a tenth for that share of the cycle.
  EXPECT_NEAR(rest, 2.0 / M_PI * std::asin(std::pow(0.1, 0.25)), 1e-3);
  for (int tick = 0; tick < 4000; ++tick)
  {
    breathing.Step(1.0 / 2000.0);
  }
  EXPECT_NEAR(breathing.Diaphragm(), 10.0, 1e-6);
  breathing.SetRate(0.0);
  const double held = breathing.Diaphragm();
  breathing.Step(1.0);
  EXPECT_EQ(breathing.Diaphragm(), held);
  breathing.SetRate(30.0);
  breathing.Step(1.0);
  EXPECT_NEAR(breathing.Diaphragm(), 0.0, 1e-6) << "it goes on from there";
  EXPECT_EQ(DiaphragmShift(10.0), Vector3(0.0, 0.0, -10.0));
  EXPECT_NEAR(HeartShift(10.0).z(), -6.0, 1e-12);
  EXPECT_NEAR(HeartShift(10.0).y() / HeartShift(10.0).z(), 1.3 / 4.9, 1e-12) << "towards the chest";
}
}
