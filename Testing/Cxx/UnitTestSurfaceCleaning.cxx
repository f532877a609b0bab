// CleanSurface on tubes with one defect each, on all of them at once, and on random damage.
#include "SurfaceCleaning.h"

#include "HoleFilling.h"
#include "SurfaceCheck.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace UnitTestSurfaceCleaning
{
using namespace coronary;

namespace
{
struct Mesh
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
};

/// An open tube around the line from `from` to `to`, that looks outwards.
Mesh Tube(const Vector3& from, const Vector3& to, double radius, int around = 24, int along = 20)
{
  const Vector3 axis = (to - from).normalized();
  const Vector3 u =
    axis.cross(std::abs(axis[0]) < 0.9 ? Vector3::UnitX() : Vector3::UnitY()).normalized();
  const Vector3 v = axis.cross(u);
  Mesh mesh;
  for (int k = 0; k <= along; ++k)
  {
    for (int i = 0; i < around; ++i)
    {
      const double angle = 2.0 * M_PI * (i + 0.5 * (k % 2)) / around;
      mesh.points.emplace_back(
        from + (to - from) * k / along + radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
  }
  for (int k = 0; k < along; ++k)
  {
    for (int i = 0; i < around; ++i)
    {
      const std::int64_t a = k * around + i;
      const std::int64_t b = k * around + (i + 1) % around;
      const std::int64_t c = a + around;
      const std::int64_t d = b + around;
      if (k % 2 == 0)
      {
        mesh.triangles.push_back({ a, b, c });
        mesh.triangles.push_back({ b, d, c });
      }
      else
      {
        mesh.triangles.push_back({ a, b, d });
        mesh.triangles.push_back({ a, d, c });
      }
    }
  }
  return mesh;
}

Mesh Tube()
{
  return Tube({ 0.0, 0.0, 0.0 }, { 0.0, 0.0, 10.0 }, 1.0);
}

void Add(Mesh& mesh, const Mesh& other)
{
  const auto first = static_cast<std::int64_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : other.triangles)
  {
    mesh.triangles.push_back({ t[0] + first, t[1] + first, t[2] + first });
  }
}

CleanedSurface Clean(const Mesh& mesh, const SurfaceCleaningSettings& settings = {})
{
  return CleanSurface(mesh.points, mesh.triangles, settings);
}

double Volume(const CleanedSurface& surface)
{
  double volume = 0.0;
  for (const Triangle& t : surface.triangles)
  {
    volume += surface.points[t[0]].cross(surface.points[t[1]]).dot(surface.points[t[2]]) / 6.0;
  }
  return volume;
}

/// Closed, manifold, outwards, without self-intersections; lists as long as they must be.
void ExpectClean(const CleanedSurface& surface)
{
  ASSERT_FALSE(surface.triangles.empty());
  ASSERT_EQ(surface.sourcePoint.size(), surface.points.size());
  ASSERT_EQ(surface.nearestPoint.size(), surface.points.size());
  ASSERT_EQ(surface.sourceCell.size(), surface.triangles.size());
  ASSERT_EQ(surface.nearestCell.size(), surface.triangles.size());
  ASSERT_EQ(surface.cap.size(), surface.triangles.size());
  ASSERT_EQ(surface.component.size(), surface.triangles.size());
  EXPECT_TRUE(surface.warnings.empty()) << surface.warnings[0];
  EXPECT_EQ(surface.counts.openEdges, 0);
  EXPECT_EQ(surface.counts.remainingIntersections, 0);
  try
  {
    const ClosedSurface closed = CheckSurface(surface.points, surface.triangles);
    EXPECT_TRUE(closed.warnings.empty()) << closed.warnings[0];
    EXPECT_EQ(static_cast<std::int64_t>(closed.volume.size()), surface.components);
    CheckSelfIntersections(closed);
  }
  catch (const SurfaceError& error)
  {
    ADD_FAILURE() << error.what();
  }
}

void ExpectSame(const CleanedSurface& one, const CleanedSurface& other)
{
  EXPECT_EQ(one.points, other.points);
  EXPECT_EQ(one.triangles, other.triangles);
  EXPECT_EQ(one.cap, other.cap);
  EXPECT_EQ(one.sourceCell, other.sourceCell);
  EXPECT_EQ(one.repairs, other.repairs);
}

bool Says(const std::vector<std::string>& sentences, const std::string& part)
{
  return std::any_of(sentences.begin(), sentences.end(),
    [&](const std::string& text) { return text.find(part) != std::string::npos; });
}

double MinimumCornerAngle(const CleanedSurface& surface)
{
  double minimum = M_PI;
  for (const Triangle& t : surface.triangles)
  {
    for (int i = 0; i < 3; ++i)
    {
      const Vector3 u = surface.points[t[(i + 1) % 3]] - surface.points[t[i]];
      const Vector3 v = surface.points[t[(i + 2) % 3]] - surface.points[t[i]];
      minimum = std::min(minimum, std::atan2(u.cross(v).norm(), u.dot(v)));
    }
  }
  return minimum;
}
}

TEST(SurfaceCleaning, OpenEndsGetFlatCaps)
{
  const Mesh tube = Tube();
  const CleanedSurface surface = Clean(tube);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.caps, 2);
  EXPECT_EQ(surface.counts.filledHoles, 0);
  EXPECT_EQ(surface.counts.badTriangles, 0);
  EXPECT_EQ(surface.components, 1);
  EXPECT_LT(surface.maximumDisplacement, 1e-12);
  // The wall stays what it was, to the last bit but for the rims.
  for (std::size_t i = 0; i < tube.triangles.size(); ++i)
  {
    EXPECT_EQ(surface.triangles[i], tube.triangles[i]);
    EXPECT_EQ(surface.sourceCell[i], static_cast<std::int64_t>(i));
    EXPECT_EQ(surface.cap[i], 0);
  }
  double area[3] = { 0.0, 0.0, 0.0 };
  for (std::size_t i = tube.triangles.size(); i < surface.triangles.size(); ++i)
  {
    const Triangle& t = surface.triangles[i];
    EXPECT_EQ(surface.sourceCell[i], -1);
    ASSERT_GE(surface.cap[i], 1);
    ASSERT_LE(surface.cap[i], 2);
    const double z = surface.points[t[0]][2] < 5.0 ? 0.0 : 10.0;
    for (const std::int64_t corner : t)
    {
      EXPECT_NEAR(surface.points[corner][2], z, 1e-12);
    }
    area[surface.cap[i]] += 0.5 *
      (surface.points[t[1]] - surface.points[t[0]])
        .cross(surface.points[t[2]] - surface.points[t[0]])
        .norm();
  }
  const double polygon = 12.0 * std::sin(2.0 * M_PI / 24.0);
  EXPECT_NEAR(area[1], polygon, 1e-9);
  EXPECT_NEAR(area[2], polygon, 1e-9);
  EXPECT_GT(MinimumCornerAngle(surface), 20.0 * M_PI / 180.0);
}

