/**
 * @file Program.h
 * @brief What every program does around its work: what the user is told of it, and its exit code.
 *
 * Exit codes: 0 done; 1 failed, with one line that says why; 2 the command line is wrong;
 * 128 + n ended by signal n (130: Ctrl-C).
 */
#ifndef DynamicCoronary_Program_h
#define DynamicCoronary_Program_h

#include <CLI/CLI.hpp>

#include <functional>
#include <stdexcept>
#include <string>

namespace coronary
{
constexpr int FailedExitCode = 1;
constexpr int UsageExitCode = 2;

/// The command line is wrong in a way that only the work itself can see. The message names the option.
struct UsageError : std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// Says why there is an exit code. @return that code
using Complaint = std::function<int(const std::string& message, int exitCode)>;

/// One line on the standard error. @param name  of the program, or of its command
int Complain(const std::string& name, const std::string& message, int exitCode);

/// Does the work, which Ctrl-C and SIGTERM interrupt from now on. @return the exit code
int ExitCodeOf(const std::function<void()>& work, const Complaint& complain);

/// At the end: what was printed must have arrived, the reader may be a full disk. @return the exit code then
int ExitCodeAfterOutput(int exitCode, const Complaint& complain);

/// A program without commands: reads the command line and does the work. @return the exit code
int RunProgram(CLI::App& program, int argc, char** argv, const std::function<void()>& work);
}

#endif
