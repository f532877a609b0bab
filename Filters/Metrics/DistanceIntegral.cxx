#include "DistanceIntegral.h"

#include "PartialProgress.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace coronary
{
namespace
{
constexpr double MinimumParts = 20000.0; ///< of a surface's area
constexpr int MaximumGrid = 512;         ///< edges along a triangle's side
constexpr int ErrorSamples = 1024;
constexpr int MaximumRounds = 8;

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
double Percentile95(std::vector<const DistancePart*> parts)
{
  CompensatedSum total;
  double low = std::numeric_limits<double>::infinity();
  double high = 0.0;
  for (const DistancePart* part : parts)
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
    return SideDistance::NaN;
  }
  const double wanted = 0.95 * total.Value();
  const double accuracy = 1e-9 * high;
  CompensatedSum below; // area of the parts that were left behind below the interval
  while (high - low > accuracy)
  {
    const double t = 0.5 * (low + high);
    if (!(t > low) || !(t < high))
    {
      break;
    }
    double at = below.Value();
    for (const DistancePart* part : parts)
    {
      const auto& [a, b, c] = part->corner;
      const double m = part->centroid;
      at += part->area / 3.0 *
        (ShareBelow(a, b, m, t) + ShareBelow(b, c, m, t) + ShareBelow(c, a, m, t));
    }
    (at < wanted ? low : high) = t;
    parts.erase(std::remove_if(parts.begin(), parts.end(),
                  [&](const DistancePart* part)
                  {
                    const auto& [a, b, c] = part->corner;
                    const double minimum = std::min({ a, b, c, part->centroid });
                    const double maximum = std::max({ a, b, c, part->centroid });
                    if (maximum <= low)
                    {
                      below.Add(part->area);
                      return true;
                    }
                    return minimum > high;
                  }),
      parts.end());
  }
  return 0.5 * (low + high);
}
}

PartCorners DistanceIntegral::PlaceOf(const DistancePart& part) const
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

void DistanceIntegral::Start(const ProgressCallback& progress)
{
  const ComparedSide& side = this->From;
  const std::int64_t count = side.Triangles();
  std::vector<double> area(count);
  CompensatedSum total;
  for (std::int64_t i = 0; i < count; ++i)
  {
    area[i] = side.Area(i);
    total.Add(area[i]);
  }
  this->Grid.assign(count, 1);
  std::vector<std::int64_t> firstPart(count + 1, 0);
  for (std::int64_t i = 0; i < count; ++i)
  {
    const double parts = total.Value() > 0.0 ? MinimumParts * area[i] / total.Value() : 0.0;
    this->Grid[i] = std::clamp(static_cast<int>(std::ceil(std::sqrt(parts))), 1, MaximumGrid);
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
        const SideTriangle& corners = side.surface.triangles[triangle];
        const int edges = this->Grid[triangle];
        std::int64_t hint = side.nearest[corners[0]].triangle;
        for (int cell = 0; cell < edges * edges; ++cell)
        {
          DistancePart& part = this->All[firstPart[triangle] + cell];
          part.area = area[triangle] / (static_cast<double>(edges) * edges);
          part.triangle = triangle;
          part.cell = cell;
          const PartCorners place = this->PlaceOf(part);
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

std::array<DistancePart, 4> DistanceIntegral::Quarters(
  const DistancePart& part, std::array<PartCorners, 4>* places) const
{
  const PartCorners p = part.cell < 0 ? this->QuarterPlaces[~part.cell] : this->PlaceOf(part);
  const std::array<Vector3, 3> middle = { 0.5 * (p[1] + p[2]), 0.5 * (p[2] + p[0]),
    0.5 * (p[0] + p[1]) };
  const std::array<PartCorners, 4> quarters = { PartCorners{ p[0], middle[2], middle[1] },
    PartCorners{ middle[2], p[1], middle[0] }, PartCorners{ middle[1], middle[0], p[2] },
    PartCorners{ middle[0], middle[1], middle[2] } };
  std::int64_t hint = this->From.nearest[this->From.surface.triangles[part.triangle][0]].triangle;
  std::array<double, 3> m{};
  for (int k = 0; k < 3; ++k)
  {
    m[k] = this->DistanceAt(middle[k], hint);
  }
  std::array<DistancePart, 4> result;
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
void DistanceIntegral::Estimate()
{
  CompensatedSum total;
  for (const DistancePart& part : this->All)
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
        const DistancePart& part = this->All[chosen[n]];
        double mean = 0.0;
        for (const DistancePart& quarter : this->Quarters(part, nullptr))
        {
          mean += 0.25 * quarter.Mean();
        }
        change[n] = mean - part.Mean();
      }
    });
  CompensatedSum sum;
  CompensatedSum squares;
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
bool DistanceIntegral::Refine()
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
        std::array<PartCorners, 4> places;
        const std::array<DistancePart, 4> quarters = this->Quarters(this->All[order[n]], &places);
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

void DistanceIntegral::Compute(double errorBound, const ProgressCallback& progress)
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

void FillAreaMeasures(const std::vector<const DistancePart*>& parts, SideDistance& result)
{
  CompensatedSum area;
  CompensatedSum mean;
  CompensatedSum square;
  for (const DistancePart* part : parts)
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
}
