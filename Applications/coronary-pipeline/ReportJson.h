/**
 * @file ReportJson.h
 * @brief Parts that reports have in common.
 */
#ifndef DynamicCoronary_ReportJson_h
#define DynamicCoronary_ReportJson_h

#include "Geometry.h"

#include <nlohmann/json.hpp>

#include <string>

namespace coronary
{
/// World coordinates, mm.
inline nlohmann::ordered_json PlaceOf(const Vector3& place)
{
  return { place[0], place[1], place[2] };
}

/// What an object has under a name; null without it, and of what is no object.
inline nlohmann::ordered_json Member(const nlohmann::ordered_json& object, const std::string& name)
{
  const auto found = object.is_object() ? object.find(name) : object.end();
  return object.is_object() && found != object.end() ? *found : nlohmann::ordered_json();
}
}

#endif
