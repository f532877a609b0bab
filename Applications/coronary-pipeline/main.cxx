/**
 * coronary-pipeline: the project's batch program.
 *
 * Exit codes: 0 done; 1 failed, with one line that says why; 2 the command line is wrong;
 * 128 + n ended by signal n (130: Ctrl-C). Of several ranks (mpirun) the first one has it, the others 0.
 */
#include "Command.h"
#include "ErrorLine.h"
#include "Interruption.h"
#include "ParallelFor.h"
#include "Ranks.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

namespace
{
constexpr int Failed = 1;
constexpr int WrongUsage = 2;

constexpr coronary::MakeCommand* Commands[] = {
  coronary::MakePhantomCommand,
  coronary::MakePhantomMotionCommand,
  coronary::MakeInspectCommand,
  coronary::MakeRunCommand,
  coronary::MakeSequenceCommand,
  coronary::MakeSlicerCommand,
  coronary::MakeMetricsCommand,
  coronary::MakeEvaluateCommand,
  coronary::MakeReviewCommand,
  coronary::MakeCohortCommand,
  coronary::MakeConvertCommand,
};

int Complain(const CLI::App* command, const std::string& message, int exitCode)
{
  if (coronary::IsFirstProcess())
  {
    const std::string name = command ? " " + command->get_name() : "";
    std::fprintf(
      stderr, "coronary-pipeline%s: %s\n", name.c_str(), coronary::ErrorLine(message).c_str());
  }
  return exitCode;
}

int RunCommand(const coronary::Command& command)
{
  try
  {
    coronary::StartRanks();
    coronary::CatchInterruptions();
    if (coronary::Ranks().Size() > 1 && !command.onRanks)
    {
      throw coronary::UsageError("this command works in one process: start it without mpirun");
    }
    coronary::Ranks().Agree(command.run);
    return 0;
  }
  catch (const coronary::UsageError& error)
  {
    return Complain(command.options, error.what(), WrongUsage);
  }
  catch (const coronary::Cancelled&)
  {
    return Complain(command.options, "interrupted", 128 + coronary::Interruption());
  }
  catch (const std::bad_alloc&)
  {
    return Complain(command.options, "not enough memory", Failed);
  }
  catch (const std::exception& error)
  {
    return Complain(command.options, error.what(), Failed);
  }
}

int Run(int argc, char** argv)
{
  CLI::App program("Beating coronary artery trees from gated cardiac CT.", "coronary-pipeline");
  program.set_version_flag("--version", "coronary-pipeline " DYNAMICCORONARY_VERSION);
  std::vector<coronary::Command> commands;
  for (coronary::MakeCommand* const make : Commands)
  {
    commands.push_back(make(program));
  }
  // Not before: the commands would inherit it. Extras are allowed so that they can be named.
  program.set_help_all_flag("--help-all", "Print the help of all commands and exit");
  program.footer("'coronary-pipeline COMMAND --help' explains a command.");
  program.allow_extras();
  const auto chosen = [&]() -> const coronary::Command*
  {
    const auto found = std::find_if(commands.begin(), commands.end(),
      [](const coronary::Command& command) { return command.options->count() > 0; });
    return found == commands.end() ? nullptr : &*found;
  };

  try
  {
    program.parse(argc, argv);
  }
  catch (const CLI::Success& wanted) // --help, --version
  {
    return coronary::IsFirstProcess() ? program.exit(wanted) : 0;
  }
  catch (const CLI::ParseError& error)
  {
    return Complain(chosen() ? chosen()->options : nullptr, error.what(), WrongUsage);
  }
  const std::vector<std::string> extras = program.remaining();
  if (!extras.empty())
  {
    const std::string kind = extras.front().front() == '-' ? "option" : "command";
    return Complain(
      nullptr, "unknown " + kind + " '" + extras.front() + "' (see --help)", WrongUsage);
  }
  if (!chosen())
  {
    return Complain(nullptr, "a command is required (see --help)", WrongUsage);
  }
  return RunCommand(*chosen());
}
}

int main(int argc, char** argv)
{
  int exitCode = Failed;
  try
  {
    exitCode = Run(argc, argv);
  }
  catch (const std::exception& error)
  {
    return Complain(nullptr, error.what(), Failed);
  }
  coronary::FinishRanks();
  // What was printed must have arrived: the reader may be a full disk.
  std::cout.flush();
  if (exitCode == 0 && (!std::cout || std::fflush(stdout) != 0))
  {
    return Complain(nullptr, "cannot write to the standard output", Failed);
  }
  // The starter ends all others as soon as one fails: the first one is to say it.
  return coronary::IsFirstProcess() ? exitCode : 0;
}
