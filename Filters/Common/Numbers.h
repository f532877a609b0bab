/**
 * @file Numbers.h
 * @brief Numbers of mathematics that C++17 does not have. For sources, not for headers of ours that are installed.
 */
#ifndef DynamicCoronary_Numbers_h
#define DynamicCoronary_Numbers_h

#include <limits>

namespace coronary
{
inline constexpr double Pi = 3.14159265358979323846;
inline constexpr double Degree = Pi / 180.0; ///< radians
inline constexpr double Infinity = std::numeric_limits<double>::infinity();
inline constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
}

#endif
