/**
 * @file DeviceScenario.h
 * @brief What the hands on an emulated device do, and what goes wrong with it, written down.
 */
#ifndef DynamicCoronary_DeviceScenario_h
#define DynamicCoronary_DeviceScenario_h

#include "EmulatedDevice.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// Even motion for some seconds; changes are against the end of the piece before.
struct HandPiece
{
  double seconds = 0.0;                                                           ///< 0: at once
  std::array<double, static_cast<std::size_t>(AxisKind::Inflation) + 1> change{}; ///< by AxisKind
  std::uint16_t pedals = 0; ///< held during it
};

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
  std::vector<HandPiece> pieces;
  bool repeat = false;             ///< the pieces begin anew, from where the hands are then
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
