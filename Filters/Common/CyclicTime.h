/**
 * @file CyclicTime.h
 * @brief Times that repeat with every cycle; the cycle is 1.
 */
#ifndef DynamicCoronary_CyclicTime_h
#define DynamicCoronary_CyclicTime_h

#include <cmath>

namespace coronary
{
/// The time within its cycle, 0 to 1 (excluded).
inline double Modulo(double time)
{
  const double rest = time - std::floor(time);
  return rest < 1.0 ? rest : 0.0;
}

/// Distance of two times modulo the cycle, 0 to 0.5.
inline double CyclicDistance(double a, double b)
{
  const double apart = std::abs(a - b);
  return std::abs(apart - std::round(apart));
}

/// Nearer in time than this, modulo the cycle, two phases show the same moment.
inline constexpr double SameMoment = 0.02;
}

#endif
