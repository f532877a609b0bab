// Tracers in laminar flow against closed forms: residence time, dispersion, what branches take, conservation.
#include "ContrastTestData.h"
#include "ContrastTracers.h"
#include "CounterRandom.h"
#include "KernelChoice.h"
#include "TracerKernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

namespace UnitTestContrastTracers
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

/// Tracers in vessels whose flow is prescribed.
struct Bench
{
  Bench(
    const WallTopology& topology, const ContrastTracerSettings& settings, std::uint64_t seed = 1)
    : network(topology)
    , flow(network.Segments().size(), 0.0)
    , tracers(network, settings, seed)
  {
  }
  void Step(double dt, double injection = 0.0, const CatheterTip& tip = { 0, 0.0 })
  {
    TracerFlow now;
    now.flow = &flow;
    now.injection = injection;
    if (injection > 0.0)
    {
      now.injector = network.Locate(tip);
      // What comes from above makes up for what is not injected.
      now.flowAbove = flow[now.injector.segment] - injection;
    }
    tracers.Step(dt, now);
  }
  double Accounted() const
  {
    const std::vector<double>& blush = tracers.Blush();
    return tracers.InTree() + std::accumulate(blush.begin(), blush.end(), 0.0) +
      tracers.WashedOut() + tracers.Spilled();
  }
  FlowNetwork network;
  std::vector<double> flow;
  ContrastTracers tracers;
};

ContrastTracerSettings Settings(std::int64_t capacity, double volume, double diffusivity)
{
  ContrastTracerSettings settings;
  settings.capacity = capacity;
  settings.volume = volume;
  settings.radialDiffusivity = diffusivity;
  return settings;
}

/// Adds `count` tracers of 1e-6 mL uniformly in time over one step, without changing the flow.
void Release(Bench& bench, double dt, int count, const CatheterTip& tip)
{
  TracerFlow flow;
  flow.flow = &bench.flow;
  flow.injector = bench.network.Locate(tip);
  flow.flowAbove = bench.flow[flow.injector.segment];
  flow.injection = (count - 0.5) * 1e-6 / dt;
  bench.tracers.Step(dt, flow);
  ASSERT_EQ(bench.tracers.Size(), count);
}

// F(t) = 1 - (tau / 2 t)^2 from tau / 2 on, of a pulse that enters evenly during one step.
TEST(ContrastTracers, LaminarResidenceTime)
{
  constexpr int count = 100000;
  constexpr double dt = 0.002;
  Bench bench(Tube(100.0, 2.0, 0.8, 100), Settings(1700000, 1e-6, 0.0));
  bench.flow[0] = 0.6;
  const double tau = bench.network.Segments()[0].volume / bench.flow[0];
  // F's integral.
  const auto sum = [tau](double t)
  {
    const double late = std::max(t, 0.5 * tau);
    return (late - 0.5 * tau) + 0.25 * tau * tau * (1.0 / late - 2.0 / tau);
  };
  Release(bench, dt, count, { 0, 0.0 });
  double distance = 0.0;
  double half = 0.0;
  for (int k = 2; k * dt < 6.0 * tau; ++k)
  {
    bench.Step(dt);
    const double out = 1.0 - static_cast<double>(bench.tracers.Size()) / count;
    half = half == 0.0 && out >= 0.5 ? k * dt : half;
    distance = std::max(distance, std::abs(out - (sum(k * dt) - sum((k - 1) * dt)) / dt));
  }
  Row(
    "laminar residence time, 100,000 tracers: Kolmogorov-Smirnov distance", 0.0, distance, "0.01");
  EXPECT_LT(distance, 0.01);
  EXPECT_NEAR(half, tau / std::sqrt(2.0), 0.01 * tau);
}

