/**
 * @file WireInGuide.h
 * @brief The wire between the simulated rod and the hand: a rod that lies in the bends of a guide catheter.
 */
#ifndef DynamicCoronary_WireInGuide_h
#define DynamicCoronary_WireInGuide_h

#include "Geometry.h"
#include "Instrument.h"

#include <array>
#include <cstdint>
#include <vector>

namespace coronary
{
struct HandLoad
{
  double force = 0.0;  ///< N, against advancing; negative: the wire is pulled forwards
  double torque = 0.0; ///< N mm, against turning
};

/**
 * Quasi-static: the wire has no mass here, and does not stretch.
 *
 * - Its bending stiffness presses it onto the guide where the curvature changes. Its place across the lumen is that of least
 *   bending energy, with the guide's wall as the limit.
 * - Its axial force F presses it onto the inside or the outside of each bend with F / R per length (capstan). Both add up:
 *   they press at different places.
 * - Coulomb friction is against the way that the wire's surface slides, along the guide and around it. It sticks first, and
 *   gives way after StickLength: so it resists pushing and pulling, turning to and fro, and a wire at rest is held as it was left.
 * - Torsion: a chain of springs GJ with that friction in each cell, and the torque with which a wire that is curved at rest
 *   turns into the guide's bend. The angle at the far end lags behind the hand's, and jumps where that torque exceeds what
 *   torsion holds: for a wire and a guide of even curvature, from length * sqrt(EI k0 k / GJ) = pi / 2 on.
 */
class WireInGuide
{
public:
  static constexpr double StickLength = 0.01; ///< mm
  static constexpr double CellLength = 4.0;   ///< mm at most, of what rubs as one
  static constexpr double NodeSpacing = 1.0;  ///< mm, for the place across the lumen

  WireInGuide() = default;
  /// @param from  mm behind the guide's tip, where this wire begins
  WireInGuide(const Guidewire& wire, const GuideCatheter& guide, double from);

  /**
   * What the hand does in a step, before it is known how the far end answers.
   * @param inserted  mm of the wire beyond the guide's tip
   * @param way       mm that it is advanced against the guide  @param hand  its angle, rad
   * @param turned    rad that the guide is turned in this step
   */
  void Drive(double inserted, double way, double hand, double turned = 0.0);

  ///@{
  /// What the far end hangs on in this step: a torsion spring, N mm/rad, and where its other end is turned to, rad.
  double Stiffness() const { return this->EndStiffness; }
  double Angle() const { return this->EndAngle; }
  ///@}

  /// The step is done. @param force  N at the far end, as HandLoad  @param angle  of the far end, rad
  void Settle(double force, double angle);

  /// As it is turned evenly, without friction that it kept; after a jump.
  void Rest(double hand, double angle);

  const HandLoad& AtHand() const { return this->Felt; }
  double Pressing() const; ///< N in all, by which its bending stiffness presses it onto the guide
  double Rubbed() const { return this->Work; } ///< N mm that friction has taken so far
  double ElasticEnergy() const;                ///< N mm of torsion, and of friction that sticks
  std::uint64_t Hash(std::uint64_t hash) const;

private:
  using Vector2 = Eigen::Vector2d;

  /// What bends and rubs as one.
  struct Cell
  {
    double turn = 0.0;    ///< angle by which the guide bends here, rad
    double bent = 0.0;    ///< N, by bending stiffness
    double pressed = 0.0; ///< N in all
    double angle = 0.0;   ///< rad
    double moved = 0.0;   ///< rad, in the last step
    double link = 0.0;    ///< N mm/rad, to the cell before it
    Vector2 curving{
      Vector2::Zero()
    }; ///< N mm: EI, curvature at rest, length; times the guide's curvature
    Vector2 strain{ Vector2::Zero() }; ///< mm that friction is strained by: along, around
    double kept = 1.0;                 ///< part of the strain that did not slide away
    double pivot = 0.0;
    double right = 0.0;
  };

  void Lay();
  void Couple();
  void Press();
  bool Relax(double ground);
  double BendingEnergy(const std::vector<Vector2>& places, double ground) const;
  void Assemble(double ground);
  void SolveBand();
  bool Eliminate(bool whole);
  void Eliminate();
  Vector2 Strained(const Cell& cell) const;

  Guidewire Wire;
  GuideCatheter Guide;
  double From = 0.0;      ///< mm behind the guide's tip
  double Radius = 0.0;    ///< of the wire, mm
  double Clearance = 0.0; ///< mm
  double Length = 0.0;    ///< of a cell, mm
  bool Curved = false;    ///< so is the wire at rest, somewhere

  std::vector<Cell> Cells;  ///< from the far end
  double HandLink = 0.0;    ///< N mm/rad, from the last cell to the hand
  double Hand = 0.0;        ///< rad
  double Far = 0.0;         ///< rad
  double Way = 0.0;         ///< mm, of this step
  double GuideTurned = 0.0; ///< rad, of this step
  double EndStiffness = 0.0;
  double EndAngle = 0.0;
  HandLoad Felt;
  double Work = 0.0;

  ///@{
  /// Across the lumen, from the guide's tip on.
  bool Laid = false;
  double Inserted = 0.0;          ///< that it was laid for, mm
  double LaidAngle = 0.0;         ///< likewise: of the far end, rad
  bool CurvedWithin = false;      ///< it is curved at rest in there
  std::vector<Vector2> Curvature; ///< of the guide, 1/mm
  std::vector<Vector2> Places;    ///< mm
  std::vector<Vector2> Bends;     ///< of the guide less those of the wire at rest, 1/mm
  std::vector<double> Bending;    ///< EI, N mm^2
  std::vector<Vector2> Trial;
  std::vector<std::array<double, 6>> Band; ///< of the lower triangle; the diagonal last
  std::vector<double> Right;
  ///@}
};
}

#endif
