/**
 * @file Median.h
 * @brief The median and other quantiles of a list.
 */
#ifndef DynamicCoronary_Median_h
#define DynamicCoronary_Median_h

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace coronary
{
/// The value at a place in ascending order; 0 of an empty list.
template <typename Real>
Real ValueOfRank(std::vector<Real> values, double rank)
{
  if (values.empty())
  {
    return Real(0);
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The value that a share of the list lies below; 0 of an empty list. @param share  0 to less than 1
template <typename Real>
Real QuantileOf(std::vector<Real> values, double share)
{
  const double rank = share * static_cast<double>(values.size());
  return ValueOfRank(std::move(values), rank);
}

/// The same with the least value for a share of 0 and the greatest for 1.
template <typename Real>
Real InclusiveQuantileOf(std::vector<Real> values, double share)
{
  const double rank = share * (static_cast<double>(values.size()) - 1.0);
  return ValueOfRank(std::move(values), rank);
}

/// The upper one of two; 0 of an empty list.
template <typename Real>
Real MedianOf(std::vector<Real> values)
{
  return QuantileOf(std::move(values), 0.5);
}
}

#endif
