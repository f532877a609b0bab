/**
 * @file CenterlineOverlap.h
 * @brief How well centerlines agree with a reference: the measures of the Rotterdam challenge.
 *
 * Schaap et al., Standardized evaluation methodology and reference database for evaluating coronary
 * artery centerline extraction algorithms, Med Image Anal 2009;13:701 (CAT08). Both sides are sampled
 * in equal steps and their samples connected. A sample of the reference is found (TPR) when a
 * connection to it is no longer than the vessel's radius there, else missed (FN); a sample of the
 * result is right (TPM) when one of its connections is, else false (FP).
 *
 *     OV = (TPM + TPR) / (TPM + TPR + FN + FP)
 *     OF = share of the reference before its first missed sample
 *     OT = OV of the clinically relevant part: up to the last radius of 0.75 mm or more
 *     AD, AI, AT = mean length of the connections: all, those within the radius, those of OT's part
 *
 * Lines are compared as CAT08 does, along an ordered correspondence. Trees, where one order does
 * not exist, are compared as a whole by nearest connections, or path by path from root to tip.
 */
#ifndef DynamicCoronary_CenterlineOverlap_h
#define DynamicCoronary_CenterlineOverlap_h

#include "ParallelFor.h"
#include "Polylines.h"

#include <cstdint>
#include <limits>
#include <vector>

namespace coronary
{
/// Lengths are in the unit of the coordinates, by default mm.
struct CenterlineOverlapSettings
{
  double spacing = 0.03; ///< distance of the samples, positive

  /// Radius from which a vessel is clinically relevant: what OT and AT stop at. 0 or more.
  double relevantRadius = 0.75;

  /// Vessels are left out where no radius at or downstream is this large, together with what of the
  /// result is nearest to such a place: neither right nor wrong. Trees as a whole only. 0 or more.
  double minimumRadius = 0.0;

  /// Misses this near to the reference's start do not end OF: where the vessel leaves the aorta is
  /// a matter of opinion. 0 or more.
  double startLength = 5.0;

  /// Whether the result is cut where it first passes the disc across the reference's start that is
  /// two radii wide, as CAT08 does. Lines and paths only.
  bool clipStart = true;

  /// @throws std::invalid_argument that names the first setting out of range or not finite.
  void Validate() const;
};

struct CenterlineOverlapMeasures
{
  // Samples.
  std::int64_t foundReference = 0;  ///< TPR
  std::int64_t missedReference = 0; ///< FN
  std::int64_t rightResult = 0;     ///< TPM
  std::int64_t falseResult = 0;     ///< FP

  double referenceLength = 0.0;
  double resultLength = 0.0;

  // 0 to 1; NaN where there is nothing to compare.
  double overlap = NaN;             ///< OV
  double overlapToFirstError = NaN; ///< OF
  double overlapRelevant = NaN;     ///< OT

  // Lengths; NaN where there is no connection.
  double distance = NaN;         ///< AD
  double distanceInside = NaN;   ///< AI
  double distanceRelevant = NaN; ///< AT

  // Radius of the result minus radius of the reference, over the connections of AI whose reference
  // is relevant; NaN where the result has no radii.
  double radiusError = NaN; ///< mean of the absolute value
  double radiusBias = NaN;  ///< mean

  static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
};

enum class CenterlineMatch : int
{
  NotCompared = 0, ///< in no line of two distinct points, cut off at the start, or too thin
  TruePositive = 1,
  FalseNegative = 2, ///< of the reference only
  FalsePositive = 3  ///< of the result only
};

/// What the sample nearest to an input's point is.
struct CenterlinePointMatch
{
  CenterlineMatch match = CenterlineMatch::NotCompared;

  /// Length of its shortest connection; NaN without one.
  double distance = CenterlineOverlapMeasures::NaN;
};

/// What observers reached on the same vessel.
struct ObserverAgreement
{
  double overlap = CenterlineOverlapMeasures::NaN;
  double overlapToFirstError = CenterlineOverlapMeasures::NaN;
  double overlapRelevant = CenterlineOverlapMeasures::NaN;

