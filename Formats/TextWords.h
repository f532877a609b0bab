/**
 * @file TextWords.h
 * @brief Lines, words and numbers of a text, whatever the locale, and what is wrong with them. Not installed.
 */
#ifndef DynamicCoronary_TextWords_h
#define DynamicCoronary_TextWords_h

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace coronary
{
/// @throws std::runtime_error "'path': what."
[[noreturn]] void FormatError(const std::string& path, const std::string& what);

/// A word for a message, at most 40 bytes of it: what is in a damaged file may be anything.
std::string Quoted(std::string_view word);

/// The next line of `text` from `position` on, without its end; moves `position` behind it.
std::string NextLine(const std::string& text, std::size_t& position);

std::string Trimmed(const std::string& text);
std::string LowerCase(std::string text);
bool EndsWith(std::string_view text, std::string_view end);
std::vector<std::string> Words(const std::string& text);

/// The whole of `text` as one number; false when it is none.
bool ParseNumber(const std::string& text, double& value);

/// `text` as exactly `count` finite numbers. @throws naming path and key
std::vector<double> ParseNumbers(
  const std::string& text, std::size_t count, const std::string& path, const std::string& key);

/// The same for whole numbers from `low` to 2^31 - 1.
std::vector<int> ParseIntegers(const std::string& text, std::size_t count, int low,
  const std::string& path, const std::string& key);
}

#endif
