/**
 * @file SkinDeformation.h
 * @brief Moves the points of a mesh with the bones that they hang on.
 *
 * Sources: Kavan, Collins, Zara, O'Sullivan, "Geometric skinning with approximate dual quaternion
 * blending", ACM TOG 2008; Jacobson & Sorkine, "Stretchable and twistable bones for skeletal shape
 * deformation", SIGGRAPH Asia 2011. docs/deformation.md has the equations.
 */
#ifndef DynamicCoronary_SkinDeformation_h
#define DynamicCoronary_SkinDeformation_h

#include "BiharmonicSkinWeights.h"
#include "Geometry.h"
#include "ParallelFor.h"
#include "SkeletonPose.h"

#include <array>
#include <memory>
#include <vector>

namespace coronary
{
enum class SkinBlend
{
  Linear = 0, ///< mean of the bones' maps: shrinks where bones turn a lot against each other
  DualQuaternion = 1, ///< mean of their rigid motions: keeps the calibre in strong bends and twists
};

struct SkinDeformationSettings
{
  SkinBlend blend = SkinBlend::Linear;
  /// Points follow the stretch of a bone evenly along it. Off: bones are rigid from their first joints
  /// on, and gaps between a bone and the next one are blended.
  bool stretch = true;
};

/// Tetrahedra whose volume against rest is at or below a limit.
struct InversionReport
{
  std::int64_t found = 0;               ///< before a repair
  std::vector<std::int64_t> tetrahedra; ///< that are left, ascending
  double minimumRatio = 1.0;            ///< of signed volume to that at rest, at the end
  std::int64_t movedPoints = 0;         ///< by the repair
  double maximumMove = 0.0;             ///< mm
  int sweeps = 0;
};

/**
 * Set up once for a mesh at rest; then every frame is one pass over the points, without allocation.
 *
 * Whatever takes a ProgressCallback throws Cancelled when that says stop; the object may be used again.
 * Not to be called from two threads at once: an object holds the frame it is at work on. The same
 * input gives the same bits on any number of threads. Results in single precision differ in the last
 * bits between processors with and without fused multiplication.
 */
class SkinDeformation
{
public:
  /**
   * @param points   at rest, mm
   * @param weights  of as many points; negative ones are taken as they are, the sum of a point is made 1
   * @param rest     the skeleton that the weights were made for
   * @throws std::invalid_argument: arrays of wrong size, a point without weight, an index of a bone that
   * does not exist, a value that is not finite; as SkeletonRig
   */
  SkinDeformation(const std::vector<Vector3>& points, const CompactSkinWeights& weights,
    const Skeleton& rest, const SkinDeformationSettings& settings = {},
    const ProgressCallback& progress = {});
  ~SkinDeformation();
  SkinDeformation(SkinDeformation&&) noexcept;
  SkinDeformation& operator=(SkinDeformation&&) noexcept;

  const SkeletonRig& Rig() const;
  std::int64_t NumberOfPoints() const;

  /// How much cross-sections answer to the stretch of the bones of a pose: SkeletonRig::ConserveVolume. At
  /// first 0, not at all. @throws std::invalid_argument  it is not 0 to 1
  void SetVolumeConservation(double share);

  ///@{
  /**
   * Positions of all points, x y z after each other, in the order given, mm. Single precision is the fast
   * way: its error is about 1e-6 of the mesh's size. Double precision reproduces a rigid motion to
   * rounding.
   * @param bones  one for each bone: SkeletonRig::Transform
   * @throws std::invalid_argument  as SkeletonRig::Transform, or a wrong number of bones
   */
  void Deform(const std::vector<BoneTransform>& bones, float* positions,
    const ProgressCallback& progress = {});
  void Deform(const std::vector<BoneTransform>& bones, double* positions,
    const ProgressCallback& progress = {});
  void Deform(const SkeletonPose& pose, float* positions, const ProgressCallback& progress = {});
  void Deform(const SkeletonPose& pose, double* positions, const ProgressCallback& progress = {});
  ///@}

  ///@{
  /**
   * Positions to the bit as those of the pose that it is at the moment, and in the same pass the velocities of
   * all points, mm/s: the exact derivatives of their positions by time.
   * @throws std::invalid_argument  as SkeletonRig::Transform
   */
  void Deform(const MovingSkeletonPose& pose, float* positions, float* velocities,
    const ProgressCallback& progress = {});
  void Deform(const MovingSkeletonPose& pose, double* positions, double* velocities,
    const ProgressCallback& progress = {});
  ///@}

  /// Of the last pose.
  const std::vector<BoneTransform>& Bones() const;

  ///@{
  /// positions - rest positions, mm.
  void Displacements(
    const float* positions, float* displacements, const ProgressCallback& progress = {}) const;
  void Displacements(
    const double* positions, double* displacements, const ProgressCallback& progress = {}) const;
  ///@}

  /// For NormalsOf. @throws std::invalid_argument: an index that does not exist
  void SetTriangles(const std::vector<Triangle>& triangles, const ProgressCallback& progress = {});
  ///@{
  /// Unit normals of the points: mean of the triangles around, weighted by their areas; 0 where there
  /// are none.
  void NormalsOf(
    const float* positions, float* normals, const ProgressCallback& progress = {}) const;
  void NormalsOf(
    const double* positions, double* normals, const ProgressCallback& progress = {}) const;
  ///@}

  /// For the check and the repair; either orientation.
  /// @throws std::invalid_argument: an index that does not exist, a tetrahedron without volume at rest
  void SetTetrahedra(const std::vector<std::array<std::int64_t, 4>>& tetrahedra,
    const ProgressCallback& progress = {});
  ///@{
  /// @param minimumRatio  tetrahedra at or below this share of their volume at rest are reported
  void CheckTetrahedra(const float* positions, InversionReport& report, double minimumRatio = 0.0,
    const ProgressCallback& progress = {}) const;
  void CheckTetrahedra(const double* positions, InversionReport& report, double minimumRatio = 0.0,
    const ProgressCallback& progress = {}) const;
  ///@}
  /// Signed volume against rest of every tetrahedron, of the last check or repair.
  const std::vector<double>& VolumeRatios() const;
  ///@{
  /**
   * Moves the corners of such tetrahedra until there are none. Sweep by sweep, and in it one after the
   * other, each is given the nearest shape that is not inverted: of the singular values of its deformation
   * gradient those below 0.2 (the least of them negative when it is inverted) are raised to 0.2, or
   * further where the wanted volume asks for it; its middle stays. Nothing else is moved. What is left
   * after 400 sweeps is reported. May allocate where something is inverted.
   * @param positions   of the last call of Deform
   * @param minimumRatio  0 to 0.5
   * @throws std::invalid_argument: minimumRatio is out of range
   */
  void RepairTetrahedra(float* positions, InversionReport& report, double minimumRatio = 0.0,
    const ProgressCallback& progress = {});
  void RepairTetrahedra(double* positions, InversionReport& report, double minimumRatio = 0.0,
    const ProgressCallback& progress = {});
  ///@}

  /// For tests and benchmarks: bones looked at per block of 16 points, on average.
  double EntriesPerBlock() const;

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
