// The swept surface against closed forms: tubes, tori, forks; the test of triangles that cut each
// other against exact cases; refusals.

#include "CoronaryPhantom.h"
#include "SurfaceMeasures.h"
#include "SweepSurface.h"
#include "TriangleIntersections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <string>

namespace UnitTestSweepSurface
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

/// Adds a branch from point `first` (-1: a new one) along a curve.
std::int64_t AddBranch(VesselTree& tree, int group, std::int64_t first, int steps,
  const std::function<Vector3(double)>& place, const std::function<double(double)>& radius)
{
  VesselTree::Branch branch;
  branch.groupId = group;
  for (int i = 0; i <= steps; ++i)
  {
    if (i == 0 && first >= 0)
    {
      branch.points.push_back(first);
      continue;
    }
    const double t = static_cast<double>(i) / steps;
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.push_back(place(t));
    tree.radius.push_back(radius(t));
  }
  tree.branches.push_back(branch);
  return branch.points.back();
}

std::int64_t AddLine(VesselTree& tree, int group, std::int64_t first, const Vector3& from,
  const Vector3& to, double radius)
{
  return AddBranch(
    tree, group, first, 40, [=](double t) { return Vector3(from + t * (to - from)); },
    [=](double) { return radius; });
}

VesselTree Straight(const Vector3& from, const Vector3& to, double radius)
{
  VesselTree tree;
  AddLine(tree, 7, -1, from, to, radius);
  return tree;
}

/// A trunk along z and two daughters that leave it by +-`degrees`.
VesselTree Fork(double degrees, double trunk, double daughter, const Vector3& at = Vector3::Zero())
{
  VesselTree tree;
  const double a = degrees * Pi / 180.0;
  const std::int64_t node = AddLine(tree, 1, -1, at - Vector3(0.0, 0.0, 15.0), at, trunk);
  const Vector3 left = 18.0 * Vector3(std::sin(a), 0.0, std::cos(a));
  const Vector3 right = 18.0 * Vector3(-std::sin(a), 0.0, std::cos(a));
  AddLine(tree, 2, node, at, at + left, daughter);
  AddLine(tree, 3, node, at, at + right, daughter);
  return tree;
}

/// What every surface must be.
void ExpectSound(const SweptSurface& surface, int trees, const std::string& what)
{
  SCOPED_TRACE(what);
  const SurfaceMeasures m = MeasureSurface(surface.points, surface.triangles);
  EXPECT_TRUE(m.Closed());
  EXPECT_TRUE(m.Manifold());
  EXPECT_EQ(m.unusedPoints, 0U);
  EXPECT_EQ(m.components, trees);
  EXPECT_EQ(surface.trees, trees);
  EXPECT_EQ(m.eulerCharacteristic, 2 * trees);
  EXPECT_GT(m.volume, 0.0);
  EXPECT_GE(m.WorstAngle(), 10.0);
  EXPECT_LE(m.ShareBelow(20.0), 0.005);
  EXPECT_TRUE(FindSelfIntersections(surface.points, surface.triangles).empty());
  const std::vector<double> edges =
    RelativeEdgeLengths(surface.points, surface.triangles, surface.edgeLength);
  const auto good =
    std::count_if(edges.begin(), edges.end(), [](double e) { return std::abs(e - 1.0) <= 0.3; });
  EXPECT_GE(static_cast<double>(good), 0.95 * static_cast<double>(edges.size()));
}

std::string MessageOf(const std::function<void()>& work)
{
  try
  {
    work();
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}

/// A tetrahedron's four triangles, moved.
void AddTetrahedron(
  std::vector<Vector3>& points, std::vector<Triangle>& triangles, const Vector3& at)
{
  const auto n = static_cast<std::int64_t>(points.size());
  for (const Vector3& p :
    { Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1) })
  {
    points.push_back(p + at);
  }
  for (const Triangle& t :
    { Triangle{ 0, 2, 1 }, Triangle{ 0, 1, 3 }, Triangle{ 1, 2, 3 }, Triangle{ 0, 3, 2 } })
  {
    triangles.push_back({ t[0] + n, t[1] + n, t[2] + n });
  }
}
}

