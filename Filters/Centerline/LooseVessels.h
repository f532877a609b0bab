/**
 * @file LooseVessels.h
 * @brief Tubes that an image shows on the heart, and that no tree of centerlines holds.
 *
 * What is missing from a tree can mostly still be seen: behind a lesion that was not crossed, beside a mouth that was
 * not found. Nothing about the tree alone tells that a whole side branch is gone. Veins are tubes too: they are known by
 * their brightness and by their way beside arteries. docs/topology.md#checks.
 */
#ifndef DynamicCoronary_LooseVessels_h
#define DynamicCoronary_LooseVessels_h

#include "ScalarImage.h"
#include "SegmentLabeling.h"
#include "TreeCheck.h"
#include "VesselTree.h"

#include <string>
#include <vector>

namespace coronary
{
struct LooseVessel
{
  std::vector<Vector3> points; ///< mm, along its axis
  double length = 0.0;         ///< mm
  double radius = 0.0;         ///< mm, median half-maximum radius of its sections
  double thinEnd = 0.0;        ///< mm, the same of its thinner end
  double seen = 0.0;           ///< share of its sections with a lumen all around
  double brightness = 0.0;     ///< contrast of its lumen over that of arteries of its calibre
  double besideItsOwn =
    0.0; ///< share of its length along with that artery of the tree which usually runs there
  double besideOther = 0.0; ///< the same with another artery
  double away = 0.0;        ///< mm of the mean heart from its courses of arteries, mean
  bool goesOn = false;      ///< it begins ahead of a tip of the tree, and runs in its direction
  double confidence = 0.0;  ///< 0 to 1, that it is an artery
  double alone = 0.0;       ///< the same, were it the only one
  std::string
    nearest; ///< artery of the mean heart whose course is nearest: "D2", "LAD", "RCA", ...
};

struct LooseVesselInput
{
  ScalarImage image;                 ///< that the tree was found in
  const float* vesselness = nullptr; ///< one value a voxel
  const VesselTree& tree;            ///< named, mm
  HeartPose heart;                   ///< by its names
  double tissue = 0.0;               ///< image value of muscle
  double blood = 0.0;                ///< of undiluted contrast medium
};

/**
 * All of 8 mm and more, longest first, also veins and what is none.
 *
 * What counts as a tube, and how bright an artery is, is taken from the tree's own vessels. Without any that is seen there
 * is no measure, and nothing is found.
 * @throws std::invalid_argument for an image without contrast (blood not above tissue) or without vesselness
 */
std::vector<LooseVessel> FindLooseVessels(const LooseVesselInput& input);

/**
 * Takes confidences for what they can be together: a tree lacks a few arteries, not dozens. Where they sum up to more than ten,
 * the odds of all are divided by the factor with which they sum up to ten: most of them are of noise.
 */
void ExpectFewMissing(std::vector<LooseVessel>& vessels);

/// A warning for each one that is rather an artery than not (a confidence of a half or more); one more, with their number, for all
/// that would be if they were not too many.
std::vector<TreeWarning> LooseVesselWarnings(const std::vector<LooseVessel>& vessels);
}

#endif
