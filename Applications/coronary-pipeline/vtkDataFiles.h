/**
 * @file vtkDataFiles.h
 * @brief VTK's data objects to and from files, for the commands.
 */
#ifndef vtkDataFiles_h
#define vtkDataFiles_h

#include "Geometry.h"

#include "vtkSmartPointer.h"

#include <string>

class vtkImageData;
class vtkMessageTrap;
class vtkPolyData;

namespace coronary
{
/// The sampling of an image.
ImageGrid GridOf(vtkImageData* image);

/// Reads a .vtp file.
/// @throws std::runtime_error naming the file
vtkSmartPointer<vtkPolyData> ReadPolyData(const std::string& path, vtkMessageTrap& messages);

/// Writes a .vtp file, atomically.
/// @throws std::runtime_error naming the file
void WritePolyData(const std::string& path, vtkPolyData* data, vtkMessageTrap& messages);
}

#endif
