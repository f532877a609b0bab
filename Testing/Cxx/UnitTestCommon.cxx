// The pool of threads, the random numbers and fields and the small forms that everything else uses.

#include "CounterRandom.h"
#include "CyclicTime.h"
#include "DisjointSets.h"
#include "Geometry.h"
#include "KernelChoice.h"
#include "Median.h"
#include "ParallelFor.h"
#include "Refusals.h"
#include "Require.h"
#include "SmoothRandomField.h"
#include "VoxelCell.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace UnitTestCommon
{
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

TEST(VoxelCell, IsExactForALinearImageAndKeepsTheBorder)
{
  // 3 x 4 x 1 voxels whose indices begin at -1, 2 and 5.
  const std::array<int, 6> extent = { -1, 1, 2, 5, 5, 5 };
  std::vector<short> image;
  for (int j = 2; j <= 5; ++j)
  {
    for (int i = -1; i <= 1; ++i)
    {
      image.push_back(static_cast<short>(10 * i - 3 * j));
    }
  }
  const auto at = [&](double i, double j, double k)
  { return VoxelCell<double>(Vector3(i, j, k), extent).Interpolate(image.data()); };
  EXPECT_DOUBLE_EQ(at(0.25, 3.5, 5.0), 2.5 - 10.5);
  EXPECT_DOUBLE_EQ(at(-0.75, 2.0, 5.0), -7.5 - 6.0);
  EXPECT_DOUBLE_EQ(at(1.0, 5.0, 5.0), 10.0 - 15.0);
  EXPECT_DOUBLE_EQ(at(9.0, 3.5, -4.0), 10.0 - 10.5);
  EXPECT_DOUBLE_EQ(at(-9.0, 9.0, 99.0), -10.0 - 15.0);
  const VoxelCell<double> cell(Vector3(0.25, 3.5, 5.0), extent);
  double sum = 0.0;
  double weights = 0.0;
  for (int corner = 0; corner < 8; ++corner)
  {
    const double weight = TrilinearWeight(corner, cell.part);
    sum += weight *
      image[cell.first + (corner & 1) * cell.step[0] + (corner >> 1 & 1) * cell.step[1] +
        (corner >> 2) * cell.step[2]];
    weights += weight;
  }
  EXPECT_DOUBLE_EQ(weights, 1.0);
  EXPECT_DOUBLE_EQ(sum, 2.5 - 10.5);
}

TEST(Median, IsTheUpperOneOfTwoAndQuantilesAreValuesOfTheList)
{
  EXPECT_EQ(MedianOf(std::vector<double>{}), 0.0);
  EXPECT_EQ(MedianOf(std::vector<float>{ 3.0F, 1.0F, 2.0F }), 2.0F);
  EXPECT_EQ(MedianOf(std::vector<double>{ 4.0, 1.0, 3.0, 2.0 }), 3.0);
  const std::vector<double> values = { 50.0, 10.0, 40.0, 20.0, 30.0 };
  EXPECT_EQ(QuantileOf(values, 0.0), 10.0);
  EXPECT_EQ(QuantileOf(values, 0.8), 50.0);
  EXPECT_EQ(InclusiveQuantileOf(values, 0.8), 40.0);
  EXPECT_EQ(InclusiveQuantileOf(values, 1.0), 50.0);
  EXPECT_EQ(InclusiveQuantileOf(std::vector<double>{}, 0.5), 0.0);
}

TEST(DisjointSets, JoinAndAreNamedByTheirLowest)
{
  DisjointSets sets(6);
  EXPECT_TRUE(sets.Join(4, 2));
  EXPECT_TRUE(sets.Join(5, 3));
  EXPECT_TRUE(sets.Join(5, 4));
  EXPECT_FALSE(sets.Join(3, 2));
  for (const int i : { 2, 3, 4, 5 })
  {
    EXPECT_EQ(sets.Find(i), 2);
  }
  EXPECT_EQ(sets.Find(0), 0);
  EXPECT_EQ(sets.Find(1), 1);
}

TEST(CyclicTime, IsWithinTheCycle)
{
  EXPECT_DOUBLE_EQ(Modulo(2.25), 0.25);
  EXPECT_DOUBLE_EQ(Modulo(-0.25), 0.75);
  EXPECT_EQ(Modulo(-1e-20), 0.0); // which is 1 by rounding
  EXPECT_DOUBLE_EQ(CyclicDistance(0.9, 0.1), 0.2);
  EXPECT_DOUBLE_EQ(CyclicDistance(0.1, 3.1), 0.0);
}

TEST(KernelChoice, TakesTheWidestThatIsThereAndRuns)
{
  const int baseline = 0;
  const int avx2 = 1;
  EXPECT_TRUE(ProcessorHas(Instructions::Baseline));
  KernelChoice<int> alone(baseline);
  EXPECT_EQ(&alone.Get(), &baseline);
  EXPECT_FALSE(alone.Select(Instructions::Avx2));
  EXPECT_FALSE(alone.Select(Instructions::Avx512));
  KernelChoice<int> both(baseline, &avx2);
  const int* widest = ProcessorHas(Instructions::Avx2) ? &avx2 : &baseline;
  EXPECT_EQ(&both.Get(), widest);
  EXPECT_TRUE(both.Select(Instructions::Baseline));
  EXPECT_EQ(&both.Get(), &baseline);
  EXPECT_EQ(both.Select(Instructions::Avx2), ProcessorHas(Instructions::Avx2));
  EXPECT_TRUE(both.Select(Instructions::Widest));
  EXPECT_EQ(&both.Get(), widest);
}

TEST(Require, SaysWhoseSettingIsWrong)
{
  constexpr RequireOf require{ "SomeSettings" };
  require(true, "nothing");
  require.Range("depth", 2.0, 2.0, 3.0);
  ExpectRefusal([&] { require(false, "depth must be 1"); }, "SomeSettings: depth must be 1");
  ExpectRefusal([&] { require(false, "depth", 7.0, "0 to 1 mm"); },
    "SomeSettings: depth is 7.000000; it has to be 0 to 1 mm");
  ExpectRefusal([&] { require.Range("depth", std::numeric_limits<double>::quiet_NaN(), 0.0, 1.0); },
    "SomeSettings: depth must be from 0.000000 to 1.000000");
}
}
