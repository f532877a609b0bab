/**
 * @file TriangleBvh.h
 * @brief The nearest point of a surface, and how often the surface winds around a point.
 *
 * A BoxTree with its boxes, in single precision, rounded outwards, and the triangles of its leaves side by side, in double
 * precision, so that four of them are looked at at once.
 */
#ifndef DynamicCoronary_TriangleBvh_h
#define DynamicCoronary_TriangleBvh_h

#include "BoxTree.h"
#include "NearestOnTriangle.h"

#include <functional>

namespace coronary
{
struct BvhLeaf;

/// What a triangle above p adds to how often a closed surface winds around p. Neighbouring triangles
/// decide alike about a common edge.
int WindingAbove(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/// Copies what it is made of. Queries may run on several threads.
class TriangleBvh
{
public:
  /// Of no triangles.
  TriangleBvh();

  /// @throws as BoxTree
  TriangleBvh(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);
  TriangleBvh(const TriangleBvh& other);
  TriangleBvh(TriangleBvh&& other) noexcept;
  TriangleBvh& operator=(const TriangleBvh& other);
  TriangleBvh& operator=(TriangleBvh&& other) noexcept;
  ~TriangleBvh();

  std::int64_t NumberOfTriangles() const { return static_cast<std::int64_t>(this->Corners.size()); }

  struct Nearest
  {
    std::int64_t triangle = -1; ///< -1 when there is none within the bound
    Vector3 point = Vector3::Zero();
    double distance = std::numeric_limits<double>::infinity();
    TriangleFeature feature = TriangleFeature::Face;
  };

  /**
   * The nearest triangle, and of several at one distance (up to rounding) always the same.
   * @param bound  only what is this near counts
   * @param hint   a triangle that may be near, for example the nearest one of a neighbour or of the
   *               last time: makes it faster, never another result; -1: none
   * @return triangle -1 if p is not finite or beyond 1e18, too
   */
  Nearest Closest(const Vector3& p, double bound = std::numeric_limits<double>::infinity(),
    std::int64_t hint = -1) const;

  /// The nearest point of one of the triangles. A corner is a point of the surface to the last bit.
  TrianglePoint NearestOn(std::int64_t triangle, const Vector3& p) const
  {
    const std::array<std::int32_t, 3>& corners = this->Corners[triangle];
    TrianglePoint on = NearestOnTriangle(
      p, this->Points[corners[0]], this->Points[corners[1]], this->Points[corners[2]]);
    if (on.feature >= TriangleFeature::A)
    {
      on.point =
        this->Points[corners[static_cast<int>(on.feature) - static_cast<int>(TriangleFeature::A)]];
      on.squaredDistance = (p - on.point).squaredNorm();
    }
    return on;
  }

  /**
   * How often the closed surface winds around p, by the triangles above it: 1 inside, 0 outside a
   * surface whose triangles look outwards. Neighbouring triangles decide alike about a common edge.
   */
  int Winding(const Vector3& p) const;

  /// Calls visit for each triangle whose box meets the box from low to high.
  void Visit(const Vector3& low, const Vector3& high,
    const std::function<void(std::int64_t triangle)>& visit) const;

  /// The triangles in the order of the leaves: neighbours in space are mostly neighbours in it.
  const std::vector<std::int32_t>& Order() const { return this->Boxes.Order(); }

private:
  template <typename Function>
  void MeetBoxes(const Vector3& low, const Vector3& high, const Function& visit) const;

  std::vector<Vector3> Points;
  std::vector<std::array<std::int32_t, 3>> Corners;
  BoxTree Boxes;
  std::vector<BoxNode> Nodes;
  std::vector<BvhLeaf> Leaves;
};
}

#endif
