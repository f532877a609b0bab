#include "Command.h"

#include "AtomicFile.h"
#include "Evaluation.h"
#include "Interruption.h"
#include "MovingModel.h"
#include "OptionChecks.h"
#include "ProgressDisplay.h"
#include "Ranks.h"
#include "RunReview.h"
#include "StagedFolder.h"
#include "WebReview.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkRunCycle.h"
#include "vtkWebReview.h"

#include "vtkPolyData.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;

constexpr double SameTime = 1e-3;

bool IsFile(const fs::path& path)
{
  std::error_code error;
  return fs::is_regular_file(path, error);
}

struct ReviewJob
{
  std::string result;
  std::string output;
  std::vector<std::string> images;
  std::string name;
  ViewSettings views;
  bool noPictures = false;
  std::int64_t webTriangles = 0; ///< 0: as many as suit the number of phases
  int threads = 0;
  bool quiet = false;

  void Declare(CLI::App& app);
  void Run() const;

private:
  /// A run as it is looked at.
  struct Look
  {
    ReviewedRun run;
    CaseEvaluation phases; ///< without measures
    int reference = 0;     ///< index of the phase that the images are of
    MovingModel model;     ///< empty without motion
  };
  Look Read(vtkMessageTrap& messages) const;
  void FindPhases(Look& look) const;
  ResultScene SceneOf(const Look& look, vtkMessageTrap& messages) const;
  std::string Folder() const;
};

void ReviewJob::Declare(CLI::App& app)
{
  app.add_option("RUN,--run", this->result, "Folder that run wrote, with a centerline at least")
    ->type_name("DIR")
    ->required();
  app
    .add_option("--output", this->output,
      "Folder to write to; made when it does not exist; by default RUN/review")
    ->type_name("DIR");
  app
    .add_option("--image", this->images,
      "The gated images, as of run, where they are no longer at the place that the run read them "
      "from")
    ->type_name("PATH");
  app.add_option("--name", this->name, "Name of the case; by default that of the folder")
    ->type_name("TEXT");
  app
    .add_option("--half-width", this->views.halfWidth,
      "Width of the straightened views to each side of the vessel's axis, mm")
    ->check(Within(2.0, 40.0))
    ->type_name("MM")
    ->capture_default_str();
  app.add_option("--thickness", this->views.thickness, "Thickness of the slabs, mm")
    ->check(Within(0.5, 50.0))
    ->type_name("MM")
    ->capture_default_str();
  app
    .add_option("--window", this->views.window,
      "Image values that are black and white; by default -150 and twice the lumen's, at least 500")
    ->expected(2)
    ->check(Within(-1e6, 1e6))
    ->type_name("VALUE");
  app.add_flag("--no-pictures", this->noPictures, "Without views of the image");
  app
    .add_option("--web-triangles", this->webTriangles,
      "Triangles of a surface, at most about so many; 0: up to 150000, fewer for more than 20 "
      "phases")
    ->check(WholeWithin(0, 10000000))
    ->type_name("N")
    ->capture_default_str();
  AddThreads(app, this->threads);
  app.add_flag("--quiet", this->quiet, "No progress and no summary");
}

std::string ReviewJob::Folder() const
{
  return this->output.empty() ? (fs::path(this->result) / "review").string() : this->output;
}

void ReviewJob::FindPhases(Look& look) const
{
  if (HasMotion(this->result))
  {
    look.model = FindMovingModel(this->result);
  }
  const MovingModel& model = look.model;
  for (std::size_t n = 0; n < model.surfaces.size(); ++n)
  {
    PhaseEvaluation phase;
    phase.phase = static_cast<int>(n);
    phase.fraction = model.surfaces[n].time;
    const MovingModel::Tracking tracking = model.TrackingAt(phase.fraction, SameTime);
    phase.interpolated = model.tracksKnown && tracking == MovingModel::Tracking::None;
    phase.lost = tracking == MovingModel::Tracking::Lost;
    const auto away = [&](int index)
    {
      return std::abs(
        look.phases.phases[static_cast<std::size_t>(index)].fraction - look.run.result.time);
    };
    look.phases.phases.push_back(phase);
    look.reference =
      away(static_cast<int>(n)) < away(look.reference) ? static_cast<int>(n) : look.reference;
  }
  if (look.phases.phases.empty())
  {
    PhaseEvaluation phase;
    phase.fraction = look.run.result.time;
    look.phases.phases.push_back(phase);
  }
}

ReviewJob::Look ReviewJob::Read(vtkMessageTrap& messages) const
{
  Look look;
  look.run = OpenRun(this->result, this->images, !this->noPictures, messages);
  look.phases.name = this->name.empty() ? FolderName(this->result) : this->name;
  this->FindPhases(look);
  return look;
}

