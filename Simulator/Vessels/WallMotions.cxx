#include "WallMotions.h"

#include "VesselWall.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

namespace coronary
{
namespace
{
std::vector<Vector3> InOneList(const std::vector<std::vector<Vector3>>& lines)
{
  std::vector<Vector3> list;
  for (const std::vector<Vector3>& line : lines)
  {
    list.insert(list.end(), line.begin(), line.end());
  }
  return list;
}

CompactSkinWeights Subset(
  const CompactSkinWeights& weights, const std::vector<std::int64_t>& skinned)
{
  if (skinned.empty())
  {
    return weights;
  }
  const auto influences = static_cast<std::int64_t>(weights.influences);
  const std::int64_t points =
    influences > 0 ? static_cast<std::int64_t>(weights.weight.size()) / influences : 0;
  if (weights.bone.size() != weights.weight.size())
  {
    throw std::invalid_argument("the skin has " + std::to_string(weights.weight.size()) +
      " weights, and " + std::to_string(weights.bone.size()) + " bones for them");
  }
  CompactSkinWeights part;
  part.influences = weights.influences;
  for (std::size_t i = 0; i < skinned.size(); ++i)
  {
    if (skinned[i] < 0 || skinned[i] >= points)
    {
      throw std::invalid_argument("point " + std::to_string(i) + " of the wall is point " +
        std::to_string(skinned[i]) + " of a skin with " + std::to_string(points));
    }
    for (std::int64_t k = 0; k < influences; ++k)
    {
      part.bone.push_back(weights.bone[skinned[i] * influences + k]);
      part.weight.push_back(weights.weight[skinned[i] * influences + k]);
    }
  }
  return part;
}

/// On the two bones that are nearest: evenly at a joint, on one alone where it is much nearer.
CompactSkinWeights HangOnNearest(const std::vector<Vector3>& points, const Skeleton& skeleton)
{
  CompactSkinWeights weights;
  weights.influences = 2;
  for (const Vector3& p : points)
  {
    std::array<std::pair<double, std::int32_t>, 2> nearest;
    nearest.fill({ std::numeric_limits<double>::infinity(), 0 });
    for (std::size_t b = 0; b < skeleton.bones.size(); ++b)
    {
      const Skeleton::Bone& bone = skeleton.bones[b];
      const double squared =
        NearestOnSegment(p, skeleton.joints[bone.first], skeleton.joints[bone.second])
          .squaredDistance;
      const std::pair<double, std::int32_t> entry{ squared, static_cast<std::int32_t>(b) };
      if (entry < nearest[0])
      {
        nearest[1] = nearest[0];
        nearest[0] = entry;
      }
      else if (entry < nearest[1])
      {
        nearest[1] = entry;
      }
    }
    constexpr double soft = 0.04; // mm^2
    const double first = 1.0 / (nearest[0].first + soft);
    const double second = std::isfinite(nearest[1].first) ? 1.0 / (nearest[1].first + soft) : 0.0;
    for (const auto& [entry, weight] :
      { std::pair(nearest[0], first), std::pair(nearest[1], second) })
    {
      weights.bone.push_back(entry.second);
      weights.weight.push_back(static_cast<float>(weight / (first + second)));
    }
  }
  return weights;
}

void RequireAxis(const WallTopology& topology)
{
  const std::size_t branches = topology.axis.size();
  const auto require = [&](std::size_t size, const char* name)
  {
    if (size != branches)
    {
      throw std::invalid_argument("the wall's axis has " + std::to_string(branches) +
        " branches, and " + std::to_string(size) + " entries of " + name);
    }
  };
  require(topology.axisRadius.size(), "axisRadius");
  require(topology.parent.size(), "parent");
  if (!topology.groupName.empty())
  {
    require(topology.groupName.size(), "groupName");
  }
  for (std::size_t b = 0; b < branches; ++b)
  {
    const std::string name = "branch " + std::to_string(b) + " of the wall's axis";
    if (topology.axis[b].size() < 2 || topology.axisRadius[b].size() != topology.axis[b].size())
    {
      throw std::invalid_argument(name + " has " + std::to_string(topology.axis[b].size()) +
        " points and " + std::to_string(topology.axisRadius[b].size()) +
        " radii, not two or more of both");
    }
    for (std::size_t i = 0; i < topology.axis[b].size(); ++i)
    {
      if (!topology.axis[b][i].allFinite() || !(topology.axisRadius[b][i] > 0.0) ||
        !std::isfinite(topology.axisRadius[b][i]))
      {
        throw std::invalid_argument(name + " has a place that is not finite or a radius of " +
          std::to_string(topology.axisRadius[b][i]) + " mm at its point " + std::to_string(i));
      }
    }
    // Towards the root there are less steps than branches.
    int parent = topology.parent[b];
    for (std::size_t steps = 0; parent != -1; ++steps)
    {
      if (parent < 0 || parent >= static_cast<int>(branches) || steps >= branches)
      {
        throw std::invalid_argument(
          name + " has no way to a root: its parent is " + std::to_string(topology.parent[b]));
      }
      parent = topology.parent[parent];
    }
  }
  for (std::size_t i = 0; i < topology.group.size(); ++i)
  {
    if (topology.group[i] < -1 || topology.group[i] >= static_cast<int>(branches))
    {
      throw std::invalid_argument("point " + std::to_string(i) + " of the wall is of group " +
        std::to_string(topology.group[i]) + ", and there are " + std::to_string(branches) +
        " branches");
    }
  }
}

WallTopology Checked(WallTopology topology, const std::vector<Vector3>& points)
{
  CheckWall(topology, points);
  return topology;
}
}

void CheckWall(const WallTopology& topology, const std::vector<Vector3>& points)
{
  CheckWallSurface(topology, points);
  if (!topology.axis.empty())
  {
    RequireAxis(topology);
  }
}

StillWallMotion::StillWallMotion(WallTopology topology, std::vector<Vector3> points)
  : Topology_(Checked(std::move(topology), points))
  , Points(std::move(points))
  , Axis(InOneList(Topology_.axis))
{
}

void StillWallMotion::Positions(double /*phase*/, std::vector<Vector3>& positions)
{
  positions = this->Points;
}

void StillWallMotion::AxisPositions(double /*phase*/, std::vector<Vector3>& positions)
{
  positions = this->Axis;
}

SampledWallMotion::SampledWallMotion(WallTopology topology, const std::vector<double>& phases,
  const std::vector<std::vector<Vector3>>& positions, const std::vector<std::vector<Vector3>>& axis)
  : Topology_(std::move(topology))
  , Points(phases, positions)
  , RestAxis(InOneList(Topology_.axis))
{
  for (const std::vector<Vector3>& points : positions)
  {
    CheckWall(this->Topology_, points);
  }
  if (!axis.empty())
  {
    if (axis[0].size() != this->RestAxis.size())
    {
      throw std::invalid_argument("the wall's axis has " + std::to_string(this->RestAxis.size()) +
        " points, and moves with " + std::to_string(axis[0].size()));
    }
    this->Axis = std::make_unique<PeriodicPositions>(phases, axis);
  }
}

void SampledWallMotion::Positions(double phase, std::vector<Vector3>& positions)
{
  this->Points.Evaluate(phase, positions);
}

void SampledWallMotion::AxisPositions(double phase, std::vector<Vector3>& positions)
{
  if (this->Axis)
  {
    this->Axis->Evaluate(phase, positions);
  }
  else
  {
    positions = this->RestAxis;
  }
}

SkinnedWallMotion::SkinnedWallMotion(WallTopology topology, const std::vector<Vector3>& rest,
  const CompactSkinWeights& weights, const std::vector<std::int64_t>& skinned,
  const Skeleton& skeleton, const PoseSequence& poses, const BeatingModelSettings& settings)
  : Topology_(Checked(std::move(topology), rest))
  , Wall(rest, Subset(weights, skinned), skeleton, poses, settings)
{
  const std::vector<Vector3> axis = InOneList(this->Topology_.axis);
  if (!axis.empty())
  {
    this->Axis = std::make_unique<BeatingModel>(
      axis, HangOnNearest(axis, skeleton), skeleton, poses, settings);
  }
}

void SkinnedWallMotion::Positions(double phase, std::vector<Vector3>& positions)
{
  positions.resize(static_cast<std::size_t>(this->Topology_.points));
  this->Wall.Positions(std::isfinite(phase) ? phase : 0.0, positions.front().data());
}

void SkinnedWallMotion::AxisPositions(double phase, std::vector<Vector3>& positions)
{
  if (!this->Axis)
  {
    positions.clear();
    return;
  }
  positions.resize(static_cast<std::size_t>(this->Axis->NumberOfPoints()));
  this->Axis->Positions(std::isfinite(phase) ? phase : 0.0, positions.front().data());
}

std::shared_ptr<WallMotion> SampleWallMotion(WallMotion& motion, int phases)
{
  if (phases < 4 || phases > 200)
  {
    throw std::invalid_argument(
      "a motion is sampled at 4 to 200 phases, not " + std::to_string(phases));
  }
  std::vector<double> times(phases);
  std::vector<std::vector<Vector3>> positions(phases);
  std::vector<std::vector<Vector3>> axis(phases);
  for (int i = 0; i < phases; ++i)
  {
    times[i] = static_cast<double>(i) / phases;
    motion.Positions(times[i], positions[i]);
    motion.AxisPositions(times[i], axis[i]);
  }
  return std::make_shared<SampledWallMotion>(motion.Topology(), times, positions, axis);
}

namespace
{
/// Place of each branch in its tree, by its GroupId.
std::map<int, int> BranchesByGroup(const PhantomTree& tree)
{
  std::map<int, int> branchOf;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    branchOf[tree.branches[b].groupId] = static_cast<int>(b);
  }
  return branchOf;
}
}

