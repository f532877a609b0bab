/**
 * @file GatedSeries.h
 * @brief A gated image series, from any of the forms it is stored in: one grid, many phases.
 */
#ifndef DynamicCoronary_GatedSeries_h
#define DynamicCoronary_GatedSeries_h

#include "SeriesDescription.h"
#include "VolumeSource.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// What the user may say about a series beyond its files.
struct GatedSeriesOptions
{
  /// R-R fractions, one a phase, strictly increasing; they replace those of the files. Empty: the
  /// files', or evenly over [0, 1).
  std::vector<double> fractions;

  double cycleSeconds = 1.0;     ///< R-R interval for files that do not give it; positive
  std::string seriesInstanceUid; ///< the DICOM series to use; empty: all in the folder

  /// Opens file formats that this library does not know; returns null for those it does not know
  /// either.
  std::function<std::unique_ptr<VolumeSource>(const std::string& path)> openOther;
};

class GatedSeries
{
public:
  /**
   * Opens a series from headers only.
   *
   * @param paths  one of: a folder of DICOM files; a JSON description; one 4-D volume file; one or
   *               more 3-D volume files (or folders of a single phase each), one a phase, in order
   * @param poll   called between files; may throw Cancelled
   * @throws std::runtime_error with one sentence naming the file or option at fault: whatever the
   *   formats say; no files; phases of different size or geometry (beyond 1e-3 mm); fractions that
   *   are not finite, not increasing, or not as many as phases; a cycle length that is not positive
   */
  explicit GatedSeries(const std::vector<std::string>& paths,
    const GatedSeriesOptions& options = {}, const Poll& poll = {});

  int NumberOfPhases() const { return static_cast<int>(this->Phases.size()); }

  /// R-R fraction of a phase; strictly increasing.
  double Fraction(int phase) const { return this->At(phase).fraction; }

  /// The file (and index in it) that a phase comes from.
  const std::string& Name(int phase) const { return this->At(phase).name; }

  /// The phase whose fraction is nearest to `time`; the earlier one of two at the same distance.
  int NearestPhase(double time) const;

  /// Of all phases; the extent begins at 0.
  const ImageGrid& Grid() const { return this->CommonGrid; }

  /// True when short is the natural type of all phases; see VolumeInfo::fitsShort.
  bool FitsShort() const { return this->AllFitShort; }

  double CycleSeconds() const { return this->Cycle; }

  /// The cycle length is from the files, not from the options.
  bool CycleIsKnown() const { return this->CycleKnown; }

  const std::vector<SeriesDescription::Seed>& Seeds() const { return this->SeedPoints; }
  const std::vector<std::string>& Warnings() const { return this->AllWarnings; }

  /// What was found, for people: format, phases, positions, spacing, times, notes, warnings.
  std::string Summary() const;

  /// Where a phase comes from, to read it: see VolumeSource::Read().
  VolumeSource& Source(int phase) const { return *this->At(phase).source; }

  /// The index of a phase within Source().
  int IndexInSource(int phase) const { return this->At(phase).index; }

private:
  struct Phase
  {
    VolumeSource* source = nullptr;
    int index = 0;
    double fraction = 0.0;
    std::string name;
  };

  const Phase& At(int phase) const { return this->Phases.at(static_cast<std::size_t>(phase)); }
  void OpenDescription(
    const std::string& path, const GatedSeriesOptions& options, const Poll& poll);
  void OpenFiles(const std::vector<std::string>& paths, const GatedSeriesOptions& options,
    const Poll& poll, bool onePhaseEach);
  void CheckSameGrid();
  void SetFractions(const GatedSeriesOptions& options);

  std::vector<std::unique_ptr<VolumeSource>> Sources;
  std::vector<Phase> Phases;
  bool FractionsKnown = false;
  ImageGrid CommonGrid;
  bool AllFitShort = true;
  double Cycle = 1.0;
  bool CycleKnown = false;
  std::vector<SeriesDescription::Seed> SeedPoints;
  std::vector<std::string> AllWarnings;
};
}

#endif
