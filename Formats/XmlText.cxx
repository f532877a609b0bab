#include "XmlText.h"

namespace coronary
{
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
}
