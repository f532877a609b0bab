/**
 * @file HiddenMouths.h
 * @brief Mouths of vessels on the aortic wall that are not seen: pieces of tube near it that point at it.
 */
#ifndef DynamicCoronary_HiddenMouths_h
#define DynamicCoronary_HiddenMouths_h

#include "WorldVolume.h"

#include <vector>

namespace coronary
{
/// Values of the voxels of a volume, i fastest.
struct MouthImage
{
  const WorldVolume& volume;
  const std::vector<unsigned char>& body; ///< 0 none, 1 large body, 2 the aorta
  const std::vector<float>& likeness;     ///< 0 to 1: vessel
  const std::vector<float>& tubeness;     ///< vesselness
  const std::vector<float>& reached;      ///< negative: no vessel leads from the aorta to here
  float clearTube = 0.3F;                 ///< vesselness of a clear tube
  float lung = -500.0F;                   ///< HU that no tissue of the heart is below
  double maximumVesselRadius = 4.5;       ///< radius, mm
};

/// Where a piece of vessel would begin on the aorta, were the way to it visible.
struct HiddenMouth
{
  std::vector<std::int64_t> way;   ///< voxels from the aorta's first one to the piece's end
  std::vector<std::int64_t> along; ///< voxels from there to the piece's other end
  double volume = 0.0;             ///< mm^3 of the piece
  double hidden = 0.0;             ///< mm of the way that look like no vessel
  double unseen = 0.0;             ///< mm of these that show no tube of any brightness
  double turn = 0.0;   ///< radians between the piece's direction at its end and the way's chord
  double length = 0.0; ///< mm from the aorta to the other end
  double radius = 0.0; ///< mm, of the piece near the aorta
};

/// @param longest  mm between a piece and the aorta that look like no vessel
/// @param shortest  mm that a piece is long
std::vector<HiddenMouth> FindHiddenMouths(const MouthImage& image, double longest, double shortest);
}

#endif
