/**
 * @file DiseaseOptions.h
 * @brief The phantom's disease as an option of the command line and as JSON.
 */
#ifndef DynamicCoronary_DiseaseOptions_h
#define DynamicCoronary_DiseaseOptions_h

#include "CoronaryPhantom.h"

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace coronary
{
/// `--disease`: names of presets, or a file.
struct DiseaseOptions
{
  std::vector<std::string> names;

  /// After the options of the image's quality.
  void AddTo(CLI::App& app);

  /**
   * Adds what the names stand for to the settings; numbers that have options of their own and were
   * given stay as they are. A file is a JSON object with any of `presets`, `lesions`, `grafts`,
   * `origin`, `leads`, `body_fat_mm`, `vein_hu`, `noise_hu`: docs/phantom.md.
   * @throws UsageError, std::runtime_error: one sentence that names the file and the entry at fault
   */
  void Apply(PhantomSettings& settings) const;

private:
  const CLI::Option* Vein = nullptr;
  const CLI::Option* Noise = nullptr;
};

/// Whether the arteries differ from healthy ones.
bool IsDiseased(const PhantomSettings& settings);

/// What a phantom suffers from, how much of it there truly is, and its vessels, as JSON; collateral ones with their courses at
/// these phases of the heart.
std::string DescribeDisease(const CoronaryPhantom& phantom, const std::vector<double>& phases);
}

#endif
