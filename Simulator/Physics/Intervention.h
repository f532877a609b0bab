/**
 * @file Intervention.h
 * @brief A guidewire, driven from outside through a guide catheter, in the beating coronary arteries.
 */
#ifndef DynamicCoronary_Intervention_h
#define DynamicCoronary_Intervention_h

#include "BalloonOnWire.h"
#include "BranchMouths.h"
#include "DriveInput.h"
#include "Geometry.h"
#include "GuideInAorta.h"
#include "Instrument.h"
#include "OcclusionPlug.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
class WallMotion;

struct InterventionSettings
{
  double tickRate = 2000.0;     ///< steps a second, 500 to 20000
  int ticksPerFrame = 33;       ///< between key frames of the wall: 60.6 Hz at 2 kHz
  double heartRate = 75.0;      ///< beats a minute, 0 (pause) to 240
  double startPhase = 0.0;      ///< fraction of the R-R interval
  double segmentLength = 1.5;   ///< mm of the simulated wire, 0.5 to 4
  int capacity = 140;           ///< simulated segments at most, 20 to 1000
  double insideCatheter = 12.0; ///< mm of the wire that are simulated inside the catheter
  int rootBranch = -1;          ///< branch whose ostium is engaged; -1: as the artery says
  double engagement = 3.0;      ///< mm from the ostium to the catheter's tip along the vessel
  /// Where there is an aorta, the catheter is elastic, lies in it at the beginning and has to be brought to the ostium; else it is
  /// rigid there.
  bool guideFromArch = false;
  double wallFriction = 1.0;   ///< factor on the wire's friction against the wall, 0 to 10
  double wallStiffness = 60.0; ///< N/mm of a sample's contact; harder where the bare wire is deep
  /// Pa s: per length, across and along the wire, against blood that moves with the walls. Blood's own is about
  /// 0.025; a hundred times that calms the jumps of the light tip, and is still nothing against friction.
  double drag = 2.5;
  double maximumSpeed = 300.0; ///< mm/s by which hands can advance; more is clamped, with a message
  double maximumTurning = 30.0; ///< rad/s, likewise
  bool wallTears = true;        ///< sessions: walls are dissected and perforated
  double sealTime =
    300.0; ///< s that a balloon has to be across a hole in the wall until it has closed
  bool branchesAnswer = true; ///< what opens a vessel narrows the mouths of its side branches

  /// @throws std::invalid_argument naming the setting
  void Validate() const;
};

/// A wire, of one tick.
struct WireReport
{
  double inserted = 0.0; ///< mm beyond the catheter's tip
  int branch = -1;       ///< group of the wall next to its tip; -1 in the catheter
  double force = 0.0;    ///< N at its hand, against advancing
  bool jailed = false;   ///< a stent was opened while it lay beside it, and it still does
  double held = 0.0;     ///< mm of it between the wall and a stent or balloon
  double grip = 0.0;     ///< N of friction there
};

/// Of one tick. What is said of a wire is of the one in hand.
struct TickReport
{
  static constexpr std::size_t MostWires = 2;

  std::uint64_t tick = 0;
  double phase = 0.0;    ///< fraction of the R-R interval, 0 to 1
  double inserted = 0.0; ///< mm of the wire beyond the catheter's tip
  double catheterTip =
    0.0;          ///< mm of the catheter beyond the ostium; negative: in the aorta, so far from it
  GuideSeat seat; ///< of a catheter from the arch
  double proximalForce = 0.0;  ///< N, against advancing
  double proximalTorque = 0.0; ///< N mm, against turning
  double tipForce = 0.0;     ///< N between the wire's last 3 mm and the wall, but for an occlusion
  double tipThrust = 0.0;    ///< N along it, of the wire's end on the wall, likewise
  double capForce = 0.0;     ///< N of the wire's tip on the tissue of an occlusion
  double maximumForce = 0.0; ///< N of a sample's contact
  int contacts = 0;          ///< samples that press on the wall
  double maximumPenetration = 0.0; ///< mm into the wall
  double meanPenetration = 0.0;    ///< mm, over the samples that touch
  double jointGap = 0.0;           ///< mm, greatest
  int outside = 0; ///< samples whose centre was outside of the lumen and was put back
  int branch = -1; ///< group of the wall next to the wire's tip; -1 in the catheter
  BalloonReport balloon;
  std::array<WireReport, MostWires> wires;
  std::size_t hand = 0; ///< number of the wire in hand
};

