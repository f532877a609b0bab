/**
 * @file Median.h
 * @brief The median of a list.
 */
#ifndef DynamicCoronary_Median_h
#define DynamicCoronary_Median_h

#include <algorithm>
#include <cstddef>
#include <vector>

namespace coronary
{
/// The upper one of two; 0 of an empty list.
inline double MedianOf(std::vector<double> values)
{
  if (values.empty())
  {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}
}

#endif
