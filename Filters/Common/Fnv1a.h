/**
 * @file Fnv1a.h
 * @brief A fast digest of bytes, to tell things apart; not against forgery.
 *
 * Source: Fowler, Noll, Vo, "The FNV Non-Cryptographic Hash Algorithm", IETF draft-eastlake-fnv.
 */
#ifndef DynamicCoronary_Fnv1a_h
#define DynamicCoronary_Fnv1a_h

#include <cstddef>
#include <cstdint>

namespace coronary
{
/// FNV-1a, 64 bits. @param before  the digest of what comes before, to go on from
inline std::uint64_t Fnv1a(
  const void* data, std::size_t size, std::uint64_t before = 0xcbf29ce484222325U)
{
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i)
  {
    before = (before ^ bytes[i]) * 0x100000001b3U;
  }
  return before;
}
}

#endif
