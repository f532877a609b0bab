// Regions, and fast marching against closed forms.

#include "CounterRandom.h"
#include "FastMarching.h"
#include "MarchingQueue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <queue>
#include <set>
#include <stdexcept>
#include <vector>

namespace UnitTestFastMarching
{
using namespace coronary;

namespace
{
using Predicate = std::function<bool(int, int, int)>;

VoxelRegion MakeRegion(const std::array<int, 6>& extent, const Predicate& inside)
{
  return VoxelRegion(extent,
    [&](int j, int k, unsigned char* flags)
    {
      for (int i = extent[0]; i <= extent[1]; ++i)
      {
        flags[i - extent[0]] = inside(i, j, k);
      }
    });
}

Vector3 Index(const VoxelRegion& region, VoxelRegion::Address address)
{
  const std::array<int, 3> index = region.IndexOf(address);
  return { static_cast<double>(index[0]), static_cast<double>(index[1]),
    static_cast<double>(index[2]) };
}

/// Greatest and mean error against `exact` over a ball of radius 10 mm sampled at `h`.
std::pair<double, double> ErrorsAt(double h, bool secondOrder, const Vector3& aspect)
{
  const Vector3 spacing = h * aspect;
  const int n[3] = { static_cast<int>(std::ceil(10.0 / spacing[0])),
    static_cast<int>(std::ceil(10.0 / spacing[1])),
    static_cast<int>(std::ceil(10.0 / spacing[2])) };
  const VoxelRegion region = MakeRegion({ -n[0], n[0], -n[1], n[1], -n[2], n[2] },
    [&](int i, int j, int k) { return spacing.cwiseProduct(Vector3(i, j, k)).norm() <= 10.0; });
  FastMarchingSettings settings;
  settings.spacing = spacing;
  settings.sourceRadius = 2.5;
  settings.secondOrder = secondOrder;
  const double speed = 2.5;
  FastMarching marching(
    region, std::vector<float>(region.Size(), static_cast<float>(speed)), settings);
  marching.March({ { Vector3::Zero(), 3 } });
  double maximum = 0.0;
  double sum = 0.0;
  double lengthError = 0.0;
  int others = 0;
  region.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      const double distance = spacing.cwiseProduct(Index(region, address)).norm();
      const double error = std::abs(marching.Arrival()[number] * speed - distance);
      maximum = std::max(maximum, error);
      sum += error;
      // Along straight rays the length is the distance.
      lengthError = std::max(lengthError, std::abs(marching.Length()[number] - distance));
      others += marching.Source()[number] != 3;
    });
  // The fastest path is straight, so its length is the distance.
  EXPECT_LT(lengthError, 1.05 * maximum + 1e-4);
  EXPECT_EQ(others, 0);
  return { maximum, sum / region.Size() };
}
}

TEST(VoxelRegion, NumbersAreTheRankOfTheMembers)
{
  const std::array<int, 6> extent{ -7, 60, 11, 40, -3, 9 };
  const auto inside = [](int i, int j, int k)
  {
    return MixBits(static_cast<std::uint64_t>(i + 100 * j + 10000 * k)) % 3 == 0 && i > -4 &&
      k != 9;
  };
  const VoxelRegion region = MakeRegion(extent, inside);
  std::uint32_t expected = 0;
  for (int k = extent[4]; k <= extent[5]; ++k)
  {
    for (int j = extent[2]; j <= extent[3]; ++j)
    {
      for (int i = extent[0]; i <= extent[1]; ++i)
      {
        EXPECT_EQ(region.NumberOf(i, j, k) != VoxelRegion::notAMember, inside(i, j, k));
        if (!inside(i, j, k))
        {
          continue;
        }
        ++expected;
        const std::array<int, 3> index{ i, j, k };
        const VoxelRegion::Address address = region.AddressOf(i, j, k);
        EXPECT_EQ(region.IndexOf(address), index);
        EXPECT_EQ(region.Above(address, 0), region.AddressOf(i + 1, j, k));
        EXPECT_EQ(region.Above(region.Above(address, 1), 1), region.AddressOf(i, j + 2, k));
        EXPECT_EQ(region.Below(region.Below(address, 2), 2), region.AddressOf(i, j, k - 2));
      }
    }
  }
  EXPECT_EQ(region.Size(), expected);
  EXPECT_EQ(region.Box()[0], -3);
  EXPECT_EQ(region.Box()[5], 8);
  std::uint32_t visited = 0;
  region.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      EXPECT_EQ(number, visited++);
      EXPECT_EQ(region.Number(address), number);
    });
  EXPECT_EQ(visited, expected);
}

