#include "MeshDistance.h"

#include "PartialProgress.h"
#include "SurfaceEnds.h"
#include "TriangleBvh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double NaN = SideDistance::NaN;
using Corners = std::array<std::int32_t, 3>;

// Integration.
constexpr double LeastParts = 20000.0; ///< of a surface's area
constexpr int GreatestGrid = 512;      ///< edges along a triangle's side
constexpr int ErrorSamples = 1024;
constexpr int MaximumRounds = 8;
// Branch and bound.
constexpr std::size_t PiecesAtOnce = 8192;
// Neighbours that give each other hints.
constexpr std::int64_t Chunk = 512;

void Require(bool condition, const std::string& message)
{
  if (!condition)
  {
    throw std::invalid_argument(message);
  }
}

/// A sum that depends on the order of its terms by no more than its last bits' rounding.
class Sum
{
public:
  void Add(double term)
  {
    const double next = this->Total + term;
    this->Lost += std::abs(this->Total) >= std::abs(term) ? (this->Total - next) + term
                                                          : (term - next) + this->Total;
    this->Total = next;
  }
  double Value() const { return this->Total + this->Lost; }

private:
  double Total = 0.0;
  double Lost = 0.0;
};

/// One of the two surfaces.
struct Side
{
  ComparedSurface surface;
  TriangleBvh tree;
  std::vector<std::int64_t> groups; ///< values, ascending; one entry -1 when there are none
  bool hasGroups = false;
  std::vector<std::int32_t> groupOf;    ///< of each triangle: index in groups
  std::vector<std::int32_t> pointOrder; ///< neighbours in space are mostly neighbours in it

  // To the other side, of each point.
  std::vector<double> distance;
  std::vector<TriangleBvh::Nearest> nearest;

  // To the other side, of each triangle's centroid; -1 where it was not asked for.
  std::vector<std::int32_t> centroidNearest;

  Vector3 Corner(std::int64_t triangle, int k) const
  {
    return this->surface.points[this->surface.triangles[triangle][k]];
  }
  double Area(std::int64_t triangle) const
  {
    const Vector3 a = this->Corner(triangle, 0);
    return 0.5 * (this->Corner(triangle, 1) - a).cross(this->Corner(triangle, 2) - a).norm();
  }
  std::int64_t Triangles() const
  {
    return static_cast<std::int64_t>(this->surface.triangles.size());
  }
};

void Check(const SurfaceMesh& mesh, const std::string& name)
{
  const auto points = static_cast<std::int64_t>(mesh.points.size());
  Require(!mesh.triangles.empty(), name + " has no triangles");
  Require(mesh.triangles.size() < (std::size_t(1) << 31) - 64 &&
      mesh.points.size() < (std::size_t(1) << 31) - 64,
    name + " has more than 2147483584 triangles or points");
  const auto oneEach = [&](std::size_t size, std::size_t elements, const char* what)
  {
    Require(size == 0 || size == elements,
      name + " has " + std::to_string(size) + " " + what + " for " + std::to_string(elements));
  };
  oneEach(mesh.triangleGroups.size(), mesh.triangles.size(), "groups of triangles");
  oneEach(mesh.pointGroups.size(), mesh.points.size(), "groups of points");
  oneEach(mesh.caps.size(), mesh.triangles.size(), "marks of caps");
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
  {
    for (const std::int64_t corner : mesh.triangles[i])
    {
      if (corner < 0 || corner >= points)
      {
        throw std::invalid_argument(name + ": triangle " + std::to_string(i) + " refers to point " +
          std::to_string(corner) + " of " + std::to_string(points));
      }
      if (!(mesh.points[corner].array().abs() <= 1e18).all())
      {
        throw std::invalid_argument(
          name + ": point " + std::to_string(corner) + " is not finite or beyond 1e18");
      }
    }
  }
}

/// A triangle's branch: its own, or that of most of its corners, of the first corner when all differ.
std::vector<std::int64_t> GroupsOfTriangles(const SurfaceMesh& mesh)
{
  if (!mesh.triangleGroups.empty() || mesh.pointGroups.empty())
  {
    return mesh.triangleGroups;
  }
  std::vector<std::int64_t> groups(mesh.triangles.size());
  for (std::size_t i = 0; i < groups.size(); ++i)
  {
    const Triangle& t = mesh.triangles[i];
    const std::int64_t a = mesh.pointGroups[t[0]];
    const std::int64_t b = mesh.pointGroups[t[1]];
    const std::int64_t c = mesh.pointGroups[t[2]];
    groups[i] = b == c ? b : a;
  }
  return groups;
}

void Prepare(Side& side, const SurfaceMesh& mesh, const std::vector<SurfaceEnd>* ends,
  const MeshDistanceSettings& settings, const std::string& name)
{
  side.surface = TakeSurface(mesh, ends, settings.endLength);
  Require(!side.surface.triangles.empty(),
    name + " has no triangle that is compared: all are caps or beyond an end");
  const std::vector<std::int64_t> groups = GroupsOfTriangles(mesh);
  side.hasGroups = !groups.empty();
  const std::int64_t count = side.Triangles();
  side.groupOf.assign(count, 0);
  if (side.hasGroups)
  {
    for (const std::int32_t triangle : side.surface.inputTriangle)
    {
      side.groups.push_back(groups[triangle]);
    }
    std::sort(side.groups.begin(), side.groups.end());
    side.groups.erase(std::unique(side.groups.begin(), side.groups.end()), side.groups.end());
    for (std::int64_t i = 0; i < count; ++i)
    {
      side.groupOf[i] =
        static_cast<std::int32_t>(std::lower_bound(side.groups.begin(), side.groups.end(),
                                    groups[side.surface.inputTriangle[i]]) -
          side.groups.begin());
    }
  }
  else
  {
    side.groups = { -1 };
  }
  std::vector<Triangle> triangles(count);
  for (std::int64_t i = 0; i < count; ++i)
  {
    const Corners& t = side.surface.triangles[i];
    triangles[i] = { t[0], t[1], t[2] };
  }
  side.tree = TriangleBvh(side.surface.points, triangles);
  std::vector<std::uint8_t> seen(side.surface.points.size(), 0);
  side.pointOrder.reserve(side.surface.points.size());
  for (const std::int32_t triangle : side.tree.Order())
  {
    for (const std::int32_t point : side.surface.triangles[triangle])
    {
      if (seen[point] == 0)
      {
        seen[point] = 1;
        side.pointOrder.push_back(point);
      }
    }
  }
}

/**
 * @param all  whether every distance is wanted; else those that can not be the greatest one are only known
 *             to be no greater than what is stored, and `nearest` is a triangle at that distance
 */
