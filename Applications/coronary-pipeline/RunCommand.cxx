#include "Command.h"

#include "EditsFile.h"
#include "Ranks.h"
#include "RunJob.h"
#include "RunSettings.h"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

namespace coronary
{
namespace
{
class RunCommand
{
public:
  explicit RunCommand(CLI::App& app)
    : Options(app, this->Settings)
  {
    app
      .add_option("--settings", this->SettingsFile,
        "Settings out of a JSON file, as --print-settings has them; what the command line says "
        "counts "
        "more")
      ->type_name("FILE");
    app.add_flag("--print-settings", this->PrintSettings,
      "Print all settings in effect as JSON, and do nothing");
    app.add_flag("--resume", this->Resume,
      "Go on from the last finished stage in the folder that is of the same input and settings");
  }

  void Run();

private:
  RunSettings Settings;
  RunOptions Options;
  std::string SettingsFile;
  bool PrintSettings = false;
  bool Resume = false;
};

void RunCommand::Run()
{
  if (!this->SettingsFile.empty())
  {
    this->Options.Read(this->SettingsFile);
  }
  this->Options.Check();
  if (this->PrintSettings)
  {
    if (Ranks().IsFirst())
    {
      std::printf("%s\n", this->Options.All().dump(2).c_str());
    }
    return;
  }
  // What was corrected by hand in this folder goes on.
  RunEdits edits;
  const std::string path = (std::filesystem::path(this->Settings.output) / EditsFileName).string();
  std::error_code error;
  if (!this->Settings.output.empty() && std::filesystem::exists(path, error))
  {
    edits.list = ReadEditsFile(path);
    if (!this->Settings.quiet && Ranks().IsFirst())
    {
      std::fprintf(stderr, "%zu %s by hand out of '%s'\n", edits.list.size(),
        edits.list.size() == 1 ? "edit" : "edits", path.c_str());
    }
  }
  RunJob(this->Options, this->Settings, this->Resume, edits).Run();
}
}

Command MakeRunCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "run", "From a gated image series, or a surface, to the beating coronary arteries");
  app->footer("Writes DIR/vesselness.mha, mask.mha, ostia.vtp, aorta.vtp, bridges.vtp, "
              "aorta_wall.vtp, aorta_centerline.vtp, centerline.vtp, bifurcations.vtp, "
              "centerline_lines.vtp, status.csv, surface.vtp, caps.vtp, "
              "skeleton.vtp, skeleton.tgf, volume.vtu, volume_boundary.vtp, volume_skeleton.vtp, "
              "weights.vtu, weights.dmat, motion.pvd, motion/ with series of centerlines, "
              "skeletons, tetrahedra and surfaces; and, after every stage, report.json.");
  auto job = std::make_shared<RunCommand>(*app);
  return { app, [job] { job->Run(); }, true };
}
}
