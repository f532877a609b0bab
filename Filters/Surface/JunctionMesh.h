/**
 * @file JunctionMesh.h
 * @brief A first triangulation of a junction's wall, cut where its arms become plain tubes.
 */
#ifndef DynamicCoronary_JunctionMesh_h
#define DynamicCoronary_JunctionMesh_h

#include "SweptLumen.h"

namespace coronary
{
struct JunctionMesh
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;              ///< oriented outwards
  std::vector<std::vector<std::int64_t>> loops; ///< for each arm, around its tangent
};

/**
 * Marching tetrahedra on a local grid, refined until the result is a sphere with one hole an arm.
 * @throws std::runtime_error naming the place when no grid gives that
 */
JunctionMesh MeshJunction(const SweptLumen& lumen, int junction);
}

#endif
