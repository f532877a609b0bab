#include "SkinWeightSystem.h"

#include "Median.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <queue>
#include <unordered_map>

namespace coronary
{
namespace
{
using Tetrahedron = std::array<std::int64_t, 4>;

std::string At(const Vector3& p)
{
  const auto number = [](double value)
  {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.6g", value);
    return std::string(text.data());
  };
  return "(" + number(p[0]) + ", " + number(p[1]) + ", " + number(p[2]) + ")";
}

/// The input with checked indices, moved to the origin and in units of the mean edge.
struct ScaledMesh
{
  std::vector<Vector3> points;
  const std::vector<Tetrahedron>* tetrahedra = nullptr;
  std::vector<Vector3> joints;
  double unit = 1.0;
  double diagonal = 0.0; ///< of the bounding box
};

double SixVolumes(const std::vector<Vector3>& points, const Tetrahedron& t)
{
  return (points[t[1]] - points[t[0]])
    .dot((points[t[2]] - points[t[0]]).cross(points[t[3]] - points[t[0]]));
}

ScaledMesh CheckAndScale(const SkinWeightInput& input)
{
  const auto count = static_cast<std::int64_t>(input.points.size());
  const auto joints = static_cast<std::int64_t>(input.joints.size());
  Require(!input.tetrahedra.empty(), "the mesh has no tetrahedra");
  Require(!input.bones.empty(), "the skeleton has no bones");
  Require(count < 2000000000, "the mesh has too many points");
  ScaledMesh mesh;
  mesh.tetrahedra = &input.tetrahedra;
  Eigen::AlignedBox3d box;
  for (std::int64_t i = 0; i < count; ++i)
  {
    Require(input.points[i].allFinite(),
      "point " + std::to_string(i) + " of the mesh has a coordinate that is not finite");
    box.extend(input.points[i]);
  }
  for (std::int64_t j = 0; j < joints; ++j)
  {
    Require(input.joints[j].allFinite(),
      "joint " + std::to_string(j) + " has a coordinate that is not finite");
  }
  std::vector<char> used(count, 0);
  double edges = 0.0;
  for (std::size_t t = 0; t < input.tetrahedra.size(); ++t)
  {
    const Tetrahedron& tetrahedron = input.tetrahedra[t];
    for (int a = 0; a < 4; ++a)
    {
      Require(tetrahedron[a] >= 0 && tetrahedron[a] < count,
        "tetrahedron " + std::to_string(t) + " has a point that does not exist");
      used[tetrahedron[a]] = 1;
      for (int b = 0; b < a; ++b)
      {
        edges += (input.points[tetrahedron[a]] - input.points[tetrahedron[b]]).norm();
      }
    }
  }
  const auto unused = std::find(used.begin(), used.end(), 0);
  Require(unused == used.end(),
    "point " + std::to_string(unused - used.begin()) + " of the mesh belongs to no tetrahedron");
  mesh.unit = edges / (6.0 * static_cast<double>(input.tetrahedra.size()));
  Require(mesh.unit > 0.0, "the tetrahedra have no extent");
  const Vector3 centre = box.center();
  const auto scaled = [&](const Vector3& p) -> Vector3 { return (p - centre) / mesh.unit; };
  mesh.points.reserve(count);
  for (const Vector3& p : input.points)
  {
    mesh.points.push_back(scaled(p));
  }
  for (const Vector3& p : input.joints)
  {
    mesh.joints.push_back(scaled(p));
  }
  mesh.diagonal = box.diagonal().norm() / mesh.unit;
  for (std::size_t t = 0; t < input.tetrahedra.size(); ++t)
  {
    // Volume over the cube of the longest edge: below 1e-12 the energy is noise.
    double longest = 0.0;
    for (int a = 0; a < 4; ++a)
    {
      for (int b = 0; b < a; ++b)
      {
        longest = std::max(longest,
          (mesh.points[input.tetrahedra[t][a]] - mesh.points[input.tetrahedra[t][b]]).norm());
      }
    }
    Require(
      std::abs(SixVolumes(mesh.points, input.tetrahedra[t])) > 1e-12 * longest * longest * longest,
      "tetrahedron " + std::to_string(t) + " at " + At(input.points[input.tetrahedra[t][0]]) +
        " has no volume");
  }
  for (std::size_t b = 0; b < input.bones.size(); ++b)
  {
    const auto [first, second] = input.bones[b];
    Require(first >= 0 && first < joints && second >= 0 && second < joints,
      "bone " + std::to_string(b) + " has a joint that does not exist");
    Require((mesh.joints[first] - mesh.joints[second]).norm() > 1e-5 * mesh.diagonal,
      "bone " + std::to_string(b) + " has no length");
    for (std::size_t other = 0; other < b; ++other)
    {
      Require(std::minmax(first, second) !=
          std::minmax(input.bones[other].first, input.bones[other].second),
        "bones " + std::to_string(other) + " and " + std::to_string(b) +
          " lie between the same joints");
    }
  }
  return mesh;
}

/// Stiffness of linear tetrahedra, positive semi-definite, and the lumped mass.
SparseMatrix Stiffness(const ScaledMesh& mesh, std::vector<double>& mass)
{
  const auto count = static_cast<std::int64_t>(mesh.points.size());
  mass.assign(count, 0.0);
  struct Part
  {
    std::int32_t column;
    double value;
  };
  std::vector<std::int64_t> offset(count + 1, 0);
  for (const Tetrahedron& t : *mesh.tetrahedra)
  {
    for (const std::int64_t i : t)
    {
      offset[i + 1] += 4;
    }
  }
  std::partial_sum(offset.begin(), offset.end(), offset.begin());
  std::vector<Part> parts(offset.back());
  std::vector<std::int64_t> next(offset.begin(), offset.end() - 1);
  for (const Tetrahedron& t : *mesh.tetrahedra)
  {
    const double sixVolumes = SixVolumes(mesh.points, t);
    // Gradients of the four linear functions, times six volumes.
    std::array<Vector3, 4> normal;
    for (int a = 0; a < 4; ++a)
    {
      const Vector3& p = mesh.points[t[(a + 1) % 4]];
      normal[a] = (mesh.points[t[(a + 2) % 4]] - p).cross(mesh.points[t[(a + 3) % 4]] - p);
      normal[a] *= a % 2 == 0 ? -1.0 : 1.0;
    }
    for (int a = 0; a < 4; ++a)
    {
      mass[t[a]] += std::abs(sixVolumes) / 24.0;
      for (int b = 0; b < 4; ++b)
      {
        parts[next[t[a]]++] = { static_cast<std::int32_t>(t[b]),
          normal[a].dot(normal[b]) / (6.0 * std::abs(sixVolumes)) };
      }
    }
  }
  SparseMatrix stiffness;
  stiffness.rows = count;
  stiffness.offset.assign(1, 0);
  for (std::int64_t i = 0; i < count; ++i)
  {
    const auto first = parts.begin() + offset[i];
    const auto last = parts.begin() + offset[i + 1];
    std::stable_sort(first, last, [](const Part& a, const Part& b) { return a.column < b.column; });
    for (auto part = first; part != last; ++part)
    {
      if (static_cast<std::int64_t>(stiffness.column.size()) > stiffness.offset.back() &&
        stiffness.column.back() == part->column)
      {
        stiffness.value.back() += part->value;
      }
      else
      {
        stiffness.column.push_back(part->column);
        stiffness.value.push_back(part->value);
      }
    }
    stiffness.offset.push_back(static_cast<std::int64_t>(stiffness.column.size()));
  }
  return stiffness;
}

/// Joins rows that were made in parallel.
SparseMatrix JoinRows(std::vector<SparseMatrix>& parts)
{
  SparseMatrix whole;
  whole.offset.assign(1, 0);
  std::size_t entries = 0;
  for (const SparseMatrix& part : parts)
  {
    entries += part.column.size();
  }
  whole.column.reserve(entries);
  whole.value.reserve(entries);
  for (SparseMatrix& part : parts)
  {
    for (std::size_t i = 1; i < part.offset.size(); ++i)
    {
      whole.offset.push_back(static_cast<std::int64_t>(whole.column.size()) + part.offset[i]);
    }
    whole.column.insert(whole.column.end(), part.column.begin(), part.column.end());
    whole.value.insert(whole.value.end(), part.value.begin(), part.value.end());
    part = SparseMatrix();
  }
  whole.rows = static_cast<std::int64_t>(whole.offset.size()) - 1;
  return whole;
}

constexpr std::int64_t RowsAtOnce = 2048;

/// K diag(1 / mass) K
SparseMatrix Bilaplacian(const SparseMatrix& k, const std::vector<double>& mass)
{
  std::vector<SparseMatrix> parts((k.rows + RowsAtOnce - 1) / RowsAtOnce);
  ParallelFor(static_cast<std::int64_t>(parts.size()), 1,
    [&](std::int64_t firstPart, std::int64_t lastPart)
    {
      std::vector<double> sum(k.rows, 0.0);
      std::vector<char> touched(k.rows, 0);
      std::vector<std::int32_t> columns;
      for (std::int64_t p = firstPart; p < lastPart; ++p)
      {
        SparseMatrix& part = parts[p];
        part.offset.assign(1, 0);
        for (std::int64_t i = p * RowsAtOnce; i < std::min(k.rows, (p + 1) * RowsAtOnce); ++i)
        {
          columns.clear();
          for (std::int64_t a = k.offset[i]; a < k.offset[i + 1]; ++a)
          {
            const std::int32_t middle = k.column[a];
            const double factor = k.value[a] / mass[middle];
            for (std::int64_t b = k.offset[middle]; b < k.offset[middle + 1]; ++b)
            {
              const std::int32_t j = k.column[b];
              if (!touched[j])
              {
                touched[j] = 1;
                columns.push_back(j);
              }
              sum[j] += factor * k.value[b];
            }
          }
          std::sort(columns.begin(), columns.end());
          for (const std::int32_t j : columns)
          {
            part.column.push_back(j);
            part.value.push_back(sum[j]);
            sum[j] = 0.0;
            touched[j] = 0;
          }
          part.offset.push_back(static_cast<std::int64_t>(part.column.size()));
        }
      }
    });
  return JoinRows(parts);
}

double* Find(SparseMatrix& matrix, std::int64_t row, std::int64_t column)
{
  const auto first = matrix.column.begin() + matrix.offset[row];
  const auto last = matrix.column.begin() + matrix.offset[row + 1];
  const auto found = std::lower_bound(first, last, static_cast<std::int32_t>(column));
  return found != last && *found == column ? &matrix.value[found - matrix.column.begin()] : nullptr;
}

/// Tetrahedra by cells of a grid.
class TetrahedronLocator
{
public:
  explicit TetrahedronLocator(const ScaledMesh& mesh)
    : Mesh(mesh)
  {
    for (std::size_t t = 0; t < mesh.tetrahedra->size(); ++t)
    {
      Eigen::AlignedBox3d box;
      for (const std::int64_t i : (*mesh.tetrahedra)[t])
      {
        box.extend(mesh.points[i]);
      }
      this->ForCells(box, [&](std::uint64_t key) { this->Cells[key].push_back(t); });
    }
  }

