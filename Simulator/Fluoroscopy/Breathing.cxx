#include "Breathing.h"

#include "Numbers.h"

#include <cmath>

namespace coronary
{
void Breathing::Step(double seconds)
{
  this->Phase += seconds * this->Settings.rate / 60.0;
  this->Phase -= std::floor(this->Phase);
}

double Breathing::Diaphragm() const
{
  const double sine = std::sin(Pi * this->Phase);
  return this->Settings.amplitude * sine * sine * sine * sine;
}

Vector3 DiaphragmShift(double diaphragm)
{
  return { 0.0, 0.0, -diaphragm };
}

Vector3 HeartShift(double diaphragm)
{
  constexpr double Follows = 0.6;
  return Follows * Vector3(0.0, -1.3 / 4.9 * diaphragm, -diaphragm);
}
}
