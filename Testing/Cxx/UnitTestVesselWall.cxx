// The moving wall against what is known of tubes, and against a search through all triangles.

#include "KernelChoice.h"
#include "NearestOnTriangle.h"
#include "Refusals.h"
#include "TriangleBvh.h"
#include "VesselWall.h"
#include "WallKernels.h"
#include "WallTestMeshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace UnitTestVesselWall
{
using namespace coronary;

namespace
{
constexpr double Radius = 1.5;
constexpr int Around = 30;

struct Mesh
{
  WallTopology topology;
  std::vector<Vector3> points;
};

Mesh Tube(double radius = Radius, double length = 30.0)
{
  Mesh mesh;
  AppendTube(
    mesh.topology, mesh.points, 0.0, radius, length, Around, static_cast<int>(length / 0.3));
  return mesh;
}

/// A bumpy ball that turns, swells and travels.
Mesh Ball()
{
  Mesh mesh;
  AppendBall(mesh.topology, mesh.points, 14,
    [](const Vector3& d)
    {
      return Vector3(
        (3.0 + 0.5 * std::sin(5.0 * d[0] + 3.0 * d[1]) + 0.3 * std::sin(9.0 * d[2])) * d);
    });
  return mesh;
}

Vector3 Moved(const Vector3& p, double time)
{
  const double s = std::sin(2.0 * M_PI * time);
  return Eigen::AngleAxisd(0.3 * s, Vector3(1.0, 2.0, 0.5).normalized()) *
    Vector3((1.0 + 0.2 * s) * p[0], p[1] * (1.0 - 0.1 * s), p[2] + 0.05 * s * p[0] * p[1]) +
    Vector3(6.0 * s, 3.0 * std::cos(4.0 * M_PI * time), -2.0 * s);
}

std::vector<Vector3> MovedAll(const std::vector<Vector3>& points, double time)
{
  std::vector<Vector3> moved;
  for (const Vector3& p : points)
  {
    moved.push_back(Moved(p, time));
  }
  return moved;
}

double BruteForce(const Mesh& mesh, const std::vector<Vector3>& points, const Vector3& p,
  double range, std::vector<std::int64_t>& within)
{
  double best = std::numeric_limits<double>::infinity();
  within.clear();
  for (std::size_t t = 0; t < mesh.topology.triangles.size(); ++t)
  {
    const Triangle& c = mesh.topology.triangles[t];
    const double distance =
      std::sqrt(NearestOnTriangle(p, points[c[0]], points[c[1]], points[c[2]]).squaredDistance);
    best = std::min(best, distance);
    if (distance <= range)
    {
      within.push_back(static_cast<std::int64_t>(t));
    }
  }
  return best;
}

/// Radial place in a tube.
Vector3 InTube(double r, double angle, double z)
{
  return { r * std::cos(angle), r * std::sin(angle), z };
}
}

TEST(VesselWall, NearestAndRangesEqualASearchThroughAllTriangles)
{
  const Mesh mesh = Ball();
  VesselWall wall(mesh.topology, MovedAll(mesh.points, -0.05));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<std::int64_t> expected;
  std::vector<std::int64_t> found;
  for (int phase = 0; phase < 20; ++phase)
  {
    wall.BeginFrame(MovedAll(mesh.points, phase / 20.0), 0.04);
    wall.SetTime(0.04 * unit(random));
    const std::vector<Vector3> points = wall.Points();
    for (int q = 0; q < 60; ++q)
    {
      const Vector3 p = points[static_cast<std::size_t>(unit(random) * points.size())] +
        (q % 2 == 0 ? 3.0 : 0.2) * Vector3(normal(random), normal(random), normal(random));
      const double range = std::abs(normal(random));
      const double best = BruteForce(mesh, points, p, range, expected);
      const WallPlace place = wall.Closest(p);
      ASSERT_NEAR(std::abs(place.distance), best, 1e-9);
      ASSERT_NEAR((place.point - p).norm(), best, 1e-9);
      const Triangle& t = mesh.topology.triangles[place.triangle];
      ASSERT_NEAR((place.weights[0] * points[t[0]] + place.weights[1] * points[t[1]] +
                    place.weights[2] * points[t[2]] - place.point)
                    .norm(),
        0.0, 1e-9);
      wall.Within(p, range, found);
      ASSERT_EQ(found, expected);
    }
  }
}

TEST(VesselWall, SignIsThatOfTheSideEverywhere)
{
  const Mesh mesh = Ball();
  VesselWall wall(mesh.topology, mesh.points);
  const TriangleBvh other(mesh.points, mesh.topology.triangles);
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0.0, 2.5);
  int inside = 0;
  for (int q = 0; q < 4000; ++q)
  {
    const Vector3 p(normal(random), normal(random), normal(random));
    const WallPlace place = wall.Closest(p);
    ASSERT_EQ(place.distance > 0.0, other.Winding(p) == 1) << p.transpose();
    inside += place.distance > 0.0;
  }
  EXPECT_GT(inside, 400);
  EXPECT_LT(inside, 3600);
}

