#include "DiseaseOptions.h"

#include "Command.h"
#include "Require.h"
#include "TextFile.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;

std::string TextOf(const Json& value, const std::string& where)
{
  Require(value.is_string(), where + " has to be a text");
  return value.get<std::string>();
}

double NumberOf(const Json& value, const std::string& where)
{
  Require(value.is_number(), where + " has to be a number");
  return value.get<double>();
}

bool FlagOf(const Json& value, const std::string& where)
{
  Require(value.is_boolean(), where + " has to be true or false");
  return value.get<bool>();
}

const Json& ListOf(const Json& value, const std::string& where)
{
  Require(value.is_array(), where + " has to be a list");
  return value;
}

PhantomLesion LesionOf(const Json& json, const std::string& where)
{
  Require(json.is_object(), where + " has to be an object");
  const auto kind = json.find("kind");
  Require(kind != json.end(), where + " has no kind");
  PhantomLesion lesion;
  try
  {
    lesion = UsualLesion(TextOf(*kind, where + ".kind"));
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument(where + ".kind: " + error.what());
  }
  Require(json.contains("vessel"), where + " has no vessel");
  Require(json.contains("position_mm") != json.contains("fraction"),
    where + " needs either a position_mm or a fraction");
  for (const auto& [key, value] : json.items())
  {
    const std::string entry = where + "." + key;
    if (key == "kind")
    {
      continue;
    }
    if (key == "vessel")
    {
      lesion.vessel = TextOf(value, entry);
      continue;
    }
    if (key == "position_mm" || key == "fraction")
    {
      lesion.position = NumberOf(value, entry);
      lesion.relative = key == "fraction";
      continue;
    }
    const auto& numbers = AllLesionNumbers();
    const auto number = std::find_if(numbers.begin(), numbers.end(),
      [&name = key](const LesionNumber& one) { return name == one.name; });
    Require(number != numbers.end(), entry + " is not known");
    lesion.*number->member = NumberOf(value, entry);
  }
  return lesion;
}

PhantomGraft GraftOf(const Json& json, const std::string& where)
{
  Require(json.is_object(), where + " has to be an object");
  PhantomGraft graft;
  for (const auto& [key, value] : json.items())
  {
    const std::string entry = where + "." + key;
    if (key == "name")
    {
      graft.name = TextOf(value, entry);
    }
    else if (key == "from")
    {
      const std::string from = TextOf(value, entry);
      Require(from == "mammary" || from == "aorta", entry + " has to be mammary or aorta");
      graft.mammary = from == "mammary";
    }
    else if (key == "vessel")
    {
      graft.vessel = TextOf(value, entry);
    }
    else if (key == "position_mm")
    {
      graft.position = NumberOf(value, entry);
    }
    else if (key == "diameter_mm")
    {
      graft.diameter = NumberOf(value, entry);
    }
    else
    {
      throw std::invalid_argument(entry + " is not known");
    }
  }
  return graft;
}

PhantomCollateral CollateralOf(const Json& json, const std::string& where)
{
  Require(json.is_object(), where + " has to be an object");
  PhantomCollateral collateral;
  for (const auto& [key, value] : json.items())
  {
    const std::string entry = where + "." + key;
    if (key == "name" || key == "from" || key == "to")
    {
      (key == "name"      ? collateral.name
          : key == "from" ? collateral.from
                          : collateral.to) = TextOf(value, entry);
    }
    else if (key == "from_fraction" || key == "to_fraction" || key == "diameter_mm")
    {
      (key == "from_fraction"    ? collateral.fromFraction
          : key == "to_fraction" ? collateral.toFraction
                                 : collateral.diameter) = NumberOf(value, entry);
    }
    else if (key == "septal")
    {
      collateral.septal = FlagOf(value, entry);
    }
    else
    {
      throw std::invalid_argument(entry + " is not known");
    }
  }
  return collateral;
}

