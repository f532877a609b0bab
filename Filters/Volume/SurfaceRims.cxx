#include "SurfaceRims.h"

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace coronary
{
namespace
{
constexpr double endSlope = 0.7;     ///< of the wall's normals along a rim's: steeper is a hole
constexpr double endRoundness = 0.3; ///< area in the rim over that of its mean radius' circle
constexpr double endFlatness = 0.5;  ///< distance to the plane, in radii
constexpr double flattened = 0.25;   ///< the same; up to here the rim is moved into the plane
constexpr double radiusRatio = 2.5;  ///< of two rims that may be joined

void Measure(const SurfaceCells& surface, SurfaceRim& rim)
{
  const std::size_t n = rim.points.size();
  for (const std::int64_t point : rim.points)
  {
    rim.centre += surface.At(point) / static_cast<double>(n);
  }
  Vector3 area = Vector3::Zero();
  for (std::size_t i = 0; i < n; ++i)
  {
    area += AreaVector(rim.centre, surface.At(rim.points[i]), surface.At(rim.points[(i + 1) % n]));
    rim.radius += (surface.At(rim.points[i]) - rim.centre).norm() / static_cast<double>(n);
  }
  rim.normal = area.norm() > 0.0 ? Vector3(area.normalized()) : Vector3::UnitZ();
  double slope = 0.0;
  for (std::size_t i = 0; i < n; ++i)
  {
    rim.flatness =
      std::max(rim.flatness, std::abs((surface.At(rim.points[i]) - rim.centre).dot(rim.normal)));
    const Vector3 normal = surface.Area(surface.cells[rim.cells[i]]);
    slope +=
      std::abs(normal.dot(rim.normal)) / std::max(normal.norm(), 1e-300) / static_cast<double>(n);
  }
  rim.end = n >= 5 && slope < endSlope &&
    area.norm() > endRoundness * M_PI * rim.radius * rim.radius &&
    rim.flatness < endFlatness * rim.radius;
}

/// Mean distance of one rim's points to the nearest of the other's.
double Gap(const SurfaceCells& surface, const SurfaceRim& one, const SurfaceRim& other)
{
  double sum = 0.0;
  for (const std::int64_t p : one.points)
  {
    double minimum = std::numeric_limits<double>::infinity();
    for (const std::int64_t q : other.points)
    {
      minimum = std::min(minimum, (surface.At(p) - surface.At(q)).squaredNorm());
    }
    sum += std::sqrt(minimum);
  }
  return sum / static_cast<double>(one.points.size());
}

class RimCloser
{
public:
  RimCloser(
    SurfaceCells& surface, const SurfaceCleaningSettings& settings, const std::vector<char>& kinds)
    : Surface(surface)
    , Settings(settings)
    , Kinds(kinds)
  {
  }

  ClosedRims Run(const std::vector<std::int64_t>& zoneOf)
  {
    this->Rims = FindRims(this->Surface);
    if (this->Rims.empty())
    {
      return {};
    }
    std::int64_t count = 0;
    const std::vector<std::int64_t> component = this->Surface.Components(count);
    for (SurfaceRim& rim : this->Rims)
    {
      rim.component = component[rim.cells[0]];
      for (const std::int64_t point : rim.points)
      {
        if (point < static_cast<std::int64_t>(zoneOf.size()) && zoneOf[point] >= 0)
        {
          rim.zone = zoneOf[point];
        }
      }
    }
    this->Sizes = this->Surface.MeanEdges();
    for (const SurfaceCell& cell : this->Surface.cells)
    {
      for (int i = 0; i < 3; ++i)
      {
        this->Edges.insert(std::minmax(cell.corners[i], cell.corners[(i + 1) % 3]));
      }
    }
    this->Done.assign(this->Rims.size(), 0);
    this->JoinRims();
    const bool first = zoneOf.empty();
    for (std::size_t i = 0; i < this->Rims.size(); ++i)
    {
      // A gap that a repair left is an end only where a cap was taken away.
      SurfaceRim& rim = this->Rims[i];
      rim.end = rim.end && (first || (rim.zone >= 0 && (this->Kinds[rim.zone] & cappedZone) != 0));
      const bool end = rim.end;
      if (this->Done[i] != 0 ||
        (first && (end ? !this->Settings.capEnds : !this->Settings.fillHoles)) ||
        rim.points.size() < 3)
      {
        continue;
      }
      if (end)
      {
        this->Closed.capAt = this->Closed.caps++ == 0 ? rim.centre : this->Closed.capAt;
      }
      else
      {
        this->Closed.holeAt = this->Closed.holes++ == 0 ? rim.centre : this->Closed.holeAt;
      }
      this->CloseRim(rim);
    }
    return this->Closed;
  }

private:
  void CloseRim(const SurfaceRim& rim)
  {
    if (rim.end && rim.flatness < flattened * rim.radius)
    {
      for (const std::int64_t point : rim.points)
      {
        const double height = (this->Surface.At(point) - rim.centre).dot(rim.normal);
        this->Surface.points[point] -= height * rim.normal;
      }
    }
    std::vector<Vector3> places;
    std::vector<Vector3> outside;
    std::vector<double> wanted;
    for (std::size_t i = 0; i < rim.points.size(); ++i)
    {
      places.push_back(this->Surface.At(rim.points[i]));
      wanted.push_back(this->Sizes[rim.points[i]]);
      const Vector3 normal = this->Surface.Area(this->Surface.cells[rim.cells[i]]);
      outside.emplace_back(normal / std::max(normal.norm(), 1e-300));
    }
    if (rim.end)
    {
      outside.clear();
      // A flat cap has the wall's edge length at its rim, not that of triangles stretched along it.
      for (std::size_t i = 0; i < places.size(); ++i)
      {
        const std::size_t n = places.size();
        wanted[i] = 0.5 *
          ((places[i] - places[(i + 1) % n]).norm() + (places[i] - places[(i + n - 1) % n]).norm());
      }
    }
    const ForbiddenChord forbidden = [&](std::int64_t i, std::int64_t j)
    { return this->Edges.count(std::minmax(rim.points[i], rim.points[j])) != 0; };
    SurfacePatch patch = TriangulateHole(places, outside, forbidden);
    RefinePatch(patch, wanted, forbidden);
    const std::size_t before = this->Surface.cells.size();
    this->Surface.Append(patch, rim.points, rim.end ? ++this->Surface.caps : 0, false);
    for (std::size_t c = before; c < this->Surface.cells.size(); ++c)
    {
      const Triangle& t = this->Surface.cells[c].corners;
      for (int i = 0; i < 3; ++i)
      {
        this->Edges.insert(std::minmax(t[i], t[(i + 1) % 3]));
      }
    }
  }

  /// Ends that face each other, or lie in one overlapping zone.
  void JoinRims()
  {
    struct Pair
    {
      double gap;
      std::size_t one;
      std::size_t other;
      bool operator<(const Pair& p) const
      {
        return std::tie(this->gap, this->one, this->other) < std::tie(p.gap, p.one, p.other);
      }
    };
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < this->Rims.size(); ++i)
    {
      for (std::size_t j = i + 1; j < this->Rims.size(); ++j)
      {
        const SurfaceRim& a = this->Rims[i];
        const SurfaceRim& b = this->Rims[j];
        const double small = std::min(a.radius, b.radius);
        const bool seam =
          a.zone >= 0 && a.zone == b.zone && (this->Kinds[a.zone] & overlappingZone) != 0;
        if (std::min(a.points.size(), b.points.size()) < 3 ||
          (a.centre - b.centre).norm() >
            (1.0 + this->Settings.joinDistance) * std::max(a.radius, b.radius) ||
          std::max(a.radius, b.radius) > radiusRatio * small)
        {
          continue;
        }
        // The two ends of a short tube look away from each other.
        const bool away = a.component == b.component &&
          std::min((b.centre - a.centre).dot(a.normal), (a.centre - b.centre).dot(b.normal)) <
            -0.1 * small;
        const bool facing = (a.end || b.end) && a.normal.dot(b.normal) < -0.3 && !away;
        if (!seam && (!facing || this->Settings.joinDistance == 0.0))
        {
          continue;
        }
        const double gap = std::max(Gap(this->Surface, a, b), Gap(this->Surface, b, a));
        if (gap < (seam ? 2.0 : this->Settings.joinDistance) * small)
        {
          pairs.push_back({ gap, i, j });
        }
      }
    }
    std::sort(pairs.begin(), pairs.end());
    for (const Pair& pair : pairs)
    {
      if (this->Done[pair.one] != 0 || this->Done[pair.other] != 0)
      {
        continue;
      }
      this->Done[pair.one] = 1;
      this->Done[pair.other] = 1;
      this->Closed.joinedAt =
        this->Closed.joined++ == 0 ? this->Rims[pair.one].centre : this->Closed.joinedAt;
      std::vector<std::int64_t> points = this->Rims[pair.one].points;
      points.insert(
        points.end(), this->Rims[pair.other].points.begin(), this->Rims[pair.other].points.end());
      std::vector<Vector3> first;
      std::vector<Vector3> second;
      std::vector<double> wanted;
      for (const std::int64_t p : this->Rims[pair.one].points)
      {
        first.push_back(this->Surface.At(p));
      }
      for (const std::int64_t p : this->Rims[pair.other].points)
      {
        second.push_back(this->Surface.At(p));
      }
      for (const std::int64_t p : points)
      {
        wanted.push_back(this->Sizes[p]);
      }
      SurfacePatch patch = TriangulateBand(first, second);
      RefinePatch(patch, wanted,
        [&](std::int64_t i, std::int64_t j)
        { return this->Edges.count(std::minmax(points[i], points[j])) != 0; });
      this->Surface.Append(patch, points, 0, true);
    }
  }

  SurfaceCells& Surface;
  const SurfaceCleaningSettings& Settings;
  const std::vector<char>& Kinds;
  std::vector<SurfaceRim> Rims;
  std::vector<double> Sizes; ///< mean edge length at each point
  std::set<std::pair<std::int64_t, std::int64_t>> Edges;
  std::vector<char> Done; ///< per rim
  ClosedRims Closed;
};
}

