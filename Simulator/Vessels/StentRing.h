/**
 * @file StentRing.h
 * @brief A ring of a stent: elastic, then plastic, and elastic again when it is unloaded.
 */
#ifndef DynamicCoronary_StentRing_h
#define DynamicCoronary_StentRing_h

namespace coronary
{
/**
 * Radii are inside, mm; pressures in atm, from inside. p(R) = stiffness (R - natural) within +-strength, strength = opening +
 * hardening (widest - crimped); beyond, it flows at its strength, which rises when it becomes wider than it ever was.
 */
struct StentRing
{
  double crimped = 0.0;   ///< natural radius before it was opened
  double natural = 0.0;   ///< where nothing presses
  double widest = 0.0;    ///< greatest that natural ever was
  double radius = 0.0;    ///< now
  double thickness = 0.0; ///< mm of its struts
  double stiffness = 0.0; ///< atm/mm, greater than hardening
  double opening = 0.0;   ///< atm from which it flows when it is crimped
  double hardening = 0.0; ///< atm/mm
  double greatest = 0.0;  ///< radius that its design allows
};

/// atm that it bears before it flows.
double RingStrength(const StentRing& ring);
/// Natural radius after a radius.
double RingNatural(const StentRing& ring, double radius);
/// atm from inside that hold it at a radius; negative: it is pressed from outside.
double RingPressure(const StentRing& ring, double radius);
}

#endif
