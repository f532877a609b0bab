// The mesh at any moment: exact derivatives, the same model as its parts, and the phantom's true velocity.

#include "BeatingModel.h"
#include "CoronaryPhantom.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

namespace UnitTestBeatingModel
{
using namespace coronary;

namespace
{
constexpr double Cycle = 0.8;

/// A vessel of the phantom: bones along its axis, its points on the two bones that are nearest.
struct Model
{
  Skeleton skeleton;
  std::vector<Vector3> points;
  CompactSkinWeights weights;
  PoseSequence poses;
};

Model PhantomModel(const CoronaryPhantom& phantom, int phases)
{
  Model model;
  const PhantomTree tree = phantom.Tree(0.0);
  // The longest branch of each tree.
  std::array<const VesselTree::Branch*, 2> longest{};
  for (const VesselTree::Branch& branch : tree.branches)
  {
    const VesselTree::Branch*& best = longest[branch.treeId];
    best = !best || branch.points.size() > best->points.size() ? &branch : best;
  }
  const VesselTree::Branch& branch = *longest[0];
  for (std::size_t n = 0; n < branch.points.size(); n += 6)
  {
    const std::int64_t p = branch.points[n];
    model.skeleton.joints.push_back(tree.points[p] - tree.displacement[p]);
    if (model.skeleton.joints.size() > 1)
    {
      Skeleton::Bone bone;
      bone.second = static_cast<std::int64_t>(model.skeleton.joints.size()) - 1;
      bone.first = bone.second - 1;
      bone.id = static_cast<int>(bone.first);
      model.skeleton.bones.push_back(bone);
    }
  }
  model.weights.influences = 2;
  for (std::size_t b = 0; b < model.skeleton.bones.size(); ++b)
  {
    const Vector3& head = model.skeleton.joints[b];
    const Vector3 along = model.skeleton.joints[b + 1] - head;
    const Vector3 across = along.unitOrthogonal();
    const Vector3 third = along.normalized().cross(across);
    for (int n = 0; n < 32; ++n)
    {
      const double t = (n / 8 + 0.5) / 4.0;
      const double angle = 2.0 * M_PI * n / 8.0;
      model.points.push_back(
        head + t * along + 1.5 * (std::cos(angle) * across + std::sin(angle) * third));
      // Half and half at a joint.
      const int other = static_cast<int>(b) + (t < 0.5 ? -1 : 1);
      const bool there = other >= 0 && other < static_cast<int>(model.skeleton.bones.size());
      model.weights.bone.push_back(static_cast<std::int32_t>(b));
      model.weights.bone.push_back(there ? other : static_cast<std::int32_t>(b));
      model.weights.weight.push_back(static_cast<float>(1.0 - std::abs(t - 0.5)));
      model.weights.weight.push_back(static_cast<float>(std::abs(t - 0.5)));
    }
  }
  for (int k = 0; k < phases; ++k)
  {
    const double time = static_cast<double>(k) / phases;
    model.poses.times.push_back(time);
    model.poses.points.emplace_back();
    model.poses.calibre.emplace_back();
    for (const Vector3& joint : model.skeleton.joints)
    {
      model.poses.points.back().push_back(phantom.Position(joint, time));
      model.poses.calibre.back().push_back(1.0 + 0.03 * std::sin(2.0 * M_PI * time + joint.x()));
    }
  }
  return model;
}

struct Error
{
  double rootMeanSquare = 0.0;
  double maximum = 0.0;
};

Error Between(const std::vector<double>& a, const std::vector<double>& b)
{
  Error error;
  for (std::size_t n = 0; n < a.size(); n += 3)
  {
    const double squared =
      (Vector3(a[n], a[n + 1], a[n + 2]) - Vector3(b[n], b[n + 1], b[n + 2])).squaredNorm();
    error.rootMeanSquare += squared * 3.0 / static_cast<double>(a.size());
    error.maximum = std::max(error.maximum, std::sqrt(squared));
  }
  error.rootMeanSquare = std::sqrt(error.rootMeanSquare);
  return error;
}
}

TEST(BeatingModel, VelocitiesAreTheDerivativesOfThePositions)
{
  PhantomSettings phantomSettings;
  const CoronaryPhantom phantom(phantomSettings);
  const Model made = PhantomModel(phantom, 20);
  for (const PhaseInterpolationMode mode : { PhaseInterpolationMode::Linear,
         PhaseInterpolationMode::PeriodicCubic, PhaseInterpolationMode::LowNoise })
  {
    for (const SkinBlend blend : { SkinBlend::Linear, SkinBlend::DualQuaternion })
    {
      for (const bool rotated : { false, true })
      {
        Model used = made;
        if (rotated)
        {
          const SkeletonRig rig(used.skeleton);
          std::vector<BoneTransform> bones;
          for (const std::vector<Vector3>& joints : used.poses.points)
          {
            SkeletonPose pose;
            pose.joints = joints;
            rig.Transform(pose, bones);
            used.poses.rotation.emplace_back();
            for (const BoneTransform& bone : bones)
            {
              used.poses.rotation.back().push_back(bone.rotation);
            }
          }
        }
        BeatingModelSettings settings;
        settings.interpolation.mode = mode;
        settings.deformation.blend = blend;
        settings.volumeConservation = 0.5;
        settings.cycle = Cycle;
        BeatingModel model(used.points, used.weights, used.skeleton, used.poses, settings);
        std::vector<double> positions(3 * used.points.size());
        std::vector<double> still(positions.size());
        std::vector<double> velocities(positions.size());
        std::vector<double> before(positions.size());
        std::vector<double> after(positions.size());
        for (const double time : { 0.013, 0.27, 0.481, 0.99 })
        {
          constexpr double step = 1e-5; // the third derivative is that of the spline
          model.Motion(time, positions.data(), velocities.data());
          model.Positions(time, still.data());
          EXPECT_EQ(positions, still);
          model.Positions(time - step, before.data());
          model.Positions(time + step, after.data());
          double size = 0.0;
          for (std::size_t n = 0; n < after.size(); ++n)
          {
            after[n] = (after[n] - before[n]) / (2.0 * step * Cycle);
            size = std::max(size, std::abs(after[n]));
          }
          EXPECT_GT(size, 1.0);
          EXPECT_LT(Between(after, velocities).maximum, 1e-5 * size)
            << static_cast<int>(mode) << static_cast<int>(blend) << rotated << " at " << time;
        }
      }
    }
  }
}

TEST(BeatingModel, VelocitiesAreThoseOfThePhantom)
{
  const CoronaryPhantom phantom{ PhantomSettings() };
  const double cycle = phantom.Settings().cycleLength;
  Model made = PhantomModel(phantom, 40);
  made.poses.calibre.clear(); // the phantom's material moves as a whole
  for (const SkinBlend blend : { SkinBlend::Linear, SkinBlend::DualQuaternion })
  {
    BeatingModelSettings settings;
    settings.deformation.blend = blend;
    settings.cycle = cycle;
    BeatingModel model(made.points, made.weights, made.skeleton, made.poses, settings);
    std::vector<double> positions(3 * made.points.size());
    std::vector<double> velocities(positions.size());
    Error worst;
    double fastest = 0.0;
    for (const double time : { 0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9 })
    {
      model.Motion(time, positions.data(), velocities.data());
      std::vector<double> truth;
      for (const Vector3& point : made.points)
      {
        const Vector3 velocity = phantom.Velocity(point, time);
        truth.insert(truth.end(), velocity.data(), velocity.data() + 3);
        fastest = std::max(fastest, velocity.norm());
      }
      const Error error = Between(truth, velocities);
      worst.rootMeanSquare = std::max(worst.rootMeanSquare, error.rootMeanSquare);
      worst.maximum = std::max(worst.maximum, error.maximum);
    }
    std::printf("%s: RMS %.3f, greatest %.3f of %.1f mm/s\n",
      blend == SkinBlend::Linear ? "linear" : "dual quaternions", worst.rootMeanSquare,
      worst.maximum, fastest);
    EXPECT_GT(fastest, 30.0);
    EXPECT_LT(worst.rootMeanSquare, 1.5);
    EXPECT_LT(worst.maximum, 2.5);
  }
}

TEST(BeatingModel, Refusals)
{
  const CoronaryPhantom phantom{ PhantomSettings() };
  const Model made = PhantomModel(phantom, 4);
  const auto make = [&](const PoseSequence& poses, const BeatingModelSettings& settings)
  { BeatingModel model(made.points, made.weights, made.skeleton, poses, settings); };
  PoseSequence fewer = made.poses;
  for (std::vector<Vector3>& joints : fewer.points)
  {
    joints.pop_back();
  }
  fewer.calibre.clear();
  ExpectRefusal([&] { make(fewer, {}); }, "its poses have");
  BeatingModelSettings settings;
  settings.cycle = 0.0;
  ExpectRefusal([&] { make(made.poses, settings); }, "cycle must be");
  settings.cycle = 1.0;
  settings.volumeConservation = 1.1;
  ExpectRefusal([&] { make(made.poses, settings); }, "must be 0 to 1");
  BeatingModel model(made.points, made.weights, made.skeleton, made.poses);
  std::vector<double> positions(3 * made.points.size());
  ExpectRefusal([&]
    { model.Positions(std::numeric_limits<double>::quiet_NaN(), positions.data()); },
    "must be finite");
}
}