  /// The tetrahedron that holds a position, and its place there; -1 outside.
  std::int64_t Locate(const Vector3& position, std::array<double, 4>& barycentric) const
  {
    const auto found = this->Cells.find(Key(Cell(position)));
    std::int64_t best = -1;
    double bestMinimum = -1e-6;
    if (found != this->Cells.end())
    {
      for (const std::size_t t : found->second)
      {
        const Tetrahedron& tetrahedron = (*this->Mesh.tetrahedra)[t];
        const double whole = SixVolumes(this->Mesh.points, tetrahedron);
        std::array<double, 4> place{};
        double minimum = 1.0;
        for (int a = 0; a < 4; ++a)
        {
          std::array<Vector3, 4> corner;
          for (int b = 0; b < 4; ++b)
          {
            corner[b] = b == a ? position : this->Mesh.points[tetrahedron[b]];
          }
          place[a] =
            (corner[1] - corner[0]).dot((corner[2] - corner[0]).cross(corner[3] - corner[0])) /
            whole;
          minimum = std::min(minimum, place[a]);
        }
        if (minimum > bestMinimum)
        {
          bestMinimum = minimum;
          best = static_cast<std::int64_t>(t);
          barycentric = place;
        }
      }
    }
    return best;
  }

private:
  static constexpr double CellSize = 2.0;
  using Index = Eigen::Matrix<std::int64_t, 3, 1>;

