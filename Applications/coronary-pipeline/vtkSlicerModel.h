/**
 * @file vtkSlicerModel.h
 * @brief Models as 3D Slicer reads them, in LPS.
 *
 * A model file says in which axes it is by the words SPACE=LPS or SPACE=RAS; without them Slicer 4.11 and later takes LPS, and
 * a scene of older versions RAS. Where Slicer looks for them: in a field array `SPACE` of a .vtp, in the header (the title)
 * of a .vtk, in the header of a .stl (the first line of the text form), in a comment of a .ply and of a .obj.
 */
#ifndef vtkSlicerModel_h
#define vtkSlicerModel_h

#include <string>

class vtkMessageTrap;
class vtkPolyData;

namespace coronary
{
/// Whether a name ends in .vtp, .vtk, .stl, .ply or .obj.
bool IsSlicerModelFile(const std::string& path);

/**
 * Writes poly data, atomically, with SPACE=LPS at its place. Arrays are kept in .vtp and .vtk only; .stl and .ply have single
 * precision, and triangles only.
 * @throws std::runtime_error naming the file
 */
void WriteSlicerModel(const std::string& path, vtkPolyData* data, vtkMessageTrap& messages);
}

#endif