/// Files that an older review in the folder names: vessels may have had other names.
std::vector<std::string> OlderPictures(const std::string& folder)
{
  std::ifstream page(fs::path(folder) / "review.html", std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(page), {});
  const std::string begin = "\"file\":\"";
  std::vector<std::string> names;
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at))
  {
    at += begin.size();
    const std::string name = text.substr(at, text.find('"', at) - at);
    if (name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-./") == std::string::npos &&
      name.rfind("pictures/", 0) == 0)
    {
      names.push_back(name);
    }
  }
  return names;
}

ResultScene ReviewJob::SceneOf(const Look& look, vtkMessageTrap& messages) const
{
  ResultScene scene;
  scene.count = static_cast<int>(look.phases.phases.size());
  const MovingModel& model = look.model;
  const std::string surface = (fs::path(this->result) / "surface.vtp").string();
  if (!model.surfaces.empty())
  {
    scene.model = [&](int index)
    { return ReadPolyData(model.surfaces[static_cast<std::size_t>(index)].path, messages); };
    scene.centerline = [&](int index)
    {
      const TimedFile* file = MovingModel::At(
        model.centerlines, model.surfaces[static_cast<std::size_t>(index)].time, SameTime);
      return file ? ReadPolyData(file->path, messages) : vtkSmartPointer<vtkPolyData>();
    };
  }
  else
  {
    scene.model = [surface, &messages](int) { return ReadPolyData(surface, messages); };
    if (!IsFile(surface))
    {
      scene.model = nullptr;
    }
    scene.centerline = [&look](int) { return look.run.result.lines; };
  }
  // Moved lines have the points of those at rest.
  const vtkSmartPointer<vtkPolyData> first = scene.centerline(0);
  if (first &&
    static_cast<std::size_t>(first->GetNumberOfPoints()) == look.run.result.bridged.size())
  {
    scene.guessed = look.run.result.bridged;
  }
  return scene;
}

void ReviewJob::Run() const
{
  if (this->views.window.size() == 2 && !(this->views.window[0] < this->views.window[1]))
  {
    throw UsageError("--window: the first value must be below the second");
  }
  UseThreads(this->threads);
  vtkMessageTrap messages;
  StagedFolder folder(this->Folder());
  std::size_t vessels = 0;
  std::size_t pictures = 0;
  std::string without;
  try
  {
    Look look = this->Read(messages);
    messages.ThrowIfError();
    vessels = look.run.vessels.size();
    without = look.run.withoutPictures;
    ProgressDisplay progress("step", 2 + RunReviewSteps(look.run), this->quiet);
    const auto update = [&](double fraction)
    {
      progress.Update(fraction);
      return Interruption() == 0;
    };
    int step = 0;
    progress.BeginStep(step++, "lumen over the cycle");
    look.run.cycle = MeasureRunCycle(look.run.result, look.run.vessels, this->images,
      !look.run.image.values, messages, [&](double fraction) { progress.Update(fraction); });
    progress.BeginStep(step++, "shapes");
    WebReview review;
    const std::int64_t triangles = this->webTriangles > 0
      ? this->webTriangles
      : DefaultReviewTriangles(static_cast<std::int64_t>(look.phases.phases.size()));
    review.Add(look.phases, MakeResultCase(this->SceneOf(look, messages), triangles, update));
    pictures = AddRunReview(
      look.run, this->views, look.reference, review, &folder,
      [&](const std::string& what) { progress.BeginStep(step++, what); }, update);
    messages.ThrowIfError();
    ThrowIfInterrupted();
    folder.TakePlaceOf(OlderPictures(this->Folder()));
    WriteFileAtomically(folder.Add("review.html"),
      review.Html({ "coronary-pipeline " DYNAMICCORONARY_VERSION,
        "coronary-pipeline review " + this->result, {}, {}, {}, {} }));
  }
  catch (const std::runtime_error& error)
  {
    ThrowIfInterrupted();
    throw std::runtime_error(folder.Translate(error.what()));
  }
  folder.Commit();
  messages.PrintWarnings();
  if (!without.empty())
  {
    std::fprintf(stderr, "Warning: %s\n", without.c_str());
  }
  if (!this->quiet)
  {
    std::printf(
      "%s: %zu vessels, %zu pictures, review.html\n", this->Folder().c_str(), vessels, pictures);
  }
}
}

Command MakeReviewCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "review", "A run to look at: straightened views and slabs of its vessels, and a page of all");
  app->footer("Writes DIR/review.html, one file for a web browser, without network; and "
              "DIR/pictures/ with, for each vessel, NN-NAME.png (straightened), "
              "NN-NAME-curved.png and NN-NAME-slab.png, and slabs-axial.png, slabs-coronal.png, "
              "slabs-sagittal.png. Needs "
              "no display.");
  auto job = std::make_shared<ReviewJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); } };
}
}