/// Adds what `read` makes of each entry of a list.
template <typename Entry>
void AddList(const Json& list, const std::string& key,
  Entry (*read)(const Json& json, const std::string& where), std::vector<Entry>& entries)
{
  std::size_t number = 0;
  for (const Json& one : ListOf(list, key))
  {
    entries.push_back(read(one, key + "[" + std::to_string(number++) + "]"));
  }
}

/// Their courses at each phase, since they are in no other file of the truth.
void DescribeCollaterals(
  const CoronaryPhantom& phantom, const std::vector<double>& phases, Json& json)
{
  const std::vector<PhantomCollateralTruth> atRest = phantom.Collaterals(0.0);
  for (std::size_t n = 0; n < atRest.size(); ++n)
  {
    const PhantomCollateral& collateral = atRest[n].collateral;
    Json one = { { "name", collateral.name }, { "from", collateral.from },
      { "from_fraction", collateral.fromFraction }, { "to", collateral.to },
      { "to_fraction", collateral.toFraction }, { "septal", collateral.septal },
      { "diameter_mm", collateral.diameter }, { "hu", atRest[n].value },
      { "clearance_mm", atRest[n].clearance }, { "phases", Json::array() } };
    for (const double phase : phases)
    {
      const PhantomCollateralTruth truth = phantom.Collaterals(phase)[n];
      Json course = Json::array();
      for (const Vector3& place : truth.points)
      {
        course.push_back({ place[0], place[1], place[2] });
      }
      one["phases"].push_back({ { "fraction", phase }, { "radius_mm", truth.radius },
        { "length_mm", truth.length }, { "course_mm", course } });
    }
    json["collaterals"].push_back(one);
  }
}

void AddJson(const Json& json, PhantomSettings& settings)
{
  Require(json.is_object(), "it is not a JSON object");
  PhantomDisease& disease = settings.disease;
  for (const auto& [key, value] : json.items())
  {
    if (key == "presets")
    {
      for (const Json& name : ListOf(value, key))
      {
        AddDisease(TextOf(name, "presets"), settings);
      }
    }
    else if (key == "lesions")
    {
      AddList(value, key, LesionOf, disease.lesions);
    }
    else if (key == "grafts")
    {
      AddList(value, key, GraftOf, disease.grafts);
    }
    else if (key == "collaterals")
    {
      AddList(value, key, CollateralOf, disease.collaterals);
    }
    else if (key == "origin")
    {
      const std::string name = TextOf(value, key);
      const auto found = std::find(OriginNames().begin(), OriginNames().end(), name);
      Require(found != OriginNames().end(),
        "origin: '" + name + "' is none of usual, high-right, circumflex-from-right, single-right");
      disease.origin = static_cast<CoronaryOrigin>(found - OriginNames().begin());
    }
    else if (key == "leads")
    {
      disease.leads = FlagOf(value, key);
    }
    else if (key == "body_fat_mm")
    {
      disease.bodyFat = NumberOf(value, key);
    }
    else if (key == "vein_hu")
    {
      settings.veinHU = NumberOf(value, key);
    }
    else if (key == "noise_hu")
    {
      settings.noise = NumberOf(value, key);
    }
    else
    {
      throw std::invalid_argument(key + " is not known");
    }
  }
}
}

void DiseaseOptions::AddTo(CLI::App& app)
{
  std::string presets;
  for (const std::string& name : DiseasePresets())
  {
    presets += (presets.empty() ? "" : ", ") + name;
  }
  app
    .add_option("--disease", this->names,
      "Disease of the arteries, one or more of " + presets + ", or a JSON file")
    ->delimiter(',')
    ->type_name("NAME[,NAME...]|FILE")
    ->group("Anatomy");
  this->Vein = app.get_option("--vein");
  this->Noise = app.get_option("--noise");
}

