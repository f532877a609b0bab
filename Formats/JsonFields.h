/**
 * @file JsonFields.h
 * @brief Reading JSON of others: every message says where.
 */
#ifndef DynamicCoronary_JsonFields_h
#define DynamicCoronary_JsonFields_h

#include "BoundedJson.h"

#include <cstdint>
#include <set>
#include <string>

namespace coronary
{
/**
 * The members of one JSON object. Each is read once by its name and unit; Done() refuses what nobody read, so that
 * a name with a slip in it does not pass for an absent one.
 * All members throw std::invalid_argument with `where` and the member's name.
 */
class JsonFields
{
public:
  JsonFields(const nlohmann::json& object, std::string where);

  const std::string& Where() const { return this->Place; }
  bool Has(const char* name);
  double Number(const char* name, double low, double high);
  double Number(const char* name, double low, double high, double otherwise);
  std::int64_t Whole(const char* name, std::int64_t low, std::int64_t high, std::int64_t otherwise);
  bool Flag(const char* name, bool otherwise);
  std::string Text(const char* name);
  std::string Text(const char* name, const std::string& otherwise);
  const nlohmann::json& Object(const char* name);
  const nlohmann::json& List(const char* name);
  const nlohmann::json& Any(const char* name);
  /// Members 'format' and 'version' 1 of a file of ours. @param what  it is, for the message: "scenario"
  void RequireFormat(const char* format, const char* what);
  void Done() const;

  [[noreturn]] void Refuse(const std::string& what) const;

private:
  const nlohmann::json* Find(const char* name);

  const nlohmann::json& Members;
  std::string Place;
  std::set<std::string> Read;
};
}

#endif
