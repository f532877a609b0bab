/**
 * @file TrainingSession.h
 * @brief A procedure as a whole, tick by tick: instruments, contrast medium, exposures, and what is measured of the
 * trainee. Everything but the images.
 */
#ifndef DynamicCoronary_TrainingSession_h
#define DynamicCoronary_TrainingSession_h

#include "Acquisition.h"
#include "Breathing.h"
#include "CArm.h"
#include "ContrastModel.h"
#include "GuideLumen.h"
#include "Intervention.h"
#include "LesionWatch.h"
#include "Procedure.h"
#include "Recording.h"
#include "Scenario.h"
#include "SessionInput.h"
#include "SessionMetrics.h"
#include "VesselTears.h"
#include "VolumeProjector.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
struct SessionReport
{
  TickReport tick;
  double injection = 0.0; ///< mL/s that leave the catheter, whatever it is
  bool exposed = false;   ///< a frame is exposed at this tick: Exposure()
};

/// What the displays need of one moment. Vectors keep their memory from use to use.
struct SessionSnapshot
{
  std::uint64_t tick = 0;
  double seconds = 0.0;
  double heartRate = 0.0;
  TickReport report;
  SessionMetrics metrics;
  ContrastBalance contrast;
  double injection = 0.0; ///< mL/s
  double tipPressure =
    0.0; ///< mmHg, of the guide's tip: the aortic one, damped where it fills a vessel
  SessionInput input;
  CArmPose pose;
  double fieldOfView = 0.0; ///< mm
  Collimation shutters;
  double frameRate = 0.0; ///< Hz, of fluoroscopy
  double diaphragm = 0.0; ///< mm below its place at the end of expiration
  bool radiating = false;
  Exposure exposure;                   ///< the last one
  std::size_t wireNumber = 0;          ///< as WireOf
  std::vector<Vector3> wire;           ///< from its tip, mm
  std::size_t secondNumber = 0;        ///< likewise, of the second wire
  std::vector<Vector3> secondWire;     ///< empty: there is none
  std::vector<Vector3> catheter;       ///< from its tip, mm
  bool guideFromArch = false;          ///< it lies in the aorta, which is to be seen
  std::vector<Vector3> axis;           ///< as WallMotion::AxisPositions
  std::vector<double> concentration;   ///< as ContrastModel::Concentration
  std::vector<double> blush;           ///< per branch, mL
  std::vector<double> aorta;           ///< as AorticContrast::Concentration; empty: it has none
  std::vector<double> sinuses;         ///< mL, as AorticContrast::Sinuses; likewise
  std::vector<GuideLumen::Plug> guide; ///< in the guide catheter, from its tip; empty: not followed
  ///@{
  /// With a balloon, else empty.
  std::vector<double> lumen;        ///< mm, per point of the axis
  std::vector<double> filled;       ///< mm, likewise: of the balloon catheter in it
  std::vector<Vector3> balloon;     ///< its line from its tip to where the simulated wire ends, mm
  std::vector<double> balloonRadii; ///< mm, outside
  std::size_t balloonNumber = 0;    ///< as BalloonOf
  std::vector<StentShape> stents;
  ///@}
  std::vector<VesselTear> tears;     ///< of walls
  ProcedureState procedure;          ///< of a scenario's steps
  std::vector<LesionResult> lesions; ///< only of SnapshotOfScene
  std::vector<StentResult> results;  ///< only of SnapshotOfScene: of the stents in the wall
  std::vector<MouthResult> mouths;   ///< only of SnapshotOfScene: of side branches
  std::vector<Vector3> wall;         ///< only of SnapshotOfScene
  std::vector<Vector3> tracers;      ///< only of SnapshotOfScene, mm
  std::vector<float> tracerVolumes;  ///< mL of contrast medium
};

/// Hands and feet at rest, the C-arm where the scenario has it.
SessionInput StartInputOf(const Scenario& scenario);

/// In front of a session's recording. @param build  program and version  @param started  UTC, ISO 8601
RecordingHeader HeaderOf(const Scenario& scenario, std::uint64_t wallHash, const std::string& build,
  const std::string& started);

/// What of a tick is recorded.
RecordedForces ForcesOf(const TickReport& report);

/**
 * Deterministic: the same binary, vessels, scenario, inputs and events give the same bits. One thread.
 */
class TrainingSession
{
public:
  /// @param patient  that the exposure control measures; null: dose is as without control
  /// @throws std::invalid_argument naming what is wrong with vessels, scenario, instruments
  TrainingSession(std::shared_ptr<WallMotion> wall, const Scenario& scenario,
    std::shared_ptr<const VolumeProjector> patient = nullptr);
  ~TrainingSession();
  TrainingSession(const TrainingSession&) = delete;
  TrainingSession& operator=(const TrainingSession&) = delete;

  /// StartInputOf its scenario.
  const SessionInput& StartInput() const;

  /// One step of 1 / tickRate.
  const SessionReport& Step(const SessionInput& input);

  /// Before the next step. @return false: not known, nothing is changed
  bool Apply(const RecordedEvent& event);

  const SessionReport& Report() const;
  const SessionMetrics& Metrics() const;
  const Intervention& Instruments() const;
  const ContrastModel& Contrast() const;
  ContrastBalance Balance() const; ///< with what is in the guide catheter
  std::vector<LesionResult> Lesions() const;
  std::vector<StentResult> Stents() const; ///< that are in the wall
  std::vector<MouthResult> Mouths() const; ///< of side branches that are not thin
  const std::vector<VesselTear>& Tears() const;
  const ProcedureState& Procedure() const;
  /// Of the scenario's procedure, as far as it went.
  ProcedureScore Score() const;
  const WallTopology& Topology() const;
  const CArmPose& Pose() const;
  double FieldOfView() const; ///< mm of the detector, across
  double TickRate() const;
  std::uint64_t Ticks() const;

  /// Of the instruments; of contrast medium and exposures as well when there have been any.
  std::uint64_t StateHash() const;

  /// What was clamped or reset since the last call, a sentence each.
  std::vector<std::string> TakeMessages();

  ///@{
  /// What an X-ray image, what the view of the anatomy needs.
  void SnapshotOfImage(SessionSnapshot& snapshot) const;
  /// @param wallPoints  numbers of the wall's points that SessionSnapshot::wall is of
  void SnapshotOfScene(
    const std::vector<std::int64_t>& wallPoints, SessionSnapshot& snapshot) const;
  ///@}

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
