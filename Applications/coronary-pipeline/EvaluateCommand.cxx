#include "Command.h"

#include "AtomicFile.h"
#include "DistanceOptions.h"
#include "Evaluation.h"
#include "EvaluationJson.h"
#include "EvaluationPlots.h"
#include "EvaluationRecord.h"
#include "Interruption.h"
#include "MovingModel.h"
#include "OptionChecks.h"
#include "ProgressDisplay.h"
#include "Ranks.h"
#include "RunReview.h"
#include "StagedFolder.h"
#include "TextFile.h"
#include "vtkDataFiles.h"
#include "vtkDisplay.h"
#include "vtkEvaluationPictures.h"
#include "vtkMessageTrap.h"
#include "vtkRunCycle.h"
#include "vtkSurfaceFile.h"
#include "vtkSurfaceInput.h"
#include "vtkWebReview.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
namespace
{
/// Cases whose pictures the page has in it: they are 4 MB each. Of more it has links to them.
constexpr std::size_t MostPictured = 10;

struct EvaluateJob
{
  std::vector<std::string> results;
  std::vector<std::string> truths;
  std::vector<std::string> names;
  std::string output;
  std::vector<std::string> segments; ///< of masks that are the truth
  std::string untracked = "auto";    ///< "auto", "odd" or "none"
  MeshDistanceSettings distance;
  double foundWithin = BranchMetricsSettings().tolerance;
  double timeTolerance = 1e-3;
  bool noPictures = false;
  bool views = false;
  std::int64_t webTriangles = 0; ///< 0: as many as suit the number of phases
  std::string measureCache;
  int threads = 0;
  bool quiet = false;

