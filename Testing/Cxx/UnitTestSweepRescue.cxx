// Trees that can not be swept as they are: what comes out is sound all the same, and what does not is
// named. Cuts of trees and repairs of triangles against known answers.

#include "SurfaceCheck.h"
#include "SweepRescue.h"
#include "SweepSurface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <string>

namespace UnitTestSweepRescue
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

/// A place with a radius, at a share of a branch.
using Curve = std::function<std::pair<Vector3, double>(double)>;

/// Adds a branch that begins in point `first`, -1 in one of its own. @return its points
std::vector<std::int64_t> Add(
  VesselTree& tree, int group, std::int64_t first, int steps, const Curve& curve)
{
  VesselTree::Branch branch;
  branch.groupId = group;
  branch.name = "Vessel" + std::to_string(group);
  for (int i = 0; i <= steps; ++i)
  {
    if (i == 0 && first >= 0)
    {
      branch.points.push_back(first);
      continue;
    }
    const auto [place, radius] = curve(static_cast<double>(i) / steps);
    branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.push_back(place);
    tree.radius.push_back(radius);
  }
  tree.branches.push_back(branch);
  return tree.branches.back().points;
}

Curve Line(const Vector3& from, const Vector3& to, double radius)
{
  return [=](double t) { return std::make_pair(Vector3(from + t * (to - from)), radius); };
}

/// What every surface of a hostile tree must be; and that nothing is lost in silence.
void ExpectSoundOrNamed(
  const VesselTree& tree, const SweptSurface& surface, const std::string& what)
{
  SCOPED_TRACE(what);
  ASSERT_FALSE(surface.triangles.empty());
  const ClosedSurface closed = CheckSurface(surface.points, surface.triangles);
  EXPECT_TRUE(closed.warnings.empty());
  CheckSelfIntersections(closed); // throws
  EXPECT_EQ(static_cast<int>(closed.volume.size()), surface.trees);
  EXPECT_EQ(static_cast<std::int64_t>(closed.points.size()) -
      static_cast<std::int64_t>(closed.triangles.size()) / 2,
    2 * surface.trees);
  std::set<int> told(surface.groupId.begin(), surface.groupId.end());
  for (const SweepLeftOut& part : surface.leftOut)
  {
    told.insert(part.groupId);
    EXPECT_FALSE(part.reason.empty());
    EXPECT_GT(part.length, 0.0);
    EXPECT_TRUE(part.place.allFinite());
    EXPECT_NE(part.vessel.find("Vessel" + std::to_string(part.groupId)), std::string::npos);
  }
  for (const VesselTree::Branch& branch : tree.branches)
  {
    EXPECT_EQ(told.count(branch.groupId), 1U) << "group " << branch.groupId << " is lost";
  }
  // Every change has its sentence.
  EXPECT_GE(surface.remarks.size(), surface.repairs.size());
  EXPECT_EQ(surface.leftOut.empty(), surface.leftOutPoints.empty());
}

/// A root that comes out of a wide mouth in an arc, with a side branch behind it.
VesselTree Mouth(double slope, double bendRadius)
{
  VesselTree tree;
  const double arc = 0.5 * Pi * bendRadius;
  const auto trunk = Add(tree, 0, -1, 100,
    [=](double t)
    {
      const double s = 40.0 * t;
      const double a = s / bendRadius;
      const Vector3 place = s < arc
        ? Vector3(bendRadius * (std::sin(a) - 1.0), 0.0, -bendRadius * std::cos(a))
        : Vector3(0.0, 0.0, s - arc);
      return std::make_pair(place, std::max(1.6, 4.6 - slope * s));
    });
  Add(tree, 1, trunk[60], 40, Line(tree.points[trunk[60]], Vector3(15.0, 3.0, 25.0), 1.0));
  return tree;
}

/// A trunk of radius 1.5 along z, 40 mm, and a branch of radius `radius` that leaves it at `at`.
VesselTree TrunkAnd(double at, double radius, const std::function<Vector3(double)>& curve)
{
  VesselTree tree;
  const auto trunk = Add(tree, 0, -1, 120, Line(Vector3::Zero(), Vector3(0.0, 0.0, 40.0), 1.5));
  Add(tree, 1, trunk[static_cast<std::size_t>(3.0 * at)], 60,
    [&](double t) { return std::make_pair(curve(t), radius); });
  return tree;
}