TEST(SurfaceCleaning, TheLargestCapIsTheFirst)
{
  Mesh mesh = Tube({ 0.0, 0.0, 0.0 }, { 0.0, 0.0, 10.0 }, 0.7);
  Add(mesh, Tube({ 9.0, 0.0, 0.0 }, { 9.0, 0.0, 10.0 }, 1.5));
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.caps, 4);
  EXPECT_EQ(surface.components, 2);
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
  {
    const bool wide = surface.points[surface.triangles[i][0]][0] > 4.0;
    EXPECT_EQ(surface.component[i], wide ? 0 : 1);
    if (surface.cap[i] > 0)
    {
      EXPECT_EQ(surface.cap[i] <= 2, wide);
    }
  }
}

TEST(SurfaceCleaning, EndsAndHolesMayStayOpen)
{
  Mesh mesh = Tube();
  mesh.triangles.erase(mesh.triangles.begin() + 480, mesh.triangles.begin() + 484);
  SurfaceCleaningSettings settings;
  settings.capEnds = false;
  CleanedSurface surface = Clean(mesh, settings);
  EXPECT_EQ(surface.counts.openEdges, 48);
  EXPECT_EQ(surface.counts.filledHoles, 1);
  EXPECT_TRUE(surface.warnings.empty());
  settings.capEnds = true;
  settings.fillHoles = false;
  surface = Clean(mesh, settings);
  EXPECT_EQ(surface.counts.openEdges, 6);
  EXPECT_EQ(surface.counts.caps, 2);
}

