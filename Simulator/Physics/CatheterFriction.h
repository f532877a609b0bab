/**
 * @file CatheterFriction.h
 * @brief What a hand feels of a wire in a bent catheter.
 *
 * The wire lies on the inside of every bend and is pressed there by its own axial force: F / R per length. Coulomb friction is against
 * the way that its surface slides, along the catheter and around it (Euler's and Eytelwein's capstan). So it adds to a force that
 * resists the hand, and takes from one that helps it: a wire that is trapped is harder to pull out than what holds it, and one that
 * springs back is easily held. The bending stiffness of the wire, which presses it onto the wall as well, is left out.
 */
#ifndef DynamicCoronary_CatheterFriction_h
#define DynamicCoronary_CatheterFriction_h

#include <algorithm>
#include <cmath>

namespace coronary
{
struct HandLoad
{
  double force = 0.0;  ///< N, against advancing; negative: the wire is pulled forwards
  double torque = 0.0; ///< N mm, against turning
};

class CatheterFriction
{
public:
  CatheterFriction() = default;

  /// @param exponent  coefficient of friction times the angle by which the catheter turns in all, radians
  /// @param radius    of the wire, mm
  CatheterFriction(double exponent, double radius)
    : Exponent(exponent)
    , Radius(radius)
  {
  }

  /**
   * @param there      what the wire bears at the catheter's far end
   * @param advancing  mm/s  @param turning  rad/s: slower than 1 mm/s of the surface, friction fades
   */
  HandLoad AtHand(const HandLoad& there, double advancing, double turning) const
  {
    const double around = turning * this->Radius;
    const double speed = std::max(std::hypot(advancing, around), SlowSlide);
    const double grows = (there.force >= 0.0 ? advancing : -advancing) / speed * this->Exponent;
    // Integral of the pressing force over the angle, over the force there.
    const double pressed = std::abs(grows) > 1e-9 ? std::expm1(grows) / grows : 1.0;
    return { there.force * std::exp(grows),
      there.torque +
        around / speed * this->Exponent * this->Radius * std::abs(there.force) * pressed };
  }

private:
  static constexpr double SlowSlide = 1.0; // mm/s

  double Exponent = 0.0;
  double Radius = 0.0;
};
}

#endif
