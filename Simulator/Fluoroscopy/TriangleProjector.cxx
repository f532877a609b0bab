#include "TriangleProjector.h"

#include "TubeProjection.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace coronary
{
namespace
{
constexpr const char* SurfaceWords = "surface";
constexpr double NearestDepth = 10.0; // mm from the source

void CheckClosed(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  struct Edge
  {
    std::int64_t low;
    std::int64_t high;
    int direction;
  };
  const auto count = static_cast<std::int64_t>(points.size());
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& triangle : triangles)
  {
    for (int k = 0; k < 3; ++k)
    {
      const std::int64_t a = triangle[k];
      const std::int64_t b = triangle[(k + 1) % 3];
      if (a < 0 || a >= count)
      {
        throw std::invalid_argument("surface: a triangle's corner is " + std::to_string(a) +
          ", of " + std::to_string(count) + " points");
      }
      edges.push_back({ std::min(a, b), std::max(a, b), a < b ? 1 : -1 });
    }
  }
  const auto key = [](const Edge& edge) { return std::pair(edge.low, edge.high); };
  std::sort(
    edges.begin(), edges.end(), [&](const Edge& a, const Edge& b) { return key(a) < key(b); });
  std::size_t open = 0;
  for (std::size_t first = 0; first < edges.size();)
  {
    int sum = 0;
    std::size_t last = first;
    for (; last < edges.size() && key(edges[last]) == key(edges[first]); ++last)
    {
      sum += edges[last].direction;
    }
    open += sum != 0 && edges[first].low != edges[first].high ? 1 : 0;
    first = last;
  }
  if (open > 0)
  {
    throw std::invalid_argument("surface: " + std::to_string(open) +
      " edges are not used as often in one direction as in the other; it has to be closed and "
      "consistently oriented");
  }
}

/// 1: outwards, -1: inwards.
double OrientationOf(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  double volume = 0.0;
  for (const Triangle& t : triangles)
  {
    const Vector3 a = points[t[0]] - points[triangles[0][0]];
    const Vector3 b = points[t[1]] - points[triangles[0][0]];
    const Vector3 c = points[t[2]] - points[triangles[0][0]];
    volume += a.dot(b.cross(c));
  }
  return volume < 0.0 ? -1.0 : 1.0;
}

/// What rays have met, per pixel.
struct Crossings
{
  double way = 0.0; ///< from the reference plane; leaving minus entering, mm
  int balance = 0;
};

class SurfaceRays
{
public:
  SurfaceRays(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles,
    const CArmGeometry& geometry)
    : Points(points)
    , Triangles(triangles)
    , Geometry(geometry)
  {
    double nearest = HUGE_VAL;
    double farthest = 0.0;
    this->Seen.reserve(points.size());
    for (const Vector3& point : points)
    {
      this->Seen.push_back(geometry.Project(point));
      nearest = std::min(nearest, this->Seen.back().z());
      farthest = std::max(farthest, this->Seen.back().z());
    }
    RequireWithin(SurfaceWords, "its distance from the source", nearest, NearestDepth, 1e7);
    this->Reference = 0.5 * (nearest + farthest) / geometry.Pose().sourceToDetector;
  }

  void AddTo(std::vector<Crossings>& pixels) const
  {
    const DetectorFormat& format = this->Geometry.Format();
    for (const Triangle& triangle : this->Triangles)
    {
      const auto range = [&](int axis, int count)
      {
        const auto [low, high] = std::minmax({ this->Seen[triangle[0]][axis],
          this->Seen[triangle[1]][axis], this->Seen[triangle[2]][axis] });
        return std::pair(static_cast<int>(std::floor(std::clamp(low, 0.0, double(count)))),
          static_cast<int>(std::ceil(std::clamp(high, -1.0, count - 1.0))));
      };
      const auto [left, right] = range(0, format.columns);
      const auto [top, bottom] = range(1, format.rows);
      for (int row = top; row <= bottom; ++row)
      {
        for (int column = left; column <= right; ++column)
        {
          this->Meet(triangle, this->Ray(column, row),
            pixels[static_cast<std::size_t>(row) * format.columns + column]);
        }
      }
    }
  }

  /// All faces, for a ray beside the pixel's centre.
  Crossings Beside(int column, int row, double offset) const
  {
    Crossings crossings;
    const Vector3 ray = this->Ray(column + offset, row + 0.7 * offset);
    for (const Triangle& triangle : this->Triangles)
    {
      this->Meet(triangle, ray, crossings);
    }
    return crossings;
  }

private:
  Vector3 Ray(double column, double row) const
  {
    return this->Geometry.PixelPosition(column, row) - this->Geometry.Source();
  }

  /// On which side of a ray an edge is, as seen from a to b: computed in one way for both its faces.
  bool IsLeft(std::int64_t a, std::int64_t b, const Vector3& ray) const
  {
    const Vector3& source = this->Geometry.Source();
    const Vector3 normal =
      (this->Points[std::min(a, b)] - source).cross(this->Points[std::max(a, b)] - source);
    // Exactly on it: as if the ray were moved by a very small amount across, and a much smaller one down.
    for (const Vector3& direction :
      { ray, this->Geometry.ColumnDirection(), this->Geometry.RowDirection() })
    {
      const double side = direction.dot(normal);
      if (side != 0.0)
      {
        return (side > 0.0) == (a < b);
      }
    }
    return a < b;
  }

  void Meet(const Triangle& t, const Vector3& ray, Crossings& crossings) const
  {
    const bool left = this->IsLeft(t[0], t[1], ray);
    if (left != this->IsLeft(t[1], t[2], ray) || left != this->IsLeft(t[2], t[0], ray))
    {
      return;
    }
    const Vector3& a = this->Points[t[0]];
    const Vector3 normal = (this->Points[t[1]] - a).cross(this->Points[t[2]] - a);
    const double toDetector = this->Geometry.Pose().sourceToDetector;
    const auto [nearest, farthest] =
      std::minmax({ this->Seen[t[0]].z(), this->Seen[t[1]].z(), this->Seen[t[2]].z() });
    const Vector3 reference = this->Geometry.Source() + this->Reference * ray;
    const double place = normal.dot(a - reference) / normal.dot(ray);
    // A face that is seen from its side is met anywhere on it.
    const double low = nearest / toDetector - this->Reference;
    const double high = farthest / toDetector - this->Reference;
    const double bounded = place >= low ? std::min(place, high) : low;
    crossings.way += (left ? 1.0 : -1.0) * bounded * ray.norm();
    crossings.balance += left ? 1 : -1;
  }

  const std::vector<Vector3>& Points;
  const std::vector<Triangle>& Triangles;
  const CArmGeometry& Geometry;
  std::vector<Vector3> Seen; ///< column, row, depth
  double Reference = 0.0;    ///< the plane, in shares of the way to the detector
};

/// Rounding may set a ray on different sides of a corner's edges: one beside it then.
Crossings Balanced(const SurfaceRays& rays, int column, int row)
{
  double offset = 1e-7;
  for (int attempt = 0; attempt < 8; ++attempt, offset *= 2.7)
  {
    const Crossings crossings = rays.Beside(column, row, offset);
    if (crossings.balance == 0)
    {
      return crossings;
    }
  }
  throw std::runtime_error("surface: the ray through column " + std::to_string(column) + ", row " +
    std::to_string(row) + " does not leave it as often as it enters");
}
}

void AddSurface(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles,
  double attenuation, const CArmGeometry& geometry, LineIntegrals& image)
{
  RequireFormat(SurfaceWords, geometry, image);
  RequireWithin(SurfaceWords, "the attenuation (1/mm)", attenuation, 0.0, 1000.0);
  RequirePoints(SurfaceWords, points);
  CheckClosed(points, triangles);
  if (triangles.empty())
  {
    return;
  }
  const SurfaceRays rays(points, triangles, geometry);
  std::vector<Crossings> pixels(image.values.size());
  rays.AddTo(pixels);
  const double factor = attenuation * OrientationOf(points, triangles);
  std::vector<float> added(image.values.size());
  for (std::size_t k = 0; k < pixels.size(); ++k)
  {
    const int column = static_cast<int>(k % static_cast<std::size_t>(image.columns));
    const int row = static_cast<int>(k / static_cast<std::size_t>(image.columns));
    const Crossings crossings = pixels[k].balance == 0 ? pixels[k] : Balanced(rays, column, row);
    added[k] = static_cast<float>(factor * crossings.way);
  }
  std::transform(added.begin(), added.end(), image.values.begin(), image.values.begin(),
    [](float a, float b) { return a + b; });
}
}
