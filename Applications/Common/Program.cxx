#include "Program.h"

#include "ErrorLine.h"
#include "Interruption.h"
#include "ParallelFor.h"

#include <cstdio>
#include <exception>
#include <iostream>
#include <new>

namespace coronary
{
int Complain(const std::string& name, const std::string& message, int exitCode)
{
  std::fprintf(stderr, "%s: %s\n", name.c_str(), ErrorLine(message).c_str());
  return exitCode;
}

int ExitCodeOf(const std::function<void()>& work, const Complaint& complain)
{
  try
  {
    CatchInterruptions();
    work();
    return 0;
  }
  catch (const UsageError& error)
  {
    return complain(error.what(), UsageExitCode);
  }
  catch (const Cancelled&)
  {
    return complain("interrupted", 128 + Interruption());
  }
  catch (const std::bad_alloc&)
  {
    return complain("not enough memory", FailedExitCode);
  }
  catch (const std::exception& error)
  {
    return complain(error.what(), FailedExitCode);
  }
}

int ExitCodeAfterOutput(int exitCode, const Complaint& complain)
{
  std::cout.flush();
  if (exitCode == 0 && (!std::cout || std::fflush(stdout) != 0))
  {
    return complain("cannot write to the standard output", FailedExitCode);
  }
  return exitCode;
}

int RunProgram(CLI::App& program, int argc, char** argv, const std::function<void()>& work)
{
  const Complaint complain = [&](const std::string& message, int exitCode)
  { return Complain(program.get_name(), message, exitCode); };
  int exitCode = 0;
  try
  {
    program.parse(argc, argv);
    exitCode = ExitCodeOf(work, complain);
  }
  catch (const CLI::Success& wanted) // --help, --version
  {
    exitCode = program.exit(wanted);
  }
  catch (const CLI::ParseError& error)
  {
    return complain(error.what(), UsageExitCode);
  }
  catch (const std::exception& error)
  {
    return complain(error.what(), FailedExitCode);
  }
  return ExitCodeAfterOutput(exitCode, complain);
}
}