  static Index Cell(const Vector3& p)
  {
    return (p / CellSize).array().floor().matrix().cast<std::int64_t>();
  }

  static std::uint64_t Key(const Index& i)
  {
    const std::int64_t half = std::int64_t(1) << 20;
    return (static_cast<std::uint64_t>(i[0] + half) << 42) |
      (static_cast<std::uint64_t>(i[1] + half) << 21) | static_cast<std::uint64_t>(i[2] + half);
  }

  template <typename Function>
  void ForCells(const Eigen::AlignedBox3d& box, const Function& function)
  {
    const Index low = Cell(box.min() - Vector3::Constant(1e-6));
    const Index high = Cell(box.max() + Vector3::Constant(1e-6));
    Index i;
    for (i[0] = low[0]; i[0] <= high[0]; ++i[0])
    {
      for (i[1] = low[1]; i[1] <= high[1]; ++i[1])
      {
        for (i[2] = low[2]; i[2] <= high[2]; ++i[2])
        {
          function(Key(i));
        }
      }
    }
  }

  const ScaledMesh& Mesh;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> Cells;
};

/// A point of the mesh on a bone.
struct OnBone
{
  double along; ///< 0 at the first joint, 1 at the second
  std::int64_t point;
};

using PointsOnBones = std::vector<std::vector<OnBone>>; ///< by bone, along it

/// Bones that meet at each joint.
std::vector<std::vector<std::int32_t>> BonesOfJoints(
  const SkinWeightInput& input, std::size_t joints)
{
  std::vector<std::vector<std::int32_t>> bonesOfJoint(joints);
  const auto bones = static_cast<std::int64_t>(input.bones.size());
  for (std::int64_t b = 0; b < bones; ++b)
  {
    bonesOfJoint[input.bones[b].first].push_back(static_cast<std::int32_t>(b));
    bonesOfJoint[input.bones[b].second].push_back(static_cast<std::int32_t>(b));
  }
  return bonesOfJoint;
}

/// Weights at a joint: even ones of the bones that meet there.
std::vector<SkinWeightSystem::Target> SharedTargets(const std::vector<std::int32_t>& meeting)
{
  std::vector<SkinWeightSystem::Target> targets;
  for (const std::int32_t b : meeting)
  {
    targets.push_back({ b, 1.0 / static_cast<double>(meeting.size()) });
  }
  return targets;
}

/// @param reach  mm of the scaled mesh, within which a point is on a bone
PointsOnBones FindPointsOnBones(const SkinWeightInput& input, const ScaledMesh& mesh, double reach)
{
  const auto count = static_cast<std::int64_t>(mesh.points.size());
  const auto bones = static_cast<std::int64_t>(input.bones.size());
  std::vector<std::vector<OnBone>> pointsOf(bones);
  ParallelFor(bones, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t b = first; b < last; ++b)
      {
        const Vector3 start = mesh.joints[input.bones[b].first];
        const Vector3 axis = mesh.joints[input.bones[b].second] - start;
        const double squared = axis.squaredNorm();
        for (std::int64_t i = 0; i < count; ++i)
        {
          const double along = std::clamp(axis.dot(mesh.points[i] - start) / squared, 0.0, 1.0);
          if ((mesh.points[i] - start - along * axis).squaredNorm() <= reach * reach)
          {
            pointsOf[b].push_back({ along, i });
          }
        }
        std::sort(pointsOf[b].begin(), pointsOf[b].end(),
          [](const OnBone& a, const OnBone& c) { return a.along < c.along; });
      }
    });
  return pointsOf;
}

