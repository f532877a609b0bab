/**
 * @file vtkSurfaceFile.h
 * @brief Surfaces from files of several kinds, for the commands.
 */
#ifndef vtkSurfaceFile_h
#define vtkSurfaceFile_h

#include "vtkSmartPointer.h"

#include <string>

class vtkMessageTrap;
class vtkPolyData;

namespace coronary
{
/// The kinds, for messages.
constexpr const char* SurfaceFileKinds = ".vtp, .vtu, .obj, .off, .mesh, .stl or .ply";

/// Whether a name ends like one of them.
bool IsSurfaceFile(const std::string& path);

/**
 * Polygons of a file; of a .vtu file the boundary. Arrays come along where the kind has any.
 * @throws std::runtime_error naming the file, also if it has no polygons
 */
vtkSmartPointer<vtkPolyData> ReadSurface(const std::string& path, vtkMessageTrap& messages);
}

#endif
