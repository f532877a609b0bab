#include "LesionCrossings.h"

#include <algorithm>
#include <cstddef>

namespace coronary
{
namespace
{
constexpr double MinimumUnseen = 1.5; ///< mm of a way across a lesion that are a passage

/// Mm to a way across a lesion that are on it.
double Reach(const PathMeasurement& measurement)
{
  return 2.0 * measurement.voxel + 0.5 * measurement.step;
}

bool IsOn(const VesselBridge& bridge, const Vector3& place, double reach)
{
  return std::any_of(bridge.points.begin(), bridge.points.end(),
    [&](const Vector3& p) { return (p - place).squaredNorm() <= reach * reach; });
}
}

void MarkCrossings(
  MeasuredPath& path, const std::vector<VesselBridge>& bridges, const PathMeasurement& measurement)
{
  path.crossing.assign(path.size(), 0);
  const double reach = Reach(measurement);
  for (const VesselBridge& bridge : bridges)
  {
    for (std::size_t i = 0; i < path.size(); ++i)
    {
      path.crossing[i] = path.crossing[i] != 0 || IsOn(bridge, path.points[i], reach);
    }
  }
}

void MarkBridged(
  VesselTree& tree, const std::vector<VesselBridge>& bridges, const PathMeasurement& measurement)
{
  tree.bridged.assign(tree.points.size(), 0);
  tree.bridgeConfidence.assign(tree.points.size(), 1.0);
  if (bridges.empty())
  {
    return;
  }
  const double reach = Reach(measurement);
  for (const VesselTree::Branch& branch : tree.branches)
  {
    double certain = branch.parentGroupId < 0 ? 1.0 : tree.bridgeConfidence[branch.points[0]];
    std::vector<char> passed(bridges.size(), 0);
    std::vector<double> unseen(bridges.size(), 0.0); // mm along each
    for (std::size_t i = branch.parentGroupId < 0 ? 0 : 1; i < branch.points.size(); ++i)
    {
      const auto p = static_cast<std::size_t>(branch.points[i]);
      for (std::size_t b = 0; b < bridges.size(); ++b)
      {
        const VesselBridge& bridge = bridges[b];
        const bool here = IsOn(bridge, tree.points[p], reach);
        if (!here)
        {
          continue;
        }
        if (tree.confidence[p] < measurement.settings.minimumConfidence)
        {
          tree.bridged[p] = 1;
          unseen[b] += measurement.step;
        }
        // The middle of the way, and more than a moment of it unseen, are what a branch that only begins at one of its
        // ends does not pass.
        const Vector3& middle = bridge.points[bridge.points.size() / 2];
        if (passed[b] == 0 &&
          (unseen[b] >= MinimumUnseen || (middle - tree.points[p]).squaredNorm() <= reach * reach))
        {
          passed[b] = 1;
          certain *= bridge.confidence;
        }
      }
      tree.bridgeConfidence[p] = certain;
    }
  }
}
}
