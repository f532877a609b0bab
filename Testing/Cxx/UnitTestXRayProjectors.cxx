// Line integrals against closed forms, against each other, and against plastimatch's.
#include "Attenuation.h"
#include "ContrastProjector.h"
#include "CounterRandom.h"
#include "InstrumentProjector.h"
#include "KernelChoice.h"
#include "ParallelFor.h"
#include "Refusals.h"
#include "SurfaceTestMeshes.h"
#include "TriangleProjector.h"
#include "VolumeProjector.h"
#include "XRayKernels.h"
#include "XRayTestScenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

namespace UnitTestXRayProjectors
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

double At(const LineIntegrals& image, int column, int row)
{
  return image.values.at(static_cast<std::size_t>(row) * image.columns + column);
}

LineIntegrals Instrument(const InstrumentChain& chain, const CArmGeometry& geometry)
{
  LineIntegrals image(geometry.Format().columns, geometry.Format().rows);
  AddInstrument(chain, geometry, image);
  return image;
}

LineIntegrals Surface(const SurfaceMesh& mesh, double attenuation, const CArmGeometry& geometry)
{
  LineIntegrals image(geometry.Format().columns, geometry.Format().rows);
  AddSurface(mesh.points, mesh.triangles, attenuation, geometry, image);
  return image;
}

InstrumentChain Straight(
  const Vector3& from, const Vector3& to, double radius, double attenuation, int segments = 1)
{
  InstrumentChain chain;
  for (int k = 0; k <= segments; ++k)
  {
    chain.points.emplace_back(from + (to - from) * (static_cast<double>(k) / segments));
  }
  chain.segments.assign(segments, { radius, 0.0, attenuation });
  return chain;
}

ScalarImage ImageOf(const std::vector<float>& values, const ImageGrid& grid)
{
  ScalarImage image;
  image.values = values.data();
  image.grid = grid;
  return image;
}

double Itself(double value)
{
  return value;
}

/// Sum over all pixels of value times solid angle: of a small volume, mu V / distance^2 from the source.
double Total(const LineIntegrals& image, const CArmGeometry& geometry)
{
  const DetectorFormat& format = geometry.Format();
  const double pixel = format.width / format.columns * format.height / format.rows;
  double sum = 0.0;
  for (int row = 0; row < image.rows; ++row)
  {
    for (int column = 0; column < image.columns; ++column)
    {
      const Vector3 ray = geometry.PixelPosition(column, row) - geometry.Source();
      const double squared = ray.squaredNorm();
      sum += At(image, column, row) * pixel * geometry.Pose().sourceToDetector /
        (squared * std::sqrt(squared));
    }
  }
  return sum;
}

/// The same of frusta: volume / distance^2.
double TotalOf(const std::vector<Vector3>& points, const std::vector<double>& radii,
  const CArmGeometry& geometry)
{
  double sum = 0.0;
  for (std::size_t k = 0; k + 1 < points.size(); ++k)
  {
    const double a = radii[k];
    const double b = radii[k + 1];
    const double volume = Pi / 3.0 * (a * a + a * b + b * b) * (points[k + 1] - points[k]).norm();
    sum += volume / (0.5 * (points[k] + points[k + 1]) - geometry.Source()).squaredNorm();
  }
  return sum;
}

/// Means over blocks of n x n pixels.
LineIntegrals Reduced(const LineIntegrals& image, int n)
{
  LineIntegrals result(image.columns / n, image.rows / n);
  for (int row = 0; row < image.rows; ++row)
  {
    for (int column = 0; column < image.columns; ++column)
    {
      result.values[static_cast<std::size_t>(row / n) * result.columns + column / n] +=
        static_cast<float>(At(image, column, row) / (n * n));
    }
  }
  return result;
}

struct Difference
{
  double rms = 0.0;
  double maximum = 0.0;
};

Difference Between(const LineIntegrals& a, const LineIntegrals& b)
{
  Difference difference;
  for (std::size_t k = 0; k < a.values.size(); ++k)
  {
    const double off = std::abs(double(a.values[k]) - b.values[k]);
    difference.rms += off * off / static_cast<double>(a.values.size());
    difference.maximum = std::max(difference.maximum, off);
  }
  difference.rms = std::sqrt(difference.rms);
  return difference;
}

double Maximum(const LineIntegrals& image)
{
  return *std::max_element(image.values.begin(), image.values.end());
}

/// Chest-like, in 1/mm: tissue, two lungs, heart, spine.
std::vector<Ellipsoid> Body(const Attenuation& attenuation)
{
  const auto of = [&](double hu) { return attenuation.OfHounsfield(hu); };
  return { { Vector3(0, 0, 0), Vector3(165, 115, 400), of(40) },
    { Vector3(80, -5, 10), Vector3(58, 80, 120), of(-820) },
    { Vector3(-80, -5, 10), Vector3(58, 80, 120), of(-820) },
    { Vector3(20, -30, -10), Vector3(55, 45, 60), of(50) },
    { Vector3(0, 80, 0), Vector3(20, 22, 500), of(450) } };
}

SurfaceMesh Box(const Vector3& low, const Vector3& high, int cells)
{
  const Vector3 size = high - low;
  SurfaceMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
  {
    for (const bool isHigh : { false, true })
    {
      SurfaceMesh side =
        Sheet(0.0, 1.0, 0.0, 1.0, cells, cells, [&](double, double) { return isHigh ? 1.0 : 0.0; });
      for (Vector3& p : side.points)
      {
        Vector3 turned;
        turned[axis] = p.z();
        turned[(axis + 1) % 3] = p.x();
        turned[(axis + 2) % 3] = p.y();
        p = low + size.cwiseProduct(turned);
      }
      for (Triangle& t : side.triangles)
      {
        if (!isHigh)
        {
          std::swap(t[1], t[2]);
        }
      }
      Append(mesh, side);
    }
  }
  // One point where the sides meet.
  std::map<std::array<std::int64_t, 3>, std::int64_t> places;
  std::vector<std::int64_t> number;
  std::vector<Vector3> points;
  for (const Vector3& p : mesh.points)
  {
    const Vector3 cell = (p - low).cwiseQuotient(size) * cells;
    const auto [entry, isNew] = places.try_emplace(
      { std::llround(cell.x()), std::llround(cell.y()), std::llround(cell.z()) }, points.size());
    if (isNew)
    {
      points.push_back(p);
    }
    number.push_back(entry->second);
  }
  for (Triangle& t : mesh.triangles)
  {
    t = { number[t[0]], number[t[1]], number[t[2]] };
  }
  mesh.points = points;
  return mesh;
}

