/**
 * coronary-posing: a tree's joints are moved by hand, and its vessels follow, in a window or without. Exit codes are
 * those of Program.h.
 */
#include "OptionChecks.h"
#include "ParallelFor.h"
#include "PosingSession.h"
#include "Program.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using coronary::WholeWithin;

/// What the program is asked to do.
struct Request
{
  std::string folder;
  coronary::PosingOptions posing;
  bool headless = false;
  bool quiet = false;
  int threads = 0;

  void Declare(CLI::App& app);
  void Run() const;
};

void Request::Declare(CLI::App& app)
{
  app
    .add_option("RUN", this->folder,
      "Folder of 'coronary-pipeline run --until weights', whose skeleton is posed")
    ->type_name("")
    ->required();
  app.add_flag("--headless", this->headless, "Do the moves without window and display");
  const std::string what = "Pose";
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
    ->allow_extra_args(false)
    ->type_name("JOINT:DX,DY,DZ")
    ->group(what);
  app
    .add_option("--pose-bones", this->posing.settings.bones,
      "Bones before the moved joint that share the bend")
    ->check(WholeWithin(1, 64))
    ->capture_default_str()
    ->type_name("N")
    ->group(what);
  const auto file = [&](const char* name, std::string& path, const char* help)
  { app.add_option(name, path, help)->type_name("FILE")->group(what); };
  file("--pose-start", this->posing.start, "Pose to begin with, .vtp");
  file("--pose-output", this->posing.output, "Pose after the moves, .vtp");
  file("--pose-surface", this->posing.surface, "Surface after the moves, .vtp");
#ifdef DYNAMICCORONARY_WITH_WINDOW
  const std::string window = "Window";
  app
    .add_option("--triangles", this->posing.triangles,
      "Of the vessels in the view at most; fewer are drawn faster")
    ->check(WholeWithin(500, 2000000))
    ->capture_default_str()
    ->type_name("N")
    ->group(window);
  coronary::AddWindowSize(app, this->posing.width, this->posing.height)->group(window);
  app
    .add_option("--screenshots", this->posing.screenshots,
      "Folder for pictures before the first and after every move; it has to exist. Then the window "
      "closes")
    ->check(CLI::ExistingDirectory)
    ->type_name("DIR")
    ->group(window);
#endif
  coronary::AddThreads(app, this->threads);
  app.add_flag("--quiet", this->quiet, "No summary");
}

void Request::Run() const
{
  coronary::SetNumberOfThreads(this->threads);
  if (this->headless)
  {
    coronary::PoseWithoutWindow(this->folder, this->posing, this->quiet);
    return;
  }
#ifdef DYNAMICCORONARY_WITH_WINDOW
  if (coronary::RunPosingWindow(this->folder, this->posing) != 0)
  {
    throw std::runtime_error("posing failed");
  }
#else
  throw coronary::UsageError(
    "--headless is required: this program was built without its window (Qt and VTK's "
    "GUISupportQt were not found)");
#endif
}
}

int main(int argc, char** argv)
{
  CLI::App program("A coronary tree is posed by its joints.", "coronary-posing");
  program.set_version_flag("--version", "coronary-posing " DYNAMICCORONARY_VERSION);
  Request request;
  request.Declare(program);
  return coronary::RunProgram(program, argc, argv, [&] { request.Run(); });
}