TEST(VesselWall, GapAndNormalInATube)
{
  const Mesh mesh = Tube();
  VesselWall wall(mesh.topology, mesh.points);
  // A facet is nearer to the axis than the cylinder by this at most.
  const double sagitta = Radius * (1.0 - std::cos(M_PI / Around));
  SampleContacts contacts;
  ContactSample sample;
  sample.radius = 0.18;
  sample.friction = 0.5;
  for (int k = 0; k < 2000; ++k)
  {
    sample.index = k % 7;
    const double r = 1.1 + 0.45 * std::fmod(0.618034 * k, 1.0); // up to 0.05 mm behind the wall
    const double angle = 0.37 * k;
    sample.centre = InTube(r, angle, 5.0 + 0.01 * k);
    wall.Find(sample, 0.4, contacts);
    ASSERT_EQ(contacts.count, 1) << k;
    const ContactPlane& plane = contacts.plane[0];
    EXPECT_LE(plane.gap, Radius - r - 0.18 + 1e-9);
    EXPECT_GE(plane.gap, Radius - sagitta - r - 0.18 - 1e-9);
    EXPECT_NEAR(plane.normal.norm(), 1.0, 1e-12);
    EXPECT_GT(plane.normal.dot(-InTube(1.0, angle, 0.0)), std::cos(0.06)) << k;
    EXPECT_EQ(plane.friction, 0.5);
    EXPECT_EQ(plane.stiffness, 20.0);
    EXPECT_EQ(plane.wallVelocity.norm(), 0.0);
    WallPlace place;
    EXPECT_EQ(wall.Outside(sample, place), plane.gap + 0.18 < 0.0) << k;
    EXPECT_EQ(wall.BranchAt(sample), 0);
  }
  // The axis: nothing within reach.
  sample.centre = Vector3(0.0, 0.0, 15.0);
  wall.Find(sample, 0.4, contacts);
  EXPECT_EQ(contacts.count, 0);
}

/// A normal that jumps is felt as chatter: it turns as the sample slides, and no faster than facets are long.
TEST(VesselWall, NormalDoesNotJumpFromFacetToFacet)
{
  const Mesh mesh = Tube();
  VesselWall wall(mesh.topology, mesh.points);
  SampleContacts contacts;
  ContactSample sample;
  sample.radius = 0.18;
  for (const double r : { 1.2, 1.3, 1.45, 1.495 })
  {
    Vector3 before = Vector3::Zero();
    double worst = 0.0;
    constexpr int steps = 8000;
    for (int k = 0; k < steps; ++k)
    {
      const double angle = 2.0 * M_PI * k / steps;
      sample.centre = InTube(r, angle, 5.0 + 4.0 * k / steps);
      wall.Find(sample, 0.3, contacts);
      ASSERT_EQ(contacts.count, 1);
      if (k > 0)
      {
        worst = std::max(worst, (contacts.plane[0].normal - before).norm());
      }
      before = contacts.plane[0].normal;
    }
    // An even turn is 2 pi / 8000 a step, and facets' own normals jump by 2 pi / 30.
    EXPECT_LT(worst, 6.0 * 2.0 * M_PI / steps) << r;
  }
}

