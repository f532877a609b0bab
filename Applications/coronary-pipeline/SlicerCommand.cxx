#include "Command.h"

#include "AtomicFile.h"
#include "FileSeries.h"
#include "Interruption.h"
#include "MarkupsFile.h"
#include "MovingModel.h"
#include "OptionChecks.h"
#include "ProgressDisplay.h"
#include "SlicerScene.h"
#include "StagedFolder.h"
#include "vtkDataFiles.h"
#include "vtkMarkups.h"
#include "vtkMessageTrap.h"
#include "vtkSlicerModel.h"
#include "vtkSurfaceFile.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkGatedImageReader.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkShortArray.h"

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

struct SlicerJob
{
  std::string result;
  std::string output;
  std::vector<std::string> images;
  std::string kind = "vtp";
  double cycleMs = 0.0; ///< 0: as the files say
  bool compress = false;
  bool quiet = false;

  void Declare(CLI::App& app);
  void Run() const;

private:
  struct Step
  {
    StagedFolder& folder;
    vtkMessageTrap& messages;
    ProgressDisplay& progress;
    int number = 0;
  };
  SequenceIndex IndexOf(
    const MovingModel& model, vtkGatedImageReader* reader, vtkMessageTrap& messages) const;
  SlicerSequence WriteModels(const std::vector<TimedFile>& files, const std::string& name,
    const SequenceIndex& index, Step& step) const;
  SlicerSequence WriteImages(
    vtkGatedImageReader* reader, const SequenceIndex& index, Step& step) const;
  std::string WritePoints(Step& step) const;
};

void SlicerJob::Declare(CLI::App& app)
{
  app
    .add_option("RESULT,--result", this->result,
      "Folder that run or phantom wrote, or a .pvd or .series file of surfaces")
    ->type_name("DIR")
    ->required();
  app.add_option("--output", this->output, "Folder to write to; made when it does not exist")
    ->type_name("DIR")
    ->required();
  app
    .add_option("--image", this->images,
      "The gated images, as of run: they become a sequence of volumes; their phases have to be "
      "those of "
      "RESULT")
    ->type_name("PATH");
  app.add_option("--models", this->kind, "Kind of the model files: vtp, vtk, stl, ply or obj")
    ->check(CLI::IsMember({ "vtp", "vtk", "stl", "ply", "obj" }))
    ->type_name("KIND")
    ->capture_default_str();
  app
    .add_option("--cycle-ms", this->cycleMs,
      "R-R interval, in ms, where the files do not tell it; without it 1000")
    ->check(Within(1.0, 60000.0))
    ->type_name("MS");
  app.add_flag("--compress", this->compress, "Compress the volumes");
  app.add_flag("--quiet", this->quiet, "No progress and no summary");
}

/// Of the field data, 0 when it is not there.
double CycleSeconds(vtkDataObject* data)
{
  vtkDataArray* cycle = data->GetFieldData()->GetArray(vtkCoronaryArrayNames::CycleLength);
  return cycle != nullptr && cycle->GetNumberOfTuples() == 1 ? cycle->GetTuple1(0) : 0.0;
}

SequenceIndex SlicerJob::IndexOf(
  const MovingModel& model, vtkGatedImageReader* reader, vtkMessageTrap& messages) const
{
  double seconds = this->cycleMs / 1000.0;
  if (!(seconds > 0.0) && reader != nullptr)
  {
    reader->Update();
    messages.ThrowIfError();
    seconds = CycleSeconds(reader->GetOutput());
  }
  if (!(seconds > 0.0) && EndsWith(model.surfaces.front().path, ".vtp"))
  {
    seconds = CycleSeconds(ReadPolyData(model.surfaces.front().path, messages));
  }
  if (!(seconds > 0.0))
  {
    seconds = 1.0;
  }
  SequenceIndex index;
  for (const TimedFile& file : model.surfaces)
  {
    // Whole microseconds: the last digits of a product say nothing.
    index.values.push_back(std::round(file.time * seconds * 1e6) / 1e3);
  }
  return index;
}

SlicerSequence SlicerJob::WriteModels(const std::vector<TimedFile>& files, const std::string& name,
  const SequenceIndex& index, Step& step) const
{
  SlicerSequence sequence;
  sequence.name = name;
  const std::string folder = LowerCase(name);
  sequence.file = folder + ".seq.mrml";
  // Lines have no faces, which the other kinds are made of.
  const bool lines = name == "Centerlines";
  const std::string ending = lines ? "vtp" : this->kind;
  for (std::size_t n = 0; n < files.size(); ++n)
  {
    ThrowIfInterrupted();
    step.progress.BeginStep(step.number++, name + " " + std::to_string(n));
    std::string item = folder;
    item.append("/").append(folder).append("_").append(SeriesNumber(n, files.size(), 3));
    item.append(".").append(ending);
    const auto data = lines ? ReadPolyData(files[n].path, step.messages)
                            : ReadSurface(files[n].path, step.messages);
    WriteSlicerModel(step.folder.Add(item), data, step.messages);
    sequence.items.push_back(item);
  }
  WriteFileAtomically(step.folder.Add(sequence.file), SequenceSceneText(sequence, index));
  return sequence;
}

