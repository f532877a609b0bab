// What has to hold whatever the input is: random trees and poses, and geometry that is none. An algorithm gives finite
// results, or one clear exception.
#include "BiharmonicSkinWeights.h"
#include "CenterlineSkeleton.h"
#include "CenterlineTopology.h"
#include "CounterRandom.h"
#include "MeshDistance.h"
#include "MotionRegularization.h"
#include "MotionTestData.h"
#include "PeriodicSpline.h"
#include "PhaseInterpolation.h"
#include "SkeletonPose.h"
#include "SkinDeformation.h"
#include "SurfaceCleaning.h"
#include "SweepSurface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace UnitTestProperties
{
using namespace coronary;

namespace
{
constexpr double Nan = std::numeric_limits<double>::quiet_NaN();
constexpr double Infinity = std::numeric_limits<double>::infinity();

Vector3 RandomDirection(RandomStream& random)
{
  for (;;)
  {
    const Vector3 v(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1));
    if (v.norm() > 0.1 && v.norm() < 1.0)
    {
      return v.normalized();
    }
  }
}

/// Lines from one root: a trunk, and branches that leave it and each other sideways.
Polylines RandomTree(std::uint64_t seed)
{
  RandomStream random(seed);
  Polylines set;
  const auto grow = [&](std::int64_t from, Vector3 direction, double radius, int steps)
  {
    std::vector<std::int64_t> line{ from };
    for (int n = 0; n < steps; ++n)
    {
      direction = (direction + 0.12 * RandomDirection(random)).normalized();
      set.points.push_back(set.points[static_cast<std::size_t>(line.back())] + 0.8 * direction);
      set.radius.push_back(radius * (1.0 - 0.3 * n / steps));
      line.push_back(static_cast<std::int64_t>(set.points.size()) - 1);
    }
    set.lines.push_back(line);
    return direction;
  };
  set.points = { Vector3::Zero() };
  set.radius = { 2.0 };
  const Vector3 trunk = grow(0, RandomDirection(random), 2.0, 30);
  const std::uint64_t branches = 1 + random.Bits() % 3;
  for (std::uint64_t b = 0; b < branches; ++b)
  {
    const Vector3 side = trunk.cross(RandomDirection(random)).normalized();
    const auto start = static_cast<std::size_t>(8 + 7 * b);
    grow(set.lines[0][start], (trunk + 1.5 * side).normalized(), 1.1, 20);
  }
  return set;
}

Polylines Moved(Polylines set, const Eigen::Isometry3d& motion)
{
  for (Vector3& point : set.points)
  {
    point = motion * point;
  }
  return set;
}

Eigen::Isometry3d RandomMotion(std::uint64_t seed)
{
  RandomStream random(seed);
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.rotate(Eigen::AngleAxisd(random.Uniform(0, 3), RandomDirection(random)));
  motion.pretranslate(50.0 * RandomDirection(random));
  return motion;
}

bool AllFinite(const std::vector<Vector3>& points)
{
  for (const Vector3& point : points)
  {
    if (!point.allFinite())
    {
      return false;
    }
  }
  return true;
}

/// Edges that are not between two triangles of opposite directions.
std::size_t OpenEdges(const std::vector<Triangle>& triangles)
{
  std::map<std::pair<std::int64_t, std::int64_t>, int> edges;
  for (const Triangle& triangle : triangles)
  {
    for (std::size_t c = 0; c < 3; ++c)
    {
      const std::int64_t a = triangle[c];
      const std::int64_t b = triangle[(c + 1) % 3];
      edges[{ std::min(a, b), std::max(a, b) }] += a < b ? 1 : -1;
    }
  }
  std::size_t open = 0;
  for (const auto& [edge, balance] : edges)
  {
    open += balance != 0 ? 1 : 0;
  }
  return open;
}

double Volume(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  double volume = 0.0;
  for (const Triangle& t : triangles)
  {
    const auto at = [&](int n) { return points[static_cast<std::size_t>(t[n])]; };
    volume += at(0).dot(at(1).cross(at(2))) / 6.0;
  }
  return volume;
}

/// True when it ends well, false when it says why not. Anything else fails the test.
bool EndsWellOrSaysWhy(const std::string& name, const std::function<void()>& action)
{
  try
  {
    action();
    return true;
  }
  catch (const std::invalid_argument& error)
  {
    EXPECT_STRNE(error.what(), "") << name;
  }
  catch (const std::runtime_error& error)
  {
    EXPECT_STRNE(error.what(), "") << name;
  }
  catch (const std::exception& error)
  {
    ADD_FAILURE() << name << ": " << error.what();
  }
  return false;
}

SurfaceMesh Tetrahedron()
{
  SurfaceMesh mesh;
  mesh.points = { { 0, 0, 0 }, { 2, 0, 0 }, { 0, 2, 0 }, { 0, 0, 2 } };
  mesh.triangles = { { 0, 2, 1 }, { 0, 1, 3 }, { 1, 2, 3 }, { 0, 3, 2 } };
  return mesh;
}
}

TEST(RandomTrees, TopologyIsATreeThatMovesWithItsPoints)
{
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
  {
    const Polylines set = RandomTree(seed);
    const CenterlineTopology topology = BuildTopology(set, {}, { Vector3::Zero() });
    ASSERT_NO_THROW(CheckTree(topology)) << seed;
    EXPECT_EQ(topology.trees, 1) << seed;
    for (const VesselTree::Branch& branch : topology.branches)
    {
      EXPECT_GT(branch.length, 0.0) << seed;
      EXPECT_GE(branch.tortuosity, -1e-12) << seed;
      EXPECT_GE(branch.strahlerOrder, 1) << seed;
    }
    EXPECT_TRUE(AllFinite(topology.tangent) && AllFinite(topology.normal)) << seed;

    const Eigen::Isometry3d motion = RandomMotion(seed);
    const CenterlineTopology moved =
      BuildTopology(Moved(set, motion), {}, { motion * Vector3::Zero() });
    ASSERT_EQ(moved.branches.size(), topology.branches.size()) << seed;
    ASSERT_EQ(moved.points.size(), topology.points.size()) << seed;
    for (std::size_t p = 0; p < moved.points.size(); ++p)
    {
      ASSERT_LT((moved.points[p] - motion * topology.points[p]).norm(), 1e-6) << seed;
    }
  }
}

