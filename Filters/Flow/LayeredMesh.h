/**
 * @file LayeredMesh.h
 * @brief A mesh for simulations of flow: layers of prisms along the wall, tetrahedra in the core.
 *
 * Wall shear is a derivative at the wall, and tetrahedra there have it wrong by 15 to 30 %. So the wall is offset inwards,
 * by a share of the local radius, and what is between becomes layers of prisms, the thinnest at the wall. Caps stay flat:
 * the prisms end on them with quadrilaterals.
 */
#ifndef DynamicCoronary_LayeredMesh_h
#define DynamicCoronary_LayeredMesh_h

#include "PolyhedralMesh.h"
#include "TetrahedralMesh.h"

#include <array>
#include <map>
#include <string>
#include <vector>

namespace coronary
{
struct LayeredMeshSettings
{
  int layers = 5;      ///< 1 to 20
  double growth = 1.3; ///< of a layer's height over that of the one before, 1 to 2
  double thickness =
    0.45; ///< of all layers, in local radii, 0.05 to 0.7; less where there is no room
  double extension = 0.0;            ///< of each end, in its diameters, 0 to 20
  std::map<int, double> extensionOf; ///< the same of some caps, by their ids
  TetrahedralMeshSettings
    core; ///< `backend` and `repair` are not asked: the core's surface has to stay

  /// @throws std::invalid_argument naming the setting
  void Validate() const;
};

/// A closed surface whose ends are caps.
struct CappedSurface
{
  std::vector<Vector3> points; ///< mm
  std::vector<Triangle> triangles;
  std::vector<int> entity; ///< per triangle: 1 wall, 2.. flat caps
};

/// A straight piece that was put before an end.
struct EndExtension
{
  int entity = 0;
  Vector3 centre = Vector3::Zero();    ///< of the end that the surface had
  Vector3 outwards = Vector3::UnitZ(); ///< unit
  double radius = 0.0;                 ///< of the end: of a circle of its area
  double reach = 0.0;                  ///< greatest distance of its rim from the centre, mm
  double length = 0.0;                 ///< mm; 0: none
};

struct LayeredMesh
{
  std::vector<Vector3> points; ///< mm
  /// Corners 0 to 2 nearer to the wall and counter-clockwise seen from there, 3 to 5 below them.
  std::vector<std::array<std::int64_t, 6>> prisms;
  std::vector<Tetrahedron> tetrahedra;
  std::vector<EndExtension> ends; ///< of all caps, by ascending ids
  PolyhedralMesh cells; ///< prisms, then tetrahedra; patches: the wall, then caps by ascending ids
  std::vector<double>
    thickness;           ///< per triangle of the wall patch: mean height of its layers together, mm
  double thinnest = 1.0; ///< least share of the wanted thickness that was left anywhere
  std::vector<std::string> warnings;

  /// Where a point was in the vessel as it was given: those of an extension are at its end.
  Vector3 WithoutExtension(const Vector3& point) const;
};

/**
 * Offsets the wall along smoothed normals by a share of the radius of the ball that touches it from inside, graded over
 * the surface, and by less where prisms would fold or walls meet; then meshes the core with TetGen.
 *
 * @param patchName  names of the patches by entity; without one: wall, cap_ID
 * @throws SurfaceError           for a surface that is not closed or cuts itself
 *         std::invalid_argument  for a setting, a surface in several pieces or without caps, a cap that is not flat, a
 *                                cap whose rim is no single loop
 *         MesherFailure          when there is no TetGen, it fails, or no thickness makes the prisms sound
 *         Cancelled
 */
LayeredMesh MakeLayeredMesh(const CappedSurface& surface, const LayeredMeshSettings& settings = {},
  const std::map<int, std::string>& patchName = {}, const ProgressCallback& progress = {});
}

#endif
