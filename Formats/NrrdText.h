/**
 * @file NrrdText.h
 * @brief Parts of the header of a NRRD file that is written. Not installed.
 */
#ifndef DynamicCoronary_NrrdText_h
#define DynamicCoronary_NrrdText_h

#include "Geometry.h"
#include "TextWords.h"

#include <string>

namespace coronary
{
/// "(1,0,0)"
inline std::string NrrdVector(const Vector3& vector)
{
  std::string text = "(";
  AppendNumbers(text, vector, ",");
  return text + ")";
}

/// " (0.5,0,0) (0,0.5,0) (0,0,0.6)": the steps along the three axes of a grid.
inline std::string NrrdDirections(const ImageGrid& grid)
{
  std::string text;
  for (int axis = 0; axis < 3; ++axis)
  {
    text += " " + NrrdVector(grid.direction.col(axis) * grid.spacing[axis]);
  }
  return text;
}

/// Place of the first voxel.
inline std::string NrrdOrigin(const ImageGrid& grid)
{
  return NrrdVector(grid.IndexToWorld(grid.extent[0], grid.extent[2], grid.extent[4]));
}
}

#endif
