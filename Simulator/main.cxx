/**
 * coronary-simulator: a guidewire in beating coronary arteries, contrast medium and X-ray images, in a window or
 * without.
 *
 * Exit codes are those of Program.h.
 */
#include "HeadlessSession.h"
#include "IgtlOutput.h"
#include "OptionChecks.h"
#include "ParallelFor.h"
#include "Program.h"
#include "SessionWorld.h"
#ifdef DYNAMICCORONARY_WITH_WINDOW
#include "SimulatorWindow.h"
#endif

#include <cstdio>
#include <string>

namespace
{
/// What the program is asked to do.
struct Request
{
  coronary::HeadlessOptions session;
#ifdef DYNAMICCORONARY_WITH_WINDOW
  coronary::WindowOptions window;
  void DeclareWindow(CLI::App& app);
  void RunWindow() const;
#endif
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
  auto* patient =
    app
      .add_option("--patient", this->session.patient,
        "A patient's gated CT (folder of DICOM files, series.json or volume): its model, made by "
        "coronary-pipeline where --vessels (default: NAME-coronary) has none, in place of the "
        "scenario's vessels, and the CT in the X-ray images")
      ->type_name("PATH")
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
  app
    .add_flag("--guide-from-arch", this->session.guideFromArch,
      "The guide catheter lies in the aorta and has to be brought to the ostium, where the vessels "
      "have an aorta")
    ->group(what);
  app
    .add_option("--balloon", this->session.balloon,
      "Balloon or microcatheter of the built-in catalogue in place of the scenario's")
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
      ->excludes(patient)
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
  app
    .add_option_function<std::string>("--pose",
      [](const std::string& folder)
      {
        throw CLI::ValidationError(
          "--pose", "posing is a program of its own: coronary-posing " + folder);
      })
    ->group(""); // it was one of these once
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

  coronary::AddThreads(app, this->threads,
    "Number of threads for what is made before the start; 0: all cores. A session has one");
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
  if (this->headless)
  {
    coronary::RunHeadless(this->session);
    return;
  }
#ifdef DYNAMICCORONARY_WITH_WINDOW
  this->RunWindow();
#else
  throw coronary::UsageError(
    "--headless is required: this program was built without its window (Qt and VTK's "
    "GUISupportQt were not found)");
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
  CLI::Option* igtl = app
                        .add_option("--igtl", this->window.igtlPort,
                          "Serve the wire's tip and the X-ray images by OpenIGTLink at this port, "
                          "to programs on this "
                          "machine; 3D Slicer: 18944")
                        ->check(WholeWithin(1, 65535))
                        ->type_name("PORT")
                        ->group(what);
  app
    .add_option("--igtl-listen", this->window.igtlAddress,
      "Address of this machine to serve at instead, 0.0.0.0 for all: everybody who reaches it can "
      "read, the protocol has no authentication")
    ->needs(igtl)
    ->type_name("ADDRESS")
    ->capture_default_str()
    ->group(what);
  app
    .add_option("--triangles", this->window.triangles,
      "Of the arteries in the view of the anatomy at most; fewer are drawn faster")
    ->check(WholeWithin(500, 2000000))
    ->capture_default_str()
    ->type_name("N")
    ->group(what);
  coronary::AddWindowSize(app, this->window.width, this->window.height)->group(what);
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
  if (chosen.scenario.empty() && chosen.replay.empty() && chosen.patient.empty())
  {
    chosen.scenario = "phantom-lca";
  }
  coronary::WindowOptions options = this->window;
  options.script = chosen.script;
  options.replay = chosen.replay;
  options.record = chosen.record;
  options.quiet = chosen.quiet;
  coronary::CheckWindow(options);
  if (options.igtlPort > 0 && !coronary::IgtlOutput::IsLocal(options.igtlAddress))
  {
    std::fprintf(stderr,
      "Warning: the images of this session can be read by everybody who reaches %s: OpenIGTLink "
      "has "
      "no authentication.\n",
      options.igtlAddress.c_str());
  }
  const coronary::Scenario scenario = coronary::ScenarioOf(chosen);
  const auto load = [&](const coronary::WorldProgress& progress)
  {
    coronary::SessionWorld world = coronary::WorldOf(chosen, scenario, true, progress);
    if (!chosen.replay.empty())
    {
      coronary::CheckRecording(chosen.replay, world.scenario, world.wallHash, true);
    }
    for (const std::string& note : world.notes)
    {
      std::fprintf(stderr, "Warning: %s\n", note.c_str());
    }
    return world;
  };
  coronary::RunWindow(scenario, load, options);
}
#endif

}

int main(int argc, char** argv)
{
  CLI::App program("A guidewire in beating coronary arteries, contrast medium and X-ray images.",
    "coronary-simulator");
  program.set_version_flag("--version", "coronary-simulator " DYNAMICCORONARY_VERSION);
  Request request;
  request.Declare(program);
  return coronary::RunProgram(program, argc, argv, [&] { request.Run(); });
}
