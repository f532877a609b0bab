/**
 * @file vtkDataFiles.h
 * @brief VTK's data objects to and from files, for the commands.
 */
#ifndef vtkDataFiles_h
#define vtkDataFiles_h

#include "TextWords.h"

#include "vtkSmartPointer.h"

#include <stdexcept>
#include <string>

class vtkMessageTrap;
class vtkPolyData;
class vtkUnstructuredGrid;

namespace coronary
{
/// Reads a .vtp file.
/// @throws std::runtime_error naming the file
vtkSmartPointer<vtkPolyData> ReadPolyData(const std::string& path, vtkMessageTrap& messages);

/// Reads a .vtu file.
/// @throws std::runtime_error naming the file
vtkSmartPointer<vtkUnstructuredGrid> ReadUnstructuredGrid(
  const std::string& path, vtkMessageTrap& messages);

/// Writes a .vtp file, atomically.
/// @throws std::runtime_error naming the file
void WritePolyData(const std::string& path, vtkPolyData* data, vtkMessageTrap& messages);

/// Writes a .vtu file, atomically.
/// @throws std::runtime_error naming the file
void WriteUnstructuredGrid(
  const std::string& path, vtkUnstructuredGrid* data, vtkMessageTrap& messages);

/// Does something with what was read. What an algorithm refuses is told with the file that it is from.
/// @throws std::runtime_error in place of std::invalid_argument
template <typename Function>
auto About(const std::string& path, const Function& function)
{
  try
  {
    return function();
  }
  catch (const std::invalid_argument& error)
  {
    throw std::runtime_error("'" + path + "': " + error.what());
  }
}
}

#endif