void MeasurePoints(Side& side, const TriangleBvh& other, bool all, const ProgressCallback& progress)
{
  const auto count = static_cast<std::int64_t>(side.surface.points.size());
  side.distance.assign(count, 0.0);
  side.nearest.resize(count);
  const auto measure = [&](std::int32_t point, std::int64_t hint)
  {
    side.nearest[point] =
      other.Closest(side.surface.points[point], std::numeric_limits<double>::infinity(), hint);
    side.distance[point] = side.nearest[point].distance;
  };
  double least = -1.0;
  // One in so many shows how great the greatest distance is at least.
  constexpr std::int64_t sampling = 16;
  if (!all)
  {
    ParallelFor(count / sampling, ReportingGrain(progress, count / sampling, Chunk),
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          const std::int32_t point = side.pointOrder[sampling * i];
          measure(
            point, i > first ? side.nearest[side.pointOrder[sampling * (i - 1)]].triangle : -1);
        }
      });
    for (std::int64_t i = 0; i < count / sampling; ++i)
    {
      least = std::max(least, side.distance[side.pointOrder[sampling * i]]);
    }
  }
  // Ranges that begin at a sample, so that what is stored does not depend on them.
  const std::int64_t ranges = (count + Chunk - 1) / Chunk;
  ParallelFor(
    ranges, 1,
    [&](std::int64_t firstRange, std::int64_t lastRange)
    {
      for (std::int64_t range = firstRange; range < lastRange; ++range)
      {
        std::int64_t hint = -1;
        for (std::int64_t i = Chunk * range; i < std::min(count, Chunk * (range + 1)); ++i)
        {
          const std::int32_t point = side.pointOrder[i];
          const bool known = !all && i % sampling == 0 && i / sampling < count / sampling;
          if (!known)
          {
            const TrianglePoint near = !all && hint >= 0
              ? other.NearestOn(hint, side.surface.points[point])
              : TrianglePoint();
            if (near.squaredDistance <= least * least && least > 0.0)
            {
              side.nearest[point].triangle = hint;
              side.distance[point] = std::sqrt(near.squaredDistance);
            }
            else
            {
              measure(point, hint);
            }
          }
          hint = side.nearest[point].triangle;
        }
      }
    },
    progress);
}

// Integrals.

/// A part of a triangle, with the distances of its corners and its centroid.
struct Part
{
  double area = 0.0; ///< 0: replaced by its quarters
  std::array<double, 3> corner{};
  double centroid = 0.0;
  std::int32_t triangle = 0;
  std::int32_t cell = 0; ///< of the grid on the triangle, or in the list of quarters

  double Mean() const
  {
    return (this->corner[0] + this->corner[1] + this->corner[2]) / 12.0 + 0.75 * this->centroid;
  }
  double MeanSquare() const
  {
    return (this->corner[0] * this->corner[0] + this->corner[1] * this->corner[1] +
             this->corner[2] * this->corner[2]) /
      12.0 +
      0.75 * this->centroid * this->centroid;
  }
  double Unevenness() const
  {
    return this->area *
      std::abs(this->centroid - (this->corner[0] + this->corner[1] + this->corner[2]) / 3.0);
  }
};

using Place = std::array<Vector3, 3>;

/// The integral of the distance over one surface.
class Integral
{
public:
  Integral(Side& side, const TriangleBvh& other)
    : From(side)
    , To(other)
  {
  }

  void Compute(double errorBound, const ProgressCallback& progress);

  const std::vector<Part>& Parts() const { return this->All; }
  double Error() const { return this->EstimatedError; }

private:
  Place PlaceOf(const Part& part) const;
  double DistanceAt(const Vector3& p, std::int64_t hint) const
  {
    return this->To.Closest(p, std::numeric_limits<double>::infinity(), hint).distance;
  }
  std::array<Part, 4> Quarters(const Part& part, std::array<Place, 4>* places) const;
  void Start(const ProgressCallback& progress);
  void Estimate();
  bool Refine();

  Side& From;
  const TriangleBvh& To;
  std::vector<Part> All;
  std::vector<std::int32_t> Grid;   ///< edges along each triangle's side
  std::vector<Place> QuarterPlaces; ///< of the parts after the first `Gridded`
  std::int64_t Gridded = 0;
  double EstimatedError = 0.0;
};

Place Integral::PlaceOf(const Part& part) const
{
  const Vector3 a = this->From.Corner(part.triangle, 0);
  const Vector3 b = this->From.Corner(part.triangle, 1);
  const Vector3 c = this->From.Corner(part.triangle, 2);
  const int edges = this->Grid[part.triangle];
  if (edges == 1)
  {
    return { a, b, c };
  }
  // Row by row, 2 (edges - row) - 1 cells in each; every other one is upside down.
  int row = 0;
  int cell = part.cell;
  for (; cell >= 2 * (edges - row) - 1; ++row)
  {
    cell -= 2 * (edges - row) - 1;
  }
  const auto at = [&](int i, int j) -> Vector3
  {
    return a + (b - a) * (static_cast<double>(i) / edges) +
      (c - a) * (static_cast<double>(j) / edges);
  };
  const int i = cell / 2;
  if (cell % 2 == 0)
  {
    return { at(i, row), at(i + 1, row), at(i, row + 1) };
  }
  return { at(i + 1, row), at(i + 1, row + 1), at(i, row + 1) };
}

void Integral::Start(const ProgressCallback& progress)
{
  const Side& side = this->From;
  const std::int64_t count = side.Triangles();
  std::vector<double> area(count);
  Sum total;
  for (std::int64_t i = 0; i < count; ++i)
  {
    area[i] = side.Area(i);
    total.Add(area[i]);
  }
  this->Grid.assign(count, 1);
  std::vector<std::int64_t> firstPart(count + 1, 0);
  for (std::int64_t i = 0; i < count; ++i)
  {
    const double parts = total.Value() > 0.0 ? LeastParts * area[i] / total.Value() : 0.0;
    this->Grid[i] = std::clamp(static_cast<int>(std::ceil(std::sqrt(parts))), 1, GreatestGrid);
    firstPart[i + 1] = firstPart[i] + static_cast<std::int64_t>(this->Grid[i]) * this->Grid[i];
  }
  this->Gridded = firstPart[count];
  this->All.resize(this->Gridded);
  const std::vector<std::int32_t>& order = side.tree.Order();
  std::vector<std::int32_t>& centroidNearest = this->From.centroidNearest;
  centroidNearest.assign(count, -1);
  ParallelFor(
    count, ReportingGrain(progress, count, 256),
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const std::int32_t triangle = order[n];
        const Corners& corners = side.surface.triangles[triangle];
        const int edges = this->Grid[triangle];
        std::int64_t hint = side.nearest[corners[0]].triangle;
        for (int cell = 0; cell < edges * edges; ++cell)
        {
          Part& part = this->All[firstPart[triangle] + cell];
          part.area = area[triangle] / (static_cast<double>(edges) * edges);
          part.triangle = triangle;
          part.cell = cell;
          const Place place = this->PlaceOf(part);
          const TriangleBvh::Nearest nearest = this->To.Closest(
            (place[0] + place[1] + place[2]) / 3.0, std::numeric_limits<double>::infinity(), hint);
          part.centroid = nearest.distance;
          if (edges == 1)
          {
            centroidNearest[triangle] = static_cast<std::int32_t>(nearest.triangle);
          }
          hint = nearest.triangle;
          for (int k = 0; k < 3; ++k)
          {
            part.corner[k] =
              edges == 1 ? side.distance[corners[k]] : this->DistanceAt(place[k], hint);
          }
        }
      }
    },
    progress);
}

