/**
 * @file BranchPlacement.h
 * @brief How likely a branch is where a moving tree has it: within 1 mm of an artery, at one phase.
 *
 * A logistic regression on signs of the tree that was found, of its tracking and of what the images show at it, fitted to phantoms and to scans of one, whose
 * truth is known. Calibrated on simulation only (docs/validation.md).
 */
#ifndef DynamicCoronary_BranchPlacement_h
#define DynamicCoronary_BranchPlacement_h

#include "LumenSight.h"
#include "Polylines.h"
#include "PoseSequence.h"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace coronary
{
/// Mean distance of a branch from the nearest artery up to which it counts as placed, mm.
inline constexpr double PlacedWithin = 1.0;

/// mm that a branch is beside the lumen where nothing is wrong: noise, and the width of a voxel.
inline constexpr double UsualBeside = 0.3;

/// When the images were taken, as fractions of the R-R interval.
struct ImageTiming
{
  double reference = 0.0; ///< of the lines at rest
  double window = 0.0;    ///< over which an image is taken
};

/// What is known of the points of a tree besides their places; empty lists: nothing that speaks against them.
struct PlacementEvidence
{
  std::vector<double> certainty;  ///< per point, 0 to 1, that its section is that of a vessel
  std::vector<double> ostium;     ///< per point, 0 to 1: confidence of the ostium that it hangs on
  std::vector<double> vein;       ///< per point, 0 to 1: probability that it hangs on a vein
  std::vector<LumenSight> sights; ///< per phase, in its image
};

/// What tells whether one branch is where it is said to be at one phase. All speak against it.
struct PlacementSigns
{
  static constexpr std::size_t Count = 9;
  static const std::array<std::string, Count>& Names();

  // Of the branch.
  double unclear = 0.0; ///< 1 less the mean certainty of its sections
  /// Mean share of its points that were filled or lost, over all phases but the reference, each weighed by how much of the tree was seen then:
  /// what was taken for a vessel in the noise of one phase is not to be found in the others.
  double seldom = 0.0;
  double swept =
    0.0; ///< mm that it moves while an image is taken, at the mean speed of its motion to and fro
  double doubtful = 0.0; ///< 1 less the confidence of its ostium
  double vein = 0.0;     ///< probability that it is one
  // Of the phase.
  double unseen = 0.0; ///< share of its points that were filled or lost
  // Of what the images show there; 0 where none was looked at.
  /// mm from its points to the middle of the lumen, mean, less what is usual (UsualBeside)
  double beside = 0.0;
  double dim =
    0.0; ///< share of its contrast, at the phase where it has most of it, that is missing, less what is usual
  double strays = 0.0; ///< the same as `beside` over the phases of `seldom`, with their weights

  std::array<double, Count> Values() const;
};

/**
 * Of every phase, and every line at it.
 * @param poses  the same points at its phases, with status
 * @throws std::invalid_argument when the poses lack a status, or anything is of other points
 */
std::vector<std::vector<PlacementSigns>> SignsOfPlacement(const Polylines& rest,
  const PlacementEvidence& evidence, const PoseSequence& poses, const ImageTiming& timing);

/// Probability that a branch with these signs is within PlacedWithin of an artery. Of what is mostly unseen or farther than that
/// from the lumens that the images have, at the phase or over all of them, hangs on a doubtful ostium, or may be a vein, 0.5 at most.
double PlacementConfidence(const PlacementSigns& signs);

/// Probability that a place is within PlacedWithin of where it is said to be, when all that is known is how far off such places
/// are. @param deviation  root mean square distance, mm
double ConfidenceOfDeviation(double deviation);

/**
 * Of every phase: the probability of each line, at each of its points; where lines meet that of the first.
 * @param deviations  of each phase: of each point's place where nothing was tracked, mm, or else empty; empty: all were tracked
 * @throws as SignsOfPlacement
 */
std::vector<std::vector<double>> PlacementConfidences(const Polylines& rest,
  const PlacementEvidence& evidence, const PoseSequence& poses, const ImageTiming& timing,
  const std::vector<std::vector<double>>& deviations = {});
}

#endif
