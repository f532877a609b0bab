/**
 * @file StlPlyFile.h
 * @brief Surfaces as .stl and .ply files, read without believing what they claim.
 */
#ifndef DynamicCoronary_StlPlyFile_h
#define DynamicCoronary_StlPlyFile_h

#include "MeshFile.h"

#include <string>

namespace coronary
{
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
}

#endif
