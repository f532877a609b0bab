/**
 * @file WallMotions.h
 * @brief Walls that stand still, that are known at some phases, or that hang on a skeleton.
 */
#ifndef DynamicCoronary_WallMotions_h
#define DynamicCoronary_WallMotions_h

#include "BeatingModel.h"
#include "CoronaryPhantom.h"
#include "PeriodicSpline.h"
#include "WallMotion.h"

#include <memory>
#include <vector>

namespace coronary
{
/**
 * What every wall has to be: its arrays fit each other; as VesselWall wants it, closed and oriented outwards at
 * these positions; groups are branches of the axis (or -1); a branch of the axis has two points at least and
 * positive radii, and its parent is another one (no ring). `axis` may be empty, then groups are free.
 * @throws std::invalid_argument that names what is wrong
 */
void CheckWall(const WallTopology& topology, const std::vector<Vector3>& points);

/// The same at all times.
class StillWallMotion : public WallMotion
{
public:
  /// @throws std::invalid_argument as CheckWall
  StillWallMotion(WallTopology topology, std::vector<Vector3> points);

  const WallTopology& Topology() const override { return this->Topology_; }
  void Positions(double phase, std::vector<Vector3>& positions) override;
  void AxisPositions(double phase, std::vector<Vector3>& positions) override;

private:
  WallTopology Topology_;
  std::vector<Vector3> Points;
  std::vector<Vector3> Axis;
};

/// One connectivity with positions at phases.
class SampledWallMotion : public WallMotion
{
public:
  /**
   * @param axis  per phase: of the axis' points, branch by branch in one list; empty: it stands still
   * @throws std::invalid_argument as CheckWall at every phase, and PeriodicPositions
   */
  SampledWallMotion(WallTopology topology, const std::vector<double>& phases,
    const std::vector<std::vector<Vector3>>& positions,
    const std::vector<std::vector<Vector3>>& axis = {});

  const WallTopology& Topology() const override { return this->Topology_; }
  void Positions(double phase, std::vector<Vector3>& positions) override;
  void AxisPositions(double phase, std::vector<Vector3>& positions) override;

private:
  WallTopology Topology_;
  PeriodicPositions Points;
  std::unique_ptr<PeriodicPositions> Axis;
  std::vector<Vector3> RestAxis;
};

/// A wall and its axis as beating models.
class SkinnedWallMotion : public WallMotion
{
public:
  /**
   * The axis hangs on the bones that it is nearest to at rest.
   * @param rest      of the wall's points, mm
   * @param weights   of the points that were skinned
   * @param skinned   per point of the wall: which of these it is; empty: the same ones
   * @param skeleton  that the weights were made for
   * @param poses     its joints at phases; calibre (of joints) and rotations (of bones) are used if there
   * @throws std::invalid_argument as CheckWall at rest and BeatingModel; an index out of range
   */
  SkinnedWallMotion(WallTopology topology, const std::vector<Vector3>& rest,
    const CompactSkinWeights& weights, const std::vector<std::int64_t>& skinned,
    const Skeleton& skeleton, const PoseSequence& poses, const BeatingModelSettings& settings = {});

  const WallTopology& Topology() const override { return this->Topology_; }
  void Positions(double phase, std::vector<Vector3>& positions) override;
  void AxisPositions(double phase, std::vector<Vector3>& positions) override;

private:
  WallTopology Topology_;
  BeatingModel Wall;
  std::unique_ptr<BeatingModel> Axis;
};

/**
 * A motion at even phases of the cycle, for when it is too slow to be asked for at every key frame: skinning
 * 65,000 points takes as long as a whole key frame, reading them out of samples a hundredth of it.
 * @param phases  4 to 200
 * @throws std::invalid_argument as SampledWallMotion
 */
std::shared_ptr<WallMotion> SampleWallMotion(WallMotion& motion, int phases);

/// The phantom's aorta at rest, completed beyond its first PhantomAortaSeen sections (mm) as a patient's is.
constexpr std::size_t PhantomAortaSeen = 60;
AortaAtRest PhantomAorta(const CoronaryPhantom& phantom);

/// Axes at rest with their radii, names and parents of the phantom's vessels; without a surface.
WallTopology PhantomAxes(const CoronaryPhantom& phantom);

/**
 * The phantom's true lumen: both coronary trees, as components of one surface. Entities 2 and 3 are the left and
 * right ostium, 4.. the ends of the branches; a point's group is the place of its branch in Topology().axis.
 * @param edgeLength  mm, instead of settings.surfaceSpacing
 * @param phases      even samples of the cycle, 4 to 200; between them as SampledWallMotion
 * @throws std::invalid_argument as PhantomSettings::Validate; beatVariation or beatIrregularity is not 0 (no longer periodic);
 *         phases; as CheckWall
 * @throws Cancelled
 */
std::shared_ptr<WallMotion> MakePhantomWallMotion(const PhantomSettings& settings,
  double edgeLength, int phases = 40, const ProgressCallback& progress = {});
}

#endif
