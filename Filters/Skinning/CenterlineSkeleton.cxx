#include "CenterlineSkeleton.h"

#include "CoronaryAnatomy.h"
#include "DisjointSets.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace coronary
{
namespace
{
/// A polyline with a radius, addressed by the length along it.
class BranchCurve
{
public:
  BranchCurve(const VesselTree& tree, const VesselTree::Branch& branch)
    : Tree(tree)
    , Branch(branch)
    , Along(branch.points.size(), 0.0)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      this->Along[i] = this->Along[i - 1] +
        (tree.points[branch.points[i]] - tree.points[branch.points[i - 1]]).norm();
    }
  }

  double Length() const { return this->Along.back(); }
  const std::vector<double>& Stations() const { return this->Along; }

  Vector3 Position(double s) const
  {
    const auto [i, t] = this->Find(s);
    return (1.0 - t) * this->Tree.points[this->Branch.points[i]] +
      t * this->Tree.points[this->Branch.points[i + 1]];
  }

  double Radius(double s) const
  {
    const auto [i, t] = this->Find(s);
    return (1.0 - t) * this->Tree.radius[this->Branch.points[i]] +
      t * this->Tree.radius[this->Branch.points[i + 1]];
  }

  int SegmentId(double s) const
  {
    const auto [i, t] = this->Find(s);
    return this->Tree.segmentId.empty()
      ? this->Branch.segmentId
      : this->Tree.segmentId[this->Branch.points[t < 0.5 && i > 0 ? i : i + 1]];
  }

  /// Of the circle through three points `reach` apart: steps and noise of the polyline average out.
  double Curvature(double s, double reach) const
  {
    reach = std::min(reach, 0.5 * this->Length());
    const double middle = std::clamp(s, reach, this->Length() - reach);
    const Vector3 a = this->Position(middle - reach);
    const Vector3 b = this->Position(middle);
    const Vector3 c = this->Position(middle + reach);
    const double product = (b - a).norm() * (c - b).norm() * (c - a).norm();
    return product > 0.0 ? 2.0 * (b - a).cross(c - b).norm() / product : 0.0;
  }

private:
  std::pair<std::size_t, double> Find(double s) const
  {
    const auto above = std::upper_bound(this->Along.begin() + 1, this->Along.end() - 1, s);
    const std::size_t i = static_cast<std::size_t>(above - this->Along.begin()) - 1;
    const double span = this->Along[i + 1] - this->Along[i];
    return { i, span > 0.0 ? std::clamp((s - this->Along[i]) / span, 0.0, 1.0) : 0.0 };
  }

  const VesselTree& Tree;
  const VesselTree::Branch& Branch;
  std::vector<double> Along;
};

/// Where the joints of a branch stand, from 0 to its length.
constexpr double MostBonesOfBranch = 1e5; // a vessel has some dozens

std::vector<double> PlaceJoints(
  const BranchCurve& curve, const CenterlineSkeletonSettings& settings)
{
  const double length = curve.Length();
  // The number of wanted bones up to s; even steps of it are the bones.
  Require(length <= MostBonesOfBranch * settings.minimumLength,
    "a branch of " + std::to_string(length) + " mm is too long for bones of minimumLength " +
      std::to_string(settings.minimumLength) + " mm");
  const int samples = 1 + static_cast<int>(std::ceil(length / (0.05 * settings.minimumLength)));
  std::vector<double> count(samples + 1, 0.0);
  const double step = length / samples;
  for (int k = 0; k < samples; ++k)
  {
    const double s = (k + 0.5) * step;
    const double radius = curve.Radius(s);
    double wanted = settings.radiusFactor * radius;
    const double curvature = curve.Curvature(s, 0.5 * settings.minimumLength);
    if (curvature > 0.0)
    {
      wanted = std::min(wanted, std::sqrt(8.0 * settings.sagittaRatio * radius / curvature));
    }
    count[k + 1] =
      count[k] + step / std::clamp(wanted, settings.minimumLength, settings.maximumLength);
  }
  std::vector<double> places;
  for (int bones = std::max(1, static_cast<int>(std::ceil(count.back() - 1e-9))); bones >= 1;
       --bones)
  {
    std::vector<double> trial{ 0.0 };
    for (int i = 1; i < bones; ++i)
    {
      const double target = count.back() * i / bones;
      const auto above = std::upper_bound(count.begin() + 1, count.end() - 1, target);
      const auto k = static_cast<std::size_t>(above - count.begin()) - 1;
      trial.push_back(step * (k + (target - count[k]) / (count[k + 1] - count[k])));
    }
    trial.push_back(length);
    double shortest = length;
    double longest = 0.0;
    for (int i = 0; i < bones; ++i)
    {
      shortest = std::min(shortest, trial[i + 1] - trial[i]);
      longest = std::max(longest, trial[i + 1] - trial[i]);
    }
    // Rounding up made them shorter than wanted; one bone less is right as long as none gets too
    // long.
    if (!places.empty() && longest > settings.maximumLength)
    {
      break;
    }
    places = trial;
    if (shortest >= settings.minimumLength)
    {
      break;
    }
  }
  return places;
}

/// The points of the line, but for those on top of the one before.
std::vector<double> DistinctStations(const BranchCurve& curve)
{
  std::vector<double> places = curve.Stations();
  places.erase(std::unique(places.begin(), places.end()), places.end());
  return places;
}

std::string NamePrefix(int segmentId, int groupId)
{
  const std::string name = SegmentName(segmentId);
  return (name.empty() ? "branch" + std::to_string(groupId) : name) + "-";
}
}

