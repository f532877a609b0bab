/**
 * @file ScriptedDevice.h
 * @brief An emulated device that follows a scenario, with its faults.
 */
#ifndef DynamicCoronary_ScriptedDevice_h
#define DynamicCoronary_ScriptedDevice_h

#include "CounterRandom.h"
#include "DeviceScenario.h"
#include "EmulatedDevice.h"

#include <cstdint>
#include <vector>

namespace coronary
{
class ScriptedDevice
{
public:
  explicit ScriptedDevice(DeviceScenario scenario);

  EmulatedDevice& Device() { return this->Emulated; }

  /// @param now  microseconds, does not go back
  void Step(std::uint64_t now);

  /// What goes over the wire, as the faults leave it.
  std::vector<std::uint8_t> TakeBytes();

  bool IsPlugged() const { return this->Now >= this->PluggedAgain; }
  bool IsGone() const { return this->Gone; } ///< for good
  double Seconds() const;                    ///< since the first START; 0 before

private:
  void Begin(const DeviceFault& fault);
  void Pass(const WireFrame& frame);

  DeviceScenario Scenario;
  EmulatedDevice Emulated;
  RandomStream Random{ 1 };
  std::vector<std::uint8_t> Bytes;
  WireFrame HeldBack;
  std::size_t NextFault = 0;
  std::uint64_t Now = 0;
  std::uint64_t Began = 0;
  bool HasBegun = false;
  std::int64_t Dropping = 0;
  std::int64_t Flipping = 0;
  std::int64_t Duplicating = 0;
  std::int64_t Reordering = 0;
  std::uint64_t SilentUntil = 0;
  std::uint64_t PluggedAgain = 0;
  bool Gone = false;
};
}

#endif
