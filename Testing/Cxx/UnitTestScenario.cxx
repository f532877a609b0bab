// Scenarios, scripts of driving, and the heart that contracts by formula.
#include "ContractionMotion.h"
#include "DriveScript.h"
#include "InstrumentCatalogue.h"
#include "Scenario.h"

#include "Refusals.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace UnitTestScenario
{
using coronary::LoadScenario;
using coronary::Scenario;
using coronary::ScenarioFromText;
using coronary::ScenarioText;
using coronary::Vector3;
using coronary::VesselSource;
using nlohmann::json;

namespace
{
template <typename Change>
void Refused(const Change& change, const std::string& part)
{
  json changed = json::parse(ScenarioText(LoadScenario("phantom-lca")));
  change(changed);
  ExpectRefusal([&] { ScenarioFromText(changed.dump(), "'own.json'", "."); }, part);
  ExpectRefusal([&] { ScenarioFromText(changed.dump(), "'own.json'", "."); }, "'own.json'");
}

/// A tube of points around a curved axis of 100 mm.
class RestingVessel : public coronary::WallMotion
{
public:
  RestingVessel()
  {
    std::vector<Vector3> axis;
    for (int n = 0; n <= 50; ++n)
    {
      axis.emplace_back(20.0 * std::sin(0.06 * n), 5.0, 2.0 * n);
      for (int k = 0; k < 6; ++k)
      {
        this->Points.push_back(axis.back() + Vector3(std::cos(k), std::sin(k), 0.0));
      }
    }
    this->Still.points = static_cast<std::int64_t>(this->Points.size());
    this->Still.axis = { axis };
    this->Still.parent = { -1 };
    this->Still.groupName = { "LM" };
  }
  const coronary::WallTopology& Topology() const override { return this->Still; }
  void Positions(double, std::vector<Vector3>& positions) override { positions = this->Points; }
  void AxisPositions(double, std::vector<Vector3>& positions) override
  {
    positions = this->Still.axis[0];
  }

  coronary::WallTopology Still;
  std::vector<Vector3> Points;
};
}

TEST(UnitTestScenario, BuiltInOnesAreGood)
{
  const auto list = coronary::BuiltInScenarios();
  ASSERT_EQ(list.size(), 14U);
  for (const auto& one : list)
  {
    const Scenario scenario = LoadScenario(one.name);
    EXPECT_EQ(scenario.name, one.name);
    EXPECT_FALSE(one.description.empty());
    EXPECT_NO_THROW(scenario.wire.Validate());
    EXPECT_NO_THROW(scenario.catheter.Validate());
  }
  EXPECT_EQ(LoadScenario("phantom-rca").artery, "RCA");
  const Scenario atlas = LoadScenario("hra-lca");
  EXPECT_EQ(atlas.vessels.kind, VesselSource::Kind::Run);
  EXPECT_TRUE(atlas.vessels.path.empty());
  EXPECT_EQ(atlas.vessels.motion, coronary::VesselMotion::Contraction);
  EXPECT_FALSE(atlas.balloon);
  EXPECT_EQ(LoadScenario("patient-lca").vessels.motion, coronary::VesselMotion::Automatic);
  EXPECT_EQ(LoadScenario("patient-rca").artery, "RCA");
  const Scenario lesion = LoadScenario("lad-lesion");
  ASSERT_TRUE(lesion.balloon);
  EXPECT_NO_THROW(lesion.balloon->Validate());
  ASSERT_EQ(lesion.lesions.size(), 1U);
  EXPECT_EQ(lesion.lesions[0].degree, 0.7);
  EXPECT_EQ(coronary::BalloonOf(lesion, 1), nullptr);
  const Scenario stented = LoadScenario("lad-stent");
  ASSERT_TRUE(stented.balloon && stented.balloon->stent);
  EXPECT_NO_THROW(stented.balloon->Validate());
  ASSERT_EQ(stented.exchanges.size(), 1U);
  EXPECT_EQ(coronary::BalloonOf(stented, 1), &stented.exchanges[0]);
  const Scenario occluded = LoadScenario("cto-lad");
  ASSERT_EQ(occluded.wireExchanges.size(), 1U);
  EXPECT_EQ(coronary::WireOf(occluded, 0), &occluded.wire);
  EXPECT_EQ(coronary::WireOf(occluded, 1)->name, "cto-9gf");
  EXPECT_EQ(coronary::WireOf(occluded, 2), nullptr);
  ASSERT_EQ(occluded.lesions.size(), 1U);
  EXPECT_EQ(occluded.lesions[0].degree, 1.0);
  const Scenario through = LoadScenario("cto-microcatheter");
  ASSERT_TRUE(through.balloon);
  EXPECT_TRUE(through.balloon->IsMicrocatheter());
  EXPECT_FALSE(coronary::BalloonOf(through, 1)->IsMicrocatheter());
  const Scenario forked = LoadScenario("lad-bifurcation");
  ASSERT_TRUE(forked.secondWire);
  EXPECT_NO_THROW(forked.secondWire->Validate());
  EXPECT_FALSE(occluded.secondWire);
  const Scenario events = LoadScenario("lca-events");
  ASSERT_EQ(events.incidents.size(), 2U);
  EXPECT_EQ(events.incidents[0].kind, coronary::Incident::Kind::Spasm);
  EXPECT_EQ(events.incidents[1].when, coronary::Incident::When::Called);
  EXPECT_TRUE(events.contrast.guideLumen);
}

TEST(UnitTestScenario, TextSaysEverythingToTheBit)
{
  for (const auto& one : coronary::BuiltInScenarios())
  {
    const Scenario scenario = LoadScenario(one.name);
    const std::string text = ScenarioText(scenario);
    const Scenario again = ScenarioFromText(text, "'text'", "/elsewhere");
    EXPECT_EQ(ScenarioText(again), text);
    ASSERT_EQ(again.wire.sections.size(), scenario.wire.sections.size());
    for (std::size_t n = 0; n < scenario.wire.sections.size(); ++n)
    {
      EXPECT_EQ(
        again.wire.sections[n].bendingStiffness1, scenario.wire.sections[n].bendingStiffness1);
      EXPECT_EQ(again.wire.sections[n].radius, scenario.wire.sections[n].radius);
    }
    for (std::size_t n = 0; n < scenario.catheter.shape.size(); ++n)
    {
      EXPECT_EQ(again.catheter.shape[n].curvature, scenario.catheter.shape[n].curvature);
    }
    EXPECT_EQ(again.catheter.wallFriction, scenario.catheter.wallFriction);
    ASSERT_EQ(again.catheter.sections.size(), scenario.catheter.sections.size());
    for (std::size_t n = 0; n < scenario.catheter.sections.size(); ++n)
    {
      EXPECT_EQ(again.catheter.sections[n].bendingStiffness,
        scenario.catheter.sections[n].bendingStiffness);
      EXPECT_EQ(again.catheter.sections[n].torsionalStiffness,
        scenario.catheter.sections[n].torsionalStiffness);
    }
    EXPECT_EQ(again.vessels.contraction.twist, scenario.vessels.contraction.twist);
    EXPECT_EQ(again.balloon.has_value(), scenario.balloon.has_value());
    EXPECT_EQ(again.exchanges.size(), scenario.exchanges.size());
    EXPECT_EQ(again.wireExchanges.size(), scenario.wireExchanges.size());
    ASSERT_EQ(again.lesions.size(), scenario.lesions.size());
    for (std::size_t n = 0; n < scenario.lesions.size(); ++n)
    {
      EXPECT_EQ(again.lesions[n].strength, scenario.lesions[n].strength);
    }
    ASSERT_EQ(again.procedure.size(), scenario.procedure.size());
    for (std::size_t n = 0; n < scenario.procedure.size(); ++n)
    {
      EXPECT_EQ(again.procedure[n].goal, scenario.procedure[n].goal);
      EXPECT_EQ(again.procedure[n].text, scenario.procedure[n].text);
      EXPECT_EQ(again.procedure[n].value, scenario.procedure[n].value);
    }
  }
}

TEST(UnitTestScenario, StepsOfAProcedure)
{
  json text = json::parse(ScenarioText(LoadScenario("lad-stent")));
  const auto with = [&](const json& step)
  {
    text["procedure"] = json::array({ step });
    return ScenarioFromText(text.dump(), "'file'", ".");
  };
  const Scenario scenario = with({ { "text", "go" }, { "goal", "wire_in" }, { "vessel", "dLAD" } });
  ASSERT_EQ(scenario.procedure.size(), 1U);
  EXPECT_EQ(scenario.procedure[0].goal, coronary::ProcedureStep::Goal::WireIn);
  EXPECT_EQ(scenario.procedure[0].vessel, "dLAD");
  ExpectRefusal(
    [&] {
      with({ { "text", "go" }, { "goal", "fly" } });
    },
    "'file', step 1", "'fly' is none of angiogram, wire_in");
  ExpectRefusal([&] { with({ { "text", "go" }, { "goal", "wire_in" } }); }, "'vessel'");
  ExpectRefusal([&] { with({ { "text", "go" }, { "goal", "stenosis_below" } }); }, "'percent'");
  ExpectRefusal(
    [&] {
      with({ { "text", "go" }, { "goal", "stenosis_below" }, { "percent", 120 } });
    },
    "'percent'");
  ExpectRefusal(
    [&] {
      with({ { "text", "go" }, { "goal", "wire_taken" }, { "number", 1 } });
    },
    "'file' has a step 'go' that takes a wire that it has not");
  ExpectRefusal(
    [&] {
      with({ { "text", "go" }, { "goal", "balloon_taken" }, { "number", 9 } });
    },
    "'file' has a step 'go' that takes a balloon that it has not");
  ExpectRefusal([&] { with({ { "goal", "wire_back" } }); }, "'text'");
  ExpectRefusal([&] { with({ { "text", "go" }, { "goal", "wire_back" }, { "mm", 3 } }); }, "'mm'");
}

TEST(UnitTestScenario, EverySettingArrives)
{
  json text = json::parse(ScenarioText(LoadScenario("phantom-lca")));
  text["settings"] = { { "tick_rate_hz", 1000 }, { "ticks_per_frame", 17 }, { "heart_rate_bpm", 0 },
    { "start_phase", 0.25 }, { "segment_length_mm", 2 }, { "capacity", 99 },
    { "inside_catheter_mm", 11 }, { "root_branch", 4 }, { "engagement_mm", 5 },
    { "wall_friction_factor", 2.5 }, { "wall_stiffness_N_per_mm", 7 }, { "drag_Pa_s", 0.5 },
    { "largest_speed_mm_s", 50 }, { "largest_turning_rad_s", 6 } };
  text["vessels"]["phantom"] = { { "seed", 9 }, { "dominance", "left" }, { "stenoses", 3 },
    { "surface_spacing_mm", 0.5 } };
  text["wire"] = "cto-9gf";
  text["seed"] = 77;
  const Scenario s = ScenarioFromText(text.dump(), "'own.json'", ".");
  EXPECT_EQ(s.settings.tickRate, 1000.0);
  EXPECT_EQ(s.settings.ticksPerFrame, 17);
  EXPECT_EQ(s.settings.heartRate, 0.0);
  EXPECT_EQ(s.settings.startPhase, 0.25);
  EXPECT_EQ(s.settings.segmentLength, 2.0);
  EXPECT_EQ(s.settings.capacity, 99);
  EXPECT_EQ(s.settings.insideCatheter, 11.0);
  EXPECT_EQ(s.settings.rootBranch, 4);
  EXPECT_EQ(s.settings.engagement, 5.0);
  EXPECT_EQ(s.settings.wallFriction, 2.5);
  EXPECT_EQ(s.settings.wallStiffness, 7.0);
  EXPECT_EQ(s.settings.drag, 0.5);
  EXPECT_EQ(s.settings.maximumSpeed, 50.0);
  EXPECT_EQ(s.settings.maximumTurning, 6.0);
  EXPECT_EQ(s.vessels.phantom.seed, 9U);
  EXPECT_EQ(s.vessels.phantom.dominance, coronary::Dominance::Left);
  EXPECT_EQ(s.vessels.phantom.stenoses, 3);
  EXPECT_EQ(s.vessels.phantom.surfaceSpacing, 0.5);
  EXPECT_EQ(s.wire.name, "cto-9gf");
  EXPECT_EQ(s.seed, 77U);
}

TEST(UnitTestScenario, ARateThatIsNotGivenIsThatOfTheVessels)
{
  json text = json::parse(ScenarioText(LoadScenario("phantom-lca")));
  EXPECT_FALSE(ScenarioFromText(text.dump(), "'own.json'", ".").heartRateOfVessels);
  text["settings"].erase("heart_rate_bpm");
  const Scenario open = ScenarioFromText(text.dump(), "'own.json'", ".");
  EXPECT_TRUE(open.heartRateOfVessels);
  EXPECT_FALSE(json::parse(ScenarioText(open))["settings"].contains("heart_rate_bpm"));
  EXPECT_TRUE(LoadScenario("patient-lca").heartRateOfVessels);
}

TEST(UnitTestScenario, ImagingAndContrastArriveAndComeBackToTheBit)
{
  json text = json::parse(ScenarioText(LoadScenario("phantom-lca")));
  text["imaging"] = { { "background", "ct/a.nii" }, { "background_run", "ct/model" },
    { "background_offset_mm", { 1, -2.5, 0.1 } }, { "thorax_seed", 5 }, { "primary_deg", -31.7 },
    { "secondary_deg", 19.3 }, { "source_to_isocentre_mm", 712.3 },
    { "source_to_detector_mm", 1043.7 }, { "isocentre_mm", { 0.1, 0.2, 0.3 } },
    { "field_of_view_mm", 171.1 }, { "columns", 321 }, { "energy_keV", 61.9 },
    { "iodine_mg_mL", 300.3 }, { "frame_rate_hz", 7.5 }, { "cine_rate_hz", 30 },
    { "exposure_control", false }, { "heart_shadow_moves", false },
    { "breathing", { { "rate_per_min", 11.3 }, { "amplitude_mm", 8.7 } } } };
  text["contrast"] = { { "viscosity_mPa_s", 3.3 }, { "systolic_pressure_mmHg", 141.7 },
    { "diastolic_pressure_mmHg", 77.7 }, { "left_axial_speed_cm_s", 17.3 },
    { "right_axial_speed_cm_s", 13.1 }, { "left_diastolic_ratio", 1.9 },
    { "right_diastolic_ratio", 1.3 }, { "outlet_exponent", 2.7 }, { "tracer_volume_mL", 0.0013 },
    { "radial_diffusivity_mm2_s", 0.7 }, { "smoothing_mm", 1.7 }, { "flow_depression", 0.3 },
    { "tracers", 12345 } };
  const Scenario s = ScenarioFromText(text.dump(), "'own.json'", "/folder");
  const coronary::ImagingSettings& imaging = s.imaging;
  EXPECT_EQ(imaging.background, "/folder/ct/a.nii");
  EXPECT_EQ(imaging.backgroundRun, "/folder/ct/model");
  EXPECT_EQ(imaging.backgroundOffset, Vector3(1.0, -2.5, 0.1));
  EXPECT_EQ(imaging.thoraxSeed, 5U);
  EXPECT_NEAR(imaging.pose.primary, -31.7 * M_PI / 180.0, 1e-15);
  EXPECT_NEAR(imaging.pose.secondary, 19.3 * M_PI / 180.0, 1e-15);
  EXPECT_EQ(imaging.pose.sourceToIsocentre, 712.3);
  EXPECT_EQ(imaging.pose.sourceToDetector, 1043.7);
  EXPECT_TRUE(imaging.hasIsocentre);
  EXPECT_EQ(imaging.pose.isocentre, Vector3(0.1, 0.2, 0.3));
  EXPECT_EQ(imaging.fieldOfView, 171.1);
  EXPECT_EQ(imaging.columns, 321);
  EXPECT_EQ(imaging.energy, 61.9);
  EXPECT_EQ(imaging.iodine, 300.3);
  EXPECT_EQ(imaging.frameRate, 7.5);
  EXPECT_EQ(imaging.cineRate, 30.0);
  EXPECT_FALSE(imaging.exposureControl);
  EXPECT_FALSE(imaging.heartShadowMoves);
  EXPECT_EQ(imaging.breathing.rate, 11.3);
  EXPECT_EQ(imaging.breathing.amplitude, 8.7);
  EXPECT_EQ(s.contrast.flow.viscosity, 3.3);
  EXPECT_EQ(s.contrast.flow.systolicPressure, 141.7);
  EXPECT_EQ(s.contrast.flow.diastolicPressure, 77.7);
  EXPECT_EQ(s.contrast.flow.leftAxialSpeed, 17.3);
  EXPECT_EQ(s.contrast.flow.rightAxialSpeed, 13.1);
  EXPECT_EQ(s.contrast.flow.leftDiastolicRatio, 1.9);
  EXPECT_EQ(s.contrast.flow.rightDiastolicRatio, 1.3);
  EXPECT_EQ(s.contrast.flow.outletExponent, 2.7);
  EXPECT_EQ(s.contrast.tracers.volume, 0.0013);
  EXPECT_EQ(s.contrast.tracers.radialDiffusivity, 0.7);
  EXPECT_EQ(s.contrast.tracers.capacity, 12345);
  EXPECT_EQ(s.contrast.smoothing, 1.7);
  EXPECT_EQ(s.contrast.flowDepression, 0.3);

  const Scenario again = ScenarioFromText(ScenarioText(s), "'text'", "/elsewhere");
  EXPECT_EQ(ScenarioText(again), ScenarioText(s));
  EXPECT_EQ(again.imaging.background, imaging.background);
  EXPECT_EQ(again.imaging.backgroundRun, imaging.backgroundRun);
  EXPECT_EQ(again.imaging.pose.primary, imaging.pose.primary);
  EXPECT_EQ(again.imaging.pose.secondary, imaging.pose.secondary);
  EXPECT_EQ(again.imaging.pose.isocentre, imaging.pose.isocentre);
  EXPECT_EQ(again.imaging.backgroundOffset, imaging.backgroundOffset);
  EXPECT_EQ(again.contrast.tracers.volume, s.contrast.tracers.volume);
  EXPECT_EQ(again.contrast.flow.viscosity, s.contrast.flow.viscosity);
}

TEST(UnitTestScenario, RefusesWrongImagingAndContrast)
{
  Refused([](json& s) { s["imaging"]["zoom"] = 2; }, "imaging has 'zoom', which means nothing");
  Refused([](json& s) { s["imaging"]["columns"] = "many"; }, "'columns'");
  Refused([](json& s) { s["imaging"]["columns"] = 5000; }, "'columns'");
  Refused([](json& s) { s["imaging"]["energy_keV"] = nullptr; }, "'energy_keV'");
  Refused([](json& s) { s["imaging"]["frame_rate_hz"] = 13; }, "none of 7.5, 15, 30");
  Refused([](json& s) { s["imaging"]["cine_rate_hz"] = 60; }, "none of 7.5, 15, 30");
  Refused([](json& s) { s["imaging"]["isocentre_mm"] = { 1, 2 }; }, "three coordinates");
  Refused([](json& s) { s["imaging"]["primary_rad"] = 2.2; }, "'primary_rad'");
  Refused(
    [](json& s)
    {
      s["imaging"]["source_to_isocentre_mm"] = 1200;
      s["imaging"]["source_to_detector_mm"] = 1210;
    },
    "'source_to_detector_mm'");
  Refused([](json& s) { s["imaging"]["background"] = 7; }, "'background'");
  Refused([](json& s) { s["imaging"]["background_run"] = "model"; }, "no 'background'");
  Refused([](json& s) { s["imaging"] = json::array(); }, "'imaging'");
  Refused([](json& s) { s["imaging"]["exposure_control"] = 1; }, "'exposure_control'");
  Refused([](json& s) { s["imaging"]["heart_shadow_moves"] = "yes"; }, "'heart_shadow_moves'");
  Refused([](json& s) { s["imaging"]["breathing"]["rate_per_min"] = -1; },
    "imaging, breathing has a negative 'rate_per_min'");
  Refused([](json& s) { s["imaging"]["breathing"]["amplitude_mm"] = 41; }, "'amplitude_mm'");
  Refused([](json& s) { s["imaging"]["breathing"]["depth"] = 3; }, "'depth', which means nothing");
  Refused([](json& s) { s["imaging"]["breathing"] = 15; }, "'breathing'");
  Refused([](json& s) { s["contrast"]["colour"] = "red"; }, "contrast has 'colour'");
  Refused([](json& s) { s["contrast"]["tracers"] = 5; }, "'tracers'");
  Refused([](json& s) { s["contrast"]["viscosity_mPa_s"] = -3; }, "'viscosity_mPa_s'");
  Refused([](json& s) { s["contrast"]["diastolic_pressure_mmHg"] = 200; }, "contrast: ");
}

TEST(UnitTestScenario, RecordingsOfBeforeHaveNeitherControlNorMotionOfTheBackground)
{
  json text = json::parse(ScenarioText(LoadScenario("phantom-lca")));
  EXPECT_TRUE(coronary::RecordedScenario(text.dump(), "'r'").imaging.exposureControl);
  EXPECT_EQ(ScenarioText(coronary::RecordedScenario(text.dump(), "'r'")),
    ScenarioText(LoadScenario("phantom-lca")));
  for (const char* key : { "exposure_control", "heart_shadow_moves", "breathing" })
  {
    text["imaging"].erase(key);
  }
  const Scenario old = coronary::RecordedScenario(text.dump(), "'r'");
  EXPECT_FALSE(old.imaging.exposureControl);
  EXPECT_FALSE(old.imaging.heartShadowMoves);
  EXPECT_EQ(old.imaging.breathing.rate, 0.0);
  EXPECT_EQ(old.imaging.breathing.amplitude, 0.0);
  const Scenario file = ScenarioFromText(text.dump(), "'file'", ".");
  EXPECT_TRUE(file.imaging.exposureControl);
  EXPECT_TRUE(file.imaging.heartShadowMoves);
  EXPECT_GT(file.imaging.breathing.rate, 0.0);
  EXPECT_TRUE(coronary::SamePatient(old.imaging, file.imaging));
  Scenario other = file;
  other.imaging.energy = 70.0;
  EXPECT_FALSE(coronary::SamePatient(other.imaging, file.imaging));
}

TEST(UnitTestScenario, RefusesWithThePlace)
{
  Refused([](json& s) { s["wire"] = "spaghetti"; }, "no wire 'spaghetti'");
  Refused([](json& s) { s["catheter"] = 7; }, "'catheter': 7 is no object");
  Refused([](json& s) { s["wire"]["sections"][0]["torsional_stiffness_N_mm2"] = -1; },
    "wire 'workhorse', section 1 has a negative 'torsional_stiffness_N_mm2'");
  Refused([](json& s) { s["settings"]["tick_rate_hz"] = 1; }, "settings has 'tick_rate_hz'");
  Refused([](json& s) { s["settings"]["heartrate"] = 60; }, "'heartrate', which means nothing");
  Refused([](json& s) { s["settings"]["capacity"] = 1.5; }, "'capacity'");
  Refused([](json& s) { s["artery"] = "aorta"; }, "'aorta' is none of LCA, RCA, any");
  Refused([](json& s) { s["vessels"]["run"] = "x"; }, "one of 'phantom', 'run' and 'surface'");
  Refused([](json& s) { s["vessels"] = json::object(); }, "one of 'phantom', 'run' and 'surface'");
  Refused([](json& s) { s["vessels"]["phantom"]["seed"] = -1; }, "'seed'");
  Refused([](json& s) { s["vessels"]["phantom"]["dominance"] = "up"; }, "none of right, left");
  Refused([](json& s) { s["vessels"]["motion"] = { { "model", "jump" } }; }, "none of automatic");
  Refused(
    [](json& s)
    {
      s["vessels"] = { { "surface", "a.vtp" }, { "centerline", "b.vtp" },
        { "motion", { { "model", "tracked" } } } };
    },
    "tracked motion, which only a run has");
  Refused(
    [](json& s) {
      s["vessels"]["motion"] = { { "model", "contraction" }, { "axial_mm", -1 } };
    },
    "negative 'axial_mm'");
  Refused(
    [](json& s) {
      s["vessels"]["motion"] = { { "model", "contraction" }, { "base_mm", { 1, 2, 3 } } };
    },
    "only one of");
  Refused([](json& s) { s["version"] = 3; }, "another 'version'");
  Refused([](json& s) { s.erase("name"); }, "has no 'name'");
  EXPECT_THROW(LoadScenario("no-such-scenario"), std::runtime_error);
  EXPECT_THROW(ScenarioFromText("[1, 2", "'x'", "."), std::runtime_error);
}

TEST(UnitTestScenario, PathsAreThoseBesideTheFile)
{
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("scenario test." + std::to_string(getpid()));
  fs::create_directories(folder);
  json text = json::parse(ScenarioText(LoadScenario("phantom-lca")));
  text["vessels"] = { { "run", "results/1" } };
  text["catalogue"] = "own.json";
  text["wire"] = "mine";
  std::ofstream(folder / "s.json") << text.dump();
  EXPECT_THROW(LoadScenario((folder / "s.json").string()), std::runtime_error) << "no catalogue";
  std::ifstream file(DYNAMICCORONARY_SOURCE_DIR "/Simulator/Session/instruments.json");
  json catalogue = json::parse(file);
  catalogue["wires"][0]["name"] = "mine";
  std::ofstream(folder / "own.json") << catalogue.dump();
  const Scenario scenario = LoadScenario((folder / "s.json").string());
  EXPECT_EQ(scenario.vessels.path, (folder / "results/1").string());
  EXPECT_EQ(scenario.wire.name, "mine");
  EXPECT_EQ(scenario.vessels.motion, coronary::VesselMotion::Automatic);
  fs::remove_all(folder);
}

TEST(UnitTestScenario, RootsAreFoundByName)
{
  coronary::WallTopology topology;
  topology.axis.resize(3);
  topology.parent = { -1, 0, -1 };
  topology.groupName = { "LM", "pLAD", "pRCA" };
  EXPECT_EQ(coronary::RootBranch(topology, "LCA"), 0);
  EXPECT_EQ(coronary::RootBranch(topology, "RCA"), 2);
  EXPECT_EQ(coronary::RootBranch(topology, "any"), 0);
  topology.groupName = { "LM", "pLAD", "x" };
  ExpectRefusal([&] { coronary::RootBranch(topology, "RCA"); }, "their roots are 'LM', 'x'");
}

TEST(UnitTestScenario, ScriptsAreEvenPieces)
{
  const auto script =
    coronary::DriveScriptFromText(R"({ "format": "dynamiccoronary script", "version": 1,
    "pieces": [ { "seconds": 4, "wire_mm": 20 }, { "seconds": 0, "wire_deg": 90 },
      { "seconds": 2, "wire_mm": -10, "catheter_mm": 1, "heart_rate_bpm": 90, "exchange_wire": 1 } ] })",
      "'script'");
  EXPECT_EQ(script.Duration(), 6.0);
  EXPECT_EQ(script.At(-1.0).drive.wirePosition, 0.0);
  EXPECT_EQ(script.At(1.0).drive.wirePosition, 5.0);
  EXPECT_EQ(script.At(3.999).drive.wireAngle, 0.0);
  EXPECT_NEAR(script.At(4.0).drive.wireAngle, M_PI / 2.0, 1e-15);
  EXPECT_EQ(script.At(5.0).drive.wirePosition, 15.0);
  EXPECT_EQ(script.At(5.0).drive.catheterPosition, 0.5);
  EXPECT_EQ(script.At(100.0).drive.wirePosition, 10.0);
  EXPECT_TRUE(script.Events(0.0, 4.0).empty());
  const std::vector<coronary::RecordedEvent> events = script.Events(4.0, 4.0005);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].kind, coronary::RecordedEvent::HeartRate);
  EXPECT_EQ(events[0].value, 90.0);
  EXPECT_EQ(events[1].kind, coronary::RecordedEvent::ExchangeWire);
  EXPECT_EQ(events[1].value, 1.0);
  EXPECT_TRUE(script.Events(4.0005, 9.0).empty());
  EXPECT_EQ(coronary::DriveScript().At(1.0).drive.wirePosition, 0.0);
  const auto refused = [](const std::string& pieces, const std::string& part)
  {
    ExpectRefusal(
      [&]
      {
        coronary::DriveScriptFromText(
          R"({ "format": "dynamiccoronary script", "version": 1, "pieces": )" + pieces + "}",
          "'s.json'");
      },
      part);
  };
  refused(R"([ { "seconds": -1 } ])", "'s.json', piece 1 has a negative 'seconds'");
  refused(R"([ { "seconds": 1 }, { "seconds": 1, "wire": 3 } ])", "piece 2 has 'wire'");
  refused(R"([ { "seconds": 1, "heart_rate_bpm": 900 } ])", "'heart_rate_bpm'");
  refused(R"([ { "seconds": 1, "exchange_wire": -1 } ])", "'exchange_wire'");
  refused(R"([ { "seconds": 1, "breaths_per_min": 61 } ])", "'breaths_per_min'");
  refused(R"([ { "wire_mm": 1 } ])", "has no 'seconds'");
  refused("3", "is no list");
}

