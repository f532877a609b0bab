/**
 * @file BackgroundCache.h
 * @brief The patient behind the instruments: soon coarsely, then finely, and at once where the C-arm has been before.
 */
#ifndef DynamicCoronary_BackgroundCache_h
#define DynamicCoronary_BackgroundCache_h

#include "CArm.h"
#include "LineIntegrals.h"
#include "VolumeProjector.h"

#include <cstddef>
#include <cstdint>
#include <memory>

namespace coronary
{
struct BackgroundCacheSettings
{
  bool worker = true;               ///< false: SetGeometry() makes the whole image itself
  int previewSize = 128;            ///< columns and rows of the coarse image at most
  int bandRows = 32;                ///< rows that are refined between two images handed out
  double angleStep = 3.5e-4;        ///< radians (0.02 degrees): poses are rounded to whole steps
  double lengthStep = 0.1;          ///< mm, of distances and of the isocentre
  std::size_t memory = 128U << 20U; ///< bytes of finished images that are kept
};

struct BackgroundCacheCounts
{
  std::uint64_t requests = 0;  ///< other geometries than the one before
  std::uint64_t hits = 0;      ///< of them: finished ones kept
  std::uint64_t finished = 0;  ///< images made to the end
  std::uint64_t cancelled = 0; ///< images given up for another geometry
  std::size_t bytes = 0;       ///< of finished images kept
};

/**
 * Poses are rounded (Rounded()), and images are made of the rounded pose: what is shown does not depend on where the
 * C-arm came from. SetGeometry() and Current() may be called from different threads; both lock for no longer than it
 * takes to copy a pointer, except SetGeometry() without a worker.
 */
class BackgroundCache
{
public:
  /// @throws std::invalid_argument without a projector, or for settings out of range
  explicit BackgroundCache(
    std::shared_ptr<const VolumeProjector> projector, const BackgroundCacheSettings& settings = {});
  ~BackgroundCache();
  BackgroundCache(const BackgroundCache&) = delete;
  BackgroundCache& operator=(const BackgroundCache&) = delete;

  /// From now on this geometry; refining another is given up within one tile, a coarse image that was begun is finished.
  /// @throws what the projector throws when there is no worker
  void SetGeometry(const CArmGeometry& geometry);

  /**
   * The best there is, of the last geometry's format. Before its first coarse image: the one of the geometry before,
   * if that had the same format, else null.
   * @param completeness  0: coarse, of a geometry that the C-arm came through, or none; between: part of the pixels is at full resolution, the rest
   *   is coarse; 1: finished
   */
  std::shared_ptr<const LineIntegrals> Current(double* completeness = nullptr) const;

  /// Waits until the last geometry's image is finished. @return false when it was not within the time, s
  /// @throws what made the worker stop
  bool Wait(double seconds) const;

  /// What the images are made of.
  CArmGeometry Rounded(const CArmGeometry& geometry) const;

  BackgroundCacheCounts Counts() const;

private:
  struct Implementation;
  std::unique_ptr<Implementation> Data;
};
}

#endif
