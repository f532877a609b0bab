/**
 * @file CenterlineExtraction.h
 * @brief From an image, a mask or a distance field to trees of centerlines with radii.
 *
 * Fast marching from the seeds; fastest paths back from all tips of the vessels, or from given
 * targets; each path is put on the axis of the lumen by measured cross-sections, cut where no
 * vessel is to be seen any more, and joined to the tree where its axis meets the axis of its parent.
 */
#ifndef DynamicCoronary_CenterlineExtraction_h
#define DynamicCoronary_CenterlineExtraction_h

#include "Geometry.h"
#include "ParallelFor.h"
#include "ScalarImage.h"
#include "VeinRejection.h"
#include "VesselBridge.h"
#include "VesselTree.h"

#include <limits>
#include <string>

namespace coronary
{
/**
 * What to march in: a speed, a mask, or both (then the mask limits the region). All on one grid,
 * i fastest, not owned.
 */
struct CenterlineInput
{
  ImageGrid grid;
  const float* speed = nullptr;        ///< any measure that is greatest on the axes, >= 0
  const unsigned char* mask = nullptr; ///< not 0: vessel
  /// Signed distance to the wall in mm, positive inside; takes the place of speed and mask.
  const float* wallDistance = nullptr;
  /// Where lumens are measured, on a grid of its own. Null: on the mask, distance or speed.
  const ScalarImage* intensity = nullptr;
  std::vector<Vector3> seeds;   ///< mm, one for each tree; its root
  std::vector<Vector3> targets; ///< mm; may be empty
  /// Ways across lesions that belong to the region: no vessel need be seen there.
  std::vector<VesselBridge> bridges;
};

/// Zero means automatic for all lengths; the automatic ones follow voxels and radii, not millimetres.
struct CenterlineSettings
{
  /// Speeds at or below are no vessel. NaN: 2 % of the 99.99th percentile; with a mask any speed.
  double speedThreshold = std::numeric_limits<double>::quiet_NaN();
  /// Intensities at or below are no vessel. NaN: 40 % between background and lumen at the seeds; with
  /// a mask any.
  double intensityThreshold = std::numeric_limits<double>::quiet_NaN();
  double speedExponent = 2.0;       ///< 0.5 to 6
  bool findTips = true;             ///< whether tips are looked for as well when targets are given
  double minimumBranchLength = 0.0; ///< mm outside of the parent's lumen
  double minimumConfidence = 0.5;   ///< 0 to 1: sections below are not seen as vessel
  double maximumGap = 0.0;          ///< mm without a visible vessel that a branch may bridge
  double maximumRadius = 0.0;       ///< mm; automatic: twice the seeds', at least 3 mm and 6 voxels
  double resampling = 0.0;          ///< distance of points, mm
  double smoothing = 0.0;           ///< wavelength that smoothing halves, mm
  double blur = 0.0;                ///< standard deviation of the image's blur, mm; 0: measured
  bool snap = true;                 ///< put points on the measured centre
  double snapDistance = 0.0;        ///< mm between a given seed or target and the region
  bool thinBranches = true; ///< on images also branches that are too thin for the speed or mask
  /// Points on the ways back from tips, of all together: a limit of work, the same on any machine.
  std::int64_t stepLimit = 5000000;
  std::int64_t voxelLimit = 100000000; ///< voxels in the region

  /// @throws std::invalid_argument that names the first setting out of range
  void Validate() const;
};

enum class EndStatus : int
{
  Reached = 0,
  OutsideImage = 1,  ///< not in the image
  OutsideRegion = 2, ///< no vessel there
  NotConnected = 3,  ///< no way through vessels from any seed
  InOtherTree = 4,   ///< a seed in the vessel of an earlier seed
  LimitReached = 5,  ///< of work or size
  TooShort = 6       ///< the point is in the lumen of its seed
};

/// "reached", "outside the image", ...
const char* EndStatusText(EndStatus status);

struct CenterlineEnd
{
  EndStatus status = EndStatus::NotConnected;
  int treeId = -1;         ///< index of the seed
  std::int64_t point = -1; ///< of the tree, -1 if there is none
  std::string message;     ///< whole sentence, empty when reached
};

struct CenterlineBifurcation
{
  std::int64_t point = -1; ///< of the tree
  int parentGroupId = -1;
  std::vector<int> daughterGroupIds;
};

/// What touched a tree and was taken for a vein: it was left out.
struct RejectedVein
{
  Vector3 position = Vector3::Zero(); ///< mm, where it touched
  double length = 0.0;                ///< mm
  double probability = 0.0;           ///< 0.5 to 1
};

struct CenterlineResult
{
  VesselTree tree;                    ///< split; treeId is the seed's index
  std::vector<CenterlineEnd> seeds;   ///< one for each seed
  std::vector<CenterlineEnd> targets; ///< one for each target
  std::vector<CenterlineBifurcation> bifurcations;
  std::vector<RejectedVein> veins;
  /// Of each point of the tree, 0 to 1: the greatest of the branches from the ostium to its own one; 0 where none was judged.
  std::vector<double> veinProbability;
  std::vector<VeinBranch>
    judged; ///< in all rounds: what the weights of VeinRejection.h are fitted to
  std::vector<std::string> messages; ///< what a user should know
  bool complete = true;              ///< false: stopped by a limit
  std::int64_t regionVoxels = 0;
  double blur = 0.0; ///< standard deviation of the image's blur that radii were corrected for, mm
  std::size_t memory = 0; ///< bytes, at most, beside the input
};

/**
 * Deterministic, the same on any number of threads and under any load.
 * @throws std::invalid_argument for settings or an input that can not be used (no seed, nothing to
 * march in, spacing not positive); Cancelled. Seeds and targets that can not be used are
 * reported, not thrown.
 */
CenterlineResult ExtractCenterlines(const CenterlineInput& input,
  const CenterlineSettings& settings, const ProgressCallback& progress = {});
}

#endif