SlicerSequence SlicerJob::WriteImages(
  vtkGatedImageReader* reader, const SequenceIndex& index, Step& step) const
{
  SlicerSequence sequence;
  sequence.name = "CT";
  sequence.file = "image.seq.nrrd";
  const std::string path = step.folder.Add(sequence.file);
  const auto read = [&](std::size_t n, auto* voxels)
  {
    using Value = std::decay_t<decltype(*voxels)>;
    step.progress.BeginStep(step.number++, "image " + std::to_string(n));
    UpdateAtTime(reader, 0, reader->GetPhaseTime(static_cast<int>(n)), step.messages,
      [&](double fraction) { step.progress.Update(fraction); });
    vtkDataArray* values = reader->GetOutput()->GetPointData()->GetScalars();
    for (vtkIdType voxel = 0; voxel < values->GetNumberOfTuples(); ++voxel)
    {
      voxels[voxel] = static_cast<Value>(values->GetComponent(voxel, 0));
    }
  };
  reader->Update();
  step.messages.ThrowIfError();
  const ImageGrid grid = vtkCoronary::GridOf(reader->GetOutput());
  if (vtkShortArray::SafeDownCast(reader->GetOutput()->GetPointData()->GetScalars()) != nullptr)
  {
    WriteNrrdSequence(path, grid, index, this->compress,
      std::function<void(std::size_t, short*)>(
        [&](std::size_t n, short* voxels)
        {
          read(n, voxels);
          if (vtkShortArray::SafeDownCast(reader->GetOutput()->GetPointData()->GetScalars()) ==
            nullptr)
          {
            throw std::runtime_error(
              "'" + reader->GetPhaseFileName(static_cast<int>(n)) + "' has values beyond 16 bits.");
          }
        }));
  }
  else
  {
    WriteNrrdSequence(
      path, grid, index, this->compress, std::function<void(std::size_t, float*)>(read));
  }
  return sequence;
}

std::string SlicerJob::WritePoints(Step& step) const
{
  const auto there = [&](const char* name)
  {
    std::error_code error;
    const fs::path path = fs::path(this->result) / name;
    return fs::is_regular_file(path, error) ? path.string() : std::string();
  };
  const std::string tree = there("centerline.vtp");
  if (!tree.empty())
  {
    WriteFileAtomically(step.folder.Add("centerline.mrk.json"),
      MarkupsText(CurvesOf(ReadPolyData(tree, step.messages))));
  }
  const std::string ostia = there("ostia.vtp");
  if (ostia.empty())
  {
    return {};
  }
  WriteFileAtomically(step.folder.Add("ostia.mrk.json"),
    MarkupsText(FiducialsOf(ReadPolyData(ostia, step.messages), "Ostia")));
  return "ostia.mrk.json";
}

void SlicerJob::Run() const
{
  const MovingModel model = FindMovingModel(this->result);
  vtkMessageTrap messages;
  vtkSmartPointer<vtkGatedImageReader> reader;
  if (!this->images.empty())
  {
    reader = vtkSmartPointer<vtkGatedImageReader>::New();
    for (const std::string& path : this->images)
    {
      reader->AddFileName(path.c_str());
    }
    reader->UpdateInformation();
    messages.ThrowIfError();
    bool same = static_cast<std::size_t>(reader->GetNumberOfPhases()) == model.surfaces.size();
    for (int n = 0; same && n < reader->GetNumberOfPhases(); ++n)
    {
      same =
        std::abs(reader->GetPhaseTime(n) - model.surfaces[static_cast<std::size_t>(n)].time) < 1e-3;
    }
    if (!same)
    {
      throw std::runtime_error("The " + std::to_string(reader->GetNumberOfPhases()) +
        " phases of the images are not the " + std::to_string(model.surfaces.size()) +
        " moments of '" + this->result + "'.");
    }
  }
  const SequenceIndex index = this->IndexOf(model, reader, messages);
  StagedFolder folder(this->output);
  const std::size_t steps =
    model.surfaces.size() + model.centerlines.size() + (reader ? model.surfaces.size() : 0);
  try
  {
    ProgressDisplay progress("file", static_cast<int>(steps), this->quiet);
    Step step{ folder, messages, progress };
    std::vector<SlicerSequence> sequences;
    sequences.push_back(this->WriteModels(model.surfaces, "Wall", index, step));
    sequences.back().color = { 0.85, 0.30, 0.25 };
    const bool sameTimes = std::equal(model.surfaces.begin(), model.surfaces.end(),
      model.centerlines.begin(), model.centerlines.end(),
      [](const TimedFile& a, const TimedFile& b) { return a.time == b.time; });
    if (sameTimes)
    {
      sequences.back().opacity = 0.6;
      sequences.push_back(this->WriteModels(model.centerlines, "Centerlines", index, step));
      sequences.back().color = { 0.95, 0.85, 0.20 };
    }
    if (reader)
    {
      sequences.push_back(this->WriteImages(reader, index, step));
    }
    const std::string points = this->WritePoints(step);
    WriteFileAtomically(folder.Add("scene.mrml"), SlicerSceneText(sequences, index, points, 1.0));
    ThrowIfInterrupted();
  }
  catch (const std::runtime_error& error)
  {
    ThrowIfInterrupted();
    throw std::runtime_error(folder.Translate(error.what()));
  }
  folder.Commit();
  messages.PrintWarnings();
  if (!this->quiet)
  {
    std::printf("%s/scene.mrml: %zu moments, %g to %g ms\n", this->output.c_str(),
      index.values.size(), index.values.front(), index.values.back());
  }
}
}

Command MakeSlicerCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "slicer", "A moving model and its images as sequences in a scene of 3D Slicer");
  app->footer("Writes DIR/scene.mrml, wall.seq.mrml with wall/, and where there are any "
              "centerlines.seq.mrml with centerlines/, centerline.mrk.json, ostia.mrk.json, "
              "image.seq.nrrd.");
  auto job = std::make_shared<SlicerJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); } };
}
}
