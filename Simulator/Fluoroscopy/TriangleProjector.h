/**
 * @file TriangleProjector.h
 * @brief Exact line integrals through a closed surface of one material: the reference for the fast ones.
 */
#ifndef DynamicCoronary_TriangleProjector_h
#define DynamicCoronary_TriangleProjector_h

#include "CArm.h"
#include "LineIntegrals.h"

#include <vector>

namespace coronary
{
/**
 * Adds attenuation times the way through the surface: the sum over all faces that the ray through a pixel's centre
 * meets, leaving minus entering, of the distance from a plane near the surface, in double precision.
 * A ray through an edge or a corner is taken as if moved by an infinitely small amount, the same for all faces; so
 * it meets as many faces on its way in as on its way out.
 * Source: Vidal et al., "Simulation of X-ray attenuation on the GPU", TPCG 2009 (the "L-buffer").
 *
 * Faces may be turned outwards or inwards, all the same way; parts that overlap count several times.
 * @throws std::invalid_argument when the surface is not closed and consistently oriented (each edge once in
 *   each direction), is not wholly in front of the source, an index is out of range or a value not finite, or the image is not of
 *   the geometry's format
 */
void AddSurface(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles,
  double attenuation, const CArmGeometry& geometry, LineIntegrals& image);
}

#endif
