/**
 * coronary-pipeline: the project's batch program.
 *
 * Exit codes are those of Program.h. Of several ranks (mpirun) the first one has it, the others 0.
 */
#include "Command.h"
#include "Interruption.h"
#include "Ranks.h"

#include <algorithm>
#include <exception>
#include <string>
#include <vector>

namespace
{
constexpr coronary::MakeCommand* Commands[] = {
  coronary::MakePhantomCommand,
  coronary::MakePhantomMotionCommand,
  coronary::MakeScanCommand,
  coronary::MakeInspectCommand,
  coronary::MakeRunCommand,
  coronary::MakeEditCommand,
  coronary::MakeSequenceCommand,
  coronary::MakeSlicerCommand,
  coronary::MakeMetricsCommand,
  coronary::MakeEvaluateCommand,
  coronary::MakeReviewCommand,
  coronary::MakeCohortCommand,
  coronary::MakeConvertCommand,
};

/// Of several ranks one speaks.
int Complain(const CLI::App* command, const std::string& message, int exitCode)
{
  const std::string name =
    command ? "coronary-pipeline " + command->get_name() : std::string("coronary-pipeline");
  return coronary::IsFirstProcess() ? coronary::Complain(name, message, exitCode) : exitCode;
}

int RunCommand(const coronary::Command& command)
{
  return coronary::ExitCodeOf(
    [&]
    {
      coronary::StartRanks();
      coronary::CatchInterruptions(); // MPI has handlers of its own
      if (coronary::Ranks().Size() > 1 && !command.onRanks)
      {
        throw coronary::UsageError("this command works in one process: start it without mpirun");
      }
      coronary::Ranks().Agree(command.run);
    },
    [&](const std::string& message, int exitCode)
    { return Complain(command.options, message, exitCode); });
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
    return Complain(chosen() ? chosen()->options : nullptr, error.what(), coronary::UsageExitCode);
  }
  const std::vector<std::string> extras = program.remaining();
  if (!extras.empty())
  {
    const std::string kind = extras.front().front() == '-' ? "option" : "command";
    return Complain(nullptr, "unknown " + kind + " '" + extras.front() + "' (see --help)",
      coronary::UsageExitCode);
  }
  if (!chosen())
  {
    return Complain(nullptr, "a command is required (see --help)", coronary::UsageExitCode);
  }
  return RunCommand(*chosen());
}
}

int main(int argc, char** argv)
{
  const coronary::Complaint complain = [](const std::string& message, int exitCode)
  { return Complain(nullptr, message, exitCode); };
  int exitCode = 0;
  try
  {
    exitCode = Run(argc, argv);
  }
  catch (const std::exception& error)
  {
    return complain(error.what(), coronary::FailedExitCode);
  }
  coronary::FinishRanks();
  exitCode = coronary::ExitCodeAfterOutput(exitCode, complain);
  // The starter ends all others as soon as one fails: the first one is to say it.
  return coronary::IsFirstProcess() ? exitCode : 0;
}
