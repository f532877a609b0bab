/**
 * @file LittleEndian.h
 * @brief Numbers as bytes of a file, least first, whatever the computer has.
 */
#ifndef DynamicCoronary_LittleEndian_h
#define DynamicCoronary_LittleEndian_h

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

namespace coronary
{
/// Integers of two and four bytes, and float.
template <typename Value>
void AppendLittleEndian(std::string& bytes, Value value)
{
  static_assert(sizeof(Value) == 2 || sizeof(Value) == 4);
  std::uint32_t bits = 0;
  if constexpr (std::is_floating_point_v<Value>)
  {
    std::memcpy(&bits, &value, sizeof(bits));
  }
  else
  {
    bits = static_cast<std::uint32_t>(value);
  }
  for (std::size_t k = 0; k < sizeof(Value); ++k)
  {
    bytes += static_cast<char>((bits >> (8 * k)) & 0xFFU);
  }
}
}

#endif
