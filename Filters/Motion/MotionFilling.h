/**
 * @file MotionFilling.h
 * @brief Where the nodes of a tree are that were not seen: from their own way before and after, and from the heart around them.
 *
 * What a node was not seen doing is predicted from the phases at which it was, with weights that the times suggest and
 * what was seen of the whole heart at the phase corrects. How wrong the same prediction is for the
 * nodes that were seen at the phase is a smooth field over the heart (Gaussian process: affine and a squared
 * exponential of the distance at rest; Rasmussen & Williams 2006), and is added to it. Nodes on all vessels
 * around count, not only those of the same branch.
 */
#ifndef DynamicCoronary_MotionFilling_h
#define DynamicCoronary_MotionFilling_h

#include "LineNodes.h"
#include "TrajectoryModel.h"

#include <vector>

namespace coronary
{
/// What was measured of all nodes at all phases.
struct MotionMeasurements
{
  std::vector<std::vector<Vector3>> displacement; ///< per phase and node, mm
  std::vector<std::vector<Matrix3>> information;  ///< of each, 1/mm^2; zero: nothing
  double robustScale = 1.0;                       ///< mm; what is farther from the fit counts less
  /// A direction of which it says nothing does not make it farther: vessels are found across, not along them.
  bool slides = false;
};

/// How far a place is from what was measured of a node at a phase, mm. @param place  as its displacement
double ApartOf(
  const MotionMeasurements& measured, std::size_t phase, std::size_t node, const Vector3& place);

/// The most probable trajectories, which are at rest at the reference time. Measurements that do not agree with them
/// count less (Geman & McClure).
Trajectories FitRobustly(const LineNodes& nodes, const std::vector<double>& times,
  double referenceTime, const std::vector<const MotionMeasurements*>& measurements,
  const TrajectoryPrior& prior);

/**
 * Places of the nodes that were not seen, with information by their uncertainty; of the others none. At a phase at
 * which no node was seen, what was measured there all the same stands for it, as far as it agrees with a motion of the
 * whole heart. Where fewer than 8 nodes are known of a phase, there is no information.
 * @param displacement  per phase and node, mm; of nodes that were not seen a guess
 * @param seen          per phase and node
 * @param measurements  of all nodes; may be none
 */
MotionMeasurements FillUnseen(const LineNodes& nodes, const std::vector<double>& times,
  double referenceTime, const std::vector<std::vector<Vector3>>& displacement,
  const std::vector<std::vector<bool>>& seen,
  const std::vector<const MotionMeasurements*>& measurements, const TrajectoryPrior& prior);

/**
 * FitRobustly with what FillUnseen says. What was measured where nothing was seen may be of the wrong tissue, all of a
 * branch alike: it counts as far as it agrees with that.
 * @param seen  as of FillUnseen
 */
Trajectories FitFilled(const LineNodes& nodes, const std::vector<double>& times,
  double referenceTime, const std::vector<std::vector<bool>>& seen,
  const std::vector<const MotionMeasurements*>& measurements, const TrajectoryPrior& prior);
}

#endif
