/**
 * @file SurfaceCheck.h
 * @brief Whether a triangle surface encloses a volume, and if not, where and why.
 */
#ifndef DynamicCoronary_SurfaceCheck_h
#define DynamicCoronary_SurfaceCheck_h

#include "Geometry.h"

#include <stdexcept>
#include <string>
#include <vector>

namespace coronary
{
/// A surface that can not be meshed. The message has the first cells and where they are.
struct SurfaceError : std::invalid_argument
{
  SurfaceError(const std::string& message, std::vector<std::int64_t> cellIds)
    : std::invalid_argument(message)
    , cells(std::move(cellIds))
  {
  }
  std::vector<std::int64_t> cells; ///< triangles of the input, all that are concerned
};

/// One or more closed 2-manifolds, oriented outwards.
struct ClosedSurface
{
  std::vector<Vector3> points;           ///< mm; used ones only, equal ones merged
  std::vector<std::int64_t> sourcePoint; ///< per point: the lowest input point there
  std::vector<Triangle> triangles;       ///< as many and in the same order as in the input
  std::vector<int> component;            ///< per triangle
  std::vector<double> volume;            ///< per component, mm^3, positive
  std::vector<std::string> warnings;     ///< what was put right
};

/// @throws std::invalid_argument for a point that does not exist or a coordinate that is not finite
void CheckCorners(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);

/**
 * Merges points at the very same place, turns triangles over where neighbours disagree and
 * components that are inside-out.
 *
 * @throws SurfaceError for a surface that is empty, has boundary edges, edges of more than two
 *         triangles, doubled triangles, triangles without area, or a component without volume;
 *         std::invalid_argument for a point that does not exist or a coordinate that is not finite
 */
ClosedSurface CheckSurface(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);

/// @throws SurfaceError where triangles cut each other
void CheckSelfIntersections(const ClosedSurface& surface);

/// "cells 4, 9 and 12 more at (1.5, 2, -3)"; `at` is the first one's centre.
std::string DescribeCells(std::vector<std::int64_t> cells, const Vector3& at);

/// "(1.5, 2, -3)"
std::string Describe(const Vector3& position);
}

#endif
