#include "VesselPaths.h"

#include "CoronaryAnatomy.h"
#include "TreeLinks.h"

#include <algorithm>

namespace coronary
{
namespace
{
/// What is one vessel in several segments; 0: no name.
int FamilyOf(int segment)
{
  switch (segment)
  {
    case LeftMain:
    case ProximalLAD:
    case MidLAD:
    case DistalLAD:
      return LeftMain;
    case ProximalLCx:
    case DistalLCx:
      return ProximalLCx;
    case ProximalRCA:
    case MidRCA:
    case DistalRCA:
      return ProximalRCA;
    default:
      return segment;
  }
}

/// Mean radius and direction of the part of a branch between two distances from one of its ends, mm.
struct BranchEnd
{
  double radius = 0.0;
  Vector3 direction = Vector3::Zero();
};

BranchEnd EndOf(const VesselTree& tree, const VesselTree::Branch& branch, bool atEnd)
{
  constexpr double near = 2.0;
  constexpr double far = 8.0;
  const std::size_t count = branch.points.size();
  const auto at = [&](std::size_t i) { return branch.points[atEnd ? count - 1 - i : i]; };
  BranchEnd end;
  double arc = 0.0;
  double weight = 0.0;
  Vector3 from = tree.points[at(0)];
  Vector3 to = from;
  for (std::size_t i = 1; i < count && arc < far; ++i)
  {
    const double step = (tree.points[at(i)] - tree.points[at(i - 1)]).norm();
    arc += step;
    if (arc <= near)
    {
      from = tree.points[at(i)];
    }
    to = tree.points[at(i)];
    if (arc > near || i + 1 == count)
    {
      end.radius += std::max(step, 1e-9) * tree.radius[at(i)];
      weight += std::max(step, 1e-9);
    }
  }
  if ((to - from).norm() <= 0.0)
  {
    from = tree.points[at(0)];
  }
  end.radius = weight > 0.0 ? end.radius / weight : tree.radius[at(0)];
  end.direction = (atEnd ? from - to : to - from).normalized();
  return end;
}
}

std::vector<VesselPath> VesselPaths(const VesselTree& given)
{
  const VesselTree tree = SplitAtBifurcations(given);
  const TreeLinks links(tree);
  std::vector<std::size_t> origins;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    if (links.IsRoot(b))
    {
      origins.push_back(b);
    }
  }
  std::vector<VesselPath> paths;
  std::vector<int> parents(origins.size(), -1);
  for (std::size_t next = 0; next < origins.size(); ++next)
  {
    VesselPath path;
    path.parent = parents[next];
    std::size_t branch = origins[next];
    path.points.push_back(tree.branches[branch].points.front());
    path.arc.push_back(0.0);
    for (;;)
    {
      const std::vector<std::int64_t>& points = tree.branches[branch].points;
      for (std::size_t i = 1; i < points.size(); ++i)
      {
        path.arc.push_back(
          path.arc.back() + (tree.points[points[i]] - tree.points[points[i - 1]]).norm());
        path.points.push_back(points[i]);
      }
      const std::vector<std::size_t>& daughters = links.daughters[branch];
      if (daughters.empty())
      {
        break;
      }
      const int family = FamilyOf(tree.branches[branch].segmentId);
      const BranchEnd before = EndOf(tree, tree.branches[branch], true);
      std::size_t best = daughters.front();
      double bestScore = -1.0;
      for (const std::size_t daughter : daughters)
      {
        const BranchEnd after = EndOf(tree, tree.branches[daughter], false);
        double score = after.radius * (1.0 + 0.5 * before.direction.dot(after.direction));
        if (family != 0 && FamilyOf(tree.branches[daughter].segmentId) == family)
        {
          score += 1e6;
        }
        if (score > bestScore)
        {
          bestScore = score;
          best = daughter;
        }
      }
      if (daughters.size() > 1)
      {
        path.forks.push_back(path.points.size() - 1);
      }
      for (const std::size_t daughter : daughters)
      {
        if (daughter != best)
        {
          origins.push_back(daughter);
          parents.push_back(static_cast<int>(paths.size()));
        }
      }
      branch = best;
    }
    paths.push_back(std::move(path));
  }
  return paths;
}

std::vector<Vector3> PathTangents(const VesselTree& tree, const VesselPath& path, double reach)
{
  const std::size_t count = path.points.size();
  std::vector<Vector3> tangents(count, Vector3::UnitZ());
  for (std::size_t i = 0; i < count; ++i)
  {
    std::size_t low = i;
    std::size_t high = i;
    while (low > 0 && path.arc[i] - path.arc[low] < reach)
    {
      --low;
    }
    while (high + 1 < count && path.arc[high] - path.arc[i] < reach)
    {
      ++high;
    }
    const Vector3 chord = tree.points[path.points[high]] - tree.points[path.points[low]];
    if (chord.norm() > 0.0)
    {
      tangents[i] = chord.normalized();
    }
  }
  return tangents;
}
}
