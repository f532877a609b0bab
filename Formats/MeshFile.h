/**
 * @file MeshFile.h
 * @brief Meshes as .obj, .off and .mesh files, as libigl and TetGen's users have them.
 */
#ifndef DynamicCoronary_MeshFile_h
#define DynamicCoronary_MeshFile_h

#include "Geometry.h"

#include <array>
#include <string>
#include <vector>

namespace coronary
{
struct FileMesh
{
  std::vector<Vector3> points; ///< in the unit of the file
  std::vector<Triangle> triangles;
  std::vector<std::array<std::int64_t, 4>> tetrahedra; ///< .mesh only
};

/// Whether the name ends in .obj, .off or .mesh (in lower case).
bool IsMeshFile(const std::string& path);

/**
 * Reads a mesh; what it is follows from the name.
 *
 * - .obj: lines `v` and `f` (indices from 1 or backwards from -1, with or without /texture/normal);
 *   polygons become fans of triangles; everything else is passed over.
 * - .off: also with colours or normals behind the numbers (COFF, NOFF, ..); polygons as above. Not binary.
 * - .mesh: Medit's text format in three dimensions: `Vertices`, `Triangles`, `Quadrilaterals` (as two
 *   triangles), `Tetrahedra`; references and other known parts are passed over.
 *
 * @throws std::runtime_error with one sentence naming the file, and the line where there is one: a file that can
 *   not be read, is of another form, ends too early, has a number that is none or not finite, or a
 *   corner that does not exist.
 */
FileMesh ReadMeshFile(const std::string& path);

/**
 * Writes a mesh, atomically, with numbers that are read back to the same bits.
 * @throws std::runtime_error naming the file: tetrahedra in other than .mesh, a coordinate that is not finite, a
 *   corner that does not exist, a folder that can not be written to, a full disk.
 */
void WriteMeshFile(const std::string& path, const FileMesh& mesh);
}

#endif
