/**
 * @file EdgeSmoothing.h
 * @brief Less noise, the edges kept: what iterative reconstruction makes of an image.
 */
#ifndef DynamicCoronary_EdgeSmoothing_h
#define DynamicCoronary_EdgeSmoothing_h

#include "ParallelFor.h"

#include <array>
#include <vector>

namespace coronary
{
/// Standard deviation of the noise of an image in HU: the lower quartile of small squares that are not air or lung.
/// @param image  HU, i fastest
double ImageNoise(const std::vector<float>& image, const std::array<int, 3>& size);

/**
 * Least squares with Huber's penalty on differences of neighbours: the noise falls by a share, edges
 * that are higher than it stay. Grain becomes coarser, as in images of iterative reconstruction.
 * Source: Thibault et al., Med Phys 2007;34:4526 (the penalty; here on the image, not on the views).
 * @param image  HU, i fastest
 * @param share  of the noise that goes, 0 to 0.8
 * @throws Cancelled
 */
void SmoothWithinEdges(std::vector<float>& image, const std::array<int, 3>& size, double share,
  const ProgressCallback& progress = {});
}

#endif
