// Meshes for flow: faces and quality of cells against closed forms, layers at walls and caps, weights and outlets.
#include "FlowTestTubes.h"
#include "OutletModel.h"
#include "PolyhedralMesh.h"
#include "Refusals.h"
#include "WeightTransfer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace UnitTestFlowMesh
{
using coronary::Vector3;

namespace
{
/// Two unit cubes side by side, far from the origin; the second one's upper face is shifted along x.
struct TwoCubes
{
  std::vector<Vector3> points;
  std::vector<coronary::CellFaces> cells;
  std::vector<coronary::BoundaryFace> boundary;

  explicit TwoCubes(double shift = 0.0)
  {
    const Vector3 at(100.0, -50.0, 20.0);
    for (int k = 0; k < 12; ++k)
    {
      const int x = k % 3;
      const int z = k / 6;
      this->points.push_back(at + Vector3(x + (x == 2 ? shift * z : 0.0), (k / 3) % 2, z));
    }
    for (std::int64_t b = 0; b < 2; ++b)
    {
      this->cells.push_back({ { b, b + 3, b + 4, b + 1 }, { b + 6, b + 7, b + 10, b + 9 },
        { b, b + 1, b + 7, b + 6 }, { b + 3, b + 9, b + 10, b + 4 }, { b, b + 6, b + 9, b + 3 },
        { b + 1, b + 4, b + 10, b + 7 } });
    }
    for (std::size_t c = 0; c < 2; ++c)
    {
      for (std::size_t f = 0; f < 6; ++f)
      {
        if (f != (c == 0 ? 5U : 4U))
        {
          this->boundary.push_back({ this->cells[c][f], f < 2 ? 1 : 0 });
        }
      }
    }
  }

  coronary::PolyhedralMesh Mesh() const
  {
    return coronary::MakePolyhedralMesh(12, this->cells, this->boundary, { "sides", "ends" });
  }
};

/// The core is meshed by TetGen.
class LayeredMesh : public ::testing::Test
{
protected:
  void SetUp() override
  {
    if (!coronary::HasTetrahedralBackend(coronary::TetrahedralBackend::TetGen))
    {
      GTEST_SKIP() << "built without TetGen";
    }
  }
};

double AreaOf(const coronary::LayeredMesh& mesh, std::size_t patch, Vector3& normal)
{
  const coronary::PolyhedralMesh& cells = mesh.cells;
  Vector3 sum = Vector3::Zero();
  double sizes = 0.0;
  const auto first = cells.patches[patch].firstFace;
  for (std::int64_t f = first; f < first + cells.patches[patch].faces; ++f)
  {
    Vector3 area = Vector3::Zero();
    const std::int64_t begin = cells.faceOffset[f];
    for (std::int64_t k = begin + 1; k + 1 < cells.faceOffset[f + 1]; ++k)
    {
      const Vector3& a = mesh.points[cells.corners[begin]];
      area +=
        0.5 * (mesh.points[cells.corners[k]] - a).cross(mesh.points[cells.corners[k + 1]] - a);
    }
    sum += area;
    sizes += area.norm();
  }
  normal = sum.normalized();
  return sizes;
}
}

TEST(PolyhedralMesh, FacesAreInTheSolversOrder)
{
  const coronary::PolyhedralMesh mesh = TwoCubes().Mesh();
  EXPECT_EQ(mesh.cells, 2);
  ASSERT_EQ(mesh.NumberOfFaces(), 11);
  ASSERT_EQ(mesh.NumberOfInnerFaces(), 1);
  EXPECT_EQ(mesh.owner[0], 0);
  EXPECT_EQ(mesh.neighbour[0], 1);
  ASSERT_EQ(mesh.patches.size(), 2U);
  EXPECT_EQ(mesh.patches[0].firstFace, 1);
  EXPECT_EQ(mesh.patches[0].faces, 6);
  EXPECT_EQ(mesh.patches[1].firstFace, 7);
  EXPECT_EQ(mesh.patches[1].faces, 4);
}

TEST(PolyhedralMesh, QualityIsThatOfClosedForms)
{
  const TwoCubes cubes;
  const auto good = coronary::MeasurePolyhedra(cubes.Mesh(), cubes.points);
  EXPECT_NEAR(good.totalVolume, 2.0, 1e-12);
  EXPECT_NEAR(good.minimumVolume, 1.0, 1e-12);
  EXPECT_NEAR(good.maximumNonOrthogonality, 0.0, 1e-7);
  EXPECT_NEAR(good.maximumSkewness, 0.0, 1e-12);
  EXPECT_LT(good.maximumOpenness, 1e-12);
  EXPECT_TRUE(good.IsSound());

  // A trapezium of parallel sides 1 and 2 has its centroid 7/9 along its middle line and 5/9 up.
  const TwoCubes sheared(1.0);
  const auto bad = coronary::MeasurePolyhedra(sheared.Mesh(), sheared.points);
  EXPECT_NEAR(bad.totalVolume, 2.5, 1e-12);
  const double along = 0.5 + 7.0 / 9.0;
  const double up = 5.0 / 9.0 - 0.5;
  EXPECT_NEAR(bad.maximumNonOrthogonality, std::atan2(up, along), 1e-9);
  // The line of the centres meets the face below its middle by 0.5 / along of the way up; on it, half the side counts.
  const double off = up * 0.5 / along;
  EXPECT_GE(bad.maximumSkewness, off / 0.5 - 1e-9);
}

TEST(PolyhedralMesh, ACellThatTurnsInsideOutOnTheWayIsSeen)
{
  const TwoCubes cubes;
  const coronary::PolyhedralMesh mesh = cubes.Mesh();
  std::vector<Vector3> moved = cubes.points;
  for (Vector3& p : moved)
  {
    p += Vector3(3.0, 1.0, -2.0);
  }
  EXPECT_NEAR(coronary::LeastVolumeRatioBetween(mesh, cubes.points, moved), 1.0, 1e-9);
  // To its mirror image: flat half way, of the same size at the end.
  for (std::size_t n = 0; n < moved.size(); ++n)
  {
    moved[n] = cubes.points[n];
    moved[n].x() = 202.0 - cubes.points[n].x();
  }
  EXPECT_LE(coronary::LeastVolumeRatioBetween(mesh, cubes.points, moved), -0.999);
  // Half turned about z without being rigid between: (1 + cos) / 2 of each of two sides is left at the worst.
  for (std::size_t n = 0; n < moved.size(); ++n)
  {
    const Vector3 from = cubes.points[n] - Vector3(101.0, -49.5, 0.0);
    moved[n] = Vector3(101.0 - from.y(), -49.5 + from.x(), cubes.points[n].z());
  }
  const double least = coronary::LeastVolumeRatioBetween(mesh, cubes.points, moved);
  EXPECT_GT(least, 0.0);
  EXPECT_LE(least, 0.5 + 1e-9);
}

TEST(PolyhedralMesh, WhatIsNoMeshIsRefused)
{
  TwoCubes lost;
  lost.boundary.pop_back();
  ExpectRefusal([&] { lost.Mesh(); }, "no patch");
  TwoCubes twice;
  twice.boundary.push_back(twice.boundary.front());
  ExpectRefusal([&] { twice.Mesh(); }, "there twice");
  TwoCubes inner;
  inner.boundary.push_back({ inner.cells[0][5], 0 });
  ExpectRefusal([&] { inner.Mesh(); }, "three cells");
  TwoCubes wrong;
  wrong.boundary[0].patch = 7;
  ExpectRefusal([&] { wrong.Mesh(); }, "patch that does not exist");
  const TwoCubes cubes;
  ExpectRefusal(
    [&] { coronary::MeasurePolyhedra(cubes.Mesh(), { Vector3::Zero() }); }, "number of points");
}

TEST_F(LayeredMesh, ATubeHasItsVolumeItsLayersAndFlatCaps)
{
  const coronary::CappedSurface tube = FlowTube(1.5, 10.0, 0.35);
  coronary::LayeredMeshSettings settings;
  settings.layers = 4;
  settings.growth = 1.25;
  settings.thickness = 0.4;
  const coronary::LayeredMesh mesh =
    coronary::MakeLayeredMesh(tube, settings, { { 2, "inlet" }, { 3, "outlet_pRCA" } });
  double closed = 0.0;
  std::int64_t wall = 0;
  for (std::size_t n = 0; n < tube.triangles.size(); ++n)
  {
    const coronary::Triangle& t = tube.triangles[n];
    closed += tube.points[t[0]].dot(tube.points[t[1]].cross(tube.points[t[2]])) / 6.0;
    wall += tube.entity[n] == 1 ? 1 : 0;
  }
  const auto quality = coronary::MeasurePolyhedra(mesh.cells, mesh.points);
  EXPECT_NEAR(quality.totalVolume, closed, 1e-9 * closed);
  EXPECT_TRUE(quality.IsSound());
  EXPECT_LT(quality.maximumNonOrthogonality, 70.0 * M_PI / 180.0);
  EXPECT_LT(quality.maximumOpenness, 1e-12);
  EXPECT_EQ(static_cast<std::int64_t>(mesh.prisms.size()), 4 * wall);
  EXPECT_DOUBLE_EQ(mesh.thinnest, 1.0);
  ASSERT_EQ(mesh.cells.patches.size(), 3U);
  EXPECT_EQ(mesh.cells.patches[0].name, "wall");
  EXPECT_EQ(mesh.cells.patches[0].faces, wall);
  EXPECT_EQ(mesh.cells.patches[1].name, "inlet");
  EXPECT_EQ(mesh.cells.patches[2].name, "outlet_pRCA");
  Vector3 normal;
  const double area = AreaOf(mesh, 1, normal);
  EXPECT_NEAR(area, M_PI * 1.5 * 1.5, 0.03 * area);
  EXPECT_NEAR(normal.z(), -1.0, 1e-9);
  // Each cap's faces are many, and of the prisms' sides four to an edge of the rim.
  EXPECT_GT(mesh.cells.patches[1].faces, 60);
  for (std::size_t n = 0; n < mesh.thickness.size(); ++n)
  {
    EXPECT_NEAR(mesh.thickness[n], 0.4 * 1.5, 0.04);
  }
  for (std::size_t n = 0; n + 1 < mesh.prisms.size(); ++n)
  {
    const auto& upper = mesh.prisms[n];
    const auto& lower = mesh.prisms[n + 1];
    if (upper[3] == lower[0])
    {
      EXPECT_NEAR((mesh.points[lower[3]] - mesh.points[lower[0]]).norm(),
        1.25 * (mesh.points[upper[3]] - mesh.points[upper[0]]).norm(), 1e-9);
    }
  }
}

TEST_F(LayeredMesh, ExtensionsAreStraightAndAsLongAsAsked)
{
  const coronary::CappedSurface tube = FlowTube(1.5, 6.0, 0.4);
  coronary::LayeredMeshSettings settings;
  settings.layers = 3;
  settings.extension = 1.0;
  settings.extensionOf[3] = 0.0;
  const coronary::LayeredMesh mesh = coronary::MakeLayeredMesh(tube, settings);
  EXPECT_TRUE(coronary::MeasurePolyhedra(mesh.cells, mesh.points).IsSound());
  ASSERT_EQ(mesh.ends.size(), 2U);
  const double length = 2.0 * mesh.ends[0].radius;
  EXPECT_DOUBLE_EQ(mesh.ends[0].length, length);
  EXPECT_DOUBLE_EQ(mesh.ends[1].length, 0.0);
  double low = 0.0;
  double high = 0.0;
  for (const Vector3& p : mesh.points)
  {
    low = std::min(low, p.z());
    high = std::max(high, p.z());
    const Vector3 back = mesh.WithoutExtension(p);
    EXPECT_NEAR(back.z(), std::max(0.0, p.z()), 1e-6);
    EXPECT_NEAR(back.head<2>().norm(), p.head<2>().norm(), 1e-6);
  }
  EXPECT_NEAR(low, -length, 1e-6);
  EXPECT_NEAR(high, 6.0, 1e-6);
  EXPECT_EQ(mesh.cells.patches[1].name, "cap_2");
}

TEST_F(LayeredMesh, AForkIsSound)
{
  coronary::LayeredMeshSettings settings;
  settings.extension = 0.5;
  const coronary::LayeredMesh mesh = coronary::MakeLayeredMesh(FlowFork(0.45), settings);
  const auto quality = coronary::MeasurePolyhedra(mesh.cells, mesh.points);
  EXPECT_TRUE(quality.IsSound()) << quality.maximumNonOrthogonality << ' '
                                 << quality.maximumSkewness;
  EXPECT_EQ(mesh.cells.patches.size(), 4U);
  EXPECT_GT(mesh.thinnest, 0.2);
}

TEST_F(LayeredMesh, WhatCanNotBeMeshedIsRefused)
{
  const coronary::CappedSurface tube = FlowTube(1.5, 6.0, 0.5);
  coronary::CappedSurface noCaps = tube;
  std::fill(noCaps.entity.begin(), noCaps.entity.end(), 1);
  ExpectRefusal([&] { coronary::MakeLayeredMesh(noCaps); }, "no caps");
  coronary::CappedSurface round = tube;
  for (std::size_t n = 0; n < round.triangles.size(); ++n)
  {
    for (const std::int64_t p : round.triangles[n])
    {
      round.points[p].z() = tube.points[p].z() + 0.3 * tube.points[p].x() * tube.points[p].x();
    }
  }
  ExpectRefusal([&] { coronary::MakeLayeredMesh(round); }, "not flat");
  coronary::CappedSurface two = tube;
  const auto count = static_cast<std::int64_t>(tube.points.size());
  for (const Vector3& p : tube.points)
  {
    two.points.push_back(p + Vector3(10.0, 0.0, 0.0));
  }
  for (std::size_t n = 0; n < tube.triangles.size(); ++n)
  {
    const coronary::Triangle& t = tube.triangles[n];
    two.triangles.push_back({ t[0] + count, t[1] + count, t[2] + count });
    two.entity.push_back(tube.entity[n]);
  }
  ExpectRefusal([&] { coronary::MakeLayeredMesh(two); }, "2 pieces");
  coronary::CappedSurface open = tube;
  open.triangles.pop_back();
  open.entity.pop_back();
  ExpectThrown<coronary::SurfaceError>([&] { coronary::MakeLayeredMesh(open); }, "edge");
  coronary::LayeredMeshSettings settings;
  settings.layers = 0;
  ExpectRefusal([&] { coronary::MakeLayeredMesh(tube, settings); }, "layers");
  settings = {};
  settings.thickness = 0.9;
  ExpectRefusal([&] { coronary::MakeLayeredMesh(tube, settings); }, "thickness");
  settings = {};
  settings.extensionOf[3] = -1.0;
  ExpectRefusal([&] { coronary::MakeLayeredMesh(tube, settings); }, "cap 3");
}

TEST(WeightTransfer, IsLinearInsideAndTheNearestOutside)
{
  const std::vector<Vector3> points{ { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };
  coronary::CompactSkinWeights weights;
  weights.influences = 2;
  weights.bone = { 0, 0, 1, 0, 2, 0, 3, 0 };
  weights.weight = { 1, 0, 1, 0, 1, 0, 1, 0 };
  const auto result = coronary::TransferWeights(points, { { 0, 1, 2, 3 } }, weights,
    { { 0.1, 0.2, 0.3 }, { 0.25, 0.25, -1.0 }, { 5.0, 0.0, 0.0 } }, 4);
  const auto of = [&](std::size_t place, int bone)
  {
    double sum = 0.0;
    for (std::size_t k = 4 * place; k < 4 * place + 4; ++k)
    {
      sum += result.bone[k] == bone ? result.weight[k] : 0.0F;
    }
    return sum;
  };
  EXPECT_NEAR(of(0, 0), 0.4, 1e-6);
  EXPECT_NEAR(of(0, 1), 0.1, 1e-6);
  EXPECT_NEAR(of(0, 2), 0.2, 1e-6);
  EXPECT_NEAR(of(0, 3), 0.3, 1e-6);
  EXPECT_NEAR(of(1, 0), 0.5, 1e-6);
  EXPECT_NEAR(of(1, 3), 0.0, 1e-6);
  EXPECT_NEAR(of(2, 1), 1.0, 1e-6);
  ExpectRefusal([&] { coronary::TransferWeights(points, {}, weights, points); }, "tetrahedra");
  ExpectRefusal(
    [&] {
      coronary::TransferWeights(points, { { 0, 1, 2, 9 } }, weights, points);
    },
    "does not exist");
}

TEST(OutletModel, SharesMeanAndRatioAreAsAsked)
{
  coronary::OutletModelSettings settings;
  settings.meanFlow = 2.5;
  settings.cycle = 0.8;
  const auto model = coronary::MakeOutletModel({ 3.0, 1.5 }, settings);
  ASSERT_EQ(model.outlets.size(), 2U);
  EXPECT_NEAR(model.outlets[0].share / model.outlets[1].share, std::pow(2.0, 2.27), 1e-12);
  EXPECT_NEAR(model.outlets[0].share + model.outlets[1].share, 1.0, 1e-12);
  EXPECT_NEAR(model.inflow[0], 2.5e-6, 1e-9);
  EXPECT_NEAR(model.diastolicRatio, 1.95, 1e-9);
  EXPECT_GT(model.muscleShare, 0.0);
  EXPECT_LT(model.muscleShare, 1.0);
  for (const auto& outlet : model.outlets)
  {
    const double parallel = 1.0 / (1.0 / outlet.proximal + 1.0 / outlet.distal);
    EXPECT_NEAR(outlet.compliance * parallel, 0.4, 1e-12);
    EXPECT_NEAR(outlet.proximal / (outlet.proximal + outlet.distal), 0.6, 1e-12);
  }
  // Behind the outlets the flow that the inlet gets has to make the aorta's pressure again, on average.
  double aortic = 0.0;
  for (int k = 0; k < 400; ++k)
  {
    aortic += settings.pressures.Aortic(k / 400.0) / 400.0;
  }
  const double drop = model.inflow[0] * model.outlets[0].share *
    (model.outlets[0].proximal + model.outlets[0].distal);
  EXPECT_NEAR(drop / 133.322387415 + 5.0, aortic, 0.01 * aortic);
  // One value of the series: nearly that of the flow it was made of.
  double mean = 0.0;
  for (int k = 0; k < 100; ++k)
  {
    mean += coronary::OutletModel::At(model.inflow, 0.8, 0.008 * k) / 100.0;
  }
  EXPECT_NEAR(mean, model.inflow[0], 1e-12);
}

TEST(OutletModel, BadSettingsAreRefused)
{
  ExpectRefusal([] { coronary::MakeOutletModel({}); }, "none");
  ExpectRefusal([] { coronary::MakeOutletModel({ 1.0, 0.0 }); }, "not positive");
  coronary::OutletModelSettings settings;
  settings.meanFlow = 0.0;
  ExpectRefusal([&] { coronary::MakeOutletModel({ 1.0 }, settings); }, "meanFlow");
  settings = {};
  settings.venousPressure = 90.0;
  ExpectRefusal([&] { coronary::MakeOutletModel({ 1.0 }, settings); }, "venousPressure");
}
}
