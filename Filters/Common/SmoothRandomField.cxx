#include "SmoothRandomField.h"

#include "CounterRandom.h"

#include <cmath>
#include <stdexcept>

namespace coronary
{
SmoothRandomField::SmoothRandomField(
  std::uint64_t seed, std::uint64_t purpose, double length, int waves)
{
  if (!(length > 0.0) || waves < 1)
  {
    throw std::invalid_argument("SmoothRandomField: length and waves must be positive");
  }
  RandomStream random(seed, purpose);
  this->Waves.reserve(waves);
  for (int w = 0; w < waves; ++w)
  {
    Eigen::Vector4d wave;
    for (int axis = 0; axis < 3; ++axis)
    {
      wave[axis] = random.Normal() / length;
    }
    wave[3] = random.Uniform(0.0, 6.283185307179586477);
    this->Waves.push_back(wave);
  }
  this->Amplitude = std::sqrt(2.0 / waves);
}

double SmoothRandomField::operator()(const Vector3& position) const
{
  double sum = 0.0;
  for (const Eigen::Vector4d& wave : this->Waves)
  {
    sum += std::cos(wave.head<3>().dot(position) + wave[3]);
  }
  return this->Amplitude * sum;
}
}
