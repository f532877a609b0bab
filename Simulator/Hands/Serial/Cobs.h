/**
 * @file Cobs.h
 * @brief Consistent overhead byte stuffing (Cheshire and Baker, 1999): bytes without a 0, so that 0 can end a frame.
 */
#ifndef DynamicCoronary_Cobs_h
#define DynamicCoronary_Cobs_h

#include <cstddef>
#include <cstdint>

namespace coronary
{
/// Bytes that `size` bytes can become, at most.
constexpr std::size_t CobsSize(std::size_t size)
{
  return size + size / 254 + 1;
}

/// @param to  room for CobsSize(size); not within `from`  @return bytes written, none of them 0
std::size_t CobsEncode(const std::uint8_t* from, std::size_t size, std::uint8_t* to);

/// In place. @return bytes that are left; 0 when the bytes are no such code, or code nothing
std::size_t CobsDecode(std::uint8_t* bytes, std::size_t size);
}

#endif