/// Fixes the points on bones.
void FixPoints(const SkinWeightInput& input, const ScaledMesh& mesh, double reach,
  const std::vector<std::vector<std::int32_t>>& bonesOfJoint, const PointsOnBones& pointsOf,
  SkinWeightSystem& system)
{
  const auto count = static_cast<std::int64_t>(mesh.points.size());
  const auto bones = static_cast<std::int64_t>(input.bones.size());
  system.fixed.assign(count, {});
  // Points on joints first: there bones meet rightly.
  std::vector<std::int64_t> jointAt(count, -1);
  for (std::int64_t b = 0; b < bones; ++b)
  {
    for (const OnBone& on : pointsOf[b])
    {
      for (const std::int64_t joint : { input.bones[b].first, input.bones[b].second })
      {
        if ((mesh.points[on.point] - mesh.joints[joint]).norm() <= reach)
        {
          Require(jointAt[on.point] == -1 || jointAt[on.point] == joint,
            "joints " + std::to_string(jointAt[on.point]) + " and " + std::to_string(joint) +
              " lie on the same point " + std::to_string(on.point) + " of the mesh");
          jointAt[on.point] = joint;
          system.fixed[on.point] = SharedTargets(bonesOfJoint[joint]);
        }
      }
    }
  }
  for (std::int64_t b = 0; b < bones; ++b)
  {
    for (const OnBone& on : pointsOf[b])
    {
      if (jointAt[on.point] != -1)
      {
        const auto& meeting = bonesOfJoint[jointAt[on.point]];
        Require(std::find(meeting.begin(), meeting.end(), b) != meeting.end(),
          "bone " + std::to_string(b) + " runs through joint " + std::to_string(jointAt[on.point]) +
            " of other bones, at point " + std::to_string(on.point) + " of the mesh");
        continue;
      }
      Require(system.fixed[on.point].empty(),
        "bones " +
          std::to_string(system.fixed[on.point].empty() ? -1 : system.fixed[on.point][0].bone) +
          " and " + std::to_string(b) + " both run through point " + std::to_string(on.point) +
          " of the mesh");
      system.fixed[on.point] = { { static_cast<std::int32_t>(b), 1.0 } };
    }
  }
}

