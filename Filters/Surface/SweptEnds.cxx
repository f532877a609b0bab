#include "SweptEnds.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace coronary
{
namespace
{
/// Radius times curvature beyond which an end is mended, and what it may have afterwards.
constexpr double FoldingBend = 0.95;
constexpr double FitBend = 0.6;
/// The same of the radius's change per length of the wall on the inner side of the bend.
constexpr double FoldingSlope = 2.0;
constexpr double FitSlope = 0.5;
/// What lies so many radii from the end can not be cut off as a fold of its own.
constexpr double EndReach = 1.6;

double BendOf(const VesselAxis::Station& station, double radius)
{
  return station.curvature.norm() * radius;
}

double SlopeOf(const VesselAxis::Station& station)
{
  return std::abs(station.slope) / std::max(0.05, 1.0 - BendOf(station, station.radius));
}

std::string Millimetres(double length)
{
  std::ostringstream text;
  text.precision(2);
  text << length << " mm";
  return text.str();
}
}

std::string MendEnd(SweptAxis& course, const VesselAxis& axis, bool atStart, Vector3& place)
{
  const std::vector<VesselAxis::Station>& stations = axis.AllStations();
  const double length = axis.Length();
  const int n = static_cast<int>(stations.size());
  const auto at = [&](int i) -> const VesselAxis::Station&
  { return stations[atStart ? i : n - 1 - i]; };
  const auto away = [&](int i) { return atStart ? at(i).s : length - at(i).s; };
  const auto folds = [&](int i)
  { return BendOf(at(i), at(i).radius) > FoldingBend || SlopeOf(at(i)) > FoldingSlope; };
  int last = -1;
  for (int i = 0; i < n && away(i) <= 0.5 * length; ++i)
  {
    // A fold that begins at the end goes on as long as it folds.
    if (folds(i) && (away(i) < EndReach * at(i).radius || last == i - 1))
    {
      last = i;
    }
  }
  if (last < 0)
  {
    return "";
  }
  int sound = last + 1;
  while (sound + 1 < n && away(sound) < 0.5 * length &&
    (folds(sound) || away(sound) < away(last) + 0.3 * at(sound).radius))
  {
    ++sound;
  }
  const VesselAxis::Station& anchor = at(std::min(sound, n - 1));
  const double zone = atStart ? anchor.s : length - anchor.s;
  place = at(0).point;
  const Vector3 outward = atStart ? Vector3(-anchor.tangent) : anchor.tangent;

  // Distances of the points from the end, along the points.
  const int count = static_cast<int>(course.points.size());
  const auto index = [&](int i) { return atStart ? i : count - 1 - i; };
  std::vector<double> along(count, 0.0);
  for (int i = 1; i < count; ++i)
  {
    along[i] = along[i - 1] + (course.points[index(i)] - course.points[index(i - 1)]).norm();
  }
  int inside = 0; // points in the zone
  while (inside + 2 < count && along[inside] < zone)
  {
    ++inside;
  }
  double bend = 0.0;
  for (int i = 0; i <= std::min(sound, n - 1); ++i)
  {
    const double most = anchor.radius + FitSlope * (zone - away(i));
    bend = std::max(bend, BendOf(at(i), std::min(at(i).radius, most)));
  }
  const auto limitRadius = [&]()
  {
    for (int i = 0; i < inside; ++i)
    {
      double& radius = course.radius[index(i)];
      const double room = FitSlope * std::max(0.0, zone - along[i]);
      radius = std::clamp(
        radius, std::max(0.5 * anchor.radius, anchor.radius - room), anchor.radius + room);
    }
  };
  if (bend <= FitBend)
  {
    limitRadius();
    return "its radius changes too fast towards its end; limited over the last " +
      Millimetres(zone);
  }
  limitRadius();
  for (int i = 0; i < inside; ++i)
  {
    course.points[index(i)] = anchor.point + std::max(0.0, zone - along[i]) * outward;
  }
  return "its end bends more sharply than the vessel is wide; the last " + Millimetres(zone) +
    " are laid straight";
}
}