AortaAtRest PhantomAorta(const CoronaryPhantom& phantom)
{
  constexpr double time = 0.0;
  std::vector<AorticRing> rings = phantom.Aorta(time);
  rings.resize(std::min(rings.size(), PhantomAortaSeen));
  for (AorticRing& ring : rings)
  {
    ring.centre = phantom.ReferencePosition(ring.centre, time);
    for (Vector3& point : ring.rim)
    {
      point = phantom.ReferencePosition(point, time);
    }
  }
  AorticModel model = ModelAorta(rings);
  return { std::move(model.points), std::move(model.triangles), std::move(model.axis) };
}

WallTopology PhantomAxes(const CoronaryPhantom& phantom)
{
  WallTopology topology;
  const PhantomTree tree = phantom.Tree(0.0);
  const std::map<int, int> branchOf = BranchesByGroup(tree);
  for (const VesselTree::Branch& branch : tree.branches)
  {
    topology.axis.emplace_back();
    topology.axisRadius.emplace_back();
    for (const std::int64_t p : branch.points)
    {
      topology.axis.back().push_back(tree.points[p] - tree.displacement[p]);
      topology.axisRadius.back().push_back(tree.radius[p]);
    }
    topology.groupName.push_back(SegmentName(branch.segmentId));
    const auto parent = branchOf.find(branch.parentGroupId);
    topology.parent.push_back(parent == branchOf.end() ? -1 : parent->second);
  }
  return topology;
}

