/**
 * @file VolumeProjector.h
 * @brief Digitally reconstructed radiographs: line integrals through a CT volume.
 */
#ifndef DynamicCoronary_VolumeProjector_h
#define DynamicCoronary_VolumeProjector_h

#include "CArm.h"
#include "LineIntegrals.h"
#include "ParallelFor.h"
#include "ScalarImage.h"

#include <cstdint>
#include <functional>
#include <memory>

namespace coronary
{
/// Part of an image: columns [column, column + columns), rows [row, row + rows).
struct PixelRectangle
{
  int column = 0;
  int row = 0;
  int columns = 0;
  int rows = 0;
};

struct VolumeProjectorSettings
{
  /// A block of 8^3 voxels that attenuates nowhere more than this is passed over, 1/mm. 0 loses nothing.
  double negligible = 0.0;
};

/**
 * Integrals along rays by Joseph's method: in each slice across the volume's axis that a ray follows most, the
 * bilinear value at the place where the ray comes through, times the way from slice to slice. Around the volume there is
 * nothing; so a homogeneous volume of n voxels in a row gives exactly n voxels.
 * Source: Joseph, "An improved algorithm for reprojecting rays through pixel images", IEEE TMI 1 (1982) 192.
 *
 * The attenuation is held in 16 bits, in two orders in memory: 4 bytes a voxel. Thread-safe once constructed.
 */
class VolumeProjector
{
public:
  /**
   * @param volume  values in Hounsfield units or whatever the next argument understands; not needed afterwards
   * @param attenuation  of a value, 1/mm, finite and not negative, below 100
   * @throws std::invalid_argument when the grid is empty, has no volume, or more than 2^30 voxels, or for an
   *   attenuation out of range
   */
  VolumeProjector(const ScalarImage& volume, const std::function<double(double)>& attenuation,
    const VolumeProjectorSettings& settings = {});
  ~VolumeProjector();
  VolumeProjector(const VolumeProjector&) = delete;
  VolumeProjector& operator=(const VolumeProjector&) = delete;

  /// All pixels, on all threads; the result does not depend on their number.
  /// @throws Cancelled when progress returned false
  LineIntegrals Project(const CArmGeometry& geometry, const ProgressCallback& progress = {}) const;

  /// The pixels of a rectangle, on this thread; the others stay what they are. The rectangle is cut to the image.
  /// @throws std::invalid_argument when the image is not of the geometry's format
  void ProjectRectangle(
    const CArmGeometry& geometry, const PixelRectangle& rectangle, LineIntegrals& image) const;

private:
  struct Volume;
  std::unique_ptr<const Volume> Data;
};

/// An image of other size with the same borders, bilinear between the pixels' centres.
/// @throws std::invalid_argument when one of the two has no pixels
LineIntegrals Resampled(const LineIntegrals& image, int columns, int rows);
}

#endif
