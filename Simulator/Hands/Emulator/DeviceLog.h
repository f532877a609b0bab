/**
 * @file DeviceLog.h
 * @brief What an emulated device was told, a line of JSON each.
 */
#ifndef DynamicCoronary_DeviceLog_h
#define DynamicCoronary_DeviceLog_h

#include "DeviceProtocol.h"

#include <cstdint>
#include <fstream>
#include <string>

namespace coronary
{
class DeviceLog
{
public:
  /// @throws std::runtime_error naming the file
  explicit DeviceLog(const std::string& path);

  ///@{
  /// @param seconds  since the program started
  void Received(const Message& message, double seconds);
  void Relaxed(bool relaxed, double seconds);
  ///@}

  /// @throws std::runtime_error naming the file when something could not be written
  void Finish();

private:
  void Line(double seconds, const std::string& rest);

  std::string Path;
  std::ofstream Stream;
};
}

#endif
