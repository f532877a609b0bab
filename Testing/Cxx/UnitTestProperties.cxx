// What has to hold whatever the input is: random trees and poses, and geometry that is none. An algorithm gives finite
// results, or one clear exception.
#include "BiharmonicSkinWeights.h"
#include "CenterlineSkeleton.h"
#include "CenterlineTopology.h"
#include "CounterRandom.h"
#include "MeshDistance.h"
#include "SkeletonPose.h"
#include "SkinDeformation.h"
#include "SurfaceCleaning.h"
#include "SweepSurface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

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
CenterlineSet RandomTree(std::uint64_t seed)
{
  RandomStream random(seed);
  CenterlineSet set;
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
  set.roots = { Vector3::Zero() };
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

CenterlineSet Moved(CenterlineSet set, const Eigen::Isometry3d& motion)
{
  for (std::vector<Vector3>* points : { &set.points, &set.roots })
  {
    for (Vector3& point : *points)
    {
      point = motion * point;
    }
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

SweepTree SweepInput(const CenterlineTree& tree)
{
  SweepTree input;
  input.points = tree.points;
  input.radius = tree.radius;
  for (const CenterlineTree::Branch& branch : tree.branches)
  {
    input.branches.push_back({ branch.points, branch.groupId });
  }
  return input;
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
    const CenterlineSet set = RandomTree(seed);
    const CenterlineTopology topology = BuildTopology(set);
    ASSERT_NO_THROW(CheckTree(topology)) << seed;
    EXPECT_EQ(topology.trees, 1) << seed;
    for (const CenterlineTree::Branch& branch : topology.branches)
    {
      EXPECT_GT(branch.length, 0.0) << seed;
      EXPECT_GE(branch.tortuosity, -1e-12) << seed;
      EXPECT_GE(branch.strahlerOrder, 1) << seed;
    }
    EXPECT_TRUE(AllFinite(topology.tangent) && AllFinite(topology.normal)) << seed;

    const Eigen::Isometry3d motion = RandomMotion(seed);
    const CenterlineTopology moved = BuildTopology(Moved(set, motion));
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
    const SweptSurface surface = SweepVesselTree(SweepInput(topology), settings);
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
  const CenterlineSet good = RandomTree(1);
  const auto changed = [&](const std::function<void(CenterlineSet&)>& change)
  {
    CenterlineSet set = good;
    change(set);
    return set;
  };
  const auto scaled = [&](double factor)
  {
    return changed(
      [&](CenterlineSet& set)
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
  const std::map<std::string, CenterlineSet> sets = {
    { "nothing", {} },
    { "nan", changed([](CenterlineSet& s) { s.points[5].x() = Nan; }) },
    { "infinite", changed([](CenterlineSet& s) { s.points[5].x() = Infinity; }) },
    { "nan radius", changed([](CenterlineSet& s) { s.radius[5] = Nan; }) },
    { "negative radius", changed([](CenterlineSet& s) { s.radius[5] = -1.0; }) },
    { "no radii", changed([](CenterlineSet& s) { s.radius.clear(); }) },
    { "one point", { { Vector3::Zero() }, { 1.0 }, { { 0 } }, {} } },
    { "line without length",
      { { Vector3::Zero(), Vector3::Zero() }, { 1.0, 1.0 }, { { 0, 1 } }, {} } },
    { "all points the same",
      changed([](CenterlineSet& s) { s.points.assign(s.points.size(), Vector3(1, 2, 3)); }) },
    { "straight",
      changed(
        [](CenterlineSet& s)
        {
          for (std::size_t p = 0; p < s.points.size(); ++p)
          {
            s.points[p] = Vector3(0.8 * static_cast<double>(p), 0, 0);
          }
        }) },
    { "every line twice",
      changed(
        [](CenterlineSet& s)
        {
          const auto lines = s.lines;
          s.lines.insert(s.lines.end(), lines.begin(), lines.end());
        }) },
    { "there and back",
      changed(
        [](CenterlineSet& s)
        {
          const std::vector<std::int64_t> line = s.lines[0];
          s.lines[0].insert(s.lines[0].end(), line.rbegin(), line.rend());
        }) },
    { "index outside", changed([](CenterlineSet& s) { s.lines[0][3] = 1 << 20; }) },
    { "index negative", changed([](CenterlineSet& s) { s.lines[0][3] = -1; }) },
    { "empty line", changed([](CenterlineSet& s) { s.lines.emplace_back(); }) },
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
    for (const CenterlineTree::Branch& branch : topology.branches)
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
  const SweepTree good = { { { 0, 0, 0 }, { 0, 0, 2 }, { 0, 0, 4 }, { 0, 0, 6 } },
    { 1.0, 1.0, 1.0, 1.0 }, { { { 0, 1, 2, 3 }, 0 } }, {}, 0, {}, {} };
  const auto changed = [&](const std::function<void(SweepTree&)>& change)
  {
    SweepTree tree = good;
    change(tree);
    return tree;
  };
  // Of a branched tree, whose junction has to be meshed too.
  const auto scaled = [](double factor)
  {
    SweepTree tree = SweepInput(BuildTopology(RandomTree(1)));
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      tree.points[p] *= factor;
      tree.radius[p] *= factor;
    }
    return tree;
  };
  const std::map<std::string, SweepTree> trees = {
    { "good", good },
    { "nothing", {} },
    { "nan", changed([](SweepTree& t) { t.points[1].x() = Nan; }) },
    { "infinite", changed([](SweepTree& t) { t.points[1].x() = Infinity; }) },
    { "no radius", changed([](SweepTree& t) { t.radius[2] = 0.0; }) },
    { "nan radius", changed([](SweepTree& t) { t.radius[2] = Nan; }) },
    { "one point", changed([](SweepTree& t) { t.branches[0].points = { 1 }; }) },
    { "no point", changed([](SweepTree& t) { t.branches[0].points = {}; }) },
    { "outside", changed([](SweepTree& t) { t.branches[0].points[1] = 99; }) },
    { "all the same",
      changed([](SweepTree& t) { t.points.assign(t.points.size(), Vector3(1, 2, 3)); }) },
    { "a point twice", changed([](SweepTree& t) { t.points[2] = t.points[1]; }) },
    { "tiny", scaled(1e-9) },
    { "small", scaled(1e-6) },
    { "huge", scaled(1e9) },
    { "beyond", scaled(1e300) },
    { "doubled",
      changed(
        [](SweepTree& t)
        {
          t.points.insert(t.points.end(), t.points.begin(), t.points.end());
          t.radius.assign(8, 1.0);
          t.branches.push_back({ { 4, 5, 6, 7 }, 1 });
        }) },
    { "a side branch within the trunk",
      changed(
        [](SweepTree& t)
        {
          t.points.insert(t.points.end(), { { 0.1, 0, 4 }, { 0.2, 0, 6 }, { 0.3, 0, 9 } });
          t.radius.assign(7, 1.0);
          t.branches.push_back({ { 1, 4, 5, 6 }, 1 });
        }) },
    { "two branches one on the other",
      changed(
        [](SweepTree& t)
        {
          t.points.insert(
            t.points.end(), { { 0, 0, 8 }, { 0, 0, 10 }, { 0, 0, 7.5 }, { 0, 0, 11 } });
          t.radius.assign(8, 1.0);
          t.branches.push_back({ { 3, 4, 5 }, 1 });
          t.branches.push_back({ { 3, 6, 7 }, 2 });
        }) },
    { "back into the trunk",
      changed(
        [](SweepTree& t)
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
