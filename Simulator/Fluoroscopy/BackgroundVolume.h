/**
 * @file BackgroundVolume.h
 * @brief A patient's own CT as the background of X-ray images.
 */
#ifndef DynamicCoronary_BackgroundVolume_h
#define DynamicCoronary_BackgroundVolume_h

#include "ThoraxPhantom.h"

#include <optional>
#include <string>

namespace coronary
{
struct BackgroundOptions
{
  Vector3 offset{ Vector3::Zero() }; ///< mm: the CT's coordinates and this are the vessels'
  std::optional<double> time;        ///< R-R fraction: of several phases the nearest one is read
};

/// Voxels that a background may have: 512 x 512 x 2048.
constexpr std::int64_t MostBackgroundVoxels = std::int64_t(1) << 29;

/**
 * Reads a CT: a .mha, .mhd, .nrrd, .nhdr, .nii or .nii.gz file, or a folder of DICOM files; with a time also a series.json.
 *
 * Values are rounded and limited to -1024 to 3071 HU.
 * @throws std::runtime_error with one sentence naming the file: whatever the formats say (not there, damaged, ...);
 *   more than one phase and no time; a DICOM modality that is not CT; fewer than 16 voxels along an axis, less than 50 mm or more than MostBackgroundVoxels;
 *   values that are no Hounsfield units (nothing like air, or nothing like soft tissue)
 * @throws std::invalid_argument for an offset that is not finite or beyond 1e5 mm; Cancelled
 */
HounsfieldVolume ReadBackgroundVolume(const std::string& path,
  const BackgroundOptions& options = {}, const ProgressCallback& progress = {});
}

#endif
