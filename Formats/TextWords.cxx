#include "TextWords.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
void FormatError(const std::string& path, const std::string& what)
{
  throw std::runtime_error("'" + path + "': " + what + ".");
}

std::string Quoted(std::string_view word)
{
  std::string shown;
  for (const char c : word.substr(0, 40))
  {
    shown += c >= ' ' && c <= '~' ? c : '?';
  }
  return "'" + shown + (word.size() > 40 ? "..'" : "'");
}

std::string InOneLine(std::string text)
{
  std::replace_if(
    text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

bool EndsWith(std::string_view text, std::string_view end)
{
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

std::string NextLine(const std::string& text, std::size_t& position)
{
  const std::size_t end = std::min(text.find('\n', position), text.size());
  std::string line = text.substr(position, end - position);
  position = std::min(end + 1, text.size());
  if (!line.empty() && line.back() == '\r')
  {
    line.pop_back();
  }
  return line;
}

std::string Trimmed(const std::string& text)
{
  const char* const blanks = " \t\r\n\f\v";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string::npos)
  {
    return {};
  }
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string LowerCase(std::string text)
{
  for (char& c : text)
  {
    c = (c >= 'A' && c <= 'Z') ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return text;
}

std::vector<std::string> Words(const std::string& text)
{
  std::vector<std::string> words;
  std::size_t position = 0;
  for (;;)
  {
    const std::size_t first = text.find_first_not_of(" \t\r\n", position);
    if (first == std::string::npos)
    {
      return words;
    }
    position = std::min(text.find_first_of(" \t\r\n", first), text.size());
    words.push_back(text.substr(first, position - first));
  }
}

std::vector<double> ParseNumbers(
  const std::string& text, std::size_t count, const std::string& path, const std::string& key)
{
  std::vector<double> values;
  for (const std::string& word : Words(text))
  {
    double value = 0.0;
    if (!ParseNumber(word, value) || !std::isfinite(value))
    {
      FormatError(path, key + " holds '" + word.substr(0, 32) + "', which is not a finite number");
    }
    values.push_back(value);
  }
  if (values.size() != count)
  {
    FormatError(path,
      key + " has " + std::to_string(values.size()) + " values instead of " +
        std::to_string(count));
  }
  return values;
}

std::vector<int> ParseIntegers(const std::string& text, std::size_t count, int low,
  const std::string& path, const std::string& key)
{
  std::vector<int> result;
  for (const double value : ParseNumbers(text, count, path, key))
  {
    if (value != std::rint(value) || value < low || value > std::numeric_limits<int>::max())
    {
      FormatError(path, key + " is out of range");
    }
    result.push_back(static_cast<int>(value));
  }
  return result;
}
}