/// A stent as it lies now.
struct StentShape
{
  StentDesign design;
  std::vector<Vector3> line; ///< mm, from its end near the ostium on
  std::vector<double> radii; ///< mm, inside
};

/**
 * Runs at a fixed step, on one thread, and allocates nothing after the first ticks. The same binary,
 * model and input give the same bits.
 */
class Intervention
{
public:
  /// @throws std::invalid_argument naming what is wrong: instruments, settings, an instrument that does not fit
  /// into the vessel or the other ones
  /// @param second  another wire in the same guide; no hand is on it until it is taken
  Intervention(std::shared_ptr<WallMotion> wall, const Guidewire& wire,
    const GuideCatheter& catheter, const InterventionSettings& settings = {},
    const std::optional<BalloonCatheter>& balloon = {},
    const std::optional<Guidewire>& second = {});
  ~Intervention();
  Intervention(Intervention&&) noexcept;
  Intervention& operator=(Intervention&&) noexcept;

  /// One step of 1 / tickRate. Impossible input (not finite, too fast) is clamped, with a message.
  const TickReport& Step(const DriveInput& input);

  const TickReport& Report() const;

  void SetHeartRate(double beatsPerMinute); ///< 0: the heart stands still

  std::size_t NumberOfWires() const;
  /// From the next step on the hand drives this wire; the other one is held where it is.
  /// @return false: there is none
  bool TakeWire(std::size_t number);

  std::int64_t NumberOfSegments() const; ///< of the first wire that are simulated now
  /// Ends of a wire's simulated segments from the tip (first) to inside the catheter, one more than segments, mm.
  const std::vector<Vector3>& Centerline(std::size_t wire = 0) const;
  /// The catheter from its tip back, mm.
  const std::vector<Vector3>& CatheterLine() const;
  /// The balloon catheter from its tip to where the simulated wire ends, and its radii; empty without, or in the guide.
  void BalloonLine(std::vector<Vector3>& line, std::vector<double>& radii) const;
  /// The wall now, mm.
  const std::vector<Vector3>& WallPoints() const;
  /// Some of its points now. @param which  numbers of points, in range
  void SomeWallPoints(
    const std::vector<std::int64_t>& which, std::vector<Vector3>& positions) const;

  const GuideCatheter& Catheter() const;
  /// Points of the axes, in one list, that a catheter from the arch is around now: the first one, and how many.
  std::pair<std::int64_t, std::int64_t> GuideCovers() const;

  /// Null: there is no balloon in this session.
  const BalloonOnWire* Balloon() const;
  /// What the balloon opens; null without.
  const DilatableWall* Dilated() const;
  /// Mouths of side branches beside what was opened; empty without a balloon.
  const std::vector<BranchMouth>& Mouths() const;
  /// Stents that are left in the wall, in the order in which they were.
  const std::vector<PlacedStent>& Stents() const;
  /// These as they lie now, and last the one that is on the balloon.
  void StentShapes(std::vector<StentShape>& shapes) const;

  /**
   * Another balloon catheter in place of this one, on the wire in hand, before the next step.
   * @return false: this one is not wholly in the guide and empty; a message says so
   * @throws as RequireFit; std::logic_error: there is no balloon in this session
   */
  bool Exchange(const BalloonCatheter& balloon);
  /// Another wire in place of the one in hand, its tip where this one's was: both turned as the hand is, and at rest.
  /// Through a microcatheter it lies as this one did, which keeps its place.
  /// @return false: this one is neither wholly in the guide nor, but for MostOut, in a microcatheter; a message says so
  /// @throws as RequireFit
  bool Exchange(const Guidewire& wire);
  static constexpr double MostOut = 3.0; ///< mm beyond the microcatheter's tip

  const Guidewire& Wire(std::size_t number = 0) const;
  /// Tissue that fills vessels, and how far it was crossed.
  const std::vector<OcclusionPlug>& Plugs() const;

  /// FNV-1a over the bits of the wire's, the balloon's, the stents', the hands' and the heart's state. What the wall keeps to be faster, and the
  /// forces in the joints, follow from these and the ticks before.
  std::uint64_t StateHash() const;

  /// What was clamped or reset since the last call, one sentence each, every kind at most once a second.
  std::vector<std::string> TakeMessages();

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
