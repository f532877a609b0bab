#include "ChildProcess.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace coronary
{
namespace
{
/// A child would take itself for a rank by what begins so.
constexpr const char* RankVariables[] = { "OMPI_", "PMIX_", "PMI_", "MPI_LOCALNRANKS",
  "MPI_LOCALRANKID", "MV2_COMM_WORLD_", "PRTE_", "ORTE_" };

/// The environment without what tells of ranks.
std::vector<char*> OwnEnvironment()
{
  std::vector<char*> result;
  for (char** variable = environ; *variable != nullptr; ++variable)
  {
    bool ofRanks = false;
    for (const char* name : RankVariables)
    {
      ofRanks = ofRanks || std::strncmp(*variable, name, std::strlen(name)) == 0;
    }
    if (!ofRanks)
    {
      result.push_back(*variable);
    }
  }
  result.push_back(nullptr);
  return result;
}
}

ChildProcess::ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
  const std::string& log, bool progress)
{
  const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (output < 0)
  {
    throw std::runtime_error("Cannot write '" + log + "': " + std::strerror(errno) + ".");
  }
  // All is made before the fork: between that and the new program nothing may be allocated.
  std::vector<std::string> words = { "coronary-pipeline" };
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words)
  {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  std::vector<char*> environment = OwnEnvironment();
  char wish[] = "DYNAMICCORONARY_PROGRESS=1"; // see ProgressDisplay
  if (progress)
  {
    environment.insert(environment.begin(), wish);
  }
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0)
  {
    // Signals of the terminal are for the parent, which passes them on.
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nothing = open("/dev/null", O_RDONLY);
    if (getppid() != parent || nothing < 0 || dup2(nothing, STDIN_FILENO) < 0 ||
      dup2(output, STDOUT_FILENO) < 0 || dup2(output, STDERR_FILENO) < 0)
    {
      _exit(127);
    }
    // Connections of MPI are not the child's.
    const long most = sysconf(_SC_OPEN_MAX);
    for (int file = STDERR_FILENO + 1; file < (most > 0 && most < 4096 ? most : 4096); ++file)
    {
      close(file);
    }
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
    execve(program.c_str(), argv.data(), environment.data());
    _exit(127);
  }
  const int reason = errno;
  close(output);
  if (child < 0)
  {
    throw std::runtime_error(
      std::string("A process can not be started: ") + std::strerror(reason) + ".");
  }
  this->Id = child;
}

ChildProcess::~ChildProcess()
{
  if (this->Id > 0)
  {
    this->Signal(SIGKILL);
    waitpid(this->Id, nullptr, 0);
  }
}

bool ChildProcess::HasEnded()
{
  int status = 0;
  if (this->Id > 0 && waitpid(this->Id, &status, WNOHANG) == this->Id)
  {
    this->Code = WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
    this->Id = -1;
  }
  return this->Id < 0;
}

void ChildProcess::Signal(int number) const
{
  if (this->Id > 0)
  {
    kill(this->Id, number);
  }
}
}
