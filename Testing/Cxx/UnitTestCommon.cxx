// The pool of threads, the random numbers and the random fields that everything else uses.

#include "CounterRandom.h"
#include "Geometry.h"
#include "ParallelFor.h"
#include "SmoothRandomField.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

using namespace coronary;

namespace
{
struct WithThreads
{
  explicit WithThreads(int threads) { SetNumberOfThreads(threads); }
  ~WithThreads() { SetNumberOfThreads(0); }
};
}

TEST(ParallelFor, VisitsEveryIndexOnce)
{
  for (const int threads : { 1, 2, 5 })
  {
    const WithThreads with(threads);
    for (const int count : { 0, 1, 7, 1000 })
    {
      for (const int grain : { 1, 3, 5000 })
      {
        std::vector<std::atomic<int>> visits(count);
        ParallelFor(count, grain,
          [&](std::int64_t first, std::int64_t last)
          {
            EXPECT_LE(last - first, grain);
            for (std::int64_t i = first; i < last; ++i)
            {
              ++visits[i];
            }
          });
        for (const auto& visit : visits)
        {
          EXPECT_EQ(visit, 1);
        }
      }
    }
  }
}

TEST(ParallelFor, UsesTheThreadsThatWereAskedFor)
{
  const WithThreads with(3);
  std::mutex mutex;
  std::set<std::thread::id> seen;
  std::atomic<int> arrived{ 0 };
  ParallelFor(3, 1,
    [&](std::int64_t, std::int64_t)
    {
      {
        const std::lock_guard<std::mutex> lock(mutex);
        seen.insert(std::this_thread::get_id());
      }
      // Every thread holds its range until all three are here, or a second has passed.
      ++arrived;
      const auto start = std::chrono::steady_clock::now();
      while (arrived < 3 && std::chrono::steady_clock::now() - start < std::chrono::seconds(5))
      {
        std::this_thread::yield();
      }
    });
  EXPECT_EQ(seen.size(), 3u);
}

TEST(ParallelFor, LoopsInsideLoopsAndAtTheSameTime)
{
  const WithThreads with(4);
  std::atomic<int> sum{ 0 };
  const auto nested = [&]
  {
    ParallelFor(10, 1,
      [&](std::int64_t, std::int64_t)
      { ParallelFor(10, 1, [&](std::int64_t, std::int64_t) { ++sum; }); });
  };
  std::thread other(nested);
  nested();
  other.join();
  EXPECT_EQ(sum, 200);
}

TEST(ParallelFor, ProgressGrowsAndStops)
{
  const WithThreads with(2);
  double last = 0.0;
  ParallelFor(
    1000, 1, [](std::int64_t, std::int64_t) {},
    [&](double fraction)
    {
      EXPECT_GE(fraction, last);
      EXPECT_LE(fraction, 1.0);
      last = fraction;
      return true;
    });
  EXPECT_EQ(last, 1.0);

  std::atomic<int> visits{ 0 };
  const auto slow = [&](std::int64_t, std::int64_t)
  {
    ++visits;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  };
  EXPECT_THROW(
    ParallelFor(20000, 1, slow, [](double fraction) { return fraction < 0.1; }), Cancelled);
  EXPECT_LT(visits, 20000);
}

TEST(ParallelFor, PassesExceptionsOn)
{
  for (const int threads : { 1, 3 })
  {
    const WithThreads with(threads);
    EXPECT_THROW(ParallelFor(100, 1,
                   [](std::int64_t first, std::int64_t)
                   {
                     if (first == 42)
                     {
                       throw std::domain_error("42");
                     }
                   }),
      std::domain_error);
    // The pool still works afterwards.
    std::atomic<int> visits{ 0 };
    ParallelFor(10, 1, [&](std::int64_t, std::int64_t) { ++visits; });
    EXPECT_EQ(visits, 10);
  }
}

TEST(RandomStream, HasTheMomentsOfItsDistribution)
{
  RandomStream random(1, 2);
  constexpr int count = 200000;
  double sum = 0.0;
  double squares = 0.0;
  double uniform = 0.0;
  for (int i = 0; i < count; ++i)
  {
    const double n = random.Normal();
    sum += n;
    squares += n * n;
    const double u = random.Uniform();
    EXPECT_GT(u, 0.0);
    EXPECT_LT(u, 1.0);
    uniform += u;
  }
  // Five standard errors.
  EXPECT_NEAR(sum / count, 0.0, 5.0 / std::sqrt(count));
  EXPECT_NEAR(squares / count, 1.0, 5.0 * std::sqrt(2.0 / count));
  EXPECT_NEAR(uniform / count, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / count));
}

TEST(RandomStream, RepeatsAndDiffers)
{
  RandomStream a(7, 1);
  RandomStream b(7, 1);
  RandomStream c(7, 2);
  RandomStream d(8, 1);
  const std::uint64_t first = a.Bits();
  EXPECT_EQ(first, b.Bits());
  EXPECT_NE(first, c.Bits());
  EXPECT_NE(first, d.Bits());
  EXPECT_EQ(MixBits(0), 0xe220a8397b1dcdafULL); // published first output of SplitMix64, seed 0
}

TEST(SmoothRandomField, HasUnitVarianceAndItsCorrelationLength)
{
  // Over many fields: variance 1, and correlation exp(-1/2) at one correlation length.
  constexpr int fields = 2000;
  constexpr double length = 30.0;
  double variance = 0.0;
  double covariance = 0.0;
  for (int seed = 1; seed <= fields; ++seed)
  {
    const SmoothRandomField field(seed, 5, length);
    const double here = field(Vector3(10.0, -5.0, 3.0));
    const double there = field(Vector3(10.0, -5.0 + length, 3.0));
    variance += here * here / fields;
    covariance += here * there / fields;
  }
  EXPECT_NEAR(variance, 1.0, 0.15);
  EXPECT_NEAR(covariance, std::exp(-0.5), 0.15);
  EXPECT_EQ(SmoothRandomField()(Vector3(1, 2, 3)), 0.0);
  EXPECT_THROW(SmoothRandomField(1, 1, 0.0), std::invalid_argument);
}

TEST(Geometry, NearestPlaceOfASegment)
{
  using coronary::NearestOnSegment;
  using coronary::Vector3;
  const Vector3 a(1.0, 2.0, 3.0);
  const Vector3 b(5.0, 2.0, 3.0);
  const coronary::SegmentPlace beside = NearestOnSegment({ 2.0, 5.0, 7.0 }, a, b);
  EXPECT_DOUBLE_EQ(beside.fraction, 0.25);
  EXPECT_EQ(beside.position, Vector3(2.0, 2.0, 3.0));
  EXPECT_DOUBLE_EQ(beside.squaredDistance, 25.0);
  EXPECT_DOUBLE_EQ(NearestOnSegment({ -9.0, 2.0, 4.0 }, a, b).fraction, 0.0);
  EXPECT_DOUBLE_EQ(NearestOnSegment({ 9.0, 2.0, 4.0 }, a, b).squaredDistance, 17.0);
  const coronary::SegmentPlace point = NearestOnSegment({ 1.0, 2.0, 5.0 }, a, a);
  EXPECT_DOUBLE_EQ(point.fraction, 0.0);
  EXPECT_DOUBLE_EQ(point.squaredDistance, 4.0);
}
