/**
 * @file SettingLimits.h
 * @brief Settings that are out of range are refused by name.
 */
#ifndef DynamicCoronary_SettingLimits_h
#define DynamicCoronary_SettingLimits_h

#include <cstdio>
#include <stdexcept>

namespace coronary
{
/// NaN is not within.
/// @throws std::invalid_argument  "NAME must be within LOW .. HIGH, not VALUE"
inline void RequireWithin(double value, double low, double high, const char* name)
{
  if (!(value >= low && value <= high))
  {
    char text[160];
    std::snprintf(text, sizeof(text), "%s must be within %g .. %g, not %g", name, low, high, value);
    throw std::invalid_argument(text);
  }
}
}

#endif
