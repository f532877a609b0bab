/**
 * @file HeartRegion.h
 * @brief Where in a chest the coronary arteries can be: what need not be looked at costs nothing.
 */
#ifndef DynamicCoronary_HeartRegion_h
#define DynamicCoronary_HeartRegion_h

#include "ParallelFor.h"
#include "ScalarImage.h"

#include <string>
#include <vector>

namespace coronary
{
/**
 * All of an image but what is deep in the lung and what is farther from the ostia than a heart reaches. Deep in the lung is
 * what is more than 15 mm away from everything solid that is thicker than the lung's vessels (6 mm radius); a heart reaches
 * 90 mm to the right of the middle of its ostia, 140 to the left, 110 to the front and to the back, 70 up and 180 down. In
 * blocks of about 3 mm.
 */
class HeartRegion
{
public:
  /**
   * @param image  HU; patient coordinates must be LPS
   * @param ostia  mm, at least one
   * @throws Cancelled, and std::invalid_argument without ostia
   */
  HeartRegion(const ScalarImage& image, const std::vector<Vector3>& ostia,
    const ProgressCallback& progress = {});

  /// A region as Blocks() told it. @throws std::invalid_argument if it is of another grid
  HeartRegion(const ImageGrid& grid, std::string blocks);

  /// A character a block, not 0 inside.
  const std::string& Blocks() const { return this->Inside; }

  /// Of the image's voxels, 0 to 1.
  double Share() const;

  /// One value for each voxel, 1 inside, else 0.
  void Fill(unsigned char* voxels) const;

private:
  explicit HeartRegion(const ImageGrid& grid);
  std::size_t Slice() const
  {
    return static_cast<std::size_t>(this->Count[0]) * static_cast<std::size_t>(this->Count[1]);
  }
  int End(int block, int axis) const;
  std::vector<unsigned char> Solid(
    const ScalarImage& image, const ProgressCallback& progress) const;

  ImageGrid Grid;
  std::array<int, 3> Size{};   ///< voxels
  std::array<int, 3> Factor{}; ///< voxels of a block along each axis
  std::array<int, 3> Count{};  ///< blocks
  std::string Inside;
};
}

#endif