TEST(VoxelRegion, EmptyAndSingle)
{
  const VoxelRegion none = MakeRegion({ 0, 9, 0, 9, 0, 0 }, [](int, int, int) { return false; });
  EXPECT_EQ(none.Size(), 0u);
  EXPECT_EQ(none.NumberOf(0, 0, 0), VoxelRegion::notAMember);
  const VoxelRegion noImage({ 0, -1, 0, -1, 0, -1 }, [](int, int, unsigned char*) {});
  EXPECT_EQ(noImage.Size(), 0u);
  const VoxelRegion one =
    MakeRegion({ 0, 9, 0, 9, 0, 0 }, [](int i, int j, int) { return i == 9 && j == 0; });
  EXPECT_EQ(one.Size(), 1u);
  EXPECT_EQ(one.NumberOf(9, 0, 0), 0u);
}

TEST(MarchingQueue, LeavesInOrderWhateverTheWidth)
{
  // Arrivals that are all the same, that spread over 20 decades, and first guesses far off.
  for (const double decades : { 0.0, 1.0, 20.0 })
  {
    for (const double width : { 1e-320, 1e-9, 0.01, 1e12, 1e308 })
    {
      MarchingQueue queue(width);
      std::priority_queue<MarchingQueue::Entry, std::vector<MarchingQueue::Entry>, std::greater<>>
        reference;
      std::set<MarchingQueue::Entry> outdated;
      RandomStream random(5);
      std::uint64_t drawn = 0;
      float now = 0.0F;
      const auto push = [&]
      {
        ++drawn;
        const double draw = random.Uniform();
        const auto later = static_cast<float>(
          decades > 0.0 ? static_cast<double>(now) + std::pow(10.0, decades * (draw - 0.5)) : 1.0);
        std::uint32_t bits = 0;
        std::memcpy(&bits, &later, sizeof(bits));
        const MarchingQueue::Entry entry =
          MarchingQueue::MakeEntry(bits, static_cast<std::uint32_t>(drawn));
        EXPECT_EQ(MarchingQueue::Arrival(entry), later);
        queue.Push(entry);
        if (random.Uniform() < 0.3)
        {
          outdated.insert(entry);
        }
        else
        {
          reference.push(entry);
        }
      };
      const auto keep = [&](MarchingQueue::Entry entry) { return outdated.count(entry) == 0; };
      const auto ignore = [](MarchingQueue::Entry) {};
      for (int entry = 0; entry < 5000; ++entry)
      {
        push();
      }
      while (!reference.empty())
      {
        ASSERT_TRUE(queue.Find(keep, ignore, ignore));
        ASSERT_EQ(queue.Minimum(), reference.top());
        now = MarchingQueue::Arrival(queue.Minimum());
        queue.RemoveMinimum();
        reference.pop();
        for (int more = 0; more < 2 && drawn < 60000; ++more)
        {
          push();
        }
      }
      EXPECT_FALSE(queue.Find(keep, ignore, ignore));
      EXPECT_LT(queue.MemorySize(), std::size_t{ 4 } << 20);
    }
  }
}

TEST(FastMarching, FullBoxAndRegionAreTheSame)
{
  // Full boxes are addressed in another way than regions: a far piece makes a region of a box.
  const int n = 60;
  const auto march = [&](bool apart, bool lengths, std::vector<float> found[2])
  {
    const VoxelRegion region = MakeRegion({ 0, n - 1, 0, n - 1, 0, apart ? 4 * n : n - 1 },
      [&](int i, int j, int k) { return k < n || (i == 0 && j == 0 && k == 4 * n); });
    std::vector<float> speed(region.Size());
    region.ForEach(
      [&](std::uint32_t number, VoxelRegion::Address address)
      {
        const std::array<int, 3> at = region.IndexOf(address);
        speed[number] = static_cast<float>(
          RandomStream(11, static_cast<std::uint64_t>((at[2] * n + at[1]) * n + at[0]))
            .Uniform(0.05, 1.05));
      });
    FastMarchingSettings settings;
    settings.spacing = Vector3(0.3, 0.4, 0.5);
    settings.lengths = lengths;
    FastMarching marching(region, speed, settings);
    marching.March({ { Vector3(3.2, 4, 5), 4 }, { Vector3(45, 40, 33), 7 } });
    EXPECT_EQ(marching.Length().size(), lengths ? region.Size() : 0U);
    for (int k = 0; k < n; ++k)
    {
      for (int j = 0; j < n; ++j)
      {
        for (int i = 0; i < n; ++i)
        {
          const std::uint32_t number = region.NumberOf(i, j, k);
          found[0].push_back(marching.Arrival()[number]);
          found[0].push_back(marching.Source()[number]);
          if (lengths)
          {
            found[1].push_back(marching.Length()[number]);
          }
        }
      }
    }
    EXPECT_THROW(marching.March({ { Vector3(3, 4, 5), 0 } }), std::logic_error);
  };
  std::vector<float> box[2];
  std::vector<float> pieces[2];
  std::vector<float> without[2];
  march(false, true, box);
  march(true, true, pieces);
  march(false, false, without);
  EXPECT_EQ(box[0], pieces[0]);
  EXPECT_EQ(box[1], pieces[1]);
  EXPECT_EQ(box[0], without[0]);
  EXPECT_TRUE(std::all_of(
    box[1].begin(), box[1].end(), [](float length) { return length >= 0.0F && length < 300.0F; }));
}