  /// Their distance from the reference, one a point of the reference; may be empty.
  std::vector<double> distance;
};

/// 100 perfect, 50 as good as an observer, 0 nothing; NaN where nothing is known of observers.
struct CenterlineOverlapScores
{
  double overlap = CenterlineOverlapMeasures::NaN;
  double overlapToFirstError = CenterlineOverlapMeasures::NaN;
  double overlapRelevant = CenterlineOverlapMeasures::NaN;
  double distance = CenterlineOverlapMeasures::NaN;
  double distanceInside = CenterlineOverlapMeasures::NaN;
  double distanceRelevant = CenterlineOverlapMeasures::NaN;
};

/// One line. In the result the radius may be empty.
struct OverlapLine
{
  std::vector<Vector3> points;
  std::vector<double> radius;
};

struct LineOverlap
{
  CenterlineOverlapMeasures measures;
  CenterlineOverlapScores scores;
  std::vector<CenterlinePointMatch> reference; ///< one a point of the input
  std::vector<CenterlinePointMatch> result;
};

/**
 * Two lines that run in the same direction, exactly as CAT08: connections follow each other along
 * both lines, each sample has one at least, the first joins the starts, the last the ends, and the
 * sum of their lengths is the least possible (dynamic programming over all pairs of samples: one
 * bit a pair).
 *
 * A line of no length counts as missing. Without a reference nothing is compared.
 * @throws std::invalid_argument for settings out of range, a coordinate, radius or observer's value
 *         that is not finite, a negative radius, another number of radii than of points, or lines of
 *         more than 4e10 pairs of samples; Cancelled
 */
LineOverlap CompareCenterlines(const OverlapLine& reference, const OverlapLine& result,
  const CenterlineOverlapSettings& settings = {}, const ObserverAgreement& observers = {},
  const ProgressCallback& progress = {});

/// The measures of one line or path of the reference.
struct TreeOverlapRow
{
  std::vector<std::int64_t> lines; ///< of the reference, from the root; one unless it is a path
  std::vector<std::int64_t> resultLines; ///< of the result's path that was compared with a path
  CenterlineOverlapMeasures measures;
};

struct TreeOverlap
{
  std::vector<TreeOverlapRow> rows;
  CenterlineOverlapMeasures total;
  std::vector<CenterlinePointMatch> reference; ///< one a point of the input
  std::vector<CenterlinePointMatch> result;

  /// Longest way down the result that is false without a break, and down the reference that is missed.
  double longestFalse = 0.0;
  double longestMissed = 0.0;
};

/**
 * Whole trees. A sample is connected to the nearest point of the other side's lines. It is found
 * where that is no further than its radius; a sample of the result is right where it lies within
 * the radius of any sample of the reference.
 *
 * One row for each line of the reference; what is false counts in the row of the nearest line, so
 * that rows add up to the total. OF of a row: the part of the line before its first missed sample,
 * 0 if there is one on the way from the root to the line. OF of the total: the share of the whole
 * reference that can be reached from the roots without crossing a missed sample. The relevant part
 * are the places of the reference that have a relevant radius at or downstream of them, and the
 * samples of the result that are nearest to one of these places, but not to the end of a line
 * where the reference stops.
 *
 * Lines hang together where the first point of one is a point of another, by index or by position.
 * Lines of the reference that run on top of each other count each time: split such a tree first
 * (BuildTopology). `radius` of the result may be empty, groups are not read.
 * @throws as CompareCenterlines; for an index out of range too
 */
TreeOverlap CompareCenterlineTrees(const Polylines& reference, const Polylines& result,
  const CenterlineOverlapSettings& settings = {}, const ProgressCallback& progress = {});

/**
 * Trees path by path: one row for each way from a root to a tip of the reference, compared by
 * CompareCenterlines with the way through the result that runs within the radius along most of it,
 * of several such the one that leaves it least. The total is that of all rows' samples and
 * connections together. A point that is on several paths has the best of its matches.
 *
 * What no path of the reference is compared with (false branches) does not count here:
 * CompareCenterlineTrees counts it.
 * @throws as CompareCenterlineTrees
 */
TreeOverlap CompareCenterlinePaths(const Polylines& reference, const Polylines& result,
  const CenterlineOverlapSettings& settings = {}, const ProgressCallback& progress = {});
}

#endif
