// Motions of walls: exact where they are known, periodic, and the phantom's lumen around its own axis.

#include "Refusals.h"
#include "VesselWall.h"
#include "WallMotions.h"
#include "WallTestMeshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace UnitTestWallMotions
{
using namespace coronary;

namespace
{
struct Mesh
{
  WallTopology topology;
  std::vector<Vector3> points;
};

Mesh Tube()
{
  Mesh mesh;
  AppendTube(mesh.topology, mesh.points, 0.0, 1.0, 20.0, 16, 40);
  return mesh;
}

Vector3 Beat(const Vector3& p, double phase)
{
  const double s = std::sin(2.0 * M_PI * phase) + 0.3 * std::cos(4.0 * M_PI * phase);
  return p + s * Vector3(3.0, 0.02 * p[2], -0.1 * p[2]);
}

std::vector<Vector3> BeatAll(const std::vector<Vector3>& points, double phase)
{
  std::vector<Vector3> moved;
  for (const Vector3& p : points)
  {
    moved.push_back(Beat(p, phase));
  }
  return moved;
}

double Difference(const std::vector<Vector3>& a, const std::vector<Vector3>& b)
{
  double worst = a.size() == b.size() ? 0.0 : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
  {
    worst = std::max(worst, (a[i] - b[i]).norm());
  }
  return worst;
}

/// Bones of 5 mm along z.
Skeleton Chain(int bones)
{
  Skeleton chain;
  for (int j = 0; j <= bones; ++j)
  {
    chain.joints.emplace_back(0.0, 0.0, 5.0 * j);
    chain.radius.push_back(1.0);
    chain.parent.push_back(j - 1);
    chain.abscissa.push_back(5.0 * j);
    if (j > 0)
    {
      Skeleton::Bone bone;
      bone.first = j - 1;
      bone.second = j;
      bone.id = j - 1;
      bone.name = "bone" + std::to_string(j);
      bone.length = 5.0;
      chain.bones.push_back(bone);
    }
  }
  return chain;
}
}

TEST(WallMotions, SamplesAreExactAndWhatIsBetweenConverges)
{
  const Mesh mesh = Tube();
  double before = 0.0;
  for (const int count : { 10, 20, 40 })
  {
    std::vector<double> phases;
    std::vector<std::vector<Vector3>> positions;
    std::vector<std::vector<Vector3>> axis;
    for (int k = 0; k < count; ++k)
    {
      // Uneven, in no order, and of several cycles.
      const int j = 3 * k % count;
      phases.push_back((j + 0.2 * (j % 2)) / count + k % 3 - 1);
      positions.push_back(BeatAll(mesh.points, phases.back()));
      axis.push_back(BeatAll(mesh.topology.axis[0], phases.back()));
    }
    SampledWallMotion motion(mesh.topology, phases, positions, axis);
    std::vector<Vector3> found;
    double worst = 0.0;
    for (int k = 0; k < count; ++k)
    {
      const double inCycle = phases[k] - std::floor(phases[k]);
      motion.Positions(inCycle, found);
      EXPECT_EQ(Difference(found, positions[k]), 0.0);
      motion.Positions(phases[k] + 7.0, found);
      EXPECT_LT(Difference(found, positions[k]), 1e-10);
    }
    for (double phase = -1.0; phase < 1.0; phase += 0.0137)
    {
      motion.Positions(phase, found);
      worst = std::max(worst, Difference(found, BeatAll(mesh.points, phase)));
      motion.AxisPositions(phase, found);
      EXPECT_LT(Difference(found, BeatAll(mesh.topology.axis[0], phase)), 0.2);
    }
    // Of fourth order.
    if (before > 0.0)
    {
      EXPECT_LT(worst, before / 8.0) << count;
    }
    before = worst;
  }
  EXPECT_LT(before, 1e-3);
}

TEST(WallMotions, FewSamples)
{
  const Mesh mesh = Tube();
  std::vector<Vector3> found;
  SampledWallMotion one(mesh.topology, { 0.4 }, { mesh.points });
  one.Positions(0.9, found);
  EXPECT_EQ(Difference(found, mesh.points), 0.0);
  one.AxisPositions(0.1, found);
  EXPECT_EQ(Difference(found, mesh.topology.axis[0]), 0.0);
  SampledWallMotion two(
    mesh.topology, { 0.25, 0.75 }, { BeatAll(mesh.points, 0.25), BeatAll(mesh.points, 0.75) });
  two.Positions(0.75, found);
  EXPECT_EQ(Difference(found, BeatAll(mesh.points, 0.75)), 0.0);
  two.Positions(std::nan(""), found);
  for (const Vector3& p : found)
  {
    ASSERT_TRUE(p.allFinite());
  }
  StillWallMotion still(mesh.topology, mesh.points);
  still.Positions(0.3, found);
  EXPECT_EQ(Difference(found, mesh.points), 0.0);
  still.AxisPositions(0.3, found);
  EXPECT_EQ(Difference(found, mesh.topology.axis[0]), 0.0);
}

TEST(WallMotions, SkinFollowsARigidSkeleton)
{
  const Mesh mesh = Tube();
  const Skeleton chain = Chain(4);
  // The skin has other points before and between those of the wall.
  CompactSkinWeights weights;
  weights.influences = 2;
  std::vector<std::int64_t> skinned;
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
  {
    for (const bool wall : { false, true })
    {
      const double at = std::clamp(mesh.points[i][2] / 5.0, 0.0, 3.999);
      const int bone = wall ? static_cast<int>(at) : 0;
      weights.bone.insert(weights.bone.end(), { bone, std::min(bone + 1, 3) });
      weights.weight.insert(weights.weight.end(), { 0.7f, 0.3f });
    }
    skinned.push_back(static_cast<std::int64_t>(2 * i + 1));
  }
  const auto rigid = [](const Vector3& p, double phase)
  {
    return Vector3(
      Eigen::AngleAxisd(0.5 * std::sin(2.0 * M_PI * phase), Vector3(1, 1, 0).normalized()) * p +
      Vector3(10.0 * phase * (1.0 - phase), 0.0, 0.0));
  };
  PoseSequence poses;
  for (int k = 0; k < 20; ++k)
  {
    poses.times.push_back(k / 20.0);
    poses.points.emplace_back();
    poses.rotation.emplace_back(4,
      Eigen::Quaterniond(
        Eigen::AngleAxisd(0.5 * std::sin(0.1 * M_PI * k), Vector3(1, 1, 0).normalized())));
    for (const Vector3& p : chain.joints)
    {
      poses.points.back().push_back(rigid(p, k / 20.0));
    }
  }
  SkinnedWallMotion motion(mesh.topology, mesh.points, weights, skinned, chain, poses);
  std::vector<Vector3> found;
  for (int k = 0; k < 20; ++k)
  {
    motion.Positions(k / 20.0, found);
    ASSERT_EQ(found.size(), mesh.points.size());
    for (std::size_t i = 0; i < found.size(); ++i)
    {
      ASSERT_NEAR((found[i] - rigid(mesh.points[i], k / 20.0)).norm(), 0.0, 1e-5);
    }
    motion.AxisPositions(k / 20.0 - 3.0, found);
    ASSERT_EQ(found.size(), mesh.topology.axis[0].size());
    for (std::size_t i = 0; i < found.size(); ++i)
    {
      ASSERT_NEAR((found[i] - rigid(mesh.topology.axis[0][i], k / 20.0)).norm(), 0.0, 1e-5);
    }
  }
  // Sampled, it is the same at the samples and nearly so between them.
  const std::shared_ptr<WallMotion> sampled = SampleWallMotion(motion, 40);
  std::vector<Vector3> exact;
  for (const double phase : { 0.1, 0.3375, 0.8125 })
  {
    motion.Positions(phase, exact);
    sampled->Positions(phase, found);
    const double tolerance = phase == 0.1 ? 1e-5 : 0.02;
    for (std::size_t i = 0; i < found.size(); ++i)
    {
      ASSERT_LT((found[i] - exact[i]).norm(), tolerance) << phase;
    }
  }
  EXPECT_THROW(SampleWallMotion(motion, 3), std::invalid_argument);
  skinned[5] = 1000000;
  ExpectRefusal([&]
    { SkinnedWallMotion(mesh.topology, mesh.points, weights, skinned, chain, poses); },
    "point 5 of the wall is point 1000000");
  poses.points[0].pop_back();
  EXPECT_THROW(SkinnedWallMotion(mesh.topology, mesh.points, weights, {}, chain, poses),
    std::invalid_argument);
}

TEST(WallMotions, PhantomSurroundsItsAxis)
{
  PhantomSettings settings;
  settings.centerlineSpacing = 2.0;
  settings.calibre = 1.6;
  const std::shared_ptr<WallMotion> motion = MakePhantomWallMotion(settings, 1.0, 6);
  const WallTopology& topology = motion->Topology();
  ASSERT_GT(topology.axis.size(), 10u);
  int roots = 0;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    roots += topology.parent[b] < 0;
    EXPECT_LT(topology.parent[b], static_cast<int>(topology.axis.size()));
    if (topology.parent[b] >= 0)
    {
      EXPECT_EQ((topology.axis[b].front() - topology.axis[topology.parent[b]].back()).norm(), 0.0);
    }
  }
  EXPECT_EQ(roots, 2);
  EXPECT_NE(std::find(topology.groupName.begin(), topology.groupName.end(), "mLAD"),
    topology.groupName.end());
  std::vector<Vector3> points;
  std::vector<Vector3> axis;
  motion->Positions(-0.02, points);
  VesselWall wall(topology, points);
  std::int64_t sameBranch = 0;
  std::int64_t all = 0;
  for (int phase = 0; phase < 20; ++phase)
  {
    // What is between the samples of the motion moves the axis as it does the wall, but for the spline.
    motion->Positions(phase / 20.0, points);
    motion->AxisPositions(phase / 20.0, axis);
    wall.BeginFrame(points, 0.016);
    wall.SetTime(0.016);
    std::size_t n = 0;
    for (std::size_t b = 0; b < topology.axis.size(); ++b)
    {
      for (std::size_t i = 0; i < topology.axis[b].size(); ++i, ++n)
      {
        const double radius = topology.axisRadius[b][i];
        // Caps are nearer than walls.
        const auto nearTo = [&](const Vector3& end)
        { return (topology.axis[b][i] - end).norm() < 1.5 * radius; };
        const bool end = nearTo(topology.axis[b].front()) || nearTo(topology.axis[b].back());
        const WallPlace place = wall.Closest(axis[n]);
        if (!end)
        {
          // Bifurcations are wider than their branches.
          ASSERT_GT(place.distance, 0.75 * radius) << b << " " << i << " " << phase;
          const int parent = topology.parent[b];
          const double wide =
            parent < 0 ? radius : std::max(radius, topology.axisRadius[parent].back());
          ASSERT_LT(place.distance, 1.15 * wide + 0.3) << b << " " << i << " " << phase;
          sameBranch += place.branch == static_cast<int>(b);
          ++all;
        }
      }
    }
    ASSERT_EQ(n, axis.size());
  }
  EXPECT_GT(sameBranch, all * 9 / 10);
}