/// Puts samples where bones run between points: where the bone is no edge of the mesh.
void SampleBones(const SkinWeightInput& input, const ScaledMesh& mesh, const SparseMatrix& k,
  double reach, const std::vector<std::vector<std::int32_t>>& bonesOfJoint,
  const PointsOnBones& pointsOf, bool leaveOutside, SkinWeightSystem& system)
{
  const auto bones = static_cast<std::int64_t>(input.bones.size());
  system.lengthOutside.assign(bones, 0.0);
  std::unique_ptr<TetrahedronLocator> locator;
  std::vector<char> jointSampled(mesh.joints.size(), 0);
  for (std::int64_t b = 0; b < bones; ++b)
  {
    const Vector3 start = mesh.joints[input.bones[b].first];
    const Vector3 axis = mesh.joints[input.bones[b].second] - start;
    const double length = axis.norm();
    std::size_t constraints = pointsOf[b].size();
    const auto sample = [&](double along, double size,
                          std::vector<SkinWeightSystem::Target> targets) -> double
    {
      if (!locator)
      {
        locator = std::make_unique<TetrahedronLocator>(mesh);
      }
      SkinWeightSystem::Sample s;
      const std::int64_t t = locator->Locate(start + along * axis, s.barycentric);
      if (t < 0)
      {
        return 0.0;
      }
      s.points = (*mesh.tetrahedra)[t];
      double shortest = length;
      for (int i = 0; i < 4; ++i)
      {
        for (int j = 0; j < i; ++j)
        {
          shortest =
            std::min(shortest, (mesh.points[s.points[i]] - mesh.points[s.points[j]]).norm());
        }
      }
      s.size = size / shortest;
      s.targets = std::move(targets);
      system.samples.push_back(std::move(s));
      ++constraints;
      return shortest;
    };
    const auto jointSample = [&](std::int64_t joint, double along)
    {
      if (!jointSampled[joint])
      {
        jointSampled[joint] = 1;
        sample(along, 0.5, SharedTargets(bonesOfJoint[joint]));
      }
    };
    const auto isEdge = [&](std::int64_t i, std::int64_t j)
    {
      return std::binary_search(
        k.column.begin() + k.offset[i], k.column.begin() + k.offset[i + 1], j);
    };
    if (pointsOf[b].empty() || pointsOf[b].front().along * length > reach)
    {
      jointSample(input.bones[b].first, 0.0);
    }
    if (pointsOf[b].empty() || (1.0 - pointsOf[b].back().along) * length > reach)
    {
      jointSample(input.bones[b].second, 1.0);
    }
    for (std::size_t gap = 0; gap <= pointsOf[b].size(); ++gap)
    {
      const double low = gap == 0 ? 0.0 : pointsOf[b][gap - 1].along;
      const double high = gap == pointsOf[b].size() ? 1.0 : pointsOf[b][gap].along;
      const bool edge = gap > 0 && gap < pointsOf[b].size() &&
        isEdge(pointsOf[b][gap - 1].point, pointsOf[b][gap].point);
      if (edge || (high - low) * length <= 2.0 * reach)
      {
        continue;
      }
      // In steps of a good third of the tetrahedra's edges, in the middle of even parts of the gap.
      const double step = std::min(0.25, 0.35 / ((high - low) * length));
      const int parts = static_cast<int>(std::ceil(1.0 / step));
      for (int i = 0; i < parts; ++i)
      {
        const double along = low + (high - low) * (i + 0.5) / parts;
        const double part = (high - low) * length / parts;
        if (!(sample(along, part, { { static_cast<std::int32_t>(b), 1.0 } }) > 0.0))
        {
          system.lengthOutside[b] += part * mesh.unit;
        }
      }
    }
    const bool isOutside =
      constraints == 0 || system.lengthOutside[b] >= 0.999 * length * mesh.unit;
    if (isOutside && leaveOutside)
    {
      system.outside.push_back(b);
      continue;
    }
    Require(!isOutside,
      "bone " + std::to_string(b) + " at " + At(input.joints[input.bones[b].first]) +
        " lies outside of the mesh");
  }
}

void Constrain(const SkinWeightInput& input, const ScaledMesh& mesh, const SparseMatrix& k,
  bool leaveOutside, SkinWeightSystem& system)
{
  const double reach = 1e-5 * mesh.diagonal;
  const std::vector<std::vector<std::int32_t>> bonesOfJoint =
    BonesOfJoints(input, mesh.joints.size());
  const PointsOnBones pointsOf = FindPointsOnBones(input, mesh, reach);
  FixPoints(input, mesh, reach, bonesOfJoint, pointsOf, system);
  SampleBones(input, mesh, k, reach, bonesOfJoint, pointsOf, leaveOutside, system);
}

