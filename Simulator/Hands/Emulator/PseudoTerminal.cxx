#include "PseudoTerminal.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <poll.h>
#include <stdexcept>
#include <termios.h>
#include <unistd.h>

namespace coronary
{
PseudoTerminal::PseudoTerminal()
{
  this->Master = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  char name[128] = "";
  const bool made = this->Master >= 0 && ::grantpt(this->Master) == 0 &&
    ::unlockpt(this->Master) == 0 && ::ptsname_r(this->Master, name, sizeof(name)) == 0;
  this->Slave = made ? ::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC) : -1;
  termios settings{};
  if (this->Slave < 0 || ::tcgetattr(this->Slave, &settings) != 0)
  {
    const std::string reason = std::strerror(errno);
    this->Close();
    throw std::runtime_error("No pseudo-terminal could be made: " + reason + ".");
  }
  cfmakeraw(&settings);
  ::tcsetattr(this->Slave, TCSANOW, &settings);
  this->SlaveName = name;
}

PseudoTerminal::~PseudoTerminal()
{
  this->Close();
}

void PseudoTerminal::Close()
{
  for (int* file : { &this->Slave, &this->Master })
  {
    if (*file >= 0)
    {
      ::close(*file);
      *file = -1;
    }
  }
}

std::size_t PseudoTerminal::Read(std::uint8_t* bytes, std::size_t most)
{
  const ssize_t size = ::read(this->Master, bytes, most);
  return size > 0 ? static_cast<std::size_t>(size) : 0;
}

void PseudoTerminal::Write(const std::vector<std::uint8_t>& bytes)
{
  std::size_t at = 0;
  while (at < bytes.size())
  {
    const ssize_t size = ::write(this->Master, bytes.data() + at, bytes.size() - at);
    if (size <= 0 && errno != EINTR)
    {
      return;
    }
    at += size > 0 ? static_cast<std::size_t>(size) : 0;
  }
}

void PseudoTerminal::Wait(std::uint64_t microseconds)
{
  pollfd wanted{ this->Master, POLLIN, 0 };
  const timespec time{ static_cast<time_t>(microseconds / 1000000U),
    static_cast<long>(microseconds % 1000000U * 1000U) };
  ::ppoll(&wanted, 1, &time, nullptr);
}
}
