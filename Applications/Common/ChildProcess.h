/**
 * @file ChildProcess.h
 * @brief coronary-pipeline as a process of its own: whatever becomes of it, this one goes on.
 */
#ifndef DynamicCoronary_ChildProcess_h
#define DynamicCoronary_ChildProcess_h

#include <string>
#include <vector>

namespace coronary
{
/// The file of this process, whatever has become of its name.
inline const char ThisProgram[] = "/proc/self/exe";

class ChildProcess
{
public:
  /**
   * Starts it. The child is alone, whatever ranks this process is of, and does not outlive it.
   * @param program    its file; ThisProgram: that of this process
   * @param arguments  of the command line
   * @param log        what it prints is appended here
   * @param progress   it also prints how far it is, a line "progress FRACTION" twice a second
   * @throws std::runtime_error when it can not be started, or `log` not be written to
   */
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
    const std::string& log, bool progress = false);
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
