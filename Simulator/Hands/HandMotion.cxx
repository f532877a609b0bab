#include "HandMotion.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
void Check(const char* name, double value, bool positive)
{
  if (!std::isfinite(value) || value < 0.0 || (positive && value == 0.0))
  {
    throw std::invalid_argument(std::string("'") + name + "' of the speeds of hands is " +
      std::to_string(value) + " and not " + (positive ? "positive." : "0 or more."));
  }
}
}

HandMotion::HandMotion(const HandSpeeds& speeds)
  : Settings(speeds)
{
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    Check(HandAxisTable[axis].recorded, speeds.most[axis], false);
  }
  Check("fine", speeds.fine, false);
  Check("fast", speeds.fast, false);
  Check("settling", speeds.settling, true);
  this->Places = PlacesOf(this->Place_);
}

AxisPlaces HandSpeeds::FullSpeeds()
{
  AxisPlaces speeds{};
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    speeds[axis] = HandAxisTable[axis].speed;
  }
  return speeds;
}

void HandMotion::Advance(const HandWishes& wishes, double seconds)
{
  constexpr double Rest = 1e-4; // of speeds in mm/s and radians/s: nobody sees it
  const double kept = std::exp(-seconds / this->Settings.settling);
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    const double pace = HandAxisTable[axis].paced ? wishes.pace : 1.0;
    const double wanted = pace * wishes.axes[axis] * this->Settings.most[axis];
    double& speed = this->Speed[axis];
    speed = wanted + kept * (speed - wanted);
    speed = wanted == 0.0 && std::abs(speed) < Rest ? 0.0 : speed;
    this->Places[axis] += speed * seconds;
  }
  SetPlaces(this->Place_, this->Places);
}
}
