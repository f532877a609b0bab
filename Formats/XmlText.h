/**
 * @file XmlText.h
 * @brief Text for XML files.
 */
#ifndef DynamicCoronary_XmlText_h
#define DynamicCoronary_XmlText_h

#include <string>

namespace coronary
{
/// A text as the value of an attribute or the content of an element.
std::string EscapedXml(const std::string& text);
}

#endif
