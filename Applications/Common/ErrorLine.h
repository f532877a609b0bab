/**
 * @file ErrorLine.h
 * @brief What a program says when it fails: one line that a terminal can be trusted with.
 */
#ifndef DynamicCoronary_ErrorLine_h
#define DynamicCoronary_ErrorLine_h

#include <cstddef>
#include <string>

namespace coronary
{
constexpr std::size_t LongestErrorLine = 1000; ///< bytes

/// The message with a space for each control character, and without its middle when it is too long: names in it come from
/// files of others.
std::string ErrorLine(std::string message);
}

#endif
