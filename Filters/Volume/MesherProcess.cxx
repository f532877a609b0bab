#include "MesherProcess.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <memory>
#include <utility>

#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace coronary
{
namespace
{
using Clock = std::chrono::steady_clock;

/// A file descriptor that is closed when it is left.
class Descriptor
{
public:
  Descriptor() = default;
  explicit Descriptor(int number)
    : Number(number)
  {
  }
  Descriptor(Descriptor&& other) noexcept
    : Number(std::exchange(other.Number, -1))
  {
  }
  Descriptor& operator=(Descriptor&& other) noexcept
  {
    std::swap(this->Number, other.Number);
    return *this;
  }
  ~Descriptor() { this->Close(); }

  void Close()
  {
    if (this->Number >= 0)
    {
      ::close(this->Number);
      this->Number = -1;
    }
  }

  int Get() const { return this->Number; }

private:
  int Number = -1;
};

[[noreturn]] void FailedCall(const std::string& what)
{
  throw MesherFailure(what + ": " + std::strerror(errno));
}

void SetFlags(int descriptor)
{
  ::fcntl(descriptor, F_SETFD, FD_CLOEXEC);
  ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK);
}

/// One worker, from its start to its answer.
class Process
{
public:
  Process(const std::string& executable, const MesherRequest& request)
    : Name(executable.substr(executable.rfind('/') + 1))
    , Request(Encode(request))
    , LastWork(Clock::now())
  {
    // A socket, not a pipe: writing to a worker that is gone is an error here and no signal to the
    // host.
    int sockets[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0)
    {
      FailedCall("no connection to a mesher");
    }
    this->Data = Descriptor(sockets[0]);
    const Descriptor workerData(sockets[1]);
    int pipes[2];
    if (::pipe2(pipes, O_CLOEXEC) != 0)
    {
      FailedCall("no connection to a mesher");
    }
    this->Output = Descriptor(pipes[0]);
    const Descriptor workerOutput(pipes[1]);
    SetFlags(this->Data.Get());
    SetFlags(this->Output.Get());

    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, workerData.Get(), 0);
    ::posix_spawn_file_actions_adddup2(&actions, workerOutput.Get(), 1);
    ::posix_spawn_file_actions_adddup2(&actions, workerOutput.Get(), 2);
    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    // Signals that the host ignores or blocks must end a worker all the same.
    sigset_t none;
    sigset_t defaults;
    ::sigemptyset(&none);
    ::sigemptyset(&defaults);
    for (const int signal : { SIGPIPE, SIGINT, SIGTERM, SIGXCPU, SIGABRT, SIGSEGV, SIGFPE, SIGBUS })
    {
      ::sigaddset(&defaults, signal);
    }
    ::posix_spawnattr_setsigmask(&attributes, &none);
    ::posix_spawnattr_setsigdefault(&attributes, &defaults);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    std::string path = executable;
    std::array<char*, 2> arguments{ path.data(), nullptr };
    const int error = ::posix_spawn(
      &this->Id, executable.c_str(), &actions, &attributes, arguments.data(), environ);
    ::posix_spawnattr_destroy(&attributes);
    ::posix_spawn_file_actions_destroy(&actions);
    if (error != 0)
    {
      this->Id = -1;
      errno = error;
      FailedCall("the mesher " + executable + " does not start");
    }
  }

  ~Process()
  {
    if (this->Id > 0)
    {
      ::kill(this->Id, SIGKILL);
      this->Wait();
    }
  }

  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void AddTo(std::vector<pollfd>& descriptors) const
  {
    const bool writes = this->Sent < this->Request.size();
    descriptors.push_back(
      { this->Data.Get(), static_cast<short>(writes ? POLLIN | POLLOUT : POLLIN), 0 });
    descriptors.push_back({ this->Output.Get(), POLLIN, 0 });
  }

  /// Moves what can be moved; true when the worker has closed its connection.
  bool Step()
  {
    while (this->Sent < this->Request.size())
    {
      const ssize_t count = ::send(this->Data.Get(), this->Request.data() + this->Sent,
        this->Request.size() - this->Sent, MSG_NOSIGNAL);
      if (count < 0)
      {
        if (errno != EAGAIN && errno != EINTR)
        {
          this->Sent = this->Request.size(); // it is gone; what it said before that tells why
        }
        break;
      }
      this->Sent += static_cast<std::size_t>(count);
    }
    if (this->Sent == this->Request.size() && !this->Request.empty())
    {
      ::shutdown(this->Data.Get(), SHUT_WR);
      this->Request = {};
      this->Sent = 0;
    }
    Read(this->Output, this->Printed);
    if (this->Printed.size() > 2 * maximumPrinted)
    {
      this->Printed.erase(0, this->Printed.size() - maximumPrinted);
    }
    return Read(this->Data, this->Answer);
  }

  /// Of processor time, all that it has used; of the clock since it last did something, while it does nothing. A busy
  /// machine makes neither longer.
  double Seconds()
  {
    const Clock::time_point now = Clock::now();
    clockid_t clock;
    timespec time{};
    if (::clock_getcpuclockid(this->Id, &clock) != 0 || ::clock_gettime(clock, &time) != 0)
    {
      return 0.0; // it has ended
    }
    const double used = static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
    if (used > this->Used + MinimumWork)
    {
      this->Used = used;
      this->LastWork = now;
    }
    return std::max(used, std::chrono::duration<double>(now - this->LastWork).count());
  }

  void Refuse(const std::string& what)
  {
    Read(this->Output, this->Printed);
    std::string text = this->Printed;
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0)
    {
      text.pop_back();
    }
    if (text.size() > maximumQuoted)
    {
      text = "... " + text.substr(text.size() - maximumQuoted);
    }
    throw MesherFailure(this->Name + " " + what + (text.empty() ? "" : "; it said: " + text));
  }

  /// The answer of a worker that has closed its connection.
  MesherAnswer Finish()
  {
    const int status = this->Wait();
    if (WIFSIGNALED(status))
    {
      const int signal = WTERMSIG(status);
      this->Refuse(signal == SIGXCPU
          ? std::string("was stopped at its limit of CPU time")
          : "crashed (signal " + std::to_string(signal) + ", " + ::strsignal(signal) + ")");
    }
    if (this->Answer.empty())
    {
      // A library that leaves by exit() says why in its exit code; those are TetGen's.
      const int code = WEXITSTATUS(status);
      if (code >= 1 && code <= 10)
      {
        MesherAnswer answer;
        answer.status = static_cast<MesherStatus>(code);
        answer.message = this->Printed;
        return answer;
      }
      this->Refuse("left without an answer (exit code " + std::to_string(code) + ")");
    }
    try
    {
      return DecodeMesherAnswer(this->Answer);
    }
    catch (const std::runtime_error& error)
    {
      this->Refuse(std::string("gave an answer that can not be read: ") + error.what());
    }
    return {};
  }

