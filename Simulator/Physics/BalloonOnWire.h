/**
 * @file BalloonOnWire.h
 * @brief A balloon catheter or microcatheter as a sleeve on the simulated wire, its balloon against the vessel's wall, and the
 * stent that it leaves there.
 */
#ifndef DynamicCoronary_BalloonOnWire_h
#define DynamicCoronary_BalloonOnWire_h

#include "CosseratRod.h"
#include "DilatableWall.h"
#include "Instrument.h"

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
/// Of one tick.
struct BalloonReport
{
  bool microcatheter = false; ///< it is one: middle and place are those of its tip
  double tip = 0.0;      ///< mm of the balloon catheter's tip beyond the guide's; negative: within
  double pressure = 0.0; ///< atm in the balloon
  double force = 0.0;    ///< N at the hand, against advancing
  double grip = 0.0;     ///< N that hold it in the wall at most
  double least = 0.0;    ///< mm, diameter of the balloon's even part: its waist
  double greatest = 0.0; ///< mm
  double wallPressure = 0.0; ///< atm on the wall, greatest
  double stretch =
    0.0; ///< greatest diameter of the wall that it holds, over the reference; 0: it holds none
  std::int64_t place = -1;     ///< point of the axes at the balloon's middle; -1: in the guide
  double middle = 0.0;         ///< mm from the ostium, of that
  std::int64_t stretched = -1; ///< point of the axes where `stretch` is
  double stretchedPlace = 0.0; ///< mm from the ostium, likewise
  double ringStretch =
    0.0; ///< greatest diameter of a stent's ring that it holds, over its design's greatest
  std::int64_t ringPoint = -1; ///< where that is
  double ringPlace = 0.0;      ///< mm from the ostium, likewise
  bool crimped = false;        ///< its stent is on it
  bool caught = false; ///< it is to be inflated, but its stent is still in the guide: it is not
};

/// A stent that is left in the wall: rings at the points of the axes, which move with the vessel.
struct PlacedStent
{
  std::string name; ///< of its balloon
  StentDesign design;
  double middle = 0.0;              ///< mm from the ostium
  std::vector<std::int64_t> points; ///< of the axes, from the ostium on
  std::vector<double> places;       ///< mm from the ostium, of these
  std::vector<std::size_t> rings;   ///< which of DilatableWall::Rings there
  double beyond = 0.0;              ///< mm of it that have no vessel around
};

/// A joint of a wire within a straight sleeve: stiffnesses add, and what is curved at rest is straightened.
/// @param stiffness  N mm/rad of the sleeve, about each axis across
RodJoint SleevedJoint(const RodJoint& wire, double stiffness);
/// Likewise of one that a sleeve's end is in: both pieces bend, one behind the other, by the same moment.
/// @param part  of it that is within, 0 to 1
RodJoint EnteredJoint(const RodJoint& wire, double stiffness, double part);

/**
 * The sleeve does not stretch on the wire and is bent with it; it takes no torsion. Places along the way are those of the
 * simulated wire: u = 0 at the ostium.
 *
 * What resists its way is Coulomb friction: on the wire, of contacts with wall and guide, and of the wall that it holds open.
 * The hand is on a spring (the shaft), so an inflated balloon sticks until the spring pulls it off.
 *
 * Balloon, stent and wall are at balance in each section of the axis: free radius at (p - p_stent(R) - p_wall(R + strut)) = R.
 * The balloon fills through a resistance: dV/dt = (p_hand - p) / R, V that of all sections.
 *
 * The wire's tip stays WireAhead before the sleeve's. A balloon that the wire is drawn into goes back with it; a microcatheter out
 * of the guide is held by its hand, and the wire stops there: it does not lead the wire.
 *
 * A stent goes with its balloon until the pressure opens it; from then on its rings belong to the wall where it is. Before all of
 * it is out of the guide, the balloon takes no pressure.
 */
class BalloonOnWire
{
public:
  /// @param start  u of its tip
  BalloonOnWire(const BalloonCatheter& balloon, const GuideCatheter& guide, double start);

  /// The wire it is on.
  struct Rail
  {
    double fed = 0.0;                            ///< u of the wire's tip
    double catheterTip = 0.0;                    ///< u
    const std::vector<double>* places = nullptr; ///< of the segments' centres from the tip, mm
    const std::vector<RodSegment>* segments = nullptr; ///< without sleeve
    const std::vector<RodJoint>* joints = nullptr;     ///< without sleeve
  };