TEST(VesselWall, VelocityOfAShakenTubeIsExact)
{
  const Mesh mesh = Tube();
  VesselWall wall(mesh.topology, mesh.points);
  constexpr double seconds = 1.0 / 60.0;
  SampleContacts contacts;
  Vector3 shift = Vector3::Zero();
  for (int frame = 0; frame < 30; ++frame)
  {
    const Vector3 next(
      1.7 * std::sin(0.3 * frame), 0.9 * std::cos(0.5 * frame), -0.4 * std::sin(frame));
    std::vector<Vector3> points = mesh.points;
    for (Vector3& p : points)
    {
      p += next;
    }
    wall.BeginFrame(points, seconds);
    for (int tick = 0; tick < 33; ++tick)
    {
      const double f = tick / 33.0;
      wall.SetTime(f * seconds);
      for (int i = 0; i < 10; ++i)
      {
        ContactSample sample;
        sample.index = i;
        sample.radius = 0.18;
        sample.centre = InTube(1.3, i, 5.0 + 2.0 * i) + (1.0 - f) * shift + f * next;
        wall.Find(sample, 0.1, contacts);
        ASSERT_EQ(contacts.count, 1);
        ASSERT_NEAR((contacts.plane[0].wallVelocity - (next - shift) / seconds).norm(), 0.0, 1e-9);
        ASSERT_NEAR(contacts.plane[0].gap, 0.02, 0.012);
      }
    }
    shift = next;
  }
}

/// What is kept never shows: as an object that has seen nothing before.
TEST(VesselWall, KeptTrianglesGiveWhatAFreshWallGives)
{
  Mesh mesh = Tube(1.0, 24.0);
  AppendTube(mesh.topology, mesh.points, 6.0, 0.4, 24.0, 12, 80);
  constexpr double seconds = 1.0 / 60.0;
  const std::vector<Vector3> begin = MovedAll(mesh.points, -1.0 / 48.0);
  VesselWall kept(mesh.topology, begin);
  kept.BeginFrame(MovedAll(mesh.points, 0.0), seconds);
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  constexpr int samples = 12;
  std::vector<Vector3> rest;
  for (int i = 0; i < samples; ++i)
  {
    rest.emplace_back(
      i < 8 ? Vector3(0.1 * i, 0.0, 3.0 + 1.5 * i) : Vector3(6.0, 0.02 * i, 2.0 * i));
  }
  const Mesh small = Tube(1.0, 3.0);
  int planes = 0;
  int outside = 0;
  int two = 0;
  for (int frame = 1; frame <= 14; ++frame)
  {
    const std::vector<Vector3> now = MovedAll(mesh.points, (frame - 1) / 48.0);
    const std::vector<Vector3> next = MovedAll(mesh.points, frame / 48.0);
    kept.BeginFrame(next, seconds);
    for (int tick = 0; tick < 33; ++tick)
    {
      const double f = tick / 33.0;
      kept.SetTime(f * seconds);
      const bool compare = tick % 4 == frame % 4;
      VesselWall fresh(compare ? mesh.topology : small.topology, compare ? begin : small.points);
      if (compare)
      {
        fresh.BeginFrame(now, seconds);
        fresh.BeginFrame(next, seconds);
        fresh.SetTime(f * seconds);
      }
      for (int i = 0; i < samples; ++i)
      {
        // A walk that is kept near to the axis, and now and then a step.
        Vector3& at = rest[i];
        at += 0.02 * Vector3(normal(random), normal(random), 0.5 * normal(random));
        const double x = i < 8 ? 0.0 : 6.0;
        const double far = (i < 8 ? 1.05 : 0.45) / std::max(1e-9, std::hypot(at[0] - x, at[1]));
        if (far < 1.0)
        {
          at[0] = x + far * (at[0] - x);
          at[1] *= far;
        }
        ContactSample sample;
        sample.index = 100 * i;
        sample.radius = i % 3 == 0 ? 0.3 : 0.15;
        sample.centre = (1.0 - f) * Moved(at, (frame - 1) / 48.0) + f * Moved(at, frame / 48.0);
        SampleContacts a;
        kept.Find(sample, 0.2, a);
        planes += a.count;
        two += a.count == 2;
        if (!compare)
        {
          continue;
        }
        SampleContacts b;
        fresh.Find(sample, 0.2, b);
        ASSERT_EQ(a.count, b.count) << frame << " " << tick << " " << i;
        for (int k = 0; k < a.count; ++k)
        {
          ASSERT_NEAR(a.plane[k].gap, b.plane[k].gap, 1e-12);
          ASSERT_NEAR((a.plane[k].normal - b.plane[k].normal).norm(), 0.0, 1e-9);
          ASSERT_NEAR((a.plane[k].wallVelocity - b.plane[k].wallVelocity).norm(), 0.0, 1e-6);
        }
        WallPlace here;
        WallPlace there;
        const bool out = kept.Outside(sample, here);
        ASSERT_EQ(out, fresh.Outside(sample, there));
        outside += out;
        if (out)
        {
          ASSERT_NEAR((here.point - there.point).norm(), 0.0, 1e-9);
          ASSERT_LT(here.distance, 0.0);
        }
      }
    }
  }
  EXPECT_GT(planes, 500);
  EXPECT_GT(two, 20);
  EXPECT_GT(outside, 20);
  // Less than one search in five calls, or nothing is kept.
  EXPECT_LT(kept.NumberOfSearches(), 14u * 33u * samples / 5u);
}

