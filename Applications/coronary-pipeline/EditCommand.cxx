#include "Command.h"

#include "BoundedJson.h"
#include "EditsFile.h"
#include "MarkupsFile.h"
#include "OptionChecks.h"
#include "RunJob.h"
#include "RunSettings.h"
#include "TextFile.h"
#include "TextWords.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Beside those that add an edit.
constexpr const char* Undo = "undo";
constexpr const char* List = "list";
constexpr const char* Apply = "apply";

std::vector<std::string> Actions()
{
  std::vector<std::string> actions;
  for (const EditKind kind : EditKinds())
  {
    actions.emplace_back(EditKindName(kind));
  }
  actions.insert(actions.end(), { Undo, List, Apply });
  return actions;
}

class EditCommand
{
public:
  explicit EditCommand(CLI::App& app);
  void Run();

private:
  std::vector<Vector3> GivenPoints() const;
  TreeEdit GivenEdit() const;
  void Print(const std::vector<TreeEdit>& edits) const;
  void RefuseOptions() const;

  CLI::App& App;
  std::string Folder;
  std::string Action;
  std::vector<std::string> Points;
  std::string PointsFile;
  std::string Name;
  std::string NewName;
  double Radius = 0.0;
  double Reach = 0.0;
  std::string Until;
  int Threads = 0;
  bool Quiet = false;
};

EditCommand::EditCommand(CLI::App& app)
  : App(app)
{
  app.add_option("RUN,--run", this->Folder, "Folder that run wrote")->type_name("DIR")->required();
  std::string all;
  for (const std::string& action : Actions())
  {
    all += (all.empty() ? "" : ", ") + action;
  }
  app.add_option("ACTION,--action", this->Action, "What to do: " + all)
    ->type_name("ACTION")
    ->required()
    ->check(CLI::IsMember(Actions()).description(""));
  app
    .add_option("--points", this->Points,
      "Places as x,y,z, LPS mm: of a new branch from the tree to its tip; of a join from the "
      "feeding vessel to the fed one; of a move from the axis to where it goes")
    ->type_name("X,Y,Z ..");
  app
    .add_option("--points-file", this->PointsFile,
      "Places as markups of 3D Slicer (.mrk.json), after those of --points")
    ->type_name("FILE");
  app
    .add_option("--name", this->Name,
      "SCCT name of a new branch, or of the vessel that is meant, as OM2 or R-PDA")
    ->type_name("NAME");
  app.add_option("--new-name", this->NewName, "Name that a renamed vessel gets; none without it")
    ->type_name("NAME");
  app
    .add_option("--radius", this->Radius,
      "Of a ball that is painted or erased; of a new vessel where the image shows none, mm")
    ->type_name("MM")
    ->check(CLI::Range(0.0, 50.0).description(""));
  app
    .add_option("--reach", this->Reach,
      "How much of the tree goes with a point that is moved, mm along it; 0: 10 mm, and twice "
      "the way")
    ->type_name("MM")
    ->check(CLI::Range(0.0, 200.0).description(""));
  app
    .add_option("--until", this->Until,
      "Last stage that is made anew: centerline, surface, volume, weights or motion; without it "
      "that of the run's last start")
    ->type_name("STAGE")
    ->check(CLI::IsMember(
      std::vector<std::string>{ "centerline", "surface", "volume", "weights", "motion" })
              .description(""));
  app.add_option("--threads", this->Threads, "Number of threads; 0: all cores")
    ->type_name("N")
    ->capture_default_str()
    ->check(WholeWithin(0, 1024));
  app.add_flag("--quiet", this->Quiet, "No progress and no summary");
}

