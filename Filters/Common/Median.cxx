#include "Median.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace coronary
{
double QuantileOf(std::vector<double> values, double share)
{
  if (values.empty())
  {
    return 0.0;
  }
  const auto at =
    values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double MedianOf(std::vector<double> values)
{
  return QuantileOf(std::move(values), 0.5);
}
}
