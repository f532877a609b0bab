/**
 * @file HandMotion.h
 * @brief Places out of wishes for speed, as keys and sticks give them.
 */
#ifndef DynamicCoronary_HandMotion_h
#define DynamicCoronary_HandMotion_h

#include "SessionInput.h"

#include <array>

namespace coronary
{
/// At full deflection; fine and fast movement multiply them.
struct HandSpeeds
{
  double wire = 10.0;           ///< mm/s
  double wireTurning = 3.14;    ///< radians/s
  double catheter = 5.0;        ///< mm/s
  double catheterTurning = 1.0; ///< radians/s
  double syringe = 3.0;         ///< mL/s
  double view = 0.35;           ///< radians/s, of the C-arm
  double detector = 50.0;       ///< mm/s
  double table = 40.0;          ///< mm/s
  double fine = 0.2;
  double fast = 4.0;
  double settling = 0.06; ///< s: time constant of starting and stopping
};

/// Each -1 to 1.
struct HandWishes
{
  double wire = 0.0;
  double wireTurning = 0.0;
  double catheter = 0.0;
  double catheterTurning = 0.0;
  double syringe = 0.0; ///< positive pushes
  double primary = 0.0;
  double secondary = 0.0;
  double detector = 0.0;
  std::array<double, 3> table{};
  double pace = 1.0; ///< on the speed of wire and catheter: HandSpeeds::fine, 1 or HandSpeeds::fast
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
  static constexpr std::size_t Axes = 11;

  HandSpeeds Settings;
  std::array<double, Axes> Speed{};
  SessionInput Place_;
};
}

#endif
