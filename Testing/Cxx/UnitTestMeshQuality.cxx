// Quality of all elements of a mesh against closed forms, boundaries of tetrahedra.
#include "MeshQuality.h"
#include "TetrahedralBoundary.h"

#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace UnitTestMeshQuality
{
using coronary::Tetrahedron;
using coronary::Triangle;
using coronary::Vector3;

namespace
{
constexpr double Degree = 0.017453292519943295769;

/// A unit cube in six tetrahedra along its diagonal, far from the origin.
struct Cube
{
  Vector3 at{ 1000.0, -2000.0, 500.0 };
  std::vector<Vector3> points;
  std::vector<Tetrahedron> tetrahedra = { { 0, 1, 3, 7 }, { 0, 3, 2, 7 }, { 0, 2, 6, 7 },
    { 0, 6, 4, 7 }, { 0, 4, 5, 7 }, { 0, 5, 1, 7 } };

  Cube()
  {
    for (int n = 0; n < 8; ++n)
    {
      this->points.push_back(this->at + Vector3(n & 1, (n >> 1) & 1, (n >> 2) & 1));
    }
  }
};
}

TEST(UnitTestMeshQuality, CubeHasItsVolumeAndArea)
{
  const Cube cube;
  const auto quality = coronary::MeasureTetrahedra(cube.points, cube.tetrahedra);
  EXPECT_TRUE(quality.inverted.empty());
  EXPECT_EQ(quality.poor, 0);
  EXPECT_NEAR(quality.totalVolume, 1.0, 1e-12);
  EXPECT_NEAR(quality.minimumVolume, 1.0 / 6.0, 1e-12);
  EXPECT_NEAR(quality.minimumDihedralAngle, 45.0 * Degree, 1e-9);
  // The circumscribed sphere is the cube's.
  EXPECT_NEAR(quality.maximumRadiusEdgeRatio, 0.5 * std::sqrt(3.0), 1e-9);
  ASSERT_EQ(quality.volume.size(), 6U);
  ASSERT_EQ(quality.minimumDihedral.size(), 6U);
  ASSERT_EQ(quality.radiusEdgeRatio.size(), 6U);

  std::vector<Triangle> triangles;
  for (const auto& [face, cell] : coronary::BoundaryFaces(cube.tetrahedra))
  {
    triangles.push_back(face);
    // On the boundary of the tetrahedron that is named.
    for (const std::int64_t corner : face)
    {
      const Tetrahedron& t = cube.tetrahedra[static_cast<std::size_t>(cell)];
      EXPECT_NE(std::find(t.begin(), t.end(), corner), t.end());
    }
  }
  ASSERT_EQ(triangles.size(), 12U);
  const auto surface = coronary::MeasureTriangles(cube.points, triangles);
  EXPECT_NEAR(surface.area, 6.0, 1e-12);
  EXPECT_NEAR(surface.enclosedVolume, 1.0, 1e-12); // outwards
  EXPECT_NEAR(surface.minimumAngle, 45.0 * Degree, 1e-9);
  EXPECT_TRUE(surface.degenerate.empty());
}

TEST(UnitTestMeshQuality, InvertedOnesAreNamed)
{
  Cube cube;
  cube.points[7] = cube.at - Vector3(0.5, 0.5, 0.5); // beyond the opposite corner: all turn over
  const auto all = coronary::MeasureTetrahedra(cube.points, cube.tetrahedra);
  EXPECT_EQ(all.inverted, (std::vector<std::int64_t>{ 0, 1, 2, 3, 4, 5 }));
  EXPECT_EQ(all.poor, 6);
  EXPECT_EQ(all.minimumDihedralAngle, 0.0);
  EXPECT_LT(all.totalVolume, 0.0);

  const Cube good;
  std::vector<Tetrahedron> one = good.tetrahedra;
  std::swap(one[3][1], one[3][2]);
  const auto single = coronary::MeasureTetrahedra(good.points, one);
  EXPECT_EQ(single.inverted, (std::vector<std::int64_t>{ 3 }));
  EXPECT_EQ(single.minimumVolumeAt, 3);
  EXPECT_EQ(single.minimumDihedralAngleAt, 3);
  EXPECT_NEAR(single.minimumVolume, -1.0 / 6.0, 1e-12);
  EXPECT_NEAR(single.totalVolume, 4.0 / 6.0, 1e-12);
  EXPECT_EQ(single.poor, 1);
}

TEST(UnitTestMeshQuality, FlatOnesCountAsInvertedAndPoorOnesByTheLimit)
{
  std::vector<Vector3> points = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0.25, 0.25, 0.0 } };
  const std::vector<Tetrahedron> one = { { 0, 1, 2, 3 } };
  const auto flat = coronary::MeasureTetrahedra(points, one);
  EXPECT_EQ(flat.inverted.size(), 1U);
  EXPECT_EQ(flat.poor, 1);
  EXPECT_TRUE(std::isinf(flat.maximumRadiusEdgeRatio));
  EXPECT_EQ(flat.maximumRadiusEdgeRatioAt, 0);

  // The face over the long edge leans by its height over the distance from that edge.
  points[3] = { 0.25, 0.25, std::tan(16.0 * Degree) * 0.25 * std::sqrt(2.0) * 1.0 };
  const double minimum = coronary::MeasureTetrahedra(points, one).minimumDihedralAngle;
  EXPECT_EQ(coronary::MeasureTetrahedra(points, one, minimum - 1e-9).poor, 0);
  EXPECT_EQ(coronary::MeasureTetrahedra(points, one, minimum + 1e-9).poor, 1);
  EXPECT_NEAR(minimum, 16.0 * Degree, 1e-9);
}

