/**
 * @file DeviceUri.h
 * @brief Devices by their names on a command line.
 */
#ifndef DynamicCoronary_DeviceUri_h
#define DynamicCoronary_DeviceUri_h

#include "Device.h"

#include <memory>
#include <string>

namespace coronary
{
/// "serial:/dev/ttyACM0": how a device is named on a command line.
struct DeviceUri
{
  std::string scheme; ///< serial, keyboard, gamepad, replay, script, null
  std::string path;   ///< of the device or the file; empty: none, or to be found
};

/// @throws std::invalid_argument: another scheme, a path that is missing or not wanted
DeviceUri ParseDeviceUri(const std::string& text);

/**
 * serial:PATH, keyboard:, gamepad: or gamepad:PATH, replay:FILE, script:FILE, null:.
 * Hardware that is not there is no error: Status() says what is wrong, and the device is waited for.
 * @param start  where a script begins
 * @throws std::invalid_argument for the name, std::runtime_error for a file that can not be read
 */
std::shared_ptr<Device> OpenDevice(const std::string& uri, const SessionInput& start = {});
}

#endif
