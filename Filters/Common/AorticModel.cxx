#include "AorticModel.h"

#include "CubicStep.h"
#include "Median.h"
#include "Numbers.h"
#include "Require.h"

#include <cmath>
#include <cstddef>

namespace coronary
{
namespace
{
Vector3 AreaOf(const AorticRing& ring)
{
  Vector3 sum = Vector3::Zero();
  const std::size_t count = ring.rim.size();
  for (std::size_t n = 0; n < count; ++n)
  {
    sum += 0.5 * (ring.rim[n] - ring.centre).cross(ring.rim[(n + 1) % count] - ring.centre);
  }
  return sum;
}

/// Rings around a course, the first of which is the last seen one: its shape fades into circles.
std::vector<AorticRing> RingsAround(const AorticCourse& course, const AorticRing& last)
{
  constexpr double fade = 25.0; // mm
  std::vector<AorticRing> rings;
  const Vector3 direction = course.stations.front().direction;
  const double radius = course.stations.front().radius;
  std::vector<Vector3> offsets;
  for (const Vector3& p : last.rim)
  {
    offsets.push_back((p - last.centre) / radius);
  }
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  for (std::size_t n = 1; n < course.stations.size(); ++n)
  {
    const AorticCourse::Station& station = course.stations[n];
    const Vector3& before = course.stations[n - 1].direction;
    const Vector3 about = before.cross(station.direction);
    const double sine = about.norm();
    if (sine > 0.0)
    {
      turn =
        Eigen::AngleAxisd(std::atan2(sine, before.dot(station.direction)), about / sine) * turn;
    }
    const double own = 1.0 - CubicStep(station.length / fade);
    AorticRing ring;
    ring.centre = station.position;
    for (const Vector3& offset : offsets)
    {
      const double along = offset.dot(direction);
      const Vector3 across = offset - along * direction;
      const double length = 1.0 + own * (across.norm() - 1.0);
      ring.rim.push_back(station.position +
        station.radius * (turn * (own * along * direction + length * across.normalized())));
    }
    // A polygon has a little less than the circle's area.
    const double scale = station.radius / RadiusOf(ring);
    for (Vector3& p : ring.rim)
    {
      p = ring.centre + scale * (p - ring.centre);
    }
    rings.push_back(std::move(ring));
  }
  return rings;
}

/// A flat lid of rings that shrink to a point. @param outwards  whether it looks along the rings' order
void AddCap(AorticModel& model, std::int64_t first, std::int64_t count, bool outwards)
{
  constexpr int steps = 6;
  const auto add = [&](std::int64_t a, std::int64_t b, std::int64_t c) {
    model.triangles.push_back(outwards ? Triangle{ a, b, c } : Triangle{ a, c, b });
  };
  Vector3 centre = Vector3::Zero();
  for (std::int64_t n = 0; n < count; ++n)
  {
    centre += model.points[first + n] / static_cast<double>(count);
  }
  std::int64_t outer = first;
  for (int step = 1; step < steps; ++step)
  {
    const auto inner = static_cast<std::int64_t>(model.points.size());
    const double share = 1.0 - static_cast<double>(step) / steps;
    for (std::int64_t n = 0; n < count; ++n)
    {
      model.points.push_back(centre + share * (model.points[first + n] - centre));
    }
    for (std::int64_t n = 0; n < count; ++n)
    {
      const std::int64_t next = (n + 1) % count;
      add(outer + n, outer + next, inner + n);
      add(outer + next, inner + next, inner + n);
    }
    outer = inner;
  }
  const auto middle = static_cast<std::int64_t>(model.points.size());
  model.points.push_back(centre);
  for (std::int64_t n = 0; n < count; ++n)
  {
    add(outer + n, outer + (n + 1) % count, middle);
  }
  model.measured.resize(model.points.size(), 0);
}

AorticEnd EndOf(const std::vector<AorticRing>& seen, AorticModel& model)
{
  AorticEnd end;
  const AorticRing& last = seen.back();
  end.position = last.centre;
  end.direction = AreaOf(last).normalized();
  end.radius = RadiusOf(last);
  end.valveHeight = seen.front().centre[2];
  for (std::size_t n = 1; n < seen.size(); ++n)
  {
    model.measuredLength += (seen[n].centre - seen[n - 1].centre).norm();
  }
  end.length = model.measuredLength;
  constexpr double span = 20.0; // mm, above the sinuses where the image goes that far
  std::vector<double> radii;
  double back = 0.0;
  for (std::size_t n = seen.size(); n-- > 0 && back <= span;)
  {
    radii.push_back(RadiusOf(seen[n]));
    back += n > 0 ? (seen[n].centre - seen[n - 1].centre).norm() : 0.0;
  }
  model.ascendingRadius = MedianOf(radii);
  end.ascendingRadius = model.ascendingRadius;
  return end;
}
}

double RadiusOf(const AorticRing& ring)
{
  return std::sqrt(AreaOf(ring).norm() / Pi);
}

AorticModel ModelAorta(const std::vector<AorticRing>& seen, const AorticArchSettings& settings)
{
  Require(seen.size() >= 3, "an aorta needs three cross-sections");
  const std::size_t count = seen.front().rim.size();
  Require(count >= 8, "a cross-section of the aorta needs eight points");
  for (std::size_t n = 0; n < seen.size(); ++n)
  {
    Require(seen[n].rim.size() == count, "the aorta's cross-sections differ in their points");
    Require(RadiusOf(seen[n]) > 0.0, "a cross-section of the aorta has no area");
    Require(n == 0 || (seen[n].centre - seen[n - 1].centre).dot(AreaOf(seen[n])) > 0.0,
      "the aorta's cross-sections are not in order");
  }
  AorticModel model;
  const AorticEnd end = EndOf(seen, model);
  AorticCourse course = CompleteAorta(end, settings);
  model.towardsSeen = settings.descending && course.reached;
  if (settings.descending && !course.reached)
  {
    AorticArchSettings usual = settings;
    usual.descending.reset();
    course = CompleteAorta(end, usual);
  }
  model.ascending = course.ascending;
  model.arch = course.arch;
  model.descending = course.descending;
  std::vector<AorticRing> rings = seen;
  for (AorticRing& ring : RingsAround(course, seen.back()))
  {
    rings.push_back(std::move(ring));
  }
  const auto around = static_cast<std::int64_t>(count);
  for (std::size_t n = 0; n < rings.size(); ++n)
  {
    const unsigned char measured = n < seen.size() ? 1 : 0;
    model.axis.push_back(rings[n].centre);
    model.radius.push_back(RadiusOf(rings[n]));
    model.axisMeasured.push_back(measured);
    model.points.insert(model.points.end(), rings[n].rim.begin(), rings[n].rim.end());
    model.measured.insert(model.measured.end(), count, measured);
    const auto here = static_cast<std::int64_t>(n) * around;
    for (std::int64_t p = 0; n > 0 && p < around; ++p)
    {
      const std::int64_t next = (p + 1) % around;
      model.triangles.push_back({ here - around + p, here - around + next, here + p });
      model.triangles.push_back({ here - around + next, here + next, here + p });
    }
  }
  AddCap(model, 0, around, false);
  AddCap(model, static_cast<std::int64_t>(rings.size() - 1) * around, around, true);
  return model;
}
}
