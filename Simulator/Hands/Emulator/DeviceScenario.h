/**
 * @file DeviceScenario.h
 * @brief What the hands on an emulated device do, and what goes wrong with it, written down.
 */
#ifndef DynamicCoronary_DeviceScenario_h
#define DynamicCoronary_DeviceScenario_h

#include "DriveScript.h"
#include "EmulatedDevice.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
enum class FaultKind
{
  DropBytes,    ///< the next `count` bytes
  FlipBits,     ///< one bit in each of the next `count` frames
  Duplicate,    ///< the next `count` frames come twice
  Reorder,      ///< each of the next `count` frames comes after the one behind it
  Stop,         ///< silence for `milliseconds`
  Close,        ///< unplugged for `milliseconds`; 0: for good
  JumpCounts,   ///< all encoders, by `count`
  Rate,         ///< `count` states a second from now on
  Garbage,      ///< `count` bytes in between
  WrongVersion, ///< from the next HELLO on
  WrongMagic    ///< from the next HELLO on
};

struct DeviceFault
{
  double at = 0.0; ///< s
  FaultKind kind = FaultKind::Stop;
  std::int64_t count = 1;
  double milliseconds = 0.0;
};

struct DeviceScenario
{
  EmulatedDeviceSettings device;
  DriveScript hands;
  bool repeat = false;             ///< the script begins anew, from where the hands are then
  std::vector<DeviceFault> faults; ///< by time

  /// `seconds` after the first START.
  HandPlaces At(double seconds) const;
};

///@{
/// @throws std::runtime_error naming the file: not there, no JSON; std::invalid_argument naming file, place and member
DeviceScenario DeviceScenarioFromText(const std::string& text, const std::string& origin);
DeviceScenario ReadDeviceScenario(const std::string& path);
///@}
}

#endif
