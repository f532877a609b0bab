// Distances of surfaces against closed forms and dense sampling.

#include "MeshDistance.h"
#include "Refusals.h"
#include "SurfaceTestMeshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

namespace UnitTestMeshDistance
{
using namespace coronary;

namespace
{
constexpr double Bound = 1e-3;
const auto Flat = [](double, double) { return 0.0; };

/// A sheet [-2, 2]^2 with the hole [x0, x1] x [y0, y1].
SurfaceMesh Frame(double x0, double x1, double y0, double y1)
{
  SurfaceMesh mesh = Sheet(-2, x0, -2, 2, 1, 1, Flat);
  Append(mesh, Sheet(x1, 2, -2, 2, 1, 1, Flat));
  Append(mesh, Sheet(x0, x1, -2, y0, 1, 1, Flat));
  Append(mesh, Sheet(x0, x1, y1, 2, 1, 1, Flat));
  return mesh;
}

/// A closed surface around the origin with bumps, at random; every one is another mesh.
SurfaceMesh Blob(unsigned int seed, int levels)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  SurfaceMesh mesh = Sphere(1.0, levels);
  const Vector3 shift(0.2 * uniform(random), 0.2 * uniform(random), 0.2 * uniform(random));
  const Vector3 wave(2.0 * uniform(random), 2.0 * uniform(random), 2.0 * uniform(random));
  const double size = 3.0 + uniform(random);
  const double bump = 0.3 * uniform(random);
  const Eigen::AngleAxisd turn(
    3.0 * uniform(random), Vector3(uniform(random), uniform(random), 1.0).normalized());
  for (Vector3& p : mesh.points)
  {
    p = turn * (size * (1.0 + bump * std::sin(3.0 * wave.dot(p))) * p) + shift;
  }
  return mesh;
}

/// Greatest distance of densely sampled points of a from b, by all triangles.
double SampledHausdorff(const SurfaceMesh& a, const SurfaceMesh& b, int density)
{
  SurfaceMesh samples;
  for (const Triangle& t : a.triangles)
  {
    for (int i = 0; i <= density; ++i)
    {
      for (int j = 0; i + j <= density; ++j)
      {
        const double u = static_cast<double>(i) / density;
        const double v = static_cast<double>(j) / density;
        samples.points.emplace_back(
          (1.0 - u - v) * a.points[t[0]] + u * a.points[t[1]] + v * a.points[t[2]]);
        const auto p = static_cast<std::int64_t>(samples.points.size()) - 1;
        samples.triangles.push_back({ p, p, p });
      }
    }
  }
  MeshDistanceSettings settings;
  settings.areaMeasures = false;
  settings.hausdorff = false;
  settings.signedDistances = false;
  return CompareSurfaces(samples, b, settings).ab.vertexMaximum;
}
}

TEST(MeshDistance, SheetsAtAConstantDistance)
{
  // Different triangles on the two sides, so that no triangle has all of another above it.
  const SurfaceMesh a = Sheet(0, 5, 0, 4, 7, 3, Flat);
  const SurfaceMesh b = Sheet(0, 5, 0, 4, 4, 9, [](double, double) { return 2.0; });
  MeshDistanceSettings settings;
  settings.maximumPieces = 20000; // no search without end where everything is equally far
  const MeshDistance d = CompareSurfaces(a, b, settings);
  EXPECT_TRUE(d.warnings.empty()) << d.warnings.front();
  EXPECT_NEAR(d.hausdorff, 2.0, 1e-12);
  EXPECT_LE(d.hausdorffError, Bound);
  EXPECT_NEAR(d.ab.vertexMean, 2.0, 1e-12);
  EXPECT_NEAR(d.mean, 2.0, 1e-12);
  EXPECT_NEAR(d.rms, 2.0, 1e-12);
  EXPECT_NEAR(d.hausdorff95, 2.0, 1e-9);
  EXPECT_NEAR(d.ab.area, 20.0, 1e-12);
  EXPECT_EQ(d.ab.vertices, 8 * 4);
  EXPECT_FALSE(d.signedA);
}