/// The parts of the mesh that do not hang together must have a bone each.
void CheckComponents(
  const SkinWeightInput& input, const SparseMatrix& k, const SkinWeightSystem& system)
{
  std::vector<std::int32_t> component(k.rows, -1);
  std::vector<char> hasBone;
  std::vector<std::int64_t> stack;
  std::vector<std::int64_t> seeds;
  for (std::int64_t i = 0; i < k.rows; ++i)
  {
    if (component[i] >= 0)
    {
      continue;
    }
    const auto id = static_cast<std::int32_t>(hasBone.size());
    hasBone.push_back(0);
    seeds.push_back(i);
    component[i] = id;
    stack.push_back(i);
    while (!stack.empty())
    {
      const std::int64_t p = stack.back();
      stack.pop_back();
      hasBone[id] = hasBone[id] || !system.fixed[p].empty();
      for (std::int64_t a = k.offset[p]; a < k.offset[p + 1]; ++a)
      {
        if (component[k.column[a]] < 0)
        {
          component[k.column[a]] = id;
          stack.push_back(k.column[a]);
        }
      }
    }
  }
  for (const SkinWeightSystem::Sample& sample : system.samples)
  {
    hasBone[component[sample.points[0]]] = 1;
  }
  for (std::size_t id = 0; id < hasBone.size(); ++id)
  {
    const auto points =
      std::count(component.begin(), component.end(), static_cast<std::int32_t>(id));
    Require(hasBone[id],
      "a connected part of the mesh has no bone in it: " + std::to_string(points) +
        " points, one of them at " + At(input.points[seeds[id]]));
  }
}

/// Distances along the mesh's edges from the bones: which is nearest.
std::vector<std::int32_t> NearestBones(const ScaledMesh& mesh, const SparseMatrix& k,
  const SkinWeightSystem& system, std::vector<double>& distance)
{
  struct Reached
  {
    double distance;
    std::int64_t point;
    std::int32_t bone;
    bool operator>(const Reached& other) const
    {
      return this->distance != other.distance ? this->distance > other.distance
                                              : this->point > other.point;
    }
  };
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;
  distance.assign(k.rows, std::numeric_limits<double>::infinity());
  std::vector<std::int32_t> nearest(k.rows, -1);
  const auto reach = [&](std::int64_t point, double d, std::int32_t bone)
  {
    if (d < distance[point] || (d == distance[point] && bone < nearest[point]))
    {
      distance[point] = d;
      nearest[point] = bone;
      queue.push({ d, point, bone });
    }
  };
  for (std::int64_t i = 0; i < k.rows; ++i)
  {
    if (!system.fixed[i].empty())
    {
      reach(i, 0.0, system.fixed[i].front().bone);
    }
  }
  for (const SkinWeightSystem::Sample& sample : system.samples)
  {
    Vector3 position = Vector3::Zero();
    for (int a = 0; a < 4; ++a)
    {
      position += sample.barycentric[a] * mesh.points[sample.points[a]];
    }
    for (int a = 0; a < 4; ++a)
    {
      reach(sample.points[a], (mesh.points[sample.points[a]] - position).norm(),
        sample.targets.front().bone);
    }
  }
  while (!queue.empty())
  {
    const Reached top = queue.top();
    queue.pop();
    if (top.distance > distance[top.point] || top.bone != nearest[top.point])
    {
      continue;
    }
    for (std::int64_t a = k.offset[top.point]; a < k.offset[top.point + 1]; ++a)
    {
      const std::int64_t j = k.column[a];
      if (j != top.point)
      {
        reach(j, top.distance + (mesh.points[j] - mesh.points[top.point]).norm(), top.bone);
      }
    }
  }
  return nearest;
}

/// Lengths of the bones in diameters of what is around them.
void MeasureBones(const SkinWeightInput& input, const ScaledMesh& mesh,
  const std::vector<std::int32_t>& nearest, std::vector<double>& distance, SkinWeightSystem& system)
{
  std::vector<std::vector<double>> distances(system.bones);
  for (std::size_t i = 0; i < nearest.size(); ++i)
  {
    distances[nearest[i]].push_back(distance[i]);
  }
  system.diameters.assign(system.bones, 0.0);
  std::vector<double> radii;
  for (std::int64_t b = 0; b < system.bones; ++b)
  {
    std::vector<double>& own = distances[b];
    double radius = 1.0;
    if (!own.empty())
    {
      // Half of a cylinder is within 0.71 radii of its axis.
      radius = std::max(radius, MedianOf(std::move(own)) / 0.71);
    }
    radii.push_back(radius);
    const auto [first, second] = input.bones[b];
    system.diameters[b] = (mesh.joints[second] - mesh.joints[first]).norm() / (2.0 * radius);
  }
  system.radius = MedianOf(std::move(radii));
}

