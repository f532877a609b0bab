#include "VesselImage.h"

#include "ParallelFor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

namespace coronary
{
namespace
{
constexpr double UsualRadius = 1.5; ///< mm, of lines without radii
constexpr double MostVoxels = 64e6;

/// An image of zeros around a box.
VesselImage ImageAround(const Vector3& low, const Vector3& high, double spacing)
{
  const double size = std::max((high - low).prod(), 0.0);
  const double step = std::max(spacing, std::cbrt(size / MostVoxels));
  VesselImage image;
  image.grid.origin = low;
  image.grid.spacing = Vector3::Constant(step);
  std::size_t voxels = 1;
  for (int axis = 0; axis < 3; ++axis)
  {
    const auto count = static_cast<std::int64_t>((high[axis] - low[axis]) / step) + 2;
    image.grid.extent[2 * axis] = 0;
    image.grid.extent[2 * axis + 1] = static_cast<int>(count) - 1;
    voxels *= static_cast<std::size_t>(count);
  }
  image.values.assign(voxels, 0.0F);
  return image;
}

void CheckSpacing(const char* function, double spacing, double margin)
{
  if (!(spacing > 0.0) || !(margin >= 0.0))
  {
    throw std::invalid_argument(
      std::string(function) + ": spacing must be positive, and margin not negative");
  }
}

/// Corners by the first of the points at their place.
std::vector<Triangle> Welded(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  std::vector<std::int64_t> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](std::int64_t p)
  { return std::make_tuple(points[p][0], points[p][1], points[p][2]); };
  std::sort(order.begin(), order.end(),
    [&](std::int64_t a, std::int64_t b)
    { return std::make_pair(key(a), a) < std::make_pair(key(b), b); });
  std::vector<std::int64_t> first(points.size());
  for (std::size_t n = 0; n < order.size(); ++n)
  {
    const bool same = n > 0 && key(order[n]) == key(order[n - 1]);
    first[order[n]] = same ? first[order[n - 1]] : order[n];
  }
  std::vector<Triangle> result = triangles;
  for (Triangle& triangle : result)
  {
    for (std::int64_t& corner : triangle)
    {
      corner = first[corner];
    }
  }
  return result;
}

/// How many edges are not passed as often in one direction as in the other.
std::size_t OpenEdges(const std::vector<Triangle>& triangles)
{
  std::vector<std::array<std::int64_t, 3>> edges; // smaller, larger, direction
  edges.reserve(3 * triangles.size());
  for (const Triangle& triangle : triangles)
  {
    for (int n = 0; n < 3; ++n)
    {
      const std::int64_t a = triangle[n];
      const std::int64_t b = triangle[(n + 1) % 3];
      if (a != b)
      {
        edges.push_back({ std::min(a, b), std::max(a, b), a < b ? 1 : -1 });
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  std::size_t open = 0;
  for (std::size_t n = 0; n < edges.size();)
  {
    std::int64_t sum = 0;
    std::size_t next = n;
    for (; next < edges.size() && edges[next][0] == edges[n][0] && edges[next][1] == edges[n][1];
         ++next)
    {
      sum += edges[next][2];
    }
    open += sum != 0 ? 1 : 0;
    n = next;
  }
  return open;
}

/// Where an edge crosses the plane z; the same bits for both of its triangles.
Vector3 CrossingOf(
  const std::vector<Vector3>& points, std::int64_t one, std::int64_t other, double z)
{
  const Vector3& a = points[std::min(one, other)];
  const Vector3& b = points[std::max(one, other)];
  return a + (z - a[2]) / (b[2] - a[2]) * (b - a);
}

/// The directed lines in which a surface crosses planes of constant z, filled line by line.
class SurfaceFiller
{
public:
  SurfaceFiller(
    const std::vector<Vector3>& points, const std::vector<Triangle>& triangles, VesselImage& image)
    : Points(points)
    , Triangles(triangles)
    , Image(image)
    , Step(image.grid.spacing[0])
    , Columns(image.grid.extent[1] + 1)
    , Rows(image.grid.extent[3] + 1)
    , ByPlane(2 * static_cast<std::size_t>(image.grid.extent[5] + 1))
  {
    const auto planes = static_cast<std::int64_t>(this->ByPlane.size());
    for (std::size_t n = 0; n < triangles.size(); ++n)
    {
      double low = std::numeric_limits<double>::infinity();
      double high = -low;
      for (const std::int64_t corner : triangles[n])
      {
        low = std::min(low, points[corner][2]);
        high = std::max(high, points[corner][2]);
      }
      const auto indexOf = [&](double z)
      { return 2.0 * (z - image.grid.origin[2]) / this->Step + 0.5; };
      const auto first = std::max<std::int64_t>(static_cast<std::int64_t>(indexOf(low)) - 1, 0);
      const auto last =
        std::min<std::int64_t>(static_cast<std::int64_t>(indexOf(high)) + 1, planes - 1);
      for (std::int64_t plane = first; plane <= last; ++plane)
      {
        this->ByPlane[plane].push_back(static_cast<std::int64_t>(n));
      }
    }
  }

  /// Adds what of the voxels of a slice is inside at the plane (0 or 1) of it.
  void Fill(int slice, int half) const
  {
    const double z = this->At(2, slice, half);
    std::vector<std::vector<std::pair<double, int>>> crossings(
      2 * static_cast<std::size_t>(this->Rows)); // of lines along x
    for (const std::int64_t n : this->ByPlane[2 * slice + half])
    {
      const Triangle& triangle = this->Triangles[n];
      Vector3 from = Vector3::Zero();
      Vector3 to = Vector3::Zero();
      bool crosses = false;
      for (int c = 0; c < 3; ++c)
      {
        const std::int64_t a = triangle[c];
        const std::int64_t b = triangle[(c + 1) % 3];
        const bool above = this->Points[a][2] >= z;
        if (above != (this->Points[b][2] >= z))
        {
          (above ? to : from) = CrossingOf(this->Points, a, b, z);
          crosses = true;
        }
      }
      if (!crosses)
      {
        continue;
      }
      const auto lineOf = [&](double y)
      { return 2.0 * (y - this->Image.grid.origin[1]) / this->Step + 0.5; };
      const auto first =
        std::max<std::int64_t>(static_cast<std::int64_t>(lineOf(std::min(from[1], to[1]))) - 1, 0);
      const auto last = std::min<std::int64_t>(
        static_cast<std::int64_t>(lineOf(std::max(from[1], to[1]))) + 1, 2 * this->Rows - 1);
      for (std::int64_t line = first; line <= last; ++line)
      {
        const double y = this->At(1, static_cast<int>(line / 2), static_cast<int>(line % 2));
        if ((from[1] >= y) != (to[1] >= y))
        {
          const double share = (y - from[1]) / (to[1] - from[1]);
          crossings[line].emplace_back(from[0] + share * (to[0] - from[0]), to[1] >= y ? 1 : -1);
        }
      }
    }
    for (std::size_t line = 0; line < crossings.size(); ++line)
    {
      std::vector<std::pair<double, int>>& own = crossings[line];
      std::sort(own.begin(), own.end());
      float* row = this->Image.values.data() +
        (static_cast<std::int64_t>(slice) * this->Rows + static_cast<std::int64_t>(line) / 2) *
          this->Columns;
      int winding = 0;
      for (std::size_t n = 0; n + 1 < own.size(); ++n)
      {
        winding += own[n].second;
        if (winding != 0)
        {
          this->AddSpan(row, own[n].first, own[n + 1].first);
        }
      }
    }
  }

private:
  double At(int axis, int index, int half) const
  {
    return this->Image.grid.origin[axis] + this->Step * (index + 0.5 * half - 0.25);
  }

  void AddSpan(float* row, double from, double to) const
  {
    // In voxels, whose borders are then whole numbers.
    from = (from - this->Image.grid.origin[0]) / this->Step + 0.5;
    to = (to - this->Image.grid.origin[0]) / this->Step + 0.5;
    const int last = std::min(static_cast<int>(to), this->Columns - 1);
    for (int i = std::max(static_cast<int>(from), 0); i <= last; ++i)
    {
      row[i] += static_cast<float>(
        0.25 * std::max(std::min(to, i + 1.0) - std::max(from, static_cast<double>(i)), 0.0));
    }
  }

  const std::vector<Vector3>& Points;
  const std::vector<Triangle>& Triangles;
  VesselImage& Image;
  const double Step;
  const int Columns;
  const int Rows;
  std::vector<std::vector<std::int64_t>> ByPlane; ///< triangles at every plane, two a slice
};
}

VesselImage RenderLines(const Polylines& lines, double spacing, double margin)
{
  CheckPolylines(lines);
  if (lines.lines.empty())
  {
    throw std::invalid_argument("There are no lines");
  }
  CheckSpacing("RenderLines", spacing, margin);
  const auto radiusOf = [&](std::int64_t point)
  { return lines.radius.empty() ? UsualRadius : lines.radius[point]; };
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    for (const std::int64_t point : line)
    {
      const Vector3 reach = Vector3::Constant(radiusOf(point) + margin);
      low = low.cwiseMin(lines.points[point] - reach);
      high = high.cwiseMax(lines.points[point] + reach);
    }
  }
  VesselImage image = ImageAround(low, high, spacing);
  const double step = image.grid.spacing[0];
  const std::int64_t columns = image.grid.extent[1] + 1;
  const std::int64_t rows = image.grid.extent[3] + 1;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    for (std::size_t n = 0; n + 1 < line.size(); ++n)
    {
      const Vector3& a = lines.points[line[n]];
      const Vector3& b = lines.points[line[n + 1]];
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
            const SegmentPlace place = NearestOnSegment(low + step * Vector3(i, j, k), a, b);
            const double wall = (1.0 - place.fraction) * radiusOf(line[n]) +
              place.fraction * radiusOf(line[n + 1]) - std::sqrt(place.squaredDistance);
            float& value = image.values[(k * rows + j) * columns + i];
            value =
              std::max(value, static_cast<float>(std::clamp(0.5 + 0.5 * wall / step, 0.0, 1.0)));
          }
        }
      }
    }
  }
  return image;
}

