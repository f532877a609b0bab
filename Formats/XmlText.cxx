#include "XmlText.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
/// The number of "#65" or "#x41", or 0: a control character, a surrogate, or no number.
std::uint32_t CharacterOf(const std::string& reference)
{
  const bool hexadecimal = reference.compare(0, 2, "#x") == 0;
  const std::size_t first = hexadecimal ? 2 : 1;
  constexpr std::size_t MostDigits = 8;
  if (reference.size() <= first || reference.size() > first + MostDigits ||
    reference.find_first_not_of(hexadecimal ? "0123456789abcdefABCDEF" : "0123456789", first) !=
      std::string::npos)
  {
    return 0;
  }
  const unsigned long number = std::stoul(reference.substr(first), nullptr, hexadecimal ? 16 : 10);
  if (number == '\t' || number == '\n' || number == '\r')
  {
    return ' ';
  }
  const bool character =
    number >= 0x20 && number <= 0x10FFFF && !(number >= 0xD800 && number <= 0xDFFF);
  return character ? static_cast<std::uint32_t>(number) : 0;
}

void AppendUtf8(std::string& text, std::uint32_t character)
{
  const auto part = [&](std::uint32_t lead, int shift, std::uint32_t mask)
  { text += static_cast<char>(lead | ((character >> shift) & mask)); };
  if (character < 0x80)
  {
    part(0, 0, 0x7F);
    return;
  }
  if (character < 0x800)
  {
    part(0xC0, 6, 0x1F);
  }
  else if (character < 0x10000)
  {
    part(0xE0, 12, 0x0F);
    part(0x80, 6, 0x3F);
  }
  else
  {
    part(0xF0, 18, 0x07);
    part(0x80, 12, 0x3F);
    part(0x80, 6, 0x3F);
  }
  part(0x80, 0, 0x3F);
}

std::uint32_t Referenced(const std::string& reference)
{
  constexpr std::pair<const char*, char> Entities[] = { { "lt", '<' }, { "gt", '>' },
    { "quot", '"' }, { "apos", '\'' }, { "amp", '&' } };
  for (const auto& [name, character] : Entities)
  {
    if (reference == name)
    {
      return static_cast<unsigned char>(character);
    }
  }
  return !reference.empty() && reference[0] == '#' ? CharacterOf(reference) : 0;
}
}

std::string EscapedXml(const std::string& text)
{
  std::string result;
  for (const char c : text)
  {
    result += c == '&' ? "&amp;"
      : c == '<'       ? "&lt;"
      : c == '>'       ? "&gt;"
      : c == '"'       ? "&quot;"
                       : std::string(1, c);
  }
  return result;
}

std::string UnescapedXml(const std::string& value)
{
  std::string result;
  for (std::size_t at = 0; at < value.size(); ++at)
  {
    if (value[at] == '\t' || value[at] == '\n' || value[at] == '\r')
    {
      result += ' ';
      continue;
    }
    if (value[at] != '&')
    {
      result += value[at];
      continue;
    }
    const std::size_t end = std::min(value.find(';', at), value.size());
    const std::uint32_t character = Referenced(value.substr(at + 1, end - at - 1));
    if (end == value.size() || character == 0)
    {
      throw std::runtime_error("a value has a reference ('&') that is not one of XML");
    }
    AppendUtf8(result, character);
    at = end;
  }
  return result;
}
}
