// Nearest triangles against a search through all of them.

#include "KernelChoice.h"
#include "ParallelFor.h"
#include "Refusals.h"
#include "TriangleBvh.h"
#include "TriangleBvhKernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace UnitTestTriangleBvh
{
using namespace coronary;

namespace
{
struct Soup
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
};

/// Small triangles in a box of 10 mm about `centre`; every seventh one a line or a point.
Soup MakeSoup(int count, unsigned int seed, const Vector3& centre = Vector3::Zero())
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> where(-5.0, 5.0);
  std::normal_distribution<double> size(0.0, 0.4);
  Soup soup;
  for (int i = 0; i < count; ++i)
  {
    const Vector3 at = centre + Vector3(where(random), where(random), where(random));
    const auto first = static_cast<std::int64_t>(soup.points.size());
    for (int k = 0; k < 3; ++k)
    {
      soup.points.emplace_back(at + Vector3(size(random), size(random), size(random)));
    }
    if (i % 7 == 3)
    {
      soup.points[first + 2] = soup.points[first + 1];
    }
    if (i % 7 == 5)
    {
      soup.points[first + 2] = 0.3 * soup.points[first] + 0.7 * soup.points[first + 1];
    }
    soup.triangles.push_back({ first, first + 1, i % 14 == 6 ? first : first + 2 });
  }
  return soup;
}

double BruteForce(const Soup& soup, const Vector3& p)
{
  double best = std::numeric_limits<double>::infinity();
  for (const Triangle& t : soup.triangles)
  {
    best = std::min(best,
      NearestOnTriangle(p, soup.points[t[0]], soup.points[t[1]], soup.points[t[2]])
        .squaredDistance);
  }
  return std::sqrt(best);
}

std::vector<Vector3> Places(int count, unsigned int seed, const Vector3& centre = Vector3::Zero())
{
  std::mt19937 random(seed);
  std::normal_distribution<double> where(0.0, 6.0);
  std::vector<Vector3> places;
  for (int i = 0; i < count; ++i)
  {
    places.emplace_back(centre + Vector3(where(random), where(random), where(random)));
  }
  return places;
}

class WithInstructions : public testing::TestWithParam<Instructions>
{
protected:
  void SetUp() override
  {
    if (!BvhKernelChoice().Select(this->GetParam()))
    {
      GTEST_SKIP() << "not on this processor";
    }
  }
  void TearDown() override { BvhKernelChoice().Select(Instructions::Widest); }
};

/// An octahedron whose triangles were quartered and put onto the unit sphere.
Soup Sphere(int levels)
{
  Soup mesh;
  mesh.points = { { 1, 0, 0 }, { -1, 0, 0 }, { 0, 1, 0 }, { 0, -1, 0 }, { 0, 0, 1 }, { 0, 0, -1 } };
  mesh.triangles = { { 0, 2, 4 }, { 2, 1, 4 }, { 1, 3, 4 }, { 3, 0, 4 }, { 2, 0, 5 }, { 1, 2, 5 },
    { 3, 1, 5 }, { 0, 3, 5 } };
  for (int level = 0; level < levels; ++level)
  {
    std::vector<Triangle> finer;
    for (const Triangle& t : mesh.triangles)
    {
      std::array<std::int64_t, 3> m{};
      for (int k = 0; k < 3; ++k)
      {
        m[k] = static_cast<std::int64_t>(mesh.points.size());
        mesh.points.emplace_back((mesh.points[t[k]] + mesh.points[t[(k + 1) % 3]]).normalized());
      }
      finer.push_back({ t[0], m[0], m[2] });
      finer.push_back({ m[0], t[1], m[1] });
      finer.push_back({ m[2], m[1], t[2] });
      finer.push_back({ m[0], m[1], m[2] });
    }
    mesh.triangles = finer;
  }
  return mesh;
}
}

