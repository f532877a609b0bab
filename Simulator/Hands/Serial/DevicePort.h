/**
 * @file DevicePort.h
 * @brief Bytes to and from a device.
 */
#ifndef DynamicCoronary_DevicePort_h
#define DynamicCoronary_DevicePort_h

#include <cstddef>
#include <cstdint>
#include <string>

namespace coronary
{
enum class PortOpening
{
  Open,
  Missing, ///< may be plugged in later
  Denied   ///< somebody has to do something about it
};

/// Never waits but in Wait().
class DevicePort
{
public:
  virtual ~DevicePort() = default;

  virtual const std::string& Name() const = 0;

  /// @param why  for people, when it is not open
  virtual PortOpening Open(std::string& why) = 0;
  virtual void Close() = 0;

  /// @return bytes that were read; 0: none now; -1: the device is gone
  virtual int Read(std::uint8_t* bytes, std::size_t most) = 0;

  /// @return bytes that were taken; 0: none now; -1: the device is gone
  virtual int Write(const std::uint8_t* bytes, std::size_t size) = 0;

  /// Until there is something to read, or for so long.
  virtual void Wait(std::uint64_t microseconds) = 0;
};
}

#endif
