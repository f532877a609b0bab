/**
 * @file TrajectoryModel.h
 * @brief Periodic trajectories of all nodes of a forest at once, from uncertain measurements.
 *
 * A heart moves as one: first a motion that all vessels have in common, a polynomial of the place
 * whose coefficients are Fourier series in time. What a vessel does beside it is a Gaussian process: in
 * time a Fourier series with shrinking harmonics, along the vessels a random walk of its coefficients.
 * Its most probable trajectories and their uncertainty are exact: the tree is eliminated from its tips
 * to its root, and back (Rauch, Tung & Striebel, AIAA Journal 1965, on a tree instead of a chain).
 */
#ifndef DynamicCoronary_TrajectoryModel_h
#define DynamicCoronary_TrajectoryModel_h

#include "LineNodes.h"

#include <vector>

namespace coronary
{
struct TrajectoryPrior
{
  int harmonics = 6;       ///< of the cycle, 1 to 12
  double amplitude = 15.0; ///< standard deviation of the first harmonic, mm; the m-th: / m^decay
  double decay = 2.0;      ///< 0 to 4
  double neighbourChange =
    0.2; ///< of the first harmonic from node to node, across the vessel, mm per
         ///< square root of mm along it; the m-th: / m^neighbourDecay
  double neighbourStretch = 0.08; ///< the same along the vessel, which bends more than it stretches
  double neighbourDecay = 1.0;    ///< 0 to 4

  int commonDegree = 3;    ///< of the common motion's polynomial, 0 to 4; 0: there is none
  int commonHarmonics = 3; ///< 1 to 12; with more, phases without images would be guessed badly
  double commonDeviation = 2.0; ///< mm that vessels are expected beside it, 0.1 to 100

  /// @throws std::invalid_argument naming the setting.
  void Validate() const;
};

/// Where a node is at a moment: its displacement from rest.
struct TrajectoryMeasurement
{
  int phase = 0; ///< index of the moment
  Vector3 displacement = Vector3::Zero();
  Matrix3 information = Matrix3::Zero(); ///< inverse covariance, 1/mm^2
};

/// The result: displacements at any time.
class Trajectories
{
public:
  Vector3 Displacement(int node, double time) const;
  Vector3 Derivative(int node, double time) const; ///< mm per R-R interval
  /// Standard deviation per axis (root of the mean of the variances), mm.
  double Deviation(int node, double time) const;

  std::vector<Eigen::MatrixXd> coefficients; ///< per node: basis x 3, mm
  std::vector<Eigen::MatrixXd> covariance;   ///< per node: (3 basis)^2, order basis-major
};

/// 1, cos 2 pi t, sin 2 pi t, cos 4 pi t, ...
Eigen::VectorXd PeriodicBasis(double time, int harmonics);

/**
 * @param times         of the moments, fractions of R-R
 * @param measurements  per node of `nodes`
 * @throws std::invalid_argument  naming a setting, or for a measurement of a phase that does not exist
 */
Trajectories FitTrajectories(const LineNodes& nodes, const std::vector<double>& times,
  const std::vector<std::vector<TrajectoryMeasurement>>& measurements,
  const TrajectoryPrior& prior = {});
}

#endif