TEST(VesselWall, DoesNotJumpToTheNeighbouringVessel)
{
  Mesh mesh;
  AppendTube(mesh.topology, mesh.points, 0.0, 1.0, 20.0, 24, 70);
  AppendTube(mesh.topology, mesh.points, 2.2, 1.0, 20.0, 24, 70);
  VesselWall wall(mesh.topology, mesh.points);
  SampleContacts contacts;
  ContactSample sample;
  sample.radius = 0.1;
  sample.index = 3;
  // From the first one's axis to that of the second one.
  for (double x = 0.0; x < 2.2; x += 0.01)
  {
    sample.centre = Vector3(x, 0.0, 10.0);
    wall.Find(sample, 0.1, contacts);
    WallPlace place;
    EXPECT_EQ(wall.Outside(sample, place), x > 1.0) << x;
    EXPECT_EQ(wall.BranchAt(sample), 0);
    if (x > 1.0)
    {
      ASSERT_EQ(contacts.count, 1);
      EXPECT_NEAR(contacts.plane[0].gap, 1.0 - x - 0.1, 0.01);
      EXPECT_LT(contacts.plane[0].normal[0], -0.99);
      EXPECT_NEAR(place.distance, 1.0 - x, 0.01);
    }
  }
  // Another one that comes beside it belongs to the same vessel; one that is new, to where it is.
  EXPECT_TRUE(wall.PlaceBeside(4, 3));
  EXPECT_FALSE(wall.PlaceBeside(5, 77));
  sample.index = 4;
  EXPECT_EQ(wall.BranchAt(sample), 0);
  sample.index = 5;
  EXPECT_EQ(wall.BranchAt(sample), 1);
  sample.index = 6;
  wall.Place(6, 0);
  EXPECT_EQ(wall.BranchAt(sample), 0);
  wall.Forget(6);
  EXPECT_EQ(wall.BranchAt(sample), 1);
}