/// The rows and columns `order` of a matrix, in that order.
SparseMatrix Permute(const SparseMatrix& matrix, const std::vector<std::int64_t>& order)
{
  std::vector<std::int32_t> rowOf(matrix.rows, -1);
  for (std::size_t i = 0; i < order.size(); ++i)
  {
    rowOf[order[i]] = static_cast<std::int32_t>(i);
  }
  const auto rows = static_cast<std::int64_t>(order.size());
  std::vector<SparseMatrix> parts((rows + RowsAtOnce - 1) / RowsAtOnce);
  ParallelFor(static_cast<std::int64_t>(parts.size()), 1,
    [&](std::int64_t firstPart, std::int64_t lastPart)
    {
      std::vector<std::pair<std::int32_t, double>> row;
      for (std::int64_t p = firstPart; p < lastPart; ++p)
      {
        SparseMatrix& part = parts[p];
        part.offset.assign(1, 0);
        for (std::int64_t i = p * RowsAtOnce; i < std::min(rows, (p + 1) * RowsAtOnce); ++i)
        {
          row.clear();
          for (std::int64_t a = matrix.offset[order[i]]; a < matrix.offset[order[i] + 1]; ++a)
          {
            if (rowOf[matrix.column[a]] >= 0)
            {
              row.emplace_back(rowOf[matrix.column[a]], matrix.value[a]);
            }
          }
          std::sort(
            row.begin(), row.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
          for (const auto& [column, value] : row)
          {
            part.column.push_back(column);
            part.value.push_back(value);
          }
          part.offset.push_back(static_cast<std::int64_t>(part.column.size()));
        }
      }
    });
  SparseMatrix permuted = JoinRows(parts);
  return permuted;
}

/// By bone, of the energy's linear part; rows are points yet.
using LinearTerms = std::vector<std::vector<SkinWeightSystem::Entry>>;

/// Penalties of the samples. They couple points of one tetrahedron only: no new entries.
void AddSamples(double penalty, SparseMatrix& q, LinearTerms& linear, SkinWeightSystem& system)
{
  std::vector<double> original;
  if (!system.samples.empty())
  {
    original.resize(q.rows);
    for (std::int64_t i = 0; i < q.rows; ++i)
    {
      original[i] = *Find(q, i, i);
    }
  }
  for (const SkinWeightSystem::Sample& sample : system.samples)
  {
    double strength = 0.0;
    for (int a = 0; a < 4; ++a)
    {
      strength += 0.25 * penalty * sample.size * original[sample.points[a]];
    }
    for (int a = 0; a < 4; ++a)
    {
      for (int b = 0; b < 4; ++b)
      {
        *Find(q, sample.points[a], sample.points[b]) +=
          strength * sample.barycentric[a] * sample.barycentric[b];
      }
      for (const SkinWeightSystem::Target& target : sample.targets)
      {
        linear[target.bone].push_back({ static_cast<std::int32_t>(sample.points[a]),
          -strength * sample.barycentric[a] * target.value });
      }
    }
    for (const SkinWeightSystem::Target& target : sample.targets)
    {
      system.constant[target.bone] += 0.5 * strength * target.value * target.value;
    }
  }
}

/// What the fixed points add.
void AddFixedPoints(const SparseMatrix& q, LinearTerms& linear, SkinWeightSystem& system)
{
  for (std::int64_t i = 0; i < q.rows; ++i)
  {
    for (const SkinWeightSystem::Target& target : system.fixed[i])
    {
      for (std::int64_t a = q.offset[i]; a < q.offset[i + 1]; ++a)
      {
        const std::int32_t j = q.column[a];
        if (system.fixed[j].empty())
        {
          linear[target.bone].push_back({ j, q.value[a] * target.value });
        }
        else
        {
          for (const SkinWeightSystem::Target& other : system.fixed[j])
          {
            if (other.bone == target.bone)
            {
              system.constant[target.bone] += 0.5 * q.value[a] * target.value * other.value;
            }
          }
        }
      }
    }
  }
  for (std::int64_t b = 0; b < system.bones; ++b)
  {
    for (const SkinWeightSystem::Entry& entry : linear[b])
    {
      // A sample beside a fixed point.
      for (const SkinWeightSystem::Target& target : system.fixed[entry.row])
      {
        if (target.bone == b)
        {
          system.constant[b] += entry.value * target.value;
        }
      }
    }
  }
}

/// The linear part by rows, ascending, each once.
void SetLinear(
  const LinearTerms& linear, const std::vector<std::int32_t>& rowOfPoint, SkinWeightSystem& system)
{
  system.linear.resize(system.bones);
  for (std::int64_t b = 0; b < system.bones; ++b)
  {
    std::vector<SkinWeightSystem::Entry>& entries = system.linear[b];
    for (const SkinWeightSystem::Entry& entry : linear[b])
    {
      if (rowOfPoint[entry.row] >= 0)
      {
        entries.push_back({ rowOfPoint[entry.row], entry.value });
      }
    }
    std::stable_sort(
      entries.begin(), entries.end(), [](const auto& x, const auto& y) { return x.row < y.row; });
    std::size_t kept = 0;
    for (std::size_t e = 0; e < entries.size(); ++e)
    {
      if (kept > 0 && entries[kept - 1].row == entries[e].row)
      {
        entries[kept - 1].value += entries[e].value;
      }
      else
      {
        entries[kept++] = entries[e];
      }
    }
    entries.resize(kept);
  }
}

/// Bones whose points are beside each other.
void FindNeighbours(
  const SparseMatrix& k, const std::vector<std::int32_t>& nearest, SkinWeightSystem& system)
{
  system.neighbours.resize(system.bones);
  const auto touch = [&](std::int32_t a, std::int32_t b)
  {
    if (a != b)
    {
      system.neighbours[a].push_back(b);
      system.neighbours[b].push_back(a);
    }
  };
  for (std::int64_t i = 0; i < k.rows; ++i)
  {
    for (std::int64_t a = k.offset[i]; a < k.offset[i + 1]; ++a)
    {
      touch(nearest[i], nearest[k.column[a]]);
    }
    for (const SkinWeightSystem::Target& target : system.fixed[i])
    {
      touch(nearest[i], target.bone);
    }
  }
  for (std::vector<std::int32_t>& list : system.neighbours)
  {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
}
}

SkinWeightSystem MakeSkinWeightSystem(const SkinWeightInput& input,
  const SkinWeightSettings& settings, const ProgressCallback& progress)
{
  Report(progress, 0.0);
  const ScaledMesh mesh = CheckAndScale(input);
  SkinWeightSystem system;
  system.unit = mesh.unit;
  system.bones = static_cast<std::int64_t>(input.bones.size());
  std::vector<double> mass;
  const SparseMatrix k = Stiffness(mesh, mass);
  Report(progress, 0.2);
  Constrain(input, mesh, k, settings.leaveOutside, system);
  if (!system.outside.empty())
  {
    return system;
  }
  CheckComponents(input, k, system);
  Report(progress, 0.3);
  std::vector<double> distance;
  const std::vector<std::int32_t> nearest = NearestBones(mesh, k, system, distance);
  MeasureBones(input, mesh, nearest, distance, system);
  Report(progress, 0.4);

  SparseMatrix q = settings.mode == SkinWeightMode::Harmonic ? k : Bilaplacian(k, mass);
  Report(progress, 0.6);
  LinearTerms linear(system.bones);
  system.constant.assign(system.bones, 0.0);
  AddSamples(settings.penalty, q, linear, system);
  AddFixedPoints(q, linear, system);

  // Free points in a fill-reducing order.
  std::vector<std::int64_t> freePoints;
  for (std::int64_t i = 0; i < q.rows; ++i)
  {
    if (system.fixed[i].empty())
    {
      freePoints.push_back(i);
    }
  }
  const std::vector<std::int32_t> order = FillReducingOrder(Permute(q, freePoints));
  Report(progress, 0.9);
  system.pointOfRow.reserve(order.size());
  for (const std::int32_t i : order)
  {
    system.pointOfRow.push_back(freePoints[i]);
  }
  system.energy = Permute(q, system.pointOfRow);
  std::vector<std::int32_t> rowOfPoint(q.rows, -1);
  system.diagonal.resize(order.size());
  system.nearest.resize(order.size());
  for (std::size_t r = 0; r < order.size(); ++r)
  {
    const auto row = static_cast<std::int64_t>(r);
    rowOfPoint[system.pointOfRow[r]] = static_cast<std::int32_t>(r);
    system.diagonal[r] = *Find(system.energy, row, row);
    system.nearest[r] = nearest[system.pointOfRow[r]];
  }
  SetLinear(linear, rowOfPoint, system);
  FindNeighbours(k, nearest, system);
  Report(progress, 1.0);
  return system;
}
}
