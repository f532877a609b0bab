#include "JsonFields.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
std::string Shortened(const nlohmann::json& value)
{
  std::string text = value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (text.size() > 60)
  {
    text = text.substr(0, 57) + "...";
  }
  return text;
}

std::string RangeText(double low, double high)
{
  char text[80];
  std::snprintf(text, sizeof(text), "a number from %g to %g", low, high);
  return text;
}
}

JsonFields::JsonFields(const nlohmann::json& object, std::string where)
  : Members(object)
  , Place(std::move(where))
{
  if (!object.is_object())
  {
    this->Refuse("is " + Shortened(object) + " and no object");
  }
}

void JsonFields::Refuse(const std::string& what) const
{
  throw std::invalid_argument(this->Place + " " + what + ".");
}

const nlohmann::json* JsonFields::Find(const char* name)
{
  this->Read.insert(name);
  const auto found = this->Members.find(name);
  return found == this->Members.end() ? nullptr : &*found;
}

bool JsonFields::Has(const char* name)
{
  return this->Members.find(name) != this->Members.end();
}

const nlohmann::json& JsonFields::Any(const char* name)
{
  const nlohmann::json* value = this->Find(name);
  if (!value)
  {
    this->Refuse(std::string("has no '") + name + "'");
  }
  return *value;
}

double JsonFields::Number(const char* name, double low, double high)
{
  const nlohmann::json& value = this->Any(name);
  const double number = value.is_number() ? value.get<double>() : std::nan("");
  if (!(number >= low && number <= high))
  {
    const bool negative = number < 0.0 && low >= 0.0;
    this->Refuse(std::string("has ") + (negative ? "a negative '" : "'") + name +
      "': " + Shortened(value) + " is not " + RangeText(low, high));
  }
  return number;
}

double JsonFields::Number(const char* name, double low, double high, double otherwise)
{
  return this->Has(name) ? this->Number(name, low, high) : otherwise;
}

std::int64_t JsonFields::Whole(
  const char* name, std::int64_t low, std::int64_t high, std::int64_t otherwise)
{
  if (!this->Has(name))
  {
    return otherwise;
  }
  const nlohmann::json& value = this->Any(name);
  // get<> of an unsigned number beyond the signed ones would wrap.
  const bool fits = value.is_number_integer() &&
    !(value.is_number_unsigned() &&
      value.get<std::uint64_t>() > static_cast<std::uint64_t>(INT64_MAX));
  const std::int64_t number = fits ? value.get<std::int64_t>() : 0;
  if (!fits || number < low || number > high)
  {
    this->Refuse(std::string("has '") + name + "': " + Shortened(value) +
      " is not a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  }
  return number;
}

bool JsonFields::Flag(const char* name, bool otherwise)
{
  const nlohmann::json* value = this->Find(name);
  if (value && !value->is_boolean())
  {
    this->Refuse(std::string("has '") + name + "': " + Shortened(*value) + " is not true or false");
  }
  return value ? value->get<bool>() : otherwise;
}

std::string JsonFields::Text(const char* name)
{
  const nlohmann::json& value = this->Any(name);
  if (!value.is_string())
  {
    this->Refuse(std::string("has '") + name + "': " + Shortened(value) + " is no text");
  }
  return value.get<std::string>();
}

std::string JsonFields::Text(const char* name, const std::string& otherwise)
{
  return this->Has(name) ? this->Text(name) : otherwise;
}

const nlohmann::json& JsonFields::Object(const char* name)
{
  const nlohmann::json& value = this->Any(name);
  if (!value.is_object())
  {
    this->Refuse(std::string("has '") + name + "': " + Shortened(value) + " is no object");
  }
  return value;
}

const nlohmann::json& JsonFields::List(const char* name)
{
  const nlohmann::json& value = this->Any(name);
  if (!value.is_array())
  {
    this->Refuse(std::string("has '") + name + "': " + Shortened(value) + " is no list");
  }
  return value;
}

void JsonFields::RequireFormat(const char* format, const char* what)
{
  if (this->Text("format") != format)
  {
    this->Refuse(std::string("is no ") + what + ": its 'format' is another one");
  }
  if (this->Whole("version", 0, INT32_MAX, 0) != 1)
  {
    this->Refuse("has another 'version' than 1, the only one that is known");
  }
}

void JsonFields::Done() const
{
  for (const auto& member : this->Members.items())
  {
    if (this->Read.count(member.key()) == 0)
    {
      this->Refuse("has '" + member.key().substr(0, 60) + "', which means nothing there");
    }
  }
}
}
