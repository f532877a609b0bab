#include "AppendedXmlData.h"

#include "Base64.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace coronary
{
namespace
{
using View = std::string_view;

/// The value of an attribute of a start tag, with its place; empty and `npos` when it is missing.
struct Attribute
{
  View value;
  std::size_t begin = View::npos; ///< of the name
  std::size_t end = View::npos;   ///< behind the closing quote
};

Attribute FindAttribute(View tag, View name)
{
  const auto isSpace = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
  for (std::size_t at = tag.find(name); at != View::npos; at = tag.find(name, at + 1))
  {
    const std::size_t equals = at + name.size();
    if (at == 0 || !isSpace(tag[at - 1]) || equals + 1 >= tag.size() || tag[equals] != '=')
    {
      continue;
    }
    const char quote = tag[equals + 1];
    const std::size_t close = tag.find(quote, equals + 2);
    if ((quote == '"' || quote == '\'') && close != View::npos)
    {
      return { tag.substr(equals + 2, close - equals - 2), at, close + 1 };
    }
  }
  return {};
}

std::optional<std::size_t> Number(View digits)
{
  std::size_t value = 0;
  for (const char c : digits)
  {
    if (c < '0' || c > '9' || value > (SIZE_MAX - 9) / 10)
    {
      return {};
    }
    value = 10 * value + static_cast<std::size_t>(c - '0');
  }
  return digits.empty() ? std::nullopt : std::optional(value);
}

/// How the binary data of a file are laid out.
struct Layout
{
  bool raw = false;
  bool compressed = false;
  bool bigEndian = false;
  std::size_t headerBytes = 4;
};

/// One array of raw appended data in base64, as it is written inline.
class RawArray
{
public:
  RawArray(View data, const Layout& layout)
    : Data(data)
    , How(layout)
  {
  }

  std::optional<std::string> Encode() const
  {
    const std::optional<std::size_t> first = this->Header(0);
    if (!first)
    {
      return {};
    }
    if (!this->How.compressed)
    {
      if (*first > this->Data.size() - this->How.headerBytes)
      {
        return {};
      }
      return Base64(this->Data.substr(0, this->How.headerBytes + *first));
    }
    // Number of blocks, size of a block, size of the last one, then the compressed sizes.
    const std::size_t blocks = *first;
    if (blocks > this->Data.size() / this->How.headerBytes)
    {
      return {};
    }
    const std::size_t head = this->How.headerBytes * (3 + blocks);
    std::size_t size = 0;
    for (std::size_t block = 0; block < blocks; ++block)
    {
      const std::optional<std::size_t> bytes = this->Header(3 + block);
      if (!bytes || *bytes > this->Data.size() - size)
      {
        return {};
      }
      size += *bytes;
    }
    if (blocks == 0)
    {
      return Base64(std::string(3 * this->How.headerBytes, '\0'));
    }
    if (head > this->Data.size() || size > this->Data.size() - head)
    {
      return {};
    }
    return Base64(this->Data.substr(0, head)) + Base64(this->Data.substr(head, size));
  }

private:
  std::optional<std::size_t> Header(std::size_t index) const
  {
    const std::size_t bytes = this->How.headerBytes;
    if (this->Data.size() / bytes <= index)
    {
      return {};
    }
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < bytes; ++k)
    {
      const std::size_t from = this->How.bigEndian ? k : bytes - 1 - k;
      value = value << 8 | static_cast<unsigned char>(this->Data[index * bytes + from]);
    }
    return static_cast<std::size_t>(value);
  }

  View Data;
  Layout How;
};

/// Base64 needs 4 characters for 3 bytes, and the names of an array's element stand twice.
constexpr std::size_t MostGrowth = 4;

struct Element
{
  std::size_t begin; ///< of the start tag
  std::size_t end;   ///< of the start tag
  std::size_t offset;
  bool empty; ///< no end tag follows, else there are elements inside and one
};
}

std::string WithInlineXmlData(std::string text)
{
  const View all = text;
  const std::size_t file = all.find("<VTKFile");
  const std::size_t appended = all.find("<AppendedData");
  if (file == View::npos || appended == View::npos || file > appended)
  {
    return text;
  }
  const auto tagAt = [all](std::size_t begin)
  { return all.substr(begin, std::min(all.find('>', begin), all.size() - 1) + 1 - begin); };
  const View fileTag = tagAt(file);
  const View appendedTag = tagAt(appended);
  Layout layout;
  layout.raw = FindAttribute(appendedTag, "encoding").value == "raw";
  layout.compressed = !FindAttribute(fileTag, "compressor").value.empty();
  layout.bigEndian = FindAttribute(fileTag, "byte_order").value == "BigEndian";
  layout.headerBytes = FindAttribute(fileTag, "header_type").value == "UInt64" ? 8 : 4;
  const std::size_t underscore = all.find('_', appended + appendedTag.size());
  const std::size_t close = all.rfind("</AppendedData>");
  if (underscore == View::npos || close == View::npos || close < underscore)
  {
    return text;
  }
  const View data = all.substr(underscore + 1, close - underscore - 1);

  std::vector<Element> elements;
  std::size_t behind = 0;
  for (std::size_t at = all.find('<', file); at < appended; at = all.find('<', behind))
  {
    const View tag = tagAt(at);
    behind = at + tag.size();
    if (FindAttribute(tag, "format").value != "appended")
    {
      continue;
    }
    const std::optional<std::size_t> offset = Number(FindAttribute(tag, "offset").value);
    if (!offset || *offset > data.size() || behind > appended)
    {
      return text;
    }
    elements.push_back({ at, behind, *offset, tag[tag.size() - 2] == '/' });
  }

  std::string result;
  result.reserve(layout.raw ? text.size() + text.size() / 2 : text.size());
  std::size_t copied = 0;
  for (const Element& element : elements)
  {
    const View tag = all.substr(element.begin, element.end - element.begin);
    const Attribute offset = FindAttribute(tag, "offset");
    const Attribute format = FindAttribute(tag, "format");
    std::string start(tag.substr(0, tag.size() - (element.empty ? 2 : 1)));
    // The later one first, so that the place of the earlier one stays right.
    const auto change = [&start](const Attribute& attribute, const char* by)
    { start.replace(attribute.begin, attribute.end - attribute.begin, by); };
    const bool offsetLast = offset.begin > format.begin;
    change(offsetLast ? offset : format, offsetLast ? "" : "format=\"binary\"");
    change(offsetLast ? format : offset, offsetLast ? "format=\"binary\"" : "");
    result += all.substr(copied, element.begin - copied);
    result += start + ">";
    if (layout.raw)
    {
      const std::optional<std::string> encoded =
        RawArray(data.substr(element.offset), layout).Encode();
      if (!encoded)
      {
        return text;
      }
      result += *encoded;
    }
    else
    {
      // To the next array, wherever that is described.
      std::size_t end = data.size();
      for (const Element& other : elements)
      {
        end = other.offset > element.offset ? std::min(end, other.offset) : end;
      }
      result += data.substr(element.offset, end - element.offset);
    }
    // Arrays that lie in each other: no writer makes those, and many of a large one would fill the memory.
    if (result.size() > MostGrowth * text.size())
    {
      return text;
    }
    if (element.empty)
    {
      result += "</";
      result += tag.substr(1, tag.find_first_of(" \t\r\n/") - 1);
      result += ">";
    }
    copied = element.end;
  }
  result += all.substr(copied, appended - copied);
  result += all.substr(close + View("</AppendedData>").size());
  return result;
}
}
