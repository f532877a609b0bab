/**
 * @file ComparedSide.h
 * @brief One of two surfaces that are compared, and the distances of its points to the other.
 */
#ifndef DynamicCoronary_ComparedSide_h
#define DynamicCoronary_ComparedSide_h

#include "MeshDistance.h"
#include "SurfaceEnds.h"
#include "TriangleBvh.h"

#include <cmath>

namespace coronary
{
/// Neighbours that give each other hints.
constexpr std::int64_t HintRange = 512;

/// A sum that depends on the order of its terms by no more than its last bits' rounding.
class CompensatedSum
{
public:
  void Add(double term)
  {
    const double next = this->Total + term;
    this->Lost += std::abs(this->Total) >= std::abs(term) ? (this->Total - next) + term
                                                          : (term - next) + this->Total;
    this->Total = next;
  }
  double Value() const { return this->Total + this->Lost; }

private:
  double Total = 0.0;
  double Lost = 0.0;
};

using SideTriangle = std::array<std::int32_t, 3>; ///< indices of points

/// One of the two surfaces.
struct ComparedSide
{
  ComparedSurface surface;
  TriangleBvh tree;
  std::vector<std::int64_t> groups; ///< values, ascending; one entry -1 when there are none
  bool hasGroups = false;
  std::vector<std::int32_t> groupOf;    ///< of each triangle: index in groups
  std::vector<std::int32_t> pointOrder; ///< neighbours in space are mostly neighbours in it

  // To the other side, of each point.
  std::vector<double> distance;
  std::vector<TriangleBvh::Nearest> nearest;

  // To the other side, of each triangle's centroid; -1 where it was not asked for.
  std::vector<std::int32_t> centroidNearest;

  Vector3 Corner(std::int64_t triangle, int k) const
  {
    return this->surface.points[this->surface.triangles[triangle][k]];
  }
  double Area(std::int64_t triangle) const
  {
    const Vector3 a = this->Corner(triangle, 0);
    return 0.5 * (this->Corner(triangle, 1) - a).cross(this->Corner(triangle, 2) - a).norm();
  }
  std::int64_t Triangles() const
  {
    return static_cast<std::int64_t>(this->surface.triangles.size());
  }
};

/// @throws std::invalid_argument as CompareSurfaces
void CheckSurface(const SurfaceMesh& mesh, const std::string& name);

/// A triangle's branch: its own, or that of most of its corners, of the first corner when all differ.
std::vector<std::int64_t> GroupsOfTriangles(const SurfaceMesh& mesh);

/// @throws std::invalid_argument when nothing is left of the mesh without its ends
void PrepareSide(ComparedSide& side, const SurfaceMesh& mesh, const std::vector<SurfaceEnd>* ends,
  const MeshDistanceSettings& settings, const std::string& name);

/**
 * @param all  whether every distance is wanted; else those that can not be the greatest one are only known
 *             to be no greater than what is stored, and `nearest` is a triangle at that distance
 */
void MeasurePoints(
  ComparedSide& side, const TriangleBvh& other, bool all, const ProgressCallback& progress);

/// Values of the points for those of the input; NaN where they are not compared.
std::vector<double> ToInput(const ComparedSide& side, const std::vector<double>& distance);
}

#endif