TEST(VesselAxis, DoesNotCurlAtItsEnds)
{
  // As far apart as knots may be, with a kink 1.5 mm before the end: which points get a knot is chance.
  for (int n = 0; n < 20; ++n)
  {
    std::vector<Vector3> points;
    Vector3 at = Vector3::Zero();
    double angle = 0.0;
    for (int i = 0; i < 60; ++i)
    {
      points.push_back(at);
      angle += i == 54 ? 0.16 : 0.01;
      at += (0.3 + 0.01 * std::sin(1.7 * i + n)) * Vector3(std::cos(angle), std::sin(angle), 0.0);
    }
    const VesselAxis axis(points, std::vector<double>(60, 0.56 + 0.004 * n), 0.5, true, true);
    for (const VesselAxis::Station& end : { axis.AllStations().front(), axis.AllStations().back() })
    {
      EXPECT_LT(end.curvature.norm(), 0.4) << n;
    }
  }
}

TEST(SweepSurface, StraightTubeHasItsRadius)
{
  for (const double radius : { 0.4, 1.5, 3.0 })
  {
    // Off the axes and away from the origin.
    const Vector3 from(120.0, -340.0, 55.0);
    const Vector3 to = from + Vector3(11.0, 7.0, -13.0);
    const SweptSurface surface = SweepVesselTree(Straight(from, to, radius), {});
    ExpectSound(surface, 1, "radius " + std::to_string(radius));
    const Vector3 axis = (to - from).normalized();
    std::vector<bool> wall(surface.points.size(), false);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    {
      for (const std::int64_t p : surface.triangles[t])
      {
        wall[p] = wall[p] || surface.entityId[t] == 1;
      }
    }
    for (std::size_t p = 0; p < surface.points.size(); ++p)
    {
      const Vector3 offset = surface.points[p] - from;
      const double along = offset.dot(axis);
      EXPECT_NEAR(surface.abscissa[p], along, 1e-3);
      EXPECT_NEAR(surface.radius[p], radius, 1e-9);
      EXPECT_EQ(surface.groupId[p], 7);
      if (wall[p])
      {
        EXPECT_NEAR((offset - along * axis).norm(), radius, 0.005 * radius);
        EXPECT_NEAR(surface.curvature[p], 1.0 / radius, 0.02 / radius);
      }
      else
      {
        EXPECT_LT(std::min(std::abs(along), std::abs(along - (to - from).norm())), 1e-6);
      }
    }
    // Less than the cylinder by what polygons are less than circles.
    const double volume = Pi * radius * radius * (to - from).norm();
    const SurfaceMeasures m = MeasureSurface(surface.points, surface.triangles);
    EXPECT_LT(m.volume, volume);
    EXPECT_GT(m.volume, 0.94 * volume);
  }
}

TEST(SweepSurface, EdgesFollowEquation4)
{
  SweepSettings settings;
  settings.minimumEdgeLength = 0.1;
  settings.maximumEdgeLength = 0.8;
  settings.curvatureWeight = 1.5;
  settings.edgeLengthPerRadius = 0.7;
  const double radius = 2.0;
  const SweptSurface surface =
    SweepVesselTree(Straight(Vector3::Zero(), Vector3(30.0, 0.0, 0.0), radius), settings);
  const double expected = 0.1 + 0.7 * std::exp(-1.5 / radius);
  for (const double h : surface.edgeLength)
  {
    EXPECT_NEAR(h, expected, 0.02 * expected);
  }
  const SurfaceMeasures m = MeasureSurface(surface.points, surface.triangles);
  // Even triangles of that edge would have this mean area.
  EXPECT_NEAR(m.area / static_cast<double>(m.triangles), std::sqrt(3.0) / 4.0 * expected * expected,
    0.12 * expected * expected);
}

TEST(SweepSurface, EdgesFollowBendsAsFarAsAsked)
{
  const double daughter = 1.2;
  std::vector<double> shortest;
  for (const double bend : { 0.12, 0.5 })
  {
    SweepSettings settings;
    settings.maximumEdgeLength = 10.0;
    settings.curvatureWeight = 0.0;
    settings.sharpestBend = bend;
    const SweptSurface surface = SweepVesselTree(Fork(25.0, 1.5, daughter), settings);
    EXPECT_TRUE(FindSelfIntersections(surface.points, surface.triangles, 1).empty());
    shortest.push_back(*std::min_element(surface.edgeLength.begin(), surface.edgeLength.end()));
    // What is asked for, less what grading takes.
    EXPECT_GT(shortest.back(), 0.9 * settings.edgeLengthPerRadius * bend * daughter);
  }
  EXPECT_GT(shortest[1], 2.0 * shortest[0]);
  SweepSettings none;
  none.sharpestBend = 0.0;
  EXPECT_THROW(SweepVesselTree(Fork(25.0, 1.5, daughter), none), std::invalid_argument);
}

