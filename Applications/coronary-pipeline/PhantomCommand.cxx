#include "Command.h"

#include "AtomicFile.h"
#include "CoronaryPhantom.h"
#include "DiseaseOptions.h"
#include "FileSeries.h"
#include "ImageScan.h"
#include "Interruption.h"
#include "MetaImageWriter.h"
#include "OptionChecks.h"
#include "PhantomOptions.h"
#include "ProgressDisplay.h"
#include "ScannerOptions.h"
#include "SeriesDescription.h"
#include "StagedFolder.h"
#include "vtkAortaData.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkDataArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
namespace
{
constexpr const char* DiseaseName = "truth/disease.json";

// Share of a phase's time that its parts take, for the progress.
constexpr double TruthShare = 0.3;
constexpr double RenderShare = 0.65;

struct PhantomJob
{
  PhantomSettings settings;
  PhaseOptions phases;
  DiseaseOptions disease;
  ScannerOptions scanner;
  ScannerSettings scan; ///< what scanner.Settings() says
  std::vector<ScanVariant> variants;
  std::string given; ///< all options that decide what the images are, as text
  GridOptions grid;
  std::vector<double> direction;
  std::string output;
  int threads = 0;
  bool compress = false;
  bool truthOnly = false;
  bool noTruth = false;
  bool quiet = false;

