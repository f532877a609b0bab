/**
 * @file ItkFastMarching.h
 * @brief ITK's fast marching, to be compared with.
 */
#ifndef DynamicCoronary_ItkFastMarching_h
#define DynamicCoronary_ItkFastMarching_h

#include <array>
#include <memory>

namespace coronary
{
/**
 * itk::FastMarchingImageFilter over the whole image from one voxel.
 * @param speed    i fastest, positive, mm per unit of arrival; kept, not copied
 * @param spacing  mm
 * @return arrival, in ITK's own memory
 */
std::shared_ptr<const float> ItkFastMarching(const float* speed,
  const std::array<int, 3>& dimensions, const std::array<double, 3>& spacing,
  const std::array<int, 3>& seed);
}

#endif
