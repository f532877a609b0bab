// Arguments out of range, for the implementation files of this folder.
#ifndef DynamicCoronary_RequireRange_h
#define DynamicCoronary_RequireRange_h

#include <stdexcept>
#include <string>

namespace coronary
{
inline bool Within(double value, double low, double high)
{
  return value >= low && value <= high; // not for NaN
}

/// Called with whether a value is possible; throws std::invalid_argument that names it and its range if not.
struct RequireRange
{
  const char* of; ///< what the value is an argument of
  void operator()(bool possible, const char* name, double value, const char* range) const
  {
    if (!possible)
    {
      throw std::invalid_argument(std::string(this->of) + ": " + name + " is " +
        std::to_string(value) + "; it has to be " + range);
    }
  }
};
}

#endif
