/**
 * @file EmbeddedFiles.h
 * @brief Files of Simulator/Session that are compiled in; the source is made by CMake.
 */
#ifndef DynamicCoronary_EmbeddedFiles_h
#define DynamicCoronary_EmbeddedFiles_h

namespace coronary
{
namespace embedded
{
struct NamedText
{
  const char* name;
  const char* text;
};

extern const char* const Instruments;    ///< instruments.json
extern const NamedText* const Scenarios; ///< scenarios/*.json by name, the last one has no name
}
}

#endif
