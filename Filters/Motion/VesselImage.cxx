#include "LineImage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double UsualRadius = 1.5; ///< mm, of lines without radii
constexpr double MostVoxels = 64e6;
}

LineImage RenderLines(const MovingLines& lines, double spacing, double margin)
{
  CheckMovingLines(lines);
  if (lines.lines.empty())
  {
    throw std::invalid_argument("There are no lines");
  }
  if (!(spacing > 0.0) || !(margin >= 0.0))
  {
    throw std::invalid_argument("RenderLines: spacing must be positive, and margin not negative");
  }
  const auto radiusOf = [&](std::int64_t point)
  { return lines.radius.empty() ? UsualRadius : lines.radius[point]; };
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    for (const std::int64_t point : line)
    {
      const Vector3 reach = Vector3::Constant(radiusOf(point) + margin);
      low = low.cwiseMin(lines.rest[point] - reach);
      high = high.cwiseMax(lines.rest[point] + reach);
    }
  }
  const double size = std::max((high - low).prod(), 0.0);
  const double step = std::max(spacing, std::cbrt(size / MostVoxels));
  LineImage image;
  image.grid.origin = low;
  image.grid.spacing = Vector3::Constant(step);
  std::int64_t count[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    count[axis] = static_cast<std::int64_t>((high[axis] - low[axis]) / step) + 2;
    image.grid.extent[2 * axis] = 0;
    image.grid.extent[2 * axis + 1] = static_cast<int>(count[axis]) - 1;
  }
  image.values.assign(static_cast<std::size_t>(count[0] * count[1] * count[2]), 0.0F);
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    for (std::size_t n = 0; n + 1 < line.size(); ++n)
    {
      const Vector3& a = lines.rest[line[n]];
      const Vector3& b = lines.rest[line[n + 1]];
      const Vector3 way = b - a;
      const double radius = std::max(radiusOf(line[n]), radiusOf(line[n + 1]));
      int first[3];
      int last[3];
      for (int axis = 0; axis < 3; ++axis)
      {
        const double from = (std::min(a[axis], b[axis]) - radius - 2.0 * step - low[axis]) / step;
        const double to = (std::max(a[axis], b[axis]) + radius + 2.0 * step - low[axis]) / step;
        first[axis] = std::max(static_cast<int>(from), 0);
        last[axis] = std::min(static_cast<int>(to) + 1, image.grid.extent[2 * axis + 1]);
      }
      for (int k = first[2]; k <= last[2]; ++k)
      {
        for (int j = first[1]; j <= last[1]; ++j)
        {
          for (int i = first[0]; i <= last[0]; ++i)
          {
            const Vector3 from = low + step * Vector3(i, j, k) - a;
            const double at =
              std::clamp(from.dot(way) / std::max(way.squaredNorm(), 1e-12), 0.0, 1.0);
            const double wall = (1.0 - at) * radiusOf(line[n]) + at * radiusOf(line[n + 1]) -
              (from - at * way).norm();
            float& value = image.values[(k * count[1] + j) * count[0] + i];
            value =
              std::max(value, static_cast<float>(std::clamp(0.5 + 0.5 * wall / step, 0.0, 1.0)));
          }
        }
      }
    }
  }
  return image;
}
}