  void Declare(CLI::App& app);
  void Run();

private:
  void CheckCombinations();
  void Configure(vtkCoronaryPhantomSource* source, const std::vector<double>& times) const;
};

void PhantomJob::Declare(CLI::App& app)
{
  app.add_option("--output", this->output, "Folder to write to; made when it does not exist")
    ->type_name("DIR")
    ->check(CLI::Validator(
      [](std::string& text) { return text.empty() ? "a name is needed" : std::string(); }, ""))
    ->required();
  this->phases.AddTo(app);
  this->phases.AddLostTo(app);
  AddHeartOptions(app, this->settings);
  AddImagingOptions(app, this->settings);
  this->disease.AddTo(app);

  this->grid.AddTo(app, "the whole tree over the whole cycle");
  app
    .add_option("--direction", this->direction,
      "Orthonormal matrix, row by row, whose columns are the world axes (LPS) of the image axes")
    ->expected(9)
    ->check(Within(-1.0, 1.0))
    ->type_name("COSINE")
    ->group(GridOptions::Group);

  this->scanner.AddTo(app);
  AddTruthOptions(app, this->settings);
  CLI::Option* truthOnlyFlag =
    app
      .add_flag("--truth-only", this->truthOnly, "Write the truth alone: no images, no series.json")
      ->group("Truth");
  app.add_flag("--no-truth", this->noTruth, "Write no truth")
    ->group("Truth")
    ->excludes(truthOnlyFlag);
  truthOnlyFlag->excludes(app.get_option("--scanner"));
  app.add_flag("--compress", this->compress, "Compress the images (zlib)");
  AddThreads(app, this->threads);
  app.add_flag("--quiet", this->quiet, "Show no progress and no summary");
}

void PhantomJob::CheckCombinations()
{
  if (!this->scanner.Given() && this->settings.temporalWindow > 0.5 * this->settings.cycleLength)
  {
    throw UsageError("--window: " + Format(1000.0 * this->settings.temporalWindow) +
      " ms is more than half of the cycle (--cycle-ms " +
      Format(1000.0 * this->settings.cycleLength) + ")");
  }
  this->grid.Check();
  if (!this->direction.empty())
  {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> matrix(this->direction.data());
    const auto deviation = [&]
    { return (matrix.transpose() * matrix - Matrix3::Identity()).cwiseAbs().maxCoeff(); };
    if (deviation() > 1e-3)
    {
      throw UsageError("--direction: the matrix is not orthonormal");
    }
    // Cosines are often given with a few digits only: the nearest orthonormal matrix is meant.
    // Newton's iteration for the polar factor: each step squares the deviation.
    for (int step = 0; step < 3; ++step)
    {
      const Matrix3 next = 0.5 * matrix * (3.0 * Matrix3::Identity() - matrix.transpose() * matrix);
      matrix = next;
    }
  }
}

void PhantomJob::Configure(vtkCoronaryPhantomSource* source, const std::vector<double>& times) const
{
  const PhantomSettings& s = this->settings;
  source->SetSeed(static_cast<int>(s.seed));
  source->SetDominance(static_cast<int>(s.dominance));
  source->SetRamus(s.ramus);
  source->SetCalibre(s.calibre);
  source->SetPositionVariation(s.positionVariation);
  source->SetCalibreVariation(s.calibreVariation);
  source->SetTortuosity(s.tortuosity);
  source->SetStenoses(s.stenoses);
  source->SetStenosisDegree(s.stenosisDegree);
  source->SetCalcifiedPlaques(s.calcifiedPlaques);
  source->SetChronicOcclusion(s.chronicOcclusion);
  source->SetDisease(s.disease);
  source->SetCycleLength(s.cycleLength);
  source->SetMotionAmplitude(s.motionAmplitude);
  source->SetAxialMotionRight(s.axialMotionRight);
  source->SetAxialMotionLeft(s.axialMotionLeft);
  source->SetRegionalLag(s.regionalLag);
  source->SetRegionalAmplitude(s.regionalAmplitude);
  source->SetBeatVariation(s.beatVariation);
  source->SetBeatIrregularity(s.beatIrregularity);
  source->SetAreaPulse(s.areaPulse);
  source->SetTemporalWindow(s.temporalWindow);
  source->SetNoise(s.noise);
  source->SetNoiseCorrelation(s.noiseCorrelation);
  source->SetSystolicNoise(s.systolicNoise);
  source->SetPointSpread(s.pointSpread);
  source->SetLumenHU(s.lumenHU);
  source->SetAttenuationGradient(s.attenuationGradient);
  source->SetVeinHU(s.veinHU);
  source->SetCenterlineSpacing(s.centerlineSpacing);
  source->SetSurfaceSpacing(s.surfaceSpacing);
  source->ClearLostPhases();
  for (const LostPhase& lost : s.lostPhases)
  {
    source->AddLostPhase(lost.time, lost.fraction);
  }
  source->ClearPhases();
  for (const double time : times)
  {
    source->AddPhase(time);
  }
  const std::vector<double>& spacing = this->grid.spacing;
  source->SetSpacing(spacing[0], spacing[1], spacing[2]);
  if (!this->direction.empty())
  {
    source->SetDirection(this->direction.data());
  }
  if (this->grid.Given())
  {
    source->AutomaticGridOff();
    source->SetOrigin(this->grid.origin[0], this->grid.origin[1], this->grid.origin[2]);
    source->SetDimensions(
      this->grid.dimensions[0], this->grid.dimensions[1], this->grid.dimensions[2]);
  }
}

std::vector<SeriesDescription::Seed> SeedsOf(vtkPolyData* ostia)
{
  std::vector<SeriesDescription::Seed> seeds;
  auto* names = vtkStringArray::SafeDownCast(
    ostia->GetPointData()->GetAbstractArray(vtkCoronaryArrayNames::Name));
  for (vtkIdType i = 0; names && i < ostia->GetNumberOfPoints(); ++i)
  {
    SeriesDescription::Seed seed;
    seed.name = names->GetValue(i);
    ostia->GetPoint(i, seed.position.data());
    seeds.push_back(std::move(seed));
  }
  return seeds;
}

double MeanSpeed(vtkPolyData* tree)
{
  vtkDataArray* velocity = tree->GetPointData()->GetArray(vtkCoronaryArrayNames::Velocity);
  double sum = 0.0;
  for (vtkIdType i = 0; i < velocity->GetNumberOfTuples(); ++i)
  {
    sum += Eigen::Map<const Vector3>(velocity->GetTuple3(i)).norm();
  }
  return sum / static_cast<double>(std::max<vtkIdType>(1, velocity->GetNumberOfTuples()));
}

/// Makes the files of one series, phase by phase.
class SeriesWriter
{
public:
  SeriesWriter(
    const PhantomJob& job, vtkCoronaryPhantomSource* source, const std::vector<double>& times)
    : Job(job)
    , Source(source)
    , Times(times)
    , Progress(job.scanner.Given() ? "step" : "phase",
        static_cast<int>(times.size()) + (job.scanner.Given() ? 1 : 0), job.quiet)
  {
    for (std::size_t i = 0; i < times.size(); ++i)
    {
      this->Numbers.push_back(SeriesNumber(i, times.size()));
    }
    this->Series.cycleMs = 1000.0 * job.settings.cycleLength;
    if (!job.noTruth && IsDiseased(job.settings))
    {
      this->Stems.emplace_back("wall");
    }
    this->FindGrid();
    if (job.scanner.Given())
    {
      this->MakeScanner();
    }
  }