void CenterlineSkeletonSettings::Validate() const
{
  // Written so that NaN fails.
  Require(this->minimumLength > 0.0 && this->minimumLength <= 1000.0,
    "minimumLength must be positive and at most 1000 mm");
  Require(this->maximumLength >= 2.0 * this->minimumLength && this->maximumLength <= 10000.0,
    "maximumLength must be at least twice minimumLength, else there are lengths that cannot be "
    "divided");
  Require(this->radiusFactor >= 0.5 && this->radiusFactor <= 50.0,
    "radiusFactor must be within 0.5 to 50");
  Require(this->sagittaRatio >= 0.01 && this->sagittaRatio <= 1.0,
    "sagittaRatio must be within 0.01 to 1");
}

void CheckSkeleton(const Skeleton& skeleton)
{
  const auto joints = static_cast<std::int64_t>(skeleton.joints.size());
  for (std::int64_t j = 0; j < joints; ++j)
  {
    Require(skeleton.joints[j].allFinite(),
      "joint " + std::to_string(j) + " has a coordinate that is not finite");
  }
  const auto fits = [&](std::size_t size) { return size == 0 || size == skeleton.joints.size(); };
  Require(fits(skeleton.radius.size()), "the radii of the skeleton are not one for each joint");
  Require(fits(skeleton.parent.size()), "the parents of the joints are not one for each joint");
  Require(fits(skeleton.abscissa.size()), "the abscissas of the joints are not one for each joint");
  DisjointSets joined(static_cast<std::size_t>(joints));
  std::set<std::pair<std::int64_t, std::int64_t>> pairs;
  for (std::size_t b = 0; b < skeleton.bones.size(); ++b)
  {
    const Skeleton::Bone& bone = skeleton.bones[b];
    const std::string name = "bone " + std::to_string(b);
    Require(bone.first >= 0 && bone.first < joints && bone.second >= 0 && bone.second < joints,
      name + " has a joint that does not exist");
    Require((skeleton.joints[bone.first] - skeleton.joints[bone.second]).squaredNorm() > 0.0,
      name + " has no length");
    Require(pairs.insert(std::minmax(bone.first, bone.second)).second,
      name + " lies between the same joints as another bone");
    Require(joined.Join(bone.first, bone.second), name + " closes a ring of bones");
  }
}

Skeleton MakeCenterlineSkeleton(const VesselTree& input, const CenterlineSkeletonSettings& settings)
{
  settings.Validate();
  VesselTree tree = SplitAtBifurcations(input);
  MeasureTree(tree);
  // Splitting numbers the branches anew; the names and ids shall be those of the input.
  // A point other than a branch's first belongs to that branch alone.
  std::vector<int> groupOfPoint(input.points.size(), -1);
  for (const VesselTree::Branch& branch : input.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      groupOfPoint[branch.points[i]] = branch.groupId;
    }
  }

  // Depth first, trees in the order of their ids, daughters in the order given.
  std::map<int, std::vector<std::size_t>> daughters;
  std::vector<std::size_t> stack;
  for (std::size_t i = 0; i < tree.branches.size(); ++i)
  {
    if (tree.branches[i].parentGroupId < 0)
    {
      stack.push_back(i);
    }
    else
    {
      daughters[tree.branches[i].parentGroupId].push_back(i);
    }
  }
  std::stable_sort(stack.begin(), stack.end(),
    [&](std::size_t a, std::size_t b)
    { return tree.branches[a].treeId < tree.branches[b].treeId; });
  std::reverse(stack.begin(), stack.end());

  Skeleton skeleton;
  std::map<std::int64_t, std::int64_t> jointOfPoint;
  std::map<std::string, int> counters;
  const auto addJoint = [&](
                          const BranchCurve& curve, double s, double abscissa, std::int64_t parent)
  {
    skeleton.joints.push_back(curve.Position(s));
    skeleton.radius.push_back(curve.Radius(s));
    skeleton.abscissa.push_back(abscissa);
    skeleton.parent.push_back(parent);
    return static_cast<std::int64_t>(skeleton.joints.size()) - 1;
  };
  while (!stack.empty())
  {
    const VesselTree::Branch& branch = tree.branches[stack.back()];
    stack.pop_back();
    const BranchCurve curve(tree, branch);
    const int groupId = groupOfPoint[branch.points[1]];
    Require(curve.Length() > 0.0, "branch " + std::to_string(groupId) + " has no length");
    const double start = tree.abscissa[branch.points.front()];
    const std::vector<double> places =
      settings.everyStep ? DistinctStations(curve) : PlaceJoints(curve, settings);
    auto [joint, isNew] = jointOfPoint.try_emplace(branch.points.front(), -1);
    if (isNew)
    {
      joint->second = addJoint(curve, 0.0, start, -1);
    }
    std::int64_t last = joint->second;
    for (std::size_t i = 1; i < places.size(); ++i)
    {
      Skeleton::Bone bone;
      bone.first = last;
      bone.second = last = addJoint(curve, places[i], start + places[i], last);
      bone.id = static_cast<int>(skeleton.bones.size());
      bone.groupId = groupId;
      bone.treeId = branch.treeId;
      bone.segmentId = curve.SegmentId(0.5 * (places[i - 1] + places[i]));
      const std::string prefix = NamePrefix(bone.segmentId, groupId);
      bone.name = prefix + std::to_string(++counters[prefix]);
      bone.length = places[i] - places[i - 1];
      skeleton.bones.push_back(bone);
    }
    jointOfPoint[branch.points.back()] = last;
    const auto& next = daughters[branch.groupId];
    stack.insert(stack.end(), next.rbegin(), next.rend());
  }
  CheckSkeleton(skeleton);
  return skeleton;
}
}