std::shared_ptr<WallMotion> MakePhantomWallMotion(
  const PhantomSettings& settings, double edgeLength, int phases, const ProgressCallback& progress)
{
  if (phases < 4 || phases > 200)
  {
    throw std::invalid_argument(
      "phases of the phantom's wall is " + std::to_string(phases) + ", not 4 to 200");
  }
  if (settings.beatVariation != 0.0)
  {
    throw std::invalid_argument("beatVariation of the phantom is " +
      std::to_string(settings.beatVariation) + ", and a wall that beats periodically needs 0");
  }
  if (settings.beatIrregularity != 0.0)
  {
    throw std::invalid_argument("beatIrregularity of the phantom is " +
      std::to_string(settings.beatIrregularity) +
      " mm, and a wall that beats periodically needs 0");
  }
  PhantomSettings used = settings;
  used.surfaceSpacing = edgeLength;
  const CoronaryPhantom phantom(used);
  WallTopology topology = PhantomAxes(phantom);
  topology.aorta = std::make_shared<AortaAtRest>(PhantomAorta(phantom));
  const std::map<int, int> branchOf = BranchesByGroup(phantom.Tree(0.0));
  std::vector<double> times;
  std::vector<std::vector<Vector3>> positions;
  std::vector<std::vector<Vector3>> axis;
  for (int k = 0; k < phases; ++k)
  {
    const double time = static_cast<double>(k) / phases;
    times.push_back(time);
    PhantomSurface surface = phantom.Surface(time,
      progress ? ProgressCallback([&](double f) { return progress((k + f) / phases); })
               : ProgressCallback());
    if (k == 0)
    {
      topology.points = static_cast<std::int64_t>(surface.points.size());
      topology.triangles = surface.triangles;
      topology.entity = surface.entityId;
      for (const int group : surface.groupId)
      {
        const auto branch = branchOf.find(group);
        topology.group.push_back(branch == branchOf.end() ? -1 : branch->second);
      }
    }
    positions.push_back(std::move(surface.points));
    const PhantomTree moved = phantom.Tree(time);
    axis.emplace_back();
    for (const VesselTree::Branch& branch : moved.branches)
    {
      for (const std::int64_t p : branch.points)
      {
        axis.back().push_back(moved.points[p]);
      }
    }
  }
  return std::make_shared<SampledWallMotion>(std::move(topology), times, positions, axis);
}
}