/// A round tube of many sides along a chain, cut at its joints by the planes that bisect them.
SurfaceMesh MitredTube(const std::vector<Vector3>& points, double radius, int sides)
{
  SurfaceMesh mesh;
  const std::size_t count = points.size();
  Vector3 across = (points[1] - points[0]).unitOrthogonal();
  for (std::size_t k = 0; k < count; ++k)
  {
    const Vector3 before =
      (points[std::max<std::size_t>(k, 1)] - points[std::max<std::size_t>(k, 1) - 1]).normalized();
    const std::size_t next = std::min(k + 1, count - 1);
    const Vector3 after = (points[next] - points[next - 1]).normalized();
    const Vector3 normal = (before + after).normalized();
    // The last segment's profile, moved along that segment into the cut.
    const Vector3 other = before.cross(across).normalized();
    const Vector3 first = other.cross(before);
    std::vector<Vector3> ring;
    for (int s = 0; s < sides; ++s)
    {
      const double angle = 2.0 * Pi * s / sides;
      const Vector3 p = radius * (std::cos(angle) * first + std::sin(angle) * other);
      ring.emplace_back(points[k] + p - before * (p.dot(normal) / before.dot(normal)));
    }
    mesh.points.insert(mesh.points.end(), ring.begin(), ring.end());
    // Carried on into the next segment as the bisecting plane mirrors it.
    across = first - after * first.dot(after);
    const Vector3 p = ring[0] - points[k];
    across = (p - after * p.dot(after)).normalized();
  }
  const auto at = [&](std::size_t ring, int s)
  { return static_cast<std::int64_t>(ring) * sides + s % sides; };
  for (std::size_t k = 0; k + 1 < count; ++k)
  {
    for (int s = 0; s < sides; ++s)
    {
      mesh.triangles.push_back({ at(k, s), at(k, s + 1), at(k + 1, s) });
      mesh.triangles.push_back({ at(k, s + 1), at(k + 1, s + 1), at(k + 1, s) });
    }
  }
  const auto ends = static_cast<std::int64_t>(mesh.points.size());
  mesh.points.push_back(points.front());
  mesh.points.push_back(points.back());
  for (int s = 0; s < sides; ++s)
  {
    mesh.triangles.push_back({ ends, at(0, s + 1), at(0, s) });
    mesh.triangles.push_back({ ends + 1, at(count - 1, s), at(count - 1, s + 1) });
  }
  return mesh;
}
}

TEST(TriangleProjector, SlabIsItsAttenuationTimesItsThickness)
{
  // An odd number of pixels and of cells, so that rays go through corners, edges and diagonals.
  const CArmGeometry geometry = CArmAt(0.0, 0.0, 65, 65.0);
  double worst = 0.0;
  for (const int cells : { 1, 2, 4 })
  {
    const LineIntegrals image =
      Surface(Box(Vector3(-200, -10, -200), Vector3(200, 10, 200), cells), 0.02, geometry);
    for (int row = 0; row < 65; ++row)
    {
      for (int column = 0; column < 65; ++column)
      {
        const Vector3 ray = (geometry.PixelPosition(column, row) - geometry.Source()).normalized();
        const double wanted = 0.4 / ray.dot(geometry.TowardsDetector());
        worst = std::max(worst, std::abs(At(image, column, row) / wanted - 1.0));
      }
    }
  }
  Row("surface: slab of 20 mm, mu L / cos, greatest relative difference", 0.0, worst, "1e-6");
  EXPECT_LE(worst, 1e-6);
}

TEST(TriangleProjector, EveryRayLeavesAsOftenAsItEnters)
{
  // The ball's corners and edges lie on the planes that the middle column and row are in.
  for (const double primary : { 0.0, 45.0, 90.0 })
  {
    const CArmGeometry geometry = CArmAt(primary, 0.0, 129, 64.5);
    const LineIntegrals image = Surface(Sphere(20.0, 3), 1.0, geometry);
    EXPECT_LE(Maximum(image), 40.0 + 1e-4);
    EXPECT_GE(*std::min_element(image.values.begin(), image.values.end()), -1e-6);
    EXPECT_NEAR(At(image, 64, 64), 40.0, 1e-5);
    // The mirror image is the same: no line through the middle is lost or twice there.
    for (int row = 0; row < 129; ++row)
    {
      for (int column = 0; column < 129; ++column)
      {
        EXPECT_NEAR(At(image, column, row), At(image, 128 - column, row), 1e-3);
      }
    }
  }
}

TEST(TriangleProjector, SphereIsWithinTheBoundsOfItsTriangles)
{
  const Vector3 centre(12.0, -7.0, 5.0);
  constexpr double radius = 25.0;
  const SurfaceMesh mesh = Sphere(radius, 6, centre);
  double inner = radius;
  for (const Triangle& t : mesh.triangles)
  {
    const Vector3 normal =
      (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]);
    inner = std::min(inner, (mesh.points[t[0]] - centre).dot(normal.normalized()));
  }
  double worst = 0.0;
  for (const double primary : { -30.0, 20.0, 77.0 })
  {
    const CArmGeometry geometry = CArmAt(primary, 15.0, 128);
    const LineIntegrals image = Surface(mesh, 1.0, geometry);
    const Ellipsoid outside{ centre, Vector3::Constant(radius), 0.0 };
    const Ellipsoid inside{ centre, Vector3::Constant(inner), 0.0 };
    for (int row = 0; row < 128; ++row)
    {
      for (int column = 0; column < 128; ++column)
      {
        const Vector3 end = geometry.PixelPosition(column, row);
        const double exact = outside.Chord(geometry.Source(), end);
        EXPECT_LE(At(image, column, row), exact + 1e-5);
        EXPECT_GE(At(image, column, row), inside.Chord(geometry.Source(), end) - 1e-5);
        if (exact > radius)
        {
          worst = std::max(worst, std::abs(At(image, column, row) / exact - 1.0));
        }
      }
    }
  }
  Row("surface: sphere of 32768 faces, 2 sqrt(r^2 - d^2), greatest relative difference", 0.0, worst,
    "between inscribed and circumscribed sphere");
  EXPECT_LE(worst, 1e-3);
}

TEST(TriangleProjector, RefusesWhatIsNotClosed)
{
  const CArmGeometry geometry = CArmAt(0.0, 0.0, 16);
  SurfaceMesh mesh = Sphere(10.0, 1);
  mesh.triangles.pop_back();
  ExpectRefusal([&] { Surface(mesh, 1.0, geometry); }, "3 edges");
  mesh = Sphere(10.0, 1);
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  ExpectRefusal([&] { Surface(mesh, 1.0, geometry); }, "3 edges");
  ExpectRefusal([&] { Surface(Sphere(1500.0, 1), 1.0, geometry); }, "distance from the source");
  mesh = Sphere(10.0, 1);
  mesh.triangles[0][0] = 99;
  ExpectRefusal([&] { Surface(mesh, 1.0, geometry); }, "99");
  LineIntegrals other(8, 8);
  mesh = Sphere(10.0, 1);
  ExpectRefusal([&] { AddSurface(mesh.points, mesh.triangles, 1.0, geometry, other); }, "8 x 8");
}

