#include "XmlDataFile.h"

#include "Base64.h"
#include "ByteOrder.h"
#include "TextWords.h"
#include "XmlText.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

namespace coronary
{
namespace
{
using View = std::string_view;

constexpr double Packing = 800.0;
/// Base64 needs 4 characters for 3 bytes, and the names of an array's element stand twice.
constexpr std::size_t MostGrowth = 4;
constexpr const char* Counts[] = { "NumberOfPoints", "NumberOfCells", "NumberOfVerts",
  "NumberOfLines", "NumberOfStrips", "NumberOfPolys", "NumberOfTuples", "NumberOfComponents" };

/// How the binary data of a file are laid out.
struct Layout
{
  bool raw = false;
  bool compressed = false;
  bool bigEndian = false;
  std::size_t headerBytes = 4;
};

/// What the numbers of the elements add up to.
class ClaimCheck
{
public:
  void Add(const XmlElement& element, bool compressed)
  {
    this->Most = static_cast<double>(element.text.size()) * (compressed ? Packing : 1.0);
    if (element.Name() == "Piece")
    {
      this->Points = this->Cells = 0.0;
    }
    const View around = element.Parent();
    double components = 1.0;
    double tuples = around == "Points" || around == "PointData" ? this->Points
      : around == "CellData"                                    ? this->Cells
                                                                : 0.0;
    for (const char* count : Counts)
    {
      if (element.attributes.count(count) == 0)
      {
        continue;
      }
      const double number = element.Number(count);
      if (number < 0.0 || number != std::floor(number))
      {
        element.Fail("has a " + std::string(count) + " that is no number of things");
      }
      const View name = count;
      if (name == "NumberOfComponents")
      {
        components = number;
      }
      else if (name == "NumberOfTuples")
      {
        tuples = number;
      }
      else if (name == "NumberOfPoints")
      {
        this->Points = number;
        this->AllPoints += number;
      }
      else
      {
        this->Cells += number;
        this->AllCells += number;
      }
      this->Require(element, number, count);
      this->Require(element, this->AllPoints, "points");
      this->Require(element, this->AllCells, "cells");
    }
    this->Require(element, components * tuples, "values in an array");
  }

private:
  void Require(const XmlElement& element, double number, const char* what) const
  {
    if (number > this->Most)
    {
      element.Fail("says more than it can hold: " +
        std::to_string(static_cast<std::int64_t>(std::min(number, 9e18))) + " " + what + " in " +
        std::to_string(element.text.size()) + " bytes");
    }
  }

