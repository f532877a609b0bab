/**
 * @file VesselMarch.h
 * @brief The voxels of vessels around seeds, the march through them, and the fastest ways back.
 */
#ifndef DynamicCoronary_VesselMarch_h
#define DynamicCoronary_VesselMarch_h

#include "CenterlineExtraction.h"
#include "FastMarching.h"
#include "LumenMeasurement.h"
#include "VoxelRegion.h"

#include <cstddef>
#include <memory>
#include <vector>

namespace coronary
{
/// A way through the region, in mm along the axes of the grid (index times spacing).
struct MinimalPath
{
  static constexpr std::int32_t noOwner = -1;

  std::vector<Vector3> points;  ///< from the tip down to the source or the tree
  std::int32_t owner = noOwner; ///< point of the tree that it met
  bool closed = true;           ///< met the source or the tree
};

/// In the order of its methods: what the march goes through, the march, and what it tells.
class VesselMarch
{
public:
  /// Both must outlive this.
  VesselMarch(const CenterlineInput& input, const CenterlineSettings& settings);
  VesselMarch(const VesselMarch&) = delete;
  VesselMarch& operator=(const VesselMarch&) = delete;

  /// Of each voxel to the wall of a mask or as given, mm, positive inside; null: the march has a speed.
  const float* WallDistance() const;

  /**
   * @param intensityThreshold  of `image`; not finite: any
   * @param excluded            voxels that are left out, not 0; may be null
   */
  void MakeRegion(
    const ImageInterpolator& image, double intensityThreshold, const unsigned char* excluded);

  const VoxelRegion& Region() const { return Members; }

  /// Number of the member at a continuous index of the grid, or VoxelRegion::notAMember.
  std::uint32_t MemberAt(const Vector3& index) const;

  Vector3 IndexOf(std::uint32_t member) const;

  /// @param reach        mm
  /// @param reachedOnly  only where the front has come
  std::uint32_t NearestMember(const Vector3& index, double reach, bool reachedOnly) const;

  /// @param seedMembers  one a seed: a member, or VoxelRegion::notAMember for seeds that are left out
  /// @param reference    what bright is, where there is an intensity
  void March(const ImageInterpolator& image, const LumenReference& reference,
    const std::vector<std::uint32_t>& seedMembers, const ProgressCallback& progress);

  /// The same at given speeds. @param speed  one positive value for each member
  void March(std::vector<float> speed, const std::vector<std::uint32_t>& seedMembers,
    const ProgressCallback& progress);

  const FastMarching& Marched() const { return *Front; }

  /// Against the front.
  /// @param owner  of each member: the point of the tree whose lumen it is in, or MinimalPath::noOwner
  MinimalPath Backtrack(
    const Vector3& from, std::uint32_t member, const std::vector<std::int32_t>& owner) const;

  /// Bytes at most, after the march.
  std::size_t MemorySize() const;

private:
  bool Gradient(const Vector3& index, Vector3& gradient) const;

  const CenterlineInput& Input;
  const CenterlineSettings& Settings;
  double Voxel;
  std::vector<float> MaskDistance;
  VoxelRegion Members;
  std::unique_ptr<FastMarching> Front;
};
}

#endif
