/**
 * @file WebFiles.h
 * @brief The review page's files in web/, compiled in.
 */
#ifndef DynamicCoronary_WebFiles_h
#define DynamicCoronary_WebFiles_h

namespace coronary
{
namespace web
{
extern const char* const Page;
extern const char* const Style;
extern const char* const Script;
}
}

#endif