TEST(RandomTrees, SurfacesAreClosedAndOutside)
{
  SweepSettings settings;
  settings.minimumEdgeLength = 0.5;
  settings.maximumEdgeLength = 1.5;
  for (const std::uint64_t seed : { 1, 2 })
  {
    const CenterlineTopology topology = BuildTopology(RandomTree(seed));
    const SweptSurface surface = SweepVesselTree(topology, settings);
    EXPECT_EQ(OpenEdges(surface.triangles), 0U) << seed;
    EXPECT_TRUE(AllFinite(surface.points) && AllFinite(surface.normals)) << seed;
    EXPECT_GT(Volume(surface.points, surface.triangles), 0.0) << seed;
    EXPECT_EQ(surface.trees, 1) << seed;
  }
}

TEST(RandomTrees, SkeletonsFollowRandomPoses)
{
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
  {
    RandomStream random(seed + 100);
    const CenterlineTopology topology = BuildTopology(RandomTree(seed));
    const Skeleton skeleton = MakeCenterlineSkeleton(topology);
    ASSERT_NO_THROW(CheckSkeleton(skeleton)) << seed;
    const SkeletonRig rig(skeleton);
    SkeletonPose pose = rig.RestPose();
    for (Vector3& joint : pose.joints)
    {
      joint += 3.0 * RandomDirection(random);
    }
    std::vector<BoneTransform> transforms;
    rig.Transform(pose, transforms);
    for (std::size_t b = 0; b < transforms.size(); ++b)
    {
      const BoneTransform& bone = transforms[b];
      EXPECT_TRUE(std::isfinite(bone.stretch) && bone.stretch > 0.0) << seed;
      EXPECT_NEAR(bone.rotation.norm(), 1.0, 1e-9) << seed;
      // The bone arrives where its joints are.
      const Vector3 end = bone.posedHead +
        bone.rotation *
          (bone.stretch * rig.Length(static_cast<std::int64_t>(b)) *
            rig.Direction(static_cast<std::int64_t>(b)));
      const auto second = static_cast<std::size_t>(skeleton.bones[b].second);
      EXPECT_LT((end - pose.joints[second]).norm(), 1e-9) << seed;
    }
  }
}

TEST(RandomTrees, RigidPosesCarryTheSkinRigidly)
{
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed + 200);
    const Skeleton skeleton = MakeCenterlineSkeleton(BuildTopology(RandomTree(seed)));
    const auto bones = static_cast<std::int32_t>(skeleton.bones.size());
    std::vector<Vector3> points;
    CompactSkinWeights weights;
    weights.influences = 2;
    for (int p = 0; p < 200; ++p)
    {
      points.push_back(20.0 * RandomDirection(random));
      const double share = random.Uniform(0.0, 1.0);
      weights.bone.push_back(static_cast<std::int32_t>(random.Bits() % bones));
      weights.bone.push_back(static_cast<std::int32_t>(random.Bits() % bones));
      weights.weight.push_back(static_cast<float>(share));
      weights.weight.push_back(static_cast<float>(1.0 - share));
      weights.dropped.push_back(0.0F);
    }
    const Eigen::Isometry3d motion = RandomMotion(seed);
    for (const SkinBlend blend : { SkinBlend::Linear, SkinBlend::DualQuaternion })
    {
      SkinDeformationSettings settings;
      settings.blend = blend;
      SkinDeformation skin(points, weights, skeleton, settings);
      SkeletonPose pose = skin.Rig().RestPose();
      for (Vector3& joint : pose.joints)
      {
        joint = motion * joint;
      }
      std::vector<double> moved(3 * points.size());
      pose.rotation.assign(skeleton.bones.size(), Quaternion(motion.linear()));
      skin.Deform(pose, moved.data());
      for (std::size_t p = 0; p < points.size(); ++p)
      {
        const Vector3 at(moved[3 * p], moved[3 * p + 1], moved[3 * p + 2]);
        ASSERT_LT((at - motion * points[p]).norm(), 1e-6) << seed << " point " << p;
      }
    }
  }
}