  double Most = 0.0;
  double Points = 0.0; ///< of the piece
  double Cells = 0.0;
  double AllPoints = 0.0;
  double AllCells = 0.0;
};

/// The array at the begin of raw appended data as it is written inline; nothing when it is not whole.
std::optional<std::string> EncodedArray(View data, const Layout& layout)
{
  const std::size_t bytes = layout.headerBytes;
  const auto header = [&](std::size_t index) -> std::optional<std::size_t>
  {
    if (data.size() / bytes <= index)
    {
      return {};
    }
    const char* at = data.data() + index * bytes;
    return bytes == 8 ? NumberAt<std::uint64_t>(at, layout.bigEndian)
                      : NumberAt<std::uint32_t>(at, layout.bigEndian);
  };
  const std::optional<std::size_t> first = header(0);
  if (!first)
  {
    return {};
  }
  if (!layout.compressed)
  {
    return *first > data.size() - bytes ? std::nullopt
                                        : std::optional(Base64(data.substr(0, bytes + *first)));
  }
  // Number of blocks, size of a block, size of the last one, then the compressed sizes.
  const std::size_t blocks = *first;
  if (blocks == 0)
  {
    return Base64(std::string(3 * bytes, '\0'));
  }
  if (blocks > data.size() / bytes)
  {
    return {};
  }
  const std::size_t head = bytes * (3 + blocks);
  std::size_t size = 0;
  for (std::size_t block = 0; block < blocks; ++block)
  {
    const std::optional<std::size_t> packed = header(3 + block);
    if (!packed || *packed > data.size() - size)
    {
      return {};
    }
    size += *packed;
  }
  if (head > data.size() || size > data.size() - head)
  {
    return {};
  }
  return Base64(data.substr(0, head)) + Base64(data.substr(head, size));
}

std::optional<std::size_t> Offset(const XmlElement& element)
{
  std::size_t value = 0;
  return ParseNumber(element.String("offset"), value) ? std::optional(value) : std::nullopt;
}

/// The text with its appended data in the elements of the arrays; nothing when they are not understood.
std::optional<std::string> WithInlineData(View text, const std::vector<XmlElement>& arrays,
  const XmlElement& appended, const Layout& layout)
{
  const View closing = "</AppendedData>";
  const std::size_t underscore = text.find('_', appended.end);
  const std::size_t close = text.rfind(closing);
  if (underscore == View::npos || close == View::npos || close < underscore)
  {
    return {};
  }
  const View data = text.substr(underscore + 1, close - underscore - 1);
  std::set<std::size_t> offsets{ data.size() };
  for (const XmlElement& array : arrays)
  {
    const std::optional<std::size_t> offset = Offset(array);
    if (!offset || *offset > data.size())
    {
      return {};
    }
    offsets.insert(*offset);
  }
  std::string result;
  result.reserve(layout.raw ? text.size() + text.size() / 2 : text.size());
  std::size_t copied = 0;
  for (const XmlElement& array : arrays)
  {
    result += text.substr(copied, array.begin - copied);
    result.append("<").append(array.Name());
    for (const auto& [name, value] : array.attributes)
    {
      if (name != "offset")
      {
        result += " " + name + "=\"" + (name == "format" ? "binary" : EscapedXml(value)) + "\"";
      }
    }
    result += ">";
    const std::size_t offset = *Offset(array);
    if (layout.raw)
    {
      const std::optional<std::string> encoded = EncodedArray(data.substr(offset), layout);
      if (!encoded)
      {
        return {};
      }
      result += *encoded;
    }
    else
    {
      // To the next array, wherever that is described.
      const auto next = offsets.upper_bound(offset);
      result += data.substr(offset, (next == offsets.end() ? data.size() : *next) - offset);
    }
    // Arrays that lie in each other: no writer makes those, and many of a large one would fill the memory.
    if (result.size() > MostGrowth * text.size())
    {
      return {};
    }
    if (text[array.end - 2] == '/')
    {
      result.append("</").append(array.Name()).append(">");
    }
    copied = array.end;
  }
  result += text.substr(copied, appended.begin - copied);
  result += text.substr(close + closing.size());
  return result;
}
}

std::string ReadableXmlData(std::string text, const std::string& file)
{
  Layout layout;
  ClaimCheck claims;
  std::vector<XmlElement> arrays;
  std::optional<XmlElement> appended;
  ReadXml(
    text, file,
    [&](const XmlElement& element)
    {
      if (element.Is("VTKFile"))
      {
        layout.compressed = !element.String("compressor").empty();
        layout.bigEndian = element.String("byte_order") == "BigEndian";
        layout.headerBytes = element.String("header_type") == "UInt64" ? 8 : 4;
      }
      else if (element.Name() == "AppendedData")
      {
        layout.raw = element.String("encoding") == "raw";
        appended = element;
      }
      else if (element.String("format") == "appended")
      {
        arrays.push_back(element);
      }
      claims.Add(element, layout.compressed);
    },
    "AppendedData");
  if (appended && appended->Is("VTKFile/AppendedData"))
  {
    if (std::optional<std::string> inlined = WithInlineData(text, arrays, *appended, layout))
    {
      return std::move(*inlined);
    }
  }
  return text;
}
}
