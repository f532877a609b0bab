#include "StentResult.h"

#include "Numbers.h"

#include <algorithm>

namespace coronary
{
namespace
{
template <typename Value>
const StentRingResult* LeastOf(const std::vector<StentRingResult>& rings, const Value& value)
{
  const auto least = std::min_element(rings.begin(), rings.end(),
    [&](const StentRingResult& a, const StentRingResult& b) { return value(a) < value(b); });
  return least == rings.end() ? nullptr : &*least;
}
}

double StentRingResult::Area() const
{
  return 0.25 * Pi * this->diameter * this->diameter;
}

const StentRingResult* StentResult::Narrowest() const
{
  return LeastOf(this->rings, [](const StentRingResult& ring) { return ring.diameter; });
}

const StentRingResult* StentResult::LeastExpanded() const
{
  return LeastOf(this->rings, [](const StentRingResult& ring) { return ring.Expansion(); });
}

const StentRingResult* StentResult::GreatestGap() const
{
  return LeastOf(this->rings, [](const StentRingResult& ring) { return -ring.gap; });
}

StentResult MeasureStent(const PlacedStent& stent, const DilatableWall& wall)
{
  StentResult result;
  result.name = stent.name;
  result.beyond = stent.beyond;
  double mean = 0.0;
  const std::size_t count = stent.points.size();
  for (std::size_t n = 0; n < count; ++n)
  {
    const std::int64_t point = stent.points[n];
    StentRingResult ring;
    ring.point = point;
    ring.place = stent.places[n];
    ring.diameter = 2.0 * wall.Rings(point)[stent.rings[n]].radius;
    ring.lumen = 2.0 * wall.Radii()[point];
    ring.reference = 2.0 * wall.Stations()[point].reference;
    ring.gap = wall.Gap(point);
    mean += ring.diameter / static_cast<double>(count);
    result.residual = std::max(result.residual, 1.0 - ring.lumen / ring.reference);
    if (ring.gap > StentResult::GapTold)
    {
      const double before = n > 0 ? stent.places[n - 1] : stent.places[n];
      const double behind = n + 1 < count ? stent.places[n + 1] : stent.places[n];
      result.malapposed += 0.5 * (behind - before);
    }
    result.rings.push_back(ring);
  }
  const double half = 0.5 * stent.design.LengthAt(mean);
  result.from = stent.middle - half;
  result.to = stent.middle + half;
  return result;
}
}
