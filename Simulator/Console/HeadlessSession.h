/**
 * @file HeadlessSession.h
 * @brief A session on one thread with a clock of ticks: no window, no device, as fast as the machine can.
 */
#ifndef DynamicCoronary_HeadlessSession_h
#define DynamicCoronary_HeadlessSession_h

#include "Scenario.h"
#include "SessionWorld.h"

#include <cstdint>
#include <string>

namespace coronary
{
struct HeadlessOptions
{
  std::string scenario;       ///< file or built-in name; may be empty with replay
  std::string patient;        ///< images in place of the scenario's vessels and background
  std::string vessels;        ///< folder in place of the scenario's vessels; of the patient's model
  std::string wire;           ///< of the built-in catalogue, in place of the scenario's
  std::string catheter;       ///< likewise
  std::string balloon;        ///< likewise
  bool guideFromArch = false; ///< the scenario's guide has to be brought to the ostium
  std::string replay;         ///< recording to go through
  std::string script;         ///< or script
  std::string record;         ///< recording to write
  std::string output;         ///< folder
  std::uint64_t ticks = 0;    ///< 0: to the end of replay or script
  double outputRate = 20.0;   ///< Hz
  double heartRate = -1.0;    ///< beats a minute; negative: the scenario's
  bool verify = false;        ///< hashes have to be those of the recording
  bool writeWall = false;
  bool xray = false;  ///< X-ray frames as pictures
  bool scene = false; ///< the anatomy as pictures
  bool quiet = false;
};

/// The scenario with what the options change.
/// @throws UsageError, as LoadScenario
Scenario ScenarioOf(const HeadlessOptions& options);

/// The world of the options' session. A patient's model is made first, where it is not there.
/// @throws as MakePatientModel, LoadWorld
SessionWorld WorldOf(const HeadlessOptions& options, const Scenario& scenario, bool background,
  const WorldProgress& progress);

/// What a recording has to have in common with the session that replays it.
/// @throws std::runtime_error  another tick rate; other vessels, if that is not allowed
void CheckRecording(const std::string& path, const Scenario& scenario, std::uint64_t wallHash,
  bool otherVesselsAllowed);

/**
 * Runs, writes, and prints a summary on standard output.
 * @throws UsageError, Cancelled; std::exception with one sentence otherwise
 */
void RunHeadless(const HeadlessOptions& options);

/// A recording as JSON, a line an item, on standard output.
/// @throws std::runtime_error  when it is torn or damaged, after all that is good was printed
void DumpRecording(const std::string& path);

/// The instruments that are built in, a line each, on standard output.
void ListInstruments();
}

#endif