TEST(TriangleProjector, InwardsIsOutwards)
{
  const CArmGeometry geometry = CArmAt(10.0, 0.0, 32);
  SurfaceMesh mesh = Sphere(10.0, 3);
  const LineIntegrals image = Surface(mesh, 1.0, geometry);
  for (Triangle& t : mesh.triangles)
  {
    std::swap(t[1], t[2]);
  }
  EXPECT_LE(Between(image, Surface(mesh, 1.0, geometry)).maximum, 1e-5);
}

TEST(InstrumentProjector, CylinderIsItsDiameterOverTheSine)
{
  double worst = 0.0;
  for (int k = 0; k < 30; ++k)
  {
    // In the plane of the middle ray, so turned that they have this angle.
    const double theta = (15.0 + 5.0 * k) * Degrees;
    const CArmGeometry geometry = CArmAt(-40.0 + 4.0 * k, 20.0 - 2.0 * k, 257, 50.0);
    const Vector3 way = std::cos(theta) * geometry.TowardsDetector() +
      std::sin(theta) *
        (std::cos(0.3 * k) * geometry.ColumnDirection() +
          std::sin(0.3 * k) * geometry.RowDirection());
    const LineIntegrals image =
      Instrument(Straight(-60.0 * way, 60.0 * way, 3.0, 0.5, 7), geometry);
    worst = std::max(worst, std::abs(At(image, 128, 128) / (0.5 * 6.0 / std::sin(theta)) - 1.0));
  }
  Row("instrument: cylinder, mu 2 r / sin(theta), 30 poses, greatest relative difference", 0.0,
    worst, "0.1 %");
  EXPECT_LE(worst, 1e-3);
}

TEST(InstrumentProjector, TubeIsItsWalls)
{
  const CArmGeometry geometry = CArmAt(0.0, 0.0, 513, 50.0);
  InstrumentChain chain = Straight(Vector3(0, 0, -30), Vector3(0, 0, 30), 1.0, 0.4);
  chain.segments[0].innerRadius = 0.8;
  const LineIntegrals image = Instrument(chain, geometry);
  double worst = 0.0;
  for (int column = 200; column < 313; ++column)
  {
    // The chord's mean over the pixel.
    double sum = 0.0;
    for (int k = 0; k < 200; ++k)
    {
      const Vector3 ray =
        geometry.PixelPosition(column - 0.5 + (k + 0.5) / 200.0, 256) - geometry.Source();
      const double distance = 780.0 * ray.x() / std::hypot(ray.x(), ray.y());
      const auto chord = [&](double radius)
      { return 2.0 * std::sqrt(std::max(0.0, radius * radius - distance * distance)); };
      sum += 0.4 * (chord(1.0) - chord(0.8)) / 200.0;
    }
    worst = std::max(worst, std::abs(At(image, column, 256) - sum));
  }
  Row("instrument: catheter's wall 0.2 mm, greatest difference / mu 2 (R - r)", 0.0, worst / 0.16,
    "0.5 %");
  EXPECT_LE(worst, 0.005 * 0.16);
}

TEST(InstrumentProjector, ThinWireKeepsItsIntegral)
{
  // 0.36 mm on pixels of 0.4 mm / 1.41 at the wire, in all directions and phases.
  constexpr double radius = 0.18;
  constexpr double attenuation = 0.9;
  constexpr double length = 50.0;
  double worst = 0.0;
  double worstRow = 0.0;
  for (int k = 0; k < 40; ++k)
  {
    const double angle = 4.5 * k * Degrees;
    const CArmGeometry geometry = CArmAt(0.0, 0.0, 500, 200.0);
    const Vector3 way(std::cos(angle), 0.0, std::sin(angle));
    const Vector3 shift(0.013 * k, 0.0, 0.029 * k);
    const LineIntegrals image = Instrument(
      Straight(shift - 0.5 * length * way, shift + 0.5 * length * way, radius, attenuation, 25),
      geometry);
    const InstrumentChain wire =
      Straight(shift - 0.5 * length * way, shift + 0.5 * length * way, radius, attenuation, 25);
    const double all =
      attenuation * TotalOf(wire.points, std::vector<double>(wire.points.size(), radius), geometry);
    worst = std::max(worst, std::abs(Total(image, geometry) / all - 1.0));
    // Along the wire it does not flicker: across each line of pixels there is the same.
    const bool steep = std::abs(way.z()) > std::abs(way.x());
    for (int line = 225; line < 275; ++line)
    {
      double sum = 0.0;
      for (int across = 0; across < 500; ++across)
      {
        sum += steep ? At(image, across, line) : At(image, line, across);
      }
      const double wanted = attenuation * Pi * radius * radius /
        std::max(std::abs(way.x()), std::abs(way.z())) / (0.4 * 780.0 / 1100.0);
      worstRow = std::max(worstRow, std::abs(sum / wanted - 1.0));
    }
  }
  Row("instrument: integral of a wire of 0.36 mm, pixels of 0.28 mm, 40 directions", 0.0, worst,
    "1 %");
  Row("instrument: the same in each line of pixels across it", 0.0, worstRow, "1 %");
  EXPECT_LE(worst, 0.01);
  EXPECT_LE(worstRow, 0.01);
}

TEST(InstrumentProjector, BendsAreThoseOfMitredTubes)
{
  // Against the exact surface, seen with 8 x 8 rays a pixel.
  std::vector<Vector3> points;
  for (int k = 0; k <= 24; ++k)
  {
    const double angle = 15.0 * k * Degrees;
    points.emplace_back(
      15.0 * std::cos(angle), 6.0 * std::sin(0.7 * angle), 15.0 * std::sin(angle) + 0.3 * k);
  }
  double worst = 0.0;
  double worstRms = 0.0;
  for (const double radius : { 0.5, 1.5 })
  {
    for (const double primary : { 0.0, 35.0, 80.0 })
    {
      const CArmGeometry geometry = CArmAt(primary, 10.0, 160, 64.0);
      InstrumentChain chain;
      chain.points = points;
      chain.segments.assign(24, { radius, 0.0, 1.0 });
      const LineIntegrals image = Instrument(chain, geometry);
      const LineIntegrals reference =
        Reduced(Surface(MitredTube(points, radius, 48), 1.0, CArmAt(primary, 10.0, 1280, 64.0)), 8);
      const Difference difference = Between(image, reference);
      const double maximum = Maximum(reference);
      worst = std::max(worst, difference.maximum / maximum);
      worstRms = std::max(worstRms, difference.rms / maximum);
      EXPECT_NEAR(
        Total(image, geometry) / Total(reference, CArmAt(primary, 10.0, 160, 64.0)), 1.0, 0.005);
    }
  }
  Row("instrument: bent chain against its exact surface, RMS / greatest", 0.0, worstRms, "0.5 %");
  Row("instrument: the same, greatest difference / greatest", 0.0, worst, "10 %");
  EXPECT_LE(worstRms, 0.005);
  EXPECT_LE(worst, 0.1);
}

