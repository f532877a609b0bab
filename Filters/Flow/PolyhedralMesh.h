/**
 * @file PolyhedralMesh.h
 * @brief Cells of any shape by their faces, as finite-volume solvers want them, and how good they are.
 */
#ifndef DynamicCoronary_PolyhedralMesh_h
#define DynamicCoronary_PolyhedralMesh_h

#include "Geometry.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/**
 * Faces between cells first, then those of the patches, one patch after the other. A face looks from its owner, the
 * lower cell, to its neighbour, and out of the mesh on a patch. The faces between cells are in the order of their owners,
 * those of an owner in the order of their neighbours: the order that OpenFOAM asks for.
 */
struct PolyhedralMesh
{
  struct Patch
  {
    std::string name;
    std::int64_t firstFace = 0;
    std::int64_t faces = 0;
  };

  std::vector<std::int64_t> faceOffset; ///< faces + 1 values: where the corners of a face begin
  std::vector<std::int64_t> corners;
  std::vector<std::int64_t> owner;     ///< per face
  std::vector<std::int64_t> neighbour; ///< per face between cells
  std::vector<Patch> patches;
  std::int64_t cells = 0;
  std::int64_t points = 0;

  std::int64_t NumberOfFaces() const { return static_cast<std::int64_t>(this->owner.size()); }
  std::int64_t NumberOfInnerFaces() const
  {
    return static_cast<std::int64_t>(this->neighbour.size());
  }
};

/// A cell as a list of faces, each a list of points that looks outwards.
using CellFaces = std::vector<std::vector<std::int64_t>>;

/// A face of the boundary and the patch it is of.
struct BoundaryFace
{
  std::vector<std::int64_t> corners; ///< in any order
  int patch = 0;                     ///< index of its name
};

/**
 * @param cells     one after the other: called with the number of the cell
 * @param boundary  every face of one cell only
 * @throws std::invalid_argument  a face of three cells, one with the same sense in two cells, a face of one cell only that
 *         is on no patch, a boundary face that no cell has or two have
 */
PolyhedralMesh MakePolyhedralMesh(std::int64_t points, const std::vector<CellFaces>& cells,
  const std::vector<BoundaryFace>& boundary, const std::vector<std::string>& patches);

/// With the definitions of OpenFOAM's checkMesh.
struct PolyhedralQuality
{
  double minimumVolume = 0.0; ///< of a cell
  std::int64_t minimumVolumeAt = -1;
  std::int64_t notPositive = 0; ///< cells
  double totalVolume = 0.0;
  double maximumNonOrthogonality = 0.0;        ///< radians, of faces between cells
  std::int64_t maximumNonOrthogonalityAt = -1; ///< the face
  double meanNonOrthogonality = 0.0;
  std::int64_t severeNonOrthogonality = 0; ///< faces above 70 degrees
  double maximumSkewness = 0.0;
  std::int64_t maximumSkewnessAt = -1; ///< the face
  double maximumOpenness = 0.0;        ///< |sum of a cell's face areas| over the sum of their sizes
  std::int64_t wrongPyramids = 0;      ///< faces that a cell's centre is on the wrong side of

  /// Whether all is as a solver can bear it: volumes and pyramids positive, angles below 90 degrees, skewness up to 4.
  bool IsSound() const;
};

/// @throws std::invalid_argument  another number of points than the mesh has, a coordinate that is not finite
PolyhedralQuality MeasurePolyhedra(const PolyhedralMesh& mesh, const std::vector<Vector3>& points);

/// Of every cell, signed.
std::vector<double> PolyhedraVolumes(
  const PolyhedralMesh& mesh, const std::vector<Vector3>& points);

/**
 * A bound from below on the volume of every cell while all points move straight and evenly from one place to another, over
 * its volume at `from`: positive only if no cell is ever empty or inside out. (A volume is then a polynomial of third
 * degree in time, and is never below its least Bernstein coefficient.)
 */
double LeastVolumeRatioBetween(
  const PolyhedralMesh& mesh, const std::vector<Vector3>& from, const std::vector<Vector3>& to);
}

#endif
