/**
 * @file RecordedDevices.h
 * @brief Hands of another time: recordings and scripts.
 */
#ifndef DynamicCoronary_RecordedDevices_h
#define DynamicCoronary_RecordedDevices_h

#include "Device.h"
#include "DriveScript.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// At the end of a tick the hands are where the script has them then.
class ScriptDevice : public Device
{
public:
  /// @param start  where hands and C-arm are before the script moves them
  explicit ScriptDevice(
    DriveScript script, std::string name = "script", const SessionInput& start = {});

  void Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame) override;
  DeviceStatus Status() const override;
  bool IsScripted() const override { return true; }

private:
  DriveScript Script;
  std::string Name;
  SessionInput Start;
};

/// The inputs of a recording, tick by tick; at another tick rate than the recorded one by time.
class ReplayDevice : public Device
{
public:
  static constexpr std::size_t MostChanges = 10000000;

  /// Reads all of it. A recording that is torn is good up to there.
  /// @throws std::runtime_error naming the file: not there, no recording, more than MostChanges changes of input
  explicit ReplayDevice(const std::string& path);

  void Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame) override;
  DeviceStatus Status() const override;
  bool IsScripted() const override { return true; }

  std::uint64_t Ticks() const { return this->TickCount; } ///< that were recorded
  double TickRate() const { return this->Rate; }          ///< Hz, of the recording

private:
  struct Change
  {
    std::uint64_t tick;
    SessionInput input;
  };

  std::string Name;
  std::string Ending; ///< for people
  std::vector<Change> Changes;
  std::uint64_t TickCount = 0;
  double Rate = 0.0;
};
}

#endif
