// The background: coarse, fine, kept, given up; from several threads.
#include "BackgroundCache.h"

#include "Attenuation.h"
#include "Refusals.h"
#include "XRayTestScenes.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>
#include <vector>

namespace UnitTestBackgroundCache
{
using namespace coronary;

namespace
{
std::shared_ptr<const VolumeProjector> Projector()
{
  static const auto projector = []
  {
    const ImageGrid grid = CentredGrid({ 120, 87, 107 }, Vector3::Constant(3.0));
    const std::vector<float> values =
      SampledEllipsoids({ { Vector3(3, 2, 1), Vector3(165, 115, 150), 0.0206 },
                          { Vector3(70, 0, 0), Vector3(50, 70, 90), 0.004 } },
        0.0, grid);
    ScalarImage image;
    image.values = values.data();
    image.grid = grid;
    return std::make_shared<const VolumeProjector>(image, [](double value) { return value; });
  }();
  return projector;
}

BackgroundCacheSettings Synchronous()
{
  BackgroundCacheSettings settings;
  settings.worker = false;
  return settings;
}

using Clock = std::chrono::steady_clock;

double Since(Clock::time_point start)
{
  return 1e3 * std::chrono::duration<double>(Clock::now() - start).count();
}
}

TEST(BackgroundCache, WithoutAWorkerTheImageIsThereAtOnce)
{
  BackgroundCache cache(Projector(), Synchronous());
  double completeness = -1.0;
  EXPECT_EQ(cache.Current(&completeness), nullptr);
  EXPECT_EQ(completeness, 0.0);
  const CArmGeometry geometry = CArmAt(31.2345, 9.8765, 128);
  cache.SetGeometry(geometry);
  const auto image = cache.Current(&completeness);
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(completeness, 1.0);
  EXPECT_EQ(image->values, Projector()->Project(cache.Rounded(geometry)).values);
}

TEST(BackgroundCache, RoundingMovesNothingByAPixel)
{
  const BackgroundCache cache(Projector(), Synchronous());
  double worst = 0.0;
  for (int k = 0; k < 50; ++k)
  {
    const CArmGeometry geometry =
      CArmAt(-90.0 + 3.7123 * k, 40.0 - 1.6127 * k, 512, 200.0, Vector3(0.03 * k, 0.017 * k, 1.0));
    const CArmGeometry rounded = cache.Rounded(geometry);
    for (const Vector3& point : { Vector3(60, 0, 0), Vector3(0, 60, 0), Vector3(0, 0, 60) })
    {
      worst = std::max(worst, (geometry.Project(point) - rounded.Project(point)).head<2>().norm());
    }
    // Rounding again changes nothing.
    EXPECT_EQ(cache.Rounded(rounded).Pose(), rounded.Pose());
  }
  Row("background: shift by the rounding of a pose, 50 poses, px", 0.0, worst, "0.5 px");
  EXPECT_LE(worst, 0.5);
  // At the ends of what is possible too.
  EXPECT_NO_THROW(cache.Rounded(CArmAt(180.0, 90.0)));
  EXPECT_NO_THROW(cache.Rounded(CArmAt(-180.0, -90.0)));
}

TEST(BackgroundCache, FinerAndFinerUntilItIsTheWholeImage)
{
  BackgroundCache cache(Projector());
  const CArmGeometry geometry = CArmAt(20.0, 10.0);
  const auto start = Clock::now();
  cache.SetGeometry(geometry);
  double before = 0.0;
  double completeness = 0.0;
  double preview = -1.0;
  while (completeness < 1.0 && Since(start) < 60e3)
  {
    const auto image = cache.Current(&completeness);
    if (preview < 0.0 && image)
    {
      preview = Since(start);
    }
    EXPECT_GE(completeness, before);
    EXPECT_EQ(image != nullptr, completeness > 0.0);
    before = completeness;
    std::this_thread::yield();
  }
  const double whole = Since(start);
  ASSERT_TRUE(cache.Wait(60.0));
  EXPECT_EQ(cache.Current()->values, Projector()->Project(cache.Rounded(geometry)).values);
  std::printf("preview after %.1f ms, image after %.1f ms\n", preview, whole);
}

TEST(BackgroundCache, CoarseImageIsCloseToTheFineOne)
{
  const CArmGeometry fine = CArmAt(20.0, 10.0);
  const LineIntegrals image = Projector()->Project(fine);
  const LineIntegrals coarse = Resampled(Projector()->Project(CArmAt(20.0, 10.0, 128)), 512, 512);
  double rms = 0.0;
  double mean = 0.0;
  for (std::size_t k = 0; k < image.values.size(); ++k)
  {
    rms += std::pow(double(image.values[k]) - coarse.values[k], 2);
    mean += image.values[k];
  }
  const auto count = static_cast<double>(image.values.size());
  EXPECT_LE(std::sqrt(rms / count) / (mean / count), 0.01);
}

TEST(BackgroundCache, GoingBackIsInstant)
{
  BackgroundCache cache(Projector());
  const CArmGeometry a = CArmAt(20.0, 10.0, 256);
  const CArmGeometry b = CArmAt(-20.0, 10.0, 256);
  cache.SetGeometry(a);
  ASSERT_TRUE(cache.Wait(60.0));
  const auto first = cache.Current();
  cache.SetGeometry(b);
  double completeness = 1.0;
  // The former image until there is one of this geometry.
  EXPECT_NE(cache.Current(&completeness), nullptr);
  EXPECT_LT(completeness, 1.0);
  ASSERT_TRUE(cache.Wait(60.0));
  EXPECT_NE(cache.Current()->values, first->values);
  cache.SetGeometry(a);
  EXPECT_EQ(cache.Current(&completeness), first);
  EXPECT_EQ(completeness, 1.0);
  // Less than a rounding step away is the same geometry.
  cache.SetGeometry(CArmAt(20.001, 10.001, 256));
  const BackgroundCacheCounts counts = cache.Counts();
  EXPECT_EQ(counts.requests, 3U);
  EXPECT_EQ(counts.hits, 1U);
  EXPECT_EQ(counts.finished, 2U);
  EXPECT_EQ(counts.cancelled, 0U);
  EXPECT_EQ(counts.bytes, 2U * 256U * 256U * 4U);
  // Pixels of another size are another image, and nothing is shown of the former one.
  cache.SetGeometry(CArmAt(20.0, 10.0, 128));
  cache.Current(&completeness);
  EXPECT_LT(completeness, 1.0);
  ASSERT_TRUE(cache.Wait(60.0));
  EXPECT_EQ(cache.Current()->columns, 128);
}

TEST(BackgroundCache, KeepsTheLastUsedWithinItsMemory)
{
  BackgroundCacheSettings settings = Synchronous();
  settings.memory = 3 * 64 * 64 * sizeof(float);
  BackgroundCache cache(Projector(), settings);
  const auto visit = [&](double primary) { cache.SetGeometry(CArmAt(primary, 0.0, 64)); };
  visit(0.0);
  visit(10.0);
  visit(20.0);
  visit(0.0); // kept, and now the last used
  EXPECT_EQ(cache.Counts().hits, 1U);
  visit(30.0); // 10 goes
  EXPECT_EQ(cache.Counts().bytes, settings.memory);
  visit(0.0);
  visit(20.0);
  EXPECT_EQ(cache.Counts().hits, 3U);
  visit(10.0);
  EXPECT_EQ(cache.Counts().hits, 3U);
  EXPECT_EQ(cache.Counts().finished, 5U);

  settings.memory = 100;
  BackgroundCache small(Projector(), settings);
  small.SetGeometry(CArmAt(0.0, 0.0, 64));
  double completeness = 0.0;
  EXPECT_NE(small.Current(&completeness), nullptr);
  EXPECT_EQ(completeness, 1.0);
  EXPECT_EQ(small.Counts().bytes, 0U);
}

TEST(BackgroundCache, AnotherGeometryEndsTheWorkAtOnce)
{
  // So large that it takes long after the coarse image.
  BackgroundCache cache(Projector());
  double worst = 0.0;
  for (int k = 0; k < 10; ++k)
  {
    cache.SetGeometry(CArmAt(3.0 * k, 5.0, 2048));
    double completeness = 0.0;
    for (int wait = 0; wait < 30000 && completeness == 0.0; ++wait)
    {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      cache.Current(&completeness);
    }
    ASSERT_LT(completeness, 1.0);
    // The small one is made only when the large one is given up.
    const auto start = Clock::now();
    cache.SetGeometry(CArmAt(3.0 * k, 5.0, 8));
    ASSERT_TRUE(cache.Wait(60.0));
    worst = std::max(worst, Since(start));
  }
  std::printf("given up, and a small image made, after at most %.1f ms\n", worst);
  EXPECT_EQ(cache.Counts().cancelled, 10U);
  EXPECT_EQ(cache.Counts().finished, 10U);
}

TEST(BackgroundCache, ManyThreadsMayLookWhileTheArmMoves)
{
  BackgroundCacheSettings settings;
  settings.memory = 20 * 64 * 64 * sizeof(float);
  BackgroundCache cache(Projector(), settings);
  std::atomic<bool> stop{ false };
  std::atomic<int> looks{ 0 };
  std::vector<std::thread> readers;
  for (int t = 0; t < 3; ++t)
  {
    readers.emplace_back(
      [&]
      {
        while (!stop)
        {
          double completeness = 0.0;
          const auto image = cache.Current(&completeness);
          if (image)
          {
            // Touched, so that a sanitizer sees who else does.
            looks += std::isfinite(image->values.front() + image->values.back()) ? 1 : 0;
          }
          std::this_thread::yield();
        }
      });
  }
  std::thread other(
    [&]
    {
      for (int k = 0; k < 60; ++k)
      {
        cache.SetGeometry(CArmAt(-1.0 * k, 0.0, 64));
        cache.Counts();
      }
    });
  for (int k = 0; k < 60; ++k)
  {
    cache.SetGeometry(CArmAt(1.0 * (k % 7), 0.0, 64));
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  other.join();
  const CArmGeometry last = CArmAt(12.5, 0.0, 64);
  cache.SetGeometry(last);
  ASSERT_TRUE(cache.Wait(60.0));
  stop = true;
  for (std::thread& reader : readers)
  {
    reader.join();
  }
  EXPECT_EQ(cache.Current()->values, Projector()->Project(cache.Rounded(last)).values);
  const BackgroundCacheCounts counts = cache.Counts();
  EXPECT_LE(counts.bytes, settings.memory);
  EXPECT_LE(counts.finished + counts.cancelled + counts.hits, counts.requests);
  EXPECT_GT(looks.load(), 0);
}

TEST(BackgroundCache, IsDestroyedWhileItWorks)
{
  const auto start = Clock::now();
  {
    BackgroundCache cache(Projector());
    cache.SetGeometry(CArmAt(20.0, 10.0, 4096));
    EXPECT_FALSE(cache.Wait(0.01));
  }
  std::printf("made and destroyed in %.1f ms\n", Since(start));
}

TEST(BackgroundCache, RefusesImpossibleSettings)
{
  ExpectRefusal([] { BackgroundCache cache(nullptr); }, "no projector");
  const auto with = [](auto change)
  {
    BackgroundCacheSettings settings;
    change(settings);
    BackgroundCache cache(Projector(), settings);
  };
  ExpectRefusal([&] { with([](auto& s) { s.previewSize = 0; }); }, "preview");
  ExpectRefusal([&] { with([](auto& s) { s.bandRows = 0; }); }, "band");
  ExpectRefusal([&] { with([](auto& s) { s.angleStep = NAN; }); }, "angles");
  ExpectRefusal([&] { with([](auto& s) { s.lengthStep = 0.0; }); }, "lengths");
}
}