TEST(UnitTestMeshQuality, TrianglesWithoutAreaAreNamed)
{
  const std::vector<Vector3> points = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 2, 0, 0 } };
  const auto quality = coronary::MeasureTriangles(points, { { 0, 1, 2 }, { 0, 1, 3 } });
  EXPECT_EQ(quality.degenerate, (std::vector<std::int64_t>{ 1 }));
  EXPECT_EQ(quality.minimumAngle, 0.0);
  EXPECT_EQ(quality.minimumAngleAt, 1);
  EXPECT_NEAR(quality.area, 0.5, 1e-15);
}

TEST(UnitTestMeshQuality, EmptyMeshes)
{
  const auto tetrahedra = coronary::MeasureTetrahedra({}, {});
  EXPECT_EQ(tetrahedra.minimumVolumeAt, -1);
  EXPECT_EQ(tetrahedra.totalVolume, 0.0);
  EXPECT_EQ(coronary::MeasureTriangles({}, {}).minimumAngleAt, -1);
  EXPECT_TRUE(coronary::BoundaryFaces({}).empty());
}

TEST(UnitTestMeshQuality, ThreadsDoNotMatterAndWorkStops)
{
  std::vector<Vector3> points;
  std::vector<Tetrahedron> tetrahedra;
  for (int n = 0; n < 30000; ++n)
  {
    const auto first = static_cast<std::int64_t>(points.size());
    for (int k = 0; k < 4; ++k)
    {
      points.emplace_back(std::sin(n + 1.7 * k), std::cos(2.3 * n - k), std::sin(0.1 * n * k));
    }
    tetrahedra.push_back({ first, first + 1, first + 2, first + 3 });
  }
  coronary::SetNumberOfThreads(1);
  const auto one = coronary::MeasureTetrahedra(points, tetrahedra);
  coronary::SetNumberOfThreads(3);
  const auto three = coronary::MeasureTetrahedra(points, tetrahedra);
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(one.totalVolume, three.totalVolume);
  EXPECT_EQ(one.inverted, three.inverted);
  EXPECT_EQ(one.minimumDihedral, three.minimumDihedral);
  EXPECT_FALSE(one.inverted.empty());
  EXPECT_THROW(coronary::MeasureTetrahedra(points, tetrahedra, 0.2, [](double) { return false; }),
    coronary::Cancelled);
}

TEST(UnitTestMeshQuality, RefusesWhatIsNoMesh)
{
  Cube cube;
  cube.tetrahedra[2][1] = 8;
  ExpectRefusal(
    [&] { coronary::MeasureTetrahedra(cube.points, cube.tetrahedra); }, "element 2 has a point");
  cube.tetrahedra[2][1] = -1;
  ExpectRefusal(
    [&] { coronary::MeasureTetrahedra(cube.points, cube.tetrahedra); }, "element 2 has a point");
  ExpectRefusal([&] { coronary::MeasureTriangles(cube.points, { { 0, 1, 9 } }); }, "element 0");
  cube.points[5].y() = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { coronary::MeasureTriangles(cube.points, {}); }, "point 5 is not finite");
}
}