TEST(DegenerateTrees, FiniteOrRefused)
{
  const Polylines good = RandomTree(1);
  const auto changed = [&](const std::function<void(Polylines&)>& change)
  {
    Polylines set = good;
    change(set);
    return set;
  };
  const auto scaled = [&](double factor)
  {
    return changed(
      [&](Polylines& set)
      {
        for (Vector3& point : set.points)
        {
          point *= factor;
        }
        for (double& radius : set.radius)
        {
          radius *= factor;
        }
      });
  };
  const std::map<std::string, Polylines> sets = {
    { "nothing", {} },
    { "nan", changed([](Polylines& s) { s.points[5].x() = Nan; }) },
    { "infinite", changed([](Polylines& s) { s.points[5].x() = Infinity; }) },
    { "nan radius", changed([](Polylines& s) { s.radius[5] = Nan; }) },
    { "negative radius", changed([](Polylines& s) { s.radius[5] = -1.0; }) },
    { "no radii", changed([](Polylines& s) { s.radius.clear(); }) },
    { "one point", { { Vector3::Zero() }, { 1.0 }, { { 0 } }, {} } },
    { "line without length",
      { { Vector3::Zero(), Vector3::Zero() }, { 1.0, 1.0 }, { { 0, 1 } }, {} } },
    { "all points the same",
      changed([](Polylines& s) { s.points.assign(s.points.size(), Vector3(1, 2, 3)); }) },
    { "straight",
      changed(
        [](Polylines& s)
        {
          for (std::size_t p = 0; p < s.points.size(); ++p)
          {
            s.points[p] = Vector3(0.8 * static_cast<double>(p), 0, 0);
          }
        }) },
    { "every line twice",
      changed(
        [](Polylines& s)
        {
          const auto lines = s.lines;
          s.lines.insert(s.lines.end(), lines.begin(), lines.end());
        }) },
    { "there and back",
      changed(
        [](Polylines& s)
        {
          const std::vector<std::int64_t> line = s.lines[0];
          s.lines[0].insert(s.lines[0].end(), line.rbegin(), line.rend());
        }) },
    { "index outside", changed([](Polylines& s) { s.lines[0][3] = 1 << 20; }) },
    { "index negative", changed([](Polylines& s) { s.lines[0][3] = -1; }) },
    { "empty line", changed([](Polylines& s) { s.lines.emplace_back(); }) },
    { "tiny", scaled(1e-9) },
    { "huge", scaled(1e9) },
    { "beyond", scaled(1e300) },
  };
  for (const auto& [name, set] : sets)
  {
    CenterlineTopology topology;
    if (!EndsWellOrSaysWhy(name, [&, &input = set] { topology = BuildTopology(input); }))
    {
      continue;
    }
    EXPECT_TRUE(AllFinite(topology.points)) << name;
    for (const VesselTree::Branch& branch : topology.branches)
    {
      EXPECT_TRUE(std::isfinite(branch.length)) << name;
    }
    EndsWellOrSaysWhy(name + " skeleton",
      [&, &label = name]
      {
        const Skeleton skeleton = MakeCenterlineSkeleton(topology);
        EXPECT_TRUE(AllFinite(skeleton.joints)) << label;
      });
  }
}

TEST(DegenerateTrees, SurfacesAreClosedOrRefused)
{
  VesselTree good;
  good.points = { { 0, 0, 0 }, { 0, 0, 2 }, { 0, 0, 4 }, { 0, 0, 6 } };
  good.radius = { 1.0, 1.0, 1.0, 1.0 };
  good.branches = { { { 0, 1, 2, 3 }, 0 } };
  const auto changed = [&](const std::function<void(VesselTree&)>& change)
  {
    VesselTree tree = good;
    change(tree);
    return tree;
  };
  // Of a branched tree, whose junction has to be meshed too.
  const auto scaled = [](double factor)
  {
    VesselTree tree = BuildTopology(RandomTree(1));
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      tree.points[p] *= factor;
      tree.radius[p] *= factor;
    }
    return tree;
  };
  const std::map<std::string, VesselTree> trees = {
    { "good", good },
    { "nothing", {} },
    { "nan", changed([](VesselTree& t) { t.points[1].x() = Nan; }) },
    { "infinite", changed([](VesselTree& t) { t.points[1].x() = Infinity; }) },
    { "no radius", changed([](VesselTree& t) { t.radius[2] = 0.0; }) },
    { "nan radius", changed([](VesselTree& t) { t.radius[2] = Nan; }) },
    { "one point", changed([](VesselTree& t) { t.branches[0].points = { 1 }; }) },
    { "no point", changed([](VesselTree& t) { t.branches[0].points = {}; }) },
    { "outside", changed([](VesselTree& t) { t.branches[0].points[1] = 99; }) },
    { "all the same",
      changed([](VesselTree& t) { t.points.assign(t.points.size(), Vector3(1, 2, 3)); }) },
    { "a point twice", changed([](VesselTree& t) { t.points[2] = t.points[1]; }) },
    { "tiny", scaled(1e-9) },
    { "small", scaled(1e-6) },
    { "huge", scaled(1e9) },
    { "beyond", scaled(1e300) },
    { "doubled",
      changed(
        [](VesselTree& t)
        {
          t.points.insert(t.points.end(), t.points.begin(), t.points.end());
          t.radius.assign(8, 1.0);
          t.branches.push_back({ { 4, 5, 6, 7 }, 1 });
        }) },
    { "a side branch within the trunk",
      changed(
        [](VesselTree& t)
        {
          t.points.insert(t.points.end(), { { 0.1, 0, 4 }, { 0.2, 0, 6 }, { 0.3, 0, 9 } });
          t.radius.assign(7, 1.0);
          t.branches.push_back({ { 1, 4, 5, 6 }, 1 });
        }) },
    { "two branches one on the other",
      changed(
        [](VesselTree& t)
        {
          t.points.insert(
            t.points.end(), { { 0, 0, 8 }, { 0, 0, 10 }, { 0, 0, 7.5 }, { 0, 0, 11 } });
          t.radius.assign(8, 1.0);
          t.branches.push_back({ { 3, 4, 5 }, 1 });
          t.branches.push_back({ { 3, 6, 7 }, 2 });
        }) },
    { "back into the trunk",
      changed(
        [](VesselTree& t)
        {
          t.points.insert(t.points.end(), { { 0, 0, 3 }, { 0, 0, 1 } });
          t.radius.assign(6, 1.0);
          t.branches.push_back({ { 3, 4, 5 }, 1 });
        }) },
  };
  for (const auto& [name, tree] : trees)
  {
    const bool taken = EndsWellOrSaysWhy(name,
      [&, &input = tree, &label = name]
      {
        const SweptSurface surface = SweepVesselTree(input, SweepSettings());
        EXPECT_TRUE(AllFinite(surface.points)) << label;
        EXPECT_EQ(OpenEdges(surface.triangles), 0U) << label;
      });
    EXPECT_TRUE(taken || name != "good");
  }
}

