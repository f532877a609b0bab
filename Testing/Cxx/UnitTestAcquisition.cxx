// Pedals, cadence, and dose.
#include "Acquisition.h"
#include "CounterRandom.h"
#include "Refusals.h"
#include "TableRow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

namespace UnitTestAcquisition
{
using namespace coronary;

TEST(ExposureClock, cadenceIsExact)
{
  for (const int tickRate : { 1000, 2000, 1999 })
  {
    for (const double rate : { 7.5, 15.0, 30.0 })
    {
      AcquisitionSettings settings;
      settings.tickRate = tickRate;
      settings.fluoroscopyRate = FrameRateOf(rate);
      ExposureClock clock(settings);
      std::int64_t last = -1;
      for (std::int64_t tick = 0; tick < 10 * tickRate; ++tick)
      {
        if (clock.Step(true, false))
        {
          // Closed form of the time of frame n, and even intervals.
          const auto n = static_cast<double>(clock.Last().frame);
          EXPECT_EQ(tick, static_cast<std::int64_t>(std::ceil(n * tickRate / rate - 1e-9)));
          if (last >= 0)
          {
            EXPECT_NEAR(static_cast<double>(tick - last), tickRate / rate, 1.0);
          }
          last = tick;
        }
      }
      char name[80];
      std::snprintf(name, sizeof(name), "frames in 10 s at %g Hz, ticks at %d Hz", rate, tickRate);
      Row(name, 10.0 * rate, static_cast<double>(clock.Fluoroscopy().frames), "1 frame");
      EXPECT_EQ(clock.Fluoroscopy().frames, static_cast<std::int64_t>(10.0 * rate));
    }
  }
}

TEST(ExposureClock, noRadiationWithoutPedal)
{
  RandomStream random(11);
  ExposureClock clock;
  bool fluoroscopy = false;
  bool cine = false;
  std::int64_t dark = 0;
  std::int64_t lastTick = -1000;
  std::int64_t down = 0;
  std::int64_t runs = 0;
  bool wasCine = false;
  for (std::int64_t tick = 0; tick < 400000; ++tick)
  {
    fluoroscopy = random.Uniform() < 0.005 ? !fluoroscopy : fluoroscopy;
    cine = random.Uniform() < 0.003 ? !cine : cine;
    const bool exposed = clock.Step(fluoroscopy, cine, random.Uniform() < 0.5);
    dark += exposed && !fluoroscopy && !cine ? 1 : 0;
    down += fluoroscopy || cine ? 1 : 0;
    runs += cine && !wasCine ? 1 : 0;
    wasCine = cine;
    ASSERT_EQ(clock.Radiating(), fluoroscopy || cine);
    if (exposed)
    {
      ASSERT_EQ(clock.Last().cine, cine);
      ASSERT_EQ(clock.Last().tick, tick);
      ASSERT_EQ(clock.Last().run, cine ? runs : 0);
      // However the pedals are tapped, no more than the rate: 2000 / 15 ticks apart.
      ASSERT_GE(tick - lastTick, 133);
      lastTick = tick;
    }
  }
  Row("random pedals, 400000 ticks: frames without a pedal", 0.0, static_cast<double>(dark), "0");
  Row("the same: seconds of radiation", down / 2000.0, clock.Total().seconds, "exact");
  EXPECT_EQ(dark, 0);
  EXPECT_DOUBLE_EQ(clock.Total().seconds, down / 2000.0);
  EXPECT_EQ(clock.Runs(), runs);
  EXPECT_GT(clock.Fluoroscopy().frames, 100);
  EXPECT_GT(clock.Cine().frames, 100);
}

TEST(ExposureClock, aPressedPedalExposesAtOnce)
{
  ExposureClock clock;
  for (int tick = 0; tick < 1000; ++tick)
  {
    EXPECT_FALSE(clock.Step(false, false));
  }
  EXPECT_TRUE(clock.Step(true, false));
  EXPECT_EQ(clock.Last().sequence, 1);
  EXPECT_EQ(clock.Last().frameOfSequence, 0);
  EXPECT_FALSE(clock.Step(false, false));
  // Too soon for the next frame; then at once again.
  EXPECT_FALSE(clock.Step(true, false));
  for (int tick = 0; tick < 200; ++tick)
  {
    EXPECT_FALSE(clock.Step(false, false));
  }
  EXPECT_TRUE(clock.Step(false, true));
  EXPECT_EQ(clock.Last().sequence, 3);
  EXPECT_EQ(clock.Last().run, 1);
  EXPECT_TRUE(clock.Last().cine);
}

TEST(ExposureClock, maskPedalIsGivenToTheNextFrame)
{
  ExposureClock clock;
  clock.Step(false, false, true);
  clock.Step(false, false, true);
  EXPECT_TRUE(clock.Step(true, false, true));
  EXPECT_TRUE(clock.Last().mask);
  while (!clock.Step(true, false, true))
  {
  }
  EXPECT_FALSE(clock.Last().mask) << "it is the edge that counts";
}

TEST(ExposureClock, doseIsFramesTimesKermaTimesArea)
{
  AcquisitionSettings settings;
  settings.fieldArea = 100.0;
  settings.cineRate = FrameRate::F30;
  ExposureClock clock(settings);
  for (int tick = 0; tick < 20000; ++tick)
  {
    clock.Step(true, false);
  }
  clock.SetFieldArea(50.0);
  for (int tick = 0; tick < 6000; ++tick)
  {
    clock.Step(false, true);
  }
  const DoseCounters fluoroscopy = clock.Fluoroscopy();
  const DoseCounters cine = clock.Cine();
  EXPECT_EQ(fluoroscopy.frames, 150);
  EXPECT_NEAR(static_cast<double>(cine.frames), 90.0, 1.0);
  const double kerma = 150 * 0.029;
  const double cineKerma = static_cast<double>(cine.frames) * 0.22;
  Row("10 s fluoroscopy at 15 Hz: air kerma, mGy", kerma, fluoroscopy.airKerma, "1e-12");
  Row("the same, 100 cm^2: dose-area product, Gy cm^2", kerma * 0.1, fluoroscopy.doseAreaProduct,
    "1e-12");
  Row("3 s cine, 50 cm^2: Gy cm^2", cineKerma * 0.05, cine.doseAreaProduct, "1e-12");
  EXPECT_NEAR(fluoroscopy.airKerma, kerma, 1e-12 * kerma);
  EXPECT_NEAR(fluoroscopy.doseAreaProduct, kerma * 0.1, 1e-12);
  EXPECT_NEAR(cine.doseAreaProduct, cineKerma * 0.05, 1e-12);
  EXPECT_DOUBLE_EQ(fluoroscopy.seconds, 10.0);
  EXPECT_DOUBLE_EQ(cine.seconds, 3.0);
  EXPECT_DOUBLE_EQ(clock.Total().airKerma, fluoroscopy.airKerma + cine.airKerma);
  // Photons go with the kerma.
  EXPECT_NEAR(clock.Last().photons, 2000.0 * 0.22 / 0.029, 1e-9);
}

TEST(ExposureClock, defaultsGiveThePublishedReferenceLevels)
{
  // Coronary angioplasty: 16 min and 1355 frames have 94 Gy cm^2, angiography: 6 min and 1270 frames 57.
  const AcquisitionSettings settings;
  const double minute = 60.0 * 15.0 * 1e-3 * settings.fluoroscopyKerma * settings.fieldArea;
  const double frame = 1e-3 * settings.cineKerma * settings.fieldArea;
  Row("angioplasty, 16 min and 1355 frames: Gy cm^2", 94.0, 16.0 * minute + 1355.0 * frame, "3 %");
  Row("angiography, 6 min and 1270 frames: Gy cm^2", 57.0, 6.0 * minute + 1270.0 * frame, "3 %");
  EXPECT_NEAR(16.0 * minute + 1355.0 * frame, 94.0, 0.03 * 94.0);
  EXPECT_NEAR(6.0 * minute + 1270.0 * frame, 57.0, 0.03 * 57.0);
  // The default area is that of the default beam.
  EXPECT_NEAR(ReferenceFieldArea({}, {}), settings.fieldArea, 0.5);
}

TEST(ExposureClock, areaAtTheReferencePoint)
{
  CArmPose pose;
  pose.sourceToIsocentre = 750.0;
  pose.sourceToDetector = 1200.0;
  DetectorFormat format;
  format.width = 300.0;
  format.height = 200.0;
  Collimation shutters;
  shutters.left = 0.25;
  // Half of the detector's distance: a quarter of its area.
  Row("area at the reference point, cm^2", 150.0 * 0.75, ReferenceFieldArea(pose, format, shutters),
    "1e-12");
  EXPECT_NEAR(ReferenceFieldArea(pose, format, shutters), 112.5, 1e-10);
  pose.sourceToIsocentre = 120.0;
  ExpectRefusal([&] { ReferenceFieldArea(pose, format); }, "120");
}

TEST(ExposureClock, sameInputSameState)
{
  const auto run = [](std::uint64_t seed)
  {
    RandomStream random(seed);
    ExposureClock clock;
    for (int tick = 0; tick < 20000; ++tick)
    {
      const std::uint64_t bits = random.Bits();
      clock.Step((bits >> 40) % 3 != 0, (bits >> 20) % 5 == 0, bits % 7 == 0);
    }
    return clock.StateHash();
  };
  EXPECT_EQ(run(1), run(1));
  EXPECT_NE(run(1), run(2));
  ExposureClock one;
  ExposureClock other;
  EXPECT_EQ(one.StateHash(), other.StateHash());
  other.SetFieldArea(10.0);
  EXPECT_NE(one.StateHash(), other.StateHash());
  other.SetFieldArea(one.Settings().fieldArea);
  other.SetFluoroscopyRate(FrameRate::F30);
  EXPECT_NE(one.StateHash(), other.StateHash());
}

TEST(ExposureClock, refusesWhatIsNotPossible)
{
  const auto with = [](auto change)
  {
    AcquisitionSettings settings;
    change(settings);
    ExposureClock clock(settings);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { with([](AcquisitionSettings& s) { s.tickRate = 0; }); }, "tick rate");
  ExpectRefusal([&]
    { with([](AcquisitionSettings& s) { s.cineRate = static_cast<FrameRate>(9); }); },
    "frame rate of cine");
  ExpectRefusal(
    [&] { with([=](AcquisitionSettings& s) { s.fluoroscopyKerma = nan; }); }, "fluoroscopy frame");
  ExpectRefusal([&] { with([](AcquisitionSettings& s) { s.cineKerma = 0.0; }); }, "cine frame");
  ExpectRefusal(
    [&] { with([](AcquisitionSettings& s) { s.fluoroscopyPhotons = 0.0; }); }, "photons");
  ExpectRefusal([&] { with([](AcquisitionSettings& s) { s.fieldArea = -1.0; }); }, "area");
  ExposureClock clock;
  ExpectRefusal([&] { clock.SetFieldArea(nan); }, "area");
  ExpectRefusal([] { FrameRateOf(10.0); }, "7.5, 15 or 30");
  EXPECT_DOUBLE_EQ(FramesPerSecond(FrameRateOf(7.5)), 7.5);
}
}
