// Better shapes for the thin triangles of a surface that is cleaned. Inside the library only.
#ifndef DynamicCoronary_ThinTriangles_h
#define DynamicCoronary_ThinTriangles_h

#include "SurfaceCells.h"
#include "SurfaceCleaning.h"

namespace coronary
{
/// Triangles below the minimum angle, before.
struct ThinTriangles
{
  std::int64_t count = 0;
  Vector3 worst = Vector3::Zero(); ///< where the one with the least angle is
};

/**
 * Collapses and swaps edges and moves points in the tangent plane. Open edges and the rims of caps stay.
 * @param minimumAngle  radians
 * @param counts        collapses, swaps and moves are added
 */
ThinTriangles ImproveThinTriangles(
  SurfaceCells& surface, double minimumAngle, SurfaceCleaningCounts& counts);
}

#endif