TEST(InstrumentProjector, AlongTheViewAChordIsAsLongAsTheSegment)
{
  const CArmGeometry geometry = CArmAt(0.0, 0.0, 257, 50.0);
  double worst = 0.0;
  for (const double tilt : { 0.0, 0.01, 0.5, 2.0 })
  {
    const Vector3 way(std::sin(tilt * Degrees), -std::cos(tilt * Degrees), 0.0);
    const LineIntegrals image = Instrument(Straight(-5.0 * way, 5.0 * way, 2.0, 0.3, 5), geometry);
    worst = std::max(worst, std::abs(At(image, 128, 128) / 3.0 - 1.0));
    EXPECT_LE(Maximum(image), 3.05);
  }
  Row("instrument: cylinder of 10 mm seen along its axis, mu L", 0.0, worst, "0.2 %");
  EXPECT_LE(worst, 2e-3);
}

TEST(InstrumentProjector, SameBitsFromAllProcessors)
{
  RandomStream random(11);
  for (int k = 0; k < 50; ++k)
  {
    const auto plane = [&]
    {
      return PixelPlane{ static_cast<float>(random.Uniform(-500.0, 500.0)),
        static_cast<float>(random.Uniform(-1.0, 1.0)),
        static_cast<float>(random.Uniform(-1.0, 1.0)) };
    };
    TubePart part{};
    for (int c = 0; c < 3; ++c)
    {
      part.ray[c] = plane();
      part.cross[c] = plane();
      part.along[c] = plane();
    }
    for (int end = 0; end < 2; ++end)
    {
      part.crossCut[end] = plane();
      part.rayCut[end] = plane();
      part.outer[end] = static_cast<float>(random.Uniform(0.5, 2.0));
      part.inner[end] = k % 2 == 0 ? 0.0F : 0.4F;
    }
    part.moment = plane();
    part.length = 2.0F;
    part.inverseLength = 0.5F;
    part.step = 1.0F;
    part.maximumPixel = 0.3F;
    part.attenuation = 0.7F;
    TubePixels list;
    list.count = 203;
    for (int pixel = 0; pixel < list.count; ++pixel)
    {
      list.i[pixel] = static_cast<float>(random.Uniform(-300.0, 300.0));
      list.j[pixel] = static_cast<float>(random.Uniform(-300.0, 300.0));
      list.index[pixel] = (pixel * 7) % 203;
    }
    std::vector<float> baseline(203, 0.1F);
    std::vector<float> best(203, 0.1F);
    XRayKernelsBaseline.addTube(part, list, baseline.data());
    XRayKernelChoice().Get().addTube(part, list, best.data());
    EXPECT_EQ(baseline, best);
  }
}

TEST(InstrumentProjector, RefusesWhatIsNoInstrument)
{
  const CArmGeometry geometry = CArmAt(0.0, 0.0, 16);
  InstrumentChain chain = Straight(Vector3::Zero(), Vector3::UnitX(), 1.0, 1.0);
  chain.points.pop_back();
  ExpectRefusal([&] { Instrument(chain, geometry); }, "1 points");
  chain = Straight(Vector3::Zero(), Vector3::UnitX(), -1.0, 1.0);
  ExpectRefusal([&] { Instrument(chain, geometry); }, "outer radius");
  chain = Straight(Vector3::Zero(), Vector3(NAN, 0, 0), 1.0, 1.0);
  ExpectRefusal([&] { Instrument(chain, geometry); }, "point");
  EXPECT_EQ(Maximum(Instrument({}, geometry)), 0.0);
  // Behind the source, and points that lie on each other.
  chain = Straight(Vector3(0, 900, 0), Vector3(0, 900, 0), 1.0, 1.0, 3);
  EXPECT_EQ(Maximum(Instrument(chain, geometry)), 0.0);
}

TEST(ContrastProjector, FrustumKeepsItsVolume)
{
  double worst = 0.0;
  for (int k = 0; k < 20; ++k)
  {
    const CArmGeometry geometry = CArmAt(-60.0 + 6.0 * k, -20.0 + 2.0 * k);
    ContrastBranch branch;
    for (int s = 0; s <= 120; ++s)
    {
      branch.points.emplace_back(Vector3(0.1, 0.2, 0.5) * (s - 60.0));
      branch.radii.push_back(2.0 - s / 100.0);
    }
    branch.concentrations.assign(120, 0.6);
    LineIntegrals image(512, 512);
    AddContrast({ branch }, 0.28, geometry, image);
    const double all = 0.28 * 0.6 * TotalOf(branch.points, branch.radii, geometry);
    worst = std::max(worst, std::abs(Total(image, geometry) / all - 1.0));
  }
  Row("contrast: 120 slabs of a cone, mu c V, 20 poses, greatest relative difference", 0.0, worst,
    "0.5 %");
  EXPECT_LE(worst, 0.005);
}

TEST(ContrastProjector, SlabsHaveNoSeams)
{
  // A vessel of constant radius in half-millimetre slabs: along its middle nothing changes.
  double worst = 0.0;
  for (const double slant : { 0.0, 30.0, 60.0 })
  {
    const CArmGeometry geometry = CArmAt(0.0, 0.0, 512);
    const Vector3 way(
      0.6 * std::cos(slant * Degrees), std::sin(slant * Degrees), 0.8 * std::cos(slant * Degrees));
    ContrastBranch branch;
    for (int s = 0; s <= 100; ++s)
    {
      branch.points.emplace_back(0.5 * (s - 50) * way);
      branch.radii.push_back(1.5);
    }
    branch.concentrations.assign(100, 1.0);
    LineIntegrals image(512, 512);
    AddContrast({ branch }, 0.28, geometry, image);
    const LineIntegrals whole =
      Instrument(Straight(branch.points.front(), branch.points.back(), 1.5, 0.28), geometry);
    worst = std::max(worst, Between(image, whole).maximum / Maximum(whole));
  }
  Row("contrast: 100 slabs against one cylinder, greatest difference / greatest", 0.0, worst,
    "0.5 %");
  EXPECT_LE(worst, 0.005);
}

