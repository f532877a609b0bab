#include "WorkerMain.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

namespace coronary
{
namespace
{
std::string ReadAll()
{
  std::string bytes;
  std::array<char, 65536> buffer;
  for (;;)
  {
    const ssize_t count = ::read(0, buffer.data(), buffer.size());
    if (count > 0)
    {
      bytes.append(buffer.data(), static_cast<std::size_t>(count));
    }
    else if (count == 0 || errno != EINTR)
    {
      return bytes;
    }
  }
}

bool WriteAll(const std::string& bytes)
{
  for (std::size_t sent = 0; sent < bytes.size();)
  {
    const ssize_t count = ::write(0, bytes.data() + sent, bytes.size() - sent);
    if (count < 0 && errno != EINTR)
    {
      return false;
    }
    sent += static_cast<std::size_t>(std::max<ssize_t>(count, 0));
  }
  return true;
}

void Limit(int resource, double value)
{
  if (value > 0.0)
  {
    rlimit limit{};
    if (::getrlimit(static_cast<__rlimit_resource>(resource), &limit) == 0)
    {
      limit.rlim_cur = std::min(limit.rlim_max, static_cast<rlim_t>(value));
      ::setrlimit(static_cast<__rlimit_resource>(resource), &limit);
    }
  }
}

MesherAnswer Refusal(MesherStatus status, const std::string& message)
{
  MesherAnswer answer;
  answer.status = status;
  answer.message = message;
  return answer;
}
}

int WorkerMain(const std::function<MesherAnswer(const MesherRequest&)>& mesh) noexcept
{
  try
  {
    // No orphan goes on meshing when the host is gone, and no crash leaves a core file.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit none{ 0, 0 };
    ::setrlimit(RLIMIT_CORE, &none);
    MesherAnswer answer;
    try
    {
      const MesherRequest request = DecodeMesherRequest(ReadAll());
      Limit(RLIMIT_CPU, std::ceil(request.timeLimit));
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
      Limit(RLIMIT_AS, request.memoryLimit);
#endif
      answer = mesh(request);
    }
    catch (const std::bad_alloc&)
    {
      answer = Refusal(MesherStatus::OutOfMemory, "not enough memory");
    }
    catch (const std::exception& error)
    {
      answer = Refusal(MesherStatus::BadRequest, error.what());
    }
    std::fflush(stdout);
    return WriteAll(Encode(answer)) ? 0 : 30;
  }
  catch (...)
  {
    return 31;
  }
}
}
