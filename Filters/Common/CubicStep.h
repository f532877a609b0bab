/**
 * @file CubicStep.h
 * @brief A smooth step.
 */
#ifndef DynamicCoronary_CubicStep_h
#define DynamicCoronary_CubicStep_h

#include <algorithm>

namespace coronary
{
/// A C1 step from 0 (u <= 0) to 1 (u >= 1).
inline double CubicStep(double u)
{
  u = std::clamp(u, 0.0, 1.0);
  return u * u * (3.0 - 2.0 * u);
}
}

#endif
