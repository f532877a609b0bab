/**
 * @file TetrahedronTestMeshes.h
 * @brief Tetrahedral meshes of grid cells for the tests and benchmarks of skinning.
 */
#ifndef DynamicCoronary_TetrahedronTestMeshes_h
#define DynamicCoronary_TetrahedronTestMeshes_h

#include "BiharmonicSkinWeights.h"
#include "CounterRandom.h"

#include <algorithm>
#include <array>
#include <functional>
#include <map>

namespace coronary
{
enum class CellSplit
{
  Six, ///< along the diagonal: few points, not symmetric
  Star ///< around the cell's middle and those of its faces: as symmetric as the cell
};

/// The cells of a grid whose middles are `inside`, in tetrahedra. Grid points are multiples of h.
inline SkinWeightInput MeshOfCells(const std::array<int, 3>& low, const std::array<int, 3>& high,
  double h, const std::function<bool(const Vector3&)>& inside, CellSplit split = CellSplit::Six)
{
  SkinWeightInput input;
  std::map<std::array<int, 3>, std::int64_t> points; // by twice the index
  const auto point = [&](const std::array<int, 3>& twice)
  {
    const auto [found, isNew] =
      points.try_emplace(twice, static_cast<std::int64_t>(input.points.size()));
    if (isNew)
    {
      input.points.push_back(0.5 * h * Vector3(twice[0], twice[1], twice[2]));
    }
    return found->second;
  };
  for (int k = low[2]; k < high[2]; ++k)
  {
    for (int j = low[1]; j < high[1]; ++j)
    {
      for (int i = low[0]; i < high[0]; ++i)
      {
        if (!inside(h * Vector3(i + 0.5, j + 0.5, k + 0.5)))
        {
          continue;
        }
        const std::array<int, 3> cell{ 2 * i, 2 * j, 2 * k };
        const auto moved = [&](const std::array<int, 3>& by) {
          return std::array<int, 3>{ cell[0] + by[0], cell[1] + by[1], cell[2] + by[2] };
        };
        if (split == CellSplit::Six)
        {
          std::array<int, 3> axes{ 0, 1, 2 };
          do
          {
            std::array<std::int64_t, 4> t{};
            std::array<int, 3> at{ 0, 0, 0 };
            t[0] = point(moved(at));
            for (int n = 0; n < 3; ++n)
            {
              at[axes[n]] = 2;
              t[n + 1] = point(moved(at));
            }
            input.tetrahedra.push_back(t);
          } while (std::next_permutation(axes.begin(), axes.end()));
          continue;
        }
        for (int axis = 0; axis < 3; ++axis)
        {
          for (const int side : { 0, 2 })
          {
            constexpr std::array<std::array<int, 2>, 5> ring{ { { 0, 0 }, { 2, 0 }, { 2, 2 },
              { 0, 2 }, { 0, 0 } } };
            std::array<int, 3> face{ 1, 1, 1 };
            face[axis] = side;
            for (int n = 0; n < 4; ++n)
            {
              std::array<int, 3> a = face;
              std::array<int, 3> b = face;
              for (int m = 0; m < 2; ++m)
              {
                a[(axis + 1 + m) % 3] = ring[n][m];
                b[(axis + 1 + m) % 3] = ring[n + 1][m];
              }
              input.tetrahedra.push_back({ point(moved({ 1, 1, 1 })), point(moved(face)),
                point(moved(a)), point(moved(b)) });
            }
          }
        }
      }
    }
  }
  return input;
}

inline double DistanceToSegment(const Vector3& p, const Vector3& a, const Vector3& b)
{
  return std::sqrt(NearestOnSegment(p, a, b).squaredDistance);
}

/// Adds the bones of a polyline through grid points; returns its first and last joint.
inline void AddBones(
  SkinWeightInput& input, std::int64_t firstJoint, const std::vector<Vector3>& next)
{
  for (const Vector3& p : next)
  {
    input.joints.push_back(p);
    input.bones.emplace_back(firstJoint, static_cast<std::int64_t>(input.joints.size()) - 1);
    firstJoint = static_cast<std::int64_t>(input.joints.size()) - 1;
  }
}

/**
 * A tree of tubes with square sections along the grid: a trunk along x, branches along +-y and z.
 * Bones lie on the mesh's edges and are `boneCells` cells long; the tubes are 2 `half` cells wide.
 */
inline SkinWeightInput MeshOfComb(int branches, int branchBones, int boneCells, int half, double h)
{
  std::vector<std::pair<Vector3, Vector3>> axes;
  const int trunkBones = branches + 1;
  const double bone = boneCells * h;
  axes.emplace_back(Vector3::Zero(), Vector3(trunkBones * bone, 0.0, 0.0));
  const std::array<Vector3, 4> directions{ Vector3(0, 1, 0), Vector3(0, 0, 1), Vector3(0, -1, 0),
    Vector3(0, 0, -1) };
  for (int b = 0; b < branches; ++b)
  {
    const Vector3 from((b + 1) * bone, 0.0, 0.0);
    axes.emplace_back(from, from + branchBones * bone * directions[b % 4]);
  }
  const int reach = branchBones * boneCells + half;
  const double width = (half - 0.25) * h;
  SkinWeightInput input =
    MeshOfCells({ -half, -reach, -reach }, { trunkBones * boneCells + half, reach, reach }, h,
      [&](const Vector3& p)
      {
        return std::any_of(axes.begin(), axes.end(),
          [&](const auto& axis)
          {
            const Vector3 d = (axis.second - axis.first).normalized();
            const double along = d.dot(p - axis.first);
            return along > -width && along < (axis.second - axis.first).norm() + width &&
              (p - axis.first - along * d).norm() < 1.3 * width;
          });
      });
  input.joints.push_back(Vector3::Zero());
  std::vector<Vector3> trunk;
  for (int i = 1; i <= trunkBones; ++i)
  {
    trunk.emplace_back(i * bone, 0.0, 0.0);
  }
  AddBones(input, 0, trunk);
  for (int b = 0; b < branches; ++b)
  {
    std::vector<Vector3> side;
    for (int i = 1; i <= branchBones; ++i)
    {
      side.push_back(Vector3((b + 1) * bone, 0.0, 0.0) + i * bone * directions[b % 4]);
    }
    AddBones(input, b + 1, side);
  }
  return input;
}

/// A comb whose points, but for those on bones, are moved at random by up to 0.06 along each axis.
inline SkinWeightInput MovedComb(int branches, int branchBones, int boneCells, int half)
{
  SkinWeightInput input = MeshOfComb(branches, branchBones, boneCells, half, 0.5);
  RandomStream random(1);
  for (Vector3& p : input.points)
  {
    const double x = random.Uniform(-1, 1);
    const double y = random.Uniform(-1, 1);
    const double z = random.Uniform(-1, 1);
    const bool onBone = std::any_of(input.bones.begin(), input.bones.end(),
      [&](const auto& bone)
      { return DistanceToSegment(p, input.joints[bone.first], input.joints[bone.second]) < 1e-9; });
    p += onBone ? Vector3::Zero() : Vector3(0.06 * Vector3(x, y, z));
  }
  return input;
}
}

#endif
