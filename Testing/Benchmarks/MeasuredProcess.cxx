#include "MeasuredProcess.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
/// VmRSS or VmHWM of this process, bytes.
std::int64_t ResidentMemory(const std::string& field)
{
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line))
  {
    if (line.rfind(field + ":", 0) == 0)
    {
      return std::stoll(line.substr(field.size() + 1)) * 1024;
    }
  }
  throw std::runtime_error("/proc/self/status has no " + field);
}

/// VmHWM starts again from the present size.
void ForgetPeak()
{
  std::ofstream("/proc/self/clear_refs") << "5";
}

double ProcessorTime()
{
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return t.tv_sec + 1e-6 * t.tv_usec; };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Outcome
{
  Measurement measurement;
  bool complete;
  std::array<char, 1024> error;
};
}

SharedMemory::SharedMemory(std::size_t bytes)
  : Address(mmap(nullptr, std::max<std::size_t>(bytes, 1), PROT_READ | PROT_WRITE,
      MAP_SHARED | MAP_ANONYMOUS, -1, 0))
  , Bytes(std::max<std::size_t>(bytes, 1))
{
  if (this->Address == MAP_FAILED)
  {
    throw std::runtime_error(
      "no shared memory of " + std::to_string(bytes) + " bytes: " + std::strerror(errno));
  }
}

SharedMemory::~SharedMemory()
{
  munmap(this->Address, this->Bytes);
}

Measurement MeasureInChild(const std::function<void()>& prepare, const std::function<void()>& work,
  const std::function<void()>& deliver)
{
  const SharedMemory shared(sizeof(Outcome));
  auto* outcome = new (shared.Data()) Outcome{};
  // Or the child would print the parent's buffered text again.
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0)
  {
    throw std::runtime_error(std::string("no child process: ") + std::strerror(errno));
  }
  if (child == 0)
  {
    try
    {
      prepare();
      ForgetPeak();
      const std::int64_t before = ResidentMemory("VmRSS");
      const double processorBefore = ProcessorTime();
      const auto start = std::chrono::steady_clock::now();
      work();
      const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
      Measurement& m = outcome->measurement;
      m.wall = wall.count();
      m.processor = ProcessorTime() - processorBefore;
      m.peak = ResidentMemory("VmHWM");
      m.peakGrowth = m.peak - before;
      if (deliver)
      {
        deliver();
      }
      outcome->complete = true;
    }
    catch (const std::exception& e)
    {
      std::snprintf(outcome->error.data(), outcome->error.size(), "%s", e.what());
    }
    std::fflush(nullptr);
    // No destructors: they belong to the parent.
    _exit(0);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR)
  {
  }
  if (outcome->error[0] != '\0')
  {
    throw std::runtime_error(outcome->error.data());
  }
  if (WIFSIGNALED(status))
  {
    throw std::runtime_error("the measured process died of signal " +
      std::to_string(WTERMSIG(status)) + (WTERMSIG(status) == 9 ? " (out of memory?)" : ""));
  }
  if (!outcome->complete)
  {
    throw std::runtime_error("the measured process ended early");
  }
  return outcome->measurement;
}

double Median(std::vector<double> values)
{
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}
}
