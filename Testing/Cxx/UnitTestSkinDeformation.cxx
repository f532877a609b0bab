// Deformation against closed forms, both precisions, all instruction sets, without allocation.

#include "KernelChoice.h"
#include "ParallelFor.h"
#include "Refusals.h"
#include "SkinDeformation.h"
#include "SkinKernels.h"
#include "TetrahedronTestMeshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <random>

namespace
{
std::atomic<long> Allocations{ 0 };

void* Count(std::size_t size, std::size_t alignment)
{
  ++Allocations;
  const std::size_t whole =
    (std::max<std::size_t>(size, 1) + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, whole);
  if (!memory)
  {
    throw std::bad_alloc();
  }
  return memory;
}
}

void* operator new(std::size_t size)
{
  return Count(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment)
{
  return Count(size, static_cast<std::size_t>(alignment));
}
// Where one of a pair is inlined and the other is not, GCC warns that they do not match.
[[gnu::noinline]] void operator delete(void* memory) noexcept
{
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept
{
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
  std::free(memory);
}

using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

void AddBone(Skeleton& skeleton, std::int64_t first, std::int64_t second)
{
  Skeleton::Bone bone;
  bone.first = first;
  bone.second = second;
  bone.id = static_cast<int>(skeleton.bones.size());
  skeleton.bones.push_back(bone);
}

Skeleton Chain(int bones, double length)
{
  Skeleton skeleton;
  for (int j = 0; j <= bones; ++j)
  {
    skeleton.joints.emplace_back(0.0, 0.0, length * j);
    if (j > 0)
    {
      AddBone(skeleton, j - 1, j);
    }
  }
  return skeleton;
}

/// Rings of a tube along z, between the ends of a chain.
std::vector<Vector3> Tube(double radius, double length, int rings, int around)
{
  std::vector<Vector3> points;
  for (int k = 0; k < rings; ++k)
  {
    for (int n = 0; n < around; ++n)
    {
      const double angle = 2.0 * Pi * n / around;
      points.emplace_back(
        radius * std::cos(angle), radius * std::sin(angle), length * k / (rings - 1));
    }
  }
  return points;
}

CompactSkinWeights Weights(std::int64_t points, int influences)
{
  CompactSkinWeights weights;
  weights.influences = influences;
  weights.bone.assign(points * influences, 0);
  weights.weight.assign(points * influences, 0.0F);
  return weights;
}

/// All weight on the bone beside the point.
CompactSkinWeights NearestBone(const std::vector<Vector3>& points, int bones, double length)
{
  CompactSkinWeights weights = Weights(static_cast<std::int64_t>(points.size()), 1);
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    weights.bone[i] = std::clamp(static_cast<int>(points[i].z() / length), 0, bones - 1);
    weights.weight[i] = 1.0F;
  }
  return weights;
}

/// Half and half at the joints, falling to nothing half a bone further.
CompactSkinWeights Hats(const std::vector<Vector3>& points, int bones, double length)
{
  CompactSkinWeights weights = Weights(static_cast<std::int64_t>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    const double at = points[i].z() / length;
    const int bone = std::clamp(static_cast<int>(at), 0, bones - 1);
    const double t = at - bone;
    const int other = t < 0.5 ? bone - 1 : bone + 1;
    const double share = other >= 0 && other < bones ? std::abs(t - 0.5) : 0.0;
    weights.bone[3 * i] = bone;
    weights.weight[3 * i] = static_cast<float>(1.0 - share);
    weights.bone[3 * i + 1] = std::max(0, std::min(bones - 1, other));
    weights.weight[3 * i + 1] = static_cast<float>(share);
  }
  return weights;
}

/// A winding tree, points around it, eight bones a point.
struct Case
{
  Skeleton skeleton;
  std::vector<Vector3> points;
  CompactSkinWeights weights;
};

Case RandomCase(unsigned seed, int bones, std::int64_t points, const Vector3& origin)
{
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Case made;
  made.skeleton.joints.push_back(origin);
  for (int b = 1; b <= bones; ++b)
  {
    const std::int64_t from = b % 7 == 0 ? b / 2 : b - 1;
    made.skeleton.joints.push_back(made.skeleton.joints[from] +
      4.0 * Vector3(0.5 + 0.4 * normal(random), 0.7 * normal(random), 0.7 * normal(random)));
    AddBone(made.skeleton, from, b);
  }
  made.weights = Weights(points, 8);
  for (std::int64_t i = 0; i < points; ++i)
  {
    const auto& bone = made.skeleton.bones[random() % bones];
    const double t = std::uniform_real_distribution<double>()(random);
    const Vector3 point = (1.0 - t) * made.skeleton.joints[bone.first] +
      t * made.skeleton.joints[bone.second] +
      Vector3(normal(random), normal(random), normal(random));
    made.points.push_back(point);
    std::vector<std::pair<double, int>> near;
    for (int b = 0; b < bones; ++b)
    {
      near.emplace_back(DistanceToSegment(point, made.skeleton.joints[made.skeleton.bones[b].first],
                          made.skeleton.joints[made.skeleton.bones[b].second]),
        b);
    }
    std::partial_sort(near.begin(), near.begin() + 8, near.end());
    double sum = 0.0;
    for (int n = 0; n < 8; ++n)
    {
      sum += std::pow(near[n].first + 0.1, -4.0);
    }
    for (int n = 0; n < 8; ++n)
    {
      made.weights.bone[8 * i + n] = near[n].second;
      made.weights.weight[8 * i + n] =
        static_cast<float>(std::pow(near[n].first + 0.1, -4.0) / sum);
    }
  }
  return made;
}

/// Bends, stretches, and where `sections` twists and changes the calibre.
SkeletonPose RandomPose(const SkeletonRig& rig, unsigned seed, double swing, bool sections)
{
  std::mt19937 random(seed + 1000);
  std::normal_distribution<double> normal;
  SkeletonPose pose = rig.RestPose();
  pose.rotation.clear();
  const Quaternion rotation(Eigen::AngleAxisd(0.4 * seed, Vector3(1, 2, -1).normalized()));
  for (Vector3& joint : pose.joints)
  {
    joint = rotation * joint + swing * Vector3(normal(random), normal(random), normal(random));
  }
  if (sections)
  {
    for (double& twist : pose.twist)
    {
      twist = 0.5 * normal(random);
    }
    for (double& calibre : pose.calibre)
    {
      calibre = std::exp(0.3 * normal(random));
    }
  }
  return pose;
}

std::vector<Vector3> Deformed(SkinDeformation& skin, const SkeletonPose& pose)
{
  std::vector<double> values(3 * skin.NumberOfPoints());
  skin.Deform(pose, values.data());
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < values.size(); i += 3)
  {
    points.emplace_back(values[i], values[i + 1], values[i + 2]);
  }
  return points;
}