TEST(VesselWall, NarrowLumenHasTwoPlanesWithLastingIdentities)
{
  Mesh mesh;
  AppendTube(mesh.topology, mesh.points, 0.0, 0.25, 10.0, 16, 60);
  // A slit: 0.5 mm wide, three times as high.
  for (Vector3& p : mesh.points)
  {
    p[1] *= 3.0;
  }
  VesselWall wall(mesh.topology, mesh.points);
  SampleContacts contacts;
  ContactSample sample;
  sample.radius = 0.18;
  int first = -1;
  for (int k = 0; k <= 200; ++k)
  {
    const double x = 0.1 * std::cos(0.05 * k); // to and fro
    sample.centre = Vector3(x, 0.02, 5.0);
    wall.Find(sample, 0.3, contacts);
    ASSERT_EQ(contacts.count, 2) << k;
    EXPECT_LT(contacts.plane[0].normal.dot(contacts.plane[1].normal), -0.9);
    EXPECT_LE(contacts.plane[0].gap, contacts.plane[1].gap + 1e-3);
    EXPECT_NE(contacts.plane[0].identity, contacts.plane[1].identity);
    const ContactPlane& right = contacts.plane[contacts.plane[0].normal[0] < 0.0 ? 0 : 1];
    EXPECT_NEAR(right.gap, 0.25 - x - 0.18, 0.02);
    if (k == 0)
    {
      first = right.identity;
    }
    EXPECT_EQ(right.identity, first) << k;
  }
}

TEST(VesselWall, OpenCapsAreNoObstacle)
{
  const Mesh mesh = Tube();
  VesselWallSettings settings;
  settings.openCaps = { 2 };
  VesselWall open(mesh.topology, mesh.points, settings);
  VesselWall closed(mesh.topology, mesh.points);
  SampleContacts contacts;
  ContactSample sample;
  sample.radius = 0.18;
  WallPlace place;
  for (double z = 3.0; z > -6.0; z -= 0.02)
  {
    for (const double x : { 0.0, 0.7, 1.3 })
    {
      sample.index = static_cast<std::int64_t>(10.0 * x);
      sample.centre = Vector3(x, 0.0, z);
      open.Find(sample, 0.1, contacts);
      EXPECT_FALSE(open.Outside(sample, place)) << z;
      EXPECT_EQ(contacts.count, x < 1.0 || z < 0.0 ? 0 : 1) << x << " " << z;
      closed.Find(sample, 0.1, contacts);
      EXPECT_EQ(closed.Outside(sample, place), z < 0.0) << z;
      if (z < 0.27)
      {
        ASSERT_GE(contacts.count, 1);
        if (z >= 0.0)
        {
          EXPECT_EQ(contacts.count, x < 1.0 ? 1 : 2) << x << " " << z;
        }
      }
    }
  }
  // Behind the wall beside the ostium is not free.
  sample.index = 50;
  sample.centre = Vector3(Radius + 0.1, 0.0, 0.3);
  open.Find(sample, 0.1, contacts);
  EXPECT_TRUE(open.Outside(sample, place));
  EXPECT_EQ(contacts.count, 1);
}

TEST(VesselWall, BadSamplesTouchNothing)
{
  const Mesh mesh = Tube();
  VesselWall wall(mesh.topology, mesh.points);
  SampleContacts contacts;
  ContactSample sample;
  sample.radius = 0.18;
  WallPlace place;
  for (const double bad : { std::nan(""), std::numeric_limits<double>::infinity(), 1e30, -1e9 })
  {
    contacts.count = 2;
    sample.centre = Vector3(0.0, bad, 1.0);
    wall.Find(sample, 0.1, contacts);
    EXPECT_EQ(contacts.count, 0);
    EXPECT_FALSE(wall.Outside(sample, place));
    EXPECT_EQ(wall.BranchAt(sample), -1);
    EXPECT_EQ(wall.Closest(sample.centre).triangle, -1);
  }
  sample.centre = Vector3(1.3, 0.0, 10.0);
  wall.Find(sample, std::nan(""), contacts);
  EXPECT_EQ(contacts.count, 0);
  wall.Find(sample, 0.1, contacts);
  EXPECT_EQ(contacts.count, 1);
  sample.centre = Vector3(5e4, 0.0, 10.0); // far outside is outside
  wall.Find(sample, 0.1, contacts);
  EXPECT_EQ(contacts.count, 1);
  EXPECT_NEAR(contacts.plane[0].gap, -(5e4 - Radius + 0.18), 1.0);
}

