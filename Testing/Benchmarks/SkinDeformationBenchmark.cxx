// Milliseconds a frame of the skin deformation, beside the ways others do it.
//
// The mesh: points around a winding tree of sixty bones, each with its eight nearest ones (weights
// 1 / distance^4, all of them above 0). --benchmark_filter, --benchmark_repetitions and so on as
// always; DYNAMICCORONARY_POINTS sets the number of points.

#include "ParallelFor.h"
#include "SkinDeformation.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

namespace
{
using coronary::Vector3;

struct Frame
{
  coronary::Skeleton skeleton;
  std::vector<Vector3> points;
  coronary::CompactSkinWeights weights;
  std::vector<coronary::SkeletonPose> poses;
};

std::int64_t NumberOfPoints()
{
  const char* wanted = std::getenv("DYNAMICCORONARY_POINTS");
  return wanted ? std::max(16L, std::strtol(wanted, nullptr, 10)) : 100000;
}

/// Sixty bones in a tree that winds like a coronary one: three branches of twenty bones of 5 mm.
Frame MakeFrame()
{
  Frame frame;
  const int influences = 8;
  std::vector<double> radius;
  frame.skeleton.joints.emplace_back(20.0, -150.0, 60.0);
  radius.push_back(2.0);
  for (int branch = 0; branch < 3; ++branch)
  {
    std::int64_t from = branch == 0 ? 0 : 3 * branch;
    for (int n = 0; n < 20; ++n)
    {
      const double angle = 0.12 * n + 0.9 * branch;
      frame.skeleton.joints.push_back(frame.skeleton.joints[from] +
        5.0 *
          Vector3(std::cos(angle), std::sin(angle), 0.5 - 0.4 * branch + 0.02 * n).normalized());
      radius.push_back(2.0 - 0.05 * n - 0.2 * branch);
      coronary::Skeleton::Bone bone;
      bone.first = from;
      bone.second = static_cast<std::int64_t>(frame.skeleton.joints.size()) - 1;
      bone.id = static_cast<int>(frame.skeleton.bones.size());
      frame.skeleton.bones.push_back(bone);
      from = bone.second;
    }
  }
  const auto bones = static_cast<std::int64_t>(frame.skeleton.bones.size());
  const std::int64_t count = NumberOfPoints();
  frame.weights.influences = influences;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform;
  // In an order as meshers leave it: neighbours are often, but not always, near in memory.
  for (std::int64_t i = 0; i < count; ++i)
  {
    const coronary::Skeleton::Bone& bone = frame.skeleton.bones[i * bones / count];
    const Vector3& a = frame.skeleton.joints[bone.first];
    const Vector3& b = frame.skeleton.joints[bone.second];
    const Vector3 axis = (b - a).normalized();
    const Vector3 across = axis.unitOrthogonal();
    const double angle = 6.28318530718 * uniform(random);
    const double t = uniform(random);
    const double r = (1.0 - t) * radius[bone.first] + t * radius[bone.second];
    const Vector3 point =
      (1.0 - t) * a + t * b + r * (std::cos(angle) * across + std::sin(angle) * axis.cross(across));
    frame.points.push_back(point);
    std::vector<std::pair<double, std::int32_t>> near;
    for (std::int64_t n = 0; n < bones; ++n)
    {
      const Vector3& head = frame.skeleton.joints[frame.skeleton.bones[n].first];
      const Vector3& tail = frame.skeleton.joints[frame.skeleton.bones[n].second];
      near.emplace_back(std::sqrt(coronary::NearestOnSegment(point, head, tail).squaredDistance),
        static_cast<std::int32_t>(n));
    }
    std::partial_sort(near.begin(), near.begin() + influences, near.end());
    double sum = 0.0;
    for (int n = 0; n < influences; ++n)
    {
      near[n].first = std::pow(near[n].first, -4.0);
      sum += near[n].first;
    }
    for (int n = 0; n < influences; ++n)
    {
      frame.weights.bone.push_back(near[n].second);
      frame.weights.weight.push_back(static_cast<float>(near[n].first / sum));
    }
  }
  const coronary::SkeletonRig rig(frame.skeleton);
  for (int phase = 0; phase < 20; ++phase)
  {
    coronary::SkeletonPose pose;
    const double swing = std::sin(0.314159 * phase);
    for (const Vector3& joint : frame.skeleton.joints)
    {
      pose.joints.push_back(joint +
        swing * Vector3(6.0 + 2.0 * std::sin(0.1 * joint.y()), -4.0, 0.05 * (joint.x() - 20.0)));
    }
    frame.poses.push_back(pose);
  }
  return frame;
}

const Frame& TheFrame()
{
  static const Frame frame = MakeFrame();
  return frame;
}

/// Affine maps of the bones without stretch, three rows of four.
template <typename Real>
std::vector<std::vector<Real>> MapsOfPoses()
{
  const Frame& frame = TheFrame();
  const coronary::SkeletonRig rig(frame.skeleton);
  std::vector<std::vector<Real>> maps;
  std::vector<coronary::BoneTransform> bones;
  for (const coronary::SkeletonPose& pose : frame.poses)
  {
    rig.Transform(pose, bones);
    maps.emplace_back();
    for (std::size_t b = 0; b < bones.size(); ++b)
    {
      const coronary::Matrix3 rotation = bones[b].rotation.toRotationMatrix();
      const Vector3 shift = bones[b].posedHead - rotation * rig.Head(static_cast<std::int64_t>(b));
      for (int row = 0; row < 3; ++row)
      {
        for (int column = 0; column < 3; ++column)
        {
          maps.back().push_back(static_cast<Real>(rotation(row, column)));
        }
        maps.back().push_back(static_cast<Real>(shift[row]));
      }
    }
  }
  return maps;
}

enum Kind
{
  Linear,
  LinearRigid,
  LinearSections,
  Dual,
  DualSections
};

coronary::SkinDeformation SkinOf(const Frame& frame, Kind kind)
{
  coronary::SkinDeformationSettings settings;
  settings.blend = kind == Dual || kind == DualSections ? coronary::SkinBlend::DualQuaternion
                                                        : coronary::SkinBlend::Linear;
  settings.stretch = kind != LinearRigid;
  return { frame.points, frame.weights, frame.skeleton, settings };
}

/// Arguments: kind, threads.
void Ours(benchmark::State& state)
{
  const Frame& frame = TheFrame();
  const auto kind = static_cast<Kind>(state.range(0));
  coronary::SetNumberOfThreads(static_cast<int>(state.range(1)));
  coronary::SkinDeformation skin = SkinOf(frame, kind);
  std::vector<coronary::SkeletonPose> poses = frame.poses;
  if (kind == LinearSections || kind == DualSections)
  {
    for (coronary::SkeletonPose& pose : poses)
    {
      pose.calibre.assign(pose.joints.size(), 1.02);
      pose.twist.assign(frame.skeleton.bones.size(), 0.01);
    }
  }
  std::vector<float> positions(3 * frame.points.size());
  std::size_t phase = 0;
  for (auto _ : state)
  {
    skin.Deform(poses[phase], positions.data());
    benchmark::DoNotOptimize(positions.data());
    phase = (phase + 1) % poses.size();
  }
  state.counters["bones/block"] = skin.EntriesPerBlock();
  coronary::SetNumberOfThreads(0);
}

/// Positions and velocities. Arguments: kind, threads.
void WithVelocity(benchmark::State& state)
{
  const Frame& frame = TheFrame();
  const auto kind = static_cast<Kind>(state.range(0));
  coronary::SetNumberOfThreads(static_cast<int>(state.range(1)));
  coronary::SkinDeformation skin = SkinOf(frame, kind);
  std::vector<coronary::MovingSkeletonPose> poses;
  for (std::size_t k = 0; k < frame.poses.size(); ++k)
  {
    const coronary::SkeletonPose& next = frame.poses[(k + 1) % frame.poses.size()];
    poses.push_back(coronary::Differentiate(frame.poses[k], { { &next, 25.0 } }));
    if (kind == LinearSections || kind == DualSections)
    {
      poses.back().calibre.assign(next.joints.size(), coronary::Dual(1.02, 0.1));
      poses.back().twist.assign(frame.skeleton.bones.size(), coronary::Dual(0.01, 0.1));
    }
  }
  std::vector<float> positions(3 * frame.points.size());
  std::vector<float> velocities(positions.size());
  std::size_t phase = 0;
  for (auto _ : state)
  {
    skin.Deform(poses[phase], positions.data(), velocities.data());
    benchmark::DoNotOptimize(velocities.data());
    phase = (phase + 1) % poses.size();
  }
  coronary::SetNumberOfThreads(0);
}

void InDouble(benchmark::State& state)
{
  const Frame& frame = TheFrame();
  coronary::SkinDeformation skin(frame.points, frame.weights, frame.skeleton);
  std::vector<double> positions(3 * frame.points.size());
  std::size_t phase = 0;
  for (auto _ : state)
  {
    skin.Deform(frame.poses[phase], positions.data());
    benchmark::DoNotOptimize(positions.data());
    phase = (phase + 1) % frame.poses.size();
  }
}

/// M T of libigl's lbs_matrix: M has four columns a bone, its weight times (x, y, z, 1).
void DenseMatrix(benchmark::State& state)
{
  const Frame& frame = TheFrame();
  const auto count = static_cast<Eigen::Index>(frame.points.size());
  const auto bones = static_cast<Eigen::Index>(frame.skeleton.bones.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(count, 4 * bones);
  for (Eigen::Index i = 0; i < count; ++i)
  {
    for (int n = 0; n < frame.weights.influences; ++n)
    {
      const double weight = frame.weights.weight[i * frame.weights.influences + n];
      matrix.row(i).segment<4>(4 * frame.weights.bone[i * frame.weights.influences + n]) +=
        weight * frame.points[i].homogeneous().transpose();
    }
  }
  std::vector<Eigen::MatrixXd> transforms;
  for (const std::vector<double>& maps : MapsOfPoses<double>())
  {
    transforms.emplace_back(4 * bones, 3);
    for (Eigen::Index b = 0; b < bones; ++b)
    {
      for (int row = 0; row < 3; ++row)
      {
        for (int column = 0; column < 4; ++column)
        {
          transforms.back()(4 * b + column, row) = maps[12 * b + 4 * row + column];
        }
      }
    }
  }
  Eigen::MatrixXd positions(count, 3);
  std::size_t phase = 0;
  for (auto _ : state)
  {
    positions.noalias() = matrix * transforms[phase];
    benchmark::DoNotOptimize(positions.data());
    phase = (phase + 1) % transforms.size();
  }
}

/// The loop one writes first, with 4 or 8 bones a point, without stretch. Arguments: bones, threads.
void PlainLoop(benchmark::State& state)
{
  const Frame& frame = TheFrame();
  const auto used = static_cast<int>(state.range(0));
  coronary::SetNumberOfThreads(static_cast<int>(state.range(1)));
  const std::size_t count = frame.points.size();
  std::vector<float> rest;
  std::vector<std::int32_t> bone;
  std::vector<float> weight;
  for (std::size_t i = 0; i < count; ++i)
  {
    float sum = 0.0F;
    for (int c = 0; c < 3; ++c)
    {
      rest.push_back(static_cast<float>(frame.points[i][c]));
    }
    for (int n = 0; n < used; ++n)
    {
      sum += frame.weights.weight[i * frame.weights.influences + n];
    }
    for (int n = 0; n < used; ++n)
    {
      bone.push_back(frame.weights.bone[i * frame.weights.influences + n]);
      weight.push_back(frame.weights.weight[i * frame.weights.influences + n] / sum);
    }
  }
  const std::vector<std::vector<float>> poses = MapsOfPoses<float>();
  std::vector<float> positions(3 * count);
  std::size_t phase = 0;
  for (auto _ : state)
  {
    const float* maps = poses[phase].data();
    coronary::ParallelFor(static_cast<std::int64_t>(count), 4096,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          const float* p = &rest[3 * i];
          float sum[3] = { 0.0F, 0.0F, 0.0F };
          for (std::int64_t n = used * i; n < used * (i + 1); ++n)
          {
            const float* map = maps + 12 * bone[n];
            for (int c = 0; c < 3; ++c)
            {
              sum[c] += weight[n] *
                (map[4 * c] * p[0] + map[4 * c + 1] * p[1] + map[4 * c + 2] * p[2] +
                  map[4 * c + 3]);
            }
          }
          std::copy(sum, sum + 3, &positions[3 * i]);
        }
      });
    benchmark::DoNotOptimize(positions.data());
    phase = (phase + 1) % poses.size();
  }
  coronary::SetNumberOfThreads(0);
}

BENCHMARK(Ours)
  ->ArgNames({ "kind", "threads" })
  ->Args({ Linear, 2 })
  ->Args({ Linear, 1 })
  ->Args({ LinearRigid, 2 })
  ->Args({ LinearSections, 2 })
  ->Args({ Dual, 2 })
  ->Args({ DualSections, 2 })
  ->Unit(benchmark::kMillisecond)
  ->UseRealTime();
BENCHMARK(WithVelocity)
  ->ArgNames({ "kind", "threads" })
  ->Args({ Linear, 2 })
  ->Args({ LinearSections, 2 })
  ->Args({ Dual, 2 })
  ->Args({ DualSections, 2 })
  ->Unit(benchmark::kMillisecond)
  ->UseRealTime();
BENCHMARK(InDouble)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(DenseMatrix)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(PlainLoop)
  ->ArgNames({ "bones", "threads" })
  ->Args({ 4, 1 })
  ->Args({ 4, 2 })
  ->Args({ 8, 2 })
  ->Unit(benchmark::kMillisecond)
  ->UseRealTime();
}

BENCHMARK_MAIN();
