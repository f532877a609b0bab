/**
 * @file PlaceText.h
 * @brief A place as messages name it.
 */
#ifndef DynamicCoronary_PlaceText_h
#define DynamicCoronary_PlaceText_h

#include "Geometry.h"

#include <cstdio>
#include <string>

namespace coronary
{
/// "(1.0, -2.0, 3.0)", mm.
inline std::string PlaceText(const Vector3& place)
{
  char text[100];
  std::snprintf(text, sizeof(text), "(%.1f, %.1f, %.1f)", place[0], place[1], place[2]);
  return text;
}
}

#endif
