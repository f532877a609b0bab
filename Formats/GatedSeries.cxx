#include "GatedSeries.h"

#include "DicomSeries.h"
#include "TextWords.h"
#include "VolumeFile.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace coronary
{
namespace fs = std::filesystem;

namespace
{
constexpr double GridTolerance = 1e-3; // mm

bool IsDescription(const std::string& path)
{
  return LowerCase(fs::path(path).extension().string()) == ".json";
}

std::unique_ptr<VolumeSource> Open(
  const std::string& path, const GatedSeriesOptions& options, const Poll& poll)
{
  if (poll)
  {
    poll();
  }
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
  {
    return OpenDicomSeries(path, options.seriesInstanceUid, poll);
  }
  CheckedFileSize(path);
  if (!IsVolumeFileName(path) && options.openOther)
  {
    if (std::unique_ptr<VolumeSource> source = options.openOther(path))
    {
      return source;
    }
  }
  return OpenVolumeFile(path);
}

std::array<int, 3> Dimensions(const ImageGrid& grid)
{
  return { grid.extent[1] + 1, grid.extent[3] + 1, grid.extent[5] + 1 };
}

std::string Text(const std::array<int, 3>& d)
{
  return std::to_string(d[0]) + "x" + std::to_string(d[1]) + "x" + std::to_string(d[2]);
}

// The largest distance between the corners of two grids of equal dimensions.
double CornerDistance(const ImageGrid& a, const ImageGrid& b)
{
  double maximum = 0.0;
  for (int corner = 0; corner < 8; ++corner)
  {
    const double i = (corner & 1) != 0 ? a.extent[1] : 0;
    const double j = (corner & 2) != 0 ? a.extent[3] : 0;
    const double k = (corner & 4) != 0 ? a.extent[5] : 0;
    maximum = std::max(maximum, (a.IndexToWorld(i, j, k) - b.IndexToWorld(i, j, k)).norm());
  }
  return maximum;
}
}

GatedSeries::GatedSeries(
  const std::vector<std::string>& paths, const GatedSeriesOptions& options, const Poll& poll)
{
  if (paths.empty())
  {
    throw std::runtime_error("No image file is given.");
  }
  if (!std::isfinite(options.cycleSeconds) || !(options.cycleSeconds > 0.0))
  {
    throw std::runtime_error("CycleLength is not a positive number of seconds.");
  }
  if (paths.size() == 1 && IsDescription(paths.front()))
  {
    this->OpenDescription(paths.front(), options, poll);
  }
  else
  {
    this->OpenFiles(paths, options, poll, paths.size() > 1);
  }
  this->CheckSameGrid();
  this->SetFractions(options);
  if (!this->CycleKnown)
  {
    this->Cycle = options.cycleSeconds;
  }
}

void GatedSeries::OpenDescription(
  const std::string& path, const GatedSeriesOptions& options, const Poll& poll)
{
  const SeriesDescription description = ReadSeriesDescription(path);
  std::vector<std::string> images;
  for (const SeriesDescription::Phase& phase : description.phases)
  {
    images.push_back(ResolveSeriesPath(path, phase.image));
  }
  this->OpenFiles(images, options, poll, true);
  for (std::size_t p = 0; p < this->Phases.size(); ++p)
  {
    this->Phases[p].fraction = description.phases[p].fraction;
  }
  this->FractionsKnown = true;
  if (description.cycleMs > 0.0)
  {
    this->Cycle = description.cycleMs / 1000.0;
    this->CycleKnown = true;
  }
  this->SeedPoints = description.seeds;
}

void GatedSeries::OpenFiles(const std::vector<std::string>& paths,
  const GatedSeriesOptions& options, const Poll& poll, bool onePhaseEach)
{
  for (const std::string& path : paths)
  {
    if (onePhaseEach && IsDescription(path))
    {
      throw std::runtime_error("'" + path +
        "': a description of a series stands for all phases; "
        "it cannot be one of several files.");
    }
    this->Sources.push_back(Open(path, options, poll));
    const VolumeInfo& info = this->Sources.back()->Info();
    if (onePhaseEach && info.phases != 1)
    {
      throw std::runtime_error("'" + path + "' holds " + std::to_string(info.phases) +
        " phases; in a list of phases each file holds one.");
    }
    for (int index = 0; index < info.phases; ++index)
    {
      Phase phase;
      phase.source = this->Sources.back().get();
      phase.index = index;
      phase.name = info.phaseNames[static_cast<std::size_t>(index)];
      if (!info.fractions.empty())
      {
        phase.fraction = info.fractions[static_cast<std::size_t>(index)];
      }
      this->Phases.push_back(phase);
    }
    this->AllFitShort = this->AllFitShort && info.fitsShort;
    this->AllWarnings.insert(this->AllWarnings.end(), info.warnings.begin(), info.warnings.end());
  }
  // The files of a list know their own times only if all of them do and they are in order.
  const auto known = [](const auto& source) { return !source->Info().fractions.empty(); };
  this->FractionsKnown = std::all_of(this->Sources.begin(), this->Sources.end(), known);
  for (std::size_t p = 1; p < this->Phases.size(); ++p)
  {
    this->FractionsKnown =
      this->FractionsKnown && this->Phases[p].fraction > this->Phases[p - 1].fraction;
  }
  const double cycle = this->Sources.front()->Info().cycleSeconds;
  if (cycle > 0.0)
  {
    this->Cycle = cycle;
    this->CycleKnown = true;
  }
}

void GatedSeries::CheckSameGrid()
{
  const VolumeInfo& first = this->Sources.front()->Info();
  this->CommonGrid = first.grid;
  for (const std::unique_ptr<VolumeSource>& source : this->Sources)
  {
    const VolumeInfo& info = source->Info();
    if (Dimensions(info.grid) != Dimensions(first.grid))
    {
      throw std::runtime_error("The phases have different sizes: '" + first.path + "' has " +
        Text(Dimensions(first.grid)) + " voxels, '" + info.path + "' has " +
        Text(Dimensions(info.grid)) + ".");
    }
    const double distance = CornerDistance(first.grid, info.grid);
    if (!(distance <= GridTolerance))
    {
      throw std::runtime_error("The phases lie on different grids: the corners of '" + first.path +
        "' and '" + info.path + "' are up to " + std::to_string(distance) + " mm apart.");
    }
  }
}

void GatedSeries::SetFractions(const GatedSeriesOptions& options)
{
  const std::vector<double>& given = options.fractions;
  if (given.empty())
  {
    for (std::size_t p = 0; p < this->Phases.size() && !this->FractionsKnown; ++p)
    {
      this->Phases[p].fraction = static_cast<double>(p) / static_cast<double>(this->Phases.size());
    }
    return;
  }
  if (given.size() != this->Phases.size())
  {
    throw std::runtime_error("PhaseFractions has " + std::to_string(given.size()) +
      " values, but there are " + std::to_string(this->Phases.size()) + " phases.");
  }
  for (std::size_t p = 0; p < given.size(); ++p)
  {
    if (!std::isfinite(given[p]))
    {
      throw std::runtime_error("PhaseFractions[" + std::to_string(p) + "] is not a finite number.");
    }
    if (p > 0 && !(given[p] > given[p - 1]))
    {
      throw std::runtime_error(
        "PhaseFractions[" + std::to_string(p) + "] is not greater than the value before it.");
    }
    this->Phases[p].fraction = given[p];
  }
  this->FractionsKnown = true;
}

int GatedSeries::NearestPhase(double time) const
{
  int nearest = 0;
  for (int p = 1; p < this->NumberOfPhases(); ++p)
  {
    if (std::abs(this->Fraction(p) - time) < std::abs(this->Fraction(nearest) - time))
    {
      nearest = p;
    }
  }
  return nearest;
}

std::string GatedSeries::Summary() const
{
  std::ostringstream text;
  text.imbue(std::locale::classic());
  const VolumeInfo& first = this->Sources.front()->Info();
  const ImageGrid& grid = this->CommonGrid;
  const std::array<int, 3> size = Dimensions(grid);
  text << first.format << ": " << first.path;
  if (this->Sources.size() > 1)
  {
    text << " and " << this->Sources.size() - 1 << " more";
  }
  text << "\nPhases: " << this->NumberOfPhases() << ", at R-R fractions";
  for (const Phase& phase : this->Phases)
  {
    text << ' ' << phase.fraction;
  }
  text << (this->FractionsKnown ? "" : " (not in the files: spread evenly)")
       << "\nCycle length: " << this->Cycle << " s"
       << (this->CycleKnown ? "" : " (not in the files: the property CycleLength)")
       << "\nVoxels: " << Text(size) << " (" << size[2] << " slice positions), spacing "
       << grid.spacing.transpose() << " mm, origin " << grid.origin.transpose() << " mm\nAxes:";
  for (int axis = 0; axis < 3; ++axis)
  {
    text << " (" << grid.direction.col(axis).transpose() << ")";
  }
  text << "\nSeeds: " << this->SeedPoints.size() << "\n";
  for (const std::unique_ptr<VolumeSource>& source : this->Sources)
  {
    for (const std::string& note : source->Info().notes)
    {
      text << note << "\n";
    }
  }
  for (const std::string& warning : this->AllWarnings)
  {
    text << "Warning: " << warning << "\n";
  }
  return text.str();
}
}
