/**
 * @file PhantomOptions.h
 * @brief The phantom's settings as options of the command line.
 */
#ifndef DynamicCoronary_PhantomOptions_h
#define DynamicCoronary_PhantomOptions_h

#include "CoronaryPhantom.h"

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace coronary
{
/// Adds the options of anatomy and motion.
void AddHeartOptions(CLI::App& app, PhantomSettings& settings);

/// Adds the options of the image's quality.
void AddImagingOptions(CLI::App& app, PhantomSettings& settings);

/// Adds the options of the truth's sampling.
void AddTruthOptions(CLI::App& app, PhantomSettings& settings);

/**
 * Which phases are made, and which of them are lost.
 */
struct PhaseOptions
{
  int count = 20;
  std::vector<double> fractions; ///< used instead of count when given
  std::vector<std::string> lost; ///< PHASE or PHASE:FRACTION

  void AddTo(CLI::App& app);

  /// Adds `--lost`.
  void AddLostTo(CLI::App& app);

  /// The phases, strictly increasing.
  /// @throws UsageError
  std::vector<double> Phases() const;

  /// The lost ones.
  /// @throws UsageError
  std::vector<LostPhase> LostPhases(const std::vector<double>& phases) const;
};

/// Voxels of the images.
struct GridOptions
{
  static constexpr const char* Group = "Image grid";

  std::vector<double> spacing = { 0.5 }; ///< mm; three after Check()
  std::vector<double> origin;            ///< mm; with dimensions, or both empty
  std::vector<int> dimensions;

  /// @param automatic  what the image holds without an origin
  void AddTo(CLI::App& app, const std::string& automatic);

  /// @throws UsageError
  void Check();

  bool Given() const { return !this->origin.empty(); }
};
}

#endif
