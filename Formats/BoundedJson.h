/**
 * @file BoundedJson.h
 * @brief JSON of others, of a depth that whatever walks over it can go into. Not installed.
 */
#ifndef DynamicCoronary_BoundedJson_h
#define DynamicCoronary_BoundedJson_h

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

/// Of JSON that is nested more than DeepestJson times: copies and comparisons of it would overflow the stack.
struct TooDeepJson : std::runtime_error
{
  TooDeepJson()
    : std::runtime_error("is nested more than " + std::to_string(DeepestJson) + " times")
  {
  }
};

/// @throws Json::exception: no JSON; TooDeepJson
template <typename Json = nlohmann::json>
Json ParseBoundedJson(const std::string& text)
{
  return Json::parse(text,
    [](int depth, typename Json::parse_event_t, Json&)
    {
      if (depth > DeepestJson)
      {
        throw TooDeepJson();
      }
      return true;
    });
}
}

#endif