TEST(NearestOnTriangle, FindsFacesEdgesAndCorners)
{
  const Vector3 a(0, 0, 0);
  const Vector3 b(4, 0, 0);
  const Vector3 c(0, 3, 0);
  const auto check = [&](const Vector3& p, const Vector3& wanted, TriangleFeature feature)
  {
    const TrianglePoint found = NearestOnTriangle(p, a, b, c);
    EXPECT_LT((found.point - wanted).norm(), 1e-12);
    EXPECT_NEAR(found.squaredDistance, (p - wanted).squaredNorm(), 1e-12);
    EXPECT_EQ(found.feature, feature);
  };
  check({ 1, 1, 5 }, { 1, 1, 0 }, TriangleFeature::Face);
  check({ 2, -1, 1 }, { 2, 0, 0 }, TriangleFeature::EdgeAB);
  check({ -1, 2, 1 }, { 0, 2, 0 }, TriangleFeature::EdgeCA);
  check({ 2 + 3, 1.5 + 4, -1 }, { 2, 1.5, 0 }, TriangleFeature::EdgeBC);
  check({ -1, -2, 0 }, a, TriangleFeature::A);
  check({ 7, -1, 0 }, b, TriangleFeature::B);
  check({ -1, 9, 2 }, c, TriangleFeature::C);
  // A line and a point.
  EXPECT_NEAR(NearestOnTriangle({ 1, 2, 0 }, a, b, { 2, 0, 0 }).squaredDistance, 4.0, 1e-12);
  EXPECT_NEAR(NearestOnTriangle({ 1, 2, 0 }, a, a, a).squaredDistance, 5.0, 1e-12);
}

TEST_P(WithInstructions, ClosestIsThatOfAllTriangles)
{
  // Sizes around those where the tree gets another node or level.
  for (const int count : { 1, 2, 3, 4, 5, 8, 9, 31, 32, 33, 36, 37, 63, 255, 256, 257, 1000, 2049 })
  {
    const Soup soup = MakeSoup(count, static_cast<unsigned int>(count));
    const TriangleBvh tree(soup.points, soup.triangles);
    for (const Vector3& p : Places(60, 3))
    {
      const double wanted = BruteForce(soup, p);
      const TriangleBvh::Nearest found = tree.Closest(p);
      ASSERT_GE(found.triangle, 0);
      ASSERT_NEAR(found.distance, wanted, 1e-10) << count;
      ASSERT_NEAR((found.point - p).norm(), wanted, 1e-10);
      ASSERT_NEAR(
        std::sqrt(tree.NearestOn(found.triangle, p).squaredDistance), found.distance, 1e-12);
      EXPECT_EQ(tree.Closest(p, 0.999999 * wanted).triangle, -1);
      EXPECT_EQ(tree.Closest(p, 1.000001 * wanted).triangle, found.triangle);
    }
  }
}

TEST_P(WithInstructions, FarFromTheOrigin)
{
  const Vector3 centre(3e6, -5e6, 8e6);
  const Soup soup = MakeSoup(500, 1, centre);
  const TriangleBvh tree(soup.points, soup.triangles);
  for (const Vector3& p : Places(200, 3, centre))
  {
    ASSERT_NEAR(tree.Closest(p).distance, BruteForce(soup, p), 1e-6);
  }
}

