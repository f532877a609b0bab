#include "StentRing.h"

namespace coronary
{
double RingStrength(const StentRing& ring)
{
  return ring.opening + ring.hardening * (ring.widest - ring.crimped);
}

double RingNatural(const StentRing& ring, double radius)
{
  const double k = ring.stiffness;
  const double elastic = k * (radius - ring.natural);
  const double strength = RingStrength(ring);
  if (elastic > strength)
  {
    // Wider than ever: k (R - n) = opening + hardening (n - crimped).
    const double wider =
      (k * radius - ring.opening + ring.hardening * ring.crimped) / (k + ring.hardening);
    return wider > ring.widest ? wider : radius - strength / k;
  }
  return elastic < -strength ? radius + strength / k : ring.natural;
}

double RingPressure(const StentRing& ring, double radius)
{
  return ring.stiffness * (radius - RingNatural(ring, radius));
}
}
