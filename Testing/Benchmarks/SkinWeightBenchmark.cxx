// Skin weights on trees of growing size: time, optimality, and libigl's weights beside them.

#include "SweepSurface.h"
#include "TetrahedralMesh.h"
#include "TetrahedronTestMeshes.h"
#ifdef DYNAMICCORONARY_WITH_LIBIGL
#include "LibiglSkinWeights.h"
#endif

#include <CLI/CLI.hpp>
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <iostream>

using namespace coronary;

namespace
{
struct Case
{
  int branches;
  int branchBones;
  int boneCells;
  int half;
};

/// Two trees of five branches with six straight bones each, 2.2 to 0.8 mm in radius, as the mesher makes
/// tetrahedra of them: about the case of the published time of libigl.
SkinWeightInput MeshedTrees(double boneLength, double edgeLength, double sizeFactor)
{
  constexpr int branchBones = 6;
  VesselTree tree;
  std::vector<std::pair<std::int64_t, std::int64_t>> bones;
  RandomStream random(1);
  const auto grow = [&](std::int64_t from, Vector3 direction, double last)
  {
    VesselTree::Branch branch;
    branch.groupId = static_cast<int>(tree.branches.size());
    branch.points = { from };
    const double first = tree.radius[from];
    for (int i = 1; i <= branchBones; ++i)
    {
      const double x = random.Uniform(-0.15, 0.15);
      const double y = random.Uniform(-0.15, 0.15);
      const double z = random.Uniform(-0.15, 0.15);
      direction = (direction + Vector3(x, y, z)).normalized();
      const Vector3 next = tree.points[branch.points.back()] + boneLength * direction;
      tree.points.push_back(next);
      tree.radius.push_back(first + (last - first) * i / branchBones);
      const auto point = static_cast<std::int64_t>(tree.points.size()) - 1;
      bones.emplace_back(branch.points.back(), point);
      branch.points.push_back(point);
    }
    tree.branches.push_back(branch);
    return branch.points.back();
  };
  for (const double side : { -1.0, 1.0 })
  {
    tree.points.emplace_back(side * 15.0, 0.0, 0.0);
    tree.radius.push_back(2.2);
    const std::int64_t root = static_cast<std::int64_t>(tree.points.size()) - 1;
    const std::int64_t fork = grow(root, Vector3(side, 0.0, 0.3), 1.7);
    const std::int64_t front = grow(fork, Vector3(side, 0.8, 0.0), 1.2);
    grow(fork, Vector3(side, -0.8, 0.0), 0.9);
    grow(front, Vector3(side, 0.3, 0.8), 0.8);
    grow(front, Vector3(side, 0.3, -0.8), 0.8);
  }
  SweepSettings sweep;
  sweep.minimumEdgeLength = edgeLength;
  sweep.maximumEdgeLength = edgeLength;
  const SweptSurface surface = SweepVesselTree(tree, sweep);
  TetrahedralMeshInput meshInput;
  meshInput.points = surface.points;
  meshInput.triangles = surface.triangles;
  meshInput.skeletonPoints = tree.points;
  meshInput.skeletonRadius = tree.radius;
  meshInput.skeletonEdges = bones;
  TetrahedralMeshSettings settings;
  settings.sizeFactor = sizeFactor;
  settings.outside = OutsidePolicy::LeaveOut;
  const TetrahedralMesh mesh = MakeTetrahedralMesh(meshInput, settings);
  SkinWeightInput input;
  input.points = mesh.points;
  for (const Tetrahedron& t : mesh.tetrahedra)
  {
    input.tetrahedra.push_back({ t[0], t[1], t[2], t[3] });
  }
  input.joints = tree.points;
  input.bones = bones;
  return input;
}

struct Clock
{
  std::chrono::steady_clock::time_point wall = std::chrono::steady_clock::now();
  std::clock_t processor = std::clock();

  double Wall() const
  {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - this->wall).count();
  }
  double Processor() const
  {
    return static_cast<double>(std::clock() - this->processor) / CLOCKS_PER_SEC;
  }
};

double PeakGigabytes()
{
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1 << 20);
}

