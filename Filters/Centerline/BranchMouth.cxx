#include "BranchMouth.h"

#include "CurveSmoothing.h"
#include "Median.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace coronary
{
namespace
{
/// Centres of a branch that leaves its parent's lumen, found by the part of its wall that is not the parent's.
/// @param good     sample of the path that stands alone
/// @param outside  distance from the parent's axis in its radii
/// @returns the centres before `good`, nearest to the parent first
std::vector<Vector3> FollowOuterWall(const MeasuredPath& path, std::size_t good,
  const std::function<double(const Vector3&)>& outside, const PathMeasurement& measurement)
{
  const auto after = [&](double length)
  { return std::min(path.size() - 1, good + static_cast<std::size_t>(length / measurement.step)); };
  std::vector<double> radii;
  std::vector<double> values;
  for (std::size_t i = good; i <= after(3.0 * path.radius[good]); ++i)
  {
    if (path.confidence[i] >= measurement.settings.minimumConfidence)
    {
      radii.push_back(path.radius[i]);
      values.push_back(path.lumen[i]);
    }
  }
  if (radii.size() < 3)
  {
    return {};
  }
  const double radius = MedianOf(std::move(radii));
  const double lumen = MedianOf(std::move(values));
  const auto isOwn = [&](const Vector3& wall) { return outside(wall) > 1.1; };

  // The centre nearest to the parent last.
  std::vector<Vector3> centres;
  for (std::size_t i = after(1.5 * radius) + 1; i-- > good;)
  {
    centres.push_back(path.points[i]);
  }
  const std::size_t known = centres.size();
  const auto chord =
    std::max<std::size_t>(2, static_cast<std::size_t>(1.5 * radius / measurement.step));
  while (centres.size() < known + 200)
  {
    const Vector3& last = centres.back();
    const Vector3 back =
      (last - centres[centres.size() - 1 - std::min(chord, centres.size() - 1)]).normalized();
    const Vector3 next = last + measurement.step * back;
    Vector3 centre;
    if (!back.allFinite() || outside(next) < 0.25 || outside(next) >= outside(last) ||
      !MeasureArc(
        *measurement.image, next, back, radius, lumen, isOwn, measurement.lumen, centre) ||
      (centre - next).norm() > 0.15 * radius)
    {
      break;
    }
    centres.push_back(centre);
  }
  return { centres.rbegin(), centres.rend() - static_cast<std::ptrdiff_t>(known) };
}
}

std::size_t JoinParent(MeasuredPath& path, const VesselTree& tree,
  const std::vector<std::int64_t>& chain, std::int32_t owner, const PathMeasurement& measurement)
{
  const auto meeting = std::find(chain.begin(), chain.end(), owner) - chain.begin();
  const double parentRadius = tree.radius[owner];
  const auto window = static_cast<std::ptrdiff_t>(
    std::ceil((3.5 * parentRadius + 3.0 * measurement.voxel) / measurement.step));
  const auto low = std::max<std::ptrdiff_t>(0, meeting - window);
  const auto high =
    std::min<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(chain.size()) - 1, meeting + window);

  const auto outside = [&](const Vector3& point)
  {
    // In units of the parent's radius.
    double minimum = std::numeric_limits<double>::infinity();
    for (std::ptrdiff_t i = low; i <= high; ++i)
    {
      const auto p = static_cast<std::size_t>(chain[i]);
      minimum = std::min(minimum, (point - tree.points[p]).norm() / tree.radius[p]);
    }
    return minimum;
  };

  // The first part that is clearly a vessel of its own.
  std::size_t first = 0;
  while (first + 1 < path.size() && outside(path.points[first]) < 1.15)
  {
    ++first;
  }
  std::size_t good = first;
  while (good < path.size() && path.confidence[good] < measurement.settings.minimumConfidence)
  {
    ++good;
  }
  if (good >= path.size())
  {
    good = std::min(first, path.size() - 1);
  }
  // A great branch stands alone far from the axis only: from there back into the parent's lumen, as
  // far as its outer wall is to be seen. Not in masks and surfaces: there an axis is that of
  // inscribed spheres, and a lumen that widens before it divides has no circle.
  const bool great =
    std::isnan(measurement.lumen.level) && path.radius[good] > GreatBranch * parentRadius;
  const std::vector<Vector3> arcs =
    great ? FollowOuterWall(path, good, outside, measurement) : std::vector<Vector3>();
  std::vector<Vector3> samples = arcs;
  // Over a short chord: a branch may turn within two radii of its mouth.
  const double length =
    std::max((arcs.empty() ? 1.4 : 1.0) * path.radius[good], 4.0 * measurement.voxel);
  for (std::size_t i = good; i < path.size() && samples.size() * measurement.step <= length; ++i)
  {
    if (path.confidence[i] >= measurement.settings.minimumConfidence || i == good)
    {
      samples.push_back(path.points[i]);
    }
  }
  samples.resize(std::min(
    samples.size(), std::max<std::size_t>(4, static_cast<std::size_t>(length / measurement.step))));
  auto best = static_cast<std::size_t>(owner);
  double minimum = std::numeric_limits<double>::infinity();
  if (samples.size() >= 3)
  {
    Vector3 direction = (samples.back() - samples.front()).normalized();
    if (great)
    {
      // A great branch leaves in the direction of the flow and bends away, inside the lumen too.
      const auto at = [&](std::ptrdiff_t i) -> const Vector3&
      {
        const std::int64_t p = chain[i];
        return tree.points[p];
      };
      direction = (direction + GreatBranchBend * (at(high) - at(low)).normalized()).normalized();
    }
    for (std::ptrdiff_t i = low; i <= high; ++i)
    {
      const auto p = static_cast<std::size_t>(chain[i]);
      // Behind the daughter's beginning, and not far away.
      const double along = (tree.points[p] - samples.front()).dot(direction);
      const double distance = LineDistance(tree.points[p], samples.front(), direction) +
        (along > 0.0 ? 2.0 * along : 0.0) - 0.02 * along;
      if (distance < minimum)
      {
        minimum = distance;
        best = p;
      }
    }
  }
  if (minimum > 1.2 * parentRadius + measurement.voxel)
  {
    minimum = std::numeric_limits<double>::infinity();
    for (std::ptrdiff_t i = low; i <= high; ++i)
    {
      const auto p = static_cast<std::size_t>(chain[i]);
      const double distance = (tree.points[p] - path.points[good]).norm();
      if (distance < minimum)
      {
        minimum = distance;
        best = p;
      }
    }
  }

  // A straight line from axis to axis; its samples are guesses.
  std::vector<Vector3> start = ResampleCurve(
    { tree.points[best], arcs.empty() ? path.points[good] : arcs.front() }, measurement.step);
  start.pop_back();
  const std::size_t straight = start.size();
  start.insert(start.end(), arcs.begin(), arcs.end());
  const double seen = 0.5 * path.confidence[good];
  path.ReplaceStart(good, start);
  std::fill_n(path.confidence.begin() + static_cast<std::ptrdiff_t>(straight), arcs.size(), seen);
  return best;
}
}