TEST(MeshDistance, IdenticalAndCoplanarSurfacesAreAtNoDistance)
{
  MeshDistanceSettings settings;
  settings.maximumPieces = 100000;
  const SurfaceMesh blob = Blob(1, 4);
  const MeshDistance same = CompareSurfaces(blob, blob, settings);
  EXPECT_LT(same.hausdorff, 1e-12);
  EXPECT_LE(same.hausdorffError, Bound);
  EXPECT_TRUE(same.warnings.empty());
  EXPECT_LT(same.mean, 1e-12);
  const MeshDistance sheets =
    CompareSurfaces(Sheet(0, 5, 0, 4, 13, 11, Flat), Sheet(0, 5, 0, 4, 10, 14, Flat), settings);
  EXPECT_LT(sheets.hausdorff, 1e-12);
  EXPECT_LE(sheets.hausdorffError, Bound);
  EXPECT_TRUE(sheets.warnings.empty());
}

TEST(MeshDistance, GreatestDistanceInsideOfAFace)
{
  // The hole is 1.6 wide and 2 high; all corners of the whole sheet are on the frame.
  const SurfaceMesh whole = Sheet(-2, 2, -2, 2, 1, 1, Flat);
  const SurfaceMesh frame = Frame(-1.0, 0.6, -0.9, 1.1);
  const MeshDistance d = CompareSurfaces(whole, frame);
  EXPECT_NEAR(d.hausdorff, 0.8, Bound);
  EXPECT_LE(d.hausdorff, 0.8 + 1e-12);
  EXPECT_GE(d.hausdorff + d.hausdorffError, 0.8 - 1e-12);
  EXPECT_NEAR(d.ab.at[0], -0.2, 1e-3 + Bound);
  EXPECT_GT(d.ab.at[1], -0.1 - 2 * Bound);
  EXPECT_LT(d.ab.at[1], 0.3 + 2 * Bound);
  EXPECT_NEAR((d.ab.at - d.ab.nearest).norm(), d.ab.hausdorff, 1e-12);
  EXPECT_EQ(d.ab.vertexMaximum, 0.0);
  EXPECT_NEAR(d.ba.hausdorff, 0.0, 1e-12);
  // A tenth of the bound.
  MeshDistanceSettings fine;
  fine.errorBound = 1e-5;
  EXPECT_NEAR(CompareSurfaces(whole, frame, fine).hausdorff, 0.8, 1e-5);
  // Integral of the distance from the rim over the hole: a roof of height 0.8.
  const double volume = 1.6 * 0.4 * 0.8 / 2.0 + 1.6 * 1.6 * 0.8 / 3.0;
  EXPECT_NEAR(d.ab.mean, volume / 16.0, Bound);
  EXPECT_NEAR(d.mean, volume / (16.0 + 16.0 - 3.2), Bound);
  EXPECT_LE(d.quadratureError, Bound);
}

TEST(MeshDistance, AFaceOverAFold)
{
  // A flat face over a roof: the greatest distance is over the valley's corners at the rim of a face.
  const SurfaceMesh face = Sheet(-1, 1, -1, 1, 1, 1, [](double, double) { return 1.5; });
  const SurfaceMesh roof =
    Sheet(-9, 9, -9, 9, 2, 1, [](double x, double) { return 1.0 - 0.25 * std::abs(x); });
  const MeshDistance d = CompareSurfaces(face, roof);
  const double wanted = (0.5 + 0.25) / std::sqrt(1.0 + 0.25 * 0.25);
  EXPECT_NEAR(d.ab.hausdorff, wanted, 1e-12);
  EXPECT_LE(d.ab.hausdorffError, Bound);
}

TEST(MeshDistance, CrossingSheetsHaveKnownMeasures)
{
  // d = |x| sin(a) on the flat sheet, with a kink where they cross.
  const double slope = 0.3;
  const double sine = slope / std::sqrt(1.0 + slope * slope);
  const SurfaceMesh flat = Sheet(-1, 1, -1, 1, 3, 2, Flat);
  const SurfaceMesh tilted = Sheet(-9, 9, -9, 9, 1, 1, [=](double x, double) { return slope * x; });
  MeshDistanceSettings settings;
  const MeshDistance d = CompareSurfaces(flat, tilted, settings);
  EXPECT_NEAR(d.ab.hausdorff, sine, Bound);
  EXPECT_NEAR(d.ab.mean, 0.5 * sine, Bound);
  EXPECT_NEAR(d.ab.rms, sine / std::sqrt(3.0), Bound);
  EXPECT_NEAR(d.ab.percentile95, 0.95 * sine, Bound);
  EXPECT_LE(d.ab.quadratureError, Bound);
  settings.errorBound = 1e-6;
  const MeshDistance fine = CompareSurfaces(flat, tilted, settings);
  EXPECT_NEAR(fine.ab.mean, 0.5 * sine, 1e-6);
  // Vertex mean: columns of vertices at -1, -1/3, 1/3, 1.
  EXPECT_NEAR(d.ab.vertexMean, sine * 2.0 / 3.0, 1e-12);
}

