/**
 * coronary-simulator: a guidewire in beating coronary arteries, contrast medium and X-ray images, in a window or
 * without.
 *
 * Exit codes: 0 done; 1 failed, with one line that says why; 2 the command line is wrong;
 * 128 + n ended by signal n (130: Ctrl-C).
 */
#include "Command.h"
#include "ErrorLine.h"
#include "HeadlessSession.h"
#include "Interruption.h"
#include "OptionChecks.h"
#include "ParallelFor.h"
#include "PosingSession.h"
#include "ProgressDisplay.h"
#include "SessionWorld.h"
#ifdef DYNAMICCORONARY_WITH_WINDOW
#include "SimulatorWindow.h"
#endif

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <iterator>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
constexpr int Failed = 1;
constexpr int WrongUsage = 2;

int Complain(const std::string& message, int exitCode)
{
  std::fprintf(stderr, "coronary-simulator: %s\n", coronary::ErrorLine(message).c_str());
  return exitCode;
}

/// What the program is asked to do.
struct Request
{
  coronary::HeadlessOptions session;
#ifdef DYNAMICCORONARY_WITH_WINDOW
  coronary::WindowOptions window;
  std::string size;
  void DeclareWindow(CLI::App& app);
  void RunWindow() const;
#endif
  coronary::PosingOptions posing;
  std::string pose;
  void DeclarePosing(CLI::App& app);
  void RunPosing() const;
  std::string dump;
  bool headless = false;
  bool printScenario = false;
  bool listScenarios = false;
  bool listInstruments = false;
  int threads = 0;

  void Declare(CLI::App& app);
  void Run() const;
};

void Request::Declare(CLI::App& app)
{
  using coronary::WholeWithin;
  using coronary::Within;
  app.add_flag(
    "--headless", this->headless, "Run without window on one thread, as fast as the machine can");

  const std::string what = "Session";
  app
    .add_option("--scenario", this->session.scenario,
      "Scenario: a JSON file, or a built-in name; default: that of the recording to replay")
    ->type_name("FILE|NAME")
    ->group(what);
  app
    .add_option("--vessels", this->session.vessels,
      "Folder of 'coronary-pipeline run' in place of the scenario's vessels")
    ->type_name("DIR")
    ->group(what);
  app
    .add_option(
      "--wire", this->session.wire, "Wire of the built-in catalogue in place of the scenario's")
    ->type_name("NAME")
    ->group(what);
  app
    .add_option("--catheter", this->session.catheter,
      "Guide catheter of the built-in catalogue in place of the scenario's")
    ->type_name("NAME")
    ->group(what);
  auto* heartRate = app
                      .add_option("--heart-rate", this->session.heartRate,
                        "Heart rate at the start in place of the scenario's, beats a minute; 0: "
                        "the heart stands still")
                      ->check(Within(0.0, 240.0))
                      ->type_name("BPM")
                      ->group(what);

  const std::string hands = "Hands";
  auto* replay =
    app.add_option("--replay", this->session.replay, "Recording (.pcirec) to go through")
      ->type_name("FILE")
      ->excludes(heartRate)
      ->group(hands);
  app.add_option("--script", this->session.script, "Driving that is written down, JSON")
    ->type_name("FILE")
    ->excludes(replay)
    ->group(hands);
  app
    .add_option("--ticks", this->session.ticks,
      "Number of steps; default: to the end of the script or the recording")
    ->check(WholeWithin(1, 1000000000000))
    ->type_name("N")
    ->group(hands);
  app
    .add_flag("--verify", this->session.verify,
      "Fail when a state is not that of the recording, bit for bit")
    ->needs(replay)
    ->group(hands);

  const std::string files = "Files";
  auto* output = app
                   .add_option("--output", this->session.output,
                     "Folder to write to; made when it does not exist")
                   ->type_name("DIR")
                   ->group(files);
  app
    .add_option("--output-rate", this->session.outputRate, "Moments a second that are written, Hz")
    ->check(Within(0.01, 20000.0))
    ->type_name("HZ")
    ->capture_default_str()
    ->needs(output)
    ->group(files);
  app.add_flag("--write-wall", this->session.writeWall, "Write the moving wall as well")
    ->needs(output)
    ->group(files);
  app
    .add_flag("--xray", this->session.xray,
      "Make the X-ray frames; with --output they are written as pictures. Without window only")
    ->group(files);
  app
    .add_flag("--scene", this->session.scene,
      "Write pictures of the anatomy, at the output's rate; needs a display (xvfb-run gives one)")
    ->needs(output)
    ->group(files);
  app.add_option("--record", this->session.record, "Recording (.pcirec) to write")
    ->type_name("FILE")
    ->group(files);

#ifdef DYNAMICCORONARY_WITH_WINDOW
  this->DeclareWindow(app);
#endif
  this->DeclarePosing(app);
  const std::string questions = "Instead of a session";
  app.add_flag("--print-scenario", this->printScenario, "Print the scenario in effect as JSON")
    ->group(questions);
  app.add_flag("--list-scenarios", this->listScenarios, "List the built-in scenarios")
    ->group(questions);
  app.add_flag("--list-instruments", this->listInstruments, "List the built-in catalogue")
    ->group(questions);
  app.add_option("--dump", this->dump, "Print a recording (.pcirec) as JSON, a line an item")
    ->type_name("FILE")
    ->group(questions);

  app
    .add_option("--threads", this->threads,
      "Number of threads for what is made before the start; 0: all cores. A session has one")
    ->check(WholeWithin(0, 1024))
    ->type_name("N")
    ->capture_default_str();
  app.add_flag("--quiet", this->session.quiet, "No progress, no messages and no summary");
}

