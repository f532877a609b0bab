/**
 * @file BranchMetrics.h
 * @brief Which branches of a tree were found, and how whole they are: BCR and BCS of the paper (Eq. 17),
 * bounded measures, and the overlap of CAT08.
 *
 * On both sides a branch is the way between two places where the tree forks or ends, whatever lines it
 * was given as. N_I and N_R are the numbers of branches of the result and the reference, L_i and L_R^i
 * the lengths of a result's branch and the reference's branch that it is matched with:
 *
 *     BCR = N_I / N_R,  BCS = 1 / N_I  sum over i of L_i / L_R^i                  Eq. 17 of the paper
 *
 * Both can be greater than 1: a tree with false branches has a BCR above 1. The bounded measures are 1
 * at best, and count from the reference: a branch is detected when enough of it is covered, by whatever
 * branch of the result.
 */
#ifndef DynamicCoronary_BranchMetrics_h
#define DynamicCoronary_BranchMetrics_h

#include "CenterlineOverlap.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// Lengths are in the unit of the coordinates, by default mm.
struct BranchMetricsSettings
{
  double spacing = 0.25; ///< distance of the samples along the branches, positive

  /// A sample of the reference is covered by what of the result is within its radius, or this far where
  /// that is more; positive.
  double tolerance = 1.0;

  double detectedShare = 0.8; ///< covered share of a branch from which it is detected, 0 to 1
  double overlapGate = 0.25;  ///< least overlap of a matched pair, 0 to 1

  /// Ends of a tree that are shorter are no branches, on both sides. 0 or more.
  double minimumLength = 3.0;

  /// Take each line as a branch, as it was given, instead.
  bool linesAreBranches = false;

  /// @throws std::invalid_argument that names the first setting out of range or not finite.
  void Validate() const;
};

struct TreeBranch
{
  std::vector<Vector3> points; ///< at least two
  std::vector<double> radius;  ///< one a point; empty: not known
  std::int64_t group = -1;     ///< of the line that most of it is from
  double length = 0.0;
  bool isRoot = false; ///< begins where the tree does
};

/**
 * The branches of a tree. Lines hang together at points of the same position; what several lines run
 * through counts once (VMTK's form has whole paths).
 * @throws std::invalid_argument for an index out of range, a coordinate or radius that is not finite
 */
std::vector<TreeBranch> FindBranches(
  const Polylines& tree, const BranchMetricsSettings& settings = {});

/// A surface with branches as a tree: the middles of its points along each branch.
/// @param group     branch of each point
/// @param abscissa  way from the root of each point, along the tree
/// @param spacing   distance of the middles, positive
/// @throws std::invalid_argument if the numbers of values differ
Polylines TreeOfSurface(const std::vector<Vector3>& points, const std::vector<std::int64_t>& group,
  const std::vector<double>& abscissa, double spacing = 1.0);

struct BranchAgreement
{
  std::int64_t reference =
    -1;                     ///< number of the reference's branch, -1: a branch of the result alone
  std::int64_t result = -1; ///< number of the result's branch matched with it, -1: none
  double overlap = 0.0;     ///< of the matched pair, 0 to 1
  double lengthRatio = 0.0; ///< L_i / L_R^i of the matched pair; 0 without

  // Of the reference's branch; of a branch of the result alone, what it has of the reference.
  double covered = 0.0; ///< share of its length
  bool detected = false;
  double continuity =
    0.0; ///< covered share, 0 when its beginning is not covered; see docs/metrics.md
  double longestGap = 0.0; ///< without a break
};

struct BranchMetrics
{
  static constexpr double NaN = CenterlineOverlapMeasures::NaN;

  std::vector<TreeBranch> reference;
  std::vector<TreeBranch> result;
  std::vector<BranchAgreement>
    rows; ///< the reference's branches in order, then unmatched ones of the result

  // Eq. 17; NaN where there is nothing to divide by.
  double completenessRatio = NaN; ///< BCR
  double continuityScore = NaN;   ///< BCS; a branch without a match counts 0

  // 0 to 1, 1 is best; NaN without reference.
  double boundedCompleteness = NaN; ///< share of the reference's branches that are detected
  double boundedContinuity = NaN;   ///< mean of their continuity
  double lengthDetected = NaN;      ///< share of the reference's length that is covered

  double matchedLengthRatio = NaN; ///< BCS over the matched branches alone
  std::int64_t matched = 0;
  std::int64_t detected = 0;
  std::int64_t falseBranches =
    0;                      ///< of the result, less than `detectedShare` of them near the reference
  double falseLength = 0.0; ///< of the result, that is not near the reference

  CenterlineOverlapMeasures overlap; ///< CAT08, whole trees
};

/**
 * Compares two trees. Branches are matched one to one so that the sum of overlaps is greatest (Kuhn's
 * Hungarian method); the overlap of two branches is the length of both that lies nearest to the other
 * one, within the tolerance, over both lengths.
 * @throws as FindBranches; for settings out of range; Cancelled
 */
BranchMetrics CompareBranches(const Polylines& result, const Polylines& reference,
  const BranchMetricsSettings& settings = {}, const ProgressCallback& progress = {});
}

#endif
