/**
 * @file LineIntegrals.h
 * @brief What rays lose on their way: an image of the integral of attenuation.
 */
#ifndef DynamicCoronary_LineIntegrals_h
#define DynamicCoronary_LineIntegrals_h

#include <cstddef>
#include <vector>

namespace coronary
{
/// ln(I0 / I) per pixel, without unit, row by row from the top left. Layers (background, instruments, contrast medium)
/// are added to each other: I = I0 exp(-(A1 + A2 + ...)).
struct LineIntegrals
{
  LineIntegrals() = default;
  LineIntegrals(int columnCount, int rowCount)
    : columns(columnCount)
    , rows(rowCount)
    , values(static_cast<std::size_t>(columnCount) * static_cast<std::size_t>(rowCount), 0.0F)
  {
  }

  int columns = 0;
  int rows = 0;
  std::vector<float> values;
};
}

#endif
