#include "Command.h"

#include "AnatomyFile.h"
#include "AtomicFile.h"
#include "FileSeries.h"
#include "ImageScan.h"
#include "Interruption.h"
#include "OptionChecks.h"
#include "PhantomOptions.h"
#include "ProgressDisplay.h"
#include "ScannerOptions.h"
#include "StagedFolder.h"
#include "vtkDataFiles.h"
#include "vtkMeshConversion.h"
#include "vtkMessageTrap.h"

#include "vtkPolyData.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace coronary
{
namespace
{
/// Of the image around the parts that move, when it has to find its place itself, mm.
constexpr double ImageMargin = 10.0;
constexpr double MostVoxels = 4e9;

struct ScanJob
{
  std::string path;
  std::string output;
  std::string given; ///< all options that decide what the images are, as text
  PhaseOptions phases;
  ScannerOptions scanner;
  GridOptions grid;
  std::uint64_t seed = 0;
  int threads = 0;
  bool compress = false;
  bool noTruth = false;
  bool quiet = false;

  void Declare(CLI::App& app);
  void Run();

private:
  ImageGrid Grid(const MeshAnatomy& anatomy) const;
  void Write(const AnatomyFile& file, ImageScan& scan, const std::vector<double>& times,
    StagedFolder& folder, vtkMessageTrap& messages);
};

void ScanJob::Declare(CLI::App& app)
{
  app.add_option("ANATOMY", this->path, "JSON file that lists surfaces and what they are full of")
    ->type_name("FILE")
    ->required();
  app.add_option("--output", this->output, "Folder to write to; made when it does not exist")
    ->type_name("DIR")
    ->check(CLI::Validator(
      [](std::string& text) { return text.empty() ? "a name is needed" : std::string(); }, ""))
    ->required();
  app.add_option("--seed", this->seed, "Of noise, lengths of beats and shifts of the heart")
    ->check(WholeWithin(0, 2147483647))
    ->type_name("N")
    ->capture_default_str();
  this->phases.AddTo(app);
  this->grid.AddTo(app, "all parts that move, or all if none does");
  this->scanner.AddTo(app);
  app.get_option("--scanner")->required();
  app.add_flag("--no-truth", this->noTruth, "Write no truth");
  app.add_flag("--compress", this->compress, "Compress the images (zlib)");
  AddThreads(app, this->threads);
  app.add_flag("--quiet", this->quiet, "Show no progress and no summary");
}

ImageGrid ScanJob::Grid(const MeshAnatomy& anatomy) const
{
  ImageGrid image;
  const CoronaryPhantom::Box& heart = anatomy.Heart();
  double voxels = 1.0;
  for (int axis = 0; axis < 3; ++axis)
  {
    const double spacing = this->grid.spacing[axis];
    image.spacing[axis] = spacing;
    double size = std::ceil((heart.high[axis] - heart.low[axis] + 2.0 * ImageMargin) / spacing);
    if (this->grid.Given())
    {
      image.origin[axis] = this->grid.origin[axis];
      size = this->grid.dimensions[axis];
      const double end = image.origin[axis] + spacing * (size - 1.0);
      if (image.origin[axis] > heart.high[axis] || end < heart.low[axis])
      {
        throw std::runtime_error("'" + this->path + "': nothing is in the image: along " +
          "xyz"[axis] + " it is from " + Format(image.origin[axis]) + " to " + Format(end) +
          " mm, the parts from " + Format(heart.low[axis]) + " to " + Format(heart.high[axis]));
      }
    }
    else
    {
      image.origin[axis] =
        0.5 * (heart.low[axis] + heart.high[axis]) - 0.5 * spacing * (size - 1.0);
    }
    voxels *= size;
    if (voxels > MostVoxels)
    {
      throw std::runtime_error("'" + this->path + "': the image is too large");
    }
    image.extent[2 * axis] = 0;
    image.extent[2 * axis + 1] = static_cast<int>(size) - 1;
  }
  return image;
}

/// The surfaces of the true parts at a phase.
void WriteTruth(
  const std::string& path, const AnatomyFile& file, double time, vtkMessageTrap& messages)
{
  FileMesh mesh;
  for (const std::size_t part : file.truth)
  {
    const auto before = static_cast<std::int64_t>(mesh.points.size());
    const std::vector<Vector3> points = file.anatomy->Surface(part, time);
    mesh.points.insert(mesh.points.end(), points.begin(), points.end());
    for (const auto& [a, b, c] : file.anatomy->Triangles(part))
    {
      mesh.triangles.push_back({ a + before, b + before, c + before });
    }
  }
  WritePolyData(path, PolyDataOf(mesh), messages);
}

void ScanJob::Write(const AnatomyFile& file, ImageScan& scan, const std::vector<double>& times,
  StagedFolder& folder, vtkMessageTrap& messages)
{
  ProgressDisplay progress("step", static_cast<int>(times.size()) + 1, this->quiet);
  const auto report = [&](double fraction)
  {
    progress.Update(fraction);
    return Interruption() == 0;
  };
  progress.BeginStep(0, "views and slices");
  scan.Scan(this->output, this->given + "surfaces " + std::to_string(file.digest) + "\n",
    this->quiet, report);
  SeriesDescription series;
  series.cycleMs = 1000.0 * file.anatomy->CycleLength();
  std::vector<TimedFile> surfaces;
  for (std::size_t i = 0; i < times.size(); ++i)
  {
    progress.BeginStep(static_cast<int>(i) + 1, PhaseText(times[i]));
    const std::string number = SeriesNumber(i, times.size());
    SeriesDescription::Phase phase;
    phase.fraction = times[i];
    phase.image = "phase_" + number + ".mha";
    scan.WriteImages(folder, i, phase.image, this->compress, report);
    if (!this->noTruth && !file.truth.empty())
    {
      const std::string name = "surface_" + number + ".vtp";
      phase.surface = "truth/" + name;
      WriteTruth(folder.Add(phase.surface), file, times[i], messages);
      surfaces.push_back({ name, times[i] });
    }
    series.phases.push_back(std::move(phase));
  }
  if (!surfaces.empty())
  {
    WriteFileAtomically(folder.Add("truth/surface.pvd"), PvdText(surfaces));
  }
  scan.WriteDescriptions(folder, series);
  ThrowIfInterrupted();
  messages.PrintWarnings();
}

void ScanJob::Run()
{
  this->grid.Check();
  const std::vector<double> times = this->phases.Phases();
  SetNumberOfThreads(this->threads);
  const ScannerSettings settings = this->scanner.Settings(this->seed);
  const std::vector<ScanVariant> variants = this->scanner.Variants(settings);
  vtkMessageTrap messages;
  const AnatomyFile file = ReadAnatomyFile(this->path, messages);
  const ImageGrid image = this->Grid(*file.anatomy);
  ImageScan scan(*file.anatomy, settings, image, times, variants);
  const AnatomyTrunk& trunk = file.anatomy->Trunk();
  if (!file.trunkGiven && !this->quiet)
  {
    std::printf(
      "%s: no trunk: an ellipse of soft tissue (0 HU), %s x %s mm around x %s, y %s, is taken\n",
      this->path.c_str(), Format(trunk.width).c_str(), Format(trunk.depth).c_str(),
      Format(trunk.centre[0]).c_str(), Format(trunk.centre[1]).c_str());
  }
  StagedFolder folder(this->output);
  try
  {
    this->Write(file, scan, times, folder, messages);
    folder.Commit();
    scan.Done();
  }
  catch (const std::runtime_error& error)
  {
    ThrowIfInterrupted();
    throw std::runtime_error(folder.Translate(error.what()));
  }
  if (!this->quiet)
  {
    const std::array<int, 6>& e = image.extent;
    std::printf("%s: %zu part%s, %zu phase%s of %d x %d x %d voxels\n", this->output.c_str(),
      file.parts, file.parts == 1 ? "" : "s", times.size(), times.size() == 1 ? "" : "s", e[1] + 1,
      e[3] + 1, e[5] + 1);
  }
}
}

Command MakeScanCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "scan", "Make a gated CT series of any anatomy of moving surfaces with a simulated scanner");
  app->footer(
    "Writes DIR/phase_NN.mha, DIR/truth/surface_NN.vtp, DIR/scan.json and, last, "
    "DIR/series.json, with NN from 00; what is in DIR/scan-parts until all is written lets "
    "a scan that was stopped go on.");
  auto job = std::make_shared<ScanJob>();
  job->Declare(*app);
  return { app,
    [job, app]
    {
      job->given = GivenOptions(*app);
      job->Run();
    } };
}
}