TEST(ContrastProjector, UnevenCenterlinesDoNotShine)
{
  // Points that jitter by a tenth of a millimetre every half one: no bright or negative spots.
  RandomStream random(3);
  ContrastBranch branch;
  for (int s = 0; s <= 160; ++s)
  {
    const double angle = s / 60.0;
    branch.points.emplace_back(30.0 * std::cos(angle) + random.Uniform(-0.1, 0.1),
      10.0 * std::sin(2.0 * angle) + random.Uniform(-0.1, 0.1),
      30.0 * std::sin(angle) + random.Uniform(-0.1, 0.1));
    branch.radii.push_back(1.5);
  }
  branch.concentrations.assign(160, 1.0);
  const CArmGeometry geometry = CArmAt(0.0, 20.0);
  LineIntegrals image(512, 512);
  AddContrast({ branch }, 1.0, geometry, image);
  EXPECT_GE(*std::min_element(image.values.begin(), image.values.end()), -0.15);
  EXPECT_LE(Maximum(image), 6.5);
  const double all = TotalOf(branch.points, branch.radii, geometry);
  EXPECT_NEAR(Total(image, geometry) / all, 1.0, 0.03);
}

TEST(ContrastProjector, BlushConservesItsContrast)
{
  double worst = 0.0;
  for (int k = 0; k < 20; ++k)
  {
    const CArmGeometry geometry = CArmAt(9.0 * k, 3.0 * k - 30.0, 64 + 32 * (k % 5));
    const ContrastBlush cloud{ Vector3(k - 10.0, 0.5 * k, 3.0), 0.3, 0.2 + 0.3 * k };
    LineIntegrals image(geometry.Format().columns, geometry.Format().rows);
    AddBlush({ cloud }, 0.28, geometry, image);
    const double all = 0.28 * 300.0 / (cloud.position - geometry.Source()).squaredNorm();
    worst = std::max(worst, std::abs(Total(image, geometry) / all - 1.0));
  }
  Row("blush: total of a cloud, mu V, 20 poses, greatest relative difference", 0.0, worst, "0.5 %");
  EXPECT_LE(worst, 0.005);

  const CArmGeometry geometry = CArmAt(0.0, 0.0, 513);
  LineIntegrals image(513, 513);
  AddBlush({ { Vector3::Zero(), 0.3, 8.0 } }, 0.28, geometry, image);
  const double centre = 0.28 * 300.0 / (2.0 * Pi * 64.0);
  Row("blush: its middle, mu V / (2 pi sigma^2)", centre, At(image, 256, 256), "0.2 %");
  EXPECT_NEAR(At(image, 256, 256) / centre, 1.0, 2e-3);
}

TEST(ContrastProjector, RefusesWhatIsNoVessel)
{
  const CArmGeometry geometry = CArmAt(0.0, 0.0, 16);
  LineIntegrals image(16, 16);
  ContrastBranch branch{ { Vector3::Zero(), Vector3::UnitX() }, { 1.0, 1.0 }, { 0.5 } };
  branch.radii.pop_back();
  ExpectRefusal([&] { AddContrast({ branch }, 1.0, geometry, image); }, "1 radii");
  branch.radii = { 1.0, 1.0 };
  branch.concentrations[0] = 1.5;
  ExpectRefusal([&] { AddContrast({ branch }, 1.0, geometry, image); }, "concentration");
  branch.concentrations[0] = NAN;
  ExpectRefusal([&] { AddContrast({ branch }, 1.0, geometry, image); }, "concentration");
  ExpectRefusal(
    [&] {
      AddBlush({ { Vector3::Zero(), 1.0, 0.0 } }, 1.0, geometry, image);
    },
    "sigma");
}

TEST(LineIntegrals, LayersAddUp)
{
  const CArmGeometry geometry = CArmAt(25.0, -15.0, 128);
  const InstrumentChain wire = Straight(Vector3(-20, 3, -30), Vector3(25, -8, 20), 0.5, 0.9, 20);
  const SurfaceMesh ball = Sphere(15.0, 4);
  const LineIntegrals a = Instrument(wire, geometry);
  const LineIntegrals b = Surface(ball, 0.02, geometry);
  LineIntegrals both = a;
  AddSurface(ball.points, ball.triangles, 0.02, geometry, both);
  double worst = 0.0;
  for (std::size_t k = 0; k < both.values.size(); ++k)
  {
    const auto lost = [&](const LineIntegrals& image)
    { return std::exp(-double(image.values[k])); };
    worst = std::max(worst, std::abs(lost(both) / (lost(a) * lost(b)) - 1.0));
  }
  Row("layers: I(A + B) I0 against I(A) I(B), greatest relative difference", 0.0, worst, "1e-6");
  EXPECT_LE(worst, 1e-6);
}

TEST(VolumeProjector, SlabIsItsAttenuationTimesItsThickness)
{
  const ImageGrid grid = CentredGrid({ 90, 24, 90 }, Vector3(3.0, 2.0, 3.0));
  const std::vector<float> values(90 * 24 * 90, 0.02F);
  const VolumeProjector projector(ImageOf(values, grid), Itself);
  const CArmGeometry geometry = CArmAt(0.0, 0.0, 128);
  const LineIntegrals image = projector.Project(geometry);
  double worst = 0.0;
  for (int row = 0; row < 128; ++row)
  {
    for (int column = 0; column < 128; ++column)
    {
      const Vector3 ray = (geometry.PixelPosition(column, row) - geometry.Source()).normalized();
      const double wanted = 0.02 * 48.0 / ray.dot(geometry.TowardsDetector());
      worst = std::max(worst, std::abs(At(image, column, row) / wanted - 1.0));
    }
  }
  Row("volume: slab of 48 mm, mu L / cos, greatest relative difference", 0.0, worst, "1e-6");
  EXPECT_LE(worst, 1e-6);
}

