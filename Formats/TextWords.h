/**
 * @file TextWords.h
 * @brief Lines, words and numbers of a text, whatever the locale, and what is wrong with them. Not installed.
 */
#ifndef DynamicCoronary_TextWords_h
#define DynamicCoronary_TextWords_h

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace coronary
{
/// @throws std::runtime_error "'path': what."
[[noreturn]] void FormatError(const std::string& path, const std::string& what);

/// A word for a message, at most 40 bytes of it: what is in a damaged file may be anything.
std::string Quoted(std::string_view word);

/// With spaces for ends of lines.
std::string InOneLine(std::string text);

/// The next line of `text` from `position` on, without its end; moves `position` behind it.
std::string NextLine(const std::string& text, std::size_t& position);

std::string Trimmed(const std::string& text);
std::string LowerCase(std::string text);
bool EndsWith(std::string_view text, std::string_view end);
std::vector<std::string> Words(const std::string& text);

/// The whole of `text` as one number, which may have a plus; false when it is none.
template <typename Value>
bool ParseNumber(std::string_view text, Value& value)
{
  // from_chars knows no leading plus.
  text.remove_prefix(!text.empty() && text.front() == '+' ? 1 : 0);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// Appends a number such that reading gives the same bits.
template <typename Value>
void AppendNumber(std::string& text, Value value)
{
  char digits[40];
  const auto [end, error] = std::to_chars(std::begin(digits), std::end(digits), value);
  text.append(digits, error == std::errc() ? end : digits);
}

/// Appends numbers in the same way, with something between them.
template <typename Values>
void AppendNumbers(std::string& text, const Values& values, const char* between = " ")
{
  const char* before = "";
  for (const auto value : values)
  {
    AppendNumber(text += before, value);
    before = between;
  }
}

/// `text` as exactly `count` finite numbers. @throws naming path and key
std::vector<double> ParseNumbers(
  const std::string& text, std::size_t count, const std::string& path, const std::string& key);

/// The same for whole numbers from `low` to 2^31 - 1.
std::vector<int> ParseIntegers(const std::string& text, std::size_t count, int low,
  const std::string& path, const std::string& key);
}

#endif
