#include "BoundedJson.h"

#include "TextWords.h"

#include <cmath>

namespace coronary
{
using Json = nlohmann::ordered_json;

std::string TextIn(
  const Json& object, const char* member, const std::string& file, const std::string& place)
{
  const auto found = object.find(member);
  if (found == object.end() || found->is_null())
  {
    return {};
  }
  if (!found->is_string())
  {
    FormatError(file, place + "." + member + " is not a text");
  }
  return found->get<std::string>();
}

double FiniteIn(const Json& value, const std::string& file, const std::string& place)
{
  if (!value.is_number() || !std::isfinite(value.get<double>()))
  {
    FormatError(file, place + " is not a finite number");
  }
  return value.get<double>();
}

Vector3 PositionIn(const Json& object, const std::string& file, const std::string& place)
{
  const auto found = object.find("position");
  if (found == object.end() || !found->is_array() || found->size() != 3)
  {
    FormatError(file, place + " is not a list of three numbers");
  }
  Vector3 position;
  for (int axis = 0; axis < 3; ++axis)
  {
    position[axis] = FiniteIn(
      (*found)[static_cast<std::size_t>(axis)], file, place + "[" + std::to_string(axis) + "]");
  }
  return position;
}
}
