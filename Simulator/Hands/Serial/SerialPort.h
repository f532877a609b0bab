/**
 * @file SerialPort.h
 * @brief A serial line of POSIX: USB CDC-ACM, a UART, or a pseudo-terminal.
 */
#ifndef DynamicCoronary_SerialPort_h
#define DynamicCoronary_SerialPort_h

#include "DevicePort.h"

namespace coronary
{
class SerialPort : public DevicePort
{
public:
  explicit SerialPort(std::string path);
  ~SerialPort() override;
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  const std::string& Name() const override { return this->Path; }
  PortOpening Open(std::string& why) override;
  void Close() override;
  int Read(std::uint8_t* bytes, std::size_t most) override;
  int Write(const std::uint8_t* bytes, std::size_t size) override;
  void Wait(std::uint64_t microseconds) override;

private:
  std::string Path;
  int File = -1;
};
}

#endif