std::vector<Vector3> EditCommand::GivenPoints() const
{
  std::vector<Vector3> points;
  for (const std::string& text : this->Points)
  {
    Vector3 point;
    std::size_t begin = 0;
    bool good = std::count(text.begin(), text.end(), ',') == 2;
    for (int axis = 0; good && axis < 3; ++axis)
    {
      const std::size_t end = std::min(text.find(',', begin), text.size());
      good = ParseNumber(std::string_view(text).substr(begin, end - begin), point[axis]) &&
        std::isfinite(point[axis]);
      begin = end + 1;
    }
    if (!good)
    {
      throw UsageError("--points: '" + text + "' is not x,y,z");
    }
    points.push_back(point);
  }
  if (!this->PointsFile.empty())
  {
    for (const Markup& markup : ReadMarkupsFile(this->PointsFile))
    {
      for (const Markup::Point& point : markup.points)
      {
        points.push_back(point.position);
      }
    }
  }
  return points;
}

TreeEdit EditCommand::GivenEdit() const
{
  TreeEdit edit;
  edit.kind = *std::find_if(EditKinds().begin(), EditKinds().end(),
    [this](EditKind kind) { return this->Action == EditKindName(kind); });
  edit.points = this->GivenPoints();
  edit.name = this->Name;
  edit.newName = this->NewName;
  edit.radius = this->Radius;
  edit.reach = this->Reach;
  try
  {
    CheckEdit(edit);
  }
  catch (const std::invalid_argument& error)
  {
    throw UsageError(error.what());
  }
  return edit;
}

void EditCommand::RefuseOptions() const
{
  for (const char* name :
    { "--points", "--points-file", "--name", "--new-name", "--radius", "--reach" })
  {
    if (this->App.count(name) > 0)
    {
      throw UsageError(this->Action + " has no use for " + name);
    }
  }
}

void EditCommand::Print(const std::vector<TreeEdit>& edits) const
{
  for (std::size_t n = 0; n < edits.size(); ++n)
  {
    std::printf("%zu  %s\n", n + 1, DescribeEdit(edits[n]).c_str());
  }
  if (edits.empty())
  {
    std::printf("no edits in '%s'\n", this->Folder.c_str());
  }
}

void EditCommand::Run()
{
  const std::string path = (fs::path(this->Folder) / EditsFileName).string();
  const std::string reportPath = (fs::path(this->Folder) / "report.json").string();
  const Json report =
    ParseBoundedJson<Json>(ReadTextFile(reportPath, "the report of a run"), "'" + reportPath + "'");
  if (!report.is_object() || !report.contains("settings") || !report["settings"].is_object() ||
    !report.contains("centerline"))
  {
    throw std::runtime_error(
      "'" + reportPath + "' tells of no centerline: run has to come so far first.");
  }
  std::error_code error;
  RunEdits edits;
  edits.list = fs::exists(path, error) ? ReadEditsFile(path) : std::vector<TreeEdit>();
  if (this->Action == List)
  {
    this->RefuseOptions();
    this->Print(edits.list);
    return;
  }
  if (this->Action == Undo)
  {
    this->RefuseOptions();
    if (edits.list.empty())
    {
      throw std::runtime_error("'" + this->Folder + "' has no edit to undo.");
    }
    edits.list.pop_back();
  }
  else if (this->Action == Apply)
  {
    this->RefuseOptions();
  }
  else
  {
    edits.list.push_back(this->GivenEdit());
  }
  edits.write = this->Action != Apply;

  // As the run was made, and on from what is fit.
  CLI::App parser;
  RunSettings settings;
  RunOptions options(parser, settings);
  options.Take(report["settings"], "'" + reportPath + "': settings");
  settings.input = FindRunInput(settings.input, this->Folder);
  settings.output = this->Folder;
  settings.until = this->Until.empty() ? settings.until : this->Until;
  settings.threads = this->Threads;
  settings.quiet = this->Quiet;
  if (settings.Until() < RunStage::Centerline)
  {
    settings.until = "centerline";
  }
  options.Check();
  RunJob(options, settings, true, edits).Run();
}
}

Command MakeEditCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "edit", "Corrects a run by hand: branches added by clicks, cut, joined, renamed, and more");
  app->footer(
    "The edits are kept in RUN/edits.json; the stages that depend on them are made anew. undo "
    "takes the last one back, list prints them, apply makes what edits.json says.");
  auto command = std::make_shared<EditCommand>(*app);
  return { app, [command] { command->Run(); }, false };
}
}