VesselTree Random(unsigned seed)
{
  std::mt19937 engine(seed);
  // The library's distributions differ between compilers.
  const auto uniform = [&](double low, double high)
  { return low + (high - low) * static_cast<double>(engine()) / 4294967296.0; };
  VesselTree tree;
  const auto walk = [&](int group, std::int64_t from, double length, double radius)
  {
    Vector3 place = from < 0 ? Vector3::Zero() : tree.points[from];
    Vector3 direction = from < 0
      ? Vector3::UnitZ()
      : Vector3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized();
    return Add(tree, group, from, std::max(3, static_cast<int>(2.0 * length)),
      [&](double t)
      {
        direction += Vector3(uniform(-0.12, 0.12), uniform(-0.12, 0.12), uniform(-0.12, 0.12));
        direction.normalize();
        place += 0.5 * direction;
        return std::make_pair(
          place, std::max(0.2, radius * (1.0 - 0.5 * t) * std::exp(uniform(-0.2, 0.2))));
      });
  };
  auto trunk = walk(0, -1, 35.0, 1.8);
  for (int group = 1; group < 4; ++group)
  {
    const double lengths[] = { 2.0, 8.0, 15.0 };
    walk(group, trunk[10 + 15 * group], lengths[group - 1], 1.0);
  }
  return tree;
}
}

TEST(SweepRescue, MouthsThatFoldOverTheirCaps)
{
  for (const double slope : { 0.5, 0.86, 1.2 })
  {
    for (const double bend : { 2.0, 4.0, 8.0 })
    {
      const VesselTree tree = Mouth(slope, bend);
      const SweptSurface surface = SweepVesselTree(tree, {});
      const std::string what = std::to_string(slope) + " " + std::to_string(bend);
      ExpectSoundOrNamed(tree, surface, what);
      EXPECT_TRUE(surface.leftOut.empty()) << what;
      ASSERT_EQ(surface.caps.size(), 3U) << what;
      // The inlet is still there, not far from where it was, and both ends of the tree are.
      EXPECT_LT((surface.caps[0].centre - tree.points[0]).norm(), 6.0) << what;
      EXPECT_LT((surface.caps[1].centre - tree.points[100]).norm(), 0.1) << what;
      if (bend < 4.6)
      {
        // Curvature times radius is above 1 at the cap.
        ASSERT_FALSE(surface.repairs.empty()) << what;
        EXPECT_EQ(surface.repairs[0].vessel, "Vessel0 (group 0)");
        EXPECT_LT((surface.repairs[0].place - tree.points[0]).norm(), 0.1);
      }
    }
  }
}

TEST(SweepRescue, TipsThatFlareAndCurl)
{
  for (const double slope : { 1.0, 2.0 })
  {
    VesselTree tree;
    Add(tree, 0, -1, 100,
      [=](double t)
      {
        return std::make_pair(
          Vector3(0.0, 0.0, 30.0 * t), 1.2 + slope * std::max(0.0, 30.0 * t - 28.0));
      });
    ExpectSoundOrNamed(tree, SweepVesselTree(tree, {}), "flare");
  }
  for (const double bend : { 0.5, 1.0, 1.5 })
  {
    VesselTree tree;
    Add(tree, 0, -1, 140,
      [=](double t)
      {
        const double s = 24.0 * t;
        const double a = std::max(0.0, s - 20.0) / bend;
        return std::make_pair(
          Vector3(bend * (1.0 - std::cos(a)), 0.1 * a, std::min(s, 20.0) + bend * std::sin(a)),
          1.2);
      });
    const SweptSurface surface = SweepVesselTree(tree, {});
    ExpectSoundOrNamed(tree, surface, "curl");
    EXPECT_EQ(surface.caps.size(), 2U);
  }
}