std::array<Part, 4> Integral::Quarters(const Part& part, std::array<Place, 4>* places) const
{
  const Place p = part.cell < 0 ? this->QuarterPlaces[~part.cell] : this->PlaceOf(part);
  const std::array<Vector3, 3> middle = { 0.5 * (p[1] + p[2]), 0.5 * (p[2] + p[0]),
    0.5 * (p[0] + p[1]) };
  const std::array<Place, 4> quarters = { Place{ p[0], middle[2], middle[1] },
    Place{ middle[2], p[1], middle[0] }, Place{ middle[1], middle[0], p[2] },
    Place{ middle[0], middle[1], middle[2] } };
  std::int64_t hint = this->From.nearest[this->From.surface.triangles[part.triangle][0]].triangle;
  std::array<double, 3> m{};
  for (int k = 0; k < 3; ++k)
  {
    m[k] = this->DistanceAt(middle[k], hint);
  }
  std::array<Part, 4> result;
  for (int q = 0; q < 4; ++q)
  {
    result[q].area = 0.25 * part.area;
    result[q].triangle = part.triangle;
    result[q].centroid = q == 3
      ? part.centroid
      : this->DistanceAt((quarters[q][0] + quarters[q][1] + quarters[q][2]) / 3.0, hint);
  }
  result[0].corner = { part.corner[0], m[2], m[1] };
  result[1].corner = { m[2], part.corner[1], m[0] };
  result[2].corner = { m[1], m[0], part.corner[2] };
  result[3].corner = m;
  if (places != nullptr)
  {
    *places = quarters;
  }
  return result;
}

/// The error of the mean: parts at equal steps of the area are quartered.
void Integral::Estimate()
{
  Sum total;
  for (const Part& part : this->All)
  {
    total.Add(part.area);
  }
  this->EstimatedError = 0.0;
  if (!(total.Value() > 0.0))
  {
    return;
  }
  std::vector<std::size_t> chosen;
  const double step = total.Value() / ErrorSamples;
  double next = 0.5 * step;
  double passed = 0.0;
  for (std::size_t i = 0; i < this->All.size() && chosen.size() < ErrorSamples; ++i)
  {
    passed += this->All[i].area;
    for (; next < passed && chosen.size() < ErrorSamples; next += step)
    {
      chosen.push_back(i);
    }
  }
  std::vector<double> change(chosen.size());
  ParallelFor(static_cast<std::int64_t>(chosen.size()), 64,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const Part& part = this->All[chosen[n]];
        double mean = 0.0;
        for (const Part& quarter : this->Quarters(part, nullptr))
        {
          mean += 0.25 * quarter.Mean();
        }
        change[n] = mean - part.Mean();
      }
    });
  Sum sum;
  Sum squares;
  for (const double c : change)
  {
    sum.Add(c);
    squares.Add(c * c);
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, change.size()));
  const double mean = sum.Value() / count;
  const double variance = std::max(0.0, squares.Value() / count - mean * mean);
  this->EstimatedError = std::abs(mean) + 2.0 * std::sqrt(variance / count);
}

/// Quarters the quarter of the parts where the distance is least like a plane; false: none can be.
bool Integral::Refine()
{
  std::vector<std::size_t> order(this->All.size());
  std::iota(order.begin(), order.end(), 0);
  const std::size_t count = std::max<std::size_t>(1, order.size() / 4);
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count) - 1,
    order.end(),
    [&](std::size_t s, std::size_t t)
    {
      const double x = this->All[s].Unevenness();
      const double y = this->All[t].Unevenness();
      return x != y ? x > y : s < t;
    });
  order.resize(count);
  std::sort(order.begin(), order.end());
  order.erase(std::remove_if(order.begin(), order.end(),
                [&](std::size_t i) { return !(this->All[i].area > 0.0); }),
    order.end());
  const std::size_t firstNew = this->All.size();
  const std::size_t firstPlace = this->QuarterPlaces.size();
  this->All.resize(firstNew + 4 * order.size());
  this->QuarterPlaces.resize(firstPlace + 4 * order.size());
  ParallelFor(static_cast<std::int64_t>(order.size()), 64,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        std::array<Place, 4> places;
        const std::array<Part, 4> quarters = this->Quarters(this->All[order[n]], &places);
        for (int q = 0; q < 4; ++q)
        {
          const std::size_t place = firstPlace + 4 * n + q;
          this->QuarterPlaces[place] = places[q];
          this->All[firstNew + 4 * n + q] = quarters[q];
          this->All[firstNew + 4 * n + q].cell = ~static_cast<std::int32_t>(place);
        }
      }
    });
  for (const std::size_t i : order)
  {
    this->All[i].area = 0.0;
  }
  return !order.empty();
}

void Integral::Compute(double errorBound, const ProgressCallback& progress)
{
  this->Start(progress);
  this->Estimate();
  for (int round = 0; round<MaximumRounds&& this->EstimatedError> errorBound; ++round)
  {
    Report(progress, 1.0);
    if (!this->Refine())
    {
      break;
    }
    this->Estimate();
  }
}

/// Area of a triangle of area 1 on which the linear function with these values at the corners is at
/// most t.
double ShareBelow(double a, double b, double c, double t)
{
  const double low = std::min({ a, b, c });
  const double high = std::max({ a, b, c });
  if (t >= high)
  {
    return 1.0;
  }
  if (t < low)
  {
    return 0.0;
  }
  const double middle = a + b + c - low - high;
  if (t <= middle)
  {
    const double width = (high - low) * (middle - low);
    return width > 0.0 ? std::min(1.0, (t - low) * (t - low) / width) : 0.0;
  }
  const double width = (high - low) * (high - middle);
  return width > 0.0 ? 1.0 - std::min(1.0, (high - t) * (high - t) / width) : 1.0;
}