  /**
   * A tick, before the rod's step.
   * @param way  mm that the hand advances  @param most  mm that a sleeve can go in a tick
   * @param share  of the key frame that is over, 0 to 1
   * @return false: it can go no further
   */
  bool Drive(double way, double most, const Rail& rail, double share, CosseratRod& rod);
  /// After the rod's step: what its contacts resist.
  void Feel(const CosseratRod& rod, const Rail& rail);

  /**
   * A key frame: the balloon follows the hand's pressure, and holds the wall open.
   * @param pressure  atm at the inflator  @param place  mm from the ostium along `way` of the balloon's middle
   */
  void Inflate(double seconds, double pressure, double place, double catheterTip,
    const VesselWay& way, DilatableWall& wall);

  /// The balloon; its table is that without a stent.
  const BalloonCatheter& Device() const { return this->Balloon; }
  /// That it came with.
  const std::optional<StentDesign>& Stent() const { return this->System.stent; }
  /// The stent that was left in the wall since the last call.
  std::optional<PlacedStent> TakePlaced() { return std::exchange(this->Placed, std::nullopt); }
  double Tip() const { return this->Place; } ///< u
  /// u that the wire's tip can be drawn back to: of a microcatheter.
  double LeastWire() const
  {
    return this->Balloon.IsMicrocatheter() ? this->Place + this->WireAhead()
                                           : -std::numeric_limits<double>::infinity();
  }
  bool Covers(double behind) const { return behind >= 0.0 && behind <= this->Balloon.monorail; }
  const BalloonReport& Report() const { return this->Report_; }
  /// mm, outside, now: `spacing` from each other from the tip on.
  double RadiusAt(double behind) const;
  /// The balloon is open there.
  bool Opened(double behind) const;
  static constexpr double Spacing = 0.5; ///< mm
  /// mm on the axis' sections that it is in now: point and radius.
  const std::vector<std::pair<std::int64_t, double>>& Sections() const { return this->Inside; }
  double Volume() const { return this->Filled; } ///< mL

  std::uint64_t Hash(std::uint64_t hash) const;

private:
  struct Section
  {
    std::int64_t point = -1;
    double behind = 0.0; ///< mm behind the tip
    double place = 0.0;  ///< mm from the ostium
    double length = 0.0; ///< mm of the axis
    double folded = 0.0; ///< mm
    double shape = 0.0;
    double rest = 0.0;    ///< mm: where nothing presses
    double radius = 0.0;  ///< mm, of what is around the balloon
    double balloon = 0.0; ///< mm
    double pressed = 0.0; ///< atm on what is around it
    bool crimped = false; ///< a stent holds it folded
  };

  double WireAhead() const; ///< mm
  double FoldedAt(double behind) const
  {
    return this->Report_.crimped ? this->System.CrimpedRadius(behind)
                                 : this->Balloon.FoldedRadius(behind);
  }
  bool Crimped(double behind) const;
  void LeaveStent(const VesselWay& way, DilatableWall& wall);
  double FillAt(double pressure, const DilatableWall& wall);
  void Balance(Section& section, double pressure, const DilatableWall& wall) const;
  double BalloonRadius(const Section& section, double pressure) const;
  void Summarize(DilatableWall& wall);
  void SummarizeWall(const Section& section, const DilatableWall& wall);
  void Outline();

  BalloonCatheter System; ///< with its stent
  BalloonCatheter Balloon;
  double Opens = 0.0; ///< atm from which its stent does
  std::optional<PlacedStent> Placed;
  GuideCatheter Guide;
  double Start = 0.0;
  double Place = 0.0;     ///< u of its tip
  double HandPlace = 0.0; ///< where the tip would be without resistance
  double Strain = 0.0;    ///< mm that friction on the wire is sheared by
  bool Begun = false;
  double LastOnWire = 0.0; ///< tip against the wire's, at the tick before
  double Rubbing = 0.0;    ///< N that contacts resist
  double Pressure = 0.0;   ///< atm
  double Filled = 0.0;     ///< mL
  double Share = 0.0;
  double HeldPlace = 0.0; ///< mm along the way, of its middle: where the wall holds it
  double Slid = 0.0;      ///< mm since the key frame, against what resists
  double Carry = 0.0;     ///< mm along the wire in this key frame, with the wall
  std::vector<Section> Loaded;
  std::vector<std::pair<std::int64_t, double>> Inside;
  std::vector<double> OuterNow; ///< mm, outside
  std::vector<double> OuterNext;
  BalloonReport Report_;
};
}

#endif
