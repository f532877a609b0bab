/**
 * @file vtkMaskSurface.h
 * @brief The closed surface of a mask.
 */
#ifndef vtkMaskSurface_h
#define vtkMaskSurface_h

#include "SegmentationFile.h"

#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <string>
#include <vector>

namespace coronary
{
/**
 * Triangles around a mask, closed and seen from outside, in world coordinates. The steps of the voxels are smoothed away
 * (windowed sinc, which does not shrink); no point moves farther than half of the shortest side of a voxel.
 */
vtkSmartPointer<vtkPolyData> SurfaceOfMask(const SegmentationMask& mask);

/**
 * The same for segments of a file. @param segments  names or IDs; empty: all
 * @throws std::runtime_error naming the file
 */
vtkSmartPointer<vtkPolyData> ReadMaskSurface(
  const std::string& path, const std::vector<std::string>& segments);
}

#endif