TEST(VolumeProjector, EllipsoidIsItsChord)
{
  const Ellipsoid body{ Vector3(5, -4, 3), Vector3(165, 115, 150), 0.0206 };
  const ImageGrid grid = CentredGrid({ 240, 174, 214 }, Vector3::Constant(1.5));
  const std::vector<float> values = SampledEllipsoids({ body }, 0.0, grid);
  const VolumeProjector projector(ImageOf(values, grid), Itself);
  const double thickest = 0.0206 * 2.0 * 165.0;
  double worst = 0.0;
  double worstRms = 0.0;
  for (const auto& [primary, secondary] : std::vector<std::pair<double, double>>{
         { 0, 0 }, { 45, 20 }, { -30, -25 }, { 90, 0 }, { 40, 45 } })
  {
    // The coronary field of view, and one that the whole body is in.
    for (const double width : { 200.0, 500.0 })
    {
      const CArmGeometry geometry = CArmAt(primary, secondary, 128, width);
      const LineIntegrals image = projector.Project(geometry);
      LineIntegrals exact(128, 128);
      for (int row = 0; row < 128; ++row)
      {
        for (int column = 0; column < 128; ++column)
        {
          const double wanted =
            0.0206 * body.Chord(geometry.Source(), geometry.PixelPosition(column, row));
          exact.values[row * 128 + column] = static_cast<float>(wanted);
          if (wanted > 0.5 * thickest)
          {
            worst = std::max(worst, std::abs(At(image, column, row) / wanted - 1.0));
          }
        }
      }
      worstRms = std::max(worstRms, Between(image, exact).rms / thickest);
    }
  }
  Row("volume: ellipsoid at 1.5 mm, mu chord, 5 poses, greatest relative difference inside", 0.0,
    worst, "0.5 %");
  Row("volume: the same, RMS over the image with its edges / greatest", 0.0, worstRms, "0.5 %");
  EXPECT_LE(worst, 0.005);
  EXPECT_LE(worstRms, 0.005);
}

TEST(VolumeProjector, IsTheIntegralOfTheTrilinearImage)
{
  // Smooth waves on uneven voxels, turned; the reference goes through the zeros around it in small steps.
  const Matrix3 turned = (Eigen::AngleAxisd(0.4, Vector3(1, 2, 3).normalized())).toRotationMatrix();
  const ImageGrid grid = CentredGrid({ 40, 36, 30 }, Vector3(2.0, 2.5, 3.0), turned);
  std::vector<float> values;
  for (int k = 0; k < 30; ++k)
  {
    for (int j = 0; j < 36; ++j)
    {
      for (int i = 0; i < 40; ++i)
      {
        values.push_back(static_cast<float>(
          0.02 * (1.0 + 0.5 * std::sin(0.5 * i) * std::cos(0.4 * j) * std::sin(0.6 * k + 1.0))));
      }
    }
  }
  const VolumeProjector projector(ImageOf(values, grid), Itself);
  const auto value = [&](int i, int j, int k)
  {
    return i < 0 || j < 0 || k < 0 || i >= 40 || j >= 36 || k >= 30 ? 0.0
                                                                    : values[(k * 36 + j) * 40 + i];
  };
  const auto trilinear = [&](const Vector3& world)
  {
    const Vector3 p = (turned.transpose() * (world - grid.origin)).cwiseQuotient(grid.spacing);
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner)
    {
      double weight = 1.0;
      int index[3];
      for (int a = 0; a < 3; ++a)
      {
        const double low = std::floor(p[a]);
        const int up = (corner >> a) & 1;
        index[a] = static_cast<int>(low) + up;
        weight *= up != 0 ? p[a] - low : 1.0 - (p[a] - low);
      }
      sum += weight * value(index[0], index[1], index[2]);
    }
    return sum;
  };
  double rms = 0.0;
  int count = 0;
  for (const double primary : { 0.0, 50.0, 100.0, -140.0 })
  {
    const CArmGeometry geometry = CArmAt(primary, 20.0, 24, 60.0);
    const LineIntegrals image = projector.Project(geometry);
    for (int row = 0; row < 24; ++row)
    {
      for (int column = 0; column < 24; ++column)
      {
        const Vector3 way = geometry.PixelPosition(column, row) - geometry.Source();
        const Vector3 step = 0.05 * way.normalized();
        double sum = 0.0;
        for (int s = 0; s < 4000; ++s)
        {
          sum +=
            0.05 * trilinear(geometry.Source() + (780.0 - 100.0) / 0.05 * step + (s + 0.5) * step);
        }
        rms += std::pow(At(image, column, row) / sum - 1.0, 2);
        ++count;
      }
    }
  }
  rms = std::sqrt(rms / count);
  Row(
    "volume: trilinear integral in steps of 0.05 mm, turned uneven voxels, RMS", 0.0, rms, "0.3 %");
  EXPECT_LE(rms, 0.003);
}

TEST(VolumeProjector, DoesNotDependOnAxesOfTheImage)
{
  // The same body on a grid of other axes, handedness and spacing.
  const std::vector<Ellipsoid> body = Body(Attenuation());
  const ImageGrid straight = CentredGrid({ 120, 90, 80 }, Vector3(3.0, 3.0, 3.0));
  Matrix3 turned;
  turned << 0, 0, -1, 1, 0, 0, 0, 1, 0;
  const ImageGrid other = CentredGrid({ 90, 80, 120 }, Vector3(3.0, 3.0, 3.0), turned);
  const std::vector<float> a = SampledEllipsoids(body, 0.0, straight);
  const std::vector<float> b = SampledEllipsoids(body, 0.0, other);
  const VolumeProjector projectorA(ImageOf(a, straight), Itself);
  const VolumeProjector projectorB(ImageOf(b, other), Itself);
  for (const double primary : { 0.0, 45.0, 90.0, 180.0 })
  {
    const CArmGeometry geometry = CArmAt(primary, 20.0, 64);
    const LineIntegrals image = projectorA.Project(geometry);
    EXPECT_LE(Between(image, projectorB.Project(geometry)).maximum, 2e-4 * Maximum(image));
  }
}

TEST(VolumeProjector, SameBitsFromThreadsTilesAndProcessors)
{
  const std::vector<Ellipsoid> body = Body(Attenuation());
  const ImageGrid grid = CentredGrid({ 90, 65, 60 }, Vector3(4.0, 4.0, 5.0));
  const std::vector<float> values = SampledEllipsoids(body, 0.0, grid);
  const VolumeProjector projector(ImageOf(values, grid), Itself);
  ASSERT_TRUE(XRayKernelChoice().Select(Instructions::Baseline));
  const VolumeProjector baseline(ImageOf(values, grid), Itself);
  XRayKernelChoice().Select(Instructions::Widest);
  for (const double primary : { 0.0, 44.0, 90.0 })
  {
    CArmPose pose;
    pose.primary = primary * Degrees;
    const CArmGeometry geometry(pose, { 203, 101, 200.0, 100.0 });
    SetNumberOfThreads(1);
    const LineIntegrals one = projector.Project(geometry);
    SetNumberOfThreads(4);
    const LineIntegrals four = projector.Project(geometry);
    SetNumberOfThreads(0);
    LineIntegrals pieces(203, 101);
    for (int row = 0; row < 101; row += 13)
    {
      for (int column = 0; column < 203; column += 37)
      {
        projector.ProjectRectangle(geometry, { column, row, 37, 13 }, pieces);
      }
    }
    EXPECT_EQ(one.values, four.values);
    EXPECT_EQ(one.values, pieces.values);
    EXPECT_EQ(one.values, baseline.Project(geometry).values);
  }
}

