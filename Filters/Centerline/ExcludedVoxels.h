/**
 * @file ExcludedVoxels.h
 * @brief Voxels of vessels that were followed and are veins: the next extraction leaves them out.
 */
#ifndef DynamicCoronary_ExcludedVoxels_h
#define DynamicCoronary_ExcludedVoxels_h

#include "CenterlineExtraction.h"
#include "VeinRejection.h"

#include <utility>
#include <vector>

namespace coronary
{
class ExcludedVoxels
{
public:
  explicit ExcludedVoxels(ImageGrid grid)
    : Grid(std::move(grid))
  {
  }

  /// One a voxel, not 0: excluded. Null: none are.
  const unsigned char* Voxels() const { return Flags.empty() ? nullptr : Flags.data(); }

  bool Contains(const Vector3& point) const;

  /// Whether a way leads into what is known to be no artery: for a quarter of it, or far along.
  bool LeadsInside(const std::vector<Vector3>& points) const;

  /**
   * Excludes branches of a tree, but not what arteries cover or cross.
   * @param voxel  mm, edge of a voxel
   * @param veins  one is added for each of `found`, or joined to one at the same place
   */
  void Close(const std::vector<VeinBranch>& found, const VesselTree& tree, double voxel,
    std::vector<RejectedVein>& veins);

private:
  ImageGrid Grid;
  std::vector<unsigned char> Flags;
};
}

#endif