TEST(ContrastTracers, TaylorArisDispersion)
{
  struct Case
  {
    double diffusivity; // mm^2/s
    double speed;       // mm/s
  };
  for (const Case& test : { Case{ 2.0, 4.0 }, Case{ 1.0, 10.0 }, Case{ 0.5, 20.0 } })
  {
    constexpr int count = 40000;
    constexpr double dt = 0.005;
    const double end = 8.0 / test.diffusivity;
    ContrastTracerSettings settings = Settings(1700000, 1e-6, test.diffusivity);
    settings.axialDiffusivity = test.diffusivity;
    Bench bench(Tube(100.0 + 1.6 * test.speed * end, 1.0, 1.0, 50), settings, 5);
    const double area = 1e-3 * Pi; // mL/mm
    bench.flow[0] = test.speed * area;
    Release(bench, dt, count, { 0, 50.0 });
    const auto variance = [&]
    {
      double mean = 0.0;
      double square = 0.0;
      for (int i = 0; i < count; ++i)
      {
        const double s = bench.tracers.Lumen(i) / area;
        mean += s / count;
        square += s * s / count;
      }
      return square - mean * mean;
    };
    const int first = static_cast<int>(0.25 * end / dt);
    const int last = static_cast<int>(end / dt);
    double early = 0.0;
    for (int k = 1; k <= last; ++k)
    {
      bench.Step(dt);
      early = k == first ? variance() : early;
    }
    ASSERT_EQ(bench.tracers.Size(), count);
    const double peclet = test.speed * 1.0 / test.diffusivity;
    const double exact = test.diffusivity * (1.0 + peclet * peclet / 48.0);
    const double measured = 0.5 * (variance() - early) / ((last - first) * dt);
    Row("Taylor-Aris dispersion at Pe = " + std::to_string(static_cast<int>(peclet)) + ", mm^2/s",
      exact, measured, "5 %");
    EXPECT_NEAR(measured / exact, 1.0, 0.05);
  }
}

TEST(ContrastTracers, RandomWalkKeepsTheCrossSectionUniform)
{
  constexpr int count = 50000;
  Bench bench(Tube(100.0, 1.0, 1.0, 10), Settings(900000, 1e-6, 1.0));
  bench.flow[0] = 0.0;
  Release(bench, 0.005, count, { 0, 50.0 });
  for (const int steps : { 400, 400 })
  {
    for (int k = 0; k < steps; ++k)
    {
      bench.Step(0.005);
    }
    // rho^2 is uniform.
    std::vector<double> square;
    square.reserve(count);
    for (int i = 0; i < count; ++i)
    {
      square.push_back(
        bench.tracers.X(i) * bench.tracers.X(i) + bench.tracers.Y(i) * bench.tracers.Y(i));
    }
    std::sort(square.begin(), square.end());
    double distance = 0.0;
    for (int i = 0; i < count; ++i)
    {
      distance = std::max(distance, std::abs(square[i] - (i + 0.5) / count));
    }
    Row("random walk: distance of rho^2 from uniform (Kolmogorov-Smirnov)", 0.0, distance,
      "0.0073 (1 % level)");
    EXPECT_LT(distance, 1.63 / std::sqrt(count));
    EXPECT_EQ(bench.tracers.Size(), count);
  }
}

TEST(ContrastTracers, BranchesTakeTheirShare)
{
  for (const double share : { 0.5, 0.3, 0.07 })
  {
    for (const double diffusivity : { 0.0, 0.5 })
    {
      Bench bench(Fork(1.5, 1.0), Settings(20000, 2e-5, diffusivity));
      bench.flow = { 2.0, 2.0 * share, 2.0 * (1.0 - share) };
      double taken = 0.0;
      double all = 0.0;
      long number = 0;
      for (int k = 0; k < 2000; ++k)
      {
        bench.Step(0.005, 0.2);
        const std::int64_t size = bench.tracers.Size();
        number = size;
        if (k > 1500)
        {
          const std::vector<double>& out = bench.tracers.Outflow();
          taken += out[bench.network.Segments()[1].below];
          all += out[bench.network.Segments()[1].below] + out[bench.network.Segments()[2].below];
        }
      }
      ASSERT_GT(number, 1000);
      const double arrived = all / 2e-5;
      const double sigma = std::sqrt(share * (1.0 - share) / arrived);
      if (diffusivity > 0.0)
      {
        Row("a branch's share of the tracers, flow " + std::to_string(share).substr(0, 4), share,
          taken / all, "3 sigma");
      }
      EXPECT_NEAR(taken / all, share, 3.0 * sigma);
    }
  }
}

// The x axis of the cross-section leads to branch 1 in the fork, whichever way the frame is turned.
TEST(ContrastTracers, RememberTheirSideOfTheVessel)
{
  Bench bench(Fork(1.5, 1.5), Settings(1000, 1e-3, 0.0), 3);
  bench.flow = { 4.0, 1.0, 3.0 };
  int taken = 0;
  double farthestIn = -1.0;
  double nearestOut = 1.0;
  for (int k = 0; k < 400; ++k)
  {
    bench.Step(0.001, 0.5);
    ASSERT_EQ(bench.tracers.Size(), 1);
    // Whether x or -x leads to branch 1 is the frame's choice; here the first frame's normal is world x.
    const double x = bench.tracers.X(0);
    while (bench.tracers.Size() == 1 && bench.tracers.Segment(0) == 0)
    {
      bench.Step(0.02);
    }
    ASSERT_EQ(bench.tracers.Size(), 1);
    const bool first = bench.tracers.Segment(0) == 1;
    taken += first ? 1 : 0;
    (first ? nearestOut : farthestIn) = first ? std::min(nearestOut, x) : std::max(farthestIn, x);
    while (bench.tracers.Size() == 1)
    {
      bench.Step(0.02);
    }
  }
  EXPECT_NEAR(taken, 100, 8);
  EXPECT_GT(nearestOut, farthestIn - 1e-3); // one chord divides them
}

