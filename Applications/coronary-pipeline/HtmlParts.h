/**
 * @file HtmlParts.h
 * @brief What the pages of an evaluation are put together with.
 */
#ifndef DynamicCoronary_HtmlParts_h
#define DynamicCoronary_HtmlParts_h

#include <string>

namespace coronary
{
/// A text as a part of HTML, of its attributes too: no character of it is markup.
std::string EscapedHtml(const std::string& text);
}

#endif
