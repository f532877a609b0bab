/**
 * @file BranchPlacement.h
 * @brief How likely a branch is where a moving tree has it: within 1 mm of an artery, at one phase.
 *
 * A logistic regression on signs of the tree that was found and of its tracking, fitted to phantoms and to scans of one, whose
 * truth is known. Calibrated on simulation only (docs/validation.md).
 */
#ifndef DynamicCoronary_BranchPlacement_h
#define DynamicCoronary_BranchPlacement_h

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

/// How sure the tree was, per point, 0 to 1; empty: 1.
struct TreeCertainty
{
  std::vector<double> section; ///< that its section is that of a vessel
  std::vector<double> bridge;  ///< of the bridges that lead to it
};

/// What tells whether one branch is where it is said to be at one phase.
struct PlacementSigns
{
  static constexpr std::size_t Count = 5;
  static const std::array<std::string, Count>& Names();

  double unclear = 0.0;  ///< 1 less the mean certainty of its sections
  double bridged = 0.0;  ///< 1 less the mean certainty of the bridges that lead to it
  double thin = 0.5;     ///< 1/mm, of its mean diameter, 2 at most; without radii 0.5
  double unseen = 0.0;   ///< share of its points that were filled or lost
  double strained = 0.0; ///< root mean square change of length, of stretches of 5 mm; 1 at most

  std::array<double, Count> Values() const;
};

/**
 * Of every line at one phase.
 * @param rest   the lines at rest
 * @param poses  the same points at its phases, with status
 * @param phase  number of a phase
 * @throws std::invalid_argument when the poses lack a status, or anything is of other points
 */
std::vector<PlacementSigns> SignsOfPlacement(const Polylines& rest, const TreeCertainty& certainty,
  const PoseSequence& poses, std::size_t phase);

/// Probability that a branch with these signs is within PlacedWithin of an artery. Of what is mostly unseen 0.5 at most.
double PlacementConfidence(const PlacementSigns& signs);

/// Probability that a place is within PlacedWithin of where it is said to be, when all that is known is how far off such places
/// are. @param deviation  root mean square distance, mm
double ConfidenceOfDeviation(double deviation);

/**
 * The probability of each line, at each of its points; where lines meet that of the first.
 * @param deviations  of a phase at which nothing was tracked: of each point's place, mm; else empty
 * @throws as SignsOfPlacement
 */
std::vector<double> PlacementConfidences(const Polylines& rest, const TreeCertainty& certainty,
  const PoseSequence& poses, std::size_t phase, const std::vector<double>& deviations = {});
}

#endif
