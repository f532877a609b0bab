/**
 * @file vtkSurfaceFile.h
 * @brief Surfaces from files of several kinds, for the commands.
 */
#ifndef vtkSurfaceFile_h
#define vtkSurfaceFile_h

#include "MeshDistance.h"

#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <string>
#include <vector>

class vtkMessageTrap;

namespace coronary
{
/// The kinds, for messages.
constexpr const char* SurfaceFileKinds = ".vtp, .vtu, .obj, .off, .mesh, .stl or .ply";

/// Whether a name ends like one of them.
bool IsSurfaceFile(const std::string& path);

/**
 * Polygons of a file; of a .vtu file the boundary, of a mask (.seg.nrrd and other volumes) its surface. Arrays come
 * along where the kind has any.
 * @param segments  of a mask, by name or ID; empty: all
 * @throws std::runtime_error naming the file, also if it has no polygons
 */
vtkSmartPointer<vtkPolyData> ReadSurface(
  const std::string& path, vtkMessageTrap& messages, const std::vector<std::string>& segments = {});

/// A surface to be compared, and where its arrays are.
struct SurfaceTriangles
{
  vtkSmartPointer<vtkPolyData> data; ///< triangles
  SurfaceMesh mesh;
};

/**
 * The same in triangles.
 * @param groups  point or cell array with the branches
 * @param caps    cell array whose values above 1 are caps
 * @throws as ReadSurface; std::invalid_argument naming an array that does not fit
 */
SurfaceTriangles ReadTriangles(const std::string& path, const std::string& groups,
  const std::string& caps, vtkMessageTrap& messages, const std::vector<std::string>& segments = {});
}

#endif