double MaximumDistance(const std::vector<Vector3>& a, const std::vector<float>& b)
{
  double maximum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
  {
    maximum = std::max(maximum, (a[i] - Vector3(b[3 * i], b[3 * i + 1], b[3 * i + 2])).norm());
  }
  return maximum;
}

constexpr std::array<SkinBlend, 2> Blends{ SkinBlend::Linear, SkinBlend::DualQuaternion };

SkinDeformationSettings With(SkinBlend blend)
{
  SkinDeformationSettings settings;
  settings.blend = blend;
  return settings;
}
}

TEST(SkinDeformation, RigidMotionIsReproduced)
{
  for (const SkinBlend blend : Blends)
  {
    for (unsigned seed = 0; seed < 8; ++seed)
    {
      const Case made = RandomCase(seed, 40, 1003, { -150.0, 80.0, 30.0 });
      SkinDeformation skin(made.points, made.weights, made.skeleton, With(blend));
      const Quaternion rotation(
        Eigen::AngleAxisd(seed == 0 ? Pi : 0.9 * seed, Vector3(seed, 1.0, -2.0).normalized()));
      const Vector3 shift(40.0, -300.0, 7.0);
      SkeletonPose pose;
      for (const Vector3& joint : made.skeleton.joints)
      {
        pose.joints.push_back(rotation * joint + shift);
      }
      const std::vector<Vector3> moved = Deformed(skin, pose);
      double maximum = 0.0;
      double size = 0.0;
      for (std::size_t i = 0; i < moved.size(); ++i)
      {
        maximum = std::max(maximum, (moved[i] - (rotation * made.points[i] + shift)).norm());
        size = std::max(size, moved[i].norm());
      }
      EXPECT_LT(maximum, 1e-9);
      std::vector<float> single(3 * made.points.size());
      skin.Deform(pose, single.data());
      EXPECT_LT(MaximumDistance(moved, single), 4e-7 * size);
    }
  }
}

TEST(SkinDeformation, RestStaysWhereItIs)
{
  const Case made = RandomCase(2, 30, 500, { 10.0, 0.0, 0.0 });
  for (const SkinBlend blend : Blends)
  {
    SkinDeformation skin(made.points, made.weights, made.skeleton, With(blend));
    std::vector<double> positions(3 * made.points.size());
    skin.Deform(skin.Rig().RestPose(), positions.data());
    std::vector<double> displacements(positions.size());
    skin.Displacements(positions.data(), displacements.data());
    for (const double value : displacements)
    {
      EXPECT_LT(std::abs(value), 1e-12);
    }
  }
}

TEST(SkinDeformation, StretchOfAStraightTubeIsEvenAndDoesNotBulge)
{
  const int bones = 8;
  const double length = 5.0;
  const std::vector<Vector3> points = Tube(1.5, 40.0, 161, 12);
  for (const SkinBlend blend : Blends)
  {
    for (const double stretch : { 0.93, 1.5, 0.2 })
    {
      for (const bool smooth : { false, true })
      {
        const Skeleton rest = Chain(bones, length);
        SkinDeformation skin(points,
          smooth ? Hats(points, bones, length) : NearestBone(points, bones, length), rest,
          With(blend));
        SkeletonPose pose;
        for (const Vector3& joint : rest.joints)
        {
          pose.joints.push_back(stretch * joint);
        }
        const std::vector<Vector3> moved = Deformed(skin, pose);
        // Weights that reach over a joint take a little of the other bone's motion with them: at
        // most (1/2 - u) u of the stretch of a bone, u the distance from the joint in bones.
        const double uneven =
          1e-12 + (smooth ? std::abs(stretch - 1.0) * length / 16.0 * (1.0 + 1e-6) : 0.0);
        for (std::size_t i = 0; i < moved.size(); ++i)
        {
          EXPECT_LT((moved[i].head<2>() - points[i].head<2>()).norm(), 1e-12);
          EXPECT_LE(std::abs(moved[i].z() - stretch * points[i].z()), uneven);
        }
      }
    }
  }
}

