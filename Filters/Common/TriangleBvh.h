/**
 * @file TriangleBvh.h
 * @brief Boxes around triangles in a wide, flat tree: the nearest point of a surface, and again after
 * the surface has moved.
 *
 * Eight children a node, whose boxes are tested at once, and four triangles a leaf. Built by splitting
 * at the median of the longest axis; a refit keeps the tree and moves its boxes. Boxes are single
 * precision, rounded outwards; triangles are double precision.
 */
#ifndef DynamicCoronary_TriangleBvh_h
#define DynamicCoronary_TriangleBvh_h

#include "Geometry.h"

#include <cstdint>
#include <limits>
#include <vector>

namespace coronary
{
struct BvhNode;
struct BvhLeaf;

/// Where on a triangle a nearest point lies.
enum class TriangleFeature : int
{
  Face = 0,
  EdgeAB = 1,
  EdgeBC = 2,
  EdgeCA = 3,
  A = 4,
  B = 5,
  C = 6
};

struct TrianglePoint
{
  Vector3 point = Vector3::Zero();
  double squaredDistance = std::numeric_limits<double>::infinity();
  TriangleFeature feature = TriangleFeature::Face;
};

/// The point of a triangle that is nearest to p. The triangle may be a line or a point: one of its
/// edges or corners is named then. Source: Ericson, Real-Time Collision Detection, 2005, 5.1.5.
TrianglePoint NearestOnTriangle(
  const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/// What a triangle above p adds to how often a closed surface winds around p. Neighbouring triangles
/// decide alike about a common edge.
int WindingAbove(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/// Copies what it is made of. Queries may run on several threads, but not beside a Refit.
class TriangleBvh
{
public:
  /// Of no triangles.
  TriangleBvh();

  /**
   * Triangles may be degenerate, and points may coincide. Runs on all threads; the same tree whatever
   * their number.
   * @throws std::invalid_argument for an index out of range, a coordinate of a corner that is not
   *         finite or beyond 1e18, or more than 2^31 - 64 triangles or points
   */
  TriangleBvh(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);
  TriangleBvh(const TriangleBvh& other);
  TriangleBvh(TriangleBvh&& other) noexcept;
  TriangleBvh& operator=(const TriangleBvh& other);
  TriangleBvh& operator=(TriangleBvh&& other) noexcept;
  ~TriangleBvh();

  ///@{
  /**
   * The same triangles with moved points. Queries stay exact, but become slower where triangles that
   * were near each other no longer are.
   * @param points  as many as before; of the second form x, y, z of each
   * @throws std::invalid_argument as the constructor, and the tree must not be used then
   */
  void Refit(const std::vector<Vector3>& points);
  void Refit(const std::vector<float>& points);
  ///@}

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

  /// The nearest point of one of the triangles.
  TrianglePoint NearestOn(std::int64_t triangle, const Vector3& p) const
  {
    const std::array<std::int32_t, 3>& corners = this->Corners[triangle];
    return NearestOnTriangle(
      p, this->Points[corners[0]], this->Points[corners[1]], this->Points[corners[2]]);
  }

  /**
   * How often the closed surface winds around p, by the triangles above it: 1 inside, 0 outside a
   * surface whose triangles look outwards. Neighbouring triangles decide alike about a common edge.
   */
  int Winding(const Vector3& p) const;

  /// The triangles in the order of the leaves: neighbours in space are mostly neighbours in it.
  const std::vector<std::int32_t>& Order() const { return this->LeafOrder; }

private:
  struct Item;
  struct Splitting;
  void Build(std::vector<Item>& items);
  void BuildNode(Splitting& splitting, std::int64_t node, std::int64_t firstLeaf,
    std::int64_t leaves, std::vector<std::array<std::int64_t, 3>>* later);
  void Fit();
  void CheckPoints() const;

  std::vector<Vector3> Points;
  std::vector<std::array<std::int32_t, 3>> Corners;
  std::vector<std::int32_t> LeafOrder;
  std::vector<BvhNode> Nodes;
  std::vector<BvhLeaf> Leaves;
  Vector3 Centre = Vector3::Zero(); ///< what the boxes' coordinates are relative to
  double Size = 0.0;                ///< longest side of the box around all, when built
};
}

#endif