VesselImage RenderSurface(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, double spacing, double margin)
{
  CheckSpacing("RenderSurface", spacing, margin);
  if (triangles.empty())
  {
    throw std::invalid_argument("There are no triangles");
  }
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const Triangle& triangle : triangles)
  {
    for (const std::int64_t corner : triangle)
    {
      if (corner < 0 || corner >= static_cast<std::int64_t>(points.size()))
      {
        throw std::invalid_argument(
          "A triangle has the corner " + std::to_string(corner) + ", which is none of the points");
      }
      if (!points[corner].allFinite())
      {
        throw std::invalid_argument("Point " + std::to_string(corner) + " is not finite");
      }
      low = low.cwiseMin(points[corner]);
      high = high.cwiseMax(points[corner]);
    }
  }
  const std::vector<Triangle> welded = Welded(points, triangles);
  if (const std::size_t open = OpenEdges(welded))
  {
    throw std::invalid_argument("The surface is not closed, or its triangles are not turned the "
                                "same way: at " +
      std::to_string(open) + (open == 1 ? " edge" : " edges"));
  }
  VesselImage image =
    ImageAround(low - Vector3::Constant(margin), high + Vector3::Constant(margin), spacing);
  const SurfaceFiller filler(points, welded, image);
  ParallelFor(image.grid.extent[5] + 1, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t slice = first; slice < last; ++slice)
      {
        filler.Fill(static_cast<int>(slice), 0);
        filler.Fill(static_cast<int>(slice), 1);
      }
    });
  if (std::all_of(
        image.values.begin(), image.values.end(), [](float value) { return value == 0.0F; }))
  {
    throw std::invalid_argument("The surface encloses nothing");
  }
  return image;
}
}