void DiseaseOptions::Apply(PhantomSettings& settings) const
{
  const double vein = settings.veinHU;
  const double noise = settings.noise;
  const auto& presets = DiseasePresets();
  for (const std::string& name : this->names)
  {
    const bool preset = std::find(presets.begin(), presets.end(), name) != presets.end();
    if (!preset && std::filesystem::exists(name))
    {
      try
      {
        AddJson(Json::parse(ReadTextFile(name, "a disease"), nullptr, false), settings);
        settings.disease.Validate();
      }
      catch (const std::invalid_argument& error)
      {
        throw std::runtime_error("'" + name + "': " + error.what());
      }
      continue;
    }
    try
    {
      AddDisease(name, settings);
    }
    catch (const std::invalid_argument& error)
    {
      throw UsageError(
        std::string("--disease: ") + error.what() + "; nor is there a file of that name");
    }
  }
  settings.veinHU = this->Vein->count() > 0 ? vein : settings.veinHU;
  settings.noise = this->Noise->count() > 0 ? noise : settings.noise;
}

bool IsDiseased(const PhantomSettings& settings)
{
  const PhantomDisease& disease = settings.disease;
  return settings.stenoses > 0 || settings.calcifiedPlaques > 0 || settings.chronicOcclusion ||
    !disease.lesions.empty() || !disease.grafts.empty() || !disease.collaterals.empty() ||
    disease.leads || disease.origin != CoronaryOrigin::Usual;
}

std::string DescribeDisease(const CoronaryPhantom& phantom, const std::vector<double>& phases)
{
  const PhantomDisease& disease = phantom.Settings().disease;
  Json json;
  json["origin"] = OriginNames()[static_cast<std::size_t>(disease.origin)];
  json["leads"] = disease.leads;
  json["body_fat_mm"] = disease.bodyFat;
  json["lesions"] = Json::array();
  double calcium = 0.0;
  double score = 0.0;
  for (const PhantomLesionTruth& truth : phantom.Lesions())
  {
    Json one;
    one["kind"] = PhantomLesionKindName(truth.lesion.kind);
    one["vessel"] = truth.lesion.vessel;
    one["segment"] = SegmentName(truth.segmentId);
    one["position_mm"] = truth.middle;
    one["abscissa_mm"] = truth.abscissa;
    one["length_mm"] = truth.lesion.length;
    one["degree_diameter"] = truth.degree;
    one["degree_area"] = truth.areaDegree;
    one["minimum_radius_mm"] = truth.minimumRadius;
    one["reference_radius_mm"] = truth.referenceRadius;
    one["wall_radius_mm"] = truth.wallRadius;
    one["fibrous_mm3"] = truth.fibrousVolume;
    one["lipid_mm3"] = truth.lipidVolume;
    one["calcium_mm3"] = truth.calciumVolume;
    one["agatston"] = truth.agatston;
    Json& asked = one["asked"];
    for (const LesionNumber& number : AllLesionNumbers())
    {
      asked[number.name] = truth.lesion.*number.member;
    }
    calcium += truth.calciumVolume;
    score += truth.agatston;
    json["lesions"].push_back(one);
  }
  json["calcium_mm3"] = calcium;
  json["agatston"] = score;
  for (const PhantomGraft& graft : disease.grafts)
  {
    json["grafts"].push_back({ { "name", graft.name },
      { "from", graft.mammary ? "mammary" : "aorta" }, { "vessel", graft.vessel },
      { "position_mm", graft.position }, { "diameter_mm", graft.diameter } });
  }
  DescribeCollaterals(phantom, phases, json);
  for (const PhantomVessel& vessel : phantom.Vessels())
  {
    Json one;
    one["name"] = vessel.name;
    one["parent"] = vessel.parent;
    one["tree"] = vessel.treeId;
    one["length_mm"] = vessel.length;
    one["occluded_mm"] = vessel.occlusions;
    one["late_from_mm"] = vessel.lateFrom < 0.0 ? Json() : Json(vessel.lateFrom);
    json["vessels"].push_back(one);
  }
  return json.dump(2) + "\n";
}
}
