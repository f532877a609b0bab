/**
 * @file XmlText.h
 * @brief Text for XML files, and out of them.
 */
#ifndef DynamicCoronary_XmlText_h
#define DynamicCoronary_XmlText_h

#include <string>

namespace coronary
{
/// A text as the value of an attribute or the content of an element.
std::string EscapedXml(const std::string& text);

/// What the value of an attribute says (XML 1.0, 3.3.3 and 4.1): references as characters (UTF-8), tabs and ends of lines as
/// spaces, also those by reference: such values are names and numbers here.
/// \throws std::runtime_error for a reference to an entity that XML does not define, or to no character
std::string UnescapedXml(const std::string& value);
}

#endif
