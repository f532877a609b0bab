#include "TextScanner.h"

#include "TextFile.h"
#include "TextWords.h"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
bool IsBlank(char c)
{
  return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v' || c == '\0';
}
}

TextScanner::TextScanner(const std::string& path)
  : Name(path)
  , Contents(ReadTextFile(path, "a mesh or table", std::numeric_limits<std::uint64_t>::max() - 1))
{
}

void TextScanner::SkipBlanks(bool overLines)
{
  while (this->At < this->Contents.size())
  {
    const char c = this->Contents[this->At];
    if (this->Comment != 0 && c == this->Comment)
    {
      const std::size_t end = this->Contents.find('\n', this->At);
      this->At = end == std::string::npos ? this->Contents.size() : end;
    }
    else if (c == '\n' && overLines)
    {
      ++this->Line;
      ++this->At;
    }
    else if (IsBlank(c))
    {
      ++this->At;
    }
    else
    {
      return;
    }
  }
}

bool TextScanner::AtEnd()
{
  this->SkipBlanks(true);
  return this->At == this->Contents.size();
}

bool TextScanner::AtLineEnd()
{
  this->SkipBlanks(false);
  return this->At == this->Contents.size() || this->Contents[this->At] == '\n';
}

void TextScanner::SkipLine()
{
  const std::size_t end = this->Contents.find('\n', this->At);
  this->At = end == std::string::npos ? this->Contents.size() : end;
}

void TextScanner::SkipCharacter()
{
  this->Line += this->Contents[this->At] == '\n' ? 1 : 0;
  ++this->At;
}

std::string_view TextScanner::Word()
{
  if (this->AtEnd())
  {
    this->Fail("the file ends too early");
  }
  const std::size_t first = this->At;
  while (this->At < this->Contents.size() && this->Contents[this->At] != '\n' &&
    !IsBlank(this->Contents[this->At]))
  {
    ++this->At;
  }
  return std::string_view(this->Contents).substr(first, this->At - first);
}

double TextScanner::Number()
{
  const std::string_view word = this->Word();
  double value = 0.0;
  if (!ParseNumber(word, value))
  {
    this->Fail(Quoted(word) + " is no number");
  }
  return value;
}

Vector3 TextScanner::Point()
{
  Vector3 point;
  for (double& coordinate : point)
  {
    coordinate = this->Number();
    if (!std::isfinite(coordinate))
    {
      this->Fail("a coordinate is not finite");
    }
  }
  return point;
}

std::int64_t TextScanner::Integer()
{
  const std::string_view word = this->Word();
  std::int64_t value = 0;
  if (!ParseNumber(word, value))
  {
    this->Fail(Quoted(word) + " is no integer");
  }
  return value;
}

void TextScanner::Fail(const std::string& what) const
{
  throw std::runtime_error(
    "'" + this->Name + "', line " + std::to_string(this->Line) + ": " + what + ".");
}
}
