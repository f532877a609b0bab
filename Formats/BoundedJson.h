/**
 * @file BoundedJson.h
 * @brief JSON of others, of a depth that whatever walks over it can go into. Not installed.
 */
#ifndef DynamicCoronary_BoundedJson_h
#define DynamicCoronary_BoundedJson_h

#include "Geometry.h"

#include <nlohmann/json.hpp>

#include <stdexcept>
#include <string>

namespace coronary
{
constexpr int DeepestJson = 64;

/// What is wrong with a text, without the library's own number for it; not longer than a line.
inline std::string JsonReason(const std::exception& error)
{
  std::string reason = error.what();
  const std::size_t bracket = reason.find("] ");
  reason = bracket == std::string::npos ? reason : reason.substr(bracket + 2);
  return reason.size() > 160 ? reason.substr(0, 157) + "..." : reason;
}

/// @param where  for messages: the file's name in quotes
/// @throws std::runtime_error: no JSON, or nested more than DeepestJson times: copies and comparisons of it would overflow the
///   stack
template <typename Json = nlohmann::json>
Json ParseBoundedJson(const std::string& text, const std::string& where)
{
  try
  {
    return Json::parse(text,
      [&](int depth, typename Json::parse_event_t, Json&)
      {
        if (depth > DeepestJson)
        {
          throw std::runtime_error(
            where + " is nested more than " + std::to_string(DeepestJson) + " times.");
        }
        return true;
      });
  }
  catch (const typename Json::exception& error)
  {
    throw std::runtime_error(where + " is not JSON: " + JsonReason(error) + ".");
  }
}

///@{
/// Values out of JSON of others. @param file, place  for messages: the file's name, and what of it: "phases[3]"
/// @throws std::runtime_error naming both, and what is wrong
/// Of a member; empty: it is missing or null.
std::string TextIn(const nlohmann::ordered_json& object, const char* member,
  const std::string& file, const std::string& place);
double FiniteIn(
  const nlohmann::ordered_json& value, const std::string& file, const std::string& place);
/// The member `position`: a list of three numbers.
Vector3 PositionIn(
  const nlohmann::ordered_json& object, const std::string& file, const std::string& place);
///@}
}

#endif