/// Large triangles of a mesh that began fine: no heap of tiny ones may stay between them.
TEST(SweepSurface, CoarseForksHaveNoTinyEdges)
{
  SweepSettings settings;
  settings.maximumEdgeLength = 10.0;
  settings.curvatureWeight = 0.0;
  settings.edgeLengthPerRadius = 0.65;
  settings.sharpestBend = 0.5;
  for (const double degrees : { 10.0, 25.0, 50.0, 80.0 })
  {
    for (const double daughter : { 0.6, 1.0, 1.5 })
    {
      const SweptSurface surface = SweepVesselTree(Fork(degrees, 2.0, daughter), settings);
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t n = 0; n < surface.triangles.size(); ++n)
      {
        for (int k = 0; surface.entityId[n] == 1 && k < 3; ++k)
        {
          const std::int64_t a = surface.triangles[n][k];
          const std::int64_t b = surface.triangles[n][(k + 1) % 3];
          least = std::min(least,
            (surface.points[a] - surface.points[b]).norm() /
              (0.5 * (surface.edgeLength[a] + surface.edgeLength[b])));
        }
      }
      EXPECT_GT(least, 0.3) << degrees << " degrees, daughters of " << daughter << " mm";
    }
  }
}

TEST(SweepSurface, QuarterTorus)
{
  const double bend = 8.0;
  const double radius = 2.0;
  VesselTree tree;
  AddBranch(
    tree, 0, -1, 60,
    [=](double t)
    {
      const double a = 0.5 * Pi * t;
      return Vector3(bend * std::cos(a), bend * std::sin(a), 0.0);
    },
    [=](double) { return radius; });
  const SweptSurface surface = SweepVesselTree(tree, {});
  ExpectSound(surface, 1, "torus");
  for (std::size_t p = 0; p < surface.points.size(); ++p)
  {
    const Vector3& x = surface.points[p];
    if (x[0] > 0.5 && x[1] > 0.5) // the wall, away from the caps
    {
      const double ring = std::hypot(x[0], x[1]);
      EXPECT_NEAR(std::hypot(ring - bend, x[2]), radius, 0.005 * radius);
      const double inner = (bend - ring) / (radius * ring); // of the other principal direction
      EXPECT_NEAR(surface.curvature[p], std::max(1.0 / radius, std::abs(inner)), 0.03 / radius);
    }
  }
  // Frames: orthonormal, smooth, and without twist on a plane curve.
  ASSERT_EQ(surface.patches.size(), 1U);
  for (const VesselAxis::Station& s : surface.patches[0].centres)
  {
    EXPECT_NEAR(s.normal.norm(), 1.0, 1e-9);
    EXPECT_NEAR(s.normal.dot(s.tangent), 0.0, 1e-9);
    EXPECT_NEAR((s.tangent.cross(s.normal) - s.binormal).norm(), 0.0, 1e-9);
    EXPECT_NEAR(s.twist, 0.0, 1e-3);
  }
}

TEST(SweepSurface, PatchesAreRoundSections)
{
  SweepSettings settings;
  settings.patchSamples = 12;
  settings.patchSpacing = 1.0;
  const SweptSurface surface =
    SweepVesselTree(Straight(Vector3::Zero(), Vector3(0.0, 20.0, 0.0), 2.0), settings);
  ASSERT_EQ(surface.patches.size(), 1U);
  const SweepPatches& patches = surface.patches[0];
  EXPECT_EQ(patches.groupId, 7);
  EXPECT_EQ(patches.samples, 12);
  EXPECT_EQ(patches.centres.size(), 11U);
  ASSERT_EQ(patches.contours.size(), 12 * patches.centres.size());
  for (std::size_t i = 0; i < patches.contours.size(); ++i)
  {
    EXPECT_NEAR((patches.contours[i] - patches.centres[i / 12].point).norm(), 2.0, 1e-6);
    EXPECT_NEAR(patches.contours[i][1], patches.abscissa[i / 12], 1e-6);
  }
}

