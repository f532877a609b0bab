/**
 * @file XmlText.h
 * @brief XML: the elements of a text, and values for one.
 */
#ifndef DynamicCoronary_XmlText_h
#define DynamicCoronary_XmlText_h

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace coronary
{
/// The begin of an element. Its functions throw std::runtime_error naming the file, the line, the element and what is wrong.
struct XmlElement
{
  std::string path; ///< names of the elements that are open, this one the last: "path/timestep"
  std::map<std::string, std::string> attributes; ///< UTF-8
  std::size_t begin = 0;                         ///< of the start tag: byte of the text
  std::size_t end = 0;                           ///< behind the start tag
  std::string_view text;                         ///< all of it
  std::string file;                              ///< for messages

  bool Is(std::string_view at) const { return this->path == at; }
  std::string_view Name() const;
  std::string_view Parent() const; ///< name of the element around it; empty for the root

  std::string String(const char* attribute) const;   ///< empty when it is missing
  std::string Required(const char* attribute) const; ///< throws when it is missing
  double Number(const char* attribute) const; ///< throws when it is missing or no finite number
  int Integer(const char* attribute) const;   ///< 0 when it is missing; at most 1e9 in size

  [[noreturn]] void Fail(const std::string& what) const;
};

/**
 * Calls `use` for each element, in the order of the text. A second root after the first one is read too: older files of
 * SimVascular have two. A document type, which may define entities that multiply, is refused, and so are elements that are
 * nested more than 32 times.
 * @param file  for messages
 * @param last  name of the element that is used last: the bytes behind its start tag may be any
 * @throws std::runtime_error naming the file and the line; and what `use` throws
 */
void ReadXml(const std::string& text, const std::string& file,
  const std::function<void(const XmlElement&)>& use, const char* last = "");

/// A text as the value of an attribute. Control characters that XML does not have become spaces.
std::string EscapedXml(std::string_view text);
}

#endif
