/**
 * @file vtkMeshConversion.h
 * @brief Meshes and their arrays between VTK's files and those of libigl, for `convert`.
 */
#ifndef vtkMeshConversion_h
#define vtkMeshConversion_h

#include "MeshFile.h"

#include "vtkSmartPointer.h"

#include <string>

class vtkMessageTrap;
class vtkPointSet;
class vtkPolyData;

namespace coronary
{
/// Points, triangles (polygons as fans) and tetrahedra. @param path  for messages
/// @throws std::runtime_error naming the file for other cells
FileMesh MeshOf(vtkPointSet* data, const std::string& path);

/// Points and triangles, in double precision.
vtkSmartPointer<vtkPolyData> PolyDataOf(const FileMesh& mesh);

/// Whether one of the names is that of a .obj, .off, .mesh, .dmat or .vtu file.
bool IsMeshConversion(const std::string& input, const std::string& output);

/**
 * Converts .obj, .off, .mesh, .vtp (triangles) and .vtu (tetrahedra and triangles) into each other; one
 * point array of a .vtp or .vtu file to a .dmat matrix, a row a point; .dmat text to binary and back.
 * @param array   name of the array for a .dmat file
 * @param binary  whether a .dmat file is binary
 * @return one line that says what was written
 * @throws std::runtime_error naming the file; UsageError
 */
std::string ConvertMesh(const std::string& input, const std::string& output,
  const std::string& array, bool binary, vtkMessageTrap& messages);
}

#endif
