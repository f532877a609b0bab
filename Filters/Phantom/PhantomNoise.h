/**
 * @file PhantomNoise.h
 * @brief Correlated noise of a CT reconstruction.
 */
#ifndef DynamicCoronary_PhantomNoise_h
#define DynamicCoronary_PhantomNoise_h

#include "Geometry.h"

#include <array>
#include <cstdint>
#include <vector>

namespace coronary
{
/// White noise named by the voxel's place in the whole image, then a Gaussian kernel: any part of an
/// image gets the noise that it has in the whole.
class CorrelatedNoise
{
public:
  /**
   * @param correlation  standard deviation of the kernel, mm
   * @param level        standard deviation of the noise, HU; none at 0
   * @param key          names the image
   */
  CorrelatedNoise(const ImageGrid& grid, double correlation, double level, std::uint64_t key);

  /// Adds the noise of the index box to its values, x fastest.
  void Add(const std::array<int, 6>& box, std::vector<float>& values) const;

private:
  std::vector<float> White(const int (&size)[3], const int (&corner)[3]) const;

  std::array<int, 6> Extent;
  float Level;
  std::uint64_t Key;
  std::vector<float> Kernels[3];
};
}

#endif
