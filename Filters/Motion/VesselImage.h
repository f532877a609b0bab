/**
 * @file LineImage.h
 * @brief Lines with radii as an image of the vessels, for stages that compare images.
 */
#ifndef DynamicCoronary_LineImage_h
#define DynamicCoronary_LineImage_h

#include "PoseSequence.h"
#include "ScalarImage.h"

#include <vector>

namespace coronary
{
/// 1 inside of the vessels, 0 outside, with walls as wide as two voxels.
struct LineImage
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
 * @param spacing  of the voxels, mm, positive; made larger where the image would have more than 64
 *                 million voxels
 * @param margin   mm around the vessels, 0 or more
 * @throws std::invalid_argument  no lines, or as CheckMovingLines
 */
LineImage RenderLines(const MovingLines& lines, double spacing, double margin);
}

#endif
