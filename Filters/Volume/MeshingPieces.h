// What a mesher gets of a surface and a skeleton: one piece for each component. Inside the library only.
#ifndef DynamicCoronary_MeshingPieces_h
#define DynamicCoronary_MeshingPieces_h

#include "TetrahedralMesh.h"
#include "TriangleBvh.h"

namespace coronary
{
/// The vessel's radius anywhere: the nearest skeleton point's, or half the mean depth without one.
class LocalRadius
{
public:
  /// Keeps a reference to the input.
  LocalRadius(const TetrahedralMeshInput& input, const ClosedSurface& surface);

  double At(const Vector3& p) const;

private:
  const std::vector<Vector3>& Points;
  const std::vector<double>& Radius;
  std::vector<Triangle> Segments;
  TriangleBvh Tree;
  double Mean = 0.0;
};

/// One component with the part of the skeleton that lies in it; points relative to a common origin.
struct MeshingPiece
{
  std::vector<Vector3> points; ///< the surface's first
  std::vector<std::int64_t> surfacePoint;
  std::vector<std::int64_t> skeletonPoint;
  std::vector<Triangle> triangles;
  std::vector<std::int64_t> sourceCell;
  std::vector<std::pair<std::int64_t, std::int64_t>> segments;
  std::vector<std::int64_t> segmentSource;
  std::vector<double> sizes; ///< wanted edge length at each point
};

struct MeshingPieces
{
  std::vector<MeshingPiece> pieces; ///< as the surface's components
  Vector3 origin = Vector3::Zero();
  std::vector<std::string> warnings; ///< what became of skeleton points that are not inside
};

/// @throws SurfaceError for a component inside another one; std::invalid_argument for a part of the skeleton outside
MeshingPieces MakeMeshingPieces(const TetrahedralMeshInput& input,
  const TetrahedralMeshSettings& settings, const ClosedSurface& surface, const LocalRadius& radii);

/// "0.0123 mm"
std::string Millimetres(double value);
}

#endif
