/**
 * @file MeshFile.h
 * @brief Meshes as .obj, .off and .mesh files, as libigl and TetGen's users have them, and surfaces as .stl and .ply
 *   files. None of what files claim is believed.
 */
#ifndef DynamicCoronary_MeshFile_h
#define DynamicCoronary_MeshFile_h

#include "Geometry.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
struct FileMesh
{
  std::vector<Vector3> points; ///< in the unit of the file
  std::vector<Triangle> triangles;
  std::vector<std::array<std::int64_t, 4>> tetrahedra; ///< .mesh only

  // What ObjText() and the like write besides.
  std::string comment;   ///< what it is, unit, axes; empty: none
  std::vector<int> face; ///< per triangle: the face that it is of
  std::vector<std::pair<int, std::string>>
    faces; ///< ids and names, in the order of the groups; empty: none
  std::vector<std::pair<std::string, std::vector<float>>>
    vertexValues; ///< .ply: a number a point each
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

/**
 * Reads an .stl file, text or binary. Corners with the same coordinates become one point; triangles that have a corner
 * twice are left out.
 * @throws std::runtime_error with one sentence naming the file: it can not be read, is no STL file, ends too early, has a
 *   coordinate that is no finite number
 */
FileMesh ReadStlFile(const std::string& path);

/**
 * Reads a .ply file, text or binary of either byte order: `x`, `y`, `z` of the element `vertex`, and `vertex_indices` (or
 * `vertex_index`) of the element `face`, where polygons become fans of triangles. Everything else is passed over.
 * @throws std::runtime_error with one sentence naming the file: it can not be read, is no PLY file, ends too early, has a
 *   coordinate that is no finite number, or a corner that does not exist
 */
FileMesh ReadPlyFile(const std::string& path);

/// Wavefront's text: `v` with all digits, then the triangles, those of one face after the other behind `g NAME`. Points
/// and their order are those of the mesh.
std::string ObjText(const FileMesh& mesh);

/// Binary, little-endian. Vertices: float x y z and the values; faces: vertex_indices, int face_id. Names of faces
/// are comments.
std::string PlyBytes(const FileMesh& mesh);

/// Binary: three float corners a triangle, and its normal (0 where it has no area). At most 4,294,967,295 triangles.
std::string StlBytes(const FileMesh& mesh);
}

#endif
