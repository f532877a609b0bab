/**
 * @file ImageExtent.h
 * @brief Inclusive index ranges of an image or of a part of it, as VTK has them.
 */
#ifndef DynamicCoronary_ImageExtent_h
#define DynamicCoronary_ImageExtent_h

#include <array>

namespace coronary
{
using Extent = std::array<int, 6>;

inline bool IsEmpty(const Extent& e)
{
  return e[0] > e[1] || e[2] > e[3] || e[4] > e[5];
}
}

#endif