TEST(SweepSurface, EllipticContours)
{
  const VesselTree tree = Straight(Vector3::Zero(), Vector3(0.0, 0.0, 20.0), 1.5);
  SweepSections sections;
  sections.contourSamples = 32;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    sections.contourNormals.push_back(Vector3::UnitX());
    for (int k = 0; k < 32; ++k)
    {
      const double a = 2.0 * Pi * k / 32;
      sections.contours.push_back(1.0 / std::hypot(std::cos(a) / 2.0, std::sin(a) / 1.2));
    }
  }
  const SweptSurface surface = SweepVesselTree(tree, {}, sections);
  ExpectSound(surface, 1, "ellipse");
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
  {
    for (const std::int64_t p : surface.triangles[t])
    {
      if (surface.entityId[t] == 1)
      {
        const Vector3& x = surface.points[p];
        EXPECT_NEAR(std::hypot(x[0] / 2.0, x[1] / 1.2), 1.0, 0.01);
      }
    }
  }
}

TEST(SweepSurface, Forks)
{
  for (const double degrees : { 15.0, 35.0, 60.0, 85.0 })
  {
    const SweptSurface surface = SweepVesselTree(Fork(degrees, 1.8, 1.4), {});
    ExpectSound(surface, 1, "fork of " + std::to_string(degrees));
    ASSERT_EQ(surface.caps.size(), 3U);
    EXPECT_TRUE(surface.caps[0].inlet);
    EXPECT_FALSE(surface.caps[1].inlet);
    // Outside the union of the three tubes, and by no more than fillets.
    const double a = degrees * Pi / 180.0;
    const Vector3 ways[3] = { { 0.0, 0.0, -1.0 }, { std::sin(a), 0.0, std::cos(a) },
      { -std::sin(a), 0.0, std::cos(a) } };
    const double radii[3] = { 1.8, 1.4, 1.4 };
    std::set<int> groups;
    for (std::size_t p = 0; p < surface.points.size(); ++p)
    {
      double minimum = std::numeric_limits<double>::max();
      for (int k = 0; k < 3; ++k)
      {
        const double along = std::max(0.0, surface.points[p].dot(ways[k]));
        minimum = std::min(minimum, (surface.points[p] - along * ways[k]).norm() - radii[k]);
      }
      const bool inCap = std::abs(surface.normals[p].dot(surface.caps[0].normal)) > 0.999 ||
        std::abs(surface.normals[p].dot(surface.caps[1].normal)) > 0.999 ||
        std::abs(surface.normals[p].dot(surface.caps[2].normal)) > 0.999;
      if (!inCap && surface.points[p].norm() > 8.0)
      {
        EXPECT_NEAR(minimum, 0.0, 0.15);
      }
      EXPECT_LT(minimum, 1.2);
      groups.insert(surface.groupId[p]);
    }
    EXPECT_EQ(groups, (std::set<int>{ 1, 2, 3 }));
  }
}

TEST(SweepSurface, FourDaughtersOfOnePoint)
{
  VesselTree tree;
  const std::int64_t node = AddLine(tree, 0, -1, Vector3(0.0, 0.0, -12.0), Vector3::Zero(), 2.0);
  for (int k = 0; k < 4; ++k)
  {
    const double a = 0.5 * Pi * k + 0.3;
    AddLine(tree, k + 1, node, Vector3::Zero(),
      Vector3(10.0 * std::cos(a), 10.0 * std::sin(a), 9.0), 1.0 + 0.1 * k);
  }
  const SweptSurface surface = SweepVesselTree(tree, {});
  ExpectSound(surface, 1, "pentafurcation");
  EXPECT_EQ(surface.caps.size(), 5U);
}