TEST(FastMarching, SecondOrderConvergenceToTheDistance)
{
  for (const Vector3& aspect : { Vector3(1.0, 1.0, 1.0), Vector3(0.6, 1.0, 1.4) })
  {
    const auto coarse = ErrorsAt(0.5, true, aspect);
    const auto fine = ErrorsAt(0.25, true, aspect);
    const double order = std::log2(coarse.second / fine.second);
    EXPECT_GT(order, 1.8);
    EXPECT_GT(std::log2(coarse.first / fine.first), 1.5);
    EXPECT_LT(fine.first, 0.03);
    std::cout << "greatest " << coarse.first << " -> " << fine.first << " mm, mean "
              << coarse.second << " -> " << fine.second << " mm, order " << order << '\n';
    const auto first = ErrorsAt(0.25, false, aspect);
    EXPECT_GT(first.second, 5.0 * fine.second);
  }
}

TEST(FastMarching, LinearSpeedHasAClosedForm)
{
  // F = F0 + g x: T = acosh(1 + g^2 d^2 / (2 F F0)) / g (Slotnick 1959).
  const Vector3 spacing(0.4, 0.25, 0.5);
  const double g = 0.15;
  const double f0 = 1.0;
  const std::array<int, 6> extent{ 0, 40, -30, 30, -15, 15 };
  const VoxelRegion region = MakeRegion(extent, [](int, int, int) { return true; });
  std::vector<float> speed(region.Size());
  region.ForEach([&](std::uint32_t number, VoxelRegion::Address address)
    { speed[number] = static_cast<float>(f0 + g * spacing[0] * Index(region, address)[0]); });
  FastMarchingSettings settings;
  settings.spacing = spacing;
  settings.sourceRadius = 1.5;
  FastMarching marching(region, speed, settings);
  marching.March({ { Vector3::Zero(), 0 } });
  double maximum = 0.0;
  region.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      const double d = spacing.cwiseProduct(Index(region, address)).norm();
      const double exact =
        std::acosh(1.0 + g * g * d * d / (2.0 * f0 * static_cast<double>(speed[number]))) / g;
      maximum = std::max(maximum, std::abs(marching.Arrival()[number] - exact) / (exact + 1.0));
    });
  std::cout << "greatest error " << maximum << '\n';
  EXPECT_LT(maximum, 0.015);
}

TEST(FastMarching, BendsAroundCornersAndStopsAtGaps)
{
  // A corridor of one voxel with a right angle, and a piece beyond a gap.
  const VoxelRegion region = MakeRegion({ 0, 20, 0, 20, 0, 0 },
    [](int i, int j, int) { return (j == 0 && i <= 10) || (i == 10 && j != 15); });
  FastMarchingSettings settings;
  settings.spacing = Vector3(0.5, 0.5, 2.0);
  settings.sourceRadius = 1e-9;
  FastMarching marching(region, std::vector<float>(region.Size(), 1.0F), settings);
  marching.March({ { Vector3(0, 0, 0), 0 } });
  EXPECT_NEAR(marching.Arrival()[region.NumberOf(10, 14, 0)], 12.0, 0.6);
  EXPECT_NEAR(marching.Length()[region.NumberOf(10, 14, 0)], 12.0, 0.6);
  EXPECT_TRUE(std::isinf(marching.Arrival()[region.NumberOf(10, 16, 0)]));
  EXPECT_EQ(marching.Source()[region.NumberOf(10, 16, 0)], FastMarching::noSource);
}

