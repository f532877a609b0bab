#include "HandMotion.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

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
  const std::pair<const char*, double> all[] = { { "wire", speeds.wire },
    { "wireTurning", speeds.wireTurning }, { "catheter", speeds.catheter },
    { "catheterTurning", speeds.catheterTurning }, { "syringe", speeds.syringe },
    { "view", speeds.view }, { "detector", speeds.detector }, { "table", speeds.table },
    { "fine", speeds.fine }, { "fast", speeds.fast } };
  for (const auto& one : all)
  {
    Check(one.first, one.second, false);
  }
  Check("settling", speeds.settling, true);
}

void HandMotion::Advance(const HandWishes& wishes, double seconds)
{
  const HandSpeeds& most = this->Settings;
  const std::array<double, Axes> wanted{ wishes.pace * wishes.wire * most.wire,
    wishes.pace * wishes.wireTurning * most.wireTurning,
    wishes.pace * wishes.catheter * most.catheter,
    wishes.pace * wishes.catheterTurning * most.catheterTurning, wishes.syringe * most.syringe,
    wishes.primary * most.view, wishes.secondary * most.view, wishes.detector * most.detector,
    wishes.table[0] * most.table, wishes.table[1] * most.table, wishes.table[2] * most.table };
  SessionInput& place = this->Place_;
  const std::array<double*, Axes> places{ &place.drive.wirePosition, &place.drive.wireAngle,
    &place.drive.catheterPosition, &place.drive.catheterAngle, &place.syringe, &place.primary,
    &place.secondary, &place.sourceToDetector, &place.table[0], &place.table[1], &place.table[2] };
  constexpr double Rest = 1e-4; // of speeds in mm/s and radians/s: nobody sees it
  const double kept = std::exp(-seconds / most.settling);
  for (std::size_t axis = 0; axis < Axes; ++axis)
  {
    double& speed = this->Speed[axis];
    speed = wanted[axis] + kept * (speed - wanted[axis]);
    speed = wanted[axis] == 0.0 && std::abs(speed) < Rest ? 0.0 : speed;
    *places[axis] += speed * seconds;
  }
}
}
