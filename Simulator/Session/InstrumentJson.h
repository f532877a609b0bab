/**
 * @file InstrumentJson.h
 * @brief One instrument from and to JSON, for catalogues and scenarios.
 */
#ifndef DynamicCoronary_InstrumentJson_h
#define DynamicCoronary_InstrumentJson_h

#include "InstrumentCatalogue.h"

#include <nlohmann/json.hpp>

#include <string>

namespace coronary
{
///@{
/**
 * @param where  for messages, in front of the instrument's name: "'file.json'"
 * @throws std::invalid_argument naming instrument, section and property
 * An object with sections is a microcatheter to BalloonFromJson, too.
 */
CatalogueWire WireFromJson(const nlohmann::json& object, const std::string& where);
CatalogueCatheter CatheterFromJson(const nlohmann::json& object, const std::string& where);
CatalogueBalloon BalloonFromJson(const nlohmann::json& object, const std::string& where);
CatalogueBalloon MicrocatheterFromJson(const nlohmann::json& object, const std::string& where);
///@}

///@{
/// Values only; reading it gives the same bits.
nlohmann::json WireToJson(const Guidewire& wire);
nlohmann::json CatheterToJson(const GuideCatheter& catheter);
nlohmann::json BalloonToJson(const BalloonCatheter& balloon);
///@}
}

#endif