TEST(SurfaceCleaning, ObliqueRimsAreNotMovedFarFromTheirPlane)
{
  Mesh mesh = Tube();
  for (Vector3& p : mesh.points)
  {
    p[2] += 0.8 * p[0] + (p[2] > 9.9 ? 0.1 * std::sin(3.0 * std::atan2(p[1], p[0])) : 0.0);
  }
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.caps, 2);
  EXPECT_GT(surface.maximumDisplacement, 0.02);
  EXPECT_LT(surface.maximumDisplacement, 0.15);
}

TEST(SurfaceCleaning, HolesOfTheWallAreFilledAlongIt)
{
  Mesh mesh = Tube();
  const double whole = Volume(Clean(mesh));
  std::vector<Triangle> kept;
  for (const Triangle& t : mesh.triangles)
  {
    const Vector3 c = (mesh.points[t[0]] + mesh.points[t[1]] + mesh.points[t[2]]) / 3.0;
    if ((c - Vector3(1.0, 0.0, 5.0)).norm() > 0.7)
    {
      kept.push_back(t);
    }
  }
  ASSERT_LT(kept.size(), mesh.triangles.size() - 10);
  mesh.triangles = kept;
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.filledHoles, 1);
  EXPECT_EQ(surface.counts.caps, 2);
  EXPECT_TRUE(Says(surface.repairs, "1 hole filled, the first at (0."));
  EXPECT_NEAR(Volume(surface), whole, 0.01 * whole);
}

TEST(SurfaceCleaning, ASoupOfTrianglesIsPutTogether)
{
  const Mesh tube = Tube();
  Mesh soup;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> jitter(-1e-6, 1e-6);
  for (const Triangle& t : tube.triangles)
  {
    const auto first = static_cast<std::int64_t>(soup.points.size());
    for (const std::int64_t corner : t)
    {
      soup.points.emplace_back(
        tube.points[corner] + Vector3(jitter(random), jitter(random), jitter(random)));
    }
    soup.triangles.push_back({ first, first + 1, first + 2 });
  }
  const CleanedSurface surface = Clean(soup);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.mergedPoints,
    static_cast<std::int64_t>(soup.points.size() - tube.points.size()));
  EXPECT_EQ(surface.counts.caps, 2);

  SurfaceCleaningSettings exact;
  exact.mergeTolerance = 0.0;
  EXPECT_EQ(Clean(tube, exact).counts.mergedPoints, 0);
}

TEST(SurfaceCleaning, DegenerateAndDoubledTrianglesAreLeftOut)
{
  Mesh mesh = Tube();
  mesh.triangles.push_back({ 5, 5, 9 });
  mesh.triangles.push_back(mesh.triangles[33]);
  mesh.triangles.push_back({ mesh.triangles[34][1], mesh.triangles[34][0], mesh.triangles[34][2] });
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.degenerateTriangles, 1);
  EXPECT_EQ(surface.counts.duplicateTriangles, 2);
  EXPECT_EQ(surface.counts.filledHoles, 0);
}

TEST(SurfaceCleaning, InsideOutAndMixedOrientationsAreTurned)
{
  const Mesh right = Tube();
  Mesh mesh = right;
  std::mt19937 random(3);
  std::int64_t turned = 0;
  for (Triangle& t : mesh.triangles)
  {
    if (random() % 3 != 0)
    {
      std::swap(t[0], t[1]);
      ++turned;
    }
  }
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.turnedTriangles, turned);
  EXPECT_NEAR(Volume(surface), Volume(Clean(right)), 1e-9);
}

TEST(SurfaceCleaning, FinsAreCutOff)
{
  Mesh mesh = Tube();
  mesh.points.emplace_back(3.0, 0.0, 5.0);
  const auto fin = static_cast<std::int64_t>(mesh.points.size()) - 1;
  mesh.triangles.push_back({ mesh.triangles[400][0], mesh.triangles[400][1], fin });
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.nonManifoldEdges, 1);
  EXPECT_TRUE(Says(surface.repairs, "1 edge of more than two triangles cut open"));
  for (const Vector3& p : surface.points)
  {
    EXPECT_LT(p[0], 1.1);
  }
}

