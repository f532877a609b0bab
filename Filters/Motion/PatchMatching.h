/**
 * @file PatchMatching.h
 * @brief What of an image around a node is found again in another image.
 */
#ifndef DynamicCoronary_PatchMatching_h
#define DynamicCoronary_PatchMatching_h

#include "Geometry.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <vector>

namespace coronary
{
/// Places of a sphere around a node, on a lattice, with weights that fall off outwards.
struct Patch
{
  std::vector<std::array<int, 3>> places;
  std::vector<float> weights;
  int reach = 0;
  double step = 1.0;

  /// From the node, mm.
  Vector3 Offset(std::size_t p) const
  {
    return this->step * Vector3(this->places[p][0], this->places[p][1], this->places[p][2]);
  }

  /// @param radius, spacing  mm
  Patch(double radius, double spacing);
};

/// Weighted mean squared difference of `wanted` and the block, for every shift of the lattice. The block is centred on the node,
/// and reaches at least as far as patch and shifts together.
void SumsOfSquares(const std::vector<float>& block, int blockSide, const Patch& patch,
  const std::vector<float>& weights, const std::vector<float>& wanted, int labelReach,
  std::vector<float>& costs);

/// What the sums of squares say, in natural logarithms: 0 for the best candidate, limited, since a
/// patch may show something that the reference does not.
void ToLikelihoods(
  std::vector<std::vector<float>>& costs, double independent, double limit, double floor);

/// Values that are limited.
struct ValueWindow
{
  float low = 0.0F;
  float high = 0.0F;
  float operator()(float value) const { return std::clamp(value, this->low, this->high); }
};

double Correlation(const std::vector<float>& a, const std::vector<float>& b);

/**
 * Mean outer products of an image's gradients, of which a part is the image's noise: what is left
 * without it. Noise has gradients along an even vessel too, which say nothing about the way along it.
 */
class SignalCurvature
{
public:
  SignalCurvature(const Matrix3& curvature, double noise)
    : Eigen(curvature)
    , Left(this->Eigen.eigenvalues().unaryExpr(
        [&](double value) { return std::max(value - noise, 0.0); }))
    , Noise(noise)
  {
  }

  /// The noise takes part in the error: l^2 / (l + noise) instead of l.
  Matrix3 Information() const
  {
    return this->Along(this->Left.unaryExpr(
      [&](double value) { return value > 0.0 ? value * value / (value + this->Noise) : 0.0; }));
  }

  Vector3 Solve(const Vector3& pull) const
  {
    const double damping = 0.2 * this->Noise + 1e-3 * this->Left.sum() + 1e-3;
    return this->Along((this->Left.array() + damping).inverse()) * pull;
  }

  /// Of nodes with as many images averaged in each: the noise in one, when the third of them that has the
  /// least to be seen in some direction has nothing there but noise.
  static double NoiseOf(const std::vector<Matrix3>& curvatures, const std::vector<int>& averaged);

private:
  Matrix3 Along(const Vector3& values) const
  {
    return this->Eigen.eigenvectors() * values.asDiagonal() *
      this->Eigen.eigenvectors().transpose();
  }

  Eigen::SelfAdjointEigenSolver<Matrix3> Eigen;
  Vector3 Left;
  double Noise;
};

/// An inverse covariance after the method's own error, mm, was added.
Matrix3 Limited(const Matrix3& information, double deviation);
}

#endif
