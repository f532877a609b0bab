/**
 * @file XRayTestScenes.h
 * @brief C-arms and a body of ellipsoids.
 */
#ifndef DynamicCoronary_XRayTestScenes_h
#define DynamicCoronary_XRayTestScenes_h

#include "CArm.h"
#include "ScalarImage.h"
#include "TableRow.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace coronary
{
constexpr double Degrees = 3.14159265358979323846 / 180.0;

/// Angles in degrees; square pixels on 200 mm.
inline CArmGeometry CArmAt(double primary, double secondary, int size = 512, double width = 200.0,
  const Vector3& isocentre = Vector3::Zero())
{
  CArmPose pose;
  pose.primary = primary * Degrees;
  pose.secondary = secondary * Degrees;
  pose.isocentre = isocentre;
  return { pose, { size, size, width, width } };
}

struct Ellipsoid
{
  Vector3 centre;
  Vector3 radii;
  double value; ///< instead of what is there without it

  double Inside(const Vector3& p) const
  {
    return 1.0 - (p - this->centre).cwiseQuotient(this->radii).squaredNorm();
  }

  /// Way of the line through a and b within.
  double Chord(const Vector3& a, const Vector3& b) const
  {
    const Vector3 from = (a - this->centre).cwiseQuotient(this->radii);
    const Vector3 way = (b - a).cwiseQuotient(this->radii);
    const double half = from.dot(way);
    const double root = half * half - way.squaredNorm() * (from.squaredNorm() - 1.0);
    return root > 0.0 ? 2.0 * std::sqrt(root) / way.squaredNorm() * (b - a).norm() : 0.0;
  }
};

/// The mean over each voxel, as a scanner gives it: at the surfaces part of a voxel is inside.
inline std::vector<float> SampledEllipsoids(
  const std::vector<Ellipsoid>& ellipsoids, double outside, const ImageGrid& grid)
{
  static constexpr int parts = 5;
  const double reach = 0.5 * grid.spacing.norm();
  std::vector<float> values;
  const auto share = [&](const Ellipsoid& ellipsoid, int i, int j, int k)
  {
    const Vector3 p = grid.IndexToWorld(i, j, k);
    const double inside = ellipsoid.Inside(p);
    const double slope = 2.0 * reach / ellipsoid.radii.minCoeff() * 1.5;
    if (std::abs(inside) > slope * (1.0 + slope))
    {
      return inside > 0.0 ? 1.0 : 0.0;
    }
    int count = 0;
    for (int s = 0; s < parts * parts * parts; ++s)
    {
      const auto part = [](int n) { return (n + 0.5) / double{ parts } - 0.5; };
      count += ellipsoid.Inside(grid.IndexToWorld(i + part(s % parts), j + part(s / parts % parts),
                 k + part(s / parts / parts))) > 0.0
        ? 1
        : 0;
    }
    return static_cast<double>(count) / (parts * parts * parts);
  };
  for (int k = grid.extent[4]; k <= grid.extent[5]; ++k)
  {
    for (int j = grid.extent[2]; j <= grid.extent[3]; ++j)
    {
      for (int i = grid.extent[0]; i <= grid.extent[1]; ++i)
      {
        double value = outside;
        for (const Ellipsoid& ellipsoid : ellipsoids)
        {
          value += share(ellipsoid, i, j, k) * (ellipsoid.value - value);
        }
        values.push_back(static_cast<float>(value));
      }
    }
  }
  return values;
}

/// Voxels that are symmetric about the origin.
inline ImageGrid CentredGrid(const std::array<int, 3>& n, const Vector3& spacing,
  const Matrix3& direction = Matrix3::Identity())
{
  ImageGrid grid;
  grid.extent = { 0, n[0] - 1, 0, n[1] - 1, 0, n[2] - 1 };
  grid.spacing = spacing;
  grid.direction = direction;
  grid.origin = -(direction * spacing.cwiseProduct(0.5 * Vector3(n[0] - 1, n[1] - 1, n[2] - 1)));
  return grid;
}
}

#endif
