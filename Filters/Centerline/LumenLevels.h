/**
 * @file LumenLevels.h
 * @brief How bright contrast is along a tree, where vessels are wide enough to show it.
 */
#ifndef DynamicCoronary_LumenLevels_h
#define DynamicCoronary_LumenLevels_h

#include "ScalarImage.h"
#include "VesselPaths.h"

#include <vector>

namespace coronary
{
struct LumenLevels
{
  std::vector<double> level; ///< one value a point of the tree: image value of a wide lumen there
  double noise = 0.0;        ///< standard deviation of single voxels in wide lumens
  double background = 0.0;   ///< what is darkest around vessels, but for air
  double usual = 0.0;        ///< level of most of the wide places
};

/**
 * The image's value of contrast along all vessels, without what blur takes from thin ones, calcium adds to it and
 * narrowings hide: a robust smooth curve through the wide places; beyond the last of them, and in vessels that are
 * thin from their origin on, the value of the nearest wide place upstream.
 * @param blur  standard deviation of the image's blur, mm, positive
 * @throws std::invalid_argument as CheckTree, or for a blur that is not positive
 */
LumenLevels MeasureLumenLevels(const VesselTree& tree, const std::vector<VesselPath>& paths,
  const ScalarImage& image, double blur);
}

#endif
