#include "Cobs.h"

namespace coronary
{
std::size_t CobsEncode(const std::uint8_t* from, std::size_t size, std::uint8_t* to)
{
  std::size_t code = 0; // where the length of the current block goes
  std::size_t at = 1;
  for (std::size_t n = 0; n < size; ++n)
  {
    if (from[n] != 0)
    {
      to[at++] = from[n];
    }
    const bool full = at - code == 255 && n + 1 < size;
    if (from[n] == 0 || full)
    {
      to[code] = static_cast<std::uint8_t>(at - code);
      code = at++;
    }
  }
  to[code] = static_cast<std::uint8_t>(at - code);
  return at;
}

std::size_t CobsDecode(std::uint8_t* bytes, std::size_t size)
{
  std::size_t written = 0;
  std::size_t at = 0;
  while (at < size)
  {
    const std::size_t length = bytes[at++];
    if (length == 0 || at + length - 1 > size)
    {
      return 0;
    }
    for (std::size_t n = 1; n < length; ++n)
    {
      if (bytes[at] == 0)
      {
        return 0;
      }
      bytes[written++] = bytes[at++];
    }
    if (length < 255 && at < size)
    {
      bytes[written++] = 0;
    }
  }
  return written;
}
}
