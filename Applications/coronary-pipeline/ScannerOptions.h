/**
 * @file ScannerOptions.h
 * @brief A simulated CT scanner as options of the command line and as JSON.
 */
#ifndef DynamicCoronary_ScannerOptions_h
#define DynamicCoronary_ScannerOptions_h

#include "CtScanner.h"

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace coronary
{
/// `--scanner` and what belongs to it.
struct ScannerOptions
{
  std::string scanner;              ///< preset or file; empty: no scanner
  std::vector<std::string> kernels; ///< empty: as the preset or the file says
  std::vector<double> imageNoise;   ///< HU; empty: as the preset or the file says

  void AddTo(CLI::App& app);

  bool Given() const { return !this->scanner.empty(); }

  /**
   * A preset, or a JSON object with `preset`, `kernel` and any of AllScannerNumbers().
   * @param seed  of noise, beats and shifts
   * @throws UsageError, std::runtime_error: one sentence that names the file and the entry at fault
   */
  ScannerSettings Settings(std::uint64_t seed) const;

  /// All pairs of kernels and noise levels that were asked for.
  std::vector<ScanVariant> Variants(const ScannerSettings& settings) const;
};

/// Folder of a variant's images among several: soft, soft-20.
std::string VariantName(const ScanVariant& variant);

/// What was scanned when and with how much, as JSON.
std::string DescribeScan(const ScannerSettings& settings, const CtScanner& scanner,
  const std::vector<double>& phases, const std::vector<ScanVariant>& variants);

/// The settings alone.
std::string DescribeScanner(const ScannerSettings& settings);
}

#endif
