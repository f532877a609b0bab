/**
 * @file FunctionImage.h
 * @brief Images of functions of the world, curves, and widths in pictures of them.
 */
#ifndef DynamicCoronary_Testing_FunctionImage_h
#define DynamicCoronary_Testing_FunctionImage_h

#include "ScalarImage.h"
#include "StraightenedView.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace coronary
{
/// An image of a function of the world, oblique on demand.
struct Scene
{
  std::vector<float> voxels;
  ScalarImage image;

  Scene(const std::function<double(const Vector3&)>& value, int size, double spacing,
    const Matrix3& direction = Matrix3::Identity())
  {
    image.grid.extent = { 0, size - 1, 0, size - 1, 0, size - 1 };
    image.grid.spacing = Vector3::Constant(spacing);
    image.grid.direction = direction;
    image.grid.origin = -0.5 * spacing * (size - 1) * (direction * Vector3::Ones());
    for (int k = 0; k < size; ++k)
    {
      for (int j = 0; j < size; ++j)
      {
        for (int i = 0; i < size; ++i)
        {
          voxels.push_back(static_cast<float>(value(image.grid.IndexToWorld(i, j, k))));
        }
      }
    }
    image.values = static_cast<const float*>(voxels.data());
  }
};

inline std::vector<Vector3> Curve(
  const std::function<Vector3(double)>& at, double begin, double end, int count)
{
  std::vector<Vector3> points;
  for (int n = 0; n < count; ++n)
  {
    points.push_back(at(begin + (end - begin) * n / (count - 1)));
  }
  return points;
}

/// Width of the part of a column that is at least so bright, mm; between pixels linear.
inline double WidthAt(const GreyPicture& cut, int x, double level, double step)
{
  double width = 0.0;
  for (int y = 1; y < cut.height; ++y)
  {
    const double a = cut.At(x, y - 1) - level;
    const double b = cut.At(x, y) - level;
    width += step *
      (a >= 0 && b >= 0    ? 1.0
          : a < 0 && b < 0 ? 0.0
                           : std::max(a, b) / std::abs(a - b));
  }
  return width;
}
}

#endif
