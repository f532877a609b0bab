// The C-arm's geometry against rotation matrices and similar triangles.
#include "CArm.h"

#include "CounterRandom.h"
#include "Numbers.h"
#include "Refusals.h"
#include "XRayTestScenes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>

namespace UnitTestCArm
{
using namespace coronary;

namespace
{
// Columns: what a patient's left, back and head are turned into. The primary angle turns the arm about the patient's
// long axis; the secondary one about the arm's own axis through the patient from side to side.
Matrix3 ArmRotation(double primary, double secondary)
{
  Matrix3 aboutHead;
  aboutHead << std::cos(primary), -std::sin(primary), 0.0, std::sin(primary), std::cos(primary),
    0.0, 0.0, 0.0, 1.0;
  Matrix3 aboutLeft;
  aboutLeft << 1.0, 0.0, 0.0, 0.0, std::cos(secondary), std::sin(secondary), 0.0,
    -std::sin(secondary), std::cos(secondary);
  return aboutHead * aboutLeft;
}

CArmPose RandomPose(RandomStream& random)
{
  CArmPose pose;
  pose.primary = random.Uniform(-100.0, 100.0) * Degrees;
  pose.secondary = random.Uniform(-45.0, 45.0) * Degrees;
  pose.sourceToIsocentre = random.Uniform(600.0, 850.0);
  pose.sourceToDetector = random.Uniform(950.0, 1250.0);
  pose.isocentre =
    Vector3(random.Uniform(-80.0, 80.0), random.Uniform(-80.0, 80.0), random.Uniform(-80.0, 80.0));
  return pose;
}
}

TEST(CArm, AxesAreThoseOfRotationMatrices)
{
  double worst = 0.0;
  for (int a = -180; a <= 180; a += 15)
  {
    for (int b = -90; b <= 90; b += 15)
    {
      const CArmGeometry geometry = CArmAt(a, b);
      const Matrix3 arm = ArmRotation(a * Degrees, b * Degrees);
      Matrix3 axes;
      axes << geometry.ColumnDirection(), -geometry.TowardsDetector(), -geometry.RowDirection();
      worst = std::max(worst, (axes - arm).cwiseAbs().maxCoeff());
    }
  }
  Row("C-arm: axes against rotation matrices, 325 poses, greatest difference", 0.0, worst, "1e-12");
  EXPECT_LE(worst, 1e-12);
}

TEST(CArm, NamedProjectionsLookFromTheSideThatTheyAreNamedAfter)
{
  // LPS: the detector of a left anterior oblique view is left of and before the patient.
  const Vector3 lao = CArmAt(45.0, 0.0).DetectorCentre();
  EXPECT_GT(lao.x(), 0.0);
  EXPECT_LT(lao.y(), 0.0);
  const Vector3 rao = CArmAt(-30.0, 0.0).DetectorCentre();
  EXPECT_LT(rao.x(), 0.0);
  EXPECT_LT(rao.y(), 0.0);
  EXPECT_GT(CArmAt(0.0, 25.0).DetectorCentre().z(), 0.0);
  EXPECT_LT(CArmAt(0.0, -25.0).DetectorCentre().z(), 0.0);
  // Frontal: the head is up, the patient's left on the right.
  const CArmGeometry frontal = CArmAt(0.0, 0.0);
  EXPECT_LT(frontal.Project({ 0.0, 0.0, 50.0 }).y(), frontal.Project(Vector3::Zero()).y());
  EXPECT_GT(frontal.Project({ 50.0, 0.0, 0.0 }).x(), frontal.Project(Vector3::Zero()).x());
}

TEST(CArm, PointsAreProjectedWhereRaysMeetTheDetector)
{
  RandomStream random(7);
  double worst = 0.0;
  for (int k = 0; k < 30; ++k)
  {
    const CArmPose pose = RandomPose(random);
    const DetectorFormat format{ 512, 384, 200.0, 150.0 };
    const CArmGeometry geometry(pose, format);
    const Matrix3 arm = ArmRotation(pose.primary, pose.secondary);
    const Vector3 point = pose.isocentre +
      Vector3(
        random.Uniform(-50.0, 50.0), random.Uniform(-50.0, 50.0), random.Uniform(-50.0, 50.0));
    // In the arm's own axes the source is at (0, SOD, 0) and looks along -y.
    const Vector3 own = arm.transpose() * (point - pose.isocentre);
    const double scale = pose.sourceToDetector / (pose.sourceToIsocentre - own.y());
    const double column = own.x() * scale / (200.0 / 512.0) + 255.5;
    const double row = -own.z() * scale / (150.0 / 384.0) + 191.5;
    const Vector3 found = geometry.Project(point);
    worst = std::max({ worst, std::abs(found.x() - column), std::abs(found.y() - row) });
    // And back: the pixel is on the ray.
    const Vector3 ray = geometry.PixelPosition(found.x(), found.y()) - geometry.Source();
    EXPECT_LE(ray.normalized().cross(point - geometry.Source()).norm(), 1e-9);
  }
  Row("C-arm: a point's pixel, 30 poses, greatest difference", 0.0, worst, "0.1 px");
  EXPECT_LE(worst, 1e-9);
}

TEST(CArm, MagnifiesBySourceToDetectorOverDepth)
{
  RandomStream random(8);
  double worst = 0.0;
  for (int k = 0; k < 30; ++k)
  {
    const CArmPose pose = RandomPose(random);
    const CArmGeometry geometry(pose, { 512, 512, 200.0, 200.0 });
    const Vector3 half = 20.0 * geometry.ColumnDirection();
    const double length =
      (geometry.Project(pose.isocentre + half).x() - geometry.Project(pose.isocentre - half).x()) *
      200.0 / 512.0;
    const double wanted = 40.0 * pose.sourceToDetector / pose.sourceToIsocentre;
    worst = std::max(worst, std::abs(length - wanted) / (200.0 / 512.0));
    EXPECT_NEAR(geometry.Magnification(pose.sourceToIsocentre), wanted / 40.0, 1e-12);
  }
  Row("C-arm: 40 mm at the isocentre, SID / SOD, 30 poses, greatest difference", 0.0, worst,
    "0.1 px");
  EXPECT_LE(worst, 1e-9);
}

TEST(CArm, WhatIsBehindTheSourceHasNoPixel)
{
  const CArmGeometry geometry = CArmAt(20.0, 10.0);
  const Vector3 seen =
    geometry.Project(geometry.Source() - 10.0 * geometry.TowardsDetector() + Vector3(1, 2, 3));
  EXPECT_FALSE(std::isfinite(seen.x()));
  EXPECT_FALSE(std::isfinite(seen.y()));
}

TEST(CArm, RefusesWhatIsNoCArm)
{
  const auto with = [](auto change)
  {
    CArmPose pose;
    DetectorFormat format;
    change(pose, format);
    return CArmGeometry(pose, format);
  };
  ExpectRefusal([&] { with([](auto& p, auto&) { p.primary = NAN; }); }, "primary angle");
  ExpectRefusal([&] { with([](auto& p, auto&) { p.secondary = 2.0; }); }, "secondary angle");
  ExpectRefusal([&] { with([](auto& p, auto&) { p.sourceToDetector = 700.0; }); }, "detector");
  ExpectRefusal([&] { with([](auto&, auto& f) { f.columns = 0; }); }, "columns");
  ExpectRefusal([&] { with([](auto&, auto& f) { f.height = -1.0; }); }, "height");
}

TEST(CArm, ViewsHaveTheirNames)
{
  CArmPose pose;
  EXPECT_EQ(ViewName(pose), "AP");
  pose.primary = -30.2 * Degree;
  EXPECT_EQ(ViewName(pose), "RAO 30");
  pose.secondary = 19.6 * Degree;
  EXPECT_EQ(ViewName(pose), "RAO 30 CRA 20");
  pose.primary = 45.0 * Degree;
  pose.secondary = -25.0 * Degree;
  EXPECT_EQ(ViewName(pose), "LAO 45 CAU 25");
  // Which is where the beam goes.
  EXPECT_LT((BeamDirection(pose) - CArmGeometry(pose, {}).TowardsDetector()).norm(), 1e-12);
}
}