TEST(SkinDeformation, RigidBonesAreNotStretched)
{
  const std::vector<Vector3> points = Tube(1.5, 10.0, 41, 6);
  const Skeleton rest = Chain(2, 5.0);
  SkinDeformationSettings settings;
  settings.stretch = false;
  SkinDeformation skin(points, NearestBone(points, 2, 5.0), rest, settings);
  SkeletonPose pose;
  pose.joints = { { 0, 0, 0 }, { 0, 0, 8 }, { 0, 0, 16 } };
  const std::vector<Vector3> moved = Deformed(skin, pose);
  for (std::size_t i = 0; i < moved.size(); ++i)
  {
    EXPECT_NEAR(moved[i].z(), points[i].z() + (points[i].z() < 5.0 ? 0.0 : 3.0), 1e-12);
  }
}

TEST(SkinDeformation, TwistOfAStraightTubeIsEven)
{
  const int bones = 6;
  const double length = 5.0;
  const double perMillimetre = 0.2; // radians: nearly a turn over the tube, 1 a bone
  const std::vector<Vector3> points = Tube(1.5, 30.0, 121, 12);
  for (const SkinBlend blend : Blends)
  {
    const Skeleton rest = Chain(bones, length);
    SkinDeformation skin(points, NearestBone(points, bones, length), rest, With(blend));
    SkeletonPose pose;
    pose.joints = rest.joints;
    pose.twist.assign(bones, perMillimetre * length);
    const std::vector<Vector3> moved = Deformed(skin, pose);
    for (std::size_t i = 0; i < moved.size(); ++i)
    {
      const Vector3 wanted =
        Eigen::AngleAxisd(perMillimetre * points[i].z(), Vector3::UnitZ()) * points[i];
      EXPECT_LT((moved[i] - wanted).norm(), 1e-12);
    }
    std::vector<float> single(3 * points.size());
    skin.Deform(pose, single.data());
    EXPECT_LT(MaximumDistance(moved, single), 1e-5);
  }
}

TEST(SkinDeformation, CalibreIsEvenBetweenJoints)
{
  const std::vector<Vector3> points = Tube(1.5, 15.0, 61, 12);
  const Skeleton rest = Chain(3, 5.0);
  for (const SkinBlend blend : Blends)
  {
    SkinDeformation skin(points, NearestBone(points, 3, 5.0), rest, With(blend));
    SkeletonPose pose;
    pose.joints = rest.joints;
    pose.calibre = { 1.0, 0.4, 0.4, 2.0 };
    const std::vector<Vector3> moved = Deformed(skin, pose);
    for (std::size_t i = 0; i < moved.size(); ++i)
    {
      const double z = points[i].z();
      const double factor = z < 5.0 ? 1.0 - 0.6 * z / 5.0
        : z < 10.0                  ? 0.4
                                    : 0.4 + 1.6 * (z - 10.0) / 5.0;
      const Vector3 wanted(factor * points[i].x(), factor * points[i].y(), z);
      EXPECT_LT((moved[i] - wanted).norm(), 1e-12);
    }
  }
}

TEST(SkinDeformation, BendShrinksLinearlyAndKeepsTheCalibreWithDualQuaternions)
{
  const Skeleton rest = Chain(2, 10.0);
  const std::vector<Vector3> points = Tube(2.0, 20.0, 201, 16);
  const CompactSkinWeights weights = Hats(points, 2, 10.0);
  for (const double angle : { 0.2, 1.2, 2.6 })
  {
    SkeletonPose pose;
    const Eigen::AngleAxisd bend(angle, Vector3::UnitY());
    pose.joints = { rest.joints[0], rest.joints[1],
      rest.joints[1] + bend * Vector3(0.0, 0.0, 10.0) };
    SkinDeformation linear(points, weights, rest, With(SkinBlend::Linear));
    SkinDeformation dual(points, weights, rest, With(SkinBlend::DualQuaternion));
    const std::vector<Vector3> byLinear = Deformed(linear, pose);
    const std::vector<Vector3> byDual = Deformed(dual, pose);
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      const Vector3 arm = points[i] - rest.joints[1];
      const int own = weights.bone[3 * i];
      // As floats they do not sum to 1, so they are divided by their sum.
      const double ownWeight = weights.weight[3 * i];
      const double share = ownWeight / (ownWeight + weights.weight[3 * i + 1]);
      const double second = own == 1 ? share : 1.0 - share;
      const Vector3 mean = (1.0 - second) * arm + second * (bend * arm);
      EXPECT_LT((byLinear[i] - rest.joints[1] - mean).norm(), 1e-12);
      // Both bones turn about the joint, so their blend does.
      const double part = 2.0 *
        std::atan2(second * std::sin(0.5 * angle), 1.0 - second + second * std::cos(0.5 * angle));
      const Vector3 turned = Eigen::AngleAxisd(part, Vector3::UnitY()) * arm;
      EXPECT_LT((byDual[i] - rest.joints[1] - turned).norm(), 1e-12);
      if (arm.z() == 0.0)
      {
        // The section at the joint, in the plane of the bend.
        const double shrunk = std::hypot(arm.y(), std::cos(0.5 * angle) * arm.x());
        EXPECT_NEAR((byLinear[i] - rest.joints[1]).norm(), shrunk, 1e-12);
        EXPECT_NEAR((byDual[i] - rest.joints[1]).norm(), 2.0, 1e-12);
      }
    }
  }
}