TEST(VesselWall, FlatTrianglesDoNoHarm)
{
  Mesh mesh = Tube();
  // Rings drawn together, and points that coincide.
  for (Vector3& p : mesh.points)
  {
    p[2] = p[2] > 9.9 && p[2] < 11.1 ? 10.5 : p[2];
  }
  mesh.points[30 * 20 + 3] = mesh.points[30 * 20 + 4];
  VesselWall wall(mesh.topology, mesh.points);
  SampleContacts contacts;
  ContactSample sample;
  sample.radius = 0.18;
  for (double z = 5.5; z < 14.0; z += 0.01)
  {
    sample.centre = Vector3(1.3, 0.1, z);
    wall.Find(sample, 0.1, contacts);
    ASSERT_EQ(contacts.count, 1) << z;
    ASSERT_TRUE(contacts.plane[0].normal.allFinite());
    ASSERT_LT(contacts.plane[0].normal[0], -0.9);
    ASSERT_NEAR(contacts.plane[0].gap, 0.02, 0.02);
  }
}

TEST(VesselWall, OrderOfCallsChangesNothing)
{
  const Mesh mesh = Tube();
  VesselWall forwards(mesh.topology, mesh.points);
  VesselWall backwards(mesh.topology, mesh.points);
  std::vector<Vector3> moved = MovedAll(mesh.points, 0.02);
  for (int frame = 0; frame < 4; ++frame)
  {
    moved = MovedAll(mesh.points, 0.02 * frame);
    forwards.BeginFrame(moved, 0.016);
    backwards.BeginFrame(moved, 0.016);
    for (int tick = 0; tick < 16; ++tick)
    {
      forwards.SetTime(0.001 * tick);
      backwards.SetTime(0.001 * tick);
      std::vector<SampleContacts> a(40);
      std::vector<SampleContacts> b(40);
      const auto sample = [&](int i)
      {
        ContactSample s;
        s.index = i;
        s.radius = 0.18;
        const Vector3 rest = InTube(1.25, 0.4 * i + 0.02 * tick, 2.0 + 0.6 * i);
        const Vector3 from = Moved(rest, 0.02 * (frame - 1));
        s.centre =
          frame == 0 ? rest : Vector3(from + tick / 16.0 * (Moved(rest, 0.02 * frame) - from));
        return s;
      };
      for (int i = 0; i < 40; ++i)
      {
        forwards.Find(sample(i), 0.2, a[i]);
        backwards.Find(sample(39 - i), 0.2, b[39 - i]);
      }
      for (int i = 0; i < 40; ++i)
      {
        ASSERT_EQ(a[i].count, b[i].count);
        for (int k = 0; k < a[i].count; ++k)
        {
          ASSERT_EQ(a[i].plane[k].normal, b[i].plane[k].normal);
          ASSERT_EQ(a[i].plane[k].gap, b[i].plane[k].gap);
          ASSERT_EQ(a[i].plane[k].identity, b[i].plane[k].identity);
        }
      }
    }
  }
}

