/**
 * @file MeshQuality.h
 * @brief Size and shape of all elements of a mesh: what a simulation asks of it at every moment.
 */
#ifndef DynamicCoronary_MeshQuality_h
#define DynamicCoronary_MeshQuality_h

#include "ParallelFor.h"
#include "TetrahedronQuality.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// Below this least dihedral angle a tetrahedron is called poor: 15 degrees, in radians.
constexpr double PoorDihedralAngle = 0.26179938779914943654;

struct TetrahedraQuality
{
  std::vector<std::int64_t> inverted; ///< tetrahedra of volume 0 or less, ascending
  std::int64_t poor = 0;              ///< with a dihedral angle below the limit; inverted ones too
  double minimumVolume = 0.0;         ///< mm^3, negative when inverted
  std::int64_t minimumVolumeAt = -1;  ///< the tetrahedron; -1: there are none
  double totalVolume = 0.0;           ///< mm^3; what is inverted counts as negative
  double minimumDihedralAngle = 0.0;  ///< radians, 0 when inverted
  std::int64_t minimumDihedralAngleAt = -1;
  double maximumRadiusEdgeRatio = 0.0; ///< infinite when one is flat
  std::int64_t maximumRadiusEdgeRatioAt = -1;

  std::vector<double> volume;          ///< per tetrahedron, mm^3
  std::vector<double> minimumDihedral; ///< per tetrahedron, radians
  std::vector<double> radiusEdgeRatio; ///< per tetrahedron
};

struct TrianglesQuality
{
  std::vector<std::int64_t> degenerate; ///< triangles without area, ascending
  double area = 0.0;                    ///< of all, mm^2
  double enclosedVolume = 0.0;      ///< mm^3, of a closed surface; negative when it looks inwards
  double minimumAngle = 0.0;        ///< radians, 0 when degenerate
  std::int64_t minimumAngleAt = -1; ///< the triangle; -1: there are none
};

/**
 * @param points     mm
 * @param poorAngle  radians
 * @throws std::invalid_argument: an index out of range, a position that is not finite; Cancelled
 */
TetrahedraQuality MeasureTetrahedra(const std::vector<Vector3>& points,
  const std::vector<Tetrahedron>& tetrahedra, double poorAngle = PoorDihedralAngle,
  const ProgressCallback& progress = {});

/// @throws as MeasureTetrahedra
TrianglesQuality MeasureTriangles(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);
}

#endif
