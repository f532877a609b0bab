#include "Command.h"

#include "AtomicFile.h"
#include "FileSeries.h"
#include "Interruption.h"
#include "MarkupsFile.h"
#include "MovingModel.h"
#include "OptionChecks.h"
#include "ProgressDisplay.h"
#include "SegmentationFile.h"
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
  SlicerSequence WriteTransforms(
    const std::vector<TimedFile>& centerlines, const SequenceIndex& index, Step& step) const;
  SlicerStill WriteStill(Step& step) const;
  std::string FileOf(const char* name) const;
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

/// In the folder of the result; empty: it is not there.
std::string SlicerJob::FileOf(const char* name) const
{
  std::error_code error;
  const fs::path path = fs::path(this->result) / name;
  return fs::is_regular_file(path, error) ? path.string() : std::string();
}

std::vector<Vector3> PointsOf(vtkPolyData* data)
{
  std::vector<Vector3> points;
  for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
  {
    points.emplace_back(data->GetPoint(n));
  }
  return points;
}

/// The motion of the whole tree from where the mask is, so that others can be moved with it.
SlicerSequence SlicerJob::WriteTransforms(
  const std::vector<TimedFile>& centerlines, const SequenceIndex& index, Step& step) const
{
  SlicerSequence sequence;
  sequence.name = "Heart motion (affine)";
  sequence.file = "transform.seq.mrml";
  std::vector<Vector3> rest;
  const std::string tree = this->FileOf("centerline.vtp");
  if (!tree.empty())
  {
    rest = PointsOf(ReadPolyData(tree, step.messages));
  }
  for (const TimedFile& file : centerlines)
  {
    const std::vector<Vector3> now = PointsOf(ReadPolyData(file.path, step.messages));
    if (rest.size() != now.size())
    {
      if (!sequence.transforms.empty() || now.empty())
      {
        throw std::runtime_error(
          "'" + file.path + "' has other points than the centerlines of the first moment.");
      }
      rest = now; // not a result of run: from the first moment on
    }
    sequence.transforms.push_back(FitAffineMotion(rest, now));
  }
  WriteFileAtomically(step.folder.Add(sequence.file), SequenceSceneText(sequence, index));
  return sequence;
}

SlicerStill SlicerJob::WriteStill(Step& step) const
{
  SlicerStill still;
  const std::string mask = this->FileOf("mask.mha");
  if (!mask.empty())
  {
    still.segmentation = "mask.seg.nrrd";
    WriteSegmentation(step.folder.Add(still.segmentation), SegmentationFile(mask).Mask({}),
      { "Coronary arteries", { 0.85, 0.30, 0.25 }, "41801008^Coronary artery" });
  }
  const std::string tree = this->FileOf("centerline.vtp");
  if (!tree.empty())
  {
    WriteFileAtomically(step.folder.Add("centerline.mrk.json"),
      MarkupsText(CurvesOf(ReadPolyData(tree, step.messages))));
  }
  const std::string ostia = this->FileOf("ostia.vtp");
  if (!ostia.empty())
  {
    still.points = "ostia.mrk.json";
    WriteFileAtomically(step.folder.Add(still.points),
      MarkupsText(FiducialsOf(ReadPolyData(ostia, step.messages), "Ostia")));
  }
  return still;
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
  double left = -1.0; // mm, of the affine motion
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
      sequences.push_back(this->WriteTransforms(model.centerlines, index, step));
      for (const AffineMotion& motion : sequences.back().transforms)
      {
        left = std::max(left, motion.left);
      }
    }
    if (reader)
    {
      sequences.push_back(this->WriteImages(reader, index, step));
    }
    const SlicerStill still = this->WriteStill(step);
    WriteFileAtomically(folder.Add("scene.mrml"), SlicerSceneText(sequences, index, still, 1.0));
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
    if (left >= 0.0)
    {
      std::printf(
        "The affine motion leaves up to %.2g mm of the tree's (root mean square of a moment)\n",
        left);
    }
  }
}
}

Command MakeSlicerCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "slicer", "A moving model and its images as sequences in a scene of 3D Slicer");
  app->footer("Writes DIR/scene.mrml, wall.seq.mrml with wall/, and where there are any "
              "centerlines.seq.mrml with centerlines/, transform.seq.mrml, centerline.mrk.json, "
              "ostia.mrk.json, "
              "mask.seg.nrrd, image.seq.nrrd.");
  auto job = std::make_shared<SlicerJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); } };
}
}