  void Write(StagedFolder& folder)
  {
    if (this->Scanner)
    {
      this->Progress.BeginStep(0, "views and slices");
      this->Scanner->Scan(this->Job.output, this->Job.given, this->Job.quiet,
        [&](double fraction) { return this->Report(fraction); });
    }
    for (std::size_t i = 0; i < this->Times.size(); ++i)
    {
      this->Progress.BeginStep(
        static_cast<int>(i) + (this->Scanner ? 1 : 0), PhaseText(this->Times[i]));
      SeriesDescription::Phase phase;
      phase.fraction = this->Times[i];
      this->FindSeeds(this->Times[i]);
      if (!this->Job.noTruth)
      {
        this->WriteTruth(folder, i, phase);
      }
      if (!this->Job.truthOnly)
      {
        this->WriteImage(folder, i, phase);
      }
      this->Series.phases.push_back(std::move(phase));
    }
    if (!this->Job.noTruth)
    {
      for (const std::string& stem : this->Stems)
      {
        std::vector<TimedFile> files;
        for (std::size_t i = 0; i < this->Times.size(); ++i)
        {
          files.push_back({ stem + "_" + this->Numbers[i] + ".vtp", this->Times[i] });
        }
        WriteFileAtomically(folder.Add("truth/" + stem + ".pvd"), PvdText(files));
      }
      if (IsDiseased(this->Job.settings))
      {
        WriteFileAtomically(
          folder.Add(DiseaseName), DescribeDisease(this->TruePhantom(), this->Times));
      }
    }
    if (this->Scanner)
    {
      this->Scanner->WriteDescriptions(folder, this->Series);
    }
    else if (!this->Job.truthOnly)
    {
      WriteSeriesDescription(folder.Add(SeriesName), this->Series);
    }
    ThrowIfInterrupted();
    this->Messages.PrintWarnings();
  }

  /// What was made, in a line for the user.
  std::string Summary() const
  {
    std::ostringstream text;
    text << this->Times.size() << (this->Times.size() == 1 ? " phase" : " phases");
    if (!this->Job.truthOnly)
    {
      const auto& e = this->Grid.extent;
      const Vector3& s = this->Grid.spacing;
      text << " of " << e[1] - e[0] + 1 << " x " << e[3] - e[2] + 1 << " x " << e[5] - e[4] + 1
           << " voxels of " << Format(s[0]) << " x " << Format(s[1]) << " x " << Format(s[2])
           << " mm, cycle " << Format(this->Series.cycleMs) << " ms, seeds at "
           << PhaseText(this->ReferenceTime);
    }
    return text.str();
  }