TEST(SweepRescue, BranchesThatRunBesideOrThroughOthers)
{
  for (const double gap : { 0.3, 1.0, 2.6 })
  {
    const VesselTree back = TrunkAnd(24.0, 1.0,
      [=](double t) { return Vector3(gap * std::min(1.0, 10.0 * t), 0.0, 24.0 - 15.0 * t); });
    ExpectSoundOrNamed(back, SweepVesselTree(back, {}), "back " + std::to_string(gap));
  }
  for (const double gap : { 0.2, 0.8 })
  {
    const VesselTree along = TrunkAnd(15.0, 0.8,
      [=](double t) { return Vector3(gap * std::min(1.0, 8.0 * t), 0.0, 15.0 + 20.0 * t); });
    ExpectSoundOrNamed(along, SweepVesselTree(along, {}), "along " + std::to_string(gap));
  }
  for (const double gap : { 0.0, 0.3, 2.0 })
  {
    VesselTree tree;
    Add(tree, 0, -1, 120, Line(Vector3::Zero(), Vector3(0.0, 0.0, 40.0), 1.5));
    Add(tree, 1, -1, 90, Line(Vector3(-15.0, gap, 20.0), Vector3(15.0, gap, 20.0), 1.0));
    const SweptSurface surface = SweepVesselTree(tree, {});
    ExpectSoundOrNamed(tree, surface, "crossing " + std::to_string(gap));
    EXPECT_EQ(surface.trees, 2);
    // The thicker one stays whole; of the other one half goes, or nothing.
    EXPECT_EQ(surface.leftOut.size(), gap < 1.0 ? 1U : 0U);
    for (const SweepLeftOut& part : surface.leftOut)
    {
      EXPECT_EQ(part.groupId, 1);
      EXPECT_NEAR(part.length, 17.5, 1.5);
      EXPECT_NE(surface.remarks.back().find("Vessel1 (group 1)"), std::string::npos);
    }
  }
}

TEST(SweepRescue, ShortBranchesStenosesAndSteps)
{
  for (const double length : { 0.3, 1.7, 2.2 })
  {
    const VesselTree tree =
      TrunkAnd(15.0, 0.8, [=](double t) { return Vector3(length * t, 0.0, 15.0); });
    ExpectSoundOrNamed(tree, SweepVesselTree(tree, {}), "short " + std::to_string(length));
  }
  for (const double width : { 0.4, 1.0 })
  {
    VesselTree tree;
    Add(tree, 0, -1, 240,
      [=](double t)
      {
        return std::make_pair(Vector3(30.0 * t, 0.8 * std::sin(6.0 * t), 0.0),
          1.6 - 1.4 * std::exp(-std::pow((30.0 * t - 15.0) / width, 2.0)));
      });
    const SweptSurface surface = SweepVesselTree(tree, {});
    ExpectSoundOrNamed(tree, surface, "stenosis " + std::to_string(width));
    EXPECT_TRUE(surface.leftOut.empty());
  }
  VesselTree tree;
  Add(tree, 0, -1, 90,
    [](double t) { return std::make_pair(Vector3(0.0, 0.0, 30.0 * t), t < 0.5 ? 2.0 : 0.6); });
  ExpectSoundOrNamed(tree, SweepVesselTree(tree, {}), "step");
}

TEST(SweepRescue, LoopsAreOpened)
{
  VesselTree tree;
  const auto trunk = Add(tree, 0, -1, 90, Line(Vector3::Zero(), Vector3(0.0, 0.0, 30.0), 1.5));
  Add(tree, 1, trunk[30], 60,
    [](double t)
    { return std::make_pair(Vector3(8.0 * std::sin(Pi * t), 0.0, 10.0 + 10.0 * t), 0.8); });
  tree.branches[1].points.back() = trunk[60];
  const SweptSurface surface = SweepVesselTree(tree, {});
  ExpectSoundOrNamed(tree, surface, "loop");
  ASSERT_EQ(surface.leftOut.size(), 1U);
  EXPECT_EQ(surface.leftOut[0].groupId, 1);
  EXPECT_NE(surface.leftOut[0].reason.find("loop"), std::string::npos);
  EXPECT_EQ(surface.caps.size(), 3U);
}

TEST(SweepRescue, RandomTrees)
{
  for (unsigned seed = 1; seed <= 3; ++seed)
  {
    const VesselTree tree = Random(seed);
    const SweptSurface surface = SweepVesselTree(tree, {});
    ExpectSoundOrNamed(tree, surface, "seed " + std::to_string(seed));
    if (seed == 1)
    {
      const SweptSurface again = SweepVesselTree(tree, {});
      EXPECT_EQ(surface.points, again.points);
      EXPECT_EQ(surface.remarks, again.remarks);
    }
  }
}

TEST(SweepRescue, NothingIsSaidOfHealthyVessels)
{
  const VesselTree tree =
    TrunkAnd(15.0, 0.9, [](double t) { return Vector3(14.0 * t, 0.0, 15.0 + 10.0 * t); });
  const SweptSurface surface = SweepVesselTree(tree, {});
  ExpectSoundOrNamed(tree, surface, "healthy");
  EXPECT_TRUE(surface.remarks.empty());
  EXPECT_TRUE(surface.repairs.empty());
  EXPECT_TRUE(surface.leftOut.empty());
  EXPECT_TRUE(surface.repaired.empty());
}

