/**
 * @file TextFile.h
 * @brief The whole of a file that is a text.
 */
#ifndef DynamicCoronary_TextFile_h
#define DynamicCoronary_TextFile_h

#include <cstdint>
#include <string>

namespace coronary
{
/// In bytes: a list or description of a hundred thousand entries is smaller.
constexpr std::uint64_t MaximumTextFile = 64u << 20;

/**
 * Reads a file, which may be a pipe, to its end. Callers that shall not wait for a pipe RequireFile() before.
 * @param what     for messages, what the text should be: "a list of files"
 * @param largest  in bytes
 * @throws std::runtime_error naming `path` when it can not be opened or read, or has more than `largest` bytes
 */
std::string ReadTextFile(
  const std::string& path, const std::string& what, std::uint64_t maximum = MaximumTextFile);
}

#endif
