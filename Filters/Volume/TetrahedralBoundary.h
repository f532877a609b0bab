/**
 * @file TetrahedralBoundary.h
 * @brief The boundary of tetrahedra.
 */
#ifndef DynamicCoronary_TetrahedralBoundary_h
#define DynamicCoronary_TetrahedralBoundary_h

#include "TetrahedronQuality.h"

#include <utility>
#include <vector>

namespace coronary
{
/// Faces of one tetrahedron only, looking outwards, with that tetrahedron; one beside the other, from that of the
/// first tetrahedron on. Positions do not count: a mesh that moves keeps its boundary.
std::vector<std::pair<Triangle, std::int64_t>> BoundaryFaces(
  const std::vector<Tetrahedron>& tetrahedra);
}

#endif
