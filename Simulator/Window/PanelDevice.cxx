#include "PanelDevice.h"

#include <algorithm>

namespace coronary
{
namespace
{
constexpr double FastestWire = 40.0;     // mm/s: a wheel's notches become one even push
constexpr double FastestTurning = 6.0;   // radians/s
constexpr double FastestCatheter = 20.0; // mm/s

void Approach(double& place, double wanted, double most)
{
  place += std::clamp(wanted - place, -most, most);
}
}

void PanelDevice::Read(std::uint64_t /*tick*/, double secondsPerTick, InputFrame& frame)
{
  DriveInput& drive = this->Place.drive;
  Approach(drive.wirePosition, this->Wire, FastestWire * secondsPerTick);
  Approach(drive.wireAngle, this->Turn, FastestTurning * secondsPerTick);
  Approach(drive.catheterPosition, this->Catheter, FastestCatheter * secondsPerTick);
  this->Place.syringe += this->Injection * secondsPerTick;
  this->Place.pedals = this->Pedals;
  frame.input = this->Place;
  frame.buttons = 0;
  frame.axes = WireAxes | CatheterAxes | SyringeAxis;
  frame.state = DeviceState::Running;
}

DeviceStatus PanelDevice::Status() const
{
  DeviceStatus status;
  status.state = DeviceState::Running;
  status.text = "Mouse and panel";
  return status;
}
}