/// The distance that 95 % of the area do not exceed.
double Percentile95(std::vector<const Part*> parts)
{
  Sum total;
  double low = std::numeric_limits<double>::infinity();
  double high = 0.0;
  for (const Part* part : parts)
  {
    total.Add(part->area);
    for (const double d : { part->corner[0], part->corner[1], part->corner[2], part->centroid })
    {
      low = std::min(low, d);
      high = std::max(high, d);
    }
  }
  if (!(total.Value() > 0.0))
  {
    return NaN;
  }
  const double wanted = 0.95 * total.Value();
  const double accuracy = 1e-9 * high;
  Sum below; // area of the parts that were left behind below the interval
  while (high - low > accuracy)
  {
    const double t = 0.5 * (low + high);
    if (!(t > low) || !(t < high))
    {
      break;
    }
    double at = below.Value();
    for (const Part* part : parts)
    {
      const auto& [a, b, c] = part->corner;
      const double m = part->centroid;
      at += part->area / 3.0 *
        (ShareBelow(a, b, m, t) + ShareBelow(b, c, m, t) + ShareBelow(c, a, m, t));
    }
    (at < wanted ? low : high) = t;
    parts.erase(std::remove_if(parts.begin(), parts.end(),
                  [&](const Part* part)
                  {
                    const auto& [a, b, c] = part->corner;
                    const double least = std::min({ a, b, c, part->centroid });
                    const double greatest = std::max({ a, b, c, part->centroid });
                    if (greatest <= low)
                    {
                      below.Add(part->area);
                      return true;
                    }
                    return least > high;
                  }),
      parts.end());
  }
  return 0.5 * (low + high);
}

/// Fills the area measures from some of the parts.
void Integrate(const std::vector<const Part*>& parts, SideDistance& result)
{
  Sum area;
  Sum mean;
  Sum square;
  for (const Part* part : parts)
  {
    area.Add(part->area);
    mean.Add(part->area * part->Mean());
    square.Add(part->area * part->MeanSquare());
  }
  result.area = area.Value();
  if (result.area > 0.0)
  {
    result.mean = mean.Value() / result.area;
    result.rms = std::sqrt(square.Value() / result.area);
    result.percentile95 = Percentile95(parts);
  }
}

// Hausdorff distance.

struct Piece
{
  Place corner;
  std::array<double, 3> distance;
  std::array<std::int32_t, 3> nearest;
  double upper;
  std::int32_t triangle;
};

/// Squared distance of two segments. Source: Ericson, Real-Time Collision Detection, 2005, 5.1.9.
double SegmentDistance2(const Vector3& p1, const Vector3& q1, const Vector3& p2, const Vector3& q2)
{
  const Vector3 d1 = q1 - p1;
  const Vector3 d2 = q2 - p2;
  const Vector3 r = p1 - p2;
  const double a = d1.squaredNorm();
  const double e = d2.squaredNorm();
  const double f = d2.dot(r);
  double s = 0.0;
  double t = 0.0;
  if (a > 0.0 || e > 0.0)
  {
    if (!(a > 0.0))
    {
      t = std::clamp(f / e, 0.0, 1.0);
    }
    else
    {
      const double c = d1.dot(r);
      if (!(e > 0.0))
      {
        s = std::clamp(-c / a, 0.0, 1.0);
      }
      else
      {
        const double b = d1.dot(d2);
        const double denominator = a * e - b * b;
        s = denominator > 0.0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
        t = (b * s + f) / e;
        if (t < 0.0)
        {
          t = 0.0;
          s = std::clamp(-c / a, 0.0, 1.0);
        }
        else if (t > 1.0)
        {
          t = 1.0;
          s = std::clamp((b - c) / a, 0.0, 1.0);
        }
      }
    }
  }
  return (p1 + s * d1 - p2 - t * d2).squaredNorm();
}

class BranchAndBound
{
public:
  BranchAndBound(const Side& from, const Side& to, const MeshDistanceSettings& settings)
    : From(from)
    , To(to)
    , Settings(settings)
    , Best(from.groups.size())
    , Discarded(from.groups.size(), 0.0)
  {
  }

  struct Attained
  {
    double distance = -1.0;
    Vector3 at = Vector3::Zero();
    std::int32_t triangle = -1;
  };

  void Run(const std::vector<Part>& parts, const ProgressCallback& progress);

  const std::vector<Attained>& Results() const { return this->Best; }

  /// How much greater the supremum over a group can be.
  double Error(std::size_t group) const
  {
    return std::max(0.0, this->Discarded[group] - this->Best[group].distance);
  }
  bool Complete() const { return this->Finished; }

private:
  double UpperBound(const Piece& piece, std::int32_t extra, double enough) const;
  double FanBound(const Piece& piece) const;
  void Offer(std::size_t group, double distance, const Vector3& at, std::int32_t triangle)
  {
    if (distance > this->Best[group].distance)
    {
      this->Best[group] = { distance, at, triangle };
    }
  }

  const Side& From;
  const Side& To;
  const MeshDistanceSettings& Settings;
  std::vector<Attained> Best;
  std::vector<double> Discarded; ///< greatest upper bound of what was not looked at more closely
  bool Finished = true;
};

/**
 * The corners' nearest triangles share a corner, or two of them an edge. Then the piece can be mapped
 * onto these triangles, affinely on each of its parts: edges of the piece cross shared edges, and, of
 * three triangles, a point of the piece goes to the shared corner. No point of the piece is further
 * from the surface than the mapping moves one of these points or a corner.
 */
double BranchAndBound::FanBound(const Piece& piece) const
{
  const std::vector<Vector3>& points = this->To.surface.points;
  const auto shared = [&](std::int32_t s, std::int32_t t, std::array<std::int32_t, 3>& common)
  {
    int count = 0;
    for (const std::int32_t p : this->To.surface.triangles[s])
    {
      const Corners& other = this->To.surface.triangles[t];
      if (std::find(other.begin(), other.end(), p) != other.end())
      {
        common[count++] = p;
      }
    }
    return count;
  };
  const double corners = std::max({ piece.distance[0], piece.distance[1], piece.distance[2] });
  double squared = 0.0;
  std::array<std::int32_t, 3> common{};
  std::int32_t centre = -1;
  const bool three = piece.nearest[0] != piece.nearest[1] && piece.nearest[1] != piece.nearest[2] &&
    piece.nearest[2] != piece.nearest[0];
  if (three)
  {
    const int count = shared(piece.nearest[0], piece.nearest[1], common);
    const Corners& third = this->To.surface.triangles[piece.nearest[2]];
    for (int i = 0; i < count && centre < 0; ++i)
    {
      centre = std::find(third.begin(), third.end(), common[i]) != third.end() ? common[i] : -1;
    }
    if (centre < 0)
    {
      return std::numeric_limits<double>::infinity();
    }
    squared = NearestOnTriangle(points[centre], piece.corner[0], piece.corner[1], piece.corner[2])
                .squaredDistance;
  }
  for (int i = 0; i < 3; ++i)
  {
    const int j = (i + 1) % 3;
    if (piece.nearest[i] == piece.nearest[j])
    {
      continue;
    }
    const int count = shared(piece.nearest[i], piece.nearest[j], common);
    if (count == 0)
    {
      return std::numeric_limits<double>::infinity();
    }
    std::int32_t p = common[0];
    std::int32_t q = common[count > 1 ? 1 : 0];
    if (three && count != 2)
    {
      p = q = centre;
    }
    squared =
      std::max(squared, SegmentDistance2(piece.corner[i], piece.corner[j], points[p], points[q]));
  }
  return std::max(corners, std::sqrt(squared));
}

