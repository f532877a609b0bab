/**
 * @file Command.h
 * @brief What the program knows about its commands: one file each, listed here.
 *
 * To add a command, write <Name>Command.cxx with a function of the type MakeCommand, declare it
 * below and add it to the list in main.cxx.
 */
#ifndef DynamicCoronary_Command_h
#define DynamicCoronary_Command_h

#include "Program.h"

#include <functional>

namespace coronary
{
/// One command of the program.
struct Command
{
  CLI::App* options; ///< its part of the command line; owned by the program's parser

  /**
   * Does the work, after the command line was read.
   * @throws UsageError: exit code 2; Cancelled: interrupted; any other exception: exit code 1.
   */
  std::function<void()> run;

  bool onRanks = false; ///< whether several processes of MPI can do it together
};

/// Declares a command and its options.
using MakeCommand = Command(CLI::App& program);

MakeCommand MakePhantomCommand;
MakeCommand MakePhantomMotionCommand;
MakeCommand MakeScanCommand;
MakeCommand MakeInspectCommand;
MakeCommand MakeRunCommand;
MakeCommand MakeEditCommand;
MakeCommand MakeConvertCommand;
MakeCommand MakeSequenceCommand;
MakeCommand MakeSlicerCommand;
MakeCommand MakeMetricsCommand;
MakeCommand MakeEvaluateCommand;
MakeCommand MakeReviewCommand;
MakeCommand MakeCohortCommand;
}

#endif
