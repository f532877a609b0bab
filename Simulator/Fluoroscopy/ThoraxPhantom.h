/**
 * @file ThoraxPhantom.h
 * @brief A patient's chest as a CT volume, around the heart of CoronaryPhantom: the default background of X-ray images.
 *
 * Same coordinates as CoronaryPhantom: LPS, mm, left coronary ostium of the reference heart at the origin.
 * docs/fluoroscopy-image.md says what is in it, from which measures, and what is not.
 */
#ifndef DynamicCoronary_ThoraxPhantom_h
#define DynamicCoronary_ThoraxPhantom_h

#include "ParallelFor.h"
#include "ScalarImage.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// Voxels in Hounsfield units (air -1000, water 0), i fastest over grid.extent.
struct HounsfieldVolume
{
  ImageGrid grid;
  std::vector<std::int16_t> values;

  ScalarImage View() const { return { this->values.data(), this->grid }; }
};

struct ThoraxSettings
{
  std::uint64_t seed =
    1; ///< varies size, slope of the ribs, curve of the spine, vessels of the lungs; 0: the mean
  double spacing = 1.5; ///< mm between voxels, 0.8 to 6
  double width = 340.0; ///< of the chest from side to side, mm, 260 to 420; the rest follows
  double fat = 12.0;    ///< mm under the skin, 4 to 40

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

/**
 * The same bits for the same settings, whatever the number of threads.
 * @throws std::invalid_argument as ThoraxSettings::Validate(); Cancelled
 */
HounsfieldVolume MakeThoraxPhantom(
  const ThoraxSettings& settings = {}, const ProgressCallback& progress = {});
}

#endif