TEST(SweepSurface, HairpinAtAnEndIsLeftOut)
{
  // From the wall inwards, and back along the vessel.
  VesselTree tree;
  VesselTree::Branch branch;
  const auto add = [&](const Vector3& p)
  {
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.push_back(p);
    tree.radius.push_back(2.0);
  };
  for (int i = 0; i < 16; ++i)
  {
    add(Vector3(1.2, 0.0, 4.0 - 0.25 * i));
  }
  for (int i = 0; i < 80; ++i)
  {
    add(Vector3(0.0, 0.0, 0.25 * i));
  }
  tree.branches.push_back(branch);
  const SweptSurface surface = SweepVesselTree(tree, {});
  ExpectSound(surface, 1, "hairpin");
  ASSERT_EQ(surface.remarks.size(), 1U);
  EXPECT_NE(surface.remarks[0].find("turns back"), std::string::npos);
}

TEST(SweepSurface, KinkOfNinetyDegrees)
{
  VesselTree tree;
  const std::int64_t corner = AddLine(tree, 0, -1, Vector3(0.0, 0.0, -12.0), Vector3::Zero(), 1.5);
  AddLine(tree, 1, corner, Vector3::Zero(), Vector3(12.0, 0.0, 0.0), 1.5);
  ExpectSound(SweepVesselTree(tree, {}), 1, "kink");
}

/// Up, down again beside itself by `depth`, and up.
VesselTree Zigzag(double width, double depth)
{
  VesselTree tree;
  VesselTree::Branch branch;
  const auto add = [&](const Vector3& p)
  {
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.push_back(p);
    tree.radius.push_back(1.5);
  };
  constexpr double top = 12.0;
  for (int i = 0; i < 40; ++i)
  {
    add(Vector3(0.0, 0.0, top * i / 40.0));
  }
  for (int i = 0; i < 10; ++i)
  {
    add(Vector3(width * i / 10.0, 0.0, top - depth * i / 10.0));
  }
  for (int i = 0; i <= 50; ++i)
  {
    add(Vector3(width * (1.0 + i / 50.0), 0.0, top - depth + (depth + 12.0) * i / 50.0));
  }
  tree.branches.push_back(branch);
  return tree;
}

TEST(SweepSurface, ZigzagIsSmoothedWhereItIs)
{
  const SweptSurface surface = SweepVesselTree(Zigzag(0.8, 3.0), {});
  ExpectSound(surface, 1, "zigzag");
  ASSERT_EQ(surface.remarks.size(), 1U);
  EXPECT_NE(surface.remarks[0].find("axes less than"), std::string::npos) << surface.remarks[0];
  double top = 0.0;
  for (const Vector3& p : surface.points)
  {
    top = std::max(top, p[2]);
  }
  EXPECT_NEAR(top, 24.0, 0.5);
}

TEST(SweepSurface, EndBehindAPlaceThatCannotBeMeshedIsLeftOut)
{
  const SweptSurface surface = SweepVesselTree(Zigzag(1.5, 4.0), {});
  ExpectSound(surface, 1, "zigzag");
  ASSERT_GE(surface.remarks.size(), 1U);
  EXPECT_NE(surface.remarks[0].find("group 0 is left out from"), std::string::npos)
    << surface.remarks[0];
}

TEST(SweepSurface, SideVesselThatTurnsBackAtOnce)
{
  // Its fold reaches to where it would be cut.
  PhantomSettings settings;
  settings.seed = 26;
  settings.dominance = static_cast<Dominance>(26 % 3);
  settings.stenoses = 26 % 4;
  settings.tortuosity = 1.5;
  settings.calibre = 0.95;
  const SweptSurface surface = SweepVesselTree(CoronaryPhantom(settings).Tree(0.3), {});
  ExpectSound(surface, 2, "phantom 26");
  EXPECT_TRUE(surface.remarks.empty()) << surface.remarks.front();
}

TEST(SweepSurface, NeighboursDoNotMerge)
{
  // Half a millimetre between the walls, then less than nothing.
  for (const double gap : { 0.5, 0.02, -0.15 })
  {
    VesselTree tree;
    AddLine(tree, 0, -1, Vector3(0.0, 0.0, -15.0), Vector3(0.0, 0.0, 15.0), 1.5);
    AddLine(tree, 1, -1, Vector3(2.5 + gap, -12.0, -3.0), Vector3(2.5 + gap, 12.0, 3.0), 1.0);
    ExpectSound(SweepVesselTree(tree, {}), 2, "gap " + std::to_string(gap));
  }
}

