/**
 * @file SmoothRandomField.h
 * @brief A stationary Gaussian random field in space, infinitely often differentiable.
 */
#ifndef DynamicCoronary_SmoothRandomField_h
#define DynamicCoronary_SmoothRandomField_h

#include "Geometry.h"

namespace coronary
{
/**
 * Sum of random plane waves whose wave vectors are normal with standard deviation 1/length: the
 * covariance tends to exp(-d^2 / (2 length^2)) as the number of waves grows.
 * Source: Rahimi, Recht, "Random features for large-scale kernel machines", NIPS 2007, Eq. 2.
 */
class SmoothRandomField
{
public:
  /// Zero everywhere.
  SmoothRandomField() = default;

  /**
   * @param seed, purpose  which field of the family
   * @param length         correlation length in mm, positive
   * @param waves          number of plane waves
   */
  SmoothRandomField(std::uint64_t seed, std::uint64_t purpose, double length, int waves = 48);

  /// Mean 0, standard deviation 1 over all seeds; dimensionless.
  double operator()(const Vector3& position) const;

private:
  std::vector<Eigen::Vector4d> Waves; ///< wave vector in rad/mm, and phase
  double Amplitude = 0.0;
};
}

#endif
