/**
 * @file TriangleTree.h
 * @brief Boxes around triangles in a tree: nearest point of a surface, triangles near a place.
 */
#ifndef DynamicCoronary_TriangleTree_h
#define DynamicCoronary_TriangleTree_h

#include "Geometry.h"

#include <functional>
#include <vector>

namespace coronary
{
/// The point of a triangle that is nearest to p; the triangle may be a line or a point.
/// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.5.
Vector3 ClosestPointOfTriangle(
  const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/// Keeps references to what it is made of. Queries may run on several threads.
class TriangleTree
{
public:
  /// Triangles may be degenerate: a segment is (a, b, b).
  TriangleTree(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);

  struct Nearest
  {
    std::int64_t triangle = -1; ///< -1 when there is none; the lowest of several at one distance
    Vector3 point = Vector3::Zero();
    double distance = 0.0;
  };
  Nearest Closest(const Vector3& p) const;

  /// Calls visit for each triangle whose box meets the box from low to high.
  void Visit(const Vector3& low, const Vector3& high,
    const std::function<void(std::int64_t triangle)>& visit) const;

  /**
   * How often the closed surface winds around p, by the triangles above it: 1 inside, 0 outside a
   * surface whose triangles look outwards. Neighbouring triangles decide alike about a common edge.
   */
  int Winding(const Vector3& p) const;

private:
  struct Node
  {
    Vector3 low;
    Vector3 high;
    std::int64_t first; ///< a leaf's first entry in Order, or the left child
    std::int64_t count; ///< a leaf's triangles; 0 at an inner node
    std::int64_t right;
  };
  std::int64_t Build(std::int64_t first, std::int64_t last);

  const std::vector<Vector3>& Points;
  const std::vector<Triangle>& Triangles;
  std::vector<std::int64_t> Order;
  std::vector<Vector3> Centres;
  std::vector<Node> Nodes;
};
}

#endif