TEST(WallMotions, RefuseWhatDoesNotFit)
{
  const Mesh mesh = Tube();
  ExpectRefusal([&] { SampledWallMotion(mesh.topology, {}, {}); }, "0 phases");
  ExpectRefusal(
    [&] {
      SampledWallMotion(mesh.topology, { 0.1, 1.1 }, { mesh.points, mesh.points });
    },
    "nearer than 0.001");
  ExpectRefusal(
    [&] { SampledWallMotion(mesh.topology, { std::nan("") }, { mesh.points }); }, "phase 0");
  ExpectRefusal([&]
    { SampledWallMotion(mesh.topology, { 0.0 }, { mesh.points }, { mesh.points }); },
    "moves with");
  std::vector<Vector3> points = mesh.points;
  points[7][2] = std::numeric_limits<double>::infinity();
  ExpectRefusal([&] { SampledWallMotion(mesh.topology, { 0.0 }, { points }); }, "point 7");
  Mesh spoiled = mesh;
  spoiled.topology.parent[0] = 0;
  ExpectRefusal([&] { StillWallMotion(spoiled.topology, spoiled.points); }, "no way to a root");
  spoiled = mesh;
  spoiled.topology.axisRadius[0][2] = 0.0;
  ExpectRefusal([&] { StillWallMotion(spoiled.topology, spoiled.points); }, "at its point 2");
  spoiled = mesh;
  spoiled.topology.group[4] = 3;
  ExpectRefusal([&] { StillWallMotion(spoiled.topology, spoiled.points); }, "is of group 3");
  spoiled = mesh;
  spoiled.topology.triangles.pop_back();
  spoiled.topology.entity.pop_back();
  ExpectRefusal([&] { StillWallMotion(spoiled.topology, spoiled.points); }, "two triangles");
  PhantomSettings settings;
  settings.beatVariation = 0.05;
  ExpectRefusal([&] { MakePhantomWallMotion(settings, 0.5); }, "beatVariation");
  settings.beatVariation = 0.0;
  settings.beatIrregularity = 1.5;
  ExpectRefusal([&] { MakePhantomWallMotion(settings, 0.5); }, "beatIrregularity");
  ExpectRefusal([&] { MakePhantomWallMotion({}, 0.5, 2); }, "phases");
  ExpectRefusal([&] { MakePhantomWallMotion({}, 50.0); }, "surfaceSpacing");
}
}