  /// The files are in place: the parts that they were made of are not needed any more.
  void Done()
  {
    if (this->Scanner)
    {
      this->Scanner->Done();
    }
  }

private:
  /// Where the images are to be, before there is one.
  void FindGrid()
  {
    this->Source->UpdateInformation();
    vtkInformation* image = this->Source->GetOutputInformation(vtkCoronaryPhantomSource::ImagePort);
    image->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), this->Grid.extent.data());
    image->Get(vtkDataObject::ORIGIN(), this->Grid.origin.data());
    image->Get(vtkDataObject::SPACING(), this->Grid.spacing.data());
    if (image->Has(vtkDataObject::DIRECTION()))
    {
      using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
      this->Grid.direction = Eigen::Map<const Rows>(image->Get(vtkDataObject::DIRECTION()));
    }
  }

  /// The phantom itself, made when it is needed first.
  const CoronaryPhantom& TruePhantom()
  {
    if (!this->Phantom)
    {
      this->Phantom = std::make_unique<CoronaryPhantom>(this->Job.settings);
    }
    return *this->Phantom;
  }

  /// A scanner with the heart in it, before anything is computed: a wrong setting is told at once.
  void MakeScanner()
  {
    this->Anatomy = std::make_unique<ScannedPhantom>(this->TruePhantom());
    this->Scanner = std::make_unique<ImageScan>(
      *this->Anatomy, this->Job.scan, this->Grid, this->Times, this->Job.variants);
  }

  /// Of the step; false when the work is to stop.
  bool Report(double fraction)
  {
    this->Progress.Update(fraction);
    return Interruption() == 0;
  }

  /// Brings a port up to date; the progress of the phase goes from `first` to `last`.
  void Update(int port, double time, double first, double last)
  {
    UpdateAtTime(this->Source, port, time, this->Messages,
      [&](double fraction) { this->Progress.Update(first + (last - first) * fraction); });
  }

  vtkPolyData* PolyData(int port, double time, double first, double last)
  {
    this->Update(port, time, first, last);
    return vtkPolyData::SafeDownCast(this->Source->GetOutputDataObject(port));
  }

  /// The seeds are the ostia in the quietest phase that is not lost: there the tree is sought.
  void FindSeeds(double time)
  {
    const auto& lost = this->Job.settings.lostPhases;
    const bool isLost = std::any_of(
      lost.begin(), lost.end(), [=](const LostPhase& phase) { return phase.time == time; });
    const double speed =
      MeanSpeed(this->PolyData(vtkCoronaryPhantomSource::TreePort, time, 0.0, 0.0));
    if (this->Series.seeds.empty() || (this->ReferenceIsLost && !isLost) ||
      (this->ReferenceIsLost == isLost && speed < this->MinimumSpeed))
    {
      this->Series.seeds =
        SeedsOf(this->PolyData(vtkCoronaryPhantomSource::OstiaPort, time, 0.0, 0.0));
      this->ReferenceTime = time;
      this->ReferenceIsLost = isLost;
      this->MinimumSpeed = speed;
    }
  }

  void WriteTruth(StagedFolder& folder, std::size_t index, SeriesDescription::Phase& phase)
  {
    const auto write = [&](int port, const std::string& stem)
    {
      std::string name = "truth/" + stem + "_" + this->Numbers[index] + ".vtp";
      vtkPolyData* data =
        this->PolyData(port, phase.fraction, 0.0, this->Job.truthOnly ? 1.0 : TruthShare);
      WritePolyData(folder.Add(name), data, this->Messages);
      data->ReleaseData(); // not kept beside the image
      return name;
    };
    write(vtkCoronaryPhantomSource::VeinPort, "vein");
    if (IsDiseased(this->Job.settings))
    {
      write(vtkCoronaryPhantomSource::WallPort, "wall");
    }
    this->WriteAorta(folder, index, phase.fraction);
    phase.centerline = write(vtkCoronaryPhantomSource::TreePort, "centerline");
    phase.surface = write(vtkCoronaryPhantomSource::SurfacePort, "surface");
  }

  /// What the image holds of the aorta, completed as `run` completes it.
  void WriteAorta(StagedFolder& folder, std::size_t index, double time)
  {
    std::vector<AorticRing> rings = this->TruePhantom().Aorta(time);
    const Vector3 low(this->Grid.extent[0], this->Grid.extent[2], this->Grid.extent[4]);
    const Vector3 high(this->Grid.extent[1], this->Grid.extent[3], this->Grid.extent[5]);
    const auto outside = [&](const Vector3& p)
    {
      const Vector3 voxel = (this->Grid.direction.transpose() * (p - this->Grid.origin))
                              .cwiseQuotient(this->Grid.spacing);
      return (voxel - low).minCoeff() < 0.0 || (high - voxel).minCoeff() < 0.0;
    };
    rings.erase(std::find_if(rings.begin(), rings.end(),
                  [&](const AorticRing& ring)
                  { return std::any_of(ring.rim.begin(), ring.rim.end(), outside); }),
      rings.end());
    constexpr std::size_t least = 3;
    if (rings.size() < least)
    {
      return;
    }
    const AorticModel aorta = ModelAorta(rings);
    const std::string words = DescribeAorta(aorta, "the image's border");
    const std::string number = this->Numbers[index] + ".vtp";
    WritePolyData(
      folder.Add("truth/aorta_wall_" + number), AorticSurface(aorta, words), this->Messages);
    WritePolyData(folder.Add("truth/aorta_centerline_" + number), AorticCenterline(aorta, words),
      this->Messages);
  }

  void WriteImage(StagedFolder& folder, std::size_t index, SeriesDescription::Phase& phase)
  {
    const double first = this->Job.noTruth ? 0.0 : TruthShare;
    const double written = std::min(1.0, first + RenderShare);
    phase.image = "phase_" + this->Numbers[index] + ".mha";
    if (this->Scanner)
    {
      this->Scanner->WriteImages(folder, index, phase.image, this->Job.compress,
        [&](double fraction) { return this->Report(first + (1.0 - first) * fraction); });
      return;
    }
    this->Update(vtkCoronaryPhantomSource::ImagePort, phase.fraction, first, written);
    auto* image = vtkImageData::SafeDownCast(
      this->Source->GetOutputDataObject(vtkCoronaryPhantomSource::ImagePort));
    this->Grid = vtkCoronary::GridOf(image);
    WriteMetaImage(folder.Add(phase.image), this->Grid,
      static_cast<const short*>(image->GetScalarPointer()), this->Job.compress,
      [&](double fraction) { return this->Report(written + (1.0 - written) * fraction); });
    image->ReleaseData();
  }

  const PhantomJob& Job;
  vtkCoronaryPhantomSource* Source;
  const std::vector<double>& Times;
  std::vector<std::string> Numbers;
  std::vector<std::string> Stems{ "surface", "centerline", "vein" }; ///< of the truth's files
  ProgressDisplay Progress;
  vtkMessageTrap Messages;
  SeriesDescription Series;
  ImageGrid Grid;
  std::unique_ptr<CoronaryPhantom> Phantom; ///< see TruePhantom()
  std::unique_ptr<ScannedAnatomy> Anatomy;
  std::unique_ptr<ImageScan> Scanner; ///< none: images by a formula
  double ReferenceTime = 0.0;
  bool ReferenceIsLost = false;
  double MinimumSpeed = 0.0;
};