void Request::Run() const
{
  coronary::SetNumberOfThreads(this->threads);
  if (this->listScenarios)
  {
    for (const coronary::BuiltInScenario& one : coronary::BuiltInScenarios())
    {
      std::printf("%-12s %s\n", one.name.c_str(), one.description.c_str());
    }
    return;
  }
  if (this->listInstruments)
  {
    coronary::ListInstruments();
    return;
  }
  if (!this->dump.empty())
  {
    coronary::DumpRecording(this->dump);
    return;
  }
  if (this->printScenario)
  {
    std::fputs(coronary::ScenarioText(coronary::ScenarioOf(this->session)).c_str(), stdout);
    return;
  }
  if (!this->pose.empty())
  {
    this->RunPosing();
    return;
  }
  if (this->headless)
  {
    coronary::RunHeadless(this->session);
    return;
  }
#ifdef DYNAMICCORONARY_WITH_WINDOW
  this->RunWindow();
#else
  throw coronary::UsageError(
    "--headless is required: this program was built without its window (Qt5 and VTK's "
    "GUISupportQt were not found)");
#endif
}

void Request::DeclarePosing(CLI::App& app)
{
  const std::string what = "Posing by hand";
  auto* folder =
    app
      .add_option("--pose", this->pose,
        "Folder of 'coronary-pipeline run --until weights': pose its skeleton, in place "
        "of a session")
      ->type_name("DIR")
      ->group(what);
  const char* const ofSessions[] = {
    "--scenario",
    "--vessels",
    "--replay",
    "--script",
    "--ticks",
    "--output",
    "--xray",
    "--record",
#ifdef DYNAMICCORONARY_WITH_WINDOW
    "--device",
    "--screenshot-at",
    "--video",
    "--quit-after",
#endif
  };
  for (const char* option : ofSessions)
  {
    folder->excludes(app.get_option(option));
  }
  app
    .add_option_function<std::vector<std::string>>(
      "--pose-move",
      [this](const std::vector<std::string>& texts)
      {
        try
        {
          std::transform(texts.begin(), texts.end(), std::back_inserter(this->posing.moves),
            coronary::PosingMoveOf);
        }
        catch (const std::invalid_argument& error)
        {
          throw CLI::ValidationError("--pose-move", error.what());
        }
      },
      "Move a joint by so many mm; may be repeated")
    ->type_name("JOINT:DX,DY,DZ")
    ->needs(folder)
    ->group(what);
  app
    .add_option("--pose-bones", this->posing.settings.bones,
      "Bones before the moved joint that share the bend")
    ->check(coronary::WholeWithin(1, 64))
    ->capture_default_str()
    ->type_name("N")
    ->needs(folder)
    ->group(what);
  const auto file = [&](const char* name, std::string& path, const char* help)
  { app.add_option(name, path, help)->type_name("FILE")->needs(folder)->group(what); };
  file("--pose-start", this->posing.start, "Pose to begin with, .vtp");
  file("--pose-output", this->posing.output, "Pose after the moves, .vtp");
  file("--pose-surface", this->posing.surface, "Surface after the moves, .vtp");
}

void Request::RunPosing() const
{
  if (this->headless)
  {
    coronary::PoseWithoutWindow(this->pose, this->posing, this->session.quiet);
    return;
  }
#ifdef DYNAMICCORONARY_WITH_WINDOW
  coronary::PosingOptions options = this->posing;
  options.screenshots = this->window.screenshots;
  if (this->window.triangles != coronary::WindowOptions().triangles)
  {
    options.triangles = this->window.triangles;
  }
  if (!this->size.empty())
  {
    std::sscanf(this->size.c_str(), "%dx%d", &options.width, &options.height);
  }
  if (coronary::RunPosingWindow(this->pose, options) != 0)
  {
    throw std::runtime_error("posing failed");
  }
#else
  throw coronary::UsageError("--pose needs --headless: this program was built without its window");
#endif
}

