/**
 * @file Base64.h
 * @brief Bytes as text.
 */
#ifndef DynamicCoronary_Base64_h
#define DynamicCoronary_Base64_h

#include <string>
#include <string_view>

namespace coronary
{
/// Base64 of RFC 4648 (section 4), padded with '=', without line breaks.
std::string Base64(std::string_view bytes);
}

#endif
