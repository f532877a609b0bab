/**
 * @file SurfaceFile.h
 * @brief A surface as the bytes of an .obj, .ply or .stl file.
 */
#ifndef DynamicCoronary_SurfaceFile_h
#define DynamicCoronary_SurfaceFile_h

#include "Geometry.h"

#include <string>
#include <utility>
#include <vector>

namespace coronary
{
struct FileSurface
{
  std::string comment;         ///< one line: what it is, unit, axes
  std::vector<Vector3> points; ///< in the unit of the file
  std::vector<Triangle> triangles;
  std::vector<int> face;                          ///< per triangle: the face that it is of
  std::vector<std::pair<int, std::string>> faces; ///< ids and names, in the order of the groups
  std::vector<std::pair<std::string, std::vector<float>>>
    vertexValues; ///< .ply: a number a point each
};

/// Wavefront's text: `v` with all digits, then the triangles of one face after the other behind `g NAME`. Points
/// and their order are those of the surface.
std::string ObjText(const FileSurface& surface);

/// Binary, little-endian. Vertices: float x y z and the values; faces: vertex_indices, int face_id. Names of faces
/// are comments.
std::string PlyBytes(const FileSurface& surface);

/// Binary: three float corners a triangle, and its normal (0 where it has no area). At most 4,294,967,295 triangles.
std::string StlBytes(const FileSurface& surface);
}

#endif
