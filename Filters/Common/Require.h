/**
 * @file Require.h
 * @brief What must hold, or else an exception says what does not.
 */
#ifndef DynamicCoronary_Require_h
#define DynamicCoronary_Require_h

#include <stdexcept>
#include <string>

namespace coronary
{
/// @throws std::invalid_argument(requirement) when `condition` does not hold
inline void Require(bool condition, const char* requirement)
{
  if (!condition)
  {
    throw std::invalid_argument(requirement);
  }
}

inline void Require(bool condition, const std::string& requirement)
{
  Require(condition, requirement.c_str());
}
}

#endif
