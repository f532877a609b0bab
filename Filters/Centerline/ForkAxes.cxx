#include "ForkAxes.h"

#include "BifurcationFit.h"
#include "BranchMouth.h"
#include "CrossFrame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

namespace coronary
{
namespace
{
/// A vessel goes straight on if it bends by no more, and the other one by so much more. Radians.
constexpr double MostBend = 0.5;
constexpr double MinimumTurn = 0.35;

/// Points of a tree one after the other, across forks.
struct TreePath
{
  std::vector<std::int64_t> points;
  std::vector<std::size_t> joints; ///< numbers of the forks between its ends
  double length = 0.0;             ///< mm

  /// @returns false when it has become longer than `reach`: the rest is left out
  bool Append(const VesselTree& tree, const std::vector<std::int64_t>& branch, double reach);
};

bool TreePath::Append(const VesselTree& tree, const std::vector<std::int64_t>& branch, double reach)
{
  if (this->points.empty())
  {
    this->points.push_back(branch.front());
  }
  else
  {
    this->joints.push_back(this->points.size() - 1);
  }
  for (std::size_t i = 1; i < branch.size(); ++i)
  {
    this->length += (tree.points[branch[i]] - tree.points[branch[i - 1]]).norm();
    this->points.push_back(branch[i]);
    if (this->length > reach)
    {
      return false;
    }
  }
  return true;
}

/// A branch from its end on against the flow.
TreePath Upstream(const VesselTree& tree, std::size_t branch, double reach)
{
  TreePath path;
  for (int at = static_cast<int>(branch); at >= 0; at = tree.branches[at].parentGroupId)
  {
    std::vector<std::int64_t> points = tree.branches[at].points;
    std::reverse(points.begin(), points.end());
    if (!path.Append(tree, points, reach))
    {
      break;
    }
  }
  return path;
}

/// A branch and the widest ones that follow.
TreePath Downstream(const VesselTree& tree, std::size_t branch, double reach)
{
  TreePath path;
  double widest = 1.0;
  while (widest > 0.0 && path.Append(tree, tree.branches[branch].points, reach))
  {
    widest = 0.0;
    const int group = tree.branches[branch].groupId;
    for (std::size_t b = 0; b < tree.branches.size(); ++b)
    {
      const std::vector<std::int64_t>& own = tree.branches[b].points;
      const double radius = tree.radius[own[own.size() / 2]];
      if (tree.branches[b].parentGroupId == group && radius > widest)
      {
        widest = radius;
        branch = b;
      }
    }
  }
  return path;
}

struct Fork
{
  std::size_t parent = 0; ///< branches
  std::array<std::size_t, 2> daughters{};
};

/// Forks of two daughters, in the order of their points. Branches are split there, and numbered by their groups.
std::vector<Fork> ForksOfTwo(const VesselTree& tree)
{
  std::map<std::int64_t, std::vector<std::size_t>> daughters;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    if (tree.branches[b].parentGroupId >= 0)
    {
      daughters[tree.branches[b].points.front()].push_back(b);
    }
  }
  std::vector<Fork> forks;
  for (const auto& [point, branches] : daughters)
  {
    if (branches.size() == 2)
    {
      const int parent = tree.branches[branches[0]].parentGroupId;
      forks.push_back({ static_cast<std::size_t>(parent), { branches[0], branches[1] } });
    }
  }
  return forks;
}

/// The fit of one fork, if the one daughter turns off and the other one goes straight on.
struct ForkFit
{
  BifurcationFit fit;
  TreePath through;
  std::size_t fork = 0; ///< number in `through`
  TreePath side;
};

/// The least of a measure of a curve's points, in a hundred steps, and the parameter where it is.
template <typename Measure>
std::pair<double, double> MinimumAlong(const BezierCurve& curve, const Measure& measure)
{
  constexpr int pieces = 100;
  std::pair<double, double> best{ std::numeric_limits<double>::infinity(), 0.0 };
  for (int piece = 0; piece <= pieces; ++piece)
  {
    const double t = static_cast<double>(piece) / pieces;
    const double value = measure(BezierPoint(curve, t));
    best = value < best.first ? std::make_pair(value, t) : best;
  }
  return best;
}

/// Sets `turning` off from the straight axis of `parent` and `straight`, if these two are that.
void StraightenFork(VesselTree& tree, std::size_t parent, std::size_t turning, std::size_t straight,
  const PathMeasurement& measurement)
{
  const auto at = [&](std::int64_t point) -> Vector3& { return tree.points[point]; };
  const auto radiusAt = [&](std::int64_t point) -> double& { return tree.radius[point]; };
  const auto after = [&](const std::vector<std::int64_t>& points, std::size_t from, double length)
  {
    std::size_t i = from;
    for (double passed = 0.0; i + 1 < points.size() && passed < length; ++i)
    {
      passed += (at(points[i + 1]) - at(points[i])).norm();
    }
    return i;
  };
  // All from the fork on.
  std::vector<std::int64_t> behind = tree.branches[parent].points;
  std::reverse(behind.begin(), behind.end());
  const std::vector<std::int64_t>& ahead = tree.branches[straight].points;
  const std::vector<std::int64_t>& aside = tree.branches[turning].points;
  const double wide = radiusAt(behind.front());

  // The straight axis is a cubic curve between the parts that the mouth does not reach.
  const double reach = wide + 0.5 * radiusAt(aside[aside.size() / 2]);
  const double chord = 1.5 * wide + 2.0 * measurement.voxel;
  const std::size_t low = after(behind, 0, reach);
  const std::size_t high = after(ahead, 0, reach);
  const std::size_t lowest = after(behind, low, chord);
  const std::size_t highest = after(ahead, high, chord);
  const std::size_t out = after(aside, 0, reach + wide);
  const std::size_t farthest = after(aside, out, chord);
  const Vector3 from = at(behind[low]);
  const Vector3 to = at(ahead[high]);
  const auto isShort = [&](const std::vector<std::int64_t>& points, std::size_t i, std::size_t j)
  { return (at(points[j]) - at(points[i])).norm() < 0.5 * chord; };
  if (isShort(behind, low, lowest) || isShort(ahead, high, highest) ||
    isShort(aside, out, farthest))
  {
    return;
  }
  const Vector3 forwards = (from - at(behind[lowest])).normalized();
  const Vector3 onwards = (at(ahead[highest]) - to).normalized();
  const Vector3 away = (at(aside[farthest]) - at(aside[out])).normalized();
  const double bend = UnitAngle(forwards, onwards);
  if (bend > MostBend || forwards.dot(away) > std::cos(bend + MinimumTurn))
  {
    return;
  }
  const double handle = (to - from).norm() / 3.0;
  const BezierCurve bezier{ from, from + handle * forwards, to - handle * onwards, to };
  const auto axis = [&](double t) { return BezierPoint(bezier, t); };
  const auto distance = [&](const Vector3& point)
  { return MinimumAlong(bezier, [&](const Vector3& p) { return (p - point).norm(); }).first; };
  std::size_t alone = 1;
  while (alone < out &&
    (distance(at(aside[alone])) < 1.15 * wide ||
      tree.confidence[aside[alone]] < measurement.settings.minimumConfidence))
  {
    ++alone;
  }
  const Vector3 origin = at(aside[alone]);
  const double own = radiusAt(aside[alone]);
  const std::size_t end = after(aside, alone, std::max(1.4 * own, 4.0 * measurement.voxel));
  Vector3 direction = (at(aside[end]) - origin).normalized();
  if (own > GreatBranch * wide)
  {
    direction = (direction + GreatBranchBend * forwards).normalized();
  }
  const auto nearest =
    MinimumAlong(bezier, [&](const Vector3& p) { return LineDistance(p, origin, direction); });
  const double meeting = nearest.second;
  if (nearest.first > wide || meeting < 0.02 || meeting > 0.98)
  {
    return;
  }
  const Vector3 fork = axis(meeting);
  const auto place = [&](const std::vector<std::int64_t>& points, std::size_t last,
                       const std::function<Vector3(double)>& curve)
  {
    for (std::size_t i = 0; i < last; ++i)
    {
      at(points[i]) = curve(static_cast<double>(i) / static_cast<double>(last));
      tree.confidence[points[i]] = 0.0;
    }
  };
  place(aside, alone, [&](double t) -> Vector3 { return fork + t * (origin - fork); });
  for (std::size_t i = 1; i < alone; ++i)
  {
    radiusAt(aside[i]) = std::min(radiusAt(aside[i]), own);
  }
  place(behind, low, [&](double t) { return axis(meeting * (1.0 - t)); });
  place(ahead, high, [&](double t) { return axis(meeting + (1.0 - meeting) * t); });
}

ForkFit FitFork(const VesselTree& tree, std::size_t parent, std::size_t turning,
  std::size_t straight, double minimumTurn, const PathMeasurement& measurement)
{
  // As far as the fit looks; the vessel that goes straight on also across its other forks.
  const double wide = tree.radius[tree.branches[parent].points.back()];
  const double reach = 8.0 * wide + 16.0 * measurement.voxel;
  const TreePath before = Upstream(tree, parent, reach);
  const TreePath behind = Downstream(tree, straight, reach);
  ForkFit result;
  result.fork = before.points.size() - 1;
  result.through.points.assign(before.points.rbegin(), before.points.rend());
  result.through.points.insert(
    result.through.points.end(), behind.points.begin() + 1, behind.points.end());
  for (const std::size_t joint : before.joints)
  {
    result.through.joints.push_back(result.fork - joint);
  }
  for (const std::size_t joint : behind.joints)
  {
    result.through.joints.push_back(result.fork + joint);
  }
  result.side.Append(tree, tree.branches[turning].points, reach);

  BifurcationAxes axes;
  axes.fork = result.fork;
  for (const std::int64_t point : result.through.points)
  {
    axes.through.push_back(tree.points[point]);
    axes.throughRadius.push_back(tree.radius[point]);
  }
  for (const std::int64_t point : result.side.points)
  {
    axes.side.push_back(tree.points[point]);
    axes.sideRadius.push_back(tree.radius[point]);
  }
  result.fit = FitBifurcation(*measurement.image, axes, measurement.lumen, minimumTurn);
  return result;
}

/// Puts the axes of a bifurcation where the fit has them; other forks stay where they are along theirs.
void MoveFork(VesselTree& tree, const ForkFit& fork)
{
  const BifurcationFit& fit = fork.fit;
  std::map<std::size_t, double> knots{ { fit.first, 0.0 }, { fork.fork, fit.meeting },
    { fit.last, 1.0 } };
  for (const std::size_t joint : fork.through.joints)
  {
    if (joint > fit.first && joint < fit.last)
    {
      const Vector3& point = tree.points[fork.through.points[joint]];
      knots[joint] =
        MinimumAlong(fit.through, [&](const Vector3& p) { return (p - point).norm(); }).second;
    }
  }
  for (auto knot = knots.begin(); std::next(knot) != knots.end(); ++knot)
  {
    if (std::next(knot)->second <= knot->second)
    {
      return;
    }
  }
  const auto place = [&](const std::vector<std::int64_t>& points, std::size_t from, std::size_t to,
                       const BezierCurve& curve, double start, double end)
  {
    for (std::size_t i = from; i <= to; ++i)
    {
      const double f = static_cast<double>(i - from) / static_cast<double>(to - from);
      tree.points[points[i]] = BezierPoint(curve, start + f * (end - start));
    }
  };
  for (auto knot = knots.begin(); std::next(knot) != knots.end(); ++knot)
  {
    place(fork.through.points, knot->first, std::next(knot)->first, fit.through, knot->second,
      std::next(knot)->second);
  }
  place(fork.side.points, 0, fit.end, fit.side, 0.0, 1.0);
}
}

