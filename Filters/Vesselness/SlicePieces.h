/**
 * @file SlicePieces.h
 * @brief Connected pieces of what is equally far from the seeds: what a collected vessel is cut by.
 */
#ifndef DynamicCoronary_SlicePieces_h
#define DynamicCoronary_SlicePieces_h

#include <cstdint>
#include <utility>
#include <vector>

namespace coronary
{
struct SlicePiece
{
  int slice = 0; ///< of equal path length, 0 at the seeds
  std::int64_t voxels = 0;
  bool strong = false; ///< has a voxel that is vessel for certain
  float tube = 0.0F;   ///< largest vesselness
  bool dropped = false;
  bool twig = false; ///< dropped for lack of a strong voxel, which is no leakage
};

/**
 * Drops twigs without a single strong piece, from their tips on; pieces of slice 0 and dropped ones stay as they are.
 * @param contacts  pairs of pieces that touch, in any order and as often as they do
 */
void DropTwigs(
  std::vector<SlicePiece>& pieces, std::vector<std::pair<std::int32_t, std::int32_t>> contacts);
}

#endif