TEST(SkinDeformation, SignsOfQuaternionsDoNotMatter)
{
  const Case made = RandomCase(4, 40, 700, Vector3::Zero());
  SkinDeformation skin(made.points, made.weights, made.skeleton, With(SkinBlend::DualQuaternion));
  const SkeletonPose pose = RandomPose(skin.Rig(), 2, 1.0, false);
  std::vector<BoneTransform> bones;
  skin.Rig().Transform(pose, bones);
  std::vector<float> before(3 * made.points.size());
  skin.Deform(bones, before.data());
  for (std::size_t b = 0; b < bones.size(); b += 2)
  {
    bones[b].rotation.coeffs() *= -1.0;
  }
  std::vector<double> after(before.size());
  skin.Deform(bones, after.data());
  std::vector<float> single(before.size());
  skin.Deform(bones, single.data());
  for (std::size_t n = 0; n < after.size(); ++n)
  {
    EXPECT_NEAR(after[n], before[n], 5e-5);
    EXPECT_NEAR(single[n], before[n], 5e-5);
  }
}

TEST(SkinDeformation, AllInstructionSetsAgreeWithDoublePrecision)
{
  const Case made = RandomCase(6, 60, 5003, { 100.0, -60.0, 20.0 });
  int sets = 0;
  for (const Instructions instructions :
    { Instructions::Baseline, Instructions::Avx2, Instructions::Avx512 })
  {
    if (!SkinKernelChoice().Select(instructions))
    {
      continue;
    }
    ++sets;
    for (const SkinBlend blend : Blends)
    {
      for (const bool sections : { false, true })
      {
        SkinDeformation skin(made.points, made.weights, made.skeleton, With(blend));
        const SkeletonPose pose = RandomPose(skin.Rig(), 3, 1.0, sections);
        std::vector<float> single(3 * made.points.size());
        skin.Deform(pose, single.data());
        EXPECT_LT(MaximumDistance(Deformed(skin, pose), single), 1e-4);
      }
    }
  }
  SkinKernelChoice().Select(Instructions::Widest);
  EXPECT_GE(sets, 1);
}

TEST(SkinDeformation, SameBitsOnOneAndManyThreads)
{
  const Case made = RandomCase(7, 60, 20011, Vector3::Zero());
  for (const SkinBlend blend : Blends)
  {
    SkinDeformation skin(made.points, made.weights, made.skeleton, With(blend));
    const SkeletonPose pose = RandomPose(skin.Rig(), 1, 1.0, true);
    std::vector<std::vector<float>> single;
    std::vector<std::vector<double>> precise;
    for (const int threads : { 1, 2, 7 })
    {
      SetNumberOfThreads(threads);
      single.emplace_back(3 * made.points.size());
      skin.Deform(pose, single.back().data());
      precise.emplace_back(3 * made.points.size());
      skin.Deform(pose, precise.back().data());
    }
    SetNumberOfThreads(0);
    EXPECT_EQ(single[0], single[1]);
    EXPECT_EQ(single[0], single[2]);
    EXPECT_EQ(precise[0], precise[1]);
    EXPECT_EQ(precise[0], precise[2]);
  }
}

TEST(SkinDeformation, FramesAllocateNothing)
{
  SkinWeightInput mesh = MeshOfComb(4, 2, 4, 2, 1.0);
  const Case made = RandomCase(8, 60, static_cast<std::int64_t>(mesh.points.size()), { 0, 0, 0 });
  for (const SkinBlend blend : Blends)
  {
    SkinDeformation skin(mesh.points, made.weights, made.skeleton, With(blend));
    skin.SetTetrahedra(mesh.tetrahedra);
    skin.SetTriangles({ { 0, 1, 2 }, { 1, 2, 3 } });
    std::vector<float> positions(3 * mesh.points.size());
    std::vector<float> other(3 * mesh.points.size());
    std::vector<double> precise(3 * mesh.points.size());
    std::vector<SkeletonPose> poses;
    for (unsigned n = 0; n < 4; ++n)
    {
      poses.push_back(RandomPose(skin.Rig(), 1, 1e-3 * n, true));
    }
    InversionReport report;
    report.tetrahedra.reserve(mesh.tetrahedra.size());
    std::vector<MovingSkeletonPose> moving;
    for (const SkeletonPose& pose : poses)
    {
      moving.push_back(Differentiate(pose, { { &poses[0], -1.0 } }));
    }
    std::vector<double> velocities(precise.size());
    const auto frame = [&](std::size_t n)
    {
      const SkeletonPose& pose = poses[n];
      skin.Deform(pose, positions.data());
      skin.Deform(pose, precise.data());
      skin.Displacements(positions.data(), other.data());
      skin.NormalsOf(positions.data(), other.data());
      skin.CheckTetrahedra(positions.data(), report);
      skin.Deform(moving[n], positions.data(), other.data());
      skin.Deform(moving[n], precise.data(), velocities.data());
    };
    frame(0); // starts the threads
    const long before = Allocations;
    for (std::size_t n = 0; n < poses.size(); ++n)
    {
      frame(n);
    }
    EXPECT_EQ(Allocations - before, 0);
  }
  // The counter counts.
  const long before = Allocations;
  std::vector<double> some(10);
  EXPECT_EQ(Allocations - before, 1);
}