TEST(MeshDistance, ConcentricSpheres)
{
  for (const double inner : { 0.9, 1.6, 1.99 })
  {
    const SurfaceMesh a = Sphere(2.0, 5);
    const SurfaceMesh b = Sphere(inner, 4);
    const MeshDistance d = CompareSurfaces(a, b);
    // Corners are on the spheres, faces inside of them by at most edge^2 / (2 R).
    const double sag = 0.012;
    EXPECT_GE(d.hausdorff + d.hausdorffError, 2.0 - inner - 1e-12);
    EXPECT_LE(d.hausdorff, 2.0 - inner + sag);
    EXPECT_NEAR(d.mean, 2.0 - inner, sag);
    EXPECT_NEAR(d.rms, 2.0 - inner, sag);
    EXPECT_NEAR(d.hausdorff95, 2.0 - inner, sag);
    // A around B: all of A outside, all of B inside.
    ASSERT_TRUE(d.signedA && d.signedB);
    EXPECT_GT(*std::min_element(d.pointDistancesA.begin(), d.pointDistancesA.end()), 0.0);
    EXPECT_LT(*std::max_element(d.pointDistancesB.begin(), d.pointDistancesB.end()), 0.0);
  }
}

TEST(MeshDistance, HausdorffAgainstDenseSamples)
{
  for (unsigned int seed = 1; seed <= 12; ++seed)
  {
    const SurfaceMesh a = Blob(seed, 2);
    const SurfaceMesh b = Blob(seed + 100, 3);
    const MeshDistance d = CompareSurfaces(a, b);
    const double sampled = SampledHausdorff(a, b, 40);
    EXPECT_GE(d.ab.hausdorff + d.ab.hausdorffError, sampled - 1e-12) << seed;
    EXPECT_LE(d.ab.hausdorff, sampled + 0.03) << seed;
    EXPECT_LE(d.ab.hausdorffError, Bound);
    EXPECT_NEAR((d.ab.at - d.ab.nearest).norm(), d.ab.hausdorff, 1e-12);
    // The other way round it is the same.
    const MeshDistance back = CompareSurfaces(b, a);
    EXPECT_EQ(back.ab.hausdorff, d.ba.hausdorff);
    EXPECT_EQ(back.hausdorff, d.hausdorff);
    EXPECT_EQ(back.ba.vertexMean, d.ab.vertexMean);
  }
}

TEST(MeshDistance, HausdorffAloneIsTheSame)
{
  MeshDistanceSettings alone;
  alone.areaMeasures = false;
  alone.pointMeasures = false;
  MeshDistanceSettings settings;
  for (unsigned int seed = 1; seed <= 25; ++seed)
  {
    SurfaceMesh a = Blob(seed, 3 + static_cast<int>(seed % 3));
    const SurfaceMesh b = seed == 5 ? a : Blob(seed + 200, 4);
    if (seed % 4 == 0)
    {
      for (std::size_t i = 0; i < a.triangles.size(); ++i)
      {
        a.triangleGroups.push_back(static_cast<std::int64_t>(i % 3));
      }
    }
    const MeshDistance d = CompareSurfaces(a, b, settings);
    const MeshDistance h = CompareSurfaces(a, b, alone);
    EXPECT_NEAR(h.ab.hausdorff, d.ab.hausdorff, Bound) << seed;
    EXPECT_NEAR(h.ba.hausdorff, d.ba.hausdorff, Bound) << seed;
    EXPECT_LE(h.hausdorffError, Bound);
    EXPECT_GE(h.hausdorff + h.hausdorffError, d.hausdorff - 1e-12);
    EXPECT_NEAR((h.ab.at - h.ab.nearest).norm(), h.ab.hausdorff, 1e-12);
    EXPECT_TRUE(std::isnan(h.ab.vertexMean));
    EXPECT_TRUE(h.pointDistancesA.empty());
    SetNumberOfThreads(3);
    const MeshDistance threads = CompareSurfaces(a, b, alone);
    SetNumberOfThreads(0);
    EXPECT_EQ(threads.hausdorff, h.hausdorff);
    EXPECT_EQ(threads.hausdorffError, h.hausdorffError);
  }
}

