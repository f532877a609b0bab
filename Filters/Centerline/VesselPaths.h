/**
 * @file VesselPaths.h
 * @brief A tree of branches as vessels: what runs on through its bifurcations is one path.
 */
#ifndef DynamicCoronary_VesselPaths_h
#define DynamicCoronary_VesselPaths_h

#include "VesselTree.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace coronary
{
/// One vessel from its origin to its tip.
struct VesselPath
{
  std::vector<std::int64_t> points; ///< of the tree; the first is the parent's where there is one
  std::vector<double> arc;          ///< mm from the first point
  std::vector<std::size_t> forks;   ///< places in `points` where other vessels leave
  int parent = -1; ///< index of the path that it leaves, which stands before it; -1: a root

  /// Place of the first point that is no point of the parent's.
  std::size_t FirstOwn() const { return this->parent < 0 ? 0 : 1; }

  /// Mean distance of points, mm.
  double Step() const
  {
    return std::max(1e-6, this->arc.back() / static_cast<double>(this->points.size() - 1));
  }
};

/**
 * Every branch in one path. Of the branches that follow another the one with the same name carries the vessel on (the
 * left main into the LAD), or else the wide and straight one.
 * @throws std::invalid_argument as CheckTree
 */
std::vector<VesselPath> VesselPaths(const VesselTree& tree);

/// Unit tangents of a path, by chords over `reach` mm to either side.
std::vector<Vector3> PathTangents(const VesselTree& tree, const VesselPath& path, double reach);
}

#endif