TEST(UnitTestScenario, ScriptsMoveSyringePedalsAndView)
{
  const auto script =
    coronary::DriveScriptFromText(R"({ "format": "dynamiccoronary script", "version": 1,
    "pieces": [ { "seconds": 2, "inject_mL": 4, "pedals": ["fluoroscopy", "mask"] },
      { "seconds": 2, "primary_deg": -30, "secondary_deg": 20, "source_to_detector_mm": -40,
        "table_x_mm": 10, "table_y_mm": -20, "table_z_mm": 30 },
      { "seconds": 1, "pedals": ["cine"] }, { "seconds": 1, "pedals": [] } ] })",
      "'script'");
  coronary::SessionInput start;
  start.drive = { 5.0, 0.5, 2.0, 0.25 };
  start.syringe = 1.0;
  start.primary = 0.3;
  start.secondary = -0.1;
  start.sourceToDetector = 1000.0;
  start.table = Vector3(1.0, 2.0, 3.0);
  EXPECT_EQ(script.At(-1.0, start).syringe, 1.0);
  EXPECT_EQ(script.At(-1.0, start).pedals, 0U) << "not yet begun";
  const auto injecting = script.At(1.0, start);
  EXPECT_EQ(injecting.syringe, 3.0);
  EXPECT_EQ(injecting.pedals, coronary::FluoroscopyPedal | coronary::MaskPedal);
  EXPECT_EQ(injecting.primary, 0.3);
  EXPECT_EQ(injecting.drive.wirePosition, 5.0);
  EXPECT_EQ(injecting.drive.catheterAngle, 0.25);
  const auto turning = script.At(3.0, start);
  EXPECT_EQ(turning.syringe, 5.0);
  EXPECT_EQ(turning.pedals, injecting.pedals) << "until they are set again";
  EXPECT_NEAR(turning.primary, 0.3 - M_PI / 12.0, 1e-15);
  EXPECT_NEAR(turning.secondary, -0.1 + M_PI / 18.0, 1e-15);
  EXPECT_EQ(turning.sourceToDetector, 980.0);
  EXPECT_EQ(turning.table, Vector3(6.0, -8.0, 18.0));
  EXPECT_EQ(script.At(4.5, start).pedals, coronary::CinePedal);
  EXPECT_EQ(script.At(5.5, start).pedals, 0U);
  const auto after = script.At(100.0, start);
  EXPECT_EQ(after.table, Vector3(11.0, -18.0, 33.0));
  EXPECT_EQ(after.pedals, 0U);
  EXPECT_EQ(script.At(100.0).sourceToDetector, coronary::SessionInput().sourceToDetector - 40.0);
  const auto refused = [](const std::string& member, const std::string& part)
  {
    ExpectRefusal(
      [&]
      {
        coronary::DriveScriptFromText(
          R"({ "format": "dynamiccoronary script", "version": 1, "pieces": [ { "seconds": 1, )" +
            member + "} ] }",
          "'s.json'");
      },
      part);
  };
  refused(R"("inject_mL": -1)", "piece 1 has a negative 'inject_mL'");
  refused(R"("pedals": ["brake"])", "'brake', which is none of fluoroscopy, cine, mask");
  refused(R"("pedals": [7])", "'7', which is none of");
  refused(R"("pedals": "cine")", "is no list");
  refused(R"("primary_deg": 1000)", "'primary_deg'");
  refused(R"("table_x_mm": "far")", "'table_x_mm'");
}