TEST(FastMarching, SourcesShareTheRegion)
{
  const VoxelRegion region =
    MakeRegion({ 0, 30, 0, 10, 0, 10 }, [](int, int, int) { return true; });
  FastMarching marching(region, std::vector<float>(region.Size(), 1.0F), FastMarchingSettings{});
  marching.March({ { Vector3(0, 5, 5), 0 }, { Vector3(30, 5, 5), 1 } });
  region.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      const double x = Index(region, address)[0];
      if (x != 15.0)
      {
        EXPECT_EQ(marching.Source()[number], x < 15.0 ? 0 : 1);
      }
    });
}

TEST(FastMarching, RefusalsAndMemory)
{
  const VoxelRegion region =
    MakeRegion({ 0, 63, 0, 63, 0, 63 }, [](int, int, int) { return true; });
  FastMarchingSettings settings;
  FastMarching marching(region, std::vector<float>(region.Size(), 1.0F), settings);
  marching.March({ { Vector3(32, 32, 32), 0 } });
  EXPECT_NEAR(marching.Arrival()[region.NumberOf(32, 32, 41)], 9.0, 0.05);
  EXPECT_LE(marching.MemorySize(), 24u * region.Size());

  FastMarching cancelled(region, std::vector<float>(region.Size(), 1.0F), FastMarchingSettings{},
    [](double) { return false; });
  EXPECT_THROW(cancelled.March({ { Vector3(32, 32, 32), 0 } }), Cancelled);
  std::vector<float> speed(region.Size(), 1.0F);
  speed[17] = 0.0F;
  EXPECT_THROW(FastMarching(region, speed, FastMarchingSettings{}), std::invalid_argument);
  settings.spacing[1] = 0.0;
  EXPECT_THROW(
    FastMarching(region, std::vector<float>(region.Size(), 1.0F), settings), std::invalid_argument);
}

TEST(VoxelRegion, JoinsWhatTouchesByEdgesAndCorners)
{
  // Pairs of voxels apart from each other, one for each of the 13 directions to a neighbour; and two
  // with a voxel between, which stay apart.
  const std::array<int, 6> extent{ 0, 59, 0, 5, -3, 3 };
  std::set<std::array<int, 3>> members;
  std::vector<std::array<std::array<int, 3>, 2>> pairs;
  for (int n = 14; n < 27; ++n)
  {
    const std::array<int, 3> a{ 2 + 4 * (n - 14), 2, 0 };
    const std::array<int, 3> b{ a[0] + n % 3 - 1, a[1] + n / 3 % 3 - 1, a[2] + n / 9 - 1 };
    pairs.push_back({ a, b });
    members.insert(a);
    members.insert(b);
  }
  members.insert({ 56, 1, 0 });
  members.insert({ 58, 1, 0 });
  VoxelRegion region(extent,
    [&](int j, int k, unsigned char* flags)
    {
      for (const auto& [x, y, z] : members)
      {
        flags[x] = y == j && z == k ? 1 : flags[x];
      }
    });
  ASSERT_EQ(region.Size(), members.size());
  region.JoinDiagonals();
  // Faces: none. 6 edges: 2 each. 4 corners: 6 each.
  EXPECT_EQ(region.Size(), members.size() + 6 * 2 + 4 * 6);
  for (const auto& [a, b] : pairs)
  {
    // Every voxel of the box that they span is a member, so there are ways through faces.
    for (int k = std::min(a[2], b[2]); k <= std::max(a[2], b[2]); ++k)
    {
      for (int j = std::min(a[1], b[1]); j <= std::max(a[1], b[1]); ++j)
      {
        for (int i = std::min(a[0], b[0]); i <= std::max(a[0], b[0]); ++i)
        {
          EXPECT_NE(region.NumberOf(i, j, k), VoxelRegion::notAMember) << i << j << k;
        }
      }
    }
  }
  EXPECT_EQ(region.NumberOf(57, 1, 0), VoxelRegion::notAMember);
  std::uint32_t expected = 0;
  region.ForEach([&](std::uint32_t number, VoxelRegion::Address address)
    { EXPECT_EQ(region.Number(address), expected++) << number; });
  // Nothing more to join.
  const std::uint32_t size = region.Size();
  region.JoinDiagonals();
  EXPECT_EQ(region.Size(), size);
}
}
