/**
 * @file MaskResampling.h
 * @brief A mask on the voxels of another image.
 */
#ifndef DynamicCoronary_MaskResampling_h
#define DynamicCoronary_MaskResampling_h

#include "Geometry.h"

#include <cstdint>
#include <vector>

namespace coronary
{
struct ResampledMask
{
  std::vector<unsigned char> voxels; ///< 0 or 1, one a voxel of the image, i fastest
  std::int64_t count = 0;            ///< of those that are 1
  bool sameVoxels = false; ///< the grids' voxels coincide to a thousandth: nothing was interpolated
  double insideShare = 1.0; ///< of the mask's voxels that lie in the image
};

/**
 * A mask at the voxels of an image: where both have the same voxels, up to a shift by whole ones, the same values;
 * elsewhere 1 where its trilinear interpolation is at least one half. Outside of its grid the mask is 0.
 *
 * @param grid    of the mask
 * @param voxels  0 or not, one a voxel of `grid`, i fastest
 * @param image   the wanted voxels
 * @throws std::invalid_argument when the mask has another number of voxels than its grid; the grids do not overlap,
 *   with the boxes of both in mm; or no part of the mask is in the image
 */
ResampledMask ResampleMask(
  const ImageGrid& grid, const std::vector<unsigned char>& voxels, const ImageGrid& image);
}

#endif