TEST(DegenerateSurfaces, DistancesAreFiniteOrRefused)
{
  const SurfaceMesh good = Tetrahedron();
  const auto changed = [&](const std::function<void(SurfaceMesh&)>& change)
  {
    SurfaceMesh mesh = good;
    change(mesh);
    return mesh;
  };
  const std::map<std::string, SurfaceMesh> meshes = {
    { "nothing", {} },
    { "doubled",
      changed([](SurfaceMesh& m)
        { m.triangles.insert(m.triangles.end(), m.triangles.begin(), m.triangles.end()); }) },
    { "a point as triangle",
      changed(
        [](SurfaceMesh& m) {
          m.triangles.push_back({ 1, 1, 1 });
        }) },
    { "a line as triangle",
      changed(
        [](SurfaceMesh& m) {
          m.triangles.push_back({ 1, 2, 1 });
        }) },
    { "only points",
      changed(
        [](SurfaceMesh& m) {
          m.triangles = { { 0, 0, 0 }, { 1, 1, 1 } };
        }) },
    { "nan", changed([](SurfaceMesh& m) { m.points[2].y() = Nan; }) },
    { "unused nan", changed([](SurfaceMesh& m) { m.points.emplace_back(Nan, 0, 0); }) },
    { "outside", changed([](SurfaceMesh& m) { m.triangles[0][1] = 4; }) },
    { "tiny",
      changed(
        [](SurfaceMesh& m)
        {
          for (Vector3& point : m.points)
          {
            point *= 1e-9;
          }
        }) },
    { "far", changed([](SurfaceMesh& m) { m.points[3].z() = 1e6; }) },
  };
  for (const auto& [name, mesh] : meshes)
  {
    EndsWellOrSaysWhy(name,
      [&, &other = mesh, &label = name]
      {
        MeshDistanceSettings settings;
        settings.errorBound = label == "far" ? 10.0 : 1e-3;
        const MeshDistance there = CompareSurfaces(good, other, settings);
        const MeshDistance back = CompareSurfaces(other, good, settings);
        EXPECT_TRUE(std::isfinite(there.hausdorff)) << label;
        EXPECT_NEAR(there.hausdorff, back.hausdorff, 2.0 * settings.errorBound) << label;
      });
    EndsWellOrSaysWhy(name + " with itself",
      [&, &same = mesh, &label = name]
      {
        MeshDistanceSettings settings;
        settings.errorBound = label == "far" ? 10.0 : 1e-3;
        EXPECT_NEAR(CompareSurfaces(same, same, settings).hausdorff, 0.0, settings.errorBound)
          << label;
      });
    EndsWellOrSaysWhy(name + " cleaned",
      [&, &dirty = mesh, &label = name]
      {
        const CleanedSurface clean = CleanSurface(dirty.points, dirty.triangles);
        EXPECT_TRUE(AllFinite(clean.points)) << label;
        EXPECT_EQ(OpenEdges(clean.triangles), 0U) << label;
      });
  }
}

TEST(DegenerateSkins, WeightsAreAPartitionOfUnityOrRefused)
{
  // Two bones in a bar of tetrahedra.
  SkinWeightInput bar;
  for (int n = 0; n <= 4; ++n)
  {
    for (const Vector3& corner :
      { Vector3(-1, -1, 0), Vector3(1, -1, 0), Vector3(1, 1, 0), Vector3(-1, 1, 0) })
    {
      bar.points.push_back(corner + Vector3(0, 0, n));
    }
  }
  for (std::int64_t n = 0; n < 4; ++n)
  {
    const std::int64_t b = 4 * n;
    for (const std::array<std::int64_t, 4>& t : { std::array<std::int64_t, 4>{ 0, 1, 2, 6 },
           { 0, 2, 3, 6 }, { 0, 3, 7, 6 }, { 0, 7, 4, 6 }, { 0, 4, 5, 6 }, { 0, 5, 1, 6 } })
    {
      bar.tetrahedra.push_back({ b + t[0], b + t[1], b + t[2], b + t[3] });
    }
  }
  bar.joints = { { 0, 0, 0.2 }, { 0, 0, 2 }, { 0, 0, 3.8 } };
  bar.bones = { { 0, 1 }, { 1, 2 } };
  const auto changed = [&](const std::function<void(SkinWeightInput&)>& change)
  {
    SkinWeightInput input = bar;
    change(input);
    return input;
  };
  const std::map<std::string, SkinWeightInput> inputs = {
    { "bar", bar },
    { "nothing", {} },
    { "nan", changed([](SkinWeightInput& i) { i.points[3].x() = Nan; }) },
    { "flat tetrahedron",
      changed(
        [](SkinWeightInput& i) {
          i.tetrahedra.push_back({ 0, 1, 2, 3 });
        }) },
    { "tetrahedron of one point",
      changed(
        [](SkinWeightInput& i) {
          i.tetrahedra.push_back({ 5, 5, 5, 5 });
        }) },
    { "doubled tetrahedron",
      changed([](SkinWeightInput& i) { i.tetrahedra.push_back(i.tetrahedra.front()); }) },
    { "bone without length", changed([](SkinWeightInput& i) { i.joints[1] = i.joints[0]; }) },
    { "bone outside", changed([](SkinWeightInput& i) { i.joints[2] = Vector3(0, 0, 50); }) },
    { "joint that is not there", changed([](SkinWeightInput& i) { i.bones[1].second = 7; }) },
    { "point that is not there", changed([](SkinWeightInput& i) { i.tetrahedra[2][1] = 1000; }) },
    { "unused point", changed([](SkinWeightInput& i) { i.points.emplace_back(9, 9, 9); }) },
  };
  int solved = 0;
  for (const auto& [name, input] : inputs)
  {
    solved += EndsWellOrSaysWhy(name,
                [&, &mesh = input, &label = name]
                {
                  const SkinWeights weights = ComputeSkinWeights(mesh);
                  ASSERT_EQ(weights.offset.size(), mesh.points.size() + 1) << label;
                  for (std::size_t p = 0; p < mesh.points.size(); ++p)
                  {
                    double sum = 0.0;
                    for (std::int64_t e = weights.offset[p]; e < weights.offset[p + 1]; ++e)
                    {
                      const double weight = weights.weight[static_cast<std::size_t>(e)];
                      EXPECT_GE(weight, -1e-6) << label;
                      EXPECT_LE(weight, 1.0 + 1e-6) << label;
                      sum += weight;
                    }
                    EXPECT_NEAR(sum, 1.0, 1e-6) << label << " point " << p;
                  }
                })
      ? 1
      : 0;
  }
  EXPECT_GE(solved, 1);
}

