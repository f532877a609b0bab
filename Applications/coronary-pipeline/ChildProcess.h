/**
 * @file ChildProcess.h
 * @brief This program once more, as a process of its own: whatever becomes of it, this one goes on.
 */
#ifndef DynamicCoronary_ChildProcess_h
#define DynamicCoronary_ChildProcess_h

#include <string>
#include <vector>

namespace coronary
{
class ChildProcess
{
public:
  /**
   * Starts this program. The child is alone, whatever ranks this process is of, and does not outlive it.
   * @param arguments  of the command line
   * @param log        what it prints is appended here
   * @throws std::runtime_error when it can not be started, or `log` not be written to
   */
  ChildProcess(const std::vector<std::string>& arguments, const std::string& log);
  /// Kills it, if it is still there.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Whether it has ended; does not wait.
  bool HasEnded();

  /// Of a child that has ended: its exit code, or minus the signal that ended it.
  int ExitCode() const { return this->Code; }

  void Signal(int number) const;

private:
  int Id = -1; ///< of the process; -1: it has ended
  int Code = 0;
};
}

#endif