TEST(UnitTestScenario, TheContractionIsSmoothAndPeriodic)
{
  const double systole = 0.35;
  EXPECT_NEAR(coronary::ContractionCurve(0.0, systole), 0.0, 1e-15);
  EXPECT_NEAR(coronary::ContractionCurve(systole, systole), 1.0, 1e-15);
  EXPECT_NEAR(coronary::ContractionCurve(0.7, systole), 0.2, 1e-12);
  const double h = 1e-4;
  for (int n = 0; n < 10000; ++n)
  {
    const double t = n * h;
    const double now = coronary::ContractionCurve(t, systole);
    EXPECT_GE(now, -1e-12);
    EXPECT_LE(now, 1.0 + 1e-12);
    EXPECT_NEAR(coronary::ContractionCurve(t + 7.0, systole), now, 1e-9);
    // The second derivative does not jump, not at the cycle's end either.
    const double bend = (coronary::ContractionCurve(t + h, systole) - 2.0 * now +
                          coronary::ContractionCurve(t - h, systole)) /
      (h * h);
    const double bendAfter = (coronary::ContractionCurve(t + 2.0 * h, systole) -
                               2.0 * coronary::ContractionCurve(t + h, systole) + now) /
      (h * h);
    EXPECT_LT(std::abs(bend - bendAfter), 1.5) << t;
  }
}

