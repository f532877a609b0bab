// The catalogue's values follow from what they are said to follow from; wrong catalogues are refused with the place.
#include "InstrumentCatalogue.h"

#include "Refusals.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <iterator>

namespace UnitTestInstrumentCatalogue
{
using coronary::BuiltInCatalogue;
using coronary::CatalogueFromText;
using nlohmann::json;

namespace
{
constexpr double GramForce = 9.80665e-3;

json BuiltInJson()
{
  std::ifstream file(DYNAMICCORONARY_SOURCE_DIR "/Simulator/Session/instruments.json");
  return json::parse(std::string(std::istreambuf_iterator<char>(file), {}));
}

/// Reads the catalogue after a change; it has to be refused.
template <typename Change>
void Refused(const Change& change, const std::string& part)
{
  json changed = BuiltInJson();
  change(changed);
  ExpectRefusal([&] { CatalogueFromText(changed.dump(), "'own.json'"); }, part);
  ExpectRefusal([&] { CatalogueFromText(changed.dump(), "'own.json'"); }, "'own.json'");
}
}

TEST(UnitTestInstrumentCatalogue, HasTheKindsThatAreUsed)
{
  const coronary::InstrumentCatalogue& catalogue = BuiltInCatalogue();
  for (const char* name :
    { "workhorse", "workhorse-long-j", "extra-support", "polymer-jacket", "cto-9gf" })
  {
    EXPECT_NO_THROW(catalogue.Wire(name)) << name;
  }
  for (const char* shape : { "JL4", "JR4", "EBU3.5", "AL1" })
  {
    const auto& six = catalogue.Catheter(std::string(shape) + "-6F").catheter;
    const auto& seven = catalogue.Catheter(std::string(shape) + "-7F").catheter;
    EXPECT_NEAR(six.innerRadius, 0.5 * 0.071 * 25.4, 1e-3);
    EXPECT_NEAR(six.outerRadius, 1.0, 1e-3);
    EXPECT_GT(seven.innerRadius, six.innerRadius);
    EXPECT_NEAR(seven.outerRadius, 7.0 / 6.0, 1e-3);
  }
  ExpectRefusal([&] { catalogue.Wire("spaghetti"); },
    "The built-in catalogue has no wire 'spaghetti'; it has workhorse, ");
  ExpectRefusal([&] { catalogue.Catheter("workhorse"); }, "has no catheter 'workhorse'");
}

TEST(UnitTestInstrumentCatalogue, StiffnessFollowsFromGeometryAndModulus)
{
  for (const auto& one : BuiltInCatalogue().wires)
  {
    ASSERT_EQ(one.cores.size(), one.wire.sections.size());
    for (std::size_t n = 0; n < one.cores.size(); ++n)
    {
      ASSERT_GT(one.cores[n].modulus, 0.0) << one.wire.name;
      const coronary::WireSection& given = one.wire.sections[n];
      coronary::WireSection computed = given;
      coronary::SetStiffness(one.cores[n], computed);
      const auto near = [&](double a, double b)
      { EXPECT_NEAR(a / b, 1.0, 0.01) << one.wire.name << " section " << n + 1; };
      near(given.bendingStiffness1, computed.bendingStiffness1);
      near(given.bendingStiffness2, computed.bendingStiffness2);
      near(given.torsionalStiffness, computed.torsionalStiffness);
      near(given.axialStiffness, computed.axialStiffness);
      EXPECT_LE(one.cores[n].diameter, 2.0 * given.radius);
    }
  }
}

TEST(UnitTestInstrumentCatalogue, GuidesAreTubesOfTheirModulus)
{
  for (const auto& one : BuiltInCatalogue().catheters)
  {
    const coronary::GuideCatheter& guide = one.catheter;
    ASSERT_EQ(one.moduli.size(), guide.sections.size());
    ASSERT_GE(guide.sections.size(), 2U) << guide.name;
    const double area =
      M_PI / 4.0 * (std::pow(guide.outerRadius, 4) - std::pow(guide.innerRadius, 4));
    for (std::size_t n = 0; n < one.moduli.size(); ++n)
    {
      EXPECT_NEAR(guide.sections[n].bendingStiffness / (one.moduli[n] * area), 1.0, 0.005)
        << guide.name << " section " << n + 1;
    }
  }
  // Thicker is stiffer, of every shape: 5F < 6F < 7F < 8F.
  for (const char* shape : { "JL4", "JR4", "EBU3.5", "AL1" })
  {
    double before = 0.0;
    for (const char* size : { "-5F", "-6F", "-7F", "-8F" })
    {
      const auto& guide = BuiltInCatalogue().Catheter(std::string(shape) + size).catheter;
      EXPECT_GT(guide.sections.back().bendingStiffness, 1.5 * before) << guide.name;
      before = guide.sections.back().bendingStiffness;
    }
  }
}

TEST(UnitTestInstrumentCatalogue, SteelOfAWholeWire)
{
  // Solid steel of 0.014 inch: I = 7.88e-16 m^4 times 200 GPa.
  coronary::WireSection section;
  section.radius = 0.178;
  coronary::SetStiffness({ 0.356, 0.0, 0.0, 200e3, 0.0 }, section);
  EXPECT_NEAR(section.bendingStiffness1, 157.7, 0.1);
  EXPECT_NEAR(section.bendingStiffness2, 157.7, 0.1);
  EXPECT_NEAR(section.torsionalStiffness, 121.3, 0.1);
  // A square ribbon: 0.1406 a^4 G.
  coronary::SetStiffness({ 0.0, 0.1, 0.1, 260e3, 0.0 }, section);
  EXPECT_NEAR(section.torsionalStiffness, 0.1406 * 1e-4 * 100e3, 0.01);
  EXPECT_NEAR(section.bendingStiffness1, 260e3 * 1e-4 / 12.0, 1e-6);
}

TEST(UnitTestInstrumentCatalogue, TipLoadsAreTheNominalOnes)
{
  coronary::Guidewire even;
  even.sections.resize(1);
  even.sections[0].bendingStiffness1 = even.sections[0].bendingStiffness2 = 1.635;
  even.sections[0].length = 100.0;
  // F = 3 EI d / L^3: 1 gf at 2 mm over 10 mm.
  EXPECT_NEAR(coronary::TipLoad(even), GramForce, 0.001 * GramForce);
  for (const auto& one : BuiltInCatalogue().wires)
  {
    ASSERT_GT(one.tipLoad, 0.0);
    EXPECT_NEAR(coronary::TipLoad(one.wire) / one.tipLoad, 1.0, 0.1) << one.wire.name;
  }
  EXPECT_LT(BuiltInCatalogue().Wire("polymer-jacket").wire.sections[0].friction,
    0.5 * BuiltInCatalogue().Wire("workhorse").wire.sections[0].friction);
}

TEST(UnitTestInstrumentCatalogue, EveryValueHasASource)
{
  const json all = BuiltInJson();
  for (const json& wire : all["wires"])
  {
    EXPECT_FALSE(wire["source"].get<std::string>().empty());
    const auto& read = BuiltInCatalogue().Wire(wire["name"]);
    for (std::size_t n = 0; n < wire["sections"].size(); ++n)
    {
      for (const auto& member : wire["sections"][n].items())
      {
        if (member.key() != "name" && member.key() != "core")
        {
          EXPECT_GT(read.sources[n].count(member.key()), 0U) << wire["name"] << " " << member.key();
        }
      }
    }
  }
  for (const json& catheter : all["catheters"])
  {
    const auto& read = BuiltInCatalogue().Catheter(catheter["name"]);
    for (const char* key : { "inner_diameter_mm", "outer_diameter_mm", "length_mm", "friction",
           "wall_friction", "bending_stiffness_N_mm2", "torsional_stiffness_N_mm2", "shape" })
    {
      EXPECT_GT(read.sources.count(key), 0U) << catheter["name"] << " " << key;
    }
  }
}

TEST(UnitTestInstrumentCatalogue, ShapesTurnAsTheirArcsSay)
{
  const coronary::GuideCatheter catheter = BuiltInCatalogue().Catheter("JL4-6F").catheter;
  double turned = 0.0;
  for (const auto& arc : catheter.shape)
  {
    turned += arc.length * std::abs(arc.curvature);
  }
  EXPECT_NEAR(turned, (110.0 + 160.0 + 35.0) * M_PI / 180.0, 1e-9);
}

TEST(UnitTestInstrumentCatalogue, RefusesWithThePlace)
{
  const auto section = [](json& all) -> json& { return all["wires"][0]["sections"][2]; };
  Refused([&](json& all) { section(all)["bending_stiffness_N_mm2"] = -3; },
    "wire 'workhorse', section 3 has a negative 'bending_stiffness_N_mm2': -3");
  Refused([&](json& all) { section(all)["bending_stiffness_N_mm2"] = { 1, -2 }; }, "negative");
  Refused([&](json& all) { section(all)["torsional_stiffness_N_mm2"] = -1; },
    "negative 'torsional_stiffness_N_mm2'");
  Refused([&](json& all) { section(all)["axial_stiffness_N"] = 0; },
    "section 3: the axial stiffness is 0 N");
  Refused([&](json& all) { section(all)["diameter_mm"] = 5; }, "the radius is 2.5 mm");
  Refused([&](json& all) { section(all)["density_kg_m3"] = "heavy"; }, "'density_kg_m3'");
  Refused([&](json& all) { section(all)["friction"] = 3; }, "the friction is 3");
  Refused([&](json& all) { section(all)["rest_curvature_per_mm"] = 50; }, "the curvature at rest");
  Refused([&](json& all) { section(all).erase("length_mm"); }, "has no 'length_mm'");
  Refused([&](json& all) { section(all)["frction"] = 0.1; }, "'frction', which means nothing");
  Refused([&](json& all) { section(all)["core"]["modulus_GPa"] = -1; }, "negative 'modulus_GPa'");
  Refused([&](json& all) { all["wires"][0]["sections"] = json::array(); }, "0 sections");
  Refused([&](json& all) { all["wires"][0]["length_mm"] = 150; }, "behind the wire's end");
  Refused([&](json& all) { all["wires"][1]["name"] = "workhorse"; }, "two instruments 'workhorse'");
  Refused([&](json& all) { all["wires"][1]["name"] = ""; }, "without name");
  Refused([&](json& all) { all["wires"][1] = 7; }, "is 7 and no object");
  Refused(
    [&](json& all) { all["catheters"][0]["inner_diameter_mm"] = 3; }, "not greater than the inner");
  Refused([&](json& all) { all["catheters"][0]["length_mm"] = 100; }, "arcs are 156 mm long");
  Refused([&](json& all) { all["catheters"][0]["shape"][1]["turn_deg"] = 10000; }, "'turn_deg'");
  const auto tube = [](json& all) -> json& { return all["catheters"][0]["sections"][1]; };
  Refused([&](json& all) { tube(all)["bending_stiffness_N_mm2"] = -1; },
    "catheter 'JL4-4F', section 2 has a negative 'bending_stiffness_N_mm2': -1");
  Refused([&](json& all) { tube(all)["torsional_stiffness_N_mm2"] = 0; },
    "section 2: the torsional stiffness is 0 N mm^2");
  Refused([&](json& all) { tube(all).erase("length_mm"); }, "has no 'length_mm'");
  Refused([&](json& all) { tube(all)["stiffness"] = 1; }, "'stiffness', which means nothing");
  Refused([&](json& all) { all["catheters"][0].erase("wall_friction"); }, "has no 'wall_friction'");
  Refused([&](json& all) { all["catheters"][0]["wall_friction"] = 3; }, "the wall's friction is 3");
  Refused([&](json& all) { all["version"] = 2; }, "another 'version'");
  Refused([&](json& all) { all["format"] = "x"; }, "no catalogue");
  EXPECT_THROW(CatalogueFromText("{", "'own.json'"), std::runtime_error);
  EXPECT_THROW(CatalogueFromText(std::string(100000, '['), "'own.json'"), std::runtime_error);
  EXPECT_THROW(coronary::ReadCatalogue("/no/such/file.json"), std::runtime_error);
}
}
