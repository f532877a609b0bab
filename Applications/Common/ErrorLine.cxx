#include "ErrorLine.h"

#include <algorithm>

namespace coronary
{
std::string ErrorLine(std::string message)
{
  std::replace_if(
    message.begin(), message.end(),
    [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; }, ' ');
  if (message.size() > LongestErrorLine)
  {
    constexpr std::size_t Part = LongestErrorLine / 2 - 10;
    message = message.substr(0, Part) + " ... " + message.substr(message.size() - Part);
  }
  return message;
}
}
