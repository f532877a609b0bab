/**
 * @file MeasuredContours.h
 * @brief Cross-sections of vessels as an image shows them.
 */
#ifndef DynamicCoronary_MeasuredContours_h
#define DynamicCoronary_MeasuredContours_h

#include "LumenMeasurement.h"
#include "ParallelFor.h"
#include "SweepSurface.h"

namespace coronary
{
struct ContourSettings
{
  int samples = 24;      ///< rays around, 12 to 360
  int harmonics = 3;     ///< of the contour over the angle, 1 to 4: what is finer is noise
  double reach = 1.6;    ///< no wall farther out than this many radii, 1.1 to 3
  double contrast = 0.3; ///< least fall of a ray in falls of the section's strongest, 0.1 to 0.9

  /// @throws std::invalid_argument that names the first setting out of range or not finite.
  void Validate() const;
};

/**
 * Sets the contours of a tree from an image in which vessels are brighter than what is around them.
 *
 * At each point rays go out in the plane across the axis to where the image has fallen half way
 * from the lumen to its least value behind the wall. Few harmonics are fitted to the rays that found
 * a wall, and the contours are averaged along the branch over a radius to either side. The shape
 * is the image's, the size the tree's: the mean of each contour over the angle is the given
 * radius, which knows of the image's blur. Within two radii of a node, where the rays run into the
 * other vessels, and where too few of them find a wall, the contour is round.
 *
 * @param tree  points, radius and branches are read, contours, contourSamples and contourNormals set
 * @return share of the points whose contour was measured, 0 to 1
 * @throws std::invalid_argument for settings, or a branch that names a point that is not there
 *         Cancelled
 */
double MeasureContours(const ImageInterpolator& image, const ContourSettings& settings,
  VesselTree& tree, const ProgressCallback& progress = {});
}

#endif