TEST(VolumeProjector, OnlyWhatIsBetweenSourceAndDetectorCounts)
{
  // The volume reaches behind the source, and behind the detector.
  const ImageGrid grid = CentredGrid({ 20, 200, 20 }, Vector3(10.0, 10.0, 10.0));
  const std::vector<float> values(20 * 200 * 20, 0.001F);
  const VolumeProjector projector(ImageOf(values, grid), Itself);
  CArmPose pose;
  pose.sourceToIsocentre = 500.0;
  pose.sourceToDetector = 800.0;
  const CArmGeometry geometry(pose, { 9, 9, 20.0, 20.0 });
  EXPECT_NEAR(At(projector.Project(geometry), 4, 4), 0.8, 0.011);
}

TEST(VolumeProjector, PixelsOfAnySizeHaveTheirRay)
{
  // Eight pixels over two metres: neighbours' rays follow different axes.
  const Ellipsoid ball{ Vector3::Zero(), Vector3::Constant(90.0), 0.02 };
  const ImageGrid grid = CentredGrid({ 100, 100, 100 }, Vector3::Constant(2.0));
  const std::vector<float> values = SampledEllipsoids({ ball }, 0.0, grid);
  const VolumeProjector projector(ImageOf(values, grid), Itself);
  CArmPose pose;
  pose.sourceToIsocentre = 100.0;
  pose.sourceToDetector = 400.0;
  const CArmGeometry geometry(pose, { 9, 9, 2000.0, 2000.0 });
  const LineIntegrals image = projector.Project(geometry);
  for (int row = 0; row < 9; ++row)
  {
    for (int column = 0; column < 9; ++column)
    {
      const double wanted =
        0.02 * ball.Chord(geometry.Source(), geometry.PixelPosition(column, row));
      EXPECT_NEAR(At(image, column, row), wanted, 0.05) << column << ' ' << row;
    }
  }
}

TEST(VolumeProjector, EmptySpaceIsPassedOverWithoutLoss)
{
  // A block that is never negligible, against one that is: the walls of a box around nothing.
  const ImageGrid grid = CentredGrid({ 64, 64, 64 }, Vector3::Constant(3.0));
  std::vector<float> values(64 * 64 * 64, 0.0F);
  std::vector<float> faint(values.size(), 0.0F);
  for (int k = 0; k < 64 * 64 * 64; ++k)
  {
    const int i = k % 64;
    const bool wall = i == 3 || i == 61 || k / 64 % 64 == 40;
    values[k] = wall ? 0.05F : 0.0F;
    faint[k] = wall ? 0.05F : 1e-6F;
  }
  VolumeProjectorSettings settings;
  settings.negligible = 2e-6;
  const CArmGeometry geometry = CArmAt(30.0, 15.0, 96);
  const LineIntegrals with = VolumeProjector(ImageOf(values, grid), Itself).Project(geometry);
  const LineIntegrals without = VolumeProjector(ImageOf(faint, grid), Itself).Project(geometry);
  const LineIntegrals skipped =
    VolumeProjector(ImageOf(faint, grid), Itself, settings).Project(geometry);
  EXPECT_GT(Maximum(with), 0.1);
  EXPECT_LE(Between(with, without).maximum, 6e-4);
  EXPECT_LE(Between(with, skipped).maximum, 3e-4);
}

TEST(VolumeProjector, WholeNumbersAreAsGoodAsRealOnes)
{
  const Attenuation attenuation;
  const ImageGrid grid = CentredGrid({ 40, 40, 40 }, Vector3::Constant(4.0));
  std::vector<std::int16_t> hounsfield;
  std::vector<float> real;
  RandomStream random(5);
  for (int k = 0; k < 40 * 40 * 40; ++k)
  {
    hounsfield.push_back(static_cast<std::int16_t>(random.Uniform(-1024.0, 1500.0)));
    real.push_back(hounsfield.back());
  }
  ScalarImage image;
  image.values = hounsfield.data();
  image.grid = grid;
  const auto of = [&](double hu) { return attenuation.OfHounsfield(hu); };
  const CArmGeometry geometry = CArmAt(10.0, 10.0, 64);
  EXPECT_EQ(VolumeProjector(image, of).Project(geometry).values,
    VolumeProjector(ImageOf(real, grid), of).Project(geometry).values);
}

TEST(VolumeProjector, RefusesWhatIsNoVolume)
{
  const std::vector<float> values(27, 1.0F);
  ImageGrid grid = CentredGrid({ 3, 3, 3 }, Vector3::Ones());
  const auto make = [&] { VolumeProjector(ImageOf(values, grid), Itself); };
  make();
  ExpectRefusal([&] { VolumeProjector(ImageOf(values, grid), [](double) { return -1.0; }); },
    "attenuation of the value");
  ExpectRefusal([&] { VolumeProjector(ImageOf(values, grid), [](double) { return NAN; }); },
    "attenuation of the value");
  grid.spacing.x() = 0.0;
  ExpectRefusal(make, "spacing");
  grid = CentredGrid({ 3, 3, 3 }, Vector3::Ones());
  grid.direction(0, 0) = 2.0;
  ExpectRefusal(make, "perpendicular");
  grid = CentredGrid({ 3, 3, 3 }, Vector3::Ones());
  grid.extent[1] = -1;
  ExpectRefusal(make, "voxels");
  grid.extent = { 0, 40000, 0, 40000, 0, 40000 };
  ExpectRefusal(make, "voxels");
  grid = CentredGrid({ 3, 3, 3 }, Vector3::Ones());
  const VolumeProjector projector(ImageOf(values, grid), Itself);
  LineIntegrals other(4, 4);
  ExpectRefusal(
    [&] {
      projector.ProjectRectangle(CArmAt(0, 0, 8), { 0, 0, 8, 8 }, other);
    },
    "4 x 4");
  EXPECT_THROW(projector.Project(CArmAt(0, 0, 64), [](double) { return false; }), Cancelled);
}

TEST(LineIntegrals, ResamplingKeepsALinearRamp)
{
  LineIntegrals image(16, 8);
  for (int k = 0; k < 16 * 8; ++k)
  {
    image.values[k] = static_cast<float>((k % 16 + 0.5) / 16.0 + 2.0 * (k / 16 + 0.5) / 8.0);
  }
  const LineIntegrals fine = Resampled(image, 64, 32);
  for (int row = 4; row < 28; ++row)
  {
    for (int column = 4; column < 60; ++column)
    {
      EXPECT_NEAR(At(fine, column, row), (column + 0.5) / 64.0 + 2.0 * (row + 0.5) / 32.0, 1e-5);
    }
  }
  ExpectRefusal([] { Resampled(LineIntegrals(), 4, 4); }, "without pixels");
}

