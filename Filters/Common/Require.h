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

/// Not for NaN.
inline bool Within(double value, double low, double high)
{
  return value >= low && value <= high;
}

/// Requires something of one thing's settings or arguments: what is thrown begins with the thing's name.
struct RequireOf
{
  const char* whose;

  /// @throws std::invalid_argument  "WHOSE: REQUIREMENT"
  void operator()(bool condition, const char* requirement) const
  {
    if (!condition)
    {
      throw std::invalid_argument(std::string(this->whose) + ": " + requirement);
    }
  }

  /// @throws std::invalid_argument  "WHOSE: NAME is VALUE; it has to be RANGE"
  void operator()(bool condition, const char* name, double value, const char* range) const
  {
    if (!condition)
    {
      (*this)(false,
        (std::string(name) + " is " + std::to_string(value) + "; it has to be " + range).c_str());
    }
  }

  /// @throws std::invalid_argument  "WHOSE: NAME must be from LOW to HIGH"
  void Range(const char* name, double value, double low, double high) const
  {
    if (!Within(value, low, high))
    {
      (*this)(false,
        (std::string(name) + " must be from " + std::to_string(low) + " to " + std::to_string(high))
          .c_str());
    }
  }
};
}

#endif
