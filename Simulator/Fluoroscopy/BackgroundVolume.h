/**
 * @file BackgroundVolume.h
 * @brief A patient's own CT as the background of X-ray images.
 */
#ifndef DynamicCoronary_BackgroundVolume_h
#define DynamicCoronary_BackgroundVolume_h

#include "ThoraxPhantom.h"

#include <string>

namespace coronary
{
/// How a CT lies to the vessels: its world coordinates plus `offset` are theirs.
struct BackgroundPlacement
{
  Vector3 offset{ Vector3::Zero() }; ///< mm
};

/// Voxels that a background may have: 512 x 512 x 2048.
constexpr std::int64_t MostBackgroundVoxels = std::int64_t(1) << 29;

/**
 * Reads a CT: a .mha, .mhd, .nrrd, .nhdr, .nii or .nii.gz file, or a folder of DICOM files.
 *
 * Values are rounded and limited to -1024 to 3071 HU.
 * @throws std::runtime_error with one sentence naming the file: whatever the formats say (not there, damaged, ...);
 *   more than one phase; a DICOM modality that is not CT; fewer than 16 voxels along an axis, less than 50 mm or more than MostBackgroundVoxels;
 *   values that are no Hounsfield units (nothing like air, or nothing like soft tissue)
 * @throws std::invalid_argument for an offset that is not finite or beyond 1e5 mm; Cancelled
 */
HounsfieldVolume ReadBackgroundVolume(const std::string& path,
  const BackgroundPlacement& placement = {}, const ProgressCallback& progress = {});
}

#endif