TEST(SurfaceCleaning, FansThatTouchInAPointAreSeparated)
{
  // Two cones with one apex.
  Mesh mesh;
  mesh.points.emplace_back(0.0, 0.0, 0.0);
  for (const double z : { -2.0, 2.0 })
  {
    const auto first = static_cast<std::int64_t>(mesh.points.size());
    for (int i = 0; i < 12; ++i)
    {
      mesh.points.emplace_back(std::cos(i * M_PI / 6.0), std::sin(i * M_PI / 6.0), z);
    }
    for (std::int64_t i = 0; i < 12; ++i)
    {
      mesh.triangles.push_back({ 0, first + i, first + (i + 1) % 12 });
    }
  }
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.nonManifoldPoints, 1);
  EXPECT_EQ(surface.components, 2);
}

TEST(SurfaceCleaning, CrumbsAndWhatLiesInsideAreLeftOut)
{
  Mesh mesh = Tube();
  Add(mesh, Tube({ 0.0, 0.0, 4.0 }, { 0.0, 0.0, 6.0 }, 0.5));
  Add(mesh, Tube({ 8.0, 0.0, 4.0 }, { 8.0, 0.0, 4.1 }, 0.1, 6, 2));
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.components, 1);
  EXPECT_EQ(surface.counts.innerComponents, 1);
  EXPECT_EQ(surface.counts.smallComponents, 1);
  EXPECT_EQ(surface.counts.caps, 2);

  SurfaceCleaningSettings all;
  all.minimumComponentShare = 0.0;
  EXPECT_EQ(Clean(mesh, all).components, 2);
}

TEST(SurfaceCleaning, EndsThatFaceEachOtherAreJoined)
{
  Mesh mesh = Tube({ 0.0, 0.0, 0.0 }, { 0.0, 0.0, 10.0 }, 1.0);
  Add(mesh, Tube({ 0.1, 0.05, 10.4 }, { 1.0, 0.0, 20.0 }, 0.9, 20));
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.joinedEnds, 1);
  EXPECT_EQ(surface.counts.caps, 2);
  EXPECT_EQ(surface.components, 1);

  SurfaceCleaningSettings apart;
  apart.joinDistance = 0.2;
  const CleanedSurface two = Clean(mesh, apart);
  ExpectClean(two);
  EXPECT_EQ(two.counts.joinedEnds, 0);
  EXPECT_EQ(two.counts.caps, 4);
  EXPECT_EQ(two.components, 2);
}

TEST(SurfaceCleaning, EndsThatOverlapAreJoined)
{
  Mesh mesh = Tube({ 0.0, 0.0, 0.0 }, { 0.0, 0.0, 10.0 }, 1.0);
  Add(mesh, Tube({ 0.0, 0.0, 9.6 }, { 0.0, 0.0, 20.0 }, 0.93, 22));
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.counts.caps, 2);
  EXPECT_EQ(surface.components, 1);
  EXPECT_NEAR(Volume(surface), M_PI * (10.0 + 10.0 * 0.93 * 0.93), 1.5);
}

TEST(SurfaceCleaning, VesselsThatRunThroughEachOtherAreUnited)
{
  // Steinmetz: two crossing tubes of one radius have 16/3 r^3 in common.
  Mesh mesh = Tube({ 0.0, 0.0, -5.0 }, { 0.0, 0.0, 5.0 }, 1.0, 32, 32);
  Add(mesh, Tube({ -5.0, 0.03, 0.02 }, { 5.0, 0.03, 0.02 }, 1.0, 32, 32));
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.components, 1);
  EXPECT_EQ(surface.counts.caps, 4);
  EXPECT_GT(surface.counts.selfIntersections, 10);
  const double exact = 2.0 * M_PI * 10.0 - 16.0 / 3.0;
  EXPECT_NEAR(Volume(surface), exact, 0.03 * exact);
}

TEST(SurfaceCleaning, ABranchThatEndsInsideItsParentIsUnited)
{
  Mesh mesh = Tube({ 0.0, 0.0, -6.0 }, { 0.0, 0.0, 6.0 }, 1.2, 30, 40);
  Add(mesh, Tube({ 0.1, 0.0, 0.0 }, { 6.0, 0.0, 4.0 }, 0.6, 16, 24));
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_EQ(surface.components, 1);
  EXPECT_EQ(surface.counts.caps, 3);
}

