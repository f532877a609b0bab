/**
 * @file SurfaceSign.h
 * @brief On which side of a closed surface points are.
 */
#ifndef DynamicCoronary_SurfaceSign_h
#define DynamicCoronary_SurfaceSign_h

#include "ComparedSide.h"

namespace coronary
{
/// Which side of a closed surface a point is on. Source: Baerentzen and Aanaes, Signed distance
/// computation using the angle weighted pseudonormal, IEEE TVCG 2005;11:243.
class SurfaceSign
{
public:
  explicit SurfaceSign(const ComparedSide& side);

  /// Every edge is passed as often in one direction as in the other.
  bool Closed() const { return this->IsClosed; }

  /// Whether p, whose nearest point is given, is inside.
  bool Inside(const Vector3& p, const TriangleBvh::Nearest& nearest) const;

private:
  const ComparedSide& Of;
  bool IsClosed = true;
  bool Inverted = false;                           ///< the triangles look inwards
  std::vector<Vector3> Normals;                    ///< of triangles; zero: degenerate
  std::vector<std::array<Vector3, 3>> EdgeNormals; ///< AB, BC, CA; zero: not simply two triangles
  std::vector<Vector3> PointNormals;               ///< zero: a degenerate triangle is near
};

/// Signs of a side's point distances, if the other side is closed.
bool SignDistances(const ComparedSide& side, const SurfaceMesh& otherMesh,
  const ComparedSide& other, bool otherIsClipped, const MeshDistanceSettings& settings,
  std::vector<double>& distance);
}

#endif
