#include "Command.h"

#include "OptionChecks.h"
#include "vtkMessageTrap.h"

#include "vtkDataArray.h"
#include "vtkGatedImageReader.h"
#include "vtkImageData.h"
#include "vtkPointData.h"

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace coronary
{
namespace
{
struct InspectJob
{
  std::vector<std::string> paths;
  std::vector<double> fractions;
  double cycleMs = 1000.0;
  std::string series;
  bool all = false;

  void Declare(CLI::App& app);
  void Run() const;
};

void InspectJob::Declare(CLI::App& app)
{
  app
    .add_option("PATH", this->paths,
      "A folder of DICOM files, a series.json, a 4-D volume, or one volume a phase")
    ->type_name("")
    ->required();
  app.add_flag("--all", this->all, "Read every phase, not only the first");
  app
    .add_option("--fractions", this->fractions,
      "R-R fractions of the phases, instead of those in the files: 0,0.35,0.75")
    ->check(Within(-100.0, 100.0))
    ->delimiter(',')
    ->allow_extra_args(false)
    ->type_name("LIST");
  app.add_option("--cycle-ms", this->cycleMs, "R-R interval, in ms, for files that do not give it")
    ->check(Within(1.0, 60000.0))
    ->type_name("MS")
    ->capture_default_str();
  app.add_option("--series", this->series, "The DICOM series to read from a folder with several")
    ->type_name("UID");
}

void InspectJob::Run() const
{
  vtkMessageTrap messages;
  vtkNew<vtkGatedImageReader> reader;
  for (const std::string& path : this->paths)
  {
    reader->AddFileName(path.c_str());
  }
  for (std::size_t i = 0; i < this->fractions.size(); ++i)
  {
    reader->SetPhaseFraction(static_cast<int>(i), this->fractions[i]);
  }
  reader->SetCycleLength(this->cycleMs / 1000.0);
  if (!this->series.empty())
  {
    reader->SetSeriesInstanceUID(this->series.c_str());
  }

  reader->UpdateInformation();
  messages.ThrowIfError();
  std::fputs(reader->GetSummary().c_str(), stdout);
  messages.ForgetWarnings(); // they are in the summary
  const int count = this->all ? reader->GetNumberOfPhases() : 1;
  for (int phase = 0; phase < count; ++phase)
  {
    const double time = reader->GetPhaseTime(phase);
    UpdateAtTime(reader, 0, time, messages, [](double) {});
    vtkDataArray* values = reader->GetOutput()->GetPointData()->GetScalars();
    if (!values)
    {
      throw std::runtime_error("'" + reader->GetPhaseFileName(phase) + "': no voxels were read");
    }
    const double* range = values->GetRange();
    std::printf("Phase %d (%.1f %% R-R): %s to %s HU, %s, %s\n", phase + 1, 100.0 * time,
      Format(range[0]).c_str(), Format(range[1]).c_str(), values->GetDataTypeAsString(),
      reader->GetPhaseFileName(phase).c_str());
  }
  messages.PrintWarnings();
}
}

Command MakeInspectCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand(
    "inspect", "Say what a gated image series holds: phases, times, voxels, HU range, warnings");
  auto job = std::make_shared<InspectJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); } };
}
}
