#include "Polylines.h"

#include "Require.h"

#include <cmath>
#include <string>

namespace coronary
{
void CheckPolylines(const Polylines& lines)
{
  const auto points = static_cast<std::int64_t>(lines.points.size());
  for (const Vector3& point : lines.points)
  {
    Require(point.allFinite(), "A coordinate of the lines is not finite");
  }
  Require(lines.radius.empty() || lines.radius.size() == lines.points.size(),
    "The lines have " + std::to_string(lines.radius.size()) + " radii for " +
      std::to_string(lines.points.size()) + " points");
  for (const double radius : lines.radius)
  {
    Require(std::isfinite(radius) && radius >= 0.0, "A radius is negative or not finite");
  }
  for (std::size_t n = 0; n < lines.lines.size(); ++n)
  {
    Require(lines.lines[n].size() >= 2, "Line " + std::to_string(n) + " has less than two points");
    for (const std::int64_t point : lines.lines[n])
    {
      Require(point >= 0 && point < points,
        "Line " + std::to_string(n) + " has a point that does not exist");
    }
  }
}
}