TEST(SkinDeformation, NormalsOfTheDeformedTriangles)
{
  // A grid on the plane z = 0, bent into a quarter of a cylinder about y.
  const int n = 40;
  const double length = 10.0;
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
  for (int j = 0; j <= n; ++j)
  {
    for (int i = 0; i <= n; ++i)
    {
      points.emplace_back(length * i / n, length * j / n, 0.0);
      if (i < n && j < n)
      {
        const std::int64_t at = j * (n + 1) + i;
        triangles.push_back({ at, at + 1, at + n + 2 });
        triangles.push_back({ at, at + n + 2, at + n + 1 });
      }
    }
  }
  Skeleton rest = Chain(1, 1.0);
  SkinDeformation skin(points, NearestBone(points, 1, 1.0), rest);
  skin.SetTriangles(triangles);
  const double radius = length / (0.5 * Pi);
  std::vector<float> bent;
  for (const Vector3& point : points)
  {
    const double angle = point.x() / radius;
    bent.push_back(static_cast<float>(radius * std::sin(angle)));
    bent.push_back(static_cast<float>(point.y()));
    bent.push_back(static_cast<float>(radius * std::cos(angle)));
  }
  std::vector<float> normals(bent.size());
  skin.NormalsOf(bent.data(), normals.data());
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    const double angle = points[i].x() / radius;
    const Vector3 wanted(std::sin(angle), 0.0, std::cos(angle));
    const Vector3 normal(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    EXPECT_NEAR(normal.norm(), 1.0, 1e-6);
    EXPECT_GT(normal.dot(wanted), std::cos(0.6 * length / n / radius));
  }
  ExpectRefusal([&] { skin.SetTriangles({ { 0, 1, -1 } }); }, "Triangle 0");
  skin.SetTriangles({});
  skin.NormalsOf(bent.data(), normals.data());
  EXPECT_EQ(normals, std::vector<float>(normals.size(), 0.0F));
}

namespace
{
/// Velocities of a moving pose in double precision; those in single precision and the positions are held against it.
std::vector<Vector3> VelocitiesOf(SkinDeformation& skin, const MovingSkeletonPose& moving)
{
  const auto count = static_cast<std::size_t>(3 * skin.NumberOfPoints());
  SkeletonPose pose;
  PoseNow(moving, pose);
  std::vector<double> still(count);
  std::vector<double> positions(count);
  std::vector<double> velocities(count);
  skin.Deform(pose, still.data());
  skin.Deform(moving, positions.data(), velocities.data());
  EXPECT_EQ(positions, still);
  std::vector<Vector3> result;
  double size = 0.0;
  for (std::size_t i = 0; i < count; i += 3)
  {
    result.emplace_back(velocities[i], velocities[i + 1], velocities[i + 2]);
    size = std::max(size, result.back().norm());
  }
  for (const Instructions instructions :
    { Instructions::Baseline, Instructions::Avx2, Instructions::Avx512 })
  {
    if (SkinKernelChoice().Select(instructions))
    {
      std::vector<float> stillSingle(count);
      std::vector<float> single(count);
      std::vector<float> rates(count);
      skin.Deform(pose, stillSingle.data());
      skin.Deform(moving, single.data(), rates.data());
      EXPECT_EQ(single, stillSingle);
      EXPECT_LT(MaximumDistance(result, rates), 2e-5 * (1.0 + size));
    }
  }
  SkinKernelChoice().Select(Instructions::Widest);
  return result;
}

/// The pose a little later, by its own derivative.
SkeletonPose Later(const MovingSkeletonPose& moving, double seconds)
{
  SkeletonPose pose;
  PoseNow(moving, pose);
  for (std::size_t j = 0; j < pose.joints.size(); ++j)
  {
    for (int c = 0; c < 3; ++c)
    {
      pose.joints[j][c] += seconds * moving.joints[j][c].rate;
    }
  }
  for (std::size_t b = 0; b < pose.rotation.size(); ++b)
  {
    for (int c = 0; c < 4; ++c)
    {
      pose.rotation[b].coeffs()[c] += seconds * moving.rotation[b].coeffs()[c].rate;
    }
  }
  for (std::size_t b = 0; b < pose.twist.size(); ++b)
  {
    pose.twist[b] += seconds * moving.twist[b].rate;
  }
  for (std::size_t j = 0; j < pose.calibre.size(); ++j)
  {
    pose.calibre[j] += seconds * moving.calibre[j].rate;
  }
  return pose;
}

/// A chain at rest and a tube around it, on which `move` is done.
struct MovingTube
{
  Skeleton rest = Chain(3, 10.0);
  std::vector<Vector3> points = Tube(2.0, 30.0, 31, 8);
  MovingSkeletonPose pose;

