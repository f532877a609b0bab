/**
 * @file Scenario.h
 * @brief What a session is about: vessels, their motion, instruments and settings. docs/simulator-files.md has the
 * format of the files.
 */
#ifndef DynamicCoronary_Scenario_h
#define DynamicCoronary_Scenario_h

#include "ContractionMotion.h"
#include "CoronaryPhantom.h"
#include "Instrument.h"
#include "Intervention.h"
#include "WallMotion.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
enum class VesselMotion
{
  Automatic, ///< tracked if there is a tracked motion, else still
  Tracked,   ///< that of the run
  Still,
  Contraction ///< by formula
};

/// Where the vessels are from.
struct VesselSource
{
  enum class Kind
  {
    Phantom,
    Run,    ///< a folder of coronary-pipeline run
    Surface ///< a closed surface and its centerline tree
  };
  Kind kind = Kind::Phantom;
  std::string path;       ///< of Run and Surface; empty: the user has to say
  std::string centerline; ///< of Surface
  PhantomSettings phantom;
  VesselMotion motion = VesselMotion::Automatic;
  ContractionSettings contraction;
};

struct Scenario
{
  std::string name;
  std::string description;
  VesselSource vessels;
  std::string artery = "LCA"; ///< LCA, RCA, or "any": the first root
  Guidewire wire;
  GuideCatheter catheter;
  InterventionSettings settings;
  std::uint64_t seed = 1; ///< of what is random in a session; the phantom has its own
};

/**
 * @param origin  of the text, for messages
 * @param folder  that paths in the text are relative to
 * @throws std::runtime_error: no JSON, no such catalogue; std::invalid_argument naming origin and member
 */
Scenario ScenarioFromText(
  const std::string& text, const std::string& origin, const std::string& folder);

/// JSON that says everything, the instruments' values included; reading it gives the same bits.
std::string ScenarioText(const Scenario& scenario);

struct BuiltInScenario
{
  std::string name;
  std::string description;
};
std::vector<BuiltInScenario> BuiltInScenarios();

/// @param name  of a built-in scenario, or a file
/// @throws as ScenarioFromText; std::runtime_error: neither
Scenario LoadScenario(const std::string& name);

/**
 * The branch whose ostium the catheter is in.
 * @throws std::invalid_argument  there is no root of this artery; it names those that there are
 */
int RootBranch(const WallTopology& topology, const std::string& artery);
}

#endif