TEST(UnitTestScenario, TheContractionIsAsFastAsItMayBe)
{
  const auto rest = std::make_shared<RestingVessel>();
  coronary::ContractionSettings settings;
  settings.axial = 25.0;
  coronary::ContractionMotion motion(rest, settings);
  EXPECT_LE(motion.PeakSpeed(), 108.6);
  EXPECT_GT(motion.PeakSpeed(), 107.0);
  EXPECT_LT(motion.Settings().axial, 25.0);
  std::vector<Vector3> now;
  std::vector<Vector3> later;
  double fastest = 0.0;
  for (int n = 0; n < 800; ++n)
  {
    motion.Positions(n / 800.0, now);
    motion.Positions((n + 1) / 800.0, later);
    for (std::size_t k = 0; k < now.size(); ++k)
    {
      fastest = std::max(fastest, (later[k] - now[k]).norm() * 1000.0);
    }
  }
  EXPECT_NEAR(fastest, 108.6, 1.5);
  motion.Positions(0.0, now);
  for (std::size_t k = 0; k < now.size(); ++k)
  {
    EXPECT_LT((now[k] - rest->Points[k]).norm(), 1e-12);
  }
  motion.AxisPositions(0.35, later);
  // The base comes down, the apex stays.
  EXPECT_GT((later.front() - rest->Still.axis[0].front()).norm(), 5.0);
  EXPECT_LT((later.back() - rest->Still.axis[0].back()).norm(), 1e-9);

  settings.axial = 3.0;
  settings.radial = 0.0;
  settings.twist = 0.0;
  coronary::ContractionMotion slow(rest, settings);
  EXPECT_EQ(slow.Settings().axial, 3.0) << "nothing to scale down";
  settings.base = Vector3(0, 0, 0);
  settings.apex = Vector3(0, 0, 5);
  ExpectRefusal([&] { coronary::ContractionMotion(rest, settings); }, "less than 20 mm");
  settings.radial = 0.9;
  ExpectRefusal([&] { coronary::ContractionMotion(rest, settings); }, "radial is 0.9");
}
}
