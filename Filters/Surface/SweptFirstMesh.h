/**
 * @file SweptFirstMesh.h
 * @brief A first triangulation of a swept tree, closed but not yet of the wanted sizes.
 */
#ifndef DynamicCoronary_SweptFirstMesh_h
#define DynamicCoronary_SweptFirstMesh_h

#include "AdaptiveRemesher.h"
#include "JunctionMesh.h"
#include "SweptLumen.h"

namespace coronary
{
/// Junctions that no grid resolves.
struct Unresolved
{
  std::vector<JunctionFailure> places;
};

/// Triangles with what the remesher must know of their corners.
struct SweptFirstMesh
{
  std::vector<RemeshVertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<int> entity; ///< per triangle: 1 wall, 2.. caps
};

/// h of Eq. 4 with its caps, mm. @param curvature  of the wall, 1/mm @param radius  of the vessel, mm
double SweptEdgeLength(const SweepSettings& settings, double curvature, double radius);

/**
 * Rings along the spans, junctions between, caps at the ends.
 *
 * @param capEntity  of each tip
 * @param reliefs    where the tree is not as it was given: junctions there are tried first
 * @throws Unresolved; Cancelled
 */
SweptFirstMesh MakeFirstMesh(const SweptLumen& lumen, const SweepSettings& settings,
  const std::vector<int>& capEntity, const std::vector<SweepRelief>& reliefs,
  const ProgressCallback& progress);
}

#endif