TEST(VesselWall, LoopOverTrianglesFindsTheNearestPlaces)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto anywhere = [&] { return Vector3(unit(random), unit(random), unit(random)); };
  const auto isFlat = [](int i) { return i % 11 == 3; };
  std::array<int, 7> features{};
  for (int round = 0; round < 2000; ++round)
  {
    std::array<std::array<Vector3, 3>, TriangleBatch::Size> triangles;
    TriangleBatch batch{};
    const Vector3 p = 2.0 * anywhere();
    const int count = 1 + round % TriangleBatch::Size;
    for (int i = 0; i < count; ++i)
    {
      std::array<Vector3, 3>& t = triangles[i];
      t = { anywhere(), anywhere(), anywhere() };
      t[2] = isFlat(i) ? Vector3(0.5 * (t[0] + t[1])) : t[2];
      for (int k = 0; k < 9; ++k)
      {
        batch.corner[k][i] = t[k / 3][k % 3];
      }
    }
    TriangleBatch wide = batch;
    WallKernelsBaseline.nearest(batch, count, p.data());
    WallKernelChoice().Get().nearest(wide, count, p.data());
    for (int i = 0; i < count; ++i)
    {
      ASSERT_EQ(wide.feature[i], batch.feature[i]);
      ASSERT_EQ(batch.feature[i] < 0.0, isFlat(i));
      if (isFlat(i))
      {
        continue;
      }
      ASSERT_EQ(wide.b[i], batch.b[i]);
      ASSERT_EQ(wide.c[i], batch.c[i]);
      ASSERT_EQ(wide.squaredDistance[i], batch.squaredDistance[i]);
      const TrianglePoint on =
        NearestOnTriangle(p, triangles[i][0], triangles[i][1], triangles[i][2]);
      ++features[static_cast<int>(on.feature)];
      ASSERT_EQ(batch.feature[i], static_cast<int>(on.feature));
      ASSERT_NEAR(batch.b[i], on.b, 1e-9);
      ASSERT_NEAR(batch.c[i], on.c, 1e-9);
      ASSERT_NEAR(batch.squaredDistance[i], on.squaredDistance, 1e-12);
      for (int k = 0; k < 3; ++k)
      {
        ASSERT_EQ(wide.point[k][i], batch.point[k][i]);
        ASSERT_NEAR(batch.point[k][i], on.point[k], 1e-12);
      }
    }
  }
  for (const int times : features)
  {
    EXPECT_GT(times, 100);
  }
}

TEST(VesselWall, RefusesWhatIsNoWall)
{
  const Mesh good = Tube(1.0, 3.0);
  const auto refuse = [&](const std::function<void(Mesh&)>& spoil, const std::string& part)
  {
    Mesh mesh = good;
    spoil(mesh);
    ExpectRefusal([&] { VesselWall(mesh.topology, mesh.points); }, part);
  };
  refuse([](Mesh& m) { m.topology.triangles.clear(); }, "no triangles");
  refuse([](Mesh& m) { m.points.pop_back(); }, "positions are given");
  refuse([](Mesh& m) { m.points[4][1] = std::nan(""); }, "point 4 of the wall is not finite");
  refuse([](Mesh& m) { m.topology.triangles[7][1] = 100000; }, "refers to point 100000");
  refuse([](Mesh& m) { m.topology.triangles[7][1] = m.topology.triangles[7][2]; }, "a point twice");
  refuse([](Mesh& m) { m.topology.entity.pop_back(); }, "entities");
  refuse([](Mesh& m) { m.topology.group.pop_back(); }, "groups");
  refuse(
    [](Mesh& m)
    {
      m.topology.triangles.pop_back();
      m.topology.entity.pop_back();
    },
    "does not belong to two triangles");
  refuse([](Mesh& m) { std::swap(m.topology.triangles[9][0], m.topology.triangles[9][1]); },
    "does not belong to two triangles");
  refuse(
    [](Mesh& m)
    {
      for (Triangle& t : m.topology.triangles)
      {
        std::swap(t[0], t[1]);
      }
    },
    "is not oriented outwards");
  VesselWallSettings settings;
  settings.openCaps = { 9 };
  ExpectRefusal([&] { VesselWall(good.topology, good.points, settings); }, "no cap of entity 9");
  settings = {};
  settings.stiffness = 0.0;
  ExpectRefusal([&] { VesselWall(good.topology, good.points, settings); }, "stiffness");
  settings = {};
  settings.margin = std::nan("");
  ExpectRefusal([&] { VesselWall(good.topology, good.points, settings); }, "margin");
  VesselWall wall(good.topology, good.points);
  std::vector<Vector3> next = good.points;
  ExpectRefusal([&] { wall.BeginFrame(next, 0.0); }, "lasts");
  next[3][0] = 1e9;
  ExpectRefusal([&] { wall.BeginFrame(next, 0.1); }, "point 3");
  next.pop_back();
  ExpectRefusal([&] { wall.BeginFrame(next, 0.1); }, "points, not");
  ExpectRefusal([&] { wall.Place(1, -1); }, "no triangle -1");
}
}