  void Declare(CLI::App& app);
  void Run() const;

private:
  /// The phases of both sides: what is compared with what.
  struct PhaseFiles
  {
    PhaseEvaluation phase;
    std::string model;
    std::string truth;
    std::string modelLines; ///< may be empty
    std::string truthLines;
  };
  struct CaseFiles
  {
    CaseEvaluation evaluation; ///< without phases yet
    std::vector<PhaseFiles> phases;
  };
  CaseFiles FindCase(std::size_t number) const;
  EvaluationRecord Measure(const PhaseFiles& one, const EvaluationSettings& settings,
    vtkMessageTrap& messages, const std::function<void(double)>& progress) const;
  void Evaluate(CaseFiles& files, vtkMessageTrap& messages,
    const std::function<void(std::size_t phase)>& begin,
    const std::function<void(double)>& progress) const;
  EvaluationScene SceneOf(const CaseFiles& files, vtkMessageTrap& messages) const;
  /// Into the folder, and into the page when there is one.
  static void Draw(const EvaluationScene& scene, const std::string& subfolder, StagedFolder& folder,
    WebReview* review, std::vector<std::string>& files,
    const std::function<void(double)>& progress);
  /// The options that its tables come from, for the reader of a page.
  std::string CommandLine() const;
  /// To the page what a result that run made says of itself.
  void AddRun(const std::string& result, const CaseEvaluation& evaluation, WebReview& review,
    std::vector<std::string>& complaints, vtkMessageTrap& messages) const;
  /// How the evaluation was made, for the reader of the page.
  ReviewOrigin Origin() const;
  std::vector<bool> WhichAreInterpolated(
    const MovingModel& model, const std::vector<TimedFile>& truth, CaseFiles& files) const;
};

void EvaluateJob::Declare(CLI::App& app)
{
  app
    .add_option("--result", this->results,
      "Folder that run wrote, or a .pvd or .series file of surfaces; once for each case")
    ->allow_extra_args(false)
    ->type_name("DIR")
    ->required();
  app
    .add_option("--truth", this->truths,
      "Folder of the true surfaces (surface.pvd, truth/surface.pvd), or such a file, which may "
      "list "
      "masks (.seg.nrrd), or a series.json with a mask for its phases; once for each case")
    ->allow_extra_args(false)
    ->type_name("DIR")
    ->required();
  app.add_option("--name", this->names, "Name of a case; by default that of the result's folder")
    ->allow_extra_args(false)
    ->type_name("TEXT");
  app.add_option("--output", this->output, "Folder to write to; made when it does not exist")
    ->type_name("DIR")
    ->required();
  app
    .add_option("--mask-segment", this->segments,
      "Name or ID of a segment, where the truth is a mask; may be repeated. Without any, all of "
      "them")
    ->allow_extra_args(false)
    ->type_name("NAME");
  app
    .add_option("--interpolated", this->untracked,
      "Phases that were not tracked: auto (as the result's report says, else odd), odd or none")
    ->check(CLI::IsMember({ "auto", "odd", "none" }))
    ->capture_default_str();
  AddDistanceOptions(app, this->distance);
  app
    .add_option("--found-within", this->foundWithin,
      "How far the model's centerline may be from a true one that it has found, in mm, where the "
      "vessel's radius is less")
    ->check(Within(1e-3, 100.0))
    ->type_name("MM")
    ->capture_default_str();
  app
    .add_option("--time-tolerance", this->timeTolerance,
      "How far apart two times may be to be one phase, R-R")
    ->check(Within(0.0, 1.0))
    ->type_name("FRACTION")
    ->capture_default_str();
  app.add_flag("--no-pictures", this->noPictures, "Without pictures/, which need a display");
  app.add_flag("--views", this->views,
    "In review.html also straightened views and slabs of the vessels of a result that run made, in "
    "the image that it was found in");
  app
    .add_option("--web-triangles", this->webTriangles,
      "Triangles of a surface in review.html, at most about so many; 0: up to 150000, fewer for "
      "more than 20 phases in all")
    ->check(WholeWithin(0, 10000000))
    ->type_name("N")
    ->capture_default_str();
  app
    .add_option("--measure-cache", this->measureCache,
      "Folder in which the measures of phases are kept; the same files and settings are taken from "
      "there")
    ->type_name("DIR");
  AddThreads(app, this->threads);
  app.add_flag("--quiet", this->quiet, "No progress and no table");
}

std::vector<bool> EvaluateJob::WhichAreInterpolated(
  const MovingModel& model, const std::vector<TimedFile>& truth, CaseFiles& files) const
{
  std::vector<bool> interpolated(truth.size(), false);
  const bool known = this->untracked == "auto" && model.tracksKnown;
  if (this->untracked == "auto" && !known)
  {
    files.evaluation.warnings.push_back("'" + model.path +
      "' does not say which phases were tracked: the odd ones count as interpolated");
  }
  for (std::size_t n = 0; n < truth.size(); ++n)
  {
    if (known)
    {
      interpolated[n] =
        model.TrackingAt(truth[n].time, this->timeTolerance) == MovingModel::Tracking::None;
    }
    else
    {
      interpolated[n] = this->untracked != "none" && n % 2 == 1;
    }
  }
  return interpolated;
}

EvaluateJob::CaseFiles EvaluateJob::FindCase(std::size_t number) const
{
  const MovingModel model = FindMovingModel(this->results[number]);
  const MovingModel truth = FindMovingModel(this->truths[number]);
  CaseFiles files;
  files.evaluation.name =
    this->names.empty() ? FolderName(this->results[number]) : this->names[number];
  const std::vector<bool> interpolated = this->WhichAreInterpolated(model, truth.surfaces, files);
  std::string unmatched;
  for (std::size_t n = 0; n < truth.surfaces.size(); ++n)
  {
    const TimedFile& reference = truth.surfaces[n];
    const TimedFile* own = MovingModel::At(model.surfaces, reference.time, this->timeTolerance);
    if (!own)
    {
      unmatched += (unmatched.empty() ? "" : ", ") + Format(reference.time);
      continue;
    }
    PhaseFiles one;
    one.phase.phase = static_cast<int>(n);
    one.phase.fraction = reference.time;
    one.phase.interpolated = interpolated[n];
    one.phase.lost = !interpolated[n] &&
      model.TrackingAt(reference.time, this->timeTolerance) == MovingModel::Tracking::Lost;
    one.model = own->path;
    one.truth = reference.path;
    const TimedFile* modelLines =
      MovingModel::At(model.centerlines, reference.time, this->timeTolerance);
    const TimedFile* truthLines =
      MovingModel::At(truth.centerlines, reference.time, this->timeTolerance);
    one.modelLines = modelLines ? modelLines->path : std::string();
    one.truthLines = truthLines ? truthLines->path : std::string();
    files.phases.push_back(one);
  }
  if (files.phases.empty())
  {
    throw std::runtime_error("No time of '" + model.path + "' (" +
      Format(model.surfaces.front().time) + " to " + Format(model.surfaces.back().time) +
      ") is one of '" + truth.path + "' (" + Format(truth.surfaces.front().time) + " to " +
      Format(truth.surfaces.back().time) + ") within " + Format(this->timeTolerance) + ".");
  }
  if (!unmatched.empty())
  {
    files.evaluation.warnings.push_back("'" + model.path + "' has nothing at the truth's times " +
      unmatched + ": these phases are left out");
  }
  return files;
}

/// A side's tree in one phase: its centerline, or what the surface knows of its branches.
struct PhaseTree
{
  Polylines lines;
  std::map<std::int64_t, std::string> labels;
  std::vector<double> confidence; ///< empty: not known
};

/// How sure the model is of each point of its tree: of the vessel, and of the bridges before it.
std::vector<double> ConfidenceOf(vtkPolyData* tree)
{
  std::vector<double> confidence;
  for (const char* name :
    { vtkCoronaryArrayNames::Confidence, vtkCoronaryArrayNames::BridgeConfidence })
  {
    vtkDataArray* array = tree->GetPointData()->GetArray(name);
    if (!array || array->GetNumberOfComponents() != 1)
    {
      continue;
    }
    confidence.resize(static_cast<std::size_t>(tree->GetNumberOfPoints()), 1.0);
    for (vtkIdType n = 0; n < tree->GetNumberOfPoints(); ++n)
    {
      confidence[static_cast<std::size_t>(n)] *= array->GetComponent(n, 0);
    }
  }
  return confidence;
}

PhaseTree ReadTree(
  const std::string& path, vtkPolyData* surface, const char* side, vtkMessageTrap& messages)
{
  PhaseTree tree;
  if (path.empty())
  {
    vtkPointData* arrays = surface->GetPointData();
    const bool known = arrays->HasArray(vtkCoronaryArrayNames::GroupIds) != 0 &&
      arrays->HasArray(vtkCoronaryArrayNames::Abscissas) != 0;
    tree.lines = known ? vtkCoronary::TreeOf(surface, side) : Polylines();
    return tree;
  }
  vtkSmartPointer<vtkPolyData> lines = ReadPolyData(path, messages);
  AddGroupNames(lines, tree.labels);
  tree.lines = vtkCoronary::TreeOf(lines, side);
  tree.confidence = ConfidenceOf(lines);
  return tree;
}

EvaluationRecord EvaluateJob::Measure(const PhaseFiles& one, const EvaluationSettings& settings,
  vtkMessageTrap& messages, const std::function<void(double)>& progress) const
{
  EvaluationInput input;
  const auto read = [&](const std::string& path)
  {
    return ReadTriangles(path, vtkCoronaryArrayNames::GroupIds,
      vtkCoronaryArrayNames::CellEntityIds, messages, this->segments);
  };
  SurfaceTriangles model = read(one.model);
  SurfaceTriangles truth = read(one.truth);
  input.model = std::move(model.mesh);
  input.truth = std::move(truth.mesh);
  PhaseTree modelTree = ReadTree(one.modelLines, model.data, "result", messages);
  PhaseTree truthTree = ReadTree(one.truthLines, truth.data, "reference", messages);
  input.modelTree = std::move(modelTree.lines);
  input.modelConfidence = std::move(modelTree.confidence);
  input.modelLabels = std::move(modelTree.labels);
  input.truthTree = std::move(truthTree.lines);
  input.labels = std::move(truthTree.labels);
  PhaseEvaluation phase = one.phase;
  EvaluationRecord record;
  EvaluatePhase(input, settings, phase, record.warnings,
    [&](double fraction)
    {
      progress(fraction);
      return Interruption() == 0;
    });
  record.measures = phase.measures;
  record.branches = std::move(phase.branches);
  record.falseBranches = std::move(phase.falseBranches);
  return record;
}

void EvaluateJob::Evaluate(CaseFiles& files, vtkMessageTrap& messages,
  const std::function<void(std::size_t phase)>& begin,
  const std::function<void(double)>& progress) const
{
  EvaluationSettings settings;
  settings.distance = this->distance;
  settings.distance.signedDistances = false;
  settings.branches.tolerance = this->foundWithin;
  std::vector<std::string>& warnings = files.evaluation.warnings;
  const EvaluationCache cache(this->measureCache);
  const auto measure = [&](std::size_t n)
  {
    const PhaseFiles& one = files.phases[n];
    ThrowIfInterrupted();
    begin(n);
    const std::string name = cache.NameOf(
      { one.model, one.truth, one.modelLines, one.truthLines }, this->segments, settings);
    EvaluationRecord record;
    if (!cache.Read(name, record))
    {
      settings.distance.names = { "'" + one.model + "'", "'" + one.truth + "'" };
      record = Measure(one, settings, messages, progress);
      cache.Write(name, record);
    }
    return record.Text();
  };
  const std::vector<std::string> records = Ranks().ResultsOfAll(files.phases.size(), measure);
  for (std::size_t n = 0; n < files.phases.size(); ++n)
  {
    EvaluationRecord record = EvaluationRecord::Of(records[n]);
    PhaseEvaluation& phase = files.phases[n].phase;
    phase.measures = record.measures;
    phase.branches = std::move(record.branches);
    phase.falseBranches = std::move(record.falseBranches);
    warnings.insert(warnings.end(), record.warnings.begin(), record.warnings.end());
    files.evaluation.phases.push_back(phase);
  }
  if (std::isnan(files.evaluation.phases.front().measures.completenessRatio))
  {
    warnings.push_back("'" + files.evaluation.name +
      "' has no branches on one of the sides: there is neither BCR nor BCS");
  }
}

EvaluationScene EvaluateJob::SceneOf(const CaseFiles& files, vtkMessageTrap& messages) const
{
  const auto reader = [&files, &messages](const std::string PhaseFiles::*path)
  {
    return [&files, &messages, path](int index)
    {
      const std::string& file = files.phases[static_cast<std::size_t>(index)].*path;
      return file.empty() ? vtkSmartPointer<vtkPolyData>() : ReadPolyData(file, messages);
    };
  };
  EvaluationScene scene;
  scene.evaluation = &files.evaluation;
  scene.model = reader(&PhaseFiles::model);
  scene.truth = [this, &files, &messages](int index)
  {
    const std::string& file = files.phases[static_cast<std::size_t>(index)].truth;
    return ReadSurface(file, messages, this->segments);
  };
  scene.centerline = reader(&PhaseFiles::modelLines);
  scene.truthCenterline = reader(&PhaseFiles::truthLines);
  return scene;
}

void EvaluateJob::Draw(const EvaluationScene& scene, const std::string& subfolder,
  StagedFolder& folder, WebReview* review, std::vector<std::string>& files,
  const std::function<void(double)>& progress)
{
  const auto add = [&](auto draw, const char* name, const char* title, double done)
  {
    ThrowIfInterrupted();
    files.push_back(subfolder + name);
    const std::string path = folder.Add(files.back());
    draw(scene, path);
    if (review)
    {
      review->AddIllustration(ReadTextFile(path, "a picture"), files.back(), title);
    }
    progress(done);
    return path;
  };
  const std::string first = add(DrawOverlayGrid, "overlay.png",
    "Model (red) over truth (green) in every phase; dashed frames: interpolated", 0.4);
  add(DrawDistances, "distances.png", "Distance of the model from the truth", 0.5);
  add(DrawSequence, "sequence.png",
    "Centerlines of all phases by branch, paths of points over the cycle, meshes of three phases",
    0.7);
  ThrowIfInterrupted();
  for (const std::string& path :
    DrawBeating(scene, std::filesystem::path(first).parent_path().string()))
  {
    const std::filesystem::path name = std::filesystem::path(path).filename();
    folder.Add(subfolder + name.string());
    if (name.extension() == ".gif")
    {
      files.push_back(subfolder + name.string());
    }
  }
  progress(1.0);
}

std::string EvaluateJob::CommandLine() const
{
  // As a shell takes it.
  const auto quoted = [](const std::string& text)
  {
    if (!text.empty() &&
      text.find_first_not_of(
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._/-") == std::string::npos)
    {
      return text;
    }
    std::string safe = "'";
    for (const char c : text)
    {
      safe += c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    return safe + "'";
  };
  std::string line = "coronary-pipeline evaluate";
  for (std::size_t n = 0; n < this->results.size(); ++n)
  {
    line += " --result " + quoted(this->results[n]) + " --truth " + quoted(this->truths[n]);
    line += this->names.empty() ? "" : " --name " + quoted(this->names[n]);
  }
  line += this->untracked == "auto" ? "" : " --interpolated " + this->untracked;
  line += this->distance.clipEnds ? " --clip-ends" : "";
  line += this->foundWithin == BranchMetricsSettings().tolerance
    ? ""
    : " --found-within " + Format(this->foundWithin);
  line += this->views ? " --views" : "";
  line += this->webTriangles == 0 ? "" : " --web-triangles " + std::to_string(this->webTriangles);
  return line + " --output " + quoted(this->output);
}

ReviewOrigin EvaluateJob::Origin() const
{
  ReviewOrigin origin;
  origin.version = "coronary-pipeline " DYNAMICCORONARY_VERSION;
  origin.command = this->CommandLine();
  origin.settings = { { "Interpolated phases", this->untracked },
    { "Found", "within " + Format(this->foundWithin) + " mm, or the vessel's radius" },
    { "Hausdorff distance", "at most " + Format(this->distance.errorBound) + " mm too small" },
    { "Ends of vessels",
      this->distance.clipEnds
        ? "left out, up to " + Format(this->distance.endLength) + " mm beyond the end"
        : "compared as they are" } };
  for (std::size_t n = 0; n < this->results.size(); ++n)
  {
    origin.inputs.emplace_back(this->results[n], this->truths[n]);
  }
  return origin;
}

void EvaluateJob::AddRun(const std::string& result, const CaseEvaluation& evaluation,
  WebReview& review, std::vector<std::string>& complaints, vtkMessageTrap& messages) const
{
  if (!IsRunFolder(result))
  {
    return;
  }
  ReviewedRun run = OpenRun(result, {}, this->views, messages);
  if (this->views)
  {
    run.cycle = MeasureRunCycle(run.result, run.vessels, {}, !run.image.values, messages,
      [](double) { ThrowIfInterrupted(); });
  }
  int reference = 0;
  const auto away = [&](int index) {
    return std::abs(evaluation.phases[static_cast<std::size_t>(index)].fraction - run.result.time);
  };
  for (int n = 1; n < static_cast<int>(evaluation.phases.size()); ++n)
  {
    reference = away(n) < away(reference) ? n : reference;
  }
  if (!run.withoutPictures.empty())
  {
    complaints.push_back(run.withoutPictures);
  }
  AddRunReview(
    run, ViewSettings(), reference, review, nullptr, [](const std::string&) {},
    [](double) { return Interruption() == 0; });
}

void EvaluateJob::Run() const
{
  if (this->results.size() != this->truths.size())
  {
    throw UsageError("--result and --truth: one of each for every case, not " +
      std::to_string(this->results.size()) + " and " + std::to_string(this->truths.size()));
  }
  if (!this->names.empty() && this->names.size() != this->results.size())
  {
    throw UsageError("--name: one for every case, or none");
  }
  UseThreads(this->threads);
  std::vector<CaseFiles> cases;
  std::size_t steps = 0;
  for (std::size_t n = 0; n < this->results.size(); ++n)
  {
    cases.push_back(this->FindCase(n));
    steps += cases.back().phases.size();
  }
  std::string why;
  const bool first = Ranks().IsFirst();
  const bool draw = first && !this->noPictures && CanDraw(why);
  const std::string withoutPictures =
    draw || this->noPictures || !first ? "" : "there are no pictures: " + why;

  const std::unique_ptr<StagedFolder> staged = Ranks().MakeFolder(this->output);
  StagedFolder& folder = *staged;
  vtkMessageTrap messages;
  std::vector<std::string> complaints;
  std::vector<CaseEvaluation> evaluations;
  try
  {
    ProgressDisplay progress("step", static_cast<int>(steps + cases.size()), this->quiet || !first);
    const auto update = [&](double fraction) { progress.Update(fraction); };
    int step = 0;
    for (CaseFiles& files : cases)
    {
      this->Evaluate(
        files, messages,
        [&](std::size_t n)
        {
          progress.BeginStep(step + static_cast<int>(n),
            files.evaluation.name + ", phase " + std::to_string(files.phases[n].phase.phase));
        },
        update);
      step += static_cast<int>(files.phases.size());
      evaluations.push_back(files.evaluation);
    }
    messages.ThrowIfError();
    complaints = LinesOfAll(messages.TakeWarnings());
    if (!first)
    {
      return;
    }
    const OthersWait alone(this->threads);
    std::vector<std::string> files;
    const auto write = [&](const std::string& name, const std::string& text)
    {
      files.push_back(name);
      WriteFileAtomically(folder.Add(name), text);
    };
    write("table1.csv", EvaluationCsv(evaluations));
    write("table1.tex", EvaluationLatex(evaluations));
    write("branches.csv", BranchCsv(evaluations));
    const std::vector<EvaluationPlot> plots = DrawPlots(evaluations);
    for (const EvaluationPlot& plot : plots)
    {
      write("plots/" + plot.key + ".svg", plot.svg);
    }
    WebReview review;
    review.SetPlots(plots);
    const std::int64_t triangles = this->webTriangles > 0
      ? this->webTriangles
      : DefaultReviewTriangles(static_cast<std::int64_t>(steps));
    for (std::size_t n = 0; n < cases.size(); ++n)
    {
      progress.BeginStep(step++, cases[n].evaluation.name + ", pictures");
      // What it has read goes with it.
      const EvaluationScene scene = SceneOf(cases[n], messages);
      review.Add(evaluations[n],
        MakeReviewCase(scene, triangles,
          [&](double fraction)
          {
            update(fraction);
            return Interruption() == 0;
          }));
      this->AddRun(this->results[n], evaluations[n], review, complaints, messages);
      if (draw)
      {
        const std::string subfolder =
          cases.size() == 1 ? "pictures/" : "pictures/" + std::to_string(n + 1) + "/";
        Draw(scene, subfolder, folder, cases.size() <= MostPictured ? &review : nullptr, files,
          update);
      }
    }
    files.emplace_back("table1.json");
    ReviewOrigin origin = this->Origin();
    origin.files = files;
    if (!withoutPictures.empty())
    {
      origin.warnings.push_back(withoutPictures);
    }
    WriteFileAtomically(folder.Add("review.html"), review.Html(origin));
    // Where it stands, all others do.
    WriteFileAtomically(folder.Add("table1.json"), EvaluationJson(evaluations).dump(2) + "\n");
    messages.ThrowIfError();
    ThrowIfInterrupted();
  }
  catch (const std::runtime_error& error)
  {
    ThrowIfInterrupted();
    throw std::runtime_error(folder.Translate(error.what()));
  }
  folder.Commit();
  for (const std::string& complaint : complaints)
  {
    std::fprintf(stderr, "Warning: %s\n", complaint.c_str());
  }
  messages.PrintWarnings();
  for (const CaseEvaluation& one : evaluations)
  {
    for (const std::string& warning : one.warnings)
    {
      std::fprintf(stderr, "Warning: %s.\n", warning.c_str());
    }
  }
  if (!withoutPictures.empty())
  {
    std::fprintf(stderr, "Warning: %s.\n", withoutPictures.c_str());
  }
  if (!this->quiet)
  {
    std::printf("%s", EvaluationText(evaluations).c_str());
  }
}
}

Command MakeEvaluateCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "evaluate", "A moving model against the truth, phase by phase: Table 1 of the paper");
  app->footer(
    "Writes DIR/review.html, one file for a web browser, without network: tables, plots, and the "
    "beating model to be turned and compared; table1.csv, table1.tex, table1.json, branches.csv, "
    "plots/; and with a display pictures/ (of several cases pictures/1/, ...). On a machine "
    "without "
    "one: xvfb-run -a coronary-pipeline evaluate ...");
  auto job = std::make_shared<EvaluateJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); }, true };
}
}