TEST(SweepSurface, CapsAreFlatAndNumbered)
{
  const SweptSurface surface = SweepVesselTree(Fork(40.0, 1.8, 1.3), {});
  std::set<int> ids(surface.entityId.begin(), surface.entityId.end());
  EXPECT_EQ(ids, (std::set<int>{ 1, 2, 3, 4 }));
  for (const SweepCap& cap : surface.caps)
  {
    Vector3 area = Vector3::Zero();
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    {
      if (surface.entityId[t] == cap.entityId)
      {
        const Vector3& a = surface.points[surface.triangles[t][0]];
        const Vector3& b = surface.points[surface.triangles[t][1]];
        const Vector3& c = surface.points[surface.triangles[t][2]];
        EXPECT_NEAR((a - cap.centre).dot(cap.normal), 0.0, 1e-9);
        area += 0.5 * (b - a).cross(c - a);
      }
    }
    EXPECT_NEAR(area.normalized().dot(cap.normal), 1.0, 1e-9);
    EXPECT_NEAR(area.norm(), Pi * cap.radius * cap.radius, 0.06 * Pi * cap.radius * cap.radius);
  }
}

TEST(SweepSurface, ObliqueEnds)
{
  const VesselTree tree = Straight(Vector3::Zero(), Vector3(0.0, 0.0, 15.0), 1.5);
  SweepSections sections;
  sections.endNormals.assign(tree.points.size(), Vector3::Zero());
  const Vector3 wanted = Vector3(std::sin(0.6), 0.0, std::cos(0.6));
  sections.endNormals.back() = -3.0 * wanted; // length and sense do not matter
  const SweptSurface surface = SweepVesselTree(tree, {}, sections);
  ExpectSound(surface, 1, "oblique");
  EXPECT_NEAR((surface.caps[1].normal - wanted).norm(), 0.0, 1e-9);
  for (const Vector3& p : surface.points)
  {
    EXPECT_LT((p - Vector3(0.0, 0.0, 15.0)).dot(wanted), 1e-6);
  }
  sections.endNormals.back() = Vector3(1.0, 0.0, 0.2);
  EXPECT_NE(
    MessageOf([&] { SweepVesselTree(tree, {}, sections); }).find("at most 60"), std::string::npos);
}

TEST(SweepSurface, OpenEnds)
{
  SweepSettings settings;
  settings.capped = false;
  const SweptSurface surface = SweepVesselTree(Fork(40.0, 1.8, 1.3), settings);
  const SurfaceMeasures m = MeasureSurface(surface.points, surface.triangles);
  EXPECT_GT(m.openEdges, 0U);
  EXPECT_EQ(m.badEdges, 0U);
  EXPECT_EQ(m.badPoints, 0U);
  EXPECT_EQ(m.unusedPoints, 0U);
  EXPECT_EQ(m.eulerCharacteristic, 2 - 3);
  EXPECT_EQ(surface.caps.size(), 3U);
}

TEST(SweepSurface, StenosisIsResolved)
{
  VesselTree tree;
  AddBranch(
    tree, 0, -1, 120, [](double t) { return Vector3(30.0 * t, 0.0, 0.0); },
    [](double t) { return 1.5 - 1.2 * std::exp(-std::pow((t - 0.5) / 0.06, 2.0)); });
  const SweptSurface surface = SweepVesselTree(tree, {});
  ExpectSound(surface, 1, "stenosis");
  double minimum = 10.0;
  for (const Vector3& p : surface.points)
  {
    if (std::abs(p[0] - 15.0) < 0.3)
    {
      minimum = std::min(minimum, std::hypot(p[1], p[2]));
    }
  }
  EXPECT_NEAR(minimum, 0.3, 0.02);
}

TEST(SweepSurface, SameTwice)
{
  const VesselTree tree = Fork(30.0, 1.8, 1.4, Vector3(5.0, 60.0, -9.0));
  const SweptSurface one = SweepVesselTree(tree, {});
  const SweptSurface other = SweepVesselTree(tree, {});
  EXPECT_EQ(one.points, other.points);
  EXPECT_EQ(one.triangles, other.triangles);
}

