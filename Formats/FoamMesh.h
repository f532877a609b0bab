/**
 * @file FoamMesh.h
 * @brief Meshes and lists of places as OpenFOAM's text files.
 *
 * OpenFOAM reckons in metres, the project in millimetres: `scale` is what a position is multiplied with.
 */
#ifndef DynamicCoronary_FoamMesh_h
#define DynamicCoronary_FoamMesh_h

#include "PolyhedralMesh.h"

#include <string>
#include <utility>
#include <vector>

namespace coronary
{
constexpr double MetresPerMillimetre = 1e-3;

/// The head of a file: what it is, of which class.
std::string FoamHeader(
  const std::string& kind, const std::string& location, const std::string& object);

/// Names in constant/polyMesh and contents.
/// @param wall  name of the patch that is of type wall; the others are of type patch
std::vector<std::pair<std::string, std::string>> FoamMeshFiles(const PolyhedralMesh& mesh,
  const std::vector<Vector3>& points, const std::string& wall, double scale = MetresPerMillimetre);

/// A plain list without a head, as constant/boundaryData has them. Numbers to `digits` places.
std::string FoamVectors(const std::vector<Vector3>& vectors, double scale, int digits);

/// The points of a patch, ascending.
std::vector<std::int64_t> PointsOfPatch(const PolyhedralMesh& mesh, std::size_t patch);

/// Names in constant/boundaryData and contents: where the points of each patch are at rest.
std::vector<std::pair<std::string, std::string>> FoamMotionPoints(
  const PolyhedralMesh& mesh, const std::vector<Vector3>& rest, double scale = MetresPerMillimetre);

/// The same of how far they are moved at a time, s.
std::vector<std::pair<std::string, std::string>> FoamMotionFrame(const PolyhedralMesh& mesh,
  const std::vector<Vector3>& rest, const std::vector<Vector3>& moved, double time,
  double scale = MetresPerMillimetre);

/// Of a directory of constant/boundaryData, or of results.
std::string FoamTime(double seconds);
}

#endif