TEST(SweepRescue, CutsTakeWhatHangsBehindThem)
{
  // A trunk of 40 mm; one branch of 10 mm at 12, one of 20 mm at 30, and one of 5 mm on that.
  VesselTree whole;
  const auto trunk = Add(whole, 0, -1, 120, Line(Vector3::Zero(), Vector3(0.0, 0.0, 40.0), 1.0));
  Add(whole, 1, trunk[36], 30, Line(Vector3(0.0, 0.0, 12.0), Vector3(10.0, 0.0, 12.0), 0.5));
  const auto side =
    Add(whole, 2, trunk[90], 60, Line(Vector3(0.0, 0.0, 30.0), Vector3(20.0, 0.0, 30.0), 0.5));
  Add(whole, 3, side[30], 30, Line(Vector3(10.0, 0.0, 30.0), Vector3(10.0, 5.0, 30.0), 0.4));

  VesselTree tree = whole;
  SweepCut cut = CutTree(tree, 0, Vector3(0.0, 0.0, 20.0), 2.0 - 1e-9);
  ASSERT_EQ(tree.branches.size(), 2U);
  EXPECT_NEAR(cut.length, 22.0 + 20.0 + 5.0, 1e-6);
  EXPECT_EQ(cut.parts.size(), 3U);
  EXPECT_EQ(cut.parts[0].groupId, 0);
  EXPECT_NEAR(cut.parts[0].place[2], 18.0, 1e-6);
  EXPECT_NEAR(tree.points[tree.branches[0].points.back()][2], 18.0, 1e-6);

  // A branch near its beginning goes as a whole, with what hangs on it; the parent stays.
  tree = whole;
  cut = CutTree(tree, 2, Vector3(1.0, 0.0, 30.0), 1.0);
  EXPECT_NEAR(cut.length, 25.0, 1e-6);
  ASSERT_EQ(tree.branches.size(), 2U);
  EXPECT_EQ(tree.branches[0].points, whole.branches[0].points);

  // At the root the part before the place goes.
  tree = whole;
  cut = CutTree(tree, 0, Vector3(0.0, 0.0, 0.5), 2.0);
  EXPECT_EQ(tree.branches.size(), 4U);
  EXPECT_NEAR(cut.length, 40.0 - 40.0 * 112.0 / 120.0, 1e-6);
  EXPECT_TRUE(CutTree(tree, 77, Vector3::Zero(), 1.0).parts.empty());
}

TEST(SweepRescue, TrianglesAreReplacedWhereTheyAreBad)
{
  VesselTree tree;
  Add(tree, 0, -1, 60, Line(Vector3::Zero(), Vector3(0.0, 0.0, 20.0), 1.5));
  const SweptSurface surface = SweepVesselTree(tree, {});
  RescueMesh mesh;
  for (const Vector3& p : surface.points)
  {
    RemeshVertex vertex;
    vertex.position = p;
    mesh.vertices.push_back(vertex);
  }
  mesh.triangles = surface.triangles;
  mesh.entity = surface.entityId;
  // A point of the wall is drawn through the opposite wall.
  std::size_t moved = 0;
  for (std::size_t i = 0; i < surface.points.size(); ++i)
  {
    const Vector3 wanted(1.5, 0.0, 10.0);
    moved =
      (surface.points[i] - wanted).norm() < (surface.points[moved] - wanted).norm() ? i : moved;
  }
  mesh.vertices[moved].position[0] -= 4.0;
  const RescueMesh broken = mesh;
  EXPECT_FALSE(CleanSweptMesh(mesh, 2, 1.0)); // there is only one
  EXPECT_EQ(mesh.triangles, broken.triangles);
  ASSERT_TRUE(CleanSweptMesh(mesh, 1, 1.0));
  std::vector<Vector3> points;
  for (const RemeshVertex& vertex : mesh.vertices)
  {
    points.push_back(vertex.position);
  }
  EXPECT_TRUE(CellsThatFail(points, mesh.triangles).empty());
  const std::set<int> entities(mesh.entity.begin(), mesh.entity.end());
  EXPECT_EQ(entities, (std::set<int>{ 1, 2, 3 }));
  ASSERT_EQ(mesh.replaced.size(), points.size());
  std::size_t changed = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    changed += mesh.replaced[i];
    if (mesh.replaced[i] != 0)
    {
      EXPECT_NEAR(points[i][2], 10.0, 4.0);
    }
    EXPECT_LT(std::hypot(points[i][0], points[i][1]), 1.5 + 1e-6);
  }
  EXPECT_GT(changed, 0U);
  EXPECT_LT(changed, points.size() / 3);
}
}
