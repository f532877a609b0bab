/**
 * @file Scenario.h
 * @brief What a session is about: vessels, their motion, instruments and settings. docs/simulator-files.md has the
 * format of the files.
 */
#ifndef DynamicCoronary_Scenario_h
#define DynamicCoronary_Scenario_h

#include "Breathing.h"
#include "CArm.h"
#include "ContrastModel.h"
#include "Instrument.h"
#include "Intervention.h"
#include "VesselIncidents.h"
#include "VesselLesions.h"
#include "VesselSource.h"
#include "WallMotion.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace coronary
{
/// What the C-arm sees, and how it stands at the start.
struct ImagingSettings
{
  std::string background; ///< CT file or folder; empty: the thorax phantom about the heart
  std::string
    backgroundRun; ///< folder of the run that was made of that CT: it says which phase, and where the CT's contrast medium is
  Vector3 backgroundOffset{ Vector3::Zero() }; ///< mm that the CT is moved to fit the vessels
  std::uint64_t thoraxSeed = 1;                ///< of the thorax phantom
  CArmPose pose; ///< with the isocentre in the middle of the vessels, unless it is given
  bool hasIsocentre = false;    ///< pose.isocentre is given, LPS, mm
  double fieldOfView = 200.0;   ///< mm of the detector, across, 80 to 400
  int columns = 512;            ///< of the image, and rows, 64 to 2048
  double energy = 60.0;         ///< keV, effective, 30 to 120
  double iodine = 350.0;        ///< mg/mL of the contrast medium, 0 to 500
  double frameRate = 15.0;      ///< Hz of fluoroscopy: 7.5, 15 or 30
  double cineRate = 15.0;       ///< Hz of cine
  bool exposureControl = true;  ///< dose follows the patient's thickness
  bool heartShadowMoves = true; ///< with the arteries; false: as in the CT
  BreathingSettings breathing;
};

/// Whether what is seen behind the vessels is one and the same.
bool SamePatient(const ImagingSettings& a, const ImagingSettings& b);

/// Of a procedure: what is to be done before the next one.
struct ProcedureStep
{
  enum class Goal
  {
    Angiogram,    ///< value: cine runs with contrast medium, from views at least 25 degrees apart
    GuideIn,      ///< the guide catheter's tip is in the ostium
    WireIn,       ///< the wire's tip is in `vessel`, or behind it
    WireAtLesion, ///< value: mm before the lesion's beginning, at most, on the way to it
    WireBeyondLesion,      ///< value: mm of wire behind the lesion
    WireTaken,             ///< value: number of the wire, as WireOf
    BalloonTaken,          ///< value: number of the balloon or microcatheter, as BalloonOf
    MicrocatheterAtLesion, ///< value: as WireAtLesion, of a microcatheter's tip
    BalloonInLesion,       ///< value: atm of a balloon whose middle is in the lesion
    StentInLesion,         ///< a stent is in it
    StenosisBelow,         ///< value: per cent of the diameter, without an open balloon
    ReserveAbove,          ///< value: FFR, likewise
    WireBack,              ///< wires and balloon are in the guide, or `wire` is
    SideBranchOpen,        ///< value: FFR in the side branch `vessel`, without an open balloon
    LeakStopped,           ///< a wall is perforated, and nothing comes out
    LeakSealed             ///< likewise, and all holes have closed
  };
  Goal goal = Goal::Angiogram;
  std::string text;   ///< what to do, for people
  std::string vessel; ///< of WireIn; of the lesion, else the narrowest of the session's beginning
  double value = 0.0;
  int wire = -1; ///< of WireIn, WireBack: 0 the first, 1 the second; -1: the one in hand, all
};

/// Words of scenario files for it, and for its value. @param value  null: it has none
const char* NameOf(ProcedureStep::Goal goal, const char*& value);

struct Scenario
{
  std::string name;
  std::string description;
  VesselSource vessels;
  std::string artery = "LCA"; ///< LCA, RCA, or "any": the first root
  Guidewire wire;
  std::vector<Guidewire> wireExchanges; ///< for it, in their order
  std::optional<Guidewire> secondWire;  ///< in the same guide
  GuideCatheter catheter;
  std::optional<BalloonCatheter> balloon; ///< or microcatheter; none: the session has none
  std::vector<BalloonCatheter> exchanges; ///< for it, in their order; none without a balloon
  std::vector<VesselLesion> lesions;      ///< set into the vessels
  std::vector<Incident> incidents;        ///< what goes wrong
  std::vector<ProcedureStep> procedure;   ///< what a trainee is to do; none: to drive about
  InterventionSettings settings;
  bool heartRateOfVessels =
    false; ///< none was given: that of the vessels' motion, where it is known
  ImagingSettings imaging;
  ContrastSettings contrast;
  std::uint64_t seed = 1; ///< of what is random in a session; the phantom has its own
};

/**
 * @param origin  of the text, for messages
 * @param folder  that paths in the text are relative to
 * @throws std::runtime_error: no JSON, no such catalogue; std::invalid_argument naming origin and member
 */
Scenario ScenarioFromText(
  const std::string& text, const std::string& origin, const std::string& folder);

/// Of a recording's header: what a recording of before its time does not know was not there.
/// @throws as ScenarioFromText
Scenario RecordedScenario(const std::string& text, const std::string& origin);

/// @param number  0: the session begins with it; else of its exchanges; null: there is none
const BalloonCatheter* BalloonOf(const Scenario& scenario, std::size_t number);
/// Likewise; behind the exchanges comes the second wire.
const Guidewire* WireOf(const Scenario& scenario, std::size_t number);

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
