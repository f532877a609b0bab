// Automatic exposure control: closed forms of slabs of water, limits, and the usual views of the thorax phantom.
#include "Attenuation.h"
#include "ExposureControl.h"
#include "Refusals.h"
#include "TableRow.h"
#include "ThoraxPhantom.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace UnitTestExposureControl
{
using namespace coronary;

namespace
{
constexpr double Degree = M_PI / 180.0;

double Water()
{
  return Attenuation().Of(XRayMaterial::Water);
}

std::shared_ptr<const VolumeProjector> Projector(const HounsfieldVolume& volume)
{
  const Attenuation attenuation;
  return std::make_shared<const VolumeProjector>(
    volume.View(), [&](double hounsfield) { return attenuation.OfHounsfield(hounsfield); });
}

/// 600 mm of water across the beam, about the origin.
ExposureControl Slab(double thickness)
{
  HounsfieldVolume volume;
  volume.grid.extent = { 0, 59, 0, 9, 0, 59 };
  volume.grid.spacing = { 10.0, 0.1 * thickness, 10.0 };
  volume.grid.origin = { -295.0, -0.45 * thickness, -295.0 };
  volume.values.assign(60 * 10 * 60, 0);
  return { Projector(volume), Water() };
}

ViewExposure ExposureOf(const ExposureControl& control, double lao = 0.0, double cranial = 0.0)
{
  CArmPose pose;
  pose.primary = lao * Degree;
  pose.secondary = cranial * Degree;
  return control.Of(pose, {});
}

ExposureControl Thorax(double spacing)
{
  ThoraxSettings settings;
  settings.spacing = spacing;
  return { Projector(MakeThoraxPhantom(settings)), Water() };
}

/// Of a thorax, where a session of its vessels looks: their middle.
ViewExposure OfHeart(const ExposureControl& control, double lao, double cranial)
{
  CArmPose pose;
  pose.primary = lao * Degree;
  pose.secondary = cranial * Degree;
  pose.isocentre = { 9.1, -27.7, -46.3 };
  return control.Of(pose, {});
}

/// The window's.
const std::vector<std::pair<double, double>> UsualViews{ { 0, 0 }, { -30, 0 }, { -30, 25 },
  { -20, -20 }, { 0, 35 }, { 0, -30 }, { 40, 0 }, { 40, 25 }, { 45, -25 }, { 90, 0 } };
}

TEST(ExposureControl, kermaGoesWithTheThicknessOfWater)
{
  // The middle half of the field is 5 degrees wide: hardly more than straight through.
  const double reference = ExposureControl::ReferenceThickness;
  for (const double thickness : { 160.0, 200.0, 240.0, 280.0, 320.0 })
  {
    const double wanted = std::exp(Water() * (thickness - reference));
    const ViewExposure view = ExposureOf(Slab(thickness));
    Row("kerma through " + std::to_string(static_cast<int>(thickness)) + " mm of water", wanted,
      view.kerma, "0.5 %");
    EXPECT_NEAR(view.kerma, wanted, 0.005 * wanted);
    EXPECT_DOUBLE_EQ(view.kerma, view.photons);
  }
  // Turned, the way through a slab is longer by 1 / cos.
  const double oblique = std::exp(Water() * (160.0 / std::cos(30.0 * Degree) - reference));
  EXPECT_NEAR(ExposureOf(Slab(160.0), 0.0, 30.0).kerma, oblique, 0.03 * oblique);
  EXPECT_EQ(ExposureOf(Slab(500.0)).photons, ExposureControl::GreatestFactor);
  EXPECT_EQ(ExposureOf(Slab(10.0)).photons, ExposureControl::LeastFactor);
}

TEST(ExposureControl, aDetectorFurtherAwayNeedsMoreKermaForTheSamePhotons)
{
  const ExposureControl slab = Slab(200.0);
  CArmPose pose;
  pose.sourceToDetector = 900.0;
  const ViewExposure near = slab.Of(pose, {});
  pose.sourceToDetector = 1200.0;
  // The same rays: a field that is as much larger.
  const ViewExposure far = slab.Of(pose, { 512, 512, 200.0 * 4.0 / 3.0, 200.0 * 4.0 / 3.0 });
  EXPECT_NEAR(far.photons, near.photons, 1e-6 * near.photons);
  EXPECT_NEAR(far.kerma / near.kerma, 16.0 / 9.0, 1e-6);
  // 88 mGy/min are 300 mm in front of the detector; the reference point is 630 mm from the tube.
  EXPECT_NEAR(near.fluoroscopyLimit, 88.0 * std::pow(600.0 / 630.0, 2), 1e-9);
  EXPECT_NEAR(far.fluoroscopyLimit, 88.0 * std::pow(900.0 / 630.0, 2), 1e-9);
}

TEST(ExposureControl, theClockDosesAsTheViewNeedsUpToTheLimit)
{
  AcquisitionSettings settings;
  settings.fluoroscopyRate = FrameRate::F30;
  ExposureClock clock(settings);
  const std::uint64_t before = clock.StateHash();
  EXPECT_TRUE(clock.IsDue());
  clock.SetView({ 1.0, 1.0 });
  EXPECT_EQ(clock.StateHash(), before) << "recordings without control stay what they are";
  clock.SetView({ 2.0, 2.5, 200.0 });
  EXPECT_NE(clock.StateHash(), before);
  EXPECT_TRUE(clock.Step(true, false));
  EXPECT_FALSE(clock.IsDue());
  EXPECT_DOUBLE_EQ(clock.Last().kerma, 2.5 * 0.029);
  EXPECT_DOUBLE_EQ(clock.Last().photons, 2.0 * 2000.0);
  clock.SetView({ 4.0, 5.0, 88.0 });
  while (!clock.Step(true, false))
  {
  }
  // 30 frames a second, no more than 88 mGy in a minute; and as much less photons.
  const double most = 88.0 / 60.0 / 30.0;
  EXPECT_DOUBLE_EQ(clock.Last().kerma, most);
  EXPECT_DOUBLE_EQ(clock.Last().photons, 4.0 * 2000.0 * most / (5.0 * 0.029));
  while (!clock.Step(false, true))
  {
  }
  EXPECT_DOUBLE_EQ(clock.Last().kerma, 5.0 * 0.22) << "recordings have no limit";
  EXPECT_NEAR(clock.Total().airKerma, 2.5 * 0.029 + most + 5.0 * 0.22, 1e-12);

  const double nan = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { clock.SetView({ nan, 1.0 }); }, "photons");
  ExpectRefusal([&] { clock.SetView({ 1.0, 0.0 }); }, "air kerma");
  ExpectRefusal([&] { clock.SetView({ 1.0, 1.0, nan }); }, "limit");
  ExpectRefusal([] { ExposureControl(nullptr, 0.02); }, "patient");
  ExpectRefusal([&] { ExposureControl(Projector(MakeThoraxPhantom({ 1, 6.0 })), nan); }, "water");
}