  template <typename Velocity>
  explicit MovingTube(const Velocity& velocity)
  {
    for (const Vector3& joint : this->rest.joints)
    {
      this->pose.joints.push_back(Moving(joint, velocity(joint)));
    }
  }

  template <typename Velocity>
  void Expect(const Velocity& velocity, double conservation = 0.0) const
  {
    for (const SkinBlend blend : Blends)
    {
      CompactSkinWeights weights = Weights(static_cast<std::int64_t>(this->points.size()), 1);
      for (std::size_t i = 0; i < this->points.size(); ++i)
      {
        weights.bone[i] = std::min(2, static_cast<int>(this->points[i].z() / 10.0));
        weights.weight[i] = 1.0F;
      }
      SkinDeformation skin(this->points, weights, this->rest, With(blend));
      skin.SetVolumeConservation(conservation);
      const std::vector<Vector3> found = VelocitiesOf(skin, this->pose);
      for (std::size_t i = 0; i < found.size(); ++i)
      {
        ASSERT_LT((found[i] - velocity(this->points[i])).norm(), 1e-9)
          << i << ": " << found[i].transpose() << " at " << this->points[i].transpose();
      }
    }
  }
};
}

TEST(SkinDeformation, VelocityOfRigidMotionIsTheScrew)
{
  const Vector3 omega(0.7, -0.4, 1.1);
  const auto screw = [&](const Vector3& p) -> Vector3
  { return omega.cross(p - Vector3(5.0, 1.0, -2.0)) + 3.0 * omega; };
  for (unsigned seed = 0; seed < 4; ++seed)
  {
    const Case made = RandomCase(seed, 40, 1003, { -150.0, 80.0, 30.0 });
    for (const SkinBlend blend : Blends)
    {
      SkinDeformation skin(made.points, made.weights, made.skeleton, With(blend));
      MovingSkeletonPose pose;
      for (const Vector3& joint : made.skeleton.joints)
      {
        pose.joints.push_back(Moving(joint, screw(joint)));
      }
      const std::vector<Vector3> found = VelocitiesOf(skin, pose);
      for (std::size_t i = 0; i < found.size(); ++i)
      {
        ASSERT_LT((found[i] - screw(made.points[i])).norm(), 1e-8) << seed << " " << i;
      }
    }
  }
}

TEST(SkinDeformation, VelocityOfStretchAlongTheBones)
{
  const MovingTube tube([](const Vector3& p) -> Vector3 { return { 0.0, 0.0, 0.3 * p.z() }; });
  tube.Expect([](const Vector3& p) -> Vector3 { return { 0.0, 0.0, 0.3 * p.z() }; });
  // With the volume kept the calibre goes with stretch^(-1/2).
  tube.Expect(
    [](const Vector3& p) -> Vector3 {
      return { -0.15 * p.x(), -0.15 * p.y(), 0.3 * p.z() };
    },
    1.0);
}

TEST(SkinDeformation, VelocityOfCalibreAndTwist)
{
  const auto still = [](const Vector3&) -> Vector3 { return Vector3::Zero(); };
  MovingTube wider(still);
  for (int joint = 0; joint < 4; ++joint)
  {
    wider.pose.calibre.emplace_back(1.0, 0.2 * joint); // evenly along the bones
  }
  wider.Expect(
    [](const Vector3& p) -> Vector3 {
      return { 0.02 * p.z() * p.x(), 0.02 * p.z() * p.y(), 0.0 };
    });
  MovingTube twisted(still);
  twisted.pose.twist = { 0.0, 0.0, Dual(0.0, 0.8) };
  twisted.Expect(
    [](const Vector3& p) -> Vector3
    {
      const double rate = 0.8 * std::clamp((p.z() - 20.0) / 10.0, 0.0, 1.0);
      return { -rate * p.y(), rate * p.x(), 0.0 };
    });
  // What hangs on a twisted bone turns with it.
  twisted.pose.twist = { 0.0, Dual(0.0, 0.8), 0.0 };
  twisted.Expect(
    [](const Vector3& p) -> Vector3
    {
      const double rate = 0.8 * std::clamp((p.z() - 10.0) / 10.0, 0.0, 1.0);
      return { -rate * p.y(), rate * p.x(), 0.0 };
    });
}

