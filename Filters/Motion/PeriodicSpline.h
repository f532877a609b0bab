/**
 * @file PeriodicSpline.h
 * @brief The cubic spline over one cycle: through all samples; value, slope and second derivative are continuous.
 *
 * PeriodicSpline.cxx has the equations.
 */
#ifndef DynamicCoronary_PeriodicSpline_h
#define DynamicCoronary_PeriodicSpline_h

#include "Geometry.h"

#include <cstddef>
#include <vector>

namespace coronary
{
/// Where a moment is between two knots of a cycle.
struct KnotInterval
{
  std::size_t before = 0;
  std::size_t after = 0; ///< the first one behind the last one
  double gap = 1.0;      ///< between them, fraction of the cycle
  double share = 0.0;    ///< of the way from `before` to `after`, 0 to 1
};

/// @param knots  0 to 1 (excluded), ascending, one at least
/// @param time   finite; taken modulo 1
KnotInterval IntervalAt(const std::vector<double>& knots, double time);

/// Second derivatives at the knots, as a matrix that is applied to the values there.
/// @param knots  as of IntervalAt
Eigen::MatrixXd SecondDerivatives(const std::vector<double>& knots);

/// Weights of four rows: the values at two knots, and the second derivatives there.
struct CubicWeights
{
  double value[4];
  double rate[4]; ///< for the slope
};

CubicWeights CubicAt(const KnotInterval& interval);

/// Many coordinates over one cycle, exact at the samples. Does not change anything after construction: threads may
/// share it.
class PeriodicPositions
{
public:
  /**
   * @param phases     finite, in any order; modulo 1 no two are nearer to each other than 0.001
   * @param positions  per phase: as many points as in the first one
   * @throws std::invalid_argument: no phase, numbers that differ, a value that is not finite, phases too near
   */
  PeriodicPositions(
    const std::vector<double>& phases, const std::vector<std::vector<Vector3>>& positions);

  /// Any phase, modulo 1; one that is not finite is taken as 0. Allocates nothing once `positions` has been used
  /// before.
  void Evaluate(double phase, std::vector<Vector3>& positions) const;

private:
  std::vector<double> Knots;
  std::size_t Values = 0;     ///< a phase
  std::vector<double> Sample; ///< per knot: x y z of each point
  std::vector<float> Second;  ///< second derivatives by phase, as Sample
};
}

#endif