TEST(MeshDistance, IntegralsConverge)
{
  for (unsigned int seed = 1; seed <= 3; ++seed)
  {
    const SurfaceMesh a = Blob(seed, 3);
    const SurfaceMesh b = Blob(seed + 50, 4);
    MeshDistanceSettings settings;
    const MeshDistance d = CompareSurfaces(a, b, settings);
    settings.errorBound = 1e-5;
    settings.hausdorff = false;
    const MeshDistance fine = CompareSurfaces(a, b, settings);
    EXPECT_NEAR(d.mean, fine.mean, 2e-4);
    EXPECT_NEAR(d.rms, fine.rms, 2e-4);
    EXPECT_NEAR(d.hausdorff95, fine.hausdorff95, Bound);
    EXPECT_NEAR(d.percentile95, fine.percentile95, Bound);
    EXPECT_LE(d.mean, d.rms);
    EXPECT_LE(d.hausdorff95, d.hausdorff + d.hausdorffError);
    EXPECT_LE(std::abs(d.ab.mean - fine.ab.mean), d.ab.quadratureError + fine.ab.quadratureError);
  }
}

TEST(MeshDistance, SignsAreRightAtEdgesAndCorners)
{
  // A box with sharp edges, and points all around it and inside.
  SurfaceMesh box = Sheet(-1, 1, -2, 2, 1, 1, [](double, double) { return 1.0; });
  Append(box, Sheet(-1, 1, -2, 2, 1, 1, [](double, double) { return -1.0; }));
  for (std::size_t i = 2; i < 4; ++i)
  {
    std::swap(box.triangles[i][1], box.triangles[i][2]);
  }
  // Points 0..3 above (x, y order), 4..7 below.
  for (const auto& [p, q] : { std::pair<int, int>{ 0, 1 }, { 1, 3 }, { 3, 2 }, { 2, 0 } })
  {
    box.triangles.push_back({ p + 4, q + 4, q });
    box.triangles.push_back({ p + 4, q, p });
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  SurfaceMesh probe;
  for (int i = 0; i < 3000; ++i)
  {
    probe.points.emplace_back(uniform(random), uniform(random), uniform(random));
    probe.triangles.push_back({ i, i, i });
  }
  MeshDistanceSettings settings;
  settings.areaMeasures = false;
  settings.hausdorff = false;
  for (const bool inverted : { false, true })
  {
    const MeshDistance d = CompareSurfaces(probe, box, settings);
    ASSERT_TRUE(d.signedA);
    EXPECT_FALSE(d.signedB);
    for (int i = 0; i < 3000; ++i)
    {
      const Vector3 out = probe.points[i].cwiseAbs() - Vector3(1, 2, 1);
      const double wanted = out.maxCoeff() <= 0.0 ? out.maxCoeff() : out.cwiseMax(0.0).norm();
      ASSERT_NEAR(d.pointDistancesA[i], wanted, 1e-9) << inverted;
    }
    for (Triangle& t : box.triangles)
    {
      std::swap(t[0], t[1]);
    }
  }
  // Open: no sign.
  box.triangles.pop_back();
  const MeshDistance open = CompareSurfaces(probe, box, settings);
  EXPECT_FALSE(open.signedA);
  EXPECT_GE(*std::min_element(open.pointDistancesA.begin(), open.pointDistancesA.end()), 0.0);
}

TEST(MeshDistance, DegenerateTrianglesAndDuplicatePointsChangeNothing)
{
  std::mt19937 random(8);
  for (unsigned int seed = 1; seed <= 6; ++seed)
  {
    const SurfaceMesh a = Blob(seed, 3);
    const SurfaceMesh b = Blob(seed + 20, 3);
    const MeshDistance clean = CompareSurfaces(a, b);
    // Each triangle with corners of its own, in another order, between degenerate ones.
    SurfaceMesh soup;
    std::vector<Triangle> order = b.triangles;
    std::shuffle(order.begin(), order.end(), random);
    for (const Triangle& t : order)
    {
      const auto first = static_cast<std::int64_t>(soup.points.size());
      for (const std::int64_t point : t)
      {
        soup.points.push_back(b.points[point]);
      }
      soup.triangles.push_back({ first, first + 1, first + 2 });
      if (random() % 5 == 0)
      {
        soup.triangles.push_back({ first, first, first + 1 });
        soup.triangles.push_back({ first + 2, first + 2, first + 2 });
      }
    }
    const MeshDistance d = CompareSurfaces(a, soup);
    EXPECT_NEAR(d.hausdorff, clean.hausdorff, Bound);
    EXPECT_NEAR(d.ab.vertexMean, clean.ab.vertexMean, 1e-12);
    EXPECT_NEAR(d.mean, clean.mean, 2e-4);
    EXPECT_NEAR(d.hausdorff95, clean.hausdorff95, Bound);
    ASSERT_TRUE(d.signedA);
    for (std::size_t i = 0; i < a.points.size(); ++i)
    {
      ASSERT_NEAR(d.pointDistancesA[i], clean.pointDistancesA[i], 1e-12);
    }
  }
}

TEST(MeshDistance, SplitEdgesOfNoAreaKeepTheSigns)
{
  // A sphere where triangles of no area lie along some edges, as careless repairs leave them.
  const SurfaceMesh a = Sphere(1.05, 3, { 0.03, 0.02, 0.0 });
  SurfaceMesh b = Sphere(1.0, 3);
  const MeshDistance clean = CompareSurfaces(a, b);
  const std::size_t count = b.triangles.size();
  for (std::size_t i = 0; i < count; i += 3)
  {
    // The edge gets a middle on this side only; the gap is closed by a triangle of no area.
    const Triangle t = b.triangles[i];
    const auto middle = static_cast<std::int64_t>(b.points.size());
    b.points.emplace_back(0.5 * (b.points[t[0]] + b.points[t[1]]));
    b.triangles[i] = { t[0], middle, t[2] };
    b.triangles.push_back({ middle, t[1], t[2] });
    b.triangles.push_back({ t[0], t[1], middle });
  }
  const MeshDistance d = CompareSurfaces(a, b);
  ASSERT_TRUE(d.signedA);
  for (std::size_t i = 0; i < a.points.size(); ++i)
  {
    ASSERT_NEAR(d.pointDistancesA[i], clean.pointDistancesA[i], 1e-12);
  }
}

TEST(MeshDistance, BranchesAddUpToTheWhole)
{
  SurfaceMesh a = Sphere(1.0, 3);
  Append(a, Sphere(1.0, 3, { 5, 0, 0 }));
  SurfaceMesh b = Sphere(1.1, 3);
  Append(b, Sphere(1.4, 3, { 5, 0, 0 }));
  for (std::size_t i = 0; i < a.triangles.size(); ++i)
  {
    a.triangleGroups.push_back(i < a.triangles.size() / 2 ? 7 : 3);
  }
  b.pointGroups.assign(b.points.size() / 2, 10);
  b.pointGroups.resize(b.points.size(), 20);
  const MeshDistance d = CompareSurfaces(a, b);
  ASSERT_EQ(d.branches.size(), 4U);
  EXPECT_EQ(d.branches[0].group, 3);
  EXPECT_EQ(d.branches[1].group, 7);
  EXPECT_EQ(d.branches[3].group, 20);
  EXPECT_EQ(d.branches[3].side, 1);
  EXPECT_NEAR(d.branches[0].distance.mean, 0.4, 0.03);
  EXPECT_NEAR(d.branches[1].distance.mean, 0.1, 0.03);
  EXPECT_NEAR(d.branches[2].distance.hausdorff, 0.1, 0.04);
  EXPECT_EQ(
    d.ab.hausdorff, std::max(d.branches[0].distance.hausdorff, d.branches[1].distance.hausdorff));
  EXPECT_NEAR(d.ab.area, d.branches[0].distance.area + d.branches[1].distance.area, 1e-9);
  EXPECT_EQ(d.ab.vertices, d.branches[0].distance.vertices + d.branches[1].distance.vertices);
  EXPECT_NEAR(d.ab.vertexMean,
    0.5 * (d.branches[0].distance.vertexMean + d.branches[1].distance.vertexMean), 1e-12);
  for (const BranchDistance& branch : d.branches)
  {
    EXPECT_LE(branch.distance.hausdorffError, Bound);
  }
}

TEST(MeshDistance, EndsCutAtDifferentPlaces)
{
  // The same tube, once longer by 1 mm at one end and shorter by 0.5 mm at the other.
  const SurfaceMesh open = Tube(1.5, 0.0, 20.0, 24, 31, false);
  const SurfaceMesh capped = Tube(1.5, 0.5, 21.0, 24, 33, true);
  EXPECT_EQ(FindSurfaceEnds(open).size(), 2U);
  EXPECT_EQ(FindSurfaceEnds(capped).size(), 2U);
  for (const SurfaceEnd& end : FindSurfaceEnds(capped))
  {
    const bool top = end.centre[2] > 10.0;
    EXPECT_NEAR(end.centre[2], top ? 21.0 : 0.5, 1e-12);
    EXPECT_NEAR(end.normal[2], top ? 1.0 : -1.0, 1e-12);
    EXPECT_NEAR(end.radius, 1.5, 1e-12);
  }
  MeshDistanceSettings settings;
  const MeshDistance plain = CompareSurfaces(open, capped, settings);
  EXPECT_GT(plain.hausdorff, 0.99);
  settings.clipEnds = true;
  const MeshDistance clipped = CompareSurfaces(open, capped, settings);
  EXPECT_LT(clipped.hausdorff, 1e-9);
  EXPECT_LT(clipped.mean, 1e-9);
  // What is compared are 19.5 mm of a prism's wall, less a hundredth of the radius at both ends.
  const double wall = 24 * 2.0 * 1.5 * std::sin(M_PI / 24) * (19.5 - 2.0 * 0.015);
  EXPECT_NEAR(clipped.ab.area, wall, 1e-9);
  EXPECT_NEAR(clipped.ba.area, wall, 1e-9);
  // Points that are left out have no distance.
  EXPECT_TRUE(std::isnan(clipped.pointDistancesA[0]));
  EXPECT_FALSE(std::isnan(clipped.pointDistancesA[24 * 10]));
  EXPECT_TRUE(std::isnan(clipped.pointDistancesB.back()));
  EXPECT_LT(clipped.ab.vertices, static_cast<std::int64_t>(open.points.size()));
  EXPECT_EQ(CompareSurfaces(Tube(1.5, 0, 20, 24, 31, true), capped, settings).signedA, true);

  // A vessel that goes on for 8 mm is no matter of where it was cut.
  const MeshDistance longer =
    CompareSurfaces(Tube(1.5, 0.0, 28.0, 24, 31, false), capped, settings);
  EXPECT_NEAR(longer.ab.hausdorff, 7.0, 1e-9);

  // Caps that are not marked, on the plane of an end that is known.
  SurfaceMesh unmarked = Tube(1.5, 0.0, 20.0, 24, 31, true);
  unmarked.caps.clear();
  EXPECT_LT(CompareSurfaces(unmarked, open, settings).hausdorff, 1e-9);

  // Nothing to clip.
  const MeshDistance closed = CompareSurfaces(Sphere(1, 2), Sphere(1.1, 2), settings);
  ASSERT_EQ(closed.warnings.size(), 1U);
  EXPECT_NE(closed.warnings[0].find("No ends"), std::string::npos);
}

TEST(MeshDistance, AHoleInAWallIsNoEnd)
{
  SurfaceMesh sphere = Sphere(5.0, 4);
  sphere.triangles.resize(sphere.triangles.size() - 4);
  EXPECT_TRUE(FindSurfaceEnds(sphere).empty());
  // Nor is a sheet's rim.
  EXPECT_TRUE(FindSurfaceEnds(Sheet(0, 1, 0, 1, 3, 3, Flat)).empty());
}

TEST(MeshDistance, IsTheSameOnAnyNumberOfThreads)
{
  SurfaceMesh a = Blob(3, 4);
  SurfaceMesh b = Blob(4, 4);
  MeshDistance results[2];
  for (int n = 0; n < 2; ++n)
  {
    SetNumberOfThreads(n == 0 ? 1 : 5);
    results[n] = CompareSurfaces(a, b);
  }
  SetNumberOfThreads(0);
  const auto same = [](double x, double y) { return std::memcmp(&x, &y, sizeof(x)) == 0; };
  EXPECT_TRUE(same(results[0].hausdorff, results[1].hausdorff));
  EXPECT_TRUE(same(results[0].hausdorffError, results[1].hausdorffError));
  EXPECT_TRUE(same(results[0].mean, results[1].mean));
  EXPECT_TRUE(same(results[0].rms, results[1].rms));
  EXPECT_TRUE(same(results[0].hausdorff95, results[1].hausdorff95));
  EXPECT_TRUE(same(results[0].ab.quadratureError, results[1].ab.quadratureError));
  EXPECT_EQ(results[0].pointDistancesA, results[1].pointDistancesA);
  EXPECT_EQ(results[0].ba.at, results[1].ba.at);
}

TEST(MeshDistance, SearchThatIsStoppedSaysHowFarOff)
{
  MeshDistanceSettings settings;
  settings.maximumPieces = 1;
  settings.areaMeasures = false;
  const MeshDistance d =
    CompareSurfaces(Sheet(-2, 2, -2, 2, 1, 1, Flat), Frame(-1.0, 0.6, -0.9, 1.1), settings);
  ASSERT_EQ(d.warnings.size(), 1U);
  EXPECT_NE(d.warnings[0].find("stopped"), std::string::npos);
  EXPECT_GT(d.hausdorffError, Bound);
  EXPECT_GE(d.hausdorff + d.hausdorffError, 0.8);
}

TEST(MeshDistance, UnitsThatDifferAreNoticed)
{
  SurfaceMesh centimetres = Sphere(0.11, 3);
  const MeshDistance d = CompareSurfaces(Sphere(1.0, 3), centimetres);
  ASSERT_EQ(d.warnings.size(), 1U);
  EXPECT_NE(d.warnings[0].find("surface A is about 10 times"), std::string::npos) << d.warnings[0];
  EXPECT_TRUE(CompareSurfaces(Sphere(1.0, 3), Sphere(0.3, 3)).warnings.empty());
}

TEST(MeshDistance, RefusesBadInput)
{
  const SurfaceMesh good = Sphere(1.0, 1);
  ExpectRefusal([&] { CompareSurfaces(SurfaceMesh(), good); }, "surface A has no triangles");
  ExpectRefusal([&] { CompareSurfaces(good, SurfaceMesh()); }, "surface B has no triangles");
  SurfaceMesh bad = good;
  bad.points[3][1] = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { CompareSurfaces(good, bad); }, "surface B: point 3 is not finite");
  bad = good;
  bad.triangles[2][0] = 99;
  ExpectRefusal([&] { CompareSurfaces(bad, good); }, "triangle 2 refers to point 99 of 18");
  bad = good;
  bad.caps.resize(3);
  ExpectRefusal([&] { CompareSurfaces(bad, good); }, "marks of caps");
  bad = good;
  bad.caps.assign(bad.triangles.size(), 1);
  MeshDistanceSettings settings;
  settings.clipEnds = true;
  ExpectRefusal([&] { CompareSurfaces(bad, good, settings); }, "no triangle that is compared");
  settings = {};
  settings.errorBound = 0.0;
  ExpectRefusal([&] { CompareSurfaces(good, good, settings); }, "errorBound");
  settings = {};
  settings.endLength = std::numeric_limits<double>::infinity();
  ExpectRefusal([&] { CompareSurfaces(good, good, settings); }, "endLength");
  EXPECT_THROW(CompareSurfaces(good, good, {}, [](double) { return false; }), Cancelled);
  // A point that no triangle uses may be anything, and has no distance.
  SurfaceMesh loose = good;
  loose.points.emplace_back(Vector3::Constant(std::numeric_limits<double>::quiet_NaN()));
  const MeshDistance d = CompareSurfaces(loose, good);
  EXPECT_TRUE(std::isnan(d.pointDistancesA.back()));
  EXPECT_EQ(d.ab.vertices, 18);
}
}
