/**
 * @file MaskTrees.h
 * @brief Where coronary trees begin in a mask without an image, of a network or of 3D Slicer.
 *
 * Such masks often hold the aorta too. It is what a ball fits into that fits into no coronary artery;
 * trees are pieces of the rest, and begin where they touch it. Without an aorta every large piece
 * is a tree, whose widest end is for who follows it to find.
 */
#ifndef DynamicCoronary_MaskTrees_h
#define DynamicCoronary_MaskTrees_h

#include "Geometry.h"
#include "ParallelFor.h"

#include <string>
#include <vector>

namespace coronary
{
struct MaskTree
{
  Vector3 seed;        ///< mm: its ostium, or without an aorta a point where it is widest
  double volume = 0.0; ///< mm^3
};

struct MaskTrees
{
  std::vector<unsigned char> vessels; ///< 0 or 1, on the mask's voxels, without the aorta
  bool hasAorta = false;
  double aortaVolume = 0.0;    ///< mm^3
  std::vector<MaskTree> trees; ///< the largest first
  double size = 0.0;           ///< diagonal of the box around the trees, mm
  /// What was left out, what is doubtful: whole sentences without their full stop.
  std::vector<std::string> remarks;
};

/**
 * @param mask           0 or not, one a voxel of `grid`, i fastest
 * @param maximumRadius  of coronary arteries, mm: what is thicker is aorta
 * @throws std::invalid_argument when the mask has another number of voxels than its grid, or no tree; Cancelled
 */
MaskTrees FindMaskTrees(const ImageGrid& grid, const std::vector<unsigned char>& mask,
  double maximumRadius, const ProgressCallback& progress = {});
}

#endif