double BranchAndBound::UpperBound(const Piece& piece, std::int32_t extra, double enough) const
{
  const std::array<double, 3> edge = { (piece.corner[1] - piece.corner[2]).norm(),
    (piece.corner[2] - piece.corner[0]).norm(), (piece.corner[0] - piece.corner[1]).norm() };
  double upper = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i)
  {
    upper = std::min(upper, piece.distance[i] + std::max(edge[(i + 1) % 3], edge[(i + 2) % 3]));
  }
  const auto tryOne = [&](std::int32_t triangle)
  {
    double greatest = 0.0;
    for (int k = 0; k < 3 && greatest < upper; ++k)
    {
      greatest = std::max(greatest,
        piece.nearest[k] == triangle
          ? piece.distance[k]
          : std::sqrt(this->To.tree.NearestOn(triangle, piece.corner[k]).squaredDistance));
    }
    upper = std::min(upper, greatest);
  };
  for (int i = 0; i < 3 && upper > enough; ++i)
  {
    if (std::find(piece.nearest.begin(), piece.nearest.begin() + i, piece.nearest[i]) ==
      piece.nearest.begin() + i)
    {
      tryOne(piece.nearest[i]);
    }
  }
  if (upper > enough && extra >= 0)
  {
    tryOne(extra);
  }
  if (upper > enough)
  {
    upper = std::min(upper, this->FanBound(piece));
  }
  return upper;
}

void BranchAndBound::Run(const std::vector<Part>& parts, const ProgressCallback& progress)
{
  const Side& side = this->From;
  const std::int64_t count = side.Triangles();
  const double bound = this->Settings.errorBound;
  for (std::int64_t i = 0; i < count; ++i)
  {
    for (const std::int32_t point : side.surface.triangles[i])
    {
      this->Offer(side.groupOf[i], side.distance[point], side.surface.points[point],
        static_cast<std::int32_t>(i));
    }
  }
  for (const Part& part : parts)
  {
    const Vector3 at = (side.Corner(part.triangle, 0) + side.Corner(part.triangle, 1) +
                         side.Corner(part.triangle, 2)) /
      3.0;
    if (side.centroidNearest[part.triangle] >= 0 && part.cell == 0)
    {
      this->Offer(side.groupOf[part.triangle], part.centroid, at, part.triangle);
    }
  }

  const auto pieceOf = [&](std::int64_t i)
  {
    Piece piece;
    for (int k = 0; k < 3; ++k)
    {
      const std::int32_t point = side.surface.triangles[i][k];
      piece.corner[k] = side.surface.points[point];
      piece.distance[k] = side.distance[point];
      piece.nearest[k] = static_cast<std::int32_t>(side.nearest[point].triangle);
    }
    piece.triangle = static_cast<std::int32_t>(i);
    return piece;
  };
  std::vector<double> upper(count);
  std::vector<Piece> corrected; // in the order of their triangles
  ParallelFor(
    count, ReportingGrain(progress, count, 1024),
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        upper[i] =
          this->UpperBound(pieceOf(i), side.centroidNearest.empty() ? -1 : side.centroidNearest[i],
            this->Best[side.groupOf[i]].distance + bound);
      }
    },
    progress);
  if (!this->Settings.pointMeasures)
  {
    // What is left over needs the true distances of its corners.
    std::vector<std::int32_t> left;
    for (std::int64_t i = 0; i < count; ++i)
    {
      if (upper[i] > this->Best[side.groupOf[i]].distance + bound)
      {
        left.push_back(static_cast<std::int32_t>(i));
      }
    }
    corrected.resize(left.size());
    ParallelFor(static_cast<std::int64_t>(left.size()), 64,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          Piece piece = pieceOf(left[n]);
          for (int k = 0; k < 3; ++k)
          {
            const TriangleBvh::Nearest nearest = this->To.tree.Closest(
              piece.corner[k], std::numeric_limits<double>::infinity(), piece.nearest[k]);
            piece.distance[k] = nearest.distance;
            piece.nearest[k] = static_cast<std::int32_t>(nearest.triangle);
          }
          piece.upper =
            this->UpperBound(piece, -1, this->Best[side.groupOf[left[n]]].distance + bound);
          upper[left[n]] = std::min(upper[left[n]], piece.upper);
          piece.upper = upper[left[n]];
          corrected[n] = piece;
        }
      });
    for (const Piece& piece : corrected)
    {
      for (int k = 0; k < 3; ++k)
      {
        this->Offer(
          side.groupOf[piece.triangle], piece.distance[k], piece.corner[k], piece.triangle);
      }
    }
  }
  std::vector<Piece> pieces;
  const auto keep = [&](const Piece& piece)
  {
    const std::int32_t group = side.groupOf[piece.triangle];
    if (piece.upper > this->Best[group].distance + bound)
    {
      pieces.push_back(piece);
    }
    else
    {
      this->Discarded[group] = std::max(this->Discarded[group], piece.upper);
    }
  };
  std::size_t next = 0;
  for (std::int64_t i = 0; i < count; ++i)
  {
    const std::int32_t group = side.groupOf[i];
    while (next < corrected.size() && corrected[next].triangle < i)
    {
      ++next;
    }
    if (upper[i] > this->Best[group].distance + bound)
    {
      const bool known = next < corrected.size() && corrected[next].triangle == i;
      pieces.push_back(known ? corrected[next] : pieceOf(i));
      pieces.back().upper = upper[i];
    }
    else
    {
      this->Discarded[group] = std::max(this->Discarded[group], upper[i]);
    }
  }

  struct Cut
  {
    std::array<Piece, 4> quarters;
    std::array<double, 3> distance;
    std::array<Vector3, 3> middle;
  };
  std::vector<Cut> cuts;
  std::int64_t done = 0;
  while (!pieces.empty())
  {
    Report(progress, 1.0);
    const std::size_t batch = std::min(PiecesAtOnce, pieces.size());
    const auto begin = pieces.end() - static_cast<std::ptrdiff_t>(batch);
    if (batch < pieces.size())
    {
      // The most promising ones.
      std::nth_element(pieces.begin(), begin, pieces.end(),
        [](const Piece& s, const Piece& t) { return s.upper < t.upper; });
    }
    done += static_cast<std::int64_t>(batch);
    if (done > this->Settings.maximumPieces)
    {
      this->Finished = false;
      for (const Piece& piece : pieces)
      {
        const std::int32_t group = side.groupOf[piece.triangle];
        this->Discarded[group] = std::max(this->Discarded[group], piece.upper);
      }
      return;
    }
    cuts.resize(batch);
    ParallelFor(static_cast<std::int64_t>(batch), 64,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          const Piece& piece = begin[n];
          Cut& cut = cuts[n];
          std::array<std::int32_t, 3> near{};
          for (int k = 0; k < 3; ++k)
          {
            cut.middle[k] = 0.5 * (piece.corner[(k + 1) % 3] + piece.corner[(k + 2) % 3]);
            const TriangleBvh::Nearest nearest = this->To.tree.Closest(
              cut.middle[k], std::numeric_limits<double>::infinity(), piece.nearest[(k + 1) % 3]);
            cut.distance[k] = nearest.distance;
            near[k] = static_cast<std::int32_t>(nearest.triangle);
          }
          const double enough = this->Best[side.groupOf[piece.triangle]].distance + bound;
          for (int q = 0; q < 4; ++q)
          {
            Piece& quarter = cut.quarters[q];
            quarter.triangle = piece.triangle;
            for (int k = 0; k < 3; ++k)
            {
              // A corner of the piece stays in the quarter of its number; the last one is in the middle.
              const bool own = k == q;
              const int m = q == 3 ? k : 3 - q - k;
              quarter.corner[k] = own ? piece.corner[k] : cut.middle[m];
              quarter.distance[k] = own ? piece.distance[k] : cut.distance[m];
              quarter.nearest[k] = own ? piece.nearest[k] : near[m];
            }
            quarter.upper = std::min(piece.upper, this->UpperBound(quarter, -1, enough));
          }
        }
      });
    for (std::size_t n = 0; n < batch; ++n)
    {
      const std::int32_t triangle = begin[static_cast<std::ptrdiff_t>(n)].triangle;
      for (int k = 0; k < 3; ++k)
      {
        this->Offer(side.groupOf[triangle], cuts[n].distance[k], cuts[n].middle[k], triangle);
      }
    }
    pieces.resize(pieces.size() - batch);
    for (const Cut& cut : cuts)
    {
      for (const Piece& quarter : cut.quarters)
      {
        keep(quarter);
      }
    }
  }
}