private:
  static constexpr double MinimumWork = 0.01; ///< s
  static constexpr std::size_t maximumPrinted = 65536;
  static constexpr std::size_t maximumQuoted = 400;

  int Wait()
  {
    int status = 0;
    while (::waitpid(this->Id, &status, 0) < 0 && errno == EINTR)
    {
    }
    this->Id = -1;
    return status;
  }

  /// True at the end of the stream.
  static bool Read(const Descriptor& source, std::string& target)
  {
    std::array<char, 65536> buffer;
    for (;;)
    {
      const ssize_t count = ::read(source.Get(), buffer.data(), buffer.size());
      if (count > 0)
      {
        target.append(buffer.data(), static_cast<std::size_t>(count));
      }
      else if (count == 0)
      {
        return true;
      }
      else if (errno != EINTR)
      {
        return errno != EAGAIN;
      }
    }
  }

  std::string Name;
  std::string Request;
  std::size_t Sent = 0;
  std::string Answer;
  std::string Printed;
  Descriptor Data;
  Descriptor Output;
  pid_t Id = -1;
  double Used = 0.0; ///< s of processor time
  Clock::time_point LastWork;
};

bool IsExecutable(const std::string& file)
{
  return ::access(file.c_str(), X_OK) == 0;
}
}

std::string FindMesher(const std::string& name, const std::string& folder)
{
  const auto in = [&name](const std::string& place)
  {
    const std::string file = place + "/" + name;
    return IsExecutable(file) ? file : std::string();
  };
  if (!folder.empty())
  {
    return in(folder);
  }
  const char* environment = std::getenv("DYNAMICCORONARY_WORKER_FOLDER");
  if (environment != nullptr && *environment != '\0')
  {
    return in(environment);
  }
  Dl_info info;
  if (::dladdr(reinterpret_cast<const void*>(&FindMesher), &info) == 0 || info.dli_fname == nullptr)
  {
    return {};
  }
  std::string place = info.dli_fname;
  const std::unique_ptr<char, decltype(&std::free)> real(
    ::realpath(place.c_str(), nullptr), &std::free);
  if (real != nullptr)
  {
    place = real.get();
  }
  place.erase(std::min(place.rfind('/'), place.size()));
  for (const char* way :
    { DYNAMICCORONARY_WORKERS_FROM_LIBRARY, DYNAMICCORONARY_WORKERS_FROM_PROGRAM })
  {
    std::string found = in(place + "/" + way);
    if (!found.empty())
    {
      return found;
    }
  }
  return {};
}

std::vector<MesherAnswer> RunMeshers(const std::string& executable,
  const std::vector<MesherRequest>& requests, double timeLimit, const ProgressCallback& progress)
{
  if (!(timeLimit > 0.0))
  {
    throw std::invalid_argument("the time limit must be positive");
  }
  std::vector<MesherAnswer> answers(requests.size());
  std::vector<std::pair<std::size_t, std::unique_ptr<Process>>> running;
  std::size_t next = 0;
  std::size_t done = 0;
  // Nobody knows how far a mesher is: the fraction grows ever more slowly.
  double expected = 0.0;
  for (const MesherRequest& request : requests)
  {
    expected += 1.0 + 3e-5 * static_cast<double>(request.triangles.size());
  }
  const Clock::time_point start = Clock::now();
  const auto limit = static_cast<std::size_t>(std::max(1, NumberOfThreads()));
  while (done < requests.size())
  {
    while (next < requests.size() && running.size() < limit)
    {
      running.emplace_back(next, std::make_unique<Process>(executable, requests[next]));
      ++next;
    }
    std::vector<pollfd> descriptors;
    for (const auto& [index, process] : running)
    {
      process->AddTo(descriptors);
    }
    // A worker may close its output early, which would wake the loop all the time.
    for (pollfd& descriptor : descriptors)
    {
      if (descriptor.fd < 0)
      {
        descriptor.events = 0;
      }
    }
    ::poll(descriptors.data(), descriptors.size(), 50);
    for (std::size_t i = 0; i < running.size();)
    {
      Process& process = *running[i].second;
      if (process.Step())
      {
        answers[running[i].first] = process.Finish();
        running.erase(running.begin() + static_cast<std::ptrdiff_t>(i));
        ++done;
        continue;
      }
      if (process.Seconds() > timeLimit)
      {
        process.Refuse(
          "was stopped after " + std::to_string(std::lround(timeLimit)) + " s, its time limit");
      }
      ++i;
    }
    const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
    Report(progress, 1.0 - std::exp(-elapsed / expected));
  }
  return answers;
}
}