TEST(ContrastTracers, FollowFlowThatTurns)
{
  // From branch 1 back: two thirds into branch 2, one third to the aorta.
  Bench bench(Fork(1.5, 1.5), Settings(20000, 5e-5, 0.2));
  bench.flow = { 0.0, 1.0, 0.0 };
  bench.flow = { 1.0, 1.0, 0.0 };
  for (int k = 0; k < 40; ++k)
  {
    bench.Step(0.005, 0.5, { 1, 5.0 });
  }
  const double injected = bench.tracers.Injected();
  bench.flow = { -0.3, -0.9, 0.6 };
  for (int k = 0; k < 60000 && bench.tracers.Size() > 0; ++k)
  {
    bench.Step(0.02);
  }
  EXPECT_EQ(bench.tracers.Size(), 0);
  EXPECT_NEAR(bench.tracers.Spilled() / injected, 1.0 / 3.0, 0.02);
  EXPECT_NEAR(bench.Accounted(), injected, 1e-12);
}

TEST(ContrastTracers, VolumeIsConserved)
{
  Bench bench(Fork(1.6, 1.2), Settings(1000, 1e-5, 0.5));
  double off = 0.0;
  for (int k = 0; k < 4000; ++k)
  {
    const double beat = std::sin(0.04 * k);
    bench.flow = { 1.0 + 2.5 * beat, 0.6 + 1.5 * beat, 0.4 + 1.0 * beat };
    bench.Step(0.005, k % 700 < 500 ? 1.7 : 0.0, { k % 3, 10.0 });
    ASSERT_LE(bench.tracers.Size(), 1000);
    off = std::max(
      off, std::abs(bench.Accounted() - bench.tracers.Injected()) / bench.tracers.Injected());
  }
  EXPECT_GT(bench.tracers.Spilled(), 0.1);
  EXPECT_GT(bench.tracers.WashedOut(), 0.1);
  Row("volume of contrast medium, merging and turning: greatest relative error", 0.0, off, "1e-12");
  EXPECT_LT(off, 1e-12);
}

// Merging moves volume only between neighbours, and not on average.
TEST(ContrastTracers, MergingKeepsTheProfile)
{
  std::vector<double> profile[2];
  for (const int crowded : { 0, 1 })
  {
    Bench bench(Tube(100.0, 1.5, 1.5, 10), Settings(crowded != 0 ? 20000 : 400000, 1e-6, 0.5), 9);
    bench.flow = { 1.0 };
    for (int k = 0; k < 60; ++k)
    {
      bench.Step(0.005, 0.9);
    }
    profile[crowded].assign(10, 0.0);
    const double whole = bench.network.Segments()[0].volume;
    for (std::int64_t i = 0; i < bench.tracers.Size(); ++i)
    {
      const int bin = std::min(9, static_cast<int>(10.0 * bench.tracers.Lumen(i) / whole));
      profile[crowded][bin] += bench.tracers.Volume(i);
    }
    EXPECT_NEAR(bench.tracers.InTree(), 0.27, 1e-12);
  }
  for (int b = 0; b < 10; ++b)
  {
    EXPECT_NEAR(profile[1][b], profile[0][b], 0.01 * 0.27) << b;
  }
}

