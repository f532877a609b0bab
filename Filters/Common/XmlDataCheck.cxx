#include "XmlDataCheck.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace coronary
{
namespace
{
using View = std::string_view;

constexpr std::size_t Deepest = 32; // VTK's own files have 7
constexpr double Packing = 800.0;
constexpr View Counts[] = { "NumberOfPoints", "NumberOfCells", "NumberOfVerts", "NumberOfLines",
  "NumberOfStrips", "NumberOfPolys", "NumberOfTuples", "NumberOfComponents" };

[[noreturn]] void Refuse(const std::string& what)
{
  throw std::runtime_error(what);
}

bool IsBlank(char c)
{
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

/// Where the tag ends that begins at `at`: at its '>', which is in no quotes.
std::size_t EndOfTag(View text, std::size_t at)
{
  char quote = 0;
  for (; at < text.size(); ++at)
  {
    const char c = text[at];
    if (quote != 0)
    {
      quote = c == quote ? 0 : quote;
    }
    else if (c == '"' || c == '\'')
    {
      quote = c;
    }
    else if (c == '>')
    {
      return at;
    }
  }
  Refuse("ends within a tag");
}

/// Calls use(name, value) for each attribute of a tag.
template <typename Use>
void ForAttributes(View tag, const Use& use)
{
  std::size_t at = 0;
  while ((at = tag.find('=', at)) != View::npos)
  {
    std::size_t end = at;
    while (end > 0 && IsBlank(tag[end - 1]))
    {
      --end;
    }
    std::size_t begin = end;
    while (begin > 0 && !IsBlank(tag[begin - 1]))
    {
      --begin;
    }
    const std::size_t open = tag.find_first_of("\"'", at);
    const std::size_t close = open == View::npos ? open : tag.find(tag[open], open + 1);
    if (close == View::npos)
    {
      return;
    }
    use(tag.substr(begin, end - begin), tag.substr(open + 1, close - open - 1));
    at = close + 1;
  }
}

View NameOf(View tag)
{
  const std::size_t end = std::min(tag.find_first_of(" \t\r\n/"), tag.size());
  return tag.substr(0, end);
}

class Checker
{
public:
  explicit Checker(View text)
    : Text(text)
    , Most(
        static_cast<double>(text.size()) * (text.find("compressor") != View::npos ? Packing : 1.0))
  {
  }

  void Check()
  {
    std::size_t at = 0;
    while ((at = this->Text.find('<', at)) != View::npos)
    {
      if (this->Text.compare(at, 4, "<!--") == 0)
      {
        const std::size_t end = this->Text.find("-->", at);
        at = end == View::npos ? this->Text.size() : end;
        continue;
      }
      if (this->Text.compare(at, 2, "<!") == 0)
      {
        Refuse("has a document type or entities, which no VTK file has");
      }
      const std::size_t end = EndOfTag(this->Text, at);
      const View tag = this->Text.substr(at + 1, end - at - 1);
      if (NameOf(tag) == "AppendedData")
      {
        return; // what follows may be any bytes
      }
      this->Tag(tag);
      at = end;
    }
  }

private:
  struct ArraySize
  {
    double components;
    double tuples;
  };

  void Tag(View tag)
  {
    if (tag.empty() || tag.front() == '?')
    {
      return;
    }
    if (tag.front() == '/')
    {
      if (!this->Open.empty())
      {
        this->Open.pop_back();
      }
      return;
    }
    if (NameOf(tag) == "Piece")
    {
      this->Points = this->Cells = 0.0;
    }
    ArraySize size{ 1.0, this->Tuples() };
    ForAttributes(tag, [&](View name, View value) { this->Attribute(name, value, size); });
    this->CheckTotal(size.components * size.tuples, "values in an array");
    if (tag.back() != '/')
    {
      this->Open.push_back(NameOf(tag));
      if (this->Open.size() > Deepest)
      {
        Refuse("is nested more than " + std::to_string(Deepest) + " times");
      }
    }
  }

  void Attribute(View name, View value, ArraySize& size)
  {
    if (std::find(std::begin(Counts), std::end(Counts), name) == std::end(Counts))
    {
      return;
    }
    while (!value.empty() && IsBlank(value.front()))
    {
      value.remove_prefix(1);
    }
    while (!value.empty() && IsBlank(value.back()))
    {
      value.remove_suffix(1);
    }
    std::int64_t count = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), count);
    if (error != std::errc() || end != value.data() + value.size() || count < 0)
    {
      Refuse("has a " + std::string(name) + " that is no number of things");
    }
    const auto number = static_cast<double>(count);
    if (name == "NumberOfComponents")
    {
      size.components = number;
    }
    else if (name == "NumberOfTuples")
    {
      size.tuples = number;
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
    this->CheckTotal(number, name);
    this->CheckTotal(this->AllPoints, "points");
    this->CheckTotal(this->AllCells, "cells");
  }

  /// Tuples of an array where the tag stands.
  double Tuples() const
  {
    if (this->Open.empty())
    {
      return 0.0;
    }
    const View around = this->Open.back();
    return around == "Points" || around == "PointData" ? this->Points
      : around == "CellData"                           ? this->Cells
                                                       : 0.0;
  }

  void CheckTotal(double number, View what) const
  {
    if (number > this->Most)
    {
      Refuse("says more than it can hold: " +
        std::to_string(static_cast<std::int64_t>(std::min(number, 9e18))) + " " +
        std::string(what) + " in " + std::to_string(this->Text.size()) + " bytes");
    }
  }

  View Text;
  double Most;
  std::vector<View> Open; ///< elements around the place
  double Points = 0.0;    ///< of the piece
  double Cells = 0.0;
  double AllPoints = 0.0;
  double AllCells = 0.0;
};
}

void CheckXmlData(const std::string& text)
{
  Checker(text).Check();
}
}