TEST(SurfaceCleaning, VesselsThatOnlyTouchStayTwo)
{
  Mesh mesh = Tube({ 0.0, 0.0, -5.0 }, { 0.0, 0.0, 5.0 }, 1.0, 24, 30);
  Add(mesh, Tube({ 1.97, -5.0, 0.0 }, { 1.97, 5.0, 0.0 }, 1.0, 24, 30));
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_GT(surface.counts.selfIntersections, 0);
  EXPECT_EQ(surface.counts.caps, 4);
  EXPECT_NEAR(Volume(surface), 2.0 * M_PI * 10.0, 2.0);
}

TEST(SurfaceCleaning, ThinTrianglesAreBettered)
{
  // Points put in close to others make needles, points close to edges make caps.
  Mesh mesh = Tube();
  std::mt19937 random(11);
  for (int k = 0; k < 60; ++k)
  {
    const std::size_t cell = random() % mesh.triangles.size();
    const Triangle t = mesh.triangles[cell];
    const double u = k % 2 == 0 ? 0.98 : 0.49;
    const double v = k % 2 == 0 ? 0.01 : 0.49;
    mesh.points.emplace_back(
      u * mesh.points[t[0]] + v * mesh.points[t[1]] + (1.0 - u - v) * mesh.points[t[2]]);
    const auto fresh = static_cast<std::int64_t>(mesh.points.size()) - 1;
    mesh.triangles[cell] = { t[0], t[1], fresh };
    mesh.triangles.push_back({ t[1], t[2], fresh });
    mesh.triangles.push_back({ t[2], t[0], fresh });
  }
  const CleanedSurface surface = Clean(mesh);
  ExpectClean(surface);
  EXPECT_GT(surface.counts.badTriangles, 60);
  EXPECT_EQ(surface.counts.remainingBadTriangles, 0);
  EXPECT_GE(MinimumCornerAngle(surface), 10.0 * M_PI / 180.0);
  EXPECT_NEAR(Volume(surface), Volume(Clean(Tube())), 0.05);

  SurfaceCleaningSettings none;
  none.minimumAngle = 0.0;
  EXPECT_LT(MinimumCornerAngle(Clean(mesh, none)), 3.0 * M_PI / 180.0);
}

TEST(SurfaceCleaning, AMoebiusStripIsCutOpen)
{
  Mesh mesh;
  constexpr int n = 40;
  for (int i = 0; i < n; ++i)
  {
    const double a = 2.0 * M_PI * i / n;
    for (const double w : { -0.5, 0.5 })
    {
      const double r = 3.0 + w * std::cos(0.5 * a);
      mesh.points.emplace_back(r * std::cos(a), r * std::sin(a), w * std::sin(0.5 * a));
    }
  }
  for (std::int64_t i = 0; i < n; ++i)
  {
    const std::int64_t a = 2 * i;
    const std::int64_t b = a + 1;
    const std::int64_t c = i + 1 < n ? a + 2 : 1;
    const std::int64_t d = i + 1 < n ? a + 3 : 0;
    mesh.triangles.push_back({ a, c, b });
    mesh.triangles.push_back({ b, c, d });
  }
  const CleanedSurface surface = Clean(mesh);
  EXPECT_TRUE(Says(surface.repairs, "one side only"));
  EXPECT_EQ(surface.counts.openEdges, 0);
}

