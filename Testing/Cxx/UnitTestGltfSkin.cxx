// glTF of a skeleton that moves: what a viewer shows is what SkinDeformation computes; form, axes, loops, refusals.
#include "GltfSkin.h"

#include "GltfEvaluator.h"
#include "Refusals.h"
#include "SkinDeformation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <random>

namespace UnitTestGltfSkin
{
using coronary::GltfModel;
using coronary::GltfSkin;
using coronary::Vector3;

namespace
{
/// A trunk of bones of 5 mm far from the origin, and two branches; numbered from the tips.
coronary::Skeleton Tree()
{
  coronary::Skeleton tree;
  const auto add = [&](const Vector3& at, std::int64_t parent)
  {
    tree.joints.push_back(at);
    tree.parent.push_back(parent);
    return static_cast<std::int64_t>(tree.joints.size()) - 1;
  };
  std::int64_t trunk = add({ 180.0, -240.0, 310.0 }, -1);
  for (int k = 1; k <= 12; ++k)
  {
    trunk = add(
      tree.joints[static_cast<std::size_t>(trunk)] + Vector3(std::sin(0.3 * k), 0.4, -4.5), trunk);
  }
  for (const double side : { -1.0, 1.0 })
  {
    std::int64_t branch = trunk;
    for (int k = 1; k <= 6; ++k)
    {
      branch = add(
        tree.joints[static_cast<std::size_t>(branch)] + Vector3(3.0 * side, 1.0, -2.0 - 0.3 * k),
        branch);
    }
  }
  for (std::size_t j = tree.joints.size(); j-- > 1;)
  {
    coronary::Skeleton::Bone bone;
    bone.first = tree.parent[j];
    bone.second = static_cast<std::int64_t>(j);
    bone.id = static_cast<int>(tree.bones.size());
    bone.name = "pLAD-" + std::to_string(j);
    bone.length = (tree.joints[j] - tree.joints[static_cast<std::size_t>(bone.first)]).norm();
    tree.bones.push_back(bone);
  }
  return tree;
}

/// Points around the bones with weights of `influences` bones each, and triangles among them.
GltfModel ModelOf(const coronary::SkeletonRig& rig, int influences)
{
  GltfModel model;
  std::mt19937 random(7);
  const auto number = [&](double low, double high)
  { return low + (high - low) * static_cast<double>(random()) / 4294967295.0; };
  for (std::int64_t b = 0; b < rig.NumberOfBones(); ++b)
  {
    model.bones.push_back({ rig.Rest().bones[static_cast<std::size_t>(b)].name, rig.Head(b),
      rig.Head(b) + rig.Length(b) * rig.Direction(b), rig.ParentBone(b) });
    for (int k = 0; k < 12; ++k)
    {
      model.points.push_back(rig.Head(b) + number(-0.5, 1.5) * rig.Length(b) * rig.Direction(b) +
        Vector3(number(-2, 2), number(-2, 2), number(-2, 2)));
      for (int i = 0; i < influences; ++i)
      {
        model.weights.bone.push_back(static_cast<int>((b + i) % rig.NumberOfBones()));
        model.weights.weight.push_back(
          static_cast<float>(number(0.1, 1.0)) / static_cast<float>(1 << (2 * i)));
      }
    }
  }
  model.weights.influences = influences;
  model.faces.push_back({ "wall", false, {} });
  for (std::int64_t n = 0; n + 2 < static_cast<std::int64_t>(model.points.size()); ++n)
  {
    model.faces[0].triangles.push_back({ n, n + 1, n + 2 });
  }
  return model;
}

/// All joints moved, and what else a pose may have.
coronary::SkeletonPose PoseOf(
  const coronary::SkeletonRig& rig, double phase, bool calibre, double twist)
{
  coronary::SkeletonPose pose = rig.RestPose();
  const double beat = std::sin(6.283185307179586 * phase);
  for (std::size_t j = 0; j < pose.joints.size(); ++j)
  {
    const double s = static_cast<double>(j);
    pose.joints[j] += beat * Vector3(2.0 * std::sin(0.7 * s), 0.3 * s, 1.5 * std::cos(0.4 * s));
    if (calibre)
    {
      pose.calibre[j] = 1.0 + 0.2 * beat * std::sin(s);
    }
  }
  pose.rotation.clear();
  pose.twist.assign(rig.Rest().bones.size(), twist * beat);
  return pose;
}

/// Keys with the deviation of the nodes, and where the points belong.
std::vector<std::vector<Vector3>> AddKeys(const coronary::SkeletonRig& rig, GltfModel& model,
  const GltfSkin& skin, const std::vector<double>& phases, bool calibre, double twist = 0.0)
{
  coronary::SkinDeformation deformation(model.points, model.weights, rig.Rest());
  std::vector<std::vector<Vector3>> truth;
  for (const double phase : phases)
  {
    coronary::GltfKey key;
    key.phase = phase;
    rig.Transform(PoseOf(rig, phase, calibre, twist), key.motion);
    std::vector<double> positions(3 * model.points.size());
    deformation.Deform(key.motion, positions.data());
    truth.emplace_back();
    for (std::size_t n = 0; n < model.points.size(); ++n)
    {
      truth.back().emplace_back(positions[3 * n], positions[3 * n + 1], positions[3 * n + 2]);
    }
    key.maximumDeviation = skin.Deviation(key.motion, truth.back());
    model.keys.push_back(key);
  }
  return truth;
}

double MaximumDistance(const std::vector<Vector3>& a, const std::vector<Vector3>& b)
{
  EXPECT_EQ(a.size(), b.size());
  double maximumDistance = 0.0;
  for (std::size_t n = 0; n < std::min(a.size(), b.size()); ++n)
  {
    maximumDistance = std::max(maximumDistance, (a[n] - b[n]).norm());
  }
  return maximumDistance;
}

/// The limit of single precision: positions a third of a metre away have steps of 3e-5 mm.
constexpr double FloatError = 2e-4;

const std::vector<double> Phases = { 0.05, 0.2, 0.4, 0.65, 0.8 };
}

TEST(GltfSkin, ViewersSeeTheDeformedPointsAtEveryKey)
{
  const coronary::SkeletonRig rig(Tree());
  for (const bool calibre : { false, true })
  {
    GltfModel model = ModelOf(rig, 3);
    const GltfSkin skin(model, 8);
    EXPECT_LT(skin.MaximumDropped(), 1e-7F);
    const auto truth = AddKeys(rig, model, skin, Phases, calibre);
    const GltfEvaluator file(coronary::GltfBinary(model, skin));
    ASSERT_EQ(file.Times().size(), Phases.size() + 1);
    for (std::size_t k = 0; k < truth.size(); ++k)
    {
      EXPECT_GT(MaximumDistance(truth[k], model.points), 0.5) << "does not move";
      EXPECT_LT(MaximumDistance(file.Vertices("wall", static_cast<int>(k)), truth[k]), FloatError)
        << "calibre " << calibre << ", key " << k;
      EXPECT_LT(model.keys[k].maximumDeviation, 5e-5);
    }
    // The last key is the first one again.
    EXPECT_EQ(MaximumDistance(
                file.Vertices("wall", static_cast<int>(truth.size())), file.Vertices("wall", 0)),
      0.0);
    EXPECT_LT(MaximumDistance(file.Vertices("wall", -1), model.points), FloatError);
  }
}

TEST(GltfSkin, FewerInfluencesDeviateByWhatIsReported)
{
  const coronary::SkeletonRig rig(Tree());
  GltfModel model = ModelOf(rig, 6);
  const GltfSkin skin(model, 4);
  EXPECT_GT(skin.MaximumDropped(), 0.01F);
  const auto truth = AddKeys(rig, model, skin, Phases, true);
  const GltfEvaluator file(coronary::GltfBinary(model, skin));
  for (std::size_t k = 0; k < truth.size(); ++k)
  {
    const double seen = MaximumDistance(file.Vertices("wall", static_cast<int>(k)), truth[k]);
    EXPECT_GT(seen, 0.001);
    EXPECT_NEAR(seen, model.keys[k].maximumDeviation, FloatError);
    EXPECT_NEAR(file.Document["scenes"][0]["extras"]["largest_deviation_mm"][k].get<double>(), seen,
      FloatError);
  }
  GltfModel more = ModelOf(rig, 6);
  const GltfSkin whole(more, 12);
  AddKeys(rig, more, whole, Phases, true);
  EXPECT_LT(whole.MaximumDropped(), 1e-7F);
  EXPECT_LT(more.keys[1].maximumDeviation, 5e-5);
}

TEST(GltfSkin, TwistIsBlendedLinearly)
{
  const coronary::SkeletonRig rig(Tree());
  GltfModel model = ModelOf(rig, 1);
  const GltfSkin skin(model, 4);
  constexpr double Twist = 0.2;
  AddKeys(rig, model, skin, { 0.25 }, false, Twist);
  // A chord instead of an arc: r twist^2 / 8, at most 3 mm from the bone.
  EXPECT_LT(model.keys[0].maximumDeviation, 1.05 * 3.5 * Twist * Twist / 8.0);
  EXPECT_GT(model.keys[0].maximumDeviation, 0.005);
}

TEST(GltfSkin, TimesAxesBoundsAndWeights)
{
  const coronary::SkeletonRig rig(Tree());
  GltfModel model = ModelOf(rig, 5);
  model.faces.push_back({ "inlet_pLAD", true, { { 4, 8, 2 }, { 2, 8, 9 } } });
  model.cycleLength = 0.8;
  const GltfSkin skin(model, 8);
  AddKeys(rig, model, skin, Phases, false);
  const std::string bytes = coronary::GltfBinary(model, skin);
  EXPECT_EQ(bytes, coronary::GltfBinary(model, skin));
  const GltfEvaluator file(bytes);
  const std::vector<double> times = file.Times();
  EXPECT_EQ(times.front(), 0.0);
  EXPECT_FLOAT_EQ(static_cast<float>(times[1]), 0.12F);
  EXPECT_FLOAT_EQ(static_cast<float>(times.back()), 0.8F);
  const auto& extras = file.Document["scenes"][0]["extras"];
  EXPECT_EQ(extras["phases"].get<std::vector<double>>(), Phases);
  EXPECT_EQ(extras["unit"], "m");
  EXPECT_EQ(file.Document["nodes"][1]["extras"]["segment"], "pLAD");

  const std::vector<double> positions = file.Values(file.Attributes("wall")["POSITION"]);
  EXPECT_NEAR(positions[0], model.points[0][0] / 1000.0, 1e-7);
  EXPECT_NEAR(positions[1], model.points[0][2] / 1000.0, 1e-7) << "superior is up";
  EXPECT_NEAR(positions[2], -model.points[0][1] / 1000.0, 1e-7) << "anterior is towards the viewer";
  EXPECT_EQ(file.Vertices("caps", 0).size(), 4U) << "caps have vertices of their own";
  EXPECT_EQ(file.Document["meshes"][1]["primitives"][0]["extras"]["face"], "inlet_pLAD");

  const auto& accessor =
    file.Document["accessors"][file.Attributes("wall")["POSITION"].get<std::size_t>()];
  for (std::size_t c = 0; c < 3; ++c)
  {
    double minimum = positions[c];
    double maximum = positions[c];
    for (std::size_t n = c; n < positions.size(); n += 3)
    {
      minimum = std::min(minimum, positions[n]);
      maximum = std::max(maximum, positions[n]);
    }
    EXPECT_EQ(accessor["min"][c].get<float>(), static_cast<float>(minimum));
    EXPECT_EQ(accessor["max"][c].get<float>(), static_cast<float>(maximum));
  }
  const std::vector<float>& weights = skin.Weights();
  for (std::size_t n = 0; n < weights.size(); n += 8)
  {
    EXPECT_NEAR(std::accumulate(weights.begin() + static_cast<std::ptrdiff_t>(n),
                  weights.begin() + static_cast<std::ptrdiff_t>(n) + 8, 0.0),
      1.0, 2e-7);
    EXPECT_TRUE(std::is_sorted(weights.begin() + static_cast<std::ptrdiff_t>(n),
      weights.begin() + static_cast<std::ptrdiff_t>(n) + 8, std::greater<>()));
  }
  const std::vector<double> normals = file.Values(file.Attributes("wall")["NORMAL"]);
  for (std::size_t n = 0; n < normals.size(); n += 3)
  {
    EXPECT_NEAR(Vector3(normals[n], normals[n + 1], normals[n + 2]).norm(), 1.0, 1e-6);
  }
}

TEST(GltfSkin, LoopsEndAfterAPeriod)
{
  const coronary::SkeletonRig rig(Tree());
  const auto timesOf = [&](const std::vector<double>& phases, bool loop)
  {
    GltfModel model = ModelOf(rig, 2);
    model.loop = loop;
    const GltfSkin skin(model, 4);
    AddKeys(rig, model, skin, phases, false);
    return GltfEvaluator(coronary::GltfBinary(model, skin)).Times();
  };
  EXPECT_EQ(timesOf({ 0.0, 0.5 }, true), (std::vector<double>{ 0.0, 0.5, 1.0 }));
  EXPECT_EQ(timesOf({ 0.0, 0.5 }, false), (std::vector<double>{ 0.0, 0.5 }));
  EXPECT_EQ(timesOf({ 0.0, 0.5, 1.0 }, true), (std::vector<double>{ 0.0, 0.5, 1.0 }));
  EXPECT_EQ(timesOf({ -0.25, 0.25, 0.875 }, true), (std::vector<double>{ 0.0, 0.5, 1.0 }));
  EXPECT_EQ(timesOf({ -0.25, 0.25, 0.875 }, false), (std::vector<double>{ 0.0, 0.5, 1.125 }));
  EXPECT_EQ(timesOf({ 0.25 }, true), (std::vector<double>{ 0.0 }));
}

TEST(GltfSkin, TextHasTheSameContent)
{
  const coronary::SkeletonRig rig(Tree());
  GltfModel model = ModelOf(rig, 2);
  model.name = "not \xff UTF-8";
  const GltfSkin skin(model, 4);
  AddKeys(rig, model, skin, Phases, false);
  const GltfEvaluator file(coronary::GltfBinary(model, skin));
  nlohmann::json text = nlohmann::json::parse(coronary::GltfText(model, skin));
  const std::string uri = text["buffers"][0]["uri"];
  const std::string begin = "data:application/octet-stream;base64,";
  EXPECT_EQ(uri.compare(0, begin.size(), begin), 0);
  EXPECT_EQ(uri.size() - begin.size(), (file.Data.size() + 2) / 3 * 4);
  text["buffers"][0].erase("uri");
  EXPECT_EQ(text, file.Document);
}

TEST(GltfSkin, Refusals)
{
  const coronary::SkeletonRig rig(Tree());
  const GltfModel good = ModelOf(rig, 2);
  const auto refuse =
    [&](const char* part, int influences, const std::function<void(GltfModel&)>& spoil)
  {
    GltfModel model = good;
    spoil(model);
    ExpectRefusal([&] { coronary::GltfBinary(model, GltfSkin(model, influences)); }, part);
  };
  refuse("4, 8, 12 or 16", 5, [](GltfModel&) {});
  refuse("needs points", 4, [](GltfModel& model) { model.points.clear(); });
  refuse("another number", 4, [](GltfModel& model) { model.weights.weight.pop_back(); });
  refuse("no weight", 4,
    [](GltfModel& model) { model.weights.weight[0] = model.weights.weight[1] = 0.0F; });
  refuse("can not be", 4, [](GltfModel& model) { model.weights.bone[3] = 999; });
  refuse("not finite", 4, [](GltfModel& model) { model.points[3][1] = std::nan(""); });
  refuse("no length", 4, [](GltfModel& model) { model.bones[3].tail = model.bones[3].head; });
  refuse("ring", 4, [](GltfModel& model) { model.bones.back().parent = 0; });
  refuse("does not exist", 4, [](GltfModel& model) { model.faces[0].triangles[0][1] = -1; });
  refuse("needs triangles", 4, [](GltfModel& model) { model.faces.clear(); });
  refuse("cycle", 4, [](GltfModel& model) { model.cycleLength = 0.0; });
  refuse("number of bones", 4, [](GltfModel& model) { model.keys.emplace_back(); });
}
}