#ifdef DYNAMICCORONARY_WITH_WINDOW
void Request::DeclareWindow(CLI::App& app)
{
  using coronary::WholeWithin;
  using coronary::Within;
  const std::string what = "Window";
  app
    .add_option("--device", this->window.devices,
      "Hardware: serial:PATH, gamepad:, gamepad:PATH; may be given again, the first one has "
      "priority. Keys and mouse are always there")
    ->type_name("URI")
    ->group(what);
  app
    .add_option("--igtl", this->window.igtlPort,
      "Serve the wire's tip and the X-ray images by OpenIGTLink at this port; 3D Slicer: 18944")
    ->check(WholeWithin(1, 65535))
    ->type_name("PORT")
    ->group(what);
  app
    .add_option("--triangles", this->window.triangles,
      "Of the arteries in the view of the anatomy at most; fewer are drawn faster")
    ->check(WholeWithin(500, 2000000))
    ->capture_default_str()
    ->type_name("N")
    ->group(what);
  app.add_option("--size", this->size, "Of the window in pixels, as 1500x860")
    ->check(
      [](const std::string& text)
      {
        int width = 0;
        int height = 0;
        char rest = 0;
        const bool good = std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) == 2 &&
          width >= 640 && width <= 8192 && height >= 480 && height <= 8192;
        return good ? std::string() : "'" + text + "' is no size from 640x480 to 8192x8192";
      })
    ->type_name("WxH")
    ->group(what);
  auto* screenshots = app
                        .add_option("--screenshots", this->window.screenshots,
                          "Folder for pictures of the window; it has to exist")
                        ->check(CLI::ExistingDirectory)
                        ->type_name("DIR")
                        ->group(what);
  app
    .add_option("--screenshot-at", this->window.screenshotSeconds,
      "Seconds of simulated time at which they are made, rising")
    ->check(Within(0.0, 1e6))
    ->type_name("S")
    ->needs(screenshots)
    ->group(what);
  app.add_option("--video", this->window.video, "Film of the first session, .ogv")
    ->type_name("FILE")
    ->group(what);
  app
    .add_option("--quit-after", this->window.quitAfter,
      "Close the window after so many seconds of simulated time, or at the end of the replay")
    ->check(Within(0.01, 1e6))
    ->type_name("S")
    ->group(what);
}

void Request::RunWindow() const
{
  coronary::HeadlessOptions chosen = this->session;
  const auto onlyHeadless = [](bool used, const char* option)
  {
    if (used)
    {
      throw coronary::UsageError(std::string(option) + " is for sessions with --headless");
    }
  };
  onlyHeadless(!chosen.output.empty(), "--output");
  onlyHeadless(chosen.ticks > 0, "--ticks");
  onlyHeadless(chosen.verify, "--verify");
  onlyHeadless(chosen.xray, "--xray");
  if (chosen.scenario.empty() && chosen.replay.empty())
  {
    chosen.scenario = "phantom-lca";
  }
  coronary::WindowOptions options = this->window;
  options.script = chosen.script;
  options.replay = chosen.replay;
  options.record = chosen.record;
  if (!this->size.empty())
  {
    std::sscanf(this->size.c_str(), "%dx%d", &options.width, &options.height);
  }
  options.quiet = chosen.quiet;
  coronary::CheckWindow(options);
  coronary::SessionWorld world;
  {
    coronary::ProgressDisplay progress("step", 2, chosen.quiet);
    world = coronary::LoadWorld(coronary::ScenarioOf(chosen), true, progress);
  }
  if (!chosen.replay.empty())
  {
    coronary::CheckRecording(chosen.replay, world.scenario, world.wallHash, true);
  }
  for (const std::string& note : world.notes)
  {
    std::fprintf(stderr, "Warning: %s\n", note.c_str());
  }
  coronary::RunWindow(world, options);
}
#endif

int Run(int argc, char** argv)
{
  CLI::App program("A guidewire in beating coronary arteries, contrast medium and X-ray images.",
    "coronary-simulator");
  program.set_version_flag("--version", "coronary-simulator " DYNAMICCORONARY_VERSION);
  Request request;
  request.Declare(program);
  try
  {
    program.parse(argc, argv);
  }
  catch (const CLI::Success& wanted) // --help, --version
  {
    return program.exit(wanted);
  }
  catch (const CLI::ParseError& error)
  {
    return Complain(error.what(), WrongUsage);
  }
  try
  {
    coronary::CatchInterruptions();
    request.Run();
    return 0;
  }
  catch (const coronary::UsageError& error)
  {
    return Complain(error.what(), WrongUsage);
  }
  catch (const coronary::Cancelled&)
  {
    return Complain("interrupted", 128 + coronary::Interruption());
  }
  catch (const std::bad_alloc&)
  {
    return Complain("not enough memory", Failed);
  }
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
    return Complain(error.what(), Failed);
  }
  // What was printed must have arrived: the reader may be a full disk.
  std::cout.flush();
  if (exitCode == 0 && (!std::cout || std::fflush(stdout) != 0))
  {
    return Complain("cannot write to the standard output", Failed);
  }
  return exitCode;
}
