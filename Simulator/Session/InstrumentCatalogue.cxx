#include "InstrumentCatalogue.h"

#include "EmbeddedFiles.h"
#include "InstrumentJson.h"
#include "JsonFields.h"
#include "Numbers.h"
#include "TextFile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace coronary
{
namespace
{
using Json = nlohmann::json;

constexpr double GramForce = 9.80665e-3; // N
constexpr double Any = std::numeric_limits<double>::max();
constexpr double CorePoisson = 0.3;
constexpr double JacketPoisson = 0.45;
constexpr std::size_t MostInstruments = 1000;

ValueSources SourcesOf(JsonFields& fields)
{
  ValueSources sources;
  if (fields.Has("sources"))
  {
    JsonFields texts(fields.Object("sources"), fields.Where() + ", sources");
    for (const auto& entry : fields.Object("sources").items())
    {
      sources[entry.key()] = texts.Text(entry.key().c_str());
    }
  }
  return sources;
}

WireCore CoreOf(JsonFields& section)
{
  WireCore core;
  if (!section.Has("core"))
  {
    return core;
  }
  JsonFields fields(section.Object("core"), section.Where() + ", core");
  if (fields.Has("ribbon_mm"))
  {
    const Json& sides = fields.List("ribbon_mm");
    if (sides.size() != 2 || !sides[0].is_number() || !sides[1].is_number() ||
      !(sides[1].get<double>() > 0.0) || !(sides[0].get<double>() >= sides[1].get<double>()))
    {
      fields.Refuse("has 'ribbon_mm' that is not [width, thickness]");
    }
    core.ribbonWidth = sides[0].get<double>();
    core.ribbonThickness = sides[1].get<double>();
  }
  else
  {
    core.diameter = fields.Number("diameter_mm", 1e-3, 2.0);
  }
  core.modulus = 1e3 * fields.Number("modulus_GPa", 1e-3, 1000.0);
  core.jacketModulus = fields.Number("jacket_modulus_MPa", 0.0, 1e5, 0.0);
  fields.Done();
  return core;
}

/// Ranges are those of Guidewire::Validate; here the sign is what a slip gets wrong.
WireSection SectionOf(JsonFields& fields)
{
  WireSection section;
  section.length = fields.Number("length_mm", 0.0, Any);
  const Json& bending = fields.Any("bending_stiffness_N_mm2");
  if (bending.is_array())
  {
    const bool numbers = bending.size() == 2 && bending[0].is_number() && bending[1].is_number();
    if (!numbers)
    {
      fields.Refuse("has 'bending_stiffness_N_mm2' that is neither a number nor two");
    }
    section.bendingStiffness1 = bending[0].get<double>();
    section.bendingStiffness2 = bending[1].get<double>();
    if (!(section.bendingStiffness1 >= 0.0 && section.bendingStiffness2 >= 0.0))
    {
      fields.Refuse("has a negative 'bending_stiffness_N_mm2': " + bending.dump());
    }
  }
  else
  {
    section.bendingStiffness1 = fields.Number("bending_stiffness_N_mm2", 0.0, Any);
    section.bendingStiffness2 = section.bendingStiffness1;
  }
  section.torsionalStiffness = fields.Number("torsional_stiffness_N_mm2", 0.0, Any);
  section.axialStiffness = fields.Number("axial_stiffness_N", 0.0, Any);
  section.radius = 0.5 * fields.Number("diameter_mm", 0.0, Any);
  section.density = fields.Number("density_kg_m3", 0.0, Any);
  section.friction = fields.Number("friction", 0.0, Any);
  section.restCurvature = fields.Number("rest_curvature_per_mm", -Any, Any, 0.0);
  return section;
}

/// A number of a balloon, or of the stent on it, in its file: diameters there may be radii here.
template <typename Device>
struct DeviceNumber
{
  const char* name;
  double Device::*value;
  double scale;
};
constexpr DeviceNumber<BalloonCatheter> BalloonNumbers[] = {
  { "length_mm", &BalloonCatheter::length, 1.0 }, { "tip_mm", &BalloonCatheter::tipLength, 1.0 },
  { "shoulder_mm", &BalloonCatheter::shoulder, 1.0 },
  { "tip_diameter_mm", &BalloonCatheter::tipRadius, 0.5 },
  { "crossing_profile_mm", &BalloonCatheter::crossingRadius, 0.5 },
  { "shaft_diameter_mm", &BalloonCatheter::shaftRadius, 0.5 },
  { "monorail_mm", &BalloonCatheter::monorail, 1.0 },
  { "marker_mm", &BalloonCatheter::markerLength, 1.0 },
  { "nominal_pressure_atm", &BalloonCatheter::nominalPressure, 1.0 },
  { "rated_pressure_atm", &BalloonCatheter::ratedPressure, 1.0 },
  { "tip_bending_stiffness_N_mm2", &BalloonCatheter::tipStiffness, 1.0 },
  { "folded_bending_stiffness_N_mm2", &BalloonCatheter::balloonStiffness, 1.0 },
  { "shaft_bending_stiffness_N_mm2", &BalloonCatheter::shaftStiffness, 1.0 },
  { "film_stiffness_N_per_mm", &BalloonCatheter::filmStiffness, 1.0 },
  { "push_stiffness_N_per_mm", &BalloonCatheter::pushStiffness, 1.0 },
  { "friction_on_wire_N", &BalloonCatheter::wireFriction, 1.0 },
  { "inflated_friction_on_wire_N", &BalloonCatheter::inflatedFriction, 1.0 },
  { "friction", &BalloonCatheter::friction, 1.0 },
  { "inflation_resistance_atm_s_per_mL", &BalloonCatheter::inflationResistance, 1.0 },
  { "contrast_fraction", &BalloonCatheter::fillFraction, 1.0 }
};

constexpr DeviceNumber<BalloonCatheter> MicrocatheterNumbers[] = {
  { "length_mm", &BalloonCatheter::monorail, 1.0 },
  { "inner_diameter_mm", &BalloonCatheter::innerRadius, 0.5 },
  { "tip_mm", &BalloonCatheter::tipLength, 1.0 },
  { "tip_diameter_mm", &BalloonCatheter::tipRadius, 0.5 },
  { "marker_mm", &BalloonCatheter::markerLength, 1.0 },
  { "marker_at_mm", &BalloonCatheter::markerPlace, 1.0 },
  { "push_stiffness_N_per_mm", &BalloonCatheter::pushStiffness, 1.0 },
  { "friction_on_wire_N", &BalloonCatheter::wireFriction, 1.0 },
  { "friction", &BalloonCatheter::friction, 1.0 }
};

constexpr DeviceNumber<MicrocatheterSection> MicrocatheterSectionNumbers[] = {
  { "length_mm", &MicrocatheterSection::length, 1.0 },
  { "outer_diameter_mm", &MicrocatheterSection::outerRadius, 0.5 },
  { "bending_stiffness_N_mm2", &MicrocatheterSection::bendingStiffness, 1.0 }
};

constexpr DeviceNumber<StentDesign> StentNumbers[] = {
  { "diameter_mm", &StentDesign::diameter, 1.0 }, { "length_mm", &StentDesign::length, 1.0 },
  { "crimped_profile_mm", &StentDesign::crimpedRadius, 0.5 },
  { "strut_mm", &StentDesign::strut, 1.0 }, { "recoil", &StentDesign::recoil, 1.0 },
  { "foreshortening", &StentDesign::foreshortening, 1.0 },
  { "greatest_diameter_mm", &StentDesign::greatestDiameter, 1.0 },
  { "opening_pressure_atm", &StentDesign::openingPressure, 1.0 },
  { "collapse_pressure_atm", &StentDesign::collapsePressure, 1.0 },
  { "metal_share", &StentDesign::metalShare, 1.0 }
};

template <typename Device, std::size_t N>
void ReadNumbers(JsonFields& fields, const DeviceNumber<Device> (&numbers)[N], Device& device)
{
  for (const DeviceNumber<Device>& number : numbers)
  {
    device.*number.value = number.scale * fields.Number(number.name, 0.0, Any);
  }
}

template <typename Device, std::size_t N>
void WriteNumbers(const Device& device, const DeviceNumber<Device> (&numbers)[N], Json& json)
{
  for (const DeviceNumber<Device>& number : numbers)
  {
    json[number.name] = device.*number.value / number.scale;
  }
}

template <typename Instrument>
void Check(const Instrument& instrument, const std::string& where)
{
  try
  {
    instrument.Validate();
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument(where + ": " + error.what());
  }
}

/// @param names  of others that there are, for the message
template <typename List, typename Name>
auto& Named(const List& list, const std::string& wanted, const char* what,
  const std::string& origin, const Name& nameOf, std::string names = {})
{
  for (const auto& one : list)
  {
    if (nameOf(one) == wanted)
    {
      return one;
    }
    names += (names.empty() ? "" : ", ") + nameOf(one);
  }
  throw std::invalid_argument(origin + " has no " + what + " '" + wanted + "'; it has " +
    (names.empty() ? "none" : names) + ".");
}

/// Of an instrument, for messages: " 'name'", or nothing.
std::string QuotedName(const Json& object)
{
  return object.is_object() && object.contains("name") && object["name"].is_string()
    ? " '" + object["name"].get<std::string>() + "'"
    : "";
}
}

CatalogueWire WireFromJson(const Json& object, const std::string& where)
{
  CatalogueWire result;
  JsonFields fields(object, where + ": wire" + QuotedName(object));
  result.wire.name = fields.Text("name");
  result.wire.source = fields.Text("source", "");
  result.description = fields.Text("description", "");
  result.wire.length = fields.Number("length_mm", 0.0, Any);
  result.tipLoad = GramForce * fields.Number("tip_load_gf", 0.0, 100.0, 0.0);
  const ValueSources common = SourcesOf(fields);
  for (const Json& entry : fields.List("sections"))
  {
    JsonFields section(
      entry, fields.Where() + ", section " + std::to_string(result.wire.sections.size() + 1));
    result.sectionNames.push_back(section.Text("name", ""));
    result.wire.sections.push_back(SectionOf(section));
    result.cores.push_back(CoreOf(section));
    ValueSources sources = SourcesOf(section);
    sources.insert(common.begin(), common.end());
    result.sources.push_back(std::move(sources));
    section.Done();
  }
  fields.Done();
  Check(result.wire, where);
  return result;
}

CatalogueCatheter CatheterFromJson(const Json& object, const std::string& where)
{
  CatalogueCatheter result;
  GuideCatheter& catheter = result.catheter;
  JsonFields fields(object, where + ": catheter" + QuotedName(object));
  catheter.name = fields.Text("name");
  catheter.source = fields.Text("source", "");
  result.description = fields.Text("description", "");
  catheter.innerRadius = 0.5 * fields.Number("inner_diameter_mm", 0.0, Any);
  catheter.outerRadius = 0.5 * fields.Number("outer_diameter_mm", 0.0, Any);
  catheter.length = fields.Number("length_mm", 0.0, Any);
  catheter.friction = fields.Number("friction", 0.0, Any);
  for (const Json& entry : fields.List("shape"))
  {
    JsonFields piece(entry, fields.Where() + ", arc " + std::to_string(catheter.shape.size() + 1));
    CatheterArc arc;
    arc.length = piece.Number("length_mm", 0.1, 3000.0);
    if (piece.Has("curvature_per_mm"))
    {
      arc.curvature = piece.Number("curvature_per_mm", -10.0, 10.0);
    }
    else
    {
      arc.curvature = Degree * piece.Number("turn_deg", -720.0, 720.0) / arc.length;
    }
    arc.planeAngle = piece.Has("plane_rad")
      ? piece.Number("plane_rad", -2.0 * M_PI, 2.0 * M_PI)
      : Degree * piece.Number("plane_deg", -360.0, 360.0, 0.0);
    piece.Done();
    catheter.shape.push_back(arc);
  }
  if (fields.Has("sections"))
  {
    catheter.wallFriction = fields.Number("wall_friction", 0.0, Any);
    for (const Json& entry : fields.List("sections"))
    {
      JsonFields piece(
        entry, fields.Where() + ", section " + std::to_string(catheter.sections.size() + 1));
      CatheterSection section;
      section.length = piece.Number("length_mm", 0.0, Any);
      section.bendingStiffness = piece.Number("bending_stiffness_N_mm2", 0.0, Any);
      section.torsionalStiffness = piece.Number("torsional_stiffness_N_mm2", 0.0, Any);
      piece.Text("name", "");
      result.moduli.push_back(piece.Number("modulus_MPa", 0.0, 1e6, 0.0));
      piece.Done();
      catheter.sections.push_back(section);
    }
  }
  result.sources = SourcesOf(fields);
  fields.Done();
  Check(catheter, where);
  return result;
}

CatalogueBalloon MicrocatheterFromJson(const Json& object, const std::string& where)
{
  CatalogueBalloon result;
  BalloonCatheter& device = result.balloon;
  JsonFields fields(object, where + ": microcatheter" + QuotedName(object));
  device.name = fields.Text("name");
  device.source = fields.Text("source", "");
  result.description = fields.Text("description", "");
  ReadNumbers(fields, MicrocatheterNumbers, device);
  for (const Json& entry : fields.List("sections"))
  {
    JsonFields piece(
      entry, fields.Where() + ", section " + std::to_string(device.sections.size() + 1));
    ReadNumbers(piece, MicrocatheterSectionNumbers, device.sections.emplace_back());
    piece.Text("name", "");
    result.moduli.push_back(piece.Number("modulus_MPa", 0.0, 1e6, 0.0));
    piece.Done();
  }
  if (device.sections.empty())
  {
    fields.Refuse("has no sections");
  }
  result.sources = SourcesOf(fields);
  fields.Done();
  Check(device, where);
  return result;
}

CatalogueBalloon BalloonFromJson(const Json& object, const std::string& where)
{
  if (object.is_object() && object.contains("sections"))
  {
    return MicrocatheterFromJson(object, where);
  }
  CatalogueBalloon result;
  BalloonCatheter& balloon = result.balloon;
  JsonFields fields(object, where + ": balloon" + QuotedName(object));
  balloon.name = fields.Text("name");
  balloon.source = fields.Text("source", "");
  result.description = fields.Text("description", "");
  ReadNumbers(fields, BalloonNumbers, balloon);
  for (const Json& entry : fields.List("compliance"))
  {
    JsonFields row(
      entry, fields.Where() + ", row " + std::to_string(balloon.compliance.size() + 1));
    balloon.compliance.push_back(
      { row.Number("pressure_atm", 0.0, Any), row.Number("diameter_mm", 0.0, Any) });
    row.Done();
  }
  result.sources = SourcesOf(fields);
  if (fields.Has("stent"))
  {
    JsonFields stent(fields.Object("stent"), fields.Where() + ", stent");
    ReadNumbers(stent, StentNumbers, balloon.stent.emplace());
    for (const auto& [property, source] : SourcesOf(stent))
    {
      result.sources["stent, " + property] = source;
    }
    stent.Done();
  }
  fields.Done();
  Check(balloon, where);
  return result;
}

Json BalloonToJson(const BalloonCatheter& balloon)
{
  Json json = { { "name", balloon.name }, { "source", balloon.source } };
  if (balloon.IsMicrocatheter())
  {
    WriteNumbers(balloon, MicrocatheterNumbers, json);
    for (const MicrocatheterSection& section : balloon.sections)
    {
      WriteNumbers(section, MicrocatheterSectionNumbers, json["sections"].emplace_back());
    }
    return json;
  }
  WriteNumbers(balloon, BalloonNumbers, json);
  json["compliance"] = Json::array();
  for (const ComplianceRow& row : balloon.compliance)
  {
    json["compliance"].push_back(
      { { "pressure_atm", row.pressure }, { "diameter_mm", row.diameter } });
  }
  if (balloon.stent)
  {
    WriteNumbers(*balloon.stent, StentNumbers, json["stent"]);
  }
  return json;
}

Json WireToJson(const Guidewire& wire)
{
  Json sections = Json::array();
  for (const WireSection& section : wire.sections)
  {
    sections.push_back({ { "length_mm", section.length },
      { "bending_stiffness_N_mm2", { section.bendingStiffness1, section.bendingStiffness2 } },
      { "torsional_stiffness_N_mm2", section.torsionalStiffness },
      { "axial_stiffness_N", section.axialStiffness }, { "diameter_mm", 2.0 * section.radius },
      { "density_kg_m3", section.density }, { "friction", section.friction },
      { "rest_curvature_per_mm", section.restCurvature } });
  }
  return { { "name", wire.name }, { "source", wire.source }, { "length_mm", wire.length },
    { "sections", sections } };
}

Json CatheterToJson(const GuideCatheter& catheter)
{
  Json shape = Json::array();
  for (const CatheterArc& arc : catheter.shape)
  {
    shape.push_back({ { "length_mm", arc.length }, { "curvature_per_mm", arc.curvature },
      { "plane_rad", arc.planeAngle } });
  }
  Json json = { { "name", catheter.name }, { "source", catheter.source },
    { "inner_diameter_mm", 2.0 * catheter.innerRadius },
    { "outer_diameter_mm", 2.0 * catheter.outerRadius }, { "length_mm", catheter.length },
    { "friction", catheter.friction }, { "shape", shape } };
  if (!catheter.sections.empty())
  {
    json["wall_friction"] = catheter.wallFriction;
    for (const CatheterSection& section : catheter.sections)
    {
      json["sections"].push_back(
        { { "length_mm", section.length }, { "bending_stiffness_N_mm2", section.bendingStiffness },
          { "torsional_stiffness_N_mm2", section.torsionalStiffness } });
    }
  }
  return json;
}

const CatalogueWire& InstrumentCatalogue::Wire(const std::string& name) const
{
  return Named(this->wires, name, "wire", this->origin,
    [](const CatalogueWire& one) { return one.wire.name; });
}

const CatalogueCatheter& InstrumentCatalogue::Catheter(const std::string& name) const
{
  return Named(this->catheters, name, "catheter", this->origin,
    [](const CatalogueCatheter& one) { return one.catheter.name; });
}

const CatalogueBalloon& InstrumentCatalogue::Balloon(const std::string& name) const
{
  const auto nameOf = [](const CatalogueBalloon& one) { return one.balloon.name; };
  std::string names;
  for (const CatalogueBalloon& one : this->microcatheters)
  {
    if (nameOf(one) == name)
    {
      return one;
    }
    names += (names.empty() ? "" : ", ") + nameOf(one);
  }
  return Named(this->balloons, name, "balloon", this->origin, nameOf, names);
}

InstrumentCatalogue CatalogueFromText(const std::string& text, const std::string& origin)
{
  const Json json = ParseBoundedJson(text, origin);
  JsonFields fields(json, origin);
  fields.RequireFormat("dynamiccoronary instruments", "catalogue of instruments");
  InstrumentCatalogue catalogue;
  catalogue.origin = origin;
  std::set<std::string> names;
  const auto isNew = [&](const std::string& name)
  {
    if (name.empty() || !names.insert(name).second || names.size() > MostInstruments)
    {
      fields.Refuse(name.empty()           ? "has an instrument without name"
          : names.size() > MostInstruments ? "has too many instruments"
                                           : "has two instruments '" + name + "'");
    }
  };
  for (const Json& entry : fields.List("wires"))
  {
    catalogue.wires.push_back(WireFromJson(entry, origin));
    isNew(catalogue.wires.back().wire.name);
  }
  for (const Json& entry : fields.List("catheters"))
  {
    catalogue.catheters.push_back(CatheterFromJson(entry, origin));
    isNew(catalogue.catheters.back().catheter.name);
  }
  const Json none = Json::array();
  for (const Json& entry : fields.Has("balloons") ? fields.List("balloons") : none)
  {
    catalogue.balloons.push_back(BalloonFromJson(entry, origin));
    isNew(catalogue.balloons.back().balloon.name);
    if (catalogue.balloons.back().balloon.IsMicrocatheter())
    {
      fields.Refuse("has '" + catalogue.balloons.back().balloon.name +
        "', which has sections, among its 'balloons': it belongs to 'microcatheters'");
    }
  }
  for (const Json& entry : fields.Has("microcatheters") ? fields.List("microcatheters") : none)
  {
    catalogue.microcatheters.push_back(MicrocatheterFromJson(entry, origin));
    isNew(catalogue.microcatheters.back().balloon.name);
  }
  fields.Done();
  return catalogue;
}

InstrumentCatalogue ReadCatalogue(const std::string& path)
{
  return CatalogueFromText(ReadTextFile(path, "a catalogue"), "'" + path + "'");
}

const InstrumentCatalogue& BuiltInCatalogue()
{
  static const InstrumentCatalogue catalogue =
    CatalogueFromText(embedded::Instruments, "The built-in catalogue");
  return catalogue;
}

void SetStiffness(const WireCore& core, WireSection& section)
{
  const double young = core.modulus;
  const double shear = young / (2.0 * (1.0 + CorePoisson));
  double second1 = 0.0; // of area, mm^4
  double second2 = 0.0;
  double torsion = 0.0; // mm^4
  double area = 0.0;
  if (core.diameter > 0.0)
  {
    second1 = second2 = M_PI * std::pow(core.diameter, 4) / 64.0;
    torsion = 2.0 * second1;
    area = M_PI * core.diameter * core.diameter / 4.0;
  }
  else
  {
    const double w = core.ribbonWidth;
    const double t = core.ribbonThickness;
    second1 = w * t * t * t / 12.0;
    second2 = t * w * w * w / 12.0;
    torsion = w * t * t * t * (1.0 - 0.63 * t / w * (1.0 - std::pow(t / w, 4) / 12.0)) / 3.0;
    area = w * t;
  }
  const double round = M_PI * std::pow(section.radius, 4) / 4.0;
  const double rest = std::max(0.0, round - 0.5 * (second1 + second2));
  const double jacketShear = core.jacketModulus / (2.0 * (1.0 + JacketPoisson));
  section.bendingStiffness1 = young * second1 + core.jacketModulus * rest;
  section.bendingStiffness2 = young * second2 + core.jacketModulus * rest;
  section.torsionalStiffness = shear * torsion + jacketShear * 2.0 * rest;
  section.axialStiffness = young * area +
    core.jacketModulus * std::max(0.0, M_PI * section.radius * section.radius - area);
}

double TipLoad(const Guidewire& wire, double length, double deflection)
{
  constexpr int Steps = 2000;
  double sum = 0.0;
  for (int n = 0; n < Steps; ++n)
  {
    const double s = length * (n + 0.5) / Steps;
    const double stiffness = AlongWire(wire, s,
      [](const WireSection& section)
      { return std::min(section.bendingStiffness1, section.bendingStiffness2); });
    sum += s * s / stiffness * (length / Steps);
  }
  return deflection / sum;
}
}