TEST(ContrastTracers, SameSeedSameBits)
{
  std::vector<std::uint64_t> hashes;
  for (const std::uint64_t seed : { 7U, 7U, 8U })
  {
    Bench bench(Fork(1.6, 1.2), Settings(3000, 1e-4, 0.5), seed);
    for (int k = 0; k < 500; ++k)
    {
      bench.flow = { 1.0, 0.6 + 0.3 * std::sin(0.1 * k), 0.4 - 0.3 * std::sin(0.1 * k) };
      bench.Step(0.005, k < 300 ? 0.8 : 0.0);
    }
    EXPECT_GT(bench.tracers.Size(), 10);
    hashes.push_back(bench.tracers.StateHash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_NE(hashes[0], hashes[2]);
}

/// Tracers for the moving loop alone: three segments, some tracers near their ends.
struct LoopData
{
  explicit LoopData(int count)
    : segment(count)
    , part(count)
    , x(count)
    , y(count)
    , leaving(count + 1)
  {
    RandomStream random(3);
    for (int i = 0; i < count; ++i)
    {
      segment[i] = static_cast<std::int32_t>(random.Bits() % 3);
      part[i] = static_cast<float>(random.Uniform());
      x[i] = static_cast<float>(random.Uniform(-0.7, 0.7));
      y[i] = static_cast<float>(random.Uniform(-0.7, 0.7));
    }
  }
  std::int64_t Move(const TracerKernels& loops, bool axial, bool injected)
  {
    TracerRun run;
    run.segment = segment.data();
    run.part = part.data();
    run.x = x.data();
    run.y = y.data();
    run.motions = motions.data();
    run.axial = axial ? steps.data() : nullptr;
    run.injected = injected ? 1 : -1;
    run.injectedPart = 0.4F;
    run.injectedRate = -0.07F;
    run.random = 0x0123456789abcdefULL;
    return loops.move(run, static_cast<std::int64_t>(segment.size()), leaving.data());
  }
  std::vector<std::int32_t> segment;
  std::vector<float> part;
  std::vector<float> x;
  std::vector<float> y;
  std::vector<std::int32_t> leaving;
  std::array<TracerMotion, 3> motions{ { { 0.06F, 0.3F }, { -0.04F, 0.05F }, { 0.01F, 0.6F } } };
  std::array<float, 3> steps{ 0.01F, 0.03F, 0.02F };
};

TEST(ContrastTracers, MovingLoopListsThoseBeyondAnEnd)
{
  for (const int count : { 1, 7, 8, 511, 512, 513, 5000 })
  {
    LoopData data(count);
    const std::vector<float> before = data.part;
    const std::int64_t listed = data.Move(TracerKernelsBaseline, false, false);
    std::vector<std::int32_t> beyond;
    for (int i = 0; i < count; ++i)
    {
      const float rho2 = data.x[i] * data.x[i] + data.y[i] * data.y[i];
      EXPECT_LT(rho2, 1.0F);
      const TracerMotion& motion = data.motions[data.segment[i]];
      EXPECT_NEAR(data.part[i], before[i] + motion.rate * (1.0F - rho2), 1e-6F);
      if (data.part[i] < 0.0F || data.part[i] > 1.0F)
      {
        beyond.push_back(i);
      }
    }
    data.leaving.resize(listed);
    EXPECT_EQ(data.leaving, beyond) << count;
  }
}

TEST(ContrastTracers, MovingLoopsGiveTheSameBits)
{
  const TracerKernels& widest = TracerKernelChoice().Get();
  if (&widest == &TracerKernelsBaseline)
  {
    GTEST_SKIP() << "this processor has one loop only";
  }
  for (const int count : { 1, 7, 8, 511, 512, 513, 5000 })
  {
    for (const bool axial : { false, true })
    {
      for (const bool injected : { false, true })
      {
        LoopData a(count);
        LoopData b(count);
        std::int64_t listed = 0;
        for (int k = 0; k < 5; ++k)
        {
          listed = a.Move(TracerKernelsBaseline, axial, injected);
          ASSERT_EQ(b.Move(widest, axial, injected), listed);
        }
        a.leaving.resize(listed);
        b.leaving.resize(listed);
        EXPECT_EQ(a.leaving, b.leaving);
        EXPECT_EQ(a.part, b.part);
        EXPECT_EQ(a.x, b.x);
        EXPECT_EQ(a.y, b.y);
      }
    }
  }
}

TEST(ContrastTracers, BlushWashesOutExponentially)
{
  ContrastTracerSettings settings = Settings(2000, 1e-3, 0.5);
  settings.blushTime = 2.0;
  Bench bench(Tube(10.0, 1.0, 1.0, 4), settings);
  bench.flow = { 1.0 };
  bench.Step(0.005, 0.9);
  while (bench.tracers.Size() > 0)
  {
    bench.Step(0.005);
  }
  const int tip = bench.network.Segments()[0].below;
  const double before = bench.tracers.Blush()[tip];
  for (int k = 0; k < 400; ++k)
  {
    bench.Step(0.005);
  }
  EXPECT_NEAR(bench.tracers.Blush()[tip] / before, std::exp(-1.0), 1e-9);
}

TEST(ContrastTracers, RefusesBadSettings)
{
  const FlowNetwork network(Tube(10.0, 1.0, 1.0, 4));
  for (const ContrastTracerSettings& bad : { Settings(10, 1e-4, 0.5), Settings(2000, 0.0, 0.5),
         Settings(2000, 1e-4, -1.0), Settings(2000, 1e-4, std::nan("")) })
  {
    EXPECT_THROW(ContrastTracers(network, bad, 1), std::invalid_argument);
  }
}
}
}