// Motion: phases and poses at random.
namespace
{
constexpr PhaseInterpolationMode Modes[] = { PhaseInterpolationMode::Linear,
  PhaseInterpolationMode::PeriodicCubic, PhaseInterpolationMode::LowNoise };

PhaseInterpolationSettings SettingsOf(PhaseInterpolationMode mode)
{
  PhaseInterpolationSettings settings;
  settings.mode = mode;
  settings.maximumRank = 2; // fewer to try: quicker
  settings.maximumOrder = 3;
  return settings;
}

/// In one cycle that begins anywhere, none nearer to another than 0.03.
std::vector<double> RandomPhases(RandomStream& random, std::size_t count)
{
  constexpr double minimum = 0.03;
  std::vector<double> gaps(count);
  double sum = 0.0;
  for (double& gap : gaps)
  {
    gap = random.Uniform();
    sum += gap;
  }
  std::vector<double> times{ random.Uniform(-1.5, 1.5) };
  for (std::size_t k = 1; k < count; ++k)
  {
    times.push_back(
      times.back() + minimum + (1.0 - minimum * static_cast<double>(count)) * gaps[k] / sum);
  }
  return times;
}

/// Rest as it is at every phase.
PoseSequence Standing(const Polylines& lines, std::vector<double> times)
{
  PoseSequence sequence;
  sequence.points.assign(times.size(), lines.points);
  sequence.times = std::move(times);
  return sequence;
}

/// Two harmonics, which every point follows in its own measure.
PoseSequence Beating(const Polylines& lines, const std::vector<double>& times, std::uint64_t seed)
{
  RandomStream random(seed, 1);
  PoseSequence sequence = Standing(lines, times);
  const Vector3 first = 4.0 * RandomDirection(random);
  const Vector3 second = RandomDirection(random);
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    const double angle = 2.0 * EIGEN_PI * times[k];
    for (Vector3& point : sequence.points[k])
    {
      point +=
        (1.0 + 0.01 * point.x()) * (std::cos(angle) * first + std::sin(2.0 * angle) * second);
    }
  }
  return sequence;
}

void Jitter(PoseSequence& sequence, RandomStream& random, double size)
{
  for (std::vector<Vector3>& points : sequence.points)
  {
    for (Vector3& point : points)
    {
      point += size * RandomDirection(random);
    }
  }
}

void DrawConfidence(PoseSequence& sequence, RandomStream& random)
{
  sequence.confidence.clear();
  for (const std::vector<Vector3>& points : sequence.points)
  {
    sequence.confidence.emplace_back();
    for (std::size_t p = 0; p < points.size(); ++p)
    {
      sequence.confidence.back().push_back(random.Uniform(0.1, 1.0));
    }
  }
}

/// All that a sequence can have.
PoseSequence RandomSequence(const Polylines& lines, std::uint64_t seed)
{
  RandomStream random(seed, 2);
  PoseSequence sequence = Standing(lines, RandomPhases(random, 4 + random.Bits() % 9));
  Jitter(sequence, random, 3.0);
  DrawConfidence(sequence, random);
  for (std::size_t k = 0; k < sequence.times.size(); ++k)
  {
    sequence.status.emplace_back();
    sequence.calibre.emplace_back();
    for (std::size_t p = 0; p < lines.points.size(); ++p)
    {
      sequence.status.back().push_back(static_cast<TrackingStatus>(random.Bits() % 4));
      sequence.calibre.back().push_back(random.Uniform(0.8, 1.25));
    }
    sequence.rotation.emplace_back();
    for (int bone = 0; bone < 3; ++bone)
    {
      sequence.rotation.back().emplace_back(
        Eigen::AngleAxisd(random.Uniform(0.0, 1.0), RandomDirection(random)));
    }
  }
  return sequence;
}

/// The same, told from the second phase on: the first one comes last, a cycle later.
PoseSequence FromTheSecondOn(PoseSequence sequence)
{
  const auto turn = [](auto& list)
  {
    if (!list.empty())
    {
      std::rotate(list.begin(), list.begin() + 1, list.end());
    }
  };
  turn(sequence.times);
  turn(sequence.points);
  turn(sequence.confidence);
  turn(sequence.status);
  turn(sequence.calibre);
  turn(sequence.rotation);
  sequence.times.back() += 1.0;
  return sequence;
}

template <typename Map>
PoseSequence Mapped(PoseSequence sequence, const Map& map)
{
  for (std::vector<Vector3>& points : sequence.points)
  {
    for (Vector3& point : points)
    {
      point = map * point;
    }
  }
  return sequence;
}

double Farthest(const std::vector<Vector3>& a, const std::vector<Vector3>& b)
{
  double farthest = a.size() == b.size() ? 0.0 : Infinity;
  for (std::size_t p = 0; p < std::min(a.size(), b.size()); ++p)
  {
    farthest = std::max(farthest, (a[p] - b[p]).norm());
  }
  return farthest;
}