TEST(SkinDeformation, VelocityIsTheLimitOfDifferences)
{
  for (unsigned seed = 0; seed < 6; ++seed)
  {
    const Case made = RandomCase(seed, 40, 503, { -50.0, 30.0, 10.0 });
    for (const SkinBlend blend : Blends)
    {
      for (const bool rotated : { false, true })
      {
        SkinDeformation skin(made.points, made.weights, made.skeleton, With(blend));
        skin.SetVolumeConservation(0.2 * seed);
        SkeletonPose pose = RandomPose(skin.Rig(), seed, 0.3, true);
        if (rotated)
        {
          std::vector<BoneTransform> bones;
          skin.Rig().Transform(pose, bones);
          for (const BoneTransform& bone : bones)
          {
            pose.rotation.push_back(bone.rotation);
          }
        }
        MovingSkeletonPose moving;
        std::mt19937 random(seed);
        std::normal_distribution<double> normal;
        const auto some = [&] { return Vector3(normal(random), normal(random), normal(random)); };
        for (std::size_t j = 0; j < pose.joints.size(); ++j)
        {
          moving.joints.push_back(Moving(pose.joints[j], some()));
          moving.calibre.emplace_back(pose.calibre[j], 0.1 * normal(random));
        }
        for (std::size_t b = 0; b < pose.twist.size(); ++b)
        {
          moving.twist.emplace_back(pose.twist[b], 0.3 * normal(random));
          if (rotated)
          {
            moving.rotation.push_back(Turning(pose.rotation[b], 0.3 * some()));
          }
        }
        const std::vector<Vector3> found = VelocitiesOf(skin, moving);
        const auto difference = [&](double step)
        {
          const std::vector<Vector3> before = Deformed(skin, Later(moving, -step));
          const std::vector<Vector3> after = Deformed(skin, Later(moving, step));
          double worst = 0.0;
          for (std::size_t i = 0; i < found.size(); ++i)
          {
            worst = std::max(worst, ((after[i] - before[i]) / (2.0 * step) - found[i]).norm());
          }
          return worst;
        };
        double size = 0.0;
        for (const Vector3& velocity : found)
        {
          size = std::max(size, velocity.norm());
        }
        // Second order, down to rounding.
        const double coarse = difference(1e-3);
        const double fine = difference(1e-4);
        EXPECT_LT(fine, 0.011 * coarse + 1e-8 * size) << seed;
        EXPECT_LT(difference(1e-5), 1e-6 * size) << seed;
      }
    }
  }
}