// Signs.

/// Which side of a closed surface a point is on. Source: Baerentzen and Aanaes, Signed distance
/// computation using the angle weighted pseudonormal, IEEE TVCG 2005;11:243.
class SurfaceSign
{
public:
  explicit SurfaceSign(const Side& side);

  /// Every edge is passed as often in one direction as in the other.
  bool Closed() const { return this->IsClosed; }

  /// Whether p, whose nearest point is given, is inside.
  bool Inside(const Vector3& p, const TriangleBvh::Nearest& nearest) const;

private:
  const Side& Of;
  bool IsClosed = true;
  bool Inverted = false;                           ///< the triangles look inwards
  std::vector<Vector3> Normals;                    ///< of triangles; zero: degenerate
  std::vector<std::array<Vector3, 3>> EdgeNormals; ///< AB, BC, CA; zero: not simply two triangles
  std::vector<Vector3> PointNormals;               ///< zero: a degenerate triangle is near
};

SurfaceSign::SurfaceSign(const Side& side)
  : Of(side)
{
  const std::int64_t count = side.Triangles();
  struct Edge
  {
    std::uint64_t key;
    std::int32_t triangle;
    std::int8_t number;
    std::int8_t direction;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * count);
  for (std::int64_t i = 0; i < count; ++i)
  {
    const Corners& t = side.surface.triangles[i];
    for (int k = 0; k < 3; ++k)
    {
      const auto from = static_cast<std::uint64_t>(t[k]);
      const auto to = static_cast<std::uint64_t>(t[(k + 1) % 3]);
      if (from != to)
      {
        edges.push_back(
          { std::min(from, to) << 32 | std::max(from, to), static_cast<std::int32_t>(i),
            static_cast<std::int8_t>(k), static_cast<std::int8_t>(from < to ? 1 : -1) });
      }
    }
  }
  std::sort(edges.begin(), edges.end(),
    [](const Edge& s, const Edge& t)
    { return s.key != t.key ? s.key < t.key : s.triangle < t.triangle; });
  const auto endOfRun = [&](std::size_t first)
  {
    std::size_t last = first;
    while (last < edges.size() && edges[last].key == edges[first].key)
    {
      ++last;
    }
    return last;
  };
  for (std::size_t first = 0, last = 0; first < edges.size() && this->IsClosed; first = last)
  {
    last = endOfRun(first);
    int turns = 0;
    for (std::size_t i = first; i < last; ++i)
    {
      turns += edges[i].direction;
    }
    this->IsClosed = turns == 0;
  }
  this->IsClosed = this->IsClosed && !edges.empty();
  if (!this->IsClosed)
  {
    return;
  }

  this->Normals.assign(count, Vector3::Zero());
  this->EdgeNormals.assign(count, { Vector3::Zero(), Vector3::Zero(), Vector3::Zero() });
  this->PointNormals.assign(side.surface.points.size(), Vector3::Zero());
  std::vector<std::uint8_t> doubtful(side.surface.points.size(), 0);
  Sum volume;
  const Vector3 centre = side.surface.points.front();
  for (std::int64_t i = 0; i < count; ++i)
  {
    const Vector3 a = side.Corner(i, 0);
    const Vector3 ab = side.Corner(i, 1) - a;
    const Vector3 ac = side.Corner(i, 2) - a;
    const Vector3 bc = ac - ab;
    const Vector3 normal = ab.cross(ac);
    volume.Add(normal.dot(a - centre));
    const double area = normal.norm();
    const Corners& t = side.surface.triangles[i];
    // Thinner than this its direction is rounding.
    if (!(area > 1e-10 * std::max({ ab.squaredNorm(), ac.squaredNorm(), bc.squaredNorm() })))
    {
      for (const std::int32_t point : t)
      {
        doubtful[point] = 1;
      }
      continue;
    }
    const Vector3 unit = normal / area;
    this->Normals[i] = unit;
    this->PointNormals[t[0]] += std::atan2(area, ab.dot(ac)) * unit;
    this->PointNormals[t[1]] += std::atan2(area, -ab.dot(bc)) * unit;
    this->PointNormals[t[2]] += std::atan2(area, ac.dot(bc)) * unit;
  }
  for (std::size_t i = 0; i < doubtful.size(); ++i)
  {
    if (doubtful[i] != 0)
    {
      this->PointNormals[i].setZero();
    }
  }
  this->Inverted = volume.Value() < 0.0;
  for (std::size_t first = 0, last = 0; first < edges.size(); first = last)
  {
    last = endOfRun(first);
    if (last - first == 2)
    {
      const Vector3& s = this->Normals[edges[first].triangle];
      const Vector3& t = this->Normals[edges[first + 1].triangle];
      if (!s.isZero() && !t.isZero())
      {
        for (std::size_t i = first; i < last; ++i)
        {
          this->EdgeNormals[edges[i].triangle][edges[i].number] = s + t;
        }
      }
    }
  }
}

