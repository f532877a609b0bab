/**
 * @file CalciumObjects.h
 * @brief Calcifications along a tree of vessels as objects: where, how large, how dense.
 *
 * Found by a local threshold over the contrast's own brightness (lumen mean plus standard deviations and plus a share of
 * the mean), so that no fixed value is tied to one tube voltage. On a CT with contrast calcium that is no brighter than
 * the lumen can not be told from it: small or faint deposits stay unseen.
 */
#ifndef DynamicCoronary_CalciumObjects_h
#define DynamicCoronary_CalciumObjects_h

#include "LumenLevels.h"
#include "ParallelFor.h"

#include <unordered_map>
#include <vector>

namespace coronary
{
/// A voxel of an object.
struct CalciumVoxel
{
  std::int64_t offset = 0; ///< in the image, i fastest
  int label = 0;           ///< of its object, from 1
  std::int64_t point = 0;  ///< the nearest of the tree
  float distance = 0.0F;   ///< mm from that point
  float value = 0.0F;
};

struct CalciumObject
{
  int label = 0;                    ///< from 1
  Vector3 centre = Vector3::Zero(); ///< mm, weighted by what it is brighter than the lumen
  std::int64_t point = -1;          ///< of the tree, nearest to the centre
  int segmentId = 0;                ///< of that point
  double abscissaStart = 0.0;       ///< mm from the root, along the vessels that it touches
  double abscissaEnd = 0.0;
  double volume = 0.0;          ///< mm^3, of all voxels above the threshold: too large, it blooms
  double correctedVolume = 0.0; ///< mm^3, without blooming
  double peak = 0.0;            ///< image value
  double density = 0.0; ///< image value without blur; above `peak` in small objects, an estimate
  double arc = 0.0;     ///< degrees around the lumen, at its widest section
  double score = 0.0;   ///< by Agatston's rule, on an image with contrast: see AgatstonWeight
};

struct CalciumMap
{
  std::vector<CalciumVoxel> voxels; ///< by offset
  std::vector<CalciumObject> objects;

  /// Index of a voxel in `voxels`, or -1.
  std::int64_t Find(std::int64_t offset) const;
  std::unordered_map<std::int64_t, std::int64_t> index;
};

/// Agatston's weight of a peak in HU: 0 below 130, then 1, 2, 3, 4 from 130, 200, 300, 400.
int AgatstonWeight(double peak);

/**
 * Connected objects above the local threshold, near the tree. Labels follow the tree from the roots.
 * @throws std::invalid_argument as CheckTree; Cancelled
 */
CalciumMap FindCalcium(const VesselTree& tree, const ScalarImage& image, const LumenLevels& levels,
  const ProgressCallback& progress = {});

/**
 * Fills the measures of all objects, with the lumen that was found beside them.
 *
 * Density and volume without blur are those of a ball with the same peak that shows as much above half of it, over the
 * lumen on one side and the surroundings on the other. What can not be seen beside the lumen does not
 * count. The score takes slices of 3 mm along the patient's z axis and all voxels of the object; with contrast in the
 * vessels it is another measure than Agatston's.
 * @param tree  with the radii and positions of the lumen that is left, and abscissas
 */
void MeasureCalcium(CalciumMap& calcium, const VesselTree& tree,
  const std::vector<VesselPath>& paths, const ScalarImage& image, const LumenLevels& levels,
  double blur);
}

#endif
