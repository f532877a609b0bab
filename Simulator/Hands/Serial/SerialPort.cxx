#include "SerialPort.h"

#include <cerrno>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>
#include <utility>

namespace coronary
{
namespace
{
/// Bytes as they are, as fast as a UART goes; USB takes no notice of the speed.
bool MakeRaw(int file)
{
  termios settings{};
  if (tcgetattr(file, &settings) != 0)
  {
    return false;
  }
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cc[VMIN] = 1; // so that a read of 0 bytes is the end and not silence
  settings.c_cc[VTIME] = 0;
  cfsetspeed(&settings, B1000000);
  return tcsetattr(file, TCSANOW, &settings) == 0 && tcflush(file, TCIOFLUSH) == 0;
}

bool ComesLater(int error)
{
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}
}

SerialPort::SerialPort(std::string path)
  : Path(std::move(path))
{
}

SerialPort::~SerialPort()
{
  this->SerialPort::Close();
}

PortOpening SerialPort::Open(std::string& why)
{
  this->Close();
  this->File = ::open(this->Path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  const int error = errno;
  if (this->File < 0)
  {
    if (error == EACCES || error == EPERM)
    {
      why = "No permission for '" + this->Path +
        "': add the user to the group that owns it, which is mostly dialout, and log in again.";
      return PortOpening::Denied;
    }
    if (error == EBUSY)
    {
      why = "'" + this->Path + "' is in use by another program.";
      return PortOpening::Denied;
    }
    const bool absent = error == ENOENT || error == ENXIO || error == ENODEV || error == EIO;
    why = absent ? "There is no device at '" + this->Path + "'; it is waited for."
                 : "Cannot open '" + this->Path + "': " + std::strerror(error) + ".";
    return absent ? PortOpening::Missing : PortOpening::Denied;
  }
  if (!MakeRaw(this->File))
  {
    why = "'" + this->Path + "' is no serial port.";
    this->Close();
    return PortOpening::Denied;
  }
  ::ioctl(this->File, TIOCEXCL); // where it fails, two programs may fight for the device
  return PortOpening::Open;
}

void SerialPort::Close()
{
  if (this->File >= 0)
  {
    ::ioctl(this->File, TIOCNXCL);
    ::close(this->File);
    this->File = -1;
  }
}

int SerialPort::Read(std::uint8_t* bytes, std::size_t most)
{
  const ssize_t size = ::read(this->File, bytes, most);
  if (size < 0 && ComesLater(errno))
  {
    return 0;
  }
  return size > 0 ? static_cast<int>(size) : -1;
}

int SerialPort::Write(const std::uint8_t* bytes, std::size_t size)
{
  const ssize_t written = ::write(this->File, bytes, size);
  if (written < 0)
  {
    return ComesLater(errno) ? 0 : -1;
  }
  return static_cast<int>(written);
}

void SerialPort::Wait(std::uint64_t microseconds)
{
  pollfd wanted{ this->File, POLLIN, 0 }; // a negative file is left out: it only sleeps
  const timespec time{ static_cast<time_t>(microseconds / 1000000U),
    static_cast<long>(microseconds % 1000000U * 1000U) };
  ::ppoll(&wanted, 1, &time, nullptr);
}
}