TEST_P(WithInstructions, AHintNeverChangesTheResult)
{
  const Soup soup = MakeSoup(777, 5);
  const TriangleBvh tree(soup.points, soup.triangles);
  std::vector<Vector3> places = Places(50, 9);
  // On the surface and on its corners, where several are equally near.
  places.insert(places.end(), soup.points.begin(), soup.points.begin() + 60);
  for (const Vector3& p : places)
  {
    const TriangleBvh::Nearest plain = tree.Closest(p);
    for (std::int64_t hint = 0; hint < 777; hint += 13)
    {
      const TriangleBvh::Nearest hinted =
        tree.Closest(p, std::numeric_limits<double>::infinity(), hint);
      ASSERT_EQ(hinted.triangle, plain.triangle);
      ASSERT_EQ(hinted.distance, plain.distance);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(TriangleBvh, WithInstructions,
  testing::Values(Instructions::Baseline, Instructions::Avx2),
  [](const auto& test) { return test.param == Instructions::Baseline ? "Baseline" : "Avx2"; });

TEST(TriangleBvh, IsTheSameOnAnyNumberOfThreads)
{
  const Soup soup = MakeSoup(5000, 21);
  SetNumberOfThreads(1);
  const TriangleBvh one(soup.points, soup.triangles);
  SetNumberOfThreads(4);
  const TriangleBvh four(soup.points, soup.triangles);
  SetNumberOfThreads(0);
  EXPECT_EQ(one.Order(), four.Order());
}

TEST(TriangleBvh, WindingTellsInsideFromOutside)
{
  const Soup sphere = Sphere(4);
  const TriangleBvh tree(sphere.points, sphere.triangles);
  for (const Vector3& p : Places(500, 4))
  {
    const Vector3 q = 0.2 * p;
    if (std::abs(q.norm() - 1.0) > 0.01)
    {
      ASSERT_EQ(tree.Winding(q), q.norm() < 1.0 ? 1 : 0);
    }
  }
  // Straight below corners and edges.
  EXPECT_EQ(tree.Winding({ 0, 0, 0 }), 1);
  EXPECT_EQ(tree.Winding({ 0, 0, -3 }), 0);
  EXPECT_EQ(tree.Winding({ 0.5, 0, 0 }), 1);
}

TEST(NearestOnTriangle, IsNearerThanAllOtherPlaces)
{
  const Soup soup = MakeSoup(300, 23);
  const std::vector<Vector3> places = Places(20, 24);
  for (const Triangle& t : soup.triangles)
  {
    const Vector3& a = soup.points[t[0]];
    const Vector3 ab = soup.points[t[1]] - a;
    const Vector3 ac = soup.points[t[2]] - a;
    for (const Vector3& p : places)
    {
      const TrianglePoint found = NearestOnTriangle(p, a, soup.points[t[1]], soup.points[t[2]]);
      ASSERT_NEAR((found.point - p).squaredNorm(), found.squaredDistance, 1e-11);
      ASSERT_NEAR((a + found.b * ab + found.c * ac - found.point).norm(), 0.0, 1e-12);
      ASSERT_GE(std::min({ found.b, found.c, 1.0 - found.b - found.c }), -1e-12);
      for (int i = 0; i <= 20; ++i)
      {
        for (int j = 0; i + j <= 20; ++j)
        {
          ASSERT_GE(
            (a + 0.05 * i * ab + 0.05 * j * ac - p).squaredNorm(), found.squaredDistance - 1e-10);
        }
      }
    }
  }
}

TEST(TriangleBvh, VisitsWhatMeetsABox)
{
  const Soup soup = MakeSoup(2000, 17);
  const TriangleBvh tree(soup.points, soup.triangles);
  for (const Vector3& p : Places(50, 9))
  {
    const Vector3 low = p - Vector3(0.3, 0.8, 1.5);
    const Vector3 high = p + Vector3(0.5, 0.2, 0.7);
    std::vector<std::int64_t> wanted;
    for (std::size_t i = 0; i < soup.triangles.size(); ++i)
    {
      const Triangle& t = soup.triangles[i];
      const auto side = [&](int axis, auto choose) {
        return choose(
          { soup.points[t[0]][axis], soup.points[t[1]][axis], soup.points[t[2]][axis] });
      };
      bool meets = true;
      for (int axis = 0; axis < 3; ++axis)
      {
        meets = meets &&
          side(axis, [](std::initializer_list<double> v) { return std::min(v); }) <= high[axis] &&
          side(axis, [](std::initializer_list<double> v) { return std::max(v); }) >= low[axis];
      }
      if (meets)
      {
        wanted.push_back(static_cast<std::int64_t>(i));
      }
    }
    std::vector<std::int64_t> found;
    tree.Visit(low, high, [&](std::int64_t triangle) { found.push_back(triangle); });
    std::sort(found.begin(), found.end());
    ASSERT_EQ(found, wanted);
  }
}

TEST(TriangleBvh, EmptyAndBadInput)
{
  EXPECT_EQ(TriangleBvh().Closest({ 0, 0, 0 }).triangle, -1);
  EXPECT_EQ(TriangleBvh({}, {}).Closest({ 0, 0, 0 }).triangle, -1);
  EXPECT_EQ(TriangleBvh().Winding({ 0, 0, 0 }), 0);
  const std::vector<Vector3> points = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 } };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const TriangleBvh tree(points, { { 0, 1, 2 } });
  EXPECT_EQ(tree.Closest({ nan, 0, 0 }).triangle, -1);
  EXPECT_EQ(tree.Closest({ 1e30, 0, 0 }).triangle, -1);
  ExpectRefusal([&] { TriangleBvh(points, { { 0, 1, 3 } }); }, "refers to point 3 of 3");
  ExpectRefusal([&] { TriangleBvh({ { nan, 0, 0 } }, { { 0, 0, 0 } }); }, "not finite");
  // A point that no triangle uses may be anything.
  EXPECT_NO_THROW(TriangleBvh({ { 0, 0, 0 }, { nan, nan, nan } }, { { 0, 0, 0 } }));
}
}
