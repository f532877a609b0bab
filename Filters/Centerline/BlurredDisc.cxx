#include "BlurredDisc.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace coronary
{
namespace
{
constexpr double Step = 0.1;
constexpr double MaximumRadius = 8.0;
constexpr double MaximumDistance = 12.0;
constexpr int RadiusCount = 81;
constexpr int DistanceCount = 121;

/// exp(-x) times the modified Bessel function I0.
double ScaledBessel(double x)
{
  if (x < 30.0)
  {
    // The series, from the first term on: no cancellation, all terms are positive.
    double term = 1.0;
    double sum = 1.0;
    for (int k = 1; k < 80; ++k)
    {
      term *= 0.25 * x * x / (static_cast<double>(k) * k);
      sum += term;
      if (term < 1e-12 * sum)
      {
        break;
      }
    }
    return sum * std::exp(-x);
  }
  return (1.0 + 0.125 / x + 0.0703125 / (x * x)) / std::sqrt(2.0 * M_PI * x);
}

double CentreOf(double radius)
{
  return -std::expm1(-0.5 * radius * radius);
}

double Integrate(double distance, double radius)
{
  constexpr int pieces = 96;
  double sum = 0.0;
  for (int i = 0; i < pieces; ++i)
  {
    const double r = radius * (i + 0.5) / pieces;
    sum += r * std::exp(-0.5 * (distance - r) * (distance - r)) * ScaledBessel(distance * r);
  }
  return sum * radius / pieces;
}

/// Relative to the disc's centre, so that discs that are next to nothing have a shape, too.
const std::vector<float>& Shapes()
{
  static const std::vector<float> table = []
  {
    std::vector<float> values(static_cast<std::size_t>(RadiusCount) * DistanceCount);
    for (int r = 0; r < RadiusCount; ++r)
    {
      const double radius = std::max(0.02, Step * r);
      for (int d = 0; d < DistanceCount; ++d)
      {
        values[static_cast<std::size_t>(r) * DistanceCount + d] =
          static_cast<float>(Integrate(Step * d, radius) / CentreOf(radius));
      }
    }
    return values;
  }();
  return table;
}
}

BlurredProfile::BlurredProfile(double radius)
  : Radius(radius)
{
  if (radius > 0.0 && radius < MaximumRadius - Step)
  {
    const double r = radius / Step;
    const int i = static_cast<int>(r);
    this->Share = r - i;
    this->Shape = Shapes().data() + static_cast<std::size_t>(i) * DistanceCount;
    this->Centre = CentreOf(radius);
  }
}

double BlurredProfile::At(double distance) const
{
  if (this->Radius <= 0.0)
  {
    return 0.0;
  }
  if (!this->Shape)
  {
    // Nearly straight: blurring moves the edge inwards by half the curvature.
    const double inwards = 0.5 / std::max(distance, 0.5 * this->Radius);
    return 0.5 * std::erfc((distance + inwards - this->Radius) / std::sqrt(2.0));
  }
  if (distance >= MaximumDistance - Step)
  {
    return 0.0;
  }
  const double d = distance / Step;
  const int j = static_cast<int>(d);
  const double f = this->Share;
  const double g = d - j;
  const float* table = this->Shape + j;
  const double shape = (1.0 - f) * ((1.0 - g) * table[0] + g * table[1]) +
    f * ((1.0 - g) * table[DistanceCount] + g * table[DistanceCount + 1]);
  return this->Centre * shape;
}

double BlurredDisc(double distance, double radius)
{
  return BlurredProfile(radius).At(distance);
}

double BlurredBallCentre(double radius)
{
  return std::erf(radius / std::sqrt(2.0)) -
    std::sqrt(2.0 / M_PI) * radius * std::exp(-0.5 * radius * radius);
}

double BallHalfMaximum(double radius)
{
  // A point's, from where on the closed form loses its digits.
  if (radius < 0.05)
  {
    return std::sqrt(2.0 * std::log(2.0));
  }
  const auto profile = [&](double d)
  {
    const double root = std::sqrt(2.0);
    return 0.5 * (std::erf((radius + d) / root) + std::erf((radius - d) / root)) -
      (std::exp(-0.5 * (radius - d) * (radius - d)) -
        std::exp(-0.5 * (radius + d) * (radius + d))) /
      (d * std::sqrt(2.0 * M_PI));
  };
  const double half = 0.5 * BlurredBallCentre(radius);
  double low = 0.1;
  double high = radius + 3.0;
  for (int round = 0; round < 50; ++round)
  {
    const double d = 0.5 * (low + high);
    (profile(d) > half ? low : high) = d;
  }
  return 0.5 * (low + high);
}
}