void PhantomJob::Run()
{
  this->CheckCombinations();
  this->disease.Apply(this->settings);
  const std::vector<double> times = this->phases.Phases();
  this->settings.lostPhases = this->phases.LostPhases(times);
  SetNumberOfThreads(this->threads);
  if (this->scanner.Given())
  {
    this->scan = this->scanner.Settings(this->settings.seed);
    this->variants = this->scanner.Variants(this->scan);
    // The truth's visibility is that of the scanner's temporal resolution.
    this->settings.temporalWindow =
      std::min(0.5 * this->settings.cycleLength, 0.5 * this->scan.turnTime / this->scan.sources);
  }

  vtkNew<vtkCoronaryPhantomSource> source;
  this->Configure(source, times);
  StagedFolder folder(this->output);
  std::string summary;
  try
  {
    SeriesWriter writer(*this, source, times);
    writer.Write(folder);
    summary = writer.Summary();
    folder.Commit();
    writer.Done();
  }
  catch (const std::runtime_error& error)
  {
    ThrowIfInterrupted();
    throw std::runtime_error(folder.Translate(error.what()));
  }
  if (!this->quiet)
  {
    std::printf("%s: %s\n", this->output.c_str(), summary.c_str());
  }
}
}

Command MakePhantomCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "phantom", "Make a gated CT series of a beating coronary tree, with its exact truth");
  app->footer(
    "Writes DIR/phase_NN.mha, DIR/truth/surface_NN.vtp, centerline_NN.vtp, vein_NN.vtp, "
    "aorta_wall_NN.vtp, aorta_centerline_NN.vtp and, last, DIR/series.json, with NN from 00; with "
    "disease DIR/truth/disease.json and wall_NN.vtp; with --scanner DIR/scan.json: what is in "
    "DIR/scan-parts until all is written lets a scan that was stopped go on.");
  auto job = std::make_shared<PhantomJob>();
  job->Declare(*app);
  return { app,
    [job, app]
    {
      job->given = GivenOptions(*app);
      job->Run();
    } };
}
}
