#include "LumenVolume.h"

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace coronary
{
double LumenVolume(const std::vector<Vector3>& points, const std::vector<double>& radii)
{
  if (radii.size() != points.size())
  {
    throw std::invalid_argument("LumenVolume: " + std::to_string(radii.size()) + " radii for " +
      std::to_string(points.size()) + " points");
  }
  for (std::size_t i = 0; i < radii.size(); ++i)
  {
    if (!std::isfinite(radii[i]) || radii[i] < 0.0)
    {
      throw std::invalid_argument("LumenVolume: the radius at point " + std::to_string(i) + " is " +
        std::to_string(radii[i]) + "; it must be 0 or more");
    }
  }
  double volume = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i)
  {
    const double r = radii[i - 1];
    const double s = radii[i];
    volume += M_PI / 3.0 * (points[i] - points[i - 1]).norm() * (r * r + r * s + s * s);
  }
  return volume;
}
}
