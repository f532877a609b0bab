/**
 * @file RequireSetting.h
 * @brief One sentence for all settings that are out of range.
 */
#ifndef DynamicCoronary_RequireSetting_h
#define DynamicCoronary_RequireSetting_h

#include <stdexcept>
#include <string>

namespace coronary
{
/// @throws std::invalid_argument  "WHAT: NAME is VALUE; it has to be RANGE", unless it is possible
inline void RequireSetting(
  const char* what, bool possible, const char* name, double value, const char* range)
{
  if (!possible)
  {
    throw std::invalid_argument(
      std::string(what) + ": " + name + " is " + std::to_string(value) + "; it has to be " + range);
  }
}
}

#endif