double Farthest(const PoseSequence& a, const PoseSequence& b)
{
  double farthest = 0.0;
  for (std::size_t k = 0; k < a.points.size(); ++k)
  {
    farthest = std::max(farthest, Farthest(a.points[k], b.points[k]));
  }
  return farthest;
}

/// Some samples of no confidence, the others of some.
std::vector<std::pair<std::size_t, std::size_t>> Lose(PoseSequence& sequence, RandomStream& random)
{
  DrawConfidence(sequence, random);
  std::vector<std::pair<std::size_t, std::size_t>> lost;
  for (std::size_t p = 0; p < sequence.points.front().size(); ++p)
  {
    // A point is lost wholly, or but for one phase, or now and then.
    const std::uint64_t kind = random.Bits() % 10;
    const std::size_t kept = random.Bits() % sequence.points.size();
    for (std::size_t k = 0; k < sequence.points.size(); ++k)
    {
      if (kind == 0 || (kind == 1 && k != kept) || random.Uniform() < 0.2)
      {
        sequence.confidence[k][p] = 0.0;
        lost.emplace_back(k, p);
      }
    }
  }
  return lost;
}

/// The sequence with those samples moved by a distance in mm, each in a direction of its own.
PoseSequence Misplaced(PoseSequence sequence,
  const std::vector<std::pair<std::size_t, std::size_t>>& samples, double distance,
  RandomStream& random)
{
  for (const auto& [k, p] : samples)
  {
    sequence.points[k][p] += distance * RandomDirection(random);
  }
  return sequence;
}
}

TEST(RandomMotion, InterpolationGoesThroughItsPhases)
{
  for (std::uint64_t seed = 1; seed <= 8; ++seed)
  {
    const Polylines lines = RandomTree(seed);
    const PoseSequence sequence = RandomSequence(lines, seed);
    for (const PhaseInterpolationMode mode :
      { PhaseInterpolationMode::Linear, PhaseInterpolationMode::PeriodicCubic })
    {
      const PhaseInterpolation motion(sequence, SettingsOf(mode));
      ASSERT_EQ(motion.Knots().size(), sequence.times.size()) << seed;
      EXPECT_EQ(motion.Repeatability(), 0.0);
      InterpolatedPose pose;
      for (std::size_t k = 0; k < sequence.times.size(); ++k)
      {
        for (const double cycle : { -3.0, 0.0, 1.0, 100.0 })
        {
          motion.Evaluate(sequence.times[k] + cycle, pose);
          EXPECT_LT(Farthest(pose.points, sequence.points[k]), 1e-9) << seed << " phase " << k;
          EXPECT_EQ(pose.status, sequence.status[k]) << seed << " phase " << k;
          for (std::size_t p = 0; p < lines.points.size(); ++p)
          {
            ASSERT_NEAR(pose.confidence[p], sequence.confidence[k][p], 1e-9) << seed;
            ASSERT_NEAR(pose.calibre[p], sequence.calibre[k][p], 1e-9) << seed;
          }
          for (std::size_t b = 0; b < sequence.rotation[k].size(); ++b)
          {
            ASSERT_LT(pose.rotation[b].angularDistance(sequence.rotation[k][b]), 1e-6) << seed;
          }
        }
      }
    }
  }
}

TEST(RandomMotion, InterpolationKnowsNoFirstPhaseAndItsVelocityIsTheDerivative)
{
  constexpr double step = 1e-5;
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed, 3);
    const Polylines lines = RandomTree(seed);
    const PoseSequence sequence = RandomSequence(lines, seed);
    for (const PhaseInterpolationMode mode : Modes)
    {
      const PhaseInterpolation motion(sequence, SettingsOf(mode));
      const PhaseInterpolation turned(FromTheSecondOn(sequence), SettingsOf(mode));
      InterpolatedPose pose;
      InterpolatedPose other;
      for (int n = 0; n < 5; ++n)
      {
        // Not at a phase, where the velocity of the linear one jumps.
        double share = 0.0;
        double time = 0.0;
        do
        {
          time = random.Uniform(-2.0, 2.0);
          share = IntervalAt(motion.Knots(), time).share;
        } while (share < 0.01 || share > 0.99);
        motion.Evaluate(time, pose);
        turned.Evaluate(time + 1.0, other);
        EXPECT_LT(Farthest(pose.points, other.points), 1e-6) << seed << " at " << time;
        EXPECT_LT(Farthest(pose.velocity, other.velocity), 1e-4) << seed << " at " << time;
        InterpolatedPose sooner;
        motion.Evaluate(time - step, sooner);
        motion.Evaluate(time + step, other);
        for (std::size_t p = 0; p < lines.points.size(); ++p)
        {
          const Vector3 rate = (other.points[p] - sooner.points[p]) / (2.0 * step);
          ASSERT_LT((rate - pose.velocity[p]).norm(), 1e-3 * (1.0 + rate.norm())) << seed;
        }
      }
    }
  }
}

