/**
 * @file VesselTears.h
 * @brief Walls that tear: dissections that narrow a vessel, holes that bleed into the pericardium, and what that does.
 */
#ifndef DynamicCoronary_VesselTears_h
#define DynamicCoronary_VesselTears_h

#include "ContrastModel.h"
#include "Intervention.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
class LesionWatch;
class WallMotion;

/// What a wall bears. docs/simulator.md has the sources, and what was chosen.
struct WallStrength
{
  double dissection =
    1.3; ///< diameter over reference, of wall that is free of calcium, from where it is dissected
  double rupture = 1.35; ///< likewise, from where it is perforated
  double stiffest =
    0.5; ///< of its circle that calcium keeps from stretching, at most: more of it cracks
  double puncture = 2.0;      ///< MPa under a wire's tip
  double punctureTime = 0.05; ///< s for which it has to last
};

/// Of the wall beside calcium: what of the circle does not stretch leaves it all to the rest.
/// @param stretch  diameter over reference @param calcium  part of the circle
double FreeStretch(double stretch, double calcium, const WallStrength& strength = {});
/// Of the diameter that a flap takes, 0 to 0.7. @param stretch  of free wall
double FlapOf(double stretch, const WallStrength& strength = {});
/// mm of the hole that a balloon tears. @param stretch  likewise, above rupture
double HoleOf(double stretch, const WallStrength& strength = {});
/// mL/s/mmHg: of an orifice (0.6 A sqrt(2 dp / rho)) at 80 mmHg. @param diameter  mm
double HoleConductance(double diameter);
/// N along it that a wire's tip presses through a wall with.
double PunctureForce(const Guidewire& wire, const WallStrength& strength = {});

/**
 * The sac about the heart. Acute pressure over volume: p = p1 (exp(V / V1) - 1), chosen to be 3 mmHg at 100 mL and 20 mmHg at
 * 200 mL. Stroke volume is 1 / (1 + p / 8 mmHg) of before: 0.43 at 10.5 mmHg and 0.29 at 20 mmHg, where dogs had 0.40 (Gonzalez
 * et al., J Am Coll Cardiol 1991;18:243) and 0.33 (tamponade of both atria and a ventricle; read as an abstract). Pressures are as its root: systolic 0.65 in those of 1991.
 */
class Pericardium
{
public:
  static constexpr double Tamponade = 10.0; ///< mmHg that are told

  void Fill(double volume) { this->Volume_ += volume; }
  double Volume() const { return this->Volume_; } ///< mL more than there is in health
  double Pressure() const;                        ///< mmHg
  double StrokeFactor() const;                    ///< 0 to 1
  double PressureFactor() const;                  ///< 0 to 1, of the aorta

private:
  double Volume_ = 0.0;
};

struct VesselTear
{
  enum class Kind
  {
    Dissection,
    Perforation
  };
  Kind kind = Kind::Dissection;
  std::string vessel;
  int branch = -1;
  std::int64_t point = -1; ///< of the axes, in one list: its worst place, or the hole's
  double place = 0.0;      ///< mm from the ostium, there
  double stretch = 0.0;    ///< greatest, of the wall that is free of calcium; 0: by a wire
  /// A stent is over it, or the hole has closed.
  bool sealed = false;

  ///@{
  /// Of a dissection.
  std::int64_t first = -1; ///< points of the axes, in one list
  std::int64_t last = -1;
  double flap = 0.0;   ///< of the diameter, greatest, 0 to 1
  double inWall = 0.0; ///< mL of contrast medium that stain it
  ///@}

  ///@{
  /// Of a perforation.
  int node = -1;         ///< of the flow network
  double diameter = 0.0; ///< mm
  double closed = 0.0;   ///< of the hole, 0 to 1
  bool covered = false;  ///< a balloon is across it
  double flow = 0.0;     ///< mL/s, now
  double blood = 0.0;    ///< mL that came out, with contrast medium
  double beside = 0.0;   ///< mL of contrast medium beside the vessel
  double spread = 0.0;   ///< mL of it in all of the pericardium
  /// Of Ellis et al., 1994: III from 1 mm on, II below, I while next to nothing has come out.
  int Ellis() const;
  ///@}
};