#ifdef DYNAMICCORONARY_WITH_LIBIGL
/// Greatest difference to libigl's weights, each row divided by its sum.
double CompareWithLibigl(
  const SkinWeightInput& input, const SkinWeights& mine, int iterations, bool print)
{
  std::vector<std::int64_t> fixed;
  for (std::size_t i = 0; i < input.points.size(); ++i)
  {
    for (const auto& bone : input.bones)
    {
      if (DistanceToSegment(input.points[i], input.joints[bone.first], input.joints[bone.second]) <
        1e-9)
      {
        fixed.push_back(static_cast<std::int64_t>(i));
        break;
      }
    }
  }
  const auto rows = static_cast<Eigen::Index>(fixed.size());
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(rows, mine.bones);
  for (Eigen::Index r = 0; r < rows; ++r)
  {
    for (std::int64_t e = mine.offset[fixed[r]]; e < mine.offset[fixed[r] + 1]; ++e)
    {
      values(r, mine.bone[e]) = mine.weight[e];
    }
  }
  const Clock clock;
  Eigen::MatrixXd theirs = LibiglSkinWeights(input, fixed, values, iterations);
  std::printf(
    "  libigl: wall %.2f s, processor %.2f s, weights %.4f to %.4f, row sums %.4f to %.4f\n",
    clock.Wall(), clock.Processor(), theirs.minCoeff(), theirs.maxCoeff(),
    theirs.rowwise().sum().minCoeff(), theirs.rowwise().sum().maxCoeff());
  double difference = 0.0;
  for (Eigen::Index i = 0; i < theirs.rows(); ++i)
  {
    Eigen::RowVectorXd row = theirs.row(i) / theirs.row(i).sum();
    for (std::int64_t e = mine.offset[i]; e < mine.offset[i + 1]; ++e)
    {
      row[mine.bone[e]] -= mine.weight[e];
    }
    difference = std::max(difference, row.cwiseAbs().maxCoeff());
  }
  std::printf("    greatest difference %.2e\n", difference);
  if (print)
  {
    // For LibiglReferenceWeights.h.
    for (Eigen::Index i = 0; i < theirs.rows(); ++i)
    {
      for (Eigen::Index b = 0; b < theirs.cols(); ++b)
      {
        std::printf(
          "%.6f,%s", theirs(i, b) / theirs.row(i).sum(), b + 1 < theirs.cols() ? " " : "\n");
      }
    }
  }
  return difference;
}
#endif

constexpr int MeshedSize = 6;

int Run(int argc, char** argv)
{
  CLI::App app{ "Skin weights on trees of growing size" };
  std::vector<int> sizes{ 0, 1, 2 };
  int libiglUpTo = 5000;
  int libiglIterations = 100;
  bool printLibigl = false;
  double neighbourhood = 1.75;
  app.add_option("--sizes", sizes,
    "0: 2k points, 13 bones; 1: 9k, 46; 2: 23k, 61; 3: 125k, 61; 4: 242k, 151; "
    "5: 24k, 61, 115k tetrahedra; 6: as the mesher makes them, 24k, 60, 114k tetrahedra");
  app.add_option("--libigl-up-to", libiglUpTo, "most points for libigl");
  app.add_option("--libigl-iterations", libiglIterations, "of its active set");
  app.add_flag("--print-libigl", printLibigl, "its weights, a line a point");
  app.add_option("--neighbourhood", neighbourhood, "diameters around a bone; 0: everywhere");
  std::vector<int> tree;
  app.add_option("--tree", tree, "instead: branches, their bones, a bone's cells, half a tube's")
    ->expected(4);
  std::vector<double> trees{ 3.5, 0.41, 0.2 };
  app
    .add_option(
      "--trees", trees, "of size 6: bone's length and edges' in mm, edges inside in radii")
    ->expected(3);
  CLI11_PARSE(app, argc, argv);
  bool good = true;
  std::vector<Case> cases{ { 3, 3, 6, 2 }, { 9, 4, 8, 2 }, { 12, 4, 6, 3 }, { 12, 4, 14, 5 },
    { 25, 5, 11, 5 }, { 12, 4, 4, 4 } };
  if (!tree.empty())
  {
    cases = { { tree[0], tree[1], tree[2], tree[3] } };
    sizes = { 0 };
  }
  for (const int size : sizes)
  {
    const bool isMeshed = size == MeshedSize && tree.empty();
    const Case& c = cases.at(isMeshed ? 0 : size);
    const SkinWeightInput input = isMeshed
      ? MeshedTrees(trees[0], trees[1], trees[2])
      : MovedComb(c.branches, c.branchBones, c.boneCells, c.half);
    std::printf("%zu points, %zu tetrahedra, %zu bones\n", input.points.size(),
      input.tetrahedra.size(), input.bones.size());
    for (const SkinWeightMode mode : { SkinWeightMode::Joint, SkinWeightMode::Independent })
    {
      SkinWeightSettings settings;
      settings.mode = mode;
      settings.neighbourhood = neighbourhood;
      const Clock clock;
      const SkinWeights weights = ComputeSkinWeights(input, settings);
      std::printf("  %s: wall %.2f s, processor %.2f s, %d iterations, %d polish steps, residual "
                  "%.1e (everywhere %.1e), gap %.1e, row sums %.4f to %.4f, %.2f bones a point, "
                  "peak %.2f GB\n",
        mode == SkinWeightMode::Joint ? "Joint" : "Independent", clock.Wall(), clock.Processor(),
        weights.iterations, weights.polishSteps, weights.residual, weights.residualEverywhere,
        weights.energyGap, weights.minimumSum, weights.maximumSum,
        static_cast<double>(weights.bone.size()) / static_cast<double>(input.points.size()),
        PeakGigabytes());
      std::fflush(stdout);
      good = good && weights.converged;
#ifdef DYNAMICCORONARY_WITH_LIBIGL
      if (mode == SkinWeightMode::Independent &&
        static_cast<int>(input.points.size()) <= libiglUpTo)
      {
        good = CompareWithLibigl(input, weights, libiglIterations, printLibigl) < 1e-3 && good;
      }
#endif
    }
  }
  return good ? 0 : 1;
}
}

int main(int argc, char** argv)
{
  try
  {
    return Run(argc, argv);
  }
  catch (const std::exception& error)
  {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
