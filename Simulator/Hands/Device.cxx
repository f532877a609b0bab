#include "Device.h"

#include <chrono>
#include <thread>

namespace coronary
{
DeviceStatus WaitWhileConnecting(const Device& device, double seconds)
{
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() +
    std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  DeviceStatus status = device.Status();
  while (status.state == DeviceState::Connecting && Clock::now() < end)
  {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    status = device.Status();
  }
  return status;
}

void NullDevice::Read(std::uint64_t /*tick*/, double /*secondsPerTick*/, InputFrame& frame)
{
  frame = {};
  frame.state = DeviceState::Running;
}

DeviceStatus NullDevice::Status() const
{
  DeviceStatus status;
  status.state = DeviceState::Running;
  status.text = "Nobody drives.";
  return status;
}
}