bool SurfaceSign::Inside(const Vector3& p, const TriangleBvh::Nearest& nearest) const
{
  const std::int64_t triangle = nearest.triangle;
  Vector3 normal;
  switch (nearest.feature)
  {
    case TriangleFeature::Face:
      normal = this->Normals[triangle];
      break;
    case TriangleFeature::EdgeAB:
    case TriangleFeature::EdgeBC:
    case TriangleFeature::EdgeCA:
      normal = this->EdgeNormals[triangle][static_cast<int>(nearest.feature) -
        static_cast<int>(TriangleFeature::EdgeAB)];
      break;
    default:
      normal =
        this->PointNormals[this->Of.surface.triangles[triangle][static_cast<int>(nearest.feature) -
          static_cast<int>(TriangleFeature::A)]];
  }
  const Vector3 away = p - nearest.point;
  const double side = normal.dot(away);
  // Not between a normal and a direction that are almost at right angles.
  if (std::abs(side) <= 1e-3 * normal.norm() * away.norm())
  {
    return this->Of.tree.Winding(p) != 0;
  }
  return (side < 0.0) != this->Inverted;
}

/// Signs of a side's point distances, if the other side is closed.
bool SignDistances(const Side& side, const SurfaceMesh& otherMesh, const Side& other,
  bool otherIsClipped, const MeshDistanceSettings& settings, std::vector<double>& distance)
{
  const auto apply = [&](const std::function<bool(std::int64_t)>& inside)
  {
    ParallelFor(static_cast<std::int64_t>(distance.size()), Chunk,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          if (distance[i] > 0.0 && inside(i))
          {
            distance[i] = -distance[i];
          }
        }
      });
  };
  if (!otherIsClipped)
  {
    const SurfaceSign sign(other);
    if (sign.Closed())
    {
      apply([&](std::int64_t i) { return sign.Inside(side.surface.points[i], side.nearest[i]); });
    }
    return sign.Closed();
  }
  // The whole surface decides, what was cut off as well; its nearest point is another one.
  Side whole;
  Prepare(whole, otherMesh, nullptr, settings, "");
  const SurfaceSign sign(whole);
  if (sign.Closed())
  {
    apply([&](std::int64_t i) { return whole.tree.Winding(side.surface.points[i]) != 0; });
  }
  return sign.Closed();
}

std::vector<double> ToInput(const Side& side, const std::vector<double>& distance)
{
  std::vector<double> result(side.surface.pointOfInput.size(), NaN);
  for (std::size_t i = 0; i < result.size(); ++i)
  {
    const std::int32_t point = side.surface.pointOfInput[i];
    if (point >= 0)
    {
      result[i] = distance[point];
    }
  }
  return result;
}

/// Eq. 16 and the area for a side (group -1) or one of its groups.
void MeasureVertices(const Side& side, const SurfaceMesh& mesh,
  const std::vector<std::int64_t>& groups, std::int64_t group, SideDistance& result)
{
  if (side.distance.empty())
  {
    return;
  }
  Sum sum;
  std::vector<std::uint8_t> mine;
  if (group >= 0 && mesh.pointGroups.empty())
  {
    // Without groups of points: the points of its triangles.
    mine.assign(mesh.points.size(), 0);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    {
      if (groups[i] == side.groups[group])
      {
        for (const std::int64_t point : mesh.triangles[i])
        {
          mine[point] = 1;
        }
      }
    }
  }
  for (std::size_t i = 0; i < side.surface.pointOfInput.size(); ++i)
  {
    const std::int32_t point = side.surface.pointOfInput[i];
    const bool counts = point >= 0 &&
      (group < 0 || (mine.empty() ? mesh.pointGroups[i] == side.groups[group] : mine[i] != 0));
    if (counts)
    {
      const double distance = side.distance[point];
      sum.Add(distance);
      result.vertexMaximum =
        result.vertices == 0 ? distance : std::max(result.vertexMaximum, distance);
      ++result.vertices;
    }
  }
  if (result.vertices > 0)
  {
    result.vertexMean = sum.Value() / static_cast<double>(result.vertices);
  }
}

std::string UnitWarning(
  const SurfaceMesh& a, const SurfaceMesh& b, const std::array<std::string, 2>& names)
{
  std::array<double, 2> size = { 0.0, 0.0 };
  int n = 0;
  for (const SurfaceMesh* mesh : { &a, &b })
  {
    Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
    Vector3 high = -low;
    for (const Triangle& t : mesh->triangles)
    {
      for (const std::int64_t point : t)
      {
        low = low.cwiseMin(mesh->points[point]);
        high = high.cwiseMax(mesh->points[point]);
      }
    }
    size[n++] = (high - low).norm();
  }
  if (size[0] > 0.0 && size[1] > 0.0)
  {
    const double ratio = std::max(size[0], size[1]) / std::min(size[0], size[1]);
    for (const double unit : { 10.0, 100.0, 1000.0 })
    {
      if (ratio > 0.8 * unit && ratio < 1.25 * unit)
      {
        return names[size[0] > size[1] ? 0 : 1] + " is about " +
          std::to_string(static_cast<int>(unit)) +
          " times as large as the other surface: they seem to be in different units";
      }
    }
  }
  return {};
}
}

void MeshDistanceSettings::Validate() const
{
  Require(errorBound > 0.0 && std::isfinite(errorBound),
    "MeshDistanceSettings: errorBound must be positive");
  Require(endLength > 0.0 && std::isfinite(endLength),
    "MeshDistanceSettings: endLength must be positive");
  Require(maximumPieces > 0, "MeshDistanceSettings: maximumPieces must be positive");
}