TEST(SurfaceCleaning, RandomDamageIsMendedOrNamed)
{
  int clean = 0;
  for (unsigned seed = 0; seed < 40; ++seed)
  {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto chance = [&](double p) { return random() % 10000 < 10000.0 * p; };
    Mesh mesh = Tube({ 0.0, 0.0, -6.0 }, { 0.0, 0.0, 6.0 }, 1.2, 26, 30);
    Add(mesh, Tube({ 0.4, 0.0, 0.0 }, { 6.0, 1.0, 3.0 }, 0.7, 18, 20));
    std::vector<Triangle> damaged;
    for (Triangle t : mesh.triangles)
    {
      if (chance(0.01))
      {
        continue;
      }
      if (chance(0.02))
      {
        std::swap(t[0], t[2]);
      }
      damaged.push_back(t);
      if (chance(0.01))
      {
        damaged.push_back(t);
      }
      if (chance(0.005))
      {
        damaged.push_back({ t[0], t[1], static_cast<std::int64_t>(random() % mesh.points.size()) });
      }
    }
    for (Vector3& p : mesh.points)
    {
      if (chance(0.01))
      {
        p += 0.5 * Vector3((random() % 100) / 50.0 - 1.0, (random() % 100) / 50.0 - 1.0, 0.0);
      }
    }
    mesh.triangles = damaged;
    const CleanedSurface surface = Clean(mesh);
    EXPECT_EQ(surface.counts.openEdges, 0);
    // What is left is said.
    EXPECT_EQ(surface.counts.remainingIntersections > 0, !surface.warnings.empty());
    bool fine = surface.warnings.empty();
    if (fine)
    {
      ExpectClean(surface);
      const double volume = M_PI * (12.0 * 1.44 + 0.49 * 5.0);
      EXPECT_NEAR(Volume(surface), volume, 0.1 * volume);
      ++clean;
    }
  }
  EXPECT_EQ(clean, 40);
}

TEST(SurfaceCleaning, ThreadsDoNotMatter)
{
  Mesh mesh = Tube({ 0.0, 0.0, -5.0 }, { 0.0, 0.0, 5.0 }, 1.0, 32, 32);
  Add(mesh, Tube({ -5.0, 0.03, 0.02 }, { 5.0, 0.03, 0.02 }, 1.0, 32, 32));
  SetNumberOfThreads(1);
  const CleanedSurface one = Clean(mesh);
  SetNumberOfThreads(7);
  const CleanedSurface seven = Clean(mesh);
  SetNumberOfThreads(0);
  ExpectSame(one, seven);
}

TEST(SurfaceCleaning, ASecondTimeChangesNothing)
{
  Mesh mesh = Tube({ 0.0, 0.0, -6.0 }, { 0.0, 0.0, 6.0 }, 1.2, 30, 40);
  Add(mesh, Tube({ 0.1, 0.0, 0.0 }, { 6.0, 0.0, 4.0 }, 0.6, 16, 24));
  const CleanedSurface first = Clean(mesh);
  const CleanedSurface second = CleanSurface(first.points, first.triangles);
  EXPECT_EQ(second.counts.selfIntersections, 0);
  EXPECT_EQ(second.counts.filledHoles + second.counts.caps, 0);
  EXPECT_EQ(second.counts.mergedPoints, 0);
}

TEST(SurfaceCleaning, SizeAndPlaceDoNotMatter)
{
  Mesh mesh = Tube({ 0.0, 0.0, -5.0 }, { 0.0, 0.0, 5.0 }, 1.0, 32, 32);
  Add(mesh, Tube({ -5.0, 0.03, 0.02 }, { 5.0, 0.03, 0.02 }, 1.0, 32, 32));
  const Eigen::AngleAxisd turn(0.7, Vector3(1.0, 2.0, 3.0).normalized());
  for (const double scale : { 1e-3, 1.0, 1e4 })
  {
    SCOPED_TRACE(scale);
    Mesh moved = mesh;
    for (Vector3& p : moved.points)
    {
      p = scale * (turn * p + Vector3(300.0, -200.0, 900.0));
    }
    const CleanedSurface surface = Clean(moved);
    ExpectClean(surface);
    EXPECT_EQ(surface.components, 1);
    EXPECT_EQ(surface.counts.caps, 4);
  }
}

TEST(SurfaceCleaning, RefusesWhatMakesNoSense)
{
  const auto message = [](const Mesh& mesh, const SurfaceCleaningSettings& settings = {})
  {
    try
    {
      Clean(mesh, settings);
    }
    catch (const std::invalid_argument& error)
    {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message({}), "the surface is empty: it has no triangles");
  Mesh mesh = Tube();
  mesh.triangles[7][1] = 100000;
  EXPECT_EQ(message(mesh), "cell 7 of the surface has point 100000, which does not exist");
  mesh = Tube();
  mesh.points[12][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message(mesh), "point 12 of the surface is not finite");
  SurfaceCleaningSettings settings;
  settings.mergeTolerance = 0.5;
  EXPECT_NE(message(Tube(), settings).find("merge tolerance"), std::string::npos);
  settings = {};
  settings.minimumComponentShare = -1.0;
  EXPECT_NE(message(Tube(), settings).find("smallest component"), std::string::npos);
  settings = {};
  settings.joinDistance = 11.0;
  EXPECT_NE(message(Tube(), settings).find("join distance"), std::string::npos);
  settings = {};
  settings.minimumAngle = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(Tube(), settings).find("minimum angle"), std::string::npos);
}

