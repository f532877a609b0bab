#include "AortaMotion.h"

#include "CubicStep.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double FurthestOstium = 15.0; // mm from the aorta's wall: another one is a graft's
}

double PlaceAlong(const std::vector<Vector3>& line, const Vector3& point)
{
  double nearest = std::numeric_limits<double>::infinity();
  double along = 0.0;
  double found = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i)
  {
    const double length = (line[i] - line[i - 1]).norm();
    const SegmentPlace place = NearestOnSegment(point, line[i - 1], line[i]);
    if (place.squaredDistance < nearest)
    {
      nearest = place.squaredDistance;
      found = along + place.fraction * length;
    }
    along += length;
  }
  return found;
}

AortaMotion::AortaMotion(const WallTopology& topology)
  : AortaMotion(topology, topology.aorta ? topology.aorta->points : std::vector<Vector3>())
{
}

AortaMotion::AortaMotion(const WallTopology& topology, std::vector<Vector3> points)
  : Rest(std::move(points))
{
  if (!topology.aorta || topology.aorta->axis.size() < 2)
  {
    throw std::invalid_argument("there is no aorta");
  }
  const AortaAtRest& aorta = *topology.aorta;
  double highest = 0.0;
  std::int64_t first = 0;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    const std::vector<Vector3>& axis = topology.axis[b];
    const bool root = b >= topology.parent.size() || topology.parent[b] < 0;
    double away = std::numeric_limits<double>::infinity();
    for (const Vector3& point : aorta.points)
    {
      away = root ? std::min(away, (point - axis.front()).norm()) : away;
    }
    if (away < FurthestOstium)
    {
      this->Ostia.push_back({ first, axis.front(), {} });
      highest = std::max(highest, PlaceAlong(aorta.axis, axis.front()));
    }
    first += static_cast<std::int64_t>(axis.size());
  }
  if (this->Ostia.empty())
  {
    throw std::invalid_argument("no coronary artery begins within 15 mm of the aorta's wall");
  }
  for (const Vector3& point : this->Rest)
  {
    const double above = PlaceAlong(aorta.axis, point) - highest - RootAbove;
    const double moves = 1.0 - CubicStep(above / FadesOver);
    double sum = 0.0;
    const auto weight = [&](const Ostium& ostium)
    { return 1.0 / (25.0 + (point - ostium.rest).squaredNorm()); };
    for (const Ostium& ostium : this->Ostia)
    {
      sum += weight(ostium);
    }
    for (Ostium& ostium : this->Ostia)
    {
      ostium.share.push_back(static_cast<float>(moves * weight(ostium) / sum));
    }
  }
}

void AortaMotion::Positions(const std::vector<Vector3>& axis, std::vector<Vector3>& points) const
{
  points = this->Rest;
  for (const Ostium& ostium : this->Ostia)
  {
    const Vector3 moved = axis[ostium.point] - ostium.rest;
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      points[i] += static_cast<double>(ostium.share[i]) * moved;
    }
  }
}
}
