/**
 * @file HandMotion.h
 * @brief Places out of wishes for speed, as keys and sticks give them.
 */
#ifndef DynamicCoronary_HandMotion_h
#define DynamicCoronary_HandMotion_h

#include "HandAxes.h"

namespace coronary
{
/// At full deflection; fine and fast movement multiply them.
struct HandSpeeds
{
  AxisPlaces most = FullSpeeds(); ///< units of HandAxisTable a second
  double fine = 0.2;
  double fast = 4.0;
  double settling = 0.06; ///< s: time constant of starting and stopping

  static AxisPlaces FullSpeeds();
};

struct HandWishes
{
  AxisPlaces axes{}; ///< each -1 to 1
  double pace = 1.0; ///< on the speed of wire and catheter: HandSpeeds::fine, 1 or HandSpeeds::fast

  double& operator[](AxisKind kind) { return this->axes[IndexOf(kind)]; }
};

class HandMotion
{
public:
  /// @throws std::invalid_argument naming a speed that is negative or not finite, or a settling that is not positive
  explicit HandMotion(const HandSpeeds& speeds);

  const HandSpeeds& Speeds() const { return this->Settings; }

  /// Goes on by `seconds`.
  void Advance(const HandWishes& wishes, double seconds);

  /// At once, without running out.
  void Stop() { this->Speed = {}; }

  const SessionInput& Place() const { return this->Place_; }

private:
  HandSpeeds Settings;
  AxisPlaces Speed{};
  AxisPlaces Places{};
  SessionInput Place_;
};
}

#endif