namespace
{
/// One 32-bit number a voxel, nothing compressed.
void WriteMetaImage(
  const std::string& path, const std::vector<float>& values, const ImageGrid& grid)
{
  std::ofstream file(path, std::ios::binary);
  file.precision(17);
  file << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
       << "CompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = "
       << grid.origin.transpose() << "\nElementSpacing = " << grid.spacing.transpose()
       << "\nDimSize = " << grid.extent[1] + 1 << ' ' << grid.extent[3] + 1 << ' '
       << grid.extent[5] + 1 << "\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
  file.write(reinterpret_cast<const char*>(values.data()),
    static_cast<std::streamsize>(values.size() * sizeof(float)));
}

LineIntegrals ReadPortableFloatMap(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  std::string magic;
  int columns = 0;
  int rows = 0;
  double scale = 0.0;
  file >> magic >> columns >> rows >> scale;
  file.get();
  EXPECT_EQ(magic, "Pf");
  EXPECT_LT(scale, 0.0) << "little endian";
  LineIntegrals image(columns, rows);
  file.read(reinterpret_cast<char*>(image.values.data()),
    static_cast<std::streamsize>(image.values.size() * sizeof(float)));
  EXPECT_TRUE(file.good());
  return image;
}

std::string Words(const Vector3& v)
{
  std::string words;
  for (int k = 0; k < 3; ++k)
  {
    char word[40];
    std::snprintf(word, sizeof(word), "%.15g ", v[k]);
    words += word;
  }
  return "'" + words + "'";
}

/**
 * plastimatch 1.9.4, `plastimatch drr`, found out with a box and a marker off its centre:
 * --sad, --sid: mm from the source to the isocentre (-o) and to the detector, which is perpendicular to the normal.
 * -n: points from the isocentre to the source. --vup: to the top row. Columns go along vup x n, so as seen from the
 * source; ours are the other way round. -r, -z: columns then rows (its help says "row col"), pixels and mm; the middle
 * of the image is on the axis. -P none: voxels are attenuation in 1/mm instead of HU. -i exact: each voxel is a box of one value, with the exact way through it
 * (Siddon). -t pfm: rows from the top, 32-bit little endian; the integral with mm turned into cm: a tenth of ours.
 */
LineIntegrals Plastimatch(
  const std::string& volume, const CArmGeometry& geometry, const std::string& prefix)
{
  const CArmPose& pose = geometry.Pose();
  const DetectorFormat& format = geometry.Format();
  const auto pair = [](double a, double b)
  { return "'" + std::to_string(a) + " " + std::to_string(b) + "'"; };
  const std::string command = "plastimatch drr -A cpu -i exact -P none -t pfm -n " +
    Words(-geometry.TowardsDetector()) + " --vup " + Words(-geometry.RowDirection()) + " -o " +
    Words(pose.isocentre) + " --sad " + std::to_string(pose.sourceToIsocentre) + " --sid " +
    std::to_string(pose.sourceToDetector) + " -r '" + std::to_string(format.columns) + " " +
    std::to_string(format.rows) + "' -z " + pair(format.width, format.height) + " -O '" + prefix +
    "' '" + volume + "' >/dev/null 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << command; // NOLINT(cert-env33-c)
  LineIntegrals image = ReadPortableFloatMap(prefix + "0000.pfm");
  for (int row = 0; row < image.rows; ++row)
  {
    const auto first = image.values.begin() + static_cast<std::ptrdiff_t>(row) * image.columns;
    std::reverse(first, first + image.columns);
  }
  for (float& value : image.values)
  {
    value *= 10.0F;
  }
  return image;
}

/// Zero-normalised cross-correlation.
double Correlation(const LineIntegrals& a, const LineIntegrals& b)
{
  const auto count = static_cast<double>(a.values.size());
  const auto mean = [&](const LineIntegrals& image)
  { return std::accumulate(image.values.begin(), image.values.end(), 0.0) / count; };
  const double meanA = mean(a);
  const double meanB = mean(b);
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t k = 0; k < a.values.size(); ++k)
  {
    ab += (a.values[k] - meanA) * (b.values[k] - meanB);
    aa += std::pow(a.values[k] - meanA, 2);
    bb += std::pow(b.values[k] - meanB, 2);
  }
  return ab / std::sqrt(aa * bb);
}
}

TEST(VolumeProjector, IsPlastimatchs)
{
  if (std::system("plastimatch --version >/dev/null 2>&1") != 0) // NOLINT(cert-env33-c)
  {
    GTEST_SKIP() << "plastimatch is not installed";
  }
  const ImageGrid grid = CentredGrid({ 180, 130, 160 }, Vector3::Constant(2.0));
  const std::vector<float> values = SampledEllipsoids(Body(Attenuation()), 0.0, grid);
  const std::string folder = testing::TempDir();
  const std::string volume = folder + "xray-body.mha";
  WriteMetaImage(volume, values, grid);
  const VolumeProjector projector(ImageOf(values, grid), Itself);
  double worstRms = 0.0;
  double worstCorrelation = 1.0;
  for (const auto& [primary, secondary] :
    std::vector<std::pair<double, double>>{ { 0, 0 }, { 45, 20 }, { -30, -25 }, { 90, 0 } })
  {
    const CArmGeometry geometry = CArmAt(primary, secondary, 128, 200.0, Vector3(10.0, -15.0, 8.0));
    const LineIntegrals ours = projector.Project(geometry);
    const LineIntegrals theirs = Plastimatch(volume, geometry, folder + "xray-drr-");
    ASSERT_EQ(theirs.values.size(), ours.values.size());
    const double mean = std::accumulate(theirs.values.begin(), theirs.values.end(), 0.0) /
      static_cast<double>(theirs.values.size());
    worstRms = std::max(worstRms, Between(ours, theirs).rms / mean);
    worstCorrelation = std::min(worstCorrelation, Correlation(ours, theirs));
    // A control: mirrored, it is not the same picture.
    LineIntegrals mirrored = theirs;
    std::reverse(mirrored.values.begin(), mirrored.values.end());
    EXPECT_LT(Correlation(ours, mirrored), 0.95);
  }
  Row("volume: against plastimatch drr, 4 poses, RMS / mean", 0.0, worstRms, "1 %");
  Row("volume: the same, least zero-normalised cross-correlation", 1.0, worstCorrelation, "0.995");
  EXPECT_LE(worstRms, 0.01);
  EXPECT_GE(worstCorrelation, 0.995);
  for (const char* name : { "xray-body.mha", "xray-drr-0000.pfm", "xray-drr-0000.txt" })
  {
    std::remove((folder + name).c_str());
  }
}
}
