/**
 * @file VoxelSegmentation.h
 * @brief The steps of SegmentVessels for one type of voxel.
 */
#ifndef DynamicCoronary_VoxelSegmentation_h
#define DynamicCoronary_VoxelSegmentation_h

#include "BlockValues.h"
#include "PartialProgress.h"
#include "SparseVoxels.h"
#include "VesselLinking.h"
#include "VesselSegmentation.h"
#include "VoxelLattice.h"

#include <algorithm>

namespace coronary
{
/// What a voxel is found to be.
enum VoxelState : unsigned char
{
  Unknown = 0,
  Body = 1,   ///< aorta, chamber, great vessel
  Vessel = 2, ///< collected
  Band = 4,   ///< near the wall of what was collected
  Leak = 16,  ///< larger than any vessel: not collected again
  Bridge = 32 ///< on the way across a lesion: collected whatever it looks like
};

/// Steps 1 to 4 of VesselSegmentation.h.
template <typename T>
class VoxelSegmentation
{
public:
  VoxelSegmentation(const T* image, const ScalarImage& whole, const float* vesselness,
    const VesselSegmentationSettings& settings)
    : Image(image)
    , Whole(whole)
    , Vesselness(vesselness)
    , Settings(settings)
    , L(whole.grid)
  {
  }

  VesselSegmentationResult Run(
    const std::vector<VesselSeed>& seeds, bool probability, const ProgressCallback& progress);

private:
  struct Member
  {
    std::int64_t voxel;
    float path; ///< mm from the seed
    int seed;
    std::int64_t before; ///< the voxel that it was reached from, -1 at the seed
  };

  float Share(std::int64_t p) const
  {
    return (static_cast<float>(this->Image[p]) - this->Tissue) * this->InverseContrast;
  }
  /// Bright as blood; or less bright, as thin vessels are, but tubular. NaN gives 0.
  float Likelihood(std::int64_t p) const
  {
    const float share = this->Share(p);
    const float blood = (share - 0.3f) * (1.0f / 0.45f);
    const float thin = (share - 0.1f) * (1.0f / 0.35f);
    const float tube = this->Vesselness[p] * this->InverseTubular;
    const float dim =
      std::min(thin > 0.0f ? thin : 0.0f, 1.0f) * std::min(tube > 0.0f ? tube : 0.0f, 1.0f);
    return std::max(dim, std::min(blood > 0.0f ? blood : 0.0f, 1.0f));
  }
  double BrightestNear(const std::array<int, 3>& place) const;
  double ContrastToNoise(const std::array<int, 3>& place) const;
  BloodWindow MeasureWindow(const std::vector<std::array<int, 3>>& places) const;
  double MeasureTubular(const std::vector<std::array<int, 3>>& places) const;
  void FindBodies(const ProgressCallback& progress);
  void FindNoisyBodies(const ProgressCallback& progress);
  void Collect(const std::vector<VesselSeed>& seeds, const std::vector<std::array<int, 3>>& places,
    const ProgressCallback& progress);
  void CutLeakage();
  void CrossLesions(const std::vector<VesselSeed>& seeds,
    const std::vector<std::array<int, 3>>& places, const ProgressCallback& progress);
  template <typename V>
  SparseVoxels<V> Sparse(V nothing) const
  {
    return SparseVoxels<V>(
      { 0, 0, 0 }, { this->L.Size[0] - 1, this->L.Size[1] - 1, this->L.Size[2] - 1 }, nothing);
  }
  /// Places in Members, -1: none.
  SparseVoxels<std::int32_t> MemberNumbers() const
  {
    auto numbers = this->Sparse<std::int32_t>(-1);
    for (std::size_t m = 0; m < this->Members.size(); ++m)
    {
      numbers.At(this->L.Place(this->Members[m].voxel)) = static_cast<std::int32_t>(m);
    }
    return numbers;
  }
  std::vector<VesselRoot> HiddenRoots(const std::vector<VesselSeed>& seeds, double seen) const;
  void KeepConnected();
  // SegmentationWall.cxx
  BlockValues MeasureBlocks(
    const std::array<int, 3>& reach, const ProgressCallback& progress) const;
  void RefineWall(std::vector<float>* probability, const ProgressCallback& progress);
  void DropIslands();
  void FillHoles();

  const T* Image;
  const ScalarImage& Whole;
  const float* Vesselness;
  const VesselSegmentationSettings& Settings;
  VoxelLattice L;
  float Tissue = 0.0f;
  float InverseContrast = 1.0f;
  float Tubular = 1.0f; ///< vesselness of a clear tube
  float InverseTubular = 1.0f;
  std::vector<unsigned char> States;
  std::vector<Member> Members; ///< in order of their path length
  double Leakage = 0.0;        ///< mm^3
  std::vector<VesselLink> Links;
  std::vector<ConsideredLink> Considered;
};
}

#endif