void StraightenForks(
  VesselTree& tree, const std::vector<std::int32_t>& paths, const PathMeasurement& measurement)
{
  for (const auto& [parent, two] : ForksOfTwo(tree))
  {
    const auto pathOf = [&](std::int64_t p) { return paths[p]; };
    const std::vector<std::int64_t>& before = tree.branches[parent].points;
    const int path = pathOf(before[before.size() - 2]);
    for (std::size_t turning = 0; turning < 2; ++turning)
    {
      // The path that the other one was set on to.
      if (pathOf(tree.branches[two[turning]].points[1]) == path)
      {
        StraightenFork(tree, parent, two[turning], two[1 - turning], measurement);
      }
    }
  }
}

void FitForks(VesselTree& tree, const PathMeasurement& measurement)
{
  for (const auto& [parent, two] : ForksOfTwo(tree))
  {
    // Which one goes straight on is seen by the angles, or else by the wall.
    std::array<ForkFit, 2> fits;
    for (const double minimumTurn : { MinimumTurn, -2.0 * MinimumTurn })
    {
      for (std::size_t turning = 0; turning < 2; ++turning)
      {
        fits[turning] =
          FitFork(tree, parent, two[turning], two[1 - turning], minimumTurn, measurement);
      }
      if (fits[0].fit.found || fits[1].fit.found)
      {
        break;
      }
    }
    // Two that are as good as one another tell nothing.
    for (std::size_t turning = 0; turning < 2; ++turning)
    {
      const BifurcationFit& own = fits[turning].fit;
      const BifurcationFit& other = fits[1 - turning].fit;
      if (own.found && (!other.found || own.misfit < 0.9 * other.misfit))
      {
        MoveFork(tree, fits[turning]);
      }
    }
  }
}
}
