/**
 * @file VesselSegmentation.h
 * @brief The coronary lumen as voxels: what hangs on the ostia, cut off from aorta and chambers.
 *
 * 1. Large bodies of blood (aorta, chambers, great vessels) are what a ball of MaximumRadius
 *    covers; they are taken out.
 * 2. Hysteresis: from the seeds on, connected voxels that look like vessel (bright as blood, or
 *    less bright but tubular) are collected, together with their path length from the seed.
 * 3. Leakage: the collected voxels are cut into slices of equal path length. Where a slice is
 *    larger than any coronary artery, it and what hangs on it only through it are dropped.
 * 4. The wall is put where the image is half way between the local lumen and the local
 *    surroundings (full width at half maximum), in a narrow band around the collected voxels.
 * docs/segmentation.md has the reasons and the limits.
 */
#ifndef DynamicCoronary_VesselSegmentation_h
#define DynamicCoronary_VesselSegmentation_h

#include "ParallelFor.h"
#include "ScalarImage.h"
#include "VesselLinking.h"

#include <optional>
#include <string>
#include <vector>

namespace coronary
{
/// Where a tree begins.
struct VesselSeed
{
  Vector3 position;               ///< mm
  Vector3 axis = Vector3::Zero(); ///< points into the vessel; zero: not known
};

/// Image values that tell blood from tissue.
struct BloodWindow
{
  double tissue = 0.0; ///< what surrounds the vessels: muscle
  double blood = 0.0;  ///< undiluted contrast medium in a large vessel
};

struct VesselSegmentationSettings
{
  std::optional<BloodWindow> window; ///< not given: measured around the seeds
  double strong = 0.8;           ///< likelihood of vessel that a connected piece must reach, 0 to 1
  double weak = 0.5;             ///< likelihood down to which it goes on, 0 to strong
  std::optional<double> tubular; ///< vesselness of a clear tube; not given: measured at the seeds
  double maximumRadius = 4.5;    ///< mm: what is thicker is aorta or chamber, 1 to 50
  double longestPath = 400.0;    ///< mm along the vessels from the seed, > 0
  double minimumIslandVolume = 2.0;   ///< mm^3: smaller pieces are dropped, >= 0
  bool fillHoles = true;              ///< fill what is enclosed by vessel
  bool refineWall = true;             ///< step 4; else the collected voxels are the result
  bool crossLesions = true;           ///< link pieces behind lesions to what hangs on the seeds
  double longestGap = 25.0;           ///< mm that such a link may have, 0 to 40
  double minimumLinkConfidence = 0.5; ///< that a link must have, 0 to 1

  /// @throws std::invalid_argument that names the first setting that is out of range
  void Validate() const;
};

struct VesselSegmentationResult
{
  std::vector<unsigned char> mask; ///< 1 vessel, 0 else; one value a voxel of the image
  std::vector<float> probability;  ///< 0 to 1, at least 0.5 where the mask is 1, and less where
                                   ///< it is 0; empty unless asked for
  BloodWindow window;              ///< the one that was used
  double tubular = 0.0;            ///< the same
  std::vector<double> seedVolume;  ///< mm^3 that hang on each seed; 0: the seed reached nothing
  /// How much brighter than its surroundings the brightest place within 2.5 mm of each seed is, over the noise; infinite
  /// without noise. In tissue without contrast medium it is about 3.
  std::vector<double> seedContrast;
  double leakageVolume = 0.0;             ///< mm^3 that step 3 dropped
  std::vector<VesselLink> links;          ///< ways across lesions that are part of the mask
  std::vector<ConsideredLink> considered; ///< links that came to mind, made or not, round by round
};

/**
 * @param image       intensities; HU unless a window is given
 * @param vesselness  not negative, on the voxels of the image
 * @param seeds       at least one, inside the image; on the wall of the aorta or in the vessel
 * @param probability whether to fill result.probability
 * @throws Cancelled, and std::invalid_argument that names the seed or setting at fault
 */
VesselSegmentationResult SegmentVessels(const ScalarImage& image, const float* vesselness,
  const std::vector<VesselSeed>& seeds, const VesselSegmentationSettings& settings = {},
  bool probability = false, const ProgressCallback& progress = {});
}

#endif
