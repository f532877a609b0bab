/**
 * @file VesselImage.h
 * @brief Lines with radii, or closed surfaces, as an image of the vessels, for stages that compare images.
 */
#ifndef DynamicCoronary_VesselImage_h
#define DynamicCoronary_VesselImage_h

#include "PoseSequence.h"
#include "ScalarImage.h"

#include <vector>

namespace coronary
{
/// 1 inside of the vessels, 0 outside, and between at the walls.
struct VesselImage
{
  ImageGrid grid;
  std::vector<float> values;

  ScalarImage View() const
  {
    ScalarImage image;
    image.grid = this->grid;
    image.values = this->values.data();
    return image;
  }
};

/**
 * Walls are as wide as two voxels.
 * @param spacing  of the voxels, mm, positive; made larger where the image would have more than 64
 *                 million voxels
 * @param margin   mm around the vessels, 0 or more
 * @throws std::invalid_argument  no lines, or as CheckPolylines
 */
VesselImage RenderLines(const Polylines& lines, double spacing, double margin);

/**
 * The share of each voxel that is inside: exact along the first axis, four samples across it. What more
 * than one closed part encloses is inside; the order of the corners may be either one, the same everywhere.
 * @param points   mm; points at the same place count as one
 * @param spacing, margin  as above
 * @throws std::invalid_argument  no triangles, corners that are none of the points, places that are not
 * finite, a surface with open or turned edges (with their number), or without an inside
 */
VesselImage RenderSurface(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, double spacing, double margin);
}

#endif