std::vector<SurfaceRim> FindRims(const SurfaceCells& surface)
{
  const std::vector<TriangleSide> sides = surface.Sides();
  // The patch runs against the triangle at the edge.
  std::map<std::int64_t, std::pair<std::int64_t, std::int64_t>> next;
  ForEdges(sides,
    [&](std::size_t first, std::size_t size)
    {
      if (size == 1)
      {
        const TriangleSide& side = sides[first];
        next[side.rising ? side.high : side.low] = { side.rising ? side.low : side.high,
          side.triangle };
      }
    });
  std::vector<SurfaceRim> rims;
  while (!next.empty())
  {
    SurfaceRim rim;
    for (auto edge = next.begin(); edge != next.end();)
    {
      const std::int64_t to = edge->second.first;
      rim.points.push_back(edge->first);
      rim.cells.push_back(edge->second.second);
      next.erase(edge);
      edge = next.find(to);
    }
    Measure(surface, rim);
    rims.push_back(std::move(rim));
  }
  return rims;
}

ClosedRims CloseRims(SurfaceCells& surface, const SurfaceCleaningSettings& settings,
  const std::vector<char>& kinds, const std::vector<std::int64_t>& zoneOf)
{
  return RimCloser(surface, settings, kinds).Run(zoneOf);
}
}
