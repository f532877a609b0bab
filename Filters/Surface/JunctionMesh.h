/**
 * @file JunctionMesh.h
 * @brief A first triangulation of a junction's wall, cut where its arms become plain tubes.
 */
#ifndef DynamicCoronary_JunctionMesh_h
#define DynamicCoronary_JunctionMesh_h

#include "SweptLumen.h"

#include <stdexcept>

namespace coronary
{
/// No grid resolves a junction's wall.
class JunctionFailure : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
  Vector3 centre = Vector3::Zero();
  double reach = 0.0;            ///< all of the junction is so near, mm
  std::vector<int> groups;       ///< of its arms
  std::int64_t thinnestEnd = -1; ///< of the branches that end after it, as a point of the input
};

struct JunctionMesh
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;              ///< oriented outwards
  std::vector<std::vector<std::int64_t>> loops; ///< for each arm, around its tangent
};

/**
 * Marching tetrahedra on a local grid, refined until the result is a sphere with one hole an arm.
 * @throws JunctionFailure naming the place when no grid gives that
 */
JunctionMesh MeshJunction(const SweptLumen& lumen, int junction);
}

#endif
