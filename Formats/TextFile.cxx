#include "TextFile.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace coronary
{
std::string ReadTextFile(const std::string& path, const std::string& what, std::uint64_t maximum)
{
  std::ifstream file(path, std::ios::binary);
  if (!file)
  {
    throw std::runtime_error("Cannot open '" + path + "': " + std::strerror(errno) + ".");
  }
  std::string text;
  char block[65536];
  while (text.size() <= maximum && (file.read(block, sizeof(block)) || file.gcount() > 0))
  {
    text.append(block, static_cast<std::size_t>(file.gcount()));
  }
  if (text.size() > maximum)
  {
    throw std::runtime_error("'" + path + "': is too large for " + what + ".");
  }
  if (file.bad() || !file.eof())
  {
    throw std::runtime_error("'" + path + "': cannot be read.");
  }
  return text;
}
}
