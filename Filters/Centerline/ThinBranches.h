/**
 * @file ThinBranches.h
 * @brief Branches of about one voxel's radius that leave a known tree: too thin for a mask, found on
 * the image by what their whole path shows.
 *
 * Bright spots on the surface that lies beside the tree's lumen are where branches may begin. From each a tube is
 * followed outwards. It is a branch when along its path the core is brighter than what surrounds it on every side, by many
 * times what the image's noise could do: noise has no such path, the border of a chamber is as
 * bright on one side, a plate on two.
 */
#ifndef DynamicCoronary_ThinBranches_h
#define DynamicCoronary_ThinBranches_h

#include "Geometry.h"
#include "LumenMeasurement.h"
#include "VesselTree.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// What paths show that turn to what is brightest in noise alone: an image value over their surroundings.
struct NoisePaths
{
  double contrast = 0.0; ///< in the middle of many
  double spread = 0.0;   ///< their standard deviation, for paths of 24 voxels
};

struct ThinBranchSettings
{
  double voxel = 0.4;          ///< edge of a voxel (of its cube), mm, > 0
  double minimumLength = 6.0;  ///< mm outside of the parent's lumen, > 0
  double maximumLength = 80.0; ///< mm
  double contrast = 500.0;     ///< image value of a great vessel's lumen over its surroundings, > 0
  NoisePaths noise;            ///< of the image: LearnNoisePaths

  /// @throws std::invalid_argument that names the first setting out of range
  void Validate() const;
};

struct ThinBranch
{
  std::vector<Vector3> points; ///< mm; from the parent's axis to the tip, at equal distances
  std::int32_t parent = -1;    ///< point of the tree where the first one is
  double contrast = 0.0;       ///< mean of the least contrast to any side, image values
  double significance = 0.0;   ///< it, in standard errors
  double length = 0.0;         ///< mm outside of the parent's lumen
};

/// Standard deviation of the image's noise around the vessels, by second differences along them;
/// robust to edges. 0 if the tree has no room around it.
double MeasureNoise(const ImageInterpolator& image, const VesselTree& tree, double voxel);

/**
 * By the paths of dark vessels beside the tree, of which there are none; so that noise counts as it is, however a kernel
 * has correlated it. Zeros if the tree has no room around it. The same on any number of threads.
 * @throws std::invalid_argument that names the setting out of range
 */
NoisePaths LearnNoisePaths(
  const ImageInterpolator& image, const VesselTree& tree, const ThinBranchSettings& settings);

/**
 * @param tree  points, radii (mm) and branches; not changed
 * @param from  points of the tree before this one are not looked beside
 * @returns the branches, most significant first; several may follow the same vessel. The same on any number of threads.
 * @throws std::invalid_argument that names the setting out of range
 */
std::vector<ThinBranch> FindThinBranches(const ImageInterpolator& image, const VesselTree& tree,
  const ThinBranchSettings& settings, std::int64_t from = 0);

/// How a branch goes on beyond its tip.
struct TipPath
{
  std::size_t known = 0; ///< points of the branch that it goes on from; the others are replaced
  std::vector<Vector3> points; ///< mm, 0.75 voxels a step; empty: nothing goes on
};

/**
 * What goes on beyond the tips of a tree: a vessel is to be seen there for longer than it stands out
 * enough for a mask. The last two voxels before a tip are followed anew: they may lead into a corner of a mask.
 * @param tree  every branch ends in a tip
 * @returns one path a branch; empty also where it leads into another vessel. `minimumLength` does not
 *          apply, and half of the significance is enough. The same on any number of threads.
 * @throws std::invalid_argument that names the setting out of range
 */
std::vector<TipPath> FollowTips(
  const ImageInterpolator& image, const VesselTree& tree, const ThinBranchSettings& settings);
}

#endif