TEST(RandomMotion, InterpolationMovesWithTheWorld)
{
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed, 4);
    const Polylines lines = RandomTree(seed);
    PoseSequence sequence = RandomSequence(lines, seed);
    Eigen::Affine3d shear(RandomMotion(seed));
    for (int n = 0; n < 9; ++n)
    {
      shear.linear()(n / 3, n % 3) += random.Uniform(-0.5, 0.5);
    }
    for (const PhaseInterpolationMode mode : Modes)
    {
      // The modes of low noise depend on lengths, and their fit ends when it moves by less than 0.001 mm.
      const bool anyMap = mode != PhaseInterpolationMode::LowNoise;
      const Eigen::Affine3d map = anyMap ? shear : Eigen::Affine3d(RandomMotion(seed));
      const PhaseInterpolation motion(sequence, SettingsOf(mode));
      const PhaseInterpolation mapped(Mapped(sequence, map), SettingsOf(mode));
      InterpolatedPose pose;
      InterpolatedPose other;
      for (int n = 0; n < 5; ++n)
      {
        const double time = random.Uniform(-2.0, 2.0);
        motion.Evaluate(time, pose);
        mapped.Evaluate(time, other);
        for (std::size_t p = 0; p < lines.points.size(); ++p)
        {
          ASSERT_LT((map * pose.points[p] - other.points[p]).norm(), anyMap ? 1e-9 : 0.01) << seed;
          ASSERT_LT(
            (map.linear() * pose.velocity[p] - other.velocity[p]).norm(), anyMap ? 1e-7 : 0.1)
            << seed;
        }
      }
    }
  }
}

TEST(RandomMotion, WhatStandsStillKeepsStanding)
{
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed, 5);
    const Polylines lines = RandomTree(seed);
    PoseSequence sequence = Standing(lines, RandomPhases(random, 7));
    DrawConfidence(sequence, random);
    InterpolatedPose pose;
    for (const PhaseInterpolationMode mode : Modes)
    {
      const PhaseInterpolation motion(sequence, SettingsOf(mode));
      motion.Evaluate(random.Uniform(-2.0, 2.0), pose);
      EXPECT_LT(Farthest(pose.points, lines.points), 1e-6) << seed;
      EXPECT_LT(
        Farthest(pose.velocity, std::vector<Vector3>(lines.points.size(), Vector3::Zero())), 1e-6)
        << seed;
    }
    const RegularizedMotion regular = RegularizeMotion(sequence, lines);
    EXPECT_LT(Farthest(regular.poses, sequence), 1e-9) << seed;
    EXPECT_EQ(regular.iterations, 0) << seed;
    EXPECT_EQ(regular.violations, 0) << seed;
  }
}

TEST(RandomMotion, InterpolationDoesNotCountWhatHasNoConfidence)
{
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed, 6);
    const Polylines lines = RandomTree(seed);
    // Low noise: single samples.
    PoseSequence sequence = Beating(lines, RandomPhases(random, 12), seed);
    const auto lost = Lose(sequence, random);
    PoseSequence wrong = Misplaced(sequence, lost, 50.0, random);
    const PhaseInterpolationSettings settings = SettingsOf(PhaseInterpolationMode::LowNoise);
    const PhaseInterpolation right(sequence, settings);
    const PhaseInterpolation other(wrong, settings);
    InterpolatedPose a;
    InterpolatedPose b;
    const auto seen = [&](std::size_t p)
    {
      return std::any_of(sequence.confidence.begin(), sequence.confidence.end(),
        [p](const std::vector<double>& ofPhase) { return ofPhase[p] > 0.0; });
    };
    for (int n = 0; n < 5; ++n)
    {
      const double time = random.Uniform();
      right.Evaluate(time, a);
      other.Evaluate(time, b);
      double farthest = 0.0;
      for (std::size_t p = 0; p < lines.points.size(); ++p)
      {
        // A point that nobody has ever seen is somewhere.
        farthest = std::max(farthest, seen(p) ? (a.points[p] - b.points[p]).norm() : 0.0);
      }
      EXPECT_LT(farthest, 1e-9) << seed;
    }

    // Through the phases: one of two repetitions.
    PoseSequence twice = Beating(lines, { 0.0, 0.004, 0.3, 0.304, 0.55, 0.8, 0.805 }, seed);
    DrawConfidence(twice, random);
    twice.calibre.assign(7, std::vector<double>(lines.points.size(), 1.0));
    for (const std::size_t k : { 1, 2, 6 })
    {
      twice.confidence[k].assign(lines.points.size(), 0.0);
    }
    wrong = twice;
    for (const std::size_t k : { 1, 2, 6 })
    {
      for (std::size_t p = 0; p < lines.points.size(); ++p)
      {
        wrong.points[k][p] += 50.0 * RandomDirection(random);
        wrong.calibre[k][p] = random.Uniform(0.5, 2.0);
      }
    }
    for (const PhaseInterpolationMode mode : Modes)
    {
      const PhaseInterpolation good(twice, SettingsOf(mode));
      const PhaseInterpolation bad(wrong, SettingsOf(mode));
      ASSERT_EQ(good.Knots().size(), 4U);
      const double time = random.Uniform();
      good.Evaluate(time, a);
      bad.Evaluate(time, b);
      EXPECT_LT(Farthest(a.points, b.points), 1e-9) << seed;
      EXPECT_EQ(a.calibre, b.calibre) << seed;
    }
  }
}

TEST(RandomMotion, RegularisationKeepsWhatHasNoEnergy)
{
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed, 7);
    // Every phase has its own translation, of the whole tree: nothing bends, nothing stretches.
    const Polylines tree = RandomTree(seed);
    PoseSequence sequence = Standing(tree, RandomPhases(random, 8));
    DrawConfidence(sequence, random);
    for (std::vector<Vector3>& points : sequence.points)
    {
      const Vector3 translation = 6.0 * RandomDirection(random);
      for (Vector3& point : points)
      {
        point += translation;
      }
    }
    MotionRegularizationSettings settings;
    settings.temporalWeight = 0.0;
    const RegularizedMotion moved = RegularizeMotion(sequence, tree, settings);
    EXPECT_LT(Farthest(moved.poses, sequence), 1e-9) << seed;
    EXPECT_EQ(moved.violations, 0) << seed;

    // A straight vessel of uneven segments that is turned, stretched and sheared stays straight.
    Polylines straight;
    straight.points = { Vector3::Zero() };
    straight.lines = { { 0 } };
    const Vector3 direction = RandomDirection(random);
    for (int n = 1; n < 30; ++n)
    {
      straight.points.emplace_back(straight.points.back() + random.Uniform(0.3, 2.0) * direction);
      straight.lines[0].push_back(n);
    }
    PoseSequence affine = Standing(straight, RandomPhases(random, 8));
    for (std::size_t k = 0; k < affine.times.size(); ++k)
    {
      Eigen::Affine3d map(RandomMotion(100 * seed + k));
      map.linear() += 0.1 * Eigen::Matrix3d::Random();
      for (Vector3& point : affine.points[k])
      {
        point = map * point;
      }
    }
    MotionRegularizationSettings still = NoLimits();
    still.temporalWeight = still.velocityWeight = 0.0;
    EXPECT_LT(Farthest(RegularizeMotion(affine, straight, still).poses, affine), 1e-8) << seed;
  }
}

