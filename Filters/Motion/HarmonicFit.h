/**
 * @file HarmonicFit.h
 * @brief Least squares with Fourier series over the cycle, of single values and of few spatial modes.
 */
#ifndef DynamicCoronary_HarmonicFit_h
#define DynamicCoronary_HarmonicFit_h

#include "CyclicTime.h"
#include "PhaseInterpolation.h"

#include <cmath>

namespace coronary
{
/// A row a phase or a harmonic.
using HarmonicRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// 1, cos, sin, cos 2 ... of a moment.
Eigen::VectorXd Harmonics(double time, int order);

/// Their derivatives, per cycle.
Eigen::VectorXd HarmonicRates(double time, int order);

/// The ridge fit as a matrix that is applied to values at the times: coefficients of the harmonics.
Eigen::MatrixXd FourierFit(const std::vector<double>& times, int order, double ridge);

/// result = matrix * rows, over blocks of columns.
void Multiply(const Eigen::MatrixXd& matrix, const HarmonicRows& rows, HarmonicRows& result);

/// The fit of LowNoise: few spatial modes, each a Fourier series.
class LowNoiseFitter
{
public:
  /**
   * @param knots    distinct phases, ascending, 0 to 1
   * @param points   a row a knot, x y z after each other
   * @param weights  a row a knot, a column a point; 0 counts for nothing
   */
  LowNoiseFitter(const std::vector<double>& knots, const HarmonicRows& points,
    const HarmonicRows& weights, const PhaseInterpolationSettings& settings,
    const ProgressCallback& progress);

  /// @param coefficients  gets a row a coefficient of 1, cos, sin, cos 2 ...
  LowNoiseFit Run(HarmonicRows& coefficients);

private:
  struct Choice
  {
    int rank;
    int order;
    double ridge;
  };
  /// Products of modes with modes (a matrix a knot) and with positions, summed over points.
  struct Sums
  {
    std::vector<Eigen::MatrixXd> gram;
    Eigen::MatrixXd moment;
  };

  void Fill();
  void Choose(const Eigen::MatrixXd& gram);
  std::vector<Choice> Choices() const;
  Eigen::MatrixXd Predictions(
    Eigen::Index out, const Eigen::MatrixXd& gram, const std::vector<Choice>& choices) const;
  void AddErrors(Eigen::Index out, const Eigen::MatrixXd& blend, std::vector<double>& errors) const;
  void Alternate(Eigen::MatrixXd courses, HarmonicRows& coefficients);
  std::vector<Sums> FitShapes(const Eigen::MatrixXd& basis, HarmonicRows& shape) const;
  Eigen::MatrixXd FitCourses(const std::vector<Sums>& parts, const Eigen::VectorXd& penalty) const;
  double Residual(const HarmonicRows& coefficients) const;

  const std::vector<double>& Knots;
  const HarmonicRows& Points;
  const HarmonicRows& Weights;
  const PhaseInterpolationSettings& Settings;
  const ProgressCallback& Progress;
  LowNoiseFit Result;
  bool Even;              ///< all samples count the same
  double Total = 0.0;     ///< of the weights
  HarmonicRows Filled;    ///< the points, with what does not count replaced
  Eigen::MatrixXd Design; ///< a row of harmonics a knot
};
}

#endif
