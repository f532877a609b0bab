/**
 * @file ByteOrder.h
 * @brief Numbers as bytes of a file, in the order that the file has, whatever the computer has. Not installed.
 */
#ifndef DynamicCoronary_ByteOrder_h
#define DynamicCoronary_ByteOrder_h

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace coronary
{
inline bool HostIsBigEndian()
{
  const std::uint16_t one = 1;
  unsigned char first = 0;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

/// A number out of its bytes in a file.
template <typename Value>
Value NumberAt(const void* bytes, bool bigEndian)
{
  std::array<unsigned char, sizeof(Value)> own{};
  std::memcpy(own.data(), bytes, sizeof(Value));
  if (bigEndian != HostIsBigEndian())
  {
    std::reverse(own.begin(), own.end());
  }
  Value value;
  std::memcpy(&value, own.data(), sizeof(Value));
  return value;
}

/// Values of `valueBytes` bytes out of a file, one behind the other, as the computer has them.
inline void ToHostOrder(std::vector<unsigned char>& bytes, std::size_t valueBytes, bool bigEndian)
{
  if (bigEndian == HostIsBigEndian() || valueBytes < 2)
  {
    return;
  }
  for (auto first = bytes.begin(); bytes.end() - first >= static_cast<std::ptrdiff_t>(valueBytes);
       first += static_cast<std::ptrdiff_t>(valueBytes))
  {
    std::reverse(first, first + static_cast<std::ptrdiff_t>(valueBytes));
  }
}

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