TEST(RandomMotion, RegularisationMovesWithTheWorldAndKnowsNoFirstPhase)
{
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed, 8);
    const Polylines lines = RandomTree(seed);
    PoseSequence sequence = Beating(lines, RandomPhases(random, 8), seed);
    Jitter(sequence, random, 0.3);
    DrawConfidence(sequence, random);
    for (const MotionEnergy energy : { MotionEnergy::Displacement, MotionEnergy::Position })
    {
      MotionRegularizationSettings settings = NoLimits();
      settings.wellTracked = 1.0; // whose tolerance is a limit too
      settings.energy = energy;
      const RegularizedMotion regular = RegularizeMotion(sequence, lines, settings);
      const Eigen::Isometry3d motion = RandomMotion(seed);
      Polylines there = lines;
      for (Vector3& point : there.points)
      {
        point = motion * point;
      }
      const RegularizedMotion moved = RegularizeMotion(Mapped(sequence, motion), there, settings);
      // Eq. 14 does not turn displacements: rest and poses move together.
      EXPECT_LT(Farthest(Mapped(regular.poses, motion), moved.poses), 1e-8) << seed;
      const RegularizedMotion turned = RegularizeMotion(FromTheSecondOn(sequence), lines, settings);
      EXPECT_LT(Farthest(FromTheSecondOn(regular.poses), turned.poses), 1e-8) << seed;

      // It is the minimum: less than before, and more wherever one goes from there.
      EXPECT_LE(regular.after.objective, regular.before.objective) << seed;
      for (int n = 0; n < 5; ++n)
      {
        PoseSequence near = regular.poses;
        Jitter(near, random, 0.01);
        EXPECT_GT(EnergiesOf(near, sequence, lines, settings).objective, regular.after.objective)
          << seed;
      }
    }
  }
}

TEST(RandomMotion, RegularisationDoesNotCountWhatHasNoConfidence)
{
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed, 9);
    const Polylines lines = RandomTree(seed);
    PoseSequence sequence = Beating(lines, RandomPhases(random, 10), seed);
    const auto lost = Lose(sequence, random);
    const PoseSequence wrong = Misplaced(sequence, lost, 20.0, random);
    const MotionRegularizationSettings settings = NoLimits();
    const RegularizedMotion right = RegularizeMotion(sequence, lines, settings);
    const RegularizedMotion other = RegularizeMotion(wrong, lines, settings);
    // 20 mm that weigh 1e-6.
    EXPECT_LT(Farthest(right.poses, other.poses), 0.02) << seed;
  }
}

TEST(RandomMotion, RegularisationKeepsItsLimitsOrSaysWhereNot)
{
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
  {
    RandomStream random(seed, 10);
    const Polylines lines = RandomTree(seed);
    PoseSequence sequence = Beating(lines, RandomPhases(random, 8), seed);
    const PoseSequence smooth = sequence;
    Jitter(sequence, random, 0.8);
    DrawConfidence(sequence, random);
    MotionRegularizationSettings settings;
    settings.maximumStrain = 0.15;
    settings.maximumStep = 6.0;
    const RegularizedMotion regular = RegularizeMotion(sequence, lines, settings);
    EXPECT_GT(regular.iterations, 0) << seed;
    const double slack = 3.0 * settings.precision;
    std::int64_t beyond = 0;
    for (std::size_t k = 0; k < regular.poses.points.size(); ++k)
    {
      const std::vector<Vector3>& points = regular.poses.points[k];
      const std::vector<Vector3>& next =
        regular.poses.points[(k + 1) % regular.poses.points.size()];
      EXPECT_TRUE(AllFinite(points)) << seed;
      for (std::size_t p = 0; p < points.size(); ++p)
      {
        beyond += (next[p] - points[p]).norm() > settings.maximumStep + slack ? 1 : 0;
        if (sequence.confidence[k][p] >= settings.wellTracked)
        {
          EXPECT_LE((points[p] - sequence.points[k][p]).norm(), settings.tolerance + slack) << seed;
        }
      }
      for (std::size_t n = 0; n < lines.lines.size(); ++n)
      {
        const std::vector<std::int64_t>& line = lines.lines[n];
        double length = 0.0;
        double rest = 0.0;
        for (std::size_t p = 1; p < line.size(); ++p)
        {
          const auto a = static_cast<std::size_t>(line[p - 1]);
          const auto b = static_cast<std::size_t>(line[p]);
          const double now = (points[b] - points[a]).norm();
          const double then = (lines.points[b] - lines.points[a]).norm();
          beyond += std::abs(now - then) > settings.maximumStrain * then + slack ? 1 : 0;
          length += now;
          rest += then;
        }
        EXPECT_NEAR(regular.strain[k][n], length / rest - 1.0, 1e-9) << seed;
        EXPECT_NEAR(regular.stress[k][n], settings.youngsModulus * regular.strain[k][n], 1e-9);
      }
    }
    EXPECT_LE(beyond, regular.violations) << seed;
  }
}
}
