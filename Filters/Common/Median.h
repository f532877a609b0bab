/**
 * @file Median.h
 * @brief The median and other quantiles of a list.
 */
#ifndef DynamicCoronary_Median_h
#define DynamicCoronary_Median_h

#include <vector>

namespace coronary
{
/// The value that a share of the list lies below; 0 of an empty list. @param share  0 to less than 1
double QuantileOf(std::vector<double> values, double share);

/// The upper one of two; 0 of an empty list.
double MedianOf(std::vector<double> values);
}

#endif
