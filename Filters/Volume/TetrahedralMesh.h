/**
 * @file TetrahedralMesh.h
 * @brief Tetrahedra in closed triangle surfaces, with a skeleton's points and edges among theirs.
 */
#ifndef DynamicCoronary_TetrahedralMesh_h
#define DynamicCoronary_TetrahedralMesh_h

#include "MesherProcess.h"
#include "SurfaceCheck.h"
#include "TetrahedronImprovement.h"

#include <string>
#include <utility>
#include <vector>

namespace coronary
{
enum class TetrahedralBackend
{
  Automatic = 0, ///< TetGen where it was built in, else CGAL
  TetGen = 1,    ///< constrained Delaunay; the surface is kept as it is
  Cgal = 2       ///< Delaunay refinement; the surface is meshed anew
};

enum class OutsidePolicy
{
  Refuse = 0,  ///< a skeleton point outside of the surface is an error
  LeaveOut = 1 ///< it is left out with its edges, with a warning
};

struct TetrahedralMeshSettings
{
  TetrahedralBackend backend = TetrahedralBackend::Automatic;
  double radiusEdgeRatio = 1.4;    ///< bound on circumscribed radius over shortest edge, 1.1 to 10;
                                   ///< not met everywhere beside small angles of the input
  double minimumDihedral = 0.2618; ///< aim, radians (15 degrees), 0 to 0.349; met for most
  double minimumVolume = 1e-7;     ///< mm^3; a smaller tetrahedron is an error
  double unitLength = 1.0;         ///< mm per unit of the coordinates
  double sizeFactor = 0.0; ///< edge length inside per local radius; 0: grows from the wall's
  bool improve = true;     ///< our own improvement after the backend's
  bool repair = true; ///< one try to repair what can not be meshed, or only with flat tetrahedra
  double repairLimit = 0.01; ///< largest displacement by it, in local radii
  OutsidePolicy outside = OutsidePolicy::Refuse;
  double timeLimit = 300.0; ///< seconds of processor time for each component and try, positive
  std::string workerFolder; ///< where the workers are; empty: where they were installed

  /// @throws std::invalid_argument naming the setting.
  void Validate() const;
};

struct TetrahedralMeshInput
{
  std::vector<Vector3> points; ///< mm
  std::vector<Triangle> triangles;
  std::vector<Vector3> skeletonPoints; ///< mm; may be empty
  std::vector<double> skeletonRadius;  ///< mm, one a point, positive; may be empty
  std::vector<std::pair<std::int64_t, std::int64_t>> skeletonEdges;
};

struct TetrahedralMesh
{
  std::vector<Vector3> points;            ///< mm
  std::vector<std::int64_t> surfacePoint; ///< per point: of the input, or -1
  std::vector<std::int64_t>
    skeletonPoint; ///< per point: of the input, or -1; the lowest of several
                   ///< at one place
  std::vector<Tetrahedron> tetrahedra;
  std::vector<int> region; ///< per tetrahedron: component of the surface, from 0 in its order

  std::vector<double> volume;          ///< per tetrahedron, mm^3
  std::vector<double> minimumDihedral; ///< per tetrahedron, radians
  std::vector<double> radiusEdgeRatio; ///< per tetrahedron

  std::vector<Triangle> boundary;            ///< looks outwards
  std::vector<std::int64_t> boundaryCell;    ///< per boundary triangle: the input's triangle (with
                                             ///< CGAL the nearest)
  std::vector<std::int64_t> boundaryElement; ///< per boundary triangle: its tetrahedron

  struct Edge
  {
    std::int64_t from;
    std::int64_t to;
    std::int64_t skeletonEdge; ///< of the input
  };
  std::vector<Edge> skeletonEdges; ///< those of the mesh that lie on the skeleton's

  TetrahedralBackend backend = TetrahedralBackend::TetGen; ///< the one that was used
  int tries = 1;                                           ///< 2 after a repair
  double repairDisplacement = 0.0;                         ///< greatest, mm
  ImprovementCounts improvements;
  std::vector<std::string> warnings; ///< sentences
};

/// Whether the backend's worker is there. For Automatic: whether any is.
bool HasTetrahedralBackend(TetrahedralBackend backend, const std::string& workerFolder = "");

/**
 * Checks the surface, puts the skeleton inside, has each component meshed by a worker process, and
 * improves the worst tetrahedra.
 *
 * Skeleton points within 1 % of the local radius of the surface become points of it (its triangles
 * are split there, or a point of it moves there by at most that much), and so do, with a warning,
 * points up to 10 % of the radius outside, and ends that are less than a tenth of an edge below it;
 * edges that are much longer than what is around them are split.
 *
 * When a tetrahedron with an angle below 5 degrees is left, the surface beside it is moved within the
 * repair limit, and it is tried once more; the better mesh counts. A warning names what stays flat.
 *
 * @throws SurfaceError for a surface that is not closed, cuts itself, or lies within another one;
 *         std::invalid_argument for a setting, a skeleton point outside (its number and position),
 *         a skeleton edge through the wall; MesherFailure when the backend fails twice, or a
 *         tetrahedron is too small; Cancelled
 */
TetrahedralMesh MakeTetrahedralMesh(const TetrahedralMeshInput& input,
  const TetrahedralMeshSettings& settings = {}, const ProgressCallback& progress = {});
}

#endif
