/**
 * @file LumenRefinement.h
 * @brief Centre and radius of the lumen that is left, beside calcium and in narrowings.
 *
 * Half-maximum widths can not get smaller than the blur, and the calcium's edge is not the lumen's. So in each section
 * a blurred disc is fitted whose brightness is known from the wide parts of the vessel (LumenLevels): a lumen that is
 * smaller than the blur is measured by how much of that brightness is left, a larger one by its width, and one method
 * goes over into the other. What calcium and its blooming cover does not count.
 */
#ifndef DynamicCoronary_LumenRefinement_h
#define DynamicCoronary_LumenRefinement_h

#include "CalciumObjects.h"

namespace coronary
{
/// One value a point of the tree.
struct RefinedLumen
{
  std::vector<Vector3> points; ///< mm; as given except beside calcium
  std::vector<double>
    radius; ///< mm, the measured ones lightly smoothed, across what was not measured interpolated
  std::vector<double> measured;   ///< mm, in the point's own section; 0: not measured
  std::vector<double> deviation;  ///< mm, standard deviation of `measured`; 0 where there is none
  std::vector<double> calciumArc; ///< degrees of the wall that calcium hides
  std::vector<unsigned char>
    interpolated;           ///< 1: the lumen can not be seen, the radius is its neighbours'
  std::vector<int> calcium; ///< label of the object beside the point, 0: none
};

/**
 * Measures all sections of a tree anew.
 *
 * Sections in the mouth of a branch, within its parent's lumen, are not measured: they are as wide as where it stands
 * alone. Where the tree is marked as bridged the radius does not get smaller than 0.25 mm, so that a vessel stays.
 * @param blur  standard deviation of the image's blur, mm, positive
 * @throws std::invalid_argument as CheckTree, or for the blur; Cancelled
 */
RefinedLumen RefineLumen(const VesselTree& tree, const std::vector<VesselPath>& paths,
  const ScalarImage& image, const LumenLevels& levels, const CalciumMap& calcium, double blur,
  const ProgressCallback& progress = {});

/// All that is measured of the lumen along a tree.
struct TreeLumen
{
  LumenLevels levels;
  CalciumMap calcium;
  RefinedLumen lumen;
};

/**
 * Levels, calcium and the lumen beside it, one after the other.
 * @param paths  of the tree
 * @param blur   standard deviation of the image's blur, mm, positive
 * @throws std::invalid_argument as CheckTree; Cancelled
 */
TreeLumen MeasureTreeLumen(const VesselTree& tree, const std::vector<VesselPath>& paths,
  const ScalarImage& image, double blur, const ProgressCallback& progress = {});

/// A tree with the lumen that was measured of it.
VesselTree WithLumen(VesselTree tree, const RefinedLumen& lumen);
}

#endif