TEST(SurfaceCleaning, NothingButDegenerateTrianglesIsNothing)
{
  Mesh mesh = Tube();
  mesh.triangles = { { 0, 0, 1 }, { 2, 3, 3 } };
  const CleanedSurface surface = Clean(mesh);
  EXPECT_TRUE(surface.triangles.empty());
  EXPECT_TRUE(Says(surface.warnings, "nothing is left"));
}

TEST(SurfaceCleaning, CanBeCancelled)
{
  const Mesh mesh = Tube();
  EXPECT_THROW(
    CleanSurface(mesh.points, mesh.triangles, {}, [](double) { return false; }), Cancelled);
  double last = 0.0;
  CleanSurface(mesh.points, mesh.triangles, {},
    [&](double fraction)
    {
      EXPECT_GE(fraction, last);
      last = fraction;
      return true;
    });
  EXPECT_EQ(last, 1.0);
}

TEST(HoleFilling, FlatPolygonsAreCoveredOnce)
{
  // A star is not convex: wrong diagonals would cover more than its area.
  std::vector<Vector3> star;
  for (int i = 0; i < 20; ++i)
  {
    const double r = i % 2 == 0 ? 2.0 : 1.0;
    star.emplace_back(r * std::cos(i * M_PI / 10.0), r * std::sin(i * M_PI / 10.0), 0.0);
  }
  SurfacePatch patch = TriangulateHole(star);
  RefinePatch(patch, std::vector<double>(star.size(), 0.3));
  double area = 0.0;
  for (const Triangle& t : patch.triangles)
  {
    const Vector3 normal =
      (patch.points[t[1]] - patch.points[t[0]]).cross(patch.points[t[2]] - patch.points[t[0]]);
    EXPECT_GT(normal[2], 0.0);
    area += 0.5 * normal.norm();
  }
  EXPECT_NEAR(area, 20.0 * 0.5 * 2.0 * 1.0 * std::sin(M_PI / 10.0), 1e-9);
  EXPECT_GT(patch.points.size(), star.size() + 10);
}

TEST(HoleFilling, ForbiddenChordsAreNotMade)
{
  const std::vector<Vector3> square{ { 0, 0, 0 }, { 1, 0, 0 }, { 1, 1, 0 }, { 0, 1, 0 } };
  SurfacePatch patch = TriangulateHole(
    square, {}, [](std::int64_t i, std::int64_t j) { return i % 2 == 0 && j % 2 == 0; });
  ASSERT_EQ(patch.triangles.size(), 2U);
  for (const Triangle& t : patch.triangles)
  {
    EXPECT_TRUE(std::count(t.begin(), t.end(), 1) == 1 && std::count(t.begin(), t.end(), 3) == 1);
  }
  // With both diagonals forbidden: a fan.
  patch = TriangulateHole(square, {}, [](std::int64_t, std::int64_t) { return true; });
  EXPECT_EQ(patch.triangles.size(), 4U);
  EXPECT_EQ(patch.points.size(), 5U);
}

TEST(HoleFilling, LongRimsAreFilledInParts)
{
  std::vector<Vector3> circle;
  for (int i = 0; i < 2000; ++i)
  {
    circle.emplace_back(std::cos(i * M_PI / 1000.0), std::sin(i * M_PI / 1000.0), 0.0);
  }
  const SurfacePatch patch = TriangulateHole(circle);
  EXPECT_EQ(patch.triangles.size(), 1998U);
  double area = 0.0;
  for (const Triangle& t : patch.triangles)
  {
    area += 0.5 *
      (patch.points[t[1]] - patch.points[t[0]]).cross(patch.points[t[2]] - patch.points[t[0]])[2];
  }
  EXPECT_NEAR(area, M_PI, 1e-4);
}
}