/**
 * A wall is dissected or perforated by what a balloon stretches it to, and perforated by a wire's tip that presses long enough.
 *
 * A flap narrows the lumen for blood, less towards its ends; medium stays in the torn wall. A stent over it seals it.
 * A hole is a node of the flow network; blood goes into the pericardium, whose pressure is outside. A balloon across it stops
 * that, and the hole closes evenly in the seal time, for which it need not be held at once. Medium that came out stays:
 * beside the vessel, then in all of the pericardium.
 */
class VesselTears
{
public:
  /// @param network  has to live as long @param sealTime  s
  VesselTears(const FlowNetwork& network, double sealTime);

  /// Each tick. @param thrust  N of the tip's end on the wall @param limit  N, PunctureForce of its wire
  void Press(double thrust, double limit, double seconds)
  {
    this->PressedFor = thrust > limit ? this->PressedFor + seconds : 0.0;
    this->Through = this->Through || this->PressedFor >= this->Strength.punctureTime;
  }
  bool TipIsThrough() const { return this->Through; } ///< since the last step of the flow
  /// A step of the flow. @param step  s @param now  s since the beginning @param said  gets a sentence of each event
  void Step(double step, double now, const Intervention& instruments, WallMotion& wall,
    ContrastModel& medium, LesionWatch& watch, std::vector<std::string>& said);

  bool Any() const { return !this->Tears.empty(); } ///< now or before
  const std::vector<VesselTear>& All() const { return this->Tears; }
  const Pericardium& Sac() const { return this->Sac_; }
  std::int64_t OpenHoles() const; ///< that are not sealed
  /// @param lumen  mm, per point of the axes in one list: narrowed by flaps, which give way to what it is filled with
  void Apply(std::vector<double>& lumen, const std::vector<double>& filled) const;
  std::uint64_t Hash(std::uint64_t hash) const;

private:
  void Stretch(const Intervention& instruments, ContrastModel& medium);
  void Dissect(std::int64_t point, double stretch);
  void Puncture(const Intervention& instruments, WallMotion& wall, ContrastModel& medium);
  void Perforate(VesselTear tear, ContrastModel& medium);
  void Tell(double now, const Intervention& instruments, LesionWatch& watch,
    std::vector<std::string>& said);
  void Bleed(VesselTear& hole, double step, const Intervention& instruments, ContrastModel& medium,
    LesionWatch& watch, std::vector<std::string>& said);
  void Stain(VesselTear& tear, double step, const Intervention& instruments, ContrastModel& medium,
    LesionWatch& watch, std::vector<std::string>& said);
  void SetHeart(
    double now, ContrastModel& medium, LesionWatch& watch, std::vector<std::string>& said);
  VesselTear At(std::int64_t point, VesselTear::Kind kind) const;
  VesselTear* Near(std::int64_t point, VesselTear::Kind kind, double reach);
  int BranchOf(std::int64_t point) const;
  /// It lies between the lumen and the wall: a wire's tip does not come to the wall.
  bool HasPlaque(std::int64_t point) const;
  double Along(std::int64_t point) const; ///< mm from its branch's beginning

  WallStrength Strength;
  double SealTime;
  const FlowNetwork& Network;
  std::vector<double> Flaps; ///< of the diameter, per point of the axes; empty: none
  std::vector<VesselTear> Tears;
  std::size_t Told = 0; ///< of these
  Pericardium Sac_;
  double LastPressure = 0.0; ///< mmHg, when the flow was looked at last
  bool ToldTamponade = false;
  double PressedFor = 0.0; ///< s
  bool Through = false;
};
}

#endif