TEST(SweepSurface, Refusals)
{
  const VesselTree good = Straight(Vector3::Zero(), Vector3(10.0, 0.0, 0.0), 1.0);
  const auto messageOf = [](const VesselTree& tree, const SweepSettings& settings = {})
  { return MessageOf([&] { SweepVesselTree(tree, settings); }); };
  EXPECT_EQ(messageOf(good), "");
  VesselTree tree = good;
  tree.radius[3] = 0.0;
  EXPECT_NE(messageOf(tree).find("point 3"), std::string::npos);
  tree = good;
  tree.points[5][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(messageOf(tree).find("point 5"), std::string::npos);
  tree = good;
  tree.branches[0].points = { 0 };
  EXPECT_NE(messageOf(tree).find("no length"), std::string::npos);
  tree = good;
  tree.branches[0].points.push_back(9999);
  EXPECT_NE(messageOf(tree).find("9999"), std::string::npos);
  tree = good;
  tree.radius.pop_back();
  EXPECT_NE(messageOf(tree).find("radii"), std::string::npos);
  SweepSettings settings;
  settings.minimumEdgeLength = -1.0;
  EXPECT_NE(messageOf(good, settings), "");
  settings = {};
  settings.blending = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(messageOf(good, settings), "");
  EXPECT_TRUE(SweepVesselTree({}, {}).points.empty());
}

TEST(SweepSurface, Cancels)
{
  const VesselTree tree = Straight(Vector3::Zero(), Vector3(10.0, 0.0, 0.0), 1.0);
  EXPECT_THROW(SweepVesselTree(tree, {}, {}, [](double) { return false; }), Cancelled);
}

TEST(TriangleIntersections, TetrahedraApartTouchingAndInEachOther)
{
  for (const double shift : { 2.0, 0.25 })
  {
    std::vector<Vector3> points;
    std::vector<Triangle> triangles;
    AddTetrahedron(points, triangles, Vector3::Zero());
    EXPECT_TRUE(FindSelfIntersections(points, triangles).empty());
    AddTetrahedron(points, triangles, Vector3(shift, 0.1, 0.1));
    EXPECT_EQ(FindSelfIntersections(points, triangles).empty(), shift > 1.0);
  }
}

TEST(TriangleIntersections, FoldsAndFlatFans)
{
  // A fan in an oblique plane, where rounding alone says which side a point is on.
  const Vector3 u = Vector3(0.3, 0.4, 0.7).normalized();
  const Vector3 v = u.unitOrthogonal();
  std::vector<Vector3> points{ Vector3(13.7, -51.3, 7.1) };
  std::vector<Triangle> triangles;
  constexpr int n = 23;
  for (int i = 0; i < n; ++i)
  {
    const double a = 2.0 * Pi * i / n;
    points.push_back(points[0] + std::cos(a) * u + std::sin(a) * v);
    triangles.push_back({ 0, i + 1, (i + 1) % n + 1 });
  }
  EXPECT_TRUE(FindSelfIntersections(points, triangles).empty());
  // A triangle folded back on its neighbour.
  const std::vector<Vector3> flat{ { 0, 0, 0 }, { 1, 0, 0 }, { 0.3, 1, 0 }, { 0.4, 0.8, 0 } };
  const auto pairs = FindSelfIntersections(flat, { { 0, 1, 2 }, { 1, 0, 3 } });
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0], (std::pair<std::int64_t, std::int64_t>(0, 1)));
}

TEST(TriangleIntersections, AHeapIsLeftAfterItsLimit)
{
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
  for (std::int64_t t = 0; t < 400; ++t)
  {
    for (int corner = 0; corner < 3; ++corner)
    {
      points.emplace_back(place(random), place(random), place(random));
    }
    triangles.push_back({ 3 * t, 3 * t + 1, 3 * t + 2 });
  }
  const auto all = FindSelfIntersections(points, triangles);
  SetNumberOfThreads(1);
  const auto some = FindSelfIntersections(points, triangles, 100);
  SetNumberOfThreads(3);
  EXPECT_EQ(FindSelfIntersections(points, triangles, 100), some);
  SetNumberOfThreads(0);
  EXPECT_GE(some.size(), 100U);
  EXPECT_LT(some.size(), all.size());
  EXPECT_TRUE(std::includes(all.begin(), all.end(), some.begin(), some.end()));
  EXPECT_EQ(FindSelfIntersections(points, triangles, all.size() + 1), all);
}
}