TEST(ExposureControl, theMeanOfTheUsualViewsHasTheReferenceLevelsDose)
{
  const ExposureControl coarse = Thorax(4.0);
  const ExposureControl fine = Thorax(2.0);
  double sum = 0.0;
  for (const auto& [lao, cranial] : UsualViews)
  {
    const double kerma = OfHeart(coarse, lao, cranial).kerma;
    sum += kerma / static_cast<double>(UsualViews.size());
    CArmPose pose;
    pose.primary = lao * Degree;
    pose.secondary = cranial * Degree;
    Row("kerma of " + ViewName(pose) + ", coarse chest against fine",
      OfHeart(fine, lao, cranial).kerma, kerma, "5 %");
    EXPECT_NEAR(kerma, OfHeart(fine, lao, cranial).kerma, 0.05 * kerma);
    EXPECT_EQ(kerma, OfHeart(coarse, lao, cranial).kerma) << "the same bits";
  }
  Row("kerma of the mean of ten usual views", 1.0, sum, "2 %");
  EXPECT_NEAR(sum, 1.0, 0.02);
  // Steep views go through more of the patient.
  const double frontal = OfHeart(coarse, 0.0, 0.0).kerma;
  EXPECT_GT(OfHeart(coarse, 0.0, -30.0).kerma, 1.5 * frontal);
  EXPECT_GT(OfHeart(coarse, 45.0, -25.0).kerma, 2.5 * frontal);
}
}
