/**
 * @file FlowTestTubes.h
 * @brief A straight tube and a fork with caps, as the sweep makes them, for tests of meshes for flow.
 */
#ifndef DynamicCoronary_FlowTestTubes_h
#define DynamicCoronary_FlowTestTubes_h

#include "LayeredMesh.h"
#include "SweepSurface.h"

#include <cmath>

inline coronary::CappedSurface Swept(const coronary::VesselTree& tree, double edge)
{
  coronary::SweepSettings sweep;
  sweep.edgeLengthPerRadius = edge;
  sweep.minimumEdgeLength = 0.01;
  sweep.maximumEdgeLength = 10.0;
  sweep.curvatureWeight = 0.0;
  const coronary::SweptSurface surface = coronary::SweepVesselTree(tree, sweep);
  return { surface.points, surface.triangles, surface.entityId };
}

/// From the origin along z.
inline coronary::CappedSurface FlowTube(double radius, double length, double edge)
{
  coronary::VesselTree tree;
  coronary::VesselTree::Branch branch;
  for (int k = 0; k <= 20; ++k)
  {
    tree.points.emplace_back(0.0, 0.0, length * k / 20.0);
    tree.radius.push_back(radius);
    branch.points.push_back(k);
  }
  tree.branches.push_back(branch);
  return Swept(tree, edge);
}

/// A vessel along z that forks into two of 35 degrees to either side.
inline coronary::CappedSurface FlowFork(double edge)
{
  coronary::VesselTree tree;
  for (int b = 0; b < 3; ++b)
  {
    coronary::VesselTree::Branch branch;
    branch.groupId = b;
    branch.parentGroupId = b == 0 ? -1 : 0;
    const double side = b == 0 ? 0.0 : b == 1 ? 0.6 : -0.6;
    for (int k = 0; k <= 20; ++k)
    {
      if (b > 0 && k == 0)
      {
        branch.points.push_back(20);
        continue;
      }
      branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
      const double s = 12.0 * k / 20.0;
      tree.points.emplace_back(b == 0
          ? coronary::Vector3(0.0, 0.0, s)
          : coronary::Vector3(s * std::sin(side), 0.0, 12.0 + s * std::cos(side)));
      tree.radius.push_back(b == 0 ? 1.8 : b == 1 ? 1.5 : 1.2);
    }
    tree.branches.push_back(branch);
  }
  return Swept(tree, edge);
}

#endif