TEST(SkinDeformation, DerivativesOfPosesOutOfNeighbours)
{
  const SkeletonRig rig(Chain(2, 10.0));
  const auto at = [&](double time)
  {
    SkeletonPose pose = rig.RestPose();
    pose.joints[2] += Vector3(time * time, 2.0 * time, 0.0);
    pose.rotation[1] = Quaternion(Eigen::AngleAxisd(0.5 * time, Vector3::UnitX()));
    pose.rotation[1].coeffs() *= time > 0.0 ? -1.0 : 1.0; // the same rotation
    pose.twist[0] = 3.0 * time;
    pose.calibre[1] = 1.0 + 0.1 * time * time;
    return pose;
  };
  const SkeletonPose now = at(0.2);
  const SkeletonPose before = at(-0.1);
  const SkeletonPose after = at(0.5);
  const MovingSkeletonPose moving =
    Differentiate(now, { { &before, -1.0 / 0.6 }, { &after, 1.0 / 0.6 } });
  EXPECT_NEAR(moving.joints[2].x().rate, 0.4, 1e-12);
  EXPECT_NEAR(moving.joints[2].y().rate, 2.0, 1e-12);
  EXPECT_EQ(moving.joints[2].x().value, now.joints[2].x());
  const Quaternion rate(moving.rotation[1].w().rate, moving.rotation[1].x().rate,
    moving.rotation[1].y().rate, moving.rotation[1].z().rate);
  const Vector3 angular = 2.0 * (rate * now.rotation[1].conjugate()).vec();
  EXPECT_LT((angular - Vector3(0.5, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_NEAR(moving.twist[0].rate, 3.0, 1e-12);
  EXPECT_NEAR(moving.calibre[1].rate, 0.04, 1e-12);
  SkeletonPose other = now;
  other.twist.clear();
  ExpectRefusal([&] { Differentiate(now, { { &other, 1.0 } }); }, "different parts");
}

TEST(SkinDeformation, InvertedTetrahedraAreFoundAndRepaired)
{
  // A bar whose halves are folded: the inside of the bend turns over.
  const Skeleton rest = Chain(2, 10.0);
  for (const SkinBlend blend : Blends)
  {
    // Dual quaternions bend it round: only a thick bar, with its inside beyond the centre, turns over.
    const int half = blend == SkinBlend::Linear ? 4 : 7;
    const double fold = blend == SkinBlend::Linear ? 2.4 : 2.6;
    const SkinWeightInput bar =
      MeshOfCells({ -half, -4, 0 }, { half, 4, 40 }, 0.5, [](const Vector3&) { return true; });
    SkinDeformation skin(bar.points, Hats(bar.points, 2, 10.0), rest, With(blend));
    skin.SetTetrahedra(bar.tetrahedra);
    SkeletonPose pose;
    std::vector<double> positions(3 * bar.points.size());
    InversionReport report;
    skin.Deform(skin.Rig().RestPose(), positions.data());
    skin.CheckTetrahedra(positions.data(), report);
    EXPECT_EQ(report.found, 0);
    EXPECT_NEAR(report.minimumRatio, 1.0, 1e-12);

    // A gentle bend needs no repair, and gets none.
    pose.joints = { rest.joints[0], rest.joints[1],
      rest.joints[1] + Eigen::AngleAxisd(0.3, Vector3::UnitY()) * Vector3(0, 0, 10) };
    skin.Deform(pose, positions.data());
    const std::vector<double> untouched = positions;
    skin.RepairTetrahedra(positions.data(), report);
    EXPECT_EQ(report.found, 0);
    EXPECT_EQ(report.movedPoints, 0);
    EXPECT_EQ(positions, untouched);

    pose.joints[2] = rest.joints[1] + Eigen::AngleAxisd(fold, Vector3::UnitY()) * Vector3(0, 0, 10);
    std::vector<float> single(positions.size());
    skin.Deform(pose, single.data());
    skin.RepairTetrahedra(single.data(), report);
    EXPECT_GT(report.found, 0);
    EXPECT_TRUE(report.tetrahedra.empty()) << report.tetrahedra.size() << " left";
    skin.Deform(pose, positions.data());
    const std::vector<double> before = positions;
    skin.CheckTetrahedra(positions.data(), report);
    EXPECT_GT(report.found, 10);
    EXPECT_EQ(report.found, static_cast<std::int64_t>(report.tetrahedra.size()));
    EXPECT_LT(report.minimumRatio, 0.0);
    skin.RepairTetrahedra(positions.data(), report, 0.01);
    EXPECT_TRUE(report.tetrahedra.empty()) << report.tetrahedra.size() << " left";
    EXPECT_GT(report.minimumRatio, 0.01);
    EXPECT_LT(report.maximumMove, 1.5);
    EXPECT_GT(report.maximumMove, 0.0);
    std::int64_t moved = 0;
    for (std::size_t i = 0; i < bar.points.size(); ++i)
    {
      const bool same = std::equal(&before[3 * i], &before[3 * i] + 3, &positions[3 * i]);
      moved += same ? 0 : 1;
      // Nothing far from the fold.
      EXPECT_TRUE(same || std::abs(bar.points[i].z() - 10.0) < 5.0);
    }
    EXPECT_LE(moved, report.movedPoints);
    EXPECT_LT(moved, static_cast<std::int64_t>(bar.points.size() / 2));
    skin.CheckTetrahedra(positions.data(), report);
    EXPECT_GT(report.minimumRatio, 0.01);
  }
}

TEST(SkinDeformation, WhatCanNotBeRepairedIsReported)
{
  // A tetrahedron in four parts.
  const Skeleton rest = Chain(1, 1.0);
  const std::vector<Vector3> points{ { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 },
    { 0.2, 0.2, 0.2 } };
  SkinDeformation skin(points, NearestBone(points, 1, 1.0), rest);
  skin.SetTetrahedra({ { 0, 1, 2, 4 }, { 0, 1, 4, 3 }, { 0, 4, 2, 3 }, { 4, 1, 2, 3 } });
  std::vector<double> positions(15);
  skin.Deform(skin.Rig().RestPose(), positions.data());
  positions[2] = std::numeric_limits<double>::quiet_NaN();
  InversionReport report;
  skin.RepairTetrahedra(positions.data(), report);
  // What is not a number can not be made good, and must not look as if it were.
  EXPECT_EQ(report.found, 3);
  EXPECT_GE(report.tetrahedra.size(), 3U);
  ExpectRefusal([&] { skin.RepairTetrahedra(positions.data(), report, 0.6); }, "0 to 0.5");
}

TEST(SkinDeformation, RefusesWrongInput)
{
  const Case made = RandomCase(1, 20, 50, Vector3::Zero());
  const auto refuse = [&](const std::string& part, const auto& damage)
  {
    Case broken = made;
    damage(broken);
    ExpectRefusal([&] { SkinDeformation(broken.points, broken.weights, broken.skeleton); }, part);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuse("for each of 49 points", [](Case& c) { c.points.pop_back(); });
  refuse("Point 3 has a coordinate", [&](Case& c) { c.points[3].z() = nan; });
  refuse("Point 2 hangs on bone 20", [](Case& c) { c.weights.bone[16] = 20; });
  refuse("Point 2 hangs on bone -1", [](Case& c) { c.weights.bone[16] = -1; });
  refuse("Point 4 has a skin weight that is not finite",
    [&](Case& c) { c.weights.weight[33] = static_cast<float>(nan); });
  refuse("Point 4 has no skin weight",
    [](Case& c) { std::fill_n(c.weights.weight.begin() + 32, 8, 0.0F); });
  refuse("no bones", [](Case& c) { c.skeleton.bones.clear(); });
  SkinDeformation skin(made.points, made.weights, made.skeleton);
  std::vector<float> positions(150);
  ExpectRefusal(
    [&] { skin.Deform(std::vector<BoneTransform>(3), positions.data()); }, "3 moved bones");
  ExpectRefusal([&] { skin.SetTetrahedra({ { 0, 1, 2, 50 } }); }, "Tetrahedron 0");
  ExpectRefusal([&] { skin.SetTetrahedra({ { 0, 1, 2, 2 } }); }, "no volume");
  // No points are no error.
  SkinDeformation nothing({}, Weights(0, 8), made.skeleton);
  nothing.Deform(nothing.Rig().RestPose(), positions.data());
  EXPECT_EQ(nothing.NumberOfPoints(), 0);
}
