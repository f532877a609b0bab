/**
 * @file SurfaceMeasures.h
 * @brief What tests and validation want to know of a triangle mesh.
 */
#ifndef DynamicCoronary_SurfaceMeasures_h
#define DynamicCoronary_SurfaceMeasures_h

#include "Geometry.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace coronary
{
struct SurfaceMeasures
{
  std::size_t triangles = 0;
  std::size_t points = 0;
  std::size_t openEdges = 0;            ///< with one triangle
  std::size_t badEdges = 0;             ///< with more than two, or two of opposite orientation
  std::size_t badPoints = 0;            ///< whose triangles are not one fan
  std::size_t unusedPoints = 0;         ///< of no triangle
  int components = 0;                   ///< joined by edges
  std::int64_t eulerCharacteristic = 0; ///< 2 for each closed component of genus 0
  double volume = 0.0;                  ///< mm^3, positive when oriented outwards
  double area = 0.0;                    ///< mm^2
  std::vector<double> minimumAngle;     ///< of each triangle, degrees

  bool Closed() const { return this->openEdges == 0 && this->badEdges == 0; }
  bool Manifold() const { return this->badEdges == 0 && this->badPoints == 0; }
  double WorstAngle() const;
  /// Share of the triangles with an angle below `degrees`.
  double ShareBelow(double degrees) const;
};

SurfaceMeasures MeasureSurface(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);

/// Length over wanted length of every edge; wanted is the mean of the values at its ends.
std::vector<double> RelativeEdgeLengths(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, const std::vector<double>& wanted);
}

#endif
