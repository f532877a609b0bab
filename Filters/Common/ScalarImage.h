/**
 * @file ScalarImage.h
 * @brief A view of somebody else's voxels, in the types that CT images come in.
 */
#ifndef DynamicCoronary_ScalarImage_h
#define DynamicCoronary_ScalarImage_h

#include "Geometry.h"

#include <cstdint>
#include <variant>

namespace coronary
{
/// One value a voxel, i fastest, over grid.extent. The voxels are not owned.
struct ScalarImage
{
  std::variant<const std::int16_t*, const std::uint16_t*, const float*> values;
  ImageGrid grid;

  std::array<int, 3> Dimensions() const
  {
    const std::array<int, 6>& e = this->grid.extent;
    return { e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1 };
  }
  std::int64_t NumberOfVoxels() const
  {
    const std::array<int, 3> n = this->Dimensions();
    return static_cast<std::int64_t>(n[0]) * n[1] * n[2];
  }
};
}

#endif
