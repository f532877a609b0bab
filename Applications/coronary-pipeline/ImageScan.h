/**
 * @file ImageScan.h
 * @brief From an anatomy in a scanner to the files of its images: what `phantom` and `scan` have in common.
 */
#ifndef DynamicCoronary_ImageScan_h
#define DynamicCoronary_ImageScan_h

#include "CtScanner.h"
#include "ScanFolder.h"
#include "SeriesDescription.h"

#include <CLI/CLI.hpp>

#include <memory>
#include <string>
#include <vector>

namespace coronary
{
class StagedFolder;

/// What a gated series is called by its folder.
constexpr const char* SeriesName = "series.json";

/// All options that decide what the images are, as text, with the contents of files that they name.
std::string GivenOptions(const CLI::App& app);

/// A phase as it is shown: 40.0 % R-R.
std::string PhaseText(double fraction);

/// The scan of several phases, and its images of several kernels and noise levels.
class ImageScan
{
public:
  /**
   * Computes nothing yet: what can not be is told at once.
   * @param anatomy  has to live as long
   * @throws std::invalid_argument as CtScanner
   */
  ImageScan(const ScannedAnatomy& anatomy, const ScannerSettings& settings, const ImageGrid& grid,
    const std::vector<double>& phases, const std::vector<ScanVariant>& variants);

  /**
   * Takes all views. Finished parts are in the folder output/scan-parts: those of a scan that was stopped are taken
   * over, and told about.
   * @param given  all that decides how the images look, but the scanner's settings
   * @throws Cancelled, std::runtime_error naming the folder
   */
  void Scan(const std::string& output, const std::string& given, bool quiet,
    const ProgressCallback& progress);

  /**
   * Adds the images of a phase, by its index: of several variants each in its own folder.
   * @throws Cancelled, std::runtime_error naming the file
   */
  void WriteImages(StagedFolder& folder, std::size_t phase, const std::string& name, bool compress,
    const ProgressCallback& progress) const;

  /// Adds scan.json and, last, series.json: of several variants each has one in its folder, the truth is common.
  void WriteDescriptions(StagedFolder& folder, const SeriesDescription& series) const;

  /// The files are in place: the parts that they were made of are not needed any more.
  void Done();

private:
  const ScannerSettings Settings;
  const ImageGrid Grid;
  const std::vector<double> Phases;
  const std::vector<ScanVariant> Variants;
  CtScanner Scanner;
  std::unique_ptr<ScanFolder> Parts;
};
}

#endif
