// The whole road, again and again in one process: phantom, vesselness, segmentation, centerlines, surface, tetrahedra,
// weights, motion, measures, meshes for others, a session of the simulator. What a cycle takes, it gives back.
// Writes a line for each cycle; exit code 1 when memory grows.
#include "Command.h"
#include "HeadlessSession.h"
#include "Interruption.h"
#include "ParallelFor.h"
#include "ProcessMemory.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <malloc.h>
#include <unistd.h>

using namespace coronary;
namespace fs = std::filesystem;

namespace
{
constexpr double MostGrowth = 65536.0; // bytes after all cycles, caches of the libraries included
/// Each window that VTK opens on X keeps some kB.
constexpr double MostGrowthByPictures = 65536.0; // bytes a cycle
constexpr int FirstSteadyCycle = 2;              // in the first one libraries set themselves up

using Arguments = std::vector<std::string>;

/// A folder that is gone in the end.
class WorkFolder
{
public:
  WorkFolder()
  {
    std::string name = (fs::temp_directory_path() / "soak-pipeline.XXXXXX").string();
    if (!mkdtemp(name.data()))
    {
      throw std::runtime_error("Cannot make the folder '" + name + "'.");
    }
    this->Path = name;
  }
  ~WorkFolder()
  {
    std::error_code ignored;
    fs::remove_all(this->Path, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  std::string operator/(const std::string& name) const { return (this->Path / name).string(); }

private:
  fs::path Path;
};

/// As main() does it with a command line.
void Do(Arguments arguments)
{
  CLI::App program;
  std::vector<Command> commands;
  for (MakeCommand* const make : { MakePhantomCommand, MakeRunCommand, MakeSequenceCommand,
         MakeSlicerCommand, MakeEvaluateCommand })
  {
    commands.push_back(make(program));
  }
  std::reverse(arguments.begin(), arguments.end()); // CLI11 takes them from the end
  program.parse(arguments);
  for (const Command& command : commands)
  {
    if (command.options->count() > 0)
    {
      command.run();
    }
  }
}

/// @throws std::runtime_error when the command does not fail
void DoInVain(const Arguments& arguments)
{
  try
  {
    Do(arguments);
  }
  catch (const std::runtime_error&)
  {
    return;
  }
  throw std::runtime_error(arguments.front() + " took what it has to refuse.");
}

struct Settings
{
  int cycles = 20;
  bool quick = false;
  bool pictures = false;
};

/// The left tree of a small phantom in two phases.
void Cycle(const WorkFolder& work, const Settings& settings)
{
  const std::string phantom = work / "phantom";
  const std::string result = work / "result";
  Arguments make{ "phantom", "--quiet", "--seed", "2", "--fractions", "0.45", "0.74", "--spacing",
    "1.2", "--window", "0", "--origin", "-12", "-40", "-40", "--dimensions", "40", "40", "40",
    "--surface-spacing", "1.5", "--centerline-spacing", "2", "--output", phantom };
  if (settings.quick)
  {
    make.emplace_back("--no-truth");
  }
  Do(make);
  const Arguments run{ "run", phantom + "/series.json", "--quiet", "--scales", "0.7", "2.5",
    "--time", "0.74", "--edges", "0.8", "1.6", "--seed", "0.638", "-0.16", "0.326", "--output" };
  Arguments first = run;
  first.push_back(result);
  Do(first);
  Arguments evaluate{ "evaluate", "--quiet", "--result", result, "--truth",
    settings.quick ? result : phantom, "--output", work / "evaluation" };
  if (!settings.pictures)
  {
    evaluate.emplace_back("--no-pictures");
  }
  Do(evaluate);
  Do({ "sequence", result, "--quiet", "--phases", "3", "--velocity", "--formats",
    "series,simvascular,vmtk,obj,ply,stl,gltf,gltf-json", "--output", work / "meshes" });
  Do({ "slicer", result, "--quiet", "--output", work / "scene" });
  if (!settings.quick)
  {
    HeadlessOptions session;
    session.scenario = "phantom-lca";
    session.vessels = result;
    session.script = DYNAMICCORONARY_DRIVING "/lca-angiogram.json";
    session.ticks = 2000;
    session.xray = true;
    session.output = work / "session";
    session.record = work / "session.pcirec";
    session.quiet = true;
    RunHeadless(session);
  }
  // What fails on its way gives back too.
  fs::resize_file(phantom + "/phase_00.mha", 2000);
  Arguments broken = run;
  broken.push_back(work / "broken");
  DoInVain(broken);
}

int Soak(const Settings& settings)
{
  const WorkFolder work;
  double steady = 0.0;
  double grown = 0.0;
  std::printf("cycle  allocated MiB  resident MiB  since cycle %d, bytes\n", FirstSteadyCycle);
  for (int cycle = 1; cycle <= settings.cycles; ++cycle)
  {
    Cycle(work, settings);
    malloc_trim(0);
    const double allocated = AllocatedBytes();
    steady = cycle == FirstSteadyCycle ? allocated : steady;
    grown = cycle > FirstSteadyCycle ? allocated - steady : 0.0;
    std::printf("%5d  %13.3f  %12.1f  %20.0f\n", cycle, allocated / 1048576.0,
      ResidentBytes() / 1048576.0, grown);
    std::fflush(stdout);
    ThrowIfInterrupted();
  }
  const double most = MostGrowth + (settings.pictures ? settings.cycles * MostGrowthByPictures : 0);
  if (grown > most)
  {
    std::printf("Memory grows: more than %.0f bytes are left.\n", most);
    return 1;
  }
  return 0;
}
}

int main(int argc, char** argv)
{
  try
  {
    Settings settings;
    CLI::App app("The whole road many times in one process.", "soak-pipeline");
    app.add_option("CYCLES", settings.cycles, "How many times; less than 3 show no growth")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
    app.add_flag("--quick", settings.quick,
      "Without the truth, measured against itself, and without a session");
    app.add_flag("--pictures", settings.pictures, "Also the pictures of evaluate, with a display");
    CLI11_PARSE(app, argc, argv);
    CatchInterruptions();
    return Soak(settings);
  }
  catch (const Cancelled&)
  {
    return 128 + Interruption();
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "soak-pipeline: %s\n", error.what());
    return 1;
  }
}
