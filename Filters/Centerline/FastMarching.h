/**
 * @file FastMarching.h
 * @brief Second-order fast marching on a region of a voxel grid with its own spacing along each axis.
 *
 * Solves |grad T| = 1 / F. Sources: Sethian, PNAS 1996;93:1591 (the method); Sethian, SIAM Review
 * 1999;41:199 (second-order differences where two known values descend along an axis).
 *
 * A voxel takes 4 (speed) + 4 (arrival) + 4 (length) + 1 (source) bytes while marching, and some
 * tens while it is on the front (MarchingQueue.h); 9 are left. Arrays are over all voxels of the
 * region's box where that is nearly full, else over its members.
 */
#ifndef DynamicCoronary_FastMarching_h
#define DynamicCoronary_FastMarching_h

#include "Geometry.h"
#include "ParallelFor.h"
#include "VoxelRegion.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace coronary
{
struct FastMarchingSource
{
  Vector3 index; ///< continuous index of the image's grid, in or beside the region
  int label = 0; ///< 0 to 254; sources may share one
};

struct FastMarchingSettings
{
  Vector3 spacing = Vector3::Ones(); ///< mm, positive
  /// Around a source arrival is taken along straight lines up to this many mm; there a grid can
  /// not resolve the curvature of the front. 0: three of the greatest voxel edges.
  double sourceRadius = 0.0;
  bool secondOrder = true;
  bool lengths = true; ///< also the length of the fastest path to each voxel
};

/// The march over one region, from all sources at once. Deterministic; one thread.
class FastMarching
{
public:
  static constexpr std::uint8_t noSource = 255;

  /**
   * @param region  must outlive this
   * @param speed   one positive value for each member, mm per unit of arrival
   * @throws std::invalid_argument for settings or speeds out of range; Cancelled
   */
  FastMarching(const VoxelRegion& region, std::vector<float> speed,
    const FastMarchingSettings& settings, const ProgressCallback& progress = {});

  /**
   * To be called once: the speeds are gone then.
   * @throws std::invalid_argument for sources out of range; std::logic_error at the second call; Cancelled
   */
  void March(const std::vector<FastMarchingSource>& sources);

  /// Arrival of each member, infinite where the front has not come.
  const std::vector<float>& Arrival() const { return Times; }

  /// Length of the fastest path in mm; empty unless settings.lengths.
  const std::vector<float>& Length() const { return Lengths; }

  /// Label of the source that the front came from, noSource where it has not come.
  const std::vector<std::uint8_t>& Source() const { return Labels; }

  /// Greatest number of bytes that the region and the marching have held at a time.
  std::size_t MemorySize() const;

private:
  template <typename Layout>
  void MarchIn(const Layout& layout, const std::vector<FastMarchingSource>& sources);

  const VoxelRegion& Region;
  FastMarchingSettings Settings;
  ProgressCallback Progress;
  std::vector<float> Speeds;
  std::vector<float> Times;
  std::vector<float> Lengths;
  std::vector<std::uint8_t> Labels;
  std::size_t Peak = 0;
};
}

#endif
