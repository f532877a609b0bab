/**
 * @file PhantomSurface.h
 * @brief A closed triangle mesh of a PhantomLumen.
 */
#ifndef DynamicCoronary_PhantomSurface_h
#define DynamicCoronary_PhantomSurface_h

#include "PhantomLumen.h"

namespace coronary
{
/// No lumen is meshed that is narrower, mm: such a mesh is drawn to the true wall afterwards.
constexpr double MinimumMeshedRadius = 0.2;

/**
 * Dual marching cubes on a sparse grid (one vertex for each sheet of the surface in a cell), then
 * tangential smoothing and projection onto the lumen's wall. The mesh is closed, oriented and
 * 2-manifold: that is checked, and the grid shifted and the work repeated if it is not.
 * Source of the dual cell structure: Nielson, "Dual marching cubes", IEEE Visualization 2004.
 *
 * @param edgeLength  of the grid, mm; made smaller where the thinnest vessel needs it
 * @throws std::runtime_error when no shift of the grid gives a manifold; Cancelled
 */
PhantomSurface MeshLumen(const PhantomAnatomy& anatomy, const PhantomLumen& lumen,
  double edgeLength, const ProgressCallback& progress);
}

#endif