MeshDistance CompareSurfaces(const SurfaceMesh& a, const SurfaceMesh& b,
  const MeshDistanceSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  const std::array<const SurfaceMesh*, 2> meshes = { &a, &b };
  const std::array<std::string, 2>& names = settings.names;
  for (int s = 0; s < 2; ++s)
  {
    Check(*meshes[s], names[s]);
  }
  const double areaShare = settings.areaMeasures ? 3.0 : 0.0;
  const double searchShare = settings.hausdorff ? 1.0 : 0.0;
  const WorkParts work(
    progress, { 1.0, 1.5, 1.5, areaShare, areaShare, searchShare, searchShare, 1.5 });
  Report(progress, 0.0);
  MeshDistance result;
  const std::string units = UnitWarning(a, b, names);
  if (!units.empty())
  {
    result.warnings.push_back(units);
  }
  std::vector<SurfaceEnd> ends;
  if (settings.clipEnds)
  {
    for (const SurfaceMesh* mesh : meshes)
    {
      const std::vector<SurfaceEnd> found = FindSurfaceEnds(*mesh);
      ends.insert(ends.end(), found.begin(), found.end());
    }
    if (ends.empty())
    {
      result.warnings.emplace_back(
        "No ends were found to be left out: both surfaces are closed, without marks of caps");
    }
  }
  std::array<Side, 2> sides;
  ParallelFor(2, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t s = first; s < last; ++s)
      {
        Prepare(sides[s], *meshes[s], settings.clipEnds ? &ends : nullptr, settings, names[s]);
      }
    });
  SkipProgress(work(0), 0.0, 1.0);
  const bool onlyHausdorff = !settings.pointMeasures && !settings.areaMeasures;
  std::array<SideDistance*, 2> totals = { &result.ab, &result.ba };
  std::array<std::vector<Part>, 2> parts;
  for (int s = 0; s < 2; ++s)
  {
    MeasurePoints(
      sides[s], sides[1 - s].tree, !onlyHausdorff || sides[s].groups.size() > 1, work(1 + s));
  }
  for (int s = 0; s < 2 && settings.areaMeasures; ++s)
  {
    Integral integral(sides[s], sides[1 - s].tree);
    integral.Compute(settings.errorBound, work(3 + s));
    parts[s] = integral.Parts();
    totals[s]->quadratureError = integral.Error();
  }

  std::array<std::vector<SideDistance>, 2> branches;
  for (int s = 0; s < 2; ++s)
  {
    branches[s].resize(sides[s].groups.size());
  }
  for (int s = 0; s < 2 && settings.hausdorff; ++s)
  {
    BranchAndBound search(sides[s], sides[1 - s], settings);
    search.Run(parts[s], work(5 + s));
    if (!search.Complete())
    {
      result.warnings.push_back("The search for the Hausdorff distance from " + names[s] +
        " stopped after " + std::to_string(settings.maximumPieces) + " pieces");
    }
    double supremum = 0.0;
    for (std::size_t g = 0; g < branches[s].size(); ++g)
    {
      const BranchAndBound::Attained& best = search.Results()[g];
      SideDistance& branch = branches[s][g];
      branch.hausdorff = best.distance;
      branch.hausdorffError = search.Error(g);
      branch.at = best.at;
      branch.nearest = sides[1 - s].tree.Closest(best.at).point;
      branch.triangle = sides[s].surface.inputTriangle[best.triangle];
      supremum = std::max(supremum, branch.hausdorff + branch.hausdorffError);
      if (!(totals[s]->hausdorff >= branch.hausdorff))
      {
        totals[s]->hausdorff = branch.hausdorff;
        totals[s]->at = branch.at;
        totals[s]->nearest = branch.nearest;
        totals[s]->triangle = branch.triangle;
      }
    }
    totals[s]->hausdorffError = supremum - totals[s]->hausdorff;
  }

  SkipProgress(work(7), 0.0, 1.0);
  std::array<std::vector<double>, 2> distances;
  if (settings.pointMeasures)
  {
    distances = { sides[0].distance, sides[1].distance };
  }
  std::array<bool, 2> isSigned = { false, false };
  if (settings.signedDistances && settings.pointMeasures)
  {
    ParallelFor(2, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t s = first; s < last; ++s)
        {
          isSigned[s] = SignDistances(
            sides[s], *meshes[1 - s], sides[1 - s], settings.clipEnds, settings, distances[s]);
        }
      });
  }
  if (settings.pointMeasures)
  {
    result.pointDistancesA = ToInput(sides[0], distances[0]);
    result.pointDistancesB = ToInput(sides[1], distances[1]);
  }
  result.signedA = isSigned[0];
  result.signedB = isSigned[1];

  std::vector<const Part*> pooled;
  for (int s = 0; s < 2; ++s)
  {
    const std::vector<std::int64_t> groups = GroupsOfTriangles(*meshes[s]);
    if (!settings.pointMeasures)
    {
      // Not all of them are exact.
      sides[s].distance.clear();
    }
    MeasureVertices(sides[s], *meshes[s], groups, -1, *totals[s]);
    std::vector<const Part*> own;
    std::vector<std::vector<const Part*>> ofGroup(sides[s].groups.size());
    for (const Part& part : parts[s])
    {
      if (part.area > 0.0)
      {
        own.push_back(&part);
        ofGroup[sides[s].groupOf[part.triangle]].push_back(&part);
      }
    }
    pooled.insert(pooled.end(), own.begin(), own.end());
    Integrate(own, *totals[s]);
    if (!settings.areaMeasures)
    {
      Sum area;
      for (std::int64_t i = 0; i < sides[s].Triangles(); ++i)
      {
        area.Add(sides[s].Area(i));
      }
      totals[s]->area = area.Value();
    }
    if (!sides[s].hasGroups)
    {
      continue;
    }
    for (std::size_t g = 0; g < sides[s].groups.size(); ++g)
    {
      SideDistance& branch = branches[s][g];
      MeasureVertices(sides[s], *meshes[s], groups, static_cast<std::int64_t>(g), branch);
      Integrate(ofGroup[g], branch);
      result.branches.push_back({ s, sides[s].groups[g], branch });
    }
  }
  if (settings.hausdorff)
  {
    result.hausdorff = std::max(result.ab.hausdorff, result.ba.hausdorff);
    result.hausdorffError = std::max(result.ab.hausdorff + result.ab.hausdorffError,
                              result.ba.hausdorff + result.ba.hausdorffError) -
      result.hausdorff;
  }
  const double area = result.ab.area + result.ba.area;
  if (settings.areaMeasures && area > 0.0)
  {
    SideDistance both;
    Integrate(pooled, both);
    result.mean = both.mean;
    result.rms = both.rms;
    result.percentile95 = both.percentile95;
    result.hausdorff95 = std::max(result.ab.percentile95, result.ba.percentile95);
    result.quadratureError =
      (result.ab.area * result.ab.quadratureError + result.ba.area * result.ba.quadratureError) /
      area;
  }
  Report(progress, 1.0);
  return result;
}
}
